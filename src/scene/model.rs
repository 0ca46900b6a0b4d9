//! An OBJ with its MTL, as one part of a scene.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{Affine3A, DAffine3, DVec3, Mat3, Vec3};

use super::assemble::Part;
use super::mtl::{self, MtlMaterial, UvShift};
use super::obj::{Corner, NONE, Obj};
use super::textures::TextureRequests;
use super::toml::COORDINATE_MAX;
use super::{
    Keyframe, LoadOptions, Material, Pose, Scene, SceneError, Triangle, Up, Vertex, paths,
};
use crate::text::{counted, number, vector};

/// Normals whose squared length is this close to 1 stay as they are, so that loading what was
/// written changes no bit.
const UNIT_TOLERANCE: f32 = 1e-6;

/// Least extent of a model \[m\]: 32-bit products of smaller lengths have no digits left.
pub(super) const EXTENT_MIN: f32 = 1e-9;

/// Where a model stands: scaled, then posed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    /// Uniform scale, positive.
    pub(super) scale: f32,
    /// Rotation and translation.
    pub(super) pose: Pose,
}

impl Default for Placement {
    fn default() -> Self {
        Placement {
            scale: 1.0,
            pose: Pose::default(),
        }
    }
}

impl Placement {
    /// The transform, or `None` where it changes nothing.
    fn world_from_model(&self) -> Option<Affine3A> {
        let Pose { translate, .. } = self.pose;
        (*self != Placement::default()).then(|| {
            Affine3A::from_scale_rotation_translation(
                Vec3::splat(self.scale),
                self.pose.rotation(),
                translate,
            )
        })
    }
}

/// Triangles of a model that are left out or completed, for one warning each.
#[derive(Default)]
struct Counts {
    zero_area: usize,
    without_material: usize,
    removed: usize,
    without_normal: usize,
}

/// What a scene says about a model.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Use {
    /// Where it stands.
    pub(super) placement: Placement,
    /// Whether it may move.
    pub(super) dynamic: bool,
    /// Where it stands at which time, in place of the placement's pose.
    pub(super) keyframes: Vec<Keyframe>,
    /// The axis of the file that points up.
    pub(super) up: Up,
}

impl Use {
    /// World from the model's space before any keyframe is applied.
    pub(super) fn world_from_model_at_rest(&self) -> DAffine3 {
        let pose = match self.keyframes.is_empty() {
            true => self.placement.pose,
            false => Pose::default(),
        };
        DAffine3::from_scale_rotation_translation(
            DVec3::splat(f64::from(self.placement.scale)),
            pose.rotation().as_dquat(),
            pose.translate.as_dvec3(),
        )
    }
}

/// Loads the OBJ file at `path` with its materials, and places it as `model` says.
pub(super) fn load(
    path: &Path,
    model: &Use,
    requests: &mut TextureRequests,
    options: &LoadOptions,
) -> Result<Part, SceneError> {
    requests.add_source(path);
    let text = paths::read_text(path)?;
    let mut obj = Obj::parse(path, &text)?;
    if model.up == Up::Z {
        obj.turn_z_up();
    }
    if obj.triangles.is_empty() {
        return Err(SceneError::file(
            path,
            "there are no faces in it",
            "give an OBJ file with `f` lines",
        ));
    }
    Scene::check_counts(path, 3 * obj.triangles.len(), obj.triangles.len())?;
    let materials = Materials::load(path, &obj, requests, options)?;
    let mut builder = Builder {
        obj: &obj,
        materials: &materials,
        part: Part::default(),
        positions: Vec::new(),
        index_from_corner: HashMap::new(),
        counts: Counts::default(),
    };
    for (index, (corners, name)) in obj.triangles.iter().enumerate() {
        builder.add(index as u32, corners, *name);
    }
    let Builder {
        mut part,
        positions,
        mut counts,
        ..
    } = builder;
    let origin = Origin {
        path,
        obj: &obj,
        positions: &positions,
    };
    for keyframe in &model.keyframes {
        let placement = Placement {
            pose: keyframe.pose,
            ..model.placement
        };
        origin.place(&mut part.clone(), &placement)?;
    }
    let rest = Placement {
        pose: Pose::default(),
        ..model.placement
    };
    let placement = match model.keyframes.is_empty() {
        true => &model.placement,
        false => &rest,
    };
    origin.place(&mut part, placement)?;
    origin.check_extent(&part, placement)?;
    counts.zero_area += part.drop_triangles_without_area();
    warn(path, &obj, &counts);
    if part.triangles.is_empty() {
        return Err(SceneError::file(
            path,
            "all of its triangles have no area or are removed by `d`",
            "check the model's scale and materials",
        ));
    }
    part.name = paths::stem_of(path);
    part.dynamic = model.dynamic;
    part.keyframes.clone_from(&model.keyframes);
    part.materials = materials.list;
    Ok(part)
}

