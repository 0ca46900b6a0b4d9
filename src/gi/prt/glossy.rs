//! What glossy surfaces mirror of the radiance above points, and what bumped normals change.

use std::sync::Arc;

use bytemuck::cast_slice;

use super::lobes::{self, LobeSettings};
use super::points::Points;
use super::seen::{Seen, drawn, target};
use crate::gi::Inputs;
use crate::graph::pass::join;
use crate::graph::{
    Access, Binding, Buffer, Error, Frame, Gpu, Image, ImageUsage, Owner, Pass, PassBuilder, Sets,
    Shaders, vk,
};
use crate::render::{GpuScene, screen_groups, screen_image, storage};

const CELL: vk::Format = vk::Format::R32G32B32A32_UINT;

/// Where each pixel is on which triangle. Draws the scene.
pub static CELLS: Pass = drawn(
    "prt.cells",
    ("gi/prt/cells.frag", &[CELL]),
    &[
        Binding::buffer("triangle_nodes", Access::RasterRead),
        Binding::buffer("node_points", Access::RasterRead),
    ],
    &[],
);

/// What passes bind that read the radiance above points (`gi/prt/lobes.glsl`).
const BINDINGS: [Binding; 8] = [
    Binding::buffer("triangle_nodes", Access::ComputeRead),
    Binding::buffer("node_points", Access::ComputeRead),
    Binding::sampled("cells", Access::ComputeSampled),
    Binding::buffer("point_lobes", Access::ComputeRead),
    Binding::buffer("point_frames", Access::ComputeRead),
    Binding::buffer("lobe_table", Access::ComputeRead),
    Binding::sampled("view_depth", Access::ComputeSampled),
    Binding::sampled("normals", Access::ComputeSampled),
];

/// What glossy surfaces mirror. A thread a pixel.
pub static GATHER_GLOSSY: Pass = Pass {
    name: "prt.gather_glossy",
    shaders: Shaders::Compute("gi/prt/gather_glossy.comp"),
    bindings: &join::<_, 8, 2, 10>(
        BINDINGS,
        [
            Binding::sampled("specular", Access::ComputeSampled),
            Binding::image("indirect_specular", Access::ComputeWrite),
        ],
    ),
    constants: &["ORDER", "CLAMP"],
    params: None,
    sets: Sets::Scene,
};

/// What bumped normals change in irradiance. A thread a pixel.
pub static BUMPS: Pass = Pass {
    name: "prt.bumps",
    shaders: Shaders::Compute("gi/prt/bumps.comp"),
    bindings: &join::<_, 8, 1, 9>(
        BINDINGS,
        [Binding::image("diffuse", Access::ComputeReadWrite)],
    ),
    constants: &["ORDER", "CLAMP"],
    params: None,
    sets: Sets::Scene,
};

/// Passes that read the radiance above points, and what they need.
pub(super) struct Glossy {
    order: u32,
    clamps: bool,
    cells: Arc<Image>,
    /// What glossy surfaces mirror, where there are any, and what lobes make of harmonics.
    mirrored: Option<(Arc<Image>, Arc<Buffer>)>,
    /// What bumped normals make of them, where there are any.
    bumps: Option<Arc<Buffer>>,
}

impl Glossy {
    /// Allocates pictures of a size (px).
    pub(super) fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        size: [u32; 2],
        (settings, clamps): (LobeSettings, bool),
    ) -> Result<Self, Error> {
        let order = settings.order;
        let store = |name, bytes: &[u8]| storage(gpu, (name, Owner::Store), bytes);
        let table = || store("prt.lobe_table", cast_slice(&lobes::lobe_table(order)));
        let bumps = || store("prt.bump_table", cast_slice(&lobes::bump_table(order)));
        let mirrored = scene
            .is_glossy
            .then(|| Ok::<_, Error>((screen_image(gpu, "prt.mirrored", size)?, table()?)));
        let color = ImageUsage::COLOR | ImageUsage::SAMPLED;
        Ok(Glossy {
            order,
            clamps,
            cells: target(gpu, "prt.cells", size, (CELL, color))?,
            mirrored: mirrored.transpose()?,
            bumps: scene.has_bumps().then(bumps).transpose()?,
        })
    }

    /// Whether bumped normals change anything.
    pub(super) fn has_bumps(&self) -> bool {
        self.bumps.is_some()
    }

    /// Adds the pass that says where pixels are; the others read it.
    pub(super) fn draw(&self, frame: &mut Frame, (points, seen): (&Points, &Seen), size: [u32; 2]) {
        let pass = frame
            .pass(&CELLS)
            .bind("triangle_nodes", &points.triangles)
            .bind("node_points", &points.nodes);
        seen.draw_into(&self.cells, pass, size);
    }

    /// Adds the pass that mirrors; returns what is mirrored, where anything is glossy.
    pub(super) fn mirror(
        &self,
        frame: &mut Frame,
        points: &Points,
        given: &Inputs<'_>,
    ) -> Option<Arc<Image>> {
        let (light, table) = self.mirrored.as_ref()?;
        let specular = given.gbuffer.specular.as_ref()?;
        self.bind(frame.pass(&GATHER_GLOSSY), (points, table), given)?
            .bind("specular", specular)
            .bind("indirect_specular", light)
            .dispatch(screen_groups(given.gbuffer.size));
        Some(Arc::clone(light))
    }

    /// Adds what bumped normals change.
    pub(super) fn add_bumps(
        &self,
        frame: &mut Frame,
        points: &Points,
        (given, diffuse): (&Inputs<'_>, &Arc<Image>),
    ) {
        let Some(table) = &self.bumps else { return };
        if let Some(pass) = self.bind(frame.pass(&BUMPS), (points, table), given) {
            pass.bind("diffuse", diffuse)
                .dispatch(screen_groups(given.gbuffer.size));
        }
    }

    fn bind<'f>(
        &self,
        pass: PassBuilder<'f>,
        (points, table): (&Points, &Arc<Buffer>),
        given: &Inputs<'_>,
    ) -> Option<PassBuilder<'f>> {
        let (lobes, frames) = points.lobes.as_ref()?;
        let bound = pass
            .bind("triangle_nodes", &points.triangles)
            .bind("node_points", &points.nodes)
            .bind("cells", &self.cells)
            .bind("point_lobes", &lobes.lit)
            .bind("point_frames", frames)
            .bind("lobe_table", table)
            .bind("view_depth", &given.gbuffer.view_depth)
            .bind("normals", &given.gbuffer.normals)
            .constant("ORDER", self.order)
            .constant("CLAMP", self.clamps);
        Some(bound)
    }
}
