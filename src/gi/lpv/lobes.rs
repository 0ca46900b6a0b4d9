//! The published propagation: lobes of intensity in two bands, handed on from cell to cell, all
//! cells at once.

use std::ops::RangeInclusive;
use std::sync::Arc;

use glam::{DMat4, DVec3, DVec4, UVec3};

use super::faces::Faces;
use super::grid::{CellGrid, GridRow};
use super::inflow::Inflow;
use super::light::Light;
use super::sweep::volume;
use crate::gi::Settings;
use crate::gi::shared::sh::{self, Quadrature};
use crate::gpu_struct;
use crate::graph::{
    Access, BatchDispatch, Binding, Buffer, Error, Frame, Gpu, Image, ImageUsage, Owner, Pass,
    Sets, Shaders, vk,
};
use crate::render::storage;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.seed`.
    pub struct SeedParams {
        /// The grid.
        pub grid: GridRow,
        /// One integer step of flux, over π h² (W/(m² sr)).
        pub peak_unit: f32,
    }
}

gpu_struct! {
    /// Parameters of `lpv.propagate`.
    pub struct PropagateParams {
        /// The grid.
        pub grid: GridRow,
        /// Which step it is, from 1.
        pub step: u32,
        /// Fraction of the flux that goes on.
        pub gain: f32,
    }
}

gpu_struct! {
    /// Parameters of `lpv.finish`.
    pub struct FinishParams {
        /// The grid.
        pub grid: GridRow,
    }
}

/// What cells send at first, and the start of the sum. A thread a cell.
pub static SEED: Pass = Pass {
    constants: &["SIDES"],
    ..Pass::compute(
        "lpv.seed",
        "gi/lpv/seed.comp",
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
pub static PROPAGATE: Pass = Pass {
    name: "lpv.propagate",
    shaders: Shaders::Compute("gi/lpv/propagate.comp"),
    bindings: &[
        Binding::buffer("faces", Access::ComputeRead),
        Binding::buffer("streams", Access::ComputeRead),
        Binding::sampled("blockers", Access::ComputeSampled),
        Binding::image("lobes", Access::ComputeReadWrite),
        Binding::image("sum", Access::ComputeReadWrite),
    ],
    constants: &["SCHEME", "OCCLUSION", "CLAMP"],
    params: Some(PropagateParams::LAYOUT),
    sets: Sets::Scene,
};

/// The sum of all steps, as what pixels look up. A thread a cell.
pub static FINISH: Pass = Pass::compute(
    "lpv.finish",
    "gi/lpv/finish.comp",
    &[
        Binding::image("sum", Access::ComputeRead),
        Binding::image("light", Access::ComputeWrite),
    ],
    FinishParams::LAYOUT,
);

/// How a cell hands on what it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// To the five other faces of each neighbour, and a lobe towards each (Kaplanyan & Dachsbacher
    /// 2010).
    Lobes30,
    /// Along the six axes, and a lobe along each (Kaplanyan 2009).
    Axis6,
    /// The fraction of each direction that goes through each face, without lobes.
    Stream,
}

/// What stops light on its way from a cell to its neighbour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Occlusion {
    /// Nothing.
    None,
    /// An opaque face stops all of it.
    Faces,
    /// The blocking potential of the surfaces that lights and the camera see.
    Fuzzy,
}

impl Occlusion {
    /// As the technique's settings say.
    pub fn new(settings: &Settings) -> Self {
        match settings.find_choice("occlusion") {
            Some("none") => Occlusion::None,
            Some("fuzzy") => Occlusion::Fuzzy,
            _ => Occlusion::Faces,
        }
    }
}

/// How lobes are handed on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeSettings {
    /// To which neighbours, as what.
    pub scheme: Scheme,
    /// Number of steps.
    pub iterations: u32,
    /// Fraction of the flux that goes on at each step.
    pub gain: f32,
    /// Negative flux is none.
    pub clamp_negative: bool,
}

impl LobeSettings {
    /// As the technique's settings say; `None` where discrete directions are swept.
    pub fn new(settings: &Settings) -> Option<Self> {
        let scheme = match settings.find_choice("propagation")? {
            "lobes30" => Scheme::Lobes30,
            "axis6" => Scheme::Axis6,
            "stream" => Scheme::Stream,
            _ => return None,
        };
        Some(LobeSettings {
            scheme,
            iterations: settings.count("iterations"),
            gain: settings.number("gain"),
            clamp_negative: settings.is("clamp_negative", "on"),
        })
    }
}

/// The direction of an axis: of the faces −x, +x, −y, +y, −z, +z.
pub(super) fn axis_direction(face: u32) -> DVec3 {
    let mut direction = DVec3::ZERO;
    direction[(face / 2) as usize] = if face.is_multiple_of(2) { -1.0 } else { 1.0 };
    direction
}

/// M_d = ∫ Y Yᵀ max(0, ω·d)/(|ωx| + |ωy| + |ωz|) dω: of two bands, what a cell passes on along d.
/// All six add up to 1.
pub fn stream(direction: DVec3) -> DMat4 {
    // The integrand has edges at the borders of octants: an error of 10⁻⁶.
    let quadrature = Quadrature::exact_to(400);
    let basis = |d: DVec3| {
        let mut values = [0.0; 4];
        sh::evaluate(2, d, &mut values);
        DVec4::from(values)
    };
    let columns = quadrature.nodes.iter().map(|&(d, weight)| {
        let share = weight * d.dot(direction).max(0.0) / d.abs().element_sum();
        let basis = basis(d);
        DMat4::from_cols(
            share * basis.x * basis,
            share * basis.y * basis,
            share * basis.z * basis,
            share * basis.w * basis,
        )
    });
    columns.sum()
}

/// Lobes of grids of one size.
pub struct Lobes {
    pub(super) settings: LobeSettings,
    pub(super) occlusion: Occlusion,
    pub(super) streams: Arc<Buffer>,
    /// What the last two steps have left: four coefficients of intensity over h² (W/(m² sr)).
    pub(super) lobes: Arc<Image>,
    /// The same of all steps.
    pub(super) sum: Arc<Image>,
}

impl Lobes {
    /// Takes what comes in from another environment, or at another scale.
    pub fn set_inflow(&self, gpu: &Gpu, inflow: Inflow<'_>) -> Result<(), Error> {
        // It is before the streams.
        gpu.upload_buffer(&self.streams, bytemuck::cast_slice(&inflow.lobe(2)))
    }

    /// Allocates.
    pub fn new(
        gpu: &Gpu,
        size: UVec3,
        settings: LobeSettings,
        occlusion: Occlusion,
        inflow: Inflow<'_>,
    ) -> Result<Self, Error> {
        let [x, y, z] = size.to_array();
        let is_stream = settings.scheme == Scheme::Stream;
        let streams = |face: u32| stream(-axis_direction(face)).as_mat4().to_cols_array();
        let all = (0..6).filter(|_| is_stream).flat_map(streams);
        let outside = inflow.lobe(2).into_iter().flatten();
        let streams: Vec<f32> = outside.chain(all).collect();
        let pairs = vk::Format::R32G32B32A32_UINT;
        let stored = ImageUsage::STORAGE;
        Ok(Lobes {
            settings,
            occlusion,
            streams: storage(
                gpu,
                ("lpv.streams", Owner::Store),
                bytemuck::cast_slice(&streams),
            )?,
            lobes: volume(gpu, ("lpv.lobes", pairs), [2 * x, y, 2 * z], stored)?,
            // Half floats would lose what late steps add to it.
            sum: volume(
                gpu,
                ("lpv.lobe_sum", vk::Format::R32G32B32A32_SFLOAT),
                [2 * x, 2 * y, z],
                stored,
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
        flux: (&Arc<Buffer>, f32),
        (light, blockers): (&Light, &Arc<Image>),
    ) {
        self.seed(frame, faces, flux);
        self.step(frame, (&faces.grid, &faces.words), 0, blockers);
        self.finish(frame, &faces.grid, light);
    }

    /// Adds the pass that gives cells what they send at first.
    pub(super) fn seed(
        &self,
        frame: &mut Frame,
        faces: &Faces,
        (flux, flux_unit): (&Arc<Buffer>, f32),
    ) {
        let side_light = faces.sides.as_ref().map(|sides| &sides.light);
        let face_m2 = faces.grid.cell_size * faces.grid.cell_size;
        frame
            .pass(&SEED)
            .bind("flux", flux)
            .bind("faces", &faces.words)
            .bind("side_light", side_light.unwrap_or(flux))
            .bind("lobes", &self.lobes)
            .bind("sum", &self.sum)
            .constant("SIDES", side_light.is_some())
            .push(&SeedParams {
                grid: faces.grid.row(0),
                peak_unit: flux_unit / (std::f32::consts::PI * face_m2),
            })
            .dispatch(groups(&faces.grid));
    }

    /// Adds all steps, the first of which comes after the step `done`. What blocks light are
    /// `faces`, a word a cell, where nothing else does.
    pub(super) fn step(
        &self,
        frame: &mut Frame,
        (grid, faces): (&CellGrid, &Arc<Buffer>),
        done: u32,
        blockers: &Arc<Image>,
    ) {
        let steps = done + 1..=done + self.settings.iterations;
        self.steps(frame, (grid, faces), steps, blockers);
    }

    /// Adds these steps.
    pub(super) fn steps(
        &self,
        frame: &mut Frame,
        (grid, faces): (&CellGrid, &Arc<Buffer>),
        steps: RangeInclusive<u32>,
        blockers: &Arc<Image>,
    ) {
        let step = |step| BatchDispatch {
            push: bytemuck::bytes_of(&PropagateParams {
                grid: grid.row(0),
                step,
                gain: self.settings.gain,
            })
            .to_vec(),
            groups: groups(grid),
            ..Default::default()
        };
        frame
            .pass(&PROPAGATE)
            .bind("faces", faces)
            .bind("streams", &self.streams)
            .bind("blockers", blockers)
            .bind("lobes", &self.lobes)
            .bind("sum", &self.sum)
            .constant("SCHEME", self.settings.scheme as u32)
            .constant("OCCLUSION", self.occlusion as u32)
            .constant("CLAMP", self.settings.clamp_negative)
            .dispatch_chain(steps.map(step).collect());
    }

    /// Adds the pass that makes the sum of all steps what pixels look up.
    pub(super) fn finish(&self, frame: &mut Frame, grid: &CellGrid, light: &Light) {
        frame
            .pass(&FINISH)
            .bind("sum", &self.sum)
            .bind("light", &light.low)
            .push(&FinishParams { grid: grid.row(0) })
            .dispatch(groups(grid));
    }
}

/// Workgroups of the passes of which a thread has a cell.
pub(super) fn groups(grid: &CellGrid) -> [u32; 3] {
    let [x, y, z] = grid.size.to_array();
    [x.div_ceil(8), y.div_ceil(8), z]
}
