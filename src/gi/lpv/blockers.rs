//! Fuzzy occlusion: the surfaces that lights and the camera see, as what blocks light (Kaplanyan &
//! Dachsbacher 2010, section 5.2).

use std::sync::Arc;

use glam::UVec3;

use super::grid::{CellGrid, GridRow};
use super::peel::Layer;
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
    /// Parameters of `lpv.camera_geometry`.
    pub struct CameraGeometryParams {
        /// The grid.
        pub grid: GridRow,
        /// Width and height of the layer's picture (px).
        pub size_px: [u32; 2],
        /// Pixels along an edge of the square that one pixel stands for.
        pub stride: u32,
        /// One integer step (m²).
        pub area_unit: f32,
    }
}

gpu_struct! {
    /// Parameters of `lpv.merge_camera`.
    pub struct MergeCameraParams {
        /// The grid.
        pub grid: GridRow,
        /// One integer step, over h².
        pub share_unit: f32,
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

/// Pixels of one layer of what the camera sees add A and A n, as texels of a light do. A thread 4×4
/// of the pixels that are read.
pub static CAMERA_GEOMETRY: Pass = Pass {
    name: "lpv.camera_geometry",
    shaders: Shaders::Compute("gi/lpv/camera_geometry.comp"),
    bindings: &[
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::buffer("areas", Access::ComputeReadWrite),
    ],
    constants: &[],
    params: Some(CameraGeometryParams::LAYOUT),
    sets: Sets::Scene,
};

/// Blocking potential of what the camera sees, with that of all lights, which is kept. A thread a
/// node.
pub static MERGE_CAMERA: Pass = Pass::compute(
    "lpv.merge_camera",
    "gi/lpv/merge_camera.comp",
    &[
        Binding::buffer("areas", Access::ComputeRead),
        Binding::image("of_lights", Access::ComputeRead),
        Binding::image("blockers", Access::ComputeWrite),
    ],
    MergeCameraParams::LAYOUT,
);

/// One integer step of area, over h²: a node can have 8192 times the face of a cell.
const SHARE_UNIT: f32 = 1.0 / (1 << 18) as f32;
/// Light views that a light has at most.
const MOST_VIEWS: u32 = 6;

/// What blocks light in one grid.
///
/// What lights see is kept between frames: it is a function of the lights, the models and the
/// grid, and found anew once one of them has changed. What the camera sees is found in each frame.
pub struct Blockers {
    areas: Arc<Buffer>,
    /// Blocking potential of what lights see, at the corners of all cells.
    of_lights: Arc<Image>,
    /// The same with what the camera sees, where that counts.
    of_all: Option<Arc<Image>>,
    /// Whether `of_lights` holds what the lights see now.
    is_kept: bool,
}

/// Room for the sums of areas of one grid, which grids of one size share.
pub(super) fn areas(gpu: &Gpu, size: UVec3) -> Result<Arc<Buffer>, Error> {
    gpu.create_buffer(&BufferDesc {
        name: "lpv.areas".into(),
        size_bytes: 16 * u64::from((size + 1).element_product()),
        usage: BufferUsage::Storage,
        owner: Owner::Store,
    })
}

impl Blockers {
    /// Allocates; `with_camera` for what the camera sees too.
    pub(super) fn new(
        gpu: &Gpu,
        size: UVec3,
        areas: &Arc<Buffer>,
        with_camera: bool,
    ) -> Result<Self, Error> {
        let nodes = |name| {
            volume(
                gpu,
                (name, vk::Format::R16G16B16A16_SFLOAT),
                (size + 1).to_array(),
                ImageUsage::STORAGE | ImageUsage::SAMPLED,
            )
        };
        let of_all = || nodes("lpv.blockers_of_all");
        Ok(Blockers {
            areas: Arc::clone(areas),
            of_lights: nodes("lpv.blockers")?,
            of_all: with_camera.then(of_all).transpose()?,
            is_kept: false,
        })
    }

    /// Blocking potential at the corners of all cells: B(ω) = Σ A ⟨n,ω⟩₊ / h² in two bands.
    pub fn volume(&self) -> &Arc<Image> {
        self.of_all.as_ref().unwrap_or(&self.of_lights)
    }

    /// Lights, models or the grid have changed.
    pub(super) fn forget(&mut self) {
        self.is_kept = false;
    }

    /// Adds the passes that find the surfaces that each light sees, where that is not known yet,
    /// and those in the camera's layers.
    pub(super) fn find(
        &mut self,
        frame: &mut Frame,
        grid: &CellGrid,
        (scene, layers): (&GpuScene, &[Layer]),
        (maps, rsm_texels): (&LightMaps, u32),
    ) {
        // Cascades see more where the camera is.
        let has_moved = scene.cascades.count > 1;
        if !std::mem::replace(&mut self.is_kept, true) || has_moved {
            self.find_of_lights(frame, grid, scene, (maps, rsm_texels));
        }
        if let Some(of_all) = &self.of_all {
            self.find_of_camera(frame, grid, layers, of_all);
        }
    }

    fn find_of_lights(
        &self,
        frame: &mut Frame,
        grid: &CellGrid,
        scene: &GpuScene,
        (maps, rsm_texels): (&LightMaps, u32),
    ) {
        let stride = (maps.size / rsm_texels.max(1)).max(1);
        let groups = maps.size.div_ceil(stride).div_ceil(4 * 8);
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
                        area_unit: area_unit(grid),
                    })
                    .dispatch([groups, groups, MOST_VIEWS]);
            }
            frame
                .pass(&MERGE)
                .bind("areas", &self.areas)
                .bind("blockers", &self.of_lights)
                .push(&MergeParams {
                    grid: grid.row(0),
                    is_first: u32::from(light == 0),
                    share_unit: SHARE_UNIT,
                })
                .dispatch(node_groups(grid));
        }
    }

    fn find_of_camera(
        &self,
        frame: &mut Frame,
        grid: &CellGrid,
        layers: &[Layer],
        of_all: &Arc<Image>,
    ) {
        frame.fill("lpv.clear_areas", &self.areas, 0);
        for layer in layers {
            let groups = |side: u32| side.div_ceil(layer.stride).div_ceil(4 * 8);
            frame
                .pass(&CAMERA_GEOMETRY)
                .bind("view_depth", &layer.view_depth)
                .bind("normals", &layer.normals)
                .bind("areas", &self.areas)
                .push(&CameraGeometryParams {
                    grid: grid.row(0),
                    size_px: layer.size,
                    stride: layer.stride,
                    area_unit: area_unit(grid),
                })
                .dispatch([groups(layer.size[0]), groups(layer.size[1]), 1]);
        }
        frame
            .pass(&MERGE_CAMERA)
            .bind("areas", &self.areas)
            .bind("of_lights", &self.of_lights)
            .bind("blockers", of_all)
            .push(&MergeCameraParams {
                grid: grid.row(0),
                share_unit: SHARE_UNIT,
            })
            .dispatch(node_groups(grid));
    }
}

/// One integer step of area (m²).
fn area_unit(grid: &CellGrid) -> f32 {
    SHARE_UNIT * grid.cell_size * grid.cell_size
}

/// Workgroups of the passes of which a thread has a node.
fn node_groups(grid: &CellGrid) -> [u32; 3] {
    let nodes = grid.size + 1;
    [nodes.x.div_ceil(8), nodes.y.div_ceil(8), nodes.z]
}
