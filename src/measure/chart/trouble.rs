//! What `lumivox stress` found of the settings that a page recommends.

use std::path::{Path, PathBuf};

use super::command;
use super::point::Point;
use crate::gi::settings::RESOLUTION;
use crate::measure::records::{RecordError, read_records, record_files};
use crate::measure::stress::results::Worst;
use crate::measure::stress::{CASES, Effort, LEAST_RESOLUTION, Record, StressCase};

/// Results of `lumivox stress`, and where they are.
#[derive(Clone, Debug, Default)]
pub struct Troubles {
    /// The folder, as commands are to name it.
    pub folder: PathBuf,
    records: Vec<Record>,
}

/// One technique with one set of settings in all failure modes that were measured of it.
#[derive(Clone, Debug)]
pub struct TroubleRun<'t> {
    /// Its records; all have technique, settings, device and sizes of the first.
    pub records: Vec<&'t Record>,
}

/// One failure mode, and how one technique fares in it.
#[derive(Clone)]
pub struct Finding {
    /// The failure mode.
    pub case: &'static StressCase,
    /// How badly it fails.
    pub worst: Worst,
    /// Whether a quick look is all that was taken.
    pub is_quick: bool,
}

impl Troubles {
    /// All records (`*.jsonl`) of a folder and of the folders in it, one for each scene. A folder
    /// that does not exist has none.
    pub fn read(folder: &Path) -> Result<Self, RecordError> {
        let mut records = Vec::new();
        if folder.is_dir() {
            let inner = folders_in(folder)?;
            for folder in std::iter::once(folder).chain(inner.iter().map(PathBuf::as_path)) {
                for file in record_files::<Record>(folder)? {
                    records.extend(read_records::<Record>(&file)?);
                }
            }
        }
        Ok(Troubles {
            folder: folder.to_owned(),
            records,
        })
    }

    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// The run that is closest to a point. It has the point's technique and settings, at any
    /// resolution, as most severities count in cells; or else its preset with other settings. Among
    /// equally close runs, these decide in turn: the point's device, its resolution, the most
    /// failure modes, the latest.
    pub fn run_of(&self, point: &Point) -> Option<TroubleRun<'_>> {
        let mut runs: Vec<TroubleRun<'_>> = Vec::new();
        let fits = |record: &&Record| {
            let is_of_scene = record.scene.is_none()
                || record.scene_hash.as_ref() == Some(&point.setup.scene_hash);
            record.change.is_empty() && record.technique == point.technique && is_of_scene
        };
        for record in self.records.iter().filter(fits) {
            match runs.iter_mut().find(|run| run.is_of(record)) {
                Some(run) => run.add(record),
                None => runs.push(TroubleRun {
                    records: vec![record],
                }),
            }
        }
        runs.retain(|run| {
            run.differences(point).is_empty() || run.records[0].preset == point.preset
        });
        let distance = |run: &TroubleRun<'_>| {
            let is_elsewhere = run.records[0].setup.device != point.setup.device;
            (
                run.differences(point).len(),
                is_elsewhere,
                !run.is_of_resolution(point),
                run.missing(),
            )
        };
        runs.into_iter().rev().min_by_key(distance)
    }

    /// The command that measures a point's own settings.
    pub fn command(&self, point: &Point) -> String {
        command::stress(&self.folder, point, stress_resolution(point))
    }
}

impl<'t> TroubleRun<'t> {
    /// Adds a record. It replaces an older record of the same case, such as another build's.
    fn add(&mut self, record: &'t Record) {
        let what = |record: &Record| {
            (
                record.case.clone(),
                record.scene.clone(),
                record.severity.to_bits(),
                record.setup.effort.clone(),
            )
        };
        self.records.retain(|known| what(known) != what(record));
        self.records.push(record);
    }

    fn is_of(&self, record: &Record) -> bool {
        let first = self.records[0];
        let setup = |record: &Record| {
            (
                record.setup.device.clone(),
                record.setup.size,
                record.setup.shadow_resolution,
                record.setup.shadows.clone(),
            )
        };
        first.settings == record.settings
            && first.preset == record.preset
            && setup(first) == setup(record)
    }

    /// Whether it has the point's settings and resolution. Below the suite's lowest resolution,
    /// that lowest one counts as the same.
    pub fn is_own(&self, point: &Point) -> bool {
        self.differences(point).is_empty() && self.is_of_resolution(point)
    }

    fn is_of_resolution(&self, point: &Point) -> bool {
        stress_resolution(point)
            .map(|resolution| resolution.to_string())
            .as_ref()
            == self.records[0].settings.get(RESOLUTION)
    }

    /// The settings but `resolution` that the point has otherwise, as the run had them.
    pub fn differences(&self, point: &Point) -> Vec<String> {
        let differs = |(name, value): &(&String, &String)| {
            *name != RESOLUTION && point.settings.get(*name) != Some(*value)
        };
        self.records[0]
            .settings
            .iter()
            .filter(differs)
            .map(|(name, value)| format!("{name}={value}"))
            .collect()
    }

