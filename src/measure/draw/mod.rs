//! Charts: lines, stacked bars and points with their Pareto front, drawn once for SVG and for PNG.

mod axis;
mod lines;
mod points;

use std::path::{Path, PathBuf};
use std::sync::Once;

use crate::output::{write_file, write_text};
use crate::text::quoted;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use plotters::coord::Shift;
use plotters::prelude::*;

pub(in crate::measure) use crate::text::short;
use lines::{draw_bars, draw_lines};
use points::{draw_marker, draw_points, point_panel_height};

/// Points with one name.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// What the points stand for; their entry in the key.
    pub name: String,
    /// x and y of each point, in the units of the axes.
    pub points: Vec<(f64, f64)>,
}

/// How the values of an axis are spread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal steps are equally long.
    Linear,
    /// By their logarithm; values must be above 0.
    Log,
}

/// The axis that lines are drawn over.
#[derive(Clone, Debug, PartialEq)]
pub struct LineAxis {
    /// What it is, with its unit.
    pub label: String,
    /// Where its ticks are.
    pub ticks: Ticks,
}

/// Where an axis has ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ticks {
    /// At powers of two, all evenly spaced; values must be above 0.
    Doubling,
    /// At powers of ten, all evenly spaced; values must be above 0.
    Decades,
    /// At round numbers.
    Linear,
}

impl LineAxis {
    /// An axis with ticks at powers of two.
    pub fn doubling(label: impl Into<String>) -> Self {
        LineAxis {
            label: label.into(),
            ticks: Ticks::Doubling,
        }
    }
}

/// One pair of axes with lines.
#[derive(Clone, Debug, PartialEq)]
pub struct LinePanel {
    /// What y is, with its unit.
    pub y_label: String,
    /// How y is spread.
    pub y_scale: Scale,
    /// The lines. Lines with the same name have the same colour in all panels.
    pub series: Vec<Series>,
    /// A grey line at this y, and what it is.
    pub floor: Option<(f64, String)>,
}

/// Parts on top of each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// What the bar is.
    pub label: String,
    /// Names and lengths. Parts with the same name have the same colour in all panels.
    pub parts: Vec<(String, f64)>,
}

/// One axis with horizontal bars, the first on top.
#[derive(Clone, Debug, PartialEq)]
pub struct BarPanel {
    /// What the length is, with its unit.
    pub x_label: String,
    /// The bars, from the top down.
    pub bars: Vec<Bar>,
}

/// A point of a Pareto front.
#[derive(Clone, Debug, PartialEq)]
pub struct FrontPoint {
    /// x and y, in the units of the axes.
    pub at: (f64, f64),
    /// Smallest and largest x that was measured.
    pub x_range: (f64, f64),
    /// What stands beside it and before its entry in the key; without one it is grey and has no
    /// entry.
    pub mark: Option<String>,
    /// What it is: the lines of its entry in the key beside the axes.
    pub label: Vec<String>,
}

/// One pair of logarithmic axes with points; values must be above 0.
#[derive(Clone, Debug, PartialEq)]
pub struct PointPanel {
    /// What the points have alike.
    pub title: String,
    /// What x is, with its unit.
    pub x_label: String,
    /// What y is, with its unit.
    pub y_label: String,
    /// The points. Points with the same name have the same colour and shape in all panels.
    pub series: Vec<Series>,
    /// The points that no other beats, by rising x: joined by steps.
    pub front: Vec<FrontPoint>,
    /// A grey line at this y, and what it is.
    pub floor: Option<(f64, String)>,
}

/// The panels of a chart.
#[derive(Clone, Debug, PartialEq)]
pub enum Panels {
    /// Lines side by side, and what they are over.
    Lines(LineAxis, Vec<LinePanel>),
    /// Stacked bars, one panel above the other.
    Bars(Vec<BarPanel>),
    /// Points, one panel above the other, over the same ranges.
    Points(Vec<PointPanel>),
}

