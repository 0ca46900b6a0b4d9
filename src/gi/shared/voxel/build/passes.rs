//! The passes of voxelization, the records that they read and write, and their parameters.

use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Pass, RasterState, Sets, Shaders};
use crate::render::bvh;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `voxel.fragments`.
    pub struct FragmentParams {
        /// xyz: smallest corner of the whole grid (m); w: 1 / voxel size (1/m).
        pub origin_inverse_size: [f32; 4],
        /// xyz: first voxel of the piece of it that is voxelized; w: grains of a voxel that
        /// positions are rounded to, 0: they are not.
        pub first_voxel: [f32; 4],
        /// Voxels along an edge of the piece.
        pub resolution: u32,
        /// First triangle of the batch.
        pub first_triangle: u32,
        /// Triangles of the batch.
        pub triangle_count: u32,
        /// Material of the batch.
        pub material: u32,
        /// Fragments that fit; further ones are counted only.
        pub capacity: u32,
        /// Largest emission that can be stored (W/(m² sr)).
        pub emission_unit: f32,
        /// First and last voxel of the piece that is asked for, 16 bits each, along x.
        pub clip_x: u32,
        /// The same along y.
        pub clip_y: u32,
        /// The same along z.
        pub clip_z: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.columns`.
    pub struct ColumnParams {
        /// xyz: smallest corner of the grid (m); w: edge of a voxel (m).
        pub origin_size: [f32; 4],
        /// Along which columns are.
        pub axis: u32,
        /// Voxels along an edge.
        pub resolution: u32,
        /// First and last voxel that is asked for, 16 bits each, along x.
        pub clip_x: u32,
        /// The same along y.
        pub clip_y: u32,
        /// The same along z.
        pub clip_z: u32,
        /// Where columns begin, along the axis (m).
        pub start: f32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.fill`.
    pub struct FillParams {
        /// Voxels along an edge.
        pub resolution: u32,
        /// As in [`ColumnParams`].
        pub clip_x: u32,
        /// As in [`ColumnParams`].
        pub clip_y: u32,
        /// As in [`ColumnParams`].
        pub clip_z: u32,
        /// Fragments that fit; further ones are counted only.
        pub capacity: u32,
    }
}

gpu_struct! {
    /// One triangle in one voxel (`gi/shared/voxel/records.glsl`).
    pub struct Fragment {
        /// x, y and z of the voxel, and area of the triangle inside it (1/16384 voxel face), 16
        /// bits each.
        pub place_area: [u32; 2],
        /// Unit normal, octahedral 2×16 bits, and square roots of the linear albedo, 3×10 bits.
        pub normal_albedo: [u32; 2],
        /// Centroid of the part inside, 3×10 bits, and index + 1 of the voxel's next fragment.
        pub position_next: [u32; 2],
    }
}

