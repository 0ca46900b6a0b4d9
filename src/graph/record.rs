//! From a planned frame to commands: the only place that issues barriers, labels, timers and
//! dispatches.

use std::collections::hash_map::Entry;
use std::collections::{BTreeSet, HashMap};
use std::num::NonZero;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::thread;

use ash::vk;

use super::Access;
use super::builder::{PassCall, Run, Target};
use super::frame::{Frame, Resource, Step, Work};
use super::journal::{Issued, IssuedBarrier, Touch};
use super::pace::{Part, shared_out};
use super::pass::{BindingKind, Pass, SCENE_CONSTANTS, Shaders};
use super::plan::Barrier;
use super::sets::SharedSets;
use crate::shader::{self, Interface};
use crate::vulkan::{
    Attachment, Buffer, Commands, Descriptor, DescriptorPool, Device, Error, GraphicsDesc, Image,
    Pipeline, PipelineLayout, Rendering, SetLayout, Timestamps,
};

/// The address of a pass, and whether the device traces its rays: passes of one name may differ in
/// shaders or targets.
type PassKey = (usize, bool);

/// What a pipeline is made for.
#[derive(Clone, PartialEq, Eq, Hash)]
struct PipelineKey {
    pass: PassKey,
    /// Numbers and values of specialization constants.
    constants: Vec<(u32, u32)>,
    /// Whether its images of light are RGBA16F where shaders say RGBA32F.
    halves: bool,
}

fn key_of(call: &PassCall) -> PassKey {
    (std::ptr::from_ref(call.pass).addr(), call.queries())
}

/// Layouts of a pass's own set and of its pipelines.
struct Layouts {
    set: Arc<SetLayout>,
    pipeline: Arc<PipelineLayout>,
    /// Which of [`SCENE_CONSTANTS`] its shaders have.
    asks_for: [bool; SCENE_CONSTANTS.len()],
    /// Whether they need all workgroups in one dispatch.
    counts_groups: bool,
    /// Bindings of which shaders say that they are RGBA32F images as large as the screen.
    full_images: BTreeSet<u32>,
}

/// Pipelines by pass and specialization constants, made before the first frame that uses them.
#[derive(Default)]
pub(super) struct Pipelines {
    layouts: HashMap<PassKey, Layouts>,
    pipelines: HashMap<PipelineKey, (&'static Pass, Arc<Pipeline>)>,
    /// Modules that stand in for the embedded ones.
    modules: HashMap<String, Vec<u32>>,
}

impl Pipelines {
    /// Vulkan objects in here that keep the device alive.
    pub(super) fn object_count(&self) -> usize {
        2 * self.layouts.len() + self.pipelines.len()
    }

    /// Stems of the modules that stand in for the embedded ones.
    pub(super) fn replaced(&self) -> impl Iterator<Item = &str> {
        self.modules.keys().map(String::as_str)
    }

    fn layouts(
        &mut self,
        device: &Arc<Device>,
        shared: &SharedSets,
        call: &PassCall,
    ) -> Result<&Layouts, Error> {
        let (key, pass) = (key_of(call), call.pass);
        match self.layouts.entry(key) {
            Entry::Occupied(known) => Ok(known.into_mut()),
            Entry::Vacant(new) => {
                let kinds: Vec<_> = pass
                    .bindings
                    .iter()
                    .map(|binding| binding.descriptor_type(key.1))
                    .collect();
                let set = SetLayout::new(device, pass.name, &kinds)?;
                let pipeline = PipelineLayout::new(
                    device,
                    pass.name,
                    &[&shared.scene, &set, &shared.material],
                    pass.push_bytes() as u32,
                )?;
                let mut asks_for = [false; SCENE_CONSTANTS.len()];
                let mut counts_groups = false;
                let mut full_images = BTreeSet::new();
                for (_, stem) in pass.modules(key.1) {
                    let interface = Interface::of(&shader::words(&stem)?);
                    counts_groups |= interface.as_ref().is_some_and(Interface::counts_groups);
                    full_images.extend(interface.iter().flat_map(Interface::full_images));
                    for (asks, (number, _)) in asks_for.iter_mut().zip(SCENE_CONSTANTS) {
                        *asks |= interface
                            .as_ref()
                            .is_some_and(|one| one.has_constant(number));
                    }
                }
                Ok(new.insert(Layouts {
                    set,
                    pipeline,
                    asks_for,
                    counts_groups,
                    full_images,
                }))
            }
        }
    }

