//! Bad scenes: every one is an error of one line that says what, where and what to do; none is a
//! panic.

use crate::support::loading::write_anew;
use crate::support::{Missing, skipped};
use std::path::Path;

use lumivox::scene::{LoadOptions, Scene, SceneError};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

/// A bad input: its files, the one to load, and what the message must say.
struct Case {
    name: &'static str,
    files: &'static [(&'static str, &'static str)],
    says: &'static [&'static str],
}

/// Loads the first file of a case in a folder of its own.
fn message_of(case: &Case) -> String {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("good.obj"),
        format!("{TRIANGLE}f 1 2 3\n"),
    )
    .unwrap();
    for (name, text) in case.files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    match Scene::load(
        &folder.path().join(case.files[0].0),
        &LoadOptions::default(),
    ) {
        Ok(_) => panic!("{}: no error", case.name),
        Err(error) => error.to_string(),
    }
}

fn check(cases: &[Case]) {
    for case in cases {
        let message = message_of(case);
        check_message(case.name, &message, case.says);
    }
}

/// One line, with a hint behind a semicolon, that holds all of `says`.
fn check_message(name: &str, message: &str, says: &[&str]) {
    assert!(
        !message.contains('\n'),
        "{name}: more than one line: {message}"
    );
    assert!(message.contains("; "), "{name}: no hint: {message}");
    for part in says {
        assert!(
            message.contains(part),
            "{name}: `{part}` is not in: {message}"
        );
    }
}

