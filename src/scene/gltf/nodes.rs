//! The tree of nodes: where each stands, at rest and at any time.

use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::animation::Interpolation;
use gltf::animation::Property;
use gltf::scene::Transform;

use super::super::SceneError;
use super::Undone;
use super::file::File;

/// Longest step between samples of a motion that keyframes do not describe exactly \[s\].
const STEP_S: f64 = 1.0 / 30.0;

/// Most samples of one motion.
const SAMPLES_MAX: f64 = 2000.0;

/// Largest time \[s\].
const TIME_MAX: f64 = 1e6;

/// The values of one property of a node.
struct Track {
    /// Increasing \[s\].
    times: Vec<f64>,
    /// One a time; three a time for cubic splines: tangent in, value, tangent out.
    values: Vec<[f64; 4]>,
    interpolation: Interpolation,
    is_rotation: bool,
}

/// One node.
#[derive(Default)]
struct Node {
    parent: Option<usize>,
    /// Of its parent's space, at rest.
    local: DAffine3,
    translation: DVec3,
    rotation: DQuat,
    scale: DVec3,
    /// Translation, rotation, scale.
    tracks: [Option<Track>; 3],
}

/// All nodes of a scene.
pub(super) struct Nodes {
    nodes: Vec<Node>,
    /// Indices, parents before children, in the order of the file.
    pub(super) order: Vec<usize>,
}

impl Nodes {
    /// The nodes of the file's scene, with the tracks of its first animation.
    pub(super) fn read(file: &File, undone: &mut Undone) -> Result<Nodes, SceneError> {
        let document = &file.document;
        let mut nodes = Nodes {
            nodes: document.nodes().map(node_at_rest).collect(),
            order: Vec::new(),
        };
        let roots: Vec<usize> = match document
            .default_scene()
            .or_else(|| document.scenes().next())
        {
            Some(scene) => scene.nodes().map(|node| node.index()).collect(),
            None => {
                let is_child = |index: usize| {
                    let mut children = document.nodes().flat_map(|node| node.children());
                    children.any(|child| child.index() == index)
                };
                (0..nodes.nodes.len())
                    .filter(|index| !is_child(*index))
                    .collect()
            }
        };
        if document.scenes().len() > 1 {
            undone.add("more than one scene: the default one is taken");
        }
        let children: Vec<Vec<usize>> = document
            .nodes()
            .map(|node| node.children().map(|child| child.index()).collect())
            .collect();
        let mut seen = vec![false; nodes.nodes.len()];
        let mut waiting: Vec<(usize, Option<usize>)> =
            roots.into_iter().rev().map(|root| (root, None)).collect();
        while let Some((index, parent)) = waiting.pop() {
            if std::mem::replace(&mut seen[index], true) {
                let place = format!("nodes[{index}]");
                return Err(file.error(&place, "is the child of more than one node"));
            }
            nodes.nodes[index].parent = parent;
            nodes.order.push(index);
            let below = children[index].iter().rev();
            waiting.extend(below.map(|child| (*child, Some(index))));
        }
        nodes.read_animation(file, undone)?;
        Ok(nodes)
    }

    fn read_animation(&mut self, file: &File, undone: &mut Undone) -> Result<(), SceneError> {
        let mut animations = file.document.animations();
        let Some(animation) = animations.next() else {
            return Ok(());
        };
        if animations.next().is_some() {
            undone.add("more than one animation: the first is taken");
        }
        for (index, channel) in animation.channels().enumerate() {
            let place = format!("animations[0].channels[{index}]");
            let property = match channel.target().property() {
                Property::Translation => 0,
                Property::Rotation => 1,
                Property::Scale => 2,
                Property::MorphTargetWeights => {
                    undone.add("animated morph targets");
                    continue;
                }
            };
            let sampler = channel.sampler();
            let times = file.numbers(&sampler.input())?;
            let values = file.numbers(&sampler.output())?;
            let components = sampler.output().dimensions().multiplicity();
            let is_spline = sampler.interpolation() == Interpolation::CubicSpline;
            let per_time = if is_spline { 3 } else { 1 };
            let rises = times.windows(2).all(|pair| pair[0] < pair[1]);
            let in_range = times.iter().all(|time| (0.0..=TIME_MAX).contains(time));
            if times.is_empty() || !rises || !in_range {
                return Err(file.error(&place, "has times that do not rise from 0 s to 1e6 s"));
            }
            let wanted = if property == 1 { 4 } else { 3 };
            if components != wanted
                || values.len() != times.len() * per_time * wanted
                || !values.iter().all(|value| value.is_finite())
            {
                return Err(file.error(&place, "has values that do not match its times"));
            }
            let values = values
                .chunks_exact(wanted)
                .map(|value| std::array::from_fn(|at| value.get(at).copied().unwrap_or(0.0)))
                .collect();
            let node = &mut self.nodes[channel.target().node().index()];
            node.tracks[property] = Some(Track {
                times,
                values,
                interpolation: sampler.interpolation(),
                is_rotation: property == 1,
            });
        }
        Ok(())
    }

    /// World from a node's space at a time \[s\].
    pub(super) fn world(&self, node: usize, time_s: f64) -> DAffine3 {
        let mut world = DAffine3::IDENTITY;
        for index in self.line(node) {
            world = self.nodes[index].at(time_s) * world;
        }
        world
    }

    /// The nearest node that moves, of this one and those above it.
    pub(super) fn driver(&self, node: usize) -> Option<usize> {
        self.line(node)
            .find(|index| self.nodes[*index].tracks.iter().any(Option::is_some))
    }

