//! What must hold of light propagation volumes, on the oracle.

use std::f64::consts::PI;

use crate::support::compare::{Largest, Worst};
use glam::{DVec3, DVec4, UVec3, Vec3};
use lumivox::gi::lpv::oracle::{Boundary, Place, Swept, irradiance, jacobi, slices, sweep};
use lumivox::gi::lpv::{CellGrid, Directions};

pub(crate) fn cube(size: u32) -> CellGrid {
    CellGrid::new(Vec3::ZERO, 1.0, UVec3::splat(size))
}

/// All cells around a place off a surface.
pub(crate) fn off(position: DVec3, normal: DVec3, shift: f64) -> Place {
    Place {
        position,
        normal,
        shift,
        masked: false,
        damping: false,
    }
}

pub(crate) fn cell_of(grid: &CellGrid, index: usize) -> UVec3 {
    let at = index as u32;
    UVec3::new(
        at % grid.size.x,
        at / grid.size.x % grid.size.y,
        at / (grid.size.x * grid.size.y),
    )
}

/// Faces between cells inside and outside of a box of cells.
pub(crate) fn box_faces(grid: &CellGrid, low: UVec3, end: UVec3) -> Vec<u32> {
    let is_in = |cell: UVec3| cell.cmpge(low).all() && cell.cmplt(end).all();
    let word = |index| {
        let cell = cell_of(grid, index);
        let face = |face: usize| {
            let mut next = cell.as_ivec3();
            next[face / 2] += if face.is_multiple_of(2) { -1 } else { 1 };
            let is_there = next.cmpge(glam::IVec3::ZERO).all();
            let next_in = is_there && is_in(next.as_uvec3());
            u32::from(is_in(cell) != next_in) << face
        };
        (0..6).map(face).sum()
    };
    (0..grid.count() as usize).map(word).collect()
}

