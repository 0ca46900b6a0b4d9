//! Technique `svo`: a sparse voxel octree with bricks (Crassin et al. 2011; Crassin & Green 2012),
//! cone-traced.

pub mod attributes;
pub mod bricks;
pub mod dynamic;
mod entry;
pub mod nodes;
pub mod oracle;
pub mod pieces;
pub mod touched;

use std::sync::Arc;

pub use attributes::AttributeBricks;
pub use bricks::{BrickPool, BrickSettings, RecordRange, face_stride};
pub use dynamic::TouchedVoxels;
pub use entry::ENTRY;
pub use nodes::NodePool;
pub use pieces::{Occupancy, OccupiedCube, PieceVoxelizer, Pieces};

use super::{Parts, Relit, VoxelStore};
use crate::gi::Context;
use crate::gi::settings::Settings;
use crate::gi::shared::cone::volume::volume_passes;
use crate::gi::shared::cone::{Bound, ConeTracer, Volume, VolumePasses, VoxelVolume};
use crate::gi::shared::voxel::{
    Directionality, LightSettings, LitVoxels, Prefilter, Sides, VoxelGrid, VoxelSettings,
};
use crate::graph::{Access, Binding, Buffer, Error, Frame, FrameStats, Gpu, Image};
use crate::render::LightMaps;

/// The passes of cones through the octree.
pub static CONES: VolumePasses = volume_passes!(
    "gi/voxel_cones/svo",
    ["CORNERS", "NORMALS"],
    [
        Binding::buffer("nodes", Access::ComputeRead),
        Binding::sampled("bricks", Access::ComputeSampled),
        Binding::sampled("normals_of_bricks", Access::ComputeSampled),
    ]
);

/// The volume of a sparse voxel octree: the node pool, the brick pool, and normal bricks where
/// texels shine by their normals. `corners`: its texels are at corners of voxels, not where those
/// of dense mips are. `faces`: the levels with six faces, and bricks from a face of a tile to the
/// next; without normal bricks.
pub fn volume<'v>(
    grid: VoxelGrid,
    nodes: &'v Arc<Buffer>,
    bricks: &'v Arc<Image>,
    normals: Option<&'v Arc<Image>>,
    corners: bool,
    (directionality, face_stride): (Directionality, u32),
) -> Volume<'v> {
    Volume {
        passes: &CONES,
        grid,
        bound: [
            ("nodes", Bound::Buffer(nodes)),
            ("bricks", Bound::Image(bricks)),
            ("normals_of_bricks", Bound::Image(normals.unwrap_or(bricks))),
        ],
        constants: [("CORNERS", corners), ("NORMALS", normals.is_some())]
            .map(|(name, is_on)| Some((name, u32::from(is_on)))),
        directionality,
        sides: 1 + u32::from(normals.is_some() || directionality.faces().is_some()),
        voxels_across: grid.resolution,
        face_stride,
    }
}

/// What is built from the scene.
struct Octree {
    voxels: Pieces,
    nodes: NodePool,
    bricks: BrickPool,
    attributes: Option<AttributeBricks>,
}

/// Voxels, their light, and the octree over them.
pub struct Svo {
    light_settings: LightSettings,
    bricks: BrickSettings,
    has_normals: bool,
    has_attributes: bool,
    voxelizer: PieceVoxelizer,
    octree: Option<Octree>,
}

impl VoxelStore for Svo {
    fn new(context: &Context<'_>, settings: &Settings, parts: &Parts) -> Result<Self, Error> {
        let Context { gpu, scene, .. } = *context;
        let has_normals = settings.is("normals", "toksvig");
        let directionality = Directionality::new(settings);
        let faces = directionality.faces();
        let sides = if has_normals || faces.is_some() {
            Sides::Two
        } else {
            Sides::One
        };
        let voxel_settings = VoxelSettings {
            faces,
            ..VoxelSettings::new(settings)
        };
        let mut voxelizer = PieceVoxelizer::new(gpu, scene, voxel_settings)?;
        // The bricks of a tile's faces are counted from the end of the pool, which dynamic tiles
        // would move.
        voxelizer.follows = directionality == Directionality::Isotropic;
        Ok(Svo {
            light_settings: LightSettings {
                stores_faces: faces.is_some(),
                emission: parts.emission,
                ..LightSettings::new(settings, sides)
            },
            has_normals,
            has_attributes: settings.is("attributes", "on"),
            bricks: BrickSettings {
                corners: settings.is("lattice", "corners"),
                filter: Prefilter::new(settings) as u32,
                is_split: settings.is("filter_split", "three"),
                touched: settings.is("filter", "touched"),
                directionality,
            },
            voxelizer,
            octree: None,
        })
    }

