//! `lumivox voxelize`: files read back hold the oracle's voxels.

use crate::support::compare::Largest;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::support::gpu;
use crate::support::program::{lumivox, words};
use crate::support::voxels::{compare_sets, oracle_grid};
use glam::Vec3;
use lumivox::gi::Context;
use lumivox::gi::registry;
use lumivox::gi::shared::voxel::oracle::{Grid, VoxelIndex, voxelize};
use lumivox::gi::shared::voxel::{VoxelList, list_voxels};
use lumivox::gi::voxel_cones::{mips, svo};
use lumivox::image::srgb_from_linear;
use lumivox::render::GpuScene;
use lumivox::scene::{LoadOptions, Scene};
use serde::Deserialize;

/// Runs the program; its voxels of a bundled scene are in `file`.
fn export(folder: &Path, scene: &str, resolution: u32, file: &str) {
    let ran = lumivox(
        folder,
        &words(&format!(
            "voxelize {scene} --resolution {resolution} -o {file}"
        )),
        &[],
    );
    assert_eq!(ran.code, Some(0), "{scene} as {file}: {}", ran.stderr);
}

#[derive(Deserialize)]
struct JsonVoxel {
    index: VoxelIndex,
    albedo: [f32; 3],
    normal: [f32; 3],
    opacity: f32,
}

#[derive(Deserialize)]
struct JsonFile {
    scene: String,
    technique: String,
    resolution: u32,
    origin_m: [f32; 3],
    voxel_size_m: f32,
    voxels: Vec<JsonVoxel>,
}

impl JsonFile {
    fn read(path: &Path) -> Self {
        serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
    }

    fn grid(&self) -> Grid {
        Grid {
            origin: self.origin_m.into(),
            voxel_size: self.voxel_size_m,
            resolution: self.resolution,
        }
    }
}

#[derive(Deserialize)]
struct PlyVertex {
    x: f32,
    y: f32,
    z: f32,
    nx: f32,
    ny: f32,
    nz: f32,
    red: u8,
    green: u8,
    blue: u8,
    opacity: f32,
}

#[derive(Deserialize)]
struct PlyFile {
    vertex: Vec<PlyVertex>,
}

/// Coordinates and colour of each voxel of a one-model file, as the grid has them.
fn vox_voxels(path: &Path, resolution: u32) -> BTreeMap<VoxelIndex, [u8; 3]> {
    let data = dot_vox::load_bytes(&std::fs::read(path).unwrap()).unwrap();
    assert_eq!(data.models.len(), 1);
    let voxel = |voxel: &dot_vox::Voxel| {
        let color = data.palette[voxel.i as usize];
        (
            [
                u32::from(voxel.x),
                u32::from(voxel.z),
                resolution - 1 - u32::from(voxel.y),
            ],
            [color.r, color.g, color.b],
        )
    };
    data.models[0].voxels.iter().map(voxel).collect()
}

