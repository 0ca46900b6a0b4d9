//! Clipmaps: windows that move over the scene against windows made where they are, and the texels
//! of all levels likewise.

use std::sync::Arc;

use crate::support::compare::{Largest, exceeds, larger};
use crate::support::gather::{View, pixel_rays, read_faces};
use crate::support::scenes::{Corners, add_model, lump, random_pose, scene_of, soup, still};
use crate::support::technique::{Surfaces, small_lights, small_room};
use crate::support::voxels::{Read, compare_sets, half, oracle_grid, read, voxel_settings};
use crate::support::walker::Walker;
use crate::support::{Random, gpu};
use glam::{DVec3, DVec4, IVec3, Vec3};
use lumivox::gi::Settings;
use lumivox::gi::shared::cone::oracle::Volume;
use lumivox::gi::shared::cone::oracle::structure::{Cell, CellKind, EyeRay, view_structure};
use lumivox::gi::shared::voxel::{
    Interior, Method, Surface, VoxelBox, VoxelSettings, VoxelWindow, WindowMove, WindowScratch,
    move_windows,
};
use lumivox::gi::voxel_cones::clipmap::{self, Layout, Place};
use lumivox::gi::voxel_cones::mips::oracle::{Filter, coarser, coarser_faces};
use lumivox::graph::Bound;
use lumivox::graph::{Frame, Gpu};
use lumivox::render::GpuScene;
use lumivox::scene::{Camera, Scene};

const EDGE: u32 = 16;

/// Triangles of all kinds over four windows' widths, with corners on whole grains.
fn wide_soup(random: &mut Random) -> Scene {
    let grain = |corner: Vec3| (corner * 64.0).round() / 64.0;
    let triangles: Vec<_> = soup(random, 4 * EDGE)
        .into_iter()
        .chain(lump(10, 4 * EDGE))
        .map(|corners| corners.map(grain))
        .collect();
    scene_of(&triangles, 5.0, random)
}

/// What differs between two windows at the same place, down to the order of records.
fn same(a: &Read, b: &Read) -> Result<(), String> {
    if a.occupancy != b.occupancy || a.bases != b.bases {
        return Err("occupancy".into());
    }
    if let Some(index) = (0..a.records.len()).find(|index| a.records[*index] != b.records[*index]) {
        return Err(format!(
            "record {index}: {:?} and {:?}",
            a.records[index], b.records[index]
        ));
    }
    (a.emission == b.emission)
        .then_some(())
        .ok_or_else(|| "emission".into())
}

/// A walk of 1,000 steps, small ones, long ones and jumps farther than the window's edge: after
/// each third, every bit is that of a window voxelized there at once.
#[test]
fn windows_are_those_from_scratch_after_any_walk() {
    let gpu = gpu();
    let mut random = Random::new(2011);
    let scene = wide_soup(&mut random);
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let settings = voxel_settings(EDGE, Method::Compute);
    let anchor = Vec3::new(8.0, -4.0, 16.0);
    let window = || VoxelWindow::new(&gpu, &gpu_scene, settings, (anchor, 1.0), None).unwrap();
    let (mut walker, mut fresh) = (window(), window());
    let mut scratch = WindowScratch::new(&gpu, &gpu_scene).unwrap();
    let (mut first, mut voxels, mut moved) = (IVec3::ZERO, 0, 0);
    for step in 0..1000 {
        let reach = [0, 1, 1, 2, 4, 20][random.below(6) as usize];
        let axis = |random: &mut Random| 4 * (random.below(2 * reach + 1) as i32 - reach as i32);
        first += IVec3::new(axis(&mut random), axis(&mut random), axis(&mut random));
        first = first.clamp(IVec3::splat(-20), IVec3::splat(48));
        let mut go = |window: &mut VoxelWindow, stale: &[VoxelBox]| {
            let window_move = WindowMove {
                window,
                first,
                stale,
                carried: None,
            };
            let (new, _) = move_windows(&gpu, &gpu_scene, &mut scratch, vec![window_move]).unwrap();
            u32::from(!new[0].is_empty())
        };
        moved += go(&mut walker, &[]);
        // What a step leaves wrong stays wrong until it is left behind: every third is looked at.
        if step % 3 != 0 {
            continue;
        }
        let place = VoxelBox::cube(first, EDGE);
        go(&mut fresh, &[place]);
        let (walked, made) = (
            read(&gpu, walker.voxels.clone()),
            read(&gpu, fresh.voxels.clone()),
        );
        same(&walked, &made)
            .unwrap_or_else(|difference| panic!("step {step}, at {first}: {difference}"));
        voxels += walked.records.len();
        if step % 60 == 0 {
            compare_sets(
                &walked.occupied(),
                &scene,
                &oracle_grid(&walked.voxels.grid),
            )
            .unwrap_or_else(|error| panic!("step {step}, at {first}: {error}"));
        }
    }
    println!("{moved} moves, {} voxels a window", voxels / 334);
    assert!(
        moved > 700 && voxels > 334 * 50,
        "the walk sees {moved} moves and {voxels} voxels"
    );
    // A record that is left as it was, or lost, is noticed.
    let mut changed = read(&gpu, walker.voxels.clone());
    changed.records[0].albedo ^= 1;
    assert!(same(&changed, &read(&gpu, fresh.voxels.clone())).is_err());
}

