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

use crate::gi::registry::{Directions, Entry, Part, Stage};
use crate::gi::settings::{Domain, Preset, Setting, SettingError, Settings};
use crate::gi::shared::cone::{self, ConeTracer, EmissivePatches, Volume};
use crate::gi::shared::interleave::{self, deinterleave};
use crate::gi::shared::voxel::{
    self, Bounces, Directionality, FACE_SETTINGS, Injection, LightSettings, MIP_FILTER, Prefilter,
    Sides, Viewer, VoxelSettings,
};
use crate::gi::{
    Context, IndirectLight, LitVoxels, Probe, ProbeAxis, ProbeSurface, Technique, VoxelVolume,
};
use crate::graph::{Error, Frame, FrameStats, Gpu, Image, Pass};
use crate::render::{GBuffer, GpuScene, LightMaps, Output, screen_image};
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
    &voxel::INJECT_RSM_SPARSE,
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
    passes: &[
        voxel::PASSES,
        PASSES,
        cone::SPARSE_PASSES,
        interleave::PASSES,
    ],
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
        &Stage {
            name: "gather",
            part: Part::Picture,
            passes: &["cone.gather", "cone.occlusion", "gi.deinterleave"],
        },
        &Stage {
            name: "specular",
            part: Part::Picture,
            passes: &["cone.specular"],
        },
        &cone::SOFT_SHADOWS,
    ],
    directions: &[
        Directions {
            pass: &cone::GATHER.sparse,
            count: Some(cone::diffuse_count),
        },
        Directions {
            pass: &cone::SPECULAR.sparse,
            count: None,
        },
    ],
    substitutions: &[cone::SUBSTITUTIONS, voxel::SUBSTITUTIONS],
    voxels: Some(voxel::list_voxels),
    make,
};

/// What is built from the scene.
struct Store {
    voxels: Pieces,
    nodes: NodePool,
    bricks: BrickPool,
    attributes: Option<AttributeBricks>,
}

impl Store {
    fn volume(
        &self,
        BrickSettings {
            corners,
            directionality,
            ..
        }: BrickSettings,
    ) -> Volume<'_> {
        let face_stride = face_stride(&self.nodes, directionality);
        Volume::Sparse {
            nodes: &self.nodes.nodes,
            bricks: &self.bricks.image,
            normals: self.bricks.normals(),
            corners,
            directionality,
            face_stride,
        }
    }
}

/// The technique and what it keeps.
struct Svo {
    light_settings: LightSettings,
    bricks: BrickSettings,
    has_normals: bool,
    has_attributes: bool,
    cones: ConeTracer,
    /// Of surfaces that emit, where cones see them.
    patches: Option<EmissivePatches>,
    interleave: u32,
    voxelizer: PieceVoxelizer,
    store: Option<Store>,
    light: IndirectLight,
    /// The gather's result before the tile's patterns are averaged; absent without interleaving.
    interleaved: Option<Arc<Image>>,
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
    let Context {
        gpu, scene, size, ..
    } = *context;
    let specular = scene.is_glossy && settings.is("specular", "on");
    let interleave = settings.count("interleave");
    let filter = Prefilter::new(settings) as u32;
    let has_normals = settings.is("normals", "toksvig");
    let directionality = Directionality::new(settings);
    let faces = directionality.faces();
    let sides = if has_normals || faces.is_some() {
        Sides::Two
    } else {
        Sides::One
    };
    let mut voxelizer = PieceVoxelizer::new(
        gpu,
        scene,
        VoxelSettings {
            faces,
            ..VoxelSettings::new(settings)
        },
    )?;
    // The bricks of a tile's faces are counted from the end of the pool, which dynamic tiles would
    // move.
    voxelizer.follows = directionality == Directionality::Isotropic;
    let patches = EmissivePatches::new(gpu, scene, settings)?;
    Ok(Box::new(Svo {
        light_settings: LightSettings {
            stores_faces: faces.is_some(),
            emission_apart: patches.is_some(),
            ..LightSettings::new(settings, sides)
        },
        has_normals,
        has_attributes: settings.is("attributes", "on"),
        bricks: BrickSettings {
            corners: settings.is("lattice", "corners"),
            filter,
            is_split: settings.is("filter_split", "three"),
            touched: settings.is("filter", "touched"),
            directionality,
        },
        cones: ConeTracer::new(gpu, settings)?,
        patches,
        interleave,
        voxelizer,
        store: None,
        light: IndirectLight {
            diffuse: screen_image(gpu, "svo.diffuse", size)?,
            specular: specular
                .then(|| screen_image(gpu, "svo.specular", size))
                .transpose()?,
        },
        interleaved: (interleave > 1)
            .then(|| screen_image(gpu, "svo.interleaved", size))
            .transpose()?,
    }))
}

