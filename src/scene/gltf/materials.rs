//! Metal-rough materials as [`Material`]s, and which texture coordinates their maps use.

use std::path::PathBuf;

use glam::{Affine2, Vec2, Vec3};
use gltf::material::AlphaMode;
use gltf::texture::{self, WrappingMode};

use super::super::lobes::{MetalRough, Recipe};
use super::super::mtl::EMISSION_MAX;
use super::super::picture::Use;
use super::super::textures::{Picture, TextureRequests};
use super::super::{Material, SceneError, Specular, paths};
use super::Undone;
use super::file::{File, Resource};

/// F0 of a dielectric of index 1.5.
const F0: f32 = 0.04;

/// Alpha below which there is no surface where a material blends.
const BLEND_CUTOFF: f32 = 0.5;

/// Where the maps of a material are looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lookup {
    /// Set of texture coordinates.
    pub(super) set: u32,
    /// What is done to them (v down).
    pub(super) transform: Affine2,
    /// Whether a sampler does not repeat the picture.
    pub(super) is_clamped: bool,
}

impl Default for Lookup {
    fn default() -> Self {
        Lookup {
            set: 0,
            transform: Affine2::IDENTITY,
            is_clamped: false,
        }
    }
}

/// All materials of a file, then the default one.
pub(super) struct Materials {
    /// By index.
    pub(super) list: Vec<Material>,
    /// Whether alpha removes the surface.
    pub(super) removed: Vec<bool>,
    /// Where maps are looked up.
    pub(super) lookups: Vec<Lookup>,
}

/// Makes materials out of a file's.
pub(super) struct Reader<'a> {
    /// The file.
    pub(super) file: &'a File,
    /// Takes the textures.
    pub(super) requests: &'a mut TextureRequests,
    /// What is not done.
    pub(super) undone: &'a mut Undone,
}

impl<'a> Reader<'a> {
    /// A reader that has read nothing.
    pub(super) fn new(
        file: &'a File,
        requests: &'a mut TextureRequests,
        undone: &'a mut Undone,
    ) -> Self {
        Reader {
            file,
            requests,
            undone,
        }
    }

    /// All materials.
    pub(super) fn read(mut self) -> Result<Materials, SceneError> {
        let mut materials = Materials {
            list: Vec::new(),
            removed: Vec::new(),
            lookups: Vec::new(),
        };
        for material in self.file.document.materials() {
            let (converted, is_removed, lookup) = self.material(&material)?;
            materials.list.push(converted);
            materials.removed.push(is_removed);
            materials.lookups.push(lookup);
        }
        materials.list.push(Material::default());
        materials.removed.push(false);
        materials.lookups.push(Lookup::default());
        Ok(materials)
    }

    fn material(
        &mut self,
        material: &gltf::Material,
    ) -> Result<(Material, bool, Lookup), SceneError> {
        let name = name_of(material);
        let mut maps = Maps::default();
        let mut converted = Material {
            name,
            ..Material::default()
        };
        let (base, base_map) = match material.pbr_specular_glossiness() {
            Some(glossy) => self.specular_glossy(&glossy, &mut converted, &mut maps)?,
            None => self.metal_rough(material, &mut converted, &mut maps)?,
        };
        let [r, g, b, alpha] = base;
        converted.albedo = Vec3::new(r, g, b).clamp(Vec3::ZERO, Vec3::ONE);
        let is_removed = self.cut(material, alpha, base_map.as_ref(), &mut converted)?;
        self.emission(material, &mut converted, &mut maps)?;
        if let Some(normal) = material.normal_texture() {
            let wanted = Use::Normal(normal.scale());
            converted.normal_texture = Some(self.texture(&normal.texture(), wanted, [0.0, 1.0])?);
            maps.add_plain(normal.tex_coord(), &normal.texture());
        }
        if material.unlit() {
            self.undone.add("unlit materials are lit like all others");
        }
        let (lookup, is_torn) = maps.lookup();
        if is_torn {
            self.undone.add(
                "materials whose maps have several texture coordinates: all use those of the \
                 first map",
            );
        }
        Ok((converted, is_removed, lookup))
    }

