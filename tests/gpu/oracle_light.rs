//! `voxel.inject_rsm` and `voxel.light` on the device against the CPU oracle.

use crate::support::compare::{Largest, Worst};
use std::collections::BTreeMap;
use std::f64::consts::PI;

use crate::support::scenes::{add_model, bundled, in_unit_grid, scene_of, still};
use crate::support::voxels::{
    Read, area, coordinates, half, oracle_grid, seen, voxel_settings, voxelize,
};
use crate::support::{Random, gpu};
use glam::{DVec3, Vec3};
use lumivox::gi::shared::voxel::oracle::{
    self, VoxelIndex, inject, inject_faces, inject_sides, reflected_flux, shade_voxel,
};
use lumivox::gi::shared::voxel::{
    Injection, LightInputs, LightSettings, Method, Occlusion, Sides, VoxelLight,
};
use lumivox::graph::{Frame, Gpu};
use lumivox::render::bvh::SceneRays;
use lumivox::render::{GpuScene, LightMaps};
use lumivox::scene::{Light, Scene};

/// Voxels with their light.
struct Lit {
    read: Read,
    radiance: Vec<DVec3>,
    bytes: Vec<u8>,
    lost: u64,
    filled: u64,
}

/// Voxelizes and lights a scene. The grid is in general position: no surface of the scene lies
/// between two voxels.
fn light(gpu: &Gpu, scene: &Scene, resolution: u32, map_size: u32, injection: Injection) -> Lit {
    let settings = LightSettings::direct(injection, Sides::One);
    light_by(gpu, scene, resolution, map_size, settings)
}

/// As [`light`], in any way.
fn light_by(
    gpu: &Gpu,
    scene: &Scene,
    resolution: u32,
    map_size: u32,
    settings: LightSettings,
) -> Lit {
    let gpu_scene = in_general_position(gpu, scene);
    let read = voxelize(gpu, &gpu_scene, voxel_settings(resolution, Method::Compute));
    light_voxels(gpu, &gpu_scene, read, map_size, settings)
}

/// By rays against the scene's triangles.
fn by_triangles(sides: Sides) -> LightSettings {
    LightSettings {
        occlusion: Occlusion::Triangles,
        ..LightSettings::direct(Injection::Voxel, sides)
    }
}

/// The scene in bounds that make a grid in general position, as its camera sees it.
fn in_general_position(gpu: &Gpu, scene: &Scene) -> GpuScene {
    let mut gpu_scene = GpuScene::new(gpu, scene).unwrap();
    let (low, high) = gpu_scene.bounds;
    let size = (high - low).max_element();
    gpu_scene.bounds = (
        low - size * Vec3::new(0.0213, 0.0137, 0.0171),
        high + size * Vec3::new(0.0119, 0.0271, 0.0193),
    );
    gpu_scene
        .set_frame(gpu, &gpu_scene.frame_constants(&scene.camera, [8, 8]))
        .unwrap();
    gpu_scene
}

/// Lights voxels by maps of a scene.
fn light_voxels(
    gpu: &Gpu,
    gpu_scene: &GpuScene,
    read: Read,
    map_size: u32,
    settings: LightSettings,
) -> Lit {
    let is_reflective = settings.injection == Injection::Rsm;
    let maps = LightMaps::new(gpu, gpu_scene, map_size, is_reflective).unwrap();
    let triangles = (settings.meets_triangles()).then(|| SceneRays::new(gpu, gpu_scene).unwrap());
    let inputs = LightInputs {
        maps: &maps,
        rsm: &maps,
        triangles: triangles.as_ref(),
    };
    let voxel_light = VoxelLight::new(gpu, gpu_scene, &read.voxels, settings).unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
    maps.draw(&mut frame, gpu_scene);
    voxel_light.update(&mut frame, &read.voxels, inputs, None);
    gpu.submit(frame).unwrap();
    let counts = voxel_light.counts(gpu).unwrap();
    let mut bytes = gpu.read_buffer(&voxel_light.radiance).unwrap();
    bytes.truncate(8 * settings.sides as usize * read.records.len());
    let halves: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&bytes);
    let radiance = halves
        .iter()
        .map(|texel| DVec3::new(half(texel[0]), half(texel[1]), half(texel[2])))
        .collect();
    Lit {
        read,
        radiance,
        bytes,
        lost: counts[0].1,
        filled: counts[1].1,
    }
}

