//! The charts of a benchmark.

use crate::graph::PassTimes;
use crate::text::counted;

use super::draw::{Bar, BarPanel, Chart, LineAxis, LinePanel, Panels, Scale, Series};
use super::report::{Report, Timing};
use super::table::{case_name, median_ms, resolution, value_text};

/// Error of the indirect light against resolution, a series a technique and preset; `None` where no
/// report has an error.
pub fn error_chart(reports: &[Report]) -> Option<Chart> {
    let block = |report: &Report| {
        report
            .error
            .as_ref()
            .map(|error| error.block.unwrap_or(error.pixel))
    };
    let noise = reports
        .iter()
        .find_map(|report| report.reference.as_ref())
        .map(|reference| {
            (
                reference.pixel_noise / 8.0,
                "the reference's noise".to_owned(),
            )
        });
    let aov = reports
        .iter()
        .find_map(|report| Some(&report.error.as_ref()?.aov));
    let what = match aov {
        Some(aov) if aov == "visibility" => "ambient visibility",
        _ => "indirect light",
    };
    let panels = vec![
        LinePanel {
            y_label: format!("rel_rmse of {what}"),
            y_scale: Scale::Log,
            series: series(reports, |report| Some(block(report)?.rel_rmse)),
            floor: noise,
        },
        LinePanel {
            y_label: format!("bias of {what}"),
            y_scale: Scale::Linear,
            series: series(reports, |report| Some(block(report)?.bias)),
            floor: Some((0.0, "no bias".into())),
        },
    ];
    lines(
        "Error against resolution",
        "8×8-pixel blocks against the path-traced reference",
        reports,
        panels,
    )
}

/// Memory and bytes a cell of the grid against resolution; `None` where nothing ran.
pub fn memory_chart(reports: &[Report]) -> Option<Chart> {
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let refused = |report: &Report| report.refused.as_ref().map(|refused| mib(refused.bytes));
    let per_cell = |report: &Report| {
        Some(report.structure_bytes? as f64 / f64::from(resolution(report)?).powi(3))
    };
    let panels = vec![
        LinePanel {
            y_label: "technique's memory [MiB]".into(),
            y_scale: Scale::Log,
            series: [
                series(reports, |report| report.structure_bytes.map(mib)),
                refused_series(reports, refused),
            ]
            .concat(),
            floor: None,
        },
        LinePanel {
            y_label: "bytes per cell of the grid".into(),
            y_scale: Scale::Log,
            series: series(reports, per_cell),
            floor: None,
        },
    ];
    lines(
        "Memory against resolution",
        "world-space structure; screen images, maps and scene left out",
        reports,
        panels,
    )
}

/// What the device refused to allocate, against resolution.
fn refused_series(reports: &[Report], value: impl Fn(&Report) -> Option<f64>) -> Vec<Series> {
    let mut all = series_of(
        reports.iter().filter(|report| report.failure.is_some()),
        value,
    );
    all.iter_mut().for_each(|series| series.name += ", refused");
    all
}

/// Median time of each pass, stacked: builds above, frames below; `None` where nothing ran.
pub fn passes_chart(reports: &[Report]) -> Option<Chart> {
    let ran: Vec<&Report> = reports
        .iter()
        .filter(|report| report.failure.is_none())
        .collect();
    let first = ran.first()?;
    let panel = |x_label: &str, rows: fn(&Report) -> &[PassTimes]| {
        let bars: Vec<Bar> = ran
            .iter()
            .map(|report| Bar {
                label: case_name(report),
                parts: parts(rows(report)),
            })
            .collect();
        BarPanel {
            x_label: x_label.into(),
            bars: merge_small(bars),
        }
    };
    let panels = vec![
        panel("build, once [ms]", |report| &report.build),
        panel("frame [ms]", |report| &report.passes),
    ];
    let panels: Vec<BarPanel> = panels
        .into_iter()
        .filter(|panel| panel.bars.iter().any(|bar| !bar.parts.is_empty()))
        .collect();
    let count = |rows: &[PassTimes]| rows.first().map_or(0, |row| row.gpu_ms.n);
    let what = format!(
        "medians of {} and {}, {}x{} px",
        counted(count(&first.build), "build"),
        counted(count(&first.passes), "frame"),
        first.size[0],
        first.size[1]
    );
    Some(Chart {
        title: format!("Time per pass: {}", first.scene),
        notes: notes(reports, first, &what),
        panels: Panels::Bars(panels),
    })
}

/// Time to bring the structure up to the dynamic models, against the cells that they touch, beside
/// the time of building all of it; `None` where nothing moved among cells.
pub fn motion_chart(reports: &[Report]) -> Option<Chart> {
    let moved: Vec<&Report> = reports
        .iter()
        .filter(|report| report.motion.iter().any(|row| row.dynamic_voxels > Some(0)))
        .collect();
    let first = moved.first()?;
    let points = |report: &Report| {
        let mut points: Vec<(f64, f64)> = report
            .motion
            .iter()
            .filter_map(|row| Some((row.dynamic_voxels? as f64, row.gpu_ms.median)))
            .collect();
        points.retain(|point| point.0 > 0.0);
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    };
    let series = moved
        .iter()
        .map(|report| Series {
            name: case_name(report),
            points: points(report),
        })
        .collect();
    let build = median_ms(&first.totals, "build")
        .map(|ms| (ms, format!("building all of {}", case_name(first))));
    let panel = LinePanel {
        y_label: "time of an update [ms]".into(),
        y_scale: Scale::Linear,
        series,
        floor: build,
    };
    let count = first.motion.first().map_or(0, |row| row.gpu_ms.n);
    let notes = notes(
        reports,
        first,
        &format!("medians of {} a point", counted(count, "update")),
    );
    Some(Chart {
        title: format!("Time of dynamic models: {}", first.scene),
        notes,
        panels: Panels::Lines(
            LineAxis::doubling("cells that dynamic models touch"),
            vec![panel],
        ),
    })
}

