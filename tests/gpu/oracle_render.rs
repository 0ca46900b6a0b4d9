//! `render.gbuffer`, `render.shadow_maps` and `render.rsm` on the device against rays through the
//! scene's triangles, in f64: every channel of every pixel.

use std::f64::consts::PI;

use crate::support::scenes::{scene_of, soup};
use crate::support::surfaces::{
    Choice, Drawn, GBufferPixel, NO_SURFACE, allowed, centre, draw_gbuffer, every_surface,
    gbuffer_pixel, judge, lit_by, planted_errors_fail, seen_from, undecided,
};
use crate::support::technique::Builder;
use crate::support::{Random, gpu};
use glam::{DVec2, DVec3, Vec3};
use lumivox::graph::{Frame, Gpu};
use lumivox::render::oracle::light::{light_at, spot_solid_angle};
use lumivox::render::oracle::{Scenery, TEXEL_ERROR, View};
use lumivox::render::{GpuLightView, GpuScene, LightMaps, MapChannel, read_light_map};
use lumivox::scene::{Camera, Light, Material, Scene, Texture, TextureKind};

const SIZE: [u32; 2] = [64, 48];

/// Octahedral normals of 2×16 bits are off by up to this in a coordinate.
const OCTAHEDRAL_ERROR: f64 = 6e-5;

/// Half floats, relative: a driver may round them to zero.
const HALF_ERROR: f64 = 1.0 / 1024.0;

/// Values of 10 bits: lavapipe rounds 1024 x down.
const TEN_BIT_ERROR: f64 = 1.01 / 1023.0;

/// How far each channel of a pixel may be off.
fn gbuffer_tolerance(
    scenery: &Scenery<'_>,
    view: &View,
    triangle: usize,
    at: DVec2,
    expected: &GBufferPixel,
) -> GBufferPixel {
    let material = scenery.material(triangle);
    let is_filtered = scenery
        .surface(triangle, view, at)
        .is_none_or(|surface| surface.texels_per_px > 1.0);
    let texels = |is_textured: bool, scale: f64| match is_textured {
        false => 0.0,
        true if is_filtered => f64::INFINITY,
        true => scale * TEXEL_ERROR,
    };
    // Where the two normals are perpendicular, either side is the viewer's.
    let dot: f64 = (1..4).map(|i| expected[i] * expected[i + 3]).sum();
    let turned = |component: f64| {
        if dot.abs() < 1e-3 {
            2.0 * component.abs()
        } else {
            0.0
        }
    };
    let has_lobe_texture = material.specular.is_some_and(|lobe| lobe.texture.is_some());
    let of_channel = |channel: usize| match channel {
        0 => 1e-5 * expected[0],
        1..=3 => OCTAHEDRAL_ERROR,
        4..=6 => {
            OCTAHEDRAL_ERROR
                + turned(expected[channel])
                + texels(material.normal_texture.is_some(), 3.0)
        }
        7..=9 | 11..=13 => {
            let is_textured = material.albedo_texture.is_some() || has_lobe_texture;
            1e-6 + HALF_ERROR * expected[channel] + texels(is_textured, 1.0)
        }
        10 => 1e-6 + HALF_ERROR * expected[10].abs() + texels(has_lobe_texture, 1.0),
        17 => 1e-6 + texels(material.normal_texture.is_some(), 0.0),
        _ => {
            1e-6 + 1e-6 * expected[channel]
                + texels(
                    material.emission_texture.is_some(),
                    f64::from(material.emission[channel - 14]),
                )
        }
    };
    std::array::from_fn(of_channel)
}

fn allowed_pixels(scene: &Scene, drawn: &Drawn) -> Vec<Vec<Choice<18>>> {
    let scenery = Scenery::new(scene);
    let of = |triangle, at| {
        Some(gbuffer_pixel(&scenery.surface(
            triangle,
            &drawn.view,
            at,
        )?))
    };
    allowed(
        &scenery,
        &drawn.view,
        NO_SURFACE,
        of,
        |triangle, at, expected| gbuffer_tolerance(&scenery, &drawn.view, triangle, at, expected),
    )
}

