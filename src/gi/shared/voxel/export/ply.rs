//! Voxels as the points of a PLY file.

use std::io::{self, Write};

use serde::Serialize;
use serde_ply::SerializeOptions;

use super::super::{OccupiedVoxel, VoxelList};
use crate::image::srgb_from_linear;

#[derive(Serialize)]
struct FilePly {
    vertex: Vec<VertexPly>,
}

#[derive(Serialize)]
struct VertexPly {
    x: f32,
    y: f32,
    z: f32,
    nx: f32,
    ny: f32,
    nz: f32,
    red: u8,
    green: u8,
    blue: u8,
    opacity: f32,
}

/// Writes the voxels as PLY, a point each.
pub(super) fn write(
    list: &VoxelList,
    scene: &str,
    technique: &str,
    file: &mut impl Write,
) -> io::Result<()> {
    let vertex = |voxel: &OccupiedVoxel| {
        let ([x, y, z], [nx, ny, nz]) = (
            list.centre_ws(voxel.index).to_array(),
            voxel.normal.to_array(),
        );
        let [red, green, blue] = voxel.albedo.to_array().map(srgb_from_linear);
        VertexPly {
            x,
            y,
            z,
            nx,
            ny,
            nz,
            red,
            green,
            blue,
            opacity: voxel.opacity,
        }
    };
    let [x, y, z] = list.grid.origin.to_array();
    // A line break would end the comment.
    let scene = scene.replace(char::is_control, " ");
    let comments = vec![
        format!(
            "lumivox {}: voxels of {scene} by {technique}",
            env!("CARGO_PKG_VERSION")
        ),
        format!(
            "resolution {}, origin {x} {y} {z} m, voxel size {} m",
            list.grid.resolution, list.grid.voxel_size
        ),
    ];
    let ply = FilePly {
        vertex: list.voxels.iter().map(vertex).collect(),
    };
    serde_ply::to_writer(
        &ply,
        SerializeOptions::binary_le().with_comments(comments),
        file,
    )
    .map_err(|error| error.0)
}
