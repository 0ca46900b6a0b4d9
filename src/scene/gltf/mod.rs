//! glTF 2.0 (`.gltf`, `.glb`): meshes, materials, cameras, lights and motion.
//!
//! Read are node trees, instances, metal-rough and specular-glossy materials, alpha masks, normal
//! maps, emission and its strength, index of refraction, texture transforms, lights of
//! `KHR_lights_punctual`, quantized and sparse accessors, and the first animation as keyframes.
//! Skins stand still. What is not done is one warning each.
//!
//! Candela and lux become W/sr and W/m² by the 683 lm/W of light of 555 nm, as Blender writes them.
//! Emission is radiance as it is, which is what Blender writes, too.

mod file;
mod geometry;
mod materials;
mod nodes;
mod write;

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DAffine3, DMat4, DQuat, DVec3, EulerRot, Vec3};
use gltf::camera::Projection;
use gltf::khr_lights_punctual::Kind;

use self::file::File;
use self::geometry::{Builder, Counts, Place};
use self::materials::Reader;
use self::nodes::Nodes;
use super::assemble::Part;
use super::light::LIGHT_MAX;
use super::model::{EXTENT_MIN, Use};
use super::textures::TextureRequests;
use super::toml::COORDINATE_MAX;
use super::{Camera, Keyframe, Light, Motion, Pose, SceneError, paths};
use crate::text::{counted, number};

/// Lumens in a watt of light of 555 nm, by which exporters of radiometric units multiply.
const LUMENS_PER_WATT: f32 = 683.0;

/// Half angle of a spot's cone that is wider than any here \[degrees\].
const OUTER_MAX_DEG: f32 = 89.9;

/// Extensions that have been read, or that change nothing here.
const KNOWN: [&str; 9] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
];

/// What a file holds, in world space.
#[derive(Default)]
pub(super) struct Contents {
    /// What stands still, then one for each motion.
    pub(super) parts: Vec<Part>,
    /// The first camera.
    pub(super) camera: Option<Camera>,
    /// All lights.
    pub(super) lights: Vec<Light>,
}

/// Things that are not done: what, and how often.
#[derive(Default)]
struct Undone(BTreeMap<String, usize>);

impl Undone {
    fn add(&mut self, what: impl Into<String>) {
        *self.0.entry(what.into()).or_default() += 1;
    }
}

/// Whether a path is named as a glTF file.
pub(super) fn is_named(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    extension.eq_ignore_ascii_case("gltf") || extension.eq_ignore_ascii_case("glb")
}

/// Loads a file with its materials, and places it as `model` says. Where that moves the model or
/// lets it move, all of it is one part, and its own motion is left out.
pub(super) fn load(
    path: &Path,
    model: &Use,
    requests: &mut TextureRequests,
) -> Result<Contents, SceneError> {
    let file = File::read(path)?;
    file.files.iter().for_each(|file| requests.add_source(file));
    let mut undone = Undone::default();
    for name in file.document.extensions_used() {
        if !KNOWN.contains(&name) {
            undone.add(format!("the extension {name}"));
        }
    }
    let nodes = Nodes::read(&file, &mut undone)?;
    let materials = Reader::new(&file, requests, &mut undone).read()?;
    let mut builder = Builder {
        file: &file,
        materials: &materials,
        undone: &mut undone,
        counts: Counts::default(),
    };
    let mut parts = Parts {
        nodes: &nodes,
        world: model.world_from_model_at_rest(),
        moves_itself: !model.dynamic && model.keyframes.is_empty(),
        still: Part::default(),
        moving: Vec::new(),
    };
    let mut contents = Contents::default();
    for &index in &nodes.order {
        let Some(node) = file.document.nodes().nth(index) else {
            continue;
        };
        parts.add_node(&node, &mut builder)?;
        let place = parts.world * nodes.world(index, 0.0);
        if node.camera().is_some() || node.light().is_some() {
            check_place(&file, index, place.translation)?;
        }
        if let Some(camera) = node.camera() {
            take_camera(&mut contents.camera, &camera, &place, builder.undone);
        }
        if let Some(light) = node.light() {
            contents.lights.push(light_of(&file, &light, &place)?);
        }
        let shines_or_sees = node.camera().is_some() || node.light().is_some();
        if shines_or_sees && nodes.driver(index).is_some() {
            builder
                .undone
                .add("cameras and lights that move: they stay where they begin");
        }
    }
    let mut counts = builder.counts;
    let Parts { still, moving, .. } = parts;
    let still = Part {
        name: paths::stem_of(path),
        dynamic: model.dynamic,
        keyframes: model.keyframes.clone(),
        ..still
    };
    for mut part in std::iter::once(still).chain(moving.into_iter().map(|moving| moving.part)) {
        let extent_m = part.extent_m();
        if extent_m > 0.0 && extent_m < EXTENT_MIN {
            return Err(SceneError::file(
                path,
                format!(
                    "`{}` lies within {} m, less than {} m",
                    part.name,
                    number(extent_m),
                    number(EXTENT_MIN)
                ),
                "use a larger scale: coordinates are metres",
            ));
        }
        counts.zero_area += part.drop_triangles_without_area();
        if !part.keyframes.is_empty() {
            // Far from the origin they may lose it by rounding.
            let motion = Motion {
                first_vertex: 0,
                rest: part.vertices.clone(),
                keyframes: part.keyframes.clone(),
            };
            part.vertices = motion.vertices_at(0.0).collect();
            counts.zero_area += part.drop_triangles_without_area();
            part.vertices = motion.rest;
        }
        part.materials.clone_from(&materials.list);
        if !part.triangles.is_empty() {
            contents.parts.push(part);
        }
    }
    warn(path, &counts, &undone);
    match contents.parts.is_empty() {
        true => Err(SceneError::file(
            path,
            "there are no triangles in it that have an area and that alpha does not remove",
            "check its meshes and materials, and the model's scale",
        )),
        false => Ok(contents),
    }
}

