//! Texels that shine by their normals, in every voxel structure.

use std::sync::Arc;

use glam::{DVec4, EulerRot, IVec3, Quat, Vec3};
use lumivox::gi::registry::find;
use lumivox::gi::shared::cone::FaceWeights;
use lumivox::gi::shared::cone::oracle::{Volume, luminance};
use lumivox::gi::shared::voxel::build::passes::Voxel;
use lumivox::gi::shared::voxel::{
    DenseTexels, Directionality, Injection, LightSettings, Method, NormalLobe, Prefilter, Sides,
    VoxelBox, VoxelLight,
};
use lumivox::gi::voxel_cones::clipmap::{ClipmapVolume, Inner, Layout};
use lumivox::gi::voxel_cones::mips::radiance_image;
use lumivox::graph::{Bound, Frame, Gpu, Image};
use lumivox::render::{GpuScene, LightMaps};
use lumivox::scene::Scene;

use crate::support::compare::{Largest, larger};
use crate::support::scenes::{add_model, bundled, cuboid, scene_of, still};
use crate::support::structures::Structure;
use crate::support::technique::{Case, Surfaces, frame, shoot, small_lights, small_room};
use crate::support::voxels::{
    coordinates, front, half, is_opposed, mean_normal, voxel_settings, voxelize,
};
use crate::support::walker::Walker;
use crate::support::{Random, gpu};

const TECHNIQUES: [&str; 3] = ["voxel-mips", "svo", "clipmap"];

/// Largest difference of two volumes, in half-float steps of the light in each texel.
fn steps(seen: &Volume, expected: &Volume, light: &Volume) -> f64 {
    let texels = seen.texels.iter().zip(&expected.texels).zip(&light.texels);
    texels.fold(0.0, |worst, ((seen, expected), light)| {
        let step = light.largest() * 2f64.powi(-11) + 2f64.powi(-25);
        larger(worst, (*seen - *expected).abs().largest() / step)
    })
}

/// A technique in a room, lit, with all of its settings but these as its cones have them.
fn lit<'g>(gpu: &'g Gpu, scene: &Scene, technique: &str, pairs: &[&str]) -> Walker<'g> {
    let entry = find(technique).unwrap();
    let pairs = [&["resolution=32", "normals=toksvig"], pairs].concat();
    let settings = entry.settings(Some("cones"), &pairs).unwrap();
    let mut walker = Walker::new(gpu, scene, entry, &settings, scene.camera.eye);
    walker.texels(scene.camera.eye);
    walker
}

/// The octree's bricks are compared with their oracle elsewhere; dense mips hold the same.
#[test]
fn dense_texels_are_those_of_bricks() {
    let gpu = gpu();
    for (case, surfaces) in Surfaces::ALL.into_iter().enumerate() {
        let scene = small_room(surfaces, vec![small_lights()[case % 3].1]);
        let filter = ["mip_filter=box", "mip_filter=directional"][case % 2];
        let [dense, bricks] = ["voxel-mips", "svo"].map(|technique| {
            let walker = lit(&gpu, &scene, technique, &[filter]);
            let volume = walker.technique.volumes().swap_remove(0).volume;
            match Structure::read(&gpu, volume, 32, FaceWeights::Extinction, None) {
                Structure::Chain(light, normals, ..) => [light, normals],
                _ => panic!("{technique} has one texel for all directions"),
            }
        });
        for (kind, name) in ["light", "normals"].into_iter().enumerate() {
            // The coarsest mip of the dense texture has no tile.
            assert!(bricks[kind].len() >= 4 && dense[kind].len() > bricks[kind].len());
            let levels = dense[kind].iter().zip(&bricks[kind]).zip(&bricks[0]);
            let worst = levels.fold(0.0, |worst, ((dense, bricks), light)| {
                larger(worst, steps(dense, bricks, light))
            });
            let lit = bricks[kind][0]
                .texels
                .iter()
                .filter(|texel| texel.x != 0.0)
                .count();
            println!(
                "{surfaces:?}, {filter}, {name}: {worst:.2} half-float steps, {lit} lit texels"
            );
            assert!(
                worst <= 4.0 && lit > 50,
                "{surfaces:?}, {name}: {worst}, {lit}"
            );
        }
    }
}

/// Where each voxel's finest texel is in an image of n³ texels, or of those of a clipmap's level.
fn texel_of(record: &Voxel, first: IVec3, layer: i32, n: i32) -> usize {
    let at = first + IVec3::from(coordinates(record).map(|at| at as i32));
    let at = at.rem_euclid(IVec3::splat(n));
    (at.x + n * (at.y + n * (at.z + layer))) as usize
}

