//! Light on the surfaces.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::DVec3;

use super::fragments::{barycentric, diffuse_albedo, fan, mean_texture, triangle_area, uv_at};
use super::{
    Fragment, Grid, VoxelIndex, VoxelSum, corner_of, doubles, fragments, material_of, voxelize,
    world_triangle,
};
use crate::scene::{Light, Scene};

/// Expected reflected radiance of each voxel [W/(m² sr)]: the mean of ρ/π Σ E |n·ω| V over the
/// surface in it that is seen from outside, by brute-force shadow rays from `samples` points of
/// each fragment. Emission ([`VoxelSum::emission`]) comes on top. An injection through shadow maps
/// agrees statistically.
pub fn inject(scene: &Scene, grid: &Grid, samples: u32) -> BTreeMap<VoxelIndex, DVec3> {
    let voxels = voxelize(scene, grid);
    let of = |voxel: &VoxelIndex| voxels[voxel].seen_from_one / voxels[voxel].seen_from_both;
    let mean =
        |(voxel, [front, back]): (VoxelIndex, [DVec3; 2])| (voxel, of(&voxel) * (front + back));
    inject_sides(scene, grid, samples)
        .into_iter()
        .map(mean)
        .collect()
}

/// As [`inject`], of the light that leaves each side of a voxel's surface ([`VoxelSum::front`]
/// first), the area being that seen from one side.
pub fn inject_sides(scene: &Scene, grid: &Grid, samples: u32) -> BTreeMap<VoxelIndex, [DVec3; 2]> {
    let mut radiance: BTreeMap<VoxelIndex, [DVec3; 2]> = BTreeMap::new();
    each_fragment(scene, grid, |fragment, sum| {
        let mean = mean_of_fragment(scene, grid, fragment, sum.front(), samples);
        let sides = radiance.entry(fragment.voxel).or_default();
        for (side, mean) in sides.iter_mut().zip(mean) {
            *side += fragment.weight() / (sum.area * sum.seen_from_one) * mean;
        }
    });
    radiance
}

/// As [`inject_sides`], of the light that leaves each face of a voxel (+x, −x, +y, −y, +z, −z):
/// the mean over the surface with its area across the axis, the larger of what looks along it and
/// against it.
pub fn inject_faces(scene: &Scene, grid: &Grid, samples: u32) -> BTreeMap<VoxelIndex, [DVec3; 6]> {
    let mut radiance: BTreeMap<VoxelIndex, [DVec3; 6]> = BTreeMap::new();
    each_fragment(scene, grid, |fragment, sum| {
        let faces = radiance.entry(fragment.voxel).or_default();
        for axis in 0..3 {
            let across = fragment.weight() * fragment.normal[axis].abs();
            if across == 0.0 {
                continue;
            }
            let area = sum.facing[0][axis].max(sum.facing[1][axis]).min(1.0);
            let mean = mean_of_fragment(scene, grid, fragment, DVec3::AXES[axis], samples);
            for (side, mean) in mean.into_iter().enumerate() {
                faces[2 * axis + side] += across / area * mean;
            }
        }
    });
    radiance
}

/// Calls with every fragment of the scene, and with all of its voxel together.
fn each_fragment(scene: &Scene, grid: &Grid, mut call: impl FnMut(&Fragment, &VoxelSum)) {
    let voxels = voxelize(scene, grid);
    for fragment in fragments(scene, grid) {
        call(&fragment, &voxels[&fragment.voxel]);
    }
}

/// Mean radiance that a fragment reflects to the side of `front` and to the other side.
fn mean_of_fragment(
    scene: &Scene,
    grid: &Grid,
    fragment: &Fragment,
    front: DVec3,
    samples: u32,
) -> [DVec3; 2] {
    let index = fragment.triangle as usize;
    let triangle = doubles(grid.triangle(scene, index));
    mean_reflected(scene, index, samples, front, |sample| {
        barycentric(triangle, point_of(fragment, sample))
    })
}