/// The parts of a file while they grow.
struct Parts<'a> {
    nodes: &'a Nodes,
    /// World from the file's space.
    world: DAffine3,
    /// Whether the file's own motion counts.
    moves_itself: bool,
    still: Part,
    moving: Vec<Moving>,
}

/// All meshes below one node that moves, down to the next one.
struct Moving {
    driver: usize,
    rest_from_world: DAffine3,
    part: Part,
}

impl Parts<'_> {
    fn add_node(&mut self, node: &gltf::Node, builder: &mut Builder) -> Result<(), SceneError> {
        let Some(mesh) = node.mesh() else {
            return Ok(());
        };
        if let Some(skin) = node.skin() {
            builder
                .undone
                .add("skins that move: they stand still as at the beginning");
            let joints = self.joints(&skin, builder.file)?;
            return builder.add(&mut self.still, &mesh, &Place::Skinned(&joints));
        }
        let world = self.world * self.nodes.world(node.index(), 0.0);
        match self.moving_part(node, builder.file, builder.undone)? {
            None => builder.add(&mut self.still, &mesh, &Place::Rigid(world)),
            Some(at) => {
                let moving = &mut self.moving[at];
                let place = Place::Rigid(moving.rest_from_world * world);
                builder.add(&mut moving.part, &mesh, &place)
            }
        }
    }

    /// World from the space of a skinned mesh, by joint.
    fn joints(&self, skin: &gltf::Skin, file: &File) -> Result<Vec<DMat4>, SceneError> {
        let bind = match skin.inverse_bind_matrices() {
            Some(accessor) => file.arrays::<16>(&accessor)?,
            None => Vec::new(),
        };
        let world = |(at, joint): (usize, gltf::Node)| {
            let joint_from_mesh = bind.get(at).map_or(DMat4::IDENTITY, |matrix| {
                DMat4::from_cols_array(&matrix.map(f64::from))
            });
            DMat4::from(self.world * self.nodes.world(joint.index(), 0.0)) * joint_from_mesh
        };
        Ok(skin.joints().enumerate().map(world).collect())
    }

    /// The part that a node's mesh moves with; `None` where it stands still.
    fn moving_part(
        &mut self,
        node: &gltf::Node,
        file: &File,
        undone: &mut Undone,
    ) -> Result<Option<usize>, SceneError> {
        let Some(driver) = self.nodes.driver(node.index()) else {
            return Ok(None);
        };
        if !self.moves_itself {
            undone.add("motion within a model that moves as a whole");
            return Ok(None);
        }
        let known = self
            .moving
            .iter()
            .position(|moving| moving.driver == driver);
        if known.is_some() {
            return Ok(known);
        }
        if self.nodes.scales(driver) {
            undone.add("scales that change: they stay as they begin");
        }
        let rigid = |time_s| rigid(&(self.world * self.nodes.world(driver, time_s)));
        let keyframe = |time_s: f32| {
            let (rotation, translate) = rigid(f64::from(time_s));
            let (z, y, x) = rotation.to_euler(EulerRot::ZYX);
            let rotate_deg = DVec3::new(x, y, z).map(f64::to_degrees).as_vec3();
            Keyframe {
                time_s,
                pose: Pose {
                    rotate_deg,
                    translate: translate.as_vec3(),
                },
            }
        };
        let keyframes: Vec<Keyframe> = self.nodes.times(driver).into_iter().map(keyframe).collect();
        let is_still = |pair: &[Keyframe]| pair[0].pose == pair[1].pose;
        for keyframe in &keyframes {
            check_place(file, driver, keyframe.pose.translate.as_dvec3())?;
        }
        if keyframes.windows(2).all(is_still) {
            return Ok(None);
        }
        let (rotation, translate) = rigid(0.0);
        let name = node.name().or(node.mesh().and_then(|mesh| mesh.name()));
        self.moving.push(Moving {
            driver,
            rest_from_world: DAffine3::from_rotation_translation(rotation, translate).inverse(),
            part: Part {
                name: name.unwrap_or("moving").to_owned(),
                dynamic: true,
                keyframes,
                ..Part::default()
            },
        });
        Ok(Some(self.moving.len() - 1))
    }
}

