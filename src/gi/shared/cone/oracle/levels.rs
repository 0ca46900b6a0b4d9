//! What the oracle's cones march through: mip chains, with mean normals or six faces, and clipmaps,
//! and their samples.

use glam::{DVec3, DVec4, UVec3};

use super::clipmap::Clipmap;
use crate::gi::shared::cone::FaceWeights;
use crate::gi::shared::voxel::NormalLobe;

/// One level of a dense volume: rgb is radiance [W/(m² sr)] times opacity, a is opacity.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    /// Texels along an edge.
    pub resolution: u32,
    /// All texels, x fastest, then y.
    pub texels: Vec<DVec4>,
}

impl Volume {
    /// The volume whose texels a function gives.
    pub fn new(resolution: u32, texel: impl Fn([u32; 3]) -> DVec4) -> Volume {
        let n = resolution as usize;
        let texels = (0..n * n * n)
            .map(|index| texel([index % n, index / n % n, index / (n * n)].map(|at| at as u32)))
            .collect();
        Volume { resolution, texels }
    }

    /// One texel; the nearest one for coordinates past the last.
    pub fn texel(&self, texel: [u32; 3]) -> DVec4 {
        let [x, y, z] = UVec3::from(texel)
            .min(UVec3::splat(self.resolution - 1))
            .to_array()
            .map(|at| at as usize);
        let n = self.resolution as usize;
        self.texels[x + n * (y + n * z)]
    }

    /// Trilinear sample, clamped to the edge; `uvw` is 0 to 1 over the volume.
    pub fn sample(&self, uvw: DVec3) -> DVec4 {
        self.sample_on(uvw, Lattice::Centres)
    }

    /// The same for texels that lie on another lattice.
    pub fn sample_on(&self, uvw: DVec3, lattice: Lattice) -> DVec4 {
        let at = match lattice {
            Lattice::Centres => uvw * f64::from(self.resolution) - 0.5,
            Lattice::Corners => uvw * f64::from(self.resolution - 1),
        };
        let (low, weight) = (at.floor(), at - at.floor());
        let mut sum = DVec4::ZERO;
        for corner in
            (0..8u32).map(|index| UVec3::new(index & 1, index >> 1 & 1, index >> 2).as_dvec3())
        {
            let share = corner * weight + (1.0 - corner) * (1.0 - weight);
            let texel =
                (low + corner).clamp(DVec3::ZERO, DVec3::splat(f64::from(self.resolution - 1)));
            sum += share.x * share.y * share.z * self.texel(texel.as_uvec3().to_array());
        }
        sum
    }
}

/// Where the texels of a level of n cells along an edge are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lattice {
    /// n of them, in the middles of the cells.
    #[default]
    Centres,
    /// n + 1 of them, on the corners of the cells.
    Corners,
}

/// Sample of a mip chain, finest level first: trilinear in each of two levels, linear between them.
pub fn sample_chain(chain: &[Volume], uvw: DVec3, level: f64) -> DVec4 {
    sample_chain_on(chain, Lattice::Centres, uvw, level)
}

fn sample_chain_on(chain: &[Volume], lattice: Lattice, uvw: DVec3, level: f64) -> DVec4 {
    let level = level.clamp(0.0, chain.len() as f64 - 1.0);
    let finer = level.floor() as usize;
    let coarser = (finer + 1).min(chain.len() - 1);
    chain[finer].sample_on(uvw, lattice).lerp(
        chain[coarser].sample_on(uvw, lattice),
        level - level.floor(),
    )
}

/// What cones march through, finest level first. What is not there is left at its default.
#[derive(Clone, Copy, Default)]
pub struct Levels<'l> {
    /// Radiance premultiplied by opacity, and opacity; with normals that of both sides together.
    pub light: &'l [Volume],
    /// Mean normal of what shines, times its luminance, premultiplied by opacity, and opacity.
    /// None where texels shine alike to all sides.
    pub normals: &'l [Volume],
    /// Where the texels of both are.
    pub lattice: Lattice,
    /// In place of both, texels of six faces.
    pub faces: Option<&'l FaceChain>,
    /// In place of all, nested levels.
    pub clipmap: Option<&'l Clipmap>,
    /// The same levels with normals, as `normals` has them.
    pub clipmap_normals: Option<&'l Clipmap>,
    /// How light leaves by normals, where there are any.
    pub lobe: NormalLobe,
}

