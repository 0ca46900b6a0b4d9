//! Stages of the light propagation volume on the device against their CPU oracles.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::support::compare::{Largest, Worst, larger};
use crate::support::scenes::{bundled, scene_of, soup};
use crate::support::{Random, gpu, read_words};
use glam::{DVec2, DVec3, DVec4, UVec3, Vec3};
use lumivox::gi::lpv::faces::{Faces, Side};
use lumivox::gi::lpv::inject::flux_unit;
use lumivox::gi::lpv::lobes::{LobeSettings, Occlusion, Scheme};
use lumivox::gi::lpv::oracle::{self, Boundary, Texel};
use lumivox::gi::lpv::{CellGrid, CellSettings, Cells, Directions, Ordinates, Propagation, Source};
use lumivox::graph::{Frame, Gpu, Image, Owner};
use lumivox::render::oracle::View;
use lumivox::render::{GpuLightView, GpuScene, LightMaps, MapChannel, read_light_map};
use lumivox::scene::{Light, Scene};

use crate::support::voxels::half;

pub(crate) const SETTINGS: CellSettings = CellSettings {
    source: Source::Rsm,
    directions: 48,
    ordinates: Ordinates::Sweep,
    bounces: 1,
    least_change: 0.0,
    rsm_texels: 64,
    injection_shift: 0.5,
    occlusion: Occlusion::Faces,
    blocker_layers: 0,
    lobes: None,
    bands: 2,
    octree: None,
    keeps_directions: false,
};

/// A grid in general position: no wall of a bundled scene lies on a centre.
pub(crate) fn grid_of(scene: &GpuScene, cells: u32) -> CellGrid {
    let (low, high) = scene.lit_bounds();
    let size = (high - low).max_element();
    CellGrid::around(
        (
            low - size * Vec3::new(0.0213, 0.0137, 0.0171),
            high + size * Vec3::new(0.0119, 0.0271, 0.0193),
        ),
        cells,
        1,
    )
}

/// Everything of one frame.
pub(crate) struct Lit {
    pub(crate) scene: GpuScene,
    pub(crate) maps: LightMaps,
    pub(crate) cells: Cells,
    /// Words of faces.
    pub(crate) words: Vec<u32>,
    /// Flux vectors, of cells or leaves (W).
    pub(crate) flux: Vec<[DVec3; 3]>,
    pub(crate) light: Vec<[DVec4; 9]>,
}

pub(crate) fn light(gpu: &Gpu, scene: &Scene, cells: u32, settings: CellSettings) -> Lit {
    let scene_on = GpuScene::new(gpu, scene).unwrap();
    let grid = grid_of(&scene_on, cells);
    light_in(gpu, scene, scene_on, grid, settings)
}

pub(crate) fn light_in(
    gpu: &Gpu,
    scene: &Scene,
    scene_on: GpuScene,
    grid: CellGrid,
    settings: CellSettings,
) -> Lit {
    scene_on
        .set_frame(gpu, &scene_on.frame_constants(&scene.camera, [8, 8]))
        .unwrap();
    let needs_rsm = settings.source == Source::Rsm || settings.occlusion == Occlusion::Fuzzy;
    let maps = LightMaps::new(gpu, &scene_on, 64, needs_rsm).unwrap();
    let mut cells = Cells::new(gpu, &scene_on, grid, settings).unwrap();
    cells.find_faces(gpu, &scene_on).unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&scene_on.set, &scene_on.materials);
    maps.draw(&mut frame, &scene_on);
    cells.light(&mut frame, &scene_on, &maps, &[]);
    gpu.submit(frame).unwrap();
    let words = read_words(gpu, &cells.faces.words);
    let unit = f64::from(flux_unit(&scene_on.lights, &grid));
    let steps = read_words(gpu, &cells.flux);
    let count = match &*cells.propagation {
        Propagation::Leaves(sweep) => sweep.leaves.all.len(),
        _ => grid.count() as usize,
    };
    let flux = |cell: usize| {
        [0, 1, 2].map(|colour| {
            DVec3::from([0, 1, 2].map(|axis| {
                unit * f64::from(steps[(3 * colour + axis) * count + cell].cast_signed())
            }))
        })
    };
    let flux = (0..count).map(flux).collect();
    let light = read_light(gpu, &cells);
    Lit {
        scene: scene_on,
        maps,
        cells,
        words,
        flux,
        light,
    }
}

