//! Times of stages: what the registry calls the steps of a technique.

use serde::{Deserialize, Serialize};

use crate::frame;
use crate::gi::entry::{Entry, Part, Stage};
use crate::gi::registry;
use crate::graph::{FrameStats, Spread};

use super::report::Report;

/// When a stage runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum When {
    /// Once for static geometry.
    Build,
    /// In every frame.
    Frame,
}

/// Time of one stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageTimes {
    /// Name of the stage; [`UNSTAGED`] for passes that are in none.
    pub name: String,
    /// What it makes; `None` for [`UNSTAGED`].
    pub part: Option<Part>,
    /// Whether it runs once or in every frame.
    pub when: When,
    /// Time on the GPU, summed over its passes in each run (ms).
    pub gpu_ms: Spread,
}

/// The name under which passes are reported that no stage has.
pub const UNSTAGED: &str = "unstaged";

/// The stage that a pass of a technique belongs to, the frame's own among them.
pub fn stage_of(entry: &Entry, pass: &str) -> Option<&'static Stage> {
    (registry::stages(entry).into_iter())
        .chain(frame::STAGES.iter().copied())
        .find(|stage| stage.passes.contains(&pass))
}

/// Time of all stages of one part in one run (ms).
pub fn part_ms(entry: &Entry, run: &FrameStats, part: Part) -> f64 {
    let of_part = |name: &str| stage_of(entry, name).is_some_and(|stage| stage.part == part);
    run.passes
        .iter()
        .filter(|pass| of_part(&pass.name))
        .map(|pass| pass.gpu_ms)
        .sum()
}

/// Each stage that ran, in the technique's order, and what is in no stage.
pub fn stage_times(entry: &Entry, when: When, runs: &[FrameStats]) -> Vec<StageTimes> {
    let known = registry::stages(entry).into_iter();
    let known = known.chain(frame::STAGES.iter().copied()).map(Some);
    let times = |stage: Option<&'static Stage>| {
        let has = |name: &str| stage_of(entry, name) == stage;
        let sum = |run: &FrameStats| {
            run.passes
                .iter()
                .filter(|pass| has(&pass.name))
                .map(|pass| pass.gpu_ms)
                .sum()
        };
        let ran = runs
            .iter()
            .any(|run| run.passes.iter().any(|pass| has(&pass.name)));
        let gpu_ms = Spread::of(&runs.iter().map(sum).collect::<Vec<f64>>()).filter(|_| ran)?;
        Some(StageTimes {
            name: stage.map_or(UNSTAGED, |stage| stage.name).to_owned(),
            part: stage.map(|stage| stage.part),
            when,
            gpu_ms,
        })
    };
    known.chain([None]).filter_map(times).collect()
}

/// What each stage of the world-space store costs where geometry and light change every frame:
/// medians of a build and of a frame together (ms).
pub fn construction(report: &Report) -> Vec<(&str, f64)> {
    let mut parts: Vec<(&str, f64)> = Vec::new();
    for stage in report
        .stages
        .iter()
        .filter(|stage| stage.when == When::Build || matches!(stage.part, Some(Part::Store) | None))
    {
        match parts.iter_mut().find(|(name, _)| *name == stage.name) {
            Some((_, sum)) => *sum += stage.gpu_ms.median,
            None => parts.push((&stage.name, stage.gpu_ms.median)),
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gi::registry::TECHNIQUES;
    use crate::gi::shared::screen;
    use crate::graph::PassTime;
    use crate::render;

    fn run(passes: &[&str], slow: &str) -> FrameStats {
        let pass = |name: &&str| PassTime {
            name: (*name).to_owned(),
            gpu_ms: if *name == slow { 101.0 } else { 1.0 },
            runs: 1,
        };
        FrameStats {
            passes: passes.iter().map(pass).collect(),
            ..FrameStats::default()
        }
    }

    /// Every pass that is declared has one stage, of its technique or of the frame.
    #[test]
    fn every_declared_pass_has_one_stage() {
        for entry in TECHNIQUES {
            for pass in (entry.passes.iter().copied().flatten())
                .chain(render::PASSES.iter().chain(screen::PASSES))
            {
                let stages = entry
                    .stages
                    .iter()
                    .chain(frame::STAGES)
                    .filter(|stage| stage.passes.contains(&pass.name))
                    .count();
                // One that no frame runs may be in none.
                let answers_a_question = pass.name.ends_with("view")
                    || pass.name.ends_with("_structure")
                    || pass.name.ends_with("ledger")
                    || pass.name == "cone.trace";
                assert!(
                    stages == 1 || (answers_a_question && stages == 0),
                    "{}: {} is in {stages} stages",
                    entry.name,
                    pass.name
                );
            }
        }
    }

    /// 100 ms more in one pass are 100 ms more in its stage, and in no other.
    #[test]
    fn a_slowed_pass_shows_in_its_stage_alone() {
        for entry in TECHNIQUES {
            let passes: Vec<&str> = entry
                .stages
                .iter()
                .flat_map(|stage| stage.passes.iter().copied())
                .collect();
            let before = stage_times(entry, When::Frame, &[run(&passes, "")]);
            for slow in &passes {
                let after = stage_times(entry, When::Frame, &[run(&passes, slow)]);
                let grown: Vec<&str> = before
                    .iter()
                    .zip(&after)
                    .filter(|(before, after)| after.gpu_ms.median > before.gpu_ms.median + 99.0)
                    .map(|pair| pair.1.name.as_str())
                    .collect();
                assert_eq!(
                    grown,
                    [stage_of(entry, slow).map_or("", |stage| stage.name)],
                    "{slow}"
                );
            }
        }
    }

    #[test]
    fn a_pass_in_no_stage_is_told() {
        for entry in TECHNIQUES {
            let times = stage_times(
                entry,
                When::Build,
                &[run(&["nobody.knows"], "nobody.knows")],
            );
            assert_eq!(
                times
                    .iter()
                    .map(|stage| (stage.name.as_str(), stage.part, stage.gpu_ms.median))
                    .collect::<Vec<_>>(),
                [(UNSTAGED, None, 101.0)]
            );
        }
    }
}
