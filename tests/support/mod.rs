//! What the tests share: a validated device that must be there, the passes of the tests, and random
//! numbers.
#![allow(
    dead_code,
    unused_imports,
    unreachable_pub,
    clippy::unwrap_used,
    clippy::expect_used
)]

pub mod compare;
pub mod covering;
pub mod device;
#[cfg(feature = "program")]
pub mod display;
pub mod gather;
pub mod given;
#[cfg(feature = "flip")]
pub mod golden;
pub mod hazards;
pub mod loading;
pub mod missing;
pub mod motion;
pub mod octree;
pub mod passes;
#[cfg(feature = "program")]
pub mod program;
pub mod scenes;
pub mod sha256;
pub mod shown;
pub mod skip;
pub mod structures;
pub mod surfaces;
pub mod technique;
pub mod tolerance;
pub mod voxels;
pub mod walker;

use lumivox::graph::{BufferDesc, BufferUsage, Gpu, Owner};

pub use device::{ValidatedGpu, gpu, own_gpu};
pub use missing::expected_missing;
pub use skip::{Missing, skipped};

/// The folder of references that tests keep: never the user's own, in which other builds may have
/// left theirs.
pub fn reference_cache() -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("references")
}

/// A storage buffer of words, with contents.
pub fn words(gpu: &Gpu, name: &str, words: &[u32]) -> std::sync::Arc<lumivox::graph::Buffer> {
    let desc = BufferDesc {
        name: name.into(),
        size_bytes: words.len() as u64 * 4,
        usage: BufferUsage::Storage,
        owner: Owner::Shared,
    };
    let buffer = gpu.create_buffer(&desc).unwrap();
    gpu.upload_buffer(&buffer, bytemuck::cast_slice(words))
        .unwrap();
    buffer
}

/// The words of a buffer.
pub fn read_words(gpu: &Gpu, buffer: &std::sync::Arc<lumivox::graph::Buffer>) -> Vec<u32> {
    gpu.read_buffer(buffer)
        .unwrap()
        .as_chunks()
        .0
        .iter()
        .map(|word| u32::from_le_bytes(*word))
        .collect()
}

/// A small generator with a fixed seed (PCG-XSH-RR).
pub struct Random(u64);

impl Random {
    /// The same seed gives the same numbers.
    pub fn new(seed: u64) -> Self {
        let mut random = Random(seed.wrapping_add(1_442_695_040_888_963_407));
        random.next_u32();
        random
    }

    /// The next 32 bits.
    pub fn next_u32(&mut self) -> u32 {
        let old = self.0;
        self.0 = old
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((((old >> 18) ^ old) >> 27) as u32).rotate_right((old >> 59) as u32)
    }

    /// Uniform in 0..bound.
    pub fn below(&mut self, bound: u32) -> u32 {
        ((u64::from(self.next_u32()) * u64::from(bound)) >> 32) as u32
    }

    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f32 {
        (self.next_u32() >> 8) as f32 / (1 << 24) as f32
    }
}
