//! Scenes that the program brings along, made by code.

use super::{Scene, SceneError};

/// Splits `NAME,KEY=VALUE,…`.
pub(super) fn parse_source(text: &str) -> Result<(&str, Vec<(String, f64)>), SceneError> {
    let mut parts = text.split(',');
    let name = parts.next().unwrap_or_default();
    let parameters = parts.map(|part| parse_parameter(name, part)).collect::<Result<_, _>>()?;
    Ok((name, parameters))
}

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
impl Scene {
    /// The bundled scene `name`, with `parameters` in place of its defaults.
    pub fn bundled(name: &str, _parameters: &[(String, f64)]) -> Result<Scene, SceneError> {
        Err(SceneError::UnknownBundled { name: name.to_owned(), known: Vec::new() })
    }
}
