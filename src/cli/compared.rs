//! What of a picture is compared with the reference, as options, and that reference.

use crate::measure::bench::Truth;
use crate::reference::{Bounces, Occlusion, cache_dir, cached};
use crate::scene::Scene;

use super::CliError;
use super::common::check_positive;

/// How the reference counts occluders.
#[derive(clap::Args, Clone, Copy)]
pub(super) struct OcclusionArgs {
    /// In the reference's ambient visibility, surfaces farther away do not count (m) [default: all
    /// do].
    #[arg(long, value_name = "M")]
    occlusion_distance: Option<f32>,
    /// In the reference's ambient visibility, a surface at a distance r counts 1 / (1 + X r), X in
    /// 1/m.
    #[arg(long, value_name = "X", default_value_t = 0.0)]
    occlusion_falloff: f32,
}

impl OcclusionArgs {
    /// The definition.
    pub(super) fn definition(self) -> Result<Occlusion, CliError> {
        check_positive("--occlusion-distance", self.occlusion_distance)?;
        if !(self.occlusion_falloff >= 0.0 && self.occlusion_falloff.is_finite()) {
            return Err(CliError::input(format!(
                "--occlusion-falloff is {}; it must be 0 or more",
                self.occlusion_falloff
            )));
        }
        Ok(Occlusion {
            distance_m: self.occlusion_distance,
            falloff: self.occlusion_falloff,
        })
    }
}

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Compared {
    Indirect,
    Visibility,
}

/// What is compared, and of which definition.
#[derive(clap::Args, Clone, Copy)]
pub(super) struct ComparedArgs {
    /// Compare indirect light, or ambient visibility.
    #[arg(long, value_enum, default_value_t = Compared::Indirect)]
    aov: Compared,
    #[command(flatten)]
    occlusion: OcclusionArgs,
}

impl ComparedArgs {
    /// The definition of the ambient visibility, where that is compared.
    pub(super) fn visibility(self) -> Result<Option<Occlusion>, CliError> {
        let definition = self.occlusion.definition()?;
        match self.aov {
            Compared::Visibility => Ok(Some(definition)),
            Compared::Indirect if definition == Occlusion::default() => Ok(None),
            Compared::Indirect => Err(CliError::input(
                "--occlusion-distance and --occlusion-falloff are of the ambient visibility; add \
                 --aov visibility",
            )),
        }
    }
}

/// What is compared of the reference, to a standard error: the indirect light, or the ambient
/// visibility of a definition. It is from the cache where it is there.
pub(super) fn reference(
    scene: &Scene,
    size: [u32; 2],
    bounces: Bounces,
    (max_error, visibility): (f64, Option<Occlusion>),
) -> Result<Truth, CliError> {
    let image = cached(
        scene,
        &Truth::settings(size, bounces, max_error, visibility),
        &cache_dir(),
        &|_| {},
    )
    .map_err(CliError::input)?;
    Ok(Truth::of(image, bounces, visibility))
}

/// An error unless the reference's noise can be brought below this.
pub(super) fn check_max_error(max_error: f64) -> Result<(), CliError> {
    check_positive("--max-error", Some(max_error as f32))
}
