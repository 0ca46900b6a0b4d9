//! Rows of transfer on the device, and what they bring under a light.

use std::sync::Arc;

use bytemuck::cast_slice;
use half::f16;

use super::compress::Compressed;
use super::rows::Rows;
use crate::gpu_struct;
use crate::graph::compute::linear_groups;
use crate::graph::{
    Access, Binding, Buffer, BufferDesc, BufferUsage, Error, Frame, Gpu, Owner, Pass,
};
use crate::render::storage;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `prt.light_points`, `prt.light_clusters` and `prt.light_lobes`.
    pub struct PointLightParams {
        /// The first row of the buffer.
        pub first_row: u32,
        /// Rows of the buffer.
        pub row_count: u32,
        /// The first function of a row, among the light's.
        pub first_function: u32,
        /// Functions of a row; even, of an odd number the last is dark.
        pub function_count: u32,
        /// 1: to the light that rows have.
        pub adds: u32,
    }
}

gpu_struct! {
    /// Parameters of `prt.light_compressed`.
    pub struct CompressedLightParams {
        /// The first point of the buffer.
        pub first_point: u32,
        /// Points of the buffer.
        pub point_count: u32,
        /// Vectors of a cluster beside its mean.
        pub vector_count: u32,
        /// Outputs of a point.
        pub output_count: u32,
    }
}

const ROW_BINDINGS: &[Binding] = &[
    Binding::buffer("transfer_words", Access::ComputeRead),
    Binding::buffer("light", Access::ComputeRead),
    Binding::buffer("point_light", Access::ComputeReadWrite),
];

/// Irradiance of points from their transfer. A thread a point.
pub static LIGHT_POINTS: Pass = Pass::compute(
    "prt.light_points",
    "gi/prt/light_points.comp",
    ROW_BINDINGS,
    PointLightParams::LAYOUT,
);

/// The same for the mean and the vectors of each cluster. A thread a row.
pub static LIGHT_CLUSTERS: Pass = Pass::compute(
    "prt.light_clusters",
    "gi/prt/light_points.comp",
    ROW_BINDINGS,
    PointLightParams::LAYOUT,
);

/// The same for the lobes of points. A thread a lobe of a point.
pub static LIGHT_LOBES: Pass = Pass::compute(
    "prt.light_lobes",
    "gi/prt/light_points.comp",
    ROW_BINDINGS,
    PointLightParams::LAYOUT,
);

/// What points have from what their clusters have. A thread an output of a point.
pub static LIGHT_COMPRESSED: Pass = Pass::compute(
    "prt.light_compressed",
    "gi/prt/light_compressed.comp",
    &[
        Binding::buffer("weight_words", Access::ComputeRead),
        Binding::buffer("point_clusters", Access::ComputeRead),
        Binding::buffer("cluster_light", Access::ComputeRead),
        Binding::buffer("point_light", Access::ComputeReadWrite),
    ],
    CompressedLightParams::LAYOUT,
);

/// Rows of half floats in one buffer: a word of all rows, then the next word of all.
struct Part {
    words: Arc<Buffer>,
    first: u32,
    count: u32,
}

/// Rows of half floats, as many of them in a buffer as it may hold.
fn upload_rows(
    gpu: &Gpu,
    name: &str,
    (rows, numbers): (usize, usize),
    number: impl Fn(usize, usize) -> f32,
) -> Result<Vec<Part>, Error> {
    let words = numbers.div_ceil(2);
    let most = gpu.limits().storage_buffer_bytes / (4 * words as u64).max(1);
    let most = most.clamp(1, u64::from(u32::MAX)) as usize;
    let part = |first: usize| {
        let own = most.min(rows - first);
        let mut packed = vec![0u32; words * own];
        for row in 0..own {
            let half = |at: usize| match at < numbers {
                true => u32::from(f16::from_f32(number(first + row, at)).to_bits()),
                false => 0,
            };
            for word in 0..words {
                packed[word * own + row] = half(2 * word) | half(2 * word + 1) << 16;
            }
        }
        Ok(Part {
            words: storage(gpu, (name, Owner::Store), cast_slice(&packed))?,
            first: first as u32,
            count: own as u32,
        })
    };
    (0..rows).step_by(most).map(part).collect()
}

