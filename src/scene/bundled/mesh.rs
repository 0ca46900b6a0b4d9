//! Building geometry: quads, boxes, rooms, spheres and other parametric surfaces.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Affine3A, Mat3, Vec2, Vec3};

use super::super::assemble::Part;
use super::super::{Camera, Keyframe, Light, Material, Scene, Texture, Triangle, Vertex};

/// A scene under construction. Everything added is transformed by `world_from_local`.
#[derive(Default)]
pub(crate) struct Mesh {
    /// Applied to all that is added from now on.
    pub(crate) world_from_local: Affine3A,
    part: Part,
    textures: Vec<Arc<Texture>>,
    tile_m: Vec<f32>,
}

/// A point of a parametric surface.
pub(crate) struct SurfacePoint {
    /// Position \[m\].
    pub(crate) position: Vec3,
    /// Normal, of any length but 0.
    pub(crate) normal: Vec3,
    /// Texture coordinate.
    pub(crate) uv: Vec2,
}

/// The six faces of a box or room, in the order of the material lists.
pub(crate) const LOW_X: usize = 0;
/// The face of largest x.
pub(crate) const HIGH_X: usize = 1;
/// The floor of a room, the bottom of a box.
pub(crate) const LOW_Y: usize = 2;
/// The ceiling of a room, the top of a box.
pub(crate) const HIGH_Y: usize = 3;

impl Mesh {
    /// Adds a material.
    pub(crate) fn material(&mut self, material: Material) -> u32 {
        self.tiled_material(material, 1.0)
    }

    /// Adds a material whose textures repeat every `tile_m` metres on flat faces.
    pub(crate) fn tiled_material(&mut self, material: Material, tile_m: f32) -> u32 {
        self.part.materials.push(material);
        self.tile_m.push(tile_m);
        self.part.materials.len() as u32 - 1
    }

    /// Adds an untextured diffuse material.
    pub(crate) fn matte(&mut self, name: &str, albedo: [f32; 3]) -> u32 {
        self.material(Material {
            name: name.to_owned(),
            albedo: Vec3::from(albedo),
            ..Material::default()
        })
    }

    /// Adds a texture.
    pub(crate) fn texture(&mut self, texture: Texture) -> u32 {
        self.textures.push(Arc::new(texture));
        self.textures.len() as u32 - 1
    }

    /// The finished scene.
    pub(crate) fn into_scene(
        self,
        name: &str,
        lights: Vec<Light>,
        environment: Vec3,
        camera: Camera,
    ) -> Scene {
        let mut scene = Scene {
            name: name.to_owned(),
            textures: self.textures,
            lights,
            environment: environment.into(),
            camera,
            ..Scene::default()
        };
        scene.add_part(Part {
            name: name.to_owned(),
            ..self.part
        });
        scene.finish_textures();
        scene
    }

