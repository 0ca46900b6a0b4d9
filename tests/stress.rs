//! `lumivox stress`: failure modes are measured, judged, and told as they are.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod support;

use std::collections::BTreeSet;

use lumivox::frame::FrameSettings;
use lumivox::gi::registry::{TECHNIQUES, find};
use lumivox::graph::Gpu;
use lumivox::measure::bench::Case;
use lumivox::measure::stress::{CASES, Record, StressCase, Verdict};
use support::gpu;

const FRAME: FrameSettings = FrameSettings { size: [48, 32], shadow_resolution: 512 };

fn thin_walls() -> &'static StressCase {
    CASES.iter().copied().find(|case| case.name == "thin_walls").unwrap()
}

fn case(technique: &str, preset: &str, pairs: &[&str]) -> Case {
    let entry = find(technique).unwrap();
    Case { entry, preset: Some(preset.into()), settings: entry.settings(Some(preset), pairs).unwrap() }
}

fn record(gpu: &Gpu, stress: &StressCase, case: &Case, severity: f64) -> Record {
    stress.record(gpu, case, &(String::new(), case.settings.clone()), FRAME, severity).unwrap()
}

/// A wall one voxel thick holds the light with the best settings; box mips let it through, and more the thinner it is.
#[test]
fn thin_walls_leak_where_they_must() {
    let (gpu, stress) = (gpu(), thin_walls());
    let figure = |preset: &str, pairs: &[&str], severity: f64| {
        let record = record(&gpu, stress, &case("voxel-mips", preset, pairs), severity);
        println!("{preset} {pairs:?}, wall of {severity}: {:.4} {:?}", record.figure.unwrap(), record.verdict.unwrap());
        (record.figure.unwrap(), record.verdict.unwrap())
    };
    let best = [1.0, 4.0].map(|wall| figure("accurate", &["resolution=32"], wall));
    assert!(best.iter().all(|best| best.1 == Verdict::Pass), "{best:?}");
    let planted = [4.0, 0.25].map(|wall| figure("textbook", &["resolution=32"], wall));
    assert!(planted[1].1 != Verdict::Pass && planted[1].0 > planted[0].0 && planted[1].0 > 10.0 * best[0].0, "{planted:?}");
    // One radiance for both sides of a wall in one voxel shines through.
    let glowing = figure("accurate", &["resolution=32", "radiance=isotropic"], 0.25);
    assert!(glowing.1 != Verdict::Pass, "{glowing:?}");
}

/// Every change of every case is one that a technique has, and nothing but it is changed.
#[test]
fn variants_change_one_setting() {
    let names: BTreeSet<&str> = CASES.iter().map(|case| case.name).collect();
    assert_eq!(names.len(), CASES.len());
    for (stress, entry) in CASES.iter().flat_map(|stress| TECHNIQUES.iter().map(move |entry| (stress, entry))) {
        let settings = entry.settings::<&str>(None, &[]).unwrap();
        let variants = stress.variants(entry, &settings).unwrap();
        assert!(variants[0] == (String::new(), settings.clone()));
        assert!(entry.voxels.is_none() || variants.len() > 5, "{}: {} variants", entry.name, variants.len());
        for (change, changed) in &variants[1..] {
            let differing: Vec<&str> = settings.iter().zip(changed.iter()).filter(|(old, new)| old != new).map(|(old, _)| old.0).collect();
            assert!(matches!(differing[..], [name] if change.starts_with(&format!("{name}="))), "{}, {change}: {differing:?}", entry.name);
        }
        let unique: BTreeSet<&String> = variants.iter().map(|variant| &variant.0).collect();
        assert_eq!(unique.len(), variants.len());
    }
}

#[test]
fn verdicts_follow_the_thresholds() {
    let stress = thin_walls();
    let cases = [(0.0, Verdict::Pass), (stress.pass, Verdict::Pass), (1.01 * stress.pass, Verdict::Warn), (1.01 * stress.warn, Verdict::Fail)];
    cases.iter().for_each(|(figure, verdict)| assert_eq!(stress.verdict(*figure), *verdict));
    assert_eq!(stress.verdict(f64::NAN), Verdict::Fail);
}

/// A planted figure is in the table, the CSV and the chart, in its own row and column.
#[test]
fn what_is_measured_is_told() {
    let (gpu, stress) = (gpu(), thin_walls());
    let nothing = Case { entry: find("none").unwrap(), preset: None, settings: find("none").unwrap().settings::<&str>(None, &[]).unwrap() };
    let without = record(&gpu, stress, &nothing, 1.0);
    assert_eq!((without.figure, without.verdict), (Some(0.0), Some(Verdict::Pass)));
    let planted = Record { change: "a=b".into(), figure: Some(0.4321), verdict: Some(Verdict::Fail), ..without.clone() };
    let refused = Record { severity: 0.5, figure: None, verdict: None, failure: Some("too large".into()), ..planted.clone() };
    let records = [without, planted, refused];
    let table = stress.table(&records);
    assert!(table.contains("| none | – | – | 0.0000 pass | – | – |") && table.contains("| none, `a=b` | – | – | 0.4321 fail | too large | – |"), "{table}");
    let csv = stress.csv(&records);
    assert!(csv.contains("thin_walls,none,,a=b,1,0.4321,fail\n") && csv.lines().count() == 4, "{csv}");
    let charts = stress.charts(&records);
    assert_eq!(charts.len(), 1);
    let svg = charts[0].1.svg().unwrap();
    assert!(svg.contains("a=b") && svg.contains("as it is") && svg.contains(stress.severity));
}
