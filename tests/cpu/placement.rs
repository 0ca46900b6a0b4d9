//! An OBJ alone: its first picture can be judged, whatever it is and in whichever unit.

use glam::Vec3;
use lumivox::image::{exposure_to_see, luminance};
use lumivox::reference::{Bounces, Filter, Sampling, Settings, guide, render};
use lumivox::scene::{Light, LoadOptions, Scene, Up};

/// Width and height of the pictures (px).
const SIZE: [u32; 2] = [48, 27];

/// An OBJ that is written shape by shape.
#[derive(Default)]
struct Obj {
    text: String,
    vertices: usize,
}

impl Obj {
    /// Appends faces of corners counted from 0, in a material of this name.
    fn add(&mut self, material: &str, corners: &[Vec3], faces: &[[usize; 4]]) {
        self.text += &format!("usemtl {material}\n");
        for corner in corners {
            self.text += &format!("v {} {} {}\n", corner.x, corner.y, corner.z);
        }
        for face in faces {
            let [a, b, c, d] = face.map(|corner| corner + 1 + self.vertices);
            self.text += &format!("f {a} {b} {c} {d}\n");
        }
        self.vertices += corners.len();
    }

    /// A square floor of this half width at height 0.
    fn floor(mut self, half: f32) -> Obj {
        let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]]
            .map(|[x, z]| half * Vec3::new(x, 0.0, z));
        self.add("floor", &corners, &[[0, 1, 2, 3]]);
        self
    }

    /// A box; its walls face outwards, or inwards.
    fn cuboid(mut self, material: &str, [low, high]: [Vec3; 2], inwards: bool) -> Obj {
        let corners: [Vec3; 8] = std::array::from_fn(|corner| {
            let pick = |axis: usize| {
                if corner >> axis & 1 == 0 {
                    low[axis]
                } else {
                    high[axis]
                }
            };
            Vec3::new(pick(0), pick(1), pick(2))
        });
        let mut faces = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        if inwards {
            faces.iter_mut().for_each(|face| face.reverse());
        }
        self.add(material, &corners, &faces);
        self
    }

    /// A torus of radii 1 and 0.35 that lies on the floor.
    fn torus(mut self) -> Obj {
        const AROUND: usize = 24;
        const ACROSS: usize = 12;
        let angle = |index: usize, count: usize| {
            std::f32::consts::TAU * (index % count) as f32 / count as f32
        };
        let corner = |index: usize| {
            let (sin, cos) = angle(index / ACROSS, AROUND).sin_cos();
            let (up, out) = angle(index % ACROSS, ACROSS).sin_cos();
            let radius = 1.0 + 0.35 * out;
            Vec3::new(radius * cos, 0.35 + 0.35 * up, radius * sin)
        };
        let corners: Vec<Vec3> = (0..AROUND * ACROSS).map(corner).collect();
        let index = |around: usize, across: usize| (around % AROUND) * ACROSS + across % ACROSS;
        let face = |at: usize| {
            let (a, b) = (at / ACROSS, at % ACROSS);
            [
                index(a, b),
                index(a, b + 1),
                index(a + 1, b + 1),
                index(a + 1, b),
            ]
        };
        let faces: Vec<[usize; 4]> = (0..AROUND * ACROSS).map(face).collect();
        self.add("thing", &corners, &faces);
        self
    }

    /// With every vertex moved.
    fn moved(self, moved: impl Fn([f32; 3]) -> [f32; 3]) -> Obj {
        let line = |line: &str| match line.strip_prefix("v ") {
            None => format!("{line}\n"),
            Some(numbers) => {
                let values: Vec<f32> = numbers
                    .split(' ')
                    .map(|number| number.parse().unwrap())
                    .collect();
                let [x, y, z] = moved([values[0], values[1], values[2]]);
                format!("v {x} {y} {z}\n")
            }
        };
        Obj {
            text: self.text.lines().map(line).collect(),
            ..self
        }
    }

    fn load(&self, up: Up) -> Scene {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.obj");
        std::fs::write(&path, &self.text).unwrap();
        let options = LoadOptions {
            up,
            ..LoadOptions::default()
        };
        Scene::load(&path, &options).unwrap()
    }
}

fn cube_on_floor() -> Obj {
    let cube = [Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 1.0, 0.5)];
    Obj::default().floor(5.0).cuboid("thing", cube, false)
}

