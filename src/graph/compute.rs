//! Short forms for declarations of compute passes over buffers alone.

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
