//! MTL materials, parsed line by line, and their meaning as [`Material`]s.
//!
//! Read: `Kd`, `Ke`, `Ks`, `Ns`, `Pr`, `Pm`, `d`, `Tr`, `Ni`, `Tf`, `illum`, `map_Kd`, `map_Ke`,
//! `map_Ks`, `map_Pr`, `map_d`, `norm`, `map_Bump`, `bump`. `Ka` has no part in physically based
//! light transport and is passed over; other keys are passed over with one warning.
//!
//! Where `d` is below 1 and no `map_d` is there, a share 1 − `d` of the surface is clear, with the
//! filter `Tf`. With `illum` 6 or 7 ("refraction on") it is the surface of a body with the index
//! of refraction `Ni`; otherwise a thin sheet, which light passes straight, whatever `Ni` says:
//! programs write an `Ni` for every material.
//!
//! Of the options of maps, `-s` and `-o` are baked into texture coordinates, `-mm` into texels and
//! `-bm` into normals; each kind of the others that would change the picture gets one warning.
//!
//! A specular lobe needs a roughness: `Pr` (perceptual r, GGX α = r²), or else `Ns`, by matching
//! the Blinn-Phong lobe: α = √(2 / (Ns + 2)), r = √α. F0 is `Ks`; where `Pr` is there without `Ks`,
//! F0 is 0.04. `map_Ks` and the red of `map_Pr` are factors of both; a factor is 1 where it is
//! given by its map alone.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::Vec3;

use super::obj::TEXCOORD_MAX;
use super::{Material, SceneError, Specular, Transmission, paths};
use crate::text::{counted, number};

/// Largest radiance that a material may emit [W/(m² sr)]: beyond it 32-bit sums lose meaning.
pub(super) const EMISSION_MAX: f32 = 1e12;

/// A texture that a material refers to.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MapRef {
    /// The path as written.
    pub(super) path: String,
    /// Line in the MTL.
    pub(super) line: usize,
    /// `-bm`: height of a bump map.
    pub(super) bump_multiplier: f32,
    /// `-mm`: what is added to values after the second has multiplied them; \[0, 1\] for nothing.
    pub(super) base_and_gain: [f32; 2],
    /// `-s`, then `-o`.
    shift: UvShift,
}

/// What a map does to texture coordinates: they are multiplied, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct UvShift {
    /// Line in the MTL.
    line: usize,
    scale: [f32; 2],
    offset: [f32; 2],
}

impl UvShift {
    fn at(line: usize) -> UvShift {
        UvShift {
            line,
            scale: [1.0; 2],
            offset: [0.0; 2],
        }
    }

    fn is_same(&self, other: &UvShift) -> bool {
        self.scale == other.scale && self.offset == other.offset
    }

    /// The coordinates that a texture is looked up at.
    pub(super) fn apply(&self, texcoord: [f32; 2]) -> [f32; 2] {
        std::array::from_fn(|axis| texcoord[axis] * self.scale[axis] + self.offset[axis])
    }

    /// An error where one of the coordinates would go out of range; `path` is the MTL.
    pub(super) fn check(&self, path: &Path, texcoords: &[[f32; 2]]) -> Result<(), SceneError> {
        let is_far = |value: &f32| value.abs() > TEXCOORD_MAX || !value.is_finite();
        let moved = texcoords.iter().flat_map(|texcoord| self.apply(*texcoord));
        match moved.into_iter().find(is_far) {
            None => Ok(()),
            Some(value) => Err(SceneError::line(
                path,
                self.line,
                format!(
                    "`-s` and `-o` make the texture coordinate {}, out of range",
                    number(value)
                ),
                format!(
                    "they must keep it between {} and {}",
                    number(-TEXCOORD_MAX),
                    number(TEXCOORD_MAX)
                ),
            )),
        }
    }
}

/// Largest index of refraction that the format has.
const MOST_INDEX: f32 = 10.0;

/// Options of maps that are not done, for one warning each: how many maps have one, and the line of
/// the first.
type Undone = BTreeMap<String, (usize, usize)>;

