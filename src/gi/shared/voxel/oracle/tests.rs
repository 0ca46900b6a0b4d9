//! The oracle on cases computed by hand.

use std::f64::consts::PI;

use glam::DVec2;

use super::light::{arriving_light, at_weights, sample_weights};
use super::*;
use crate::gi::shared::voxel::Surface;
use crate::scene::{Light, Specular, Texture, TextureKind, Triangle};

const UNIT_GRID: Grid = Grid {
    origin: Vec3::ZERO,
    voxel_size: 1.0,
    resolution: 4,
};

/// A scene of matt triangles, each with an albedo; the texture coordinates are (x, y).
fn scene_of(triangles: &[(GridTriangle, f32)]) -> Scene {
    let mut scene = Scene::default();
    for (corners, albedo) in triangles {
        let first = scene.vertices.len() as u32;
        let material = scene.materials.len() as u32;
        scene.vertices.extend(corners.map(|position| Vertex {
            position,
            u: position[0],
            normal: [0.0, 0.0, 1.0],
            v: position[1],
        }));
        scene.triangles.push(Triangle {
            vertices: [first, first + 1, first + 2],
            material,
        });
        scene.materials.push(Material {
            albedo: Vec3::splat(*albedo),
            ..Material::default()
        });
    }
    scene
}

/// A square of side `size` from the origin, at height z, facing up, in two triangles.
fn floor(size: f32, z: f32, albedo: f32) -> [(GridTriangle, f32); 2] {
    let corner = |x: f32, y: f32| [x * size, y * size, z];
    [
        (
            [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0)],
            albedo,
        ),
        (
            [corner(0.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)],
            albedo,
        ),
    ]
}