/// The coefficients of all cells.
pub(crate) fn read_light(gpu: &Gpu, cells: &Cells) -> Vec<[DVec4; 9]> {
    let size = cells.grid.size;
    let read = |image: &Arc<Image>| -> Vec<[u16; 4]> {
        bytemuck::pod_collect_to_vec(&gpu.read_image(image, 0, 0).unwrap())
    };
    let (low, band2) = (read(&cells.light.low), cells.light.band2.as_ref().map(read));
    let at = |cell: UVec3, coefficient: u32| {
        let block = match coefficient.checked_sub(4) {
            None => UVec3::new(coefficient % 2, coefficient / 2, cells.grid.slab),
            Some(beyond) => UVec3::new(beyond, 0, cells.grid.slab),
        };
        let place = cell + block * size;
        let (texels, blocks) = match &band2 {
            _ if coefficient < 4 => (&low, [2, 2]),
            Some(band2) => (band2, [5, 1]),
            None => return DVec4::ZERO,
        };
        let row = place.y + blocks[1] * size.y * place.z;
        let texel = texels[(place.x + blocks[0] * size.x * row) as usize];
        let scale = f64::from(cells.scale);
        DVec4::from(texel.map(half)) * DVec4::new(scale, scale, scale, 1.0)
    };
    (0..cells.grid.count())
        .map(|index| {
            let cell = UVec3::new(
                index % size.x,
                index / size.x % size.y,
                index / (size.x * size.y),
            );
            std::array::from_fn(|coefficient| at(cell, coefficient as u32))
        })
        .collect()
}

/// The bits of opaque faces against the oracle's; faces that rounding decides may be either.
fn check_faces(words: &[u32], scene: &Scene, grid: &CellGrid) -> [u32; 2] {
    let expected = oracle::crossings(scene, grid);
    let (mut opaque, mut unsure) = (0, 0);
    for (cell, word) in words.iter().enumerate() {
        let (sure, maybe) = (expected.opaque[cell], expected.unsure[cell]);
        let wrong = ((word & 63) ^ sure) & !maybe;
        assert_eq!(
            wrong, 0,
            "cell {cell}: {word:06b} for {sure:06b}, unsure {maybe:06b}"
        );
        opaque += sure.count_ones();
        unsure += (maybe & !sure).count_ones();
    }
    [opaque, unsure]
}

#[test]
fn opaque_faces_are_the_segments_that_triangles_meet() {
    let gpu = gpu();
    for name in ["cornell", "two-rooms", "glossy"] {
        let scene = bundled(name);
        for cells in [9, 32] {
            let lit = light(&gpu, &scene, cells, SETTINGS);
            let [opaque, unsure] = check_faces(&lit.words, &scene, &lit.cells.grid);
            println!("{name}, {cells} cells: {opaque} opaque, {unsure} unsure");
            assert!(opaque > cells * cells, "{name}");
        }
    }
    let mut random = Random::new(2026);
    for _ in 0..6 {
        let scene = scene_of(&soup(&mut random, 16), 0.0, &mut random);
        let scene_on = GpuScene::new(&gpu, &scene).unwrap();
        let grid = CellGrid::new(Vec3::new(-0.3, 0.2, 0.7), 1.07, UVec3::new(17, 12, 15));
        let mut faces = Faces::new(&gpu, grid, false).unwrap();
        faces.find(&gpu, &scene_on).unwrap();
        check_faces(&read_words(&gpu, &faces.words), &scene, &grid);
    }
}

/// Whatever is around a closed box, none of it comes in.
#[test]
fn no_light_comes_into_a_closed_box() {
    for ordinates in [Ordinates::Sweep, Ordinates::Slices] {
        check_closed_box(CellSettings {
            ordinates,
            ..SETTINGS
        });
    }
}

