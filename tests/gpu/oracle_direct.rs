//! `render.direct` and `render.composite` on the device against the CPU: the lobe by its papers,
//! shadows by exact rays and by the maps' own texels, the path tracer's direct light against both;
//! the sum of the terms, and what each output shows.

use std::sync::Arc;

use crate::support::compare::{Largest, exceeds};
use crate::support::surfaces::{
    Drawn, GBufferPixel, centre, draw_gbuffer, every_surface, lit_by, seen_from, sheet,
};
use crate::support::technique::Builder;
use crate::support::{Random, gpu};
use glam::{DVec2, DVec3, Vec2, Vec3};
use lumivox::graph::{Frame, Gpu, Image as GpuImage, ImageDesc, ImageKind, ImageUsage, Owner, vk};
use lumivox::image::{Aov, Image, srgb_from_linear, write_png};
use lumivox::reference::{self, Bounces, Filter, ReferenceImage, Sampling};
use lumivox::render::oracle::light::{Reflected, Reflector, light_at, reflect};
use lumivox::render::oracle::shadow::{
    Cascade, Comparison, SHADOW_BIAS, ShadowMap, cascaded_visibility,
};
use lumivox::render::oracle::texture::linear_from_srgb;
use lumivox::render::oracle::{Scenery, Surface, View};
use lumivox::render::{
    GpuLightView, GpuScene, IndirectLight, LightCascades, LightMaps, MapChannel, Output,
    ShadowFilter, ShadowSettings, SurfaceChannel, Watcher, read_aov, read_indirect, read_light_map,
    read_surface,
};
use lumivox::scene::{Camera, Light, Material, Scene, Specular, Texture, TextureKind};
use rayon::prelude::*;

const SIZE: [u32; 2] = [64, 48];

/// Least and largest radiance of a pixel.
type Bounds = [DVec3; 2];

/// What the direct light of a frame was made of, and what came out.
struct Lit {
    seen: Vec<DVec3>,
    reflectors: Vec<Option<Reflector>>,
    /// The shadow maps of each light.
    maps: Vec<Vec<ShadowMap>>,
    comparison: Comparison,
}

fn xyz(pixel: &GBufferPixel, first: usize) -> DVec3 {
    DVec3::new(pixel[first], pixel[first + 1], pixel[first + 2])
}

/// What a pixel of the G-buffer says of its surface.
fn reflector(drawn: &Drawn, pixel: usize, of: &GBufferPixel) -> Option<Reflector> {
    let (origin, direction) = drawn.view.ray(centre(pixel, drawn.view.size));
    let position = origin + of[0] * direction;
    (of[0] > 0.0).then(|| Reflector {
        position,
        geometric_normal: xyz(of, 1),
        shading_normal: xyz(of, 4),
        to_eye: -direction.normalize(),
        albedo: of[17] * xyz(of, 7),
        roughness: (of[10] >= 0.0).then_some(of[10]),
        f0: xyz(of, 11),
    })
}

fn read_shadow_maps(gpu: &Gpu, scene: &Scene, maps: &LightMaps) -> Vec<Vec<ShadowMap>> {
    let rows: Vec<GpuLightView> =
        bytemuck::pod_collect_to_vec(&gpu.read_buffer(&maps.views).unwrap());
    let mut by_light = vec![Vec::new(); scene.lights.len()];
    for (index, row) in (0..).zip(&rows) {
        let depth = read_light_map(gpu, maps, MapChannel::Depth, index)
            .unwrap()
            .unwrap();
        let metres = |stored: f32| match (row.origin_kind[3] == 0.0, f64::from(stored)) {
            (_, 0.0) => f64::INFINITY,
            (true, stored) => (1.0 - stored) * f64::from(row.right[3]),
            (false, stored) => f64::from(row.forward[3]) / stored,
        };
        by_light[row.light[0] as usize].push(ShadowMap {
            view: View::of_light(row),
            depth_m: depth.pixels.iter().map(|stored| metres(stored.x)).collect(),
            cascade: Cascade::of_light(row),
        });
    }
    by_light
}

fn light_up(gpu: &Gpu, scene: &Scene, size: [u32; 2], map_size: u32) -> Lit {
    light_up_by(gpu, scene, size, ShadowSettings::of_resolution(map_size))
}

fn light_up_by(gpu: &Gpu, scene: &Scene, size: [u32; 2], shadows: ShadowSettings) -> Lit {
    let mut gpu_scene = GpuScene::new(gpu, scene).unwrap();
    let cascades = LightCascades {
        count: shadows.cascades,
        everywhere: shadows.cascades == 1,
    };
    gpu_scene.set_cascades(gpu, cascades).unwrap();
    let drawn = draw_gbuffer(gpu, &gpu_scene, scene, size);
    let mut maps = LightMaps::new(gpu, &gpu_scene, shadows.resolution, false).unwrap();
    let watcher = Watcher {
        camera: scene.camera,
        aspect: size[0] as f32 / size[1] as f32,
        split_lambda: shadows.split_lambda,
    };
    maps.follow(gpu, &gpu_scene, Some(watcher)).unwrap();
    let output = Output::new(gpu, size).unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
    maps.draw(&mut frame, &gpu_scene);
    output.draw_direct(&mut frame, &gpu_scene, (&maps, &shadows), &drawn.gbuffer);
    gpu.submit(frame).unwrap();
    let texels: Vec<[f32; 4]> =
        bytemuck::pod_collect_to_vec(&gpu.read_image(&output.direct, 0, 0).unwrap());
    let pixels = drawn.read(gpu);
    let reflectors: Vec<_> = pixels
        .iter()
        .enumerate()
        .map(|(pixel, of)| reflector(&drawn, pixel, of))
        .collect();
    for (texel, reflector) in texels.iter().zip(&reflectors) {
        assert_eq!(
            texel[3],
            if reflector.is_some() { 1.0 } else { 0.0 },
            "alpha says where there is a surface"
        );
    }
    let seen = texels
        .iter()
        .map(|texel| DVec3::new(texel[0].into(), texel[1].into(), texel[2].into()))
        .collect();
    Lit {
        seen,
        reflectors,
        maps: read_shadow_maps(gpu, scene, &maps),
        comparison: Comparison {
            filter: shadows.filter,
            sun_tangent: (0.5 * f64::from(shadows.sun_angle_deg).to_radians()).tan(),
        },
    }
}

