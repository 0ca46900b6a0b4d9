//! CPU twins of the voxel passes: what `voxel.fragments`, `voxel.resolve`, the compact index, `voxel.light` and `voxel.gather_rays` must give.
//!
//! Everything is naive: every voxel against every triangle, every ray against every voxel, every shadow ray against every triangle, in f64. The one
//! thing in f32 is the position of a vertex in the grid ([`Grid::position`]), because that rounding *defines* the surface that is voxelized.
//! Lengths are voxels (grid space) unless a name ends in `_m`; areas are voxel faces, h² each; light is in the units of the radiometric contract.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec3};

use crate::scene::{Light, Material, Scene, Texture, Vertex};

/// A triangle in grid space \[voxels\], as the GPU has it.
pub type GridTriangle = [[f32; 3]; 3];

/// Coordinates of a voxel, 0 to resolution − 1.
pub type VoxelIndex = [u32; 3];

/// Smallest weight of a fragment [voxel faces]: a voxel that is touched but holds no area still has a mean.
pub const LEAST_WEIGHT: f64 = 1.0 / 16384.0;

/// Smallest coverage of an occupied voxel.
pub const LEAST_COVERAGE: f64 = 1.0 / 255.0;

/// Where the voxels lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Smallest corner, world space \[m\].
    pub origin: Vec3,
    /// Edge of a voxel, h \[m\].
    pub voxel_size: f32,
    /// Voxels along an edge of the grid.
    pub resolution: u32,
}

impl Grid {
    /// Grid position of a vertex \[voxels\]: `(p − origin) · (1 / h)` in f32, each operation rounded (IEEE 754, not contracted).
    pub fn position(&self, position_ws: [f32; 3]) -> [f32; 3] {
        let inverse_size = 1.0 / self.voxel_size;
        let origin = self.origin.to_array();
        std::array::from_fn(|axis| (position_ws[axis] - origin[axis]) * inverse_size)
    }

    fn triangle(&self, scene: &Scene, index: usize) -> GridTriangle {
        corners(scene, index).map(|vertex| self.position(vertex.position))
    }
}

// ---------------------------------------------------------------------------------------------------------------------------------------------------
// Which voxels a triangle touches

/// One separating axis: a direction and the interval that the triangle covers along it.
struct Axis {
    direction: DVec3,
    low: f64,
    high: f64,
}

impl Axis {
    fn new(direction: DVec3, triangle: [DVec3; 3]) -> Axis {
        let along = triangle.map(|vertex| direction.dot(vertex));
        Axis { direction, low: along[0].min(along[1]).min(along[2]), high: along[0].max(along[1]).max(along[2]) }
    }

    /// Gap between triangle and box \[voxels\]; negative is overlap. Divided by the axis' length last, so that exact inputs touch exactly.
    fn gap(&self, voxel: VoxelIndex) -> f64 {
        let centre = self.direction.dot(corner_of(voxel) + 0.5);
        let radius = 0.5 * (self.direction.x.abs() + self.direction.y.abs() + self.direction.z.abs());
        (self.low - (centre + radius)).max((centre - radius) - self.high) / self.direction.length()
    }
}

/// The axes of the separating axis theorem for a triangle and a box: three faces, the triangle's plane, nine cross products of edges
/// (Gottschalk et al. 1996; Akenine-Möller 2001). A cross product that vanishes separates nothing that the others do not.
fn separating_axes(triangle: [DVec3; 3]) -> Vec<Axis> {
    let [a, b, c] = triangle;
    let edges = [b - a, c - b, a - c];
    let crossed = edges.iter().flat_map(|edge| DVec3::AXES.map(|axis| axis.cross(*edge)));
    let directions = DVec3::AXES.into_iter().chain([(b - a).cross(c - a)]).chain(crossed);
    directions.filter(|direction| *direction != DVec3::ZERO).map(|direction| Axis::new(direction, triangle)).collect()
}

/// Whether the triangle has no area as the GPU sees it: its cross product, in f32, is zero. Such a triangle is skipped.
pub fn is_degenerate(triangle: GridTriangle) -> bool {
    let [a, b, c] = triangle;
    let ab: [f32; 3] = std::array::from_fn(|axis| b[axis] - a[axis]);
    let ac: [f32; 3] = std::array::from_fn(|axis| c[axis] - a[axis]);
    let component = |i: usize, j: usize| ab[i] * ac[j] - ab[j] * ac[i];
    component(1, 2) == 0.0 && component(2, 0) == 0.0 && component(0, 1) == 0.0
}

/// A voxel near a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// The voxel.
    pub voxel: VoxelIndex,
    /// Largest gap between closed triangle and closed box over the 13 axes, along unit vectors \[voxels\]: touching is ≤ 0. A lower bound of the
    /// distance where positive, the depth of the overlap where negative.
    pub separation: f64,
}

/// All voxels of the grid that meet the triangle's bounding box enlarged by `reach` voxels, each with its separation; none for a degenerate triangle.
/// Two implementations may disagree only where |separation| is within their rounding.
pub fn candidates(triangle: GridTriangle, resolution: u32, reach: f64) -> Vec<Candidate> {
    let mut found = Vec::new();
    if is_degenerate(triangle) {
        return found;
    }
    let axes = separating_axes(doubles(triangle));
    // The closed box [i, i + 1] meets [low, high] where i ≥ ⌈low⌉ − 1 and i ≤ ⌊high⌋.
    let range = |axis: usize| {
        let along = triangle.map(|vertex| f64::from(vertex[axis]));
        let low = along[0].min(along[1]).min(along[2]) - reach;
        let high = along[0].max(along[1]).max(along[2]) + reach;
        (low.ceil() as i64 - 1).max(0)..=(high.floor() as i64).min(i64::from(resolution) - 1)
    };
    for x in range(0) {
        for y in range(1) {
            for z in range(2) {
                let voxel = [x as u32, y as u32, z as u32];
                let separation = axes.iter().map(|axis| axis.gap(voxel)).fold(f64::NEG_INFINITY, f64::max);
                found.push(Candidate { voxel, separation });
            }
        }
    }
    found
}

/// The voxels that the closed triangle touches, as closed boxes, in ascending order; none for a degenerate triangle.
pub fn touched_voxels(triangle: GridTriangle, resolution: u32) -> Vec<VoxelIndex> {
    candidates(triangle, resolution, 0.0).into_iter().filter(|candidate| candidate.separation <= 0.0).map(|candidate| candidate.voxel).collect()
}

// ---------------------------------------------------------------------------------------------------------------------------------------------------
// What lies in each voxel

/// One triangle's part of one voxel.
#[derive(Clone, Debug, PartialEq)]
pub struct Fragment {
    /// Index into [`Scene::triangles`].
    pub triangle: u32,
    /// The voxel.
    pub voxel: VoxelIndex,
    /// The part's outline, grid space \[voxels\]; fewer than three corners where the triangle only touches the voxel.
    pub polygon: Vec<DVec3>,
    /// Area of the part that the mask leaves [voxel faces]. A triangle in the common face of two voxels counts in both.
    pub area: f64,
    /// Centroid of the part from the voxel's smallest corner \[voxels\], 0 to 1; of a part without area, the mean of its corners.
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
    /// Mean normal, not of unit length.
    pub normal: DVec3,
    /// Mean diffuse albedo.
    pub albedo: DVec3,
    /// Centroid from the voxel's smallest corner \[voxels\], 0 to 1.
    pub mean_position: DVec3,
    /// Mean emitted radiance [W/(m² sr)].
    pub emission: DVec3,
    /// Largest of Σ weight · |normal| over the three axes, [`LEAST_COVERAGE`] to 1: the opacity where coverage is asked for.
    pub coverage: f64,
}

