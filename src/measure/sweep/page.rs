//! The page: all charts, pictures and numbers in one HTML file that needs nothing beside it.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::ImageFormat;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use std::io::Cursor;
use std::path::Path;

use super::point::{Cost, Point, bounces_text};
use super::records::PictureFolder;
use super::section::{Advice, Section, Standing, commit, percent, signed_percent, standing_text};
use crate::graph::Spread;
use crate::measure::chart::{ChartError, short};
use crate::measure::report::Timing;
use crate::reference::Bounces;

/// Width of a picture in the page (px).
const THUMBNAIL_PX: u32 = 160;

/// The page of some sections. Pictures that are not in the folder are left out.
pub fn page(sections: &[Section], pictures: &PictureFolder) -> Result<String, ChartError> {
    let title = "Speed against accuracy";
    let parts = sections.iter().filter(|section| !section.points.is_empty()).map(|part| section(part, pictures)).collect::<Result<Vec<_>, _>>()?;
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(include_str!("page.css"))) }
            }
            body {
                h1 { (title) }
                (how_to_read())
                @for part in parts { (part) }
                script { (PreEscaped(include_str!("page.js"))) }
            }
        }
    };
    Ok(page.into_string())
}

fn how_to_read() -> Markup {
    html! {
        p.note {
            "Each point is one technique of global illumination with one set of settings. " b { "Lower and further left is better." }
            " The step line is the Pareto front: no other point is both cheaper and closer to the truth than a point on it; its points are numbered, and "
            "the key says what they are. Take the leftmost number that is low enough for you. Everything above the line pays more for less."
        }
        p.note {
            b { "Error" } " is rel_rmse of the indirect light: √mean(T − R)² / mean R over means of 8×8 pixels, T the technique, R the path-traced "
            "reference with as many bounces; 0% is perfect. The dashed line is the reference's own noise: differences below it mean nothing. Points of "
            "different numbers of bounces compute different light and stand in charts of their own. "
            b { "Bias" } " is mean(T − R) / mean R: light made up (+) or lost (−). "
            b { "Time" } " is that of the passes of indirect light, the median over frames, with the smallest and largest; what all techniques share (shadow "
            "maps, visible surfaces, composite) is in " b { "frame" } " only. " b { "Memory" } " is what the technique keeps in the world."
        }
        p.note {
            "What the charts do not show: one figure for the whole picture hides a bad corner, so look at the worst material and at the heat maps (black is "
            "right, the brightest is wrong by the mean of the reference's light or more). Leaks, flicker and other ways to fail have figures of their own: "
            "see " code { "lumivox stress" } ". Times hold for this device and this size of picture."
        }
    }
}

fn section(section: &Section, pictures: &PictureFolder) -> Result<Markup, ChartError> {
    let Some(first) = section.points.first() else { return Ok(html! {}) };
    let charts = Cost::ALL.iter().filter_map(|cost| section.chart(*cost)).map(|chart| chart.svg()).collect::<Result<Vec<_>, _>>()?;
    Ok(html! {
        h2 { (first.scene) }
        (summary(section))
        (setup(first))
        (references(section, first, pictures))
        @for svg in charts { div.chart { (PreEscaped(svg)) } }
        h3 { "All points" }
        p.note { "Press a heading to sort. Tinted rows are on a front; " i { "near" } " is a point that the front beats by less than the spread of the times." }
        (table(section, pictures))
    })
}

/// A row a number of bounces and error, a column a cost.
fn summary(section: &Section) -> Markup {
    let advice = section.summary();
    let rows: Vec<&Advice> = advice.iter().filter(|one| one.cost == Advice::COSTS[0]).collect();
    let find = |row: &Advice, cost| advice.iter().find(|one| (one.bounces, one.cost) == (row.bounces, cost) && one.bound == row.bound);
    html! {
        table.summary {
            thead { tr { th { "bounces" } th { "error at most" } @for cost in Advice::COSTS { th { (cost.least()) } } } }
            tbody {
                @for row in rows {
                    tr {
                        td { (bounces_text(row.bounces)) }
                        td { (percent(row.bound)) }
                        @for cost in Advice::COSTS { td { @if let Some(one) = find(row, cost) { (one.text) } } }
                    }
                }
            }
        }
    }
}

fn setup(first: &Point) -> Markup {
    let setup = &first.setup;
    let timing = match setup.timing {
        Timing::Host => "on the host, each pass submitted by itself",
        Timing::Timestamps => "by the device's timestamps",
    };
    html! {
        dl {
            dt { "device" } dd { (setup.device) }
            dt { "driver" } dd { (setup.driver) }
            dt { "program" } dd { "lumivox " (setup.version) (commit(&setup.build)) }
            dt { "picture" } dd { (setup.size[0]) "×" (setup.size[1]) " px, shadow maps " (setup.shadow_resolution) " texels" }
            dt { "times" } dd { (timing) "; medians of " (setup.frames) " frames and " (setup.rebuilds) " builds" }
            dt { "reference" } dd { "standard error of 8×8-pixel means at most " (percent(setup.max_error)) }
            dt { "scene content" } dd { (setup.scene_hash) }
        }
    }
}

fn references(section: &Section, first: &Point, pictures: &PictureFolder) -> Markup {
    let mut bounces: Vec<Bounces> = section.points.iter().map(|point| point.bounces).collect();
    bounces.sort();
    bounces.dedup();
    let shown = bounces.into_iter().filter_map(|bounces| Some((bounces, data_uri(&pictures.picture(&first.setup.reference_key(bounces)))?)));
    html! {
        div.references {
            @for (bounces, uri) in shown {
                figure { img src=(uri) alt={ "reference, " (bounces_text(bounces)) }; figcaption { "reference, " (bounces_text(bounces)) } }
            }
        }
    }
}

