//! Adding one pass to a frame: bindings, constants, parameters, and what to run.

use std::sync::Arc;

use ash::vk;

use super::frame::{Frame, Resource, Work};
use super::pass::{BindingKind, Pass, Sets, Shaders};
use super::plan::{Span, Use};
use super::sets::{MaterialSets, SceneSet};
use super::{Access, ClearValue};
use crate::vulkan::{Buffer, Image};

/// What to do with an attachment's contents before rendering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClearOrLoad {
    /// Clear; for depth, the first number.
    Clear([f32; 4]),
    /// Clear an unsigned integer format.
    ClearUint(u32),
    /// Keep.
    Load,
}

impl ClearOrLoad {
    fn value(self) -> Option<ClearValue> {
        match self {
            ClearOrLoad::Clear(value) => Some(ClearValue::Float(value)),
            ClearOrLoad::ClearUint(value) => Some(ClearValue::Uint(value)),
            ClearOrLoad::Load => None,
        }
    }
}

/// Where a raster pass draws.
#[derive(Clone, Copy)]
pub struct Targets<'t> {
    /// Colour attachments: image, mip, layer, and what to do with the contents.
    pub color: &'t [(&'t Arc<Image>, u32, u32, ClearOrLoad)],
    /// Depth attachment: image, layer, and what to do with the contents.
    pub depth: Option<(&'t Arc<Image>, u32, ClearOrLoad)>,
    /// Width and height of viewport and scissor (px).
    pub extent: [u32; 2],
}

impl Targets<'_> {
    /// No attachments: a pass that only writes storage.
    pub const fn none(extent: [u32; 2]) -> Self {
        Targets {
            color: &[],
            depth: None,
            extent,
        }
    }
}

/// One draw of a raster pass, without vertex buffers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DrawBatch {
    /// Which material set to bind; ignored by passes that use none.
    pub material: u32,
    /// Push constants of this draw; empty for those of the pass.
    pub push: Vec<u8>,
    /// First vertex index.
    pub first_vertex: u32,
    /// Number of vertices, three for each triangle.
    pub vertex_count: u32,
}

/// One dispatch of a compute pass.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BatchDispatch {
    /// Which material set to bind; ignored by passes that use none.
    pub material: u32,
    /// Push constants of this dispatch; empty for those of the pass.
    pub push: Vec<u8>,
    /// Number of workgroups.
    pub groups: [u32; 3],
}

/// One attachment, kept alive.
pub(super) struct Target {
    pub(super) image: Arc<Image>,
    pub(super) mip: u32,
    pub(super) layer: u32,
    pub(super) clear: Option<ClearValue>,
}

/// What a pass runs.
pub(super) enum Run {
    Dispatch(Vec<BatchDispatch>),
    Indirect(Arc<Buffer>, u64),
    Draw {
        color: Vec<Target>,
        depth: Option<Target>,
        extent: [u32; 2],
        batches: Vec<DrawBatch>,
    },
}

/// A pass with everything that it needs to run once.
pub(super) struct PassCall {
    pub(super) pass: &'static Pass,
    pub(super) resources: Vec<Resource>,
    pub(super) constants: Vec<u32>,
    pub(super) push: Vec<u8>,
    pub(super) scene: Option<Arc<SceneSet>>,
    pub(super) materials: Option<MaterialSets>,
    pub(super) run: Run,
}

/// A pass being added to a frame. Bindings come in the order of the declaration.
#[must_use = "a pass runs only when one of dispatch, dispatch_indirect, dispatch_batches or draw \
              is called"]
pub struct PassBuilder<'f> {
    frame: &'f mut Frame,
    pass: &'static Pass,
    resources: Vec<Resource>,
    constants: Vec<u32>,
    push: Vec<u8>,
}

impl<'f> PassBuilder<'f> {
    pub(super) fn new(frame: &'f mut Frame, pass: &'static Pass) -> Self {
        PassBuilder {
            frame,
            pass,
            resources: Vec::new(),
            constants: Vec::new(),
            push: Vec::new(),
        }
    }

    /// Binds a buffer, or an image: all mips where it is sampled, mip 0 where it is stored to or
    /// loaded from.
    pub fn bind(self, resource: impl Into<Resource>) -> Self {
        let is_storage_image = self
            .pass
            .bindings
            .get(self.resources.len())
            .is_some_and(|binding| binding.kind == BindingKind::Image);
        match resource.into() {
            Resource::Image(image, _) if is_storage_image => self.add(Resource::Image(image, 0..1)),
            resource => self.add(resource),
        }
    }

