//! Rows of transfer by clusters of points: the mean of a cluster and a few vectors, and for each
//! point its weights of them (clustered principal components, Sloan, Hall, Hart & Snyder 2003).
//!
//! (P5) T(p) ≈ M⁰_c + Σ_i w_i(p) Mⁱ_c, where c is the cluster that rebuilds T(p) best. Without
//! vectors this is vector quantization, with one cluster plain principal components.

use std::iter::Sum;
use std::ops::{AddAssign, Mul};

use rayon::prelude::*;

/// Clusters, and the vectors of each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CompressSettings {
    /// 1 to 256. Fewer are made where there are fewer points.
    pub clusters: u32,
    /// Beside the mean.
    pub vectors: u32,
}

/// Rows, as clusters keep them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Compressed {
    /// Numbers of a row.
    pub stride: u32,
    /// Vectors of a cluster, beside its mean.
    pub vectors: u32,
    /// Of each cluster: its mean, then its vectors; those are orthonormal, or 0 where none is left.
    pub basis: Vec<f32>,
    /// Of each row: its cluster.
    pub clusters: Vec<u8>,
    /// Of each row: a weight of each vector.
    pub weights: Vec<f32>,
}

/// Rows that clusters are learnt from; of more rows, as many spread evenly.
const MOST_LEARNT: usize = 16_384;
/// Numbers of all those rows: where rows are long, fewer are learnt from.
const MOST_LEARNT_NUMBERS: usize = 12_000_000;
/// Rounds in which rows go to the nearest mean.
const MEAN_ROUNDS: usize = 8;
/// Rounds after them in which rows go to the cluster that rebuilds them best.
const VECTOR_ROUNDS: usize = 10;
/// Steps of subspace iteration in each; they go on from the vectors of the round before.
const SUBSPACE_STEPS: usize = 2;

impl Compressed {
    /// Compresses rows of `stride` numbers. The same rows give the same clusters.
    pub fn new(rows: &[f32], stride: usize, settings: CompressSettings) -> Self {
        let row = |at: usize| (rows[at * stride..][..stride].to_vec(), ());
        Compressed::of(rows.len() / stride.max(1), stride, settings, row).0
    }

    /// The same of rows that are worked out one by one, some of them twice, and never all kept;
    /// what else comes with each is returned.
    pub(super) fn of<R: Send>(
        count: usize,
        stride: usize,
        settings: CompressSettings,
        row: impl Fn(usize) -> (Vec<f32>, R) + Sync,
    ) -> (Self, Vec<R>) {
        let most = (MOST_LEARNT_NUMBERS / stride.max(1)).min(MOST_LEARNT);
        let learnt = count.min(most);
        let sample = (0..learnt).into_par_iter();
        let sample: Vec<Vec<f32>> = sample.map(|at| row(at * count / learnt).0).collect();
        let clusters = learn(&sample, stride, settings);
        drop(sample);
        let encode = |at: usize| {
            let (row, rest) = row(at);
            let (own, _) = nearest(&clusters, &row);
            let weights: Vec<f32> = clusters[own].weights(&row).collect();
            (own as u8, weights, rest)
        };
        let encoded: Vec<(u8, Vec<f32>, R)> = (0..count).into_par_iter().map(encode).collect();
        let mut compressed = Compressed {
            stride: stride as u32,
            vectors: settings.vectors,
            basis: clusters.iter().flat_map(|own| own.basis.clone()).collect(),
            ..Compressed::default()
        };
        let mut rests = Vec::with_capacity(count);
        for (own, weights, rest) in encoded {
            compressed.clusters.push(own);
            compressed.weights.extend(weights);
            rests.push(rest);
        }
        (compressed, rests)
    }

    /// A row, rebuilt.
    pub fn row(&self, at: usize) -> Vec<f32> {
        let (stride, vectors) = (self.stride as usize, self.vectors as usize);
        let first = usize::from(self.clusters[at]) * (1 + vectors) * stride;
        let basis = &self.basis[first..][..(1 + vectors) * stride];
        let (mean, basis) = basis.split_at(stride);
        let mut row = mean.to_vec();
        let weights = &self.weights[at * vectors..][..vectors];
        for (weight, vector) in weights.iter().zip(basis.chunks_exact(stride)) {
            add(&mut row, *weight, vector);
        }
        row
    }
}

