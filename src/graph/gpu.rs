//! The context that everything uses: one device, its resources, and frames run on it.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use super::frame::{Frame, Resource, Step, Work};
use super::journal::JournalFrame;
use super::plan::{State, plan};
use super::record::{Pipelines, Recorder};
use super::sets::{MATERIAL_TEXTURES, MaterialSet, SceneBindings, SceneSet, SharedSets};
use super::stats::{FrameStats, HostWork};
use super::{Access, plan::Barrier};
use crate::vulkan::{
    AccelerationStructure, Adapter, Buffer, BufferDesc, Commands, Device, DeviceChoice, DeviceInfo,
    DeviceKind, Error, Faults, Features, Image, ImageDesc, Instance, InstanceOptions, Limits,
    Messages, Owner, RAY_QUERY, StructureDesc, StructureKind, Timestamps, vk,
};

/// How to open a [`Gpu`].
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// The device to open: the best one, or one by index or name.
    pub device: DeviceChoice,
    /// With the Khronos validation layer and synchronization validation.
    pub validate: bool,
    /// Print every barrier to stderr, with the two passes and the hazard that it is for.
    pub trace_barriers: bool,
    /// Submit every pass by itself and take its time on the host: for drivers whose timestamps do
    /// not follow their execution (lavapipe runs compute at once but queues rasterization, so
    /// that its timestamps charge one pass with another's work).
    pub isolate_passes: bool,
    /// Whether the device traces rays itself, for which it needs [`Features::ray_query`], or
    /// shaders do; `None`: the device, where it can and is no CPU, which is slower at it.
    pub device_rays: Option<bool>,
    /// With the validation layer, which checks every access to a buffer too: slow, and clamps
    /// nothing.
    pub check_accesses: bool,
    /// The folder in which compiled pipelines and what the host has worked out are kept; `None`:
    /// nothing is.
    pub cache_dir: Option<PathBuf>,
    /// Told what the host works out that takes long, and which share of it is done, 0 to 1, from
    /// any thread.
    pub progress: Option<fn(&'static str, f32)>,
    /// New memory is full of rubbish, for tests.
    #[doc(hidden)]
    pub poison: bool,
    /// What goes wrong, for tests.
    #[doc(hidden)]
    pub faults: Faults,
}

impl GpuOptions {
    pub(crate) fn instance(&self) -> InstanceOptions {
        let GpuOptions {
            validate,
            check_accesses,
            poison,
            ..
        } = *self;
        InstanceOptions {
            validate,
            check_accesses,
            window_extensions: Vec::new(),
            poison,
            faults: self.faults.clone(),
        }
    }
}

/// One device and all that runs on it.
pub struct Gpu {
    runner: Mutex<Runner>,
    shared: Arc<SharedSets>,
    device: Arc<Device>,
    /// Owners of the device that live as long as this object, but for pipelines, which come and
    /// stay.
    own_count: usize,
    trace: bool,
    isolate: bool,
    device_rays: bool,
    cache_dir: Option<PathBuf>,
    progress: Option<fn(&'static str, f32)>,
}

/// What one frame at a time needs.
struct Runner {
    commands: Commands,
    timestamps: Timestamps,
    pipelines: Pipelines,
    state: State,
    journal: Option<Vec<JournalFrame>>,
    uploads: Uploads,
    host: HostWork,
}

/// What goes with the next submission.
#[derive(Default)]
pub(super) struct Uploads {
    /// The copies.
    pub(super) steps: Vec<Step>,
    /// Buffers among their targets.
    pub(super) ready: Vec<Arc<Buffer>>,
    /// Bytes that are copied.
    pub(super) bytes: u64,
}

impl Gpu {
    /// Opens a device.
    pub fn new(options: &GpuOptions) -> Result<Self, Error> {
        let instance = Instance::new(&options.instance())?;
        let device = Device::new(&instance, &options.device, options.cache_dir.as_deref())?;
        let device_rays = device_rays(device.adapter(), options.device_rays)?;
        let runner = Runner {
            commands: Commands::new(&device)?,
            timestamps: Timestamps::new(&device, 128)?,
            pipelines: Pipelines::default(),
            state: State::default(),
            journal: None,
            uploads: Uploads::default(),
            host: HostWork::default(),
        };
        let shared = SharedSets::new(&device)?;
        let own_count = Arc::strong_count(&device);
        Ok(Gpu {
            runner: Mutex::new(runner),
            shared,
            device,
            own_count,
            trace: options.trace_barriers,
            isolate: options.isolate_passes,
            device_rays,
            cache_dir: options.cache_dir.clone(),
            progress: options.progress,
        })
    }

