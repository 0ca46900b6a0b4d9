//! Direct light into voxels: injection of reflective shadow maps, or shading of each voxel, and
//! emission.

pub mod inject;
pub mod passes;
pub mod settings;
pub mod slots;

use inject::VoxelLookup;
use passes::{LIGHT, LIGHT_BY_RAYS, LIGHT_BY_RAYS_DENSE, LIGHT_DENSE, LightParams};

use std::sync::Arc;

use glam::Vec3;

use crate::gi::shared::voxel::build::buffer;
use crate::gi::shared::voxel::light::settings::{Attenuation, Injection, LightSettings, Viewer};
use crate::gi::shared::voxel::{Lattice, LightBounces, VoxelBox, VoxelGrid, Voxels};
use crate::graph::compute::linear_groups;
use crate::graph::{Buffer, Error, Frame, Gpu, Image};
use crate::render::bvh::SceneRays;
use crate::render::{GpuScene, LightMaps};
use crate::scene::Light;

/// Name of the fills before injection.
pub static CLEAR_LIGHT: &str = "voxel.clear_light";

/// Points of a voxel's surface that rays go from to each light, where there are few lights.
const MOST_POINTS: u32 = 16;

/// Turns of loops that the two rays of a point are trusted to stay below: one within the voxel, one
/// to the light.
const TURNS_A_POINT: u32 = 1280;

/// What the light of voxels is made of.
#[derive(Clone, Copy)]
pub struct LightInputs<'l> {
    /// Maps of the lights.
    pub maps: &'l LightMaps,
    /// Reflective ones, which may be smaller.
    pub rsm: &'l LightMaps,
    /// The scene's triangles, where rays from voxels to lights meet them.
    pub triangles: Option<&'l SceneRays>,
}

impl<'l> From<&'l LightMaps> for LightInputs<'l> {
    fn from(maps: &'l LightMaps) -> Self {
        LightInputs {
            maps,
            rsm: maps,
            triangles: None,
        }
    }
}

/// The voxels that are lit.
#[derive(Clone)]
pub struct VoxelRecords {
    /// The grid that their coordinates are in.
    pub grid: VoxelGrid,
    /// As [`Voxels::lattice`].
    pub lattice: Lattice,
    /// The voxels whose light stays as it is (voxels of the lattice).
    pub kept: VoxelBox,
    /// One [`super::build::passes::Voxel`] each, in compact order.
    pub records: Arc<Buffer>,
    /// As [`Voxels::emission`].
    pub emission: Option<Arc<Buffer>>,
    /// As [`Voxels::faces`].
    pub faces: Option<Arc<Buffer>>,
    /// Number of records in `records`.
    pub voxel_count: u32,
    /// As [`Voxels::is_dynamic`].
    pub is_dynamic: bool,
    /// Occupancy and block bases, where they are kept.
    pub dense: Option<[Arc<Buffer>; 2]>,
}

/// Dense textures that lighting also writes, mip 0 of each.
#[derive(Clone, Copy)]
pub struct DenseTexels<'t> {
    /// RGBA16F, radiance (W/(m² sr)) premultiplied by opacity.
    pub radiance: &'t Arc<Image>,
    /// RGBA16F, the mean normal of what shines times its luminance, premultiplied by opacity. Where
    /// it is there, `radiance` has both sides of a voxel together; voxels have two sides then.
    pub normals: Option<&'t Arc<Image>>,
}

impl From<&Voxels> for VoxelRecords {
    fn from(voxels: &Voxels) -> Self {
        let Voxels {
            grid,
            lattice,
            voxel_count,
            is_dynamic,
            ..
        } = *voxels;
        let (records, emission, faces) = (
            Arc::clone(&voxels.records),
            voxels.emission.clone(),
            voxels.faces.clone(),
        );
        let dense = Some([
            Arc::clone(&voxels.occupancy),
            Arc::clone(&voxels.block_bases),
        ]);
        VoxelRecords {
            grid,
            lattice,
            kept: VoxelBox::NONE,
            records,
            emission,
            faces,
            voxel_count,
            is_dynamic,
            dense,
        }
    }
}

