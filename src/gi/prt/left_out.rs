//! What transfer leaves out of a scene, said in words.

use rayon::prelude::*;

use super::lobes::LobeSettings;
use crate::render::GpuScene;
use crate::scene::rays::{NO_TRIANGLE, Ray};
use crate::scene::surfaces::Surfaces;
use crate::scene::{Material, Scene};

/// Says what vectors of transfer leave out.
pub(super) fn warn_of_vectors(scene: &GpuScene) {
    let hint = "`transfer=matrix` keeps it";
    if scene.is_glossy {
        log::warn!("prt: glossy surfaces mirror nothing with transfer=vector; {hint}");
    }
    if scene.has_bumps() {
        log::warn!("prt: normal maps change nothing with transfer=vector; {hint}");
    }
}

/// Below this roughness, lobes are narrower than what so few bands hold.
const LEAST_ROUGHNESS: f32 = 0.5;

/// Pixels that are looked at along an edge of the picture, at most.
const MOST_LOOKED_AT: u32 = 256;

/// Says how many pixels show what mirrors more sharply than radiance is kept, from the scene's own
/// camera: another one may come later.
pub(super) fn warn_of_mirrors(scene: &GpuScene, lobes: LobeSettings, size: [u32; 2]) {
    let is_sharp = |material: &Material| {
        (material.specular).is_some_and(|lobe| lobe.roughness < LEAST_ROUGHNESS)
    };
    if !scene.host.materials.iter().any(is_sharp) {
        return;
    }
    let percent = 100.0 * share_of_pixels(&scene.host, size, is_sharp);
    let order = lobes.order;
    log::warn!(
        "prt: {percent:.0}% of the pixels, from the scene's camera, show what is smoother than \
         roughness {LEAST_ROUGHNESS}; what it mirrors is blurred to the {order} bands of out_order"
    );
}

/// Of a picture of this size (px), the share of pixels that show such a material.
fn share_of_pixels(
    scene: &Scene,
    size: [u32; 2],
    is_such: impl Fn(&Material) -> bool + Sync,
) -> f64 {
    let surfaces = Surfaces::new(scene);
    let looked_at = size.map(|edge| edge.min(MOST_LOOKED_AT));
    let shows = |pixel: &u32| {
        let at = [pixel % looked_at[0], pixel / looked_at[0]];
        let [x, y] =
            [0, 1].map(|axis| (at[axis] as f32 + 0.5) * size[axis] as f32 / looked_at[axis] as f32);
        let ray = Ray {
            origin: scene.camera.eye,
            direction: scene.camera.ray_direction(x, y, size[0], size[1]),
            leaves: NO_TRIANGLE,
        };
        let hit = surfaces.closest(&ray);
        hit.is_some_and(|hit| is_such(surfaces.material(hit)))
    };
    let all = looked_at[0] * looked_at[1];
    (0..all).into_par_iter().filter(shows).count() as f64 / f64::from(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pictures of one shape show the same, though a large one is looked at in fewer places than it
    /// has pixels.
    #[test]
    fn pixels_are_shared_by_materials() {
        let Ok(scene) = Scene::bundled("cornell", &[]) else {
            panic!("a bundled scene")
        };
        let [small, large] = [[160, 90], [1280, 720]].map(|size| {
            let share = |at: &Material| share_of_pixels(&scene, size, |own| own.name == at.name);
            scene.materials.iter().map(share).collect::<Vec<f64>>()
        });
        let all: f64 = small.iter().sum();
        // The camera looks into the box from its open side.
        assert!((all - 1.0).abs() < 1e-9, "{all}");
        assert!(small.iter().filter(|share| **share > 0.05).count() > 2);
        for (small, large) in small.iter().zip(&large) {
            assert!((small - large).abs() < 0.01, "{small} {large}");
        }
    }
}
