//! Which probes a pass is about.

use std::sync::Arc;

use super::volume::buffer;
use crate::graph::{Access, Binding, Buffer, Error, Gpu, PassBuilder};

/// What a pass binds that is about some probes (`gi/probes/list.glsl`).
pub(super) const LIST_BINDING: Binding = Binding::buffer("probe_list", Access::ComputeRead);

/// Numbers of probes, and the seeds of the turns of their rays, on the device.
#[derive(Clone)]
pub struct ProbeList {
    rows: Arc<Buffer>,
}

/// A part of a [`ProbeList`].
#[derive(Clone, Copy)]
pub struct Listed<'l> {
    rows: &'l Arc<Buffer>,
    /// The first of them in the list.
    pub first: u32,
    /// Their number.
    pub count: u32,
}

impl ProbeList {
    /// Room for so many.
    pub fn new(gpu: &Gpu, capacity: u32) -> Result<Self, Error> {
        Ok(ProbeList {
            rows: buffer(gpu, "probes.list", 8 * u64::from(capacity))?,
        })
    }

    /// The probes from 0 to `count`, each with its number for a seed.
    pub fn of_all(gpu: &Gpu, count: u32) -> Result<Self, Error> {
        let list = ProbeList::new(gpu, count)?;
        let rows: Vec<[u32; 2]> = (0..count).map(|probe| [probe, probe]).collect();
        list.put(gpu, &rows).map(|()| list)
    }

    /// Puts probes in it: number and seed of each, no more than there is room for.
    pub fn put(&self, gpu: &Gpu, rows: &[[u32; 2]]) -> Result<(), Error> {
        gpu.upload_buffer(&self.rows, bytemuck::cast_slice(rows))
    }

    /// `count` of them from `first` on.
    pub fn part(&self, first: u32, count: u32) -> Listed<'_> {
        Listed {
            rows: &self.rows,
            first,
            count,
        }
    }
}

impl Listed<'_> {
    /// Binds [`LIST_BINDING`].
    pub(super) fn bind<'f>(&self, pass: PassBuilder<'f>) -> PassBuilder<'f> {
        pass.bind("probe_list", self.rows)
    }

    /// In parts of at most so many.
    pub(super) fn parts(self, most: u32) -> impl Iterator<Item = Self> {
        (0..self.count)
            .step_by(most as usize)
            .map(move |first| Listed {
                first: self.first + first,
                count: most.min(self.count - first),
                ..self
            })
    }
}