/// Injected light of a side of a voxel (`gi/shared/voxel/light/flux.glsl`).
const FLUX_BYTES: u64 = 20;

/// One integer step of lit area (voxel faces).
pub(super) const AREA_UNIT: f32 = 1.0 / 16_777_216.0;

/// Light counters on the device.
const COUNTERS_BYTES: u64 = 8;

/// The light of the occupied voxels.
pub struct VoxelLight {
    /// How they are lit.
    pub settings: LightSettings,
    /// Voxels that there is room for.
    pub capacity: u32,
    /// Radiance (W/(m² sr)) and opacity, four half floats a side, or a face, of a voxel in compact
    /// order.
    pub radiance: Arc<Buffer>,
    /// What the voxels gathered from each other, E/π (W/(m² sr)), four half floats a side; absent
    /// with one bounce.
    pub irradiance: Option<Arc<Buffer>>,
    pub(super) flux: Arc<Buffer>,
    /// The flux came from the host and stays.
    is_given: bool,
    pub(super) counters: Arc<Buffer>,
    pub(super) flux_unit: f32,
    /// Points of a voxel's surface that rays against triangles go from to each light.
    points: u32,
    /// Voxels of this size along the largest extent of the scene, to a power of two.
    pub(super) scene_resolution: u32,
}

