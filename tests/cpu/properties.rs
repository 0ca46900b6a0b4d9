//! Properties that hold for whatever is thrown at them: scenes from a grammar that knows how files
//! are broken, voxel grids, boxes and clipmaps around any bounds.
//!
//! Seeds are fixed, so that each run tries the same cases; a failure prints the smallest case that
//! still fails.

use std::path::Path;

use glam::{DVec3, IVec3, Vec3};
use lumivox::gi::shared::voxel::{VoxelBox, VoxelGrid};
use lumivox::gi::voxel_cones::clipmap::layout::Layout;
use lumivox::scene::{LoadOptions, Scene, SceneError};
use proptest::prelude::*;
use proptest::sample::select;
use proptest::test_runner::RngSeed;

use crate::support::loading::{MTL, OBJ, check_invariants, check_scene, round_trip, write_anew};

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(17),
        ..ProptestConfig::default()
    }
}

/// What the fuzzers begin with, and what they found something with.
#[test]
fn files_of_the_fuzzers_load_or_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = |kind: &str| folder.path().join(format!("scene.{kind}"));
    let fuzz = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz");
    let files = |parts: [&str; 2]| std::fs::read_dir(fuzz.join(parts[0]).join(parts[1]));
    for kind in ["obj", "mtl", "toml", "gltf"] {
        let found = files(["corpus", kind]).into_iter().flatten();
        let all: Vec<_> = files(["seeds", kind]).unwrap().chain(found).collect();
        assert!(!all.is_empty(), "{kind}");
        for file in all {
            write_anew(&path("obj"), OBJ);
            write_anew(&path("mtl"), MTL);
            write_anew(&path(kind), std::fs::read(file.unwrap().path()).unwrap());
            let is_read_itself = ["toml", "gltf"].contains(&kind);
            check_scene(&path(if is_read_itself { kind } else { "obj" }));
        }
    }
}

// Scenes from a grammar.

/// A number as exporters and people write it; one in eight is no number that a scene can have.
fn number() -> impl Strategy<Value = String> {
    const ODD: &[&str] = &[
        "nan",
        "inf",
        "-inf",
        "1e99",
        "-1e38",
        "3.4e38",
        "1e-45",
        "1e9",
        "-1e10",
        "0x10",
        "1,5",
        "--1",
        "1e",
        "٣",
        "1.0.0",
        "\u{2212}1",
        "\"",
    ];
    prop_oneof![
        8 => (-4i32..=4).prop_map(|value| value.to_string()),
        5 => (-100.0f32..100.0).prop_map(|value| format!("{value:?}")),
        1 => (-1e6f32..1e6).prop_map(|value| format!("{value:e}")),
        2 => select(ODD).prop_map(str::to_owned),
    ]
}

/// So many numbers as belong there; at times one fewer or more.
fn numbers(count: usize) -> impl Strategy<Value = String> {
    prop_oneof![
        14 => prop::collection::vec(number(), count),
        1 => prop::collection::vec(number(), count - 1..=count + 2),
    ]
    .prop_map(|numbers| numbers.join(" "))
}

/// An index into a list of a dozen.
fn index() -> impl Strategy<Value = String> {
    const ODD: &[&str] = &[
        "0",
        "-13",
        "99",
        "4294967296",
        "-9223372036854775808",
        "99999999999999999999",
        "1.5",
        "+2",
        "",
        "x",
    ];
    prop_oneof![800 => (1..=12).prop_map(|index: i32| index.to_string()),
        160 => (-12..0).prop_map(|index: i32| index.to_string()),
        1 => select(ODD).prop_map(str::to_owned)]
}

fn corner() -> impl Strategy<Value = String> {
    prop_oneof![
        8 => index(),
        4 => (index(), index(), index()).prop_map(|(v, vt, vn)| format!("{v}/{vt}/{vn}")),
        2 => (index(), index()).prop_map(|(v, vn)| format!("{v}//{vn}")),
        2 => (index(), index()).prop_map(|(v, vt)| format!("{v}/{vt}")),
    ]
}

