//! Adding one pass to a frame: bindings, constants, parameters, and what to run.

use std::sync::Arc;

use ash::vk;

use super::frame::{Frame, Resource, Work};
use super::pass::{BindingKind, Pass, SCENE_CONSTANTS, Sets, Shaders};
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
    /// Keep what is there.
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
    /// Width and height of a larger viewport with that extent in its middle (px), so that
    /// triangles that reach beyond the extent are not cut there, which would round their edges
    /// anew; at most 4096, which every device has.
    pub viewport: Option<u32>,
}

impl Targets<'_> {
    /// No attachments: a pass that only writes storage.
    pub const fn none(extent: [u32; 2]) -> Self {
        Targets {
            color: &[],
            depth: None,
            extent,
            viewport: None,
        }
    }
}

/// One draw of a raster pass, without vertex buffers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DrawBatch {
    /// Which material set to bind; ignored by passes that use none.
    pub material: u32,
    /// Push constants of this draw; empty to use the pass's.
    pub push: Vec<u8>,
    /// First vertex, or the first index where there are indices.
    pub first_vertex: u32,
    /// Number of vertices, three for each triangle.
    pub vertex_count: u32,
    /// Corner, width and height of the part of the targets that it is drawn in (px), where that is
    /// not all of what the pass draws in.
    pub tile: Option<[u32; 4]>,
}

/// One dispatch of a compute pass.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BatchDispatch {
    /// Which material set to bind; ignored by passes that use none.
    pub material: u32,
    /// Push constants of this dispatch; empty to use the pass's.
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
    /// Each after the one before has finished.
    Chain(Vec<BatchDispatch>),
    Indirect(Arc<Buffer>, u64),
    Draw {
        color: Vec<Target>,
        depth: Option<Target>,
        extent: [u32; 2],
        viewport: Option<u32>,
        /// 32-bit numbers of vertices, which batches are then ranges of.
        indices: Option<Arc<Buffer>>,
        batches: Vec<DrawBatch>,
    },
}

/// A pass with everything that it needs to run once.
pub(super) struct PassCall {
    pub(super) pass: &'static Pass,
    pub(super) resources: Vec<Resource>,
    pub(super) constants: Vec<u32>,
    /// Values of [`super::SCENE_CONSTANTS`], where the frame has a scene.
    pub(super) scene_has: Option<[bool; SCENE_CONSTANTS.len()]>,
    pub(super) push: Vec<u8>,
    pub(super) scene: Option<Arc<SceneSet>>,
    pub(super) materials: Option<MaterialSets>,
    pub(super) run: Run,
    /// Runs only if its first word is not 0.
    pub(super) condition: Option<Arc<Buffer>>,
}

impl PassCall {
    /// Whether the device traces its rays.
    pub(super) fn queries(&self) -> bool {
        let mut resources = self.resources.iter();
        resources.any(|resource| matches!(resource, Resource::Structure(_)))
    }
}

/// A pass being added to a frame. Bindings and constants are given by name, in any order, and each
/// of the declaration once.
#[must_use = "a pass runs only when one of dispatch, dispatch_indirect, dispatch_batches, \
              dispatch_chain, draw or draw_indexed is called"]
pub struct PassBuilder<'f> {
    frame: &'f mut Frame,
    pass: &'static Pass,
    /// In the order in which the pass declares its bindings; `None` until one is bound.
    resources: Vec<Option<Resource>>,
    /// In the order in which the pass declares its constants; `None` until one is set.
    constants: Vec<Option<u32>>,
    push: Vec<u8>,
}

impl<'f> PassBuilder<'f> {
    pub(super) fn new(frame: &'f mut Frame, pass: &'static Pass) -> Self {
        PassBuilder {
            frame,
            pass,
            resources: vec![None; pass.bindings.len()],
            constants: vec![None; pass.constants.len()],
            push: Vec::new(),
        }
    }

    /// Binds a buffer, or an image: all mips where it is sampled, mip 0 where it is stored to or
    /// loaded from.
    pub fn bind(self, name: &str, resource: impl Into<Resource>) -> Self {
        let is_storage_image = self
            .pass
            .bindings
            .iter()
            .any(|binding| binding.name == name && binding.kind == BindingKind::Image);
        match resource.into() {
            Resource::Image(image, _) if is_storage_image => {
                self.add(name, Resource::Image(image, 0..1))
            }
            resource => self.add(name, resource),
        }
    }

    /// Binds one mip of an image.
    pub fn bind_mip(self, name: &str, image: &Arc<Image>, mip: u32) -> Self {
        self.add(name, Resource::Image(Arc::clone(image), mip..mip + 1))
    }

