//! Passes as zones of the profiler Tracy.

use tracy_client::{Client, GpuContext, GpuContextType};

use super::frame::Step;

/// What Tracy is told of a device.
pub(super) struct Zones {
    client: Client,
    device: String,
    ns_per_tick: f32,
    /// From the first frame on, whose ticks it is set by.
    context: Option<GpuContext>,
}

impl Zones {
    /// Of a device; Tracy may connect from now on.
    pub(super) fn new(device: &str, ns_per_tick: f32) -> Self {
        Zones {
            client: Client::start(),
            device: device.to_owned(),
            ns_per_tick,
            context: None,
        }
    }

    /// A frame is done: two ticks for each of its steps.
    pub(super) fn add(&mut self, steps: &[Step], ticks: &[Option<u64>]) {
        if self.context.is_none() {
            // Ticks and the host's clock meet where the first frame ends.
            let last = ticks.iter().rev().find_map(|ticks| *ticks);
            self.context = last.and_then(|last| self.open(last));
        }
        let Some(context) = &self.context else {
            return;
        };
        for (step, pair) in steps.iter().zip(ticks.chunks_exact(2)) {
            let ([Some(begin), Some(end)], true) = (pair, step.is_told) else {
                continue;
            };
            // Without room for more zones, frames go on without them.
            if let Ok(mut zone) = context.span_alloc(&step.name, "frame", "", 0) {
                zone.end_zone();
                zone.upload_timestamp_start(*begin as i64);
                zone.upload_timestamp_end(*end as i64);
            }
        }
        self.client.frame_mark();
    }

    fn open(&self, ticks: u64) -> Option<GpuContext> {
        let client = self.client.clone();
        let kind = GpuContextType::Vulkan;
        let made = client.new_gpu_context(Some(&self.device), kind, ticks as i64, self.ns_per_tick);
        made.inspect_err(|error| log::warn!("Tracy gets no zones: {error}"))
            .ok()
    }
}
