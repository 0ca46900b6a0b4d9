//! Points and their Pareto front onto a drawing area.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::prelude::*;

use super::axis::{Axis, log_ticks, range};
use super::{
    Drawn, FrontPoint, MARGIN_PX, Place, PointPanel, Scale, TEXT_PX, WIDTH_PX, color, short,
};

/// Width of the key beside the axes.
const KEY_PX: i32 = 350;
const KEY_TEXT_PX: i32 = 12;
const KEY_LINE_PX: i32 = 15;
const KEY_GAP_PX: i32 = 7;
/// Height of the panel's title.
const TITLE_PX: i32 = 26;
/// Radius of a point.
const MARKER_PX: i32 = 5;

const DARK: RGBColor = RGBColor(60, 60, 60);
const GREY: RGBColor = RGBColor(120, 120, 120);
const PALE: RGBColor = RGBColor(190, 190, 190);

/// Height of a panel: at least that of readable axes, and enough for its key.
pub(super) fn point_panel_height(panel: &PointPanel) -> u32 {
    let key: i32 = panel
        .front
        .iter()
        .filter(|point| point.mark.is_some())
        .map(entry_height)
        .sum();
    (TITLE_PX + (key + 2 * KEY_LINE_PX).max(370)) as u32
}

fn entry_height(point: &FrontPoint) -> i32 {
    KEY_LINE_PX * point.label.len().max(1) as i32 + KEY_GAP_PX
}

/// The marker of the series of this index, in its colour and shape.
pub(super) fn draw_marker<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    at: (i32, i32),
    index: usize,
) -> Drawn<DB> {
    area.draw(&Polygon::new(outline(at, index), color(index).filled()))
}

/// A disc, square, triangle, diamond or triangle on its tip.
fn outline((x, y): (i32, i32), index: usize) -> Vec<(i32, i32)> {
    let r = MARKER_PX;
    let corners: Vec<(i32, i32)> = match index % 5 {
        0 => (0..16)
            .map(|i| f64::from(i).mul_add(std::f64::consts::TAU / 16.0, 0.2))
            .map(|a| {
                (
                    rounded(f64::from(r), a.cos()),
                    rounded(f64::from(r), a.sin()),
                )
            })
            .collect(),
        1 => vec![(-r, -r), (r, -r), (r, r), (-r, r)],
        2 => vec![(0, -r - 1), (r + 1, r), (-r - 1, r)],
        3 => vec![(0, -r - 2), (r + 2, 0), (0, r + 2), (-r - 2, 0)],
        _ => vec![(0, r + 1), (r + 1, -r), (-r - 1, -r)],
    };
    corners
        .into_iter()
        .map(|(dx, dy)| (x + dx, y + dy))
        .collect()
}

fn rounded(radius: f64, share: f64) -> i32 {
    (radius * share).round() as i32
}

/// Points over the ranges of all panels; `names` gives colours and shapes. Returns where each
/// point of each series lies.
pub(super) fn draw_points<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    panel: &PointPanel,
    all: &[PointPanel],
    names: &[&str],
) -> Drawn<DB, Vec<Place>> {
    let [x, y] = ranges(all);
    let (plot, key) = area.split_horizontally(WIDTH_PX as i32 - KEY_PX);
    plot.draw(&Text::new(
        panel.title.clone(),
        (MARGIN_PX, 4),
        ("sans-serif", 16),
    ))?;
    let mut builder = ChartBuilder::on(&plot);
    builder
        .margin(MARGIN_PX)
        .margin_top(TITLE_PX)
        .x_label_area_size(44)
        .y_label_area_size(70);
    let axis = |range: Range<f64>| Axis {
        ticks: log_ticks(&range),
        range,
        scale: Scale::Log,
    };
    let mut chart = builder.build_cartesian_2d(axis(x.clone()), axis(y.clone()))?;
    let mut mesh = chart.configure_mesh();
    mesh.max_light_lines(0)
        .x_label_formatter(&|x| short(*x))
        .y_label_formatter(&|y| short(*y))
        .bold_line_style(RGBColor(232, 232, 232));
    mesh.x_desc(panel.x_label.as_str())
        .y_desc(panel.y_label.as_str())
        .label_style(("sans-serif", TEXT_PX))
        .draw()?;
    if let Some((floor, what)) = panel.floor.as_ref().filter(|floor| y.contains(&floor.0)) {
        chart.draw_series(DashedLineSeries::new(
            [(x.start, *floor), (x.end, *floor)],
            5,
            4,
            GREY.stroke_width(1),
        ))?;
        let style = ("sans-serif", KEY_TEXT_PX).into_font().color(&GREY);
        chart.draw_series([
            EmptyElement::at((x.start, *floor)) + Text::new(what.clone(), (6, -15), style)
        ])?;
    }
    chart.draw_series(LineSeries::new(
        steps(&panel.front, &x, &y),
        DARK.stroke_width(2),
    ))?;
    for series in &panel.series {
        let index = names
            .iter()
            .position(|name| *name == series.name)
            .unwrap_or(0);
        let marks = series.points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0);
        chart.draw_series(marks.map(|at| {
            EmptyElement::at(*at)
                + Polygon::new(outline((0, 0), index), color(index).mix(0.75).filled())
        }))?;
    }
    let whisker = |point: &FrontPoint| {
        PathElement::new(
            [(point.x_range.0, point.at.1), (point.x_range.1, point.at.1)],
            DARK.stroke_width(1),
        )
    };
    chart.draw_series(
        panel
            .front
            .iter()
            .filter(|point| point.mark.is_some())
            .map(whisker),
    )?;
    let grey = panel.front.iter().filter(|point| point.mark.is_none());
    chart.draw_series(
        grey.map(|point| {
            EmptyElement::at(point.at) + Circle::new((0, 0), MARKER_PX, PALE.filled())
        }),
    )?;
    let pixel = |at: &(f64, f64)| chart.backend_coord(at);
    let points: Vec<Place> = panel
        .series
        .iter()
        .flat_map(|series| &series.points)
        .map(pixel)
        .collect();
    let marked: Vec<(&FrontPoint, &str)> = panel
        .front
        .iter()
        .filter_map(|point| Some((point, point.mark.as_deref()?)))
        .collect();
    let front: Vec<((i32, i32), i32)> = marked
        .iter()
        .map(|(point, mark)| (pixel(&point.at), mark_width(mark)))
        .collect();
    let (columns, rows) = chart.plotting_area().get_pixel_range();
    let frame = Rect {
        left: columns.start,
        top: rows.start,
        right: columns.end,
        bottom: rows.end,
    };
    for ((point, mark), (dx, dy)) in marked.iter().zip(mark_places(&front, &points, &frame)) {
        if dx.abs().max(dy.abs()) > NEAR_PX {
            chart.draw_series([
                EmptyElement::at(point.at) + PathElement::new([(0, 0), (dx, dy)], GREY)
            ])?;
        }
        let text = Text::new(
            (*mark).to_owned(),
            (dx - mark_width(mark) / 2, dy - 7),
            ("sans-serif", TEXT_PX).into_font().color(&BLACK),
        );
        chart.draw_series([EmptyElement::at(point.at) + text])?;
    }
    draw_key(&key, panel)?;
    Ok(points)
}

