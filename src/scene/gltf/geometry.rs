//! Meshes of nodes as triangles of a part.

use glam::{DAffine3, DMat3, DMat4, DVec3, Vec2, Vec3};
use gltf::mesh::Mode;

use super::super::assemble::Part;
use super::super::obj::TEXCOORD_MAX;
use super::super::toml::COORDINATE_MAX;
use super::super::{SceneError, Triangle, Vertex};
use super::Undone;
use super::file::File;
use super::materials::Materials;
use crate::text::{number, vector};

/// Triangles that are left out or completed, for one warning each.
#[derive(Default)]
pub(super) struct Counts {
    /// Without area.
    pub(super) zero_area: usize,
    /// Without a material.
    pub(super) without_material: usize,
    /// Removed by alpha.
    pub(super) removed: usize,
}

/// How the vertices of a mesh come to where they are.
pub(super) enum Place<'a> {
    /// They all move together.
    Rigid(DAffine3),
    /// By joints: world from the mesh's space, by joint.
    Skinned(&'a [DMat4]),
}

/// Adds meshes to parts.
pub(super) struct Builder<'a> {
    /// The file.
    pub(super) file: &'a File,
    /// All materials.
    pub(super) materials: &'a Materials,
    /// What is not done.
    pub(super) undone: &'a mut Undone,
    /// What is left out.
    pub(super) counts: Counts,
}

/// What a primitive's vertices are, before they are placed.
struct Source {
    positions: Vec<[f32; 3]>,
    normals: Option<Vec<[f32; 3]>>,
    texcoords: Option<Vec<[f32; 2]>>,
    joints: Vec<[f32; 4]>,
    weights: Vec<[f32; 4]>,
}