fn texture(kind: TextureKind, texels: &[[u8; 4]]) -> Texture {
    Texture {
        name: String::from("test"),
        kind,
        width: texels.len() as u32,
        height: 1,
        texels: texels.to_vec(),
    }
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

fn near(a: DVec3, b: DVec3) -> bool {
    (a - b).abs().max_element() < 1e-9
}

#[test]
fn grid_position_is_rounded_in_f32() {
    let grid = Grid {
        origin: Vec3::new(-1.0, 0.5, 0.0),
        voxel_size: 0.3,
        resolution: 64,
    };
    let inverse = 1.0f32 / 0.3f32;
    assert_eq!(
        grid.position([2.0, 0.5, 0.1]),
        [3.0 * inverse, 0.0, 0.1 * inverse]
    );
}

#[test]
fn small_triangle_touches_its_own_voxel() {
    assert_eq!(
        touched_voxels([[1.2, 2.2, 3.2], [1.8, 2.3, 3.4], [1.4, 2.9, 3.6]], 4),
        [[1, 2, 3]]
    );
}

#[test]
fn plane_on_a_boundary_touches_both_layers() {
    let triangle = [[0.25, 0.25, 1.0], [0.75, 0.25, 1.0], [0.25, 0.75, 1.0]];
    assert_eq!(touched_voxels(triangle, 4), [[0, 0, 0], [0, 0, 1]]);
    let at_top = triangle.map(|[x, y, _]| [x, y, 4.0]);
    assert_eq!(touched_voxels(at_top, 4), [[0, 0, 3]]);
    let outside = triangle.map(|[x, y, _]| [x, y, 4.5]);
    assert!(touched_voxels(outside, 4).is_empty());
}

/// The plane x + y + z = 1.5 cuts the octant: the voxel at the origin and its three neighbours, but
/// none with x + y ≥ 2.
#[test]
fn diagonal_triangle_touches_four_voxels() {
    let triangle = [[1.5, 0.0, 0.0], [0.0, 1.5, 0.0], [0.0, 0.0, 1.5]];
    assert_eq!(
        touched_voxels(triangle, 2),
        [[0, 0, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0]]
    );
    let separation = |voxel: VoxelIndex| {
        candidates(triangle, 2, 0.0, Surface::Conservative)
            .iter()
            .find(|candidate| candidate.voxel == voxel)
            .map(|found| found.separation)
    };
    // (1, 1, 0) is nearest to the edge's middle (¾, ¾, 0).
    assert!(separation([1, 1, 0]).is_some_and(|gap| close(gap, 0.5 / 2f64.sqrt())));
    // The corner (1, 1, 1) of the voxel at the origin is 1.5 / √3 beyond the plane; its corner (0,
    // 0, 0) as far before it.
    assert!(separation([0, 0, 0]).is_some_and(|gap| close(gap, -1.5 / 3f64.sqrt())));
}

/// The plane x + y + z = 1.5 meets the cross of only one of the four voxels: the other centres are
/// 1 / √3 away, and their crosses reach ½ / √3.
#[test]
fn a_thin_diagonal_triangle_is_in_one_voxel() {
    let triangle = [[1.5, 0.0, 0.0], [0.0, 1.5, 0.0], [0.0, 0.0, 1.5]];
    let near = candidates(triangle, 2, 0.0, Surface::Thin);
    let thin: Vec<VoxelIndex> = near
        .iter()
        .filter(|near| near.separation <= 0.0)
        .map(|near| near.voxel)
        .collect();
    assert_eq!(thin, [[0, 0, 0]]);
    let beside = near.iter().find(|near| near.voxel == [1, 0, 0]);
    assert!(beside.is_some_and(|near| close(near.separation, 0.5 / 3f64.sqrt())));
}

/// With vertices on the axes at 1 the neighbours are touched in one point.
#[test]
fn touching_in_a_point_counts() {
    let triangle = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(
        touched_voxels(triangle, 2),
        [[0, 0, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0]]
    );
}

#[test]
fn triangles_without_area_are_skipped() {
    assert!(touched_voxels([[0.5, 0.5, 0.5], [1.5, 1.5, 1.5], [2.5, 2.5, 2.5]], 4).is_empty());
    assert!(touched_voxels([[0.5, 0.5, 0.5]; 3], 4).is_empty());
    assert!(candidates([[0.5, 0.5, 0.5]; 3], 4, 1.0, Surface::Conservative).is_empty());
}

/// The separation of every candidate against the distance found by dense sampling of the triangle.
#[test]
fn separation_agrees_with_sampled_points() {
    let triangle = [[0.3, 0.1, 0.2], [3.7, 1.3, 0.9], [1.1, 3.2, 3.6]];
    let points: Vec<DVec3> = (0..40_000)
        .map(|sample| at_weights(doubles(triangle), sample_weights(sample)))
        .collect();
    for Candidate { voxel, separation } in candidates(triangle, 4, 1.0, Surface::Conservative) {
        let corner = corner_of(voxel);
        let inside = points
            .iter()
            .any(|point| point.cmpge(corner).all() && point.cmple(corner + 1.0).all());
        assert!(
            !inside || separation <= 0.0,
            "{voxel:?} holds a point of the triangle but has {separation}"
        );
        assert!(
            inside || separation > -0.1,
            "{voxel:?} holds no point of the triangle but has {separation}"
        );
    }
}

#[test]
fn quad_fills_one_layer() {
    let voxels = voxelize(&scene_of(&floor(4.0, 1.5, 0.25)), &UNIT_GRID);
    assert_eq!(voxels.len(), 16);
    for ([x, y, z], sum) in &voxels {
        assert_eq!(*z, 1);
        // Voxels beside the diagonal touch the other triangle in a point.
        assert!(
            (sum.area - 1.0).abs() <= 2.0 * LEAST_WEIGHT,
            "{x} {y}: {}",
            sum.area
        );
        assert!(near(sum.normal, DVec3::Z) && near(sum.albedo, DVec3::splat(0.25)));
        assert!((sum.mean_position - 0.5).abs().max_element() < 2.0 * LEAST_WEIGHT);
        assert!((sum.coverage - 1.0).abs() < 1e-9);
    }
}

#[test]
fn triangle_inside_a_voxel_is_exact() {
    let parts = fragments(
        &scene_of(&[(
            [[1.25, 1.25, 1.25], [1.75, 1.25, 1.25], [1.25, 1.75, 1.25]],
            0.5,
        )]),
        &UNIT_GRID,
    );
    assert_eq!(parts.len(), 1);
    assert_eq!(parts[0].voxel, [1, 1, 1]);
    assert!(close(parts[0].area, 0.125));
    assert!(near(
        parts[0].mean_position,
        DVec3::new(0.25 + 0.5 / 3.0, 0.25 + 0.5 / 3.0, 0.25)
    ));
}

/// The triangle of side 1.5 √2 is cut into three corners of a ninth each and a hexagon-like rest of
/// six ninths.
#[test]
fn diagonal_triangle_is_shared_out() {
    let triangle = [[1.5, 0.0, 0.0], [0.0, 1.5, 0.0], [0.0, 0.0, 1.5]];
    let voxels = voxelize(&scene_of(&[(triangle, 0.5)]), &UNIT_GRID);
    let whole = 3f64.sqrt() / 4.0 * 4.5;
    assert_eq!(voxels.len(), 4);
    assert!(close(voxels[&[0, 0, 0]].area, whole * 6.0 / 9.0));
    assert!(near(voxels[&[0, 0, 0]].mean_position, DVec3::splat(0.5)));
    assert!(close(voxels[&[1, 0, 0]].area, whole / 9.0));
    assert!(near(
        voxels[&[1, 0, 0]].mean_position,
        DVec3::new(0.5 / 3.0, 0.5 / 3.0, 0.5 / 3.0)
    ));
    assert!(close(
        voxels[&[1, 0, 0]].coverage,
        whole / 9.0 / 3f64.sqrt()
    ));
}

#[test]
fn a_common_face_counts_in_both_voxels() {
    let voxels = voxelize(
        &scene_of(&[(
            [[0.25, 0.25, 1.0], [0.75, 0.25, 1.0], [0.25, 0.75, 1.0]],
            0.5,
        )]),
        &UNIT_GRID,
    );
    assert!(close(voxels[&[0, 0, 0]].area, 0.125) && close(voxels[&[0, 0, 1]].area, 0.125));
    assert!(
        close(voxels[&[0, 0, 0]].mean_position.z, 1.0)
            && close(voxels[&[0, 0, 1]].mean_position.z, 0.0)
    );
}

/// A triangle in a plane between voxels whose corners lie anywhere fills the face of every voxel
/// inside it, however its outline is rounded.
#[test]
fn a_common_face_is_whole_whatever_the_outline() {
    let triangle = [
        [10.261913, 38.0, 12.524603],
        [15.524603, 38.0, 29.738089],
        [32.73809, 38.0, 24.475399],
    ];
    let voxels = voxelize(
        &scene_of(&[(triangle, 0.5)]),
        &Grid {
            resolution: 64,
            ..UNIT_GRID
        },
    );
    for y in [37, 38] {
        assert!(
            close(voxels[&[16, y, 28]].area, 1.0),
            "{}",
            voxels[&[16, y, 28]].area
        );
    }
}

/// A voxel touched in one point has the least weight; its mean position is that point.
#[test]
fn slivers_have_the_least_weight() {
    let voxels = voxelize(
        &scene_of(&[([[1.0, 0.25, 0.25], [0.5, 0.25, 0.25], [0.5, 0.5, 0.5]], 0.5)]),
        &UNIT_GRID,
    );
    let sliver = &voxels[&[1, 0, 0]];
    assert_eq!(sliver.area, LEAST_WEIGHT);
    assert_eq!(sliver.coverage, LEAST_COVERAGE);
    assert!(near(sliver.mean_position, DVec3::new(0.0, 0.25, 0.25)));
}

#[test]
fn means_are_weighted_by_area() {
    let large = [[0.0, 0.0, 0.5], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]];
    let small = [[0.25, 0.0, 0.25], [0.25, 0.0, 0.5], [0.25, 0.25, 0.25]];
    let voxels = voxelize(&scene_of(&[(large, 0.125), (small, 0.625)]), &UNIT_GRID);
    let sum = &voxels[&[0, 0, 0]];
    // Areas 1/8 and 1/32: weights 4/5 and 1/5.
    assert_eq!(sum.fragment_count, 2);
    assert!(close(sum.area, 5.0 / 32.0));
    assert!(near(sum.albedo, DVec3::splat(0.8 * 0.125 + 0.2 * 0.625)));
    assert!(near(sum.normal, DVec3::new(-0.2, 0.0, 0.8)));
    assert!(close(sum.coverage, 0.125));
}

