//! Texels of six faces, of anisotropic mips and of directional voxels, on the device against the
//! CPU oracles.

use crate::support::compare::{Largest, Worst};
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::support::gather::{
    View, all_groups, cones_by_oracle, errors, groups_of, matter, occupied, random_volume,
    read_chain, read_faces, upload_faces, verdict, volume,
};
use crate::support::scenes::{bundled, in_unit_grid, scene_of, soup};
use crate::support::technique::{Case, frame, shoot};
use crate::support::voxels::{
    Read, coordinates, front, half, oracle_grid, unorm10, voxel_settings, voxelize,
};
use crate::support::{Random, gpu, read_words};
use glam::{DVec3, DVec4, Vec3};
use lumivox::gi::registry::find;
use lumivox::gi::shared::cone::oracle::{Cone, FaceChain, MarchSettings, Volume, march};
use lumivox::gi::shared::cone::{ConeTracer, FaceWeights};
use lumivox::gi::shared::voxel::oracle::{self, VoxelIndex, VoxelSum};
use lumivox::gi::shared::voxel::{
    DenseTexels, Directionality, Faces, Injection, LightSettings, Method, Prefilter, Sides,
    VoxelGrid, VoxelLight, VoxelSettings,
};
use lumivox::gi::voxel_cones::mips;
use lumivox::gi::voxel_cones::mips::oracle::{Filter, chain, coarser_faces, face_chain};
use lumivox::gi::voxel_cones::mips::{filter_mips, radiance_image};
use lumivox::graph::{Frame, Gpu, Image};
use lumivox::metrics::{Channel, compare};
use lumivox::render::{GpuScene, LightMaps};
use lumivox::scene::Scene;

/// Six random volumes with matter in the same places; some of it has no opacity on some faces.
fn random_faces(resolution: u32, filled: f32, random: &mut Random) -> [Volume; 6] {
    let there = random_volume(resolution, filled, random);
    [0; 6].map(|_: u32| {
        let mut face = random_volume(resolution, 1.0, random);
        for (texel, there) in face.texels.iter_mut().zip(&there.texels) {
            if there.w == 0.0 || random.below(4) == 0 {
                *texel = DVec4::ZERO;
            }
        }
        face
    })
}

/// Places of the matter on any of the faces.
fn matter_of(gpu: &Gpu, faces: &[Volume; 6]) -> Arc<Image> {
    matter(
        gpu,
        &faces.iter().flat_map(occupied).collect(),
        faces[0].resolution,
    )
}

/// Largest difference in steps of half floats (2⁻¹¹ of the value, at least 2⁻¹⁴).
fn half_steps(seen: &[Volume; 6], expected: &[Volume; 6]) -> f64 {
    let steps = |(seen, expected): (&DVec4, &DVec4)| {
        ((*seen - *expected).abs() / (expected.abs() * 2f64.powi(-11) + 2f64.powi(-25))).largest()
    };
    let of = |(seen, expected): (&Volume, &Volume)| {
        seen.texels.iter().zip(&expected.texels).map(steps).worst()
    };
    seen.iter().zip(expected).map(of).worst()
}

