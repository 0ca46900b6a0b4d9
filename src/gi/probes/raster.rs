//! What is drawn into a cube of views around each probe, in place of rays through triangles (Luo
//! 2022, section 4.1): which triangle is at each texel.

use std::f32::consts::{FRAC_PI_4, SQRT_2};
use std::sync::Arc;

use glam::Vec3;

use super::list::{LIST_BINDING, Listed};
use super::passes::MomentParams;
use super::rays::{Moved, ProbeRays, corners};
use super::volume::Volume;
use crate::gpu_struct;
use crate::graph::compute::linear_groups;
use crate::graph::{
    Access, Binding, ClearOrLoad, DrawBatch, Error, Frame, Gpu, Image, ImageDesc, ImageKind,
    ImageUsage, Owner, Pass, RasterState, Sets, Shaders, Targets, vk,
};
use crate::render::GpuScene;
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `probes.raster`.
    pub struct RasterParams {
        /// Of the list of probes.
        pub entry: u32,
        /// Of the cube (`gi/probes/cube.glsl`).
        pub face: u32,
        /// The nearest that is seen (m).
        pub near_m: f32,
    }
}

gpu_struct! {
    /// Parameters of `probes.trace_raster`.
    pub struct RasterRayParams {
        /// xyz: smallest corner of the box in which something has moved (m).
        pub low: [f32; 4],
        /// xyz: its largest corner (m).
        pub high: [f32; 4],
        /// Rays of a probe.
        pub ray_count: u32,
        /// First of the list.
        pub first_probe: u32,
        /// Rays of those from there on.
        pub all: u32,
    }
}

const SEEN: vk::Format = vk::Format::R32_UINT;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;

/// Which triangle some probes see. Draws the scene six times a probe, writes R32UI; a draw a face
/// and material.
pub static RASTER: Pass = Pass {
    name: "probes.raster",
    shaders: Shaders::Raster {
        vertex: "gi/probes/raster.vert",
        geometry: None,
        fragment: Some("gi/probes/raster.frag"),
        state: RasterState {
            color: &[SEEN],
            depth: Some(DEPTH),
            depth_compare: vk::CompareOp::GREATER,
            ..RasterState::NO_TARGETS
        },
    },
    bindings: &[
        Binding::buffer("probe_places", Access::RasterRead),
        Binding::buffer("probe_list", Access::RasterRead),
    ],
    constants: &[],
    params: Some(RasterParams::LAYOUT),
    sets: Sets::SceneAndMaterials,
};

/// What each ray meets of that, where that may have changed. Reads views, writes RGBA32UI; a thread
/// a ray.
pub static TRACE_RASTER: Pass = Pass {
    name: "probes.trace_raster",
    shaders: Shaders::Compute("gi/probes/trace_raster.comp"),
    bindings: &[
        Binding::sampled("probe_views", Access::ComputeSampled),
        Binding::buffer("probe_places", Access::ComputeRead),
        Binding::sampled("ray_set", Access::ComputeSampled),
        Binding::image("ray_hits", Access::ComputeWrite),
        LIST_BINDING,
    ],
    constants: &["RASTER_TEXELS", "KEEPS"],
    params: Some(RasterRayParams::LAYOUT),
    sets: Sets::Scene,
};

/// Mean and mean square of the distance that a probe sees of that, by direction. Reads views,
/// writes RG16F; a thread a texel.
pub static MOMENTS_RASTER: Pass = Pass {
    name: "probes.moments_raster",
    shaders: Shaders::Compute("gi/probes/moments_raster.comp"),
    bindings: &[
        Binding::sampled("probe_views", Access::ComputeSampled),
        Binding::buffer("probe_places", Access::ComputeRead),
        Binding::image("probe_moments", Access::ComputeWrite),
        LIST_BINDING,
    ],
    constants: &["RASTER_TEXELS", "KEEPS"],
    params: Some(MomentParams::LAYOUT),
    sets: Sets::Scene,
};

/// Width and height of the images of views (texels), unless the views of one probe need more.
const MOST: u32 = 1024;

/// What nothing is seen with.
const NOTHING: u32 = u32::MAX;

/// As a share of the smallest spacing, the nearest that a probe sees.
const NEAR: f32 = 1e-4;

/// Room for the views of some probes.
pub struct RasterSource {
    seen: Arc<Image>,
    depth: Arc<Image>,
    /// Edge of a view (texels).
    edge: u32,
}

impl RasterSource {
    /// Views of `edge`² texels.
    pub fn new(gpu: &Gpu, edge: u32) -> Result<Self, Error> {
        let image = |name: &str, format, usage| {
            gpu.create_image(&ImageDesc {
                name: name.into(),
                extent: [MOST, MOST, 1],
                kind: ImageKind::D2,
                format,
                mips: 1,
                layers: 1,
                usage,
                owner: Owner::Store,
            })
        };
        let color = ImageUsage::COLOR | ImageUsage::SAMPLED;
        Ok(RasterSource {
            seen: image("probes.views", SEEN, color)?,
            depth: image("probes.view_depth", DEPTH, ImageUsage::DEPTH)?,
            edge,
        })
    }

    /// Tiles beside each other in the images.
    fn row(&self) -> u32 {
        MOST / self.edge
    }

