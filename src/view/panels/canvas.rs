//! The picture: one or two sides and the divider, the mouse on it, and what is under the pointer.

use std::sync::Arc;

use egui::text::{LayoutJob, TextWrapping};
use egui::{
    Align2, Color32, ColorImage, Context, CursorIcon, FontId, PointerButton, Pos2, Rect, Sense,
    TextureHandle, TextureOptions, Ui, pos2, vec2,
};

use super::{Scope, beam};
use crate::graph::Image as GpuImage;
use crate::view::picture::{Look, ToneMap, develop, difference};
use crate::view::session::{Compare, Session};
use crate::view::views::VIEWS;
use crate::vulkan::PlacedPicture;

/// Behind words over the picture, so that they are read over white too.
const BACKING: Color32 = Color32::from_black_alpha(240);

/// Where pictures are at most this wide (points), names find no room.
const NARROW: f32 = 300.0;

/// Where they are narrower than this, errors find none either.
const TINY: f32 = 100.0;

/// What is shown: light of the device, or textures of what the host has made.
#[derive(Default)]
pub(in crate::view) struct Canvas {
    sides: [Option<Side>; 2],
    difference: Option<Side>,
    /// Of the difference that is shown, in words.
    errors: String,
}

struct Side {
    pixels: Pixels,
    /// Width and height (px).
    size: [u32; 2],
    /// What it was made of.
    of: (u64, u64, Look),
}

enum Pixels {
    /// Drawn beneath the panels.
    Light(Arc<GpuImage>),
    Texture(TextureHandle),
}

impl Side {
    /// Shows other pixels.
    fn set(
        side: &mut Option<Side>,
        ctx: &Context,
        name: &str,
        size: (u32, u32),
        rgb: &[[u8; 3]],
        of: (u64, u64, Look),
    ) {
        let pixels = rgb
            .iter()
            .map(|&[r, g, b]| Color32::from_rgb(r, g, b))
            .collect();
        let image = ColorImage::new([size.0 as usize, size.1 as usize], pixels);
        let texture = match side.take().map(|side| side.pixels) {
            Some(Pixels::Texture(mut texture)) => {
                texture.set(image, TextureOptions::NEAREST);
                texture
            }
            _ => ctx.load_texture(name, image, TextureOptions::NEAREST),
        };
        *side = Some(Side {
            pixels: Pixels::Texture(texture),
            size: size.into(),
            of,
        });
    }
}

impl Canvas {
    /// Brings the textures up to the newest pictures.
    pub(in crate::view) fn update(&mut self, ctx: &Context, session: &Session) {
        let look = session.look();
        for (side, newest) in self.sides.iter_mut().zip(&session.newest) {
            let Some(newest) = newest else {
                *side = None;
                continue;
            };
            let of = (newest.version, 0, look);
            if side.as_ref().is_some_and(|side| side.of == of) {
                continue;
            }
            if let Some(light) = &newest.picture.light {
                *side = Some(Side {
                    pixels: Pixels::Light(Arc::clone(light)),
                    size: newest.picture.size,
                    of,
                });
                continue;
            }
            match &newest.picture.image {
                Some(image) => Side::set(
                    side,
                    ctx,
                    "picture",
                    image.size(),
                    &develop(image, &VIEWS[newest.picture.view], look),
                    of,
                ),
                None => *side = None,
            }
        }
        let (Some(newest), Some(truth)) = (
            &session.newest[0],
            session
                .truth
                .as_ref()
                .filter(|_| session.compare == Compare::Difference),
        ) else {
            self.difference = None;
            return;
        };
        let of = (
            newest.version,
            2 * u64::from(truth.samples) + u64::from(truth.is_done),
            Look {
                exposure: session.difference_scale,
                ..look
            },
        );
        let is_new = self.difference.as_ref().is_none_or(|side| side.of != of);
        if let Some(image) = newest
            .picture
            .image
            .as_ref()
            .filter(|_| is_new && newest.picture.job == truth.job && newest.picture.is_full)
            && let Some((rgb, errors)) =
                difference(image, &truth.image, truth.noise, session.difference_scale)
        {
            Side::set(
                &mut self.difference,
                ctx,
                "difference",
                image.size(),
                &rgb,
                of,
            );
            self.errors = errors.told(truth.is_done);
        }
    }

