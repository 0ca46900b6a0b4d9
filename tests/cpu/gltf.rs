//! glTF files: what is read of them is what their numbers say, by formulas of the specification.

use crate::support::loading::{check_scene, load, round_trip, write_anew};
use crate::support::surfaces::every_surface;
use std::path::Path;

use base64::Engine as _;
use glam::{DAffine3, DQuat, DVec3, Vec3, Vec4};
use lumivox::scene::{
    Keyframe, Light, LoadOptions, Material, Motion, Pose, Scene, TextureKind, Vertex, bundled,
};
use serde_json::{Value, json};

/// A file in the making: its JSON, and the bytes of its only buffer.
struct File {
    json: Value,
    bytes: Vec<u8>,
}

impl File {
    fn new() -> File {
        let json = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "nodes": [] }],
            "nodes": [], "meshes": [], "accessors": [], "bufferViews": [],
        });
        File {
            json,
            bytes: Vec::new(),
        }
    }

    fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    fn view(&mut self, bytes: &[u8], stride: Option<usize>) -> usize {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        let mut view =
            json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        self.bytes.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    /// An accessor of packed floats.
    fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let components = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let view = self.view(bytemuck::cast_slice(values), None);
        let mut accessor = json!({
            "bufferView": view, "componentType": 5126, "type": kind,
            "count": values.len() / components,
        });
        if kind == "VEC3" {
            // Positions must have bounds.
            accessor["min"] = json!([-1e3, -1e3, -1e3]);
            accessor["max"] = json!([1e3, 1e3, 1e3]);
        }
        self.push("accessors", accessor)
    }

    fn indices(&mut self, values: &[u16]) -> usize {
        let view = self.view(bytemuck::cast_slice(values), None);
        let count = values.len();
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": 5123, "type": "SCALAR", "count": count }),
        )
    }

    /// A mesh of one primitive.
    fn mesh(&mut self, primitive: Value) -> usize {
        self.push("meshes", json!({ "primitives": [primitive] }))
    }

    /// A node at the root.
    fn root(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        self.json["scenes"][0]["nodes"]
            .as_array_mut()
            .unwrap()
            .push(json!(index));
        index
    }

    /// A triangle with corners on the axes, as a mesh.
    fn triangle(&mut self) -> usize {
        let position = self.floats("VEC3", &TRIANGLE);
        self.mesh(json!({ "attributes": { "POSITION": position } }))
    }

    fn text(&self) -> String {
        let mut json = self.json.clone();
        if !self.bytes.is_empty() {
            let data = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
            json["buffers"] = json!([{
                "byteLength": self.bytes.len(),
                "uri": format!("data:application/octet-stream;base64,{data}"),
            }]);
        }
        // Lists must not be empty.
        let empty = |value: &Value| value.as_array().is_some_and(Vec::is_empty);
        let object = json.as_object_mut().unwrap();
        object.retain(|_, value| !empty(value));
        json.to_string()
    }

    fn load(&self) -> Scene {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.gltf");
        std::fs::write(&path, self.text()).unwrap();
        let scene = load(&path);
        check_scene(&path);
        round_trip(&scene);
        scene
    }

    fn error(&self) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.gltf");
        std::fs::write(&path, self.text()).unwrap();
        message(&path)
    }
}

fn message(path: &Path) -> String {
    match Scene::load(path, &LoadOptions::default()) {
        Ok(_) => panic!("no error"),
        Err(error) => error.to_string(),
    }
}

const TRIANGLE: [f32; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// Corners of all triangles, in order.
fn corners(scene: &Scene) -> Vec<[Vec3; 3]> {
    let position = |index: u32| Vec3::from(scene.vertices[index as usize].position);
    let triangles = scene.triangles.iter();
    triangles
        .map(|triangle| triangle.vertices.map(position))
        .collect()
}

fn near(a: Vec3, b: Vec3) -> bool {
    a.distance(b) <= 1e-5 * (1.0 + b.length())
}

/// A mesh that three nodes share stands where each of them is: moved, turned below a scaled parent,
/// and mirrored, where its front stays in front.
#[test]
fn instances_stand_where_their_nodes_are() {
    let mut file = File::new();
    let mesh = file.triangle();
    let turn = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(-0.4);
    let child = file.push(
        "nodes",
        json!({ "mesh": mesh, "rotation": turn.to_array() }),
    );
    file.root(json!({ "mesh": mesh, "translation": [1.0, 2.0, 3.0] }));
    file.root(json!({ "scale": [2.0, 3.0, 0.5], "children": [child] }));
    file.root(json!({ "mesh": mesh, "scale": [-1.0, 2.0, 1.0] }));
    let scene = file.load();
    let corner = |at: usize| DVec3::from_slice(&TRIANGLE.map(f64::from)[3 * at..]);
    let places = [
        DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0)),
        DAffine3::from_scale(DVec3::new(2.0, 3.0, 0.5)) * DAffine3::from_quat(turn),
        DAffine3::from_scale(DVec3::new(-1.0, 2.0, 1.0)),
    ];
    let found = corners(&scene);
    assert_eq!(found.len(), 3);
    for (index, (place, found)) in places.iter().zip(&found).enumerate() {
        let order = if index == 2 { [0, 2, 1] } else { [0, 1, 2] };
        for (at, found) in order.into_iter().zip(found) {
            let expected = place.transform_point3(corner(at)).as_vec3();
            assert!(near(*found, expected), "{index}: {found} for {expected}");
        }
        // The front of a mirrored triangle is the mirrored front.
        let [a, b, c] = *found;
        let front = (b - a).cross(c - a);
        let normal = place.matrix3.inverse().transpose() * DVec3::ONE;
        assert!(front.dot(normal.as_vec3()) > 0.0, "{index}: {front}");
        for vertex in scene.triangles[index].vertices {
            let normal = Vec3::from(scene.vertices[vertex as usize].normal);
            assert!(near(normal, front.normalize()), "{index}: {normal}");
        }
    }
}