/// Everything at once from the front, from behind, from inside of a block and out of a wall; random
/// triangles with all that has broken a rasterizer.
fn pictures() -> Vec<(&'static str, Scene)> {
    let all = || every_surface(true, true);
    let random = |seed| {
        let mut random = Random::new(seed);
        let scene = scene_of(&soup(&mut random, 4), 2.0, &mut random);
        seen_from(scene, [2.2, 1.7, 9.3], [1.9, 2.1, 2.0], 50.0)
    };
    vec![
        ("diffuse", every_surface(false, false)),
        ("glossy", every_surface(true, false)),
        ("emissive", every_surface(false, true)),
        ("glossy and emissive", all()),
        (
            "from behind",
            seen_from(all(), [0.4, 1.2, -3.2], [0.0, 0.9, 0.0], 45.0),
        ),
        (
            "from the side",
            seen_from(all(), [-2.9, 2.6, 1.4], [0.0, 0.9, 0.0], 45.0),
        ),
        (
            "inside a block",
            seen_from(all(), [-0.35, 0.3, 0.15], [0.5, 0.6, -0.6], 80.0),
        ),
        (
            "in a wall",
            seen_from(all(), [-1.0, 1.1, 0.3], [0.6, 0.8, -0.3], 70.0),
        ),
        (
            "just before a wall",
            seen_from(all(), [-0.998, 1.1, 0.3], [-1.9, 1.0, 0.2], 70.0),
        ),
        (
            "a wall cut by the near plane",
            seen_from(all(), [-0.9997, 1.1, 0.3], [-1.0, 1.0, -0.9], 70.0),
        ),
        ("random triangles", random(3)),
        ("other random triangles", random(4)),
    ]
}

#[test]
fn g_buffers_hold_what_rays_find() {
    let gpu = gpu();
    for (name, scene) in pictures() {
        let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
        let drawn = draw_gbuffer(&gpu, &gpu_scene, &scene, SIZE);
        let seen = drawn.read(&gpu);
        let allowed = allowed_pixels(&scene, &drawn);
        let worst = judge(&seen, &allowed).unwrap_or_else(|error| panic!("{name}: {error}"));
        let filtered = allowed
            .iter()
            .flatten()
            .filter(|(_, tolerance)| tolerance.iter().any(|tolerance| tolerance.is_infinite()))
            .count();
        let (undecided, filtered) = (undecided(&allowed), filtered as f64 / seen.len() as f64);
        println!(
            "{name}: {worst:.3} of the tolerance, {undecided:.3} on edges, {filtered:.3} filtered"
        );
        let most = if name.contains("random") { 0.15 } else { 0.05 };
        assert!(
            undecided <= most && filtered <= 0.02,
            "{name}: {undecided}, {filtered}"
        );
        if name == "glossy and emissive" {
            planted_errors_fail(&seen, &allowed);
        }
    }
}

/// Far away, a texture is the mean of its decoded texels, neither of its codes nor of one texel.
#[test]
fn textures_far_away_are_their_mean_light() {
    let gpu = gpu();
    let mut builder = Builder::default();
    let texels = (0..64)
        .map(|i| {
            if (i % 8 + i / 8) % 2 == 0 {
                [255; 4]
            } else {
                [0, 0, 0, 255]
            }
        })
        .collect();
    builder.scene.textures.push(
        Texture {
            name: "board".into(),
            kind: TextureKind::Color,
            width: 8,
            height: 8,
            texels,
        }
        .into(),
    );
    let board = builder.material(Material {
        albedo: Vec3::new(1.0, 0.5, 0.25),
        albedo_texture: Some(0),
        ..Material::default()
    });
    builder.quad(board, Vec3::new(-0.5, -0.5, 0.0), Vec3::X, Vec3::Y);
    let camera = Camera {
        eye: Vec3::new(0.0, 0.0, 20.0),
        target: Vec3::ZERO,
        up: Vec3::Y,
        vfov_deg: 45.0,
    };
    let scene = builder.finish("board", Vec::new(), Vec3::ZERO, camera);
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let seen = draw_gbuffer(&gpu, &gpu_scene, &scene, [32, 32]).read(&gpu);
    let shown: Vec<_> = seen.iter().filter(|pixel| pixel[0] > 0.0).collect();
    assert!(!shown.is_empty());
    for pixel in shown {
        let off =
            (DVec3::new(pixel[7], pixel[8], pixel[9]) - 0.5 * DVec3::new(1.0, 0.5, 0.25)).abs();
        assert!(off.cmple(DVec3::splat(0.01)).all(), "{pixel:?}");
    }
}

/// Depth (m; −1 where there is nothing), normal turned to the light's side (maps hold either),
/// roots of the reflected share.
type Texel = [f64; 7];

