//! Surfaces that light is gathered for: of all pixels, of some, or of all in another order.

use std::sync::Arc;

use super::super::gpu_scene::{FrameConstants, GpuScene};
use super::super::grid::Grid;
use super::gbuffer::GBuffer;
use super::output::{screen_groups, screen_image_of};
use crate::graph::{
    Access, Binding, Buffer, BufferDesc, BufferUsage, Error, Frame, Gpu, Image, Owner, Pass,
    SceneSet, Sets, Shaders, vk,
};

/// What a gather answers for, and where.
pub struct Receivers<'r> {
    /// R32F: view depth (m), a texel each; 0 where there is no surface.
    pub view_depth: &'r Arc<Image>,
    /// At least RG32UI: geometric and shading normal, as in [`GBuffer::normals`].
    pub normals: &'r Arc<Image>,
    /// RGBA32F: the answer. rgb: indirect diffuse irradiance E_i (W/m²); a: ambient visibility, 0
    /// to 1. 0 where there is no surface.
    pub light: &'r Arc<Image>,
    /// Width and height (texels).
    pub size: [u32; 2],
    /// Set 0, whose frame constants say which pixels they are of. The frame has it already.
    pub set: &'r Arc<SceneSet>,
}

impl Receivers<'_> {
    /// Workgroups of 8×8 threads, a thread a texel.
    pub fn groups(&self) -> [u32; 3] {
        screen_groups(self.size)
    }
}

impl GBuffer {
    /// All pixels, of a frame with the scene's own constants.
    pub fn receivers<'r>(&'r self, scene: &'r GpuScene, light: &'r Arc<Image>) -> Receivers<'r> {
        Receivers {
            view_depth: &self.view_depth,
            normals: &self.normals,
            light,
            size: self.size,
            set: &scene.set,
        }
    }
}

/// The surfaces of a grid's pixels. Reads the G-buffer; writes R32F and RGBA32UI, a thread a texel.
pub static PICK: Pass = Pass {
    name: "screen.pick",
    shaders: Shaders::Compute("render/screen/pick.comp"),
    bindings: &[
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::sampled("normals", Access::ComputeSampled),
        Binding::image("picked_depth", Access::ComputeWrite),
        Binding::image("picked_normals", Access::ComputeWrite),
    ],
    constants: &[],
    params: None,
    sets: Sets::Scene,
};

/// Surfaces of a grid's pixels, with frame constants that say which they are.
pub struct Picked {
    /// R32F: view depth (m); 0 where there is no surface.
    pub view_depth: Arc<Image>,
    /// RGBA32UI: geometric and shading normal in r and g.
    pub normals: Arc<Image>,
    uniform: Arc<Buffer>,
    set: Arc<SceneSet>,
    /// Which pixels.
    grid: Grid,
}

impl Picked {
    /// Room for a grid of at most this size (texels). `name` names the images.
    pub fn new(gpu: &Gpu, scene: &GpuScene, name: &str, size: [u32; 2]) -> Result<Self, Error> {
        let image =
            |part: &str, format| screen_image_of(gpu, &format!("{name}.{part}"), size, format);
        let uniform = gpu.create_buffer(&BufferDesc {
            name: format!("{name}.constants"),
            size_bytes: size_of::<FrameConstants>() as u64,
            usage: BufferUsage::Uniform,
            owner: Owner::Screen,
        })?;
        Ok(Picked {
            view_depth: image("view_depth", vk::Format::R32_SFLOAT)?,
            normals: image("normals", vk::Format::R32G32B32A32_UINT)?,
            set: scene.set_with(gpu, Arc::clone(&uniform))?,
            uniform,
            grid: Grid::whole([1, 1]),
        })
    }

    /// From now on they are seen with these constants, and are those of this grid.
    pub fn set(&mut self, gpu: &Gpu, seen_with: &FrameConstants, grid: Grid) -> Result<(), Error> {
        self.grid = grid;
        let constants = FrameConstants {
            gathered: grid.row(),
            ..*seen_with
        };
        gpu.upload_buffer(&self.uniform, bytemuck::bytes_of(&constants))
    }

    /// Which pixels they are of.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Adds [`PICK`].
    pub fn pick(&self, frame: &mut Frame, scene: &GpuScene, gbuffer: &GBuffer) {
        self.enter(frame, scene);
        frame
            .pass(&PICK)
            .bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("picked_depth", &self.view_depth)
            .bind("picked_normals", &self.normals)
            .dispatch(screen_groups(self.grid.size));
    }

    /// The passes that are added from now on see these constants.
    pub fn enter(&self, frame: &mut Frame, scene: &GpuScene) {
        frame.set_scene(&self.set, &scene.materials);
    }

    /// For a gather into `light`.
    pub fn receivers<'r>(&'r self, light: &'r Arc<Image>) -> Receivers<'r> {
        Receivers {
            view_depth: &self.view_depth,
            normals: &self.normals,
            light,
            size: self.grid.size,
            set: &self.set,
        }
    }
}
