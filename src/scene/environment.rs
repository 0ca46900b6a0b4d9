//! Light from far away.

use std::fmt;
use std::sync::Arc;

use glam::Vec3;

use super::Light;
use super::sky::Sky;

/// Light from far away, around all of a scene.
#[derive(Clone, PartialEq)]
pub enum Environment {
    /// One radiance from everywhere (W/(m² sr)).
    Uniform(Vec3),
    /// A map. Copies share it.
    Map(Arc<Sky>),
}

impl Default for Environment {
    /// None.
    fn default() -> Self {
        Environment::Uniform(Vec3::ZERO)
    }
}

impl From<Vec3> for Environment {
    fn from(radiance: Vec3) -> Self {
        Environment::Uniform(radiance)
    }
}

impl From<Sky> for Environment {
    fn from(sky: Sky) -> Self {
        Environment::Map(Arc::new(sky))
    }
}

impl fmt::Debug for Environment {
    /// What tells it from others, in short.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Environment::Uniform(radiance) => radiance.fmt(f),
            Environment::Map(sky) => sky.fmt(f),
        }
    }
}

impl Environment {
    /// The map, where there is one.
    pub fn sky(&self) -> Option<&Arc<Sky>> {
        match self {
            Environment::Uniform(_) => None,
            Environment::Map(sky) => Some(sky),
        }
    }

    /// Radiance that comes from everywhere alike (W/(m² sr)); black where there is a map.
    pub fn uniform(&self) -> Vec3 {
        match self {
            Environment::Uniform(radiance) => *radiance,
            Environment::Map(_) => Vec3::ZERO,
        }
    }

    /// The light of the sun that was taken out of the map.
    pub fn sun(&self) -> Option<Light> {
        self.sky().and_then(|sky| sky.sun())
    }

    /// Makes the sun among the lights that of this environment, which was another `before`. A light
    /// that has been changed since is no sun any more, and stays.
    pub fn set_sun(&self, before: &Environment, lights: &mut Vec<Light>) {
        let is_sun = |light: &Light| Some(*light) == before.sun();
        match (lights.iter().position(is_sun), self.sun()) {
            (Some(at), Some(sun)) => lights[at] = sun,
            (Some(at), None) => {
                lights.remove(at);
            }
            (None, sun) if before.sun().is_none() => lights.extend(sun),
            (None, _) => {}
        }
    }

    /// Whether no light comes from anywhere.
    pub fn is_black(&self) -> bool {
        match self {
            Environment::Uniform(radiance) => *radiance == Vec3::ZERO,
            Environment::Map(sky) => sky.is_black(),
        }
    }

    /// Radiance from a unit direction (W/(m² sr)).
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Environment::Uniform(radiance) => *radiance,
            Environment::Map(sky) => sky.radiance(direction),
        }
    }

    /// The same environment, so many times as bright.
    #[must_use]
    pub fn times(&self, factor: f32) -> Self {
        match self {
            Environment::Uniform(radiance) => (factor * *radiance).into(),
            Environment::Map(sky) => sky.with(factor * sky.scale(), sky.rotate_deg()).into(),
        }
    }
}
