//! Cone sets: directions, apertures and weights that cover the hemisphere.
//!
//! A weight is the cone's share of E/π, so weights sum to 1 and a uniform environment gives E = π L
//! with every set.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_3, FRAC_PI_4, FRAC_PI_8, PI, TAU};

use crate::gi::Settings;
use crate::gi::settings::SettingError;
use crate::gi::shared::interleave::Pattern;

/// One cone around the surface normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// sin² of the angle between axis and normal.
    pub sin2_theta: f32,
    /// Azimuth (rad).
    pub phi_rad: f32,
    /// tan(γ/2) of the full aperture γ.
    pub tan_half_aperture: f32,
    /// Share of E/π.
    pub weight: f32,
}

/// A set of cones.
#[derive(Clone, Debug, PartialEq)]
pub struct ConeSet {
    /// The cones.
    pub cones: Vec<Cone>,
    /// Width of the stratum of sin²θ that each cone may move in from pixel to pixel; 0 where
    /// elevations are fixed.
    pub stratum: f32,
}

const GOLDEN_ANGLE_RAD: f32 = 2.399_963_2;

/// γ of all cones of [`kahl_set`] (rad).
const KAHL_APERTURE_RAD: f32 = 0.55;

/// Which rings of [`kahl_set`] are traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KahlRings {
    /// The cone along the normal.
    pub front: bool,
    /// Four at 45° to it.
    pub intermediate: bool,
    /// Four in the tangent plane, each 45° from an intermediate one.
    pub side: bool,
}

impl KahlRings {
    fn new(settings: &Settings) -> Self {
        let is_on = |name: &str| settings.is(name, "on");
        KahlRings {
            front: is_on("kahl_front"),
            intermediate: is_on("kahl_intermediate"),
            side: is_on("kahl_side"),
        }
    }
}

/// Smallest step (sample diameters): with it, the loops of the longest cones still end.
const LEAST_STEP: f32 = 0.1;

/// Whether the settings of cones are possible together.
pub fn check(settings: &Settings) -> Result<(), SettingError> {
    if settings.is("cone_set", "kahl") && diffuse_set(settings).cones.is_empty() {
        return Err(SettingError::Together(
            "cone_set = kahl needs one of kahl_front, kahl_intermediate and kahl_side to be on"
                .into(),
        ));
    }
    for name in ["specular_step", "shadow_step", "occlusion_step"] {
        let step = settings.number(name);
        if step > 0.0 && step < LEAST_STEP {
            return Err(SettingError::Together(format!(
                "{name} = {step} is neither 0, for step_factor, nor {LEAST_STEP} or more"
            )));
        }
    }
    super::patches::check(settings)
}

/// The set of a pixel's diffuse cones.
pub fn diffuse_set(settings: &Settings) -> ConeSet {
    let aperture_scale = settings.number("aperture_scale");
    match settings.choice("cone_set") {
        "kahl" => kahl_set(KahlRings::new(settings), aperture_scale),
        set => {
            let shares = Pattern::new(settings).count();
            shared_cone_set(
                settings.count("cones"),
                set == "disc",
                aperture_scale,
                shares,
            )
        }
    }
}

/// The rings of Kahl 2019, section 5.4.4, all of 0.55 rad. Their weights are not stated; here they
/// are each cone's share of the cosine-weighted hemisphere, ∫ cos θ dω / π = sin²(γ/2) cos θ, and
/// (γ/2 − sin(γ/2) cos(γ/2)) / π of a cone that the horizon halves, divided by the sum over the
/// rings that are traced.
pub fn kahl_set(rings: KahlRings, aperture_scale: f32) -> ConeSet {
    let half = 0.5 * KAHL_APERTURE_RAD;
    let above = half.sin().powi(2);
    let all = [
        (rings.front, 1, 0.0, above),
        (rings.intermediate, 4, 0.5, above * FRAC_PI_4.cos()),
        (rings.side, 4, 1.0, (half - half.sin() * half.cos()) / PI),
    ];
    let traced = || all.into_iter().filter(|(is_traced, ..)| *is_traced);
    let total: f32 = traced()
        .map(|(_, count, _, share)| f32::from(count) * share)
        .sum();
    let tan_half_aperture = half.tan() * aperture_scale;
    let ring = |(_, count, sin2_theta, share): (bool, u8, f32, f32)| {
        (0..count).map(move |i| Cone {
            sin2_theta,
            phi_rad: FRAC_PI_2 * f32::from(i),
            tan_half_aperture,
            weight: share / total,
        })
    };
    let cones = traced().flat_map(ring).collect();
    ConeSet {
        cones,
        stratum: 0.0,
    }
}