#[test]
fn bad_toml() {
    check(&[
        Case {
            name: "empty",
            files: &[("a.toml", "")],
            says: &["a.toml", "[[model]]"],
        },
        Case {
            name: "syntax",
            files: &[("a.toml", "[[model]]\npath = \n")],
            says: &["a.toml:2"],
        },
        Case {
            name: "unknown key",
            files: &[("a.toml", "[[model]]\npath = 'good.obj'\ncolour = 3\n")],
            says: &["a.toml:3", "colour", "expected"],
        },
        Case {
            name: "unknown section",
            files: &[("a.toml", "[[model]]\npath = 'good.obj'\n[fog]\n")],
            says: &["a.toml:3", "fog"],
        },
        Case {
            name: "unknown light key",
            files: &[(
                "a.toml",
                "[[model]]\npath = 'good.obj'\n[[light]]\nkind = 'point'\nposition = \
                 [0,0,0]\nintensity = [1,1,1]\nradius = 1\n",
            )],
            says: &["a.toml:7", "radius"],
        },
        Case {
            name: "wrong type",
            files: &[("a.toml", "[[model]]\npath = 3\n")],
            says: &["a.toml:2", "string"],
        },
        Case {
            name: "two numbers",
            files: &[(
                "a.toml",
                "[[model]]\npath = 'good.obj'\n[environment]\nradiance = [1, 2]\n",
            )],
            says: &["a.toml:4", "array of length 3"],
        },
        Case {
            name: "no path",
            files: &[("a.toml", "[[model]]\nscale = 2\n")],
            says: &["a.toml:1", "path"],
        },
        Case {
            name: "missing model",
            files: &[("a.toml", "[[model]]\npath = 'gone.obj'\n")],
            says: &["a.toml:2", "model[0].path", "gone.obj", "relative"],
        },
        Case {
            name: "scale",
            files: &[("a.toml", "[[model]]\npath = 'good.obj'\nscale = 0.0\n")],
            says: &["a.toml:3", "`model[0].scale` is 0", "between"],
        },
        Case {
            name: "mirror",
            files: &[("a.toml", "[[model]]\npath = 'good.obj'\nscale = -1.0\n")],
            says: &["a.toml:3", "model[0].scale"],
        },
        Case {
            name: "NaN",
            files: &[(
                "a.toml",
                "[[model]]\npath = 'good.obj'\ntranslate = [0, nan, 0]\n",
            )],
            says: &["a.toml:3", "model[0].translate", "NaN"],
        },
        Case {
            name: "infinite",
            files: &[(
                "a.toml",
                "[[model]]\npath = 'good.obj'\nrotate_deg = [0, inf, 0]\n",
            )],
            says: &["a.toml:3", "rotate_deg"],
        },
        Case {
            name: "vfov",
            files: &[(
                "a.toml",
                "[[model]]\npath = 'good.obj'\n[camera]\neye = [0,0,1]\ntarget = \
                 [0,0,0]\nvfov_deg = 180\n",
            )],
            says: &["a.toml:6", "camera.vfov_deg", "1.0 and 175.0"],
        },
        Case {
            name: "no view",
            files: &[(
                "a.toml",
                "[[model]]\npath = 'good.obj'\n[camera]\neye = [1,2,3]\ntarget = [1,2,3]\n",
            )],
            says: &["a.toml:5", "camera.eye"],
        },
        Case {
            name: "up",
            files: &[(
                "a.toml",
                "[[model]]\npath = 'good.obj'\n[camera]\neye = [0,5,0]\ntarget = [0,0,0]\nup = \
                 [0,1,0]\n",
            )],
            says: &["a.toml:6", "camera.up", "parallel"],
        },
        Case {
            name: "keyframe of a static model",
            files: &[(
                "a.toml",
                "[[model]]\npath = 'good.obj'\n[[model.keyframe]]\ntime_s = 0\n",
            )],
            says: &["a.toml:4", "model[0]", "not dynamic", "dynamic = true"],
        },
        Case {
            name: "times that do not rise",
            files: &[(
                "a.toml",
                "[[model]]\npath = 'good.obj'\ndynamic = true\n[[model.keyframe]]\ntime_s = \
                 2\n[[model.keyframe]]\ntime_s = 2.0\n",
            )],
            says: &[
                "a.toml:7",
                "`model[0].keyframe[1].time_s` is 2, not after 2",
                "order",
            ],
        },
        Case {
            name: "time",
            files: &[(
                "a.toml",
                "[[model]]\npath = 'good.obj'\ndynamic = true\n[[model.keyframe]]\ntime_s = inf\n",
            )],
            says: &["a.toml:5", "model[0].keyframe[0].time_s", "inf", "between"],
        },
        Case {
            name: "no time",
            files: &[(
                "a.toml",
                "[[model]]\npath = 'good.obj'\ndynamic = true\n[[model.keyframe]]\ntranslate = \
                 [0, 0, 0]\n",
            )],
            says: &["a.toml:4", "time_s"],
        },
        Case {
            name: "keyframe's key",
            files: &[(
                "a.toml",
                "[[model]]\npath = 'good.obj'\ndynamic = true\n[[model.keyframe]]\ntime_s = \
                 0\nscale = 2\n",
            )],
            says: &["a.toml:6", "scale", "expected"],
        },
        Case {
            name: "keyframe's rotation",
            files: &[(
                "a.toml",
                "[[model]]\npath = 'good.obj'\ndynamic = true\n[[model.keyframe]]\ntime_s = \
                 0\nrotate_deg = [0, 400, 0]\n",
            )],
            says: &["a.toml:6", "model[0].keyframe[0].rotate_deg", "400", "360"],
        },
        Case {
            name: "camera without eye",
            files: &[(
                "a.toml",
                "[[model]]\npath = 'good.obj'\n[camera]\ntarget = [0,0,0]\n",
            )],
            says: &["a.toml:3", "eye"],
        },
    ]);
}

#[test]
fn bad_lights() {
    const HEAD: &str = "[[model]]\npath = 'good.obj'\n[[light]]\nkind = 'point'\nposition = \
                        [0,0,0]\nintensity = [1,1,1]\n[[light]]\n";
    let cases: &[(&str, &str, &[&str])] = &[
        (
            "kind",
            "kind = 'area'\n",
            &["a.toml:8", "light[1].kind", "area", "spot"],
        ),
        (
            "missing",
            "kind = 'directional'\ndirection = [0,-1,0]\n",
            &["a.toml:8", "light[1].irradiance", "missing"],
        ),
        (
            "foreign",
            "kind = 'point'\nposition = [0,0,0]\nintensity = [1,1,1]\nirradiance = [1,1,1]\n",
            &["a.toml:11", "light[1].irradiance", "belong"],
        ),
        (
            "negative",
            "kind = 'point'\nposition = [0,0,0]\nintensity = [1,-1,1]\n",
            &["a.toml:10", "light[1].intensity", "-1"],
        ),
        (
            "no direction",
            "kind = 'directional'\nirradiance = [1,1,1]\ndirection = [0,0,0]\n",
            &["a.toml:10", "light[1].direction", "length"],
        ),
        (
            "inner beyond outer",
            "kind = 'spot'\nposition = [0,0,0]\ndirection = [0,-1,0]\nintensity = \
             [1,1,1]\ninner_deg = 40\nouter_deg = 30\n",
            &["a.toml:12", "light[1].inner_deg", "40", "30.0"],
        ),
        (
            "outer",
            "kind = 'spot'\nposition = [0,0,0]\ndirection = [0,-1,0]\nintensity = \
             [1,1,1]\ninner_deg = 4\nouter_deg = 90\n",
            &["a.toml:13", "light[1].outer_deg", "90"],
        ),
        (
            "no outer",
            "kind = 'spot'\nposition = [0,0,0]\ndirection = [0,-1,0]\nintensity = \
             [1,1,1]\ninner_deg = 4\n",
            &["light[1].outer_deg", "missing"],
        ),
    ];
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("good.obj"),
        format!("{TRIANGLE}f 1 2 3\n"),
    )
    .unwrap();
    let path = folder.path().join("a.toml");
    for (name, tail, says) in cases {
        std::fs::write(&path, format!("{HEAD}{tail}")).unwrap();
        check_message(name, &load_error(&path), says);
    }
}

