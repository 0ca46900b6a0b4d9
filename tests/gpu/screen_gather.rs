//! Fewer pixels that gather, and pixels in another order, on the device: against the CPU oracle,
//! and what any of them must keep.

use crate::support::compare::Worst as _;
use crate::support::given::answer;
use crate::support::shown::{LIMITS, SIZE, Shown, TOLERANCE, compare, floors, places, room};
use crate::support::technique::{Case, Surfaces, default_cases, frame, small_lights, small_room};
use crate::support::{ValidatedGpu, gpu};
use glam::DVec4;
use lumivox::frame::Renderer;
use lumivox::gi::registry::find;
use lumivox::gi::shared::screen::oracle::{Judged, Picture, upsample};
use lumivox::render::Grid;

/// A pixel has the light of those that gather around it, on its own surface; where none shows that,
/// it gathers itself.
#[test]
fn coarse_pictures_are_the_oracles() {
    let gpu = gpu();
    for scale in [2, 4] {
        let pair = format!("gather_scale={scale}");
        let mut shown = Shown::new(&gpu, room(), &[&pair]);
        let camera = shown.camera;
        let now = shown.draw(&camera);
        let gathered = answer("noise", 0, SIZE);
        let grid = Grid::coarse(SIZE, scale);
        let coarse: Vec<_> = (0..grid.size[0] * grid.size[1])
            .map(|at| {
                let [x, y] = grid.pixel([at % grid.size[0], at / grid.size[0]]);
                let at = (y * SIZE[0] + x) as usize;
                now.seen[at].map(|seen| (seen, gathered[at].as_dvec4()))
            })
            .collect();
        let picture = Picture {
            size: grid.size,
            pixels: &coarse,
        };
        let mut left = 0;
        let expected: Vec<_> = places()
            .enumerate()
            .map(|(at, pixel)| {
                let judged = upsample(pixel, now.seen[at].as_ref()?, &picture, (scale, LIMITS));
                left += usize::from(judged.value.is_none());
                Some(Judged {
                    value: judged.value.unwrap_or(gathered[at].as_dvec4()),
                    least_margin: judged.least_margin,
                })
            })
            .collect();
        let (difference, clear) = compare(&now.light, &expected);
        println!("{scale}: off by {difference:.1e}, clear {clear:.3}, {left} pixels gather apart");
        assert!(difference <= TOLERANCE, "{scale}: off by {difference}");
        assert!(clear > 0.9 && left > 20, "{scale}: {clear}, {left}");
    }
}

/// A ramp stays one, and nothing crosses a step.
#[test]
fn coarse_pictures_keep_ramps_and_steps() {
    let gpu = gpu();
    let pairs = ["gather_scale=4", "answer=ramp"];
    let mut shown = Shown::new(&gpu, floors(0.0, 0.0), &pairs);
    let camera = shown.camera;
    let now = shown.draw(&camera);
    let inside = |[x, y]: [u32; 2]| (4..SIZE[0] - 4).contains(&x) && (4..SIZE[1] - 4).contains(&y);
    let ramp = answer("ramp", 0, SIZE);
    for (at, _) in places().enumerate().filter(|(_, pixel)| inside(*pixel)) {
        let off = (now.light[at] - ramp[at].as_dvec4()).abs();
        assert!(off.to_array().into_iter().worst() < 1e-3, "{at}: {off}");
    }
    let mut shown = Shown::new(&gpu, floors(0.3, 0.0), &["gather_scale=2", "answer=marks"]);
    let camera = shown.camera;
    let now = shown.draw(&camera);
    let mixed = |light: &&DVec4| light.x > 1e-6 && light.x < 1.0 - 1e-6;
    assert_eq!(now.light.iter().filter(mixed).count(), 0);
}

