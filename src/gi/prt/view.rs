//! What the camera sees of points and of their transfer.

use std::sync::Arc;

use super::points::Points;
use super::seen::Seen;
use crate::gi::inspect::{Channels, Scale, ViewRow};
use crate::graph::{Access, Binding, Frame, Image, Pass, Sets, Shaders};
use crate::render::screen_groups;

/// What was drawn of the points, as a view. A thread a pixel.
pub static VIEW: Pass = Pass {
    name: "prt.view",
    shaders: Shaders::Compute("gi/prt/view.comp"),
    bindings: &[
        Binding::sampled("drawn", Access::ComputeSampled),
        Binding::image("seen", Access::ComputeWrite),
    ],
    constants: &[],
    params: None,
    sets: Sets::Scene,
};

const fn row(name: &'static str, scale: Scale, help: &'static str) -> ViewRow {
    ViewRow {
        name,
        aliases: &[],
        help,
        unit: "",
        scale,
        channels: Channels::Rgb,
    }
}

const POINTS: &str = "transfer-points";
const CLUSTERS: &str = "transfer-clusters";

/// The views.
pub(super) static VIEWS: [ViewRow; 3] = [
    row(
        POINTS,
        Scale::Share,
        "the points that transfer is kept of, each in a colour of its own",
    ),
    row(
        "transfer",
        Scale::Signed,
        "a coefficient of transfer a level: 0 is that of the whole sky, 1 to 3 are those of its \
         first gradients; red, green and blue of the light that surfaces reflect",
    ),
    row(
        CLUSTERS,
        Scale::Share,
        "the clusters of points, each in a colour of its own",
    ),
];

/// Levels of a view.
pub(super) fn levels(view: &ViewRow, points: &Points, order: u32) -> u32 {
    match view.name {
        POINTS => 1,
        CLUSTERS => u32::from(points.irradiance.clusters().is_some()),
        "transfer" => order * order,
        _ => 0,
    }
}

/// Adds the passes that draw one of them. The light of points is as it was afterwards.
pub(super) fn draw(
    frame: &mut Frame,
    (view, level): (&ViewRow, u32),
    (points, seen_by): (&Points, &Seen),
    (size, seen): ([u32; 2], &Arc<Image>),
) {
    match view.name {
        POINTS => seen_by.draw_marks(frame, points, None, size),
        CLUSTERS => seen_by.draw_marks(frame, points, points.irradiance.clusters(), size),
        _ => {
            points.light_with(frame, Some(level));
            seen_by.draw(frame, points, size, false);
            points.light_with(frame, None);
        }
    }
    frame
        .pass(&VIEW)
        .bind("drawn", seen_by.drawn())
        .bind("seen", seen)
        .dispatch(screen_groups(size));
}
