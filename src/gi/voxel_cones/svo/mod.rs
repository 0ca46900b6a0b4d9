//! Technique `svo`: a sparse voxel octree with bricks (Crassin et al. 2011; Crassin & Green 2012),
//! cone-traced.

pub mod attributes;
pub mod brick_passes;
pub mod bricks;
pub mod dynamic;
pub mod dynamic_passes;
mod entry;
pub mod indirection;
pub mod nodes;
pub mod oracle;
pub mod pieces;
pub mod space;
pub mod touched;
pub mod volume;

pub use attributes::AttributeBricks;
pub use bricks::{BrickPool, BrickSettings, RecordRange, face_stride};
pub use dynamic::TouchedVoxels;
pub use entry::ENTRY;
pub use nodes::NodePool;
pub use pieces::{Occupancy, OccupiedCube, PieceVoxelizer, Pieces};
use space::OctreeSpace;
pub use volume::CONES;

use super::{Gatherer, Parts, Relit, VoxelStore};
use crate::gi::Context;
use crate::gi::settings::Settings;
use crate::gi::shared::cone::{Volume, VoxelVolume};
use crate::gi::shared::voxel::trace::space::space_passes;
use crate::gi::shared::voxel::{
    Directionality, LightInputs, LightSettings, LitVoxels, NormalLobe, Prefilter, Space,
    SpacePasses, VoxelSettings,
};
use crate::graph::compute::read;
use crate::graph::{Access, Binding, Error, Frame, FrameStats, Gpu};

/// The passes of rays through the octree.
pub static RAYS: SpacePasses = space_passes!(
    "gi/voxel_cones/svo",
    ["SIDES", "SURFACE_WORDS", "RADIANCE_TEXELS"],
    [
        Binding::sampled("cells", Access::ComputeSampled),
        Binding::sampled("blocks", Access::ComputeSampled),
        read("surfaces"),
        read("voxel_radiance"),
        Binding::sampled("radiance_texels", Access::ComputeSampled)
    ]
);

/// What is built from the scene.
struct Octree {
    voxels: Pieces,
    nodes: NodePool,
    /// Absent where nothing traces cones.
    bricks: Option<BrickPool>,
    attributes: Option<AttributeBricks>,
    /// Only where rays gather the diffuse light.
    space: Option<OctreeSpace>,
}

/// Voxels, their light, and the octree over them.
pub struct Svo {
    light_settings: LightSettings,
    bricks: BrickSettings,
    /// Whether anything traces cones.
    has_bricks: bool,
    /// Whether rays gather the diffuse light.
    has_rays: bool,
    has_attributes: bool,
    voxelizer: PieceVoxelizer,
    octree: Option<Octree>,
}

