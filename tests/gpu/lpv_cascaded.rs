//! Nested grids of light propagation volumes: light from outer to inner ones, and what moves.

use std::collections::HashMap;
use std::f64::consts::PI;

use crate::lpv::read_light;
use crate::support::compare::{Largest, Worst};
use crate::support::scenes::bundled;
use crate::support::technique::{block_errors, shared_scene};
use crate::support::{Random, ValidatedGpu, gpu, read_words};
use crate::techniques_analytic::reference;
use glam::{DVec3, DVec4, IVec3, Vec3};
use lumivox::gi::lpv::cascaded::{self, CascadedLpv, Layout};
use lumivox::gi::lpv::faces::Side;
use lumivox::gi::lpv::inject::flux_unit;
use lumivox::gi::lpv::oracle::{self, Boundary};
use lumivox::gi::lpv::{CellGrid, Cells, Propagation};
use lumivox::gi::registry;
use lumivox::gi::{Change, Context, IndirectLight, Inputs, MapNeeds, Settings, Technique};
use lumivox::graph::{Frame, Gpu};
use lumivox::image::{GuideImage, Image, NO_SURFACE};
use lumivox::render::{Follows, GBuffer, GpuScene, LightMaps, Output, screen_image};
use lumivox::scene::Scene;

fn settings(pairs: &[&str]) -> Settings {
    cascaded::ENTRY.settings(Some("accurate"), pairs).unwrap()
}

/// The technique in a scene, and what it reads.
struct Walk<'g> {
    gpu: &'g ValidatedGpu,
    scene: GpuScene,
    maps: LightMaps,
    gbuffer: GBuffer,
    output: Output,
    technique: CascadedLpv,
}

impl<'g> Walk<'g> {
    fn new(gpu: &'g ValidatedGpu, scene: &Scene, settings: &Settings, eye: Vec3) -> Self {
        Walk::of_size(gpu, scene, settings, (eye, [8, 8], 64))
    }

    /// With grids for a camera at `eye`, pictures of this size (px), maps of so many texels.
    fn of_size(
        gpu: &'g ValidatedGpu,
        scene: &Scene,
        settings: &Settings,
        (eye, size, texels): (Vec3, [u32; 2], u32),
    ) -> Self {
        let on_gpu = GpuScene::new(gpu, scene).unwrap();
        let constants = on_gpu.frame_constants(&scene.camera, size);
        on_gpu.set_frame(gpu, &constants).unwrap();
        let context = Context {
            gpu,
            scene: &on_gpu,
            size,
            eye,
            lend: registry::lend,
        };
        let mut technique = CascadedLpv::new(&context, settings).unwrap();
        technique.build(&context).unwrap();
        let is_reflective = technique.needs().maps == MapNeeds::Reflective;
        Walk {
            gpu,
            maps: LightMaps::new(gpu, &on_gpu, texels, is_reflective).unwrap(),
            gbuffer: GBuffer::new(gpu, &on_gpu, size, Follows::Nothing).unwrap(),
            output: Output::new(gpu, size).unwrap(),
            scene: on_gpu,
            technique,
        }
    }

    fn follow(&mut self, eye: Vec3) {
        let context = Context {
            gpu: self.gpu,
            scene: &self.scene,
            size: self.gbuffer.size,
            eye,
            lend: registry::lend,
        };
        self.technique.follow(&context, Change::Camera).unwrap();
    }

    /// A frame.
    fn light(&mut self) -> IndirectLight {
        let mut frame = Frame::new();
        frame.set_scene(&self.scene.set, &self.scene.materials);
        self.maps.draw(&mut frame, &self.scene);
        self.gbuffer.draw(&mut frame, &self.scene);
        let given = Inputs {
            scene: &self.scene,
            maps: &self.maps,
            rsm: &self.maps,
            gbuffer: &self.gbuffer,
            direct: &self.output.direct,
            is_still: false,
        };
        self.technique.update(&mut frame, &given);
        let diffuse = screen_image(self.gpu, "diffuse", self.gbuffer.size).unwrap();
        let receivers = self.gbuffer.receivers(&self.scene, &diffuse);
        self.technique.gather(&mut frame, &given, &receivers);
        let specular = self.technique.mirror(&mut frame, &given);
        self.gpu.submit(frame).unwrap();
        IndirectLight { diffuse, specular }
    }

