//! Precomputed radiance transfer on the device: points and pixels against the host, and light that
//! changes while nothing is worked out anew.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::prt::lobes::frame_of;
use lumivox::gi::prt::transfer::Transfer;
use lumivox::gi::prt::transfer_settings;
use lumivox::gi::shared::sh;
use lumivox::render::GpuScene;
use lumivox::render::oracle::light::lobe;
use lumivox::scene::{Light, LoadOptions, Scene, Sky};

use crate::support::compare::Worst;
use crate::support::technique::{
    Builder, Case, Surfaces, cases, frame, open_cornell, shoot, small_lights, small_room,
};
use crate::support::{Random, gpu};

fn case(preset: &str) -> Case {
    let mut all = cases().into_iter();
    all.find(|case| case.entry.name == "prt" && case.preset == Some(preset))
        .unwrap()
}

/// The nearest triangle along a ray, its barycentric coordinates and whether its back is seen; the
/// distance of the next one too.
fn closest(scene: &Scene, origin: DVec3, direction: DVec3) -> Option<(u32, [f32; 2], bool)> {
    let mut found: Option<(f64, u32, [f32; 2], bool)> = None;
    for (number, triangle) in (0..).zip(&scene.triangles) {
        let [a, b, c] = (triangle.vertices)
            .map(|vertex| Vec3::from(scene.vertices[vertex as usize].position).as_dvec3());
        let (e1, e2) = (b - a, c - a);
        let p = direction.cross(e2);
        let determinant = e1.dot(p);
        if determinant.abs() < 1e-12 {
            continue;
        }
        let s = origin - a;
        let u = s.dot(p) / determinant;
        let q = s.cross(e1);
        let v = direction.dot(q) / determinant;
        let t = e2.dot(q) / determinant;
        let is_in = u > 1e-4 && v > 1e-4 && u + v < 1.0 - 1e-4 && t > 0.0;
        if is_in && found.is_none_or(|(nearest, ..)| t < nearest) {
            let is_back = e1.cross(e2).dot(direction) > 0.0;
            found = Some((t, number, [u as f32, v as f32], is_back));
        }
    }
    found.map(|(_, number, at, is_back)| (number, at, is_back))
}

/// ∫ L Y, by the middles of a fine grid.
fn harmonics(order: u32, sky: &Sky) -> Vec<DVec3> {
    let rows = 256;
    let mut sums = vec![DVec3::ZERO; (order * order) as usize];
    let mut basis = vec![0.0; sums.len()];
    for row in 0..rows {
        let edge = |row: u32| (PI * f64::from(row) / f64::from(rows)).cos();
        let solid_angle = (edge(row) - edge(row + 1)) * TAU / f64::from(2 * rows);
        let middle = PI * (f64::from(row) + 0.5) / f64::from(rows);
        for column in 0..2 * rows {
            let (sin, cos) = (TAU * (f64::from(column) + 0.5) / f64::from(2 * rows)).sin_cos();
            let direction = DVec3::new(middle.sin() * sin, middle.cos(), -middle.sin() * cos);
            sh::evaluate(order as usize, direction, &mut basis);
            let light = solid_angle * sky.radiance(direction.as_vec3()).as_dvec3();
            sums.iter_mut()
                .zip(&basis)
                .for_each(|(sum, y)| *sum += *y * light);
        }
    }
    sums
}

