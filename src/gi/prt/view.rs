//! What the camera sees of points and of their transfer.

use std::sync::Arc;

use super::points::Points;
use super::seen::Seen;
use crate::gi::inspect::{Channels, Scale, ViewRow};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Frame, Image, Pass, Sets, Shaders};
use crate::render::screen_groups;
use crate::shader::GpuStruct;

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

gpu_struct! {
    /// Parameters of `prt.lobes_view`.
    pub struct LobesViewParams {
        /// Band of the harmonic that is added.
        pub l: u32,
        /// Its place in the band, −l to l.
        pub m: i32,
        /// From ball to ball (px).
        pub tile_px: u32,
    }
}

/// Adds a harmonic of what was drawn to balls. A thread a pixel.
pub static LOBES_VIEW: Pass = Pass {
    name: "prt.lobes_view",
    shaders: Shaders::Compute("gi/prt/lobes_view.comp"),
    bindings: &[
        Binding::sampled("drawn", Access::ComputeSampled),
        Binding::image("seen", Access::ComputeReadWrite),
    ],
    constants: &[],
    params: Some(LobesViewParams::LAYOUT),
    sets: Sets::Scene,
};

/// Balls along the height of a picture.
const BALLS: u32 = 8;

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
const LOBES: &str = "transfer-lobes";

/// The views.
pub(super) static VIEWS: [ViewRow; 4] = [
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
        LOBES,
        Scale::Signed,
        "balls, each with the transfer of the point below its middle: what light brings that comes \
         from the side where the ball has the colour; around them, how open surfaces are",
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
        POINTS | LOBES => 1,
        CLUSTERS => u32::from(points.irradiance.clusters().is_some()),
        "transfer" => order * order,
        _ => 0,
    }
}

/// Adds the passes that draw one of them. The light of points is as it was afterwards.
pub(super) fn draw(
    frame: &mut Frame,
    (view, level): (&ViewRow, u32),
    (points, seen_by, order): (&Points, &Seen, u32),
    (size, seen): ([u32; 2], &Arc<Image>),
) {
    match view.name {
        LOBES => {
            draw_lobes(frame, (points, seen_by, order), (size, seen));
            return;
        }
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

fn draw_lobes(
    frame: &mut Frame,
    (points, seen_by, order): (&Points, &Seen, u32),
    (size, seen): ([u32; 2], &Arc<Image>),
) {
    for harmonic in 0..order * order {
        let l = harmonic.isqrt();
        points.light_with(frame, Some(harmonic));
        seen_by.draw(frame, points, size, false);
        frame
            .pass(&LOBES_VIEW)
            .bind("drawn", seen_by.drawn())
            .bind("seen", seen)
            .push(&LobesViewParams {
                l,
                m: (harmonic - l * l) as i32 - l as i32,
                tile_px: (size[1] / BALLS).max(4),
            })
            .dispatch(screen_groups(size));
    }
    points.light_with(frame, None);
}
