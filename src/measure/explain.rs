//! Error budgets: how much error a technique has left when one of its approximations is replaced by
//! the truth, or by a better one.

use serde::Serialize;

use crate::frame::{FrameSettings, Renderer};
use crate::gi::entry::Substitution;
use crate::gi::inspect::{LightSlots, SlotLight};
use crate::gi::settings::RESOLUTION;
use crate::gi::{SettingError, Settings};
use crate::graph::{Error, Gpu};
use crate::image::{Aov, Image};
use crate::metrics::{Channel, Comparison, Errors, MetricError, compare};
use crate::reference::{ReferenceError, gather, light_surfaces, surface_area_m2};
use crate::render::ShadowSettings;
use crate::scene::{LitPoint, Scene, SurfacePoint};

use super::bench::{Case, Truth, warm_up_frames};
use super::report::{ErrorReport, MaterialError, Report, named, shadow_changes};
use super::table::value_text;

/// Points that exact light is measured at, along the distance from slot to slot.
const POINTS_ALONG: f32 = 4.0;

/// At most this many points in all.
const MOST_POINTS: f64 = 16e6;

/// Rays a pixel where the scene itself is gathered.
const EXACT_DIRECTIONS: u32 = 256;

/// Shadow maps are made this many times as wide.
const FINER_MAPS: u32 = 2;

/// Widest shadow map (texels).
const WIDEST_MAP: u32 = 8192;

/// The first row.
const AS_IT_IS: &str = "as it is";

/// Rows of exact light and rays, where the store has slots for light.
const EXACT_ROWS: usize = 3;

/// Rows of smaller cells.
const CELL_ROWS: usize = 2;

/// What became of the error with something replaced.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What is replaced.
    pub name: String,
    /// What it is replaced by, in one line.
    pub help: String,
    /// How to do likewise, as options of the command line; empty where only an error budget can.
    pub options: Vec<String>,
    /// The error, over blocks where there are blocks, else over pixels; `None` where it could not
    /// be measured.
    pub error: Option<Errors>,
    /// The same of each material, most pixels first; empty where it could not be measured.
    pub materials: Vec<MaterialError>,
    /// Share of the squared error that is gone, 1 − MSE / MSE of the first row; below 0 where it
    /// is larger.
    pub explains: Option<f64>,
    /// Time of a frame, all passes (ms); `None` where it was not rendered by the technique alone.
    pub frame_ms: Option<f64>,
    /// Why there is no error.
    pub failure: Option<String>,
}

/// An error budget.
#[derive(Clone, Debug, Serialize)]
pub struct Budget {
    /// The technique as it is.
    #[serde(flatten)]
    pub report: Report,
    /// Nothing replaced first, then one thing each.
    pub budget: Vec<Row>,
    /// Error of the reference at the technique's bounce count against all bounces: what no setting
    /// but `bounces` brings. `None` where all were asked for.
    pub left_out: Option<Errors>,
}

/// Where the error on a material comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialBudget {
    /// Name of the material.
    pub material: String,
    /// Its share of the pixels that see a surface.
    pub pixels: f64,
    /// Its error with nothing replaced.
    pub error: Errors,
    /// The replacement that takes most of its squared error away, and the share that it takes;
    /// `None` where none takes any.
    pub source: Option<(String, f64)>,
}

impl Budget {
    /// The materials that have at least this share of the pixels, most pixels first.
    pub fn by_material(&self, least: f64) -> Vec<MaterialBudget> {
        let Some((first, replaced)) = self.budget.split_first() else {
            return Vec::new();
        };
        let count: usize = first
            .materials
            .iter()
            .map(|errors| errors.pixel.count)
            .sum();
        let share = |errors: &MaterialError| errors.pixel.count as f64 / count.max(1) as f64;
        let of = |(place, errors): (usize, &MaterialError)| {
            let error = errors.errors();
            let gone = |row: &Row| {
                let left = row.materials.get(place)?.errors().rel_rmse / error.rel_rmse;
                Some((row.name.clone(), 1.0 - left.powi(2)))
            };
            let gains = replaced.iter().filter_map(gone);
            MaterialBudget {
                material: errors.material.clone(),
                pixels: share(errors),
                error,
                source: gains
                    .filter(|(_, gone)| *gone > 0.0)
                    .max_by(|a, b| a.1.total_cmp(&b.1)),
            }
        };
        let materials = first.materials.iter().enumerate();
        materials
            .filter(|(_, errors)| share(errors) >= least)
            .map(of)
            .collect()
    }
}

