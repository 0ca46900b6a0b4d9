//! Probes around which the scene is drawn: each ray ends where the oracle says.

use glam::{DVec2, DVec3, Vec3};
use lumivox::gi::probes::oracle::{ray_set, turn_of};
use lumivox::gi::probes::raster::{MovedPast, RasterSource};
use lumivox::graph::Frame;
use lumivox::render::bvh::oracle::RayOracle;
use lumivox::scene::Scene;

use super::probes::{scenes, texels, traced};
use super::probes_time::{check_traced_again, inside_box};
use super::probes_voxels::{light, off};
use crate::support::gpu;
use crate::support::loading::corners;
use crate::support::scenes::bundled;

/// Right, up and forward of a face.
fn to_face(face: usize, way: DVec3) -> DVec3 {
    let DVec3 { x, y, z } = way;
    let turned = [DVec3::new(y, z, x), DVec3::new(z, x, y), way][face / 2];
    let sign = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
    turned * DVec3::new(1.0, 1.0, sign)
}

fn from_face(face: usize, local: DVec3) -> DVec3 {
    let sign = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
    let DVec3 { x, y, z } = local * DVec3::new(1.0, 1.0, sign);
    [
        DVec3::new(z, x, y),
        DVec3::new(y, z, x),
        DVec3::new(x, y, z),
    ][face / 2]
}

/// How far a ray from `place` goes to where it meets a triangle's plane, or comes nearest to the
/// triangle there; and whether it meets the triangle itself.
fn reach(scene: &Scene, triangle: u32, place: Vec3, direction: DVec3) -> (f64, bool) {
    let [a, b, c] = corners(scene, triangle as usize).map(|corner| corner.as_dvec3());
    let (first, second, from) = (b - a, c - a, place.as_dvec3() - a);
    let normal = first.cross(second);
    let t = -from.dot(normal) / direction.dot(normal);
    let at = from + t * direction;
    let share = |edge: DVec3, other: DVec3| {
        let across = other.cross(normal);
        at.dot(across) / edge.dot(across)
    };
    let on = DVec2::new(share(first, second), share(second, first));
    let meets = t > 0.0 && on.min_element() >= 0.0 && on.element_sum() <= 1.0;
    let on = if t > 0.0 { on } else { DVec2::splat(1.0 / 3.0) };
    let on = on.max(DVec2::ZERO);
    let on = on / on.element_sum().max(1.0);
    ((on.x * first + on.y * second - from).length(), meets)
}

/// The middle of the texel of a view of `edge` texels that shows a direction; none where rounding
/// decides between two.
fn middle_of(direction: DVec3, edge: u32) -> Option<DVec3> {
    let size = direction.abs().to_array();
    let larger = |most: usize, axis: usize| if size[axis] > size[most] { axis } else { most };
    let axis = (0..3).fold(0, larger);
    let face = 2 * axis + usize::from(direction[axis] < 0.0);
    let local = to_face(face, direction);
    let at = (local.truncate() / local.z * 0.5 + 0.5) * f64::from(edge);
    if (at - at.round()).abs().min_element() < 1e-3 {
        return None;
    }
    let middle = (at.floor() + 0.5) * (2.0 / f64::from(edge)) - 1.0;
    Some(from_face(face, middle.extend(1.0)).normalize())
}

#[test]
fn rays_end_on_the_triangles_that_are_drawn() {
    let gpu = gpu();
    for scene in scenes() {
        for edge in [16_u32, 64] {
            let of = traced(&gpu, &scene, [3, 256], [8, 8]);
            let source = RasterSource::new(&gpu, edge).unwrap();
            let mut frame = Frame::new();
            frame.set_scene(&of.on_gpu.set, &of.on_gpu.materials);
            let probes = (&of.volume, of.volume.listed());
            source.trace(&mut frame, &of.on_gpu, &of.rays, probes, (true, None));
            gpu.submit(frame).unwrap();
            let found: Vec<[u32; 4]> = texels(&gpu, &of.rays.hits);
            let (oracle, set) = (RayOracle::new(&scene), ray_set(of.rays.count));
            let (mut all, mut off, mut beside) = (0, 0, 0);
            for (probe, place) in (0..).zip(of.volume.lattice.places()) {
                for (ray, direction) in (0..).zip(&set) {
                    let direction = turn_of(probe) * *direction;
                    let Some(towards) = middle_of(direction, edge) else {
                        continue;
                    };
                    let expected = oracle.closest((place, towards.as_vec3(), None));
                    let hit = found[(probe * of.rays.count + ray) as usize];
                    all += 1;
                    let is_same = match expected {
                        None => hit[0] == u32::MAX,
                        Some(expected) if expected.triangle == hit[0] => {
                            let (reach, meets) = reach(&scene, hit[0], place, direction);
                            beside += u32::from(!meets);
                            let distance = -f64::from(f32::from_bits(hit[3]));
                            (distance - reach).abs() < 2e-3 * reach
                        }
                        Some(_) => false,
                    };
                    off += u32::from(!is_same);
                }
            }
            println!("{} {edge}: {off} of {all}, {beside} beside", scene.name);
            // A texel whose middle is on an edge shows one triangle or the other.
            assert!(
                off * 50 <= all && all > 1000,
                "{}: {off} of {all}",
                scene.name
            );
        }
    }
}

