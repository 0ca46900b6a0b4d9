//! What a renderer shows after models and lights have moved, against one that was made with them
//! there.

use crate::support::compare::larger;
use crate::support::gpu;
use crate::support::technique::{
    Case, Surfaces, cases, default_cases, default_cases_with, frame, is_sound, largest_difference,
    moving_cases, moving_room, small_lights, small_room,
};
use glam::Vec3;
use lumivox::frame::Renderer;
use lumivox::graph::Gpu;
use lumivox::image::{Aov, Image};
use lumivox::metrics::stability::run_spread;
use lumivox::scene::{Light, Scene};

fn pictures(renderer: &Renderer<'_>) -> Vec<Image> {
    [
        Aov::Full,
        Aov::Direct,
        Aov::Indirect,
        Aov::Diffuse,
        Aov::Specular,
        Aov::Visibility,
    ]
    .map(|aov| renderer.aov(aov).unwrap())
    .to_vec()
}

/// Times (s) of the model, and cells: a default preset goes on from update to update, another only
/// shows that it follows.
fn effort(is_default: bool) -> (&'static [f32], &'static str) {
    if is_default {
        (&[0.4, 1.0, 2.0], "32")
    } else {
        (&[0.4, 1.0], "16")
    }
}

/// A renderer that followed a model gives the pictures of one that was made with the model there:
/// the default preset of every technique with every surface, the others with one in turn.
#[test]
fn followed_pictures_are_those_of_a_new_renderer() {
    let gpu = gpu();
    let defaults = default_cases();
    for (index, case) in moving_cases().iter().enumerate() {
        let is_default = defaults.iter().any(|default| default.name() == case.name());
        for (turn, surfaces) in Surfaces::ALL
            .into_iter()
            .enumerate()
            .filter(|(turn, _)| is_default || *turn == index % 4)
        {
            let (name, light) = small_lights()[(index + turn) % 3];
            let what = format!("{}, {surfaces:?}, {name}", case.name());
            let (times, resolution) = effort(is_default);
            follow(
                &gpu,
                case,
                moving_room(surfaces, light),
                times,
                &what,
                &[("resolution", resolution)],
            );
        }
    }
}

/// The same where voxels light each other, and where an update of the octree makes all bricks,
/// normal bricks included.
#[test]
fn followed_bounces_are_those_of_a_new_renderer() {
    let gpu = gpu();
    let (name, light) = small_lights()[0];
    let defaults = default_cases();
    for case in moving_cases()
        .iter()
        .filter(|case| case.entry.name != "none")
    {
        let is_default = defaults.iter().any(|default| default.name() == case.name());
        let (times, resolution) = effort(is_default);
        let pairs = [
            ("resolution", resolution),
            ("bounces", "2"),
            ("filter", "all"),
            ("normals", if case.has_faces() { "off" } else { "toksvig" }),
            ("radiance", "two-sided"),
        ];
        follow(
            &gpu,
            case,
            moving_room(Surfaces::Diffuse, light),
            times,
            &format!("{}, two bounces, {name}", case.name()),
            &pairs,
        );
    }
}

/// The same with a running average, from which nothing can be taken away and which depends on the
/// order of fragments: the picture differs from new renderers no more than these from each other.
#[test]
fn running_averages_are_made_anew() {
    let gpu = gpu();
    let (name, light) = small_lights()[0];
    let case = cases()
        .into_iter()
        .find(|case| case.entry.name == "voxel-mips")
        .unwrap();
    let scene = moving_room(Surfaces::Diffuse, light);
    let settings = case.settings(&[("resolution", "32"), ("accumulation", "running-average")]);
    let renderer = |scene: &Scene| {
        Renderer::new(&gpu, scene, case.entry, &settings, frame(24, 16, 64))
            .unwrap()
            .0
    };
    let picture = |renderer: &mut Renderer<'_>| {
        renderer.render(&scene.camera).unwrap();
        renderer.aov(Aov::Indirect).unwrap()
    };
    let mut follower = renderer(&scene);
    let before = picture(&mut follower);
    let mut moved = scene.clone();
    moved.set_time(1.0);
    let stats = follower.set_pose(&moved).unwrap();
    assert!(
        stats
            .passes
            .iter()
            .any(|pass| pass.name == "voxel.running_average"),
        "{name}"
    );
    let followed = picture(&mut follower);
    let fresh: Vec<Image> = (0..3).map(|_| picture(&mut renderer(&moved))).collect();
    let spread = run_spread(&fresh).unwrap();
    let with =
        |image: &Image| run_spread(&[&fresh[..], std::slice::from_ref(image)].concat()).unwrap();
    println!(
        "running averages: new renderers spread by {spread:.2e}, with the follower by {:.2e}, \
         with the picture before the move by {:.2e}",
        with(&followed),
        with(&before)
    );
    assert!(
        is_sound(&followed) && with(&followed) <= 2.0 * spread + 1e-3,
        "{} and {spread}",
        with(&followed)
    );
    assert!(
        with(&before) > 10.0 * (2.0 * spread + 1e-3),
        "the move has to change the picture: {} and {spread}",
        with(&before)
    );
}