/// The same triangle from interleaved floats, normalized 16-bit numbers under a scale, 8-bit ones,
/// and sparse elements; by indices of each width; as a strip and a fan.
#[test]
fn all_ways_to_write_numbers_say_the_same() {
    let plain = {
        let mut file = File::new();
        let mesh = file.triangle();
        file.root(json!({ "mesh": mesh }));
        corners(&file.load())
    };
    let bounds = |mut accessor: Value| {
        accessor["min"] = json!([0, 0, 0]);
        accessor["max"] = json!([1, 1, 1]);
        accessor
    };
    let mut files = Vec::new();
    {
        let mut file = File::new();
        let mut bytes = vec![7u8; 8];
        for corner in TRIANGLE.chunks(3) {
            bytes.extend_from_slice(bytemuck::cast_slice(corner));
            bytes.extend_from_slice(&[9; 8]);
        }
        let view = file.view(&bytes, Some(20));
        let accessor = file.push(
            "accessors",
            bounds(json!({
                "bufferView": view, "byteOffset": 8, "componentType": 5126, "type": "VEC3",
                "count": 3,
            })),
        );
        files.push(("interleaved", file, accessor));
    }
    for (name, kind, normalized) in [("16 bits", 5123, true), ("8 bits", 5121, false)] {
        let mut file = File::new();
        let bytes: Vec<u8> = TRIANGLE
            .chunks(3)
            .flat_map(|corner| match kind {
                5123 => {
                    let mut bytes: Vec<u8> = corner
                        .iter()
                        .flat_map(|x| ((x * 65_535.0) as u16).to_le_bytes())
                        .collect();
                    bytes.extend([1, 1]);
                    bytes
                }
                _ => corner.iter().map(|x| *x as u8).chain([3]).collect(),
            })
            .collect();
        let view = file.view(&bytes, Some(if kind == 5123 { 8 } else { 4 }));
        let accessor = file.push(
            "accessors",
            bounds(json!({
                "bufferView": view, "componentType": kind, "normalized": normalized,
                "type": "VEC3", "count": 3,
            })),
        );
        file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        file.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        files.push((name, file, accessor));
    }
    {
        let mut file = File::new();
        let indices = file.view(&[0, 1, 2], None);
        let values = file.view(bytemuck::cast_slice(&TRIANGLE), None);
        let accessor = file.push(
            "accessors",
            bounds(json!({
                "componentType": 5126, "type": "VEC3", "count": 3,
                "sparse": {
                    "count": 3,
                    "indices": { "bufferView": indices, "componentType": 5121 },
                    "values": { "bufferView": values },
                },
            })),
        );
        files.push(("sparse", file, accessor));
    }
    for (name, mut file, accessor) in files {
        for (kind, bytes) in [
            (5121, vec![0u8, 1, 2]),
            (5123, bytemuck::cast_slice(&[0u16, 1, 2]).to_vec()),
            (5125, bytemuck::cast_slice(&[0u32, 1, 2]).to_vec()),
        ] {
            let view = file.view(&bytes, None);
            let indices = file.push(
                "accessors",
                json!({ "bufferView": view, "componentType": kind, "type": "SCALAR", "count": 3 }),
            );
            for mode in [4, 5, 6] {
                let mesh = file.mesh(json!({
                    "attributes": { "POSITION": accessor }, "indices": indices, "mode": mode,
                }));
                file.json["scenes"][0]["nodes"] = json!([]);
                file.root(json!({ "mesh": mesh }));
                assert_eq!(corners(&file.load()), plain, "{name}, {kind}, mode {mode}");
            }
        }
    }
}

/// A strip of a square and a fan of a pentagon, by the order of the specification.
#[test]
fn strips_and_fans_become_triangles() {
    let square = [
        0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 2.0, 1.5, 0.0,
    ];
    let point = |at: usize| Vec3::from_slice(&square[3 * at..]);
    let expected = [
        (5, vec![[0, 1, 2], [2, 1, 3], [2, 3, 4]]),
        (6, vec![[0, 1, 2], [0, 2, 3], [0, 3, 4]]),
    ];
    for (mode, triangles) in expected {
        let mut file = File::new();
        let position = file.floats("VEC3", &square);
        let mesh = file.mesh(json!({ "attributes": { "POSITION": position }, "mode": mode }));
        file.root(json!({ "mesh": mesh }));
        let mut expected: Vec<[Vec3; 3]> = triangles
            .iter()
            .map(|corners: &[usize; 3]| corners.map(point))
            .collect();
        let mut found = corners(&file.load());
        // A triangle may begin at any of its corners.
        for triangle in expected.iter_mut().chain(&mut found) {
            let least = (0..3).min_by(|a, b| {
                let key = |at: &usize| triangle[*at].to_array();
                key(a).partial_cmp(&key(b)).unwrap()
            });
            triangle.rotate_left(least.unwrap());
        }
        assert_eq!(found, expected, "mode {mode}");
    }
}

