//! `gi/shared/sh.glsl` on the device against its twin on the host.

use std::f32::consts::PI;

use crate::support::compare::{Worst, exceeds};
use crate::support::passes::HARMONICS;
use crate::support::{Random, gpu, read_words, words};
use glam::{DMat3, Mat3, Vec3};
use lumivox::gi::shared::sh::{
    Products, Rotation, TESTED_BANDS, clamped_cosine, evaluate, reconstruct, rotate_zonal,
    scale_bands,
};
use lumivox::graph::Frame;

/// What a thread is given.
struct Case {
    direction: Vec3,
    a: [f32; 9],
    b: [f32; 9],
    rotation: Mat3,
}

/// Axes, diagonals and random directions; no turn, half turns and random ones.
fn cases() -> Vec<Case> {
    let mut random = Random::new(11);
    let mut signed = || 2.0 * random.unit() - 1.0;
    let mut directions = Vec::new();
    for code in 0..27 {
        let part = |divisor: i32| (code / divisor % 3 - 1) as f32;
        directions.extend(Vec3::new(part(1), part(3), part(9)).try_normalize());
    }
    directions.push(Vec3::new(1e-20, -1e-20, 1.0));
    while directions.len() < 2000 {
        let (z, azimuth) = (signed(), PI * signed());
        let (sine, cosine) = azimuth.sin_cos();
        let radius = (1.0 - z * z).sqrt();
        directions.push(Vec3::new(radius * cosine, radius * sine, z));
    }
    let case = |(index, direction)| Case {
        direction,
        a: [0; 9].map(|_| signed()),
        b: [0; 9].map(|_| signed()),
        rotation: match index % 5 {
            0 => Mat3::IDENTITY,
            1 => Mat3::from_axis_angle(direction, PI),
            _ => Mat3::from_axis_angle(direction, PI * signed()),
        },
    };
    directions.into_iter().enumerate().map(case).collect()
}

/// What the device has to write, part by part.
fn by_host(case: &Case, products: &[Products; 2]) -> Vec<(&'static str, Vec<f64>)> {
    let direction = case.direction.as_dvec3();
    let [a, b] = [case.a, case.b].map(|f| f.map(f64::from));
    let basis = |bands: usize| {
        let mut values = vec![0.0; bands * bands];
        evaluate(bands, direction, &mut values);
        values
    };
    let with_room = |bands| {
        let mut values = basis(bands);
        values.resize(TESTED_BANDS * TESTED_BANDS, 0.0);
        values
    };
    let difference: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    let irradiance = [&a[..], &b, &difference].map(|radiance| {
        let mut coefficients = radiance.to_vec();
        scale_bands(&clamped_cosine(3), &mut coefficients);
        reconstruct(&coefficients, direction)
    });
    let rotation: DMat3 = case.rotation.as_dmat3();
    vec![
        ("2 bands", basis(2)),
        ("3 bands", basis(3)),
        ("4 bands", basis(4)),
        ("5 bands", basis(5)),
        ("any bands: 8", with_room(TESTED_BANDS)),
        ("any bands: 3", with_room(3)),
        (
            "clamped cosine",
            rotate_zonal(&clamped_cosine(2), direction),
        ),
        ("lobe", rotate_zonal(&b[..3], direction)),
        ("irradiance", irradiance.to_vec()),
        ("product of 2 bands", products[0].multiply(&a[..4], &b[..4])),
        ("product of 3 bands", products[1].multiply(&a, &b)),
        ("rotation", Rotation::new(3, rotation).apply(&a)),
    ]
}

#[test]
fn the_shader_has_the_hosts_harmonics() {
    let gpu = gpu();
    let cases = cases();
    let products = [Products::new(2), Products::new(3)];
    let expected: Vec<_> = cases.iter().map(|case| by_host(case, &products)).collect();
    let made = expected[0]
        .iter()
        .map(|(_, part)| part.len())
        .sum::<usize>();

    let mut given = Vec::new();
    for case in &cases {
        given.extend(case.direction.to_array());
        given.extend(case.a.iter().chain(&case.b));
        given.extend(case.rotation.to_cols_array());
    }
    let given: Vec<u32> = given.iter().map(|number| number.to_bits()).collect();
    let given = words(&gpu, "cases", &given);
    let results = words(
        &gpu,
        "results",
        &vec![f32::NAN.to_bits(); cases.len() * made],
    );
    let count = cases.len() as u32;
    let mut frame = Frame::new();
    frame
        .pass(&HARMONICS)
        .bind("cases", &given)
        .bind("results", &results)
        .push(&count)
        .dispatch([count.div_ceil(32), 1, 1]);
    gpu.submit(frame).unwrap();

    let results = read_words(&gpu, &results);
    for (part, (name, _)) in expected[0].iter().enumerate() {
        let errors = results
            .chunks_exact(made)
            .zip(&expected)
            .map(|(result, parts)| {
                let before = parts[..part]
                    .iter()
                    .map(|(_, part)| part.len())
                    .sum::<usize>();
                let errors = result[before..].iter().zip(&parts[part].1);
                errors
                    .map(|(word, exact)| (f64::from(f32::from_bits(*word)) - exact).abs())
                    .worst()
            });
        let error = errors.worst();
        // 1e-6 measured, with 8 bands.
        assert!(!exceeds(error, 1e-5), "{name}: {error:e}");
    }
}
