//! What pixels see of the points.

use std::sync::Arc;

use super::points::Points;
use crate::graph::{
    Access, Binding, Buffer, ClearOrLoad, DrawBatch, Error, Frame, Gpu, Image, ImageDesc,
    ImageKind, ImageUsage, Owner, Pass, PassBuilder, RasterState, Sets, Shaders, Targets, vk,
};
use crate::render::{GpuScene, Receivers};

const SEEN: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;

/// A pass that draws the scene, each pixel from the three points around it.
pub(super) const fn drawn(
    name: &'static str,
    (fragment, color): (&'static str, &'static [vk::Format]),
    bindings: &'static [Binding],
    constants: &'static [&'static str],
) -> Pass {
    Pass {
        name,
        shaders: Shaders::Raster {
            vertex: "gi/prt/points.vert",
            geometry: None,
            fragment: Some(fragment),
            state: RasterState {
                color,
                depth: Some(DEPTH),
                depth_compare: vk::CompareOp::GREATER,
                ..RasterState::NO_TARGETS
            },
        },
        bindings,
        constants,
        params: None,
        sets: Sets::SceneAndMaterials,
    }
}

/// Irradiance and visibility of what each pixel shows. Draws the scene.
pub static POINTS: Pass = drawn(
    "prt.points",
    ("gi/prt/points.frag", &[SEEN]),
    &[
        Binding::buffer("triangle_nodes", Access::RasterRead),
        Binding::buffer("node_points", Access::RasterRead),
        Binding::buffer("point_light", Access::RasterRead),
    ],
    &["CLAMP"],
);

/// The same for the surfaces that are asked for. A thread a texel.
pub static GATHER: Pass = Pass {
    name: "prt.gather",
    shaders: Shaders::Compute("gi/prt/gather.comp"),
    bindings: &[
        Binding::sampled("seen", Access::ComputeSampled),
        Binding::sampled("view_depth", Access::ComputeSampled),
        Binding::image("indirect_diffuse", Access::ComputeWrite),
    ],
    constants: &[],
    params: None,
    sets: Sets::Scene,
};

/// Points, or clusters of points, each in a colour of its own. Draws the scene.
pub static MARKS: Pass = drawn(
    "prt.marks_view",
    ("gi/prt/marks_view.frag", &[SEEN]),
    &[
        Binding::buffer("triangle_nodes", Access::RasterRead),
        Binding::buffer("node_points", Access::RasterRead),
        Binding::buffer("point_clusters", Access::RasterRead),
    ],
    &["CLUSTERS"],
);

/// An image that is drawn into.
pub(super) fn target(
    gpu: &Gpu,
    name: &str,
    [width, height]: [u32; 2],
    (format, usage): (vk::Format, ImageUsage),
) -> Result<Arc<Image>, Error> {
    gpu.create_image(&ImageDesc {
        name: name.into(),
        extent: [width, height, 1],
        kind: ImageKind::D2,
        format,
        mips: 1,
        layers: 1,
        usage,
        owner: Owner::Screen,
    })
}

/// What pixels see of the points.
pub(super) struct Seen {
    light: Arc<Image>,
    depth: Arc<Image>,
    draws: Vec<DrawBatch>,
}

impl Seen {
    /// Allocates pictures of a size (px).
    pub(super) fn new(gpu: &Gpu, scene: &GpuScene, size: [u32; 2]) -> Result<Self, Error> {
        let color = ImageUsage::COLOR | ImageUsage::SAMPLED;
        Ok(Seen {
            light: target(gpu, "prt.seen", size, (SEEN, color))?,
            depth: target(gpu, "prt.depth", size, (DEPTH, ImageUsage::DEPTH))?,
            draws: scene.draws(),
        })
    }

    /// Adds the pass that draws the points.
    pub(super) fn draw(&self, frame: &mut Frame, points: &Points, size: [u32; 2], clamps: bool) {
        let pass = frame
            .pass(&POINTS)
            .bind("triangle_nodes", &points.triangles)
            .bind("node_points", &points.nodes)
            .bind("point_light", &points.irradiance.lit)
            .constant("CLAMP", clamps);
        self.draw_all(pass, size);
    }

    /// Adds the pass that draws points, or clusters of points, in colours.
    pub(super) fn draw_marks(
        &self,
        frame: &mut Frame,
        points: &Points,
        clusters: Option<&Arc<Buffer>>,
        size: [u32; 2],
    ) {
        let pass = frame
            .pass(&MARKS)
            .bind("triangle_nodes", &points.triangles)
            .bind("node_points", &points.nodes)
            .bind("point_clusters", clusters.unwrap_or(&points.nodes))
            .constant("CLUSTERS", clusters.is_some());
        self.draw_all(pass, size);
    }

    /// What was drawn last.
    pub(super) fn drawn(&self) -> &Arc<Image> {
        &self.light
    }

    fn draw_all(&self, pass: PassBuilder<'_>, extent: [u32; 2]) {
        self.draw_into(&self.light, pass, extent);
    }

    /// Draws the scene into an image as large as what pixels see.
    pub(super) fn draw_into(&self, image: &Arc<Image>, pass: PassBuilder<'_>, extent: [u32; 2]) {
        let black = ClearOrLoad::Clear([0.0; 4]);
        pass.draw(
            Targets {
                color: &[(image, 0, 0, black)],
                depth: Some((&self.depth, 0, black)),
                extent,
                viewport: None,
            },
            self.draws.clone(),
        );
    }

    /// Adds the pass that gathers it for some surfaces.
    pub(super) fn gather(&self, frame: &mut Frame, receivers: &Receivers<'_>) {
        frame
            .pass(&GATHER)
            .bind("seen", &self.light)
            .bind("view_depth", receivers.view_depth)
            .bind("indirect_diffuse", receivers.light)
            .dispatch(receivers.groups());
    }
}