/// The fragments of a scene, by triangle and then by voxel.
pub fn fragments(scene: &Scene, grid: &Grid) -> Vec<Fragment> {
    let all = 0..scene.triangles.len();
    let of_triangle = |index: usize| {
        let touched = touched_voxels(grid.triangle(scene, index), grid.resolution);
        touched.into_iter().filter_map(move |voxel| fragment(scene, grid, index, voxel)).collect::<Vec<_>>()
    };
    all.flat_map(of_triangle).collect()
}

/// The occupied voxels of a scene.
pub fn voxelize(scene: &Scene, grid: &Grid) -> BTreeMap<VoxelIndex, VoxelSum> {
    let mut parts: BTreeMap<VoxelIndex, Vec<Fragment>> = BTreeMap::new();
    for fragment in fragments(scene, grid) {
        parts.entry(fragment.voxel).or_default().push(fragment);
    }
    parts.into_iter().map(|(voxel, parts)| (voxel, resolve(&parts))).collect()
}

/// The mean of a voxel's fragments.
pub fn resolve(parts: &[Fragment]) -> VoxelSum {
    let area: f64 = parts.iter().map(Fragment::weight).sum();
    let mean = |value: fn(&Fragment) -> DVec3| parts.iter().map(|part| part.weight() * value(part)).sum::<DVec3>() / area;
    VoxelSum {
        fragment_count: parts.len() as u32,
        area,
        normal: mean(|part| part.normal),
        albedo: mean(|part| part.albedo),
        mean_position: mean(|part| part.mean_position),
        emission: mean(|part| part.emission),
        coverage: (area * mean(|part| part.normal.abs())).max_element().clamp(LEAST_COVERAGE, 1.0),
    }
}

/// The fragment of a touched voxel; `None` where the mask leaves less than half of it.
fn fragment(scene: &Scene, grid: &Grid, index: usize, voxel: VoxelIndex) -> Option<Fragment> {
    let triangle = doubles(grid.triangle(scene, index));
    let polygon = clip_to_voxel(&triangle, voxel);
    let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalize();
    let (area, centroid) = area_and_centroid(&polygon, triangle);
    let corner = corner_of(voxel);
    let centroid = centroid.clamp(corner, corner + 1.0);
    let uvs = footprint(triangle, centroid, normal).map(|point| uv_at(scene, index, barycentric(triangle, point))).collect::<Vec<_>>();
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
        emission: material.emission.as_dvec3() * mean_texture(scene, material.emission_texture, &uvs),
    })
}

/// The part of a convex polygon inside a closed voxel: cut by its six faces in turn (Sutherland & Hodgman 1974).
fn clip_to_voxel(polygon: &[DVec3], voxel: VoxelIndex) -> Vec<DVec3> {
    let corner = corner_of(voxel);
    let mut polygon = polygon.to_vec();
    for axis in 0..3 {
        polygon = clip(&polygon, |point| point[axis] - corner[axis]);
        polygon = clip(&polygon, |point| corner[axis] + 1.0 - point[axis]);
    }
    polygon
}

/// The part of a convex polygon where `inside` (linear) is not negative.
fn clip(polygon: &[DVec3], inside: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (index, &point) in polygon.iter().enumerate() {
        let next = polygon[(index + 1) % polygon.len()];
        let (here, there) = (inside(point), inside(next));
        if here >= 0.0 {
            kept.push(point);
        }
        if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
            kept.push(point.lerp(next, here / (here - there)));
        }
    }
    kept
}

/// Area and centroid of a flat convex polygon. Without area: the mean of its corners, or of the triangle's where rounding has left none.
fn area_and_centroid(polygon: &[DVec3], triangle: [DVec3; 3]) -> (f64, DVec3) {
    let (mut area, mut moment) = (0.0, DVec3::ZERO);
    for [a, b, c] in fan(polygon) {
        let part = triangle_area(a, b, c);
        area += part;
        moment += part * (a + b + c) / 3.0;
    }
    let corners = if polygon.is_empty() { &triangle } else { polygon };
    if area > 1e-12 { (area, moment / area) } else { (area, corners.iter().sum::<DVec3>() / corners.len() as f64) }
}

fn fan(polygon: &[DVec3]) -> impl Iterator<Item = [DVec3; 3]> + '_ {
    (2..polygon.len()).map(|index| [polygon[0], polygon[index - 1], polygon[index]])
}

