//! Golden pictures of the window: panels and picture, as they were when somebody looked at them.
//!
//! As `tests/gpu/golden.rs` has it: a missing or different picture fails, `tests/failures/` holds
//! what was seen, `tools/golden` shows and updates. What is different every time is not in them:
//! the status line tells no times, the pointer is nowhere, the reference rests.

use std::fmt::Write as _;

use crate::support::display::{Display, check_done};
use crate::support::golden::{distance, golden_path, is_close, is_update, judge, read_golden};
use lumivox::image::Image;

const FOLDER: &str = "golden_window";

/// Name, and what a script does from the one before to there.
const PICTURES: [(&str, &str); 4] = [
    ("plain", "section picture"),
    (
        "split",
        "section compare\ncompare split\ntechnique right svo cones\nset right resolution \
         32\nstill\ndivider 0.6",
    ),
    // Too narrow for titles, whose figures may be rounded differently elsewhere.
    (
        "difference",
        "resize 600 360\ncompare difference\nstill\nreference 16",
    ),
    (
        "voxels",
        "resize 640 360\nsection technique\ncompare single\nview voxels 1",
    ),
];

#[test]
fn pictures_are_as_they_were() {
    let Some(display) = Display::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let mut script = String::from("times off\nstill\n");
    for (name, steps) in PICTURES {
        writeln!(script, "{steps}\nstill\nscreenshot {name}.png").unwrap();
    }
    let arguments = [
        "--size",
        "640x360",
        "--preset",
        "cones",
        "--set",
        "resolution=32",
        "--shadow-resolution",
        "256",
        "--scale",
        "1",
    ];
    check_done(&display.view(folder.path(), &arguments, &script));
    let mut wrong = Vec::new();
    for (name, _) in PICTURES {
        let path = folder.path().join(format!("{name}.png"));
        if is_update() {
            std::fs::copy(&path, golden_path(FOLDER, name)).unwrap();
            continue;
        }
        let seen = read_golden(&path, 1.0).expect("a screenshot");
        wrong.extend(judge(FOLDER, name, &seen, 1.0));
    }
    assert!(
        wrong.is_empty(),
        "{}\nsee tests/failures; tools/golden shows and updates",
        wrong.join("\n")
    );
}

/// No picture is left of what is gone.
#[test]
fn every_golden_picture_belongs_to_a_case() {
    let known = PICTURES.map(|(name, _)| golden_path(FOLDER, name));
    for entry in std::fs::read_dir(golden_path(FOLDER, "x").parent().unwrap()).unwrap() {
        let path = entry.unwrap().path();
        assert!(
            known.contains(&path),
            "{} belongs to nothing; remove it",
            path.display()
        );
    }
}

/// The comparator notices one letter that is not there, and panels that are a pixel lower.
#[test]
fn a_changed_window_is_noticed() {
    let golden = read_golden(&golden_path(FOLDER, "plain"), 1.0).expect("a golden picture");
    let (width, height) = (golden.width as usize, golden.height as usize);
    let letter = brightest_block(&golden);
    let without = Image::from_fn(golden.width, golden.height, |i| {
        let inside = (i % width).wrapping_sub(letter[0]) < LETTER
            && (i / width).wrapping_sub(letter[1]) < LETTER;
        if inside {
            golden.pixels[letter[1] * width + letter[0]]
        } else {
            golden.pixels[i]
        }
    });
    let lower = Image::from_fn(golden.width, golden.height, |i| {
        golden.pixels[if i / width + 1 < height { i + width } else { i }]
    });
    for (name, image) in [("a letter", without), ("a shift", lower)] {
        assert!(
            !is_close(&distance(&image, &golden)),
            "{name} is not noticed"
        );
    }
}

/// Edge of a letter (px).
const LETTER: usize = 9;

/// Where in the panels, left of the picture, a block of a letter's size differs most from its upper
/// left pixel.
fn brightest_block(image: &Image) -> [usize; 2] {
    let width = image.width as usize;
    let contrast = |x: usize, y: usize| -> f32 {
        let at = |dx: usize, dy: usize| image.pixels[(y + dy) * width + x + dx];
        (0..LETTER * LETTER)
            .map(|i| at(i % LETTER, i / LETTER).distance_squared(at(0, 0)))
            .sum()
    };
    let places = (0..image.height as usize - LETTER)
        .step_by(3)
        .flat_map(|y| (0..300 - LETTER).step_by(3).map(move |x| [x, y]));
    places
        .max_by(|a, b| contrast(a[0], a[1]).total_cmp(&contrast(b[0], b[1])))
        .unwrap_or_default()
}
