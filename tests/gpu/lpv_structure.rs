//! Views of cells by their level against the levels that the oracles and layouts name.

use glam::{DVec3, UVec3, Vec3};
use lumivox::gi::lpv::levels::{Transfer, grids};
use lumivox::gi::lpv::lobes::{LobeSettings, Occlusion, Scheme};
use lumivox::gi::lpv::oracle::lobes::{Lobe, Steps};
use lumivox::gi::lpv::oracle::octree as oracle;
use lumivox::gi::lpv::structure::Structure;
use lumivox::gi::lpv::{
    CellGrid, CellSettings, Cells, Octree, Propagation, cascaded, leaves::LeafSettings,
};
use lumivox::graph::{Frame, Gpu};
use lumivox::render::{Follows, GBuffer, GpuScene, screen_image};
use lumivox::scene::Scene;

use crate::lpv::{SETTINGS, light};
use crate::lpv_lobes::first_of;
use crate::support::gather::{octahedral, pixel_rays};
use crate::support::gpu;
use crate::support::scenes::bundled;

const SIZE: [u32; 2] = [64, 48];
const SHIFT: f32 = 0.5;

/// What a pixel sees: alpha of the view; the ray; where the ray ends (m, from the eye), with the
/// normal there.
struct Seen {
    alpha: f64,
    ray: DVec3,
    surface: Option<(f64, DVec3)>,
}

/// The view of some grids, and what each pixel sees.
fn look(gpu: &Gpu, scene: &Scene, on_gpu: &GpuScene, structure: &Structure<'_>) -> Vec<Seen> {
    let constants = on_gpu.frame_constants(&scene.camera, SIZE);
    on_gpu.set_frame(gpu, &constants).unwrap();
    let gbuffer = GBuffer::new(gpu, on_gpu, SIZE, Follows::Nothing).unwrap();
    let image = screen_image(gpu, "test.seen", SIZE).unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&on_gpu.set, &on_gpu.materials);
    gbuffer.draw(&mut frame, on_gpu);
    structure.draw(&mut frame, &gbuffer, &image);
    gpu.submit(frame).unwrap();
    let texels: Vec<[f32; 4]> =
        bytemuck::pod_collect_to_vec(&gpu.read_image(&image, 0, 0).unwrap());
    let depth: Vec<f32> =
        bytemuck::pod_collect_to_vec(&gpu.read_image(&gbuffer.view_depth, 0, 0).unwrap());
    let normals: Vec<[u32; 2]> =
        bytemuck::pod_collect_to_vec(&gpu.read_image(&gbuffer.normals, 0, 0).unwrap());
    let [x, y, z, _] = constants.ray_forward;
    let forward = Vec3::new(x, y, z).as_dvec3();
    let seen = |(at, ray): (usize, DVec3)| Seen {
        alpha: f64::from(texels[at][3]),
        ray,
        surface: (depth[at] > 0.0).then(|| {
            let distance = f64::from(depth[at]) / ray.dot(forward);
            (distance, octahedral(normals[at][0]))
        }),
    };
    pixel_rays(&constants, SIZE).enumerate().map(seen).collect()
}

/// Where a surface's light is looked up, and where the surface is (cells of a grid).
fn looked_up(grid: &CellGrid, eye: Vec3, seen: &Seen) -> Option<DVec3> {
    let (distance, normal) = seen.surface?;
    let place = eye.as_dvec3() + distance * seen.ray;
    let cells = (place - grid.corner().as_dvec3()) / f64::from(grid.cell_size);
    Some(cells + f64::from(SHIFT) * normal.abs().element_sum() * normal)
}

fn cell_around(grid: &CellGrid, place: DVec3) -> UVec3 {
    let last = (grid.size - 1).as_dvec3();
    place.floor().clamp(DVec3::ZERO, last).as_uvec3()
}

/// Pixels whose alpha is not what is expected; rounding decides about some at borders of cells.
fn check(name: &str, pixels: &[Seen], expected: impl Fn(&Seen) -> f64) -> Vec<f64> {
    let expected: Vec<f64> = pixels.iter().map(expected).collect();
    let wrong = pixels
        .iter()
        .zip(&expected)
        .filter(|(seen, expected)| (seen.alpha - **expected).abs() > 0.02)
        .count();
    println!("{name}: {wrong} of {} pixels differ", pixels.len());
    assert!(wrong * 50 < pixels.len(), "{name}: {wrong}");
    expected
}

fn has(expected: &[f64], level: f64, count: usize) -> bool {
    expected.iter().filter(|found| **found == level).count() >= count
}

