//! Two rooms and a wall between them: the light is in one, the camera in the other. With the door
//! closed every bit of light that is seen has leaked.

use glam::{Quat, Vec3};

use super::super::{Camera, Light, Scene, Vertex};
use super::mesh::{HIGH_X, LOW_X, LOW_Y, Mesh};
use super::{BundledScene, Parameter, SWITCH, Values};

pub(super) const ROW: BundledScene = BundledScene {
    name: "two-rooms",
    description: "light in one room, camera in the dark one behind a thin wall: shows leaks",
    parameters: &[
        Parameter {
            name: "thickness_m",
            description: "thickness of the wall between the rooms",
            unit: "m",
            min: 0.001,
            max: 2.0,
            default: 0.1,
        },
        Parameter {
            name: "lit_length_m",
            description: "length of the lit room",
            unit: "m",
            min: 3.0,
            max: 16.0,
            default: LENGTH_M as f64,
        },
        Parameter {
            name: "turn_deg",
            description: "how far everything is turned about the vertical",
            unit: "degrees",
            min: -360.0,
            max: 360.0,
            default: 0.0,
        },
        Parameter {
            name: "door",
            description: "whether the wall has an open door, 1 m wide and 2 m high",
            unit: SWITCH,
            min: 0.0,
            max: 1.0,
            default: 0.0,
        },
    ],
    build,
};

/// Each room is 4 m long unless told otherwise, 3 m high and 4 m wide; y and z are cut where the
/// door is.
const LENGTH_M: f32 = 4.0;
const CUTS_Y: [f32; 3] = [0.0, 2.0, 3.0];
const CUTS_Z: [f32; 4] = [-2.0, -0.5, 0.5, 2.0];

fn build(values: &Values) -> Scene {
    let half_m = 0.5 * values.number("thickness_m");
    let has_door = values.is_on("door");
    let mut mesh = Mesh::default();
    let lit = mesh.matte("lit_room", [0.75, 0.65, 0.5]);
    let dark = mesh.matte("dark_room", [0.7, 0.7, 0.7]);
    let floor = mesh.matte("floor", [0.5, 0.5, 0.5]);
    let wall = mesh.matte("wall", [0.6, 0.6, 0.6]);
    for (x, paint, wall_face) in [
        (
            [-half_m - values.number("lit_length_m"), -half_m],
            lit,
            HIGH_X,
        ),
        ([half_m, half_m + LENGTH_M], dark, LOW_X),
    ] {
        mesh.room([&x, &CUTS_Y, &CUTS_Z], |face, middle| match face {
            _ if face == wall_face => {
                (!(has_door && middle.z == 0.0 && middle.y < 2.0)).then_some(wall)
            }
            LOW_Y => Some(floor),
            _ => Some(paint),
        });
    }
    if has_door {
        let x = [-half_m, half_m];
        mesh.room([&x, &CUTS_Y[..2], &CUTS_Z[1..3]], |face, _| match face {
            LOW_X | HIGH_X => None,
            LOW_Y => Some(floor),
            _ => Some(wall),
        });
    }
    let light = Light::Point {
        position: Vec3::new(-half_m - 2.0, 2.4, -1.0),
        intensity: Vec3::new(40.0, 36.0, 30.0),
    };
    let camera = Camera {
        eye: Vec3::new(half_m + 3.7, 1.5, -1.6),
        target: Vec3::new(half_m, 1.2, 0.7),
        up: Vec3::Y,
        vfov_deg: 70.0,
    };
    turned(
        mesh.into_scene("two-rooms", vec![light], Vec3::ZERO, camera),
        values.number("turn_deg"),
    )
}

/// The scene turned about the vertical through the origin.
fn turned(scene: Scene, turn_deg: f32) -> Scene {
    if turn_deg == 0.0 {
        return scene;
    }
    let turn = Quat::from_rotation_y(turn_deg.to_radians());
    let vertex = |vertex: Vertex| {
        let [position, normal] =
            [vertex.position, vertex.normal].map(|vector| (turn * Vec3::from(vector)).to_array());
        Vertex {
            position,
            normal,
            ..vertex
        }
    };
    let light = |light: Light| match light {
        Light::Point {
            position,
            intensity,
        } => Light::Point {
            position: turn * position,
            intensity,
        },
        other => other,
    };
    let camera = Camera {
        eye: turn * scene.camera.eye,
        target: turn * scene.camera.target,
        ..scene.camera
    };
    let (vertices, lights) = (
        scene.vertices.into_iter().map(vertex).collect(),
        scene.lights.into_iter().map(light).collect(),
    );
    Scene {
        vertices,
        lights,
        camera,
        ..scene
    }
}
