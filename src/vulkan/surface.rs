//! The surface of a window.

use std::any::Any;
use std::ffi::CStr;
use std::path::Path;
use std::sync::Arc;

use ash::vk;
use raw_window_handle::{HasDisplayHandle, HasWindowHandle, RawDisplayHandle};

use super::device::choose;
use super::{Context, Device, DeviceChoice, Error, Instance};

/// What a swapchain shows its pictures on.
pub struct Surface {
    raw: vk::SurfaceKHR,
    loader: ash::khr::surface::Instance,
    _instance: Arc<Instance>,
    /// The window must outlive its surface.
    _window: Arc<dyn Any + Send + Sync>,
}

/// What a physical device can do with a surface.
pub(super) struct SurfaceSupport {
    pub(super) capabilities: vk::SurfaceCapabilitiesKHR,
    pub(super) formats: Vec<vk::SurfaceFormatKHR>,
    pub(super) modes: Vec<vk::PresentModeKHR>,
}

impl Surface {
    /// The instance extensions that windows of a display need.
    pub fn extensions(display: RawDisplayHandle) -> Result<Vec<&'static CStr>, Error> {
        let names = ash_window::enumerate_required_extensions(display)
            .during("asking what windows of this display need")?;
        // SAFETY: ash-window answers with static C strings.
        Ok(names
            .iter()
            .map(|name| unsafe { CStr::from_ptr(*name) })
            .collect())
    }

    /// The surface of a window; the instance was made for the window's display.
    pub fn new<W: HasDisplayHandle + HasWindowHandle + Send + Sync + 'static>(
        instance: &Arc<Instance>,
        window: &Arc<W>,
    ) -> Result<Arc<Self>, Error> {
        let lost = |_| Error::SurfaceLost {
            what: "asking the window for its handle".to_owned(),
        };
        let display = window.display_handle().map_err(lost)?.as_raw();
        let handle = window.window_handle().map_err(lost)?.as_raw();
        // SAFETY: both handles are those of a living window, which this object keeps alive.
        let raw = unsafe {
            ash_window::create_surface(instance.entry(), instance.raw(), display, handle, None)
        }
        .during("making the window's surface")?;
        let loader = ash::khr::surface::Instance::new(instance.entry(), instance.raw());
        let window: Arc<dyn Any + Send + Sync> = Arc::<W>::clone(window);
        Ok(Arc::new(Surface {
            raw,
            loader,
            _instance: Arc::clone(instance),
            _window: window,
        }))
    }

    pub(super) fn raw(&self) -> vk::SurfaceKHR {
        self.raw
    }

    /// Whether a queue family can show pictures on it.
    pub(super) fn is_supported_by(&self, device: vk::PhysicalDevice, family: u32) -> bool {
        // SAFETY: device and surface are of this living instance.
        unsafe {
            self.loader
                .get_physical_device_surface_support(device, family, self.raw)
        }
        .unwrap_or(false)
    }

    pub(super) fn support(&self, device: vk::PhysicalDevice) -> Result<SurfaceSupport, Error> {
        let what = "asking what the window's surface can do";
        // SAFETY: device and surface are of this living instance.
        unsafe {
            Ok(SurfaceSupport {
                capabilities: self
                    .loader
                    .get_physical_device_surface_capabilities(device, self.raw)
                    .during(what)?,
                formats: self
                    .loader
                    .get_physical_device_surface_formats(device, self.raw)
                    .during(what)?,
                modes: self
                    .loader
                    .get_physical_device_surface_present_modes(device, self.raw)
                    .during(what)?,
            })
        }
    }
}

impl Device {
    /// Chooses and opens a device that can show pictures on a surface. Compiled pipelines are kept
    /// in `cache_dir`.
    pub fn for_surface(
        instance: &Arc<Instance>,
        choice: &DeviceChoice,
        surface: &Surface,
        cache_dir: Option<&Path>,
    ) -> Result<Arc<Self>, Error> {
        let mut fitting = Vec::new();
        for adapter in instance.adapters()? {
            if adapter
                .queue_family
                .is_some_and(|family| surface.is_supported_by(adapter.raw, family))
            {
                fitting.push(adapter);
            }
        }
        if fitting.is_empty() {
            return Err(Error::NoPresent);
        }
        Self::of(instance, choose(fitting, choice)?, (true, cache_dir))
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: every swapchain keeps its surface alive, so none is left.
        unsafe { self.loader.destroy_surface(self.raw, None) };
    }
}
