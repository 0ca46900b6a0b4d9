//! The pictures that a window shows in turn.

use std::sync::Arc;

use ash::vk;

use super::{Context, Device, Error, Surface};

/// Images of a surface, made for one size of the window.
pub(super) struct Swapchain {
    raw: vk::SwapchainKHR,
    loader: ash::khr::swapchain::Device,
    images: Vec<SwapImage>,
    format: vk::Format,
    extent: [u32; 2],
    can_copy: bool,
    device: Arc<Device>,
    _surface: Arc<Surface>,
}

/// One image, and the semaphore that says that it is drawn. One for each image: only when an image
/// is acquired again has its showing waited for it.
#[derive(Clone, Copy)]
pub(super) struct SwapImage {
    pub(super) raw: vk::Image,
    pub(super) view: vk::ImageView,
    pub(super) drawn: vk::Semaphore,
}

/// Which image is next.
pub(super) enum Acquired {
    /// This one; it may no longer fit the window perfectly.
    Image { index: u32, is_suboptimal: bool },
    /// None within [`PATIENCE_NS`].
    NotYet,
    /// None: the swapchain has to be made again.
    OutOfDate,
}

/// So long the next image is waited for (ns): a window has to answer meanwhile.
const PATIENCE_NS: u64 = 200_000_000;

impl Swapchain {
    /// For a window of the size `wanted` (px); `None` where it has no area, as when minimised.
    /// `old` is not used any more.
    pub(super) fn new(
        device: &Arc<Device>,
        surface: &Arc<Surface>,
        wanted: [u32; 2],
        vsync: bool,
        old: Option<&Swapchain>,
    ) -> Result<Option<Self>, Error> {
        let support = surface.support(device.adapter().raw)?;
        let capabilities = support.capabilities;
        let extent = extent(&capabilities, wanted);
        if extent.contains(&0) {
            return Ok(None);
        }
        let Some(format) = format(&support.formats) else {
            return Err(Error::NoPresent);
        };
        let copy = capabilities.supported_usage_flags & vk::ImageUsageFlags::TRANSFER_SRC;
        let most = if capabilities.max_image_count == 0 {
            u32::MAX
        } else {
            capabilities.max_image_count
        };
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(surface.raw())
            .min_image_count((capabilities.min_image_count + 1).min(most))
            .image_format(format.format)
            .image_color_space(format.color_space)
            .image_extent(vk::Extent2D {
                width: extent[0],
                height: extent[1],
            })
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::COLOR_ATTACHMENT | copy)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(capabilities.current_transform)
            .composite_alpha(composite_alpha(capabilities.supported_composite_alpha))
            .present_mode(present_mode(&support.modes, vsync))
            .clipped(true)
            .old_swapchain(old.map_or(vk::SwapchainKHR::null(), |old| old.raw));
        let loader = ash::khr::swapchain::Device::new(device.instance().raw(), device.raw());
        // SAFETY: surface and device live, and all values are among those that the surface
        // supports.
        let raw = unsafe { loader.create_swapchain(&info, None) }.during("making the swapchain")?;
        let mut swapchain = Swapchain {
            raw,
            loader,
            images: Vec::new(),
            format: format.format,
            extent,
            can_copy: !copy.is_empty(),
            device: Arc::clone(device),
            _surface: Arc::clone(surface),
        };
        // SAFETY: the swapchain was just made.
        for image in unsafe { swapchain.loader.get_swapchain_images(raw) }
            .during("listing the swapchain's images")?
        {
            swapchain.add_image(image)?;
        }
        Ok(Some(swapchain))
    }

    fn add_image(&mut self, raw: vk::Image) -> Result<(), Error> {
        let range = vk::ImageSubresourceRange {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            level_count: 1,
            layer_count: 1,
            ..Default::default()
        };
        let info = vk::ImageViewCreateInfo::default()
            .image(raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(self.format)
            .subresource_range(range);
        let device = self.device.raw();
        // SAFETY: the image is of this swapchain and has this format.
        let view =
            unsafe { device.create_image_view(&info, None) }.during("viewing a swapchain image")?;
        // SAFETY: the device is alive.
        let drawn = unsafe { device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) }
            .inspect_err(|_| {
                // SAFETY: nobody has used the view.
                unsafe { device.destroy_image_view(view, None) };
            });
        self.images.push(SwapImage {
            raw,
            view,
            drawn: drawn.during("making a semaphore")?,
        });
        Ok(())
    }

    pub(super) fn format(&self) -> vk::Format {
        self.format
    }

    pub(super) fn extent(&self) -> [u32; 2] {
        self.extent
    }

    /// Whether its images can be read back.
    pub(super) fn can_copy(&self) -> bool {
        self.can_copy
    }

    pub(super) fn image(&self, index: u32) -> Option<SwapImage> {
        self.images.get(index as usize).copied()
    }

    /// Waits for the next image, but not for ever: a window that nobody sees may have none.
    /// `acquired` is signalled when the image can be drawn into.
    pub(super) fn acquire(&self, acquired: vk::Semaphore) -> Result<Acquired, Error> {
        // SAFETY: the semaphore is not signalled: the frame that waited for it has finished.
        match unsafe {
            self.loader
                .acquire_next_image(self.raw, PATIENCE_NS, acquired, vk::Fence::null())
        } {
            Ok((index, is_suboptimal)) => Ok(Acquired::Image {
                index,
                is_suboptimal,
            }),
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(Acquired::NotYet),
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => Ok(Acquired::OutOfDate),
            Err(result) => Err(result).during("asking for the window's next image"),
        }
    }

    /// Shows an image once it is drawn; says whether the swapchain still fits the window.
    pub(super) fn present(&self, index: u32) -> Result<bool, Error> {
        let Some(image) = self.image(index) else {
            return Ok(false);
        };
        let (semaphores, swapchains, indices) = ([image.drawn], [self.raw], [index]);
        let info = vk::PresentInfoKHR::default()
            .wait_semaphores(&semaphores)
            .swapchains(&swapchains)
            .image_indices(&indices);
        // SAFETY: the image was acquired, and the submission that signals its semaphore is under
        // way. The queue is held.
        let told = unsafe { self.loader.queue_present(*self.device.queue(), &info) };
        match self.device.planted_present().map_or(told, Err) {
            Ok(is_suboptimal) => Ok(!is_suboptimal),
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => Ok(false),
            Err(result) => Err(result).during("showing a picture"),
        }
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        // SAFETY: the painter waits for the queue before it drops a swapchain.
        unsafe {
            for image in &self.images {
                self.device.raw().destroy_image_view(image.view, None);
                self.device.raw().destroy_semaphore(image.drawn, None);
            }
            self.loader.destroy_swapchain(self.raw, None);
        }
    }
}

