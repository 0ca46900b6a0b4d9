//! Where probes stand: on the lattice, or moved from there.

use glam::Vec3;

use super::explore::explore;
use super::lattice::Lattice;
use super::relocate::relocate;
use super::snap::snap;
use super::volume::Volume;
use crate::gi::Settings;
use crate::graph::{Error, FrameStats, Gpu};
use crate::render::GpuScene;
use crate::render::bvh::SceneRays;

/// How many probes there are, and where they stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standing {
    /// Along the longest side of the scene.
    probes: u32,
    /// How far inside of its bounds the outermost are (spacings).
    outer_layer: f32,
    placement: Placement,
}

impl Standing {
    /// As the settings say.
    pub(super) fn new(settings: &Settings) -> Self {
        Standing {
            probes: settings.count("probes"),
            outer_layer: settings.number("outer_layer"),
            placement: Placement::new(settings),
        }
    }

    /// Where they stand in a scene before they are moved.
    pub fn lattice(&self, scene: &GpuScene) -> Lattice {
        Lattice::within(scene.lit_bounds(), self.probes, self.outer_layer)
    }

    /// Puts them where a scene needs them as it is, from `places`, which become the new ones. The
    /// rest is as [`Placement::places`] has it.
    pub fn put(
        &self,
        (gpu, scene): (&Gpu, &GpuScene),
        triangles: &SceneRays,
        (volume, places): (&Volume, &mut Vec<Vec3>),
        how: (u32, f32),
    ) -> Result<FrameStats, Error> {
        let lattice = &volume.lattice;
        let (needed, stats) = (self.placement).places((gpu, scene), triangles, lattice, how)?;
        volume.put(gpu, &needed, places)?;
        *places = needed;
        Ok(stats)
    }
}

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
