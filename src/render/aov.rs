//! Reading a frame's images back.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::{GBuffer, IndirectLight, LightMaps, Output};
use crate::graph::{Error, Gpu, Image as GpuImage, vk};
use crate::image::{Aov, Image, IndirectImage};

/// Reads one output of a frame; `None` for what no image of it has.
pub fn read_aov(
    gpu: &Gpu,
    gbuffer: &GBuffer,
    output: &Output,
    light: &IndirectLight,
    aov: Aov,
) -> Result<Option<Image>, Error> {
    let [width, height] = gbuffer.size;
    let rgb = |image: &Arc<GpuImage>| read_rgb(gpu, gbuffer, image);
    let image = match aov {
        Aov::Full => rgb(&output.radiance),
        Aov::Direct => rgb(&output.direct),
        Aov::Indirect => rgb(&output.indirect),
        Aov::Diffuse => read_irradiance(gpu, gbuffer, light),
        Aov::Specular => light
            .specular
            .as_ref()
            .map_or_else(|| Ok(Image::new(width, height)), rgb),
        Aov::Visibility => read_visibility(gpu, gbuffer, light),
        Aov::Emission => {
            let all = [&output.radiance, &output.direct, &output.indirect].map(rgb);
            let [radiance, direct, indirect] = all;
            let (radiance, direct, indirect) = (radiance?, direct?, indirect?);
            Ok(Image::from_fn(width, height, |i| {
                radiance.pixels[i] - direct.pixels[i] - indirect.pixels[i]
            }))
        }
        Aov::Albedo => Ok(image_of(
            gbuffer,
            halves(gpu, &gbuffer.albedo)?
                .into_iter()
                .map(|texel| Vec3::new(texel[0], texel[1], texel[2])),
        )),
        Aov::Normal => read_normals(gpu, gbuffer, 1),
        Aov::Depth => Ok(image_of(
            gbuffer,
            floats(gpu, &gbuffer.view_depth)?
                .into_iter()
                .map(Vec3::splat),
        )),
        Aov::Discontinuity => return Ok(None),
    };
    image.map(Some)
}

/// Reads what a technique answered.
pub fn read_indirect(
    gpu: &Gpu,
    gbuffer: &GBuffer,
    light: &IndirectLight,
) -> Result<IndirectImage, Error> {
    let [width, height] = gbuffer.size;
    let specular = light.specular.as_ref();
    let visibility = read_visibility(gpu, gbuffer, light)?.pixels;
    Ok(IndirectImage {
        irradiance: read_irradiance(gpu, gbuffer, light)?,
        specular: specular.map_or_else(
            || Ok(Image::new(width, height)),
            |image| read_rgb(gpu, gbuffer, image),
        )?,
        visibility: visibility.into_iter().map(|open| open.x).collect(),
    })
}

/// How much of the indirect light on the mean of the normals in a pixel falls on themselves, where
/// their mean has that length ([`GBuffer::albedo`]). Irradiance is linear in the normal where no
/// surface cuts light off, which loses 1 − length. Of light from everywhere above the surface half
/// as much is lost. This is between the two (`docs/measured/rays.md`).
pub fn share_of_spread(length: f32) -> f32 {
    1.0 - 0.75 * (1.0 - length)
}

/// Irradiance on the shading normals in each pixel, from that on their mean direction, which
/// techniques answer.
fn read_irradiance(gpu: &Gpu, gbuffer: &GBuffer, light: &IndirectLight) -> Result<Image, Error> {
    let on_mean = floats(gpu, &light.diffuse)?;
    let albedo = halves(gpu, &gbuffer.albedo)?;
    let texels = on_mean.chunks_exact(4).zip(albedo);
    let irradiance = texels.map(|(texel, [.., length])| match length {
        0.0 => Vec3::ZERO,
        _ => share_of_spread(length) * Vec3::new(texel[0], texel[1], texel[2]),
    });
    Ok(image_of(gbuffer, irradiance))
}