/// The size that the surface dictates, or the window's own within its limits.
fn extent(capabilities: &vk::SurfaceCapabilitiesKHR, wanted: [u32; 2]) -> [u32; 2] {
    let current = capabilities.current_extent;
    if current.width != u32::MAX {
        return [current.width, current.height];
    }
    let (least, most) = (capabilities.min_image_extent, capabilities.max_image_extent);
    [
        wanted[0].clamp(least.width, most.width),
        wanted[1].clamp(least.height, most.height),
    ]
}

/// One that encodes to sRGB where there is one: the shaders then need not approximate it.
fn format(formats: &[vk::SurfaceFormatKHR]) -> Option<vk::SurfaceFormatKHR> {
    let wanted = [
        vk::Format::B8G8R8A8_SRGB,
        vk::Format::R8G8B8A8_SRGB,
        vk::Format::B8G8R8A8_UNORM,
        vk::Format::R8G8B8A8_UNORM,
    ];
    wanted
        .into_iter()
        .find_map(|wanted| {
            formats.iter().find(|format| {
                format.format == wanted && format.color_space == vk::ColorSpaceKHR::SRGB_NONLINEAR
            })
        })
        .copied()
}

/// FIFO is always there; without vsync, the least delay.
fn present_mode(modes: &[vk::PresentModeKHR], vsync: bool) -> vk::PresentModeKHR {
    let wanted: &[vk::PresentModeKHR] = if vsync {
        &[]
    } else {
        &[vk::PresentModeKHR::MAILBOX, vk::PresentModeKHR::IMMEDIATE]
    };
    wanted
        .iter()
        .copied()
        .find(|mode| modes.contains(mode))
        .unwrap_or(vk::PresentModeKHR::FIFO)
}

fn composite_alpha(supported: vk::CompositeAlphaFlagsKHR) -> vk::CompositeAlphaFlagsKHR {
    use vk::CompositeAlphaFlagsKHR as A;
    [A::OPAQUE, A::INHERIT, A::PRE_MULTIPLIED, A::POST_MULTIPLIED]
        .into_iter()
        .find(|alpha| supported.contains(*alpha))
        .unwrap_or(A::OPAQUE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_surface_decides_the_size_where_it_does() {
        let size = |width, height| vk::Extent2D { width, height };
        let mut capabilities = vk::SurfaceCapabilitiesKHR {
            min_image_extent: size(2, 2),
            max_image_extent: size(100, 100),
            ..Default::default()
        };
        capabilities.current_extent = size(30, 40);
        assert_eq!(extent(&capabilities, [7, 7]), [30, 40]);
        capabilities.current_extent = size(u32::MAX, u32::MAX);
        assert_eq!(extent(&capabilities, [1, 700]), [2, 100]);
    }

    #[test]
    fn vsync_is_fifo_and_no_vsync_the_best_there_is() {
        use vk::PresentModeKHR as M;
        assert_eq!(
            present_mode(&[M::IMMEDIATE, M::MAILBOX, M::FIFO], true),
            M::FIFO
        );
        assert_eq!(
            present_mode(&[M::IMMEDIATE, M::MAILBOX, M::FIFO], false),
            M::MAILBOX
        );
        assert_eq!(present_mode(&[M::FIFO], false), M::FIFO);
    }
}
