//! Scenes: loading, bundled scenes, writing and loading again.

use crate::support::loading::{check_invariants, corners, load, round_trip};
use crate::support::{Missing, skipped};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use glam::{DVec2, Vec3};
use lumivox::render::bvh::oracle::RayOracle;
use lumivox::render::oracle::View;
use lumivox::scene::{Light, LoadOptions, Scene, Texture, TextureKind, bundled};

/// The folder of real scenes that are not part of the project: `LUMIVOX_SCENES`, else
/// `../shared/scenes`; `None`, said on stderr, where it is absent.
fn real_scenes() -> Option<PathBuf> {
    let folder = std::env::var_os("LUMIVOX_SCENES").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes"),
        PathBuf::from,
    );
    if !folder.is_dir() {
        skipped(&Missing::Other("no real scenes (LUMIVOX_SCENES)"));
        return None;
    }
    Some(folder)
}

/// Loads `scene.obj` with `scene.mtl` from their texts.
fn load_obj(folder: &Path, obj: &str, mtl: &str) -> Scene {
    std::fs::write(folder.join("scene.obj"), obj).unwrap();
    std::fs::write(folder.join("scene.mtl"), mtl).unwrap();
    load(&folder.join("scene.obj"))
}

/// All bundled scenes, made once: the largest takes seconds.
fn every_bundled() -> &'static [Scene] {
    static SCENES: OnceLock<Vec<Scene>> = OnceLock::new();
    SCENES.get_or_init(|| {
        bundled::TABLE
            .iter()
            .map(|row| Scene::bundled(row.name, &[]).unwrap())
            .collect()
    })
}

#[test]
fn real_scenes_have_their_published_triangle_counts() {
    let Some(folder) = real_scenes() else { return };
    // Published count of triangles, and the number of them without area.
    let expected = [
        ("cornell_point", 30, 0),
        ("sponza_sun", 261_839, 0),
        ("sponza_noplants_sun", 226_899, 0),
        ("sponza_dragon", 292_405, 4),
        ("sponza_dabrovic", 66_450, 6),
        ("leak_door_200mm", 40, 0),
        ("bunny_box", 69_451, 0),
        ("dragon_box", 65_506, 4),
    ];
    for (name, published, without_area) in expected {
        let scene = load(&folder.join(format!("{name}.toml")));
        assert_eq!(scene.triangles.len(), published - without_area, "{name}");
        check_invariants(&scene);
    }
}

#[test]
fn a_real_scene_of_two_models_survives_writing_and_loading() {
    let Some(folder) = real_scenes() else { return };
    let scene = load(&folder.join("sponza_dragon.toml"));
    assert_eq!(
        scene
            .models
            .iter()
            .map(|model| model.dynamic)
            .collect::<Vec<_>>(),
        [false, true]
    );
    round_trip(&scene);
}

/// A scene of one triangle, alone or as a TOML places it.
fn triangle(corners: [[f32; 3]; 3], toml: Option<&str>) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    let lines = corners.map(|[x, y, z]| format!("v {x} {y} {z}\n")).concat();
    std::fs::write(folder.path().join("scene.obj"), lines + "f 1 2 3\n").unwrap();
    let Some(toml) = toml else {
        return Scene::load(&folder.path().join("scene.obj"), &LoadOptions::default())
            .map_err(|error| error.to_string());
    };
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, format!("[[model]]\npath = 'scene.obj'\n{toml}")).unwrap();
    Scene::load(&path, &LoadOptions::default()).map_err(|error| error.to_string())
}

/// The invariants hold however small the scene is and however far away, and it survives writing.
#[test]
fn scenes_without_a_camera_get_one_that_looks_somewhere() {
    for at in [0.0f32, 1.0, -1000.0, 1e6, 9e8] {
        for size in [1e-9f32, 1e-3, 1.0, 1e7] {
            let far = if at + size == at {
                at * (1.0 + 2.0 * f32::EPSILON)
            } else {
                at + size
            };
            let scene = triangle([[at, at, at], [far, at, at], [at, far, at]], None).unwrap();
            check_invariants(&scene);
            round_trip(&scene);
        }
    }
}

#[test]
fn vertices_stay_within_reach() {
    let unit = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    for (corners, toml) in [
        ([[0.0, 0.0, 0.0], [2e9, 0.0, 0.0], [0.0, 1.0, 0.0]], None),
        (unit, Some("scale = 1e6\ntranslate = [1e9, 0, 0]\n")),
    ] {
        let message = triangle(corners, toml).unwrap_err();
        assert!(
            message.contains("scene.obj") && message.contains("1000000000.0 m from the origin"),
            "{message}"
        );
    }
    let [model, scale] = [[[0.0, 0.0, 0.0], [1e14, 0.0, 0.0], [0.0, 1e14, 0.0]], unit];
    assert!(
        triangle(model, Some("scale = 1e-6\n")).is_ok()
            && triangle(scale, Some("scale = 1e6\n")).is_ok()
    );
}

/// Far from the origin the corners of a small triangle are one point.
#[test]
fn triangles_that_collapse_where_they_are_placed_are_dropped() {
    let unit = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let message = triangle(unit, Some("translate = [1e9, 1e9, 0]\n")).unwrap_err();
    assert!(message.contains("no area"), "{message}");
    check_invariants(&triangle(unit, Some("translate = [1e7, 1e7, 0]\n")).unwrap());
}