/// Texels 0.5 wide along x, black and white by turns: a voxel's mean is one half wherever it lies.
#[test]
fn textures_are_averaged_over_a_voxel() {
    let mut scene = scene_of(&floor(4.0, 1.5, 0.5));
    scene.textures = vec![texture(
        TextureKind::Color,
        &[[0, 0, 0, 255], [255, 255, 255, 255]],
    )];
    scene.materials[0].albedo_texture = Some(0);
    scene.materials[0].emission = Vec3::new(8.0, 0.0, 0.0);
    let parts = fragments(&scene, &UNIT_GRID);
    let first = parts
        .iter()
        .find(|part| part.triangle == 0 && part.voxel == [3, 0, 1]);
    assert!(
        first.is_some_and(|part| near(part.albedo, DVec3::splat(0.25))
            && near(part.emission, DVec3::new(8.0, 0.0, 0.0)))
    );
}

#[test]
fn masks_and_metals() {
    let mut scene = scene_of(&floor(4.0, 1.5, 0.5));
    scene.textures = vec![
        texture(TextureKind::Mask, &[[0; 4]]),
        texture(TextureKind::Mask, &[[153; 4]]),
    ];
    scene.materials[0].mask_texture = Some(0);
    scene.materials[1].mask_texture = Some(1);
    scene.materials[1].specular = Some(Specular {
        f0: Vec3::ONE,
        roughness: 0.5,
        metalness: 0.75,
    });
    let parts = fragments(&scene, &UNIT_GRID);
    assert!(parts.iter().all(|part| part.triangle == 1));
    let whole = parts.iter().find(|part| part.voxel == [0, 3, 1]);
    assert!(
        whole.is_some_and(|part| (part.area - 0.6).abs() < 1e-6
            && (part.albedo - 0.125).abs().max_element() < 1e-6)
    );
}

