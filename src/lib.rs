//! Real-time global illumination techniques side by side, on one scene, measured against a
//! path-traced reference.
//!
//! # The contract
//!
//! All light is linear RGB in physical units, without hidden scale factors; lengths are metres.
//!
//! | quantity | unit | where |
//! | --- | --- | --- |
//! | irradiance E | W/m² | directional lights, across the beam; what a technique gathers |
//! | radiance L | W/(m² sr) | emission (`Ke`, front sides only), environment, every image |
//! | intensity I | W/sr | point and spot lights, inverse-square falloff |
//! | flux Φ | W | the texels of a reflective shadow map |
//! | albedo ρ | 1, in \[0, 1\] | Lambertian: L = ρ/π · E |
//!
//! Every technique answers one question: given the G-buffer, what are, at each pixel, the indirect
//! diffuse irradiance E_i, the indirect specular radiance L_s and the ambient visibility
//! ([`gi::IndirectLight`])? One shared pass composites L = L_e + L_direct + ρ/π · E_i + L_s, so
//! techniques differ in nothing else. A technique states its number of bounces
//! ([`gi::entry::Entry::bounces`]) and is compared with the [`mod@reference`] at that number.
//! Images are linear; exposure and sRGB are for looking only.
//!
//! # Words
//!
//! *Technique*: one complete way to compute indirect light, a row of [`gi::registry`].
//! *Voxel fragment*: one triangle's share of one voxel. *Voxel mips*: dense 3D textures with a full
//! mip chain. *RSM*: reflective shadow map. *Injection*: direct light written into a structure.
//! *Cone*: origin, direction, aperture γ, sampled front to back with diameter d = 2 t tan(γ/2).
//! *Reference*: the path tracer's image of the same scene, camera and number of bounces. *Block*:
//! 8×8 pixels on one plane and one material ([`metrics`]).
//!
//! # The frame in ten lines
//!
//! From [`frame::Renderer::render`]:
//!
//! ```text
//! frame.set_scene(set, materials)       vertices, materials, textures, lights, camera
//! maps.draw(frame, scene)               shadow maps, or reflective shadow maps, as it needs
//! gbuffer.draw(frame, scene)            depth, normal, albedo, roughness, emission of each pixel
//! technique.update(frame, given)        this frame's light into the world-space store
//! screen.light(frame, technique, ...)   IndirectLight: E, L, ambient visibility of each pixel
//! output.draw_direct(frame, ...)        L_direct
//! output.draw_composite(frame, ...)     L = L_e + L_direct + ρ/π · E_i + L_s
//! gpu.submit(frame)                     plan barriers, record, run, time every pass
//! ```
//!
//! And from outside:
//!
//! ```no_run
//! use lumivox::frame::{FrameSettings, Renderer};
//! use lumivox::gi::registry::find;
//! use lumivox::graph::{Gpu, GpuOptions};
//! use lumivox::image::{Aov, write_exr};
//! use lumivox::render::ShadowSettings;
//! use lumivox::scene::{LoadOptions, Scene};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scene = Scene::open("bundled:cornell", &LoadOptions::default())?;
//! let gpu = Gpu::new(&GpuOptions::default())?;
//! let technique = find("voxel-mips")?;
//! let settings = technique.settings(None, &["resolution=64"])?;
//! let frame = FrameSettings {
//!     size: [640, 480],
//!     shadows: ShadowSettings::of_resolution(1024),
//! };
//! let (mut renderer, _build) = Renderer::new(&gpu, &scene, technique, &settings, frame)?;
//! let stats = renderer.render(&scene.camera)?;
//! println!("{:?}", stats.passes);
//! write_exr("cornell.exr".as_ref(), &renderer.aov(Aov::Indirect)?)?;
//! # Ok(())
//! # }
//! ```
//!
//! A program that has a device, an image and a command buffer already has its frames drawn there:
//! [`vulkan::Device::from_ash`], [`graph::Gpu::on`] and [`frame::Renderer::record`].
//!
//! # The modules
//!
//! Each uses only those above it; [`mod@reference`], [`mod@image`] and [`metrics`] stand apart and
//! know of [`scene`] alone.
//!
//! | module | holds |
//! | --- | --- |
//! | [`vulkan`] | the only unsafe code: instance, device, memory, resources, pipelines, commands |
//! | [`shader`] | the embedded SPIR-V, and the structs that Rust and GLSL share |
//! | [`graph`] | passes as data, the pure barrier planner, recording, timing |
//! | [`scene`] | the scene on the CPU: OBJ, TOML, textures, bundled scenes |
//! | [`render`] | the passes that all techniques share |
//! | [`gi`] | the techniques |
//! | [`frame`] | the frame, top to bottom |
//! | [`view`] | the windowed demo (feature `view`) |
//! | [`measure`] | times, memory, counts and error of a run, as JSON (feature `measure`) |
//! | [`cli`] | the command line (feature `program`) |
//! | [`mod@reference`] | the CPU path tracer, ground truth |
//! | [`mod@image`] | linear float images, EXR and PNG |
//! | [`metrics`] | error and stability |

#[cfg(feature = "program")]
pub mod cli;
pub mod frame;
pub mod gi;
pub mod graph;
pub mod image;
#[cfg(feature = "measure")]
pub mod measure;
pub mod metrics;
pub mod output;
pub mod reference;
pub mod render;
pub mod scene;
pub mod shader;
mod text;
#[cfg(feature = "view")]
pub mod view;
pub mod vulkan;
