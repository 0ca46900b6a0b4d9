//! Lobes in levels of an octree on the device against their CPU oracle.

use glam::{UVec3, Vec3};
use lumivox::gi::lpv::levels::{Transfer, grids};
use lumivox::gi::lpv::lobes::{LobeSettings, Occlusion, Scheme};
use lumivox::gi::lpv::oracle::lobes::Steps;
use lumivox::gi::lpv::oracle::octree as oracle;
use lumivox::gi::lpv::{CellGrid, CellSettings, Octree, Propagation, Source};
use lumivox::graph::Gpu;
use lumivox::render::GpuScene;
use lumivox::scene::{Light, Scene};

use crate::lpv::{Lit, SETTINGS, light, light_in, lights, read_sides};
use crate::lpv_lobes::{check_light, first_of};
use crate::support::scenes::{bundled, scene_of, soup};
use crate::support::{Random, gpu, read_words};

const STEPS: LobeSettings = LobeSettings {
    scheme: Scheme::Lobes30,
    iterations: 4,
    gain: 0.75,
    clamp_negative: true,
};

const BOTH: [Transfer; 2] = [Transfer::Mean, Transfer::Residual];

fn settings(steps: LobeSettings, occlusion: Occlusion, transfer: Transfer) -> CellSettings {
    CellSettings {
        occlusion,
        lobes: Some(steps),
        octree: Some(Octree::Levels(transfer)),
        ..SETTINGS
    }
}

/// Opaque faces of all levels, which are to be the oracle's.
fn check_faces(gpu: &Gpu, name: &str, lit: &Lit) -> Vec<Vec<u32>> {
    let grids = grids(lit.cells.grid);
    let Propagation::Levels(levels) = &*lit.cells.propagation else {
        panic!("{name} has no levels");
    };
    assert_eq!(levels.count() as usize, grids.len(), "{name}");
    let mut words = vec![lit.words.clone()];
    for (pair, found) in grids.windows(2).zip(levels.faces()) {
        let expected = oracle::coarse_faces(&pair[0], &pair[1], words.last().unwrap());
        let found = &read_words(gpu, found)[..expected.len()];
        assert!(found == expected, "{name}: faces of {} cells", pair[1].size);
        words.push(expected);
    }
    words
}

/// The same flux and sides in double precision, by the oracle's levels.
fn check(gpu: &Gpu, name: &str, lit: &Lit) {
    let settings = lit.cells.settings;
    let Some(Octree::Levels(transfer)) = settings.octree else {
        panic!("{name} has no levels");
    };
    let grids = grids(lit.cells.grid);
    let words = check_faces(gpu, name, lit);
    let steps: Vec<Steps<'_>> = (0..grids.len())
        .map(|level| Steps {
            settings: settings.lobes.unwrap(),
            occlusion: settings.occlusion,
            faces: words.get(level).map_or(&[], Vec::as_slice),
            blockers: &[],
        })
        .collect();
    let first = first_of(gpu, lit);
    let expected = match transfer {
        Transfer::Mean => oracle::merge_finest(&grids, &oracle::published(&grids, &steps, &first)),
        Transfer::Residual => {
            oracle::merge_sum(&grids, &oracle::repaired(&grids, &steps, &first).fields)
        }
    };
    check_light(name, lit, &expected);
}

/// Even, odd and both numbers of cells.
#[test]
fn light_of_levels_is_the_oracles() {
    let gpu = gpu();
    for (name, scene) in lights() {
        for transfer in BOTH {
            for (cells, occlusion) in [
                (16, Occlusion::Faces),
                (21, Occlusion::Faces),
                (19, Occlusion::None),
            ] {
                let lit = light(&gpu, &scene, cells, settings(STEPS, occlusion, transfer));
                check(
                    &gpu,
                    &format!("{name}, {cells} cells, {transfer:?}, {occlusion:?}"),
                    &lit,
                );
            }
        }
    }
    let scene = &lights()[0].1;
    for steps in [
        LobeSettings {
            scheme: Scheme::Axis6,
            iterations: 1,
            ..STEPS
        },
        LobeSettings {
            scheme: Scheme::Stream,
            iterations: 3,
            gain: 1.0,
            ..STEPS
        },
        LobeSettings {
            iterations: 7,
            gain: 1.0,
            clamp_negative: false,
            ..STEPS
        },
    ] {
        for transfer in BOTH {
            let lit = light(&gpu, scene, 14, settings(steps, Occlusion::Faces, transfer));
            check(&gpu, &format!("{transfer:?}, {steps:?}"), &lit);
        }
    }
}

