//! Voxels as MagicaVoxel models.
//!
//! MagicaVoxel's z is up: (x, y, z) of the grid becomes (x, n − 1 − z, y), a rotation. A model has
//! at most 256³ voxels; a larger grid becomes several models under one group, each moved to its
//! place by a transform, which names the place of the model's middle.

use std::collections::BTreeMap;
use std::io::{self, Write};

use color_quant::NeuQuant;
use dot_vox::{Color, Dict, DotVoxData, Frame, Model, SceneNode, ShapeModel, Size, Voxel};

use super::super::VoxelList;
use crate::image::srgb_from_linear;

/// Voxels that fit: four bytes each, in a chunk whose length has 32 bits, less 64 KiB for all else.
pub(super) const COUNT_MAX: usize = (u32::MAX as usize - (1 << 16)) / 4;

/// Voxels along an edge of a model.
const MODEL_MAX: u32 = 256;

/// Colours of a palette; index 0 is emptiness.
const PALETTE_MAX: usize = 255;

/// Colours that train the quantiser, about: fewer are shown to it repeatedly, and of more only
/// some.
const TRAINING_COUNT: usize = 1 << 17;

/// Writes the voxels for MagicaVoxel.
pub(super) fn write(list: &VoxelList, file: &mut impl Write) -> io::Result<()> {
    data(list).write_vox(file)
}

fn data(list: &VoxelList) -> DotVoxData {
    let resolution = list.grid.resolution;
    let colors: Vec<[u8; 3]> = list
        .voxels
        .iter()
        .map(|voxel| voxel.albedo.to_array().map(srgb_from_linear))
        .collect();
    let (palette, index_from_color) = quantise(&colors);
    let mut models: BTreeMap<[u32; 3], Vec<Voxel>> = BTreeMap::new();
    for (voxel, color) in list.voxels.iter().zip(&colors) {
        let at = [
            voxel.index[0],
            resolution - 1 - voxel.index[2],
            voxel.index[1],
        ];
        let [x, y, z] = at.map(|i| (i % MODEL_MAX) as u8);
        let i = index_from_color.get(color).copied().unwrap_or(0);
        models
            .entry(at.map(|i| i / MODEL_MAX))
            .or_default()
            .push(Voxel { x, y, z, i });
    }
    let places: Vec<[u32; 3]> = models.keys().copied().collect();
    let extent = |place: [u32; 3]| place.map(|i| (resolution - MODEL_MAX * i).min(MODEL_MAX));
    let model = |(place, voxels)| {
        let [x, y, z] = extent(place);
        Model {
            size: Size { x, y, z },
            voxels,
        }
    };
    DotVoxData {
        version: 200,
        index_map: Vec::new(),
        models: models.into_iter().map(model).collect(),
        palette,
        materials: Vec::new(),
        scenes: scene_nodes(&places, extent, resolution),
        layers: Vec::new(),
    }
}

/// A root, a group, and a transform and a shape for each model; the grid stands on z = 0 with its
/// middle on the z axis.
fn scene_nodes(
    places: &[[u32; 3]],
    extent: impl Fn([u32; 3]) -> [u32; 3],
    resolution: u32,
) -> Vec<SceneNode> {
    let transform = |child, layer_id, frame| SceneNode::Transform {
        attributes: Dict::new(),
        frames: vec![frame],
        child,
        layer_id,
    };
    let count = places.len() as u32;
    let mut nodes = vec![
        transform(1, u32::MAX, Frame::default()),
        SceneNode::Group {
            attributes: Dict::new(),
            children: (0..count).map(|model| 2 + 2 * model).collect(),
        },
    ];
    for (model_id, &place) in (0..).zip(places) {
        let size = extent(place);
        let middle = |axis: usize| {
            i64::from(MODEL_MAX * place[axis] + size[axis] / 2)
                - if axis < 2 {
                    i64::from(resolution / 2)
                } else {
                    0
                }
        };
        let moved = Dict::from([(
            "_t".to_owned(),
            format!("{} {} {}", middle(0), middle(1), middle(2)),
        )]);
        nodes.push(transform(3 + 2 * model_id, 0, Frame::new(moved)));
        nodes.push(SceneNode::Shape {
            attributes: Dict::new(),
            models: vec![ShapeModel {
                model_id,
                attributes: Dict::new(),
            }],
        });
    }
    nodes
}

