//! `voxel.gather_rays` on the device against the CPU oracle.

use crate::support::compare::Largest;
use std::f64::consts::PI;

use crate::support::gather::{View, errors};
use crate::support::scenes::bundled;
use crate::support::technique::{Surfaces, small_lights, small_room};
use crate::support::tolerance::device_class;
use crate::support::voxels::{
    Read, coordinates, ray_blocks, to_half, trace_settings, trace_voxel, voxel_settings, voxelize,
};
use crate::support::{Random, gpu};
use glam::{DVec3, DVec4, Vec3};
use lumivox::gi::Settings;
use lumivox::gi::registry::find;
use lumivox::gi::shared::interleave::Pattern;
use lumivox::gi::shared::interleave::oracle::interleaved_offset;
use lumivox::gi::shared::voxel::oracle::{
    Crossing, GatherSettings, Gathered, Receiver, TraceGrid, VoxelIndex, crossings,
    gather_rays as oracle_rays, gather_triangles as oracle_triangles, hemisphere_direction,
    seed_of,
};
use lumivox::gi::shared::voxel::{
    Injection, LightSettings, Method, RaySettings, RayTracer, Sides, VoxelLight,
};
use lumivox::gi::voxel_cones::mips::space;
use lumivox::graph::{Frame, Gpu};
use lumivox::render::GpuScene;
use lumivox::render::bvh::{START_SHARE, SceneRays};
use lumivox::scene::Scene;
use rayon::prelude::*;

const SIZE: [u32; 2] = [32, 24];

fn settings(pairs: &[String]) -> Settings {
    find("voxel-mips")
        .unwrap()
        .settings(Some("textbook"), pairs)
        .unwrap()
}

/// Voxels and a light of their own, so that what a ray hits can be told.
struct RayScene {
    scene: Scene,
    gpu_scene: GpuScene,
    read: Read,
    light: VoxelLight,
    view: View,
}

impl RayScene {
    fn new(
        gpu: &Gpu,
        mut scene: Scene,
        environment: Vec3,
        resolution: u32,
        sides: Sides,
    ) -> RayScene {
        scene.environment = environment.into();
        let gpu_scene = GpuScene::new(gpu, &scene).unwrap();
        let read = voxelize(gpu, &gpu_scene, voxel_settings(resolution, Method::Compute));
        let light = VoxelLight::new(
            gpu,
            &gpu_scene,
            &read.voxels,
            LightSettings::direct(Injection::Voxel, sides),
        )
        .unwrap();
        let view = View::new(gpu, &gpu_scene, &scene.camera, SIZE, &read.voxels.grid);
        RayScene {
            scene,
            gpu_scene,
            read,
            light,
            view,
        }
    }

    /// Gives each side of a voxel, or each voxel, a radiance and gathers.
    fn gather(
        &self,
        gpu: &Gpu,
        radiance: impl Fn(usize) -> [f64; 3],
        settings: &Settings,
    ) -> Vec<DVec4> {
        let halves: Vec<u16> = (0..self.light.settings.sides as usize * self.read.records.len())
            .flat_map(|slot| {
                let [r, g, b] = radiance(slot);
                [r, g, b, 1.0].map(to_half)
            })
            .collect();
        gpu.upload_buffer(&self.light.radiance, bytemuck::cast_slice(&halves))
            .unwrap();
        let mut frame = Frame::new();
        frame.set_scene(&self.gpu_scene.set, &self.gpu_scene.materials);
        let tracer = RayTracer::new(RaySettings::new(settings), 0);
        let triangles = (tracer.settings.meets_triangles)
            .then(|| SceneRays::new(gpu, &self.gpu_scene).unwrap());
        tracer.gather(
            &mut frame,
            &self.view.all(&self.gpu_scene),
            &space(
                &self.read.voxels,
                &ray_blocks(gpu, &self.read.voxels),
                &self.light,
            ),
            triangles.as_ref(),
        );
        gpu.submit(frame).unwrap();
        self.view.results(gpu)
    }

    /// The oracle's grid, from the records, so that only the tracing differs.
    fn trace_grid(&self, radiance: impl Fn(usize) -> [f64; 3]) -> TraceGrid {
        let voxel = |(slot, record)| {
            let sides = self.light.settings.sides as usize;
            let radiance =
                [sides * slot, sides * slot + sides - 1].map(|side| DVec3::from(radiance(side)));
            (coordinates(record), trace_voxel(record, radiance))
        };
        TraceGrid {
            resolution: self.read.voxels.grid.resolution,
            voxels: self.read.records.iter().enumerate().map(voxel).collect(),
        }
    }
}

/// What decides a ray is within f32 rounding where this is all that separates it from the other
/// decision (voxels).
const ROUNDING: f64 = 2e-3;

