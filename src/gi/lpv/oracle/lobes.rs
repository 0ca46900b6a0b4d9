//! Twins of `lpv.geometry`, `lpv.seed`, `lpv.propagate` and `lpv.finish`.

use std::f64::consts::PI;
use std::sync::OnceLock;

use glam::{DMat4, DVec3, DVec4, UVec3};

use super::Texel;
use super::light::shifted;
use super::sweep::neighbour;
use crate::gi::lpv::CellGrid;
use crate::gi::lpv::lobes::{LobeSettings, Occlusion, Scheme, axis_direction, stream};

/// Two bands of intensity over h², by the directions that light goes to: rgb, and in alpha that of
/// an environment of radiance 1 (W/(m² sr)).
pub type Lobe = [DVec4; 4];

/// How lobes are handed on, and what is in their way.
#[derive(Clone, Copy, Debug)]
pub struct Steps<'s> {
    /// To which neighbours, how often, how much.
    pub settings: LobeSettings,
    /// What stops light.
    pub occlusion: Occlusion,
    /// Opaque faces of all cells, six bits each.
    pub faces: &'s [u32],
    /// Blocking potential at the corners of all cells, in two bands.
    pub blockers: &'s [DVec4],
}

/// Σ Φ of all cells (W).
pub fn power(texels: impl IntoIterator<Item = Texel>, grid: &CellGrid, shift: f64) -> Vec<DVec3> {
    let mut power = vec![DVec3::ZERO; grid.count() as usize];
    for texel in texels {
        let place = shifted(grid, texel.position, texel.normal, shift).floor();
        if place.min_element() >= 0.0 && place.cmplt(grid.size.as_dvec3()).all() {
            power[grid.index(place.as_uvec3())] += texel.flux;
        }
    }
    power
}

/// The grid of the corners of cells.
pub fn nodes(grid: &CellGrid) -> CellGrid {
    CellGrid {
        size: grid.size + 1,
        ..*grid
    }
}

/// B(ω) = Σ A ⟨n,ω⟩₊ / h² of the surfaces that one light or the camera sees, at the corners of all
/// cells.
pub fn blockers(texels: impl IntoIterator<Item = Texel>, grid: &CellGrid) -> Vec<DVec4> {
    let nodes = nodes(grid);
    let mut blockers = vec![DVec4::ZERO; nodes.count() as usize];
    let face_m2 = f64::from(grid.cell_size).powi(2);
    for texel in texels {
        let place = (shifted(grid, texel.position, texel.normal, 0.0) + 0.5).floor();
        if place.min_element() >= 0.0 && place.cmplt(nodes.size.as_dvec3()).all() {
            blockers[nodes.index(place.as_uvec3())] +=
                texel.area_m2.min(16.0 * face_m2) / face_m2 * cosine_lobe(texel.normal);
        }
    }
    blockers
}

/// Two bands: √(1/4π), and √(3/4π) (y, z, x).
pub(crate) fn basis(d: DVec3) -> DVec4 {
    let band = (0.75 / PI).sqrt() * DVec3::new(d.y, d.z, d.x);
    DVec4::new((0.25 / PI).sqrt(), band.x, band.y, band.z)
}

/// ⟨d,ω⟩₊ in two bands: √π/2, and √(π/3) (y, z, x).
pub(crate) fn cosine_lobe(d: DVec3) -> DVec4 {
    let band = (PI / 3.0).sqrt() * DVec3::new(d.y, d.z, d.x);
    DVec4::new(0.5 * PI.sqrt(), band.x, band.y, band.z)
}

fn add_lobe(to: &mut Lobe, peak: DVec4, direction: DVec3) {
    for (own, lobe) in to.iter_mut().zip(cosine_lobe(direction).to_array()) {
        *own += lobe * peak;
    }
}

/// I(ω) / h².
pub fn intensity(lobe: &Lobe, direction: DVec3) -> DVec4 {
    let basis = basis(direction).to_array();
    lobe.iter().zip(basis).map(|(c, y)| y * *c).sum()
}

/// What cells send at first: I(ω) = Σ (Φ/π) ⟨n,ω⟩₊, and what the opaque faces send.
pub fn seed(
    grid: &CellGrid,
    (flux, power): (&[[DVec3; 3]], &[DVec3]),
    faces: &[u32],
    side: &dyn Fn(usize, u32) -> DVec4,
) -> Vec<Lobe> {
    let peak = 1.0 / (PI * f64::from(grid.cell_size).powi(2));
    let [zero, one] = [0.5 * PI.sqrt(), (PI / 3.0).sqrt()];
    let cell = |index: usize| {
        let mut lobe = [DVec4::ZERO; 4];
        lobe[0] = (peak * zero * power[index]).extend(0.0);
        for (coefficient, axis) in [(1, 1), (2, 2), (3, 0)] {
            let along = flux[index].map(|vector| vector[axis]);
            lobe[coefficient] = (peak * one * DVec3::from(along)).extend(0.0);
        }
        for face in (0..6).filter(|face| faces[index] >> face & 1 == 1) {
            add_lobe(&mut lobe, side(index, face), -axis_direction(face));
        }
        lobe
    };
    (0..grid.count() as usize).map(cell).collect()
}

