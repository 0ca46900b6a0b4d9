//! Where probes stand: on the lattice, or moved from there.

use glam::Vec3;

use super::explore::explore;
use super::lattice::Lattice;
use super::relocate::relocate;
use super::snap::snap;
use crate::gi::Settings;
use crate::graph::{Error, FrameStats, Gpu};
use crate::render::GpuScene;
use crate::render::bvh::SceneRays;

/// Where probes stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Placement {
    /// On the lattice.
    Lattice,
    /// Away from what is nearer than so many cells.
    Relocated(f32),
    /// So many cells off the surfaces that look them up.
    Snapped(f32),
}

impl Placement {
    /// As the settings say.
    pub(super) fn new(settings: &Settings) -> Self {
        let distance = settings.number("surface_distance");
        if settings.is("placement", "snap") {
            Placement::Snapped(distance)
        } else if settings.is("placement", "relocate") {
            Placement::Relocated(distance)
        } else {
            Placement::Lattice
        }
    }

    /// The place of each probe (m) in a scene as it is, and what finding them cost. Probes have
    /// `ray_count` rays; surfaces look them up `normal_bias` (cells) off.
    pub fn places(
        self,
        (gpu, scene): (&Gpu, &GpuScene),
        triangles: &SceneRays,
        lattice: &Lattice,
        (ray_count, normal_bias): (u32, f32),
    ) -> Result<(Vec<Vec3>, FrameStats), Error> {
        match self {
            Placement::Lattice => Ok((lattice.places().collect(), FrameStats::default())),
            Placement::Relocated(distance) => {
                relocate((gpu, scene), triangles, lattice, (distance, ray_count))
            }
            Placement::Snapped(distance) => {
                let (seen, stats) = explore(gpu, scene, triangles)?;
                Ok((snap(lattice, &seen, distance, normal_bias), stats))
            }
        }
    }
}
