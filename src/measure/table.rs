//! Reports as a table to read, and as comma-separated values.

use std::fmt::Write as _;

use crate::gi::settings::{RESOLUTION, Value};
use crate::graph::{PassTimes, Spread};

use super::report::Report;
use super::stages::When;
use super::walk;

/// The median of a row of this name (ms).
pub fn median_ms(rows: &[PassTimes], name: &str) -> Option<f64> {
    rows.iter()
        .find(|row| row.name == name)
        .map(|row| row.gpu_ms.median)
}

/// A case's name: technique, preset and resolution, as far as it has them.
pub fn case_name(report: &Report) -> String {
    let mut name = report.technique.to_owned();
    report
        .preset
        .iter()
        .for_each(|preset| name.extend([" ", preset]));
    if let Some(resolution) = resolution(report) {
        // Writing to a string cannot fail.
        let _ = write!(name, " {resolution}");
    }
    name
}

/// The setting `resolution` (cells), where the technique has it.
pub fn resolution(report: &Report) -> Option<u32> {
    match report.settings.get(RESOLUTION) {
        Some(Value::Count(resolution)) => Some(*resolution),
        _ => None,
    }
}

/// A setting's value.
pub fn value_text(value: &Value) -> String {
    match value {
        Value::Count(value) => value.to_string(),
        Value::Number(value) => value.to_string(),
        Value::Choice(value) => (*value).to_owned(),
    }
}

/// The counting runs of the first build together (ms), where there were any.
pub fn counting_ms(report: &Report) -> Option<f64> {
    (!report.counting.is_empty()).then(|| report.counting.iter().map(|row| row.gpu_ms.median).sum())
}

/// The table's heading.
pub fn heading() -> String {
    format!(
        "{:<30} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8} {:>9} {:>8} {:>9} {:>9}",
        "case",
        "count",
        "build",
        "update",
        "gather",
        "frame",
        "still",
        "µs/dir",
        "µs/sample",
        "MiB",
        "bias",
        "rel_rmse"
    )
}

/// What the columns are.
pub const LEGEND: &str = "medians in ms; count: to find out sizes, before the first build; \
                          build: the store, once for static geometry; update: its light, every \
                          frame; still: a frame in which nothing but the camera moves; µs/dir: \
                          gather per pixel with a surface and direction; µs/sample: gather per \
                          sample of a beam; bias and rel_rmse: of what is compared, over blocks";

/// One row of the table.
pub fn row(report: &Report) -> String {
    let name = case_name(report);
    if let Some(failure) = &report.failure {
        return format!("{name:<30} {failure}");
    }
    let total = |name: &str| number(median_ms(&report.totals, name), 2);
    let block = report
        .error
        .as_ref()
        .map(|error| error.block.unwrap_or(error.pixel));
    format!(
        "{name:<30} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8} {:>9} {:>8.1} {:>9} {:>9}",
        number(counting_ms(report), 2),
        total("build"),
        total("update"),
        total("gather"),
        total("frame"),
        total("still"),
        number(
            report.directions.first().map(|cost| cost.us_per_direction),
            3
        ),
        number(
            report
                .directions
                .first()
                .and_then(|cost| cost.us_per_sample),
            4
        ),
        report.memory_bytes as f64 / f64::from(1 << 20),
        block.map_or("-".to_owned(), |block| format!("{:+.4}", block.bias)),
        number(block.map(|block| block.rel_rmse), 4),
    )
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}

/// All reports as comma-separated values (RFC 4180): a row a case, its medians in the columns; a
/// column for each name that any report has.
pub fn csv(reports: &[Report]) -> String {
    csv_of(&reports.iter().map(columns).collect::<Vec<_>>())
}

/// Rows of names and values: a column for each name that any row has, in the order in which they
/// come.
pub(super) fn csv_of(rows: &[Vec<(String, String)>]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in rows.iter().flatten() {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let mut text = line(names.iter().copied());
    for row in rows {
        text += &line(names.iter().map(|name| {
            row.iter()
                .find(|(key, _)| key == name)
                .map_or("", |(_, value)| value.as_str())
        }));
    }
    text
}

fn line<'f>(fields: impl Iterator<Item = &'f str>) -> String {
    let quoted = fields.map(|field| {
        if field.contains([',', '"', '\n', '\r']) {
            format!("\"{}\"", field.replace('"', "\"\""))
        } else {
            field.to_owned()
        }
    });
    quoted.collect::<Vec<_>>().join(",") + "\n"
}

