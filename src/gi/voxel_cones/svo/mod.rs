//! Technique `svo`: a sparse voxel octree with bricks (Crassin et al. 2011; Crassin & Green 2012),
//! cone-traced.

pub mod attributes;
pub mod bricks;
pub mod dynamic;
pub mod nodes;
pub mod oracle;
pub mod pieces;
pub mod touched;

use std::sync::Arc;

pub use attributes::AttributeBricks;
pub use bricks::{BrickPool, BrickSettings, RecordRange, face_stride};
pub use dynamic::TouchedVoxels;
pub use nodes::NodePool;
pub use pieces::{Occupancy, OccupiedCube, PieceVoxelizer, Pieces};

use super::{Parts, Relit, VoxelCones, VoxelStore};
use crate::gi::entry::{Entry, Part, Stage};
use crate::gi::settings::{Domain, Preset, Setting, SettingError, Settings};
use crate::gi::shared::cone::volume::volume_passes;
use crate::gi::shared::cone::{self, Bound, ConeTracer, Constant, Volume, VolumePasses};
use crate::gi::shared::interleave;
use crate::gi::shared::voxel::{
    self, Bounces, Directionality, FACE_SETTINGS, LightSettings, MIP_FILTER, Prefilter, Sides,
    VoxelGrid, VoxelSettings,
};
use crate::gi::{Context, LitVoxels, Technique, VoxelVolume};
use crate::graph::{Access, Binding, Buffer, Error, Frame, FrameStats, Gpu, Image, Pass};
use crate::render::LightMaps;
use crate::shader::{Field, GpuStruct};

static SETTINGS: &[Setting] = &[
    Setting {
        name: "lattice",
        help: "where the bricks' texels are: centres (those of the dense mips' texels; a level is \
               made of 2³ finer texels) or corners (of voxels, as published: voxels spread to \
               eight corners, a level is the 27-tap Gaussian of the finer one)",
        unit: "",
        domain: Domain::Choice(&["centres", "corners"]),
        default: "centres",
    },
    MIP_FILTER,
    Setting {
        name: "filter_split",
        help: "on corners, the filter of a level in one pass, or in three: centres, faces and \
               edges, corners of bricks, whose threads then have equal work",
        unit: "",
        domain: Domain::Choice(&["one", "three"]),
        default: "one",
    },
    Setting {
        name: "filter",
        help: "tiles whose bricks an update makes anew: touched (that hold light, or did in the \
               last update; on corners all) or all; the bits are the same",
        unit: "",
        domain: Domain::Choice(&["touched", "all"]),
        default: "touched",
    },
    Setting {
        name: "normals",
        help: "which way the light of a texel leaves it: off (all ways alike) or toksvig (bricks \
               also hold the mean normal of what shines, and a cone sees the share that faces it, \
               of normals that are spread by Toksvig's variance)",
        unit: "",
        domain: Domain::Choice(&["off", "toksvig"]),
        default: "off",
    },
    Setting {
        name: "attributes",
        help: "bricks of the voxels' albedo, mean normal and, where the scene emits, emission \
               too, so that they can be seen on all levels; no cone reads them",
        unit: "",
        domain: Domain::Choice(&["off", "on"]),
        default: "off",
    },
];

static PRESETS: &[Preset] = &[
    Preset {
        name: "accurate",
        help: "as cones, but 32 of them and so narrow that they read the finest levels",
        values: &[cone::NARROWEST],
    },
    Preset {
        name: "cones",
        help: "cones as they converge best for their time: narrow, interleaved, kept off the \
               receiver's plane, through bricks that stay opaque",
        values: &[],
    },
    Preset {
        name: "anisotropic",
        help: "as cones, through mips that look different along each axis from either side",
        values: &[voxel::ANISOTROPIC],
    },
    Preset {
        name: "directional",
        help: "as cones, through voxels of six faces on all levels, either side of which blocks",
        values: &[voxel::DIRECTIONAL],
    },
    Preset {
        name: "textbook",
        help: "as the papers have it: voxels spread to corners, Gaussian bricks, six cones of 60°",
        values: &[
            &[
                ("lattice", "corners"),
                ("mip_filter", "box"),
                ("filter_split", "three"),
            ],
            cone::TEXTBOOK,
        ],
    },
];

/// The passes of this module.
pub static PASSES: &[&Pass] = &[
    &nodes::REDUCE_POINTS,
    &nodes::FLAG_NODES,
    &nodes::SCAN_NODES,
    &nodes::ALLOCATE_TILES,
    &nodes::LINK_LEAVES,
    &nodes::LINK_NEIGHBOURS,
    &bricks::WRITE_LEAVES,
    &bricks::WRITE_NORMALS,
    &attributes::WRITE_ATTRIBUTES,
    &bricks::TRANSFER_BORDERS,
    &bricks::FILTER,
    &bricks::COPY_BRICKS,
    &dynamic::MARK_AFFECTED,
    &dynamic::FLAG_DYNAMIC,
    &dynamic::ALLOCATE_DYNAMIC,
    &dynamic::FLAG_TEXELS,
    &dynamic::KEEP_STATIC,
    &touched::FLAG_TOUCHED,
    &touched::LIST_TOUCHED,
    &pieces::INJECT_RSM,
];

