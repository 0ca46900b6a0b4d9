//! CPU twin of `cone.gather`, `cone.occlusion` and `cone.shadow`: cones through a prefiltered
//! volume of premultiplied radiance, in f64. That of `cone.specular` is in [`specular`], that of
//! `cone.see` in [`see`].
//!
//! A cone of aperture γ has the diameter d = 2 t tan(γ/2) at distance t and samples the mip log₂ d
//! (Crassin et al. 2011, section 5.3). A step of β d through texels of opacity α has the opacity α'
//! = 1 − (1 − α)^(g β). Lengths are voxels of the finest level.

mod clipmap;
mod levels;
pub mod patches;
pub mod see;
pub mod specular;
pub mod structure;

use std::f64::consts::PI;

use glam::{DVec2, DVec3, DVec4};

pub use clipmap::{Clipmap, ClipmapLevel};
pub use levels::{
    FaceChain, Lattice, Levels, Volume, combine_faces, facing_share, harmonic_share, luminance,
    sample_chain,
};

use crate::gi::shared::voxel::oracle::{
    Gathered, Receiver, TraceVoxel, VoxelIndex, bounce_receiver, hemisphere_direction,
    voxel_pattern,
};

/// Settings of a march.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarchSettings {
    /// β: a step in sample diameters.
    pub step_factor: f64,
    /// g: 1 is the textbook; above it makes up for what trilinear sampling lets through.
    pub opacity_exponent: f64,
    /// k: a sample's diameter is at most its height over the receiver's tangent plane / k; 0: off.
    pub height_clamp: f64,
    /// Where cones end \[voxels\].
    pub max_distance: f64,
    /// λ of the ambient visibility's 1 / (1 + λ r), for distances in voxels [1/voxel].
    pub ao_falloff: f64,
    /// Constant radiance of the environment [W/(m² sr)].
    pub environment: DVec3,
    /// A cone ends where less than this passes through.
    pub early_stop: f64,
    /// A sample of more opacity than this fills its cone; 1: none.
    pub first_hit: f64,
    /// s, by which opacity at a distance t of the longest, D, counts smoothstep(0, 1, s √(t/D)); 0:
    /// wholly.
    pub near_strength: f64,
    /// λ as in `ao_falloff`, of the cone's radius [1/voxel].
    pub radius_falloff: f64,
}

impl MarchSettings {
    /// As the papers have it: unclamped, to the end of the grid, in the dark.
    pub const TEXTBOOK: MarchSettings = MarchSettings {
        step_factor: 0.5,
        opacity_exponent: 1.0,
        height_clamp: 0.0,
        max_distance: f64::INFINITY,
        ao_falloff: 0.0,
        environment: DVec3::ZERO,
        early_stop: 0.005,
        first_hit: 1.0,
        near_strength: 0.0,
        radius_falloff: 0.0,
    };

    /// Opacity of a step whose sample has the opacity α > 0 at a distance.
    fn step_opacity(&self, alpha: f64, distance: f64) -> f64 {
        if alpha > self.first_hit {
            return 1.0;
        }
        let through = (1.0 - alpha)
            .max(0.0)
            .powf(self.opacity_exponent * self.step_factor);
        if self.near_strength == 0.0 {
            return 1.0 - through;
        }
        let x = (self.near_strength * (distance / self.max_distance).sqrt()).clamp(0.0, 1.0);
        (1.0 - through) * x * x * (3.0 - 2.0 * x)
    }
}

/// One cone. It starts inside the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Apex, grid space \[voxels\].
    pub origin: DVec3,
    /// Unit direction of the axis.
    pub direction: DVec3,
    /// tan(γ/2), half the cone's diameter at distance 1.
    pub tan_half: f64,
    /// Height of the apex over the receiver's tangent plane \[voxels\].
    pub height: f64,
    /// Cosine between the axis and the plane's normal.
    pub cosine: f64,
}

/// What a cone sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConeResult {
    /// Radiance, with the environment behind what is not covered [W/(m² sr)].
    pub radiance: DVec3,
    /// 1 − occlusion, an occluder at distance r counting 1 / (1 + λ r).
    pub visibility: f64,
    /// Number of samples that the march took.
    pub step_count: u32,
}

/// β tan(γ/2) counts as at most 1 less this, so that steps stay finite however wide the cone is.
const LEAST_STEP_DENOMINATOR: f64 = 0.25;

/// Marches one cone front to back until it leaves the grid, reaches its end or is covered. The
/// midpoint rule: each step is centred on its sample.
pub fn march<'l>(
    levels: impl Into<Levels<'l>>,
    cone: &Cone,
    settings: &MarchSettings,
) -> ConeResult {
    march_to(levels.into(), cone, settings, None)
}

