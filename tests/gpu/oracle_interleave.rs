//! `gi.deinterleave` on the device against the CPU oracle, and what any such window must keep.

use crate::support::compare::{Largest, Worst};
use std::collections::BTreeMap;

use crate::support::gather::View;
use crate::support::scenes::bundled;
use crate::support::technique::Builder;
use crate::support::{Random, gpu};
use glam::{DVec3, DVec4, Vec3};
use lumivox::gi::shared::interleave::oracle::{Sample, deinterleave as by_oracle};
use lumivox::gi::shared::interleave::{Pattern, deinterleave};
use lumivox::gi::shared::surfaces::Limits;
use lumivox::gi::shared::voxel::VoxelGrid;
use lumivox::graph::{Frame, Gpu, ImageDesc, ImageKind, ImageUsage, Owner, vk};
use lumivox::render::GpuScene;
use lumivox::scene::{Camera, Scene};

const SIZE: [u32; 2] = [61, 43];

const LIMITS: Limits = Limits {
    plane_tolerance: 0.5,
    normal_cosine: 0.9,
};

/// A scene seen from its camera.
struct Seen {
    gpu_scene: GpuScene,
    view: View,
    eye: DVec3,
    /// A pixel's height at distance 1.
    footprint: f64,
}

impl Seen {
    fn new(gpu: &Gpu, scene: &Scene) -> Seen {
        let gpu_scene = GpuScene::new(gpu, scene).unwrap();
        let grid = VoxelGrid::around(gpu_scene.bounds, 64);
        let view = View::new(gpu, &gpu_scene, &scene.camera, SIZE, &grid);
        let eye = (scene.camera.eye - grid.origin).as_dvec3() / f64::from(grid.voxel_size);
        let footprint =
            2.0 * f64::from(scene.camera.vfov_deg.to_radians() * 0.5).tan() / f64::from(SIZE[1]);
        Seen {
            gpu_scene,
            view,
            eye,
            footprint,
        }
    }

    /// What the device makes of an image.
    fn on_gpu(&self, gpu: &Gpu, pattern: Pattern, value: impl Fn([u32; 2]) -> DVec4) -> Vec<DVec4> {
        let texels: Vec<[f32; 4]> = (0..SIZE[0] * SIZE[1])
            .map(|at| value([at % SIZE[0], at / SIZE[0]]).as_vec4().to_array())
            .collect();
        let desc = ImageDesc {
            name: "interleaved".into(),
            extent: [SIZE[0], SIZE[1], 1],
            kind: ImageKind::D2,
            format: vk::Format::R32G32B32A32_SFLOAT,
            mips: 1,
            layers: 1,
            usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
            owner: Owner::Shared,
        };
        let image = gpu.create_image(&desc).unwrap();
        gpu.upload_image(&image, 0, 0, bytemuck::cast_slice(&texels))
            .unwrap();
        let mut frame = Frame::new();
        frame.set_scene(&self.gpu_scene.set, &self.gpu_scene.materials);
        let gathered = self.view.gbuffer.receivers(&self.gpu_scene, &image);
        deinterleave(&mut frame, &gathered, &self.view.result, (pattern, LIMITS));
        gpu.submit(frame).unwrap();
        self.view.results(gpu)
    }

    fn by_oracle(&self, pattern: Pattern, value: impl Fn([u32; 2]) -> DVec4) -> Vec<DVec4> {
        let samples: BTreeMap<_, _> = self
            .view
            .receivers
            .iter()
            .map(|&(pixel, receiver)| {
                (
                    pixel,
                    Sample {
                        receiver,
                        value: value(pixel),
                    },
                )
            })
            .collect();
        let means = by_oracle(&samples, self.eye, self.footprint, (pattern, LIMITS));
        self.view
            .receivers
            .iter()
            .map(|(pixel, _)| means[pixel])
            .collect()
    }

    /// Largest difference over the pixels that are at least `from_border` pixels from the picture's
    /// border.
    fn largest_difference(&self, a: &[DVec4], b: &[DVec4], from_border: u32) -> f64 {
        let is_inside = |pixel: [u32; 2]| {
            (0..2).all(|axis| pixel[axis] >= from_border && pixel[axis] + from_border < SIZE[axis])
        };
        let inside: Vec<usize> = (0..a.len())
            .filter(|&i| is_inside(self.view.receivers[i].0))
            .collect();
        assert!(
            inside.len() > 500,
            "only {} pixels to compare",
            inside.len()
        );
        inside
            .into_iter()
            .map(|i| (a[i] - b[i]).abs().largest())
            .worst()
    }
}

/// A tilted plane that fills the picture.
fn plane() -> Scene {
    let mut builder = Builder::default();
    let ground = builder.matte("ground", Vec3::splat(0.5));
    builder.quad(
        ground,
        Vec3::new(-9.0, 0.0, -9.0),
        Vec3::Z * 18.0,
        Vec3::X * 18.0,
    );
    builder.finish(
        "plane",
        Vec::new(),
        Vec3::ZERO,
        Camera {
            eye: Vec3::new(0.3, 2.0, 1.5),
            target: Vec3::ZERO,
            up: Vec3::Y,
            vfov_deg: 50.0,
        },
    )
}

