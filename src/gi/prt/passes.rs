//! The passes of a frame, and the buffers they read.

use std::sync::Arc;

use bytemuck::cast_slice;
use half::f16;

use super::transfer::Transfer;
use crate::gpu_struct;
use crate::graph::compute::linear_groups;
use crate::graph::{
    Access, Binding, Buffer, BufferDesc, BufferUsage, ClearOrLoad, Error, Frame, Gpu, Image,
    ImageDesc, ImageKind, ImageUsage, Owner, Pass, RasterState, Sets, Shaders, Targets, vk,
};
use crate::render::{GpuScene, Receivers, storage};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `prt.light_points`.
    pub struct PointLightParams {
        /// The first point of the buffer.
        pub first_point: u32,
        /// Points of the buffer.
        pub point_count: u32,
        /// Functions of a row; even, of an odd number the last is dark.
        pub function_count: u32,
    }
}

/// Irradiance of points from their transfer. A thread a point.
pub static LIGHT_POINTS: Pass = Pass::compute(
    "prt.light_points",
    "gi/prt/light_points.comp",
    &[
        Binding::buffer("transfer_words", Access::ComputeRead),
        Binding::buffer("light", Access::ComputeRead),
        Binding::buffer("point_light", Access::ComputeReadWrite),
    ],
    PointLightParams::LAYOUT,
);

const SEEN: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;

/// Irradiance and visibility of what each pixel shows. Draws the scene.
pub static POINTS: Pass = Pass {
    name: "prt.points",
    shaders: Shaders::Raster {
        vertex: "gi/prt/points.vert",
        geometry: None,
        fragment: Some("gi/prt/points.frag"),
        state: RasterState {
            color: &[SEEN],
            depth: Some(DEPTH),
            depth_compare: vk::CompareOp::GREATER,
            ..RasterState::NO_TARGETS
        },
    },
    bindings: &[
        Binding::buffer("triangle_nodes", Access::RasterRead),
        Binding::buffer("node_points", Access::RasterRead),
        Binding::buffer("point_light", Access::RasterRead),
    ],
    constants: &["CLAMP"],
    params: None,
    sets: Sets::SceneAndMaterials,
};

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

/// Points whose transfer is in one buffer.
struct Part {
    words: Arc<Buffer>,
    first: u32,
    count: u32,
}

/// The transfer of all points on the device.
pub(super) struct Points {
    parts: Vec<Part>,
    /// Functions of a row, even.
    functions: u32,
    /// The light that points are lit with, a row a function.
    light: Arc<Buffer>,
    /// rgb: irradiance (W/m²); w: ambient visibility.
    lit: Arc<Buffer>,
    triangles: Arc<Buffer>,
    nodes: Arc<Buffer>,
    /// Powers of two that the transfer of each function was divided by.
    scales: Vec<f32>,
}

/// Largest transfer of a function that is kept as it is; half floats hold twice as much.
const MOST_STORED: f32 = 32_768.0;
/// Below this largest transfer of a function its half floats would lose digits.
const LEAST_STORED: f32 = 0.25;