#[test]
fn compact_index_follows_the_blocks() {
    let voxels = [
        [4, 0, 0],
        [0, 0, 1],
        [3, 3, 3],
        [0, 4, 0],
        [1, 0, 0],
        [0, 1, 0],
    ];
    assert_eq!(
        compact_order(voxels),
        [
            [1, 0, 0],
            [0, 1, 0],
            [0, 0, 1],
            [3, 3, 3],
            [4, 0, 0],
            [0, 4, 0]
        ]
    );
    let words = occupancy_words(voxels, 8);
    assert_eq!(words.len(), 16);
    assert_eq!(words[..6], [1 << 1 | 1 << 2 | 1 << 4, 1 << 31, 1, 0, 1, 0]);
    assert_eq!(block_bases(&words), [0, 4, 5, 6, 6, 6, 6, 6]);
}

/// A wall of voxels at x = 5, one in front of it at (2, 3, 3), facing −x.
fn walled() -> TraceGrid {
    let voxel = |radiance: f64| TraceVoxel {
        mean_position: DVec3::splat(0.5),
        mean_normal: DVec3::NEG_X,
        opposed_axis: None,
        is_concave: false,
        across: DVec3::X,
        radiance: [DVec3::splat(radiance); 2],
    };
    let wall = (0..64).map(|index| ([5, index / 8, index % 8], voxel(1.0)));
    TraceGrid {
        resolution: 8,
        voxels: wall.chain([([2, 3, 3], voxel(4.0))]).collect(),
    }
}

const FLOOR: Receiver = Receiver {
    position: DVec3::new(0.5, 3.5, 0.25),
    geometric_normal: DVec3::Z,
    shading_normal: DVec3::Z,
};
const ANY_TOUCH: TraceSettings = TraceSettings {
    self_height: -100.0,
    contour_slack: -1.0,
    seed: 0,
    ray: 0,
};

fn ended(origin: DVec3, direction: DVec3, settings: TraceSettings) -> (VoxelIndex, f64) {
    match trace(&walled(), origin, direction, &FLOOR, &settings) {
        TraceEnd::Hit(hit) => (hit.voxel, hit.entry),
        TraceEnd::Miss(distance) => ([u32::MAX; 3], distance),
    }
}

#[test]
fn rays_hit_the_nearest_voxel() {
    let origin = DVec3::new(0.5, 3.5, 3.5);
    assert_eq!(ended(origin, DVec3::X, ANY_TOUCH), ([2, 3, 3], 1.5));
    assert_eq!(
        ended(origin + DVec3::Z, DVec3::X, ANY_TOUCH),
        ([5, 3, 4], 4.5)
    );
    assert_eq!(ended(origin, DVec3::NEG_X, ANY_TOUCH), ([u32::MAX; 3], 0.5));
    assert_eq!(
        ended(DVec3::new(2.5, 3.5, 3.5), DVec3::X, ANY_TOUCH),
        ([2, 3, 3], 0.0)
    );
    assert_eq!(
        ended(DVec3::new(-1.0, 3.5, 3.5), DVec3::X, ANY_TOUCH),
        ([u32::MAX; 3], 0.0)
    );
}

