//! Models that move: a list of keyframes, and the vertices as they are before any of them is
//! applied.

use glam::{Affine3A, Mat3, Quat, Vec3};

use super::{Model, Scene, Vertex};

/// Where a model stands: rotated about x, y and z in this order, then moved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Rotation about x, then y, then z \[degrees\].
    pub rotate_deg: Vec3,
    /// Translation \[m\].
    pub translate: Vec3,
}

impl Pose {
    pub(super) fn rotation(&self) -> Quat {
        let [x, y, z] = self.rotate_deg.to_array().map(f32::to_radians);
        Quat::from_rotation_z(z) * Quat::from_rotation_y(y) * Quat::from_rotation_x(x)
    }
}

/// Where a model stands at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keyframe {
    /// Time of the pose \[s\].
    pub time_s: f32,
    /// Rotation and translation then.
    pub pose: Pose,
}

/// How a dynamic model moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Index of its first vertex in [`Scene::vertices`]; all of its vertices follow each other
    /// there.
    pub first_vertex: u32,
    /// Its vertices at the [`Pose`] that changes nothing.
    pub rest: Vec<Vertex>,
    /// At least one, in the order of their times, no two at the same.
    pub keyframes: Vec<Keyframe>,
}

impl Motion {
    /// The vertices at a time: translation is interpolated linearly between two keyframes, rotation
    /// along the shortest arc at a constant rate (Shoemake 1985); before the first and after
    /// the last keyframe the model stands still.
    pub fn vertices_at(&self, time_s: f32) -> impl Iterator<Item = Vertex> + '_ {
        let transform = self.transform_at(time_s);
        self.rest.iter().map(move |vertex| {
            transform.map_or(*vertex, |(rotation, translate)| {
                moved(vertex, rotation, translate)
            })
        })
    }

    /// Rotation and translation at a time.
    pub(super) fn pose_at(&self, time_s: f32) -> (Quat, Vec3) {
        let transform = self.transform_at(time_s);
        transform.map_or((Quat::IDENTITY, Vec3::ZERO), |(rotation, translate)| {
            (Quat::from_mat3(&rotation), translate)
        })
    }

    /// Rotation and translation, or `None` where they change nothing.
    fn transform_at(&self, time_s: f32) -> Option<(Mat3, Vec3)> {
        let next = self
            .keyframes
            .partition_point(|keyframe| keyframe.time_s <= time_s);
        let pose = |pose: &Pose| {
            (*pose != Pose::default()).then(|| (Mat3::from_quat(pose.rotation()), pose.translate))
        };
        match (
            next.checked_sub(1).map(|before| &self.keyframes[before]),
            self.keyframes.get(next),
        ) {
            (Some(before), Some(after)) if time_s > before.time_s => {
                let share = (time_s - before.time_s) / (after.time_s - before.time_s);
                let rotation = before.pose.rotation().slerp(after.pose.rotation(), share);
                Some((
                    Mat3::from_quat(rotation),
                    before.pose.translate.lerp(after.pose.translate, share),
                ))
            }
            (Some(at), _) | (None, Some(at)) => pose(&at.pose),
            (None, None) => None,
        }
    }

    /// A box that holds the model at all times: that of its vertices at each keyframe, or, where it
    /// turns between two, of a ball around its pivot.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let radius = self
            .rest
            .iter()
            .map(|vertex| Vec3::from(vertex.position).length())
            .fold(0.0, f32::max);
        let turns = |pair: &[Keyframe]| pair[0].pose.rotate_deg != pair[1].pose.rotate_deg;
        let at_keyframes = self
            .keyframes
            .iter()
            .filter_map(|keyframe| bounds(self.vertices_at(keyframe.time_s)));
        let between = self
            .keyframes
            .windows(2)
            .filter(|pair| turns(pair))
            .flatten()
            .map(
                |Keyframe {
                     pose: Pose { translate, .. },
                     ..
                 }| {
                    let translate = *translate;
                    (translate - radius, translate + radius)
                },
            );
        at_keyframes.chain(between).reduce(union)
    }
}

/// The smallest box around two.
pub(crate) fn union(a: (Vec3, Vec3), b: (Vec3, Vec3)) -> (Vec3, Vec3) {
    (a.0.min(b.0), a.1.max(b.1))
}

fn bounds(vertices: impl Iterator<Item = Vertex>) -> Option<(Vec3, Vec3)> {
    let positions = vertices.map(|vertex| Vec3::from(vertex.position));
    positions.map(|position| (position, position)).reduce(union)
}

fn moved(vertex: &Vertex, rotation: Mat3, translate: Vec3) -> Vertex {
    let world_from_model = Affine3A::from_mat3_translation(rotation, translate);
    let position = world_from_model
        .transform_point3(Vec3::from(vertex.position))
        .to_array();
    let normal = (rotation * Vec3::from(vertex.normal))
        .normalize()
        .to_array();
    Vertex {
        position,
        normal,
        ..*vertex
    }
}

impl Scene {
    /// Moves every model that has keyframes to where it is at a time \[s\].
    pub fn set_time(&mut self, time_s: f32) {
        for motion in self.models.iter().filter_map(|model| model.motion.as_ref()) {
            let first = motion.first_vertex as usize;
            for (vertex, moved) in self.vertices[first..]
                .iter_mut()
                .zip(motion.vertices_at(time_s))
            {
                *vertex = moved;
            }
        }
    }

    /// Whether any model has keyframes.
    pub fn moves(&self) -> bool {
        self.models.iter().any(|model| model.motion.is_some())
    }

