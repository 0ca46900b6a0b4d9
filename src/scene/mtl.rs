//! MTL materials, parsed line by line, and their meaning as [`Material`]s.
//!
//! Read: `Kd`, `Ke`, `Ks`, `Ns`, `Pr`, `Pm`, `d`, `Tr`, `map_Kd`, `map_Ke`, `map_d`, `norm`,
//! `map_Bump`, `bump`. `Ka`, `Ni`, `Tf` and `illum` have no part in physically based light
//! transport and are passed over; other keys are passed over with one warning.
//!
//! A specular lobe needs a roughness: `Pr` (perceptual r, GGX α = r²), or else `Ns`, by matching
//! the Blinn-Phong lobe: α = √(2 / (Ns + 2)), r = √α. F0 is `Ks`; where `Pr` is there without `Ks`,
//! F0 is 0.04.

use std::collections::BTreeSet;
use std::path::Path;

use glam::Vec3;

use super::{Material, SceneError, Specular};

/// Largest radiance that a material may emit [W/(m² sr)]: beyond it 32-bit sums lose meaning.
const EMISSION_MAX: f32 = 1e12;

/// A texture that a material refers to.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MapRef {
    /// The path as written.
    pub(super) path: String,
    /// Line in the MTL.
    pub(super) line: usize,
    /// `-bm`: height of a bump map.
    pub(super) bump_multiplier: f32,
}

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
    /// `map_Kd`: albedo.
    pub(super) map_kd: Option<MapRef>,
    /// `map_Ke`: emission.
    pub(super) map_ke: Option<MapRef>,
    /// `map_d`: coverage.
    pub(super) map_d: Option<MapRef>,
    /// `norm`: a tangent-space normal map.
    pub(super) norm: Option<MapRef>,
    /// `map_Bump` or `bump`: heights.
    pub(super) bump: Option<MapRef>,
}

impl MtlMaterial {
    /// Whether a constant `d` below 0.5 removes the surface.
    pub(super) fn is_removed(&self) -> bool {
        self.map_d.is_none() && self.dissolve.is_some_and(|dissolve| dissolve < 0.5)
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
                ..Material::default()
            },
            ignored,
        )
    }

    fn specular(&self) -> (Option<Specular>, bool) {
        let metalness = self.pm.unwrap_or(0.0);
        let wanted = metalness > 0.0 || self.ks.map_or(self.pr.is_some(), |ks| ks != Vec3::ZERO);
        let roughness = self
            .pr
            .or(self.ns.map(|ns| (2.0 / (ns + 2.0)).sqrt().sqrt()));
        match roughness {
            Some(roughness) if wanted => (
                Some(Specular {
                    f0: self.ks.unwrap_or(Vec3::splat(0.04)),
                    roughness,
                    metalness,
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
    let mut unread = BTreeSet::new();
    for (index, line) in text.lines().enumerate() {
        let at = At {
            path,
            line: index + 1,
        };
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
            read_key(&at, material, key, rest, &mut unread)?;
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
    Ok(materials)
}

fn read_key<'a>(
    at: &At,
    material: &mut MtlMaterial,
    key: &'a str,
    rest: &str,
    unread: &mut BTreeSet<&'a str>,
) -> Result<(), SceneError> {
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
        "map_Kd" => material.map_kd = Some(at.map(key, rest)?),
        "map_Ke" => material.map_ke = Some(at.map(key, rest)?),
        "map_d" => material.map_d = Some(at.map(key, rest)?),
        "norm" => material.norm = Some(at.map(key, rest)?),
        "map_Bump" | "map_bump" | "bump" => material.bump = Some(at.map(key, rest)?),
        "" | "Ka" | "Ni" | "Tf" | "illum" | "map_Ka" => {}
        _ => {
            unread.insert(key);
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
                format!("`{key}` has {} numbers", values.len()),
                "give red, green and blue, or one number for a grey",
            )),
        }
    }

    /// A texture path after its options.
    fn map(&self, key: &str, text: &str) -> Result<MapRef, SceneError> {
        let mut rest = text;
        let mut bump_multiplier = 1.0;
        while let Some(option) = rest.strip_prefix('-') {
            let (name, after) = option
                .split_once(char::is_whitespace)
                .unwrap_or((option, ""));
            rest = after.trim_start();
            let is_vector = matches!(name, "o" | "s" | "t");
            let limit = if is_vector {
                3
            } else if name == "mm" {
                2
            } else {
                1
            };
            for taken in 0..limit {
                let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
                if is_vector && taken > 0 && word.parse::<f32>().is_err() {
                    break;
                }
                if name == "bm" {
                    bump_multiplier = word
                        .parse()
                        .ok()
                        .filter(|value: &f32| value.is_finite())
                        .ok_or_else(|| {
                            self.error(
                                format!("`{key} -bm` is `{word}`, which is not a finite number"),
                                "write one decimal number",
                            )
                        })?;
                }
                rest = after.trim_start();
            }
        }
        if rest.is_empty() {
            return Err(self.error(format!("`{key}` names no file"), "give the texture's path"));
        }
        Ok(MapRef {
            path: rest.to_owned(),
            line: self.line,
            bump_multiplier,
        })
    }

    fn error(&self, problem: String, hint: impl Into<String>) -> SceneError {
        SceneError::line(self.path, self.line, problem, hint)
    }
}
