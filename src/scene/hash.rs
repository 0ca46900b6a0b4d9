//! Hashes of scenes, by which results are kept and found again.

use std::fmt::Write as _;

use super::Scene;

/// 128-bit FNV-1a (G. Fowler, L. C. Noll, K.-P. Vo, 1991): stable across builds and machines.
#[derive(Clone, Debug)]
pub struct Fnv(u128);

impl Default for Fnv {
    fn default() -> Self {
        Fnv(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }
}

impl Fnv {
    /// Hashes more bytes.
    pub fn bytes(&mut self, bytes: &[u8]) {
        let fold = |hash: u128, &byte: &u8| {
            (hash ^ u128::from(byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b)
        };
        self.0 = bytes.iter().fold(self.0, fold);
    }

    /// The hash of all bytes so far.
    pub fn value(&self) -> u128 {
        self.0
    }
}

impl std::fmt::Write for Fnv {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.bytes(text.as_bytes());
        Ok(())
    }
}

impl Scene {
    /// Hashes vertices, triangles and textures.
    pub(crate) fn hash_geometry(&self, hash: &mut Fnv) {
        hash.bytes(bytemuck::cast_slice(&self.vertices));
        hash.bytes(bytemuck::cast_slice(&self.triangles));
        for texture in &self.textures {
            hash.bytes(bytemuck::cast_slice(&texture.texels));
            // Writing to a hash cannot fail.
            let _ = write!(
                hash,
                "{:?} {} {}",
                texture.kind, texture.width, texture.height
            );
        }
    }

    /// Materials, lights, environment and camera as debug text, which spells floats exactly.
    pub(crate) fn small_content(&self) -> String {
        format!(
            "{:?} {:?} {:?} {:?}",
            self.materials, self.lights, self.environment, self.camera
        )
    }

    /// A hash of all that the scene is made of, but not of its name.
    pub fn content_hash(&self) -> u128 {
        let mut hash = Fnv::default();
        self.hash_geometry(&mut hash);
        let _ = write!(
            hash,
            "{} {:?} {} {}",
            self.small_content(),
            self.models,
            self.vertices.len(),
            self.triangles.len()
        );
        hash.value()
    }
}
