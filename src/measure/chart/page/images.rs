//! Pictures in the page. Each is embedded once, and shown wherever it is wanted.

use std::io::Cursor;
use std::path::PathBuf;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::{DynamicImage, ImageFormat, RgbImage};
use maud::{Markup, html};

use super::super::answer::Pick;
use super::super::pictures::PictureFolder;
use super::super::point::{Point, bounces_text};
use super::super::section::{Section, error_text};
use crate::image::heat_color;
use crate::reference::Bounces;

/// Width of an embedded picture (px); a larger one lies beside the page.
const EMBEDDED_PX: u32 = 160;

/// One picture: what its id says, its file, and what it shows.
struct Picture {
    id: String,
    path: PathBuf,
    alt: String,
}

impl Picture {
    /// Picture and heat map of a point.
    fn of(point: &Point, pictures: &PictureFolder) -> [Picture; 2] {
        let name = format!("{} {}", point.name(), point.changes_text());
        let picture = |what: &str, path| Picture {
            id: format!("{what}-{}", point.key),
            path,
            alt: format!("{what}, {}", name.trim_end()),
        };
        [
            picture("picture", pictures.picture(&point.key)),
            picture("error", pictures.error(&point.key)),
        ]
    }

    /// The picture of a reference.
    fn of_reference(first: &Point, bounces: Bounces, pictures: &PictureFolder) -> Picture {
        let key = first.setup.reference_key(bounces);
        Picture {
            path: pictures.picture(&key),
            id: key,
            alt: format!("reference, {}", bounces_text(bounces)),
        }
    }

    /// Embeds it; `None` where it cannot be read.
    fn embed(&self) -> Option<Markup> {
        let picture = image::open(&self.path).ok()?;
        let size = [picture.width(), picture.height()];
        let (shown, file) = if size[0] > EMBEDDED_PX {
            let file = self.path.file_name()?.to_string_lossy().into_owned();
            let small = picture.thumbnail(EMBEDDED_PX, u32::MAX);
            (small, Some(format!("pictures/{file}")))
        } else {
            (picture, None)
        };
        let uri = data_uri(&shown)?;
        let image = html! {
            image id=(self.id) width=(size[0]) height=(size[1]) href=(uri) data-file=[file] {}
        };
        Some(self.framed(size, &image))
    }

    /// Shows it where it is not embedded; `None` where it cannot be read.
    fn show(&self) -> Option<Markup> {
        let (width, height) = image::image_dimensions(&self.path).ok()?;
        let shown = html! { use href={ "#" (self.id) } {} };
        Some(self.framed([width, height], &shown))
    }

    fn framed(&self, [width, height]: [u32; 2], content: &Markup) -> Markup {
        html! {
            a.picture href={ "#" (self.id) } {
                svg viewBox={ "0 0 " (width) " " (height) } role="img" aria-label=(self.alt)
                    { (content) }
            }
        }
    }
}

/// Embeds picture and heat map of a point, as far as there are any.
pub(super) fn embedded(point: &Point, pictures: &PictureFolder) -> [Option<Markup>; 2] {
    Picture::of(point, pictures).map(|picture| picture.embed())
}

/// Shows the picture and heat map that the row of a point embeds.
pub(super) fn shown(point: &Point, pictures: &PictureFolder) -> [Option<Markup>; 2] {
    Picture::of(point, pictures).map(|picture| picture.show())
}

/// The references of a section, each number of bounces once.
fn reference_pictures(section: &Section, pictures: &PictureFolder) -> Vec<Picture> {
    let mut bounces: Vec<Bounces> = section.points.iter().map(|point| point.bounces).collect();
    bounces.sort();
    bounces.dedup();
    let first = section.points.first();
    bounces
        .into_iter()
        .filter_map(|bounces| Some(Picture::of_reference(first?, bounces, pictures)))
        .filter(|picture| picture.path.is_file())
        .collect()
}

/// Embeds the references, and shows the colours of heat maps beside them.
pub(super) fn references(section: &Section, pictures: &PictureFolder) -> Markup {
    let shown: Vec<(Markup, String)> = reference_pictures(section, pictures)
        .into_iter()
        .filter_map(|picture| Some((picture.embed()?, picture.alt)))
        .collect();
    html! {
        @if !shown.is_empty() {
            div.references {
                @for (image, caption) in shown { figure { (image) figcaption { (caption) } } }
                (heat_bar())
            }
        }
    }
}

/// Two pictures, one over the other, with a slider between them.
pub(super) fn comparison(scene: &str, section: &Section, pictures: &PictureFolder) -> Markup {
    let mut choices: Vec<(String, String)> = reference_pictures(section, pictures)
        .into_iter()
        .map(|picture| (picture.id, picture.alt))
        .collect();
    let references = choices.len();
    let points = section.points.iter().filter_map(|point| {
        let [picture, _] = Picture::of(point, pictures);
        let error = point.error?.rel_rmse;
        let name = [point.name(), point.changes_text()].join(" ");
        let text = format!(
            "{} ({}, error {})",
            name.trim_end(),
            bounces_text(point.bounces),
            error_text(error)
        );
        picture.path.is_file().then_some((picture.id, text))
    });
    choices.extend(points);
    let best: Option<String> = section
        .picks()
        .first()
        .and_then(|picks| picks.picks.last())
        .map(|Pick { index, .. }| format!("picture-{}", section.points[*index].key));
    let right =
        |place: usize, id: &String| best.as_ref().map_or(place == references, |best| best == id);
    html! {
        @if choices.len() > 1 {
            h3 { (scene) ": two pictures" }
            div.compare hidden {
                p {
                    label { "left " select { @for (id, text) in &choices
                        { option value=(id) { (text) } } } }
                    " "
                    label { "right " select { @for (place, (id, text)) in choices.iter().enumerate()
                        { option value=(id) selected[right(place, id)] { (text) } } } }
                }
                div.stack { img alt="the left picture"; img alt="the right picture"; }
                input type="range" min="0" max="100" value="50"
                    aria-label="how much of the left picture is shown (%)";
            }
            noscript { p.note { "The slider between two pictures needs JavaScript. The table below \
                has all pictures." } }
        }
    }
}

/// Colours of heat maps, and what they stand for.
fn heat_bar() -> Markup {
    let bar = RgbImage::from_fn(256, 1, |x, _| image::Rgb(heat_color(x as f32 / 255.0)));
    html! {
        figure.heat {
            img src=[data_uri(&bar.into())] alt="colours of heat maps";
            div { @for label in ["0", "25%", "50%", "75%", "100% or more"] { span { (label) } } }
            figcaption { "heat maps: |T − R| of what is compared at a pixel, over the mean of R" }
        }
    }
}

/// A picture as a PNG inside an address.
fn data_uri(picture: &DynamicImage) -> Option<String> {
    let mut bytes = Vec::new();
    picture
        .write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png)
        .ok()?;
    Some(format!("data:image/png;base64,{}", STANDARD.encode(bytes)))
}
