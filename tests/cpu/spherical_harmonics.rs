//! Spherical harmonics against their definitions: closed forms, quadrature, turned and multiplied
//! functions.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, PI, TAU};

use crate::support::Random;
use crate::support::compare::Worst;
use glam::{DMat3, DVec3};
use lumivox::gi::shared::sh::{
    Products, Quadrature, Rotation, TESTED_BANDS, bands_of, clamped_cosine, cone, evaluate, hann,
    index, inner_product, lanczos, laplacian_strength, laplacian_window, power_lobe, project,
    reconstruct, rotate_zonal, scale_bands,
};

/// Uniform in −1..1.
fn signed(random: &mut Random) -> f64 {
    2.0 * f64::from(random.unit()) - 1.0
}

/// Uniform over the sphere.
fn direction(random: &mut Random) -> DVec3 {
    let (z, azimuth) = (signed(random), PI * signed(random));
    let radius = (1.0 - z * z).sqrt();
    DVec3::new(radius * azimuth.cos(), radius * azimuth.sin(), z)
}

/// A function of so many bands.
fn function(random: &mut Random, bands: usize) -> Vec<f64> {
    (0..bands * bands).map(|_| signed(random)).collect()
}

/// Axes, diagonals, the neighbourhood of poles, and random ones.
fn directions() -> Vec<DVec3> {
    let mut found = Vec::new();
    for x in [-1.0, 0.0, 1.0] {
        for y in [-1.0, 0.0, 1.0] {
            for z in [-1.0, 0.0, 1.0] {
                found.extend(DVec3::new(x, y, z).try_normalize());
            }
        }
    }
    found.extend([1e-300, 1e-12, 1e-4].map(|x| DVec3::new(x, -x, 1.0).normalize()));
    let mut random = Random::new(1);
    found.extend((0..40).map(|_| direction(&mut random)));
    found
}

fn basis(bands: usize, direction: DVec3) -> Vec<f64> {
    let mut values = vec![f64::NAN; bands * bands];
    evaluate(bands, direction, &mut values);
    values
}

/// The largest difference of two lists of one length.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).worst()
}

/// P_l(z) by Rodrigues' sum of powers.
fn legendre(l: usize, z: f64) -> f64 {
    let binomial = |n: usize, k: usize| {
        (0..k).fold(1.0, |product, i| product * (n - i) as f64 / (i + 1) as f64)
    };
    let term = |k: usize| {
        let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        sign * binomial(l, k) * binomial(2 * l - 2 * k, l) * z.powi((l - 2 * k) as i32)
    };
    (0..=l / 2).map(term).sum::<f64>() / (l as f64).exp2()
}

/// λ_l of a lobe that is 0 outside of `from`..`to`, by Simpson's rule.
fn zonal_by_sum(bands: usize, from: f64, to: f64, lobe: impl Fn(f64) -> f64) -> Vec<f64> {
    const STEPS: usize = 4000;
    let step = (to - from) / STEPS as f64;
    let factor = |l: usize| {
        let at = |i: usize| {
            let z = from + step * i as f64;
            let weight = match i {
                0 | STEPS => 1.0,
                i if i % 2 == 1 => 4.0,
                _ => 2.0,
            };
            weight * lobe(z) * legendre(l, z)
        };
        TAU * step / 3.0 * (0..=STEPS).map(at).sum::<f64>()
    };
    (0..bands).map(factor).collect()
}

