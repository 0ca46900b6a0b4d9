//! Light of earlier frames and of neighbours on the device: against the CPU oracles, and what any
//! such stage must keep.

use crate::support::compare::Worst as _;
use crate::support::given::answer;
use crate::support::shown::{
    Frame, LIMITS, SIZE, Shown, TOLERANCE, compare, floors, nudged, places, room,
};
use crate::support::technique::{Builder, Surfaces, small_lights, small_room};
use crate::support::{Random, gpu};
use glam::{DVec2, DVec3, DVec4, Vec3, Vec4};
use lumivox::gi::registry::find;
use lumivox::gi::shared::interleave::Pattern;
use lumivox::gi::shared::screen::oracle::{
    Judged, KeptPixel, Moved, Picture, Terms, a_trous, adaptive_radius, blur, history, relight,
    unchanged, variance,
};
use lumivox::render::Grid;
use lumivox::scene::Camera;

/// A frame that was drawn, and what it was drawn with.
struct Drawn {
    camera: Camera,
    frame: Frame,
    gathered: Vec<Vec4>,
    /// The pixels that gather again in the next frame.
    sparse: Grid,
}

impl Drawn {
    fn kept(&self, at: usize) -> Option<KeptPixel> {
        Some(KeptPixel {
            seen: self.frame.seen[at]?,
            light: self.frame.light[at],
            weights: [self.frame.weight[at], self.frame.visibility_weight[at]],
        })
    }

    /// How light has changed in each tile, where `now` is gathered along the same
    /// directions.
    fn changes(&self, now: &[Vec4]) -> Vec<(DVec3, f64)> {
        let [width, height] = self.sparse.size;
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        let pixels: Vec<_> = texels
            .clone()
            .map(|texel| {
                let [x, y] = self.sparse.pixel(self.sparse.place(texel));
                let at = (y * SIZE[0] + x) as usize;
                (self.frame.seen[at].is_some() && !self.frame.has_moved[at])
                    .then(|| [self.gathered[at], now[at]].map(|light| light.truncate().as_dvec3()))
            })
            .collect();
        let picture = Picture {
            size: self.sparse.size,
            pixels: &pixels,
        };
        texels.map(|texel| relight(texel, &picture)).collect()
    }

    /// The same at a place of the picture (px), and how far in a tile that is.
    fn change_at(&self, changes: &[(DVec3, f64)], place: DVec2) -> ((DVec3, f64), f64) {
        let tile = place / f64::from(self.sparse.step);
        let last = self.sparse.size.map(|size| size - 1);
        let at = (tile.as_uvec2()).min(last.into());
        let off = (tile - tile.round()).abs();
        let change = changes[(at.y * self.sparse.size[0] + at.x) as usize];
        (change, off.min_element())
    }
}

#[test]
fn each_frame_is_the_oracles() {
    for pairs in [
        &["history=6"] as &[&str],
        &["history=6", "material_test=on"],
    ] {
        frames_are_the_oracles(pairs);
    }
}

