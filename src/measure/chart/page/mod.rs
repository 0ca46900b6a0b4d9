//! The page: what to take and what will go wrong, then all charts, pictures and numbers, in one
//! HTML file that needs nothing beside it.

mod answers;
mod bounces;
mod charts;
mod images;
mod table;
mod troubles;
mod words;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::pictures::PictureFolder;
use super::point::{Point, bounces_text};
use super::section::{Section, error_text, percent};
use super::trouble::Troubles;
use crate::measure::build::commit;
use crate::measure::draw::ChartError;
use crate::measure::report::{Timing, shadow_text};
use crate::reference::Bounces;

/// The page of some sections. Pictures that are not in the folder are left out.
pub fn page(
    sections: &[Section],
    pictures: &PictureFolder,
    troubles: &Troubles,
) -> Result<String, ChartError> {
    let title = "Which technique, at which settings?";
    let sections: Vec<&Section> = sections
        .iter()
        .filter(|section| !section.points.is_empty())
        .collect();
    let parts = sections
        .iter()
        .enumerate()
        .map(|(index, part)| section(index, part, pictures, troubles))
        .collect::<Result<Vec<_>, _>>()?;
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
                (words::introduction())
                nav {
                    @for (index, section) in sections.iter().enumerate()
                        { a href={ "#scene-" (index) } { (section.points[0].scene) } }
                    a href="#techniques" { "techniques and presets" }
                    a href="#glossary" { "what the words mean" }
                }
                @for part in parts { (part) }
                (words::techniques(&sections))
                (words::glossary())
                div #card hidden {}
                dialog #lightbox { form method="dialog" {
                    img alt=""; p {} button { "close" } } }
                script { (PreEscaped(include_str!("page.js"))) }
            }
        }
    };
    Ok(page.into_string())
}

fn section(
    number: usize,
    section: &Section,
    pictures: &PictureFolder,
    troubles: &Troubles,
) -> Result<Markup, ChartError> {
    let Some(first) = section.points.first() else {
        return Ok(html! {});
    };
    let charts = charts::charts(section)?;
    Ok(html! {
        h2 id={ "scene-" (number) } { (first.scene) }
        (bounces::left_out(section, pictures))
        @if let Some(text) = section.machine.text() { p.note { (text) } }
        (images::references(section, pictures))
        p.note {
            "Pictures show direct light too. Specks and jagged shadows that all techniques have \
                come from the shadow maps of " (first.setup.shadow_resolution) " texels"
                (shadow_text(&first.setup.shadows)) ". "
            "Errors count " (first.setup.compared()) " alone."
        }
        (answers::answers(number, section, pictures, troubles))
        (troubles::troubles(number, section, troubles))
        h3 { (first.scene) ": how it was measured" }
        (setup(section, first))
        h3 { (first.scene) ": charts" }
        (words::how_to_read_charts())
        (charts)
        (images::comparison(&first.scene, section, pictures))
        h3 { (first.scene) ": all points" }
        p.note {
            "Points on a front come first, then all others by error. Press a heading to sort. \
                Tinted rows have a number on a chart. "
            "A point marked " i { "same" } " is on a front too. It differs from a numbered point \
                by less than the reference's noise or the spread of the times. "
            "A point marked " i { "near" } " is beaten by less than that spread."
        }
        (table::table(section, pictures))
    })
}

/// The reference's noise, for each number of bounces.
fn noises(section: &Section) -> Vec<String> {
    let mut noises: Vec<(Bounces, f64)> = section
        .points
        .iter()
        .filter_map(|point| Some((point.bounces, point.noise?)))
        .collect();
    noises.sort_by_key(|(bounces, _)| *bounces);
    noises.dedup_by_key(|(bounces, _)| *bounces);
    noises
        .into_iter()
        .map(|(bounces, noise)| format!("{} ({})", error_text(noise), bounces_text(bounces)))
        .collect()
}

fn setup(section: &Section, first: &Point) -> Markup {
    let setup = &first.setup;
    let timing = match setup.timing {
        Timing::Host => "on the host, each pass submitted by itself",
        Timing::Timestamps => "by the device's timestamps",
    };
    html! {
        dl {
            dt { "device" } dd { (device(first)) ", " (setup.driver) }
            dt { "program" } dd { "lumivox " (setup.version) (commit(&setup.build)) }
            dt { "picture" } dd {
                (setup.size[0]) "×" (setup.size[1]) " px, shadow maps " (setup.shadow_resolution)
                " texels" (shadow_text(&setup.shadows)) }
            dt { "times" } dd { (timing) "; " (section.medians_text(first))
                @if setup.frames.min(setup.rebuilds) < 3
                    { b { ": too few to tell a spread" }
                    ". Other work of the machine shows in them" } }
            dt { "reference" } dd {
                "standard error of 8×8-pixel means: at most " (percent(setup.max_error))
                    " asked for. In the measure of the error, the noise is "
                (noises(section).join(", "))
            }
            dt { "scene content" } dd { (setup.scene_hash) }
        }
    }
}

/// The device, and whether it is none.
fn device(point: &Point) -> String {
    let name = &point.setup.device;
    let is_cpu = ["llvmpipe", "lavapipe", "SwiftShader"]
        .iter()
        .any(|cpu| name.contains(cpu));
    if is_cpu {
        format!("CPU, {name}")
    } else {
        name.clone()
    }
}
