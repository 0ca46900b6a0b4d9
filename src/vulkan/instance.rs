//! The Vulkan loader and instance.

use std::ffi::CStr;
use std::sync::Arc;

use ash::vk;

use super::debug::{Messages, Messenger};
use super::{Adapter, Context, Error, Faults};

/// RenderDoc's, which takes captures.
const CAPTURE_LAYER: &CStr = c"VK_LAYER_RENDERDOC_Capture";
const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// How to make an [`Instance`].
#[derive(Clone, Debug, Default)]
pub struct InstanceOptions {
    /// Load the Khronos validation layer with synchronization validation, and collect what it
    /// says.
    pub validate: bool,
    /// The same, and every access to a buffer is checked on the device.
    pub check_accesses: bool,
    /// RenderDoc sees what runs, and can take captures.
    pub captures: bool,
    /// The extensions that windows of a display need; none without a window.
    pub window_extensions: Vec<&'static CStr>,
    /// New memory is full of rubbish, for tests.
    #[doc(hidden)]
    pub poison: bool,
    /// What goes wrong, for tests.
    #[doc(hidden)]
    pub faults: Faults,
}

impl InstanceOptions {
    fn validates(&self) -> bool {
        self.validate || self.check_accesses
    }
}

/// The loader, opened at run time, and one instance.
pub struct Instance {
    raw: ash::Instance,
    messenger: Option<Messenger>,
    messages: Messages,
    debug_utils: bool,
    checks_accesses: bool,
    poisons: bool,
    faults: Faults,
    /// Whether it goes with this object.
    is_own: bool,
    // The loader must stay open for as long as anything above lives.
    entry: ash::Entry,
}

impl Instance {
    /// Opens the loader and makes an instance.
    pub fn new(options: &InstanceOptions) -> Result<Arc<Self>, Error> {
        let entry = open_loader()?;
        let validate = options.validates();
        if validate && !has_layer(&entry, VALIDATION_LAYER)? {
            return Err(Error::LayerMissing);
        }
        if options.captures && !has_layer(&entry, CAPTURE_LAYER)? {
            return Err(Error::CaptureLayerMissing);
        }
        let debug_utils = validate || has_extension(&entry, vk::EXT_DEBUG_UTILS_NAME)?;
        let messages = Messages::default();
        let raw = create(&entry, options, debug_utils, &messages)?;
        let messenger = if validate {
            Some(Messenger::new(&entry, &raw, &messages).during("creating the debug messenger")?)
        } else {
            None
        };
        let InstanceOptions {
            check_accesses: checks_accesses,
            poison: poisons,
            ..
        } = *options;
        Ok(Arc::new(Instance {
            raw,
            messenger,
            messages,
            debug_utils,
            checks_accesses,
            poisons,
            faults: options.faults.clone(),
            is_own: true,
            entry,
        }))
    }

    /// An instance of another program, which destroys it.
    pub(super) fn of_host(entry: ash::Entry, raw: ash::Instance) -> Arc<Self> {
        Arc::new(Instance {
            raw,
            messenger: None,
            messages: Messages::default(),
            debug_utils: false,
            checks_accesses: false,
            poisons: false,
            faults: Faults::default(),
            is_own: false,
            entry,
        })
    }

    /// All devices, in the driver's order, usable or not.
    pub fn adapters(&self) -> Result<Vec<Adapter>, Error> {
        // SAFETY: the instance is alive.
        let devices =
            unsafe { self.raw.enumerate_physical_devices() }.during("listing the devices")?;
        Ok(devices
            .into_iter()
            .enumerate()
            .map(|(index, raw)| Adapter::new(&self.raw, raw, index, &self.faults))
            .collect())
    }

    /// The validation messages; the handle stays valid after the instance is gone.
    pub fn messages(&self) -> &Messages {
        &self.messages
    }

    pub(super) fn raw(&self) -> &ash::Instance {
        &self.raw
    }

