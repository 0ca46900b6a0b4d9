//! Light from voxel to voxel: `voxel.bounce` on the device against the CPU oracles, what
//! `voxel.light` makes of it, and how many bounces come of it.

use crate::support::compare::{Largest, Worst, larger};
use std::collections::BTreeMap;

use crate::support::gather::{
    all_groups, matter, occupied, random_volume, read_chain, read_faces, upload_faces, volume,
};
use crate::support::scenes::bundled;
use crate::support::technique::{Case, default_cases, default_cases_with, frame, mean, shoot};
use crate::support::voxels::{
    Read, coordinates, half, ray_blocks, to_half, trace_settings, trace_voxel, unorm10,
    voxel_settings, voxelize,
};
use crate::support::{Random, gpu};
use glam::{DVec3, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::registry::find;
use lumivox::gi::settings::Settings;
use lumivox::gi::shared::cone::oracle::{
    self as cone_oracle, FaceChain, Levels, MarchSettings, Placement, SetCone,
};
use lumivox::gi::shared::cone::{ConeTracer, FaceWeights, cone_set};
use lumivox::gi::shared::voxel::oracle::{self, TraceGrid, TraceVoxel, VoxelIndex};
use lumivox::gi::shared::voxel::{
    Directionality, Faces, Injection, LightBounces, LightSettings, Method, Prefilter, RaySettings,
    RayTracer, Sides, Viewer, VoxelLight, VoxelRecords,
};
use lumivox::gi::voxel_cones::mips::{filter_mips, radiance_image};
use lumivox::gi::voxel_cones::svo::{BrickPool, BrickSettings, NodePool, PieceVoxelizer};
use lumivox::gi::voxel_cones::{Gatherer, mips};
use lumivox::graph::{Frame, Gpu};
use lumivox::image::Aov;
use lumivox::metrics::{Channel, compare};
use lumivox::reference::guide;
use lumivox::render::{GpuScene, LightMaps};
use lumivox::scene::Scene;
use rayon::prelude::*;

/// Voxels with a light of their own.
struct Lit {
    scene: Scene,
    gpu_scene: GpuScene,
    read: Read,
    light: VoxelLight,
}

impl Lit {
    fn new(gpu: &Gpu, name: &str, environment: Vec3, resolution: u32, sides: Sides) -> Lit {
        let mut scene = bundled(name);
        scene.environment = environment.into();
        let gpu_scene = GpuScene::new(gpu, &scene).unwrap();
        gpu_scene
            .set_frame(gpu, &gpu_scene.frame_constants(&scene.camera, [8, 8]))
            .unwrap();
        let read = voxelize(gpu, &gpu_scene, voxel_settings(resolution, Method::Compute));
        let settings = LightSettings {
            bounces: LightBounces::Count(2),
            ..LightSettings::direct(Injection::Voxel, sides)
        };
        let light = VoxelLight::new(gpu, &gpu_scene, &read.voxels, settings).unwrap();
        Lit {
            scene,
            gpu_scene,
            read,
            light,
        }
    }

    fn sides(&self) -> usize {
        self.light.settings.sides as usize
    }

    fn frame(&self) -> Frame {
        let mut frame = Frame::new();
        frame.set_scene(&self.gpu_scene.set, &self.gpu_scene.materials);
        frame
    }

    fn surface(&self, slot: usize, radiance: [DVec3; 2]) -> TraceVoxel {
        trace_voxel(&self.read.records[slot], radiance)
    }

    /// r, g, b of each side in compact order.
    fn read(&self, gpu: &Gpu, buffer: &std::sync::Arc<lumivox::graph::Buffer>) -> Vec<DVec3> {
        let halves: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(buffer).unwrap());
        halves
            .iter()
            .take(self.sides() * self.read.records.len())
            .map(|texel| DVec3::new(half(texel[0]), half(texel[1]), half(texel[2])))
            .collect()
    }

    fn irradiance(&self, gpu: &Gpu) -> Vec<DVec3> {
        self.read(gpu, self.light.irradiance.as_ref().unwrap())
    }
}

