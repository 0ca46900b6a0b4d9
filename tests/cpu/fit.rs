//! The search of `lumivox fit`: on planted grids, where the cheapest is known, and on recorded
//! ones.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::path::Path;

use lumivox::gi::registry::find;
use lumivox::measure::bench::Case;
use lumivox::measure::chart::{Point, Section};
use lumivox::measure::fit::{Aim, Bounds, Candidate, Figures, Found, Search, Trial, candidate_of};
use lumivox::measure::records::{newest, read_records};
use lumivox::reference::Bounces;

/// A candidate of a planted grid: a technique at a resolution, with a word.
fn planted(technique: &str, resolution: u32, word: &str) -> Candidate {
    let settings = [
        ("resolution", resolution.to_string()),
        ("word", word.to_owned()),
    ];
    let settings = settings.map(|(name, value)| (name.to_owned(), value));
    Candidate {
        technique: technique.to_owned(),
        preset: Some("plain".to_owned()),
        settings: BTreeMap::from(settings),
        amounts: vec!["resolution".to_owned()],
        changes: usize::from(word != "as-it-is"),
    }
}

fn resolution(candidate: &Candidate) -> f64 {
    candidate.settings["resolution"].parse().unwrap()
}

/// What a candidate costs and how wrong it is; `None` is refused.
type Law = fn(&Candidate) -> Option<[f64; 3]>;

/// A trial of laws instead of a device.
struct Planted {
    law: Law,
    candidates: Vec<Candidate>,
    /// What was measured, in that order.
    measured: Vec<(usize, u32)>,
    /// Whether the local search may try resolutions between those of the grid.
    has_neighbours: bool,
}

impl Planted {
    fn new(law: Law, candidates: Vec<Candidate>) -> Self {
        Planted {
            law,
            candidates,
            measured: Vec::new(),
            has_neighbours: false,
        }
    }

    fn search(&mut self, bounds: Bounds) -> Found {
        let candidates = self.candidates.clone();
        let Ok(found) = Search::new(self, bounds, 3, candidates).run();
        found
    }
}

impl Trial for Planted {
    type Error = Infallible;

    fn measure(&mut self, candidate: usize, round: u32) -> Result<(), Infallible> {
        assert!(
            !self.measured.contains(&(candidate, round)),
            "measured twice"
        );
        self.measured.push((candidate, round));
        Ok(())
    }

    fn complete(&mut self, _: usize) -> Result<bool, Infallible> {
        Ok(false)
    }

    fn figures(&self, candidate: usize) -> Option<Figures> {
        let [ms, error, bytes] = (self.law)(&self.candidates[candidate])?;
        Some(Figures {
            ms,
            fastest_ms: ms,
            error,
            bytes,
        })
    }

    fn noise(&self) -> f64 {
        1e-3
    }

    fn effort(&self, _: usize, ms: f64) -> f64 {
        1e3 + 5.0 * ms
    }

    fn neighbours(&mut self, candidate: usize) -> Vec<Candidate> {
        let Candidate {
            technique,
            settings,
            ..
        } = self.candidates[candidate].clone();
        let own: u32 = settings["resolution"].parse().unwrap();
        let steps =
            [own * 3 / 4, own * 5 / 4].map(|step| planted(&technique, step, &settings["word"]));
        let mut new = steps.to_vec();
        new.retain(|step| self.has_neighbours && !self.candidates.contains(step));
        self.candidates.extend(new.clone());
        new
    }
}

/// Four techniques at six resolutions with five words each.
fn grid() -> Vec<Candidate> {
    let mut all = Vec::new();
    for technique in ["blur", "grid", "rays", "tree"] {
        for resolution in [8, 16, 32, 64, 128, 256] {
            for word in ["as-it-is", "one", "two", "three", "four"] {
                all.push(planted(technique, resolution, word));
            }
        }
    }
    all
}

/// `blur` is the fastest and the best at the lowest resolution, but never falls below an error
/// of 10%. `rays` starts as the worst and slowest of all, and falls the fastest. Words change a
/// little.
fn law(candidate: &Candidate) -> Option<[f64; 3]> {
    let share = resolution(candidate) / 8.0;
    let [ms, error, bytes] = match candidate.technique.as_str() {
        "blur" => [1.0 * share, 0.1 + 0.1 / share, 1e5 * share.powi(3)],
        "grid" => [
            3.0 * share.powf(1.2),
            0.4 / share.powf(0.4),
            1e5 * share.powi(3),
        ],
        "rays" => [6.0 * share.powf(0.7), 1.0 / share, 2e4 * share.powi(2)],
        _ => [
            9.0 * share.powf(1.1),
            0.4 / share.powf(0.4),
            5e4 * share.powi(2),
        ],
    };
    let (slower, worse) = match candidate.settings["word"].as_str() {
        "one" => (0.8, 1.3),
        "two" => (1.3, 0.9),
        "three" => (2.0, 0.8),
        "four" => (1.1, 2.0),
        _ => (1.0, 1.0),
    };
    Some([slower * ms, worse * error, bytes])
}

