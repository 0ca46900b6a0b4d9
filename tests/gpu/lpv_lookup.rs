//! Lookups of the light propagation volume on the device against their twins.

use glam::{DVec3, DVec4, UVec3, Vec3};
use lumivox::gi::Inputs;
use lumivox::gi::lpv::gather::{self, Lookup};
use lumivox::gi::lpv::lobes::Occlusion;
use lumivox::gi::lpv::oracle::{self, Boundary, Place};
use lumivox::gi::lpv::{CellGrid, CellSettings, Propagation, by_direction};
use lumivox::gi::shared::voxel::VoxelGrid;
use lumivox::graph::{Frame, Gpu, Image};
use lumivox::render::{GpuScene, screen_image};
use lumivox::scene::{Scene, Specular};

use crate::lpv::{Lit, SETTINGS, light, light_in, lights, read_sides};
use crate::support::compare::{Largest, larger};
use crate::support::gather::View;
use crate::support::gpu;

const SIZE: [u32; 2] = [40, 30];

/// World coordinates.
const METRES: VoxelGrid = VoxelGrid {
    origin: Vec3::ZERO,
    voxel_size: 1.0,
    resolution: 8,
};

const ENVIRONMENT: Vec3 = Vec3::new(0.3, 0.2, 0.1);

/// Cells along the scene's longest side, or a grid.
#[derive(Clone, Copy, Debug)]
enum GridOf {
    Cells(u32),
    Grid(CellGrid),
}

fn glossy(scene: &Scene, roughness: f32) -> Scene {
    let mut scene = scene.clone();
    scene.environment = ENVIRONMENT.into();
    for material in &mut scene.materials {
        material.specular = Some(Specular {
            f0: Vec3::splat(0.5),
            roughness,
            metalness: 0.0,
            texture: None,
        });
    }
    scene
}

fn read(gpu: &Gpu, image: &std::sync::Arc<Image>) -> Vec<DVec4> {
    let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_image(image, 0, 0).unwrap());
    texels
        .iter()
        .map(|texel| DVec4::from(texel.map(f64::from)))
        .collect()
}

/// Diffuse and specular answer of each pixel.
fn answer(gpu: &Gpu, lit: &Lit, view: &View, lookup: Lookup) -> [Vec<DVec4>; 2] {
    let image = |name| screen_image(gpu, name, SIZE).unwrap();
    let (diffuse, specular) = (image("diffuse"), image("specular"));
    let receivers = view.gbuffer.receivers(&lit.scene, &diffuse);
    let mut frame = Frame::new();
    frame.set_scene(&lit.scene.set, &lit.scene.materials);
    if lit.cells.settings.keeps_directions {
        let given = Inputs {
            scene: &lit.scene,
            maps: &lit.maps,
            rsm: &lit.maps,
            gbuffer: &view.gbuffer,
            direct: &view.result,
            is_still: false,
        };
        let answer = (&receivers, Some(&specular));
        by_direction::gather(&mut frame, &given, &lit.cells, lookup, answer);
    } else {
        let levels = std::slice::from_ref(&lit.cells);
        gather::gather(&mut frame, &receivers, levels, lookup);
        gather::mirror(&mut frame, &view.gbuffer, levels, lookup, &specular);
    }
    gpu.submit(frame).unwrap();
    [&diffuse, &specular].map(|image| read(gpu, image))
}

/// Radiance of all cells along each direction.
fn fields(gpu: &Gpu, lit: &Lit) -> Vec<Vec<DVec4>> {
    let Propagation::Sweep(sweep) = &*lit.cells.propagation else {
        panic!("there is no sweep");
    };
    let (grid, sides) = (&lit.cells.grid, read_sides(gpu, lit));
    let face_m2 = f64::from(grid.cell_size).powi(2);
    let boundary = Boundary {
        faces: &lit.words,
        side: &|cell, face| {
            let word = lit.words[cell];
            let before = (word & ((1 << face) - 1)).count_ones();
            let side = sides.get(((word >> 8) + before) as usize);
            side.copied().unwrap_or_default()
        },
        inflow: &|_, _, _| DVec4::W,
        source: &|cell, direction| {
            let [r, g, b] = lit.flux[cell].map(|vector| vector.dot(direction).max(0.0));
            DVec3::new(r, g, b).extend(0.0) / (std::f64::consts::PI * face_m2)
        },
    };
    let all = sweep.directions.all.iter();
    all.map(|(direction, _)| oracle::field(grid, &boundary, *direction))
        .collect()
}

fn whole(found: DVec4) -> DVec3 {
    found.truncate() + found.w * ENVIRONMENT.as_dvec3()
}

