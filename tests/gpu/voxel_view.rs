//! Looking at voxels: the octree's bricks of albedo, normal and emission, and the volumes that
//! techniques keep as the camera sees them.

use crate::support::compare::{Largest, Worst, exceeds};
use std::collections::BTreeSet;
use std::sync::Arc;

use crate::support::gather::{
    View, matter, occupied, pixel_rays, random_volume, read_chain, volume,
};
use crate::support::octree::{grow, lattice, read_nodes, read_texels};
use crate::support::scenes::{add_model, bundled, in_unit_grid, lump, scene_of, soup, still};
use crate::support::technique::{Case, frame};
use crate::support::voxels::{coordinates, mean_normal, unorm10, voxel_settings, voxelize};
use crate::support::{Random, gpu};
use glam::{DVec3, DVec4, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::registry::find;
use lumivox::gi::shared::cone::oracle::structure::{Cell, CellKind, EyeRay, view_structure};
use lumivox::gi::shared::cone::oracle::{self, view_cells};
use lumivox::gi::shared::cone::{self, VoxelVolume};
use lumivox::gi::shared::voxel::build::passes::Voxel;
use lumivox::gi::shared::voxel::oracle::VoxelIndex;
use lumivox::gi::shared::voxel::{Directionality, Method, VoxelGrid, Voxels};
use lumivox::gi::voxel_cones::mips;
use lumivox::gi::voxel_cones::svo::oracle::{
    Filter, Lattice, Octree, Texels, coarser, leaves, octree,
};
use lumivox::gi::voxel_cones::svo::{
    AttributeBricks, BrickSettings, NodePool, Occupancy, RecordRange,
};
use lumivox::graph::{Frame, Gpu};
use lumivox::image::{Aov, Image};
use lumivox::render::GpuScene;
use lumivox::scene::{Camera, Scene};

const FILTERS: [Filter; 3] = [Filter::Box, Filter::Directional, Filter::DirectionalMax];

/// Albedo, mean normal and emission of voxels as their records have them, premultiplied by opacity.
fn attributes(gpu: &Gpu, voxels: &Voxels) -> [Texels; 3] {
    let records: Vec<Voxel> =
        bytemuck::pod_collect_to_vec(&gpu.read_buffer(&voxels.records).unwrap());
    let emission: Option<Vec<[f32; 4]>> = voxels
        .emission
        .as_ref()
        .map(|emission| bytemuck::pod_collect_to_vec(&gpu.read_buffer(emission).unwrap()));
    let mut attributes: [Texels; 3] = Default::default();
    for (index, record) in records[..voxels.voxel_count as usize].iter().enumerate() {
        let opacity = f64::from(record.coverage & 0xfff) / 4095.0;
        let root = unorm10(record.albedo);
        let emitted = emission.as_ref().map_or(DVec3::ZERO, |emission| {
            Vec3::from_slice(&emission[index]).as_dvec3()
        });
        for (texels, value) in
            attributes
                .iter_mut()
                .zip([root * root, mean_normal(record), emitted])
        {
            texels.insert(coordinates(record), (opacity * value).extend(opacity));
        }
    }
    attributes
}

/// Largest difference of the texels of a level, relative to the largest of them.
fn level_error(level: &Texels, expected: &Texels) -> f64 {
    let places = level.keys().chain(expected.keys());
    let value = |texels: &Texels, at| texels.get(at).copied().unwrap_or_default();
    let largest = expected.values().map(|texel| texel.abs().largest()).worst();
    places
        .map(|at| (value(level, at) - value(expected, at)).abs().largest())
        .worst()
        / largest.max(1e-9)
}

/// Every texel of every level of each attribute, on both lattices, with every filter, with and
/// without emission.
#[test]
fn attribute_bricks_are_the_oracles() {
    let gpu = gpu();
    for seed in 0..12u64 {
        let mut random = Random::new(400 + seed);
        let resolution = [8, 16, 32][seed as usize % 3];
        let emits = seed % 4 < 2;
        let scene = scene_of(
            &soup(&mut random, resolution),
            if emits { 3.0 } else { 0.0 },
            &mut random,
        );
        let mut gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
        in_unit_grid(&mut gpu_scene, resolution);
        let read = voxelize(
            &gpu,
            &gpu_scene,
            voxel_settings(resolution, Method::Compute),
        );
        let settings = BrickSettings {
            corners: seed % 2 == 1,
            filter: seed as u32 / 2 % 3,
            is_split: seed / 3 % 2 == 1,
            touched: true,
            directionality: Directionality::Isotropic,
            lobe: None,
        };
        let (lattice, filter) = (lattice(settings), FILTERS[settings.filter as usize]);
        let (nodes, _) =
            NodePool::build(&gpu, &Occupancy::from(&read.voxels), settings.corners).unwrap();
        let (records, emission) = (
            Arc::clone(&read.voxels.records),
            read.voxels.emission.clone(),
        );
        let range = RecordRange {
            first_voxel: 0,
            voxel_count: read.voxels.voxel_count,
            records,
            emission,
        };
        let (bricks, _) = AttributeBricks::new(&gpu, &nodes, settings, &[range]).unwrap();
        assert_eq!(
            bricks.pools().len(),
            if emits { 3 } else { 2 },
            "a scene that does not emit has no bricks of emission"
        );
        let tree = read_nodes(&gpu, &nodes).unwrap();
        for (pool, voxels) in bricks.pools().iter().zip(attributes(&gpu, &read.voxels)) {
            let levels = read_texels(&gpu, &tree, pool)
                .unwrap_or_else(|error| panic!("soup {seed}, {}: {error}", pool.name()));
            for (index, level) in levels.iter().enumerate() {
                let expected = if index == 0 {
                    leaves(&voxels, lattice)
                } else {
                    coarser(
                        &levels[index - 1],
                        resolution >> (index - 1),
                        lattice,
                        filter,
                    )
                };
                let error = level_error(level, &expected);
                assert!(
                    error < 2e-3,
                    "soup {seed}, {}, level {index}: {error:.1e} of the largest value",
                    pool.name()
                );
                let planted: Texels = expected
                    .iter()
                    .map(|(at, texel)| (*at, 1.01 * *texel))
                    .collect();
                assert!(
                    level_error(level, &planted) > 2e-3,
                    "an error of 1% is not noticed"
                );
            }
        }
    }
}

/// What the camera sees of a volume; RGBA32F.
fn look(
    gpu: &Gpu,
    scene: &GpuScene,
    view: &View,
    volume: &VoxelVolume<'_>,
    level: u32,
) -> Vec<DVec4> {
    let mut frame = Frame::new();
    frame.set_scene(&scene.set, &scene.materials);
    volume.view(&mut frame, level, &view.result);
    finish(gpu, frame, view)
}

/// How the camera sees a volume divide space; RGBA32F.
fn look_at_structure(
    gpu: &Gpu,
    scene: &GpuScene,
    view: &View,
    volume: &VoxelVolume<'_>,
    level: u32,
) -> Vec<DVec4> {
    let mut frame = Frame::new();
    frame.set_scene(&scene.set, &scene.materials);
    volume.view_structure(&mut frame, level, &view.result);
    finish(gpu, frame, view)
}

fn finish(gpu: &Gpu, frame: Frame, view: &View) -> Vec<DVec4> {
    gpu.submit(frame).unwrap();
    let texels: Vec<[f32; 4]> =
        bytemuck::pod_collect_to_vec(&gpu.read_image(&view.result, 0, 0).unwrap());
    texels
        .into_iter()
        .map(|texel| DVec4::from(texel.map(f64::from)))
        .collect()
}

/// Share of pixels that differ.
fn differing(seen: &[DVec4], expected: &[DVec4]) -> f64 {
    let differs = |(seen, expected): &(&DVec4, &DVec4)| {
        exceeds(
            (**seen - **expected).abs().largest(),
            0.01 * expected.largest().max(1.0),
        )
    };
    seen.iter().zip(expected).filter(differs).count() as f64 / seen.len() as f64
}

/// Cells of random matter on each level, from outside and from inside of the grid. A ray that
/// grazes a corner may see either cell there.
#[test]
fn a_level_looks_as_the_oracle_has_it() {
    let gpu = gpu();
    let mut random = Random::new(9);
    let resolution = 16;
    let finest = random_volume(resolution, 0.1, &mut random);
    let image = volume(&gpu, &finest);
    let mut frame = Frame::new();
    crate::support::gather::filter(&gpu, &mut frame, &image, 1);
    gpu.submit(frame).unwrap();
    let chain = read_chain(&gpu, &image);
    let matter = matter(&gpu, &occupied(&finest), resolution);
    let scene = bundled("cornell");
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let grid = VoxelGrid::around(gpu_scene.bounds, resolution);
    let centre = grid.origin + 0.5 * grid.voxel_size * resolution as f32;
    let size = [48, 40];
    for (outside, level) in [(false, 0), (true, 0), (true, 1), (false, 2), (true, 3)] {
        let eye = if outside {
            centre + Vec3::new(1.1, 1.7, 2.3)
        } else {
            centre + Vec3::new(0.13, 0.07, 0.11)
        };
        let camera = Camera {
            eye,
            target: centre + Vec3::new(0.3, 0.2, -0.1),
            ..scene.camera
        };
        let view = View::new(&gpu, &gpu_scene, &camera, size, &grid);
        let dense = VoxelVolume {
            name: "light",
            volume: mips::volume(grid, &image, &matter, None),
            levels: 5,
        };
        let seen = look(&gpu, &gpu_scene, &view, &dense, level);
        let constants = gpu_scene.frame_constants(&camera, size);
        let origin = (eye.as_dvec3() - grid.origin.as_dvec3()) / f64::from(grid.voxel_size);
        let expected: Vec<DVec4> = pixel_rays(&constants, size)
            .map(|ray| {
                view_cells(
                    |at| chain[level as usize].texel(at),
                    resolution,
                    level,
                    origin,
                    ray,
                )
            })
            .collect();
        let share = differing(&seen, &expected);
        println!("level {level}, outside {outside}: {share:.4} of the pixels differ");
        assert!(share < 0.02, "level {level}, outside {outside}: {share}");
        let other = look(&gpu, &gpu_scene, &view, &dense, (level + 1) % 4);
        assert!(
            differing(&other, &expected) > 0.1,
            "another level is not noticed"
        );
    }
}

/// Cells, their edges and the empty nodes of random matter on each level, dense and in both
/// octrees, from outside and from inside of the grid.
#[test]
fn structures_look_as_the_oracle_has_them() {
    let gpu = gpu();
    let mut random = Random::new(31);
    let resolution = 32;
    let scene = bundled("cornell");
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let grid = VoxelGrid::around(gpu_scene.bounds, resolution);
    let texels: Texels = (0..12)
        .flat_map(|_| crate::support::octree::matter(&mut random, resolution))
        .collect();
    let occupied: BTreeSet<VoxelIndex> = texels.keys().copied().collect();
    let finest = oracle::Volume::new(resolution, |at| {
        texels.get(&at).copied().unwrap_or_default()
    });
    let (image, matter) = (volume(&gpu, &finest), matter(&gpu, &occupied, resolution));
    let mut frame = Frame::new();
    crate::support::gather::filter(&gpu, &mut frame, &image, 1);
    gpu.submit(frame).unwrap();
    let chain = read_chain(&gpu, &image);
    let cells = BrickSettings {
        corners: false,
        filter: 1,
        is_split: false,
        touched: false,
        directionality: Directionality::Isotropic,
        lobe: None,
    };
    let grown = [
        cells,
        BrickSettings {
            corners: true,
            ..cells
        },
    ]
    .map(|settings| {
        let lattice = lattice(settings);
        let mut levels = vec![leaves(&texels, lattice)];
        for level in 1..4 {
            levels.push(coarser(
                &levels[level - 1],
                resolution >> (level - 1),
                lattice,
                Filter::Directional,
            ));
        }
        (
            lattice,
            grow(&gpu, &texels, resolution, settings),
            octree(&occupied, resolution, lattice),
            levels,
        )
    });
    let size = [64, 48];
    let centre = grid.origin + 0.5 * grid.voxel_size * resolution as f32;
    for (outside, level) in [(true, 0), (false, 0), (true, 1), (false, 2), (true, 3)] {
        let eye = centre
            + if outside {
                Vec3::new(0.9, 1.1, 1.4)
            } else {
                Vec3::new(0.13, 0.07, 0.11)
            };
        let camera = Camera {
            eye,
            target: centre + Vec3::new(0.3, 0.2, -0.1),
            ..scene.camera
        };
        let view = View::new(&gpu, &gpu_scene, &camera, size, &grid);
        let constants = gpu_scene.frame_constants(&camera, size);
        let up = Vec3::new(
            constants.ray_up[0],
            constants.ray_up[1],
            constants.ray_up[2],
        );
        let origin = (eye.as_dvec3() - grid.origin.as_dvec3()) / f64::from(grid.voxel_size);
        let pixel = 2.0 * f64::from(up.length()) / f64::from(size[1]);
        let check = |name: &str, volume: cone::Volume<'_>, cell_at: &dyn Fn(DVec3) -> Cell| {
            let volume = VoxelVolume {
                name: "light",
                volume,
                levels: 5,
            };
            let seen = look_at_structure(&gpu, &gpu_scene, &view, &volume, level);
            let ray = |direction| EyeRay {
                origin,
                direction,
                pixel,
            };
            let expected: Vec<DVec4> = pixel_rays(&constants, size)
                .map(|direction| {
                    view_structure(
                        cell_at,
                        |_, cell| cell.edge.log2(),
                        f64::from(resolution),
                        level,
                        ray(direction),
                    )
                })
                .collect();
            let share = differing(&seen, &expected);
            let drawn = expected.iter().filter(|texel| texel.w > 0.0).count() as f64
                / expected.len() as f64;
            println!(
                "{name}, level {level}, outside {outside}: {share:.4} of the pixels differ, \
                 {drawn:.2} are drawn"
            );
            assert!(
                share < 0.02 && drawn > 0.1,
                "{name}, level {level}, outside {outside}: {share} differ, {drawn} are drawn"
            );
            let other = look_at_structure(&gpu, &gpu_scene, &view, &volume, (level + 1) % 4);
            assert!(
                differing(&other, &expected) > 0.1,
                "another level is not noticed"
            );
        };
        let dense = mips::volume(grid, &image, &matter, None);
        let edge = f64::from(1u32 << level);
        check("dense", dense, &|at: DVec3| {
            let is_full = chain[level as usize]
                .texel((at / edge).to_array().map(|at| at as u32))
                .w
                > 0.0;
            Cell {
                edge,
                kind: if is_full {
                    CellKind::Solid
                } else {
                    CellKind::Hollow
                },
            }
        });
        for (lattice, (nodes, bricks), tree, levels) in &grown {
            let sparse = bricks.volume(grid, nodes);
            check(&format!("octree, {lattice:?}"), sparse, &|at| {
                node_at(tree, levels, *lattice, at, resolution, level)
            });
        }
    }
}

