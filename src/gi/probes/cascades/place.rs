//! Where probes are moved to that stand too near to a surface: [`super::super::relocate`], without
//! the host.

use std::sync::Arc;

use super::passes::{PLACE, PlaceParams};
use crate::gi::probes::list::Listed;
use crate::gi::probes::rays::{Moved, ProbeRays, corners};
use crate::graph::{Buffer, Frame};
use crate::render::bvh::SceneRays;

/// Of its rays, a probe looks along at most so many.
pub const RAYS: u32 = 128;

/// Adds [`PLACE`]: puts each of these probes at least `distance` (spacings) off surfaces. With a
/// box in which something has moved (m) they stand already, and those near it go where they would
/// be put now. `homes`, of the whole list: xyz: place on the lattice (m); w: spacing there (m).
pub fn place(
    frame: &mut Frame,
    triangles: &SceneRays,
    rays: &ProbeRays,
    probes: Listed<'_>,
    [homes, places]: [&Arc<Buffer>; 2],
    (distance, moved): (f32, Option<Moved>),
) {
    if probes.count == 0 {
        return;
    }
    let [low, high] = corners(moved);
    triangles
        .bind(probes.bind(frame.pass(&PLACE)))
        .bind("probe_places", places)
        .bind("ray_set", &rays.set)
        .bind("probe_homes", homes)
        .constant("KEEPS", moved.is_some())
        .push(&PlaceParams {
            low,
            high,
            ray_count: rays.count,
            first_probe: probes.first,
            probe_count: probes.count,
            distance,
        })
        .dispatch([probes.count.min(65_535), probes.count.div_ceil(65_535), 1]);
}
