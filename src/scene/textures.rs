//! The textures that the materials of a scene ask for, read once each.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;

use super::lobes::Recipe;
use super::mtl::{MapRef, MtlMaterial};
use super::picture::{self, Use};
use super::{LoadOptions, Material, SceneError, Specular, Texture, paths};
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
    /// The second is of textures that are made of two.
    pictures: [Option<Picture>; 2],
    how: How,
}

/// What pictures become.
#[derive(Clone, Copy, Debug, PartialEq)]
enum How {
    /// The first, whose values are added to the first number after the second has multiplied them.
    One(Use, [f32; 2]),
    /// Both.
    Two(Recipe),
}

/// Collects requests, so that all missing files are reported together and each file is read once.
#[derive(Default)]
pub(super) struct TextureRequests {
    requests: Vec<Request>,
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
        let pictures = self.requests.iter().flat_map(|request| &request.pictures);
        let textures = pictures
            .flatten()
            .filter_map(|picture| match picture.bytes.as_ref()? {
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
        let picture = |map: &MapRef| {
            let wanted_by = format!("material `{}`, {}:{}", mtl.name, file.display(), map.line);
            Picture::named(paths::folder_of(file), &map.path, &wanted_by)
        };
        let specular = material.specular.map(|lobe| {
            let maps = [&mtl.map_ks, &mtl.map_pr].map(|map| map.as_ref().map(picture));
            let is_mapped = maps.iter().any(Option::is_some);
            let texture = is_mapped.then(|| self.add_made(maps, Recipe::ColorAndAlpha));
            Specular { texture, ..lobe }
        });
        let mut index = |map: &Option<MapRef>, wanted: Use| {
            let map = map.as_ref()?;
            Some(self.add(picture(map), wanted, map.base_and_gain))
        };
        let bump_multiplier = mtl.bump.as_ref().map_or(1.0, |map| map.bump_multiplier);
        Material {
            albedo_texture: index(&mtl.map_kd, Use::Color),
            emission_texture: index(&mtl.map_ke, Use::Color),
            mask_texture: index(&mtl.map_d, Use::Mask),
            normal_texture: index(&mtl.norm, Use::Normal(1.0))
                .or_else(|| index(&mtl.bump, Use::Bump(bump_multiplier))),
            specular,
            ..material
        }
    }

    /// The index of a texture: values of the picture (colours, coverage, heights) are added to
    /// the first of `base_and_gain` after the second has multiplied them.
    pub(super) fn add(&mut self, picture: Picture, wanted: Use, base_and_gain: [f32; 2]) -> u32 {
        self.request([Some(picture), None], How::One(wanted, base_and_gain))
    }

    /// The index of a texture that is made of two pictures.
    pub(super) fn add_made(&mut self, pictures: [Option<Picture>; 2], recipe: Recipe) -> u32 {
        self.request(pictures, How::Two(recipe))
    }

    fn request(&mut self, pictures: [Option<Picture>; 2], how: How) -> u32 {
        let path = |picture: &Option<Picture>| picture.as_ref().map(|picture| picture.path.clone());
        let wanted = pictures.each_ref().map(path);
        let is_same =
            |known: &Request| known.how == how && known.pictures.each_ref().map(path) == wanted;
        if let Some(index) = self.requests.iter().position(is_same) {
            return index as u32;
        }
        for picture in pictures.iter().flatten() {
            self.note_missing(picture);
        }
        let index = self.requests.len() as u32;
        self.requests.push(Request { pictures, how });
        index
    }

    fn note_missing(&mut self, picture: &Picture) {
        if picture.bytes.is_some() {
            return;
        }
        let kind = paths::not_a_file(&picture.path)
            .map(|kind| format!("{kind}, not a file; "))
            .unwrap_or_default();
        let entry = format!("{} ({kind}{})", picture.path.display(), picture.wanted_by);
        if !self.missing.contains(&entry) {
            self.missing.push(entry);
        }
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
        let read = |request: &Request| Ok(Arc::new(request.read()?));
        self.requests.par_iter().map(read).collect()
    }
}

impl Request {
    fn read(&self) -> Result<Texture, SceneError> {
        let mut names = self.pictures.iter().flatten().map(|picture| &*picture.name);
        let name = names.next_back().unwrap_or_default();
        match (self.how, &self.pictures) {
            (How::One(wanted, base_and_gain), [Some(picture), _]) => match &picture.bytes {
                Some(bytes) => {
                    let bytes = bytes.read(&picture.path)?;
                    picture::read(&picture.path, &bytes, name, wanted, base_and_gain)
                }
                None => Ok(wanted.placeholder(name)),
            },
            (How::One(wanted, _), _) => Ok(wanted.placeholder(name)),
            (How::Two(recipe), [first, second]) => {
                let decoded = |picture: &Option<Picture>| {
                    let picture = picture.as_ref();
                    let found =
                        picture.and_then(|picture| Some((picture, picture.bytes.as_ref()?)));
                    found
                        .map(|(picture, bytes)| {
                            picture::decode(&picture.path, &bytes.read(&picture.path)?)
                        })
                        .transpose()
                };
                Ok(recipe.make(name, [decoded(first)?, decoded(second)?]))
            }
        }
    }
}
