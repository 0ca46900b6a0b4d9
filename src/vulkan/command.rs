//! Command buffers: each is recorded, submitted and waited for, again and again.

use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use ash::vk;

use super::debug::c_name;
use super::{AccelerationStructure, Buffer, Context, Device, Error, Image, Pipeline, Timestamps};

/// Part of one mip and layer of an image, for copies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ImageRegion {
    pub(crate) mip: u32,
    pub(crate) layer: u32,
    /// Lowest texel and extent of a part of it; `None` for all.
    pub(crate) part: Option<[[u32; 3]; 2]>,
}

/// One attachment of a rendering scope.
#[derive(Clone, Copy)]
pub(crate) struct Attachment {
    pub(crate) view: vk::ImageView,
    pub(crate) layout: vk::ImageLayout,
    /// What to clear to; `None` keeps the contents.
    pub(crate) clear: Option<vk::ClearValue>,
}

/// A rendering scope.
pub(crate) struct Rendering {
    pub(crate) color: Vec<Attachment>,
    pub(crate) depth: Option<Attachment>,
    pub(crate) extent: [u32; 2],
    /// Edge of a viewport with the extent in its middle, where that is larger (px).
    pub(crate) viewport: Option<u32>,
}

/// A command pool with one buffer, and the fence that says when its work is done.
///
/// The methods record one command each. Their callers, all in the graph, keep alive whatever is
/// recorded until [`Commands::wait`] returns.
pub(crate) struct Commands {
    pool: vk::CommandPool,
    raw: vk::CommandBuffer,
    fence: vk::Fence,
    device: Arc<Device>,
}

impl Commands {
    pub(crate) fn new(device: &Arc<Device>) -> Result<Self, Error> {
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(device.queue_family());
        // SAFETY: the family is the one the device was opened with.
        let pool = unsafe { device.raw().create_command_pool(&info, None) }
            .during("creating a command pool")?;
        let mut commands = Commands {
            pool,
            raw: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            device: Arc::clone(device),
        };
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        // SAFETY: the pool is alive.
        let buffers = unsafe { device.raw().allocate_command_buffers(&info) }
            .during("allocating a command buffer")?;
        commands.raw = buffers.first().copied().unwrap_or_default();
        // SAFETY: the device is alive.
        commands.fence = unsafe {
            device
                .raw()
                .create_fence(&vk::FenceCreateInfo::default(), None)
        }
        .during("creating a fence")?;
        Ok(commands)
    }

    /// A command buffer of another program, which has begun it and submits it.
    pub(super) fn of_host(device: &Arc<Device>, raw: vk::CommandBuffer) -> Self {
        Commands {
            pool: vk::CommandPool::null(),
            raw,
            fence: vk::Fence::null(),
            device: Arc::clone(device),
        }
    }

    /// Starts recording anew; earlier commands are gone.
    pub(crate) fn begin(&self) -> Result<(), Error> {
        let info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the last submission was waited for.
        unsafe {
            self.device
                .raw()
                .reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .during("resetting the command pool")?;
            self.device
                .raw()
                .begin_command_buffer(self.raw, &info)
                .during("starting a command buffer")?;
            // Lavapipe 22.3 skips a barrier that is the first command: it would not wait for what
            // the submission before rasterizes. This command has no effect.
            self.device.raw().cmd_set_line_width(self.raw, 1.0);
        }
        Ok(())
    }