/// A PNG of 2×1 texels as a data URI.
fn picture(texels: [[u8; 4]; 2]) -> String {
    use image::ImageEncoder as _;
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(texels.as_flattened(), 2, 1, image::ExtendedColorType::Rgba8)
        .unwrap();
    let data = base64::engine::general_purpose::STANDARD.encode(bytes);
    format!("data:image/png;base64,{data}")
}

/// The sRGB transfer function, decoding.
fn linear(value: u8) -> f32 {
    let value = f32::from(value) / 255.0;
    match value <= 0.04045 {
        true => value / 12.92,
        false => ((value + 0.055) / 1.055).powf(2.4),
    }
}

/// The same, encoding.
fn encoded(linear: f32) -> f32 {
    match linear <= 0.003_130_8 {
        true => 12.92 * linear,
        false => 1.055 * linear.powf(1.0 / 2.4) - 0.055,
    }
}

#[test]
fn materials_are_metal_rough() {
    let mut file = File::new();
    let images = [
        [[10, 20, 30, 255], [40, 50, 60, 64]],
        [[0, 51, 102, 255], [0, 153, 204, 255]],
        [[255, 128, 128, 255], [128, 128, 255, 255]],
    ];
    for (index, texels) in images.into_iter().enumerate() {
        file.push("images", json!({ "uri": picture(texels) }));
        file.push("textures", json!({ "source": index }));
    }
    file.json["extensionsUsed"] = json!([
        "KHR_materials_emissive_strength",
        "KHR_texture_transform",
        "KHR_materials_ior"
    ]);
    let transform = json!({ "KHR_texture_transform": {
        "offset": [0.25, 0.5], "rotation": std::f32::consts::FRAC_PI_2, "scale": [2.0, 3.0],
    } });
    file.push(
        "materials",
        json!({
            "name": "all\nof it ",
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 0.6, 0.7, 0.8],
                "baseColorTexture": { "index": 0, "extensions": transform },
                "metallicFactor": 0.5, "roughnessFactor": 0.25,
                "metallicRoughnessTexture": { "index": 1, "extensions": transform },
            },
            "normalTexture": { "index": 2, "scale": 0.5 },
            "emissiveFactor": [1.0, 0.5, 0.25],
            "alphaMode": "MASK", "alphaCutoff": 0.25,
            "extensions": {
                "KHR_materials_emissive_strength": { "emissiveStrength": 8.0 },
                "KHR_materials_ior": { "ior": 2.0 },
            },
        }),
    );
    let position = file.floats("VEC3", &TRIANGLE);
    let texcoord = file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let mesh = file.mesh(json!({
        "attributes": { "POSITION": position, "TEXCOORD_0": texcoord }, "material": 0,
    }));
    file.root(json!({ "mesh": mesh }));
    let scene = file.load();
    let material = &scene.materials[0];
    assert_eq!(material.name, "all_of it");
    assert_eq!(material.albedo, Vec3::new(0.5, 0.6, 0.7));
    assert_eq!(material.emission, Vec3::new(8.0, 4.0, 2.0));
    let texels = |index: Option<u32>, kind: TextureKind| {
        let texture = &scene.textures[index.unwrap() as usize];
        assert_eq!(texture.kind, kind);
        texture.texels.clone()
    };
    // Green is roughness, blue is metalness, of which half counts: F0 is between that of index 2,
    // 1/9, and the base colour, and the rest of the base colour is diffuse.
    let lobe = material.specular.unwrap();
    assert_eq!(
        (lobe.f0, lobe.roughness, lobe.metalness),
        (Vec3::ONE, 1.0, 0.0)
    );
    let (color, lobes) = (
        texels(material.albedo_texture, TextureKind::Color),
        texels(lobe.texture, TextureKind::Color),
    );
    for (at, base, roughness, metalness) in [
        (0, [10u8, 20, 30], 0.25 * 51.0 / 255.0, 0.5 * 102.0 / 255.0),
        (1, [40, 50, 60], 0.25 * 153.0 / 255.0, 0.5 * 204.0 / 255.0),
    ] {
        for channel in 0..3 {
            let base = linear(base[channel]);
            let near = |found: u8, expected: f32| {
                let steps = 255.0 * (encoded(expected) - f32::from(found) / 255.0);
                assert!(
                    steps.abs() < 0.51,
                    "texel {at}: {found}, off by {steps} steps"
                );
            };
            near(color[at][channel], base * (1.0 - metalness));
            let factor = [0.5, 0.6, 0.7][channel];
            near(
                lobes[at][channel],
                (1.0 - metalness) / 9.0 + metalness * factor * base,
            );
        }
        let steps = 255.0 * roughness - f32::from(lobes[at][3]);
        assert!(
            steps.abs() < 0.51,
            "texel {at}: roughness off by {steps} steps"
        );
    }
    // Alpha is there from 0.25 / 0.8 on, which becomes 0.5: 255 is cut off at 1, 64 becomes 102.
    let mask = texels(material.mask_texture, TextureKind::Mask);
    assert_eq!([mask[0][0], mask[1][0]], [255, 102]);
    // (1, 0, 0) stays, for z is nearly 0.
    let normals = texels(material.normal_texture, TextureKind::Normal);
    assert_eq!(normals[1], [128, 128, 255, 255]);
    assert!(normals[0][0] > 250 && normals[0][2] < 135, "{normals:?}");
    // A quarter turn against the clock with v down: (u, v) → (v, −u), of scaled coordinates.
    let uv = |corner: usize| {
        let vertex = &scene.vertices[scene.triangles[0].vertices[corner] as usize];
        Vec3::new(vertex.u, 1.0 - vertex.v, 0.0)
    };
    assert!(near(uv(0), Vec3::new(0.25, 0.5, 0.0)), "{}", uv(0));
    assert!(near(uv(1), Vec3::new(0.25, 0.5 - 2.0, 0.0)), "{}", uv(1));
    assert!(near(uv(2), Vec3::new(0.25 + 3.0, 0.5, 0.0)), "{}", uv(2));
}