    /// The folder in which what the host has worked out is kept, if any.
    pub fn cache_dir(&self) -> Option<&Path> {
        self.cache_dir.as_deref()
    }

    /// Tells whoever waits which share of some work of the host is done.
    pub fn tell(&self, what: &'static str, share: f32) {
        if let Some(tell) = self.progress {
            tell(what, share);
        }
    }

    /// Replaces the faults that it was opened with, except faults of features. Returns how many
    /// allocations were tried since the last call.
    #[doc(hidden)]
    pub fn plant(&self, faults: Faults) -> u64 {
        self.device.plant(faults)
    }

    /// Makes a buffer. Its contents are undefined.
    pub fn create_buffer(&self, desc: &BufferDesc) -> Result<Arc<Buffer>, Error> {
        Buffer::new(&self.device, desc)
    }

    /// Makes an image. Its contents are undefined.
    pub fn create_image(&self, desc: &ImageDesc) -> Result<Arc<Image>, Error> {
        Image::new(&self.device, desc)
    }

    pub(super) fn create_structure(
        &self,
        (name, owner): (&str, Owner),
        kind: StructureKind,
    ) -> Result<Arc<AccelerationStructure>, Error> {
        let name = name.to_owned();
        AccelerationStructure::new(&self.device, StructureDesc { name, kind, owner })
    }

    /// Makes set 0, which shows these buffers to every pass that asks for the scene.
    pub fn create_scene_set(&self, bindings: &SceneBindings) -> Result<Arc<SceneSet>, Error> {
        SceneSet::new(&self.device, &self.shared, bindings)
    }

    /// Makes set 2 from albedo, emission, normal, mask and lobe textures, which are complete and
    /// only read from now on.
    pub fn create_material_set(
        &self,
        images: [&Arc<Image>; MATERIAL_TEXTURES],
    ) -> Result<Arc<MaterialSet>, Error> {
        self.make_ready(&images)?;
        MaterialSet::new(&self.device, &self.shared, images)
    }

    /// Images can be sampled from now on.
    pub fn make_ready(&self, images: &[&Arc<Image>]) -> Result<(), Error> {
        let mut frame = Frame::new();
        for image in images {
            let resource = Resource::from(*image);
            let uses = [Access::ComputeSampled, Access::RasterSampled]
                .map(|access| (resource.clone(), resource.used(access)));
            frame.push(
                format!("ready {}", image.name()),
                uses.to_vec(),
                Work::Nothing,
            );
        }
        self.submit(frame).map(drop)
    }

    /// Plans, records and runs a frame after the uploads before it, and waits for it.
    pub fn submit(&self, frame: Frame) -> Result<FrameStats, Error> {
        self.run(frame, |_| true)
    }

    /// What the host has done so far.
    pub fn host_work(&self) -> HostWork {
        self.runner().host
    }

    pub(super) fn note(&self, add: impl FnOnce(&mut HostWork)) {
        add(&mut self.runner().host);
    }

    /// Adds to the uploads that go with the next submission.
    pub(super) fn with_uploads<T>(&self, change: impl FnOnce(&mut Uploads) -> T) -> T {
        change(&mut self.runner().uploads)
    }

    /// Submits uploads that wait, so that no memory is theirs.
    fn settle(&self) {
        if let Err(error) = self.flush() {
            log::debug!("uploads wait on: {error}");
        }
    }

    fn runner(&self) -> MutexGuard<'_, Runner> {
        self.runner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// As [`Gpu::submit`], without the barriers that `keep` turns down: for tests that show that
    /// somebody notices.
    #[doc(hidden)]
    pub fn submit_with_barriers(
        &self,
        frame: Frame,
        keep: impl Fn(&Barrier) -> bool,
    ) -> Result<FrameStats, Error> {
        self.run(frame, keep)
    }

    /// Notes what all frames from now on record, and returns what was noted so far. For tests that
    /// replay it.
    #[doc(hidden)]
    pub fn take_journal(&self) -> Vec<JournalFrame> {
        self.settle();
        let mut runner = self.runner();
        runner.journal.replace(Vec::new()).unwrap_or_default()
    }

