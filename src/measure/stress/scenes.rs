//! What the scenes of failure modes are made of and made from.

use glam::{Quat, Vec3};

use crate::scene::bundled::mesh::Mesh;
use crate::scene::{Camera, Light, Material, Model, Scene, SceneError, Triangle, Vertex};

/// Largest extent of a scene of the suite's own (m).
pub(super) const ROOM_M: f32 = 4.0;

/// Edge of a voxel over the largest extent of what a grid of this resolution is fitted to
/// ([`VoxelGrid::around`](crate::gi::shared::voxel::VoxelGrid::around)).
pub(super) fn cell_share(resolution: u32) -> f64 {
    let n = f64::from(resolution);
    (1.04 / n).max(1.0 / (n - 4.5))
}

/// The suite's scene where a case takes any.
pub(super) fn standard() -> Result<Scene, SceneError> {
    Scene::bundled("cornell", &[])
}

/// Smallest and largest corner of a scene (m); a point where it has none.
pub(super) fn bounds(scene: &Scene) -> (Vec3, Vec3) {
    scene.bounds().unwrap_or((Vec3::ZERO, Vec3::ZERO))
}

/// Largest extent of a scene (m).
pub(super) fn extent_m(scene: &Scene) -> f32 {
    let (low, high) = bounds(scene);
    (high - low).max_element().max(f32::MIN_POSITIVE)
}

/// The scene at time 0, with nothing that moves.
pub(super) fn still(mut scene: Scene) -> Scene {
    scene
        .models
        .iter_mut()
        .for_each(|model| (model.dynamic, model.motion) = (false, None));
    scene
}

/// All of a scene, lights and camera too, turned about the vertical and enlarged about the middle
/// of its bounds, then moved (m). It looks the same.
pub(super) fn placed(scene: &Scene, turn_deg: f32, scale: f32, offset: Vec3) -> Scene {
    let (low, high) = bounds(scene);
    let (pivot, turn) = (
        0.5 * (low + high),
        Quat::from_rotation_y(turn_deg.to_radians()),
    );
    let point = |point: Vec3| {
        if turn_deg == 0.0 && scale == 1.0 {
            point + offset
        } else {
            pivot + scale * (turn * (point - pivot)) + offset
        }
    };
    let direction = |direction: Vec3| {
        if turn_deg == 0.0 {
            direction
        } else {
            turn * direction
        }
    };
    let vertex = |vertex: &Vertex| Vertex {
        position: point(vertex.position.into()).to_array(),
        normal: direction(vertex.normal.into()).to_array(),
        ..*vertex
    };
    let light = |light: &Light| match *light {
        Light::Directional {
            direction: travel,
            irradiance,
        } => Light::Directional {
            direction: direction(travel),
            irradiance,
        },
        Light::Point {
            position,
            intensity,
        } => Light::Point {
            position: point(position),
            intensity: intensity * (scale * scale),
        },
        Light::Spot {
            position,
            direction: travel,
            intensity,
            inner_deg,
            outer_deg,
        } => Light::Spot {
            position: point(position),
            direction: direction(travel),
            intensity: intensity * (scale * scale),
            inner_deg,
            outer_deg,
        },
    };
    let camera = Camera {
        eye: point(scene.camera.eye),
        target: point(scene.camera.target),
        up: direction(scene.camera.up),
        ..scene.camera
    };
    let (vertices, lights) = (
        scene.vertices.iter().map(vertex).collect(),
        scene.lights.iter().map(light).collect(),
    );
    Scene {
        vertices,
        lights,
        camera,
        ..still(scene.clone())
    }
}

/// The scene with a speck at two opposite corners of a cube around `middle` with edges of `edge_m`:
/// techniques that fit their grid to a scene fit it to the cube.
pub(super) fn anchored(mut scene: Scene, middle: Vec3, edge_m: f32) -> Scene {
    let material = scene.materials.len() as u32;
    scene.materials.push(Material {
        name: "anchor".into(),
        ..Material::default()
    });
    let first_triangle = scene.triangles.len() as u32;
    for sign in [-1.0, 1.0] {
        let corner = middle + Vec3::splat(0.5 * sign * edge_m);
        let first = scene.vertices.len() as u32;
        for inwards in [Vec3::ZERO, Vec3::X, Vec3::Y] {
            let position = (corner - inwards * (1e-3 * sign * edge_m)).to_array();
            scene.vertices.push(Vertex {
                position,
                u: 0.0,
                normal: [0.0, 0.0, 1.0],
                v: 0.0,
            });
        }
        scene.triangles.push(Triangle {
            vertices: [first, first + 1, first + 2],
            material,
        });
    }
    scene.models.push(Model {
        name: "anchors".into(),
        dynamic: false,
        first_triangle,
        triangle_count: 2,
        motion: None,
    });
    scene
}