/// A blended material is cut at one half: by its factor, all of it.
#[test]
fn alpha_removes() {
    for (alpha, mode, triangles) in [
        (0.4, "BLEND", 1),
        (0.6, "BLEND", 2),
        (0.4, "MASK", 1),
        (0.1, "OPAQUE", 2),
    ] {
        let mut file = File::new();
        file.push(
            "materials",
            json!({
                "alphaMode": mode,
                "pbrMetallicRoughness": { "baseColorFactor": [1.0, 1.0, 1.0, alpha] },
            }),
        );
        let position = file.floats("VEC3", &TRIANGLE);
        let attributes = json!({ "POSITION": position });
        let cut = file.mesh(json!({ "attributes": attributes, "material": 0 }));
        let whole = file.mesh(json!({ "attributes": attributes }));
        file.root(json!({ "mesh": cut }));
        file.root(json!({ "mesh": whole }));
        assert_eq!(file.load().triangles.len(), triangles, "{alpha} {mode}");
    }
}

#[test]
fn lights_and_cameras_are_taken_in_watts_and_degrees() {
    let mut file = File::new();
    let mesh = file.triangle();
    file.root(json!({ "mesh": mesh }));
    file.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "directional", "color": [1.0, 0.5, 0.25], "intensity": 1366.0 },
        { "type": "point", "intensity": 68.3 },
        {
            "type": "spot", "intensity": 683.0,
            "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.5 },
        },
    ] } });
    file.push(
        "cameras",
        json!({ "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.1 } }),
    );
    file.push(
        "cameras",
        json!({ "type": "perspective", "perspective": { "yfov": 0.1, "znear": 0.1 } }),
    );
    let light = |index: usize| json!({ "KHR_lights_punctual": { "light": index } });
    let down = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2).to_array();
    file.root(json!({ "rotation": down, "extensions": light(0) }));
    file.root(json!({ "translation": [1.0, 2.0, 3.0], "extensions": light(1) }));
    file.root(json!({ "translation": [0.0, 5.0, 0.0], "rotation": down, "extensions": light(2) }));
    file.root(json!({ "translation": [4.0, 5.0, 6.0], "camera": 0 }));
    file.root(json!({ "camera": 1 }));
    let scene = file.load();
    assert!(near(scene.camera.eye, Vec3::new(4.0, 5.0, 6.0)));
    let forward = (scene.camera.target - scene.camera.eye).normalize();
    assert!(near(forward, -Vec3::Z) && near(scene.camera.up, Vec3::Y));
    assert!((scene.camera.vfov_deg - 0.8f32.to_degrees()).abs() < 1e-4);
    assert!(scene.environment.is_black());
    let [
        Light::Directional {
            direction,
            irradiance,
        },
        Light::Point {
            position,
            intensity,
        },
        Light::Spot {
            direction: axis,
            intensity: on_axis,
            inner_deg,
            outer_deg,
            ..
        },
    ] = scene.lights[..]
    else {
        panic!("{:?}", scene.lights)
    };
    assert!(near(direction, -Vec3::Y) && near(irradiance, Vec3::new(2.0, 1.0, 0.5)));
    assert!(near(position, Vec3::new(1.0, 2.0, 3.0)) && near(intensity, Vec3::splat(0.1)));
    assert!(near(axis, -Vec3::Y) && near(on_axis, Vec3::ONE));
    assert!((inner_deg - 0.1f32.to_degrees()).abs() < 1e-4);
    assert!((outer_deg - 0.5f32.to_degrees()).abs() < 1e-4);
    // In a scene file, what that says of lights and camera stands; the rest is the model's.
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("model.gltf"), file.text()).unwrap();
    let with = |more: &str| {
        let path = folder.path().join("scene.toml");
        write_anew(
            &path,
            format!("{more}\n[[model]]\npath = \"model.gltf\"\nscale = 2.0\n"),
        );
        load(&path)
    };
    let scene = with("");
    assert_eq!(scene.lights.len(), 3);
    assert!(near(scene.camera.eye, Vec3::new(8.0, 10.0, 12.0)));
    assert!(near(corners(&scene)[0][0], Vec3::new(2.0, 0.0, 0.0)));
    let scene = with("light = []\ncamera = { eye = [0, 0, 9], target = [0, 0, 0] }");
    assert!(scene.lights.is_empty());
    assert_eq!(scene.camera.eye, Vec3::new(0.0, 0.0, 9.0));
}

