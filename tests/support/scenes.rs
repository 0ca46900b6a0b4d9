//! Scenes for the oracle tests, in coordinates of voxels: [`in_unit_grid`] makes the grid's origin
//! 0 and its voxels 1 m wide.

use glam::{Quat, Vec3};
use lumivox::render::GpuScene;
use lumivox::scene::{
    Keyframe, LoadOptions, Material, Model, Motion, Pose, Scene, Triangle, Vertex,
};

use super::Random;

/// Three corners (m).
pub type Corners = [Vec3; 3];

/// Whether a resolution can have a grid of unit voxels ([`in_unit_grid`]).
pub const LARGEST_UNIT_GRID: u32 = 64;

/// A box around `middle`, seen from outside, turned about it.
pub fn cuboid(middle: Vec3, half: Vec3, turn: Quat) -> Vec<Corners> {
    let corner = |index: usize| {
        let side = |axis: usize| if index >> axis & 1 == 1 { 1.0 } else { -1.0 };
        middle + turn * (half * Vec3::new(side(0), side(1), side(2)))
    };
    let faces = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let triangles = faces.map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let corners = |triangle: [usize; 3]| triangle.map(corner);
    triangles.into_iter().flatten().map(corners).collect()
}

/// A bundled scene by name.
pub fn bundled(name: &str) -> Scene {
    Scene::open(format!("bundled:{name}"), &LoadOptions::default()).unwrap()
}

/// Triangles with random matt materials, some of which emit up to `emission` W/(m² sr).
pub fn scene_of(triangles: &[Corners], emission: f32, random: &mut Random) -> Scene {
    let mut scene = Scene::default();
    let unit3 = |random: &mut Random| Vec3::new(random.unit(), random.unit(), random.unit());
    for index in 0..triangles.len().div_ceil(4) {
        let glows = index % 3 == 0;
        let emission = if glows {
            emission * unit3(random)
        } else {
            Vec3::ZERO
        };
        scene.materials.push(Material {
            albedo: unit3(random),
            emission,
            ..Material::default()
        });
    }
    for (index, corners) in triangles.iter().enumerate() {
        let first = scene.vertices.len() as u32;
        scene.vertices.extend(corners.map(|corner| Vertex {
            position: corner.to_array(),
            u: corner.x,
            normal: [0.0, 1.0, 0.0],
            v: corner.y,
        }));
        scene.triangles.push(Triangle {
            vertices: [first, first + 1, first + 2],
            material: index as u32 / 4,
        });
    }
    scene
}

/// Sets the bounds by which [`lumivox::gi::shared::voxel::VoxelGrid::around`] makes a grid with
/// origin 0 and voxels of 1 m, whatever the triangles are.
pub fn in_unit_grid(scene: &mut GpuScene, resolution: u32) {
    assert!(resolution <= LARGEST_UNIT_GRID);
    scene.bounds = (Vec3::splat(2.25), Vec3::splat(resolution as f32 - 2.25));
}