    /// A node and those above it.
    fn line(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(Some(node), |index| self.nodes[*index].parent)
    }

    /// Whether the scale of a node, or of one above it, changes.
    pub(super) fn scales(&self, node: usize) -> bool {
        self.line(node).any(|index| {
            let track = self.nodes[index].tracks[2].as_ref();
            track.is_some_and(|track| track.values.iter().any(|value| *value != track.values[0]))
        })
    }

    /// Times at which the motion of a node is to be known, for all times between: those of its
    /// tracks, and more where it is no turn and no straight line between these.
    pub(super) fn times(&self, node: usize) -> Vec<f32> {
        let moving: Vec<&Node> = self
            .line(node)
            .map(|index| &self.nodes[index])
            .filter(|node| node.tracks.iter().any(Option::is_some))
            .collect();
        let tracks = || moving.iter().flat_map(|node| node.tracks.iter().flatten());
        let mut times: Vec<f32> = Vec::new();
        for track in tracks() {
            let keys = track.times.iter().map(|time| *time as f32);
            if track.interpolation == Interpolation::Step {
                times.extend(keys.clone().skip(1).map(f32::next_down));
            }
            times.extend(keys);
        }
        times.sort_by(f32::total_cmp);
        times.dedup();
        let is_curved = moving.len() > 1
            || tracks().any(|track| track.interpolation == Interpolation::CubicSpline);
        let (Some(first), Some(last), true) = (times.first(), times.last(), is_curved) else {
            return times;
        };
        let length_s = f64::from(last - first);
        let step_s = STEP_S.max(length_s / SAMPLES_MAX);
        let more: Vec<f32> = times
            .windows(2)
            .flat_map(|pair| {
                let [from, to] = [pair[0], pair[1]].map(f64::from);
                let parts = ((to - from) / step_s).ceil().max(1.0);
                (1..parts as usize)
                    .map(move |part| (from + (to - from) * part as f64 / parts) as f32)
            })
            .collect();
        times.extend(more);
        times.sort_by(f32::total_cmp);
        times.dedup();
        times
    }
}

fn node_at_rest(node: gltf::Node) -> Node {
    let (translation, rotation, scale) = node.transform().decomposed();
    let local = match node.transform() {
        Transform::Matrix { matrix } => {
            let columns = matrix.map(|column| column.map(f64::from));
            DAffine3::from_mat4(DMat4::from_cols_array_2d(&columns))
        }
        Transform::Decomposed { .. } => DAffine3::from_scale_rotation_translation(
            DVec3::from(scale.map(f64::from)),
            unit(rotation.map(f64::from)),
            DVec3::from(translation.map(f64::from)),
        ),
    };
    Node {
        parent: None,
        local,
        translation: DVec3::from(translation.map(f64::from)),
        rotation: unit(rotation.map(f64::from)),
        scale: DVec3::from(scale.map(f64::from)),
        tracks: [None, None, None],
    }
}

/// A quaternion of length 1; no turn where it has no length.
fn unit([x, y, z, w]: [f64; 4]) -> DQuat {
    let quaternion = DQuat::from_xyzw(x, y, z, w);
    match quaternion.length() {
        length if length > 0.0 && length.is_finite() => quaternion.normalize(),
        _ => DQuat::IDENTITY,
    }
}

impl Node {
    fn at(&self, time_s: f64) -> DAffine3 {
        if self.tracks.iter().all(Option::is_none) {
            return self.local;
        }
        let [translation, rotation, scale] = &self.tracks;
        let vector = |track: &Option<Track>, otherwise: DVec3| {
            track.as_ref().map_or(otherwise, |track| {
                let [x, y, z, _] = track.at(time_s);
                DVec3::new(x, y, z)
            })
        };
        DAffine3::from_scale_rotation_translation(
            vector(scale, self.scale),
            rotation
                .as_ref()
                .map_or(self.rotation, |track| unit(track.at(time_s))),
            vector(translation, self.translation),
        )
    }
}

impl Track {
    fn at(&self, time_s: f64) -> [f64; 4] {
        let next = self.times.partition_point(|time| *time <= time_s);
        let is_spline = self.interpolation == Interpolation::CubicSpline;
        let value = |key: usize| self.values[if is_spline { 3 * key + 1 } else { key }];
        let (Some(before), true) = (next.checked_sub(1), next < self.times.len()) else {
            return value(next.min(self.times.len() - 1));
        };
        let length_s = self.times[next] - self.times[before];
        let share = (time_s - self.times[before]) / length_s;
        let (a, b) = (value(before), value(next));
        match self.interpolation {
            Interpolation::Step => a,
            Interpolation::Linear if self.is_rotation => unit(a).slerp(unit(b), share).to_array(),
            Interpolation::Linear => std::array::from_fn(|at| a[at] + share * (b[at] - a[at])),
            Interpolation::CubicSpline => {
                let (out, into) = (self.values[3 * before + 2], self.values[3 * next]);
                let [t, t2, t3] = [share, share * share, share * share * share];
                std::array::from_fn(|at| {
                    (2.0 * t3 - 3.0 * t2 + 1.0) * a[at]
                        + length_s * (t3 - 2.0 * t2 + t) * out[at]
                        + (3.0 * t2 - 2.0 * t3) * b[at]
                        + length_s * (t3 - t2) * into[at]
                })
            }
        }
    }
}