fn name() -> impl Strategy<Value = String> {
    select(
        &[
            "red",
            "Red",
            "bright lamp",
            "grün",
            "a#b",
            "\"quoted\"",
            "",
            "back\\slash",
            "名前",
            "a/b",
            "..",
            "default",
            "red_2",
        ][..],
    )
    .prop_map(str::to_owned)
}

fn face() -> impl Strategy<Value = String> {
    prop_oneof![90 => prop::collection::vec(corner(), 3..=6),
        1 => prop::collection::vec(corner(), 0..=9)]
    .prop_map(|corners| format!("f {}", corners.join(" ")))
}

/// Twelve of everything that faces refer to, then faces and all else; one line in some hundred is
/// broken.
fn obj() -> BoxedStrategy<Vec<String>> {
    let line = prop_oneof![
        120 => face(),
        30 => name().prop_map(|name| format!("usemtl {name}")),
        1 => name().prop_map(|name| format!("mtllib {name}")),
        12 => select(&["", "# f 1 2 3", "o thing", "s off", "l 1 2", "\u{feff}",
            "f 1 2 3 # behind", "\t f  1\t2 3 ", "vp 0.1", "call a.obj",
            "\u{0}"][..]).prop_map(str::to_owned),
    ];
    let list = |key: &'static str, count| {
        prop::collection::vec(
            plain(count).prop_map(move |numbers| format!("{key} {numbers}")),
            12,
        )
    };
    let broken = prop_oneof![6 => Just(None),
        1 => (any::<prop::sample::Index>(), select(&["v", "vt", "vn"][..]),
        numbers(3)).prop_map(Some)];
    (
        list("v", 3),
        list("vt", 2),
        list("vn", 3),
        prop::collection::vec(line, 1..24),
        broken,
    )
        .prop_map(|(v, vt, vn, lines, broken)| {
            let mut all = [vec!["mtllib scene.mtl".to_owned()], v, vt, vn, lines].concat();
            if let Some((place, key, numbers)) = broken {
                let place = place.index(all.len());
                all.insert(place, format!("{key} {numbers}"));
            }
            all
        })
        .boxed()
}

/// Numbers of a model that is well, most of them on a small lattice, so that corners coincide and
/// polygons have no area.
fn plain(count: usize) -> impl Strategy<Value = String> {
    let value = prop_oneof![6 => (-2i32..=2).prop_map(|value| value.to_string()),
        2 => (-10.0f32..10.0).prop_map(|value| format!("{value}")), 1 => Just("1e-7".to_owned())];
    prop::collection::vec(value, count).prop_map(|values| values.join(" "))
}

fn mtl() -> BoxedStrategy<Vec<String>> {
    let colour = (select(&["Kd", "Ks", "Ke", "Ka"][..]), numbers(3))
        .prop_map(|(key, numbers)| format!("{key} {numbers}"));
    let share =
        || prop_oneof![60 => (0.0f32..=1.0).prop_map(|share| share.to_string()), 1 => number()];
    let good = (select(&["Kd", "Ks", "Ke"][..]), share(), share(), share())
        .prop_map(|(key, r, g, b)| format!("{key} {r} {g} {b}"));
    let scalar = (
        select(&["Ns", "Pr", "Pm", "d", "Tr", "Ni", "illum", "d -halo"][..]),
        share(),
    )
        .prop_map(|(key, number)| format!("{key} {number}"));
    let file = select(
        &[
            "t.png",
            "T.PNG",
            "gone.png",
            "t.png",
            ".",
            "sub\\t.png",
            "a b.png",
            "",
        ][..],
    );
    let option = select(
        &[
            "",
            "-bm 0.5 ",
            "-o 1 2 3 ",
            "-s 1 ",
            "-mm 0 1 ",
            "-bm ",
            "-bm nan ",
            "-clamp on ",
            "-o 1 2 3 -bm 2 ",
        ][..],
    );
    let map = (
        select(&["map_Kd", "map_Ke", "map_d", "norm", "map_Bump", "bump"][..]),
        option,
        file,
    )
        .prop_map(|(key, option, file)| format!("{key} {option}{file}"));
    let other = select(&["", "# Kd 1 1 1", "Kx 1", "Kd 0.5 # grey", "Kd", "\u{fffd}"][..])
        .prop_map(str::to_owned);
    let line = prop_oneof![60 => name().prop_map(|name| format!("newmtl {name}")), 60 => good,
        3 => colour, 40 => scalar, 12 => map, 4 => other];
    prop::collection::vec(line, 0..16)
        .prop_map(|mut lines| {
            lines.insert(0, "newmtl red".to_owned());
            lines
        })
        .boxed()
}

