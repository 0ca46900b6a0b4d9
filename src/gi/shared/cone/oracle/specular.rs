//! CPU twin of `cone.specular`: one cone along the mirror direction, as wide as the glossy lobe, in
//! f64; and the lobe itself.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, DVec4};

use super::{Cone, Levels, MarchSettings, apex, march};
use crate::gi::shared::voxel::oracle::Receiver;

/// The GGX lobe of a glossy surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss {
    /// Reflectance at normal incidence, F₀.
    pub f0: DVec3,
    /// Perceptual roughness; α is its square, at least 10⁻³.
    pub roughness: f64,
}

/// A cone of the glossy lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeCone {
    /// Unit vector away from the surface; it may lead below it.
    pub direction: DVec3,
    /// γ/2 \[rad\].
    pub half_angle_rad: f64,
    /// What of its light is reflected.
    pub reflected: DVec3,
}

/// Widest half angle of a cone \[rad\].
const WIDEST_RAD: f64 = 1.0;

/// Least cosine between the axis of a cone and the normal of the surface that it starts from,
/// before the axis is brought to unit length.
const LEAST_COSINE: f64 = 0.02;

impl Gloss {
    fn alpha(&self) -> f64 {
        self.roughness.powi(2).max(1e-3)
    }

    /// γ/2 of the cone \[rad\], equation (19) of `docs/gi/voxel_mips.md`: the share u of the half
    /// vectors lies within tan²θ = α² u / (1 − u) of the normal, and a direction turns by twice
    /// as much as the half vector. u is ¼.
    pub fn half_angle_rad(&self) -> f64 {
        self.half_angle_of(0.25)
    }

    fn half_angle_of(&self, u: f64) -> f64 {
        let tan = self.alpha() * (u / (1.0 - u)).sqrt();
        (2.0 * tan.atan()).min(WIDEST_RAD)
    }

    /// The whole lobe as one cone, for a viewer in a unit direction.
    pub fn whole(&self, shading: DVec3, to_eye: DVec3) -> LobeCone {
        LobeCone {
            direction: 2.0 * shading.dot(to_eye) * shading - to_eye,
            half_angle_rad: self.half_angle_rad(),
            reflected: self.directional_albedo(shading.dot(to_eye).max(0.0)),
        }
    }

    /// One of `count` cones of the lobe: about the half vector that two numbers of \[0, 1) stand
    /// for, distributed as the facets that the viewer sees (Dupuy & Benyoub 2023), with the light
    /// that other facets stop left out (Heitz 2014).
    pub fn part(&self, shading: DVec3, to_eye: DVec3, uv: DVec2, count: u32) -> LobeCone {
        let alpha = self.alpha();
        let [tangent, bitangent] = tangents(shading);
        let local = |v: DVec3| DVec3::new(v.dot(tangent), v.dot(bitangent), v.dot(shading));
        let seen = local(to_eye);
        let eye = DVec3::new(seen.x, seen.y, seen.z.max(1e-3)).normalize();
        let stretched = DVec3::new(alpha * eye.x, alpha * eye.y, eye.z).normalize();
        let z = (1.0 - uv.x) * (1.0 + stretched.z) - stretched.z;
        let (sin, cos) = (2.0 * PI * uv.y).sin_cos();
        let across = (1.0 - z * z).max(0.0).sqrt();
        let cap = DVec3::new(across * cos, across * sin, z) + stretched;
        let half = DVec3::new(alpha * cap.x, alpha * cap.y, cap.z.max(1e-6)).normalize();
        let light = 2.0 * eye.dot(half) * half - eye;
        let masked = |cosine: f64| {
            0.5 * ((1.0 + alpha * alpha * (1.0 / (cosine * cosine) - 1.0)).sqrt() - 1.0)
        };
        let reflected = if light.z > 0.0 {
            let (of_eye, of_light) = (masked(eye.z), masked(light.z));
            let fresnel = self.f0 + (1.0 - self.f0) * (1.0 - eye.dot(half)).powi(5);
            fresnel * ((1.0 + of_eye) / (1.0 + of_eye + of_light))
        } else {
            DVec3::ZERO
        };
        LobeCone {
            direction: light.x * tangent + light.y * bitangent + light.z * shading,
            half_angle_rad: self.half_angle_of(0.25 / f64::from(count)),
            reflected,
        }
    }