/// Points whose columns of harmonics are compressed.
struct Clusters {
    /// The mean and the vectors of each cluster.
    basis: Vec<Part>,
    /// What each row of the basis brings, output by output.
    light: Arc<Buffer>,
    /// Four points a word.
    of_points: Arc<Buffer>,
    weights: Vec<Part>,
    vectors: u32,
    outputs: u32,
    functions: u32,
}

impl Clusters {
    fn new(gpu: &Gpu, harmonics: &Compressed, outputs: usize) -> Result<Self, Error> {
        let stride = harmonics.stride as usize;
        let own_stride = stride / outputs;
        let vectors = harmonics.vectors as usize;
        let rows = harmonics.basis.len() / stride;
        let own = &harmonics.clusters;
        let mut of_points = own.clone();
        of_points.resize(own.len().next_multiple_of(4), 0);
        let dark = vec![[0.0f32; 4]; outputs * rows];
        Ok(Clusters {
            basis: upload_rows(gpu, "prt.basis", (outputs * rows, own_stride), |row, at| {
                harmonics.basis[row * own_stride + at]
            })?,
            light: storage(gpu, ("prt.cluster_light", Owner::Store), cast_slice(&dark))?,
            of_points: storage(gpu, ("prt.point_clusters", Owner::Store), &of_points)?,
            weights: upload_rows(gpu, "prt.weights", (own.len(), vectors), |point, at| {
                harmonics.weights[point * vectors + at]
            })?,
            vectors: harmonics.vectors,
            outputs: outputs as u32,
            functions: (own_stride as u32 / 3).next_multiple_of(2),
        })
    }

    /// Adds the passes that light all points.
    fn light(&self, frame: &mut Frame, (light, first): (&Arc<Buffer>, u32), lit: &Arc<Buffer>) {
        for part in &self.basis {
            let rows = RowLight {
                part,
                first_function: first,
                function_count: self.functions,
                adds: false,
            };
            rows.add(frame, &LIGHT_CLUSTERS, (light, &self.light));
        }
        for part in &self.weights {
            frame
                .pass(&LIGHT_COMPRESSED)
                .bind("weight_words", &part.words)
                .bind("point_clusters", &self.of_points)
                .bind("cluster_light", &self.light)
                .bind("point_light", lit)
                .push(&CompressedLightParams {
                    first_point: part.first,
                    point_count: part.count,
                    vector_count: self.vectors,
                    output_count: self.outputs,
                })
                .dispatch(linear_groups(self.outputs * part.count));
        }
    }
}

/// A pass that lights rows.
struct RowLight<'p> {
    part: &'p Part,
    first_function: u32,
    function_count: u32,
    adds: bool,
}

impl RowLight<'_> {
    fn add(
        &self,
        frame: &mut Frame,
        pass: &'static Pass,
        (light, lit): (&Arc<Buffer>, &Arc<Buffer>),
    ) {
        frame
            .pass(pass)
            .bind("transfer_words", &self.part.words)
            .bind("light", light)
            .bind("point_light", lit)
            .push(&PointLightParams {
                first_row: self.part.first,
                row_count: self.part.count,
                first_function: self.first_function,
                function_count: self.function_count,
                adds: self.adds.into(),
            })
            .dispatch(linear_groups(self.part.count));
    }
}

/// Largest transfer of a function that is kept as it is; half floats hold twice as much.
const MOST_STORED: f32 = 32_768.0;
/// Below this largest transfer of a function its half floats would lose digits.
const LEAST_STORED: f32 = 0.25;