fn triangle_area(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// Points along an edge of the square over which a texture is averaged.
const FOOTPRINT_POINTS: u32 = 16;

/// Evenly spread points of a square of one voxel face, in the triangle's plane about `centre`.
fn footprint(triangle: [DVec3; 3], centre: DVec3, normal: DVec3) -> impl Iterator<Item = DVec3> {
    let across = (triangle[1] - triangle[0]).normalize();
    let along = normal.cross(across);
    let offset = |index: u32| (f64::from(index) + 0.5) / f64::from(FOOTPRINT_POINTS) - 0.5;
    (0..FOOTPRINT_POINTS * FOOTPRINT_POINTS).map(move |index| centre + across * offset(index % FOOTPRINT_POINTS) + along * offset(index / FOOTPRINT_POINTS))
}

/// Mean of a texture, white where there is none, over some texture coordinates (u, v), v upwards.
fn mean_texture(scene: &Scene, texture: Option<u32>, uvs: &[DVec2]) -> DVec3 {
    let Some(texture) = texture else { return DVec3::ONE };
    uvs.iter().map(|uv| sample_texture(&scene.textures[texture as usize], *uv)).sum::<DVec3>() / uvs.len() as f64
}

fn sample_texture(texture: &Texture, uv: DVec2) -> DVec3 {
    texture.sample(uv.x as f32, uv.y as f32).truncate().as_dvec3()
}

/// ρ of the radiometric contract, without its texture: nothing of a metal is diffuse.
fn diffuse_albedo(material: &Material) -> DVec3 {
    material.albedo.as_dvec3() * (1.0 - material.specular.map_or(0.0, |specular| f64::from(specular.metalness)))
}

/// Weights of a triangle's corners at a point of its plane.
fn barycentric(triangle: [DVec3; 3], point: DVec3) -> DVec3 {
    let [a, b, c] = triangle;
    let normal = (b - a).cross(c - a);
    let second = (point - a).cross(c - a).dot(normal) / normal.length_squared();
    let third = (b - a).cross(point - a).dot(normal) / normal.length_squared();
    DVec3::new(1.0 - second - third, second, third)
}

fn uv_at(scene: &Scene, index: usize, weights: DVec3) -> DVec2 {
    let [a, b, c] = corners(scene, index).map(|vertex| DVec2::new(f64::from(vertex.u), f64::from(vertex.v)));
    weights.x * a + weights.y * b + weights.z * c
}

fn corners(scene: &Scene, index: usize) -> [Vertex; 3] {
    scene.triangles[index].vertices.map(|vertex| scene.vertices[vertex as usize])
}

fn world_triangle(scene: &Scene, index: usize) -> [DVec3; 3] {
    doubles(corners(scene, index).map(|vertex| vertex.position))
}

fn material_of(scene: &Scene, index: usize) -> &Material {
    &scene.materials[scene.triangles[index].material as usize]
}

fn doubles(triangle: GridTriangle) -> [DVec3; 3] {
    triangle.map(|vertex| Vec3::from(vertex).as_dvec3())
}

fn corner_of(voxel: VoxelIndex) -> DVec3 {
    DVec3::from(voxel.map(f64::from))
}

// ---------------------------------------------------------------------------------------------------------------------------------------------------
// The compact index

/// Occupied voxels in the order of their compact index: by block of 4×4×4 (z, then y, then x), within a block likewise.
pub fn compact_order(voxels: impl IntoIterator<Item = VoxelIndex>) -> Vec<VoxelIndex> {
    let key = |[x, y, z]: &VoxelIndex| [z / 4, y / 4, x / 4, z % 4, y % 4, x % 4];
    let mut ordered = voxels.into_iter().collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>();
    ordered.sort_by_key(key);
    ordered
}

/// Occupancy as stored: for each block, x fastest, two words of 32 bits; bit x + 4 y + 16 z of a block is its voxel (x, y, z). `resolution` is a
/// multiple of 4.
pub fn occupancy_words(voxels: impl IntoIterator<Item = VoxelIndex>, resolution: u32) -> Vec<u32> {
    let blocks = resolution / 4;
    let mut words = vec![0; 2 * (blocks as usize).pow(3)];
    for [x, y, z] in voxels {
        let block = x / 4 + blocks * (y / 4) + blocks * blocks * (z / 4);
        let bit = x % 4 + 4 * (y % 4) + 16 * (z % 4);
        words[(2 * block + bit / 32) as usize] |= 1 << (bit % 32);
    }
    words
}

/// For each block, the compact index of its first occupied voxel: the occupied voxels of all blocks before it.
pub fn block_bases(words: &[u32]) -> Vec<u32> {
    let counts = words.chunks(2).map(|block| block.iter().map(|word| word.count_ones()).sum::<u32>());
    counts.scan(0, |base, count| Some(std::mem::replace(base, *base + count))).collect()
}

// ---------------------------------------------------------------------------------------------------------------------------------------------------
// Rays through the voxels

/// What a ray needs to know of an occupied voxel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TraceVoxel {
    /// Centroid of the surface from the voxel's smallest corner \[voxels\].
    pub mean_position: DVec3,
    /// Mean normal, not of unit length.
    pub mean_normal: DVec3,
    /// Radiance [W/(m² sr)].
    pub radiance: DVec3,
}

/// The occupied voxels that rays can hit.
#[derive(Clone, Debug, Default)]
pub struct TraceGrid {
    /// Voxels along an edge of the grid.
    pub resolution: u32,
    /// The occupied voxels.
    pub voxels: BTreeMap<VoxelIndex, TraceVoxel>,
}

/// A surface point that looks at the voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Grid position \[voxels\].
    pub position: DVec3,
    /// Unit normal of the surface, towards the viewer.
    pub geometric_normal: DVec3,
    /// Unit normal about which directions are distributed.
    pub shading_normal: DVec3,
}

/// What counts as a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceSettings {
    /// A voxel whose mean position lies lower than this over the receiver's tangent plane is the receiver itself \[voxels\].
    pub self_height: f64,
    /// A ray must meet the voxel's own plane within the voxel enlarged by this \[voxels\]; negative: every voxel that it passes through is hit.
    pub contour_slack: f64,
}

/// A ray's way through one occupied voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The voxel.
    pub voxel: VoxelIndex,
    /// Distance at which the ray enters it, 0 where it starts inside \[voxels\].
    pub entry: f64,
    /// Distance at which the ray leaves it \[voxels\]: where exit − entry is within rounding, the ray only grazes the voxel.
    pub exit: f64,
    /// How far the ray is from the other decision \[voxels\]: not negative is a hit, negative a miss.
    pub margin: f64,
}

/// The end of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TraceEnd {
    /// The first voxel hit.
    Hit(Crossing),
    /// Nothing: the ray leaves the grid at this distance \[voxels\], 0 where it starts outside.
    Miss(f64),
}

/// Every occupied voxel whose inside a ray from inside the grid passes through, by distance of entry.
pub fn crossings(grid: &TraceGrid, origin: DVec3, direction: DVec3, receiver: &Receiver, settings: &TraceSettings) -> Vec<Crossing> {
    let crossing = |(&voxel, surface): (&VoxelIndex, &TraceVoxel)| {
        let (entry, exit) = box_interval(origin, direction, corner_of(voxel), 1.0)?;
        (exit > entry).then(|| Crossing { voxel, entry, exit, margin: hit_margin(voxel, surface, origin, direction, receiver, settings) })
    };
    let starts_inside = origin.cmpge(DVec3::ZERO).all() && origin.cmplt(DVec3::splat(f64::from(grid.resolution))).all();
    let mut found: Vec<Crossing> = grid.voxels.iter().filter(|_| starts_inside).filter_map(crossing).collect();
    found.sort_by(|a, b| a.entry.total_cmp(&b.entry));
    found
}

/// The first hit of a ray.
pub fn trace(grid: &TraceGrid, origin: DVec3, direction: DVec3, receiver: &Receiver, settings: &TraceSettings) -> TraceEnd {
    let leaves = || box_interval(origin, direction, DVec3::ZERO, f64::from(grid.resolution)).map_or(0.0, |(entry, exit)| if entry > 0.0 { 0.0 } else { exit });
    let first = crossings(grid, origin, direction, receiver, settings).into_iter().find(|crossing| crossing.margin >= 0.0);
    first.map_or_else(|| TraceEnd::Miss(leaves()), TraceEnd::Hit)
}

/// Distances, not negative, between which a ray is inside a closed cube.
fn box_interval(origin: DVec3, direction: DVec3, corner: DVec3, edge: f64) -> Option<(f64, f64)> {
    let (mut entry, mut exit) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let (low, high) = (corner[axis] - origin[axis], corner[axis] + edge - origin[axis]);
        if direction[axis] == 0.0 {
            if low > 0.0 || high < 0.0 {
                return None;
            }
            continue;
        }
        let (first, second) = (low / direction[axis], high / direction[axis]);
        entry = entry.max(first.min(second));
        exit = exit.min(first.max(second));
    }
    (entry <= exit).then_some((entry, exit))
}

/// Below this squared length of the mean normal a voxel holds several planes, and the whole of it is hit.
const ONE_PLANE: f64 = 0.9;

/// Below this cosine a ray runs along the voxel's plane, and the whole voxel is hit.
const ALONG_PLANE: f64 = 1e-3;