/// As [`law`], but `tree` is wrong at its simplest, and beyond as good as `rays` in less time.
fn late(candidate: &Candidate) -> Option<[f64; 3]> {
    if candidate.technique != "tree" {
        return law(candidate);
    }
    if resolution(candidate) < 16.0 {
        return Some([6.0, 50.0, 1e5]);
    }
    let rays = Candidate {
        technique: "rays".to_owned(),
        ..candidate.clone()
    };
    law(&rays).map(|[ms, error, bytes]| [0.7 * ms, error, bytes])
}

/// The settings of the best are tried in other techniques, which may be bad at their simplest.
#[test]
fn what_is_bad_at_its_simplest_is_found() {
    let all = grid();
    for bounds in [error_bound(0.2), error_bound(0.12), error_bound(0.05)] {
        let found = Planted::new(late, all.clone()).search(bounds);
        let best = found.best.map(|best| late(&all[best]).unwrap()[0]).unwrap();
        let least = truth(late, &all, &bounds).unwrap();
        println!("{best} of {least}, {} measured", found.measured.len());
        assert!(best <= 1.1 * least, "{best} of {least}");
        assert!(
            5 * found.measured.len() <= 2 * all.len(),
            "{}",
            found.measured.len()
        );
    }
}

/// The best of all by measuring each.
fn truth(law: Law, candidates: &[Candidate], bounds: &Bounds) -> Option<f64> {
    let met = candidates.iter().filter_map(|candidate| {
        let [ms, error, bytes] = law(candidate)?;
        let figures = Figures {
            ms,
            fastest_ms: ms,
            error,
            bytes,
        };
        bounds.are_met(&figures).then(|| value(bounds, &figures))
    });
    met.min_by(f64::total_cmp)
}

fn value(bounds: &Bounds, figures: &Figures) -> f64 {
    match bounds.aim() {
        Aim::Time => figures.ms,
        Aim::Error => figures.error,
    }
}

fn error_bound(max_error: f64) -> Bounds {
    Bounds {
        max_error,
        ..Bounds::NONE
    }
}

const MIB: f64 = 1024.0 * 1024.0;

/// The cheapest is found at every bound, for few measurements.
#[test]
fn the_cheapest_of_a_planted_grid_is_found() {
    let all = grid();
    let bounds = [
        error_bound(0.3),
        error_bound(0.12),
        error_bound(0.05),
        Bounds {
            max_ms: 20.0,
            ..Bounds::NONE
        },
        Bounds {
            max_bytes: MIB,
            ..Bounds::NONE
        },
        Bounds {
            max_ms: 20.0,
            max_bytes: 0.25 * MIB,
            ..Bounds::NONE
        },
        Bounds {
            max_bytes: 4.0 * MIB,
            ..error_bound(0.12)
        },
    ];
    for bounds in bounds {
        let mut trial = Planted::new(law, all.clone());
        let found = trial.search(bounds);
        let best = found.best.and_then(|best| trial.figures(best));
        let best = best.map(|best| value(&bounds, &best));
        let wanted = truth(law, &all, &bounds);
        let is_best = best
            .zip(wanted)
            .is_some_and(|(best, wanted)| best <= 1.05 * wanted);
        assert!(is_best, "{bounds:?}: {best:?}, not {wanted:?}");
        let count = found.measured.len();
        assert!(
            3 * count <= all.len(),
            "{bounds:?}: measured {count} of {}",
            all.len()
        );
    }
}

/// The same grid leads astray who takes the best technique at the lowest resolution, then raises
/// what helps most. So the test above can fail.
#[test]
fn a_greedy_search_fails_on_the_planted_grid() {
    let all = grid();
    let of = |candidate: &Candidate| law(candidate).unwrap();
    let simple = all
        .iter()
        .filter(|it| resolution(it) == 8.0 && it.changes == 0);
    let mut here = simple.min_by(|a, b| of(a)[1].total_cmp(&of(b)[1])).unwrap();
    assert_eq!(here.technique, "blur");
    while of(here)[1] > 0.05 {
        let differ = |it: &Candidate| {
            let pairs = it.settings.iter().zip(&here.settings);
            pairs.filter(|(a, b)| a != b).count()
        };
        let near = all
            .iter()
            .filter(|it| it.technique == here.technique && differ(it) == 1);
        let next = near.min_by(|a, b| of(a)[1].total_cmp(&of(b)[1])).unwrap();
        if of(next)[1] >= of(here)[1] {
            break;
        }
        here = next;
    }
    assert!(of(here)[1] > 0.05, "greedy found {here:?}");
}