    /// Adds all there is to a scene, as a model that stands at the keyframes' places at their
    /// times.
    #[cfg_attr(
        not(feature = "measure"),
        expect(dead_code, reason = "the scenes of the stress tests alone move")
    )]
    pub(crate) fn add_moving(self, scene: &mut Scene, name: &str, keyframes: Vec<Keyframe>) {
        scene.add_part(Part {
            name: name.to_owned(),
            dynamic: true,
            keyframes,
            ..self.part
        });
    }

    /// Adds copies of all there is, each `step` (m) further, so that it is there `count` times.
    pub(crate) fn repeat(&mut self, count: u32, step: Vec3) {
        let (vertices, triangles) = (self.part.vertices.clone(), self.part.triangles.clone());
        for copy in 1..count {
            let (first, offset) = (self.part.vertices.len() as u32, copy as f32 * step);
            self.part
                .vertices
                .extend(vertices.iter().map(|vertex| Vertex {
                    position: (Vec3::from(vertex.position) + offset).to_array(),
                    ..*vertex
                }));
            self.part
                .triangles
                .extend(triangles.iter().map(|triangle| Triangle {
                    vertices: triangle.vertices.map(|index| first + index),
                    ..*triangle
                }));
        }
    }

    fn vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) -> u32 {
        let normal = (Mat3::from(self.world_from_local.matrix3) * normal).normalize();
        let position = self.world_from_local.transform_point3(position);
        // Adding 0 turns −0 into 0.
        self.part.vertices.push(Vertex {
            position: (position + 0.0).to_array(),
            u: uv.x,
            normal: (normal + 0.0).to_array(),
            v: uv.y,
        });
        self.part.vertices.len() as u32 - 1
    }

    fn triangle(&mut self, material: u32, vertices: [u32; 3]) {
        let [a, b, c] = vertices
            .map(|index| Vec3::from(self.part.vertices[index as usize].position).as_dvec3());
        if (b - a).cross(c - a).length_squared() > 0.0 {
            self.part.triangles.push(Triangle { vertices, material });
        }
    }

    /// Adds a flat quad, counter-clockwise from the front; texture coordinates are the metres along
    /// the two axes that it spans most, in tiles.
    pub(crate) fn quad(&mut self, material: u32, corners: [Vec3; 4]) {
        let normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]);
        let facing = normal.abs();
        let tile_m = self.tile_m[material as usize];
        let uv = |p: Vec3| {
            let flat = if facing.y >= facing.x.max(facing.z) {
                Vec2::new(p.x, -p.z)
            } else if facing.x > facing.z {
                Vec2::new(-p.z * normal.x.signum(), p.y)
            } else {
                Vec2::new(p.x * normal.z.signum(), p.y)
            };
            flat / tile_m
        };
        self.quad_with_uv(material, corners, corners.map(uv));
    }

    /// Adds a flat quad with texture coordinates.
    pub(crate) fn quad_with_uv(&mut self, material: u32, corners: [Vec3; 4], uv: [Vec2; 4]) {
        let normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]);
        let mut index = [0; 4];
        for ((index, corner), uv) in index.iter_mut().zip(corners).zip(uv) {
            *index = self.vertex(corner, normal, uv);
        }
        self.triangle(material, [index[0], index[1], index[2]]);
        self.triangle(material, [index[0], index[2], index[3]]);
    }

    /// Adds a box, seen from outside.
    pub(crate) fn cuboid(&mut self, materials: [u32; 6], low: Vec3, high: Vec3) {
        let cuts = [[low.x, high.x], [low.y, high.y], [low.z, high.z]];
        self.faces([&cuts[0], &cuts[1], &cuts[2]], false, |face, _| {
            Some(materials[face])
        });
    }

    /// Adds a room, seen from inside: its faces are cut at the given coordinates, so that faces
    /// that are cut differently still share their edges. `material` is given the face and the
    /// middle of the cell, and answers `None` for a hole.
    pub(crate) fn room(
        &mut self,
        cuts: [&[f32]; 3],
        material: impl Fn(usize, Vec3) -> Option<u32>,
    ) {
        self.faces(cuts, true, material);
    }

    fn faces(
        &mut self,
        cuts: [&[f32]; 3],
        inwards: bool,
        material: impl Fn(usize, Vec3) -> Option<u32>,
    ) {
        for face in 0..6 {
            let axis = face / 2;
            let is_high = face % 2 == 1;
            let (across, up) = ((axis + 1) % 3, (axis + 2) % 3);
            let Some(plane) = (if is_high {
                cuts[axis].last()
            } else {
                cuts[axis].first()
            }) else {
                continue;
            };
            for a in cuts[across].windows(2) {
                for b in cuts[up].windows(2) {
                    let point = |a: f32, b: f32| {
                        let mut point = Vec3::ZERO;
                        (point[axis], point[across], point[up]) = (*plane, a, b);
                        point
                    };
                    let mut corners = [
                        point(a[0], b[0]),
                        point(a[1], b[0]),
                        point(a[1], b[1]),
                        point(a[0], b[1]),
                    ];
                    if is_high == inwards {
                        corners.reverse();
                    }
                    if let Some(material) = material(face, 0.5 * (corners[0] + corners[2])) {
                        self.quad(material, corners);
                    }
                }
            }
        }
    }

    /// Adds a parametric surface over (s, t) ∈ [0, 1]², in `columns` × `rows` cells; its front is
    /// where ∂s × ∂t points.
    pub(crate) fn surface(
        &mut self,
        material: u32,
        columns: u32,
        rows: u32,
        point: impl Fn(f32, f32) -> SurfacePoint,
    ) {
        let first = self.part.vertices.len() as u32;
        for row in 0..=rows {
            for column in 0..=columns {
                let SurfacePoint {
                    position,
                    normal,
                    uv,
                } = point(column as f32 / columns as f32, row as f32 / rows as f32);
                self.vertex(position, normal, uv);
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let a = first + row * (columns + 1) + column;
                let b = a + columns + 1;
                self.triangle(material, [a, a + 1, b + 1]);
                self.triangle(material, [a, b + 1, b]);
            }
        }
    }

    /// Adds a surface of revolution about y through `foot`: `profile` is (radius, height) from the
    /// bottom up, its outside is the front.
    pub(crate) fn lathe(
        &mut self,
        material: u32,
        foot: Vec3,
        profile: &[(f32, f32)],
        segments: u32,
    ) {
        let tile_m = self.tile_m[material as usize];
        for pair in profile.windows(2) {
            let [(r0, y0), (r1, y1)] = [pair[0], pair[1]];
            let slope = Vec2::new(y1 - y0, r0 - r1);
            self.surface(material, segments, 1, |s, t| {
                let (sin, cos) = if s == 1.0 {
                    (0.0, 1.0)
                } else {
                    (s * std::f32::consts::TAU).sin_cos()
                };
                let (radius, y) = (r0 + (r1 - r0) * t, y0 + (y1 - y0) * t);
                let position = foot + Vec3::new(radius * cos, y, -radius * sin);
                let around_m = std::f32::consts::TAU * r0.max(r1).max(0.05);
                SurfacePoint {
                    position,
                    normal: Vec3::new(slope.x * cos, slope.y, -slope.x * sin),
                    uv: Vec2::new(s * around_m, y) / tile_m,
                }
            });
        }
    }

    /// Adds a sphere: an icosahedron, each face split in four `subdivisions` times; watertight,
    /// vertices on the sphere.
    pub(crate) fn sphere(
        &mut self,
        material: u32,
        centre: Vec3,
        radius: f32,
        subdivisions: u32,
        inwards: bool,
    ) {
        let sphere = Icosphere::new(subdivisions);
        let sign = if inwards { -1.0 } else { 1.0 };
        let first = self.part.vertices.len() as u32;
        for direction in sphere.directions {
            let u = 0.5 + direction.x.atan2(direction.z) / std::f32::consts::TAU;
            let v = 0.5 + direction.y.clamp(-1.0, 1.0).asin() / std::f32::consts::PI;
            self.vertex(
                centre + radius * direction,
                sign * direction,
                Vec2::new(u, v),
            );
        }
        for [a, b, c] in sphere.triangles {
            let vertices = if inwards { [a, c, b] } else { [a, b, c] };
            self.triangle(material, vertices.map(|index| first + index));
        }
    }
}

