//! Fuzzy occlusion: the surfaces that lights see, as what blocks light (Kaplanyan & Dachsbacher
//! 2010, section 5.2).

use std::sync::Arc;

use glam::UVec3;

use super::grid::{CellGrid, GridRow};
use super::sweep::volume;
use crate::gpu_struct;
use crate::graph::{
    Access, Binding, Buffer, BufferDesc, BufferUsage, Error, Frame, Gpu, Image, ImageUsage, Owner,
    Pass, Sets, Shaders, vk,
};
use crate::render::{GpuScene, LightMaps};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.geometry`.
    pub struct GeometryParams {
        /// The grid.
        pub grid: GridRow,
        /// Index of the light.
        pub light: u32,
        /// Texels along an edge of the square that one texel stands for.
        pub stride: u32,
        /// One integer step (m²).
        pub area_unit: f32,
    }
}

gpu_struct! {
    /// Parameters of `lpv.merge`.
    pub struct MergeParams {
        /// The grid.
        pub grid: GridRow,
        /// 1 where nothing is there yet.
        pub is_first: u32,
        /// One integer step, over h².
        pub share_unit: f32,
    }
}

/// Texels of one light's maps add A and A n to the nearest corner of a cell; integer sums, the same
/// in every run. A thread 4×4 of the texels that are read.
pub static GEOMETRY: Pass = Pass {
    name: "lpv.geometry",
    shaders: Shaders::Compute("gi/lpv/geometry.comp"),
    bindings: &[
        Binding::buffer("light_views", Access::ComputeRead),
        Binding::sampled("shadow_maps", Access::ComputeSampled),
        Binding::sampled("rsm_normal", Access::ComputeSampled),
        Binding::buffer("areas", Access::ComputeReadWrite),
    ],
    constants: &[],
    params: Some(GeometryParams::LAYOUT),
    sets: Sets::Scene,
};

/// Blocking potential of one light into that of all. A thread a node.
pub static MERGE: Pass = Pass::compute(
    "lpv.merge",
    "gi/lpv/merge.comp",
    &[
        Binding::buffer("areas", Access::ComputeRead),
        Binding::image("blockers", Access::ComputeReadWrite),
    ],
    MergeParams::LAYOUT,
);

/// One integer step of area, over h²: a node can have 8192 times the face of a cell.
const SHARE_UNIT: f32 = 1.0 / (1 << 18) as f32;
/// Light views that a light has at most.
const MOST_VIEWS: u32 = 6;

/// What blocks light in grids of one size.
pub struct Blockers {
    areas: Arc<Buffer>,
    /// Blocking potential at the corners of all cells: B(ω) = Σ A ⟨n,ω⟩₊ / h² in two bands.
    pub volume: Arc<Image>,
}

impl Blockers {
    /// Allocates.
    pub fn new(gpu: &Gpu, size: UVec3) -> Result<Self, Error> {
        let nodes = size + 1;
        Ok(Blockers {
            areas: gpu.create_buffer(&BufferDesc {
                name: "lpv.areas".into(),
                size_bytes: 16 * u64::from(nodes.element_product()),
                usage: BufferUsage::Storage,
                owner: Owner::Store,
            })?,
            volume: volume(
                gpu,
                ("lpv.blockers", vk::Format::R16G16B16A16_SFLOAT),
                nodes.to_array(),
                ImageUsage::STORAGE | ImageUsage::SAMPLED,
            )?,
        })
    }

    /// Adds the passes that find the surfaces that each light sees.
    pub(super) fn find(
        &self,
        frame: &mut Frame,
        grid: &CellGrid,
        scene: &GpuScene,
        (maps, rsm_texels): (&LightMaps, u32),
    ) {
        let stride = (maps.size / rsm_texels.max(1)).max(1);
        let groups = maps.size.div_ceil(stride).div_ceil(4 * 8);
        let nodes = grid.size + 1;
        let normal = maps.rsm.as_ref().map(|[normal, _]| normal);
        // Without lights there is one volume without blockers.
        for light in 0..scene.lights.len().max(1) as u32 {
            frame.fill("lpv.clear_areas", &self.areas, 0);
            if let Some(normal) = normal.filter(|_| maps.view_count > 0) {
                frame
                    .pass(&GEOMETRY)
                    .bind("light_views", &maps.views)
                    .bind("shadow_maps", &maps.depth)
                    .bind("rsm_normal", normal)
                    .bind("areas", &self.areas)
                    .push(&GeometryParams {
                        grid: grid.row(0),
                        light,
                        stride,
                        area_unit: SHARE_UNIT * grid.cell_size * grid.cell_size,
                    })
                    .dispatch([groups, groups, MOST_VIEWS]);
            }
            frame
                .pass(&MERGE)
                .bind("areas", &self.areas)
                .bind("blockers", &self.volume)
                .push(&MergeParams {
                    grid: grid.row(0),
                    is_first: u32::from(light == 0),
                    share_unit: SHARE_UNIT,
                })
                .dispatch([nodes.x.div_ceil(8), nodes.y.div_ceil(8), nodes.z]);
        }
    }
}
