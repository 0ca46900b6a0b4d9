//! The texels of a clipmap: one 3D texture for all levels, and the passes that fill it.

use std::sync::Arc;

use glam::IVec3;

use super::CONES;
use super::filled::Filled;
use super::layout::{Inner, Layout, Place};
use crate::gi::shared::cone::Volume;
use crate::gi::shared::voxel::build::buffer;
use crate::gi::shared::voxel::{
    Directionality, NormalLobe, Prefilter, VoxelBox, VoxelLight, Voxels,
};
use crate::gpu_struct;
use crate::graph::compute::linear_groups;
use crate::graph::{
    Access, Binding, Bound, Buffer, Error, Frame, Gpu, Image, ImageDesc, ImageKind, ImageUsage,
    Owner, Pass, vk,
};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `clipmap.write_voxels`.
    pub struct WriteParams {
        /// xyz: first voxel of the level modulo n; w: n.
        pub first: [i32; 4],
        /// xyz: first voxel of the box that is made from the finer level alone, from the level's
        /// own.
        pub core_low: [i32; 4],
        /// xyz: end of that box.
        pub core_end: [i32; 4],
        /// xyz: first voxel that is written, from the level's own.
        pub region_low: [i32; 4],
        /// xyz: end of those that are written.
        pub region_end: [i32; 4],
        /// Number of voxels.
        pub voxel_count: u32,
        /// The level that is written, 0 the finest.
        pub clipmap_level: i32,
    }
}

gpu_struct! {
    /// Parameters of `clipmap.clear_box`.
    pub struct ClearBoxParams {
        /// xyz: first voxel of the box modulo n; w: n.
        pub first: [i32; 4],
        /// xyz: size of the box (voxels); w: the level.
        pub size: [i32; 4],
    }
}

gpu_struct! {
    /// Parameters of `clipmap.filter_inner`.
    pub struct InnerParams {
        /// xyz: first voxel that is made, modulo n; w: n.
        pub first: [i32; 4],
        /// xyz: the same from the level's first.
        pub region_low: [i32; 4],
        /// xyz: how many are made.
        pub region_size: [i32; 4],
        /// xyz: middle of the place that is made from the finer level, from the first voxel (half
        /// voxels); w: how far it reaches (voxels).
        pub inner_middle: [i32; 4],
        /// The level that is written.
        pub inner_level: i32,
        /// Width of the band in which texels of the finer level and of the level's own voxels are
        /// mixed (voxels).
        pub inner_ramp: i32,
    }
}

gpu_struct! {
    /// Parameters of `clipmap.filter_top`.
    pub struct TopParams {
        /// xyz: first voxel of the outermost level modulo n; w: n.
        pub first: [i32; 4],
        /// xyz: first texel that is made.
        pub region_low: [i32; 4],
        /// xyz: how many are made.
        pub region_size: [i32; 4],
        /// The outermost level.
        pub finer_level: i32,
    }
}

/// Writes a level's voxels into its texels, their radiance or their mean normals, except where only
/// the next finer level is shown. A thread a voxel.
pub static WRITE_VOXELS: Pass = Pass {
    constants: &["FACES", "SIX", "SIDES", "WRITTEN"],
    ..Pass::compute(
        "clipmap.write_voxels",
        "gi/voxel_cones/clipmap/write_voxels.comp",
        &[
            Binding::buffer("voxels", Access::ComputeRead),
            Binding::buffer("voxel_radiance", Access::ComputeRead),
            Binding::image("clipmap", Access::ComputeWrite),
        ],
        WriteParams::LAYOUT,
    )
};

/// Texels of a box become empty. A thread a texel.
pub static CLEAR_BOX: Pass = Pass {
    constants: &["FACES"],
    ..Pass::compute(
        "clipmap.clear_box",
        "gi/voxel_cones/clipmap/clear_box.comp",
        &[Binding::image("clipmap", Access::ComputeWrite)],
        ClearBoxParams::LAYOUT,
    )
};