impl Technique for Svo {
    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        // The old store goes first, so that rebuilding needs no more memory than building.
        self.store = None;
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
        self.store = Some(Store {
            voxels,
            nodes,
            bricks,
            attributes,
        });
        Ok(stats)
    }

    fn set_pose(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        if context.scene.dynamic.is_none() {
            return Ok(FrameStats::default());
        }
        if let Some(patches) = &mut self.patches {
            patches.follow(context.gpu, context.scene)?;
        }
        let Some(mut store) = self.store.take() else {
            return self.build(context);
        };
        let Some(mut stats) =
            store
                .voxels
                .set_pose(context.gpu, context.scene, &mut self.voxelizer)?
        else {
            drop(store);
            return self.build(context);
        };
        if let Some(touched) = store.voxels.touched() {
            stats.append(store.nodes.follow(context.gpu, &touched)?);
        }
        stats.append(
            store
                .bricks
                .follow(context.gpu, &store.nodes, store.voxels.records())?,
        );
        if let Some(attributes) = &mut store.attributes {
            stats.append(attributes.follow(context.gpu, &store.nodes, &store.voxels.records())?);
        }
        self.store = Some(store);
        Ok(stats)
    }

    fn needs_rsm(&self) -> bool {
        self.light_settings.injection == Injection::Rsm
    }

    fn needs_light_maps(&self) -> bool {
        self.light_settings.reads_maps() || !self.cones.has_shadows()
    }

    fn update(&mut self, frame: &mut Frame, _scene: &GpuScene, maps: &LightMaps) {
        let Some(store) = &mut self.store else { return };
        store.voxels.update(frame, maps, &store.nodes.nodes);
        store
            .bricks
            .update(frame, &store.nodes, &store.voxels.radiance);
        let count = self.light_settings.bounces.before_the_picture();
        for bounce in 1..=count {
            store
                .voxels
                .bounce(frame, &self.cones, store.volume(self.bricks));
            store.voxels.relight(
                frame,
                maps,
                if bounce == count {
                    Viewer::Picture
                } else {
                    Viewer::Voxels
                },
            );
            store
                .bricks
                .update(frame, &store.nodes, &store.voxels.radiance);
        }
        if self.light_settings.bounces == Bounces::Feedback {
            store
                .voxels
                .bounce(frame, &self.cones, store.volume(self.bricks));
            if self.patches.is_some() {
                store.voxels.relight(frame, maps, Viewer::Picture);
                store
                    .bricks
                    .update(frame, &store.nodes, &store.voxels.radiance);
            }
        }
    }

    fn gather(
        &mut self,
        frame: &mut Frame,
        _scene: &GpuScene,
        maps: &LightMaps,
        gbuffer: &GBuffer,
    ) -> IndirectLight {
        let Some(store) = &mut self.store else {
            return self.light.clone();
        };
        let volume = store.volume(self.bricks);
        let target = self.interleaved.as_ref().unwrap_or(&self.light.diffuse);
        self.cones
            .gather(frame, gbuffer, &store.voxels.grid, volume, target);
        self.cones
            .occlusion(frame, gbuffer, &store.voxels.grid, volume, target);
        if let Some(interleaved) = &self.interleaved {
            deinterleave(
                frame,
                gbuffer,
                interleaved,
                &self.light.diffuse,
                self.interleave,
            );
        }
        if let Some(patches) = &self.patches {
            self.cones.patches(
                frame,
                gbuffer,
                &store.voxels.grid,
                volume,
                patches,
                &self.light.diffuse,
            );
        }
        if let Some(specular) = &self.light.specular {
            if self.patches.is_some() {
                store.voxels.relight(frame, maps, Viewer::Voxels);
                store
                    .bricks
                    .update(frame, &store.nodes, &store.voxels.radiance);
            }
            self.cones.specular(
                frame,
                gbuffer,
                &store.voxels.grid,
                store.volume(self.bricks),
                specular,
            );
        }
        self.light.clone()
    }

    fn direct(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        maps: &LightMaps,
        gbuffer: &GBuffer,
        output: &Output,
    ) {
        match &self.store {
            Some(store) if self.cones.has_shadows() => {
                self.cones.shadow(
                    frame,
                    scene,
                    gbuffer,
                    &store.voxels.grid,
                    store.volume(self.bricks),
                    &output.direct,
                );
            }
            _ => output.draw_direct(frame, scene, maps, gbuffer),
        }
    }

    fn count_samples(
        &self,
        gpu: &Gpu,
        scene: &GpuScene,
        gbuffer: &GBuffer,
    ) -> Result<Vec<(&'static str, u64)>, Error> {
        let Some(store) = &self.store else {
            return Ok(Vec::new());
        };
        self.cones.count_samples(
            gpu,
            scene,
            gbuffer,
            &store.voxels.grid,
            store.volume(self.bricks),
            [true, self.light.specular.is_some()],
        )
    }

    fn probe(
        &self,
        context: &Context<'_>,
        surface: &ProbeSurface,
        axis: ProbeAxis,
        aperture_deg: Option<f32>,
    ) -> Result<Option<Probe>, Error> {
        let Some(store) = &self.store else {
            return Ok(None);
        };
        self.cones
            .probe(
                context,
                &store.voxels.grid,
                store.volume(self.bricks),
                surface,
                (axis, aperture_deg),
            )
            .map(Some)
    }

    fn volumes(&self) -> Vec<VoxelVolume<'_>> {
        let Some(store) = &self.store else {
            return Vec::new();
        };
        let Store {
            voxels,
            nodes,
            attributes,
            ..
        } = store;
        let of = |name, volume| VoxelVolume {
            name,
            grid: voxels.grid,
            volume,
            levels: nodes.levels.len() as u32,
        };
        let mut volumes = vec![of("light", store.volume(self.bricks))];
        let pools = attributes.iter().flat_map(|attributes| attributes.pools());
        volumes.extend(["albedo", "normal", "emission"].into_iter().zip(pools).map(
            |(name, bricks)| {
                let volume = Volume::Sparse {
                    nodes: &nodes.nodes,
                    bricks,
                    normals: None,
                    corners: self.bricks.corners,
                    directionality: Directionality::Isotropic,
                    face_stride: 0,
                };
                of(name, volume)
            },
        ));
        volumes
    }

    fn lit_voxels(&mut self) -> Vec<LitVoxels<'_>> {
        self.store
            .iter_mut()
            .flat_map(|store| store.voxels.lit())
            .collect()
    }

    fn voxel_size(&self) -> Option<f32> {
        self.store
            .as_ref()
            .map(|store| store.voxels.grid.voxel_size)
    }

    fn counts(&self, gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let Some(Store {
            voxels,
            nodes,
            bricks,
            ..
        }) = &self.store
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