/// What is no file may have no end.
#[test]
fn folders_and_devices_are_no_files() {
    let folder = tempfile::tempdir().unwrap();
    let good = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let message = |path: &Path| {
        Scene::load(path, &LoadOptions::default())
            .unwrap_err()
            .to_string()
    };
    let [obj, toml] = ["scene.obj", "scene.toml"].map(|name| folder.path().join(name));
    for name in [".", "..", "/dev/zero"] {
        std::fs::write(&obj, format!("{good}mtllib {name}\n")).unwrap();
        assert!(message(&obj).contains("scene.obj:5"), "{}", message(&obj));
        std::fs::write(&obj, good).unwrap();
        std::fs::write(&toml, format!("[[model]]\npath = '{name}'\n")).unwrap();
        assert!(
            message(&toml).contains("scene.toml:2"),
            "{}",
            message(&toml)
        );
        std::fs::write(&obj, format!("mtllib scene.mtl\nusemtl a\n{good}")).unwrap();
        std::fs::write(
            folder.path().join("scene.mtl"),
            format!("newmtl a\nmap_Kd {name}\n"),
        )
        .unwrap();
        assert!(message(&obj).contains("scene.mtl:2"), "{}", message(&obj));
    }
}

#[test]
fn bundled_scenes_survive_writing_and_loading() {
    every_bundled().iter().for_each(round_trip);
}