/// The node of a level at a position, or the one above it that has no children. A node spans its
/// texel's voxels, or on corners the eight points around it.
fn node_at(
    tree: &Octree,
    levels: &[Texels],
    lattice: Lattice,
    at: DVec3,
    resolution: u32,
    level: u32,
) -> Cell {
    let (mut tile, mut node_edge) = (&tree.tiles[0], resolution / 2);
    let node = |edge: u32| {
        at.to_array()
            .map(|at| (at as u32).min(resolution - 1) / edge)
    };
    while node_edge > 1 << level {
        let bits = node(node_edge).map(|at| at % 2);
        match tile.nodes[(bits[0] | bits[1] << 1 | bits[2] << 2) as usize] {
            Some(index) => (tile, node_edge) = (&tree.tiles[index as usize], node_edge / 2),
            None => {
                return Cell {
                    edge: f64::from(node_edge),
                    kind: CellKind::EmptyNode,
                };
            }
        }
    }
    let reach = if lattice == Lattice::Corners { 2 } else { 1 };
    let mut points = (0..reach * reach * reach).map(|index| {
        [
            index % reach,
            index / reach % reach,
            index / (reach * reach),
        ]
    });
    let is_full = |offset: [u32; 3]| {
        levels[level as usize]
            .get(&std::array::from_fn(|axis| {
                node(node_edge)[axis] + offset[axis]
            }))
            .is_some_and(|texel| texel.w > 0.0)
    };
    Cell {
        edge: f64::from(node_edge),
        kind: if points.any(is_full) {
            CellKind::Solid
        } else {
            CellKind::Hollow
        },
    }
}