/// Names and values of one row.
fn columns(report: &Report) -> Vec<(String, String)> {
    let mut columns: Vec<(String, String)> = Vec::new();
    let mut add = |name: String, value: String| columns.push((name, value));
    add("scene".into(), report.scene.clone());
    add("technique".into(), report.technique.clone());
    add("preset".into(), report.preset.clone().unwrap_or_default());
    add("width_px".into(), report.size[0].to_string());
    add("height_px".into(), report.size[1].to_string());
    add("device".into(), report.device.clone());
    add("driver".into(), report.driver.clone());
    add("commit".into(), report.commit.clone().unwrap_or_default());
    add(
        "timing".into(),
        report
            .timing
            .map_or("", |timing| {
                if timing == super::report::Timing::Host {
                    "host"
                } else {
                    "timestamps"
                }
            })
            .into(),
    );
    add("failure".into(), report.failure.clone().unwrap_or_default());
    add(
        "refused_bytes".into(),
        report
            .refused
            .as_ref()
            .map(|refused| refused.bytes.to_string())
            .unwrap_or_default(),
    );
    for (name, value) in &report.settings {
        add(format!("set {name}"), value_text(value));
    }
    if report.failure.is_some() {
        return columns;
    }
    add("memory_bytes".into(), report.memory_bytes.to_string());
    add(
        "bytes_per_occupied_voxel".into(),
        report
            .bytes_per_occupied_voxel
            .map(|bytes| format!("{bytes:.2}"))
            .unwrap_or_default(),
    );
    add(
        "structure_bytes".into(),
        report
            .structure_bytes
            .map(|bytes| bytes.to_string())
            .unwrap_or_default(),
    );
    if let Some(error) = &report.error {
        add("flip mean".into(), error.flip.mean.to_string());
        let named = [
            ("pixel".to_owned(), Some(&error.pixel)),
            ("block".to_owned(), error.block.as_ref()),
        ]
        .into_iter();
        let materials = error
            .materials
            .iter()
            .map(|errors| (errors.material.clone(), errors.block.as_ref()));
        for (name, errors) in named.chain(materials) {
            let Some(errors) = errors else { continue };
            add(format!("{name} bias"), errors.bias.to_string());
            add(format!("{name} rel_rmse"), errors.rel_rmse.to_string());
        }
    }
    for cost in &report.directions {
        add(
            format!("{} us_per_direction", cost.pass),
            cost.us_per_direction.to_string(),
        );
        cost.samples
            .iter()
            .for_each(|samples| add(format!("{} samples", cost.pass), samples.to_string()));
        cost.us_per_sample
            .iter()
            .for_each(|us| add(format!("{} us_per_sample", cost.pass), us.to_string()));
    }
    for stage in &report.stages {
        let name = format!(
            "stage {} {}",
            if stage.when == When::Build {
                "build"
            } else {
                "frame"
            },
            stage.name
        );
        let Spread {
            median, min, max, ..
        } = stage.gpu_ms;
        [("ms", median), ("min ms", min), ("max ms", max)]
            .iter()
            .for_each(|(unit, ms)| add(format!("{name} {unit}"), ms.to_string()));
    }
    for (kind, rows) in [
        ("total", &report.totals),
        ("counting", &report.counting),
        ("build", &report.build),
        ("frame", &report.passes),
        ("still", &report.still),
    ] {
        rows.iter().for_each(|row| {
            add(
                format!("{kind} {} ms", row.name),
                row.gpu_ms.median.to_string(),
            )
        });
    }
    for row in &report.motion {
        add(
            format!("motion {} s ms", row.time_s),
            row.gpu_ms.median.to_string(),
        );
        add(
            format!("motion {} s dynamic_voxels", row.time_s),
            row.dynamic_voxels
                .map(|count| count.to_string())
                .unwrap_or_default(),
        );
    }
    report
        .counts
        .iter()
        .for_each(|(name, count)| add(format!("count {name}"), count.to_string()));
    for row in &report.energy {
        for (colour, watts) in ["red", "green", "blue"].into_iter().zip(row.watts) {
            add(format!("{} {colour} W", row.name), watts.to_string());
        }
    }
    columns.extend(walk::columns(report));
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_quoted_where_they_must_be() {
        assert_eq!(
            line(["a", "b,c", "say \"d\""].into_iter()),
            "a,\"b,c\",\"say \"\"d\"\"\"\n"
        );
    }

    #[test]
    fn missing_numbers_are_dashes() {
        assert_eq!(number(None, 2), "-");
        assert_eq!(number(Some(1.236), 2), "1.24");
    }
}