/// Names that no file can have: as long as the file system takes, of more than one byte a letter,
/// and equal where they are cut.
#[test]
fn scenes_with_endless_names_survive_writing_and_loading() {
    let mut scene = Scene::bundled("furnace", &[]).unwrap();
    scene.name = "s".repeat(300);
    scene.models[0].name = "m".repeat(240);
    for letter in ["a", "é", "字"] {
        for _ in 0..2 {
            let (name, texels) = (format!("{}.png", letter.repeat(300)), vec![[1, 2, 3, 255]]);
            let (kind, width, height) = (TextureKind::Color, 1, 1);
            scene.textures.push(
                Texture {
                    name,
                    kind,
                    width,
                    height,
                    texels,
                }
                .into(),
            );
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = scene.write(folder.path()).unwrap();
    assert_eq!(path.file_name().unwrap().len(), 245);
    let textures = std::fs::read_dir(folder.path().join("textures")).unwrap();
    let mut lengths: Vec<_> = textures
        .map(|file| file.unwrap().file_name().len())
        .collect();
    lengths.sort_unstable();
    assert_eq!(lengths, [244, 244, 244, 246, 246, 246]);
}

#[test]
fn every_kind_of_light_survives_writing_and_loading() {
    let mut scene = Scene::bundled("furnace", &[]).unwrap();
    scene.environment = Vec3::new(0.1, 1.0 / 3.0, 1e-7).into();
    let direction = Vec3::new(0.3, -0.7, 0.1).normalize();
    scene.lights = vec![
        Light::Directional {
            direction,
            irradiance: Vec3::new(1.0, 0.1, 1e9),
        },
        Light::Point {
            position: Vec3::new(-0.1, 1e-5, 7.0),
            intensity: Vec3::splat(std::f32::consts::PI),
        },
        Light::Spot {
            position: Vec3::ZERO,
            direction,
            intensity: Vec3::ONE,
            inner_deg: 12.3,
            outer_deg: 45.6,
        },
    ];
    round_trip(&scene);
}

#[test]
fn bundled_scenes_keep_the_invariants_and_are_lit() {
    for scene in every_bundled() {
        check_invariants(scene);
        assert!(scene.is_lit(), "{}", scene.name);
    }
}

#[test]
fn shading_normals_of_bundled_scenes_lie_on_the_front_side() {
    for scene in every_bundled() {
        for (index, triangle) in scene.triangles.iter().enumerate() {
            let [a, b, c] = corners(scene, index);
            let front = (b - a).cross(c - a).normalize();
            let agrees = triangle
                .vertices
                .iter()
                .all(|vertex| front.dot(Vec3::from(scene.vertices[*vertex as usize].normal)) > 0.2);
            let material = &scene.materials[triangle.material as usize].name;
            assert!(
                agrees,
                "{}: triangle {index} of {material} at {a}",
                scene.name
            );
        }
    }
}

/// Whether every edge is shared by exactly two triangles that run along it in opposite directions.
fn is_watertight(scene: &Scene) -> bool {
    let mut balance: HashMap<[[u32; 3]; 2], (u32, u32)> = HashMap::new();
    for index in 0..scene.triangles.len() {
        let keys = corners(scene, index).map(|corner| corner.to_array().map(f32::to_bits));
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (keys[from], keys[to]);
            let count = balance.entry([a.min(b), a.max(b)]).or_default();
            if a < b { count.0 += 1 } else { count.1 += 1 }
        }
    }
    balance.values().all(|count| *count == (1, 1))
}

/// Volume by the divergence theorem; negative where the front looks inwards.
fn signed_volume(scene: &Scene) -> f64 {
    (0..scene.triangles.len())
        .map(|index| corners(scene, index).map(|corner| corner.as_dvec3()))
        .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
        .sum()
}

#[test]
fn closed_scenes_are_watertight_and_face_inwards() {
    let blocks = 0.6 * 0.6 * (1.2 + 0.6);
    let sphere = 4.0 / 3.0 * std::f64::consts::PI;
    let expected = [
        ("cornell", vec![], -8.0 + blocks, 1e-6),
        ("cornell-lamp", vec![], -8.0 + blocks, 1e-6),
        ("furnace", vec![], -8.0, 0.0),
        ("lit-sphere", vec![], -sphere, 0.01),
        ("two-rooms", vec![("door", 0.0)], -96.0, 1e-4),
        (
            "two-rooms",
            vec![("door", 1.0), ("thickness_m", 0.5)],
            -97.0,
            1e-4,
        ),
    ];
    for (name, parameters, volume, tolerance) in expected {
        let parameters: Vec<_> = parameters
            .into_iter()
            .map(|(key, value): (&str, f64)| (key.to_owned(), value))
            .collect();
        let scene = Scene::bundled(name, &parameters).unwrap();
        assert!(is_watertight(&scene), "{name} {parameters:?}");
        assert!(
            (signed_volume(&scene) - volume).abs() <= tolerance,
            "{name} {parameters:?}: {}",
            signed_volume(&scene)
        );
    }
    assert!(
        !is_watertight(&Scene::bundled("glossy", &[]).unwrap()),
        "the check can fail"
    );
}

#[test]
fn bundled_parameters_take_effect() {
    let furnace = Scene::open(
        "bundled:furnace,albedo=0.25,emission=3",
        &LoadOptions::default(),
    )
    .unwrap();
    assert_eq!(
        (furnace.materials[0].albedo, furnace.materials[0].emission),
        (Vec3::splat(0.25), Vec3::splat(3.0))
    );
    let rooms = Scene::open(
        "bundled:two-rooms,thickness_m=0.01,door=true",
        &LoadOptions::default(),
    )
    .unwrap();
    assert!(
        rooms
            .vertices
            .iter()
            .any(|vertex| vertex.position[0] == 0.005)
    );
}

#[test]
fn the_atrium_is_large_and_varied() {
    let scene = every_bundled()
        .iter()
        .find(|scene| scene.name == "atrium")
        .unwrap();
    assert!(scene.triangles.len() >= 60_000, "{}", scene.triangles.len());
    assert!(scene.materials.len() >= 10 && scene.textures.len() >= 10);
    assert!(
        scene
            .materials
            .iter()
            .any(|material| material.mask_texture.is_some())
    );
    assert!(scene.is_glossy() && !scene.is_emissive());
}

/// Walls of these scenes are thinner than a voxel at 128³, and so are the bars of their railings.
#[test]
fn thin_scenes_are_thinner_than_voxels() {
    for name in ["stairwell", "pergola"] {
        let find = |scene: &&Scene| scene.name == name;
        let scene = every_bundled().iter().find(find).unwrap();
        let (low, high) = scene.bounds().unwrap();
        let voxel_m = (high - low).max_element() * (1.0 / 128.0);
        // Each board has six faces of two triangles, its shortest edge is how thick it is.
        let is_thin = |index: &usize| {
            let [a, b, c] = corners(scene, *index);
            let edges = [a.distance(b), b.distance(c), c.distance(a)];
            edges.into_iter().any(|edge| edge < 0.5 * voxel_m)
        };
        let thin = (0..scene.triangles.len()).filter(is_thin).count();
        assert!(thin >= 900, "{name}: {thin} of {}", scene.triangles.len());
        let is_masked = |material: &lumivox::scene::Material| material.mask_texture.is_some();
        assert!(scene.materials.iter().any(is_masked), "{name}");
        assert!(!scene.is_emissive() && !scene.lights.is_empty(), "{name}");
    }
    let thick = Scene::open("bundled:stairwell,wall_m=0.2", &LoadOptions::default()).unwrap();
    let (low, high) = thick.bounds().unwrap();
    assert_eq!((high - low).x, 6.4);
}

/// Of two surfaces in one plane it is chance which is seen, and each way to see has its own.
#[test]
fn no_two_materials_are_seen_in_one_place() {
    for scene in every_bundled() {
        let (rays, [width, height]) = (RayOracle::new(scene), [96, 54]);
        let view = View::of_camera(&scene.camera, [width, height], 0.01);
        let material = |triangle: u32| scene.triangles[triangle as usize].material;
        let is_doubled = |pixel: &u32| {
            let at_px = DVec2::new(f64::from(pixel % width), f64::from(pixel / width)) + 0.5;
            let (origin, direction) = view.ray(at_px);
            let (origin, direction) = (origin.as_vec3(), direction.normalize().as_vec3());
            let Some(first) = rays.closest((origin, direction, None)) else {
                return false;
            };
            let second = rays.closest((origin, direction, Some(first.triangle)));
            second.is_some_and(|second| {
                (second.distance - first.distance).abs() < 1e-5 * first.distance
                    && material(second.triangle) != material(first.triangle)
            })
        };
        let doubled = (0..width * height).filter(is_doubled).count();
        println!("{}: two materials at {doubled} pixels", scene.name);
        // Where edges meet along a row or a column of pixels.
        assert!(doubled <= 60, "{}: {doubled}", scene.name);
    }
}

#[test]
fn another_parser_reads_the_same_triangles() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene::bundled("emissive-gallery", &[]).unwrap();
    scene.write(folder.path()).unwrap();
    let (models, materials) = tobj::load_obj(
        folder.path().join("emissive-gallery.obj"),
        &tobj::GPU_LOAD_OPTIONS,
    )
    .unwrap();
    assert_eq!(materials.unwrap().len(), scene.materials.len());
    let mut index = 0;
    for model in &models {
        for triangle in model.mesh.indices.chunks(3) {
            let position =
                |vertex: u32| Vec3::from_slice(&model.mesh.positions[3 * vertex as usize..]);
            assert_eq!(
                [0, 1, 2].map(|corner| position(triangle[corner])),
                corners(&scene, index)
            );
            assert_eq!(
                model.mesh.material_id,
                Some(scene.triangles[index].material as usize)
            );
            index += 1;
        }
    }
    assert_eq!(index, scene.triangles.len());
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn polygons_negative_indices_and_missing_normals() {
    let folder = tempfile::tempdir().unwrap();
    let scene = load_obj(
        folder.path(),
        &format!("{SQUARE}# a comment\nf -4 -3 -2 -1 # five\nf 1 2 2\n"),
        "",
    );
    assert_eq!(
        scene.triangles.len(),
        2,
        "a quad is two triangles, a triangle without area is dropped"
    );
    assert!(
        scene
            .vertices
            .iter()
            .all(|vertex| vertex.normal == [0.0, 0.0, 1.0] && [vertex.u, vertex.v] == [0.0, 0.0])
    );
    assert_eq!(scene.materials[0].name, "default");
    assert_eq!(scene.lights.len(), 1, "an OBJ alone gets a light");
    assert!(scene.camera.eye.is_finite() && scene.camera.eye != scene.camera.target);
}

#[test]
fn corners_share_a_vertex_only_where_all_three_indices_agree() {
    let folder = tempfile::tempdir().unwrap();
    let obj =
        format!("{SQUARE}vt 0 0\nvt 1 0\nvn 0 0 2\nf 1/1/1 2/2/1 3/2/1\nf 1/2/1 3/2/1 4/1/1\n");
    let scene = load_obj(folder.path(), &obj, "");
    assert_eq!(scene.vertices.len(), 5);
    assert!(
        scene
            .vertices
            .iter()
            .all(|vertex| vertex.normal == [0.0, 0.0, 1.0]),
        "normals get unit length"
    );
}

#[test]
fn models_are_scaled_then_rotated_then_moved() {
    let folder = tempfile::tempdir().unwrap();
    load_obj(folder.path(), &format!("{SQUARE}f 1 2 3 4\n"), "");
    let toml = "[[model]]\npath = 'SCENE.OBJ'\nscale = 2\nrotate_deg = [90, 0, 0]\ntranslate = \
                [0, 0, 5]\ndynamic = true\n[environment]\nradiance = [1, 1, 1]";
    std::fs::write(folder.path().join("s.toml"), toml).unwrap();
    let scene = load(&folder.path().join("s.toml"));
    let (low, high) = scene.bounds().unwrap();
    assert!(
        low.distance(Vec3::new(0.0, 0.0, 5.0)) < 1e-6
            && high.distance(Vec3::new(2.0, 0.0, 7.0)) < 1e-6,
        "{low} {high}"
    );
    assert!(Vec3::from(scene.vertices[0].normal).distance(Vec3::NEG_Y) < 1e-6);
    assert!(scene.models[0].dynamic && scene.models[0].name == "scene");
}

/// A keyframe has what it does not say from its model; the scale is the model's.
#[test]
fn models_move_by_keyframes() {
    let folder = tempfile::tempdir().unwrap();
    load_obj(folder.path(), &format!("{SQUARE}f 1 2 3 4\n"), "");
    std::fs::write(
        folder.path().join("mover.obj"),
        format!("{SQUARE}f 1 2 3 4\n"),
    )
    .unwrap();
    let still = "[[model]]\npath = 'scene.obj'\n";
    let moving = "[[model]]\npath = 'mover.obj'\nscale = 2\ntranslate = [0, 0, 5]\ndynamic = \
                  true\n[[model.keyframe]]\ntime_s = 1\n[[model.keyframe]]\ntime_s = \
                  2\nrotate_deg = [90, 0, 0]\ntranslate = [4, 0, 5]\n[environment]\nradiance = \
                  [1, 1, 1]";
    std::fs::write(folder.path().join("s.toml"), format!("{still}{moving}")).unwrap();
    let mut scene = load(&folder.path().join("s.toml"));
    assert!(scene.moves() && !scene.models[0].dynamic && scene.models[1].dynamic);
    let static_bounds = (Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0));
    let at = |scene: &Scene| {
        [
            corners(scene, 2)[0],
            scene.bounds().unwrap().0,
            scene.bounds().unwrap().1,
        ]
    };
    let near =
        |a: [Vec3; 3], b: [[f32; 3]; 3]| a.iter().zip(b).all(|(a, b)| a.distance(b.into()) < 1e-5);
    assert!(
        near(at(&scene), [[0.0, 0.0, 5.0], [0.0; 3], [2.0, 2.0, 5.0]]),
        "before the first keyframe: {:?}",
        at(&scene)
    );
    round_trip(&scene);
    let at_start = scene.clone();
    scene.set_time(3.0);
    assert!(
        near(at(&scene), [[4.0, 0.0, 5.0], [0.0; 3], [6.0, 1.0, 7.0]]),
        "after the last: {:?}",
        at(&scene)
    );
    assert!(Vec3::from(scene.vertices[7].normal).distance(Vec3::NEG_Y) < 1e-6);
    scene.set_time(1.5);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    assert!(
        near(
            at(&scene),
            [
                [2.0, 0.0, 5.0],
                [0.0; 3],
                [4.0, 2.0 * half, 5.0 + 2.0 * half]
            ]
        ),
        "between: {:?}",
        at(&scene)
    );
    assert_eq!(scene.static_bounds(), Some(static_bounds));
    let (low, high) = scene.dynamic_bounds().unwrap();
    assert!(
        low.cmple(Vec3::new(0.0, 0.0, 5.0)).all() && high.cmpge(Vec3::new(6.0, 2.0, 7.0)).all()
    );
    scene.set_time(0.0);
    assert_eq!(scene, at_start);
    // It is written as it is, whatever the time.
    scene.set_time(1.5);
    let again = load(&scene.write(folder.path().join("again").as_path()).unwrap());
    assert_eq!(
        Scene {
            name: again.name.clone(),
            files: again.files.clone(),
            ..at_start
        },
        again
    );
}