fn renderer<'g>(
    gpu: &'g Gpu,
    scene: &Scene,
    technique: &str,
    pairs: &[(&str, &str)],
) -> Renderer<'g> {
    let case = Case {
        entry: find(technique).unwrap(),
        preset: Some("cones"),
    };
    let (mut renderer, _) = Renderer::new(
        gpu,
        scene,
        case.entry,
        &case.settings(pairs),
        frame(64, 48, 128),
    )
    .unwrap();
    renderer.render(&scene.camera).unwrap();
    renderer
}

/// A level of a view of any of the family; `None` where it is not there.
fn view(renderer: &Renderer<'_>, name: &str, level: u32) -> Option<Image> {
    let row = find("svo").unwrap().view(name).unwrap();
    renderer.view(row, level).unwrap()
}

/// In every structure the camera sees voxels where it sees surfaces; the octree's and the dense
/// texture's look alike on all levels.
#[test]
fn all_structures_show_the_scene() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let technique = |name| renderer(&gpu, &scene, name, &[("resolution", "64")]);
    let [mips, svo, clipmap] = ["voxel-mips", "svo", "clipmap"].map(technique);
    for renderer in [&mips, &svo, &clipmap] {
        let opacity = view(renderer, "voxel-opacity", 0).unwrap();
        let depth = renderer.aov(Aov::Depth).unwrap();
        let surfaces = depth
            .pixels
            .iter()
            .zip(&opacity.pixels)
            .filter(|(depth, _)| depth.x > 0.0);
        let covered = surfaces
            .clone()
            .filter(|(_, opacity)| opacity.x > 0.9)
            .count() as f64
            / surfaces.count() as f64;
        assert!(
            covered > 0.98,
            "{covered} of the surfaces are covered by voxels"
        );
    }
    for level in 0..5 {
        let [a, b] = [&mips, &svo].map(|renderer| view(renderer, "voxels", level).unwrap());
        let texels = |image: &Image| {
            image
                .pixels
                .iter()
                .map(|pixel| pixel.as_dvec3().extend(0.0))
                .collect::<Vec<_>>()
        };
        let share = differing(&texels(&a), &texels(&b));
        assert!(share < 0.01, "level {level}: {share} of the pixels differ");
    }
}

