//! `lumivox stress`: failure modes are measured, judged, and told as they are.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Output;

use crate::support::program::command;
use crate::support::{gpu, reference_cache};
use lumivox::frame::FrameSettings;
use lumivox::gi::registry::{TECHNIQUES, find};
use lumivox::graph::Gpu;
use lumivox::measure::bench::Case;
use lumivox::measure::stress::results::{Results, Worst, summary};
use lumivox::measure::stress::{CASES, Effort, Figured, Memo, Record, StressCase, Trial, Verdict};
use lumivox::render::ShadowSettings;
use lumivox::scene::Scene;

const FRAME: FrameSettings = FrameSettings {
    size: [48, 32],
    shadows: ShadowSettings::of_resolution(128),
};

/// Few steps, for figures that need no more.
const EFFORT: Effort = Effort {
    name: "test",
    steps: 4,
    frames: 6,
    spp: 64,
    frame_spp: 16,
};

fn stress(name: &str) -> &'static StressCase {
    CASES
        .iter()
        .copied()
        .find(|case| case.name == name)
        .unwrap()
}

fn case(technique: &str, preset: &str, pairs: &[&str]) -> Case {
    let entry = find(technique).unwrap();
    Case {
        entry,
        preset: Some(preset.into()),
        settings: entry.settings(Some(preset), pairs).unwrap(),
    }
}

fn record_in(
    gpu: &Gpu,
    stress: &StressCase,
    case: &Case,
    severity: f64,
    scene: Option<&Scene>,
) -> Record {
    let trial = Trial {
        gpu,
        entry: case.entry,
        settings: &case.settings,
        frame: FRAME,
        effort: &EFFORT,
        scene,
        memo: &Memo::new(reference_cache()),
    };
    stress.record(&trial, case, "", severity).unwrap()
}

fn record(gpu: &Gpu, stress: &StressCase, case: &Case, severity: f64) -> Record {
    record_in(gpu, stress, case, severity, None)
}

/// The first figure of a technique at a severity, and the verdict of all.
fn figure(
    gpu: &Gpu,
    name: &str,
    technique: &str,
    preset: &str,
    pairs: &[&str],
    severity: f64,
) -> (f64, Verdict) {
    let entry = find(technique).unwrap();
    let sized = entry.settings(None, &["resolution=32"]).is_ok();
    let size: &[&str] = if sized { &["resolution=32"] } else { &[] };
    let pairs = [size, pairs].concat();
    let record = record(
        gpu,
        stress(name),
        &case(technique, preset, &pairs),
        severity,
    );
    println!(
        "{name} at {severity}: {technique} {preset} {pairs:?}: {:?} {:?}",
        record.figures, record.failure
    );
    (record.figures[0].value.unwrap(), record.verdict().unwrap())
}

/// A wall one voxel thick holds the light with the best settings; box mips let it through, and more
/// the thinner it is.
#[test]
fn thin_walls_leak_where_they_must() {
    let gpu = gpu();
    let figure = |preset: &str, pairs: &[&str], severity: f64| {
        figure(&gpu, "thin_walls", "voxel-mips", preset, pairs, severity)
    };
    let best = [1.0, 4.0].map(|wall| figure("accurate", &[], wall));
    assert!(best.iter().all(|best| best.1 == Verdict::Pass), "{best:?}");
    let planted = [4.0, 0.25].map(|wall| figure("textbook", &[], wall));
    assert!(
        planted[1].1 != Verdict::Pass
            && planted[1].0 > planted[0].0
            && planted[1].0 > 10.0 * best[0].0,
        "{planted:?}"
    );
    // One radiance for both sides of a wall in one voxel shines through.
    let glowing = figure("accurate", &["radiance=isotropic"], 0.25);
    assert!(glowing.1 != Verdict::Pass, "{glowing:?}");
}

