//! Sequences: where the camera and the models are in each frame.

use glam::Vec3;

use super::{Camera, Scene};

/// How a scene goes on from frame to frame. Frame 0 is the scene as it was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// The camera of frame 0.
    pub first: Camera,
    /// Time of frame 0 (s).
    pub start_s: f32,
    /// From one frame to the next (s); `None` where models stand still.
    pub step_s: Option<f32>,
    /// How far the camera turns to the left in each frame, about its up (degrees).
    pub pan_deg: f32,
    /// How far it then moves, to where it looks (m).
    pub dolly_m: f32,
}

impl Shot {
    /// The camera of a frame: it turns, then moves along its new view, frame after frame.
    pub fn camera(&self, frame: u32) -> Camera {
        let turned = |frame: u32| self.first.turned(frame as f32 * self.pan_deg);
        let step = |frame: u32| {
            let [.., forward] = turned(frame).basis();
            self.dolly_m * forward
        };
        let way: Vec3 = if self.pan_deg == 0.0 {
            frame as f32 * step(0)
        } else {
            (1..=frame).map(step).sum()
        };
        let Camera { eye, target, .. } = turned(frame);
        Camera {
            eye: eye + way,
            target: target + way,
            ..self.first
        }
    }

    /// Time of a frame (s).
    pub fn time_s(&self, frame: u32) -> f32 {
        self.start_s + frame as f32 * self.step_s.unwrap_or(0.0)
    }

    /// Whether frames differ in what they show.
    pub fn is_still(&self) -> bool {
        self.step_s.is_none() && self.pan_deg == 0.0 && self.dolly_m == 0.0
    }

    /// Brings a scene to a frame. Returns whether models may have moved.
    pub fn place(&self, scene: &mut Scene, frame: u32) -> bool {
        scene.camera = self.camera(frame);
        let moves = self.step_s.is_some() && scene.moves();
        if moves {
            scene.set_time(self.time_s(frame));
        }
        moves
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shot(pan_deg: f32, dolly_m: f32) -> Shot {
        Shot {
            first: Camera {
                eye: Vec3::new(1.0, 2.0, 3.0),
                target: Vec3::new(1.0, 2.0, 1.0),
                ..Camera::default()
            },
            start_s: 2.0,
            step_s: Some(0.25),
            pan_deg,
            dolly_m,
        }
    }

    fn near(a: Vec3, b: [f32; 3]) -> bool {
        a.distance(b.into()) < 1e-5
    }

    #[test]
    fn cameras_by_hand() {
        let still = shot(0.0, 0.0);
        assert_eq!(still.camera(7), still.first);
        assert_eq!(still.time_s(6), 3.5);
        let ahead = shot(0.0, -0.5).camera(4);
        assert!(near(ahead.eye, [1.0, 2.0, 5.0]) && near(ahead.target, [1.0, 2.0, 3.0]));
        // 90° to the left of −z is −x.
        let left = shot(30.0, 0.0).camera(3);
        assert!(near(left.eye, [1.0, 2.0, 3.0]) && near(left.target, [-1.0, 2.0, 3.0]));
        // A square: to the left, then ahead, four times.
        let square = shot(90.0, 1.0);
        assert!(near(square.camera(1).eye, [0.0, 2.0, 3.0]));
        assert!(near(square.camera(2).eye, [0.0, 2.0, 4.0]));
        assert!(near(square.camera(4).eye, [1.0, 2.0, 3.0]));
        assert!(near(square.camera(4).target, [1.0, 2.0, 1.0]));
    }

    #[test]
    fn scenes_without_keyframes_have_no_time() {
        let mut scene = Scene {
            camera: shot(0.0, 0.0).first,
            ..Scene::default()
        };
        assert!(!shot(1.0, 0.0).place(&mut scene, 2));
        assert_eq!(scene.camera, shot(1.0, 0.0).camera(2));
        assert!(!shot(1.0, 0.0).is_still() && !shot(0.0, 0.0).is_still());
        let stands = Shot {
            step_s: None,
            ..shot(0.0, 0.0)
        };
        assert!(stands.is_still());
    }
}