    /// Share of the light from all sides that the lobe reflects to a viewer at this cosine to the
    /// normal: the fit of Karis 2014 ("Physically Based Shading on Mobile").
    pub fn directional_albedo(&self, cosine: f64) -> DVec3 {
        let r = self.roughness * DVec4::new(-1.0, -0.0275, -0.572, 0.022)
            + DVec4::new(1.0, 0.0425, 1.04, -0.04);
        let a004 = (r.x * r.x).min((-9.28 * cosine).exp2()) * r.x + r.y;
        let ab = a004 * DVec2::new(-1.04, 1.04) + DVec2::new(r.z, r.w);
        (self.f0 * ab.x + ab.y).max(DVec3::ZERO)
    }

    /// f_s \[1/sr\] = D G₂ F / (4 cos θ_o cos θ_i), for unit directions away from the surface: D of
    /// Walter et al. 2007, G₂ = 1 / (1 + Λ_o + Λ_i) of Heitz 2014, F of Schlick 1994.
    pub fn brdf(&self, normal: DVec3, to_eye: DVec3, to_light: DVec3) -> DVec3 {
        let half = (to_eye + to_light).normalize();
        let squared = self.alpha().powi(2);
        let tan_squared = |cosine: f64| 1.0 / (cosine * cosine) - 1.0;
        let lambda = |cosine: f64| 0.5 * ((1.0 + squared * tan_squared(cosine)).sqrt() - 1.0);
        let (cos_eye, cos_light, cos_half) =
            (normal.dot(to_eye), normal.dot(to_light), normal.dot(half));
        let distribution =
            squared / (PI * cos_half.powi(4) * (squared + tan_squared(cos_half)).powi(2));
        let fresnel = self.f0 + (1.0 - self.f0) * (1.0 - half.dot(to_light)).powi(5);
        fresnel
            * (distribution
                / (1.0 + lambda(cos_eye) + lambda(cos_light))
                / (4.0 * cos_eye * cos_light))
    }
}

/// A tangent and bitangent of a unit vector, as shaders choose them (Duff et al. 2017).
fn tangents(n: DVec3) -> [DVec3; 2] {
    let sign = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [
        DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        DVec3::new(b, sign + n.y * n.y * a, -n.y),
    ]
}

/// Above the surface of this unit normal by a cosine of at least .02 before it is brought to unit
/// length: a shading normal may mirror below it.
pub fn lifted(direction: DVec3, normal: DVec3) -> DVec3 {
    let rise = (LEAST_COSINE - direction.dot(normal)).max(0.0);
    (direction + rise * normal).normalize()
}