/// An error where a node is out of reach of 32-bit numbers.
fn check_place(file: &File, node: usize, place: DVec3) -> Result<(), SceneError> {
    if place
        .abs()
        .cmple(DVec3::splat(f64::from(COORDINATE_MAX)))
        .all()
    {
        return Ok(());
    }
    let problem = format!("is not within {} m of the origin", number(COORDINATE_MAX));
    Err(file.error(&format!("nodes[{node}]"), &problem))
}

/// How a transform turns and moves, without its scale.
fn rigid(world: &DAffine3) -> (DQuat, DVec3) {
    let (_, rotation, translate) = world.to_scale_rotation_translation();
    (rotation, translate)
}

/// The first camera is taken.
fn take_camera(
    taken: &mut Option<Camera>,
    camera: &gltf::Camera,
    place: &DAffine3,
    undone: &mut Undone,
) {
    let Projection::Perspective(perspective) = camera.projection() else {
        undone.add("orthographic cameras");
        return;
    };
    if taken.is_some() {
        undone.add("cameras after the first");
        return;
    }
    let eye = place.translation.as_vec3();
    // Far enough for eye and target to be two points.
    let length_m = (1e-3 * eye.abs().max_element()).max(1.0);
    let forward = -place.matrix3.z_axis.normalize_or(DVec3::Z).as_vec3();
    *taken = Some(Camera {
        eye,
        target: eye + length_m * forward,
        up: place.matrix3.y_axis.normalize_or(DVec3::Y).as_vec3(),
        vfov_deg: perspective.yfov().to_degrees().clamp(1.0, 175.0),
    });
}

fn light_of(
    file: &File,
    light: &gltf::khr_lights_punctual::Light,
    place: &DAffine3,
) -> Result<Light, SceneError> {
    let power = Vec3::from(light.color()) * (light.intensity() / LUMENS_PER_WATT);
    if !power.cmpge(Vec3::ZERO).all() || !power.cmple(Vec3::splat(LIGHT_MAX)).all() {
        let name = format!("extensions.KHR_lights_punctual.lights[{}]", light.index());
        return Err(file.error(&name, "is no light from 0 to 1e12 W"));
    }
    let position = place.translation.as_vec3();
    let direction = -place.matrix3.z_axis.normalize_or(DVec3::Z).as_vec3();
    Ok(match light.kind() {
        Kind::Directional => Light::Directional {
            direction,
            irradiance: power,
        },
        Kind::Point => Light::Point {
            position,
            intensity: power,
        },
        Kind::Spot {
            inner_cone_angle,
            outer_cone_angle,
        } => {
            let outer_deg = outer_cone_angle.to_degrees().clamp(0.1, OUTER_MAX_DEG);
            Light::Spot {
                position,
                direction,
                intensity: power,
                inner_deg: inner_cone_angle.to_degrees().clamp(0.0, outer_deg),
                outer_deg,
            }
        }
    })
}

fn warn(path: &Path, counts: &Counts, undone: &Undone) {
    let path = path.display();
    for (what, count) in &undone.0 {
        log::warn!("{path}: not done ({}): {what}", counted(*count, "place"));
    }
    let triangles = [
        (counts.zero_area, "dropped", "without area"),
        (counts.removed, "dropped", "that alpha removes"),
        (
            counts.without_material,
            "gave grey to",
            "without a material",
        ),
    ];
    for (count, what, which) in triangles.into_iter().filter(|(count, ..)| *count > 0) {
        log::warn!("{path}: {what} {} {which}", counted(count, "triangle"));
    }
}