/// As [`march`], towards a second plane that the height clamp keeps samples off too: height of the
/// apex over it \[voxels\], and the cosine between the axis and the way down.
pub fn march_to(
    levels: Levels<'_>,
    cone: &Cone,
    settings: &MarchSettings,
    plane: Option<(f64, f64)>,
) -> ConeResult {
    let end =
        exit_distance(cone.origin, cone.direction, levels.resolution()).min(settings.max_distance);
    let mut result = ConeResult {
        radiance: DVec3::ZERO,
        visibility: 1.0,
        step_count: 0,
    };
    let (mut distance, mut through) = (0.0, 1.0);
    while distance < end && through > settings.early_stop {
        let least = levels.least_diameter(cone.origin + distance * cone.direction);
        let diameter = sample_diameter(cone, distance, settings, plane, least);
        let step = settings.step_factor * diameter;
        let centre = distance + step / 2.0;
        let texel = levels.sample(
            cone.origin + centre * cone.direction,
            diameter.log2(),
            (cone.direction, levels.view_variance(cone.tan_half)),
        );
        if texel.w > 0.0 {
            let opacity = settings.step_opacity(texel.w, centre);
            let far = settings.ao_falloff * centre + settings.radius_falloff * diameter / 2.0;
            result.radiance += through * opacity * texel.truncate() / texel.w;
            result.visibility -= through * opacity / (1.0 + far);
            through *= 1.0 - opacity;
        }
        distance += step;
        result.step_count += 1;
    }
    result.radiance += through * settings.environment;
    result
}

/// Diameter d(c) of the sample in the middle, c, of the step that begins at `distance`: c =
/// distance + β d(c) / 2 with d(c) = max(`least`, 2 c tan(γ/2)), solved for c in both cases. At c
/// the height clamp then applies; no sample is smaller than `least`, a voxel.
fn sample_diameter(
    cone: &Cone,
    distance: f64,
    settings: &MarchSettings,
    plane: Option<(f64, f64)>,
    least: f64,
) -> f64 {
    let wide = distance / (1.0 - settings.step_factor * cone.tan_half).max(LEAST_STEP_DENOMINATOR);
    let narrow = distance + settings.step_factor * least / 2.0;
    let centre = wide.max(narrow);
    let diameter = 2.0 * centre * cone.tan_half;
    let over_plane = plane.map_or(f64::INFINITY, |(height, cosine)| height - centre * cosine);
    let height = (cone.height + centre * cone.cosine).min(over_plane);
    let clamped = if settings.height_clamp > 0.0 {
        diameter.min(height / settings.height_clamp)
    } else {
        diameter
    };
    clamped.max(least)
}

/// What a ray sees of the cells of one level (texels), each uniform and with its own opacity, front
/// to back: premultiplied by opacity, opacity. `origin` in voxels; the grid is `resolution` voxels
/// wide.
pub fn view_cells(
    texel: impl Fn([u32; 3]) -> DVec4,
    resolution: u32,
    level: u32,
    origin: DVec3,
    direction: DVec3,
) -> DVec4 {
    let edge = f64::from(1u32 << level);
    let planes = |forward: f64, back: f64| {
        DVec3::from_array(
            direction
                .to_array()
                .map(|d| if d > 0.0 { forward } else { back }),
        )
    };
    let entry = ((planes(0.0, f64::from(resolution)) - origin) / direction)
        .max_element()
        .max(0.0);
    let exit = ((planes(f64::from(resolution), 0.0) - origin) / direction).min_element();
    let (mut seen, mut t) = (DVec4::ZERO, entry);
    while t < exit && seen.w < 0.995 {
        let low = ((origin + (t + 1e-3 * edge) * direction) / edge).floor() * edge;
        seen += (1.0 - seen.w) * texel((low / edge).to_array().map(|at| at as u32));
        t = ((low + planes(edge, 0.0) - origin) / direction)
            .min_element()
            .max(t + 1e-3 * edge);
    }
    seen
}

/// Distance at which a ray from inside the grid leaves it \[voxels\].
fn exit_distance(origin: DVec3, direction: DVec3, resolution: f64) -> f64 {
    let along = |axis: usize| match direction[axis] {
        d if d > 0.0 => (resolution - origin[axis]) / d,
        d if d < 0.0 => -origin[axis] / d,
        _ => f64::INFINITY,
    };
    along(0).min(along(1)).min(along(2))
}

/// One cone of a set, about the shading normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetCone {
    /// sin²θ of the axis, 0 to 1 with all jitter.
    pub sin_squared: f64,
    /// φ of the axis \[rad\].
    pub azimuth_rad: f64,
    /// tan(γ/2), half the cone's diameter at distance 1.
    pub tan_half: f64,
    /// Share of the cosine-weighted hemisphere; a set's shares sum to 1.
    pub weight: f64,
}

/// How a set is placed at a surface point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Distance of the cones' apex from the surface along the geometric normal, in edges of the
    /// texels that are read there.
    pub start_offset: f64,
    /// Two numbers of [0, 1): ½ and 0 leave the set as it is, others shift sin²θ within its
    /// stratum and turn the set.
    pub pattern: DVec2,
    /// Width of a stratum of sin²θ; 0 where elevations are fixed.
    pub jitter: f64,
}

