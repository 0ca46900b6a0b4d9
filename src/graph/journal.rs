//! What was recorded, for tests that replay it: read back from the structs, descriptors and
//! resources that Vulkan was given, never from the plan.

use std::sync::Arc;

use ash::vk;

use super::access::Access;
use super::frame::{Resource, Work};
use super::pass::Pass;
use super::plan::{Scope, Span, Use};
use super::sets::MATERIAL_TEXTURES;
use crate::vulkan::{AccelerationStructure, Attachment, Buffer, Descriptor, Image, ImageRegion};

/// A frame as its steps were declared, and what was recorded for it.
#[doc(hidden)]
#[derive(Clone, Debug, Default)]
pub struct JournalFrame {
    /// Name of each step.
    pub names: Vec<String>,
    /// What each step says that it uses.
    pub uses: Vec<Vec<Use>>,
    /// Barriers and steps, in the order in which they were recorded.
    pub issued: Vec<Issued>,
}

/// One barrier, or the commands of one step.
#[doc(hidden)]
#[derive(Clone, Debug)]
pub enum Issued {
    /// A barrier on a buffer or an image.
    Barrier(IssuedBarrier),
    /// No command: the step stands for the host, or for later passes, that use its resources.
    Nothing,
    /// A copy, blit, fill, clear or build.
    Transfer(Vec<Touch>),
    /// A dispatch or a draw.
    Pass {
        /// The pass as it was declared.
        pass: &'static Pass,
        /// What descriptors, attachments and arguments let it reach.
        touched: Vec<Touch>,
        /// The textures of its materials, which no step uses: they were made ready once, and are
        /// only read.
        materials: Vec<Touch>,
    },
}

/// What `vkCmdPipelineBarrier2` was given.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IssuedBarrier {
    /// Identity of the resource.
    pub resource: u64,
    /// Mips; `Span::one(0)` for a whole buffer, nothing for less of one, which the planner never
    /// asks for.
    pub mips: Span,
    /// Layers; `Span::one(0)` for buffers.
    pub layers: Span,
    /// What has to be over.
    pub src: Scope,
    /// What has to wait.
    pub dst: Scope,
    /// Layout that the image is in before; `UNDEFINED` for buffers.
    pub old_layout: vk::ImageLayout,
    /// Layout that the image gets; `UNDEFINED` for buffers.
    pub new_layout: vk::ImageLayout,
}

/// A part of a resource that commands reach.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Touch {
    /// The part, and how.
    pub used: Use,
    /// The layout that the command was told; `UNDEFINED` for buffers.
    pub layout: vk::ImageLayout,
}

impl IssuedBarrier {
    /// What a barrier on a buffer asks for.
    #[doc(hidden)]
    pub fn of_buffer(resource: u64, barrier: &vk::BufferMemoryBarrier2<'_>) -> Self {
        let is_whole = barrier.offset == 0 && barrier.size == vk::WHOLE_SIZE;
        IssuedBarrier {
            resource,
            mips: Span {
                first: 0,
                count: u32::from(is_whole),
            },
            layers: Span::one(0),
            src: Scope {
                stage: barrier.src_stage_mask,
                access: barrier.src_access_mask,
            },
            dst: Scope {
                stage: barrier.dst_stage_mask,
                access: barrier.dst_access_mask,
            },
            old_layout: vk::ImageLayout::UNDEFINED,
            new_layout: vk::ImageLayout::UNDEFINED,
        }
    }

    /// What a barrier on an image asks for.
    #[doc(hidden)]
    pub fn of_image(resource: u64, barrier: &vk::ImageMemoryBarrier2<'_>) -> Self {
        let range = barrier.subresource_range;
        IssuedBarrier {
            resource,
            mips: Span {
                first: range.base_mip_level,
                count: range.level_count,
            },
            layers: Span {
                first: range.base_array_layer,
                count: range.layer_count,
            },
            src: Scope {
                stage: barrier.src_stage_mask,
                access: barrier.src_access_mask,
            },
            dst: Scope {
                stage: barrier.dst_stage_mask,
                access: barrier.dst_access_mask,
            },
            old_layout: barrier.old_layout,
            new_layout: barrier.new_layout,
        }
    }
}

impl Touch {
    pub(super) fn buffer(buffer: &Buffer, access: Access) -> Self {
        Touch {
            used: Use::buffer(buffer.id(), access),
            layout: vk::ImageLayout::UNDEFINED,
        }
    }

