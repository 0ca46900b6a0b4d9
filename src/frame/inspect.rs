//! What a frame has made, read back or shown: its images, views, beams and figures.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};

use super::Renderer;
use crate::gi::Context;
use crate::gi::inspect::{Beam, BeamAxis, BeamStart, Channels, Energy, LightSlots, ViewRow};
use crate::gi::registry;
use crate::graph::{Error, Frame, Image as GpuImage};
use crate::image::{Aov, Image, IndirectImage};
use crate::render::{
    MapChannel, SurfaceChannel, Terms, UNDERSAMPLED, exact_screen_image, read_aov, read_indirect,
    read_light_map, read_pixel, read_surface, undersampled,
};

/// What there is to trace at a pixel.
#[derive(Clone, Debug, PartialEq)]
pub enum Traced {
    /// The technique's beam at the pixel, with its samples.
    Beam(Beam),
    /// The pixel sees no surface.
    NoSurface,
    /// It gathers without beams, with these settings, from what has these figures: names, and
    /// numbers in words with their units.
    Figures(Vec<(&'static str, String)>),
    /// It gathers without beams, with these settings, and has no figures.
    NoBeams,
}

impl Renderer<'_> {
    /// One of the last frame's images.
    pub fn aov(&self, aov: Aov) -> Result<Image, Error> {
        let (Some(light), Some(camera)) = (&self.light, &self.camera) else {
            return Ok(Image::new(self.settings.size[0], self.settings.size[1]));
        };
        let image = read_aov(self.gpu, &self.gbuffer, &self.output, light, aov)?;
        let made = || self.screen.discontinuity(self.gpu, &self.gbuffer, camera);
        image.map_or_else(made, Ok)
    }

    /// Sums terms of the last frame's light up into an RGBA32F image of at least its size (W/(m²
    /// sr)), which draws may sample from then on. Black where there was no frame.
    pub fn show(&self, terms: Terms, into: &Arc<GpuImage>) -> Result<(), Error> {
        let mut frame = Frame::new();
        match &self.light {
            Some(light) => {
                frame.set_scene(&self.scene.set, &self.scene.materials);
                let of = (&self.gbuffer, light);
                self.output.draw_terms(&mut frame, of, terms, into);
            }
            None => frame.clear_image("frame.show", into, [0.0; 4]),
        }
        frame.ready(&[into]);
        self.gpu.submit(frame).map(drop)
    }

    /// The last frame's answer, as the reference gives its own.
    pub fn indirect_light(&self) -> Result<IndirectImage, Error> {
        let [width, height] = self.settings.size;
        self.light.as_ref().map_or_else(
            || Ok(IndirectImage::new(width, height)),
            |light| read_indirect(self.gpu, &self.gbuffer, light),
        )
    }

    /// Levels that a view of the technique has, 0 the finest; 0 levels where these settings have no
    /// such view.
    pub fn levels(&self, view: &ViewRow) -> u32 {
        self.technique.levels(view)
    }

    /// A level of one of the technique's views, as the camera of the last frame sees it. `None`
    /// where there is no such view or level.
    pub fn view(&self, view: &ViewRow, level: u32) -> Result<Option<Image>, Error> {
        if level >= self.levels(view) {
            return Ok(None);
        }
        let [width, height] = self.settings.size;
        let seen = exact_screen_image(self.gpu, "frame.view", [width, height])?;
        let mut frame = Frame::new();
        frame.set_scene(&self.scene.set, &self.scene.materials);
        self.technique
            .draw_view(&mut frame, (view, level), &self.gbuffer, &seen);
        self.gpu.submit(frame)?;
        let texels: Vec<Vec4> = bytemuck::pod_collect_to_vec(&self.gpu.read_image(&seen, 0, 0)?);
        let shown = |texel: Vec4| match view.channels {
            Channels::Rgb => texel.truncate(),
            Channels::Alpha => Vec3::splat(texel.w),
        };
        Ok(Some(Image::from_fn(width, height, |pixel| {
            shown(texels[pixel])
        })))
    }

    /// One beam from what a pixel of the last frame sees, as the technique's gather traces it;
    /// `aperture_deg` in place of its own (degrees). Without beams, figures of what it gathers
    /// from.
    pub fn trace(
        &self,
        pixel: [u32; 2],
        axis: BeamAxis,
        aperture_deg: Option<f32>,
    ) -> Result<Traced, Error> {
        let [width, height] = self.settings.size;
        let (Some(camera), true) = (&self.camera, pixel[0] < width && pixel[1] < height) else {
            return Ok(Traced::NoSurface);
        };
        let Some(seen) = read_pixel(self.gpu, &self.gbuffer, pixel)? else {
            return Ok(Traced::NoSurface);
        };
        let centre = Vec2::from(pixel.map(|at| at as f32 + 0.5));
        let start = BeamStart {
            pixel,
            place: self.screen.place(pixel),
            position: camera.position_at(centre, seen.depth_m, [width, height]),
            geometric_normal: seen.geometric_normal,
            shading_normal: seen.shading_normal,
            roughness: seen.roughness,
            eye: camera.eye,
            walk: self.screen.walk().saturating_sub(1),
        };
        let beam = self
            .technique
            .beam(&context!(self), &start, axis, aperture_deg)?;
        if let Some(beam) = beam {
            return Ok(Traced::Beam(beam));
        }
        let figures = self.technique.figures_at(&context!(self), &start)?;
        Ok(if figures.is_empty() {
            Traced::NoBeams
        } else {
            Traced::Figures(figures)
        })
    }

    /// A channel of the last frame's G-buffer.
    pub fn surface(&self, channel: SurfaceChannel) -> Result<Image, Error> {
        read_surface(self.gpu, &self.gbuffer, channel)
    }

    /// A channel of one of the last frame's light maps; `None` where the technique asks for no such
    /// map.
    pub fn light_map(&self, channel: MapChannel, view: u32) -> Result<Option<Image>, Error> {
        let maps = match (&self.small_rsm, channel) {
            (Some(rsm), MapChannel::Normal | MapChannel::Reflected) => rsm,
            _ => &self.maps,
        };
        read_light_map(self.gpu, maps, channel, view)
    }

    /// How many frames the diffuse light of each pixel of the last frame weighs, in red, and its
    /// visibility, in green; `None` where the settings have no history.
    pub fn history(&self) -> Result<Option<Image>, Error> {
        self.screen.weights(self.gpu, &self.gbuffer)
    }

    /// How many light maps there are.
    pub fn light_map_count(&self) -> u32 {
        self.maps.rows().len() as u32
    }

    /// Samples that a gather of all pixels takes, by the name of the pass.
    pub fn count_samples(&self) -> Result<Vec<(&'static str, u64)>, Error> {
        self.technique.count_samples(&context!(self), &self.gbuffer)
    }

    /// The light that the technique keeps on surfaces; what is replaced there shows in the next
    /// frame.
    pub fn light_slots(&mut self) -> Result<Option<Box<dyn LightSlots + '_>>, Error> {
        self.is_still = false;
        self.technique.light_slots(self.gpu)
    }

    /// Edge of the finest cells of the technique's store (m); `None` where it has none.
    pub fn cell_size(&self) -> Option<f32> {
        self.technique.cell_size()
    }

    /// Where the last frame's light has gone; `None` where the technique does not count it.
    pub fn energy(&self) -> Result<Option<Energy>, Error> {
        self.technique.energy(&context!(self))
    }

    /// Counts of the last frame, by name.
    pub fn counts(&self) -> Result<Vec<(&'static str, u64)>, Error> {
        self.technique.counts(self.gpu)
    }

    /// Counts of the last frame for a report: those of [`Renderer::counts`], and where shadow maps
    /// are drawn, the pixels where they are coarser than the picture ([`UNDERSAMPLED`]).
    pub fn counts_of_report(&self) -> Result<Vec<(&'static str, u64)>, Error> {
        let mut counts = self.counts()?;
        if let Some(camera) = self.camera.filter(|_| !self.maps.rows().is_empty()) {
            let depth = self.aov(Aov::Depth)?;
            let normals = self.surface(SurfaceChannel::GeometricNormal)?;
            let pixels = undersampled(&self.scene, &self.maps, &camera, (&depth, &normals));
            counts.push((UNDERSAMPLED, pixels));
        }
        Ok(counts)
    }
}