/// (P3) at each pixel: the transfer of the host, a light that is projected another way, and the
/// triangles met by brute force.
#[test]
fn pixels_show_the_sum_over_transfer() {
    let gpu = gpu();
    let mut random = Random::new(5);
    let [(_, first), (_, second), _] = small_lights();
    let emissive = small_room(Surfaces::Emissive, vec![first, second]);
    let mut open = open_cornell();
    let image = lumivox::image::Image::from_fn(16, 8, |_| {
        Vec3::new(random.unit(), random.unit(), random.unit())
    });
    let sky = Sky::new(image, 0.0).unwrap().with(2.5, 70.0);
    open.environment = sky.clone().into();
    let scenes = [("lights and emission", emissive), ("sky and light", open)];
    let ways = ["none", "vq", "pca", "cpca"].into_iter();
    for (compress, (name, scene)) in ways.flat_map(|way| scenes.iter().map(move |own| (way, own))) {
        let case = case("balanced");
        let uploaded = GpuScene::new(&gpu, scene).unwrap();
        let compressed = [
            ("fit", "sphere"),
            ("compress", compress),
            ("clusters", "7"),
            ("basis", "3"),
        ];
        let pairs = &compressed[..if compress == "none" { 1 } else { 4 }];
        let settings = transfer_settings(&case.settings(pairs), &uploaded);
        let transfer = Transfer::new(scene, settings, &|_, _| ());
        assert_eq!(transfer.irradiance.harmonics.is_some(), compress != "none");
        let mut light = match scene.environment.sky() {
            Some(sky) => harmonics(transfer.order, sky),
            None => vec![DVec3::ZERO; (transfer.order * transfer.order) as usize],
        };
        light.extend(scene.is_emissive().then_some(DVec3::ONE));
        light.extend(scene.lights.iter().map(|light| match light {
            Light::Directional { irradiance, .. } => irradiance.as_dvec3(),
            Light::Point { intensity, .. } | Light::Spot { intensity, .. } => intensity.as_dvec3(),
        }));
        assert_eq!(light.len(), transfer.irradiance.functions as usize);
        let size = 40;
        let shot = shoot(&gpu, scene, &case, pairs, frame(size, size, 64)).unwrap();
        let found = &shot.light.irradiance.pixels;
        let mean = found.iter().map(|pixel| f64::from(pixel.y)).sum::<f64>() / found.len() as f64;
        let camera = scene.camera;
        let [right, up, forward] = camera.basis().map(Vec3::as_dvec3);
        let tan = (0.5 * f64::from(camera.vfov_deg)).to_radians().tan();
        let mut compared = 0;
        let offs = (0..size * size).filter_map(|index| {
            let at = |pixel: u32| (f64::from(pixel) + 0.5) / f64::from(size) * 2.0 - 1.0;
            let ray = forward + tan * (at(index % size) * right - at(index / size) * up);
            let (triangle, place, is_back) = closest(scene, camera.eye.as_dvec3(), ray)?;
            let around = transfer.lattice.at(triangle, is_back, place)?;
            let irradiance = around.map(|(point, share)| {
                let row = transfer.irradiance.row(point as usize);
                let sum = row.chunks_exact(3).zip(&light).map(|(rgb, light)| {
                    let rgb = DVec3::new(rgb[0].into(), rgb[1].into(), rgb[2].into());
                    rgb * *light
                });
                f64::from(share) * sum.sum::<DVec3>()
            });
            let expected = irradiance.into_iter().sum::<DVec3>().max(DVec3::ZERO);
            compared += 1;
            let off = (found[index as usize].as_dvec3() - expected).abs();
            Some(off.x.max(off.y).max(off.z) / mean)
        });
        let off = offs.worst();
        println!("{name}, {compress}: {compared} pixels, off by {off:.5} of the mean");
        assert!(compared > 800 && off < 0.01, "{compared}: {off}");
    }
}

/// Radiance above points of one normal on the host, by the coefficients of their matrices; of a
/// direction in the frame of the normal.
fn radiance_at(
    transfer: &Transfer,
    light: &[DVec3],
    around: &[(u32, f32); 3],
) -> impl Fn(DVec3) -> DVec3 {
    let lobes = transfer.lobes.as_ref().unwrap();
    let mut sums = vec![DVec3::ZERO; lobes.outputs as usize];
    for (point, share) in around {
        let row = lobes.row(*point as usize);
        for (sum, columns) in sums.iter_mut().zip(row.chunks_exact(3 * light.len())) {
            for (rgb, light) in columns.chunks_exact(3).zip(light) {
                let rgb = DVec3::new(rgb[0].into(), rgb[1].into(), rgb[2].into());
                *sum += f64::from(*share) * rgb * *light;
            }
        }
    }
    move |direction| {
        let mut basis = vec![0.0; sums.len()];
        sh::evaluate(sums.len().isqrt(), direction, &mut basis);
        basis.iter().zip(&sums).map(|(y, sum)| *y * *sum).sum()
    }
}

