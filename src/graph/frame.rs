//! A frame: passes and transfers, in the order in which they run.

use std::ops::Range;
use std::sync::Arc;

use ash::vk;

use super::builder::{PassBuilder, PassCall};
use super::pass::{Binding, Pass, SCENE_CONSTANTS};
use super::plan::{Span, Use};
use super::sets::{MaterialSets, SceneSet};
use super::{Access, Sets};
use crate::vulkan::{AccelerationStructure, Buffer, Image, ImageRegion, Loops};

/// So many bytes may be in commands (the limit of `vkCmdUpdateBuffer`).
pub(super) const SET_BYTES: usize = 1 << 16;

/// A buffer, or some mips of an image.
#[derive(Clone)]
pub enum Resource {
    /// A whole buffer.
    Buffer(Arc<Buffer>),
    /// All layers of some mips of an image.
    Image(Arc<Image>, Range<u32>),
    /// An acceleration structure.
    Structure(Arc<AccelerationStructure>),
}

impl From<&Arc<Buffer>> for Resource {
    fn from(buffer: &Arc<Buffer>) -> Self {
        Resource::Buffer(Arc::clone(buffer))
    }
}

impl From<&Arc<Image>> for Resource {
    fn from(image: &Arc<Image>) -> Self {
        Resource::Image(Arc::clone(image), 0..image.mips())
    }
}

impl From<&Arc<AccelerationStructure>> for Resource {
    fn from(structure: &Arc<AccelerationStructure>) -> Self {
        Resource::Structure(Arc::clone(structure))
    }
}

/// What a pass is to bind: a buffer, or all mips of an image.
#[derive(Clone, Copy)]
pub enum Bound<'v> {
    /// A storage buffer.
    Buffer(&'v Arc<Buffer>),
    /// An image, sampled.
    Image(&'v Arc<Image>),
}

impl From<Bound<'_>> for Resource {
    fn from(bound: Bound<'_>) -> Self {
        match bound {
            Bound::Buffer(buffer) => buffer.into(),
            Bound::Image(image) => image.into(),
        }
    }
}

impl Resource {
    /// Name of the buffer or image.
    pub fn name(&self) -> &str {
        match self {
            Resource::Buffer(buffer) => buffer.name(),
            Resource::Image(image, _) => image.name(),
            Resource::Structure(structure) => structure.name(),
        }
    }

    pub(super) fn id(&self) -> u64 {
        match self {
            Resource::Buffer(buffer) => buffer.id(),
            Resource::Image(image, _) => image.id(),
            Resource::Structure(structure) => structure.buffer().id(),
        }
    }

    /// The memory that is a buffer's.
    pub(super) fn buffer(&self) -> Option<&Buffer> {
        match self {
            Resource::Buffer(buffer) => Some(buffer),
            Resource::Image(..) => None,
            Resource::Structure(structure) => Some(structure.buffer()),
        }
    }

    /// How a pass uses it that binds it so, and the parts that it reaches besides.
    pub(super) fn bound(&self, binding: &Binding) -> Vec<(Resource, Use)> {
        let Resource::Structure(structure) = self else {
            return vec![(self.clone(), self.used(binding.access))];
        };
        [structure]
            .into_iter()
            .chain(structure.parts())
            .map(|part| {
                (
                    part.into(),
                    Resource::from(part).used(Access::ComputeTraced),
                )
            })
            .collect()
    }

    pub(super) fn used(&self, access: Access) -> Use {
        match self {
            Resource::Buffer(_) | Resource::Structure(_) => Use::buffer(self.id(), access),
            Resource::Image(image, mips) => {
                let layers = Span {
                    first: 0,
                    count: image.desc().layers,
                };
                Use::image(
                    image.id(),
                    Span {
                        first: mips.start,
                        count: mips.end - mips.start,
                    },
                    layers,
                    access,
                )
            }
        }
    }
}

/// What to clear an image to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClearValue {
    /// For float and normalised formats.
    Float([f32; 4]),
    /// For unsigned integer formats: the same in every channel.
    Uint(u32),
}

