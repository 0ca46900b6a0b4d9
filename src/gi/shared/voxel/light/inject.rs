//! Reflective shadow maps into voxels.

use std::sync::Arc;

use glam::IVec3;

use crate::gi::shared::voxel::VoxelGrid;
use crate::gi::shared::voxel::light::{AREA_UNIT, CLEAR_LIGHT, VoxelLight, VoxelRecords};
use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Buffer, Frame, Image, Pass, Sets, Shaders};
use crate::render::{LightMaps, TILE};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `voxel.inject_rsm`.
    pub struct InjectParams {
        /// xyz: smallest corner of the grid (m); w: voxel size (m).
        pub grid: [f32; 4],
        /// Smallest corner and edge of the piece of the grid whose voxels are added to (voxels).
        pub piece: [i32; 4],
        /// xyz: first voxel of the box whose light stays as it is.
        pub kept_low: [i32; 4],
        /// xyz: end of that box, one voxel beyond its last.
        pub kept_end: [i32; 4],
        /// Voxels along an edge of the grid.
        pub resolution: u32,
        /// First of the piece's voxels; their records and sums start with it.
        pub first_voxel: u32,
        /// How many voxels it has.
        pub voxel_count: u32,
        /// One integer step of r, g, b (W/(m² sr)).
        pub flux_unit: f32,
        /// One integer step of lit area (voxel faces).
        pub area_unit: f32,
        /// Groups along an edge of a map.
        pub group_row: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.list_tiles`.
    pub struct TileParams {
        /// xyz: smallest corner of the grid (m); w: voxel size (m).
        pub grid: [f32; 4],
        /// Smallest corner and edge of the piece of the grid whose voxels are lit (voxels).
        pub piece: [i32; 4],
        /// xyz: first voxel of the box whose light stays as it is.
        pub kept_low: [i32; 4],
        /// xyz: end of that box, one voxel beyond its last.
        pub kept_end: [i32; 4],
    }
}

/// Between which depths the surface of each tile of an RSM lies. A thread a tile.
pub static BOUND_TILES: Pass = Pass {
    name: "voxel.bound_tiles",
    shaders: Shaders::Compute("gi/shared/voxel/light/bound_tiles.comp"),
    bindings: &[
        Binding::buffer("light_views", Access::ComputeRead),
        Binding::sampled("shadow_maps", Access::ComputeSampled),
        Binding::buffer("tile_depths", Access::ComputeWrite),
    ],
    constants: &[],
    params: None,
    sets: Sets::Scene,
};

/// Squares of tiles of the RSM from which light can fall on voxels that are lit anew. A thread a
/// square.
pub static LIST_TILES: Pass = Pass {
    name: "voxel.list_tiles",
    shaders: Shaders::Compute("gi/shared/voxel/light/list_tiles.comp"),
    bindings: &[
        Binding::buffer("light_views", Access::ComputeRead),
        Binding::buffer("tile_depths", Access::ComputeRead),
        Binding::buffer("list", Access::ComputeReadWrite),
    ],
    constants: &["BLOCK"],
    params: Some(TileParams::LAYOUT),
    sets: Sets::Scene,
};

/// The bindings of a pass that injects, without the ones by which it finds voxels.
pub const INJECT_BINDINGS: [Binding; 8] = [
    Binding::buffer("light_views", Access::ComputeRead),
    Binding::sampled("shadow_maps", Access::ComputeSampled),
    Binding::sampled("rsm_normal", Access::ComputeSampled),
    Binding::sampled("rsm_reflected", Access::ComputeSampled),
    Binding::buffer("flux", Access::ComputeReadWrite),
    Binding::buffer("lost_texels", Access::ComputeReadWrite),
    Binding::buffer("voxels", Access::ComputeRead),
    Binding::buffer("list", Access::ComputeRead),
];

/// Every RSM texel adds its flux to the voxels that its footprint lies in, which are found through
/// the occupancy of their grid. A thread a block of texels; 40-bit integer sums, the same in every
/// run.
pub static INJECT_RSM: Pass = inject_pass(
    "gi/shared/voxel/light/inject_rsm.comp",
    const {
        &join::<_, 8, 2, 10>(
            INJECT_BINDINGS,
            [
                Binding::buffer("occupancy", Access::ComputeRead),
                Binding::buffer("block_bases", Access::ComputeRead),
            ],
        )
    },
);

/// A pass whose shader includes `gi/shared/voxel/light/inject.glsl` and finds voxels in a way of
/// its own; `bindings` are [`INJECT_BINDINGS`] and what it reads for that.
pub const fn inject_pass(shader: &'static str, bindings: &'static [Binding]) -> Pass {
    Pass {
        name: "voxel.inject_rsm",
        shaders: Shaders::Compute(shader),
        bindings,
        constants: &["SIDES", "BLOCK", "LISTED"],
        params: Some(InjectParams::LAYOUT),
        sets: Sets::Scene,
    }
}

/// How the voxel at a place is found.
#[derive(Clone, Copy)]
pub struct VoxelLookup<'v> {
    /// The pass that injects ([`inject_pass`]).
    pub pass: &'static Pass,
    /// What it reads to find voxels, by name.
    pub bound: &'v [(&'static str, &'v Arc<Buffer>)],
    /// The grid in which it finds them.
    pub grid: VoxelGrid,
    /// The smallest corner in it of the voxels that are lit (voxels).
    pub first: IVec3,
    /// Index of the first that is lit.
    pub first_voxel: u32,
}

impl<'v> VoxelLookup<'v> {
    /// By the occupancy and the block bases of the records' own grid.
    pub fn by_occupancy(
        voxels: &VoxelRecords,
        bound: &'v [(&'static str, &'v Arc<Buffer>); 2],
    ) -> Self {
        let VoxelRecords { lattice, grid, .. } = voxels;
        VoxelLookup {
            pass: &INJECT_RSM,
            bound,
            grid: VoxelGrid {
                origin: lattice.anchor,
                ..*grid
            },
            first: lattice.first,
            first_voxel: 0,
        }
    }
}

/// Adds the pass that injection into a part of the scene needs once, after the maps were drawn.
pub fn bound_tiles(frame: &mut Frame, maps: &LightMaps) {
    if maps.rsm.is_none() || maps.view_count == 0 {
        return;
    }
    let groups = maps.size.div_ceil(TILE).div_ceil(8);
    frame
        .pass(&BOUND_TILES)
        .bind("light_views", &maps.views)
        .bind("shadow_maps", &maps.depth)
        .bind("tile_depths", &maps.tiles[0])
        .dispatch([groups, groups, maps.view_count]);
}

impl VoxelLight {
    /// Whether these voxels, or the ones among them that are lit anew, are only a part of what the
    /// maps show. If so, their tiles have to be bound before ([`bound_tiles`]).
    pub fn is_part(&self, voxels: &VoxelRecords) -> bool {
        voxels.grid.resolution < self.scene_resolution || !voxels.kept.is_empty()
    }

    pub(super) fn inject(
        &self,
        frame: &mut Frame,
        voxels: &VoxelRecords,
        lookup: VoxelLookup<'_>,
        maps: &LightMaps,
        [normal, reflected]: &[Arc<Image>; 2],
    ) {
        let (kept, grid) = (&voxels.kept, &lookup.grid);
        let block = texel_block(maps.size, self.scene_resolution);
        let group_row = maps.size.div_ceil(TILE * block);
        let (piece, kept_low, kept_end) = (
            lookup
                .first
                .extend(voxels.grid.resolution as i32)
                .to_array(),
            kept.low.extend(0).to_array(),
            kept.end.extend(0).to_array(),
        );
        let is_part = self.is_part(voxels);
        if is_part {
            let [depths, list] = &maps.tiles;
            frame.fill(CLEAR_LIGHT, list, 0);
            let pass = frame
                .pass(&LIST_TILES)
                .bind("light_views", &maps.views)
                .bind("tile_depths", depths)
                .bind("list", list)
                .constant("BLOCK", block);
            pass.push(&TileParams {
                grid: grid.row(),
                piece,
                kept_low,
                kept_end,
            })
            .dispatch([
                group_row.div_ceil(8),
                group_row.div_ceil(8),
                maps.view_count,
            ]);
        }
        let params = InjectParams {
            grid: grid.row(),
            piece,
            kept_low,
            kept_end,
            resolution: grid.resolution,
            first_voxel: lookup.first_voxel,
            voxel_count: voxels.voxel_count,
            flux_unit: self.flux_unit,
            area_unit: AREA_UNIT,
            group_row,
        };
        let pass = frame
            .pass(lookup.pass)
            .bind("light_views", &maps.views)
            .bind("shadow_maps", &maps.depth)
            .bind("rsm_normal", normal)
            .bind("rsm_reflected", reflected)
            .bind("flux", &self.flux)
            .bind("lost_texels", &self.counters)
            .bind("voxels", &voxels.records)
            .bind("list", &maps.tiles[1]);
        let pass = lookup
            .bound
            .iter()
            .fold(pass, |pass, (name, found)| pass.bind(name, *found));
        let pass = pass
            .constant("SIDES", self.settings.sides as u32)
            .constant("BLOCK", block)
            .constant("LISTED", is_part)
            .push(&params);
        if is_part {
            pass.dispatch_indirect(&maps.tiles[1], 0)
        } else {
            pass.dispatch([group_row, group_row, maps.view_count])
        }
    }
}

/// Edge of the blocks of texels that a thread adds: a voxel, were the map as wide as the scene.
fn texel_block(map_size: u32, resolution: u32) -> u32 {
    let most = (map_size / resolution).clamp(1, 8);
    // The largest power of two that divides the map into whole blocks.
    1 << most.ilog2().min(map_size.trailing_zeros())
}
