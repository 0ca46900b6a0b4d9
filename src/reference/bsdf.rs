//! Scattering at a surface: Lambert ρ/π plus, where the material says so, one GGX lobe with Schlick
//! Fresnel.
//!
//! The two are added, as the radiometric contract has it: L = ρ/π E + L_s. Directions point away
//! from the surface.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::Vec3;

/// The smallest GGX α: below it single precision no longer resolves the lobe, and a mirror would be
/// a delta.
const MIN_ALPHA: f32 = 1e-3;

/// The specular GGX lobe of a surface.
#[derive(Clone, Copy)]
pub(super) struct Lobe {
    /// Reflectance at normal incidence.
    pub(super) f0: Vec3,
    alpha: f32,
}

/// A sampled direction.
pub(super) struct Scatter {
    /// Unit direction.
    pub(super) direction: Vec3,
    /// f · cos / density.
    pub(super) weight: Vec3,
    /// Density [1/sr].
    pub(super) density: f32,
}

/// Density of cosine-weighted directions [1/sr].
pub(super) fn cosine_density(cosine: f32) -> f32 {
    cosine.max(0.0) * FRAC_1_PI
}

/// A cosine-weighted direction about `normal`, from a point of the unit square.
pub(super) fn sample_cosine(normal: Vec3, [x, y]: [f32; 2]) -> Vec3 {
    let (radius, phi) = (x.sqrt(), 2.0 * PI * y);
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    (tangent * (radius * phi.cos())
        + bitangent * (radius * phi.sin())
        + normal * (1.0 - x).max(0.0).sqrt())
    .normalize()
}

impl Lobe {
    /// The lobe of a perceptual roughness r: α = r².
    pub(super) fn new(f0: Vec3, roughness: f32) -> Self {
        Lobe {
            f0,
            alpha: (roughness * roughness).max(MIN_ALPHA),
        }
    }

    /// f · cos θ_i [1/sr], and the density [1/sr] with which [`Lobe::sample`] draws `wi`. Zero
    /// below the surface.
    pub(super) fn evaluate(&self, normal: Vec3, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let (cos_o, cos_i) = (normal.dot(wo), normal.dot(wi));
        if cos_o <= 0.0 || cos_i <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let half = (wo + wi).normalize();
        let distribution = self.distribution(normal, half);
        let (lambda_o, lambda_i) = (self.lambda(cos_o), self.lambda(cos_i));
        let value = self.fresnel(wi.dot(half))
            * (distribution / ((1.0 + lambda_o + lambda_i) * 4.0 * cos_o));
        (value, distribution / ((1.0 + lambda_o) * 4.0 * cos_o))
    }

    /// A direction from the distribution of visible normals (E. Heitz, *Sampling the GGX
    /// Distribution of Visible Normals*, JCGT 7(4), 2018).
    pub(super) fn sample(&self, normal: Vec3, wo: Vec3, [x, y]: [f32; 2]) -> Option<Scatter> {
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let view = Vec3::new(tangent.dot(wo), bitangent.dot(wo), normal.dot(wo));
        if view.z <= 0.0 {
            return None;
        }
        let stretched = Vec3::new(self.alpha * view.x, self.alpha * view.y, view.z).normalize();
        let (t1, t2) = stretched.any_orthonormal_pair();
        let (t1, t2) = match Vec3::Z.cross(stretched).try_normalize() {
            Some(across) => (across, stretched.cross(across)),
            None => (t1, t2),
        };
        let (radius, phi) = (x.sqrt(), 2.0 * PI * y);
        let p1 = radius * phi.cos();
        let blend = 0.5 * (1.0 + stretched.z);
        let p2 = (1.0 - blend) * (1.0 - p1 * p1).max(0.0).sqrt() + blend * radius * phi.sin();
        let micro = t1 * p1 + t2 * p2 + stretched * (1.0 - p1 * p1 - p2 * p2).max(0.0).sqrt();
        let micro = Vec3::new(
            self.alpha * micro.x,
            self.alpha * micro.y,
            micro.z.max(1e-6),
        )
        .normalize();
        let half = tangent * micro.x + bitangent * micro.y + normal * micro.z;
        let direction = (half * (2.0 * half.dot(wo)) - wo).normalize();
        let (value, density) = self.evaluate(normal, wo, direction);
        (density > 0.0 && density.is_finite()).then(|| Scatter {
            direction,
            weight: value / density,
            density,
        })
    }

