//! CPU twin of `cone.see`: what a line of sight sees in the finest texels of a volume.

use glam::{DVec3, DVec4};

use super::{Levels, exit_distance};

/// Steps, in the finest texels there.
const STEP: f64 = 0.25;

/// Opacity at which a line hits; texels are mixed, so that what they hold begins too early.
const HIT: f64 = 0.75;

/// Opacity from which on a thin surface that it crosses covers something.
const GRAZED: f64 = 0.4;

/// Share of the most opacity that it met at which a line is past a surface.
const PAST: f64 = 0.5;

/// Less than this is as good as nothing.
const LEAST_THROUGH: f64 = 0.01;

/// Light of what a line meets before its end, and the share of it that meets nothing. Lengths are
/// voxels of the finest level; it may start outside of the grid.
pub fn see<'l>(levels: impl Into<Levels<'l>>, origin: DVec3, direction: DVec3, end: f64) -> DVec4 {
    let levels = levels.into();
    let resolution = levels.resolution();
    let entry = |axis: usize| match direction[axis] {
        d if d > 0.0 => -origin[axis] / d,
        d if d < 0.0 => (resolution - origin[axis]) / d,
        _ if (0.0..=resolution).contains(&origin[axis]) => f64::NEG_INFINITY,
        _ => f64::INFINITY,
    };
    let mut t = entry(0).max(entry(1)).max(entry(2)).max(0.0);
    let end = end.min(exit_distance(origin, direction, resolution));
    let (mut seen, mut met, mut most) = (DVec4::W, DVec4::ZERO, 0.0f64);
    while t < end && seen.w > LEAST_THROUGH {
        let position = origin + t * direction;
        let width = levels.least_diameter(position);
        let texel = levels.sample(position, width.log2(), (direction, 0.0));
        met += texel;
        most = most.max(texel.w);
        t += STEP * width;
        if most > HIT || texel.w < PAST * most || t >= end {
            let opacity = ((most - GRAZED) / (HIT - GRAZED)).clamp(0.0, 1.0);
            let light = met.truncate() / met.w.max(GRAZED);
            seen += (seen.w * opacity * light).extend(-seen.w * opacity);
            (met, most) = (DVec4::ZERO, 0.0);
        }
    }
    seen
}