/// A value for a key of a scene file, right for it or not.
fn toml_value() -> impl Strategy<Value = String> {
    let vector =
        prop::collection::vec(number(), 3).prop_map(|numbers| format!("[{}]", numbers.join(", ")));
    let odd = select(
        &[
            "\"spot\"",
            "'point'",
            "\"\"",
            "true",
            "[]",
            "{}",
            "[1, 2]",
            "1979-05-27",
            "\"unclosed",
            "0xff",
            "[[1,2,3]]",
            "\"\\u00e4\"",
        ][..],
    );
    prop_oneof![6 => vector, 4 => number(), 2 => odd.prop_map(str::to_owned)]
}

fn toml() -> BoxedStrategy<Vec<String>> {
    let vector = || {
        prop::collection::vec((-9i32..=9).prop_map(|value| format!("{value}.5")), 3)
            .prop_map(|numbers| format!("[{}]", numbers.join(", ")))
    };
    let light = prop_oneof![
        (vector(), 0..9).prop_map(|(at, light)| format!(
            "[[light]]\nkind = \"point\"\nposition = {at}\nintensity = [{light}, 1, 2.5]"
        )),
        (vector(), vector(), 0..95, 0..95).prop_map(|(at, to, inner, outer)| format!(
            "[[light]]\nkind = 'spot'\nposition = {at}\ndirection = {to}\nintensity = [1, 1, \
             1]\ninner_deg = {inner}\nouter_deg = {outer}"
        )),
        (vector(), 0..9).prop_map(|(to, light)| format!(
            "light = []\n[[light]]\nkind = \"directional\"\nirradiance = [{light}, 0, \
             0]\ndirection = {to}"
        )),
        vector().prop_map(|to| format!(
            "[[light]]\nkind = \"directional\"\nirradiance = [1, 0, 0]\ndirection = {to}"
        )),
    ];
    let camera = (vector(), vector(), vector(), 0..190).prop_map(|(eye, target, up, fov)| {
        format!("[camera]\neye = {eye}\ntarget = {target}\nup = {up}\nvfov_deg = {fov}")
    });
    let model = prop_oneof![
        4 => (vector(), vector(), select(&["1.0", "0.01", "1e-6", "1e6", "0.0", "-1.0"][..]))
            .prop_map(|(at, turned, scale)|
                format!("[[model]]\npath = \"SCENE.obj\"\nscale = {scale}\ntranslate = \
                {at}\nrotate_deg = {turned}")),
        2 => (vector(), vector(), -3..9).prop_map(|(at, turned, time)| format!(
            "[[model]]\npath = 'scene.obj'\ndynamic = true\n[[model.keyframe]]\ntime_s = \
                0.0\n[[model.keyframe]]\ntime_s = {time}.0\ntranslate = {at}\nrotate_deg = {turned}"
        )),
        1 => select(&["gone.obj", "", ".", "scene.mtl", "sub/../scene.obj", "..\\scene.obj",
            "/dev/null"][..]).prop_map(|path| format!("[[model]]\npath = '{path}'")),
    ];
    const KEYS: &[&str] = &[
        "path",
        "scale",
        "translate",
        "time_s",
        "eye",
        "up",
        "vfov_deg",
        "kind",
        "direction",
        "irradiance",
        "radiance",
        "intensity",
        "inner_deg",
        "dynamic",
        "sacle",
    ];
    let other = prop_oneof![
        2 => (select(KEYS), toml_value()).prop_map(|(key, value)| format!("{key} = {value}")),
        1 => toml_value().prop_map(|value| format!("[environment]\nradiance = {value}")),
        1 => select(&["", "# comment", "[environment]", "[[model]]", "[[light]]", "[[", "[camera",
            "= 1", "[a.b.c]", "\"quoted key\" = 1", "\u{feff}"][..]).prop_map(str::to_owned),
    ];
    let part = prop_oneof![3 => light, 1 => camera, 1 => model.clone(), 1 => other];
    (model, prop::collection::vec(part, 0..5))
        .prop_map(|(model, parts)| [vec![model], parts].concat())
        .boxed()
}