#[test]
fn low_voxels_are_the_receiver() {
    let origin = DVec3::new(0.5, 3.5, 3.5);
    // Mean height of (2, 3, 3) over the receiver's plane is 3.25.
    assert_eq!(
        ended(
            origin,
            DVec3::X,
            TraceSettings {
                self_height: 3.25,
                ..ANY_TOUCH
            }
        )
        .0,
        [2, 3, 3]
    );
    assert_eq!(
        ended(
            origin,
            DVec3::X,
            TraceSettings {
                self_height: 3.26,
                ..ANY_TOUCH
            }
        )
        .0,
        [u32::MAX; 3]
    );
}

/// From (0.5, 3.5, 1.5) towards (2.5, 3.5, z) the plane x = 2.5 of the voxel (2, 3, 3) is met at
/// height z.
#[test]
fn contours_cut_the_corners_of_voxels() {
    let origin = DVec3::new(0.5, 3.5, 1.5);
    let towards = |z: f64| (DVec3::new(2.5, 3.5, z) - origin).normalize();
    let contour = |slack: f64| TraceSettings {
        contour_slack: slack,
        ..ANY_TOUCH
    };
    assert_eq!(ended(origin, towards(2.9), ANY_TOUCH).0, [2, 3, 3]);
    assert_eq!(ended(origin, towards(2.9), contour(0.0)).0, [5, 3, 4]);
    assert_eq!(ended(origin, towards(2.9), contour(0.2)).0, [2, 3, 3]);
    let seen = crossings(&walled(), origin, towards(2.9), &FLOOR, &contour(0.0));
    assert!(seen.first().is_some_and(|first| close(first.margin, -0.1)));
}

/// A chain that fills 3% of a voxel stops 3% of the rays; a plane with a hole, a share of them.
#[test]
fn surfaces_stop_rays_by_the_area_that_they_show() {
    let stopped = |voxel: TraceVoxel| {
        let grid = TraceGrid {
            resolution: 8,
            voxels: [([3, 3, 3], voxel)].into(),
        };
        let stops = |ray: u32| {
            let settings = TraceSettings {
                self_height: -100.0,
                contour_slack: 0.1,
                seed: 7,
                ray,
            };
            let origin = DVec3::new(0.5, 3.5, 3.5);
            matches!(
                trace(&grid, origin, DVec3::X, &FLOOR, &settings),
                TraceEnd::Hit(_)
            )
        };
        f64::from((0..1000).filter(|ray| stops(*ray)).count() as u32) / 1000.0
    };
    let chain = TraceVoxel {
        mean_position: DVec3::splat(0.5),
        mean_normal: DVec3::splat(0.1),
        opposed_axis: Some(0),
        is_concave: false,
        across: DVec3::new(0.03, 0.5, 0.5),
        radiance: [DVec3::ONE; 2],
    };
    assert!((stopped(chain) - 0.03).abs() < 0.005, "{}", stopped(chain));
    let plane = |area: f64| TraceVoxel {
        mean_normal: DVec3::NEG_X,
        opposed_axis: None,
        across: DVec3::X * area,
        ..chain
    };
    assert!((stopped(plane(0.4)) - 0.4).abs() < 0.02);
    assert_eq!(stopped(plane(0.95)), 1.0);
    assert_eq!(
        stopped(TraceVoxel {
            is_concave: true,
            mean_normal: DVec3::splat(-0.4),
            opposed_axis: None,
            ..chain
        }),
        1.0
    );
}

#[test]
fn rays_gather_a_furnace_and_the_environment() {
    let inside = |index: u32| [index % 8, index / 8 % 8, index / 64];
    let shell = (0..512)
        .map(inside)
        .filter(|voxel| voxel.iter().any(|at| *at == 0 || *at == 7));
    let voxel = TraceVoxel {
        mean_position: DVec3::splat(0.5),
        mean_normal: DVec3::ZERO,
        opposed_axis: None,
        is_concave: false,
        across: DVec3::ONE,
        radiance: [DVec3::new(1.0, 2.0, 3.0); 2],
    };
    let furnace = TraceGrid {
        resolution: 8,
        voxels: shell.map(|at| (at, voxel)).collect(),
    };
    let receiver = Receiver {
        position: DVec3::new(4.0, 4.0, 2.0),
        ..FLOOR
    };
    let settings = GatherSettings {
        ray_count: 64,
        start_offset: 0.5,
        trace: ANY_TOUCH,
        ao_falloff: 0.0,
        pattern: DVec2::new(0.5, 0.0),
        environment: DVec3::splat(0.5),
    };
    let gathered = gather_rays(&furnace, &receiver, &settings);
    assert!(near(gathered.irradiance, PI * voxel.radiance[0]) && close(gathered.visibility, 0.0));
    let open = gather_rays(
        &TraceGrid {
            resolution: 8,
            ..TraceGrid::default()
        },
        &receiver,
        &settings,
    );
    assert!(near(open.irradiance, DVec3::splat(0.5 * PI)) && close(open.visibility, 1.0));
}

