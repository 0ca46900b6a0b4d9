//! Lines over steps.

use crate::gi::lpv::oracle::simulator::{Errors, Record, Recorder};
use crate::measure::draw::{Chart, LineAxis, LinePanel, Panels, Scale, Series, Ticks};

/// Lines of all recorders that have the number, over steps.
fn lines(recorders: &[Recorder], of: impl Fn(&Record) -> Option<f64>, more: &str) -> Vec<Series> {
    let series = |recorder: &Recorder| {
        // The last of the actions at each step.
        let mut points: Vec<(f64, f64)> = Vec::new();
        for record in &recorder.records {
            let Some(value) = of(record) else { continue };
            let x = f64::from(record.steps);
            points.retain(|point| point.0 != x);
            points.push((x, value));
        }
        Series {
            name: format!("{}{more}", recorder.run.propagator.name),
            points,
        }
    };
    recorders
        .iter()
        .map(series)
        .filter(|series| !series.points.is_empty())
        .collect()
}

fn chart(title: &str, notes: &[String], panels: Vec<LinePanel>) -> Option<Chart> {
    let has_lines = panels.iter().any(|panel| !panel.series.is_empty());
    has_lines.then(|| Chart {
        title: title.to_owned(),
        notes: notes.to_vec(),
        panels: Panels::Lines(
            LineAxis {
                label: "steps".to_owned(),
                ticks: Ticks::Linear,
            },
            panels,
        ),
    })
}

fn panel(y_label: &str, series: Vec<Series>) -> LinePanel {
    LinePanel {
        y_label: y_label.to_owned(),
        y_scale: Scale::Linear,
        series,
        floor: None,
    }
}

/// e_abs and e_rel (Olovsson 2012, figures 11 and 15) against the mean of the finer level, and
/// against that of a uniform grid; `None` where no run has levels.
pub fn error_chart(recorders: &[Recorder], notes: &[String]) -> Option<Chart> {
    let both = |of: &dyn Fn(&Errors) -> f64| {
        let mut all = lines(recorders, |record| record.within.as_ref().map(of), "");
        let to_uniform = |record: &Record| record.to_uniform.as_ref().map(of);
        all.extend(lines(recorders, to_uniform, ", to uniform"));
        all
    };
    chart(
        "Levels against the mean of finer cells",
        notes,
        vec![
            panel("e_abs [W/(m² sr)]", both(&|errors| errors.absolute)),
            panel("e_rel", both(&|errors| errors.relative)),
        ],
    )
}

/// Flux that is on its way, and how far its centre has moved.
pub fn flux_chart(recorders: &[Recorder], notes: &[String]) -> Option<Chart> {
    let flux = |record: &Record| Some(record.account.on_its_way);
    chart(
        "Flux on its way",
        notes,
        vec![
            panel("flux of all levels [W]", lines(recorders, flux, "")),
            panel(
                "its centre has moved [cells]",
                lines(recorders, |record| Some(record.moved_cells), ""),
            ),
        ],
    )
}

/// The merged grid against a uniform one of many steps; `None` without one.
pub fn reference_chart(recorders: &[Recorder], notes: &[String]) -> Option<Chart> {
    chart(
        "Merged grid against the uniform reference",
        notes,
        vec![panel(
            "rms difference / rms of the reference",
            lines(recorders, |record| record.to_reference, ""),
        )],
    )
}