/// Ambient visibility as a grey.
fn read_visibility(gpu: &Gpu, gbuffer: &GBuffer, light: &IndirectLight) -> Result<Image, Error> {
    let texels = floats(gpu, &light.diffuse)?;
    let open = texels.chunks_exact(4).map(|texel| Vec3::splat(texel[3]));
    Ok(image_of(gbuffer, open))
}

fn floats(gpu: &Gpu, image: &Arc<GpuImage>) -> Result<Vec<f32>, Error> {
    if image.desc().format == vk::Format::R16G16B16A16_SFLOAT {
        return Ok(halves(gpu, image)?.into_iter().flatten().collect());
    }
    Ok(bytemuck::pod_collect_to_vec(&gpu.read_image(image, 0, 0)?))
}

/// The texels of an RGBA16F image.
fn halves(gpu: &Gpu, image: &Arc<GpuImage>) -> Result<Vec<[f32; 4]>, Error> {
    let texels: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_image(image, 0, 0)?);
    Ok(texels
        .into_iter()
        .map(|texel| texel.map(float_from_half))
        .collect())
}

fn read_rgb(gpu: &Gpu, gbuffer: &GBuffer, image: &Arc<GpuImage>) -> Result<Image, Error> {
    Ok(image_of(
        gbuffer,
        floats(gpu, image)?
            .chunks_exact(4)
            .map(|texel| Vec3::new(texel[0], texel[1], texel[2])),
    ))
}

/// The part of the images that the frame has drawn.
fn image_of(gbuffer: &GBuffer, pixels: impl Iterator<Item = Vec3>) -> Image {
    Image {
        width: gbuffer.size[0],
        height: gbuffer.size[1],
        pixels: inside(gbuffer, pixels).collect(),
    }
}

/// The pixels of an image that the frame has drawn.
fn inside<T>(gbuffer: &GBuffer, pixels: impl Iterator<Item = T>) -> impl Iterator<Item = T> {
    let [width, height] = gbuffer.size.map(|size| size as usize);
    let stride = gbuffer.view_depth.extent(0)[0] as usize;
    pixels
        .take(stride * height)
        .enumerate()
        .filter(move |(index, _)| index % stride < width)
        .map(|(_, pixel)| pixel)
}

/// What one pixel of the G-buffer sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePixel {
    /// View depth (m).
    pub depth_m: f32,
    /// Unit normal of the triangle, on the viewer's side.
    pub geometric_normal: Vec3,
    /// Unit normal for shading.
    pub shading_normal: Vec3,
    /// GGX roughness; 0 where there is no lobe.
    pub roughness: f32,
}

/// Reads one pixel of the G-buffer; `None` where it sees no surface.
pub fn read_pixel(
    gpu: &Gpu,
    gbuffer: &GBuffer,
    pixel: [u32; 2],
) -> Result<Option<SurfacePixel>, Error> {
    let texel = [pixel[0], pixel[1], 0];
    let depth_m = bytemuck::pod_read_unaligned(&gpu.read_texel(&gbuffer.view_depth, texel)?);
    if depth_m <= 0.0 {
        return Ok(None);
    }
    let normals = bytemuck::pod_read_unaligned(&gpu.read_texel(&gbuffer.normals, texel)?);
    let roughness = match &gbuffer.specular {
        Some(image) => {
            let lobe: [u16; 4] = bytemuck::pod_read_unaligned(&gpu.read_texel(image, texel)?);
            float_from_half(lobe[3])
        }
        None => 0.0,
    };
    Ok(SurfacePixel::unpack(depth_m, normals, roughness))
}

