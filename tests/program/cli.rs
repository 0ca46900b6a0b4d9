//! Bad input through the real program: each is one line that says what, where and what to do, and
//! an exit code; or a correct picture. Never a panic, never a hang.

use crate::support::compare::Largest;
use std::ffi::{OsStr, OsString};
use std::path::Path;

use crate::support::program::{check_error, lumivox, words};
use crate::support::technique::is_sound;
use lumivox::image::{Image, luminance, read_exr};

/// Arguments after `render`, the exit code, and what the error must say.
const BAD_ARGUMENTS: &[(&str, i32, &[&str])] = &[
    (
        "bundled:cornell --size 0x0 -o a.png",
        2,
        &["--size", "0x0", "1 to 16384"],
    ),
    ("bundled:cornell --size 8x0 -o a.png", 2, &["--size", "8x0"]),
    (
        "bundled:cornell --capture a.txt -o a.png",
        2,
        &["a.txt", ".rdc"],
    ),
    // Where RenderDoc is installed, it hides what lavapipe can do.
    (
        "bundled:cornell --size 16x16 --capture a.rdc -o a.png",
        1,
        &["RenderDoc"],
    ),
    (
        "bundled:cornell --size 100000x100000 -o a.png",
        2,
        &["--size", "100000x100000", "16384"],
    ),
    (
        "bundled:cornell --size 99999999999x1 -o a.png",
        2,
        &["--size", "WIDTHxHEIGHT"],
    ),
    (
        "bundled:cornell --size 64 -o a.png",
        2,
        &["--size", "WIDTHxHEIGHT"],
    ),
    ("bundled:cornell --size -4x4 -o a.png", 2, &["-4"]),
    (
        "bundled:cornell --size 16384x16384 -o a.png",
        1,
        &["bytes wanted", "lower"],
    ),
    (
        "bundled:cornell --size 16x16 --set resolution=1024 -o a.png",
        1,
        &["bytes wanted", "bytes", "lower"],
    ),
    (
        "bundled:cornell --size 16x16 --preset cones --set resolution=1024 -o a.png",
        1,
        &["voxel_mips.radiance", "9817069312 bytes wanted", "lower"],
    ),
    (
        "bundled:cornell --size 16x16 --set resolution=2048 -o a.png",
        1,
        &["voxel.occupancy", "1073741824 bytes wanted", "lower"],
    ),
    (
        "bundled:cornell --size 16x16 --preset cones --set resolution=2048 -o a.png",
        1,
        &["voxel_mips.radiance", "78536546048 bytes wanted", "lower"],
    ),
    (
        "bundled:cornell --technique svo --set resolution=2048 --set step_factor=0.1 -o a.png",
        1,
        &["step_factor 0.1 at resolution 2048", "larger steps"],
    ),
    (
        "bundled:cornell --set resolution=999 -o a.png",
        2,
        &["resolution", "999", "256"],
    ),
    (
        "bundled:cornell --set resolution=-1 -o a.png",
        2,
        &["resolution", "-1"],
    ),
    (
        "bundled:cornell --set resolution=1e30 -o a.png",
        2,
        &["resolution", "1e30"],
    ),
    (
        "bundled:cornell --set opacity_exponent=nan -o a.png",
        2,
        &["opacity_exponent", "nan"],
    ),
    (
        "bundled:cornell --set opacity_exponent=inf -o a.png",
        2,
        &["opacity_exponent", "inf"],
    ),
    (
        "bundled:cornell --set gather=magic -o a.png",
        2,
        &["gather", "magic", "cones, rays"],
    ),
    (
        "bundled:cornell --set resolution -o a.png",
        2,
        &["resolution", "KEY=VALUE"],
    ),
    (
        "bundled:cornell --set nosuch=1 -o a.png",
        2,
        &["nosuch", "resolution"],
    ),
    (
        "bundled:cornell --technique nosuch -o a.png",
        2,
        &["nosuch", "voxel-mips"],
    ),
    (
        "bundled:cornell --preset nosuch -o a.png",
        2,
        &["nosuch", "textbook"],
    ),
    (
        "bundled:cornell --technique none --preset accurate -o a.png",
        2,
        &["accurate"],
    ),
    (
        "bundled:cornell --aov nosuch -o a.png",
        2,
        &["--aov", "nosuch", "indirect"],
    ),
    (
        "bundled:cornell --exposure nan -o a.png",
        2,
        &["--exposure", "above 0"],
    ),
    (
        "bundled:cornell --exposure 0 -o a.png",
        2,
        &["--exposure", "above 0"],
    ),
    (
        "bundled:cornell --time nan -o a.png",
        2,
        &["--time", "seconds"],
    ),
    (
        "bundled:cornell --time soon -o a.png",
        2,
        &["--time", "soon"],
    ),
    (
        "bundled:cornell --frames 0 -o a.png",
        2,
        &["--frames", "1.."],
    ),
    (
        "bundled:cornell --shadow-resolution 100000 -o a.png",
        2,
        &["--shadow-resolution", "8192"],
    ),
    (
        "bundled:cornell --device nosuch --size 8x8 -o a.png",
        1,
        &["nosuch", "there are"],
    ),
    (
        "bundled:cornell --device 99 --size 8x8 -o a.png",
        1,
        &["99", "there are"],
    ),
    (
        "bundled:cornell --rays maybe -o a.png",
        2,
        &["--rays", "device or shader"],
    ),
    ("bundled:cornell -o a.jpg", 2, &["a.jpg", ".exr", ".png"]),
    ("bundled:cornell -o a", 2, &[".exr", ".png"]),
    ("bundled:cornell", 2, &["required"]),
    ("bundled:nosuch -o a.png", 2, &["nosuch", "cornell"]),
    ("bundled:cornell,width=3 -o a.png", 2, &["width"]),
    ("bundled:furnace,albedo=7 -o a.png", 2, &["albedo", "0.99"]),
    (
        "bundled:cornell --technique none --size 8x8 --view voxels -o a.png",
        2,
        &["--view", "none has no views"],
    ),
    (
        "bundled:cornell --size 8x8 --set resolution=8 --preset accurate --view voxels -o a.png",
        2,
        &["--view", "does not keep", "another preset"],
    ),
    (
        "bundled:cornell --technique svo --size 8x8 --set resolution=8 --voxels albedo -o a.png",
        2,
        &["albedo", "svo", "attributes=on"],
    ),
    (
        "bundled:cornell --technique svo --preset cones --size 8x8 --set resolution=8 \
         --voxels light --voxel-level 3 -o a.png",
        2,
        &["--level", "0 to 2"],
    ),
    (
        "bundled:cornell --technique svo --size 8x8 --view nothing -o a.png",
        2,
        &["nothing", "voxels, voxel-opacity, structure, voxel-albedo"],
    ),
    ("bundled:cornell --level 1 -o a.png", 2, &["required"]),
    (
        "bundled:cornell --size 8x8 --set resolution=8 -o gone/a.png",
        1,
        &["gone/a.png", "folder"],
    ),
    (
        "bundled:cornell --size 8x8 --set resolution=8 -o gone/a.exr",
        1,
        &["gone/a.exr", "folder"],
    ),
    (
        "bundled:cornell --size 8x8 --set resolution=8 -o a.png --report gone/a.json",
        1,
        &["gone/a.json", "folder"],
    ),
];