/// L_s at each pixel: the radiance above points on the host, times the lobe, over all directions.
#[test]
fn mirrors_show_the_radiance_above_points() {
    let gpu = gpu();
    let [(_, first), (_, second), _] = small_lights();
    for (roughness, compress) in [(0.5, "none"), (0.8, "cpca"), (1.0, "none")] {
        let mut scene = open_cornell();
        scene.lights = vec![first, second];
        let f0 = Vec3::new(0.9, 0.5, 0.04);
        let specular = lumivox::scene::Specular {
            f0,
            roughness,
            metalness: 0.0,
            texture: None,
        };
        for material in &mut scene.materials {
            material.specular = Some(specular);
        }
        let image = lumivox::image::Image::from_fn(16, 8, |index| {
            Vec3::new((index % 16) as f32, (index / 16) as f32, 4.0) * 0.1
        });
        let sky = Sky::new(image, 0.0).unwrap().with(2.5, 70.0);
        scene.environment = sky.clone().into();
        let case = case("glossy");
        let pairs = &[
            ("fit", "sphere"),
            ("compress", compress),
            ("cells", "4"),
            ("order", "3"),
        ];
        let uploaded = GpuScene::new(&gpu, &scene).unwrap();
        let settings = transfer_settings(&case.settings(pairs), &uploaded);
        let transfer = Transfer::new(&scene, settings, &|_, _| ());
        let mut light = harmonics(transfer.order, &sky);
        light.extend(scene.lights.iter().map(|light| match light {
            Light::Directional { irradiance, .. } => irradiance.as_dvec3(),
            Light::Point { intensity, .. } | Light::Spot { intensity, .. } => intensity.as_dvec3(),
        }));
        let size = 16;
        let shot = shoot(&gpu, &scene, &case, pairs, frame(size, size, 64)).unwrap();
        let found = &shot.light.specular.pixels;
        let mean = found.iter().map(|pixel| f64::from(pixel.y)).sum::<f64>() / found.len() as f64;
        let camera = scene.camera;
        let [right, up, forward] = camera.basis().map(Vec3::as_dvec3);
        let tan = (0.5 * f64::from(camera.vfov_deg)).to_radians().tan();
        let nodes = sh::Quadrature::half(160).nodes;
        let offs = (0..size * size).filter_map(|index| {
            let at = |pixel: u32| (f64::from(pixel) + 0.5) / f64::from(size) * 2.0 - 1.0;
            let ray = forward + tan * (at(index % size) * right - at(index / size) * up);
            let (triangle, place, is_back) = closest(&scene, camera.eye.as_dvec3(), ray)?;
            let around = transfer.lattice.at(triangle, is_back, place)?;
            let radiance = radiance_at(&transfer, &light, &around);
            let normal = transfer.lattice.points[around[0].0 as usize]
                .normal
                .as_dvec3();
            let to_eye = frame_of(normal.as_vec3()).transpose() * -ray.normalize();
            let lobe = nodes.iter().map(|(way, weight)| {
                let reflected = lobe(DVec3::Z, to_eye, *way, f0.as_dvec3(), roughness.into());
                weight * way.z * reflected * radiance(*way)
            });
            let expected = lobe.sum::<DVec3>().max(DVec3::ZERO);
            // Beside the surface the table is too coarse: off by 3%.
            let off = (found[index as usize].as_dvec3() - expected) / mean;
            (to_eye.z > 0.1).then_some(off.length_squared())
        });
        let offs: Vec<f64> = offs.collect();
        let compared = offs.len();
        let off = (offs.iter().sum::<f64>() / compared as f64).sqrt();
        println!(
            "roughness {roughness}, {compress}: {compared} pixels, off by {off:.5} of the mean"
        );
        assert!(compared > 100 && off < 0.01, "{compared}: {off}");
    }
}

/// Nothing is lit anew while the light is the same, and a picture is the same bit by bit.
#[test]
fn points_are_lit_once() {
    let gpu = gpu();
    let mut scene = open_cornell();
    scene.environment = Vec3::splat(0.5).into();
    let case = case("fast");
    let (mut renderer, _) = Renderer::new(
        &gpu,
        &scene,
        case.entry,
        &case.settings(&[]),
        frame(24, 24, 64),
    )
    .unwrap();
    let first = renderer.render(&scene.camera).unwrap();
    let lit = renderer.aov(lumivox::image::Aov::Full).unwrap();
    let second = renderer.render(&scene.camera).unwrap();
    let count = |stats: &lumivox::graph::FrameStats| {
        let lights = |pass: &&lumivox::graph::PassTime| pass.name == "prt.light_points";
        stats.passes.iter().filter(lights).count()
    };
    assert_eq!((count(&first), count(&second)), (1, 0));
    assert_eq!(renderer.aov(lumivox::image::Aov::Full).unwrap(), lit);
}

