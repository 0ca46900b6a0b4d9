//! The TOML scene format: models, camera, lights and environment.

use std::ops::Range;
use std::path::{Path, PathBuf};

use glam::Vec3;
use serde::Deserialize;
use toml::Spanned;

use super::clear_sky::ClearSky;
use super::light::LIGHT_MAX;
use super::model::{Placement, Use};
use super::sky::{SkyEntry, SkySource};
use super::{Camera, Keyframe, Light, Pose, SceneError, paths};
use crate::text;

/// Largest coordinate \[m\].
pub(super) const COORDINATE_MAX: f32 = 1e9;
/// Largest time of a keyframe \[s\].
const TIME_MAX: f32 = 1e6;

/// Where every key is described; a hint of messages.
const MANUAL: &str = "docs/scene-toml.md describes every key";

type Number = Spanned<f32>;
/// Its length is checked where the field's name is known.
type Vector = Spanned<Vec<f32>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileToml {
    #[serde(default)]
    model: Vec<ModelToml>,
    camera: Option<CameraToml>,
    light: Option<Vec<LightToml>>,
    environment: Option<EnvironmentToml>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelToml {
    path: Spanned<String>,
    scale: Option<Number>,
    rotate_deg: Option<Vector>,
    translate: Option<Vector>,
    #[serde(default)]
    dynamic: bool,
    #[serde(default)]
    keyframe: Vec<KeyframeToml>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct KeyframeToml {
    time_s: Number,
    rotate_deg: Option<Vector>,
    translate: Option<Vector>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraToml {
    eye: Vector,
    target: Vector,
    up: Option<Vector>,
    vfov_deg: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LightToml {
    kind: Spanned<String>,
    direction: Option<Vector>,
    irradiance: Option<Vector>,
    position: Option<Vector>,
    intensity: Option<Vector>,
    inner_deg: Option<Number>,
    outer_deg: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EnvironmentToml {
    radiance: Option<Vector>,
    map: Option<Spanned<String>>,
    clear_sky: Option<Spanned<ClearSkyToml>>,
    scale: Option<Number>,
    rotate_deg: Option<Number>,
    split_sun: Option<Spanned<bool>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ClearSkyToml {
    sun_height_deg: Option<Number>,
    turbidity: Option<Number>,
    ground: Option<Vector>,
    sun: Option<bool>,
}

/// One `[[model]]`, its path resolved.
pub(super) struct ModelEntry {
    /// The OBJ or glTF file, resolved against the scene file's folder.
    pub(super) path: PathBuf,
    /// Where and when it stands.
    pub(super) model: Use,
}

/// A checked scene file.
pub(super) struct SceneFile {
    /// The models, at least one.
    pub(super) models: Vec<ModelEntry>,
    /// `None` where the file has no `[camera]`.
    pub(super) camera: Option<Camera>,
    /// `None` where the file has no `light`.
    pub(super) lights: Option<Vec<Light>>,
    /// What comes from all around.
    pub(super) environment: EnvironmentEntry,
}

/// What comes from all around.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum EnvironmentEntry {
    /// The same radiance from all directions [W/(m² sr)].
    Constant(Vec3),
    /// What a map says.
    Map(SkyEntry),
}

impl Default for EnvironmentEntry {
    fn default() -> Self {
        EnvironmentEntry::Constant(Vec3::ZERO)
    }
}

/// Parses and checks the text of a scene file.
pub(super) fn parse(path: &Path, text: &str) -> Result<SceneFile, SceneError> {
    let source = Source { path, text };
    let file = source.file()?;
    if file.model.is_empty() {
        return Err(SceneError::file(
            path,
            "there is no [[model]] in it",
            "add `[[model]]` with `path = \"FILE.obj\"` or \"FILE.glb\"",
        ));
    }
    let models = file
        .model
        .iter()
        .enumerate()
        .map(|(index, model)| source.model(index, model))
        .collect::<Result<_, _>>()?;
    let lights = source.lights(&file)?;
    let camera = file
        .camera
        .as_ref()
        .map(|camera| source.camera(camera))
        .transpose()?;
    let environment = (file.environment.as_ref())
        .map(|environment| source.environment(environment))
        .transpose()?
        .unwrap_or_default();
    Ok(SceneFile {
        models,
        camera,
        lights,
        environment,
    })
}

/// Parts of a scene that stand in for its own.
pub(super) struct Overlay {
    /// `None` where the text has no `camera`.
    pub(super) camera: Option<Camera>,
    /// `None` where the text has no `light`.
    pub(super) lights: Option<Vec<Light>>,
    /// `None` where the text has no `environment`.
    pub(super) environment: Option<EnvironmentEntry>,
}

/// Parses and checks what is to stand in for parts of a scene; `name` is for messages.
pub(super) fn parse_overlay(name: &Path, text: &str) -> Result<Overlay, SceneError> {
    let source = Source { path: name, text };
    let file = source.file()?;
    if let Some(model) = file.model.first() {
        return Err(source.error(
            &model.path.span(),
            "there is a [[model]] in it",
            "only camera, light and environment can be replaced",
        ));
    }
    Ok(Overlay {
        camera: file
            .camera
            .as_ref()
            .map(|camera| source.camera(camera))
            .transpose()?,
        lights: source.lights(&file)?,
        environment: file
            .environment
            .as_ref()
            .map(|environment| source.environment(environment))
            .transpose()?,
    })
}

/// The text and its name, for messages.
struct Source<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Source<'_> {
    fn file(&self) -> Result<FileToml, SceneError> {
        toml::from_str(self.text).map_err(|error| {
            let problem = error.message().replace('\n', ", ");
            match error.span() {
                Some(span) => self.error(&span, problem, MANUAL),
                None => SceneError::file(self.path, problem, MANUAL),
            }
        })
    }

    /// All lights; `None` where no `light` is there.
    fn lights(&self, file: &FileToml) -> Result<Option<Vec<Light>>, SceneError> {
        let lights = file.light.as_ref().map(|lights| {
            let lights = lights.iter().enumerate();
            lights
                .map(|(index, light)| self.light(index, light))
                .collect()
        });
        lights.transpose()
    }

    fn error(
        &self,
        span: &Range<usize>,
        problem: impl Into<String>,
        hint: impl Into<String>,
    ) -> SceneError {
        let before = self.text.as_bytes().get(..span.start).unwrap_or_default();
        let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
        SceneError::line(self.path, line, problem, hint)
    }

    fn number(&self, field: &str, number: &Number, range: Range<f32>) -> Result<f32, SceneError> {
        let value = *number.get_ref();
        if value >= range.start && value <= range.end {
            return Ok(value);
        }
        let hint = format!(
            "it must be between {} and {}",
            text::number(range.start),
            text::number(range.end)
        );
        Err(self.error(
            &number.span(),
            format!("`{field}` is {value}, out of range"),
            hint,
        ))
    }

    fn vector(&self, field: &str, vector: &Vector, range: Range<f32>) -> Result<Vec3, SceneError> {
        let &[x, y, z] = vector.get_ref().as_slice() else {
            return Err(self.error(
                &vector.span(),
                format!(
                    "`{field}` has {}",
                    text::counted(vector.get_ref().len(), "number")
                ),
                "give an array of length 3, as in [0.0, 1.0, 0.0]",
            ));
        };
        let values = Vec3::new(x, y, z);
        if values.cmpge(Vec3::splat(range.start)).all()
            && values.cmple(Vec3::splat(range.end)).all()
        {
            return Ok(values);
        }
        let hint = format!(
            "each number must be between {} and {}",
            text::number(range.start),
            text::number(range.end)
        );
        Err(self.error(
            &vector.span(),
            format!("`{field}` is {}, out of range", text::vector([x, y, z])),
            hint,
        ))
    }

    fn point(&self, field: &str, vector: &Vector) -> Result<Vec3, SceneError> {
        self.vector(field, vector, -COORDINATE_MAX..COORDINATE_MAX)
    }

    fn light_value(&self, field: &str, vector: &Vector) -> Result<Vec3, SceneError> {
        self.vector(field, vector, 0.0..LIGHT_MAX)
    }

    fn environment(&self, environment: &EnvironmentToml) -> Result<EnvironmentEntry, SceneError> {
        let EnvironmentToml {
            radiance,
            map,
            clear_sky,
            scale,
            rotate_deg,
            split_sun,
        } = environment;
        let one = "give `radiance = [R, G, B]`, `map = \"FILE.exr\"` or `clear_sky = { \
                   sun_height_deg = 45.0 }`, one of them";
        let spans = [
            radiance.as_ref().map(Spanned::span),
            map.as_ref().map(Spanned::span),
            clear_sky.as_ref().map(Spanned::span),
        ];
        let mut given = spans.into_iter().flatten();
        match (given.next(), given.next()) {
            (None, _) => {
                let problem = "`environment` has no radiance, no map and no clear sky";
                return Err(SceneError::file(self.path, problem, one));
            }
            (Some(first), Some(second)) => {
                let last = if first.start > second.start {
                    first
                } else {
                    second
                };
                return Err(self.error(&last, "`environment` is given twice", one));
            }
            _ => {}
        }
        if let Some(radiance) = radiance {
            let of_map = [
                ("scale", scale.as_ref().map(Spanned::span)),
                ("rotate_deg", rotate_deg.as_ref().map(Spanned::span)),
                ("split_sun", split_sun.as_ref().map(Spanned::span)),
            ];
            for (name, span) in of_map {
                if let Some(span) = span {
                    let problem = format!("`environment.{name}` is of a map, and there is none");
                    return Err(self.error(&span, problem, one));
                }
            }
            let constant = self.light_value("environment.radiance", radiance)?;
            return Ok(EnvironmentEntry::Constant(constant));
        }
        let source = match (map, clear_sky) {
            (_, Some(clear_sky)) => SkySource::Clear(self.clear_sky(clear_sky.get_ref())?),
            (Some(map), None) => SkySource::File(self.map(map)?),
            (None, None) => SkySource::Clear(ClearSky::default()),
        };
        Ok(EnvironmentEntry::Map(SkyEntry {
            source,
            scale: self.number_or("environment.scale", scale, (1.0, 0.0..LIGHT_MAX))?,
            rotate_deg: self.number_or(
                "environment.rotate_deg",
                rotate_deg,
                (0.0, -360.0..360.0),
            )?,
            splits_sun: split_sun.as_ref().is_some_and(|split| *split.get_ref()),
        }))
    }

    fn map(&self, map: &Spanned<String>) -> Result<PathBuf, SceneError> {
        let name = map.get_ref();
        paths::resolve(paths::folder_of(self.path), name).ok_or_else(|| {
            self.error(
                &map.span(),
                format!("`environment.map` names `{name}`, which is no file"),
                "paths are relative to the scene file",
            )
        })
    }

    fn clear_sky(&self, sky: &ClearSkyToml) -> Result<ClearSky, SceneError> {
        let otherwise = ClearSky::default();
        let number = |name: &str, number: &Option<Number>, range| {
            self.number_or(&format!("environment.clear_sky.{name}"), number, range)
        };
        let ground = (sky.ground.as_ref())
            .map(|ground| self.vector("environment.clear_sky.ground", ground, 0.0..1.0))
            .transpose()?;
        Ok(ClearSky {
            sun_height_deg: number(
                "sun_height_deg",
                &sky.sun_height_deg,
                (otherwise.sun_height_deg, 0.0..90.0),
            )?,
            turbidity: number(
                "turbidity",
                &sky.turbidity,
                (otherwise.turbidity, 1.0..10.0),
            )?,
            ground: ground.unwrap_or(otherwise.ground),
            has_sun: sky.sun.unwrap_or(otherwise.has_sun),
        })
    }

    /// A number of a range, or what it is otherwise.
    fn number_or(
        &self,
        field: &str,
        number: &Option<Number>,
        (otherwise, range): (f32, Range<f32>),
    ) -> Result<f32, SceneError> {
        (number.as_ref()).map_or(Ok(otherwise), |number| self.number(field, number, range))
    }

    /// A unit vector; vectors that are of unit length already stay as they are.
    fn direction(&self, field: &str, vector: &Vector) -> Result<Vec3, SceneError> {
        let values = self.point(field, vector)?;
        if (values.length_squared() - 1.0).abs() <= 1e-6 {
            return Ok(values);
        }
        let unit = values.as_dvec3().try_normalize().map(|unit| unit.as_vec3());
        unit.ok_or_else(|| {
            self.error(
                &vector.span(),
                format!("`{field}` has no length"),
                "give the direction of travel, not (0, 0, 0)",
            )
        })
    }

    fn model(&self, index: usize, model: &ModelToml) -> Result<ModelEntry, SceneError> {
        let field = |name: &str| format!("model[{index}].{name}");
        let name = model.path.get_ref();
        let path = paths::resolve(paths::folder_of(self.path), name).ok_or_else(|| {
            self.error(
                &model.path.span(),
                format!("`{}` names `{name}`, which is no file", field("path")),
                "paths are relative to the scene file",
            )
        })?;
        let mut placement = Placement::default();
        if let Some(scale) = &model.scale {
            placement.scale = self.number(&field("scale"), scale, 1e-6..1e6)?;
        }
        placement.pose = self.pose(
            &field(""),
            [&model.rotate_deg, &model.translate],
            Pose::default(),
        )?;
        let mut keyframes: Vec<Keyframe> = Vec::new();
        for (number, keyframe) in model.keyframe.iter().enumerate() {
            let field = |name: &str| field(&format!("keyframe[{number}].{name}"));
            if !model.dynamic {
                let problem = format!("`model[{index}]` has a keyframe but is not dynamic");
                return Err(self.error(
                    &keyframe.time_s.span(),
                    problem,
                    "add `dynamic = true` to the model, above its keyframes",
                ));
            }
            let time_s = self.number(&field("time_s"), &keyframe.time_s, -TIME_MAX..TIME_MAX)?;
            if let Some(before) = keyframes.last().filter(|before| before.time_s >= time_s) {
                let problem = format!(
                    "`{}` is {time_s}, not after {}",
                    field("time_s"),
                    before.time_s
                );
                return Err(self.error(
                    &keyframe.time_s.span(),
                    problem,
                    "keyframes are in the order of their times, no two at the same",
                ));
            }
            let pose = self.pose(
                &field(""),
                [&keyframe.rotate_deg, &keyframe.translate],
                placement.pose,
            )?;
            keyframes.push(Keyframe { time_s, pose });
        }
        Ok(ModelEntry {
            path,
            model: Use {
                placement,
                dynamic: model.dynamic,
                keyframes,
                ..Use::default()
            },
        })
    }

    /// `rotate_deg` and `translate` of the table that `prefix` names; what it does not have is that
    /// of `otherwise`.
    fn pose(
        &self,
        prefix: &str,
        [rotate_deg, translate]: [&Option<Vector>; 2],
        otherwise: Pose,
    ) -> Result<Pose, SceneError> {
        let rotate_deg = rotate_deg
            .as_ref()
            .map(|vector| self.vector(&format!("{prefix}rotate_deg"), vector, -360.0..360.0))
            .transpose()?;
        let translate = translate
            .as_ref()
            .map(|vector| self.point(&format!("{prefix}translate"), vector))
            .transpose()?;
        Ok(Pose {
            rotate_deg: rotate_deg.unwrap_or(otherwise.rotate_deg),
            translate: translate.unwrap_or(otherwise.translate),
        })
    }

    fn camera(&self, camera: &CameraToml) -> Result<Camera, SceneError> {
        // Cameras may stand outside of models, even of models that reach to COORDINATE_MAX.
        let range = -10.0 * COORDINATE_MAX..10.0 * COORDINATE_MAX;
        let eye = self.vector("camera.eye", &camera.eye, range.clone())?;
        let target = self.vector("camera.target", &camera.target, range)?;
        let up = camera
            .up
            .as_ref()
            .map_or(Ok(Vec3::Y), |up| self.direction("camera.up", up))?;
        let vfov_deg = camera.vfov_deg.as_ref().map_or(Ok(60.0), |vfov| {
            self.number("camera.vfov_deg", vfov, 1.0..175.0)
        })?;
        let Some(forward) = (target - eye).try_normalize() else {
            return Err(self.error(
                &camera.target.span(),
                "`camera.target` is at `camera.eye`",
                "move one of them",
            ));
        };
        if forward.cross(up).length() < 1e-4 {
            let span = camera.up.as_ref().unwrap_or(&camera.target).span();
            return Err(self.error(
                &span,
                "`camera.up` is parallel to the view direction",
                "give another `up`, such as [0.0, 0.0, 1.0]",
            ));
        }
        Ok(Camera {
            eye,
            target,
            up,
            vfov_deg,
        })
    }

    fn light(&self, index: usize, light: &LightToml) -> Result<Light, SceneError> {
        let field = |name: &str| format!("light[{index}].{name}");
        self.check_keys(index, light)?;
        let needed = |name: &str, value: &Option<Vector>| {
            let missing = || {
                self.error(
                    &light.kind.span(),
                    format!("`{}` is missing", field(name)),
                    format!("a {} light needs it", light.kind.get_ref()),
                )
            };
            value.clone().ok_or_else(missing)
        };
        if light.kind.get_ref() == "directional" {
            return Ok(Light::Directional {
                direction: self
                    .direction(&field("direction"), &needed("direction", &light.direction)?)?,
                irradiance: self.light_value(
                    &field("irradiance"),
                    &needed("irradiance", &light.irradiance)?,
                )?,
            });
        }
        let position = self.point(&field("position"), &needed("position", &light.position)?)?;
        let intensity =
            self.light_value(&field("intensity"), &needed("intensity", &light.intensity)?)?;
        if light.kind.get_ref() == "point" {
            return Ok(Light::Point {
                position,
                intensity,
            });
        }
        let direction =
            self.direction(&field("direction"), &needed("direction", &light.direction)?)?;
        let (Some(inner), Some(outer)) = (&light.inner_deg, &light.outer_deg) else {
            let missing = field(if light.inner_deg.is_none() {
                "inner_deg"
            } else {
                "outer_deg"
            });
            return Err(self.error(
                &light.kind.span(),
                format!("`{missing}` is missing"),
                "a spot light needs it",
            ));
        };
        let outer_deg = self.number(&field("outer_deg"), outer, 0.01..89.9)?;
        let inner_deg = self.number(&field("inner_deg"), inner, 0.0..outer_deg)?;
        Ok(Light::Spot {
            position,
            direction,
            intensity,
            inner_deg,
            outer_deg,
        })
    }

    /// Whether the kind is known and each key belongs to it.
    fn check_keys(&self, index: usize, light: &LightToml) -> Result<(), SceneError> {
        let allowed: &[&str] = match light.kind.get_ref().as_str() {
            "directional" => &["direction", "irradiance"],
            "point" => &["position", "intensity"],
            "spot" => &[
                "position",
                "direction",
                "intensity",
                "inner_deg",
                "outer_deg",
            ],
            other => {
                let problem = format!("`light[{index}].kind` is `{other}`");
                return Err(self.error(
                    &light.kind.span(),
                    problem,
                    "a light is \"directional\", \"point\" or \"spot\"",
                ));
            }
        };
        let span = |vector: &Option<Vector>| vector.as_ref().map(Spanned::span);
        let given = [
            ("direction", span(&light.direction)),
            ("irradiance", span(&light.irradiance)),
            ("position", span(&light.position)),
            ("intensity", span(&light.intensity)),
            ("inner_deg", light.inner_deg.as_ref().map(Spanned::span)),
            ("outer_deg", light.outer_deg.as_ref().map(Spanned::span)),
        ];
        for (name, span) in given {
            if let Some(span) = span.filter(|_| !allowed.contains(&name)) {
                let problem = format!(
                    "`light[{index}].{name}` does not belong to a {} light",
                    light.kind.get_ref()
                );
                return Err(self.error(
                    &span,
                    problem,
                    format!("its keys are {}", allowed.join(", ")),
                ));
            }
        }
        Ok(())
    }
}
