//! Images and their views.

use std::collections::HashMap;
use std::ops::{BitOr, Range};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use super::{Context, Device, Error, Owner};

/// Shape of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImageKind {
    /// Two dimensions.
    D2,
    /// Layers of two dimensions; the view is an array even with one layer.
    D2Array,
    /// Three dimensions.
    D3,
}

/// What an image is for, besides copies, which are always possible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageUsage(u8);

impl ImageUsage {
    /// Load, store and atomics.
    pub const STORAGE: Self = ImageUsage(1);
    /// Read through a sampler.
    pub const SAMPLED: Self = ImageUsage(2);
    /// Colour attachment.
    pub const COLOR: Self = ImageUsage(4);
    /// Depth attachment.
    pub const DEPTH: Self = ImageUsage(8);

    /// Whether all of `other` is included.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    fn flags(self) -> vk::ImageUsageFlags {
        let mut flags = vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST;
        for (usage, flag) in [
            (Self::STORAGE, vk::ImageUsageFlags::STORAGE),
            (Self::SAMPLED, vk::ImageUsageFlags::SAMPLED),
            (Self::COLOR, vk::ImageUsageFlags::COLOR_ATTACHMENT),
            (Self::DEPTH, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT),
        ] {
            if self.contains(usage) {
                flags |= flag;
            }
        }
        flags
    }
}

impl BitOr for ImageUsage {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        ImageUsage(self.0 | other.0)
    }
}

/// An image to make.
#[derive(Clone, Debug)]
pub struct ImageDesc {
    /// Name for reports, errors and debuggers.
    pub name: String,
    /// Width, height and depth of mip 0 (texels); depth is 1 but for 3D images.
    pub extent: [u32; 3],
    /// How the texels lie: a plane, an array or a volume.
    pub kind: ImageKind,
    /// Format of a texel.
    pub format: vk::Format,
    /// Number of mips, at least 1.
    pub mips: u32,
    /// Number of array layers; 1 but for arrays.
    pub layers: u32,
    /// What it is for.
    pub usage: ImageUsage,
    /// What it is counted for.
    pub owner: Owner,
}

impl ImageDesc {
    /// Number of mips of a full chain down to one texel.
    pub fn full_mips(extent: [u32; 3]) -> u32 {
        extent.into_iter().max().unwrap_or(1).max(1).ilog2() + 1
    }

    fn info(&self) -> vk::ImageCreateInfo<'static> {
        let [width, height, depth] = self.extent;
        vk::ImageCreateInfo::default()
            .image_type(if self.kind == ImageKind::D3 {
                vk::ImageType::TYPE_3D
            } else {
                vk::ImageType::TYPE_2D
            })
            .format(self.format)
            .extent(vk::Extent3D {
                width,
                height,
                depth,
            })
            .mip_levels(self.mips)
            .array_layers(self.layers)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(self.usage.flags())
            .initial_layout(vk::ImageLayout::UNDEFINED)
    }
}

/// The part and the shape of an image that a view shows.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct ViewKey {
    first_mip: u32,
    mips: u32,
    first_layer: u32,
    layers: u32,
    kind: ImageKind,
}

/// An image, its memory and its views; freed when the last owner drops it.
pub struct Image {
    raw: vk::Image,
    allocation: Option<Allocation>,
    views: Mutex<HashMap<ViewKey, vk::ImageView>>,
    frozen: AtomicBool,
    id: u64,
    desc: ImageDesc,
    /// Whether it goes with this object.
    is_own: bool,
    device: Arc<Device>,
}