#[test]
fn bad_arguments() {
    let folder = tempfile::tempdir().unwrap();
    for (line, code, says) in BAD_ARGUMENTS {
        let ran = lumivox(folder.path(), &words(&format!("render {line}")), &[]);
        check_error(line, &ran, *code, says);
    }
}

/// A subcommand that does not exist, and other subcommands' own.
#[test]
fn bad_arguments_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("text.exr"), "no image").unwrap();
    let cases: &[(&str, i32, &[&str])] = &[
        ("nosuch", 2, &["nosuch"]),
        ("techniques nosuch", 2, &["nosuch", "voxel-mips"]),
        ("scene nosuch", 2, &["nosuch", "cornell"]),
        (
            "reference bundled:cornell --size 0x0 -o a.png",
            2,
            &["--size", "0x0", "16384"],
        ),
        (
            "reference bundled:cornell --size 100000x1 -o a.png",
            2,
            &["--size", "16384"],
        ),
        (
            "reference bundled:cornell --size 8x8 --max-error nan -o a.png",
            2,
            &["max_error"],
        ),
        (
            "reference bundled:cornell --size 8x8 --spp 0 -o a.png",
            2,
            &["spp"],
        ),
        (
            "reference bundled:cornell --size 8x8 --bounces -1 -o a.png",
            2,
            &["-1"],
        ),
        (
            "render bundled:cornell --technique svo --set specular_step=0.05 -o a.exr",
            2,
            &["specular_step", "0.05", "step_factor", "0.1 or more"],
        ),
        (
            "reference bundled:glossy --method radiosity --size 8x8 -o a.png",
            2,
            &["scene glossy", "material", "specular lobe", "path tracer"],
        ),
        (
            "reference bundled:cornell --method radiosity --patch-rays 100 --size 8x8 -o a.png",
            2,
            &["patch_rays", "100", "power of two"],
        ),
        (
            "reference bundled:cornell --method radiosity --max-patches 9 --size 8x8 -o a.png",
            2,
            &["scene cornell", "9 may be at most"],
        ),
        (
            "reference bundled:cornell --size 8x8 --spp 1 --no-cache -o gone/a.exr",
            1,
            &["gone/a.exr", "folder"],
        ),
        (
            "bench bundled:cornell --times 0,inf -o b",
            2,
            &["--times", "seconds"],
        ),
        ("compare gone.exr gone.exr", 2, &["gone.exr"]),
        ("compare text.exr text.exr", 2, &["text.exr"]),
        (
            "voxelize bundled:cornell -o a.obj",
            2,
            &["a.obj", ".vox, .ply or .json"],
        ),
        (
            "voxelize bundled:cornell -o vox",
            2,
            &[".vox, .ply or .json"],
        ),
        ("voxelize bundled:cornell", 2, &["required"]),
        (
            "voxelize gone.obj -o a.vox",
            2,
            &["gone.obj", "check the path"],
        ),
        (
            "voxelize bundled:cornell --resolution 65 -o a.vox",
            2,
            &["resolution", "65", "64, 128"],
        ),
        (
            "voxelize bundled:cornell --resolution 4096 -o a.vox",
            2,
            &["resolution", "4096", "1024"],
        ),
        (
            "voxelize bundled:cornell --resolution -8 -o a.vox",
            2,
            &["-8"],
        ),
        (
            "voxelize bundled:cornell --technique none -o a.vox",
            2,
            &["none", "voxel-mips"],
        ),
        (
            "voxelize bundled:cornell --technique nosuch -o a.vox",
            2,
            &["nosuch", "voxel-mips"],
        ),
        (
            "voxelize bundled:cornell --device nosuch -o a.vox",
            1,
            &["nosuch", "there are"],
        ),
    ];
    for (line, code, says) in cases {
        check_error(
            line,
            &lumivox(folder.path(), &words(line), &[]),
            *code,
            says,
        );
    }
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

