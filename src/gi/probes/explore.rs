//! Which sides of surfaces are seen: where probes are needed.

use glam::{DVec2, Vec3};

use super::oracle;
use super::passes::{EXPLORE, ExploreParams};
use super::snap::Seen;
use crate::graph::compute::linear_groups;
use crate::graph::{BufferDesc, BufferUsage, Error, Frame, FrameStats, Gpu, Owner};
use crate::render::GpuScene;
use crate::render::bvh::SceneRays;

/// Number of paths, and places of each.
const PATHS: [u32; 2] = [1 << 16, 4];

/// Places on surfaces that light paths from the eye of the scene's own camera come to, and what
/// finding them cost. The camera of a frame decides nothing.
pub fn explore(
    gpu: &Gpu,
    scene: &GpuScene,
    triangles: &SceneRays,
) -> Result<(Vec<Seen>, FrameStats), Error> {
    let [path_count, place_count] = PATHS;
    let places = gpu.create_buffer(&BufferDesc {
        name: "probes.seen_places".into(),
        size_bytes: 16 * u64::from(path_count * place_count),
        usage: BufferUsage::Storage,
        owner: Owner::Store,
    })?;
    let mut frame = Frame::new();
    frame.set_scene(&scene.set, &scene.materials);
    triangles
        .bind(frame.pass(&EXPLORE))
        .bind("seen_places", &places)
        .push(&ExploreParams {
            eye: scene.eye.extend(0.0).to_array(),
            path_count,
            place_count,
        })
        .dispatch(linear_groups(path_count));
    let (stats, rows) = gpu.submit_and_read(frame, &places)?;
    let rows: Vec<[u32; 4]> = bytemuck::pod_collect_to_vec(&rows);
    let seen = |[x, y, z, normal]: [u32; 4]| {
        let place = Vec3::from([x, y, z].map(f32::from_bits));
        place.is_finite().then(|| (place, unpack_unit(normal)))
    };
    Ok((rows.into_iter().filter_map(seen).collect(), stats))
}

/// A unit vector of 2×16 bits (`shared/packing.glsl`).
fn unpack_unit(packed: u32) -> Vec3 {
    let part = |bits: u32| (f32::from(bits as u16 as i16) / 32767.0).max(-1.0);
    let p = DVec2::new(part(packed).into(), part(packed >> 16).into());
    oracle::direction(p).as_vec3()
}