/// A node that turns and moves, by each interpolation, below one that moves too: at all times its
/// vertices are where the product of both says. Between samples of a curve, nearly.
#[test]
fn nodes_move_as_their_tracks_say() {
    let turn =
        |angle: f64| (DQuat::from_rotation_z(angle) * DQuat::from_rotation_x(0.3)).to_array();
    for (interpolation, tolerance) in [("LINEAR", 2e-3), ("STEP", 1e-5), ("CUBICSPLINE", 1e-2)] {
        let mut file = File::new();
        let mesh = file.triangle();
        let child = file.push("nodes", json!({ "mesh": mesh, "scale": [1.0, 2.0, 0.5] }));
        let parent = file.root(json!({
            "children": [child], "translation": [0.0, 0.0, 7.0], "scale": [2.0, 2.0, 2.0],
        }));
        let times = file.floats("SCALAR", &[0.5, 1.0, 2.0]);
        let ends = file.floats("SCALAR", &[0.0, 3.0]);
        let moves = file.floats("VEC3", &[0.0, 0.0, 7.0, 3.0, 0.0, 7.0]);
        let turns: [[f64; 4]; 3] = [turn(0.0), turn(1.0), turn(-0.5)];
        let values: Vec<f32> = turns
            .iter()
            .flat_map(|value| match interpolation {
                "CUBICSPLINE" => [[0.1, -0.2, 0.3, 0.0], *value, [0.2, 0.1, -0.3, 0.1]].concat(),
                _ => value.to_vec(),
            })
            .map(|value| value as f32)
            .collect();
        let rotation = file.floats("VEC4", &values);
        file.push(
            "animations",
            json!({
                "samplers": [
                    { "input": times, "output": rotation, "interpolation": interpolation },
                    { "input": ends, "output": moves },
                ],
                "channels": [
                    { "sampler": 0, "target": { "node": child, "path": "rotation" } },
                    { "sampler": 1, "target": { "node": parent, "path": "translation" } },
                ],
            }),
        );
        let mut scene = file.load();
        assert!(scene.models[0].dynamic && scene.moves());
        let rotation_at = |time: f64| {
            let keys = [0.5, 1.0, 2.0];
            let quaternion = |at: usize| DQuat::from_array(turns[at]);
            let at = keys.partition_point(|key| *key <= time);
            if at == 0 || at == 3 {
                return quaternion(at.min(2));
            }
            let length = keys[at] - keys[at - 1];
            let t = (time - keys[at - 1]) / length;
            let (a, b) = (quaternion(at - 1), quaternion(at));
            match interpolation {
                "STEP" => a,
                "LINEAR" => a.slerp(b, t),
                _ => {
                    // Hermite's basis, as the specification has it.
                    let (into, out) = ([0.1, -0.2, 0.3, 0.0], [0.2, 0.1, -0.3, 0.1]);
                    let (t2, t3) = (t * t, t * t * t);
                    let sum = a * (2.0 * t3 - 3.0 * t2 + 1.0)
                        + DQuat::from_array(out) * (length * (t3 - 2.0 * t2 + t))
                        + b * (3.0 * t2 - 2.0 * t3)
                        + DQuat::from_array(into) * (length * (t3 - t2));
                    sum.normalize()
                }
            }
        };
        for step in 0..=70 {
            let time = 0.049 * f64::from(step);
            scene.set_time(time as f32);
            let parent = DAffine3::from_scale_rotation_translation(
                DVec3::splat(2.0),
                DQuat::IDENTITY,
                DVec3::new(time.min(3.0), 0.0, 7.0),
            );
            let child = DAffine3::from_scale_rotation_translation(
                DVec3::new(1.0, 2.0, 0.5),
                rotation_at(time),
                DVec3::ZERO,
            );
            for (at, found) in corners(&scene)[0].iter().enumerate() {
                let corner = DVec3::from_slice(&TRIANGLE.map(f64::from)[3 * at..]);
                let expected = (parent * child).transform_point3(corner).as_vec3();
                assert!(
                    found.distance(expected) < tolerance,
                    "{interpolation}, {time} s: {found} for {expected}"
                );
            }
        }
    }
}

/// Each vertex of a skin is the weighted mean of where its joints take it.
#[test]
fn skins_stand_as_their_joints_do() {
    let mut file = File::new();
    let position = file.floats("VEC3", &TRIANGLE);
    let weights = file.floats(
        "VEC4",
        &[1.0, 0.0, 0.0, 0.0, 0.25, 0.75, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
    );
    let bytes: [u8; 12] = [0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0];
    let view = file.view(&bytes, None);
    let joints = file.push(
        "accessors",
        json!({ "bufferView": view, "componentType": 5121, "type": "VEC4", "count": 3 }),
    );
    let mut bind = [
        DAffine3::IDENTITY,
        DAffine3::from_translation(DVec3::new(0.0, -1.0, 0.0)),
    ]
    .map(|affine| glam::DMat4::from(affine).to_cols_array().map(|x| x as f32))
    .concat();
    bind.truncate(32);
    let bind = file.floats("MAT4", &bind);
    let mesh = file.mesh(json!({
        "attributes": { "POSITION": position, "JOINTS_0": joints, "WEIGHTS_0": weights },
    }));
    // The skinned node's own place does not count.
    file.root(json!({ "mesh": mesh, "skin": 0, "translation": [9.0, 9.0, 9.0] }));
    let second = file.push("nodes", json!({ "translation": [0.0, 1.0, 5.0] }));
    let first = file.root(json!({ "translation": [1.0, 0.0, 0.0], "children": [second] }));
    file.push(
        "skins",
        json!({ "joints": [first, second], "inverseBindMatrices": bind }),
    );
    let by = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 5.0)];
    let corner = |at: usize| Vec3::from_slice(&TRIANGLE[3 * at..]);
    let expected = [
        corner(0) + by[0],
        corner(1) + 0.25 * by[0] + 0.75 * by[1],
        corner(2) + by[1],
    ];
    for (found, expected) in corners(&file.load())[0].iter().zip(expected) {
        assert!(near(*found, expected), "{found} for {expected}");
    }
}