/// What the picture does not show is wrong in the picture's own answer alone, and so is the back of
/// what is thin.
#[test]
fn the_screen_fails_where_it_does_not_see() {
    let gpu = gpu();
    let pairs: &[&str] = &[];
    for (name, harmless, fatal) in [
        ("off_screen_occluder", None, 8.0),
        ("thin_occluder", Some(1.2), 0.1),
    ] {
        let of = |technique, preset, at| figure(&gpu, name, technique, preset, pairs, at);
        let screen = of("gtao", "default", fatal);
        assert!(screen.0 > 0.15, "{name}: {screen:?}");
        if let Some(harmless) = harmless {
            let solid = of("gtao", "default", harmless);
            assert!(
                solid.1 == Verdict::Pass && 2.0 * solid.0 < screen.0,
                "{solid:?}"
            );
        }
        let rays = of("ray-traced", "accurate", fatal);
        assert!(
            rays.1 == Verdict::Pass && 5.0 * rays.0 < screen.0,
            "{name}: {rays:?}"
        );
    }
}

/// Half floats keep the hue of dim light down to their smallest numbers, and rays at any level.
#[test]
fn dim_light_loses_its_hue_in_half_floats() {
    let gpu = gpu();
    let of = |technique, preset, at| figure(&gpu, "colour_banding", technique, preset, &[], at);
    assert_eq!(of("voxel-mips", "accurate", 1.0).1, Verdict::Pass);
    assert_eq!(of("voxel-mips", "accurate", 1e-6).1, Verdict::Fail);
    assert_eq!(of("ray-traced", "default", 1e-6).1, Verdict::Pass);
}

/// Samples of the papers' cones draw rings under a plate that hangs low; a high one none.
#[test]
fn rings_grow_under_a_low_plate() {
    let gpu = gpu();
    let of = |height| {
        figure(
            &gpu,
            "circular_bands",
            "voxel-mips",
            "textbook",
            &[],
            height,
        )
        .0
    };
    let [high, low] = [8.0, 3.0].map(of);
    assert!(high < 0.01 && low > high + 0.005, "{high}, {low}");
}

/// Where the scene lies in the grid, and how it is turned, matters more the coarser the voxels are;
/// the picture of a technique without light never changes.
#[test]
fn spreads_grow_with_voxels() {
    let gpu = gpu();
    for name in ["translation", "rotation"] {
        let [fine, coarse] =
            [1.5, 12.0].map(|grid| figure(&gpu, name, "voxel-mips", "accurate", &[], grid).0);
        assert!(
            fine > 1e-3 && fine < 0.5 && coarse > 1.5 * fine,
            "{name}: {fine}, {coarse}"
        );
    }
    let nothing = Case {
        entry: find("none").unwrap(),
        preset: None,
        settings: find("none").unwrap().settings::<&str>(None, &[]).unwrap(),
    };
    assert_eq!(
        record(&gpu, stress("translation"), &nothing, 12.0).figures[0].value,
        Some(0.0)
    );
}

/// Sums that do not depend on the order of threads give the same picture in every run, to the bit.
#[test]
fn repeated_runs_are_the_same() {
    assert_eq!(
        figure(&gpu(), "repeat_runs", "voxel-mips", "accurate", &[], 6.0),
        (0.0, Verdict::Pass)
    );
}

