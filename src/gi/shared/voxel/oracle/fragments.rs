//! What lies in each voxel.

use std::collections::BTreeMap;

use glam::{DMat3, DVec2, DVec3};

use super::{
    Grid, LEAST_COVERAGE, LEAST_WEIGHT, VoxelIndex, corner_of, corners, doubles, material_of,
    touched_voxels,
};
use crate::gi::shared::voxel::Faces;
use crate::scene::{Material, Scene, Texture};

/// One triangle's part of one voxel.
#[derive(Clone, Debug, PartialEq)]
pub struct Fragment {
    /// Index into [`Scene::triangles`].
    pub triangle: u32,
    /// The voxel that the part lies in.
    pub voxel: VoxelIndex,
    /// The part's outline, grid space \[voxels\]; fewer than three corners where the triangle only
    /// touches the voxel.
    pub polygon: Vec<DVec3>,
    /// Area of the part that the mask leaves [voxel faces]. A triangle in the common face of two
    /// voxels counts in both.
    pub area: f64,
    /// Centroid of the part from the voxel's smallest corner \[voxels\], 0 to 1; of a part without
    /// area, the mean of its corners.
    pub mean_position: DVec3,
    /// Unit geometric normal.
    pub normal: DVec3,
    /// Diffuse albedo, a texture's being its mean over a square of one voxel about the centroid.
    pub albedo: DVec3,
    /// Emitted radiance of the front [W/(m² sr)], textured likewise.
    pub emission: DVec3,
}

impl Fragment {
    /// What the fragment counts in a mean [voxel faces].
    pub fn weight(&self) -> f64 {
        self.area.max(LEAST_WEIGHT)
    }
}

/// All fragments of one voxel: means are weighted by [`Fragment::weight`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VoxelSum {
    /// Number of fragments.
    pub fragment_count: u32,
    /// Sum of the weights [voxel faces].
    pub area: f64,
    /// Mean normal, not of unit length; of opposed surfaces in parallel planes, the unit normal of
    /// these on the side of `opposed_axis`.
    pub normal: DVec3,
    /// Mean diffuse albedo.
    pub albedo: DVec3,
    /// Centroid from the voxel's smallest corner \[voxels\], 0 to 1.
    pub mean_position: DVec3,
    /// Mean emitted radiance [W/(m² sr)].
    pub emission: DVec3,
    /// Largest of Σ weight · |normal| over the three axes, [`LEAST_COVERAGE`] to 1: the opacity
    /// where coverage is asked for.
    pub coverage: f64,
    /// Share of the emission (sum of red, green and blue) that leaves the front: the emission of
    /// the fragments that face it.
    pub emission_ahead: f64,
    /// Areas that face along each axis and against it [voxel faces].
    pub facing: [DVec3; 2],
    /// Share of the surface that is seen from one side: Σ over the axes of the larger of the areas
    /// that face along and against it, each at most one face, over the sum of both. 1 for a
    /// sheet or a corner, ½ for a wall with both faces in the voxel.
    pub seen_from_one: f64,
    /// As `seen_from_one` with both areas: the share seen from both sides.
    pub seen_from_both: f64,
    /// Share of the surface that faces against the rest, 0 to ½.
    pub opposed: f64,
    /// Axis along which most surface is opposed, where that share is above [`OPPOSED`].
    pub opposed_axis: Option<usize>,
    /// Share of the squares of the normals that is along one direction, ⅓ to 1: above [`PARALLEL`]
    /// the surfaces are parallel.
    pub parallel: f64,
    /// Mean height of the surfaces over the mean position, each along its own normal \[voxels\]:
    /// negative where they meet like the walls of a room.
    pub height: f64,
}

impl VoxelSum {
    /// The direction that parts the two sides of the surface.
    pub fn front(&self) -> DVec3 {
        front_of(self.normal, self.opposed_axis)
    }

    /// Areas seen from one side along each axis [voxel faces].
    pub fn across(&self) -> DVec3 {
        self.facing[0].max(self.facing[1]).min(DVec3::ONE)
    }

