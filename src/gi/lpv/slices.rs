//! Propagation along discrete directions, slice by slice, each cell from the four of the slice
//! before that are around the point that its light comes from.

use std::sync::Arc;

use glam::{DVec3, UVec3};

use super::directions::{Directions, ROW, row};
use super::faces::Faces;
use super::grid::GridRow;
use super::inflow::Inflow;
use super::light::Light;
use super::lobes::groups;
use super::sweep::{
    COEFFICIENT_PAIRS, MOST_FRONT_BYTES, MOST_TEXELS, PAIR_BYTES, SUM, Sources, SumParams,
    find_sources, most_slab_bytes, volume,
};
use crate::gpu_struct;
use crate::graph::{
    Access, BatchDispatch, Binding, Buffer, Error, Frame, Gpu, Image, ImageUsage, Owner, Pass, vk,
};
use crate::render::storage;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.slices`.
    pub struct SlicesParams {
        /// The grid; w of its size: pairs of directions that a group has at most.
        pub grid: GridRow,
        /// Which slice it is, upwind ones first.
        pub slice: u32,
        /// The first group of directions.
        pub first_group: u32,
    }
}

/// One slice for all directions of some groups. A thread a cell and group; slices are a chain.
pub static SLICES: Pass = Pass {
    constants: &["ADD", "SIDES"],
    ..Pass::compute(
        "lpv.slices",
        "gi/lpv/slices.comp",
        &[
            Binding::buffer("directions", Access::ComputeRead),
            Binding::image("sources", Access::ComputeRead),
            Binding::image("front", Access::ComputeReadWrite),
            Binding::image("slabs", Access::ComputeReadWrite),
            Binding::buffer("side_light", Access::ComputeRead),
            Binding::image("source_faces", Access::ComputeRead),
        ],
        SlicesParams::LAYOUT,
    )
};

/// Threads of a workgroup.
const GROUP: u32 = 64;
/// Axes of eight octants.
const GROUPS: u32 = 24;

/// The axis along which a direction is steepest; of equal ones the first.
pub fn dominant_axis(direction: DVec3) -> usize {
    let steepness = direction.abs();
    let steepest = steepness.max_element();
    (0..3)
        .find(|axis| steepness[*axis] == steepest)
        .unwrap_or(0)
}

/// Slices of grids of one size.
pub struct Slices {
    size: UVec3,
    directions: Directions,
    list: Arc<Buffer>,
    /// Pairs of directions that a group has at most.
    most_pairs: u32,
    sources: Sources,
    front: Arc<Image>,
    /// One for each group that is marched at once.
    slabs: Arc<Image>,
    groups_at_once: u32,
}

/// As `lpv.slices` reads directions: first pair, number of pairs, axis and octant of each group,
/// then all pairs; and how many a group has at most. An odd group's last direction has a partner
/// without weight.
fn words(directions: &Directions, inflow: Inflow<'_>) -> (Vec<u32>, u32) {
    let (mut groups, mut pairs, mut most) = (Vec::new(), Vec::new(), 1);
    for (octant, [first, count]) in (0u32..).zip(directions.octants) {
        let octants = &directions.all[first as usize..][..count as usize];
        for axis in 0..3 {
            let is_own = |(direction, _): &&(DVec3, f64)| dominant_axis(*direction) == axis;
            let mut own: Vec<_> = octants.iter().filter(is_own).copied().collect();
            if let (1, Some(&(direction, _))) = (own.len() % 2, own.last()) {
                own.push((direction, 0.0));
            }
            let count = own.len() as u32 / 2;
            most = most.max(count);
            groups.extend([pairs.len() as u32 / (2 * ROW), count, axis as u32, octant]);
            pairs.extend(own.into_iter().flat_map(|own| row(own, inflow)));
        }
    }
    groups.append(&mut pairs);
    (groups, most)
}

impl Slices {
    /// Takes what comes in from another environment, or at another scale.
    pub fn set_inflow(&self, gpu: &Gpu, inflow: Inflow<'_>) -> Result<(), Error> {
        let (words, _) = words(&self.directions, inflow);
        gpu.upload_buffer(&self.list, bytemuck::cast_slice(&words))
    }

    /// Allocates slices of grids of this size, for this many directions.
    pub fn new(gpu: &Gpu, size: UVec3, directions: u32, inflow: Inflow<'_>) -> Result<Self, Error> {
        let directions = Directions::spiral(directions);
        let (words, most_pairs) = words(&directions, inflow);
        let [x, y, z] = size.to_array();
        let edge = size.max_element();
        let slab_bytes = u64::from(x * y * z * COEFFICIENT_PAIRS) * PAIR_BYTES;
        let layers = 2 * most_pairs;
        let front_bytes = u64::from(edge * edge * layers) * PAIR_BYTES;
        let fits = |groups: &u32| {
            let count = u64::from(*groups);
            count * slab_bytes <= most_slab_bytes(gpu)
                && count * front_bytes <= MOST_FRONT_BYTES
                && groups * z.max(layers) <= MOST_TEXELS
        };
        let groups_at_once = [24, 12, 8, 6, 4, 3, 2].into_iter().find(fits).unwrap_or(1);
        let pairs = vk::Format::R32G32B32A32_UINT;
        let stored = |name, extent| volume(gpu, (name, pairs), extent, ImageUsage::STORAGE);
        Ok(Slices {
            size,
            directions,
            list: storage(
                gpu,
                ("lpv.directions", Owner::Store),
                bytemuck::cast_slice(&words),
            )?,
            most_pairs,
            sources: Sources::new(gpu, size)?,
            front: stored("lpv.front", [edge, edge, groups_at_once * layers])?,
            slabs: stored("lpv.slabs", [COEFFICIENT_PAIRS * x, y, groups_at_once * z])?,
            groups_at_once,
        })
    }

    /// Adds the passes that bring the flux of all cells (integers of `flux_unit`, W), and the light
    /// of the sides of all opaque faces, to all cells.
    pub fn run(&self, frame: &mut Frame, faces: &Faces, flux: (&Arc<Buffer>, f32), light: &Light) {
        find_sources(frame, faces, flux, &self.sources);
        let side_light = faces.sides.as_ref().map(|sides| &sides.light);
        let grid = faces.grid;
        let [x, y, z] = self.size.to_array();
        let cells = (x * y).max(y * z).max(z * x);
        for first_group in (0..GROUPS).step_by(self.groups_at_once as usize) {
            let slice = |slice| BatchDispatch {
                push: bytemuck::bytes_of(&SlicesParams {
                    grid: grid.row(self.most_pairs),
                    slice,
                    first_group,
                })
                .to_vec(),
                groups: [cells.div_ceil(GROUP), self.groups_at_once, 1],
                ..Default::default()
            };
            frame
                .pass(&SLICES)
                .bind("directions", &self.list)
                .bind("sources", &self.sources.vectors)
                .bind("source_faces", &self.sources.faces)
                .bind("front", &self.front)
                .bind("slabs", &self.slabs)
                .bind("side_light", side_light.unwrap_or(&self.list))
                .constant("ADD", first_group > 0)
                .constant("SIDES", side_light.is_some())
                .dispatch_chain((0..self.size.max_element()).map(slice).collect());
        }
        frame
            .pass(&SUM)
            .bind("slabs", &self.slabs)
            .bind("light", &light.low)
            .bind("light_band2", light.bound_band2())
            .push(&SumParams {
                grid: grid.row(self.groups_at_once),
            })
            .dispatch(groups(&grid));
    }
}