#[test]
fn extents_from_a_tenth_of_a_millimetre_to_a_hundred_kilometres() {
    let folder = tempfile::tempdir().unwrap();
    for scale in ["1e-4", "1e5"] {
        let obj = format!("{SQUARE}f 1 2 3 4\n").replace(" 1", &format!(" {scale}"));
        let scene = load_obj(
            folder.path(),
            &obj.replace(&format!("f {scale}"), "f 1"),
            "",
        );
        assert_eq!(scene.triangles.len(), 2, "{scale}");
        check_invariants(&scene);
    }
}

#[test]
fn specular_needs_a_roughness() {
    let folder = tempfile::tempdir().unwrap();
    let lobe = |lines: &str| {
        let obj = format!("mtllib scene.mtl\nusemtl m\n{SQUARE}f 1 2 3\n");
        load_obj(
            folder.path(),
            &obj,
            &format!("newmtl m\nKd 0.2 0.3 0.4\n{lines}\n"),
        )
        .materials[0]
            .specular
    };
    assert_eq!(lobe("Ks 0.5 0.5 0.5"), None);
    assert_eq!(lobe("Ns 10"), None);
    assert_eq!(lobe("Ks 0 0 0\nNs 10\nPr 0.5"), None);
    let from_ns = lobe("Ks 0.5 0.4 0.3\nNs 6").unwrap();
    assert_eq!(
        (from_ns.f0, from_ns.metalness),
        (Vec3::new(0.5, 0.4, 0.3), 0.0)
    );
    assert!(
        (from_ns.roughness.powi(2) - 0.5).abs() < 1e-6,
        "α = √(2 / (6 + 2)) = 0.5"
    );
    assert_eq!(lobe("Ks 0.5\nNs 6\nPr 0.25").unwrap().roughness, 0.25);
    assert_eq!(lobe("Pr 0.25").unwrap().f0, Vec3::splat(0.04));
    assert_eq!(lobe("Ks 0\nPr 0.1\nPm 1").unwrap().metalness, 1.0);
}

