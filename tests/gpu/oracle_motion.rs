//! Motion of `render.gbuffer` on the device against the places of the same points in the frame
//! before, in f64: each pixel, while cameras and models jump about, sizes change, and models are
//! moved more than once between frames, or not at all.

use crate::support::compare::Worst as _;
use crate::support::motion::WITH_MOTION;
use crate::support::scenes::{add_model, lump, random_pose, scene_of, soup, still};
use crate::support::surfaces::{
    Choice, allowed, every_surface, judge, planted_errors_fail, undecided,
};
use crate::support::technique::{Builder, frame};
use crate::support::{Random, ValidatedGpu, gpu};
use glam::{DVec2, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::Settings;
use lumivox::gi::registry::find;
use lumivox::image::Aov;
use lumivox::render::oracle::motion::{Before, motion};
use lumivox::render::oracle::{Scenery, View};
use lumivox::render::{BEHIND_PX, SurfaceChannel};
use lumivox::scene::{Camera, Material, Scene};

const SIZE: [u32; 2] = [48, 36];

/// Points (m) are off by this share of the largest coordinate: a few steps of 24-bit floats in
/// matrices, corners and their blend.
const PLACE_ERROR: f64 = 2e-7;

const NOWHERE: f64 = BEHIND_PX as f64;

/// A room of every kind of surface with three models; things that stand are before, between and
/// behind them.
fn stage(glossy: bool, emissive: bool) -> Scene {
    let mut scene = every_surface(glossy, emissive);
    let mut random = Random::new(5);
    let centred = |corners: [Vec3; 3]| corners.map(|corner| corner - 0.5);
    let lumps = || lump(3, 1).into_iter().map(centred).collect::<Vec<_>>();
    let needles: Vec<_> = soup(&mut random, 1).into_iter().map(centred).collect();
    let poses = |random: &mut Random| {
        let mut poses = vec![still(Vec3::new(0.3, 1.0, 0.2))];
        poses.extend((0..5).map(|_| random_pose(random, 0.7)));
        // To where no camera looks, and to where it was.
        poses.push(still(Vec3::new(0.0, 40.0, 0.0)));
        poses.push(poses[0]);
        poses
    };
    for (index, triangles) in [lumps(), needles, lumps()].into_iter().enumerate() {
        let mut model = scene_of(&triangles, 1.0, &mut random);
        for material in &mut model.materials {
            material.emission *= f32::from(u8::from(emissive));
        }
        let poses = poses(&mut random);
        add_model(&mut scene, model, &poses);
        let mut builder = Builder::default();
        let post = builder.material(Material::default());
        let corner = Vec3::new(-0.9 + 0.3 * index as f32, 0.1, 0.7);
        builder.quad(post, corner, Vec3::X * 0.1, Vec3::Y * 0.5);
        append_static(&mut scene, builder.scene);
    }
    scene
}

/// Appends the triangles of another scene.
fn append_static(scene: &mut Scene, other: Scene) {
    let (vertex, material) = (scene.vertices.len() as u32, scene.materials.len() as u32);
    scene.vertices.extend(other.vertices);
    scene.materials.extend(other.materials);
    for mut triangle in other.triangles {
        triangle.vertices = triangle.vertices.map(|index| index + vertex);
        triangle.material += material;
        scene.triangles.push(triangle);
    }
}

/// What a frame was drawn of.
#[derive(Clone)]
struct Shown {
    scene: Scene,
    camera: Camera,
    size: [u32; 2],
}

impl Shown {
    fn view(&self) -> View {
        let dynamic = self.scene.dynamic_bounds();
        let all = self.scene.static_bounds().into_iter().chain(dynamic);
        let (low, high) = all.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap();
        let near_m = 1e-4 * f64::from((high - low).length());
        View::of_camera(&self.camera, self.size, near_m)
    }

    /// The largest coordinate (m).
    fn reach_m(&self) -> f64 {
        let corners = self
            .scene
            .vertices
            .iter()
            .flat_map(|vertex| vertex.position);
        let all = corners.chain(self.camera.eye.to_array());
        all.map(|x| f64::from(x.abs())).worst()
    }
}

fn no_settings() -> Settings {
    WITH_MOTION.settings::<&str>(None, &[]).unwrap()
}

/// All that the motion of each pixel may be.
fn allowed_motion(before: &Shown, now: &Shown) -> Vec<Vec<Choice<2>>> {
    let (scenery, view) = (Scenery::new(&now.scene), now.view());
    let before_it = Before {
        scene: &before.scene,
        view: before.view(),
    };
    let is_still = |triangle: usize| {
        let corners = |shown: &Shown| {
            shown.scene.triangles[triangle]
                .vertices
                .map(|vertex| shown.scene.vertices[vertex as usize].position)
        };
        (before.camera, before.size) == (now.camera, now.size) && corners(before) == corners(now)
    };
    let reach_m = before.reach_m().max(now.reach_m());
    let of = |triangle: usize, at: DVec2| {
        let moved = motion(&scenery, &view, &before_it, triangle, at)?;
        Some(if is_still(triangle) {
            [0.0; 2]
        } else {
            moved.by_px.to_array()
        })
    };
    let tolerance = |triangle: usize, at: DVec2, expected: &[f64; 2]| {
        let Some(moved) = motion(&scenery, &view, &before_it, triangle, at) else {
            return [0.0; 2];
        };
        let depth_m = scenery.surface(triangle, &view, at).unwrap().depth_m;
        let limit_m = 0.5 * before_it.view.near_m;
        if is_still(triangle) {
            [0.0; 2]
        } else if (moved.depth_m - limit_m).abs() < 4.0 * PLACE_ERROR * reach_m {
            [f64::INFINITY; 2]
        } else if expected[0] == NOWHERE {
            [0.0; 2]
        } else {
            let off = PLACE_ERROR * reach_m * (1.0 / depth_m + (1.0 + moved.aside) / moved.depth_m);
            now.size.map(|size| off * f64::from(size))
        }
    };
    allowed(&scenery, &view, [0.0; 2], of, tolerance)
}

/// A renderer with a technique that asks for motion, and what it has shown.
struct Story<'g> {
    renderer: Renderer<'g>,
    now: Shown,
    shown: Vec<Shown>,
    worst: f64,
    largest_px: f64,
}

