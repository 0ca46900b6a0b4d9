//! Writing a scene as TOML, OBJ, MTL and PNG files that load back to the same scene, to the bit.
//!
//! Numbers are written with the fewest digits that read back to the same 32-bit value. Not kept are
//! the time (what is loaded is at 0 s), the names of textures (they become PNG files in
//! `textures/`), model names that are longer than a file's or have characters that are not fit for
//! one, and equal names of models.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use glam::Vec3;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};

use crate::image::write_exr;
use crate::output::{self, is_same_file};
use crate::text::{self, number};

use super::{
    Camera, ClearSky, Environment, Keyframe, Light, Material, Model, Scene, SceneError, Sky,
    SkySource, Texture, Triangle,
};

/// The file of its environment map.
const SKY: &str = "sky.exr";

impl Scene {
    /// Writes the scene into `folder`, which is made where it does not exist, and answers the path
    /// of the `.toml` file in it. A file that the scene was read from is never replaced: that is
    /// an error, before anything is written.
    pub fn write(&self, folder: &Path) -> Result<PathBuf, SceneError> {
        let mut names = Names::default();
        let mut file = |name: &str| format!("textures/{}.png", names.unique(name));
        let lobes: Vec<u32> = self
            .materials
            .iter()
            .filter_map(|material| material.specular?.texture)
            .collect();
        let textures: Vec<TextureFiles> = (0..)
            .zip(&self.textures)
            .map(|(index, texture)| {
                let stem = stem(&texture.name);
                TextureFiles {
                    color: file(&stem),
                    roughness: (lobes.contains(&index)).then(|| file(&format!("{stem}_roughness"))),
                }
            })
            .collect();
        let mut names = Names::default();
        let models: Vec<(String, &Model)> = self
            .models
            .iter()
            .map(|model| (names.unique(&model.name), model))
            .collect();
        let path = folder.join(format!("{}.toml", file_name(&self.name)));
        let sky = self.environment.sky().filter(|sky| is_written(sky));
        let sky = sky.map(|sky| (folder.join(SKY), sky));
        let model_files = |(name, _): &(String, &Model)| {
            ["mtl", "obj"].map(|extension| folder.join(format!("{name}.{extension}")))
        };
        let written = textures
            .iter()
            .flat_map(|files| std::iter::once(&files.color).chain(&files.roughness))
            .map(|file| folder.join(file))
            .chain(models.iter().flat_map(model_files))
            .chain(sky.iter().map(|(path, _)| path.clone()))
            .chain([path.clone()]);
        check_not_read(&self.files, written)?;
        self.write_textures(folder, &textures)?;
        fs::create_dir_all(folder).map_err(|error| SceneError::write(folder, error))?;
        for (name, model) in &models {
            write_file(
                &folder.join(format!("{name}.mtl")),
                &self.mtl(model, &textures),
            )?;
            write_file(&folder.join(format!("{name}.obj")), &self.obj(model, name))?;
        }
        if let Some((path, sky)) = sky {
            write_exr(&path, sky.image()).map_err(|error| SceneError::write(&path, error))?;
        }
        write_file(&path, &self.toml(&models))?;
        Ok(path)
    }

    /// Writes all textures to their paths relative to `folder`.
    fn write_textures(&self, folder: &Path, files: &[TextureFiles]) -> Result<(), SceneError> {
        if !self.textures.is_empty() {
            let textures = folder.join("textures");
            fs::create_dir_all(&textures).map_err(|error| SceneError::write(&textures, error))?;
        }
        self.textures
            .iter()
            .zip(files)
            .try_for_each(|(texture, files)| {
                let color = folder.join(&files.color);
                let Some(roughness) = &files.roughness else {
                    return write_png(&color, texture);
                };
                let with = |texel: fn([u8; 4]) -> [u8; 4]| Texture {
                    texels: texture.texels.iter().map(|each| texel(*each)).collect(),
                    ..Texture::clone(texture)
                };
                write_png(&color, &with(|[r, g, b, _]| [r, g, b, 255]))?;
                write_png(&folder.join(roughness), &with(|[.., a]| [a, a, a, 255]))
            })
    }