/// A scene of its own for each of what moves; what stands still does not flicker, and a technique
/// whose levels follow late lags behind.
#[test]
fn motion_is_held_against_the_references_own() {
    let gpu = gpu();
    let figures = |name: &str, technique: &str, pairs: &[&str], speed: f64| {
        let pairs = [&["resolution=32"], pairs].concat();
        let record = record(
            &gpu,
            stress(name),
            &case(technique, "textbook", &pairs),
            speed,
        );
        println!(
            "{name} at {speed}, {technique} {pairs:?}: {:?}",
            record.figures
        );
        let names: Vec<&str> = record
            .figures
            .iter()
            .map(|figure| figure.name.as_str())
            .collect();
        assert_eq!(names, ["flicker", "popping", "lag"]);
        record
            .figures
            .iter()
            .map(|figure| figure.value.unwrap())
            .collect::<Vec<f64>>()
    };
    for name in [
        "camera_pan",
        "camera_dolly",
        "moving_light",
        "moving_object",
    ] {
        assert_eq!(
            figures(name, "voxel-mips", &[], 0.0)[..2],
            [0.0; 2],
            "{name} at rest"
        );
        let moving = figures(name, "voxel-mips", &[], 0.8);
        assert!(
            moving[0] > 0.0 && moving[1] >= moving[0] && moving[1] < 1.0,
            "{name}: {moving:?}"
        );
        // It keeps nothing from one frame to the next.
        assert!(moving[2] < 1e-3, "{name}: {moving:?}");
    }
    let [prompt, staggered] = ["every-frame", "staggered"].map(|updates| {
        figures(
            "moving_light",
            "clipmap",
            &[&format!("level_updates={updates}"), "levels=3"],
            2.0,
        )[2]
    });
    assert!(
        prompt < 1e-3 && staggered > 10.0 * prompt.max(1e-4),
        "{prompt}, {staggered}"
    );
}

/// All figures of the preset with the fewest directions, with these settings.
fn fast(gpu: &Gpu, name: &str, pairs: &[&str], severity: f64) -> Vec<f64> {
    let pairs = [&["resolution=32"], pairs].concat();
    let record = record(
        gpu,
        stress(name),
        &case("voxel-mips", "fast", &pairs),
        severity,
    );
    println!(
        "{name} at {severity}, {pairs:?}: {:?} {:?}",
        record.figures, record.failure
    );
    let values = record.figures.iter().map(|figure| figure.value.unwrap());
    values.collect()
}

/// Light that changed is late where history keeps it whatever happens, less and less, earlier where
/// changes are looked for, and in time where nothing is kept.
#[test]
fn late_light_is_seen() {
    let gpu = gpu();
    for (name, severity) in [("light_switch", 0.0), ("light_jump", 0.25)] {
        let of = |pairs: &[&str]| fast(&gpu, name, pairs, severity);
        let off = of(&["history=0"]);
        assert!(off.iter().all(|late| *late < 1e-4), "{name}: {off:?}");
        let blind = of(&["history=32", "relight_tile=0"]);
        assert!(
            blind[0] > 0.2 && blind[0] > blind[1] && blind[1] > blind[2],
            "{name}: {blind:?}"
        );
        let looking = of(&["history=32"]);
        let is_earlier = blind.iter().zip(&looking).all(|(late, early)| early < late);
        assert!(is_earlier, "{name}: {looking:?}, {blind:?}");
    }
}

/// Light through a door that opens is there at once where nothing is kept, and late where history
/// keeps the dark.
#[test]
fn light_through_a_door_is_late_where_it_is_kept() {
    let gpu = gpu();
    let of = |pairs: &[&str]| fast(&gpu, "door_opens", pairs, 1.0);
    assert_eq!(of(&["history=0"]), [1.0, 1.0]);
    let kept = of(&["history=32", "relight_tile=0"]);
    assert!(kept[0] > 4.0 && kept[1] > kept[0], "{kept:?}");
}

/// Probes that nobody keeps out bring light through a wall wherever it stands; others do not, and
/// the side that surfaces face decides nothing.
#[test]
fn walls_and_sides_are_nothing_to_probes_that_are_kept_out() {
    let gpu = gpu();
    let of = |name: &str, visibility: &str, severity: f64| {
        let pairs = ["probes=6", "rays=64", visibility];
        let case = case("irradiance-probes", "default", &pairs);
        let record = record(&gpu, stress(name), &case, severity);
        println!("{name}, {visibility}: {:?}", record.figures);
        record.figures[0].value.unwrap()
    };
    let kept_out = of("wall_shift", "visibility=moments", 0.02);
    let all = of("wall_shift", "visibility=none", 0.02);
    assert!(kept_out < 0.01 && all > 0.05, "{kept_out}, {all}");
    let flipped = of("flipped_normals", "visibility=moments", 0.5);
    assert!(flipped < 0.01, "{flipped}");
}

