//! The rays of probes: what they meet, and what they bring.

use std::sync::Arc;

use glam::{DVec3, Vec3, Vec4};

use super::list::Listed;
use super::lookup::Lookup;
use super::oracle;
use super::passes::{
    BLEND, BLEND_SH, BOUNCE, BlendParams, BounceParams, LIGHT, MOMENTS, MOMENTS_POWER,
    MomentParams, RayParams, SURFACES, TRACE, TraceParams,
};
use super::volume::{Maps, Volume, carry_image, store_image};
use super::voxels::VoxelSource;
use crate::gi::shared::paths::PathScene;
use crate::gi::{Inputs, Settings};
use crate::graph::compute::linear_groups;
use crate::graph::{Buffer, Error, Frame, Gpu, Image, PassBuilder, vk};
use crate::render::GpuScene;
use crate::render::bvh::SceneRays;

/// Rays in a row of the images (`gi/probes/rays.glsl`).
const RAYS_A_ROW: u32 = 4096;

/// Rays, about, whose light is kept at a time.
const RAYS_AT_A_TIME: u32 = 1 << 20;

/// Over which rays the distances of a direction are averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MomentFilter {
    /// Rays of its texel's own square.
    Box,
    /// All rays of the probe, by the 50th power of the cosine.
    Power,
}

/// Smallest and largest corner of the box in which something has moved (m).
pub type Moved = (Vec3, Vec3);

/// How probes are lit.
pub struct Lighting<'l> {
    /// How rays look probes up at what they meet.
    pub lookup: &'l Lookup,
    /// The bounces after the first, in order: from how many to how many.
    pub bounces: &'l [[u32; 2]],
    /// Whether shadow maps, and not rays, say which light reaches what rays meet.
    pub uses_maps: bool,
    /// The share that stays of what probes have had, 0 to 1.
    pub kept: f32,
    /// What rays have met, where that is not triangles.
    pub voxels: Option<&'l VoxelSource>,
}

/// Rays that come as near to a box as this share of its largest coordinate come through it.
const BOX_SHARE: f32 = 1e-5;

/// What shaders are told of the box.
pub(super) fn corners(moved: Option<Moved>) -> [[f32; 4]; 2] {
    let (low, high) = moved.unwrap_or_default();
    let room = Vec3::splat(BOX_SHARE * low.abs().max(high.abs()).max_element());
    [low - room, high + room].map(|corner| corner.extend(0.0).to_array())
}

/// The same box, larger by a margin (m) on all sides; none where that is without end.
pub(super) fn widened((low, high): Moved, margin: f32) -> Option<Moved> {
    let margin = Vec3::splat(margin);
    margin.is_finite().then(|| (low - margin, high + margin))
}

impl MomentFilter {
    /// As the settings say.
    pub(super) fn new(settings: &Settings) -> Self {
        if settings.is("moment_filter", "power") {
            MomentFilter::Power
        } else {
            MomentFilter::Box
        }
    }
}

/// The rays of all probes, and the light of those of some.
pub struct ProbeRays {
    /// Of a probe.
    pub count: u32,
    /// RGBA32F. xyz: directions before they are turned, [`oracle::ray_set`].
    pub(super) set: Arc<Image>,
    /// RGBA32UI: triangle, place on it, distance (m); packed as `gi/probes/hit_surface.glsl` says
    /// once they are to be lit.
    pub hits: Arc<Image>,
    /// RGBA32F: radiance that a ray brings (W/(m² sr)); a: 1 where it meets nothing.
    pub light: Arc<Image>,
    /// Probes whose rays the image of light has room for.
    at_a_time: u32,
}

fn ray_image(gpu: &Gpu, name: &str, rays: u64, format: vk::Format) -> Result<Arc<Image>, Error> {
    let rows = rays.div_ceil(u64::from(RAYS_A_ROW));
    let size = [RAYS_A_ROW, u32::try_from(rows).unwrap_or(u32::MAX)];
    store_image(gpu, name, size, format)
}