    /// Whether surfaces that are not opposed meet like the walls of a room.
    pub fn is_concave(&self) -> bool {
        self.opposed_axis.is_none() && self.height < 0.0
    }

    /// Opacities of the faces along each axis and against it, 0 to 1: how much of the face is
    /// covered by what looks its way, or by all across its axis. With `is_binary` the most
    /// covered face has opacity 1, and the others are in proportion.
    pub fn face_opacities(&self, faces: Faces, is_binary: bool) -> [DVec3; 2] {
        let [along, against] = self.facing;
        let areas = if faces == Faces::Both {
            [along + against; 2]
        } else {
            [along, against]
        };
        let most = areas[0].max(areas[1]).max_element();
        areas.map(|area| (area / if is_binary { most } else { 1.0 }).min(DVec3::ONE))
    }
}

/// Above this share of surface that faces against the rest, a voxel counts as opposed.
pub const OPPOSED: f64 = 0.25;

/// From this share of the squares of opposed surfaces' normals along one direction on, they are
/// parallel.
pub const PARALLEL: f64 = 0.9;

/// From this squared length of its mean normal on, a voxel's surface is one plane.
pub const ONE_PLANE: f64 = 0.9;

/// The direction that parts the two sides of a surface: its mean normal, or the axis along which
/// surfaces are opposed that are not parallel.
pub fn front_of(normal: DVec3, opposed_axis: Option<usize>) -> DVec3 {
    match opposed_axis {
        Some(axis) if normal.length_squared() < ONE_PLANE => DVec3::AXES[axis],
        _ => normal.normalize_or_zero(),
    }
}

/// The fragments of a scene, by triangle and then by voxel.
pub fn fragments(scene: &Scene, grid: &Grid) -> Vec<Fragment> {
    let all = 0..scene.triangles.len();
    let of_triangle = |index: usize| {
        let touched = touched_voxels(grid.triangle(scene, index), grid.resolution);
        touched
            .into_iter()
            .filter_map(move |voxel| fragment(scene, grid, index, voxel))
            .collect::<Vec<_>>()
    };
    all.flat_map(of_triangle).collect()
}

/// The occupied voxels of a scene.
pub fn voxelize(scene: &Scene, grid: &Grid) -> BTreeMap<VoxelIndex, VoxelSum> {
    let mut parts: BTreeMap<VoxelIndex, Vec<Fragment>> = BTreeMap::new();
    for fragment in fragments(scene, grid) {
        parts.entry(fragment.voxel).or_default().push(fragment);
    }
    parts
        .into_iter()
        .map(|(voxel, parts)| (voxel, resolve(&parts)))
        .collect()
}

/// Largest eigenvector, of unit length and either sign, and eigenvalue of a symmetric matrix with
/// none below zero.
fn main_direction(matrix: DMat3) -> (DVec3, f64) {
    let trace = |m: &DMat3| m.x_axis.x + m.y_axis.y + m.z_axis.z;
    let mut power = matrix;
    for _ in 0..6 {
        power = power * power;
        power *= 1.0 / trace(&power);
    }
    let diagonal = DVec3::new(power.x_axis.x, power.y_axis.y, power.z_axis.z);
    let direction = power.col(diagonal.max_position()).normalize();
    (direction, direction.dot(matrix * direction))
}

