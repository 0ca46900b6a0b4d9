//! Some of the terms of a frame's light, as a picture that stays on the device.

use std::sync::Arc;

use super::gbuffer::GBuffer;
use super::output::{IndirectLight, Output, screen_groups};
use crate::gpu_struct;
use crate::graph::{Access, Binding, Frame, Image, Pass, Sets, Shaders};
use crate::shader::GpuStruct;

/// Which terms of L = L_e + L_direct + ρ/π · E_i + L_s a picture has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms {
    /// L_direct, light of lamps that is reflected once.
    pub direct: bool,
    /// ρ/π · E_i, indirect diffuse radiance.
    pub diffuse: bool,
    /// L_s, indirect specular radiance.
    pub specular: bool,
    /// L_e, and the environment where there is no surface.
    pub emission: bool,
    /// Everything times the ambient visibility: for looks only, off in the radiometric contract.
    pub visibility: bool,
}

impl Terms {
    /// L itself.
    pub const ALL: Terms = Terms {
        direct: true,
        diffuse: true,
        specular: true,
        emission: true,
        visibility: false,
    };

    /// None of them, black.
    pub const NONE: Terms = Terms {
        direct: false,
        diffuse: false,
        specular: false,
        emission: false,
        visibility: false,
    };

    /// The bits of the shader.
    fn bits(self) -> u32 {
        let all = [
            self.direct,
            self.diffuse,
            self.specular,
            self.emission,
            self.visibility,
        ];
        let bits = all.iter().zip(0..);
        bits.map(|(is_on, bit)| u32::from(*is_on) << bit).sum()
    }
}

/// A sum of terms, to the bit as the host sums up what it has read.
pub static TERMS_VIEW: Pass = Pass {
    name: "render.terms_view",
    shaders: Shaders::Compute("render/screen/terms_view.comp"),
    bindings: &[
        Binding::sampled("direct", Access::ComputeSampled),
        Binding::sampled("indirect", Access::ComputeSampled),
        Binding::sampled("radiance", Access::ComputeSampled),
        Binding::sampled("indirect_specular", Access::ComputeSampled),
        Binding::sampled("indirect_diffuse", Access::ComputeSampled),
        Binding::image("shown", Access::ComputeWrite),
    ],
    constants: &["SPECULAR"],
    params: Some(TermsParams::LAYOUT),
    sets: Sets::Scene,
};

gpu_struct! {
    /// Parameters of `render.terms_view`.
    pub struct TermsParams {
        /// Bits: direct, diffuse, specular, emission, visibility.
        pub terms: u32,
    }
}

impl Output {
    /// Sums terms of the last frame up into an RGBA32F image of at least its size (W/(m² sr)).
    pub fn draw_terms(
        &self,
        frame: &mut Frame,
        (gbuffer, light): (&GBuffer, &IndirectLight),
        terms: Terms,
        into: &Arc<Image>,
    ) {
        let specular = light.specular.as_ref();
        frame
            .pass(&TERMS_VIEW)
            .bind("direct", &self.direct)
            .bind("indirect", &self.indirect)
            .bind("radiance", &self.radiance)
            .bind("indirect_specular", specular.unwrap_or(&self.direct))
            .bind("indirect_diffuse", &light.diffuse)
            .bind("shown", into)
            .constant("SPECULAR", specular.is_some())
            .push(&TermsParams {
                terms: terms.bits(),
            })
            .dispatch(screen_groups(gbuffer.size));
    }
}
