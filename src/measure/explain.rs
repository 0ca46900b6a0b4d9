//! Error budgets: what becomes of a technique's error when one of its approximations is replaced by
//! the truth, or by a better one.

use glam::Vec3;
use serde::Serialize;

use crate::frame::{FrameSettings, Renderer};
use crate::gi::shared::voxel::VoxelMap;
use crate::gi::{LitVoxels, SettingError, Settings};
use crate::graph::{Error, Gpu};
use crate::image::{Aov, Image};
use crate::metrics::{Channel, Errors, MetricError, compare};
use crate::reference::{
    LitPoint, ReferenceError, SurfacePoint, gather, light_surfaces, surface_area_m2,
};
use crate::scene::Scene;

use super::bench::{Case, Truth, warm_up_frames};
use super::report::{ErrorReport, Report};
use super::table::value_text;

/// Points that exact light is measured at, along the edge of a voxel face.
const POINTS_ALONG: f32 = 4.0;

/// At most so many points in all.
const MOST_POINTS: f64 = 16e6;

/// Rays a pixel where the scene itself is gathered.
const EXACT_DIRECTIONS: u32 = 256;

/// Shadow maps are made so many times as wide.
const FINER_MAPS: u32 = 2;

/// Widest shadow map (texels).
const WIDEST_MAP: u32 = 8192;

/// What became of the error with something replaced.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What is replaced.
    pub name: String,
    /// By what.
    pub help: String,
    /// How to do likewise, as options of the command line; empty where only an error budget can.
    pub options: Vec<String>,
    /// The error, over blocks where there are blocks, else over pixels; `None` where it could not
    /// be measured.
    pub error: Option<Errors>,
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

/// What an error is taken of.
pub struct Subject<'s> {
    /// The device.
    pub gpu: &'s Gpu,
    /// The scene.
    pub scene: &'s Scene,
    /// The technique with its settings.
    pub case: &'s Case,
    /// What all techniques share.
    pub frame: FrameSettings,
    /// What of a colour is compared.
    pub channel: Channel,
    /// The reference at the technique's bounce count.
    pub truth: &'s Truth,
}