impl VoxelLight {
    /// Allocates for as many voxels as these have room for.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        voxels: &Voxels,
        settings: LightSettings,
    ) -> Result<Self, Error> {
        let LightSettings {
            injection,
            sides,
            bounces,
            ..
        } = settings;
        require_turns(gpu, scene, voxels, settings)?;
        let capacity = voxels.capacity();
        let count = sides as u64 * u64::from(capacity);
        let irradiance = bounces
            .any()
            .then(|| buffer(gpu, "voxel.irradiance", sides.radiance_bytes(capacity)))
            .transpose()?;
        if let (Some(irradiance), LightBounces::Feedback) = (&irradiance, bounces) {
            // The first frame reads what no frame before it has left.
            let mut frame = Frame::new();
            frame.fill(CLEAR_LIGHT, irradiance, 0);
            gpu.enqueue(frame);
        }
        Ok(VoxelLight {
            settings,
            capacity,
            radiance: buffer(gpu, "voxel.radiance", settings.radiance_bytes(capacity))?,
            irradiance,
            flux: buffer(
                gpu,
                "voxel.flux",
                if injection == Injection::Rsm {
                    FLUX_BYTES * count
                } else {
                    0
                },
            )?,
            is_given: false,
            counters: buffer(gpu, "voxel.light_counters", COUNTERS_BYTES)?,
            flux_unit: flux_unit(scene),
            points: points_a_light(gpu, scene),
            scene_resolution: scene_resolution(scene, voxels.grid.voxel_size),
        })
    }

    /// Makes room for voxels that have changed from `first_moved` on. With feedback, the voxels
    /// before it keep what they have gathered, and the changed ones start from nothing.
    pub fn follow(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
        voxels: &Voxels,
        first_moved: u32,
    ) -> Result<(), Error> {
        let before = self
            .irradiance
            .as_ref()
            .filter(|_| self.settings.bounces == LightBounces::Feedback)
            .map(Arc::clone);
        let grows = voxels.capacity() > self.capacity;
        if grows {
            *self = VoxelLight::new(gpu, scene, voxels, self.settings)?;
        }
        let (Some(before), Some(irradiance)) = (before, &self.irradiance) else {
            return Ok(());
        };
        let kept_bytes = 8 * self.settings.sides as u64 * u64::from(first_moved);
        let mut frame = Frame::new();
        if grows && kept_bytes > 0 {
            frame.copy_buffer(CLEAR_LIGHT, (&before, 0), (irradiance, 0), kept_bytes);
        } else if !grows && kept_bytes < irradiance.size_bytes() {
            frame.fill_from(CLEAR_LIGHT, irradiance, kept_bytes, 0);
        }
        gpu.enqueue(frame);
        Ok(())
    }

    /// Makes room for as many voxels as these have room for; what they gathered stays, and their
    /// radiance where it has room.
    pub fn reserve(&mut self, gpu: &Gpu, voxels: &Voxels) -> Result<(), Error> {
        let LightSettings {
            injection, sides, ..
        } = self.settings;
        self.capacity = voxels.capacity();
        let count = sides as u64 * u64::from(self.capacity);
        let radiance_bytes = self.settings.radiance_bytes(self.capacity);
        if self.radiance.size_bytes() < radiance_bytes {
            self.radiance = buffer(gpu, "voxel.radiance", radiance_bytes)?;
        }
        self.flux = buffer(
            gpu,
            "voxel.flux",
            if injection == Injection::Rsm {
                FLUX_BYTES * count
            } else {
                0
            },
        )?;
        if let Some(irradiance) = &mut self.irradiance
            && irradiance.size_bytes() < 8 * count
        {
            *irradiance = buffer(gpu, "voxel.irradiance", 8 * count)?;
        }
        Ok(())
    }

    /// Adds the passes that light the voxels; with `dense` also mip 0 of a dense texture. With
    /// feedback they reflect what the last frame left in `irradiance`.
    pub fn update<'l>(
        &self,
        frame: &mut Frame,
        voxels: &Voxels,
        inputs: impl Into<LightInputs<'l>>,
        dense: Option<DenseTexels<'_>>,
    ) {
        let (records, bound) = (
            VoxelRecords::from(voxels),
            [
                ("occupancy", &voxels.occupancy),
                ("block_bases", &voxels.block_bases),
            ],
        );
        let lookup = VoxelLookup::by_occupancy(&records, &bound);
        self.update_records(frame, &records, lookup, inputs.into(), dense);
    }

    /// As [`VoxelLight::update`], of voxels that may be found in another way.
    pub fn update_records(
        &self,
        frame: &mut Frame,
        voxels: &VoxelRecords,
        lookup: VoxelLookup<'_>,
        inputs: LightInputs<'_>,
        dense: Option<DenseTexels<'_>>,
    ) {
        let maps = inputs.rsm;
        frame.fill(CLEAR_LIGHT, &self.counters, 0);
        if let (Injection::Rsm, Some(rsm), false) =
            (self.settings.injection, &maps.rsm, self.is_given)
        {
            frame.fill(CLEAR_LIGHT, &self.flux, 0);
            if maps.view_count > 0 {
                self.inject(frame, voxels, lookup, maps, rsm);
            }
        }
        let bounces = self.settings.bounces;
        let viewer = if bounces.any() {
            Viewer::Voxels
        } else {
            Viewer::Picture
        };
        self.add_light(
            frame,
            voxels,
            inputs,
            dense,
            [bounces == LightBounces::Feedback, true],
            viewer,
        );
    }

    /// Adds the pass that lights the voxels once more in the same frame, now with what they reflect
    /// of `irradiance`, where there is any.
    pub fn relight<'l>(
        &self,
        frame: &mut Frame,
        voxels: &VoxelRecords,
        inputs: impl Into<LightInputs<'l>>,
        dense: Option<DenseTexels<'_>>,
        viewer: Viewer,
    ) {
        self.add_light(
            frame,
            voxels,
            inputs.into(),
            dense,
            [self.irradiance.is_some(), false],
            viewer,
        );
    }

    fn add_light(
        &self,
        frame: &mut Frame,
        voxels: &VoxelRecords,
        LightInputs {
            maps, triangles, ..
        }: LightInputs<'_>,
        dense: Option<DenseTexels<'_>>,
        [indirect, counting]: [bool; 2],
        viewer: Viewer,
    ) {
        let VoxelRecords { lattice, kept, .. } = voxels;
        let params = LightParams {
            grid: lattice.anchor.extend(voxels.grid.voxel_size).to_array(),
            first: lattice.first.extend(0).to_array(),
            kept_low: kept.low.extend(0).to_array(),
            kept_end: kept.end.extend(0).to_array(),
            voxel_count: voxels.voxel_count,
            flux_unit: self.flux_unit,
            area_unit: AREA_UNIT,
            resolution: voxels.grid.resolution,
            kappa: self.settings.kappa,
        };
        // Bound where nothing is read.
        let nothing = &voxels.records;
        let [occupancy, block_bases] = voxels
            .dense
            .as_ref()
            .map_or([nothing; 2], |dense| dense.each_ref());
        let triangles = triangles.filter(|_| self.settings.meets_triangles());
        let pass = match (triangles, dense) {
            (Some(triangles), dense) => triangles
                .bind(frame.pass(if dense.is_some() {
                    &LIGHT_BY_RAYS_DENSE
                } else {
                    &LIGHT_BY_RAYS
                }))
                .constant("POINTS", self.points),
            (None, Some(_)) => frame.pass(&LIGHT_DENSE),
            (None, None) => frame.pass(&LIGHT),
        };
        let pass = pass
            .bind("light_views", &maps.views)
            .bind("shadow_maps", &maps.depth)
            .bind("voxels", &voxels.records)
            .bind(
                "voxel_emission",
                voxels.emission.as_ref().unwrap_or(nothing),
            )
            .bind("flux", &self.flux)
            .bind("voxel_radiance", &self.radiance)
            .bind("lost_texels", &self.counters)
            .bind(
                "voxel_irradiance",
                self.irradiance.as_ref().unwrap_or(nothing),
            )
            .bind("occupancy", occupancy)
            .bind("block_bases", block_bases)
            .bind("voxel_faces", voxels.faces.as_ref().unwrap_or(nothing));
        let pass = if let Some(DenseTexels { radiance, normals }) = dense {
            pass.bind("dense_radiance", radiance)
                .bind("dense_normals", normals.unwrap_or(radiance))
                .constant("NORMALS", normals.is_some())
        } else {
            pass
        };
        let LightSettings {
            injection,
            sides,
            attenuation,
            occlusion,
            ..
        } = self.settings;
        let is_shaded = injection == Injection::Voxel && !self.is_given;
        let is_weighted = attenuation == Attenuation::NormalWeighted;
        let emits = voxels.emission.is_some() && self.settings.emission.includes(viewer);
        let has_faces = voxels.faces.is_some() && (dense.is_some() || self.settings.stores_faces);
        pass.constant("INJECTION_VOXEL", is_shaded)
            .constant("EMISSIVE", emits)
            .constant("SIDES", sides as u32)
            .constant("INDIRECT", indirect)
            .constant("COUNTING", counting)
            .constant("NORMAL_WEIGHTED", is_weighted)
            .constant("OCCLUSION", occlusion as u32)
            .constant("DYNAMIC", voxels.is_dynamic)
            .constant("FACES", has_faces)
            .push(&params)
            .dispatch(linear_groups(voxels.voxel_count));
    }

    /// Replaces the injection of later frames: `flux` is Φ / (π h²) [W/(m² sr)] of each side of
    /// each voxel; `None` leaves a hole.
    pub fn give_flux(&mut self, gpu: &Gpu, flux: &[Option<Vec3>]) -> Result<(), Error> {
        let words: Vec<[u32; 5]> = flux
            .iter()
            .map(|side| side.map_or([0; 5], |flux| flux_words(flux, self.flux_unit)))
            .collect();
        self.flux = buffer(gpu, "voxel.flux", FLUX_BYTES * flux.len() as u64)?;
        gpu.upload_buffer(&self.flux, bytemuck::cast_slice(&words))?;
        self.is_given = true;
        Ok(())
    }

    /// RSM texels that lay in no occupied voxel, and lit voxels that no texel fell into, in the
    /// last frame.
    pub fn counts(&self, gpu: &Gpu) -> Result<[(&'static str, u64); 2], Error> {
        let counts: Vec<u32> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&self.counters)?);
        Ok([
            ("rsm_texels_lost", u64::from(counts[0])),
            ("rsm_holes_filled", u64::from(counts[1])),
        ])
    }
}

