//! CPU twin of `screen.relight`.

use glam::DVec3;

use super::Picture;

/// ρ = Σ L′ / Σ L, at most 4, and λ = Σ|L′ − ρL| / Σ max(L′, ρL) around a texel, by a Gaussian: of
/// surfaces, what they gathered (`before`) and gather now.
pub fn relight(texel: [u32; 2], picture: &Picture<'_, [DVec3; 2]>) -> (DVec3, f64) {
    let [x, y] = texel.map(i64::from);
    let around = || {
        let taps = (-2..=2).flat_map(|j| (-2..=2).map(move |i| (i, j)));
        taps.filter_map(|(i, j)| {
            let weight = (-0.5 * (i * i + j * j) as f64 / (1.5 * 1.5)).exp();
            picture.at(x + i, y + j).map(|pair| (weight, *pair))
        })
    };
    let sum = |of: fn([DVec3; 2]) -> DVec3| -> DVec3 {
        around().map(|(weight, pair)| weight * of(pair)).sum()
    };
    let (before, now) = (sum(|[before, _]| before), sum(|[_, now]| now));
    let factor = DVec3::select(
        before.cmpgt(DVec3::ZERO),
        (now / before).min(DVec3::splat(4.0)),
        DVec3::ONE,
    );
    let (mut apart, mut all) = (0.0, 0.0);
    for (weight, [before, now]) in around() {
        apart += weight * (now - factor * before).abs().element_sum();
        all += weight * now.max(factor * before).element_sum();
    }
    (factor, if all > 0.0 { apart / all } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: one texel of two has doubled; and where all have, they differ by a factor alone.
    #[test]
    fn a_change_by_hand() {
        let pixels = [
            Some([DVec3::ONE, DVec3::splat(2.0)]),
            Some([DVec3::ONE, DVec3::ONE]),
        ];
        let of = |pixels: &[Option<[DVec3; 2]>]| {
            let picture = Picture {
                size: [2, 1],
                pixels,
            };
            relight([0, 0], &picture)
        };
        let beside = (-0.5f64 / 2.25).exp();
        let (factor, change) = of(&pixels);
        let mean = (2.0 + beside) / (1.0 + beside);
        assert!((factor - mean).abs().max_element() < 1e-12, "{factor}");
        let apart = (2.0 - mean) + beside * (mean - 1.0);
        let expected = apart / (2.0 + beside * mean);
        assert!((change - expected).abs() < 1e-12, "{change}");
        let (factor, change) = of(&[pixels[0], pixels[0]]);
        assert_eq!((factor, change), (DVec3::splat(2.0), 0.0));
        assert_eq!(of(&[pixels[1], None]), (DVec3::ONE, 0.0));
        let lit = Some([DVec3::ZERO, DVec3::ONE]);
        assert_eq!(of(&[lit, lit]), (DVec3::ONE, 1.0));
    }
}
