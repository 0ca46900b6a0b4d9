//! `lumivox scene`: lists the bundled scenes and writes one to files.

use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

use crate::scene::{Scene, SceneError, bundled};
use crate::text::{counted, vector};

use super::CliError;
use super::common::{LoadArgs, say};
use super::write::check_output_folder;

/// List the bundled scenes, or write one (or a copy of any scene) as TOML, OBJ, MTL and PNG files,
/// or as glTF.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n\
\x20 lumivox scene --list\n\
\x20 lumivox scene bundled:two-rooms --set door=0.5 -o two-rooms\n\
\x20 lumivox scene bundled:atrium --format gltf -o atrium\n\
\x20 lumivox scene bundled:atrium --with 'environment.clear_sky = {}' -o outdoors")]
pub(crate) struct Args {
    /// A bundled scene's name, or the path of a .toml, .obj, .gltf or .glb file.
    #[arg(required_unless_present = "list")]
    scene: Option<OsString>,
    /// List the bundled scenes with their parameters.
    #[arg(long, conflicts_with_all = ["scene", "output", "set", "with"])]
    list: bool,
    /// Folder to write into; made where it does not exist. Without it, the scene is only
    /// described.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Which files to write: obj for TOML, OBJ, MTL and PNG, or gltf for glTF 2.0 and PNG.
    #[arg(long, value_enum, default_value_t = Format::Obj, requires = "output")]
    format: Format,
    /// A parameter of the bundled scene (repeatable).
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// TOML in the scene format that replaces the camera, the lights or the environment
    /// (repeatable).
    #[arg(long, value_name = "TOML")]
    with: Vec<String>,
    #[command(flatten)]
    load: LoadArgs,
}

/// What a scene is written as.
#[derive(Clone, Copy, clap::ValueEnum)]
enum Format {
    Obj,
    Gltf,
}

/// Lists, or loads and writes.
pub(crate) fn run(args: &Args) -> Result<(), CliError> {
    let Some(name) = args.scene.as_ref().filter(|_| !args.list) else {
        print_list();
        return Ok(());
    };
    if let Some(folder) = &args.output {
        check_output_folder(folder)?;
    }
    let mut scene = open(name, args).map_err(CliError::input)?;
    args.with
        .iter()
        .try_for_each(|text| scene.overlay("--with", text))
        .map_err(CliError::input)?;
    print_summary(&scene);
    if let Some(folder) = &args.output {
        let path = match args.format {
            Format::Obj => scene.write(folder),
            Format::Gltf => scene.write_gltf(folder),
        };
        let path = path.map_err(CliError::failed)?;
        say(&format!("written to {}", path.display()));
    }
    Ok(())
}

fn open(source: &OsStr, args: &Args) -> Result<Scene, SceneError> {
    // What is not UTF-8 is no bundled scene's name, but may well be a path.
    let name = source.to_string_lossy();
    let is_bundled = bundled::TABLE.iter().any(|row| row.name == name);
    let looks_like_path = source.to_str().is_none() || name.contains(['/', '\\', '.', ':']);
    if looks_like_path && !is_bundled && args.set.is_empty() {
        return Scene::open(source, &args.load.options());
    }
    let name = name.strip_prefix("bundled:").unwrap_or(&name);
    let parameters = args
        .set
        .iter()
        .map(|text| bundled::parse_parameter(name, text))
        .collect::<Result<Vec<_>, _>>()?;
    Scene::bundled(name, &parameters)
}

fn print_list() {
    for row in bundled::TABLE {
        say(&format!("{:18}{}", row.name, row.description));
        for parameter in row.parameters {
            let unit = if parameter.unit.is_empty() {
                String::new()
            } else {
                format!(" [{}]", parameter.unit)
            };
            let range = format!(
                "{} to {}, default {}",
                parameter.min, parameter.max, parameter.default
            );
            say(&format!(
                "{:18}  {}{unit}: {}; {range}",
                "", parameter.name, parameter.description
            ));
        }
    }
}

fn print_summary(scene: &Scene) {
    say(&format!(
        "{}: {}, {}, {}, {}, {}",
        scene.name,
        counted(scene.triangles.len(), "triangle"),
        counted(scene.vertices.len(), "vertex"),
        counted(scene.materials.len(), "material"),
        counted(scene.textures.len(), "texture"),
        counted(scene.lights.len(), "light")
    ));
    if let Some((low, high)) = scene.bounds() {
        say(&format!(
            "bounds: {} to {} m",
            vector(low.to_array()),
            vector(high.to_array())
        ));
    }
}
