//! Slices of grids: a closed curve a cell, as far from its centre as the cell sends intensity
//! there (Olovsson 2012, figure 9).

use std::path::{Path, PathBuf};

use glam::{DVec3, UVec3};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use plotters::coord::Shift;
use plotters::prelude::*;

use crate::gi::lpv::CellGrid;
use crate::gi::lpv::oracle::simulator::{Run, Shape};
use crate::gi::shared::sh;
use crate::measure::draw::{ChartError, register_font};
use crate::output::{write_file, write_text};

/// Directions of a curve.
const POINTS: usize = 48;
/// Width and height of all cells together, about (px).
const GRID_PX: u32 = 832;
/// Above the cells (px).
const HEADER_PX: i32 = 50;
const MARGIN_PX: i32 = 12;
/// Steps of a pixel in which curves are drawn: whole pixels would be too coarse for small cells.
const ZOOM: i32 = 4;

const POSITIVE: RGBColor = RGBColor(0, 114, 178);
const NEGATIVE: RGBColor = RGBColor(213, 94, 0);
const WALL: RGBColor = RGBColor(20, 20, 20);
const LEVEL_BORDER: RGBColor = RGBColor(120, 120, 120);
const GRID_LINE: RGBColor = RGBColor(224, 224, 224);

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

/// A slice, ready to be drawn.
pub struct SlicePicture {
    title: String,
    /// Finest cells across and up.
    size: [u32; 2],
    /// Edge of the cells that have lines around them (finest cells).
    step: u32,
    curves: Vec<Curve>,
    largest: f64,
    spread: Spread,
    walls: Vec<Line>,
    borders: Vec<Line>,
}

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

impl SlicePicture {
    /// What a slice of a run shows.
    pub fn new(run: &Run, slice: Slice, shown: Shown, spread: Spread) -> Self {
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
        let cell_of = |first, second| {
            let mut cell = UVec3::ZERO;
            (cell[u], cell[v], cell[slice.axis]) = (first, second, slice.index / edge);
            cell
        };
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
                let shape = shape_of(own.grid.index(cell_of(first, second)));
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
        SlicePicture {
            title: format!(
                "{}: {name_of_shown}, {} = {}, after {} steps",
                run.propagator.name,
                name(slice.axis),
                slice.index,
                run.steps()
            ),
            size: [finest.size[u], finest.size[v]],
            step: edge,
            walls: walls(&own.grid, &own.faces, slice, edge),
            borders: match shown {
                Shown::Merged => borders(finest, &run.index, slice),
                Shown::Level(..) => Vec::new(),
            },
            curves,
            largest,
            spread,
        }
    }

    /// Writes `STEM.svg` and `STEM.png`.
    pub fn write(&self, stem: &Path) -> Result<[PathBuf; 2], ChartError> {
        register_font();
        let [svg, png] = ["svg", "png"].map(|extension| {
            let mut name = stem.as_os_str().to_owned();
            name.push(".");
            name.push(extension);
            PathBuf::from(name)
        });
        let failed = |path: &Path, problem: String| ChartError::Write {
            path: path.to_owned(),
            problem,
        };
        let undrawn = |problem: String| ChartError::Draw {
            title: self.title.clone(),
            problem,
        };
        let (width, height) = self.size_px();
        let (zoomed_width, zoomed_height) = (width * ZOOM as u32, height * ZOOM as u32);
        let mut text = String::new();
        let area =
            SVGBackend::with_string(&mut text, (zoomed_width, zoomed_height)).into_drawing_area();
        self.draw(&area)
            .map_err(|error| undrawn(error.to_string()))?;
        drop(area);
        // The view box stays: shown at its size, drawn in steps of a fraction of a pixel.
        let text = text.replacen(
            &format!("width=\"{zoomed_width}\" height=\"{zoomed_height}\""),
            &format!("width=\"{width}\" height=\"{height}\""),
            1,
        );
        write_text(&svg, &text).map_err(|error| failed(&svg, error.to_string()))?;
        let mut pixels = vec![255; 3 * zoomed_width as usize * zoomed_height as usize];
        let area = BitMapBackend::with_buffer(&mut pixels, (zoomed_width, zoomed_height))
            .into_drawing_area();
        self.draw(&area)
            .map_err(|error| undrawn(error.to_string()))?;
        drop(area);
        let pixels = shrunk(&pixels, width as usize, height as usize);
        let saved: Result<(), image::ImageError> = write_file(&png, |file| {
            PngEncoder::new(file).write_image(&pixels, width, height, ExtendedColorType::Rgb8)
        });
        saved.map_err(|error| failed(&png, error.to_string()))?;
        Ok([svg, png])
    }

    fn cell_px(&self) -> i32 {
        (GRID_PX / self.size[0].max(self.size[1])).max(6) as i32
    }