/// Texels of a level where the next finer one is shown whole, from that one; towards the end of
/// that, mixed with those that are there where the level has a voxel. A thread a texel.
pub static FILTER_INNER: Pass = Pass {
    constants: &["FILTER", "FACES", "FINER_FACES"],
    ..Pass::compute(
        "clipmap.filter_inner",
        "gi/voxel_cones/clipmap/filter_inner.comp",
        &[
            Binding::image("clipmap", Access::ComputeReadWrite),
            Binding::buffer("occupancy", Access::ComputeRead),
        ],
        InnerParams::LAYOUT,
    )
};

/// A mip above the outermost level. A thread a texel.
pub static FILTER_TOP: Pass = Pass {
    constants: &["FILTER", "FACES", "FINER_FACES", "FROM_LEVEL"],
    ..Pass::compute(
        "clipmap.filter_top",
        "gi/voxel_cones/clipmap/filter_top.comp",
        &[
            Binding::image("finer", Access::ComputeRead),
            Binding::image("coarser", Access::ComputeWrite),
        ],
        TopParams::LAYOUT,
    )
};

/// What `clipmap.write_voxels` writes, as `WRITTEN` there.
#[derive(Clone, Copy)]
enum Written {
    /// A radiance for all directions, or for each face.
    Radiance = 0,
    /// The radiances of both sides together.
    BothSides = 1,
    /// The mean normal of what shines, times its luminance.
    Normal = 2,
}

/// Texels of all levels, RGBA16F, premultiplied by opacity, and opacity.
struct Texels {
    /// n × n × levels · (n + 2); with faces n × 6 (n + 2) × levels · (n + 2).
    levels: Arc<Image>,
    /// Mips of the outermost level, (n/2)³ and less; with faces six side by side along x.
    top: Arc<Image>,
    written: Written,
}

/// What cones march through.
pub struct ClipmapVolume {
    layout: Layout,
    filter: Prefilter,
    directionality: Directionality,
    lobe: Option<NormalLobe>,
    /// Radiance (W/(m² sr)).
    light: Texels,
    /// Mean normals of what shines, times its luminance (W/(m² sr)), where texels shine by them.
    normals: Option<Texels>,
    /// Where these may be other than zero.
    pub(super) filled: Filled,
    /// Two rows a level: for pictures, and for voxels, whose light does not depend on where
    /// between two blocks the camera is.
    rows: [Arc<Buffer>; 2],
}

impl ClipmapVolume {
    /// Allocates it; it is empty after the first update.
    pub fn new(
        gpu: &Gpu,
        layout: Layout,
        filter: Prefilter,
        (directionality, lobe): (Directionality, Option<NormalLobe>),
    ) -> Result<Self, Error> {
        let n = layout.resolution;
        let [height, cubes] = if directionality == Directionality::Isotropic {
            [n, 1]
        } else {
            [6 * (n + 2), 6]
        };
        let image = |name: &str, extent, mips| {
            gpu.create_image(&ImageDesc {
                name: name.into(),
                extent,
                kind: ImageKind::D3,
                format: vk::Format::R16G16B16A16_SFLOAT,
                mips,
                layers: 1,
                usage: ImageUsage::STORAGE | ImageUsage::SAMPLED,
                owner: Owner::Store,
            })
        };
        let texels = |[levels, top]: [&str; 2], written| {
            Ok::<_, Error>(Texels {
                levels: image(levels, [n, height, layout.levels * (n + 2)], 1)?,
                top: image(top, [cubes * (n / 2), n / 2, n / 2], layout.top_mips())?,
                written,
            })
        };
        let written = lobe.map_or(Written::Radiance, |_| Written::BothSides);
        let names = ["clipmap.normals", "clipmap.top_normals"];
        let rows = || buffer(gpu, "clipmap.rows", 32 * u64::from(layout.levels));
        Ok(ClipmapVolume {
            layout,
            filter,
            directionality,
            lobe,
            light: texels(["clipmap.levels", "clipmap.top"], written)?,
            normals: lobe.map(|_| texels(names, Written::Normal)).transpose()?,
            filled: Filled::new(gpu, layout)?,
            rows: [rows()?, rows()?],
        })
    }

