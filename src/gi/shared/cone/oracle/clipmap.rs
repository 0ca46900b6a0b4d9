//! The levels of a clipmap, and which of them a sample reads: equations (4) and (5) of
//! `docs/gi/clipmap.md`.

use glam::{DVec3, DVec4};

use super::levels::{Volume, sample_faces};
use crate::gi::shared::cone::FaceWeights;

/// One of nested levels. Level l has texels of 2^l voxels.
pub struct ClipmapLevel {
    /// Its smallest corner, from the outermost level's smallest corner \[voxels of level 0\].
    pub corner: DVec3,
    /// The point from which it fades to all sides, likewise.
    pub middle: DVec3,
    /// Its texels: one volume, or those of the faces +x, −x, +y, −y, +z and −z.
    pub texels: Vec<Volume>,
}

/// Nested levels, each twice as large as the one before, around the camera.
pub struct Clipmap {
    /// The levels, finest first, of n³ texels each.
    pub levels: Vec<ClipmapLevel>,
    /// Mips of the outermost level, finer ones first, in as many volumes as it has.
    pub top: Vec<Vec<Volume>>,
    /// How three faces make one texel.
    pub weights: FaceWeights,
}

impl Clipmap {
    /// n, the texels of a level along an edge.
    fn edge(&self) -> f64 {
        f64::from(self.levels[0].texels[0].resolution)
    }

    fn outermost(&self) -> usize {
        self.levels.len() - 1
    }

    /// Voxels of level 0 along an edge of the outermost level.
    pub(super) fn resolution(&self) -> f64 {
        self.edge() * 2f64.powi(self.outermost() as i32)
    }

    /// s_l of equation (4): how much of a level is shown.
    fn share(&self, level: usize, position: DVec3) -> f64 {
        let away = (position - self.levels[level].middle).abs() / 2f64.powi(level as i32);
        let farthest = away.x.max(away.y).max(away.z);
        ((self.edge() / 2.0 - 3.0 - farthest) * 16.0 / self.edge()).clamp(0.0, 1.0)
    }

    /// The finest level that is shown at a position, and how much of it is. The outermost is shown
    /// everywhere.
    fn shown(&self, position: DVec3) -> (usize, f64) {
        let found = (0..self.outermost())
            .map(|level| (level, self.share(level, position)))
            .find(|(_, share)| *share > 0.0);
        found.unwrap_or((self.outermost(), 1.0))
    }

    /// λ_p of equation (4).
    fn level_at(&self, position: DVec3) -> f64 {
        let (level, share) = self.shown(position);
        level as f64 + (1.0 - 4.0 * share / 3.0).max(0.0)
    }

    /// Smallest diameter of a sample \[voxels of level 0\].
    pub(super) fn least_diameter(&self, position: DVec3) -> f64 {
        self.level_at(position).exp2()
    }

    /// Edge of a texel, by which cones from here keep off their surface. It grows to the next
    /// level's texel over the first quarter of the border.
    pub(super) fn largest_texel(&self, position: DVec3) -> f64 {
        let (level, share) = self.shown(position);
        (level as f64 + (4.0 * (1.0 - share)).min(1.0)).exp2()
    }

    /// C_l(p) of equation (5), where l goes on to the mips above the outermost level.
    fn texel(&self, position: DVec3, level: usize, direction: DVec3) -> DVec4 {
        let stored = &self.levels[level.min(self.outermost())];
        let extent = self.edge() * 2f64.powi(level.min(self.outermost()) as i32);
        let texels = if level > self.outermost() {
            &self.top[level - self.levels.len()]
        } else {
            &stored.texels
        };
        let uvw = (position - stored.corner) / extent;
        <&[Volume; 6]>::try_from(texels.as_slice()).map_or_else(
            |_| texels[0].sample(uvw),
            |faces| sample_faces(faces, uvw, direction, self.weights),
        )
    }