    fn size_px(&self) -> (u32, u32) {
        let [width, height] = self.size.map(|cells| cells * self.cell_px() as u32);
        let margins = 2 * MARGIN_PX as u32;
        // The title needs room too.
        (
            (width + margins).max(560),
            height + margins + HEADER_PX as u32,
        )
    }

    fn scale_text(&self) -> String {
        let largest = crate::measure::draw::short(self.largest);
        match self.spread {
            Spread::Linear => format!("largest {largest} W/(m² sr); negative in orange"),
            Spread::Log(decades) => format!(
                "largest {largest} W/(m² sr), logarithmic over {decades} powers of ten; negative \
                 in orange"
            ),
        }
    }

    /// Of an intensity, as a share of half a cell.
    fn length(&self, intensity: f64) -> f64 {
        let share = if self.largest > 0.0 {
            intensity / self.largest
        } else {
            0.0
        };
        match self.spread {
            Spread::Linear => share,
            Spread::Log(decades) => (1.0 + share.log10() / decades).max(0.0),
        }
    }

    fn draw<DB: DrawingBackend>(
        &self,
        area: &DrawingArea<DB, Shift>,
    ) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
        area.fill(&WHITE)?;
        let text = |size| ("sans-serif", size * ZOOM);
        let at = |x: i32, y: i32| (ZOOM * x, ZOOM * y);
        area.draw(&Text::new(
            self.title.clone(),
            at(MARGIN_PX, MARGIN_PX),
            text(18),
        ))?;
        let grey = text(13).into_font().color(&RGBColor(90, 90, 90));
        area.draw(&Text::new(
            self.scale_text(),
            at(MARGIN_PX, MARGIN_PX + 24),
            grey,
        ))?;
        let cell = f64::from(self.cell_px() * ZOOM);
        let top = f64::from(ZOOM * (HEADER_PX + MARGIN_PX));
        let place = |[x, y]: [f64; 2]| {
            let up = f64::from(self.size[1]) - y;
            (
                (f64::from(ZOOM * MARGIN_PX) + cell * x).round() as i32,
                (top + cell * up).round() as i32,
            )
        };
        let corner = |(x, y): (u32, u32)| place([f64::from(x), f64::from(y)]);
        let [width, height] = self.size;
        let line = |ends: [(i32, i32); 2], color: RGBColor, px: i32| {
            PathElement::new(ends.to_vec(), color.stroke_width((px * ZOOM) as u32))
        };
        for x in (0..=width).filter(|x| x % self.step == 0 || *x == width) {
            area.draw(&line([corner((x, 0)), corner((x, height))], GRID_LINE, 1))?;
        }
        for y in (0..=height).filter(|y| y % self.step == 0 || *y == height) {
            area.draw(&line([corner((0, y)), corner((width, y))], GRID_LINE, 1))?;
        }
        for border in &self.borders {
            area.draw(&line(border.map(corner), LEVEL_BORDER, 2))?;
        }
        for curve in &self.curves {
            for (sign, color) in [(1.0, POSITIVE), (-1.0, NEGATIVE)] {
                let radius = |intensity: f64| self.length((sign * intensity).max(0.0));
                let lengths = curve.intensity.map(radius);
                if lengths.iter().all(|length| *length == 0.0) {
                    continue;
                }
                let point = |(index, length): (usize, &f64)| {
                    let angle = std::f64::consts::TAU * index as f64 / POINTS as f64;
                    let reach = 0.5 * curve.edge * length;
                    let [x, y] = curve.centre;
                    place([x + reach * angle.cos(), y + reach * angle.sin()])
                };
                let outline: Vec<(i32, i32)> = lengths.iter().enumerate().map(point).collect();
                area.draw(&Polygon::new(outline.clone(), color.mix(0.45).filled()))?;
                let closed = outline
                    .iter()
                    .chain(outline.first())
                    .copied()
                    .collect::<Vec<_>>();
                area.draw(&PathElement::new(closed, color.stroke_width(ZOOM as u32)))?;
            }
        }
        for wall in &self.walls {
            area.draw(&line(wall.map(corner), WALL, 3))?;
        }
        area.present()
    }
}

/// Each pixel the mean of a square of them.
fn shrunk(pixels: &[u8], width: usize, height: usize) -> Vec<u8> {
    let zoom = ZOOM as usize;
    let mean = |at: usize| {
        let (channel, x, y) = (at % 3, at / 3 % width, at / 3 / width);
        let sum: usize = (0..zoom * zoom)
            .map(|part| {
                let (x, y) = (zoom * x + part % zoom, zoom * y + part / zoom);
                usize::from(pixels[3 * (x + width * zoom * y) + channel])
            })
            .sum();
        (sum / (zoom * zoom)) as u8
    };
    (0..3 * width * height).map(mean).collect()
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