/// Measures the error budget. `progress` is told what is replaced next; `all_bounces` is the
/// reference with all of them.
pub fn explain(
    subject: &Subject<'_>,
    all_bounces: Option<&Image>,
    progress: &dyn Fn(&str),
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
        .indirect
        .as_ref()
        .ok_or(MetricError::Empty("an error budget needs the reference"))?;
    progress("as it is");
    let (mut renderer, picture) = subject.render(&case.settings, frame, None)?;
    let mut report = Report {
        preset: case.preset.clone(),
        shadow_resolution: Some(frame.shadow_resolution),
        reference: Some(*info),
        ..Report::new(
            gpu,
            &scene.name,
            frame.size,
            case.entry.name,
            &case.settings,
        )
    };
    report.set_counts(&renderer.counts()?);
    report.error = Some(ErrorReport::of(
        Aov::Indirect,
        [&picture.indirect, reference],
        scene,
        &truth.guide,
        channel,
    )?);
    let mut table = Table {
        subject,
        reference,
        rows: Vec::new(),
        progress,
    };
    table.add("as it is", "", Vec::new(), || Ok(picture.clone()))?;
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

/// A picture of the indirect light.
#[derive(Clone)]
struct Picture {
    indirect: Image,
    /// Time of a frame (ms), where the technique alone made it.
    frame_ms: Option<f64>,
}

impl<'s> Subject<'s> {
    /// Renders one picture, with the light of `points` in the voxels where it is given.
    fn render(
        &self,
        settings: &Settings,
        frame: FrameSettings,
        points: Option<&[LitPoint]>,
    ) -> Result<(Renderer<'s>, Picture), Error> {
        let (mut renderer, _) =
            Renderer::new(self.gpu, self.scene, self.case.entry, settings, frame)?;
        if let Some(points) = points {
            give_light(self.gpu, &mut renderer.lit_voxels(), points)?;
        }
        (0..warm_up_frames(self.case))
            .try_for_each(|_| renderer.render(&self.scene.camera).map(drop))?;
        let frame_ms =
            Some(renderer.render(&self.scene.camera)?.total_ms()).filter(|_| points.is_none());
        let indirect = renderer.aov(Aov::Indirect)?;
        Ok((renderer, Picture { indirect, frame_ms }))
    }

    /// Error over blocks where there are blocks, else over pixels.
    fn error(&self, image: &Image, reference: &Image) -> Result<Errors, MetricError> {
        let comparison = compare(image, reference, Some(&self.truth.guide), self.channel)?;
        Ok(comparison.block.unwrap_or(comparison.pixel))
    }

    /// What the voxels of the last frame look like through exact rays, with the technique's glossy
    /// reflections.
    fn gather(&self, renderer: &mut Renderer<'_>) -> Result<Image, ExplainError> {
        let specular = renderer.aov(Aov::Specular)?;
        let pieces = renderer.lit_voxels();
        let Some(map) = VoxelMap::read(self.gpu, &pieces)? else {
            return Ok(specular);
        };
        let radiance = map.radiance(self.gpu, &pieces)?;
        let seen = |point: &SurfacePoint| {
            map.slots(point.position, point.normal)
                .map_or(Vec3::ZERO, |[slot, _]| radiance[slot])
        };
        let diffuse = gather(self.scene, self.frame.size, EXACT_DIRECTIONS, &seen)?;
        Ok(Image::from_fn(diffuse.width, diffuse.height, |i| {
            diffuse.pixels[i] + specular.pixels[i]
        }))
    }
}

/// Puts the light of points of the surfaces into voxels: of each side the mean over the points in
/// its voxel. Voxels without a point stay holes.
pub fn give_light(
    gpu: &Gpu,
    pieces: &mut [LitVoxels<'_>],
    points: &[LitPoint],
) -> Result<(), Error> {
    let Some(map) = VoxelMap::read(gpu, pieces)? else {
        return Ok(());
    };
    let mut sums = vec![(Vec3::ZERO, 0u32); map.slot_count()];
    for LitPoint {
        surface,
        radiance: [front, back],
    } in points
    {
        let Some([seen, other]) = map.slots(surface.position, surface.normal) else {
            continue;
        };
        sums[seen].0 += *front;
        sums[other].0 += *back;
        sums[seen].1 += 1;
        sums[other].1 += u32::from(other != seen);
    }
    let means: Vec<Option<Vec3>> = sums
        .iter()
        .map(|(sum, count)| (*count > 0).then(|| *sum / *count as f32))
        .collect();
    map.set_direct(gpu, pieces, &means)
}

/// The rows so far.
struct Table<'t, 's> {
    subject: &'t Subject<'s>,
    reference: &'t Image,
    rows: Vec<Row>,
    progress: &'t dyn Fn(&str),
}

impl Table<'_, '_> {
    /// Adds a row with the error of a picture; what the device refuses is told in it.
    fn add(
        &mut self,
        name: &str,
        help: &str,
        options: Vec<String>,
        make: impl FnOnce() -> Result<Picture, ExplainError>,
    ) -> Result<(), ExplainError> {
        (self.progress)(name);
        let (error, frame_ms, failure) = match make() {
            Ok(Picture { indirect, frame_ms }) => (
                Some(self.subject.error(&indirect, self.reference)?),
                frame_ms,
                None,
            ),
            Err(ExplainError::Gpu(failure)) => (None, None, Some(failure.to_string())),
            Err(other) => return Err(other),
        };
        self.rows.push(Row {
            name: name.into(),
            help: help.into(),
            options,
            error,
            explains: None,
            frame_ms,
            failure,
        });
        Ok(())
    }

    /// The reference's own light in the voxels, its own rays to them, and both.
    fn add_exact(
        &mut self,
        renderer: &mut Renderer<'_>,
        picture: &Picture,
    ) -> Result<(), ExplainError> {
        let subject = self.subject;
        let Some(map) = VoxelMap::read(subject.gpu, &renderer.lit_voxels())? else {
            return Ok(());
        };
        let spacing_m = (map.voxel_size() / POINTS_ALONG)
            .max((surface_area_m2(subject.scene) / MOST_POINTS).sqrt() as f32);
        drop(map);
        // Where patches give what surfaces emit, the voxels that the picture sees do not hold it,
        // and those that exact rays see have to.
        let whole = if self.has_patches() {
            self.changed("visibility", &["emissive_patches=0".into()])?
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
            "the lights' light in the voxels is the mean of exact shadow rays from their surfaces";
        self.add("direct light", light, Vec::new(), || Ok(exact?))?;
        let rays = format!(
            "{EXACT_DIRECTIONS} rays a pixel through the scene itself see the voxels' radiance"
        );
        self.add("visibility", &rays, Vec::new(), || {
            Ok(Picture {
                indirect: seen,
                frame_ms: None,
            })
        })?;
        let rest =
            "both: what is left is one radiance for all surface of a voxel, or of a side of it";
        self.add("direct light and visibility", rest, Vec::new(), || {
            Ok(Picture {
                indirect: both?,
                frame_ms: None,
            })
        })
    }

    /// Whether surfaces that emit light the picture by patches.
    fn has_patches(&self) -> bool {
        let Subject {
            scene,
            case: Case { settings, .. },
            ..
        } = self.subject;
        scene.is_emissive()
            && settings.find_choice("shadows") == Some("cones")
            && settings
                .find_count("emissive_patches")
                .is_some_and(|count| count > 0)
    }

    /// Finer shadow maps.
    fn add_maps(&mut self) -> Result<(), ExplainError> {
        let Subject {
            scene, case, frame, ..
        } = *self.subject;
        let shadow_resolution = (FINER_MAPS * frame.shadow_resolution).min(WIDEST_MAP);
        if scene.lights.is_empty() || shadow_resolution <= frame.shadow_resolution {
            return Ok(());
        }
        let subject = self.subject;
        let options = vec![format!("--shadow-resolution {shadow_resolution}")];
        let finer = FrameSettings {
            shadow_resolution,
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
        for substitution in subject.case.entry.substitutions.iter().copied().flatten() {
            let Some((settings, options)) = self.changed(
                substitution.name,
                &(substitution.pairs)(&subject.case.settings),
            )?
            else {
                continue;
            };
            self.add(substitution.name, substitution.help, options, || {
                Ok(subject.render(&settings, subject.frame, None)?.1)
            })?;
        }
        Ok(())
    }

    /// Voxels half as large, and what the two resolutions tell of voxels without size.
    fn add_resolution(&mut self, picture: &Picture) -> Result<(), ExplainError> {
        let subject = self.subject;
        let Some(resolution) = subject.case.settings.find_count("resolution") else {
            return Ok(());
        };
        // The finest resolution has no double.
        let Ok(Some((settings, options))) =
            self.changed("resolution", &[format!("resolution={}", 2 * resolution)])
        else {
            return Ok(());
        };
        let mut finer = None;
        self.add("resolution", "voxels half as large", options, || {
            let made = subject.render(&settings, subject.frame, None)?.1;
            finer = Some(made.indirect.clone());
            Ok(made)
        })?;
        let Some(finer) = finer else { return Ok(()) };
        let limit = Image::from_fn(finer.width, finer.height, |i| {
            2.0 * finer.pixels[i] - picture.indirect.pixels[i]
        });
        let help = "voxels without size, by Richardson's extrapolation of the first order from \
                    the row above";
        self.add("resolution, extrapolated", help, Vec::new(), || {
            Ok(Picture {
                indirect: limit,
                frame_ms: None,
            })
        })
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
        } = self.subject.case;
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
}