/// Nothing of a fence's light stays on the wall behind it, however noisy it is; planted: where the
/// fence counts as part of the wall, it does.
#[test]
fn ghosts_are_seen() {
    let gpu = gpu();
    let of = |pairs: &[&str]| fast(&gpu, "ghost", pairs, 2.0)[0];
    assert_eq!(of(&["history=0"]), 0.0);
    let tested = of(&["history=32"]);
    let untested = of(&["history=32", "plane_tolerance=16", "interleave=1"]);
    assert!(tested < 0.15 && untested > 0.5, "{tested}, {untested}");
}

/// Bars of a pixel have more error than bars of eight, which history helps.
#[test]
fn thin_bars_are_worse() {
    let gpu = gpu();
    let of = |history: &str, width: f64| fast(&gpu, "thin_bars", &[history], width)[0];
    let (wide, thin) = (of("history=32", 8.0), of("history=32", 1.0));
    let without = of("history=0", 8.0);
    assert!(
        wide < thin && wide < 0.9 * without,
        "{wide}, {thin}, {without}"
    );
}

/// Details of many voxels are seen, details smaller than a voxel are not: each figure is larger
/// where it ought to be fatal.
#[test]
fn what_is_fatal_is_worse_than_what_is_harmless() {
    let gpu = gpu();
    let modes = [
        ("small_emitter", 16.0, 0.25),
        ("facing_surfaces", 8.0, 0.5),
        ("rsm_undersampling", 128.0, 8.0),
        ("one_voxel", 15.5, 0.25),
        ("narrow_gap", 8.0, 0.5),
        ("distant_gap", 2.0, 10.0),
        ("contrast", 1.0, 1e9),
    ];
    for (name, harmless, fatal) in modes {
        // Rays to points of lamps find them whatever their size.
        let pairs: &[&str] = &["emitters=gather"];
        let [harmless, fatal] = [harmless, fatal]
            .map(|severity| figure(&gpu, name, "voxel-mips", "accurate", pairs, severity).0);
        assert!(
            harmless.is_finite() && fatal > harmless,
            "{name}: {harmless}, {fatal}"
        );
    }
    // Not so where rays go to points of lamps, and stop in as much of a voxel as a column fills.
    for name in ["small_emitter", "thin_columns"] {
        let figure = figure(&gpu, name, "voxel-mips", "accurate", &[], 0.25);
        assert!(figure.1 == Verdict::Pass, "{name}: {figure:?}");
    }
}

/// Two sides of a partition in one voxel: apart if each has a radiance of its own, mixed if they
/// share one.
#[test]
fn opposed_normals_mix_where_sides_share_a_radiance() {
    let gpu = gpu();
    let figure = |pairs: &[&str], thickness: f64| {
        figure(
            &gpu,
            "opposed_normals",
            "voxel-mips",
            "accurate",
            pairs,
            thickness,
        )
    };
    let [thick, thin] = [4.0, 0.1].map(|thickness| figure(&["radiance=isotropic"], thickness).0);
    let apart = figure(&[], 0.1);
    assert!(
        apart.1 == Verdict::Pass && thin > 2.0 * apart.0 && thin > thick,
        "{apart:?}, {thick}, {thin}"
    );
}

/// One scene at another size, or in another light, is the same picture; a tenth of an error would
/// be seen.
#[test]
fn size_and_light_change_nothing() {
    let gpu = gpu();
    let figure =
        |name: &str, severity: f64| figure(&gpu, name, "voxel-mips", "cones", &[], severity).0;
    let plain = figure("scene_size", 1.0);
    assert!((figure("light_level", 1.0) - plain).abs() < 0.02 * plain);
    for (name, severity) in [
        ("scene_size", 0.01),
        ("scene_size", 100.0),
        ("light_level", 0.01),
        ("light_level", 100.0),
    ] {
        let other = figure(name, severity);
        assert!(
            (other - plain).abs() < 0.02,
            "{name} at {severity}: {other}, {plain}"
        );
    }
}

