//! Moving the camera: flying and orbiting.

use glam::{Quat, Vec3};

use crate::scene::Camera;

/// What dragging does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// Dragging looks around; keys fly.
    Fly,
    /// Dragging goes around the point looked at.
    Orbit,
}

impl Mode {
    /// The name that scripts have for it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Mode::Fly => "fly",
            Mode::Orbit => "orbit",
        }
    }
}

/// Bookmarks, by the digit keys 1 to 9.
pub(super) const BOOKMARKS: usize = 9;

/// Degrees that dragging over one point turns.
pub(super) const DEG_PER_POINT: f32 = 0.25;

/// The steepest view, from the horizon (degrees).
const STEEPEST_DEG: f32 = 89.0;

/// The camera and what moves it.
#[derive(Clone, Debug)]
pub(super) struct Controls {
    /// The camera as it is now.
    pub(super) camera: Camera,
    /// What dragging does.
    pub(super) mode: Mode,
    /// Speed of flying (m/s).
    pub(super) speed: f32,
    /// Cameras to come back to.
    pub(super) bookmarks: [Option<Camera>; BOOKMARKS],
    /// What a scene was opened with.
    home: Camera,
    /// Smallest and largest corner of the scene (m).
    bounds: (Vec3, Vec3),
}

impl Controls {
    /// For a scene that was just opened.
    pub(super) fn new(camera: Camera, bounds: (Vec3, Vec3)) -> Self {
        let speed = (0.15 * (bounds.1 - bounds.0).length()).max(1e-3);
        Controls {
            camera,
            mode: Mode::Fly,
            speed,
            bookmarks: [None; BOOKMARKS],
            home: camera,
            bounds,
        }
    }

    /// Flies along the view's own axes: right, up, forward, −1 to 1 each, for some seconds.
    pub(super) fn fly(&mut self, along: Vec3, seconds: f32) {
        let [right, up, forward] = self.camera.basis();
        let step = (right * along.x + up * along.y + forward * along.z) * (self.speed * seconds);
        self.camera.eye += step;
        self.camera.target += step;
    }

    /// The mouse was dragged by `x` points to the right and `y` down.
    pub(super) fn drag(&mut self, [x, y]: [f32; 2]) {
        let Camera {
            eye, target, up, ..
        } = self.camera;
        let pivot = if self.mode == Mode::Fly { eye } else { target };
        let view = target - eye;
        let up = up.normalize();
        let pitch_deg = (view.normalize().dot(up).clamp(-1.0, 1.0))
            .asin()
            .to_degrees();
        // What is grabbed follows the hand when orbiting; the view follows it when flying.
        let wanted_deg = (pitch_deg - y * DEG_PER_POINT).clamp(-STEEPEST_DEG, STEEPEST_DEG);
        let turn = Quat::from_axis_angle(up, (-x * DEG_PER_POINT).to_radians());
        let Some(right) = view.cross(up).try_normalize() else {
            return;
        };
        let tilt = Quat::from_axis_angle(right, (wanted_deg - pitch_deg).to_radians());
        let turned = turn * (tilt * view);
        if pivot == eye {
            self.camera.target = eye + turned;
        } else {
            self.camera.eye = target - turned;
        }
    }

    /// Dragged sideways by shares of the picture's height.
    pub(super) fn pan(&mut self, [x, y]: [f32; 2]) {
        let [right, up, _] = self.camera.basis();
        let height_m = 2.0
            * (0.5 * self.camera.vfov_deg.to_radians()).tan()
            * self.camera.target.distance(self.camera.eye);
        let step = (up * y - right * x) * height_m;
        self.camera.eye += step;
        self.camera.target += step;
    }

    /// Nearer (above 0) or farther, by notches of the wheel: the distance when orbiting, the speed
    /// when flying.
    pub(super) fn wheel(&mut self, notches: f32) {
        let factor = 1.15f32.powf(notches.clamp(-20.0, 20.0));
        match self.mode {
            Mode::Fly => self.speed = (self.speed * factor).clamp(1e-4, 1e5),
            Mode::Orbit => {
                let view = (self.camera.target - self.camera.eye) / factor;
                if view.length() > 1e-4 {
                    self.camera.eye = self.camera.target - view;
                }
            }
        }
    }

    /// Looks at the whole scene from where the view points.
    pub(super) fn frame_scene(&mut self, aspect: f32) {
        let (low, high) = self.bounds;
        let (centre, radius_m) = (0.5 * (low + high), (0.5 * (high - low).length()).max(1e-3));
        let tan_y = (0.5 * self.camera.vfov_deg.to_radians()).tan();
        let half = tan_y.min(tan_y * aspect).atan();
        let [_, _, forward] = self.camera.basis();
        self.camera.target = centre;
        self.camera.eye = centre - forward * (radius_m / half.sin());
    }

    /// Back to what the scene was opened with.
    pub(super) fn go_home(&mut self) {
        self.camera = self.home;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn controls() -> Controls {
        let camera = Camera {
            eye: Vec3::new(0.0, 1.0, 5.0),
            target: Vec3::new(0.0, 1.0, 0.0),
            up: Vec3::Y,
            vfov_deg: 60.0,
        };
        Controls::new(camera, (Vec3::splat(-1.0), Vec3::splat(1.0)))
    }

    #[test]
    fn flying_turns_about_the_eye_and_orbiting_about_the_target() {
        let mut c = controls();
        c.drag([360.0, 0.0]);
        assert!(
            c.camera.eye == Vec3::new(0.0, 1.0, 5.0)
                && (c.camera.target - Vec3::new(5.0, 1.0, 5.0)).length() < 1e-4,
            "{:?}",
            c.camera
        );
        let mut c = controls();
        c.mode = Mode::Orbit;
        c.drag([360.0, 0.0]);
        assert!(
            (c.camera.eye - Vec3::new(-5.0, 1.0, 0.0)).length() < 1e-4
                && c.camera.target == Vec3::Y,
            "{:?}",
            c.camera
        );
    }

    #[test]
    fn the_view_never_reaches_the_pole() {
        let mut c = controls();
        c.drag([0.0, -10_000.0]);
        let [_, _, forward] = c.camera.basis();
        assert!(
            forward.y > 0.99
                && forward.y < 1.0
                && c.camera.basis().iter().all(|axis| axis.is_finite())
        );
    }

    #[test]
    fn a_framed_scene_fits_into_the_picture() {
        for aspect in [0.3, 1.0, 3.0] {
            let mut c = controls();
            c.frame_scene(aspect);
            let clip = c.camera.clip_from_world(aspect, 0.01);
            for corner in 0..8 {
                let corner = Vec3::from(
                    [0, 1, 2].map(|axis| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 }),
                );
                let p = clip * corner.extend(1.0);
                assert!(
                    p.w > 0.0 && p.x.abs() <= p.w && p.y.abs() <= p.w,
                    "{corner:?} is outside at aspect {aspect}"
                );
            }
        }
    }

    #[test]
    fn the_wheel_changes_speed_or_distance() {
        let mut c = controls();
        let speed = c.speed;
        c.wheel(1.0);
        assert!(c.speed > speed && c.camera == controls().camera);
        c.mode = Mode::Orbit;
        c.wheel(1.0);
        assert!(c.camera.eye.distance(c.camera.target) < 5.0);
        c.go_home();
        assert_eq!(c.camera, controls().camera);
    }
}
