//! Scenes from files: the entry points, and the camera and light of scenes that have none.

use std::ffi::OsStr;
use std::path::Path;

use glam::Vec3;

use super::textures::TextureRequests;
use super::toml::{EnvironmentEntry, ModelEntry, SceneFile};
use super::{
    Camera, Environment, Light, LoadOptions, Scene, SceneError, Sky, SkySource, Up, bundled, gltf,
    model, paths, place, toml,
};
use crate::text::vector;

impl Scene {
    /// Opens a scene as a user names it: `bundled:NAME`, `bundled:NAME,KEY=VALUE,…`, or the path of
    /// a `.toml`, `.obj`, `.gltf` or `.glb` file.
    pub fn open(source: impl AsRef<OsStr>, options: &LoadOptions) -> Result<Scene, SceneError> {
        let source = source.as_ref();
        match source
            .to_str()
            .and_then(|text| text.strip_prefix("bundled:"))
        {
            Some(text) => {
                warn_of_up(source, options);
                let (name, parameters) = bundled::parse_source(text)?;
                Scene::bundled(name, &parameters)
            }
            None => Scene::load(Path::new(source), options),
        }
    }

    /// Whether a source, as [`Scene::open`] takes it, is a model alone, whose camera, light and
    /// environment are chosen where it has none.
    pub fn is_model_alone(source: impl AsRef<OsStr>) -> bool {
        let path = Path::new(source.as_ref());
        let extension = path.extension().unwrap_or_default();
        extension.eq_ignore_ascii_case("obj") || gltf::is_named(path)
    }

    /// Loads a `.toml` scene file, or a model alone, which gets a camera, a light and an
    /// environment by what rays see of it, as far as it has none.
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
        if let Some(kind) = paths::not_a_file(path) {
            return Err(SceneError::file(
                path,
                format!("this is {kind}, not a file"),
                "copy what it holds into a .toml, .obj or .glb file, and give that",
            ));
        }
        match extension.as_str() {
            "toml" => {
                warn_of_up(path.as_os_str(), options);
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
            "obj" | "gltf" | "glb" => {
                let entry = ModelEntry {
                    path: path.to_owned(),
                    model: model::Use {
                        up: options.up,
                        ..model::Use::default()
                    },
                };
                let file = SceneFile {
                    models: vec![entry],
                    camera: None,
                    lights: None,
                    environment: EnvironmentEntry::default(),
                };
                let (mut scene, camera, lights) = Scene::from_parts(path, &file, options)?;
                let is_gltf = gltf::is_named(path);
                if is_gltf {
                    warn_of_up(path.as_os_str(), options);
                } else if options.up == Up::Y && place::looks_z_up(&scene) {
                    log::warn!(
                        "{}: it looks as if z pointed up in it; if so, pass --up z",
                        scene.name
                    );
                }
                scene.choose_what_is_missing(camera, lights);
                Ok(scene)
            }
            _ if !path.exists() => Err(SceneError::read(path, std::io::ErrorKind::NotFound.into())),
            _ => Err(SceneError::file(
                path,
                "this is no .toml, .obj, .gltf or .glb file",
                "give a scene file, an OBJ or glTF model, or bundled:NAME",
            )),
        }
    }

    /// Replaces the camera, the lights or the environment by what a text in the scene format says;
    /// what the text does not name stays. `name` is for messages.
    pub fn overlay(&mut self, name: &str, text: &str) -> Result<(), SceneError> {
        let overlay = toml::parse_overlay(Path::new(name), text)?;
        self.camera = overlay.camera.unwrap_or(self.camera);
        if let Some(environment) = &overlay.environment {
            self.take_environment(environment)?;
        }
        if let Some(lights) = overlay.lights {
            self.lights = lights;
            self.lights.extend(self.environment.sun());
        }
        Ok(())
    }

