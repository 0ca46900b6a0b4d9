//! The pinhole camera.

use glam::{Mat4, Quat, Vec2, Vec3, Vec4};

/// A pinhole camera; right-handed, looking along −z of its view space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position \[m\].
    pub eye: Vec3,
    /// Point looked at \[m\].
    pub target: Vec3,
    /// Up direction, not parallel to the view direction.
    pub up: Vec3,
    /// Vertical field of view \[degrees\], 1 to 175.
    pub vfov_deg: f32,
}

impl Default for Camera {
    fn default() -> Self {
        Camera {
            eye: Vec3::new(0.0, 0.0, 1.0),
            target: Vec3::ZERO,
            up: Vec3::Y,
            vfov_deg: 60.0,
        }
    }
}

impl Camera {
    /// Orthonormal right, up and forward directions in world space.
    pub fn basis(&self) -> [Vec3; 3] {
        let forward = (self.target - self.eye).normalize();
        let right = forward.cross(self.up).normalize();
        [right, right.cross(forward), forward]
    }

    /// Turned to the left about its up (degrees).
    pub fn turned(&self, degrees: f32) -> Camera {
        // The same bits, without rounding.
        if degrees == 0.0 {
            return *self;
        }
        let turn = Quat::from_axis_angle(self.up.normalize(), degrees.to_radians());
        Camera {
            target: self.eye + turn * (self.target - self.eye),
            ..*self
        }
    }

    /// Unit direction of the ray through a pixel position; (0, 0) is the top left corner of the
    /// image, (`width`, `height`) the bottom right.
    pub fn ray_direction(&self, x_px: f32, y_px: f32, width: u32, height: u32) -> Vec3 {
        let [right, up, forward] = self.basis();
        let tan_y = (0.5 * self.vfov_deg.to_radians()).tan();
        let tan_x = tan_y * width as f32 / height as f32;
        let x = 2.0 * x_px / width as f32 - 1.0;
        let y = 1.0 - 2.0 * y_px / height as f32;
        (forward + right * (x * tan_x) + up * (y * tan_y)).normalize()
    }

    /// Where the ray through a pixel position of an image of this size (px) is at this distance
    /// along the view axis (m).
    pub fn position_at(&self, place_px: Vec2, depth_m: f32, [width, height]: [u32; 2]) -> Vec3 {
        let ray = self.ray_direction(place_px.x, place_px.y, width, height);
        let [.., forward] = self.basis();
        self.eye + depth_m / ray.dot(forward) * ray
    }

    /// World space to Vulkan clip space: y down, depth reversed with an infinite far plane (1 at
    /// `near_m`, 0 infinitely far).
    pub fn clip_from_world(&self, aspect: f32, near_m: f32) -> Mat4 {
        let scale_y = 1.0 / (0.5 * self.vfov_deg.to_radians()).tan();
        let clip_from_view = Mat4::from_cols(
            Vec4::new(scale_y / aspect, 0.0, 0.0, 0.0),
            Vec4::new(0.0, -scale_y, 0.0, 0.0),
            Vec4::new(0.0, 0.0, 0.0, -1.0),
            Vec4::new(0.0, 0.0, near_m, 0.0),
        );
        clip_from_view * glam::camera::rh::view::look_at_mat4(self.eye, self.target, self.up)
    }
}
