//! The reference, refined in the background on the CPU: one sample a pixel more with every round,
//! over again when something changes.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use glam::Vec3;

use crate::image::{Image, luminance};
use crate::reference::{self, Bounces, Filter, Sampling};
use crate::scene::{Camera, Environment, Light, Scene};

/// What the reference is to be of.
#[derive(Clone)]
pub(super) struct TruthJob {
    /// Grows with every change.
    pub(super) id: u64,
    /// The scene that is traced.
    pub(super) scene: Arc<Scene>,
    /// The lights in place of the scene's.
    pub(super) lights: Arc<[Light]>,
    /// The environment in place of the scene's.
    pub(super) environment: Environment,
    /// The camera that the reference looks from.
    pub(super) camera: Camera,
    /// Width and height (px).
    pub(super) size: [u32; 2],
    /// The technique's number of bounces.
    pub(super) bounces: Bounces,
    /// Samples after which it rests.
    pub(super) most_samples: u32,
}

/// What there is of it so far.
#[derive(Clone)]
pub(super) struct RefinedReference {
    /// The job that it is of.
    pub(super) job: u64,
    /// Outgoing radiance (W/(m² sr)).
    pub(super) image: Arc<Image>,
    /// Samples of each pixel.
    pub(super) samples: u32,
    /// Root mean square of what the luminance of a pixel is off by chance (W/(m² sr)); `None` with
    /// one sample, from which it cannot be told.
    pub(super) noise: Option<f32>,
    /// Whether it gets no better.
    pub(super) is_done: bool,
}

/// Samples after which the reference rests, unless a script says otherwise.
pub(super) const MOST_SAMPLES: u32 = 4096;

#[derive(Default)]
struct Inbox {
    /// The outer `None` is nothing new, the inner one nothing wanted.
    job: Option<Option<TruthJob>>,
    quit: bool,
}

#[derive(Default)]
struct Shared {
    inbox: Mutex<Inbox>,
    wake: Condvar,
    found: Mutex<Option<Result<RefinedReference, String>>>,
}

impl Shared {
    fn inbox(&self) -> MutexGuard<'_, Inbox> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The thread, seen from the window.
pub(super) struct TruthWorker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl TruthWorker {
    /// Starts the thread; `notify` is called after each round, on that thread.
    pub(super) fn start(notify: Box<dyn Fn() + Send>) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let inner = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("reference".to_owned())
            .spawn(move || work(&inner, &*notify))?;
        Ok(TruthWorker {
            shared,
            thread: Some(thread),
        })
    }

    /// Asks for this instead of whatever was asked for before; `None` lets it rest.
    pub(super) fn ask(&self, job: Option<TruthJob>) {
        self.shared.inbox().job = Some(job);
        self.shared.wake.notify_one();
    }

    /// What is new since the last call.
    pub(super) fn take(&self) -> Option<Result<RefinedReference, String>> {
        self.shared
            .found
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take()
    }
}

impl Drop for TruthWorker {
    fn drop(&mut self) {
        self.shared.inbox().quit = true;
        self.shared.wake.notify_one();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            log::error!("the reference thread panicked");
        }
    }
}

/// The scene that is traced, and the sum of all rounds so far.
struct Sum {
    job: TruthJob,
    scene: Scene,
    /// Of two halves of the rounds, whose difference tells the noise.
    halves: [Half; 2],
    samples: u32,
}

struct Half {
    sum: Vec<Vec3>,
    samples: u32,
}

fn work(shared: &Shared, notify: &dyn Fn()) {
    // One core stays for the window and the device.
    let threads = std::thread::available_parallelism()
        .map_or(1, |count| count.get().saturating_sub(1).max(1));
    let pool = match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool,
        Err(error) => {
            *shared.found.lock().unwrap_or_else(PoisonError::into_inner) =
                Some(Err(error.to_string()));
            return notify();
        }
    };
    let mut sum: Option<Sum> = None;
    loop {
        {
            let mut inbox = shared.inbox();
            let rests = |sum: &Option<Sum>| {
                sum.as_ref()
                    .is_none_or(|sum| sum.samples >= sum.job.most_samples)
            };
            while !inbox.quit && inbox.job.is_none() && rests(&sum) {
                inbox = shared
                    .wake
                    .wait(inbox)
                    .unwrap_or_else(PoisonError::into_inner);
            }
            if inbox.quit {
                return;
            }
            if let Some(job) = inbox.job.take() {
                sum = job.map(|job| Sum::new(job, sum.take()));
            }
        }
        let Some(current) = &mut sum else { continue };
        let found = pool.install(|| current.refine());
        if found.is_err() {
            sum = None;
        }
        *shared.found.lock().unwrap_or_else(PoisonError::into_inner) = Some(found);
        notify();
    }
}