fn warn(path: &Path, obj: &Obj, counts: &Counts) {
    let path = path.display();
    if let (count @ 1.., line) = obj.crossing {
        log::warn!(
            "{path}:{line}: faces that cross themselves: {count}, this one first; they are split \
             into triangles as well as can be"
        );
    }
    if counts.zero_area > 0 {
        log::warn!(
            "{path}: dropped {} without area",
            counted(counts.zero_area, "triangle")
        );
    }
    if counts.without_material > 0 {
        log::warn!(
            "{path}: {} without a known material; a grey one is taken",
            counted(counts.without_material, "triangle")
        );
    }
    if counts.removed > 0 {
        log::warn!(
            "{path}: dropped {} whose material has `d` 0 and no filter: nothing is there",
            counted(counts.removed, "triangle")
        );
    }
    if counts.without_normal > 0 {
        log::info!(
            "{path}: {} with corners without a normal; those get the face normal",
            counted(counts.without_normal, "triangle")
        );
    }
}

/// Where the vertices of a part come from, for messages.
struct Origin<'a> {
    path: &'a Path,
    obj: &'a Obj,
    /// Index of each vertex's position in the file.
    positions: &'a [u32],
}

impl Origin<'_> {
    fn place(&self, part: &mut Part, placement: &Placement) -> Result<(), SceneError> {
        if let Some(world_from_model) = placement.world_from_model() {
            let rotation = Mat3::from(world_from_model.matrix3) * (1.0 / placement.scale);
            for vertex in &mut part.vertices {
                vertex.position = world_from_model
                    .transform_point3(Vec3::from(vertex.position))
                    .to_array();
                vertex.normal = (rotation * Vec3::from(vertex.normal))
                    .normalize()
                    .to_array();
            }
        }
        let is_far = |vertex: &Vertex| {
            let reach = Vec3::from(vertex.position).abs();
            !reach.cmple(Vec3::splat(COORDINATE_MAX)).all()
        };
        let Some(index) = part.vertices.iter().position(is_far) else {
            return Ok(());
        };
        let problem = format!(
            "is at {}{}, further than {} m from the origin",
            vector(part.vertices[index].position),
            after(placement),
            number(COORDINATE_MAX)
        );
        Err(self.error(index, &problem, "use a smaller scale, nearer to the origin"))
    }

    /// An error where the model is too small to compute with.
    fn check_extent(&self, part: &Part, placement: &Placement) -> Result<(), SceneError> {
        let extent_m = part.extent_m();
        // What has no extent at all has no area either, which is said later.
        if extent_m == 0.0 || extent_m >= EXTENT_MIN {
            return Ok(());
        }
        let problem = format!(
            "and all others lie within {} m{}, less than {} m",
            number(extent_m),
            after(placement),
            number(EXTENT_MIN)
        );
        Err(self.error(0, &problem, "use a larger scale: coordinates are metres"))
    }

    fn error(&self, vertex: usize, problem: &str, hint: &str) -> SceneError {
        let position = self.positions[vertex] as usize;
        SceneError::line(
            self.path,
            self.obj.position_lines[position] as usize,
            format!("vertex {} {problem}", position + 1),
            hint,
        )
    }
}