    /// Binds one mip of an image.
    pub fn bind_mip(self, image: &Arc<Image>, mip: u32) -> Self {
        self.add(Resource::Image(Arc::clone(image), mip..mip + 1))
    }

    /// Binds a range of mips of a sampled image.
    pub fn bind_mips(self, image: &Arc<Image>, mips: std::ops::Range<u32>) -> Self {
        self.add(Resource::Image(Arc::clone(image), mips))
    }

    /// Specialization constants 0, 1, 2, …
    pub fn constants(mut self, values: &[u32]) -> Self {
        self.constants = values.to_vec();
        self
    }

    /// Push constants.
    pub fn push<T: bytemuck::Pod>(mut self, params: &T) -> Self {
        self.push = bytemuck::bytes_of(params).to_vec();
        self
    }

    /// Runs the pass on this many workgroups.
    pub fn dispatch(self, groups: [u32; 3]) {
        assert!(
            self.pass.sets != Sets::SceneAndMaterials,
            "pass {}: uses materials, so it needs dispatch_batches",
            self.pass.name
        );
        self.check_compute();
        self.finish(
            Run::Dispatch(vec![BatchDispatch {
                groups,
                ..Default::default()
            }]),
            Vec::new(),
        );
    }

    /// Runs the pass on as many workgroups as three words in a buffer say.
    pub fn dispatch_indirect(self, buffer: &Arc<Buffer>, offset: u64) {
        assert!(
            self.pass.sets != Sets::SceneAndMaterials,
            "pass {}: uses materials, so it needs dispatch_batches",
            self.pass.name
        );
        assert!(
            offset.is_multiple_of(4) && offset + 12 <= buffer.size_bytes(),
            "pass {}: no arguments at {offset} in {}",
            self.pass.name,
            buffer.name()
        );
        self.check_compute();
        let resource = Resource::from(buffer);
        let used = resource.used(Access::IndirectRead);
        self.finish(
            Run::Indirect(Arc::clone(buffer), offset),
            vec![(resource, used)],
        );
    }

    /// Runs several dispatches, which may overlap, with one material each.
    pub fn dispatch_batches(self, batches: Vec<BatchDispatch>) {
        self.check_compute();
        self.finish(Run::Dispatch(batches), Vec::new());
    }

    /// Draws triangles by vertex index, all in one rendering scope.
    pub fn draw(self, targets: Targets<'_>, batches: Vec<DrawBatch>) {
        let name = self.pass.name;
        let Shaders::Raster { state, .. } = &self.pass.shaders else {
            assert!(
                !self.pass.is_compute(),
                "pass {name}: a compute pass cannot draw"
            );
            return;
        };
        let formats = |image: &&(&Arc<Image>, u32, u32, ClearOrLoad)| image.0.desc().format;
        assert!(
            targets
                .color
                .iter()
                .map(|image| formats(&image))
                .eq(state.color.iter().copied()),
            "pass {name}: colour targets are not as declared"
        );
        assert_eq!(
            targets.depth.map(|(image, ..)| image.desc().format),
            state.depth,
            "pass {name}: the depth target is not as declared"
        );
        let target = |image: &Arc<Image>, mip, layer, contents: ClearOrLoad| Target {
            image: Arc::clone(image),
            mip,
            layer,
            clear: contents.value(),
        };
        let color: Vec<Target> = targets
            .color
            .iter()
            .map(|&(image, mip, layer, contents)| target(image, mip, layer, contents))
            .collect();
        let depth = targets
            .depth
            .map(|(image, layer, contents)| target(image, 0, layer, contents));
        let access = color
            .iter()
            .map(|target| (target, Access::ColorTarget))
            .chain(depth.iter().map(|target| (target, Access::DepthTarget)));
        let uses = access
            .map(|(target, access)| target.used(name, targets.extent, access))
            .collect();
        self.finish(
            Run::Draw {
                color,
                depth,
                extent: targets.extent,
                batches,
            },
            uses,
        );
    }

