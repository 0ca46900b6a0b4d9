//! Draws pictures of the device and egui's shapes over them into a window: two frames in flight, a
//! swapchain that follows the window, what it shows read back.

use std::sync::Arc;

use ash::vk;
use egui_ash_renderer::{DynamicRendering, Options, Renderer, RendererError};

use super::picture::{Drawn, PictureShaders, Pictures, PlacedPicture};
use super::swapchain::{Acquired, SwapImage, Swapchain};
use super::{Buffer, BufferDesc, BufferUsage, Context, Device, Error, Owner, Surface};

/// How many frames the host may be ahead of the device.
const IN_FLIGHT: usize = 2;

/// The stage that waits until the window gave an image to draw into.
#[doc(hidden)]
pub const ACQUIRED_BEFORE: vk::PipelineStageFlags2 =
    vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT;

/// What one frame shows.
pub struct Paint<'p> {
    /// Size of the window (px).
    pub size: [u32; 2],
    /// Textures that egui changed.
    pub textures: &'p egui::TexturesDelta,
    /// The shapes, back to front.
    pub primitives: &'p [egui::ClippedPrimitive],
    /// Pixels of a point.
    pub pixels_per_point: f32,
    /// Grey beneath everything, as egui has it, 0 to 1.
    pub background: f32,
    /// Pictures beneath the shapes, back to front.
    pub pictures: &'p [PlacedPicture],
    /// Whether the picture is read back.
    pub capture: bool,
}

/// A picture of the window as it was shown.
pub struct Capture {
    /// Width and height (px).
    pub size: [u32; 2],
    /// sRGB, red, green, blue, row 0 at the top.
    pub rgb: Vec<u8>,
}

/// What one frame in flight needs.
struct Slot {
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    /// Signalled when the frame has finished; made signalled.
    finished: vk::Fence,
    acquired: vk::Semaphore,
    /// What its frame draws.
    drawn: Drawn,
}

/// A window's swapchain, and egui on it.
pub struct Painter {
    // In the order in which they are dropped, after everything was waited for.
    egui: Option<(vk::Format, Renderer)>,
    pictures: Option<Pictures>,
    shaders: PictureShaders,
    swapchain: Option<Swapchain>,
    slots: Vec<Slot>,
    next: usize,
    is_stale: bool,
    vsync: bool,
    surface: Arc<Surface>,
    device: Arc<Device>,
}

impl Painter {
    /// For a surface and a device that was chosen for it.
    pub fn new(
        device: &Arc<Device>,
        surface: &Arc<Surface>,
        vsync: bool,
        shaders: PictureShaders,
    ) -> Result<Self, Error> {
        let mut painter = Painter {
            egui: None,
            pictures: None,
            shaders,
            swapchain: None,
            slots: Vec::new(),
            next: 0,
            is_stale: true,
            vsync,
            surface: Arc::clone(surface),
            device: Arc::clone(device),
        };
        for _ in 0..IN_FLIGHT {
            painter.add_slot()?;
        }
        Ok(painter)
    }

