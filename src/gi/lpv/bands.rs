//! The published steps with streams in three or four bands of spherical harmonics, which
//! [`super::lobes`] has in two.

use std::sync::Arc;

use glam::UVec3;

use super::faces::Faces;
use super::inflow::Inflow;
use super::light::Light;
use super::lobes::{
    FinishParams, LobeSettings, Occlusion, PropagateParams, SeedParams, axis_direction, groups,
};
use super::sweep::volume;
use crate::gi::shared::sh::{self, Quadrature};
use crate::graph::{
    Access, BatchDispatch, Binding, Buffer, Error, Frame, Gpu, Image, ImageUsage, Owner, Pass,
    Sets, Shaders, vk,
};
use crate::render::storage;
use crate::shader::GpuStruct;

/// What cells send at first, and the start of the sum. A thread a cell.
pub static SEED_BANDS: Pass = Pass {
    constants: &["BANDS", "SIDES"],
    ..Pass::compute(
        "lpv.seed_bands",
        "gi/lpv/bands/seed.comp",
        &[
            Binding::buffer("flux", Access::ComputeRead),
            Binding::buffer("faces", Access::ComputeRead),
            Binding::buffer("side_light", Access::ComputeRead),
            Binding::image("lobes", Access::ComputeWrite),
            Binding::image("sum", Access::ComputeWrite),
        ],
        SeedParams::LAYOUT,
    )
};

/// One step of all cells: from what the step before has left, into the other half of the volume. A
/// thread a cell; the steps are a chain.
pub static STREAM: Pass = Pass {
    name: "lpv.stream",
    shaders: Shaders::Compute("gi/lpv/bands/stream.comp"),
    bindings: &[
        Binding::buffer("faces", Access::ComputeRead),
        Binding::buffer("streams", Access::ComputeRead),
        Binding::sampled("blockers", Access::ComputeSampled),
        Binding::image("lobes", Access::ComputeReadWrite),
        Binding::image("sum", Access::ComputeReadWrite),
    ],
    constants: &["BANDS", "OCCLUSION"],
    params: Some(PropagateParams::LAYOUT),
    sets: Sets::Scene,
};

/// The sum of all steps, as what pixels look up. A thread a cell.
pub static FINISH_BANDS: Pass = Pass {
    constants: &["BANDS"],
    ..Pass::compute(
        "lpv.finish_bands",
        "gi/lpv/bands/finish.comp",
        &[
            Binding::image("sum", Access::ComputeRead),
            Binding::image("light", Access::ComputeWrite),
            Binding::image("light_band2", Access::ComputeWrite),
        ],
        FinishParams::LAYOUT,
    )
};

/// Coefficients of four bands (`gi/lpv/bands/bands.glsl`).
const MOST_COEFFICIENTS: usize = 16;

/// M_d = ∫ Y Yᵀ max(0, ω·d)/(|ωx| + |ωy| + |ωz|) dω in so many bands, row by row: what goes into a
/// cell through each of its faces. They are symmetric, and all six add up to 1.
pub fn streams(bands: usize) -> [Vec<f64>; 6] {
    let count = bands * bands;
    let mut all = [(); 6].map(|()| vec![0.0; count * count]);
    let mut basis = vec![0.0; count];
    // As for two bands: an error of 10⁻⁶.
    for &(direction, weight) in &Quadrature::exact_to(400).nodes {
        sh::evaluate(bands, direction, &mut basis);
        for (face, matrix) in (0u32..).zip(&mut all) {
            let along = direction.dot(-axis_direction(face)).max(0.0);
            let share = weight * along / direction.abs().element_sum();
            if share == 0.0 {
                continue;
            }
            for (row, own) in matrix.chunks_exact_mut(count).zip(&basis) {
                for (entry, other) in row.iter_mut().zip(&basis) {
                    *entry += share * own * other;
                }
            }
        }
    }
    all
}