/// Volumes are those that the settings ask for; names and levels that are not there are no picture.
#[test]
fn volumes_are_what_was_asked_for() {
    let gpu = gpu();
    let names = |scene: &str, pairs: &[(&str, &str)]| {
        let renderer = renderer(&gpu, &bundled(scene), "svo", pairs);
        let views = find("svo").unwrap().views.iter().copied().flatten();
        let there = views.filter(|view| renderer.levels(view) > 0);
        there.map(|view| view.name).collect::<Vec<_>>()
    };
    let on = [("resolution", "32"), ("attributes", "on")];
    let all = [
        "voxels",
        "voxel-opacity",
        "structure",
        "voxel-albedo",
        "voxel-normal",
        "voxel-emission",
    ];
    assert_eq!(names("cornell", &[("resolution", "32")]), all[..3]);
    assert_eq!(names("cornell", &on), all[..5]);
    assert_eq!(names("emissive-gallery", &on), all);
    let renderer = renderer(&gpu, &bundled("cornell"), "svo", &on);
    assert!(view(&renderer, "structure", 4).is_some() && view(&renderer, "structure", 5).is_none());
    assert!(
        view(&renderer, "voxel-emission", 0).is_none()
            && view(&renderer, "voxel-albedo", 5).is_none()
    );
    let albedo = view(&renderer, "voxel-albedo", 0).unwrap();
    let largest = albedo.pixels.iter().map(|pixel| pixel.largest()).worst();
    assert!(largest > 0.5 && largest <= 1.0, "largest albedo {largest}");
}