fn frames_are_the_oracles(pairs: &[&str]) {
    let gpu = gpu();
    let mut shown = Shown::new(&gpu, room(), pairs);
    let mut random = Random::new(11);
    let mut before: Option<Drawn> = None;
    let (mut worst, mut least_clear, mut most_kept) = (0.0f64, 1.0f64, 0.0f64);
    let mut most_turned = 0;
    for number in 0..12u32 {
        let is_posed = [3, 5, 9, 10].contains(&number);
        match number {
            _ if is_posed => shown.pose(0.4 * number as f32),
            1 | 4 | 7 => shown.camera = nudged(&shown.camera, &mut random, 0.1),
            8 => shown.camera = nudged(&shown.camera, &mut random, 0.6),
            _ => {}
        }
        let seen_from = before.as_ref().map_or(shown.camera, |drawn| drawn.camera);
        let now = shown.draw(&seen_from);
        let gathered = answer("noise", number, SIZE);
        let kept: Vec<Option<KeptPixel>> = (0..gathered.len())
            .map(|at| before.as_ref().and_then(|drawn| drawn.kept(at)))
            .collect();
        let picture = Picture {
            size: SIZE,
            pixels: &kept,
        };
        let changes = before.as_ref().map(|drawn| drawn.changes(&gathered));
        let of = |at: usize| {
            let moved = before.as_ref().and(now.moved[at].as_ref());
            let mut terms = Terms {
                factor: DVec3::ONE,
                unchanged: f64::INFINITY,
                longest: 6.0,
            };
            let mut in_tile = f64::INFINITY;
            if let (true, Some(drawn), Some(changes), Some(moved)) =
                (is_posed, &before, &changes, moved)
            {
                let ((factor, change), inside) = drawn.change_at(changes, moved.place);
                (terms.factor, terms.unchanged) = (factor, unchanged(change, 0.3));
                in_tile = inside;
            }
            let light = gathered[at].as_dvec4();
            now.seen[at].map(|seen| {
                let judged = history(&seen, light, moved, &picture, (LIMITS, terms));
                Judged {
                    least_margin: judged.least_margin.min(in_tile),
                    ..judged
                }
            })
        };
        let expected: Vec<_> = (0..gathered.len()).map(of).collect();
        let part = |part: fn((DVec4, [f64; 2])) -> DVec4| -> Vec<_> {
            let part = |judged: Judged<_>| Judged {
                value: part(judged.value),
                least_margin: judged.least_margin,
            };
            expected.iter().map(|judged| judged.map(part)).collect()
        };
        let lights = part(|(light, _)| light);
        let weights = part(|(_, [light, visibility])| DVec4::new(light, visibility, 0.0, 0.0));
        let found: Vec<DVec4> = (now.weight.iter().zip(&now.visibility_weight))
            .map(|(light, visibility)| DVec4::new(*light, *visibility, 0.0, 0.0))
            .collect();
        let ((light_off, clear), (weight_off, _)) =
            (compare(&now.light, &lights), compare(&found, &weights));
        let kept = now.weight.iter().filter(|weight| **weight > 1.5).count() as f64;
        println!(
            "frame {number}: light {light_off:.1e}, weight {weight_off:.1e}, clear {clear:.3}, \
             with history {:.3}",
            kept / now.weight.len() as f64
        );
        worst = worst.max(light_off).max(weight_off);
        least_clear = least_clear.min(clear);
        most_kept = most_kept.max(kept / now.weight.len() as f64);
        let turned = |moved: &&Moved| moved.turned.is_some();
        most_turned = most_turned.max(now.moved.iter().flatten().filter(turned).count());
        let at = number * Pattern::of([4, 4]).stride() % 16;
        before = Some(Drawn {
            camera: shown.camera,
            frame: now,
            gathered,
            sparse: Grid::whole(SIZE).sparse(4, [at % 4, at / 4]),
        });
    }
    assert!(worst <= TOLERANCE, "off by {worst}");
    assert!(
        least_clear > 0.9 && most_kept > 0.8 && most_turned > 50,
        "{least_clear}, {most_kept}, {most_turned}"
    );
}

/// On one plane, where two materials meet: light of the other is not kept. The share of pixels with
/// full history tells, while the camera moves by a quarter of a pixel.
#[test]
fn light_of_another_material_is_not_kept() {
    let gpu = gpu();
    let young = |pairs: &[&str]| -> usize {
        let mut shown = Shown::new(&gpu, floors(0.0, 0.0), pairs);
        let mut before = shown.camera;
        let mut count = 0;
        for number in 0..4 {
            let aside = 0.25 * 8.0 / SIZE[0] as f32 * number as f32 * Vec3::X;
            shown.camera.eye = Vec3::new(0.0, 4.0, 0.0) + aside;
            shown.camera.target = aside;
            let drawn = shown.draw(&before);
            before = shown.camera;
            let is_in_doubt = |weight: &&f64| **weight < f64::from(number) + 0.5;
            count += drawn.weight.iter().filter(is_in_doubt).count();
        }
        count
    };
    let (off, on) = (
        young(&["history=6"]),
        young(&["history=6", "material_test=on"]),
    );
    println!("{off} and {on} pixels with less than all history");
    assert!(on > off + SIZE[1] as usize / 2, "{off}, {on}");
}