    /// Tells the shaders where the levels are.
    pub fn set_places(&self, gpu: &Gpu, places: &[Place]) -> Result<(), Error> {
        let outermost = places[places.len() - 1].first;
        let rows = |place: &dyn Fn(Place) -> Place| -> Vec<[[f32; 4]; 2]> {
            (0u32..)
                .zip(places)
                .map(|(level, own)| self.layout.rows(level, place(*own), outermost))
                .collect()
        };
        let half = 0.5 * self.layout.resolution as f32;
        let own_middle = |Place { first, .. }: Place| Place {
            first,
            middle: first.as_vec3() + half,
        };
        gpu.upload_buffer(&self.rows[0], bytemuck::cast_slice(&rows(&|place| place)))?;
        gpu.upload_buffer(&self.rows[1], bytemuck::cast_slice(&rows(&own_middle)))
    }

    /// What the cones of pictures march through, of levels whose outermost one is here.
    pub fn as_volume(&self, outermost: Place) -> Volume<'_> {
        self.volume(&self.rows[0], outermost)
    }

    /// What the cones of voxels march through.
    pub fn as_seen_by_voxels(&self, outermost: Place) -> Volume<'_> {
        self.volume(&self.rows[1], outermost)
    }

    fn volume<'v>(&'v self, levels: &'v Arc<Buffer>, outermost: Place) -> Volume<'v> {
        let (n, count) = (self.layout.resolution, self.layout.levels);
        let normals = self.normals.as_ref().unwrap_or(&self.light);
        Volume {
            passes: &CONES,
            grid: self.layout.grid(outermost.first),
            bound: [
                Some(("levels", Bound::Buffer(levels))),
                Some(("clipmap", Bound::Image(&self.light.levels))),
                Some(("top", Bound::Image(&self.light.top))),
                Some(("matter", Bound::Image(&self.filled.matter))),
                Some(("normals_of_levels", Bound::Image(&normals.levels))),
                Some(("normals_of_top", Bound::Image(&normals.top))),
            ],
            constants: [Some(("N", n)), Some(("LEVELS", count))],
            directionality: self.directionality,
            lobe: self.lobe,
            sides: 1 + u32::from(self.lobe.is_some() || self.directionality.faces().is_some()),
            // In each level further out voxels are larger.
            voxels_across: n * count,
            face_stride: 0,
        }
    }

    /// All texels, each made by the same passes.
    fn texels(&self) -> impl Iterator<Item = &Texels> {
        std::iter::once(&self.light).chain(&self.normals)
    }

    fn has_faces(&self) -> u32 {
        u32::from(self.directionality != Directionality::Isotropic)
    }

    /// Whether a level has a texel for each of six faces, and not one for all.
    fn has_six(&self, level: u32) -> u32 {
        if level == 0 {
            u32::from(self.directionality.faces().is_some())
        } else {
            self.has_faces()
        }
    }

    /// Adds the passes that empty all texels.
    pub fn clear(&self, frame: &mut Frame) {
        for texels in self.texels() {
            frame.clear_image("clipmap.clear", &texels.levels, [0.0; 4]);
        }
    }

    /// Adds the passes that empty a box of a level, in voxels of its unbounded grid.
    pub fn clear_box(&self, frame: &mut Frame, level: u32, cleared: VoxelBox) {
        if cleared.is_empty() {
            return;
        }
        let size = cleared.size();
        let groups = (size.as_uvec3() + 3) / 4;
        for texels in self.texels() {
            frame
                .pass(&CLEAR_BOX)
                .bind("clipmap", &texels.levels)
                .constant("FACES", self.has_faces())
                .push(&ClearBoxParams {
                    first: self.wrap(cleared.low),
                    size: size.extend(level as i32).to_array(),
                })
                .dispatch(groups.to_array());
        }
    }

    /// Adds the pass that writes the voxels of a level that are in `region`, except those that the
    /// finer level alone gives.
    pub fn write_voxels(
        &self,
        frame: &mut Frame,
        level: u32,
        region: VoxelBox,
        inner: &Inner,
        voxels: &Voxels,
        light: &VoxelLight,
    ) {
        let (first, core) = (voxels.lattice.first, inner.core());
        let [core_low, core_end, region_low, region_end] =
            [core.low, core.end, region.low, region.end]
                .map(|corner| (corner - first).extend(0).to_array());
        let (voxel_count, clipmap_level) = (voxels.voxel_count, level as i32);
        let params = WriteParams {
            first: self.wrap(first),
            core_low,
            core_end,
            region_low,
            region_end,
            voxel_count,
            clipmap_level,
        };
        for texels in self.texels() {
            let pass = frame
                .pass(&WRITE_VOXELS)
                .bind("voxels", &voxels.records)
                .bind("voxel_radiance", &light.radiance)
                .bind("clipmap", &texels.levels);
            pass.constant("FACES", self.has_faces())
                .constant("SIX", light.settings.stores_faces)
                .constant("SIDES", light.settings.radiances())
                .constant("WRITTEN", texels.written as u32)
                .push(&params)
                .dispatch(linear_groups(voxels.voxel_count));
        }
    }

    /// Adds the pass that makes the texels of a level that are in `region` from the next finer one,
    /// where it is shown, and from those of its own voxels, after [`ClipmapVolume::write_voxels`].
    pub fn filter_inner(
        &self,
        frame: &mut Frame,
        level: u32,
        region: VoxelBox,
        inner: &Inner,
        voxels: &Voxels,
    ) {
        let made = region.cut(inner.region());
        if made.is_empty() {
            return;
        }
        let params = InnerParams {
            first: self.wrap(made.low),
            region_low: (made.low - voxels.lattice.first).extend(0).to_array(),
            region_size: made.size().extend(0).to_array(),
            inner_middle: (inner.middle - 2 * made.low).extend(inner.reach).to_array(),
            inner_level: level as i32,
            inner_ramp: inner.ramp,
        };
        let groups = (made.size().as_uvec3() + 3) / 4;
        for texels in self.texels() {
            frame
                .pass(&FILTER_INNER)
                .bind("clipmap", &texels.levels)
                .bind("occupancy", &voxels.occupancy)
                .constant("FILTER", self.filter as u32)
                .constant("FACES", self.has_faces())
                .constant("FINER_FACES", self.has_six(level - 1))
                .push(&params)
                .dispatch(groups.to_array());
        }
    }

    /// Adds the passes that make the mips above the outermost level, which begins at `first`, where
    /// its texels in `region` are seen.
    pub fn filter_top(&self, frame: &mut Frame, first: IVec3, region: VoxelBox) {
        let outermost = self.layout.levels - 1;
        let mut made = VoxelBox {
            low: region.low - first,
            end: region.end - first,
        };
        for mip in 0..self.light.top.mips() {
            made = made.coarser();
            let params = TopParams {
                first: self.wrap(first),
                region_low: made.low.extend(0).to_array(),
                region_size: made.size().extend(0).to_array(),
                finer_level: outermost as i32,
            };
            let [x, y, z] = made.size().as_uvec3().to_array();
            let threads = [x * if self.has_faces() == 0 { 1 } else { 6 }, y, z];
            for Texels { levels, top, .. } in self.texels() {
                let pass = frame.pass(&FILTER_TOP);
                let (pass, six) = if mip == 0 {
                    (pass.bind("finer", levels), self.has_six(outermost))
                } else {
                    (pass.bind_mip("finer", top, mip - 1), self.has_faces())
                };
                pass.bind_mip("coarser", top, mip)
                    .constant("FILTER", self.filter as u32)
                    .constant("FACES", self.has_faces())
                    .constant("FINER_FACES", six)
                    .constant("FROM_LEVEL", mip == 0)
                    .push(&params)
                    .dispatch(threads.map(|texels| texels.div_ceil(4)));
            }
        }
    }

    /// Where a voxel is in its slab, and n.
    fn wrap(&self, voxel: IVec3) -> [i32; 4] {
        let n = self.layout.resolution as i32;
        voxel.rem_euclid(IVec3::splat(n)).extend(n).to_array()
    }
}
