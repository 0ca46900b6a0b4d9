//! Triangles that emit, for rays that aim at them.

use std::sync::Arc;

use bytemuck::cast_slice;
use glam::{DVec3, Vec3};

use super::super::gpu_scene::{GpuMaterial, GpuScene, storage};
use super::geometry::Geometry;
use crate::gpu_struct;
use crate::graph::{Buffer, Error, Gpu, MATERIAL_TEXTURES, Owner, vk};
use crate::image::luminance;

gpu_struct! {
    /// A row of the table from which an emissive triangle is drawn by its power (M. Vose, 1991).
    pub struct GpuEmitter {
        /// Share of the row's draws that take its own triangle.
        pub own_share: f32,
        /// Its own triangle.
        pub own: u32,
        /// The triangle of the other draws.
        pub other: u32,
    }
}

/// The emissive triangles of a scene, drawn in proportion to area times mean emitted luminance.
pub struct EmissiveTriangles {
    /// [`GpuEmitter`] rows.
    pub rows: Arc<Buffer>,
    /// Of each material: density of drawn points (1/m²).
    pub densities: Arc<Buffer>,
    /// Number of rows.
    pub count: u32,
    /// Mean emitted luminance of each material (W/(m² sr)).
    luminances: Vec<f64>,
}

impl EmissiveTriangles {
    /// Of a scene as it is on the device.
    pub fn new(gpu: &Gpu, scene: &GpuScene) -> Result<Self, Error> {
        let luminances = if scene.is_emissive {
            luminances(gpu, scene)?
        } else {
            Vec::new()
        };
        EmissiveTriangles::of(gpu, scene, luminances)
    }

    fn of(gpu: &Gpu, scene: &GpuScene, luminances: Vec<f64>) -> Result<Self, Error> {
        let powers = powers(gpu, scene, &luminances)?;
        let total: f64 = powers.iter().map(|(_, power)| power).sum();
        let density = |luminance: &f64| if total > 0.0 { luminance / total } else { 0.0 } as f32;
        let densities: Vec<f32> = luminances.iter().map(density).collect();
        let rows = table(&powers);
        let buffer = |name, bytes: &[u8]| storage(gpu, (name, Owner::Store), bytes);
        Ok(EmissiveTriangles {
            rows: buffer("bvh.emitters", cast_slice(&rows))?,
            densities: buffer("bvh.emitter_densities", cast_slice(&densities))?,
            count: rows.len() as u32,
            luminances,
        })
    }

    /// Brings the table up to where models are that emit.
    pub fn follow(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<(), Error> {
        let moves =
            |(material, luminance): (u32, &f64)| *luminance > 0.0 && scene.is_dynamic(material);
        if (0..).zip(&self.luminances).any(moves) {
            let luminances = std::mem::take(&mut self.luminances);
            *self = EmissiveTriangles::of(gpu, scene, luminances)?;
        }
        Ok(())
    }
}

/// Mean emitted luminance of each material (W/(m² sr)).
fn luminances(gpu: &Gpu, scene: &GpuScene) -> Result<Vec<f64>, Error> {
    let materials: Vec<GpuMaterial> =
        bytemuck::pod_collect_to_vec(&gpu.read_buffer(&scene.buffers.materials)?);
    let of = |(material, textures): (&GpuMaterial, &[Option<u32>; MATERIAL_TEXTURES])| {
        let [red, green, blue, _] = material.emission;
        let emission = Vec3::new(red, green, blue);
        let tint = match textures[1] {
            Some(texture) if emission != Vec3::ZERO => mean(gpu, scene, texture as usize)?,
            _ => Vec3::ONE,
        };
        Ok(f64::from(luminance(emission * tint)))
    };
    materials
        .iter()
        .zip(&scene.material_textures)
        .map(of)
        .collect()
}

/// Triangles that emit, and area times luminance of each (W/sr).
fn powers(gpu: &Gpu, scene: &GpuScene, luminances: &[f64]) -> Result<Vec<(u32, f64)>, Error> {
    if luminances.is_empty() {
        return Ok(Vec::new());
    }
    let geometry = Geometry::read(gpu, scene)?;
    let power = |(triangle, material): (u32, &u32)| {
        let [a, b, c] = geometry.of(triangle);
        let area = 0.5 * f64::from((b - a).cross(c - a).length());
        let power = area * luminances[*material as usize];
        (power > 0.0).then_some((triangle, power))
    };
    Ok((0..).zip(&geometry.materials).filter_map(power).collect())
}

/// The mean of a texture's texels, decoded.
fn mean(gpu: &Gpu, scene: &GpuScene, texture: usize) -> Result<Vec3, Error> {
    let image = &scene.textures[texture];
    let is_encoded = image.desc().format == vk::Format::R8G8B8A8_SRGB;
    let decode = |value: u8| {
        let value = f64::from(value) / 255.0;
        match is_encoded {
            true if value > 0.04045 => ((value + 0.055) / 1.055).powf(2.4),
            true => value / 12.92,
            false => value,
        }
    };
    let decoded: [f64; 256] = std::array::from_fn(|value| decode(value as u8));
    let texels = gpu.read_texture(image)?;
    let (texels, _) = texels.as_chunks::<4>();
    let sum: DVec3 = texels
        .iter()
        .map(|[red, green, blue, _]| {
            DVec3::from([red, green, blue].map(|at| decoded[*at as usize]))
        })
        .sum();
    Ok((sum / texels.len().max(1) as f64).as_vec3())
}

/// Rows of which each is drawn as often, so that each triangle is drawn in proportion to its power.
fn table(powers: &[(u32, f64)]) -> Vec<GpuEmitter> {
    let mean = powers.iter().map(|(_, power)| power).sum::<f64>() / powers.len() as f64;
    let mut rows: Vec<GpuEmitter> = powers
        .iter()
        .map(|(triangle, _)| GpuEmitter {
            own_share: 1.0,
            own: *triangle,
            other: *triangle,
        })
        .collect();
    let mut left: Vec<f64> = powers.iter().map(|(_, power)| power / mean).collect();
    let (mut poor, mut rich): (Vec<usize>, Vec<usize>) =
        (0..powers.len()).partition(|row| left[*row] < 1.0);
    while let (Some(&taker), Some(&giver)) = (poor.last(), rich.last()) {
        poor.pop();
        rows[taker].own_share = left[taker] as f32;
        rows[taker].other = rows[giver].own;
        left[giver] -= 1.0 - left[taker];
        if left[giver] < 1.0 {
            rich.pop();
            poor.push(giver);
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_drawn_by_their_power() {
        for powers in [
            vec![],
            vec![3.0],
            vec![1.0, 1.0],
            vec![1e-9, 5.0, 1.0, 0.25, 40.0, 40.0, 1e3],
            (1..200).map(f64::from).collect(),
        ] {
            let numbered: Vec<(u32, f64)> = (100..).zip(powers.iter().copied()).collect();
            let rows = table(&numbered);
            let mut shares = vec![0.0; powers.len()];
            for row in &rows {
                let own = f64::from(row.own_share);
                shares[row.own as usize - 100] += own / rows.len() as f64;
                shares[row.other as usize - 100] += (1.0 - own) / rows.len() as f64;
            }
            let total: f64 = powers.iter().sum();
            for (share, power) in shares.iter().zip(&powers) {
                assert!(
                    (share - power / total).abs() < 1e-6,
                    "{share} of {power}/{total}"
                );
            }
        }
    }
}
