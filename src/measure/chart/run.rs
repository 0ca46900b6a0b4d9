//! Measuring the points of a sweep that have no record yet.

use std::collections::BTreeSet;
use std::path::Path;

use super::front::near_front;
use super::pictures::PictureFolder;
use super::point::{Cost, Point, SweepSetup};
use super::section::Section;
use crate::graph::{Error, Gpu};
use crate::image::Image;
use crate::measure::bench::{
    BenchSettings, Case, MAX_SPP, Pictures, Truth, measure_on, warm_up_frames,
};
use crate::measure::records::{Keyed as _, RecordError, Records};
use crate::measure::report::Report;
use crate::metrics::{BLOCK_PX, MetricError, error_image, exposure_of};
use crate::reference::{Bounces, ReferenceError, cached};
use crate::render::GpuScene;
use crate::scene::Scene;

/// A sweep that cannot go on. What was measured has its records.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// The reference cannot be rendered.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// A record or picture cannot be written.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The device is gone.
    #[error(
        "{point}: {source}; this point has no record: start again to go on with it, or leave it \
         out with --grid"
    )]
    Lost {
        /// The point that was being measured, in words.
        point: String,
        /// What the driver said.
        source: Error,
    },
    /// Images that cannot be compared.
    #[error(transparent)]
    Metric(#[from] MetricError),
}

/// What a sweep is doing.
#[derive(Clone, Copy)]
pub enum Progress<'p> {
    /// It takes the reference at this number of bounces from the cache, or renders it.
    Reference(Bounces),
    /// It measures a case.
    Case(&'p Case),
    /// It has measured a point.
    Done(&'p Point),
    /// It leaves out a measurement: the device refused the case in the round before.
    Refused,
    /// It begins with so many measurements: all rounds, or what is measured once more.
    Begin(usize),
}

/// One scene on one device.
pub struct Sweep<'s> {
    gpu: &'s Gpu,
    scene: &'s Scene,
    settings: &'s BenchSettings,
    setup: SweepSetup,
}

struct Reference {
    bounces: Bounces,
    full: Image,
    exposure: f32,
    truth: Truth,
}

impl<'s> Sweep<'s> {
    /// `max_error` is the reference's: the relative standard error of its 8×8-pixel means.
    pub fn new(
        gpu: &'s Gpu,
        scene: &'s Scene,
        settings: &'s BenchSettings,
        max_error: f64,
    ) -> Self {
        Sweep {
            gpu,
            scene,
            settings,
            setup: SweepSetup::new(gpu, scene, settings, max_error),
        }
    }