    /// GGX distribution of normals D [1/sr]. The sine comes of the cross product: as 1 − cos²,
    /// single precision loses the peak of a narrow lobe.
    fn distribution(&self, normal: Vec3, half: Vec3) -> f32 {
        let square = self.alpha * self.alpha;
        let (cos_half, sin_square) = (normal.dot(half), normal.cross(half).length_squared());
        let denominator = cos_half * cos_half * square + sin_square;
        square / (PI * denominator * denominator)
    }

    /// Smith's Λ for GGX.
    fn lambda(&self, cosine: f32) -> f32 {
        let tan_square = (1.0 / (cosine * cosine) - 1.0).max(0.0);
        0.5 * ((1.0 + self.alpha * self.alpha * tan_square).sqrt() - 1.0)
    }

    /// Schlick's Fresnel reflectance.
    fn fresnel(&self, cosine: f32) -> Vec3 {
        self.f0 + (Vec3::ONE - self.f0) * (1.0 - cosine.clamp(0.0, 1.0)).powi(5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum of the density over the hemisphere, and the reflectance by quadrature and by sampling.
    fn check(roughness: f32, view_deg: f32) {
        let lobe = Lobe::new(Vec3::splat(0.04), roughness);
        let wo = Vec3::new(
            view_deg.to_radians().sin(),
            0.0,
            view_deg.to_radians().cos(),
        );
        let (n_theta, n_phi) = (1000, 500);
        let (mut density_sum, mut quadrature) = (0.0f64, 0.0f64);
        for i in 0..n_theta {
            for j in 0..n_phi {
                let theta = (i as f32 + 0.5) / n_theta as f32 * 0.5 * PI;
                let phi = (j as f32 + 0.5) / n_phi as f32 * 2.0 * PI;
                let wi = Vec3::new(
                    theta.sin() * phi.cos(),
                    theta.sin() * phi.sin(),
                    theta.cos(),
                );
                let solid_angle =
                    theta.sin() * (0.5 * PI / n_theta as f32) * (2.0 * PI / n_phi as f32);
                let (value, density) = lobe.evaluate(Vec3::Z, wo, wi);
                density_sum += f64::from(density * solid_angle);
                quadrature += f64::from(value.x * solid_angle);
            }
        }
        let n = 256;
        let (mut sampled, mut above) = (0.0f64, 0u32);
        for i in 0..n * n {
            let point = [
                ((i % n) as f32 + 0.5) / n as f32,
                ((i / n) as f32 + 0.5) / n as f32,
            ];
            if let Some(scatter) = lobe.sample(Vec3::Z, wo, point) {
                sampled += f64::from(scatter.weight.x) / f64::from(n * n);
                above += 1;
            }
        }
        assert!(
            (sampled / quadrature - 1.0).abs() < 0.01,
            "roughness {roughness}, {view_deg}°: sampled {sampled}, quadrature {quadrature}"
        );
        let share_above = f64::from(above) / f64::from(n * n);
        assert!(
            (density_sum - share_above).abs() < 0.01,
            "roughness {roughness}, {view_deg}°: density sums to {density_sum}, {share_above} \
             above"
        );
    }

    fn at(degrees: f32) -> Vec3 {
        Vec3::new(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos())
    }

    /// f cos θ by hand. α = 1: D = 1/π; straight on, Λ = 0: f cos = F₀/(4π). At 60° on both sides,
    /// Λ = 1/2 and G₂ = 1/2: f cos = F/(4π), F = 1/32 for F₀ = 0. α = 1/4, straight on: D =
    /// 16/π, f cos = 4 F₀/π.
    #[test]
    fn lobe_has_values_by_hand() {
        let value = |f0: f32, roughness: f32, wo, wi| {
            Lobe::new(Vec3::splat(f0), roughness)
                .evaluate(Vec3::Z, wo, wi)
                .0
                .y
        };
        let near = |found: f32, expected: f32| {
            assert!(
                (found / expected - 1.0).abs() < 1e-4,
                "{found} for {expected}"
            )
        };
        near(value(0.5, 1.0, Vec3::Z, Vec3::Z), 0.125 * FRAC_1_PI);
        near(value(1.0, 1.0, at(60.0), at(-60.0)), 0.25 * FRAC_1_PI);
        near(value(0.0, 1.0, at(60.0), at(-60.0)), FRAC_1_PI / 128.0);
        near(value(1.0, 0.5, Vec3::Z, Vec3::Z), 4.0 * FRAC_1_PI);
        assert_eq!(
            [
                value(1.0, 0.5, at(95.0), at(20.0)),
                value(1.0, 0.5, at(20.0), at(95.0))
            ],
            [0.0; 2]
        );
    }

    /// f(ωo, ωi) = f(ωi, ωo).
    #[test]
    fn lobe_is_reciprocal() {
        for roughness in [0.05, 0.2, 0.5, 1.0] {
            let lobe = Lobe::new(Vec3::new(0.04, 0.5, 1.0), roughness);
            for (a, b) in [(10.0, -20.0), (70.0, -60.0), (85.0, 30.0), (2.0, -89.0)] {
                let (wo, wi) = (at(a), Vec3::new(at(b).x * 0.8, at(b).x * 0.6, at(b).z));
                let [there, back] =
                    [(wo, wi), (wi, wo)].map(|(wo, wi)| lobe.evaluate(Vec3::Z, wo, wi).0 / wi.z);
                assert!(
                    (there / back - 1.0).abs().cmple(Vec3::splat(1e-3)).all(),
                    "roughness {roughness}, {a}° and {b}°: {there} and {back}"
                );
            }
        }
    }

    /// A white lobe reflects no more than arrives. A narrow one reflects nearly all of it. A wide
    /// one loses between its facets what single scattering loses: α = 1 and wo = n give
    /// ∫ G₂/(4π) dω with G₂ = 2c/(1 + c), which is 1 − ln 2.
    #[test]
    fn white_lobe_reflects_no_more_than_arrives() {
        let albedo = |roughness: f32, view_deg: f32| {
            let (lobe, wo, n) = (Lobe::new(Vec3::ONE, roughness), at(view_deg), 128);
            let weight = |i: u32| {
                lobe.sample(
                    Vec3::Z,
                    wo,
                    [
                        ((i % n) as f32 + 0.5) / n as f32,
                        ((i / n) as f32 + 0.5) / n as f32,
                    ],
                )
                .map_or(0.0, |s| s.weight.y)
            };
            (0..n * n).map(|i| f64::from(weight(i))).sum::<f64>() / f64::from(n * n)
        };
        for roughness in [0.05, 0.2, 0.5, 1.0] {
            for view_deg in [0.0, 45.0, 80.0] {
                let share = albedo(roughness, view_deg);
                assert!(
                    share <= 1.0 + 1e-3,
                    "roughness {roughness}, {view_deg}°: {share}"
                );
                assert!(roughness > 0.05 || share > 0.98, "{view_deg}°: {share}");
            }
        }
        assert!(
            (albedo(1.0, 0.0) - (1.0 - std::f64::consts::LN_2)).abs() < 2e-3,
            "{}",
            albedo(1.0, 0.0)
        );
    }

    #[test]
    fn ggx_samples_match_their_density() {
        for roughness in [0.3, 0.6, 1.0] {
            for view_deg in [5.0, 45.0, 80.0] {
                check(roughness, view_deg);
            }
        }
    }
}