fn settings(technique: &str, preset: &str, pairs: &[&str]) -> Settings {
    find(technique)
        .unwrap()
        .settings(Some(preset), pairs)
        .unwrap()
}

fn random_colors(count: usize, random: &mut Random) -> Vec<DVec3> {
    (0..count)
        .map(|_| DVec3::from([0; 3].map(|_: u32| f64::from(random.below(2048)) / 1024.0)))
        .collect()
}

fn upload(gpu: &Gpu, buffer: &std::sync::Arc<lumivox::graph::Buffer>, colors: &[DVec3]) {
    let halves: Vec<u16> = colors
        .iter()
        .flat_map(|color| [color.x, color.y, color.z, 1.0].map(to_half))
        .collect();
    gpu.upload_buffer(buffer, bytemuck::cast_slice(&halves))
        .unwrap();
}

/// Share of values that agree to a half float's rounding, and the mean relative difference.
fn agreement(seen: &[DVec3], expected: &[DVec3]) -> (f64, f64) {
    assert_eq!(seen.len(), expected.len());
    let off = |(seen, expected): (&DVec3, &DVec3)| {
        (*seen - *expected).abs().largest() / expected.largest().max(0.05)
    };
    let same = seen
        .iter()
        .zip(expected)
        .filter(|pair| off(*pair) < 2e-3)
        .count() as f64
        / seen.len() as f64;
    (
        same,
        (seen.iter().sum::<DVec3>() / expected.iter().sum::<DVec3>() - 1.0)
            .abs()
            .largest(),
    )
}

/// A ray that grazes a voxel within rounding takes another radiance: at most one side in 100.
fn verdict(agreement: (f64, f64)) -> Result<(), String> {
    if agreement.0 >= 0.99 && agreement.1 <= 0.002 {
        Ok(())
    } else {
        Err(format!("{agreement:?}"))
    }
}

#[test]
fn light_gathered_by_rays_is_the_oracles() {
    let gpu = gpu();
    for (name, sides, slack, rays) in [
        ("cornell", Sides::Two, "0.1", 4),
        ("two-rooms", Sides::Two, "-1", 3),
        ("two-rooms", Sides::One, "0.1", 4),
    ] {
        let radiance_setting = if sides == Sides::Two {
            "radiance=two-sided"
        } else {
            "radiance=isotropic"
        };
        let lit = Lit::new(&gpu, name, Vec3::new(0.3, 0.2, 0.1), 32, sides);
        let radiance = random_colors(lit.sides() * lit.read.records.len(), &mut Random::new(9));
        upload(&gpu, &lit.light.radiance, &radiance);
        let settings = settings(
            "voxel-mips",
            "accurate",
            &[radiance_setting, &format!("contour_slack={slack}")],
        );
        let mut frame = lit.frame();
        let irradiance = lit.light.irradiance.as_ref().unwrap();
        RayTracer::new(RaySettings::new(&settings), rays).bounce(
            &mut frame,
            &VoxelRecords::from(&lit.read.voxels),
            &mips::space(
                &lit.read.voxels,
                &ray_blocks(&gpu, &lit.read.voxels),
                &lit.light,
            ),
            irradiance,
        );
        gpu.submit(frame).unwrap();
        let seen = lit.irradiance(&gpu);
        let of = |slot: usize| {
            lit.surface(
                slot,
                [0, 1].map(|side| radiance[lit.sides() * slot + side.min(lit.sides() - 1)]),
            )
        };
        let voxels: BTreeMap<VoxelIndex, TraceVoxel> = lit
            .read
            .records
            .iter()
            .enumerate()
            .map(|(slot, record)| (coordinates(record), of(slot)))
            .collect();
        let grid = TraceGrid {
            resolution: 32,
            voxels,
        };
        let trace = trace_settings(&settings, 0);
        let start = f64::from(settings.number("ray_start"));
        // Every 7th side: the oracle tries every voxel for every ray.
        let chosen: Vec<usize> = (0..seen.len()).step_by(7).collect();
        let gather = |slot: &usize| {
            let (voxel, side) = (
                coordinates(&lit.read.records[slot / lit.sides()]),
                (sides == Sides::Two).then_some(slot % 2),
            );
            oracle::bounce_rays(
                &grid,
                voxel,
                side,
                rays,
                start,
                &trace,
                lit.scene.environment.uniform().as_dvec3(),
            )
        };
        let expected: Vec<DVec3> = chosen.par_iter().map(gather).collect();
        let mut seen: Vec<DVec3> = chosen.iter().map(|slot| seen[*slot]).collect();
        let agreed = agreement(&seen, &expected);
        println!(
            "{name}, {sides:?}: {} sides, {:.2}% the same, mean off by {:.1e}",
            seen.len(),
            100.0 * agreed.0,
            agreed.1
        );
        verdict(agreed).unwrap_or_else(|error| panic!("{name}, {sides:?}: {error}"));
        // Planted: 1% more light, the light of the neighbour.
        let brighter: Vec<DVec3> = seen.iter().map(|color| 1.01 * *color).collect();
        assert!(verdict(agreement(&brighter, &expected)).is_err());
        seen.rotate_right(1);
        assert!(verdict(agreement(&seen, &expected)).is_err());
    }
}