/// The set of `count` cones.
///
/// With `disc`, or for more than nine cones, directions are a Vogel spiral on the unit disc lifted
/// to the hemisphere (Malley), each of weight 1/n and of the solid angle of its share, π / (n cos
/// θ). Otherwise those of the papers, all of 60° aperture or less: 1: the normal, 120°. 4: at 45°,
/// 45° (Villegas and Ramírez, section IX, who do not say where). 5: the normal and four at 45°,
/// 60°. 6: the normal and five at 60° (Crassin et al. 2011; weights 1/4 and 3/20). 9: the normal,
/// four at 45° and four at 60° turned by 45°, 40°. The weights of 5 and 9 are proportional to cos θ
/// times the cone's solid angle.
pub fn cone_set(count: u32, disc: bool, aperture_scale: f32) -> ConeSet {
    shared_cone_set(count, disc, aperture_scale, count)
}

/// As [`cone_set`], where `shares` pixels with sets of their own complete each other: apertures of
/// the spiral are those of so many cones, where that is more.
fn shared_cone_set(count: u32, disc: bool, aperture_scale: f32, shares: u32) -> ConeSet {
    let ring = |n: u32, theta: f32, turn: f32, half: f32, weight: f32| {
        (0..n).map(move |i| Cone {
            sin2_theta: theta.sin().powi(2),
            phi_rad: turn + TAU * i as f32 / n as f32,
            tan_half_aperture: half.tan(),
            weight,
        })
    };
    let (mut cones, stratum): (Vec<Cone>, f32) = match count {
        _ if disc || count > 9 => (disc_cones(count, shares), 1.0 / count as f32),
        1 => (ring(1, 0.0, 0.0, FRAC_PI_3, 1.0).collect(), 0.0),
        4 => (ring(4, FRAC_PI_4, 0.0, FRAC_PI_8, 0.25).collect(), 0.0),
        5 => {
            let side = FRAC_PI_4.cos();
            let total = 1.0 + 4.0 * side;
            (
                ring(1, 0.0, 0.0, PI / 6.0, 1.0 / total)
                    .chain(ring(4, FRAC_PI_4, 0.0, PI / 6.0, side / total))
                    .collect(),
                0.0,
            )
        }
        6 => (
            ring(1, 0.0, 0.0, PI / 6.0, 0.25)
                .chain(ring(5, FRAC_PI_3, 0.0, PI / 6.0, 0.15))
                .collect(),
            0.0,
        ),
        _ => {
            let (middle, side) = (FRAC_PI_4.cos(), FRAC_PI_3.cos());
            let total = 1.0 + 4.0 * middle + 4.0 * side;
            let half = PI / 9.0;
            let front = ring(1, 0.0, 0.0, half, 1.0 / total);
            (
                front
                    .chain(ring(4, FRAC_PI_4, 0.0, half, middle / total))
                    .chain(ring(4, FRAC_PI_3, FRAC_PI_4, half, side / total))
                    .collect(),
                0.0,
            )
        }
    };
    cones
        .iter_mut()
        .for_each(|cone| cone.tan_half_aperture *= aperture_scale);
    ConeSet { cones, stratum }
}