    fn add_slot(&mut self) -> Result<(), Error> {
        let device = self.device.raw();
        let null = (
            vk::CommandPool::null(),
            vk::CommandBuffer::null(),
            vk::Fence::null(),
            vk::Semaphore::null(),
        );
        // Pushed before it is whole, so that a failure on the way frees what there is.
        self.slots.push(Slot {
            pool: null.0,
            commands: null.1,
            finished: null.2,
            acquired: null.3,
            drawn: Drawn::default(),
        });
        let Some(slot) = self.slots.last_mut() else {
            return Ok(());
        };
        // SAFETY: the device is alive, and the family is the one that it was opened with.
        unsafe {
            slot.pool = device
                .create_command_pool(
                    &vk::CommandPoolCreateInfo::default()
                        .queue_family_index(self.device.queue_family()),
                    None,
                )
                .during("creating a command pool")?;
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(slot.pool)
                .level(vk::CommandBufferLevel::PRIMARY)
                .command_buffer_count(1);
            slot.commands = device
                .allocate_command_buffers(&info)
                .during("allocating a command buffer")?
                .first()
                .copied()
                .unwrap_or_default();
            slot.finished = device
                .create_fence(
                    &vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED),
                    None,
                )
                .during("creating a fence")?;
            slot.acquired = device
                .create_semaphore(&vk::SemaphoreCreateInfo::default(), None)
                .during("making a semaphore")?;
        }
        Ok(())
    }

    /// Name of the device that draws the window.
    pub fn device_name(&self) -> &str {
        &self.device.adapter().info.name
    }

    /// Whether pictures wait for the display.
    pub fn vsync(&self) -> bool {
        self.vsync
    }

    /// From the next frame on, pictures wait for the display or do not.
    pub fn set_vsync(&mut self, vsync: bool) {
        self.is_stale |= self.vsync != vsync;
        self.vsync = vsync;
    }

    /// Brings the swapchain up to the window's size (px); says whether there is anything to draw
    /// into. Not before it said so once may egui be run, since it tells of each texture once.
    pub fn prepare(&mut self, size: [u32; 2]) -> Result<bool, Error> {
        self.follow_window(size)?;
        Ok(self.egui.is_some())
    }

    /// Draws and shows one frame. Nothing is shown while the window has no area, or in a frame in
    /// which the window has just changed; textures are kept up to date all the same.
    pub fn paint(&mut self, paint: &Paint<'_>) -> Result<Shown, Error> {
        self.follow_window(paint.size)?;
        self.set_textures(paint.textures)?;
        let shown = self.show(paint);
        if !paint.textures.free.is_empty() {
            self.wait()?;
            if let Some((_, egui)) = &mut self.egui {
                egui.free_textures(&paint.textures.free)
                    .map_err(egui_error)?;
            }
        }
        shown
    }

    fn show(&mut self, paint: &Paint<'_>) -> Result<Shown, Error> {
        let (Some(swapchain), Some((_, egui))) = (&self.swapchain, &mut self.egui) else {
            return Ok(Shown::Nothing);
        };
        let Some(pictures) = &self.pictures else {
            return Ok(Shown::Nothing);
        };
        let slot = &mut self.slots[self.next];
        let device = self.device.raw();
        // SAFETY: the fence is signalled, or its frame is under way.
        unsafe { device.wait_for_fences(&[slot.finished], true, u64::MAX) }
            .during("waiting for a frame")?;
        let (index, is_suboptimal) = match swapchain.acquire(slot.acquired)? {
            Acquired::Image {
                index,
                is_suboptimal,
            } => (index, is_suboptimal),
            Acquired::NotYet => return Ok(Shown::Nothing),
            Acquired::OutOfDate => {
                self.is_stale = true;
                return Ok(Shown::Nothing);
            }
        };
        let Some(image) = swapchain.image(index) else {
            return Ok(Shown::Nothing);
        };
        let capture = if paint.capture && swapchain.can_copy() {
            Some(capture_buffer(&self.device, swapchain.extent())?)
        } else {
            None
        };
        let recording = Recording {
            device: &self.device,
            slot,
            image,
            extent: swapchain.extent(),
            format: swapchain.format(),
        };
        let drawn = recording.record((egui, pictures), paint, capture.as_ref())?;
        recording.submit()?;
        slot.drawn = drawn;
        self.is_stale |= !swapchain.present(index)? || is_suboptimal;
        self.next = (self.next + 1) % IN_FLIGHT;
        let Some(buffer) = capture else {
            return Ok(Shown::Picture);
        };
        let (size, format) = (swapchain.extent(), swapchain.format());
        self.wait()?;
        Ok(Shown::Captured(Capture {
            size,
            rgb: rgb(&buffer.read_mapped(), format),
        }))
    }

    /// Makes the swapchain again where it no longer fits, and egui's pipelines where the format
    /// changed.
    fn follow_window(&mut self, size: [u32; 2]) -> Result<(), Error> {
        let fits = self
            .swapchain
            .as_ref()
            .is_some_and(|swapchain| swapchain.extent() == size);
        if (fits && !self.is_stale) || size.contains(&0) {
            return Ok(());
        }
        self.wait_for_all()?;
        let swapchain = Swapchain::new(
            &self.device,
            &self.surface,
            size,
            self.vsync,
            self.swapchain.as_ref(),
        )?;
        self.swapchain = swapchain;
        self.is_stale = false;
        let Some(format) = self.swapchain.as_ref().map(Swapchain::format) else {
            return Ok(());
        };
        let is_srgb = encodes(format);
        if self.pictures.as_ref().map(Pictures::format) != Some(format) {
            let made = Pictures::new(&self.device, &self.shaders, (format, is_srgb))?;
            self.pictures = Some(made);
        }
        match &mut self.egui {
            Some((known, _)) if *known == format => {}
            Some((known, egui)) => {
                egui.set_dynamic_rendering(rendering(format))
                    .map_err(egui_error)?;
                *known = format;
            }
            None => {
                let options = Options {
                    in_flight_frames: IN_FLIGHT,
                    srgb_framebuffer: is_srgb,
                    ..Options::default()
                };
                let (instance, physical) =
                    (self.device.instance().raw(), self.device.adapter().raw);
                let egui = Renderer::with_default_allocator(
                    instance,
                    physical,
                    self.device.raw().clone(),
                    rendering(format),
                    options,
                )
                .map_err(egui_error)?;
                self.egui = Some((format, egui));
            }
        }
        Ok(())
    }

    fn set_textures(&mut self, textures: &egui::TexturesDelta) -> Result<(), Error> {
        if textures.set.is_empty() {
            return Ok(());
        }
        // A texture may be replaced while frames in flight still read it.
        self.wait()?;
        let pool = self.slots[self.next].pool;
        if let Some((_, egui)) = &mut self.egui {
            let queue = self.device.queue();
            egui.set_textures(*queue, pool, &textures.set)
                .map_err(egui_error)?;
        }
        Ok(())
    }

    /// Waits for all of its frames, but not for what others have submitted.
    fn wait(&self) -> Result<(), Error> {
        let fences: Vec<_> = self.slots.iter().map(|slot| slot.finished).collect();
        // SAFETY: each fence is signalled, or its frame is under way.
        unsafe { self.device.raw().wait_for_fences(&fences, true, u64::MAX) }
            .during("waiting for the window's frames")
    }

    /// Waits for everything that was submitted or is being shown.
    fn wait_for_all(&self) -> Result<(), Error> {
        let queue = self.device.queue();
        // SAFETY: the queue is held.
        unsafe { self.device.raw().queue_wait_idle(*queue) }
            .during("waiting for the window's frames")
    }
}