#[test]
fn materials_of_nothing_are_removed_and_unknown_ones_are_grey() {
    let folder = tempfile::tempdir().unwrap();
    let obj =
        format!("mtllib scene.mtl\n{SQUARE}usemtl glass #1\nf 1 2 3\nusemtl nowhere\nf 1 3 4\n");
    let scene = load_obj(folder.path(), &obj, "newmtl glass #1\nd 0\nNi 1.45\n");
    assert_eq!(scene.triangles.len(), 1);
    assert_eq!(
        (scene.materials[0].name.as_str(), scene.materials[0].albedo),
        ("nowhere", Vec3::splat(0.5))
    );
}

/// `d`, `Tr`, `Tf`, `Ni` and `illum` say what is clear of a surface; a mask says it alone.
#[test]
fn clear_materials_are_sheets_or_bodies() {
    let folder = tempfile::tempdir().unwrap();
    let clear = |lines: &str| {
        let obj = format!("mtllib scene.mtl\n{SQUARE}usemtl m\nf 1 2 3\n");
        let scene = load_obj(folder.path(), &obj, &format!("newmtl m\n{lines}\n"));
        let one = scene.materials[0].transmission?;
        let again = tempfile::tempdir().unwrap();
        let written = load(&scene.write(again.path()).unwrap());
        assert_eq!(written.materials[0].transmission, Some(one));
        Some((one.share, one.filter.to_array(), one.index))
    };
    assert_eq!(clear("d 1\nNi 1.5\nTf 0.5\nillum 7"), None);
    assert_eq!(clear("d 0.25"), Some((0.75, [1.0; 3], 1.0)));
    assert_eq!(
        clear("Tr 0.5\nNi 1.45\nTf 1 0.5 0\nillum 4"),
        Some((0.5, [1.0, 0.5, 0.0], 1.0))
    );
    for illum in [6, 7] {
        assert_eq!(
            clear(&format!("d 0\nNi 1.45\nillum {illum}")),
            Some((1.0, [1.0; 3], 1.45))
        );
    }
    let text = |lines: &str| format!("newmtl m\n{lines}\n");
    for (lines, named) in [("Ni 20", "Ni"), ("Tf 2 0 0", "Tf"), ("illum x", "illum")] {
        std::fs::write(folder.path().join("scene.mtl"), text(lines)).unwrap();
        let file = folder.path().join("scene.obj");
        let error = Scene::open(&file, &LoadOptions::default())
            .unwrap_err()
            .to_string();
        assert!(
            error.contains(named) && error.contains("scene.mtl:2"),
            "{error}"
        );
    }
}

