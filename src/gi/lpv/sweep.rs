//! Propagation along discrete directions, each cell once, in upwind order.

use std::sync::Arc;

use glam::UVec3;

use super::directions::Directions;
use super::grid::{CellGrid, GridRow};
use crate::gpu_struct;
use crate::graph::{
    Access, BatchDispatch, Binding, Buffer, BufferDesc, BufferUsage, Error, Frame, Gpu, Image,
    ImageDesc, ImageKind, ImageUsage, Owner, Pass, vk,
};
use crate::render::storage;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.sweep`.
    pub struct SweepParams {
        /// The grid; w of its size: directions that an octant has at most.
        pub grid: GridRow,
        /// x: step; y and z: smallest a and b of its cells; w: first octant.
        pub step: [i32; 4],
        /// One integer step of flux, over π h² (W/(m² sr)).
        pub radiance_unit: f32,
    }
}

gpu_struct! {
    /// Parameters of `lpv.sum`.
    pub struct SumParams {
        /// xyz: texels of the volume; w: slabs.
        pub size: [i32; 4],
    }
}

/// One step for all directions of some octants: cells whose upwind neighbours are all done. A
/// thread a cell and octant; the steps of a sweep are a chain.
pub static SWEEP: Pass = Pass {
    constants: &["ADD"],
    ..Pass::compute(
        "lpv.sweep",
        "gi/lpv/sweep.comp",
        &[
            Binding::buffer("directions", Access::ComputeRead),
            Binding::buffer("faces", Access::ComputeRead),
            Binding::buffer("flux", Access::ComputeRead),
            Binding::buffer("front", Access::ComputeReadWrite),
            Binding::image("light", Access::ComputeReadWrite),
        ],
        SweepParams::LAYOUT,
    )
};

/// Sums the slabs of the octants. A thread a texel.
pub static SUM: Pass = Pass::compute(
    "lpv.sum",
    "gi/lpv/sum.comp",
    &[
        Binding::image("slabs", Access::ComputeRead),
        Binding::image("light", Access::ComputeWrite),
    ],
    SumParams::LAYOUT,
);

/// What a texel of the light has: RGBA16F.
const TEXEL_BYTES: u64 = 8;
/// Coefficients of three bands.
const COEFFICIENTS: u64 = 9;
/// Octants that are swept at once share this much for their sums (bytes).
const MOST_SLAB_BYTES: u64 = 40 << 20;
/// The same for the radiance on their way (bytes).
const MOST_FRONT_BYTES: u64 = 64 << 20;

/// Sweeps of one grid.
pub(super) struct Sweep {
    grid: CellGrid,
    directions: Directions,
    list: Arc<Buffer>,
    front: Arc<Buffer>,
    /// One for each octant that is swept at once, where there are several.
    slabs: Option<Arc<Image>>,
    octants_at_once: u32,
    /// What the directions of all octants bring each cell: nine coefficients (W/(m² sr)), in alpha
    /// those of an environment of radiance 1.
    pub(super) light: Arc<Image>,
}

fn volume(gpu: &Gpu, name: &str, size: UVec3, slabs: u32) -> Result<Arc<Image>, Error> {
    gpu.create_image(&ImageDesc {
        name: name.into(),
        extent: [3 * size.x, 3 * size.y, slabs * size.z],
        kind: ImageKind::D3,
        format: vk::Format::R16G16B16A16_SFLOAT,
        mips: 1,
        layers: 1,
        usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
        owner: Owner::Store,
    })
}

impl Sweep {
    pub(super) fn new(gpu: &Gpu, grid: CellGrid, directions: u32) -> Result<Self, Error> {
        let directions = Directions::spiral(directions);
        let slab = u64::from(grid.count()) * COEFFICIENTS * TEXEL_BYTES;
        let plane = u64::from(grid.size.x * grid.size.y);
        let front = u64::from(directions.most()) * 2 * plane * size_of::<[f32; 4]>() as u64;
        let fits = |octants: &u64| {
            octants * slab <= MOST_SLAB_BYTES && octants * front <= MOST_FRONT_BYTES
        };
        let octants_at_once = [8, 4, 2].into_iter().find(fits).unwrap_or(1);
        Ok(Sweep {
            grid,
            list: storage(
                gpu,
                ("lpv.directions", Owner::Store),
                bytemuck::cast_slice(&directions.words()),
            )?,
            directions,
            front: gpu.create_buffer(&BufferDesc {
                name: "lpv.front".into(),
                size_bytes: octants_at_once * front,
                usage: BufferUsage::Storage,
                owner: Owner::Store,
            })?,
            slabs: (octants_at_once > 1)
                .then(|| volume(gpu, "lpv.slabs", grid.size, octants_at_once as u32))
                .transpose()?,
            octants_at_once: octants_at_once as u32,
            light: volume(gpu, "lpv.light", grid.size, 1)?,
        })
    }

    /// Adds the passes that bring the flux of all cells to all others.
    pub(super) fn run(
        &self,
        frame: &mut Frame,
        faces: &Arc<Buffer>,
        (flux, flux_unit): (&Arc<Buffer>, f32),
    ) {
        let face_m2 = self.grid.cell_size * self.grid.cell_size;
        let target = self.slabs.as_ref().unwrap_or(&self.light);
        for first in (0..8).step_by(self.octants_at_once as usize) {
            let steps = steps(self.grid.size).map(|step| {
                let params = SweepParams {
                    grid: self.grid.row(self.directions.most()),
                    step: [step.index, step.first[0], step.first[1], first as i32],
                    radiance_unit: flux_unit / (std::f32::consts::PI * face_m2),
                };
                BatchDispatch {
                    push: bytemuck::bytes_of(&params).to_vec(),
                    groups: [
                        step.count[0].div_ceil(8),
                        step.count[1].div_ceil(8),
                        self.octants_at_once,
                    ],
                    ..Default::default()
                }
            });
            frame
                .pass(&SWEEP)
                .bind("directions", &self.list)
                .bind("faces", faces)
                .bind("flux", flux)
                .bind("front", &self.front)
                .bind("light", target)
                .constant("ADD", first > 0)
                .dispatch_chain(steps.collect());
        }
        if let Some(slabs) = &self.slabs {
            let [x, y, z] = self.light.extent(0);
            frame
                .pass(&SUM)
                .bind("slabs", slabs)
                .bind("light", &self.light)
                .push(&SumParams {
                    size: [x, y, z, self.octants_at_once].map(|number| number as i32),
                })
                .dispatch([x.div_ceil(8), y.div_ceil(8), z]);
        }
    }
}

/// A step of a sweep: the cells (a, b, c) with a + b + c = index.
struct Step {
    index: i32,
    /// Smallest a and b.
    first: [i32; 2],
    /// How many there are of each.
    count: [u32; 2],
}

/// The steps of a sweep through a grid.
fn steps(size: UVec3) -> impl Iterator<Item = Step> {
    let [x, y, z] = size.as_ivec3().to_array();
    (0..x + y + z - 2).map(move |index| {
        let range = |own: i32, others: i32| {
            let first = (index - (others - 2)).max(0);
            (first, (own - 1).min(index) - first + 1)
        };
        let ((a, a_count), (b, b_count)) = (range(x, y + z), range(y, x + z));
        Step {
            index,
            first: [a, b],
            count: [a_count as u32, b_count as u32],
        }
    })
}