fn check_closed_box(settings: CellSettings) {
    let gpu = gpu();
    let mut random = Random::new(7);
    let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles: Vec<_> = quads
        .iter()
        .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]].map(|t| t.map(|i| corner(*i))))
        .collect();
    let mut scene = scene_of(&triangles, 0.0, &mut random);
    scene.environment = Vec3::ONE.into();
    scene.lights = vec![Light::Point {
        position: Vec3::new(1.3, 1.4, -0.2),
        intensity: Vec3::splat(40.0),
    }];
    for turn in 0..4 {
        let rotation = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.7, 1.1 * turn as f32);
        let mut turned = scene.clone();
        for vertex in &mut turned.vertices {
            let centred = Vec3::from(vertex.position) - 0.5;
            vertex.position = (rotation * centred).to_array();
        }
        let scene_on = GpuScene::new(&gpu, &turned).unwrap();
        let grid = CellGrid::around((Vec3::splat(-1.6), Vec3::splat(1.6)), 21, 1);
        let lit = light_in(&gpu, &turned, scene_on, grid, settings);
        let mut inside = 0;
        for (index, coefficients) in lit.light.iter().enumerate() {
            let index = index as u32;
            let cell = UVec3::new(index % 21, index / 21 % 21, index / 441).as_vec3();
            let centre = grid.origin + grid.cell_size * (cell + 0.5);
            if (rotation.inverse() * centre).abs().largest() < 0.5 - 1e-3 {
                assert_eq!(
                    *coefficients,
                    [DVec4::ZERO; 9],
                    "cell {cell} of turn {turn}"
                );
                inside += 1;
            }
        }
        assert!(inside > 150, "{inside} cells are inside");
    }
}

/// What the maps reflect, texel square by texel square, with exact solid angles.
pub(crate) fn texels_of(gpu: &Gpu, lit: &Lit) -> Vec<Texel> {
    let views: Vec<GpuLightView> =
        bytemuck::pod_collect_to_vec(&gpu.read_buffer(&lit.maps.views).unwrap());
    let mut all = Vec::new();
    for (index, gpu_view) in (0..lit.maps.view_count).zip(&views) {
        let read = |channel| {
            read_light_map(gpu, &lit.maps, channel, index)
                .unwrap()
                .unwrap()
        };
        let (depth, normal, reflected) = (
            read(MapChannel::Depth),
            read(MapChannel::Normal),
            read(MapChannel::Reflected),
        );
        let view = View::of_light(gpu_view);
        let power = match lit.scene.lights[gpu_view.light[0] as usize] {
            Light::Directional { irradiance, .. } => irradiance,
            Light::Point { intensity, .. } | Light::Spot { intensity, .. } => intensity,
        }
        .as_dvec3();
        for at in 0..depth.pixels.len() {
            let stored = f64::from(depth.pixels[at].x);
            if stored == 0.0 {
                continue;
            }
            let corner = DVec2::new(
                (at as u32 % depth.width).into(),
                (at as u32 / depth.width).into(),
            );
            let (start, ray) = view.ray(corner + 0.5);
            let along = if view.is_parallel {
                (1.0 - stored) * f64::from(gpu_view.right[3])
            } else {
                view.near_m / stored
            };
            let extent = if view.is_parallel {
                let pixels = f64::from(view.size[0]) * f64::from(view.size[1]);
                4.0 * view.right.length() * view.down.length() / pixels
            } else {
                let ends = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
                    .map(|(x, y)| view.ray(corner + DVec2::new(x, y)).1.normalize());
                solid_angle([ends[0], ends[1], ends[2]]) + solid_angle([ends[0], ends[2], ends[3]])
            };
            let normal = normal.pixels[at].as_dvec3();
            all.push(Texel {
                position: start + along * ray,
                normal: if normal.dot(ray) > 0.0 {
                    -normal
                } else {
                    normal
                },
                area_m2: extent
                    * if view.is_parallel {
                        1.0
                    } else {
                        (along * ray).length_squared()
                    }
                    / normal.dot(ray.normalize()).abs(),
                flux: extent * power * reflected.pixels[at].as_dvec3(),
            });
        }
    }
    all
}

/// Of a spherical triangle (van Oosterom & Strackee 1983).
fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let volume = a.dot(b.cross(c)).abs();
    2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

pub(crate) fn lights() -> Vec<(&'static str, Scene)> {
    let scene = bundled("cornell");
    let with = |light: Light| Scene {
        lights: vec![light],
        ..scene.clone()
    };
    vec![
        (
            "point",
            with(Light::Point {
                position: Vec3::new(0.1, 1.5, 0.2),
                intensity: Vec3::new(3.0, 2.0, 1.0),
            }),
        ),
        (
            "spot",
            with(Light::Spot {
                position: Vec3::new(0.3, 1.6, 0.4),
                direction: Vec3::new(-0.3, -0.8, -0.4).normalize(),
                intensity: Vec3::new(30.0, 20.0, 10.0),
                inner_deg: 20.0,
                outer_deg: 35.0,
            }),
        ),
        (
            "directional",
            with(Light::Directional {
                direction: Vec3::new(0.2, -0.3, -1.0).normalize(),
                irradiance: Vec3::new(1.0, 2.0, 3.0),
            }),
        ),
    ]
}

