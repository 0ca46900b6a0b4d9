//! Motion (`render.gbuffer`): the place of a point of a triangle in the picture of the frame
//! before, by the same shares of where its corners were.

use glam::{DVec2, DVec3};

use super::super::BEHIND_PX;
use super::{Scenery, View};
use crate::scene::Scene;

/// A frame that was drawn.
#[derive(Clone, Copy, Debug)]
pub struct Before<'s> {
    /// The scene, its dynamic models as they were.
    pub scene: &'s Scene,
    /// How it was seen.
    pub view: View,
}

/// Where a pixel's surface was in the frame before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Its place there less the pixel's (px), both pictures counted as of this one's size;
    /// [`BEHIND_PX`] where it was behind the camera.
    pub by_px: DVec2,
    /// Its view depth there (m).
    pub depth_m: f64,
    /// Its distance from the middle of the picture there, in half widths or in half heights,
    /// whichever are more.
    pub aside: f64,
}

/// The motion of what a triangle shows at a point of the picture (px); `None` where it is not
/// there.
pub fn motion(
    now: &Scenery<'_>,
    view: &View,
    before: &Before<'_>,
    triangle: usize,
    at_px: DVec2,
) -> Option<Motion> {
    let hit = now.hit(triangle, view, at_px)?;
    let corners = before.scene.triangles[triangle].vertices;
    let point: DVec3 = corners
        .iter()
        .zip(hit.weights)
        .map(|(corner, weight)| {
            let vertex = before.scene.vertices[*corner as usize];
            weight * DVec3::from(vertex.position.map(f64::from))
        })
        .sum();
    let (there_px, depth_m) = before.view.project(point);
    let size = |view: &View| DVec2::from(view.size.map(f64::from));
    let share = there_px / size(&before.view);
    let by_px = if depth_m < 0.5 * before.view.near_m {
        DVec2::splat(f64::from(BEHIND_PX))
    } else {
        share * size(view) - at_px
    };
    Some(Motion {
        by_px,
        depth_m,
        aside: (2.0 * share - 1.0).abs().max_element(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Material, Triangle, Vertex};
    use glam::Vec3;

    /// One triangle at z = `z`, moved by `x`.
    fn scene(x: f32, z: f32) -> Scene {
        let corner = |[a, b]: [f32; 2]| Vertex {
            position: [a + x, b, z],
            u: 0.0,
            normal: [0.0, 0.0, 1.0],
            v: 0.0,
        };
        Scene {
            vertices: [[-9.0, -9.0], [9.0, -9.0], [0.0, 9.0]].map(corner).to_vec(),
            triangles: vec![Triangle {
                vertices: [0, 1, 2],
                material: 0,
            }],
            materials: vec![Material::default()],
            ..Scene::default()
        }
    }

    /// From the origin along −z, 90° wide.
    fn view(eye: Vec3, size: [u32; 2]) -> View {
        let camera = Camera {
            eye,
            target: eye - Vec3::Z,
            up: Vec3::Y,
            vfov_deg: 90.0,
        };
        View::of_camera(&camera, size, 0.01)
    }

    fn moved(was: &Scene, view_was: View, is: &Scene, view_is: View, at_px: [f64; 2]) -> DVec2 {
        let before = Before {
            scene: was,
            view: view_was,
        };
        let now = Scenery::new(is);
        motion(&now, &view_is, &before, 0, at_px.into()).map_or(DVec2::NAN, |found| found.by_px)
    }

    #[test]
    fn motion_leads_to_where_the_surface_was() {
        let size = [100, 100];
        let here = view(Vec3::ZERO, size);
        let near = |a: DVec2, b: [f64; 2]| a.distance(b.into()) < 1e-4;
        // 2 m away a picture is 4 m wide: 25 px a metre, x to the right and y down.
        let still = scene(0.0, -2.0);
        assert!(near(
            moved(&still, here, &still, here, [60.0, 50.0]),
            [0.0, 0.0]
        ));
        assert!(near(
            moved(&scene(-1.0, -2.0), here, &still, here, [60.0, 50.0]),
            [-25.0, 0.0]
        ));
        // A camera that came from the upper right saw it farther to the lower left.
        let there = view(Vec3::new(1.0, 1.0, 0.0), size);
        assert!(near(
            moved(&still, there, &still, here, [50.0, 50.0]),
            [-25.0, 25.0]
        ));
        // Towards the viewer: from 4 m to 2 m, half as far from the middle.
        assert!(near(
            moved(&scene(0.0, -4.0), here, &still, here, [60.0, 50.0]),
            [-5.0, 0.0]
        ));
        // In a picture half as wide and high the shares are the same.
        let small = view(Vec3::ZERO, [50, 50]);
        assert!(near(
            moved(&still, small, &still, here, [60.0, 50.0]),
            [0.0, 0.0]
        ));
        // Behind the camera.
        let behind = DVec2::splat(f64::from(BEHIND_PX));
        assert_eq!(
            moved(&scene(0.0, 1.0), here, &still, here, [60.0, 50.0]),
            behind
        );
    }
}
