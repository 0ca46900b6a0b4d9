//! The first tables of a scene: what to take, one for each number of bounces.

use maud::{Markup, html};

use super::super::answer::{Goal, Pick, Picks, ROUGH, goals_text, mib};
use super::super::command;
use super::super::pictures::PictureFolder;
use super::super::point::{Cost, Point, bounces_text};
use super::super::section::{Section, Standing, bias_text, error_text, percent, standing_text};
use super::super::trouble::Troubles;
use super::{device, images, troubles};
use crate::graph::Spread;
use crate::measure::draw::short;
use crate::reference::Bounces;
use crate::scene::Scene;

/// All picks of a section, each once.
pub(super) fn all_picks(section: &Section) -> Vec<usize> {
    section
        .picks()
        .into_iter()
        .flat_map(|picks| picks.picks)
        .map(|pick| pick.index)
        .collect()
}

/// Writes which setting to take for which budget.
pub(super) fn answers(
    number: usize,
    section: &Section,
    pictures: &PictureFolder,
    troubles: &Troubles,
) -> Markup {
    let all = section.picks();
    let Some(first) = section.points.first() else {
        return html! {};
    };
    let [width, height] = first.setup.size;
    let standings = Cost::ALL.map(|cost| section.standings(cost));
    let source = source(section, first);
    html! {
        @for Picks { bounces, picks, unmet } in &all {
            h3 { "What to take: " (first.scene) ", " (bounces_text(*bounces)) ", " (width) "×"
                (height) " px, " (device(first)) }
            div.wide { table.answers {
                thead { tr {
                    th.word { "take it for" }
                    th.word { "picture, error" }
                    th.word { "technique, preset, settings" }
                    th { "light moves: frame [ms]" }
                    th { "everything moves: build + frame [ms]" }
                    th { "memory: all (structure) [MiB]" }
                    th { "error" }
                    th { "bias" }
                    th { "error by pixel" }
                    th.word { "worst material" }
                } }
                tbody { @for pick in picks {
                    @let point = &section.points[pick.index];
                    @let marks = [0, 1, 2].map(|cost|
                        (Cost::ALL[cost], standings[cost][pick.index]));
                    tr id={ "pick-" (point.key) } {
                        td.word { @for goal in goals_text(&pick.goals) { (goal) br; } }
                        td.word.pair { @for image in
                            images::shown(point, pictures).into_iter().flatten() { (image) } }
                        td.word {
                            (name(point)) br;
                            @if let Some(size_m) = point.voxel_size_m
                                { small { "finest cells " (short(f64::from(size_m))) " m" } br; }
                            small { (marks_text(point, marks)) }
                        }
                        td { (time(point.frame_ms())) }
                        td { (time(point.moving_ms())) }
                        td { (mib(point.memory_bytes)) @if let Some(bytes) = point.structure_bytes
                            { br; small { "(" (mib(bytes)) ")" } } }
                        td { @if let Some(error) = point.error
                            { b { (error_text(error.rel_rmse)) } } }
                        td { @if let Some(error) = point.error { (bias_text(error.bias)) } }
                        td { @if let Some(error) = point.pixel_error
                            { (error_text(error.rel_rmse)) }
                            (rough(point)) }
                        td.word { (worst(point)) }
                    }
                    tr.details { td colspan="10" {
                        (troubles::in_short(number, point, troubles))
                        div { code { (command::measure(&source, point)) } }
                        div { code { (command::render(&source, point)) } }
                    } }
                } }
            } }
            (below(section, unmet, *bounces))
            (blind(section, picks))
            (without_blocks(section, *bounces))
            (side_by_side(section, picks, *bounces))
        }
        @if !all.is_empty() && source == "SCENE"
            { p.note { code { "SCENE" } ": the file of " (first.scene) "." } }
    }
}