/// Margin of the two rules: the surface is not the receiver itself, and the ray meets the voxel's plane within the enlarged voxel.
fn hit_margin(voxel: VoxelIndex, surface: &TraceVoxel, origin: DVec3, direction: DVec3, receiver: &Receiver, settings: &TraceSettings) -> f64 {
    let position = corner_of(voxel) + surface.mean_position;
    let height = (position - receiver.position).dot(receiver.geometric_normal) - settings.self_height;
    let normal = surface.mean_normal;
    let cosine = normal.dot(direction);
    if settings.contour_slack < 0.0 || normal.length_squared() < ONE_PLANE || cosine.abs() < ALONG_PLANE {
        return height;
    }
    let met = origin + direction * (normal.dot(position - origin) / cosine) - corner_of(voxel);
    let inside = met.min(1.0 - met) + settings.contour_slack;
    height.min(inside.min_element())
}

/// Settings of a gather by rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GatherSettings {
    /// Number of rays.
    pub ray_count: u32,
    /// Distance of the rays' origin from the surface along the geometric normal \[voxels\].
    pub start_offset: f64,
    /// What counts as a hit.
    pub trace: TraceSettings,
    /// λ of the ambient visibility's 1 / (1 + λ r), for distances in voxels [1/voxel].
    pub ao_falloff: f64,
    /// Two numbers of [0, 1) that shift sin²θ by a part of a stratum and the azimuth by a part of a turn ([`interleaved_offset`]).
    pub pattern: DVec2,
    /// Constant radiance of the environment [W/(m² sr)].
    pub environment: DVec3,
}

/// What reaches a surface point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gathered {
    /// Indirect diffuse irradiance E [W/m²].
    pub irradiance: DVec3,
    /// 1 − occlusion, an occluder at distance r counting 1 / (1 + λ r).
    pub visibility: f64,
}

/// E = π / n Σ L_i over n cosine-distributed directions: sin²θ is stratified and azimuths are golden angles apart (Vogel 1979). A direction below the
/// geometric surface sees nothing.
pub fn gather_rays(grid: &TraceGrid, receiver: &Receiver, settings: &GatherSettings) -> Gathered {
    let golden_angle = PI * (3.0 - 5f64.sqrt());
    let count = f64::from(settings.ray_count);
    let origin = receiver.position + settings.start_offset * receiver.geometric_normal;
    let (mut radiance, mut occlusion) = (DVec3::ZERO, 0.0);
    for ray in (0..settings.ray_count).map(f64::from) {
        let direction = hemisphere_direction(receiver.shading_normal, (ray + settings.pattern.x) / count, ray * golden_angle + settings.pattern.y * 2.0 * PI);
        if direction.dot(receiver.geometric_normal) <= 0.0 {
            continue;
        }
        match trace(grid, origin, direction, receiver, &settings.trace) {
            TraceEnd::Miss(_) => radiance += settings.environment,
            TraceEnd::Hit(hit) => {
                radiance += grid.voxels[&hit.voxel].radiance;
                occlusion += 1.0 / (1.0 + settings.ao_falloff * hit.entry);
            }
        }
    }
    Gathered { irradiance: PI / count * radiance, visibility: 1.0 - occlusion / count }
}

/// Direction at sin²θ and azimuth φ \[rad\] about a unit normal, in the tangent frame of Duff et al. 2017 ("Building an orthonormal basis, revisited").
pub fn hemisphere_direction(normal: DVec3, sin_squared: f64, azimuth_rad: f64) -> DVec3 {
    let sign = if normal.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    let tangent = DVec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x);
    let bitangent = DVec3::new(b, sign + normal.y * normal.y * a, -normal.y);
    let sine = sin_squared.clamp(0.0, 1.0).sqrt();
    sine * azimuth_rad.cos() * tangent + sine * azimuth_rad.sin() * bitangent + (1.0 - sin_squared).max(0.0).sqrt() * normal
}

/// The pattern of a pixel: points of an n²-point Hammersley set, repeated every n×n pixels; consecutive points lie 1/7 of a turn through the tile apart.
pub fn interleaved_offset(pixel: [u32; 2], n: u32) -> DVec2 {
    let count = n * n;
    let index = (pixel[0] % n + n * (pixel[1] % n)) * 7 % count;
    let radical_inverse = (0..32).filter(|bit| index >> bit & 1 == 1).map(|bit| 0.5f64.powi(bit + 1)).sum();
    DVec2::new((f64::from(index) + 0.5) / f64::from(count), radical_inverse)
}

// ---------------------------------------------------------------------------------------------------------------------------------------------------
// Light on the surfaces

/// Expected reflected radiance of each voxel [W/(m² sr)]: the mean of ρ/π Σ E |n·ω| V over the surface in it, by brute-force shadow rays from
/// `samples` points of each fragment. Emission ([`VoxelSum::emission`]) comes on top. An injection through shadow maps agrees statistically.
pub fn inject(scene: &Scene, grid: &Grid, samples: u32) -> BTreeMap<VoxelIndex, DVec3> {
    let mut sums: BTreeMap<VoxelIndex, (DVec3, f64)> = BTreeMap::new();
    for fragment in fragments(scene, grid) {
        let index = fragment.triangle as usize;
        let triangle = doubles(grid.triangle(scene, index));
        let mean = mean_reflected(scene, index, samples, |sample| barycentric(triangle, point_of(&fragment, sample)));
        let (sum, weight) = sums.entry(fragment.voxel).or_default();
        *sum += fragment.weight() * mean;
        *weight += fragment.weight();
    }
    sums.into_iter().map(|(voxel, (sum, weight))| (voxel, sum / weight)).collect()
}

/// Reflected radiance [W/(m² sr)] of a voxel lit as one point: ρ/π Σ E |n·ω| V at its mean position, by its mean normal and albedo. Occluders nearer
/// than `slack` \[voxels\] do not count.
pub fn shade_voxel(scene: &Scene, grid: &Grid, voxel: VoxelIndex, sum: &VoxelSum, slack: f64) -> DVec3 {
    let size_m = f64::from(grid.voxel_size);
    let point = grid.origin.as_dvec3() + size_m * (corner_of(voxel) + sum.mean_position);
    reflected(scene, point, sum.normal.normalize_or_zero(), sum.albedo, |light| is_lit(scene, light, point, slack * size_m, None))
}

/// Flux that all surfaces of the scene reflect, Σ ∫ ρ E |n·ω| V dA \[W\], from `samples` points of each triangle: what injection must conserve.
pub fn reflected_flux(scene: &Scene, samples: u32) -> DVec3 {
    let flux = |index: usize| {
        let [a, b, c] = world_triangle(scene, index);
        // The mean is over what the mask leaves, and so is the area.
        let kept = (0..samples).filter(|sample| is_kept(scene, index, sample_weights(*sample))).count() as f64 / f64::from(samples);
        PI * triangle_area(a, b, c) * kept * mean_reflected(scene, index, samples, sample_weights)
    };
    (0..scene.triangles.len()).map(flux).sum()
}

/// Flux that voxels reflect, Σ π L A h² \[W\], given the radiance [W/(m² sr)] of each.
pub fn voxel_flux(voxels: &BTreeMap<VoxelIndex, VoxelSum>, radiance: &BTreeMap<VoxelIndex, DVec3>, grid: &Grid) -> DVec3 {
    let face_m2 = f64::from(grid.voxel_size).powi(2);
    radiance.iter().filter_map(|(voxel, radiance)| voxels.get(voxel).map(|sum| PI * face_m2 * sum.area * *radiance)).sum()
}