/// Why there is no error budget.
#[derive(Debug, thiserror::Error)]
pub enum ExplainError {
    /// The technique cannot be rendered.
    #[error(transparent)]
    Gpu(#[from] Error),
    /// The scene cannot be traced.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// There is nothing to compare with.
    #[error(transparent)]
    Metric(#[from] MetricError),
    /// A substitution asks for what the technique does not have.
    #[error("the substitution {name}: {source}")]
    Setting {
        /// The substitution.
        name: &'static str,
        /// What is wrong with it.
        source: SettingError,
    },
}

/// What the error budget is made for.
pub struct Subject<'s> {
    /// The device that renders.
    pub gpu: &'s Gpu,
    /// The scene that is rendered.
    pub scene: &'s Scene,
    /// The technique with its settings.
    pub case: &'s Case,
    /// What all techniques share.
    pub frame: FrameSettings,
    /// Whether luminances are compared, or red, green and blue each.
    pub channel: Channel,
    /// The reference at the technique's bounce count.
    pub truth: &'s Truth,
}

/// What is done next.
#[derive(Clone, Copy, Debug)]
pub struct Step<'n> {
    /// What is replaced.
    pub name: &'n str,
    /// Rows that are done.
    pub done: usize,
    /// Rows of the whole budget, as far as it is known.
    pub rows: usize,
}