#[test]
fn directions_are_cosine_distributed_unit_vectors() {
    for normal in [
        DVec3::Z,
        DVec3::NEG_Z,
        DVec3::new(0.6, 0.0, -0.8),
        DVec3::new(-2.0, 1.0, 2.0) / 3.0,
    ] {
        let [a, b] = [0.0, PI / 2.0].map(|azimuth| hemisphere_direction(normal, 0.36, azimuth));
        assert!(close(a.length(), 1.0) && close(a.dot(normal), 0.8) && close(b.dot(normal), 0.8));
        // A quarter of a turn apart: only the parts along the normal remain.
        assert!(close(a.dot(b), 0.64));
    }
}

#[test]
fn floor_reflects_a_beam() {
    let mut scene = scene_of(&floor(4.0, 1.25, 0.5));
    let direction = Vec3::new(0.75f32.sqrt(), 0.0, -0.5);
    scene.lights = vec![Light::Directional {
        direction,
        irradiance: Vec3::splat(4.0),
    }];
    let grid = Grid {
        voxel_size: 0.5,
        resolution: 8,
        ..UNIT_GRID
    };
    let radiance = inject(&scene, &grid, 4);
    assert_eq!(radiance.len(), 64);
    // Triangles that only touch a full voxel have a least weight, and so it has a little more than
    // one face.
    assert!(
        radiance
            .values()
            .all(|value| (*value - 1.0 / PI).abs().max_element() < 3.0 * LEAST_WEIGHT)
    );
    let flux = reflected_flux(&scene, 4);
    assert!((flux - 16.0).abs().max_element() < 1e-5);
    let collected = voxel_flux(&voxelize(&scene, &grid), &radiance, &grid);
    assert!((collected / flux - 1.0).abs().max_element() < 1e-3);
    // The other side reflects as well.
    scene.lights = vec![Light::Directional {
        direction: -direction,
        irradiance: Vec3::splat(4.0),
    }];
    assert!((reflected_flux(&scene, 4) - 16.0).abs().max_element() < 1e-5);
}

#[test]
fn nothing_behind_a_light_occludes() {
    let ceiling = floor(4.0, 3.75, 0.5).map(|(triangle, _)| (triangle, 0.0));
    let mut scene = scene_of(&[floor(4.0, 1.25, 0.5), ceiling].concat());
    let lamp = |z: f32| {
        vec![Light::Point {
            position: Vec3::new(2.0, 1.0, z),
            intensity: Vec3::ONE,
        }]
    };
    scene.lights = lamp(3.5);
    assert!(inject(&scene, &UNIT_GRID, 4)[&[1, 1, 1]].x > 0.0);
    scene.lights = lamp(4.0);
    assert_eq!(inject(&scene, &UNIT_GRID, 4)[&[1, 1, 1]], DVec3::ZERO);
}

/// The normals of a thin sheet's two sides cancel; what the sheet covers does not, nor its plane.
#[test]
fn both_sides_of_a_sheet_cover() {
    let front = [[0.0, 0.0, 0.5], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]];
    let sum = voxelize(
        &scene_of(&[(front, 0.5), ([front[0], front[2], front[1]], 0.5)]),
        &UNIT_GRID,
    )[&[0, 0, 0]];
    assert!(near(sum.normal, DVec3::Z) && close(sum.coverage, 0.25));
    assert!(
        close(sum.seen_from_one, 0.5)
            && close(sum.seen_from_both, 1.0)
            && sum.opposed_axis == Some(2)
    );
}