/// Mean radiance that a triangle reflects over those of its points, given as barycentric weights by sample number, that the mask leaves.
fn mean_reflected(scene: &Scene, index: usize, samples: u32, weights_of: impl Fn(u32) -> DVec3) -> DVec3 {
    let triangle = world_triangle(scene, index);
    let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalize();
    let material = material_of(scene, index);
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for weights in (0..samples).map(weights_of).filter(|weights| is_kept(scene, index, *weights)) {
        let point = at_weights(triangle, weights);
        let texture = mean_texture(scene, material.albedo_texture, &[uv_at(scene, index, weights)]);
        sum += reflected(scene, point, normal, diffuse_albedo(material) * texture, |light| is_lit(scene, light, point, 0.0, Some(index)));
        count += 1.0;
    }
    if count > 0.0 { sum / count } else { DVec3::ZERO }
}

/// ρ/π Σ E |n·ω| V: both sides of a surface reflect.
fn reflected(scene: &Scene, point: DVec3, normal: DVec3, albedo: DVec3, is_lit: impl Fn(&Light) -> bool) -> DVec3 {
    let arriving = |light: &Light| {
        let (to_light, _, irradiance) = arriving_light(light, point);
        irradiance * normal.dot(to_light).abs()
    };
    albedo / PI * scene.lights.iter().filter(|light| is_lit(light)).map(arriving).sum::<DVec3>()
}

/// Unit direction towards a light, distance \[m\] (infinite where parallel), and irradiance on a plane that faces it [W/m²].
fn arriving_light(light: &Light, point: DVec3) -> (DVec3, f64, DVec3) {
    match *light {
        Light::Directional { direction, irradiance } => (-direction.as_dvec3(), f64::INFINITY, irradiance.as_dvec3()),
        Light::Point { position, intensity } => {
            let offset = position.as_dvec3() - point;
            (offset.normalize(), offset.length(), intensity.as_dvec3() / offset.length_squared())
        }
        Light::Spot { position, direction, intensity, inner_deg, outer_deg } => {
            let offset = position.as_dvec3() - point;
            let angle_deg = offset.normalize().dot(-direction.as_dvec3()).clamp(-1.0, 1.0).acos().to_degrees();
            let (inner, outer) = (f64::from(inner_deg), f64::from(outer_deg));
            let falloff = if angle_deg <= inner { 1.0 } else { ((outer - angle_deg) / (outer - inner)).max(0.0) };
            (offset.normalize(), offset.length(), intensity.as_dvec3() * (falloff / offset.length_squared()))
        }
    }
}

/// Whether no triangle but `own` lies between a point and a light, those nearer than `slack_m` not counting.
fn is_lit(scene: &Scene, light: &Light, point: DVec3, slack_m: f64, own: Option<usize>) -> bool {
    // Far below any feature: a neighbour in the same plane is met at distance zero, give or take f64 rounding.
    let nearest_m = slack_m.max(1e-7);
    let (to_light, distance_m, _) = arriving_light(light, point);
    let mut others = (0..scene.triangles.len()).filter(|index| Some(*index) != own);
    !others.any(|index| {
        let met = ray_triangle(point, to_light, world_triangle(scene, index));
        met.is_some_and(|(at_m, weights)| at_m > nearest_m && at_m < distance_m && is_kept(scene, index, weights))
    })
}

/// Distance along a ray to a closed triangle and barycentric weights there (Möller & Trumbore 1997).
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
    (weights.min_element() >= -1e-12).then(|| (edge_ac.dot(offset.cross(edge_ab)) / volume, weights))
}

/// Whether the mask leaves the surface at a point of a triangle.
fn is_kept(scene: &Scene, index: usize, weights: DVec3) -> bool {
    mean_texture(scene, material_of(scene, index).mask_texture, &[uv_at(scene, index, weights)]).x >= 0.5
}

fn at_weights([a, b, c]: [DVec3; 3], weights: DVec3) -> DVec3 {
    weights.x * a + weights.y * b + weights.z * c
}

/// Low-discrepancy point of the unit cube: multiples of powers of the inverse plastic-like number (Roberts 2018, "R₃").
fn low_discrepancy(sample: u32) -> DVec3 {
    // The root of x⁴ = x + 1.
    let root = 1.220_744_084_605_759_5_f64;
    DVec3::from([1, 2, 3].map(|power| (0.5 + f64::from(sample + 1) * root.powi(-power)).fract()))
}

/// Barycentric weights of a sample, uniform over a triangle (Turk 1990).
fn sample_weights(sample: u32) -> DVec3 {
    let [u, v, _] = low_discrepancy(sample).to_array();
    let root = u.sqrt();
    DVec3::new(1.0 - root, root * (1.0 - v), root * v)
}

