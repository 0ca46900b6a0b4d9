//! The probes of a scene: where they stand, what they see, and their light.

use std::sync::Arc;

use glam::{Vec3, Vec4};

use super::lattice::Lattice;
use super::list::{Listed, ProbeList};
use crate::gi::Settings;
use crate::graph::{
    Buffer, BufferDesc, BufferUsage, Error, Frame, Gpu, Image, ImageDesc, ImageKind, ImageUsage,
    Owner, vk,
};

/// The light of all probes, 3×3 texels of harmonics or an octahedral map each, in a border of one
/// texel.
#[derive(Clone)]
pub struct Maps {
    /// RGBA16F. rgb: irradiance, or radiance as harmonics, in steps of the probe's scale; a: share
    /// of it that meets nothing.
    pub irradiance: Arc<Image>,
    /// RGBA16F. xyz: how its luminance changes with the place (a cell), in the same steps; one map
    /// that nobody reads where [`Volume::has_gradients`] is false.
    pub gradients: Arc<Image>,
    /// Of each probe: irradiance of a stored 1 (W/m²), a power of two.
    pub scales: Arc<Buffer>,
}

/// How the irradiance of a probe is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Irradiance {
    /// As an octahedral map of so many texels along an edge.
    Octahedral(u32),
    /// As radiance in spherical harmonics of three bands: 3×3 texels, no border.
    Harmonics,
}

impl Irradiance {
    /// As the settings say.
    pub(super) fn new(settings: &Settings) -> Self {
        if settings.is("irradiance", "sh2") {
            Irradiance::Harmonics
        } else {
            Irradiance::Octahedral(settings.count("irradiance_texels"))
        }
    }
}

/// What is kept of each probe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kept {
    /// How irradiance is kept.
    pub irradiance: Irradiance,
    /// Edge of a map of distances (texels), where look-ups ask for them.
    pub moment_texels: Option<u32>,
    /// Whether look-ups ask how irradiance changes with the place.
    pub has_gradients: bool,
    /// Bounces of light, 3 or more where they are fed back.
    pub bounces: u32,
}

/// The probes, what they see, and their light.
#[derive(Clone)]
pub struct Volume {
    /// Where they stand before they are moved.
    pub lattice: Lattice,
    /// Maps beside each other in the images.
    pub columns: u32,
    /// Edge of a map of irradiance (texels); 1, with its border, is what harmonics take.
    pub irradiance_texels: u32,
    /// Whether irradiance is kept as harmonics.
    pub is_sh: bool,
    /// Edge of a map of distances (texels).
    pub moment_texels: u32,
    /// xyz of each probe: where it stands (m); w: 1 where it stands elsewhere than before, or 0.
    pub places: Arc<Buffer>,
    /// All for which there is room.
    pub all: ProbeList,
    /// RG16F: mean and mean square of the distance that a probe sees (cells); one map that nobody
    /// reads where `has_moments` is false.
    pub moments: Arc<Image>,
    /// How many gathered surfaces see none of the eight probes around them.
    pub orphans: Arc<Buffer>,
    /// Whether look-ups ask for distances.
    pub has_moments: bool,
    /// Whether look-ups ask how irradiance changes with the place.
    pub has_gradients: bool,
    /// After one bounce.
    first: Maps,
    /// After two bounces or more, one and the other in turn.
    further: Vec<Maps>,
}

/// An image of maps.
fn atlas(
    gpu: &Gpu,
    name: &str,
    [columns, rows]: [u32; 2],
    (edge, format): (u32, vk::Format),
) -> Result<Arc<Image>, Error> {
    store_image(gpu, name, [columns * (edge + 2), rows * (edge + 2)], format)
}

/// An image of what probes keep, by width and height (texels).
pub(super) fn store_image(
    gpu: &Gpu,
    name: &str,
    [width, height]: [u32; 2],
    format: vk::Format,
) -> Result<Arc<Image>, Error> {
    gpu.create_image(&ImageDesc {
        name: name.into(),
        extent: [width, height, 1],
        kind: ImageKind::D2,
        format,
        mips: 1,
        layers: 1,
        usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
        owner: Owner::Store,
    })
}

pub(super) fn buffer(gpu: &Gpu, name: &str, size_bytes: u64) -> Result<Arc<Buffer>, Error> {
    gpu.create_buffer(&BufferDesc {
        name: name.into(),
        size_bytes: size_bytes.max(16),
        usage: BufferUsage::Storage,
        owner: Owner::Store,
    })
}

fn carry_buffer(gpu: &Gpu, from: &Arc<Buffer>, to: &Arc<Buffer>) -> Result<(), Error> {
    gpu.upload_buffer(to, &gpu.read_buffer(from)?)
}

/// Copies the texels of an image into another of the same width, which has more rows.
pub(super) fn carry_image(gpu: &Gpu, from: &Arc<Image>, to: &Arc<Image>) -> Result<(), Error> {
    let [rows, more] = [from, to].map(|image| image.extent(0)[1] as usize);
    let mut texels = gpu.read_image(from, 0, 0)?;
    texels.resize(texels.len() / rows * more, 0);
    gpu.upload_image(to, 0, 0, &texels)
}

/// Beyond so many diagonals of a cell all distances count as one.
const REACH_DIAGONALS: f32 = 1.5;