/// Light from above leaves the upper side of a sheet, whichever way its normal points; of a wall of
/// two sheets each side keeps its own, undiminished.
#[test]
fn sides_keep_their_own_light() {
    let front = [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [0.0, 1.0, 0.5]];
    let lower = front.map(|[x, y, z]| [x, y, z - 0.25]);
    let down = |irradiance: f32, z: f32| Light::Directional {
        direction: Vec3::new(0.0, 0.0, z),
        irradiance: Vec3::splat(irradiance),
    };
    for (triangles, expected) in [
        (vec![(front, 0.5)], [3.0, 1.0]),
        (vec![([front[0], front[2], front[1]], 0.5)], [1.0, 3.0]),
        (
            vec![(front, 0.5), ([lower[0], lower[2], lower[1]], 0.5)],
            [3.0, 1.0],
        ),
    ] {
        let mut scene = scene_of(&triangles);
        scene.lights = vec![down(3.0, -1.0), down(1.0, 1.0)];
        let sides = inject_sides(&scene, &UNIT_GRID, 16)[&[0, 0, 0]];
        for (side, expected) in sides.iter().zip(expected) {
            assert!(close(side.x, 0.5 / PI * expected), "{sides:?}");
        }
        let mean = inject(&scene, &UNIT_GRID, 16)[&[0, 0, 0]].x;
        assert!(
            close(mean, 0.5 / PI * 4.0 / triangles.len() as f64),
            "{mean}"
        );
    }
}

/// A floor and a wall meet in a voxel, and light falls straight onto the floor: the faces of the
/// wall stay dark, where the mean over both would be half as bright.
#[test]
fn faces_keep_the_light_of_their_own_plane() {
    let floor = [[0.25, 0.25, 0.25], [1.0, 0.25, 0.25], [0.25, 1.0, 0.25]];
    let wall = [[0.25, 0.25, 0.25], [0.25, 1.0, 0.25], [0.25, 0.25, 1.0]];
    let mut scene = scene_of(&[(floor, 0.5), (wall, 0.5)]);
    scene.lights = vec![Light::Directional {
        direction: Vec3::NEG_Z,
        irradiance: Vec3::splat(3.0),
    }];
    let faces = inject_faces(&scene, &UNIT_GRID, 16)[&[0, 0, 0]].map(|face| face.x);
    for (face, expected) in [0.0, 0.0, 0.0, 0.0, 3.0 * 0.5 / PI, 0.0]
        .into_iter()
        .enumerate()
    {
        assert!(close(faces[face], expected), "{face}: {faces:?}");
    }
    let [front, _] = inject_sides(&scene, &UNIT_GRID, 16)[&[0, 0, 0]];
    assert!(close(front.x, 0.5 * 3.0 * 0.5 / PI), "{front:?}");
}

/// Two panels fill a voxel's face, one before the other. Only one is seen: it glows as it does
/// alone, and to its front only.
#[test]
fn stacked_panels_glow_as_one() {
    let corners = [[-4.0, -4.0, 0.5], [4.0, -4.0, 0.5], [0.0, 4.0, 0.5]];
    let behind = corners.map(|[x, y, z]| [x, y, z - 0.25]);
    let mut scene = scene_of(&[(corners, 0.5), (behind, 0.5)]);
    scene.materials[0].emission = Vec3::splat(8.0);
    scene.triangles[1].material = 1;
    scene.materials.push(crate::scene::Material::default());
    let sum = voxelize(&scene, &UNIT_GRID)[&[0, 0, 0]];
    assert!(
        close(sum.seen_from_one, 0.5)
            && close(sum.emission_ahead, 1.0)
            && near(sum.emission / sum.seen_from_one, DVec3::splat(8.0)),
        "{sum:?}"
    );
}

/// A wall of two sheets that is turned by 30°: its normal is stored, not the axis nearest to it.
#[test]
fn opposed_planes_that_are_parallel_keep_their_normal() {
    let (sine, cosine) = 30f32.to_radians().sin_cos();
    let at = |across: f32, along: f32, z: f32| {
        let (x, y) = (
            0.5 + along * cosine - across * sine,
            0.5 + along * sine + across * cosine,
        );
        [x, y, z]
    };
    let sheet = |across| {
        [
            at(across, -0.3, 0.2),
            at(across, 0.3, 0.2),
            at(across, 0.3, 0.8),
        ]
    };
    let [a, b, c] = sheet(-0.1);
    let sum = voxelize(
        &scene_of(&[(sheet(0.1), 0.5), ([a, c, b], 0.5)]),
        &UNIT_GRID,
    )[&[0, 0, 0]];
    let normal = DVec3::new(-f64::from(sine), f64::from(cosine), 0.0);
    assert!(
        sum.opposed_axis == Some(1)
            && sum.normal.dot(normal) > 0.999_999
            && sum.front() == sum.normal,
        "{sum:?}"
    );
}