/// A subdivided icosahedron of unit radius.
struct Icosphere {
    directions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Icosphere {
    fn new(subdivisions: u32) -> Self {
        let golden = 0.5 * (1.0 + 5.0_f32.sqrt());
        let mut directions = Vec::new();
        for (one, long) in [
            (-1.0, golden),
            (1.0, golden),
            (-1.0, -golden),
            (1.0, -golden),
        ] {
            directions.extend([
                Vec3::new(one, long, 0.0),
                Vec3::new(0.0, one, long),
                Vec3::new(long, 0.0, one),
            ]);
        }
        let directions: Vec<Vec3> = directions
            .iter()
            .map(|direction| direction.normalize())
            .collect();
        let mut sphere = Icosphere {
            triangles: hull_of_icosahedron(&directions),
            directions,
        };
        for _ in 0..subdivisions {
            sphere.subdivide();
        }
        sphere
    }

    fn subdivide(&mut self) {
        let mut middle_of_edge: HashMap<(u32, u32), u32> = HashMap::new();
        let directions = &mut self.directions;
        let mut middle = |a: u32, b: u32| {
            *middle_of_edge
                .entry((a.min(b), a.max(b)))
                .or_insert_with(|| {
                    directions.push((directions[a as usize] + directions[b as usize]).normalize());
                    directions.len() as u32 - 1
                })
        };
        let split = |[a, b, c]: [u32; 3]| {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        };
        self.triangles = std::mem::take(&mut self.triangles)
            .into_iter()
            .flat_map(split)
            .collect();
    }
}

/// The 20 faces over the 12 vertices: the triples that are as close as neighbours are, turned
/// outwards.
fn hull_of_icosahedron(directions: &[Vec3]) -> Vec<[u32; 3]> {
    let near = |a: usize, b: usize| directions[a].distance(directions[b]) < 1.2;
    let mut triangles = Vec::new();
    for a in 0..directions.len() {
        for b in a + 1..directions.len() {
            for c in b + 1..directions.len() {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outwards = (directions[b] - directions[a])
                        .cross(directions[c] - directions[a])
                        .dot(directions[a])
                        > 0.0;
                    let [b, c] = if outwards { [b, c] } else { [c, b] };
                    triangles.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    triangles
}
