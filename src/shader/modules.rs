//! Every embedded module, sorted by stem. Written by `tools/shaders`.

/// Stem and SPIR-V.
#[rustfmt::skip]
pub(super) static MODULES: &[(&str, &[u8])] = &[
    ("test/color.frag", include_bytes!("../../spirv/test/color.frag.spv")),
    ("test/copy.comp", include_bytes!("../../spirv/test/copy.comp.spv")),
    ("test/count.frag", include_bytes!("../../spirv/test/count.frag.spv")),
    ("test/double.comp", include_bytes!("../../spirv/test/double.comp.spv")),
    ("test/material.comp", include_bytes!("../../spirv/test/material.comp.spv")),
    ("test/quad.vert", include_bytes!("../../spirv/test/quad.vert.spv")),
    ("test/sample3d.comp", include_bytes!("../../spirv/test/sample3d.comp.spv")),
    ("test/store3d.comp", include_bytes!("../../spirv/test/store3d.comp.spv")),
    ("test/through.geom", include_bytes!("../../spirv/test/through.geom.spv")),
];