impl Image {
    /// Makes an image; one beyond what the device can hold is an error with the numbers.
    pub fn new(device: &Arc<Device>, desc: &ImageDesc) -> Result<Arc<Self>, Error> {
        let shape =
            desc.extent.iter().all(|&texels| texels > 0) && desc.mips > 0 && desc.layers > 0;
        assert!(
            shape && desc.mips <= ImageDesc::full_mips(desc.extent),
            "image {}: impossible shape {desc:?}",
            desc.name
        );
        check_limits(device, desc)?;
        let info = desc.info();
        let mut requirements = vk::MemoryRequirements2::default();
        let query = vk::DeviceImageMemoryRequirements::default().create_info(&info);
        // SAFETY: the device can make such an image (checked above), and only describes it here.
        unsafe {
            device
                .raw()
                .get_device_image_memory_requirements(&query, &mut requirements)
        };
        let requirements = requirements.memory_requirements;
        device
            .memory()
            .check(&desc.name, requirements.size, MemoryLocation::GpuOnly)?;
        // SAFETY: as above.
        let raw = unsafe { device.raw().create_image(&info, None) }
            .during(&format!("creating the image {}", desc.name))?;
        let (views, frozen, id) = (Mutex::default(), AtomicBool::new(false), device.new_id());
        let mut image = Image {
            raw,
            allocation: None,
            views,
            frozen,
            id,
            desc: desc.clone(),
            is_own: true,
            device: Arc::clone(device),
        };
        let allocation = device.memory().allocate(
            id,
            (&desc.name, desc.owner),
            requirements,
            MemoryLocation::GpuOnly,
            false,
        )?;
        // SAFETY: the memory fits the requirements, and is freed only after the image.
        let bound = unsafe {
            device
                .raw()
                .bind_image_memory(raw, allocation.memory(), allocation.offset())
        };
        image.allocation = Some(allocation);
        bound.during(&format!("binding memory of the image {}", desc.name))?;
        device.set_name(raw, &desc.name);
        Ok(Arc::new(image))
    }

    /// An image of another program, which destroys it.
    pub(super) fn of_host(device: &Arc<Device>, raw: vk::Image, desc: &ImageDesc) -> Arc<Self> {
        Arc::new(Image {
            raw,
            allocation: None,
            views: Mutex::default(),
            frozen: AtomicBool::new(false),
            id: device.new_id(),
            desc: desc.clone(),
            is_own: false,
            device: Arc::clone(device),
        })
    }

    /// What the image was made from.
    pub fn desc(&self) -> &ImageDesc {
        &self.desc
    }

    /// Name for reports, errors and debuggers.
    pub fn name(&self) -> &str {
        &self.desc.name
    }

    /// Number of mips.
    pub fn mips(&self) -> u32 {
        self.desc.mips
    }

    /// Extent of one mip (texels).
    pub fn extent(&self, mip: u32) -> [u32; 3] {
        self.desc.extent.map(|texels| (texels >> mip).max(1))
    }

    /// Size of one layer of one mip, tightly packed (bytes); `None` for formats that are not copied
    /// to or from the host.
    pub fn mip_bytes(&self, mip: u32) -> Option<u64> {
        Some(
            self.extent(mip).into_iter().map(u64::from).product::<u64>()
                * texel_bytes(self.desc.format)?,
        )
    }

    pub(crate) fn id(&self) -> u64 {
        self.id
    }

    pub(crate) fn raw(&self) -> vk::Image {
        self.raw
    }

    /// From now on only read: material textures.
    pub(crate) fn freeze(&self) {
        self.frozen.store(true, Ordering::Relaxed);
    }

    pub(crate) fn is_frozen(&self) -> bool {
        self.frozen.load(Ordering::Relaxed)
    }

    pub(crate) fn aspect(&self) -> vk::ImageAspectFlags {
        match self.desc.format {
            vk::Format::D16_UNORM | vk::Format::D32_SFLOAT | vk::Format::X8_D24_UNORM_PACK32 => {
                vk::ImageAspectFlags::DEPTH
            }
            _ => vk::ImageAspectFlags::COLOR,
        }
    }

    /// All layers of a range of mips, in the image's own shape.
    pub(crate) fn view(&self, mips: Range<u32>) -> Result<vk::ImageView, Error> {
        let (first_mip, mips) = (mips.start, mips.end.saturating_sub(mips.start));
        self.cached_view(ViewKey {
            first_mip,
            mips,
            first_layer: 0,
            layers: self.desc.layers,
            kind: self.desc.kind,
        })
    }

    /// One layer of one mip in two dimensions, to render into.
    pub(crate) fn attachment_view(&self, mip: u32, layer: u32) -> Result<vk::ImageView, Error> {
        self.cached_view(ViewKey {
            first_mip: mip,
            mips: 1,
            first_layer: layer,
            layers: 1,
            kind: ImageKind::D2,
        })
    }

    /// The mips and layers that one of this image's views shows.
    pub(crate) fn shown_by(&self, view: vk::ImageView) -> Option<(Range<u32>, Range<u32>)> {
        let views = self.views.lock().unwrap_or_else(PoisonError::into_inner);
        let (key, _) = views.iter().find(|(_, known)| **known == view)?;
        Some((
            key.first_mip..key.first_mip + key.mips,
            key.first_layer..key.first_layer + key.layers,
        ))
    }

