//! Slices of grids: a closed curve a cell, as far from its centre as the cell sends intensity
//! there (Olovsson 2012, figure 9).

use glam::{DVec3, UVec3};

use super::{Run, Shape};
use crate::gi::lpv::CellGrid;
use crate::gi::shared::sh;
use crate::gi::simulator::{self, Drawing, Ink};
use crate::text::{counted, short};

/// Directions of a curve.
const POINTS: usize = 48;

const POSITIVE: Ink = ink([0, 114, 178], 1);
const NEGATIVE: Ink = ink([213, 94, 0], 1);
const WALL: Ink = ink([20, 20, 20], 3);
const LEVEL_BORDER: Ink = ink([120, 120, 120], 2);
const GRID_LINE: Ink = ink([224, 224, 224], 1);

const fn ink(rgb: [u8; 3], width_px: u32) -> Ink {
    Ink { rgb, width_px }
}

/// Cells of one place along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slice {
    /// 0 to 2.
    pub axis: usize,
    /// Of the finest cells.
    pub index: u32,
}

/// Which light of a level is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// What the last step has read.
    Source,
    /// What it has left.
    Target,
    /// All steps.
    Sum,
}

/// What of a run is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// A level.
    Level(usize, Which),
    /// All levels, as merged last.
    Merged,
}

/// How intensity becomes length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spread {
    /// In proportion.
    Linear,
    /// By its logarithm, over so many powers of ten below the largest.
    Log(f64),
}

/// A curve: centre and edge of its cell (finest cells), and its intensity along each direction.
struct Curve {
    centre: [f64; 2],
    edge: f64,
    intensity: [f64; POINTS],
}

/// A line between two corners of cells.
type Line = [(u32, u32); 2];

/// The axes that go to the right and up.
fn across(axis: usize) -> [usize; 2] {
    match axis {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    }
}

fn name(axis: usize) -> char {
    ['x', 'y', 'z'][axis]
}

/// Lengths of a curve's basis functions along its directions.
fn bases(axis: usize) -> [Shape; POINTS] {
    let [u, v] = across(axis);
    std::array::from_fn(|point| {
        let (sin, cos) = (std::f64::consts::TAU * point as f64 / POINTS as f64).sin_cos();
        let mut direction = DVec3::ZERO;
        (direction[u], direction[v]) = (cos, sin);
        let mut basis = [0.0; 9];
        sh::evaluate(3, direction, &mut basis);
        basis
    })
}

/// What a slice of a run shows.
pub fn draw_slice(run: &Run, slice: Slice, shown: Shown, spread: Spread) -> Drawing {
    let [u, v] = across(slice.axis);
    let finest = &run.levels[0].grid;
    let (level, name_of_shown) = match shown {
        Shown::Merged => (0, "merged".to_owned()),
        Shown::Level(level, which) => {
            let which = match which {
                Which::Source => "source",
                Which::Target => "target",
                Which::Sum => "sum",
            };
            (level, format!("level {level}, {which}"))
        }
    };
    let own = &run.levels[level];
    let edge = 1u32 << level;
    let size = [finest.size[u], finest.size[v]];
    let (curves, largest) = curves(run, slice, shown);
    let line = |[from, to]: Line, ink| {
        let place = |(x, y)| [f64::from(x), f64::from(y)];
        simulator::Shape::Line([place(from), place(to)], ink)
    };
    let [width, height] = size;
    let is_line = |at: &u32, end: u32| at.is_multiple_of(edge) || *at == end;
    let across = (0..=width).filter(|x| is_line(x, width));
    let up = (0..=height).filter(|y| is_line(y, height));
    let mut shapes: Vec<simulator::Shape> = across
        .map(|x| [(x, 0), (x, height)])
        .chain(up.map(|y| [(0, y), (width, y)]))
        .map(|ends| line(ends, GRID_LINE))
        .collect();
    if shown == Shown::Merged {
        let borders = borders(finest, &run.index, slice);
        shapes.extend(borders.into_iter().map(|ends| line(ends, LEVEL_BORDER)));
    }
    for curve in &curves {
        for (sign, ink) in [(1.0, POSITIVE), (-1.0, NEGATIVE)] {
            shapes.extend(star(curve, (sign, ink), (largest, spread)));
        }
    }
    let walls = walls(&own.grid, &own.faces, slice, edge);
    shapes.extend(walls.into_iter().map(|ends| line(ends, WALL)));
    Drawing {
        title: format!(
            "{}: {name_of_shown}, {} = {}, after {}",
            run.propagator.name,
            name(slice.axis),
            slice.index,
            counted(run.steps() as usize, "step")
        ),
        legend: legend(largest, spread),
        size,
        shapes,
    }
}

