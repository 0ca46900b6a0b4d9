//! What cones march through: the bricks of a pool, found by the indirection texture.

use std::sync::Arc;

use super::bricks::{BrickPool, face_stride};
use super::nodes::NodePool;
use crate::gi::shared::cone::volume::volume_passes;
use crate::gi::shared::cone::{Volume, VolumePasses};
use crate::gi::shared::voxel::{Directionality, VoxelGrid};
use crate::graph::{Access, Binding, Bound, Image};

/// The passes of cones through the octree.
pub static CONES: VolumePasses = volume_passes!(
    "gi/voxel_cones/svo",
    ["CORNERS", "NORMALS"],
    [
        Binding::buffer("nodes", Access::ComputeRead),
        Binding::sampled("bricks", Access::ComputeSampled),
        Binding::sampled("normals_of_bricks", Access::ComputeSampled),
        Binding::sampled("indirection", Access::ComputeSampled),
    ]
);

impl BrickPool {
    /// The light of the voxels of a grid, by normals and faces where the pool has any.
    pub fn volume<'v>(&'v self, grid: VoxelGrid, nodes: &'v NodePool) -> Volume<'v> {
        let texels = (&self.image, self.normals());
        self.volume_with(grid, nodes, texels, self.settings.directionality)
    }

    /// Other bricks of the same tiles: without normals and without faces.
    pub fn volume_of<'v>(
        &'v self,
        grid: VoxelGrid,
        nodes: &'v NodePool,
        bricks: &'v Arc<Image>,
    ) -> Volume<'v> {
        self.volume_with(grid, nodes, (bricks, None), Directionality::Isotropic)
    }

    fn volume_with<'v>(
        &'v self,
        grid: VoxelGrid,
        nodes: &'v NodePool,
        (bricks, normals): (&'v Arc<Image>, Option<&'v Arc<Image>>),
        directionality: Directionality,
    ) -> Volume<'v> {
        let constants = [
            ("CORNERS", self.settings.corners),
            ("NORMALS", normals.is_some()),
        ];
        Volume {
            passes: &CONES,
            grid,
            bound: [
                ("nodes", Bound::Buffer(&nodes.nodes)),
                ("bricks", Bound::Image(bricks)),
                ("normals_of_bricks", Bound::Image(normals.unwrap_or(bricks))),
                ("indirection", Bound::Image(&self.indirection)),
            ]
            .map(Some),
            constants: constants.map(|(name, is_on)| Some((name, u32::from(is_on)))),
            directionality,
            sides: 1 + u32::from(normals.is_some() || directionality.faces().is_some()),
            voxels_across: grid.resolution,
            face_stride: face_stride(nodes, directionality),
        }
    }
}