/// Streams of grids of one size.
pub struct Streams {
    settings: LobeSettings,
    bands: u32,
    occlusion: Occlusion,
    matrices: Arc<Buffer>,
    /// What the last two steps have left: coefficients of intensity over h² (W/(m² sr)).
    lobes: Arc<Image>,
    /// The same of all steps.
    sum: Arc<Image>,
}

impl Streams {
    /// Takes what comes in from another environment, or at another scale.
    pub fn set_inflow(&self, gpu: &Gpu, inflow: Inflow<'_>) -> Result<(), Error> {
        // It is before the matrices.
        let outside = inflow.lobe(self.bands as usize);
        gpu.upload_buffer(&self.matrices, bytemuck::cast_slice(&outside))
    }

    /// Allocates streams in three or four bands.
    pub fn new(
        gpu: &Gpu,
        size: UVec3,
        (settings, bands): (LobeSettings, u32),
        occlusion: Occlusion,
        inflow: Inflow<'_>,
    ) -> Result<Self, Error> {
        let [x, y, z] = size.to_array();
        let mut outside = inflow.lobe(bands as usize);
        outside.resize(MOST_COEFFICIENTS, [0.0; 4]);
        let streams = streams(bands as usize);
        let streams = streams.iter().flatten().map(|entry| *entry as f32);
        let matrices: Vec<f32> = outside.into_iter().flatten().chain(streams).collect();
        let pairs = (bands * bands).div_ceil(2);
        Ok(Streams {
            settings,
            bands,
            occlusion,
            matrices: storage(
                gpu,
                ("lpv.streams", Owner::Store),
                bytemuck::cast_slice(&matrices),
            )?,
            lobes: volume(
                gpu,
                ("lpv.lobes", vk::Format::R32G32B32A32_UINT),
                [pairs * x, y, 2 * z],
                ImageUsage::STORAGE,
            )?,
            sum: volume(
                gpu,
                ("lpv.lobe_sum", vk::Format::R32G32B32A32_SFLOAT),
                [bands * x, bands * y, z],
                ImageUsage::STORAGE,
            )?,
        })
    }

    /// Adds the passes that bring the flux of all cells (integers of `flux_unit`, W), and the light
    /// of the sides of all opaque faces, to the cells that it reaches. `blockers` are read where
    /// they are what stops light.
    pub fn run(
        &self,
        frame: &mut Frame,
        faces: &Faces,
        (flux, flux_unit): (&Arc<Buffer>, f32),
        (light, blockers): (&Light, &Arc<Image>),
    ) {
        let grid = faces.grid;
        let side_light = faces.sides.as_ref().map(|sides| &sides.light);
        let face_m2 = grid.cell_size * grid.cell_size;
        frame
            .pass(&SEED_BANDS)
            .bind("flux", flux)
            .bind("faces", &faces.words)
            .bind("side_light", side_light.unwrap_or(flux))
            .bind("lobes", &self.lobes)
            .bind("sum", &self.sum)
            .constant("BANDS", self.bands)
            .constant("SIDES", side_light.is_some())
            .push(&SeedParams {
                grid: grid.row(0),
                peak_unit: flux_unit / (std::f32::consts::PI * face_m2),
            })
            .dispatch(groups(&grid));
        let step = |step| BatchDispatch {
            push: bytemuck::bytes_of(&PropagateParams {
                grid: grid.row(0),
                step,
                gain: self.settings.gain,
            })
            .to_vec(),
            groups: groups(&grid),
            ..Default::default()
        };
        frame
            .pass(&STREAM)
            .bind("faces", &faces.words)
            .bind("streams", &self.matrices)
            .bind("blockers", blockers)
            .bind("lobes", &self.lobes)
            .bind("sum", &self.sum)
            .constant("BANDS", self.bands)
            .constant("OCCLUSION", self.occlusion as u32)
            .dispatch_chain((1..=self.settings.iterations).map(step).collect());
        frame
            .pass(&FINISH_BANDS)
            .bind("sum", &self.sum)
            .bind("light", &light.low)
            .bind("light_band2", light.bound_band2())
            .constant("BANDS", self.bands)
            .push(&FinishParams { grid: grid.row(0) })
            .dispatch(groups(&grid));
    }
}
