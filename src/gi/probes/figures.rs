//! Which probes the light of a surface comes from, in words.

use std::sync::Arc;

use glam::{DVec3, DVec4, UVec2, Vec3};

use super::lookup::{Lookup, Visibility};
use super::oracle::{Asked, Irradiance, Map, Place, Probe, Probes, light_of_probes};
use super::volume::{Maps, Volume};
use crate::gi::inspect::BeamStart;
use crate::graph::{Error, Gpu, Image};
use crate::render::float_from_half;
use crate::text::short;

/// Names of the eight probes.
const NAMES: [&str; 8] = [
    "probe 1", "probe 2", "probe 3", "probe 4", "probe 5", "probe 6", "probe 7", "probe 8",
];

/// Below this share of what is seen of it, a probe is hidden.
const HIDDEN: f64 = 0.01;

/// Maps of all probes as they are on the device.
struct Read<'v> {
    volume: &'v Volume,
    places: Vec<[f32; 4]>,
    scales: Vec<f32>,
    irradiance: Vec<u16>,
    gradients: Vec<u16>,
    moments: Vec<u16>,
}

impl<'v> Read<'v> {
    fn new(gpu: &Gpu, volume: &'v Volume, maps: &Maps) -> Result<Self, Error> {
        let halfs = |image: &Arc<Image>| {
            let bytes = gpu.read_image(image, 0, 0)?;
            Ok::<_, Error>(bytemuck::pod_collect_to_vec(&bytes))
        };
        Ok(Read {
            volume,
            places: bytemuck::pod_collect_to_vec(&gpu.read_buffer(&volume.places)?),
            scales: bytemuck::pod_collect_to_vec(&gpu.read_buffer(&maps.scales)?),
            irradiance: halfs(&maps.irradiance)?,
            gradients: halfs(&maps.gradients)?,
            moments: halfs(&volume.moments)?,
        })
    }

    /// A map of a probe, of `parts` numbers a texel.
    fn map(&self, halfs: &[u16], (probe, edge, parts): (u32, u32, usize)) -> Map {
        let (columns, wide) = (self.volume.columns, edge + 2);
        let first = wide * UVec2::new(probe % columns, probe / columns) + 1;
        Map::of(edge, |at| {
            let texel = first + at.truncate();
            let index = (texel.x + texel.y * columns * wide) as usize * parts;
            let mut value = DVec4::ZERO;
            for (part, half) in halfs[index..index + parts].iter().enumerate() {
                value[part] = f64::from(float_from_half(*half));
            }
            value
        })
    }

    /// The harmonics of a probe.
    fn harmonics(&self, probe: u32, scale: f64) -> [DVec4; 9] {
        let columns = self.volume.columns;
        let first = 3 * UVec2::new(probe % columns, probe / columns);
        std::array::from_fn(|at| {
            let texel = first + UVec2::new(at as u32 % 3, at as u32 / 3);
            let index = 4 * (texel.x + texel.y * columns * 3) as usize;
            let halfs: [u16; 4] = std::array::from_fn(|part| self.irradiance[index + part]);
            let [r, g, b, a] = halfs.map(|half| f64::from(float_from_half(half)));
            (scale * DVec3::new(r, g, b)).extend(a)
        })
    }

    fn place(&self, probe: u32) -> Vec3 {
        let [x, y, z, _] = self.places[probe as usize];
        Vec3::new(x, y, z)
    }

    fn probe(&self, probe: u32) -> Probe {
        let scale = f64::from(self.scales[probe as usize]);
        let edge = self.volume.irradiance_texels;
        let scaled = |halfs: &[u16]| {
            let mut map = self.map(halfs, (probe, edge, 4));
            let texels = map.texels.iter_mut();
            texels.for_each(|texel| *texel = (scale * texel.truncate()).extend(texel.w));
            map
        };
        let moments = if self.volume.has_moments {
            self.map(&self.moments, (probe, self.volume.moment_texels, 2))
        } else {
            Map::of(1, |_| DVec4::ZERO)
        };
        let irradiance = if self.volume.is_sh {
            Irradiance::Harmonics(self.harmonics(probe, scale).to_vec())
        } else {
            Irradiance::Map(scaled(&self.irradiance))
        };
        Probe {
            place: self.place(probe).as_dvec3(),
            irradiance,
            gradients: (self.volume.has_gradients).then(|| scaled(&self.gradients)),
            moments,
        }
    }
}

/// Figures of the eight probes around a surface: where they are, and what each counts. Where rays
/// say what a surface sees, all count as seen here.
pub fn figures(
    gpu: &Gpu,
    (volume, maps, lookup): (&Volume, &Maps, &Lookup),
    start: &BeamStart,
) -> Result<Vec<(&'static str, String)>, Error> {
    let read = Read::new(gpu, volume, maps)?;
    let place = Place {
        position: start.position.as_dvec3(),
        geometric_normal: start.geometric_normal.as_dvec3(),
        shading_normal: start.shading_normal.as_dvec3(),
    };
    let probe = |probe| read.probe(probe);
    let probes = Probes {
        lattice: &volume.lattice,
        probe: &probe,
        is_there: &|_| true,
        sees: &|_, _| true,
    };
    let eight = probes.around(&place, lookup);
    let all: f64 = eight.iter().map(|asked| asked.weight).sum();
    let mut figures = vec![("surface", format!("{} m", triple(place.position)))];
    for (name, asked) in NAMES.into_iter().zip(&eight) {
        let light = read.probe(asked.probe).irradiance.at(place.shading_normal);
        let counts = 100.0 * asked.weight / all.max(1e-30);
        figures.push((
            name,
            format!(
                "{} at {} m: {}% of the light; {}; E {} W/m²",
                triple(volume.lattice.at(asked.probe).as_dvec3()),
                triple(read.place(asked.probe).as_dvec3()),
                short(counts),
                why(asked, lookup),
                triple(light.truncate())
            ),
        ));
    }
    if lookup.visibility == Visibility::Rays {
        let told = "as if all eight were seen: rays say so in the picture alone";
        figures.push(("sight", told.into()));
    } else {
        let light = light_of_probes(&probes, &place, lookup);
        figures.push((
            "E of the surface",
            format!("{} W/m²", triple(light.truncate())),
        ));
    }
    Ok(figures)
}

/// What makes the weight of a probe.
fn why(asked: &Asked, lookup: &Lookup) -> String {
    let trilinear = format!("trilinear {}", short(asked.share));
    if lookup.visibility == Visibility::None {
        return trilinear;
    }
    let facing = format!("{trilinear}, side {}", short(asked.facing));
    match lookup.visibility {
        Visibility::Moments if asked.sight < HIDDEN => format!("{facing}, hidden"),
        Visibility::Moments => format!("{facing}, seen {}", short(asked.sight)),
        _ => facing,
    }
}

fn triple(of: DVec3) -> String {
    of.to_array().map(short).join(" ")
}