/// A scene's name, its files, and what the error must say.
type BadScene<'a> = (&'a str, &'a [(&'a str, &'a str)], &'a [&'a str]);

/// Files that are no scene.
#[test]
fn bad_scenes() {
    let with_texture = "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
    let cases: &[BadScene] = &[
        ("gone.obj", &[], &["gone.obj", "check the path"]),
        ("gone.toml", &[], &["gone.toml"]),
        ("a.stl", &[("a.stl", "solid")], &["a.stl", ".obj"]),
        ("a.toml", &[("a.toml", "[[model]\n")], &["a.toml:1"]),
        (
            "a.toml",
            &[("a.toml", "[[model]]\npath = 'gone.obj'\n")],
            &["a.toml:2", "gone.obj"],
        ),
        (
            "a.obj",
            &[("a.obj", "v 0 0 0\nv 1 nan 0\n")],
            &["a.obj:2", "nan", "not finite"],
        ),
        (
            "a.obj",
            &[("a.obj", "v 0 0 inf\n")],
            &["a.obj:1", "not finite"],
        ),
        (
            "a.obj",
            &[("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")],
            &["a.obj:4", "number 9"],
        ),
        ("a.obj", &[("a.obj", "v 0 0 0\n")], &["a.obj", "no faces"]),
        (
            "a.obj",
            &[("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")],
            &["a.obj", "no area"],
        ),
        (
            "a.obj",
            &[("a.obj", "nonsense \u{7}\nv one two three\n")],
            &["a.obj"],
        ),
        (
            "a.obj",
            &[
                ("a.obj", with_texture),
                ("a.mtl", "newmtl m\nmap_Kd gone.png\n"),
            ],
            &["missing texture", "gone.png", "--allow-missing-textures"],
        ),
        (
            "a.obj",
            &[
                ("a.obj", with_texture),
                ("a.mtl", "newmtl m\nmap_Kd cut.png\n"),
                ("cut.png", "\u{89}PNG\r\n"),
            ],
            &["cut.png"],
        ),
        (
            "a.obj",
            &[
                ("a.obj", with_texture),
                ("a.mtl", "newmtl m\nmap_Kd wide.png\n"),
            ],
            &["wide.png", "20000", "scale it down"],
        ),
    ];
    for (scene, files, says) in cases {
        let folder = tempfile::tempdir().unwrap();
        let wide = image::GrayImage::new(20_000, 1);
        wide.save(folder.path().join("wide.png")).unwrap();
        files
            .iter()
            .for_each(|(name, text)| std::fs::write(folder.path().join(name), text).unwrap());
        for command in ["render", "reference"] {
            let ran = lumivox(
                folder.path(),
                &words(&format!("{command} {scene} --size 8x8 -o a.png")),
                &[],
            );
            check_error(&format!("{command} {scene} {files:?}"), &ran, 2, says);
            assert!(
                !folder.path().join("a.png").exists(),
                "{scene}: a picture in spite of the error"
            );
        }
    }
}

/// Renders a scene of the folder to a picture.
fn picture(folder: &Path, scene: impl AsRef<OsStr>, more: &str) -> (Image, String) {
    let mut arguments = vec![OsString::from("render"), scene.as_ref().to_owned()];
    arguments.extend(words(&format!(
        "--size 48x32 --set resolution=32 -o out.exr {more}"
    )));
    let ran = lumivox(folder, &arguments, &[]);
    assert_eq!(ran.code, Some(0), "{:?}: {}", scene.as_ref(), ran.stderr);
    let image = read_exr(&folder.join("out.exr")).unwrap();
    assert!(
        is_sound(&image),
        "{:?}: a pixel is negative or not finite",
        scene.as_ref()
    );
    (image, ran.stderr)
}

fn mean(image: &Image) -> f32 {
    image
        .pixels
        .iter()
        .map(|&pixel| luminance(pixel))
        .sum::<f32>()
        / image.pixels.len() as f32
}

/// A lit corner of floor and wall of a given extent, as TOML and OBJ.
fn write_corner(folder: &Path, extent_m: f64, lights: bool) {
    let e = extent_m;
    let obj = format!(
        "v 0 0 0\nv {e:e} 0 0\nv {e:e} 0 {e:e}\nv 0 0 {e:e}\nv {e:e} {e:e} 0\nv 0 {e:e} 0\nf 1 4 \
         3\nf 1 3 2\nf 1 2 5\nf 1 5 6\nf 1 1 2\nf 2 2 2\n"
    );
    std::fs::write(folder.join("corner.obj"), obj).unwrap();
    let light = format!(
        "[[light]]\nkind = 'point'\nposition = [{:?}, {:?}, {:?}]\nintensity = [{:?}, {:?}, \
         {:?}]\n",
        0.5 * e,
        0.6 * e,
        0.5 * e,
        e * e,
        e * e,
        e * e
    );
    let camera = format!(
        "[camera]\neye = [{:?}, {:?}, {:?}]\ntarget = [{:?}, {:?}, 0.0]\nvfov_deg = 50.0\n",
        0.5 * e,
        0.7 * e,
        2.2 * e,
        0.5 * e,
        0.4 * e
    );
    let toml = format!(
        "[[model]]\npath = 'corner.obj'\n{camera}{}",
        if lights { &light } else { "" }
    );
    std::fs::write(folder.join("corner.toml"), toml).unwrap();
}

/// Light scales with the square of lengths, so that corners of all extents, with zero-area
/// triangles among them, look the same.
#[test]
fn extents_and_zero_area_triangles() {
    let folder = tempfile::tempdir().unwrap();
    write_corner(folder.path(), 1.0, true);
    let (expected, stderr) = picture(folder.path(), "corner.toml", "");
    assert!(
        stderr.contains("without area"),
        "dropped triangles are not mentioned: {stderr}"
    );
    let (expected_indirect, _) = picture(folder.path(), "corner.toml", "--aov indirect");
    assert!(
        mean(&expected) > 0.05 && mean(&expected_indirect) > 0.005,
        "{} {}",
        mean(&expected),
        mean(&expected_indirect)
    );
    for extent_m in [1e-4, 1e5] {
        write_corner(folder.path(), extent_m, true);
        for (more, expected) in [("", &expected), ("--aov indirect", &expected_indirect)] {
            let (image, _) = picture(folder.path(), "corner.toml", more);
            let error = (mean(&image) / mean(expected) - 1.0).abs();
            println!("extent {extent_m} m {more}: the mean differs by {error:.5}");
            // Measured at 1e-4 m and at 1e5 m: below 1e-5.
            assert!(
                error < 0.001,
                "extent {extent_m} m {more}: mean {} instead of {}",
                mean(&image),
                mean(expected)
            );
        }
    }
}

/// A sheet that comes into the picture: `render --time` shows it where `reference --time` does;
/// without models that move, `--time` says that it does nothing.
#[test]
fn models_move_with_time() {
    let folder = tempfile::tempdir().unwrap();
    write_corner(folder.path(), 1.0, true);
    let (still, stderr) = picture(folder.path(), "corner.toml", "--time 3");
    assert!(stderr.contains("--time changes nothing"), "{stderr}");
    let moving = "[[model]]\npath = 'sheet.obj'\ndynamic = true\n[[model.keyframe]]\ntime_s = \
                  1.0\ntranslate = [0.0, 9.0, 0.0]\n[[model.keyframe]]\ntime_s = 2.0\ntranslate = \
                  [0.5, 0.3, 0.2]\nrotate_deg = [-20.0, 0.0, 0.0]\n";
    std::fs::write(
        folder.path().join("sheet.obj"),
        "v -0.2 -0.2 0\nv 0.2 -0.2 0\nv 0.2 0.2 0\nv -0.2 0.2 0\nf 1 2 3 4\n",
    )
    .unwrap();
    let toml = std::fs::read_to_string(folder.path().join("corner.toml")).unwrap();
    std::fs::write(folder.path().join("moving.toml"), toml + moving).unwrap();
    let (before, _) = picture(folder.path(), "moving.toml", "");
    // Maps of a light begin farther from it in a scene that is lit farther away, and their depths
    // round otherwise.
    let pairs = before.pixels.iter().zip(&still.pixels);
    let apart = pairs.filter(|(a, b)| (**a - **b).length() > 1e-5).count();
    assert_eq!(apart, 0, "the sheet is far from everything");
    let (after, _) = picture(folder.path(), "moving.toml", "--time 2 --report r.json");
    assert_eq!(json(&folder.path().join("r.json"))["time_s"], 2.0);
    let ran = lumivox(
        folder.path(),
        &words(
            "reference moving.toml --time 2 --size 48x32 --bounces 1 --spp 64 --no-cache -o \
             out.exr",
        ),
        &[],
    );
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let reference = read_exr(&folder.path().join("out.exr")).unwrap();
    let off = |image: &Image| {
        image
            .pixels
            .iter()
            .zip(&reference.pixels)
            .map(|(a, b)| (*a - *b).abs().largest())
            .sum::<f64>()
            / image.pixels.len() as f64
    };
    println!(
        "mean difference from the reference: {} with the sheet, {} without",
        off(&after),
        off(&before)
    );
    assert!(off(&after) < 0.3 * off(&before));
}

/// `--method radiosity` renders the same picture without paths, and reports its patches.
#[test]
fn radiosity_is_a_second_reference() {
    let folder = tempfile::tempdir().unwrap();
    let draw = |method: &str| -> (f32, serde_json::Value) {
        let line = format!(
            "reference bundled:cornell-lamp --size 32x24 --spp 256 --no-cache --method {method} \
             --aov indirect -o {method}.exr --report {method}.json"
        );
        let ran = lumivox(folder.path(), &words(&line), &[]);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let image = read_exr(&folder.path().join(format!("{method}.exr"))).unwrap();
        let report = json(&folder.path().join(format!("{method}.json")));
        (mean(&image), report)
    };
    let (traced, by_path) = draw("path");
    let (solved, by_patches) = draw("radiosity");
    println!("mean {traced} by paths, {solved} by patches");
    assert!((solved / traced - 1.0).abs() < 0.02, "{traced}, {solved}");
    assert_eq!(by_path["settings"]["method"], "path");
    assert!(by_path["patches"].is_null());
    assert_eq!(by_patches["settings"]["method"], "radiosity");
    let patches = by_patches["patches"].as_u64().unwrap();
    assert!(patches > 1000 && by_patches["patch_rays"].as_u64() > Some(patches));
}

#[test]
fn no_lights_is_black_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    write_corner(folder.path(), 1.0, false);
    let (image, stderr) = picture(folder.path(), "corner.toml", "");
    assert!(mean(&image) == 0.0, "light from nowhere: {}", mean(&image));
    assert!(
        stderr.contains("no light") && stderr.contains("black"),
        "no warning: {stderr}"
    );
    assert!(
        !picture(folder.path(), "corner.toml", "--quiet")
            .1
            .contains("black"),
        "--quiet does not silence warnings"
    );
}

