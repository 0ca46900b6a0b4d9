//! Propagation along discrete directions, each cell once, in upwind order.

use std::sync::Arc;

use glam::UVec3;

use super::directions::Directions;
use super::faces::Faces;
use super::grid::GridRow;
use super::inflow::Inflow;
use super::light::Light;
use super::lobes::groups;
use crate::gpu_struct;
use crate::graph::{
    Access, BatchDispatch, Binding, Buffer, DeviceKind, Error, Frame, Gpu, Image, ImageDesc,
    ImageKind, ImageUsage, Owner, Pass, vk,
};
use crate::render::storage;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.sweep`.
    pub struct SweepParams {
        /// The grid; w of its size: pairs of directions that an octant has at most.
        pub grid: GridRow,
        /// Which step it is.
        pub step: u32,
        /// Where its cells begin in the order.
        pub first_cell: u32,
        /// How many there are.
        pub cell_count: u32,
        /// The first octant that is swept.
        pub first_octant: u32,
        /// xyz: the first cell of the finer grid inside; w: its cells of this size along an edge.
        pub inner: [i32; 4],
        /// Rows where borders begin; x: the grid's own, y: the finer grid's.
        pub rows: [i32; 4],
        /// The first pair of directions of each octant that is swept.
        pub first_pair: u32,
        /// How many pairs of each octant are swept.
        pub pair_count: u32,
    }
}

gpu_struct! {
    /// Parameters of `lpv.sources`.
    pub struct SourceParams {
        /// The grid.
        pub grid: GridRow,
        /// One integer step of flux, over π h² (W/(m² sr)).
        pub radiance_unit: f32,
    }
}

gpu_struct! {
    /// Parameters of `lpv.sum`.
    pub struct SumParams {
        /// The grid; w of its size: slabs.
        pub grid: GridRow,
    }
}

/// What cells send, and their opaque faces, as [`SWEEP`] reads them. A thread a cell.
pub static SOURCES: Pass = Pass::compute(
    "lpv.sources",
    "gi/lpv/sources.comp",
    &[
        Binding::buffer("faces", Access::ComputeRead),
        Binding::buffer("flux", Access::ComputeRead),
        Binding::image("sources", Access::ComputeWrite),
        Binding::image("source_faces", Access::ComputeWrite),
    ],
    SourceParams::LAYOUT,
);

/// One step for all directions of some octants: cells whose upwind neighbours are all done. A
/// thread a cell and octant; the steps of a sweep are a chain.
pub static SWEEP: Pass = Pass {
    constants: &["ADD", "SIDES", "IS_INNER", "HAS_INNER", "SLABS", "KEEP"],
    ..Pass::compute(
        "lpv.sweep",
        "gi/lpv/sweep.comp",
        &[
            Binding::buffer("directions", Access::ComputeRead),
            Binding::image("order", Access::ComputeRead),
            Binding::image("sources", Access::ComputeRead),
            Binding::image("front", Access::ComputeReadWrite),
            Binding::image("slabs", Access::ComputeReadWrite),
            Binding::buffer("side_light", Access::ComputeRead),
            Binding::image("borders", Access::ComputeReadWrite),
            Binding::image("light", Access::ComputeReadWrite),
            Binding::image("light_band2", Access::ComputeReadWrite),
            Binding::image("source_faces", Access::ComputeRead),
        ],
        SweepParams::LAYOUT,
    )
};

/// Sums the slabs of the octants. A thread a cell.
pub static SUM: Pass = Pass::compute(
    "lpv.sum",
    "gi/lpv/sum.comp",
    &[
        Binding::image("slabs", Access::ComputeRead),
        Binding::image("light", Access::ComputeWrite),
        Binding::image("light_band2", Access::ComputeWrite),
    ],
    SumParams::LAYOUT,
);

/// Threads of a workgroup of the sweep.
const GROUP: u32 = 256;
/// Pairs of the nine coefficients of three bands.
pub(super) const COEFFICIENT_PAIRS: u32 = 5;
/// A texel of what is on its way: two times four half floats.
pub(super) const PAIR_BYTES: u64 = 16;
/// Octants that are swept at once share this much for their sums (bytes). At once there are fewer
/// barriers, which a processor without its own memory and clock hardly notices.
pub(super) fn most_slab_bytes(gpu: &Gpu) -> u64 {
    match gpu.info().kind {
        DeviceKind::Cpu => 3 << 20,
        _ => 24 << 20,
    }
}

/// The same for the radiance on their way (bytes).
pub(super) const MOST_FRONT_BYTES: u64 = 24 << 20;
/// The same for radiance that is kept of all cells (bytes).
const MOST_KEPT_BYTES: u64 = 128 << 20;
/// Texels along the longest side of a volume that every device has.
pub(super) const MOST_TEXELS: u32 = 2048;

/// Sweeps of grids of one size.
pub struct Sweep {
    size: UVec3,
    /// The directions.
    pub directions: Directions,
    pub(super) list: Arc<Buffer>,
    pub(super) order: Arc<Image>,
    pub(super) sources: Sources,
    /// Radiance on its way, or that of all cells (`gi/lpv/sweep.comp`).
    pub(super) front: Arc<Image>,
    /// One for each octant that is swept at once; one alone adds to the light itself.
    slabs: Arc<Image>,
    octants_at_once: u32,
    pairs_at_once: u32,
    pub(super) keeps: bool,
    borders: Arc<Image>,
}

/// Directions that are swept at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Batch {
    /// The first octant.
    pub(super) first_octant: u32,
    /// How many octants there are.
    pub(super) octants: u32,
    /// The first pair of directions of each.
    pub(super) first_pair: u32,
    /// How many pairs each has at most.
    pub(super) pairs: u32,
    /// Whether none follows.
    pub(super) is_last: bool,
}

/// What others do while light is swept.
pub(super) enum Watch<'a> {
    /// After each batch, they may read the radiance that is kept of all cells.
    Batches(&'a mut dyn FnMut(&mut Frame, Batch)),
    /// After each step, they may read its radiance, which is gone two steps later.
    Steps(&'a mut dyn FnMut(&mut Frame, &[BatchDispatch])),
}

/// A grid inside another whose cells are twice as large.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nested {
    /// How many grids it is inside of.
    pub depth: u32,
    /// Its first cell of the outer one.
    pub first: UVec3,
}

/// What a sweep has to do with other grids.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Nesting {
    /// The grid itself, where light comes in from the outer one.
    pub own: Option<Nested>,
    /// The grid inside, to which it hands light on.
    pub inner: Option<Nested>,
}

impl Sweep {
    /// Cells of the outer grid along an edge of one inside it.
    fn inner_cells(size: UVec3) -> u32 {
        size.x / 2
    }

    fn row(size: UVec3, nested: Option<Nested>) -> u32 {
        nested.map_or(0, |nested| (nested.depth - 1) * Self::inner_cells(size))
    }
}

pub(super) fn volume(
    gpu: &Gpu,
    (name, format): (&str, vk::Format),
    extent: [u32; 3],
    usage: ImageUsage,
) -> Result<Arc<Image>, Error> {
    gpu.create_image(&ImageDesc {
        name: name.into(),
        extent,
        kind: ImageKind::D3,
        format,
        mips: 1,
        layers: 1,
        usage,
        owner: Owner::Store,
    })
}

impl Sweep {
    /// Allocates sweeps of grids of this size along this many directions, `nested` of them inside
    /// others: these are cubes. One that `keeps` has the radiance of all cells along the directions
    /// of a batch.
    pub fn new(
        gpu: &Gpu,
        size: UVec3,
        (directions, inflow): (u32, Inflow<'_>),
        nested: u32,
        keeps: bool,
    ) -> Result<Self, Error> {
        let directions = Directions::spiral(directions);
        let [x, y, z] = size.to_array();
        let slab_bytes = u64::from(x * y * z * COEFFICIENT_PAIRS) * PAIR_BYTES;
        // Of each pair of directions.
        let (layers, most_bytes) = if keeps {
            (z, MOST_KEPT_BYTES)
        } else {
            (2, MOST_FRONT_BYTES)
        };
        let most_pairs = directions.most_pairs();
        let fits = |octants: u32, pairs: u32| {
            let deepest = octants * (layers * pairs).max(z);
            u64::from(octants) * slab_bytes <= most_slab_bytes(gpu)
                && u64::from(x * y * octants * layers * pairs) * PAIR_BYTES <= most_bytes
                && deepest <= MOST_TEXELS
        };
        let octants_at_once = [8, 4, 2]
            .into_iter()
            .find(|octants| fits(*octants, most_pairs))
            .unwrap_or(1);
        let pair_bytes = u64::from(x * y * layers) * PAIR_BYTES;
        let pairs_at_once = if keeps {
            let room = (most_bytes / pair_bytes).min(u64::from(MOST_TEXELS / z)) as u32;
            (room / octants_at_once).clamp(1, most_pairs.max(1))
        } else {
            most_pairs
        };
        let list =
            |name, words: &[u32]| storage(gpu, (name, Owner::Store), bytemuck::cast_slice(words));
        let pairs = vk::Format::R32G32B32A32_UINT;
        let borders = match nested {
            0 => [1; 3],
            _ => {
                let cells = Self::inner_cells(size);
                [cells, nested * cells, 8 * 3 * directions.most_pairs()]
            }
        };
        Ok(Sweep {
            size,
            list: list("lpv.directions", &directions.words(inflow))?,
            directions,
            order: upload_order(gpu, size)?,
            sources: Sources::new(gpu, size)?,
            front: volume(
                gpu,
                ("lpv.front", pairs),
                [x, y, octants_at_once * layers * pairs_at_once.max(1)],
                ImageUsage::STORAGE,
            )?,
            slabs: volume(
                gpu,
                ("lpv.slabs", pairs),
                match octants_at_once {
                    1 => [1; 3],
                    slabs => [COEFFICIENT_PAIRS * x, y, slabs * z],
                },
                ImageUsage::STORAGE,
            )?,
            octants_at_once,
            pairs_at_once,
            keeps,
            borders: volume(gpu, ("lpv.borders", pairs), borders, ImageUsage::STORAGE)?,
        })
    }

    fn batches(&self) -> Vec<Batch> {
        let all = self.directions.most_pairs();
        let octants = (0..8).step_by(self.octants_at_once as usize);
        let mut batches: Vec<Batch> = octants
            .flat_map(|first_octant| {
                let pairs = (0..all).step_by(self.pairs_at_once.max(1) as usize);
                pairs.map(move |first_pair| Batch {
                    first_octant,
                    octants: self.octants_at_once,
                    first_pair,
                    pairs: self.pairs_at_once,
                    is_last: false,
                })
            })
            .collect();
        if let Some(last) = batches.last_mut() {
            last.is_last = true;
        }
        batches
    }

    /// Takes what comes in from another environment, or at another scale.
    pub fn set_inflow(&self, gpu: &Gpu, inflow: Inflow<'_>) -> Result<(), Error> {
        let words = self.directions.words(inflow);
        gpu.upload_buffer(&self.list, bytemuck::cast_slice(&words))
    }

    /// Cells of the step that has most.
    pub(super) fn widest_step(&self) -> u32 {
        steps(self.size).into_iter().max().unwrap_or(0)
    }

    /// Adds the passes that bring the flux of all cells (integers of `flux_unit`, W), and the light
    /// of the sides of all opaque faces, to all cells.
    pub(super) fn run(
        &self,
        frame: &mut Frame,
        faces: &Faces,
        flux: (&Arc<Buffer>, f32),
        (light, nesting): (&Light, Nesting),
        watch: &mut Watch<'_>,
    ) {
        let grid = faces.grid;
        let [x, y, z] = self.size.to_array();
        find_sources(frame, faces, flux, &self.sources);
        let steps = steps(self.size);
        for batch in self.batches() {
            self.run_batch(frame, faces, (batch, &steps), (light, nesting), watch);
            if let Watch::Batches(after) = watch {
                after(frame, batch);
            }
        }
        if self.octants_at_once > 1 {
            frame
                .pass(&SUM)
                .bind("slabs", &self.slabs)
                .bind("light", &light.low)
                .bind("light_band2", light.bound_band2())
                .push(&SumParams {
                    grid: grid.row(self.octants_at_once),
                })
                .dispatch([x.div_ceil(8), y.div_ceil(8), z]);
        }
    }

    fn run_batch(
        &self,
        frame: &mut Frame,
        faces: &Faces,
        (batch, steps): (Batch, &[u32]),
        (light, nesting): (&Light, Nesting),
        watch: &mut Watch<'_>,
    ) {
        let side_light = faces.sides.as_ref().map(|sides| &sides.light);
        let inner = nesting.inner.map_or(UVec3::ZERO, |inner| inner.first);
        let rows = [nesting.own, nesting.inner].map(|nested| Self::row(self.size, nested));
        let mut first_cell = 0;
        let chain = (0u32..).zip(steps).map(|(step, &cell_count)| {
            let params = SweepParams {
                grid: faces.grid.row(self.directions.most_pairs()),
                step,
                first_cell,
                cell_count,
                first_octant: batch.first_octant,
                inner: inner
                    .extend(Self::inner_cells(self.size))
                    .as_ivec4()
                    .to_array(),
                rows: [rows[0] as i32, rows[1] as i32, 0, 0],
                first_pair: batch.first_pair,
                pair_count: batch.pairs,
            };
            first_cell += cell_count;
            BatchDispatch {
                push: bytemuck::bytes_of(&params).to_vec(),
                groups: [cell_count.div_ceil(GROUP), batch.octants, 1],
                ..Default::default()
            }
        });
        let chain: Vec<BatchDispatch> = chain.collect();
        let at_once = match watch {
            Watch::Steps(_) => 1,
            Watch::Batches(_) => chain.len(),
        };
        for part in chain.chunks(at_once) {
            frame
                .pass(&SWEEP)
                .bind("directions", &self.list)
                .bind("order", &self.order)
                .bind("sources", &self.sources.vectors)
                .bind("source_faces", &self.sources.faces)
                .bind("front", &self.front)
                .bind("slabs", &self.slabs)
                .bind("side_light", side_light.unwrap_or(&self.list))
                .bind("borders", &self.borders)
                .bind("light", &light.low)
                .bind("light_band2", light.bound_band2())
                .constant("ADD", batch.first_octant > 0 || batch.first_pair > 0)
                .constant("SIDES", side_light.is_some())
                .constant("IS_INNER", nesting.own.is_some())
                .constant("HAS_INNER", nesting.inner.is_some())
                .constant("SLABS", self.octants_at_once > 1)
                .constant("KEEP", self.keeps)
                .dispatch_chain(part.to_vec());
            if let Watch::Steps(after) = watch {
                after(frame, part);
            }
        }
    }
}

/// What cells send, and their opaque faces (`gi/lpv/sources.glsl`).
pub(super) struct Sources {
    /// Eight of nine numbers of flux.
    pub(super) vectors: Arc<Image>,
    /// The ninth, and the word of faces.
    pub(super) faces: Arc<Image>,
}

impl Sources {
    /// Allocates.
    pub(super) fn new(gpu: &Gpu, size: UVec3) -> Result<Self, Error> {
        let stored = |name, format| volume(gpu, (name, format), size.into(), ImageUsage::STORAGE);
        Ok(Sources {
            vectors: stored("lpv.sources", vk::Format::R32G32B32A32_UINT)?,
            faces: stored("lpv.source_faces", vk::Format::R16G16B16A16_UINT)?,
        })
    }
}

/// Adds the pass that finds what cells send of this flux (integers of the unit, W).
pub(super) fn find_sources(
    frame: &mut Frame,
    faces: &Faces,
    (flux, flux_unit): (&Arc<Buffer>, f32),
    sources: &Sources,
) {
    let grid = faces.grid;
    let face_m2 = grid.cell_size * grid.cell_size;
    frame
        .pass(&SOURCES)
        .bind("faces", &faces.words)
        .bind("flux", flux)
        .bind("sources", &sources.vectors)
        .bind("source_faces", &sources.faces)
        .push(&SourceParams {
            grid: grid.row(0),
            radiance_unit: flux_unit / (std::f32::consts::PI * face_m2),
        })
        .dispatch(groups(&grid));
}

/// The cells (a, b, c) with a + b + c = `step`: a and b of each.
fn cells_of(size: UVec3, step: u32) -> impl Iterator<Item = (u32, u32)> {
    let rows = step.saturating_sub(size.x + size.z - 2)..size.y.min(step + 1);
    rows.flat_map(move |b| {
        let first = (step - b).saturating_sub(size.z - 1);
        (first..size.x.min(step - b + 1)).map(move |a| (a, b))
    })
}

/// Number of steps of a sweep.
fn step_count(size: UVec3) -> u32 {
    size.element_sum() - 2
}

/// How many cells each step has.
fn steps(size: UVec3) -> Vec<u32> {
    (0..step_count(size))
        .map(|step| cells_of(size, step).count() as u32)
        .collect()
}

/// Texels of a row of the order (`ORDER_ROW` in `gi/lpv/sweep.comp`).
const ORDER_ROW: u32 = 1024;

/// a and b of all cells, 16 bits each, step by step, in rows of an image.
fn upload_order(gpu: &Gpu, size: UVec3) -> Result<Arc<Image>, Error> {
    let cells = (0..step_count(size)).flat_map(|step| cells_of(size, step));
    let mut words: Vec<u32> = cells.map(|(a, b)| a | b << 16).collect();
    let rows = (words.len() as u32).div_ceil(ORDER_ROW);
    words.resize((ORDER_ROW * rows) as usize, 0);
    let image = gpu.create_image(&ImageDesc {
        name: "lpv.order".into(),
        extent: [ORDER_ROW, rows, 1],
        kind: ImageKind::D2,
        format: vk::Format::R32_UINT,
        mips: 1,
        layers: 1,
        usage: ImageUsage::STORAGE,
        owner: Owner::Store,
    })?;
    gpu.upload_image(&image, 0, 0, bytemuck::cast_slice(&words))?;
    Ok(image)
}
