//! Global illumination in a program that has a device, an image and a command buffer already.
//!
//! ```sh
//! cargo run --release --example embed -- bundled:cornell embed.exr
//! ```
#![allow(unsafe_code, missing_docs, unreachable_pub)]

mod embedded;
mod host;

use std::ffi::OsString;
use std::path::Path;

use glam::Vec3;
use host::{Failure, Host};
use lumivox::frame::FrameSettings;
use lumivox::image::{Image, write_exr};
use lumivox::render::ShadowSettings;
use lumivox::scene::{LoadOptions, Scene};

const SIZE: [u32; 2] = [320, 240];

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args_os().skip(1);
    let mut next = |default: &str| arguments.next().unwrap_or_else(|| OsString::from(default));
    let (scene, output) = (next("bundled:cornell"), next("embed.exr"));
    let scene = Scene::open(&scene, &LoadOptions::default())?;
    let settings = FrameSettings {
        size: SIZE,
        shadows: ShadowSettings::of_resolution(1024),
    };
    let host = Host::new(false)?;
    let target = host.target(SIZE)?;
    let of = (&scene, "voxel-mips");
    let pictures = embedded::pictures(&host, &target, of, settings, &[scene.camera])?;
    let pixel = |index: usize| {
        let [r, g, b, _] = pictures[0][index];
        Vec3::new(r, g, b)
    };
    write_exr(Path::new(&output), &Image::from_fn(SIZE[0], SIZE[1], pixel))?;
    host.destroy(&target);
    host.end();
    println!("{}", Path::new(&output).display());
    Ok(())
}
