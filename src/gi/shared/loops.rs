//! What a software device asks of the loops of a shader.

/// Loop iterations that one shader invocation is trusted with; llvmpipe ends its loops, without a
/// word, after 65,535.
pub(crate) const LOOP_BUDGET: u32 = 65_535;

/// Lanes of the widest vector in which a software device runs invocations; a loop turns for all of
/// them until the last has ended.
pub(crate) const VECTOR_LANES: u32 = 8;