fn load_error(path: &Path) -> String {
    Scene::load(path, &LoadOptions::default())
        .err()
        .unwrap_or_else(|| panic!("{}: no error", path.display()))
        .to_string()
}

#[test]
fn bad_obj() {
    check(&[
        Case {
            name: "empty",
            files: &[("a.obj", "")],
            says: &["a.obj", "no faces"],
        },
        Case {
            name: "no faces",
            files: &[("a.obj", "v 0 0 0\n")],
            says: &["a.obj", "no faces"],
        },
        Case {
            name: "no area",
            files: &[("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")],
            says: &["a.obj", "no area"],
        },
        Case {
            name: "NaN",
            files: &[("a.obj", "v 0 0 0\nv 1 nan 0\n")],
            says: &["a.obj:2", "`v`", "nan", "not finite"],
        },
        Case {
            name: "infinite normal",
            files: &[("a.obj", "vn 0 inf 0\n")],
            says: &["a.obj:1", "`vn`", "not finite"],
        },
        Case {
            name: "overflow",
            files: &[("a.obj", "v 0 1e99 0\n")],
            says: &["a.obj:1", "1e99", "not finite"],
        },
        Case {
            name: "word",
            files: &[("a.obj", "v 0 zero 0\n")],
            says: &["a.obj:1", "zero", "not a number"],
        },
        Case {
            name: "short",
            files: &[("a.obj", "v 0 0\n")],
            says: &["a.obj:1", "2 numbers", "3 are needed"],
        },
        Case {
            name: "beyond",
            files: &[("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n")],
            says: &["a.obj:4", "`v` number 4", "3 are defined"],
        },
        Case {
            name: "zero",
            files: &[("a.obj", "v 0 0 0\nf 0 1 1\n")],
            says: &["a.obj:2", "`v` number 0"],
        },
        Case {
            name: "too negative",
            files: &[("a.obj", "v 0 0 0\nf -1 -2 -1\n")],
            says: &["a.obj:2", "number -2"],
        },
        Case {
            name: "no such vt",
            files: &[("a.obj", "v 0 0 0\nf 1/1 1/1 1/1\n")],
            says: &["a.obj:2", "`vt` number 1"],
        },
        Case {
            name: "no such vn",
            files: &[("a.obj", "v 0 0 0\nf 1//7 1//1 1//1\n")],
            says: &["a.obj:2", "`vn` number 7"],
        },
        Case {
            name: "huge index",
            files: &[("a.obj", "v 0 0 0\nf 1 1 99999999999999999999\n")],
            says: &["a.obj:2", "not an index"],
        },
        Case {
            name: "index beyond 32 bits",
            files: &[("a.obj", "v 0 0 0\nf 1 1 4294967296\n")],
            says: &["a.obj:2", "4294967296"],
        },
        Case {
            name: "smallest index",
            files: &[("a.obj", "v 0 0 0\nf 1 1 -9223372036854775808\n")],
            says: &["a.obj:2", "-9223372036854775808"],
        },
        Case {
            name: "corner",
            files: &[("a.obj", "v 0 0 0\nf 1/1/1/1 1 1\n")],
            says: &["a.obj:2"],
        },
        Case {
            name: "two corners",
            files: &[("a.obj", "v 0 0 0\nf 1 1\n")],
            says: &["a.obj:2", "2 corners"],
        },
        Case {
            name: "no mtl",
            files: &[("a.obj", "mtllib gone.mtl\n")],
            says: &["a.obj"],
        },
    ]);
}