    /// Technique, preset, resolution, and whether it was a quick look.
    pub fn name(&self) -> String {
        let effort = match self
            .findings()
            .iter()
            .filter(|finding| finding.is_quick)
            .count()
        {
            0 => "",
            quick if quick == self.findings().len() => " (quick)",
            _ => " (partly quick)",
        };
        self.records[0].case_name() + effort
    }

    /// Failure modes of the suite that were not measured.
    pub fn missing(&self) -> usize {
        CASES.len() - self.findings().len()
    }

    /// Failure mode by failure mode, in their order.
    pub fn findings(&self) -> Vec<Finding> {
        let finding = |case: &&'static StressCase| {
            // What was measured on the point's own scene says more than the suite's scene, and a
            // full run more than a quick one.
            let rank = |record: &Record| {
                (
                    record.scene.is_some(),
                    record.setup.effort == Effort::FULL.name,
                )
            };
            let best = self
                .records
                .iter()
                .filter(|record| record.case == case.name)
                .map(|record| rank(record))
                .max()?;
            let worst = Worst::of(
                case,
                self.records
                    .iter()
                    .copied()
                    .filter(|record| record.case == case.name && rank(record) == best),
            )?;
            Some(Finding {
                case,
                worst,
                is_quick: !best.1,
            })
        };
        CASES.iter().filter_map(finding).collect()
    }
}

/// The resolution at which the suite can measure a point.
fn stress_resolution(point: &Point) -> Option<u32> {
    point
        .resolution()
        .and_then(|resolution| resolution.parse::<u32>().ok())
        .map(|resolution| resolution.max(LEAST_RESOLUTION))
}

/// The folders in a folder, by name.
fn folders_in(folder: &Path) -> Result<Vec<PathBuf>, RecordError> {
    let failed = |source| RecordError::File {
        what: "read the folder",
        path: folder.to_owned(),
        source,
    };
    let entries = std::fs::read_dir(folder).map_err(failed)?;
    let mut folders: Vec<PathBuf> = entries
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<_, _>>()
        .map_err(failed)?;
    folders.retain(|path| path.is_dir());
    folders.sort();
    Ok(folders)
}

#[cfg(test)]
pub(super) mod tests {
    use std::collections::BTreeMap;

    use super::super::point::tests::point;
    use super::*;
    use crate::measure::stress::{Figured, StressSetup, Verdict};

    /// A record of a quick run of the preset `cones` at 64³.
    pub(in crate::measure::chart) fn record(
        technique: &str,
        cones: &str,
        case: &str,
        severity: f64,
        (name, value, verdict): (&str, f64, Verdict),
    ) -> Record {
        let setup = StressSetup {
            version: "1".into(),
            build: "abc".into(),
            device: "a device".into(),
            driver: "a driver".into(),
            size: [64, 48],
            shadow_resolution: 256,
            shadows: Default::default(),
            effort: "quick".into(),
        };
        Record {
            record_version: 1,
            key: format!("{technique} {cones} {case} {severity}"),
            setup,
            case: case.into(),
            scene: None,
            scene_hash: None,
            technique: technique.into(),
            preset: Some("cones".into()),
            changes: BTreeMap::new(),
            change: String::new(),
            settings: BTreeMap::from([
                ("resolution".to_owned(), "64".to_owned()),
                ("cones".to_owned(), cones.to_owned()),
            ]),
            severity,
            figures: vec![Figured {
                name: name.into(),
                value: Some(value),
                verdict,
            }],
            failure: None,
            is_lost: false,
        }
    }

    pub(in crate::measure::chart) fn troubles_of(records: Vec<Record>) -> Troubles {
        Troubles {
            folder: "found".into(),
            records,
        }
    }

    const WARNED: (&str, f64, Verdict) = ("rotation_spread", 0.2, Verdict::Warn);