/// What became of a frame.
pub enum Shown {
    /// Nothing was shown; try again.
    Nothing,
    /// The picture is on its way to the display.
    Picture,
    /// The frame is shown, and this is its content.
    Captured(Capture),
}

impl Drop for Painter {
    fn drop(&mut self) {
        // A failure means that the device is lost, which ends all work too.
        let _ = self.wait_for_all();
        self.egui = None;
        self.swapchain = None;
        let device = self.device.raw();
        // SAFETY: everything was waited for.
        unsafe {
            for slot in &self.slots {
                device.destroy_command_pool(slot.pool, None);
                device.destroy_fence(slot.finished, None);
                device.destroy_semaphore(slot.acquired, None);
            }
        }
    }
}

/// One frame on its way.
struct Recording<'r> {
    device: &'r Arc<Device>,
    slot: &'r Slot,
    image: SwapImage,
    extent: [u32; 2],
    format: vk::Format,
}

impl Recording<'_> {
    fn record(
        &self,
        (egui, pictures): (&mut Renderer, &Pictures),
        paint: &Paint<'_>,
        capture: Option<&Arc<Buffer>>,
    ) -> Result<Drawn, Error> {
        let (device, commands) = (self.device.raw(), self.slot.commands);
        let extent = vk::Extent2D {
            width: self.extent[0],
            height: self.extent[1],
        };
        let attachments = [vk::RenderingAttachmentInfo::default()
            .image_view(self.image.view)
            .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(background(paint.background, self.format))];
        let rendering = vk::RenderingInfo::default()
            .render_area(vk::Rect2D {
                offset: vk::Offset2D::default(),
                extent,
            })
            .layer_count(1)
            .color_attachments(&attachments);
        let begin = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        let mut barriers = window_barriers(self.image.raw, capture.is_some()).into_iter();
        // SAFETY: the frame that used this slot last has finished, and the image was acquired.
        unsafe {
            device
                .reset_command_pool(self.slot.pool, vk::CommandPoolResetFlags::empty())
                .during("resetting the command pool")?;
            device
                .begin_command_buffer(commands, &begin)
                .during("starting a command buffer")?;
            self.barriers(&[], barriers.next().as_slice());
            device.cmd_begin_rendering(commands, &rendering);
        }
        let drawn = pictures.draw(self.device, commands, paint.pictures, self.extent);
        let shapes = egui
            .cmd_draw(commands, extent, paint.pixels_per_point, paint.primitives)
            .map_err(egui_error);
        // SAFETY: as above; the buffer holds the whole image.
        unsafe {
            device.cmd_end_rendering(commands);
            if let Some(buffer) = capture {
                self.barriers(&[], barriers.next().as_slice());
                let layers = vk::ImageSubresourceLayers {
                    aspect_mask: vk::ImageAspectFlags::COLOR,
                    layer_count: 1,
                    ..Default::default()
                };
                let extent = vk::Extent3D {
                    width: extent.width,
                    height: extent.height,
                    depth: 1,
                };
                let region = vk::BufferImageCopy {
                    image_subresource: layers,
                    image_extent: extent,
                    ..Default::default()
                };
                device.cmd_copy_image_to_buffer(
                    commands,
                    self.image.raw,
                    vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                    buffer.raw(),
                    &[region],
                );
                self.barriers(&[capture_barrier(buffer.raw())], &[]);
            }
            self.barriers(&[], barriers.next().as_slice());
            device
                .end_command_buffer(commands)
                .during("ending a command buffer")?;
        }
        shapes.and(drawn)
    }

    fn barriers(
        &self,
        buffers: &[vk::BufferMemoryBarrier2<'_>],
        images: &[vk::ImageMemoryBarrier2<'_>],
    ) {
        let info = vk::DependencyInfo::default()
            .buffer_memory_barriers(buffers)
            .image_memory_barriers(images);
        // SAFETY: recording into a begun command buffer.
        unsafe {
            self.device
                .raw()
                .cmd_pipeline_barrier2(self.slot.commands, &info)
        };
    }

    fn submit(&self) -> Result<(), Error> {
        let device = self.device.raw();
        let waits = [vk::SemaphoreSubmitInfo::default()
            .semaphore(self.slot.acquired)
            .stage_mask(ACQUIRED_BEFORE)];
        let signals = [vk::SemaphoreSubmitInfo::default()
            .semaphore(self.image.drawn)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(self.slot.commands)];
        let submit = vk::SubmitInfo2::default()
            .wait_semaphore_infos(&waits)
            .command_buffer_infos(&buffers)
            .signal_semaphore_infos(&signals);
        // SAFETY: the fence's last frame was waited for; the queue is held.
        unsafe {
            device
                .reset_fences(&[self.slot.finished])
                .during("resetting a fence")?;
            device
                .queue_submit2(*self.device.queue(), &[submit], self.slot.finished)
                .during("drawing the window")
        }
    }
}

/// The barriers of one frame on the window's image: before it is drawn into, before it is copied
/// (where it is), and before it is shown.
#[doc(hidden)]
pub fn window_barriers(image: vk::Image, is_copied: bool) -> Vec<vk::ImageMemoryBarrier2<'static>> {
    use vk::{AccessFlags2 as A, ImageLayout as L, PipelineStageFlags2 as S};
    // Layout, stage, and what the stage reads and writes.
    let acquired = (L::UNDEFINED, ACQUIRED_BEFORE, A::NONE, A::NONE);
    let drawn = (
        L::COLOR_ATTACHMENT_OPTIMAL,
        S::COLOR_ATTACHMENT_OUTPUT,
        A::COLOR_ATTACHMENT_READ,
        A::COLOR_ATTACHMENT_WRITE,
    );
    let copied = (
        L::TRANSFER_SRC_OPTIMAL,
        S::ALL_TRANSFER,
        A::TRANSFER_READ,
        A::NONE,
    );
    let shown = (L::PRESENT_SRC_KHR, S::NONE, A::NONE, A::NONE);
    let uses = if is_copied {
        vec![acquired, drawn, copied, shown]
    } else {
        vec![acquired, drawn, shown]
    };
    let range = vk::ImageSubresourceRange {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        level_count: 1,
        layer_count: 1,
        ..Default::default()
    };
    let between =
        |((old_layout, src_stage, _, written), (new_layout, dst_stage, read, overwritten))| {
            vk::ImageMemoryBarrier2::default()
                .src_stage_mask(src_stage)
                .src_access_mask(written)
                .dst_stage_mask(dst_stage)
                .dst_access_mask(read | overwritten)
                .old_layout(old_layout)
                .new_layout(new_layout)
                .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                .image(image)
                .subresource_range(range)
        };
    uses.iter()
        .copied()
        .zip(uses.iter().copied().skip(1))
        .map(between)
        .collect()
}