impl Points {
    /// Uploads what was worked out.
    pub(super) fn new(gpu: &Gpu, transfer: &Transfer) -> Result<Self, Error> {
        let count = transfer.lattice.points.len();
        let functions = transfer.functions.next_multiple_of(2);
        let stride = 3 * transfer.functions as usize;
        let mut largest = vec![0.0f32; transfer.functions as usize];
        for row in transfer.rows.chunks_exact(stride.max(1)) {
            for (largest, rgb) in largest.iter_mut().zip(row.chunks_exact(3)) {
                *largest = rgb
                    .iter()
                    .fold(*largest, |most, value| value.abs().max(most));
            }
        }
        let scale = |largest: &f32| match *largest {
            most if most == 0.0 || (LEAST_STORED..=MOST_STORED).contains(&most) => 1.0,
            most => most.log2().ceil().exp2(),
        };
        let scales: Vec<f32> = largest.iter().map(scale).collect();
        let words = (3 * functions / 2) as usize;
        let most = gpu.limits().storage_buffer_bytes / (4 * words as u64);
        let most = most.clamp(1, u64::from(u32::MAX)) as usize;
        let part = |first: usize| {
            let own = most.min(count - first);
            let mut packed = vec![0u32; words * own];
            for point in 0..own {
                let row = transfer.row(first + point);
                let half = |at: usize| {
                    let value = row.get(at).map_or(0.0, |value| value / scales[at / 3]);
                    u32::from(f16::from_f32(value).to_bits())
                };
                for word in 0..words {
                    packed[word * own + point] = half(2 * word) | half(2 * word + 1) << 16;
                }
            }
            Ok(Part {
                words: storage(gpu, ("prt.transfer", Owner::Store), cast_slice(&packed))?,
                first: first as u32,
                count: own as u32,
            })
        };
        let dark: Vec<[f32; 4]> = (transfer.visibility.iter())
            .map(|visibility| [0.0, 0.0, 0.0, *visibility])
            .collect();
        let store = |name, bytes: &[u8]| storage(gpu, (name, Owner::Store), bytes);
        Ok(Points {
            parts: (0..count)
                .step_by(most)
                .map(part)
                .collect::<Result<_, Error>>()?,
            functions,
            light: gpu.create_buffer(&BufferDesc {
                name: "prt.light".into(),
                size_bytes: 16 * u64::from(functions),
                usage: BufferUsage::Storage,
                owner: Owner::Store,
            })?,
            lit: store("prt.point_light", cast_slice(&dark))?,
            triangles: store(
                "prt.triangle_nodes",
                cast_slice(&transfer.lattice.triangles),
            )?,
            nodes: store("prt.node_points", cast_slice(&transfer.lattice.nodes))?,
            scales,
        })
    }

    /// Sets the light, a row a function, that points are lit with next.
    pub(super) fn set_light(&self, gpu: &Gpu, light: &[[f32; 3]]) -> Result<(), Error> {
        let mut rows: Vec<[f32; 4]> = (light.iter().zip(&self.scales))
            .map(|(rgb, scale)| [scale * rgb[0], scale * rgb[1], scale * rgb[2], 0.0])
            .collect();
        rows.resize(self.functions as usize, [0.0; 4]);
        gpu.upload_buffer(&self.light, cast_slice(&rows))
    }

    /// Adds the pass that lights all points.
    pub(super) fn light(&self, frame: &mut Frame) {
        for part in &self.parts {
            frame
                .pass(&LIGHT_POINTS)
                .bind("transfer_words", &part.words)
                .bind("light", &self.light)
                .bind("point_light", &self.lit)
                .push(&PointLightParams {
                    first_point: part.first,
                    point_count: part.count,
                    function_count: self.functions,
                })
                .dispatch(linear_groups(part.count));
        }
    }
}

/// What pixels see of the points.
pub(super) struct Seen {
    light: Arc<Image>,
    depth: Arc<Image>,
}

impl Seen {
    /// Allocates pictures of a size (px).
    pub(super) fn new(gpu: &Gpu, [width, height]: [u32; 2]) -> Result<Self, Error> {
        let image = |name: &str, format, usage| {
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
        };
        let color = ImageUsage::COLOR | ImageUsage::SAMPLED;
        Ok(Seen {
            light: image("prt.seen", SEEN, color)?,
            depth: image("prt.depth", DEPTH, ImageUsage::DEPTH)?,
        })
    }

    /// Adds the pass that draws the points.
    pub(super) fn draw(
        &self,
        frame: &mut Frame,
        (scene, points): (&GpuScene, &Points),
        size: [u32; 2],
        clamps: bool,
    ) {
        let black = ClearOrLoad::Clear([0.0; 4]);
        frame
            .pass(&POINTS)
            .bind("triangle_nodes", &points.triangles)
            .bind("node_points", &points.nodes)
            .bind("point_light", &points.lit)
            .constant("CLAMP", clamps)
            .draw(
                Targets {
                    color: &[(&self.light, 0, 0, black)],
                    depth: Some((&self.depth, 0, black)),
                    extent: size,
                    viewport: None,
                },
                scene.draws(),
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