#[test]
fn directions_have_the_moments_of_the_sphere() {
    for count in [24, 32, 48, 96, 192, 384, 768, 1024] {
        let directions = Directions::spiral(count);
        assert_eq!(directions.all.len(), count as usize);
        let sum = |of: &dyn Fn(DVec3) -> f64| -> f64 {
            directions.all.iter().map(|(d, w)| w * of(*d)).sum()
        };
        let near = |value: f64, expected: f64| (value - expected).abs() < 1e-9;
        assert!(near(sum(&|_| 1.0), 4.0 * PI), "{count}");
        for i in 0..3 {
            assert!(near(sum(&|d| d[i]), 0.0), "{count}");
            for j in 0..3 {
                let expected = if i == j { 4.0 * PI / 3.0 } else { 0.0 };
                assert!(near(sum(&|d| d[i] * d[j]), expected), "{count}");
            }
            assert!(near(sum(&|d| d[i].abs()), 2.0 * PI), "{count}");
        }
        let equal = 4.0 * PI / f64::from(count);
        let far = |weight: f64| (weight / equal - 1.0).abs();
        let worst = directions.all.iter().map(|(_, w)| far(*w)).worst();
        println!("{count} directions: weights differ by {worst:.3} at most");
        assert!(worst < 0.5, "{count}: {worst}");
        // Sorted by octant, none along an axis, each octant with its own.
        for (octant, [first, own]) in directions.octants.iter().enumerate() {
            assert!(*own > 0, "{count}");
            for (d, _) in &directions.all[*first as usize..][..*own as usize] {
                let of = (0..3)
                    .map(|axis| usize::from(d[axis] < 0.0) << axis)
                    .sum::<usize>();
                assert_eq!(of, octant);
                assert!(d.abs().min_element() > 1e-4 && (d.length() - 1.0).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn grids_hold_the_scene_and_a_margin() {
    let boxes = [
        (Vec3::ZERO, Vec3::ONE),
        (Vec3::new(-3.0, 2.0, 5.0), Vec3::new(7.0, 2.5, 9.0)),
        (Vec3::ZERO, Vec3::new(1.0, 0.0, 0.0)),
        (Vec3::splat(4.0), Vec3::splat(4.0)),
        (Vec3::new(1e3, 0.0, 0.0), Vec3::new(1e3 + 1.0, 1.0, 1.0)),
    ];
    for (low, high) in boxes {
        for cells in [8, 31, 64, 256] {
            let grid = CellGrid::around((low, high), cells, 1);
            assert!(grid.size.max_element() <= cells, "{grid:?}");
            let end = grid.origin + grid.cell_size * grid.size.as_vec3();
            // A margin of one cell, and half a cell between it and the nearest centre.
            let slack = 0.51 * grid.cell_size;
            assert!((low - grid.origin).min_element() > slack, "{grid:?}");
            assert!((end - high).min_element() > slack, "{grid:?}");
        }
    }
}

/// A wall that emits and reflects nothing: everywhere inside, the radiance is that of the wall.
#[test]
fn a_furnace_has_the_light_of_its_walls() {
    let grid = cube(12);
    let faces = box_faces(&grid, UVec3::ONE, UVec3::splat(11));
    let boundary = Boundary {
        faces: &faces,
        side: &|_, _| DVec4::new(1.0, 2.0, 0.5, 0.0),
        inflow: &|_, _, _| DVec4::W,
        source: &|_, _| DVec4::ZERO,
    };
    let swept = sweep(&grid, &Directions::spiral(96), &boundary);
    let places = [
        (DVec3::new(6.0, 6.0, 1.0), DVec3::Z),
        (DVec3::new(6.0, 1.0, 9.5), DVec3::Y),
        (DVec3::new(1.5, 1.5, 1.0), DVec3::Z),
    ];
    for (position, wall) in places {
        for normal in [wall, (wall + 0.4 * DVec3::X).normalize()] {
            let found = irradiance(&swept.light, &grid, &off(position, wall, 1.0), normal);
            let expected = PI * DVec4::new(1.0, 2.0, 0.5, 0.0);
            let error = (found / expected - 1.0).truncate().abs().largest();
            println!("furnace at {position}: {error:.4}");
            assert!(error < 0.005, "{position}: {found}");
        }
    }
    // All that the walls send they take back. (The outside of the box sends too.)
    let lost = swept.ledger.lost() / swept.ledger.injected.max(DVec4::splat(1e-9));
    assert!(lost.truncate().abs().largest() < 1e-9, "{:?}", swept.ledger);
}

/// E = π L on an open plane under a sky, and half of it on a wall.
#[test]
fn an_open_plane_sees_the_whole_sky() {
    let grid = cube(16);
    let faces = (0..grid.count() as usize).map(|index| match cell_of(&grid, index).z {
        3 => 1 << 5,
        4 => 1 << 4,
        _ => 0,
    });
    let faces: Vec<u32> = faces.collect();
    let boundary = Boundary {
        faces: &faces,
        side: &|_, _| DVec4::ZERO,
        // The plane ends, and what would come from below it beyond its end is not of the sky.
        inflow: &|_, _, direction| DVec4::splat(f64::from(direction.z < 0.0)),
        source: &|_, _| DVec4::ZERO,
    };
    let swept = sweep(&grid, &Directions::spiral(192), &boundary);
    let at = DVec3::new(8.0, 8.0, 4.0);
    let up = irradiance(&swept.light, &grid, &off(at, DVec3::Z, 1.0), DVec3::Z);
    assert!((up.x / PI - 1.0).abs() < 0.01, "{up}");
    let aside = irradiance(&swept.light, &grid, &off(at, DVec3::Z, 1.0), DVec3::X);
    assert!((aside.x / PI - 0.5).abs() < 0.03, "{aside}");
}

/// Flux of a cell that sends alike to all sides: what passes a cube around it is what was sent.
#[test]
fn light_of_one_cell_spreads_as_flux_does() {
    let grid = cube(41);
    let faces = vec![0; grid.count() as usize];
    let middle = grid.index(UVec3::splat(20));
    let boundary = Boundary {
        faces: &faces,
        side: &|_, _| DVec4::ZERO,
        inflow: &|_, _, _| DVec4::ZERO,
        source: &|cell, _| {
            if cell == middle {
                DVec4::ONE
            } else {
                DVec4::ZERO
            }
        },
    };
    let directions = Directions::spiral(192);
    let swept = sweep(&grid, &directions, &boundary);
    let sent = 4.0 * PI;
    assert!((swept.ledger.injected.x / sent - 1.0).abs() < 1e-9);
    assert!(
        (swept.ledger.left.x / sent - 1.0).abs() < 1e-9,
        "{:?}",
        swept.ledger
    );
    // Radial flux by the first band: ∫ L ω dω = −√(4π/3) (c₃, c₁, c₂), coefficients being of where
    // light comes from.
    let flux = |cell: UVec3| {
        let c = &swept.light[grid.index(cell)];
        -(4.0 * PI / 3.0f64).sqrt() * DVec3::new(c[3].x, c[1].x, c[2].x)
    };
    for r in [6u32, 12] {
        let (mut sum, mut area) = (0.0, 0.0);
        let range = 20 - r..=20 + r;
        for a in range.clone() {
            for b in range.clone() {
                for (axis, sign) in [
                    (0, 1.0),
                    (0, -1.0),
                    (1, 1.0),
                    (1, -1.0),
                    (2, 1.0),
                    (2, -1.0),
                ] {
                    let mut cell = UVec3::ZERO;
                    cell[axis] = (20.0 + sign * f64::from(r)) as u32;
                    (cell[(axis + 1) % 3], cell[(axis + 2) % 3]) = (a, b);
                    sum += sign * flux(cell)[axis];
                    area += 1.0;
                }
            }
        }
        println!("r {r}: {:.3} of the flux through {area} cells", sum / sent);
        assert!((0.9..1.05).contains(&(sum / sent)), "r {r}: {}", sum / sent);
    }
}

fn difference(a: &Swept, b: &Swept) -> f64 {
    let pairs = a.light.iter().flatten().zip(b.light.iter().flatten());
    pairs.map(|(a, b)| (*a - *b).abs().largest()).worst()
}

/// Steps of all cells at once come to the sweep, once there are as many as a path has cells.
#[test]
fn steps_of_all_cells_at_once_come_to_the_sweep() {
    let grid = CellGrid {
        size: UVec3::new(9, 6, 7),
        ..cube(9)
    };
    let faces = box_faces(&grid, UVec3::new(3, 1, 2), UVec3::new(6, 4, 4));
    let boundary = Boundary {
        faces: &faces,
        side: &|cell, face| DVec4::splat((cell % 5) as f64 + f64::from(face)),
        inflow: &|_, _, direction| DVec4::splat(direction.z.max(0.0)),
        source: &|cell, direction| DVec4::splat((cell % 3) as f64 * direction.x.max(0.0)),
    };
    let directions = Directions::spiral(24);
    let whole = sweep(&grid, &directions, &boundary);
    assert!(difference(&whole, &jacobi(&grid, &directions, &boundary, 20)) < 1e-12);
    assert!(difference(&whole, &jacobi(&grid, &directions, &boundary, 4)) > 1e-3);
    let lost = whole.ledger.lost() / (whole.ledger.injected + whole.ledger.entered);
    assert!(lost.abs().largest() < 1e-12, "{:?}", whole.ledger);
}

/// Slices lose nothing either, past walls and through the border, and nothing passes a wall.
#[test]
fn slices_keep_the_flux_and_pass_no_wall() {
    let grid = CellGrid {
        size: UVec3::new(9, 6, 7),
        ..cube(9)
    };
    let faces = box_faces(&grid, UVec3::new(3, 1, 2), UVec3::new(6, 4, 4));
    let directions = Directions::spiral(96);
    let is_in = |cell: usize| {
        let cell = cell_of(&grid, cell);
        cell.cmpge(UVec3::new(3, 1, 2)).all() && cell.cmplt(UVec3::new(6, 4, 4)).all()
    };
    let boundary = Boundary {
        faces: &faces,
        side: &|cell, _| DVec4::new(1.0, 0.0, f64::from(is_in(cell)), f64::from(!is_in(cell))),
        inflow: &|_, _, direction| DVec4::new(1.0, 1.0, 0.0, direction.z.max(0.0)),
        source: &|cell, direction| match is_in(cell) {
            true => DVec4::ZERO,
            false => DVec4::new(0.0, 0.3, 0.0, direction.x.max(0.0)),
        },
    };
    let marched = slices(&grid, &directions, &boundary);
    let lost = marched.ledger.lost() / (marched.ledger.injected + marched.ledger.entered);
    assert!(lost.abs().largest() < 1e-12, "{:?}", marched.ledger);
    for (cell, light) in marched.light.iter().enumerate() {
        // Radiance 1 at walls and border is radiance 1 in all cells.
        let mean = light[0] / (4.0 * PI).sqrt();
        assert!((mean.x - 1.0).abs() < 1e-12, "{mean}");
        let foreign = if is_in(cell) { mean.y + mean.w } else { mean.z };
        assert!(foreign == 0.0, "{mean}");
    }
}