/// Points of a voxel's surface for each light: fewer where there are many lights. 0 where there are
/// more than a shader's loops have turns for.
fn points_a_light(gpu: &Gpu, scene: &GpuScene) -> u32 {
    let light_count = scene.lights.len().max(1) as u32;
    (gpu.loops().budget / TURNS_A_POINT / light_count).min(MOST_POINTS)
}

/// Fails where rays to the lights need more turns of a shader's loops than there are.
fn require_turns(
    gpu: &Gpu,
    scene: &GpuScene,
    voxels: &Voxels,
    settings: LightSettings,
) -> Result<(), Error> {
    let (light_count, resolution) = (scene.lights.len(), voxels.grid.resolution);
    let turns = settings.sides as u64 * light_count as u64 * u64::from(3 * resolution + 1);
    let what = if settings.meets_triangles() && points_a_light(gpu, scene) == 0 {
        let most = gpu.loops().budget / TURNS_A_POINT;
        format!("rays from voxels towards {light_count} lights (at most {most})")
    } else if settings.traces() && gpu.loops().limit.is_some_and(|limit| turns > limit.into()) {
        format!("voxel_occlusion by rays towards {light_count} lights at resolution {resolution}")
    } else {
        return Ok(());
    };
    Err(Error::FeatureMissing {
        what,
        feature: "as many turns of a shader's loops",
    })
}