impl Lit {
    /// Σ π L A h² (W).
    fn flux(&self) -> DVec3 {
        let face_m2 = f64::from(self.read.voxels.grid.voxel_size).powi(2);
        self.radiance
            .iter()
            .zip(&self.read.records)
            .map(|(radiance, record)| PI * face_m2 * area(record) * seen(record).y * *radiance)
            .sum()
    }

    /// Root of the area-weighted mean square difference, in area-weighted mean radiances; and the
    /// relative bias.
    fn difference(&self, expected: &BTreeMap<VoxelIndex, DVec3>) -> (f64, f64) {
        let (mut squares, mut expected_sum, mut sum, mut weight) = (0.0, 0.0, 0.0, 0.0);
        for (radiance, record) in self.radiance.iter().zip(&self.read.records) {
            let (expected, own) = (
                expected
                    .get(&coordinates(record))
                    .copied()
                    .unwrap_or_default(),
                area(record),
            );
            squares += own * (*radiance - expected).length_squared() / 3.0;
            expected_sum += own * expected.element_sum() / 3.0;
            sum += own * radiance.element_sum() / 3.0;
            weight += own;
        }
        (
            (squares / weight).sqrt() / (expected_sum / weight),
            sum / expected_sum - 1.0,
        )
    }
}

/// The Cornell box under each kind of light.
fn lights() -> Vec<(&'static str, Scene)> {
    let scene = bundled("cornell");
    let position = scene
        .lights
        .iter()
        .find_map(|light| {
            if let Light::Point { position, .. } = light {
                Some(*position)
            } else {
                None
            }
        })
        .unwrap();
    let with = |light: Light| Scene {
        lights: vec![light],
        ..scene.clone()
    };
    let towards =
        (scene.camera.target - scene.camera.eye + Vec3::new(0.31, -0.53, 0.0)).normalize();
    let spot = Light::Spot {
        position,
        direction: Vec3::new(0.2, -1.0, -0.1).normalize(),
        intensity: Vec3::new(9.0, 8.0, 7.0),
        inner_deg: 25.0,
        outer_deg: 40.0,
    };
    let two = Scene {
        lights: vec![scene.lights[0], spot],
        ..scene.clone()
    };
    vec![
        (
            "directional",
            with(Light::Directional {
                direction: towards,
                irradiance: Vec3::new(3.0, 2.0, 1.0),
            }),
        ),
        ("spot", with(spot)),
        ("point and spot", two),
        ("point", scene),
    ]
}

#[test]
fn injected_flux_is_what_surfaces_reflect() {
    let gpu = gpu();
    for (name, scene) in lights() {
        let lit = light(&gpu, &scene, 32, 512, Injection::Rsm);
        let expected = reflected_flux(&scene, 4096);
        let error = (lit.flux() / expected - 1.0).abs().largest();
        let (rms, bias) = lit.difference(&inject(&scene, &oracle_grid(&lit.read.voxels.grid), 32));
        let texels = 512u64
            * 512
            * scene
                .lights
                .iter()
                .map(|light| {
                    if matches!(light, Light::Point { .. }) {
                        6
                    } else {
                        1
                    }
                })
                .sum::<u64>();
        println!(
            "{name}: flux {:.4}, oracle {expected:.4}, error {error:.5}; per voxel rms {rms:.4}, \
             bias {bias:+.4}; {} lost, {} filled",
            lit.flux(),
            lit.lost,
            lit.filled
        );
        assert!(error <= 0.02 && rms <= 0.1 && bias.abs() <= 0.02, "{name}");
        assert!(
            lit.lost <= texels / 10_000,
            "{name}: {} of {texels} texels are lost",
            lit.lost
        );
    }
}

