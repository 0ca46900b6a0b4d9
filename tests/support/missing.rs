//! Which settings a device is right to refuse.

use lumivox::gi::Settings;
use lumivox::graph::Gpu;
use lumivox::vulkan::IMAGE_ATOMICS;

/// The feature that these settings need and the device lacks, by its name in `lumivox devices`:
/// only then may [`lumivox::graph::Error::FeatureMissing`] be answered, and with this name.
/// (Marches that are too long for the loops of shaders are refused with the same error; no small
/// grid has them.)
pub fn expected_missing(gpu: &Gpu, settings: &Settings) -> Option<&'static str> {
    let features = gpu.features();
    let geometry = ("geometryShader", features.geometry_shader);
    let mut needed = match settings.find_choice("voxelization") {
        Some("raster") => vec![geometry],
        Some("raster-hw") => vec![
            geometry,
            (
                "VK_EXT_conservative_rasterization",
                features.conservative_rasterization,
            ),
        ],
        _ => vec![],
    };
    if settings.find_choice("accumulation") == Some("running-average") {
        needed.insert(0, (IMAGE_ATOMICS, features.image_atomics));
    }
    needed
        .into_iter()
        .find(|(_, present)| !present)
        .map(|(name, _)| name)
}