const TOLERANCE: f64 = 2e-6;

fn patterns() -> impl Iterator<Item = Pattern> {
    let sizes = [
        [2, 2],
        [3, 3],
        [4, 4],
        [5, 5],
        [8, 8],
        [3, 2],
        [1, 7],
        [6, 5],
    ];
    sizes.into_iter().map(Pattern::of)
}

#[test]
fn means_are_the_oracles() {
    let gpu = gpu();
    for name in ["cornell", "glossy"] {
        let seen = Seen::new(&gpu, &bundled(name));
        for pattern in patterns() {
            let [width, height] = pattern.size;
            let mut random = Random::new(u64::from(8 * width + height));
            let values: Vec<DVec4> = (0..SIZE[0] * SIZE[1])
                .map(|_| DVec4::from([0; 4].map(|_: u32| f64::from(random.unit()))))
                .collect();
            let value = |[x, y]: [u32; 2]| values[(x + SIZE[0] * y) as usize];
            let difference = seen.largest_difference(
                &seen.on_gpu(&gpu, pattern, value),
                &seen.by_oracle(pattern, value),
                0,
            );
            println!("{name}, {width}×{height}: off by {difference:.1e}");
            assert!(
                difference <= TOLERANCE,
                "{name}, {width}×{height}: off by {difference}"
            );
        }
    }
}

/// A linear ramp across the picture.
fn ramp([x, y]: [u32; 2]) -> DVec4 {
    DVec4::new(
        f64::from(x) / 64.0,
        f64::from(y) / 64.0,
        f64::from(x + y) / 128.0,
        0.5,
    )
}

fn every_value(seen: &Seen, value: impl Fn([u32; 2]) -> DVec4) -> Vec<DVec4> {
    seen.view
        .receivers
        .iter()
        .map(|(pixel, _)| value(*pixel))
        .collect()
}

/// The window is centred: it moves no gradient. One of the pixels from −n/2 to n/2 − 1 moves the
/// picture by half a pixel, 4% of the indirect light in blocks of the Cornell box.
#[test]
fn gradients_stay_where_they_are() {
    let gpu = gpu();
    let seen = Seen::new(&gpu, &plane());
    for pattern in patterns() {
        let ([width, height], means) = (pattern.size, seen.on_gpu(&gpu, pattern, ramp));
        let reach = width.max(height) / 2;
        let difference = seen.largest_difference(&means, &every_value(&seen, ramp), reach);
        assert!(
            difference <= TOLERANCE,
            "{width}×{height}: a ramp moves by {difference}"
        );
    }
}

/// Each pattern of a tile has the same weight.
#[test]
fn patterns_weigh_the_same() {
    let gpu = gpu();
    let seen = Seen::new(&gpu, &plane());
    for pattern in patterns() {
        let [width, height] = pattern.size;
        let is_at = |pixel: [u32; 2], at: [u32; 2]| {
            f64::from(u32::from([pixel[0] % width, pixel[1] % height] == at))
        };
        let marks = |pixel| {
            DVec4::new(
                is_at(pixel, [0, 0]),
                is_at(pixel, [width - 1, 0]),
                is_at(pixel, [width / 2, height - 1]),
                is_at(pixel, [1 % width, 1 % height]),
            )
        };
        let share = 1.0 / f64::from(pattern.count());
        let even = vec![DVec4::splat(share); seen.view.receivers.len()];
        let means = seen.on_gpu(&gpu, pattern, marks);
        let difference = seen.largest_difference(&means, &even, width.max(height) / 2);
        assert!(
            difference <= TOLERANCE,
            "{width}×{height}: weights differ by {difference}"
        );
    }
}

#[test]
fn comparators_notice_planted_errors() {
    let gpu = gpu();
    let seen = Seen::new(&gpu, &plane());
    let expected = every_value(&seen, ramp);
    assert!(seen.largest_difference(&expected, &expected, 2) == 0.0);
    // Half a pixel, to the left and up.
    let moved = every_value(&seen, |pixel| {
        ramp(pixel) - DVec4::new(1.0 / 128.0, 1.0 / 128.0, 1.0 / 128.0, 0.0)
    });
    assert!(seen.largest_difference(&moved, &expected, 2) > TOLERANCE);
    let mut one = expected.clone();
    one[SIZE[0] as usize * 20 + 30].w += 1e-5;
    assert!(seen.largest_difference(&one, &expected, 2) > TOLERANCE);
    for channel in 0..4 {
        let mut one = expected.clone();
        one[SIZE[0] as usize * 20 + 30][channel] = f64::NAN;
        assert!(seen.largest_difference(&one, &expected, 2).is_nan());
    }
}
