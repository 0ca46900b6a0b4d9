//! Probes whose rays meet voxels: each ray ends where the oracle says, and brings that light.

use glam::{DVec3, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::probes::irradiance::ENTRY;
use lumivox::gi::probes::oracle::{ray_set, turn_of};
use lumivox::gi::probes::voxels::VoxelSource;
use lumivox::gi::shared::voxel::oracle::{Crossing, Receiver, TraceGrid, TraceSettings, crossings};
use lumivox::graph::{Frame, Gpu};
use lumivox::image::{Aov, Image};
use lumivox::scene::Scene;

use super::probes::{texels, traced};
use super::probes_time::{check_traced_again, inside_box};
use crate::support::scenes::{Corners, add_model, bundled, lump, scene_of, still};
use crate::support::technique::{Surfaces, frame, largest_difference, small_lights, small_room};
use crate::support::voxels::{coordinates, read, trace_voxel};
use crate::support::{Random, gpu};

/// Nothing is the probe itself.
const NOBODY: Receiver = Receiver {
    position: DVec3::ZERO,
    geometric_normal: DVec3::ZERO,
    shading_normal: DVec3::ZERO,
};

#[test]
fn rays_end_in_the_oracles_voxels() {
    const RESOLUTION: u32 = 16;
    let gpu = gpu();
    let lights = small_lights().map(|(_, light)| light).to_vec();
    for scene in [bundled("cornell"), small_room(Surfaces::Glossy, lights)] {
        let of = traced(&gpu, &scene, [3, 64], [8, 8]);
        let mut source = VoxelSource::new(&gpu, &of.on_gpu, RESOLUTION, false).unwrap();
        source.build(&gpu, &of.on_gpu).unwrap();
        let mut frame = Frame::new();
        frame.set_scene(&of.on_gpu.set, &of.on_gpu.materials);
        let probes = of.volume.listed();
        source.trace(&mut frame, &of.rays, &of.volume, probes, (true, None));
        gpu.submit(frame).unwrap();
        let found: Vec<[u32; 4]> = texels(&gpu, &of.rays.hits);
        let read = read(&gpu, source.voxels().unwrap().clone());
        let voxels = read.records.iter();
        let grid = TraceGrid {
            resolution: RESOLUTION,
            voxels: voxels
                .map(|voxel| (coordinates(voxel), trace_voxel(voxel, [DVec3::ZERO; 2])))
                .collect(),
        };
        let [row, edge] = [
            read.voxels.grid.origin,
            Vec3::splat(read.voxels.grid.voxel_size),
        ];
        let set = ray_set(of.rays.count);
        let (mut all, mut off, mut hits, mut unclear) = (0, 0, 0, 0);
        for (probe, place) in (0..).zip(of.volume.lattice.places()) {
            let origin = ((place - row) / edge).as_dvec3();
            // On a face of voxels rounding decides in which one it is.
            if (origin - origin.round()).abs().min_element() < 1e-3 {
                continue;
            }
            for (ray, direction) in (0..).zip(&set) {
                let direction = turn_of(probe) * *direction;
                let settings = TraceSettings {
                    self_height: -1.0,
                    contour_slack: 0.0,
                    seed: probe,
                    ray,
                };
                let hit = found[(probe * of.rays.count + ray) as usize];
                let slot = (hit[0] != u32::MAX).then_some(hit[0] & 0x3fff_ffff);
                let seen = slot.map(|slot| coordinates(&read.records[slot as usize]));
                let ways = crossings(&grid, origin, direction, &NOBODY, &settings);
                let end = ways.iter().position(|way| way.margin >= 0.0);
                let until = end.map_or(ways.len(), |end| end + 1);
                // Where a ray grazes a voxel, or nearly passes by its surface, rounding decides.
                let is_clear =
                    |way: &Crossing| way.margin.abs() > 2e-3 && way.exit - way.entry > 1e-3;
                if !ways[..until].iter().all(is_clear) {
                    unclear += 1;
                    continue;
                }
                let is_same = match end.map(|end| ways[end]) {
                    None => seen.is_none(),
                    Some(way) => {
                        let reach = f64::from(f32::from_bits(hit[3])) / f64::from(edge.x);
                        let within = way.entry - 1e-3..way.entry + 2.0 + 1e-3;
                        hits += 1;
                        seen == Some(way.voxel) && within.contains(&reach)
                    }
                };
                all += 1;
                off += u32::from(!is_same);
            }
        }
        println!(
            "{}: {off} of {all} rays, {hits} hit, {unclear} unclear",
            scene.name
        );
        let is_most = hits > all / 2 && unclear * 10 < all;
        assert!(
            is_most && off * 1000 <= all,
            "{}: {off} of {all}",
            scene.name
        );
    }
}

/// Rays trace again that come through a box, a block of voxels and one voxel more on each side;
/// those of a probe that has moved do, and no others.
#[test]
fn rays_keep_their_voxels_where_nothing_moved() {
    let gpu = gpu();
    let scene = with_lamp(bundled("cornell"), [[0.5, 1.2, 0.2], [-0.5, 0.9, 0.4]]);
    let of = traced(&gpu, &scene, [4, 64], [8, 8]);
    let mut source = VoxelSource::new(&gpu, &of.on_gpu, 64, false).unwrap();
    source.build(&gpu, &of.on_gpu).unwrap();
    let trace = |moved: Option<(Vec3, Vec3)>| {
        let mut frame = Frame::new();
        frame.set_scene(&of.on_gpu.set, &of.on_gpu.materials);
        let probes = of.volume.listed();
        source.trace(&mut frame, &of.rays, &of.volume, probes, (true, moved));
        gpu.submit(frame).unwrap();
        let hits: Vec<[u32; 4]> = texels(&gpu, &of.rays.hits);
        hits
    };
    let hits = trace(None);
    let moments = gpu.read_image(&of.volume.moments, 0, 0).unwrap();
    let marked: Vec<[u32; 4]> = hits
        .iter()
        .map(|[x, y, z, w]| [*x, y ^ 1, *z, *w])
        .collect();
    gpu.upload_image(&of.rays.hits, 0, 0, bytemuck::cast_slice(&marked))
        .unwrap();
    let places: Vec<Vec3> = of.volume.lattice.places().collect();
    let mut before = places.clone();
    before[5] += 0.1;
    of.volume.put(&gpu, &places, &before).unwrap();
    let moved = (Vec3::new(0.3, 1.0, 0.0), Vec3::new(0.5, 1.3, 0.2));
    let again = trace(Some(moved));
    let margin = 5.0 * source.voxels().unwrap().grid.voxel_size;
    let corners = [moved.0 - margin, moved.1 + margin].map(Vec3::as_dvec3);
    let set = ray_set(of.rays.count);
    let all = of.volume.lattice.probe_count() * of.rays.count;
    let all = ..all as usize;
    check_traced_again(([&hits[all], &again[all]], of.rays.count), |probe, ray| {
        let index = (probe * of.rays.count + ray) as usize;
        let distance = f64::from(f32::from_bits(hits[index][3]));
        let direction = turn_of(probe) * set[ray as usize];
        let place = places[probe as usize].as_dvec3();
        Some(inside_box(place, direction, distance, corners))
    });
    assert!(moments == gpu.read_image(&of.volume.moments, 0, 0).unwrap());
}

pub(super) fn light(gpu: &Gpu, scene: &Scene, pairs: &[&str]) -> Image {
    let settings = ENTRY
        .settings(None, &[&["probes=8"], pairs].concat())
        .unwrap();
    let (mut renderer, _) =
        Renderer::new(gpu, scene, &ENTRY, &settings, frame(48, 36, 128)).unwrap();
    renderer.render(&scene.camera).unwrap();
    renderer.aov(Aov::Indirect).unwrap()
}

/// Root mean square difference over the mean of `b`.
pub(super) fn off(a: &Image, b: &Image) -> f64 {
    let pixels = || a.pixels.iter().zip(&b.pixels);
    let squares: f64 = pixels()
        .map(|(a, b)| f64::from((*a - *b).length_squared()))
        .sum();
    let all: f64 = pixels().map(|(_, b)| f64::from(b.length_squared())).sum();
    (squares / all).sqrt()
}

#[test]
fn light_is_that_of_triangles_about() {
    let gpu = gpu();
    let scene = bundled("cornell");
    for more in [
        &[][..],
        &["bounces=3"],
        &["irradiance=sh2"],
        &["hit_light=maps"],
    ] {
        let of = |source: &str| {
            let pairs = [&[source, "source_resolution=64"], more].concat();
            light(&gpu, &scene, &pairs)
        };
        let off = off(&of("source=voxels"), &of("source=triangles"));
        println!("{more:?}: {off}");
        assert!(off < 0.06, "{more:?}: {off}");
    }
    // What emits is in the light of voxels.
    let furnace = bundled("furnace");
    let found = light(&gpu, &furnace, &["source=voxels", "source_resolution=32"]);
    let expected = light(&gpu, &furnace, &[]);
    println!("furnace: {}", off(&found, &expected));
    // In edges of the room some rays see the backs of walls.
    assert!(off(&found, &expected) < 0.03);
}

/// A scene with a lamp that moves from one place (m) to the other in a second.
pub(super) fn with_lamp(mut scene: Scene, places: [[f32; 3]; 2]) -> Scene {
    let small: Vec<Corners> = (lump(8, 1).into_iter())
        .map(|corners| corners.map(|corner| 0.5 * (corner - 0.5)))
        .collect();
    let model = scene_of(&small, 4.0, &mut Random::new(1));
    add_model(&mut scene, model, &places.map(|place| still(place.into())));
    scene
}

/// As a renderer that was made when they stood there.
#[test]
fn sources_follow_models() {
    let gpu = gpu();
    let mut scene = with_lamp(bundled("cornell"), [[0.5, 1.2, 0.2], [-0.5, 0.9, 0.4]]);
    for source in ["source=voxels", "source=raster"] {
        let pairs = ["probes=6", source, "source_resolution=32"];
        let settings = ENTRY.settings(None, &pairs).unwrap();
        let renderer = |scene: &Scene| {
            let of = frame(32, 24, 64);
            Renderer::new(&gpu, scene, &ENTRY, &settings, of).unwrap().0
        };
        scene.set_time(0.0);
        let mut following = renderer(&scene);
        following.render(&scene.camera).unwrap();
        let before = following.aov(Aov::Indirect).unwrap();
        scene.set_time(1.0);
        following.set_pose(&scene).unwrap();
        following.render(&scene.camera).unwrap();
        let mut made = renderer(&scene);
        made.render(&scene.camera).unwrap();
        let [found, expected] = [&following, &made].map(|of| of.aov(Aov::Indirect).unwrap());
        assert!(largest_difference(&found, &before) > 0.1);
        let off = largest_difference(&found, &expected);
        println!("{source}: {off}");
        assert_eq!(off, 0.0, "{source}");
    }
}
