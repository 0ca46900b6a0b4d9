//! Drawings of a simulator as files.

use std::path::{Path, PathBuf};

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use plotters::coord::Shift;
use plotters::prelude::*;

use crate::gi::simulator::{Drawing, Ink, Shape};
use crate::measure::draw::{ChartError, register_font};
use crate::output::{write_file, write_text};

/// Width and height of all cells together, about (px).
const GRID_PX: u32 = 832;
/// Above the cells (px).
const HEADER_PX: i32 = 50;
const MARGIN_PX: i32 = 12;
/// Steps of a pixel in which curves are drawn: whole pixels would be too coarse for small cells.
const ZOOM: i32 = 4;

/// Writes a drawing to `STEM.svg` and `STEM.png`.
pub fn write_drawing(drawing: &Drawing, stem: &Path) -> Result<[PathBuf; 2], ChartError> {
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
        title: drawing.title.clone(),
        problem,
    };
    let (width, height) = size_px(drawing);
    let (zoomed_width, zoomed_height) = (width * ZOOM as u32, height * ZOOM as u32);
    let mut text = String::new();
    let area =
        SVGBackend::with_string(&mut text, (zoomed_width, zoomed_height)).into_drawing_area();
    draw(drawing, &area).map_err(|error| undrawn(error.to_string()))?;
    drop(area);
    // The view box stays: shown at its size, drawn in steps of a fraction of a pixel.
    let text = text.replacen(
        &format!("width=\"{zoomed_width}\" height=\"{zoomed_height}\""),
        &format!("width=\"{width}\" height=\"{height}\""),
        1,
    );
    write_text(&svg, &text).map_err(|error| failed(&svg, error.to_string()))?;
    let mut pixels = vec![255; 3 * zoomed_width as usize * zoomed_height as usize];
    let area =
        BitMapBackend::with_buffer(&mut pixels, (zoomed_width, zoomed_height)).into_drawing_area();
    draw(drawing, &area).map_err(|error| undrawn(error.to_string()))?;
    drop(area);
    let pixels = shrunk(&pixels, width as usize, height as usize);
    let saved: Result<(), image::ImageError> = write_file(&png, |file| {
        PngEncoder::new(file).write_image(&pixels, width, height, ExtendedColorType::Rgb8)
    });
    saved.map_err(|error| failed(&png, error.to_string()))?;
    Ok([svg, png])
}

fn cell_px(drawing: &Drawing) -> i32 {
    let [width, height] = drawing.size;
    (GRID_PX / width.max(height)).max(6) as i32
}

fn size_px(drawing: &Drawing) -> (u32, u32) {
    let [width, height] = drawing.size.map(|cells| cells * cell_px(drawing) as u32);
    let margins = 2 * MARGIN_PX as u32;
    // The title needs room too.
    (
        (width + margins).max(560),
        height + margins + HEADER_PX as u32,
    )
}

fn draw<DB: DrawingBackend>(
    drawing: &Drawing,
    area: &DrawingArea<DB, Shift>,
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    area.fill(&WHITE)?;
    let text = |size| ("sans-serif", size * ZOOM);
    let at = |x: i32, y: i32| (ZOOM * x, ZOOM * y);
    area.draw(&Text::new(
        drawing.title.clone(),
        at(MARGIN_PX, MARGIN_PX),
        text(18),
    ))?;
    let grey = text(13).into_font().color(&RGBColor(90, 90, 90));
    area.draw(&Text::new(
        drawing.legend.clone(),
        at(MARGIN_PX, MARGIN_PX + 24),
        grey,
    ))?;
    let cell = f64::from(cell_px(drawing) * ZOOM);
    let top = f64::from(ZOOM * (HEADER_PX + MARGIN_PX));
    let place = |[x, y]: [f64; 2]| {
        let up = f64::from(drawing.size[1]) - y;
        (
            (f64::from(ZOOM * MARGIN_PX) + cell * x).round() as i32,
            (top + cell * up).round() as i32,
        )
    };
    let line = |points: Vec<(i32, i32)>, ink: &Ink| {
        PathElement::new(points, colour(ink).stroke_width(ink.width_px * ZOOM as u32))
    };
    for shape in &drawing.shapes {
        match shape {
            Shape::Line(ends, ink) => area.draw(&line(ends.map(place).to_vec(), ink))?,
            Shape::Star { outline, ink, .. } => {
                let mut points: Vec<_> = outline.iter().copied().map(place).collect();
                let area_colour = colour(ink).mix(Shape::FILL).filled();
                area.draw(&Polygon::new(points.clone(), area_colour))?;
                points.extend(points.first().copied());
                area.draw(&line(points, ink))?;
            }
        }
    }
    area.present()
}

fn colour(ink: &Ink) -> RGBColor {
    let [red, green, blue] = ink.rgb;
    RGBColor(red, green, blue)
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
