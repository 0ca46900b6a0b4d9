//! The charts that set structures side by side: time per stage, and time per direction.

use super::draw::{Bar, BarPanel, Chart, LinePanel, Panels, Scale};
use super::figures::{lines, notes, series, series_name};
use super::report::Report;
use super::stages::{When, construction};
use super::table::resolution;
use crate::text::counted;

/// Time of each stage of the world-space store, stacked, a panel a technique and preset; `None`
/// where nothing was built.
pub fn stages_chart(reports: &[Report]) -> Option<Chart> {
    let label = |report: &Report| {
        resolution(report).map_or_else(|| "all".to_owned(), |resolution| resolution.to_string())
    };
    chart("Time per stage", reports, series_name, label)
}

/// The same, a panel a resolution, so that techniques lie side by side; `None` where nothing was
/// built.
pub fn structures_chart(reports: &[Report]) -> Option<Chart> {
    let panel = |report: &Report| {
        resolution(report).map_or_else(
            || "no resolution".to_owned(),
            |resolution| format!("{resolution}³ cells"),
        )
    };
    chart("Structures side by side", reports, panel, series_name)
}

fn chart(
    title: &str,
    reports: &[Report],
    panel: fn(&Report) -> String,
    label: impl Fn(&Report) -> String,
) -> Option<Chart> {
    let built: Vec<&Report> = reports
        .iter()
        .filter(|report| report.failure.is_none() && !construction(report).is_empty())
        .collect();
    let first = built.first()?;
    let names = stage_names(&built);
    let mut panels: Vec<BarPanel> = Vec::new();
    for report in &built {
        let times = construction(report);
        // Every bar has every stage, so that charts of one run agree in their colours.
        let part = |name: &&str| {
            (
                (*name).to_owned(),
                times
                    .iter()
                    .find(|(known, _)| known == name)
                    .map_or(0.0, |(_, ms)| *ms),
            )
        };
        let bar = Bar {
            label: label(report),
            parts: names.iter().map(part).collect(),
        };
        let x_label = format!("{} [ms]", panel(report));
        match panels.iter_mut().find(|panel| panel.x_label == x_label) {
            Some(panel) => panel.bars.push(bar),
            None => panels.push(BarPanel {
                x_label,
                bars: vec![bar],
            }),
        }
    }
    let count = |when: When| {
        first
            .stages
            .iter()
            .find(|stage| stage.when == when)
            .map_or(0, |stage| stage.gpu_ms.n)
    };
    let what = format!(
        "world-space store, geometry and light anew each frame: medians of {} + {}",
        counted(count(When::Build), "build"),
        counted(count(When::Frame), "update")
    );
    Some(Chart {
        title: format!("{title}: {}", first.scene),
        notes: notes(reports, first, &what),
        panels: Panels::Bars(panels),
    })
}

/// Names of all stages, in the order of the technique that has most of them.
fn stage_names<'r>(reports: &[&'r Report]) -> Vec<&'r str> {
    let mut all: Vec<Vec<&str>> = reports
        .iter()
        .map(|report| construction(report).iter().map(|part| part.0).collect())
        .collect();
    all.sort_by_key(|names| std::cmp::Reverse(names.len()));
    let mut names = Vec::new();
    for name in all.into_iter().flatten() {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// Time of one direction at one pixel, of one sample, and of the whole store, against
/// resolution; `None` where nothing ran.
pub fn directions_chart(reports: &[Report]) -> Option<Chart> {
    let store = |report: &Report| {
        Some(construction(report).iter().map(|part| part.1).sum::<f64>()).filter(|ms| *ms > 0.0)
    };
    let panels = vec![
        LinePanel {
            y_label: "gather: µs per pixel and direction".into(),
            y_scale: Scale::Log,
            series: series(reports, |report| {
                report.directions.first().map(|cost| cost.us_per_direction)
            }),
            floor: None,
        },
        LinePanel {
            y_label: "gather: µs per sample".into(),
            y_scale: Scale::Log,
            series: series(reports, |report| {
                report
                    .directions
                    .first()
                    .and_then(|cost| cost.us_per_sample)
            }),
            floor: None,
        },
        LinePanel {
            y_label: "store: build + update [ms]".into(),
            y_scale: Scale::Log,
            series: series(reports, store),
            floor: None,
        },
    ];
    lines(
        "Time against resolution",
        "medians; a direction is a beam of a pixel that sees a surface, a sample is a \
         step of a beam",
        reports,
        panels,
    )
}
