//! The textures that the materials of a scene ask for, read once each.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;

use super::mtl::{MapRef, MtlMaterial};
use super::picture::{self, Use};
use super::{LoadOptions, Material, SceneError, Texture, TextureKind, paths};
use crate::text::counted;

/// One texture to read.
struct Request {
    /// As written in the MTL, with forward slashes.
    name: String,
    file: Option<PathBuf>,
    wanted: Use,
    /// What is added to values after the second has multiplied them.
    base_and_gain: [f32; 2],
}

/// Collects requests, so that all missing files are reported together and each file is read once.
#[derive(Default)]
pub(super) struct TextureRequests {
    requests: Vec<Request>,
    /// By path, kind, and the bits of `-bm` and `-mm`.
    index_from_file: HashMap<(PathBuf, TextureKind, [u32; 3]), u32>,
    missing: Vec<String>,
    /// Models and material libraries that were read.
    sources: Vec<PathBuf>,
}

impl TextureRequests {
    /// A model or material library that was read.
    pub(super) fn add_source(&mut self, file: &Path) {
        self.sources.push(file.to_owned());
    }

    /// All files that the scene is read from, textures included.
    pub(super) fn files(&self) -> impl Iterator<Item = PathBuf> {
        let textures = self.requests.iter().flat_map(|request| &request.file);
        self.sources.iter().chain(textures).cloned()
    }

    /// The material with the indices of the textures that `mtl` (in `file`) names.
    pub(super) fn texture(
        &mut self,
        file: &Path,
        mtl: &MtlMaterial,
        material: Material,
    ) -> Material {
        let mut index = |map: &Option<MapRef>, wanted: Use| {
            map.as_ref().map(|map| self.request(file, mtl, map, wanted))
        };
        let bump_multiplier = mtl.bump.as_ref().map_or(1.0, |map| map.bump_multiplier);
        Material {
            albedo_texture: index(&mtl.map_kd, Use::Color),
            emission_texture: index(&mtl.map_ke, Use::Color),
            mask_texture: index(&mtl.map_d, Use::Mask),
            normal_texture: index(&mtl.norm, Use::Normal)
                .or_else(|| index(&mtl.bump, Use::Bump(bump_multiplier))),
            ..material
        }
    }

    fn request(&mut self, mtl_file: &Path, mtl: &MtlMaterial, map: &MapRef, wanted: Use) -> u32 {
        let found = paths::resolve(paths::folder_of(mtl_file), &map.path);
        let path = found
            .clone()
            .unwrap_or_else(|| paths::folder_of(mtl_file).join(&map.path));
        let multiplier = if let Use::Bump(multiplier) = wanted {
            multiplier
        } else {
            0.0
        };
        let [base, gain] = map.base_and_gain;
        let numbers = [multiplier, base, gain].map(f32::to_bits);
        let key = (path, wanted.kind(), numbers);
        if let Some(index) = self.index_from_file.get(&key) {
            return *index;
        }
        if found.is_none() {
            let kind = paths::not_a_file(&key.0)
                .map(|kind| format!("{kind}, not a file; "))
                .unwrap_or_default();
            self.missing.push(format!(
                "{} ({kind}material `{}`, {}:{})",
                key.0.display(),
                mtl.name,
                mtl_file.display(),
                map.line
            ));
        }
        let index = self.requests.len() as u32;
        self.requests.push(Request {
            name: map.path.replace('\\', "/"),
            file: found,
            wanted,
            base_and_gain: map.base_and_gain,
        });
        self.index_from_file.insert(key, index);
        index
    }

    /// Reads all textures, in order of request.
    pub(super) fn read(self, options: &LoadOptions) -> Result<Vec<Arc<Texture>>, SceneError> {
        if !self.missing.is_empty() {
            if !options.allow_missing_textures {
                return Err(SceneError::MissingTextures {
                    missing: self.missing,
                });
            }
            log::warn!(
                "{}, rendered mid-grey: {}",
                counted(self.missing.len(), "missing texture"),
                self.missing.join(", ")
            );
        }
        let read = |request: &Request| {
            let texture = match &request.file {
                Some(file) => {
                    picture::read(file, &request.name, request.wanted, request.base_and_gain)?
                }
                None => request.wanted.placeholder(&request.name),
            };
            Ok(Arc::new(texture))
        };
        self.requests.par_iter().map(read).collect()
    }
}