    /// Width and height of what a side shows (px); `None` where it shows nothing.
    pub(in crate::view) fn size(&self, side: usize) -> Option<[u32; 2]> {
        Some(self.sides[side].as_ref()?.size)
    }

    /// What is wrong with the left picture in all, in words; empty where it is not known.
    pub(in crate::view) fn errors(&self) -> &str {
        self.difference.as_ref().map_or("", |_| &self.errors)
    }

    /// Whether the left side is the picture of this version.
    pub(in crate::view) fn shows(&self, version: u64) -> bool {
        self.sides[0]
            .as_ref()
            .is_some_and(|side| side.of.0 == version)
    }

    /// Draws the picture and lets the mouse act on it.
    pub(super) fn show(&self, ctx: &Context, scope: &mut Scope<'_>) {
        egui::CentralPanel::default()
            .frame(egui::Frame::NONE)
            .show(ctx, |ui| {
                let scale = ctx.pixels_per_point();
                let outer = ui.max_rect();
                // Whole pixels, so that one of the picture is one of the window; egui's first
                // frame, and the one after its scale changed, may be of another size.
                let [width, height] = scope.window_size;
                let size = [(outer.width(), width), (outer.height(), height)]
                    .map(|(points, most)| ((points * scale).round() as u32).min(most));
                let corner = pos2(
                    (outer.left() * scale).round() / scale,
                    (outer.top() * scale).round() / scale,
                );
                let rect = Rect::from_min_size(
                    corner,
                    vec2(size[0] as f32 / scale, size[1] as f32 / scale),
                );
                (scope.panels.picture, scope.session.size) = (rect, size);
                scope.panels.pictures = self.draw(ui, rect, scope.session);
                let response = ui.interact(rect, ui.id().with("picture"), Sense::click_and_drag());
                let on_divider = divider(ui, rect, scope);
                if !on_divider {
                    mouse(ui, &response, scope);
                }
                scope.panels.pointer = response
                    .hover_pos()
                    .map(|at| ((at - rect.min) / rect.size()).into());
                let followed = &mut scope.session.beam;
                if followed.follows && followed.place.is_some() {
                    followed.place = scope.panels.pointer.or(followed.place);
                }
                scope.panels.readout = response
                    .hover_pos()
                    .and_then(|at| readout(scope.session, rect, at))
                    .unwrap_or_default();
            });
    }

