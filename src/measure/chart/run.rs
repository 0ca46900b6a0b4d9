//! Measuring the points of a sweep that have no record yet.

use std::collections::BTreeSet;
use std::path::Path;

use super::front::front;
use super::machine::{is_unsteady, slowness};
use super::pictures::PictureFolder;
use super::point::{Cost, Point, SweepSetup, bounces_of};
use super::section::Section;
use crate::graph::{Error, Gpu};
use crate::image::Image;
use crate::measure::bench::{BenchSettings, Case, MAX_SPP, Pictures, Truth, measure_on};
use crate::measure::records::{RecordError, Records};
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
    /// It measures so many points again: the front, and where the machine was not steady.
    Again(usize),
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

    /// The cases that have no record.
    pub fn missing<'c>(&self, cases: &'c [Case], records: &Records<Point>) -> Vec<&'c Case> {
        cases
            .iter()
            .filter(|case| records.find(&self.setup.key(case)).is_none())
            .collect()
    }

    /// The records of the cases that have one, in the order of the cases.
    pub fn points(&self, cases: &[Case], records: &Records<Point>) -> Vec<Point> {
        cases
            .iter()
            .filter_map(|case| records.find(&self.setup.key(case)).cloned())
            .collect()
    }

    /// Measures cases, writes their pictures, then their records. `cache` is the folder of
    /// references. The order is mixed, so that a busy machine slows no technique more than another.
    /// At the end the front is measured again, and each point at which the machine was not steady.
    pub fn measure(
        &self,
        cases: &[&Case],
        cache: &Path,
        records: &mut Records<Point>,
        pictures: &PictureFolder,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<(), SweepError> {
        let mut run = Run {
            sweep: self,
            cache,
            pictures,
            uploaded: None,
            references: Vec::new(),
        };
        for case in mixed(cases) {
            run.measure(case, records, progress)?;
        }
        let again = self.unsure(cases, records);
        progress(Progress::Again(again.len()));
        for case in again {
            run.measure(case, records, progress)?;
        }
        Ok(())
    }

    /// The cases on a front, and those at which the machine was not steady.
    fn unsure<'c>(&self, cases: &[&'c Case], records: &Records<Point>) -> Vec<&'c Case> {
        let measured: Vec<(&Case, Point)> = cases
            .iter()
            .filter_map(|case| Some((*case, records.find(&self.setup.key(case))?.clone())))
            .filter(|(_, point)| point.failure.is_none())
            .collect();
        let points: Vec<Point> = measured.iter().map(|(_, point)| point.clone()).collect();
        let slowness = slowness(&points);
        let section = Section::new(points, None);
        let on_front: BTreeSet<usize> = Cost::ALL
            .iter()
            .flat_map(|cost| section.groups(*cost))
            .flat_map(|group| {
                let points = group.points.clone();
                front(&group.prices)
                    .into_iter()
                    .map(move |member| points[member])
            })
            .collect();
        (0..measured.len())
            .filter(|index| on_front.contains(index) || is_unsteady(slowness[*index]))
            .map(|index| measured[index].0)
            .collect()
    }

    fn reference(&self, bounces: Bounces, cache: &Path) -> Result<Reference, SweepError> {
        let (size, asked) = (self.setup.size, self.setup.max_error);
        let image = cached(
            self.scene,
            &Truth::settings(size, bounces, asked),
            cache,
            &|_| {},
        )?;
        let reached = f64::from(image.indirect_error().pixel) / f64::from(BLOCK_PX);
        if reached > NEAR * asked {
            log::warn!(
                "{}: the reference's standard error is {reached:.2e}, above --max-error {asked}; \
                 it has at most {MAX_SPP} samples a pixel",
                self.scene.name
            );
        }
        let full = image.radiance();
        Ok(Reference {
            bounces,
            exposure: exposure_of(&full),
            full,
            truth: Truth::of(image, bounces),
        })
    }
}

/// What a sweep keeps from point to point.
struct Run<'r> {
    sweep: &'r Sweep<'r>,
    cache: &'r Path,
    pictures: &'r PictureFolder,
    uploaded: Option<GpuScene>,
    references: Vec<Reference>,
}

impl Run<'_> {
    fn measure(
        &mut self,
        case: &Case,
        records: &mut Records<Point>,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<(), SweepError> {
        let (sweep, bounces) = (self.sweep, bounces_of(case));
        let known = self
            .references
            .iter()
            .position(|reference| reference.bounces == bounces);
        let index = match known {
            Some(index) => index,
            None => {
                progress(Progress::Reference(bounces));
                let reference = sweep.reference(bounces, self.cache)?;
                self.pictures.write_picture(
                    &sweep.setup.reference_key(bounces),
                    &reference.full,
                    reference.exposure,
                )?;
                self.references.push(reference);
                self.references.len() - 1
            }
        };
        let reference = &self.references[index];
        progress(Progress::Case(case));
        let (report, taken) = measure_on(
            sweep.gpu,
            &mut self.uploaded,
            sweep.scene,
            case,
            sweep.settings,
            &reference.truth,
        );
        let point = Point::new(&sweep.setup, case, &report);
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

/// The cases in an order in which neighbours are far apart: by the fractional parts of multiples of
/// the golden ratio.
fn mixed<'c>(cases: &[&'c Case]) -> Vec<&'c Case> {
    let mut order: Vec<usize> = (0..cases.len()).collect();
    let place = |index: &usize| (*index as f64 * GOLDEN_RATIO).fract();
    order.sort_by(|a, b| place(a).total_cmp(&place(b)));
    order.into_iter().map(|index| cases[index]).collect()
}

const GOLDEN_RATIO: f64 = 1.618_033_988_749_895;

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
    if let (Some((indirect, _)), Some(error)) = (&reference.truth.indirect, &report.error) {
        let scale = (error.pixel.mean_reference as f32).max(f32::MIN_POSITIVE);
        folder.write_error(key, &error_image(&taken.indirect, indirect)?, scale)?;
    }
    Ok(())
}