/// Largest difference of a pixel, over the mean. Bricks, and maps of probes that come and go, hold
/// the same bits, but lie elsewhere in images, where texture coordinates round differently.
fn rounding(case: &Case) -> f64 {
    match case.entry.name {
        "svo" => 1e-4,
        // What sees a probe is a ratio of small differences there.
        "probe-cascades" => 1e-3,
        _ => 0.0,
    }
}

/// Goes to some times (s), each compared with a new renderer there, and back to the first.
fn follow(
    gpu: &Gpu,
    case: &Case,
    mut scene: Scene,
    times_s: &[f32],
    what: &str,
    pairs: &[(&str, &str)],
) {
    let settings = case.settings(pairs);
    let (mut follower, _) =
        Renderer::new(gpu, &scene, case.entry, &settings, frame(24, 16, 64)).unwrap();
    let (mut visited, mut worst) = (Vec::<Vec<Image>>::new(), 0.0f64);
    for time_s in times_s {
        scene.set_time(*time_s);
        follower.set_pose(&scene).unwrap();
        follower.cut();
        follower.render(&scene.camera).unwrap();
        let (mut fresh, _) =
            Renderer::new(gpu, &scene, case.entry, &settings, frame(24, 16, 64)).unwrap();
        fresh.render(&scene.camera).unwrap();
        let (followed, expected) = (pictures(&follower), pictures(&fresh));
        // Tiles that held light before are touched too, and a store that was large stays so.
        let [counts, fresh_counts] = [&follower, &fresh].map(|renderer| {
            let mut counts = renderer.counts().unwrap();
            counts.retain(|(name, _)| !["touched_tiles", "probe_room"].contains(name));
            counts.sort_unstable();
            counts
        });
        assert_eq!(counts, fresh_counts, "{what}, {time_s} s");
        for (index, (followed, expected)) in followed.iter().zip(&expected).enumerate() {
            let (difference, allowed) = (largest_difference(followed, expected), rounding(case));
            assert!(
                difference <= allowed,
                "{what}, {time_s} s: picture {index} differs by {difference}"
            );
            worst = larger(worst, difference);
        }
        visited.push(followed);
    }
    scene.set_time(times_s[0]);
    follower.set_pose(&scene).unwrap();
    follower.cut();
    follower.render(&scene.camera).unwrap();
    let again = pictures(&follower);
    assert!(
        visited[0]
            .iter()
            .zip(&again)
            .all(|(first, again)| largest_difference(again, first) <= rounding(case)),
        "{what}: the second visit"
    );
    println!("{what}: a pixel differs by {worst:e} of the mean at most");
    assert!(
        case.entry.name == "none"
            || visited[0][2].pixels != visited[1][2].pixels
            || visited[0][5].pixels != visited[1][5].pixels,
        "{what}: the model has to change the light"
    );
}

/// With `voxelize_every` = 4 a move after long is followed at once, the next ones in the fourth
/// frame after it: until then light comes from where the model was. Then the picture is that of a
/// new renderer.
#[test]
fn models_are_voxelized_in_every_fourth_frame() {
    let gpu = gpu();
    let (_, light) = small_lights()[0];
    for case in default_cases_with("voxelize_every=4") {
        let mut scene = moving_room(Surfaces::Diffuse, light);
        let settings = case.settings(&[("resolution", "32"), ("voxelize_every", "4")]);
        let new = |scene: &Scene| {
            Renderer::new(&gpu, scene, case.entry, &settings, frame(24, 16, 64))
                .unwrap()
                .0
        };
        let name = case.name();
        let mut follower = new(&scene);
        let mut late = Vec::new();
        for (index, time_s) in [0.4, 1.0, 1.6, 2.0, 2.0, 2.0].into_iter().enumerate() {
            scene.set_time(time_s);
            follower.set_pose(&scene).unwrap();
            follower.cut();
            follower.render_again(&scene.camera).unwrap();
            let seen = pictures(&follower);
            let mut fresh = new(&scene);
            fresh.render(&scene.camera).unwrap();
            let off = largest_difference(&seen[2], &pictures(&fresh)[2]);
            late.push(off > rounding(&case));
            println!("{name}, frame {index}: indirect light is off by {off}");
        }
        assert_eq!(late, [false, true, true, true, false, false], "{name}");
    }
}