    /// Which run is taken for a point with nine cones at 64³: own settings before other ones, its
    /// device before another, a full run before a quick one, its resolution before another; never
    /// another technique, a changed setting or another scene.
    #[test]
    fn the_closest_run_is_shown() {
        let mut wanted = point("svo", 1, [9.0, 1.0], 1 << 20, 0.04);
        wanted.settings.insert("cones".into(), "9".into());
        let base = record("svo", "16", "rotation", 6.0, WARNED);
        let own = record("svo", "9", "rotation", 6.0, WARNED);
        let changed = |change: fn(&mut Record)| {
            let mut record = own.clone();
            change(&mut record);
            record
        };
        let coarse = changed(|record| {
            record
                .settings
                .extend([("resolution".to_owned(), "32".to_owned())])
        });
        let full = changed(|record| record.setup.effort = "full".into());
        let elsewhere = changed(|record| {
            (record.setup.device, record.setup.effort) = ("another".into(), "full".into())
        });
        let unfit = [
            changed(|record| record.technique = "clipmap".into()),
            changed(|record| record.change = "cones=9".into()),
            changed(|record| {
                (record.scene, record.scene_hash) = (Some("room".into()), Some("4567".into()))
            }),
        ];
        let mut records = unfit.to_vec();
        let mut found = |more: Record| {
            records.push(more);
            let troubles = troubles_of(records.clone());
            troubles.run_of(&wanted).map(|run| run.records[0].clone())
        };
        for closer in [base.clone(), elsewhere, coarse.clone(), own.clone()] {
            assert_eq!(found(closer.clone()).as_ref(), Some(&closer));
        }
        // A full run of one failure mode takes its place among quick ones of others.
        let other = changed(|record| record.case = "empty".into());
        for record in [full, own.clone(), other] {
            found(record);
        }
        let troubles = troubles_of(records);
        let run = troubles.run_of(&wanted).unwrap_or_else(|| panic!("no run"));
        assert_eq!(
            (run.name().as_str(), run.missing()),
            ("svo cones 64³ (partly quick)", CASES.len() - 2)
        );
        assert_eq!(
            run.findings()
                .iter()
                .map(|finding| (finding.case.name, finding.is_quick))
                .collect::<Vec<_>>(),
            [("rotation", false), ("empty", true)]
        );
        let is_own = |record: &Record, resolution: &str| {
            let mut point = wanted.clone();
            point
                .settings
                .insert("resolution".into(), resolution.into());
            TroubleRun {
                records: vec![record],
            }
            .is_own(&point)
        };
        assert_eq!(
            [
                (&own, "64"),
                (&coarse, "64"),
                (&base, "64"),
                (&coarse, "16")
            ]
            .map(|(run, resolution)| is_own(run, resolution)),
            [true, false, false, true]
        );
        let troubles = troubles_of(unfit.to_vec());
        assert!(troubles.run_of(&wanted).is_none());
        let mut other = record("svo", "16", "rotation", 6.0, WARNED);
        other.preset = Some("textbook".into());
        assert!(
            troubles_of(vec![other]).run_of(&wanted).is_none(),
            "another preset with other settings says nothing"
        );
    }

    /// The first severity with the worst verdict counts, with the figure there; if all pass, the
    /// largest figure counts. A record of a later build replaces an older one. Records of the
    /// point's own scene replace the suite's.
    #[test]
    fn findings_tell_the_worst() {
        let judged = |value: f64, verdict| ("energy_error", value, verdict);
        let mut records = vec![
            record("svo", "9", "narrow_gap", 0.5, judged(0.9, Verdict::Fail)),
            record("svo", "9", "narrow_gap", 8.0, judged(0.1, Verdict::Pass)),
            record("svo", "9", "narrow_gap", 1.0, judged(0.7, Verdict::Fail)),
            record(
                "svo",
                "9",
                "thin_walls",
                4.0,
                ("leak", 0.001, Verdict::Pass),
            ),
            record("svo", "9", "thin_walls", 1.0, ("leak", 0.02, Verdict::Pass)),
            record(
                "svo",
                "9",
                "rotation",
                6.0,
                ("rotation_spread", 0.4, Verdict::Fail),
            ),
        ];
        let mut later = record(
            "svo",
            "9",
            "rotation",
            6.0,
            ("rotation_spread", 0.01, Verdict::Pass),
        );
        later.setup.build = "def".into();
        records.push(later);
        let found = |records: Vec<Record>| -> Vec<(String, String, Option<f64>)> {
            let mut wanted = point("svo", 1, [9.0, 1.0], 1 << 20, 0.04);
            wanted.settings.insert("cones".into(), "9".into());
            let troubles = troubles_of(records);
            let findings = troubles
                .run_of(&wanted)
                .map(|run| run.findings())
                .unwrap_or_default();
            findings
                .into_iter()
                .map(|finding| {
                    (
                        finding.case.name.to_owned(),
                        finding.worst.to_string(),
                        finding.worst.figure.1,
                    )
                })
                .collect()
        };
        let row =
            |case: &str, text: &str, value: f64| (case.to_owned(), text.to_owned(), Some(value));
        let wanted = [
            row("thin_walls", "pass", 0.02),
            row("rotation", "pass", 0.01),
            row("narrow_gap", "fail from 1 down", 0.7),
        ];
        assert_eq!(found(records.clone()), wanted);
        let mut own = record(
            "svo",
            "9",
            "rotation",
            6.0,
            ("rotation_spread", 0.2, Verdict::Warn),
        );
        (own.scene, own.scene_hash) = (Some("room".into()), Some("0123".into()));
        records.push(own);
        assert_eq!(found(records)[1], row("rotation", "warn from 6 up", 0.2));
    }

    #[test]
    fn commands_name_what_was_measured() {
        let mut coarse = point("svo", 1, [9.0, 1.0], 1 << 20, 0.04);
        coarse.settings.insert("resolution".into(), "16".into());
        let troubles = Troubles {
            folder: "my results".into(),
            records: Vec::new(),
        };
        assert_eq!(
            troubles.command(&coarse),
            "lumivox stress --technique svo --preset cones --resolution 32 --set cones=9 -o 'my \
             results'"
        );
    }

    #[test]
    fn a_folder_that_is_not_there_has_nothing() {
        assert!(
            Troubles::read(Path::new("there is no such folder"))
                .is_ok_and(|troubles| troubles.is_empty())
        );
    }
}
