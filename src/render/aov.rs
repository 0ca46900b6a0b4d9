//! Reading a frame's images back.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::{GBuffer, IndirectLight, Output};
use crate::graph::{Error, Gpu, Image as GpuImage};
use crate::image::{Aov, Image};

/// Reads one output of a frame.
pub fn read_aov(gpu: &Gpu, gbuffer: &GBuffer, output: &Output, light: &IndirectLight, aov: Aov) -> Result<Image, Error> {
    let [width, height] = gbuffer.size;
    let rgb = |image: &Arc<GpuImage>| Ok(image_of(gbuffer, floats(gpu, image)?.chunks_exact(4).map(|texel| Vec3::new(texel[0], texel[1], texel[2]))));
    match aov {
        Aov::Full => rgb(&output.radiance),
        Aov::Direct => rgb(&output.direct),
        Aov::Indirect => rgb(&output.indirect),
        Aov::Diffuse => rgb(&light.diffuse),
        Aov::Specular => light.specular.as_ref().map_or_else(|| Ok(Image::new(width, height)), rgb),
        Aov::Visibility => Ok(image_of(gbuffer, floats(gpu, &light.diffuse)?.chunks_exact(4).map(|texel| Vec3::splat(texel[3])))),
        Aov::Emission => {
            let all = [&output.radiance, &output.direct, &output.indirect].map(rgb);
            let [radiance, direct, indirect] = all;
            let (radiance, direct, indirect) = (radiance?, direct?, indirect?);
            Ok(Image::from_fn(width, height, |i| radiance.pixels[i] - direct.pixels[i] - indirect.pixels[i]))
        }
        Aov::Albedo => {
            let halves: Vec<u16> = bytemuck::pod_collect_to_vec(&gpu.read_image(&gbuffer.albedo, 0, 0)?);
            Ok(image_of(
                gbuffer,
                halves.chunks_exact(4).map(|texel| Vec3::new(float_from_half(texel[0]), float_from_half(texel[1]), float_from_half(texel[2]))),
            ))
        }
        Aov::Normal => {
            let packed: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&gpu.read_image(&gbuffer.normals, 0, 0)?);
            let depth = floats(gpu, &gbuffer.view_depth)?;
            Ok(image_of(gbuffer, packed.iter().zip(depth).map(|(packed, depth)| if depth > 0.0 { unit_from_octahedral(packed[1]) } else { Vec3::ZERO })))
        }
        Aov::Depth => Ok(image_of(gbuffer, floats(gpu, &gbuffer.view_depth)?.into_iter().map(Vec3::splat))),
    }
}

fn floats(gpu: &Gpu, image: &Arc<GpuImage>) -> Result<Vec<f32>, Error> {
    Ok(bytemuck::pod_collect_to_vec(&gpu.read_image(image, 0, 0)?))
}

fn image_of(gbuffer: &GBuffer, pixels: impl Iterator<Item = Vec3>) -> Image {
    Image { width: gbuffer.size[0], height: gbuffer.size[1], pixels: pixels.collect() }
}

/// IEEE 754 binary16 to binary32.
pub(crate) fn float_from_half(half: u16) -> f32 {
    let magnitude = i32::from(half & 0x7fff);
    let value = match magnitude >> 10 {
        0 => magnitude as f32 * 0.5f32.powi(24),
        31 => return if magnitude & 0x3ff == 0 { f32::INFINITY } else { f32::NAN },
        exponent => (1024 + (magnitude & 0x3ff)) as f32 * 2f32.powi(exponent - 25),
    };
    if half & 0x8000 == 0 { value } else { -value }
}

/// Inverse of `pack_unit` in `shared/packing.glsl`.
fn unit_from_octahedral(packed: u32) -> Vec3 {
    let snorm = |bits: u32| (f32::from(bits as u16 as i16) / 32767.0).max(-1.0);
    let p = Vec2::new(snorm(packed), snorm(packed >> 16));
    let z = 1.0 - p.x.abs() - p.y.abs();
    let fold = (-z).max(0.0);
    Vec3::new(p.x - fold.copysign(p.x), p.y - fold.copysign(p.y), z).normalize()
}
