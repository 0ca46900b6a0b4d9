//! The textures that the materials of a scene ask for, read once each.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;

use super::mtl::{MapRef, MtlMaterial};
use super::picture::{self, Use};
use super::{LoadOptions, Material, SceneError, Texture, paths};
use crate::text::counted;

/// Where the bytes of a picture are.
#[derive(Clone)]
pub(super) enum PictureBytes {
    /// In a file of their own.
    File(PathBuf),
    /// In another file, which has been read.
    Held(Arc<[u8]>),
}

impl PictureBytes {
    /// The encoded picture; `path` is for messages.
    pub(super) fn read(&self, path: &Path) -> Result<Cow<'_, [u8]>, SceneError> {
        match self {
            PictureBytes::File(file) => std::fs::read(file)
                .map(Cow::Owned)
                .map_err(|error| SceneError::read(path, error)),
            PictureBytes::Held(bytes) => Ok(Cow::Borrowed(bytes)),
        }
    }
}

/// A picture that a material names.
pub(super) struct Picture {
    /// The file, or the place in a file: no two pictures have the same.
    pub(super) path: PathBuf,
    /// As written, with forward slashes.
    name: String,
    /// `None` where there is no such file.
    pub(super) bytes: Option<PictureBytes>,
    /// What wants it, for messages.
    wanted_by: String,
}

impl Picture {
    /// The picture that a file in `folder` calls `name`.
    pub(super) fn named(folder: &Path, name: &str, wanted_by: &str) -> Picture {
        let found = paths::resolve(folder, name);
        Picture {
            path: found.clone().unwrap_or_else(|| folder.join(name)),
            name: name.replace('\\', "/"),
            bytes: found.map(PictureBytes::File),
            wanted_by: wanted_by.to_owned(),
        }
    }

    /// A picture whose bytes stand in another file.
    pub(super) fn held(path: PathBuf, name: String, bytes: Vec<u8>) -> Picture {
        Picture {
            path,
            name,
            bytes: Some(PictureBytes::Held(bytes.into())),
            wanted_by: String::new(),
        }
    }
}

/// One texture to read.
struct Request {
    picture: Picture,
    wanted: Use,
    /// What is added to values after the second has multiplied them.
    base_and_gain: [f32; 2],
}

/// Collects requests, so that all missing files are reported together and each file is read once.
#[derive(Default)]
pub(super) struct TextureRequests {
    requests: Vec<Request>,
    /// By path, use with its number, and the bits of what is done to values.
    index_from_picture: HashMap<(PathBuf, [u32; 4]), u32>,
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
        let textures =
            self.requests
                .iter()
                .filter_map(|request| match request.picture.bytes.as_ref()? {
                    PictureBytes::File(path) => Some(path),
                    PictureBytes::Held(_) => None,
                });
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
            map.as_ref().map(|map| {
                let wanted_by = format!("material `{}`, {}:{}", mtl.name, file.display(), map.line);
                let picture = Picture::named(paths::folder_of(file), &map.path, &wanted_by);
                self.add(picture, wanted, map.base_and_gain)
            })
        };
        let bump_multiplier = mtl.bump.as_ref().map_or(1.0, |map| map.bump_multiplier);
        Material {
            albedo_texture: index(&mtl.map_kd, Use::Color),
            emission_texture: index(&mtl.map_ke, Use::Color),
            mask_texture: index(&mtl.map_d, Use::Mask),
            normal_texture: index(&mtl.norm, Use::Normal(1.0))
                .or_else(|| index(&mtl.bump, Use::Bump(bump_multiplier))),
            ..material
        }
    }

    /// The index of a texture: values of the picture (colours, coverage, heights) are added to
    /// the first of `base_and_gain` after the second has multiplied them.
    pub(super) fn add(&mut self, picture: Picture, wanted: Use, base_and_gain: [f32; 2]) -> u32 {
        let [base, gain] = base_and_gain.map(f32::to_bits);
        let [kind, number] = wanted.key();
        let key = (picture.path.clone(), [kind, number, base, gain]);
        if let Some(index) = self.index_from_picture.get(&key) {
            return *index;
        }
        if picture.bytes.is_none() {
            let kind = paths::not_a_file(&picture.path)
                .map(|kind| format!("{kind}, not a file; "))
                .unwrap_or_default();
            self.missing.push(format!(
                "{} ({kind}{})",
                picture.path.display(),
                picture.wanted_by
            ));
        }
        let index = self.requests.len() as u32;
        self.requests.push(Request {
            picture,
            wanted,
            base_and_gain,
        });
        self.index_from_picture.insert(key, index);
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
            let Picture {
                path, name, bytes, ..
            } = &request.picture;
            let texture = match bytes {
                Some(bytes) => picture::read(
                    path,
                    &bytes.read(path)?,
                    name,
                    request.wanted,
                    request.base_and_gain,
                )?,
                None => request.wanted.placeholder(name),
            };
            Ok(Arc::new(texture))
        };
        self.requests.par_iter().map(read).collect()
    }
}
