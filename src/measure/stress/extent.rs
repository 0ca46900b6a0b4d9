//! Extent: of the scene, of its parts in voxels, of its list of triangles; and nothing at all.

use glam::Vec3;

use super::light::yard;
use super::scenes::{anchored, bounds, camera, extent_m, placed};
use super::{Figure, OWN, StressCase};
use crate::measure::draw::Ticks;
use crate::metrics::Channel;
use crate::scene::{Camera, Light, Material, Model, Scene, Triangle, Vertex};

pub(super) static SCENE_SIZE: StressCase = StressCase {
    name: "scene_size",
    help: "one scene with its lights at many sizes; it has to look the same",
    source: "Kahl 2019, section 6.3.1: coordinates as floats",
    severity: "largest extent [m] (harmless at 1)",
    ticks: Ticks::Decades,
    severities: &[1e-3, 1e-1, 1.0, 1e2, 1e4],
    quick: &[1e-3, 1e4],
    measure: |trial, size_m| {
        let scene = trial.base()?;
        let picture = trial.indirect(&placed(
            &scene,
            0.0,
            size_m as f32 / extent_m(&scene),
            Vec3::ZERO,
        ))?;
        Ok(vec![
            trial
                .errors_of(&picture, &scene, Channel::Luminance, 1)?
                .rel_rmse,
        ])
    },
    any_scene: true,
    ..OWN
};

pub(super) static TRIANGLE_COUNT: StressCase = StressCase {
    name: "triangle_count",
    help: "one flat triangle under sun and sky is cut into many; lists, counters and sums of a \
           voxel overflow",
    source: "Crassin & Green 2012: fragment lists; Villegas & Ramírez, section V-A: averages of \
             many fragments",
    severity: "triangles",
    ticks: Ticks::Decades,
    severities: &[1.0, 100.0, 1e4, 1e6, 5e6],
    quick: &[1.0, 1e4],
    measure: |trial, count| {
        let cut = |count: f64| cut_triangle(count.sqrt().round() as u32);
        let picture = trial.indirect(&cut(count))?;
        Ok(vec![
            trial
                .errors_of(&picture, &cut(1.0), Channel::Luminance, 1)?
                .rel_rmse,
        ])
    },
    ..OWN
};

pub(super) static ONE_VOXEL: StressCase = StressCase {
    name: "one_voxel",
    help: "the grid fits something far larger than the scene, until the whole scene lies within \
           one voxel",
    source: "Hong 2015, section 2.5.2.7: one grid is too coarse for a large scene",
    severity: "extent of the scene [voxels]",
    // No whole numbers: walls on borders between voxels would be another failure.
    severities: &[15.5, 7.5, 3.5, 1.5, 0.25],
    quick: &[15.5, 0.25],
    measure: |trial, voxels| {
        let scene = trial.base()?;
        let (low, high) = bounds(&scene);
        let edge_m = extent_m(&scene) / (voxels as f32 * trial.cell_share());
        let picture = trial.indirect(&anchored(scene.clone(), 0.5 * (low + high), edge_m))?;
        Ok(vec![
            trial
                .errors_of(&picture, &scene, Channel::Luminance, 1)?
                .rel_rmse,
        ])
    },
    any_scene: true,
    ..OWN
};

pub(super) static FAR_CAMERA: StressCase = StressCase {
    name: "far_camera",
    help: "the camera is far away and looks through a long lens; grids around the camera hold \
           nothing of the scene",
    source: "Panteleev 2014: clipmaps around the camera",
    severity: "distance [scene extents]",
    severities: &[1.0, 4.0, 16.0, 64.0],
    quick: &[16.0],
    measure: |trial, distance| {
        let scene = yard(45.0);
        let Camera {
            eye,
            target,
            vfov_deg,
            ..
        } = scene.camera;
        let away = distance as f32 * extent_m(&scene) / eye.distance(target);
        let vfov_deg = 2.0
            * ((0.5 * vfov_deg.to_radians()).tan() / away.max(1.0))
                .atan()
                .to_degrees();
        let scene = Scene {
            camera: Camera {
                eye: target + away * (eye - target),
                vfov_deg,
                ..scene.camera
            },
            ..scene
        };
        Ok(vec![trial.errors(&scene, Channel::Luminance, 1)?.rel_rmse])
    },
    ..OWN
};