    #[cfg_attr(
        not(feature = "view"),
        expect(dead_code, reason = "windows alone ask the loader for more")
    )]
    pub(super) fn entry(&self) -> &ash::Entry {
        &self.entry
    }

    pub(super) fn is_validated(&self) -> bool {
        self.messenger.is_some()
    }

    pub(super) fn has_debug_utils(&self) -> bool {
        self.debug_utils
    }

    /// Whether the validation layer checks every access to a buffer.
    pub(super) fn checks_accesses(&self) -> bool {
        self.checks_accesses
    }

    pub(super) fn poisons(&self) -> bool {
        self.poisons
    }

    pub(super) fn faults(&self) -> &Faults {
        &self.faults
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some(messenger) = &self.messenger {
            messenger.destroy();
        }
        if self.is_own {
            // SAFETY: every device keeps its instance alive, so nothing made from it is left.
            unsafe { self.raw.destroy_instance(None) };
        }
    }
}

fn open_loader() -> Result<ash::Entry, Error> {
    // SAFETY: loading libvulkan runs its initialisers, which we trust as we trust the driver.
    let entry =
        unsafe { ash::Entry::load() }.map_err(|error| Error::NoLoader(error.to_string()))?;
    // SAFETY: the loader is open.
    let version = unsafe { entry.try_enumerate_instance_version() }
        .during("asking the loader's version")?
        .unwrap_or(vk::API_VERSION_1_0);
    if version < vk::API_VERSION_1_3 {
        return Err(Error::LoaderTooOld(super::adapter::version_text(version)));
    }
    Ok(entry)
}

fn has_layer(entry: &ash::Entry, name: &CStr) -> Result<bool, Error> {
    // SAFETY: the loader is open.
    let layers =
        unsafe { entry.enumerate_instance_layer_properties() }.during("listing the layers")?;
    Ok(layers
        .iter()
        .any(|layer| layer.layer_name_as_c_str() == Ok(name)))
}

fn has_extension(entry: &ash::Entry, name: &CStr) -> Result<bool, Error> {
    // SAFETY: the loader is open.
    let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }
        .during("listing the instance extensions")?;
    Ok(extensions
        .iter()
        .any(|extension| extension.extension_name_as_c_str() == Ok(name)))
}

fn create(
    entry: &ash::Entry,
    options: &InstanceOptions,
    debug_utils: bool,
    messages: &Messages,
) -> Result<ash::Instance, Error> {
    let validate = options.validates();
    let application = vk::ApplicationInfo::default()
        .application_name(c"lumivox")
        .api_version(vk::API_VERSION_1_3);
    let mut layers = Vec::new();
    let mut extensions = Vec::new();
    if options.captures {
        layers.push(CAPTURE_LAYER.as_ptr());
    }
    if debug_utils {
        extensions.push(vk::EXT_DEBUG_UTILS_NAME.as_ptr());
    }
    for name in &options.window_extensions {
        if !has_extension(entry, name)? {
            return Err(Error::FeatureMissing {
                what: "a window".to_owned(),
                feature: "an instance extension for surfaces of this display",
            });
        }
        extensions.push(name.as_ptr());
    }
    // Both structs are local: a struct that is pushed onto two chains makes a cycle.
    let enabled = [
        vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION,
        vk::ValidationFeatureEnableEXT::GPU_ASSISTED,
    ];
    let enabled = if options.check_accesses {
        &enabled[..]
    } else {
        &enabled[..1]
    };
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(enabled);
    let mut messenger = messages.create_info();
    if validate {
        layers.push(VALIDATION_LAYER.as_ptr());
        extensions.push(vk::EXT_VALIDATION_FEATURES_NAME.as_ptr());
    }
    // Without it the loader hides drivers over another interface, such as MoltenVK's. RenderDoc
    // does not know it.
    let shows_layered =
        !options.captures && has_extension(entry, vk::KHR_PORTABILITY_ENUMERATION_NAME)?;
    let mut flags = vk::InstanceCreateFlags::empty();
    if shows_layered {
        extensions.push(vk::KHR_PORTABILITY_ENUMERATION_NAME.as_ptr());
        flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
    }
    let mut info = vk::InstanceCreateInfo::default()
        .flags(flags)
        .application_info(&application)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extensions);
    if validate {
        info = info.push_next(&mut features).push_next(&mut messenger);
    }
    // SAFETY: all pointers in `info` live until the end of this function, and the message list for
    // as long as the instance.
    unsafe { entry.create_instance(&info, None) }.map_err(|result| match result {
        vk::Result::ERROR_INCOMPATIBLE_DRIVER => Error::NoDevice,
        result => Error::Vulkan {
            what: "creating the Vulkan instance".to_owned(),
            result,
        },
    })
}