#[derive(Debug, PartialEq)]
enum Ray {
    Same,
    Rounding,
    Wrong,
}

/// Compares a ray's hit on the device with the oracle's crossings.
fn compare_ray(
    hit: Option<VoxelIndex>,
    seen: &[Crossing],
    near: impl Fn(VoxelIndex) -> bool,
) -> Ray {
    let first = seen
        .iter()
        .find(|crossing| crossing.margin >= 0.0)
        .map(|crossing| crossing.voxel);
    if hit == first {
        return Ray::Same;
    }
    let unsure = |crossing: &Crossing| {
        crossing.margin.abs() < ROUNDING || crossing.exit - crossing.entry < ROUNDING
    };
    let before = seen.iter().position(|crossing| Some(crossing.voxel) == hit);
    let passed = &seen[..before.unwrap_or(if hit.is_none() { seen.len() } else { 0 })];
    let passed_explained = passed
        .iter()
        .all(|crossing| crossing.margin < 0.0 || unsure(crossing));
    let hit_explained = match (hit, before) {
        (None, _) => true,
        (Some(_), Some(at)) => seen[at].margin >= 0.0 || unsure(&seen[at]),
        // Not crossed by the oracle's ray: within rounding of it, then.
        (Some(voxel), None) => near(voxel),
    };
    if passed_explained && hit_explained {
        Ray::Rounding
    } else {
        Ray::Wrong
    }
}

/// Whether a ray passes within rounding of a voxel.
fn passes_near(voxel: VoxelIndex, origin: DVec3, direction: DVec3) -> bool {
    let (low, high) = (
        DVec3::from(voxel.map(f64::from)) - ROUNDING,
        DVec3::from(voxel.map(f64::from)) + 1.0 + ROUNDING,
    );
    let (a, b) = ((low - origin) / direction, (high - origin) / direction);
    a.min(b).largest().max(0.0) <= a.max(b).min_element()
}

#[test]
fn rays_hit_the_oracles_voxels() {
    let gpu = gpu();
    let golden_angle = PI * (3.0 - 5f64.sqrt());
    for (name, resolution) in [("cornell", 32), ("cornell", 64), ("glossy", 32)] {
        let rays = RayScene::new(&gpu, bundled(name), Vec3::ZERO, resolution, Sides::One);
        // The compact index itself is the radiance: exact in half floats.
        let numbered = |slot: usize| [(slot % 1024) as f64, (slot / 1024) as f64, 1.0];
        let grid = rays.trace_grid(numbered);
        let order: Vec<VoxelIndex> = rays.read.records.iter().map(coordinates).collect();
        for (slack, height, start) in [
            ("-1", "0.1", "0.05"),
            ("0.1", "0.1", "0.05"),
            ("0.3", "-0.25", "0.8"),
        ] {
            let pairs = [
                "gather=rays".to_owned(),
                "rays=1".to_owned(),
                "interleave=8".to_owned(),
                format!("contour_slack={slack}"),
                format!("self_height={height}"),
                format!("ray_start={start}"),
            ];
            let settings = settings(&pairs);
            let seen = rays.gather(&gpu, numbered, &settings);
            let offset = f64::from(settings.number("ray_start"));
            let compare = |(index, (pixel, receiver)): (
                usize,
                &([u32; 2], lumivox::gi::shared::voxel::oracle::Receiver),
            )| {
                let code = seen[index] / PI;
                let hit = (code.z > 0.5)
                    .then(|| order[code.x.round() as usize + 1024 * code.y.round() as usize]);
                let pattern = interleaved_offset(*pixel, Pattern::of([8; 2]), 0);
                let direction = hemisphere_direction(
                    receiver.shading_normal,
                    pattern.x,
                    0.0 * golden_angle + pattern.y * 2.0 * PI,
                );
                let origin = receiver.position + offset * receiver.geometric_normal;
                let above = direction.dot(receiver.geometric_normal);
                if above.abs() < 1e-4 {
                    return Ray::Rounding;
                }
                let crossed = if above > 0.0 {
                    crossings(
                        &grid,
                        origin,
                        direction,
                        receiver,
                        &trace_settings(&settings, seed_of([pixel[0], pixel[1], 0], 0)),
                    )
                } else {
                    Vec::new()
                };
                compare_ray(hit, &crossed, |voxel| passes_near(voxel, origin, direction))
            };
            let all: Vec<Ray> = rays
                .view
                .receivers
                .par_iter()
                .enumerate()
                .map(compare)
                .collect();
            let count = |kind: Ray| all.iter().filter(|ray| **ray == kind).count();
            let (rounding, wrong) = (count(Ray::Rounding), count(Ray::Wrong));
            println!(
                "{name} {resolution}, slack {slack}: {} rays, {rounding} within rounding, {wrong} \
                 wrong",
                all.len()
            );
            assert!(
                wrong == 0 && rounding as f64 <= 0.01 * all.len() as f64,
                "{name}, slack {slack}: {wrong} wrong, {rounding} within rounding"
            );
        }
    }
}

