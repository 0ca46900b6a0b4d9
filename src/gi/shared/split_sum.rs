//! What a glossy lobe reflects of light that is the same from all sides, the second factor of the
//! split sum (B. Karis, *Real Shading in Unreal Engine 4*, 2013), of the BRDF that the reference
//! has: GGX with α = r², height-correlated masking, Schlick's Fresnel term.

use std::f64::consts::TAU;
use std::sync::{Arc, LazyLock};

use glam::DVec3;

use crate::graph::{Error, Gpu, Image, ImageDesc, ImageKind, ImageUsage, Owner, vk};

/// Cosines, and roughnesses, of the table: those in the middles of so many equal parts of 0 to 1.
const EDGE: u32 = 32;

/// Directions that an entry is summed over.
const SAMPLES: u32 = 1024;

/// The smallest α that lobes have (`shared/ggx.glsl`).
const SMALLEST_ALPHA: f64 = 1e-3;

/// The table on the device: an RG32F image, cosines along x, roughnesses along y
/// (`gi/shared/split_sum.glsl`).
pub fn table(gpu: &Gpu) -> Result<Arc<Image>, Error> {
    static ROWS: LazyLock<Vec<[f32; 2]>> = LazyLock::new(|| {
        let middle = |index: u32| (f64::from(index) + 0.5) / f64::from(EDGE);
        (0..EDGE * EDGE)
            .map(|index| reflected_by_lobe(middle(index % EDGE), middle(index / EDGE)))
            .map(|factors| factors.map(|factor| factor as f32))
            .collect()
    });
    let image = gpu.create_image(&ImageDesc {
        name: "split_sum".into(),
        extent: [EDGE, EDGE, 1],
        kind: ImageKind::D2,
        format: vk::Format::R32G32_SFLOAT,
        mips: 1,
        layers: 1,
        usage: ImageUsage::SAMPLED,
        owner: Owner::Store,
    })?;
    gpu.upload_image(&image, 0, 0, bytemuck::cast_slice(&ROWS))?;
    Ok(image)
}

/// The factor of F₀, and what is reflected besides, of a lobe that is seen at an angle with this
/// cosine.
pub fn reflected_by_lobe(cosine: f64, roughness: f64) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for (_, shares) in lobe_directions(cosine, roughness) {
        sums[0] += shares[0];
        sums[1] += shares[1];
    }
    sums
}

/// Directions that a lobe around +z reflects to an eye above the x axis, at an angle with this
/// cosine; with each, which part of the radiance there is reflected: a factor of F₀, and besides.
/// They are those of visible normals (Heitz 2018), whose density leaves F G₂ / G₁.
pub fn lobe_directions(cosine: f64, roughness: f64) -> impl Iterator<Item = (DVec3, [f64; 2])> {
    let alpha = (roughness * roughness).max(SMALLEST_ALPHA);
    let to_eye = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let stretched = DVec3::new(alpha * to_eye.x, 0.0, to_eye.z).normalize();
    let lambda = move |cosine: f64| {
        let tangent_2 = (1.0 / (cosine * cosine) - 1.0).max(0.0);
        0.5 * ((1.0 + alpha * alpha * tangent_2).sqrt() - 1.0)
    };
    (0..SAMPLES).filter_map(move |index| {
        let u = (f64::from(index) + 0.5) / f64::from(SAMPLES);
        let phi = TAU * f64::from(index.reverse_bits()) / 2f64.powi(32);
        // A cap of the sphere (Dupuy & Benyoub 2023).
        let z = (1.0 - u) * (1.0 + stretched.z) - stretched.z;
        let across = (1.0 - z * z).max(0.0).sqrt();
        let cap = DVec3::new(across * phi.cos(), across * phi.sin(), z) + stretched;
        let half = DVec3::new(alpha * cap.x, alpha * cap.y, cap.z.max(1e-9)).normalize();
        let to_light = 2.0 * half.dot(to_eye) * half - to_eye;
        let from = lambda(cosine);
        let unmasked = (1.0 + from) / (1.0 + from + lambda(to_light.z)) / f64::from(SAMPLES);
        let grazing = (1.0 - to_light.dot(half)).max(0.0).powi(5);
        let shares = [unmasked * (1.0 - grazing), unmasked * grazing];
        (to_light.z > 0.0).then_some((to_light, shares))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::oracle::light::lobe;

    /// The integral of the lobe itself over the hemisphere, by small steps.
    fn integral(cosine: f64, roughness: f64, f0: f64) -> f64 {
        let to_eye = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
        let (rows, columns) = (1500, 1500);
        let mut sum = 0.0;
        for index in 0..rows * columns {
            // Equal steps of the angle, more of them than the peak of the lobe has width.
            let theta = TAU / 4.0 * (f64::from(index / columns) + 0.5) / f64::from(rows);
            let phi = TAU * (f64::from(index % columns) + 0.5) / f64::from(columns);
            let across = theta.sin();
            let way = DVec3::new(across * phi.cos(), across * phi.sin(), theta.cos());
            sum += across * way.z * lobe(DVec3::Z, to_eye, way, DVec3::splat(f0), roughness).x;
        }
        sum * (TAU / 4.0 / f64::from(rows)) * (TAU / f64::from(columns))
    }

    #[test]
    fn factors_are_the_integral_of_the_lobe() {
        for roughness in [0.3, 0.5, 0.8, 1.0] {
            for cosine in [0.15, 0.5, 0.95] {
                let [factor, besides] = reflected_by_lobe(cosine, roughness);
                let (none, all) = (
                    integral(cosine, roughness, 0.0),
                    integral(cosine, roughness, 1.0),
                );
                assert!(
                    (besides - none).abs() < 1e-3 && (factor + besides - all).abs() < 1e-3,
                    "{cosine} {roughness}: {factor} {besides}, not {} {none}",
                    all - none
                );
            }
        }
    }

    /// A lobe whose facets reflect all loses what other facets stop, and makes nothing.
    #[test]
    fn no_more_is_reflected_than_comes() {
        for index in 0..EDGE * EDGE {
            let middle = |index: u32| (f64::from(index) + 0.5) / f64::from(EDGE);
            let [factor, besides] = reflected_by_lobe(middle(index % EDGE), middle(index / EDGE));
            let all = factor + besides;
            assert!(
                factor >= 0.0 && besides >= 0.0 && all <= 1.0 + 1e-9,
                "{index}: {all}"
            );
        }
    }

    /// A mirror reflects all that comes: Schlick's term and what it leaves.
    #[test]
    fn a_mirror_has_the_fresnel_term_alone() {
        for cosine in [0.1, 0.4, 0.9] {
            let [factor, besides] = reflected_by_lobe(cosine, 0.0);
            let grazing = (1.0 - cosine).powi(5);
            assert!(
                (factor - (1.0 - grazing)).abs() < 2e-3,
                "{cosine}: {factor}"
            );
            assert!((besides - grazing).abs() < 2e-3, "{cosine}: {besides}");
        }
    }
}
