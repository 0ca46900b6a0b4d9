//! What glossy surfaces mirror by matrices of transfer, against the reference; and what normal maps
//! change.

use glam::{DVec3, Vec3};
use lumivox::frame::Renderer;
use lumivox::image::Image;
use lumivox::reference::{self, Bounces, Filter, Sampling};
use lumivox::scene::{Camera, Scene, Sky, Specular};

use super::probes_mirror::SIZE;
use crate::support::gpu;
use crate::support::technique::{
    Surfaces, block_errors, cases, frame, open_cornell, shoot, small_room,
};

/// A sky of .15 below and .5 to 1 above, blended over 10° on both sides of the horizon; where asked
/// for with a sun 30° wide, through the opening of the box.
fn sky(has_sun: bool) -> Sky {
    let (width, height) = (256, 128);
    let towards = DVec3::new(0.2, 0.5, 0.8).normalize();
    let image = Image::from_fn(width, height, |index| {
        let index = index as u32;
        let turn = f64::from(index % width) / f64::from(width) * std::f64::consts::TAU;
        let from_top = (f64::from(index / width) + 0.5) / f64::from(height) * std::f64::consts::PI;
        let flat = from_top.sin();
        let way = DVec3::new(flat * turn.sin(), from_top.cos(), -flat * turn.cos());
        let above = 0.5 + 0.5 * way.y.max(0.0);
        let blend = (0.5 + 0.5 * way.y.asin().to_degrees() / 10.0).clamp(0.0, 1.0);
        let sun = if has_sun && way.dot(towards) > 15f64.to_radians().cos() {
            9.35
        } else {
            0.0
        };
        Vec3::splat((0.15 + blend * (above - 0.15) + sun) as f32)
    });
    Sky::new(image, 0.0).unwrap()
}

/// The box with a glossy back wall, whose mirror image has the opening.
fn room(roughness: f32, has_sun: bool) -> Scene {
    let mut scene = open_cornell();
    scene.lights.clear();
    // Without its blocks, which would hide the wall.
    scene.triangles.truncate(10);
    scene.camera = Camera {
        eye: Vec3::new(0.3, 1.2, 0.9),
        target: Vec3::new(0.0, 1.0, -1.0),
        up: Vec3::Y,
        vfov_deg: 50.0,
    };
    scene.environment = sky(has_sun).into();
    let mut wall = scene.materials[0].clone();
    wall.specular = Some(Specular {
        f0: Vec3::splat(0.8),
        roughness,
        metalness: 0.0,
        texture: None,
    });
    scene.materials.push(wall);
    let glossy = scene.materials.len() as u32 - 1;
    for triangle in &mut scene.triangles {
        let corners = triangle
            .vertices
            .map(|at| scene.vertices[at as usize].position);
        if corners.iter().all(|corner| corner[2] == -1.0) {
            triangle.material = glossy;
        }
    }
    scene
}

fn reference_of(scene: &Scene, bounces: u32) -> reference::ReferenceImage {
    let settings = reference::Settings {
        width: SIZE[0],
        height: SIZE[1],
        bounces: Bounces::Count(bounces),
        filter: Filter::Center,
        sampling: Sampling::Fixed { spp: 256 },
        seed: 3,
        ..reference::Settings::default()
    };
    reference::render(scene, &settings, &|_| {}).unwrap()
}

/// Of a mirror image: five bands hold lobes of roughness .7, and of .5 under a smooth sky.
#[test]
fn rough_mirrors_are_the_references() {
    let gpu = gpu();
    let mut all = cases().into_iter();
    let case = all.find(|case| case.name() == "prt.glossy").unwrap();
    for (roughness, has_sun, most) in [(0.7, false, 0.03), (0.7, true, 0.16), (0.5, false, 0.12)] {
        let scene = room(roughness, has_sun);
        let expected = reference_of(&scene, 2);
        for (order, compress) in [("5", "none"), ("5", "cpca"), ("6", "none")] {
            let pairs = [
                ("bounces", "2"),
                ("out_order", order),
                ("compress", compress),
            ];
            let of = frame(SIZE[0], SIZE[1], 64);
            let settings = case.settings(&pairs);
            let made = Renderer::new(&gpu, &scene, case.entry, &settings, of).unwrap();
            let (mut renderer, _) = made;
            renderer.render(&scene.camera).unwrap();
            let found = renderer.indirect_light().unwrap().specular;
            let errors = block_errors(&found, &expected.light.specular, &expected.guide);
            println!("roughness {roughness}, sun {has_sun}, {order}, {compress}: {errors:.4?}");
            let bar = if order == "5" { most } else { f64::INFINITY };
            assert!(
                errors.mean_reference > 0.01 && errors.rel_rmse < bar,
                "{errors:?}"
            );
        }
    }
}

/// Normal maps change nothing by vectors. By matrices they bring light nearer to the reference's.
#[test]
fn normal_maps_bend_the_light() {
    let gpu = gpu();
    let mut all = cases().into_iter();
    let case = all.find(|case| case.name() == "prt.glossy").unwrap();
    let mut scene = small_room(Surfaces::Bumped, Vec::new());
    scene.environment = sky(false).into();
    let expected = reference_of(&scene, 3);
    let bumped = scene
        .materials
        .iter()
        .position(|own| own.normal_texture.is_some())
        .unwrap();
    let off = |transfer: &str| {
        let pairs = [("transfer", transfer), ("compress", "none")];
        let shot = shoot(&gpu, &scene, &case, &pairs, frame(SIZE[0], SIZE[1], 64)).unwrap();
        let pixels = (0..expected.guide.depth_m.len()).filter(|at| {
            expected.guide.is_surface(*at) && expected.guide.material[*at] == bumped as u32
        });
        let pairs = pixels.map(|at| {
            let wanted = expected.light.irradiance.pixels[at];
            (shot.light.irradiance.pixels[at] - wanted, wanted)
        });
        let (mut off, mut sum, mut count) = (0.0, 0.0, 0);
        for (difference, wanted) in pairs {
            off += difference.as_dvec3().length_squared();
            sum += wanted.as_dvec3().length_squared();
            count += 1;
        }
        assert!(count > 200, "{count} pixels");
        (off / sum).sqrt()
    };
    let [vector, matrix] = ["vector", "matrix"].map(off);
    println!("normal maps: vector {vector:.4}, matrix {matrix:.4}");
    assert!(matrix < 0.5 * vector && matrix < 0.1, "{vector} {matrix}");
}
