//! The table of all points of a scene.

use maud::{Markup, html};

use super::super::answer::mib;
use super::super::pictures::PictureFolder;
use super::super::point::{Cost, Point};
use super::super::section::{MIB, Section, Standing, bias_text, error_text, standing_text};
use super::{answers, images};
use crate::graph::Spread;
use crate::measure::draw::short;
use crate::reference::Bounces;

/// A cell: what it sorts by, and what it shows.
struct Cell {
    value: String,
    shown: Markup,
    is_word: bool,
}

impl Cell {
    fn word(text: &str) -> Self {
        Cell {
            value: text.to_owned(),
            shown: html! { (text) },
            is_word: true,
        }
    }

    fn number(value: Option<f64>, show: impl Fn(f64) -> String) -> Self {
        let shown = value.map_or_else(|| "–".to_owned(), show);
        Cell {
            value: value.map(|value| value.to_string()).unwrap_or_default(),
            shown: html! { (shown) },
            is_word: false,
        }
    }

    fn time(spread: Option<Spread>) -> Self {
        let Some(Spread {
            median, min, max, ..
        }) = spread
        else {
            return Cell::number(None, short);
        };
        Cell {
            value: median.to_string(),
            shown: html! { (short(median)) br; small { (short(min)) "–" (short(max)) } },
            is_word: false,
        }
    }

    fn standing(cost: Cost, standing: Option<Standing>) -> Self {
        let rank = match standing {
            Some(Standing::Front(number)) => number.to_string(),
            // Behind every number.
            Some(Standing::Same) => 1e6.to_string(),
            Some(Standing::Near) => 1e7.to_string(),
            Some(Standing::Beaten) | None => String::new(),
        };
        Cell {
            value: rank,
            shown: html! { (standing_text(cost, standing)) },
            is_word: false,
        }
    }
}

/// Headings, and whether their columns are words.
const HEADINGS: [(&str, bool); 22] = [
    ("technique", true),
    ("preset", true),
    ("resolution", false),
    ("differs from the preset", true),
    ("bounces", false),
    ("front: time", false),
    ("front: rebuild", false),
    ("front: memory", false),
    ("error", false),
    ("bias", false),
    ("error by pixel", false),
    ("worst material", true),
    ("its error", false),
    ("flip", false),
    ("time: update + gather [ms]", false),
    ("update [ms]", false),
    ("gather [ms]", false),
    ("build [ms]", false),
    ("frame [ms]", false),
    ("build + frame [ms]", false),
    ("structure [MiB]", false),
    ("all memory [MiB]", false),
];

/// The columns of which the card beside a chart is made.
const ON_CARD: [&str; 7] = [
    "technique",
    "preset",
    "resolution",
    "differs from the preset",
    "error",
    "time: update + gather [ms]",
    "structure [MiB]",
];

/// All points, those on a front first, then by error; numbers of bounces one after the other.
pub(super) fn table(section: &Section, pictures: &PictureFolder) -> Markup {
    let standings = Cost::ALL.map(|cost| section.standings(cost));
    let standings_of = |index: usize| [0, 1, 2].map(|cost| standings[cost][index]);
    html! {
        div.table tabindex="0" role="region" aria-label="all points" {
            table {
                thead {
                    tr {
                        th.word { "picture" }
                        th.word { "error" }
                        @for (name, is_word) in HEADINGS
                            { th.word[is_word] data-card[ON_CARD.contains(&name)]
                                { button type="button" { (name) } } }
                    }
                }
                tbody { @for index in order(section, standings_of)
                    { (row(&section.points[index], standings_of(index), pictures)) } }
            }
        }
    }
}

/// The points in the order of their rows.
fn order(section: &Section, standings_of: impl Fn(usize) -> [Option<Standing>; 3]) -> Vec<usize> {
    let rank = |standing: &Option<Standing>| match standing {
        Some(Standing::Front(_)) => 0,
        Some(Standing::Same | Standing::Near) => 1,
        Some(Standing::Beaten) => 2,
        None => 3,
    };
    let key = |index: usize| {
        let point = &section.points[index];
        (
            point.bounces,
            standings_of(index).iter().map(rank).min(),
            point.error.map_or(f64::INFINITY, |error| error.rel_rmse),
        )
    };
    let mut order: Vec<usize> = (0..section.points.len()).collect();
    order.sort_by(|&a, &b| {
        let (a, b) = (key(a), key(b));
        (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2))
    });
    order
}

