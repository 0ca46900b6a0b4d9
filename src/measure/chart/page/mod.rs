//! The page: what to take and what will go wrong, then all charts, pictures and numbers, in one
//! HTML file that needs nothing beside it.

mod answers;
mod table;
mod troubles;
mod words;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::{ImageFormat, RgbImage};
use maud::{DOCTYPE, Markup, PreEscaped, html};

use std::io::Cursor;
use std::path::Path;

use super::pictures::PictureFolder;
use super::point::{Cost, Point, bounces_text};
use super::section::{Section, percent};
use super::trouble::Troubles;
use crate::image::heat_color;
use crate::measure::build::commit;
use crate::measure::draw::ChartError;
use crate::measure::report::Timing;
use crate::reference::Bounces;

/// Width of a picture in the page (px).
const THUMBNAIL_PX: u32 = 160;

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
    let charts = Cost::ALL
        .iter()
        .filter_map(|cost| section.chart(*cost))
        .map(|chart| chart.svg())
        .collect::<Result<Vec<_>, _>>()?;
    Ok(html! {
        h2 id={ "scene-" (number) } { (first.scene) }
        (references(section, first, pictures))
        p.note {
            "Pictures show direct light too. Specks and jagged shadows that all techniques have \
                come from the shadow maps of " (first.setup.shadow_resolution) " texels. "
            "Errors count indirect light alone."
        }
        (answers::answers(number, section, pictures, troubles))
        (troubles::troubles(number, section, troubles))
        h3 { (first.scene) ": how it was measured" }
        (setup(section, first))
        h3 { (first.scene) ": charts" }
        (words::how_to_read_charts())
        @for svg in charts { div.chart { (PreEscaped(svg)) } }
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
        .map(|(bounces, noise)| format!("{} ({})", percent(noise), bounces_text(bounces)))
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
                " texels" }
            dt { "times" } dd { (timing) "; medians of " (setup.frames) " frames and "
                (setup.rebuilds) " builds"
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

fn references(section: &Section, first: &Point, pictures: &PictureFolder) -> Markup {
    let mut bounces: Vec<Bounces> = section.points.iter().map(|point| point.bounces).collect();
    bounces.sort();
    bounces.dedup();
    let shown: Vec<_> = bounces
        .into_iter()
        .filter_map(|bounces| {
            Some((
                bounces,
                data_uri(&pictures.picture(&first.setup.reference_key(bounces)))?,
            ))
        })
        .collect();
    html! {
        @if !shown.is_empty() {
            div.references {
                @for (bounces, uri) in shown {
                    figure { img src=(uri) alt={ "reference, " (bounces_text(bounces)) };
                        figcaption { "reference, " (bounces_text(bounces)) } }
                }
                (heat_bar())
            }
        }
    }
}

/// Colours of heat maps, and what they stand for.
fn heat_bar() -> Markup {
    let bar = RgbImage::from_fn(256, 1, |x, _| image::Rgb(heat_color(x as f32 / 255.0)));
    let mut bytes = Cursor::new(Vec::new());
    // Writing to memory cannot fail.
    let _ = bar.write_to(&mut bytes, ImageFormat::Png);
    html! {
        figure.heat {
            img src={ "data:image/png;base64," (STANDARD.encode(bytes.into_inner())) }
                alt="colours of heat maps";
            div { @for label in ["0", "25%", "50%", "75%", "100% or more"] { span { (label) } } }
            figcaption { "heat maps: |T − R| of a pixel's indirect light, over the mean of R" }
        }
    }
}

/// Picture and heat map of a point, as far as there are any.
fn thumbnails(point: &Point, pictures: &PictureFolder) -> [Option<Markup>; 2] {
    let name = format!("{} {}", point.name(), point.changes_text());
    [
        ("picture", pictures.picture(&point.key)),
        ("error", pictures.error(&point.key)),
    ]
    .map(|(what, path)| {
        data_uri(&path).map(|uri| html! { img src=(uri) alt={ (what) ", " (name) }; })
    })
}

/// A picture as a small PNG inside an address; `None` where it cannot be read.
fn data_uri(path: &Path) -> Option<String> {
    let picture = image::open(path).ok()?;
    let small = if picture.width() > THUMBNAIL_PX {
        picture.thumbnail(THUMBNAIL_PX, u32::MAX)
    } else {
        picture
    };
    let mut bytes = Vec::new();
    small
        .write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png)
        .ok()?;
    Some(format!("data:image/png;base64,{}", STANDARD.encode(bytes)))
}