/// The convention: the table of Ramamoorthi & Hanrahan 2001, and band 3, without a sign (−1)^m.
#[test]
fn the_basis_is_the_published_one() {
    let root = |number: f64| (number / PI).sqrt();
    for d @ DVec3 { x, y, z } in directions() {
        let published = [
            0.5 * root(1.0),
            0.5 * root(3.0) * y,
            0.5 * root(3.0) * z,
            0.5 * root(3.0) * x,
            0.5 * root(15.0) * x * y,
            0.5 * root(15.0) * y * z,
            0.25 * root(5.0) * (2.0 * z * z - x * x - y * y),
            0.5 * root(15.0) * x * z,
            0.25 * root(15.0) * (x * x - y * y),
            0.25 * root(17.5) * y * (3.0 * x * x - y * y),
            0.5 * root(105.0) * x * y * z,
            0.25 * root(10.5) * y * (5.0 * z * z - 1.0),
            0.25 * root(7.0) * z * (5.0 * z * z - 3.0),
            0.25 * root(10.5) * x * (5.0 * z * z - 1.0),
            0.25 * root(105.0) * z * (x * x - y * y),
            0.25 * root(17.5) * x * (x * x - 3.0 * y * y),
        ];
        let error = difference(&basis(4, d), &published);
        assert!(error < 1e-14, "{d}: {error:e}");
        // Fewer bands are the beginning of more.
        assert_eq!(basis(8, d)[..25], basis(5, d), "{d}");
    }
    let places: Vec<usize> = (0..4)
        .flat_map(|l: isize| (-l..=l).map(move |m| index(l as usize, m)))
        .collect();
    assert!(places.into_iter().eq(0..16));
    assert_eq!(
        [0, 1, 3, 4, 63, 64].map(|n| bands_of(&vec![0.0; n])),
        [0, 1, 1, 2, 7, 8]
    );
}

#[test]
fn the_basis_is_orthonormal() {
    let quadrature = Quadrature::exact_to(2 * (TESTED_BANDS - 1));
    let count = TESTED_BANDS * TESTED_BANDS;
    let mut products = vec![0.0; count * count];
    for &(direction, weight) in &quadrature.nodes {
        let values = basis(TESTED_BANDS, direction);
        for i in 0..count {
            for j in 0..count {
                products[i * count + j] += weight * values[i] * values[j];
            }
        }
    }
    let unit: Vec<f64> = (0..count * count)
        .map(|place| {
            if place / count == place % count {
                1.0
            } else {
                0.0
            }
        })
        .collect();
    let error = difference(&products, &unit);
    assert!(error < 1e-12, "{error:e}");
}

/// Σ_m Y_lm(a) Y_lm(b) = (2l+1)/4π P_l(a·b).
#[test]
fn the_addition_theorem_holds() {
    let directions = directions();
    let mut errors = Vec::new();
    for &a in &directions {
        for &b in &directions {
            let (at_a, at_b) = (basis(TESTED_BANDS, a), basis(TESTED_BANDS, b));
            for l in 0..TESTED_BANDS {
                let band = l * l..(l + 1) * (l + 1);
                let sum = inner_product(&at_a[band.clone()], &at_b[band]);
                let scale = (2 * l + 1) as f64 / (4.0 * PI);
                errors.push((sum - scale * legendre(l, a.dot(b))).abs());
            }
        }
    }
    let error = errors.into_iter().worst();
    assert!(error < 1e-12, "{error:e}");
}

/// ∫ x^a y^b z^c dω is 0 if one of them is odd, else 4π (a−1)!! (b−1)!! (c−1)!! / (a+b+c+1)!!.
#[test]
fn quadrature_is_exact_to_its_degree() {
    let double_factorial = |n: i32| (1..=n).rev().step_by(2).map(f64::from).product::<f64>();
    let error = |quadrature: &Quadrature, powers: [i32; 3]| {
        let sum = quadrature
            .integrate(|d| d.x.powi(powers[0]) * d.y.powi(powers[1]) * d.z.powi(powers[2]));
        let exact = if powers.iter().any(|power| power % 2 == 1) {
            0.0
        } else {
            let above: f64 = powers
                .iter()
                .map(|power| double_factorial(power - 1))
                .product();
            4.0 * PI * above / double_factorial(powers.iter().sum::<i32>() + 1)
        };
        (sum - exact).abs()
    };
    let mut errors = Vec::new();
    for degree in 0..24 {
        let quadrature = Quadrature::exact_to(degree as usize);
        for x in 0..=degree {
            for y in 0..=degree - x {
                errors.extend((0..=degree - x - y).map(|z| error(&quadrature, [x, y, z])));
            }
        }
        // And no further: it is not that all is 0.
        let above = 2 * (degree / 2) + 2;
        assert!(error(&quadrature, [0, 0, above]) > 1e-9, "{degree}");
    }
    let error = errors.into_iter().worst();
    assert!(error < 1e-12, "{error:e}");
}

