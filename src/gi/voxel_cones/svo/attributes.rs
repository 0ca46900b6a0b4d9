//! Attribute bricks: what the voxels are, on all levels (Crassin et al. 2011, section 4). They
//! change with the geometry alone, and the light's update leaves them be.

use std::sync::Arc;

use super::brick_passes::RecordParams;
use super::bricks::{BrickSettings, RecordRange, enlarge, pool_image};
use super::nodes::NodePool;
use super::touched::Tiles;
use crate::gi::shared::voxel::Directionality;
use crate::gi::shared::voxel::build::buffer;
use crate::graph::{Access, Binding, Buffer, Error, Frame, FrameStats, Gpu, Image, Pass};
use crate::shader::GpuStruct;

/// An attribute of the voxels of each leaf tile into its own brick. A thread a texel.
pub static WRITE_ATTRIBUTES: Pass = Pass {
    constants: &["CORNERS", "ATTRIBUTE", "TOUCHED"],
    ..Pass::compute(
        "svo.write_attributes",
        "gi/voxel_cones/svo/write_attributes.comp",
        &[
            Binding::buffer("nodes", Access::ComputeRead),
            Binding::image("bricks", Access::ComputeWrite),
            Binding::buffer("voxel_records", Access::ComputeRead),
            Binding::buffer("voxel_emission", Access::ComputeRead),
            Binding::buffer("touched_levels", Access::ComputeRead),
            Binding::buffer("touched_tiles", Access::ComputeRead),
        ],
        RecordParams::LAYOUT,
    )
};

/// RGBA16F, each in a pool of its own: albedo (0 to 1), mean normal (components −1 to 1) and, in a
/// scene that emits, emission (W/(m² sr)), premultiplied by opacity; opacity.
pub struct AttributeBricks {
    pools: Vec<Arc<Image>>,
    settings: BrickSettings,
    /// Bricks that there is room for in each pool.
    capacity: u32,
    /// Bound where nothing is read.
    nothing: Arc<Buffer>,
}

impl AttributeBricks {
    /// The pools' names, in the order of `ATTRIBUTE` (`gi/voxel_cones/svo/write_attributes.comp`).
    const NAMES: [&'static str; 3] = ["svo.albedo", "svo.mean_normals", "svo.emission"];

    /// Allocates and fills a brick for each tile and attribute. Lattice and filter are the same as
    /// for the bricks of the light; no texel has faces.
    pub fn new(
        gpu: &Gpu,
        nodes: &NodePool,
        settings: BrickSettings,
        records: &[RecordRange],
    ) -> Result<(Self, FrameStats), Error> {
        let count = if records.iter().any(|range| range.emission.is_some()) {
            3
        } else {
            2
        };
        let capacity = nodes.room();
        let pools = Self::NAMES[..count]
            .iter()
            .map(|name| pool_image(gpu, name, capacity))
            .collect::<Result<_, _>>()?;
        let settings = BrickSettings {
            directionality: Directionality::Isotropic,
            lobe: None,
            ..settings
        };
        let bricks = AttributeBricks {
            pools,
            settings,
            capacity,
            nothing: buffer(gpu, "svo.nothing", 0)?,
        };
        let mut frame = Frame::new();
        for pool in &bricks.pools {
            // What no tile writes, a brick's last texels without a neighbour, stays zero.
            frame.clear_image("svo.clear_bricks", pool, [0.0; 4]);
        }
        bricks.write(&mut frame, nodes, records, |level| {
            Tiles::all(nodes, level, &bricks.nothing)
        });
        let stats = gpu.submit(frame)?;
        Ok((bricks, stats))
    }

    /// Brings the dynamic bricks up to voxels that have changed; the static ones stay as they are.
    pub fn follow(
        &mut self,
        gpu: &Gpu,
        nodes: &NodePool,
        records: &[RecordRange],
    ) -> Result<(), Error> {
        let mut frame = Frame::new();
        if nodes.room() > self.capacity {
            for pool in &mut self.pools {
                *pool = enlarge(gpu, &mut frame, nodes, pool)?;
            }
            self.capacity = nodes.room();
        }
        self.write(&mut frame, nodes, records, |level| {
            Tiles::dynamic(nodes, level, &self.nothing)
        });
        gpu.enqueue(frame);
        Ok(())
    }

    /// Albedo, mean normal, emission.
    pub fn pools(&self) -> &[Arc<Image>] {
        &self.pools
    }

    fn write<'t>(
        &self,
        frame: &mut Frame,
        nodes: &NodePool,
        records: &[RecordRange],
        tiles: impl Fn(usize) -> Tiles<'t>,
    ) {
        for level in 0..nodes.levels.len() {
            let tiles = tiles(level);
            for (attribute, pool) in self.pools.iter().enumerate() {
                for range in records.iter().filter(|_| level == 0) {
                    let emission = range.emission.as_ref().unwrap_or(&self.nothing);
                    let pass = frame
                        .pass(&WRITE_ATTRIBUTES)
                        .bind("nodes", &nodes.nodes)
                        .bind("bricks", pool)
                        .bind("voxel_records", &range.records)
                        .bind("voxel_emission", emission)
                        .constant("CORNERS", self.settings.corners)
                        .constant("ATTRIBUTE", attribute as u32);
                    let texels = self.settings.leaf_texels();
                    tiles.dispatch(pass, &range.params(&tiles), texels);
                }
                self.settings.complete(frame, nodes, pool, &tiles);
            }
        }
    }
}