#[test]
fn light_gathered_by_cones_is_the_oracles() {
    let gpu = gpu();
    let wide = [
        "bounce_directions=8",
        "height_clamp=0",
        "step_factor=0.5",
        "aperture_scale=0.8",
    ];
    for (seed, (pairs, sides)) in [
        (vec!["bounce_directions=5"], Sides::One),
        (wide.to_vec(), Sides::One),
        (wide.to_vec(), Sides::Two),
    ]
    .iter()
    .enumerate()
    {
        let lit = Lit::new(&gpu, "two-rooms", Vec3::new(0.3, 0.2, 0.1), 32, *sides);
        // Voxels of six faces gather on each side.
        let mut random = Random::new(seed as u64);
        let texels = [0; 6].map(|_| random_volume(32, 0.05, &mut random));
        let has_faces = *sides == Sides::Two;
        let image = if has_faces {
            radiance_image(&gpu, "faces", 32, 6, 6).unwrap()
        } else {
            volume(&gpu, &texels[0])
        };
        let matter = matter(&gpu, &texels.iter().flat_map(occupied).collect(), 32);
        if has_faces {
            upload_faces(&gpu, &image, &texels);
        }
        let all: Vec<&str> = pairs.iter().copied().chain(["bounces=2"]).collect();
        let settings = settings("voxel-mips", "cones", &all);
        let mut frame = lit.frame();
        let groups = all_groups(&gpu, 32, if has_faces { 6 } else { 1 });
        filter_mips(&mut frame, &image, None, Prefilter::Directional, &groups);
        let tracer = ConeTracer::new(&gpu, &settings).unwrap();
        tracer.bounce(
            &mut frame,
            &VoxelRecords::from(&lit.read.voxels),
            mips::volume(
                lit.read.voxels.grid,
                &image,
                &matter,
                has_faces.then_some((&image, Directionality::Directional(Faces::Both))),
            ),
            lit.light.irradiance.as_ref().unwrap(),
        );
        gpu.submit(frame).unwrap();
        let chain = if has_faces {
            Vec::new()
        } else {
            read_chain(&gpu, &image)
        };
        let faces = has_faces.then(|| FaceChain {
            finest: None,
            levels: read_faces(&gpu, &image),
            weights: FaceWeights::Extinction,
        });
        let number = |name: &str| f64::from(settings.number(name));
        let set = cone_set(
            settings.count("bounce_directions"),
            true,
            settings.number("aperture_scale"),
        );
        let cone = |cone: &lumivox::gi::shared::cone::Cone| SetCone {
            sin_squared: f64::from(cone.sin2_theta),
            azimuth_rad: f64::from(cone.phi_rad),
            tan_half: f64::from(cone.tan_half_aperture),
            weight: f64::from(cone.weight),
        };
        let cones: Vec<SetCone> = set.cones.iter().map(cone).collect();
        let march = MarchSettings {
            step_factor: number("step_factor"),
            opacity_exponent: number("opacity_exponent"),
            height_clamp: number("height_clamp"),
            max_distance: 128.0,
            environment: lit.scene.environment.uniform().as_dvec3(),
            ..MarchSettings::TEXTBOOK
        };
        let placement = Placement {
            start_offset: number("start_offset"),
            pattern: glam::DVec2::ZERO,
            jitter: f64::from(set.stratum),
        };
        let of = |slot: usize| {
            let (record, side) = (slot / lit.sides(), has_faces.then_some(slot % 2));
            let surface = lit.surface(record, [DVec3::ZERO; 2]);
            let levels = faces
                .as_ref()
                .map_or_else(|| Levels::from(&chain), Levels::from);
            cone_oracle::bounce(
                levels,
                coordinates(&lit.read.records[record]),
                side,
                &surface,
                &cones,
                &placement,
                &march,
            )
        };
        let expected: Vec<DVec3> = (0..lit.sides() * lit.read.records.len())
            .into_par_iter()
            .map(of)
            .collect();
        let mut seen = lit.irradiance(&gpu);
        let agreed = agreement(&seen, &expected);
        println!(
            "cones {pairs:?}: {} voxels, {:.2}% the same, mean off by {:.1e}",
            seen.len(),
            100.0 * agreed.0,
            agreed.1
        );
        verdict(agreed).unwrap_or_else(|error| panic!("{pairs:?}: {error}"));
        seen.rotate_right(1);
        assert!(agreement(&seen, &expected).0 < 0.5);
    }
}