    /// Ends the recording, and submits it; when. `alone`: once the queue has nothing else to do, so
    /// that nobody else's work counts.
    pub(crate) fn submit(&self, alone: bool) -> Result<Instant, vk::Result> {
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(self.raw)];
        let submit = vk::SubmitInfo2::default().command_buffer_infos(&buffers);
        let device = self.device.raw();
        // SAFETY: the command buffer is complete, and one thread at a time holds it; the queue is
        // held.
        unsafe {
            device.end_command_buffer(self.raw)?;
            let queue = self.device.queue();
            if alone {
                device.queue_wait_idle(*queue)?;
            }
            let began = Instant::now();
            device.queue_submit2(*queue, &[submit], self.fence)?;
            Ok(began)
        }
    }

    /// Waits until what was submitted is done.
    pub(crate) fn wait(&self) -> Result<(), vk::Result> {
        let device = self.device.raw();
        // SAFETY: the fence is alive, and was given to a submission.
        unsafe {
            device.wait_for_fences(&[self.fence], true, u64::MAX)?;
            device.reset_fences(&[self.fence])
        }
    }

    pub(crate) fn barriers(
        &self,
        buffers: &[vk::BufferMemoryBarrier2<'_>],
        images: &[vk::ImageMemoryBarrier2<'_>],
    ) {
        let info = vk::DependencyInfo::default()
            .buffer_memory_barriers(buffers)
            .image_memory_barriers(images);
        // SAFETY: recording into a begun command buffer (as for every method below).
        unsafe { self.device.raw().cmd_pipeline_barrier2(self.raw, &info) };
    }

    /// Passes an image on, from all commands before to all that follow, from a layout to another.
    pub(crate) fn hand_over(&self, image: &Image, [before, after]: [vk::ImageLayout; 2]) {
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let access = vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE;
        let range = vk::ImageSubresourceRange::default()
            .aspect_mask(image.aspect())
            .level_count(1)
            .layer_count(1);
        let barrier = vk::ImageMemoryBarrier2::default()
            .src_stage_mask(all)
            .src_access_mask(access)
            .dst_stage_mask(all)
            .dst_access_mask(access)
            .old_layout(before)
            .new_layout(after)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(image.raw())
            .subresource_range(range);
        self.barriers(&[], &[barrier]);
    }

    /// A barrier for all memory, which changes no layout.
    pub(crate) fn memory_barrier(
        &self,
        (src_stage, src_access): (vk::PipelineStageFlags2, vk::AccessFlags2),
        (dst_stage, dst_access): (vk::PipelineStageFlags2, vk::AccessFlags2),
    ) {
        let barrier = [vk::MemoryBarrier2::default()
            .src_stage_mask(src_stage)
            .src_access_mask(src_access)
            .dst_stage_mask(dst_stage)
            .dst_access_mask(dst_access)];
        let info = vk::DependencyInfo::default().memory_barriers(&barrier);
        // SAFETY: as for `barriers`.
        unsafe { self.device.raw().cmd_pipeline_barrier2(self.raw, &info) };
    }

    pub(crate) fn begin_label(&self, name: &str) {
        if let Some(debug) = self.device.debug_utils() {
            let name = c_name(name);
            let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
            // SAFETY: as for `barriers`; the extension is enabled.
            unsafe { debug.cmd_begin_debug_utils_label(self.raw, &label) };
        }
    }

    pub(crate) fn end_label(&self) {
        if let Some(debug) = self.device.debug_utils() {
            // SAFETY: as for `barriers`; a label is open.
            unsafe { debug.cmd_end_debug_utils_label(self.raw) };
        }
    }

    pub(crate) fn timestamp(&self, timestamps: &Timestamps, index: u32) {
        // SAFETY: as for `barriers`; the query was reset.
        unsafe {
            self.device.raw().cmd_write_timestamp2(
                self.raw,
                vk::PipelineStageFlags2::ALL_COMMANDS,
                timestamps.raw(),
                index,
            )
        };
    }

    pub(crate) fn bind_pipeline(&self, pipeline: &Pipeline) {
        // SAFETY: as for `barriers`.
        unsafe {
            self.device
                .raw()
                .cmd_bind_pipeline(self.raw, pipeline.bind_point(), pipeline.raw())
        };
    }

    pub(crate) fn bind_set(&self, pipeline: &Pipeline, index: u32, set: vk::DescriptorSet) {
        // SAFETY: as for `barriers`; the set was made from the layout at this index.
        unsafe {
            self.device.raw().cmd_bind_descriptor_sets(
                self.raw,
                pipeline.bind_point(),
                pipeline.layout(),
                index,
                &[set],
                &[],
            )
        };
    }

    pub(crate) fn push(&self, pipeline: &Pipeline, bytes: &[u8]) {
        if !bytes.is_empty() {
            // SAFETY: as for `barriers`; the size is that of the layout's range.
            unsafe {
                self.device.raw().cmd_push_constants(
                    self.raw,
                    pipeline.layout(),
                    vk::ShaderStageFlags::ALL,
                    0,
                    bytes,
                )
            };
        }
    }

    /// Runs so many workgroups, counted from `first`.
    pub(crate) fn dispatch(&self, first: [u32; 3], [x, y, z]: [u32; 3]) {
        let (device, [first_x, first_y, first_z]) = (self.device.raw(), first);
        // SAFETY: as for `barriers`; a compute pipeline is bound, and all are made for workgroups
        // that are not counted from 0.
        unsafe {
            if first == [0; 3] {
                device.cmd_dispatch(self.raw, x, y, z);
            } else {
                device.cmd_dispatch_base(self.raw, first_x, first_y, first_z, x, y, z);
            }
        }
    }

    pub(crate) fn dispatch_indirect(&self, buffer: &Buffer, offset: u64) {
        // SAFETY: as for `dispatch`; the graph asserts that the arguments lie in the buffer.
        unsafe {
            self.device
                .raw()
                .cmd_dispatch_indirect(self.raw, buffer.raw(), offset)
        };
    }

    /// Draws and dispatches up to [`Self::end_condition`] run if the buffer's first word is not 0.
    pub(crate) fn begin_condition(&self, buffer: &Buffer) {
        if let Some(conditions) = self.device.conditions() {
            let info = vk::ConditionalRenderingBeginInfoEXT::default().buffer(buffer.raw());
            // SAFETY: as for `barriers`; storage buffers are made for this use, and no condition
            // is open.
            unsafe { (conditions.fp().cmd_begin_conditional_rendering_ext)(self.raw, &info) };
        }
    }

    pub(crate) fn end_condition(&self) {
        if let Some(conditions) = self.device.conditions() {
            // SAFETY: as for `barriers`; `begin_condition` was called before.
            unsafe { (conditions.fp().cmd_end_conditional_rendering_ext)(self.raw) };
        }
    }

    /// Builds an acceleration structure from `input`; with `follows`, anew where its triangles are
    /// now.
    pub(crate) fn build_structure(
        &self,
        structure: &AccelerationStructure,
        (input, scratch): (&Buffer, &Buffer),
        follows: bool,
    ) {
        structure.record_build(self.raw, (input, scratch), follows);
    }

    pub(crate) fn begin_rendering(&self, rendering: &Rendering) {
        let [width, height] = rendering.extent;
        let area = vk::Rect2D {
            offset: vk::Offset2D::default(),
            extent: vk::Extent2D { width, height },
        };
        let color: Vec<_> = rendering.color.iter().map(attachment_info).collect();
        let depth = rendering.depth.as_ref().map(attachment_info);
        let info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&color);
        let info = match &depth {
            Some(depth) => info.depth_attachment(depth),
            None => info,
        };
        let [across, down] = match rendering.viewport {
            Some(edge) => [edge; 2],
            None => rendering.extent,
        }
        .map(|edge| edge as f32);
        let viewport = vk::Viewport {
            x: 0.5 * (width as f32 - across),
            y: 0.5 * (height as f32 - down),
            width: across,
            height: down,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        // SAFETY: as for `barriers`; the views are alive and in the layouts named.
        unsafe {
            self.device.raw().cmd_begin_rendering(self.raw, &info);
            self.device.raw().cmd_set_viewport(self.raw, 0, &[viewport]);
            self.device.raw().cmd_set_scissor(self.raw, 0, &[area]);
        }
    }

    /// From here on viewport and scissor are a part of the targets: corner, width and height (px).
    pub(crate) fn draw_in(&self, [x, y, width, height]: [u32; 4]) {
        let viewport = [x, y, width, height].map(|edge| edge as f32);
        self.draw_at(viewport, [x, y, width, height]);
    }

    /// From here on this is the viewport, and this the scissor: corner, width and height (px).
    pub(crate) fn draw_at(
        &self,
        [left, top, across, down]: [f32; 4],
        [x, y, width, height]: [u32; 4],
    ) {
        let viewport = vk::Viewport {
            x: left,
            y: top,
            width: across,
            height: down,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        let scissor = vk::Rect2D {
            offset: vk::Offset2D {
                x: x as i32,
                y: y as i32,
            },
            extent: vk::Extent2D { width, height },
        };
        // SAFETY: as for `barriers`; viewport and scissor of all pipelines are dynamic.
        unsafe {
            self.device.raw().cmd_set_viewport(self.raw, 0, &[viewport]);
            self.device.raw().cmd_set_scissor(self.raw, 0, &[scissor]);
        }
    }

    pub(crate) fn draw(&self, first_vertex: u32, vertex_count: u32) {
        // SAFETY: as for `barriers`; a graphics pipeline is bound in a rendering scope.
        unsafe {
            self.device
                .raw()
                .cmd_draw(self.raw, vertex_count, 1, first_vertex, 0)
        };
    }

    /// Draws the vertices that a range of `indices` names, 32 bits each.
    pub(crate) fn draw_indexed(&self, indices: &Buffer, first: u32, count: u32) {
        let device = self.device.raw();
        // SAFETY: as for `draw`; the buffer may hold indices.
        unsafe {
            device.cmd_bind_index_buffer(self.raw, indices.raw(), 0, vk::IndexType::UINT32);
            device.cmd_draw_indexed(self.raw, count, 1, first, 0, 0);
        }
    }

    pub(crate) fn end_rendering(&self) {
        // SAFETY: as for `barriers`; a rendering scope is open.
        unsafe { self.device.raw().cmd_end_rendering(self.raw) };
    }

    pub(crate) fn fill(&self, buffer: &Buffer, first_byte: u64, value: u32) {
        // SAFETY: as for `barriers`; buffers are whole words long, and the graph checks that the
        // first byte is that of a word.
        unsafe {
            self.device.raw().cmd_fill_buffer(
                self.raw,
                buffer.raw(),
                first_byte,
                vk::WHOLE_SIZE,
                value,
            )
        };
    }

    pub(crate) fn set(&self, buffer: &Buffer, bytes: &[u8]) {
        if !bytes.is_empty() {
            // SAFETY: as for `barriers`; the graph asserts that the bytes are whole words, fit into
            // the buffer and are not too many for a command.
            unsafe {
                self.device
                    .raw()
                    .cmd_update_buffer(self.raw, buffer.raw(), 0, bytes)
            };
        }
    }

    pub(crate) fn clear(&self, image: &Image, mips: &Range<u32>, value: vk::ClearColorValue) {
        let range = vk::ImageSubresourceRange::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .base_mip_level(mips.start)
            .level_count(mips.end - mips.start)
            .layer_count(vk::REMAINING_ARRAY_LAYERS);
        // SAFETY: as for `barriers`; the graph has put the image into this layout.
        unsafe {
            self.device.raw().cmd_clear_color_image(
                self.raw,
                image.raw(),
                vk::ImageLayout::TRANSFER_DST_OPTIMAL,
                &value,
                &[range],
            )
        };
    }

    /// Filters one mip into the next, linearly, for all layers.
    pub(crate) fn blit_mip(&self, image: &Image, source: u32) {
        let corner = |mip: u32| {
            let [x, y, z] = image
                .extent(mip)
                .map(|texels| i32::try_from(texels).unwrap_or(i32::MAX));
            [vk::Offset3D::default(), vk::Offset3D { x, y, z }]
        };
        let layers = |mip: u32| vk::ImageSubresourceLayers {
            aspect_mask: image.aspect(),
            mip_level: mip,
            base_array_layer: 0,
            layer_count: image.desc().layers,
        };
        let region = vk::ImageBlit2::default()
            .src_subresource(layers(source))
            .src_offsets(corner(source))
            .dst_subresource(layers(source + 1))
            .dst_offsets(corner(source + 1));
        let regions = [region];
        let info = vk::BlitImageInfo2::default()
            .src_image(image.raw())
            .src_image_layout(vk::ImageLayout::TRANSFER_SRC_OPTIMAL)
            .dst_image(image.raw())
            .dst_image_layout(vk::ImageLayout::TRANSFER_DST_OPTIMAL)
            .regions(&regions)
            .filter(vk::Filter::LINEAR);
        // SAFETY: as for `clear`.
        unsafe { self.device.raw().cmd_blit_image2(self.raw, &info) };
    }

    /// All texels of the finest mip and first layer of an image to those of another, between which
    /// they are interpolated where sizes differ.
    pub(crate) fn blit(&self, source: &Image, target: &Image) {
        let corners = |image: &Image| {
            let end = image.extent(0).map(|texels| texels as i32);
            [
                vk::Offset3D::default(),
                vk::Offset3D {
                    x: end[0],
                    y: end[1],
                    z: end[2],
                },
            ]
        };
        let layer = vk::ImageSubresourceLayers::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .layer_count(1);
        let regions = [vk::ImageBlit2::default()
            .src_subresource(layer)
            .src_offsets(corners(source))
            .dst_subresource(layer)
            .dst_offsets(corners(target))];
        let filter = if source.extent(0) == target.extent(0) {
            vk::Filter::NEAREST
        } else {
            vk::Filter::LINEAR
        };
        let info = vk::BlitImageInfo2::default()
            .src_image(source.raw())
            .src_image_layout(vk::ImageLayout::TRANSFER_SRC_OPTIMAL)
            .dst_image(target.raw())
            .dst_image_layout(vk::ImageLayout::TRANSFER_DST_OPTIMAL)
            .regions(&regions)
            .filter(filter);
        // SAFETY: as for `clear`.
        unsafe { self.device.raw().cmd_blit_image2(self.raw, &info) };
    }

    pub(crate) fn copy_buffer(&self, source: (&Buffer, u64), target: (&Buffer, u64), size: u64) {
        if size > 0 {
            let region = vk::BufferCopy {
                src_offset: source.1,
                dst_offset: target.1,
                size,
            };
            // SAFETY: as for `barriers`; the graph asserts that both ranges lie in their buffers.
            unsafe {
                self.device.raw().cmd_copy_buffer(
                    self.raw,
                    source.0.raw(),
                    target.0.raw(),
                    &[region],
                )
            };
        }
    }

    pub(crate) fn copy_to_image(&self, source: &Buffer, target: &Image, region: ImageRegion) {
        let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        // SAFETY: as for `clear`; the graph asserts that the buffer holds the whole region.
        unsafe {
            self.device.raw().cmd_copy_buffer_to_image(
                self.raw,
                source.raw(),
                target.raw(),
                layout,
                &[buffer_image_copy(target, region)],
            )
        };
    }

    pub(crate) fn copy_from_image(&self, source: &Image, region: ImageRegion, target: &Buffer) {
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        // SAFETY: as for `clear`; the graph asserts that the buffer holds the whole region.
        unsafe {
            self.device.raw().cmd_copy_image_to_buffer(
                self.raw,
                source.raw(),
                layout,
                target.raw(),
                &[buffer_image_copy(source, region)],
            )
        };
    }
}

impl Drop for Commands {
    fn drop(&mut self) {
        // SAFETY: every submission was waited for, or the device is lost.
        unsafe {
            self.device.raw().destroy_fence(self.fence, None);
            self.device.raw().destroy_command_pool(self.pool, None);
        }
    }
}

fn attachment_info(attachment: &Attachment) -> vk::RenderingAttachmentInfo<'static> {
    let load = if attachment.clear.is_some() {
        vk::AttachmentLoadOp::CLEAR
    } else {
        vk::AttachmentLoadOp::LOAD
    };
    vk::RenderingAttachmentInfo::default()
        .image_view(attachment.view)
        .image_layout(attachment.layout)
        .load_op(load)
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(attachment.clear.unwrap_or_default())
}

fn buffer_image_copy(image: &Image, region: ImageRegion) -> vk::BufferImageCopy {
    let all = [[0; 3], image.extent(region.mip)];
    let [low, [width, height, depth]] = region.part.unwrap_or(all);
    let [x, y, z] = low.map(|at| at as i32);
    vk::BufferImageCopy {
        image_subresource: vk::ImageSubresourceLayers {
            aspect_mask: image.aspect(),
            mip_level: region.mip,
            base_array_layer: region.layer,
            layer_count: 1,
        },
        image_offset: vk::Offset3D { x, y, z },
        image_extent: vk::Extent3D {
            width,
            height,
            depth,
        },
        ..Default::default()
    }
}
