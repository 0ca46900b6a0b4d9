//! Which probes some surface looks up.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::Vec3;

use super::layout::Window;
use super::passes::{NEED, NeedParams};
use super::pool::Key;
use crate::gi::probes::Lattice;
use crate::gi::probes::volume::buffer;
use crate::graph::compute::linear_groups;
use crate::graph::{Buffer, Error, Frame, FrameStats, Gpu};
use crate::render::GpuScene;

/// The probes of these levels, finest first, that surfaces look up which are moved by `bias`
/// (spacings) before; and what finding them cost.
pub fn needed(
    gpu: &Gpu,
    scene: &GpuScene,
    windows: &[Window],
    bias: f32,
) -> Result<(BTreeSet<Key>, FrameStats), Error> {
    let counts = windows.iter().map(|window| window.lattice.probe_count());
    let words = counts.sum::<u32>().div_ceil(32);
    let bits: Arc<Buffer> = buffer(gpu, "cascades.needed", 4 * u64::from(words))?;
    let mut frame = Frame::new();
    frame.fill("cascades.need", &bits, 0);
    frame.set_scene(&scene.set, &scene.materials);
    let last = scene.batches.last();
    let triangle_count = last.map_or(0, |batch| batch.first_triangle + batch.triangle_count);
    let mut first_bit = 0;
    for Window { lattice, .. } in windows {
        frame
            .pass(&NEED)
            .bind("needed_probes", &bits)
            .push(&NeedParams {
                first: lattice.first.extend(lattice.spacing.x).to_array(),
                counts: lattice.counts.extend(0).to_array(),
                triangle_count,
                first_bit,
                reach: reach(bias),
            })
            .dispatch(linear_groups(triangle_count));
        first_bit += lattice.probe_count();
    }
    let (stats, bits) = gpu.submit_and_read(frame, &bits)?;
    let bits: Vec<u32> = bytemuck::pod_collect_to_vec(&bits);
    let mut needed = BTreeSet::new();
    let mut bit = 0;
    for (level, window) in (0..).zip(windows) {
        for probe in 0..window.lattice.probe_count() {
            if bits[bit as usize / 32] >> (bit % 32) & 1 != 0 {
                needed.insert(Key::new(level, windows.len() as u32, window.at(probe)));
            }
            bit += 1;
        }
    }
    Ok((needed, stats))
}

/// How far from a probe places look it up (spacings).
fn reach(bias: f32) -> f32 {
    1.0 + bias
}

/// Whether some place of a triangle may look a probe of a lattice up: the twin on the CPU. The box
/// around the probe meets that of the triangle, and its plane.
pub fn looks_up(lattice: &Lattice, probe: u32, corners: [Vec3; 3], bias: f32) -> bool {
    let spacing = lattice.spacing.x;
    let [a, b, c] = corners.map(|corner| (corner - lattice.place(probe)) / spacing);
    let reach = reach(bias);
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let normal = (b - a).cross(c - a);
    low.cmple(Vec3::splat(reach)).all()
        && high.cmpge(Vec3::splat(-reach)).all()
        && normal.dot(a).abs() <= reach * normal.abs().element_sum()
}
