//! OpenEXR: any number of named 32-bit float channels in, the same out.

use std::path::Path;

use exr::meta::MetaData;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer, LayerAttributes,
    ReadChannels, ReadLayers, Text, Vec2, WritableImage, read,
};
use glam::Vec3;

use super::{Aov, Image, ImageError};
use crate::output::write_file;
use crate::text::quoted;

/// Named channels of one size, as an EXR file holds them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Planes {
    /// Width of every channel (px).
    pub width: u32,
    /// Height of every channel (px).
    pub height: u32,
    /// Channel name and `width × height` values, row 0 at the top.
    pub planes: Vec<(String, Vec<f32>)>,
}

impl Planes {
    /// No channels yet.
    pub fn new(width: u32, height: u32) -> Self {
        Planes {
            width,
            height,
            planes: Vec::new(),
        }
    }

    /// Adds one channel.
    pub fn push(&mut self, name: &str, values: Vec<f32>) {
        self.planes.push((name.to_owned(), values));
    }

    /// Adds the channels `layer.R`, `layer.G` and `layer.B`, or `R`, `G` and `B` where `layer` is
    /// empty.
    pub fn push_image(&mut self, layer: &str, image: &Image) {
        for (axis, channel) in ["R", "G", "B"].into_iter().enumerate() {
            self.push(
                &channel_name(layer, channel),
                image.pixels.iter().map(|pixel| pixel[axis]).collect(),
            );
        }
    }

    /// The values of a channel.
    pub fn plane(&self, name: &str) -> Option<&[f32]> {
        self.planes
            .iter()
            .find(|(known, _)| known == name)
            .map(|(_, values)| values.as_slice())
    }

    /// The colour image of a layer; `None` where a channel is missing.
    pub fn image(&self, layer: &str) -> Option<Image> {
        let [r, g, b] = ["R", "G", "B"].map(|channel| self.plane(&channel_name(layer, channel)));
        let (r, g, b) = (r?, g?, b?);
        Some(Image::from_fn(self.width, self.height, |i| {
            Vec3::new(r[i], g[i], b[i])
        }))
    }
}

fn channel_name(layer: &str, channel: &str) -> String {
    if layer.is_empty() {
        channel.to_owned()
    } else {
        format!("{layer}.{channel}")
    }
}

/// How many bytes of pixels a byte of a file can stand for: deflate packs 1032, and PXR24 leaves
/// out one in four beforehand.
const PACKING_MOST: u128 = 2048;

/// Refuses a file whose header claims more pixels than its bytes can hold, before memory is taken
/// for them.
fn check_size(path: &Path) -> Result<(), ImageError> {
    let length = std::fs::metadata(path)
        .map_err(|error| ImageError::read(path, error))?
        .len();
    let meta =
        MetaData::read_from_file(path, false).map_err(|error| ImageError::read_exr(path, error))?;
    for header in &meta.headers {
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        let claimed = (width as u128)
            .saturating_mul(height as u128)
            .saturating_mul(header.channels.bytes_per_pixel as u128);
        if claimed > PACKING_MOST * u128::from(length) {
            return Err(ImageError::read(
                path,
                format!(
                    "it claims {width} × {height} px, which do not fit into its {length} bytes; \
                     it is cut short or damaged"
                ),
            ));
        }
    }
    Ok(())
}

/// Reads every channel of the first layer of an EXR file, half, float or integer, as 32-bit floats.
pub fn read_planes(path: &Path) -> Result<Planes, ImageError> {
    check_size(path)?;
    let file = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .map_err(|error| ImageError::read_exr(path, error))?;
    let layer = file.layer_data;
    let size = |length: usize| u32::try_from(length).map_err(|error| ImageError::read(path, error));
    let mut planes = Planes::new(size(layer.size.width())?, size(layer.size.height())?);
    for channel in &layer.channel_data.list {
        if channel.sampling != Vec2(1, 1) {
            return Err(ImageError::read(
                path,
                format!("channel {} is subsampled", channel.name),
            ));
        }
        planes.push(
            &channel.name.to_string(),
            channel.sample_data.values_as_f32().collect(),
        );
    }
    Ok(planes)
}

/// Reads the colours of an EXR file: its channels R, G and B, or Y as grey.
pub fn read_exr(path: &Path) -> Result<Image, ImageError> {
    colors(path, &read_planes(path)?)
}

fn colors(path: &Path, planes: &Planes) -> Result<Image, ImageError> {
    let grey = || {
        Some(Image::from_grey(
            planes.width,
            planes.height,
            planes.plane("Y")?,
        ))
    };
    planes
        .image("")
        .or_else(grey)
        .ok_or_else(|| ImageError::NoColor {
            path: path.to_owned(),
            found: names(planes),
        })
}

fn names(planes: &Planes) -> String {
    planes
        .planes
        .iter()
        .map(|(name, _)| name.as_str())
        .collect::<Vec<_>>()
        .join(", ")
}

/// Reads one output of an EXR file: its layer of that name where the file has layers (as `lumivox
/// reference --layers` writes them), else its colours.
pub fn read_aov(path: &Path, aov: Aov) -> Result<Image, ImageError> {
    let planes = read_planes(path)?;
    let has_layers = planes.planes.iter().any(|(name, _)| name.contains('.'));
    if !has_layers || aov == Aov::Full {
        return colors(path, &planes);
    }
    let grey = |channel| {
        Some(Image::from_grey(
            planes.width,
            planes.height,
            planes.plane(&channel_name(aov.name(), channel))?,
        ))
    };
    planes
        .image(aov.name())
        .or_else(|| grey("Y"))
        .or_else(|| grey("Z"))
        .ok_or_else(|| ImageError::NoLayer {
            path: path.to_owned(),
            layer: aov.name(),
            found: names(&planes),
        })
}

/// Writes channels as 32-bit floats, losslessly compressed.
pub fn write_planes(path: &Path, planes: &Planes) -> Result<(), ImageError> {
    let mut channels = Vec::with_capacity(planes.planes.len());
    for (name, values) in &planes.planes {
        let text = Text::new_or_none(name).ok_or_else(|| {
            ImageError::write(
                path,
                format!("the channel name {} is not Latin-1", quoted(name)),
            )
        })?;
        channels.push(AnyChannel::new(text, FlatSamples::F32(values.clone())));
    }
    let layer = Layer::new(
        (planes.width as usize, planes.height as usize),
        LayerAttributes::default(),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels.into()),
    );
    let image = ExrImage::from_layer(layer);
    write_file(path, |file| image.write().to_buffered(file))
        .map_err(|error| ImageError::write_exr(path, error))
}

/// Writes an image as the 32-bit float channels R, G and B.
pub fn write_exr(path: &Path, image: &Image) -> Result<(), ImageError> {
    let mut planes = Planes::new(image.width, image.height);
    planes.push_image("", image);
    write_planes(path, &planes)
}
