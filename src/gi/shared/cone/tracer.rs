//! Cones on the device: the sets, and the passes that gather, reflect and
//! bounce by them.

use std::sync::Arc;

use super::march::{ConeKind, ConeSettings, MarchSettings};
use super::occlusion::OcclusionCones;
use super::sets::{ConeSet, cone_set, diffuse_set};
use super::volume::{ConeOutput, FaceWeights, March, Volume};
use crate::gi::Settings;
use crate::gi::shared::interleave::Pattern;
use crate::gi::shared::voxel::{Directionality, LightBounces, VoxelRecords};
use crate::gpu_struct;
use crate::graph::compute::linear_groups;
use crate::graph::{Access, Binding, Buffer, Error, Frame, Gpu, Image, Loops, Owner};
use crate::render::{GBuffer, GpuScene, Receivers, exact_screen_image, screen_groups, storage};

gpu_struct! {
    /// Parameters of `cone.gather`.
    pub struct ConeParams {
        /// xyz: smallest corner of the grid (m); w: voxel size (m).
        pub grid: [f32; 4],
        /// How they are marched.
        pub march: MarchSettings,
        /// First cone of this dispatch.
        pub first_cone: u32,
        /// One beyond its last cone.
        pub end_cone: u32,
        /// Of a tile of pixels, as [`Pattern`] packs it.
        pub pattern: u32,
        /// Width of a stratum of sin²θ; 0 where elevations are fixed.
        pub jitter: f32,
        /// 1 for visibility alone.
        pub is_occlusion: u32,
        /// Of the volume, from a face of what it stores to the next.
        pub face_stride: u32,
    }
}

gpu_struct! {
    /// Parameters of `cone.specular`.
    pub struct SpecularParams {
        /// xyz: smallest corner of the grid (m); w: voxel size (m).
        pub grid: [f32; 4],
        /// How they are marched.
        pub march: MarchSettings,
        /// As in [`ConeParams`].
        pub face_stride: u32,
        /// As in [`ConeParams`]; each pixel mirrors about a half vector of its own.
        pub pattern: u32,
        /// tan(γ/2) of every cone; 0: by the lobe.
        pub own_tan_half: f32,
        /// q of Kahl 2019, equation 5.6; 0: off.
        pub falloff: f32,
        /// p of the same equation (rad).
        pub grace: f32,
        /// Lights that it is a sum over.
        pub light_count: u32,
    }
}

gpu_struct! {
    /// Parameters of `voxel.bounce` by cones.
    pub struct BounceConeParams {
        /// xyz: first voxel of the piece of the grid that the voxels are of.
        pub first_voxel: [f32; 4],
        /// How they are marched.
        pub march: MarchSettings,
        /// Number of occupied voxels.
        pub voxel_count: u32,
        /// First cone of this dispatch.
        pub first_cone: u32,
        /// One beyond its last cone.
        pub end_cone: u32,
        /// Width of a stratum of sin²θ.
        pub jitter: f32,
        /// Edge of the voxels that gather (voxels that are gathered from).
        pub voxel_scale: f32,
        /// As in [`ConeParams`].
        pub face_stride: u32,
    }
}

pub(in crate::gi) const GATHER: [Binding; 4] = [
    Binding::sampled("view_depth", Access::ComputeSampled),
    Binding::sampled("normals", Access::ComputeSampled),
    Binding::buffer("cones", Access::ComputeRead),
    Binding::image("indirect_diffuse", Access::ComputeReadWrite),
];

pub(in crate::gi) const SPECULAR: [Binding; 4] = [
    Binding::sampled("view_depth", Access::ComputeSampled),
    Binding::sampled("normals", Access::ComputeSampled),
    Binding::sampled("specular", Access::ComputeSampled),
    Binding::image("indirect_specular", Access::ComputeWrite),
];

pub(in crate::gi) const BOUNCE: [Binding; 3] = [
    Binding::buffer("voxel_records", Access::ComputeRead),
    Binding::buffer("cones", Access::ComputeRead),
    Binding::buffer("voxel_irradiance", Access::ComputeReadWrite),
];

/// tan(γ/2) of a full angle.
pub(super) fn tan_half(degrees: f32) -> f32 {
    (0.5 * degrees.to_radians()).tan()
}

/// A cone set on the device.
pub(super) struct DeviceSet {
    pub(super) cones: Arc<Buffer>,
    pub(super) count: u32,
    pub(super) jitter: f32,
    pub(super) is_narrow: bool,
}