impl<'g> Story<'g> {
    fn new(gpu: &'g ValidatedGpu, scene: Scene) -> Self {
        let settings = no_settings();
        let [width, height] = SIZE;
        let (renderer, _) = Renderer::new(
            gpu,
            &scene,
            &WITH_MOTION,
            &settings,
            frame(width, height, 8),
        )
        .unwrap();
        let now = Shown {
            camera: scene.camera,
            scene,
            size: SIZE,
        };
        Story {
            renderer,
            now,
            shown: Vec::new(),
            worst: 0.0,
            largest_px: 0.0,
        }
    }

    fn pose(&mut self, time_s: f32) {
        self.now.scene.set_time(time_s);
        self.renderer.set_pose(&self.now.scene).unwrap();
    }

    fn size(&mut self, size: [u32; 2]) {
        self.now.size = size;
        self.renderer.set_size(size);
    }

    /// Draws a frame and compares it; answers each pixel's motion.
    fn draw(&mut self, what: &str, is_again: bool) -> Vec<[f64; 2]> {
        let camera = &self.now.camera;
        if is_again {
            self.renderer.render_again(camera).unwrap();
        } else {
            self.renderer.render(camera).unwrap();
        }
        let image = self.renderer.surface(SurfaceChannel::Motion).unwrap();
        let of_pixel = |motion: &Vec3| [f64::from(motion.x), f64::from(motion.y)];
        let seen: Vec<[f64; 2]> = image.pixels.iter().map(of_pixel).collect();
        assert_eq!((image.width, image.height), self.now.size.into());
        if let Some(before) = self.shown.last() {
            let allowed = allowed_motion(before, &self.now);
            let worst = judge(&seen, &allowed).unwrap_or_else(|error| panic!("{what}: {error}"));
            let certain = seen.iter().zip(&allowed).filter(|(_, all)| all.len() == 1);
            let inside = certain.filter(|(seen, _)| seen[0].abs().max(seen[1].abs()) < 100.0);
            let apart = |(seen, all): (&[f64; 2], &Vec<Choice<2>>)| {
                (0..2).map(|i| (seen[i] - all[0].0[i]).abs()).worst()
            };
            let largest = inside.map(apart).worst();
            println!(
                "{what}: {worst:.3} of the tolerance, {largest:.6} px where it moves less than \
                 100, {:.3} on edges",
                undecided(&allowed)
            );
            self.worst = self.worst.max(worst);
            self.largest_px = self.largest_px.max(largest);
        } else {
            assert!(seen.iter().all(|motion| *motion == [0.0; 2]), "{what}");
        }
        self.shown.push(self.now.clone());
        seen
    }
}