impl From<[f32; 4]> for ClearValue {
    fn from(value: [f32; 4]) -> Self {
        ClearValue::Float(value)
    }
}

impl From<u32> for ClearValue {
    fn from(value: u32) -> Self {
        ClearValue::Uint(value)
    }
}

/// One step of a frame.
pub(super) struct Step {
    pub(super) name: String,
    /// What it uses; the resource is what `used` refers to.
    pub(super) uses: Vec<(Resource, Use)>,
    pub(super) work: Work,
    /// Whether what it costs is told; not of what only carries bytes for the host.
    pub(super) is_told: bool,
}

/// What a step does.
pub(super) enum Work {
    /// Only the barriers.
    Nothing,
    Pass(Box<PassCall>),
    Fill(Arc<Buffer>, u64, u32),
    /// Bytes to the start of a buffer, which the commands themselves hold.
    Set(Arc<Buffer>, Vec<u8>),
    Clear(Arc<Image>, Range<u32>, ClearValue),
    BlitMip(Arc<Image>, u32),
    /// The finest mip and first layer of an image to those of another.
    Blit(Arc<Image>, Arc<Image>),
    CopyBuffer {
        source: (Arc<Buffer>, u64),
        target: (Arc<Buffer>, u64),
        size: u64,
    },
    ToImage {
        source: Arc<Buffer>,
        target: Arc<Image>,
        region: ImageRegion,
    },
    FromImage {
        source: Arc<Image>,
        region: ImageRegion,
        target: Arc<Buffer>,
    },
    /// With `follows`, of triangles that were built before.
    Build {
        structure: Arc<AccelerationStructure>,
        input: Arc<Buffer>,
        scratch: Arc<Buffer>,
        follows: bool,
    },
}

/// Passes and transfers, in the order in which they run. Nothing happens before
/// [`super::Gpu::submit`].
#[derive(Default)]
pub struct Frame {
    pub(super) steps: Vec<Step>,
    scene: Option<Arc<SceneSet>>,
    materials: Option<MaterialSets>,
    /// Of the passes that are being added.
    pub(super) condition: Option<Arc<Buffer>>,
}

impl Frame {
    /// An empty frame.
    pub fn new() -> Self {
        Self::default()
    }

    /// The shared sets for the passes that are added from now on; the materials are in the order of
    /// the scene's.
    pub fn set_scene(&mut self, scene: &Arc<SceneSet>, materials: &MaterialSets) {
        self.scene = Some(Arc::clone(scene));
        self.materials = Some(Arc::clone(materials));
    }

    /// How loops run on the device of the scene that was set.
    pub fn loops(&self) -> Loops {
        self.scene
            .as_ref()
            .map_or(Loops::LLVMPIPE, |scene| scene.loops())
    }

    /// The compute passes that `add` adds run only if the buffer's first word is not 0 by then.
    /// Transfers among them run always. The device needs
    /// [`crate::vulkan::Features::conditional_rendering`].
    pub fn only_if(&mut self, word: &Arc<Buffer>, add: impl FnOnce(&mut Frame)) {
        let outer = self.condition.replace(Arc::clone(word));
        assert!(outer.is_none(), "condition {}: inside another", word.name());
        add(self);
        self.condition = None;
    }