    /// Draws all but the pictures of the device, and says where these are.
    fn draw(&self, ui: &Ui, rect: Rect, session: &Session) -> Vec<PlacedPicture> {
        let mut placed = Vec::new();
        let split_x = rect.left() + session.divider * rect.width();
        let [left, right] = [
            Rect::from_min_max(rect.min, pos2(split_x, rect.bottom())),
            Rect::from_min_max(pos2(split_x, rect.top()), rect.max),
        ];
        let (sides, names): (Vec<_>, [String; 2]) = match session.compare {
            Compare::Single => (vec![(&self.sides[0], rect)], Default::default()),
            Compare::Split => (
                vec![(&self.sides[0], left), (&self.sides[1], right)],
                [0, 1].map(|index| title(session, index)),
            ),
            Compare::Difference => {
                let waiting = if self.difference.is_some() {
                    format!("|difference|: {}", self.errors)
                } else {
                    "the reference is being rendered".to_owned()
                };
                (
                    vec![(&self.sides[0], left), (&self.difference, right)],
                    [title(session, 0), waiting],
                )
            }
        };
        let uv = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        let font = FontId::proportional(13.0);
        for (index, (side, clip)) in sides.iter().enumerate() {
            let painter = ui.painter().with_clip_rect(clip.intersect(ui.clip_rect()));
            match side {
                Some(side) => match &side.pixels {
                    Pixels::Light(light) => {
                        let clip = painter.clip_rect();
                        placed.push(place(light, side.size, (ui, rect, clip), session.look()));
                    }
                    // A light map is square whatever the window is.
                    Pixels::Texture(texture) => drop(painter.image(
                        texture.id(),
                        fitted(rect, side, session),
                        uv,
                        Color32::WHITE,
                    )),
                },
                None if index < session.pane_count() => {
                    let text = if session.newest[index].is_some() {
                        format!("no {} here: see the view's tooltip", session.view_name())
                    } else if session.has_failed() {
                        "no picture".to_owned()
                    } else {
                        "rendering …".to_owned()
                    };
                    painter.text(
                        clip.center(),
                        Align2::CENTER_CENTER,
                        text,
                        font.clone(),
                        Color32::GRAY,
                    );
                }
                None => {}
            }
        }
        beam::draw(ui, rect, session);
        if session.compare != Compare::Single {
            draw_divider(ui, rect, split_x);
        }
        let is_narrow = rect.width() <= NARROW;
        for (index, name) in names.iter().enumerate() {
            // A narrow picture has no room for names, but its error is told nowhere else where
            // there are no panels.
            let is_error = session.compare == Compare::Difference && index == 1;
            let fits = !is_narrow || (is_error && rect.width() >= TINY);
            if !name.is_empty() && fits {
                draw_title(ui, rect, sides[index].1, (index, name));
            }
        }
        placed
    }
}

/// A picture of the device in a rectangle, where a part of the window is its.
fn place(
    light: &Arc<GpuImage>,
    size: [u32; 2],
    (ui, rect, clip): (&Ui, Rect, Rect),
    look: Look,
) -> PlacedPicture {
    let scale = ui.ctx().pixels_per_point();
    let px = |rect: Rect| {
        [rect.min, rect.max].map(|corner| [corner.x, corner.y].map(|at| (at * scale).round()))
    };
    let ([[x, y], end], [low, high]) = (px(rect), px(clip));
    let clip = [0, 1].map(|axis| (low[axis].max(0.0), high[axis].max(0.0)));
    PlacedPicture {
        image: Arc::clone(light),
        size,
        place: [x, y, end[0] - x, end[1] - y],
        clip: [
            clip[0].0 as u32,
            clip[1].0 as u32,
            (clip[0].1 - clip[0].0).max(0.0) as u32,
            (clip[1].1 - clip[1].0).max(0.0) as u32,
        ],
        exposure: look.exposure,
        tone_map: u32::from(look.tone_map == ToneMap::Reinhard),
    }
}

fn draw_divider(ui: &Ui, rect: Rect, split_x: f32) {
    let (painter, handle) = (ui.painter(), pos2(split_x, rect.center().y));
    // Dark around it, so that it is seen over white too.
    for (color, wider) in [(BACKING, 1.0), (Color32::WHITE, 0.0)] {
        let line = egui::Stroke::new(1.0 + 2.0 * wider, color);
        painter.vline(split_x, rect.y_range(), line);
        painter.circle_filled(handle, 5.0 + wider, color);
    }
}

/// The name of a side in its upper corner, over both pictures where it is long.
fn draw_title(ui: &Ui, rect: Rect, side: Rect, (index, name): (usize, &str)) {
    let mut text =
        LayoutJob::simple_singleline(name.to_owned(), FontId::proportional(13.0), Color32::WHITE);
    let is_narrow = rect.width() <= NARROW;
    let width = rect.width() - 16.0;
    text.wrap = if is_narrow {
        TextWrapping::wrap_at_width(width)
    } else {
        TextWrapping::truncate_at_width(width)
    };
    let painter = ui.painter();
    let galley = painter.layout_job(text);
    let x = if index == 0 {
        side.left() + 8.0
    } else {
        side.right() - galley.size().x - 8.0
    };
    // One above the other, so that they never overlap.
    let row = if is_narrow { 0 } else { index };
    let at = pos2(
        x.max(rect.left() + 8.0),
        rect.top() + 6.0 + 24.0 * row as f32,
    );
    painter.rect_filled(
        Rect::from_min_size(at, galley.size()).expand(3.0),
        3.0,
        BACKING,
    );
    painter.galley(at, galley, Color32::WHITE);
}