/// One picture of one or more panels.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// The title line above the panels.
    pub title: String,
    /// Where it is from: device, driver, commit, scene, settings; a line each.
    pub notes: Vec<String>,
    /// The panels, all of one kind.
    pub panels: Panels,
}

/// A chart that could not be drawn or written.
#[derive(Debug, thiserror::Error)]
pub enum ChartError {
    /// The drawing failed.
    #[error("cannot draw the chart {}: {problem}", quoted(title))]
    Draw {
        /// Title of the chart.
        title: String,
        /// What the drawing library said.
        problem: String,
    },
    /// The file cannot be written.
    #[error("cannot write the chart {}: {problem}", path.display())]
    Write {
        /// The file that was to be written.
        path: PathBuf,
        /// What the system said.
        problem: String,
    },
}

/// Colours that also differ for the colour-blind (Okabe & Ito 2008), then darker and lighter ones
/// of the same hues.
const COLORS: [RGBColor; 20] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(213, 94, 0),
    RGBColor(86, 180, 233),
    RGBColor(204, 121, 167),
    RGBColor(240, 228, 66),
    RGBColor(90, 90, 90),
    RGBColor(0, 57, 89),
    RGBColor(128, 88, 0),
    RGBColor(0, 79, 58),
    RGBColor(110, 48, 0),
    RGBColor(102, 60, 84),
    RGBColor(170, 170, 170),
    RGBColor(150, 200, 230),
    RGBColor(250, 210, 140),
    RGBColor(140, 210, 190),
    RGBColor(240, 180, 140),
    RGBColor(230, 190, 215),
    RGBColor(150, 145, 40),
];

const WIDTH_PX: u32 = 1000;
const TEXT_PX: i32 = 14;
const LINE_PX: i32 = 20;
const MARGIN_PX: i32 = 14;

fn color(index: usize) -> RGBColor {
    COLORS[index % COLORS.len()]
}

type Drawn<DB, T = ()> = Result<T, DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

/// A place in a chart, in the units of its SVG's `viewBox`.
pub type Place = (i32, i32);

impl Chart {
    /// Writes `STEM.svg` and `STEM.png`.
    pub fn write(&self, stem: &Path) -> Result<[PathBuf; 2], ChartError> {
        let [svg, png] = ["svg", "png"].map(|extension| stem.with_extension(extension));
        self.write_svg(&svg)?;
        self.write_png(&png)?;
        Ok([svg, png])
    }

    /// Writes an SVG file.
    pub fn write_svg(&self, path: &Path) -> Result<(), ChartError> {
        write_text(path, &self.svg()?).map_err(|error| ChartError::Write {
            path: path.to_owned(),
            problem: error.to_string(),
        })
    }

    /// Writes a PNG file.
    pub fn write_png(&self, path: &Path) -> Result<(), ChartError> {
        let (width, height) = self.size();
        let pixels = self.pixels()?;
        let saved: Result<(), image::ImageError> = write_file(path, |file| {
            PngEncoder::new(file).write_image(&pixels, width, height, ExtendedColorType::Rgb8)
        });
        saved.map_err(|error| ChartError::Write {
            path: path.to_owned(),
            problem: error.to_string(),
        })
    }

    /// As an SVG document.
    pub fn svg(&self) -> Result<String, ChartError> {
        Ok(self.svg_and_places()?.0)
    }

    /// As an SVG document, and where each of the [`Panels::Points`] lies: panel after panel, series
    /// after series.
    pub fn svg_and_places(&self) -> Result<(String, Vec<Place>), ChartError> {
        let mut text = String::new();
        let area = SVGBackend::with_string(&mut text, self.size()).into_drawing_area();
        let places = self.draw(&area).map_err(|error| self.failed(&error))?;
        drop(area);
        Ok((text, places))
    }