#[test]
fn odd_sizes_and_odd_cameras() {
    let folder = tempfile::tempdir().unwrap();
    for size in ["1x1", "1x200", "200x1", "7x13"] {
        let ran = lumivox(
            folder.path(),
            &words(&format!(
                "render bundled:cornell --set resolution=8 --size {size} -o a.exr"
            )),
            &[],
        );
        assert_eq!(ran.code, Some(0), "{size}: {}", ran.stderr);
        assert!(
            is_sound(&read_exr(&folder.path().join("a.exr")).unwrap()),
            "{size}"
        );
    }
    write_corner(folder.path(), 1.0, true);
    let toml = std::fs::read_to_string(folder.path().join("corner.toml")).unwrap();
    // In the wall's plane, and behind it.
    for eye in ["[0.5, 0.5, 0.0]", "[0.5, 0.5, -0.01]"] {
        let eye = toml
            .lines()
            .map(|line| {
                if line.starts_with("eye") {
                    format!("eye = {eye}\n")
                } else {
                    format!("{line}\n")
                }
            })
            .collect::<String>();
        let eye = eye.replace("0.4, 0.0]", "0.4, 1.0]");
        std::fs::write(folder.path().join("wall.toml"), eye).unwrap();
        picture(folder.path(), "wall.toml", "");
    }
}