/// The same of solid voxels, of bodies that reach out of windows and of some that are in one whole.
#[test]
fn solid_windows_are_those_from_scratch_after_a_walk() {
    let gpu = gpu();
    let mut random = Random::new(61);
    let mut triangles = Vec::new();
    for (scale, shift) in [(1.0, Vec3::ZERO), (0.3, Vec3::new(20.0, 4.0, -9.0))] {
        let placed = |triangle: Corners| {
            let [a, b, c] = triangle.map(|corner| scale * corner + shift);
            [a, c, b]
        };
        triangles.extend(lump(8, 40).into_iter().map(placed));
    }
    let scene = scene_of(&triangles, 0.0, &mut random);
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let settings = VoxelSettings {
        surface: Surface::Solid,
        ..voxel_settings(EDGE, Method::Compute)
    };
    let interior = Interior::new(&gpu, &gpu_scene).unwrap();
    let anchor = Vec3::new(8.0, -4.0, 16.0);
    let window = || {
        let interior = Some(Arc::clone(&interior));
        VoxelWindow::new(&gpu, &gpu_scene, settings, (anchor, 1.0), interior).unwrap()
    };
    let (mut walker, mut fresh) = (window(), window());
    let mut scratch = WindowScratch::new(&gpu, &gpu_scene).unwrap();
    let (mut first, mut inside) = (IVec3::ZERO, 0);
    for step in 0..90 {
        let axis = |random: &mut Random| 4 * (random.below(5) as i32 - 2);
        first += IVec3::new(axis(&mut random), axis(&mut random), axis(&mut random));
        first = first.clamp(IVec3::splat(-12), IVec3::splat(28));
        let place = VoxelBox::cube(first, EDGE);
        for (window, stale) in [(&mut walker, &[][..]), (&mut fresh, &[place])] {
            let window_move = WindowMove {
                window,
                first,
                stale,
                carried: None,
            };
            move_windows(&gpu, &gpu_scene, &mut scratch, vec![window_move]).unwrap();
        }
        let [walked, made] = [&walker, &fresh].map(|window| read(&gpu, window.voxels.clone()));
        same(&walked, &made)
            .unwrap_or_else(|difference| panic!("step {step}, at {first}: {difference}"));
        let black = walked.records.iter().filter(|record| record.albedo == 0);
        inside += black.count();
    }
    println!("{} voxels inside on average", inside / 90);
    assert!(inside > 90 * 100, "{inside}");
}

fn clipmap_in<'g>(gpu: &'g Gpu, scene: &Scene, settings: &Settings, eye: Vec3) -> Walker<'g> {
    Walker::new(gpu, scene, &clipmap::ENTRY, settings, eye)
}

fn settings(pairs: &[&str]) -> Settings {
    // Patches would have all levels lit in each frame.
    let pairs = [&["emitters=gather"], pairs].concat();
    clipmap::ENTRY.settings(Some("cones"), &pairs).unwrap()
}