/// Adds counts to those of the same name.
pub fn add_counts(sums: &mut Vec<(&'static str, u64)>, counts: [(&'static str, u64); 2]) {
    for (name, count) in counts {
        match sums.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += count,
            None => sums.push((name, count)),
        }
    }
}

/// Four sums of 40 bits as the shaders have them (`gi/shared/voxel/light/flux.glsl`), the lit area
/// being the smallest that is not a hole.
fn flux_words(flux: Vec3, unit: f32) -> [u32; 5] {
    let [r, g, b] = flux
        .to_array()
        .map(|value| ((f64::from(value) / f64::from(unit)).round() as u64).min((1 << 40) - 1));
    let high = |value: u64| (value >> 32) as u32;
    [
        r as u32,
        g as u32,
        b as u32,
        1,
        high(r) | high(g) << 8 | high(b) << 16,
    ]
}

/// Voxels of a size (m) along the largest extent of the scene, to the next power of two.
fn scene_resolution(scene: &GpuScene, voxel_size: f32) -> u32 {
    voxels_along((scene.bounds.1 - scene.bounds.0).max_element(), voxel_size)
}

/// Voxels of a size along an extent (m), to the next power of two.
pub(super) fn voxels_along(extent_m: f32, voxel_size: f32) -> u32 {
    ((extent_m / voxel_size).ceil().clamp(1.0, 65536.0) as u32).next_power_of_two()
}

/// One integer step of injected radiance: 2⁻²⁰ of what the strongest light makes of a white surface
/// one scene diagonal away, as a power of two. The 40-bit sums hold 2²⁰ times that radiance, which
/// a light has 2⁻¹⁰ of the diagonal away.
fn flux_unit(scene: &GpuScene) -> f32 {
    let size_m = (scene.bounds.1 - scene.bounds.0)
        .length()
        .max(f32::MIN_POSITIVE);
    let strength = |light: &Light| match *light {
        Light::Directional { irradiance, .. } => irradiance.max_element(),
        Light::Point { intensity, .. } | Light::Spot { intensity, .. } => {
            intensity.max_element() / (size_m * size_m)
        }
    };
    let strongest = scene.lights.iter().map(strength).fold(0.0, f32::max);
    if strongest > 0.0 {
        (strongest.log2().floor() - 20.0).exp2()
    } else {
        1.0
    }
}
