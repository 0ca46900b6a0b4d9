//! CPU twin of `cone.gather`, `cone.occlusion` and `cone.shadow`: cones through a prefiltered
//! volume of premultiplied radiance, in f64. That of `cone.specular` is in [`specular`].
//!
//! A cone of aperture γ has the diameter d = 2 t tan(γ/2) at distance t and samples the mip log₂ d
//! (Crassin et al. 2011, section 5.3). A step of β d through texels of opacity α has the opacity α'
//! = 1 − (1 − α)^(g β). Lengths are voxels of the finest level.

mod clipmap;
mod levels;
pub mod patches;
pub mod specular;
pub mod structure;

use std::f64::consts::PI;

use glam::{DVec2, DVec3, DVec4};

pub use clipmap::{Clipmap, ClipmapLevel};
pub use levels::{
    FaceChain, Lattice, Levels, Volume, combine_faces, facing_share, luminance, sample_chain,
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

/// A cone ends where less than this passes through.
const LEAST_TRANSMITTANCE: f64 = 0.005;

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
    while distance < end && through > LEAST_TRANSMITTANCE {
        let least = levels.least_diameter(cone.origin + distance * cone.direction);
        let diameter = sample_diameter(cone, distance, settings, plane, least);
        let step = settings.step_factor * diameter;
        let centre = distance + step / 2.0;
        let texel = levels.sample(
            cone.origin + centre * cone.direction,
            diameter.log2(),
            cone.direction,
        );
        if texel.w > 0.0 {
            let opacity = 1.0
                - (1.0 - texel.w)
                    .max(0.0)
                    .powf(settings.opacity_exponent * settings.step_factor);
            result.radiance += through * opacity * texel.truncate() / texel.w;
            result.visibility -= through * opacity / (1.0 + settings.ao_falloff * centre);
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
        max_distance: wide_end.min(narrow_end),
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
mod tests {
    use super::*;

    const ENVIRONMENT: DVec3 = DVec3::new(1.0, 2.0, 3.0);
    const TEXTBOOK: MarchSettings = MarchSettings {
        step_factor: 1.0,
        opacity_exponent: 1.0,
        height_clamp: 0.0,
        max_distance: 1e9,
        ao_falloff: 0.0,
        environment: ENVIRONMENT,
    };

    /// Levels of 8, 4, 2 and 1 texels, each of one value.
    fn levels(values: [DVec4; 4]) -> Vec<Volume> {
        [8, 4, 2, 1]
            .into_iter()
            .zip(values)
            .map(|(resolution, value)| Volume::new(resolution, |_| value))
            .collect()
    }

    /// A wall of one layer, z = 5, of opacity ½ and radiance (2, 0, 0).
    fn wall() -> Vec<Volume> {
        vec![Volume::new(8, |[_, _, z]| {
            if z == 5 {
                DVec4::new(1.0, 0.0, 0.0, 0.5)
            } else {
                DVec4::ZERO
            }
        })]
    }

    fn up(tan_half: f64) -> Cone {
        Cone {
            origin: DVec3::new(4.5, 4.5, 0.0),
            direction: DVec3::Z,
            tan_half,
            height: 0.0,
            cosine: 1.0,
        }
    }

    /// One cone along the normal of weight ¼ and five at 60° of weight 0.15 (Crassin et al. 2011).
    fn six_cones() -> Vec<SetCone> {
        let side = |index: u32| SetCone {
            sin_squared: 0.75,
            azimuth_rad: f64::from(index) * PI * 0.4,
            tan_half: (PI / 6.0).tan(),
            weight: 0.15,
        };
        (0..5)
            .map(side)
            .chain([SetCone {
                sin_squared: 0.0,
                azimuth_rad: 0.0,
                tan_half: (PI / 6.0).tan(),
                weight: 0.25,
            }])
            .collect()
    }

    fn receiver() -> Receiver {
        let normal = DVec3::new(0.6, 0.0, 0.8);
        Receiver {
            position: DVec3::new(4.0, 4.0, 1.0),
            geometric_normal: normal,
            shading_normal: normal,
        }
    }

    fn near(a: DVec3, b: DVec3) -> bool {
        (a - b).abs().max_element() < 1e-12
    }

    #[test]
    fn volume_is_indexed_x_first_and_interpolated() {
        let volume = Volume::new(4, |[x, y, z]| {
            DVec4::new(f64::from(x), f64::from(y), f64::from(z), 1.0)
        });
        assert_eq!(
            volume.texels[1 + 4 * (2 + 4 * 3)],
            DVec4::new(1.0, 2.0, 3.0, 1.0)
        );
        // Linear between the centres (i + ½) / n, constant beyond the outermost.
        assert!(near(
            volume.sample(DVec3::new(0.25, 0.5, 0.625)).truncate(),
            DVec3::new(0.5, 1.5, 2.0)
        ));
        assert!(near(
            volume.sample(DVec3::new(-1.0, 0.05, 0.99)).truncate(),
            DVec3::new(0.0, 0.0, 3.0)
        ));
    }

    #[test]
    fn levels_are_interpolated_and_clamped() {
        let chain = levels([1.0, 2.0, 4.0, 8.0].map(DVec4::splat));
        for (level, expected) in [
            (-1.0, 1.0),
            (0.0, 1.0),
            (0.5, 1.5),
            (1.75, 3.5),
            (3.0, 8.0),
            (9.0, 8.0),
        ] {
            assert!(
                (sample_chain(&chain, DVec3::splat(0.3), level).x - expected).abs() < 1e-12,
                "level {level}"
            );
        }
    }

    #[test]
    fn empty_grid_shows_the_environment() {
        let (gathered, _) = gather(
            &levels([DVec4::ZERO; 4]),
            &receiver(),
            &six_cones(),
            &Placement {
                start_offset: 1.0,
                pattern: DVec2::new(0.5, 0.0),
                jitter: 0.0,
            },
            &TEXTBOOK,
        );
        assert!(near(gathered.irradiance, PI * ENVIRONMENT));
        assert!((gathered.visibility - 1.0).abs() < 1e-12);
    }

    /// Any set, pattern and filter: E = π L inside opaque matter of radiance L.
    #[test]
    fn opaque_grid_shows_itself() {
        let settings = MarchSettings {
            step_factor: 0.5,
            opacity_exponent: 1.5,
            height_clamp: 2.0,
            ..TEXTBOOK
        };
        let placement = Placement {
            start_offset: 1.5,
            pattern: DVec2::new(0.7, 0.3),
            jitter: 0.1,
        };
        let (gathered, _) = gather(
            &levels([DVec4::new(0.5, 1.0, 4.0, 1.0); 4]),
            &receiver(),
            &six_cones(),
            &placement,
            &settings,
        );
        // Texels' shares sum to 1 give or take rounding, which the exponent g β = ¾ enlarges.
        assert!(
            (gathered.irradiance - PI * DVec3::new(0.5, 1.0, 4.0))
                .abs()
                .max_element()
                < 1e-9
        );
        assert!(gathered.visibility.abs() < 1e-9);
    }

    /// A thin ray whose steps are centred on the texels meets the wall's texel once.
    #[test]
    fn thin_ray_composites_a_wall() {
        let seen = march(&wall(), &up(0.0), &TEXTBOOK);
        assert!(near(
            seen.radiance,
            0.5 * DVec3::new(2.0, 0.0, 0.0) + 0.5 * ENVIRONMENT
        ));
        assert_eq!(seen.step_count, 8);
        assert!((seen.visibility - 0.5).abs() < 1e-12);
        let gain = march(
            &wall(),
            &up(0.0),
            &MarchSettings {
                opacity_exponent: 2.0,
                ao_falloff: 1.0,
                ..TEXTBOOK
            },
        );
        assert!(near(
            gain.radiance,
            0.75 * DVec3::new(2.0, 0.0, 0.0) + 0.25 * ENVIRONMENT
        ));
        assert!((gain.visibility - (1.0 - 0.75 / 6.5)).abs() < 1e-12);
    }

    /// A flat surface is seen from its front alone, one that shines to both sides from either side
    /// alike, and what is curved fades over.
    #[test]
    fn light_leaves_by_the_normals() {
        assert!(
            facing_share(DVec3::Z, -DVec3::Z) > 1.0 - 1e-9
                && facing_share(DVec3::Z, DVec3::Z) < 1e-9
        );
        assert!((facing_share(DVec3::ZERO, DVec3::X) - 0.5).abs() < 1e-12);
        // |m| = ½ has σ = 1; 0.8413 is the normal distribution function at 1.
        assert!((facing_share(0.5 * DVec3::Z, -DVec3::Z) - 0.8413).abs() < 0.0095);
        for m in [0.1, 0.4, 0.9] {
            let shares = [0.9, 0.5, 0.0, -0.5, -0.9].map(|cosine: f64| {
                facing_share(
                    m * DVec3::Z,
                    DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine),
                )
            });
            assert!(
                shares.windows(2).all(|pair| pair[0] < pair[1])
                    && (shares[0] + shares[4] - 1.0).abs() < 1e-12,
                "{shares:?}"
            );
        }
        let normals = |z: f64| {
            vec![Volume::new(8, |at| {
                if at[2] == 5 {
                    DVec4::new(0.0, 0.0, z * 0.2126, 0.5)
                } else {
                    DVec4::ZERO
                }
            })]
        };
        let seen = |z: f64| {
            march(
                Levels {
                    light: &wall(),
                    normals: &normals(z),
                    ..Levels::default()
                },
                &up(0.0),
                &TEXTBOOK,
            )
            .radiance
        };
        assert!(near(
            seen(-1.0),
            march(&wall(), &up(0.0), &TEXTBOOK).radiance
        ));
        assert!(near(seen(1.0), 0.5 * ENVIRONMENT));
    }

    /// Half steps are centred on the quarters of the texels: α = ¾·½ twice and ¼·½ twice, each to
    /// the power ½.
    #[test]
    fn half_steps_interpolate_a_wall() {
        let seen = march(
            &wall(),
            &up(0.0),
            &MarchSettings {
                step_factor: 0.5,
                ..TEXTBOOK
            },
        );
        let through = (1.0 - 0.375) * (1.0 - 0.125);
        assert!(near(
            seen.radiance,
            (1.0 - through) * DVec3::new(2.0, 0.0, 0.0) + through * ENVIRONMENT
        ));
        assert_eq!(seen.step_count, 16);
    }

    #[test]
    fn a_cone_ends_at_its_distance_and_when_covered() {
        let short = march(
            &wall(),
            &up(0.0),
            &MarchSettings {
                max_distance: 5.0,
                ..TEXTBOOK
            },
        );
        assert!(near(short.radiance, ENVIRONMENT));
        assert_eq!(short.step_count, 5);
        assert_eq!(
            march(&levels([DVec4::ONE; 4]), &up(0.0), &TEXTBOOK).step_count,
            1
        );
    }

    /// tan(γ/2) = ½, β = 1: c = 2 t, so steps begin at 0, 1, 3, … with d = max(1, c): 1, 2, 6.
    #[test]
    fn steps_are_centred_on_their_samples() {
        for (distance, expected) in [(0.0, 1.0), (1.0, 2.0), (3.0, 6.0)] {
            assert_eq!(
                sample_diameter(&up(0.5), distance, &TEXTBOOK, None, 1.0),
                expected,
                "distance {distance}"
            );
        }
        assert_eq!(
            march(&levels([DVec4::ZERO; 4]), &up(0.5), &TEXTBOOK).step_count,
            3
        );
    }

    /// Level 0 is empty, all others are opaque: an unclamped cone is covered; one whose samples are
    /// kept to a voxel sees the environment.
    #[test]
    fn height_clamp_keeps_samples_small() {
        let chain = levels([DVec4::ZERO, DVec4::ONE, DVec4::ONE, DVec4::ONE]);
        assert!(near(
            march(&chain, &up(0.5), &TEXTBOOK).radiance,
            DVec3::ONE
        ));
        assert!(near(
            march(
                &chain,
                &up(0.5),
                &MarchSettings {
                    height_clamp: 100.0,
                    ..TEXTBOOK
                }
            )
            .radiance,
            ENVIRONMENT
        ));
        // At c = 6, height 6: k = 3 allows a diameter of 2.
        assert_eq!(
            sample_diameter(
                &up(0.5),
                3.0,
                &MarchSettings {
                    height_clamp: 3.0,
                    ..TEXTBOOK
                },
                None,
                1.0
            ),
            2.0
        );
    }

    /// The wall is the layer z = 5, of opacity ½: it hides half of what is behind it, and nothing
    /// of what is before it, however wide the cone.
    #[test]
    fn a_cone_to_a_light_ends_there() {
        let normal = DVec3::Z;
        let receiver = Receiver {
            position: DVec3::new(4.5, 4.5, 0.0),
            geometric_normal: normal,
            shading_normal: normal,
        };
        let at = |z: f64, tan_half: f64| {
            light_visibility(
                &wall(),
                &receiver,
                0.0,
                LightPlace::Position(DVec3::new(4.5, 4.5, z)),
                tan_half,
                &TEXTBOOK,
            )
        };
        for (z, tan_half, expected) in [
            (4.9, 0.0, 1.0),
            (6.1, 0.0, 0.5),
            (100.0, 0.0, 0.5),
            (5.0, 0.1, 1.0),
            (0.0, 0.1, 1.0),
        ] {
            assert_eq!(
                at(z, tan_half),
                expected,
                "a light at {z}, tan(γ/2) = {tan_half}"
            );
        }
        let towards = |direction| {
            light_visibility(
                &wall(),
                &receiver,
                0.0,
                LightPlace::Direction(direction),
                0.0,
                &TEXTBOOK,
            )
        };
        assert_eq!([towards(DVec3::Z), towards(DVec3::X)], [0.5, 1.0]);
    }

    #[test]
    fn distances_to_the_grids_sides() {
        assert_eq!(exit_distance(DVec3::new(1.0, 2.0, 3.0), DVec3::X, 8.0), 7.0);
        assert_eq!(
            exit_distance(DVec3::new(1.0, 2.0, 3.0), DVec3::NEG_Y, 8.0),
            2.0
        );
        assert_eq!(
            exit_distance(DVec3::new(4.0, 4.0, 4.0), DVec3::new(0.6, 0.0, -0.8), 8.0),
            5.0
        );
    }
}
