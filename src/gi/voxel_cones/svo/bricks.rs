//! The brick pool: 3³ texels a tile in one 3D texture.

use std::sync::Arc;

use super::brick_passes::{
    BrickParams, COPY_BRICKS, CopyBricksParams, FILTER, RecordParams, SUM_BORDERS, SumParams,
    TRANSFER_BORDERS, TransferParams, WRITE_LEAVES, WRITE_NORMALS,
};
use super::indirection::{index_tiles, indirection_image};
use super::nodes::NodePool;
use super::touched::{Tiles, TouchedTiles};
use crate::gi::shared::voxel::build::buffer;
use crate::gi::shared::voxel::{Directionality, NormalLobe, Sides};
use crate::graph::compute::linear_groups;
use crate::graph::{
    Buffer, Error, Frame, FrameStats, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Owner, vk,
};

/// How bricks are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BrickSettings {
    /// Lattice points are corners of voxels, to which these spread; otherwise they are the centres
    /// of the texels of dense mips.
    pub corners: bool,
    /// `mode` of `filter_eight` (`gi/shared/voxel/prefilter.glsl`).
    pub filter: u32,
    /// The filter runs apart for centres, for faces and edges, and for corners.
    pub is_split: bool,
    /// Once all bricks are filled, an update runs on those that light has touched; on centres
    /// only.
    pub touched: bool,
    /// The levels with a brick for each of six faces.
    pub directionality: Directionality,
    /// Whether cones see texels by their mean normals, and how.
    pub lobe: Option<NormalLobe>,
}

impl BrickSettings {
    /// Texels of a leaf tile that its own voxels make.
    pub(super) fn leaf_texels(&self) -> u32 {
        if self.corners { 27 } else { 8 }
    }

    /// Adds the passes that complete the bricks of these tiles. Bricks of the finest level were
    /// written from voxels; the others are made from the finer level.
    pub(super) fn complete(
        &self,
        frame: &mut Frame,
        nodes: &NodePool,
        image: &Arc<Image>,
        tiles: &Tiles,
    ) {
        let level = tiles.level as usize;
        if level > 0 {
            self.filter(frame, nodes, image, tiles);
        }
        self.share_borders(frame, nodes, image, tiles);
        if let Some(dynamic) = &nodes.dynamic {
            dynamic.keep_static(frame, level, image);
        }
    }

    /// Adds the passes after which all copies of a texel are equal.
    fn share_borders(
        &self,
        frame: &mut Frame,
        nodes: &NodePool,
        image: &Arc<Image>,
        tiles: &Tiles,
    ) {
        let own = level_bricks(nodes, self.directionality, tiles.level as usize);
        let BrickParams {
            first,
            count,
            first_dynamic,
            dynamic_count,
            level,
            shift,
            stride,
            ..
        } = tiles.params([own; 2]);
        if !self.corners {
            let pass = frame
                .pass(&TRANSFER_BORDERS)
                .bind("neighbours", &nodes.neighbours)
                .bind("bricks", image)
                .constant("FACES", own.faces);
            let params = TransferParams {
                first,
                count,
                first_dynamic,
                dynamic_count,
                level,
                shift,
                stride,
            };
            return tiles.dispatch(pass, &params, 1);
        }
        for axis in 0..3 {
            frame
                .pass(&SUM_BORDERS)
                .bind("neighbours", &nodes.neighbours)
                .bind("bricks", image)
                .constant("FACES", own.faces)
                .push(&SumParams {
                    first,
                    count,
                    first_dynamic,
                    dynamic_count,
                    axis,
                    shift,
                    stride,
                })
                .dispatch(linear_groups(count + dynamic_count));
        }
    }

    fn filter(&self, frame: &mut Frame, nodes: &NodePool, image: &Arc<Image>, tiles: &Tiles) {
        let level = tiles.level as usize;
        let bricks =
            [level, level - 1].map(|level| level_bricks(nodes, self.directionality, level));
        // Number of the part, and its texels.
        let parts: &[(u32, u32)] = match self {
            BrickSettings { corners: false, .. } => &[(0, 8)],
            BrickSettings { is_split: true, .. } => &[(1, 1), (2, 18), (3, 8)],
            _ => &[(0, 27)],
        };
        for (part, texels) in parts {
            let pass = frame
                .pass(&FILTER)
                .bind("nodes", &nodes.nodes)
                .bind("bricks", image)
                .constant("FILTER", self.filter)
                .constant("CORNERS", self.corners)
                .constant("PART", *part)
                .constant("FACES", bricks[0].faces);
            tiles.dispatch(pass, &tiles.params(bricks), *texels);
        }
    }
}

/// The bricks of the tiles of a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelBricks {
    /// From a tile's index to that of its first brick.
    pub shift: u32,
    /// From a face to the next.
    pub stride: u32,
    /// Bricks of a tile: 1, or 6 where faces differ.
    pub faces: u32,
}

