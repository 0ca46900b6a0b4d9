//! The window of the system, and what draws into it.

use std::sync::Arc;

use raw_window_handle::HasDisplayHandle as _;
use winit::dpi::{LogicalSize, PhysicalSize};
use winit::event_loop::ActiveEventLoop;
use winit::window::{Fullscreen, Window as Raw};

use super::picture::least_light;
use super::store::Remembered;
use super::{Options, ViewError};
use crate::shader;
use crate::vulkan::{
    Device, Error, Instance, InstanceOptions, Messages, Painter, PictureShaders, PlacedPicture,
    Surface,
};

/// Grey where there is nothing, of 255.
const BACKGROUND: u8 = 12;

/// A window, and the device that draws it and all that is in it.
pub(super) struct Window {
    // In the order in which they are dropped.
    pub(super) painter: Painter,
    pub(super) egui: egui_winit::State,
    pub(super) raw: Arc<Raw>,
    pub(super) messages: Messages,
    pub(super) device: Arc<Device>,
}

impl Window {
    /// Opens the window as the options say, or else as it was when it was last closed.
    pub(super) fn open(
        event_loop: &ActiveEventLoop,
        options: &Options,
        remembered: &Remembered,
        ctx: &egui::Context,
    ) -> Result<Self, ViewError> {
        let no_display = |error: &dyn std::fmt::Display| ViewError::NoDisplay(error.to_string());
        let attributes = Raw::default_attributes()
            .with_title("Lumivox")
            .with_min_inner_size(PhysicalSize::new(1, 1));
        let attributes = match options.size {
            Some([width, height]) => attributes.with_inner_size(PhysicalSize::new(width, height)),
            None => {
                attributes.with_inner_size(LogicalSize::new(remembered.size[0], remembered.size[1]))
            }
        };
        let raw = Arc::new(
            event_loop
                .create_window(attributes)
                .map_err(|error| no_display(&error))?,
        );
        let display = raw
            .display_handle()
            .map_err(|error| no_display(&error))?
            .as_raw();
        let extensions = Surface::extensions(display)?;
        let instance = Instance::new(&InstanceOptions {
            window_extensions: extensions,
            ..options.gpu.instance()
        })?;
        let surface = Surface::new(&instance, &raw)?;
        let cache_dir = options.gpu.cache_dir.as_deref();
        let device = Device::for_surface(&instance, &options.gpu.device, &surface, cache_dir)?;
        let shaders = PictureShaders {
            vertex: shader::words("view/picture.vert")?,
            fragment: shader::words("view/picture.frag")?,
            least: least_light().to_vec(),
        };
        let vsync = options.vsync.unwrap_or(remembered.vsync);
        let painter = Painter::new(&device, &surface, vsync, shaders)?;
        let most = usize::try_from(device.adapter().limits.extent_2d).ok();
        let scale = raw.scale_factor() as f32;
        let egui = egui_winit::State::new(
            ctx.clone(),
            egui::ViewportId::ROOT,
            &raw,
            Some(scale),
            None,
            most,
        );
        let window = Window {
            painter,
            egui,
            raw,
            messages: instance.messages().clone(),
            device,
        };
        if options.size.is_none() && remembered.fullscreen {
            window.set_fullscreen(true);
        }
        if let Some(wanted) = options.scale {
            window.set_scale(ctx, wanted);
        }
        Ok(window)
    }

    /// Width and height (px); 0 where there is nothing to see.
    pub(super) fn size(&self) -> [u32; 2] {
        let size = self.raw.inner_size();
        if self.is_minimised() {
            [0; 2]
        } else {
            [size.width, size.height]
        }
    }

    pub(super) fn is_minimised(&self) -> bool {
        self.raw.is_minimized() == Some(true)
    }

    pub(super) fn set_fullscreen(&self, on: bool) {
        self.raw
            .set_fullscreen(on.then_some(Fullscreen::Borderless(None)));
    }

    pub(super) fn is_fullscreen(&self) -> bool {
        self.raw.fullscreen().is_some()
    }

    /// Pixels of a point.
    pub(super) fn set_scale(&self, ctx: &egui::Context, wanted: f32) {
        ctx.set_zoom_factor(wanted / self.raw.scale_factor() as f32);
    }

    /// Brings egui's textures and shapes onto the display.
    pub(super) fn paint(
        &mut self,
        output: &PaintOutput<'_>,
        capture: bool,
    ) -> Result<crate::vulkan::Shown, Error> {
        let size = self.size();
        self.painter.paint(&crate::vulkan::Paint {
            size,
            textures: output.textures,
            primitives: output.primitives,
            pixels_per_point: output.pixels_per_point,
            background: f32::from(BACKGROUND) / 255.0,
            pictures: output.pictures,
            capture,
        })
    }
}

/// What egui has made of a frame.
pub(super) struct PaintOutput<'o> {
    pub(super) textures: &'o egui::TexturesDelta,
    pub(super) primitives: &'o [egui::ClippedPrimitive],
    pub(super) pixels_per_point: f32,
    /// Beneath the shapes.
    pub(super) pictures: &'o [PlacedPicture],
}