#[test]
fn projection_gives_back_what_was_evaluated() {
    let mut random = Random::new(2);
    let mut errors = Vec::new();
    for bands in 1..=TESTED_BANDS {
        let quadrature = Quadrature::exact_to(2 * (bands - 1));
        let given = function(&mut random, bands);
        let of_given = |d| reconstruct(&given, d);
        errors.push(difference(&project(bands, &quadrature, of_given), &given));
        // Fewer bands are the beginning of more.
        let fewer = project(bands - 1, &quadrature, of_given);
        errors.push(difference(&fewer, &given[..fewer.len()]));
        // ∫ f² dω.
        let square = quadrature.integrate(|d| of_given(d).powi(2));
        errors.push((square / inner_product(&given, &given) - 1.0).abs());
    }
    let error = errors.into_iter().worst();
    assert!(error < 1e-12, "{error:e}");
}

#[test]
fn lobes_are_their_integrals() {
    let bands = TESTED_BANDS;
    let published = [1.0, 2.0 / 3.0, 0.25, 0.0, -1.0 / 24.0, 0.0, 1.0 / 64.0, 0.0].map(|a| PI * a);
    let mut errors = vec![difference(&clamped_cosine(bands), &published)];
    let mut compare = |lobe: Vec<f64>, sum: Vec<f64>| errors.push(difference(&lobe, &sum));
    compare(clamped_cosine(bands), zonal_by_sum(bands, 0.0, 1.0, |z| z));
    for exponent in [0.0, 1.0, 2.0, 7.5, 30.0] {
        let lobe = |z: f64| (exponent + 1.0) / TAU * z.powf(exponent);
        compare(
            power_lobe(bands, exponent),
            zonal_by_sum(bands, 0.0, 1.0, lobe),
        );
    }
    for half_angle in [0.0, 1e-6, 0.1, FRAC_PI_3, FRAC_PI_2, 2.0, PI] {
        compare(
            cone(bands, half_angle),
            zonal_by_sum(bands, half_angle.cos(), 1.0, |_| 1.0),
        );
    }
    let error = errors.into_iter().worst();
    assert!(error < 1e-9, "{error:e}");
    // A small disc is a point of light, to all digits.
    let small = cone(bands, 1e-6);
    let errors = small
        .iter()
        .map(|factor| (factor / (PI * 1e-12) - 1.0).abs());
    let error = errors.worst();
    assert!(error < 1e-10, "{error:e}");
    let sphere = [4.0 * PI, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert!(difference(&cone(bands, PI), &sphere) < 1e-12);
}

/// (√π/2, √(π/3) d) in this convention, and no axis is mirrored.
#[test]
fn lobes_point_where_they_are_turned() {
    for d in directions() {
        let lobe = rotate_zonal(&clamped_cosine(2), d);
        let side = (PI / 3.0).sqrt();
        let published = [0.5 * PI.sqrt(), side * d.y, side * d.z, side * d.x];
        assert!(difference(&lobe, &published) < 1e-14, "{d}");
        for bands in 2..=TESTED_BANDS {
            for factors in [
                clamped_cosine(bands),
                cone(bands, FRAC_PI_3),
                power_lobe(bands, 8.0),
            ] {
                let lobe = rotate_zonal(&factors, d);
                let peak = reconstruct(&lobe, d);
                for other in directions().into_iter().filter(|other| other.dot(d) < 0.5) {
                    assert!(
                        reconstruct(&lobe, other) < peak,
                        "{bands} bands, {d}, {other}"
                    );
                }
            }
        }
    }
    // The lobe itself, not only its peak.
    let quadrature = Quadrature::exact_to(200);
    let d = DVec3::new(0.48, -0.6, 0.64);
    let projected = project(TESTED_BANDS, &quadrature, |ω| ω.dot(d).max(0.0));
    let error = difference(&rotate_zonal(&clamped_cosine(TESTED_BANDS), d), &projected);
    assert!(error < 1e-5, "{error:e}");
}

#[test]
fn irradiance_of_skies_is_known() {
    let quadrature = Quadrature::exact_to(6);
    let irradiance = |sky: &dyn Fn(DVec3) -> f64, normal: DVec3| {
        let mut coefficients = project(3, &quadrature, sky);
        scale_bands(&clamped_cosine(3), &mut coefficients);
        reconstruct(&coefficients, normal)
    };
    let mut errors = Vec::new();
    for n in directions() {
        errors.push((irradiance(&|_| 1.0, n) - PI).abs());
        // L = a·ω: E = 2π/3 a·n. L = (a·ω)²: E = π/4 (1 + (a·n)²).
        for a in [DVec3::X, DVec3::Y, DVec3::Z] {
            let cosine = a.dot(n);
            errors.push((irradiance(&|ω| a.dot(ω), n) - TAU / 3.0 * cosine).abs());
            let square = 0.25 * PI * (1.0 + cosine * cosine);
            errors.push((irradiance(&|ω| a.dot(ω).powi(2), n) - square).abs());
        }
    }
    let error = errors.into_iter().worst();
    assert!(error < 1e-13, "{error:e}");
}

/// None, quarter and half turns, turns close to none and to half ones, ZYZ angles at and beside
/// their lock, and random ones.
fn rotations() -> Vec<DMat3> {
    let mut found = vec![DMat3::IDENTITY];
    for axis in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE.normalize()] {
        for angle in [FRAC_PI_2, PI, 3.0 * FRAC_PI_2, 1e-9, PI - 1e-9, 0.3] {
            found.push(DMat3::from_axis_angle(axis, angle));
        }
    }
    for beta in [0.0, 1e-12, 1e-7, PI - 1e-7, PI] {
        let (first, last) = (DMat3::from_rotation_z(0.7), DMat3::from_rotation_z(-2.1));
        found.push(first * DMat3::from_rotation_y(beta) * last);
    }
    let mut random = Random::new(3);
    found.extend(
        (0..12).map(|_| DMat3::from_axis_angle(direction(&mut random), PI * signed(&mut random))),
    );
    found
}