    /// What is left of the work done so far, in words; empty on a device that is as new, but for
    /// pipelines that were made. Notes no frames any more. For tests that hand a device on.
    #[doc(hidden)]
    pub fn residue(&self) -> Vec<String> {
        self.settle();
        let mut runner = self.runner();
        runner.journal = None;
        let mut left: Vec<String> = self
            .device
            .memory_in_use()
            .into_iter()
            .map(|(name, bytes)| format!("{name}, {bytes} bytes"))
            .collect();
        let objects =
            Arc::strong_count(&self.device) - self.own_count - runner.pipelines.object_count();
        if objects > left.len() {
            left.push(format!(
                "{} objects without memory, such as descriptor sets",
                objects - left.len()
            ));
        }
        let nameless = self.device.memory_allocated_bytes();
        if left.is_empty() && nameless > 0 {
            left.push(format!("{nameless} bytes of memory without a name"));
        }
        left.extend(
            runner
                .pipelines
                .replaced()
                .map(|stem| format!("{stem} in place of the embedded module")),
        );
        left
    }

    /// Takes a shader module, compiled while the program runs, in place of the embedded one of this
    /// stem. Where it cannot be, the old one stays and the error says why. Answers how many
    /// pipelines it was built into.
    pub fn replace_module(&self, stem: &str, words: Vec<u32>) -> Result<usize, Error> {
        let mut runner = self.runner();
        runner.pipelines.replace_module(&self.device, stem, words)
    }

    /// Name and bytes of every living resource, in order of creation.
    pub fn memory(&self) -> Vec<(String, u64)> {
        self.settle();
        self.device.memory_in_use()
    }

    /// Bytes of all living resources that are counted for an owner.
    pub fn bytes_of(&self, owner: Owner) -> u64 {
        self.settle();
        self.device.bytes_of(owner)
    }

    /// Bytes of all living resources, as the allocator counts them.
    pub fn memory_total(&self) -> u64 {
        self.settle();
        self.device.memory_allocated_bytes()
    }

    /// Bytes that buffers and images may still take.
    pub fn memory_left(&self) -> u64 {
        self.settle();
        self.device.memory_left_bytes()
    }

    /// All validation warnings and errors so far.
    pub fn validation_messages(&self) -> Vec<String> {
        self.messages().list()
    }

    /// The list of validation messages, which outlives this object and so sees its end.
    pub fn messages(&self) -> Messages {
        self.device.instance().messages().clone()
    }

    /// The limits of the device.
    pub fn limits(&self) -> &Limits {
        &self.device.adapter().limits
    }

    /// Name, driver and version of the device.
    pub fn info(&self) -> &DeviceInfo {
        &self.device.adapter().info
    }

    /// Whether pass times are taken on the host, pass by pass, and not from timestamps.
    pub fn isolates_passes(&self) -> bool {
        self.isolate
    }

    /// Whether the device traces rays itself, through acceleration structures.
    pub fn traces_rays(&self) -> bool {
        self.device_rays
    }

    /// The optional features that the device has.
    pub fn features(&self) -> &Features {
        &self.device.adapter().features
    }

    fn run(&self, mut frame: Frame, keep: impl Fn(&Barrier) -> bool) -> Result<FrameStats, Error> {
        if frame.steps.is_empty() {
            return Ok(FrameStats::default());
        }
        let runner = &mut *self.runner();
        let Uploads {
            mut steps,
            ready,
            bytes,
        } = std::mem::take(&mut runner.uploads);
        let count = steps.len();
        steps.extend(ready_step(&ready, &frame));
        frame.steps.splice(0..0, steps);
        runner.host.submissions += 1;
        let stats = self.run_all(runner, &frame, keep);
        // They may not have arrived, where there still is a device.
        if matches!(&stats, Err(error) if !matches!(error, Error::DeviceLost { .. })) {
            let steps = frame.steps.drain(..count).collect();
            runner.uploads = Uploads {
                steps,
                ready,
                bytes,
            };
        }
        stats
    }