/// What the oracle makes of the light of a frame: a mean along rows, then along columns.
fn blurred(now: &Frame, light: &[DVec4], radius: f64) -> Vec<Option<Judged<DVec4>>> {
    let along = |axis: usize, of: &dyn Fn(usize) -> DVec4| -> Vec<Option<Judged<DVec4>>> {
        let pixels: Vec<_> = (0..light.len())
            .map(|at| now.seen[at].map(|seen| (seen, of(at))))
            .collect();
        let picture = Picture {
            size: SIZE,
            pixels: &pixels,
        };
        places()
            .enumerate()
            .map(|(at, pixel)| now.seen[at].map(|_| blur(pixel, axis, radius, &picture, LIMITS)))
            .collect()
    };
    let rows = along(0, &|at| light[at]);
    let columns = along(1, &|at| rows[at].map_or(DVec4::ZERO, |judged| judged.value));
    // A decision of the rows is in all pixels of a column.
    let reach = (radius + 0.5) as usize;
    let width = SIZE[0] as usize;
    (0..columns.len())
        .map(|at| {
            let of_rows = (0..=2 * reach)
                .filter_map(|step| (at + step * width).checked_sub(reach * width))
                .filter_map(|at| rows.get(at).copied().flatten())
                .map(|judged| judged.least_margin);
            let lesser = |a: f64, b: f64| if b < a { b } else { a };
            let least = of_rows.fold(f64::INFINITY, lesser);
            columns[at].map(|judged| Judged {
                least_margin: judged.least_margin.min(least),
                ..judged
            })
        })
        .collect()
}

#[test]
fn blurs_are_the_oracles() {
    let gpu = gpu();
    for (pairs, radius) in [
        (&["blur=even", "blur_radius=3"][..], 3.0),
        (&["blur=even", "blur_radius=0.5"], 0.5),
        (
            &["blur=adaptive", "blur_radius=8"],
            adaptive_radius(8.0, 256.0),
        ),
    ] {
        let mut shown = Shown::new(&gpu, room(), pairs);
        let camera = shown.camera;
        let now = shown.draw(&camera);
        let gathered = answer("noise", 0, SIZE);
        let gathered: Vec<DVec4> = gathered.iter().map(|light| light.as_dvec4()).collect();
        let expected = blurred(&now, &gathered, radius);
        let (difference, clear) = compare(&now.light, &expected);
        println!("{pairs:?}: off by {difference:.1e}, clear {clear:.3}");
        assert!(difference <= TOLERANCE, "{pairs:?}: off by {difference}");
        assert!(clear > 0.7, "{pairs:?}: {clear}");
    }
}

/// Light that one pixel gathers alone, without a window and without history, is blurred too.
#[test]
fn raw_cones_are_blurred() {
    let gpu = gpu();
    let raw = ["resolution=32", "gather=cones", "interleave=1"];
    let scene = small_room(Surfaces::Diffuse, vec![small_lights()[0].1]);
    let draw = |more: &[&str]| {
        let entry = find("voxel-mips").unwrap();
        let mut shown = Shown::by(entry, &gpu, scene.clone(), &[&raw[..], more].concat());
        let camera = shown.camera;
        let now = shown.draw(&camera);
        let stats = shown.renderer.render(&camera).unwrap();
        (now, stats.passes)
    };
    let (alone, _) = draw(&[]);
    let (now, passes) = draw(&["blur=even", "blur_radius=3"]);
    let has = |name| passes.iter().any(|pass| pass.name == name);
    assert!(has("cone.gather") && has("screen.blur"));
    assert!(!has("gi.deinterleave") && !has("screen.history"));
    let expected = blurred(&alone, &alone.light, 3.0);
    let brightest = alone.light.iter().map(|light| light.max_element()).worst();
    let (difference, clear) = compare(&now.light, &expected);
    let (unblurred, _) = compare(&alone.light, &expected);
    println!("off by {difference:.1e} of {brightest:.2}, clear {clear:.3}");
    assert!(difference <= TOLERANCE * brightest, "off by {difference}");
    assert!(
        clear > 0.7 && unblurred > 0.01 * brightest,
        "{clear}, {unblurred}"
    );
}

