//! What must hold of the published propagation, on the oracle.

use std::f64::consts::PI;

use glam::{DMat4, DVec3, DVec4, UVec3, Vec3};
use lumivox::gi::lpv::CellGrid;
use lumivox::gi::lpv::bands::streams;
use lumivox::gi::lpv::lobes::{LobeSettings, Occlusion, Scheme, stream};
use lumivox::gi::lpv::oracle::irradiance;
use lumivox::gi::lpv::oracle::lobes::{
    Lobe, Steps, finish, intensity, nodes, propagate, seed, step,
};
use lumivox::gi::shared::sh;

use crate::lpv::{box_faces, cell_of, cube, off};
use crate::support::compare::{Largest, Worst, larger};

const SCHEMES: [Scheme; 3] = [Scheme::Lobes30, Scheme::Axis6, Scheme::Stream];

const OPEN: Steps<'static> = Steps {
    settings: LobeSettings {
        scheme: Scheme::Lobes30,
        iterations: 1,
        gain: 1.0,
        clamp_negative: false,
    },
    occlusion: Occlusion::None,
    faces: &[],
    blockers: &[],
};

fn steps_of(scheme: Scheme, clamp_negative: bool) -> Steps<'static> {
    Steps {
        settings: LobeSettings {
            scheme,
            clamp_negative,
            ..OPEN.settings
        },
        ..OPEN
    }
}

/// A cell in the middle that has a flux of 1 W along its normal in red, and alike to all sides in
/// green.
fn lobe_in_the_middle(grid: &CellGrid, normal: DVec3) -> Vec<Lobe> {
    let middle = grid.index(grid.size / 2);
    let mut flux = vec![[DVec3::ZERO; 3]; grid.count() as usize];
    let mut power = vec![DVec3::ZERO; grid.count() as usize];
    flux[middle][0] = normal;
    power[middle] = DVec3::new(1.0, 1.0, 0.0);
    seed(grid, (&flux, &power), &vec![0; flux.len()], &|_, _| {
        DVec4::ZERO
    })
}

/// Σ ∫ I dω (W): band 0 is all of it.
fn flux_of(cells: &[Lobe]) -> DVec4 {
    cells.iter().map(|cell| (4.0 * PI).sqrt() * cell[0]).sum()
}

#[test]
fn a_step_keeps_the_flux() {
    let grid = cube(17);
    for scheme in SCHEMES {
        let mut cells = lobe_in_the_middle(&grid, DVec3::new(2.0, -1.0, 3.0).normalize());
        assert!((flux_of(&cells).x - 1.0).abs() < 1e-12);
        // The first steps' outside is of alpha alone.
        for number in 1..=7 {
            cells = step(&grid, &steps_of(scheme, false), &cells, number);
            let error = (flux_of(&cells) - DVec4::new(1.0, 1.0, 0.0, 0.0)).truncate();
            assert!(error.abs().largest() < 1e-6, "{scheme:?} {number}: {error}");
        }
    }
}

/// Negative flux that is left out makes light: 14 % of it, in the first step.
#[test]
fn flux_that_is_clamped_grows_once() {
    let grid = cube(19);
    let mut cells = lobe_in_the_middle(&grid, DVec3::Z);
    let flux: Vec<f64> = (1..=8)
        .map(|number| {
            cells = step(&grid, &steps_of(Scheme::Lobes30, true), &cells, number);
            flux_of(&cells).x
        })
        .collect();
    println!("{flux:.4?}");
    assert!((flux[0] - 1.138).abs() < 1e-3, "{flux:?}");
    assert!(
        flux.iter().all(|flux| (flux / 1.138 - 1.0).abs() < 2e-3),
        "{flux:?}"
    );
}

/// A lobe forgets its direction: after 14 steps its light is about one cell further.
#[test]
fn a_lobe_moves_one_cell() {
    let grid = cube(31);
    for (clamp, moved, behind) in [(false, 0.97, 0.27), (true, 0.70, 0.31)] {
        let mut cells = lobe_in_the_middle(&grid, DVec3::Z);
        for number in 1..=14 {
            cells = step(&grid, &steps_of(Scheme::Lobes30, clamp), &cells, number);
        }
        let (mut all, mut moment, mut back) = (0.0, 0.0, 0.0);
        for (index, cell) in cells.iter().enumerate() {
            let z = f64::from(cell_of(&grid, index).z) - 15.0;
            all += cell[0].x;
            moment += z * cell[0].x;
            back += if z < 0.0 { cell[0].x } else { 0.0 };
        }
        println!(
            "clamp {clamp}: {:.3} cells, {:.3} behind",
            moment / all,
            back / all
        );
        assert!((moment / all - moved).abs() < 0.01, "{}", moment / all);
        assert!((back / all - behind).abs() < 0.01, "{}", back / all);
    }
}