    fn light_settings(&self) -> &LightSettings {
        &self.light_settings
    }

    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        // The old octree goes first, so that rebuilding needs no more memory than building.
        self.octree = None;
        let (voxels, occupancy, mut stats) =
            self.voxelizer
                .run(context.gpu, context.scene, self.light_settings)?;
        let build = if voxels.touched().is_some() {
            NodePool::build_static
        } else {
            NodePool::build
        };
        let (mut nodes, built) = build(context.gpu, &occupancy, self.bricks.corners)?;
        stats.append(built);
        // Needed no more, and the bricks are the largest of all.
        drop(occupancy);
        if let Some(touched) = voxels.touched() {
            stats.append(nodes.follow(context.gpu, &touched)?);
        }
        let (bricks, cleared) = if self.has_normals {
            BrickPool::with_normals(context.gpu, &nodes, self.bricks, voxels.records())?
        } else {
            BrickPool::new(context.gpu, &nodes, self.bricks)?
        };
        stats.append(cleared);
        let mut attributes = None;
        if self.has_attributes {
            let (made, written) =
                AttributeBricks::new(context.gpu, &nodes, self.bricks, &voxels.records())?;
            stats.append(written);
            attributes = Some(made);
        }
        self.octree = Some(Octree {
            voxels,
            nodes,
            bricks,
            attributes,
        });
        Ok(stats)
    }

    fn follow_models(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        let Some(mut octree) = self.octree.take() else {
            return self.build(context);
        };
        let Some(mut stats) =
            octree
                .voxels
                .set_pose(context.gpu, context.scene, &mut self.voxelizer)?
        else {
            drop(octree);
            return self.build(context);
        };
        if let Some(touched) = octree.voxels.touched() {
            stats.append(octree.nodes.follow(context.gpu, &touched)?);
        }
        stats.append(
            octree
                .bricks
                .follow(context.gpu, &octree.nodes, octree.voxels.records())?,
        );
        if let Some(attributes) = &mut octree.attributes {
            stats.append(attributes.follow(
                context.gpu,
                &octree.nodes,
                &octree.voxels.records(),
            )?);
        }
        self.octree = Some(octree);
        Ok(stats)
    }

    fn light(&mut self, frame: &mut Frame, maps: &LightMaps, _is_last: bool) -> bool {
        let Some(octree) = &mut self.octree else {
            return false;
        };
        let Octree {
            voxels,
            nodes,
            bricks,
            ..
        } = octree;
        voxels.update(frame, maps, &nodes.nodes);
        bricks.update(frame, nodes, &voxels.radiance);
        true
    }

    fn bounce(&self, frame: &mut Frame, cones: &ConeTracer) {
        if let (Some(octree), Some(volume)) = (&self.octree, self.volume()) {
            octree.voxels.bounce(frame, cones, volume);
        }
    }

    fn relight(&mut self, frame: &mut Frame, maps: &LightMaps, relit: Relit) {
        if let Some(octree) = &mut self.octree {
            let Octree {
                voxels,
                nodes,
                bricks,
                ..
            } = octree;
            voxels.relight(frame, maps, relit.viewer);
            bricks.update(frame, nodes, &voxels.radiance);
        }
    }

    fn volume(&self) -> Option<Volume<'_>> {
        let Octree {
            voxels,
            nodes,
            bricks,
            ..
        } = self.octree.as_ref()?;
        let BrickSettings {
            corners,
            directionality,
            ..
        } = self.bricks;
        let faces = (directionality, face_stride(nodes, directionality));
        let (image, normals) = (&bricks.image, bricks.normals());
        Some(volume(
            voxels.grid,
            &nodes.nodes,
            image,
            normals,
            corners,
            faces,
        ))
    }

    fn volumes(&self) -> Vec<VoxelVolume<'_>> {
        let (Some(octree), Some(light)) = (&self.octree, self.volume()) else {
            return Vec::new();
        };
        let Octree {
            voxels,
            nodes,
            attributes,
            ..
        } = octree;
        let of = |name, volume| VoxelVolume {
            name,
            volume,
            levels: nodes.levels.len() as u32,
        };
        let pools = attributes.iter().flat_map(|attributes| attributes.pools());
        let attributes = pools.map(|bricks| {
            let faces = (Directionality::Isotropic, 0);
            volume(
                voxels.grid,
                &nodes.nodes,
                bricks,
                None,
                self.bricks.corners,
                faces,
            )
        });
        let names = ["light", "albedo", "normal", "emission"].into_iter();
        names
            .zip(std::iter::once(light).chain(attributes))
            .map(|(name, volume)| of(name, volume))
            .collect()
    }

    fn lit_voxels(&mut self) -> Vec<LitVoxels<'_>> {
        let octree = self.octree.iter_mut();
        octree.flat_map(|octree| octree.voxels.lit()).collect()
    }

    fn voxel_size(&self) -> Option<f32> {
        Some(self.octree.as_ref()?.voxels.grid.voxel_size)
    }

    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let Some(Octree {
            voxels,
            nodes,
            bricks,
            ..
        }) = &self.octree
        else {
            return Ok(Vec::new());
        };
        let tiles = u64::from(nodes.tile_count());
        let mut counts = voxels.counts(gpu)?;
        counts.extend([("nodes", 8 * tiles), ("tiles", tiles), ("bricks", tiles)]);
        counts.extend(
            bricks
                .touched_count(gpu)?
                .map(|touched| ("touched_tiles", touched)),
        );
        Ok(counts)
    }
}