    /// Starts a pass; it is added by one of the builder's last words (`dispatch`, `draw`, …).
    pub fn pass(&mut self, pass: &'static Pass) -> PassBuilder<'_> {
        PassBuilder::new(self, pass)
    }

    /// Sets every word of a buffer.
    pub fn fill(&mut self, name: impl Into<String>, buffer: &Arc<Buffer>, value: u32) {
        self.fill_from(name, buffer, 0, value);
    }

    /// Sets every word of a buffer from one of its bytes on, which is the first of a word.
    pub fn fill_from(
        &mut self,
        name: impl Into<String>,
        buffer: &Arc<Buffer>,
        first_byte: u64,
        value: u32,
    ) {
        assert!(
            first_byte.is_multiple_of(4) && first_byte < buffer.size_bytes(),
            "byte {first_byte} is none of a word of buffer {}",
            buffer.name()
        );
        let resource = Resource::from(buffer);
        let used = resource.used(Access::TransferWrite);
        self.push(
            name.into(),
            vec![(resource, used)],
            Work::Fill(Arc::clone(buffer), first_byte, value),
        );
    }

    /// Sets every texel of every mip and layer of a colour image.
    pub fn clear_image(
        &mut self,
        name: impl Into<String>,
        image: &Arc<Image>,
        value: impl Into<ClearValue>,
    ) {
        self.clear_mips(name, image, 0..image.mips(), value);
    }

    /// Sets every texel of some mips of a colour image, in all layers.
    pub fn clear_mips(
        &mut self,
        name: impl Into<String>,
        image: &Arc<Image>,
        mips: Range<u32>,
        value: impl Into<ClearValue>,
    ) {
        assert!(
            mips.start < mips.end && mips.end <= image.mips(),
            "image {} has no mips {mips:?}",
            image.name()
        );
        assert_eq!(
            image.aspect(),
            vk::ImageAspectFlags::COLOR,
            "image {}: depth is cleared by rendering",
            image.name()
        );
        let resource = Resource::Image(Arc::clone(image), mips.clone());
        let used = resource.used(Access::TransferWrite);
        self.push(
            name.into(),
            vec![(resource, used)],
            Work::Clear(Arc::clone(image), mips, value.into()),
        );
    }

    /// Filters mip 0 into all smaller mips, linearly; each mip waits for the one before it.
    pub fn blit_mips(&mut self, name: impl Into<String>, image: &Arc<Image>) {
        let name = name.into();
        for source in 0..image.mips().saturating_sub(1) {
            let read = Resource::Image(Arc::clone(image), source..source + 1);
            let written = Resource::Image(Arc::clone(image), source + 1..source + 2);
            let uses = vec![
                (read.clone(), read.used(Access::TransferRead)),
                (written.clone(), written.used(Access::TransferWrite)),
            ];
            self.push(name.clone(), uses, Work::BlitMip(Arc::clone(image), source));
        }
    }

    /// Copies the finest mip of an image to another of one layer and mip, in its format and size.
    pub fn blit(&mut self, name: impl Into<String>, source: &Arc<Image>, target: &Arc<Image>) {
        let (read, written) = (
            Resource::Image(Arc::clone(source), 0..1),
            Resource::Image(Arc::clone(target), 0..1),
        );
        let uses = vec![
            (read.clone(), read.used(Access::TransferRead)),
            (written.clone(), written.used(Access::TransferWrite)),
        ];
        let work = Work::Blit(Arc::clone(source), Arc::clone(target));
        self.push(name.into(), uses, work);
    }

    /// Copies a range of bytes from one buffer to another.
    pub fn copy_buffer(
        &mut self,
        name: impl Into<String>,
        (source, source_offset): (&Arc<Buffer>, u64),
        (target, target_offset): (&Arc<Buffer>, u64),
        size_bytes: u64,
    ) {
        let name = name.into();
        assert!(
            source.id() != target.id(),
            "{name}: source and target are the same buffer {}",
            source.name()
        );
        for (buffer, offset) in [(source, source_offset), (target, target_offset)] {
            let end = offset.checked_add(size_bytes);
            assert!(
                end.is_some_and(|end| end <= buffer.size_bytes()),
                "{name}: {size_bytes} bytes at {offset} are outside buffer {}",
                buffer.name()
            );
        }
        let (read, written) = (Resource::from(source), Resource::from(target));
        let uses = vec![
            (read.clone(), read.used(Access::TransferRead)),
            (written.clone(), written.used(Access::TransferWrite)),
        ];
        let work = Work::CopyBuffer {
            source: (Arc::clone(source), source_offset),
            target: (Arc::clone(target), target_offset),
            size: size_bytes,
        };
        self.push(name, uses, work);
    }

    /// Names of the steps in order.
    pub fn names(&self) -> Vec<&str> {
        self.steps.iter().map(|step| step.name.as_str()).collect()
    }

    /// What each step uses, as the planner is given it.
    pub fn uses(&self) -> Vec<Vec<Use>> {
        self.steps
            .iter()
            .map(|step| step.uses.iter().map(|(_, used)| *used).collect())
            .collect()
    }

    /// Copies as much of a buffer, from a byte on, as there is room for in one that the host reads.
    pub(super) fn copy_for_host(
        &mut self,
        buffer: &Arc<Buffer>,
        first_byte: u64,
        staging: &Arc<Buffer>,
    ) {
        let name = format!("read {}", buffer.name());
        let size = staging.size_bytes();
        self.copy_buffer(name, (buffer, first_byte), (staging, 0), size);
        self.steps
            .last_mut()
            .into_iter()
            .for_each(|step| step.is_told = false);
    }

    /// Its steps, of which no cost is told.
    pub(super) fn into_untold(self) -> impl Iterator<Item = Step> {
        self.steps.into_iter().map(|step| Step {
            is_told: false,
            ..step
        })
    }

    /// As [`Frame::push`], of what only carries bytes for the host.
    pub(super) fn push_untold(&mut self, name: String, uses: Vec<(Resource, Use)>, work: Work) {
        self.push(name, uses, work);
        self.steps
            .last_mut()
            .into_iter()
            .for_each(|step| step.is_told = false);
    }

    /// From here on all passes can sample images, and so can what others submit later.
    pub fn ready(&mut self, images: &[&Arc<Image>]) {
        for image in images {
            let resource = Resource::from(*image);
            let uses = [Access::ComputeSampled, Access::RasterSampled]
                .map(|access| (resource.clone(), resource.used(access)));
            let name = format!("ready {}", image.name());
            self.push_untold(name, uses.to_vec(), Work::Nothing);
        }
    }

    /// Bytes to the start of a buffer, at most [`SET_BYTES`] and whole words, which the commands
    /// themselves hold.
    pub(super) fn set(&mut self, name: String, buffer: &Arc<Buffer>, bytes: &[u8]) {
        assert!(
            bytes.len() <= SET_BYTES && bytes.len().is_multiple_of(4),
            "buffer {}: {} bytes",
            buffer.name(),
            bytes.len()
        );
        let resource = Resource::from(buffer);
        let used = resource.used(Access::TransferWrite);
        let work = Work::Set(Arc::clone(buffer), bytes.to_vec());
        self.push_untold(name, vec![(resource, used)], work);
    }

    pub(super) fn push(&mut self, name: String, uses: Vec<(Resource, Use)>, work: Work) {
        for (resource, used) in &uses {
            if let Resource::Image(image, mips) = resource {
                assert!(
                    mips.start < mips.end && mips.end <= image.mips(),
                    "{name}: image {} has no mips {mips:?}",
                    image.name()
                );
                assert!(
                    !(image.is_frozen() && used.access.sync().writes),
                    "{name}: image {} belongs to a material and is only read",
                    image.name()
                );
            }
        }
        self.steps.push(Step {
            name,
            uses,
            work,
            is_told: true,
        });
    }

    /// The shared sets that a pass uses; asserts that they were given.
    pub(super) fn sets_for(&self, pass: &Pass) -> (Option<Arc<SceneSet>>, Option<MaterialSets>) {
        let scene = (pass.sets != Sets::None)
            .then(|| self.scene.clone())
            .flatten();
        let materials = (pass.sets == Sets::SceneAndMaterials)
            .then(|| self.materials.clone())
            .flatten();
        assert!(
            pass.sets == Sets::None || scene.is_some(),
            "pass {}: uses set 0, but the frame has no scene",
            pass.name
        );
        (scene, materials)
    }

    /// Values of [`super::SCENE_CONSTANTS`], where it has a scene.
    pub(super) fn scene_has(&self) -> Option<[bool; SCENE_CONSTANTS.len()]> {
        self.scene.as_ref().map(|scene| scene.has)
    }
}
