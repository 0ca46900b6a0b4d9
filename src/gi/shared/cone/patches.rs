//! Light from surfaces that emit: a bounded number of patches, each seen by a cone that is as wide
//! as the patch.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::march::MarchSettings;
use super::tracer::ConeTracer;
use super::volume::{ConeOutput, March, Volume};
use crate::gi::Settings;
use crate::gi::settings::SettingError;
use crate::gpu_struct;
use crate::graph::{Access, Binding, Buffer, Error, Frame, Gpu, Image, Owner};
use crate::render::{Emitter, GBuffer, GpuScene, screen_groups, storage};

gpu_struct! {
    /// A patch as `cone.patches` reads it.
    pub struct GpuPatch {
        /// xyz: position (m); w: area (m²).
        pub position_area: [f32; 4],
        /// xyz: unit normal; w: radius (m).
        pub normal_radius: [f32; 4],
        /// rgb: emitted radiance (W/(m² sr)).
        pub radiance: [f32; 4],
    }
}

gpu_struct! {
    /// Parameters of `cone.patches`.
    pub struct PatchParams {
        /// xyz: smallest corner of the grid (m); w: voxel size (m).
        pub grid: [f32; 4],
        /// How they are marched.
        pub march: MarchSettings,
        /// First patch of this dispatch.
        pub first_patch: u32,
        /// One beyond its last patch.
        pub end_patch: u32,
        /// Of the volume, from a face of what it stores to the next.
        pub face_stride: u32,
    }
}

pub(in crate::gi) const BINDINGS: [Binding; 4] = [
    Binding::sampled("view_depth", Access::ComputeSampled),
    Binding::sampled("normals", Access::ComputeSampled),
    Binding::buffer("patches", Access::ComputeRead),
    Binding::image("indirect_diffuse", Access::ComputeReadWrite),
];

/// Part of the surface that emits, as a disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Mean position, weighted with what is given off there (m).
    pub position: Vec3,
    /// Unit normal of the side that emits, likewise.
    pub normal: Vec3,
    /// Area of all surface in it (m²).
    pub area: f32,
    /// Of the disc whose points are as far from its centre, in the root mean square (m).
    pub radius: f32,
    /// Mean emitted radiance (W/(m² sr)).
    pub radiance: Vec3,
}

impl Patch {
    fn row(&self) -> GpuPatch {
        GpuPatch {
            position_area: self.position.extend(self.area).to_array(),
            normal_radius: self.normal.extend(self.radius).to_array(),
            radiance: self.radiance.extend(0.0).to_array(),
        }
    }
}

/// Some emitters, what they give off in all, and how they are spread, weighted with it.
struct Group<'e> {
    emitters: Vec<&'e Emitter>,
    intensity: f64,
    /// Mean of the six coordinates: position / scale, and normal.
    mean: [f64; 6],
    variance: [f64; 6],
}

/// Position in units of `scale_m`, and normal.
fn coordinates(emitter: &Emitter, scale_m: f64) -> [f64; 6] {
    let ([x, y, z], [a, b, c]) = (
        (emitter.position.as_dvec3() / scale_m).to_array(),
        emitter.normal.as_dvec3().to_array(),
    );
    [x, y, z, a, b, c]
}

impl<'e> Group<'e> {
    fn new(emitters: Vec<&'e Emitter>, scale_m: f64) -> Self {
        let (mut intensity, mut sums, mut squares) = (0.0, [0.0; 6], [0.0; 6]);
        for emitter in &emitters {
            let weight = f64::from(emitter.intensity());
            intensity += weight;
            for (axis, at) in coordinates(emitter, scale_m).into_iter().enumerate() {
                sums[axis] += weight * at;
                squares[axis] += weight * at * at;
            }
        }
        let mean = sums.map(|sum| sum / intensity);
        let variance = std::array::from_fn(|axis| {
            (squares[axis] / intensity - mean[axis] * mean[axis]).max(0.0)
        });
        Group {
            emitters,
            intensity,
            mean,
            variance,
        }
    }

    /// Variance times intensity: what is wrong with taking it for a disc.
    fn spread(&self) -> f64 {
        self.intensity * self.variance.iter().sum::<f64>()
    }

    /// Two groups, parted at the mean of the coordinate that is spread most; `None` where all have
    /// one place.
    fn split(&self, scale_m: f64) -> Option<[Group<'e>; 2]> {
        let widest = (0..6).fold(0, |widest, axis| {
            if self.variance[axis] > self.variance[widest] {
                axis
            } else {
                widest
            }
        });
        let (low, high): (Vec<_>, Vec<_>) = self
            .emitters
            .iter()
            .partition(|emitter| coordinates(emitter, scale_m)[widest] < self.mean[widest]);
        let is_split = !low.is_empty() && !high.is_empty();
        is_split.then(|| [low, high].map(|emitters| Group::new(emitters, scale_m)))
    }