    fn from_file(path: &Path, file: SceneFile, options: &LoadOptions) -> Result<Scene, SceneError> {
        let (mut scene, camera, lights) = Scene::from_parts(path, &file, options)?;
        scene.lights = file.lights.unwrap_or(lights);
        scene.take_environment(&file.environment)?;
        match file.camera.or(camera) {
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

    fn take_environment(&mut self, environment: &EnvironmentEntry) -> Result<(), SceneError> {
        let environment = match environment {
            EnvironmentEntry::Constant(radiance) => (*radiance).into(),
            EnvironmentEntry::Map(entry) => {
                if let SkySource::File(path) = &entry.source {
                    self.files.push(path.clone());
                }
                Sky::read(entry)?.into()
            }
        };
        self.set_environment(environment);
        Ok(())
    }

    /// Replaces the environment, and with it the sun that was taken out of it.
    pub fn set_environment(&mut self, environment: Environment) {
        environment.set_sun(&self.environment, &mut self.lights);
        self.environment = environment;
    }

    /// The scene's models, and the camera and the lights that come with them.
    fn from_parts(
        path: &Path,
        file: &SceneFile,
        options: &LoadOptions,
    ) -> Result<(Scene, Option<Camera>, Vec<Light>), SceneError> {
        let mut requests = TextureRequests::default();
        let mut scene = Scene {
            name: paths::stem_of(path),
            ..Scene::default()
        };
        let (mut camera, mut lights) = (None, Vec::new());
        for entry in &file.models {
            let parts = if gltf::is_named(&entry.path) {
                let contents = gltf::load(&entry.path, &entry.model, &mut requests)?;
                camera = camera.or(contents.camera);
                lights.extend(contents.lights);
                contents.parts
            } else {
                vec![model::load(
                    &entry.path,
                    &entry.model,
                    &mut requests,
                    options,
                )?]
            };
            for part in parts {
                Scene::check_counts(
                    path,
                    scene.vertices.len() + part.vertices.len(),
                    scene.triangles.len() + part.triangles.len(),
                )?;
                scene.add_part(part);
            }
        }
        scene.files = std::iter::once(path.to_owned())
            .chain(requests.files())
            .collect();
        scene.textures = requests.read(options)?;
        scene.finish_textures();
        scene.set_time(0.0);
        Ok((scene, camera, lights))
    }

    /// Whether anything sends light into the scene.
    pub fn is_lit(&self) -> bool {
        let carries_light = |light: &Light| match *light {
            Light::Directional { irradiance, .. } => irradiance != Vec3::ZERO,
            Light::Point { intensity, .. } | Light::Spot { intensity, .. } => {
                intensity != Vec3::ZERO
            }
        };
        self.is_emissive() || !self.environment.is_black() || self.lights.iter().any(carries_light)
    }

    /// Puts the camera where it sees most of the scene.
    fn choose_camera(&mut self) {
        if let Some(placement) = place::place(self) {
            self.take_camera(&placement);
        }
    }

    /// Takes the camera and the lights that came with a model. Without a camera, one is put where
    /// it sees most of the scene; without lights, they are put where they reach most of that.
    fn choose_what_is_missing(&mut self, camera: Option<Camera>, lights: Vec<Light>) {
        let has_lights = !lights.is_empty();
        self.lights = lights;
        self.camera = camera.unwrap_or(self.camera);
        if camera.is_some() && has_lights {
            return;
        }
        let Some(placement) = place::place(self) else {
            return;
        };
        if camera.is_none() {
            self.take_camera(&placement);
        }
        if has_lights {
            return;
        }
        self.environment = placement.environment.into();
        if !placement.lights.is_empty() {
            let lights = super::lights_toml(&placement.lights);
            log::warn!("{}: no light is given; it gets {lights}", self.name);
        }
        self.lights = placement.lights;
        if placement.environment != Vec3::ZERO {
            let sky = vector(placement.environment.to_array());
            log::warn!(
                "{}: no environment is given; it gets a sky of {sky}",
                self.name
            );
        }
    }

    fn take_camera(&mut self, placement: &place::Placement) {
        self.camera = placement.camera;
        log::warn!(
            "{}: no camera is given; one is put {}, at {}",
            self.name,
            placement.place,
            vector(self.camera.eye.to_array())
        );
    }
}

/// Scenes other than a model alone say themselves how their models stand.
fn warn_of_up(source: &OsStr, options: &LoadOptions) {
    if options.up != Up::Y {
        log::warn!(
            "{}: --up is for an .obj alone and changes nothing here (y is up in glTF); in a .toml, \
             write `rotate_deg = [-90.0, 0.0, 0.0]` in the [[model]]",
            source.to_string_lossy()
        );
    }
}
