//! What the page has to explain: how to read it, techniques and presets, words.

use maud::{Markup, html};

use super::super::answer::{ROUGH, USABLE};
use super::super::section::{Section, percent};
use crate::gi::entry::Entry;
use crate::gi::registry::all;
use crate::gi::settings::Preset;

pub(super) fn introduction() -> Markup {
    html! {
        p.note {
            "This page compares techniques of global illumination with many settings, one scene at \
                a time. Errors are differences from a path-traced reference. "
            b { "Look for the row that says what you need. " }
            "It names a time for a frame, or the least time or memory for an error. There are two \
                times for a frame: one where only light and camera move, and one where all \
                geometry is new in each frame. "
            "The row has settings, cost, error and what will go wrong. One of its commands \
                measures the point again, the other renders its picture. "
            "Times hold for this device and this size of picture. Errors hold for this scene."
        }
    }
}

pub(super) fn how_to_read_charts() -> Markup {
    html! {
        p.note {
            b { "Lower and further left is better. " }
                "The step line is the Pareto front: no other point is both cheaper and closer to \
                the reference than a point on it. "
            "Points of the front have numbers: T on the chart of time, R with a rebuild, M on the \
                chart of memory. The key says what they are. "
            "Grey points have no number. They differ from a numbered point by less than the \
                reference's noise or the spread of the times. "
            "The dashed line is the reference's own noise. "
            "Every point leads to its row in the table of all points."
        }
    }
}

/// Techniques and presets of the points, in a line each.
pub(super) fn techniques(sections: &[&Section]) -> Markup {
    let points = || sections.iter().flat_map(|section| &section.points);
    let entries: Vec<&Entry> = all()
        .into_iter()
        .filter(|entry| points().any(|point| point.technique == entry.name))
        .collect();
    let is_shown = |entry: &Entry, preset: &Preset| {
        points().any(|point| {
            point.technique == entry.name && point.preset.as_deref() == Some(preset.name)
        })
    };
    html! {
        h2 #techniques { "Techniques and presets" }
        p.note {
            "A preset is a named set of settings of one technique. " b
                { "The same name can mean different gathers" }
                " in different techniques. Read what a preset sets before you compare it. "
            code { "lumivox techniques" } " lists all settings."
        }
        table.glossary {
            thead { tr { th.word { "technique" } th.word { "preset" } th.word { "what it is" }
                th.word { "what it sets" } } }
            tbody { @for entry in entries {
                tr { td.word { b { (entry.name) } } td.word {} td.word { (entry.summary) } td.word
                    {} }
                @for preset in entry.presets.iter().filter(|preset| is_shown(entry, preset)) {
                    tr { td.word { (entry.name) } td.word { b { (preset.name) } } td.word
                        { (preset.help) } td.word { code { (sets(entry, preset)) } } }
                }
            } }
        }
    }
}

/// What a preset sets; of one that sets nothing, the defaults of what the technique's other presets
/// set.
fn sets(entry: &Entry, preset: &Preset) -> String {
    let own: Vec<String> = preset
        .values
        .iter()
        .copied()
        .flatten()
        .map(|(name, value)| format!("{name}={value}"))
        .collect();
    if !own.is_empty() {
        return own
            .into_iter()
            .chain(directions(entry, preset))
            .collect::<Vec<_>>()
            .join(" ");
    }
    let others: Vec<&str> = entry
        .presets
        .iter()
        .flat_map(|preset| preset.values)
        .copied()
        .flatten()
        .map(|(name, _)| *name)
        .collect();
    let settings = entry
        .settings
        .iter()
        .copied()
        .flatten()
        .filter(|setting| others.contains(&setting.name));
    let defaults: Vec<String> = settings
        .map(|setting| format!("{}={}", setting.name, setting.default))
        .collect();
    format!("nothing; defaults: {}", defaults.join(" "))
}

/// How many directions a preset gathers along by default, where it does not set that.
fn directions(entry: &Entry, preset: &Preset) -> Option<String> {
    let settings = entry.settings::<&str>(Some(preset.name), &[]).ok()?;
    let name = (entry.directions_setting)(&settings)?;
    let mut own = preset.values.iter().copied().flatten();
    let count = settings.find_count(name)?;
    own.all(|(known, _)| *known != name)
        .then(|| format!("{name}={count}"))
}