/// Triangles anywhere, in grids that are long, flat, or of one level.
#[test]
fn levels_among_random_faces_are_the_oracles() {
    let gpu = gpu();
    let mut random = Random::new(2027);
    for size in [[17, 12, 15], [3, 19, 7], [40, 3, 3], [2, 2, 2], [5, 9, 33]] {
        let mut scene = scene_of(&soup(&mut random, 16), 0.0, &mut random);
        scene.lights = vec![Light::Point {
            position: Vec3::new(0.2, 8.3, 1.1),
            intensity: Vec3::new(30.0, 20.0, 10.0),
        }];
        for transfer in BOTH {
            let scene_on = GpuScene::new(&gpu, &scene).unwrap();
            let grid = CellGrid::new(Vec3::new(-0.3, 0.2, 0.7), 1.07, UVec3::from(size));
            let of_faces = settings(STEPS, Occlusion::Faces, transfer);
            let lit = light_in(&gpu, &scene, scene_on, grid, of_faces);
            check(&gpu, &format!("{size:?}, {transfer:?}"), &lit);
        }
    }
}

/// Faces send into the finest level, and so do further bounces.
#[test]
fn levels_of_faces_are_the_oracles() {
    let gpu = gpu();
    let mut scene = bundled("cornell");
    scene.materials[0].emission = Vec3::new(1.0, 2.0, 3.0);
    for (source, bounces) in [(Source::Faces, 1), (Source::Rsm, 2)] {
        for transfer in BOTH {
            let settings = CellSettings {
                source,
                bounces,
                ..settings(STEPS, Occlusion::Faces, transfer)
            };
            let lit = light(&gpu, &scene, 14, settings);
            assert!(read_sides(&gpu, &lit).iter().any(|side| side.z > 0.0));
            check(&gpu, &format!("{source:?}, {transfer:?}"), &lit);
        }
    }
}

/// Cells that have the light of as many steps in one grid, bit by bit, and all that have light.
fn same_as_uniform(gpu: &Gpu, scene: &Scene, cells: u32, occlusion: Occlusion) -> [usize; 3] {
    let levels = settings(STEPS, occlusion, Transfer::Mean);
    let uniform = CellSettings {
        octree: None,
        ..levels
    };
    let [uniform, levels] = [uniform, levels].map(|settings| light(gpu, scene, cells, settings));
    let [mut same, mut more] = [0; 2];
    for (uniform, levels) in uniform.light.iter().zip(&levels.light) {
        let is_lit =
            |cell: &[glam::DVec4; 9]| cell.iter().any(|c| c.truncate() != glam::DVec3::ZERO);
        if is_lit(uniform) {
            assert_eq!(uniform, levels);
            same += 1;
        } else {
            more += usize::from(is_lit(levels));
        }
    }
    [same, more, uniform.light.len()]
}

/// Wherever one grid has light after k steps, the published octree has that light and no other.
#[test]
fn the_published_octree_is_uniform_where_its_finest_level_has_light() {
    let gpu = gpu();
    for (name, scene) in lights() {
        for occlusion in [Occlusion::Faces, Occlusion::None] {
            let [same, more, all] = same_as_uniform(&gpu, &scene, 32, occlusion);
            println!(
                "{name}, {occlusion:?}: {same} cells of {all} are the same, {more} have light"
            );
            assert!(same > all / 8 && more > all / 20, "{name}");
        }
    }
}