/// What stands below a table: how its rows were chosen, and what was not measured.
fn below(section: &Section, unmet: &[Goal], bounces: Bounces) -> Markup {
    let members: Vec<usize> = (0..section.points.len())
        .filter(|&index| section.points[index].bounces == bounces)
        .collect();
    let bounds: Vec<String> = unmet
        .iter()
        .filter_map(|goal| {
            if let Goal::Time(bound) = goal {
                Some(percent(*bound))
            } else {
                None
            }
        })
        .collect();
    html! {
        p.note {
            "A row answers for all budgets up to the next. Points that fit count as equally good \
                if their errors are within the reference's noise ("
                (error_text(section.noise(&members))) ") of the least. "
            "The row names the cheapest of them, or one that costs up to a tenth more and has less \
                error. "
            @if !bounds.is_empty() {
                b { "Not reached: " } "an error of at most " (bounds.join(", ")) "; "
                    (section.least_error_text(bounces)) ". Other settings may reach it. "
                code { "lumivox explain" } " says what limits a technique and which setting to \
                    raise."
            }
        }
    }
}

/// Where the blocks of a picture hide more than they show, so that its error says little.
fn blind(section: &Section, picks: &[Pick]) -> Markup {
    let is_hidden = |pick: &Pick| {
        section.points[pick.index]
            .fine_error()
            .is_some_and(|fine| fine > VERY * ROUGH)
    };
    let by_pixel = picks
        .iter()
        .filter_map(|pick| Some(section.points[pick.index].pixel_error?.rel_rmse))
        .fold(f64::INFINITY, f64::min);
    html! {
        @if !picks.is_empty() && picks.iter().all(is_hidden) {
            p.note {
                b.fail { "The error says little about this picture. " }
                    "Few blocks of 8×8 pixels lie on one plane here. By pixel, every row has an \
                    error of " (error_text(by_pixel))
                " or more. Measure a larger picture (" code { "--size" } ") before you choose."
            }
        }
    }
}

/// The note on a picture that has no blocks: its errors are by pixel.
fn without_blocks(section: &Section, bounces: Bounces) -> Markup {
    let mut errors = section
        .points
        .iter()
        .filter(|point| point.bounces == bounces)
        .filter_map(|point| Some((point.error?, point.pixel_error?)))
        .peekable();
    html! {
        @if errors.peek().is_some() && errors.all(|(error, by_pixel)| error == by_pixel) {
            p.note {
                b { "Errors are by pixel here. " }
                    "No 8×8 pixels of this picture lie on one plane and have one material. So the \
                    grain of the technique and of the reference counts. "
                "No picture is marked as rough. Look at the pictures."
            }
        }
    }
}

/// Every technique at its best, within the budgets of the picks and without any.
fn side_by_side(section: &Section, picks: &[Pick], bounces: Bounces) -> Markup {
    let mut techniques: Vec<&str> = Vec::new();
    for point in section
        .points
        .iter()
        .filter(|point| point.bounces == bounces && point.error.is_some())
    {
        if !techniques.contains(&point.technique.as_str()) {
            techniques.push(&point.technique);
        }
    }
    let mut budgets: Vec<f64> = picks
        .iter()
        .flat_map(|pick| &pick.goals)
        .filter_map(|goal| {
            if let Goal::Frame(ms) = goal {
                Some(*ms)
            } else {
                None
            }
        })
        .collect();
    budgets.sort_by(f64::total_cmp);
    budgets.push(f64::INFINITY);
    html! {
        @if techniques.len() > 1 {
            h4 { "Each technique at its best, " (bounces_text(bounces)) }
            div.wide { table.beside {
                thead { tr {
                    th.word { "technique" }
                    @for ms in &budgets {
                        th.word { @if ms.is_finite() { "light moves, " (short(*ms)) " ms a frame" }
                        @else { "no budget: the cheapest of its best points" } } }
                } }
                tbody { @for technique in techniques { tr {
                    td.word { b { (technique) } }
                    @for ms in &budgets {
                        td.word { @match section.best_of(technique, bounces, *ms)
                            { Some(index) => (at_best(&section.points[index])),
                            None => "none measured is as fast" } }
                    }
                } } }
            } }
        }
    }
}

fn at_best(point: &Point) -> Markup {
    let name: Vec<String> = [
        point.preset.clone(),
        point
            .resolution()
            .map(|resolution| format!("{resolution}³")),
    ]
    .into_iter()
    .flatten()
    .collect();
    html! {
        @if let Some(error) = point.error { b { (error_text(error.rel_rmse)) } }
        @if let Some(frame) = point.frame_ms() { " in " (short(frame.median)) " ms" }
        ", " (mib(point.memory_bytes)) " MiB" br;
        small { (name.join(" ")) @if !point.changes.is_empty() { " " (point.changes_text()) } }
    }
}