/// Clusters of some rows.
fn learn(sample: &[Vec<f32>], stride: usize, settings: CompressSettings) -> Vec<Cluster> {
    let mut learning = Learning::new(sample, stride, settings);
    for _ in 0..MEAN_ROUNDS {
        learning.assign();
        learning.set_means();
    }
    if settings.vectors > 0 {
        for _ in 0..VECTOR_ROUNDS {
            learning.set_vectors();
            learning.assign();
            learning.set_means();
        }
        learning.set_vectors();
    }
    learning.clusters
}

/// The mean of a cluster and its vectors, one after the other.
#[derive(Clone)]
struct Cluster {
    basis: Vec<f32>,
    stride: usize,
}

impl Cluster {
    fn mean(&self) -> &[f32] {
        &self.basis[..self.stride]
    }

    fn vectors(&self) -> impl Iterator<Item = &[f32]> {
        self.basis[self.stride..].chunks_exact(self.stride)
    }

    fn weights(&self, row: &[f32]) -> impl Iterator<Item = f32> {
        let off = self.off(row);
        self.vectors().map(move |vector| dot(&off, vector))
    }

    fn off(&self, row: &[f32]) -> Vec<f32> {
        let pairs = row.iter().zip(self.mean());
        pairs.map(|(value, mean)| value - mean).collect()
    }

    /// The squared error of a row that it rebuilds.
    fn error(&self, row: &[f32]) -> f32 {
        let off = self.off(row);
        let held: f32 = self.vectors().map(|vector| dot(&off, vector).powi(2)).sum();
        dot(&off, &off) - held
    }
}

/// Clusters whose vectors are tried on a row: those with the nearest means.
const TRIED: usize = 8;

/// The cluster that rebuilds a row best, of those with the nearest means, and its squared error.
fn nearest(clusters: &[Cluster], row: &[f32]) -> (usize, f32) {
    let distances = clusters.iter().map(|cluster| distance(row, cluster.mean()));
    let mut near: Vec<(usize, f32)> = distances.enumerate().collect();
    if near.len() > TRIED {
        near.select_nth_unstable_by(TRIED, |a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        near.truncate(TRIED);
    }
    let errors = near.iter().map(|(at, _)| (*at, clusters[*at].error(row)));
    let better = |best: (usize, f32), other: (usize, f32)| {
        let order = other.1.total_cmp(&best.1).then(other.0.cmp(&best.0));
        if order.is_lt() { other } else { best }
    };
    errors.reduce(better).unwrap_or_default()
}

/// Clusters, as they are learnt.
struct Learning<'r> {
    rows: &'r [Vec<f32>],
    clusters: Vec<Cluster>,
    /// Of each row: its cluster and its squared error there.
    own: Vec<(usize, f32)>,
    vectors: usize,
}

impl<'r> Learning<'r> {
    /// Means are rows, each taken where the squared distances from the means before it, summed up
    /// row by row, reach a part of their sum that goes on by the golden ratio: k-means++ (Arthur &
    /// Vassilvitskii 2007) without chance.
    fn new(rows: &'r [Vec<f32>], stride: usize, settings: CompressSettings) -> Self {
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        let mut clusters: Vec<Cluster> = Vec::new();
        let mut distances = vec![f32::INFINITY; rows.len()];
        let wanted = (settings.clusters as usize).min(rows.len());
        while clusters.len() < wanted {
            let part = (golden * (clusters.len() + 1) as f64).fract();
            let all: f64 = distances.iter().map(|distance| f64::from(*distance)).sum();
            let picked = match all {
                all if all.is_infinite() => rows.len() / 2,
                0.0 => break,
                all => {
                    let mut sum = 0.0;
                    let reached = distances.iter().position(|distance| {
                        sum += f64::from(*distance);
                        sum > part * all
                    });
                    reached.unwrap_or(rows.len() - 1)
                }
            };
            let fresh = Cluster {
                basis: rows[picked].clone(),
                stride,
            };
            distances
                .par_iter_mut()
                .zip(rows)
                .for_each(|(distance, row)| *distance = distance.min(fresh.error(row)));
            clusters.push(fresh);
        }
        Learning {
            own: vec![(0, 0.0); rows.len()],
            rows,
            clusters,
            vectors: settings.vectors as usize,
        }
    }

    fn assign(&mut self) {
        let clusters = &self.clusters;
        let own = self.rows.par_iter().map(|row| nearest(clusters, row));
        self.own = own.collect();
    }

