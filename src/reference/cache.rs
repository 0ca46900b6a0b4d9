//! References kept on disk under the hash of what they depend on.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::result::ReferenceImage;
use super::{ReferenceError, Settings, render};
use crate::image::{
    GuideImage, Image, IndirectImage, NO_SURFACE, Planes, read_planes, write_planes,
};
use crate::scene::{Fnv, Scene};

/// Part of every key: the layout of the files, and the hash of the path tracer's sources
/// (build.rs), so that no build shows the pictures of another.
const FORMAT: &str = concat!("lumivox reference 2 of ", env!("LUMIVOX_TRACER"));

/// The folder of the cache: `LUMIVOX_CACHE`, else `lumivox` in `XDG_CACHE_HOME`, else
/// `~/.cache/lumivox`, else a folder among the temporary files.
pub fn cache_dir() -> PathBuf {
    let variable = |name: &str| {
        std::env::var_os(name)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from)
    };
    variable("LUMIVOX_CACHE")
        .or_else(|| variable("XDG_CACHE_HOME").map(|path| path.join("lumivox")))
        .or_else(|| variable("HOME").map(|path| path.join(".cache").join("lumivox")))
        .unwrap_or_else(|| std::env::temp_dir().join("lumivox"))
}

/// [`render`], or the same image from the cache in `dir`. The key is a hash of the scene's content
/// and the settings, so a stale image is never found; a file that cannot be read is rendered again.
/// If the result cannot be kept, that is a warning, not an error.
pub fn cached(
    scene: &Scene,
    settings: &Settings,
    dir: &Path,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<ReferenceImage, ReferenceError> {
    settings.validate()?;
    let key = key(scene, settings);
    let path = dir.join(format!("reference-{key:032x}.exr"));
    if path.exists() {
        match read_planes(&path)
            .ok()
            .and_then(|planes| from_planes(&planes, settings))
        {
            Some(image) => return Ok(image),
            None => log::warn!(
                "the cached reference {} is damaged and is rendered again",
                path.display()
            ),
        }
    }
    let image = render(scene, settings, progress)?;
    if let Err(problem) = store(&image, dir, &path) {
        log::warn!(
            "the reference cannot be kept in the cache {}: {problem}; it will be rendered again",
            dir.display()
        );
    }
    Ok(image)
}

fn store(
    image: &ReferenceImage,
    dir: &Path,
    path: &Path,
) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(dir)?;
    Ok(write_planes(path, &to_planes(image))?)
}

/// The hash of everything that the image depends on.
fn key(scene: &Scene, settings: &Settings) -> u128 {
    let mut hash = Fnv::default();
    scene.hash_geometry(&mut hash);
    // Writing to a hash cannot fail.
    let _ = write!(hash, "{FORMAT} {} {settings:?}", scene.small_content());
    let _ = write!(hash, "{} {}", scene.vertices.len(), scene.triangles.len());
    hash.value()
}

fn to_planes(image: &ReferenceImage) -> Planes {
    let (width, height) = image.size();
    let mut planes = Planes::new(width, height);
    let vectors = |values: &[glam::Vec3]| Image {
        width,
        height,
        pixels: values.to_vec(),
    };
    planes.push_image("emission", &image.emission);
    planes.push_image("direct", &image.direct);
    planes.push_image("irradiance", &image.light.irradiance);
    planes.push_image("diffuse", &image.diffuse);
    planes.push_image("specular", &image.light.specular);
    planes.push_image("albedo", &image.albedo);
    planes.push_image("normal", &image.normal);
    planes.push_image("position", &vectors(&image.guide.position));
    planes.push_image("plane", &vectors(&image.guide.normal));
    planes.push("visibility", image.light.visibility.clone());
    planes.push("depth", image.guide.depth_m.clone());
    planes.push(
        "material",
        image
            .guide
            .material
            .iter()
            .map(|&material| {
                if material == NO_SURFACE {
                    -1.0
                } else {
                    material as f32
                }
            })
            .collect(),
    );
    planes.push("radiance_variance", image.radiance_variance.clone());
    planes.push("indirect_variance", image.indirect_variance.clone());
    planes.push("samples", image.samples.clone());
    planes
}

/// `None` where something is missing or of another size.
fn from_planes(planes: &Planes, settings: &Settings) -> Option<ReferenceImage> {
    if (planes.width, planes.height) != (settings.width, settings.height) {
        return None;
    }
    let values = |name: &str| planes.plane(name).map(<[f32]>::to_vec);
    Some(ReferenceImage {
        emission: planes.image("emission")?,
        direct: planes.image("direct")?,
        light: IndirectImage {
            irradiance: planes.image("irradiance")?,
            specular: planes.image("specular")?,
            visibility: values("visibility")?,
        },
        diffuse: planes.image("diffuse")?,
        albedo: planes.image("albedo")?,
        normal: planes.image("normal")?,
        guide: GuideImage {
            width: planes.width,
            height: planes.height,
            position: planes.image("position")?.pixels,
            normal: planes.image("plane")?.pixels,
            depth_m: values("depth")?,
            material: values("material")?
                .iter()
                .map(|&material| {
                    if material < 0.0 {
                        NO_SURFACE
                    } else {
                        material as u32
                    }
                })
                .collect(),
        },
        radiance_variance: values("radiance_variance")?,
        indirect_variance: values("indirect_variance")?,
        samples: values("samples")?,
    })
}