/// Lines as one system or another ends them.
fn text(lines: BoxedStrategy<Vec<String>>) -> BoxedStrategy<String> {
    (
        lines,
        select(&["\n", "\n", "\r\n", "\n\n"][..]),
        any::<bool>(),
    )
        .prop_map(|(lines, end, last)| lines.join(end) + if last { end } else { "" })
        .boxed()
}

/// A folder with a picture that materials may name.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    image::RgbaImage::from_fn(2, 2, |x, y| {
        image::Rgba([(x * 200) as u8, 10, 250, (y * 255) as u8])
    })
    .save(folder.path().join("t.png"))
    .unwrap();
    folder
}

/// Loads what was written; a scene keeps the invariants and survives writing, an error is one line
/// that names a file and, where it is about a line, that too.
fn loads_or_says_why(path: &Path) -> Result<Scene, String> {
    let options = LoadOptions {
        allow_missing_textures: true,
        ..LoadOptions::default()
    };
    let error = match Scene::load(path, &options) {
        Ok(scene) => {
            check_invariants(&scene);
            round_trip(&scene);
            return Ok(scene);
        }
        Err(error) => error,
    };
    let message = error.to_string();
    assert!(
        message.contains("scene.") && !message.contains('\n') && message.contains("; "),
        "{message}"
    );
    match error {
        SceneError::Line { path, line, .. } => {
            let text = std::fs::read(&path).unwrap();
            let lines = String::from_utf8_lossy(&text).lines().count();
            assert!(
                (1..=lines.max(1)).contains(&line),
                "{message}: {} has {lines} lines",
                path.display()
            );
        }
        SceneError::File { .. } | SceneError::Read { .. } => {}
        other => panic!("{other}"),
    }
    Err(message)
}

/// Counts the cases that loaded: a grammar from which nothing loads, or everything, proves little.
#[derive(Default)]
struct Tally {
    loaded: std::cell::Cell<u32>,
    refused: std::cell::Cell<u32>,
}

impl Tally {
    fn count(&self, result: &Result<Scene, String>) {
        let cell = if result.is_ok() {
            &self.loaded
        } else {
            &self.refused
        };
        cell.set(cell.get() + 1);
    }

    fn check(&self) {
        let (loaded, refused) = (self.loaded.get(), self.refused.get());
        println!("{loaded} loaded, {refused} refused");
        assert!(
            loaded.min(refused) * 5 > loaded + refused,
            "{loaded} loaded, {refused} refused: the grammar is one-sided"
        );
    }
}

/// Runs a property on the cases of a strategy; a failure shows the smallest.
fn check<S: Strategy>(cases: u32, strategy: &S, property: impl Fn(S::Value)) {
    let mut runner = proptest::test_runner::TestRunner::new(config(cases));
    let tried = runner.run(strategy, |value| {
        property(value);
        Ok(())
    });
    tried.unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn models_load_or_the_error_names_the_line() {
    let (folder, tally) = (folder(), Tally::default());
    let path = folder.path().join("scene.obj");
    check(1000, &(text(obj()), text(mtl())), |(obj, mtl)| {
        write_anew(&path, obj);
        write_anew(&folder.path().join("scene.mtl"), mtl);
        tally.count(&loads_or_says_why(&path));
    });
    tally.check();
}

#[test]
fn scene_files_load_or_the_error_names_the_line() {
    let (folder, tally) = (folder(), Tally::default());
    std::fs::write(
        folder.path().join("scene.obj"),
        "mtllib scene.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl red\nf 1 2 3\nusemtl \
         blue\nf 1 2 4\n",
    )
    .unwrap();
    std::fs::write(
        folder.path().join("scene.mtl"),
        "newmtl red\nKe 1 2 3\nmap_Kd t.png\nnewmtl blue\nKs 1 1 1\nPr 0.3\n",
    )
    .unwrap();
    let path = folder.path().join("scene.toml");
    check(1500, &text(toml()), |toml| {
        write_anew(&path, toml);
        tally.count(&loads_or_says_why(&path));
    });
    tally.check();
}

// Grids, boxes and clipmaps.

/// A coordinate near or far from the origin (m), as far as scenes may reach.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![2 => Just(0.0), 6 => -100.0f32..100.0, 2 => -1e5f32..1e5, 1 => -1e9f32..1e9,
        1 => select(&[1e9f32, -1e9, 1e-30, -1e-30][..])]
}

