//! What will go wrong with the picks: `lumivox stress` in a table.

use std::cmp::Reverse;

use maud::{Markup, html};

use super::super::point::Point;
use super::super::section::Section;
use super::super::trouble::{Finding, TroubleRun, Troubles};
use super::answers::{all_picks, name};
use crate::measure::draw::short;
use crate::measure::stress::results::severity_text;
use crate::measure::stress::{CASES, StressCase, Verdict};

/// Figures that are told of a pick even where they pass.
const ALWAYS: [&str; 2] = ["leak", "flicker"];

/// A pick's failure modes in a few words.
pub(super) fn in_short(number: usize, point: &Point, troubles: &Troubles) -> Markup {
    let Some(run) = troubles.run_of(point) else {
        return html! { div {
        "What will go wrong: not measured, " a href={ "#stress-" (number) } { "how to" } } };
    };
    let findings = run.findings();
    let names = |verdict: Verdict| {
        let failing = findings
            .iter()
            .filter(|finding| finding.worst.verdict == Some(verdict));
        failing
            .map(|finding| format!("{} {}", finding.case.name, with_unit(finding)))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let refused: Vec<String> = findings
        .iter()
        .filter_map(|finding| {
            Some(format!(
                "{} at {}",
                finding.case.name,
                severity_text(finding.worst.refused?)
            ))
        })
        .collect();
    let parts = [
        ("fail", "Fails: ", names(Verdict::Fail)),
        ("warn", "Visible: ", names(Verdict::Warn)),
        (
            "warn",
            "No figure, the device refused: ",
            refused.join(", "),
        ),
    ];
    let differences = run.differences(point);
    html! {
        @for (class, what, names) in parts.iter().filter(|(_, _, names)| !names.is_empty())
            { div { b class=(class) { (what) } (names) } }
        div {
            @for figure in ALWAYS
                { @if let Some(value) = largest(&run, figure)
                { span.figure { (figure) " up to " (short(value)) " " } } }
            small {
                a href={ "#stress-" (number) } { "measured" }
                    " in the scenes of the stress suite, of " (run.name())
                @if !differences.is_empty() { " with " (differences.join(" ")) }
                @if run.missing() > 0
                    { ", without " (run.missing()) " of " (CASES.len()) " failure modes" }
            }
        }
    }
}

/// Where it fails, with the unit that the case names in brackets.
fn with_unit(finding: &Finding) -> String {
    let unit = finding
        .case
        .severity
        .split_once('[')
        .and_then(|(_, rest)| rest.split(']').next())
        .unwrap_or_default();
    finding.worst.place(unit)
}

/// The largest value of a figure in all failure modes.
fn largest(run: &TroubleRun<'_>, figure: &str) -> Option<f64> {
    run.records
        .iter()
        .flat_map(|record| &record.figures)
        .filter(|figured| figured.name == figure)
        .filter_map(|figured| figured.value)
        .max_by(f64::total_cmp)
}

/// All failure modes of all picks.
pub(super) fn troubles(number: usize, section: &Section, troubles: &Troubles) -> Markup {
    let picks: Vec<&Point> = all_picks(section)
        .into_iter()
        .map(|index| &section.points[index])
        .collect();
    let Some(first) = picks.first() else {
        return html! {};
    };
    let mut columns: Vec<(TroubleRun<'_>, Vec<&Point>)> = Vec::new();
    for point in &picks {
        let Some(run) = troubles.run_of(point) else {
            continue;
        };
        let is_same = |known: &TroubleRun<'_>| std::ptr::eq(known.records[0], run.records[0]);
        match columns.iter_mut().find(|(known, _)| is_same(known)) {
            Some((_, points)) => points.push(point),
            None => columns.push((run, vec![point])),
        }
    }
    let unmeasured: Vec<&Point> = picks
        .iter()
        .filter(|point| {
            troubles
                .run_of(point)
                .is_none_or(|run| !run.is_own(point) || run.missing() > 0)
        })
        .copied()
        .collect();
    let mut commands: Vec<(String, Vec<&Point>)> = Vec::new();
    for point in unmeasured {
        let command = troubles.command(point);
        match commands.iter_mut().find(|(known, _)| *known == command) {
            Some((_, points)) => points.push(point),
            None => commands.push((command, vec![point])),
        }
    }
    html! {
        h3 id={ "stress-" (number) } { "What will go wrong: " (first.scene) }
        @if columns.is_empty() {
            p.note { b { "Not measured." }
                " Nothing on this page says whether these settings leak, flicker or break. The \
                commands below measure that. Then run "
                code { "lumivox chart" } " again." }
        } @else {
            p.note {
                "The figures are from " code { "lumivox stress" }
                    ". Each row is a failure that the literature names, made worse step by step. \
                    It has a scene of its own, or this scene if it was measured with it. "
                b.fail { "fail" } ": anybody sees it. "
                b.warn { "warn" } ": you see it when you look for it. "
                b.pass { "pass" } ": you will hardly see it. "
                "\"from 0.5 down\": the verdict holds at 0.5 and at everything below, and the \
                    figure is that at 0.5. \"at 0.5\": the verdict holds there alone. "
                "Severities in cells hold at any resolution, but " i { "translation" } " and " i
                    { "rotation" } " get worse with larger cells. "
                "A quick run has only one to three severities for each failure, so the true \
                    \"from\" may lie between two of them."
            }
            (table(&columns))
        }
        @if !commands.is_empty() {
            p.note { "These have no stress run of all failure modes with their own settings and \
                resolution:" }
            ul.commands { @for (command, points) in &commands
                { li { @for point in points { (name(point)) "  " } br; code { (command) } } } }
        }
    }
}

fn table(columns: &[(TroubleRun<'_>, Vec<&Point>)]) -> Markup {
    let findings: Vec<Vec<Finding>> = columns.iter().map(|(run, _)| run.findings()).collect();
    let mut cases: Vec<(&'static StressCase, u8)> = Vec::new();
    for finding in findings.iter().flatten() {
        let badness = badness(finding.worst.verdict);
        match cases
            .iter_mut()
            .find(|(case, _)| std::ptr::eq(*case, finding.case))
        {
            Some((_, worst)) => *worst = badness.max(*worst),
            None => cases.push((finding.case, badness)),
        }
    }
    cases.sort_by_key(|(_, badness)| Reverse(*badness));
    html! {
        div.wide { table.troubles {
            thead { tr {
                th.word { "failure" }
                @for (run, points) in columns {
                    th.word { (run.name()) br;
                        small { "for " (points.iter().map(|point|
                        of_run(run, point)).collect::<Vec<_>>().join("; ")) } }
                }
            } }
            tbody { @for (case, _) in cases { tr {
                td.word { b { (case.name) } br; small { (case.help) ". Gets worse with: "
                    (case.severity) } }
                @for findings in &findings {
                    @match findings.iter().find(|finding| std::ptr::eq(finding.case, case)) {
                        Some(finding) => (cell(finding)),
                        None => td.word { "not measured" },
                    }
                }
            } } }
        } }
    }
}

/// A pick, and what the run had otherwise.
fn of_run(run: &TroubleRun<'_>, point: &Point) -> String {
    let differences = run.differences(point);
    let otherwise = if differences.is_empty() {
        String::new()
    } else {
        format!(" (measured with {})", differences.join(" "))
    };
    let changes = if point.changes.is_empty() {
        String::new()
    } else {
        format!(" {}", point.changes_text())
    };
    format!("{}{changes}{otherwise}", point.name())
}

fn badness(verdict: Option<Verdict>) -> u8 {
    match verdict {
        Some(Verdict::Pass) => 0,
        Some(Verdict::Warn) => 1,
        None => 2,
        Some(Verdict::Fail) => 3,
    }
}

fn cell(finding: &Finding) -> Markup {
    let worst = &finding.worst;
    let class = worst.verdict.map_or("warn", Verdict::word);
    let (figure, value) = &worst.figure;
    html! {
        td.word { b class=(class) { (worst) } @if !figure.is_empty()
            { br; small { (figure) " " (value.map_or_else(|| "∞".to_owned(), short)) } } }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::point::tests::point;
    use super::super::super::trouble::tests::{record, troubles_of};
    use super::*;
    use crate::measure::chart::Machine;
    use crate::measure::stress::Record;

    fn section() -> Section {
        let mut good = point("svo", 1, [9.0, 1.0], 1 << 20, 0.04);
        good.settings.insert("cones".into(), "9".into());
        Section {
            machine: Machine::STEADY,
            points: vec![good],
            source: None,
        }
    }

    fn html(section: &Section, found: &Troubles) -> String {
        in_short(0, &section.points[0], found).into_string()
            + &troubles(0, section, found).into_string()
    }

    /// What fails is told beside the pick and in the table, with severity and figure; what passes
    /// is told too where it is a leak.
    #[test]
    fn planted_failures_are_shown() {
        let refused = Record {
            figures: Vec::new(),
            ..record(
                "svo",
                "9",
                "triangle_count",
                5e6,
                ("rel_rmse", 0.0, Verdict::Pass),
            )
        };
        let mut records = vec![
            refused,
            record(
                "svo",
                "9",
                "triangle_count",
                1.0,
                ("rel_rmse", 0.0, Verdict::Pass),
            ),
            record("svo", "9", "thin_walls", 1.0, ("leak", 0.01, Verdict::Pass)),
            record(
                "svo",
                "9",
                "narrow_gap",
                4.0,
                ("energy_error", 0.1, Verdict::Pass),
            ),
            record(
                "svo",
                "9",
                "narrow_gap",
                0.5,
                ("energy_error", 0.987, Verdict::Fail),
            ),
            record(
                "svo",
                "9",
                "rotation",
                6.0,
                ("rotation_spread", 0.2, Verdict::Warn),
            ),
            record(
                "svo",
                "9",
                "contrast",
                1e9,
                ("rel_rmse", 1.04, Verdict::Fail),
            ),
        ];
        let html = super::tests::html(&section(), &troubles_of(records.clone()));
        for text in [
            "<b class=\"fail\">Fails: </b>narrow_gap from 0.5 voxels down, contrast from 1e9 up<",
            "<b class=\"warn\">Visible: </b>rotation from 6 up<",
            "<b class=\"warn\">No figure, the device refused: </b>triangle_count at 5e6<",
            "leak up to 0.01",
            "without 39 of 44 failure modes",
            "<code>lumivox stress --technique svo",
            "svo cones 64³ (quick)<",
            "<b class=\"fail\">fail from 0.5 down</b><br><small>energy_error 0.987</small>",
            "<b class=\"pass\">pass</b><br><small>leak 0.01</small>",
        ] {
            assert!(html.contains(text), "{text} is not in {html}");
        }
        assert!(!html.contains("not measured"), "{html}");
        let first = |text: &str| html.find(&format!("<b>{text}</b>"));
        assert!(
            first("narrow_gap") < first("rotation") && first("rotation") < first("thin_walls"),
            "the worst stands first"
        );
        records.extend(CASES.iter().map(|case| {
            record(
                "svo",
                "9",
                case.name,
                case.severities[0],
                (case.figures[0].name, 0.0, Verdict::Pass),
            )
        }));
        let whole = super::tests::html(&section(), &troubles_of(records));
        assert!(
            !whole.contains("failure modes with")
                && !whole.contains("lumivox stress --technique")
                && whole.contains("Fails: "),
            "{whole}"
        );
    }

    /// A run of other settings is said to be one; without any run the page says what it does not
    /// know, and how to learn it.
    #[test]
    fn what_was_not_measured_is_said() {
        let other = html(
            &section(),
            &troubles_of(vec![record(
                "svo",
                "16",
                "rotation",
                6.0,
                ("rotation_spread", 0.2, Verdict::Warn),
            )]),
        );
        let command = "<code>lumivox stress --technique svo --preset cones --resolution 64 --set \
                       cones=9 -o found</code>";
        assert!(
            other.contains("with cones=16")
                && other.contains("(measured with cones=16)")
                && other.contains(command),
            "{other}"
        );
        let mut coarser = section();
        coarser.points.push(Point {
            key: "coarser".into(),
            bounces: crate::reference::Bounces::Full,
            ..coarser.points[0].clone()
        });
        assert_eq!(
            html(&coarser, &troubles_of(Vec::new()))
                .matches(command)
                .count(),
            1,
            "one command for what is one run"
        );
        let none = html(
            &section(),
            &troubles_of(vec![record(
                "clipmap",
                "9",
                "rotation",
                6.0,
                ("rotation_spread", 0.2, Verdict::Warn),
            )]),
        );
        assert!(
            none.contains("What will go wrong: not measured, ")
                && none.contains("<b>Not measured.</b>")
                && none.contains(command)
                && !none.contains("rotation"),
            "{none}"
        );
    }
}