/// Largest difference of what pixels get from their twins, of the largest: irradiance, ambient
/// visibility, and the share of mirrored light that directions bring of what harmonics bring.
fn check(gpu: &Gpu, scene: &Scene, settings: CellSettings, grid: GridOf, lookup: Lookup) {
    let roughness = 0.6f32;
    let scene = glossy(scene, roughness);
    let alpha = f64::from(roughness).powi(2);
    let by_direction = CellSettings {
        keeps_directions: true,
        ..settings
    };
    let lit = [settings, by_direction].map(|settings| match grid {
        GridOf::Cells(cells) => light(gpu, &scene, cells, settings),
        GridOf::Grid(grid) => {
            let on_gpu = GpuScene::new(gpu, &scene).unwrap();
            light_in(gpu, &scene, on_gpu, grid, settings)
        }
    });
    let views = [0, 1].map(|at| View::new(gpu, &lit[at].scene, &scene.camera, SIZE, &METRES));
    let [harmonics, directions] = [0, 1].map(|at| answer(gpu, &lit[at], &views[at], lookup));
    let fields = fields(gpu, &lit[1]);
    let Propagation::Sweep(sweep) = &*lit[1].cells.propagation else {
        panic!("there is no sweep");
    };
    let grid = &lit[0].cells.grid;
    let eye = scene.camera.eye.as_dvec3();
    let mut pairs: Vec<[DVec4; 2]> = Vec::new();
    let mut mirrored: Vec<(f64, [f64; 2])> = Vec::new();
    for ([x, y], receiver) in &views[0].receivers {
        let pixel = (x + SIZE[0] * y) as usize;
        let place = Place {
            position: receiver.position,
            normal: receiver.geometric_normal,
            shift: f64::from(lookup.shift),
            masked: lookup.masked,
            damping: lookup.damping,
        };
        let normal = receiver.shading_normal;
        let to_eye = (eye - receiver.position).normalize();
        let mirror = 2.0 * normal.dot(to_eye) * normal - to_eye;
        let expected = oracle::irradiance(&lit[0].light, grid, &place, normal);
        let [diffuse, lobe] = oracle::by_direction(
            &fields,
            &sweep.directions,
            grid,
            &place,
            (normal, mirror, alpha),
        );
        for (got, expected) in [
            (harmonics[0][pixel], expected),
            (directions[0][pixel], diffuse),
        ] {
            let visible = (expected.w / std::f64::consts::PI).min(1.0);
            pairs.push([got, whole(expected).extend(visible)]);
        }
        let smooth = whole(oracle::specular(&lit[0].light, grid, &place, mirror, alpha));
        let shares = |lobe: DVec3, smooth: DVec3| lobe.y / smooth.y;
        let got = shares(
            directions[1][pixel].truncate(),
            harmonics[1][pixel].truncate(),
        );
        mirrored.push((smooth.y, [got, shares(whole(lobe), smooth)]));
    }
    let brightest = mirrored.iter().map(|(smooth, _)| *smooth).fold(0.0, larger);
    mirrored.retain(|(smooth, _)| *smooth > 0.1 * brightest);
    let largest = pairs.iter().map(|[_, expected]| expected.largest());
    let largest = largest.fold(0.0, larger);
    let worst = |pairs: &[[DVec4; 2]]| {
        let errors = pairs.iter().map(|[got, expected]| (*got - *expected).abs());
        errors.map(|error| error.largest()).fold(0.0, larger)
    };
    let error = worst(&pairs) / largest;
    let ratios = mirrored
        .iter()
        .map(|(_, [got, expected])| (got - expected).abs());
    let ratio_error = ratios.fold(0.0, larger);
    println!(
        "{grid:?}, {lookup:?}: {} pixels, off by {error:.1e} of the largest; {} mirror, off \
         by {ratio_error:.1e}",
        pairs.len() / 2,
        mirrored.len()
    );
    assert!(pairs.len() > 1000 && mirrored.len() > 300);
    assert!(error < 2e-3 && ratio_error < 1e-2);
}

#[test]
fn lookups_are_the_oracles() {
    let gpu = gpu();
    let lookup = |shift, masked| Lookup {
        shift,
        blend: 0.0,
        masked,
        damping: false,
    };
    let damped = |shift, masked| Lookup {
        damping: true,
        ..lookup(shift, masked)
    };
    let all = lights();
    let cases = [
        (48, 12, Occlusion::Faces, lookup(1.0, false)),
        (33, 9, Occlusion::Faces, lookup(0.5, true)),
        (60, 16, Occlusion::Faces, lookup(0.0, true)),
        (48, 14, Occlusion::Faces, damped(1.0, false)),
        (48, 13, Occlusion::None, damped(0.5, true)),
    ];
    for (at, (directions, cells, occlusion, lookup)) in cases.into_iter().enumerate() {
        let settings = CellSettings {
            directions,
            occlusion,
            ..SETTINGS
        };
        check(&gpu, &all[at % 2].1, settings, GridOf::Cells(cells), lookup);
    }
    // So long that an octant's pairs of directions come one after the other.
    let settings = CellSettings {
        directions: 24,
        ..SETTINGS
    };
    let corner = Vec3::new(-1.31, -0.33, -140.0);
    let grid = CellGrid::new(corner, 0.23, UVec3::new(12, 12, 1200));
    check(
        &gpu,
        &all[0].1,
        settings,
        GridOf::Grid(grid),
        lookup(1.0, false),
    );
}
