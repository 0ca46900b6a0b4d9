//! Writing a scene as glTF 2.0: a `.gltf`, a `.bin` and PNG files.
//!
//! glTF has no word for an environment, for a model that may move but has no keyframes, and for
//! times before 0 s. These are left out with a warning.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use glam::{Mat3, Quat, Vec3};
use serde_json::{Value, json};

use super::super::lobes::{Picture, Recipe};
use super::super::write::{Names, check_not_read, file_name, stem, write_png};
use super::super::{Light, Material, Model, Motion, Scene, SceneError, Specular, Texture, Vertex};
use super::LUMENS_PER_WATT;
use crate::image::srgb_from_linear;
use crate::output;

/// Component types of accessors.
const U32: u32 = 5125;
const F32: u32 = 5126;

/// Targets of buffer views.
const VERTICES: u32 = 34_962;
const INDICES: u32 = 34_963;

impl Scene {
    /// Writes the scene into `folder`, which is made where it does not exist, and answers the path
    /// of the `.gltf` file in it. A file that the scene was read from is never replaced.
    pub fn write_gltf(&self, folder: &Path) -> Result<PathBuf, SceneError> {
        let name = file_name(&self.name);
        let path = folder.join(format!("{name}.gltf"));
        let mut writer = Writer::default();
        let materials: Vec<Value> = (0..self.materials.len())
            .map(|number| writer.material(self, number))
            .collect();
        for model in &self.models {
            writer.model(self, model);
        }
        writer.camera(self);
        self.lights.iter().for_each(|light| writer.light(light));
        let binary = folder.join(format!("{name}.bin"));
        let written = (writer.files.iter().map(|(file, _)| folder.join(file)))
            .chain([path.clone(), binary.clone()]);
        check_not_read(&self.files, written)?;
        let textures = folder.join("textures");
        let made = if writer.files.is_empty() {
            folder
        } else {
            &textures
        };
        fs::create_dir_all(made).map_err(|error| SceneError::write(made, error))?;
        for (file, texture) in &writer.files {
            write_png(&folder.join(file), texture)?;
        }
        let text = writer.json(materials, &format!("{name}.bin")).to_string();
        for (path, bytes) in [(&binary, &*writer.bytes), (&path, text.as_bytes())] {
            output::write_file(path, |file| file.write_all(bytes))
                .map_err(|error: std::io::Error| SceneError::write(path, error))?;
        }
        self.warn_of_what_gltf_has_not(&path);
        Ok(path)
    }

    fn warn_of_what_gltf_has_not(&self, path: &Path) {
        let path = path.display();
        if !self.environment.is_black() {
            log::warn!("{path}: glTF has no environment; it is left out");
        }
        for material in (self.materials.iter()).filter(|one| one.transmission.is_some()) {
            log::warn!(
                "{path}: `{}` is written as opaque; what is clear of it goes into MTL alone",
                material.name
            );
        }
        let is_free = |model: &&Model| model.dynamic && model.motion.is_none();
        for model in self.models.iter().filter(is_free) {
            log::warn!(
                "{path}: `{}` has no keyframes; it stands still in glTF",
                model.name
            );
        }
        let begins_early = |motion: &Motion| motion.keyframes[0].time_s < 0.0;
        if self
            .models
            .iter()
            .filter_map(|model| model.motion.as_ref())
            .any(begins_early)
        {
            log::warn!("{path}: times in glTF begin at 0 s; what moves before is left out");
        }
    }
}

/// What a texture of the file is made of: indices of textures of the scene.
#[derive(PartialEq, Eq, Hash)]
enum Key {
    Plain(u32),
    /// A colour with a mask.
    Masked(Option<u32>, u32),
    /// The lobe of a material.
    Lobe(usize),
}

/// What has been written so far.
#[derive(Default)]
struct Writer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    cameras: Vec<Value>,
    lights: Vec<Value>,
    samplers: Vec<Value>,
    channels: Vec<Value>,
    names: Names,
    /// Textures by file.
    files: Vec<(String, Texture)>,
    index_from_textures: HashMap<Key, usize>,
    uses_specular_glossy: bool,
}

