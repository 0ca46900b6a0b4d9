//! Points of surfaces, and light that leaves them.

use glam::Vec3;

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// World-space position (m).
    pub position: Vec3,
    /// Unit geometric normal on the side that is seen.
    pub normal: Vec3,
}

/// What the analytic lights make of a point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LitPoint {
    /// The point, seen from the front of its triangle.
    pub surface: SurfacePoint,
    /// Diffuse radiance ρ/π Σ E cos θ V that leaves the front and the back [W/(m² sr)].
    pub radiance: [Vec3; 2],
}
