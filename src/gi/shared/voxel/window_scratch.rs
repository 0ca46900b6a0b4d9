//! What windows need while they move, and share.

use std::sync::Arc;

use super::build::passes::{Fragment, Voxel};
use super::build::{FragmentLists, buffer};
use crate::graph::{Buffer, Error, Gpu};
use crate::render::GpuScene;

/// Records that a window's go to when it moves, and what only an update needs; windows share it.
pub struct WindowScratch {
    pub(super) nothing: Arc<Buffer>,
    /// Fragments, and their emission, of each window that moves at once with others.
    pub(super) fragments: Vec<[Arc<Buffer>; 2]>,
    /// Lists over the fragments of one window after the other.
    pub(super) lists: FragmentLists,
    pub(super) records: Arc<Buffer>,
    pub(super) emission: Option<Arc<Buffer>>,
    /// Only for windows of directional voxels, from their first update on.
    pub(super) faces: Option<Arc<Buffer>>,
}

impl WindowScratch {
    /// Empty buffers, which the first update makes as large as it needs them.
    pub fn new(gpu: &Gpu, scene: &GpuScene) -> Result<Self, Error> {
        Ok(WindowScratch {
            nothing: buffer(gpu, "voxel.nothing", 0)?,
            fragments: Vec::new(),
            lists: FragmentLists::new(gpu, Self::no_fragments(gpu, scene)?, 0)?,
            records: buffer(gpu, "voxel.records", 0)?,
            emission: scene
                .is_emissive
                .then(|| buffer(gpu, "voxel.emission", 0))
                .transpose()?,
            faces: None,
        })
    }

    /// The same, with room for so many fragments of each window that moves at once with others.
    pub fn with_room(
        gpu: &Gpu,
        scene: &GpuScene,
        counts: impl Iterator<Item = u32>,
    ) -> Result<Self, Error> {
        let mut scratch = Self::new(gpu, scene)?;
        for (window, count) in counts.enumerate() {
            scratch.hold(gpu, scene, window + 1)?;
            scratch.reserve_fragments(gpu, scene, (window, count))?;
        }
        Ok(scratch)
    }

    /// Takes up so many windows that move at once.
    pub(super) fn hold(&mut self, gpu: &Gpu, scene: &GpuScene, count: usize) -> Result<(), Error> {
        while self.fragments.len() < count {
            self.fragments.push(Self::no_fragments(gpu, scene)?);
        }
        Ok(())
    }

    fn no_fragments(gpu: &Gpu, scene: &GpuScene) -> Result<[Arc<Buffer>; 2], Error> {
        let emission = if scene.is_emissive {
            "voxel.fragment_emission"
        } else {
            "voxel.nothing"
        };
        Ok([
            buffer(gpu, "voxel.fragments", 0)?,
            buffer(gpu, emission, 0)?,
        ])
    }

    /// Fragments that there is room for, of one of the windows.
    pub(super) fn capacity(&self, window: usize) -> u32 {
        (self.fragments[window][0].size_bytes() / size_of::<Fragment>() as u64) as u32
    }

    pub(super) fn reserve_fragments(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
        (window, count): (usize, u32),
    ) -> Result<(), Error> {
        let [fragments, emission] = &mut self.fragments[window];
        reserve(gpu, fragments, size_of::<Fragment>(), count)?;
        if scene.is_emissive {
            reserve(gpu, emission, 8, count)
        } else {
            Ok(())
        }
    }

    pub(super) fn reserve_voxels(
        &mut self,
        gpu: &Gpu,
        count: u32,
        has_faces: bool,
    ) -> Result<(), Error> {
        if has_faces {
            let faces = self
                .faces
                .take()
                .map_or_else(|| buffer(gpu, "voxel.faces", 0), Ok)?;
            reserve(gpu, self.faces.insert(faces), 8, count)?;
        }
        reserve(gpu, &mut self.lists.heads, 4, count)?;
        reserve(gpu, &mut self.lists.opposed, 4, count)?;
        reserve(gpu, &mut self.records, size_of::<Voxel>(), count)?;
        self.emission
            .as_mut()
            .map_or(Ok(()), |emission| reserve(gpu, emission, 16, count))
    }
}

/// Makes a buffer larger, without its contents, where it has no room for `count` elements; then
/// with an eighth to spare.
fn reserve(gpu: &Gpu, target: &mut Arc<Buffer>, stride: usize, count: u32) -> Result<(), Error> {
    let needed = stride as u64 * u64::from(count);
    if needed > target.size_bytes() {
        *target = buffer(
            gpu,
            target.name(),
            stride as u64 * (u64::from(count) + u64::from(count) / 8),
        )?;
    }
    Ok(())
}
