//! Ray queries against a scene: a compressed wide BVH over its triangles. Who asks says where alpha
//! masks leave a surface.

use std::time::Duration;

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray as BvhRay, RayHit};
use obvhs::triangle::Triangle as BvhTriangle;

use super::{Scene, Triangle};

/// No triangle: for rays that start at the camera.
pub(crate) const NO_TRIANGLE: u32 = u32::MAX;

/// See [`Accel`]: what is nearer than 6 millionths of the scene's size is then lost. More would
/// bring the rounding of boxes beyond the absolute 1e-5 that the builder's own check allows in
/// debug builds.
const LARGEST_COORDINATE: f32 = 32.0;

/// A ray that leaves a surface or the camera.
#[derive(Clone, Copy)]
pub(crate) struct Ray {
    /// Where it starts, world space (m).
    pub(crate) origin: Vec3,
    /// Unit direction.
    pub(crate) direction: Vec3,
    /// The triangle it leaves, which it cannot hit; or [`NO_TRIANGLE`].
    pub(crate) leaves: u32,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy)]
pub(crate) struct Hit {
    /// Index into the scene's triangles.
    pub(crate) triangle: u32,
    /// Barycentric coordinate of the second vertex.
    pub(crate) u: f32,
    /// Barycentric coordinate of the third vertex.
    pub(crate) v: f32,
}

/// One triangle, ready to intersect.
struct Packed {
    origin: Vec3A,
    edge_1: Vec3A,
    edge_2: Vec3A,
    triangle: u32,
    is_masked: bool,
}

/// The acceleration structure of a scene.
///
/// It is built in units in which the largest coordinate is about [`LARGEST_COORDINATE`], because
/// the traversal enters no box that ends nearer than an absolute 1e-4. The factor is a power of
/// two, so that no coordinate is rounded.
pub(crate) struct Accel {
    /// Units per metre.
    units_per_m: f32,
    /// `None` where there is nothing to hit.
    bvh: Option<CwBvh>,
    /// In the BVH's order.
    triangles: Vec<Packed>,
}

/// Interpolated texture coordinates.
pub(crate) fn texture_coordinates(scene: &Scene, triangle: &Triangle, u: f32, v: f32) -> [f32; 2] {
    let [a, b, c] = triangle
        .vertices
        .map(|index| &scene.vertices[index as usize]);
    let w = 1.0 - u - v;
    [w * a.u + u * b.u + v * c.u, w * a.v + u * b.v + v * c.v]
}

/// World-space corners of a triangle (m).
pub(crate) fn corners(scene: &Scene, triangle: &Triangle) -> [Vec3; 3] {
    triangle
        .vertices
        .map(|index| Vec3::from(scene.vertices[index as usize].position))
}

impl Accel {
    /// Builds the structure; triangles without area are left out.
    pub(crate) fn new(scene: &Scene) -> Self {
        let corners: Vec<[Vec3; 3]> = scene
            .triangles
            .iter()
            .map(|triangle| corners(scene, triangle))
            .collect();
        let is_masked = |triangle: usize| {
            let material = scene.triangles[triangle].material;
            scene.materials[material as usize].mask_texture.is_some()
        };
        Accel::of_corners(&corners, is_masked, units_per_m(scene))
    }

    /// Builds the structure of triangles by their corners.
    pub(crate) fn of_corners(
        corners: &[[Vec3; 3]],
        is_masked: impl Fn(usize) -> bool,
        units_per_m: f32,
    ) -> Self {
        let mut indices = Vec::with_capacity(corners.len());
        let mut shapes = Vec::with_capacity(corners.len());
        for (index, corners) in corners.iter().enumerate() {
            let [v0, v1, v2] = corners.map(|corner| Vec3A::from(corner * units_per_m));
            if (v1 - v0).cross(v2 - v0).length_squared() > 0.0 {
                indices.push(index as u32);
                shapes.push(BvhTriangle { v0, v1, v2 });
            }
        }
        if shapes.is_empty() {
            return Accel {
                units_per_m,
                bvh: None,
                triangles: Vec::new(),
            };
        }
        let bvh = build_cwbvh_from_tris(
            &shapes,
            BvhBuildParams::medium_build(),
            &mut Duration::default(),
        );
        let pack = |&primitive: &u32| {
            let (shape, triangle) = (&shapes[primitive as usize], indices[primitive as usize]);
            Packed {
                origin: shape.v0,
                edge_1: shape.v1 - shape.v0,
                edge_2: shape.v2 - shape.v0,
                triangle,
                is_masked: is_masked(triangle as usize),
            }
        };
        let triangles = bvh.primitive_indices.iter().map(pack).collect();
        Accel {
            units_per_m,
            bvh: Some(bvh),
            triangles,
        }
    }