/// Wherever the camera goes and whatever moves, every texel is that of a clipmap built there.
#[test]
fn texels_are_those_from_scratch_after_any_walk() {
    let gpu = gpu();
    for (case, (pairs, is_still)) in [
        (&["resolution=16", "levels=4"] as &[&str], false),
        (
            &[
                "resolution=16",
                "levels=3",
                "injection=voxel",
                "bounces=2",
                "opacity=coverage",
            ],
            false,
        ),
        (
            &[
                "resolution=32",
                "levels=2",
                "voxel_size=0.03125",
                "mip_filter=box",
            ],
            false,
        ),
        (&["resolution=16", "levels=4"], true),
        (&["resolution=16", "levels=3", "bounces=2"], true),
        (
            &[
                "resolution=16",
                "levels=3",
                "anisotropic=on",
                "voxel_size=0.05",
            ],
            false,
        ),
        (
            &["resolution=16", "levels=3", "faces=both", "bounces=2"],
            false,
        ),
        (
            &[
                "resolution=16",
                "levels=4",
                "faces=front",
                "opacity=coverage",
            ],
            true,
        ),
        (&["resolution=32", "levels=3"], true),
        (
            &["resolution=16", "levels=3", "normals=toksvig", "bounces=2"],
            false,
        ),
        (&["resolution=16", "levels=4", "normals=harmonics"], true),
        (
            &[
                "resolution=32",
                "levels=3",
                "faces=both",
                "injection=voxel",
                "voxel_occlusion=shadow-map-area",
            ],
            true,
        ),
        (
            &[
                "resolution=32",
                "levels=3",
                "faces=both",
                "injection=voxel",
                "voxel_occlusion=rays-hard",
            ],
            true,
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let mut random = Random::new(case as u64);
        let mut scene = small_room(
            Surfaces::ALL[(case + 1) % 4],
            vec![small_lights()[case % 3].1],
        );
        let model = scene_of(
            &[
                [Vec3::ZERO, 0.4 * Vec3::X, 0.5 * Vec3::Y],
                [Vec3::ZERO, 0.4 * Vec3::Z, 0.5 * Vec3::Y],
            ],
            2.0,
            &mut random,
        );
        let poses: Vec<_> = (0..6)
            .map(|_| random_pose(&mut random, 1.0))
            .chain([still(Vec3::splat(9.0))])
            .collect();
        add_model(&mut scene, model, &poses);
        let settings = settings(pairs);
        let mut eye = Vec3::new(0.0, 1.0, 0.0);
        let mut walker = clipmap_in(&gpu, &scene, &settings, eye);
        walker.is_still = is_still;
        let mut holes = [0; 2];
        for step in 0..24u8 {
            if step % 3 == 2 {
                walker.set_time(f32::from(step / 3), eye);
                scene.set_time(f32::from(step / 3));
            }
            let reach = if step % 5 == 4 { 3.0 } else { 0.3 };
            eye = (eye + reach * (Vec3::new(random.unit(), random.unit(), random.unit()) - 0.5))
                .clamp(Vec3::new(-1.5, -0.5, -1.5), Vec3::new(1.5, 2.5, 1.5));
            let walked = walker.texels(eye);
            if step % 4 != 3 {
                continue;
            }
            let mut made = clipmap_in(&gpu, &scene, &settings, eye);
            let fresh = made.texels(eye);
            for (holes, walker) in holes.iter_mut().zip([&walker, &made]) {
                *holes += walker.count("rsm_holes_filled");
            }
            assert!(walked == fresh, "{pairs:?}, step {step}, at {eye}");
            if is_still {
                assert!(
                    walker.texels(eye) == fresh,
                    "{pairs:?}, step {step}, at {eye}, once more"
                );
                assert!(
                    walker.passes == 0,
                    "{pairs:?}, step {step}: {} passes where nothing has changed",
                    walker.passes
                );
            }
            assert!(
                walked[0].iter().any(|byte| *byte != 0),
                "{pairs:?}: nothing is lit"
            );
        }
        let [walked, made] = holes;
        println!("{pairs:?}: {walked} holes filled, {made} in clipmaps made there");
        // Holes are counted where voxels are lit: of slabs fewer than of whole levels.
        let lights_slabs = is_still && !pairs.contains(&"bounces=2");
        assert!(
            made == 0 || (walked < made) == lights_slabs,
            "{pairs:?}: {walked} and {made}"
        );
    }
}

/// With staggered levels the camera sees no level in two places: after as many frames as the
/// outermost needs, all is as from scratch.
#[test]
fn staggered_levels_catch_up() {
    let gpu = gpu();
    let scene = small_room(Surfaces::Diffuse, vec![small_lights()[0].1]);
    for is_still in [false, true] {
        let [staggered, every] = ["level_updates=staggered", "level_updates=every-frame"]
            .map(|how| settings(&["resolution=16", "levels=4", how]));
        catch_up(&gpu, &scene, (&staggered, &every), is_still);
    }
}

fn catch_up(gpu: &Gpu, scene: &Scene, (staggered, every): (&Settings, &Settings), is_still: bool) {
    let mut walker = clipmap_in(gpu, scene, staggered, Vec3::new(0.0, 1.0, 0.0));
    walker.is_still = is_still;
    let mut random = Random::new(5);
    for walk in 0..4 {
        for _ in 0..5 {
            let eye = Vec3::new(
                2.0 * random.unit() - 1.0,
                2.0 * random.unit(),
                2.0 * random.unit() - 1.0,
            );
            walker.texels(eye);
        }
        let eye = Vec3::new(0.3 * walk as f32 - 0.4, 1.1, 0.2);
        let mut last = Vec::new();
        for _ in 0..8 {
            last = walker.texels(eye);
        }
        assert!(
            last == clipmap_in(gpu, scene, every, eye).texels(eye),
            "walk {walk}"
        );
    }
}

/// The texels of the levels as they were read back.
struct Levels {
    n: u32,
    /// 1, or 6.
    faces: u32,
    halves: Vec<[u16; 4]>,
}

impl Levels {
    /// One face of a cube of texels of a level.
    fn cube(&self, face: u32, level: u32, first: IVec3, edge: u32) -> Volume {
        let n = self.n;
        let (height, row) = if self.faces == 6 {
            (6 * (n + 2), face * (n + 2) + 1)
        } else {
            (n, 0)
        };
        Volume::new(edge, |at| {
            let texel = (first + IVec3::from(at.map(|at| at as i32)))
                .rem_euclid(IVec3::splat(n as i32))
                .as_uvec3();
            let layer = level * (n + 2) + 1 + texel.z;
            DVec4::from(
                self.halves[(texel.x + n * (row + texel.y + height * layer)) as usize].map(half),
            )
        })
    }
}

/// A camera for which the level above `level` holds `inner` with its own voxels alone.
fn aside(layout: &Layout, eye: Vec3, level: u32, inner: VoxelBox) -> Vec3 {
    let axes = [
        Vec3::X,
        Vec3::NEG_X,
        Vec3::Y,
        Vec3::NEG_Y,
        Vec3::Z,
        Vec3::NEG_Z,
    ];
    let mut eyes = (1u8..200).flat_map(|step| axes.map(|axis| eye + 0.02 * f32::from(step) * axis));
    let is_aside = |eye: &Vec3| {
        let places = layout.places(*eye);
        let [finer, own] = [level, level + 1].map(|level| places[level as usize]);
        layout.inner(finer).region().cut(inner).is_empty()
            && VoxelBox::cube(own.first, layout.resolution).cut(inner) == inner
    };
    eyes.find(is_aside).unwrap()
}

/// Where a finer level lies, and above the outermost, texels are the oracle's of the finer ones,
/// with faces and without; towards the end of the finer level mixed with those that are there when
/// it is somewhere else.
#[test]
fn coarser_texels_are_the_oracles() {
    let gpu = gpu();
    let (n, levels) = (32, 3);
    let scene = small_room(Surfaces::Emissive, vec![small_lights()[0].1]);
    for (pairs, first_six) in [
        (&["mip_filter=box"][..], None),
        (&["anisotropic=on"], Some(1)),
        (&["faces=both"], Some(0)),
    ] {
        let pairs = [&["resolution=32", "levels=3", "voxel_size=0.02"][..], pairs].concat();
        let mut walker = clipmap_in(&gpu, &scene, &settings(&pairs), Vec3::ONE);
        // At the ends of the room, so that levels have somewhere else to go.
        for eye in [Vec3::new(-2.0, 1.0, 0.0), Vec3::new(0.3, 3.0, 2.0)] {
            let texels = walker.texels(eye);
            let layout = Layout::new(walker.gpu_scene.bounds, n, levels, 0.02);
            let places = layout.places(eye);
            assert_eq!(layout.levels, levels);
            let read = Levels {
                n,
                faces: if first_six.is_some() { 6 } else { 1 },
                halves: bytemuck::pod_collect_to_vec(&texels[0]),
            };
            let faces_of = |read: &Levels, level: u32, first: IVec3, edge: u32| -> [Volume; 6] {
                std::array::from_fn(|face| {
                    read.cube(
                        if first_six.is_some_and(|six| level >= six) {
                            face as u32
                        } else {
                            0
                        },
                        level,
                        first,
                        edge,
                    )
                })
            };
            let faces = |level, first, edge| faces_of(&read, level, first, edge);
            let volumes = walker.technique.volumes();
            let Some((_, Bound::Image(top))) = volumes[0].volume.bound[2] else {
                panic!("a clipmap's volume is not one")
            };

            let (mut worst, mut lit) = (0.0f64, 0);
            for level in 0..levels {
                let first = places[level as usize].first;
                let mixed = layout.inner(places[level as usize]);
                let edge = if level + 1 < levels {
                    mixed.region().size().max_element() as u32
                } else {
                    n / 2
                };
                let inner = VoxelBox::cube(
                    if level + 1 < levels {
                        mixed.region().low
                    } else {
                        first / 2
                    },
                    edge,
                );
                let finer = faces(level, 2 * inner.low, 2 * edge);
                let mut expected = if first_six.is_some() {
                    coarser_faces(finer.each_ref())
                } else {
                    [0; 6].map(|_: u8| coarser(&finer[0], Filter::Box))
                };
                if level + 1 < levels {
                    let elsewhere = clipmap_in(&gpu, &scene, &settings(&pairs), Vec3::ONE)
                        .texels(aside(&layout, eye, level, inner));
                    let own = faces_of(
                        &Levels {
                            halves: bytemuck::pod_collect_to_vec(&elsewhere[0]),
                            ..read
                        },
                        level + 1,
                        inner.low,
                        edge,
                    );
                    for (expected, own) in expected.iter_mut().zip(&own) {
                        *expected = Volume::new(edge, |at| {
                            let share =
                                mixed.own_share(inner.low + IVec3::from(at.map(|at| at as i32)));
                            expected.texel(at).lerp(own.texel(at), f64::from(share))
                        });
                    }
                }
                let seen = if level + 1 < levels {
                    faces(level + 1, inner.low, edge)
                } else if first_six.is_some() {
                    read_faces(&gpu, top).swap_remove(0)
                } else {
                    [0; 6].map(|_: u8| crate::support::gather::read_chain(&gpu, top).swap_remove(0))
                };
                for (seen, expected) in seen
                    .iter()
                    .zip(&expected)
                    .flat_map(|(seen, expected)| seen.texels.iter().zip(&expected.texels))
                {
                    let steps = (*seen - *expected).abs()
                        / (expected.abs() * 2f64.powi(-11) + 2f64.powi(-25));
                    worst = larger(worst, steps.largest());
                    lit += usize::from(expected.x > 0.0);
                }
            }
            println!("{pairs:?}: {worst:.2} half-float steps off the oracle, {lit} lit texels");
            assert!(worst <= 2.1 && lit > 200, "{pairs:?}: {worst}, {lit}");
        }
    }
}

/// The level that a position (m) is read from, with how far it has faded into the next.
fn faded_level(layout: &Layout, places: &[Place], at: DVec3) -> f64 {
    let n = f64::from(layout.resolution);
    let share = |level: u32| {
        let size = f64::from(layout.size_of(level));
        let from_middle =
            (at - layout.anchor.as_dvec3()) / size - places[level as usize].middle.as_dvec3();
        ((n / 2.0 - 3.0 - from_middle.abs().largest()) * 16.0 / n).clamp(0.0, 1.0)
    };
    let coarsest = layout.levels - 1;
    (0..coarsest)
        .find(|level| share(*level) > 0.0)
        .map_or(f64::from(coarsest), |level| {
            f64::from(level) + 1.0 - share(level)
        })
}

/// Cells, and the borders in which levels fade, for cameras in several places.
#[test]
fn levels_look_as_the_oracle_has_them() {
    let gpu = gpu();
    let (n, levels) = (32, 3);
    let scene = small_room(Surfaces::Emissive, vec![small_lights()[0].1]);
    let mut walker = Walker::new(
        &gpu,
        &scene,
        &clipmap::ENTRY,
        &settings(&["resolution=32", "levels=3", "voxel_size=0.02"]),
        Vec3::ONE,
    );
    let size = [64, 48];
    for (eye, level) in [
        (Vec3::new(0.0, 1.0, 0.0), 0),
        (Vec3::new(-0.5, 0.7, 0.5), 0),
        (Vec3::new(-0.5, 0.7, 0.5), 1),
    ] {
        let texels = walker.texels(eye);
        let layout = Layout::new(walker.gpu_scene.bounds, n, levels, 0.02);
        let places = layout.places(eye);
        let outermost = places[levels as usize - 1].first;
        let grid = layout.grid(outermost);
        let read = Levels {
            n,
            faces: 1,
            halves: bytemuck::pod_collect_to_vec(&texels[0]),
        };
        let camera = Camera {
            eye,
            target: eye + Vec3::new(0.6, -0.4, -0.5),
            ..scene.camera
        };
        let view = View::new(&gpu, &walker.gpu_scene, &camera, size, &grid);
        let mut frame = Frame::new();
        frame.set_scene(&walker.gpu_scene.set, &walker.gpu_scene.materials);
        walker.technique.volumes()[0].view_structure(&mut frame, level, &view.result);
        gpu.submit(frame).unwrap();
        let seen: Vec<[f32; 4]> =
            bytemuck::pod_collect_to_vec(&gpu.read_image(&view.result, 0, 0).unwrap());
        let world = |at: DVec3| grid.origin.as_dvec3() + f64::from(grid.voxel_size) * at;
        let read_at = |at: DVec3| faded_level(&layout, &places, world(at)).max(f64::from(level));
        let cell_at = |at: DVec3| {
            let own = read_at(at).ceil() as u32;
            let first = (at / f64::from(1 << own)).floor().as_ivec3()
                + (outermost << (levels - 1 - own) as i32);
            let is_full = read.cube(0, own, first, 1).texels[0].w > 0.0;
            Cell {
                edge: f64::from(1 << own),
                kind: if is_full {
                    CellKind::Solid
                } else {
                    CellKind::Hollow
                },
            }
        };
        let constants = walker.gpu_scene.frame_constants(&camera, size);
        let up = Vec3::new(
            constants.ray_up[0],
            constants.ray_up[1],
            constants.ray_up[2],
        );
        let (origin, pixel) = (
            (eye - grid.origin).as_dvec3() / f64::from(grid.voxel_size),
            2.0 * f64::from(up.length()) / f64::from(size[1]),
        );
        let ray = |direction| EyeRay {
            origin,
            direction,
            pixel,
        };
        let expected = pixel_rays(&constants, size).map(|direction| {
            view_structure(
                cell_at,
                |at, _| read_at(at),
                f64::from(grid.resolution),
                level,
                ray(direction),
            )
        });
        let expected: Vec<DVec4> = expected.collect();
        let differs = |seen: &[f32; 4], expected: &DVec4| {
            exceeds(
                (DVec4::from(seen.map(f64::from)) - *expected)
                    .abs()
                    .largest(),
                0.01,
            )
        };
        let share = seen
            .iter()
            .zip(&expected)
            .filter(|(seen, expected)| differs(seen, expected))
            .count() as f64
            / expected.len() as f64;
        let fading = expected
            .iter()
            .filter(|texel| texel.truncate().min_element() > 0.2)
            .count();
        println!(
            "{eye}, level {level}: {share:.4} of the pixels differ, {fading} are where a level \
             fades"
        );
        assert!(
            share < 0.03 && fading > 100,
            "{eye}, level {level}: {share} differ, {fading} fade"
        );
        let turned = seen
            .iter()
            .skip(1)
            .zip(&expected)
            .filter(|(seen, expected)| differs(seen, expected))
            .count() as f64
            / expected.len() as f64;
        assert!(turned > 0.1, "a shift by a pixel is not noticed");
    }
}