#[test]
fn a_missing_texture_can_be_allowed() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("a.obj"),
        format!("mtllib a.mtl\nusemtl m\n{TRIANGLE}vt 0 0\nf 1/1 2/1 3/1\n"),
    )
    .unwrap();
    std::fs::write(folder.path().join("a.mtl"), "newmtl m\nmap_Kd gone.png\n").unwrap();
    let (image, stderr) = picture(folder.path(), "a.obj", "--allow-missing-textures");
    assert!(
        mean(&image) > 0.0 && stderr.contains("gone.png"),
        "{stderr}"
    );
}

#[cfg(unix)]
#[test]
fn paths_that_are_not_utf8() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let odd = folder.path().join(OsStr::from_bytes(b"caf\xe9"));
    std::fs::create_dir(&odd).unwrap();
    write_corner(&odd, 1.0, true);
    let scene = odd.join("corner.toml");
    let output = odd.join(OsStr::from_bytes(b"\xff.exr"));
    let copy = odd.join("copy");
    let report = odd.join(OsStr::from_bytes(b"\xff.json"));
    let heatmap = odd.join(OsStr::from_bytes(b"\xff.png"));
    let voxels = odd.join(OsStr::from_bytes(b"\xff.ply"));
    let path = |path: &Path| path.as_os_str().to_owned();
    let cases: &[(&str, Vec<OsString>, &[&Path])] = &[
        (
            "render --size 8x8 --set resolution=8",
            vec![
                path(&scene),
                "-o".into(),
                path(&output),
                "--report".into(),
                path(&report),
            ],
            &[&output, &report],
        ),
        (
            "reference --size 8x8 --spp 1 --no-cache",
            vec![
                path(&scene),
                "-o".into(),
                path(&output),
                "--report".into(),
                path(&report),
            ],
            &[&report],
        ),
        (
            "scene",
            vec![path(&scene), "-o".into(), path(&copy)],
            &[&copy],
        ),
        (
            "voxelize --resolution 8",
            vec![path(&scene), "-o".into(), path(&voxels)],
            &[&voxels],
        ),
        (
            "compare",
            [
                &output,
                Path::new("--scene"),
                &scene,
                Path::new("--heatmap"),
                &heatmap,
                Path::new("--report"),
                &report,
            ]
            .map(path)
            .into(),
            &[&output, &heatmap, &report],
        ),
    ];
    for (line, paths, written) in cases {
        let mut arguments = words(line);
        if *line == "compare" {
            arguments.push(path(&output));
        }
        arguments.extend(paths.iter().cloned());
        let ran = lumivox(folder.path(), &arguments, &[]);
        assert_eq!(ran.code, Some(0), "{line}: {}", ran.stderr);
        for file in *written {
            assert!(file.exists(), "{line}: {} is not written", file.display());
            if file.is_file() {
                std::fs::remove_file(file).unwrap()
            } else {
                std::fs::remove_dir_all(file).unwrap()
            }
        }
    }
    let nothing = OsString::from(OsStr::from_bytes(b"\xff.obj"));
    for line in [
        "render -o a.png",
        "reference -o a.png",
        "scene",
        "compare a.exr a.exr --scene",
        "bench -o out",
    ] {
        let ran = lumivox(
            folder.path(),
            &[words(line), vec![nothing.clone()]].concat(),
            &[],
        );
        check_error(
            line,
            &ran,
            2,
            &[if line.starts_with("compare") {
                "a.exr"
            } else {
                "check the path"
            }],
        );
    }
    // No bundled scene and no path.
    let ran = lumivox(
        folder.path(),
        &[
            "scene".into(),
            OsString::from(OsStr::from_bytes(b"\xff")),
            "--set".into(),
            "a=1".into(),
        ],
        &[],
    );
    check_error("not a name", &ran, 2, &["no bundled scene"]);
}