/// One `newmtl`, as written.
#[derive(Clone, Debug, Default)]
pub(super) struct MtlMaterial {
    /// Name after `newmtl`.
    pub(super) name: String,
    kd: Option<Vec3>,
    ke: Option<Vec3>,
    ks: Option<Vec3>,
    ns: Option<f32>,
    pr: Option<f32>,
    pm: Option<f32>,
    dissolve: Option<f32>,
    ni: Option<f32>,
    tf: Option<Vec3>,
    illum: Option<f32>,
    /// `map_Kd`: albedo.
    pub(super) map_kd: Option<MapRef>,
    /// `map_Ke`: emission.
    pub(super) map_ke: Option<MapRef>,
    /// `map_Ks`: F0.
    pub(super) map_ks: Option<MapRef>,
    /// `map_Pr`: roughness.
    pub(super) map_pr: Option<MapRef>,
    /// `map_d`: coverage.
    pub(super) map_d: Option<MapRef>,
    /// `norm`: a tangent-space normal map.
    pub(super) norm: Option<MapRef>,
    /// `map_Bump` or `bump`: heights.
    pub(super) bump: Option<MapRef>,
}

impl MtlMaterial {
    /// Whether light passes all of it unchanged.
    pub(super) fn is_nothing(&self) -> bool {
        let whole =
            |one: Transmission| one.share == 1.0 && one.index == 1.0 && one.filter == Vec3::ONE;
        self.transmission().is_some_and(whole)
    }

    /// What is clear of it.
    fn transmission(&self) -> Option<Transmission> {
        let share = 1.0 - self.dissolve.filter(|_| self.map_d.is_none())?;
        let refracts = matches!(self.illum, Some(6.0 | 7.0));
        (share > 0.0).then(|| Transmission {
            share,
            filter: self.tf.unwrap_or(Vec3::ONE),
            index: self.ni.filter(|_| refracts).unwrap_or(1.0).max(1.0),
        })
    }

    /// What its maps do to texture coordinates, `None` for nothing: what the first does. The
    /// second value is true where another map does something else.
    pub(super) fn uv_shift(&self) -> (Option<UvShift>, bool) {
        let bump = self.bump.as_ref().filter(|_| self.norm.is_none());
        let maps = [&self.map_kd, &self.map_ke, &self.map_ks, &self.map_pr];
        let mut shifts = maps
            .into_iter()
            .chain([&self.map_d, &self.norm])
            .flatten()
            .chain(bump)
            .map(|map| map.shift);
        let Some(first) = shifts.next() else {
            return (None, false);
        };
        let is_torn = shifts.any(|shift| !shift.is_same(&first));
        let is_there = !first.is_same(&UvShift::at(first.line));
        (is_there.then_some(first), is_torn)
    }

    /// The material, without its textures. The second value is true where a specular colour is
    /// ignored for want of a roughness.
    pub(super) fn to_material(&self) -> (Material, bool) {
        let (specular, ignored) = self.specular();
        let untextured = Material::default().albedo;
        let albedo = self.kd.unwrap_or(if self.map_kd.is_some() {
            Vec3::ONE
        } else {
            untextured
        });
        let emission = self.ke.unwrap_or(if self.map_ke.is_some() {
            Vec3::ONE
        } else {
            Vec3::ZERO
        });
        (
            Material {
                name: self.name.clone(),
                albedo,
                emission,
                specular,
                transmission: self.transmission(),
                ..Material::default()
            },
            ignored,
        )
    }

    fn specular(&self) -> (Option<Specular>, bool) {
        let metalness = self.pm.unwrap_or(0.0);
        // A map without its factor is as it is.
        let pr = self.pr.or(self.map_pr.as_ref().map(|_| 1.0));
        let ks = self.ks.or(self.map_ks.as_ref().map(|_| Vec3::ONE));
        let wanted = metalness > 0.0 || ks.map_or(pr.is_some(), |ks| ks != Vec3::ZERO);
        let roughness = pr.or(self.ns.map(|ns| (2.0 / (ns + 2.0)).sqrt().sqrt()));
        match roughness {
            Some(roughness) if wanted => (
                Some(Specular {
                    f0: ks.unwrap_or(Vec3::splat(0.04)),
                    roughness,
                    metalness,
                    texture: None,
                }),
                false,
            ),
            _ => (None, wanted),
        }
    }
}

