//! What is left of a scene where clear surfaces cannot be shown.

use std::borrow::Cow;

use super::Scene;

impl Scene {
    /// The scene without surfaces of which more than half is clear. Vertices stay.
    pub(crate) fn without_clear(&self) -> Cow<'_, Scene> {
        let is_clear = |material: u32| {
            let material = &self.materials[material as usize];
            (material.transmission).is_some_and(|transmission| transmission.share > 0.5)
        };
        let clear: Vec<bool> = (0..self.materials.len() as u32).map(is_clear).collect();
        let kept = |range: std::ops::Range<usize>| {
            let kept = self.triangles[range].iter();
            kept.filter(|one| !clear[one.material as usize]).copied()
        };
        let count = kept(0..self.triangles.len()).count();
        if count == self.triangles.len() {
            return Cow::Borrowed(self);
        }
        log::warn!(
            "{}: {} of {} triangles are mostly clear; only the reference shows what is behind them \
             bent and filtered, techniques leave them out",
            self.name,
            self.triangles.len() - count,
            self.triangles.len()
        );
        let mut opaque = self.clone();
        opaque.triangles = kept(0..self.triangles.len()).collect();
        for model in &mut opaque.models {
            let first = model.first_triangle as usize;
            let range = first..first + model.triangle_count as usize;
            model.first_triangle = kept(0..first).count() as u32;
            model.triangle_count = kept(range).count() as u32;
        }
        opaque.models.retain(|model| model.triangle_count > 0);
        Cow::Owned(opaque)
    }
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
        Ok(())
    }
}