/// A loader that finds no driver, and no loader at all.
#[test]
fn no_device() {
    let folder = tempfile::tempdir().unwrap();
    let nothing = [
        ("VK_ICD_FILENAMES", "/gone.json"),
        ("VK_DRIVER_FILES", "/gone.json"),
    ];
    for line in [
        "devices",
        "voxelize bundled:cornell -o a.vox",
        "render bundled:cornell --size 8x8 -o a.png",
        "render bundled:cornell --size 8x8 --validate -o a.png",
    ] {
        check_error(
            line,
            &lumivox(folder.path(), &words(line), &nothing),
            1,
            &["no Vulkan device", "install a driver"],
        );
    }
    // What needs no device does without.
    for line in [
        "techniques",
        "scene --list",
        "lpv bundled:cornell --cells 8 --iterations 1 -o bench",
        "reference bundled:cornell --size 4x4 --spp 1 --no-cache -o a.exr",
    ] {
        let ran = lumivox(folder.path(), &words(line), &nothing);
        assert_eq!(ran.code, Some(0), "{line}: {}", ran.stderr);
    }
}

/// One line names all that is given without effect, and nothing that has one; what another
/// technique has is said to be its own.
#[test]
fn settings_without_effect_and_of_other_techniques_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let small = "--size 8x8 --shadow-resolution 16 --set resolution=8 -o a.png";
    for (options, warns) in [
        (
            "--preset cones --set rays=4096 --set kahl_side=on --set cones=9",
            Some("no effect together with the others: rays, kahl_side"),
        ),
        (
            "--preset cones --set gather=rays --set rays=4 --set cones=9 --set cones=5",
            Some("no effect together with the others: cones"),
        ),
        (
            "--set cone_set=kahl --set gather=cones --set kahl_side=on",
            None,
        ),
    ] {
        let ran = lumivox(
            folder.path(),
            &words(&format!("render bundled:cornell {small} {options}")),
            &[],
        );
        assert_eq!(ran.code, Some(0), "{options}: {}", ran.stderr);
        let found: Vec<&str> = ran
            .stderr
            .lines()
            .filter(|line| line.contains("no effect"))
            .collect();
        let is_so = match warns {
            Some(warns) => found.len() == 1 && found[0].ends_with(warns),
            None => found.is_empty(),
        };
        assert!(is_so, "{options}: {}", ran.stderr);
    }
    for (line, owner) in [
        (
            "render bundled:cornell -o a.png --technique svo --set mip_method=blit",
            "voxel-mips",
        ),
        ("view --technique none --set levels=2", "clipmap"),
        (
            "bench bundled:cornell -o b --technique clipmap --set lattice=corners",
            "svo",
        ),
    ] {
        let says = ["there is no setting", &format!("it is one of {owner}")];
        check_error(line, &lumivox(folder.path(), &words(line), &[]), 2, &says);
    }
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The report's error is what `compare` finds, whether the reference is one image or all layers.
#[test]
fn render_reports_the_error_against_a_reference() {
    let folder = tempfile::tempdir().unwrap();
    let run = |line: &str| {
        let ran = lumivox(folder.path(), &words(line), &[]);
        assert_eq!(ran.code, Some(0), "{line}: {}", ran.stderr);
    };
    run(
        "reference bundled:cornell --size 48x32 --spp 4 --bounces 1 --no-cache --layers -o \
         layers.exr",
    );
    run(
        "reference bundled:cornell --size 48x32 --spp 4 --bounces 1 --no-cache --aov indirect -o \
         indirect.exr",
    );
    for reference in ["layers.exr", "indirect.exr"] {
        run(&format!(
            "render bundled:cornell --size 48x32 --set resolution=16 --aov indirect -o t.exr \
             --report t.json --reference {reference}"
        ));
        run("compare t.exr indirect.exr --scene bundled:cornell --report c.json");
        let (report, compared) = (
            json(&folder.path().join("t.json")),
            json(&folder.path().join("c.json")),
        );
        assert_eq!(report["reference_file"], reference);
        assert_eq!(report["error"]["aov"], "indirect");
        assert!(report["error"]["pixel"]["rel_rmse"].as_f64().unwrap() > 0.0);
        // 32-bit numbers are written with fewer digits in one than in the other.
        let flip =
            |json: &serde_json::Value| json["error"]["flip"]["mean"].as_f64().unwrap() as f32;
        assert_eq!(flip(&report), flip(&compared));
        for key in ["channel", "pixel", "block", "materials"] {
            assert_eq!(
                report["error"][key], compared["error"][key],
                "{reference}: {key}"
            );
        }
    }
    std::fs::write(folder.path().join("text.exr"), "no image").unwrap();
    let errors: &[(&str, &[&str])] = &[
        ("--size 8x8 --reference gone.exr", &["gone.exr"]),
        ("--size 8x8 --reference text.exr", &["text.exr", "OpenEXR"]),
        (
            "--size 8x8 --reference indirect.exr",
            &["indirect.exr", "48x32", "8x8", "--size 48x32"],
        ),
    ];
    for (line, says) in errors {
        let line = format!("render bundled:cornell {line} --frames 100000 -o new.exr");
        check_error(&line, &lumivox(folder.path(), &words(&line), &[]), 2, says);
    }
    run("render bundled:cornell --size 48x32 --set resolution=16 -o t.exr --report t.json");
    assert!(json(&folder.path().join("t.json"))["error"].is_null());
}

