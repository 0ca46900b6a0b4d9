//! Timestamps.

use std::sync::Arc;

use ash::vk;

use super::{Context, Device, Error};

/// A pool of timestamps, reset by the host.
pub(crate) struct Timestamps {
    raw: vk::QueryPool,
    count: u32,
    device: Arc<Device>,
}

impl Timestamps {
    pub(crate) fn new(device: &Arc<Device>, count: u32) -> Result<Self, Error> {
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(count);
        // SAFETY: the device is alive.
        let raw = unsafe { device.raw().create_query_pool(&info, None) }
            .during("creating a timestamp pool")?;
        device.set_name(raw, "timestamps");
        Ok(Timestamps {
            raw,
            count,
            device: Arc::clone(device),
        })
    }

    /// How many timestamps fit.
    pub(crate) fn count(&self) -> u32 {
        self.count
    }

    pub(crate) fn raw(&self) -> vk::QueryPool {
        self.raw
    }

    /// Forgets all timestamps; none may be in flight.
    pub(crate) fn reset(&self) {
        // SAFETY: hostQueryReset is enabled, and every submission was waited for.
        unsafe { self.device.raw().reset_query_pool(self.raw, 0, self.count) };
    }

    /// The first `count` timestamps (ticks); `None` for those not written.
    pub(crate) fn read(&self, count: u32) -> Vec<Option<u64>> {
        let mut pairs = vec![[0u64; 2]; count.min(self.count) as usize];
        if pairs.is_empty() {
            return Vec::new();
        }
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        // SAFETY: the queries lie in the pool. An error (a lost device, or not ready) leaves
        // availability as the driver wrote it.
        let _ = unsafe {
            self.device
                .raw()
                .get_query_pool_results(self.raw, 0, &mut pairs, flags)
        };
        pairs
            .into_iter()
            .map(|[ticks, available]| (available != 0).then_some(ticks))
            .collect()
    }
}

impl Drop for Timestamps {
    fn drop(&mut self) {
        // SAFETY: every submission that used it was waited for.
        unsafe { self.device.raw().destroy_query_pool(self.raw, None) };
    }
}