/// Indirect specular radiance L_s [W/(m² sr)] that a surface reflects by a cone of its lobe. Only
/// the radiance of the cone's result counts.
pub fn specular<'l>(
    levels: impl Into<Levels<'l>>,
    receiver: &Receiver,
    lobe: &LobeCone,
    start_offset: f64,
    settings: &MarchSettings,
) -> DVec3 {
    let levels = levels.into();
    let normal = receiver.geometric_normal;
    let direction = lifted(lobe.direction, normal);
    let (origin, height) = apex(levels, receiver, start_offset);
    let cone = Cone {
        origin,
        direction,
        tan_half: lobe.half_angle_rad.tan(),
        height,
        cosine: direction.dot(normal).max(0.0),
    };
    lobe.reflected * march(levels, &cone, settings).radiance
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gi::shared::cone::oracle::Volume;

    /// The largest error of the fitted directional albedo against the lobe's own, over F₀ of 0.04,
    /// 0.5 and 1, roughness of 0.2 to 1 and cosines of 0.2 to 1.
    const WORST: f64 = -0.192;
    const MEAN: f64 = -0.047;

    fn gloss(roughness: f64) -> Gloss {
        Gloss {
            f0: DVec3::new(0.04, 0.5, 1.0),
            roughness,
        }
    }

    fn at(cosine: f64) -> DVec3 {
        DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine)
    }

    /// Half vectors of GGX, n² of equal shares: tan²θ = α² u / (1 − u).
    fn half_vectors(alpha: f64, n: u32) -> impl Iterator<Item = DVec3> {
        (0..n * n).map(move |index| {
            let [u, v] = [index % n, index / n].map(|at| (f64::from(at) + 0.5) / f64::from(n));
            let tan = alpha * (u / (1.0 - u)).sqrt();
            DVec3::new(tan * (2.0 * PI * v).cos(), tan * (2.0 * PI * v).sin(), 1.0).normalize()
        })
    }

    /// What the lobe reflects: its integral against the cosine, over half vectors by their density
    /// D cos θ_h / (4 cos θ_d).
    fn integrated_albedo(gloss: &Gloss, cosine: f64) -> DVec3 {
        let (eye, squared, n) = (at(cosine), gloss.alpha().powi(2), 128);
        let weighed = |half: DVec3| {
            let light = 2.0 * half.dot(eye) * half - eye;
            if light.z <= 0.0 {
                return DVec3::ZERO;
            }
            let tan_squared = 1.0 / (half.z * half.z) - 1.0;
            let density = squared
                / (PI * half.z.powi(3) * (squared + tan_squared).powi(2))
                / (4.0 * half.dot(eye));
            gloss.brdf(DVec3::Z, eye, light) * light.z / density
        };
        half_vectors(gloss.alpha(), n).map(weighed).sum::<DVec3>() / f64::from(n * n)
    }

    /// A smooth lobe that reflects all of the light reflects all of it, and a rough one loses what
    /// its facets shadow (0.307 of it is left at α = 1, by another integration).
    #[test]
    fn the_lobe_keeps_its_energy() {
        for (roughness, expected) in [(0.0, 1.0), (0.2, 1.0), (1.0, 0.307)] {
            let albedo = integrated_albedo(&gloss(roughness), 1.0);
            assert!(
                (albedo.z - expected).abs() < 2e-3,
                "roughness {roughness}: {albedo}"
            );
        }
    }

    /// The published fit is not quite that of this lobe: how far it is off, from both sides.
    #[test]
    fn the_fit_is_as_wrong_as_it_is_said_to_be() {
        let grid = [0.2, 0.4, 0.6, 0.8, 1.0]
            .into_iter()
            .flat_map(|roughness| [0.2, 0.5, 0.8, 1.0].map(|cosine| (roughness, cosine)));
        let (mut sum, mut worst, mut count) = (0.0, 0.0f64, 0.0);
        for (roughness, cosine) in grid {
            let gloss = gloss(roughness);
            let off = gloss.directional_albedo(cosine) - integrated_albedo(&gloss, cosine);
            assert!(off.is_finite(), "roughness {roughness}, cosine {cosine}");
            worst = off.to_array().into_iter().fold(worst, |worst, off| {
                if off.abs() > worst.abs() { off } else { worst }
            });
            (sum, count) = (sum + off.element_sum(), count + 3.0);
        }
        println!(
            "the fit is {:+.4} off in the mean, {worst:+.4} at worst",
            sum / count
        );
        assert!(
            (worst - WORST).abs() < 0.005 && (sum / count - MEAN).abs() < 0.002,
            "{worst}, {}",
            sum / count
        );
    }

    /// The cones of a lobe reflect together what its integral does, whatever the viewer's angle.
    #[test]
    fn parts_reflect_what_the_lobe_does() {
        for (roughness, cosine) in [(0.2, 0.9), (0.5, 0.4), (0.8, 1.0), (1.0, 0.15)] {
            let (gloss, n) = (gloss(roughness), 64);
            let mean = (0..n * n)
                .map(|at| {
                    let uv = [at % n, at / n].map(|at| (f64::from(at) + 0.5) / f64::from(n));
                    gloss
                        .part(DVec3::Z, self::at(cosine), uv.into(), 16)
                        .reflected
                })
                .sum::<DVec3>()
                / f64::from(n * n);
            let off = mean - integrated_albedo(&gloss, cosine);
            assert!(
                off.abs().max_element() < 4e-3,
                "roughness {roughness}, cosine {cosine}: {off}"
            );
        }
        // A mirror has one direction; 16 cones of a lobe are about a quarter as wide as one.
        let (eye, uv) = (at(0.6), DVec2::new(0.3, 0.8));
        let part = gloss(0.0).part(DVec3::Z, eye, uv, 16);
        assert!((part.direction - DVec3::new(-eye.x, 0.0, eye.z)).length() < 3e-3);
        let lobe = gloss(0.3);
        let narrower = lobe.part(DVec3::Z, eye, uv, 16).half_angle_rad / lobe.half_angle_rad();
        assert!((narrower - 0.218).abs() < 2e-3, "{narrower}");
    }

    /// A quarter of the half vectors is within half of the cone's half angle, of any roughness that
    /// the widest cone leaves room for; a mirror is a line.
    #[test]
    fn a_quarter_of_the_half_vectors_is_in_the_cone() {
        for roughness in [0.1, 0.4, 0.8] {
            let gloss = gloss(roughness);
            let within = |half: &DVec3| half.z > (0.5 * gloss.half_angle_rad()).cos();
            let share = half_vectors(gloss.alpha(), 100).filter(within).count() as f64 / 1e4;
            assert!(
                (share - 0.25).abs() < 1e-9,
                "roughness {roughness}: {share}"
            );
        }
        // tan(γ/4) = 10⁻³ / √3, and 1 / √3.
        assert!((gloss(0.0).half_angle_rad() - 2e-3 / 3f64.sqrt()).abs() < 1e-8);
        assert_eq!(gloss(1.0).half_angle_rad(), 1.0, "not 60°");
    }

    /// At normal incidence a smooth surface reflects F₀; where there is nothing, it reflects the
    /// environment; and a mirror of the wall sees the wall.
    #[test]
    fn a_mirror_shows_what_is_there() {
        let wall = [Volume::new(16, |[x, ..]| {
            if x == 12 {
                DVec4::new(2.0, 2.0, 2.0, 1.0)
            } else {
                DVec4::ZERO
            }
        })];
        let settings = MarchSettings {
            step_factor: 0.25,
            opacity_exponent: 8.0,
            max_distance: 1e9,
            environment: DVec3::new(0.0, 0.0, 1.0),
            ..MarchSettings::TEXTBOOK
        };
        let seen = |normal: DVec3, to_eye: DVec3| {
            let receiver = Receiver {
                position: DVec3::new(6.0, 8.0, 2.0),
                geometric_normal: DVec3::Z,
                shading_normal: normal,
            };
            let gloss = Gloss {
                f0: DVec3::ONE,
                roughness: 0.0,
            };
            let lobe = gloss.whole(normal, to_eye);
            specular(wall.as_slice(), &receiver, &lobe, 1.0, &settings) / lobe.reflected
        };
        assert!((seen(DVec3::Z, DVec3::Z) - DVec3::Z).abs().max_element() < 1e-9);
        // An eye at −x sees +x in the floor.
        let aside = DVec3::new(-0.8, 0.0, 0.6);
        assert!(
            (seen(DVec3::Z, aside) - 2.0).abs().max_element() < 0.05,
            "{}",
            seen(DVec3::Z, aside)
        );
        // Mirrored about a normal that leans away, the direction would go below the floor: it skims
        // it instead, and sees the wall too.
        let leaning = DVec3::new(0.6, 0.0, 0.8);
        assert!(
            (seen(leaning, at(0.9) * DVec3::new(-1.0, 1.0, 1.0)) - 2.0)
                .abs()
                .max_element()
                < 0.05
        );
    }
}