/// What needs more memory than is allowed, or was refused, is known from a smaller sibling.
#[test]
fn what_a_bound_rules_out_is_not_measured() {
    let bounds = Bounds {
        max_bytes: MIB,
        ..Bounds::NONE
    };
    let refused: Law = |it| law(it).filter(|_| it.technique != "rays" || resolution(it) < 32.0);
    for law in [law as Law, refused] {
        let mut trial = Planted::new(law, grid());
        let found = trial.search(bounds);
        assert!(found.ruled_out > 0);
        let first = trial.measured.iter().filter(|(_, round)| *round == 1);
        let order: Vec<usize> = first.map(|(candidate, _)| *candidate).collect();
        assert_eq!(order, found.measured);
        let is_out = |it: &Candidate| law(it).is_none_or(|[.., bytes]| bytes > MIB);
        for (place, later) in order.iter().enumerate() {
            let later = &trial.candidates[*later];
            let smaller = order[..place].iter().map(|index| &trial.candidates[*index]);
            let mut siblings = smaller.filter(|it| {
                it.technique == later.technique
                    && it.settings["word"] == later.settings["word"]
                    && resolution(it) < resolution(later)
            });
            assert!(!siblings.any(is_out), "{later:?} was ruled out");
        }
    }
}

/// Between the resolutions of the grid there is a cheaper one that meets the bound.
#[test]
fn the_local_search_goes_beyond_the_grid() {
    let bounds = error_bound(0.11);
    let mut trial = Planted::new(law, grid());
    let of_grid = trial.search(bounds).best.unwrap();
    let of_grid = trial.figures(of_grid).unwrap();
    let mut trial = Planted::new(law, grid());
    trial.has_neighbours = true;
    let found = trial.search(bounds);
    let best = found.best.unwrap();
    assert!(best >= grid().len(), "{:?}", found.candidates[best]);
    let best = trial.figures(best).unwrap();
    assert!(
        bounds.are_met(&best) && best.ms < 0.95 * of_grid.ms,
        "{best:?} {of_grid:?}"
    );
}

/// Nothing has an error of 0.1%: that is said, and what comes nearest is the least error.
#[test]
fn a_bound_out_of_reach_is_told() {
    let bounds = error_bound(1e-3);
    let mut trial = Planted::new(law, grid());
    let found = trial.search(bounds);
    assert_eq!(found.best, None);
    let figures = |&index: &usize| Some((index, trial.figures(index)?));
    let all: Vec<(usize, Figures)> = found.measured.iter().filter_map(figures).collect();
    let nearest = bounds
        .nearest(&all)
        .map(|nearest| &found.candidates[nearest]);
    let nearest = nearest.map(|it| (it.technique.as_str(), resolution(it)));
    assert_eq!(nearest, Some(("rays", 256.0)));
}

/// Only the best are measured more than once, the very best in all rounds.
#[test]
fn later_rounds_are_for_the_best() {
    let mut trial = Planted::new(law, grid());
    let found = trial.search(error_bound(0.12));
    let in_round = |round: u32| {
        let of_round = trial.measured.iter().filter(|(_, of)| *of == round);
        of_round
            .map(|(candidate, _)| *candidate)
            .collect::<Vec<_>>()
    };
    let [first, second, third] = [1, 2, 3].map(in_round);
    assert!(second.len() <= (first.len() / 4).max(2) + 1, "{second:?}");
    assert!(third.len() <= second.len(), "{third:?}");
    let best = found.best.unwrap();
    assert!(second.contains(&best) && third.contains(&best));
}

/// The recorded points of a chart's full grid, at one bounce.
struct Recorded {
    points: Vec<Point>,
    candidates: Vec<Candidate>,
    rounds: Vec<u32>,
    spent_s: f64,
}

/// Seconds of a measurement beside its frames, as on the machine of the records.
const OVERHEAD_S: f64 = 1.0;

impl Recorded {
    fn read(file: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        let records = newest(read_records::<Point>(&path).unwrap());
        let mut points = Section::sort(records).remove(0).points;
        points.retain(|point| point.bounces == Bounces::Count(1) && point.failure.is_none());
        let candidates = points.iter().map(candidate).collect();
        Recorded {
            rounds: vec![0; points.len()],
            points,
            candidates,
            spent_s: 0.0,
        }
    }

    /// Seconds of one round.
    fn round_s(&self, index: usize) -> f64 {
        let frame_ms = self.points[index].median_ms("frame").unwrap();
        OVERHEAD_S + 3.5e-3 * frame_ms
    }
}