/// The finest texels of a dense volume and of a clipmap are both sides of voxels together, and what
/// leaves them along their normals.
#[test]
fn finest_texels_are_both_sides_and_their_normals() {
    let gpu = gpu();
    for (case, surfaces) in Surfaces::ALL.into_iter().enumerate() {
        let mut scene = small_room(surfaces, small_lights().map(|(_, light)| light).to_vec());
        // All sides of bars are in one voxel: opposed, and not parallel.
        let bars: Vec<_> = [0.3, 1.1, 2.0]
            .into_iter()
            .flat_map(|turn| {
                let middle = Vec3::new(0.0, 0.6 + 0.3 * turn, 0.1);
                let turn = Quat::from_euler(EulerRot::YXZ, turn, 0.4, 0.2);
                cuboid(middle, Vec3::new(0.5, 0.008, 0.012), turn)
            })
            .collect();
        let bars = scene_of(&bars, 0.0, &mut Random::new(case as u64));
        add_model(&mut scene, bars, &[still(Vec3::ZERO)]);
        let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
        let constants = gpu_scene.frame_constants(&scene.camera, [8, 8]);
        gpu_scene.set_frame(&gpu, &constants).unwrap();
        let read = voxelize(&gpu, &gpu_scene, voxel_settings(32, Method::Compute));
        let maps = LightMaps::new(&gpu, &gpu_scene, 256, true).unwrap();
        let injection = [Injection::Rsm, Injection::Voxel][case % 2];
        let settings = LightSettings::direct(injection, Sides::Two);
        let light = VoxelLight::new(&gpu, &gpu_scene, &read.voxels, settings).unwrap();
        let layout = Layout::new(gpu_scene.bounds, 32, 1, 0.0);
        let texels = (Directionality::Isotropic, Some(NormalLobe::Toksvig));
        let clipmap = ClipmapVolume::new(&gpu, layout, Prefilter::Box, texels).unwrap();
        let dense = ["light", "normals"].map(|name| radiance_image(&gpu, name, 32, 1, 1).unwrap());
        let mut frame = Frame::new();
        frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
        maps.draw(&mut frame, &gpu_scene);
        let written = DenseTexels {
            radiance: &dense[0],
            normals: Some(&dense[1]),
        };
        light.update(&mut frame, &read.voxels, &maps, Some(written));
        let first = read.voxels.lattice.first;
        let all = VoxelBox::cube(first, 32);
        clipmap.write_voxels(&mut frame, 0, all, &Inner::NONE, &read.voxels, &light);
        gpu.submit(frame).unwrap();
        let halves = |bytes: Vec<u8>| -> Vec<DVec4> {
            let words: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&bytes);
            words
                .into_iter()
                .map(|texel| DVec4::from(texel.map(half)))
                .collect()
        };
        let texels = |image: &Arc<Image>| halves(gpu.read_image(image, 0, 0).unwrap());
        let bound = clipmap.as_volume(layout.places(scene.camera.eye)[0]).bound;
        let levels = [1, 4].map(|index| match bound[index] {
            Some((_, Bound::Image(image))) => texels(image),
            _ => panic!("binding {index} is no image"),
        });
        let (dense, sides) = (
            dense.each_ref().map(texels),
            halves(gpu.read_buffer(&light.radiance).unwrap()),
        );
        let (mut worst, mut two_sided, mut opposed) = (0.0, 0, 0);
        for (index, record) in read.records.iter().enumerate() {
            let [ahead, behind] = [0, 1].map(|side| sides[2 * index + side].truncate());
            let opacity = sides[2 * index].w;
            let normal = if is_opposed(record) {
                front(record)
            } else {
                mean_normal(record)
            };
            let both = ahead + behind;
            let expected = [both, luminance(ahead - behind) * normal]
                .map(|seen| (opacity * seen).extend(opacity));
            let [in_dense, in_level] = [(IVec3::ZERO, 0), (first, 1)]
                .map(|(first, layer)| texel_of(record, first, layer, 32));
            for kind in [0, 1] {
                for seen in [dense[kind][in_dense], levels[kind][in_level]] {
                    let off = (seen - expected[kind]).abs();
                    let of_light = off.truncate().largest() / (both.largest() + 1e-3);
                    worst = larger(worst, of_light.max(off.w));
                }
            }
            two_sided += usize::from(ahead.x > 0.0 && behind.x > 0.0);
            let is_one_plane = mean_normal(record).length_squared() >= 0.9;
            opposed += usize::from(is_opposed(record) && !is_one_plane);
        }
        let count = read.records.len();
        println!(
            "{surfaces:?}: {worst:.1e} off; of {count} voxels {two_sided} are lit from both sides, \
             {opposed} are opposed and of several planes"
        );
        assert!(worst < 2e-3, "{surfaces:?}: {worst}");
        assert!(
            two_sided > 0 && opposed > 0,
            "{surfaces:?}: nothing to tell apart"
        );
    }
}

/// A room behind a thin wall sees the wall's dark side. If that side also held the other side's
/// light, light would leak. The lit room stays as bright as it was.
#[test]
fn lit_normals_keep_the_other_side_dark() {
    let gpu = gpu();
    let dark = bundled("two-rooms,thickness_m=0.05");
    let lit = Scene {
        camera: bundled("cornell").camera,
        ..bundled("cornell")
    };
    for technique in TECHNIQUES {
        let mean = |scene: &Scene, normals: &str| {
            let case = Case {
                entry: find(technique).unwrap(),
                preset: Some("cones"),
            };
            let pairs = [("resolution", "32"), ("normals", normals)];
            let picture = shoot(&gpu, scene, &case, &pairs, frame(48, 32, 256)).unwrap();
            let pixels = picture.indirect.pixels;
            let sum: f64 = pixels.iter().map(|pixel| luminance(pixel.as_dvec3())).sum();
            sum / pixels.len() as f64
        };
        let lobes = ["off", "toksvig", "harmonics"];
        let [dark, lit] = [&dark, &lit].map(|scene| lobes.map(|normals| mean(scene, normals)));
        println!("{technique}: dark room {dark:.4?}, lit box {lit:.4?}, by {lobes:?}");
        for lobe in [1, 2] {
            assert!(dark[lobe] < 0.25 * dark[0], "{technique}: {dark:?}");
            assert!(
                (lit[lobe] / lit[0] - 1.0).abs() < 0.2,
                "{technique}: {lit:?}"
            );
        }
    }
}