    /// Base colour with its map. The lobe, and the texture of what is diffuse, go to the material.
    fn metal_rough<'m>(
        &mut self,
        material: &gltf::Material<'m>,
        converted: &mut Material,
        maps: &mut Maps,
    ) -> Result<Base<'m>, SceneError> {
        let pbr = material.pbr_metallic_roughness();
        let base = pbr.base_color_factor();
        let base_map = pbr.base_color_texture();
        maps.extend(base_map.as_ref());
        let factors = MetalRough {
            base: Vec3::new(base[0], base[1], base[2]),
            f0: self.f0(material).clamp(Vec3::ZERO, Vec3::ONE),
            metalness: pbr.metallic_factor().clamp(0.0, 1.0),
            roughness: pbr.roughness_factor().clamp(0.0, 1.0),
        };
        let Some(info) = pbr.metallic_roughness_texture() else {
            let reflects = factors.f0 != Vec3::ZERO || factors.metalness > 0.0;
            converted.specular = reflects.then_some(Specular {
                f0: factors.f0,
                roughness: factors.roughness,
                metalness: factors.metalness,
                texture: None,
            });
            converted.albedo_texture = self.color(base_map.as_ref())?;
            return Ok((base, base_map));
        };
        maps.extend(Some(&info));
        let mut make = |recipe| -> Result<u32, SceneError> {
            let of = |info: &texture::Info| self.picture(&info.texture().source());
            let pictures = [base_map.as_ref().map(of).transpose()?, Some(of(&info)?)];
            Ok(self.requests.add_made(pictures, recipe))
        };
        converted.albedo_texture = match factors.metalness {
            0.0 => None,
            _ => Some(make(Recipe::Diffuse(factors))?),
        };
        converted.specular = Some(Specular {
            f0: Vec3::ONE,
            roughness: 1.0,
            metalness: 0.0,
            texture: Some(make(Recipe::MetalRough(factors))?),
        });
        if converted.albedo_texture.is_none() {
            converted.albedo_texture = self.color(base_map.as_ref())?;
        }
        Ok((base, base_map))
    }

    /// F0 of what is no metal.
    fn f0(&mut self, material: &gltf::Material) -> Vec3 {
        let f0 = Vec3::splat(match material.ior().unwrap_or(1.5) {
            1.5 => F0,
            // An index of 0 stands for a mirror, in files that had specular-glossy materials.
            0.0 => 1.0,
            ior => ((ior - 1.0) / (ior + 1.0)).powi(2),
        });
        let Some(specular) = material.specular() else {
            return f0;
        };
        if specular.specular_texture().is_some() || specular.specular_color_texture().is_some() {
            self.undone.add("maps of KHR_materials_specular");
        }
        let color = Vec3::from(specular.specular_color_factor());
        (f0 * color).min(Vec3::ONE) * specular.specular_factor()
    }

    /// The same of the older model, whose map has F0 and glossiness.
    fn specular_glossy<'m>(
        &mut self,
        glossy: &gltf::material::PbrSpecularGlossiness<'m>,
        converted: &mut Material,
        maps: &mut Maps,
    ) -> Result<Base<'m>, SceneError> {
        let base_map = glossy.diffuse_texture();
        maps.extend(base_map.as_ref());
        converted.albedo_texture = self.color(base_map.as_ref())?;
        let f0 = Vec3::from(glossy.specular_factor()).clamp(Vec3::ZERO, Vec3::ONE);
        let glossiness = glossy.glossiness_factor().clamp(0.0, 1.0);
        let map = glossy.specular_glossiness_texture();
        maps.extend(map.as_ref());
        let texture = match &map {
            Some(info) => {
                let picture = self.picture(&info.texture().source())?;
                let recipe = Recipe::SpecularGlossy(glossiness);
                Some(self.requests.add_made([Some(picture), None], recipe))
            }
            None => None,
        };
        converted.specular = (f0 != Vec3::ZERO).then_some(Specular {
            f0,
            roughness: if map.is_some() { 1.0 } else { 1.0 - glossiness },
            metalness: 0.0,
            texture,
        });
        Ok((glossy.diffuse_factor(), base_map))
    }

    fn color(&mut self, map: Option<&texture::Info>) -> Result<Option<u32>, SceneError> {
        map.map(|info| self.texture(&info.texture(), Use::Color, [0.0, 1.0]))
            .transpose()
    }

    /// Where alpha cuts the surface; true where it removes all of it.
    fn cut(
        &mut self,
        material: &gltf::Material,
        alpha: f32,
        map: Option<&texture::Info>,
        converted: &mut Material,
    ) -> Result<bool, SceneError> {
        let cutoff = match material.alpha_mode() {
            AlphaMode::Opaque => return Ok(false),
            AlphaMode::Mask => material.alpha_cutoff().unwrap_or(0.5),
            AlphaMode::Blend => {
                self.undone.add(
                    "materials that blend: they are whole where alpha is 0.5 or more, and gone \
                     elsewhere",
                );
                BLEND_CUTOFF
            }
        };
        if alpha < cutoff {
            return Ok(true);
        }
        if let Some(info) = map.filter(|_| cutoff > 0.0) {
            // Masks are cut at 0.5.
            let gain = 0.5 * alpha / cutoff;
            converted.mask_texture = self.mask(&info.texture(), gain)?;
        }
        Ok(false)
    }

    fn emission(
        &mut self,
        material: &gltf::Material,
        converted: &mut Material,
        maps: &mut Maps,
    ) -> Result<(), SceneError> {
        let emission =
            Vec3::from(material.emissive_factor()) * material.emissive_strength().unwrap_or(1.0);
        if !emission.cmpge(Vec3::ZERO).all() || !emission.cmple(Vec3::splat(EMISSION_MAX)).all() {
            let place = format!("materials[{}]", material.index().unwrap_or(0));
            return Err(self.file.error(&place, "emits no radiance from 0 to 1e12"));
        }
        converted.emission = emission;
        if let Some(info) = material
            .emissive_texture()
            .filter(|_| emission != Vec3::ZERO)
        {
            converted.emission_texture =
                Some(self.texture(&info.texture(), Use::Color, [0.0, 1.0])?);
            maps.extend(Some(&info));
        }
        Ok(())
    }

    fn texture(
        &mut self,
        texture: &gltf::Texture,
        wanted: Use,
        base_and_gain: [f32; 2],
    ) -> Result<u32, SceneError> {
        let picture = self.picture(&texture.source())?;
        Ok(self.requests.add(picture, wanted, base_and_gain))
    }

    /// The mask in the alpha of a texture; `None` where no texel is cut.
    fn mask(&mut self, texture: &gltf::Texture, gain: f32) -> Result<Option<u32>, SceneError> {
        Ok(Some(self.texture(texture, Use::Alpha, [0.0, gain])?))
    }

    fn picture(&self, image: &gltf::Image) -> Result<Picture, SceneError> {
        let (path, wanted_by) = (&self.file.path, format!("images[{}]", image.index()));
        Ok(match self.file.picture(image)? {
            Resource::Inside(bytes) => Picture::held(
                PathBuf::from(format!("{}#{wanted_by}", path.display())),
                image.name().map_or(wanted_by, str::to_owned),
                bytes,
            ),
            Resource::File(name) => Picture::named(
                paths::folder_of(path),
                &name,
                &format!("{}, `{wanted_by}`", path.display()),
            ),
        })
    }
}