/// The mean of a voxel's fragments.
pub fn resolve(parts: &[Fragment]) -> VoxelSum {
    let area: f64 = parts.iter().map(Fragment::weight).sum();
    let mean = |value: fn(&Fragment) -> DVec3| {
        parts
            .iter()
            .map(|part| part.weight() * value(part))
            .sum::<DVec3>()
            / area
    };
    let across = area * mean(|part| part.normal.abs());
    let net = area * mean(|part| part.normal);
    let (along, against) = (0.5 * (across + net), 0.5 * (across - net));
    let (seen_along, seen_against, hidden) = (
        along.min(DVec3::ONE),
        against.min(DVec3::ONE),
        along.min(against),
    );
    let share = |part: DVec3| part.element_sum() / across.element_sum();
    let mut sum = VoxelSum {
        fragment_count: parts.len() as u32,
        area,
        normal: mean(|part| part.normal),
        albedo: mean(|part| part.albedo),
        mean_position: mean(|part| part.mean_position),
        emission: mean(|part| part.emission),
        coverage: across.max_element().clamp(LEAST_COVERAGE, 1.0),
        emission_ahead: 0.0,
        facing: [along, against],
        seen_from_one: share(seen_along.max(seen_against)),
        seen_from_both: share(seen_along + seen_against),
        opposed: share(hidden),
        opposed_axis: (share(hidden) > OPPOSED).then(|| hidden.max_position()),
        parallel: 0.0,
        height: 0.0,
    };
    let weighted = |part: &Fragment| part.weight() / area;
    let height = |part: &Fragment| weighted(part) * part.normal.dot(part.mean_position);
    sum.height = parts.iter().map(height).sum::<f64>() - sum.normal.dot(sum.mean_position);
    let square = |part: &Fragment| {
        let [x, y, z] = (weighted(part).sqrt() * part.normal).to_array();
        let n = DVec3::new(x, y, z);
        DMat3::from_cols(x * n, y * n, z * n)
    };
    let (direction, most) =
        main_direction(parts.iter().map(square).fold(DMat3::ZERO, |a, b| a + b));
    sum.parallel = most;
    if let Some(axis) = sum.opposed_axis.filter(|_| most >= PARALLEL) {
        sum.normal = direction * direction[axis].signum();
    }
    let emission = |parts: &mut dyn Iterator<Item = &Fragment>| {
        parts
            .map(|part| part.weight() * part.emission.element_sum())
            .sum::<f64>()
    };
    let (total, front) = (emission(&mut parts.iter()), sum.front());
    if total > 0.0 {
        sum.emission_ahead =
            emission(&mut parts.iter().filter(|part| part.normal.dot(front) >= 0.0)) / total;
    }
    sum
}

/// The fragment of a touched voxel; `None` where the mask leaves less than half of it.
fn fragment(scene: &Scene, grid: &Grid, index: usize, voxel: VoxelIndex) -> Option<Fragment> {
    let triangle = doubles(grid.triangle(scene, index));
    let polygon = clip_to_voxel(&triangle, voxel);
    let normal = (triangle[1] - triangle[0])
        .cross(triangle[2] - triangle[0])
        .normalize();
    let (area, centroid) = area_and_centroid(&polygon, triangle);
    let corner = corner_of(voxel);
    let centroid = centroid.clamp(corner, corner + 1.0);
    let uvs = footprint(triangle, centroid, normal)
        .map(|point| uv_at(scene, index, barycentric(triangle, point)))
        .collect::<Vec<_>>();
    let material = material_of(scene, index);
    let kept = mean_texture(scene, material.mask_texture, &uvs).x;
    (kept >= 0.5).then(|| Fragment {
        triangle: index as u32,
        voxel,
        polygon,
        area: area * kept,
        mean_position: centroid - corner,
        normal,
        albedo: diffuse_albedo(material) * mean_texture(scene, material.albedo_texture, &uvs),
        emission: material.emission.as_dvec3()
            * mean_texture(scene, material.emission_texture, &uvs),
    })
}

/// The part of a convex polygon inside a closed voxel: cut by its six faces in turn (Sutherland &
/// Hodgman 1974).
fn clip_to_voxel(polygon: &[DVec3], voxel: VoxelIndex) -> Vec<DVec3> {
    let corner = corner_of(voxel);
    let mut polygon = polygon.to_vec();
    for axis in 0..3 {
        polygon = clip(&polygon, |point| point[axis] - corner[axis]);
        polygon = clip(&polygon, |point| corner[axis] + 1.0 - point[axis]);
    }
    polygon
}

/// Distance from a plane that counts as in it \[voxels\]: a corner made by one face of a voxel is
/// off another by f64 rounding.
const IN_PLANE: f64 = 1e-9;