/// The shadow map in which a point is seen. A point light has one for each axis: the map of the
/// axis along which the point is farthest counts.
fn map_of(maps: &[ShadowMap], point: DVec3) -> usize {
    let along = |map: &ShadowMap| (point - map.view.origin).dot(map.view.forward);
    (0..maps.len())
        .max_by(|&a, &b| along(&maps[a]).total_cmp(&along(&maps[b])))
        .unwrap()
}

fn total(reflected: Reflected) -> DVec3 {
    reflected.diffuse + reflected.specular
}

/// What the shadow maps' texels make of each pixel.
fn by_maps(scene: &Scene, lit: &Lit) -> Vec<Bounds> {
    let of = |reflector: &Option<Reflector>| {
        let Some(at) = reflector else {
            return [DVec3::ZERO; 2];
        };
        let mut bounds = [DVec3::ZERO; 2];
        for (light, maps) in scene.lights.iter().zip(&lit.maps) {
            let place = (at.position, at.geometric_normal);
            let maps = match light {
                Light::Directional { .. } => &maps[..],
                _ => &maps[map_of(maps, at.position)..][..1],
            };
            let share = cascaded_visibility(maps, place, lit.comparison);
            let reflected = total(reflect(light, at));
            bounds = [
                bounds[0] + share[0] * reflected,
                bounds[1] + share[1] * reflected,
            ];
        }
        bounds
    };
    lit.reflectors.par_iter().map(of).collect()
}