/// However one triangle is cut, it is the same ground; without any there is no light. Every
/// technique does both.
#[test]
fn few_and_many_triangles_and_none() {
    let gpu = gpu();
    for entry in TECHNIQUES.iter().filter(|entry| !entry.presets.is_empty()) {
        let cones = entry.presets.iter().find(|preset| preset.name == "cones");
        let preset = cones.unwrap_or(&entry.presets[0]).name;
        let one = figure(&gpu, "triangle_count", entry.name, preset, &[], 1.0);
        let many = figure(&gpu, "triangle_count", entry.name, preset, &[], 1e4);
        assert!(
            (one.0 - many.0).abs() < 0.02,
            "{}: {one:?}, {many:?}",
            entry.name
        );
        assert_eq!(
            figure(&gpu, "empty", entry.name, preset, &[], 0.0),
            (0.0, Verdict::Pass),
            "{}",
            entry.name
        );
    }
}

/// A case that takes any scene is measured on the one that it is given, and says so.
#[test]
fn scenes_of_ones_own_are_measured() {
    let gpu = gpu();
    let scene = Scene::bundled("glossy", &[]).unwrap();
    let mips = case("voxel-mips", "cones", &["resolution=32"]);
    let own = record_in(
        &gpu,
        stress("rsm_undersampling"),
        &mips,
        128.0,
        Some(&scene),
    );
    let other = record(&gpu, stress("rsm_undersampling"), &mips, 128.0);
    assert_eq!((own.scene.as_deref(), other.scene), (Some("glossy"), None));
    assert!(
        own.key != other.key && own.figures != other.figures,
        "{own:?}"
    );
}

/// Every row says all that a reader needs, and every change of every case is one that a technique
/// has, and nothing but it is changed.
#[test]
fn the_table_of_cases_is_whole() {
    let names: BTreeSet<&str> = CASES.iter().map(|case| case.name).collect();
    assert_eq!(names.len(), CASES.len());
    for case in CASES {
        assert!(
            !case.help.is_empty()
                && !case.source.is_empty()
                && !case.severity.is_empty()
                && !case.figures.is_empty(),
            "{}",
            case.name
        );
        assert!(
            !case.severities.is_empty()
                && case
                    .quick
                    .iter()
                    .all(|quick| case.severities.contains(quick)),
            "{}",
            case.name
        );
        assert!(
            case.figures.iter().all(|figure| figure.pass <= figure.warn),
            "{}",
            case.name
        );
    }
    let presets = TECHNIQUES.iter().flat_map(|entry| {
        let named = entry.presets.iter().map(|preset| Some(preset.name));
        named.chain([None]).map(move |preset| (*entry, preset))
    });
    for (stress, (entry, preset)) in CASES
        .iter()
        .flat_map(|stress| presets.clone().map(move |preset| (stress, preset)))
    {
        let settings = entry.settings::<&str>(preset, &[]).unwrap();
        let variants = stress.variants(entry, &settings).unwrap();
        assert!(variants[0] == (String::new(), settings.clone()));
        assert!(
            stress.name != "thin_walls" || settings.resolution().is_none() || variants.len() > 3,
            "{}: {} variants",
            entry.name,
            variants.len()
        );
        for (change, changed) in &variants[1..] {
            let differing: Vec<&str> = settings
                .iter()
                .zip(changed.iter())
                .filter(|(old, new)| old != new)
                .map(|(old, _)| old.0)
                .collect();
            assert!(
                matches!(differing[..], [name] if change.starts_with(&format!("{name}="))),
                "{}, {change}: {differing:?}",
                entry.name
            );
        }
        let unique: BTreeSet<&String> = variants.iter().map(|variant| &variant.0).collect();
        assert_eq!(unique.len(), variants.len());
    }
}

