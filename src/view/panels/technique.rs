//! Techniques, presets and settings, all from the registry: a new technique appears by itself.

use egui::{CollapsingHeader, RichText, Slider, Ui};

use super::{Scope, choose, row};
use crate::gi::registry;
use crate::gi::settings::{Domain, Group, Setting};
use crate::text::counted;
use crate::view::session::{Choice, Compare};
use crate::view::suit::Suit;

/// Which pictures are side by side.
pub(super) fn show_compare(ui: &mut Ui, scope: &mut Scope<'_>) {
    let session = &mut *scope.session;
    ui.horizontal(|ui| {
        ui.selectable_value(&mut session.compare, Compare::Single, "one")
            .on_hover_text("one technique");
        ui.selectable_value(&mut session.compare, Compare::Split, "split")
            .on_hover_text("two techniques or settings, left and right of a divider");
        let help = "the technique left of the divider; right of it, how far it is from the \
                    reference, a path tracer on the CPU that is refined meanwhile";
        ui.selectable_value(&mut session.compare, Compare::Difference, "difference")
            .on_hover_text(help);
    });
    if session.compare != Compare::Single {
        row(
            ui,
            "divider",
            "drag it in the picture, or move it here",
            |ui| ui.add(Slider::new(&mut session.divider, 0.0..=1.0).fixed_decimals(2)),
        );
    }
    if session.compare == Compare::Split
        && ui
            .button("right like left")
            .on_hover_text("give the right side the left side's technique and settings")
            .clicked()
    {
        session.choices[1] = session.choices[0].clone();
    }
    if session.compare == Compare::Difference {
        let help = "error that is shown brightest, as a share of the reference's mean luminance";
        row(ui, "brightest error", help, |ui| {
            ui.add(Slider::new(&mut session.difference_scale, 0.02..=5.0).logarithmic(true))
        });
        let samples = session.truth.as_ref().map_or(0, |truth| truth.samples);
        ui.label(format!(
            "reference: {} a pixel",
            counted(samples as usize, "sample")
        ));
        if scope.panels.times {
            ui.label(scope.errors);
        }
    }
}

/// The techniques of all sides.
pub(super) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let count = scope.session.pane_count();
    for index in 0..count {
        if count == 2 {
            ui.label(RichText::new(["left", "right"][index]).italics());
        }
        ui.push_id(index, |ui| {
            show_choice(
                ui,
                &mut scope.session.choices[index],
                &mut scope.panels.held,
            )
        });
        if index + 1 < count {
            ui.separator();
        }
    }
}

fn show_choice(ui: &mut Ui, choice: &mut Choice, held: &mut bool) {
    let techniques = registry::all();
    let names = techniques.iter().map(|entry| (entry.name, entry.summary));
    let chosen = row(ui, "technique", choice.entry.summary, |ui| {
        choose(ui, "technique", choice.entry.name, names)
    });
    if let Some(chosen) = chosen {
        choice.choose(techniques[chosen], None);
    }
    let presets = choice.entry.presets;
    if let Some(current) = choice.preset {
        let help = presets
            .iter()
            .find(|preset| preset.name == current)
            .map_or("", |preset| preset.help);
        let chosen = row(ui, "preset", help, |ui| {
            choose(
                ui,
                "preset",
                current,
                presets.iter().map(|preset| (preset.name, preset.help)),
            )
        });
        if let Some(chosen) = chosen {
            choice.choose(choice.entry, Some(presets[chosen].name));
        }
    }
    let bounces = match (choice.entry.bounces)(&choice.settings) {
        Some(count) => format!("indirect bounces: {count}"),
        None => "indirect bounces: one more with every frame".to_owned(),
    };
    ui.label(RichText::new(bounces).weak());
    if let Some(problem) = &choice.problem {
        ui.label(
            RichText::new(format!("{problem}; the picture is of the settings before"))
                .color(ui.visuals().error_fg_color),
        );
    }
    show_suit(ui, choice);
    let mut changed = show_groups(ui, choice, held);
    if !choice.set.is_empty()
        && ui
            .button("as the preset has it")
            .on_hover_text("undo all changes to the preset's settings")
            .clicked()
    {
        choice.set.clear();
        changed = true;
    }
    if changed {
        choice.update();
    }
}