    /// Smallest and largest corner \[m\] of the geometry that does not move; `None` where all may.
    pub fn static_bounds(&self) -> Option<(Vec3, Vec3)> {
        let dynamic: Vec<&Model> = self.models.iter().filter(|model| model.dynamic).collect();
        let mut next = 0;
        let mut ranges = Vec::new();
        for model in dynamic {
            ranges.push(next..model.first_triangle as usize);
            next = (model.first_triangle + model.triangle_count) as usize;
        }
        ranges.push(next..self.triangles.len());
        ranges
            .into_iter()
            .filter_map(|range| self.bounds_of(range))
            .reduce(union)
    }

    /// Smallest and largest corner \[m\] of all places that dynamic models come to; `None` without
    /// dynamic models.
    pub fn dynamic_bounds(&self) -> Option<(Vec3, Vec3)> {
        let of_model = |model: &Model| match &model.motion {
            Some(motion) => motion.bounds(),
            None => self.bounds_of(
                model.first_triangle as usize
                    ..(model.first_triangle + model.triangle_count) as usize,
            ),
        };
        self.models
            .iter()
            .filter(|model| model.dynamic)
            .filter_map(of_model)
            .reduce(union)
    }

    /// Smallest and largest corner \[m\] of a range of triangles.
    pub(super) fn bounds_of(&self, triangles: std::ops::Range<usize>) -> Option<(Vec3, Vec3)> {
        bounds(
            self.triangles[triangles]
                .iter()
                .flat_map(|triangle| triangle.vertices)
                .map(|index| self.vertices[index as usize]),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keyframe(time_s: f32, rotate_deg: [f32; 3], translate: [f32; 3]) -> Keyframe {
        Keyframe {
            time_s,
            pose: Pose {
                rotate_deg: rotate_deg.into(),
                translate: translate.into(),
            },
        }
    }

    fn at(keyframes: Vec<Keyframe>, time_s: f32) -> (Vec3, Vec3) {
        let rest = vec![Vertex {
            position: [1.0, 0.0, 0.0],
            u: 0.25,
            normal: [0.0, 0.0, 1.0],
            v: 0.75,
        }];
        let motion = Motion {
            first_vertex: 0,
            rest,
            keyframes,
        };
        let vertex = motion.vertices_at(time_s).next().unwrap_or(motion.rest[0]);
        assert_eq!((vertex.u, vertex.v), (0.25, 0.75));
        (vertex.position.into(), vertex.normal.into())
    }

    #[test]
    fn keyframes_are_interpolated_and_clamped() {
        let keyframes = || {
            vec![
                keyframe(1.0, [0.0; 3], [0.0; 3]),
                keyframe(3.0, [0.0, 90.0, 0.0], [0.0, 4.0, 0.0]),
                keyframe(4.0, [0.0, 90.0, 0.0], [8.0; 3]),
            ]
        };
        let near = |a: Vec3, b: [f32; 3]| a.distance(Vec3::from(b)) < 1e-5;
        for before in [-1e6, 0.0, 1.0] {
            assert_eq!(
                at(keyframes(), before),
                (Vec3::X, Vec3::Z),
                "the first pose changes no bit"
            );
        }
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let (position, normal) = at(keyframes(), 2.0);
        assert!(
            near(position, [half, 2.0, -half]) && near(normal, [half, 0.0, half]),
            "{position} {normal}"
        );
        assert!(near(at(keyframes(), 3.5).0, [4.0, 6.0, 3.0]));
        for after in [4.0, 5.0, 1e6] {
            assert!(near(at(keyframes(), after).0, [8.0, 8.0, 7.0]));
        }
    }

    /// From 350° to 10° there are 20°, not 340°.
    #[test]
    fn rotation_takes_the_shortest_way() {
        let keyframes = vec![
            keyframe(0.0, [0.0, 0.0, 350.0], [0.0; 3]),
            keyframe(1.0, [0.0, 0.0, 10.0], [0.0; 3]),
        ];
        assert!(at(keyframes, 0.5).0.distance(Vec3::X) < 1e-5);
    }

    #[test]
    fn bounds_hold_the_model_at_all_times() {
        let rest = [[3.0, 0.0, 0.0], [-1.0, 0.5, 0.0]]
            .map(|position| Vertex {
                position,
                u: 0.0,
                normal: [0.0, 1.0, 0.0],
                v: 0.0,
            })
            .to_vec();
        let keyframes = vec![
            keyframe(0.0, [0.0; 3], [0.0; 3]),
            keyframe(1.0, [0.0, 180.0, 30.0], [0.0, 5.0, 1.0]),
            keyframe(2.0, [90.0, 10.0, 0.0], [2.0; 3]),
        ];
        let motion = Motion {
            first_vertex: 0,
            rest,
            keyframes,
        };
        let (low, high) = motion.bounds().unwrap_or_default();
        for step in 0..=200 {
            for vertex in motion.vertices_at(step as f32 * 0.01) {
                let position = Vec3::from(vertex.position);
                assert!(
                    (position - low).min_element() >= -1e-5
                        && (high - position).min_element() >= -1e-5,
                    "{position} outside of {low}, {high}"
                );
            }
        }
        let still = Motion {
            keyframes: vec![
                keyframe(0.0, [0.0; 3], [1.0; 3]),
                keyframe(1.0, [0.0; 3], [2.0; 3]),
            ],
            ..motion
        };
        assert_eq!(
            still.bounds(),
            Some((Vec3::new(0.0, 1.0, 1.0), Vec3::new(5.0, 2.5, 2.0)))
        );
    }
}