/// A square with the material lines given.
fn with_maps(folder: &Path, maps: &str) -> Scene {
    load_obj(
        folder,
        &format!("mtllib scene.mtl\n{SQUARE}vt 0 0\nusemtl m\nf 1/1 2/1 3/1\n"),
        &format!("newmtl m\n{maps}\n"),
    )
}

#[test]
fn pictures_of_all_kinds_become_rgba_of_8_bits() {
    let folder = tempfile::tempdir().unwrap();
    let save =
        |name: &str, picture: image::DynamicImage| picture.save(folder.path().join(name)).unwrap();
    save(
        "grey.png",
        image::GrayImage::from_pixel(2, 3, image::Luma([77])).into(),
    );
    save(
        "grey16.png",
        image::ImageBuffer::from_pixel(2, 3, image::Luma([77_u16 * 257])).into(),
    );
    save(
        "rgb.bmp",
        image::RgbImage::from_pixel(2, 3, image::Rgb([77; 3])).into(),
    );
    save(
        "rgba16.png",
        image::ImageBuffer::from_pixel(
            2,
            3,
            image::Rgba([77_u16 * 257, 77 * 257, 77 * 257, 65_535]),
        )
        .into(),
    );
    save(
        "rgb.tga",
        image::RgbImage::from_pixel(2, 3, image::Rgb([77; 3])).into(),
    );
    for name in ["grey.png", "grey16.png", "rgb.bmp", "rgba16.png", "rgb.tga"] {
        let texture = &with_maps(folder.path(), &format!("map_Kd {name}")).textures[0];
        assert_eq!(
            (texture.width, texture.height, texture.kind),
            (2, 3, TextureKind::Color),
            "{name}"
        );
        assert!(
            texture
                .texels
                .iter()
                .all(|texel| *texel == [77, 77, 77, 255]),
            "{name}: {:?}",
            texture.texels[0]
        );
    }
}

#[test]
fn masks_bumps_and_paths_of_other_systems() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("Maps")).unwrap();
    let alpha = image::RgbaImage::from_fn(2, 1, |x, _| {
        image::Rgba([200, 200, 200, if x == 0 { 0 } else { 255 }])
    });
    alpha.save(folder.path().join("Maps/Leaf One.png")).unwrap();
    let scene = with_maps(
        folder.path(),
        "map_Kd -s 2 2 2 maps\\leaf one.PNG\nmap_d maps/leaf one.png\nmap_Bump -bm 0.5 maps\\leaf \
         one.png",
    );
    let material = &scene.materials[0];
    assert_eq!(
        (
            material.albedo_texture,
            material.mask_texture,
            material.normal_texture
        ),
        (Some(0), Some(1), Some(2))
    );
    assert_eq!(
        material.albedo,
        Vec3::ONE,
        "Kd is 1 where only map_Kd is given"
    );
    assert_eq!(
        scene.textures[1].texels,
        [[0, 0, 0, 255], [255, 255, 255, 255]],
        "the mask is the alpha channel"
    );
    assert_eq!(
        scene.textures[2].texels,
        [[128, 128, 255, 255]; 2],
        "even heights are flat"
    );
}

#[test]
fn alpha_of_a_colour_map_alone_masks_nothing() {
    let folder = tempfile::tempdir().unwrap();
    image::RgbaImage::from_fn(2, 1, |x, _| image::Rgba([9, 9, 9, 255 * x as u8]))
        .save(folder.path().join("a.png"))
        .unwrap();
    assert_eq!(
        with_maps(folder.path(), "map_Kd a.png").materials[0].mask_texture,
        None
    );
}

#[test]
fn missing_textures_are_mid_grey_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let obj = format!("mtllib scene.mtl\n{SQUARE}usemtl m\nf 1 2 3\n");
    std::fs::write(folder.path().join("scene.obj"), obj).unwrap();
    std::fs::write(
        folder.path().join("scene.mtl"),
        "newmtl m\nmap_Kd gone.png\nmap_d gone too.png\n",
    )
    .unwrap();
    let scene = Scene::load(
        &folder.path().join("scene.obj"),
        &LoadOptions {
            allow_missing_textures: true,
            ..LoadOptions::default()
        },
    )
    .unwrap();
    assert!((scene.textures[0].texel(0, 0).x - 0.5).abs() < 0.005);
    assert_eq!(scene.textures[1].texel(0, 0).x, 1.0);
}