/// What is wrong is said with its place.
#[test]
fn bad_files_are_told_by_their_place() {
    let with_triangle = || {
        let mut file = File::new();
        let mesh = file.triangle();
        file.root(json!({ "mesh": mesh }));
        file
    };
    type Change = fn(&mut File);
    let cases: [(&str, Change, &[&str]); 16] = [
        (
            "no mesh",
            |file| file.json["nodes"][0] = json!({}),
            &["no triangles"],
        ),
        (
            "index of a mesh",
            |file| file.json["nodes"][0]["mesh"] = json!(7),
            &["nodes[0].mesh"],
        ),
        (
            "a cycle",
            |file| file.json["nodes"][0]["children"] = json!([0]),
            &["nodes[0]", "more than one node"],
        ),
        (
            "count",
            |file| file.json["accessors"][0]["count"] = json!(1_000_000_000_000_u64),
            &["accessors[0]", "do not fit"],
        ),
        (
            "stride",
            |file| file.json["bufferViews"][0]["byteStride"] = json!(4),
            &["accessors[0]", "do not fit"],
        ),
        (
            "offset",
            |file| file.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX),
            &["accessors[0]"],
        ),
        (
            "two numbers",
            |file| file.json["accessors"][0]["type"] = json!("VEC2"),
            &["accessors[0]", "2 components"],
        ),
        (
            "not finite",
            |file| file.bytes[..4].copy_from_slice(&f32::NAN.to_le_bytes()),
            &["meshes[0].primitives[0]", "not within"],
        ),
        (
            "far",
            |file| file.json["nodes"][0]["scale"] = json!([1e20, 1e20, 1e20]),
            &["meshes[0].primitives[0]", "not within"],
        ),
        (
            "indices",
            |file| {
                let indices = file.indices(&[0, 1, 3]);
                file.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
            },
            &["meshes[0].primitives[0]", "beyond its 3 vertices"],
        ),
        (
            "compressed",
            |file| file.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]),
            &["KHR_draco_mesh_compression", "uncompressed"],
        ),
        (
            "version",
            |file| file.json = json!({ "asset": { "version": "1.0" }, "nodes": { "a": {} } }),
            &["glTF 1.0", "convert"],
        ),
        (
            "times",
            |file| {
                let times = file.floats("SCALAR", &[1.0, 0.5]);
                let moves = file.floats("VEC3", &[0.0; 6]);
                file.push(
                    "animations",
                    json!({
                        "samplers": [{ "input": times, "output": moves }],
                        "channels": [{
                            "sampler": 0, "target": { "node": 0, "path": "translation" },
                        }],
                    }),
                );
            },
            &["animations[0].channels[0]", "rise"],
        ),
        (
            "a picture that is not there",
            |file| {
                file.push("images", json!({ "uri": "not%20there.png" }));
                file.push("textures", json!({ "source": 0 }));
                file.push(
                    "materials",
                    json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }),
                );
                file.json["meshes"][0]["primitives"][0]["material"] = json!(0);
            },
            &["1 missing texture", "not there.png", "images[0]"],
        ),
        (
            "a buffer elsewhere",
            |file| {
                file.bytes.clear();
                file.json["buffers"] = json!([{ "byteLength": 36, "uri": "https://host/a.bin" }]);
            },
            &["buffers[0]", "https://host/a.bin", "download"],
        ),
        (
            "a short buffer",
            |file| {
                file.bytes.clear();
                file.json["buffers"] = json!([{ "byteLength": 36, "uri": "data:;base64,AAAA" }]);
            },
            &["buffers[0]", "3 of 36 bytes"],
        ),
    ];
    for (name, change, says) in cases {
        let mut file = with_triangle();
        change(&mut file);
        let message = file.error();
        assert!(
            !message.contains('\n') && message.contains("; "),
            "{name}: {message}"
        );
        for part in says {
            assert!(
                message.contains(part),
                "{name}: `{part}` is not in: {message}"
            );
        }
    }
}

