//! Propagation along discrete directions, all cells at once, step by step.

use std::sync::Arc;

use glam::UVec3;

use super::directions::Directions;
use super::faces::Faces;
use super::grid::GridRow;
use super::inflow::Inflow;
use super::light::Light;
use super::sweep::{MOST_TEXELS, PAIR_BYTES, Sources, find_sources, volume};
use crate::gpu_struct;
use crate::graph::{
    Access, BatchDispatch, Binding, Buffer, Error, Frame, Gpu, Image, ImageUsage, Owner, Pass, vk,
};
use crate::render::storage;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.jacobi` and `lpv.jacobi_sum`.
    pub struct JacobiParams {
        /// The grid; w of its size: pairs of directions that a half of the volume has room for.
        pub grid: GridRow,
        /// The first pair of directions.
        pub first_pair: u32,
        /// How many there are.
        pub pair_count: u32,
        /// Which step it is, from 1; of the sum the last one.
        pub step: u32,
    }
}

/// One step of all cells along some pairs of directions: from what the step before has left, into
/// the other half of the volume. A thread a cell and pair; the steps are a chain.
pub static JACOBI: Pass = Pass {
    constants: &["SIDES"],
    ..Pass::compute(
        "lpv.jacobi",
        "gi/lpv/jacobi.comp",
        &[
            Binding::buffer("directions", Access::ComputeRead),
            Binding::image("sources", Access::ComputeRead),
            Binding::image("fields", Access::ComputeReadWrite),
            Binding::buffer("side_light", Access::ComputeRead),
            Binding::image("source_faces", Access::ComputeRead),
        ],
        JacobiParams::LAYOUT,
    )
};

/// Adds what these pairs have left to the light of the pairs before. A thread a cell.
pub static JACOBI_SUM: Pass = Pass::compute(
    "lpv.jacobi_sum",
    "gi/lpv/jacobi_sum.comp",
    &[
        Binding::buffer("directions", Access::ComputeRead),
        Binding::image("fields", Access::ComputeRead),
        Binding::image("sum", Access::ComputeReadWrite),
        Binding::image("light", Access::ComputeWrite),
        Binding::image("light_band2", Access::ComputeWrite),
    ],
    JacobiParams::LAYOUT,
);

/// Radiance of all cells along the pairs that are stepped at once has this much (bytes), or one
/// pair.
const MOST_FIELD_BYTES: u64 = 96 << 20;

/// Steps of grids of one size.
pub struct Jacobi {
    size: UVec3,
    /// The directions.
    pub directions: Directions,
    steps: u32,
    list: Arc<Buffer>,
    sources: Sources,
    /// Radiance after the last two steps.
    fields: Arc<Image>,
    pairs_at_once: u32,
    sum: Arc<Image>,
}

impl Jacobi {
    /// Takes what comes in from another environment, or at another scale.
    pub fn set_inflow(&self, gpu: &Gpu, inflow: Inflow<'_>) -> Result<(), Error> {
        let words = self.directions.words(inflow);
        gpu.upload_buffer(&self.list, bytemuck::cast_slice(&words))
    }

    /// Allocates steps of grids of this size along this many directions.
    pub fn new(
        gpu: &Gpu,
        size: UVec3,
        (directions, steps): (u32, u32),
        inflow: Inflow<'_>,
    ) -> Result<Self, Error> {
        let directions = Directions::spiral(directions);
        let [x, y, z] = size.to_array();
        let pair_bytes = 2 * u64::from(size.element_product()) * PAIR_BYTES;
        let pairs_at_once = u64::from(MOST_TEXELS / (2 * z))
            .min(MOST_FIELD_BYTES / pair_bytes)
            .clamp(1, u64::from(directions.pair_count())) as u32;
        let pairs = vk::Format::R32G32B32A32_UINT;
        let stored =
            |name, format, extent| volume(gpu, (name, format), extent, ImageUsage::STORAGE);
        Ok(Jacobi {
            size,
            list: storage(
                gpu,
                ("lpv.directions", Owner::Store),
                bytemuck::cast_slice(&directions.words(inflow)),
            )?,
            directions,
            steps,
            sources: Sources::new(gpu, size)?,
            fields: stored("lpv.fields", pairs, [x, y, 2 * pairs_at_once * z])?,
            pairs_at_once,
            sum: stored(
                "lpv.light_sum",
                vk::Format::R32G32B32A32_SFLOAT,
                [3 * x, 3 * y, z],
            )?,
        })
    }

    /// Adds the passes that bring the flux of all cells (integers of `flux_unit`, W), and the light
    /// of the sides of all opaque faces, as many cells far as there are steps.
    pub fn run(&self, frame: &mut Frame, faces: &Faces, flux: (&Arc<Buffer>, f32), light: &Light) {
        find_sources(frame, faces, flux, &self.sources);
        let side_light = faces.sides.as_ref().map(|sides| &sides.light);
        let [x, y, z] = self.size.to_array();
        let all = self.directions.pair_count();
        for first_pair in (0..all).step_by(self.pairs_at_once as usize) {
            let pair_count = self.pairs_at_once.min(all - first_pair);
            let params = |step| JacobiParams {
                grid: faces.grid.row(self.pairs_at_once),
                first_pair,
                pair_count,
                step,
            };
            let step = |step| BatchDispatch {
                push: bytemuck::bytes_of(&params(step)).to_vec(),
                groups: [x.div_ceil(8), y.div_ceil(8), z * pair_count],
                ..Default::default()
            };
            frame
                .pass(&JACOBI)
                .bind("directions", &self.list)
                .bind("sources", &self.sources.vectors)
                .bind("source_faces", &self.sources.faces)
                .bind("fields", &self.fields)
                .bind("side_light", side_light.unwrap_or(&self.list))
                .constant("SIDES", side_light.is_some())
                .dispatch_chain((1..=self.steps).map(step).collect());
            frame
                .pass(&JACOBI_SUM)
                .bind("directions", &self.list)
                .bind("fields", &self.fields)
                .bind("sum", &self.sum)
                .bind("light", &light.low)
                .bind("light_band2", light.bound_band2())
                .push(&params(self.steps))
                .dispatch([x.div_ceil(8), y.div_ceil(8), z]);
        }
    }
}
