//! What a unit of each function of the light brings each point: a row a point.
//!
//! A row has one output, irradiance, or as many as radiance has harmonics (a matrix). Functions are
//! harmonics of the environment, then columns of emission and of each analytic light.

use rayon::prelude::*;

use super::compress::{CompressSettings, Compressed};

/// Rows of all points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    /// What each function brings, one number a channel for each.
    pub outputs: u32,
    /// Of the light.
    pub functions: u32,
    /// The first functions, those of harmonics, where they are compressed: output by output.
    pub harmonics: Option<Compressed>,
    /// Of each point, of each output, of each other function: red, green and blue.
    pub plain: Vec<f32>,
}

impl Rows {
    /// Collects rows that are worked out one by one; `compress` has how many harmonics there are.
    pub(super) fn collect(
        [points, outputs, functions]: [usize; 3],
        compress: Option<(usize, CompressSettings)>,
        row: impl Fn(usize) -> Vec<f32> + Sync,
    ) -> Self {
        let rows = Rows {
            outputs: outputs as u32,
            functions: functions as u32,
            ..Rows::default()
        };
        let Some((harmonics, settings)) = compress.filter(|(harmonics, _)| *harmonics > 0) else {
            let all: Vec<Vec<f32>> = (0..points).into_par_iter().map(&row).collect();
            return Rows {
                plain: all.concat(),
                ..rows
            };
        };
        let split = |point: usize| {
            let (mut first, mut rest) = (Vec::new(), Vec::new());
            for of_output in row(point).chunks_exact(3 * functions) {
                let (harmonics, others) = of_output.split_at(3 * harmonics);
                first.extend_from_slice(harmonics);
                rest.extend_from_slice(others);
            }
            (first, rest)
        };
        let stride = 3 * harmonics * outputs;
        let (compressed, rests) = Compressed::of(points, stride, settings, split);
        Rows {
            harmonics: Some(compressed),
            plain: rests.concat(),
            ..rows
        }
    }

    /// The first functions, those that are compressed.
    pub fn compressed_functions(&self) -> u32 {
        let harmonics = self.harmonics.as_ref();
        harmonics.map_or(0, |own| own.stride / (3 * self.outputs))
    }

    /// Functions that are not.
    pub fn plain_functions(&self) -> u32 {
        self.functions - self.compressed_functions()
    }

    /// The row of a point: output by output, all functions of each.
    pub fn row(&self, point: usize) -> Vec<f32> {
        let first = self.harmonics.as_ref().map(|own| own.row(point));
        let [first_stride, stride] =
            [self.compressed_functions(), self.plain_functions()].map(|count| 3 * count as usize);
        let plain = self.plain_row(point);
        let mut row = Vec::with_capacity(3 * (self.outputs * self.functions) as usize);
        for output in 0..self.outputs as usize {
            let first = first.iter();
            first.for_each(|first| row.extend(&first[output * first_stride..][..first_stride]));
            row.extend(&plain[output * stride..][..stride]);
        }
        row
    }

    /// The part of a point's row that is not compressed.
    fn plain_row(&self, point: usize) -> &[f32] {
        let stride = 3 * (self.outputs * self.plain_functions()) as usize;
        &self.plain[point * stride..][..stride]
    }

    /// Sets some functions that are not compressed to those of other rows, in their order.
    pub(super) fn set_columns(&mut self, functions: &[usize], fresh: &Rows) {
        let first = self.compressed_functions() as usize;
        let stride = 3 * self.plain_functions() as usize;
        let rows = self.plain.chunks_exact_mut(stride);
        for (row, fresh) in rows.zip(fresh.plain.chunks_exact(3 * functions.len())) {
            for (at, column) in functions.iter().zip(fresh.chunks_exact(3)) {
                row[3 * (at - first)..][..3].copy_from_slice(column);
            }
        }
    }
}