/// A light next to the floor: its brightest voxels need the high bytes of the sums. With a second
/// light that is 1,024 times as strong, but shines away from everything, steps are 1,024 times as
/// large and the low words are enough: the light is the same.
#[test]
fn sums_hold_a_light_next_to_a_wall() {
    let gpu = gpu();
    let mut scene = bundled("cornell");
    let (low, high) = GpuScene::new(&gpu, &scene).unwrap().bounds;
    let size = (high - low).length();
    let near = Light::Point {
        position: Vec3::new(
            0.5 * (low.x + high.x),
            low.y + 0.004 * size,
            low.z + 0.9 * (high.z - low.z),
        ),
        intensity: Vec3::ONE,
    };
    let away = Light::Spot {
        position: high + size,
        direction: Vec3::Y,
        intensity: Vec3::splat(1024.0),
        inner_deg: 1.0,
        outer_deg: 2.0,
    };
    scene.lights = vec![near];
    let fine = light(&gpu, &scene, 128, 512, Injection::Rsm);
    scene.lights.push(away);
    let coarse = light(&gpu, &scene, 128, 512, Injection::Rsm);
    // Low words hold 2³² steps; a step is 2⁻²⁰ of the intensity over the squared diagonal, or less.
    let low_words = 4096.0 / f64::from(size * size);
    let bright: Vec<_> = fine
        .radiance
        .iter()
        .zip(&coarse.radiance)
        .filter(|(fine, _)| fine.largest() > low_words)
        .collect();
    let worst = bright
        .iter()
        .map(|(fine, coarse)| (*fine - *coarse).abs().largest() / fine.largest())
        .worst();
    println!(
        "{} voxels beyond {low_words:.1} W/(m² sr), off by up to {worst:.5}",
        bright.len()
    );
    assert!(!bright.is_empty() && worst <= 2e-3);
}

#[test]
fn injection_converges_with_the_maps() {
    let (gpu, scene) = (gpu(), bundled("cornell"));
    let mut errors = Vec::new();
    let mut expected = None;
    for map_size in [256, 512, 1024] {
        let lit = light(&gpu, &scene, 32, map_size, Injection::Rsm);
        let expected = expected
            .get_or_insert_with(|| inject(&scene, &oracle_grid(&lit.read.voxels.grid), 128));
        let (rms, bias) = lit.difference(expected);
        println!("maps of {map_size}: per voxel rms {rms:.5}, bias {bias:+.5}");
        errors.push(rms);
    }
    assert!(errors.is_sorted_by(|a, b| a > b), "{errors:?}");
}

/// Whether a voxel and all that touch it are lit, or all dark: the edge of no shadow is near.
fn is_away_from_edges(expected: &BTreeMap<VoxelIndex, DVec3>, [x, y, z]: VoxelIndex) -> bool {
    let around = |at: u32| at.saturating_sub(1)..=at + 1;
    let near = around(x)
        .flat_map(|x| around(y).flat_map(move |y| around(z).map(move |z| [x, y, z])))
        .filter_map(|voxel| expected.get(&voxel));
    let lit: Vec<bool> = near.map(|radiance| radiance.max_element() > 0.0).collect();
    lit.iter().all(|is_lit| *is_lit == lit[0])
}

/// What is wrong with the shaded voxels, if anything: away from the edges of shadows each is the
/// oracle's, but for what 10 bits a component make of its mean normal where light grazes it (1.5%),
/// and of all few are not. The coordinates and the radiance of each.
fn compare_shaded(
    shaded: &[(VoxelIndex, DVec3)],
    expected: &BTreeMap<VoxelIndex, DVec3>,
) -> Result<String, String> {
    let is_right = |(voxel, radiance): &&(VoxelIndex, DVec3)| {
        let expected = expected[voxel];
        radiance.is_finite()
            && (*radiance - expected)
                .abs()
                .cmple(DVec3::splat(0.02 * expected.max_element().max(1e-3)))
                .all()
    };
    let wrong: Vec<_> = shaded.iter().filter(|shaded| !is_right(shaded)).collect();
    let away = shaded
        .iter()
        .filter(|(voxel, _)| is_away_from_edges(expected, *voxel))
        .count();
    let what = format!(
        "{} of {} voxels are wrong, {away} of all are away from the edges of shadows",
        wrong.len(),
        shaded.len()
    );
    if let Some((voxel, radiance)) = wrong
        .iter()
        .find(|(voxel, _)| is_away_from_edges(expected, *voxel))
    {
        return Err(format!(
            "{what}: {voxel:?} of them has {radiance} for {}",
            expected[voxel]
        ));
    }
    // A quarter is far more than the voxels along a few lines.
    if wrong.len() as f64 <= 0.025 * shaded.len() as f64 && 4 * away >= shaded.len() {
        Ok(what)
    } else {
        Err(what)
    }
}