/// Against the projection of f(R⁻¹ d), which knows nothing of matrices by band.
#[test]
fn rotation_is_that_of_the_function() {
    let mut random = Random::new(4);
    let quadrature = Quadrature::exact_to(2 * (TESTED_BANDS - 1));
    let mut errors = Vec::new();
    for turn in rotations() {
        let rotation = Rotation::new(TESTED_BANDS, turn);
        let given = function(&mut random, TESTED_BANDS);
        let turned = rotation.apply(&given);
        let back = turn.transpose();
        let projected = project(TESTED_BANDS, &quadrature, |d| reconstruct(&given, back * d));
        errors.push(difference(&turned, &projected));
        errors.push(difference(
            &Rotation::new(TESTED_BANDS, back).apply(&turned),
            &given,
        ));
        // Fewer bands, and more than there are.
        assert_eq!(rotation.apply(&given[..9]), turned[..9]);
        assert_eq!(Rotation::new(5, turn).apply(&given), turned[..25]);
        // A lobe.
        let (lobe, d) = (power_lobe(TESTED_BANDS, 4.0), direction(&mut random));
        let turned = rotation.apply(&rotate_zonal(&lobe, d));
        errors.push(difference(&turned, &rotate_zonal(&lobe, turn * d)));
    }
    let error = errors.into_iter().worst();
    assert!(error < 1e-12, "{error:e}");
    let given = function(&mut random, TESTED_BANDS);
    assert_eq!(
        Rotation::new(TESTED_BANDS, DMat3::IDENTITY).apply(&given),
        given
    );
}