impl VoxelStore for Svo {
    fn new(context: &Context<'_>, settings: &Settings, parts: &Parts) -> Result<Self, Error> {
        let Context { gpu, scene, .. } = *context;
        let lobe = NormalLobe::new(settings);
        let directionality = Directionality::new(settings);
        let faces = directionality.faces();
        let sides = (parts.gatherer).sides(faces.is_some() || lobe.is_some());
        let has_attributes = settings.is("attributes", "on");
        let has_bricks = has_attributes || parts.gatherer.needs_volume(parts.has_cones);
        let voxel_settings = VoxelSettings {
            faces,
            ..VoxelSettings::new(settings)
        };
        let mut voxelizer = PieceVoxelizer::new(gpu, scene, voxel_settings)?;
        // The bricks of a tile's faces are counted from the end of the pool, which dynamic tiles
        // would move.
        voxelizer.follows = directionality == Directionality::Isotropic;
        voxelizer.has_bricks = has_bricks;
        Ok(Svo {
            light_settings: LightSettings {
                stores_faces: faces.is_some(),
                emission: parts.emission,
                ..LightSettings::new(settings, sides)
            },
            has_bricks,
            has_rays: parts.gatherer.rays.is_some(),
            has_attributes,
            bricks: BrickSettings {
                corners: settings.is("lattice", "corners"),
                filter: Prefilter::new(settings) as u32,
                is_split: settings.is("filter_split", "three"),
                touched: settings.is("filter", "touched"),
                directionality,
                lobe,
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
        let (mut voxels, occupancy, mut stats) =
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
            stats.append(nodes.follow(context.gpu, &touched, None)?);
        }
        let mut bricks = None;
        if self.has_bricks {
            let records = (self.bricks.lobe).map(|_| voxels.records());
            let sides = self.light_settings.sides;
            let (made, cleared) = BrickPool::new(context.gpu, &nodes, self.bricks, sides, records)?;
            stats.append(cleared);
            bricks = Some(made);
        } else {
            nodes.forget_neighbours(context.gpu)?;
        }
        let mut attributes = None;
        if self.has_attributes {
            let (made, written) =
                AttributeBricks::new(context.gpu, &nodes, self.bricks, &voxels.records())?;
            stats.append(written);
            attributes = Some(made);
        }
        let mut space = None;
        if self.has_rays {
            stats.append(voxels.pack(context.gpu)?);
            space = Some(OctreeSpace::new(context.gpu, &nodes)?);
        }
        self.octree = Some(Octree {
            voxels,
            nodes,
            bricks,
            attributes,
            space,
        });
        Ok(stats)
    }

    fn follow_models(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        let Some(mut octree) = self.octree.take() else {
            return self.build(context);
        };
        let (gpu, scene) = (context.gpu, context.scene);
        let posed = (octree.voxels).set_pose(gpu, scene, &mut self.voxelizer, &octree.nodes)?;
        let Some((mut stats, counted)) = posed else {
            drop(octree);
            return self.build(context);
        };
        if let Some(touched) = octree.voxels.touched() {
            stats.append(octree.nodes.follow(gpu, &touched, counted)?);
        }
        if let Some(bricks) = &mut octree.bricks {
            let records = octree.voxels.records();
            bricks.follow(context.gpu, &octree.nodes, records)?;
        }
        if let Some(attributes) = &mut octree.attributes {
            attributes.follow(context.gpu, &octree.nodes, &octree.voxels.records())?;
        }
        if let Some(space) = &mut octree.space {
            *space = OctreeSpace::new(context.gpu, &octree.nodes)?;
        }
        self.octree = Some(octree);
        Ok(stats)
    }

    fn light(&mut self, frame: &mut Frame, lights: LightInputs<'_>, _is_last: bool) -> bool {
        let Some(octree) = &mut self.octree else {
            return false;
        };
        let Octree {
            voxels,
            nodes,
            bricks,
            ..
        } = octree;
        voxels.update(frame, lights, &nodes.nodes);
        if let Some(bricks) = bricks {
            bricks.update(frame, nodes, &voxels.radiance);
        }
        true
    }

    fn bounce(&self, frame: &mut Frame, gatherer: &Gatherer) {
        if let Some(octree) = &self.octree {
            let space = self.space();
            let through = (self.volume(), space.as_ref());
            octree.voxels.bounce(frame, gatherer, through);
        }
    }

    fn relight(&mut self, frame: &mut Frame, lights: LightInputs<'_>, relit: Relit) {
        if let Some(octree) = &mut self.octree {
            let Octree {
                voxels,
                nodes,
                bricks,
                ..
            } = octree;
            voxels.relight(frame, lights, relit.viewer);
            if let Some(bricks) = bricks {
                bricks.update(frame, nodes, &voxels.radiance);
            }
        }
    }

    fn volume(&self) -> Option<Volume<'_>> {
        let Octree {
            voxels,
            nodes,
            bricks,
            ..
        } = self.octree.as_ref()?;
        Some(bricks.as_ref()?.volume(voxels.grid, nodes))
    }

    fn space(&self) -> Option<Space<'_>> {
        let Octree { voxels, space, .. } = self.octree.as_ref()?;
        let sides = self.light_settings.sides;
        space.as_ref()?.as_space(voxels, sides)
    }

    fn volumes(&self) -> Vec<VoxelVolume<'_>> {
        let Some(Octree {
            voxels,
            nodes,
            bricks: Some(bricks),
            attributes,
            ..
        }) = &self.octree
        else {
            return Vec::new();
        };
        let light = bricks.volume(voxels.grid, nodes);
        let of = |name, volume| VoxelVolume {
            name,
            volume,
            levels: nodes.levels.len() as u32,
        };
        let pools = attributes.iter().flat_map(|attributes| attributes.pools());
        let attributes = pools.map(|pool| bricks.volume_of(voxels.grid, nodes, pool));
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
        counts.extend([("nodes", 8 * tiles), ("tiles", tiles)]);
        if let Some(bricks) = bricks {
            counts.push(("bricks", tiles));
            let touched = bricks.touched_count(gpu)?;
            counts.extend(touched.map(|touched| ("touched_tiles", touched)));
        }
        Ok(counts)
    }
}