/// An extent (m): none, tiny, ordinary, huge.
fn extent() -> impl Strategy<Value = f32> {
    prop_oneof![2 => Just(0.0), 6 => 0.0f32..100.0, 2 => 0.0f32..1e-3, 1 => 0.0f32..1e9,
        1 => select(&[1e-30f32, 1e-12, 1e9][..])]
}

/// Bounds of a scene (m).
fn bounds() -> impl Strategy<Value = (Vec3, Vec3)> {
    let axes = || [coordinate(), coordinate(), coordinate()];
    (axes(), [extent(), extent(), extent()]).prop_map(|(low, size)| {
        let low = Vec3::from(low);
        (low, (low + Vec3::from(size)).min(Vec3::splat(1e9)).max(low))
    })
}

/// How far apart 32-bit numbers are there (m).
fn rounding((low, high): (Vec3, Vec3)) -> f64 {
    f64::from(low.abs().max(high.abs()).max_element()) * f64::from(f32::EPSILON)
}

#[test]
fn grids_hold_their_bounds() {
    check(20_000, &(bounds(), 3u32..=11), |(bounds, power)| {
        let grid = VoxelGrid::around(bounds, 1 << power);
        assert_eq!(grid.resolution, 1 << power);
        assert!(
            grid.voxel_size.is_normal() && grid.voxel_size > 0.0 && grid.origin.is_finite(),
            "{grid:?}"
        );
        let size = f64::from(grid.voxel_size);
        let origin = grid.origin.as_dvec3();
        let end = origin + size * f64::from(grid.resolution);
        // What rounding takes away, in voxels: two of emptiness are left where positions are finer
        // than voxels.
        let slack = DVec3::splat(2.0 * size - 4.0 * rounding(bounds) - 1e-4 * size);
        assert!(
            (origin + slack).cmple(bounds.0.as_dvec3()).all()
                && (end - slack).cmpge(bounds.1.as_dvec3()).all(),
            "{grid:?}"
        );
        let widest = f64::from((bounds.1 - bounds.0).max_element());
        let most = (1.04 * widest)
            .max(widest / (f64::from(grid.resolution) - 4.5) * f64::from(grid.resolution));
        assert!(
            size * f64::from(grid.resolution) <= 1.001 * most + 1e-30,
            "the grid is no larger than it has to be: {grid:?}"
        );
    });
}

fn voxel_box() -> impl Strategy<Value = VoxelBox> {
    let corner = || prop_oneof![4 => -6i32..6, 1 => -5000i32..5000, 1 => -(1i32 << 24)..1 << 24];
    let size = || prop_oneof![1 => Just(0i32), 6 => 1i32..8, 1 => 1i32..4096, 1 => -3i32..0];
    ([corner(), corner(), corner()], [size(), size(), size()]).prop_map(|(low, size)| VoxelBox {
        low: IVec3::from(low),
        end: IVec3::from(low) + IVec3::from(size),
    })
}

fn volume(part: VoxelBox) -> i128 {
    if part.is_empty() {
        0
    } else {
        part.size().to_array().into_iter().map(i128::from).product()
    }
}

fn holds(whole: VoxelBox, part: VoxelBox) -> bool {
    part.is_empty() || (whole.low.cmple(part.low).all() && whole.end.cmpge(part.end).all())
}