/// What has been done to coordinates since they were read.
fn after(placement: &Placement) -> &'static str {
    if *placement == Placement::default() {
        ""
    } else {
        " after `scale` and `translate`"
    }
}

/// The materials of an OBJ: those that its `usemtl` lines name, in that order, then the default
/// material.
struct Materials {
    list: Vec<Material>,
    removed: Vec<bool>,
    known: Vec<bool>,
    /// What a material's maps do to texture coordinates; `None` for nothing.
    shifts: Vec<Option<UvShift>>,
}

impl Materials {
    fn load(
        path: &Path,
        obj: &Obj,
        requests: &mut TextureRequests,
        options: &LoadOptions,
    ) -> Result<Materials, SceneError> {
        let mut from_name: HashMap<String, (PathBuf, MtlMaterial)> = HashMap::new();
        for file in library_files(path, obj, options)? {
            requests.add_source(&file);
            for material in mtl::parse(&file, &paths::read_text(&file)?)? {
                from_name
                    .entry(material.name.clone())
                    .or_insert_with(|| (file.clone(), material));
            }
        }
        let mut materials = Materials {
            list: Vec::new(),
            removed: Vec::new(),
            known: Vec::new(),
            shifts: Vec::new(),
        };
        let (mut matt, mut torn) = (Vec::new(), Vec::new());
        for (name, line) in &obj.material_names {
            let Some((file, material)) = from_name.get(name) else {
                log::warn!(
                    "{}:{line}: no material is called `{name}`; a grey one stands in",
                    path.display()
                );
                materials.push(
                    Material {
                        name: name.clone(),
                        ..Material::default()
                    },
                    false,
                    false,
                    None,
                );
                continue;
            };
            let (converted, specular_ignored) = material.to_material();
            if specular_ignored {
                matt.push(format!("`{name}`"));
            }
            let (shift, is_torn) = material.uv_shift();
            if let Some(shift) = shift {
                shift.check(file, &obj.texcoords)?;
            }
            if is_torn {
                torn.push(format!("`{name}`"));
            }
            materials.push(
                requests.texture(file, material, converted),
                material.is_nothing(),
                true,
                shift,
            );
        }
        materials.push(
            Material {
                name: free_name(obj, Material::default().name),
                ..Material::default()
            },
            false,
            false,
            None,
        );
        if !torn.is_empty() {
            log::warn!(
                "{}: the maps of a material share their texture coordinates; `-s` and `-o` differ \
                 between maps, and those of the first map stand: {}",
                path.display(),
                torn.join(", ")
            );
        }
        if !matt.is_empty() {
            log::warn!(
                "{}: `Ks` without `Pr` or `Ns` does not say how rough it is and is ignored: {}",
                path.display(),
                matt.join(", ")
            );
        }
        Ok(materials)
    }

    fn push(&mut self, material: Material, removed: bool, known: bool, shift: Option<UvShift>) {
        self.list.push(material);
        self.removed.push(removed);
        self.known.push(known);
        self.shifts.push(shift);
    }
}

/// A name that no material of the model has.
fn free_name(obj: &Obj, mut name: String) -> String {
    while obj.material_names.iter().any(|(taken, _)| *taken == name) {
        name.push('_');
    }
    name
}