const NO_TEXEL: Texel = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

const MAP_SIZE: u32 = 48;

/// Drawn light maps, and how each looks into the scene.
struct Maps {
    maps: LightMaps,
    views: Vec<GpuLightView>,
}

fn draw_maps(gpu: &Gpu, gpu_scene: &GpuScene, size: u32, with_rsm: bool) -> Maps {
    gpu_scene
        .set_frame(gpu, &gpu_scene.frame_constants(&Camera::default(), [8, 8]))
        .unwrap();
    let maps = LightMaps::new(gpu, gpu_scene, size, with_rsm).unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
    maps.draw(&mut frame, gpu_scene);
    gpu.submit(frame).unwrap();
    let views = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&maps.views).unwrap());
    Maps { maps, views }
}

impl Maps {
    /// All texels of one view.
    fn read(&self, gpu: &Gpu, view: u32) -> Vec<Texel> {
        let image = |channel| {
            read_light_map(gpu, &self.maps, channel, view)
                .unwrap()
                .map(|image| image.pixels)
        };
        let depth = image(MapChannel::Depth).unwrap();
        let (normal, reflected) = (
            image(MapChannel::Normal).unwrap(),
            image(MapChannel::Reflected).unwrap(),
        );
        let row = &self.views[view as usize];
        let view = View::of_light(row);
        let of = |at: usize| {
            let stored = f64::from(depth[at].x);
            let (near_m, range_m) = (f64::from(row.forward[3]), f64::from(row.right[3]));
            let depth_m = if row.origin_kind[3] == 0.0 {
                (1.0 - stored) * range_m
            } else {
                near_m / stored
            };
            let is_empty = stored == 0.0;
            let (_, ray) = view.ray(centre(at, view.size));
            let normal = normal[at].as_dvec3();
            let [x, y, z] = if is_empty {
                [0.0; 3]
            } else {
                (normal * -normal.dot(ray).signum()).to_array()
            };
            let [r, g, b] = reflected[at].as_dvec3().to_array().map(f64::sqrt);
            [if is_empty { -1.0 } else { depth_m }, x, y, z, r, g, b]
        };
        (0..depth.len()).map(of).collect()
    }
}

fn lights() -> Vec<Light> {
    vec![
        Light::Directional {
            direction: Vec3::new(0.3, -0.8, -0.5).normalize(),
            irradiance: Vec3::splat(3.0),
        },
        Light::Point {
            position: Vec3::new(0.15, 1.1, 0.55),
            intensity: Vec3::new(3.0, 2.0, 1.0),
        },
        Light::Spot {
            position: Vec3::new(0.4, 1.8, 1.3),
            direction: Vec3::new(-0.3, -0.7, -1.0).normalize(),
            intensity: Vec3::splat(4.0),
            inner_deg: 15.0,
            outer_deg: 50.0,
        },
    ]
}

/// Albedo × the light's share in a direction.
fn reflected_share(
    scenery: &Scenery<'_>,
    light: &Light,
    view: &View,
    triangle: usize,
    at: DVec2,
) -> Option<Texel> {
    let surface = scenery.surface(triangle, view, at)?;
    let share = match light {
        Light::Spot {
            position,
            intensity,
            ..
        } => {
            let (_, irradiance) = light_at(light, surface.position);
            irradiance.x * surface.position.distance_squared(position.as_dvec3())
                / f64::from(intensity.x)
        }
        _ => 1.0,
    };
    let [r, g, b] = (surface.albedo * share).to_array().map(f64::sqrt);
    let [x, y, z] = surface.geometric_normal.to_array();
    Some([surface.depth_m, x, y, z, r, g, b])
}

