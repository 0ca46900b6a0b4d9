//! What rays of probes meet.

use super::borrowed::{Borrowed, SOURCE_RESOLUTION, STORE};
use super::list::Listed;
use super::raster::{MovedPast, RasterSource};
use super::rays::{MomentFilter, ProbeRays};
use super::volume::Volume;
use super::voxels::VoxelSource;
use crate::gi::settings::{Domain, Group, Rule, Setting};
use crate::gi::shared::paths::PathScene;
use crate::gi::{Context, Settings};
use crate::graph::{Error, Frame};
use crate::render::GpuScene;

/// What probes see.
pub(super) const SOURCE_SETTINGS: &[Setting] = &[
    Setting {
        name: "source",
        help: "what rays of probes meet: triangles; or voxels, each face of which has the light \
               that is there once a frame, with walls a voxel thick; raster, the triangles that \
               are drawn into a cube of views around each probe; or store, the voxels of another \
               technique",
        unit: "",
        domain: Domain::Choice(&["triangles", "voxels", "raster", "store"]),
        default: "triangles",
    },
    STORE,
    SOURCE_RESOLUTION,
    Setting {
        name: "raster_texels",
        help: "edge of each of the six views around a probe",
        unit: "texels",
        domain: Domain::OneOf(&[8, 16, 32, 64, 128]),
        default: "32",
    },
];

/// In which group these settings are, and when they have an effect.
pub(super) const SOURCE_RULES: &[Rule] = &[
    Rule::always(Group::Light, &["source"]),
    Rule {
        group: Group::Light,
        settings: &["source_resolution"],
        applies: |settings| settings.is("source", "voxels") || borrows(settings),
    },
    Rule {
        group: Group::Light,
        settings: &[STORE.name],
        applies: borrows,
    },
    Rule {
        group: Group::Light,
        settings: &["raster_texels"],
        applies: |settings| settings.is("source", "raster"),
    },
];

/// Whether another technique's store is used, as what probes see or as what surfaces mirror.
pub(super) fn borrows(settings: &Settings) -> bool {
    settings.is("source", "store") || settings.is("specular", "cones")
}

/// What rays of probes meet.
pub enum Source {
    /// The scene's triangles.
    Triangles,
    /// Voxels.
    Voxels(Box<VoxelSource>),
    /// What is drawn around each probe.
    Raster(RasterSource),
    /// The store of another technique.
    Store,
}

impl Source {
    /// As the settings say. Nothing is built yet. `uses_maps`: reflective shadow maps light voxels,
    /// and not rays.
    pub(super) fn new(
        &Context { gpu, scene, .. }: &Context<'_>,
        settings: &Settings,
        uses_maps: bool,
    ) -> Result<Self, Error> {
        if settings.is("source", "voxels") {
            let resolution = settings.count("source_resolution");
            let voxels = VoxelSource::new(gpu, scene, resolution, uses_maps)?;
            Ok(Source::Voxels(Box::new(voxels)))
        } else if settings.is("source", "raster") {
            RasterSource::new(gpu, settings.count("raster_texels")).map(Source::Raster)
        } else if settings.is("source", "store") {
            Ok(Source::Store)
        } else {
            Ok(Source::Triangles)
        }
    }

    /// The voxels, where rays meet those.
    pub(super) fn voxels(&self) -> Option<&VoxelSource> {
        match self {
            Source::Voxels(voxels) => Some(voxels),
            Source::Triangles | Source::Raster(_) | Source::Store => None,
        }
    }

    /// The same, to be built.
    pub(super) fn voxels_mut(&mut self) -> Option<&mut VoxelSource> {
        match self {
            Source::Voxels(voxels) => Some(voxels),
            Source::Triangles | Source::Raster(_) | Source::Store => None,
        }
    }

    /// Adds the passes that find out what these probes see, and how far; of a store that is
    /// `borrowed` only how far, as it brings its light where it is. After models have `moved` past
    /// them, they keep what that cannot have changed.
    pub(super) fn trace(
        &self,
        frame: &mut Frame,
        (scene, paths): (&GpuScene, &PathScene),
        rays: &ProbeRays,
        (volume, probes): (&Volume, Listed<'_>),
        (filter, moved, borrowed): (MomentFilter, Option<MovedPast<'_>>, Option<&Borrowed>),
    ) {
        let by_rays = filter == MomentFilter::Box;
        let bounds = moved.as_ref().map(|moved| moved.bounds);
        match self {
            Source::Triangles => {
                rays.trace(frame, (scene, paths), volume, probes, bounds);
                rays.moments(frame, &paths.rays, (volume, probes), filter, bounds);
                return;
            }
            Source::Voxels(voxels) => {
                voxels.trace(frame, rays, volume, probes, (by_rays, bounds));
            }
            Source::Raster(raster) => {
                let how = (by_rays, moved.as_ref());
                raster.trace(frame, scene, rays, (volume, probes), how);
                rays.pack(frame, (scene, paths), probes);
            }
            Source::Store => {
                if let Some(borrowed) = borrowed {
                    let of = (volume, probes);
                    borrowed.moments(frame, (rays, &paths.rays), of, (filter, bounds));
                }
                return;
            }
        }
        if !by_rays {
            rays.moments(frame, &paths.rays, (volume, probes), filter, None);
        }
    }
}