/// What the marks of the front are.
fn draw_key<DB: DrawingBackend>(area: &DrawingArea<DB, Shift>, panel: &PointPanel) -> Drawn<DB> {
    let mut top = TITLE_PX;
    for (point, mark) in panel
        .front
        .iter()
        .filter_map(|point| Some((point, point.mark.as_ref()?)))
    {
        area.draw(&Text::new(mark.clone(), (0, top), ("sans-serif", TEXT_PX)))?;
        for (line, text) in point.label.iter().enumerate() {
            let shade = if line == 0 {
                BLACK
            } else {
                RGBColor(90, 90, 90)
            };
            let style = ("sans-serif", KEY_TEXT_PX).into_font().color(&shade);
            area.draw(&Text::new(
                text.clone(),
                (32, top + KEY_LINE_PX * line as i32),
                style,
            ))?;
        }
        top += entry_height(point);
    }
    Ok(())
}

/// Ranges of x and y that hold everything in all panels.
fn ranges(panels: &[PointPanel]) -> [Range<f64>; 2] {
    let points = || {
        panels
            .iter()
            .flat_map(|panel| &panel.series)
            .flat_map(|series| series.points.iter().copied())
            .filter(|(x, y)| *x > 0.0 && *y > 0.0)
    };
    let spread = panels
        .iter()
        .flat_map(|panel| &panel.front)
        .flat_map(|point| [point.x_range.0, point.x_range.1])
        .filter(|x| *x > 0.0);
    let floors = panels
        .iter()
        .filter_map(|panel| panel.floor.as_ref())
        .map(|floor| floor.0)
        .filter(|y| *y > 0.0);
    [
        range(points().map(|point| point.0).chain(spread), Scale::Log),
        range(points().map(|point| point.1).chain(floors), Scale::Log),
    ]
}

/// The border of what the front beats: down to each point and on to the next one's x.
fn steps(front: &[FrontPoint], x: &Range<f64>, y: &Range<f64>) -> Vec<(f64, f64)> {
    let mut path = Vec::new();
    let mut height = y.end;
    for point in front {
        path.extend([(point.at.0, height), point.at]);
        height = point.at.1;
    }
    if !front.is_empty() {
        path.push((x.end, height));
    }
    path
}

#[derive(Clone, Copy, Debug)]
struct Rect {
    left: i32,
    top: i32,
    right: i32,
    bottom: i32,
}

impl Rect {
    fn around((x, y): (i32, i32), width: i32, height: i32) -> Self {
        Rect {
            left: x - width / 2,
            top: y - height / 2,
            right: x + width / 2,
            bottom: y + height / 2,
        }
    }

    /// Pixels that both cover.
    fn overlap(&self, other: &Rect) -> i32 {
        let width = self.right.min(other.right) - self.left.max(other.left);
        let height = self.bottom.min(other.bottom) - self.top.max(other.top);
        width.max(0) * height.max(0)
    }