/// A shadow map has one depth a texel, so that a voxel at the edge of a shadow may be on its other
/// side, or lit by one light of two.
#[test]
fn shaded_voxels_are_the_oracles() {
    let gpu = gpu();
    for (name, scene) in lights() {
        let lit = light(&gpu, &scene, 32, 512, Injection::Voxel);
        let grid = oracle_grid(&lit.read.voxels.grid);
        let expected: BTreeMap<_, _> = oracle::voxelize(&scene, &grid)
            .iter()
            .map(|(voxel, sum)| (*voxel, shade_voxel(&scene, &grid, *voxel, sum, 0.25)))
            .collect();
        let (rms, bias) = lit.difference(&expected);
        let mut shaded: Vec<_> = lit
            .read
            .records
            .iter()
            .map(coordinates)
            .zip(lit.radiance.iter().copied())
            .collect();
        let what =
            compare_shaded(&shaded, &expected).unwrap_or_else(|error| panic!("{name}: {error}"));
        println!("{name}, voxels shaded: rms {rms:.4}, bias {bias:+.4}, {what}");
        assert!(bias.abs() <= 0.003 && rms <= 0.2, "{name}");
        // Planted: one voxel away from shadows 3% too bright; not a number in blue; the light of
        // each voxel in the next.
        let inside = shaded
            .iter()
            .position(|(voxel, radiance)| radiance.y > 0.1 && is_away_from_edges(&expected, *voxel))
            .unwrap();
        for wrong in [1.03 * shaded[inside].1, shaded[inside].1.with_z(f64::NAN)] {
            let right = std::mem::replace(&mut shaded[inside].1, wrong);
            assert!(
                compare_shaded(&shaded, &expected).is_err(),
                "{name}: {wrong} goes unnoticed"
            );
            shaded[inside].1 = right;
        }
        let turned: Vec<_> = shaded
            .iter()
            .zip(shaded.iter().skip(1))
            .map(|((voxel, _), (_, radiance))| (*voxel, *radiance))
            .collect();
        assert!(compare_shaded(&turned, &expected).is_err(), "{name}");
    }
}

/// Radiances of a voxel's sides or faces, and the area that each is the mean of [voxel faces].
type SidesOf = BTreeMap<VoxelIndex, Vec<(DVec3, f64)>>;

fn expected_sides(scene: &Scene, grid: &oracle::Grid, sides: Sides) -> SidesOf {
    let sums = oracle::voxelize(scene, grid);
    let with_areas = |(voxel, radiances): (VoxelIndex, Vec<DVec3>)| {
        let sum = &sums[&voxel];
        let area = |side: usize| match sides {
            Sides::Six => sum.facing[0].max(sum.facing[1])[side / 2],
            _ => sum.area,
        };
        let radiances = radiances.into_iter().enumerate();
        let radiances = radiances.map(|(side, radiance)| (radiance, area(side)));
        (voxel, radiances.collect())
    };
    match sides {
        Sides::Six => (inject_faces(scene, grid, 32).into_iter())
            .map(|(voxel, faces)| with_areas((voxel, faces.to_vec())))
            .collect(),
        _ => (inject_sides(scene, grid, 32).into_iter())
            .map(|(voxel, both)| with_areas((voxel, both.to_vec())))
            .collect(),
    }
}

