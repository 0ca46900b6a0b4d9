//! Random numbers: Owen-scrambled Sobol points, padded over pairs of dimensions.
//!
//! Each pixel and batch is an independently scrambled (0, 2)-net of `batch` points in every pair of
//! dimensions, so that a batch is stratified and the spread of batch means estimates the error
//! without bias (B. Burley, *Practical Hash-based Owen Scrambling*, JCGT 9(4), 2020; hash constants
//! of N. Vegdahl, 2021).

/// The random numbers of one sample of one pixel.
pub(super) struct Sampler {
    /// Identifies the pixel, the batch and the user's seed.
    stream: u32,
    /// Sample within the batch.
    index: u32,
    /// Samples in a batch − 1; the batch is a power of two.
    mask: u32,
    dimension: u32,
}

/// Pairs of dimensions set aside for each vertex of a path.
const PAIRS_PER_VERTEX: u32 = 16;

impl Sampler {
    /// The numbers of sample `index` of a batch of `batch_spp` (a power of two).
    pub(super) fn new(stream: u32, index: u32, batch_spp: u32) -> Self {
        Sampler {
            stream,
            index,
            mask: batch_spp - 1,
            dimension: 0,
        }
    }

    /// The stream of a pixel's batch.
    pub(super) fn stream(seed: u64, pixel: u32, batch: u32) -> u32 {
        let seed = mix((seed >> 32) as u32 ^ mix(seed as u32));
        mix(mix(seed ^ pixel).wrapping_add(batch.wrapping_mul(0x9e37_79b9)))
    }

    /// Moves to the dimensions of a path vertex, so that what one vertex consumes does not shift
    /// the numbers of the next.
    pub(super) fn start_vertex(&mut self, vertex: u32) {
        self.dimension = vertex * PAIRS_PER_VERTEX;
    }

    /// A point of the unit square, each coordinate in [0, 1).
    pub(super) fn next_2d(&mut self) -> [f32; 2] {
        let pair = mix(self.stream ^ self.dimension.wrapping_mul(0x85eb_ca6b));
        self.dimension += 1;
        let index = scramble(self.index, pair) & self.mask;
        let x = reverse_scramble(index, mix(pair ^ 0x68bc_21eb));
        let y = scramble(sobol_second(index), mix(pair ^ 0x02e5_be93));
        [unit(x), unit(y)]
    }

    /// A number in [0, 1).
    pub(super) fn next_1d(&mut self) -> f32 {
        let pair = mix(self.stream ^ self.dimension.wrapping_mul(0x85eb_ca6b));
        self.dimension += 1;
        unit(reverse_scramble(
            scramble(self.index, pair) & self.mask,
            mix(pair ^ 0x68bc_21eb),
        ))
    }
}

/// 24 random bits as a number in [0, 1).
fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A hash of 32 bits (C. Wellons, *lowbias32*, 2018).
fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// The second coordinate of the Sobol sequence, as a 32-bit fraction.
fn sobol_second(mut index: u32) -> u32 {
    let (mut result, mut direction) = (0, 1u32 << 31);
    while index != 0 {
        if index & 1 != 0 {
            result ^= direction;
        }
        index >>= 1;
        direction ^= direction >> 1;
    }
    result
}

/// Owen scrambling of a 32-bit fraction: each bit is flipped depending on the more significant
/// ones.
fn scramble(x: u32, seed: u32) -> u32 {
    reverse_scramble(x.reverse_bits(), seed)
}

/// [`scramble`] of a number whose bits are reversed.
fn reverse_scramble(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_batch_is_stratified_in_every_pair_of_dimensions() {
        for stream in 0..20 {
            for pair in [0, 3, 17] {
                let mut cells = [false; 64];
                for index in 0..64 {
                    let mut sampler = Sampler::new(stream, index, 64);
                    for _ in 0..pair {
                        sampler.next_2d();
                    }
                    let [x, y] = sampler.next_2d();
                    cells[(x * 8.0) as usize + 8 * (y * 8.0) as usize] = true;
                }
                assert!(cells.iter().all(|&hit| hit), "stream {stream}, pair {pair}");
            }
        }
    }

    #[test]
    fn streams_differ() {
        let first = Sampler::new(Sampler::stream(1, 2, 3), 0, 16).next_2d();
        for other in [
            Sampler::stream(1, 2, 4),
            Sampler::stream(1, 3, 3),
            Sampler::stream(2, 2, 3),
            Sampler::stream(1 << 32, 2, 3),
        ] {
            assert_ne!(first, Sampler::new(other, 0, 16).next_2d());
        }
    }
}