/// Where the cones of a surface point start, and how high that is over the surface (both
/// \[voxels\]).
fn apex(levels: Levels<'_>, receiver: &Receiver, start_offset: f64) -> (DVec3, f64) {
    let height = start_offset * levels.largest_texel(receiver.position);
    (
        receiver.position + height * receiver.geometric_normal,
        height,
    )
}

/// E = π Σ w L over a set of cones, and the mean visibility; and the samples that all of them take.
pub fn gather<'l>(
    levels: impl Into<Levels<'l>>,
    receiver: &Receiver,
    cones: &[SetCone],
    placement: &Placement,
    settings: &MarchSettings,
) -> (Gathered, u32) {
    let levels = levels.into();
    let (origin, height) = apex(levels, receiver, placement.start_offset);
    let mut gathered = Gathered {
        irradiance: DVec3::ZERO,
        visibility: 0.0,
    };
    let mut samples = 0;
    for cone in cones {
        let sin_squared = cone.sin_squared + (placement.pattern.x - 0.5) * placement.jitter;
        let direction = hemisphere_direction(
            receiver.shading_normal,
            sin_squared,
            cone.azimuth_rad + placement.pattern.y * 2.0 * PI,
        );
        let cosine = direction.dot(receiver.geometric_normal).max(0.0);
        let result = march(
            levels,
            &Cone {
                origin,
                direction,
                tan_half: cone.tan_half,
                height,
                cosine,
            },
            settings,
        );
        gathered.irradiance += PI * cone.weight * result.radiance;
        gathered.visibility += cone.weight * result.visibility;
        samples += result.step_count;
    }
    (gathered, samples)
}

/// Where a light is, seen from a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightPlace {
    /// In this direction (a unit vector), behind everything.
    Direction(DVec3),
    /// At this position \[voxels\].
    Position(DVec3),
}

/// Fraction of a light that a receiver sees: the transmittance of a cone from `start_offset` over
/// its surface to the light. Its last sample stays in front of the light: with c − β d(c) / 2 where
/// it begins, c + d(c) / 2 is no further than the light, for the least d(c) at the light and d(c) =
/// 2 c tan(γ/2) alike.
pub fn light_visibility<'l>(
    levels: impl Into<Levels<'l>>,
    receiver: &Receiver,
    start_offset: f64,
    light: LightPlace,
    tan_half: f64,
    settings: &MarchSettings,
) -> f64 {
    let levels = levels.into();
    let (origin, height) = apex(levels, receiver, start_offset);
    let (direction, distance) = match light {
        LightPlace::Direction(direction) => (direction, f64::INFINITY),
        LightPlace::Position(position) => (
            (position - origin).normalize_or_zero(),
            (position - origin).length(),
        ),
    };
    let beta = settings.step_factor;
    let widest = distance / (1.0 + tan_half);
    let wide_end = widest * (1.0 - beta * tan_half).max(LEAST_STEP_DENOMINATOR);
    // A light beyond the grid is as good as where a ray has surely left it.
    let least = levels.least_diameter(origin + distance.min(2.0 * levels.resolution()) * direction);
    let narrow_end = distance - least / 2.0 - beta * least / 2.0;
    let settings = MarchSettings {
        // The grid's diagonal is √3 of its edge.
        max_distance: wide_end.min(narrow_end).min(1.8 * levels.resolution()),
        ao_falloff: 0.0,
        ..*settings
    };
    let cosine = direction.dot(receiver.geometric_normal).max(0.0);
    march(
        levels,
        &Cone {
            origin,
            direction,
            tan_half,
            height,
            cosine,
        },
        &settings,
    )
    .visibility
}

/// E/π \[W/(m² sr)\] at a voxel, or one side of it, by a set of cones, neighbours taking different
/// patterns ([`voxel_pattern`]; that of `placement` is not used).
pub fn bounce<'l>(
    levels: impl Into<Levels<'l>>,
    voxel: VoxelIndex,
    side: Option<usize>,
    surface: &TraceVoxel,
    cones: &[SetCone],
    placement: &Placement,
    settings: &MarchSettings,
) -> DVec3 {
    let levels = levels.into();
    let pattern = voxel_pattern(voxel);
    let seen = |(cone, number): (&SetCone, u32)| {
        let receiver = bounce_receiver(voxel, surface, side, number);
        let whole = gather(
            levels,
            &receiver,
            &[SetCone {
                weight: 1.0,
                ..*cone
            }],
            &Placement {
                pattern,
                ..*placement
            },
            settings,
        );
        cone.weight / PI * whole.0.irradiance
    };
    cones.iter().zip(0..).map(seen).sum()
}

#[cfg(test)]
mod tests;
