//! Light that is mirrored, where pixels share it: each frame against the CPU oracles.

use std::collections::BTreeMap;

use crate::support::compare::Worst as _;
use crate::support::given::answer;
use crate::support::shown::{LIMITS, SIZE, Shown, TOLERANCE, compare, nudged, places};
use crate::support::surfaces::every_surface;
use crate::support::{Random, gpu};
use glam::{DVec3, DVec4, Vec4};
use lumivox::gi::shared::interleave::Pattern;
use lumivox::gi::shared::interleave::oracle::{Sample, deinterleave};
use lumivox::gi::shared::screen::oracle::{
    Judged, KeptPixel, Picture, Seen, Terms, history, unslid,
};
use lumivox::gi::shared::surfaces;
use lumivox::gi::shared::voxel::oracle::Receiver;
use lumivox::scene::Camera;

/// The mean over each pixel's window.
fn windowed(seen: &[Option<Seen>], gathered: &[Vec4], camera: &Camera) -> Vec<DVec4> {
    let sample = |(at, pixel): (usize, [u32; 2])| {
        let seen = seen[at]?;
        let receiver = Receiver {
            position: seen.position,
            geometric_normal: seen.geometric_normal,
            shading_normal: seen.shading_normal,
        };
        let value = gathered[at].as_dvec4();
        Some((pixel, Sample { receiver, value }))
    };
    let samples: BTreeMap<_, _> = places().enumerate().filter_map(sample).collect();
    let tan = f64::from((0.5 * camera.vfov_deg.to_radians()).tan());
    let limits = surfaces::Limits {
        plane_tolerance: LIMITS.plane_tolerance as f32,
        normal_cosine: LIMITS.normal_cosine as f32,
    };
    let means = deinterleave(
        &samples,
        camera.eye.as_dvec3(),
        2.0 * tan / f64::from(SIZE[1]),
        (Pattern::of([3, 3]), limits),
    );
    places()
        .map(|pixel| means.get(&pixel).copied().unwrap_or_default())
        .collect()
}

#[test]
fn each_frame_is_the_oracles() {
    let gpu = gpu();
    let pairs = ["history=8", "specular_interleave=3"];
    let mut shown = Shown::new(&gpu, every_surface(true, false), &pairs);
    let mut random = Random::new(5);
    let mut before: Option<(Camera, Vec<Option<KeptPixel>>)> = None;
    let (mut worst, mut least_clear, mut least_kept) = (0.0f64, 1.0f64, f64::INFINITY);
    for number in 0..9 {
        if number > 3 {
            shown.camera = nudged(&shown.camera, &mut random, 0.1);
        }
        let seen_from = before.as_ref().map_or(shown.camera, |(camera, _)| *camera);
        let now = shown.draw(&seen_from);
        let means = windowed(&now.seen, &answer("noise", number, SIZE), &shown.camera);
        let none = vec![None; means.len()];
        let picture = Picture {
            size: SIZE,
            pixels: before.as_ref().map_or(&none, |(_, kept)| kept),
        };
        let expected: Vec<_> = (0..means.len())
            .map(|at| {
                let seen = now.seen[at].filter(|_| now.roughness[at] > 0.0)?;
                let moved = before.as_ref().and(now.moved[at].as_ref());
                let unchanged = moved.map_or(0.0, |moved| {
                    let to_eye = (shown.camera.eye.as_dvec3() - seen.position).normalize();
                    let then = (seen_from.eye.as_dvec3() - moved.position).normalize();
                    unslid(&seen, moved, [to_eye, then], now.roughness[at])
                });
                let terms = Terms {
                    factor: DVec3::ONE,
                    unchanged,
                    longest: 8.0,
                };
                Some(history(&seen, means[at], moved, &picture, (LIMITS, terms)))
            })
            .collect();
        let light = |judged: Judged<(DVec4, [f64; 2])>| Judged {
            value: judged.value.0.truncate().extend(0.0),
            least_margin: judged.least_margin,
        };
        let lights: Vec<_> = expected.iter().map(|judged| judged.map(light)).collect();
        let found: Vec<DVec4> = now.mirrored.iter().map(|rgb| rgb.extend(0.0)).collect();
        let (off, clear) = compare(&found, &lights);
        let weights = expected.iter().flatten().map(|judged| judged.value.1[0]);
        let kept = weights.clone().sum::<f64>() / weights.count() as f64;
        println!("frame {number}: off by {off:.1e}, clear {clear:.3}, weighs {kept:.2}");
        (worst, least_clear) = (worst.max(off), least_clear.min(clear));
        least_kept = least_kept.min(if number > 3 { kept } else { f64::INFINITY });
        let kept = (0..means.len()).map(|at| {
            let light = now.mirrored[at].extend(0.0);
            let weight = expected[at].map_or(0.0, |judged| judged.value.1[0]);
            Some(KeptPixel {
                seen: now.seen[at]?,
                light,
                weights: [weight; 2],
            })
        });
        before = Some((shown.camera, kept.collect()));
    }
    assert!([worst].into_iter().worst() <= TOLERANCE, "off by {worst}");
    assert!(least_clear > 0.9, "{least_clear}");
    assert!((1.05..4.5).contains(&least_kept), "{least_kept}");
}