/// Area of the triangles, each counted as it faces `towards` [m²]; the most that is turned away.
fn facing_area(scene: &Scene, towards: Vec3) -> (f32, f32) {
    let area = |triangle| {
        let [a, b, c] = corners(scene, triangle);
        0.5 * (b - a).cross(c - a).dot(towards)
    };
    (0..scene.triangles.len())
        .map(area)
        .fold((0.0, 0.0), |(sum, least): (f32, f32), area| {
            (sum + area, least.min(area))
        })
}

/// An L in the wall x = 1, from every first corner: three squares and nothing outside, each corner
/// with its own texture coordinate.
#[test]
fn concave_faces_are_covered_once() {
    let folder = tempfile::tempdir().unwrap();
    let outline = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)];
    let head: String = outline
        .iter()
        .map(|(y, z)| format!("v 1 {y} {z}\nvt {y} {z}\n"))
        .collect();
    for first in 0..6 {
        let order = (0..6)
            .map(|i| 1 + (first + i) % 6)
            .map(|i| format!(" {i}/{i}"))
            .collect::<String>();
        let scene = load_obj(folder.path(), &format!("{head}f{order}\n"), "");
        assert_eq!(scene.triangles.len(), 4);
        let (area, turned) = facing_area(&scene, Vec3::X);
        assert!(
            (area - 3.0).abs() < 1e-5 && turned >= 0.0,
            "from corner {first}: area {area}, turned {turned}"
        );
        assert!(
            scene
                .vertices
                .iter()
                .all(|vertex| [vertex.u, vertex.v] == vertex.position[1..]),
            "texture coordinates are mixed up"
        );
    }
}

/// A face that winds back on itself, one without area beside a good one, and one that crosses
/// itself: what can be covered is.
#[test]
fn degenerate_faces_leave_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let points = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 0 2 0\nv 2 2 0\nv 0 1 0\n";
    let scene = load_obj(
        folder.path(),
        &format!("{points}f 1 2 3 4\nf 1 3 6 5\n"),
        "",
    );
    assert_eq!(facing_area(&scene, Vec3::Z), (4.0, 0.0));
    let scene = load_obj(folder.path(), &format!("{points}f 1 1 2 3 3 6 6 5 5\n"), "");
    assert_eq!(facing_area(&scene, Vec3::Z), (4.0, 0.0));
    let crossing = load_obj(folder.path(), &format!("{points}f 1 6 3 7\n"), "");
    assert!(!crossing.triangles.is_empty());
}

/// The first texture coordinates of a triangle whose material has these lines.
fn texcoord_with(lines: &str) -> [f32; 2] {
    let folder = tempfile::tempdir().unwrap();
    image::RgbImage::new(2, 2)
        .save(folder.path().join("a.png"))
        .unwrap();
    let obj = "mtllib scene.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5 0.25\nf 1/1 2/1 3/1\n";
    let scene = load_obj(folder.path(), obj, &format!("newmtl m\n{lines}\n"));
    [scene.vertices[0].u, scene.vertices[0].v]
}

#[test]
fn maps_are_scaled_and_moved_by_their_options() {
    assert_eq!(texcoord_with("map_Kd a.png"), [0.5, 0.25]);
    assert_eq!(texcoord_with("map_Kd -s 4 2 1 a.png"), [2.0, 0.5]);
    assert_eq!(texcoord_with("map_Kd -o 1 2 a.png"), [1.5, 2.25]);
    assert_eq!(
        texcoord_with("map_Kd -o 1 -s 2 2 2 -clamp on a.png"),
        [2.0, 0.5]
    );
    // The first map's stand for all.
    assert_eq!(
        texcoord_with("map_d a.png\nmap_Kd -s 4 4 a.png"),
        [2.0, 1.0]
    );
}

#[test]
fn values_of_maps_get_base_and_gain() {
    let folder = tempfile::tempdir().unwrap();
    image::RgbImage::from_pixel(1, 1, image::Rgb([128, 128, 128]))
        .save(folder.path().join("a.png"))
        .unwrap();
    let texel = |lines: &str| with_maps(folder.path(), lines).textures[0].texels[0][0];
    assert_eq!(texel("map_Kd a.png"), 128);
    assert_eq!(texel("map_Kd -mm 0 0 a.png"), 0);
    assert_eq!(texel("map_Kd -mm 1 0 a.png"), 255);
    // Linear 0.216 twice is 0.432, which is 176 as sRGB.
    assert_eq!(texel("map_Kd -mm 0 2 a.png"), 176);
    assert_eq!(texel("map_d -mm 0 0.5 a.png"), 64);
}