    fn cached_view(&self, key: ViewKey) -> Result<vk::ImageView, Error> {
        let mut views = self.views.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(view) = views.get(&key) {
            return Ok(*view);
        }
        let range = vk::ImageSubresourceRange::default()
            .aspect_mask(self.aspect())
            .base_mip_level(key.first_mip)
            .level_count(key.mips)
            .base_array_layer(key.first_layer)
            .layer_count(key.layers);
        let kind = match key.kind {
            ImageKind::D2 => vk::ImageViewType::TYPE_2D,
            ImageKind::D2Array => vk::ImageViewType::TYPE_2D_ARRAY,
            ImageKind::D3 => vk::ImageViewType::TYPE_3D,
        };
        let info = vk::ImageViewCreateInfo::default()
            .image(self.raw)
            .view_type(kind)
            .format(self.desc.format)
            .subresource_range(range);
        // SAFETY: the image is alive, and the graph asserts that the range lies inside it.
        let view = unsafe { self.device.raw().create_image_view(&info, None) }
            .during(&format!("creating a view of {}", self.desc.name))?;
        self.device.set_name(
            view,
            &format!("{} mips {}+{}", self.desc.name, key.first_mip, key.mips),
        );
        views.insert(key, view);
        Ok(view)
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: frames own what they use and are waited for, so the device no longer uses the
        // image or its views.
        unsafe {
            for view in self
                .views
                .get_mut()
                .unwrap_or_else(PoisonError::into_inner)
                .values()
            {
                self.device.raw().destroy_image_view(*view, None);
            }
            if self.is_own {
                self.device.raw().destroy_image(self.raw, None);
            }
        }
        if let Some(allocation) = self.allocation.take() {
            self.device.memory().free(self.id, allocation);
        }
        self.device.retire(self.id);
    }
}

fn check_limits(device: &Device, desc: &ImageDesc) -> Result<(), Error> {
    let info = desc.info();
    let (instance, physical) = (device.instance().raw(), device.adapter().raw);
    // SAFETY: a plain query of a living device.
    let limits = unsafe {
        instance.get_physical_device_image_format_properties(
            physical,
            info.format,
            info.image_type,
            info.tiling,
            info.usage,
            info.flags,
        )
    };
    let limits = limits.map_err(|_| Error::FormatUnsupported {
        resource: desc.name.clone(),
        format: desc.format,
        usage: info.usage,
    })?;
    let known = &device.adapter().limits;
    let along = if desc.kind == ImageKind::D3 {
        known.extent_3d
    } else {
        known.extent_2d
    };
    let most = [
        limits.max_extent.width,
        limits.max_extent.height,
        limits.max_extent.depth,
    ]
    .map(|most| most.min(along));
    let fits = desc
        .extent
        .iter()
        .zip(most)
        .all(|(&wanted, most)| wanted <= most);
    if fits && desc.mips <= limits.max_mip_levels && desc.layers <= limits.max_array_layers {
        return Ok(());
    }
    let text = |[x, y, z]: [u32; 3], mips: u32, layers: u32| {
        format!("{x}x{y}x{z} texels, {mips} mips, {layers} layers")
    };
    Err(Error::ImageTooLarge {
        resource: desc.name.clone(),
        wanted: text(desc.extent, desc.mips, desc.layers),
        available: text(most, limits.max_mip_levels, limits.max_array_layers),
    })
}

fn texel_bytes(format: vk::Format) -> Option<u64> {
    use vk::Format as F;
    match format {
        F::R8_UNORM | F::R8_UINT => Some(1),
        F::R8G8_UNORM | F::R16_SFLOAT | F::R16_UINT | F::R16_UNORM | F::D16_UNORM => Some(2),
        F::R8G8B8A8_UNORM
        | F::R8G8B8A8_SRGB
        | F::R8G8B8A8_UINT
        | F::B8G8R8A8_UNORM
        | F::B8G8R8A8_SRGB => Some(4),
        F::R16G16_SFLOAT
        | F::R16G16_UNORM
        | F::R16G16_UINT
        | F::A2B10G10R10_UNORM_PACK32
        | F::B10G11R11_UFLOAT_PACK32 => Some(4),
        F::R8G8B8A8_SNORM
        | F::R16G16_SNORM
        | F::R32_UINT
        | F::R32_SINT
        | F::R32_SFLOAT
        | F::D32_SFLOAT => Some(4),
        F::R16G16B16A16_SFLOAT
        | F::R16G16B16A16_UNORM
        | F::R16G16B16A16_UINT
        | F::R32G32_SFLOAT
        | F::R32G32_UINT => Some(8),
        F::R32G32B32A32_SFLOAT | F::R32G32B32A32_UINT => Some(16),
        _ => None,
    }
}