gpu_struct! {
    /// All fragments of one voxel (`gi/shared/voxel/records.glsl`).
    pub struct Voxel {
        /// x and y, 16 bits each.
        pub xy: u32,
        /// z (16 bits) and area (half float, voxel faces).
        pub z_area: u32,
        /// Mean normal, (n + 1) / 2 in 3×10 bits; of opposed parallel planes, their unit normal.
        pub normal: u32,
        /// Square roots of the mean linear albedo, 3×10 bits.
        pub albedo: u32,
        /// Mean position, 3×10 bits.
        pub mean_position: u32,
        /// Opacity (12 bits), shares of the surface seen from one side (9) and from both (8),
        /// whether it is opposed (1), along which axis (2), of others 1 where it is concave.
        pub coverage: u32,
        /// Area seen from one side along each axis (voxel faces), 3×10 bits.
        pub across: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.count_blocks` and `voxel.index_blocks`.
    pub struct CountParams {
        /// Number of blocks.
        pub block_count: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.scan_groups`.
    pub struct ScanParams {
        /// Number of groups of 1,024 blocks.
        pub group_count: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.link_fragments` and `voxel.running_average`.
    pub struct LinkParams {
        /// Voxels along an edge of the grid.
        pub resolution: u32,
        /// Number of fragments.
        pub fragment_count: u32,
        /// Index of the first of them.
        pub first_fragment: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.resolve`.
    pub struct ResolveParams {
        /// Number of voxels.
        pub voxel_count: u32,
        /// Largest emission that can be stored (W/(m² sr)).
        pub emission_unit: f32,
        /// Index of the first of them.
        pub first_voxel: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.resolve_opposed`.
    pub struct OpposedParams {
        /// As in [`ResolveParams`].
        pub emission_unit: f32,
    }
}

const fn fragment_bindings(access: Access) -> [Binding; 4] {
    [
        Binding::buffer("occupancy", access),
        Binding::buffer("fragments", access),
        Binding::buffer("fragment_emission", access),
        Binding::buffer("fragment_count", access),
    ]
}

static COMPUTE_BINDINGS: [Binding; 4] = fragment_bindings(Access::ComputeReadWrite);
static RASTER_BINDINGS: [Binding; 4] = fragment_bindings(Access::RasterReadWrite);

/// Method `compute`: 64 triangles a workgroup, tiles of their columns spread over its threads.
pub static FRAGMENTS_COMPUTE: Pass = Pass {
    name: "voxel.fragments",
    shaders: Shaders::Compute("gi/shared/voxel/build/fragments_compute.comp"),
    bindings: &COMPUTE_BINDINGS,
    constants: &["EMISSIVE", "MASKED", "TEXTURED", "THIN"],
    params: Some(FragmentParams::LAYOUT),
    sets: Sets::SceneAndMaterials,
};

const fn raster_pass(geometry: &'static str, conservative: bool) -> Pass {
    Pass {
        name: "voxel.fragments",
        shaders: Shaders::Raster {
            vertex: "gi/shared/voxel/build/fragments.vert",
            geometry: Some(geometry),
            fragment: Some("gi/shared/voxel/build/fragments.frag"),
            state: RasterState {
                conservative,
                ..RasterState::NO_TARGETS
            },
        },
        bindings: &RASTER_BINDINGS,
        constants: &["EMISSIVE", "MASKED", "TEXTURED", "THIN"],
        params: Some(FragmentParams::LAYOUT),
        sets: Sets::SceneAndMaterials,
    }
}

/// Method `raster`: software conservative rasterization along the dominant axis.
pub static FRAGMENTS_RASTER: Pass = raster_pass("gi/shared/voxel/build/fragments.geom", false);
/// Method `raster-hw`: the same with hardware conservative rasterization
/// (`VK_EXT_conservative_rasterization`, overestimating).
pub static FRAGMENTS_RASTER_HW: Pass = raster_pass("gi/shared/voxel/build/fragments_hw.geom", true);

/// Which voxels are inside of bodies, along one axis. Reads the scene's triangles; a thread a
/// column.
pub static COLUMNS: Pass = Pass {
    name: "voxel.columns",
    shaders: Shaders::Compute("gi/shared/voxel/build/columns.comp"),
    bindings: &join::<_, 5, 1, 6>(
        bvh::BINDINGS,
        [Binding::buffer("inside", Access::ComputeReadWrite)],
    ),
    constants: &bvh::CONSTANTS,
    params: Some(ColumnParams::LAYOUT),
    sets: Sets::Scene,
};

/// Fragments of what is inside along all axes, where nothing is touched. A thread a voxel.
pub static FILL: Pass = Pass {
    constants: &["EMISSIVE"],
    ..Pass::compute(
        "voxel.fill",
        "gi/shared/voxel/build/fill.comp",
        &[
            Binding::buffer("occupancy", Access::ComputeReadWrite),
            Binding::buffer("fragments", Access::ComputeWrite),
            Binding::buffer("fragment_emission", Access::ComputeWrite),
            Binding::buffer("fragment_count", Access::ComputeReadWrite),
            Binding::buffer("inside", Access::ComputeRead),
        ],
        FillParams::LAYOUT,
    )
};

/// Occupied voxels in each group of 1,024 blocks.
pub static COUNT_BLOCKS: Pass = Pass::compute(
    "voxel.count_blocks",
    "gi/shared/voxel/build/count_blocks.comp",
    &[
        Binding::buffer("occupancy", Access::ComputeRead),
        Binding::buffer("group_sums", Access::ComputeWrite),
    ],
    CountParams::LAYOUT,
);

/// Group sums to group bases, and the number of occupied voxels.
pub static SCAN_GROUPS: Pass = Pass::compute(
    "voxel.scan_groups",
    "gi/shared/voxel/build/scan_groups.comp",
    &[
        Binding::buffer("group_sums", Access::ComputeReadWrite),
        Binding::buffer("voxel_count", Access::ComputeReadWrite),
    ],
    ScanParams::LAYOUT,
);

/// Compact index of each block's first occupied voxel.
pub static INDEX_BLOCKS: Pass = Pass {
    constants: &["LISTS"],
    ..Pass::compute(
        "voxel.index_blocks",
        "gi/shared/voxel/build/index_blocks.comp",
        &[
            Binding::buffer("occupancy", Access::ComputeRead),
            Binding::buffer("group_sums", Access::ComputeRead),
            Binding::buffer("block_bases", Access::ComputeWrite),
            Binding::buffer("filled_blocks", Access::ComputeWrite),
            Binding::buffer("filled_count", Access::ComputeReadWrite),
        ],
        CountParams::LAYOUT,
    )
};

/// One linked list of fragments a voxel.
pub static LINK_FRAGMENTS: Pass = Pass::compute(
    "voxel.link_fragments",
    "gi/shared/voxel/build/link_fragments.comp",
    &[
        Binding::buffer("occupancy", Access::ComputeRead),
        Binding::buffer("block_bases", Access::ComputeRead),
        Binding::buffer("fragments", Access::ComputeReadWrite),
        Binding::buffer("heads", Access::ComputeReadWrite),
    ],
    LinkParams::LAYOUT,
);

/// The papers' moving average of albedo in an RGBA8 image by compare-and-swap (Crassin & Green
/// 2012, section 22.4.2).
pub static RUNNING_AVERAGE: Pass = Pass::compute(
    "voxel.running_average",
    "gi/shared/voxel/build/running_average.comp",
    &[
        Binding::buffer("fragments", Access::ComputeRead),
        Binding::image("averages", Access::ComputeReadWrite),
    ],
    LinkParams::LAYOUT,
);

/// Fragments of each voxel to its record.
pub static RESOLVE_VOXELS: Pass = Pass {
    constants: &["EMISSIVE", "COVERAGE", "RUNNING", "FACES"],
    ..Pass::compute(
        "voxel.resolve",
        "gi/shared/voxel/build/resolve_voxels.comp",
        &[
            Binding::buffer("fragments", Access::ComputeRead),
            Binding::buffer("fragment_emission", Access::ComputeRead),
            Binding::buffer("heads", Access::ComputeRead),
            Binding::buffer("voxels", Access::ComputeWrite),
            Binding::buffer("voxel_emission", Access::ComputeWrite),
            Binding::image("averages", Access::ComputeRead),
            Binding::buffer("voxel_faces", Access::ComputeWrite),
            Binding::buffer("opposed", Access::ComputeWrite),
            Binding::buffer("opposed_count", Access::ComputeReadWrite),
        ],
        ResolveParams::LAYOUT,
    )
};

/// The normals of voxels whose surfaces are opposed and parallel.
pub static RESOLVE_OPPOSED: Pass = Pass {
    constants: &["EMISSIVE"],
    ..Pass::compute(
        "voxel.resolve_opposed",
        "gi/shared/voxel/build/resolve_opposed.comp",
        &[
            Binding::buffer("fragments", Access::ComputeRead),
            Binding::buffer("fragment_emission", Access::ComputeRead),
            Binding::buffer("heads", Access::ComputeRead),
            Binding::buffer("voxels", Access::ComputeReadWrite),
            Binding::buffer("voxel_emission", Access::ComputeWrite),
            Binding::buffer("opposed", Access::ComputeRead),
            Binding::buffer("opposed_count", Access::ComputeRead),
        ],
        OpposedParams::LAYOUT,
    )
};