fn torus_on_floor() -> Obj {
    Obj::default().floor(3.0).torus()
}

fn room(inwards: bool) -> Obj {
    let thing = [Vec3::new(2.2, 0.0, 1.0), Vec3::new(3.2, 1.1, 2.0)];
    Obj::default()
        .cuboid("walls", [Vec3::ZERO, Vec3::new(4.0, 2.5, 6.0)], inwards)
        .cuboid("thing", thing, false)
}

/// A nave of 60 m between two rows of pillars.
fn hall() -> Obj {
    let walls = [Vec3::new(-8.0, 0.0, -30.0), Vec3::new(8.0, 18.0, 30.0)];
    let mut hall = Obj::default().cuboid("walls", walls, true);
    for pillar in 0..20 {
        let (x, z) = (
            9.0 * (pillar % 2) as f32 - 5.0,
            6.0 * (pillar / 2) as f32 - 26.0,
        );
        let corners = [Vec3::new(x, 0.0, z), Vec3::new(x + 1.0, 14.0, z + 1.0)];
        hall = hall.cuboid("thing", corners, false);
    }
    hall
}

/// A gallery of 30 m that is as wide as a door is high, between two rows of pillars.
fn gallery() -> Obj {
    let walls = [Vec3::new(-15.0, 0.0, -2.0), Vec3::new(15.0, 3.5, 2.0)];
    let mut gallery = Obj::default().cuboid("walls", walls, true);
    for pillar in 0..20 {
        let x = 3.0 * (pillar / 2) as f32 - 13.5;
        let z = 2.8 * (pillar % 2) as f32 - 1.4;
        let corners = [
            Vec3::new(x - 0.15, 0.0, z - 0.15),
            Vec3::new(x + 0.15, 3.5, z + 0.15),
        ];
        gallery = gallery.cuboid("thing", corners, false);
    }
    gallery
}

/// Two rooms of 6 m, with a doorway of 1 m between them and a thing in each.
fn two_rooms() -> Obj {
    let walls = [Vec3::new(-6.0, 0.0, -3.0), Vec3::new(6.0, 3.0, 3.0)];
    let wall = |low: [f32; 2], high: [f32; 2]| {
        [
            Vec3::new(-0.1, low[0], low[1]),
            Vec3::new(0.1, high[0], high[1]),
        ]
    };
    Obj::default()
        .cuboid("walls", walls, true)
        .cuboid("wall", wall([0.0, -3.0], [3.0, -0.5]), false)
        .cuboid("wall", wall([0.0, 0.5], [3.0, 3.0]), false)
        .cuboid("wall", wall([2.1, -0.5], [3.0, 0.5]), false)
        .cuboid(
            "thing",
            [Vec3::new(-4.5, 0.0, -2.0), Vec3::new(-3.0, 0.8, -0.6)],
            false,
        )
        .cuboid(
            "thing",
            [Vec3::new(3.0, 0.0, 1.0), Vec3::new(4.0, 1.8, 2.2)],
            false,
        )
}

/// A court of 20 m by 16 m between walls of 6 m, without a roof, with a basin in the middle.
fn court() -> Obj {
    let cuboids = [
        ("floor", [-10.0, -0.3, -8.0], [10.0, 0.0, 8.0]),
        ("wall", [-10.0, 0.0, -8.0], [10.0, 6.0, -7.5]),
        ("wall", [-10.0, 0.0, 7.5], [10.0, 6.0, 8.0]),
        ("wall", [-10.0, 0.0, -7.5], [-9.5, 6.0, 7.5]),
        ("wall", [9.5, 0.0, -7.5], [10.0, 6.0, 7.5]),
        ("wall", [-9.5, 3.6, -7.5], [9.5, 3.9, -5.0]),
        ("wall", [-9.5, 3.6, 5.0], [9.5, 3.9, 7.5]),
        ("wall", [-9.5, 3.6, -5.0], [-7.0, 3.9, 5.0]),
        ("wall", [7.0, 3.6, -5.0], [9.5, 3.9, 5.0]),
        ("thing", [-2.5, 0.0, -2.5], [2.5, 1.2, 2.5]),
    ];
    cuboids
        .into_iter()
        .fold(Obj::default(), |court, (name, low, high)| {
            court.cuboid(name, [low, high].map(Vec3::from), false)
        })
}