/// A point of a fragment's outline, uniform over its area; its centroid where it has none \[voxels\].
fn point_of(fragment: &Fragment, sample: u32) -> DVec3 {
    let parts: Vec<[DVec3; 3]> = fan(&fragment.polygon).collect();
    let area: f64 = parts.iter().map(|[a, b, c]| triangle_area(*a, *b, *c)).sum();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Specular, TextureKind, Triangle};

    const UNIT_GRID: Grid = Grid { origin: Vec3::ZERO, voxel_size: 1.0, resolution: 4 };

    /// A scene of matt triangles, each with an albedo; the texture coordinates are (x, y).
    fn scene_of(triangles: &[(GridTriangle, f32)]) -> Scene {
        let mut scene = Scene::default();
        for (corners, albedo) in triangles {
            let first = scene.vertices.len() as u32;
            let material = scene.materials.len() as u32;
            scene.vertices.extend(corners.map(|position| Vertex { position, u: position[0], normal: [0.0, 0.0, 1.0], v: position[1] }));
            scene.triangles.push(Triangle { vertices: [first, first + 1, first + 2], material });
            scene.materials.push(Material { albedo: Vec3::splat(*albedo), ..Material::default() });
        }
        scene
    }

    /// A square of side `size` from the origin, at height z, facing up, in two triangles.
    fn floor(size: f32, z: f32, albedo: f32) -> [(GridTriangle, f32); 2] {
        let corner = |x: f32, y: f32| [x * size, y * size, z];
        [([corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0)], albedo), ([corner(0.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)], albedo)]
    }

    fn texture(kind: TextureKind, texels: &[[u8; 4]]) -> Texture {
        Texture { name: String::from("test"), kind, width: texels.len() as u32, height: 1, texels: texels.to_vec() }
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-9
    }

    fn near(a: DVec3, b: DVec3) -> bool {
        (a - b).abs().max_element() < 1e-9
    }

    #[test]
    fn grid_position_is_rounded_in_f32() {
        let grid = Grid { origin: Vec3::new(-1.0, 0.5, 0.0), voxel_size: 0.3, resolution: 64 };
        let inverse = 1.0f32 / 0.3f32;
        assert_eq!(grid.position([2.0, 0.5, 0.1]), [3.0 * inverse, 0.0, 0.1 * inverse]);
    }

    #[test]
    fn small_triangle_touches_its_own_voxel() {
        assert_eq!(touched_voxels([[1.2, 2.2, 3.2], [1.8, 2.3, 3.4], [1.4, 2.9, 3.6]], 4), [[1, 2, 3]]);
    }

    #[test]
    fn plane_on_a_boundary_touches_both_layers() {
        let triangle = [[0.25, 0.25, 1.0], [0.75, 0.25, 1.0], [0.25, 0.75, 1.0]];
        assert_eq!(touched_voxels(triangle, 4), [[0, 0, 0], [0, 0, 1]]);
        let at_top = triangle.map(|[x, y, _]| [x, y, 4.0]);
        assert_eq!(touched_voxels(at_top, 4), [[0, 0, 3]]);
        let outside = triangle.map(|[x, y, _]| [x, y, 4.5]);
        assert!(touched_voxels(outside, 4).is_empty());
    }

    /// The plane x + y + z = 1.5 cuts the octant: the voxel at the origin and its three neighbours, but none with x + y ≥ 2.
    #[test]
    fn diagonal_triangle_touches_four_voxels() {
        let triangle = [[1.5, 0.0, 0.0], [0.0, 1.5, 0.0], [0.0, 0.0, 1.5]];
        assert_eq!(touched_voxels(triangle, 2), [[0, 0, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0]]);
        let separation = |voxel: VoxelIndex| candidates(triangle, 2, 0.0).iter().find(|candidate| candidate.voxel == voxel).map(|found| found.separation);
        // (1, 1, 0) is nearest to the edge's middle (¾, ¾, 0).
        assert!(separation([1, 1, 0]).is_some_and(|gap| close(gap, 0.5 / 2f64.sqrt())));
        // The corner (1, 1, 1) of the voxel at the origin is 1.5 / √3 beyond the plane; its corner (0, 0, 0) as far before it.
        assert!(separation([0, 0, 0]).is_some_and(|gap| close(gap, -1.5 / 3f64.sqrt())));
    }

    /// With vertices on the axes at 1 the neighbours are touched in one point.
    #[test]
    fn touching_in_a_point_counts() {
        let triangle = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(touched_voxels(triangle, 2), [[0, 0, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0]]);
    }

    #[test]
    fn triangles_without_area_are_skipped() {
        assert!(touched_voxels([[0.5, 0.5, 0.5], [1.5, 1.5, 1.5], [2.5, 2.5, 2.5]], 4).is_empty());
        assert!(touched_voxels([[0.5, 0.5, 0.5]; 3], 4).is_empty());
        assert!(candidates([[0.5, 0.5, 0.5]; 3], 4, 1.0).is_empty());
    }

    /// The separation of every candidate against the distance found by dense sampling of the triangle.
    #[test]
    fn separation_agrees_with_sampled_points() {
        let triangle = [[0.3, 0.1, 0.2], [3.7, 1.3, 0.9], [1.1, 3.2, 3.6]];
        let points: Vec<DVec3> = (0..40_000).map(|sample| at_weights(doubles(triangle), sample_weights(sample))).collect();
        for Candidate { voxel, separation } in candidates(triangle, 4, 1.0) {
            let corner = corner_of(voxel);
            let inside = points.iter().any(|point| point.cmpge(corner).all() && point.cmple(corner + 1.0).all());
            assert!(!inside || separation <= 0.0, "{voxel:?} holds a point of the triangle but has {separation}");
            assert!(inside || separation > -0.1, "{voxel:?} holds no point of the triangle but has {separation}");
        }
    }

    #[test]
    fn quad_fills_one_layer() {
        let voxels = voxelize(&scene_of(&floor(4.0, 1.5, 0.25)), &UNIT_GRID);
        assert_eq!(voxels.len(), 16);
        for ([x, y, z], sum) in &voxels {
            assert_eq!(*z, 1);
            // Voxels beside the diagonal touch the other triangle in a point.
            assert!((sum.area - 1.0).abs() <= 2.0 * LEAST_WEIGHT, "{x} {y}: {}", sum.area);
            assert!(near(sum.normal, DVec3::Z) && near(sum.albedo, DVec3::splat(0.25)));
            assert!((sum.mean_position - 0.5).abs().max_element() < 2.0 * LEAST_WEIGHT);
            assert!((sum.coverage - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn triangle_inside_a_voxel_is_exact() {
        let parts = fragments(&scene_of(&[([[1.25, 1.25, 1.25], [1.75, 1.25, 1.25], [1.25, 1.75, 1.25]], 0.5)]), &UNIT_GRID);
        assert_eq!(parts.len(), 1);
        assert_eq!(parts[0].voxel, [1, 1, 1]);
        assert!(close(parts[0].area, 0.125));
        assert!(near(parts[0].mean_position, DVec3::new(0.25 + 0.5 / 3.0, 0.25 + 0.5 / 3.0, 0.25)));
    }

    /// The triangle of side 1.5 √2 is cut into three corners of a ninth each and a hexagon-like rest of six ninths.
    #[test]
    fn diagonal_triangle_is_shared_out() {
        let triangle = [[1.5, 0.0, 0.0], [0.0, 1.5, 0.0], [0.0, 0.0, 1.5]];
        let voxels = voxelize(&scene_of(&[(triangle, 0.5)]), &UNIT_GRID);
        let whole = 3f64.sqrt() / 4.0 * 4.5;
        assert_eq!(voxels.len(), 4);
        assert!(close(voxels[&[0, 0, 0]].area, whole * 6.0 / 9.0));
        assert!(near(voxels[&[0, 0, 0]].mean_position, DVec3::splat(0.5)));
        assert!(close(voxels[&[1, 0, 0]].area, whole / 9.0));
        assert!(near(voxels[&[1, 0, 0]].mean_position, DVec3::new(0.5 / 3.0, 0.5 / 3.0, 0.5 / 3.0)));
        assert!(close(voxels[&[1, 0, 0]].coverage, whole / 9.0 / 3f64.sqrt()));
    }

    #[test]
    fn a_common_face_counts_in_both_voxels() {
        let voxels = voxelize(&scene_of(&[([[0.25, 0.25, 1.0], [0.75, 0.25, 1.0], [0.25, 0.75, 1.0]], 0.5)]), &UNIT_GRID);
        assert!(close(voxels[&[0, 0, 0]].area, 0.125) && close(voxels[&[0, 0, 1]].area, 0.125));
        assert!(close(voxels[&[0, 0, 0]].mean_position.z, 1.0) && close(voxels[&[0, 0, 1]].mean_position.z, 0.0));
    }

    /// A voxel touched in one point has the least weight; its mean position is that point.
    #[test]
    fn slivers_have_the_least_weight() {
        let voxels = voxelize(&scene_of(&[([[1.0, 0.25, 0.25], [0.5, 0.25, 0.25], [0.5, 0.5, 0.5]], 0.5)]), &UNIT_GRID);
        let sliver = &voxels[&[1, 0, 0]];
        assert_eq!(sliver.area, LEAST_WEIGHT);
        assert_eq!(sliver.coverage, LEAST_COVERAGE);
        assert!(near(sliver.mean_position, DVec3::new(0.0, 0.25, 0.25)));
    }

    #[test]
    fn means_are_weighted_by_area() {
        let large = [[0.0, 0.0, 0.5], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]];
        let small = [[0.25, 0.0, 0.25], [0.25, 0.0, 0.5], [0.25, 0.25, 0.25]];
        let voxels = voxelize(&scene_of(&[(large, 0.125), (small, 0.625)]), &UNIT_GRID);
        let sum = &voxels[&[0, 0, 0]];
        // Areas 1/8 and 1/32: weights 4/5 and 1/5.
        assert_eq!(sum.fragment_count, 2);
        assert!(close(sum.area, 5.0 / 32.0));
        assert!(near(sum.albedo, DVec3::splat(0.8 * 0.125 + 0.2 * 0.625)));
        assert!(near(sum.normal, DVec3::new(-0.2, 0.0, 0.8)));
        assert!(close(sum.coverage, 0.125));
    }

    /// Texels 0.5 wide along x, black and white by turns: a voxel's mean is one half wherever it lies.
    #[test]
    fn textures_are_averaged_over_a_voxel() {
        let mut scene = scene_of(&floor(4.0, 1.5, 0.5));
        scene.textures = vec![texture(TextureKind::Color, &[[0, 0, 0, 255], [255, 255, 255, 255]])];
        scene.materials[0].albedo_texture = Some(0);
        scene.materials[0].emission = Vec3::new(8.0, 0.0, 0.0);
        let parts = fragments(&scene, &UNIT_GRID);
        let first = parts.iter().find(|part| part.triangle == 0 && part.voxel == [3, 0, 1]);
        assert!(first.is_some_and(|part| near(part.albedo, DVec3::splat(0.25)) && near(part.emission, DVec3::new(8.0, 0.0, 0.0))));
    }

    #[test]
    fn masks_and_metals() {
        let mut scene = scene_of(&floor(4.0, 1.5, 0.5));
        scene.textures = vec![texture(TextureKind::Mask, &[[0; 4]]), texture(TextureKind::Mask, &[[153; 4]])];
        scene.materials[0].mask_texture = Some(0);
        scene.materials[1].mask_texture = Some(1);
        scene.materials[1].specular = Some(Specular { f0: Vec3::ONE, roughness: 0.5, metalness: 0.75 });
        let parts = fragments(&scene, &UNIT_GRID);
        assert!(parts.iter().all(|part| part.triangle == 1));
        let whole = parts.iter().find(|part| part.voxel == [0, 3, 1]);
        assert!(whole.is_some_and(|part| (part.area - 0.6).abs() < 1e-6 && (part.albedo - 0.125).abs().max_element() < 1e-6));
    }

    #[test]
    fn compact_index_follows_the_blocks() {
        let voxels = [[4, 0, 0], [0, 0, 1], [3, 3, 3], [0, 4, 0], [1, 0, 0], [0, 1, 0]];
        assert_eq!(compact_order(voxels), [[1, 0, 0], [0, 1, 0], [0, 0, 1], [3, 3, 3], [4, 0, 0], [0, 4, 0]]);
        let words = occupancy_words(voxels, 8);
        assert_eq!(words.len(), 16);
        assert_eq!(words[..6], [1 << 1 | 1 << 4 | 1 << 16, 1 << 31, 1, 0, 1, 0]);
        assert_eq!(block_bases(&words), [0, 4, 5, 6, 6, 6, 6, 6]);
    }

    /// A wall of voxels at x = 5, one in front of it at (2, 3, 3), facing −x.
    fn walled() -> TraceGrid {
        let voxel = |radiance: f64| TraceVoxel { mean_position: DVec3::splat(0.5), mean_normal: DVec3::NEG_X, radiance: DVec3::splat(radiance) };
        let wall = (0..64).map(|index| ([5, index / 8, index % 8], voxel(1.0)));
        TraceGrid { resolution: 8, voxels: wall.chain([([2, 3, 3], voxel(4.0))]).collect() }
    }

    const FLOOR: Receiver = Receiver { position: DVec3::new(0.5, 3.5, 0.25), geometric_normal: DVec3::Z, shading_normal: DVec3::Z };
    const ANY_TOUCH: TraceSettings = TraceSettings { self_height: -100.0, contour_slack: -1.0 };

    fn ended(origin: DVec3, direction: DVec3, settings: TraceSettings) -> (VoxelIndex, f64) {
        match trace(&walled(), origin, direction, &FLOOR, &settings) {
            TraceEnd::Hit(hit) => (hit.voxel, hit.entry),
            TraceEnd::Miss(distance) => ([u32::MAX; 3], distance),
        }
    }

    #[test]
    fn rays_hit_the_nearest_voxel() {
        let origin = DVec3::new(0.5, 3.5, 3.5);
        assert_eq!(ended(origin, DVec3::X, ANY_TOUCH), ([2, 3, 3], 1.5));
        assert_eq!(ended(origin + DVec3::Z, DVec3::X, ANY_TOUCH), ([5, 3, 4], 4.5));
        assert_eq!(ended(origin, DVec3::NEG_X, ANY_TOUCH), ([u32::MAX; 3], 0.5));
        assert_eq!(ended(DVec3::new(2.5, 3.5, 3.5), DVec3::X, ANY_TOUCH), ([2, 3, 3], 0.0));
        assert_eq!(ended(DVec3::new(-1.0, 3.5, 3.5), DVec3::X, ANY_TOUCH), ([u32::MAX; 3], 0.0));
    }

    #[test]
    fn low_voxels_are_the_receiver() {
        let origin = DVec3::new(0.5, 3.5, 3.5);
        // Mean height of (2, 3, 3) over the receiver's plane is 3.25.
        assert_eq!(ended(origin, DVec3::X, TraceSettings { self_height: 3.25, ..ANY_TOUCH }).0, [2, 3, 3]);
        assert_eq!(ended(origin, DVec3::X, TraceSettings { self_height: 3.26, ..ANY_TOUCH }).0, [u32::MAX; 3]);
    }

    /// From (0.5, 3.5, 1.5) towards (2.5, 3.5, z) the plane x = 2.5 of the voxel (2, 3, 3) is met at height z.
    #[test]
    fn contours_cut_the_corners_of_voxels() {
        let origin = DVec3::new(0.5, 3.5, 1.5);
        let towards = |z: f64| (DVec3::new(2.5, 3.5, z) - origin).normalize();
        let contour = |slack: f64| TraceSettings { contour_slack: slack, ..ANY_TOUCH };
        assert_eq!(ended(origin, towards(2.9), ANY_TOUCH).0, [2, 3, 3]);
        assert_eq!(ended(origin, towards(2.9), contour(0.0)).0, [5, 3, 4]);
        assert_eq!(ended(origin, towards(2.9), contour(0.2)).0, [2, 3, 3]);
        let seen = crossings(&walled(), origin, towards(2.9), &FLOOR, &contour(0.0));
        assert!(seen.first().is_some_and(|first| close(first.margin, -0.1)));
    }

    #[test]
    fn rays_gather_a_furnace_and_the_environment() {
        let inside = |index: u32| [index % 8, index / 8 % 8, index / 64];
        let shell = (0..512).map(inside).filter(|voxel| voxel.iter().any(|at| *at == 0 || *at == 7));
        let voxel = TraceVoxel { mean_position: DVec3::splat(0.5), mean_normal: DVec3::ZERO, radiance: DVec3::new(1.0, 2.0, 3.0) };
        let furnace = TraceGrid { resolution: 8, voxels: shell.map(|at| (at, voxel)).collect() };
        let receiver = Receiver { position: DVec3::new(4.0, 4.0, 2.0), ..FLOOR };
        let settings = GatherSettings {
            ray_count: 64,
            start_offset: 0.5,
            trace: ANY_TOUCH,
            ao_falloff: 0.0,
            pattern: DVec2::new(0.5, 0.0),
            environment: DVec3::splat(0.5),
        };
        let gathered = gather_rays(&furnace, &receiver, &settings);
        assert!(near(gathered.irradiance, PI * voxel.radiance) && close(gathered.visibility, 0.0));
        let open = gather_rays(&TraceGrid { resolution: 8, ..TraceGrid::default() }, &receiver, &settings);
        assert!(near(open.irradiance, DVec3::splat(0.5 * PI)) && close(open.visibility, 1.0));
    }

    #[test]
    fn directions_are_cosine_distributed_unit_vectors() {
        for normal in [DVec3::Z, DVec3::NEG_Z, DVec3::new(0.6, 0.0, -0.8), DVec3::new(-2.0, 1.0, 2.0) / 3.0] {
            let [a, b] = [0.0, PI / 2.0].map(|azimuth| hemisphere_direction(normal, 0.36, azimuth));
            assert!(close(a.length(), 1.0) && close(a.dot(normal), 0.8) && close(b.dot(normal), 0.8));
            // A quarter of a turn apart: only the parts along the normal remain.
            assert!(close(a.dot(b), 0.64));
        }
    }

    #[test]
    fn patterns_fill_a_tile() {
        let mut firsts: Vec<f64> = (0..16).map(|index| interleaved_offset([index % 4, index / 4], 4).x * 16.0).collect();
        firsts.sort_by(f64::total_cmp);
        assert_eq!(firsts, (0..16).map(|index| f64::from(index) + 0.5).collect::<Vec<_>>());
        // Pixel (1, 0) has number 7 of 16, in bits 0111; its reversal is 0.1110 (binary).
        assert_eq!(interleaved_offset([5, 4], 4), DVec2::new(7.5 / 16.0, 0.875));
    }

    /// A floor of albedo ½ under a beam at 60° to its normal: L = ½/π · 4 · ½ in every voxel; and its flux.
    #[test]
    fn floor_reflects_a_beam() {
        let mut scene = scene_of(&floor(4.0, 1.25, 0.5));
        let direction = Vec3::new(0.75f32.sqrt(), 0.0, -0.5);
        scene.lights = vec![Light::Directional { direction, irradiance: Vec3::splat(4.0) }];
        let grid = Grid { voxel_size: 0.5, resolution: 8, ..UNIT_GRID };
        let radiance = inject(&scene, &grid, 4);
        assert_eq!(radiance.len(), 64);
        assert!(radiance.values().all(|value| (*value - 1.0 / PI).abs().max_element() < 1e-6));
        let flux = reflected_flux(&scene, 4);
        assert!((flux - 16.0).abs().max_element() < 1e-5);
        let collected = voxel_flux(&voxelize(&scene, &grid), &radiance, &grid);
        assert!((collected / flux - 1.0).abs().max_element() < 1e-3);
        // The other side reflects as well.
        scene.lights = vec![Light::Directional { direction: -direction, irradiance: Vec3::splat(4.0) }];
        assert!((reflected_flux(&scene, 4) - 16.0).abs().max_element() < 1e-5);
    }

    #[test]
    fn nothing_behind_a_light_occludes() {
        let ceiling = floor(4.0, 3.75, 0.5).map(|(triangle, _)| (triangle, 0.0));
        let mut scene = scene_of(&[floor(4.0, 1.25, 0.5), ceiling].concat());
        let lamp = |z: f32| vec![Light::Point { position: Vec3::new(2.0, 1.0, z), intensity: Vec3::ONE }];
        scene.lights = lamp(3.5);
        assert!(inject(&scene, &UNIT_GRID, 4)[&[1, 1, 1]].x > 0.0);
        scene.lights = lamp(4.0);
        assert_eq!(inject(&scene, &UNIT_GRID, 4)[&[1, 1, 1]], DVec3::ZERO);
    }

    /// The normals of a thin sheet's two sides cancel; what the sheet covers does not.
    #[test]
    fn both_sides_of_a_sheet_cover() {
        let front = [[0.0, 0.0, 0.5], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]];
        let sum = voxelize(&scene_of(&[(front, 0.5), ([front[0], front[2], front[1]], 0.5)]), &UNIT_GRID)[&[0, 0, 0]];
        assert!(near(sum.normal, DVec3::ZERO) && close(sum.coverage, 0.25));
    }

    /// A lamp above a corner of a floor; beyond a wall the floor lies in its shadow.
    #[test]
    fn walls_throw_shadows() {
        let wall = [([[2.5, -1.0, 1.6], [2.5, 9.0, 1.6], [2.5, -1.0, 9.0]], 0.0)];
        let mut scene = scene_of(&[&floor(4.0, 1.5, 0.5)[..], &wall[..]].concat());
        scene.lights = vec![Light::Point { position: Vec3::new(0.5, 0.5, 3.5), intensity: Vec3::splat(8.0) }];
        let radiance = inject(&scene, &UNIT_GRID, 256);
        assert!(radiance[&[3, 1, 1]].max_element() < 1e-12);
        let expected = |x: f64| {
            // ρ/π I cos θ / r², averaged over the voxel by a fine sum.
            let at = |index: u32| DVec2::new(x + (f64::from(index % 64) + 0.5) / 64.0, (f64::from(index / 64) + 0.5) / 64.0) - 0.5;
            let term = |offset: DVec2| 2.0 / (offset.length_squared() + 4.0).powf(1.5);
            0.5 / PI * 8.0 * (0..4096).map(|index| term(at(index))).sum::<f64>() / 4096.0
        };
        assert!((radiance[&[0, 0, 1]].x / expected(0.0) - 1.0).abs() < 5e-3, "{} {}", radiance[&[0, 0, 1]].x, expected(0.0));
        assert!((radiance[&[1, 0, 1]].x / expected(1.0) - 1.0).abs() < 5e-3, "{} {}", radiance[&[1, 0, 1]].x, expected(1.0));
        let voxels = voxelize(&scene, &UNIT_GRID);
        let point = shade_voxel(&scene, &UNIT_GRID, [0, 0, 1], &voxels[&[0, 0, 1]], 0.25);
        assert!((point.x - 0.5 / PI * 8.0 / 4.0).abs() < 1e-3);
        assert_eq!(shade_voxel(&scene, &UNIT_GRID, [3, 0, 1], &voxels[&[3, 0, 1]], 0.25), DVec3::ZERO);
    }

    #[test]
    fn spots_fall_off_in_angle() {
        let spot = Light::Spot { position: Vec3::ZERO, direction: Vec3::Z, intensity: Vec3::splat(2.0), inner_deg: 30.0, outer_deg: 60.0 };
        for (angle_deg, expected) in [(0.0, 0.5), (29.0, 0.5), (45.0, 0.25), (61.0, 0.0)] {
            let angle = f64::to_radians(angle_deg);
            let (_, distance_m, irradiance) = arriving_light(&spot, 2.0 * DVec3::new(angle.sin(), 0.0, angle.cos()));
            assert!(close(distance_m, 2.0) && close(irradiance.x, expected), "{angle_deg}: {irradiance}");
        }
    }
}