#[test]
fn gathered_rays_are_the_oracles() {
    let gpu = gpu();
    // One that is open in front, so that not every ray is hidden, and one that is closed.
    gathered_rays(
        &gpu,
        small_room(Surfaces::Diffuse, vec![small_lights()[0].1]),
        Sides::One,
    );
    gathered_rays(&gpu, bundled("two-rooms"), Sides::Two);
    // Shading normals that lean, so that rays go below the surface.
    let mut leaning = small_room(Surfaces::Diffuse, vec![small_lights()[0].1]);
    let mut random = Random::new(5);
    for vertex in &mut leaning.vertices {
        let lean = Vec3::from([0; 3].map(|_: u32| 1.4 * (random.unit() - 0.5)));
        vertex.normal = (Vec3::from(vertex.normal) + lean).normalize().to_array();
    }
    gathered_rays(&gpu, leaning, Sides::One);
}

fn gathered_rays(gpu: &Gpu, scene: Scene, sides: Sides) {
    let name = scene.name.clone();
    let rays = RayScene::new(gpu, scene, Vec3::new(0.3, 0.2, 0.1), 32, sides);
    let mut random = Random::new(4);
    let values: Vec<[f64; 3]> = (0..2 * rays.read.records.len())
        .map(|_| [0; 3].map(|_: u32| f64::from(random.below(2048)) / 1024.0))
        .collect();
    let radiance = |slot: usize| values[slot];
    let grid = rays.trace_grid(radiance);
    let voxel_size = f64::from(rays.read.voxels.grid.voxel_size);
    let grid_origin = rays.read.voxels.grid.origin;
    let corners = rays.scene.triangles.iter().map(|triangle| {
        triangle.vertices.map(|vertex| {
            let position = Vec3::from(rays.scene.vertices[vertex as usize].position);
            (position.as_dvec3() - grid_origin.as_dvec3()) / voxel_size
        })
    });
    let triangles: Vec<[DVec3; 3]> = corners.collect();
    for pairs in [
        [
            "gather=rays",
            "interleave=1",
            "rays=24",
            "contour_slack=-1",
            "ao_falloff=0",
        ],
        [
            "gather=rays",
            "interleave=4",
            "rays=16",
            "contour_slack=0.1",
            "ao_falloff=3",
        ],
        [
            "gather=triangles",
            "interleave=1",
            "rays=24",
            "contour_slack=0.1",
            "ao_falloff=0",
        ],
        [
            "gather=triangles",
            "interleave=4",
            "rays=16",
            "contour_slack=0.1",
            "ao_falloff=3",
        ],
    ] {
        let pairs: Vec<String> = pairs.iter().map(|pair| (*pair).to_owned()).collect();
        let meets_triangles = pairs[0] == "gather=triangles";
        let settings = settings(&pairs);
        let seen = rays.gather(gpu, radiance, &settings);
        let pattern = Pattern::new(&settings);
        let of = |(pixel, receiver): &([u32; 2], Receiver)| {
            let gather_settings = GatherSettings {
                ray_count: settings.count("rays"),
                start_offset: if meets_triangles {
                    let place = voxel_size * receiver.position + grid_origin.as_dvec3();
                    let eye = rays.scene.camera.eye.as_dvec3();
                    let largest = place.abs().max((eye - place).abs()).max_element();
                    f64::from(START_SHARE) * largest / voxel_size
                } else {
                    f64::from(settings.number("ray_start"))
                },
                trace: trace_settings(&settings, seed_of([pixel[0], pixel[1], 0], 0)),
                ao_falloff: f64::from(settings.number("ao_falloff")) * voxel_size,
                pattern: interleaved_offset(*pixel, pattern, 0),
                environment: rays.scene.environment.uniform().as_dvec3(),
            };
            if !meets_triangles {
                return Some(oracle_rays(&grid, receiver, &gather_settings));
            }
            let [before, gathered, after] = [-1e-4, 0.0, 1e-4].map(|step| {
                let along = step * DVec3::new(1.0, 0.7, 0.6);
                let normal = receiver.geometric_normal;
                let receiver = Receiver {
                    position: receiver.position + along - along.dot(normal) * normal,
                    ..*receiver
                };
                oracle_triangles(&grid, &triangles, &receiver, &gather_settings)
            });
            // Where two surfaces meet, rounding says on which side of the other a ray starts.
            let apart = (before.visibility - after.visibility).abs();
            (apart < 0.5 / f64::from(gather_settings.ray_count)).then_some(gathered)
        };
        let gathered: Vec<Option<Gathered>> = rays.view.receivers.par_iter().map(of).collect();
        let certain = gathered.iter().flatten().count();
        assert!(
            certain as f64 > 0.95 * seen.len() as f64,
            "{certain} of {}",
            seen.len()
        );
        let pairs_of = seen.iter().zip(&gathered);
        let (seen, expected): (Vec<DVec4>, Vec<DVec4>) = pairs_of
            .filter_map(|(seen, gathered)| {
                let gathered = gathered.as_ref()?;
                Some((*seen, gathered.irradiance.extend(gathered.visibility)))
            })
            .unzip();
        let (relative, _) = errors(&seen, &expected);
        let rays = f64::from(settings.count("rays"));
        let what = compare_gathered(&seen, &expected, rays)
            .unwrap_or_else(|error| panic!("rays, {name}, {sides:?}, {pairs:?}: {error}"));
        println!(
            "rays, {name}, {sides:?}, {pairs:?}: {what}, worst {:.3}",
            relative[relative.len() - 1]
        );
        assert!(relative[relative.len() - 1] <= 0.5);
        // Without a falloff a closed room hides all.
        let open = expected.iter().map(|pixel| pixel.w).sum::<f64>() / expected.len() as f64;
        let is_closed = name == "two-rooms" && settings.number("ao_falloff") == 0.0;
        assert!(
            if is_closed {
                open < 0.01
            } else {
                (0.05..0.95).contains(&open)
            },
            "{name}: a visibility of {open}"
        );
        // Planted: an occluder more everywhere, a tenth of the visibility missing, and none of it
        // hidden; not a number.
        let planted: [fn(f64) -> f64; 4] = [
            |seen| seen - 1.0,
            |seen| 0.9 * seen - 0.01,
            |_| 1.0,
            |_| f64::NAN,
        ];
        for plant in planted {
            let seen: Vec<DVec4> = seen
                .iter()
                .map(|pixel| pixel.truncate().extend(plant(pixel.w)))
                .collect();
            assert!(
                compare_gathered(&seen, &expected, rays).is_err(),
                "rays, {name}, {pairs:?}: a wrong visibility goes unnoticed"
            );
        }
    }
}

