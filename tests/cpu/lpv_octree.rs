//! What must hold of lobes in a full octree, on the oracle.

use std::f64::consts::PI;

use glam::{DVec3, DVec4, UVec3};
use lumivox::gi::lpv::CellGrid;
use lumivox::gi::lpv::lobes::{LobeSettings, Occlusion, Scheme};
use lumivox::gi::lpv::oracle::lobes::{Lobe, Steps, propagate, seed, step};
use lumivox::gi::lpv::oracle::octree::{
    coarse_faces, index_volume, levels, mean_of_children, merge_finest, merge_sum, published,
    repaired, sum_of_children,
};

use crate::lpv::{box_faces, cell_of, cube};
use crate::support::compare::{Largest, Worst};

fn steps(scheme: Scheme, iterations: u32) -> Steps<'static> {
    Steps {
        settings: LobeSettings {
            scheme,
            iterations,
            gain: 1.0,
            clamp_negative: false,
        },
        occlusion: Occlusion::None,
        faces: &[],
        blockers: &[],
    }
}

/// Cells with a flux (W) along a direction each.
fn injected(grid: &CellGrid, cells: &[(UVec3, DVec3)]) -> Vec<Lobe> {
    let mut flux = vec![[DVec3::ZERO; 3]; grid.count() as usize];
    let mut power = vec![DVec3::ZERO; grid.count() as usize];
    for (cell, direction) in cells {
        flux[grid.index(*cell)][0] += *direction;
        power[grid.index(*cell)] += DVec3::X * direction.length();
    }
    seed(grid, (&flux, &power), &vec![0; flux.len()], &|_, _| {
        DVec4::ZERO
    })
}

/// Light in three places, off the middle.
fn three_places(grid: &CellGrid) -> Vec<Lobe> {
    let at = |x, y, z| UVec3::new(x, y, z).min(grid.size - 1);
    injected(
        grid,
        &[
            (at(1, 2, 3), DVec3::X),
            (at(5, 5, 4), DVec3::new(0.0, 2.0, -1.0)),
            (at(6, 1, 7), DVec3::NEG_Z),
        ],
    )
}

/// Σ ∫ I dω (W).
fn flux_of(grid: &CellGrid, cells: &[Lobe]) -> f64 {
    let face_m2 = f64::from(grid.cell_size).powi(2);
    cells
        .iter()
        .map(|cell| (4.0 * PI).sqrt() * face_m2 * cell[0].x)
        .sum()
}

/// Of red, green and blue.
fn difference(a: &Lobe, b: &Lobe) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (*a - *b).truncate().abs().largest())
        .worst()
}

#[test]
fn levels_halve_down_to_two_cells() {
    let sizes = |grid| -> Vec<UVec3> { levels(grid).iter().map(|level| level.size).collect() };
    assert_eq!(sizes(cube(32)), [32, 16, 8, 4, 2].map(UVec3::splat));
    let odd = CellGrid {
        size: UVec3::new(7, 3, 1),
        ..cube(7)
    };
    let expected = [[7, 3, 1], [4, 2, 1], [2, 1, 1]];
    assert_eq!(sizes(odd), expected.map(UVec3::from));
    assert_eq!(levels(cube(32))[4].cell_size, 16.0);
}

/// Of an odd number of cells too.
#[test]
fn the_sum_of_children_keeps_the_flux() {
    for size in [UVec3::splat(8), UVec3::new(7, 5, 9)] {
        let grids = levels(CellGrid { size, ..cube(8) });
        let mut cells = three_places(&grids[0]);
        let flux = flux_of(&grids[0], &cells);
        for pair in grids.windows(2) {
            let mean = mean_of_children(&pair[0], &pair[1], &cells);
            cells = sum_of_children(&pair[0], &pair[1], &cells);
            assert!((flux_of(&pair[1], &cells) / flux - 1.0).abs() < 1e-12);
            // I/h² of the sum is twice the mean: with the mean, half of the flux is lost a level.
            let twice = mean.iter().map(|lobe| lobe.map(|c| 2.0 * c));
            let far = twice.zip(&cells).map(|(a, b)| difference(&a, b));
            assert!(far.worst() < 1e-15);
        }
    }
}

/// Wherever the finest level has light, so has the merged grid, as a uniform grid has after as many
/// steps; elsewhere a coarser level has it.
#[test]
fn the_published_octree_is_uniform_where_its_finest_level_has_light() {
    for scheme in [Scheme::Lobes30, Scheme::Axis6, Scheme::Stream] {
        let grids = levels(cube(16));
        let first = injected(&grids[0], &[(UVec3::new(2, 9, 8), DVec3::X)]);
        let own = steps(scheme, 4);
        let fields = published(&grids, &vec![own; grids.len()], &first);
        let index = index_volume(&grids, &fields);
        let merged = merge_finest(&grids, &fields);
        let uniform = propagate(&grids[0], &own, &first);
        let mut finest = 0;
        for at in 0..merged.len() {
            let is_lit = uniform[at].iter().any(|c| c.x != 0.0);
            assert_eq!(index[at] == 0, is_lit);
            if is_lit {
                assert_eq!(merged[at], uniform[at]);
                finest += 1;
            } else {
                let cell = cell_of(&grids[0], at) >> index[at];
                let grid = &grids[index[at] as usize];
                assert_eq!(merged[at], fields[index[at] as usize][grid.index(cell)]);
            }
        }
        // Cells that four steps reach: 129 of a whole octahedron, less what is outside.
        assert!((90..=129).contains(&finest), "{finest}");
        assert!(index.contains(&1) && index.contains(&2));
    }
}