pub(super) fn glossary() -> Markup {
    let words: [(&str, String); 15] = [
        (
            "error",
            "rel_rmse of the indirect light over blocks: √mean(T − R)² / mean R. T is the \
             technique, R the path-traced reference with as many bounces. 0% is perfect. A picture \
             without indirect light has about 100%."
                .into(),
        ),
        (
            "block",
            "The mean of 8×8 pixels that lie on one plane and have one material. Misplaced light \
             counts here. Grain and silhouettes do not."
                .into(),
        ),
        (
            "bias",
            "mean(T − R) / mean R over the same blocks: the light that the technique adds (+) or \
             loses (−). Beside a material it is that material's."
                .into(),
        ),
        (
            "error by pixel",
            "The same as the error, over single pixels. Grain, silhouettes, small things and the \
             reference's own grain count here."
                .into(),
        ),
        (
            "rough",
            format!(
                "The fine error is what blocks hide: √(by pixel² − error² − reference by pixel²). \
                 A rough picture has more than {}. It looks grainy, or is wrong in small details: \
                 look at it. A very rough picture has more than three times that.",
                percent(ROUGH)
            ),
        ),
        (
            "worst material",
            "The material with the largest error, relative to its own light. One figure for the \
             whole picture hides a bad wall."
                .into(),
        ),
        (
            "light moves",
            "The time of a frame, all passes: shadow maps, visible surfaces, update of the \
             structure, gather, composite. Geometry stands still."
                .into(),
        ),
        (
            "everything moves",
            "The time of a build of the structure and of a frame.".into(),
        ),
        (
            "spread",
            "The two figures below a median: the time with the fastest and with the slowest \
             indirect light. Passes that all techniques share have one time everywhere."
                .into(),
        ),
        (
            "memory",
            "All bytes on the device. In brackets: the bytes that the technique keeps in the world."
                .into(),
        ),
        (
            "Pareto front",
            format!(
                "The points that no other point beats in both cost and error. A point with an \
                 error above {} answers a time budget only if nothing better was measured.",
                percent(USABLE)
            ),
        ),
        (
            "floor, noise",
            "The reference's standard error, in the same measure as the error. Differences below \
             it mean nothing."
                .into(),
        ),
        (
            "leak",
            "Light where the reference is dark, divided by the light where it is lit. Passes up to \
             0.03, fails above 0.1."
                .into(),
        ),
        (
            "flicker",
            "How far the change from one frame to the next is from the reference's change. Passes \
             up to 0.02, fails above 0.05."
                .into(),
        ),
        (
            "flip",
            "NVIDIA's ꟻLIP of the tone-mapped pair, 0 to 1: the difference that a person sees."
                .into(),
        ),
    ];
    html! {
        h2 #glossary { "What the words mean" }
        dl.words { @for (word, text) in words { dt { (word) } dd { (text) } } }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::section::tests::section;
    use super::*;
    use crate::measure::stress::CASES;

    /// The page says what presets set; what nobody measured is left out.
    #[test]
    fn presets_say_what_they_set() {
        let mut section = section();
        for (point, (technique, preset)) in section.points.iter_mut().zip([
            ("voxel-mips", "accurate"),
            ("svo", "anisotropic"),
            ("voxel-mips", "cones"),
        ]) {
            (point.technique, point.preset) = (technique.into(), Some(preset.into()));
        }
        let html = techniques(&[&section]).into_string();
        for text in [
            "<code>gather=rays rays=16</code>",
            "<code>anisotropic=on face_weights=squared",
            "nothing; defaults: ",
            "gather=cones",
            "mip_filter=directional",
        ] {
            assert!(html.contains(text), "{text} is not in {html}");
        }
        assert!(!html.contains("clipmap") && !html.contains("textbook"));
    }

    /// The thresholds that the glossary quotes are those by which verdicts are found.
    #[test]
    fn the_glossary_quotes_the_thresholds() {
        let html = glossary().into_string();
        for name in ["leak", "flicker"] {
            let figure = CASES
                .iter()
                .flat_map(|case| case.figures)
                .find(|figure| figure.name == name);
            let text = figure
                .map(|figure| format!("Passes up to {}, fails above {}.", figure.pass, figure.warn))
                .unwrap_or_default();
            assert!(
                html.split("<dt>")
                    .any(|word| word.starts_with(name) && word.contains(&text)),
                "{name}: {text}"
            );
        }
    }
}