/// Reads all pixels of the G-buffer, row by row.
pub fn read_pixels(gpu: &Gpu, gbuffer: &GBuffer) -> Result<Vec<Option<SurfacePixel>>, Error> {
    let depths = floats(gpu, &gbuffer.view_depth)?;
    let normals: Vec<[u32; 2]> =
        bytemuck::pod_collect_to_vec(&gpu.read_image(&gbuffer.normals, 0, 0)?);
    let roughness = match &gbuffer.specular {
        Some(image) => halves(gpu, image)?.iter().map(|lobe| lobe[3]).collect(),
        None => vec![0.0; depths.len()],
    };
    let texels = depths.into_iter().zip(normals).zip(roughness);
    let pixels = texels
        .map(|((depth_m, normals), roughness)| SurfacePixel::unpack(depth_m, normals, roughness));
    Ok(inside(gbuffer, pixels).collect())
}

impl SurfacePixel {
    fn unpack(depth_m: f32, normals: [u32; 2], roughness: f32) -> Option<SurfacePixel> {
        let [geometric_normal, shading_normal] = normals.map(unit_from_octahedral);
        (depth_m > 0.0).then(|| SurfacePixel {
            depth_m,
            geometric_normal,
            shading_normal,
            roughness: roughness.max(0.0),
        })
    }
}

/// A channel of the G-buffer that no technique is compared by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceChannel {
    /// Unit geometric normal on the viewer's side.
    GeometricNormal,
    /// GGX roughness; 0 where there is no lobe.
    Roughness,
    /// Specular reflectance at normal incidence.
    F0,
    /// x, y: where the surface was in the frame before, less where it is (px); z: its view depth
    /// there (m); as [`GBuffer::motion`] has it, 0 where that was not asked for.
    Motion,
    /// Unit shading normal in the frame before, of models that have moved; 0 elsewhere.
    Turned,
    /// Number of the material, 1 for the first, as [`GBuffer::materials`] has it; 0 where that was
    /// not asked for.
    Material,
}

/// Reads a channel of the G-buffer; 0 where there is no surface.
pub fn read_surface(gpu: &Gpu, gbuffer: &GBuffer, channel: SurfaceChannel) -> Result<Image, Error> {
    let lobe = |part: fn([f32; 4]) -> Vec3| match &gbuffer.specular {
        Some(image) => Ok(image_of(gbuffer, halves(gpu, image)?.into_iter().map(part))),
        None => Ok(Image::new(gbuffer.size[0], gbuffer.size[1])),
    };
    match channel {
        SurfaceChannel::GeometricNormal => read_normals(gpu, gbuffer, 0),
        SurfaceChannel::Roughness => lobe(|lobe| Vec3::splat(lobe[3].max(0.0))),
        SurfaceChannel::F0 => lobe(|lobe| Vec3::new(lobe[0], lobe[1], lobe[2])),
        SurfaceChannel::Motion => read_motion(gpu, gbuffer, |texel| {
            Vec3::new(texel[0], texel[1], texel[2])
        }),
        SurfaceChannel::Material => match &gbuffer.materials {
            Some([_, last]) => Ok(image_of(
                gbuffer,
                bytemuck::pod_collect_to_vec::<u8, u32>(&gpu.read_image(last, 0, 0)?)
                    .into_iter()
                    .map(|number| Vec3::splat(number as f32)),
            )),
            None => Ok(Image::new(gbuffer.size[0], gbuffer.size[1])),
        },
        SurfaceChannel::Turned => read_motion(gpu, gbuffer, |texel| unpack_turned(texel[3])),
    }
}

fn read_motion(gpu: &Gpu, gbuffer: &GBuffer, of: fn(&[f32]) -> Vec3) -> Result<Image, Error> {
    match &gbuffer.motion {
        Some(image) => Ok(image_of(
            gbuffer,
            floats(gpu, image)?.chunks_exact(4).map(of),
        )),
        None => Ok(Image::new(gbuffer.size[0], gbuffer.size[1])),
    }
}

/// As `shared/turned.glsl` has it.
fn unpack_turned(packed: f32) -> Vec3 {
    if packed == 0.0 {
        return Vec3::ZERO;
    }
    let bits = packed as u32 - 1;
    let part = |bits: u32| (bits & 4095) as f32 / 4095.0 * 2.0 - 1.0;
    from_octahedral(Vec2::new(part(bits), part(bits >> 12)))
}

