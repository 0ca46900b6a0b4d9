//! Opaque faces: which neighbours cannot see each other.

use std::sync::Arc;

use super::grid::{CellGrid, GridRow};
use crate::gpu_struct;
use crate::graph::{
    Access, Binding, Buffer, DrawBatch, Frame, Pass, RasterState, Sets, Shaders, Targets,
};
use crate::render::GpuScene;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.faces`.
    pub struct FacesParams {
        /// The grid.
        pub grid: GridRow,
        /// Axis that is looked along: 0, 1, 2.
        pub axis: u32,
    }
}

/// The face between two cells is opaque where the segment between their centres meets a triangle.
/// Rasterizes the scene along one axis, a pixel a row of cells; sets six bits a cell.
pub static FACES: Pass = Pass {
    name: "lpv.faces",
    shaders: Shaders::Raster {
        vertex: "gi/lpv/faces.vert",
        geometry: None,
        fragment: Some("gi/lpv/faces.frag"),
        state: RasterState::NO_TARGETS,
    },
    bindings: &[Binding::buffer("faces", Access::RasterReadWrite)],
    constants: &[],
    params: Some(FacesParams::LAYOUT),
    sets: Sets::SceneAndMaterials,
};

/// Adds the passes that find all opaque faces of a scene.
pub(super) fn find_faces(
    frame: &mut Frame,
    scene: &GpuScene,
    grid: &CellGrid,
    faces: &Arc<Buffer>,
) {
    frame.fill("lpv.clear_faces", faces, 0);
    for axis in 0..3 {
        let across = [
            [grid.size.y, grid.size.z],
            [grid.size.z, grid.size.x],
            [grid.size.x, grid.size.y],
        ][axis];
        let draws = scene.batches.iter().map(|batch| DrawBatch {
            material: batch.material,
            push: Vec::new(),
            first_vertex: 3 * batch.first_triangle,
            vertex_count: 3 * batch.triangle_count,
        });
        frame
            .pass(&FACES)
            .bind("faces", faces)
            .push(&FacesParams {
                grid: grid.row(0),
                axis: axis as u32,
            })
            .draw(Targets::none(across), draws.collect());
    }
}
