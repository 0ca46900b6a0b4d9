//! Skies: small lights in them, and lights that turn away; openings that shrink, and what thin and
//! sunk things hide.

use std::f32::consts::{PI, TAU};

use glam::{Quat, Vec3};

use super::motion::{FIGURES, block_in_room, figures};
use super::scenes::{ROOM_M, add_floor, camera};
use super::{Change, OWN, StressCase, StressError, Trial};
use crate::frame::Renderer;
use crate::image::{Aov, Image};
use crate::measure::draw::Ticks;
use crate::metrics::Channel;
use crate::scene::bundled::mesh::Mesh;
use crate::scene::{Camera, Environment, Material, Scene, SceneError, Sky, Specular};

/// Bands that a sky may be kept in.
const ORDER: Change = Change {
    name: "order",
    values: &["4", "6", "8", "10"],
    needs: None,
};

pub(super) static SUN_WIDTH: StressCase = StressCase {
    name: "sky_sun_width",
    help: "a disc in the sky shrinks and keeps its power; it shines into an open room",
    source: "Sloan et al. 2002: bands hold light of low frequency alone",
    severity: "width of the disc [degrees]",
    severities: &[40.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.5],
    quick: &[40.0, 0.5],
    changes: &[ORDER],
    measure: |trial, width| {
        error(
            trial,
            &open_room(1.0, sky(Some((width as f32, TO_SUN_DEG)))?),
        )
    },
    ..OWN
};

pub(super) static TURN: StressCase = StressCase {
    name: "sky_turn",
    help: "a sky with a disc of 30° turns over an open room, 60 frames; at 5.625° it is round in \
           64",
    source: "Sloan et al. 2002: dynamic lighting is a rotation of harmonics",
    severity: "turn in a frame [degrees]",
    severities: &[0.703_125, 1.406_25, 2.8125, 5.625],
    quick: &[5.625],
    figures: FIGURES,
    measure: |trial, degrees| {
        let sky = sky(Some((30.0, TO_SUN_DEG)))?;
        let room = open_room(1.0, sky.clone());
        figures(trial, |frame| {
            let mut turned = room.clone();
            let turn_deg = (frame as f64 * degrees) as f32;
            turned.set_environment(sky.with(1.0, turn_deg).into());
            turned
        })
    },
    ..OWN
};

pub(super) static HIDDEN: StressCase = StressCase {
    name: "sky_hidden",
    help: "a window of light in a black sky, 40° wide, turns out of sight of an open room; what \
           rings lights what is dark",
    source: "Sloan 2008: ringing of bands that end",
    severity: "turned from the opening [degrees]",
    ticks: Ticks::Linear,
    severities: &[0.0, 30.0, 60.0, 80.0],
    quick: &[0.0, 80.0],
    changes: &[
        ORDER,
        Change {
            name: "window",
            values: &["hann", "lanczos"],
            needs: None,
        },
    ],
    measure: |trial, turn| error(trial, &open_room(1.0, soft_box(turn as f32)?)),
    ..OWN
};

pub(super) static OPENING: StressCase = StressCase {
    name: "sky_opening",
    help: "the opening of a room under a sky shrinks",
    source: "Hong 2015, section 2.5.1: points at corners of a room see outside",
    severity: "part of the wall that is open",
    severities: &[1.0, 0.25, 0.0625, 0.01],
    quick: &[1.0, 0.0625],
    changes: &[
        Change {
            name: "cells",
            values: &["4", "8", "16", "32"],
            needs: None,
        },
        Change {
            name: "inset",
            values: &["0", "0.1"],
            needs: None,
        },
    ],
    measure: |trial, part| error(trial, &open_room(part as f32, sky(None)?)),
    ..OWN
};

pub(super) static SHEET: StressCase = StressCase {
    name: "sky_sheet",
    help: "a thin sheet under a sky comes down on a floor: both of its sides and the floor below \
           have light of their own",
    source: "Hong 2015, section 2.5.1: a vertex has one side",
    severity: "height over the floor [cells]",
    severities: &[8.0, 4.0, 2.0, 1.0, 0.5],
    quick: &[8.0, 1.0],
    measure: |trial, cells| error(trial, &sheet(cells as f32 * trial.cell_m())?),
    ..OWN
};