/// A pose that is told again costs nothing: neither the scene nor the structure is touched.
#[test]
fn models_that_stand_cost_nothing() {
    let gpu = gpu();
    let (_, light) = small_lights()[0];
    for case in default_cases() {
        let mut scene = moving_room(Surfaces::Diffuse, light);
        let settings = case.settings(&[("resolution", "16")]);
        let (mut renderer, _) =
            Renderer::new(&gpu, &scene, case.entry, &settings, frame(24, 16, 64)).unwrap();
        scene.set_time(0.4);
        assert!(renderer.set_pose(&scene).is_ok());
        renderer.render(&scene.camera).unwrap();
        gpu.take_journal();
        let stats = renderer.set_pose(&scene).unwrap();
        let work = gpu.take_journal();
        assert!(
            stats.passes.is_empty() && stats.host == Default::default() && work.is_empty(),
            "{}",
            case.name()
        );
    }
}

/// A model that comes into a room does not take its bounces away: the first frame after is near the
/// converged one, and far from one bounce.
#[test]
fn feedback_goes_on_after_a_move() {
    let gpu = gpu();
    let (_, light) = small_lights()[0];
    for case in default_cases_with("bounces=feedback") {
        let mut scene = moving_room(Surfaces::Diffuse, light);
        let settings = case.settings(&[("resolution", "32"), ("bounces", "feedback")]);
        scene.set_time(2.0);
        let (mut renderer, _) =
            Renderer::new(&gpu, &scene, case.entry, &settings, frame(24, 16, 64)).unwrap();
        let light_after = |renderer: &mut Renderer<'_>, scene: &Scene, frames: u32| {
            (0..frames).for_each(|_| drop(renderer.render(&scene.camera).unwrap()));
            renderer
                .aov(Aov::Indirect)
                .unwrap()
                .pixels
                .iter()
                .map(|pixel| f64::from(pixel.y))
                .sum::<f64>()
        };
        light_after(&mut renderer, &scene, 12);
        scene.set_time(1.0);
        renderer.set_pose(&scene).unwrap();
        let first = light_after(&mut renderer, &scene, 1);
        let converged = light_after(&mut renderer, &scene, 12);
        let (mut fresh, _) =
            Renderer::new(&gpu, &scene, case.entry, &settings, frame(24, 16, 64)).unwrap();
        let one_bounce = light_after(&mut fresh, &scene, 1);
        println!(
            "{}: {:.3} of the converged light after the move, {:.3} with one bounce",
            case.name(),
            first / converged,
            one_bounce / converged
        );
        // Whose first frame is at rest has no frames to lose.
        let lost = if (case.entry.frames_to_rest)(&settings) == 1 {
            0.4
        } else {
            1.0 - one_bounce / converged
        };
        assert!(
            (first / converged - 1.0).abs() < 0.5 * lost,
            "{}: {first}, {one_bounce}, {converged}",
            case.name()
        );
    }
}

/// Lights that have moved are seen in the next frame, bit for bit as by a renderer that was made
/// with them; also by a clipmap that keeps its light.
#[test]
fn moved_lights_are_those_of_a_new_renderer() {
    let gpu = gpu();
    for (name, light) in small_lights() {
        let scene = small_room(Surfaces::Diffuse, vec![light]);
        let mut moved = scene.clone();
        match &mut moved.lights[0] {
            Light::Point { position, .. } | Light::Spot { position, .. } => {
                *position += Vec3::new(0.3, -0.2, 0.2)
            }
            Light::Directional { direction, .. } => {
                *direction = (*direction + 0.3 * Vec3::X).normalize()
            }
        }
        for case in default_cases() {
            let settings = case.settings(&[("resolution", "32")]);
            let renderer = |scene: &Scene| {
                Renderer::new(&gpu, scene, case.entry, &settings, frame(24, 16, 64))
                    .unwrap()
                    .0
            };
            let [mut follower, mut fresh] = [renderer(&scene), renderer(&moved)];
            follower.render(&scene.camera).unwrap();
            let before = pictures(&follower);
            follower.move_lights(&moved).unwrap();
            for renderer in [&mut follower, &mut fresh] {
                renderer.render_again(&moved.camera).unwrap();
            }
            let (followed, expected) = (pictures(&follower), pictures(&fresh));
            assert!(
                followed == expected,
                "{}, {name}: the light before is left",
                case.name()
            );
            assert!(
                before != expected,
                "{}, {name}: the light has to change the picture",
                case.name()
            );
        }
    }
}
