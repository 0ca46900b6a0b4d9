//! What is seen at each pixel centre: the guide by which metrics form blocks and tell materials
//! apart.

use glam::Vec3;

/// The material index of a pixel that sees no surface.
pub const NO_SURFACE: u32 = u32::MAX;

/// Geometry at the pixel centres, row 0 at the top; every vector has `width × height` entries.
#[derive(Clone, Debug, PartialEq)]
pub struct GuideImage {
    /// Width of the image (px).
    pub width: u32,
    /// Height of the image (px).
    pub height: u32,
    /// World-space position (m); zero where nothing is seen.
    pub position: Vec<Vec3>,
    /// Unit geometric normal on the camera's side; zero where nothing is seen.
    pub normal: Vec<Vec3>,
    /// Distance along the view axis (m); zero where nothing is seen.
    pub depth_m: Vec<f32>,
    /// Index into the scene's materials, or [`NO_SURFACE`].
    pub material: Vec<u32>,
}

impl GuideImage {
    /// A guide that sees nothing.
    pub fn new(width: u32, height: u32) -> Self {
        let count = width as usize * height as usize;
        GuideImage {
            width,
            height,
            position: vec![Vec3::ZERO; count],
            normal: vec![Vec3::ZERO; count],
            depth_m: vec![0.0; count],
            material: vec![NO_SURFACE; count],
        }
    }

    /// Whether the pixel at row-major `index` sees a surface.
    pub fn is_surface(&self, index: usize) -> bool {
        self.material[index] != NO_SURFACE
    }
}
