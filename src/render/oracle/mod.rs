//! CPU twins of the passes that all techniques share, in f64: what a view shows (`render.gbuffer`,
//! `render.shadow_maps`, `render.rsm`), how it moves ([`motion`]), and what the lights make of it
//! (`render.direct`, [`light`]).
//!
//! They are written from the radiometric contract, and every ray is tested against every triangle.
//! A rasterizer rounds corners to a share of a pixel, so that next to an edge a pixel may show what
//! is on either side of it: [`Scenery::seen`] tells all that a pixel may show.

pub mod light;
pub mod motion;
pub mod shadow;
pub mod texture;

use glam::{DVec2, DVec3, DVec4};

use super::GpuLightView;
use crate::scene::{Camera, Light, Material, Scene};
use texture::bilinear;

/// How far from an edge (px) a pixel's centre may lie and still show the other side: the least
/// precision of corners that Vulkan allows (`subPixelPrecisionBits`, 4).
pub const EDGE_PX: f64 = 1.0 / 16.0;

/// Filters of the least precision that Vulkan allows blend texels by 1/16; those in use by 1/256,
/// and values are rounded to as much.
pub const TEXEL_ERROR: f64 = 1.0 / 128.0;

/// What lies this near to the near plane (share of its depth) may be cut off or not.
const NEAR_SLACK: f64 = 1e-3;

/// How pixels or texels look into the scene.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// The eye or the light (m); in a parallel view, the map's centre on its near plane.
    pub origin: DVec3,
    /// From the centre to the right edge: per unit of view depth; in a parallel view in m.
    pub right: DVec3,
    /// From the centre to the lower edge, likewise.
    pub down: DVec3,
    /// Unit direction of view.
    pub forward: DVec3,
    /// Depth of the near plane (m).
    pub near_m: f64,
    /// Whether all rays have one direction.
    pub is_parallel: bool,
    /// Width and height (px).
    pub size: [u32; 2],
}

impl View {
    /// The view of a camera.
    pub fn of_camera(camera: &Camera, size: [u32; 2], near_m: f64) -> View {
        let (eye, target, up) = (
            camera.eye.as_dvec3(),
            camera.target.as_dvec3(),
            camera.up.as_dvec3(),
        );
        let forward = (target - eye).normalize();
        let right = forward.cross(up).normalize();
        let half_height = (f64::from(camera.vfov_deg).to_radians() / 2.0).tan();
        let half_width = half_height * f64::from(size[0]) / f64::from(size[1]);
        View {
            origin: eye,
            right: half_width * right,
            down: half_height * forward.cross(right),
            forward,
            near_m,
            is_parallel: false,
            size,
        }
    }

    /// The view of a light.
    pub fn of_light(view: &GpuLightView) -> View {
        let xyz = |[x, y, z, _]: [f32; 4]| DVec3::new(x.into(), y.into(), z.into());
        View {
            origin: xyz(view.origin_kind),
            right: xyz(view.right),
            down: xyz(view.down),
            forward: xyz(view.forward),
            near_m: view.forward[3].into(),
            is_parallel: view.origin_kind[3] == 0.0,
            size: [view.light[1]; 2],
        }
    }

    /// Start and direction of the ray through a point of the picture (px). Its direction has the
    /// length 1 along the view, so that distances are view depths.
    pub fn ray(&self, at_px: DVec2) -> (DVec3, DVec3) {
        let map = 2.0 * at_px / DVec2::from(self.size.map(f64::from)) - 1.0;
        let across = map.x * self.right + map.y * self.down;
        if self.is_parallel {
            (self.origin + across, self.forward)
        } else {
            (self.origin, self.forward + across)
        }
    }

    /// Where a point is seen (px), and its view depth (m). Perspective views see only points in
    /// front.
    pub fn project(&self, point: DVec3) -> (DVec2, f64) {
        let offset = point - self.origin;
        let depth_m = offset.dot(self.forward);
        let scale = if self.is_parallel { 1.0 } else { 1.0 / depth_m };
        let map = DVec2::new(
            offset.dot(self.right) / self.right.length_squared(),
            offset.dot(self.down) / self.down.length_squared(),
        ) * scale;
        (
            (0.5 * map + 0.5) * DVec2::from(self.size.map(f64::from)),
            depth_m,
        )
    }
}

/// A scene whose triangles rays are tested against, one by one.
pub struct Scenery<'s> {
    /// The scene whose triangles are tested.
    pub scene: &'s Scene,
    /// Corners of each triangle (m); `None` where it has no area.
    corners: Vec<Option<[DVec3; 3]>>,
}