#[test]
fn bad_mtl() {
    let says: &[(&str, &[&str])] = &[
        ("Kd 1 1", &["a.mtl:2", "`Kd` has 2 numbers"]),
        ("Kd", &["a.mtl:2", "`Kd` has 0 numbers"]),
        (
            "Kd 0.1 1.5 0.1",
            &["a.mtl:2", "`Kd` is 1.5", "between 0 and 1"],
        ),
        ("Ke 1 nan 1", &["a.mtl:2", "`Ke`"]),
        ("Ke 1 -1 1", &["a.mtl:2", "`Ke` is -1"]),
        ("Ns -3", &["a.mtl:2", "`Ns` is -3"]),
        ("Ns inf", &["a.mtl:2", "`Ns`"]),
        ("Pr 2", &["a.mtl:2", "`Pr` is 2"]),
        ("Pm red", &["a.mtl:2", "`Pm` is `red`"]),
        ("d", &["a.mtl:2", "`d`"]),
        ("map_Kd", &["a.mtl:2", "`map_Kd` names no file"]),
        ("map_Bump -bm", &["a.mtl:2", "-bm"]),
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(
        &path,
        format!("mtllib a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n"),
    )
    .unwrap();
    for (line, says) in says {
        std::fs::write(folder.path().join("a.mtl"), format!("newmtl m\n{line}\n")).unwrap();
        check_message(line, &load_error(&path), says);
    }
    std::fs::write(folder.path().join("a.mtl"), "Kd 1 1 1\n").unwrap();
    check_message("no newmtl", &load_error(&path), &["a.mtl:1", "newmtl"]);
    std::fs::remove_file(folder.path().join("a.mtl")).unwrap();
    check_message(
        "no file",
        &load_error(&path),
        &["a.obj:1", "a.mtl", "does not exist"],
    );
}

/// A folder with an OBJ whose material has the given lines.
fn with_material(lines: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("a.obj"),
        format!("mtllib a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n"),
    )
    .unwrap();
    std::fs::write(folder.path().join("a.mtl"), format!("newmtl m\n{lines}\n")).unwrap();
    folder
}

#[test]
fn all_missing_textures_are_listed() {
    let folder =
        with_material("map_Kd one.png\nmap_Ke two.jpg\nmap_d dir\\three.tga\nnorm four.png");
    let message = load_error(&folder.path().join("a.obj"));
    let says = [
        "4 missing textures",
        "one.png (material `m`, ",
        "a.mtl:2)",
        "two.jpg",
        "three.tga",
        "four.png",
        "a.mtl:5",
        "--allow-missing-textures",
    ];
    check_message("missing", &message, &says);
}

#[test]
fn bad_pictures() {
    let folder = with_material("map_Kd a.png");
    let (obj, png) = (folder.path().join("a.obj"), folder.path().join("a.png"));
    image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([(x * y) as u8, x as u8, y as u8]))
        .save(&png)
        .unwrap();
    let whole = std::fs::read(&png).unwrap();
    for length in [0, 8, 20, 40, whole.len() / 2, whole.len() - 30] {
        std::fs::write(&png, &whole[..length]).unwrap();
        check_message(
            &format!("first {length} bytes"),
            &load_error(&obj),
            &["a.png", "cannot be decoded", "export it again"],
        );
    }
    std::fs::write(&png, "this is no picture").unwrap();
    check_message("text", &load_error(&obj), &["a.png"]);
    image::GrayImage::new(16_385, 1).save(&png).unwrap();
    check_message(
        "huge",
        &load_error(&obj),
        &["a.png", "16385 × 1", "at most 16384"],
    );
    std::fs::remove_file(&png).unwrap();
    std::fs::create_dir(&png).unwrap();
    check_message("folder", &load_error(&obj), &["a.png"]);
}

#[test]
fn bad_paths() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    check_message(
        "missing",
        &load_error(&at("gone.toml")),
        &["gone.toml", "check the path"],
    );
    check_message(
        "missing, no extension",
        &load_error(&at("gone")),
        &["gone", "check the path"],
    );
    check_message("folder", &load_error(folder.path()), &["this is a folder"]);
    std::fs::create_dir(at("a.obj")).unwrap();
    check_message(
        "folder called .obj",
        &load_error(&at("a.obj")),
        &["a.obj", "this is a folder"],
    );
    std::fs::write(at("a.fbx"), "{}").unwrap();
    check_message(
        "another format",
        &load_error(&at("a.fbx")),
        &["a.fbx", "no .toml, .obj, .gltf or .glb file"],
    );
    std::fs::write(at("b.toml"), b"# ok\n\xff\xfe\n").unwrap();
    check_message(
        "not UTF-8",
        &load_error(&at("b.toml")),
        &["b.toml:2", "UTF-8"],
    );
}

