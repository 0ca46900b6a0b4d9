//! Passes as data, frames as lists of passes, and the barriers between them.
//!
//! A technique declares its passes as [`Pass`] statics, keeps its resources, and writes a
//! [`Frame`]; [`Gpu::submit`] plans, records, runs and times it.
//!
//! ```no_run
//! use lumivox::graph::{Access, Binding, BufferDesc, BufferUsage, Frame, Gpu, GpuOptions};
//! use lumivox::graph::{Owner, Pass, Sets, Shaders};
//! use lumivox::shader::Field;
//!
//! static DOUBLE: Pass = Pass {
//!     name: "test.double",
//!     shaders: Shaders::Compute("test/double.comp"),
//!     bindings: &[Binding::buffer("values", Access::ComputeReadWrite)],
//!     constants: &["WORKGROUP"],
//!     params: Some(("Params", &[Field { name: "count", offset: 0, size: 4 }])),
//!     sets: Sets::None,
//! };
//!
//! # fn main() -> Result<(), lumivox::graph::Error> {
//! let gpu = Gpu::new(&GpuOptions::default())?;
//! let values = gpu.create_buffer(&BufferDesc {
//!     name: "values".into(),
//!     size_bytes: 256,
//!     usage: BufferUsage::Storage,
//!     owner: Owner::Shared,
//! })?;
//! let mut frame = Frame::new();
//! frame.fill("values.fill", &values, 3);
//! let pass = frame.pass(&DOUBLE).bind("values", &values);
//! pass.constant("WORKGROUP", 64u32).push(&64u32).dispatch([1, 1, 1]);
//! let stats = gpu.submit(frame)?;
//! println!("{:?} {:?}", stats.passes, gpu.read_buffer(&values)?);
//! # Ok(())
//! # }
//! ```

mod access;
mod build;
mod builder;
pub mod compute;
mod frame;
mod gpu;
mod journal;
mod pace;
pub mod pass;
pub mod plan;
mod record;
mod runner;
mod sets;
pub mod stats;
#[cfg(feature = "tracy")]
mod tracy;
mod transfer;

pub use access::{Access, Sync};
pub use build::Corners;
pub use builder::{BatchDispatch, ClearOrLoad, DrawBatch, PassBuilder, Targets};
pub use frame::{Bound, ClearValue, Frame, Resource};
pub use gpu::{Gpu, GpuOptions, ScreenFormat};
#[doc(hidden)]
pub use journal::{Issued, IssuedBarrier, JournalFrame, Touch};
pub use pass::{
    Binding, BindingKind, DepthBias, Pass, RasterState, SCENE_CONSTANTS, Sets, Shaders,
};
pub use runner::{FRAMES_IN_FLIGHT, Recorded};
pub use sets::{MATERIAL_TEXTURES, MaterialSet, MaterialSets, SceneBindings, SceneSet};
pub use stats::{FrameStats, HostWork, PassTime, PassTimes, Spread, TimesAccumulator};

pub use crate::vulkan::{
    AccelerationStructure, Buffer, BufferDesc, BufferUsage, Device, DeviceChoice, DeviceInfo,
    DeviceKind, Error, Faults, Features, Handover, HostCommands, HostDevice, Image, ImageDesc,
    ImageKind, ImageUsage, Limits, Loops, Messages, Owner, vk,
};
