//! Compiled pipelines on disk, so that a second start need not compile them again.
//!
//! A driver finds what it knows by the shaders and states of a pipeline, and refuses what another
//! version of it has written. A file is for one device and driver (`pipelineCacheUUID`), and is
//! read only if it is whole: drivers trust what they are given.

use std::path::{Path, PathBuf};

use ash::vk;

use crate::output;

/// What a file begins with, followed by the hash of all behind that.
const MAGIC: &[u8; 24] = b"lumivox pipelines, no. 1";

/// Bytes of a cache in which nothing is: Vulkan's header (VkPipelineCacheHeaderVersionOne).
const HEADER_BYTES: usize = 32;

/// A larger file is started anew: it is full of pipelines of earlier versions.
const BYTES_MAX: usize = 256 << 20;

/// The pipelines that a driver has compiled.
pub(super) struct PipelineCache {
    /// Null where nothing is kept.
    raw: vk::PipelineCache,
    file: Option<PathBuf>,
    /// The hash of what was read.
    loaded: Option<u64>,
}

impl PipelineCache {
    /// Opens what is kept in a folder; without one, nothing is.
    pub(super) fn new(
        device: &ash::Device,
        properties: &vk::PhysicalDeviceProperties,
        folder: Option<&Path>,
    ) -> Self {
        let file = folder.map(|folder| {
            let hex = |byte: &u8| format!("{byte:02x}");
            let driver: String = properties.pipeline_cache_uuid.iter().map(hex).collect();
            folder.join(format!("pipelines-{:x}-{driver}.bin", properties.device_id))
        });
        let Some(path) = &file else {
            return PipelineCache {
                raw: vk::PipelineCache::null(),
                file,
                loaded: None,
            };
        };
        let bytes = std::fs::read(path).unwrap_or_default();
        let data = unpacked(&bytes).filter(|data| data.len() <= BYTES_MAX);
        let info = vk::PipelineCacheCreateInfo::default().initial_data(data.unwrap_or_default());
        // SAFETY: the data are what this driver wrote, to the bit; it refuses another driver's.
        let raw = unsafe { device.create_pipeline_cache(&info, None) };
        PipelineCache {
            raw: raw.unwrap_or_default(),
            loaded: data.map(hash),
            file,
        }
    }

    pub(super) fn raw(&self) -> vk::PipelineCache {
        self.raw
    }

    /// Writes what is new, and destroys the cache; it must not be in use.
    pub(super) fn close(&self, device: &ash::Device) {
        if let Err(problem) = self.save(device) {
            log::warn!("compiled pipelines cannot be kept: {problem}; they will be compiled again");
        }
        // SAFETY: nothing uses it, and destroying null does nothing.
        unsafe { device.destroy_pipeline_cache(self.raw, None) };
    }

    fn save(&self, device: &ash::Device) -> Result<(), std::io::Error> {
        let Some(path) = self
            .file
            .as_ref()
            .filter(|_| self.raw != vk::PipelineCache::null())
        else {
            return Ok(());
        };
        // SAFETY: the cache is alive.
        let data = unsafe { device.get_pipeline_cache_data(self.raw) }
            .map_err(|error| std::io::Error::other(error.to_string()))?;
        // A driver that keeps nothing here, or something elsewhere, answers with a header.
        if data.len() <= HEADER_BYTES || Some(hash(&data)) == self.loaded {
            return Ok(());
        }
        std::fs::create_dir_all(path.parent().unwrap_or(Path::new("")))?;
        output::write_file(path, |file| file.write_all(&packed(&data)))
    }
}

fn packed(data: &[u8]) -> Vec<u8> {
    [MAGIC, &hash(data).to_le_bytes()[..], data].concat()
}

/// The data of a file; `None` where it is not whole.
fn unpacked(bytes: &[u8]) -> Option<&[u8]> {
    let (stored, data) = bytes.strip_prefix(MAGIC)?.split_first_chunk::<8>()?;
    (u64::from_le_bytes(*stored) == hash(data)).then_some(data)
}

/// 64-bit FNV-1a (G. Fowler, L. C. Noll, K.-P. Vo, 1991).
fn hash(bytes: &[u8]) -> u64 {
    let fold = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, fold)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_files_are_read() {
        let data: Vec<u8> = (0..100).collect();
        let whole = packed(&data);
        assert_eq!(unpacked(&whole), Some(&data[..]));
        for at in 0..whole.len() {
            assert_eq!(unpacked(&whole[..at]), None, "cut at {at}");
            let mut changed = whole.clone();
            changed[at] ^= 1;
            assert_eq!(unpacked(&changed), None, "changed at {at}");
        }
    }
}