impl Writer {
    fn json(&self, materials: Vec<Value>, binary: &str) -> Value {
        let images: Vec<Value> = (self.files.iter())
            .map(|(file, _)| {
                let uri = percent_encoding::utf8_percent_encode(file, NOT_IN_URIS);
                json!({ "uri": uri.to_string() })
            })
            .collect();
        let textures: Vec<Value> = (0..images.len())
            .map(|source| json!({ "source": source }))
            .collect();
        let mut used = vec!["KHR_materials_emissive_strength", "KHR_materials_specular"];
        if self.uses_specular_glossy {
            used.push("KHR_materials_pbrSpecularGlossiness");
        }
        let nodes: Vec<usize> = (0..self.nodes.len()).collect();
        let mut root = json!({
            "asset": { "version": "2.0", "generator": "Lumivox" },
            "scene": 0,
            "scenes": [{ "nodes": nodes }],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": materials,
            "cameras": self.cameras,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{
                "byteLength": self.bytes.len(),
                "uri": percent_encoding::utf8_percent_encode(binary, NOT_IN_URIS).to_string(),
            }],
        });
        if !images.is_empty() {
            root["images"] = json!(images);
            root["textures"] = json!(textures);
        }
        if !self.lights.is_empty() {
            used.push("KHR_lights_punctual");
            root["extensions"] = json!({ "KHR_lights_punctual": { "lights": self.lights } });
        }
        if !self.channels.is_empty() {
            root["animations"] = json!([{ "samplers": self.samplers, "channels": self.channels }]);
        }
        root["extensionsUsed"] = json!(used);
        root
    }

    /// An accessor of numbers that are given as bytes, and a buffer view of the same index.
    fn accessor(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        self.views.push(json!({
            "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len(),
        }));
        self.bytes.extend_from_slice(bytes);
        self.accessors.push(json!({
            "bufferView": self.views.len() - 1, "componentType": component, "type": kind,
            "count": count,
        }));
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let accessor = self.accessor(
            kind,
            F32,
            values.len(),
            bytemuck::cast_slice(values.as_flattened()),
        );
        let bound = |choose: fn(f32, f32) -> f32| -> Vec<f32> {
            let of = |at: usize| values.iter().map(|value| value[at]).reduce(choose);
            (0..N).map(|at| of(at).unwrap_or(0.0)).collect()
        };
        self.accessors[accessor]["min"] = json!(bound(f32::min));
        self.accessors[accessor]["max"] = json!(bound(f32::max));
        accessor
    }

    fn model(&mut self, scene: &Scene, model: &Model) {
        let first = model.first_triangle as usize;
        let triangles = &scene.triangles[first..first + model.triangle_count as usize];
        let corners = || triangles.iter().flat_map(|triangle| triangle.vertices);
        let (least, most) = (corners().min().unwrap_or(0), corners().max().unwrap_or(0));
        let posed = &scene.vertices[least as usize..=most as usize];
        let vertices = model.motion.as_ref().map_or(posed, |motion| &motion.rest);
        let vectors = |of: fn(&Vertex) -> [f32; 3]| vertices.iter().map(of).collect::<Vec<_>>();
        let position = self.floats(&vectors(|vertex| vertex.position));
        let normal = self.floats(&vectors(|vertex| vertex.normal));
        let texcoords: Vec<[f32; 2]> = vertices
            .iter()
            .map(|vertex| [vertex.u, 1.0 - vertex.v])
            .collect();
        let texcoord = self.floats(&texcoords);
        for view in [position, normal, texcoord] {
            self.views[view]["target"] = json!(VERTICES);
        }
        let runs = triangles.chunk_by(|a, b| a.material == b.material);
        let primitives: Vec<Value> = runs
            .map(|run| {
                let indices: Vec<u32> = (run.iter())
                    .flat_map(|triangle| triangle.vertices.map(|index| index - least))
                    .collect();
                let bytes = bytemuck::cast_slice(&indices);
                let accessor = self.accessor("SCALAR", U32, indices.len(), bytes);
                self.views[accessor]["target"] = json!(INDICES);
                json!({
                    "attributes": {
                        "POSITION": position, "NORMAL": normal, "TEXCOORD_0": texcoord,
                    },
                    "indices": accessor,
                    "material": run[0].material,
                })
            })
            .collect();
        self.meshes
            .push(json!({ "name": model.name, "primitives": primitives }));
        self.nodes
            .push(json!({ "name": model.name, "mesh": self.meshes.len() - 1 }));
        if let Some(motion) = &model.motion {
            self.motion(motion, self.nodes.len() - 1);
        }
    }

    /// Rotation and translation of a node at all keyframes from 0 s on.
    fn motion(&mut self, motion: &Motion, node: usize) {
        let keyframes = motion.keyframes.iter().map(|keyframe| keyframe.time_s);
        let begins_early = motion.keyframes[0].time_s < 0.0;
        let mut times: Vec<f32> = keyframes.filter(|time_s| *time_s >= 0.0).collect();
        if begins_early && times.first() != Some(&0.0) {
            times.insert(0, 0.0);
        }
        let poses: Vec<(Quat, Vec3)> = times.iter().map(|time_s| motion.pose_at(*time_s)).collect();
        let input = self.floats(&times.iter().map(|time_s| [*time_s]).collect::<Vec<_>>());
        let rotations: Vec<[f32; 4]> = poses.iter().map(|(turn, _)| turn.to_array()).collect();
        let translations: Vec<[f32; 3]> = poses.iter().map(|(_, to)| to.to_array()).collect();
        let outputs = [
            ("rotation", self.floats(&rotations)),
            ("translation", self.floats(&translations)),
        ];
        for (property, output) in outputs {
            self.samplers
                .push(json!({ "input": input, "output": output }));
            self.channels.push(json!({
                "sampler": self.samplers.len() - 1,
                "target": { "node": node, "path": property },
            }));
        }
    }

    fn camera(&mut self, scene: &Scene) {
        let camera = &scene.camera;
        let [right, up, forward] = camera.basis();
        let turn = Quat::from_mat3(&Mat3::from_cols(right, up, -forward));
        self.cameras.push(json!({
            "type": "perspective",
            "perspective": { "yfov": camera.vfov_deg.to_radians(), "znear": 0.01 },
        }));
        self.nodes.push(json!({
            "camera": 0, "translation": camera.eye.to_array(), "rotation": turn.to_array(),
        }));
    }

    fn light(&mut self, light: &Light) {
        let along = |direction: Vec3| Quat::from_rotation_arc(-Vec3::Z, direction).to_array();
        // The largest component is the intensity.
        let bright = |power: Vec3| {
            let largest = power.max_element();
            let color = if largest > 0.0 {
                power / largest
            } else {
                Vec3::ONE
            };
            (color.to_array(), largest * LUMENS_PER_WATT)
        };
        let (kind, power, mut node) = match *light {
            Light::Directional {
                direction,
                irradiance,
            } => (
                "directional",
                irradiance,
                json!({ "rotation": along(direction) }),
            ),
            Light::Point {
                position,
                intensity,
            } => (
                "point",
                intensity,
                json!({ "translation": position.to_array() }),
            ),
            Light::Spot {
                position,
                direction,
                intensity,
                ..
            } => {
                let place = json!({
                    "translation": position.to_array(), "rotation": along(direction),
                });
                ("spot", intensity, place)
            }
        };
        let (color, intensity) = bright(power);
        let mut written = json!({ "type": kind, "color": color, "intensity": intensity });
        if let Light::Spot {
            inner_deg,
            outer_deg,
            ..
        } = *light
        {
            written["spot"] = json!({
                "innerConeAngle": inner_deg.to_radians(), "outerConeAngle": outer_deg.to_radians(),
            });
        }
        self.lights.push(written);
        node["extensions"] = json!({ "KHR_lights_punctual": { "light": self.lights.len() - 1 } });
        self.nodes.push(node);
    }

    fn material(&mut self, scene: &Scene, number: usize) -> Value {
        let material = &scene.materials[number];
        let picture = |index: Option<u32>| {
            index
                .map(|index| &*scene.textures[index as usize])
                .map(picture_of)
        };
        let named =
            |index: Option<u32>| index.map_or("", |index| &*scene.textures[index as usize].name);
        // Coverage goes to the alpha of the colour.
        let base = match (material.albedo_texture, material.mask_texture) {
            (color, Some(mask)) => {
                let key = Key::Masked(color, mask);
                let pictures = [picture(color), picture(Some(mask))];
                let name = named(color.or(Some(mask)));
                Some(self.texture(key, || Recipe::ColorAndAlpha.make(name, pictures)))
            }
            (Some(color), None) => Some(self.plain(scene, color)),
            (None, None) => None,
        };
        let [r, g, b] = material.albedo.to_array();
        let info = |index: usize| json!({ "index": index });
        let mut written = json!({ "name": material.name });
        let mut extensions = serde_json::Map::new();
        if let Some(lobe) = material.specular.filter(|lobe| lobe.texture.is_some()) {
            // What metal takes from the diffuse colour is in the texture of F0.
            let diffuse = material.albedo * (1.0 - lobe.metalness);
            let f0 = if lobe.metalness > 0.0 {
                Vec3::ONE
            } else {
                lobe.f0
            };
            let glossy = self.specular_glossy(scene, material, (&lobe, number));
            let mut glossy = json!({
                "diffuseFactor": [diffuse.x, diffuse.y, diffuse.z, 1.0],
                "specularFactor": f0.to_array(),
                "glossinessFactor": 1.0, "specularGlossinessTexture": info(glossy),
            });
            if let Some(base) = base {
                glossy["diffuseTexture"] = info(base);
            }
            self.uses_specular_glossy = true;
            extensions.insert("KHR_materials_pbrSpecularGlossiness".to_owned(), glossy);
        } else {
            let none = Specular {
                roughness: 1.0,
                ..Specular::default()
            };
            let lobe = material.specular.unwrap_or(none);
            written["pbrMetallicRoughness"] = json!({
                "baseColorFactor": [r, g, b, 1.0], "metallicFactor": lobe.metalness,
                "roughnessFactor": lobe.roughness,
            });
            if let Some(base) = base {
                written["pbrMetallicRoughness"]["baseColorTexture"] = info(base);
            }
            // F0 is 0.04 times this colour.
            let specular = json!({
                "specularFactor": 1.0, "specularColorFactor": (lobe.f0 / 0.04).to_array(),
            });
            extensions.insert("KHR_materials_specular".to_owned(), specular);
        }
        if material.mask_texture.is_some() {
            written["alphaMode"] = json!("MASK");
        }
        if let Some(normal) = material.normal_texture {
            written["normalTexture"] = info(self.plain(scene, normal));
        }
        let strength = material.emission.max_element();
        if strength > 0.0 {
            written["emissiveFactor"] = json!((material.emission / strength).to_array());
            let strength = json!({ "emissiveStrength": strength });
            extensions.insert("KHR_materials_emissive_strength".to_owned(), strength);
            if let Some(emission) = material.emission_texture {
                written["emissiveTexture"] = info(self.plain(scene, emission));
            }
        }
        written["extensions"] = Value::Object(extensions);
        written
    }

    /// The lobe's texture with glossiness in place of roughness; where there is metal, with all of
    /// F0.
    fn specular_glossy(
        &mut self,
        scene: &Scene,
        material: &Material,
        (lobe, number): (&Specular, usize),
    ) -> usize {
        let texture = &*scene.textures[lobe.texture.unwrap_or(0) as usize];
        let base = material
            .albedo_texture
            .map(|index| &*scene.textures[index as usize]);
        let base = base.filter(|_| lobe.metalness > 0.0);
        self.texture(Key::Lobe(number), || {
            let width = base.map_or(0, |base| base.width).max(texture.width);
            let height = base.map_or(0, |base| base.height).max(texture.height);
            let at = |texture: &Texture, index: u32| {
                let (x, y) = (index % width, index / width);
                if [texture.width, texture.height] == [width, height] {
                    return texture.texel(x.into(), y.into());
                }
                let u = (x as f32 + 0.5) / width as f32;
                texture.sample(u, 1.0 - (y as f32 + 0.5) / height as f32)
            };
            let texel = |index: u32| {
                let of_lobe = at(texture, index);
                let mut f0 = of_lobe.truncate();
                if lobe.metalness > 0.0 {
                    let color = base.map_or(Vec3::ONE, |base| at(base, index).truncate());
                    f0 = (lobe.f0 * f0).lerp(material.albedo * color, lobe.metalness);
                }
                let [r, g, b] = f0.to_array().map(srgb_from_linear);
                [
                    r,
                    g,
                    b,
                    (255.0 * (1.0 - lobe.roughness * of_lobe.w)).round() as u8,
                ]
            };
            Texture {
                width,
                height,
                texels: (0..width * height).map(texel).collect(),
                ..texture.clone()
            }
        })
    }

    fn plain(&mut self, scene: &Scene, index: u32) -> usize {
        let texture = &*scene.textures[index as usize];
        self.texture(Key::Plain(index), || texture.clone())
    }

    /// The index of a texture, which is made once.
    fn texture(&mut self, key: Key, make: impl FnOnce() -> Texture) -> usize {
        if let Some(index) = self.index_from_textures.get(&key) {
            return *index;
        }
        let texture = make();
        let file = format!("textures/{}.png", self.names.unique(&stem(&texture.name)));
        self.files.push((file, texture));
        self.index_from_textures.insert(key, self.files.len() - 1);
        self.files.len() - 1
    }
}

fn picture_of(texture: &Texture) -> Picture {
    (texture.width, texture.height, texture.texels.clone())
}

/// Characters of names that are written as their codes.
const NOT_IN_URIS: &percent_encoding::AsciiSet = &percent_encoding::CONTROLS
    .add(b' ')
    .add(b'%')
    .add(b'#')
    .add(b'?')
    .add(b':')
    .add(b'"');