    /// The cases of which a measurement is missing.
    pub fn missing<'c>(&self, cases: &'c [Case], records: &Records<Point>) -> Vec<&'c Case> {
        let mut plan = self.rounds(cases, records);
        if plan.is_empty() {
            plan = self.unsure(cases, records);
        }
        let is_missing = |case: &&Case| plan.iter().any(|(_, other)| std::ptr::eq(*case, *other));
        cases.iter().filter(is_missing).collect()
    }

    /// Whether the scene of another sweep differs from this one in its camera alone, as far as
    /// views of one scene can differ.
    pub fn differs_in_camera_alone(&self, other: &Sweep<'_>) -> bool {
        (&self.scene.lights, &self.scene.environment)
            == (&other.scene.lights, &other.scene.environment)
            && self.scene.vertices == other.scene.vertices
    }

    /// Whether another sweep measures the same view of the same scene.
    pub fn is_of_same_view(&self, other: &Sweep<'_>) -> bool {
        self.setup.scene_hash == other.setup.scene_hash
    }

    /// Name of the scene.
    pub fn scene_name(&self) -> &str {
        &self.scene.name
    }

    /// The key of a case's records.
    pub fn key(&self, case: &Case) -> String {
        self.setup.key(case)
    }

    /// The records of the cases that have one, all rounds, in the order of the cases.
    pub fn points(&self, cases: &[Case], records: &Records<Point>) -> Vec<Point> {
        cases
            .iter()
            .flat_map(|case| records.rounds(&self.setup.key(case)))
            .cloned()
            .collect()
    }

    /// Takes the missing measurements of cases, writes their pictures, then their records. `cache`
    /// is the folder of references. Each case is measured in several rounds, with a share of the
    /// frames and builds in each, and the orders of the rounds even out a machine that gets slower
    /// or faster. At the end the front is measured once more, and what may be on it.
    pub fn measure(
        &self,
        cases: &[Case],
        cache: &Path,
        records: &mut Records<Point>,
        pictures: &PictureFolder,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<(), SweepError> {
        let mut run = self.start(cache, pictures);
        for plan in [Self::rounds, Self::unsure] {
            let plan = plan(self, cases, records);
            progress(Progress::Begin(plan.len()));
            for (round, case) in plan {
                run.measure(case, round, records, progress)?;
            }
        }
        Ok(())
    }

    /// Begins to measure single points, in an order that someone else chooses. `cache` is the
    /// folder of references.
    pub fn start<'r>(&'r self, cache: &'r Path, pictures: &'r PictureFolder) -> SweepRun<'r> {
        SweepRun {
            sweep: self,
            cache,
            pictures,
            uploaded: None,
            references: Vec::new(),
            compiled: BTreeSet::new(),
        }
    }

    /// Frames that one round of a case renders, on the mean, or a little more.
    pub fn frames_of(&self, case: &Case) -> f64 {
        let measured = f64::from(self.settings.frames) / f64::from(self.round_count());
        f64::from(warm_up_frames(case)) + measured
    }

    /// The measurements of the rounds that are missing.
    fn rounds<'c>(&self, cases: &'c [Case], records: &Records<Point>) -> Vec<(u32, &'c Case)> {
        (1..=self.round_count())
            .flat_map(|round| {
                let order = order(cases.len(), round).into_iter();
                order.map(move |index| (round, &cases[index]))
            })
            .filter(|(round, case)| self.is_missing(case, *round, records))
            .collect()
    }

    /// The measurements of one more round that are missing: of the cases that are on a front, or
    /// may be by the spread of their times. Only the rounds before it say which these are, so that
    /// a run that was stopped goes on with the same.
    fn unsure<'c>(&self, cases: &'c [Case], records: &Records<Point>) -> Vec<(u32, &'c Case)> {
        let more = self.round_count() + 1;
        let mut measured = self.points(cases, records);
        measured.retain(|point| point.failure.is_none() && point.round() < more);
        let section = Section::new(measured, None);
        let groups = Cost::ALL.iter().flat_map(|cost| section.groups(*cost));
        let unsure: BTreeSet<String> = groups
            .flat_map(|group| group.points.into_iter().zip(near_front(&group.prices)))
            .filter(|(_, is_near)| *is_near)
            .map(|(index, _)| section.points[index].key.clone())
            .collect();
        order(cases.len(), more)
            .into_iter()
            .map(|index| (more, &cases[index]))
            .filter(|(round, case)| {
                unsure.contains(&self.setup.key(case)) && self.is_missing(case, *round, records)
            })
            .collect()
    }

    /// Whether a case has no record of a round. What the device refused has no further rounds.
    pub fn is_missing(&self, case: &Case, round: u32, records: &Records<Point>) -> bool {
        let known = records.rounds(&self.setup.key(case));
        !known
            .iter()
            .any(|point| point.round() == round || point.failure.is_some())
    }

    /// Rounds over which frames and builds are spread; each has at least one of both.
    pub fn round_count(&self) -> u32 {
        let BenchSettings {
            frames, rebuilds, ..
        } = *self.settings;
        ROUNDS.min(frames).min(rebuilds)
    }

    /// How to measure in a round: with its share of the frames and builds. The round that is one
    /// more has the last one's.
    fn round_settings(&self, round: u32, is_compiled: bool) -> BenchSettings {
        let rounds = self.round_count();
        let round = round.min(rounds);
        let share = |total: u32| total * round / rounds - total * (round - 1) / rounds;
        let frames = share(self.settings.frames);
        BenchSettings {
            // A first frame that is slower hardly moves the median of three.
            warm_up: !is_compiled || frames < 3,
            frames,
            rebuilds: share(self.settings.rebuilds),
            ..self.settings.clone()
        }
    }

    fn reference(&self, bounces: Bounces, cache: &Path) -> Result<Reference, SweepError> {
        let (size, asked) = (self.setup.size, self.setup.max_error);
        let image = cached(
            self.scene,
            &Truth::settings(size, bounces, asked, self.setup.visibility),
            cache,
            &|_| {},
        )?;
        let full = image.radiance();
        let truth = Truth::of(image, bounces, self.setup.visibility);
        let noise = truth
            .image
            .as_ref()
            .map_or(0.0, |(_, info)| info.pixel_noise);
        let reached = noise / f64::from(BLOCK_PX);
        if reached > NEAR * asked {
            log::warn!(
                "{}: the reference's standard error is {reached:.2e}, above the {asked} that is \
                 asked for; it has at most {MAX_SPP} samples a pixel",
                self.scene.name
            );
        }
        Ok(Reference {
            bounces,
            exposure: exposure_of(&full),
            full,
            truth,
        })
    }
}

/// What a sweep keeps from point to point: the scene on the device, and references.
pub struct SweepRun<'r> {
    sweep: &'r Sweep<'r>,
    cache: &'r Path,
    pictures: &'r PictureFolder,
    uploaded: Option<GpuScene>,
    references: Vec<Reference>,
    /// Keys of the cases that it has measured: their pipelines are compiled.
    compiled: BTreeSet<String>,
}