/// Reflected radiance [W/(m² sr)] of a voxel lit as one point: ρ/π Σ E |n·ω| V at its mean
/// position, by its mean normal and albedo. Occluders nearer than `slack` \[voxels\] do not count.
pub fn shade_voxel(
    scene: &Scene,
    grid: &Grid,
    voxel: VoxelIndex,
    sum: &VoxelSum,
    slack: f64,
) -> DVec3 {
    let size_m = f64::from(grid.voxel_size);
    let point = grid.origin.as_dvec3() + size_m * (corner_of(voxel) + sum.mean_position);
    let normal = sum.normal.normalize_or_zero();
    let [front, back] = reflected(scene, point, normal, sum.albedo, normal, |light| {
        is_lit(scene, light, point, slack * size_m, None)
    });
    front + back
}

/// Normal-weighted attenuation Σ N_k² D_k of light from the unit direction `to_light` (Villegas &
/// Ramírez, equations 3 to 5): D_k = max(±ω_k, 0) for the faces on the side of the mean normal N,
/// turned to the side of `front` where there is one; |ω_k| where both sides count.
pub fn normal_weighted(mean_normal: DVec3, front: Option<DVec3>, to_light: DVec3) -> f64 {
    let normal = mean_normal.normalize();
    let facing = |axis: usize, front: DVec3| {
        (to_light[axis] * normal[axis].signum() * normal.dot(front).signum()).max(0.0)
    };
    (0..3)
        .map(|axis| {
            normal[axis].powi(2) * front.map_or(to_light[axis].abs(), |front| facing(axis, front))
        })
        .sum()
}

/// Area that a light meets first in a voxel, as the light sees it [voxel faces]. `along`² rays go
/// from the light through each face of the voxel that looks to the unit direction `to_light`. The
/// rays count that nothing stops before the voxel, and something stops within it.
pub fn lit_area(
    scene: &Scene,
    grid: &Grid,
    voxel: VoxelIndex,
    light: &Light,
    to_light: DVec3,
    along: u32,
) -> f64 {
    let size_m = f64::from(grid.voxel_size);
    let corner = grid.origin.as_dvec3() + size_m * corner_of(voxel);
    let middle = |number: u32| (f64::from(number % along) + 0.5) / f64::from(along);
    let lit_in = |axis: usize, number: u32| {
        let mut entry = DVec3::ZERO;
        entry[(axis + 1) % 3] = middle(number);
        entry[(axis + 2) % 3] = middle(number / along);
        entry[axis] = if to_light[axis] > 0.0 { 1.0 } else { 0.0 };
        let point = corner + size_m * entry;
        let (towards, ..) = arriving_light(light, point);
        let left = |axis: usize| {
            if towards[axis] > 0.0 {
                entry[axis] / towards[axis]
            } else {
                (1.0 - entry[axis]) / (-towards[axis]).max(1e-12)
            }
        };
        let chord_m = size_m * left(0).min(left(1)).min(left(2));
        let met = |(at_m, weights): &(f64, DVec3), index| {
            *at_m < chord_m && *at_m >= 0.0 && is_kept(scene, index, *weights)
        };
        let ends = |index| {
            ray_triangle(point, -towards, world_triangle(scene, index))
                .is_some_and(|hit| met(&hit, index))
        };
        let is_lit_in =
            is_lit(scene, light, point, 0.0, None) && (0..scene.triangles.len()).any(ends);
        if is_lit_in {
            (towards[axis] * to_light[axis].signum()).max(0.0)
        } else {
            0.0
        }
    };
    let face = |axis: usize| {
        (0..along * along)
            .map(|number| lit_in(axis, number))
            .sum::<f64>()
    };
    (0..3).map(face).sum::<f64>() / f64::from(along * along)
}

/// Flux that all surfaces of the scene reflect, Σ ∫ ρ E |n·ω| V dA \[W\], from `samples` points of
/// each triangle: what injection must conserve.
pub fn reflected_flux(scene: &Scene, samples: u32) -> DVec3 {
    let flux = |index: usize| {
        let [a, b, c] = world_triangle(scene, index);
        // The mean is over what the mask leaves, and so is the area.
        let kept = (0..samples)
            .filter(|sample| is_kept(scene, index, sample_weights(*sample)))
            .count() as f64
            / f64::from(samples);
        let [front, back] = mean_reflected(scene, index, samples, DVec3::Z, sample_weights);
        PI * triangle_area(a, b, c) * kept * (front + back)
    };
    (0..scene.triangles.len()).map(flux).sum()
}

