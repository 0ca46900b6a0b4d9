//! Short forms for declarations of compute passes over buffers alone.

use super::{Access, Binding, Pass, Sets, Shaders};

/// A pass without the scene.
pub const fn pass(
    name: &'static str,
    shader: &'static str,
    bindings: &'static [Binding],
    push_bytes: usize,
) -> Pass {
    Pass {
        name,
        shaders: Shaders::Compute(shader),
        bindings,
        push_bytes: push_bytes as u32,
        sets: Sets::None,
    }
}

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
