//! What stands at the top of a scene: the light that its points were not asked for.

use maud::{Markup, html};

use super::super::bounces::{BounceSetting, judged};
use super::super::pictures::PictureFolder;
use super::super::point::{Point, bounces_text};
use super::super::section::{Section, error_text};
use crate::gi::registry::find;
use crate::reference::Bounces;

/// What each number of bounces leaves out of the full solution, and what adds it.
pub(super) fn left_out(section: &Section, pictures: &PictureFolder) -> Markup {
    html! { @for bounces in judged(&section.points) {
        p.note { (share(section, pictures, bounces)) " " (settings(section, bounces)) }
    } }
}

fn share(section: &Section, pictures: &PictureFolder, bounces: Bounces) -> Markup {
    let text = bounces_text(bounces);
    let left_out = section
        .points
        .first()
        .and_then(|first| pictures.left_out(&first.setup, bounces));
    let judged = html! {
        " Points with " (text) " are judged against a reference with " (text)
        ", so their errors do not count it."
    };
    match left_out {
        Some(left_out) if left_out.bias <= 0.0 => html! {
            b { "Of all indirect light, " (text) " " (leaves(bounces)) " out "
                (error_text(-left_out.bias)) "." }
            (judged)
        },
        // The noise of the two references is larger than what is left out.
        Some(_) => html! { b { "Next to nothing is left out at " (text) "." } (judged) },
        None => html! {
            b { "What " (text) " " (leaves(bounces))
                " out of all indirect light was not measured." }
            (judged) " " code { "lumivox chart" } " with the scene, in this folder, measures it."
        },
    }
}

fn leaves(bounces: Bounces) -> &'static str {
    if bounces == Bounces::Count(1) {
        "leaves"
    } else {
        "leave"
    }
}

/// The settings that add bounces, and the techniques that have them.
fn settings(section: &Section, bounces: Bounces) -> Markup {
    let mut found: Vec<(Option<BounceSetting>, Vec<&str>)> = Vec::new();
    for point in &section.points {
        if point.bounces != bounces || point.error.is_none() {
            continue;
        }
        let name = point.technique.as_str();
        if found.iter().any(|(_, names)| names.contains(&name)) {
            continue;
        }
        let setting = setting(point);
        match found.iter_mut().find(|(known, _)| *known == setting) {
            Some((_, names)) => names.push(name),
            None => found.push((setting, vec![name])),
        }
    }
    html! { @for (setting, names) in &found {
        @if let Some(BounceSetting { name, values }) = setting {
            code { "--set " (name) "=…" } " adds more: " (values.join(", "))
            " (" (names.join(", ")) "). "
        } @else { "No setting of " (names.join(", ")) " adds it. " }
    } }
}

fn setting(point: &Point) -> Option<BounceSetting> {
    let entry = find(&point.technique).ok()?;
    let pairs = point
        .settings
        .iter()
        .map(|(name, value)| format!("{name}={value}"));
    let settings = entry.settings(None, &pairs.collect::<Vec<_>>()).ok()?;
    BounceSetting::of(entry, &settings)
}

#[cfg(test)]
mod tests {
    use super::super::super::bounces::LeftOut;
    use super::super::super::section::tests::section;
    use super::*;

    /// What was measured is told with its figure, what was not is said not to have been, and the
    /// setting comes from the technique.
    #[test]
    fn each_number_of_bounces_says_what_it_leaves_out() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let pictures = PictureFolder::of(folder.path());
        let mut section = section();
        section.points[0].technique = "svo".into();
        let setup = section.points[0].setup.clone();
        let bounces = Bounces::Count(1);
        pictures.write_left_out(
            &setup,
            &LeftOut {
                bounces,
                bias: -0.4431,
            },
        )?;
        let html = left_out(&section, &pictures).into_string();
        for text in [
            "Of all indirect light, 1 bounce leaves out 44.3%.",
            "<code>--set bounces=…</code> adds more: 2, 3, 4, feedback (svo).",
            "No setting of b, c adds it.",
            "What 2 bounces leave out of all indirect light was not measured.",
        ] {
            assert!(html.contains(text), "{text} is not in {html}");
        }
        pictures.write_left_out(
            &setup,
            &LeftOut {
                bounces,
                bias: 0.001,
            },
        )?;
        let html = left_out(&section, &pictures).into_string();
        assert!(html.contains("Next to nothing is left out at 1 bounce."));
        Ok(())
    }
}