/// Measures the error budget. `progress` is told what is replaced next; `all_bounces` is the
/// reference with all of them.
pub fn explain(
    subject: &Subject<'_>,
    all_bounces: Option<&Image>,
    progress: &dyn Fn(Step<'_>),
) -> Result<Budget, ExplainError> {
    let Subject {
        gpu,
        scene,
        case,
        frame,
        channel,
        truth,
    } = *subject;
    let (reference, info) = truth
        .image
        .as_ref()
        .ok_or(MetricError::Empty("an error budget needs the reference"))?;
    let mut table = Table {
        subject,
        reference,
        rows: Vec::new(),
        planned: subject.row_count()?,
        progress,
    };
    table.tell(AS_IT_IS);
    let (mut renderer, picture) = subject.render(&case.settings, frame, None)?;
    if renderer.light_slots()?.is_some() {
        table.planned += EXACT_ROWS;
    }
    let mut report = Report {
        preset: case.preset.clone(),
        shadow_resolution: Some(frame.shadows.resolution),
        shadows: shadow_changes(&frame.shadows),
        reference: Some(*info),
        ..Report::new(
            gpu,
            &scene.name,
            frame.size,
            case.entry.name,
            &case.settings,
        )
    };
    report.set_counts(&renderer.counts_of_report()?);
    report.set_energy(renderer.energy()?);
    report.error = Some(ErrorReport::of(
        Aov::Indirect,
        [&picture.indirect, reference],
        scene,
        &truth.guide,
        channel,
    )?);
    table.add(AS_IT_IS, "", Vec::new(), || Ok(picture.clone()))?;
    table.add_exact(&mut renderer, &picture)?;
    drop(renderer);
    table.add_maps()?;
    table.add_settings()?;
    table.add_resolution(&picture)?;
    let mut rows = table.rows;
    let whole = rows
        .first()
        .and_then(|row| row.error)
        .map_or(0.0, |error| error.rel_rmse.powi(2));
    for row in &mut rows {
        row.explains = row
            .error
            .filter(|_| whole > 0.0)
            .map(|error| 1.0 - error.rel_rmse.powi(2) / whole);
    }
    let left_out = all_bounces
        .map(|all| subject.error(reference, all))
        .transpose()?;
    Ok(Budget {
        report,
        budget: rows,
        left_out,
    })
}

/// A better setting, the settings with it, and the options that ask for it.
type Better = (&'static Substitution, Settings, Vec<String>);

/// A picture of the indirect light.
#[derive(Clone)]
struct Picture {
    indirect: Image,
    /// Time of a frame (ms), where the technique alone made it.
    frame_ms: Option<f64>,
}

impl<'s> Subject<'s> {
    /// Renders one picture, with the light of `points` in the technique's slots where it is given.
    fn render(
        &self,
        settings: &Settings,
        frame: FrameSettings,
        points: Option<&[LitPoint]>,
    ) -> Result<(Renderer<'s>, Picture), Error> {
        let (mut renderer, _) =
            Renderer::new(self.gpu, self.scene, self.case.entry, settings, frame)?;
        if let (Some(points), Some(mut slots)) = (points, renderer.light_slots()?) {
            give_light(self.gpu, &mut *slots, points)?;
        }
        (0..warm_up_frames(self.case))
            .try_for_each(|_| renderer.render(&self.scene.camera).map(drop))?;
        let frame_ms =
            Some(renderer.render(&self.scene.camera)?.total_ms()).filter(|_| points.is_none());
        let indirect = renderer.aov(Aov::Indirect)?;
        Ok((renderer, Picture { indirect, frame_ms }))
    }

    /// The rows that do not depend on what the technique keeps.
    fn row_count(&self) -> Result<usize, ExplainError> {
        let maps = usize::from(self.finer_maps().is_some());
        let cells = usize::from(self.finer_cells().is_some()) * CELL_ROWS;
        Ok(1 + maps + self.substitutions()?.len() + cells)
    }

    /// How wide finer shadow maps are; `None` where there are none.
    fn finer_maps(&self) -> Option<u32> {
        let now = self.frame.shadows.resolution;
        let finer = (FINER_MAPS * now).min(WIDEST_MAP);
        (!self.scene.lights.is_empty() && finer > now).then_some(finer)
    }

    /// The better settings that the technique has, with the options that ask for them.
    fn substitutions(&self) -> Result<Vec<Better>, ExplainError> {
        let all = self.case.entry.substitutions.iter().copied().flatten();
        let mut better = Vec::new();
        for substitution in all {
            let pairs = (substitution.pairs)(&self.case.settings);
            if let Some((settings, options)) = self.changed(substitution.name, &pairs)? {
                better.push((substitution, settings, options));
            }
        }
        Ok(better)
    }

    /// The settings with cells half as large; the finest resolution has no double.
    fn finer_cells(&self) -> Option<(Settings, Vec<String>)> {
        let resolution = self.case.settings.resolution()?;
        self.changed("resolution", &[format!("{RESOLUTION}={}", 2 * resolution)])
            .ok()?
    }

    /// The settings with these pairs on top, and the pairs that change something, as options;
    /// `None` where none does.
    fn changed(
        &self,
        name: &'static str,
        pairs: &[String],
    ) -> Result<Option<(Settings, Vec<String>)>, ExplainError> {
        let Case {
            entry, settings, ..
        } = self.case;
        let old: Vec<String> = settings
            .iter()
            .map(|(name, value)| format!("{name}={}", value_text(&value)))
            .collect();
        let all: Vec<String> = old.iter().chain(pairs).cloned().collect();
        let new = entry
            .settings(None, &all)
            .map_err(|source| ExplainError::Setting { name, source })?;
        let options: Vec<String> = pairs
            .iter()
            .filter(|pair| !old.contains(pair))
            .map(|pair| format!("--set {pair}"))
            .collect();
        Ok((new != *settings).then_some((new, options)))
    }

    fn compare(&self, image: &Image, reference: &Image) -> Result<Comparison, MetricError> {
        compare(image, reference, Some(&self.truth.guide), self.channel)
    }

    /// Error over blocks where there are blocks, else over pixels.
    fn error(&self, image: &Image, reference: &Image) -> Result<Errors, MetricError> {
        let comparison = self.compare(image, reference)?;
        Ok(comparison.block.unwrap_or(comparison.pixel))
    }

    /// What the slots of the last frame look like through exact rays, with the technique's glossy
    /// reflections.
    fn gather(&self, renderer: &mut Renderer<'_>) -> Result<Image, ExplainError> {
        let specular = renderer.aov(Aov::Specular)?;
        let Some(slots) = renderer.light_slots()? else {
            return Ok(specular);
        };
        let radiance = slots.radiance(self.gpu)?;
        let seen = |point: &SurfacePoint| {
            let shares = slots.at(point.position, point.normal);
            let seen = shares.into_iter().flat_map(|[seen, _]| seen);
            seen.map(|share| share.seen * radiance[share.slot]).sum()
        };
        let diffuse = gather(self.scene, self.frame.size, EXACT_DIRECTIONS, &seen)?;
        Ok(Image::from_fn(diffuse.width, diffuse.height, |i| {
            diffuse.pixels[i] + specular.pixels[i]
        }))
    }
}

/// Puts the light of points of the surfaces into slots. Slots without a point stay holes.
pub fn give_light(gpu: &Gpu, slots: &mut dyn LightSlots, points: &[LitPoint]) -> Result<(), Error> {
    let mut light = vec![SlotLight::default(); slots.count()];
    for LitPoint { surface, radiance } in points {
        let Some(sides) = slots.at(surface.position, surface.normal) else {
            continue;
        };
        for (side, shares) in sides.iter().enumerate() {
            for share in shares {
                let slot = &mut light[share.slot];
                slot.radiance += share.area * radiance[side];
                slot.areas[side] += share.area;
            }
        }
    }
    slots.set_direct(gpu, &light)
}

/// The rows so far.
struct Table<'t, 's> {
    subject: &'t Subject<'s>,
    reference: &'t Image,
    rows: Vec<Row>,
    /// Rows that there will be.
    planned: usize,
    progress: &'t dyn Fn(Step<'_>),
}

impl Table<'_, '_> {
    fn tell(&self, name: &str) {
        (self.progress)(Step {
            name,
            done: self.rows.len(),
            rows: self.planned,
        });
    }

    /// Adds a row with the error of a picture; what the device refuses is told in it.
    fn add(
        &mut self,
        name: &str,
        help: &str,
        options: Vec<String>,
        make: impl FnOnce() -> Result<Picture, ExplainError>,
    ) -> Result<(), ExplainError> {
        self.tell(name);
        let unmeasured = Row {
            name: name.into(),
            help: help.into(),
            options,
            error: None,
            materials: Vec::new(),
            explains: None,
            frame_ms: None,
            failure: None,
        };
        self.rows.push(match make() {
            Ok(Picture { indirect, frame_ms }) => {
                let comparison = self.subject.compare(&indirect, self.reference)?;
                Row {
                    error: Some(comparison.block.unwrap_or(comparison.pixel)),
                    materials: named(comparison.materials, self.subject.scene),
                    frame_ms,
                    ..unmeasured
                }
            }
            Err(ExplainError::Gpu(failure)) => Row {
                failure: Some(failure.to_string()),
                ..unmeasured
            },
            Err(other) => return Err(other),
        });
        Ok(())
    }

    /// The reference's own light in the slots, its own rays to them, and both.
    fn add_exact(
        &mut self,
        renderer: &mut Renderer<'_>,
        picture: &Picture,
    ) -> Result<(), ExplainError> {
        let subject = self.subject;
        let Some(spacing_m) = renderer.light_slots()?.map(|slots| slots.spacing()) else {
            return Ok(());
        };
        self.tell("direct light");
        let spacing_m = (spacing_m / POINTS_ALONG)
            .max((surface_area_m2(subject.scene) / MOST_POINTS).sqrt() as f32);
        // The slots that exact rays see have to hold what surfaces emit, too.
        let whole = if subject.scene.is_emissive() {
            let Case {
                entry, settings, ..
            } = subject.case;
            subject.changed("visibility", &(entry.emission_in_slots)(settings))?
        } else {
            None
        };
        let seen = match &whole {
            Some((settings, _)) => {
                subject.gather(&mut subject.render(settings, subject.frame, None)?.0)?
            }
            None => subject.gather(renderer)?,
        };
        let points = light_surfaces(subject.scene, spacing_m)?;
        let lit = subject.render(&subject.case.settings, subject.frame, Some(&points));
        let (exact, both) = match (lit, &whole) {
            (Ok((_, exact)), Some((settings, _))) => (
                Ok(exact),
                subject.gather(&mut subject.render(settings, subject.frame, Some(&points))?.0),
            ),
            (Ok((mut renderer, exact)), None) => (Ok(exact), subject.gather(&mut renderer)),
            (Err(failure), _) => (Err(failure), Ok(picture.indirect.clone())),
        };
        drop(points);
        let light =
            "exact shadow rays light the store: each side of a cell gets the mean of its surface";
        self.add("direct light", light, Vec::new(), || Ok(exact?))?;
        let rays = format!(
            "{EXACT_DIRECTIONS} exact rays from each pixel read the store's radiance where they end"
        );
        self.add("visibility", &rays, Vec::new(), || {
            Ok(Picture {
                indirect: seen,
                frame_ms: None,
            })
        })?;
        let rest = "both; the error left: a cell, or a side of it, has only one radiance";
        self.add("direct light and visibility", rest, Vec::new(), || {
            Ok(Picture {
                indirect: both?,
                frame_ms: None,
            })
        })
    }

    /// Finer shadow maps.
    fn add_maps(&mut self) -> Result<(), ExplainError> {
        let subject = self.subject;
        let Subject { case, frame, .. } = *subject;
        let Some(shadow_resolution) = subject.finer_maps() else {
            return Ok(());
        };
        let options = vec![format!("--shadow-resolution {shadow_resolution}")];
        let finer = FrameSettings {
            shadows: ShadowSettings {
                resolution: shadow_resolution,
                ..frame.shadows
            },
            ..frame
        };
        self.add(
            "shadow maps",
            "finer shadow maps and reflective shadow maps",
            options,
            || Ok(subject.render(&case.settings, finer, None)?.1),
        )
    }

    /// What the technique has better settings for.
    fn add_settings(&mut self) -> Result<(), ExplainError> {
        let subject = self.subject;
        for (substitution, settings, options) in subject.substitutions()? {
            self.add(substitution.name, substitution.help, options, || {
                Ok(subject.render(&settings, subject.frame, None)?.1)
            })?;
        }
        Ok(())
    }

    /// Cells half as large, and what the two resolutions tell of cells without size.
    fn add_resolution(&mut self, picture: &Picture) -> Result<(), ExplainError> {
        let subject = self.subject;
        let Some((settings, options)) = subject.finer_cells() else {
            return Ok(());
        };
        let mut finer = None;
        self.add("resolution", "cells half as large", options, || {
            let made = subject.render(&settings, subject.frame, None)?.1;
            finer = Some(made.indirect.clone());
            Ok(made)
        })?;
        let Some(finer) = finer else { return Ok(()) };
        let limit = Image::from_fn(finer.width, finer.height, |i| {
            2.0 * finer.pixels[i] - picture.indirect.pixels[i]
        });
        let help = "cells without size, by Richardson's extrapolation of the first order from \
                    the row above";
        self.add("resolution, extrapolated", help, Vec::new(), || {
            Ok(Picture {
                indirect: limit,
                frame_ms: None,
            })
        })
    }
}