impl SweepRun<'_> {
    /// The scene on the device, between two points. A run whose scene differs in its camera alone
    /// can go on with it.
    pub fn uploaded(&mut self) -> &mut Option<GpuScene> {
        &mut self.uploaded
    }

    /// Takes a reference from the cache or renders it, and writes its picture; where that is done,
    /// nothing more. Returns the standard error of its 8×8-pixel means, relative to their mean;
    /// `None` where it shows no light.
    pub fn prepare(
        &mut self,
        bounces: Bounces,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Option<f64>, SweepError> {
        let index = self.reference(bounces, progress)?;
        let truth = self.references[index].truth.image.as_ref();
        let is_lit = |image: &Image| image.pixels.iter().any(|pixel| pixel.max_element() > 0.0);
        let truth = truth.filter(|(image, _)| is_lit(image));
        Ok(truth.map(|(_, info)| info.pixel_noise / f64::from(BLOCK_PX)))
    }

    /// Index of a reference.
    fn reference(
        &mut self,
        bounces: Bounces,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<usize, SweepError> {
        let mut known = self.references.iter();
        if let Some(index) = known.position(|reference| reference.bounces == bounces) {
            return Ok(index);
        }
        progress(Progress::Reference(bounces));
        let reference = self.sweep.reference(bounces, self.cache)?;
        self.pictures.write_picture(
            &self.sweep.setup.reference_key(bounces),
            &reference.full,
            reference.exposure,
        )?;
        self.references.push(reference);
        Ok(self.references.len() - 1)
    }

    /// Measures a case in a round, unless it has a record of it: writes its pictures, then its
    /// record.
    pub fn measure(
        &mut self,
        case: &Case,
        round: u32,
        records: &mut Records<Point>,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<(), SweepError> {
        let sweep = self.sweep;
        if !sweep.is_missing(case, round, records) {
            progress(Progress::Refused);
            return Ok(());
        }
        let index = self.reference(sweep.setup.bounces_of(case), progress)?;
        let reference = &self.references[index];
        progress(Progress::Case(case));
        let is_compiled = !self.compiled.insert(sweep.key(case));
        let (report, taken) = measure_on(
            sweep.gpu,
            &mut self.uploaded,
            sweep.scene,
            case,
            &sweep.round_settings(round, is_compiled),
            &reference.truth,
        );
        let point = Point {
            round: Some(round),
            ..Point::new(&sweep.setup, case, &report)
        };
        match taken {
            Ok(taken) => write_pictures(self.pictures, &point.key, &taken, reference, &report)?,
            Err(source @ (Error::DeviceLost { .. } | Error::Vulkan { .. })) => {
                return Err(SweepError::Lost {
                    point: point.name(),
                    source,
                });
            }
            // What the device refuses once it refuses always: the point's record says so.
            Err(_) => {}
        }
        records.add(&point)?;
        progress(Progress::Done(&point));
        Ok(())
    }
}

/// The order of a round. Neighbours are far apart, by the fractional parts of multiples of the
/// golden ratio, so that a busy machine slows no technique more than another. Every second round
/// goes backwards: what comes early in one comes late in the other, and a machine that gets slower
/// all the time slows the mean of the two equally everywhere.
pub(super) fn order(count: usize, round: u32) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    let place = |index: &usize| (*index as f64 * GOLDEN_RATIO).fract();
    order.sort_by(|a, b| place(a).total_cmp(&place(b)));
    if round.is_multiple_of(2) {
        order.reverse();
    }
    order
}

const GOLDEN_RATIO: f64 = 1.618_033_988_749_895;

/// Rounds of a sweep. A round costs one build more for each point.
const ROUNDS: u32 = 2;

/// So many times the error that was asked for is as good: it is estimated.
const NEAR: f64 = 1.5;

fn write_pictures(
    folder: &PictureFolder,
    key: &str,
    taken: &Pictures,
    reference: &Reference,
    report: &Report,
) -> Result<(), SweepError> {
    folder.write_picture(key, &taken.full, reference.exposure)?;
    if let (Some((truth, _)), Some(error)) = (&reference.truth.image, &report.error) {
        let scale = (error.pixel.mean_reference as f32).max(f32::MIN_POSITIVE);
        folder.write_error(key, &error_image(&taken.compared, truth)?, scale)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_measure_all_and_even_out() {
        for count in [1, 2, 7, 118] {
            let places = [1, 2].map(|round| {
                let mut places = vec![None; count];
                for (place, index) in order(count, round).into_iter().enumerate() {
                    assert_eq!(places[index].replace(place), None, "measured twice");
                }
                places
            });
            for (one, other) in places[0].iter().zip(&places[1]) {
                let sum = one.zip(*other).map(|(one, other)| one + other);
                assert_eq!(sum, Some(count - 1), "{count} points");
            }
        }
    }
}
