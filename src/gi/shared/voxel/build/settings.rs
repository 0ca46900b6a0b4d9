//! What to voxelize into, and how.

use crate::gi::Settings;
use crate::gi::shared::voxel::Faces;

/// How triangles become fragments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// A compute shader.
    Compute,
    /// Rasterization with triangles enlarged by the geometry shader.
    Raster,
    /// Rasterization with hardware conservative rasterization.
    RasterHw,
}

/// How the albedo of a voxel is averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Accumulation {
    /// Integer sums: independent of thread order.
    Exact,
    /// Compare-and-swap moving average: depends on thread order.
    RunningAverage,
}

/// Which voxels a triangle is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// All that it touches: 26-separating, and no part of the triangle is outside.
    Conservative,
    /// The voxels whose cross it meets, the three lines between the centres of opposite faces:
    /// 6-separating (Schwarz & Seidel 2010).
    Thin,
    /// All that it touches, and those inside of closed bodies.
    Solid,
}

/// What to voxelize into, and how.
#[derive(Clone, Copy, Debug)]
pub struct VoxelSettings {
    /// Voxels along an edge.
    pub resolution: u32,
    /// How triangles become fragments.
    pub method: Method,
    /// How albedo is averaged.
    pub accumulation: Accumulation,
    /// Which voxels a triangle is in.
    pub surface: Surface,
    /// Opacity is the covered fraction of the voxel's face, not 1.
    pub coverage: bool,
    /// Opacities of the faces of directional voxels, where those are wanted.
    pub faces: Option<Faces>,
}

impl VoxelSettings {
    /// Exact voxels of all that surfaces touch, by compute shaders.
    pub fn exact(resolution: u32) -> Self {
        VoxelSettings {
            resolution,
            method: Method::Compute,
            accumulation: Accumulation::Exact,
            surface: Surface::Conservative,
            coverage: false,
            faces: None,
        }
    }

    /// From a technique's settings, without faces.
    pub fn new(settings: &Settings) -> Self {
        let method = if settings.is("voxelization", "compute") {
            Method::Compute
        } else if settings.is("voxelization", "raster") {
            Method::Raster
        } else {
            Method::RasterHw
        };
        VoxelSettings {
            resolution: settings.count("resolution"),
            method,
            accumulation: if settings.is("accumulation", "exact") {
                Accumulation::Exact
            } else {
                Accumulation::RunningAverage
            },
            surface: match settings.choice("surface") {
                "thin" => Surface::Thin,
                "solid" => Surface::Solid,
                _ => Surface::Conservative,
            },
            coverage: settings.is("opacity", "coverage"),
            faces: None,
        }
    }
}