    /// As 8-bit RGB pixels, row 0 at the top.
    pub fn pixels(&self) -> Result<Vec<u8>, ChartError> {
        let (width, height) = self.size();
        let mut pixels = vec![255; 3 * width as usize * height as usize];
        let area = BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area();
        self.draw(&area).map_err(|error| self.failed(&error))?;
        drop(area);
        Ok(pixels)
    }

    fn failed(&self, problem: &dyn std::fmt::Display) -> ChartError {
        ChartError::Draw {
            title: self.title.clone(),
            problem: problem.to_string(),
        }
    }

    /// Width and height (px).
    pub fn size(&self) -> (u32, u32) {
        let panels: u32 = match &self.panels {
            Panels::Lines(..) => 430,
            Panels::Bars(panels) => panels.iter().map(bar_panel_height).sum(),
            Panels::Points(panels) => panels.iter().map(point_panel_height).sum(),
        };
        (
            WIDTH_PX,
            panels + self.header_height() as u32 + MARGIN_PX as u32,
        )
    }

    fn header_height(&self) -> i32 {
        let legend = legend_places(&self.names())
            .last()
            .map_or(0, |place| place.1 + LINE_PX);
        MARGIN_PX + 30 + LINE_PX * self.notes.len() as i32 + legend + 8
    }

    /// Names of series or parts, each once.
    fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        let mut add = |name| {
            if !names.contains(&name) {
                names.push(name);
            }
        };
        match &self.panels {
            Panels::Lines(_, panels) => panels
                .iter()
                .flat_map(|panel| &panel.series)
                .for_each(|series| add(series.name.as_str())),
            Panels::Bars(panels) => {
                panels
                    .iter()
                    .flat_map(|panel| &panel.bars)
                    .flat_map(|bar| &bar.parts)
                    .for_each(|(name, _)| add(name.as_str()));
            }
            Panels::Points(panels) => panels
                .iter()
                .flat_map(|panel| &panel.series)
                .for_each(|series| add(series.name.as_str())),
        }
        names
    }

    /// Draws everything, and returns where each point of the panels lies.
    fn draw<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawn<DB, Vec<Place>> {
        register_font();
        area.fill(&WHITE)?;
        let names = self.names();
        area.draw(&Text::new(
            self.title.clone(),
            (MARGIN_PX, MARGIN_PX),
            ("sans-serif", 20),
        ))?;
        for (line, note) in self.notes.iter().enumerate() {
            let at = (MARGIN_PX, MARGIN_PX + 30 + LINE_PX * line as i32);
            area.draw(&Text::new(
                note.clone(),
                at,
                ("sans-serif", TEXT_PX)
                    .into_font()
                    .color(&RGBColor(90, 90, 90)),
            ))?;
        }
        let top = MARGIN_PX + 30 + LINE_PX * self.notes.len() as i32 + 4;
        for (index, (name, (x, y))) in names.iter().zip(legend_places(&names)).enumerate() {
            let (x, y) = (x + MARGIN_PX, y + top);
            match &self.panels {
                Panels::Points(_) => draw_marker(area, (x + 6, y + 7), index)?,
                _ => area.draw(&Rectangle::new(
                    [(x, y + 1), (x + 12, y + 13)],
                    color(index).filled(),
                ))?,
            }
            area.draw(&Text::new(
                (*name).to_owned(),
                (x + 18, y),
                ("sans-serif", TEXT_PX),
            ))?;
        }
        let (_, below) = area.split_vertically(self.header_height());
        let mut places = Vec::new();
        match &self.panels {
            Panels::Lines(axis, panels) => {
                for (panel, area) in panels
                    .iter()
                    .zip(below.split_evenly((1, panels.len().max(1))))
                {
                    draw_lines(&area, axis, panel, &names)?;
                }
            }
            Panels::Bars(panels) => {
                let mut rest = below;
                for panel in panels {
                    let (area, after) = rest.split_vertically(bar_panel_height(panel));
                    draw_bars(&area, panel, &names)?;
                    rest = after;
                }
            }
            Panels::Points(panels) => {
                let mut rest = below;
                for panel in panels {
                    let (area, after) = rest.split_vertically(point_panel_height(panel));
                    places.extend(draw_points(&area, panel, panels, &names)?);
                    rest = after;
                }
            }
        }
        area.present()?;
        Ok(places)
    }
}