/// Walls that emit and reflect nothing: axes have the radiance of the wall, lobes more.
#[test]
fn a_furnace_of_axes_has_the_light_of_its_walls() {
    let grid = cube(10);
    let faces = box_faces(&grid, UVec3::ONE, UVec3::splat(9));
    let (flux, power) = (
        vec![[DVec3::ZERO; 3]; faces.len()],
        vec![DVec3::ZERO; faces.len()],
    );
    let first = seed(&grid, (&flux, &power), &faces, &|_, _| DVec4::ONE);
    let furnace = |scheme| {
        let steps = Steps {
            settings: LobeSettings {
                iterations: 350,
                ..steps_of(scheme, false).settings
            },
            occlusion: Occlusion::Faces,
            faces: &faces,
            blockers: &[],
        };
        let light = finish(&propagate(&grid, &steps, &first));
        let at =
            |place: DVec3, normal| irradiance(&light, &grid, &off(place, normal, 0.5), normal).x;
        [
            at(DVec3::new(5.0, 5.0, 1.0), DVec3::Z) / PI,
            at(DVec3::new(5.0, 1.5, 1.0), DVec3::Z) / PI,
            at(DVec3::splat(5.0), DVec3::X) / PI,
        ]
    };
    let axes = furnace(Scheme::Axis6);
    println!("axes {axes:.4?}");
    assert!(
        axes.iter().all(|light| (light - 1.0).abs() < 0.005),
        "{axes:?}"
    );
    let streams = furnace(Scheme::Stream);
    println!("streams {streams:.4?}");
    assert!(
        streams.iter().all(|light| (light - 1.0).abs() < 0.01),
        "{streams:?}"
    );
    let lobes = furnace(Scheme::Lobes30);
    println!("lobes {lobes:.4?}");
    assert!((lobes[0] - 1.1).abs() < 0.04 && lobes[2] > 1.4, "{lobes:?}");
}

/// An environment that is alike on all sides is the same in all cells.
#[test]
fn an_open_grid_has_the_environment() {
    let grid = CellGrid {
        size: UVec3::new(5, 7, 4),
        ..cube(7)
    };
    let nothing = vec![[DVec4::ZERO; 4]; grid.count() as usize];
    for scheme in SCHEMES {
        let mut steps = steps_of(scheme, false);
        steps.settings.iterations = 300;
        let light = finish(&propagate(&grid, &steps, &nothing));
        let error = |cell: &[DVec4; 9]| (sh::reconstruct(&[cell[0].w], DVec3::X) - 1.0).abs();
        let worst = light.iter().map(error).worst();
        println!("{scheme:?}: radiance differs by {worst:.1e}");
        assert!(worst < 1e-6, "{scheme:?}: {worst}");
        let odd = light
            .iter()
            .flat_map(|cell| [cell[1].w, cell[2].w, cell[3].w]);
        assert!(odd.map(f64::abs).worst() < 1e-6, "{scheme:?}");
    }
}

/// Streams keep direction: what a cell sends to all sides passes a cube around it.
#[test]
fn streams_spread_as_flux_does() {
    let grid = cube(33);
    let mut steps = steps_of(Scheme::Stream, false);
    steps.settings.iterations = 160;
    let light = finish(&propagate(
        &grid,
        &steps,
        &lobe_in_the_middle(&grid, DVec3::Z),
    ));
    // As in the test of the sweep, of green.
    let flux = |cell: UVec3| {
        let c = &light[grid.index(cell)];
        -(4.0 * PI / 3.0).sqrt() * DVec3::new(c[3].y, c[1].y, c[2].y)
    };
    for r in [6, 10] {
        let mut sum = 0.0;
        for a in 16 - r..=16 + r {
            for b in 16 - r..=16 + r {
                for axis in 0..3 {
                    for (at, sign) in [(16 + r, 1.0), (16 - r, -1.0)] {
                        let mut cell = UVec3::splat(at);
                        (cell[(axis + 1) % 3], cell[(axis + 2) % 3]) = (a, b);
                        sum += sign * flux(cell)[axis];
                    }
                }
            }
        }
        println!("r {r}: {sum:.3} of the flux");
        assert!((0.9..1.1).contains(&sum), "r {r}: {sum}");
    }
}