    fn area(&self) -> i32 {
        self.overlap(self)
    }
}

/// Distance up to which a mark needs no line to its point.
const NEAR_PX: i32 = 16;

fn mark_width(mark: &str) -> i32 {
    9 * mark.chars().count() as i32
}

/// Where the mark of each point of the front stands, as the offset of its middle from the point: as
/// near as it can without covering points or other marks or leaving the frame, and where that is
/// impossible with the least overlap. `front` is points and widths of their marks.
fn mark_places(
    front: &[((i32, i32), i32)],
    points: &[(i32, i32)],
    frame: &Rect,
) -> Vec<(i32, i32)> {
    let mut taken: Vec<Rect> = points
        .iter()
        .map(|at| Rect::around(*at, 2 * MARKER_PX + 2, 2 * MARKER_PX + 2))
        .collect();
    let mut places = Vec::new();
    // Below and left of the front there are no points.
    let directions = [
        (-1, 1),
        (-1, 0),
        (0, 1),
        (1, 1),
        (-1, -1),
        (1, 0),
        (0, -1),
        (1, -1),
    ];
    for (at, width) in front {
        let offsets = [12, 15, 20, 26, 34, 44, 56]
            .into_iter()
            .flat_map(|distance| directions.map(|(dx, dy)| (dx * distance, dy * distance)));
        let rect = |(dx, dy): (i32, i32)| Rect::around((at.0 + dx, at.1 + dy), *width, 13);
        let covered = |offset: &(i32, i32)| {
            let rect = rect(*offset);
            taken.iter().map(|other| rect.overlap(other)).sum::<i32>() + rect.area()
                - rect.overlap(frame)
        };
        // The first of the best.
        let place = offsets.min_by_key(covered).unwrap_or((0, 0));
        taken.push(rect(place));
        places.push(place);
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(front: &[(f64, f64)]) -> PointPanel {
        let point = |at: &(f64, f64)| FrontPoint {
            at: *at,
            x_range: *at,
            mark: Some("T1".into()),
            label: vec!["a point".into()],
        };
        PointPanel {
            title: String::new(),
            x_label: String::new(),
            y_label: String::new(),
            series: Vec::new(),
            front: front.iter().map(point).collect(),
            floor: None,
        }
    }

    #[test]
    fn steps_go_down_at_each_point() {
        let path = steps(
            &panel(&[(1.0, 8.0), (3.0, 2.0)]).front,
            &(0.5..9.0),
            &(1.0..10.0),
        );
        assert_eq!(
            path,
            [(1.0, 10.0), (1.0, 8.0), (3.0, 8.0), (3.0, 2.0), (9.0, 2.0)]
        );
        assert!(steps(&[], &(0.5..9.0), &(1.0..10.0)).is_empty());
    }

    /// A crowd of points: marks cover neither points nor each other, and stay in the frame.
    #[test]
    fn marks_do_not_collide() {
        let frame = Rect {
            left: 0,
            top: 0,
            right: 500,
            bottom: 300,
        };
        let front: Vec<(i32, i32)> = (0..12).map(|i| (4 + 9 * i, 40 + 11 * i)).collect();
        let others: Vec<(i32, i32)> = (0..40)
            .map(|i| (60 + 10 * i, 40 + (37 * i) % 120))
            .filter(|at| at.1 < at.0)
            .collect();
        let points = [front.clone(), others].concat();
        let marked: Vec<_> = front
            .iter()
            .enumerate()
            .map(|(index, at)| (*at, mark_width(&format!("T{}", index + 1))))
            .collect();
        let places = mark_places(&marked, &points, &frame);
        let rects: Vec<Rect> = marked
            .iter()
            .zip(&places)
            .map(|((at, width), (dx, dy))| Rect::around((at.0 + dx, at.1 + dy), *width, 13))
            .collect();
        for (index, rect) in rects.iter().enumerate() {
            assert_eq!(
                rect.overlap(&frame),
                rect.area(),
                "mark {} leaves the frame",
                index + 1
            );
            assert!(
                points.iter().all(|at| rect.overlap(&Rect::around(
                    *at,
                    2 * MARKER_PX,
                    2 * MARKER_PX
                )) == 0),
                "mark {} covers a point",
                index + 1
            );
            assert!(
                rects[..index].iter().all(|other| rect.overlap(other) == 0),
                "mark {} covers another",
                index + 1
            );
        }
    }

    #[test]
    fn a_long_key_makes_the_panel_higher() {
        let few = point_panel_height(&panel(&[(1.0, 1.0)]));
        let many = point_panel_height(&panel(&[(1.0, 1.0); 30]));
        assert!(few < 450 && many > 30 * (KEY_LINE_PX + KEY_GAP_PX) as u32);
        let mut unmarked = panel(&[(1.0, 1.0); 30]);
        unmarked
            .front
            .iter_mut()
            .for_each(|point| point.mark = None);
        assert_eq!(
            point_panel_height(&unmarked),
            few,
            "what has no mark has no entry in the key"
        );
    }
}