fn upload(gpu: &Gpu, buffer: &Arc<Buffer>, places: &[Vec3], before: &[Vec3]) -> Result<(), Error> {
    let is_new = |(index, place): (usize, &Vec3)| before.get(index) != Some(place);
    let rows: Vec<Vec4> = (places.iter().enumerate())
        .map(|(index, place)| place.extend(f32::from(u8::from(is_new((index, place))))))
        .collect();
    gpu.upload_buffer(buffer, bytemuck::cast_slice(&rows))
}

/// A buffer of places (m) that rays are traced from.
pub(super) fn places_buffer(gpu: &Gpu, places: &[Vec3]) -> Result<Arc<Buffer>, Error> {
    let rows = buffer(gpu, "probes.some_places", 16 * places.len() as u64)?;
    upload(gpu, &rows, places, &[]).map(|()| rows)
}

impl Volume {
    /// Makes room for the maps of all probes of a lattice. [`Volume::put`] is next.
    pub fn new(gpu: &Gpu, lattice: Lattice, kept: &Kept) -> Result<Self, Error> {
        Volume::with_room(gpu, lattice, lattice.probe_count(), kept)
    }

    /// Makes room for the maps of `count` probes.
    pub fn with_room(gpu: &Gpu, lattice: Lattice, count: u32, kept: &Kept) -> Result<Self, Error> {
        let columns = f64::from(count).sqrt().ceil() as u32;
        Volume::with_columns(gpu, lattice, [columns, count], kept)
    }

    fn with_columns(
        gpu: &Gpu,
        lattice: Lattice,
        [columns, count]: [u32; 2],
        kept: &Kept,
    ) -> Result<Self, Error> {
        let layout = [columns, count.div_ceil(columns)];
        let layout_where = |is_read: bool| if is_read { layout } else { [1, 1] };
        let irradiance_texels = match kept.irradiance {
            Irradiance::Octahedral(texels) => texels,
            Irradiance::Harmonics => 1,
        };
        let maps = |index: u32| {
            let format = (irradiance_texels, vk::Format::R16G16B16A16_SFLOAT);
            let gradients = layout_where(kept.has_gradients);
            Ok(Maps {
                irradiance: atlas(gpu, &format!("probes.irradiance{index}"), layout, format)?,
                gradients: atlas(gpu, &format!("probes.gradients{index}"), gradients, format)?,
                scales: buffer(gpu, &format!("probes.scales{index}"), 4 * u64::from(count))?,
            })
        };
        let moment_texels = kept.moment_texels.unwrap_or(1);
        Ok(Volume {
            lattice,
            columns,
            irradiance_texels,
            is_sh: kept.irradiance == Irradiance::Harmonics,
            moment_texels,
            places: buffer(gpu, "probes.places", 16 * u64::from(count))?,
            all: ProbeList::of_all(gpu, count)?,
            moments: atlas(
                gpu,
                "probes.moments",
                layout_where(kept.moment_texels.is_some()),
                (moment_texels, vk::Format::R16G16_SFLOAT),
            )?,
            orphans: buffer(gpu, "probes.orphans", 4)?,
            has_moments: kept.moment_texels.is_some(),
            has_gradients: kept.has_gradients,
            first: maps(0)?,
            further: (1..kept.bounces.min(3))
                .map(maps)
                .collect::<Result<_, Error>>()?,
        })
    }

    /// The same with room for the maps of `count` probes, which is more; `kept` as it was made.
    pub(super) fn grown(&self, gpu: &Gpu, count: u32, kept: &Kept) -> Result<Self, Error> {
        let grown = Volume::with_columns(gpu, self.lattice, [self.columns, count], kept)?;
        carry_buffer(gpu, &self.places, &grown.places)?;
        carry_image(gpu, &self.moments, &grown.moments)?;
        let maps = |volume: &Volume| [vec![volume.first.clone()], volume.further.clone()].concat();
        for (maps, more) in maps(self).iter().zip(&maps(&grown)) {
            carry_image(gpu, &maps.irradiance, &more.irradiance)?;
            carry_image(gpu, &maps.gradients, &more.gradients)?;
            carry_buffer(gpu, &maps.scales, &more.scales)?;
        }
        Ok(grown)
    }

    /// Adds a fill: from here on surfaces without a probe are counted.
    pub(super) fn forget_orphans(&self, frame: &mut Frame) {
        frame.fill("probes.clear", &self.orphans, 0);
    }

    /// How many surfaces without a probe the last frame had.
    pub(super) fn count_orphans(&self, gpu: &Gpu) -> Result<(&'static str, u64), Error> {
        let bytes = gpu.read_buffer(&self.orphans)?;
        let counts: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
        Ok(("probe_orphans", counts[0].into()))
    }

    /// The farthest that a probe sees (cells).
    pub fn reach(&self) -> f32 {
        REACH_DIAGONALS * self.lattice.diagonal() / self.lattice.cell()
    }

    /// The same maps, looked up by another lattice.
    pub(super) fn looked_up_by(&self, lattice: Lattice) -> Self {
        Volume {
            lattice,
            ..self.clone()
        }
    }

    /// Puts the probes at these places (m), where they were at those `before`, if they were at any.
    pub fn put(&self, gpu: &Gpu, places: &[Vec3], before: &[Vec3]) -> Result<(), Error> {
        upload(gpu, &self.places, places, before)
    }

    /// All probes.
    pub fn listed(&self) -> Listed<'_> {
        self.all.part(0, self.lattice.probe_count())
    }

    /// The maps that have the light of so many bounces, of those that it was made for.
    pub fn lit(&self, bounces: u32) -> &Maps {
        match bounces {
            0 | 1 => &self.first,
            more => &self.further[more as usize % self.further.len()],
        }
    }
}