/// The corner of a room and the edge of a box have the same mean normal and lie apart.
#[test]
fn rooms_are_concave_and_boxes_are_not() {
    let floor = |low: f32, high: f32| [[low, low, 0.5], [high, low, 0.5], [low, high, 0.5]];
    let wall = |low: f32, high: f32| [[0.5, low, low], [0.5, high, low], [0.5, low, high]];
    for (low, high, is_concave) in [(0.5, 1.0, true), (0.0, 0.5, false)] {
        let scene = scene_of(&[(floor(low, high), 0.5), (wall(low, high), 0.5)]);
        let sum = voxelize(&scene, &UNIT_GRID)[&[0, 0, 0]];
        assert!(
            sum.is_concave() == is_concave && sum.opposed_axis.is_none(),
            "{sum:?}"
        );
        assert!(near(sum.across(), DVec3::new(0.125, 0.0, 0.125)), "{sum:?}");
    }
}

/// A floor and a wall that face the same corner of the voxel are opposed nowhere.
#[test]
fn corners_are_seen_whole_from_their_front() {
    let floor = [[0.0, 0.0, 0.25], [1.0, 0.0, 0.25], [0.0, 1.0, 0.25]];
    let wall = [[0.25, 0.0, 0.0], [0.25, 1.0, 0.0], [0.25, 0.0, 1.0]];
    let sum = voxelize(&scene_of(&[(floor, 0.5), (wall, 0.5)]), &UNIT_GRID)[&[0, 0, 0]];
    assert!(
        close(sum.seen_from_one, 1.0)
            && sum.opposed_axis.is_none()
            && sum.front().x > 0.5
            && sum.front().z > 0.5
    );
}

/// A lamp above a corner of a floor; beyond a wall the floor lies in its shadow.
#[test]
fn walls_throw_shadows() {
    let wall = [([[2.5, -1.0, 1.6], [2.5, 9.0, 1.6], [2.5, -1.0, 9.0]], 0.0)];
    let mut scene = scene_of(&[&floor(4.0, 1.5, 0.5)[..], &wall[..]].concat());
    scene.lights = vec![Light::Point {
        position: Vec3::new(0.5, 0.5, 3.5),
        intensity: Vec3::splat(8.0),
    }];
    let radiance = inject(&scene, &UNIT_GRID, 256);
    assert!(radiance[&[3, 1, 1]].max_element() < 1e-12);
    let expected = |x: f64| {
        // ρ/π I cos θ / r², averaged over the voxel by a fine sum.
        let at = |index: u32| {
            DVec2::new(
                x + (f64::from(index % 64) + 0.5) / 64.0,
                (f64::from(index / 64) + 0.5) / 64.0,
            ) - 0.5
        };
        let term = |offset: DVec2| 2.0 / (offset.length_squared() + 4.0).powf(1.5);
        0.5 / PI * 8.0 * (0..4096).map(|index| term(at(index))).sum::<f64>() / 4096.0
    };
    assert!(
        (radiance[&[0, 0, 1]].x / expected(0.0) - 1.0).abs() < 5e-3,
        "{} {}",
        radiance[&[0, 0, 1]].x,
        expected(0.0)
    );
    assert!(
        (radiance[&[1, 0, 1]].x / expected(1.0) - 1.0).abs() < 5e-3,
        "{} {}",
        radiance[&[1, 0, 1]].x,
        expected(1.0)
    );
    let voxels = voxelize(&scene, &UNIT_GRID);
    let point = shade_voxel(&scene, &UNIT_GRID, [0, 0, 1], &voxels[&[0, 0, 1]], 0.25);
    assert!((point.x - 0.5 / PI * 8.0 / 4.0).abs() < 1e-3);
    assert_eq!(
        shade_voxel(&scene, &UNIT_GRID, [3, 0, 1], &voxels[&[3, 0, 1]], 0.25),
        DVec3::ZERO
    );
}

#[test]
fn spots_fall_off_in_angle() {
    let spot = Light::Spot {
        position: Vec3::ZERO,
        direction: Vec3::Z,
        intensity: Vec3::splat(2.0),
        inner_deg: 30.0,
        outer_deg: 60.0,
    };
    for (angle_deg, expected) in [(0.0, 0.5), (29.0, 0.5), (45.0, 0.25), (61.0, 0.0)] {
        let angle = f64::to_radians(angle_deg);
        let (_, distance_m, irradiance) =
            arriving_light(&spot, 2.0 * DVec3::new(angle.sin(), 0.0, angle.cos()));
        assert!(
            close(distance_m, 2.0) && close(irradiance.x, expected),
            "{angle_deg}: {irradiance}"
        );
    }
}