/// Without history there is none, and the first frame with it is as without; so are those after a
/// cut and after a change of size.
#[test]
fn first_frames_are_as_without_history() {
    let gpu = gpu();
    let with = |pairs: &[&str]| {
        let mut shown = Shown::new(&gpu, room(), pairs);
        let mut lights = Vec::new();
        for number in 0..6 {
            if number == 2 {
                shown.renderer.cut();
            }
            if number == 4 {
                shown.renderer.set_size([SIZE[0] - 9, SIZE[1] - 3]);
            }
            shown.renderer.render(&shown.camera).unwrap();
            lights.push(shown.light());
        }
        lights
    };
    let (off, on) = (with(&["blur=even"]), with(&["history=32", "blur=even"]));
    for number in 0..6 {
        let is_first = number % 2 == 0;
        assert_eq!(off[number] == on[number], is_first, "frame {number}");
    }
}

/// n frames of what stands still come to their mean, until history weighs as much as it may.
#[test]
fn still_frames_come_to_their_mean() {
    let gpu = gpu();
    let mut shown = Shown::new(&gpu, room(), &["history=5", "answer=number"]);
    let mut expected = 0.0;
    for number in 0..9 {
        let camera = shown.camera;
        let now = shown.draw(&camera);
        let weight = f64::from((number + 1).min(5));
        expected += (f64::from(number) - expected) / weight;
        for at in 0..now.light.len() {
            if now.seen[at].is_some() {
                let (light, found) = (now.light[at], now.weight[at]);
                let off = (light - DVec4::splat(expected)).abs();
                assert!(
                    off.to_array().into_iter().worst() < 1e-5,
                    "{light}, {expected}"
                );
                assert!((found - weight).abs() < 1e-5, "{found}, {weight}");
            }
        }
    }
}

/// After lights have moved, what was seen before weighs little in one frame, where nothing says by
/// how much light has changed; where it has not, it weighs as before; and visibility does always.
#[test]
fn history_is_doubted_where_lights_move() {
    let gpu = gpu();
    let weights = |pairs: &[&str]| -> Vec<[f64; 2]> {
        let mut shown = Shown::new(&gpu, room(), &[pairs, &["history=32"]].concat());
        let camera = shown.camera;
        let mut draw = |number| {
            if number == 4 {
                shown.renderer.move_lights(&shown.scene).unwrap();
            }
            let now = shown.draw(&camera);
            let seen = |of: &Vec<f64>| of.iter().copied().worst();
            [seen(&now.weight), seen(&now.visibility_weight)]
        };
        (0..6).map(&mut draw).collect()
    };
    let all = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(|frames| [frames; 2]);
    assert_eq!(weights(&["answer=one"]), all);
    let mut doubted = all;
    (doubted[4][0], doubted[5][0]) = (4.0, 5.0);
    assert_eq!(weights(&["relight_tile=0"]), doubted);
    // All of it is brighter by one factor, which history is given too.
    assert_eq!(weights(&["answer=number"]), all);
}

/// Where all light changes by one factor, the next frame shows all of the change.
#[test]
fn dimmed_light_is_dimmed_at_once() {
    let gpu = gpu();
    let mut shown = Shown::new(&gpu, room(), &["history=32", "answer=number"]);
    let camera = shown.camera;
    for number in 0..6u32 {
        if number == 5 {
            shown.renderer.move_lights(&shown.scene).unwrap();
        }
        let now = shown.draw(&camera);
        // The mean of 0 to 4 is 2, and 5/4 of it is 2.5: (5 · 2.5 + 5) / 6.
        let expected = if number == 5 {
            17.5 / 6.0
        } else {
            f64::from(number) / 2.0
        };
        for at in (0..now.light.len()).filter(|at| now.seen[*at].is_some()) {
            assert!(
                (now.light[at].x - expected).abs() < 1e-4,
                "{number}: {}",
                now.light[at]
            );
        }
    }
}