impl ProbeRays {
    /// Makes room for `count` rays of each of `probe_count` probes.
    pub fn new(gpu: &Gpu, probe_count: u32, count: u32) -> Result<Self, Error> {
        let at_a_time = (RAYS_AT_A_TIME / count.max(1)).clamp(1, probe_count.max(1));
        let rays = |probes: u32| u64::from(probes) * u64::from(count);
        let set = ray_image(
            gpu,
            "probes.ray_set",
            u64::from(count),
            vk::Format::R32G32B32A32_SFLOAT,
        )?;
        let mut directions: Vec<Vec4> = oracle::ray_set(count)
            .iter()
            .map(|direction| direction.as_vec3().extend(0.0))
            .collect();
        let [width, height, _] = set.desc().extent;
        directions.resize((width * height) as usize, Vec4::ZERO);
        gpu.upload_image(&set, 0, 0, bytemuck::cast_slice(&directions))?;
        Ok(ProbeRays {
            count,
            set,
            hits: ray_image(
                gpu,
                "probes.ray_hits",
                rays(probe_count),
                vk::Format::R32G32B32A32_UINT,
            )?,
            light: ray_image(
                gpu,
                "probes.ray_light",
                rays(at_a_time),
                vk::Format::R32G32B32A32_SFLOAT,
            )?,
            at_a_time,
        })
    }

    /// The same with room for the rays of `probe_count` probes, which are more.
    pub(super) fn grown(&self, gpu: &Gpu, probe_count: u32) -> Result<Self, Error> {
        let grown = ProbeRays::new(gpu, probe_count, self.count)?;
        carry_image(gpu, &self.hits, &grown.hits)?;
        Ok(grown)
    }

    /// Adds [`TRACE`] and [`SURFACES`]: what the rays of these probes meet. With a box in which
    /// something has moved (m), rays of probes that stand where they were, and do not come through
    /// it, keep what they have met.
    pub fn trace(
        &self,
        frame: &mut Frame,
        (scene, paths): (&GpuScene, &PathScene),
        volume: &Volume,
        probes: Listed<'_>,
        moved: Option<Moved>,
    ) {
        self.trace_from(frame, &paths.rays, (&volume.places, probes), moved);
        self.pack(frame, (scene, paths), probes);
    }

    /// Adds [`SURFACES`]: packs the surfaces that rays of these probes have met.
    pub(super) fn pack(
        &self,
        frame: &mut Frame,
        (scene, paths): (&GpuScene, &PathScene),
        probes: Listed<'_>,
    ) {
        let all = probes.count * self.count;
        let pass = probes.bind(frame.pass(&SURFACES));
        paths
            .rays
            .bind(pass)
            .bind("ray_set", &self.set)
            .bind("ray_hits", &self.hits)
            .constant("EMITTERS", paths.emitters.count)
            .constant("BUMPS", scene.has_bumps())
            .push(&RayParams {
                ray_count: self.count,
                first_probe: probes.first,
                all,
            })
            .dispatch(linear_groups(all));
    }