/// A recorded point as the search knows it. Records may be older than some settings.
fn candidate(point: &Point) -> Candidate {
    let entry = find(&point.technique).unwrap();
    let is_known = |name: &str| entry.all_settings().any(|setting| setting.name == name);
    let pairs = point.settings.iter().filter(|(name, _)| is_known(name));
    let pairs: Vec<String> = pairs
        .map(|(name, value)| format!("{name}={value}"))
        .collect();
    let case = Case {
        entry,
        preset: point.preset.clone(),
        settings: entry.settings(point.preset.as_deref(), &pairs).unwrap(),
    };
    Candidate {
        changes: point.changes.len(),
        ..candidate_of(&case)
    }
}

impl Trial for Recorded {
    type Error = Infallible;

    fn measure(&mut self, candidate: usize, round: u32) -> Result<(), Infallible> {
        self.rounds[candidate] = round;
        self.spent_s += self.round_s(candidate);
        Ok(())
    }

    fn complete(&mut self, _: usize) -> Result<bool, Infallible> {
        Ok(false)
    }

    /// Each round is off by up to 10%, another way each time.
    fn figures(&self, candidate: usize) -> Option<Figures> {
        let point = &self.points[candidate];
        let round = f64::from(self.rounds[candidate]);
        let off = 1.0 + 0.1 * (12.9898 * candidate as f64 + 78.233 * round).sin() / round;
        let ms = off * point.median_ms("indirect")?;
        Some(Figures {
            ms,
            fastest_ms: 0.95 * ms,
            error: point.error?.rel_rmse,
            bytes: point.structure_bytes? as f64,
        })
    }

    fn noise(&self) -> f64 {
        2e-3
    }

    fn effort(&self, _: usize, ms: f64) -> f64 {
        OVERHEAD_S + 3.5e-3 * ms
    }

    fn neighbours(&mut self, _: usize) -> Vec<Candidate> {
        Vec::new()
    }
}

/// On recorded grids of real scenes the answer is within a tenth of the best of the grid, for at
/// most a fifth of the time of its two rounds. `tests/recorded` has grids of older charts, fuller
/// than those in `docs/results`.
#[test]
fn recorded_grids_are_searched_in_a_fifth_of_their_time() {
    let cases: [(&str, [f64; 3], [f64; 2], f64); 4] = [
        (
            "docs/results/chart/cornell.jsonl",
            [0.02, 0.05, 0.1],
            [40.0, 150.0],
            4.0,
        ),
        (
            "tests/recorded/atrium.jsonl",
            [0.15, 0.25, 0.5],
            [60.0, 250.0],
            4.0,
        ),
        (
            "tests/recorded/emissive-gallery.jsonl",
            [0.08, 0.15, 0.3],
            [30.0, 100.0],
            4.0,
        ),
        (
            "tests/recorded/glossy.jsonl",
            [0.07, 0.13, 0.2],
            [24.0, 66.0],
            1.0,
        ),
    ];
    for (file, errors, times, mib) in cases {
        let of_times = times.map(|max_ms| Bounds {
            max_ms,
            ..Bounds::NONE
        });
        let of_memory = Bounds {
            max_bytes: mib * MIB,
            ..Bounds::NONE
        };
        let all = errors
            .map(error_bound)
            .into_iter()
            .chain(of_times)
            .chain([of_memory]);
        for bounds in all {
            let mut trial = Recorded::read(file);
            let candidates = trial.candidates.clone();
            let Ok(found) = Search::new(&mut trial, bounds, 3, candidates).run();
            let figures = |index: usize| {
                let point = &trial.points[index];
                let ms = point.median_ms("indirect")?;
                let (error, bytes) = (point.error?.rel_rmse, point.structure_bytes? as f64);
                Some(Figures {
                    ms,
                    fastest_ms: ms,
                    error,
                    bytes,
                })
            };
            let met = (0..trial.points.len()).filter_map(figures);
            let met = met.filter(|figures| bounds.are_met(figures));
            let wanted = met
                .map(|it| value(&bounds, &it))
                .min_by(f64::total_cmp)
                .unwrap();
            let best = value(&bounds, &figures(found.best.unwrap()).unwrap());
            let grid_s: f64 = (0..trial.points.len())
                .map(|index| 2.0 * trial.round_s(index))
                .sum();
            let share = trial.spent_s / grid_s;
            println!(
                "{file} {bounds:?}: {:.3} of the best, {:.3} of the time, {} of {}",
                best / wanted,
                share,
                found.measured.len(),
                trial.points.len()
            );
            assert!(
                best <= 1.1 * wanted,
                "{file} {bounds:?}: {best}, not {wanted}"
            );
            assert!(
                share <= 0.2,
                "{file} {bounds:?}: {share} of the grid's time"
            );
        }
    }
}