/// The MTL files of all `mtllib` lines; an argument is one file name with spaces where that exists,
/// else several names.
fn library_files(
    path: &Path,
    obj: &Obj,
    options: &LoadOptions,
) -> Result<Vec<PathBuf>, SceneError> {
    let folder = paths::folder_of(path);
    let mut files = Vec::new();
    for (argument, line) in &obj.libraries {
        if let Some(file) = paths::resolve(folder, argument).filter(|_| !argument.is_empty()) {
            files.push(file);
            continue;
        }
        for name in argument.split_whitespace() {
            if let Some(file) = paths::resolve(folder, name) {
                files.push(file);
                continue;
            }
            let problem = match paths::not_a_file(&folder.join(name)) {
                Some(kind) => format!("the material file `{name}` is {kind}, not a file"),
                None => format!("the material file `{name}` does not exist"),
            };
            if !options.allow_missing_textures {
                return Err(SceneError::line(
                    path,
                    *line,
                    problem,
                    "put it beside the OBJ, or pass --allow-missing-textures for grey materials",
                ));
            }
            log::warn!(
                "{}:{line}: {problem}; grey materials stand in",
                path.display()
            );
        }
    }
    Ok(files)
}

/// Turns OBJ corners into vertices; equal corners share one.
struct Builder<'a> {
    obj: &'a Obj,
    materials: &'a Materials,
    part: Part,
    /// Index of each vertex's position in the file.
    positions: Vec<u32>,
    /// By corner, face where that gives the normal, and material where that shifts coordinates.
    index_from_corner: HashMap<(Corner, u32, u32), u32>,
    counts: Counts,
}

impl Builder<'_> {
    fn add(&mut self, triangle: u32, corners: &[Corner; 3], name: u32) {
        let material = if name == NONE {
            self.materials.list.len() as u32 - 1
        } else {
            name
        };
        if self.materials.removed[material as usize] {
            self.counts.removed += 1;
            return;
        }
        let Some(face_normal) = self.face_normal(corners) else {
            self.counts.zero_area += 1;
            return;
        };
        self.counts.without_material += usize::from(!self.materials.known[material as usize]);
        let normals = corners.map(|corner| self.corner_normal(corner));
        self.counts.without_normal += usize::from(normals.contains(&None));
        let mut vertices = [0; 3];
        for ((vertex, corner), normal) in vertices.iter_mut().zip(corners).zip(normals) {
            let flat_face = if normal.is_some() { NONE } else { triangle };
            *vertex = self.vertex(*corner, flat_face, material, normal.unwrap_or(face_normal));
        }
        self.part.triangles.push(Triangle { vertices, material });
    }

    fn vertex(&mut self, corner: Corner, flat_face: u32, material: u32, normal: Vec3) -> u32 {
        let vertices = &mut self.part.vertices;
        let shift = self.materials.shifts[material as usize].as_ref();
        let shifted_by = if shift.is_some() { material } else { NONE };
        *self
            .index_from_corner
            .entry((corner, flat_face, shifted_by))
            .or_insert_with(|| {
                let written = if corner.texcoord == NONE {
                    [0.0; 2]
                } else {
                    self.obj.texcoords[corner.texcoord as usize]
                };
                let [u, v] = shift.map_or(written, |shift| shift.apply(written));
                self.positions.push(corner.position);
                let position = self.obj.positions[corner.position as usize].to_array();
                vertices.push(Vertex {
                    position,
                    u,
                    normal: normal.to_array(),
                    v,
                });
                vertices.len() as u32 - 1
            })
    }

    /// The file's normal, of unit length; `None` where there is none or it has no length.
    fn corner_normal(&self, corner: Corner) -> Option<Vec3> {
        let normal = *self.obj.normals.get(corner.normal as usize)?;
        let length_squared = normal.length_squared();
        if (length_squared - 1.0).abs() <= UNIT_TOLERANCE {
            Some(normal)
        } else {
            unit(normal.as_dvec3())
        }
    }

    fn face_normal(&self, corners: &[Corner; 3]) -> Option<Vec3> {
        let [a, b, c] =
            corners.map(|corner| self.obj.positions[corner.position as usize].as_dvec3());
        unit((b - a).cross(c - a))
    }
}

fn unit(vector: DVec3) -> Option<Vec3> {
    vector.try_normalize().map(DVec3::as_vec3)
}
