//! Light from surfaces that emit, by rays to points of them: to what is seen, and to voxels.

use std::sync::Arc;

use glam::Vec3;

use crate::gpu_struct;
use crate::graph::{Access, Binding, Buffer, Error, Gpu, Owner};
use crate::image::luminance;
use crate::render::{Emitter, GpuScene, storage};

gpu_struct! {
    /// Part of the surface that emits. Parts are drawn by their power.
    pub struct GpuEmitterPart {
        /// xyz: a corner (m); w: share of all power that parts before it have.
        pub corner_before: [f32; 4],
        /// xyz: from there to the second corner (m); w: density of drawn points (1/m²).
        pub edge_density: [f32; 4],
        /// xyz: from there to the third corner (m).
        pub edge: [f32; 4],
        /// rgb: emitted radiance (W/(m² sr)).
        pub radiance: [f32; 4],
    }
}

/// What a pass over pixels binds before the space.
pub(super) const PIXEL: [Binding; 4] = [
    Binding::buffer("emitter_parts", Access::ComputeRead),
    Binding::sampled("view_depth", Access::ComputeSampled),
    Binding::sampled("normals", Access::ComputeSampled),
    Binding::image("indirect_diffuse", Access::ComputeReadWrite),
];

/// What a pass over voxels binds before the space.
pub(super) const BOUNCE: [Binding; 3] = [
    Binding::buffer("emitter_parts", Access::ComputeRead),
    Binding::buffer("gathering_voxels", Access::ComputeRead),
    Binding::buffer("voxel_irradiance", Access::ComputeReadWrite),
];

/// Turns of the search for a part, at most.
const SEARCH_TURNS: u32 = 32;

/// Turns of loops by which a ray finds the point that it goes to.
pub(super) const TURNS: u32 = CANDIDATES * (1 + SEARCH_TURNS);

/// Points that are compared for each ray (`CANDIDATES` of the shader).
pub const CANDIDATES: u32 = 4;

/// The surfaces that emit, on the device, for rays that go to points of them.
pub struct EmitterPoints {
    pub(super) parts: Arc<Buffer>,
    pub(super) count: u32,
}

impl EmitterPoints {
    /// Of the scene as it is, in which something emits.
    pub fn new(gpu: &Gpu, scene: &GpuScene) -> Result<Self, Error> {
        let rows = emitter_rows(&scene.emitters);
        Ok(EmitterPoints {
            parts: storage(
                gpu,
                ("voxel.emitter_parts", Owner::Store),
                bytemuck::cast_slice(&rows),
            )?,
            count: rows.len() as u32,
        })
    }

    /// Brings them up to where the scene's models are.
    pub fn follow(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<(), Error> {
        if scene.dynamic.is_some() {
            *self = EmitterPoints::new(gpu, scene)?;
        }
        Ok(())
    }
}

/// The parts, neighbours beside neighbours, so that numbers that are spread evenly draw parts that
/// are spread evenly over the surface.
pub fn emitter_rows(emitters: &[Emitter]) -> Vec<GpuEmitterPart> {
    let mut parts: Vec<&Emitter> = emitters.iter().collect();
    let (low, high) = bounds(emitters);
    let size = (high - low).max_element().max(f32::MIN_POSITIVE);
    parts.sort_by_cached_key(|part| morton((part.position - low) / size));
    let power = |part: &&Emitter| f64::from(part.intensity());
    let total: f64 = parts.iter().map(power).sum();
    let mut before = 0.0;
    let row = |part: &&Emitter| {
        let [a, b, c] = part.corners;
        let density = f64::from(luminance(part.radiance)) / total;
        let row = GpuEmitterPart {
            corner_before: a.extend((before / total) as f32).to_array(),
            edge_density: (b - a).extend(density as f32).to_array(),
            edge: (c - a).extend(0.0).to_array(),
            radiance: part.radiance.extend(0.0).to_array(),
        };
        before += power(part);
        row
    };
    parts.iter().map(row).collect()
}

fn bounds(emitters: &[Emitter]) -> (Vec3, Vec3) {
    let positions = || emitters.iter().map(|emitter| emitter.position);
    let low = positions().reduce(Vec3::min).unwrap_or(Vec3::ZERO);
    let high = positions().reduce(Vec3::max).unwrap_or(Vec3::ZERO);
    (low, high)
}

/// Place of a point of the unit cube along Morton's curve.
fn morton(at: Vec3) -> u64 {
    const BITS: u32 = 16;
    let cell = (at * (1 << BITS) as f32).as_uvec3().to_array();
    (0..BITS).fold(0, |code, bit| {
        let digit = (0..3).fold(0, |digit, axis| {
            digit | u64::from(cell[axis] >> bit & 1) << axis
        });
        code | digit << (3 * bit)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::emitters::emitters;
    use crate::scene::Scene;

    /// The shares of the parts are their areas times their densities, and together 1.
    #[test]
    fn rows_hold_all_light() {
        for name in ["cornell-lamp", "emissive-gallery"] {
            let parts = emitters(&Scene::bundled(name, &[]).unwrap_or_default());
            let rows = emitter_rows(&parts);
            let ends = rows
                .iter()
                .skip(1)
                .map(|row| row.corner_before[3])
                .chain([1.0]);
            let vec = |v: [f32; 4]| Vec3::new(v[0], v[1], v[2]);
            for (row, end) in rows.iter().zip(ends) {
                let across = vec(row.edge_density).cross(vec(row.edge));
                let expected = 0.5 * across.length() * row.edge_density[3];
                let share = end - row.corner_before[3];
                assert!(
                    (share - expected).abs() < 1e-6,
                    "{name}: {share}, {expected}"
                );
            }
        }
    }

    #[test]
    fn neighbours_are_near_each_other() {
        assert_eq!(morton(Vec3::ZERO), 0);
        assert!(morton(Vec3::splat(0.2)) < morton(Vec3::splat(0.9)));
        let parts = emitters(&Scene::bundled("emissive-gallery", &[]).unwrap_or_default());
        let rows = emitter_rows(&parts);
        let corner = |row: &GpuEmitterPart| Vec3::from_slice(&row.corner_before);
        let steps = |rows: &mut dyn Iterator<Item = Vec3>| {
            let all: Vec<Vec3> = rows.collect();
            all.windows(2)
                .map(|pair| pair[0].distance(pair[1]))
                .sum::<f32>()
        };
        let along = steps(&mut rows.iter().map(corner));
        let before = steps(&mut parts.iter().map(|part| part.corners[0]));
        assert!(
            along < 0.2 * before,
            "{along} m along the rows, {before} m before"
        );
    }
}
