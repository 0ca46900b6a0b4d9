//! From parts with materials of their own to one [`Scene`] in its canonical order.
//!
//! The order depends on the order of the triangles alone: materials by first use, triangles by
//! material (models stay contiguous), vertices by first use, textures by first use. A scene that is
//! written and loaded again is therefore the same scene, to the bit.

use std::path::Path;

use glam::{DVec3, Vec3};

use super::{
    Keyframe, Material, Model, Motion, Scene, SceneError, Specular, Triangle, Vertex, union,
};

/// The geometry of one model; `triangles` index its own `vertices` and `materials`, materials index
/// textures that all parts share.
#[derive(Clone, Debug, Default)]
pub(super) struct Part {
    /// Name of the model.
    pub(super) name: String,
    /// Whether the model may move.
    pub(super) dynamic: bool,
    /// Where it stands at which time; empty where it does not move.
    pub(super) keyframes: Vec<Keyframe>,
    /// Vertices in world space, or, of a model with keyframes, before any of them is applied.
    pub(super) vertices: Vec<Vertex>,
    /// Triangles in any order.
    pub(super) triangles: Vec<Triangle>,
    /// Materials, used or not.
    pub(super) materials: Vec<Material>,
}

impl Part {
    /// The longest side of its bounds \[m\].
    pub(super) fn extent_m(&self) -> f32 {
        let positions = self
            .vertices
            .iter()
            .map(|vertex| Vec3::from(vertex.position));
        let bounds = positions.map(|position| (position, position)).reduce(union);
        bounds.map_or(0.0, |(low, high)| (high - low).max_element())
    }

    /// Drops triangles that have no area where they stand: 32-bit positions far from the origin are
    /// coarse. Answers how many.
    pub(super) fn drop_triangles_without_area(&mut self) -> usize {
        let count = self.triangles.len();
        let vertices = &self.vertices;
        self.triangles.retain(|triangle| {
            let [a, b, c] = triangle
                .vertices
                .map(|index| Vec3::from(vertices[index as usize].position).as_dvec3());
            (b - a).cross(c - a) != DVec3::ZERO
        });
        count - self.triangles.len()
    }
}

/// Stands for "not numbered yet".
const NEW: u32 = u32::MAX;

/// Numbers things in order of first use.
struct Renumber {
    new_from_old: Vec<u32>,
    old_from_new: Vec<u32>,
    base: u32,
}

impl Renumber {
    fn new(count: usize, base: usize) -> Self {
        Renumber {
            new_from_old: vec![NEW; count],
            old_from_new: Vec::new(),
            base: base as u32,
        }
    }

    fn number(&mut self, old: u32) -> u32 {
        let slot = &mut self.new_from_old[old as usize];
        if *slot == NEW {
            *slot = self.base + self.old_from_new.len() as u32;
            self.old_from_new.push(old);
        }
        *slot
    }
}

impl Scene {
    /// Appends a model; its indices must be in range.
    pub(super) fn add_part(&mut self, mut part: Part) {
        let mut materials = Renumber::new(part.materials.len(), self.materials.len());
        for triangle in &mut part.triangles {
            triangle.material = materials.number(triangle.material);
        }
        part.triangles.sort_by_key(|triangle| triangle.material);
        let mut vertices = Renumber::new(part.vertices.len(), self.vertices.len());
        for triangle in &mut part.triangles {
            triangle.vertices = triangle.vertices.map(|old| vertices.number(old));
        }
        let first_vertex = self.vertices.len() as u32;
        self.vertices.extend(
            vertices
                .old_from_new
                .iter()
                .map(|old| part.vertices[*old as usize]),
        );
        let motion = || Motion {
            first_vertex,
            rest: self.vertices[first_vertex as usize..].to_vec(),
            keyframes: part.keyframes.clone(),
        };
        self.models.push(Model {
            name: part.name,
            dynamic: part.dynamic,
            first_triangle: self.triangles.len() as u32,
            triangle_count: part.triangles.len() as u32,
            motion: (!part.keyframes.is_empty()).then(motion),
        });
        self.triangles.extend(part.triangles);
        self.materials.extend(
            materials
                .old_from_new
                .iter()
                .map(|old| part.materials[*old as usize].clone()),
        );
    }

    /// Drops unused textures and numbers the others by first use; call once, after the last part.
    pub(super) fn finish_textures(&mut self) {
        let mut textures = Renumber::new(self.textures.len(), 0);
        for material in &mut self.materials {
            let mut none = Specular::default();
            let lobe = material.specular.as_mut().unwrap_or(&mut none);
            let slots = [
                &mut material.albedo_texture,
                &mut material.emission_texture,
                &mut material.mask_texture,
                &mut material.normal_texture,
                &mut lobe.texture,
            ];
            for index in slots.into_iter().flatten() {
                *index = textures.number(*index);
            }
        }
        let mut old: Vec<_> = std::mem::take(&mut self.textures)
            .into_iter()
            .map(Some)
            .collect();
        self.textures = textures
            .old_from_new
            .iter()
            .filter_map(|index| old[*index as usize].take())
            .collect();
    }

    /// Indices are 32 bits: says so where a scene has more; `path` is for the message.
    pub(super) fn check_counts(
        path: &Path,
        vertex_count: usize,
        triangle_count: usize,
    ) -> Result<(), SceneError> {
        if vertex_count.max(triangle_count) < NEW as usize / 4 {
            return Ok(());
        }
        let problem =
            format!("{vertex_count} vertices and {triangle_count} triangles are too many");
        Err(SceneError::file(
            path,
            problem,
            "split the model: there can be at most 1073741822 of each",
        ))
    }
}
