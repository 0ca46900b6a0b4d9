//! Transfer kept on disk under the hash of all that it depends on: geometry, materials, where
//! lights are, and settings. The environment is not among them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::compress::Compressed;
use super::lattice::Lattice;
use super::rows::Rows;
use super::transfer::{Transfer, TransferSettings, unit_light};
use crate::output;
use crate::scene::{Fnv, Scene};

/// Part of every key: the hash of the sources that transfer is made by (build.rs), so that no build
/// takes what another has worked out.
const FORMAT: &str = concat!("lumivox transfer 3 of ", env!("LUMIVOX_TRANSFER"));

/// What a file begins with.
const MAGIC: [u8; 8] = *b"lumiprt3";

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
    let [order, filled, has_lobes] = take(&mut rest)?[..] else {
        return None;
    };
    let transfer = Transfer {
        lattice: Lattice {
            points: take(&mut rest)?,
            nodes: take(&mut rest)?,
            triangles: take(&mut rest)?,
            hanging: take(&mut rest)?,
        },
        order,
        filled,
        visibility: take(&mut rest)?,
        folded: take(&mut rest)?,
        irradiance: take_rows(&mut rest)?,
        lobes: match has_lobes {
            0 => None,
            _ => Some(take_rows(&mut rest)?),
        },
    };
    rest.is_empty().then_some(transfer)
}

fn take_rows(rest: &mut &[u8]) -> Option<Rows> {
    let [outputs, functions, stride, vectors] = take(rest)?[..] else {
        return None;
    };
    let harmonics = Compressed {
        stride,
        vectors,
        basis: take(rest)?,
        clusters: take(rest)?,
        weights: take(rest)?,
    };
    Some(Rows {
        outputs,
        functions,
        harmonics: (stride > 0).then_some(harmonics),
        plain: take(rest)?,
    })
}

/// A part of the file: how many there are, then all of them.
fn take<T: bytemuck::AnyBitPattern + bytemuck::NoUninit>(rest: &mut &[u8]) -> Option<Vec<T>> {
    let (count, after) = rest.split_first_chunk::<8>()?;
    let count = usize::try_from(u64::from_le_bytes(*count)).ok()?;
    let (own, after) = after.split_at_checked(count.checked_mul(size_of::<T>())?)?;
    *rest = after;
    Some(bytemuck::pod_collect_to_vec(own))
}

fn put<T: bytemuck::NoUninit>(content: &mut Vec<u8>, part: &[T]) {
    content.extend((part.len() as u64).to_le_bytes());
    content.extend_from_slice(bytemuck::cast_slice(part));
}

fn put_rows(content: &mut Vec<u8>, rows: &Rows) {
    let none = Compressed::default();
    let own = rows.harmonics.as_ref().unwrap_or(&none);
    put(
        content,
        &[rows.outputs, rows.functions, own.stride, own.vectors],
    );
    put(content, &own.basis);
    put(content, &own.clusters);
    put(content, &own.weights);
    put(content, &rows.plain);
}

/// Keeps transfer in a file.
pub(super) fn write(path: &Path, transfer: &Transfer) -> Result<(), Box<dyn std::error::Error>> {
    let Transfer {
        lattice,
        order,
        irradiance,
        lobes,
        visibility,
        folded,
        filled,
    } = transfer;
    let mut content = MAGIC.to_vec();
    put(&mut content, &[*order, *filled, lobes.is_some().into()]);
    put(&mut content, &lattice.points);
    put(&mut content, &lattice.nodes);
    put(&mut content, &lattice.triangles);
    put(&mut content, &lattice.hanging);
    put(&mut content, visibility);
    put(&mut content, folded);
    put_rows(&mut content, irradiance);
    if let Some(lobes) = lobes {
        put_rows(&mut content, lobes);
    }
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