/// Each level against the oracle's filter of the one before: of anisotropic mips from an isotropic
/// level, of directional voxels from faces.
#[test]
fn mips_of_faces_are_the_oracles() {
    let gpu = gpu();
    for (resolution, filled) in [(8, 1.0), (16, 0.0), (32, 0.1), (64, 0.3), (64, 0.0005)] {
        let mut random = Random::new(u64::from(resolution));
        let finest = random_volume(resolution, filled, &mut random);
        let image = volume(&gpu, &finest);
        let coarser = radiance_image(&gpu, "faces", resolution / 2, 6, resolution.ilog2()).unwrap();
        let directional =
            radiance_image(&gpu, "directional", resolution, 6, resolution.ilog2() + 1).unwrap();
        let mut frame = Frame::new();
        let (filter, faces) = (
            Prefilter::Directional,
            random_faces(resolution, filled, &mut random),
        );
        upload_faces(&gpu, &directional, &faces);
        // Where there is no matter nothing is made.
        let of_image = matter(&gpu, &occupied(&finest), resolution);
        let groups = [of_image, matter_of(&gpu, &faces)].map(|matter| groups_of(&gpu, &matter, 6));
        frame.clear_image("test.clear", &coarser, [0.0; 4]);
        frame.clear_mips("test.clear", &directional, 1..directional.mips(), [0.0; 4]);
        filter_mips(&mut frame, &image, Some(&coarser), filter, &groups[0]);
        filter_mips(&mut frame, &directional, None, filter, &groups[1]);
        gpu.submit(frame).unwrap();
        let mut anisotropic = vec![std::array::from_fn(|_| read_chain(&gpu, &image)[0].clone())];
        anisotropic.extend(read_faces(&gpu, &coarser));
        for (name, chain) in [
            ("anisotropic", anisotropic),
            ("directional", read_faces(&gpu, &directional)),
        ] {
            assert_eq!(chain.last().unwrap()[0].resolution, 1);
            let steps = chain
                .windows(2)
                .map(|levels| half_steps(&levels[1], &coarser_faces(levels[0].each_ref())))
                .worst();
            println!("{name} mips of {resolution}³: {steps:.2} half-float steps off the oracle");
            assert!(steps <= 2.1, "{name}, {resolution}³: {steps}");
            // Planted: two faces in each other's place. Of single texels both are alike.
            let mut swapped = chain[1].clone();
            swapped.swap(0, 1);
            assert!(
                filled < 0.1 || half_steps(&swapped, &coarser_faces(chain[0].each_ref())) > 100.0
            );
        }
    }
}

/// Random faces, settings and weights: the irradiance is the oracle's, and the same with empty
/// space skipped or not.
#[test]
fn cones_through_faces_are_the_oracles() {
    let gpu = gpu();
    let mut scene = bundled("cornell");
    scene.environment = Vec3::new(0.7, 0.5, 0.3).into();
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let grid = VoxelGrid::around(gpu_scene.bounds, 32);
    let view = View::new(&gpu, &gpu_scene, &scene.camera, [32, 24], &grid);
    for seed in 0..12 {
        let mut random = Random::new(900 + seed);
        let filled = [0.02, 0.1, 0.4][seed as usize % 3];
        let directionality = if seed % 2 == 0 {
            Directionality::Anisotropic
        } else {
            Directionality::Directional(Faces::Both)
        };
        let (radiance, faces, matter) = if directionality == Directionality::Anisotropic {
            let finest = random_volume(32, filled, &mut random);
            (
                volume(&gpu, &finest),
                radiance_image(&gpu, "faces", 16, 6, 5).unwrap(),
                matter(&gpu, &occupied(&finest), 32),
            )
        } else {
            let (image, finest) = (
                radiance_image(&gpu, "directional", 32, 6, 6).unwrap(),
                random_faces(32, filled, &mut random),
            );
            upload_faces(&gpu, &image, &finest);
            (Arc::clone(&image), image, matter_of(&gpu, &finest))
        };
        let coarser = (directionality == Directionality::Anisotropic).then_some(&faces);
        let mut frame = Frame::new();
        let groups = all_groups(&gpu, 32, 6);
        filter_mips(
            &mut frame,
            &radiance,
            coarser,
            Prefilter::Directional,
            &groups,
        );
        gpu.submit(frame).unwrap();
        let weights = [FaceWeights::Extinction, FaceWeights::Squared][seed as usize / 2 % 2];
        let mut pairs = vec![format!(
            "face_weights={}",
            if weights == FaceWeights::Squared {
                "squared"
            } else {
                "extinction"
            }
        )];
        let mut set = |name: &str, value: String| pairs.push(format!("{name}={value}"));
        set(
            "cones",
            [1, 5, 6, 9, 16, 25, 32][seed as usize % 7].to_string(),
        );
        set(
            "cone_set",
            ["papers", "disc"][random.below(2) as usize].to_owned(),
        );
        set("aperture_scale", (0.1 + random.unit()).to_string());
        set("step_factor", (0.25 + 1.25 * random.unit()).to_string());
        set("opacity_exponent", (0.5 + 3.0 * random.unit()).to_string());
        set(
            "height_clamp",
            if random.below(2) == 0 {
                "0".to_owned()
            } else {
                (1.0 + 6.0 * random.unit()).to_string()
            },
        );
        set("start_offset", (0.5 + 2.0 * random.unit()).to_string());
        set(
            "interleave",
            [1, 2, 4, 8][random.below(4) as usize].to_string(),
        );
        let settings = find("voxel-mips")
            .unwrap()
            .settings(Some("textbook"), &pairs)
            .unwrap();
        let [all, seen] = [false, true].map(|skips_empty| {
            let mut tracer = ConeTracer::new(&gpu, &settings).unwrap();
            tracer.skips_empty = skips_empty;
            let mut frame = Frame::new();
            frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
            let volume = mips::volume(grid, &radiance, &matter, Some((&faces, directionality)));
            tracer.gather(&mut frame, &view.all(&gpu_scene), volume);
            gpu.submit(frame).unwrap();
            view.results(&gpu)
        });
        assert!(
            all == seen,
            "seed {seed}: skipping empty space changes the picture"
        );
        let finest = coarser.map(|_| read_chain(&gpu, &radiance).swap_remove(0));
        let mut chain = FaceChain {
            finest,
            levels: read_faces(&gpu, &faces),
            weights,
        };
        let mut result = errors(
            &seen,
            &cones_by_oracle(&chain, &scene, &grid, &view, &settings),
        );
        let (relative, visibility) = &result;
        println!(
            "{directionality:?}, {weights:?}: relative error median {:.1e}, worst {:.1e}; \
             visibility {visibility:.1e}",
            relative[relative.len() / 2],
            relative[relative.len() - 1]
        );
        verdict(&result).unwrap_or_else(|error| panic!("seed {seed}, {pairs:?}: {error}"));
        if coarser.is_some() {
            continue;
        }
        // Planted: faces seen from behind.
        chain
            .levels
            .iter_mut()
            .for_each(|level| (0..3).for_each(|axis| level.swap(2 * axis, 2 * axis + 1)));
        result = errors(
            &seen,
            &cones_by_oracle(&chain, &scene, &grid, &view, &settings),
        );
        assert!(
            verdict(&result).is_err(),
            "seed {seed}: faces in each other's place go unnoticed"
        );
    }
}