fn row(point: &Point, standings: [Option<Standing>; 3], pictures: &PictureFolder) -> Markup {
    let on_front = standings
        .iter()
        .any(|standing| matches!(standing, Some(Standing::Front(_))));
    html! {
        tr id=(point.key) .front[on_front] {
            @for image in images::embedded(point, pictures)
                { td.word { @if let Some(image) = image { (image) } } }
            @for cell in cells(point, standings)
                { td.word[cell.is_word] data-value=(cell.value) { (cell.shown) } }
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
        Some(failure) => Cell {
            value: point.changes_text(),
            shown: html! { (point.changes_text()) " " b { (failure) } },
            is_word: true,
        },
        None => Cell::word(&point.changes_text()),
    };
    let by_pixel = Cell::number(point.pixel_error.map(|error| error.rel_rmse), error_text);
    let in_mib = |bytes: u64| bytes as f64 / MIB;
    let all_memory = Some(point.memory_bytes).filter(|_| !point.totals.is_empty());
    let mut cells = vec![
        Cell::word(&point.technique),
        Cell::word(point.preset.as_deref().unwrap_or("")),
        Cell::number(
            point
                .resolution()
                .and_then(|resolution| resolution.parse().ok()),
            |resolution| resolution.to_string(),
        ),
        differs,
        Cell {
            value: bounces.to_string().replace("inf", "Infinity"),
            ..Cell::number(Some(bounces), |count| {
                if count.is_finite() {
                    count.to_string()
                } else {
                    "all".into()
                }
            })
        },
    ];
    cells.extend(
        Cost::ALL
            .into_iter()
            .zip(standings)
            .map(|(cost, standing)| Cell::standing(cost, standing)),
    );
    cells.extend([
        Cell::number(point.error.map(|error| error.rel_rmse), error_text),
        Cell::number(point.error.map(|error| error.bias), bias_text),
        Cell {
            shown: html! { (by_pixel.shown) (answers::rough(point)) },
            ..by_pixel
        },
        Cell::word(worst.map_or("", |(name, _)| name)),
        Cell::number(worst.map(|(_, error)| error.rel_rmse), error_text),
        Cell::number(point.flip, |flip| format!("{flip:.3}")),
    ]);
    cells.extend(
        ["indirect", "update", "gather", "build", "frame"]
            .map(|name| Cell::time(point.total(name))),
    );
    cells.push(Cell::time(point.moving_ms()));
    cells.push(Cell::number(point.structure_bytes.map(in_mib), short));
    cells.push(Cell {
        shown: html! { (all_memory.map_or_else(|| "–".to_owned(), mib)) },
        ..Cell::number(all_memory.map(in_mib), short)
    });
    cells
}

#[cfg(test)]
mod tests {
    use super::super::super::point::tests::point;
    use super::super::super::section::tests::section;
    use super::*;

    fn techniques(section: &Section) -> Vec<&str> {
        let standings = Cost::ALL.map(|cost| section.standings(cost));
        order(section, |index| {
            [0, 1, 2].map(|cost| standings[cost][index])
        })
        .into_iter()
        .map(|index| section.points[index].technique.as_str())
        .collect()
    }

    /// `c` and `a` are on the front, `c` with the lower error; `b` is beaten; `d` is of two
    /// bounces. A point without a price is last.
    #[test]
    fn rows_are_ordered_by_front_then_by_error() {
        let mut section = section();
        assert_eq!(techniques(&section), ["c", "a", "b", "d"]);
        let mut failed = point("failed", 1, [1.0, 1.0], 1, 0.1);
        failed.error = None;
        section.points.insert(0, failed);
        section
            .points
            .insert(0, point("worse", 1, [999.0, 1.0], 9 << 20, 0.9));
        assert_eq!(
            techniques(&section),
            ["c", "a", "b", "worse", "failed", "d"]
        );
    }

    /// The columns are as many as the headings, and what two columns add is under their heading.
    #[test]
    fn each_column_has_its_heading() {
        let point = point("a", 1, [9.0, 3.0], 1 << 20, 0.15);
        let cells = cells(
            &point,
            [Some(Standing::Front(2)), Some(Standing::Same), None],
        );
        assert_eq!(cells.len(), HEADINGS.len());
        let value = |name: &str| {
            HEADINGS
                .iter()
                .position(|heading| heading.0 == name)
                .map(|index| cells[index].value.clone())
        };
        let wanted = [
            ("error", "0.15"),
            ("bias", "-0.075"),
            ("worst material", "lamp"),
            ("its error", "0.3"),
            ("time: update + gather [ms]", "10"),
            ("build [ms]", "3"),
            ("frame [ms]", "14"),
            ("build + frame [ms]", "17"),
            ("structure [MiB]", "1"),
            ("all memory [MiB]", "2"),
            ("front: time", "2"),
        ];
        wanted
            .iter()
            .for_each(|(name, wanted)| assert_eq!(value(name).as_deref(), Some(*wanted), "{name}"));
        assert!(
            HEADINGS
                .iter()
                .zip(&cells)
                .all(|(heading, cell)| heading.1 == cell.is_word)
        );
        let shown: Vec<String> = cells[5..8]
            .iter()
            .map(|cell| cell.shown.clone().into_string())
            .collect();
        assert_eq!(
            (HEADINGS[5].0, shown),
            (
                "front: time",
                ["T2", "same", ""].map(str::to_owned).to_vec()
            )
        );
    }
}