    /// All that the levels hold, bit by bit, with sides by cell and face.
    fn state(&mut self) -> Vec<Vec<u32>> {
        self.light();
        let light = &self.technique.levels[0].light;
        let images = [Some(&light.low), light.band2.as_ref()];
        let read = |image| self.gpu.read_image(image, 0, 0).unwrap();
        let light = images
            .into_iter()
            .flatten()
            .flat_map(read)
            .collect::<Vec<_>>();
        let light = bytemuck::pod_collect_to_vec(&light);
        let mut all = Vec::new();
        for cells in &self.technique.levels {
            let words = read_words(self.gpu, &cells.faces.words);
            if let Some(sides) = &cells.faces.sides {
                let list = read_words(self.gpu, &sides.list);
                let row = size_of::<Side>() / 4;
                let first = |word: &u32| (word >> 8) as usize * row;
                let of = |word: &u32| {
                    list[first(word)..][..row * (word & 63).count_ones() as usize].to_vec()
                };
                let opaque = words.iter().filter(|word| **word & 63 != 0);
                all.push(opaque.flat_map(of).collect());
            }
            all.push(words.iter().map(|word| word & 63).collect());
        }
        all.push(light);
        all
    }
}

fn side_light(gpu: &Gpu, cells: &Cells) -> Vec<DVec4> {
    let Some(sides) = &cells.faces.sides else {
        return Vec::new();
    };
    let texels = gpu.read_buffer(&sides.light).unwrap();
    let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&texels);
    let radiance = |texel: &[f32; 4]| f64::from(cells.scale) * DVec4::from(texel.map(f64::from));
    texels.iter().map(radiance).collect()
}

fn flux_of(gpu: &Gpu, cells: &Cells, unit: f64) -> Vec<[DVec3; 3]> {
    let steps = read_words(gpu, &cells.flux);
    let count = cells.grid.count() as usize;
    let number =
        |cell: usize, place: usize| unit * f64::from(steps[place * count + cell].cast_signed());
    let colour =
        |cell, colour: usize| DVec3::from([0, 1, 2].map(|axis| number(cell, 3 * colour + axis)));
    (0..count)
        .map(|cell| [0, 1, 2].map(|of| colour(cell, of)))
        .collect()
}

fn cell_at(grid: &CellGrid, index: usize) -> IVec3 {
    let (index, size) = (index as u32, grid.size);
    IVec3::new(
        (index % size.x).cast_signed(),
        (index / size.x % size.y).cast_signed(),
        (index / (size.x * size.y)).cast_signed(),
    )
}

/// Radiance of all cells, by the bits of a direction.
type Fields = HashMap<[u64; 3], Vec<DVec4>>;

/// From the outermost grid inwards, each as the oracle sweeps it with what the oracle's sweep of
/// the grid around it brings to its border.
#[test]
fn nested_light_is_the_oracles() {
    let gpu = gpu();
    let scene = bundled("cornell");
    for (source, directions, eye) in [
        ("faces", 33, Vec3::new(0.1, 0.7, 0.2)),
        ("rsm", 40, Vec3::new(-0.6, 1.4, -0.3)),
    ] {
        let pairs = [
            "resolution=16".to_owned(),
            format!("source={source}"),
            format!("directions={directions}"),
        ];
        let settings = settings(&pairs.each_ref().map(String::as_str));
        let mut walk = Walk::new(&gpu, &scene, &settings, eye);
        walk.light();
        let mut outer: Option<(CellGrid, Fields)> = None;
        assert_eq!(walk.technique.levels.len(), 3);
        for (level, cells) in walk.technique.levels.iter().enumerate() {
            let Propagation::Sweep(sweep) = &*cells.propagation else {
                panic!("there is no sweep");
            };
            let grid = &cells.grid;
            let unit = f64::from(flux_unit(&walk.scene.lights, grid));
            let (words, sides) = (
                read_words(&gpu, &cells.faces.words),
                side_light(&gpu, cells),
            );
            let flux = flux_of(&gpu, cells, unit);
            let face_m2 = f64::from(grid.cell_size).powi(2);
            let key = |direction: DVec3| direction.to_array().map(f64::to_bits);
            let boundary = Boundary {
                faces: &words,
                side: &|cell, face| {
                    let before = (words[cell] & ((1 << face) - 1)).count_ones();
                    let place = ((words[cell] >> 8) + before) as usize;
                    sides.get(place).copied().unwrap_or_default()
                },
                inflow: &|cell, face, direction| {
                    let Some((around, fields)) = &outer else {
                        return DVec4::W;
                    };
                    let mut behind: IVec3 = (grid.first + cell_at(grid, cell)) >> 1;
                    behind[(face / 2) as usize] += if face % 2 == 0 { -1 } else { 1 };
                    let place = (behind - around.first).as_uvec3();
                    fields[&key(direction)][around.index(place)]
                },
                source: &|cell, direction| {
                    let [r, g, b] = flux[cell].map(|vector| vector.dot(direction).max(0.0));
                    DVec3::new(r, g, b).extend(0.0) / (PI * face_m2)
                },
            };
            let swept = oracle::sweep(grid, &sweep.directions, &boundary);
            let got = read_light(&gpu, cells);
            let largest = |channel: usize| {
                let all = swept.light.iter().map(|cell| cell[0][channel].abs());
                all.worst().max(1e-9)
            };
            let scale = DVec4::from([0, 1, 2, 3].map(largest));
            let errors = got.iter().zip(&swept.light).flat_map(|(got, expected)| {
                let error = |i: usize| {
                    let slack = scale + 20.0 * expected[i].abs();
                    ((got[i] - expected[i]) / slack).abs().truncate().largest()
                };
                (0..9).map(error)
            });
            let worst = errors.worst();
            println!("{source}, level {level}: {worst:.1e}");
            assert!(worst < 2e-3, "{source}, level {level}");
            let all = sweep.directions.all.iter();
            let field = |&(direction, _): &(DVec3, f64)| {
                (key(direction), oracle::field(grid, &boundary, direction))
            };
            outer = Some((*grid, all.map(field).collect()));
        }
    }
}