impl DeviceSet {
    pub(super) fn new(gpu: &Gpu, name: &str, set: &ConeSet) -> Result<Self, Error> {
        let is_narrow = set
            .cones
            .iter()
            .all(|cone| cone.tan_half_aperture <= NARROW);
        let rows: Vec<[f32; 4]> = set
            .cones
            .iter()
            .map(|cone| {
                [
                    cone.sin2_theta,
                    cone.phi_rad,
                    cone.tan_half_aperture,
                    cone.weight,
                ]
            })
            .collect();
        Ok(DeviceSet {
            cones: storage(gpu, (name, Owner::Screen), bytemuck::cast_slice(&rows))?,
            count: rows.len() as u32,
            jitter: set.stratum,
            is_narrow,
        })
    }
}

/// Cone sets on the device, and how they are traced.
pub struct ConeTracer {
    pub(super) settings: ConeSettings,
    /// Of a pixel.
    pub(super) set: DeviceSet,
    /// Of a voxel, where voxels gather.
    bounce_set: Option<DeviceSet>,
    /// Of a pixel's ambient visibility, where it has cones of its own.
    pub(super) occlusion: Option<OcclusionCones>,
    /// tan(γ/2) of the cone to a light; absent where shadow maps say what hides it.
    pub(super) shadow_tan_half: Option<f32>,
    /// tan(γ/2) of the specular cone; 0: by the lobe.
    pub(super) specular_tan_half: f32,
    pub(super) specular_kind: ConeKind,
    pub(super) shadow_kind: ConeKind,
    /// q and p (rad) of Kahl 2019, equation 5.6.
    specular_falloff: [f32; 2],
    /// Whether gathered light is multiplied by what the cones to lights see (equation 5.9).
    pub(super) obscures_diffuse: bool,
    /// Whether diffuse cones skip samples of a dense volume's empty space. The picture is the
    /// same, bit by bit.
    pub skips_empty: bool,
}

/// Cones of at most this tan(γ/2) skip empty space: wider ones leave it within a few samples, of
/// which most see matter.
const NARROW: f32 = 0.3;

/// Turns of a sample's loops where lanes differ in whether a level has faces.
const FACE_TURNS: u32 = 5;

/// Samples of the longest cone: across the cube's diagonal, √3 n voxels, in steps of no less than β
/// voxels.
pub(super) fn longest_march(resolution: u32, step_factor: f32) -> u32 {
    (1.8 * resolution as f32 / step_factor).ceil() as u32 + 1
}

pub(super) fn face_turns(directionality: Directionality) -> u32 {
    if directionality == Directionality::Isotropic {
        0
    } else {
        FACE_TURNS
    }
}

impl ConeTracer {
    /// From a technique's settings.
    pub fn new(gpu: &Gpu, settings: &Settings) -> Result<Self, Error> {
        let kinds = ["specular", "shadow", "occlusion"].map(|kind| ConeKind::new(settings, kind));
        let resolution = settings.count("resolution");
        let step_factor = kinds
            .iter()
            .fold(settings.number("step_factor"), |least, kind| {
                least.min(kind.step_factor)
            });
        let [specular_kind, shadow_kind, occlusion_kind] = kinds;
        // A sample that is taken costs a turn of two loops.
        let turns = 2 + face_turns(Directionality::new(settings));
        let most = turns * longest_march(resolution, step_factor);
        if gpu.loops().limit.is_some_and(|limit| most > limit) {
            let what = format!(
                "step_factor {step_factor} at resolution {resolution} (take larger steps or fewer \
                 voxels)"
            );
            return Err(Error::FeatureMissing {
                what,
                feature: "as many turns of a shader's loops",
            });
        }
        let aperture_scale = settings.number("aperture_scale");
        let set = DeviceSet::new(gpu, "cone.set", &diffuse_set(settings))?;
        let occlusion = OcclusionCones::new(gpu, settings, occlusion_kind)?;
        let bounce_set = cone_set(settings.count("bounce_directions"), true, aperture_scale);
        Ok(ConeTracer {
            settings: ConeSettings {
                pattern: Pattern::new(settings),
                specular_pattern: Pattern::specular(settings),
                step_factor: settings.number("step_factor"),
                opacity_exponent: settings.number("opacity_exponent"),
                height_clamp: settings.number("height_clamp"),
                start_offset: settings.number("start_offset"),
                max_distance_m: settings.number("max_distance"),
                ao_falloff: settings.number("ao_falloff"),
                radius_falloff: 0.0,
                early_stop: settings.number("early_stop"),
                first_hit: settings.number("first_hit"),
                near_strength: 0.0,
                face_weights: if settings.find_choice("face_weights") == Some("squared") {
                    FaceWeights::Squared
                } else {
                    FaceWeights::Extinction
                },
            },
            bounce_set: LightBounces::new(settings)
                .any()
                .then(|| DeviceSet::new(gpu, "cone.bounce_set", &bounce_set))
                .transpose()?,
            occlusion,
            shadow_tan_half: settings
                .is("shadows", "cones")
                .then(|| tan_half(settings.number("shadow_aperture"))),
            specular_tan_half: tan_half(settings.number("specular_aperture")),
            specular_kind,
            shadow_kind,
            specular_falloff: [
                settings.number("specular_falloff"),
                settings.number("specular_grace").to_radians(),
            ],
            obscures_diffuse: settings.is("obscured_diffuse", "on"),
            skips_empty: set.is_narrow,
            set,
        })
    }