/// Parses the text of an MTL file; `path` is for messages only.
pub(super) fn parse(path: &Path, text: &str) -> Result<Vec<MtlMaterial>, SceneError> {
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let (mut unread, mut undone) = (BTreeSet::new(), Undone::new());
    for (number, line) in paths::joined_lines(text) {
        let at = At { path, line: number };
        let (key, rest) = line
            .trim()
            .split_once(char::is_whitespace)
            .unwrap_or((line.trim(), ""));
        // Names may hold a #; behind numbers it begins a comment.
        let is_named = key == "newmtl" || key == "norm" || key == "bump" || key.starts_with("map_");
        let rest = if is_named {
            rest.trim()
        } else {
            rest.split('#').next().unwrap_or_default().trim()
        };
        if key.starts_with('#') {
            continue;
        }
        if key == "newmtl" {
            materials.push(MtlMaterial {
                name: rest.to_owned(),
                ..MtlMaterial::default()
            });
        } else if let Some(material) = materials.last_mut() {
            read_key(&at, material, [key, rest], &mut unread, &mut undone)?;
        } else if !key.is_empty() {
            return Err(at.error(
                format!("`{key}` stands before the first `newmtl`"),
                "begin the material with `newmtl NAME`",
            ));
        }
    }
    if !unread.is_empty() {
        let keys: Vec<_> = unread.iter().map(|key| format!("`{key}`")).collect();
        log::warn!(
            "{}: these keys have no meaning here and are ignored: {}",
            path.display(),
            keys.join(", ")
        );
    }
    for (option, (count, line)) in undone {
        let maps = if count == 1 { "map has" } else { "maps have" };
        log::warn!(
            "{}:{line}: {count} {maps} the option `{option}`, which is not done; the map is used \
             without it",
            path.display()
        );
    }
    Ok(materials)
}

fn read_key(
    at: &At,
    material: &mut MtlMaterial,
    [key, rest]: [&str; 2],
    unread: &mut BTreeSet<String>,
    undone: &mut Undone,
) -> Result<(), SceneError> {
    let mut map = || at.map(key, rest, undone).map(Some);
    match key {
        "Kd" => material.kd = Some(at.color(key, rest, 1.0)?),
        "Ks" => material.ks = Some(at.color(key, rest, 1.0)?),
        "Ke" => material.ke = Some(at.color(key, rest, EMISSION_MAX)?),
        "Ns" => material.ns = Some(at.number(key, rest, f32::MAX)?),
        "Pr" => material.pr = Some(at.number(key, rest, 1.0)?),
        "Pm" => material.pm = Some(at.number(key, rest, 1.0)?),
        "d" => {
            material.dissolve =
                Some(at.number(key, rest.trim_start_matches("-halo").trim(), 1.0)?)
        }
        "Tr" => material.dissolve = Some(1.0 - at.number(key, rest, 1.0)?),
        "map_Kd" => material.map_kd = map()?,
        "map_Ke" => material.map_ke = map()?,
        "map_Ks" => material.map_ks = map()?,
        "map_Pr" => material.map_pr = map()?,
        "map_d" => material.map_d = map()?,
        "norm" => material.norm = map()?,
        "map_Bump" | "map_bump" | "bump" => material.bump = map()?,
        "Ni" => material.ni = Some(at.number(key, rest, MOST_INDEX)?),
        "Tf" => material.tf = Some(at.color(key, rest, 1.0)?),
        "illum" => material.illum = Some(at.number(key, rest, 10.0)?),
        "" | "Ka" | "map_Ka" => {}
        _ => {
            unread.insert(key.to_owned());
        }
    }
    Ok(())
}

/// Where in the file we are.
struct At<'a> {
    path: &'a Path,
    line: usize,
}

