//! Lumivox in the frames of the other program.

use ash::vk;
use lumivox::frame::{FrameSettings, Renderer};
use lumivox::gi::registry::find;
use lumivox::graph::{
    Device, Features, Gpu, GpuOptions, Handover, HostCommands, HostDevice, Image, ImageDesc,
    ImageKind, ImageUsage, Owner,
};
use lumivox::scene::{Camera, Scene};

use super::host::{Failure, Host, Target};

/// What these cameras see of a scene [W/(m² sr)], each in a frame of the other program.
pub fn pictures(
    host: &Host,
    target: &Target,
    (scene, technique): (&Scene, &str),
    settings: FrameSettings,
    cameras: &[Camera],
) -> Result<Vec<Vec<[f32; 4]>>, Failure> {
    let host_device = HostDevice {
        entry: host.entry.clone(),
        instance: host.instance.clone(),
        physical_device: host.physical_device,
        device: host.device.clone(),
        queue_family: host.queue_family,
        queue: host.queue,
        enabled: Features::default(),
    };
    // SAFETY: the host outlives all of this, uses its queue only in `Host::frame`, and its device
    // has the features of `HostDevice::REQUIRED`.
    let device = unsafe { Device::from_ash(host_device, None) }?;
    let gpu = Gpu::on(device, &GpuOptions::default())?;
    let entry = find(technique)?;
    let chosen = entry.settings::<&str>(None, &[])?;
    let (mut renderer, _) = Renderer::new(&gpu, scene, entry, &chosen, settings)?;
    let desc = ImageDesc {
        name: "target".into(),
        extent: [settings.size[0], settings.size[1], 1],
        kind: ImageKind::D2,
        format: vk::Format::R32G32B32A32_SFLOAT,
        mips: 1,
        layers: 1,
        usage: ImageUsage::SAMPLED,
        owner: Owner::Screen,
    };
    let handover = Handover {
        // SAFETY: the host has made it so, and destroys it last.
        image: unsafe { Image::from_ash(gpu.device(), target.image, &desc) },
        before: vk::ImageLayout::UNDEFINED,
        after: vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
    };
    let mut frame = |camera: &Camera| {
        host.frame(target, |commands| {
            // SAFETY: the host has begun it, and records nothing meanwhile.
            let commands = unsafe { HostCommands::from_ash(gpu.device(), commands) };
            Ok(renderer.record(camera, &commands, &handover)?)
        })
    };
    cameras.iter().map(&mut frame).collect()
}