#[test]
fn verdicts_follow_the_thresholds() {
    let figure = stress("thin_walls").figures[0];
    let cases = [
        (0.0, Verdict::Pass),
        (figure.pass, Verdict::Pass),
        (1.01 * figure.pass, Verdict::Warn),
        (1.01 * figure.warn, Verdict::Fail),
    ];
    cases
        .iter()
        .for_each(|(value, verdict)| assert_eq!(figure.verdict(*value), *verdict));
    assert_eq!(
        [f64::NAN, f64::INFINITY].map(|value| figure.verdict(value)),
        [Verdict::Fail; 2]
    );
}

/// A planted figure is in the table, the CSV, the chart and the summary, in its own row and column;
/// what was refused and what is no number is told.
#[test]
fn what_is_measured_is_told() {
    let (gpu, stress) = (gpu(), stress("thin_walls"));
    let nothing = Case {
        entry: find("none").unwrap(),
        preset: None,
        settings: find("none").unwrap().settings::<&str>(None, &[]).unwrap(),
    };
    let without = record(&gpu, stress, &nothing, 1.0);
    assert_eq!(
        (without.figures[0].value, without.verdict()),
        (Some(0.0), Some(Verdict::Pass))
    );
    let leak = |value: Option<f64>, verdict| {
        vec![Figured {
            name: "leak".into(),
            value,
            verdict,
        }]
    };
    let planted = Record {
        change: "a=b".into(),
        figures: leak(Some(0.4321), Verdict::Fail),
        ..without.clone()
    };
    let refused = Record {
        severity: 0.5,
        figures: Vec::new(),
        failure: Some("too \"large\"".into()),
        ..planted.clone()
    };
    let infinite = Record {
        severity: 0.5,
        figures: leak(None, Verdict::Fail),
        failure: Some("leak is no finite number".into()),
        ..without.clone()
    };
    let leaky = Record {
        technique: "leaky".into(),
        figures: leak(Some(0.05), Verdict::Warn),
        ..without.clone()
    };
    let records = [without, planted, refused, infinite, leaky];
    let results = Results {
        case: stress,
        records: &records,
    };
    let table = results.table();
    assert!(
        table.contains(
            "| none | 0.0000 pass | ∞ fail |\n| none, `a=b` | 0.4321 fail | no figure |\n| leaky \
             | 0.0500 warn | – |"
        ),
        "{table}"
    );
    assert!(
        table.contains("none, `a=b` at 0.5: too \"large\"")
            && table.contains("none at 0.5: leak is no finite number"),
        "{table}"
    );
    let csv = results.csv();
    assert!(
        csv.contains("thin_walls,none,,,,a=b,1,0.4321,fail,,test,")
            && csv.contains("thin_walls,none,,,,a=b,0.5,,,\"too \"\"large\"\"\",test,"),
        "{csv}"
    );
    assert_eq!(csv.lines().count(), 6);
    let charts = results.charts();
    assert_eq!(
        charts
            .iter()
            .map(|chart| chart.0.as_str())
            .collect::<Vec<_>>(),
        ["", "-none"]
    );
    let [whole, changes] = [0, 1].map(|index: usize| charts[index].1.svg().unwrap());
    assert!(whole.contains("leaky") && !whole.contains("a=b") && whole.contains(stress.severity));
    assert!(changes.contains("a=b") && changes.contains("as it is"));
    let text = summary(&[results]);
    assert!(
        text.contains("| thin_walls | wall [voxels] | fail from 0.5 down | warn from 1 down |"),
        "{text}"
    );
}