/// The part of a convex polygon where `inside` (linear) is not negative.
fn clip(polygon: &[DVec3], inside: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (index, &point) in polygon.iter().enumerate() {
        let next = polygon[(index + 1) % polygon.len()];
        let (here, there) = (inside(point), inside(next));
        if here >= -IN_PLANE {
            kept.push(point);
        }
        if (here > IN_PLANE && there < -IN_PLANE) || (here < -IN_PLANE && there > IN_PLANE) {
            kept.push(point.lerp(next, here / (here - there)));
        }
    }
    kept
}

/// Area and centroid of a flat convex polygon. Without area: the mean of its corners, or of the
/// triangle's where rounding has left none.
fn area_and_centroid(polygon: &[DVec3], triangle: [DVec3; 3]) -> (f64, DVec3) {
    let (mut area, mut moment) = (0.0, DVec3::ZERO);
    for [a, b, c] in fan(polygon) {
        let part = triangle_area(a, b, c);
        area += part;
        moment += part * (a + b + c) / 3.0;
    }
    let corners = if polygon.is_empty() {
        &triangle
    } else {
        polygon
    };
    if area > 1e-12 {
        (area, moment / area)
    } else {
        (area, corners.iter().sum::<DVec3>() / corners.len() as f64)
    }
}

pub(super) fn fan(polygon: &[DVec3]) -> impl Iterator<Item = [DVec3; 3]> + '_ {
    (2..polygon.len()).map(|index| [polygon[0], polygon[index - 1], polygon[index]])
}

pub(super) fn triangle_area(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// Points along an edge of the square over which a texture is averaged.
const FOOTPRINT_POINTS: u32 = 16;

/// Evenly spread points of a square of one voxel face, in the triangle's plane about `centre`.
fn footprint(triangle: [DVec3; 3], centre: DVec3, normal: DVec3) -> impl Iterator<Item = DVec3> {
    let across = (triangle[1] - triangle[0]).normalize();
    let along = normal.cross(across);
    let offset = |index: u32| (f64::from(index) + 0.5) / f64::from(FOOTPRINT_POINTS) - 0.5;
    (0..FOOTPRINT_POINTS * FOOTPRINT_POINTS).map(move |index| {
        centre
            + across * offset(index % FOOTPRINT_POINTS)
            + along * offset(index / FOOTPRINT_POINTS)
    })
}

/// Mean of a texture, white where there is none, over some texture coordinates (u, v), v upwards.
pub(super) fn mean_texture(scene: &Scene, texture: Option<u32>, uvs: &[DVec2]) -> DVec3 {
    let Some(texture) = texture else {
        return DVec3::ONE;
    };
    uvs.iter()
        .map(|uv| sample_texture(&scene.textures[texture as usize], *uv))
        .sum::<DVec3>()
        / uvs.len() as f64
}

fn sample_texture(texture: &Texture, uv: DVec2) -> DVec3 {
    texture
        .sample(uv.x as f32, uv.y as f32)
        .truncate()
        .as_dvec3()
}

/// ρ of the radiometric contract, without its texture: nothing of a metal is diffuse.
pub(super) fn diffuse_albedo(material: &Material) -> DVec3 {
    material.albedo.as_dvec3()
        * (1.0
            - material
                .specular
                .map_or(0.0, |specular| f64::from(specular.metalness)))
}

/// Weights of a triangle's corners at a point of its plane.
pub(super) fn barycentric(triangle: [DVec3; 3], point: DVec3) -> DVec3 {
    let [a, b, c] = triangle;
    let normal = (b - a).cross(c - a);
    let second = (point - a).cross(c - a).dot(normal) / normal.length_squared();
    let third = (b - a).cross(point - a).dot(normal) / normal.length_squared();
    DVec3::new(1.0 - second - third, second, third)
}

pub(super) fn uv_at(scene: &Scene, index: usize, weights: DVec3) -> DVec2 {
    let [a, b, c] =
        corners(scene, index).map(|vertex| DVec2::new(f64::from(vertex.u), f64::from(vertex.v)));
    weights.x * a + weights.y * b + weights.z * c
}
