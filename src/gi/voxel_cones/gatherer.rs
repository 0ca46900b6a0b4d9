//! How light is gathered from the voxels: by cones, or by rays.

use std::sync::Arc;

use crate::gi::Settings;
use crate::gi::shared::cone::{ConeTracer, Volume};
use crate::gi::shared::voxel::{RaySettings, RayTracer, Sides, Space, VoxelRecords};
use crate::graph::{Buffer, Error, Frame, Gpu};

/// Cones, which glossy surfaces have in any case, and rays, where they gather the diffuse light.
pub struct Gatherer {
    /// Cones through the store's volume.
    pub cones: ConeTracer,
    /// Rays through the store's space.
    pub rays: Option<RayTracer>,
}

impl Gatherer {
    /// From a technique's settings.
    pub fn new(gpu: &Gpu, settings: &Settings) -> Result<Self, Error> {
        let is_by_rays = !settings.is("gather", "cones");
        let directions = settings.count("bounce_directions");
        Ok(Gatherer {
            cones: ConeTracer::new(gpu, settings)?,
            rays: is_by_rays.then(|| RayTracer::new(RaySettings::new(settings), directions)),
        })
    }

    /// Radiances of a voxel: as many as rays ask for, or for cones one, and two where texels tell
    /// sides apart.
    pub fn sides(&self, are_told_apart: bool) -> Sides {
        match &self.rays {
            Some(rays) => rays.settings.sides,
            None if are_told_apart => Sides::Two,
            None => Sides::One,
        }
    }

    /// Whether anything marches through a volume; `has_others`: mirrors and patches do.
    pub fn needs_volume(&self, has_others: bool) -> bool {
        self.rays.is_none() || has_others || self.cones.is_beside_gather()
    }

    /// Adds the pass by which voxels gather from each other.
    pub fn bounce(
        &self,
        frame: &mut Frame,
        voxels: &VoxelRecords,
        (volume, space): (Option<Volume<'_>>, Option<&Space<'_>>),
        irradiance: &Arc<Buffer>,
    ) {
        if let Some(rays) = &self.rays {
            if let Some(space) = space {
                rays.bounce(frame, voxels, space, irradiance);
            }
        } else if let Some(volume) = volume {
            self.cones.bounce(frame, voxels, volume, irradiance);
        }
    }
}