    fn triangles_of(&self, model: &Model) -> &[Triangle] {
        let first = model.first_triangle as usize;
        &self.triangles[first..first + model.triangle_count as usize]
    }

    /// Names of the model's materials in the MTL, by index; equal names are told apart.
    fn material_names(&self, model: &Model) -> Vec<(u32, String)> {
        let mut names = Names::default();
        let mut indices: Vec<u32> = self
            .triangles_of(model)
            .iter()
            .map(|triangle| triangle.material)
            .collect();
        indices.dedup();
        indices
            .into_iter()
            .map(|index| {
                (
                    index,
                    names.unique_as_is(&self.materials[index as usize].name),
                )
            })
            .collect()
    }

    fn mtl(&self, model: &Model, textures: &[TextureFiles]) -> String {
        let mut text = String::new();
        for (index, name) in self.material_names(model) {
            push_material(&mut text, &name, &self.materials[index as usize], textures);
        }
        text
    }

    fn obj(&self, model: &Model, file: &str) -> String {
        let mut text = format!("# Triangles: {}\nmtllib {file}.mtl\n", model.triangle_count);
        let triangles = self.triangles_of(model);
        let indices = || triangles.iter().flat_map(|triangle| triangle.vertices);
        let (first, last) = (indices().min().unwrap_or(0), indices().max().unwrap_or(0));
        let posed = || &self.vertices[first as usize..=last as usize];
        for vertex in model
            .motion
            .as_ref()
            .map_or_else(posed, |motion| &motion.rest)
        {
            let ([x, y, z], [nx, ny, nz]) = (vertex.position, vertex.normal);
            // Writing to a String cannot fail.
            let _ = writeln!(
                text,
                "v {x} {y} {z}\nvt {} {}\nvn {nx} {ny} {nz}",
                vertex.u, vertex.v
            );
        }
        let names = self.material_names(model);
        let mut current = None;
        for triangle in triangles {
            if current != Some(triangle.material) {
                current = Some(triangle.material);
                let name = names
                    .iter()
                    .find(|(index, _)| *index == triangle.material)
                    .map_or("", |(_, name)| name);
                let _ = writeln!(text, "usemtl {name}");
            }
            let [a, b, c] = triangle.vertices.map(|index| index - first + 1);
            let _ = writeln!(text, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}");
        }
        text
    }

    fn toml(&self, models: &[(String, &Model)]) -> String {
        let mut text = String::new();
        for (name, model) in models {
            let dynamic = if model.dynamic {
                "dynamic = true\n"
            } else {
                ""
            };
            let _ = writeln!(
                text,
                "[[model]]\npath = {}\n{dynamic}",
                text::quoted(&format!("{name}.obj"))
            );
            for Keyframe { time_s, pose } in
                model.motion.iter().flat_map(|motion| &motion.keyframes)
            {
                let (translate, rotate_deg) = (vector(pose.translate), vector(pose.rotate_deg));
                let _ = writeln!(
                    text,
                    "[[model.keyframe]]\ntime_s = {}\ntranslate = {translate}\nrotate_deg \
                     = {rotate_deg}\n",
                    number(*time_s)
                );
            }
        }
        let camera = &self.camera;
        let (eye, target, up) = (vector(camera.eye), vector(camera.target), vector(camera.up));
        let _ = writeln!(
            text,
            "[camera]\neye = {eye}\ntarget = {target}\nup = {up}\nvfov_deg = {}\n",
            number(camera.vfov_deg)
        );
        for light in &self.lights {
            push_light(&mut text, light);
        }
        if let Some(sky) = self.environment.sky() {
            let source = match sky.source() {
                Some(SkySource::Clear(clear)) if !is_written(sky) => clear_sky(clear),
                _ => format!("map = \"{SKY}\""),
            };
            let (scale, rotate_deg) = (number(sky.scale()), number(sky.rotate_deg()));
            let _ = writeln!(
                text,
                "[environment]\n{source}\nscale = {scale}\nrotate_deg = {rotate_deg}"
            );
        } else if !self.environment.is_black() {
            let _ = writeln!(
                text,
                "[environment]\nradiance = {}",
                vector(self.environment.uniform())
            );
        }
        text
    }
}