/// A cone of 60° that meets a wall one voxel thick along its normal, 8, 16 and 28 voxels off, is
/// covered by it, but for what trilinear samples let through of any layer, and sees its front
/// alone. Through box mips it passes.
#[test]
fn a_wide_cone_does_not_pass_a_thin_wall() {
    let (front, back) = (
        DVec4::new(0.0, 1.0, 0.0, 1.0),
        DVec4::new(1.0, 0.0, 0.0, 1.0),
    );
    for distance in [8u32, 16, 28] {
        let wall = |seen: DVec4| {
            Volume::new(64, |[_, _, z]| {
                if z == 16 + distance {
                    seen
                } else {
                    DVec4::ZERO
                }
            })
        };
        // What is seen from −z is the front; across the wall, nothing of a sheet.
        let faces = [
            DVec4::ZERO,
            DVec4::ZERO,
            DVec4::ZERO,
            DVec4::ZERO,
            back,
            front,
        ]
        .map(wall);
        let isotropic: [Volume; 6] = std::array::from_fn(|_| wall(front));
        let anisotropic = FaceChain {
            finest: Some(wall(front)),
            levels: face_chain(coarser_faces(isotropic.each_ref())),
            weights: FaceWeights::Extinction,
        };
        let directional = FaceChain {
            finest: None,
            levels: face_chain(faces),
            weights: FaceWeights::Extinction,
        };
        let cone = Cone {
            origin: DVec3::new(32.5, 32.5, 16.0),
            direction: DVec3::Z,
            tan_half: 30f64.to_radians().tan(),
            height: 0.0,
            cosine: 1.0,
        };
        let settings = MarchSettings {
            step_factor: 0.5,
            max_distance: 1e9,
            environment: DVec3::new(0.0, 0.0, 100.0),
            ..MarchSettings::TEXTBOOK
        };
        for (name, volume) in [("anisotropic", anisotropic), ("directional", directional)] {
            let seen = march(&volume, &cone, &settings);
            println!("{name}, wall at {distance}: {:.4}", seen.radiance);
            assert!(
                seen.radiance.y > 0.78 && seen.radiance.x == 0.0,
                "{name}, wall at {distance}: {}",
                seen.radiance
            );
        }
        let seen = march(&chain(wall(front), Filter::Box), &cone, &settings);
        println!("box mips, wall at {distance}: {:.4}", seen.radiance);
        assert!(
            seen.radiance.y < 0.5,
            "box mips, wall at {distance}: {}",
            seen.radiance
        );
    }
}

