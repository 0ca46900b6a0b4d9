//! Devices under validation, one test at a time each.
//!
//! Opening a device and making its pipelines takes longer than most tests, so devices are handed on
//! from test to test. Each comes back as it was lent: silent, with nothing allocated and no object
//! alive. New memory is full of rubbish (0xCD), so that what is read before it is written shows.

use std::ops::Deref;
use std::sync::{Mutex, PoisonError};

use lumivox::graph::{Gpu, GpuOptions, Messages};

/// Devices that nobody uses now.
static IDLE: Mutex<Vec<Gpu>> = Mutex::new(Vec::new());

/// Devices that may wait for the next test; what comes back beyond these is closed, and its end
/// checked.
const IDLE_COUNT: usize = 4;

/// A [`Gpu`] with validation. On drop the test fails on any message, and on anything that is still
/// alive.
pub struct ValidatedGpu {
    gpu: Option<Gpu>,
    messages: Messages,
    is_shared: bool,
}

/// A device of the pool, or a new one; no device fails the test.
pub fn gpu() -> ValidatedGpu {
    let idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner).pop();
    ValidatedGpu::of(idle.unwrap_or_else(|| open(&GpuOptions::default())), true)
}

/// A new device, which is closed at the end: for tests of devices themselves, of other options, and
/// of replaced shaders.
pub fn own_gpu(options: &GpuOptions) -> ValidatedGpu {
    ValidatedGpu::of(open(options), false)
}

fn open(options: &GpuOptions) -> Gpu {
    Gpu::new(&GpuOptions {
        validate: true,
        poison: true,
        ..options.clone()
    })
    .expect("the tests need a Vulkan device and the validation layer")
}

impl ValidatedGpu {
    fn of(gpu: Gpu, is_shared: bool) -> ValidatedGpu {
        ValidatedGpu {
            messages: gpu.messages(),
            gpu: Some(gpu),
            is_shared,
        }
    }
}

impl Deref for ValidatedGpu {
    type Target = Gpu;

    fn deref(&self) -> &Gpu {
        self.gpu.as_ref().expect("alive until drop")
    }
}

impl Drop for ValidatedGpu {
    fn drop(&mut self) {
        let Some(gpu) = self.gpu.take() else { return };
        if std::thread::panicking() {
            // What the test left would be blamed on the next.
            return;
        }
        // Objects keep their device open: without this, one that is forgotten would keep its end
        // from being seen.
        let left = gpu.residue();
        assert!(
            left.is_empty(),
            "still there at the end of the test: {left:#?}"
        );
        let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
        if self.is_shared && idle.len() < IDLE_COUNT {
            let messages = self.messages.take();
            idle.push(gpu);
            drop(idle);
            check_silent(&messages);
        } else {
            drop(idle);
            drop(gpu);
            check_silent(&self.messages.list());
        }
    }
}

fn check_silent(messages: &[String]) {
    assert!(
        messages.is_empty(),
        "validation messages:\n{}",
        messages.join("\n")
    );
}
