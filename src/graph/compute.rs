//! Short forms for compute passes: declarations of those over buffers alone, and workgroups.

use super::{Access, Binding};

/// A buffer that it reads.
pub const fn read(name: &'static str) -> Binding {
    Binding::buffer(name, Access::ComputeRead)
}

/// A buffer that it writes.
pub const fn write(name: &'static str) -> Binding {
    Binding::buffer(name, Access::ComputeWrite)
}

/// A buffer that it reads and writes.
pub const fn read_write(name: &'static str) -> Binding {
    Binding::buffer(name, Access::ComputeReadWrite)
}

/// Workgroups of 64 threads for a linear index; beyond the limit of one dimension they go on in the
/// second (`y × 65,535 × 64`).
pub(crate) fn linear_groups(count: u32) -> [u32; 3] {
    let groups = count.div_ceil(64);
    [groups.min(65_535), groups.div_ceil(65_535).max(1), 1]
}