/// Random triangles, a few of each kind that has broken a voxelizer before: ordinary, tiny,
/// needles, much larger than the grid, with corners on voxel boundaries, in a plane between voxels,
/// without area, twice the same, outside.
pub fn soup(random: &mut Random, resolution: u32) -> Vec<Corners> {
    let n = resolution as f32;
    let mut triangles = Vec::new();
    let point = |random: &mut Random, low: f32, high: f32| {
        Vec3::from([0; 3].map(|_: u32| low + (high - low) * random.unit()))
    };
    for _ in 0..12 {
        let at = point(random, 0.0, n);
        let spread = n * random.unit().powi(2) * 0.5;
        triangles.push([0; 3].map(|_: u32| at + point(random, -spread, spread)));
        let at = point(random, 0.0, n);
        triangles.push([0; 3].map(|_: u32| at + point(random, -0.2, 0.2)));
    }
    for _ in 0..6 {
        let (from, to) = (point(random, 0.0, n), point(random, 0.0, n));
        let beside = point(random, -1.0, 1.0) * 10f32.powf(-4.0 * random.unit());
        triangles.push([from, to, to + beside]);
        let lattice = |random: &mut Random| {
            Vec3::from([0; 3].map(|_: u32| random.below(resolution + 1) as f32))
        };
        triangles.push([lattice(random), lattice(random), lattice(random)]);
        let mut flat = [lattice(random), lattice(random), point(random, 0.0, n)];
        let axis = random.below(3) as usize;
        let level = flat[0][axis];
        flat.iter_mut().for_each(|corner| corner[axis] = level);
        triangles.push(flat);
    }
    for _ in 0..2 {
        triangles.push([0; 3].map(|_: u32| point(random, -8.0 * n, 9.0 * n)));
        let outside = point(random, 1.5 * n, 2.0 * n);
        triangles.push([outside, outside + Vec3::X, outside + Vec3::Y]);
    }
    let corner = point(random, 0.0, n);
    triangles.push([corner, corner, point(random, 0.0, n)]);
    triangles.push([corner, corner, corner]);
    let along = point(random, 0.0, 1.0).round();
    triangles.push([
        corner.round(),
        corner.round() + along,
        corner.round() + 2.0 * along,
    ]);
    let again: Vec<Corners> = triangles.iter().take(5).copied().collect();
    triangles.extend(again);
    triangles
}

/// A lumpy closed surface of about `4 count²` triangles about the middle of the grid: curved, small
/// triangles, as of a scanned model.
pub fn lump(count: u32, resolution: u32) -> Vec<Corners> {
    let n = resolution as f32;
    let point = |i: u32, j: u32| {
        let (theta, phi) = (
            std::f32::consts::PI * i as f32 / count as f32,
            std::f32::consts::TAU * j as f32 / (2 * count) as f32,
        );
        let radius = n
            * (0.33 + 0.05 * (5.0 * phi).sin() * theta.sin().powi(2) + 0.03 * (7.0 * theta).cos());
        Vec3::splat(0.5 * n)
            + radius
                * Vec3::new(
                    theta.sin() * phi.cos(),
                    theta.cos(),
                    theta.sin() * phi.sin(),
                )
    };
    let quad = |(i, j)| {
        [
            [point(i, j), point(i + 1, j), point(i + 1, j + 1)],
            [point(i, j), point(i + 1, j + 1), point(i, j + 1)],
        ]
    };
    (0..count)
        .flat_map(|i| (0..2 * count).map(move |j| (i, j)))
        .flat_map(quad)
        .collect()
}

/// Appends the triangles of another scene as a dynamic model that is at one pose each second.
pub fn add_model(scene: &mut Scene, model: Scene, poses: &[Pose]) {
    let (first_vertex, first_material) =
        (scene.vertices.len() as u32, scene.materials.len() as u32);
    let (first_triangle, triangle_count) =
        (scene.triangles.len() as u32, model.triangles.len() as u32);
    let keyframes = (0u16..)
        .zip(poses)
        .map(|(second, pose)| Keyframe {
            time_s: f32::from(second),
            pose: *pose,
        })
        .collect();
    let motion = Some(Motion {
        first_vertex,
        rest: model.vertices.clone(),
        keyframes,
    });
    scene.models.push(Model {
        name: format!("model {first_triangle}"),
        dynamic: true,
        first_triangle,
        triangle_count,
        motion,
    });
    scene.vertices.extend(model.vertices);
    scene.materials.extend(model.materials);
    for mut triangle in model.triangles {
        triangle.vertices = triangle.vertices.map(|vertex| vertex + first_vertex);
        triangle.material += first_material;
        scene.triangles.push(triangle);
    }
    scene.set_time(0.0);
}

/// The model as it is made, moved.
pub fn still(translate: Vec3) -> Pose {
    Pose {
        rotate_deg: Vec3::ZERO,
        translate,
    }
}

/// Turned in any way, and up to `reach` away along each axis.
pub fn random_pose(random: &mut Random, reach: f32) -> Pose {
    let mut unit3 =
        |scale: f32| Vec3::from([0; 3].map(|_: u32| scale * (2.0 * random.unit() - 1.0)));
    Pose {
        rotate_deg: unit3(180.0),
        translate: unit3(reach),
    }
}
