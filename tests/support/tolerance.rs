//! What tests allow a device, by its class.

use std::sync::OnceLock;

use lumivox::vulkan::{Instance, InstanceOptions};

/// What a device rounds beyond what shaders say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceClass {
    /// Mesa's llvmpipe. It filters textures with weights of 24 bits and rounds corners to 1/256 px;
    /// versions 22.3 and 25.0 give the same bits. Golden pictures are its own.
    Llvmpipe,
    /// Any other driver. It may filter with weights of 4 bits (`subTexelPrecisionBits`; an H200 has
    /// 8), round corners to 1/16 px (`subPixelPrecisionBits`, as SwiftShader does), and divide to
    /// 2.5 units in the last place: what lies at an edge or at a tie falls to the other side.
    Other,
}

/// The class of the device that tests run on: llvmpipe only where nothing else is there.
pub fn device_class() -> DeviceClass {
    static CLASS: OnceLock<DeviceClass> = OnceLock::new();
    *CLASS.get_or_init(|| {
        let instance = Instance::new(&InstanceOptions::default()).unwrap();
        let adapters = instance.adapters().unwrap();
        let is_llvmpipe = |driver: &str| driver.starts_with("llvmpipe");
        if adapters.iter().all(|one| is_llvmpipe(&one.info.driver)) {
            DeviceClass::Llvmpipe
        } else {
            DeviceClass::Other
        }
    })
}

impl DeviceClass {
    /// The first on llvmpipe, the second on any other device.
    pub fn allows<T>(self, llvmpipe: T, other: T) -> T {
        match self {
            DeviceClass::Llvmpipe => llvmpipe,
            DeviceClass::Other => other,
        }
    }
}