    /// Whether lights have shadows by cones.
    pub fn has_shadows(&self) -> bool {
        self.shadow_tan_half.is_some()
    }

    /// Whether there are cones even where something else gathers the diffuse light.
    pub fn is_beside_gather(&self) -> bool {
        self.has_shadows() || self.occlusion.is_some()
    }

    /// Whether some cones, the specular one aside, skip empty space, and so need the matter pyramid
    /// of a dense volume.
    pub fn needs_matter(&self) -> bool {
        self.skips_empty
            || self.has_shadows()
            || (self.occlusion.as_ref()).is_some_and(OcclusionCones::is_narrow)
    }

    /// Adds the diffuse gather.
    pub fn gather(&self, frame: &mut Frame, receivers: &Receivers<'_>, volume: Volume<'_>) {
        self.add_gather(frame, receivers, volume, ConeOutput::Light);
    }

    fn add_gather(
        &self,
        frame: &mut Frame,
        receivers: &Receivers<'_>,
        volume: Volume<'_>,
        output: ConeOutput,
    ) {
        let march = March::new(self.skips_empty, output, self.settings.face_weights);
        for params in gather_params(frame.loops(), &self.settings, &self.set, volume) {
            volume
                .pass(frame, &volume.passes.gather, march)
                .bind("view_depth", receivers.view_depth)
                .bind("normals", receivers.normals)
                .bind("cones", &self.set.cones)
                .bind("indirect_diffuse", receivers.light)
                .push(&params)
                .dispatch(receivers.groups());
        }
    }

    /// Adds `voxel.bounce` for the voxels of a grid, or of a piece of it: what reaches each, E/π,
    /// into `irradiance`. Nothing where the settings have one bounce.
    pub fn bounce(
        &self,
        frame: &mut Frame,
        voxels: &VoxelRecords,
        volume: Volume<'_>,
        irradiance: &Arc<Buffer>,
    ) {
        let Some(set) = &self.bounce_set else { return };
        let (s, grid) = (&self.settings, volume.grid);
        let march = March::new(self.skips_empty, ConeOutput::Light, s.face_weights);
        let first_voxel = ((voxels.grid.origin - grid.origin) / voxels.grid.voxel_size).round();
        for [first_cone, end_cone] in s.dispatches(frame.loops(), volume, set.count) {
            let params = BounceConeParams {
                first_voxel: first_voxel.extend(0.0).to_array(),
                march: s.march(volume),
                voxel_count: voxels.voxel_count,
                first_cone,
                end_cone,
                jitter: set.jitter,
                voxel_scale: voxels.grid.voxel_size / grid.voxel_size,
                face_stride: volume.face_stride,
            };
            volume
                .pass(frame, &volume.passes.bounce, march)
                .bind("voxel_records", &voxels.records)
                .bind("cones", &set.cones)
                .bind("voxel_irradiance", irradiance)
                .push(&params)
                .dispatch(linear_groups(volume.sides * voxels.voxel_count));
        }
    }

    /// Adds the specular cone; nothing in a scene without glossy surfaces.
    pub fn specular(
        &self,
        frame: &mut Frame,
        (scene, gbuffer): (&GpuScene, &GBuffer),
        volume: Volume<'_>,
        result: &Arc<Image>,
    ) {
        self.add_specular(frame, (scene, gbuffer), volume, result, ConeOutput::Light);
    }