/// Pictures of the technique's answer, of two sizes one after the other.
fn pictures(gpu: &ValidatedGpu, technique: &str, pairs: &[&str]) -> Vec<Vec<DVec4>> {
    let scene = small_room(Surfaces::Diffuse, vec![small_lights()[0].1]);
    let entry = find(technique).unwrap();
    let settings = entry.settings(None, pairs).unwrap();
    let frame = frame(45, 31, 64);
    let (mut renderer, _) = Renderer::new(gpu, &scene, entry, &settings, frame).unwrap();
    let mut picture = |size| {
        renderer.set_size(size);
        renderer.render(&scene.camera).unwrap();
        let found = renderer.indirect_light().unwrap();
        let rgb = found.irradiance.pixels.iter().map(|rgb| rgb.as_dvec3());
        rgb.zip(&found.visibility)
            .map(|(rgb, open)| rgb.extend(f64::from(*open)))
            .collect()
    };
    vec![picture([45, 31]), picture([23, 17])]
}

/// In parts, each pixel gathers along the same directions as in the picture's order.
#[test]
fn split_pictures_are_the_same() {
    let gpu = gpu();
    for pairs in [
        &["interleave=4"][..],
        &["interleave=3", "interleave_rows=2", "history=8"],
        &["interleave=5", "gather=rays", "rays=1", "gather_scale=2"],
    ] {
        let of = |order: &str| {
            let order = format!("interleave_order={order}");
            pictures(
                &gpu,
                "voxel-mips",
                &[pairs, &["resolution=32", &order]].concat(),
            )
        };
        assert!(of("split") == of("picture"), "{pairs:?}");
    }
}

/// Where lights are told to move and do not, pixels of the frame before gather the same again, bit
/// by bit, and history stays.
#[test]
fn what_has_not_changed_is_kept() {
    let gpu = gpu();
    let scene = small_room(Surfaces::Diffuse, vec![small_lights()[0].1]);
    let best = Case {
        entry: find("lpv").unwrap(),
        preset: Some("best"),
    };
    for case in default_cases().into_iter().chain([best]) {
        let settings = case.settings(&[("history", "8"), ("resolution", "16")]);
        let (mut renderer, _) =
            Renderer::new(&gpu, &scene, case.entry, &settings, frame(40, 30, 64)).unwrap();
        for number in 0..6u32 {
            if number == 4 {
                renderer.move_lights(&scene).unwrap();
            }
            let mut camera = scene.camera;
            camera.eye.x += 0.003 * number as f32;
            renderer.render(&camera).unwrap();
        }
        let weights = renderer.history().unwrap().unwrap().pixels;
        let kept = weights.iter().filter(|weight| weight.x > 0.0);
        let whole = kept.clone().filter(|weight| weight.x >= 0.99 * weight.y);
        let (whole, kept) = (whole.count(), kept.count());
        assert!(kept > 600 && whole == kept, "{case:?}: {whole} of {kept}");
    }
}

/// Light that is added apart is added once, however many frames the rest weighs.
#[test]
fn light_apart_does_not_pile_up() {
    let gpu = gpu();
    let scene = small_room(Surfaces::Emissive, vec![small_lights()[0].1]);
    let entry = find("voxel-mips").unwrap();
    for blur in ["blur=off", "blur=even"] {
        let pairs = ["resolution=32", "shadows=cones", "history=16", blur];
        let settings = entry.settings(None, &pairs).unwrap();
        let (mut renderer, _) =
            Renderer::new(&gpu, &scene, entry, &settings, frame(40, 30, 64)).unwrap();
        let mut means = (0..8).map(|_| {
            renderer.render(&scene.camera).unwrap();
            let pixels = renderer.indirect_light().unwrap().irradiance.pixels;
            pixels.iter().map(|rgb| f64::from(rgb.y)).sum::<f64>() / pixels.len() as f64
        });
        let (first, last) = (means.next().unwrap(), means.last().unwrap());
        assert!(
            first > 0.05 && (last / first - 1.0).abs() < 0.05,
            "{blur}: {first}, {last}"
        );
    }
}
