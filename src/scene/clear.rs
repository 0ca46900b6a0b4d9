//! Surfaces that are mostly clear: a scene without them, and they alone. How light passes them.

use std::borrow::Cow;

use super::{Material, Scene, Triangle};

impl Material {
    /// More than half of it is clear.
    pub(crate) fn is_clear(&self) -> bool {
        self.transmission
            .is_some_and(|transmission| transmission.share > 0.5)
    }

    /// It bounds a body that bends light.
    pub(crate) fn bends(&self) -> bool {
        self.transmission
            .is_some_and(|transmission| transmission.index > 1.0)
    }
}

impl Scene {
    /// The scene without surfaces of which more than half is clear. Vertices stay.
    pub(crate) fn without_clear(&self) -> Cow<'_, Scene> {
        self.part(|material| !material.is_clear())
    }

    /// The surfaces of which more than half is clear, if there are any. Vertices stay.
    pub(crate) fn clear_part(&self) -> Option<Scene> {
        let is_clear = |one: &Triangle| self.materials[one.material as usize].is_clear();
        let has_any = self.triangles.iter().any(is_clear);
        has_any.then(|| self.part(Material::is_clear).into_owned())
    }

    /// The triangles of some materials, and the models that have any.
    pub(crate) fn part(&self, is_kept: impl Fn(&Material) -> bool) -> Cow<'_, Scene> {
        let is_kept: Vec<bool> = self.materials.iter().map(is_kept).collect();
        let kept = |range: std::ops::Range<usize>| {
            let kept = self.triangles[range].iter();
            kept.filter(|one| is_kept[one.material as usize]).copied()
        };
        if kept(0..self.triangles.len()).count() == self.triangles.len() {
            return Cow::Borrowed(self);
        }
        let mut part = self.clone();
        part.triangles = kept(0..self.triangles.len()).collect();
        for model in &mut part.models {
            let first = model.first_triangle as usize;
            let range = first..first + model.triangle_count as usize;
            model.first_triangle = kept(0..first).count() as u32;
            model.triangle_count = kept(range).count() as u32;
        }
        part.models.retain(|model| model.triangle_count > 0);
        Cow::Owned(part)
    }
}

/// Cosine of the refracted direction (Snell), from that of the incoming one and the index of its
/// side over that of the other; `None` where all light is mirrored.
pub(crate) fn refract(cosine: f32, eta: f32) -> Option<f32> {
    let squared = 1.0 - eta * eta * (1.0 - cosine * cosine);
    (squared > 0.0).then(|| squared.sqrt())
}

/// Fresnel's reflectance of unpolarised light, from the cosines on both sides and the index of the
/// side that it comes from over the other.
pub(crate) fn fresnel(cosine: f32, refracted: f32, eta: f32) -> f32 {
    let across = (eta * cosine - refracted) / (eta * cosine + refracted);
    let within = (cosine - eta * refracted) / (cosine + eta * refracted);
    0.5 * (across * across + within * within)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::Transmission;
    use super::*;

    /// Half clear ones stay; the ranges of models are those of what stays.
    #[test]
    fn mostly_clear_triangles_go() -> Result<(), crate::scene::SceneError> {
        let mut scene = Scene::bundled("two-rooms", &[])?;
        assert!(matches!(scene.without_clear(), Cow::Borrowed(_)));
        assert!(scene.clear_part().is_none());
        let glass = |share| {
            Some(Transmission {
                share,
                filter: Vec3::ONE,
                index: 1.5,
            })
        };
        let of_first = |scene: &Scene| {
            let is_first = |one: &&super::super::Triangle| one.material == 0;
            scene.triangles.iter().filter(is_first).count()
        };
        scene.materials[0].transmission = glass(0.5);
        assert!(matches!(scene.without_clear(), Cow::Borrowed(_)));
        scene.materials[0].transmission = glass(0.6);
        let opaque = scene.without_clear();
        assert_eq!(of_first(&opaque), 0);
        assert_eq!(
            opaque.triangles.len(),
            scene.triangles.len() - of_first(&scene)
        );
        let all: u32 = opaque.models.iter().map(|model| model.triangle_count).sum();
        assert_eq!(all as usize, opaque.triangles.len());
        let clear = scene.clear_part();
        let count = clear.map_or(0, |clear| clear.triangles.len());
        assert_eq!(count, of_first(&scene));
        Ok(())
    }

    /// Normal incidence: ((n − 1)/(n + 1))². Brewster's angle: light in the plane is not mirrored,
    /// and half of the rest's reflectance is left. Beyond the critical angle all is.
    #[test]
    fn fresnel_knows_its_angles() {
        let n = 1.5f32;
        let at = |cosine: f32, eta: f32| fresnel(cosine, refract(cosine, eta).unwrap_or(0.0), eta);
        for eta in [n, 1.0 / n] {
            assert!((at(1.0, eta) - 0.04).abs() < 1e-6);
        }
        let brewster = n.atan().cos();
        let across = (1.0 - n * n) / (1.0 + n * n);
        assert!((at(brewster, 1.0 / n) - 0.5 * across * across).abs() < 1e-6);
        assert!(refract(0.74, n).is_none() && refract(0.76, n).is_some());
        assert!(at(1e-4, 1.0 / n) > 0.999);
    }

    /// n sin θ is the same on both sides, and the way back is the way there.
    #[test]
    fn refraction_is_snells() {
        for degrees in [5.0f32, 40.0, 80.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let inside = refract(cos, 1.0 / 1.4).unwrap_or(0.0);
            assert!((1.4 * (1.0 - inside * inside).sqrt() - sin).abs() < 1e-5);
            assert!((refract(inside, 1.4).unwrap_or(0.0) - cos).abs() < 1e-4);
            let there = fresnel(cos, inside, 1.0 / 1.4);
            assert!((there - fresnel(inside, cos, 1.4)).abs() < 1e-5);
        }
    }
}