/// Where a ray meets the plane of a triangle.
#[derive(Clone, Copy, Debug)]
struct Hit {
    depth_m: f64,
    /// Share of each corner; negative outside.
    weights: [f64; 3],
    /// Distance to the nearest edge (px); negative outside.
    inside_px: f64,
}

/// All that a pixel may show.
#[derive(Clone, Debug)]
pub struct Seen {
    /// Triangles, one of which the pixel shows; none if it is certain to see nothing.
    pub triangles: Vec<usize>,
    /// Whether the pixel may also see no triangle at all.
    pub may_be_empty: bool,
}

/// What the G-buffer is to hold of a point.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// World-space position (m).
    pub position: DVec3,
    /// View depth (m).
    pub depth_m: f64,
    /// Unit normal of the triangle, on the viewer's side.
    pub geometric_normal: DVec3,
    /// Unit interpolated and mapped normal, on the same side.
    pub shading_normal: DVec3,
    /// Unit direction to the viewer.
    pub to_eye: DVec3,
    /// Diffuse albedo ρ.
    pub albedo: DVec3,
    /// Roughness of the lobe, where there is one.
    pub roughness: Option<f64>,
    /// Reflectance at normal incidence; 0 without a lobe.
    pub f0: DVec3,
    /// Emitted radiance towards the viewer [W/(m² sr)].
    pub emission: DVec3,
    /// Texels that a pixel steps over, in the finest texture and the worse direction; 0 without
    /// textures. Above 1, textures are filtered.
    pub texels_per_px: f64,
}

impl<'s> Scenery<'s> {
    /// Prepares a scene.
    pub fn new(scene: &'s Scene) -> Self {
        let corners = scene.triangles.iter().map(|triangle| {
            let corners = triangle
                .vertices
                .map(|vertex| DVec3::from(scene.vertices[vertex as usize].position.map(f64::from)));
            (normal_of(&corners) != DVec3::ZERO).then_some(corners)
        });
        Scenery {
            scene,
            corners: corners.collect(),
        }
    }

