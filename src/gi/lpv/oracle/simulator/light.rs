//! What cells have: lobes or radiance along directions.

use std::f64::consts::PI;

use glam::{DVec3, DVec4, UVec3};

use super::{Emission, Injected, Setup, Transport};
use crate::gi::lpv::lobes::{LobeSettings, Occlusion, Scheme, axis_direction};
use crate::gi::lpv::oracle::lobes::{
    Lobe, Steps, basis, cosine_lobe, intensity, solid_angles, step, streams,
};
use crate::gi::lpv::oracle::neighbour;
use crate::gi::lpv::oracle::octree::{self, cell_at, mean_of_children, sum_of_children};
use crate::gi::lpv::{CellGrid, Directions};
use crate::gi::shared::sh;

/// Three bands of intensity over h² (W/(m² sr)), by the directions that light goes to.
pub type Shape = [f64; 9];

/// The light of all cells of a grid.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Two bands of intensity over h², in the first channel.
    Lobes(Vec<Lobe>),
    /// Radiance (W/(m² sr)): all cells along the first direction, then along the next.
    Ordinates(Directions, Vec<f64>),
}

/// Flux that a step has taken out of the grid (W).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Taken {
    /// Through the border.
    pub(super) left: f64,
    /// By opaque faces.
    pub(super) absorbed: f64,
}

fn face_m2(grid: &CellGrid) -> f64 {
    f64::from(grid.cell_size).powi(2)
}

impl Light {
    /// None.
    pub(super) fn dark(grid: &CellGrid, transport: &Transport) -> Self {
        let count = grid.count() as usize;
        match transport {
            Transport::Lobes(_) => Light::Lobes(vec![[DVec4::ZERO; 4]; count]),
            Transport::Ordinates(directions) => {
                Light::Ordinates(directions.clone(), vec![0.0; count * directions.all.len()])
            }
        }
    }

    /// What is injected.
    pub(super) fn injected(setup: &Setup, transport: &Transport) -> Self {
        let mut light = Light::dark(&setup.grid, transport);
        let face_m2 = face_m2(&setup.grid);
        for Injected { cell, emission } in &setup.injected {
            let at = setup.grid.index(*cell);
            match &mut light {
                Light::Lobes(cells) => {
                    let lobe = match emission {
                        Emission::Cosine(flux) => {
                            let axis = flux.normalize_or_zero();
                            (flux.length() / (PI * face_m2) * cosine_lobe(axis)).to_array()
                        }
                        Emission::Coefficients(all) => all.map(|c| c / face_m2),
                    };
                    for (own, more) in cells[at].iter_mut().zip(lobe) {
                        own.x += more;
                    }
                }
                Light::Ordinates(directions, radiance) => {
                    let own = radiance
                        .iter_mut()
                        .skip(at)
                        .step_by(setup.grid.count() as usize);
                    for (radiance, (direction, _)) in own.zip(&directions.all) {
                        let intensity = match emission {
                            Emission::Cosine(flux) => flux.dot(*direction).max(0.0) / PI,
                            Emission::Coefficients(all) => {
                                DVec4::from(*all).dot(basis(*direction)).max(0.0)
                            }
                        };
                        *radiance += intensity / (face_m2 * direction.abs().element_sum());
                    }
                }
            }
        }
        light
    }

    /// Adds that of the same cells.
    pub(super) fn add(&mut self, more: &Light) {
        match (self, more) {
            (Light::Lobes(sum), Light::Lobes(more)) => octree::add(sum, more),
            (Light::Ordinates(_, sum), Light::Ordinates(_, more)) => {
                sum.iter_mut()
                    .zip(more)
                    .for_each(|(sum, more)| *sum += more);
            }
            _ => {}
        }
    }

    /// That of the cells of the next level: the mean of eight children, or all of it.
    pub(super) fn coarser(&self, fine: &CellGrid, coarse: &CellGrid, is_mean: bool) -> Self {
        let parents = if is_mean {
            mean_of_children
        } else {
            sum_of_children
        };
        match self {
            Light::Lobes(cells) => Light::Lobes(parents(fine, coarse, cells)),
            Light::Ordinates(..) => self.clone(),
        }
    }

    /// As lobes; none where it is along directions.
    pub fn lobes(&self) -> Option<&[Lobe]> {
        match self {
            Light::Lobes(cells) => Some(cells),
            Light::Ordinates(..) => None,
        }
    }

    /// ∫ I dω of a cell (W).
    pub fn flux_of(&self, grid: &CellGrid, cell: usize) -> f64 {
        let over_h2 = match self {
            Light::Lobes(cells) => (4.0 * PI).sqrt() * cells[cell][0].x,
            Light::Ordinates(directions, radiance) => directions
                .all
                .iter()
                .zip(radiance.iter().skip(cell).step_by(grid.count() as usize))
                .map(|((d, weight), radiance)| weight * radiance * d.abs().element_sum())
                .sum(),
        };
        face_m2(grid) * over_h2
    }

