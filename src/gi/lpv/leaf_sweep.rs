//! The sweep over leaves: each once a direction, in upwind order.

use std::sync::Arc;

use rayon::prelude::*;

use super::directions::Directions;
use super::faces::Faces;
use super::grid::GridRow;
use super::inflow::Inflow;
use super::leaves::{LeafSettings, Leaves};
use super::light::Light;
use super::schedule::{ENVIRONMENT, Schedule, TooManyOnTheirWay};
use super::sweep::{COEFFICIENT_PAIRS, PAIR_BYTES, volume};
use crate::gpu_struct;
use crate::graph::{
    Access, BatchDispatch, Binding, Buffer, Error, Frame, Gpu, Image, ImageDesc, ImageKind,
    ImageUsage, Owner, Pass, vk,
};
use crate::render::storage;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.leaf_sources`.
    pub struct LeafSourceParams {
        /// The grid; w of its size: leaves.
        pub grid: GridRow,
        /// One integer step of flux, over π h² (W/(m² sr)).
        pub radiance_unit: f32,
    }
}

gpu_struct! {
    /// Parameters of `lpv.leaf_sweep`.
    pub struct LeafSweepParams {
        /// Which step it is.
        pub step: u32,
        /// How many there are.
        pub step_count: u32,
        /// The first octant that is swept.
        pub first_octant: u32,
        /// Pairs of directions that an octant has at most.
        pub most_pairs: u32,
    }
}

gpu_struct! {
    /// Parameters of `lpv.leaf_sum`.
    pub struct LeafSumParams {
        /// The grid; w of its size: slabs.
        pub grid: GridRow,
    }
}

/// What leaves send, and the opaque faces of single cells, as [`LEAF_SWEEP`] reads them. A thread a
/// leaf.
pub static LEAF_SOURCES: Pass = Pass::compute(
    "lpv.leaf_sources",
    "gi/lpv/octree/sources.comp",
    &[
        Binding::buffer("leaves", Access::ComputeRead),
        Binding::buffer("faces", Access::ComputeRead),
        Binding::buffer("flux", Access::ComputeRead),
        Binding::image("sources", Access::ComputeWrite),
    ],
    LeafSourceParams::LAYOUT,
);

/// One step for all directions of some octants: leaves whose upwind neighbours are all done. A
/// thread a leaf and octant; the steps of a sweep are a chain.
pub static LEAF_SWEEP: Pass = Pass {
    constants: &["ADD", "SIDES"],
    ..Pass::compute(
        "lpv.leaf_sweep",
        "gi/lpv/octree/sweep.comp",
        &[
            Binding::buffer("directions", Access::ComputeRead),
            Binding::buffer("steps", Access::ComputeRead),
            Binding::image("order", Access::ComputeRead),
            Binding::image("rows", Access::ComputeRead),
            Binding::image("sources", Access::ComputeRead),
            Binding::image("front", Access::ComputeReadWrite),
            Binding::image("slabs", Access::ComputeReadWrite),
            Binding::buffer("side_light", Access::ComputeRead),
        ],
        LeafSweepParams::LAYOUT,
    )
};

/// Sums the slabs of the octants, for all cells of each leaf. A thread a cell.
pub static LEAF_SUM: Pass = Pass::compute(
    "lpv.leaf_sum",
    "gi/lpv/octree/sum.comp",
    &[
        Binding::buffer("leaf_of", Access::ComputeRead),
        Binding::image("slabs", Access::ComputeRead),
        Binding::image("light", Access::ComputeWrite),
        Binding::image("light_band2", Access::ComputeWrite),
    ],
    LeafSumParams::LAYOUT,
);

/// Threads of a workgroup of the sweep.
const GROUP: u32 = 64;
/// Texels of a row of lists in images (`LIST_ROW` in `gi/lpv/octree/leaves.glsl`).
const LIST_ROW: u32 = 4096;
/// Leaves of a row of the sources and slabs (`LEAF_ROW` there).
const LEAF_ROW: u32 = 2048;
/// Slots of a row of the front (`SLOT_ROW` there).
const SLOT_ROW: u32 = 256;
/// Octants that are swept at once share this much for their sums (bytes).
const MOST_SLAB_BYTES: u64 = 48 << 20;
/// The same for the radiance on their way (bytes).
const MOST_FRONT_BYTES: u64 = 48 << 20;

/// Sweeps of one octree.
pub struct LeafSweep {
    /// Where it is fine.
    pub settings: LeafSettings,
    /// The directions.
    pub directions: Directions,
    list: Arc<Buffer>,
    /// Of the scene as it was last.
    pub leaves: Leaves,
    tables: Option<Tables>,
}

/// What the passes read of the leaves, and room for their light.
struct Tables {
    /// A word a leaf.
    words: Arc<Buffer>,
    /// The leaf of each cell.
    of_cell: Arc<Buffer>,
    /// Steps of all octants, as many of each.
    steps: Arc<Buffer>,
    /// Leaves of each step.
    sizes: Vec<[u32; 8]>,
    order: Arc<Image>,
    rows: Arc<Image>,
    sources: Arc<Image>,
    front: Arc<Image>,
    slabs: Arc<Image>,
    octants_at_once: u32,
}

impl LeafSweep {
    /// Takes what comes in from another environment, or at another scale.
    pub fn set_inflow(&self, gpu: &Gpu, inflow: Inflow<'_>) -> Result<(), Error> {
        let words = self.directions.words(inflow);
        gpu.upload_buffer(&self.list, bytemuck::cast_slice(&words))
    }

    /// Allocates what does not depend on the leaves.
    pub fn new(
        gpu: &Gpu,
        (directions, settings): (u32, LeafSettings),
        inflow: Inflow<'_>,
    ) -> Result<Self, Error> {
        let directions = Directions::spiral(directions);
        let words = directions.words(inflow);
        Ok(LeafSweep {
            settings,
            list: storage(
                gpu,
                ("lpv.directions", Owner::Store),
                bytemuck::cast_slice(&words),
            )?,
            directions,
            leaves: Leaves::default(),
            tables: None,
        })
    }

    /// Finds the leaves around opaque faces, and the order in which they are swept.
    pub fn divide(&mut self, gpu: &Gpu, faces: &Faces) -> Result<(), Error> {
        // What was there before makes room first.
        self.tables = None;
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&faces.words)?);
        self.leaves = Leaves::new(&faces.grid, &words, self.settings);
        let max_level = self.settings.max_level;
        let schedule =
            |octant| Schedule::new(&faces.grid, &self.leaves, &words, (max_level, octant));
        let schedules = (0..8).into_par_iter().map(schedule);
        let schedules: Vec<Schedule> =
            schedules
                .collect::<Result<_, _>>()
                .map_err(|TooManyOnTheirWay(wanted)| Error::ImageTooLarge {
                    resource: "lpv.front".into(),
                    wanted: format!("{wanted} leaves on their way at once"),
                    available: format!("{}", u32::from(u16::MAX) + 1),
                })?;
        self.tables = Some(Tables::new(gpu, self, &schedules)?);
        Ok(())
    }

    /// The leaf of each cell, once they are found.
    pub fn of_cell(&self) -> Option<&Arc<Buffer>> {
        self.tables.as_ref().map(|tables| &tables.of_cell)
    }

    /// A word a leaf, once they are found.
    pub(super) fn words(&self) -> Option<&Arc<Buffer>> {
        self.tables.as_ref().map(|tables| &tables.words)
    }

    /// Adds the passes that bring the flux of all leaves (integers of `flux_unit`, W), and the
    /// light of the sides of all opaque faces, to all cells.
    pub fn run(
        &self,
        frame: &mut Frame,
        faces: &Faces,
        (flux, flux_unit): (&Arc<Buffer>, f32),
        light: &Light,
    ) {
        let Some(tables) = &self.tables else { return };
        let leaf_count = self.leaves.all.len() as u32;
        let grid = faces.grid;
        let face_m2 = grid.cell_size * grid.cell_size;
        frame
            .pass(&LEAF_SOURCES)
            .bind("leaves", &tables.words)
            .bind("faces", &faces.words)
            .bind("flux", flux)
            .bind("sources", &tables.sources)
            .push(&LeafSourceParams {
                grid: grid.row(leaf_count),
                radiance_unit: flux_unit / (std::f32::consts::PI * face_m2),
            })
            .dispatch([leaf_count.div_ceil(64), 1, 1]);
        let side_light = faces.sides.as_ref().map(|sides| &sides.light);
        for first_octant in (0..8).step_by(tables.octants_at_once as usize) {
            frame
                .pass(&LEAF_SWEEP)
                .bind("directions", &self.list)
                .bind("steps", &tables.steps)
                .bind("order", &tables.order)
                .bind("rows", &tables.rows)
                .bind("sources", &tables.sources)
                .bind("front", &tables.front)
                .bind("slabs", &tables.slabs)
                .bind("side_light", side_light.unwrap_or(&self.list))
                .constant("ADD", first_octant > 0)
                .constant("SIDES", side_light.is_some())
                .dispatch_chain(tables.chain(first_octant, self.directions.most_pairs()));
        }
        let [x, y, z] = grid.size.to_array();
        frame
            .pass(&LEAF_SUM)
            .bind("leaf_of", &tables.of_cell)
            .bind("slabs", &tables.slabs)
            .bind("light", &light.low)
            .bind("light_band2", light.bound_band2())
            .push(&LeafSumParams {
                grid: grid.row(tables.octants_at_once),
            })
            .dispatch([x.div_ceil(8), y.div_ceil(8), z]);
    }
}

impl Tables {
    fn new(gpu: &Gpu, sweep: &LeafSweep, schedules: &[Schedule]) -> Result<Self, Error> {
        let leaves = &sweep.leaves;
        let (pairs, leaf_count) = (vk::Format::R32G32B32A32_UINT, leaves.all.len() as u32);
        let leaf_rows = leaf_count.div_ceil(LEAF_ROW);
        let slots = schedules.iter().map(|schedule| schedule.slot_count).max();
        let slot_rows = slots.unwrap_or(1).div_ceil(SLOT_ROW);
        let layers = sweep.directions.most_pairs();
        let slab_bytes = u64::from(LEAF_ROW * leaf_rows * COEFFICIENT_PAIRS) * PAIR_BYTES;
        let front_bytes = u64::from(SLOT_ROW * slot_rows * layers) * PAIR_BYTES;
        let fits = |octants: &u32| {
            let count = u64::from(*octants);
            count * slab_bytes <= MOST_SLAB_BYTES && count * front_bytes <= MOST_FRONT_BYTES
        };
        let octants_at_once = [8, 4, 2].into_iter().find(fits).unwrap_or(1);
        let most = |schedule: &Schedule| schedule.steps.len();
        let step_count = schedules.iter().map(most).max().unwrap_or(0);
        let list =
            |name, words: &[u32]| storage(gpu, (name, Owner::Store), bytemuck::cast_slice(words));
        let words: Vec<u32> = leaves.all.iter().map(|leaf| leaf.word()).collect();
        let order = schedules.iter().flat_map(|one| one.leaves.iter().copied());
        let rows = schedules.iter().flat_map(|one| one.rows.iter().copied());
        let front = volume(
            gpu,
            ("lpv.front", pairs),
            [SLOT_ROW, slot_rows, octants_at_once * layers],
            ImageUsage::STORAGE,
        )?;
        gpu.upload_image(&front, 0, 0, bytemuck::cast_slice(&empty_front(&front)))?;
        Ok(Tables {
            words: list("lpv.leaves", &words)?,
            of_cell: list("lpv.leaf_of", &leaves.of_cell)?,
            steps: list("lpv.steps", &step_words(schedules, step_count))?,
            sizes: (0..step_count).map(|step| sizes(schedules, step)).collect(),
            order: upload(gpu, ("lpv.order", vk::Format::R32_UINT), order.collect(), 0)?,
            rows: upload(
                gpu,
                ("lpv.rows", vk::Format::R16G16B16A16_UINT),
                rows.collect(),
                [0; 4],
            )?,
            sources: volume(
                gpu,
                ("lpv.sources", pairs),
                [LEAF_ROW, leaf_rows, 3],
                ImageUsage::STORAGE,
            )?,
            front,
            slabs: volume(
                gpu,
                ("lpv.slabs", pairs),
                [LEAF_ROW, leaf_rows, octants_at_once * COEFFICIENT_PAIRS],
                ImageUsage::STORAGE,
            )?,
            octants_at_once,
        })
    }

    /// The steps of some octants, in which each has its own leaves.
    fn chain(&self, first_octant: u32, most_pairs: u32) -> Vec<BatchDispatch> {
        let own = first_octant as usize..(first_octant + self.octants_at_once) as usize;
        let most = |sizes: &[u32; 8]| sizes[own.clone()].iter().copied().max().unwrap_or(0);
        let steps = (0u32..).zip(self.sizes.iter().map(most));
        let steps = steps.take_while(|(_, count)| *count > 0);
        let dispatch = |(step, count): (u32, u32)| BatchDispatch {
            push: bytemuck::bytes_of(&LeafSweepParams {
                step,
                step_count: self.sizes.len() as u32,
                first_octant,
                most_pairs,
            })
            .to_vec(),
            groups: [count.div_ceil(GROUP), self.octants_at_once, 1],
            ..Default::default()
        };
        steps.map(dispatch).collect()
    }
}

/// Leaves of a step, by octant.
fn sizes(schedules: &[Schedule], step: usize) -> [u32; 8] {
    std::array::from_fn(|octant| {
        let step = schedules.get(octant).and_then(|one| one.steps.get(step));
        step.map_or(0, |step| step.ones + step.fours)
    })
}

/// Steps as the sweep reads them, octant by octant, in the lists of all octants.
fn step_words(schedules: &[Schedule], step_count: usize) -> Vec<u32> {
    let (mut words, mut first_leaf, mut first_row) = (Vec::new(), 0, 0);
    for schedule in schedules {
        for step in &schedule.steps {
            words.extend([
                first_leaf + step.first_leaf,
                first_row + step.first_row,
                step.ones,
                step.fours,
            ]);
        }
        words.resize(words.len() + 4 * (step_count - schedule.steps.len()), 0);
        first_leaf += schedule.leaves.len() as u32;
        first_row += schedule.rows.len() as u32;
    }
    words
}

/// All black, but for the slot of the environment: half floats of (0, 0, 0, 1), twice.
fn empty_front(front: &Image) -> Vec<[u16; 8]> {
    let [x, y, z] = front.extent(0);
    let mut texels = vec![[0u16; 8]; (x * y * z) as usize];
    const ONE: u16 = 0x3c00;
    for layer in texels.chunks_exact_mut((x * y) as usize) {
        layer[usize::from(ENVIRONMENT)] = [0, 0, 0, ONE, 0, 0, 0, ONE];
    }
    texels
}

/// A list in rows of an image.
fn upload<T: bytemuck::Pod>(
    gpu: &Gpu,
    (name, format): (&str, vk::Format),
    mut list: Vec<T>,
    filler: T,
) -> Result<Arc<Image>, Error> {
    let rows = (list.len() as u32).div_ceil(LIST_ROW).max(1);
    list.resize((LIST_ROW * rows) as usize, filler);
    let image = gpu.create_image(&ImageDesc {
        name: name.into(),
        extent: [LIST_ROW, rows, 1],
        kind: ImageKind::D2,
        format,
        mips: 1,
        layers: 1,
        usage: ImageUsage::STORAGE,
        owner: Owner::Store,
    })?;
    gpu.upload_image(&image, 0, 0, bytemuck::cast_slice(&list))?;
    Ok(image)
}