/// L = L₀ + ρ E/π on each side.
#[test]
fn voxels_reflect_what_they_gathered() {
    let gpu = gpu();
    for sides in [Sides::One, Sides::Two] {
        let lit = Lit::new(&gpu, "two-rooms", Vec3::ZERO, 32, sides);
        let maps = LightMaps::new(&gpu, &lit.gpu_scene, 256, false).unwrap();
        let mut frame = lit.frame();
        maps.draw(&mut frame, &lit.gpu_scene);
        lit.light.update(&mut frame, &lit.read.voxels, &maps, None);
        gpu.submit(frame).unwrap();
        let direct = lit.read(&gpu, &lit.light.radiance);
        let counts = lit.light.counts(&gpu).unwrap();
        let irradiance = random_colors(direct.len(), &mut Random::new(5));
        upload(&gpu, lit.light.irradiance.as_ref().unwrap(), &irradiance);
        let mut frame = lit.frame();
        lit.light.relight(
            &mut frame,
            &VoxelRecords::from(&lit.read.voxels),
            &maps,
            None,
            Viewer::Picture,
        );
        gpu.submit(frame).unwrap();
        let albedo = |slot: usize| unorm10(lit.read.records[slot / lit.sides()].albedo).powf(2.0);
        let expected: Vec<DVec3> = (0..direct.len())
            .map(|slot| direct[slot] + albedo(slot) * irradiance[slot])
            .collect();
        let agreed = agreement(&lit.read(&gpu, &lit.light.radiance), &expected);
        println!(
            "{sides:?}: {:.2}% the same, mean off by {:.1e}",
            100.0 * agreed.0,
            agreed.1
        );
        assert!(
            agreed.0 == 1.0 && agreement(&direct, &expected).0 < 0.5,
            "{agreed:?}"
        );
        assert_eq!(
            counts,
            lit.light.counts(&gpu).unwrap(),
            "what is lit twice in a frame is counted once"
        );
    }
}