/// Of all cells of the slice, with the largest intensity among them.
fn curves(run: &Run, slice: Slice, shown: Shown) -> (Vec<Curve>, f64) {
    let [u, v] = across(slice.axis);
    let level = match shown {
        Shown::Merged => 0,
        Shown::Level(level, _) => level,
    };
    let own = &run.levels[level];
    let edge = 1u32 << level;
    let shape_of = |cell: usize| match shown {
        Shown::Merged => run.merged_shape(cell),
        Shown::Level(_, Which::Source) => own.source.shape(&own.grid, cell),
        Shown::Level(_, Which::Target) => own.target.shape(&own.grid, cell),
        Shown::Level(_, Which::Sum) => own.sum.shape(&own.grid, cell),
    };
    let bases = bases(slice.axis);
    let mut curves = Vec::new();
    let mut largest: f64 = 0.0;
    for second in 0..own.grid.size[v] {
        for first in 0..own.grid.size[u] {
            let mut cell = UVec3::ZERO;
            (cell[u], cell[v], cell[slice.axis]) = (first, second, slice.index / edge);
            let shape = shape_of(own.grid.index(cell));
            let intensity = bases.map(|basis| sh::inner_product(&basis, &shape));
            largest = intensity
                .iter()
                .fold(largest, |most, value| value.abs().max(most));
            curves.push(Curve {
                centre: [first, second].map(|at| f64::from(edge) * (f64::from(at) + 0.5)),
                edge: f64::from(edge),
                intensity,
            });
        }
    }
    (curves, largest)
}

/// The part of a curve of one sign; `None` where it has none.
fn star(curve: &Curve, (sign, ink): (f64, Ink), scale: (f64, Spread)) -> Option<simulator::Shape> {
    let lengths = curve
        .intensity
        .map(|intensity| length((sign * intensity).max(0.0), scale));
    let point = |(index, length): (usize, &f64)| {
        let angle = std::f64::consts::TAU * index as f64 / POINTS as f64;
        let reach = 0.5 * curve.edge * length;
        let [x, y] = curve.centre;
        [x + reach * angle.cos(), y + reach * angle.sin()]
    };
    let has_any = lengths.iter().any(|length| *length > 0.0);
    has_any.then(|| simulator::Shape::Star {
        centre: curve.centre,
        outline: lengths.iter().enumerate().map(point).collect(),
        ink,
    })
}

/// Of an intensity, as a share of half a cell.
fn length(intensity: f64, (largest, spread): (f64, Spread)) -> f64 {
    let share = if largest > 0.0 {
        intensity / largest
    } else {
        0.0
    };
    match spread {
        Spread::Linear => share,
        Spread::Log(decades) => (1.0 + share.log10() / decades).max(0.0),
    }
}

fn legend(largest: f64, spread: Spread) -> String {
    let largest = short(largest);
    match spread {
        Spread::Linear => format!("largest {largest} W/(m² sr); negative in orange"),
        Spread::Log(decades) => format!(
            "largest {largest} W/(m² sr), logarithmic over {decades} powers of ten; negative in \
             orange"
        ),
    }
}

/// Opaque faces that the slice cuts.
fn walls(grid: &CellGrid, faces: &[u32], slice: Slice, edge: u32) -> Vec<Line> {
    let [u, v] = across(slice.axis);
    let mut lines = Vec::new();
    for second in 0..grid.size[v] {
        for first in 0..grid.size[u] {
            let mut cell = UVec3::ZERO;
            (cell[u], cell[v], cell[slice.axis]) = (first, second, slice.index / edge);
            let word = faces[grid.index(cell)];
            let at = |x: u32, y: u32| (edge * x, edge * y);
            let (x, y) = (first, second);
            let sides = [
                (2 * u, [at(x, y), at(x, y + 1)]),
                (2 * u + 1, [at(x + 1, y), at(x + 1, y + 1)]),
                (2 * v, [at(x, y), at(x + 1, y)]),
                (2 * v + 1, [at(x, y + 1), at(x + 1, y + 1)]),
            ];
            lines.extend(
                sides
                    .into_iter()
                    .filter(|(bit, _)| word >> bit & 1 == 1)
                    .map(|s| s.1),
            );
        }
    }
    lines
}

/// Lines between cells of different levels.
fn borders(grid: &CellGrid, index: &[u32], slice: Slice) -> Vec<Line> {
    let [u, v] = across(slice.axis);
    let level = |first: u32, second: u32| {
        let mut cell = UVec3::ZERO;
        (cell[u], cell[v], cell[slice.axis]) = (first, second, slice.index);
        index[grid.index(cell)]
    };
    let mut lines = Vec::new();
    for y in 0..grid.size[v] {
        for x in 0..grid.size[u] {
            if x > 0 && level(x, y) != level(x - 1, y) {
                lines.push([(x, y), (x, y + 1)]);
            }
            if y > 0 && level(x, y) != level(x, y - 1) {
                lines.push([(x, y), (x + 1, y)]);
            }
        }
    }
    lines
}