/// What cannot be lit is said, with what to do.
#[test]
fn what_does_not_fit_is_an_error() {
    let gpu = gpu();
    let [(_, light), ..] = small_lights();
    let moving = crate::support::technique::moving_room(Surfaces::Diffuse, light);
    let case = case("fast");
    let settings = |pairs: &[&str]| {
        let pairs: Vec<String> = pairs.iter().map(|pair| (*pair).to_owned()).collect();
        case.entry.settings(case.preset, &pairs).unwrap()
    };
    let error = |scene: &Scene, pairs: &[&str]| {
        Renderer::new(&gpu, scene, case.entry, &settings(pairs), frame(8, 8, 64))
            .err()
            .unwrap()
            .to_string()
    };
    let told = error(&moving, &[]);
    assert!(
        told.contains("may move") && told.contains("dynamic=freeze"),
        "{told}"
    );
    let told = error(&open_cornell(), &["cells=1024"]);
    assert!(told.contains("points_max=2000000"), "{told}");
    let wanted = told.split("`cells=").nth(1).unwrap();
    let cells: u32 = wanted.split('`').next().unwrap().parse().unwrap();
    assert!((100..1024).contains(&cells), "{told}");
    let glossy = Scene::open("bundled:glossy", &LoadOptions::default()).unwrap();
    let told = error(
        &glossy,
        &["transfer=matrix", "cells=256", "order=8", "out_order=6"],
    );
    assert!(
        told.contains("transfer=matrix") && told.contains("compress=cpca"),
        "{told}"
    );
}

/// The back of a sheet has the light from below.
#[test]
fn backs_have_their_own_light() {
    let gpu = gpu();
    let mut builder = Builder::default();
    let grey = builder.matte("grey", Vec3::splat(0.5));
    builder.quad(
        grey,
        Vec3::new(-1.0, 0.0, -1.0),
        2.0 * Vec3::Z,
        2.0 * Vec3::X,
    );
    let camera = lumivox::scene::Camera {
        eye: Vec3::new(0.1, 2.0, 0.1),
        target: Vec3::ZERO,
        up: Vec3::X,
        vfov_deg: 30.0,
    };
    let mut scene = builder.finish("sheet", Vec::new(), Vec3::ZERO, camera);
    let halves = lumivox::image::Image::from_fn(64, 64, |index| {
        Vec3::splat(if index < 32 * 64 { 1.0 } else { 0.1 })
    });
    scene.environment = Sky::new(halves, 0.0).unwrap().into();
    for (height, expected) in [(2.0, PI), (-2.0, 0.1 * PI)] {
        scene.camera.eye.y = height;
        for (sides, is_there) in [("auto", true), ("front", height > 0.0)] {
            let size = frame(16, 16, 64);
            let shot = shoot(&gpu, &scene, &case("balanced"), &[("sides", sides)], size).unwrap();
            let pixels = &shot.light.irradiance.pixels;
            let mean = pixels.iter().map(|pixel| f64::from(pixel.y)).sum::<f64>() / 256.0;
            let expected = if is_there { expected } else { 0.0 };
            println!("from {height} m, {sides}: {mean} for {expected}");
            assert!((mean - expected).abs() < 0.05, "{mean} for {expected}");
        }
    }
}