/// Sums of integers against sums in double precision. A texel on the border between two cells may
/// be in either, so that cells are compared with a texel's flux to spare; sums over all are not.
#[test]
fn injected_flux_is_the_oracles() {
    let gpu = gpu();
    for (name, scene) in lights() {
        let lit = light(&gpu, &scene, 24, SETTINGS);
        let texels = texels_of(&gpu, &lit);
        let most = texels.iter().map(|texel| texel.flux.largest()).worst();
        let expected = oracle::inject(texels.iter().copied(), &lit.cells.grid, 0.5);
        let (mut sums, mut different) = ([[DVec3::ZERO; 3]; 2], 0);
        for (got, expected) in lit.flux.iter().zip(&expected) {
            for colour in 0..3 {
                sums[0][colour] += got[colour];
                sums[1][colour] += expected[colour];
                let error = (got[colour] - expected[colour]).abs().largest();
                let scale = expected[colour].length();
                different += u32::from(error > 2e-3 * scale + 1e-4 * most);
                assert!(
                    error <= 2e-3 * scale + 3.0 * most,
                    "{name}: {got:?} for {expected:?}"
                );
            }
        }
        let total: DVec3 = texels.iter().map(|texel| texel.flux).sum();
        let error = (0..3)
            .map(|colour| (sums[0][colour] - sums[1][colour]).length() / total[colour])
            .worst();
        println!("{name}: sums differ by {error:.1e} of the flux, {different} colours of cells");
        assert!(
            error < 1e-3 && different < 120,
            "{name}: {error}, {different}"
        );
        assert!(total.min_element() > 0.1);
    }
}

/// A point light's maps cover the sphere: in a closed white room all its power is injected.
#[test]
fn all_power_of_a_point_light_is_injected() {
    let gpu = gpu();
    let mut scene = lights().remove(0).1;
    for material in &mut scene.materials {
        (material.albedo, material.emission) = (Vec3::ONE, Vec3::ZERO);
    }
    for rsm_texels in [16, 24, 64] {
        let settings = CellSettings {
            rsm_texels,
            ..SETTINGS
        };
        let lit = light(&gpu, &scene, 16, settings);
        let texels = texels_of(&gpu, &lit);
        let total: DVec3 = texels.iter().map(|texel| texel.flux).sum();
        // Vectors of opposite walls cancel each other in no cell, but for corners.
        let injected: f64 = lit.flux.iter().map(|cell| cell[0].length()).sum();
        println!("{rsm_texels} texels: {injected:.4} of {:.4} W", total.x);
        assert!(
            (injected / total.x - 1.0).abs() < 0.05,
            "{injected} of {total}"
        );
        let angle = total.x / 3.0;
        assert!(angle <= 4.0 * PI * 1.0001, "{angle} sr");
    }
}

/// The same flux and faces in double precision, as the cells' directions are followed.
fn swept_by_oracle(lit: &Lit, sides: &[DVec4]) -> oracle::Swept {
    let grid = &lit.cells.grid;
    let face_m2 = f64::from(grid.cell_size).powi(2);
    let boundary = Boundary {
        faces: &lit.words,
        side: &|cell, face| {
            let word = lit.words[cell];
            let before = (word & ((1 << face) - 1)).count_ones();
            sides
                .get(((word >> 8) + before) as usize)
                .copied()
                .unwrap_or_default()
        },
        inflow: &|_, _, _| DVec4::W,
        source: &|cell, direction| {
            let [r, g, b] = lit.flux[cell].map(|vector| vector.dot(direction).max(0.0));
            DVec3::new(r, g, b).extend(0.0) / (PI * face_m2)
        },
    };
    let directions = Directions::spiral(lit.cells.settings.directions);
    match lit.cells.settings.ordinates {
        Ordinates::Sweep => oracle::sweep(grid, &directions, &boundary),
        Ordinates::Slices => oracle::slices(grid, &directions, &boundary),
        Ordinates::Jacobi(steps) => oracle::jacobi(grid, &directions, &boundary, steps),
    }
}

