//! Golden pictures: each preset of each technique on each scene, as it was when somebody looked at
//! it.
//!
//! A missing or different picture fails, and `tests/failures/` then holds what was seen.
//! `tools/golden` shows and updates them; only `LUMIVOX_GOLDEN=update` writes here. Two runs on one
//! driver give the same bits, so the thresholds are slack for other drivers alone.

use std::path::PathBuf;

use crate::support::golden::{distance, is_close, is_update, judge, quantized, read_golden};
use crate::support::gpu;
use crate::support::technique::{Case, cases, frame, shoot};
use glam::Vec3;
use lumivox::image::{Image, write_png};
use lumivox::scene::{LoadOptions, Scene};

/// Scene, and the size of its picture (px).
const SCENES: &[(&str, &str, [u32; 2])] = &[
    ("cornell", "bundled:cornell", [128, 96]),
    ("atrium", "bundled:atrium", [160, 90]),
    ("glossy", "bundled:glossy", [160, 90]),
    ("emissive-gallery", "bundled:emissive-gallery", [160, 90]),
    ("two-rooms-door", "bundled:two-rooms,door=1", [128, 96]),
];

const SETTINGS: &[(&str, &str)] = &[("resolution", "64")];

fn golden_path(name: &str) -> PathBuf {
    crate::support::golden::golden_path("golden", name)
}

/// Exposure is fixed for a scene, so that it is not what changes.
fn exposure(scene: &str) -> f32 {
    match scene {
        "cornell" | "glossy" | "emissive-gallery" | "atrium" | "two-rooms-door" => 1.0,
        other => panic!("{other} has no exposure"),
    }
}

/// The cases that have a picture of a scene: the default preset of each technique has all scenes,
/// each other preset has one.
fn cases_of(scene: usize) -> Vec<Case> {
    let is_default =
        |case: &Case| case.entry.presets.first().map(|preset| preset.name) == case.preset;
    let is_shown = |(index, case): &(usize, Case)| {
        is_default(case) || (index + scene).is_multiple_of(SCENES.len())
    };
    cases()
        .into_iter()
        .enumerate()
        .filter(is_shown)
        .map(|(_, case)| case)
        .collect()
}

#[test]
fn pictures_are_as_they_were() {
    let gpu = gpu();
    let mut wrong = Vec::new();
    for (index, (scene_name, source, [width, height])) in SCENES.iter().enumerate() {
        let scene = Scene::open(source, &LoadOptions::default()).unwrap();
        for case in cases_of(index) {
            let name = format!("{}.{scene_name}", Case::name(&case));
            let image = shoot(&gpu, &scene, &case, SETTINGS, frame(*width, *height, 512))
                .unwrap()
                .full;
            if is_update() {
                write_png(&golden_path(&name), &image, exposure(scene_name)).unwrap();
                continue;
            }
            wrong.extend(judge("golden", &name, &image, exposure(scene_name)));
        }
    }
    assert!(
        wrong.is_empty(),
        "{}\nsee tests/failures; tools/golden shows and updates",
        wrong.join("\n")
    );
}

/// No picture is left of a technique, preset or scene that is gone.
#[test]
fn every_golden_picture_belongs_to_a_case() {
    let known: Vec<PathBuf> = SCENES
        .iter()
        .enumerate()
        .flat_map(|(index, (scene, ..))| {
            cases_of(index)
                .into_iter()
                .map(move |case| golden_path(&format!("{}.{scene}", case.name())))
        })
        .collect();
    for entry in std::fs::read_dir(golden_path("x").parent().unwrap()).unwrap() {
        let path = entry.unwrap().path();
        assert!(
            known.contains(&path),
            "{} belongs to nothing; remove it",
            path.display()
        );
    }
}

/// The comparator notices a little more light, a small bright spot, and a shift by a pixel.
#[test]
fn a_changed_picture_is_noticed() {
    let golden =
        read_golden(&golden_path("voxel-mips.accurate.cornell"), 1.0).expect("a golden picture");
    assert!(is_close(&distance(&golden, &golden)));
    let width = golden.width as usize;
    let count = golden.pixels.len();
    let changed =
        |f: &dyn Fn(usize) -> Vec3| quantized(&Image::from_fn(golden.width, golden.height, f), 1.0);
    let brighter = changed(&|i| golden.pixels[i] * 1.05);
    let spot = changed(&|i| {
        if (i / width).abs_diff(40) < 8 && (i % width).abs_diff(40) < 8 {
            Vec3::ONE
        } else {
            golden.pixels[i]
        }
    });
    let shifted = changed(&|i| golden.pixels[(i + 1).min(count - 1)]);
    for (name, image) in [("brighter", brighter), ("spot", spot), ("shifted", shifted)] {
        assert!(
            !is_close(&distance(&image, &golden)),
            "{name} is not noticed"
        );
    }
}