/// The barrier between the copy of a window's picture and its reading: waiting for the device shows
/// the host nothing that was not made visible to it.
#[doc(hidden)]
pub fn capture_barrier(buffer: vk::Buffer) -> vk::BufferMemoryBarrier2<'static> {
    vk::BufferMemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
        .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::HOST)
        .dst_access_mask(vk::AccessFlags2::HOST_READ)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .buffer(buffer)
        .size(vk::WHOLE_SIZE)
}

/// Whether what is drawn into a format is encoded to sRGB.
fn encodes(format: vk::Format) -> bool {
    matches!(
        format,
        vk::Format::B8G8R8A8_SRGB | vk::Format::R8G8B8A8_SRGB
    )
}

/// A grey as egui's shaders draw it.
fn background(grey: f32, format: vk::Format) -> vk::ClearValue {
    let drawn = if encodes(format) {
        grey.powf(2.2)
    } else {
        grey
    };
    vk::ClearValue {
        color: vk::ClearColorValue {
            float32: [drawn, drawn, drawn, 1.0],
        },
    }
}

fn rendering(format: vk::Format) -> DynamicRendering {
    DynamicRendering {
        color_attachment_format: format,
        depth_attachment_format: None,
    }
}

fn egui_error(error: RendererError) -> Error {
    let result = match error {
        RendererError::Vulkan(result) => result,
        _ => vk::Result::ERROR_UNKNOWN,
    };
    Error::Vulkan {
        what: format!("drawing the panels: {error}"),
        result,
    }
}

fn capture_buffer(device: &Arc<Device>, [width, height]: [u32; 2]) -> Result<Arc<Buffer>, Error> {
    let size_bytes = u64::from(width) * u64::from(height) * 4;
    Buffer::new(
        device,
        &BufferDesc {
            name: "window.capture".into(),
            size_bytes,
            usage: BufferUsage::Readback,
            owner: Owner::Shared,
        },
    )
}

fn rgb(texels: &[u8], format: vk::Format) -> Vec<u8> {
    let swap = matches!(
        format,
        vk::Format::B8G8R8A8_SRGB | vk::Format::B8G8R8A8_UNORM
    );
    texels
        .as_chunks()
        .0
        .iter()
        .flat_map(|&[a, g, b, _]| if swap { [b, g, a] } else { [a, g, b] })
        .collect()
}