    fn add(mut self, resource: Resource) -> Self {
        let index = self.resources.len();
        let Some(binding) = self.pass.bindings.get(index) else {
            assert!(
                index < self.pass.bindings.len(),
                "pass {}: {} is one binding too many",
                self.pass.name,
                resource.name()
            );
            return self;
        };
        let fits = match (&resource, binding.kind) {
            (Resource::Buffer(_), BindingKind::Buffer)
            | (Resource::Image(..), BindingKind::Sampled) => true,
            (Resource::Image(_, mips), BindingKind::Image) => mips.end - mips.start == 1,
            _ => false,
        };
        assert!(
            fits,
            "pass {}: {} cannot be bound as {} ({:?})",
            self.pass.name,
            resource.name(),
            binding.name,
            binding.kind
        );
        self.resources.push(resource);
        self
    }

    fn check_compute(&self) {
        assert!(
            self.pass.is_compute(),
            "pass {}: a raster pass cannot be dispatched",
            self.pass.name
        );
    }

    fn finish(self, run: Run, more_uses: Vec<(Resource, Use)>) {
        let PassBuilder {
            frame,
            pass,
            resources,
            constants,
            push,
        } = self;
        assert_eq!(
            resources.len(),
            pass.bindings.len(),
            "pass {}: number of bindings",
            pass.name
        );
        let (scene, materials) = frame.sets_for(pass);
        check_batches(
            pass,
            &push,
            &run,
            materials.as_deref().map_or(0, |materials| materials.len()),
        );
        let bound = resources
            .iter()
            .zip(pass.bindings)
            .map(|(resource, binding)| (resource.clone(), resource.used(binding.access)));
        let mut uses: Vec<(Resource, Use)> = bound.chain(more_uses).collect();
        let access = if pass.is_compute() {
            Access::ComputeRead
        } else {
            Access::RasterRead
        };
        for buffer in scene.iter().flat_map(|scene| &scene.storage) {
            let resource = Resource::from(buffer);
            let used = resource.used(access);
            uses.push((resource, used));
        }
        let call = PassCall {
            pass,
            resources,
            constants,
            push,
            scene,
            materials,
            run,
        };
        frame.push(pass.name.to_owned(), uses, Work::Pass(Box::new(call)));
    }
}

impl Target {
    fn used(&self, pass: &str, [width, height]: [u32; 2], access: Access) -> (Resource, Use) {
        let image = &self.image;
        assert!(
            self.mip < image.mips() && self.layer < image.desc().layers,
            "pass {pass}: {} has no such mip and layer",
            image.name()
        );
        let [available_width, available_height, _] = image.extent(self.mip);
        assert!(
            width <= available_width && height <= available_height,
            "pass {pass}: {} is smaller than {width}x{height}",
            image.name()
        );
        let resource = Resource::Image(Arc::clone(image), self.mip..self.mip + 1);
        (
            resource,
            Use::image(
                image.id(),
                Span::one(self.mip),
                Span::one(self.layer),
                access,
            ),
        )
    }

    pub(super) fn clear_value(&self) -> Option<vk::ClearValue> {
        let depth = self.image.aspect() == vk::ImageAspectFlags::DEPTH;
        self.clear.map(|value| match value {
            ClearValue::Float([first, ..]) if depth => vk::ClearValue {
                depth_stencil: vk::ClearDepthStencilValue {
                    depth: first,
                    stencil: 0,
                },
            },
            value => vk::ClearValue { color: value.raw() },
        })
    }
}

impl ClearValue {
    pub(super) fn raw(self) -> vk::ClearColorValue {
        match self {
            ClearValue::Float(float32) => vk::ClearColorValue { float32 },
            ClearValue::Uint(value) => vk::ClearColorValue { uint32: [value; 4] },
        }
    }
}

fn check_batches(pass: &Pass, push: &[u8], run: &Run, materials: usize) {
    let check = |material: u32, own: &[u8]| {
        let bytes = if own.is_empty() {
            push.len()
        } else {
            own.len()
        };
        assert_eq!(
            bytes, pass.push_bytes as usize,
            "pass {}: bytes of push constants",
            pass.name
        );
        assert!(
            pass.sets != Sets::SceneAndMaterials || (material as usize) < materials,
            "pass {}: no material {material}",
            pass.name
        );
    };
    match run {
        Run::Dispatch(batches) => batches
            .iter()
            .for_each(|batch| check(batch.material, &batch.push)),
        Run::Indirect(..) => check(0, &[]),
        Run::Draw { batches, .. } => batches
            .iter()
            .for_each(|batch| check(batch.material, &batch.push)),
    }
}
