//! Propagation along discrete directions, each cell once, in upwind order.

use std::sync::Arc;

use glam::UVec3;

use super::directions::Directions;
use super::faces::Faces;
use super::grid::{CellGrid, GridRow};
use crate::gpu_struct;
use crate::graph::{
    Access, BatchDispatch, Binding, Buffer, Error, Frame, Gpu, Image, ImageDesc, ImageKind,
    ImageUsage, Owner, Pass, vk,
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
    ],
    SourceParams::LAYOUT,
);

/// One step for all directions of some octants: cells whose upwind neighbours are all done. A
/// thread a cell and octant; the steps of a sweep are a chain.
pub static SWEEP: Pass = Pass {
    constants: &["ADD", "SIDES"],
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
    ],
    SumParams::LAYOUT,
);

/// Threads of a workgroup of the sweep.
const GROUP: u32 = 256;
/// Pairs of the nine coefficients of three bands.
pub(super) const COEFFICIENT_PAIRS: u32 = 5;
/// A texel of what is on its way: two times four half floats.
pub(super) const PAIR_BYTES: u64 = 16;
/// Octants that are swept at once share this much for their sums (bytes).
const MOST_SLAB_BYTES: u64 = 48 << 20;
/// The same for the radiance on their way (bytes).
const MOST_FRONT_BYTES: u64 = 48 << 20;
/// Texels along the longest side of a volume that every device has.
const MOST_TEXELS: u32 = 2048;

/// Sweeps of one grid.
pub struct Sweep {
    grid: CellGrid,
    /// The directions.
    pub directions: Directions,
    list: Arc<Buffer>,
    order: Arc<Image>,
    sources: Arc<Image>,
    front: Arc<Image>,
    /// One for each octant that is swept at once.
    slabs: Arc<Image>,
    octants_at_once: u32,
    /// What the directions of all octants bring each cell: nine coefficients (W/(m² sr)), in alpha
    /// those of an environment of radiance 1.
    pub light: Arc<Image>,
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
    /// Allocates a sweep of a grid along this many directions.
    pub fn new(gpu: &Gpu, grid: CellGrid, directions: u32) -> Result<Self, Error> {
        let directions = Directions::spiral(directions);
        let [x, y, z] = grid.size.to_array();
        let slab_bytes = u64::from(grid.count() * COEFFICIENT_PAIRS) * PAIR_BYTES;
        let layers = 2 * directions.most_pairs();
        let front_bytes = u64::from(x * y * layers) * PAIR_BYTES;
        let fits = |octants: &u32| {
            let count = u64::from(*octants);
            count * slab_bytes <= MOST_SLAB_BYTES
                && count * front_bytes <= MOST_FRONT_BYTES
                && octants * z.max(layers) <= MOST_TEXELS
        };
        let octants_at_once = [8, 4, 2].into_iter().find(fits).unwrap_or(1);
        let list =
            |name, words: &[u32]| storage(gpu, (name, Owner::Store), bytemuck::cast_slice(words));
        let pairs = vk::Format::R32G32B32A32_UINT;
        Ok(Sweep {
            grid,
            list: list("lpv.directions", &directions.words())?,
            directions,
            order: upload_order(gpu, grid.size)?,
            sources: volume(
                gpu,
                ("lpv.sources", pairs),
                [3 * x, y, z],
                ImageUsage::STORAGE,
            )?,
            front: volume(
                gpu,
                ("lpv.front", pairs),
                [x, y, octants_at_once * layers],
                ImageUsage::STORAGE,
            )?,
            slabs: volume(
                gpu,
                ("lpv.slabs", pairs),
                [COEFFICIENT_PAIRS * x, y, octants_at_once * z],
                ImageUsage::STORAGE,
            )?,
            octants_at_once,
            light: volume(
                gpu,
                ("lpv.light", vk::Format::R16G16B16A16_SFLOAT),
                [3 * x, 3 * y, z],
                ImageUsage::STORAGE | ImageUsage::SAMPLED,
            )?,
        })
    }

    /// Adds the passes that bring the flux of all cells (integers of `flux_unit`, W), and the light
    /// of the sides of all opaque faces, to all cells.
    pub fn run(&self, frame: &mut Frame, faces: &Faces, (flux, flux_unit): (&Arc<Buffer>, f32)) {
        let side_light = faces.sides.as_ref().map(|sides| &sides.light);
        let face_m2 = self.grid.cell_size * self.grid.cell_size;
        let [x, y, z] = self.grid.size.to_array();
        frame
            .pass(&SOURCES)
            .bind("faces", &faces.words)
            .bind("flux", flux)
            .bind("sources", &self.sources)
            .push(&SourceParams {
                grid: self.grid.row(0),
                radiance_unit: flux_unit / (std::f32::consts::PI * face_m2),
            })
            .dispatch([x.div_ceil(8), y.div_ceil(8), z]);
        let steps = steps(self.grid.size);
        for first_octant in (0..8).step_by(self.octants_at_once as usize) {
            let mut first_cell = 0;
            let chain = (0u32..).zip(&steps).map(|(step, &cell_count)| {
                let params = SweepParams {
                    grid: self.grid.row(self.directions.most_pairs()),
                    step,
                    first_cell,
                    cell_count,
                    first_octant,
                };
                first_cell += cell_count;
                BatchDispatch {
                    push: bytemuck::bytes_of(&params).to_vec(),
                    groups: [cell_count.div_ceil(GROUP), self.octants_at_once, 1],
                    ..Default::default()
                }
            });
            let chain = chain.collect();
            frame
                .pass(&SWEEP)
                .bind("directions", &self.list)
                .bind("order", &self.order)
                .bind("sources", &self.sources)
                .bind("front", &self.front)
                .bind("slabs", &self.slabs)
                .bind("side_light", side_light.unwrap_or(&self.list))
                .constant("ADD", first_octant > 0)
                .constant("SIDES", side_light.is_some())
                .dispatch_chain(chain);
        }
        frame
            .pass(&SUM)
            .bind("slabs", &self.slabs)
            .bind("light", &self.light)
            .push(&SumParams {
                grid: self.grid.row(self.octants_at_once),
            })
            .dispatch([x.div_ceil(8), y.div_ceil(8), z]);
    }
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