/// A binary file, cut and changed at every third byte: an error or a scene, never a panic.
#[test]
fn damaged_binary_files_never_panic() {
    let mut file = File::new();
    let position = file.floats("VEC3", &TRIANGLE);
    let texcoord = file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let view = file.view(&[0, 0, 0, 0].repeat(3), None);
    let joints = file.push(
        "accessors",
        json!({ "bufferView": view, "componentType": 5121, "type": "VEC4", "count": 3 }),
    );
    let weights = file.floats("VEC4", &[1.0, 0.0, 0.0, 0.0].repeat(3));
    let values = file.view(bytemuck::cast_slice(&[0.0f32, 0.0, 1.0]), None);
    let normal = file.push(
        "accessors",
        json!({ "componentType": 5126, "type": "VEC3", "count": 3, "sparse": {
            "count": 1,
            "indices": { "bufferView": view, "componentType": 5121 },
            "values": { "bufferView": values },
        } }),
    );
    let indices = file.indices(&[0, 1, 2]);
    let png = base64::engine::general_purpose::STANDARD
        .decode(picture([[1, 2, 3, 4]; 2]).split_once(',').unwrap().1)
        .unwrap();
    let png = file.view(&png, None);
    file.push(
        "images",
        json!({ "bufferView": png, "mimeType": "image/png" }),
    );
    file.push("textures", json!({ "source": 0, "sampler": 0 }));
    file.push("samplers", json!({ "wrapS": 33071, "minFilter": 9729 }));
    let map = json!({ "index": 0, "texCoord": 0 });
    file.push(
        "materials",
        json!({
            "pbrMetallicRoughness": { "baseColorTexture": map, "metallicRoughnessTexture": map },
            "normalTexture": map, "emissiveTexture": map, "emissiveFactor": [1, 1, 1],
            "alphaMode": "MASK", "alphaCutoff": 0.001,
            "extensions": {
                "KHR_materials_specular": { "specularFactor": 0.5, "specularTexture": map },
                "KHR_materials_ior": { "ior": 1.4 },
            },
        }),
    );
    let mesh = file.mesh(json!({
        "attributes": {
            "POSITION": position, "NORMAL": normal, "TEXCOORD_0": texcoord,
            "JOINTS_0": joints, "WEIGHTS_0": weights,
        },
        "indices": indices, "material": 0, "mode": 4,
    }));
    let times = file.floats("SCALAR", &[0.0, 1.0]);
    let moves = file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    file.root(json!({ "mesh": mesh, "skin": 0 }));
    file.root(json!({ "mesh": mesh, "rotation": [0, 0, 0, 1] }));
    file.push("skins", json!({ "joints": [0, 1] }));
    file.push(
        "cameras",
        json!({ "type": "perspective", "perspective": { "yfov": 1, "znear": 1 } }),
    );
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "spot", "spot": {} },
    ] } });
    file.root(json!({ "camera": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    file.push(
        "animations",
        json!({
            "samplers": [{ "input": times, "output": moves, "interpolation": "LINEAR" }],
            "channels": [{ "sampler": 0, "target": { "node": 1, "path": "translation" } }],
        }),
    );
    file.json["buffers"] = json!([{ "byteLength": file.bytes.len() }]);
    let mut text = file.json.to_string();
    while !text.len().is_multiple_of(4) {
        text.push(' ');
    }
    let chunk = |kind: &[u8; 4], bytes: &[u8]| {
        [&(bytes.len() as u32).to_le_bytes()[..], &kind[..], bytes].concat()
    };
    let chunks = [
        chunk(b"JSON", text.as_bytes()),
        chunk(b"BIN\0", &file.bytes),
    ]
    .concat();
    let length = (12 + chunks.len()) as u32;
    let whole = [
        &b"glTF"[..],
        &2u32.to_le_bytes(),
        &length.to_le_bytes(),
        &chunks,
    ]
    .concat();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.glb");
    std::fs::write(&path, &whole).unwrap();
    assert_eq!(load(&path).triangles.len(), 2);
    for position in (0..whole.len()).step_by(3) {
        for replacement in [
            None,
            Some(0),
            Some(b'9'),
            Some(b'-'),
            Some(0xff),
            Some(b'"'),
        ] {
            let mut damaged = whole.clone();
            match replacement {
                Some(byte) => damaged[position] = byte,
                None => damaged.truncate(position),
            }
            write_anew(&path, &damaged);
            check_scene(&path);
        }
    }
}

/// What a scene that was written as glTF and loaded again differs in, at most (relative).
const ROUNDED: f32 = 2e-5;

/// Every bundled scene, and one with maps of all kinds, is the same scene after it was written as
/// glTF and loaded again, but for what glTF has no word for.
#[test]
fn scenes_survive_being_written() {
    let mut scenes: Vec<Scene> = bundled::TABLE
        .iter()
        .map(|row| Scene::bundled(row.name, &[]).unwrap())
        .collect();
    // Loaded from a file, it has no triangles without area.
    let folder = tempfile::tempdir().unwrap();
    scenes.push(load(
        &every_surface(true, true).write(folder.path()).unwrap(),
    ));
    let mut moving = Scene::bundled("lit-sphere", &[]).unwrap();
    let rest = moving.vertices.clone();
    let pose = |rotate_deg: [f32; 3], translate: [f32; 3]| Pose {
        rotate_deg: rotate_deg.into(),
        translate: translate.into(),
    };
    moving.models[0].dynamic = true;
    moving.models[0].motion = Some(Motion {
        first_vertex: 0,
        rest,
        keyframes: vec![
            Keyframe {
                time_s: -1.0,
                pose: pose([0.0; 3], [-1.0, 0.0, 0.0]),
            },
            Keyframe {
                time_s: 1.0,
                pose: pose([10.0, 80.0, -30.0], [1.0, 2.0, 3.0]),
            },
            Keyframe {
                time_s: 3.0,
                pose: pose([0.0, 170.0, 0.0], [0.0; 3]),
            },
        ],
    });
    scenes.push(moving);
    for mut scene in scenes {
        let folder = tempfile::tempdir().unwrap();
        let mut loaded = load(&scene.write_gltf(folder.path()).unwrap());
        let name = scene.name.clone();
        assert_eq!(loaded.triangles.len(), scene.triangles.len(), "{name}");
        assert_eq!(loaded.moves(), scene.moves(), "{name}");
        for time_s in [0.0, 0.7, 1.0, 2.4, 9.0] {
            scene.set_time(time_s);
            loaded.set_time(time_s);
            compare_surfaces(&name, &scene, &loaded);
            if !scene.moves() {
                break;
            }
        }
        let close = |a: Vec3, b: Vec3| a.distance(b) <= ROUNDED * (1.0 + a.length());
        let (camera, other) = (&scene.camera, &loaded.camera);
        assert!(close(camera.eye, other.eye), "{name}");
        for (a, b) in camera.basis().iter().zip(other.basis()) {
            assert!(close(*a, b), "{name}: {a} became {b}");
        }
        assert!((camera.vfov_deg - other.vfov_deg).abs() < 1e-3, "{name}");
        if scene.lights.is_empty() {
            continue;
        }
        assert_eq!(scene.lights.len(), loaded.lights.len(), "{name}");
        let points = [Vec3::new(0.3, -2.0, 0.7), Vec3::new(-1.0, 0.1, 2.0)];
        for (light, other) in scene.lights.iter().zip(&loaded.lights) {
            for point in points {
                let ((to, _, a), (other_to, _, b)) = (light.sample(point), other.sample(point));
                assert!(close(to, other_to), "{name}: {light:?} became {other:?}");
                assert!(
                    a.distance(b) <= 1e-3 * (a.length() + 1e-6),
                    "{name}: {a} became {b}"
                );
            }
        }
    }
}

/// The triangles of two scenes, in whatever order, and what they are made of.
fn compare_surfaces(name: &str, scene: &Scene, loaded: &Scene) {
    let close = |a: Vec3, b: Vec3| a.distance(b) <= ROUNDED * (1.0 + a.length());
    // Models and materials keep their order; in a file, what stands still comes first.
    for (index, (a, b)) in scene.triangles.iter().zip(&loaded.triangles).enumerate() {
        let [material, other] = [(scene, a), (loaded, b)]
            .map(|(scene, triangle)| &scene.materials[triangle.material as usize]);
        assert_eq!(material.name.trim(), other.name, "{name}");
        assert!(
            close(material.emission, other.emission),
            "{name}: {material:?}, {other:?}"
        );
        for (a, b) in a.vertices.iter().zip(b.vertices) {
            let (a, b) = (&scene.vertices[*a as usize], &loaded.vertices[b as usize]);
            assert!(
                close(a.position.into(), b.position.into()),
                "{name}, {index}: {a:?}, {b:?}"
            );
            assert!(
                close(a.normal.into(), b.normal.into()),
                "{name}, {index}: {a:?}, {b:?}"
            );
            let uv = |vertex: &Vertex| Vec3::new(vertex.u, vertex.v, 0.0);
            assert!(close(uv(a), uv(b)), "{name}, {index}: {a:?}, {b:?}");
        }
        // Diffuse albedo, F0 and roughness at a texel, however they are written down.
        let lobe = |scene: &Scene, material: &Material| {
            let texel = |texture: Option<u32>| {
                texture.map_or(Vec4::ONE, |texture| {
                    scene.textures[texture as usize].texel(3, 2)
                })
            };
            let base = material.albedo * texel(material.albedo_texture).truncate();
            let lobe = material.specular.unwrap_or_default();
            let texel = texel(lobe.texture);
            let f0 = (lobe.f0 * texel.truncate()).lerp(base, lobe.metalness);
            let is_there = material.specular.is_some();
            (
                base * (1.0 - lobe.metalness),
                f0,
                lobe.roughness * texel.w,
                is_there,
            )
        };
        let (diffuse, f0, roughness, is_there) = lobe(scene, material);
        let found = lobe(loaded, other);
        let mapped = material.specular.is_some_and(|lobe| lobe.texture.is_some());
        // 8 bits a channel, where there is a texture.
        let [color, value] = if mapped {
            [0.01, 0.004]
        } else {
            [ROUNDED, 1e-6]
        };
        let is_same = diffuse.distance(found.0) <= color
            && f0.distance(found.1) <= color
            && (roughness - found.2).abs() <= value
            && is_there == found.3;
        assert!(is_same, "{name}: {material:?} became {other:?}");
        let texels = |scene: &Scene, texture: Option<u32>| -> Vec<[u8; 3]> {
            let texels = texture.map(|index| &scene.textures[index as usize].texels);
            texels.map_or_else(Vec::new, |texels| {
                texels.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect()
            })
        };
        if index == 0 || scene.triangles[index - 1].material != a.material {
            for (a, b) in [
                (material.albedo_texture, other.albedo_texture),
                (material.emission_texture, other.emission_texture),
                (material.normal_texture, other.normal_texture),
            ] {
                let is_seen = a.is_some() || material.mask_texture.is_none();
                let is_lit = a != material.emission_texture || material.emission != Vec3::ZERO;
                if is_seen && is_lit {
                    assert_eq!(
                        texels(scene, a),
                        texels(loaded, b),
                        "{name}: {}",
                        material.name
                    );
                }
            }
            let holes = |scene: &Scene, texture: Option<u32>| -> Vec<bool> {
                let texels = texels(scene, texture);
                texels.iter().map(|[r, ..]| *r >= 128).collect()
            };
            let (a, b) = (material.mask_texture, other.mask_texture);
            let [a, b] = [holes(scene, a), holes(loaded, b)];
            // A mask may have been stretched to the size of its colour.
            if a.len() == b.len() {
                assert_eq!(a, b, "{name}: {}", material.name);
            }
            assert_eq!(a.is_empty(), b.is_empty(), "{name}: {}", material.name);
        }
    }
}
