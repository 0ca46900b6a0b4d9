//! The context that everything uses: one device, its resources, and frames run on it.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;

use super::frame::Frame;
use super::journal::JournalFrame;
use super::pace::{LONGEST_MS, Pace};
use super::plan::Barrier;
use super::runner::{Recorded, Runner};
use super::sets::{MATERIAL_TEXTURES, MaterialSet, SceneBindings, SceneSet, SharedSets};
use super::stats::{FrameStats, HostWork};
use crate::vulkan::{
    AccelerationStructure, Adapter, Buffer, BufferDesc, Device, DeviceChoice, DeviceInfo,
    DeviceKind, Error, Faults, Features, Handover, HostCommands, Image, ImageDesc, Instance,
    InstanceOptions, Limits, Loops, Messages, Owner, RAY_QUERY, StructureDesc, StructureKind,
};

/// How to open a [`Gpu`].
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// The device to open: the best one, or one by index or name.
    pub device: DeviceChoice,
    /// With the Khronos validation layer and synchronization validation.
    pub validate: bool,
    /// RenderDoc sees what runs, and can take captures of it.
    pub captures: bool,
    /// Print every barrier to stderr, with the two passes and the hazard that it is for.
    pub trace_barriers: bool,
    /// Submit every pass by itself and take its time on the host: for drivers whose timestamps do
    /// not follow their execution (lavapipe runs compute at once but queues rasterization, so
    /// that its timestamps charge one pass with another's work).
    pub isolate_passes: bool,
    /// Submissions take no longer, by what their passes took before (ms): frames are cut, and long
    /// dispatches with them. `None`: 200 on a GPU, for the watchdog of its driver; what a frame
    /// takes on a CPU, which has none.
    pub longest_submission_ms: Option<f64>,
    /// Whether the device traces rays itself, for which it needs [`Features::ray_query`], or
    /// shaders do; `None`: the device, where it can and is no CPU, which is slower at it.
    pub device_rays: Option<bool>,
    /// What light in images of the screen's size is kept in.
    pub screen_format: ScreenFormat,
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

/// Numbers of the light in images of the screen's size: direct, indirect, and what lies between.
/// Depth, normals and motion stay as they are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ScreenFormat {
    /// RGBA32F.
    #[default]
    Float32,
    /// RGBA16F: half of the memory and of its traffic. Numbers have 11 bits, and light of more than
    /// 65,504 W/(m² sr) overflows.
    Float16,
}

impl ScreenFormat {
    /// What Vulkan calls it.
    pub(crate) fn format(self) -> vk::Format {
        match self {
            ScreenFormat::Float32 => vk::Format::R32G32B32A32_SFLOAT,
            ScreenFormat::Float16 => vk::Format::R16G16B16A16_SFLOAT,
        }
    }
}

