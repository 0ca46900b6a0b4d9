//! What cones march through: the bricks of a pool, found by the indirection texture.

use std::sync::Arc;

use super::bricks::{BrickPool, face_stride};
use super::nodes::NodePool;
use crate::gi::shared::cone::volume::volume_passes;
use crate::gi::shared::cone::{Volume, VolumePasses};
use crate::gi::shared::voxel::{Directionality, NormalLobe, VoxelGrid};
use crate::graph::{Access, Binding, Bound, Image};

/// The passes of cones through the octree.
pub static CONES: VolumePasses = volume_passes!(
    "gi/voxel_cones/svo",
    ["CORNERS", ""],
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
        let texels = (&self.image, self.normals().zip(self.settings.lobe));
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
        (bricks, normals): (&'v Arc<Image>, Option<(&'v Arc<Image>, NormalLobe)>),
        directionality: Directionality,
    ) -> Volume<'v> {
        let (normals, lobe) = normals.unzip();
        Volume {
            passes: &CONES,
            grid,
            bound: [
                Some(("nodes", Bound::Buffer(&nodes.nodes))),
                Some(("bricks", Bound::Image(bricks))),
                Some(("normals_of_bricks", Bound::Image(normals.unwrap_or(bricks)))),
                Some(("indirection", Bound::Image(&self.indirection))),
                None,
                None,
            ],
            constants: [Some(("CORNERS", u32::from(self.settings.corners))), None],
            directionality,
            lobe,
            sides: 1 + u32::from(normals.is_some() || directionality.faces().is_some()),
            voxels_across: grid.resolution,
            face_stride: face_stride(nodes, directionality),
        }
    }
}