/// The light of all cells against the oracle's. Half floats on the way and in the result cost the
/// rest.
fn check_sweep(name: &str, lit: &Lit, sides: &[DVec4]) {
    let swept = swept_by_oracle(lit, sides);
    let largest = |channel: usize| {
        let all = swept.light.iter().map(|cell| cell[0][channel].abs());
        all.worst().max(1e-9)
    };
    let scale = DVec4::from([0, 1, 2, 3].map(largest));
    let mut worst = 0f64;
    for (got, expected) in lit.light.iter().zip(&swept.light) {
        for (got, expected) in got.iter().zip(expected) {
            for channel in 0..4 {
                // A half float is good to 2⁻¹¹ of itself; sums of eight octants to more.
                let error = (got[channel] - expected[channel]).abs();
                let relative = error / (scale[channel] + 20.0 * expected[channel].abs());
                worst = larger(worst, relative);
            }
        }
    }
    println!("{name}: sweep differs by {:.1e} of the largest", worst);
    assert!(worst < 1e-3, "{name}");
    // Between steps that have not come to an end, light is on its way.
    if !matches!(lit.cells.settings.ordinates, Ordinates::Jacobi(_)) {
        let lost = (swept.ledger.lost() / (swept.ledger.injected + swept.ledger.entered)).w;
        assert!(lost.abs() < 1e-9, "{name}: {:?}", swept.ledger);
    }
}

#[test]
fn swept_light_is_the_oracles() {
    let gpu = gpu();
    for (name, scene) in lights() {
        for (cells, directions) in [(8, 8), (13, 33), (20, 60)] {
            let settings = CellSettings {
                directions,
                ..SETTINGS
            };
            let lit = light(&gpu, &scene, cells, settings);
            let side_light = read_sides(&gpu, &lit);
            check_sweep(&format!("{name}, {cells} cells"), &lit, &side_light);
        }
    }
    // Long and flat grids, and one of a single cell between margins.
    let scene = &lights()[0].1;
    for size in [[3, 19, 7], [40, 3, 3], [3, 3, 3], [5, 9, 64]] {
        let scene_on = GpuScene::new(&gpu, scene).unwrap();
        let grid = CellGrid::new(Vec3::new(-1.1, -0.05, -1.1), 0.13, UVec3::from(size));
        let lit = light_in(&gpu, scene, scene_on, grid, SETTINGS);
        let side_light = read_sides(&gpu, &lit);
        check_sweep(&format!("{size:?}"), &lit, &side_light);
    }
}

/// Grids in general position and thin ones, and batches of one pair of directions and of several.
fn check_in_grids(of: impl Fn(u32) -> CellSettings) {
    let gpu = gpu();
    for (name, scene) in lights() {
        for (cells, directions) in [(8, 8), (13, 33), (20, 60)] {
            let settings = CellSettings {
                directions,
                ..of(cells)
            };
            let lit = light(&gpu, &scene, cells, settings);
            check_sweep(&format!("{name}, {cells} cells"), &lit, &[]);
        }
        let settings = CellSettings {
            source: Source::Faces,
            ..of(17)
        };
        let lit = light(&gpu, &scene, 17, settings);
        let side_light = read_sides(&gpu, &lit);
        assert!(side_light.iter().any(|side| side.x > 0.0), "{name}");
        check_sweep(&format!("{name}, faces"), &lit, &side_light);
    }
    let scene = &lights()[0].1;
    for size in [[3, 19, 7], [40, 3, 3], [3, 3, 3], [5, 9, 64]] {
        let scene_on = GpuScene::new(&gpu, scene).unwrap();
        let grid = CellGrid::new(Vec3::new(-1.1, -0.05, -1.1), 0.13, UVec3::from(size));
        let lit = light_in(&gpu, scene, scene_on, grid, of(7));
        check_sweep(&format!("{size:?}"), &lit, &[]);
    }
    // Faces of triangles that lie about, and light that starts at all of them.
    let mut random = Random::new(20);
    for _ in 0..6 {
        let mut scene = scene_of(&soup(&mut random, 24), 0.0, &mut random);
        for material in &mut scene.materials {
            material.emission = Vec3::new(1.0, 2.0, 3.0);
        }
        let scene_on = GpuScene::new(&gpu, &scene).unwrap();
        let grid = CellGrid::new(Vec3::new(-0.3, 0.2, 0.7), 1.07, UVec3::new(13, 9, 11));
        let lit = light_in(&gpu, &scene, scene_on, grid, of(9));
        let side_light = read_sides(&gpu, &lit);
        assert!(side_light.iter().any(|side| side.x > 0.0));
        check_sweep("triangles", &lit, &side_light);
    }
}