    fn add_specular(
        &self,
        frame: &mut Frame,
        (scene, gbuffer): (&GpuScene, &GBuffer),
        volume: Volume<'_>,
        result: &Arc<Image>,
        output: ConeOutput,
    ) {
        let Some(specular) = &gbuffer.specular else {
            return;
        };
        let s = self.settings.of_kind(self.specular_kind);
        let [falloff, grace] = self.specular_falloff;
        let params = SpecularParams {
            grid: volume.grid.row(),
            march: s.march(volume),
            face_stride: volume.face_stride,
            pattern: s.specular_pattern.bits(),
            own_tan_half: self.specular_tan_half,
            falloff,
            grace,
            light_count: scene.lights.len() as u32,
        };
        let march = March::new(true, output, s.face_weights);
        volume
            .pass(frame, &volume.passes.specular, march)
            .bind("view_depth", &gbuffer.view_depth)
            .bind("normals", &gbuffer.normals)
            .bind("specular", specular)
            .bind("indirect_specular", result)
            .push(&params)
            .dispatch(screen_groups(gbuffer.size));
    }

    /// Samples that all cones of a picture take, skipped ones too, by pass: counted by the passes
    /// themselves, in a run without light. `counted`: whether to count the diffuse gather, and
    /// the specular cone. The scene's frame constants are those of the picture.
    pub fn count_samples(
        &self,
        gpu: &Gpu,
        scene: &GpuScene,
        gbuffer: &GBuffer,
        volume: Volume<'_>,
        counted: [bool; 2],
    ) -> Result<Vec<(&'static str, u64)>, Error> {
        let result = exact_screen_image(gpu, "cone.samples", gbuffer.size)?;
        let mut counts = Vec::new();
        let passes = [&volume.passes.gather, &volume.passes.specular];
        for (index, pass) in passes
            .into_iter()
            .enumerate()
            .filter(|(index, _)| counted[*index])
        {
            let mut frame = Frame::new();
            frame.set_scene(&scene.set, &scene.materials);
            if index == 0 {
                let receivers = gbuffer.receivers(scene, &result);
                self.add_gather(&mut frame, &receivers, volume, ConeOutput::Samples);
            } else {
                self.add_specular(
                    &mut frame,
                    (scene, gbuffer),
                    volume,
                    &result,
                    ConeOutput::Samples,
                );
            }
            gpu.submit(frame)?;
            let texels: Vec<[f32; 4]> =
                bytemuck::pod_collect_to_vec(&gpu.read_image(&result, 0, 0)?);
            counts.push((pass.name, texels.iter().map(|texel| texel[0] as u64).sum()));
        }
        Ok(counts)
    }
}

impl ConeSettings {
    /// First cone, and one beyond the last, of as many dispatches as keep the loops of one thread's
    /// cones within their budget.
    pub(super) fn dispatches(&self, loops: Loops, volume: Volume<'_>, count: u32) -> Vec<[u32; 2]> {
        // A sample that is taken costs a turn of both loops; one that is skipped costs a turn of
        // the inner one, which at worst no two lanes of a vector take together.
        let turns = 2 + loops.lanes + face_turns(volume.directionality);
        let cones_a_dispatch =
            (loops.budget / (turns * longest_march(volume.voxels_across, self.step_factor))).max(1);
        (0..count)
            .step_by(cones_a_dispatch as usize)
            .map(|first| [first, (first + cones_a_dispatch).min(count)])
            .collect()
    }
}

/// What `cone.gather` and `cone.occlusion` are told, dispatch by dispatch.
pub(super) fn gather_params(
    loops: Loops,
    s: &ConeSettings,
    set: &DeviceSet,
    volume: Volume<'_>,
) -> impl Iterator<Item = ConeParams> {
    let face_stride = volume.face_stride;
    let params = move |[first_cone, end_cone]: [u32; 2]| ConeParams {
        grid: volume.grid.row(),
        march: MarchSettings {
            ao_falloff: s.ao_falloff,
            radius_falloff: s.radius_falloff,
            first_hit: s.first_hit,
            ..s.march(volume)
        },
        first_cone,
        end_cone,
        pattern: s.pattern.bits(),
        jitter: set.jitter,
        is_occlusion: 0,
        face_stride,
    };
    let dispatches = s.dispatches(loops, volume, set.count);
    dispatches.into_iter().map(params)
}