/// Flux that voxels reflect, Σ π L A h² \[W\] with A the area seen from both sides, given the
/// radiance [W/(m² sr)] of each.
pub fn voxel_flux(
    voxels: &BTreeMap<VoxelIndex, VoxelSum>,
    radiance: &BTreeMap<VoxelIndex, DVec3>,
    grid: &Grid,
) -> DVec3 {
    let face_m2 = f64::from(grid.voxel_size).powi(2);
    radiance
        .iter()
        .filter_map(|(voxel, radiance)| {
            voxels
                .get(voxel)
                .map(|sum| PI * face_m2 * sum.area * sum.seen_from_both * *radiance)
        })
        .sum()
}

/// Mean radiance that a triangle reflects to the side of `front` and to the other side. The mean is
/// over the points that the mask leaves; barycentric weights by sample number give the points.
fn mean_reflected(
    scene: &Scene,
    index: usize,
    samples: u32,
    front: DVec3,
    weights_of: impl Fn(u32) -> DVec3,
) -> [DVec3; 2] {
    let triangle = world_triangle(scene, index);
    let normal = (triangle[1] - triangle[0])
        .cross(triangle[2] - triangle[0])
        .normalize();
    let material = material_of(scene, index);
    let (mut sum, mut count) = ([DVec3::ZERO; 2], 0.0f64);
    for weights in (0..samples)
        .map(weights_of)
        .filter(|weights| is_kept(scene, index, *weights))
    {
        let point = at_weights(triangle, weights);
        let texture = mean_texture(
            scene,
            material.albedo_texture,
            &[uv_at(scene, index, weights)],
        );
        let sides = reflected(
            scene,
            point,
            normal,
            diffuse_albedo(material) * texture,
            front,
            |light| is_lit(scene, light, point, 0.0, Some(index)),
        );
        sum = [sum[0] + sides[0], sum[1] + sides[1]];
        count += 1.0;
    }
    sum.map(|side| side / count.max(1.0))
}

/// ρ/π Σ E |n·ω| V, of the light that meets the surface on the side of `front`, and on the other:
/// both sides of a surface reflect.
fn reflected(
    scene: &Scene,
    point: DVec3,
    normal: DVec3,
    albedo: DVec3,
    front: DVec3,
    is_lit: impl Fn(&Light) -> bool,
) -> [DVec3; 2] {
    let mut sides = [DVec3::ZERO; 2];
    for light in scene.lights.iter().filter(|light| is_lit(light)) {
        let (to_light, _, irradiance) = arriving_light(light, point);
        let cosine = normal.dot(to_light);
        let lit_side = if cosine < 0.0 { -normal } else { normal };
        sides[usize::from(lit_side.dot(front) < 0.0)] += albedo / PI * irradiance * cosine.abs();
    }
    sides
}

/// Unit direction towards a light, distance \[m\] (infinite where parallel), and irradiance on a
/// plane that faces it [W/m²].
pub(super) fn arriving_light(light: &Light, point: DVec3) -> (DVec3, f64, DVec3) {
    match *light {
        Light::Directional {
            direction,
            irradiance,
        } => (-direction.as_dvec3(), f64::INFINITY, irradiance.as_dvec3()),
        Light::Point {
            position,
            intensity,
        } => {
            let offset = position.as_dvec3() - point;
            (
                offset.normalize(),
                offset.length(),
                intensity.as_dvec3() / offset.length_squared(),
            )
        }
        Light::Spot {
            position,
            direction,
            intensity,
            inner_deg,
            outer_deg,
        } => {
            let offset = position.as_dvec3() - point;
            let angle_deg = offset
                .normalize()
                .dot(-direction.as_dvec3())
                .clamp(-1.0, 1.0)
                .acos()
                .to_degrees();
            let (inner, outer) = (f64::from(inner_deg), f64::from(outer_deg));
            let falloff = if angle_deg <= inner {
                1.0
            } else {
                ((outer - angle_deg) / (outer - inner)).max(0.0)
            };
            (
                offset.normalize(),
                offset.length(),
                intensity.as_dvec3() * (falloff / offset.length_squared()),
            )
        }
    }
}