#[test]
fn seen_leaves_are_those_of_the_division() {
    let gpu = &gpu();
    let scene = bundled("cornell");
    let settings = CellSettings {
        octree: Some(Octree::Leaves(LeafSettings {
            guard: 1,
            max_level: 2,
        })),
        ..SETTINGS
    };
    let lit = light(gpu, &scene, 48, settings);
    let Propagation::Leaves(sweep) = &*lit.cells.propagation else {
        panic!("no leaves");
    };
    let grid = lit.cells.grid;
    let level_of = |cell: UVec3| {
        let leaf = sweep.leaves.of_cell[grid.index(cell)];
        sweep.leaves.all[leaf as usize].level
    };
    let eye = scene.camera.eye;
    let origin = (eye - grid.corner()).as_dvec3() / f64::from(grid.cell_size);
    for from in [0, 1] {
        let structure = Structure {
            grids: std::slice::from_ref(&lit.cells),
            shift: SHIFT,
            blend: 0.0,
            from,
        };
        let pixels = look(gpu, &scene, &lit.scene, &structure);
        // The camera looks along −z.
        let cut = 0.5 * origin.z.clamp(0.0, f64::from(grid.size.z));
        let expected = check(&format!("leaves from {from}"), &pixels, |seen| {
            let t = (cut - origin.z) / seen.ray.z;
            let place = origin + t * seen.ray;
            let end = seen.surface.map_or(f64::MAX, |(distance, _)| {
                distance / f64::from(grid.cell_size)
            });
            let is_inside =
                place.cmpge(DVec3::ZERO).all() && place.cmplt(grid.size.as_dvec3()).all();
            let cut = Some(place).filter(|_| t > 0.0 && t < end && is_inside);
            let cut = cut.map(|place| level_of(place.as_uvec3()));
            let surface = looked_up(&grid, eye, seen).map(|at| level_of(cell_around(&grid, at)));
            let level = cut.filter(|level| *level >= from).or(surface);
            level.map_or(0.0, |level| f64::from(level + 1))
        });
        assert!(
            [1.0, 2.0, 3.0]
                .iter()
                .all(|level| has(&expected, *level, 50))
        );
    }
}

#[test]
fn seen_levels_are_those_of_the_index_volume() {
    let gpu = &gpu();
    let scene = bundled("cornell");
    let steps = LobeSettings {
        scheme: Scheme::Lobes30,
        iterations: 3,
        gain: 0.75,
        clamp_negative: true,
    };
    for transfer in [Transfer::Mean, Transfer::Residual] {
        let settings = CellSettings {
            occlusion: Occlusion::None,
            lobes: Some(steps),
            octree: Some(Octree::Levels(transfer)),
            ..SETTINGS
        };
        let lit = light(gpu, &scene, 32, settings);
        let grid = lit.cells.grid;
        let all = grids(grid);
        let step = Steps {
            settings: steps,
            occlusion: Occlusion::None,
            faces: &[],
            blockers: &[],
        };
        let steps: Vec<Steps<'_>> = all.iter().map(|_| step).collect();
        let first = first_of(gpu, &lit);
        let fields = match transfer {
            Transfer::Mean => oracle::published(&all, &steps, &first),
            Transfer::Residual => oracle::repaired(&all, &steps, &first).fields,
        };
        let index = oracle::index_volume(&all, &fields);
        let amount = |lobe: &Lobe| -> f64 {
            let terms = lobe.iter().map(|c| c.truncate().abs().element_sum());
            terms.sum()
        };
        let level_of = |cell: UVec3| -> u32 {
            if transfer == Transfer::Mean {
                return index[grid.index(cell)];
            }
            let levels = (0u32..).zip(all.iter().zip(&fields));
            let amounts = levels
                .map(|(level, (grid, field))| (level, amount(&field[grid.index(cell >> level)])));
            let most = amounts.max_by(|a, b| a.1.total_cmp(&b.1));
            most.map_or(0, |(level, _)| level)
        };
        let structure = Structure {
            grids: std::slice::from_ref(&lit.cells),
            shift: SHIFT,
            blend: 0.0,
            from: 0,
        };
        let pixels = look(gpu, &scene, &lit.scene, &structure);
        let is_mean = transfer == Transfer::Mean;
        let name = if is_mean { "mean" } else { "residual" };
        let expected = check(name, &pixels, |seen| {
            let place = looked_up(&grid, scene.camera.eye, seen);
            place.map_or(0.0, |at| f64::from(level_of(cell_around(&grid, at)) + 1))
        });
        assert!(
            has(&expected, 1.0, 500) && has(&expected, 2.0, 10),
            "{name}"
        );
    }
}

#[test]
fn seen_grids_are_those_that_count() {
    let gpu = &gpu();
    let scene = bundled("cornell");
    let on_gpu = GpuScene::new(gpu, &scene).unwrap();
    let layout = cascaded::Layout::new(on_gpu.lit_bounds(), 16, 3, 0.06);
    // Around the boxes.
    let places = layout.grids(Vec3::new(0.3, 0.4, 0.3));
    assert_eq!(places.len(), 3);
    let cells = Cells::nested(gpu, &on_gpu, &places, SETTINGS).unwrap();
    for blend in [0.0, 2.0] {
        let structure = Structure {
            grids: &cells,
            shift: SHIFT,
            blend,
            from: 0,
        };
        let pixels = look(gpu, &scene, &on_gpu, &structure);
        let expected = check(&format!("blend {blend}"), &pixels, |seen| {
            let (mut left, mut sum) = (1.0, 0.0);
            for (level, grid) in places.iter().rev().enumerate() {
                let Some(place) = looked_up(grid, scene.camera.eye, seen) else {
                    return 0.0;
                };
                let middle = 0.5 * grid.size.as_dvec3();
                let reach = (middle - 0.5 - (place - middle).abs()).min_element();
                let share = match (level, blend > 0.0) {
                    (2, _) => 1.0,
                    (_, true) => (reach / f64::from(blend)).clamp(0.0, 1.0),
                    (_, false) => f64::from(reach >= 0.0),
                };
                sum += left * share * (level + 1) as f64;
                left *= 1.0 - share;
            }
            sum
        });
        assert!(
            has(&expected, 1.0, 20) && has(&expected, 2.0, 20),
            "{blend}"
        );
    }
}