fn same_bits(name: &str, got: &[Vec<u32>], expected: &[Vec<u32>]) {
    for (part, (got, expected)) in got.iter().zip(expected).enumerate() {
        assert_eq!(got.len(), expected.len(), "{name}, part {part}: lengths");
        let differ = |(_, (a, b)): &(usize, (&u32, &u32))| a != b;
        let different: Vec<_> = got
            .iter()
            .zip(expected)
            .enumerate()
            .filter(differ)
            .collect();
        let first = &different[..different.len().min(8)];
        assert!(
            different.is_empty(),
            "{name}, part {part}: {} of {} words differ, the first {first:x?}",
            different.len(),
            got.len()
        );
    }
}

/// 1,000 steps there and back, over the borders of cells of all levels: every bit of faces, sides
/// and light is as before, and as in grids that were never elsewhere.
#[test]
fn a_walk_there_and_back_leaves_every_bit() {
    let gpu = gpu();
    let mut random = Random::new(20);
    for (name, cell_size, steps) in [("cornell", 0.05, 1000), ("atrium", 0.4, 150)] {
        let scene = bundled(name);
        let size = format!("cell_size={cell_size}");
        let settings = settings(&["resolution=16", "levels=3", "directions=24", &size]);
        let start = scene.camera.eye.lerp(scene.camera.target, 0.4);
        let mut walk = Walk::new(&gpu, &scene, &settings, start);
        let before = walk.state();
        let mut path = vec![start];
        let mut heading = Vec3::new(0.7, 0.2, -0.6);
        while path.len() <= steps {
            let at = path[path.len() - 1] + cell_size * heading;
            let (low, high) = scene.bounds().unwrap();
            let is_inside = at.clamp(low, high) == at;
            if !is_inside || random.unit() < 0.05 {
                heading = 2.0 * Vec3::from([0, 1, 2].map(|_| random.unit())) - 1.0;
            }
            if is_inside {
                path.push(at);
            }
        }
        let mut moves = 0;
        let mut go = |walk: &mut Walk<'_>, eye: Vec3| {
            let places = |walk: &Walk<'_>| {
                let grids = walk.technique.levels.iter().map(|cells| cells.grid.first);
                grids.collect::<Vec<_>>()
            };
            let from = places(walk);
            walk.follow(eye);
            let after = places(walk);
            moves += from.iter().zip(&after).filter(|(a, b)| a != b).count();
        };
        for eye in &path {
            go(&mut walk, *eye);
        }
        let far = walk.state();
        let end = path[path.len() - 1];
        let fresh = Walk::new(&gpu, &scene, &settings, end).state();
        same_bits(
            &format!("{name}, grids that were never elsewhere"),
            &far,
            &fresh,
        );
        for eye in path.iter().rev() {
            go(&mut walk, *eye);
        }
        same_bits(&format!("{name}, back again"), &walk.state(), &before);
        println!("{name}: {steps} steps, {moves} moves of levels");
        assert!(moves > 100, "{name}: {moves} moves");
    }
}

/// Step of the picture between neighbouring pixels of one plane, of which one is in a box and the
/// other is not: RMS, in the mean of the whole picture.
fn step_across(
    image: &Image,
    whole: &Image,
    guide: &GuideImage,
    is_inside: impl Fn(Vec3) -> bool,
) -> f64 {
    let (width, mut steps) = (guide.width as usize, Vec::new());
    for at in 0..image.pixels.len() {
        for next in [at + 1, at + width] {
            let is_row = next != at + 1 || !next.is_multiple_of(width);
            if next < image.pixels.len()
                && is_row
                && guide.is_surface(at)
                && guide.material[at] == guide.material[next]
                && guide.normal[at].dot(guide.normal[next]) > 0.9999
                && is_inside(guide.position[at]) != is_inside(guide.position[next])
            {
                let step = image.pixels[at] - image.pixels[next];
                steps.push(f64::from(step.element_sum()).powi(2) / 9.0);
            }
        }
    }
    assert!(steps.len() > 30, "{} pairs of pixels", steps.len());
    let mean = |sum: f64, count: usize| sum / count as f64;
    let pixels = whole.pixels.iter().map(|pixel| pixel.element_sum());
    let picture = mean(f64::from(pixels.sum::<f32>()) / 3.0, whole.pixels.len());
    mean(steps.iter().sum(), steps.len()).sqrt() / picture
}

