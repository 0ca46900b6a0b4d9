//! Scenes that the program brings along, made by code: small ones with exact geometry or
//! closed-form answers, and larger ones to look at.
//!
//! [`TABLE`] lists them; [`Scene::bundled`] makes one; `bundled:NAME,KEY=VALUE` names one wherever
//! a scene is wanted.

mod atrium;
mod atrium_materials;
mod cornell;
mod cornell_lamp;
mod emissive_gallery;
mod furnace;
mod glass;
mod glossy;
mod lit_sphere;
pub(crate) mod mesh;
mod pergola;
mod picture;
mod stairwell;
mod two_rooms;

use super::{Scene, SceneError};

/// A number that a bundled scene can be made with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Its name; a length's name ends in `_m`.
    pub name: &'static str,
    /// What it changes in the scene, in one line.
    pub description: &'static str,
    /// Its unit; `0 or 1` for a switch, `whole number` for a count, empty where it has none.
    pub unit: &'static str,
    /// Smallest value that is accepted, in the unit.
    pub min: f64,
    /// Largest value that is accepted, in the unit.
    pub max: f64,
    /// Value where none is given.
    pub default: f64,
}

/// One row of the table of bundled scenes.
#[derive(Clone, Copy)]
pub struct BundledScene {
    /// Name on the command line, after `bundled:`.
    pub name: &'static str,
    /// What it is, in one line.
    pub description: &'static str,
    /// What it can be made with.
    pub parameters: &'static [Parameter],
    build: fn(&Values) -> Scene,
}

/// All bundled scenes.
pub const TABLE: &[BundledScene] = &[
    cornell::ROW,
    cornell_lamp::ROW,
    two_rooms::ROW,
    furnace::ROW,
    lit_sphere::ROW,
    atrium::ROW,
    atrium::STREET_ROW,
    glossy::ROW,
    glass::ROW,
    emissive_gallery::ROW,
    stairwell::ROW,
    pergola::ROW,
];

const SWITCH: &str = "0 or 1";
const WHOLE_NUMBER: &str = "whole number";

/// A value for each parameter of one scene.
struct Values(Vec<(&'static str, f64)>);

impl Values {
    /// The value of a parameter in the scene's own row; any other name is a mistake in this crate.
    fn number(&self, name: &str) -> f32 {
        let value = self
            .0
            .iter()
            .find(|(known, _)| *known == name)
            .map(|(_, value)| *value as f32);
        debug_assert!(value.is_some(), "the scene's row has no parameter `{name}`");
        value.unwrap_or(f32::NAN)
    }

    fn is_on(&self, name: &str) -> bool {
        self.number(name) == 1.0
    }
}

impl BundledScene {
    fn values(&self, given: &[(String, f64)]) -> Result<Values, SceneError> {
        let mut values: Vec<_> = self
            .parameters
            .iter()
            .map(|parameter| (parameter.name, parameter.default))
            .collect();
        for (name, value) in given {
            let error = |problem: String, hint: String| SceneError::Parameter {
                scene: self.name.to_owned(),
                parameter: name.clone(),
                problem,
                hint,
            };
            let Some(index) = self
                .parameters
                .iter()
                .position(|parameter| parameter.name == name)
            else {
                let known: Vec<_> = self
                    .parameters
                    .iter()
                    .map(|parameter| parameter.name)
                    .collect();
                let hint = if known.is_empty() {
                    String::from("this scene has no parameters")
                } else {
                    format!("it has {}", known.join(", "))
                };
                return Err(error(String::from("is unknown"), hint));
            };
            let Parameter { unit, min, max, .. } = self.parameters[index];
            let is_whole = unit == SWITCH || unit == WHOLE_NUMBER;
            if !(min..=max).contains(value) || (is_whole && value.fract() != 0.0) {
                let kind = if is_whole { "a whole number " } else { "" };
                return Err(error(
                    format!("is {value}, out of range"),
                    format!("it must be {kind}between {min} and {max}"),
                ));
            }
            values[index].1 = *value;
        }
        Ok(Values(values))
    }
}

impl Scene {
    /// The bundled scene `name`, with `parameters` in place of its defaults.
    pub fn bundled(name: &str, parameters: &[(String, f64)]) -> Result<Scene, SceneError> {
        let unknown = || SceneError::UnknownBundled {
            name: name.to_owned(),
            known: TABLE.iter().map(|row| row.name).collect(),
        };
        let row = TABLE
            .iter()
            .find(|row| row.name == name)
            .ok_or_else(unknown)?;
        Ok((row.build)(&row.values(parameters)?))
    }
}

/// Splits `NAME,KEY=VALUE,…`.
pub(super) fn parse_source(text: &str) -> Result<(&str, ParameterValues), SceneError> {
    let mut parts = text.split(',');
    let name = parts.next().unwrap_or_default();
    let parameters = parts
        .map(|part| parse_parameter(name, part))
        .collect::<Result<_, _>>()?;
    Ok((name, parameters))
}

/// Names and values, as [`Scene::bundled`] takes them.
pub type ParameterValues = Vec<(String, f64)>;

/// Splits `KEY=VALUE`; `true` is 1 and `false` is 0. `scene` is for the message.
pub fn parse_parameter(scene: &str, text: &str) -> Result<(String, f64), SceneError> {
    let (key, value) = text.split_once('=').unwrap_or((text, ""));
    let number = match value.trim() {
        "true" => Some(1.0),
        "false" => Some(0.0),
        other => other.parse().ok(),
    };
    let problem = || SceneError::Parameter {
        scene: scene.to_owned(),
        parameter: key.to_owned(),
        problem: format!("has the value `{value}`, which is not a number"),
        hint: String::from("write KEY=VALUE"),
    };
    Ok((key.trim().to_owned(), number.ok_or_else(problem)?))
}