impl Sum {
    fn new(job: TruthJob, old: Option<Sum>) -> Self {
        let same = |old: &Sum| Arc::ptr_eq(&old.job.scene, &job.scene);
        let mut scene = old
            .filter(same)
            .map_or_else(|| (*job.scene).clone(), |old| old.scene);
        (scene.lights, scene.environment, scene.camera) =
            (job.lights.to_vec(), job.environment.clone(), job.camera);
        let pixels = (job.size[0] * job.size[1]) as usize;
        Sum {
            job,
            scene,
            halves: [0, 1].map(|_| Half {
                sum: vec![Vec3::ZERO; pixels],
                samples: 0,
            }),
            samples: 0,
        }
    }

    /// Adds a round, of as many samples as there are, at most 16 and as many as are left.
    fn refine(&mut self) -> Result<RefinedReference, String> {
        let spp = self
            .samples
            .clamp(1, 16)
            .min(self.job.most_samples.saturating_sub(self.samples).max(1));
        let [width, height] = self.job.size;
        let sampling = Sampling::Fixed { spp };
        let settings = reference::Settings {
            width,
            height,
            bounces: self.job.bounces,
            filter: Filter::Center,
            sampling,
            seed: u64::from(self.samples),
            ..reference::Settings::default()
        };
        let image = reference::render(&self.scene, &settings, &|_| {})
            .map_err(|error| error.to_string())?
            .radiance();
        let [first, second] = &mut self.halves;
        let half = if first.samples <= second.samples {
            first
        } else {
            second
        };
        half.sum
            .iter_mut()
            .zip(&image.pixels)
            .for_each(|(sum, pixel)| *sum += *pixel * spp as f32);
        half.samples += spp;
        self.samples += spp;
        let scale = 1.0 / self.samples as f32;
        let [first, second] = &self.halves;
        let image = Image::from_fn(width, height, |index| {
            (first.sum[index] + second.sum[index]) * scale
        });
        Ok(RefinedReference {
            job: self.job.id,
            image: Arc::new(image),
            samples: self.samples,
            noise: noise(first, second),
            is_done: self.samples >= self.job.most_samples,
        })
    }
}

/// Where a sample of a pixel has the variance σ², the means of two halves of a and b samples differ
/// by σ² (1/a + 1/b) in the mean square, and the mean of all is off by σ² / (a + b).
fn noise(first: &Half, second: &Half) -> Option<f32> {
    if first.samples == 0 || second.samples == 0 {
        return None;
    }
    let [a, b] = [first, second].map(|half| f64::from(half.samples));
    let differences = first
        .sum
        .iter()
        .zip(&second.sum)
        .map(|(x, y)| (f64::from(luminance(*x)) / a - f64::from(luminance(*y)) / b).powi(2));
    let square = differences.sum::<f64>() / first.sum.len().max(1) as f64;
    Some((square * a * b).sqrt() as f32 / (a + b) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums of samples of 0 or 2, each by a coin: a mean of n is off by 1/√n.
    fn half(pixels: usize, samples: u32, seed: u32) -> Half {
        let mut state = seed;
        let mut coin = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16 & 1) as f32
        };
        let sum = (0..pixels)
            .map(|_| Vec3::splat((0..samples).map(|_| 2.0 * coin()).sum()))
            .collect();
        Half { sum, samples }
    }

    #[test]
    fn noise_is_that_of_the_mean_of_all_samples() {
        for (a, b) in [(1, 1), (4, 12), (24, 8)] {
            let (first, second) = (half(40_000, a, 1), half(40_000, b, 2));
            let found = noise(&first, &second).unwrap_or_default();
            let expected = 1.0 / ((a + b) as f32).sqrt();
            assert!(
                (found / expected - 1.0).abs() < 0.03,
                "{found}, not {expected}"
            );
        }
        assert_eq!(noise(&half(4, 1, 1), &half(4, 0, 1)), None);
    }
}