/// Base colour with alpha, and its map.
type Base<'m> = ([f32; 4], Option<texture::Info<'m>>);

/// The lookups of a material's maps.
#[derive(Default)]
struct Maps(Vec<Lookup>);

impl Maps {
    fn extend(&mut self, info: Option<&texture::Info>) {
        let Some(info) = info else {
            return;
        };
        let transform = info.texture_transform();
        let set = transform
            .as_ref()
            .and_then(|transform| transform.tex_coord());
        let affine = transform.map_or(Affine2::IDENTITY, |transform| {
            let [x, y] = transform.scale();
            // Turned against the clock, as seen: v points down.
            Affine2::from_translation(Vec2::from(transform.offset()))
                * Affine2::from_angle(-transform.rotation())
                * Affine2::from_scale(Vec2::new(x, y))
        });
        self.0.push(Lookup {
            set: set.unwrap_or(info.tex_coord()),
            transform: affine,
            is_clamped: is_clamped(&info.texture()),
        });
    }

    fn add_plain(&mut self, set: u32, texture: &gltf::Texture) {
        // The transform of a normal map is not read by the crate; it is the others', as a rule.
        let transform = self.0.first().filter(|first| first.set == set);
        self.0.push(Lookup {
            set,
            transform: transform.map_or(Affine2::IDENTITY, |first| first.transform),
            is_clamped: is_clamped(texture),
        });
    }

    /// That of the first map, and whether another has another one.
    fn lookup(&self) -> (Lookup, bool) {
        let Some(first) = self.0.first() else {
            return (Lookup::default(), false);
        };
        let differs = |other: &Lookup| (other.set, other.transform) != (first.set, first.transform);
        let is_clamped = self.0.iter().any(|lookup| lookup.is_clamped);
        let lookup = Lookup {
            is_clamped,
            ..*first
        };
        (lookup, self.0.iter().any(differs))
    }
}

fn is_clamped(texture: &gltf::Texture) -> bool {
    let sampler = texture.sampler();
    [sampler.wrap_s(), sampler.wrap_t()]
        .iter()
        .any(|mode| *mode != WrappingMode::Repeat)
}

/// A name fit for an MTL.
fn name_of(material: &gltf::Material) -> String {
    let name: String = material
        .name()
        .unwrap_or_default()
        .chars()
        .map(|c| if c.is_control() { '_' } else { c })
        .collect();
    match (name.trim(), material.index()) {
        ("", Some(index)) => format!("material_{index}"),
        (name, _) => name.to_owned(),
    }
}