/// "From" is said only if all that follows is as bad, with the figure there; else each bad severity
/// is named, with the worst figure of them.
#[test]
fn what_recovers_is_told_apart() {
    let record = |severity: f64, value: f64| {
        let figures = vec![Figured {
            name: "rel_rmse".into(),
            value: Some(value),
            verdict: stress("light_level").figures[0].verdict(value),
        }];
        Record {
            severity,
            figures,
            ..record(
                &gpu(),
                stress("light_level"),
                &case("voxel-mips", "cones", &["resolution=32"]),
                1.0,
            )
        }
    };
    let worst = |records: &[Record]| {
        Worst::of(stress("light_level"), records)
            .map(|worst| (worst.to_string(), worst.figure.1))
            .unwrap()
    };
    let low = [record(1e-4, 0.9), record(1.0, 0.1), record(1e5, 0.15)];
    assert_eq!(worst(&low), ("fail at 0.0001".into(), Some(0.9)));
    let both = [
        record(1e-4, 0.9),
        record(1.0, 0.1),
        record(1e4, 0.3),
        record(1e5, 1.5),
    ];
    assert_eq!(worst(&both), ("fail at 0.0001, 100000".into(), Some(1.5)));
    let high = [
        record(1.0, 0.1),
        record(1e2, 0.3),
        record(1e4, 0.7),
        record(1e5, 0.6),
    ];
    assert_eq!(worst(&high), ("fail from 10000 up".into(), Some(0.7)));
}

/// A preset with one change may be another preset: each has a record of its own. What the user set
/// is part of the name.
#[test]
fn rows_of_equal_settings_are_apart() {
    let gpu = gpu();
    let [cones, accurate] = ["cones", "accurate"]
        .map(|preset| case("voxel-mips", preset, &["resolution=32", "rays=4"]));
    let trial = Trial {
        gpu: &gpu,
        entry: cones.entry,
        settings: &cones.settings,
        frame: FRAME,
        effort: &EFFORT,
        scene: None,
        memo: &Memo::new(reference_cache()),
    };
    let keys: BTreeSet<String> = [(&cones, ""), (&accurate, ""), (&accurate, "gather=cones")]
        .map(|(case, change)| Record::key_of(stress("empty"), &trial, case, change, 0.0))
        .into();
    assert_eq!(keys.len(), 3);
    assert_eq!(
        stress("empty")
            .record(&trial, &accurate, "", 0.0)
            .unwrap()
            .case_name(),
        "voxel-mips accurate 32³ rays=4"
    );
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let small = [
        "stress",
        "--size",
        "32x24",
        "--shadow-resolution",
        "64",
        "--resolution",
        "32",
        "--quick",
        "--technique",
        "voxel-mips",
    ];
    let mut command = command();
    command
        .current_dir(folder)
        .env("LUMIVOX_CACHE", folder.join("cache"))
        .args(small)
        .args(arguments)
        .output()
        .unwrap()
}

/// The program writes what it measured, measures nothing twice, and measures a record that was cut
/// off again.
#[test]
fn a_second_run_is_served() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--case", "small_emitter,empty", "-o", "out"];
    let first = run(folder.path(), &arguments);
    assert!(
        first.status.success(),
        "{}",
        String::from_utf8_lossy(&first.stderr)
    );
    assert!(String::from_utf8_lossy(&first.stdout).contains("| empty | triangles | pass |"));
    let text = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    for name in [
        "small_emitter.csv",
        "small_emitter.svg",
        "small_emitter.md",
        "empty.jsonl",
        "stress.md",
    ] {
        assert!(!text(name).is_empty(), "{name}");
    }
    assert_eq!(
        image::open(folder.path().join("out/small_emitter.png"))
            .unwrap()
            .width(),
        1000
    );
    let records = text("small_emitter.jsonl");
    assert_eq!(records.lines().count(), 2);
    run(folder.path(), &arguments);
    assert_eq!(text("small_emitter.jsonl"), records);
    std::fs::write(
        folder.path().join("out/small_emitter.jsonl"),
        &records[..records.len() - 9],
    )
    .unwrap();
    run(folder.path(), &arguments);
    assert_eq!(text("small_emitter.jsonl"), records);
}