/// Voxels in pieces gather what the whole grid gathers.
#[test]
fn bounces_of_pieces_are_those_of_the_whole() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    gpu_scene
        .set_frame(&gpu, &gpu_scene.frame_constants(&scene.camera, [8, 8]))
        .unwrap();
    let light_settings = LightSettings {
        bounces: LightBounces::Count(2),
        ..LightSettings::direct(Injection::Voxel, Sides::One)
    };
    let gatherer = Gatherer::new(&gpu, &settings("svo", "cones", &["bounces=2"])).unwrap();
    let light = |along: u32| {
        let mut voxelizer =
            PieceVoxelizer::new(&gpu, &gpu_scene, voxel_settings(32, Method::Compute)).unwrap();
        voxelizer.cut(along);
        let (pieces, occupancy, _) = voxelizer.run(&gpu, &gpu_scene, light_settings).unwrap();
        let (nodes, _) = NodePool::build(&gpu, &occupancy, false).unwrap();
        let settings = BrickSettings {
            corners: false,
            filter: 1,
            is_split: false,
            touched: false,
            directionality: Directionality::Isotropic,
            lobe: None,
        };
        let (mut bricks, _) = BrickPool::new(&gpu, &nodes, settings, Sides::One, None).unwrap();
        let maps = LightMaps::new(&gpu, &gpu_scene, 512, false).unwrap();
        let sum = || {
            let halves: Vec<[u16; 4]> =
                bytemuck::pod_collect_to_vec(&gpu.read_buffer(&pieces.radiance).unwrap());
            halves
                .iter()
                .take(pieces.voxel_count as usize)
                .map(|voxel| half(voxel[0]))
                .sum::<f64>()
        };
        let mut frame = Frame::new();
        frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
        maps.draw(&mut frame, &gpu_scene);
        pieces.update(&mut frame, &maps, &nodes.nodes);
        bricks.update(&mut frame, &nodes, &pieces.radiance);
        gpu.submit(frame).unwrap();
        let direct = sum();
        let mut frame = Frame::new();
        frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
        let volume = bricks.volume(pieces.grid, &nodes);
        pieces.bounce(&mut frame, &gatherer, (Some(volume), None));
        pieces.relight(&mut frame, &maps, Viewer::Picture);
        gpu.submit(frame).unwrap();
        [direct, sum()]
    };
    let (whole, pieces) = (light(1), light(4));
    println!(
        "sum of red radiance, direct and with a bounce: {whole:.3?} of the whole, {pieces:.3?} of \
         64 pieces"
    );
    assert!(whole[1] > 1.2 * whole[0]);
    assert!(
        (0..2).all(|i| (pieces[i] / whole[i] - 1.0).abs() < 0.01),
        "{pieces:?} and {whole:?}"
    );
}

/// Bit by bit: the first frame with feedback is one bounce, the next is two, and so on. Only the
/// light of techniques that light all at once in their first frame is at rest in that.
#[test]
fn each_frame_of_feedback_is_a_bounce_more() {
    let gpu = gpu();
    let scene = bundled("cornell");
    for case in default_cases_with("bounces=feedback") {
        let feedback = case.settings(&[("resolution", "16"), ("bounces", "feedback")]);
        assert_eq!((case.entry.bounces)(&feedback), None);
        if (case.entry.frames_to_rest)(&feedback) == 1 {
            assert_eq!(case.entry.name, "probe-cascades");
            continue;
        }
        let (mut renderer, _) =
            Renderer::new(&gpu, &scene, case.entry, &feedback, frame(24, 24, 128)).unwrap();
        for count in ["1", "2", "3", "4"] {
            renderer.render(&scene.camera).unwrap();
            let counted = shoot(
                &gpu,
                &scene,
                &case,
                &[("resolution", "16"), ("bounces", count)],
                frame(24, 24, 128),
            )
            .unwrap();
            assert!(
                renderer.aov(Aov::Full).unwrap() == counted.full,
                "{}: frame {count} of feedback is not that of {count} bounces",
                case.name()
            );
        }
    }
}