/// Each side against the oracle: in the Cornell box, whose walls are lit on one side, and in two
/// rooms with a thin wall between them.
#[test]
fn light_of_each_side_is_the_oracles() {
    let gpu = gpu();
    let by_maps = LightSettings::direct;
    let cases = [Sides::Two, Sides::Six].map(|sides| {
        [
            by_maps(Injection::Rsm, sides),
            by_maps(Injection::Voxel, sides),
            by_triangles(sides),
        ]
    });
    let names = ["cornell", "two-rooms"];
    for (name, settings) in names
        .into_iter()
        .flat_map(|name| cases.into_iter().flatten().map(move |by| (name, by)))
    {
        let LightSettings {
            injection,
            sides,
            occlusion,
            ..
        } = settings;
        let scene = bundled(name);
        let lit = light_by(&gpu, &scene, 32, 1024, settings);
        let expected = expected_sides(&scene, &oracle_grid(&lit.read.voxels.grid), sides);
        let count = sides as usize;
        let (mut squares, mut weight) = (0.0, 0.0);
        let (mut sums, mut expected_sums) = (vec![0.0; count], vec![0.0; count]);
        for (index, record) in lit.read.records.iter().enumerate() {
            let Some(expected) = expected.get(&coordinates(record)) else {
                continue;
            };
            for (side, (expected, area)) in expected.iter().enumerate() {
                let radiance = lit.radiance[count * index + side];
                squares += area * (radiance - *expected).length_squared() / 3.0;
                sums[side] += area * radiance.element_sum() / 3.0;
                expected_sums[side] += area * expected.element_sum() / 3.0;
                weight += area;
            }
        }
        let total: f64 = expected_sums.iter().sum();
        let rms = (squares / weight).sqrt() / (total / weight);
        let bias: Vec<f64> = (sums.iter().zip(&expected_sums))
            .map(|(sum, expected)| (sum - expected) / total)
            .collect();
        println!(
            "{name}, {injection:?}, {occlusion:?}, {sides:?}: sides {expected_sums:.2?}, rms \
             {rms:.4}, bias of each {bias:+.4?}"
        );
        // The fewer the texels of a mean, the noisier; voxels of several planes are lit as a point.
        let bound = match (injection, sides) {
            _ if occlusion == Occlusion::Triangles => [0.3, 0.01],
            (Injection::Rsm, Sides::Six) => [0.15, 0.01],
            (Injection::Rsm, _) => [0.1, 0.01],
            (Injection::Voxel, _) => [0.5, 0.06],
        };
        assert!(
            rms <= bound[0] && bias.iter().all(|bias| bias.abs() <= bound[1]),
            "{name}, {injection:?}, {sides:?}"
        );
    }
}

#[test]
fn light_is_linear_and_repeats_bit_for_bit() {
    let gpu = gpu();
    for injection in [Injection::Rsm, Injection::Voxel] {
        for (name, scene) in lights() {
            let mut double = scene.clone();
            double.lights.iter_mut().for_each(|light| match light {
                Light::Directional { irradiance, .. } => *irradiance *= 2.0,
                Light::Point { intensity, .. } | Light::Spot { intensity, .. } => *intensity *= 2.0,
            });
            let once = light(&gpu, &scene, 32, 256, injection);
            assert!(
                once.bytes == light(&gpu, &scene, 32, 256, injection).bytes,
                "{name}: two runs differ"
            );
            let twice = light(&gpu, &double, 32, 256, injection);
            // Half floats below 2⁻¹⁴ lose bits.
            let worst = once
                .radiance
                .iter()
                .zip(&twice.radiance)
                .filter(|(once, _)| once.largest() > 1e-3);
            let worst = worst
                .map(|(once, twice)| (*twice - 2.0 * *once).abs().largest() / once.largest())
                .worst();
            assert!(worst <= 1e-3, "{name}: doubling is off by {worst}");
        }
    }
}

