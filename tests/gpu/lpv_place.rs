//! Figures of the cell at a pixel against what is read back of all cells.

use glam::{DVec3, UVec3, Vec3};
use lumivox::gi::inspect::BeamStart;
use lumivox::gi::lpv::leaves::LeafSettings;
use lumivox::gi::lpv::lobes::{LobeSettings, Occlusion, Scheme};
use lumivox::gi::lpv::oracle::{Place, irradiance};
use lumivox::gi::lpv::place::figures;
use lumivox::gi::lpv::{CellSettings, Octree, Propagation};
use lumivox::gi::shared::sh;
use lumivox::graph::Gpu;

use crate::lpv::{Lit, SETTINGS, light};
use crate::support::scenes::bundled;
use crate::support::{Random, gpu};

/// The three numbers of a figure.
fn numbers(figures: &[(&'static str, String)], name: &str) -> DVec3 {
    let value = figures
        .iter()
        .find(|(own, _)| *own == name)
        .map(|(_, value)| value);
    let value = value.unwrap_or_else(|| panic!("no figure {name}"));
    let words = value
        .split(' ')
        .take(3)
        .map(|word| word.trim_end_matches(','));
    let numbers: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
    DVec3::from_slice(&numbers)
}

fn check_close(what: &str, found: DVec3, expected: DVec3) {
    // Three digits are told.
    let error = (found - expected).abs();
    let close = error.cmple(0.006 * expected.abs() + 1e-5);
    assert!(close.all(), "{what}: {found} for {expected}");
}

fn check(gpu: &Gpu, name: &str, lit: &Lit, random: &mut Random) -> usize {
    let grid = lit.cells.grid;
    let environment = lit.scene.environment.radiance.as_dvec3();
    let mut lit_cells = 0;
    for _ in 0..40 {
        let mut place = || {
            (0..3)
                .map(|_| random.unit() * 1.1 - 0.05)
                .collect::<Vec<f32>>()
        };
        let (inside, normal) = (place(), place());
        let position =
            grid.corner() + grid.cell_size * grid.size.as_vec3() * Vec3::from_slice(&inside);
        let normal = (Vec3::from_slice(&normal) - 0.5).normalize_or(Vec3::Y);
        let start = BeamStart {
            pixel: [0, 0],
            place: [0, 0],
            position,
            geometric_normal: normal,
            shading_normal: normal,
            roughness: 0.0,
            eye: Vec3::ZERO,
            walk: 0,
        };
        let cells = std::slice::from_ref(&lit.cells);
        let found = figures((gpu, &lit.scene), cells, 0.5, &start).unwrap();
        let off = 0.5 * normal.abs().element_sum() * normal;
        let cell = ((position - grid.corner()) / grid.cell_size + off).floor();
        let cell = cell.clamp(Vec3::ZERO, (grid.size - 1).as_vec3()).as_uvec3();
        assert_eq!(numbers(&found, "cell"), cell.as_dvec3(), "{name}");
        check_figures(name, lit, (cell, environment), &found);
        let facing = numbers(&found, "E facing as the surface");
        let expected = at_centre(lit, cell, normal.as_dvec3(), environment);
        check_close(name, facing, expected);
        lit_cells += usize::from(expected.x > 0.0);
    }
    lit_cells
}

/// Irradiance by the oracle's lookup, which filters nothing at a cell's centre.
fn at_centre(lit: &Lit, cell: UVec3, normal: DVec3, environment: DVec3) -> DVec3 {
    let grid = &lit.cells.grid;
    let centre = grid.corner().as_dvec3() + f64::from(grid.cell_size) * (cell.as_dvec3() + 0.5);
    let place = Place {
        position: centre,
        normal,
        shift: 0.0,
        masked: false,
        damping: false,
    };
    let sum = irradiance(&lit.light, grid, &place, normal);
    sum.truncate() + sum.w * environment
}

fn check_figures(
    name: &str,
    lit: &Lit,
    (cell, environment): (UVec3, DVec3),
    found: &[(&'static str, String)],
) {
    let index = lit.cells.grid.index(cell);
    for (face, letter) in ["−x", "+x", "−y", "+y", "−z", "+z"].into_iter().enumerate() {
        let faces = found
            .iter()
            .find(|(name, _)| *name == "opaque faces")
            .unwrap();
        let is_opaque = lit.words[index] >> face & 1 == 1;
        assert_eq!(faces.1.contains(letter), is_opaque, "{name}: {}", faces.1);
        let mut normal = DVec3::ZERO;
        normal[face / 2] = if face % 2 == 0 { -1.0 } else { 1.0 };
        let expected = at_centre(lit, cell, normal, environment);
        check_close(
            name,
            numbers(found, &format!("E facing {letter}")),
            expected,
        );
    }
    let receiver = match &*lit.cells.propagation {
        Propagation::Leaves(sweep) => sweep.leaves.of_cell[index] as usize,
        _ => index,
    };
    let flux = DVec3::from(lit.flux[receiver].map(DVec3::length));
    check_close(name, numbers(found, "flux injected"), flux);
    let mut basis = [0.0; 9];
    sh::evaluate(3, DVec3::Z, &mut basis);
    let first = lit.light[index][0];
    let mean = basis[0] * (first.truncate() + first.w * environment);
    check_close(name, numbers(found, "mean radiance"), mean);
}

#[test]
fn figures_of_cells_are_what_is_read_back() {
    let gpu = &gpu();
    let mut random = Random::new(2031);
    let mut scene = bundled("cornell");
    scene.environment = Vec3::new(0.1, 0.2, 0.3).into();
    let leaves = CellSettings {
        octree: Some(Octree::Leaves(LeafSettings {
            guard: 1,
            max_level: 2,
        })),
        ..SETTINGS
    };
    let lobes = CellSettings {
        occlusion: Occlusion::Fuzzy,
        lobes: Some(LobeSettings {
            scheme: Scheme::Lobes30,
            iterations: 8,
            gain: 1.0,
            clamp_negative: true,
        }),
        ..SETTINGS
    };
    for (name, settings) in [("cells", SETTINGS), ("leaves", leaves), ("lobes", lobes)] {
        let lit = light(gpu, &scene, 20, settings);
        assert!(check(gpu, name, &lit, &mut random) > 20, "{name}");
    }
}