fn push_light(text: &mut String, light: &Light) {
    let _ = match *light {
        Light::Directional {
            direction,
            irradiance,
        } => {
            writeln!(
                text,
                "[[light]]\nkind = \"directional\"\ndirection = {}\nirradiance = {}\n",
                vector(direction),
                vector(irradiance)
            )
        }
        Light::Point {
            position,
            intensity,
        } => {
            writeln!(
                text,
                "[[light]]\nkind = \"point\"\nposition = {}\nintensity = {}\n",
                vector(position),
                vector(intensity)
            )
        }
        Light::Spot {
            position,
            direction,
            intensity,
            inner_deg,
            outer_deg,
        } => writeln!(
            text,
            "[[light]]\nkind = \"spot\"\nposition = {}\ndirection = {}\nintensity = {}\ninner_deg \
             = {}\nouter_deg = {}\n",
            vector(position),
            vector(direction),
            vector(intensity),
            number(inner_deg),
            number(outer_deg)
        ),
    };
}

/// Files of a texture, relative to the scene's.
struct TextureFiles {
    /// All of it, or the colour of a lobe.
    color: String,
    /// The alpha of a lobe.
    roughness: Option<String>,
}

fn push_material(text: &mut String, name: &str, material: &Material, textures: &[TextureFiles]) {
    let color = |color: Vec3| format!("{} {} {}", color.x, color.y, color.z);
    let _ = writeln!(text, "newmtl {name}\nKd {}", color(material.albedo));
    if material.emission != Vec3::ZERO || material.emission_texture.is_some() {
        let _ = writeln!(text, "Ke {}", color(material.emission));
    }
    if let Some(specular) = material.specular {
        let _ = writeln!(
            text,
            "Ks {}\nPr {}\nPm {}",
            color(specular.f0),
            specular.roughness,
            specular.metalness
        );
    }
    if let Some(transmission) = material.transmission {
        let illum = if transmission.index > 1.0 { 7 } else { 4 };
        let _ = writeln!(
            text,
            "d {}\nTf {}\nNi {}\nillum {illum}",
            1.0 - transmission.share,
            color(transmission.filter),
            transmission.index
        );
    }
    let maps = [
        ("map_Kd", material.albedo_texture),
        ("map_Ke", material.emission_texture),
        ("map_d", material.mask_texture),
        ("norm", material.normal_texture),
        ("map_Ks", material.specular.and_then(|lobe| lobe.texture)),
    ];
    for (key, texture) in maps {
        let files = texture.and_then(|index| textures.get(index as usize));
        if let Some(files) = files {
            let _ = writeln!(text, "{key} {}", files.color);
        }
        if let (Some(roughness), "map_Ks") = (files.and_then(|files| files.roughness.as_ref()), key)
        {
            let _ = writeln!(text, "map_Pr {roughness}");
        }
    }
    text.push('\n');
}

/// A camera on one line in the scene format, for [`Scene::overlay`]; reads back to the same camera,
/// to the bit.
pub fn camera_toml(camera: &Camera) -> String {
    let Camera {
        eye,
        target,
        up,
        vfov_deg,
    } = *camera;
    format!(
        "camera = {{ eye = {}, target = {}, up = {}, vfov_deg = {} }}",
        vector(eye),
        vector(target),
        vector(up),
        number(vfov_deg)
    )
}

/// An environment on one line in the scene format, likewise; `None` where it is an image in memory.
pub fn environment_toml(environment: &Environment) -> Option<String> {
    let Some(sky) = environment.sky() else {
        let radiance = vector(environment.uniform());
        return Some(format!("environment = {{ radiance = {radiance} }}"));
    };
    let source = match sky.source()? {
        SkySource::File(path) => {
            let path = std::path::absolute(path).ok()?;
            format!("map = {}", ::toml::Value::from(path.to_str()?))
        }
        SkySource::Clear(clear) => clear_sky(clear),
    };
    let (scale, rotate_deg) = (number(sky.scale()), number(sky.rotate_deg()));
    let split = match sky.sun() {
        Some(_) => ", split_sun = true",
        None => "",
    };
    Some(format!(
        "environment = {{ {source}, scale = {scale}, rotate_deg = {rotate_deg}{split} }}"
    ))
}