/// What the camera of a scene sees, with grids for a camera elsewhere; rgb of ρ E/π.
fn indirect(
    gpu: &ValidatedGpu,
    scene: &Scene,
    guide: &GuideImage,
    settings: &Settings,
    eye: Vec3,
) -> Image {
    let size = [guide.width, guide.height];
    let mut walk = Walk::of_size(gpu, scene, settings, (eye, size, 512));
    let indirect = walk.light();
    let diffuse = gpu.read_image(&indirect.diffuse, 0, 0).unwrap();
    let irradiance: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&diffuse);
    let radiance = |(irradiance, material): (&[f32; 4], &u32)| {
        let albedo = scene
            .materials
            .get(*material as usize)
            .map(|material| material.albedo);
        albedo.unwrap_or_default() * Vec3::from_slice(irradiance) / std::f32::consts::PI
    };
    let pixels = irradiance.iter().zip(&guide.material).map(radiance);
    Image {
        width: guide.width,
        height: guide.height,
        pixels: pixels.collect(),
    }
}

/// Where light starts, cells along an edge; error inside the fine grid, in the one of the coarse
/// grid there, with the fine grid on the floor and at the upper front of a room. Measured. Where it
/// is above 1.2 the coarse grid alone is better than all others, by errors that cancel: on the
/// floor a uniform grid of the fine cells has 1.5 times its error too.
const INSIDE: [(&str, u32, [f64; 2]); 4] = [
    ("faces", 32, [1.86, 0.90]),
    ("faces", 64, [1.25, 1.18]),
    ("rsm", 32, [1.02, 0.73]),
    ("rsm", 64, [0.81, 1.50]),
];

/// A fine grid around two places of a room: its error, in that of the coarse grid alone, is as
/// stated, and at its border is no step.
#[test]
fn fine_grids_have_the_stated_errors_and_no_seam() {
    let gpu = gpu();
    // What is stated is of this scene.
    let Some(scene) = shared_scene("cornell_point.toml") else {
        return;
    };
    let reference = reference();
    let guide = &reference.guide;
    for (source, resolution, stated) in INSIDE {
        let pairs = |levels: &str| {
            let pairs = [
                format!("source={source}"),
                format!("resolution={resolution}"),
                format!("levels={levels}"),
            ];
            settings(&pairs.each_ref().map(String::as_str))
        };
        let coarse = indirect(&gpu, &scene, guide, &pairs("1"), Vec3::ZERO);
        let places = [Vec3::new(0.1, 0.5, 0.1), Vec3::new(0.0, 1.5, 0.5)];
        for (eye, stated) in places.into_iter().zip(stated) {
            let layout = Layout::new(scene.bounds().unwrap(), resolution, 2, 0.0);
            let fine = layout.grids(eye)[1];
            let (low, extent) = (fine.corner(), fine.cell_size * resolution as f32);
            // Half a cell before the border all light is the coarse grid's.
            let margin = 0.5 * fine.cell_size;
            let is_inside = |place: Vec3| {
                let inside = place - low;
                inside.min_element() > margin && inside.max_element() < extent - margin
            };
            let mut inner = guide.clone();
            for (material, place) in inner.material.iter_mut().zip(&inner.position) {
                if !is_inside(*place) {
                    *material = NO_SURFACE;
                }
            }
            let nested = indirect(&gpu, &scene, guide, &pairs("2"), eye);
            let error = |image: &Image| block_errors(image, &reference.indirect(), &inner).rel_rmse;
            let inside = [&coarse, &nested].map(error);
            // A step that the coarse grid does not have: of what the fine one changes.
            let mut change = nested;
            for (pixel, coarse) in change.pixels.iter_mut().zip(&coarse.pixels) {
                *pixel -= *coarse;
            }
            let step = step_across(&change, &coarse, guide, is_inside);
            let ratio = inside[1] / inside[0];
            println!(
                "{source}, {resolution}³, grid around {eye}: rel_rmse inside {:.4} of the coarse \
                 grid, {ratio:.3} times that with the fine one; step at the border {step:.4}",
                inside[0]
            );
            assert!(
                (ratio - stated).abs() <= 0.03 && step <= 0.05,
                "{source}, {resolution}³, {eye}: {ratio} for {stated}, step {step}"
            );
        }
    }
}