/// Hills of 40 m with z upwards: one open surface.
fn hills() -> Obj {
    const SIDE: usize = 24;
    let corner = |index: usize| {
        let [x, y] = [index / SIDE, index % SIDE].map(|at| 40.0 * at as f32 / (SIDE - 1) as f32);
        Vec3::new(x, y, 2.2 * (0.2 * x).sin() * (0.15 * y).cos())
    };
    let face = |at: usize| {
        let first = at / (SIDE - 1) * SIDE + at % (SIDE - 1);
        [first, first + SIDE, first + SIDE + 1, first + 1]
    };
    let corners: Vec<Vec3> = (0..SIDE * SIDE).map(corner).collect();
    let faces: Vec<[usize; 4]> = (0..(SIDE - 1) * (SIDE - 1)).map(face).collect();
    let mut hills = Obj::default();
    hills.add("thing", &corners, &faces);
    hills
}

/// Renders a scene; says the share of the picture that shows the material `thing`, the median
/// luminance after exposure, and the share that is clipped.
fn judged(scene: &Scene) -> [f32; 3] {
    let [width, height] = SIZE;
    let settings = Settings {
        width,
        height,
        bounces: Bounces::Count(2),
        filter: Filter::Center,
        sampling: Sampling::Fixed { spp: 16 },
        seed: 1,
        ..Settings::default()
    };
    let image = render(scene, &settings, &|_| {}).unwrap().radiance();
    let exposure = exposure_to_see(&image, scene.environment.uniform());
    let mut values: Vec<f32> = image
        .pixels
        .iter()
        .map(|&pixel| exposure * luminance(pixel))
        .collect();
    values.sort_by(f32::total_cmp);
    let thing = scene
        .materials
        .iter()
        .position(|material| material.name == "thing")
        .unwrap();
    let guide = guide(scene, width, height).unwrap();
    let share = |count: usize| count as f32 / (width * height) as f32;
    [
        share(
            guide
                .material
                .iter()
                .filter(|material| **material == thing as u32)
                .count(),
        ),
        values[values.len() / 2],
        share(values.iter().filter(|value| **value > 1.0).count()),
    ]
}

#[track_caller]
fn assert_can_be_judged(name: &str, scene: &Scene) {
    let [thing, median, clipped] = judged(scene);
    println!("{name}: thing {thing:.3}, median {median:.3}, clipped {clipped:.3}");
    assert!(
        thing > 0.03,
        "{name}: {thing} of the picture shows the model"
    );
    assert!(
        (0.08..0.7).contains(&median),
        "{name}: the median luminance is {median}"
    );
    assert!(clipped < 0.1, "{name}: {clipped} of the picture is clipped");
}

#[test]
fn first_pictures_can_be_judged() {
    let cases = [
        ("cube", cube_on_floor(), Up::Y),
        ("torus", torus_on_floor(), Up::Y),
        (
            "torus in mm",
            torus_on_floor().moved(|at| at.map(|value| 1000.0 * value)),
            Up::Y,
        ),
        (
            "torus, z up",
            torus_on_floor().moved(|[x, y, z]| [x, -z, y]),
            Up::Y,
        ),
        (
            "torus, z up and told so",
            torus_on_floor().moved(|[x, y, z]| [x, -z, y]),
            Up::Z,
        ),
        ("room", room(true), Up::Y),
        ("room from its back", room(false), Up::Y),
        ("hall", hall(), Up::Y),
        ("gallery", gallery(), Up::Y),
        ("two rooms", two_rooms(), Up::Y),
        ("court", court(), Up::Y),
        ("hills, z up and told so", hills(), Up::Z),
    ];
    for (name, obj, up) in cases {
        assert_can_be_judged(name, &obj.load(up));
    }
}

/// A picture of a black model, or of a wall, cannot be judged: the bounds of the test bite.
#[test]
fn a_camera_in_the_cube_is_found_out() {
    let mut scene = cube_on_floor().load(Up::Y);
    scene.camera.eye = Vec3::new(0.0, 0.5, 0.0);
    scene.camera.target = Vec3::ZERO;
    scene.camera.up = Vec3::X;
    let [_, median, _] = judged(&scene);
    assert!(median < 0.08, "{median}");
    let sight = scene.sight();
    assert!(sight.lit == 0.0 && sight.surfaces > 0.99, "{sight:?}");
    scene.camera.target = Vec3::new(0.0, 1.0, 0.0);
    assert!(scene.sight().backs > 0.99, "{:?}", scene.sight());
}