#[test]
fn a_turn_after_a_turn_is_one_turn() {
    let mut random = Random::new(5);
    let rotations = rotations();
    let mut errors = Vec::new();
    for (first, then) in rotations.iter().zip(rotations.iter().rev()) {
        let given = function(&mut random, TESTED_BANDS);
        let of = |turn: DMat3| Rotation::new(TESTED_BANDS, turn);
        let one = of(*then * *first).apply(&given);
        errors.push(difference(
            &of(*then).apply(&of(*first).apply(&given)),
            &one,
        ));
    }
    let error = errors.into_iter().worst();
    assert!(error < 1e-12, "{error:e}");
}

#[test]
fn products_are_pointwise() {
    let mut random = Random::new(6);
    // All bands of a product: 4 + 5 bands have 8.
    let products = Products::new(TESTED_BANDS);
    let (a, b) = (function(&mut random, 4), function(&mut random, 5));
    let product = products.multiply(&a, &b);
    let errors = directions()
        .into_iter()
        .map(|d| (reconstruct(&product, d) - reconstruct(&a, d) * reconstruct(&b, d)).abs());
    let error = errors.worst();
    assert!(error < 1e-12, "{error:e}");
    assert!(difference(&products.multiply(&b, &a), &product) < 1e-13);
    // Cut off: the product's projection.
    for bands in 1..=TESTED_BANDS {
        let products = Products::new(bands);
        let (a, b) = (function(&mut random, bands), function(&mut random, bands));
        let quadrature = Quadrature::exact_to(3 * (bands - 1));
        let pointwise = |d| reconstruct(&a, d) * reconstruct(&b, d);
        let projected = project(bands, &quadrature, pointwise);
        let error = difference(&products.multiply(&a, &b), &projected);
        assert!(error < 1e-12, "{bands} bands: {error:e}");
        let one = [(4.0 * PI).sqrt()];
        assert!(difference(&products.multiply(&a, &one), &a) < 1e-13);
        assert!(products.multiply(&a, &[]).iter().all(|c| *c == 0.0));
    }
}

/// The lowest value of a lobe, or 0.
fn lowest(lobe: &[f64]) -> f64 {
    let coefficients = rotate_zonal(lobe, DVec3::Z);
    let below = |step: i32| {
        let (sine, cosine) = (PI * f64::from(step) / 360.0).sin_cos();
        -reconstruct(&coefficients, DVec3::new(sine, 0.0, cosine))
    };
    -(0..=360).map(below).worst()
}

#[test]
fn windows_calm_the_ringing_of_a_disc() {
    let disc = cone(TESTED_BANDS, 20f64.to_radians());
    let ringing = lowest(&disc);
    assert!((ringing + 0.081).abs() < 1e-3, "{ringing}");
    let width = TESTED_BANDS as f64;
    let coefficients = rotate_zonal(&disc, DVec3::Z);
    let windows = [
        ("hann", hann(TESTED_BANDS, width), 0.1),
        (
            "hann, twice the width",
            hann(TESTED_BANDS, 2.0 * width),
            0.5,
        ),
        ("lanczos", lanczos(TESTED_BANDS, width), 0.15),
        (
            "laplacian",
            laplacian_window(TESTED_BANDS, laplacian_strength(&coefficients, 0.1)),
            0.13,
        ),
    ];
    for (name, window, part) in windows {
        let windowed: Vec<f64> = disc.iter().zip(&window).map(|(a, b)| a * b).collect();
        let left = lowest(&windowed);
        assert!(left > part * ringing, "{name}: {left} of {ringing}");
        // The mean stays; and windows fall with the band.
        assert_eq!(windowed[0], disc[0], "{name}");
        assert!(window.is_sorted_by(|a, b| a > b), "{name}: {window:?}");
        // The same by way of coefficients.
        let mut scaled = coefficients.clone();
        scale_bands(&window, &mut scaled);
        assert!(difference(&scaled, &rotate_zonal(&windowed, DVec3::Z)) < 1e-15);
    }
}