#[test]
fn files_hold_the_oracles_voxels() {
    let folder = tempfile::tempdir().unwrap();
    for (source, resolution) in [
        ("bundled:cornell", 32),
        ("bundled:two-rooms", 64),
        ("bundled:glossy", 32),
    ] {
        let scene = Scene::open(source, &LoadOptions::default()).unwrap();
        ["a.json", "a.ply", "a.vox"]
            .into_iter()
            .for_each(|file| export(folder.path(), source, resolution, file));
        let json = JsonFile::read(&folder.path().join("a.json"));
        assert_eq!(
            (
                json.scene.as_str(),
                json.technique.as_str(),
                json.resolution
            ),
            (scene.name.as_str(), "voxel-mips", resolution)
        );
        let grid = json.grid();
        let occupied: BTreeSet<VoxelIndex> = json.voxels.iter().map(|voxel| voxel.index).collect();
        assert_eq!(
            occupied.len(),
            json.voxels.len(),
            "{source}: a voxel is listed twice"
        );
        let difference = compare_sets(&occupied, &scene, &grid)
            .unwrap_or_else(|error| panic!("{source}: {error}"));
        assert!(
            difference.rounding * 10_000 <= difference.oracle,
            "{source}: {difference:?}"
        );
        let color = |voxel: &JsonVoxel| voxel.albedo.map(srgb_from_linear);
        let colors: BTreeMap<VoxelIndex, [u8; 3]> = json
            .voxels
            .iter()
            .map(|voxel| (voxel.index, color(voxel)))
            .collect();

        let ply: PlyFile =
            serde_ply::from_bytes(&std::fs::read(folder.path().join("a.ply")).unwrap()).unwrap();
        assert_eq!(ply.vertex.len(), json.voxels.len());
        for (point, voxel) in ply.vertex.iter().zip(&json.voxels) {
            let at = (Vec3::new(point.x, point.y, point.z) - grid.origin) / grid.voxel_size - 0.5;
            assert!(
                (at - Vec3::from(voxel.index.map(|i| i as f32)))
                    .abs()
                    .largest()
                    < 1e-3,
                "{source}: {at} is not {:?}",
                voxel.index
            );
            assert_eq!(
                ([point.nx, point.ny, point.nz], point.opacity),
                (voxel.normal, voxel.opacity)
            );
            assert_eq!(
                [point.red, point.green, point.blue],
                color(voxel),
                "{source}: {:?}",
                voxel.index
            );
        }

        let vox = vox_voxels(&folder.path().join("a.vox"), resolution);
        assert!(
            vox.keys().eq(colors.keys()),
            "{source}: the .vox has other voxels"
        );
        if colors.values().collect::<BTreeSet<_>>().len() <= 255 {
            assert_eq!(
                vox, colors,
                "{source}: colours that fit into the palette are changed"
            );
        }
    }
}

/// Colours and normals against the oracle's, which are tested themselves; here it counts that
/// nothing is mixed up on the way.
#[test]
fn attributes_are_the_oracles() {
    let folder = tempfile::tempdir().unwrap();
    export(folder.path(), "bundled:cornell", 32, "a.json");
    let json = JsonFile::read(&folder.path().join("a.json"));
    let scene = Scene::open("bundled:cornell", &LoadOptions::default()).unwrap();
    let oracle = voxelize(&scene, &json.grid());
    let mut compared = 0;
    for voxel in &json.voxels {
        // Voxels that hold next to nothing of a surface have attributes of rounding.
        let Some(sum) = oracle.get(&voxel.index).filter(|sum| sum.area > 0.1) else {
            continue;
        };
        let near = |a: [f32; 3], b: glam::DVec3, tolerance: f64| {
            (Vec3::from(a).as_dvec3() - b).abs().largest() < tolerance
        };
        assert!(
            near(voxel.albedo, sum.albedo, 0.01),
            "{:?}: {:?} is not {}",
            voxel.index,
            voxel.albedo,
            sum.albedo
        );
        assert!(
            near(voxel.normal, sum.normal, 0.01),
            "{:?}: {:?} is not {}",
            voxel.index,
            voxel.normal,
            sum.normal
        );
        assert!(voxel.opacity == 1.0);
        compared += 1;
    }
    assert!(
        compared > json.voxels.len() / 2,
        "{compared} of {}",
        json.voxels.len()
    );
}

/// Every technique that lists voxels lists the same ones.
#[test]
fn techniques_agree() {
    let gpu = gpu();
    let scene = Scene::open("bundled:cornell", &LoadOptions::default()).unwrap();
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let mut lists: Vec<(&str, VoxelList)> = Vec::new();
    for entry in [&mips::ENTRY, &svo::ENTRY] {
        let settings = entry.settings(None, &["resolution=32"]).unwrap();
        lists.push((
            entry.name,
            list_voxels(
                &Context {
                    gpu: &gpu,
                    scene: &gpu_scene,
                    size: [1; 2],
                    eye: glam::Vec3::ZERO,
                    lend: registry::lend,
                },
                &settings,
            )
            .unwrap(),
        ));
    }
    assert!(!lists.is_empty());
    let set = |list: &VoxelList| {
        list.voxels
            .iter()
            .map(|voxel| voxel.index)
            .collect::<BTreeSet<_>>()
    };
    for (name, list) in &lists {
        compare_sets(&set(list), &scene, &oracle_grid(&list.grid))
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(set(list), set(&lists[0].1), "{name} and {}", lists[0].0);
    }
}