    fn run_all(
        &self,
        runner: &mut Runner,
        frame: &Frame,
        keep: impl Fn(&Barrier) -> bool,
    ) -> Result<FrameStats, Error> {
        for id in self.device.take_retired() {
            runner.state.forget(id);
        }
        let (mut barriers, state) = plan(&frame.uses(), &runner.state);
        barriers
            .iter_mut()
            .for_each(|barriers| barriers.retain(&keep));
        if let Some(journal) = &mut runner.journal {
            let names = frame
                .names()
                .iter()
                .map(|name| (*name).to_owned())
                .collect();
            journal.push(JournalFrame {
                names,
                uses: frame.uses(),
                issued: Vec::new(),
            });
        }
        runner.pipelines.make(&self.device, &self.shared, frame)?;
        let count = u32::try_from(2 * frame.steps.len()).unwrap_or(u32::MAX);
        if runner.timestamps.count() < count {
            runner.timestamps = Timestamps::new(&self.device, count.next_power_of_two())?;
        }
        runner.timestamps.reset();
        let mut recorder = Recorder {
            device: &self.device,
            shared: &self.shared,
            commands: &runner.commands,
            timestamps: &runner.timestamps,
            pipelines: &mut runner.pipelines,
            notes: runner
                .journal
                .as_mut()
                .and_then(|journal| journal.last_mut())
                .map(|frame| &mut frame.issued),
            trace: self.trace,
        };
        let part_len = if self.isolate {
            1
        } else {
            frame.steps.len().max(1)
        };
        // A frame without steps is still one, empty, submission.
        let starts = (0..frame.steps.len().max(1)).step_by(part_len);
        let mut host_ms = Vec::with_capacity(starts.len());
        for start in starts {
            let loss = self.device.planted_loss();
            let end = (start + loss.unwrap_or(part_len).min(part_len)).min(frame.steps.len());
            let pool = recorder.record(frame, &barriers, start..end)?;
            let start = Instant::now();
            let done = recorder.commands.submit_and_wait().and(if loss.is_some() {
                Err(vk::Result::ERROR_DEVICE_LOST)
            } else {
                Ok(())
            });
            host_ms.push(start.elapsed().as_secs_f64() * 1e3);
            done.map_err(|result| failure(frame, &recorder.timestamps.read(count), result))?;
            drop(pool);
        }
        let gpu_ms = if self.isolate {
            host_ms
        } else {
            self.pass_ms(&runner.timestamps.read(count))
        };
        runner.state = state;
        let mut stats = FrameStats::default();
        frame
            .steps
            .iter()
            .zip(gpu_ms)
            .filter(|(step, _)| step.is_told)
            .for_each(|(step, ms)| stats.add(&step.name, ms));
        Ok(stats)
    }

    /// Milliseconds between the two timestamps of each step.
    fn pass_ms(&self, ticks: &[Option<u64>]) -> Vec<f64> {
        let ms_per_tick = f64::from(self.device.adapter().limits.timestamp_period_ns) * 1e-6;
        let elapsed = |pair: &[Option<u64>]| match pair {
            [Some(start), Some(end)] => end.saturating_sub(*start) as f64 * ms_per_tick,
            _ => 0.0,
        };
        ticks.chunks_exact(2).map(elapsed).collect()
    }
}

/// Makes buffers ready to be read by passes that do not say so, as of the scene's. What the frame
/// declares gets its barriers from that.
fn ready_step(buffers: &[Arc<Buffer>], frame: &Frame) -> Option<Step> {
    let uses = frame.uses();
    let mut known: BTreeSet<u64> = uses.iter().flatten().map(|used| used.resource).collect();
    let ready: Vec<_> = buffers
        .iter()
        .map(Resource::from)
        .filter(|buffer| known.insert(buffer.id()))
        .flat_map(|buffer| {
            [Access::ComputeRead, Access::RasterRead]
                .map(|access| (buffer.clone(), buffer.used(access)))
        })
        .collect();
    (!ready.is_empty()).then(|| Step {
        name: "uploads".to_owned(),
        uses: ready,
        work: Work::Nothing,
        is_told: false,
    })
}

/// Whether a device is to trace rays; an error where it is asked to and cannot.
fn device_rays(adapter: &Adapter, asked: Option<bool>) -> Result<bool, Error> {
    let can = adapter.features.ray_query;
    if asked == Some(true) && !can {
        return Err(Error::FeatureMissing {
            what: "rays of the device".to_owned(),
            feature: RAY_QUERY,
        });
    }
    Ok(asked.unwrap_or(can && adapter.info.kind != DeviceKind::Cpu))
}

/// Says which pass was the last to finish.
fn failure(frame: &Frame, ticks: &[Option<u64>], result: vk::Result) -> Error {
    if result != vk::Result::ERROR_DEVICE_LOST {
        return Error::Vulkan {
            what: "running a frame".to_owned(),
            result,
        };
    }
    let finished = frame
        .steps
        .iter()
        .zip(ticks.chunks_exact(2))
        .take_while(|(_, pair)| pair.iter().all(Option::is_some))
        .last();
    Error::DeviceLost {
        last_pass: finished.map_or("none of this frame".to_owned(), |(step, _)| {
            step.name.clone()
        }),
    }
}