pub(super) static SUNK_BOX: StressCase = StressCase {
    name: "sky_sunk_box",
    help: "a box sinks into a floor under a sky: what is sampled inside of it is dark",
    source: "Majercik et al. 2019: samples inside of bodies",
    severity: "part of the box that is sunk",
    ticks: Ticks::Linear,
    severities: &[0.0, 0.25, 0.5, 0.9],
    quick: &[0.5],
    changes: &[Change {
        name: "invalid_share",
        values: &["0.25", "1"],
        needs: None,
    }],
    measure: |trial, part| error(trial, &sunk_box(part as f32)?),
    ..OWN
};

pub(super) static ROUGHNESS: StressCase = StressCase {
    name: "sky_roughness",
    help: "a metal block under a sky with a disc of 30° becomes smoother: what it mirrors has \
           sharper edges",
    source: "Sloan et al. 2002: glossy transfer holds lobes of low frequency",
    severity: "roughness",
    severities: &[1.0, 0.7, 0.5, 0.35, 0.2, 0.1],
    quick: &[1.0, 0.35],
    measure: |trial, roughness| error(trial, &metal_block(roughness as f32)?),
    ..OWN
};

pub(super) static MOVED: StressCase = StressCase {
    name: "moved_block",
    help: "a block in a room is elsewhere than where light was worked out; what is frozen stays \
           as it was",
    source: "Sloan et al. 2002: transfer is of scenes that stand still",
    severity: "way of the block [m]",
    severities: &[0.0625, 0.25, 1.0],
    quick: &[0.25],
    measure: |trial, way_m| {
        let mut scene = block_in_room();
        let settings = trial.settings_with(&["dynamic=freeze"])?;
        let (mut renderer, _) =
            Renderer::new(trial.gpu, &scene, trial.entry, &settings, trial.frame)?;
        renderer.render(&scene.camera)?;
        // It is 1 m further at 1 s.
        scene.set_time(way_m as f32);
        renderer.set_pose(&scene)?;
        let frames = 0..trial.frames_to_settle();
        frames
            .into_iter()
            .try_for_each(|_| renderer.render(&scene.camera).map(drop))?;
        let picture = renderer.aov(Aov::Indirect)?;
        let errors = trial.errors_of(&picture, &scene, Channel::Luminance, 1)?;
        Ok(vec![errors.rel_rmse])
    },
    ..OWN
};

fn error(trial: &Trial<'_>, scene: &Scene) -> Result<Vec<f64>, StressError> {
    Ok(vec![trial.errors(scene, Channel::Luminance, 1)?.rel_rmse])
}

/// Height of a disc over the horizon (°); it is at +z.
const TO_SUN_DEG: f32 = 25.0;
/// What a disc brings to a surface that faces it (W/m²).
const SUN: f32 = 2.0;

/// A sky of .15 below and .5 to 1 above, and in it a disc so wide, so high over the horizon (°).
fn sky(disc: Option<(f32, f32)>) -> Result<Sky, StressError> {
    let to_sun = |height_deg: f32| {
        let (sin, cos) = height_deg.to_radians().sin_cos();
        Vec3::new(0.0, sin, cos)
    };
    let disc = disc.map(|(width_deg, height_deg)| {
        let (sin, cos) = (0.5 * width_deg).to_radians().sin_cos();
        (to_sun(height_deg), cos, SUN / (PI * sin * sin))
    });
    let edge_deg = 10.0;
    let narrow = disc.is_some_and(|(_, cos, _)| cos > 0.999);
    map(if narrow { 2048 } else { 256 }, move |direction| {
        let height_deg = direction.y.clamp(-1.0, 1.0).asin().to_degrees();
        let above = (0.5 + 0.5 * height_deg / edge_deg).clamp(0.0, 1.0);
        let radiance = 0.15 + above * (0.35 + 0.5 * direction.y.max(0.0));
        let sun = disc
            .filter(|(to_sun, cos, _)| direction.dot(*to_sun) > *cos)
            .map_or(0.0, |(_, _, radiance)| radiance);
        radiance + sun
    })
}

/// A window of light 40° wide and high in a black sky, turned from +z about +y (°).
fn soft_box(turn_deg: f32) -> Result<Sky, StressError> {
    let half = 20f32.to_radians();
    let back = Quat::from_rotation_y(-turn_deg.to_radians());
    map(512, move |direction| {
        let local = back * direction;
        let (across, up) = (local.x.atan2(local.z).abs(), local.y.asin() - 0.35);
        if across < half && up.abs() < half {
            5.0
        } else {
            0.0
        }
    })
}