#[test]
fn light_maps_hold_what_rays_find() {
    let gpu = gpu();
    let scene = lit_by(every_surface(true, false), lights());
    let gpu_scene = GpuScene::new(&gpu, &scene).unwrap();
    let drawn = draw_maps(&gpu, &gpu_scene, MAP_SIZE, true);
    let plain = draw_maps(&gpu, &gpu_scene, MAP_SIZE, false);
    let scenery = Scenery::new(&scene);
    assert_eq!(drawn.views.len(), 8);
    for (index, row) in drawn.views.iter().enumerate() {
        let view = View::of_light(row);
        let light = &scene.lights[row.light[0] as usize];
        let of = |triangle, at| reflected_share(&scenery, light, &view, triangle, at);
        let tolerance = |triangle: usize, at, expected: &Texel| {
            let surface = scenery.surface(triangle, &view, at);
            let is_textured = scenery.material(triangle).albedo_texture.is_some();
            let is_filtered =
                is_textured && surface.is_none_or(|surface| surface.texels_per_px > 1.0);
            // The error of the root: a step of 10 bits, and what texels add to it.
            let root = |root: f64| {
                TEN_BIT_ERROR
                    + if is_textured {
                        (root * root + TEXEL_ERROR).sqrt() - root
                    } else {
                        0.0
                    }
            };
            std::array::from_fn(|i| match i {
                0 => 1e-5 * expected[0] + 1e-6,
                1..=3 => OCTAHEDRAL_ERROR + 1e-4,
                _ if is_filtered => f64::INFINITY,
                _ => root(expected[i]),
            })
        };
        let allowed = allowed(&scenery, &view, NO_TEXEL, of, tolerance);
        let seen = drawn.read(&gpu, index as u32);
        let worst = judge(&seen, &allowed).unwrap_or_else(|error| panic!("view {index}: {error}"));
        let (undecided, lit) = (
            undecided(&allowed),
            seen.iter().filter(|texel| texel[0] > 0.0).count(),
        );
        println!(
            "view {index}: {worst:.3} of the tolerance, {undecided:.3} on edges, {lit} texels see \
             a surface"
        );
        // The room is open towards +z.
        if index == 5 {
            assert!(
                undecided <= 0.05 && lit == 0,
                "view {index}: {undecided}, {lit}"
            );
        } else {
            assert!(
                undecided <= 0.1 && lit > 500,
                "view {index}: {undecided}, {lit}"
            );
            planted_errors_fail(&seen, &allowed);
        }
        let without = |maps: &Maps| gpu.read_image(&maps.maps.depth, 0, index as u32).unwrap();
        assert!(
            without(&drawn) == without(&plain),
            "view {index}: depth does not depend on the rest of the map"
        );
    }
}

/// The views are what the lights are: a directional light sees the whole scene, a point light all
/// directions once, a spot its cone.
#[test]
fn light_views_cover_what_the_light_reaches() {
    let gpu = gpu();
    let scene = lit_by(every_surface(false, false), lights());
    let drawn = draw_maps(&gpu, &GpuScene::new(&gpu, &scene).unwrap(), 16, false);
    let views: Vec<View> = drawn.views.iter().map(View::of_light).collect();
    let clip = |index: usize, point: DVec3| {
        let rows = drawn.views[index]
            .clip_from_world
            .map(|column| column.map(f64::from));
        let at = |row: usize| {
            rows[0][row] * point.x + rows[1][row] * point.y + rows[2][row] * point.z + rows[3][row]
        };
        (DVec2::new(at(0), at(1)) / at(3), at(2) / at(3), at(3))
    };
    assert_eq!(
        drawn
            .views
            .iter()
            .map(|view| view.light)
            .collect::<Vec<_>>(),
        [0, 1, 1, 1, 1, 1, 1, 2].map(|light| [light, 16, 0, 0])
    );
    let close = |a: DVec3, b: Vec3| a.distance(b.as_dvec3()) < 1e-5;
    for vertex in &scene.vertices {
        let (at, depth_m) = views[0].project(DVec3::from(vertex.position.map(f64::from)));
        let range_m = f64::from(drawn.views[0].right[3]);
        assert!(
            at.cmpgt(DVec2::ZERO).all()
                && at.cmplt(DVec2::splat(16.0)).all()
                && depth_m > 0.0
                && depth_m < range_m,
            "{vertex:?}: {at}, {depth_m}"
        );
    }
    let axes = [
        Vec3::X,
        Vec3::NEG_X,
        Vec3::Y,
        Vec3::NEG_Y,
        Vec3::Z,
        Vec3::NEG_Z,
    ];
    let [
        Light::Directional { direction: sun, .. },
        Light::Point { position, .. },
        Light::Spot {
            position: from,
            direction: beam,
            outer_deg,
            ..
        },
    ] = scene.lights[..]
    else {
        panic!("one light of each kind")
    };
    let forward = std::iter::once(sun).chain(axes).chain([beam]);
    for (index, (view, forward)) in views.iter().zip(forward).enumerate() {
        assert!(
            close(view.forward, forward) && view.is_parallel == (index == 0),
            "view {index}: {view:?}"
        );
        let [right, down] = [view.right, view.down].map(DVec3::normalize);
        assert!(
            right.dot(down).abs() < 1e-6
                && (right.cross(down).dot(view.forward).abs() - 1.0).abs() < 1e-5,
            "view {index}: {view:?}"
        );
        let half_width = match index {
            0 => continue,
            7 => f64::from(outer_deg).to_radians().tan(),
            _ => 1.0,
        };
        assert!(close(view.origin, if index == 7 { from } else { position }));
        assert!(
            [view.right, view.down]
                .iter()
                .all(|edge| edge.length() >= half_width * 0.999_999
                    && edge.length() <= half_width * 1.02),
            "view {index}"
        );
        assert!(
            index == 7
                || (view.right.length() - 1.0).abs() < 1e-6
                    && (view.down.length() - 1.0).abs() < 1e-6,
            "view {index}: six faces overlap"
        );
        assert!(
            view.near_m > 0.0 && view.near_m < 1e-3,
            "view {index}: {}",
            view.near_m
        );
    }
    let mut random = Random::new(5);
    for (index, view) in views.iter().enumerate() {
        for _ in 0..50 {
            let at = DVec2::new(random.unit().into(), random.unit().into());
            let depth_m = 0.01 + 3.0 * f64::from(random.unit());
            let (origin, direction) = view.ray(16.0 * at);
            let (map, stored, w) = clip(index, origin + depth_m * direction);
            let expected = if index == 0 {
                1.0 - depth_m / f64::from(drawn.views[0].right[3])
            } else {
                view.near_m / depth_m
            };
            assert!(
                map.distance(2.0 * at - 1.0) < 1e-4 && (stored - expected).abs() < 1e-5 && w > 0.0,
                "view {index}: {map} for {at}, {stored} for {expected}"
            );
        }
    }
}