/// A cell: what it sorts by, and what it shows.
struct Cell {
    value: String,
    shown: Markup,
    is_word: bool,
}

impl Cell {
    fn word(text: &str) -> Self {
        Cell { value: text.to_owned(), shown: html! { (text) }, is_word: true }
    }

    fn number(value: Option<f64>, show: impl Fn(f64) -> String) -> Self {
        let shown = value.map_or_else(|| "–".to_owned(), show);
        Cell { value: value.map(|value| value.to_string()).unwrap_or_default(), shown: html! { (shown) }, is_word: false }
    }

    fn time(spread: Option<Spread>) -> Self {
        let Some(Spread { median, min, max, .. }) = spread else { return Cell::number(None, short) };
        Cell { value: median.to_string(), shown: html! { (short(median)) br; small { (short(min)) "–" (short(max)) } }, is_word: false }
    }

    fn standing(standing: Option<Standing>) -> Self {
        let rank = match standing {
            Some(Standing::Front(number)) => number.to_string(),
            // Behind every number.
            Some(Standing::Near) => 1e6.to_string(),
            Some(Standing::Beaten) | None => String::new(),
        };
        Cell { value: rank, shown: html! { (standing_text(standing)) }, is_word: false }
    }
}

/// Headings, and whether their columns are words.
const HEADINGS: [(&str, bool); 19] = [
    ("technique", true),
    ("preset", true),
    ("resolution", false),
    ("differs from the preset", true),
    ("bounces", false),
    ("error", false),
    ("bias", false),
    ("worst material", true),
    ("its error", false),
    ("flip", false),
    ("time [ms]", false),
    ("update [ms]", false),
    ("gather [ms]", false),
    ("build [ms]", false),
    ("frame [ms]", false),
    ("memory [MiB]", false),
    ("front: time", false),
    ("front: rebuild", false),
    ("front: memory", false),
];

fn table(section: &Section, pictures: &PictureFolder) -> Markup {
    let standings = Cost::ALL.map(|cost| section.standings(cost));
    let standings_of = |index: usize| [0, 1, 2].map(|cost| standings[cost][index]);
    html! {
        div.table {
            table {
                thead {
                    tr {
                        th.word { "picture" }
                        th.word { "error" }
                        @for (name, is_word) in HEADINGS { th.word[is_word] { button type="button" { (name) } } }
                    }
                }
                tbody { @for (index, point) in section.points.iter().enumerate() { (row(point, standings_of(index), pictures)) } }
            }
        }
    }
}

fn row(point: &Point, standings: [Option<Standing>; 3], pictures: &PictureFolder) -> Markup {
    let on_front = standings.iter().any(|standing| matches!(standing, Some(Standing::Front(_))));
    let name = format!("{} {}", point.name(), point.changes_text());
    let picture = |path: &Path, what: &str| data_uri(path).map(|uri| html! { img src=(uri) alt={ (what) ", " (name) }; });
    html! {
        tr id=(point.key) .front[on_front] {
            td.word { @if let Some(image) = picture(&pictures.picture(&point.key), "picture") { (image) } }
            td.word { @if let Some(image) = picture(&pictures.error(&point.key), "error") { (image) } }
            @for cell in cells(point, standings) { td.word[cell.is_word] data-value=(cell.value) { (cell.shown) } }
        }
    }
}

fn cells(point: &Point, standings: [Option<Standing>; 3]) -> Vec<Cell> {
    let worst = point.worst_material();
    let bounces = match point.bounces {
        Bounces::Count(count) => f64::from(count),
        Bounces::Full => f64::INFINITY,
    };
    let differs = match &point.failure {
        Some(failure) => Cell { value: point.changes_text(), shown: html! { (point.changes_text()) " " b { (failure) } }, is_word: true },
        None => Cell::word(&point.changes_text()),
    };
    let bytes = point.structure_bytes.map(|bytes| bytes as f64 / f64::from(1 << 20));
    let mut cells = vec![
        Cell::word(&point.technique),
        Cell::word(point.preset.as_deref().unwrap_or("")),
        Cell::number(point.resolution().and_then(|resolution| resolution.parse().ok()), |resolution| resolution.to_string()),
        differs,
        Cell {
            value: bounces.to_string().replace("inf", "Infinity"),
            ..Cell::number(Some(bounces), |count| if count.is_finite() { count.to_string() } else { "all".into() })
        },
        Cell::number(point.error.map(|error| error.rel_rmse), percent),
        Cell::number(point.error.map(|error| error.bias), signed_percent),
        Cell::word(worst.map_or("", |(name, _)| name)),
        Cell::number(worst.map(|(_, error)| error.rel_rmse), percent),
        Cell::number(point.flip, short),
    ];
    cells.extend(["indirect", "update", "gather", "build", "frame"].map(|name| Cell::time(point.total(name))));
    cells.push(Cell::number(bytes, short));
    cells.extend(standings.map(Cell::standing));
    cells
}

/// A picture as a small PNG inside an address; `None` where it cannot be read.
fn data_uri(path: &Path) -> Option<String> {
    let picture = image::open(path).ok()?;
    let small = if picture.width() > THUMBNAIL_PX { picture.thumbnail(THUMBNAIL_PX, u32::MAX) } else { picture };
    let mut bytes = Vec::new();
    small.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).ok()?;
    Some(format!("data:image/png;base64,{}", STANDARD.encode(bytes)))
}