/// Scenes with walls and thin partitions, and soups with degenerate triangles.
fn scenes() -> Vec<(String, Scene)> {
    let soups = (0..6).map(|seed| {
        (
            format!("soup {seed}"),
            scene_of(
                &soup(&mut Random::new(50 + seed), 16),
                0.0,
                &mut Random::new(seed),
            ),
        )
    });
    ["cornell", "two-rooms"]
        .map(|name| (name.to_owned(), bundled(name)))
        .into_iter()
        .chain(soups)
        .collect()
}

/// A fragment's area is rounded to 1/16384 face, and computed in f32 from coordinates relative to
/// the triangle: so much per fragment (faces).
const AREA_ERROR: f64 = 1.5 / 16384.0;

/// What is wrong with the faces' opacities, if anything.
fn compare_opacities(
    packed: &[[u32; 2]],
    read: &Read,
    sums: &BTreeMap<VoxelIndex, VoxelSum>,
    settings: VoxelSettings,
) -> Result<(), String> {
    let mut worst = (0.0, String::new());
    for (record, packed) in read.records.iter().zip(packed) {
        let Some(sum) = sums.get(&coordinates(record)) else {
            continue;
        };
        let area_error = AREA_ERROR * f64::from(sum.fragment_count + 2);
        let allowed = 1.0 / 1023.0
            + if settings.coverage {
                area_error
            } else {
                4.0 * (area_error / sum.area).min(1.0)
            };
        let expected = sum.face_opacities(settings.faces.unwrap(), !settings.coverage);
        for (packed, expected) in packed.iter().zip(expected) {
            let share = (unorm10(*packed) - expected).abs().largest() / allowed;
            if share > worst.0 {
                worst = (
                    share,
                    format!(
                        "{:?}: {} for {expected}, {share:.2} of the tolerance",
                        coordinates(record),
                        unorm10(*packed)
                    ),
                );
            }
        }
    }
    if worst.0 <= 1.0 { Ok(()) } else { Err(worst.1) }
}

#[test]
fn opacities_of_faces_are_the_oracles() {
    let gpu = gpu();
    for (name, scene) in scenes() {
        let resolution = if name.starts_with("soup") { 16 } else { 32 };
        let mut gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
        if name.starts_with("soup") {
            in_unit_grid(&mut gpu_scene, resolution);
        }
        for (faces, coverage) in [
            (Faces::Front, true),
            (Faces::Both, true),
            (Faces::Front, false),
            (Faces::Both, false),
        ] {
            let settings = VoxelSettings {
                coverage,
                faces: Some(faces),
                ..voxel_settings(resolution, Method::Compute)
            };
            let read = voxelize(&gpu, &gpu_scene, settings);
            let words = read_words(&gpu, read.voxels.faces.as_ref().unwrap());
            let mut packed: Vec<[u32; 2]> = words
                .chunks_exact(2)
                .map(|pair| [pair[0], pair[1]])
                .take(read.records.len())
                .collect();
            let sums = oracle::voxelize(&scene, &oracle_grid(&read.voxels.grid));
            compare_opacities(&packed, &read, &sums, settings)
                .unwrap_or_else(|error| panic!("{name}, {faces:?}, coverage {coverage}: {error}"));
            // Planted: each voxel has the opacities of the one before.
            packed.rotate_right(1);
            assert!(
                compare_opacities(&packed, &read, &sums, settings).is_err(),
                "{name}"
            );
        }
    }
}

