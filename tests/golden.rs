//! Golden pictures: each preset of each technique on each scene, as it was when somebody looked at it.
//!
//! A missing or different picture fails, and `tests/failures/` then holds what was seen. `tools/golden` shows and updates them; only
//! `LUMIVOX_GOLDEN=update` writes here. Two runs on one driver give the same bits, so the thresholds are slack for other drivers alone.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod support;

use std::path::{Path, PathBuf};

use glam::Vec3;
use lumivox::image::{Image, write_png};
use lumivox::metrics::{Flip, exposure_of, flip};
use lumivox::scene::{LoadOptions, Scene};
use support::gpu;
use support::technique::{Case, cases, frame, shoot, write_failure};

/// Scene, and the size of its picture (px).
const SCENES: &[(&str, &str, [u32; 2])] = &[
    ("cornell", "bundled:cornell", [128, 96]),
    ("atrium", "bundled:atrium", [160, 90]),
    ("glossy", "bundled:glossy", [160, 90]),
    ("emissive-gallery", "bundled:emissive-gallery", [160, 90]),
    ("two-rooms-door", "bundled:two-rooms,door=1", [128, 96]),
];

const SETTINGS: &[(&str, &str)] = &[("resolution", "64")];

/// Measured between two runs: 0 in all three; between two processors (llvmpipe compiles for each): up to 0.0057, 0.035 and 0.007, in the atrium.
const FLIP_MEAN: f32 = 0.008;
const FLIP_P99: f32 = 0.05;
const REL_RMSE: f64 = 0.02;

fn golden_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join("golden").join(format!("{name}.png"))
}

/// A golden picture is sRGB with 8 bits; this is what it stands for, before exposure.
fn linear(pixel: [u8; 3], exposure: f32) -> Vec3 {
    let decode = |value: u8| {
        let value = f32::from(value) / 255.0;
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    };
    Vec3::from(pixel.map(decode)) / exposure
}

fn quantized(image: &Image, exposure: f32) -> Image {
    let encode = |value: f32| lumivox::image::srgb_from_linear(value * exposure);
    Image::from_fn(image.width, image.height, |i| linear(image.pixels[i].to_array().map(encode), exposure))
}

/// Exposure is fixed for a scene, so that it is not what changes.
fn exposure(scene: &str) -> f32 {
    match scene {
        "cornell" | "glossy" | "emissive-gallery" | "atrium" | "two-rooms-door" => 1.0,
        other => panic!("{other} has no exposure"),
    }
}

/// ꟻLIP and relative RMSE of two pictures that were quantized alike.
fn distance(image: &Image, golden: &Image) -> (Flip, f64) {
    let flip = flip(image, golden, exposure_of(golden)).unwrap();
    let errors = lumivox::metrics::compare(image, golden, None, lumivox::metrics::Channel::Rgb).unwrap();
    (flip, errors.pixel.rel_rmse)
}

fn is_close((flip, rel_rmse): &(Flip, f64)) -> bool {
    flip.mean <= FLIP_MEAN && flip.p99 <= FLIP_P99 && *rel_rmse <= REL_RMSE
}

fn read_golden(path: &Path, exposure: f32) -> Option<Image> {
    let picture = image::open(path).ok()?.to_rgb8();
    let pixels = picture.pixels().map(|pixel| linear(pixel.0, exposure)).collect();
    Some(Image { width: picture.width(), height: picture.height(), pixels })
}

/// What is wrong with a picture, if anything.
fn judge(name: &str, image: &Image, exposure: f32) -> Option<String> {
    let seen = quantized(image, exposure);
    let Some(golden) = read_golden(&golden_path(name), exposure) else {
        write_failure(&format!("golden.{name}"), image, None, exposure, "there is no golden picture");
        return Some(format!("{name}: there is no golden picture; look at tests/failures, then run tools/golden update"));
    };
    if golden.size() != seen.size() {
        return Some(format!("{name}: the golden picture has another size"));
    }
    let found = distance(&seen, &golden);
    println!("{name}: flip mean {:.5}, p99 {:.5}, rel_rmse {:.5}", found.0.mean, found.0.p99, found.1);
    if is_close(&found) {
        return None;
    }
    let numbers = format!("flip mean {:.5} (at most {FLIP_MEAN}), p99 {:.5} ({FLIP_P99}), rel_rmse {:.5} ({REL_RMSE})", found.0.mean, found.0.p99, found.1);
    write_failure(&format!("golden.{name}"), &seen, Some(&golden), exposure, &numbers);
    Some(format!("{name}: {numbers}"))
}

#[test]
fn pictures_are_as_they_were() {
    let gpu = gpu();
    let update = std::env::var_os("LUMIVOX_GOLDEN").is_some_and(|value| value == "update");
    let mut wrong = Vec::new();
    for (scene_name, source, [width, height]) in SCENES {
        let scene = Scene::open(source, &LoadOptions::default()).unwrap();
        for case in cases() {
            let name = format!("{}.{scene_name}", Case::name(&case));
            let image = shoot(&gpu, &scene, &case, SETTINGS, frame(*width, *height, 512)).unwrap().full;
            if update {
                write_png(&golden_path(&name), &image, exposure(scene_name)).unwrap();
                continue;
            }
            wrong.extend(judge(&name, &image, exposure(scene_name)));
        }
    }
    assert!(wrong.is_empty(), "{}\nsee tests/failures; tools/golden shows and updates", wrong.join("\n"));
}

/// No picture is left of a technique, preset or scene that is gone.
#[test]
fn every_golden_picture_belongs_to_a_case() {
    let known: Vec<PathBuf> =
        SCENES.iter().flat_map(|(scene, ..)| cases().iter().map(|case| golden_path(&format!("{}.{scene}", case.name()))).collect::<Vec<_>>()).collect();
    for entry in std::fs::read_dir(golden_path("x").parent().unwrap()).unwrap() {
        let path = entry.unwrap().path();
        assert!(known.contains(&path), "{} belongs to nothing; remove it", path.display());
    }
}

/// The comparator notices a little more light, a small bright spot, and a shift by a pixel.
#[test]
fn a_changed_picture_is_noticed() {
    let golden = read_golden(&golden_path("voxel-mips.accurate.cornell"), 1.0).expect("a golden picture");
    assert!(is_close(&distance(&golden, &golden)));
    let width = golden.width as usize;
    let count = golden.pixels.len();
    let changed = |f: &dyn Fn(usize) -> Vec3| quantized(&Image::from_fn(golden.width, golden.height, f), 1.0);
    let brighter = changed(&|i| golden.pixels[i] * 1.05);
    let spot = changed(&|i| if (i / width).abs_diff(40) < 8 && (i % width).abs_diff(40) < 8 { Vec3::ONE } else { golden.pixels[i] });
    let shifted = changed(&|i| golden.pixels[(i + 1).min(count - 1)]);
    for (name, image) in [("brighter", brighter), ("spot", spot), ("shifted", shifted)] {
        assert!(!is_close(&distance(&image, &golden)), "{name} is not noticed");
    }
}