/// Fewer texels than voxels: holes are filled and counted, and what the light reaches is not dark.
#[test]
fn coarse_maps_leave_no_lit_voxel_dark() {
    let (gpu, scene) = (gpu(), bundled("cornell"));
    let lit = light(&gpu, &scene, 128, 64, Injection::Rsm);
    let expected = inject(&scene, &oracle_grid(&lit.read.voxels.grid), 4);
    let mean = expected
        .values()
        .map(|radiance| radiance.largest())
        .sum::<f64>()
        / expected.len() as f64;
    let is_lit = |voxel: &VoxelIndex| expected[voxel].largest() > 0.2 * mean;
    // A texel is up to four voxels wide: so far from a shadow's edge nothing may be dark.
    let is_inside = |[x, y, z]: VoxelIndex| {
        let range = |at: u32| at.saturating_sub(4)..=at + 4;
        range(x).all(|x| {
            range(y)
                .all(|y| range(z).all(|z| !expected.contains_key(&[x, y, z]) || is_lit(&[x, y, z])))
        })
    };
    let (mut lit_count, mut dark, mut dark_inside) = (0, 0, 0);
    for (radiance, record) in lit
        .radiance
        .iter()
        .zip(&lit.read.records)
        .filter(|(_, record)| is_lit(&coordinates(record)))
    {
        lit_count += 1;
        if radiance.largest() <= 0.0 {
            dark += 1;
            dark_inside += usize::from(is_inside(coordinates(record)));
        }
    }
    let (filled, lost) = (lit.filled, lit.lost);
    println!(
        "maps of 64 for 128³: {filled} holes filled, {dark} of {lit_count} lit voxels dark, \
         {dark_inside} of them away from shadows, {lost} texels lost"
    );
    assert!(filled > 0 && dark_inside == 0 && f64::from(dark) <= 0.02 * f64::from(lit_count));
}

/// Strips in the middle of voxels, lit by texels of 0.6 voxels. A texel's light that would fall on
/// an empty voxel beside the strip stays in the strip's voxel, so that no light is lost.
#[test]
fn light_beside_a_surface_stays_on_it() {
    let gpu = gpu();
    let strips = (4..28).flat_map(|strip| {
        let at = |x: f32, z: f32| Vec3::new(strip as f32 + x, 16.3, z);
        let corners = [at(0.1, 4.2), at(0.1, 27.8), at(0.9, 27.8), at(0.9, 4.2)];
        [[0, 1, 2], [0, 2, 3]].map(|triangle| triangle.map(|corner: usize| corners[corner]))
    });
    // Every second one, so that there is nothing between them.
    let triangles: Vec<_> = strips.enumerate().filter(|(i, _)| i / 2 % 2 == 0).collect();
    let triangles: Vec<_> = triangles.into_iter().map(|(_, corners)| corners).collect();
    let mut scene = scene_of(&triangles, 0.0, &mut Random::new(71));
    scene.lights = vec![Light::Directional {
        direction: Vec3::new(0.2, -1.0, 0.13).normalize(),
        irradiance: Vec3::new(3.0, 2.0, 1.0),
    }];
    let mut gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    in_unit_grid(&mut gpu_scene, 32);
    gpu_scene
        .set_frame(&gpu, &gpu_scene.frame_constants(&scene.camera, [8, 8]))
        .unwrap();
    let expected = reflected_flux(&scene, 16);
    let read = voxelize(&gpu, &gpu_scene, voxel_settings(32, Method::Compute));
    let lit = light_voxels(
        &gpu,
        &gpu_scene,
        read,
        80,
        LightSettings::direct(Injection::Rsm, Sides::One),
    );
    println!(
        "strips: flux {:.2}, oracle {expected:.2}, {} filled",
        lit.flux(),
        lit.filled
    );
    assert!((lit.flux() / expected - 1.0).abs().largest() <= 0.03);
    assert_eq!((lit.lost, lit.filled), (0, 0));
}