/// Asks for the settings that suit the scene, and says what they were chosen by.
fn show_suit(ui: &mut Ui, choice: &mut Choice) {
    if ui
        .button("as the scene needs it")
        .on_hover_text("choose the settings for this scene, as `lumivox render` does")
        .clicked()
    {
        choice.suit = Suit::Wanted;
    }
    if let Suit::Said(why) = &choice.suit {
        ui.label(RichText::new(why).weak());
    }
}

/// The settings that have an effect, by group; says whether one was changed.
fn show_groups(ui: &mut Ui, choice: &mut Choice, held: &mut bool) -> bool {
    let mut changed = false;
    for (group, settings) in choice.entry.groups() {
        let (shown, idle): (Vec<_>, Vec<_>) = settings
            .into_iter()
            .partition(|setting| choice.entry.applies(setting.name, &choice.settings));
        let list = |ui: &mut Ui| {
            for setting in shown {
                changed |= show_setting(ui, choice, setting, held);
            }
            if !idle.is_empty() {
                let names: Vec<&str> = idle.iter().map(|setting| setting.name).collect();
                ui.label(RichText::new(format!("{} more without effect now", idle.len())).weak())
                    .on_hover_text(names.join("\n"));
            }
        };
        if group == Group::Other {
            list(ui);
        } else {
            CollapsingHeader::new(RichText::new(group.name()).strong())
                .default_open(true)
                .show_unindented(ui, list);
        }
    }
    changed
}

fn show_setting(
    ui: &mut Ui,
    choice: &mut Choice,
    setting: &'static Setting,
    held: &mut bool,
) -> bool {
    let Some((_, value)) = choice
        .settings
        .iter()
        .find(|(name, _)| *name == setting.name)
    else {
        return false;
    };
    // What is chosen but not possible is shown all the same, so that it can be changed further.
    let text = choice
        .set
        .get(setting.name)
        .cloned()
        .unwrap_or_else(|| value.to_string());
    let unit = if setting.unit.is_empty() {
        String::new()
    } else {
        format!(" [{}]", setting.unit)
    };
    let mark = if choice.set.contains_key(setting.name) {
        "• "
    } else {
        ""
    };
    // A long name has its unit in the tooltip alone.
    let name = format!(
        "{mark}{}{}",
        setting.name,
        if setting.name.len() + unit.len() > 20 {
            ""
        } else {
            &unit
        }
    );
    let help = format!(
        "{}{unit}\n{}, {} by default",
        setting.help, setting.domain, setting.default
    );
    let new = row(ui, &name, &help, |ui| widget(ui, setting, &text, held));
    let Some(new) = new.filter(|new| *new != text) else {
        return false;
    };
    choice.set.insert(setting.name, new);
    // A value that the preset has anyway is no change.
    let mut without = choice.clone();
    without.set.remove(setting.name);
    let same = without
        .entry
        .settings(without.preset, &without.pairs())
        .is_ok_and(|without| {
            choice
                .entry
                .settings(choice.preset, &choice.pairs())
                .is_ok_and(|with| with == without)
        });
    if same {
        choice.set.remove(setting.name);
    }
    true
}

/// The new value, as it would be written on the command line.
pub(super) fn widget(
    ui: &mut Ui,
    setting: &Setting,
    text: &str,
    held: &mut bool,
) -> Option<String> {
    let mut slider = |ui: &mut Ui, slider: Slider<'_>| {
        ui.spacing_mut().slider_width = (ui.available_width() - 62.0).max(30.0);
        let response = ui.add(slider);
        *held |= response.dragged();
        response.changed()
    };
    match setting.domain {
        Domain::Count { min, max } => {
            let mut value: u32 = text.parse().unwrap_or(min);
            let wide = max / min.max(1) > 64;
            slider(ui, Slider::new(&mut value, min..=max).logarithmic(wide))
                .then(|| value.to_string())
        }
        Domain::Number { min, max } => {
            let mut value: f32 = text.parse().unwrap_or(min);
            let wide = min > 0.0 && max / min > 64.0;
            slider(
                ui,
                Slider::new(&mut value, min..=max)
                    .logarithmic(wide)
                    .max_decimals(4),
            )
            .then(|| value.to_string())
        }
        Domain::OneOf(values) => {
            let all: Vec<String> = values.iter().map(u32::to_string).collect();
            let chosen = choose(
                ui,
                setting.name,
                text,
                all.iter().map(|value| (value.as_str(), "")),
            )?;
            all.get(chosen).cloned()
        }
        Domain::Choice(words) => {
            choose(ui, setting.name, text, words.iter().map(|word| (*word, "")))
                .map(|chosen| words[chosen].to_owned())
        }
    }
}