#[test]
fn stepped_light_is_the_oracles() {
    for steps in [1, 7, 60] {
        check_in_grids(|_| CellSettings {
            ordinates: Ordinates::Jacobi(steps),
            ..SETTINGS
        });
    }
}

#[test]
fn marched_light_is_the_oracles() {
    check_in_grids(|cells| CellSettings {
        directions: 6 * cells,
        ordinates: Ordinates::Slices,
        ..SETTINGS
    });
}

/// As many steps as a path has cells are the sweep, to rounding.
#[test]
fn steps_of_all_cells_at_once_are_the_sweep() {
    let gpu = gpu();
    for (name, scene) in lights() {
        for (source, bounces) in [(Source::Rsm, 1), (Source::Faces, 2)] {
            let by = |ordinates| CellSettings {
                source,
                bounces,
                ordinates,
                ..SETTINGS
            };
            let [swept, stepped] = [Ordinates::Sweep, Ordinates::Jacobi(3 * 14 - 2)]
                .map(|ordinates| light(&gpu, &scene, 14, by(ordinates)).light);
            let all = || swept.iter().flatten().zip(stepped.iter().flatten());
            let largest = all().map(|(a, _)| a.abs().largest()).worst();
            let worst = all().map(|(a, b)| (*a - *b).abs().largest()).worst() / largest;
            println!("{name}, {bounces} bounces: differs by {worst:.1e} of the largest");
            assert!(worst < 2e-3, "{name}: {worst}");
        }
    }
}

pub(crate) fn read_sides(gpu: &Gpu, lit: &Lit) -> Vec<DVec4> {
    let Some(sides) = &lit.cells.faces.sides else {
        return Vec::new();
    };
    let texels: Vec<[f32; 4]> =
        bytemuck::pod_collect_to_vec(&gpu.read_buffer(&sides.light).unwrap());
    texels
        .iter()
        .take(sides.count as usize)
        .map(|texel| f64::from(lit.cells.scale) * DVec4::from(texel.map(f64::from)))
        .collect()
}

#[test]
fn light_of_faces_is_swept_as_the_oracle_does() {
    let gpu = gpu();
    let settings = CellSettings {
        source: Source::Faces,
        ..SETTINGS
    };
    for (name, scene) in lights() {
        let lit = light(&gpu, &scene, 17, settings);
        let side_light = read_sides(&gpu, &lit);
        assert!(side_light.iter().any(|side| side.x > 0.0), "{name}");
        check_sweep(name, &lit, &side_light);
    }
}

/// What a segment from one end to the other meets first, and how far along it is (0 to 1).
fn first_hit(scene: &Scene, from: DVec3, to: DVec3) -> Option<(usize, f64)> {
    let along = to - from;
    let mut first: Option<(usize, f64)> = None;
    for (index, triangle) in scene.triangles.iter().enumerate() {
        let [a, b, c] = triangle
            .vertices
            .map(|vertex| DVec3::from(scene.vertices[vertex as usize].position.map(f64::from)));
        let (u, v) = (b - a, c - a);
        let p = along.cross(v);
        let det = u.dot(p);
        if det.abs() < 1e-12 {
            continue;
        }
        let offset = from - a;
        let x = offset.dot(p) / det;
        let q = offset.cross(u);
        let (y, t) = (along.dot(q) / det, v.dot(q) / det);
        let is_hit = x >= 0.0 && y >= 0.0 && x + y <= 1.0 && (0.0..1.0).contains(&t);
        if is_hit && first.is_none_or(|(_, before)| t < before) {
            first = Some((index, t));
        }
    }
    first
}