    /// Sets a specialization constant.
    pub fn constant(mut self, name: &str, value: impl Into<u32>) -> Self {
        let names = self.pass.constants.iter().copied();
        if let Some(place) = place(self.pass, names, name, &self.constants) {
            self.constants[place] = Some(value.into());
        }
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

    /// Runs several dispatches, each after the one before has finished: it reads what that wrote to
    /// storage.
    pub fn dispatch_chain(self, batches: Vec<BatchDispatch>) {
        self.check_compute();
        self.finish(Run::Chain(batches), Vec::new());
    }

    /// Draws triangles by vertex index, all in one rendering scope.
    pub fn draw(self, targets: Targets<'_>, batches: Vec<DrawBatch>) {
        self.draw_by(targets, None, batches);
    }

    /// The same of the vertices that a buffer of 32-bit indices names.
    pub fn draw_indexed(
        self,
        targets: Targets<'_>,
        indices: &Arc<Buffer>,
        batches: Vec<DrawBatch>,
    ) {
        self.draw_by(targets, Some(indices), batches);
    }

    fn draw_by(self, targets: Targets<'_>, indices: Option<&Arc<Buffer>>, batches: Vec<DrawBatch>) {
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
        let mut uses: Vec<_> = access
            .map(|(target, access)| target.used(name, targets.extent, access))
            .collect();
        uses.extend(indices.map(|buffer| {
            let resource = Resource::from(buffer);
            let used = resource.used(Access::IndexRead);
            (resource, used)
        }));
        self.finish(
            Run::Draw {
                color,
                depth,
                extent: targets.extent,
                viewport: targets.viewport,
                indices: indices.map(Arc::clone),
                batches,
            },
            uses,
        );
    }

    fn add(mut self, name: &str, resource: Resource) -> Self {
        let names = self.pass.bindings.iter().map(|binding| binding.name);
        let Some(place) = place(self.pass, names, name, &self.resources) else {
            return self;
        };
        let binding = &self.pass.bindings[place];
        let fits = match (&resource, binding.kind) {
            (Resource::Buffer(_), BindingKind::Buffer)
            | (Resource::Image(..), BindingKind::Sampled | BindingKind::Rays)
            | (Resource::Structure(_), BindingKind::Rays) => true,
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
        self.resources[place] = Some(resource);
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
        let names = pass.bindings.iter().map(|binding| binding.name);
        check_complete(pass, names, &resources);
        check_complete(pass, pass.constants.iter().copied(), &constants);
        let resources: Vec<Resource> = resources.into_iter().flatten().collect();
        let constants = constants.into_iter().map(Option::unwrap_or_default);
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
            .flat_map(|(resource, binding)| resource.bound(binding));
        let mut uses: Vec<(Resource, Use)> = bound.chain(more_uses).collect();
        let of_scene = scene.iter().flat_map(|scene| scene.read_by(pass));
        uses.extend(of_scene.map(|(buffer, access)| {
            let resource = Resource::from(buffer);
            let used = resource.used(access);
            (resource, used)
        }));
        let condition = frame.condition.clone();
        if let Some(word) = &condition {
            // The clears of attachments would take place all the same.
            assert!(
                pass.is_compute(),
                "pass {}: it draws, and has a condition",
                pass.name
            );
            let resource = Resource::from(word);
            let used = resource.used(Access::ConditionRead);
            uses.push((resource, used));
        }
        let call = PassCall {
            pass,
            resources,
            constants: constants.collect(),
            scene_has: frame.scene_has(),
            push,
            scene,
            materials,
            run,
            condition,
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

/// Where a pass declares a name; refuses one that it does not have, or that was given before.
fn place<T>(
    pass: &Pass,
    names: impl Iterator<Item = &'static str> + Clone,
    name: &str,
    given: &[Option<T>],
) -> Option<usize> {
    let place = names
        .clone()
        .position(|known| known == name && !name.is_empty());
    assert!(
        place.is_some(),
        "pass {}: it has no {name}; it has {:?}",
        pass.name,
        names.collect::<Vec<_>>()
    );
    assert!(
        place.is_none_or(|place| given[place].is_none()),
        "pass {}: {name} is given twice",
        pass.name
    );
    place
}

/// Refuses a pass that lacks something it declares.
fn check_complete<T>(pass: &Pass, names: impl Iterator<Item = &'static str>, given: &[Option<T>]) {
    for (name, given) in names.zip(given) {
        assert!(
            given.is_some() || name.is_empty(),
            "pass {}: {name} is not given",
            pass.name
        );
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
            bytes,
            pass.push_bytes(),
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
        Run::Dispatch(batches) | Run::Chain(batches) => batches
            .iter()
            .for_each(|batch| check(batch.material, &batch.push)),
        Run::Indirect(..) => check(0, &[]),
        Run::Draw { batches, .. } => batches
            .iter()
            .for_each(|batch| check(batch.material, &batch.push)),
    }
}