fn random_camera(random: &mut Random) -> Camera {
    let mut point =
        |low: Vec3, high: Vec3| low + (high - low) * Vec3::from([0; 3].map(|_: u32| random.unit()));
    let eye = point(Vec3::new(-0.9, 0.1, -0.7), Vec3::new(0.9, 1.9, 3.2));
    let target = point(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 0.5));
    let up = Vec3::Y + point(Vec3::splat(-0.3), Vec3::splat(0.3));
    Camera {
        eye,
        target,
        up,
        vfov_deg: 30.0 + 70.0 * random.unit(),
    }
}

/// Share of pixels.
fn share(seen: &[[f64; 2]], is: impl Fn(usize, [f64; 2]) -> bool) -> f64 {
    let count = seen.iter().enumerate().filter(|(i, m)| is(*i, **m)).count();
    count as f64 / seen.len() as f64
}

fn moves(_: usize, motion: [f64; 2]) -> bool {
    motion != [0.0; 2]
}

#[test]
fn motion_leads_to_the_frame_before() {
    let gpu = gpu();
    let mut story = Story::new(&gpu, stage(true, true));
    let first = story.now.camera;
    // A pose before the first frame is not one that a frame showed.
    story.pose(0.5);
    story.draw("the first frame", false);
    assert_eq!(share(&story.draw("nothing moves", false), moves), 0.0);
    story.now.camera.eye = Vec3::new(0.1, 1.0, 0.6);
    story.now.camera.target = Vec3::new(-1.0, 1.0, -0.6);
    let seen = story.draw("the camera moves", false);
    assert!(share(&seen, moves) > 0.5);
    let is_outside = |pixel: usize, [x, y]: [f64; 2]| {
        let [width, height] = SIZE.map(f64::from);
        let x = x + (pixel % SIZE[0] as usize) as f64 + 0.5;
        let y = y + (pixel / SIZE[0] as usize) as f64 + 0.5;
        x < 0.0 || y < 0.0 || x > width || y > height
    };
    story.now.camera.target = Vec3::new(1.0, 1.0, -0.4);
    let seen = story.draw("a surface that was off-screen", true);
    let outside = share(&seen, is_outside);
    assert!(outside > 0.1, "{outside}");
    assert_eq!(share(&story.draw("nothing moves again", true), moves), 0.0);
    story.now.camera = first;
    story.draw("the camera jumps back", false);
    story.pose(1.5);
    let seen = story.draw("the models move", false);
    let moving = share(&seen, moves);
    assert!((0.02..0.9).contains(&moving), "{moving}");
    // Planted errors are seen; and so is the frame before the one before.
    let [.., earliest, before, now] = &story.shown[..] else {
        panic!("too few frames")
    };
    let earlier = Shown {
        camera: story.shown[2].camera,
        ..earliest.clone()
    };
    planted_errors_fail(&seen, &allowed_motion(before, now));
    assert!(judge(&seen, &allowed_motion(&earlier, now)).is_err());
    assert!(judge(&seen, &allowed_motion(now, now)).is_err());
    assert_eq!(share(&story.draw("the models stand", true), moves), 0.0);
    story.pose(2.5);
    story.pose(3.25);
    let seen = story.draw("twice between two frames", false);
    assert!(share(&seen, moves) > 0.02);
    story.pose(4.0);
    story.pose(3.25);
    let seen = story.draw("there and back between two frames", false);
    assert_eq!(share(&seen, moves), 0.0);
    story.pose(3.25);
    story.now.camera = first;
    story.draw("a pose that is the same", true);
    story.size([31, 36]);
    let seen = story.draw("a narrower picture", true);
    assert!(share(&seen, moves) > 0.5);
    story.size([31, 20]);
    story.pose(5.5);
    story.draw("a lower picture while models move", false);
    story.size(SIZE);
    story.now.camera.target = 2.0 * first.eye - first.target;
    story.draw("turned away", false);
    story.now.camera = first;
    let seen = story.draw("turned back", false);
    let behind = |_: usize, motion: [f64; 2]| motion == [NOWHERE; 2];
    assert!(share(&seen, behind) > 0.5);
    story.pose(6.0);
    story.draw("the models are gone", false);
    story.pose(7.0);
    story.draw("the models come from far off", false);
    println!("{:.3}, {:.6} px", story.worst, story.largest_px);
}