    /// c(p) of equation (5) for a sample whose diameter asks for `level`.
    pub(super) fn sample(&self, position: DVec3, level: f64, direction: DVec3) -> DVec4 {
        let coarsest = self.outermost() + self.top.len();
        let level = level
            .clamp(0.0, coarsest as f64)
            .max(self.level_at(position));
        let finer = level as usize;
        let [a, b] =
            [finer, (finer + 1).min(coarsest)].map(|level| self.texel(position, level, direction));
        a.lerp(b, level.fract())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two levels of 16³ around the point 12, of red 1 and 2, and a mip of 4.
    fn clipmap() -> Clipmap {
        let of = |edge, red| vec![Volume::new(edge, |_| DVec4::new(red, 0.0, 0.0, 1.0))];
        let level = |corner, red| ClipmapLevel {
            corner: DVec3::splat(corner),
            middle: DVec3::splat(12.0),
            texels: of(16, red),
        };
        Clipmap {
            levels: vec![level(4.0, 1.0), level(0.0, 2.0)],
            top: vec![of(8, 4.0)],
            weights: FaceWeights::Extinction,
        }
    }

    /// Level 0 is whole up to 8 − 3 − 1 voxels from its middle, and gone one voxel on.
    #[test]
    fn a_level_fades_into_the_next() {
        let clipmap = clipmap();
        assert_eq!(clipmap.resolution(), 32.0);
        for (away, share, red, least, largest) in [
            (0.0, 1.0, 1.0, 0.0, 0.0),
            (4.0, 1.0, 1.0, 0.0, 0.0),
            (4.25, 0.75, 1.0, 0.0, 1.0),
            (4.625, 0.375, 1.5, 0.5, 1.0),
            (5.0, 0.0, 2.0, 1.0, 1.0),
        ] {
            let at = DVec3::new(12.0, 12.0 - away, 12.0 + 0.5 * away);
            assert_eq!(clipmap.share(0, at), share, "{away}");
            assert!(
                (clipmap.sample(at, 0.0, DVec3::X).x - red).abs() < 1e-12,
                "{away}"
            );
            assert!(
                (clipmap.least_diameter(at).log2() - least).abs() < 1e-12
                    && (clipmap.largest_texel(at).log2() - largest).abs() < 1e-12,
                "{away}"
            );
        }
    }

    /// A wide sample reads the level that it asks for, up to the mips above the outermost.
    #[test]
    fn wide_samples_read_coarser_levels() {
        let clipmap = clipmap();
        for (level, red) in [(0.5, 1.5), (1.0, 2.0), (1.5, 3.0), (2.0, 4.0), (7.0, 4.0)] {
            assert!(
                (clipmap.sample(DVec3::splat(12.0), level, DVec3::X).x - red).abs() < 1e-12,
                "level {level}"
            );
        }
        assert!(
            (clipmap.sample(DVec3::splat(30.0), 0.0, DVec3::X).x - 2.0).abs() < 1e-12,
            "the outermost level is shown to its end"
        );
    }

    /// Texels lie where the level does: the texel of a voxel is in its middle.
    #[test]
    fn texels_lie_in_their_level() {
        let place = |corner: f64, size: f64| {
            Volume::new(16, |at| {
                DVec3::from(at.map(|at| corner + size * (f64::from(at) + 0.5))).extend(1.0)
            })
        };
        let level = |corner, size| ClipmapLevel {
            corner: DVec3::splat(corner),
            middle: DVec3::splat(12.0),
            texels: vec![place(corner, size)],
        };
        let clipmap = Clipmap {
            levels: vec![level(4.0, 1.0), level(0.0, 2.0)],
            top: Vec::new(),
            weights: FaceWeights::Extinction,
        };
        for level in [0.0, 0.5, 1.0] {
            let at = DVec3::new(10.25, 12.0, 14.75);
            assert!(
                (clipmap.sample(at, level, DVec3::X).truncate() - at)
                    .abs()
                    .max_element()
                    < 1e-12,
                "level {level}"
            );
        }
    }
}
