//! Motion vectors: what the frame before saw, and where its dynamic models stood.

use std::sync::Arc;

use super::super::gpu_scene::{FrameConstants, GpuScene, bytes_of_vectors};
use crate::gpu_struct;
use crate::graph::{Buffer, BufferDesc, BufferUsage, DrawBatch, Error, Frame, Gpu, Owner};

/// Both numbers of the motion (px) of a surface that the camera of the frame before had behind it,
/// or nearer than half the depth of its near plane: far outside of any picture.
pub const BEHIND_PX: f32 = 1e9;

/// Name of the copy that keeps vertices before they move.
pub static KEEP_POSE: &str = "render.keep_pose";

gpu_struct! {
    /// What motion is measured against in one draw.
    pub struct MotionParams {
        /// World to clip space of the frame before.
        pub previous_clip_from_world: [[f32; 4]; 4],
        /// 1 where there is a frame before; in the first, nothing moves.
        pub has_previous: u32,
        /// 1 where the draw's vertices have moved since.
        pub has_moved: u32,
        /// What leads from the index of one of its vertices to that of its copy, modulo 2³².
        pub first_copy: u32,
    }
}

/// What motion needs of the frame before. Positions are copied only when models move, and at most
/// once a frame. Until the next frame is drawn, the copy is what the last frame showed, however
/// often models are moved.
pub(super) struct Previous {
    /// World to clip space; `None` before the first frame.
    clip_from_world: Option<[[f32; 4]; 4]>,
    /// Positions of the vertices of dynamic models (m), one model behind the other; `None` where
    /// there are none.
    positions: Option<Arc<Buffer>>,
    /// Whether models have moved since, so that `positions` differ from the scene's.
    has_moved: bool,
}

impl Previous {
    pub(super) fn new(gpu: &Gpu, scene: &GpuScene) -> Result<Self, Error> {
        let copies = scene.dynamic.as_ref().map(|dynamic| {
            gpu.create_buffer(&BufferDesc {
                name: "gbuffer.previous_positions".into(),
                size_bytes: dynamic.positions_bytes(),
                usage: BufferUsage::Storage,
                owner: Owner::Shared,
            })
        });
        Ok(Previous {
            clip_from_world: None,
            positions: copies.transpose()?,
            has_moved: false,
        })
    }

    /// Keeps the positions that the last frame showed; called before they change.
    pub(super) fn keep_pose(&mut self, gpu: &Gpu, scene: &GpuScene) {
        let (Some(dynamic), Some(copies)) = (&scene.dynamic, &self.positions) else {
            return;
        };
        if self.has_moved || self.clip_from_world.is_none() {
            return;
        }
        let mut frame = Frame::new();
        for (first, range) in dynamic.packed() {
            frame.copy_buffer(
                KEEP_POSE,
                (scene.positions(), bytes_of_vectors(range.start)),
                (copies, bytes_of_vectors(first)),
                bytes_of_vectors(range.len()),
            );
        }
        gpu.enqueue(frame);
        self.has_moved = true;
    }

    /// There is no frame before.
    pub(super) fn forget_frame(&mut self) {
        (self.clip_from_world, self.has_moved) = (None, false);
    }

    /// Makes the frame that was drawn just now the one before.
    pub(super) fn keep_frame(&mut self, seen_with: &FrameConstants) {
        self.clip_from_world = Some(seen_with.clip_from_world);
        self.has_moved = false;
    }

    /// What the pass reads: copies, or where there is none anything that has positions.
    pub(super) fn bound<'b>(&'b self, scene: &'b GpuScene) -> &'b Arc<Buffer> {
        self.positions.as_ref().unwrap_or(scene.positions())
    }

    /// The same draws with what motion is measured against; dynamic models are drawn one by one.
    pub(super) fn draws(&self, scene: &GpuScene, draws: Vec<DrawBatch>) -> Vec<DrawBatch> {
        let with = |draw: DrawBatch, moved: Option<u32>| DrawBatch {
            push: bytemuck::bytes_of(&MotionParams {
                previous_clip_from_world: self.clip_from_world.unwrap_or_default(),
                has_previous: u32::from(self.clip_from_world.is_some()),
                has_moved: u32::from(moved.is_some()),
                first_copy: moved.unwrap_or(0),
            })
            .to_vec(),
            ..draw
        };
        let moving = scene.dynamic.as_ref().filter(|_| self.has_moved);
        let of_draw = |draw: DrawBatch| match moving.filter(|_| scene.is_dynamic(draw.material)) {
            None => vec![with(draw, None)],
            Some(dynamic) => {
                let (first, end) = (draw.first_vertex, draw.first_vertex + draw.vertex_count);
                let parts = dynamic
                    .packed_corners()
                    .filter_map(|(first_copy, corners)| {
                        let (first, end) = (first.max(corners.start), end.min(corners.end));
                        let part = DrawBatch {
                            first_vertex: first,
                            vertex_count: end.checked_sub(first).filter(|count| *count > 0)?,
                            ..draw.clone()
                        };
                        Some(with(part, Some(first_copy)))
                    });
                parts.collect()
            }
        };
        draws.into_iter().flat_map(of_draw).collect()
    }
}
