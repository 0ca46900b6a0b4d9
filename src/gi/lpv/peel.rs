//! What the camera sees in layers: the G-buffer, and surfaces behind it by depth peeling (Everitt
//! 2001).

use std::sync::Arc;

use crate::gpu_struct;
use crate::graph::{
    Access, Binding, ClearOrLoad, Error, Frame, Gpu, Image, ImageDesc, ImageKind, ImageUsage,
    Owner, Pass, RasterState, Sets, Shaders, Targets, vk,
};
use crate::render::{GBuffer, GpuScene};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.peel`.
    pub struct PeelParams {
        /// 1 where there is no layer before.
        pub is_first: u32,
    }
}

const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
const VIEW_DEPTH: vk::Format = vk::Format::R32_SFLOAT;
const NORMAL: vk::Format = vk::Format::R32_UINT;

/// The nearest surface behind those of the layer before. Rasterizes the scene from the camera; an
/// image of view depth, and one of normals.
pub static PEEL: Pass = Pass {
    name: "lpv.peel",
    shaders: Shaders::Raster {
        vertex: "render/screen/gbuffer.vert",
        geometry: None,
        fragment: Some("gi/lpv/peel.frag"),
        state: RasterState {
            color: &[VIEW_DEPTH, NORMAL],
            depth: Some(DEPTH),
            depth_compare: vk::CompareOp::GREATER,
            ..RasterState::NO_TARGETS
        },
    },
    bindings: &[Binding::sampled("before", Access::RasterSampled)],
    constants: &[],
    params: Some(PeelParams::LAYOUT),
    sets: Sets::SceneAndMaterials,
};

/// Surfels along the longer side of a picture at most: about as many as texels of a light's maps
/// are read. More would only add up to the same areas at nodes.
const MOST_SURFELS: u32 = 512;

/// Pixels along an edge of the square that one pixel stands for.
fn stride_of([width, height]: [u32; 2]) -> u32 {
    width.max(height).div_ceil(MOST_SURFELS)
}

/// The surfels of one layer.
pub struct Layer {
    /// R32F: view depth (m); 0 where there is no surface.
    pub view_depth: Arc<Image>,
    /// In red, the geometric normal on the viewer's side, octahedral 2×16 bits.
    pub normals: Arc<Image>,
    /// Width and height of the picture (px); images may be larger.
    pub size: [u32; 2],
    /// Pixels along an edge of the square that one pixel stands for.
    pub stride: u32,
}

/// Room for the layers behind the G-buffer's.
pub struct CameraLayers {
    /// Layers in all, with the G-buffer's.
    count: u32,
    /// View depth and normal of each layer, the nearest of which is the G-buffer's again, but
    /// smaller; none where that is the only one.
    peeled: Vec<[Arc<Image>; 2]>,
    depth: Option<Arc<Image>>,
}

impl CameraLayers {
    /// Allocates `count` layers of pictures of at most this size (px).
    pub fn new(gpu: &Gpu, size: [u32; 2], count: u32) -> Result<Self, Error> {
        // Smaller pictures may be peeled at more pixels than large ones, but no more than these.
        let [width, height] = size.map(|side| side.min(MOST_SURFELS));
        let image = |name: &str, format, usage| {
            gpu.create_image(&ImageDesc {
                name: name.into(),
                extent: [width, height, 1],
                kind: ImageKind::D2,
                format,
                mips: 1,
                layers: 1,
                usage,
                owner: Owner::Screen,
            })
        };
        let color = ImageUsage::COLOR | ImageUsage::SAMPLED;
        let layer = |_| {
            Ok([
                image("lpv.peeled_depth", VIEW_DEPTH, color)?,
                image("lpv.peeled_normal", NORMAL, color)?,
            ])
        };
        let peeled = if count > 1 { 0..count } else { 0..0 };
        let depth = || image("lpv.peel_depth", DEPTH, ImageUsage::DEPTH);
        Ok(CameraLayers {
            count,
            depth: (count > 1).then(depth).transpose()?,
            peeled: peeled.map(layer).collect::<Result<_, Error>>()?,
        })
    }

    /// Whether there are any: what the camera sees is in the cells then.
    pub fn any(&self) -> bool {
        self.count > 0
    }

    /// Adds the passes that peel the layers, and answers all of them, the nearest first.
    pub fn draw(&self, frame: &mut Frame, scene: &GpuScene, gbuffer: &GBuffer) -> Vec<Layer> {
        let stride = stride_of(gbuffer.size);
        let size = gbuffer.size.map(|side| side.div_ceil(stride));
        let black = ClearOrLoad::Clear([0.0; 4]);
        let mut before = &gbuffer.view_depth;
        for (index, [view_depth, normal]) in self.peeled.iter().enumerate() {
            frame
                .pass(&PEEL)
                .bind("before", before)
                .push(&PeelParams {
                    is_first: u32::from(index == 0),
                })
                .draw_indexed(
                    Targets {
                        color: &[
                            (view_depth, 0, 0, black),
                            (normal, 0, 0, ClearOrLoad::ClearUint(0)),
                        ],
                        depth: self.depth.as_ref().map(|depth| (depth, 0, black)),
                        extent: size,
                        viewport: None,
                    },
                    &scene.corners,
                    scene.draws(),
                );
            before = view_depth;
        }
        let nearest = Layer {
            view_depth: Arc::clone(&gbuffer.view_depth),
            normals: Arc::clone(&gbuffer.normals),
            size: gbuffer.size,
            stride,
        };
        let behind = self
            .peeled
            .iter()
            .skip(1)
            .map(|[view_depth, normal]| Layer {
                view_depth: Arc::clone(view_depth),
                normals: Arc::clone(normal),
                size,
                stride: 1,
            });
        let seen = (self.count > 0).then_some(nearest);
        seen.into_iter().chain(behind).collect()
    }
}