/// After a model has moved, bricks of attributes look as those that were made with the model there;
/// also where the pool has grown.
#[test]
fn attributes_follow_dynamic_models() {
    let gpu = gpu();
    let mut random = Random::new(77);
    let mut scene = bundled("cornell");
    let (low, high) = scene.bounds().unwrap();
    let model = scene_of(&lump(8, 1), 2.0, &mut random);
    // A lump of 0.7 m, at first far away from the box.
    let place = |share: f32| still(low + share * (high - low) - Vec3::splat(0.5));
    add_model(
        &mut scene,
        model,
        &[place(10.0), place(0.3), place(0.6), place(10.0)],
    );
    let pairs = [("resolution", "32"), ("attributes", "on")];
    let mut moved = renderer(&gpu, &scene, "svo", &pairs);
    for time_s in [1.0, 2.0, 3.0] {
        scene.set_time(time_s);
        moved.set_pose(&scene).unwrap();
        moved.render(&scene.camera).unwrap();
        let fresh = renderer(&gpu, &scene, "svo", &pairs);
        for (name, level) in [
            ("voxel-albedo", 0),
            ("voxel-normal", 1),
            ("voxel-emission", 0),
            ("voxel-emission", 2),
        ] {
            let [a, b] = [&moved, &fresh].map(|renderer| view(renderer, name, level).unwrap());
            // The pools may differ in size, and so does the rounding of a place in them.
            let largest = |of: fn(Vec3, Vec3) -> Vec3| {
                let pixels = a.pixels.iter().zip(&b.pixels);
                pixels.map(|(a, b)| of(*a, *b).abs().largest()).worst()
            };
            let (difference, value) = (largest(|a, b| a - b), largest(|_, b| b));
            assert!(
                difference <= 1e-3 * value && (value > 0.0 || name == "voxel-emission"),
                "{name} on level {level} at {time_s} s: {difference} of {value}"
            );
        }
    }
}