#[test]
fn boxes_are_sets_of_voxels() {
    check(20_000, &(voxel_box(), voxel_box()), |(a, b)| {
        let (common, both) = (a.cut(b), a.around(b));
        assert!(
            common.is_empty() == b.cut(a).is_empty()
                && (a.is_empty() || b.is_empty() || holds(a, common) && holds(b, common))
        );
        assert!(holds(both, a) && holds(both, b) && volume(both) >= volume(a).max(volume(b)));
        assert_eq!(a.cut(a), a);
        let parts = a.without(b);
        let taken = if a.is_empty() || b.is_empty() {
            0
        } else {
            volume(common)
        };
        assert_eq!(
            parts.iter().map(|part| volume(*part)).sum::<i128>(),
            volume(a) - taken,
            "{a:?} without {b:?}: {parts:?}"
        );
        assert!(
            parts.len() <= 6
                && parts.iter().all(|part| !part.is_empty()
                    && holds(a, *part)
                    && (b.is_empty() || part.cut(b).is_empty())),
            "{parts:?}"
        );
        for (index, part) in parts.iter().enumerate() {
            assert!(
                parts[..index]
                    .iter()
                    .all(|other| part.cut(*other).is_empty()),
                "{a:?} without {b:?}: {parts:?}"
            );
        }
        if !a.is_empty() {
            let coarse = a.coarser();
            assert!(
                holds(
                    coarse,
                    VoxelBox {
                        low: a.low >> 1,
                        end: ((a.end - 1) >> 1) + 1
                    }
                ) && volume(coarse) <= volume(a),
                "{a:?}: {coarse:?}"
            );
            let back = VoxelBox {
                low: coarse.low * 2,
                end: coarse.end * 2,
            };
            assert!(
                holds(back, a) && (back.size() - a.size()).cmple(IVec3::splat(2)).all(),
                "{a:?}: {coarse:?}"
            );
        }
    });
}

#[test]
fn clipmap_levels_are_nested_around_any_bounds_and_eye() {
    let eye = [coordinate(), coordinate(), coordinate()];
    let voxel_size =
        prop_oneof![2 => Just(0.0f32), 3 => 0.001f32..2.0, 1 => select(&[1e-6f32, 1e6][..])];
    check(
        10_000,
        &(
            bounds(),
            eye,
            select(&[16u32, 32, 64, 128, 256][..]),
            1u32..=7,
            voxel_size,
        ),
        |(bounds, eye, resolution, levels, voxel_size)| {
            let layout = Layout::new(bounds, resolution, levels, voxel_size);
            assert!(
                (1..=levels).contains(&layout.levels)
                    && layout.voxel_size.is_normal()
                    && layout.anchor.is_finite(),
                "{layout:?}"
            );
            let widest = (bounds.1 - bounds.0).max_element();
            assert!(
                voxel_size == 0.0
                    || layout.voxel_size == voxel_size
                    || (layout.voxel_size > voxel_size && widest > 1e6 * voxel_size),
                "{layout:?}"
            );
            let (eye, edge) = (Vec3::from(eye), resolution as i32);
            let places = layout.places(eye);
            assert_eq!(places.len(), layout.levels as usize);
            for (level, place) in places.iter().enumerate() {
                assert_eq!(
                    place.first.rem_euclid(IVec3::splat(4)),
                    IVec3::ZERO,
                    "{layout:?} {eye} level {level}"
                );
                let Some(outer) = places.get(level + 1) else {
                    continue;
                };
                let inside = layout.extent(place.first);
                assert!(
                    holds(VoxelBox::cube(outer.first, resolution), inside),
                    "{layout:?} {eye}: level {level} lies inside the next: {places:?}"
                );
                let region = layout.inner(*place).region();
                assert!(
                    !region.is_empty() && holds(inside, region),
                    "{layout:?} {eye} level {level}: {region:?} of {inside:?}"
                );
            }
            let outermost = places[layout.levels as usize - 1].first;
            assert_eq!(
                outermost.rem_euclid(IVec3::splat(4.max(1 << layout.top_mips()))),
                IVec3::ZERO,
                "{layout:?} {eye}: {outermost}"
            );
            assert_eq!(
                layout.stays_lit(outermost, outermost),
                VoxelBox::cube(outermost, resolution)
            );
            assert!(layout.stays_lit(outermost, outermost + edge).is_empty());
        },
    );
}
