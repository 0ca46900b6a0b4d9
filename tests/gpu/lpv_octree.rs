//! The sweep over leaves on the device against its CPU oracle.

use std::sync::Arc;

use std::f64::consts::PI;

use glam::{DVec3, DVec4, UVec3, Vec3};
use lumivox::gi::lpv::leaves::LeafSettings;
use lumivox::gi::lpv::oracle::{self, Boundary};
use lumivox::gi::lpv::{CellGrid, CellSettings, Cells, Octree, Propagation, Source};
use lumivox::graph::{Frame, Gpu};
use lumivox::render::{GpuScene, LightMaps};
use lumivox::scene::Light;

use crate::lpv::{Lit, SETTINGS, light, light_in, lights, read_sides};
use crate::support::compare::{Largest, Worst, larger};
use crate::support::scenes::{bundled, scene_of, soup};
use crate::support::{Random, gpu, read_words};

fn settings(guard: u32, max_level: u32) -> CellSettings {
    CellSettings {
        octree: Some(Octree::Leaves(LeafSettings { guard, max_level })),
        ..SETTINGS
    }
}

/// Flux of each leaf (W), and where it is.
fn check(name: &str, gpu: &Gpu, lit: &Lit) {
    let Propagation::Leaves(sweep) = &*lit.cells.propagation else {
        panic!("{name} has no leaves");
    };
    let grid = &lit.cells.grid;
    let face_m2 = f64::from(grid.cell_size).powi(2);
    let sides = read_sides(gpu, lit);
    let expected = oracle::sweep_leaves(
        grid,
        &sweep.directions,
        &Boundary {
            faces: &lit.words,
            side: &|cell, face| {
                let word = lit.words[cell];
                let before = (word & ((1 << face) - 1)).count_ones();
                let place = ((word >> 8) + before) as usize;
                sides.get(place).copied().unwrap_or_default()
            },
            inflow: &|_, _, _| DVec4::W,
            source: &|cell, direction| {
                // A leaf's flux is its own cells' together: at its corner for all of them.
                let leaf = sweep.leaves.of_cell[cell] as usize;
                if grid.index(sweep.leaves.all[leaf].corner) != cell {
                    return DVec4::ZERO;
                }
                let [r, g, b] = lit.flux[leaf].map(|vector| vector.dot(direction).max(0.0));
                DVec3::new(r, g, b).extend(0.0) / (PI * face_m2)
            },
        },
        sweep.settings,
    );
    let largest = |channel: usize| {
        let all = expected.light.iter().map(|cell| cell[0][channel].abs());
        all.worst().max(1e-9)
    };
    let scale = DVec4::from([0, 1, 2, 3].map(largest));
    let mut worst = 0f64;
    for (got, expected) in lit.light.iter().zip(&expected.light) {
        for (got, expected) in got.iter().zip(expected) {
            for channel in 0..4 {
                // A half float is good to 2⁻¹¹ of itself; sums of eight octants to more.
                let error = (got[channel] - expected[channel]).abs();
                worst = larger(
                    worst,
                    error / (scale[channel] + 20.0 * expected[channel].abs()),
                );
            }
        }
    }
    let levels = sweep.leaves.all.iter().map(|leaf| leaf.level);
    let coarse = levels.filter(|level| *level > 0).count();
    println!("{name}: {coarse} large leaves, differs by {worst:.1e} of the largest");
    assert!(worst < 1e-3, "{name}");
}

#[test]
fn light_of_leaves_is_the_oracles() {
    let gpu = gpu();
    for (name, scene) in lights() {
        for (cells, guard, max_level) in [(20, 1, 5), (33, 1, 2), (25, 2, 1)] {
            let lit = light(&gpu, &scene, cells, settings(guard, max_level));
            check(&format!("{name}, {cells} cells"), &gpu, &lit);
        }
        let of_faces = CellSettings {
            source: Source::Faces,
            bounces: 1,
            ..settings(1, 5)
        };
        let lit = light(&gpu, &scene, 22, of_faces);
        check(&format!("{name}, faces"), &gpu, &lit);
    }
}