/// What is wrong with a gather of `rays` rays, if anything. A ray that grazes a voxel within
/// rounding may take another radiance, or be hidden where it was not. That may happen to one pixel
/// in 100 at most, by a ray or two each.
fn compare_gathered(seen: &[DVec4], expected: &[DVec4], rays: f64) -> Result<String, String> {
    let apart = seen
        .iter()
        .zip(expected)
        .map(|(seen, expected)| (seen.w - expected.w).abs());
    let mut apart: Vec<f64> = apart.collect();
    let is_same = |(seen, expected): (&DVec4, &DVec4)| {
        (*seen - *expected)
            .abs()
            .cmple(DVec4::splat(1e-3 * expected.max_element().max(1.0)))
            .all()
    };
    let same = seen
        .iter()
        .zip(expected)
        .filter(|pair| is_same(*pair))
        .count() as f64
        / expected.len() as f64;
    apart.sort_by(f64::total_cmp);
    let worst = apart[apart.len() - 1];
    let what = format!(
        "{:.2}% of pixels the same, visibility off by {worst:.1e} at most",
        100.0 * same
    );
    // Rays that graze a voxel's edge meet it or not (98.96% by SwiftShader).
    if same >= device_class().allows(0.99, 0.98) && worst <= 2.0 / rays {
        Ok(what)
    } else {
        Err(what)
    }
}

/// A hit behind the first voxel, a hit on a voxel that the ray is nowhere near, a miss.
#[test]
fn comparator_notices_planted_errors() {
    let crossing = |x: u32, margin: f64| Crossing {
        voxel: [x, 0, 0],
        entry: f64::from(x),
        exit: f64::from(x + 1),
        margin,
    };
    let seen = [crossing(1, -0.4), crossing(2, 0.3), crossing(3, 0.2)];
    let near = |voxel| passes_near(voxel, DVec3::new(0.5, 0.5, 0.5), DVec3::X);
    assert_eq!(compare_ray(Some([2, 0, 0]), &seen, near), Ray::Same);
    for wrong in [Some([3, 0, 0]), Some([1, 0, 0]), Some([2, 2, 2]), None] {
        assert_eq!(compare_ray(wrong, &seen, near), Ray::Wrong, "{wrong:?}");
    }
    let grazed = [crossing(1, 1e-5), crossing(2, 0.3)];
    assert_eq!(compare_ray(Some([2, 0, 0]), &grazed, near), Ray::Rounding);
}