/// What exact rays say of one light at a point, wherever all of the four texels that the point is
/// compared with see the same: nothing in the way, or something before the point's plane. `None`
/// elsewhere: at the edges of shadows, and where another surface meets this one.
fn by_rays(scenery: &Scenery<'_>, map: &ShadowMap, at: &Reflector) -> Option<bool> {
    let (middle, depth_m) = map.view.project(at.position);
    let steps = [-1.0, -0.5, 0.0, 0.5, 1.0];
    let compared =
        [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(|by| (middle - 0.5).floor() + by + 0.5);
    let around = steps
        .iter()
        .flat_map(|&x| steps.map(|y| middle + DVec2::new(x, y)));
    let mut answers = around.chain(compared).map(|at_px| {
        let (origin, direction) = map.view.ray(at_px);
        let plane_m =
            at.geometric_normal.dot(at.position - origin) / at.geometric_normal.dot(direction);
        let hit_m = scenery.certain_hit(&map.view, at_px)?;
        let facet_m = plane_m.min(depth_m) - map.facet_m(at_px, at.position);
        // Steep planes leave the reach of a comparison.
        let is_plain = plane_m > 0.0 && (plane_m / depth_m - 1.0).abs() < 0.2;
        match hit_m {
            _ if !is_plain => None,
            hit_m if hit_m < facet_m - 2.0 * SHADOW_BIAS * plane_m => Some(false),
            hit_m if hit_m > plane_m - 0.5 * SHADOW_BIAS * plane_m => Some(true),
            _ => None,
        }
    });
    let first = answers.next()??;
    answers.all(|answer| answer == Some(first)).then_some(first)
}

/// Arc cosines may be off by 4096 units in the last place (Vulkan, appendix on precision) [rad].
const ANGLE_ERROR: f64 = 2.5e-4;

/// How far a pixel's radiance may be off: single precision, and of a spot its angle from the axis.
fn tolerance(scene: &Scene, at: &Option<Reflector>, relative: f64) -> DVec3 {
    let Some(at) = at else { return DVec3::ZERO };
    let of = |light: &Light| {
        let (whole, angle) = match *light {
            Light::Spot {
                position,
                intensity,
                inner_deg,
                outer_deg,
                ..
            } => (
                Light::Point {
                    position,
                    intensity,
                },
                ANGLE_ERROR / f64::from(outer_deg - inner_deg).to_radians(),
            ),
            light => (light, 0.0),
        };
        total(reflect(light, at)) * relative
            + total(reflect(&whole, at)) * angle
            + 1e-6 * light_at(&whole, at.position).1
    };
    scene.lights.iter().map(of).sum::<DVec3>() + 1e-7
}

/// The first pixel that is outside of its bounds, and the largest distance in tolerances.
fn judge(seen: &[DVec3], bounds: &[Bounds], tolerance: &[DVec3]) -> Result<f64, String> {
    if seen.len() != bounds.len() || seen.len() != tolerance.len() {
        return Err(format!("{} pixels for {}", seen.len(), bounds.len()));
    }
    let mut worst = 0.0f64;
    for (pixel, seen) in seen.iter().enumerate() {
        for channel in 0..3 {
            let [low, high] = bounds[pixel].map(|bound| bound[channel]);
            let outside = (low - seen[channel]).max(seen[channel] - high);
            let share = if seen[channel].is_nan() || outside.is_nan() {
                f64::INFINITY
            } else {
                outside.max(0.0) / tolerance[pixel][channel].max(1e-300)
            };
            if share > 1.0 {
                return Err(format!(
                    "pixel {pixel}: {seen} for {:?}, {share:.2} tolerances of channel {channel}",
                    bounds[pixel]
                ));
            }
            worst = worst.max(share);
        }
    }
    Ok(worst)
}

/// Scales every pixel by a little more than the tolerance, and plants NaN in each channel: none may
/// pass.
fn planted_errors_fail(seen: &[DVec3], bounds: &[Bounds], tolerance: &[DVec3]) {
    let brightest = (0..seen.len())
        .max_by(|&a, &b| seen[a].x.total_cmp(&seen[b].x))
        .unwrap();
    for channel in 0..3 {
        for wrong in [
            bounds[brightest][1][channel] + 1.5 * tolerance[brightest][channel],
            f64::NAN,
        ] {
            let mut planted = seen.to_vec();
            planted[brightest][channel] = wrong;
            assert!(
                judge(&planted, bounds, tolerance).is_err(),
                "{wrong} in channel {channel} passes"
            );
        }
    }
    let dark: Vec<DVec3> = vec![DVec3::ZERO; seen.len()];
    assert!(judge(&dark, bounds, tolerance).is_err(), "black passes");
}

fn kinds() -> Vec<(&'static str, Light)> {
    let intensity = Vec3::new(3.0, 2.5, 2.0);
    vec![
        (
            "directional",
            Light::Directional {
                direction: Vec3::new(0.35, -0.8, -0.45).normalize(),
                irradiance: Vec3::new(4.0, 3.0, 2.0),
            },
        ),
        (
            "point",
            Light::Point {
                position: Vec3::new(0.15, 1.25, 0.75),
                intensity,
            },
        ),
        (
            "spot",
            Light::Spot {
                position: Vec3::new(0.3, 1.7, 1.9),
                direction: Vec3::new(-0.15, -0.6, -1.2).normalize(),
                intensity,
                inner_deg: 12.0,
                outer_deg: 34.0,
            },
        ),
    ]
}

/// Bent sheets of seven roughnesses and three kinds of lobe, beside each other, seen at all angles
/// down to grazing ones.
fn lobes(lobe: fn(f32) -> Material) -> Scene {
    let mut builder = Builder::default();
    for (index, roughness) in [0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0]
        .into_iter()
        .enumerate()
    {
        let material = builder.material(lobe(roughness));
        let corner = Vec3::new(-1.05 + 0.3 * index as f32, 0.0, -1.2);
        sheet(
            &mut builder,
            material,
            [corner, Vec3::Z * 2.4, Vec3::X * 0.28],
            [Vec2::ZERO; 4],
            0.35,
        );
    }
    let lights = vec![
        Light::Directional {
            direction: Vec3::new(0.05, -0.5, 1.0).normalize(),
            irradiance: Vec3::new(1.0, 2.0, 3.0),
        },
        Light::Point {
            position: Vec3::new(0.0, 0.4, -0.9),
            intensity: Vec3::new(0.5, 0.25, 1.0),
        },
        // Behind the sheets: nothing of it arrives.
        Light::Point {
            position: Vec3::new(0.0, -0.4, 0.3),
            intensity: Vec3::splat(2.0),
        },
    ];
    let camera = Camera {
        eye: Vec3::new(0.06, 0.7, 1.9),
        target: Vec3::new(0.0, 0.0, 0.15),
        up: Vec3::Y,
        vfov_deg: 50.0,
    };
    builder.finish("lobes", lights, Vec3::ZERO, camera)
}

/// A flat metal that a light is mirrored in, seen through a long lens: the peak of its lobe, and
/// its sides.
fn peak(roughness: f32) -> Scene {
    let mut builder = Builder::default();
    let specular = Some(Specular {
        f0: Vec3::ONE,
        roughness,
        metalness: 0.0,
        texture: None,
    });
    let metal = builder.material(Material {
        albedo: Vec3::ZERO,
        specular,
        ..Material::default()
    });
    builder.quad(
        metal,
        Vec3::new(-1.0, 0.0, -1.0),
        Vec3::Z * 2.0,
        Vec3::X * 2.0,
    );
    let camera = Camera {
        eye: Vec3::new(0.9, 1.2, 2.0),
        target: Vec3::new(0.1, 0.0, -0.2),
        up: Vec3::Y,
        vfov_deg: 2.0,
    };
    let seen_along = (camera.target - camera.eye).normalize();
    // Light that is mirrored at the camera's target arrives at the camera.
    let direction = Vec3::new(-seen_along.x, seen_along.y, -seen_along.z);
    builder.finish(
        "peak",
        vec![Light::Directional {
            direction,
            irradiance: Vec3::new(1.0, 2.0, 3.0),
        }],
        Vec3::ZERO,
        camera,
    )
}

fn lobe_scenes() -> Vec<(&'static str, Scene)> {
    let dielectric = |roughness| Material {
        albedo: Vec3::new(0.7, 0.4, 0.1),
        specular: Some(Specular {
            f0: Vec3::splat(0.04),
            roughness,
            metalness: 0.0,
            texture: None,
        }),
        ..Material::default()
    };
    let black = |roughness| Material {
        albedo: Vec3::ZERO,
        specular: Some(Specular {
            f0: Vec3::new(0.04, 0.5, 1.0),
            roughness,
            metalness: 0.0,
            texture: None,
        }),
        ..Material::default()
    };
    let metal = |roughness| Material {
        albedo: Vec3::new(0.95, 0.6, 0.2),
        specular: Some(Specular {
            f0: Vec3::splat(0.04),
            roughness,
            metalness: 1.0,
            texture: None,
        }),
        ..Material::default()
    };
    let matt = |roughness| Material {
        albedo: Vec3::new(0.7, 0.4, 0.1) * roughness,
        ..Material::default()
    };
    let behind = |scene: Scene| seen_from(scene, [0.06, -0.6, 1.9], [0.0, 0.0, 0.1], 50.0);
    vec![
        ("diffuse", lobes(matt)),
        ("dielectric", lobes(dielectric)),
        ("lobe alone", lobes(black)),
        ("metal", lobes(metal)),
        ("metal from behind", behind(lobes(metal))),
        ("diffuse from behind", behind(lobes(matt))),
        ("peak at the least roughness", peak(0.0)),
        ("peak at roughness 0.05", peak(0.05)),
        ("peak at roughness 0.1", peak(0.1)),
        ("peak at roughness 0.3", peak(0.3)),
    ]
}

/// Nothing casts a shadow here but on the other side: each lobe at each roughness against the
/// papers' formula, evaluated at what the G-buffer holds.
#[test]
fn lobes_are_those_of_the_papers() {
    let gpu = gpu();
    for (name, scene) in lobe_scenes() {
        let lit = light_up(&gpu, &scene, SIZE, 128);
        let bounds = by_maps(&scene, &lit);
        let tolerance: Vec<DVec3> = lit
            .reflectors
            .iter()
            .map(|at| tolerance(&scene, at, 1e-3))
            .collect();
        let worst =
            judge(&lit.seen, &bounds, &tolerance).unwrap_or_else(|error| panic!("{name}: {error}"));
        let bright = bounds.iter().filter(|bounds| bounds[0].x > 0.0).count();
        let certain = bounds
            .iter()
            .filter(|bounds| bounds[0] == bounds[1])
            .count();
        println!("{name}: {worst:.3} of the tolerance, {bright} lit pixels, {certain} certain");
        assert!(
            bright > 400 && certain > lit.seen.len() * 9 / 10,
            "{name}: {bright}, {certain}"
        );
        planted_errors_fail(&lit.seen, &bounds, &tolerance);
    }
}

/// Strips of ground that rise and fall by a tenth: light reaches all of them, and their edges throw
/// no shadow on each other, in maps of any size.
#[test]
fn creases_throw_no_shadows() {
    let gpu = gpu();
    let mut builder = Builder::default();
    let ground = builder.matte("ground", Vec3::splat(0.5));
    for strip in 0..24 {
        let rise = if strip % 2 == 0 { 0.01 } else { -0.01 };
        let corner = Vec3::new(0.1 * strip as f32 - 1.2, 0.005 - 0.5 * rise, -1.2);
        builder.quad(ground, corner, 2.4 * Vec3::Z, Vec3::new(0.1, rise, 0.0));
    }
    let camera = Camera {
        eye: Vec3::new(0.06, 0.7, 1.9),
        target: Vec3::new(0.0, 0.0, 0.15),
        up: Vec3::Y,
        vfov_deg: 50.0,
    };
    let scene = builder.finish("strips", Vec::new(), Vec3::ZERO, camera);
    for (name, light) in &kinds()[..2] {
        let scene = lit_by(scene.clone(), vec![*light]);
        for map_size in [64, 256, 1024] {
            let lit = light_up(&gpu, &scene, SIZE, map_size);
            let of =
                |at: &Option<Reflector>| at.map_or(DVec3::ZERO, |at| total(reflect(light, &at)));
            let bounds: Vec<Bounds> = lit.reflectors.iter().map(|at| [of(at); 2]).collect();
            let tolerance: Vec<DVec3> = lit
                .reflectors
                .iter()
                .map(|at| tolerance(&scene, at, 1e-3))
                .collect();
            judge(&lit.seen, &bounds, &tolerance)
                .unwrap_or_else(|error| panic!("{name}, {map_size} texels: {error}"));
        }
    }
}

/// As many cascades as there may be, with each filter, in maps so coarse that every border is seen:
/// what the maps' texels make of it at every pixel.
#[test]
fn cascades_and_filters_are_those_of_the_maps() {
    let gpu = gpu();
    let scene = lit_by(
        every_surface(true, false),
        kinds().into_iter().map(|(_, light)| light).collect(),
    );
    let sun = lit_by(scene.clone(), vec![kinds()[0].1]);
    for (scene, cascades, filter, sun_angle_deg) in [
        (&sun, 2, ShadowFilter::Pcf, 0.5),
        (&sun, 4, ShadowFilter::Pcf, 0.5),
        (&sun, 6, ShadowFilter::Point, 0.5),
        (&sun, 1, ShadowFilter::Point, 0.5),
        (&sun, 3, ShadowFilter::Pcss, 6.0),
        (&sun, 1, ShadowFilter::Pcss, 6.0),
        (&scene, 3, ShadowFilter::Pcf, 0.5),
        (&scene, 2, ShadowFilter::Pcss, 3.0),
    ] {
        let shadows = ShadowSettings {
            cascades,
            filter,
            sun_angle_deg,
            split_lambda: 0.7,
            ..ShadowSettings::of_resolution(48)
        };
        let lit = light_up_by(&gpu, scene, SIZE, shadows);
        let bounds = by_maps(scene, &lit);
        let tolerance: Vec<DVec3> = lit
            .reflectors
            .iter()
            .map(|at| tolerance(scene, at, 1e-3))
            .collect();
        let name = format!("{cascades} cascades, {filter}");
        let worst =
            judge(&lit.seen, &bounds, &tolerance).unwrap_or_else(|error| panic!("{name}: {error}"));
        let certain = bounds
            .iter()
            .filter(|[low, high]| (*high - *low).cmplt(DVec3::splat(0.01)).all())
            .count();
        println!("{name}: {worst:.3} of the tolerance, {certain} certain");
        assert!(
            certain > lit.seen.len() * 7 / 10,
            "{name}: {certain} of {} certain",
            lit.seen.len()
        );
        planted_errors_fail(&lit.seen, &bounds, &tolerance);
    }
}

/// A room of every surface under each kind of light and under all: what the maps' texels make of it
/// at every pixel, and away from the shadows' edges what exact rays say.
#[test]
fn direct_light_is_that_of_exact_rays() {
    let gpu = gpu();
    let room = |lights: Vec<Light>| lit_by(every_surface(true, true), lights);
    let mut scenes: Vec<(String, Scene)> = kinds()
        .into_iter()
        .map(|(name, light)| (name.to_owned(), room(vec![light])))
        .collect();
    scenes.push((
        "all".into(),
        room(kinds().into_iter().map(|(_, light)| light).collect()),
    ));
    for (name, scene) in scenes {
        let lit = light_up(&gpu, &scene, SIZE, 256);
        let bounds = by_maps(&scene, &lit);
        let tolerance: Vec<DVec3> = lit
            .reflectors
            .iter()
            .map(|at| tolerance(&scene, at, 1e-3))
            .collect();
        let worst =
            judge(&lit.seen, &bounds, &tolerance).unwrap_or_else(|error| panic!("{name}: {error}"));
        planted_errors_fail(&lit.seen, &bounds, &tolerance);
        if scene.lights.len() > 1 {
            println!("{name}: {worst:.3} of the tolerance");
            continue;
        }
        let (shares, certain) = check_rays(&name, &scene, &lit, &tolerance);
        println!(
            "{name}: {worst:.3} of the tolerance; by rays {} lit and {} hidden of {} that face \
             the light",
            shares[1], shares[0], certain
        );
        assert!(
            shares[0] > 60 && shares[1] > 300 && 100 * (shares[0] + shares[1]) > 88 * certain,
            "{name}: {shares:?} of {certain}"
        );
    }
}

/// Compares with exact rays; numbers of hidden and of lit pixels, and of those that face the light.
fn check_rays(name: &str, scene: &Scene, lit: &Lit, tolerance: &[DVec3]) -> ([usize; 2], usize) {
    let scenery = Scenery::new(scene);
    let (light, maps) = (&scene.lights[0], &lit.maps[0]);
    let answers: Vec<Option<bool>> = lit
        .reflectors
        .par_iter()
        .map(|at| {
            let at = at.as_ref()?;
            by_rays(&scenery, &maps[map_of(maps, at.position)], at)
        })
        .collect();
    let (mut shares, mut facing) = ([0; 2], 0);
    for (pixel, at) in lit.reflectors.iter().enumerate() {
        let Some(at) = at else { continue };
        let reflected = total(reflect(light, at));
        if reflected == DVec3::ZERO {
            assert_eq!(
                lit.seen[pixel],
                DVec3::ZERO,
                "{name}, pixel {pixel} faces away"
            );
            continue;
        }
        facing += 1;
        let Some(is_lit) = answers[pixel] else {
            continue;
        };
        shares[usize::from(is_lit)] += 1;
        let expected = if is_lit { reflected } else { DVec3::ZERO };
        let off = (lit.seen[pixel] - expected).abs();
        assert!(
            off.cmple(tolerance[pixel]).all(),
            "{name}, pixel {pixel}: {} for {expected} by rays",
            lit.seen[pixel]
        );
    }
    (shares, facing)
}

/// A point light in a box, and before each of its walls a plate of another size: all six faces of
/// its shadow map are looked up, and none is another's.
#[test]
fn a_point_light_has_six_shadow_maps() {
    let gpu = gpu();
    let mut builder = Builder::default();
    let wall = builder.matte("wall", Vec3::splat(0.7));
    builder.room([wall; 6], Vec3::splat(-1.0), Vec3::ONE, false);
    let axes = [
        Vec3::X,
        Vec3::NEG_X,
        Vec3::Y,
        Vec3::NEG_Y,
        Vec3::Z,
        Vec3::NEG_Z,
    ];
    for (index, axis) in axes.into_iter().enumerate() {
        let (across, up) = (
            axis.any_orthonormal_vector(),
            axis.cross(axis.any_orthonormal_vector()),
        );
        let half = 0.14 + 0.02 * index as f32;
        let corner = 0.5 * axis + across * (0.1 - half) + up * (0.05 * index as f32 - half);
        builder.quad(wall, corner, across * (2.0 * half), up * half);
    }
    let light = Light::Point {
        position: Vec3::new(0.02, -0.03, 0.04),
        intensity: Vec3::ONE,
    };
    let scene = builder.finish("box", vec![light], Vec3::ZERO, Camera::default());
    for (index, axis) in axes.into_iter().enumerate() {
        // From beside the plates, so that their shadows are seen.
        let (across, up) = (
            axis.any_orthonormal_vector(),
            axis.cross(axis.any_orthonormal_vector()),
        );
        let camera = Camera {
            eye: -0.2 * axis - 0.38 * across - 0.34 * up,
            target: axis,
            up,
            vfov_deg: 80.0,
        };
        let scene = Scene {
            camera,
            ..scene.clone()
        };
        let lit = light_up(&gpu, &scene, [40, 40], 96);
        let bounds = by_maps(&scene, &lit);
        let tolerance: Vec<DVec3> = lit
            .reflectors
            .iter()
            .map(|at| tolerance(&scene, at, 1e-3))
            .collect();
        let worst = judge(&lit.seen, &bounds, &tolerance)
            .unwrap_or_else(|error| panic!("along {axis}: {error}"));
        let (shares, facing) = check_rays(&format!("along {axis}"), &scene, &lit, &tolerance);
        let in_face = lit
            .reflectors
            .iter()
            .flatten()
            .filter(|at| map_of(&lit.maps[0], at.position) == index)
            .count();
        println!(
            "along {axis}: {worst:.3} of the tolerance; {shares:?} of {facing}, {in_face} in this \
             face"
        );
        assert!(
            shares[0] > 20 && shares[1] > 300 && in_face > 400,
            "along {axis}: {shares:?}, {in_face}"
        );
    }
}

/// What the path tracer sees at the centre of a pixel is what the oracle sees.
fn check_surface(traced: &ReferenceImage, pixel: usize, surface: &Surface) {
    let near = |found: Vec3, expected: DVec3| {
        (found.as_dvec3() - expected)
            .abs()
            .cmple(1e-4 + 1e-4 * expected.abs())
            .all()
    };
    assert!(
        near(traced.guide.position[pixel], surface.position),
        "pixel {pixel}: {} for {surface:?}",
        traced.guide.position[pixel]
    );
    assert!(
        near(
            Vec3::splat(traced.guide.depth_m[pixel]),
            DVec3::splat(surface.depth_m)
        ),
        "pixel {pixel}: {} for {surface:?}",
        traced.guide.depth_m[pixel]
    );
    assert!(
        near(traced.guide.normal[pixel], surface.geometric_normal),
        "pixel {pixel}: {} for {surface:?}",
        traced.guide.normal[pixel]
    );
    let aside = surface.shading_normal.dot(surface.geometric_normal).abs();
    assert!(
        near(traced.normal.pixels[pixel], surface.shading_normal) || aside < 1e-3,
        "pixel {pixel}: {} for {surface:?}",
        traced.normal.pixels[pixel]
    );
    assert!(
        near(traced.albedo.pixels[pixel], surface.albedo),
        "pixel {pixel}: {} for {surface:?}",
        traced.albedo.pixels[pixel]
    );
    assert!(
        near(traced.emission.pixels[pixel], surface.emission),
        "pixel {pixel}: {} for {surface:?}",
        traced.emission.pixels[pixel]
    );
}

/// Away from the edges of shadows, the path tracer's direct light agrees with the papers' lobe and
/// exact rays, too.
#[test]
fn direct_light_of_the_reference_is_that_of_exact_rays() {
    let mut scenes = lobe_scenes();
    scenes.extend(
        kinds()
            .into_iter()
            .map(|(name, light)| (name, lit_by(every_surface(true, true), vec![light]))),
    );
    for (name, scene) in scenes {
        let settings = reference::Settings {
            width: SIZE[0],
            height: SIZE[1],
            bounces: Bounces::Count(0),
            filter: Filter::Center,
            sampling: Sampling::Fixed { spp: 1 },
            seed: 1,
            ..reference::Settings::default()
        };
        let traced = reference::render(&scene, &settings, &|_| {}).unwrap();
        let seen: Vec<DVec3> = traced
            .direct
            .pixels
            .iter()
            .map(|pixel| pixel.as_dvec3())
            .collect();
        let scenery = Scenery::new(&scene);
        let view = View::of_camera(&scene.camera, SIZE, 0.0);
        let of = |pixel: usize| {
            let at_px = centre(pixel, SIZE);
            let may_show = scenery.seen(&view, at_px);
            let ([triangle], false) = (&may_show.triangles[..], may_show.may_be_empty) else {
                return None;
            };
            let surface = scenery.surface(*triangle, &view, at_px)?;
            check_surface(&traced, pixel, &surface);
            let at = Reflector {
                position: surface.position,
                geometric_normal: surface.geometric_normal,
                shading_normal: surface.shading_normal,
                to_eye: surface.to_eye,
                albedo: surface.albedo,
                roughness: surface.roughness,
                f0: surface.f0,
            };
            let visible = scene
                .lights
                .iter()
                .map(|light| scenery.is_lit(&surface, light, 1e-4))
                .collect::<Option<Vec<bool>>>()?;
            let sum = scene
                .lights
                .iter()
                .zip(visible)
                .filter(|(_, visible)| *visible)
                .map(|(light, _)| total(reflect(light, &at)))
                .sum();
            Some((at, sum))
        };
        let expected: Vec<Option<(Reflector, DVec3)>> =
            (0..seen.len()).into_par_iter().map(of).collect();
        let known: Vec<usize> = (0..seen.len())
            .filter(|&pixel| expected[pixel].is_some())
            .collect();
        let pick = |pixel: &usize| expected[*pixel].unwrap();
        let bounds: Vec<Bounds> = known.iter().map(|pixel| [pick(pixel).1; 2]).collect();
        let tolerance: Vec<DVec3> = known
            .iter()
            .map(|pixel| tolerance(&scene, &Some(pick(pixel).0), 1e-3))
            .collect();
        let seen: Vec<DVec3> = known.iter().map(|pixel| seen[*pixel]).collect();
        let worst =
            judge(&seen, &bounds, &tolerance).unwrap_or_else(|error| panic!("{name}: {error}"));
        let lit = bounds.iter().filter(|bounds| bounds[0].x > 0.0).count();
        println!(
            "{name}: {worst:.3} of the tolerance at {} pixels, {lit} lit",
            known.len()
        );
        assert!(lit > 300, "{name}: {lit} lit pixels of {}", known.len());
        planted_errors_fail(&seen, &bounds, &tolerance);
    }
}

/// A floor whose normal map turns every other texel 37° to the left and the others 37° to the
/// right, 8 and more of them in each pixel. Their mean, and that of the normals between them, has a
/// length of 0.92. So much light they reflect, as the path tracer says, which looks at one place at
/// a time.
#[test]
fn normals_that_differ_within_a_pixel_share_its_light() {
    let gpu = gpu();
    let mut builder = Builder::default();
    let [left, right] = [[51, 128, 230, 255], [204, 128, 230, 255]];
    let ridges = Texture {
        name: "ridges".into(),
        kind: TextureKind::Normal,
        width: 2,
        height: 2,
        texels: vec![left, right, left, right],
    };
    builder.scene.textures = vec![ridges.into()];
    let ridged = builder.material(Material {
        albedo: Vec3::new(0.75, 0.5, 0.25),
        normal_texture: Some(0),
        ..Material::default()
    });
    sheet(
        &mut builder,
        ridged,
        [Vec3::ZERO, Vec3::Z * 4.0, Vec3::X * 4.0],
        [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y].map(|uv| 512.0 * uv),
        0.0,
    );
    let camera = Camera {
        eye: Vec3::new(2.0, 3.0, 2.0),
        target: Vec3::new(2.0, 0.0, 2.0),
        up: Vec3::Z,
        vfov_deg: 50.0,
    };
    let sun = Light::Directional {
        direction: Vec3::new(0.2, -1.0, 0.1).normalize(),
        irradiance: Vec3::ONE,
    };
    let scene = builder.finish("ridges", vec![sun], Vec3::ZERO, camera);
    let lit = light_up(&gpu, &scene, SIZE, 256);
    let settings = reference::Settings {
        width: SIZE[0],
        height: SIZE[1],
        bounces: Bounces::Count(0),
        filter: Filter::Box,
        sampling: Sampling::Fixed { spp: 64 },
        seed: 1,
        ..reference::Settings::default()
    };
    let traced = reference::render(&scene, &settings, &|_| {}).unwrap();
    let count = lit.seen.len() as f64;
    let seen: DVec3 = lit.seen.iter().sum::<DVec3>() / count;
    let right: DVec3 = (traced.direct.pixels.iter())
        .map(|pixel| pixel.as_dvec3())
        .sum::<DVec3>()
        / count;
    let ratio = seen / right;
    assert!(
        !exceeds((ratio - 1.0).abs().largest(), 0.012),
        "{seen} of {right}: {ratio}"
    );
}

/// An image of the screen's size with random texels of 0 to 2.
fn planted(
    gpu: &Gpu,
    name: &str,
    size: [u32; 2],
    random: &mut Random,
) -> (Arc<GpuImage>, Vec<[f32; 4]>) {
    let desc = ImageDesc {
        name: name.into(),
        extent: [size[0], size[1], 1],
        kind: ImageKind::D2,
        format: vk::Format::R32G32B32A32_SFLOAT,
        mips: 1,
        layers: 1,
        usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
        owner: Owner::Shared,
    };
    let image = gpu.create_image(&desc).unwrap();
    let texels: Vec<[f32; 4]> = (0..size[0] * size[1])
        .map(|_| [0; 4].map(|_: u8| 2.0 * random.unit()))
        .collect();
    gpu.upload_image(&image, 0, 0, bytemuck::cast_slice(&texels))
        .unwrap();
    (image, texels)
}

/// Whether two pictures are the same up to single precision; NaN is never.
fn same(seen: &Image, expected: impl Fn(usize) -> DVec3) -> Result<(), String> {
    for (pixel, seen) in seen.pixels.iter().enumerate() {
        let expected = expected(pixel);
        let is_near = (seen.as_dvec3() - expected)
            .abs()
            .cmple(1e-5 * expected.abs() + 2e-6)
            .all();
        if !is_near {
            return Err(format!("pixel {pixel}: {seen} for {expected}"));
        }
    }
    Ok(())
}

/// L = L_e + L_direct + ρ/π · E_i + L_s of planted images, with and without emission and a lobe;
/// and every output shows its own term, no other.
#[test]
fn the_composite_is_the_sum_and_outputs_are_its_terms() {
    let gpu = gpu();
    let size = [40, 30];
    for (glossy, emissive) in [(true, true), (false, false), (true, false), (false, true)] {
        let scene = seen_from(
            every_surface(glossy, emissive),
            [0.4, 1.2, 4.2],
            [0.0, 0.9, 0.0],
            45.0,
        );
        let scene = Scene {
            environment: Vec3::new(0.25, 0.5, 0.75).into(),
            ..scene
        };
        let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
        let drawn = draw_gbuffer(&gpu, &gpu_scene, &scene, size);
        let pixels = drawn.read(&gpu);
        let mut random = Random::new(9);
        let (diffuse, irradiance) = planted(&gpu, "diffuse", size, &mut random);
        let (specular, radiance) = planted(&gpu, "specular", size, &mut random);
        let (direct, mut reflected) = planted(&gpu, "direct", size, &mut random);
        for (texel, pixel) in reflected.iter_mut().zip(&pixels) {
            *texel = if pixel[0] > 0.0 {
                [texel[0], texel[1], texel[2], 1.0]
            } else {
                [0.0; 4]
            };
        }
        gpu.upload_image(&direct, 0, 0, bytemuck::cast_slice(&reflected))
            .unwrap();
        let light = IndirectLight {
            diffuse,
            specular: glossy.then_some(specular),
        };
        let output = Output {
            direct,
            ..Output::new(&gpu, size).unwrap()
        };
        let mut frame = Frame::new();
        frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
        output.draw_composite(&mut frame, &drawn.gbuffer, &light);
        gpu.submit(frame).unwrap();

        let is_surface = |pixel: usize| pixels[pixel][0] > 0.0;
        let rgb = |texel: [f32; 4]| DVec3::new(texel[0].into(), texel[1].into(), texel[2].into());
        let of_surface = |pixel: usize, value: DVec3| {
            if is_surface(pixel) {
                value
            } else {
                DVec3::ZERO
            }
        };
        let specular = |pixel: usize| {
            if glossy {
                rgb(radiance[pixel])
            } else {
                DVec3::ZERO
            }
        };
        let received = |pixel: usize| {
            of_surface(
                pixel,
                (0.25 + 0.75 * pixels[pixel][17]) * rgb(irradiance[pixel]),
            )
        };
        let indirect = |pixel: usize| {
            of_surface(
                pixel,
                xyz(&pixels[pixel], 7) / std::f64::consts::PI * received(pixel) + specular(pixel),
            )
        };
        let emitted = |pixel: usize| {
            if is_surface(pixel) {
                xyz(&pixels[pixel], 14)
            } else {
                scene.environment.uniform().as_dvec3()
            }
        };
        let expected = |aov: Aov, pixel: usize| match aov {
            Aov::Full => emitted(pixel) + rgb(reflected[pixel]) + indirect(pixel),
            Aov::Direct => rgb(reflected[pixel]),
            Aov::Indirect => indirect(pixel),
            Aov::Diffuse => received(pixel),
            Aov::Specular => specular(pixel),
            Aov::Visibility => DVec3::splat(irradiance[pixel][3].into()),
            Aov::Emission => emitted(pixel),
            Aov::Albedo => xyz(&pixels[pixel], 7),
            Aov::Normal => of_surface(pixel, xyz(&pixels[pixel], 4)),
            Aov::Depth => DVec3::splat(pixels[pixel][0]),
            Aov::Discontinuity => unreachable!("no image has it"),
        };
        assert!(
            (0..pixels.len()).any(is_surface) && !(0..pixels.len()).all(is_surface),
            "some pixels see the environment"
        );
        for aov in Aov::ALL {
            let seen = read_aov(&gpu, &drawn.gbuffer, &output, &light, aov).unwrap();
            let Some(seen) = seen else {
                assert_eq!(aov, Aov::Discontinuity);
                continue;
            };
            same(&seen, |pixel| expected(aov, pixel)).unwrap_or_else(|error| {
                panic!("{aov}, glossy {glossy}, emissive {emissive}: {error}")
            });
            // Planted: NaN in each channel, and every other output.
            for channel in 0..3 {
                let mut planted = seen.clone();
                planted.pixels[7][channel] = f32::NAN;
                assert!(
                    same(&planted, |pixel| expected(aov, pixel)).is_err(),
                    "{aov}: NaN in channel {channel} passes"
                );
            }
            for other in Aov::ALL
                .into_iter()
                .filter(|other| *other != aov && *other != Aov::Discontinuity)
                .filter(|_| glossy && emissive)
            {
                assert!(
                    same(&seen, |pixel| expected(other, pixel)).is_err(),
                    "{aov} passes for {other}"
                );
            }
        }
        let answer = read_indirect(&gpu, &drawn.gbuffer, &light).unwrap();
        let visibility = Image::from_grey(size[0], size[1], &answer.visibility);
        for (image, aov) in [
            (&answer.irradiance, Aov::Diffuse),
            (&answer.specular, Aov::Specular),
            (&visibility, Aov::Visibility),
        ] {
            same(image, |pixel| expected(aov, pixel)).unwrap();
        }
        let channel = |channel| read_surface(&gpu, &drawn.gbuffer, channel).unwrap();
        same(&channel(SurfaceChannel::GeometricNormal), |pixel| {
            of_surface(pixel, xyz(&pixels[pixel], 1))
        })
        .unwrap();
        same(&channel(SurfaceChannel::Roughness), |pixel| {
            DVec3::splat(pixels[pixel][10].max(0.0))
        })
        .unwrap();
        same(&channel(SurfaceChannel::F0), |pixel| {
            xyz(&pixels[pixel], 11)
        })
        .unwrap();
    }
}

/// Each code stands for the light that decodes to it: IEC 61966-2-1, both ways, in a file, too.
#[test]
fn pictures_are_encoded_as_srgb() {
    let decoded = |code: f64| linear_from_srgb(code / 255.0);
    for code in 0..=255u8 {
        let exact = f64::from(code);
        for nearby in [-0.49, 0.0, 0.49] {
            assert_eq!(
                srgb_from_linear(decoded((exact + nearby).clamp(0.0, 255.0)) as f32),
                code,
                "{code} + {nearby}"
            );
        }
    }
    assert_eq!(
        [f32::NAN, f32::NEG_INFINITY, -1.0, 2.0, f32::INFINITY].map(srgb_from_linear),
        [0, 0, 0, 255, 255]
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("codes.png");
    let picture = Image::from_fn(16, 16, |pixel| {
        let linear = |code: usize| 0.25 * decoded((code % 256) as f64) as f32;
        Vec3::new(linear(pixel), linear(pixel + 85), linear(255 - pixel))
    });
    write_png(&path, &picture, 4.0).unwrap();
    let read = image::open(&path).unwrap().into_rgb8();
    for (pixel, found) in read.pixels().enumerate() {
        assert_eq!(
            found.0.map(usize::from),
            [pixel, (pixel + 85) % 256, 255 - pixel],
            "pixel {pixel}"
        );
    }
}
