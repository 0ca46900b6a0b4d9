//! The transfer on the device, and the light of its points.

use std::sync::Arc;

use bytemuck::cast_slice;

use super::lattice::Point;
use super::lit::{LIGHT_LOBES, LIGHT_POINTS, LitRows};
use super::lobes::frame_of;
use super::transfer::Transfer;
use crate::graph::{Buffer, Error, Frame, Gpu, Owner};
use crate::render::storage;

/// Light of each harmonic alone: as many rows as there are functions; a dark one after the last.
fn units(harmonics: usize, scales: &[f32]) -> Vec<[f32; 4]> {
    let functions = scales.len();
    let mut units = vec![[0.0; 4]; harmonics * functions + 1];
    for harmonic in 0..harmonics {
        let scale = scales[harmonic];
        units[harmonic * functions + harmonic] = [scale, scale, scale, 0.0];
    }
    units
}

/// The transfer of all points on the device.
pub(super) struct Points {
    pub(super) irradiance: LitRows,
    /// The radiance above points, and the frames that it is kept in.
    pub(super) lobes: Option<(LitRows, Arc<Buffer>)>,
    /// The light of each harmonic alone, one after the other.
    units: Arc<Buffer>,
    pub(super) triangles: Arc<Buffer>,
    pub(super) nodes: Arc<Buffer>,
}

impl Points {
    /// Uploads what was worked out.
    pub(super) fn new(gpu: &Gpu, transfer: &Transfer) -> Result<Self, Error> {
        // w: ambient visibility.
        let dark: Vec<[f32; 4]> = (transfer.visibility.iter())
            .map(|visibility| [0.0, 0.0, 0.0, *visibility])
            .collect();
        let named = ("prt.point_light", &dark[..]);
        let irradiance = LitRows::new(gpu, &transfer.irradiance, &LIGHT_POINTS, named)?;
        let lobes = transfer.lobes.as_ref().map(|lobes| {
            let dark = vec![[0.0; 4]; dark.len() * lobes.outputs as usize];
            let rows = LitRows::new(gpu, lobes, &LIGHT_LOBES, ("prt.point_lobes", &dark))?;
            let frame = |point: &Point| {
                let frame = frame_of(point.normal).as_mat3();
                [frame.x_axis, frame.z_axis].map(|axis| axis.extend(0.0).to_array())
            };
            let frames: Vec<[[f32; 4]; 2]> = transfer.lattice.points.iter().map(frame).collect();
            let frames = storage(gpu, ("prt.frames", Owner::Store), cast_slice(&frames))?;
            Ok::<_, Error>((rows, frames))
        });
        let harmonics = (transfer.order * transfer.order) as usize;
        let units = units(harmonics, &irradiance.scales);
        let store = |name, bytes: &[u8]| storage(gpu, (name, Owner::Store), bytes);
        Ok(Points {
            irradiance,
            lobes: lobes.transpose()?,
            units: store("prt.units", cast_slice(&units))?,
            triangles: store(
                "prt.triangle_nodes",
                cast_slice(&transfer.lattice.triangles),
            )?,
            nodes: store("prt.node_points", cast_slice(&transfer.lattice.nodes))?,
        })
    }

    /// Sets the light, a row a function, that points are lit with next.
    pub(super) fn set_light(&self, gpu: &Gpu, light: &[[f32; 3]]) -> Result<(), Error> {
        self.irradiance.set_light(gpu, light)?;
        match &self.lobes {
            Some((lobes, _)) => lobes.set_light(gpu, light),
            None => Ok(()),
        }
    }

    /// Adds the passes that light all points.
    pub(super) fn light(&self, frame: &mut Frame) {
        self.irradiance.light(frame, None);
        if let Some((lobes, _)) = &self.lobes {
            lobes.light(frame, None);
        }
    }

    /// Adds the passes that light all points with one harmonic alone, without their lobes; or as
    /// they were.
    pub(super) fn light_with(&self, frame: &mut Frame, harmonic: Option<u32>) {
        let functions = self.irradiance.scales.len() as u32;
        let unit = harmonic.map(|harmonic| (&self.units, harmonic * functions));
        self.irradiance.light(frame, unit);
    }
}