/// A picture that shows nothing is warned of, with the reason; a model says which way up it looks.
#[test]
fn pictures_of_nothing_are_told() {
    let folder = tempfile::tempdir().unwrap();
    // A cube of 1 m, with fronts outwards, on the plane z = 0.
    let mut cube = String::new();
    for corner in 0..8 {
        let [x, y, z] = [corner & 1, corner >> 1 & 1, corner >> 2];
        cube += &format!("v {x} {y} {z}\n");
    }
    cube += "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    std::fs::write(folder.path().join("cube.obj"), &cube).unwrap();
    std::fs::write(
        folder.path().join("dark.toml"),
        "[[model]]\npath = \"cube.obj\"\n",
    )
    .unwrap();
    let inside = "--with 'camera={eye=[0.5,0.5,0.5],target=[0.5,0.5,0.0],up=[0.0,1.0,0.0]}'";
    let away = "--with 'camera={eye=[3.0,3.0,3.0],target=[9.0,9.0,9.0]}'";
    for (arguments, says) in [
        (
            "render dark.toml".to_owned(),
            "there is no light, no emission and no environment",
        ),
        ("render cube.obj".to_owned(), ""),
        (
            format!("render cube.obj {inside}"),
            "the camera is inside a solid",
        ),
        (
            format!("render dark.toml {away}"),
            "the camera sees no surface",
        ),
        ("render dark.toml --up z".to_owned(), "--up"),
        (
            "render bundled:cornell --exposure 1e9".to_owned(),
            "pass --exposure",
        ),
        (
            "render bundled:cornell --exposure 1e-9".to_owned(),
            "pass --exposure",
        ),
    ] {
        let line = format!("{arguments} --size 16x12 --set resolution=16 -o a.png");
        let words: Vec<OsString> = line
            .split('\'')
            .enumerate()
            .flat_map(|(index, part)| match index % 2 {
                1 => vec![OsString::from(part)],
                _ => part.split_whitespace().map(OsString::from).collect(),
            })
            .collect();
        let ran = lumivox(folder.path(), &words, &[]);
        assert_eq!(ran.code, Some(0), "{line}: {}", ran.stderr);
        assert!(ran.stderr.contains(says), "{line}: {}", ran.stderr);
        // A cube without more is to be seen.
        if says.is_empty() {
            assert!(!ran.stderr.contains("the picture is"), "{}", ran.stderr);
        }
    }
}