impl GpuOptions {
    pub(crate) fn instance(&self) -> InstanceOptions {
        let GpuOptions {
            validate,
            check_accesses,
            captures,
            poison,
            ..
        } = *self;
        InstanceOptions {
            validate,
            check_accesses,
            captures,
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
    isolate: bool,
    device_rays: bool,
    screen_format: ScreenFormat,
    cache_dir: Option<PathBuf>,
    progress: Option<fn(&'static str, f32)>,
}

impl Gpu {
    /// Opens a device.
    pub fn new(options: &GpuOptions) -> Result<Self, Error> {
        let instance = Instance::new(&options.instance())?;
        let device = Device::new(&instance, &options.device, options.cache_dir.as_deref())?;
        Gpu::on(device, options)
    }

    /// Works on a device that is open, such as one of another program ([`Device::from_ash`]).
    pub fn on(device: Arc<Device>, options: &GpuOptions) -> Result<Self, Error> {
        let device_rays = device_rays(device.adapter(), options.device_rays)?;
        let shared = SharedSets::new(&device)?;
        let has_watchdog = device.adapter().info.kind != DeviceKind::Cpu;
        let own = has_watchdog.then_some(LONGEST_MS);
        let longest_ms = options.longest_submission_ms.or(own);
        let pace = Pace::new(longest_ms, options.isolate_passes);
        let runner = Runner::new(&device, &shared, options.trace_barriers, pace)?;
        let own_count = Arc::strong_count(&device);
        Ok(Gpu {
            runner: Mutex::new(runner),
            shared,
            device,
            own_count,
            isolate: options.isolate_passes,
            device_rays,
            screen_format: options.screen_format,
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
        self.make_ready(&images);
        MaterialSet::new(&self.device, &self.shared, images)
    }

    /// Images can be sampled from now on.
    pub fn make_ready(&self, images: &[&Arc<Image>]) {
        let mut frame = Frame::new();
        frame.ready(images);
        self.enqueue(frame);
    }

    /// Plans, records and runs a frame after what waits for it ([`Gpu::enqueue`]), whose cost is
    /// told with its own, and waits for it.
    pub fn submit(&self, frame: Frame) -> Result<FrameStats, Error> {
        self.run(frame, |_| true)
    }

    /// As [`Gpu::submit`], without waiting for it: only for the oldest where
    /// [`super::FRAMES_IN_FLIGHT`] run already. [`Gpu::finish`] tells its cost.
    pub fn submit_ahead(&self, frame: Frame) -> Result<(), Error> {
        if frame.steps.is_empty() {
            return Ok(());
        }
        self.runner().run_ahead(frame)
    }

    /// Records a frame, after what waits for one, into a command buffer of another program, and the
    /// images that are handed over. Nothing is submitted: the program submits the commands to the
    /// same queue before it calls anything else here, and keeps what is returned until they are
    /// done.
    pub fn record(
        &self,
        frame: Frame,
        commands: &HostCommands,
        handed: &[Handover],
    ) -> Result<Recorded, Error> {
        self.runner().record_for_host(frame, commands, handed)
    }

    /// Waits for all frames that run, and tells what each has cost that nobody waited for before.
    pub fn finish(&self) -> Result<Vec<FrameStats>, Error> {
        self.runner().finish()
    }

    /// A frame that goes with the next submission, before it and after uploads and frames so far:
    /// for work whose results the host does not need.
    pub fn enqueue(&self, frame: Frame) {
        self.runner().waiting.steps.extend(frame.steps);
    }

    /// Submits what waits for the next submission, if anything does, and tells what it cost.
    pub fn submit_waiting(&self) -> Result<FrameStats, Error> {
        let runner = &mut *self.runner();
        if runner.waiting.steps.is_empty() {
            return Ok(std::mem::take(&mut runner.waiting.stats));
        }
        runner.run(Frame::new(), |_| true)
    }

    /// What passes took is of other settings: nothing is known of what they will take.
    pub fn forget_times(&self) {
        self.runner().pace.forget();
    }

    /// What the host has done so far.
    pub fn host_work(&self) -> HostWork {
        self.runner().host
    }

    pub(super) fn note(&self, add: impl FnOnce(&mut HostWork)) {
        add(&mut self.runner().host);
    }

    /// Uploads that go with the next submission, of so many bytes; answers how many bytes wait.
    pub(super) fn enqueue_upload(&self, frame: Frame, bytes: u64) -> u64 {
        let runner = &mut *self.runner();
        runner.host.uploads += 1;
        runner.waiting.steps.extend(frame.into_untold());
        runner.waiting.bytes += bytes;
        runner.waiting.bytes
    }

    /// Submits what waits, and keeps its cost for the next who asks.
    pub(super) fn submit_early(&self) -> Result<(), Error> {
        let stats = self.submit_waiting()?;
        self.tell_later(stats);
        Ok(())
    }

    /// Keeps a cost for the next who asks.
    pub(super) fn tell_later(&self, stats: FrameStats) {
        self.runner().waiting.stats.append(stats);
    }

    /// Submits what waits and waits for all, so that no memory is its.
    fn settle(&self) {
        if let Err(error) = self.submit_early().and_then(|()| self.runner().wait()) {
            log::debug!("work waits on: {error}");
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
        let objects = Arc::strong_count(&self.device) - self.own_count - runner.object_count();
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

    fn run(&self, frame: Frame, keep: impl Fn(&Barrier) -> bool) -> Result<FrameStats, Error> {
        if frame.steps.is_empty() {
            return Ok(FrameStats::default());
        }
        self.runner().run(frame, keep)
    }

    /// Takes a shader module, compiled while the program runs, in place of the embedded one of this
    /// stem. Where it cannot be, the old one stays and the error says why. Answers how many
    /// pipelines it was built into.
    pub fn replace_module(&self, stem: &str, words: Vec<u32>) -> Result<usize, Error> {
        let mut runner = self.runner();
        // Frames that run have the old pipelines.
        runner.wait()?;
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

    /// The device that it works on.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// How loops of shaders run on the device.
    pub fn loops(&self) -> Loops {
        self.device.adapter().loops
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

    /// What light in images of the screen's size is kept in.
    pub fn screen_format(&self) -> ScreenFormat {
        self.screen_format
    }

    /// The optional features that the device has.
    pub fn features(&self) -> &Features {
        &self.device.adapter().features
    }
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