/// The records of the voxels with some compact indices.
pub struct RecordRange {
    /// The first of them.
    pub first_voxel: u32,
    /// Number of voxels, and of records.
    pub voxel_count: u32,
    /// One [`crate::gi::shared::voxel::build::passes::Voxel`] each.
    pub records: Arc<Buffer>,
    /// As [`crate::gi::shared::voxel::Voxels::emission`].
    pub emission: Option<Arc<Buffer>>,
}

impl RecordRange {
    /// Parameters of a pass over tiles of the finest level.
    pub(super) fn params(&self, tiles: &Tiles) -> RecordParams {
        let BrickParams {
            first,
            count,
            first_dynamic,
            dynamic_count,
            level,
            ..
        } = tiles.params(
            [LevelBricks {
                shift: 0,
                stride: 0,
                faces: 1,
            }; 2],
        );
        RecordParams {
            first,
            count,
            first_dynamic,
            dynamic_count,
            level,
            first_voxel: self.first_voxel,
            voxel_count: self.voxel_count,
        }
    }
}

/// Normal bricks, and what they are made of.
struct NormalBricks {
    image: Arc<Image>,
    records: Vec<RecordRange>,
}

/// All bricks of an octree. Where a tile has one, it has the tile's index.
pub struct BrickPool {
    /// RGBA16F: radiance (W/(m² sr)) premultiplied by opacity, opacity.
    pub image: Arc<Image>,
    normals: Option<NormalBricks>,
    /// Where the tiles are.
    pub(super) indirection: Arc<Image>,
    /// Bricks that there is room for.
    capacity: u32,
    pub(super) settings: BrickSettings,
    /// Radiances of a voxel: 1, 2 (a side each) or 6 (a face each).
    sides: u32,
    touched: Option<TouchedTiles>,
    /// Bound where nothing is read.
    nothing: Arc<Buffer>,
    is_filled: bool,
}

impl BrickPool {
    /// Allocates a brick for each tile, all zero; given the records of all voxels, which then have
    /// a radiance for each side, a normal brick as well.
    pub fn new(
        gpu: &Gpu,
        nodes: &NodePool,
        settings: BrickSettings,
        sides: Sides,
        records: Option<Vec<RecordRange>>,
    ) -> Result<(Self, FrameStats), Error> {
        let capacity = nodes.room();
        let image = pool_image(
            gpu,
            "svo.bricks",
            brick_count(nodes, settings.directionality),
        )?;
        let normals = records
            .map(|records| {
                Ok::<_, Error>(NormalBricks {
                    image: pool_image(gpu, "svo.normals", capacity)?,
                    records,
                })
            })
            .transpose()?;
        let mut frame = Frame::new();
        let touched = (settings.touched && !settings.corners)
            .then(|| TouchedTiles::new(gpu, nodes, &mut frame))
            .transpose()?;
        // What no tile writes, a brick's last texels without a neighbour, stays zero.
        for image in std::iter::once(&image).chain(normals.as_ref().map(|normals| &normals.image)) {
            frame.clear_image("svo.clear_bricks", image, [0.0; 4]);
        }
        let indirection = indirection_image(gpu, nodes)?;
        index_tiles(&mut frame, nodes, &indirection);
        let stats = gpu.submit(frame)?;
        Ok((
            BrickPool {
                image,
                normals,
                indirection,
                capacity,
                settings,
                sides: if settings.directionality.faces().is_some() {
                    6
                } else {
                    sides as u32
                },
                touched,
                nothing: buffer(gpu, "svo.nothing", 0)?,
                is_filled: false,
            },
            stats,
        ))
    }

    /// Brings the pool up to dynamic tiles and voxels that have changed: these are the records now.
    /// Where there is no room for the dynamic bricks, the static ones go into a larger pool as
    /// they are.
    pub fn follow(
        &mut self,
        gpu: &Gpu,
        nodes: &NodePool,
        records: Vec<RecordRange>,
    ) -> Result<(), Error> {
        if let Some(touched) = &mut self.touched {
            touched.reserve(gpu, nodes)?;
        }
        if let Some(normals) = &mut self.normals {
            normals.records = records;
        }
        let mut frame = Frame::new();
        index_tiles(&mut frame, nodes, &self.indirection);
        let room = nodes.room();
        if room > self.capacity {
            for image in std::iter::once(&mut self.image)
                .chain(self.normals.as_mut().map(|normals| &mut normals.image))
            {
                *image = enlarge(gpu, &mut frame, nodes, image)?;
            }
            self.capacity = room;
        }
        gpu.enqueue(frame);
        Ok(())
    }

    /// RGBA16F: mean normal of what shines, times its luminance (W/(m² sr)), premultiplied by
    /// opacity; opacity. Where there are normal bricks.
    pub fn normals(&self) -> Option<&Arc<Image>> {
        self.normals.as_ref().map(|normals| &normals.image)
    }