/// Voxels lit as two sides, and as six faces in a dense volume and one by one: a face has its own
/// opacity and the radiance of the side that it is on.
#[test]
fn faces_have_the_light_of_their_side() {
    let gpu = gpu();
    for name in ["cornell", "two-rooms", "cornell-lamp"] {
        let scene = bundled(name);
        let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
        gpu_scene
            .set_frame(&gpu, &gpu_scene.frame_constants(&scene.camera, [8, 8]))
            .unwrap();
        let settings = VoxelSettings {
            faces: Some(Faces::Both),
            ..voxel_settings(32, Method::Compute)
        };
        let read = voxelize(&gpu, &gpu_scene, settings);
        let maps = LightMaps::new(&gpu, &gpu_scene, 256, false).unwrap();
        let sides = LightSettings::direct(Injection::Voxel, Sides::Two);
        let lit = |light: &VoxelLight, dense: Option<&Arc<Image>>| {
            let mut frame = Frame::new();
            frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
            maps.draw(&mut frame, &gpu_scene);
            let dense = dense.map(|radiance| DenseTexels {
                radiance,
                normals: None,
            });
            light.update(&mut frame, &read.voxels, &maps, dense);
            gpu.submit(frame).unwrap();
            let halves: Vec<[u16; 4]> =
                bytemuck::pod_collect_to_vec(&gpu.read_buffer(&light.radiance).unwrap());
            halves
                .into_iter()
                .map(|texel| DVec4::from(texel.map(half)))
                .collect::<Vec<_>>()
        };
        let light = |settings| VoxelLight::new(&gpu, &gpu_scene, &read.voxels, settings).unwrap();
        let two = lit(&light(sides), None);
        let six = lit(
            &light(LightSettings {
                stores_faces: true,
                ..sides
            }),
            None,
        );
        let volume = radiance_image(&gpu, "volume", 32, 6, 1).unwrap();
        assert!(
            lit(&light(sides), Some(&volume)) == two,
            "{name}: the sides are lit as without faces"
        );
        let dense = &read_faces(&gpu, &volume)[0];
        let words = read_words(&gpu, read.voxels.faces.as_ref().unwrap());
        let mut bright = 0;
        for (slot, record) in read.records.iter().enumerate() {
            let front = front(record);
            for face in 0..6 {
                let (axis, is_against) = (face / 2, face % 2);
                let opacity = unorm10(words[2 * slot + is_against])[axis];
                let towards = if is_against == 0 {
                    front[axis]
                } else {
                    -front[axis]
                };
                let [ahead, behind] = [two[2 * slot], two[2 * slot + 1]].map(DVec4::truncate);
                let expected = if towards == 0.0 {
                    0.5 * (ahead + behind)
                } else if towards > 0.0 {
                    ahead
                } else {
                    behind
                };
                let off = |seen: DVec4, expected: DVec4| {
                    (seen - expected).abs().largest() / (expected.largest() + 1e-3)
                };
                let [stored, texel] =
                    [six[6 * slot + face], dense[face].texel(coordinates(record))];
                let apart = off(stored, expected.extend(opacity))
                    .max(off(texel, (expected * opacity).extend(opacity)));
                assert!(
                    apart <= 2e-3,
                    "{name}, face {face} of {:?}: {stored} and {texel} for {expected}, {opacity}",
                    coordinates(record)
                );
                bright += usize::from(expected.largest() > 0.0 && ahead != behind && opacity > 0.0);
            }
        }
        println!(
            "{name}: {bright} lit faces of {} voxels",
            read.records.len()
        );
        assert!(bright > 50, "{name}: {bright} faces only");
    }
}

/// The octree's bricks hold what the dense texels hold: the pictures are the same but for rounding.
#[test]
fn bricks_of_faces_are_the_dense_texels() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let indirect = |technique: &str, pairs: &[(&str, &str)]| {
        let case = Case {
            entry: find(technique).unwrap(),
            preset: Some("cones"),
        };
        let pairs: Vec<(&str, &str)> = [("resolution", "64"), ("aperture_scale", "0.3")]
            .into_iter()
            .chain(pairs.iter().copied())
            .collect();
        shoot(&gpu, &scene, &case, &pairs, frame(64, 48, 512))
            .unwrap()
            .indirect
    };
    let isotropic = indirect("voxel-mips", &[]);
    for pairs in [
        &[("anisotropic", "on")][..],
        &[("faces", "front")],
        &[("faces", "both"), ("opacity", "coverage"), ("bounces", "2")],
    ] {
        let dense = indirect("voxel-mips", pairs);
        let error = |image| {
            compare(image, &dense, None, Channel::Rgb)
                .unwrap()
                .pixel
                .rel_rmse
        };
        // A clipmap of one level is a dense grid.
        let one_level: Vec<_> = [("levels", "1")]
            .into_iter()
            .chain(pairs.iter().copied())
            .collect();
        let (sparse, nested, isotropic) = (
            error(&indirect("svo", pairs)),
            error(&indirect("clipmap", &one_level)),
            error(&isotropic),
        );
        println!(
            "{pairs:?}: octree and mips are {sparse:.5} apart, clipmap and mips {nested:.5}, \
             isotropic voxels {isotropic:.3}"
        );
        assert!(
            sparse <= 0.01 && nested <= 0.02 && isotropic > 3.0 * sparse.max(nested),
            "{pairs:?}: {sparse}, {nested}, {isotropic}"
        );
    }
}
