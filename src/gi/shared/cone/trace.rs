//! One cone from one place of the picture, with every sample that it takes, as the gathers trace
//! it.

use glam::{DVec3, Vec3};

use super::march::MarchSettings;
use super::oracle::specular::{Gloss, lifted};
use super::tracer::{ConeTracer, longest_march};
use super::volume::{ConeOutput, March, Volume};
use crate::gi::Context;
use crate::gi::inspect::{Beam, BeamAxis, BeamSample, BeamStart};
use crate::gi::shared::interleave::oracle::interleaved_offset;
use crate::gi::shared::voxel::oracle::hemisphere_direction;
use crate::gpu_struct;
use crate::graph::{Access, Binding, Error, Frame, Owner};
use crate::render::storage;

gpu_struct! {
    /// Parameters of `cone.trace`.
    pub struct TraceParams {
        /// xyz: position (voxels); w: tan(γ/2).
        pub receiver: [f32; 4],
        /// xyz: geometric normal.
        pub normal: [f32; 4],
        /// xyz: direction of the axis.
        pub direction: [f32; 4],
        /// How they are marched.
        pub march: MarchSettings,
        /// Samples that there is room for.
        pub capacity: u32,
        /// Of the volume, from a face of what it stores to the next.
        pub face_stride: u32,
    }
}

pub(in crate::gi) const BINDINGS: [Binding; 1] =
    [Binding::buffer("trace_rows", Access::ComputeWrite)];

impl ConeTracer {
    /// Traces one cone from a surface. `aperture_deg` is γ, where it is not to be the technique's
    /// own. The scene's frame constants are those of the picture.
    pub fn trace(
        &self,
        &Context { gpu, scene, .. }: &Context<'_>,
        volume: Volume<'_>,
        surface: &BeamStart,
        (axis, aperture_deg): (BeamAxis, Option<f32>),
    ) -> Result<Beam, Error> {
        let is_mirror = axis == BeamAxis::Mirror;
        let (s, grid) = (
            if is_mirror {
                self.settings.of_kind(self.specular_kind)
            } else {
                self.settings
            },
            &volume.grid,
        );
        let cones: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&self.set.cones)?);
        let cones = &cones[..self.set.count as usize];
        let (direction, own_tan_half, weight) = self.axis(surface, cones, axis);
        let tan_half =
            aperture_deg.map_or(own_tan_half, |degrees| (0.5 * degrees.to_radians()).tan());
        let capacity = longest_march(volume.voxels_across, s.step_factor);
        let rows = storage(
            gpu,
            ("cone.trace", Owner::Screen),
            &vec![0; 32 * (capacity as usize + 1)],
        )?;
        let receiver = (surface.position - grid.origin) / grid.voxel_size;
        let params = TraceParams {
            receiver: receiver.extend(tan_half).to_array(),
            normal: surface.geometric_normal.extend(0.0).to_array(),
            direction: direction.extend(0.0).to_array(),
            march: MarchSettings {
                ao_falloff: if is_mirror { 0.0 } else { s.ao_falloff },
                first_hit: s.first_hit,
                ..s.march(volume)
            },
            capacity,
            face_stride: volume.face_stride,
        };
        let mut frame = Frame::new();
        frame.set_scene(&scene.set, &scene.materials);
        let march = March::new(
            is_mirror || self.skips_empty,
            ConeOutput::Light,
            s.face_weights,
        );
        volume
            .pass(&mut frame, &volume.passes.trace, march)
            .bind("trace_rows", &rows)
            .push(&params)
            .dispatch([1; 3]);
        gpu.submit(frame)?;
        let rows: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&rows)?);
        let [[x, y, z, count], [r, g, b, visibility]] = [rows[0], rows[1]];
        let taken = (count as usize).min(capacity as usize);
        Ok(Beam {
            origin: grid.origin + grid.voxel_size * Vec3::new(x, y, z),
            direction,
            aperture_deg: 2.0 * tan_half.atan().to_degrees(),
            weight,
            count: self.set.count,
            samples: samples(&rows[2..2 + 2 * taken], grid.voxel_size),
            radiance: Vec3::new(r, g, b),
            visibility,
        })
    }

    /// Direction, tan(γ/2) and weight.
    fn axis(
        &self,
        surface: &BeamStart,
        cones: &[[f32; 4]],
        axis: BeamAxis,
    ) -> (Vec3, f32, Option<f32>) {
        match axis {
            BeamAxis::Normal => (
                surface.shading_normal,
                cones.first().map_or(0.0, |cone| cone[2]),
                None,
            ),
            BeamAxis::Diffuse(index) => {
                let [sin_squared, azimuth_rad, tan_half, weight] = cones
                    .get(index as usize)
                    .or(cones.last())
                    .copied()
                    .unwrap_or_default();
                let pattern =
                    interleaved_offset(surface.place, self.settings.pattern, surface.walk);
                let sin_squared =
                    f64::from(sin_squared) + (pattern.x - 0.5) * f64::from(self.set.jitter);
                let azimuth_rad = f64::from(azimuth_rad) + pattern.y * std::f64::consts::TAU;
                let direction = hemisphere_direction(
                    surface.shading_normal.as_dvec3(),
                    sin_squared,
                    azimuth_rad,
                );
                (direction.normalize().as_vec3(), tan_half, Some(weight))
            }
            BeamAxis::Mirror => {
                let to_eye = (surface.eye - surface.position).normalize().as_dvec3();
                let (normal, pattern) = (
                    surface.shading_normal.as_dvec3(),
                    self.settings.specular_pattern,
                );
                let gloss = Gloss {
                    f0: DVec3::ONE,
                    roughness: surface.roughness.into(),
                };
                let cone = if pattern.count() == 1 {
                    gloss.whole(normal, to_eye)
                } else {
                    let uv = interleaved_offset(surface.pixel, pattern, surface.walk);
                    gloss.part(normal, to_eye, uv, pattern.count())
                };
                (
                    lifted(cone.direction, surface.geometric_normal.as_dvec3()).as_vec3(),
                    if self.specular_tan_half > 0.0 {
                        self.specular_tan_half
                    } else {
                        cone.half_angle_rad.tan() as f32
                    },
                    None,
                )
            }
        }
    }
}

