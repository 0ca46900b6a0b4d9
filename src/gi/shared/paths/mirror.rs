//! What glossy surfaces mirror by rays (`gi/shared/paths/mirror.glsl`).

use std::sync::Arc;

use super::MIRROR_RAYS;
use crate::gi::shared::interleave::Pattern;
use crate::gi::{Context, Settings};
use crate::graph::{Access, Binding, Error, Image, PassBuilder};
use crate::render::{GBuffer, screen_image};

/// What a pass binds by which glossy surfaces mirror, after [`super::BINDINGS`].
pub const MIRROR_BINDINGS: [Binding; 4] = [
    Binding::sampled("view_depth", Access::ComputeSampled),
    Binding::sampled("normals", Access::ComputeSampled),
    Binding::sampled("specular", Access::ComputeSampled),
    Binding::image("indirect_specular", Access::ComputeReadWrite),
];

/// How glossy surfaces mirror, and what of it there is.
pub struct Mirrors {
    /// Rays of a pixel.
    pub rays: u32,
    /// Pixels whose rays go about different facets.
    pub pattern: Pattern,
    /// RGBA32F: what they mirror (W/(m² sr)).
    pub light: Arc<Image>,
}

impl Mirrors {
    /// As the settings say; none where nothing is glossy, or `specular` is not by rays. `name`: of
    /// the image.
    pub fn new(
        &Context {
            gpu, scene, size, ..
        }: &Context<'_>,
        settings: &Settings,
        name: &str,
    ) -> Result<Option<Self>, Error> {
        if !scene.is_glossy || ["off", "cones"].contains(&settings.choice("specular")) {
            return Ok(None);
        }
        Ok(Some(Mirrors {
            rays: settings.count(MIRROR_RAYS.name),
            pattern: Pattern::specular(settings),
            light: screen_image(gpu, name, size)?,
        }))
    }

    /// Binds [`MIRROR_BINDINGS`]; `specular`: the lobes of the G-buffer.
    pub fn bind<'f>(
        &self,
        pass: PassBuilder<'f>,
        gbuffer: &GBuffer,
        specular: &Arc<Image>,
    ) -> PassBuilder<'f> {
        pass.bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("specular", specular)
            .bind("indirect_specular", &self.light)
    }
}