pub(super) static EMPTY: StressCase = StressCase {
    name: "empty",
    help: "a scene without triangles under a sky; the grid is empty, and no surface is lit",
    source: "this project: no more work than a scene needs",
    severity: "triangles",
    ticks: Ticks::Linear,
    severities: &[0.0],
    quick: &[0.0],
    figures: &[Figure {
        name: "light",
        pass: 0.0,
        warn: 0.0,
    }],
    measure: |trial, _| {
        let scene = Scene {
            name: "empty".into(),
            environment: Vec3::ONE.into(),
            ..Scene::default()
        };
        let picture = trial.indirect(&scene)?;
        Ok(vec![
            picture
                .pixels
                .iter()
                .map(|pixel| f64::from(pixel.abs().max_element()))
                .fold(0.0, f64::max),
        ])
    },
    ..OWN
};

/// One triangle of 4 m by 4 m under sun and sky, cut into the square of `cuts` triangles of equal
/// shape.
fn cut_triangle(cuts: u32) -> Scene {
    let (corner, right, ahead) = (Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0);
    let mut scene = Scene {
        name: "cut-triangle".into(),
        environment: Vec3::ONE.into(),
        ..Scene::default()
    };
    // Rows from the front to the back; each has one vertex less than the one before.
    let first = |row: u32| row * (cuts + 1) - row * row.saturating_sub(1) / 2;
    for row in 0..=cuts {
        for column in 0..=cuts - row {
            let position =
                corner + right * (column as f32 / cuts as f32) + ahead * (row as f32 / cuts as f32);
            scene.vertices.push(Vertex {
                position: position.to_array(),
                u: 0.0,
                normal: [0.0, 1.0, 0.0],
                v: 0.0,
            });
        }
    }
    for row in 0..cuts {
        for column in 0..cuts - row {
            let [a, b] = [first(row) + column, first(row + 1) + column];
            scene.triangles.push(Triangle {
                vertices: [a, a + 1, b],
                material: 0,
            });
            if column + 1 < cuts - row {
                scene.triangles.push(Triangle {
                    vertices: [a + 1, b + 1, b],
                    material: 0,
                });
            }
        }
    }
    scene.materials.push(Material {
        name: "ground".into(),
        albedo: Vec3::splat(0.6),
        ..Material::default()
    });
    let triangle_count = scene.triangles.len() as u32;
    scene.models.push(Model {
        name: "ground".into(),
        dynamic: false,
        first_triangle: 0,
        triangle_count,
        motion: None,
    });
    scene.lights.push(Light::Directional {
        direction: Vec3::new(0.3, -1.0, -0.2).normalize(),
        irradiance: Vec3::splat(2.0),
    });
    scene.camera = camera([-0.6, 1.6, 2.2], [-0.7, 0.0, 0.4], 50.0);
    scene
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However it is cut, the triangle has the same area, faces up, and lies where it lay.
    #[test]
    fn cuts_are_of_one_triangle() {
        for cuts in [1, 2, 7, 100] {
            let scene = cut_triangle(cuts);
            assert_eq!(scene.triangles.len(), (cuts * cuts) as usize);
            let area = |triangle: &Triangle| {
                let [a, b, c] = triangle
                    .vertices
                    .map(|vertex| Vec3::from(scene.vertices[vertex as usize].position));
                let normal = (b - a).cross(c - a);
                assert!(normal.y > 0.0, "{triangle:?}");
                0.5 * f64::from(normal.length())
            };
            assert!((scene.triangles.iter().map(area).sum::<f64>() - 8.0).abs() < 1e-3);
            assert!((extent_m(&scene) - 4.0).abs() < 1e-6);
        }
    }
}
