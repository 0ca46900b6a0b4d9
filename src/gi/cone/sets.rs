//! Cone sets: directions, apertures and weights that cover the hemisphere.
//!
//! A weight is the cone's share of E/π, so weights sum to 1 and a uniform environment gives E = π L with every set.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_3, FRAC_PI_4, PI, TAU};

use crate::gi::Settings;
use crate::gi::settings::SettingError;

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
    /// Width of the stratum of sin²θ that each cone may move in from pixel to pixel; 0 where elevations are fixed.
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
        KahlRings { front: is_on("kahl_front"), intermediate: is_on("kahl_intermediate"), side: is_on("kahl_side") }
    }
}

/// Whether the settings of cones are possible together.
pub fn check(settings: &Settings) -> Result<(), SettingError> {
    if settings.is("cone_set", "kahl") && diffuse_set(settings).cones.is_empty() {
        return Err(SettingError::Together("cone_set = kahl needs one of kahl_front, kahl_intermediate and kahl_side to be on".into()));
    }
    Ok(())
}

/// The set of a pixel's diffuse cones.
pub fn diffuse_set(settings: &Settings) -> ConeSet {
    let aperture_scale = settings.number("aperture_scale");
    match settings.choice("cone_set") {
        "kahl" => kahl_set(KahlRings::new(settings), aperture_scale),
        set => cone_set(settings.count("cones"), set == "disc", aperture_scale),
    }
}

/// The rings of Kahl 2019, section 5.4.4, all of 0.55 rad. Their weights are not stated; here they are each cone's share of the cosine-weighted hemisphere,
/// ∫ cos θ dω / π = sin²(γ/2) cos θ, and (γ/2 − sin(γ/2) cos(γ/2)) / π of a cone that the horizon halves, divided by the sum over the rings that are traced.
pub fn kahl_set(rings: KahlRings, aperture_scale: f32) -> ConeSet {
    let half = 0.5 * KAHL_APERTURE_RAD;
    let above = half.sin().powi(2);
    let all =
        [(rings.front, 1, 0.0, above), (rings.intermediate, 4, 0.5, above * FRAC_PI_4.cos()), (rings.side, 4, 1.0, (half - half.sin() * half.cos()) / PI)];
    let traced = || all.into_iter().filter(|(is_traced, ..)| *is_traced);
    let total: f32 = traced().map(|(_, count, _, share)| f32::from(count) * share).sum();
    let tan_half_aperture = half.tan() * aperture_scale;
    let ring = |(_, count, sin2_theta, share): (bool, u8, f32, f32)| {
        (0..count).map(move |i| Cone { sin2_theta, phi_rad: FRAC_PI_2 * f32::from(i), tan_half_aperture, weight: share / total })
    };
    let cones = traced().flat_map(ring).collect();
    ConeSet { cones, stratum: 0.0 }
}

/// The set of `count` cones.
///
/// With `disc`, or for more than nine cones, directions are a Vogel spiral on the unit disc lifted to the hemisphere (Malley), each of weight 1/n and of
/// the solid angle of its share, π / (n cos θ). Otherwise those of the papers, all of 60° aperture or less:
/// 1: the normal, 120°. 5: the normal and four at 45°, 60°. 6: the normal and five at 60° (Crassin et al. 2011; weights 1/4 and 3/20).
/// 9: the normal, four at 45° and four at 60° turned by 45°, 40°. The weights of 5 and 9 are proportional to cos θ times the cone's solid angle.
pub fn cone_set(count: u32, disc: bool, aperture_scale: f32) -> ConeSet {
    let ring = |n: u32, theta: f32, turn: f32, half: f32, weight: f32| {
        (0..n).map(move |i| Cone { sin2_theta: theta.sin().powi(2), phi_rad: turn + TAU * i as f32 / n as f32, tan_half_aperture: half.tan(), weight })
    };
    let (mut cones, stratum): (Vec<Cone>, f32) = match count {
        _ if disc || count > 9 => (disc_cones(count), 1.0 / count as f32),
        1 => (ring(1, 0.0, 0.0, FRAC_PI_3, 1.0).collect(), 0.0),
        5 => {
            let side = FRAC_PI_4.cos();
            let total = 1.0 + 4.0 * side;
            (ring(1, 0.0, 0.0, PI / 6.0, 1.0 / total).chain(ring(4, FRAC_PI_4, 0.0, PI / 6.0, side / total)).collect(), 0.0)
        }
        6 => (ring(1, 0.0, 0.0, PI / 6.0, 0.25).chain(ring(5, FRAC_PI_3, 0.0, PI / 6.0, 0.15)).collect(), 0.0),
        _ => {
            let (middle, side) = (FRAC_PI_4.cos(), FRAC_PI_3.cos());
            let total = 1.0 + 4.0 * middle + 4.0 * side;
            let half = PI / 9.0;
            let front = ring(1, 0.0, 0.0, half, 1.0 / total);
            (front.chain(ring(4, FRAC_PI_4, 0.0, half, middle / total)).chain(ring(4, FRAC_PI_3, FRAC_PI_4, half, side / total)).collect(), 0.0)
        }
    };
    cones.iter_mut().for_each(|cone| cone.tan_half_aperture *= aperture_scale);
    ConeSet { cones, stratum }
}

fn disc_cones(count: u32) -> Vec<Cone> {
    let n = count as f32;
    let cone = |i: u32| {
        let sin2_theta = (i as f32 + 0.5) / n;
        let cos_theta = (1.0 - sin2_theta).sqrt();
        // A cone of solid angle Ω has cos(γ/2) = 1 − Ω / 2π; shares near the horizon are kept below a hemisphere.
        let cos_half = (1.0 - 0.5 / (n * cos_theta)).max(0.2);
        Cone { sin2_theta, phi_rad: i as f32 * GOLDEN_ANGLE_RAD, tan_half_aperture: (1.0 - cos_half * cos_half).sqrt() / cos_half, weight: 1.0 / n }
    };
    (0..count).map(cone).collect()
}