/// Rays are asked again whose texel shows a box or what is behind it, and those of a probe that has
/// moved; no others.
#[test]
fn rays_keep_their_views_where_nothing_moved() {
    const EDGE: u32 = 16;
    let gpu = gpu();
    let scene = bundled("cornell");
    let of = traced(&gpu, &scene, [4, 64], [8, 8]);
    let source = RasterSource::new(&gpu, EDGE).unwrap();
    let trace = |moved: Option<&MovedPast<'_>>| {
        let mut frame = Frame::new();
        frame.set_scene(&of.on_gpu.set, &of.on_gpu.materials);
        let probes = (&of.volume, of.volume.listed());
        source.trace(&mut frame, &of.on_gpu, &of.rays, probes, (true, moved));
        gpu.submit(frame).unwrap();
        let hits: Vec<[u32; 4]> = texels(&gpu, &of.rays.hits);
        hits
    };
    let hits = trace(None);
    let moments = gpu.read_image(&of.volume.moments, 0, 0).unwrap();
    let marked: Vec<[u32; 4]> = hits
        .iter()
        .map(|[x, y, z, w]| [*x, *y, *z, w ^ 1])
        .collect();
    gpu.upload_image(&of.rays.hits, 0, 0, bytemuck::cast_slice(&marked))
        .unwrap();
    let places: Vec<Vec3> = of.volume.lattice.places().collect();
    let mut before = places.clone();
    before[5] += 0.1;
    of.volume.put(&gpu, &places, &before).unwrap();
    let bounds = (Vec3::new(0.3, 1.0, 0.0), Vec3::new(0.6, 1.4, 0.3));
    let again = trace(Some(&MovedPast {
        bounds,
        places: [&places, &before],
    }));
    let corners = [bounds.0, bounds.1].map(Vec3::as_dvec3);
    let set = ray_set(of.rays.count);
    let all = of.volume.lattice.probe_count() * of.rays.count;
    let all = ..all as usize;
    check_traced_again(([&hits[all], &again[all]], of.rays.count), |probe, ray| {
        let middle = middle_of(turn_of(probe) * set[ray as usize], EDGE)?;
        let place = places[probe as usize].as_dvec3();
        Some(inside_box(place, middle, f64::INFINITY, corners))
    });
    assert!(moments == gpu.read_image(&of.volume.moments, 0, 0).unwrap());
}

/// More texels bring it nearer to the light of rays through triangles.
#[test]
fn light_is_that_of_rays_through_triangles_about() {
    let gpu = gpu();
    let scene = bundled("cornell");
    for more in [
        &[][..],
        &["bounces=3"],
        &["moment_filter=power"],
        &["trace=each-frame"],
    ] {
        let of = |source: &str| light(&gpu, &scene, &[&[source], more].concat());
        let expected = of("source=triangles");
        let differences = ["raster_texels=8", "raster_texels=64"].map(|texels| {
            let found = light(&gpu, &scene, &[&["source=raster", texels], more].concat());
            off(&found, &expected)
        });
        println!("{more:?}: {differences:.4?}");
        let [few, many] = differences;
        assert!(many < 0.02 && many < 0.6 * few, "{more:?}: {differences:?}");
    }
    let furnace = bundled("furnace");
    let [found, expected] =
        ["source=raster", "source=triangles"].map(|source| light(&gpu, &furnace, &[source]));
    assert!(off(&found, &expected) < 2e-3);
}