#[test]
fn motion_of_random_frames() {
    let gpu = gpu();
    for (index, (glossy, emissive)) in [(false, false), (true, false), (false, true), (true, true)]
        .into_iter()
        .enumerate()
    {
        let mut random = Random::new(40 + index as u64);
        let mut story = Story::new(&gpu, stage(glossy, emissive));
        for step in 0..8 {
            if random.below(3) > 0 {
                story.now.camera = random_camera(&mut random);
            }
            if random.below(4) == 0 {
                story.size([0, 1].map(|axis| SIZE[axis] / 2 + random.below(SIZE[axis] / 2) + 1));
            }
            for _ in 0..random.below(3) {
                story.pose(7.0 * random.unit());
            }
            let what = format!("glossy {glossy}, emissive {emissive}, step {step}");
            story.draw(&what, random.below(2) == 0);
        }
        println!("{:.3}, {:.6} px", story.worst, story.largest_px);
    }
}

/// What else a G-buffer holds is the same with motion, to the bit; and without it there is no image
/// and no copy of vertices. Where no model can move, nothing is copied.
#[test]
fn motion_is_drawn_where_it_is_asked_for() {
    let gpu = gpu();
    let settings = no_settings();
    let names = || -> Vec<String> {
        let named = gpu.memory().into_iter().map(|(name, _)| name);
        named.filter(|name| name.starts_with("gbuffer.")).collect()
    };
    let mut scene = stage(true, true);
    let none = find("none").unwrap();
    let (mut without, _) = Renderer::new(&gpu, &scene, none, &settings, frame(48, 36, 8)).unwrap();
    let has = |part: &str| names().iter().any(|name| name.contains(part));
    assert!(!has("motion") && !has("previous"), "{:?}", names());
    let (mut with, _) =
        Renderer::new(&gpu, &scene, &WITH_MOTION, &settings, frame(48, 36, 8)).unwrap();
    assert!(has("motion") && has("previous"), "{:?}", names());
    for time_s in [0.0, 1.5] {
        scene.set_time(time_s);
        without.render(&scene.camera).unwrap();
        with.render(&scene.camera).unwrap();
        let stats = [&mut without, &mut with].map(|renderer| {
            renderer.set_pose(&scene).unwrap();
            gpu.submit_waiting().unwrap()
        });
        let kept = stats.map(|stats| stats.pass_ms("render.keep_pose").is_some());
        assert_eq!(kept, [false, true]);
    }
    for aov in [Aov::Depth, Aov::Normal, Aov::Albedo] {
        assert_eq!(without.aov(aov).unwrap(), with.aov(aov).unwrap(), "{aov}");
    }
    for channel in [
        SurfaceChannel::GeometricNormal,
        SurfaceChannel::Roughness,
        SurfaceChannel::F0,
    ] {
        let [without, with] = [&without, &with].map(|renderer| renderer.surface(channel).unwrap());
        assert_eq!(without, with, "{channel:?}");
    }
    let motion = without.surface(SurfaceChannel::Motion).unwrap();
    assert!(motion.pixels.iter().all(|motion| *motion == Vec3::ZERO));
    drop((with, without));
    let still = every_surface(false, false);
    let (mut renderer, _) =
        Renderer::new(&gpu, &still, &WITH_MOTION, &settings, frame(48, 36, 8)).unwrap();
    renderer.render(&still.camera).unwrap();
    assert!(has("motion") && !has("previous"), "{:?}", names());
}