    fn pipeline_key(
        &mut self,
        device: &Arc<Device>,
        shared: &SharedSets,
        call: &PassCall,
    ) -> Result<PipelineKey, Error> {
        let layouts = self.layouts(device, shared, call)?;
        let of_scene = call.scene_has.into_iter().flatten().zip(layouts.asks_for);
        let of_scene = of_scene.zip(SCENE_CONSTANTS);
        let of_scene = of_scene.filter(|((_, asks), _)| *asks);
        let constants = (0..)
            .zip(call.constants.iter().copied())
            .chain(of_scene.map(|((has, _), (number, _))| (number, u32::from(has))));
        let full = layouts.full_images.iter();
        let bound = full.filter_map(|&binding| call.resources.get(binding as usize));
        let halves = is_half(call.pass.name, bound);
        Ok(PipelineKey {
            pass: key_of(call),
            constants: constants.collect(),
            halves,
        })
    }

    /// Makes the pipelines of a frame that are not there yet, on as many threads as there are
    /// processors: compiling them is most of what a program waits for when it starts.
    pub(super) fn make(
        &mut self,
        device: &Arc<Device>,
        shared: &SharedSets,
        frame: &Frame,
    ) -> Result<(), Error> {
        let mut missing: Vec<(PipelineKey, &'static Pass, Arc<PipelineLayout>)> = Vec::new();
        for step in &frame.steps {
            let Work::Pass(call) = &step.work else {
                continue;
            };
            let key = self.pipeline_key(device, shared, call)?;
            let is_known = self.pipelines.contains_key(&key)
                || missing.iter().any(|(other, ..)| *other == key);
            if !is_known {
                let layout = Arc::clone(&self.layouts(device, shared, call)?.pipeline);
                missing.push((key, call.pass, layout));
            }
        }
        let modules = &self.modules;
        let make = |(key, pass, layout): &(PipelineKey, &'static Pass, Arc<PipelineLayout>)| {
            let made = create_pipeline(device, pass, layout, modules, key)?;
            Ok((key.clone(), (*pass, made)))
        };
        // Threads of their own: a pool's could take up other work, which waits for this device.
        let workers = thread::available_parallelism().map_or(1, NonZero::get);
        let share = |worker: usize| missing.iter().skip(worker).step_by(workers).map(make);
        let made: Vec<Result<Vec<_>, Error>> = thread::scope(|scope| {
            let others = (1..workers.min(missing.len()))
                .map(|worker| scope.spawn(move || share(worker).collect()))
                .collect::<Vec<_>>();
            let own = [share(0).collect()].into_iter();
            own.chain(
                others
                    .into_iter()
                    .map(|other| other.join().unwrap_or_else(|panic| resume_unwind(panic))),
            )
            .collect()
        });
        for made in made {
            self.pipelines.extend(made?);
        }
        Ok(())
    }

    /// Whether a step may be run in shares; not before [`Pipelines::make`].
    pub(super) fn can_cut(&self, step: &Step) -> bool {
        let Work::Pass(call) = &step.work else {
            return false;
        };
        match &call.run {
            Run::Dispatch(_) => {
                let layouts = self.layouts.get(&key_of(call));
                layouts.is_some_and(|layouts| !layouts.counts_groups)
            }
            Run::Chain(batches) => batches.len() > 1,
            Run::Indirect(..) | Run::Draw { .. } => false,
        }
    }

    /// The pipeline of a call, which [`Pipelines::make`] has made.
    fn pipeline(
        &mut self,
        device: &Arc<Device>,
        shared: &SharedSets,
        call: &PassCall,
    ) -> Result<Arc<Pipeline>, Error> {
        let key = self.pipeline_key(device, shared, call)?;
        Ok(Arc::clone(&self.pipelines[&key].1))
    }

    /// Takes a module in place of the embedded one, and makes all pipelines with it again. Returns
    /// how many it made. On failure, everything stays as it was.
    pub(super) fn replace_module(
        &mut self,
        device: &Arc<Device>,
        stem: &str,
        words: Vec<u32>,
    ) -> Result<usize, Error> {
        let refused = |problem: &str| Error::ModuleRefused {
            stem: stem.to_owned(),
            problem: problem.to_owned(),
        };
        let embedded = Interface::of(&shader::words(stem)?)
            .ok_or_else(|| refused("the embedded module is no SPIR-V"))?;
        let interface = Interface::of(&words).ok_or_else(|| refused("this is no SPIR-V"))?;
        if let Some(difference) = embedded.difference(&interface) {
            return Err(refused(&format!(
                "{difference} changed, which the program declares too: build the program again"
            )));
        }
        let mut modules = self.modules.clone();
        modules.insert(stem.to_owned(), words);
        let mut made = Vec::new();
        for (key, (pass, _)) in &self.pipelines {
            let used = pass.modules(key.pass.1);
            if used.iter().any(|(_, used)| used == stem)
                && let Some(layouts) = self.layouts.get(&key.pass)
            {
                let one = create_pipeline(device, pass, &layouts.pipeline, &modules, key)?;
                made.push((key.clone(), (*pass, one)));
            }
        }
        let count = made.len();
        self.pipelines.extend(made);
        self.modules = modules;
        Ok(count)
    }
}

/// Whether images of light are RGBA16F; those of one pass are all alike.
fn is_half<'r>(pass: &str, mut images: impl Iterator<Item = &'r Resource>) -> bool {
    let is_half = |resource: &Resource| {
        matches!(resource, Resource::Image(image, _)
            if image.desc().format == vk::Format::R16G16B16A16_SFLOAT)
    };
    let first = images.next().is_some_and(is_half);
    assert!(
        images.all(|other| is_half(other) == first),
        "pass {pass}: some images of light are RGBA16F and some are not"
    );
    first
}

fn create_pipeline(
    device: &Arc<Device>,
    pass: &Pass,
    layout: &Arc<PipelineLayout>,
    replaced: &HashMap<String, Vec<u32>>,
    key: &PipelineKey,
) -> Result<Arc<Pipeline>, Error> {
    let constants = &key.constants;
    let words = |stem: &str| {
        let words = replaced
            .get(stem)
            .map_or_else(|| shader::words(stem), |words| Ok(words.clone()))?;
        Ok::<_, Error>(if key.halves {
            shader::with_half_images(words)
        } else {
            words
        })
    };
    let modules: Vec<(vk::ShaderStageFlags, Vec<u32>)> = (pass.modules(key.pass.1).into_iter())
        .map(|(stage, stem)| Ok((stage, words(&stem)?)))
        .collect::<Result<_, Error>>()?;
    let Shaders::Raster {
        geometry, state, ..
    } = &pass.shaders
    else {
        return Pipeline::compute(device, pass.name, layout, &modules[0].1, constants);
    };
    let features = &device.adapter().features;
    let missing = |feature| Error::FeatureMissing {
        what: format!("the pass {}", pass.name),
        feature,
    };
    if geometry.is_some() && !features.geometry_shader {
        return Err(missing("geometryShader"));
    }
    if state.conservative && !features.conservative_rasterization {
        return Err(missing("VK_EXT_conservative_rasterization"));
    }
    let stages: Vec<(vk::ShaderStageFlags, &[u32])> = modules
        .iter()
        .map(|(stage, words)| (*stage, words.as_slice()))
        .collect();
    let desc = GraphicsDesc {
        stages: &stages,
        color: state.color,
        depth: state.depth,
        depth_compare: state.depth_compare,
        depth_bias: state.depth_bias.map(|bias| [bias.constant, bias.slope]),
        cull: state.cull,
        conservative: state.conservative,
    };
    Pipeline::graphics(device, pass.name, layout, &desc, constants)
}

/// What recording needs besides the frame.
pub(super) struct Recorder<'r> {
    pub(super) device: &'r Arc<Device>,
    pub(super) shared: &'r SharedSets,
    pub(super) commands: &'r Commands,
    /// Where it is timed, if it is.
    pub(super) timestamps: Option<&'r Timestamps>,
    pub(super) pipelines: &'r mut Pipelines,
    /// What is recorded is noted here, where a test asks for it.
    pub(super) notes: Option<&'r mut Vec<Issued>>,
    pub(super) trace: bool,
}

