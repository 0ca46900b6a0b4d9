//! What the cell has that a surface looks its light up in, in words.

use glam::{DVec3, DVec4, IVec3, UVec3};

use super::cells::{Cells, Propagation};
use super::inject::{FLUX_NUMBERS, flux_unit};
use crate::gi::inspect::BeamStart;
use crate::gi::shared::sh;
use crate::graph::{Error, Gpu};
use crate::render::{GpuScene, float_from_half};
use crate::text::{counted, short};

/// Names of the six directions along axes, in the order of faces.
const FACES: [&str; 6] = ["−x", "+x", "−y", "+y", "−z", "+z"];
/// What a receiver gets that faces along each of them.
const FACING: [&str; 6] = [
    "E facing −x",
    "E facing +x",
    "E facing −y",
    "E facing +y",
    "E facing −z",
    "E facing +z",
];

/// A cell, and what is read of it.
struct Found<'c> {
    cells: &'c Cells,
    cell: UVec3,
    /// What comes from all directions: rgb (W/(m² sr)), and that of an environment of radiance 1.
    coefficients: [DVec4; 9],
    /// Radiance of the environment (W/(m² sr)).
    environment: DVec3,
    /// Opaque faces, six bits.
    word: u32,
    /// Flux that is injected into it, or its leaf, red, green, blue: one vector each (W).
    flux: [DVec3; 3],
}

/// Figures of the cell that a surface looks up `shift` cells off, of the finest of nested grids
/// that has it: `grids` outermost first.
pub fn figures(
    (gpu, scene): (&Gpu, &GpuScene),
    grids: &[Cells],
    shift: f32,
    start: &BeamStart,
) -> Result<Vec<(&'static str, String)>, Error> {
    let normal = start.geometric_normal;
    let place = |cells: &Cells| {
        let grid = &cells.grid;
        let off = shift * normal.abs().element_sum() * normal;
        (start.position - grid.corner()) / grid.cell_size + off
    };
    let is_inside = |cells: &&Cells| {
        let middle = 0.5 * cells.grid.size.as_vec3();
        (middle - 0.5 - (place(cells) - middle).abs()).min_element() >= 0.0
    };
    let Some(cells) = grids.iter().rev().find(is_inside).or(grids.first()) else {
        return Ok(Vec::new());
    };
    let last = cells.grid.size.as_ivec3() - 1;
    let cell = place(cells).floor().as_ivec3().clamp(IVec3::ZERO, last);
    let found = Found::read((gpu, scene), cells, cell.as_uvec3())?;
    let mut figures = vec![(
        "surface",
        format!("{} m", triple(start.position.as_dvec3())),
    )];
    if grids.len() > 1 {
        let level = grids.len() as u32 - 1 - cells.grid.slab;
        let last = grids.len() - 1;
        figures.push(("grid", format!("{level} of 0 to {last}, 0 the finest")));
    }
    figures.extend(found.figures());
    let facing = found.irradiance(start.shading_normal.as_dvec3());
    figures.push(("E facing as the surface", watts_m2(facing)));
    Ok(figures)
}

impl<'c> Found<'c> {
    fn read((gpu, scene): (&Gpu, &GpuScene), cells: &'c Cells, cell: UVec3) -> Result<Self, Error> {
        let (grid, index) = (&cells.grid, cells.grid.index(cell) as u64);
        let scale = f64::from(cells.scale);
        let mut coefficients = [DVec4::ZERO; 9];
        let own = (0..cells.light.coefficients()).zip(&mut coefficients);
        for (at, coefficient) in own {
            let (image, first) = cells.light.place(at, (grid.size, grid.slab));
            let texel = gpu.read_texel(image, (cell + first).to_array())?;
            let halves: [u16; 4] = bytemuck::pod_read_unaligned(&texel);
            let [r, g, b, a] = halves.map(|half| f64::from(float_from_half(half)));
            *coefficient = DVec4::new(scale * r, scale * g, scale * b, a);
        }
        let word =
            bytemuck::pod_read_unaligned(&gpu.read_part(&cells.faces.words, 4 * index, 4)?);
        let receiver = match &*cells.propagation {
            Propagation::Leaves(sweep) => u64::from(sweep.leaves.of_cell[index as usize]),
            _ => index,
        };
        let receivers = u64::from(cells.receivers());
        let unit = f64::from(flux_unit(&scene.lights, grid));
        let mut flux = [DVec3::ZERO; 3];
        for number in 0..u64::from(FLUX_NUMBERS) {
            let bytes = gpu.read_part(&cells.flux, 4 * (number * receivers + receiver), 4)?;
            let steps: i32 = bytemuck::pod_read_unaligned(&bytes);
            flux[number as usize / 3][number as usize % 3] = unit * f64::from(steps);
        }
        Ok(Found {
            cells,
            cell,
            coefficients,
            environment: scene.environment.radiance.as_dvec3(),
            word,
            flux,
        })
    }

    /// On a receiver that faces there (W/m²).
    fn irradiance(&self, normal: DVec3) -> DVec3 {
        let sum = sh::irradiance(&self.coefficients, normal).max(DVec4::ZERO);
        sum.truncate() + sum.w * self.environment
    }

    fn figures(&self) -> Vec<(&'static str, String)> {
        let grid = &self.cells.grid;
        let centre = grid.corner() + grid.cell_size * (self.cell.as_vec3() + 0.5);
        let [x, y, z] = self.cell.to_array();
        let edge = short(f64::from(grid.cell_size));
        let mut figures = vec![
            ("cell", format!("{x} {y} {z}, {edge} m wide")),
            ("its centre", format!("{} m", triple(centre.as_dvec3()))),
        ];
        if let Propagation::Leaves(sweep) = &*self.cells.propagation {
            let leaf = sweep.leaves.all[sweep.leaves.of_cell[grid.index(self.cell)] as usize];
            let (level, edge) = (leaf.level, counted(leaf.size() as usize, "cell"));
            figures.push(("leaf", format!("level {level}, {edge} wide")));
        }
        let opaque = (0..6).filter(|face| self.word >> face & 1 == 1);
        let opaque: Vec<&str> = opaque.map(|face| FACES[face]).collect();
        let opaque = if opaque.is_empty() {
            "none".to_owned()
        } else {
            opaque.join(" ")
        };
        let [first, ..] = self.coefficients;
        let mean = first.truncate() + first.w * self.environment;
        // Of a constant, c₀₀ = 4π Y₀₀ L, and 4π Y₀₀² = 1.
        let y00 = 0.5 / std::f64::consts::PI.sqrt();
        let injected = DVec3::from(self.flux.map(DVec3::length));
        figures.push(("opaque faces", opaque));
        figures.push(("flux injected", format!("{} W", triple(injected))));
        figures.push(("mean radiance", format!("{} W/(m² sr)", triple(y00 * mean))));
        for (face, name) in FACING.into_iter().enumerate() {
            let mut normal = DVec3::ZERO;
            normal[face / 2] = if face % 2 == 0 { -1.0 } else { 1.0 };
            figures.push((name, watts_m2(self.irradiance(normal))));
        }
        figures
    }
}

fn triple(of: DVec3) -> String {
    of.to_array().map(short).join(" ")
}

fn watts_m2(irradiance: DVec3) -> String {
    format!("{} W/m²", triple(irradiance))
}