/// Views show what the host has, pixel by pixel, and change no picture.
#[test]
fn views_show_points_and_their_transfer() {
    let gpu = gpu();
    let scene = open_cornell();
    let case = case("balanced");
    let find = |name: &str| {
        let mut all = case.entry.views.iter().copied().flatten();
        all.find(|view| view.name == name).unwrap()
    };
    let (points, transfer_view) = (find("transfer-points"), find("transfer"));
    let clusters = find("transfer-clusters");
    for compress in ["none", "cpca"] {
        let pairs = &[("compress", compress), ("clusters", "12"), ("basis", "3")];
        let pairs = &pairs[..if compress == "none" { 1 } else { 3 }];
        let uploaded = GpuScene::new(&gpu, &scene).unwrap();
        let settings = transfer_settings(&case.settings(pairs), &uploaded);
        let transfer = Transfer::new(&scene, settings, &|_, _| ());
        let size = 40;
        let wanted = frame(size, size, 64);
        let made = Renderer::new(&gpu, &scene, case.entry, &case.settings(pairs), wanted);
        let mut renderer = made.unwrap().0;
        renderer.render(&scene.camera).unwrap();
        let before = renderer.aov(lumivox::image::Aov::Full).unwrap();
        let is_as_before = |renderer: &mut Renderer| {
            renderer.render(&scene.camera).unwrap();
            assert_eq!(renderer.aov(lumivox::image::Aov::Full).unwrap(), before);
        };
        assert_eq!(
            renderer.levels(transfer_view),
            transfer.order * transfer.order
        );
        assert_eq!(renderer.levels(clusters), u32::from(compress == "cpca"));
        let camera = scene.camera;
        let [right, up, forward] = camera.basis().map(Vec3::as_dvec3);
        let tan = (0.5 * f64::from(camera.vfov_deg)).to_radians().tan();
        let around: Vec<Option<[(u32, f32); 3]>> = (0..size * size)
            .map(|index| {
                let at = |pixel: u32| (f64::from(pixel) + 0.5) / f64::from(size) * 2.0 - 1.0;
                let ray = forward + tan * (at(index % size) * right - at(index / size) * up);
                let (triangle, place, is_back) = closest(&scene, camera.eye.as_dvec3(), ray)?;
                transfer.lattice.at(triangle, is_back, place)
            })
            .collect();
        for level in [0, 2, 6, 20] {
            let seen = renderer.view(transfer_view, level).unwrap().unwrap();
            let pairs = seen.pixels.iter().zip(&around);
            let offs = pairs.filter_map(|(pixel, around)| {
                let expected = around.as_ref()?.iter().map(|(point, share)| {
                    let row = transfer.irradiance.row(*point as usize);
                    f64::from(share * row[3 * level as usize + 1])
                });
                Some((f64::from(pixel.y) - expected.sum::<f64>()).abs())
            });
            let off = offs.worst();
            println!("{compress}: coefficient {level} is off by {off:.5}");
            assert!(off < 3e-3, "{level}: {off}");
        }
        is_as_before(&mut renderer);
        // Five pixels a ball.
        let seen = renderer.view(find("transfer-lobes"), 0).unwrap().unwrap();
        let mut compared = 0;
        let offs = (0..size * size).filter_map(|index| {
            let (x, y) = (index % size, index / size);
            let middle = [x / 5 * 5 + 2, y / 5 * 5 + 2];
            let off = [(x, middle[0]), (y, middle[1])]
                .map(|(at, middle)| (f64::from(at) - f64::from(middle) + 0.5) / (0.45 * 5.0));
            let flat = off[0] * off[0] + off[1] * off[1];
            let around = around[(middle[1] * size + middle[0]) as usize].as_ref()?;
            if flat >= 0.999 {
                return None;
            }
            let way = off[0] * right - off[1] * up - (1.0 - flat).sqrt() * forward;
            let expected = around.iter().map(|(point, share)| {
                let row = transfer.irradiance.row(*point as usize);
                let green: Vec<f64> = row[1..]
                    .iter()
                    .step_by(3)
                    .map(|own| (*own).into())
                    .collect();
                let harmonics = &green[..settings.order.pow(2) as usize];
                f64::from(*share) * sh::reconstruct(harmonics, way)
            });
            compared += 1;
            let found = f64::from(seen.pixels[index as usize].y);
            Some((found - expected.sum::<f64>()).abs())
        });
        let off = offs.worst();
        println!("{compress}: balls are off by {off:.5}, {compared} pixels");
        assert!(compared > 300 && off < 0.02, "{compared}: {off}");
        // A number has one colour, and another number another.
        let is_told = |view, number: &dyn Fn(u32) -> u32| {
            let seen = renderer.view(view, 0).unwrap().unwrap();
            let mut colors = std::collections::BTreeMap::new();
            let mut compared = 0;
            for (pixel, around) in seen.pixels.iter().zip(&around) {
                let Some(around) = around else { continue };
                let mut sorted = *around;
                sorted.sort_by(|a, b| b.1.total_cmp(&a.1));
                if sorted[0].1 - sorted[1].1 < 1e-2 {
                    continue;
                }
                let color = pixel.to_array().map(f32::to_bits);
                let known = colors.entry(number(sorted[0].0)).or_insert(color);
                assert_eq!(*known, color);
                compared += 1;
            }
            let distinct: std::collections::BTreeSet<_> = colors.values().collect();
            assert!(compared > 500 && distinct.len() == colors.len());
            colors.len()
        };
        assert!(is_told(points, &|point| point) > 100);
        if let Some(harmonics) = &transfer.irradiance.harmonics {
            let of = |point: u32| u32::from(harmonics.clusters[point as usize]);
            assert!(is_told(clusters, &of) > 2);
        }
        is_as_before(&mut renderer);
    }
}
