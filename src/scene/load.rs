//! Scenes from files: the entry points, and the camera and light of scenes that have none.

use std::ffi::OsStr;
use std::path::Path;

use glam::Vec3;

use super::textures::TextureRequests;
use super::toml::{LIGHT_MAX, ModelEntry, SceneFile};
use super::{Camera, Light, Scene, SceneError, bundled, model, paths, toml};

/// How to load a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Render missing textures mid-grey, with a warning, where they would be an error.
    pub allow_missing_textures: bool,
}

/// Vertical field of view of a camera that is chosen from the bounds \[degrees\].
const CHOSEN_VFOV_DEG: f32 = 60.0;

impl Scene {
    /// Opens a scene as a user names it: `bundled:NAME`, `bundled:NAME,KEY=VALUE,…`, or the path of
    /// a `.toml` or `.obj` file.
    pub fn open(source: impl AsRef<OsStr>, options: &LoadOptions) -> Result<Scene, SceneError> {
        let source = source.as_ref();
        match source
            .to_str()
            .and_then(|text| text.strip_prefix("bundled:"))
        {
            Some(text) => {
                let (name, parameters) = bundled::parse_source(text)?;
                Scene::bundled(name, &parameters)
            }
            None => Scene::load(Path::new(source), options),
        }
    }

    /// Loads a `.toml` scene file, or an `.obj` alone, which gets a camera and a light chosen from
    /// its bounds.
    pub fn load(path: &Path, options: &LoadOptions) -> Result<Scene, SceneError> {
        let extension = path
            .extension()
            .unwrap_or_default()
            .to_string_lossy()
            .to_lowercase();
        if path.is_dir() {
            return Err(SceneError::read(
                path,
                std::io::ErrorKind::IsADirectory.into(),
            ));
        }
        match extension.as_str() {
            "toml" => {
                let text = std::fs::read(path).map_err(|error| SceneError::read(path, error))?;
                let text = String::from_utf8(text).map_err(|error| {
                    let line = 1 + error.as_bytes()[..error.utf8_error().valid_up_to()]
                        .iter()
                        .filter(|byte| **byte == b'\n')
                        .count();
                    SceneError::line(
                        path,
                        line,
                        "the text is not UTF-8",
                        "save the file as UTF-8",
                    )
                })?;
                Scene::from_file(path, toml::parse(path, &text)?, options)
            }
            "obj" => {
                let entry = ModelEntry {
                    path: path.to_owned(),
                    model: model::Use::default(),
                };
                let file = SceneFile {
                    models: vec![entry],
                    camera: None,
                    lights: Vec::new(),
                    environment: Vec3::ZERO,
                };
                let mut scene = Scene::from_parts(path, &file, options)?;
                scene.choose_camera();
                scene.choose_light();
                Ok(scene)
            }
            _ if !path.exists() => Err(SceneError::read(path, std::io::ErrorKind::NotFound.into())),
            _ => Err(SceneError::file(
                path,
                "this is neither a .toml nor an .obj file",
                "give a scene file, an OBJ model, or bundled:NAME",
            )),
        }
    }

    /// Replaces the camera, the lights or the environment by what a text in the scene format says;
    /// what the text does not name stays. `name` is for messages.
    pub fn overlay(&mut self, name: &str, text: &str) -> Result<(), SceneError> {
        let overlay = toml::parse_overlay(Path::new(name), text)?;
        self.camera = overlay.camera.unwrap_or(self.camera);
        self.environment = overlay.environment.unwrap_or(self.environment);
        if let Some(lights) = overlay.lights {
            self.lights = lights;
        }
        Ok(())
    }

    fn from_file(path: &Path, file: SceneFile, options: &LoadOptions) -> Result<Scene, SceneError> {
        let mut scene = Scene::from_parts(path, &file, options)?;
        scene.lights = file.lights;
        scene.environment = file.environment;
        match file.camera {
            Some(camera) => scene.camera = camera,
            None => scene.choose_camera(),
        }
        if !scene.is_lit() {
            log::warn!(
                "{}: no light, no emission and no environment: every image of it is black",
                path.display()
            );
        }
        Ok(scene)
    }

