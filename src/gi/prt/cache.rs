//! Transfer kept on disk under the hash of all that it depends on: geometry, materials, where
//! lights are, and settings. The environment is not among them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::compress::Compressed;
use super::lattice::{Lattice, Point, TriangleNodes};
use super::transfer::{Transfer, TransferSettings, unit_light};
use crate::output;
use crate::scene::{Fnv, Scene};

/// Part of every key: the hash of the sources that transfer is made by (build.rs), so that no build
/// takes what another has worked out.
const FORMAT: &str = concat!("lumivox transfer 2 of ", env!("LUMIVOX_TRANSFER"));

/// What a file begins with.
const MAGIC: [u8; 8] = *b"lumiprt2";

/// The file of a scene's transfer, in a folder.
pub(super) fn path_in(folder: &Path, scene: &Scene, settings: &TransferSettings) -> PathBuf {
    let mut hash = Fnv::default();
    scene.hash_geometry(&mut hash);
    let lights: Vec<_> = scene.lights.iter().map(unit_light).collect();
    let materials = &scene.materials;
    // Writing to a hash cannot fail.
    let _ = write!(hash, "{FORMAT} {materials:?} {settings:?}");
    if settings.has_lights {
        let _ = write!(hash, "{lights:?}");
    }
    folder.join(format!("transfer-{:032x}.prt", hash.value()))
}

/// What a file has; `None` where it is not whole.
pub(super) fn read(path: &Path) -> Option<Transfer> {
    let bytes = std::fs::read(path).ok()?;
    let (content, checksum) = bytes.split_last_chunk::<16>()?;
    if u128::from_le_bytes(*checksum) != sum(content) {
        return None;
    }
    let mut rest = content.strip_prefix(&MAGIC)?;
    let mut counts = [0u64; 13];
    for count in &mut counts {
        let (own, after) = rest.split_first_chunk::<8>()?;
        (*count, rest) = (u64::from_le_bytes(*own), after);
    }
    let [
        points,
        nodes,
        triangles,
        rows,
        visibility,
        order,
        functions,
        filled,
        stride,
        vectors,
        basis,
        clusters,
        weights,
    ] = counts;
    let transfer = Transfer {
        lattice: Lattice {
            points: take(&mut rest, points)?,
            nodes: take(&mut rest, nodes)?,
            triangles: take(&mut rest, triangles)?,
        },
        order: order as u32,
        functions: functions as u32,
        rows: take(&mut rest, rows)?,
        visibility: take(&mut rest, visibility)?,
        filled: filled as u32,
        harmonics: match stride {
            0 => None,
            stride => Some(Compressed {
                stride: stride as u32,
                vectors: vectors as u32,
                basis: take(&mut rest, basis)?,
                clusters: take(&mut rest, clusters)?,
                weights: take(&mut rest, weights)?,
            }),
        },
    };
    rest.is_empty().then_some(transfer)
}

fn take<T: bytemuck::AnyBitPattern + bytemuck::NoUninit>(
    rest: &mut &[u8],
    count: u64,
) -> Option<Vec<T>> {
    let bytes = usize::try_from(count).ok()?.checked_mul(size_of::<T>())?;
    let (own, after) = rest.split_at_checked(bytes)?;
    *rest = after;
    Some(bytemuck::pod_collect_to_vec(own))
}

/// Keeps transfer in a file.
pub(super) fn write(path: &Path, transfer: &Transfer) -> Result<(), Box<dyn std::error::Error>> {
    let Transfer {
        lattice,
        order,
        functions,
        harmonics,
        rows,
        visibility,
        filled,
    } = transfer;
    let none = Compressed::default();
    let own = harmonics.as_ref().unwrap_or(&none);
    let counts = [
        lattice.points.len() as u64,
        lattice.nodes.len() as u64,
        lattice.triangles.len() as u64,
        rows.len() as u64,
        visibility.len() as u64,
        (*order).into(),
        (*functions).into(),
        (*filled).into(),
        own.stride.into(),
        own.vectors.into(),
        own.basis.len() as u64,
        own.clusters.len() as u64,
        own.weights.len() as u64,
    ];
    let points: &[Point] = &lattice.points;
    let triangles: &[TriangleNodes] = &lattice.triangles;
    let parts: [&[u8]; 8] = [
        bytemuck::cast_slice(points),
        bytemuck::cast_slice(&lattice.nodes),
        bytemuck::cast_slice(triangles),
        bytemuck::cast_slice(rows),
        bytemuck::cast_slice(visibility),
        bytemuck::cast_slice(&own.basis),
        &own.clusters,
        bytemuck::cast_slice(&own.weights),
    ];
    let mut content = MAGIC.to_vec();
    content.extend(counts.iter().flat_map(|count| count.to_le_bytes()));
    parts.iter().for_each(|part| content.extend(*part));
    let checksum = sum(&content);
    content.extend(checksum.to_le_bytes());
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    Ok(output::write_bytes(path, &content)?)
}

fn sum(content: &[u8]) -> u128 {
    let mut hash = Fnv::default();
    hash.bytes(content);
    hash.value()
}