/// A palette (256 entries, the last unused), and each colour's index into it. Colours are kept as
/// they are where they fit.
fn quantise(colors: &[[u8; 3]]) -> (Vec<Color>, BTreeMap<[u8; 3], u8>) {
    let mut index_from_color: BTreeMap<[u8; 3], u8> =
        colors.iter().map(|color| (*color, 0)).collect();
    let mut palette: Vec<Color> = Vec::with_capacity(256);
    let opaque = |[r, g, b]: [u8; 3]| Color { r, g, b, a: 255 };
    if index_from_color.len() <= PALETTE_MAX {
        for (index, (color, entry)) in (0..).zip(&mut index_from_color) {
            *entry = index;
            palette.push(opaque(*color));
        }
    } else {
        let repeats = TRAINING_COUNT.div_ceil(colors.len());
        let texels: Vec<u8> = colors
            .iter()
            .flat_map(|&[r, g, b]| [r, g, b, 255])
            .collect::<Vec<_>>()
            .repeat(repeats);
        let one_in = (colors.len() / TRAINING_COUNT).clamp(1, 30) as i32;
        let network = NeuQuant::new(one_in, PALETTE_MAX, &texels);
        for (&[r, g, b], entry) in &mut index_from_color {
            *entry = network.index_of(&[r, g, b, 255]).min(PALETTE_MAX - 1) as u8;
        }
        palette.extend(
            network
                .color_map_rgb()
                .as_chunks()
                .0
                .iter()
                .map(|color| opaque(*color)),
        );
    }
    palette.resize(256, opaque([0; 3]));
    (palette, index_from_color)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::super::{OccupiedVoxel, VoxelGrid};
    use super::*;

    fn list(resolution: u32, voxels: &[([u32; 3], Vec3)]) -> VoxelList {
        let voxel = |(index, albedo): &([u32; 3], Vec3)| OccupiedVoxel {
            index: *index,
            albedo: *albedo,
            normal: Vec3::Y,
            opacity: 1.0,
        };
        VoxelList {
            grid: VoxelGrid {
                origin: Vec3::ZERO,
                voxel_size: 0.1,
                resolution,
            },
            voxels: voxels.iter().map(voxel).collect(),
        }
    }

    /// Written and read by the crate's own parser.
    fn read_back(list: &VoxelList) -> Result<DotVoxData, String> {
        let mut bytes = Vec::new();
        write(list, &mut bytes).map_err(|error| error.to_string())?;
        dot_vox::load_bytes(&bytes).map_err(ToOwned::to_owned)
    }

    #[test]
    fn one_model_up_to_256_with_z_up() -> Result<(), String> {
        let data = read_back(&list(
            256,
            &[
                ([3, 5, 7], Vec3::new(1.0, 0.0, 0.0)),
                ([255, 0, 0], Vec3::ONE),
            ],
        ))?;
        assert_eq!(data.models.len(), 1);
        assert_eq!(
            data.models[0].size,
            Size {
                x: 256,
                y: 256,
                z: 256
            }
        );
        let red = data.models[0].voxels[0];
        assert_eq!([red.x, red.y, red.z], [3, 248, 5]);
        assert_eq!(
            data.palette[red.i as usize],
            Color {
                r: 255,
                g: 0,
                b: 0,
                a: 255
            }
        );
        assert_eq!(
            [data.models[0].voxels[1].x, data.models[0].voxels[1].y],
            [255, 255]
        );
        Ok(())
    }

    /// Two voxels that are neighbours in the grid and in different models are neighbours where the
    /// scene graph puts them.
    #[test]
    fn models_of_a_large_grid_lie_side_by_side() -> Result<(), String> {
        let data = read_back(&list(
            512,
            &[([255, 300, 511], Vec3::ONE), ([256, 300, 511], Vec3::ONE)],
        ))?;
        assert_eq!(data.models.len(), 2);
        let place = |model: usize| -> Result<[i32; 3], String> {
            let SceneNode::Transform { frames, .. } = &data.scenes[2 + 2 * model] else {
                return Err("no transform".into());
            };
            let middle = frames[0].position().ok_or("no position")?;
            let (voxel, size) = (data.models[model].voxels[0], data.models[model].size);
            let corner = [
                (middle.x, size.x, voxel.x),
                (middle.y, size.y, voxel.y),
                (middle.z, size.z, voxel.z),
            ];
            Ok(corner.map(|(middle, size, voxel)| middle - size as i32 / 2 + i32::from(voxel)))
        };
        assert_eq!(place(0)?, [-1, -256, 300]);
        assert_eq!(place(1)?, [0, -256, 300]);
        Ok(())
    }

    /// 4,096 colours over the whole cube, the hardest there is.
    #[test]
    fn many_colours_become_255_that_are_near() -> Result<(), String> {
        let linear = |i: u32| {
            Vec3::new(
                (i % 16) as f32 / 15.0,
                (i / 16 % 16) as f32 / 15.0,
                (i / 256) as f32 / 15.0,
            )
        };
        let voxels: Vec<([u32; 3], Vec3)> = (0..4096)
            .map(|i| ([i % 16, i / 16 % 16, i / 256], linear(i)))
            .collect();
        let data = read_back(&list(16, &voxels))?;
        let error = |(voxel, (_, albedo)): (&Voxel, &([u32; 3], Vec3))| {
            let color = data.palette[voxel.i as usize];
            let wanted = albedo.to_array().map(srgb_from_linear);
            [color.r, color.g, color.b]
                .into_iter()
                .zip(wanted)
                .map(|(a, b)| u32::from(a.abs_diff(b)))
                .sum::<u32>()
        };
        let mean = f64::from(
            data.models[0]
                .voxels
                .iter()
                .zip(&voxels)
                .map(error)
                .sum::<u32>(),
        ) / (3.0 * 4096.0);
        // Measured 7.5; one grey for all has 55.
        assert!(mean < 12.0, "a channel is {mean} off in the mean");
        Ok(())
    }
}