/// Technique, preset, resolution and what differs from the preset.
pub(super) fn name(point: &Point) -> Markup {
    html! { b { (point.name()) } @if !point.changes.is_empty()
    { " " code { (point.changes_text()) } } }
}

/// Its numbers on the charts, and where each is on the axis.
fn marks_text(point: &Point, marks: [(Cost, Option<Standing>); 3]) -> String {
    let numbered = marks
        .into_iter()
        .filter(|(_, standing)| matches!(standing, Some(Standing::Front(_))));
    let place = |cost: Cost| {
        point
            .cost(cost)
            .map(|spread| format!(" at {}", cost.median_text(spread)))
            .unwrap_or_default()
    };
    let numbers: Vec<String> = numbered
        .map(|(cost, standing)| format!("{}{}", standing_text(cost, standing), place(cost)))
        .collect();
    if numbers.is_empty() {
        String::new()
    } else {
        format!("on the charts: {}", numbers.join(", "))
    }
}

fn time(spread: Option<Spread>) -> Markup {
    html! { @if let Some(Spread { median, min, max, .. }) = spread
    { (short(median)) br; small { (short(min)) "–" (short(max)) } } }
}

/// A warning at a picture that looks worse than its error.
pub(super) fn rough(point: &Point) -> Markup {
    let fine = point.fine_error().filter(|fine| *fine > ROUGH);
    html! { @if let Some(fine) = fine
    { br; @if fine > VERY * ROUGH { span.fail { "very rough" } } @else
    { span.warn { "rough" } } } }
}

/// So many times what is rough is very rough.
const VERY: f64 = 3.0;

fn worst(point: &Point) -> Markup {
    html! { @if let Some((name, error)) =
    point.worst_material().filter(|_| point.materials.len() > 1)
    { (name) br; small { "error " (error_text(error.rel_rmse)) br;
    "bias " (bias_text(error.bias)) } } }
}

/// The scene as a command line names it; a bundled one is known by its content.
fn source(section: &Section, first: &Point) -> String {
    let is_same =
        |scene: &Scene| format!("{:032x}", scene.content_hash()) == first.setup.scene_hash;
    let bundled = || {
        Scene::bundled(&first.scene, &[])
            .ok()
            .filter(is_same)
            .map(|_| format!("bundled:{}", first.scene))
    };
    section
        .source
        .clone()
        .or_else(bundled)
        .map_or_else(|| "SCENE".to_owned(), |source| command::quoted(&source))
}

#[cfg(test)]
mod tests {
    use super::super::super::section::tests::section;
    use super::*;

    /// A row of the page by the technique of its pick.
    fn row(html: &str, key: &str) -> String {
        let start = html
            .split_once(&format!("id=\"pick-{key}\""))
            .map_or("", |parts| parts.1);
        start
            .split("id=\"pick-")
            .next()
            .unwrap_or("")
            .split("</tbody>")
            .next()
            .unwrap_or("")
            .to_owned()
    }

