//! Validation messages, and names and labels for debuggers.

use std::ffi::{CStr, CString, c_void};
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;

/// Every validation warning and error of one instance, from its creation to after its destruction.
#[derive(Clone, Debug, Default)]
pub struct Messages(Arc<Mutex<Vec<String>>>);

/// The messages of every instance of this process.
static OF_PROCESS: Mutex<Vec<String>> = Mutex::new(Vec::new());

impl Messages {
    /// All messages of every instance so far, those among them that were taken out, and of
    /// instances that are gone.
    pub fn of_process() -> Vec<String> {
        OF_PROCESS
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    /// All messages so far, oldest first.
    pub fn list(&self) -> Vec<String> {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    /// Takes the messages out, for tests that provoke them.
    pub fn take(&self) -> Vec<String> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn push(&self, message: String) {
        OF_PROCESS
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(message.clone());
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(message);
    }

    /// The callback's description; the instance keeps `self` alive for as long as the callback may
    /// be called.
    pub(crate) fn create_info(&self) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
        vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::WARNING
                    | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            )
            .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
            .pfn_user_callback(Some(collect))
            .user_data(Arc::as_ptr(&self.0).cast_mut().cast())
    }
}

/// Called by the validation layer, on any thread.
unsafe extern "system" fn collect(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid data, and `user` is the list that the instance keeps alive
    // (see `Messages::create_info`).
    unsafe {
        if let (Some(data), Some(list)) =
            (data.as_ref(), user.cast::<Mutex<Vec<String>>>().as_ref())
        {
            let text = if data.p_message.is_null() {
                String::new()
            } else {
                CStr::from_ptr(data.p_message)
                    .to_string_lossy()
                    .into_owned()
            };
            log::debug!("validation: {text}");
            OF_PROCESS
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(text.clone());
            list.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(text);
        }
    }
    vk::FALSE
}

/// The messenger of one instance.
pub(crate) struct Messenger {
    loader: ash::ext::debug_utils::Instance,
    raw: vk::DebugUtilsMessengerEXT,
}

impl Messenger {
    /// Starts collecting into `messages`.
    pub(crate) fn new(
        entry: &ash::Entry,
        instance: &ash::Instance,
        messages: &Messages,
    ) -> Result<Self, vk::Result> {
        let loader = ash::ext::debug_utils::Instance::new(entry, instance);
        // SAFETY: the instance has VK_EXT_debug_utils enabled, and outlives the messenger.
        let raw = unsafe { loader.create_debug_utils_messenger(&messages.create_info(), None) }?;
        Ok(Messenger { loader, raw })
    }

    /// Ends collecting; called once, right before the instance is destroyed.
    pub(crate) fn destroy(&self) {
        // SAFETY: the messenger is alive and not used again.
        unsafe { self.loader.destroy_debug_utils_messenger(self.raw, None) };
    }
}

/// Turns a name into a C string; a zero byte inside ends the name.
pub(crate) fn c_name(name: &str) -> CString {
    let end = name.find('\0').unwrap_or(name.len());
    CString::new(&name[..end]).unwrap_or_default()
}

/// Adds one message from our own checks, so that tests see them with the layer's.
pub(crate) fn report(messages: &Messages, message: String) {
    log::error!("{message}");
    messages.push(message);
}