    /// Intensity of a cell.
    pub fn shape(&self, grid: &CellGrid, cell: usize) -> Shape {
        let mut shape = [0.0; 9];
        match self {
            Light::Lobes(cells) => {
                for (own, c) in shape.iter_mut().zip(cells[cell]) {
                    *own = c.x;
                }
            }
            Light::Ordinates(directions, radiance) => {
                let own = radiance.iter().skip(cell).step_by(grid.count() as usize);
                for ((direction, weight), radiance) in directions.all.iter().zip(own) {
                    let mut basis = [0.0; 9];
                    sh::evaluate(3, *direction, &mut basis);
                    let share = weight * radiance * direction.abs().element_sum();
                    for (own, basis) in shape.iter_mut().zip(basis) {
                        *own += share * basis;
                    }
                }
            }
        }
        shape
    }

    /// One step: what all cells have after it, and what has gone.
    pub(super) fn step(
        &self,
        (grid, faces): (&CellGrid, &[u32]),
        transport: &Transport,
        (gain, clamp_negative): (f64, bool),
    ) -> (Self, Taken) {
        match (self, transport) {
            (Light::Lobes(cells), Transport::Lobes(scheme)) => {
                let steps = Steps {
                    settings: LobeSettings {
                        scheme: *scheme,
                        iterations: 1,
                        gain: 1.0,
                        clamp_negative,
                    },
                    occlusion: Occlusion::Faces,
                    faces,
                    blockers: &[],
                };
                // The first step alone has light from outside.
                let mut after = step(grid, &steps, cells, 2);
                after.iter_mut().flatten().for_each(|c| *c *= gain);
                let handed =
                    |at: usize, face: u32| gain * handed(*scheme, clamp_negative, &cells[at], face);
                (Light::Lobes(after), taken(grid, faces, handed))
            }
            (Light::Ordinates(directions, radiance), _) => {
                let count = grid.count() as usize;
                let mut after = Vec::with_capacity(radiance.len());
                let mut gone = Taken::default();
                for ((direction, weight), own) in
                    directions.all.iter().zip(radiance.chunks_exact(count))
                {
                    after.extend(step_along(grid, faces, *direction, own, gain));
                    let handed = |at: usize, face: u32| {
                        let along = direction.dot(axis_direction(face)).max(0.0);
                        gain * weight * along * own[at]
                    };
                    let more = taken(grid, faces, handed);
                    gone.left += more.left;
                    gone.absorbed += more.absorbed;
                }
                (Light::Ordinates(directions.clone(), after), gone)
            }
            (light, _) => (light.clone(), Taken::default()),
        }
    }
}

/// Radiance of all cells along a direction, from what their upwind neighbours had.
fn step_along(
    grid: &CellGrid,
    faces: &[u32],
    direction: DVec3,
    before: &[f64],
    gain: f64,
) -> Vec<f64> {
    let cell = |at: usize| {
        let place = cell_at(grid, at);
        let along = |axis: usize| {
            let face = 2 * axis as u32 + u32::from(direction[axis] < 0.0);
            let next = neighbour(grid, place, face).filter(|_| faces[at] >> face & 1 == 0);
            direction[axis].abs() * next.map_or(0.0, |next: UVec3| before[grid.index(next)])
        };
        gain * (along(0) + along(1) + along(2)) / direction.abs().element_sum()
    };
    (0..before.len()).map(cell).collect()
}

/// Flux over h² that a cell hands on through a face.
fn handed(scheme: Scheme, clamp_negative: bool, lobe: &Lobe, face: u32) -> f64 {
    let onwards = axis_direction(face);
    let flux = |direction: DVec3, solid_angle: f64| {
        let flux = solid_angle * intensity(lobe, direction).x;
        if clamp_negative { flux.max(0.0) } else { flux }
    };
    match scheme {
        Scheme::Lobes30 => {
            let [far, aside] = solid_angles();
            let sides = (0..6).filter(|other| other / 2 != face / 2);
            let side = |other| flux((onwards + 0.5 * axis_direction(other)).normalize(), aside);
            flux(onwards, far) + sides.map(side).sum::<f64>()
        }
        Scheme::Axis6 => flux(onwards, 2.0 * PI / 3.0),
        Scheme::Stream => {
            let lobe = DVec4::from(lobe.map(|c| c.x));
            (4.0 * PI).sqrt() * (streams()[(face ^ 1) as usize] * lobe).x
        }
    }
}

/// What goes through the border and into opaque faces (W), of flux over h² through a face.
fn taken(grid: &CellGrid, faces: &[u32], handed: impl Fn(usize, u32) -> f64) -> Taken {
    let mut taken = Taken::default();
    for (at, word) in faces.iter().enumerate() {
        let place = cell_at(grid, at);
        for face in 0..6 {
            if word >> face & 1 == 1 {
                taken.absorbed += face_m2(grid) * handed(at, face);
            } else if neighbour(grid, place, face).is_none() {
                taken.left += face_m2(grid) * handed(at, face);
            }
        }
    }
    taken
}