/// Whether its texels are kept in a file: a map, or what is left of one without its sun, which is
/// among the lights.
fn is_written(sky: &Sky) -> bool {
    sky.sun().is_some() || !matches!(sky.source(), Some(SkySource::Clear(_)))
}

fn clear_sky(sky: &ClearSky) -> String {
    format!(
        "clear_sky = {{ sun_height_deg = {}, turbidity = {}, ground = {}, sun = {} }}",
        number(sky.sun_height_deg),
        number(sky.turbidity),
        vector(sky.ground),
        sky.has_sun
    )
}

/// Lights on one line in the scene format, likewise.
pub fn lights_toml(lights: &[Light]) -> String {
    let inline = |light: &Light| {
        let mut text = String::new();
        push_light(&mut text, light);
        let keys: Vec<&str> = text.lines().filter(|line| line.contains('=')).collect();
        format!("{{ {} }}", keys.join(", "))
    };
    format!(
        "light = [{}]",
        lights.iter().map(inline).collect::<Vec<_>>().join(", ")
    )
}

/// A TOML array.
fn vector(vector: Vec3) -> String {
    text::vector(vector.to_array())
}

/// An error where a file that is to be written is one that was read.
pub(super) fn check_not_read(
    read: &[PathBuf],
    written: impl IntoIterator<Item = PathBuf>,
) -> Result<(), SceneError> {
    for file in written {
        if read.iter().any(|known| is_same_file(known, &file)) {
            return Err(SceneError::file(
                &file,
                "the scene was read from this file, which would be replaced",
                "write into another folder",
            ));
        }
    }
    Ok(())
}

fn write_file(path: &Path, text: &str) -> Result<(), SceneError> {
    output::write_text(path, text).map_err(|error| SceneError::write(path, error))
}

pub(super) fn write_png(path: &Path, texture: &Texture) -> Result<(), SceneError> {
    let bytes: &[u8] = bytemuck::cast_slice(&texture.texels);
    let (width, height) = (texture.width, texture.height);
    output::write_file(path, |file| {
        PngEncoder::new(file).write_image(bytes, width, height, ExtendedColorType::Rgba8)
    })
    .map_err(|error: image::ImageError| SceneError::write(path, error))
}

/// A texture's name without folders and extension.
pub(super) fn stem(name: &str) -> String {
    let stem = Path::new(name).file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// Bytes of a name, so that a number and an extension fit into the 255 of a file system.
const LONGEST_NAME: usize = 240;

/// The name with everything replaced that has a meaning in a path, no longer than a file's may be.
pub(super) fn file_name(name: &str) -> String {
    let kept = |c: char| {
        if c.is_alphanumeric() || matches!(c, '-' | '_' | ' ') {
            c
        } else {
            '_'
        }
    };
    let fits = |(at, c): &(usize, char)| at + c.len_utf8() <= LONGEST_NAME;
    let fitting = name.trim().char_indices().take_while(fits);
    let name: String = fitting.map(|(_, c)| kept(c)).collect();
    if name.is_empty() {
        String::from("unnamed")
    } else {
        name
    }
}

/// Names given so far; a name that is taken gets a number.
#[derive(Default)]
pub(super) struct Names(BTreeSet<String>);

impl Names {
    /// A name fit for a file, different from all others in more than upper and lower case.
    pub(super) fn unique(&mut self, wanted: &str) -> String {
        self.add(&file_name(wanted), str::to_lowercase)
    }

    /// A name different from all others; upper and lower case count as different.
    fn unique_as_is(&mut self, wanted: &str) -> String {
        self.add(wanted, str::to_owned)
    }

    fn add(&mut self, wanted: &str, key: fn(&str) -> String) -> String {
        let numbered = (2..).map(|number| format!("{wanted}_{number}"));
        let free = std::iter::once(wanted.to_owned())
            .chain(numbered)
            .find(|name| !self.0.contains(&key(name)));
        let name = free.unwrap_or_else(|| wanted.to_owned());
        self.0.insert(key(&name));
        name
    }
}