/// Whether no triangle but `own` lies between a point and a light, those nearer than `slack_m` not
/// counting.
fn is_lit(scene: &Scene, light: &Light, point: DVec3, slack_m: f64, own: Option<usize>) -> bool {
    // Far below any feature: a neighbour in the same plane is met at distance zero, give or take
    // f64 rounding.
    let nearest_m = slack_m.max(1e-7);
    let (to_light, distance_m, _) = arriving_light(light, point);
    let mut others = (0..scene.triangles.len()).filter(|index| Some(*index) != own);
    !others.any(|index| {
        let met = ray_triangle(point, to_light, world_triangle(scene, index));
        met.is_some_and(|(at_m, weights)| {
            at_m > nearest_m && at_m < distance_m && is_kept(scene, index, weights)
        })
    })
}

/// Distance along a ray to a closed triangle and barycentric weights there (Möller & Trumbore
/// 1997).
fn ray_triangle(origin: DVec3, direction: DVec3, triangle: [DVec3; 3]) -> Option<(f64, DVec3)> {
    let (edge_ab, edge_ac) = (triangle[1] - triangle[0], triangle[2] - triangle[0]);
    let across = direction.cross(edge_ac);
    let volume = edge_ab.dot(across);
    if volume == 0.0 {
        return None;
    }
    let offset = origin - triangle[0];
    let second = offset.dot(across) / volume;
    let third = direction.dot(offset.cross(edge_ab)) / volume;
    let weights = DVec3::new(1.0 - second - third, second, third);
    (weights.min_element() >= -1e-12)
        .then(|| (edge_ac.dot(offset.cross(edge_ab)) / volume, weights))
}

/// Whether the mask leaves the surface at a point of a triangle.
fn is_kept(scene: &Scene, index: usize, weights: DVec3) -> bool {
    mean_texture(
        scene,
        material_of(scene, index).mask_texture,
        &[uv_at(scene, index, weights)],
    )
    .x >= 0.5
}

pub(super) fn at_weights([a, b, c]: [DVec3; 3], weights: DVec3) -> DVec3 {
    weights.x * a + weights.y * b + weights.z * c
}

/// Low-discrepancy point of the unit cube: multiples of powers of the inverse plastic-like number
/// (Roberts 2018, "R₃").
fn low_discrepancy(sample: u32) -> DVec3 {
    // The root of x⁴ = x + 1.
    let root = 1.220_744_084_605_759_5_f64;
    DVec3::from([1, 2, 3].map(|power| (0.5 + f64::from(sample + 1) * root.powi(-power)).fract()))
}

/// Barycentric weights of a sample, uniform over a triangle (Turk 1990).
pub(super) fn sample_weights(sample: u32) -> DVec3 {
    let [u, v, _] = low_discrepancy(sample).to_array();
    let root = u.sqrt();
    DVec3::new(1.0 - root, root * (1.0 - v), root * v)
}

/// A point of a fragment's outline, uniform over its area; its centroid where it has none
/// \[voxels\].
fn point_of(fragment: &Fragment, sample: u32) -> DVec3 {
    let parts: Vec<[DVec3; 3]> = fan(&fragment.polygon).collect();
    let area: f64 = parts
        .iter()
        .map(|[a, b, c]| triangle_area(*a, *b, *c))
        .sum();
    let mut left = low_discrepancy(sample).z * area;
    for part in parts {
        let [a, b, c] = part;
        let own = triangle_area(a, b, c);
        if left < own {
            return at_weights(part, sample_weights(sample));
        }
        left -= own;
    }
    corner_of(fragment.voxel) + fragment.mean_position
}