/// What a level still has, and what has gone through the border at each step, is what was injected.
#[test]
fn the_repaired_octree_loses_nothing() {
    for scheme in [Scheme::Lobes30, Scheme::Axis6] {
        let grids = levels(cube(16));
        let own = steps(scheme, 3);
        let first = three_places(&grids[0]);
        let flux = flux_of(&grids[0], &first);
        let found = repaired(&grids, &vec![own; grids.len()], &first);
        let mut left = 0.0;
        let mut source = first.clone();
        for (level, grid) in grids.iter().enumerate() {
            if level > 0 {
                let finer = level - 1;
                source = sum_of_children(&grids[finer], grid, &found.residuals[finer]);
            }
            let (gone, on_its_way) = through_the_border(grid, &own, &source);
            left += gone;
            let far = on_its_way.iter().zip(&found.residuals[level]);
            assert!(far.map(|(a, b)| difference(a, b)).worst() < 1e-12);
            let known = left + flux_of(grid, &found.residuals[level]);
            println!("{scheme:?}, level {level}: {left:.4} W left of {flux:.4}");
            assert!((known / flux - 1.0).abs() < 1e-12, "{known} of {flux}");
        }
        assert!(left > 0.9 * flux);
        // The light of one level counts once: the coarse levels add only what their steps bring.
        let sum = merge_sum(&grids, &found.fields);
        let finest = propagate(&grids[0], &own, &first);
        let far = found.fields[0].iter().zip(&finest);
        assert!(far.map(|(a, b)| difference(a, b)).worst() < 1e-12);
        assert!(flux_of(&grids[0], &sum) > flux_of(&grids[0], &finest));
    }
}

/// Flux that steps in a larger grid bring to cells outside of this one (W), and what stays.
fn through_the_border(grid: &CellGrid, steps: &Steps<'_>, source: &[Lobe]) -> (f64, Vec<Lobe>) {
    let wide = CellGrid {
        size: grid.size + 2,
        ..*grid
    };
    let (mut gone, mut cells) = (0.0, source.to_vec());
    for _ in 0..steps.settings.iterations {
        let mut around = vec![[DVec4::ZERO; 4]; wide.count() as usize];
        for (at, cell) in cells.iter().enumerate() {
            around[wide.index(cell_of(grid, at) + 1)] = *cell;
        }
        // The first step alone has light from outside.
        let mut after = step(&wide, steps, &around, 2);
        for (at, cell) in cells.iter_mut().enumerate() {
            let place = wide.index(cell_of(grid, at) + 1);
            *cell = std::mem::replace(&mut after[place], [DVec4::ZERO; 4]);
        }
        gone += flux_of(&wide, &after);
    }
    (gone, cells)
}

/// Walls of a closed box are walls of all coarser boxes, at odd places too.
#[test]
fn coarse_faces_close_what_fine_ones_close() {
    for (low, end) in [(2, 14), (3, 13), (1, 12), (0, 16)] {
        let grids = levels(cube(16));
        let mut faces = box_faces(&grids[0], UVec3::splat(low), UVec3::splat(end));
        for pair in grids.windows(2).take(2) {
            faces = coarse_faces(&pair[0], &pair[1], &faces);
            let own = Steps {
                occlusion: Occlusion::Faces,
                faces: &faces,
                ..steps(Scheme::Axis6, 1)
            };
            let middle = pair[1].size / 2;
            let mut cells = injected(&pair[1], &[(middle, DVec3::Y)]);
            let flux = flux_of(&pair[1], &cells);
            let mut reached = vec![false; cells.len()];
            for _ in 0..20 {
                cells = step(&pair[1], &own, &cells, 2);
                for (reached, cell) in reached.iter_mut().zip(&cells) {
                    *reached |= cell[0].x != 0.0;
                }
            }
            // What meets a wall is gone, and nothing is behind one.
            assert!(flux_of(&pair[1], &cells) < flux);
            let inside = reached.iter().filter(|reached| **reached).count() as f64;
            let side = f64::from(end - low) * f64::from(grids[0].cell_size / pair[1].cell_size);
            let ratio = inside.cbrt() / side;
            assert!((0.6..1.4).contains(&ratio), "{low} to {end}: {ratio}");
        }
    }
}