    /// What a view shows; `None` where it is no view of this image.
    fn view(
        image: &Image,
        view: vk::ImageView,
        access: Access,
        layout: vk::ImageLayout,
    ) -> Option<Self> {
        let (mips, layers) = image.shown_by(view)?;
        let span = |range: std::ops::Range<u32>| Span {
            first: range.start,
            count: range.end - range.start,
        };
        Some(Touch {
            used: Use::image(image.id(), span(mips), span(layers), access),
            layout,
        })
    }

    /// What a descriptor shows, and what can be reached from there; nothing where it shows another
    /// resource.
    pub(super) fn descriptor(
        resource: &Resource,
        descriptor: &Descriptor,
        access: Access,
    ) -> Vec<Self> {
        match (resource, descriptor) {
            (Resource::Buffer(buffer), Descriptor::Buffer(raw)) if buffer.raw() == *raw => {
                vec![Touch::buffer(buffer, access)]
            }
            (Resource::Image(image, _), Descriptor::Image(view, layout)) => {
                Touch::view(image, *view, access, *layout)
                    .into_iter()
                    .collect()
            }
            (Resource::Structure(structure), Descriptor::Structure(raw))
                if structure.raw() == *raw =>
            {
                [structure]
                    .into_iter()
                    .chain(structure.parts())
                    .map(|part| Touch::buffer(part.buffer(), Access::ComputeTraced))
                    .collect()
            }
            _ => Vec::new(),
        }
    }

    pub(super) fn attachment(
        image: &Image,
        attachment: &Attachment,
        access: Access,
    ) -> Option<Self> {
        Touch::view(image, attachment.view, access, attachment.layout)
    }

    /// The textures of one material, in the layout that its descriptors name.
    pub(super) fn material(
        images: &[Arc<Image>; MATERIAL_TEXTURES],
        access: Access,
    ) -> [Self; MATERIAL_TEXTURES] {
        images.each_ref().map(|image| Touch {
            used: Resource::from(image).used(access),
            layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        })
    }

    /// Some mips and all layers, by a transfer.
    fn mips(
        image: &Arc<Image>,
        mips: std::ops::Range<u32>,
        access: Access,
        layout: vk::ImageLayout,
    ) -> Self {
        Touch {
            used: Resource::Image(Arc::clone(image), mips).used(access),
            layout,
        }
    }

    fn region(image: &Image, region: ImageRegion, access: Access, layout: vk::ImageLayout) -> Self {
        Touch {
            used: Use::image(
                image.id(),
                Span::one(region.mip),
                Span::one(region.layer),
                access,
            ),
            layout,
        }
    }
}

impl Issued {
    /// What the command of a step reaches; a pass knows only what it is while it is recorded.
    pub(super) fn transfer(work: &Work) -> Option<Self> {
        use vk::ImageLayout as L;
        let (read, write) = (Access::TransferRead, Access::TransferWrite);
        let (source_layout, target_layout) = (L::TRANSFER_SRC_OPTIMAL, L::TRANSFER_DST_OPTIMAL);
        Some(Issued::Transfer(match work {
            Work::Nothing => return Some(Issued::Nothing),
            Work::Pass(_) => return None,
            Work::Fill(buffer, ..) | Work::Set(buffer, _) => vec![Touch::buffer(buffer, write)],
            Work::Clear(image, mips, _) => {
                vec![Touch::mips(image, mips.clone(), write, target_layout)]
            }
            Work::BlitMip(image, source) => {
                let target = source + 1;
                vec![
                    Touch::mips(image, *source..target, read, source_layout),
                    Touch::mips(image, target..target + 1, write, target_layout),
                ]
            }
            Work::Blit(source, target) => vec![
                Touch::mips(source, 0..1, read, source_layout),
                Touch::mips(target, 0..1, write, target_layout),
            ],
            Work::CopyBuffer { size: 0, .. } => Vec::new(),
            Work::CopyBuffer { source, target, .. } => vec![
                Touch::buffer(&source.0, read),
                Touch::buffer(&target.0, write),
            ],
            Work::ToImage {
                source,
                target,
                region,
            } => vec![
                Touch::buffer(source, read),
                Touch::region(target, *region, write, target_layout),
            ],
            Work::FromImage {
                source,
                region,
                target,
            } => vec![
                Touch::region(source, *region, read, source_layout),
                Touch::buffer(target, write),
            ],
            Work::Build {
                structure,
                input,
                scratch,
                ..
            } => {
                let part = |part: &Arc<AccelerationStructure>| {
                    Touch::buffer(part.buffer(), Access::BuildPart)
                };
                let own = [structure.buffer(), scratch];
                let own = own.map(|buffer| Touch::buffer(buffer, Access::BuildTarget));
                let input = [Touch::buffer(input, Access::BuildInput)];
                let parts = structure.parts().iter().map(part);
                own.into_iter().chain(input).chain(parts).collect()
            }
        }))
    }
}