    /// Material of a triangle.
    pub fn material(&self, triangle: usize) -> &'s Material {
        &self.scene.materials[self.scene.triangles[triangle].material as usize]
    }

    fn hit(&self, triangle: usize, view: &View, at_px: DVec2) -> Option<Hit> {
        let corners = self.corners[triangle].as_ref()?;
        // Volumes between the ray and each edge; linear in the pixel's position (Olano & Greer
        // 1997).
        let volumes = |at_px: DVec2| {
            let (origin, direction) = view.ray(at_px);
            let [a, b, c] = corners.map(|corner| corner - origin);
            DVec3::new(
                direction.dot(b.cross(c)),
                direction.dot(c.cross(a)),
                direction.dot(a.cross(b)),
            )
        };
        let here = volumes(at_px);
        let (origin, direction) = view.ray(at_px);
        let normal = normal_of(corners);
        let along = normal.dot(direction);
        let depth_m = normal.dot(corners[0] - origin) / along;
        if along == 0.0 || !depth_m.is_finite() || depth_m <= 0.0 && !view.is_parallel {
            return None;
        }
        let (by_x, by_y) = (
            volumes(at_px + DVec2::X) - here,
            volumes(at_px + DVec2::Y) - here,
        );
        let distance = |edge: usize| {
            // Infinite where the edge lies in the plane of the view's origin; where it passes
            // through the origin, the ray touches it.
            let distance = here[edge] * along.signum() / by_x[edge].hypot(by_y[edge]);
            if distance.is_nan() { 0.0 } else { distance }
        };
        let inside_px = distance(0).min(distance(1)).min(distance(2));
        Some(Hit {
            depth_m,
            weights: (here / here.element_sum()).to_array(),
            inside_px,
        })
    }

    /// View depth (m) of the first triangle on a ray that is there beyond doubt; infinite where
    /// there is none.
    pub fn first_hit(&self, view: &View, at_px: DVec2) -> f64 {
        self.first_solid(view, at_px, 0)
    }

    /// As [`Scenery::first_hit`]; `None` where a mask before it might be there or not.
    pub fn certain_hit(&self, view: &View, at_px: DVec2) -> Option<f64> {
        let [sure, possible] = [0, 1].map(|bound| self.first_solid(view, at_px, bound));
        (sure == possible).then_some(sure)
    }

    fn first_solid(&self, view: &View, at_px: DVec2, bound: usize) -> f64 {
        let hits = (0..self.corners.len()).filter_map(|triangle| {
            let hit = self.hit(triangle, view, at_px).filter(|hit| {
                hit.inside_px >= 0.0 && hit.depth_m > view.near_m * (1.0 + NEAR_SLACK)
            })?;
            (self.cover(triangle, view, at_px, &hit)[bound] >= 0.5).then_some(hit.depth_m)
        });
        hits.fold(f64::INFINITY, f64::min)
    }

    /// What a point of the picture (px) may show.
    pub fn seen(&self, view: &View, at_px: DVec2) -> Seen {
        let around = corners_around(at_px, EDGE_PX).into_iter().chain([at_px]);
        let farthest = around
            .map(|at_px| self.first_hit(view, at_px))
            .fold(0.0, f64::max);
        let may_show = |triangle: &usize| {
            let Some(hit) = self
                .hit(*triangle, view, at_px)
                .filter(|hit| hit.inside_px >= -EDGE_PX)
            else {
                return false;
            };
            let depths = corners_around(at_px, EDGE_PX).map(|at_px| {
                self.hit(*triangle, view, at_px)
                    .map_or(0.0, |hit| hit.depth_m)
            });
            let nearest = depths.into_iter().fold(hit.depth_m, f64::min) * (1.0 - 1e-5);
            let is_solid = corners_around(at_px, EDGE_PX)
                .into_iter()
                .chain([at_px])
                .any(|at_px| {
                    self.hit(*triangle, view, at_px)
                        .is_some_and(|hit| self.cover(*triangle, view, at_px, &hit)[1] >= 0.5)
                });
            nearest <= farthest && hit.depth_m > view.near_m * (1.0 - NEAR_SLACK) && is_solid
        };
        Seen {
            triangles: (0..self.corners.len()).filter(may_show).collect(),
            may_be_empty: farthest == f64::INFINITY,
        }
    }

    /// Whether light arrives at a surface from a light that it faces, by exact rays; `None` where
    /// points `aside_m` next to it disagree or a mask leaves it open.
    pub fn is_lit(&self, surface: &Surface, light: &Light, aside_m: f64) -> Option<bool> {
        let [across, up] = <[DVec3; 2]>::from(surface.geometric_normal.any_orthonormal_pair());
        let mut answers = [DVec3::ZERO, across, -across, up, -up]
            .into_iter()
            .map(|aside| {
                let start = surface.position + aside_m * aside;
                let (to_light, reach_m) = match *light {
                    Light::Directional { direction, .. } => (-direction.as_dvec3(), f64::INFINITY),
                    Light::Point { position, .. } | Light::Spot { position, .. } => {
                        let offset = position.as_dvec3() - start;
                        (offset.normalize(), offset.length())
                    }
                };
                // A narrow view from the surface to the light: what is in its middle is in the way.
                let (right, down) = to_light.any_orthonormal_pair();
                let view = View {
                    origin: start,
                    right: 1e-6 * right,
                    down: 1e-6 * down,
                    forward: to_light,
                    near_m: 1e-6,
                    is_parallel: false,
                    size: [2; 2],
                };
                self.certain_hit(&view, DVec2::ONE)
                    .map(|depth_m| depth_m >= reach_m)
            });
        let first = answers.next()??;
        answers.all(|answer| answer == Some(first)).then_some(first)
    }

    /// Least and largest coverage by the mask, 1 without one. Where a pixel steps over texels, the
    /// mask is filtered and may be anything.
    fn cover(&self, triangle: usize, view: &View, at_px: DVec2, hit: &Hit) -> [f64; 2] {
        let Some(mask) = self.material(triangle).mask_texture else {
            return [1.0; 2];
        };
        let uv = self.uv(triangle, hit);
        if self.texels_per_px(triangle, view, at_px, uv) > 1.0 {
            return [0.0, 1.0];
        }
        let cover = bilinear(&self.scene.textures[mask as usize], uv).x;
        [cover - TEXEL_ERROR, cover + TEXEL_ERROR]
    }

    fn uv(&self, triangle: usize, hit: &Hit) -> DVec2 {
        let corners = self.scene.triangles[triangle]
            .vertices
            .map(|vertex| self.scene.vertices[vertex as usize]);
        corners
            .iter()
            .zip(hit.weights)
            .map(|(vertex, weight)| weight * DVec2::new(vertex.u.into(), vertex.v.into()))
            .sum()
    }

    /// What a point of the picture (px) shows of the plane of a triangle; `None` where the two do
    /// not meet.
    pub fn surface(&self, triangle: usize, view: &View, at_px: DVec2) -> Option<Surface> {
        let hit = self.hit(triangle, view, at_px)?;
        let corners = self.corners[triangle].as_ref()?;
        let (origin, direction) = view.ray(at_px);
        let material = self.material(triangle);
        let uv = self.uv(triangle, &hit);
        let front = normal_of(corners).normalize();
        let is_front = front.dot(direction) <= 0.0;
        let geometric_normal = if is_front { front } else { -front };
        let shading = self.shading_normal(triangle, corners, &hit, front, uv);
        let shading_normal = if shading.dot(geometric_normal) < 0.0 {
            -shading
        } else {
            shading
        };
        let texel = |texture: Option<u32>| {
            texture.map_or(DVec3::ONE, |index| {
                bilinear(&self.scene.textures[index as usize], uv).truncate()
            })
        };
        let base = material.albedo.as_dvec3() * texel(material.albedo_texture);
        let of_lobe = material
            .specular
            .and_then(|lobe| lobe.texture)
            .map_or(DVec4::ONE, |index| {
                bilinear(&self.scene.textures[index as usize], uv)
            });
        let (albedo, f0) = match material.specular {
            Some(lobe) => (
                base * (1.0 - f64::from(lobe.metalness)),
                (lobe.f0.as_dvec3() * of_lobe.truncate()).lerp(base, lobe.metalness.into()),
            ),
            None => (base, DVec3::ZERO),
        };
        Some(Surface {
            position: origin + hit.depth_m * direction,
            depth_m: hit.depth_m,
            geometric_normal,
            shading_normal,
            to_eye: -direction.normalize(),
            albedo,
            roughness: material
                .specular
                .map(|lobe| f64::from(lobe.roughness) * of_lobe.w),
            f0,
            emission: if is_front {
                material.emission.as_dvec3() * texel(material.emission_texture)
            } else {
                DVec3::ZERO
            },
            texels_per_px: self.texels_per_px(triangle, view, at_px, uv),
        })
    }

    fn texels_per_px(&self, triangle: usize, view: &View, at_px: DVec2, uv: DVec2) -> f64 {
        let material = self.material(triangle);
        let textures = [
            material.albedo_texture,
            material.emission_texture,
            material.normal_texture,
            material.mask_texture,
            material.specular.and_then(|lobe| lobe.texture),
        ];
        let sizes = textures
            .into_iter()
            .flatten()
            .map(|index| &self.scene.textures[index as usize]);
        let Some(texels) = sizes
            .map(|texture| DVec2::new(texture.width.into(), texture.height.into()))
            .reduce(DVec2::max)
        else {
            return 0.0;
        };
        let step = |by: DVec2| {
            self.hit(triangle, view, at_px + by)
                .map_or(f64::INFINITY, |hit| {
                    ((self.uv(triangle, &hit) - uv) * texels).length()
                })
        };
        [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y]
            .map(step)
            .into_iter()
            .fold(0.0, f64::max)
    }

    /// The interpolated normal on the front side, bent by the normal map where there is one.
    fn shading_normal(
        &self,
        triangle: usize,
        corners: &[DVec3; 3],
        hit: &Hit,
        front: DVec3,
        uv: DVec2,
    ) -> DVec3 {
        let vertices = self.scene.triangles[triangle]
            .vertices
            .map(|vertex| self.scene.vertices[vertex as usize]);
        let sum: DVec3 = vertices
            .iter()
            .zip(hit.weights)
            .map(|(vertex, weight)| weight * DVec3::from(vertex.normal.map(f64::from)))
            .sum();
        let normal = sum.normalize();
        let normal = if normal.dot(front) < 0.0 {
            -normal
        } else {
            normal
        };
        let Some(map) = self.material(triangle).normal_texture else {
            return normal;
        };
        let [uv_a, uv_b, uv_c] =
            vertices.map(|vertex| DVec2::new(vertex.u.into(), vertex.v.into()));
        let (across, up) = (uv_b - uv_a, uv_c - uv_a);
        let determinant = across.perp_dot(up);
        if determinant == 0.0 {
            return normal;
        }
        // The directions in which u and v grow: the position's derivatives.
        let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
        let (by_u, by_v) = (
            (e1 * up.y - e2 * across.y) / determinant,
            (e2 * across.x - e1 * up.x) / determinant,
        );
        let tangent = (by_u - normal * normal.dot(by_u)).normalize();
        let bitangent = normal.cross(tangent);
        let bitangent = if bitangent.dot(by_v) < 0.0 {
            -bitangent
        } else {
            bitangent
        };
        let local = 2.0 * bilinear(&self.scene.textures[map as usize], uv).truncate() - 1.0;
        (local.x * tangent + local.y * bitangent + local.z * normal).normalize()
    }
}

fn normal_of(corners: &[DVec3; 3]) -> DVec3 {
    (corners[1] - corners[0]).cross(corners[2] - corners[0])
}

/// The corners of a square around a point, `reach_px` away along each axis.
pub fn corners_around(at_px: DVec2, reach_px: f64) -> [DVec2; 4] {
    [
        DVec2::new(-1.0, -1.0),
        DVec2::new(1.0, -1.0),
        DVec2::new(-1.0, 1.0),
        DVec2::ONE,
    ]
    .map(|by| at_px + reach_px * by)
}