/// With one bounce there is no pass and no byte for more.
#[test]
fn one_bounce_has_nothing_of_the_others() {
    let gpu = gpu();
    let scene = bundled("cornell");
    for case in default_cases_with("bounces=feedback") {
        for (bounces, expected) in [
            ("1", [false, false]),
            ("2", [true, true]),
            ("feedback", [true, true]),
        ] {
            let settings = case.settings(&[("resolution", "16"), ("bounces", bounces)]);
            let (mut renderer, _) =
                Renderer::new(&gpu, &scene, case.entry, &settings, frame(8, 8, 64)).unwrap();
            renderer.render(&scene.camera).unwrap();
            let stats = renderer.render(&scene.camera).unwrap();
            // A light field asks for the irradiance of its probes, and how far they see, for more
            // bounces alone.
            let is_field = case.entry.name == "light-field-probes";
            let of_more = if is_field { "blend_sh" } else { "bounce" };
            let passes = stats.passes.iter().any(|pass| pass.name.contains(of_more));
            let bytes = gpu.memory().iter().any(|(name, bytes)| {
                if is_field {
                    name == "probes.moments" && *bytes > 100_000
                } else {
                    ["voxel.irradiance", "cone.bounce_set", "probes.irradiance1"]
                        .contains(&name.as_str())
                }
            });
            assert_eq!(
                [passes, bytes],
                expected,
                "{}, bounces={bounces}",
                case.name()
            );
        }
    }
}

/// A closed box of albedo ½ that emits L_e: L = L_e (1 + ½ + … ½ᵇ), with feedback 2 L_e within 5%
/// after 40 frames and never 5% above it. Directional voxels, with g = 1.5, let some light through
/// a wall wherever samples are one voxel wide, as all are among 16³ voxels: 10% over all bounces
/// there, 5% among 64³.
#[test]
fn energy_of_a_furnace() {
    let gpu = gpu();
    let scene = Scene::bundled(
        "furnace",
        &[("albedo".into(), 0.5), ("emission".into(), 1.0)],
    )
    .unwrap();
    let seen = guide(&scene, 32, 32).unwrap();
    let cones = ["cones", "anisotropic", "directional"].map(|preset| Case {
        entry: find("voxel-mips").unwrap(),
        preset: Some(preset),
    });
    for case in default_cases().into_iter().chain(cones) {
        // Of probes in nested lattices no count is beyond 2.
        let counts = [2, 4].into_iter();
        for count in counts.filter(|count| case.accepts(&format!("bounces={count}"))) {
            let pairs = [
                ("resolution", "32"),
                ("bounces", ["2", "3", "4"][count - 2]),
            ];
            let shot = shoot(&gpu, &scene, &case, &pairs, frame(32, 32, 16)).unwrap();
            let expected = 2.0 - 0.5f64.powi(count as i32);
            let found = mean(&shot.full, &seen) / expected;
            println!(
                "{}, {count} bounces: {found:.4} of the closed form",
                case.name()
            );
            assert!(
                (found - 1.0).abs() <= 0.05,
                "{}, {count} bounces: {found}",
                case.name()
            );
        }
        if !case.accepts("bounces=feedback") {
            continue;
        }
        let settings = case.settings(&[("resolution", "16"), ("bounces", "feedback")]);
        let (mut renderer, _) =
            Renderer::new(&gpu, &scene, case.entry, &settings, frame(16, 16, 16)).unwrap();
        let seen = guide(&scene, 16, 16).unwrap();
        let mut most = 0.0;
        for turn in 0..40 {
            renderer.render(&scene.camera).unwrap();
            if turn % 20 == 19 {
                let full = renderer.aov(Aov::Full).unwrap();
                most = larger(
                    most,
                    full.pixels.iter().map(|pixel| pixel.largest()).worst(),
                );
            }
        }
        let found = mean(&renderer.aov(Aov::Full).unwrap(), &seen) / 2.0;
        println!(
            "{}, feedback: {found:.4} of the closed form, at most {:.4} of it in a pixel",
            case.name(),
            most / 2.0
        );
        let least = if case.preset == Some("directional") {
            0.9
        } else {
            0.95
        };
        assert!(
            found >= least && most / 2.0 <= 1.05,
            "{}: {found}, at most {most}",
            case.name()
        );
        if case.preset == Some("directional") {
            let settings = case.settings(&[("resolution", "64"), ("bounces", "feedback")]);
            let (mut renderer, _) =
                Renderer::new(&gpu, &scene, case.entry, &settings, frame(16, 16, 16)).unwrap();
            (0..16).for_each(|_| drop(renderer.render(&scene.camera).unwrap()));
            let found = mean(&renderer.aov(Aov::Full).unwrap(), &seen) / 2.0;
            println!(
                "{}, feedback at 64³: {found:.4} of the closed form",
                case.name()
            );
            assert!(
                (0.95..=1.05).contains(&found),
                "{} at 64³: {found}",
                case.name()
            );
        }
    }
}

