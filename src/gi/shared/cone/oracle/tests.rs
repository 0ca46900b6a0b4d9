//! The oracle on cases computed by hand.

use super::*;

const ENVIRONMENT: DVec3 = DVec3::new(1.0, 2.0, 3.0);
const TEXTBOOK: MarchSettings = MarchSettings {
    step_factor: 1.0,
    max_distance: 1e9,
    environment: ENVIRONMENT,
    ..MarchSettings::TEXTBOOK
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
    let facing = |m: DVec3, direction: DVec3| facing_share(m, 0.0, direction);
    assert!(facing(DVec3::Z, -DVec3::Z) > 1.0 - 1e-9 && facing(DVec3::Z, DVec3::Z) < 1e-9);
    assert!((facing(DVec3::ZERO, DVec3::X) - 0.5).abs() < 1e-12);
    // |m| = ½ has σ = 1; 0.8413 is the normal distribution function at 1.
    assert!((facing(0.5 * DVec3::Z, -DVec3::Z) - 0.8413).abs() < 0.0095);
    // With σ_v = √3 it is 2; 0.6915 is the function at ½.
    assert!((facing_share(0.5 * DVec3::Z, 3.0, -DVec3::Z) - 0.6915).abs() < 0.0095);
    // Two bands of a step are ½ + ¾ cos.
    for (m, share) in [(1.0, 1.25), (0.0, 0.5), (-0.5, 0.125), (-1.0, 0.0)] {
        assert_eq!(harmonic_share(m * DVec3::Z, -DVec3::Z), share);
    }
    for m in [0.1, 0.4, 0.9] {
        let shares = [0.9, 0.5, 0.0, -0.5, -0.9].map(|cosine: f64| {
            facing(
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
