//! A technique's voxels and their light on the host, read and replaced: for error budgets.

use std::collections::HashMap;

use glam::Vec3;

use crate::gi::inspect::{LightSlots, SlotLight, SlotShare, SlotShares};
use crate::gi::shared::voxel::build::list::{across, area, front, index};
use crate::gi::shared::voxel::build::passes::Voxel;
use crate::gi::shared::voxel::{Sides, VoxelLight, VoxelRecords};
use crate::graph::{Error, Gpu};
use crate::render::float_from_half;

/// The voxels of a technique, or of a piece of its grid, and their light.
pub struct LitVoxels<'t> {
    /// The records of the voxels that are lit.
    pub voxels: VoxelRecords,
    /// Where the light of these voxels is kept.
    pub light: &'t mut VoxelLight,
}

/// The voxels of all pieces, where they are and which way their surfaces face. A slot is a side of
/// a voxel (or a voxel, where it has one radiance; or one of its faces +x, −x, +y, −y, +z, −z), in
/// order.
pub struct VoxelSlots<'t> {
    pieces: Vec<LitVoxels<'t>>,
    origin: Vec3,
    voxel_size: f32,
    sides: usize,
    voxels: HashMap<[i32; 3], usize>,
    fronts: Vec<Vec3>,
    /// Of each slot: the area that its radiance is a mean over (voxel faces).
    areas: Vec<f32>,
}

impl<'t> VoxelSlots<'t> {
    /// Reads where they are; `None` without pieces.
    pub fn read(gpu: &Gpu, pieces: Vec<LitVoxels<'t>>) -> Result<Option<Self>, Error> {
        let Some(first) = pieces.first() else {
            return Ok(None);
        };
        let (grid, sides) = (first.voxels.grid, first.light.settings.sides as usize);
        let (mut places, mut fronts, mut areas) =
            (HashMap::new(), Vec::<Vec3>::new(), Vec::<f32>::new());
        for LitVoxels { voxels, .. } in &pieces {
            let corner = ((voxels.grid.origin - grid.origin) / grid.voxel_size)
                .round()
                .as_ivec3()
                .to_array();
            let bytes = gpu.read_buffer(&voxels.records)?;
            for record in bytes
                .chunks_exact(size_of::<Voxel>())
                .take(voxels.voxel_count as usize)
                .map(bytemuck::pod_read_unaligned)
            {
                let within = index(&record);
                // A voxel may have two records. The later one includes dynamic geometry, and its
                // index is the one that counts.
                places.insert(
                    [0, 1, 2].map(|axis| corner[axis] + within[axis] as i32),
                    fronts.len(),
                );
                fronts.push(front(&record));
                match sides == Sides::Six as usize {
                    true => areas.extend(across(&record).to_array().iter().flat_map(|it| [*it; 2])),
                    false => areas.extend((0..sides).map(|_| area(&record))),
                }
            }
        }
        Ok(Some(VoxelSlots {
            pieces,
            origin: grid.origin,
            voxel_size: grid.voxel_size,
            sides,
            voxels: places,
            fronts,
            areas,
        }))
    }
}

impl VoxelSlots<'_> {
    /// The slots of the side of a voxel that a unit normal points to (`radiance_towards` in
    /// `glsl/gi/shared/voxel/trace/radiance.glsl`), or of its other side.
    fn shares(&self, voxel: usize, normal: Vec3, is_other: bool) -> SlotShares {
        let first = self.sides * voxel;
        if self.sides == Sides::Six as usize {
            let normal = if is_other { -normal } else { normal };
            return std::array::from_fn(|axis| SlotShare {
                slot: first + 2 * axis + usize::from(normal[axis] < 0.0),
                seen: normal[axis] * normal[axis],
                area: normal[axis].abs(),
            });
        }
        let is_back = (self.fronts[voxel].dot(normal) < 0.0) != is_other;
        let slot = first + usize::from(is_back && self.sides == Sides::Two as usize);
        let whole = SlotShare {
            slot,
            seen: 1.0,
            area: 1.0,
        };
        let nothing = SlotShare {
            slot,
            ..SlotShare::default()
        };
        [whole, nothing, nothing]
    }
}

impl LightSlots for VoxelSlots<'_> {
    fn count(&self) -> usize {
        self.sides * self.fronts.len()
    }

    fn spacing(&self) -> f32 {
        self.voxel_size
    }

    fn area_m2(&self, slot: usize) -> f32 {
        self.areas[slot] * self.voxel_size * self.voxel_size
    }

    /// The voxel is the position's own, or where rounding (or thin voxelization) has left that
    /// empty, the nearest of its neighbours.
    fn at(&self, position: Vec3, normal: Vec3) -> Option<[SlotShares; 2]> {
        let position = (position - self.origin) / self.voxel_size;
        let cell = position.floor().as_ivec3().to_array();
        let voxel = self.voxels.get(&cell).copied().or_else(|| {
            let neighbours = (0..27).map(|at| {
                [
                    cell[0] + at % 3 - 1,
                    cell[1] + at / 3 % 3 - 1,
                    cell[2] + at / 9 - 1,
                ]
            });
            let distance = |cell: &[i32; 3]| {
                Vec3::from(cell.map(|i| i as f32 + 0.5)).distance_squared(position)
            };
            let nearest = neighbours
                .filter(|cell| self.voxels.contains_key(cell))
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
            self.voxels.get(&nearest).copied()
        })?;
        Some([false, true].map(|is_other| self.shares(voxel, normal, is_other)))
    }

    fn radiance(&self, gpu: &Gpu) -> Result<Vec<Vec3>, Error> {
        let mut radiance = Vec::with_capacity(self.count());
        for LitVoxels { voxels, light } in &self.pieces {
            let halves: Vec<[u16; 4]> =
                bytemuck::pod_collect_to_vec(&gpu.read_buffer(&light.radiance)?);
            let slots = halves.iter().take(self.sides * voxels.voxel_count as usize);
            radiance
                .extend(slots.map(|[r, g, b, _]| Vec3::from([*r, *g, *b].map(float_from_half))));
        }
        Ok(radiance)
    }

    fn set_direct(&mut self, gpu: &Gpu, light: &[SlotLight]) -> Result<(), Error> {
        let sides = self.sides;
        let flux_of = |(light, area): (&SlotLight, &f32)| {
            let [front, back] = light.areas;
            // What the slot's own area counts: the surface once, both of its sides, or what is
            // seen of them from one side.
            let counted = match sides {
                1 => front,
                2 => front + back,
                _ => front.max(back),
            };
            (counted > 0.0).then(|| *area / counted * light.radiance)
        };
        let flux: Vec<Option<Vec3>> = light.iter().zip(&self.areas).map(flux_of).collect();
        let mut first = 0;
        for LitVoxels { voxels, light } in &mut self.pieces {
            let end = first + self.sides * voxels.voxel_count as usize;
            light.give_flux(gpu, &flux[first..end])?;
            first = end;
        }
        Ok(())
    }
}
