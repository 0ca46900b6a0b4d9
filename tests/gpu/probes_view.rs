//! Views of probes, and their figures at a surface.

use glam::{DVec3, Vec2, Vec3};
use lumivox::frame::{Renderer, Traced};
use lumivox::gi::entry::Entry;
use lumivox::gi::inspect::BeamAxis;
use lumivox::gi::probes::Lattice;
use lumivox::gi::probes::irradiance::ENTRY;
use lumivox::gi::probes::light_field;
use lumivox::gi::probes::oracle;
use lumivox::graph::Gpu;
use lumivox::image::{Aov, Image};
use lumivox::render::bvh::oracle::RayOracle;
use lumivox::scene::{Camera, Scene};

use crate::support::compare::{Largest, Worst};
use crate::support::gpu;
use crate::support::scenes::bundled;
use crate::support::technique::frame;

const SIZE: [u32; 2] = [96, 72];
const PROBES: u32 = 9;

fn renderer<'g>(gpu: &'g Gpu, scene: &Scene, pairs: &[&str]) -> Renderer<'g> {
    renderer_of(gpu, &ENTRY, scene, &[&["rays=64"], pairs].concat())
}

fn renderer_of<'g>(
    gpu: &'g Gpu,
    entry: &'static Entry,
    scene: &Scene,
    pairs: &[&str],
) -> Renderer<'g> {
    let probes = format!("probes={PROBES}");
    let settings = entry
        .settings(None, &[&[&*probes], pairs].concat())
        .unwrap();
    let frame = frame(SIZE[0], SIZE[1], 64);
    let (mut renderer, _) = Renderer::new(gpu, scene, entry, &settings, frame).unwrap();
    renderer.render(&scene.camera).unwrap();
    renderer
}

fn view(renderer: &Renderer<'_>, name: &str) -> Option<Image> {
    view_of(renderer, &ENTRY, name)
}

fn view_of(renderer: &Renderer<'_>, entry: &Entry, name: &str) -> Option<Image> {
    let mut rows = entry.views.iter().copied().flatten();
    let row = rows.find(|row| row.name == name).unwrap();
    renderer.view(row, 0).unwrap()
}

/// The first sphere that a ray meets before `end` (m): which, and where.
fn first_sphere(
    lattice: &Lattice,
    (eye, direction): (Vec3, Vec3),
    end: f32,
) -> Option<(u32, Vec3)> {
    let radius = 0.1 * lattice.cell();
    let meets = |probe: u32| {
        let way = lattice.place(probe) - eye;
        let nearest = way.dot(direction);
        let chord = radius * radius - (way - nearest * direction).length_squared();
        let distance = nearest - chord.max(0.0).sqrt();
        (chord > 0.0 && distance > 5.0 * radius && distance < end).then_some((probe, distance))
    };
    let met = (0..lattice.probe_count()).filter_map(meets);
    let (probe, distance) = met.min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some((probe, eye + distance * direction))
}

#[test]
fn spheres_are_where_probes_stand() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let mut renderer = renderer(&gpu, &scene, &["placement=lattice"]);
    let (low, high) = scene.bounds().unwrap();
    let lattice = Lattice::within((low, high), PROBES, 0.25);
    let (rays, cell) = (RayOracle::new(&scene), f64::from(lattice.cell()));
    let reach = 1.5 * f64::from(lattice.diagonal()) / cell;
    let map = |probe: u32| {
        oracle::moments(16, reach, |direction| {
            let ray = (lattice.place(probe), direction.as_vec3(), None);
            let hit = rays.closest(ray);
            hit.map_or(f64::INFINITY, |hit| f64::from(hit.distance) / cell)
        })
    };
    let maps: Vec<oracle::Map> = (0..lattice.probe_count()).map(map).collect();
    // From the front, and the other way from a corner.
    let back = Camera {
        eye: low.lerp(high, 0.1),
        target: high,
        ..scene.camera
    };
    for camera in [scene.camera, back] {
        renderer.render(&camera).unwrap();
        let shown = view(&renderer, "probe-distances").unwrap();
        check_spheres(&renderer, &shown, (&camera, &lattice), |probe, normal| {
            maps[probe as usize].at(normal).x / reach
        });
    }
}

/// Those of light fields, by what the texels of their directions see.
#[test]
fn spheres_of_light_fields_show_texels() {
    const EDGE: u32 = 16;
    let gpu = gpu();
    let scene = bundled("cornell");
    let entry = &light_field::ENTRY;
    let pairs = ["radiance_texels=16", "rays=1", "placement=lattice"];
    let renderer = renderer_of(&gpu, entry, &scene, &pairs);
    let outer_layer = entry.settings(None, &pairs).unwrap().number("outer_layer");
    let lattice = Lattice::within(scene.bounds().unwrap(), PROBES, outer_layer);
    let oracle = RayOracle::new(&scene);
    let reach = f64::from((lattice.spacing * (lattice.counts - 1).as_vec3()).length());
    let seen = |probe: u32, normal: DVec3| {
        let at = (oracle::octahedral(normal) * 0.5 + 0.5) * f64::from(EDGE);
        let towards = oracle::direction_of(at.floor() + 0.5, EDGE).as_vec3();
        oracle.closest((lattice.place(probe), towards, None))
    };
    let shown = view_of(&renderer, entry, "probe-distances").unwrap();
    check_spheres(
        &renderer,
        &shown,
        (&scene.camera, &lattice),
        |probe, normal| {
            seen(probe, normal).map_or(1.0, |hit| (f64::from(hit.distance) / reach).min(1.0))
        },
    );
    // Walls are red, green and white: each shows on some sphere, and in the maps.
    for name in ["probe-radiance", "probe-radiance-maps"] {
        let shown = view_of(&renderer, entry, name).unwrap();
        let count = |is_such: fn(&Vec3) -> bool| shown.pixels.iter().filter(|p| is_such(p)).count();
        let red = count(|light| light.x > 2.0 * light.y);
        let green = count(|light| light.y > 1.5 * light.x);
        let white = count(|light| light.z > 0.5 * light.x);
        println!("{name}: {red} red, {green} green, {white} white");
        assert!(red > 20 && green > 20 && white > 20, "{name}");
    }
}