    /// The nearest hit. `is_solid` tells whether a mask leaves a surface at a hit.
    pub(crate) fn closest(&self, is_solid: impl Fn(Hit) -> bool, ray: &Ray) -> Option<Hit> {
        let bvh = self.bvh.as_ref()?;
        let mut closest = None;
        let test = |query: &BvhRay, primitive: usize| {
            let packed = &self.triangles[primitive];
            let Some((t, hit)) = packed.intersect(&is_solid, query, ray.leaves) else {
                return f32::INFINITY;
            };
            closest = Some(hit);
            t
        };
        bvh.ray_traverse(self.query(ray, f32::INFINITY), &mut RayHit::none(), test);
        closest
    }

    /// Whether something other than the triangle `target` is nearer than `distance_m`.
    pub(crate) fn is_occluded(
        &self,
        is_solid: impl Fn(Hit) -> bool,
        ray: &Ray,
        distance_m: f32,
        target: u32,
    ) -> bool {
        let Some(bvh) = self.bvh.as_ref() else {
            return false;
        };
        let test = |query: &BvhRay, primitive: usize| match self.triangles[primitive]
            .intersect(&is_solid, query, ray.leaves)
        {
            Some((t, hit)) if hit.triangle != target => t,
            _ => f32::INFINITY,
        };
        !bvh.ray_traverse_miss(self.query(ray, distance_m), test)
    }

    fn query(&self, ray: &Ray, distance_m: f32) -> BvhRay {
        BvhRay::new(
            (ray.origin * self.units_per_m).into(),
            ray.direction.into(),
            0.0,
            distance_m * self.units_per_m,
        )
    }
}

/// The power of two that brings the largest coordinate of the scene and its camera just below
/// [`LARGEST_COORDINATE`].
fn units_per_m(scene: &Scene) -> f32 {
    let positions = scene.vertices.iter().map(|vertex| vertex.position.into());
    units_of(positions.chain([scene.camera.eye]))
}

/// The power of two that brings the largest coordinate of points just below
/// [`LARGEST_COORDINATE`].
pub(crate) fn units_of(points: impl Iterator<Item = Vec3>) -> f32 {
    let largest_m = points.fold(0.0, |largest: f32, point| {
        largest.max(point.abs().max_element())
    });
    if largest_m > 0.0 {
        (LARGEST_COORDINATE / largest_m)
            .log2()
            .floor()
            .clamp(-60.0, 60.0)
            .exp2()
    } else {
        1.0
    }
}

impl Packed {
    /// Distance and barycentric coordinates of a hit nearer than the query's end (T. Möller and B.
    /// Trumbore, 1997), both sides.
    #[inline]
    fn intersect(
        &self,
        is_solid: impl Fn(Hit) -> bool,
        query: &BvhRay,
        leaves: u32,
    ) -> Option<(f32, Hit)> {
        let p = query.direction.cross(self.edge_2);
        let determinant = self.edge_1.dot(p);
        if determinant == 0.0 {
            return None;
        }
        let inverse = 1.0 / determinant;
        let s = query.origin - self.origin;
        let u = s.dot(p) * inverse;
        let q = s.cross(self.edge_1);
        let v = query.direction.dot(q) * inverse;
        let t = self.edge_2.dot(q) * inverse;
        let is_hit = u >= 0.0
            && v >= 0.0
            && u + v <= 1.0
            && t > 0.0
            && t < query.tmax
            && self.triangle != leaves;
        let hit = Hit {
            triangle: self.triangle,
            u,
            v,
        };
        if !is_hit || (self.is_masked && !is_solid(hit)) {
            return None;
        }
        Some((t, hit))
    }
}