/// Light that is the same everywhere stays so, whatever moves; and what is no number is gone in the
/// next frame.
#[test]
fn constants_stay_and_no_number_does() {
    let gpu = gpu();
    for (kind, blur) in [
        ("one", "adaptive"),
        ("no-number", "adaptive"),
        ("no-number", "a-trous"),
    ] {
        let pairs = [
            &format!("answer={kind}"),
            "history=16",
            &format!("blur={blur}"),
        ];
        let mut shown = Shown::new(&gpu, room(), &pairs);
        let mut random = Random::new(2);
        for number in 0..6 {
            if number > 3 {
                shown.camera = nudged(&shown.camera, &mut random, 0.1);
                shown.pose(0.3 * number as f32);
            }
            let camera = shown.camera;
            let now = shown.draw(&camera);
            for at in (0..now.light.len()).filter(|at| now.seen[*at].is_some()) {
                let off = (now.light[at] - DVec4::ONE).abs();
                assert!(
                    off.to_array().into_iter().worst() < 1e-6,
                    "{kind}, frame {number}: {}",
                    now.light[at]
                );
            }
        }
    }
}

/// Nothing crosses a step of two footprints or a crease of 30°; .4 of a footprint may be crossed.
#[test]
fn steps_and_creases_are_not_crossed() {
    let gpu = gpu();
    // Height of a pixel on the floor.
    let footprint_m = 4.0 * 2.0 * 20f32.to_radians().tan() / SIZE[1] as f32;
    let crossed = |height_m: f32, slope: f32| {
        let scene = floors(height_m, slope);
        let mut shown = Shown::new(&gpu, scene, &["answer=marks", "blur=even", "history=8"]);
        let camera = shown.camera;
        shown.draw(&camera);
        let now = shown.draw(&camera);
        let mixed = |light: &&DVec4| light.x > 1e-6 && light.x < 1.0 - 1e-6;
        now.light.iter().filter(mixed).count()
    };
    assert_eq!(crossed(2.0 * footprint_m, 0.0), 0);
    assert_eq!(crossed(0.0, 30f32.to_radians().tan()), 0);
    assert!(crossed(0.4 * footprint_m, 0.0) > 100);
    assert!(crossed(0.0, 0.0) > 100);
}

/// A linear ramp across a plane stays where it is.
#[test]
fn ramps_stay_where_they_are() {
    let gpu = gpu();
    let mut shown = Shown::new(&gpu, floors(0.0, 0.0), &["answer=ramp", "blur=even"]);
    let camera = shown.camera;
    let now = shown.draw(&camera);
    let ramp = answer("ramp", 0, SIZE);
    let is_inside = |[x, y]: [u32; 2]| {
        let inside = |at: u32, size: u32| (8..size - 8).contains(&at);
        inside(x, SIZE[0]) && inside(y, SIZE[1])
    };
    for (at, _) in places().enumerate().filter(|(_, pixel)| is_inside(*pixel)) {
        let off = (now.light[at] - ramp[at].as_dvec4()).abs();
        assert!(off.to_array().into_iter().worst() < 1e-3, "{at}: {off}");
    }
}