/// Samples of two rows each, with what they come to together.
fn samples(rows: &[[f32; 4]], voxel_size: f32) -> Vec<BeamSample> {
    let (mut through, mut gathered) = (1.0, Vec3::ZERO);
    let of = |pair: &[[f32; 4]]| {
        let ([centre, diameter, level, opacity], [r, g, b, a]) = (pair[0], pair[1]);
        let radiance = if a > 0.0 {
            Vec3::new(r, g, b) / a
        } else {
            Vec3::ZERO
        };
        gathered += through * opacity * radiance;
        through *= 1.0 - opacity;
        BeamSample {
            distance_m: centre * voxel_size,
            diameter_m: diameter * voxel_size,
            level,
            radiance,
            opacity,
            covered: 1.0 - through,
            gathered,
        }
    };
    rows.chunks_exact(2).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half of 4, then all of 2 behind it.
    #[test]
    fn samples_add_up_front_to_back() {
        let found = samples(
            &[
                [1.0, 1.0, 0.0, 0.5],
                [1.0, 1.0, 1.0, 0.25],
                [3.0, 2.0, 1.0, 0.0],
                [0.0; 4],
                [5.0, 4.0, 2.0, 1.0],
                [2.0, 2.0, 2.0, 1.0],
            ],
            0.5,
        );
        let column = |of: fn(&BeamSample) -> f32| found.iter().map(of).collect::<Vec<_>>();
        assert_eq!(column(|sample| sample.distance_m), [0.5, 1.5, 2.5]);
        assert_eq!(column(|sample| sample.diameter_m), [0.5, 1.0, 2.0]);
        assert_eq!(column(|sample| sample.radiance.x), [4.0, 0.0, 2.0]);
        assert_eq!(column(|sample| sample.covered), [0.5, 0.5, 1.0]);
        assert_eq!(column(|sample| sample.gathered.x), [2.0, 2.0, 3.0]);
    }
}