    /// Adds [`TRACE`]: what rays of these probes meet from these places, as triangles and places on
    /// them.
    pub fn trace_from(
        &self,
        frame: &mut Frame,
        triangles: &SceneRays,
        (places, probes): (&Arc<Buffer>, Listed<'_>),
        moved: Option<Moved>,
    ) {
        let all = probes.count * self.count;
        let [low, high] = corners(moved);
        let pass = probes.bind(frame.pass(&TRACE));
        triangles
            .bind(pass)
            .bind("probe_places", places)
            .bind("ray_set", &self.set)
            .bind("ray_hits", &self.hits)
            .constant("KEEPS", moved.is_some())
            .push(&TraceParams {
                low,
                high,
                ray_count: self.count,
                first_probe: probes.first,
                all,
            })
            .dispatch(linear_groups(all));
    }

    /// Adds [`MOMENTS`] or [`MOMENTS_POWER`]: how far these probes see, where look-ups ask for it.
    /// Their rays are traced before, after the same has moved.
    pub fn moments(
        &self,
        frame: &mut Frame,
        triangles: &SceneRays,
        (volume, probes): (&Volume, Listed<'_>),
        filter: MomentFilter,
        moved: Option<Moved>,
    ) {
        if !volume.has_moments {
            return;
        }
        let params = self.moment_params(volume, probes, moved);
        let pass = match filter {
            MomentFilter::Box => triangles
                .bind(frame.pass(&MOMENTS))
                .bind("probe_places", &volume.places)
                .constant("KEEPS", moved.is_some()),
            MomentFilter::Power => frame
                .pass(&MOMENTS_POWER)
                .bind("ray_set", &self.set)
                .bind("ray_hits", &self.hits),
        };
        probes
            .bind(pass)
            .bind("probe_moments", &volume.moments)
            .push(&params)
            .dispatch(linear_groups(params.all));
    }

    /// What passes are told that find out how far these probes see.
    pub(super) fn moment_params(
        &self,
        volume: &Volume,
        probes: Listed<'_>,
        moved: Option<Moved>,
    ) -> MomentParams {
        let [low, high] = corners(moved);
        MomentParams {
            low,
            high,
            grid: [0.0; 4],
            resolution: 0,
            columns: volume.columns,
            edge: volume.moment_texels,
            first_probe: probes.first,
            all: probes.count * volume.moment_texels * volume.moment_texels,
            ray_count: self.count,
            cell_m: volume.lattice.cell(),
            reach: volume.reach(),
        }
    }

    /// What the rays of each probe that have been traced meet: their directions, and how far they
    /// go (m), infinitely where they meet nothing.
    pub fn read_distances(
        &self,
        gpu: &Gpu,
        probe_count: u32,
    ) -> Result<Vec<Vec<(Vec3, f32)>>, Error> {
        let hits: Vec<[u32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_image(&self.hits, 0, 0)?);
        let set = oracle::ray_set(self.count);
        let of_probe = |(probe, hits): (u32, &[[u32; 4]])| {
            let turn = oracle::turn_of(probe);
            let ray = |(direction, hit): (&DVec3, &[u32; 4])| {
                ((turn * *direction).as_vec3(), f32::from_bits(hit[3]).abs())
            };
            set.iter().zip(hits).map(ray).collect()
        };
        let probes = (0..probe_count).zip(hits.chunks(self.count as usize));
        Ok(probes.map(of_probe).collect())
    }

    /// Adds the passes that light these probes anew: by the lights and what emits, then with each
    /// of these bounces, 2 or more, what the one before has left. That adds to the light of the
    /// first. The last of them keeps a share of what it was.
    pub fn light(
        &self,
        frame: &mut Frame,
        given: &Inputs<'_>,
        scene: &PathScene,
        (volume, probes): (&Volume, Listed<'_>),
        how: Lighting<'_>,
    ) {
        let first = volume.lit(1);
        let last = how.bounces.len();
        let kept = |bounce: usize| if bounce == last { how.kept } else { 0.0 };
        for part in self.parts(probes) {
            match how.voxels {
                Some(voxels) => voxels.straight(frame, self, part),
                None => self.straight(frame, given, scene, (volume, part), how.uses_maps),
            }
            self.blend(frame, volume, part, [first, first], (false, kept(0)));
        }
        for (index, bounce) in (1..).zip(how.bounces) {
            let [last, next] = bounce.map(|bounce| volume.lit(bounce));
            for part in self.parts(probes) {
                self.bounce(frame, given, scene, (volume, last), how.lookup, part);
                self.blend(frame, volume, part, [first, next], (true, kept(index)));
            }
        }
    }

    /// Probes in parts, for the rays of each of which there is room in the image of light.
    pub(super) fn parts<'l>(&self, probes: Listed<'l>) -> impl Iterator<Item = Listed<'l>> {
        probes.parts(self.at_a_time)
    }

    /// Adds [`LIGHT`] of these probes: what their rays bring of the lights and of what emits.
    pub(super) fn straight(
        &self,
        frame: &mut Frame,
        given: &Inputs<'_>,
        scene: &PathScene,
        (volume, probes): (&Volume, Listed<'_>),
        uses_maps: bool,
    ) {
        let all = probes.count * self.count;
        let pass = scene.bind(probes.bind(frame.pass(&LIGHT)), given, uses_maps);
        self.bind(pass)
            .bind("probe_places", &volume.places)
            .push(&RayParams {
                ray_count: self.count,
                first_probe: probes.first,
                all,
            })
            .dispatch(linear_groups(all));
    }

    /// Binds what rays have met, and what they bring, to be written.
    pub(super) fn bind_written<'f>(&self, pass: PassBuilder<'f>) -> PassBuilder<'f> {
        pass.bind("ray_hits", &self.hits)
            .bind("ray_light", &self.light)
    }