/// A wall that is seen at 5° keeps its history while the camera moves along it.
#[test]
fn walls_seen_at_a_grazing_angle_keep_their_history() {
    let gpu = gpu();
    let mut builder = Builder::default();
    let wall = builder.matte("wall", Vec3::splat(0.5));
    builder.quad(
        wall,
        Vec3::new(-1.0, -60.0, -600.0),
        Vec3::Z * 620.0,
        Vec3::Y * 120.0,
    );
    let camera = Camera {
        eye: Vec3::ZERO,
        target: Vec3::new(-5f32.to_radians().tan(), 0.0, -1.0),
        up: Vec3::Y,
        vfov_deg: 6.0,
    };
    let scene = builder.finish("wall", Vec::new(), Vec3::ZERO, camera);
    let mut shown = Shown::new(&gpu, scene, &["history=32"]);
    for number in 0..8 {
        let before = shown.camera;
        if number > 0 {
            let step = 0.05 * Vec3::NEG_Z;
            (shown.camera.eye, shown.camera.target) = (before.eye + step, before.target + step);
        }
        let now = shown.draw(&before);
        let inside = now.moved.iter().zip(&now.weight).filter(|(moved, _)| {
            moved.is_some_and(|moved| {
                let size = DVec2::from(SIZE.map(f64::from));
                moved.place.cmpge(DVec2::ONE).all() && moved.place.cmple(size - 1.0).all()
            })
        });
        let (mut kept, mut all) = (0, 0);
        for (_, weight) in inside {
            all += 1;
            kept += usize::from(number == 0 || *weight > f64::from(number) * 0.5 + 0.9);
        }
        assert!(all > 1000 && kept == all, "frame {number}: {kept} of {all}");
    }
}

/// Noise without history: variance of neighbours, then three levels.
#[test]
fn a_trous_levels_are_the_oracles() {
    let gpu = gpu();
    let mut shown = Shown::new(&gpu, room(), &["blur=a-trous"]);
    let camera = shown.camera;
    let now = shown.draw(&camera);
    let seen = |light: &dyn Fn(usize) -> DVec4| -> Vec<_> {
        (0..now.seen.len())
            .map(|at| now.seen[at].map(|seen| (seen, light(at))))
            .collect()
    };
    let gathered = answer("noise", 0, SIZE);
    let mut pixels = seen(&|at| gathered[at].as_dvec4());
    // A decision is in all pixels that a level reaches, so only those far from one are compared.
    let mut margins: Vec<f64> = Vec::new();
    let mut variances: Vec<f64> = Vec::new();
    for (at, pixel) in places().enumerate() {
        let picture = Picture {
            size: SIZE,
            pixels: &pixels,
        };
        let judged = variance(pixel, &picture, LIMITS);
        variances.push(now.seen[at].map_or(0.0, |_| judged.value));
        margins.push(judged.least_margin);
    }
    let mut lights = Vec::new();
    for level in 0..3 {
        let picture = Picture {
            size: SIZE,
            pixels: &pixels,
        };
        let judged: Vec<_> = places()
            .map(|pixel| a_trous(pixel, 1 << level, (&picture, &variances), (LIMITS, 4.0)))
            .collect();
        for (at, judged) in judged.iter().enumerate() {
            margins[at] = margins[at].min(judged.least_margin);
            variances[at] = now.seen[at].map_or(0.0, |_| judged.value.1);
        }
        lights = judged.iter().map(|judged| judged.value.0).collect();
        pixels = seen(&|at| lights[at]);
    }
    let reach = 2 + 4 + 8 + 3;
    let least_around = |[x, y]: [u32; 2]| {
        let range = |at: u32, size: u32| at.saturating_sub(reach)..(at + reach + 1).min(size);
        let rows = range(y, SIZE[1]);
        let around = rows.flat_map(|y| range(x, SIZE[0]).map(move |x| (y * SIZE[0] + x) as usize));
        let lesser = |a: f64, b: f64| if b < a { b } else { a };
        around.map(|at| margins[at]).fold(f64::INFINITY, lesser)
    };
    let expected: Vec<_> = places()
        .enumerate()
        .map(|(at, pixel)| {
            now.seen[at].map(|_| Judged {
                value: lights[at],
                // Limits are reached in few pixels, but nearly all are within reach of one.
                least_margin: 100.0 * least_around(pixel),
            })
        })
        .collect();
    let (difference, clear) = compare(&now.light, &expected);
    println!("off by {difference:.1e}, clear {clear:.3}");
    assert!(difference <= TOLERANCE, "off by {difference}");
    assert!(clear > 0.3, "{clear}");
}