impl Recorder<'_> {
    /// Records some steps, or a share of one, with the barriers before each; the pool returned has
    /// to live until the commands have run.
    pub(super) fn record(
        &mut self,
        frame: &Frame,
        barriers: &[Vec<Barrier>],
        part: &Part,
    ) -> Result<DescriptorPool, Error> {
        let mut layouts = Vec::new();
        for step in &frame.steps[part.steps.clone()] {
            if let Work::Pass(call) = &step.work {
                layouts.push(Arc::clone(
                    &self.pipelines.layouts(self.device, self.shared, call)?.set,
                ));
            }
        }
        let pool = DescriptorPool::new(self.device, layouts.iter().map(|layout| &**layout))?;
        for ((index, step), barriers) in (0u32..)
            .zip(&frame.steps)
            .zip(barriers)
            .take(part.steps.end)
            .skip(part.steps.start)
        {
            if self.trace && part.begins() {
                barriers
                    .iter()
                    .for_each(|barrier| trace(frame, step, barrier));
            }
            self.commands.begin_label(&step.name);
            if part.begins() {
                self.barriers(step, barriers);
                self.timestamp(2 * index);
            }
            self.step(step, part, &pool)?;
            if part.ends() {
                self.timestamp(2 * index + 1);
            }
            self.commands.end_label();
        }
        Ok(pool)
    }

    fn timestamp(&self, index: u32) {
        if let Some(timestamps) = self.timestamps {
            self.commands.timestamp(timestamps, index);
        }
    }

    fn barriers(&mut self, step: &Step, barriers: &[Barrier]) {
        let (mut buffers, mut images) = (Vec::new(), Vec::new());
        for barrier in barriers {
            match step
                .uses
                .iter()
                .map(|(resource, _)| resource)
                .find(|resource| resource.id() == barrier.resource)
            {
                Some(Resource::Image(image, _)) => images.push(image_barrier(image, barrier)),
                Some(Resource::Buffer(buffer)) => buffers.push(buffer_barrier(buffer, barrier)),
                Some(Resource::Structure(structure)) => {
                    buffers.push(buffer_barrier(structure.buffer(), barrier));
                }
                None => {}
            }
        }
        if !barriers.is_empty() {
            self.commands.barriers(&buffers, &images);
            self.note_barriers(step, &buffers, &images);
        }
    }

    /// Notes barriers as Vulkan was given them; the step only tells which resource a handle is.
    fn note_barriers(
        &mut self,
        step: &Step,
        buffers: &[vk::BufferMemoryBarrier2<'_>],
        images: &[vk::ImageMemoryBarrier2<'_>],
    ) {
        let Some(notes) = &mut self.notes else { return };
        let id_of = |is_it: &dyn Fn(&Resource) -> bool| {
            step.uses
                .iter()
                .map(|(resource, _)| resource)
                .find(|resource| is_it(resource))
                .map(Resource::id)
        };
        for barrier in buffers {
            let id = id_of(&|resource| {
                let buffer = resource.buffer();
                buffer.is_some_and(|buffer| buffer.raw() == barrier.buffer)
            });
            notes.extend(id.map(|id| Issued::Barrier(IssuedBarrier::of_buffer(id, barrier))));
        }
        for barrier in images {
            let id = id_of(&|resource| {
                matches!(resource,
                    Resource::Image(image, _) if image.raw() == barrier.image)
            });
            notes.extend(id.map(|id| Issued::Barrier(IssuedBarrier::of_image(id, barrier))));
        }
    }

    fn step(&mut self, step: &Step, part: &Part, pool: &DescriptorPool) -> Result<(), Error> {
        let commands = self.commands;
        if let Some(notes) = &mut self.notes {
            notes.extend(Issued::transfer(&step.work));
        }
        match &step.work {
            Work::Nothing => {}
            Work::Pass(call) => self.pass(call, part, pool)?,
            Work::Fill(buffer, first_byte, value) => commands.fill(buffer, *first_byte, *value),
            Work::Set(buffer, bytes) => commands.set(buffer, bytes),
            Work::Clear(image, mips, value) => commands.clear(image, mips, value.raw()),
            Work::BlitMip(image, source) => commands.blit_mip(image, *source),
            Work::Blit(source, target) => commands.blit(source, target),
            Work::CopyBuffer {
                source,
                target,
                size,
            } => commands.copy_buffer((&source.0, source.1), (&target.0, target.1), *size),
            Work::ToImage {
                source,
                target,
                region,
            } => commands.copy_to_image(source, target, *region),
            Work::FromImage {
                source,
                region,
                target,
            } => commands.copy_from_image(source, *region, target),
            Work::Build {
                structure,
                input,
                scratch,
                follows,
            } => commands.build_structure(structure, (input, scratch), *follows),
        }
        Ok(())
    }

    fn pass(&mut self, call: &PassCall, part: &Part, pool: &DescriptorPool) -> Result<(), Error> {
        let pipeline = self.pipelines.pipeline(self.device, self.shared, call)?;
        let set_layout = Arc::clone(&self.pipelines.layouts(self.device, self.shared, call)?.set);
        let (descriptors, [color, depth]) = (descriptors(call)?, attachments(&call.run)?);
        if let Some(notes) = self.notes.as_mut().filter(|_| part.begins()) {
            notes.push(issued(call, &descriptors, [&color, &depth]));
        }
        self.commands.bind_pipeline(&pipeline);
        if let Some(scene) = &call.scene {
            self.commands.bind_set(&pipeline, 0, scene.raw);
        }
        if !call.resources.is_empty() {
            self.commands.bind_set(
                &pipeline,
                1,
                pool.set(call.pass.name, &set_layout, &descriptors)?,
            );
        }
        self.commands.push(&pipeline, &call.push);
        if let Some(word) = &call.condition {
            self.commands.begin_condition(word);
        }
        match &call.run {
            Run::Indirect(buffer, offset) => self.commands.dispatch_indirect(buffer, *offset),
            Run::Dispatch(batches) => {
                for batch in batches {
                    let (first, groups) = share_of(batch.groups, part.share);
                    self.batch(&pipeline, call, batch.material, &batch.push);
                    self.commands.dispatch(first, groups);
                }
            }
            Run::Chain(batches) => {
                let count = u32::try_from(batches.len()).unwrap_or(u32::MAX);
                for index in shared_out(count, part.share) {
                    let batch = &batches[index as usize];
                    if index > 0 {
                        let (wrote, reads) = (Access::ComputeWrite, Access::ComputeReadWrite);
                        let [src, dst] = [wrote.sync(), reads.sync()];
                        self.commands
                            .memory_barrier((src.stage, src.access), (dst.stage, dst.access));
                    }
                    self.batch(&pipeline, call, batch.material, &batch.push);
                    self.commands.dispatch([0; 3], batch.groups);
                }
            }
            Run::Draw {
                extent,
                viewport,
                indices,
                batches,
                ..
            } => {
                self.commands.begin_rendering(&Rendering {
                    color,
                    depth: depth.first().copied(),
                    extent: *extent,
                    viewport: *viewport,
                });
                for batch in batches {
                    if let Some(tile) = batch.tile {
                        self.commands.draw_in(tile);
                    }
                    self.batch(&pipeline, call, batch.material, &batch.push);
                    let (first, count) = (batch.first_vertex, batch.vertex_count);
                    match indices {
                        Some(indices) => self.commands.draw_indexed(indices, first, count),
                        None => self.commands.draw(first, count),
                    }
                }
                self.commands.end_rendering();
            }
        }
        if call.condition.is_some() {
            self.commands.end_condition();
        }
        Ok(())
    }

    /// The material and the parameters of one draw or dispatch of a pass.
    fn batch(&self, pipeline: &Pipeline, call: &PassCall, material: u32, push: &[u8]) {
        if let Some(set) = call
            .materials
            .as_ref()
            .and_then(|materials| materials.get(material as usize))
        {
            self.commands.bind_set(pipeline, 2, set.raw);
        }
        self.commands.push(pipeline, push);
    }
}

/// The first workgroup of a share of them, and how many there are, cut along the longest axis.
fn share_of(mut groups: [u32; 3], share: [u32; 2]) -> ([u32; 3], [u32; 3]) {
    let longest = (0..3).max_by_key(|&axis| groups[axis]).unwrap_or_default();
    let range = shared_out(groups[longest], share);
    let mut first = [0; 3];
    (first[longest], groups[longest]) = (range.start, range.end - range.start);
    (first, groups)
}

/// Colour attachments, and the depth attachment if there is one.
fn attachments(run: &Run) -> Result<[Vec<Attachment>; 2], Error> {
    let Run::Draw { color, depth, .. } = run else {
        return Ok([Vec::new(), Vec::new()]);
    };
    let color = color
        .iter()
        .map(|target| attachment(target, Access::ColorTarget))
        .collect::<Result<_, _>>()?;
    let depth = depth
        .iter()
        .map(|target| attachment(target, Access::DepthTarget))
        .collect::<Result<_, _>>()?;
    Ok([color, depth])
}

fn attachment(target: &Target, access: Access) -> Result<Attachment, Error> {
    Ok(Attachment {
        view: target.image.attachment_view(target.mip, target.layer)?,
        layout: access.sync().layout,
        clear: target.clear_value(),
    })
}

/// What a pass reaches, for tests.
fn issued(
    call: &PassCall,
    descriptors: &[Descriptor],
    [color_views, depth_views]: [&[Attachment]; 2],
) -> Issued {
    let is_compute = call.pass.is_compute();
    let sampled = if is_compute {
        Access::ComputeSampled
    } else {
        Access::RasterSampled
    };
    let bound = call
        .resources
        .iter()
        .zip(descriptors)
        .zip(call.pass.bindings);
    let mut touched: Vec<Touch> = bound
        .flat_map(|((resource, descriptor), binding)| {
            Touch::descriptor(resource, descriptor, binding.access)
        })
        .collect();
    let of_scene = (call.scene.iter()).flat_map(|scene| scene.read_by(call.pass));
    touched.extend(of_scene.map(|(buffer, access)| Touch::buffer(buffer, access)));
    let conditions = call.condition.iter();
    touched.extend(conditions.map(|word| Touch::buffer(word, Access::ConditionRead)));
    let mut used_materials = Vec::new();
    match &call.run {
        Run::Indirect(buffer, _) => touched.push(Touch::buffer(buffer, Access::IndirectRead)),
        Run::Dispatch(batches) | Run::Chain(batches) => {
            used_materials.extend(batches.iter().map(|batch| batch.material));
        }
        Run::Draw {
            color,
            depth,
            indices,
            batches,
            ..
        } => {
            let indices = indices.iter();
            touched.extend(indices.map(|buffer| Touch::buffer(buffer, Access::IndexRead)));
            touched.extend(color.iter().zip(color_views).filter_map(|(target, view)| {
                Touch::attachment(&target.image, view, Access::ColorTarget)
            }));
            touched.extend(depth.iter().zip(depth_views).filter_map(|(target, view)| {
                Touch::attachment(&target.image, view, Access::DepthTarget)
            }));
            used_materials.extend(batches.iter().map(|batch| batch.material));
        }
    }
    let materials = call.materials.iter().flat_map(|sets| {
        used_materials
            .iter()
            .filter_map(|&material| sets.get(material as usize))
    });
    Issued::Pass {
        pass: call.pass,
        touched,
        materials: materials
            .flat_map(|set| Touch::material(&set.images, sampled))
            .collect(),
    }
}

fn descriptors(call: &PassCall) -> Result<Vec<Descriptor>, Error> {
    let described = call
        .resources
        .iter()
        .zip(call.pass.bindings)
        .map(|(resource, binding)| match resource {
            Resource::Buffer(buffer) => Ok(Descriptor::Buffer(buffer.raw())),
            Resource::Structure(structure) => Ok(Descriptor::Structure(structure.raw())),
            Resource::Image(image, mips) => {
                let layout = if binding.kind == BindingKind::Image {
                    vk::ImageLayout::GENERAL
                } else {
                    vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL
                };
                Ok(Descriptor::Image(image.view(mips.clone())?, layout))
            }
        });
    described.collect()
}

fn buffer_barrier(buffer: &Buffer, barrier: &Barrier) -> vk::BufferMemoryBarrier2<'static> {
    vk::BufferMemoryBarrier2::default()
        .src_stage_mask(barrier.src.stage)
        .src_access_mask(barrier.src.access)
        .dst_stage_mask(barrier.dst.stage)
        .dst_access_mask(barrier.dst.access)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .buffer(buffer.raw())
        .size(vk::WHOLE_SIZE)
}