/// What a side shows.
fn title(session: &Session, index: usize) -> String {
    let choice = &session.choices[index];
    let changed: Vec<String> = choice.pairs();
    format!(
        "{} {} {}",
        choice.entry.name,
        choice.preset.unwrap_or(""),
        changed.join(" ")
    )
    .trim()
    .to_owned()
}

/// The whole picture's rectangle, or for light maps the largest of their shape in it.
fn fitted(rect: Rect, side: &Side, session: &Session) -> Rect {
    if !VIEWS[session.view].is_map() || session.compare == Compare::Difference {
        return rect;
    }
    let size = vec2(side.size[0] as f32, side.size[1] as f32);
    Rect::from_center_size(
        rect.center(),
        size * (rect.width() / size.x).min(rect.height() / size.y),
    )
}

/// Lets the divider be dragged; says whether the mouse is on it.
fn divider(ui: &Ui, rect: Rect, scope: &mut Scope<'_>) -> bool {
    let session = &mut *scope.session;
    if session.compare == Compare::Single || rect.width() < 1.0 {
        return false;
    }
    let x = rect.left() + session.divider * rect.width();
    let handle = Rect::from_x_y_ranges(x - 6.0..=x + 6.0, rect.y_range()).intersect(rect);
    let response = ui
        .interact(handle, ui.id().with("divider"), Sense::drag())
        .on_hover_cursor(CursorIcon::ResizeHorizontal);
    if let Some(at) = response
        .interact_pointer_pos()
        .filter(|_| response.dragged())
    {
        session.divider = ((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
    }
    response.hovered() || response.dragged()
}

fn mouse(ui: &Ui, response: &egui::Response, scope: &mut Scope<'_>) {
    let moved = response.drag_delta();
    let turns_sky = ui.input(|input| input.modifiers.command);
    let controls = &mut scope.session.controls;
    if response.dragged_by(PointerButton::Primary) && turns_sky {
        scope.session.drag_sky(moved.x);
    } else if response.dragged_by(PointerButton::Primary) {
        controls.drag(moved.into());
    } else if response.dragged_by(PointerButton::Secondary)
        || response.dragged_by(PointerButton::Middle)
    {
        controls.pan((moved / response.rect.height().max(1.0)).into());
    }
    scope.panels.held |= response.dragged();
    if response.clicked() || response.drag_started() {
        // So that keys fly again after a text was typed.
        ui.memory_mut(|memory| memory.stop_text_input());
    }
    let notches = ui.input(|input| input.smooth_scroll_delta.y) / 50.0;
    if response.hovered() && notches != 0.0 {
        scope.session.controls.wheel(notches);
    }
}

/// The numbers of the pixel under the pointer.
fn readout(session: &Session, rect: Rect, at: Pos2) -> Option<String> {
    let split_x = rect.left() + session.divider * rect.width();
    let is_right = at.x >= split_x;
    let pane = match session.compare {
        Compare::Split if is_right => 1,
        Compare::Difference if is_right => return None,
        _ => 0,
    };
    let picture = &session.newest[pane].as_ref()?.picture;
    let image = picture
        .image
        .as_ref()
        .filter(|_| picture.is_full && !VIEWS[picture.view].is_map())?;
    let share = (at - rect.min) / rect.size();
    let (x, y) = (
        (share.x * image.width as f32) as u32,
        (share.y * image.height as f32) as u32,
    );
    let pixel = image
        .pixels
        .get((y * image.width + x) as usize)
        .filter(|_| x < image.width)?;
    let view = &VIEWS[picture.view];
    let unit = if view.unit.is_empty() {
        String::new()
    } else {
        format!(" {}", view.unit)
    };
    Some(format!(
        "{x}, {y}: {:.4} {:.4} {:.4}{unit}",
        pixel.x, pixel.y, pixel.z
    ))
}
