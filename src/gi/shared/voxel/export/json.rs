//! Voxels as JSON.

use std::io::{self, Write};

use serde::Serialize;
use serde::ser::{SerializeSeq, Serializer};

use super::super::{OccupiedVoxel, VoxelList};

/// Version of the file's form; a change of meaning raises it.
const SCHEMA_VERSION: u32 = 1;

#[derive(Serialize)]
struct FileJson<'a> {
    schema_version: u32,
    version: &'static str,
    scene: &'a str,
    technique: &'a str,
    resolution: u32,
    origin_m: [f32; 3],
    voxel_size_m: f32,
    #[serde(serialize_with = "one_by_one")]
    voxels: &'a [OccupiedVoxel],
}

#[derive(Serialize)]
struct VoxelJson {
    index: [u32; 3],
    albedo: [f32; 3],
    normal: [f32; 3],
    opacity: f32,
}

fn one_by_one<S: Serializer>(voxels: &[OccupiedVoxel], serializer: S) -> Result<S::Ok, S::Error> {
    let mut list = serializer.serialize_seq(Some(voxels.len()))?;
    for voxel in voxels {
        let OccupiedVoxel {
            index,
            albedo,
            normal,
            opacity,
        } = *voxel;
        list.serialize_element(&VoxelJson {
            index,
            albedo: albedo.to_array(),
            normal: normal.to_array(),
            opacity,
        })?;
    }
    list.end()
}

/// Writes the voxels as JSON.
pub(super) fn write(
    list: &VoxelList,
    scene: &str,
    technique: &str,
    file: &mut impl Write,
) -> io::Result<()> {
    let json = FileJson {
        schema_version: SCHEMA_VERSION,
        version: env!("CARGO_PKG_VERSION"),
        scene,
        technique,
        resolution: list.grid.resolution,
        origin_m: list.grid.origin.to_array(),
        voxel_size_m: list.grid.voxel_size,
        voxels: &list.voxels,
    };
    serde_json::to_writer(&mut *file, &json)?;
    writeln!(file)
}