/// Flux over a whole map has a closed form in a room of one albedo: ρ I 4π of a point light, ρ I
/// times the solid angle of a spot, ρ E times the area across the beam.
#[test]
fn flux_of_reflective_shadow_maps_has_its_closed_form() {
    let gpu = gpu();
    let albedo = Vec3::new(0.8, 0.4, 0.1);
    let mut builder = Builder::default();
    let wall = builder.matte("wall", albedo);
    builder.room([wall; 6], Vec3::splat(-1.0), Vec3::ONE, false);
    let position = Vec3::new(0.2, -0.1, 0.3);
    let lights = vec![
        Light::Directional {
            direction: Vec3::new(0.0, -1.0, 0.0),
            irradiance: Vec3::ONE,
        },
        Light::Point {
            position,
            intensity: Vec3::ONE,
        },
        Light::Spot {
            position,
            direction: Vec3::new(0.6, 0.0, 0.8),
            intensity: Vec3::ONE,
            inner_deg: 20.0,
            outer_deg: 60.0,
        },
    ];
    let scene = builder.finish("room", lights, Vec3::ZERO, Camera::default());
    let size = 64;
    let drawn = draw_maps(&gpu, &GpuScene::new(&gpu, &scene).unwrap(), size, true);
    let mut flux = [DVec3::ZERO; 3];
    for (index, row) in drawn.views.iter().enumerate() {
        let view = View::of_light(row);
        for (pixel, texel) in drawn
            .read(&gpu, index as u32)
            .into_iter()
            .enumerate()
            .filter(|(_, texel)| texel[0] >= 0.0)
        {
            let (_, ray) = view.ray(centre(pixel, view.size));
            let across = 4.0 * view.right.length() * view.down.length() / f64::from(size).powi(2);
            let extent = if view.is_parallel {
                across
            } else {
                across / ray.length().powi(3)
            };
            flux[row.light[0] as usize] +=
                extent * DVec3::new(texel[4], texel[5], texel[6]).powf(2.0);
        }
    }
    // A texel at the edge of the scene is seen whole or not at all; roots of 10 bits.
    for (flux, (extent, tolerance)) in flux.into_iter().zip([
        (4.0, 0.01),
        (4.0 * PI, 1e-4),
        (spot_solid_angle(20.0, 60.0), 1e-3),
    ]) {
        let share = flux / (albedo.as_dvec3() * extent);
        println!("{share} of the closed form");
        let rounding = 2.0 * TEN_BIT_ERROR / albedo.as_dvec3().powf(0.5);
        assert!(
            (share - 1.0).abs().cmple(tolerance + rounding).all(),
            "{share}"
        );
    }
}