#[test]
fn windows_are_their_formulas() {
    let wide = [
        1.0,
        0.5 + 0.25 * 2f64.sqrt(),
        0.5,
        0.5 - 0.25 * 2f64.sqrt(),
        0.0,
        0.0,
    ];
    assert!(difference(&hann(6, 4.0), &wide) < 1e-15);
    let wide = [
        1.0,
        8f64.sqrt() / PI,
        2.0 / PI,
        8f64.sqrt() / (3.0 * PI),
        0.0,
        0.0,
    ];
    assert!(difference(&lanczos(6, 4.0), &wide) < 1e-15);
    assert!(difference(&laplacian_window(3, 0.25), &[1.0, 0.5, 0.1]) < 1e-15);
    assert_eq!(laplacian_window(8, 0.0), [1.0; 8]);
    // Bands without a factor are left out.
    let mut cut = vec![1.0; 9];
    scale_bands(&[2.0, 3.0], &mut cut);
    assert_eq!(cut, [2.0, 3.0, 3.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
}

/// ∫ (Δf)² dω, the Laplacian by differences of the function itself.
fn squared_laplacian(coefficients: &[f64]) -> f64 {
    const STEP: f64 = 1e-3;
    let laplacian = |d: DVec3| {
        let (side, other) = d.any_orthonormal_pair();
        let at = |offset: DVec3| reconstruct(coefficients, offset);
        let around: f64 = [side, -side, other, -other]
            .map(|axis| at(d * STEP.cos() + axis * STEP.sin()))
            .iter()
            .sum();
        (around - 4.0 * at(d)) / (STEP * STEP)
    };
    Quadrature::exact_to(2 * bands_of(coefficients)).integrate(|d| laplacian(d).powi(2))
}

#[test]
fn the_laplacian_window_leaves_the_fraction_asked_for() {
    let mut random = Random::new(7);
    for fraction in [1.0, 0.9, 0.5, 0.1, 1e-3, 1e-6] {
        let given = function(&mut random, TESTED_BANDS);
        let strength = laplacian_strength(&given, fraction);
        let mut windowed = given.clone();
        scale_bands(&laplacian_window(TESTED_BANDS, strength), &mut windowed);
        let left = squared_laplacian(&windowed) / squared_laplacian(&given);
        assert!((left / fraction - 1.0).abs() < 1e-4, "{left} of {fraction}");
        // The least of the sum that it is the least of.
        let cost = |of: &[f64]| {
            let change: Vec<f64> = of.iter().zip(&given).map(|(a, b)| a - b).collect();
            let bend: Vec<f64> = (0..of.len())
                .map(|place| {
                    let l = place.isqrt() as f64;
                    l * (l + 1.0) * of[place]
                })
                .collect();
            inner_product(&change, &change) + strength * inner_product(&bend, &bend)
        };
        for _ in 0..20 {
            let other: Vec<f64> = windowed
                .iter()
                .map(|c| c + 1e-3 * signed(&mut random))
                .collect();
            assert!(cost(&other) > cost(&windowed), "{fraction}");
        }
    }
    assert_eq!(laplacian_strength(&[2.0, 0.0, 0.0, 0.0], 0.5), 0.0);
    assert_eq!(laplacian_strength(&[], 0.5), 0.0);
}