/// All light of a scene times a factor.
pub(super) fn brightened(mut scene: Scene, factor: f32) -> Scene {
    scene.environment = scene.environment.times(factor);
    scene
        .materials
        .iter_mut()
        .for_each(|material| material.emission *= factor);
    for light in &mut scene.lights {
        match light {
            Light::Directional {
                irradiance: power, ..
            }
            | Light::Point {
                intensity: power, ..
            }
            | Light::Spot {
                intensity: power, ..
            } => *power *= factor,
        }
    }
    scene
}

/// A mesh with a closed room whose largest extent is [`ROOM_M`], 3 m high, floor at 0; and its
/// material.
pub(super) fn closed_room() -> (Mesh, u32) {
    let mut mesh = Mesh::default();
    let white = mesh.matte("room", [0.7, 0.7, 0.7]);
    let half = [-0.5 * ROOM_M, 0.5 * ROOM_M];
    mesh.room([&half, &[0.0, 3.0], &half], |_, _| Some(white));
    (mesh, white)
}

/// Adds a floor with an edge of [`ROOM_M`] at height 0, seen from above.
pub(super) fn add_floor(mesh: &mut Mesh, material: u32) {
    let half = 0.5 * ROOM_M;
    mesh.quad(
        material,
        [(-half, half), (half, half), (half, -half), (-half, -half)]
            .map(|(x, z)| Vec3::new(x, 0.0, z)),
    );
}

/// A camera at `eye` that looks at `target` (m), y up.
pub(super) fn camera(eye: [f32; 3], target: [f32; 3], vfov_deg: f32) -> Camera {
    Camera {
        eye: eye.into(),
        target: target.into(),
        up: Vec3::Y,
        vfov_deg,
    }
}

/// A white point light.
pub(super) fn lamp(position: [f32; 3], intensity: f32) -> Vec<Light> {
    vec![Light::Point {
        position: position.into(),
        intensity: Vec3::splat(intensity),
    }]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gi::shared::voxel::VoxelGrid;

    /// Turned by 90° and back, enlarged and moved: what was where is there again, and looks the
    /// same size.
    #[test]
    fn placing_keeps_the_picture() -> Result<(), SceneError> {
        let scene = standard()?;
        let same = placed(
            &placed(&scene, 90.0, 1.0, Vec3::ZERO),
            -90.0,
            1.0,
            Vec3::ZERO,
        );
        let near = |a: &Vertex, b: &Vertex| {
            Vec3::from(a.position).distance(b.position.into()) < 1e-5
                && Vec3::from(a.normal).distance(b.normal.into()) < 1e-5
        };
        assert!(
            scene
                .vertices
                .iter()
                .zip(&same.vertices)
                .all(|(a, b)| near(a, b))
        );
        assert!(scene.camera.eye.distance(same.camera.eye) < 1e-5);
        let large = placed(&scene, 0.0, 100.0, Vec3::X);
        assert!((extent_m(&large) - 100.0 * extent_m(&scene)).abs() < 1e-3);
        let irradiance =
            |scene: &Scene| scene.lights[0].sample(scene.vertices[0].position.into()).2;
        assert!(
            (irradiance(&large) - irradiance(&scene))
                .abs()
                .max_element()
                < 1e-4
        );
        Ok(())
    }

    #[test]
    fn voxels_are_the_grids() {
        for resolution in [32, 64, 100, 512] {
            let grid = VoxelGrid::around((Vec3::ZERO, Vec3::new(3.0, 1.0, 2.0)), resolution);
            assert!(
                (f64::from(grid.voxel_size) / 3.0 / cell_share(resolution) - 1.0).abs() < 1e-6,
                "{grid:?}"
            );
        }
    }

    /// The grid is fitted to the specks, and triangles stay sorted by material.
    #[test]
    fn anchors_are_the_bounds() -> Result<(), SceneError> {
        let scene = anchored(standard()?, Vec3::Y, 5.0);
        let (low, high) = bounds(&scene);
        assert!(
            low.distance(Vec3::new(-2.5, -1.5, -2.5)) < 1e-6
                && high.distance(Vec3::new(2.5, 3.5, 2.5)) < 1e-6
        );
        assert!(
            scene
                .triangles
                .is_sorted_by_key(|triangle| triangle.material)
        );
        assert_eq!(
            scene
                .models
                .iter()
                .map(|model| model.triangle_count as usize)
                .sum::<usize>(),
            scene.triangles.len()
        );
        Ok(())
    }
}