/// A grey map: the mean of 16 places in each texel.
fn map(width: u32, radiance: impl Fn(Vec3) -> f32) -> Result<Sky, StressError> {
    let height = width / 2;
    let place = |x: f32, y: f32| {
        let (flat, up) = (PI * y / height as f32).sin_cos();
        let (sin, cos) = (TAU * x / width as f32).sin_cos();
        radiance(Vec3::new(flat * sin, up, -flat * cos))
    };
    let image = Image::from_fn(width, height, |index| {
        let (x, y) = (index as u32 % width, index as u32 / width);
        let parts = (0..16).map(|part| {
            let inside = |part: u32| (part as f32 + 0.5) / 4.0;
            place(x as f32 + inside(part % 4), y as f32 + inside(part / 4))
        });
        Vec3::splat(parts.sum::<f32>() / 16.0)
    });
    // The map is finite, and of a size that maps may have.
    Sky::new(image, 0.0).map_err(|problem| {
        let hint = "this is a defect of the suite";
        SceneError::file(std::path::Path::new("sky"), problem, hint).into()
    })
}

/// A room with a block, whose wall at +z has an opening of such a part of it.
fn open_room(part: f32, sky: Sky) -> Scene {
    let half = 0.5 * ROOM_M;
    let high = 3.0;
    let mut mesh = Mesh::default();
    let white = mesh.matte("room", [0.7, 0.7, 0.7]);
    let red = mesh.matte("left", [0.7, 0.25, 0.2]);
    add_floor(&mut mesh, white);
    let mut wall = |material, corners: [[f32; 3]; 4]| mesh.quad(material, corners.map(Vec3::from));
    let (l, r, f, b) = (-half, half, half, -half);
    wall(
        white,
        [[l, high, b], [r, high, b], [r, high, f], [l, high, f]],
    );
    wall(
        white,
        [[l, 0.0, b], [r, 0.0, b], [r, high, b], [l, high, b]],
    );
    wall(red, [[l, 0.0, f], [l, 0.0, b], [l, high, b], [l, high, f]]);
    wall(
        white,
        [[r, 0.0, b], [r, 0.0, f], [r, high, f], [r, high, b]],
    );
    if part < 1.0 {
        let (x, y) = (half * part.sqrt(), 0.5 * high * part.sqrt());
        let (low, top) = (0.5 * high - y, 0.5 * high + y);
        wall(white, [[r, 0.0, f], [l, 0.0, f], [l, low, f], [r, low, f]]);
        wall(
            white,
            [[r, top, f], [l, top, f], [l, high, f], [r, high, f]],
        );
        wall(
            white,
            [[-x, low, f], [l, low, f], [l, top, f], [-x, top, f]],
        );
        wall(white, [[r, low, f], [x, low, f], [x, top, f], [r, top, f]]);
    }
    let block = mesh.matte("block", [0.5, 0.6, 0.7]);
    mesh.cuboid(
        [block; 6],
        Vec3::new(-1.1, 0.0, -1.2),
        Vec3::new(-0.2, 1.2, -0.3),
    );
    under(
        mesh,
        "open-room",
        sky,
        camera([0.0, 1.6, 1.9], [0.0, 0.8, -1.0], 70.0),
    )
}

/// A floor and a sheet over it, seen from above its edge and from below.
fn sheet(height_m: f32) -> Result<Scene, StressError> {
    let mut mesh = Mesh::default();
    let floor = mesh.matte("floor", [0.6, 0.6, 0.6]);
    add_floor(&mut mesh, floor);
    let cloth = mesh.matte("sheet", [0.7, 0.3, 0.3]);
    let corners = [(-1.2, 0.9), (1.2, 0.9), (1.2, -0.9), (-1.2, -0.9)];
    mesh.quad(cloth, corners.map(|(x, z)| Vec3::new(x, height_m, z)));
    let seen = camera([0.6, 1.2, 3.2], [0.0, 0.1, -0.2], 45.0);
    Ok(under(mesh, "sheet", sky(None)?, seen))
}