    /// Adds the passes from the voxels' light to all levels.
    pub fn update(&mut self, frame: &mut Frame, nodes: &NodePool, radiance: &Arc<Buffer>) {
        let is_filled = std::mem::replace(&mut self.is_filled, true);
        for level in 0..nodes.levels.len() {
            let tiles = match &self.touched {
                Some(touched) if is_filled => {
                    touched.find(frame, nodes, radiance, self.sides, level)
                }
                _ => Tiles::all(nodes, level, &self.nothing),
            };
            if level == 0 {
                self.write_leaves(frame, nodes, radiance, &tiles);
            }
            for image in std::iter::once(&self.image).chain(self.normals()) {
                self.settings.complete(frame, nodes, image, &tiles);
            }
        }
        if let (Some(touched), false) = (&self.touched, is_filled) {
            for level in 0..nodes.levels.len() {
                touched.find(frame, nodes, radiance, self.sides, level);
            }
        }
    }

    fn write_leaves(
        &self,
        frame: &mut Frame,
        nodes: &NodePool,
        radiance: &Arc<Buffer>,
        tiles: &Tiles,
    ) {
        let texels = self.settings.leaf_texels();
        let pass = frame
            .pass(&WRITE_LEAVES)
            .bind("nodes", &nodes.nodes)
            .bind("voxel_radiance", radiance)
            .bind("bricks", &self.image)
            .constant("CORNERS", self.settings.corners)
            .constant("SIDES", self.sides)
            .constant("NORMALS", self.normals.is_some())
            .constant("FACES", self.settings.directionality.faces().is_some());
        let bricks = level_bricks(nodes, self.settings.directionality, 0);
        tiles.dispatch(pass, &tiles.params([bricks; 2]), texels);
        if let Some(NormalBricks { image, records }) = &self.normals {
            for range in records {
                let pass = frame
                    .pass(&WRITE_NORMALS)
                    .bind("nodes", &nodes.nodes)
                    .bind("voxel_radiance", radiance)
                    .bind("bricks", image)
                    .bind("voxel_records", &range.records)
                    .constant("CORNERS", self.settings.corners);
                tiles.dispatch(pass, &range.params(tiles), texels);
            }
        }
    }

    /// Tiles that the last update ran on, where it ran on some only.
    pub fn touched_count(&self, gpu: &Gpu) -> Result<Option<u64>, Error> {
        self.touched
            .as_ref()
            .map(|touched| touched.count(gpu))
            .transpose()
    }
}

/// Adds the pass that copies the static bricks into a pool with room for all.
pub(super) fn enlarge(
    gpu: &Gpu,
    frame: &mut Frame,
    nodes: &NodePool,
    image: &Arc<Image>,
) -> Result<Arc<Image>, Error> {
    let larger = pool_image(gpu, image.name(), nodes.room())?;
    let brick_count = nodes.static_end();
    frame
        .pass(&COPY_BRICKS)
        .bind("bricks", image)
        .bind("larger_bricks", &larger)
        .push(&CopyBricksParams { brick_count })
        .dispatch(linear_groups(27 * brick_count));
    Ok(larger)
}

/// An image with room for `count` bricks.
pub(super) fn pool_image(gpu: &Gpu, name: &str, count: u32) -> Result<Arc<Image>, Error> {
    gpu.create_image(&ImageDesc {
        name: name.into(),
        extent: pool_extent(count).map(|bricks| 3 * bricks),
        kind: ImageKind::D3,
        format: vk::Format::R16G16B16A16_SFLOAT,
        mips: 1,
        layers: 1,
        usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
        owner: Owner::Store,
    })
}

/// Tiles that have a brick for each face: all, or, as the finest level comes last, the first so
/// many.
pub fn face_stride(nodes: &NodePool, directionality: Directionality) -> u32 {
    match directionality {
        Directionality::Isotropic => 0,
        Directionality::Anisotropic => nodes.levels[0].first,
        Directionality::Directional(_) => nodes.tile_count(),
    }
}

/// Bricks of all tiles.
fn brick_count(nodes: &NodePool, directionality: Directionality) -> u32 {
    nodes.room() + 5 * face_stride(nodes, directionality)
}

/// Where the bricks of a level are.
pub fn level_bricks(nodes: &NodePool, directionality: Directionality, level: usize) -> LevelBricks {
    let stride = face_stride(nodes, directionality);
    match directionality {
        Directionality::Isotropic => LevelBricks {
            shift: 0,
            stride: 0,
            faces: 1,
        },
        Directionality::Anisotropic if level == 0 => LevelBricks {
            shift: 5 * stride,
            stride: 0,
            faces: 1,
        },
        _ => LevelBricks {
            shift: 0,
            stride,
            faces: 6,
        },
    }
}

/// Bricks along each axis of a pool of `count`: near to a cube, width and height powers of two, at
/// most 2% left over (or three bricks).
pub fn pool_extent(count: u32) -> [u32; 3] {
    let count = count.max(1);
    let slice_bits = (count.ilog2() * 2 / 3).min((count / 50).max(1).ilog2());
    let (width, height) = (1 << slice_bits.div_ceil(2), 1 << (slice_bits / 2));
    [width, height, count.div_ceil(width * height)]
}