fn parts(rows: &[PassTimes]) -> Vec<(String, f64)> {
    rows.iter()
        .map(|row| (row.name.clone(), row.gpu_ms.median))
        .collect()
}

/// Passes that are nowhere more than 1% of the longest bar become one part.
fn merge_small(bars: Vec<Bar>) -> Vec<Bar> {
    let longest = bars
        .iter()
        .map(|bar| bar.parts.iter().map(|part| part.1).sum::<f64>())
        .fold(0.0, f64::max);
    let all: Vec<(String, f64)> = bars
        .iter()
        .flat_map(|bar| bar.parts.iter().cloned())
        .collect();
    let is_small = |name: &str| {
        all.iter()
            .filter(|part| part.0 == name)
            .all(|part| part.1 < 0.01 * longest)
    };
    let merge = |bar: Bar| {
        let (small, mut parts): (Vec<_>, Vec<_>) =
            bar.parts.into_iter().partition(|part| is_small(&part.0));
        if !small.is_empty() {
            parts.push(("other".into(), small.iter().map(|part| part.1).sum()));
        }
        Bar {
            label: bar.label,
            parts,
        }
    };
    bars.into_iter().map(merge).collect()
}

/// A value against resolution, a series for each technique and preset.
pub(super) fn series(reports: &[Report], value: impl Fn(&Report) -> Option<f64>) -> Vec<Series> {
    series_of(
        reports.iter().filter(|report| report.failure.is_none()),
        value,
    )
}

/// Technique and preset.
pub(super) fn series_name(report: &Report) -> String {
    [Some(report.technique.as_str()), report.preset.as_deref()]
        .into_iter()
        .flatten()
        .collect::<Vec<_>>()
        .join(" ")
}

fn series_of<'r>(
    reports: impl Iterator<Item = &'r Report>,
    value: impl Fn(&Report) -> Option<f64>,
) -> Vec<Series> {
    let mut all: Vec<Series> = Vec::new();
    for report in reports {
        let (Some(resolution), Some(value)) = (resolution(report), value(report)) else {
            continue;
        };
        let name = series_name(report);
        let point = (f64::from(resolution), value);
        match all.iter_mut().find(|series| series.name == name) {
            Some(series) => series.points.push(point),
            None => all.push(Series {
                name,
                points: vec![point],
            }),
        }
    }
    all.iter_mut()
        .for_each(|series| series.points.sort_by(|a, b| a.0.total_cmp(&b.0)));
    all
}

pub(super) fn lines(
    title: &str,
    what: &str,
    reports: &[Report],
    panels: Vec<LinePanel>,
) -> Option<Chart> {
    let first = reports.iter().find(|report| report.failure.is_none())?;
    if panels.iter().all(|panel| panel.series.is_empty()) {
        return None;
    }
    let what = format!("{what}, {}x{} px", first.size[0], first.size[1]);
    Some(Chart {
        title: format!("{title}: {}", first.scene),
        notes: notes(reports, first, &what),
        panels: Panels::Lines(LineAxis::doubling("resolution [cells]"), panels),
    })
}

/// Characters on a line of a chart's notes.
const NOTE_CHARS: usize = 120;

/// Where the numbers are from: one report's device, driver and commit, and the settings that all
/// reports have alike.
pub(super) fn notes(reports: &[Report], report: &Report, what: &str) -> Vec<String> {
    let timing = match report.timing {
        Some(Timing::Host) => ", passes timed on the host",
        Some(Timing::Timestamps) => ", passes timed by timestamps",
        None => "",
    };
    let commit = report
        .commit
        .as_ref()
        .map(|commit| format!(" ({commit})"))
        .unwrap_or_default();
    let mut lines = vec![
        what.to_owned(),
        format!(
            "{}, {}{timing}; lumivox {}{commit}",
            report.device, report.driver, report.version
        ),
    ];
    let is_common = |(name, value): &(&String, &_)| {
        reports
            .iter()
            .all(|report| report.settings.get(*name).is_none_or(|own| own == *value))
    };
    let all: std::collections::BTreeMap<_, _> =
        reports.iter().flat_map(|report| &report.settings).collect();
    let settings = all
        .into_iter()
        .filter(is_common)
        .map(|(name, value)| format!("{name}={}", value_text(value)));
    let shadow = report
        .shadow_resolution
        .map(|texels| format!("shadow_resolution={texels}"));
    let shadows = report.shadows.iter();
    let shadow = shadow
        .into_iter()
        .chain(shadows.map(|(name, value)| format!("{name}={value}")));
    let mut line = "settings:".to_owned();
    for setting in shadow.chain(settings) {
        if line.chars().count() + setting.len() > NOTE_CHARS {
            lines.push(std::mem::take(&mut line));
        }
        line += &format!(" {setting}");
    }
    lines.push(line);
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_parts_are_merged_but_not_lost() {
        let bar = |parts: &[(&str, f64)]| Bar {
            label: String::new(),
            parts: parts
                .iter()
                .map(|(name, value)| ((*name).to_owned(), *value))
                .collect(),
        };
        let merged = merge_small(vec![
            bar(&[("a", 99.0), ("b", 0.5), ("c", 0.25)]),
            bar(&[("b", 10.0)]),
        ]);
        assert_eq!(
            merged[0].parts,
            [
                ("a".to_owned(), 99.0),
                ("b".to_owned(), 0.5),
                ("other".to_owned(), 0.25)
            ]
        );
        assert_eq!(merged[1].parts, [("b".to_owned(), 10.0)]);
    }
}