impl At<'_> {
    /// One number from 0 to `max`.
    fn number(&self, key: &str, text: &str, max: f32) -> Result<f32, SceneError> {
        let value: f32 = text.parse().map_err(|_| {
            self.error(
                format!("`{key}` is `{text}`, which is not a number"),
                "write one decimal number",
            )
        })?;
        if !(0.0..=max).contains(&value) {
            let range = if max == f32::MAX {
                String::from("0 or more")
            } else {
                format!("between 0 and {max}")
            };
            return Err(self.error(
                format!("`{key}` is {text}, out of range"),
                format!("it must be {range}"),
            ));
        }
        Ok(value)
    }

    /// Three numbers from 0 to `max`; one number stands for a grey.
    fn color(&self, key: &str, text: &str, max: f32) -> Result<Vec3, SceneError> {
        let values = text
            .split_whitespace()
            .map(|word| self.number(key, word, max))
            .collect::<Result<Vec<_>, _>>()?;
        match values[..] {
            [grey] => Ok(Vec3::splat(grey)),
            [r, g, b] => Ok(Vec3::new(r, g, b)),
            _ => Err(self.error(
                format!("`{key}` has {}", counted(values.len(), "number")),
                "give red, green and blue, or one number for a grey",
            )),
        }
    }

    /// A texture path after its options.
    fn map(&self, key: &str, text: &str, undone: &mut Undone) -> Result<MapRef, SceneError> {
        let mut map = MapRef {
            path: String::new(),
            line: self.line,
            bump_multiplier: 1.0,
            base_and_gain: [0.0, 1.0],
            shift: UvShift::at(self.line),
        };
        let mut rest = text;
        while let Some(option) = rest.strip_prefix('-') {
            let (name, after) = cut_word(option);
            let mut words = Vec::new();
            rest = after;
            for taken in 0..words_of(name) {
                let (word, after) = cut_word(rest);
                let is_vector = matches!(name, "o" | "s" | "t");
                if is_vector && taken > 0 && word.parse::<f32>().is_err() {
                    break;
                }
                words.push(word);
                rest = after;
            }
            if !self.option(key, name, &words, &mut map)? {
                let option = format!("-{name} {}", words.join(" "));
                let known = ["blendu", "blendv", "cc", "clamp"].contains(&name);
                let kind = if known {
                    &option
                } else {
                    &option[..=name.len()]
                };
                undone.entry(kind.to_owned()).or_insert((0, self.line)).0 += 1;
            }
        }
        if rest.is_empty() {
            return Err(self.error(format!("`{key}` names no file"), "give the texture's path"));
        }
        rest.clone_into(&mut map.path);
        Ok(map)
    }

    /// Takes one option of a map; false where it changes the picture but is not done.
    fn option(
        &self,
        key: &str,
        name: &str,
        words: &[&str],
        map: &mut MapRef,
    ) -> Result<bool, SceneError> {
        let number = |word: &str| {
            let number = word.parse().ok().filter(|value: &f32| value.is_finite());
            number.ok_or_else(|| {
                self.error(
                    format!("`{key} -{name}` is `{word}`, which is not a finite number"),
                    "write one decimal number",
                )
            })
        };
        let keeps_values = matches!(key, "norm" | "map_Ks" | "map_Pr");
        match (name, words) {
            ("bm", [word]) => map.bump_multiplier = number(word)?,
            ("mm", [base, gain]) if !keeps_values => {
                map.base_and_gain = [number(base)?, number(gain)?];
            }
            ("s" | "o", [first, ..]) => {
                let vector = match name {
                    "s" => &mut map.shift.scale,
                    _ => &mut map.shift.offset,
                };
                vector[0] = number(first)?;
                if let Some(second) = words.get(1) {
                    vector[1] = number(second)?;
                }
            }
            ("clamp" | "cc", ["off"]) | ("blendu" | "blendv", ["on"]) => {}
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn error(&self, problem: String, hint: impl Into<String>) -> SceneError {
        SceneError::line(self.path, self.line, problem, hint)
    }
}

/// The first word of a text, and what follows it.
fn cut_word(text: &str) -> (&str, &str) {
    let (word, after) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, after.trim_start())
}

/// The most words that follow an option of a map.
fn words_of(option: &str) -> usize {
    match option {
        "o" | "s" | "t" => 3,
        "mm" => 2,
        _ => 1,
    }
}