#[cfg(unix)]
#[test]
fn paths_that_are_not_utf8_work() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join(std::ffi::OsStr::from_bytes(b"caf\xe9"));
    if let Err(error) = std::fs::create_dir(&inner) {
        skipped(&Missing::Other(&format!(
            "this file system has no names that are not UTF-8 ({error})"
        )));
        return;
    }
    let path = inner.join(std::ffi::OsStr::from_bytes(b"\xe9.obj"));
    std::fs::write(
        &path,
        format!("# caf\u{e9}\nmtllib a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n"),
    )
    .unwrap();
    std::fs::write(
        inner.join("a.mtl"),
        b"# caf\xe9\nnewmtl m\nKd 0.1 0.2 0.3\n",
    )
    .unwrap();
    let scene = Scene::open(&path, &LoadOptions::default()).unwrap();
    assert_eq!(scene.triangles.len(), 1);
    let written = scene.write(&inner.join("copy")).unwrap();
    assert_eq!(
        Scene::load(&written, &LoadOptions::default())
            .unwrap()
            .vertices,
        scene.vertices
    );
}

#[test]
fn bad_bundled_scenes() {
    let message = |source: &str| {
        Scene::open(source, &LoadOptions::default())
            .err()
            .unwrap_or_else(|| panic!("{source}: no error"))
            .to_string()
    };
    check_message(
        "name",
        &message("bundled:cornel"),
        &["`cornel`", "cornell", "two-rooms"],
    );
    check_message(
        "parameter",
        &message("bundled:two-rooms,width_m=1"),
        &[
            "two-rooms",
            "`width_m`",
            "unknown",
            "thickness_m, lit_length_m",
        ],
    );
    check_message(
        "no parameters",
        &message("bundled:cornell,width_m=1"),
        &["no parameters"],
    );
    check_message(
        "range",
        &message("bundled:two-rooms,thickness_m=-1"),
        &["`thickness_m` is -1", "between 0.001 and 2"],
    );
    check_message(
        "NaN",
        &message("bundled:furnace,albedo=nan"),
        &["`albedo` is NaN"],
    );
    check_message(
        "switch",
        &message("bundled:two-rooms,door=0.5"),
        &["`door` is 0.5", "whole number"],
    );
    check_message(
        "word",
        &message("bundled:two-rooms,door=ajar"),
        &["`door`", "ajar", "not a number"],
    );
    check_message(
        "no value",
        &message("bundled:two-rooms,door"),
        &["`door`", "KEY=VALUE"],
    );
}

#[test]
fn a_folder_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "").unwrap();
    let error = Scene::bundled("cornell", &[])
        .unwrap()
        .write(&file.join("inside"))
        .unwrap_err();
    assert!(matches!(error, SceneError::Write { .. }));
    check_message(
        "write",
        &error.to_string(),
        &["inside", "cannot be written"],
    );
}

/// Cuts a good OBJ and MTL at every byte and flips bytes: never a panic.
#[test]
fn damaged_files_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = Scene::bundled("furnace", &[]).unwrap();
    scene.environment = glam::Vec3::ONE.into();
    let toml = scene.write(folder.path()).unwrap();
    for name in ["furnace.toml", "furnace.obj", "furnace.mtl"] {
        let path = folder.path().join(name);
        let whole = std::fs::read(&path).unwrap();
        for position in (0..whole.len()).step_by(3) {
            for replacement in [
                None,
                Some(b'-'),
                Some(b'9'),
                Some(b'\n'),
                Some(b'\xff'),
                Some(b'"'),
                Some(b'e'),
            ] {
                let mut damaged = whole.clone();
                match replacement {
                    Some(byte) => damaged[position] = byte,
                    None => damaged.truncate(position),
                }
                write_anew(&path, &damaged);
                if let Err(error) = Scene::load(&toml, &LoadOptions::default()) {
                    check_message(name, &error.to_string(), &["furnace"]);
                }
            }
        }
        write_anew(&path, &whole);
    }
}