impl<'l> From<&'l [Volume]> for Levels<'l> {
    fn from(light: &'l [Volume]) -> Self {
        Levels {
            light,
            ..Levels::default()
        }
    }
}

impl<'l> From<&'l Vec<Volume>> for Levels<'l> {
    fn from(light: &'l Vec<Volume>) -> Self {
        Levels {
            light,
            ..Levels::default()
        }
    }
}

impl<'l> From<&'l FaceChain> for Levels<'l> {
    fn from(faces: &'l FaceChain) -> Self {
        Levels {
            faces: Some(faces),
            ..Levels::default()
        }
    }
}

impl<'l> From<&'l Clipmap> for Levels<'l> {
    fn from(clipmap: &'l Clipmap) -> Self {
        Levels {
            clipmap: Some(clipmap),
            ..Levels::default()
        }
    }
}

impl Levels<'_> {
    /// Voxels of the finest level along an edge of the grid.
    pub(super) fn resolution(&self) -> f64 {
        if let Some(clipmap) = self.clipmap {
            return clipmap.resolution();
        }
        let on_corners = u32::from(self.lattice == Lattice::Corners);
        f64::from(self.faces.map_or_else(
            || self.light[0].resolution - on_corners,
            FaceChain::resolution,
        ))
    }

    /// σ_v² of a cone of this half angle's tangent; 0 where lobes are not convolved with it.
    pub(super) fn view_variance(&self, tan_half: f64) -> f64 {
        let deviation = (2.0 * tan_half.atan()).cos().max(0.0);
        match self.lobe {
            NormalLobe::Convolved => deviation.powi(2),
            NormalLobe::Toksvig | NormalLobe::Harmonics => 0.0,
        }
    }

    /// Smallest diameter of a sample of a step that begins at a position (both \[voxels\]).
    pub(super) fn least_diameter(&self, position: DVec3) -> f64 {
        self.clipmap
            .map_or(1.0, |clipmap| clipmap.least_diameter(position))
    }

    /// Edge of the largest texel that such a sample reads, or is about to read \[voxels\].
    pub(super) fn largest_texel(&self, position: DVec3) -> f64 {
        self.clipmap
            .map_or(1.0, |clipmap| clipmap.largest_texel(position))
    }

    /// Light and opacity at a position \[voxels\] as seen along `direction`; σ_v² is that of the
    /// cone that looks ([`Levels::view_variance`]).
    pub(super) fn sample(
        &self,
        position: DVec3,
        level: f64,
        (direction, view_variance): (DVec3, f64),
    ) -> DVec4 {
        if let Some(clipmap) = self.clipmap {
            let texel = clipmap.sample(position, level, direction);
            return self.clipmap_normals.map_or(texel, |normals| {
                let normal = normals.sample(position, level, direction);
                seen_by_normals(texel, normal, self.lobe, (direction, view_variance))
            });
        }
        let uvw = position / self.resolution();
        if let Some(faces) = self.faces {
            return faces.seen(uvw, direction, level);
        }
        let texel = sample_chain_on(self.light, self.lattice, uvw, level);
        if self.normals.is_empty() {
            return texel;
        }
        let normal = sample_chain_on(self.normals, self.lattice, uvw, level);
        seen_by_normals(texel, normal, self.lobe, (direction, view_variance))
    }
}

/// A texel of both sides together as seen along `direction`; `normal`: the mean normal of what
/// shines, times its luminance. Both premultiplied by opacity.
fn seen_by_normals(
    texel: DVec4,
    normal: DVec4,
    lobe: NormalLobe,
    (direction, view_variance): (DVec3, f64),
) -> DVec4 {
    let luminance = luminance(texel.truncate());
    if luminance <= 0.0 {
        return texel;
    }
    let m = normal.truncate() / luminance;
    let share = match lobe {
        NormalLobe::Toksvig | NormalLobe::Convolved => facing_share(m, view_variance, direction),
        NormalLobe::Harmonics => harmonic_share(m, direction),
    };
    (share * texel.truncate()).extend(texel.w)
}

