//! `lumivox voxelize`: a scene's voxels as a file for other programs.

use std::path::PathBuf;

use crate::gi::Context;
use crate::gi::entry::Entry;
use crate::gi::registry;
use crate::gi::shared::voxel::export::ExportFormat;
use crate::gi::shared::voxel::list_voxels;
use crate::gi::voxel_cones::{mips, svo};
use crate::graph::Gpu;
use crate::render::GpuScene;
use crate::text::vector;

use super::CliError;
use super::common::{DeviceArgs, SceneArgs, TechniqueArgs, say};
use super::files::Files;

/// The techniques whose voxels are all of one size, in one grid.
static ONE_GRID: &[&Entry] = &[&mips::ENTRY, &svo::ENTRY];

/// Write the voxels that a technique makes of a scene.
#[derive(clap::Args)]
#[command(after_help = "Example:\n\
\x20 lumivox voxelize bundled:cornell --resolution 64 -o cornell.vox")]
pub(crate) struct Args {
    /// Voxels along the largest extent of the scene, as --set resolution=N [default: the preset's
    /// own].
    #[arg(long, value_name = "N")]
    resolution: Option<u32>,
    /// The file: .vox (MagicaVoxel), .ply (points, binary) or .json (grid, coordinates, albedo,
    /// normal, opacity).
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    technique: TechniqueArgs,
    #[command(flatten)]
    device: DeviceArgs,
}

/// Loads, voxelizes, writes.
pub(crate) fn run(args: &Args, quiet: bool) -> Result<(), CliError> {
    ExportFormat::of(&args.output).map_err(CliError::input)?;
    let resolution = args
        .resolution
        .map(|resolution| format!("resolution={resolution}"));
    let (entry, settings) = args.technique.choose(resolution)?;
    if ONE_GRID.iter().all(|known| known.name != entry.name) {
        let known: Vec<&str> = ONE_GRID.iter().map(|entry| entry.name).collect();
        return Err(CliError::input(format!(
            "technique {} has no voxels; name one that has: {}",
            entry.name,
            known.join(", ")
        )));
    }
    let mut files = Files::default();
    files.write(&args.output, &["vox", "ply", "json"])?;
    let scene = args.scene.open(&mut files)?;
    let gpu = Gpu::new(&args.device.options()?).map_err(CliError::failed)?;
    let gpu_scene = GpuScene::new(&gpu, &scene).map_err(CliError::failed)?;
    let voxels = list_voxels(
        &Context {
            gpu: &gpu,
            scene: &gpu_scene,
            size: [1; 2],
            eye: glam::Vec3::ZERO,
            lend: registry::lend,
        },
        &settings,
    )
    .map_err(CliError::failed)?;
    voxels
        .write(&args.output, &scene.name, entry.name)
        .map_err(CliError::failed)?;
    if !quiet {
        let grid = &voxels.grid;
        say(&format!(
            "{}: {} of {}³ voxels, {} m each, the smallest corner at {} m",
            args.output.display(),
            voxels.voxels.len(),
            grid.resolution,
            grid.voxel_size,
            vector(grid.origin.to_array())
        ));
    }
    Ok(())
}