/// Few triangles in a large grid: leaves of all sizes, flux in large ones too, which no segment
/// between two centres tells of, and leaves that stick out of the grid.
#[test]
fn light_of_leaves_among_triangles_in_the_open_is_the_oracles() {
    let gpu = gpu();
    let mut random = Random::new(53);
    for size in [[33, 20, 27], [48, 9, 9], [16, 16, 32]] {
        let mut scene = scene_of(&soup(&mut random, 3), 0.0, &mut random);
        scene.lights = vec![Light::Point {
            position: Vec3::new(0.2, 8.3, 1.1),
            intensity: Vec3::new(30.0, 20.0, 10.0),
        }];
        let scene_on = GpuScene::new(&gpu, &scene).unwrap();
        let grid = CellGrid::new(Vec3::new(-7.3, -6.2, -8.1), 0.83, UVec3::from(size));
        let lit = light_in(&gpu, &scene, scene_on, grid, settings(1, 5));
        check(&format!("{size:?}"), &gpu, &lit);
    }
}

/// With a leaf for each cell, the sweep over leaves is the other sweep, but for the order of sums.
#[test]
fn leaves_of_single_cells_are_the_uniform_grid() {
    let gpu = gpu();
    for (name, scene) in lights() {
        for source in [Source::Rsm, Source::Faces] {
            let uniform = CellSettings { source, ..SETTINGS };
            let leaves = CellSettings {
                source,
                ..settings(1, 0)
            };
            let [expected, found] =
                [uniform, leaves].map(|settings| light(&gpu, &scene, 23, settings).light);
            let differences = expected.iter().flatten().zip(found.iter().flatten());
            let error = differences.map(|(a, b)| (*a - *b).abs().largest()).worst();
            let most = expected.iter().map(|cell| cell[0].abs().largest()).worst();
            println!("{name}: differs by {:.1e} of the largest", error / most);
            assert!(error < 1e-3 * most, "{name}: {error} of {most}");
        }
    }
}

/// A model that moves takes the small leaves with it: as if it had always been there.
#[test]
fn leaves_follow_what_moves() {
    let gpu = gpu();
    let scene = bundled("two-rooms");
    let lit = light(&gpu, &scene, 30, settings(1, 5));
    let mut cells = Cells::new(&gpu, &lit.scene, lit.cells.grid, settings(1, 5)).unwrap();
    // Found for nothing in sight first, then for the scene.
    let Some(Propagation::Leaves(sweep)) = Arc::get_mut(&mut cells.propagation) else {
        panic!("no leaves");
    };
    let mut frame = Frame::new();
    frame.fill("test.clear", &cells.faces.words, 0);
    gpu.submit(frame).unwrap();
    sweep.divide(&gpu, &cells.faces).unwrap();
    let before = sweep.leaves.all.len();
    cells.find_faces(&gpu, &lit.scene).unwrap();
    let Propagation::Leaves(sweep) = &*cells.propagation else {
        panic!("no leaves");
    };
    assert!(before < 10 && sweep.leaves.all.len() > 1000, "{before}");
    let maps = LightMaps::new(&gpu, &lit.scene, 64, true).unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&lit.scene.set, &lit.scene.materials);
    maps.draw(&mut frame, &lit.scene);
    cells.light(&mut frame, &lit.scene, &maps, &[]);
    gpu.submit(frame).unwrap();
    let read = |cells: &Cells| {
        let images = [Some(&cells.light.low), cells.light.band2.as_ref()];
        images.map(|image| image.map(|image| gpu.read_image(image, 0, 0).unwrap()))
    };
    assert!(read(&cells) == read(&lit.cells), "light differs");
    assert_eq!(read_words(&gpu, &cells.faces.words), lit.words);
}
