//! The page that maps the sources: what it names exists.

use std::collections::BTreeSet;
use std::path::Path;

use lumivox::gi::registry::TECHNIQUES;

fn page() -> String {
    std::fs::read_to_string(root().join("docs/sources.md")).unwrap()
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The rows of the page's tables, by column.
fn rows(page: &str) -> Vec<Vec<&str>> {
    page.lines()
        .filter(|line| {
            line.starts_with("| ") && !line.starts_with("| source") && !line.starts_with("| ---")
        })
        .map(|line| line[1..line.len() - 1].split('|').map(str::trim).collect())
        .collect()
}

/// What stands in backticks.
fn words(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

/// What is wrong with a page.
fn problems(page: &str) -> Vec<String> {
    let settings: BTreeSet<&str> = TECHNIQUES
        .iter()
        .flat_map(|entry| entry.all_settings().map(|setting| setting.name))
        .collect();
    let takes = |pair: &str| {
        let mut owners = TECHNIQUES.iter();
        owners.any(|entry| entry.settings(None, &[pair]).is_ok())
    };
    let mut wrong = Vec::new();
    for row in rows(page) {
        let [source, place, setting, test, verdict] = row[..] else {
            wrong.push(format!("{} has {} columns", row[0], row.len()));
            continue;
        };
        for path in words(place).chain(words(test)) {
            let is_path = path.contains('/') || path.ends_with(".md");
            if is_path && !root().join(path).exists() {
                wrong.push(format!("{source}: there is no {path}"));
            }
        }
        for one in words(setting) {
            let is_known = match one.contains('=') {
                true => takes(one),
                false => settings.contains(one),
            };
            if !is_known {
                wrong.push(format!("{source}: no technique has {one}"));
            }
        }
        for link in verdict.split("](").skip(1) {
            let file = link.split([')', '#']).next().unwrap_or_default();
            if !file.is_empty() && !root().join("docs").join(file).exists() {
                wrong.push(format!("{source}: there is no {file}"));
            }
        }
        let is_out = place.contains("*out*");
        if !is_out && words(place).next().is_none() {
            wrong.push(format!("{source} is nowhere, and not out"));
        }
    }
    wrong
}

#[test]
fn what_the_page_of_sources_names_exists() {
    let page = page();
    assert!(rows(&page).len() > 140, "{}", rows(&page).len());
    let wrong = problems(&page);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Planted: a path, a setting, a value, a link and a place that are not there.
#[test]
fn what_does_not_exist_is_noticed() {
    for (row, named) in [
        ("| a | `src/nowhere.rs` | | | |", "src/nowhere.rs"),
        ("| a | `src/lib.rs` | `nothing` | | |", "nothing"),
        ("| a | `src/lib.rs` | `cones=7` | | |", "cones=7"),
        (
            "| a | `src/lib.rs` | | `tests/gpu/nowhere.rs` | |",
            "tests/gpu/nowhere.rs",
        ),
        (
            "| a | `src/lib.rs` | | | [b](measured/nowhere.md) |",
            "measured/nowhere.md",
        ),
        ("| a | | | | |", "nowhere"),
        ("| a | `src/lib.rs` | |", "columns"),
    ] {
        let wrong = problems(row);
        assert!(
            wrong.len() == 1 && wrong[0].contains(named),
            "{row}: {wrong:?}"
        );
    }
    assert!(
        problems("| a | `src/lib.rs` | `cones=4` | `tests/cpu/main.rs` | [b](tour.md) |")
            .is_empty()
    );
}