impl Builder<'_> {
    /// Adds a mesh; what has no triangles is passed over.
    pub(super) fn add(
        &mut self,
        part: &mut Part,
        mesh: &gltf::Mesh,
        place: &Place,
    ) -> Result<(), SceneError> {
        for primitive in mesh.primitives() {
            if primitive.morph_targets().len() > 0 {
                self.undone
                    .add("morph targets: shapes stay as they are without them");
            }
            if primitive.get(&gltf::Semantic::Colors(0)).is_some() {
                self.undone.add("colours of vertices");
            }
            let name = format!("meshes[{}].primitives[{}]", mesh.index(), primitive.index());
            self.add_primitive(part, &primitive, place, &name)?;
        }
        Ok(())
    }

    fn add_primitive(
        &mut self,
        part: &mut Part,
        primitive: &gltf::Primitive,
        place: &Place,
        name: &str,
    ) -> Result<(), SceneError> {
        let file = self.file;
        let Some(positions) = primitive.get(&gltf::Semantic::Positions) else {
            return Err(file.error(name, "has no positions"));
        };
        let material = primitive.material().index();
        let slot = material.unwrap_or(self.materials.list.len() - 1);
        let lookup = &self.materials.lookups[slot];
        let texcoords = primitive
            .get(&gltf::Semantic::TexCoords(lookup.set))
            .map(|accessor| file.arrays::<2>(&accessor))
            .transpose()?;
        let arrays4 = |semantic| match primitive.get(&semantic) {
            Some(accessor) if matches!(place, Place::Skinned(_)) => file.arrays::<4>(&accessor),
            _ => Ok(Vec::new()),
        };
        let source = Source {
            positions: file.arrays::<3>(&positions)?,
            normals: primitive
                .get(&gltf::Semantic::Normals)
                .map(|accessor| file.arrays::<3>(&accessor))
                .transpose()?,
            texcoords,
            joints: arrays4(gltf::Semantic::Joints(0))?,
            weights: arrays4(gltf::Semantic::Weights(0))?,
        };
        if primitive.get(&gltf::Semantic::Joints(1)).is_some() {
            self.undone.add("more than four joints a vertex");
        }
        let indices: Vec<usize> = match primitive.indices() {
            Some(accessor) => file
                .numbers(&accessor)?
                .iter()
                .map(|i| *i as usize)
                .collect(),
            None => (0..source.positions.len()).collect(),
        };
        let count = source.positions.len();
        if indices.iter().any(|index| *index >= count) {
            let problem = format!("has an index beyond its {count} vertices");
            return Err(file.error(name, &problem));
        }
        let lengths = [
            source.normals.as_ref().map_or(count, Vec::len),
            source.texcoords.as_ref().map_or(count, Vec::len),
        ];
        if lengths.iter().any(|length| *length < count) {
            return Err(file.error(
                name,
                "has fewer normals or texture coordinates than positions",
            ));
        }
        let triangles = match triangles_of(primitive.mode(), &indices) {
            Some(triangles) => triangles,
            None => {
                self.undone.add("points and lines");
                return Ok(());
            }
        };
        if self.materials.removed[slot] {
            self.counts.removed += triangles.len();
            return Ok(());
        }
        if material.is_none() {
            self.counts.without_material += triangles.len();
        }
        let (vertices, is_mirrored) = self.place(&source, place, slot, name)?;
        self.append(part, &vertices, &triangles, is_mirrored, slot as u32);
        Ok(())
    }

    /// The vertices where they stand; a normal of length 0 where there is none. The second value
    /// is true where the mesh is mirrored.
    fn place(
        &mut self,
        source: &Source,
        place: &Place,
        slot: usize,
        name: &str,
    ) -> Result<(Vec<Vertex>, bool), SceneError> {
        let lookup = self.materials.lookups[slot];
        let is_mirrored = match place {
            Place::Rigid(world) => world.matrix3.determinant() < 0.0,
            Place::Skinned(_) => false,
        };
        let mut vertices = Vec::with_capacity(source.positions.len());
        let mut leaves_picture = false;
        for (index, position) in source.positions.iter().enumerate() {
            let world = match place {
                Place::Rigid(world) => *world,
                Place::Skinned(joints) => self.blend(source, joints, index, name)?,
            };
            let position = Vec3::from(*position).as_dvec3();
            let position = world.transform_point3(position).as_vec3();
            if !position.abs().cmple(Vec3::splat(COORDINATE_MAX)).all() {
                let problem = format!(
                    "has a vertex at {}, not within {} m of the origin",
                    vector(position.to_array()),
                    number(COORDINATE_MAX)
                );
                return Err(SceneError::file(
                    &self.file.path,
                    format!("`{name}` {problem}"),
                    "use a smaller scale, nearer to the origin",
                ));
            }
            let normal = source.normals.as_ref().map_or(DVec3::ZERO, |normals| {
                let normal = Vec3::from(normals[index]).as_dvec3();
                let turned = cofactor(&world.matrix3) * normal;
                let unit = turned.try_normalize().filter(|unit| unit.is_finite());
                unit.unwrap_or_default() * if is_mirrored { -1.0 } else { 1.0 }
            });
            let texcoord = source.texcoords.as_ref().map_or([0.0; 2], |all| all[index]);
            let is_there = texcoord.iter().all(|number| number.is_finite());
            if !is_there {
                self.undone
                    .add("texture coordinates that are no numbers: 0 is taken");
            }
            let texcoord = if is_there { texcoord } else { [0.0; 2] };
            let uv = lookup.transform.transform_point2(Vec2::from(texcoord));
            if !uv.abs().cmple(Vec2::splat(TEXCOORD_MAX)).all() {
                return Err(self.file.error(name, "has a texture coordinate beyond 1e9"));
            }
            leaves_picture |=
                uv.cmplt(Vec2::splat(-1e-3)).any() || uv.cmpgt(Vec2::splat(1.0 + 1e-3)).any();
            vertices.push(Vertex {
                position: position.to_array(),
                u: uv.x,
                normal: normal.as_vec3().to_array(),
                v: 1.0 - uv.y,
            });
        }
        if lookup.is_clamped && leaves_picture && source.texcoords.is_some() {
            self.undone
                .add("textures that are clamped or mirrored: all are repeated");
        }
        Ok((vertices, is_mirrored))
    }

    /// World from the mesh's space, for one vertex.
    fn blend(
        &self,
        source: &Source,
        joints: &[DMat4],
        index: usize,
        name: &str,
    ) -> Result<DAffine3, SceneError> {
        let (Some(by), Some(weights)) = (source.joints.get(index), source.weights.get(index))
        else {
            return Err(self
                .file
                .error(name, "has a skin, but fewer joints than positions"));
        };
        let sum: f32 = weights.iter().sum();
        let mut world = DMat4::ZERO;
        for (joint, weight) in by.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
            let joint = joints.get(*joint as usize);
            let joint =
                joint.ok_or_else(|| self.file.error(name, "has a joint that is not there"))?;
            world += *joint * f64::from(*weight / sum);
        }
        Ok(DAffine3::from_mat4(world))
    }

    /// Adds triangles; those without normals get vertices of their own.
    fn append(
        &mut self,
        part: &mut Part,
        vertices: &[Vertex],
        triangles: &[[usize; 3]],
        is_mirrored: bool,
        material: u32,
    ) {
        let first = part.vertices.len() as u32;
        part.vertices.extend_from_slice(vertices);
        for corners in triangles {
            let [a, b, c] = *corners;
            let corners = if is_mirrored { [a, c, b] } else { [a, b, c] };
            let [a, b, c] = corners.map(|corner| Vec3::from(vertices[corner].position).as_dvec3());
            let Some(flat) = (b - a).cross(c - a).try_normalize() else {
                self.counts.zero_area += 1;
                continue;
            };
            let indices = corners.map(|corner| {
                if vertices[corner].normal != [0.0; 3] {
                    return first + corner as u32;
                }
                part.vertices.push(Vertex {
                    normal: flat.as_vec3().to_array(),
                    ..vertices[corner]
                });
                part.vertices.len() as u32 - 1
            });
            part.triangles.push(Triangle {
                vertices: indices,
                material,
            });
        }
    }
}

/// The matrix that turns normals: the inverse's transpose, but for a positive factor or a sign
/// where it mirrors.
fn cofactor(matrix: &DMat3) -> DMat3 {
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y))
}

/// Corners of triangles; `None` for points and lines.
fn triangles_of(mode: Mode, indices: &[usize]) -> Option<Vec<[usize; 3]>> {
    let windows = || indices.windows(3).enumerate();
    match mode {
        Mode::Triangles => {
            let (triangles, _) = indices.as_chunks::<3>();
            Some(triangles.to_vec())
        }
        Mode::TriangleStrip => Some(
            windows()
                .map(|(index, corners)| match index % 2 {
                    0 => [corners[0], corners[1], corners[2]],
                    _ => [corners[1], corners[0], corners[2]],
                })
                .collect(),
        ),
        Mode::TriangleFan => Some(
            windows()
                .map(|(_, corners)| [indices[0], corners[1], corners[2]])
                .collect(),
        ),
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => None,
    }
}