/// What the maps show, but was not voxelized, is counted: a square in the middle of the box.
#[test]
fn texels_that_find_no_voxel_are_counted() {
    let gpu = gpu();
    let room = bundled("cornell");
    let (low, high) = GpuScene::new(&gpu, &room).unwrap().bounds;
    let middle = 0.5 * (low + high) + 0.1 * (high - low) * Vec3::new(0.3, 1.0, 0.2);
    let (right, up) = (
        0.06 * (high.x - low.x) * Vec3::X,
        0.06 * (high.y - low.y) * Vec3::Y,
    );
    let corners = [
        middle - right - up,
        middle + right - up,
        middle + right + up,
    ];
    let mut with_square = room.clone();
    let square = scene_of(&[corners], 0.0, &mut Random::new(72));
    add_model(&mut with_square, square, &[still(Vec3::ZERO)]);
    let both = [&room, &with_square].map(|scene| in_general_position(&gpu, scene));
    let settings = voxel_settings(32, Method::Compute);
    let lost = both.iter().map(|voxelized| {
        let read = voxelize(&gpu, voxelized, settings);
        light_voxels(
            &gpu,
            &both[1],
            read,
            512,
            LightSettings::direct(Injection::Rsm, Sides::One),
        )
        .lost
    });
    let lost: Vec<u64> = lost.collect();
    println!("texels that find no voxel: {lost:?} without and with the square's voxels");
    assert!(lost[0] >= 20 && lost[1] <= lost[0] / 20, "{lost:?}");
}

/// Emission alone: scenes without lights. Two or three of the sheets share a voxel, where some hide
/// others.
#[test]
fn emission_is_radiance() {
    let gpu = gpu();
    let sheet = |number: u32| {
        let corners = [[0.0, 0.0], [16.0, 0.0], [0.0, 16.0]];
        corners.map(|[x, z]| Vec3::new(x, 0.19 * number as f32 + 0.1 * x, z))
    };
    let sheets: Vec<_> = (0..24).map(sheet).collect();
    let mut scenes = [
        bundled("cornell-lamp"),
        scene_of(&sheets, 7.0, &mut Random::new(80)),
    ];
    let mut shares = 0;
    for scene in &mut scenes {
        scene.lights.clear();
        let lit = light(&gpu, scene, 32, 64, Injection::Rsm);
        let sums = oracle::voxelize(scene, &oracle_grid(&lit.read.voxels.grid));
        let brightest = sums.values().map(|sum| sum.emission.largest()).worst();
        let mut glowing = 0;
        for (radiance, record) in lit.radiance.iter().zip(&lit.read.records) {
            let Some(sum) = sums.get(&coordinates(record)) else {
                continue;
            };
            // As in the attributes' test: what a fragment's area is rounded by.
            let weight = (2.0 * f64::from(sum.fragment_count + 2) / 16384.0 / sum.area).min(1.0);
            let share = sum.seen_from_both;
            let emission = sum.emission / share;
            let rounded = (0.5 / 255.0 + 2.0 * weight) / (share - 0.5 / 255.0 - 2.0 * weight);
            let allowed = (5e-3 + rounded) * emission.largest() + weight * brightest / share;
            if rounded < 0.0 {
                continue;
            }
            let error = (*radiance - emission).abs().largest();
            assert!(error <= allowed + 1e-5, "{radiance} for {sum:?}");
            glowing += usize::from(radiance.largest() > 0.0);
            shares += usize::from(emission.largest() > 0.1 && share < 0.9 && rounded < 0.02);
        }
        assert!(glowing > 0);
    }
    println!("{shares} bright voxels whose surface is not all seen");
    assert!(shares > 20);
}

#[test]
fn comparators_notice_planted_errors() {
    let (gpu, scene) = (gpu(), bundled("cornell"));
    let mut lit = light(&gpu, &scene, 32, 512, Injection::Rsm);
    let expected = inject(&scene, &oracle_grid(&lit.read.voxels.grid), 32);
    let (flux, good) = (lit.flux(), lit.difference(&expected).0);
    // All 3% brighter; the light of each voxel in the next.
    lit.radiance
        .iter_mut()
        .for_each(|radiance| *radiance *= 1.03);
    assert!((lit.flux() / flux - 1.0).abs().largest() > 0.02 && lit.difference(&expected).1 > 0.02);
    lit.radiance
        .iter_mut()
        .for_each(|radiance| *radiance /= 1.03);
    lit.radiance.rotate_right(1);
    assert!(lit.difference(&expected).0 > 0.1 && good < 0.1);
}