/// The bundled font; drawing text fails without one.
pub(in crate::measure) fn register_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        if plotters::style::register_font("sans-serif", FontStyle::Normal, dejavu::sans::regular())
            .is_err()
        {
            log::error!("the font of the charts cannot be read");
        }
    });
}

/// Where each name of the legend goes, left to right and down; widths are generous, because every
/// viewer has its own font.
fn legend_places(names: &[&str]) -> Vec<(i32, i32)> {
    let (mut x, mut y) = (0, 0);
    let place = |name: &&str| {
        let width = 40 + 9 * name.chars().count() as i32;
        if x > 0 && x + width > WIDTH_PX as i32 - 2 * MARGIN_PX {
            (x, y) = (0, y + LINE_PX);
        }
        let place = (x, y);
        x += width;
        place
    };
    names.iter().map(place).collect()
}

fn bar_panel_height(panel: &BarPanel) -> u32 {
    26 * panel.bars.len().max(1) as u32 + 70
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(points: Vec<(f64, f64)>) -> Chart {
        let panel = |y_scale| LinePanel {
            y_label: "error".into(),
            y_scale,
            series: vec![Series {
                name: "a".into(),
                points: points.clone(),
            }],
            floor: Some((0.01, "noise".into())),
        };
        Chart {
            title: "t".into(),
            notes: vec!["n".into()],
            panels: Panels::Lines(
                LineAxis::doubling("x"),
                vec![panel(Scale::Log), panel(Scale::Linear)],
            ),
        }
    }

    /// No points, one point, zeros on a logarithmic axis: a picture all the same.
    #[test]
    fn little_data_is_drawn() -> Result<(), ChartError> {
        for points in [
            vec![],
            vec![(64.0, 0.2)],
            vec![(64.0, 0.0), (128.0, f64::NAN), (256.0, 0.1)],
        ] {
            let chart = lines(points);
            let (width, height) = chart.size();
            assert!(chart.svg()?.contains("</svg>"));
            assert_eq!(chart.pixels()?.len(), 3 * (width * height) as usize);
        }
        Ok(())
    }

    /// A part that is there can be seen, in its own colour.
    #[test]
    fn bars_show_their_parts() -> Result<(), ChartError> {
        let bar = |parts: &[(&str, f64)]| Bar {
            label: "case".into(),
            parts: parts
                .iter()
                .map(|(name, value)| ((*name).to_owned(), *value))
                .collect(),
        };
        let chart = |bar| Chart {
            title: "t".into(),
            notes: vec![],
            panels: Panels::Bars(vec![BarPanel {
                x_label: "ms".into(),
                bars: vec![bar],
            }]),
        };
        let area = |pixels: &[u8], RGBColor(r, g, b): RGBColor| {
            pixels
                .as_chunks()
                .0
                .iter()
                .filter(|pixel| **pixel == [r, g, b])
                .count()
        };
        let both = chart(bar(&[("a", 3.0), ("b", 1.0)])).pixels()?;
        let (a, b) = (area(&both, color(0)), area(&both, color(1)));
        assert!(a > 2 * b && a < 4 * b && b > 100, "{a} and {b} pixels");
        assert_eq!(area(&chart(bar(&[("a", 3.0)])).pixels()?, color(1)), 0);
        Ok(())
    }

    /// Text is drawn too: without a font the title would leave no dark pixel.
    #[test]
    fn text_is_drawn() -> Result<(), ChartError> {
        let pixels = lines(vec![]).pixels()?;
        let title_rows = 3 * WIDTH_PX as usize * 40;
        assert!(pixels[..title_rows].iter().any(|value| *value < 128));
        Ok(())
    }
}