/// A byte order mark, lines that go on, and a backslash at the end of a comment.
#[test]
fn marks_and_continued_lines() {
    let folder = tempfile::tempdir().unwrap();
    let obj = "\u{feff}mtllib \\\nscene.mtl\nusemtl m\nv 0 0 \\\n0\nv 1 0 0\n# C:\\models\\\n\
               v 0 1 0\nf 1 \\\n 2 \\\r\n 3\n";
    let scene = load_obj(folder.path(), obj, "\u{feff}newmtl m\nKd 0.1 \\\n0.2 0.3\n");
    assert_eq!(scene.triangles.len(), 1);
    assert_eq!(scene.materials[0].albedo, Vec3::new(0.1, 0.2, 0.3));
    let path = folder.path().join("scene.obj");
    std::fs::write(&path, "v 0 0 \\\n0\nv 1 0 x\n").unwrap();
    let message = Scene::load(&path, &LoadOptions::default())
        .unwrap_err()
        .to_string();
    assert!(message.contains("scene.obj:3"), "{message}");
}

#[test]
fn long_normals_are_made_unit() {
    let folder = tempfile::tempdir().unwrap();
    let obj = |length: &str| {
        format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn {length} 0 {length}\nf 1//1 2//1 3//1\n")
    };
    let normal = |length: &str| load_obj(folder.path(), &obj(length), "").vertices[0].normal;
    for length in ["1e38", "3.4e38", "1e-38", "1e-45"] {
        assert_eq!(normal(length), normal("1"), "{length}");
    }
}

#[test]
fn a_missing_material_file_is_grey_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.obj");
    let text = "mtllib gone.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::fs::write(&path, text).unwrap();
    let message = Scene::load(&path, &LoadOptions::default())
        .unwrap_err()
        .to_string();
    assert!(message.contains("scene.obj:1") && message.contains("--allow-missing-textures"));
    let options = LoadOptions {
        allow_missing_textures: true,
        ..LoadOptions::default()
    };
    let scene = Scene::load(&path, &options).unwrap();
    assert_eq!(scene.materials[0].albedo, Vec3::splat(0.5));
}

/// A vertex that is too far away, and a model that is too small, by vertex and line.
#[test]
fn vertices_out_of_range_are_named() {
    let far = triangle([[0.0, 0.0, 0.0], [2e9, 0.0, 0.0], [0.0, 1.0, 0.0]], None).unwrap_err();
    assert!(far.contains("scene.obj:2: vertex 2 is at"), "{far}");
    let small = [[0.0, 0.0, 0.0], [1e-12, 0.0, 0.0], [0.0, 1e-12, 0.0]];
    let message = triangle(small, None).unwrap_err();
    assert!(
        message.contains("scene.obj:1: vertex 1") && message.contains("1e-9 m"),
        "{message}"
    );
    assert!(triangle(small, Some("scale = 1e6\n")).is_ok());
}

#[test]
fn pictures_of_other_formats_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.obj");
    let obj = "mtllib scene.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::fs::write(&path, obj).unwrap();
    for (name, bytes, says) in [
        ("a.gif", &b"GIF89a\x01\0\x01\0\0\0\0;"[..], "a GIF picture"),
        ("a.png", b"RIFF\x24\0\0\0WEBPVP8 ", "a WEBP picture"),
        ("a.psd", b"8BPS\0\x01", "no picture"),
    ] {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        let mtl = format!("newmtl m\nmap_Kd {name}\n");
        std::fs::write(folder.path().join("scene.mtl"), mtl).unwrap();
        let message = Scene::load(&path, &LoadOptions::default())
            .unwrap_err()
            .to_string();
        assert!(
            message.contains(says) && message.contains(name) && message.contains("convert it"),
            "{message}"
        );
    }
}

/// Neither a pipe nor a device is opened: this test would wait for ever.
#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused_by_type() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let message = |path: &Path| {
        Scene::load(path, &LoadOptions::default())
            .unwrap_err()
            .to_string()
    };
    for name in ["pipe.obj", "pipe.toml", "pipe.png"] {
        let made = std::process::Command::new("mkfifo").arg(at(name)).status();
        assert!(made.unwrap().success());
    }
    std::os::unix::fs::symlink("/dev/zero", at("zero.obj")).unwrap();
    for name in ["pipe.obj", "pipe.toml", "zero.obj"] {
        let message = message(&at(name));
        assert!(
            message.contains(name) && message.contains("a device, pipe"),
            "{message}"
        );
    }
    let obj = "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::fs::write(at("a.obj"), obj).unwrap();
    std::fs::write(at("a.mtl"), "newmtl m\nmap_Kd pipe.png\n").unwrap();
    let message = message(&at("a.obj"));
    assert!(message.contains("pipe.png (a device, pipe"), "{message}");
}

#[test]
fn vectors_have_three_numbers() {
    let unit = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    for (toml, says) in [
        (
            "translate = [1, 2, 3, 4]\n",
            "`model[0].translate` has 4 numbers",
        ),
        (
            "[camera]\neye = [0, 0, 1, 0]\ntarget = [0, 0, 0]\n",
            "`camera.eye` has 4 numbers",
        ),
        (
            "[environment]\nradiance = [1, 1]\n",
            "`environment.radiance` has 2 numbers",
        ),
    ] {
        let message = triangle(unit, Some(toml)).unwrap_err();
        assert!(
            message.contains(says) && message.contains("scene.toml:"),
            "{message}"
        );
    }
}