/// Solid angles of the far face and of a side one, 1½ and about 1 cell away (sr).
pub(crate) fn solid_angles() -> [f64; 2] {
    let far = 4.0 * (0.25 / (1.5 * 2.75f64.sqrt())).atan();
    [far, 0.25 * (4.0 * PI / 6.0 - far)]
}

/// Mean of the four nodes around the middle of a face.
pub(super) fn blocking(grid: &CellGrid, blockers: &[DVec4], cell: UVec3, face: u32) -> DVec4 {
    let (nodes, axis) = (nodes(grid), (face / 2) as usize);
    let mut sum = DVec4::ZERO;
    for corner in 0..4u32 {
        let mut node = cell;
        node[axis] += face & 1;
        node[(axis + 1) % 3] += corner & 1;
        node[(axis + 2) % 3] += corner >> 1;
        sum += 0.25 * blockers[nodes.index(node)];
    }
    sum
}

/// What goes into a cell through each of its faces.
pub(crate) fn streams() -> &'static [DMat4; 6] {
    static STREAMS: OnceLock<[DMat4; 6]> = OnceLock::new();
    STREAMS.get_or_init(|| [0, 1, 2, 3, 4, 5].map(|face| stream(-axis_direction(face))))
}

/// A step of all cells, the first being 1, from what the step before has left.
pub fn step(grid: &CellGrid, steps: &Steps<'_>, before: &[Lobe], number: u32) -> Vec<Lobe> {
    let settings = &steps.settings;
    let outside = if number == 1 {
        let mut lobe = [DVec4::ZERO; 4];
        lobe[0].w = 6.0 * PI * basis(DVec3::X).x;
        lobe
    } else {
        [DVec4::ZERO; 4]
    };
    let [far, aside] = solid_angles();
    let cell = |index: u32| {
        let cell = UVec3::new(
            index % grid.size.x,
            index / grid.size.x % grid.size.y,
            index / (grid.size.x * grid.size.y),
        );
        let word = match steps.occlusion {
            Occlusion::Faces => steps.faces[grid.index(cell)],
            Occlusion::None | Occlusion::Fuzzy => 0,
        };
        let mut arrived = [DVec4::ZERO; 4];
        for face in (0..6).filter(|face| word >> face & 1 == 0) {
            let onwards = -axis_direction(face);
            let next = neighbour(grid, cell, face);
            let sent = next.map_or(&outside, |next| &before[grid.index(next)]);
            let blocking = if steps.occlusion == Occlusion::Fuzzy && number > 1 {
                blocking(grid, steps.blockers, cell, face)
            } else {
                DVec4::ZERO
            };
            let passing = |d: DVec3| 1.0 - blocking.dot(basis(-d)).clamp(0.0, 1.0);
            let mut hand_on = |direction: DVec3, towards: DVec3, solid: f64| {
                let mut flux = solid * intensity(sent, direction);
                if settings.clamp_negative {
                    flux = flux.max(DVec4::ZERO);
                }
                add_lobe(&mut arrived, passing(direction) / PI * flux, towards);
            };
            match settings.scheme {
                Scheme::Lobes30 => {
                    hand_on(onwards, onwards, far);
                    for other in (0..6).filter(|other| other / 2 != face / 2) {
                        let side = axis_direction(other);
                        hand_on((onwards + 0.5 * side).normalize(), side, aside);
                    }
                }
                Scheme::Axis6 => hand_on(onwards, onwards, 2.0 * PI / 3.0),
                Scheme::Stream => {
                    let [r, g, b, a] = [0, 1, 2, 3].map(|channel| {
                        streams()[face as usize] * DVec4::from(sent.map(|c| c[channel]))
                    });
                    for (i, own) in arrived.iter_mut().enumerate() {
                        *own += passing(onwards) * DVec4::new(r[i], g[i], b[i], a[i]);
                    }
                }
            }
        }
        arrived.map(|c| f64::from(settings.gain) * c)
    };
    (0..grid.count()).map(cell).collect()
}

/// The sum of all steps, with what cells sent at first.
pub fn propagate(grid: &CellGrid, steps: &Steps<'_>, first: &[Lobe]) -> Vec<Lobe> {
    let (mut sum, mut before) = (first.to_vec(), first.to_vec());
    for number in 1..=steps.settings.iterations {
        before = step(grid, steps, &before, number);
        for (sum, own) in sum.iter_mut().zip(&before) {
            for (sum, own) in sum.iter_mut().zip(own) {
                *sum += *own;
            }
        }
    }
    sum
}

/// As radiance by the directions that light comes from: L = (2/3) I / h².
pub fn finish(sum: &[Lobe]) -> Vec<[DVec4; 9]> {
    let cell = |lobe: &Lobe| {
        let mut light = [DVec4::ZERO; 9];
        for (i, c) in lobe.iter().enumerate() {
            light[i] = if i == 0 { 2.0 } else { -2.0 } / 3.0 * *c;
        }
        light
    };
    sum.iter().map(cell).collect()
}