/// What is chosen does not depend on unit or place.
#[test]
fn unit_and_place_change_nothing() {
    let eye = |scene: &Scene| scene.camera.eye;
    let metres = torus_on_floor().load(Up::Y);
    let millimetres = torus_on_floor()
        .moved(|at| at.map(|value| 1000.0 * value))
        .load(Up::Y);
    assert!((1000.0 * eye(&metres)).distance(eye(&millimetres)) < 1.0);
    let moved = torus_on_floor()
        .moved(|[x, y, z]| [x + 512.0, y, z])
        .load(Up::Y);
    assert!((eye(&metres) + 512.0 * Vec3::X).distance(eye(&moved)) < 0.01);
    let turned = torus_on_floor().moved(|[x, y, z]| [x, -z, y]).load(Up::Z);
    assert_eq!(metres.vertices, turned.vertices);
    assert_eq!(metres.camera, turned.camera);
}

/// Lamps light most of what the camera sees themselves. A lamp behind a pillar or in the next room
/// lights little of it, however evenly.
#[test]
fn lamps_hang_where_the_camera_looks() {
    for (name, obj) in [
        ("room", room(true)),
        ("hall", hall()),
        ("gallery", gallery()),
        ("two rooms", two_rooms()),
    ] {
        let sight = obj.load(Up::Y).sight();
        println!("{name}: {sight:?}");
        assert!(
            sight.lit > 0.6 * sight.surfaces,
            "{name}: light reaches {} of {}",
            sight.lit,
            sight.surfaces
        );
    }
}

/// A court has the sun, although most of its points are enclosed; a room with a hole in its roof
/// has lamps.
#[test]
fn the_sun_lights_what_has_no_roof() {
    let kinds = |scene: &Scene| -> Vec<bool> {
        let is_sun = |light: &Light| matches!(light, Light::Directional { .. });
        scene.lights.iter().map(is_sun).collect()
    };
    assert_eq!(kinds(&court().load(Up::Y)), [true]);
    let [low, high] = [Vec3::new(-5.0, 0.0, -5.0), Vec3::new(5.0, 6.0, 5.0)];
    let rim = [
        [low.x, low.z, high.x, -1.0],
        [low.x, 1.0, high.x, high.z],
        [low.x, -1.0, -1.0, 1.0],
        [1.0, -1.0, high.x, 1.0],
    ];
    let walls = Obj::default().cuboid("walls", [low, high], true);
    let text = walls.text.replace("f 4 8 7 3\n", "");
    assert!(text.len() < walls.text.len(), "{text}");
    let with_hole = rim.into_iter().fold(
        Obj { text, ..walls },
        |room, [x_low, z_low, x_high, z_high]| {
            let slab = [Vec3::new(x_low, 6.0, z_low), Vec3::new(x_high, 6.3, z_high)];
            room.cuboid("roof", slab, false)
        },
    );
    let scene = with_hole.load(Up::Y);
    assert!(!scene.environment.is_black());
    let kinds = kinds(&scene);
    assert!(!kinds.is_empty() && !kinds.contains(&true), "{kinds:?}");
}

#[test]
fn rooms_are_seen_from_inside_and_things_from_outside() {
    for (obj, is_room) in [(room(true), true), (room(false), true), (hall(), true)]
        .into_iter()
        .chain([(cube_on_floor(), false), (torus_on_floor(), false)])
    {
        let scene = obj.load(Up::Y);
        let (low, high) = scene.bounds().unwrap();
        let is_in = |point: Vec3| point.cmpgt(low).all() && point.cmplt(high).all();
        assert_eq!(is_in(scene.camera.eye), is_room, "{:?}", scene.camera);
        assert_eq!(scene.environment.is_black(), is_room);
        for light in &scene.lights {
            match *light {
                Light::Point { position, .. } => assert!(is_room && is_in(position), "{light:?}"),
                _ => assert!(!is_room, "{light:?}"),
            }
        }
    }
}