fn disc_cones(count: u32, shares: u32) -> Vec<Cone> {
    let (n, shares) = (count as f32, shares.max(count) as f32);
    let cone = |i: u32| {
        let sin2_theta = (i as f32 + 0.5) / n;
        let cos_theta = (1.0 - sin2_theta).sqrt();
        // A cone of solid angle Ω has cos(γ/2) = 1 − Ω / 2π; shares near the horizon are kept below
        // a hemisphere.
        let cos_half = (1.0 - 0.5 / (shares * cos_theta)).max(0.2);
        Cone {
            sin2_theta,
            phi_rad: i as f32 * GOLDEN_ANGLE_RAD,
            tan_half_aperture: (1.0 - cos_half * cos_half).sqrt() / cos_half,
            weight: 1.0 / n,
        }
    };
    (0..count).map(cone).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DVec3;

    use super::*;
    use crate::gi::shared::voxel::oracle::hemisphere_direction;

    const SQRT_HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;

    fn axis(cone: &Cone) -> DVec3 {
        hemisphere_direction(
            DVec3::Z,
            f64::from(cone.sin2_theta),
            f64::from(cone.phi_rad),
        )
    }

    /// Angle to the normal, azimuth, half angle (all in degrees) and weight of each cone. 6: the
    /// renderer of Villegas & Ramírez (`diffuseConeDirections` and `diffuseConeWeights` of
    /// `global_illumination_pass.frag` in jose-villegas/VCTRenderer), whose weights π/4 and 3π/20
    /// are those of E = Σ w L, here over π. 5 and 9: all cones as wide, and weights ∝ cos θ, so
    /// that each is 1 / Σ cos θ of its cosine.
    fn published(count: u32) -> Vec<[f64; 4]> {
        let ring = |count: u32, theta: f64, turn: f64, half: f64, weight: f64| {
            (0..count).map(move |i| {
                [
                    theta,
                    turn + 360.0 * f64::from(i) / f64::from(count),
                    half,
                    weight,
                ]
            })
        };
        match count {
            1 => vec![[0.0, 0.0, 60.0, 1.0]],
            4 => ring(4, 45.0, 0.0, 22.5, 0.25).collect(),
            5 => ring(1, 0.0, 0.0, 30.0, 0.261_204)
                .chain(ring(4, 45.0, 0.0, 30.0, 0.184_699))
                .collect(),
            6 => ring(1, 0.0, 0.0, 30.0, 0.25)
                .chain(ring(5, 60.0, 0.0, 30.0, 0.15))
                .collect(),
            _ => {
                let above =
                    ring(1, 0.0, 0.0, 20.0, 0.171_573).chain(ring(4, 45.0, 0.0, 20.0, 0.121_320));
                above.chain(ring(4, 60.0, 45.0, 20.0, 0.085_786)).collect()
            }
        }
    }

    #[test]
    fn published_sets_are_as_published() {
        for count in [1, 4, 5, 6, 9] {
            let (set, published) = (cone_set(count, false, 1.0), published(count));
            assert_eq!(
                (set.cones.len(), set.stratum),
                (published.len(), 0.0),
                "{count} cones"
            );
            for (cone, [theta, azimuth, half, weight]) in set.cones.iter().zip(published) {
                let [theta, azimuth, half] = [theta, azimuth, half].map(f64::to_radians);
                let expected = DVec3::new(
                    theta.sin() * azimuth.cos(),
                    theta.sin() * azimuth.sin(),
                    theta.cos(),
                );
                assert!(
                    (axis(cone) - expected).abs().max_element() < 1e-5,
                    "{count} cones: {cone:?} is not along {expected}"
                );
                assert!(
                    (f64::from(cone.tan_half_aperture) - half.tan()).abs() < 1e-5,
                    "{count} cones: {cone:?}"
                );
                assert!(
                    (f64::from(cone.weight) - weight).abs() < 1e-5,
                    "{count} cones: {cone:?} has not the weight {weight}"
                );
            }
        }
        // 1 + 4 cos 45°, and 4 cos 60° more.
        let [five, nine] = [1.0 + 4.0 * SQRT_HALF, 3.0 + 4.0 * SQRT_HALF];
        assert!(
            (1.0 / five - 0.261_204).abs() < 1e-6 && (SQRT_HALF / five - 0.184_699).abs() < 1e-6
        );
        assert!(
            (1.0 / nine - 0.171_573).abs() < 1e-6
                && (SQRT_HALF / nine - 0.121_320).abs() < 1e-6
                && (0.5 / nine - 0.085_786).abs() < 1e-6
        );
    }

    /// A weight is a share of ∫ cos θ dω / π, so that those of any set sum to 1, however wide its
    /// cones.
    #[test]
    fn weights_integrate_the_cosine() {
        let counted = [1, 4, 5, 6, 9, 16, 25, 32]
            .into_iter()
            .flat_map(|count| [false, true].map(|disc| cone_set(count, disc, 0.3)));
        let rings = (1..8).map(|rings| {
            kahl_set(
                KahlRings {
                    front: rings & 1 > 0,
                    intermediate: rings & 2 > 0,
                    side: rings & 4 > 0,
                },
                0.3,
            )
        });
        for set in counted.chain(rings) {
            let sum: f64 = set.cones.iter().map(|cone| f64::from(cone.weight)).sum();
            assert!((sum - 1.0).abs() < 1e-6, "weights sum to {sum}: {set:?}");
        }
    }

    /// Each cone of 4, of 5 and of 9 counts as much as it covers of the cosine-weighted hemisphere,
    /// which directions tell; those of 6 do not.
    #[test]
    fn weights_are_what_cones_cover() {
        for (count, is_covered) in [(4, true), (5, true), (9, true), (6, false)] {
            let cones = cone_set(count, false, 1.0).cones;
            let n = 100_000;
            let mut covered = vec![0.0f64; cones.len()];
            for i in 0..n {
                let direction = hemisphere_direction(
                    DVec3::Z,
                    (f64::from(i) + 0.5) / f64::from(n),
                    f64::from(i) * PI * (3.0 - 5f64.sqrt()),
                );
                let holds = |cone: &Cone| {
                    axis(cone).dot(direction) >= f64::from(cone.tan_half_aperture).atan().cos()
                };
                cones
                    .iter()
                    .zip(&mut covered)
                    .filter(|(cone, _)| holds(cone))
                    .for_each(|(_, covered)| *covered += 1.0);
            }
            let total: f64 = covered.iter().sum();
            let off =
                |(cone, covered): (&Cone, &f64)| (f64::from(cone.weight) - covered / total).abs();
            let is_near = cones.iter().zip(&covered).all(|pair| off(pair) < 1e-3);
            assert_eq!(
                is_near,
                is_covered,
                "{count} cones of {:?} cover {covered:?}",
                cones.iter().map(|cone| cone.weight).collect::<Vec<_>>()
            );
        }
    }

    /// Cone i of n on a disc has its n-th of the disc to move in, and the solid angle Ω = 2π (1 −
    /// cos γ/2) = π / (n cos θ) of that share of the hemisphere.
    #[test]
    fn cones_on_a_disc_share_it() {
        for count in [5, 16, 32] {
            let set = cone_set(count, true, 1.0);
            let n = f64::from(count);
            assert_eq!(set.stratum, 1.0 / count as f32);
            for (cone, i) in set.cones.iter().zip(0u32..) {
                assert!(
                    (f64::from(cone.sin2_theta) - (f64::from(i) + 0.5) / n).abs() < 1e-6
                        && (f64::from(cone.weight) - 1.0 / n).abs() < 1e-6
                );
                let cos_half = f64::from(cone.tan_half_aperture).atan().cos();
                let solid_angle = 2.0 * PI * (1.0 - cos_half);
                let share = PI / (n * axis(cone).z);
                assert!(
                    (solid_angle - share).abs() < 1e-4 * share || (cos_half - 0.2).abs() < 1e-5,
                    "{cone:?}: {solid_angle} sr for {share} sr"
                );
            }
            // Neighbours in number are a golden angle apart.
            let apart = f64::from(set.cones[1].phi_rad - set.cones[0].phi_rad);
            assert!((apart - PI * (3.0 - 5f64.sqrt())).abs() < 1e-5, "{apart}");
        }
    }
}