fn image_barrier(image: &Image, barrier: &Barrier) -> vk::ImageMemoryBarrier2<'static> {
    let range = vk::ImageSubresourceRange {
        aspect_mask: image.aspect(),
        base_mip_level: barrier.mips.first,
        level_count: barrier.mips.count,
        base_array_layer: barrier.layers.first,
        layer_count: barrier.layers.count,
    };
    vk::ImageMemoryBarrier2::default()
        .src_stage_mask(barrier.src.stage)
        .src_access_mask(barrier.src.access)
        .dst_stage_mask(barrier.dst.stage)
        .dst_access_mask(barrier.dst.access)
        .old_layout(barrier.old_layout)
        .new_layout(barrier.new_layout)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image.raw())
        .subresource_range(range)
}

/// One line for `--trace-barriers`.
fn trace(frame: &Frame, step: &Step, barrier: &Barrier) {
    let resource = step
        .uses
        .iter()
        .find(|(resource, _)| resource.id() == barrier.resource)
        .map_or("?", |(resource, _)| resource.name());
    let from = match barrier.from {
        None => "nothing".to_owned(),
        Some(origin) => {
            let name = origin
                .pass
                .and_then(|pass| frame.steps.get(pass))
                .map_or("an earlier frame", |step| step.name.as_str());
            format!("{name} ({:?})", origin.access)
        }
    };
    let mips = barrier.mips.first..barrier.mips.first + barrier.mips.count;
    let layouts = if barrier.old_layout == barrier.new_layout {
        String::new()
    } else {
        format!(", {:?} -> {:?}", barrier.old_layout, barrier.new_layout)
    };
    eprintln!(
        "barrier {resource} mips {mips:?}: {from} -> {} ({:?}): {:?}{layouts}",
        step.name, barrier.to, barrier.hazard
    );
}