/// As [`facing_share`], by two bands: a one-sided surface of normal n sends ½ + ¾ n·v of its light
/// towards v.
pub fn harmonic_share(m: DVec3, direction: DVec3) -> f64 {
    (0.5 - 0.75 * m.dot(direction)).max(0.0)
}

/// Rec. 709 luminance of linear red, green and blue.
pub fn luminance(color: DVec3) -> f64 {
    color.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// Share of a texel's light that leaves towards a viewer who looks along `direction`, `m` being the
/// mean normal of what shines, no longer than 1: n·ω is normally distributed around m·ω / |m| with
/// Toksvig's variance (1 − |m|) / |m| and `view_variance`; the distribution function is a logistic
/// one, 0.0095 off at most.
pub fn facing_share(m: DVec3, view_variance: f64, direction: DVec3) -> f64 {
    let concentration = m.length().clamp(1e-4, 0.999);
    let variance = (1.0 - concentration) / concentration + view_variance;
    1.0 / (1.0 + (1.702 * m.dot(direction) / (concentration * variance.sqrt())).exp())
}

/// A volume whose texels look different along each axis from either side.
pub struct FaceChain {
    /// The finest level, where that has no faces.
    pub finest: Option<Volume>,
    /// All other levels, finer ones first: the faces +x, −x, +y, −y, +z and −z.
    pub levels: Vec<[Volume; 6]>,
    /// How three faces make one texel.
    pub weights: FaceWeights,
}

impl FaceChain {
    fn level(&self, uvw: DVec3, direction: DVec3, level: usize) -> DVec4 {
        match (&self.finest, level) {
            (Some(finest), 0) => finest.sample(uvw),
            _ => {
                let faces = &self.levels[level - usize::from(self.finest.is_some())];
                sample_faces(faces, uvw, direction, self.weights)
            }
        }
    }

    fn resolution(&self) -> u32 {
        self.finest
            .as_ref()
            .map_or_else(|| self.levels[0][0].resolution, |finest| finest.resolution)
    }

    /// What is seen in a unit direction at a place (0 to 1 over the volume), at a level.
    fn seen(&self, uvw: DVec3, direction: DVec3, level: f64) -> DVec4 {
        let coarsest = self.levels.len() + usize::from(self.finest.is_some()) - 1;
        let level = level.clamp(0.0, coarsest as f64);
        let finer = level.floor() as usize;
        let [a, b] =
            [finer, (finer + 1).min(coarsest)].map(|level| self.level(uvw, direction, level));
        a.lerp(b, level - level.floor())
    }
}

/// The three of six faces that a ray in a unit direction meets, as one texel.
pub(super) fn sample_faces(
    faces: &[Volume; 6],
    uvw: DVec3,
    direction: DVec3,
    weights: FaceWeights,
) -> DVec4 {
    // A ray along +x meets the face −x.
    let met =
        [0, 1, 2].map(|axis| faces[2 * axis + usize::from(direction[axis] > 0.0)].sample(uvw));
    combine_faces(met, direction, weights)
}

/// 1 − α of opaque matter, whose optical depth would be infinite.
const OPAQUE: f64 = 1.0 / 65536.0;

/// The faces of each axis that a ray in a unit direction ω meets as one texel. By extinction, with
/// τ_k = −ln(1 − α_k): α = 1 − exp(−Σ |ω_k| τ_k), and the radiance is the mean weighted with |ω_k|
/// τ_k; else the mean of all weighted with ω_k².
pub fn combine_faces(met: [DVec4; 3], direction: DVec3, weights: FaceWeights) -> DVec4 {
    let axes = met.into_iter().zip(direction.to_array());
    if weights == FaceWeights::Squared {
        return axes.map(|(face, along)| along * along * face).sum();
    }
    let (mut depth, mut radiance) = (0.0, DVec3::ZERO);
    for (face, along) in axes.filter(|(face, _)| face.w > 0.0) {
        let own = -along.abs() * (1.0 - face.w).max(OPAQUE).ln();
        depth += own;
        radiance += own * face.truncate() / face.w;
    }
    if depth > 0.0 {
        -(-depth).exp_m1() * (radiance / depth).extend(1.0)
    } else {
        DVec4::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On each axis, a ray sees the face that looks back at it. Along x alone it sees that face
    /// unchanged, whatever the weights.
    #[test]
    fn a_ray_along_an_axis_sees_one_face() {
        let faces = [0, 1, 2, 3, 4, 5]
            .map(|face| Volume::new(4, |_| DVec4::new(f64::from(face + 1), 0.0, 0.0, 0.5)));
        for weights in [FaceWeights::Extinction, FaceWeights::Squared] {
            let level = |resolution| {
                faces
                    .clone()
                    .map(|face| Volume::new(resolution, |_| face.texels[0]))
            };
            let chain = FaceChain {
                finest: None,
                levels: [4, 2, 1].map(level).into(),
                weights,
            };
            for (direction, red) in [
                (DVec3::X, 2.0),
                (DVec3::NEG_X, 1.0),
                (DVec3::Y, 4.0),
                (DVec3::NEG_Y, 3.0),
                (DVec3::Z, 6.0),
                (DVec3::NEG_Z, 5.0),
            ] {
                let seen = chain.seen(DVec3::splat(0.4), direction, 1.3);
                assert!(
                    (seen - DVec4::new(red, 0.0, 0.0, 0.5)).abs().max_element() < 1e-12,
                    "{weights:?} {direction}: {seen}"
                );
            }
        }
    }

    /// A texel on a corner of cells is where eight of them meet, and the last one is on the end.
    #[test]
    fn corners_are_between_cells() {
        let volume = Volume::new(5, |[x, y, z]| {
            DVec4::new(f64::from(x), f64::from(y), f64::from(z), 1.0)
        });
        let levels = Levels {
            light: &[volume],
            lattice: Lattice::Corners,
            ..Levels::default()
        };
        assert_eq!(levels.resolution(), 4.0);
        for position in [DVec3::ZERO, DVec3::new(1.0, 2.5, 3.25), DVec3::splat(4.0)] {
            assert!(
                (levels.sample(position, 0.0, (DVec3::X, 0.0)).truncate() - position)
                    .abs()
                    .max_element()
                    < 1e-12,
                "{position}"
            );
        }
    }

    /// Half a layer of z = const, seen at 60°: extinction makes it 1 − ½^½, the squares an eighth;
    /// and three equal faces are that one where the squares sum to 1.
    #[test]
    fn weights_of_faces() {
        let direction = DVec3::new(0.75f64.sqrt(), 0.0, 0.5);
        let met = [DVec4::ZERO, DVec4::ZERO, DVec4::new(0.5, 0.0, 0.0, 0.5)];
        let [extinction, squared] = [FaceWeights::Extinction, FaceWeights::Squared]
            .map(|weights| combine_faces(met, direction, weights));
        assert!(
            (extinction.w - (1.0 - 0.5f64.sqrt())).abs() < 1e-12
                && (extinction.x - extinction.w).abs() < 1e-12
        );
        assert!(
            (squared - DVec4::new(0.125, 0.0, 0.0, 0.125))
                .abs()
                .max_element()
                < 1e-12
        );
        let opaque = [DVec4::new(2.0, 1.0, 0.5, 1.0); 3];
        assert!(
            (combine_faces(opaque, direction, FaceWeights::Squared) - opaque[0])
                .abs()
                .max_element()
                < 1e-12
        );
        assert!(
            (combine_faces(opaque, direction, FaceWeights::Extinction) - opaque[0])
                .abs()
                .max_element()
                < 1e-4
        );
        assert_eq!(
            combine_faces([DVec4::ZERO; 3], direction, FaceWeights::Extinction),
            DVec4::ZERO
        );
    }
}
