//! The picture that a command writes: size, file, exposure, and a warning where it shows nothing.

use std::cell::OnceCell;
use std::path::{Path, PathBuf};

use glam::Vec3;

use crate::image::{Aov, Image, exposure_to_see, write_exr, write_png};
use crate::scene::Scene;
use crate::text::number;

use super::CliError;
use super::common::{SceneArgs, check_positive, parse_size};
use super::files::Files;
use super::nothing::Nothing;
use super::sequence::Numbered;

/// Which picture of a scene, and where it goes.
#[derive(clap::Args)]
#[command(next_help_heading = "Picture")]
pub(super) struct PictureArgs {
    /// Width and height (px).
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    pub(super) size: (u32, u32),
    /// What to write: full, direct, indirect, diffuse, specular, visibility, emission, albedo,
    /// normal, depth, discontinuity (where pixels share no light: red by position, green by
    /// normal).
    #[arg(long, default_value = "full")]
    pub(super) aov: Aov,
    /// The image: .exr (linear, 32-bit float) or .png (sRGB). A run of # in its name stands for
    /// the number of the frame, from 0 on, and each frame is written.
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: PathBuf,
    /// Factor applied before the clamp of a .png [default: 1; of a model alone, one at which its
    /// picture can be judged].
    #[arg(long, value_name = "X")]
    exposure: Option<f32>,
    /// The exposure that suits the first image that was written.
    #[arg(skip)]
    suiting: OnceCell<f32>,
    /// Write settings and what was measured as JSON.
    #[arg(long, value_name = "FILE.json")]
    pub(super) report: Option<PathBuf>,
}

impl PictureArgs {
    /// Checks before any work that the outputs can be written.
    pub(super) fn check(&self, files: &mut Files, frames: u32) -> Result<(), CliError> {
        check_positive("--exposure", self.exposure)?;
        match Numbered::of(&self.output)? {
            Some(name) => {
                files.write_frames(&name, frames, &["exr", "png"])?;
                warn_of_longer(&name.path(frames));
            }
            None => files.write(&self.output, &["exr", "png"])?,
        }
        self.report
            .iter()
            .try_for_each(|path| files.write(path, &["json"]))
    }

    /// Whether each frame has a file of its own.
    pub(super) fn has_numbers(&self) -> bool {
        matches!(Numbered::of(&self.output), Ok(Some(_)))
    }

    /// The file of a frame.
    pub(super) fn path(&self, frame: u32) -> PathBuf {
        match Numbered::of(&self.output) {
            Ok(Some(name)) => name.path(frame),
            _ => self.output.clone(),
        }
    }

    /// Whether the image is to be EXR rather than PNG, by its extension.
    pub(super) fn is_exr(&self) -> bool {
        let extension = self.output.extension().unwrap_or_default();
        extension.eq_ignore_ascii_case("exr")
    }

    /// Writes a frame of a scene, at the exposure that is asked for, or else suits the first.
    pub(super) fn write(
        &self,
        frame: u32,
        image: &Image,
        (args, scene): (&SceneArgs, &Scene),
        is_light: bool,
    ) -> Result<(), CliError> {
        let written = if self.is_exr() {
            write_exr(&self.path(frame), image)
        } else {
            let is_first = self.suiting.get().is_none();
            let exposure = self.exposure(image, (args, scene), is_light);
            if is_first && self.exposure.is_none() && exposure != 1.0 {
                log::warn!(
                    "no exposure is given; the picture gets --exposure {}",
                    number(exposure)
                );
            }
            write_png(&self.path(frame), image, exposure)
        };
        written.map_err(CliError::failed)
    }

    /// The exposure of a .png. Without a choice, light of a model alone gets one that suits it, to
    /// three digits, because nobody chose how bright that light is.
    fn exposure(&self, image: &Image, (args, scene): (&SceneArgs, &Scene), is_light: bool) -> f32 {
        let suits = is_light && Scene::is_model_alone(args.source());
        let background = scene.environment.uniform();
        let chosen = || match suits {
            true => format!("{:.2e}", exposure_to_see(image, background))
                .parse()
                .unwrap_or(1.0),
            false => 1.0,
        };
        self.exposure
            .unwrap_or_else(|| *self.suiting.get_or_init(chosen))
    }

    /// Warns where the picture of a scene is black, white or of one value, and says why. Of an .exr
    /// only the absence of light counts.
    pub(super) fn warn_of_nothing(
        &self,
        frame: u32,
        image: &Image,
        (args, scene): (&SceneArgs, &Scene),
    ) {
        let exposure = match self.is_exr() {
            true => exposure_to_see(image, Vec3::ZERO),
            false => self.exposure(image, (args, scene), true),
        };
        let path = self.path(frame);
        let path = path.display();
        if let Some(nothing) = Nothing::of(image, exposure) {
            log::warn!(
                "{path}: the picture is {nothing}: {}",
                nothing.reason(scene, exposure)
            );
        } else if args.replaces() && scene.sight().is_in_a_solid() {
            // An exposure may lift what little light there is.
            log::warn!("{path}: the camera is inside a solid, or in a wall, and sees its back");
        }
    }
}

/// Warns where the first file behind a sequence's last is there.
fn warn_of_longer(next: &Path) {
    if next.exists() {
        log::warn!(
            "{} is of a longer sequence; `lumivox compare` takes it for the next frame: remove it, \
             or write to other names",
            next.display()
        );
    }
}