/// The structs that this module shares with shaders.
pub static STRUCTS: &[(&str, &[Field])] = &[
    (nodes::Level::NAME, nodes::Level::FIELDS),
    (nodes::ReduceParams::NAME, nodes::ReduceParams::FIELDS),
    (nodes::FlagParams::NAME, nodes::FlagParams::FIELDS),
    (nodes::LevelParams::NAME, nodes::LevelParams::FIELDS),
    (nodes::LeafParams::NAME, nodes::LeafParams::FIELDS),
    (bricks::BrickParams::NAME, bricks::BrickParams::FIELDS),
    (bricks::RecordParams::NAME, bricks::RecordParams::FIELDS),
    (bricks::TransferParams::NAME, bricks::TransferParams::FIELDS),
    (
        bricks::CopyBricksParams::NAME,
        bricks::CopyBricksParams::FIELDS,
    ),
    (
        dynamic::AffectedParams::NAME,
        dynamic::AffectedParams::FIELDS,
    ),
    (dynamic::DynamicParams::NAME, dynamic::DynamicParams::FIELDS),
    (dynamic::TexelParams::NAME, dynamic::TexelParams::FIELDS),
    (dynamic::KeepParams::NAME, dynamic::KeepParams::FIELDS),
    (touched::Touched::NAME, touched::Touched::FIELDS),
    (touched::TouchParams::NAME, touched::TouchParams::FIELDS),
    (
        touched::ListTouchedParams::NAME,
        touched::ListTouchedParams::FIELDS,
    ),
];

/// The passes of cones through the octree.
pub static CONES: VolumePasses = volume_passes!(
    "gi/voxel_cones/svo",
    [
        Binding::buffer("nodes", Access::ComputeRead),
        Binding::sampled("bricks", Access::ComputeSampled),
        Binding::sampled("normals_of_bricks", Access::ComputeSampled),
    ]
);

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    name: "svo",
    summary: "sparse voxel octree with bricks, cone-traced",
    bounces: |settings| Bounces::new(settings).count(),
    settings: &[
        voxel::RESOLUTION,
        voxel::SETTINGS,
        SETTINGS,
        FACE_SETTINGS,
        cone::SETTINGS,
    ],
    check,
    presets: PRESETS,
    passes: &[voxel::PASSES, PASSES, &CONES.all(), interleave::PASSES],
    structs: &[voxel::STRUCTS, STRUCTS, cone::STRUCTS, interleave::STRUCTS],
    stages: &[
        &voxel::VOXELIZATION,
        &Stage {
            name: "node flagging and allocation",
            part: Part::Store,
            passes: &[
                "svo.copy_occupancy",
                "svo.clear",
                "svo.reduce_points",
                "svo.flag_nodes",
                "svo.scan_nodes",
                "svo.allocate_tiles",
                "svo.link_leaves",
                "svo.link_neighbours",
                "svo.mark_affected",
                "svo.flag_dynamic",
                "svo.allocate_dynamic",
                "svo.flag_texels",
                "svo.grow",
                "svo.copy_bricks",
            ],
        },
        &voxel::LIGHT_INJECTION,
        &Stage {
            name: "touched tiles",
            part: Part::Store,
            passes: &["svo.clear_touched", "svo.flag_touched", "svo.list_touched"],
        },
        &Stage {
            name: "leaf writing",
            part: Part::Store,
            passes: &[
                "svo.clear_bricks",
                "svo.merge_radiance",
                "svo.write_leaves",
                "svo.write_normals",
                "svo.write_attributes",
            ],
        },
        &Stage {
            name: "border transfer",
            part: Part::Store,
            passes: &["svo.transfer_borders", "svo.keep_static"],
        },
        &Stage {
            name: "mip filtering",
            part: Part::Store,
            passes: &["svo.filter"],
        },
        &voxel::BOUNCES,
        &super::GATHER,
        &super::SPECULAR,
        &cone::SOFT_SHADOWS,
    ],
    directions: &super::directions(&CONES),
    substitutions: &[cone::SUBSTITUTIONS, voxel::SUBSTITUTIONS],
    voxels: Some(voxel::list_voxels),
    make,
};

/// The volume of a sparse voxel octree: the node pool, the brick pool, and normal bricks where
/// texels
/// shine by their normals. `corners`: its texels are at corners of voxels, not where those of dense
/// mips are. `faces`: the levels with six faces, and bricks from a face of a tile to the next;
/// without normal bricks.
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
            Bound::Buffer(nodes),
            Bound::Image(bricks),
            Bound::Image(normals.unwrap_or(bricks)),
        ],
        constants: [u32::from(corners), u32::from(normals.is_some())].map(Constant::Is),
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

/// Whether the settings are possible together.
fn check(settings: &Settings) -> Result<(), SettingError> {
    if settings.is("normals", "toksvig")
        && Directionality::new(settings) != Directionality::Isotropic
    {
        return Err(SettingError::Together(
            "normals = toksvig needs anisotropic = off and faces = one: faces know which way \
             their light leaves them"
                .into(),
        ));
    }
    cone::check(settings)
}

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(VoxelCones::<Svo>::new(context, settings, "svo")?))
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
                emission_apart: parts.has_patches,
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
