//! Keys of the window: everything that the wheel and the mouse do can be done by them.

use egui::{Context, Event, Key, Modifiers};
use glam::Vec3;

use super::files::window_path;
use super::{Request, Scope};
use crate::view::camera::{BOOKMARKS, Mode};
use crate::view::session::Compare;
use crate::view::views::VIEWS;

const DIGITS: [Key; BOOKMARKS] = [
    Key::Num1,
    Key::Num2,
    Key::Num3,
    Key::Num4,
    Key::Num5,
    Key::Num6,
    Key::Num7,
    Key::Num8,
    Key::Num9,
];

/// Points that an arrow key turns in a second.
const TURN_POINTS: f32 = 240.0;

/// Reads the keys, unless a text is being typed.
pub(super) fn keys(ctx: &Context, scope: &mut Scope<'_>) {
    if ctx.wants_keyboard_input() {
        return;
    }
    commands(ctx, scope);
    let pressed = |key| ctx.input(|input| input.key_pressed(key) && !input.modifiers.command);
    let session = &mut *scope.session;
    if pressed(Key::F1) {
        scope.panels.help ^= true;
    }
    if pressed(Key::Escape) {
        if !scope.panels.help {
            session.beam.place = None;
        }
        (scope.panels.help, session.scene_problem) = (false, None);
    }
    if pressed(Key::P) {
        session.beam.toggle(scope.panels.pointer);
    }
    if pressed(Key::C) {
        session.compare = match session.compare {
            Compare::Single => Compare::Split,
            Compare::Split => Compare::Difference,
            Compare::Difference => Compare::Single,
        };
    }
    if pressed(Key::V) {
        // As it was held when the key went down: both may be up again before a frame is drawn.
        let is_back = |event: &Event| {
            matches!(
                event,
                Event::Key { key: Key::V, pressed: true, modifiers, .. } if modifiers.shift
            )
        };
        let is_back = ctx.input(|input| input.events.iter().any(is_back));
        let step = if is_back { VIEWS.len() - 1 } else { 1 };
        (session.view, session.layer) = ((session.view + step) % VIEWS.len(), 0);
    }
    for (key, step) in [(Key::OpenBracket, -0.25), (Key::CloseBracket, 0.25)] {
        if pressed(key) {
            session.exposure_ev = (session.exposure_ev + step).clamp(-10.0, 10.0);
        }
    }
    for (key, step) in [(Key::Comma, -0.02), (Key::Period, 0.02)] {
        if pressed(key) {
            session.divider = (session.divider + step).clamp(0.0, 1.0);
        }
    }
    camera_keys(ctx, scope);
}

/// Keys that come with Ctrl (⌘), and those that ask something of the window.
fn commands(ctx: &Context, scope: &mut Scope<'_>) {
    let command = |key| ctx.input_mut(|input| input.consume_key(Modifiers::COMMAND, key));
    // Where a text was selected, egui copies that.
    if ctx.input(|input| input.events.contains(&egui::Event::Copy)) || command(Key::C) {
        scope.requests.push(Request::CopyCommand);
    }
    if command(Key::T) {
        scope.requests.push(Request::CopyCamera);
    }
    if command(Key::S) {
        scope
            .requests
            .push(Request::Save(scope.panels.save_path.trim().into()));
    }
    if command(Key::O) {
        scope.panels.browse(ctx);
    }
    if command(Key::L) {
        (
            scope.remembered.panels,
            scope.panels.open[0],
            scope.panels.wants_path,
        ) = (true, true, true);
    }
    if command(Key::Q) {
        scope.requests.push(Request::Quit);
    }
    for (slot, key) in DIGITS.into_iter().enumerate() {
        if command(key) {
            scope.session.controls.bookmarks[slot] = Some(scope.session.controls.camera);
            scope.session.note = format!("bookmark {} set", slot + 1);
        }
    }
    let bare = |key| ctx.input_mut(|input| input.consume_key(Modifiers::NONE, key));
    if bare(Key::F11) {
        scope.requests.push(Request::Fullscreen);
    }
    if bare(Key::F12) {
        scope.requests.push(Request::Screenshot(window_path()));
    }
    if bare(Key::F2) {
        scope.remembered.panels ^= true;
    }
}

fn camera_keys(ctx: &Context, scope: &mut Scope<'_>) {
    let controls = &mut scope.session.controls;
    let down = |key| ctx.input(|input| input.key_down(key) && !input.modifiers.command);
    let pressed = |key| ctx.input(|input| input.key_pressed(key) && !input.modifiers.command);
    let axis = |back, forth| f32::from(i8::from(down(forth)) - i8::from(down(back)));
    let seconds = ctx.input(|input| input.stable_dt.min(0.1));
    let along = Vec3::new(
        axis(Key::A, Key::D),
        axis(Key::Q, Key::E),
        axis(Key::S, Key::W),
    );
    let turn = [
        axis(Key::ArrowLeft, Key::ArrowRight),
        axis(Key::ArrowUp, Key::ArrowDown),
    ];
    if along != Vec3::ZERO {
        let hurry = if ctx.input(|input| input.modifiers.shift) {
            4.0
        } else {
            1.0
        };
        controls.fly(hurry * along, seconds);
    }
    let turns_sky = ctx.input(|input| input.modifiers.shift) && turn[0] != 0.0;
    if turn != [0.0; 2] && !turns_sky {
        controls.drag(turn.map(|turn| turn * TURN_POINTS * seconds));
    }
    if along != Vec3::ZERO || turn != [0.0; 2] {
        scope.panels.held = true;
        ctx.request_repaint();
    }
    let notches =
        i8::from(pressed(Key::Plus) || pressed(Key::Equals)) - i8::from(pressed(Key::Minus));
    if notches != 0 {
        controls.wheel(f32::from(notches));
    }
    if pressed(Key::O) {
        controls.mode = if controls.mode == Mode::Fly {
            Mode::Orbit
        } else {
            Mode::Fly
        };
    }
    if pressed(Key::Home) {
        controls.go_home();
    }
    if pressed(Key::F) {
        let picture = scope.panels.picture;
        controls.frame_scene((picture.width() / picture.height().max(1.0)).max(1e-3));
    }
    for (slot, key) in DIGITS.into_iter().enumerate() {
        if let Some(camera) = controls.bookmarks[slot].filter(|_| pressed(key)) {
            controls.camera = camera;
        }
    }
    if turns_sky {
        scope.session.drag_sky(turn[0] * TURN_POINTS * seconds);
    }
}