/// Rows of all points, and what they bring now.
pub(super) struct LitRows {
    pass: &'static Pass,
    clusters: Option<Clusters>,
    /// Columns that are not compressed.
    rows: Vec<Part>,
    /// The first function of those columns.
    first_function: u32,
    /// How many there are, even.
    functions: u32,
    /// The light that points are lit with, a row a function.
    light: Arc<Buffer>,
    /// rgb: what each output of each point has (W/m², of lobes W/(m² sr)); w: as it was given.
    pub(super) lit: Arc<Buffer>,
    /// Powers of two that the transfer of each function was divided by.
    pub(super) scales: Vec<f32>,
}

impl LitRows {
    /// Uploads rows. `pass` lights those that are not compressed; `dark` is what there is before.
    pub(super) fn new(
        gpu: &Gpu,
        rows: &Rows,
        pass: &'static Pass,
        (name, dark): (&str, &[[f32; 4]]),
    ) -> Result<Self, Error> {
        let (compressed, plain) = (rows.compressed_functions(), rows.plain_functions());
        let stride = 3 * plain as usize;
        let mut largest = vec![0.0f32; plain as usize];
        for row in rows.plain.chunks_exact(stride.max(1)) {
            for (largest, rgb) in largest.iter_mut().zip(row.chunks_exact(3)) {
                *largest = rgb
                    .iter()
                    .fold(*largest, |most, value| value.abs().max(most));
            }
        }
        let scale = |largest: &f32| match *largest {
            most if most == 0.0 || (LEAST_STORED..=MOST_STORED).contains(&most) => 1.0,
            most => most.log2().ceil().exp2(),
        };
        // Transfer of harmonics is never large: irradiance of a unit of radiance.
        let mut scales = vec![1.0; compressed as usize];
        scales.extend(largest.iter().map(scale));
        let harmonics = rows.harmonics.as_ref();
        let clusters = harmonics.map(|own| Clusters::new(gpu, own, rows.outputs as usize));
        Ok(LitRows {
            pass,
            clusters: clusters.transpose()?,
            rows: match plain {
                0 => Vec::new(),
                _ => upload_rows(gpu, "prt.transfer", (dark.len(), stride), |row, at| {
                    rows.plain[row * stride + at] / scales[compressed as usize + at / 3]
                })?,
            },
            first_function: compressed,
            functions: plain.next_multiple_of(2),
            light: gpu.create_buffer(&BufferDesc {
                name: "prt.light".into(),
                // A dark one after the last.
                size_bytes: 16 * (1 + u64::from(rows.functions)),
                usage: BufferUsage::Storage,
                owner: Owner::Store,
            })?,
            lit: storage(gpu, (name, Owner::Store), cast_slice(dark))?,
            scales,
        })
    }

    /// Sets the light, a row a function, that points are lit with next.
    pub(super) fn set_light(&self, gpu: &Gpu, light: &[[f32; 3]]) -> Result<(), Error> {
        let rows = light.iter().zip(&self.scales);
        let mut rows: Vec<[f32; 4]> = rows
            .map(|(rgb, scale)| [scale * rgb[0], scale * rgb[1], scale * rgb[2], 0.0])
            .collect();
        rows.resize(1 + self.scales.len(), [0.0; 4]);
        gpu.upload_buffer(&self.light, cast_slice(&rows))
    }

    /// The cluster of each point, four a word, where they are compressed.
    pub(super) fn clusters(&self) -> Option<&Arc<Buffer>> {
        self.clusters.as_ref().map(|clusters| &clusters.of_points)
    }

    /// Adds the passes that light all points, with the light or with another whose first function
    /// has a place in its buffer.
    pub(super) fn light(&self, frame: &mut Frame, other: Option<(&Arc<Buffer>, u32)>) {
        let (light, first) = other.unwrap_or((&self.light, 0));
        if let Some(clusters) = &self.clusters {
            clusters.light(frame, (light, first), &self.lit);
        }
        for part in &self.rows {
            let rows = RowLight {
                part,
                first_function: first + self.first_function,
                function_count: self.functions,
                adds: self.clusters.is_some(),
            };
            rows.add(frame, self.pass, (light, &self.lit));
        }
    }
}