    /// Binds the rays, what they have met, and what they bring.
    pub(super) fn bind<'f>(&self, pass: PassBuilder<'f>) -> PassBuilder<'f> {
        pass.bind("ray_set", &self.set)
            .bind("ray_hits", &self.hits)
            .bind("ray_light", &self.light)
    }

    /// Adds [`BOUNCE`] of these probes: what their rays bring of the light that all probes have.
    pub fn bounce(
        &self,
        frame: &mut Frame,
        given: &Inputs<'_>,
        scene: &PathScene,
        (volume, maps): (&Volume, &Maps),
        lookup: &Lookup,
        probes: Listed<'_>,
    ) {
        let all = probes.count * self.count;
        let pass = scene.bind(probes.bind(frame.pass(&BOUNCE)), given, false);
        self.bind(lookup.bind(pass, volume, maps))
            .push(&BounceParams {
                lookup: lookup.row(volume),
                ray_count: self.count,
                first_probe: probes.first,
                all,
            })
            .dispatch(linear_groups(all));
    }

    /// Adds [`BLEND`] or [`BLEND_SH`] of these probes; `adds`: to what `before` has; `kept`: the
    /// share that stays of what `maps` have had.
    pub fn blend(
        &self,
        frame: &mut Frame,
        volume: &Volume,
        probes: Listed<'_>,
        [before, maps]: [&Maps; 2],
        (adds, kept): (bool, f32),
    ) {
        // What is not added to is not read: then another image is bound.
        let (light_before, gradients_before, scales_before) = if adds {
            (&before.irradiance, &before.gradients, &before.scales)
        } else {
            (&self.light, &self.light, &volume.places)
        };
        let pass = if volume.is_sh {
            frame.pass(&BLEND_SH)
        } else {
            frame
                .pass(&BLEND)
                .bind("ray_hits", &self.hits)
                .bind("gradients_before", gradients_before)
                .bind("probe_gradients", &maps.gradients)
                .constant("IRRADIANCE_TEXELS", volume.irradiance_texels)
                .constant("HAS_GRADIENTS", volume.has_gradients)
        };
        probes
            .bind(pass)
            .bind("ray_set", &self.set)
            .bind("ray_light", &self.light)
            .bind("before", light_before)
            .bind("scales_before", scales_before)
            .bind("probe_scales", &maps.scales)
            .bind("probe_irradiance", &maps.irradiance)
            .constant("ADDS", adds)
            .push(&BlendParams {
                columns: volume.columns,
                ray_count: self.count,
                first_probe: probes.first,
                probe_count: probes.count,
                cell_m: volume.lattice.cell(),
                kept,
            })
            .dispatch([
                probes.count.min(65_535),
                probes.count.div_ceil(65_535).max(1),
                1,
            ]);
    }
}