/// A floor with a box that stands in it.
fn sunk_box(part: f32) -> Result<Scene, StressError> {
    let mut mesh = Mesh::default();
    let floor = mesh.matte("floor", [0.6, 0.6, 0.6]);
    add_floor(&mut mesh, floor);
    let block = mesh.matte("block", [0.5, 0.6, 0.7]);
    let (edge, sunk) = (1.1, 1.1 * part);
    mesh.cuboid(
        [block; 6],
        Vec3::new(-0.7, -sunk, -0.6),
        Vec3::new(-0.7 + edge, edge - sunk, -0.6 + edge),
    );
    let seen = camera([1.2, 1.9, 2.6], [0.0, 0.2, 0.0], 45.0);
    Ok(under(mesh, "sunk-box", sky(None)?, seen))
}

/// A metal block on a floor.
fn metal_block(roughness: f32) -> Result<Scene, StressError> {
    let mut mesh = Mesh::default();
    let floor = mesh.matte("floor", [0.6, 0.6, 0.6]);
    add_floor(&mut mesh, floor);
    let metal = mesh.material(Material {
        name: "metal".to_owned(),
        albedo: Vec3::new(0.9, 0.8, 0.6),
        specular: Some(Specular {
            f0: Vec3::splat(0.04),
            roughness,
            metalness: 1.0,
            texture: None,
        }),
        ..Material::default()
    });
    mesh.cuboid(
        [metal; 6],
        Vec3::new(-0.9, 0.0, -0.7),
        Vec3::new(0.9, 1.1, 0.7),
    );
    let seen = camera([1.6, 1.7, 2.6], [0.0, 0.5, 0.0], 45.0);
    let sky = sky(Some((30.0, TO_SUN_DEG)))?;
    Ok(under(mesh, "metal-block", sky, seen))
}

fn under(mesh: Mesh, name: &str, sky: Sky, seen: Camera) -> Scene {
    let mut scene = mesh.into_scene(name, Vec::new(), Vec3::ZERO, seen);
    scene.environment = Environment::from(sky);
    scene
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Irradiance of a surface that faces a direction, over the texels of a map.
    fn irradiance(sky: &Sky, normal: Vec3) -> f32 {
        let Image { width, height, .. } = *sky.image();
        let edge = |y: u32| (PI * y as f32 / height as f32).cos();
        let mut sum = 0.0;
        for (y, row) in (0..).zip(sky.image().pixels.chunks(width as usize)) {
            let solid_angle = (edge(y) - edge(y + 1)) * TAU / width as f32;
            let (flat, up) = (PI * (y as f32 + 0.5) / height as f32).sin_cos();
            for (x, texel) in (0..).zip(row) {
                let (sin, cos) = (TAU * (x as f32 + 0.5) / width as f32).sin_cos();
                let direction = Vec3::new(flat * sin, up, -flat * cos);
                sum += solid_angle * texel.y * direction.dot(normal).max(0.0);
            }
        }
        sum
    }

    /// A disc brings as much however wide it is.
    #[test]
    fn discs_have_the_same_power() -> Result<(), Box<dyn std::error::Error>> {
        let (sin, cos) = TO_SUN_DEG.to_radians().sin_cos();
        let to_sun = Vec3::new(0.0, sin, cos);
        for width_deg in [40.0, 10.0, 2.0, 0.5] {
            let [with, without] = [Some((width_deg, TO_SUN_DEG)), None].map(sky);
            let more = irradiance(&with?, to_sun) - irradiance(&without?, to_sun);
            assert!((more / SUN - 1.0).abs() < 0.02, "{width_deg}°: {more}");
        }
        Ok(())
    }

    /// The wall at +z has an opening of the part that was asked for.
    #[test]
    fn openings_are_parts_of_the_wall() -> Result<(), Box<dyn std::error::Error>> {
        for part in [1.0f32, 0.25, 0.01] {
            let scene = open_room(part, sky(None)?);
            let area = |vertices: [u32; 3]| {
                let [a, b, c] = vertices.map(|at| Vec3::from(scene.vertices[at as usize].position));
                let is_front = [a, b, c].iter().all(|corner| corner.z == 0.5 * ROOM_M);
                let normal = (b - a).cross(c - a);
                assert!(!is_front || normal.z < 0.0);
                if is_front { 0.5 * normal.length() } else { 0.0 }
            };
            let triangles = scene.triangles.iter();
            let wall: f32 = triangles.map(|triangle| area(triangle.vertices)).sum();
            assert!(
                (1.0 - wall / (3.0 * ROOM_M) - part).abs() < 1e-3,
                "{part}: {wall}"
            );
        }
        Ok(())
    }
}
