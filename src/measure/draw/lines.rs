//! Panels onto a drawing area.

use plotters::coord::Shift;
use plotters::coord::ranged1d::SegmentValue;
use plotters::prelude::*;

use super::axis::{Axis, linear_ticks, log_ticks, range};
use super::{Bar, BarPanel, Drawn, LineAxis, LinePanel, MARGIN_PX, Scale, TEXT_PX, Ticks, color};
use crate::text::short;

/// Lines over a number; `names` gives the colours.
pub(super) fn draw_lines<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    axis: &LineAxis,
    panel: &LinePanel,
    names: &[&str],
) -> Drawn<DB> {
    let usable = |y: f64| y.is_finite() && (panel.y_scale == Scale::Linear || y > 0.0);
    let points = || {
        panel
            .series
            .iter()
            .flat_map(|series| &series.points)
            .copied()
            .filter(|point| usable(point.1))
    };
    let floor = panel
        .floor
        .iter()
        .map(|floor| floor.0)
        .filter(|y| usable(*y));
    // Place along the axis, and the number that is there.
    let place = |value: f64| match axis.ticks {
        Ticks::Doubling => value.log2(),
        Ticks::Decades => value.log10(),
        Ticks::Linear => value,
    };
    let number = |place: f64| match axis.ticks {
        Ticks::Doubling => place.exp2(),
        Ticks::Decades => 10f64.powf(place),
        Ticks::Linear => place,
    };
    let places = range(points().map(|point| place(point.0)), Scale::Linear);
    let x = if axis.ticks == Ticks::Linear {
        places
    } else {
        places.start.min(places.start.round() - 0.15)..places.end.max(places.end.round() + 0.15)
    };
    let y = range(
        points().map(|point| point.1).chain(floor.clone()),
        panel.y_scale,
    );
    let x_ticks = if axis.ticks == Ticks::Linear {
        linear_ticks(&x)
    } else {
        (x.start.ceil() as i32..=x.end.floor() as i32)
            .map(f64::from)
            .collect()
    };
    let y_ticks = if panel.y_scale == Scale::Log {
        log_ticks(&y)
    } else {
        linear_ticks(&y)
    };
    let mut builder = ChartBuilder::on(area);
    builder
        .margin(MARGIN_PX)
        .margin_top(4)
        .x_label_area_size(44)
        .y_label_area_size(70);
    let mut chart = builder.build_cartesian_2d(
        Axis {
            range: x.clone(),
            scale: Scale::Linear,
            ticks: x_ticks,
        },
        Axis {
            range: y,
            scale: panel.y_scale,
            ticks: y_ticks,
        },
    )?;
    // Zeros without end collide.
    let is_long = |at: f64| axis.ticks == Ticks::Decades && !(-3.5..4.5).contains(&at);
    let x_text = |at: &f64| {
        if is_long(*at) {
            format!("1e{at}")
        } else {
            short(number(*at))
        }
    };
    let mut mesh = chart.configure_mesh();
    mesh.disable_x_mesh()
        .max_light_lines(0)
        .x_label_formatter(&x_text)
        .y_label_formatter(&|y| short(*y));
    mesh.x_desc(axis.label.as_str())
        .y_desc(panel.y_label.as_str())
        .label_style(("sans-serif", TEXT_PX))
        .bold_line_style(RGBColor(225, 225, 225))
        .draw()?;
    if let (Some((_, what)), Some(y)) = (&panel.floor, floor.clone().next()) {
        let grey = RGBColor(120, 120, 120);
        chart.draw_series(DashedLineSeries::new(
            [(x.start, y), (x.end, y)],
            5,
            4,
            grey.stroke_width(1),
        ))?;
        let style = ("sans-serif", 12).into_font().color(&grey);
        chart.draw_series([
            EmptyElement::at((x.start, y)) + Text::new(what.clone(), (6, -15), style)
        ])?;
    }
    for (index, series) in panel.series.iter().enumerate() {
        // Later lines are thinner, so that one that lies under another can be seen.
        let wider = (panel.series.len() - 1 - index).min(4) as u32;
        let color = color(
            names
                .iter()
                .position(|name| *name == series.name)
                .unwrap_or(0),
        );
        let points: Vec<(f64, f64)> = series
            .points
            .iter()
            .filter(|point| usable(point.1))
            .map(|(x, y)| (place(*x), *y))
            .collect();
        chart.draw_series(LineSeries::new(
            points.iter().copied(),
            color.stroke_width(2 + wider),
        ))?;
        chart.draw_series(
            points
                .iter()
                .map(|point| Circle::new(*point, 4 + wider, color.filled())),
        )?;
    }
    Ok(())
}

/// Stacked horizontal bars; `names` gives the colours.
pub(super) fn draw_bars<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    panel: &BarPanel,
    names: &[&str],
) -> Drawn<DB> {
    let length = |bar: &Bar| bar.parts.iter().map(|part| part.1).sum::<f64>();
    let longest = panel.bars.iter().map(length).fold(0.0, f64::max).max(1e-9);
    let lengths = Axis {
        range: 0.0..1.12 * longest,
        scale: Scale::Linear,
        ticks: linear_ticks(&(0.0..1.12 * longest)),
    };
    let count = panel.bars.len().max(1);
    let widest = panel
        .bars
        .iter()
        .map(|bar| bar.label.chars().count())
        .max()
        .unwrap_or(0) as u32;
    let mut builder = ChartBuilder::on(area);
    builder
        .margin(MARGIN_PX)
        .margin_top(4)
        .margin_right(40)
        .x_label_area_size(44)
        .y_label_area_size(30 + 8 * widest);
    let mut chart = builder.build_cartesian_2d(lengths, (0..count - 1).into_segmented())?;
    let name = |segment: &SegmentValue<usize>| match segment {
        SegmentValue::CenterOf(index) => panel
            .bars
            .iter()
            .rev()
            .nth(*index)
            .map(|bar| bar.label.clone())
            .unwrap_or_default(),
        _ => String::new(),
    };
    let mut mesh = chart.configure_mesh();
    mesh.disable_y_mesh()
        .y_labels(count + 1)
        .y_label_formatter(&name)
        .x_label_formatter(&|x| short(*x));
    mesh.x_desc(panel.x_label.as_str())
        .label_style(("sans-serif", TEXT_PX))
        .bold_line_style(RGBColor(225, 225, 225))
        .draw()?;
    for (index, bar) in panel.bars.iter().rev().enumerate() {
        let mut start = 0.0;
        for (part, value) in &bar.parts {
            let color = color(names.iter().position(|name| name == part).unwrap_or(0));
            let above = if index + 1 == count {
                SegmentValue::Last
            } else {
                SegmentValue::Exact(index + 1)
            };
            let mut rectangle = Rectangle::new(
                [(start, SegmentValue::Exact(index)), (start + value, above)],
                color.filled(),
            );
            rectangle.set_margin(4, 4, 0, 0);
            chart.draw_series([rectangle])?;
            start += value;
        }
        let end = EmptyElement::at((start, SegmentValue::CenterOf(index)))
            + Text::new(short(start), (5, -7), ("sans-serif", 12));
        chart.draw_series([end])?;
    }
    Ok(())
}