    /// Every figure stands in the row of its own pick: times, memory, error, bias of the picture
    /// and of the worst material, command.
    #[test]
    fn a_row_has_the_figures_of_its_pick() {
        let section = section();
        let html = answers(
            0,
            &section,
            &PictureFolder::of(std::path::Path::new("absent")),
            &Troubles::default(),
        )
        .into_string();
        let row = row(&html, &section.points[2].key);
        for figure in [
            "light moves, 1500 ms a frame",
            "everything moves, 1500 ms a frame",
            "least time, error at most 5%, 10%",
            "least memory, error at most 5%, 10%",
            "c cones 64³",
            "finest cells 0.125 m",
            ">cones=999<",
            ">1004<",
            "904–1205",
            ">1005<",
            "904–1206",
            ">6<",
            "(3)",
            "<b>4.0%</b>",
            ">-2.0%<",
            ">4.3%<",
            "lamp",
            "error 8.0%",
            "bias +4.0%",
            "on the charts: T2 at 1000 ms, R2 at 1001 ms, M2 at 3 MiB",
            "not measured",
            "lumivox bench SCENE --technique c --preset cones --resolution 64 --set cones=999 \
             --size 160x120 --shadow-resolution 1024 --frames 5 --rebuilds 3 --max-error 0.01 \
             --timing host -o again",
            "lumivox render SCENE --technique c --preset cones --set resolution=64 --set \
             cones=999 --size 160x120 --shadow-resolution 1024 -o picture.png",
        ] {
            assert!(row.contains(figure), "{figure} is not in {row}");
        }
        assert!(!row.contains("rough") && !row.contains("15 ms"), "{row}");
        assert!(
            html.contains("What to take: room, 1 bounce, 160×120 px, a device")
                && html.contains("What to take: room, 2 bounces, 160×120 px, a device")
        );
        let beside = html
            .split_once("Each technique at its best, 1 bounce")
            .map_or("", |parts| parts.1)
            .split("</table>")
            .next()
            .unwrap_or("");
        for text in [
            "<b>15.0%</b> in 14 ms, 2 MiB<br><small>cones 64³ cones=9</small>",
            "none measured is as fast",
            "<b>16.0%</b> in 104 ms",
            "<b>4.0%</b> in 1004 ms, 6 MiB",
        ] {
            assert!(beside.contains(text), "{text} is not in {beside}");
        }
        assert!(
            !beside.contains("<b>1.0%</b>"),
            "what has two bounces is beside what has one"
        );
        assert!(
            !html.contains("as above")
                && !html.contains("Not reached:")
                && html.contains("the reference's noise (0.2%) of the least.")
        );
    }

    /// A picture that looks worse than its error is marked, by how much.
    #[test]
    fn rough_pictures_are_marked() {
        let mut point = section().points.remove(2);
        let marks = [0.04, 0.12, 0.5].map(|pixel| {
            point.pixel_error = Some(crate::measure::chart::PointError {
                rel_rmse: pixel,
                bias: 0.0,
            });
            rough(&point).into_string()
        });
        assert_eq!(
            marks,
            [
                "",
                "<br><span class=\"warn\">rough</span>",
                "<br><span class=\"fail\">very rough</span>"
            ]
        );
    }

    /// If all picks are very rough, the page says that the error by blocks is not to be trusted; if
    /// one is not, it does not.
    #[test]
    fn pictures_of_small_things_are_told() {
        let mut section = section();
        let html = |section: &Section| {
            answers(
                0,
                section,
                &PictureFolder::of(std::path::Path::new("absent")),
                &Troubles::default(),
            )
            .into_string()
        };
        section.points.iter_mut().for_each(|point| {
            point.pixel_error = Some(crate::measure::chart::PointError {
                rel_rmse: 0.8,
                bias: 0.0,
            })
        });
        section.points.retain(|point| point.technique != "d");
        assert!(html(&section).contains(
            "The error says little about this picture. </b>Few blocks of 8×8 pixels lie on one \
             plane here. By pixel, every row has an error of 80.0% or more."
        ));
        section.points[0].pixel_error =
            section.points[0]
                .error
                .map(|error| crate::measure::chart::PointError {
                    rel_rmse: error.rel_rmse + 0.01,
                    ..error
                });
        assert!(!html(&section).contains("says little"));
    }

    /// What no point meets was not reached; it is no limit of the technique.
    #[test]
    fn what_nothing_meets_was_not_reached() {
        let mut section = section();
        section.points.retain(|point| point.technique == "b");
        let html = answers(
            0,
            &section,
            &PictureFolder::of(std::path::Path::new("absent")),
            &Troubles::default(),
        )
        .into_string();
        assert!(
            html.contains(
                "<b>Not reached: </b>an error of at most 5%, 10%; the least error of 1 point is \
                 16.0%"
            ),
            "{html}"
        );
    }

    /// A bundled scene is named as such only if it is the one that was measured.
    #[test]
    fn a_bundled_scene_is_known_by_its_content() -> Result<(), crate::scene::SceneError> {
        let mut section = section();
        section
            .points
            .iter_mut()
            .for_each(|point| point.scene = "cornell".into());
        assert_eq!(source(&section, &section.points[0]), "SCENE");
        section.points[0].setup.scene_hash =
            format!("{:032x}", Scene::bundled("cornell", &[])?.content_hash());
        assert_eq!(source(&section, &section.points[0]), "bundled:cornell");
        section.source = Some("my rooms/a.toml".into());
        assert_eq!(source(&section, &section.points[0]), "'my rooms/a.toml'");
        Ok(())
    }
}
