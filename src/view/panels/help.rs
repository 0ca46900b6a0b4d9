//! The keyboard overview.

use egui::{Align2, Context, Grid, RichText, Window};

/// Keys and what they do.
const KEYS: &[(&str, &str)] = &[
    ("F1", "this overview"),
    ("F2", "panels on and off"),
    ("W A S D", "fly forward, left, back, right"),
    ("Q E", "fly down, up"),
    ("Shift", "four times as fast"),
    ("drag", "look around (fly), go around the target (orbit)"),
    ("right drag, arrow keys", "pan; arrow keys turn"),
    ("Ctrl+drag, Shift+← →", "turn the sky"),
    ("wheel, + −", "speed (fly), distance (orbit)"),
    ("O", "fly or orbit"),
    ("F", "frame the whole scene"),
    ("Home", "the scene's own camera"),
    ("1 … 9", "go to a bookmark"),
    ("Ctrl+1 … Ctrl+9", "set a bookmark"),
    ("C", "one picture, split, difference to the reference"),
    ("< >", "move the divider"),
    ("V, Shift+V", "next view, view before"),
    ("P, Escape", "trace a beam at the pointer, no beam"),
    ("[ ]", "exposure down, up by a quarter stop"),
    ("Ctrl+O", "browse for a scene (/ types a path there)"),
    ("Ctrl+L", "type a scene's path or name"),
    ("Ctrl+C", "copy the `lumivox render` command"),
    ("Ctrl+T", "copy the camera as TOML"),
    ("Ctrl+S", "save the picture"),
    ("F11", "fullscreen"),
    ("F12", "save the window as PNG"),
    ("Ctrl+Q", "quit"),
];

/// Draws it where it is wanted.
pub(super) fn show(ctx: &Context, open: &mut bool) {
    Window::new("Keys")
        .open(open)
        .collapsible(false)
        .resizable(false)
        .vscroll(true)
        .max_height(ctx.content_rect().height() - 60.0)
        .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
        .show(ctx, |ui| {
            Grid::new("keys")
                .num_columns(2)
                .spacing([18.0, 3.0])
                .show(ui, |ui| {
                    for (key, what) in KEYS {
                        ui.label(RichText::new(*key).strong());
                        ui.label(*what);
                        ui.end_row();
                    }
                });
            ui.separator();
            ui.label("Drop a .toml, .obj, .gltf or .glb file on the window to open it.");
        });
}