    fn patch(&self, scale_m: f64) -> Patch {
        let sum = |of: &dyn Fn(&Emitter) -> DVec3| {
            self.emitters
                .iter()
                .map(|emitter| of(emitter))
                .sum::<DVec3>()
        };
        let area: f64 = self
            .emitters
            .iter()
            .map(|emitter| f64::from(emitter.area))
            .sum();
        let [x, y, z, a, b, c] = self.mean;
        let variance = scale_m * scale_m * self.variance[..3].iter().sum::<f64>();
        Patch {
            position: (DVec3::new(x, y, z) * scale_m).as_vec3(),
            normal: DVec3::new(a, b, c)
                .normalize_or(self.emitters[0].normal.as_dvec3())
                .as_vec3(),
            area: area as f32,
            radius: (2.0 * variance).sqrt() as f32,
            radiance: (sum(&|emitter| f64::from(emitter.area) * emitter.radiance.as_dvec3())
                / area)
                .as_vec3(),
        }
    }
}

/// At most `count` patches that hold all emitters, those alike in place (in units of `scale_m`) and
/// normal together: the group with the largest variance, weighted with what it gives off, is cut in
/// two until there are enough.
pub fn patches(emitters: &[Emitter], count: usize, scale_m: f32) -> Vec<Patch> {
    let scale_m = f64::from(scale_m);
    let mut groups: Vec<Group> = if emitters.is_empty() || count == 0 {
        Vec::new()
    } else {
        vec![Group::new(emitters.iter().collect(), scale_m)]
    };
    while groups.len() < count {
        let Some(widest) =
            (0..groups.len()).max_by(|a, b| groups[*a].spread().total_cmp(&groups[*b].spread()))
        else {
            break;
        };
        let Some([low, high]) = groups[widest].split(scale_m) else {
            break;
        };
        groups[widest] = low;
        groups.push(high);
    }
    groups.iter().map(|group| group.patch(scale_m)).collect()
}

/// How what surfaces emit comes to the picture, in a scene where something emits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmitterMethod {
    /// The gather meets it in the voxels.
    Gather,
    /// From patches, along a cone each.
    Patches,
    /// From points of the surfaces, along a ray each; to voxels too.
    Points,
}

impl EmitterMethod {
    /// From a technique's settings.
    pub fn new(settings: &Settings) -> Self {
        let is_auto = settings.is("emitters", "auto");
        if settings.is("emitters", "points") || (is_auto && has_rays(settings)) {
            EmitterMethod::Points
        } else if settings.is("emitters", "gather") || settings.count("emissive_patches") == 0 {
            EmitterMethod::Gather
        } else {
            EmitterMethod::Patches
        }
    }
}

fn has_rays(settings: &Settings) -> bool {
    settings
        .find_choice("gather")
        .is_some_and(|gather| gather != "cones")
}

/// An error where points are asked for and nothing traces rays.
pub(super) fn check(settings: &Settings) -> Result<(), SettingError> {
    if settings.is("emitters", "points") && !has_rays(settings) {
        return Err(SettingError::Together(
            "emitters = points needs gather = rays or triangles; emitters = patches does not"
                .into(),
        ));
    }
    Ok(())
}

/// The patches of a scene on the device.
pub struct EmissivePatches {
    most: u32,
    buffer: Arc<Buffer>,
    count: u32,
}

/// Share of the scene's diagonal that parts patches as much as a right angle between their normals.
const SCALE: f32 = 0.25;

impl EmissivePatches {
    /// At most `most`, at least 1, of the scene as it is.
    pub fn new(gpu: &Gpu, scene: &GpuScene, most: u32) -> Result<Self, Error> {
        let buffer = storage(
            gpu,
            ("cone.patches", Owner::Store),
            &vec![0; size_of::<GpuPatch>() * most as usize],
        )?;
        let mut made = EmissivePatches {
            most,
            buffer,
            count: 0,
        };
        made.follow(gpu, scene)?;
        Ok(made)
    }

    /// Those of the scene as it is.
    pub fn list(&self, scene: &GpuScene) -> Vec<Patch> {
        let scale_m = SCALE
            * (scene.bounds.1 - scene.bounds.0)
                .length()
                .max(f32::MIN_POSITIVE);
        patches(&scene.emitters, self.most as usize, scale_m)
    }

    /// Brings them up to where the scene's models are.
    pub fn follow(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<(), Error> {
        let mut rows: Vec<GpuPatch> = self.list(scene).iter().map(Patch::row).collect();
        self.count = rows.len() as u32;
        rows.resize(self.most as usize, bytemuck::Zeroable::zeroed());
        gpu.upload_buffer(&self.buffer, bytemuck::cast_slice(&rows))
    }
}

impl ConeTracer {
    /// Adds the light of patches to what was gathered, each seen by a cone.
    pub fn patches(
        &self,
        frame: &mut Frame,
        gbuffer: &GBuffer,
        volume: Volume<'_>,
        patches: &EmissivePatches,
        result: &Arc<Image>,
    ) {
        let s = &self.settings;
        for [first_patch, end_patch] in s.dispatches(frame.loops(), volume, patches.count) {
            let params = PatchParams {
                grid: volume.grid.row(),
                march: s.march(volume),
                first_patch,
                end_patch,
                face_stride: volume.face_stride,
            };
            let march = March::new(true, ConeOutput::Light, s.face_weights);
            volume
                .pass(frame, &volume.passes.patches, march)
                .bind("view_depth", &gbuffer.view_depth)
                .bind("normals", &gbuffer.normals)
                .bind("patches", &patches.buffer)
                .bind("indirect_diffuse", result)
                .push(&params)
                .dispatch(screen_groups(gbuffer.size));
        }
    }
}