    fn from_parts(
        path: &Path,
        file: &SceneFile,
        options: &LoadOptions,
    ) -> Result<Scene, SceneError> {
        let mut requests = TextureRequests::default();
        let mut scene = Scene {
            name: paths::stem_of(path),
            ..Scene::default()
        };
        for entry in &file.models {
            let part = model::load(&entry.path, &entry.model, &mut requests)?;
            Scene::check_counts(
                path,
                scene.vertices.len() + part.vertices.len(),
                scene.triangles.len() + part.triangles.len(),
            )?;
            scene.add_part(part);
        }
        scene.files = std::iter::once(path.to_owned())
            .chain(requests.files())
            .collect();
        scene.textures = requests.read(options)?;
        scene.finish_textures();
        scene.set_time(0.0);
        Ok(scene)
    }

    /// Whether anything sends light into the scene.
    pub fn is_lit(&self) -> bool {
        let carries_light = |light: &Light| match *light {
            Light::Directional { irradiance, .. } => irradiance != Vec3::ZERO,
            Light::Point { intensity, .. } | Light::Spot { intensity, .. } => {
                intensity != Vec3::ZERO
            }
        };
        self.is_emissive()
            || self.environment != Vec3::ZERO
            || self.lights.iter().any(carries_light)
    }

    /// Whether most of the surface faces the middle of the bounds: a room, to be seen from inside.
    fn is_interior(&self, centre: Vec3) -> bool {
        let inwards = |corners: [Vec3; 3]| {
            let [a, b, c] = corners.map(|corner| corner.as_dvec3());
            let away = (a + b + c) / 3.0 - centre.as_dvec3();
            -(b - a).cross(c - a).dot(away.normalize_or_zero())
        };
        let corners = |vertices: [u32; 3]| {
            vertices.map(|index| Vec3::from(self.vertices[index as usize].position))
        };
        self.triangles
            .iter()
            .map(|triangle| inwards(corners(triangle.vertices)))
            .sum::<f64>()
            > 0.0
    }

    fn choose_camera(&mut self) {
        let Some((low, high)) = self.bounds() else {
            return;
        };
        // However small the scene is: eye and target stay two points after rounding.
        let least_m = (1e-5 * low.abs().max(high.abs()).max_element()).max(1e-15);
        let (centre, extent) = (0.5 * (low + high), (high - low).max(Vec3::splat(least_m)));
        let (eye, target, place) = if self.is_interior(centre) {
            let along = if extent.x > extent.z {
                Vec3::X
            } else {
                Vec3::Z
            };
            let eye = centre + 0.4 * along * extent - Vec3::Y * 0.15 * extent.y;
            (
                eye,
                eye - 0.8 * along * extent,
                "inside it, looking along its longer side",
            )
        } else {
            let radius_m = 0.5 * extent.length();
            let distance_m = 1.05 * radius_m / (0.5 * CHOSEN_VFOV_DEG.to_radians()).sin();
            (
                centre + Vec3::new(0.4, 0.35, 0.85).normalize() * distance_m,
                centre,
                "outside it, looking at its middle",
            )
        };
        self.camera = Camera {
            eye,
            target,
            up: Vec3::Y,
            vfov_deg: CHOSEN_VFOV_DEG,
        };
        log::warn!(
            "{}: no camera is given; one is put {place}, at {:?}",
            self.name,
            eye.to_array()
        );
    }

    fn choose_light(&mut self) {
        if self.is_emissive() {
            return;
        }
        let Some((low, high)) = self.bounds() else {
            return;
        };
        let (centre, extent) = (0.5 * (low + high), high - low);
        let light = if self.is_interior(centre) {
            let intensity = Vec3::splat((2.5 * extent.length_squared() / 4.0).min(LIGHT_MAX));
            Light::Point {
                position: centre + Vec3::Y * 0.25 * extent.y,
                intensity,
            }
        } else {
            Light::Directional {
                direction: Vec3::new(-0.4, -0.8, -0.45).normalize(),
                irradiance: Vec3::splat(5.0),
            }
        };
        self.lights = vec![light];
        log::warn!("{}: no light is given; it gets {light:?}", self.name);
    }
}