/// Each side is the surface that a ray from the cell to its neighbour meets first.
#[test]
fn sides_are_what_cells_see_of_opaque_faces() {
    let gpu = gpu();
    let settings = CellSettings {
        source: Source::Faces,
        ..SETTINGS
    };
    let mut scene = bundled("two-rooms");
    for (index, material) in scene.materials.iter_mut().enumerate() {
        material.emission = Vec3::new(1.0, 2.0, 3.0) * index as f32;
    }
    let lit = light(&gpu, &scene, 30, settings);
    let list = lit.cells.faces.sides.as_ref().unwrap();
    let sides: Vec<Side> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&list.list).unwrap());
    let (grid, mut seen, mut unlike) = (&lit.cells.grid, 0, 0);
    let mut taken = vec![false; list.count as usize];
    for (index, word) in lit.words.iter().enumerate() {
        for face in (0..6).filter(|face| word >> face & 1 == 1) {
            let place = (word >> 8) + (word & ((1 << face) - 1)).count_ones();
            let side = &sides[place as usize];
            assert!(
                !std::mem::replace(&mut taken[place as usize], true),
                "place {place} twice"
            );
            assert_eq!(side.place[3].to_bits() as usize, index);
            let at = index as u32;
            let cell = UVec3::new(
                at % grid.size.x,
                at / grid.size.x % grid.size.y,
                at / (grid.size.x * grid.size.y),
            );
            let from = (grid.origin + grid.cell_size * (cell.as_vec3() + 0.5)).as_dvec3();
            let mut to = from;
            let axis = (face / 2) as usize;
            to[axis] += f64::from(grid.cell_size) * if face % 2 == 0 { -1.0 } else { 1.0 };
            let Some((triangle, share)) = first_hit(&scene, from, to) else {
                unlike += 1;
                continue;
            };
            seen += 1;
            let expected = from + share * (to - from);
            let got = DVec3::from([0, 1, 2].map(|i| f64::from(side.place[i])));
            let material = &scene.materials[scene.triangles[triangle].material as usize];
            let [a, b, c] = scene.triangles[triangle]
                .vertices
                .map(|vertex| Vec3::from(scene.vertices[vertex as usize].position));
            let normal = (b - a).cross(c - a).normalize();
            let is_front = f64::from(normal[axis]) * (from[axis] - to[axis]) > 0.0;
            let emission = if is_front {
                material.emission
            } else {
                Vec3::ZERO
            };
            let is_alike = (got - expected).length() < 1e-3 * f64::from(grid.cell_size)
                && Vec3::from_slice(&side.albedo).abs_diff_eq(material.albedo, 1e-4)
                && Vec3::from_slice(&side.emission).abs_diff_eq(emission, 1e-4)
                && Vec3::from_slice(&side.normal)
                    .abs_diff_eq(if is_front { normal } else { -normal }, 1e-4);
            unlike += u32::from(!is_alike);
        }
    }
    println!("{seen} sides, {unlike} unlike");
    assert!(taken.iter().all(|taken| *taken), "places are left out");
    // Where two surfaces are a thousandth of a segment apart, either may be taken.
    assert!(seen > 3000 && unlike * 200 < seen, "{unlike} of {seen}");
}

/// What one grid of 128 cells a side has is at most what every device lets a buffer have, of the
/// presets and of streams in two bands.
#[test]
fn nothing_of_128_cells_a_side_is_larger_than_128_mib() {
    let lobes = |scheme| CellSettings {
        lobes: Some(LobeSettings {
            scheme,
            iterations: 8,
            gain: 1.0,
            clamp_negative: true,
        }),
        ..SETTINGS
    };
    let accurate = CellSettings {
        directions: 384,
        ..SETTINGS
    };
    let best = CellSettings {
        keeps_directions: true,
        ..accurate
    };
    let textbook = CellSettings {
        occlusion: Occlusion::Fuzzy,
        ..lobes(Scheme::Lobes30)
    };
    for (name, settings, most_store) in [
        ("accurate", accurate, 310e6),
        ("best", best, 430e6),
        ("textbook", textbook, 500e6),
        ("stream", lobes(Scheme::Stream), 450e6),
    ] {
        let gpu = gpu();
        let scene = GpuScene::new(&gpu, &bundled("cornell")).unwrap();
        let grid = CellGrid::new(Vec3::ZERO, 1.0, UVec3::splat(128));
        let _cells = Cells::new(&gpu, &scene, grid, settings).unwrap();
        for (resource, bytes) in gpu.memory() {
            assert!(bytes <= 128 << 20, "{name}: {resource} has {bytes} bytes");
        }
        let store = gpu.bytes_of(Owner::Store);
        assert!(store as f64 <= most_store, "{name}: {store} bytes");
    }
}