    /// Adds [`RASTER`], [`TRACE_RASTER`] and, where surfaces ask how far probes see
    /// and rays of each texel say so (`by_rays`), [`MOMENTS_RASTER`], for as many probes at a time
    /// as there is room for. After models have moved past them, only what that may have changed.
    pub fn trace(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        rays: &ProbeRays,
        (volume, probes): (&Volume, Listed<'_>),
        (by_rays, moved): (bool, Option<&MovedPast<'_>>),
    ) {
        let [low, high] = corners(moved.map(|moved| moved.bounds));
        for part in probes.parts(self.row() * self.row() / 6) {
            if !self.draw(frame, scene, (volume, part), moved) {
                continue;
            }
            let all = part.count * rays.count;
            let pass = part.bind(frame.pass(&TRACE_RASTER));
            pass.bind("probe_views", &self.seen)
                .bind("probe_places", &volume.places)
                .bind("ray_set", &rays.set)
                .bind("ray_hits", &rays.hits)
                .constant("RASTER_TEXELS", self.edge)
                .constant("KEEPS", moved.is_some())
                .push(&RasterRayParams {
                    low,
                    high,
                    ray_count: rays.count,
                    first_probe: part.first,
                    all,
                })
                .dispatch(linear_groups(all));
            if !volume.has_moments || !by_rays {
                continue;
            }
            let params = rays.moment_params(volume, part, moved.map(|moved| moved.bounds));
            let pass = part.bind(frame.pass(&MOMENTS_RASTER));
            pass.bind("probe_views", &self.seen)
                .bind("probe_places", &volume.places)
                .bind("probe_moments", &volume.moments)
                .constant("RASTER_TEXELS", self.edge)
                .constant("KEEPS", moved.is_some())
                .push(&params)
                .dispatch(linear_groups(params.all));
        }
    }

    /// Adds [`RASTER`], of those faces alone that show where something has moved. Whether there are
    /// any.
    fn draw(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        (volume, probes): (&Volume, Listed<'_>),
        moved: Option<&MovedPast<'_>>,
    ) -> bool {
        let draws = scene.draws();
        // Rays that are averaged go to more than one face.
        let border = if volume.has_moments {
            (FRAC_PI_4 + ACROSS_TEXEL / volume.moment_texels as f32).tan()
        } else {
            1.0 + BORDER
        };
        let views = (0..probes.count).flat_map(|probe| (0..6).map(move |face| (probe, face)));
        let mut views = views
            .filter(|(probe, face)| {
                moved.is_none_or(|moved| moved.shows(probes.first + probe, *face, border))
            })
            .peekable();
        if views.peek().is_none() {
            return false;
        }
        let batches = views.flat_map(|(probe, face)| {
            let params = RasterParams {
                entry: probes.first + probe,
                face,
                near_m: NEAR * volume.lattice.cell(),
            };
            let tile = 6 * probe + face;
            let [x, y] = [tile % self.row(), tile / self.row()].map(|at| at * self.edge);
            draws.iter().map(move |draw| DrawBatch {
                push: bytemuck::bytes_of(&params).to_vec(),
                tile: Some([x, y, self.edge, self.edge]),
                ..draw.clone()
            })
        });
        let pass = probes.bind(frame.pass(&RASTER));
        pass.bind("probe_places", &volume.places).draw_indexed(
            Targets {
                color: &[(&self.seen, 0, 0, ClearOrLoad::ClearUint(NOTHING))],
                depth: Some((&self.depth, 0, ClearOrLoad::Clear([0.0; 4]))),
                extent: [MOST; 2],
                viewport: None,
            },
            &scene.corners,
            batches.collect(),
        );
        true
    }
}

/// That models have moved past probes, all of which are listed by their numbers.
pub struct MovedPast<'p> {
    /// The box in which they have (m).
    pub bounds: Moved,
    /// Where each probe stands, and where it stood when its rays were traced (m).
    pub places: [&'p [Vec3]; 2],
}

/// Of the size of a face: what is as near to its border as this counts as shown.
const BORDER: f32 = 1e-3;

/// Times the texels along an edge of an octahedral map: no two rays of a texel's square, half a
/// texel apart along both axes, have a larger angle between them.
const ACROSS_TEXEL: f32 = 3.0 * SQRT_2;

impl MovedPast<'_> {
    /// Whether a face of a probe's cube, so much larger, may show something else than before.
    fn shows(&self, probe: u32, face: u32, size: f32) -> bool {
        let [place, before] = self.places.map(|places| places[probe as usize]);
        let (low, high) = self.bounds;
        place != before || face_shows(face, size, (low - place, high - place))
    }
}

/// Whether a face of the cube around the origin, `size` times as large, may show some of a box
/// (`gi/probes/cube.glsl`).
fn face_shows(face: u32, size: f32, (low, high): (Vec3, Vec3)) -> bool {
    let axis = (face / 2) as usize;
    let farthest = if face.is_multiple_of(2) {
        high[axis]
    } else {
        -low[axis]
    };
    // Of what the face shows as far off as that, from its middle.
    let width = farthest * size;
    let beside = [(axis + 1) % 3, (axis + 2) % 3];
    let is_beside = |axis: usize| low[axis] > width || high[axis] < -width;
    farthest >= 0.0 && !beside.into_iter().any(is_beside)
}