/// Compares a view of distances with `distance` of a probe where a sphere's normal points.
fn check_spheres(
    renderer: &Renderer<'_>,
    shown: &Image,
    (camera, lattice): (&Camera, &Lattice),
    distance: impl Fn(u32, DVec3) -> f64,
) {
    let depth = renderer.aov(Aov::Depth).unwrap();
    let eye = camera.eye;
    let (mut spheres, mut off) = (0, 0);
    for pixel in 0..SIZE[0] * SIZE[1] {
        let centre = Vec2::new((pixel % SIZE[0]) as f32, (pixel / SIZE[0]) as f32) + 0.5;
        let depth_m = depth.pixels[pixel as usize].x;
        let is_surface = depth_m > 0.0 && depth_m.is_finite();
        let way = camera.position_at(centre, if is_surface { depth_m } else { 1.0 }, SIZE);
        let end = if is_surface {
            (way - eye).length()
        } else {
            f32::INFINITY
        };
        let met = first_sphere(lattice, (eye, (way - eye).normalize()), end);
        let expected = met.map_or(0.0, |(probe, at)| {
            let normal = (at - lattice.place(probe)).as_dvec3().normalize();
            distance(probe, normal)
        });
        let found = f64::from(shown.pixels[pixel as usize].x);
        spheres += u32::from(expected > 0.0);
        off += u32::from((found - expected).abs() > 0.02);
    }
    assert!(spheres > 100, "{spheres} pixels of spheres");
    // Outlines, where rounding decides.
    assert!(off * 400 <= spheres, "{off} of {spheres} pixels");
}

#[test]
fn moves_are_ways_from_the_lattice() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let largest = |pairs: &[&str]| {
        let shown = view(&renderer(&gpu, &scene, pairs), "probe-moves").unwrap();
        shown
            .pixels
            .iter()
            .map(|way| way.as_dvec3().abs().largest())
            .worst()
    };
    assert!(largest(&["placement=lattice"]) < 1e-5);
    let snapped = largest(&["placement=snap"]);
    assert!((0.1..1.0 + 1e-5).contains(&snapped), "{snapped}");
}

#[test]
fn views_of_distances_are_where_distances_are() {
    let gpu = gpu();
    let scene = bundled("cornell");
    for (visibility, has_distances) in [("moments", true), ("facing", false)] {
        let pair = format!("visibility={visibility}");
        let renderer = renderer(&gpu, &scene, &[&pair]);
        for name in ["probe-distances", "probe-sight", "probe-distance-maps"] {
            assert_eq!(
                view(&renderer, name).is_some(),
                has_distances,
                "{name}, {pair}"
            );
        }
        for name in ["probes", "probe-moves", "probe-irradiance-maps"] {
            assert!(view(&renderer, name).is_some(), "{name}, {pair}");
        }
    }
    let harmonics = renderer(&gpu, &scene, &["irradiance=sh2"]);
    assert!(view(&harmonics, "probe-irradiance-maps").is_none());
    // In an open box without furniture every probe is seen.
    let furnace = bundled("furnace");
    let sight = view(&renderer(&gpu, &furnace, &[]), "probe-sight").unwrap();
    let hidden = sight.pixels.iter().map(|share| 1.0 - share.y).worst();
    assert!(hidden < 0.1, "{hidden}");
}

/// The numbers of a figure.
fn numbers(text: &str) -> Vec<f64> {
    let words = text.split(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c)));
    words.filter_map(|word| word.parse().ok()).collect()
}

#[test]
fn figures_add_up_to_the_light_of_the_pixel() {
    let gpu = gpu();
    let scene = bundled("cornell");
    for pairs in [
        &[][..],
        &["gradient=on"],
        &["irradiance=sh2"],
        &["visibility=facing"],
        &["visibility=none"],
    ] {
        let renderer = renderer(&gpu, &scene, pairs);
        let light = renderer.indirect_light().unwrap();
        for pixel in [[20, 20], [50, 30], [70, 60], [48, 65]] {
            let Traced::Figures(figures) = renderer.trace(pixel, BeamAxis::Normal, None).unwrap()
            else {
                panic!("no figures at {pixel:?}");
            };
            let shares = figures
                .iter()
                .filter(|(name, _)| name.starts_with("probe "));
            let shares: Vec<f64> = shares.map(|(_, text)| share_of(text)).collect();
            assert_eq!(shares.len(), 8);
            let sum: f64 = shares.iter().sum();
            assert!((sum - 100.0).abs() < 1.0, "{pairs:?} at {pixel:?}: {sum}%");
            let own = figures.iter().find(|(name, _)| *name == "E of the surface");
            let found = DVec3::from_slice(&numbers(&own.unwrap().1)[..3]);
            let index = (pixel[0] + pixel[1] * SIZE[0]) as usize;
            let expected = light.irradiance.pixels[index].as_dvec3();
            let off = (found - expected).abs().largest() / expected.largest();
            assert!(off < 0.02, "{pairs:?} at {pixel:?}: {found} for {expected}");
        }
    }
}

/// The share of the light that a figure of a probe tells (%).
fn share_of(text: &str) -> f64 {
    let before = text.split('%').next().unwrap();
    *numbers(before).last().unwrap()
}