/// By normals, a side of a voxel gathers and reflects for itself. Walls that emit from their front
/// alone are seen as bright as they are.
#[test]
fn energy_of_a_furnace_by_normals() {
    let gpu = gpu();
    let scene = Scene::bundled(
        "furnace",
        &[("albedo".into(), 0.5), ("emission".into(), 1.0)],
    )
    .unwrap();
    let seen = guide(&scene, 32, 32).unwrap();
    let cases = ["voxel-mips", "svo", "clipmap"].map(|technique| Case {
        entry: find(technique).unwrap(),
        preset: Some("cones"),
    });
    let counts = [1, 2, 4].into_iter();
    for (count, case) in counts.flat_map(|count| cases.map(|case| (count, case))) {
        let pairs = [
            ("resolution", "32"),
            ("normals", "toksvig"),
            ("bounces", ["1", "2", "", "4"][count - 1]),
        ];
        let full = shoot(&gpu, &scene, &case, &pairs, frame(32, 32, 16))
            .unwrap()
            .full;
        let expected = 2.0 - 0.5f64.powi(count as i32);
        let most = full.pixels.iter().map(|pixel| pixel.largest()).worst() / expected;
        let found = mean(&full, &seen) / expected;
        println!(
            "{}, {count} bounces by normals: {found:.4} of the closed form, at most {most:.4} of \
             it in a pixel",
            case.name()
        );
        assert!(
            (found - 1.0).abs() <= 0.1 && most <= 1.02,
            "{}, {count} bounces: {found}, at most {most}",
            case.name()
        );
    }
}

/// The octree's bounces equal the mips' bounces.
#[test]
fn bounces_through_the_octree_are_those_through_mips() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let shot = |technique: &str| {
        let case = Case {
            entry: find(technique).unwrap(),
            preset: Some("cones"),
        };
        shoot(
            &gpu,
            &scene,
            &case,
            &[("resolution", "32"), ("bounces", "3")],
            frame(64, 48, 512),
        )
        .unwrap()
        .indirect
    };
    let errors = compare(&shot("svo"), &shot("voxel-mips"), None, Channel::Rgb)
        .unwrap()
        .pixel;
    println!(
        "octree against mips, 3 bounces: rel_rmse {:.5}, bias {:+.5}",
        errors.rel_rmse, errors.bias
    );
    assert!(errors.rel_rmse <= 0.01, "{errors:?}");
}

#[test]
fn settings_name_the_bounces() {
    for technique in ["voxel-mips", "svo"] {
        let entry = find(technique).unwrap();
        let count = |value: &str| {
            (entry.bounces)(&entry.settings(None, &[format!("bounces={value}")]).unwrap())
        };
        assert_eq!(
            ["1", "2", "3", "4", "feedback"].map(count),
            [Some(1), Some(2), Some(3), Some(4), None]
        );
        assert!(entry.settings(None, &["bounces=5"]).is_err());
    }
}
