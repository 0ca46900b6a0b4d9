//! The four error metrics of a list of values.

use serde::{Deserialize, Serialize};

/// Error of T against R over a set of values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// sqrt(mean (T − R)²) / mean |R|.
    pub rel_rmse: f64,
    /// mean (T − R) / mean |R|.
    pub bias: f64,
    /// mean ((T − R)² / (R² + ε²)).
    pub rel_mse: f64,
    /// 95th percentile (nearest rank) of |T − R| / (|R| + ε).
    pub p95: f64,
    /// Mean |R|, in the unit of the images; light is never negative, normals are.
    pub mean_reference: f64,
    /// Number of values.
    pub count: usize,
}

/// The errors of `technique` against `reference`, value by value; `None` where there are none. The
/// shorter of the two counts.
pub fn errors_of_values(technique: &[f32], reference: &[f32]) -> Option<Errors> {
    let count = technique.len().min(reference.len());
    if count == 0 {
        return None;
    }
    let pairs = || {
        technique
            .iter()
            .zip(reference)
            .map(|(&t, &r)| (f64::from(t), f64::from(r)))
    };
    let mean = |sum: f64| sum / count as f64;
    let mean_reference = mean(pairs().map(|(_, r)| r.abs()).sum());
    let epsilon = 0.01 * mean_reference;
    let mean_difference = mean(pairs().map(|(t, r)| t - r).sum());
    let mean_square = mean(pairs().map(|(t, r)| (t - r).powi(2)).sum());
    let rel_mse = mean(
        pairs()
            .map(|(t, r)| ratio((t - r).powi(2), r * r + epsilon * epsilon))
            .sum(),
    );
    let mut relative: Vec<f64> = pairs()
        .map(|(t, r)| ratio((t - r).abs(), r.abs() + epsilon))
        .collect();
    relative.sort_by(f64::total_cmp);
    let rank = ((0.95 * count as f64).ceil() as usize).clamp(1, count);
    Some(Errors {
        rel_rmse: ratio(mean_square.sqrt(), mean_reference),
        bias: ratio(mean_difference, mean_reference),
        rel_mse,
        p95: relative[rank - 1],
        mean_reference,
        count,
    })
}

/// a / b, where nothing over nothing is nothing.
pub(super) fn ratio(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}