/// The last and second components of an RGBA32UI image of the picture's size, as floats, in red and
/// green.
pub(crate) fn read_weights(
    gpu: &Gpu,
    gbuffer: &GBuffer,
    image: &Arc<GpuImage>,
) -> Result<Image, Error> {
    let texels = floats(gpu, image)?;
    let weights = texels
        .chunks_exact(4)
        .map(|texel| Vec3::new(texel[3], texel[1], 0.0));
    Ok(image_of(gbuffer, weights))
}

/// A channel of the light maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapChannel {
    /// Reversed depth of shadow maps, as they hold it: 1 near, 0 far.
    Depth,
    /// Unit normal of reflective shadow maps.
    Normal,
    /// Reflected share of reflective shadow maps: albedo × falloff.
    Reflected,
}

/// Reads one layer of the light maps; `None` where there is no such map.
pub fn read_light_map(
    gpu: &Gpu,
    maps: &LightMaps,
    channel: MapChannel,
    view: u32,
) -> Result<Option<Image>, Error> {
    let image = match (channel, &maps.rsm) {
        (MapChannel::Depth, _) => &maps.depth,
        (MapChannel::Normal, Some([normal, _])) => normal,
        (MapChannel::Reflected, Some([_, reflected])) => reflected,
        (_, None) => return Ok(None),
    };
    let layers = match channel {
        MapChannel::Depth => maps.rows().len() as u32,
        MapChannel::Normal | MapChannel::Reflected => maps.view_count,
    };
    if view >= layers {
        return Ok(None);
    }
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&gpu.read_image(image, 0, view)?);
    // The square root of the share, 10 bits a channel.
    let share = |word: u32| {
        Vec3::from([0, 10, 20].map(|shift| ((word >> shift & 1023) as f32 / 1023.0).powi(2)))
    };
    let pixel = |word: u32| match channel {
        MapChannel::Depth => Vec3::splat(f32::from_bits(word)),
        MapChannel::Normal => unit_from_octahedral(word),
        MapChannel::Reflected => share(word),
    };
    Ok(Some(Image {
        width: maps.size,
        height: maps.size,
        pixels: words.into_iter().map(pixel).collect(),
    }))
}

fn read_normals(gpu: &Gpu, gbuffer: &GBuffer, which: usize) -> Result<Image, Error> {
    let packed: Vec<[u32; 2]> =
        bytemuck::pod_collect_to_vec(&gpu.read_image(&gbuffer.normals, 0, 0)?);
    let depth = floats(gpu, &gbuffer.view_depth)?;
    let normal = |(packed, depth): (&[u32; 2], f32)| {
        if depth > 0.0 {
            unit_from_octahedral(packed[which])
        } else {
            Vec3::ZERO
        }
    };
    Ok(image_of(gbuffer, packed.iter().zip(depth).map(normal)))
}

/// IEEE 754 binary16 to binary32.
pub(crate) fn float_from_half(half: u16) -> f32 {
    let magnitude = i32::from(half & 0x7fff);
    let value = match magnitude >> 10 {
        0 => magnitude as f32 * 0.5f32.powi(24),
        31 => {
            return if magnitude & 0x3ff == 0 {
                f32::INFINITY
            } else {
                f32::NAN
            };
        }
        exponent => (1024 + (magnitude & 0x3ff)) as f32 * 2f32.powi(exponent - 25),
    };
    if half & 0x8000 == 0 { value } else { -value }
}

/// Inverse of `pack_unit` in `shared/packing.glsl`.
fn unit_from_octahedral(packed: u32) -> Vec3 {
    let snorm = |bits: u32| (f32::from(bits as u16 as i16) / 32767.0).max(-1.0);
    from_octahedral(Vec2::new(snorm(packed), snorm(packed >> 16)))
}

fn from_octahedral(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let fold = (-z).max(0.0);
    Vec3::new(p.x - fold.copysign(p.x), p.y - fold.copysign(p.y), z).normalize()
}
