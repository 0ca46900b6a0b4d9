//! `lumivox voxelize`: a scene's voxels as a file for other programs.

use std::path::PathBuf;

use lumivox::gi::Context;
use lumivox::gi::registry::TECHNIQUES;
use lumivox::gi::shared::voxel::export::ExportFormat;
use lumivox::graph::Gpu;
use lumivox::render::GpuScene;

use super::CliError;
use super::common::{DeviceArgs, SceneArgs, TechniqueArgs, check_output, say};

/// Write the voxels that a technique makes of a scene.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    technique: TechniqueArgs,
    /// Voxels along the largest extent of the scene, as --set resolution=N [default: the preset's
    /// own].
    #[arg(long, value_name = "N")]
    resolution: Option<u32>,
    #[command(flatten)]
    device: DeviceArgs,
    /// The file: .vox (MagicaVoxel), .ply (points, binary) or .json (grid, coordinates, albedo,
    /// normal, opacity).
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

/// Loads, voxelizes, writes.
pub(crate) fn run(args: &Args, quiet: bool) -> Result<(), CliError> {
    ExportFormat::of(&args.output).map_err(CliError::input)?;
    let resolution = args
        .resolution
        .map(|resolution| format!("resolution={resolution}"));
    let (entry, settings) = args.technique.choose(resolution)?;
    let Some(list_voxels) = entry.voxels else {
        let known: Vec<&str> = TECHNIQUES
            .iter()
            .filter(|entry| entry.voxels.is_some())
            .map(|entry| entry.name)
            .collect();
        return Err(CliError::input(format!(
            "technique {} has no voxels; name one that has: {}",
            entry.name,
            known.join(", ")
        )));
    };
    check_output(&args.output)?;
    let scene = args.scene.open()?;
    let gpu = Gpu::new(&args.device.options()?).map_err(CliError::failed)?;
    let gpu_scene = GpuScene::new(&gpu, &scene).map_err(CliError::failed)?;
    let voxels = list_voxels(
        &Context {
            gpu: &gpu,
            scene: &gpu_scene,
            size: [1; 2],
            eye: glam::Vec3::ZERO,
        },
        &settings,
    )
    .map_err(CliError::failed)?;
    voxels
        .write(&args.output, &scene.name, entry.name)
        .map_err(CliError::failed)?;
    if !quiet {
        let (grid, origin) = (&voxels.grid, voxels.grid.origin.to_array());
        say(&format!(
            "{}: {} of {}³ voxels, {} m each, the smallest corner at {origin:?} m",
            args.output.display(),
            voxels.voxels.len(),
            grid.resolution,
            grid.voxel_size
        ));
    }
    Ok(())
}