    fn members(&self) -> Vec<Vec<&'r [f32]>> {
        let mut members = vec![Vec::new(); self.clusters.len()];
        for ((own, _), row) in self.own.iter().zip(self.rows) {
            members[*own].push(row.as_slice());
        }
        members
    }

    /// A cluster without rows takes the one that is rebuilt worst.
    fn set_means(&mut self) {
        let mut members = self.members();
        let mut worst: Vec<usize> = (0..self.rows.len()).collect();
        worst.sort_by(|a, b| self.own[*b].1.total_cmp(&self.own[*a].1));
        let empty = members.iter_mut().filter(|rows| rows.is_empty());
        for (rows, worst) in empty.zip(worst) {
            rows.push(&self.rows[worst]);
        }
        self.clusters
            .par_iter_mut()
            .zip(members)
            .for_each(|(cluster, rows)| {
                let mut mean = vec![0.0; cluster.stride];
                let share = 1.0 / rows.len() as f32;
                rows.iter().for_each(|row| add(&mut mean, share, row));
                cluster.basis[..mean.len()].copy_from_slice(&mean);
            });
    }

    /// The vectors that hold most of what rows differ in from their mean. Sums are f64: the
    /// spread along the last vectors is small beside that along the first.
    fn set_vectors(&mut self) {
        let (members, vectors) = (self.members(), self.vectors);
        self.clusters
            .par_iter_mut()
            .zip(members)
            .for_each(|(cluster, rows)| {
                let stride = cluster.stride;
                let wide = |row: &[f32]| row.iter().map(|value| f64::from(*value)).collect();
                let off: Vec<Vec<f64>> = rows.iter().map(|row| wide(&cluster.off(row))).collect();
                let mut basis: Vec<Vec<f64>> = cluster.vectors().map(wide).collect();
                if basis.is_empty() {
                    let spread = (0..vectors).map(|at| off.get(at * off.len() / vectors));
                    let zero = || vec![0.0; stride];
                    basis = spread
                        .map(|row| row.map_or_else(zero, Vec::clone))
                        .collect();
                    make_orthonormal(&mut basis);
                }
                for _ in 0..SUBSPACE_STEPS {
                    let mut next = vec![vec![0.0; stride]; vectors];
                    for row in &off {
                        for (next, vector) in next.iter_mut().zip(&basis) {
                            add(next, dot(row, vector), row);
                        }
                    }
                    basis = next;
                    make_orthonormal(&mut basis);
                }
                cluster.basis.truncate(stride);
                let narrow = basis.iter().flatten().map(|value| *value as f32);
                cluster.basis.extend(narrow);
            });
    }
}

/// What is left of a vector may have this part of its length before it is no direction.
const LEAST_LEFT: f64 = 1e-9;

/// Gram and Schmidt, twice for what the first leaves; vectors that depend on others become 0.
fn make_orthonormal(vectors: &mut [Vec<f64>]) {
    for at in 0..vectors.len() {
        let (before, rest) = vectors.split_at_mut(at);
        let own = &mut rest[0];
        let length = dot(own, own).sqrt();
        for _ in 0..2 {
            for other in &*before {
                let along = dot(own, other);
                add(own, -along, other);
            }
        }
        let left = dot(own, own).sqrt();
        let scale = match left > LEAST_LEFT * length {
            true => 1.0 / left,
            false => 0.0,
        };
        own.iter_mut().for_each(|value| *value *= scale);
    }
}

/// A number of rows, narrow or wide.
trait Number: Copy + AddAssign + Mul<Output = Self> + Default + Sum {}
impl Number for f32 {}
impl Number for f64 {}

fn add<N: Number>(sum: &mut [N], factor: N, row: &[N]) {
    for (sum, value) in sum.iter_mut().zip(row) {
        *sum += factor * *value;
    }
}

/// The square of it, in lanes as [`dot`].
fn distance(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; LANES];
    let (whole_a, rest_a) = a.as_chunks::<LANES>();
    let (whole_b, rest_b) = b.as_chunks::<LANES>();
    for (a, b) in whole_a.iter().zip(whole_b) {
        for lane in 0..LANES {
            sums[lane] += (a[lane] - b[lane]).powi(2);
        }
    }
    let rest = rest_a.iter().zip(rest_b).map(|(a, b)| (a - b).powi(2));
    sums.into_iter().chain(rest).sum()
}

/// Lanes that the compiler makes vectors of.
const LANES: usize = 8;

/// In lanes.
fn dot<N: Number>(a: &[N], b: &[N]) -> N {
    let mut sums = [N::default(); LANES];
    let (whole_a, rest_a) = a.as_chunks::<LANES>();
    let (whole_b, rest_b) = b.as_chunks::<LANES>();
    for (a, b) in whole_a.iter().zip(whole_b) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest = rest_a.iter().zip(rest_b).map(|(a, b)| *a * *b);
    sums.into_iter().chain(rest).sum()
}