/// Tables are of all that the folder has of one setup, whoever measured it; folders are put
/// together by `--merge`.
#[test]
fn later_runs_add_to_the_tables() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let done = |output: Output| {
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        )
    };
    done(run(
        folder.path(),
        &[
            "--case",
            "empty,one_voxel,empty",
            "--preset",
            "cones",
            "-o",
            "out",
        ],
    ));
    let both = text("out/stress.md");
    assert!(
        both.contains("| case | gets worse with | voxel-mips cones 32³ |")
            && both.matches("| empty |").count() == 1,
        "{both}"
    );
    done(run(
        folder.path(),
        &[
            "--case", "empty", "--preset", "cones", "--set", "cones=6", "-o", "out",
        ],
    ));
    let added = text("out/stress.md");
    assert!(
        added.contains("| voxel-mips cones 32³ | voxel-mips cones 32³ cones=6 |\n")
            && added.contains("| one_voxel |"),
        "{added}"
    );
    assert_eq!(
        (
            text("out/empty.csv").lines().count(),
            text("out/one_voxel.csv").lines().count()
        ),
        (3, 3)
    );
    // Another setup has tables of its own.
    let other = [
        "stress",
        "--size",
        "32x24",
        "--shadow-resolution",
        "32",
        "--resolution",
        "32",
        "--quick",
        "--technique",
        "voxel-mips",
        "--case",
        "empty",
        "-o",
        "other",
    ];
    done(
        command()
            .current_dir(folder.path())
            .env("LUMIVOX_CACHE", folder.path().join("cache"))
            .args(other)
            .output()
            .unwrap(),
    );
    done(run(folder.path(), &["--merge", "out", "-o", "merged"]));
    assert_eq!(
        (text("merged/stress.md"), text("merged/one_voxel.csv")),
        (added.clone(), text("out/one_voxel.csv"))
    );
    done(run(
        folder.path(),
        &["--merge", "other", "out", "-o", "merged"],
    ));
    assert_eq!(text("merged/stress.md"), added);
    assert_eq!(text("merged/empty.jsonl").lines().count(), 3);
    // What is not there is told, and leaves nothing behind; what was not measured has no file.
    let nothing = run(
        folder.path(),
        &["--merge", "out", "absent", "-o", "nothing"],
    );
    assert!(
        nothing.status.code() == Some(2)
            && String::from_utf8_lossy(&nothing.stderr)
                .contains("no records (*.jsonl) of failure modes in absent")
    );
    assert!(
        !folder.path().join("nothing").exists()
            && !folder.path().join("merged/rotation.jsonl").exists()
    );
    // What a later build measured again takes its place, and both builds are named.
    let records = text("out/one_voxel.jsonl");
    let mut later: Record = serde_json::from_str(records.lines().next().unwrap()).unwrap();
    (later.key, later.setup.build, later.figures[0].value) =
        ("later".into(), "later".into(), Some(0.1234));
    std::fs::write(
        folder.path().join("out/one_voxel.jsonl"),
        format!("{records}{}\n", serde_json::to_string(&later).unwrap()),
    )
    .unwrap();
    done(run(folder.path(), &["--merge", "out", "-o", "again"]));
    assert!(
        text("again/one_voxel.md").contains("0.1234")
            && text("again/one_voxel.csv").lines().count() == 3,
        "{}",
        text("again/one_voxel.md")
    );
    assert!(
        text("again/stress.md").contains("lumivox 0.1.0 and 0.1.0 (later); 32×24 px"),
        "{}",
        text("again/stress.md")
    );
}

#[test]
fn wrong_arguments_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let cases: [(&[&str], &str); 5] = [
        (
            &["--case", "nonsense", "-o", "out"],
            "there is no failure mode nonsense; there are: thin_walls, wall_shift",
        ),
        (
            &["bundled:cornell", "--case", "thin_walls", "-o", "out"],
            "thin_walls has a scene of its own",
        ),
        (
            &["--set", "resolution=16", "-o", "out"],
            "--resolution is 16; the scenes of the suite need at least 32 cells",
        ),
        (
            &["--preset", "nonsense", "-o", "out"],
            "there is no preset nonsense",
        ),
        (&["--case", "empty"], "--output"),
    ];
    for (arguments, message) in cases {
        let output = run(folder.path(), arguments);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            output.status.code() == Some(2) && stderr.contains(message),
            "{arguments:?}: {stderr}"
        );
    }
    assert!(
        !folder.path().join("out").exists(),
        "wrong arguments left a folder"
    );
}
