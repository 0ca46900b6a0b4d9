//! Structs that Rust writes and shaders read.

/// One field of a [`GpuStruct`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Name, the same in GLSL.
    pub name: &'static str,
    /// Bytes from the start of the struct.
    pub offset: usize,
    /// Size of the field (bytes).
    pub size: usize,
}

/// The name of a struct and all its fields in order.
pub type StructLayout = (&'static str, &'static [Field]);

/// A plain struct with a table of its layout, so that a test can hold it against the compiled
/// shaders.
pub trait GpuStruct: bytemuck::Pod {
    /// Name, the same in GLSL.
    const NAME: &'static str;
    /// All fields in order.
    const FIELDS: &'static [Field];
    /// Name and fields.
    const LAYOUT: StructLayout = (Self::NAME, Self::FIELDS);
}

/// Declares a `#[repr(C)]` plain struct with a table of its layout ([`GpuStruct`]).
///
/// Padding must be spelled out as fields, since plain bytes have no holes.
#[macro_export]
macro_rules! gpu_struct {
    ($(#[$meta:meta])* $visibility:vis struct $name:ident
        { $($(#[$field_meta:meta])* $field_visibility:vis $field:ident : $kind:ty),* $(,)? }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        $visibility struct $name {
            $($(#[$field_meta])* $field_visibility $field: $kind),*
        }

        impl $crate::shader::GpuStruct for $name {
            const NAME: &'static str = stringify!($name);
            const FIELDS: &'static [$crate::shader::Field] = &[
                $($crate::shader::Field {
                    name: stringify!($field),
                    offset: std::mem::offset_of!($name, $field),
                    size: std::mem::size_of::<$kind>(),
                }),*
            ];
        }
    };
}