/// The fractions through all faces are the whole, and half of an axis goes each way.
#[test]
fn streams_are_shares_of_the_sphere() {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let all: DMat4 = axes
        .into_iter()
        .map(|axis| stream(axis) + stream(-axis))
        .sum();
    assert!(all.abs_diff_eq(DMat4::IDENTITY, 1e-9), "{all}");
    for (axis, place) in axes.into_iter().zip([3, 1, 2]) {
        let matrix = stream(axis);
        assert!((matrix.x_axis.x - 1.0 / 6.0).abs() < 1e-5, "{matrix}");
        assert!(
            (0.15..0.2).contains(&matrix.x_axis[place])
                && matrix.abs_diff_eq(matrix.transpose(), 1e-12)
        );
    }
}

/// A quarter at each step: nothing is left after some.
#[test]
fn a_gain_of_a_quarter_dies_out() {
    let grid = cube(25);
    for scheme in SCHEMES {
        let mut steps = steps_of(scheme, false);
        steps.settings.gain = 0.25;
        let mut cells = lobe_in_the_middle(&grid, DVec3::Y);
        for number in 1..=10 {
            cells = step(&grid, &steps, &cells, number);
        }
        let left = flux_of(&cells).x * 4f64.powi(10);
        assert!((left - 1.0).abs() < 1e-5, "{scheme:?}: {left}");
    }
}

/// A surface of the area of a face lets a quarter through from its front, and all from its back:
/// two bands make its clamped cosine 0.75 along the normal. The first step is free.
#[test]
fn blockers_let_a_part_through() {
    let grid = cube(9);
    let blocker = DVec4::from_slice(&sh::rotate_zonal(&sh::clamped_cosine(2), DVec3::NEG_Z));
    let blockers = vec![blocker; nodes(&grid).count() as usize];
    let steps = Steps {
        occlusion: Occlusion::Fuzzy,
        blockers: &blockers,
        ..steps_of(Scheme::Axis6, true)
    };
    let first = lobe_in_the_middle(&grid, DVec3::Z);
    for (number, factors) in [(1, [1.0; 3]), (2, [0.25, 1.0, 0.75])] {
        let [open, blocked] =
            [steps_of(Scheme::Axis6, true), steps].map(|steps| step(&grid, &steps, &first, number));
        for (offset, factor) in [[0, 0, 1], [0, 0, -1], [1, 0, 0]].into_iter().zip(factors) {
            let cell = UVec3::splat(4).wrapping_add_signed(offset.into());
            let [open, blocked] = [&open, &blocked].map(|cells| cells[grid.index(cell)][0].y);
            assert!(
                (blocked / open - factor).abs() < 1e-9,
                "step {number}, {offset:?}"
            );
        }
    }
}

/// The lobe of a texel is (Φ/π) ⟨n,ω⟩₊, and what it lights is the cosine of that.
#[test]
fn a_seed_is_a_cosine_lobe_of_its_flux() {
    let mut grid = cube(3);
    grid.cell_size = 0.5;
    grid.origin = Vec3::splat(-0.75);
    let normal = DVec3::new(0.6, 0.0, -0.8);
    let cells = lobe_in_the_middle(&grid, normal);
    let middle = &cells[grid.index(UVec3::ONE)];
    // ¾ of the peak in two bands, over h².
    let peak = intensity(middle, normal).x;
    assert!((peak - 0.75 / (PI * 0.25)).abs() < 1e-12, "{peak}");
    assert!((flux_of(&cells).x - 1.0 / 0.25).abs() < 1e-12);
}

/// What goes through all six faces is all there is; two bands are the corner of more.
#[test]
fn streams_in_more_bands_keep_the_flux() {
    for bands in [2usize, 3, 4] {
        let (all, count) = (streams(bands), bands * bands);
        let mut worst = 0f64;
        for row in 0..count {
            for column in 0..count {
                let sum: f64 = all.iter().map(|matrix| matrix[row * count + column]).sum();
                let expected = f64::from(u8::from(row == column));
                worst = larger(worst, (sum - expected).abs());
                if row < 4 && column < 4 {
                    for (face, own) in all.iter().enumerate() {
                        let mut onwards = DVec3::ZERO;
                        onwards[face / 2] = if face % 2 == 0 { 1.0 } else { -1.0 };
                        let two = stream(onwards).col(column)[row];
                        worst = larger(worst, (own[row * count + column] - two).abs());
                    }
                }
            }
        }
        println!("{bands} bands: {worst:.1e}");
        assert!(worst < 1e-9, "{bands}: {worst}");
    }
}
