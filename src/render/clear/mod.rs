//! What is clear, in front of the picture: thin sheets filter what is behind them, and bodies bend
//! each pixel's ray (`docs/glass.md`).
//!
//! Clear surfaces are in no store and in no map. Where a ray goes is found out here, through the
//! triangles of what is clear; what is seen along it up to the next of them, who draws the frame
//! asks of a technique ([`SightRays`]).

pub mod oracle;
mod passes;

pub use passes::{
    COVER, ClearShadowParams, ENTER, EnterParams, GpuClear, GpuSight, GpuSightRay, GpuWay, PASS,
    SHADOW,
};

use std::sync::Arc;

use bytemuck::cast_slice;
use glam::{Vec3, Vec4};

use super::bvh::SceneRays;
use super::gpu_scene::{GpuScene, clear_shadow_rows, storage};
use super::screen::gbuffer::GBuffer;
use super::screen::output::{IndirectLight, Output, screen_groups, screen_image};
use crate::graph::{Buffer, BufferDesc, BufferUsage, Error, Frame, Gpu, Image, Owner, SceneSet};
use crate::scene::{Environment, Light, Material, Scene, Transmission};

/// Rows along an edge of a light's shadow.
const SHADOW_EDGE: u32 = 1024;

/// Which ray goes on from the first body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum First {
    /// The refracted one.
    Refracted,
    /// The mirrored one.
    Mirrored,
}

impl First {
    /// Both.
    pub const ALL: [First; 2] = [First::Refracted, First::Mirrored];

    /// Lines of sight of its way, one behind the other. What is left of light after them is lost: a
    /// body seen through another has four surfaces.
    pub const fn sight_count(self) -> u32 {
        match self {
            First::Refracted => 6,
            First::Mirrored => 2,
        }
    }
}

/// Lines of sight for which a technique says what is seen along them, where it is lit
/// (`shared/sight.glsl`).
#[derive(Clone, Copy)]
pub struct SightRays<'r> {
    /// A [`GpuSightRay`] each.
    pub rays: &'r Arc<Buffer>,
    /// A [`GpuSight`] each. Those that are not asked stay as they are.
    pub sights: &'r Arc<Buffer>,
    /// Number of lines.
    pub count: u32,
}

/// The clear surfaces of a scene, and the pictures of what is seen through them.
pub struct ClearSurfaces {
    scene: GpuScene,
    set: Arc<SceneSet>,
    rays: SceneRays,
    materials: Arc<Buffer>,
    /// Which share of each light passes them (`shared/clear_shadow.glsl`).
    shadows: Arc<Buffer>,
    /// Lights or clear models have moved since shadows were drawn.
    has_moved: bool,
    /// Models have moved, and what rays meet has not followed.
    is_behind: bool,
    bends: bool,
    /// Where rays of pixels go, and what they see; nothing where no technique follows them.
    ways: Arc<Buffer>,
    sight_rays: Arc<Buffer>,
    sights: Arc<Buffer>,
    filter: Arc<Image>,
    light: Arc<Image>,
    covered: [Arc<Image>; 2],
}

impl ClearSurfaces {
    /// Of a scene; `None` where nothing is clear that can be shown: bodies take a technique that
    /// sees along rays (`sees`), and are left out otherwise, with a warning.
    pub fn new(
        gpu: &Gpu,
        opaque: &mut GpuScene,
        sees: bool,
        size: [u32; 2],
    ) -> Result<Option<Self>, Error> {
        // Another technique may have shown more.
        opaque.set_clear_shadows(gpu, None)?;
        let Some(clear) = opaque.clear.clone() else {
            return Ok(None);
        };
        let shown = |material: &Material| sees || !material.bends();
        let part = clear.part(shown);
        let left_out = clear.triangles.len() - part.triangles.len();
        if left_out > 0 {
            log::warn!(
                "{}: {left_out} triangles bound bodies that bend light; this technique leaves them \
                 out, as it sees along no rays",
                clear.name,
            );
        }
        if part.triangles.is_empty() {
            return Ok(None);
        }
        let mut scene = GpuScene::of_part(gpu, &part)?;
        scene.cascades = opaque.cascades;
        let set = scene.set_with(gpu, opaque.frame_uniform())?;
        let materials: Vec<GpuClear> = part.materials.iter().map(gpu_clear).collect();
        let bends = part.triangles.iter().any(|triangle| {
            let material = &part.materials[triangle.material as usize];
            material.bends()
        });
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let count = if bends { pixels } else { 1 };
        let buffer = |name: &str, row: usize| {
            gpu.create_buffer(&BufferDesc {
                name: name.into(),
                size_bytes: count * row as u64,
                usage: BufferUsage::Storage,
                owner: Owner::Screen,
            })
        };
        let image = |name: &str| screen_image(gpu, name, size);
        let row_count = opaque.lights.len() as u64 * u64::from(clear_shadow_rows(SHADOW_EDGE));
        let shadows = gpu.create_buffer(&BufferDesc {
            name: "clear.shadows".into(),
            size_bytes: row_count.max(1) * size_of::<[f32; 4]>() as u64,
            usage: BufferUsage::Storage,
            owner: Owner::Shared,
        })?;
        opaque.set_clear_shadows(gpu, Some((&shadows, SHADOW_EDGE)))?;
        Ok(Some(ClearSurfaces {
            rays: SceneRays::new(gpu, &scene)?,
            set,
            scene,
            materials: storage(
                gpu,
                ("clear.materials", Owner::Shared),
                cast_slice(&materials),
            )?,
            shadows,
            has_moved: true,
            is_behind: false,
            bends,
            ways: buffer("clear.ways", size_of::<GpuWay>())?,
            sight_rays: buffer("clear.sight_rays", size_of::<GpuSightRay>())?,
            sights: buffer("clear.sights", size_of::<GpuSight>())?,
            filter: image("clear.filter")?,
            light: image("clear.light")?,
            covered: [image("clear.diffuse")?, image("clear.specular")?],
        }))
    }

    /// Brings clear models up to where they are in the scene. False where none has moved.
    pub fn set_pose(&mut self, gpu: &Gpu, scene: &Scene) -> Result<bool, Error> {
        self.is_behind |= self.scene.set_pose(gpu, scene)?;
        let has_moved = self.is_behind;
        if has_moved {
            self.has_moved = true;
            self.rays.follow(gpu, &self.scene)?;
            self.is_behind = false;
        }
        Ok(has_moved)
    }

    /// The lights have moved.
    pub fn relight(&mut self) {
        self.has_moved = true;
    }

    /// A frame was drawn: its shadows stand.
    pub fn keep(&mut self) {
        self.has_moved = false;
    }

    /// Adds the passes that draw the shadows of the lights of a scene, if anything has moved.
    pub fn draw_shadows(&self, frame: &mut Frame, opaque: &GpuScene) {
        if !self.has_moved {
            return;
        }
        frame.set_scene(&self.set, &self.scene.materials);
        let (low, high) = self.scene.lit_bounds();
        let middle = 0.5 * (low + high);
        let half_edge = (0.5 * (high - low).length()).max(f32::MIN_POSITIVE);
        for (index, light) in (0u32..).zip(&opaque.lights) {
            let (position, direction) = match *light {
                Light::Directional { direction, .. } => (Vec4::ZERO, direction),
                Light::Point { position, .. } | Light::Spot { position, .. } => {
                    (position.extend(1.0), Vec3::ZERO)
                }
            };
            self.rays
                .bind(frame.pass(&SHADOW))
                .bind("clear_materials", &self.materials)
                .bind("shadow_rows", &self.shadows)
                .push(&ClearShadowParams {
                    middle: middle.extend(half_edge).to_array(),
                    position: position.to_array(),
                    direction: direction.extend(0.0).to_array(),
                    first_row: index * clear_shadow_rows(SHADOW_EDGE),
                    edge: SHADOW_EDGE,
                })
                .dispatch(screen_groups([SHADOW_EDGE; 2]));
        }
        frame.set_scene(&opaque.set, &opaque.materials);
    }

    /// Takes the environment that is seen through them.
    pub fn set_environment(
        &mut self,
        gpu: &Gpu,
        (opaque, environment): (&GpuScene, &Environment),
    ) -> Result<(), Error> {
        self.scene.set_environment(gpu, environment)?;
        self.set = self.scene.set_with(gpu, opaque.frame_uniform())?;
        Ok(())
    }

    /// Adds the passes that put them in front of the picture. `see` adds the pass that says what is
    /// seen along lines of sight. Returns the light of the technique with that.
    pub fn draw(
        &self,
        frame: &mut Frame,
        (opaque, gbuffer, output): (&GpuScene, &GBuffer, &Output),
        light: &IndirectLight,
        mut see: impl FnMut(&mut Frame, SightRays<'_>),
    ) -> IndirectLight {
        let [width, height] = gbuffer.size;
        let sights = SightRays {
            rays: &self.sight_rays,
            sights: &self.sights,
            count: width * height,
        };
        for first in First::ALL.into_iter().take(1 + usize::from(self.bends)) {
            frame.set_scene(&self.set, &self.scene.materials);
            self.enter(frame, gbuffer, first);
            let count = if self.bends { first.sight_count() } else { 0 };
            for _ in 0..count {
                frame.set_scene(&opaque.set, &opaque.materials);
                see(frame, sights);
                frame.set_scene(&self.set, &self.scene.materials);
                self.pass(frame, gbuffer);
            }
        }
        frame.set_scene(&opaque.set, &opaque.materials);
        self.cover(frame, gbuffer, output, light)
    }

    fn enter(&self, frame: &mut Frame, gbuffer: &GBuffer, first: First) {
        self.rays
            .bind(frame.pass(&ENTER))
            .bind("clear_materials", &self.materials)
            .bind("ways", &self.ways)
            .bind("sight_rays", &self.sight_rays)
            .bind("view_depth", &gbuffer.view_depth)
            .bind("clear_filter", &self.filter)
            .bind("clear_light", &self.light)
            .push(&EnterParams {
                is_mirrored: u32::from(first == First::Mirrored),
                has_bodies: u32::from(self.bends),
            })
            .dispatch(screen_groups(gbuffer.size));
    }

    fn pass(&self, frame: &mut Frame, gbuffer: &GBuffer) {
        self.rays
            .bind(frame.pass(&PASS))
            .bind("clear_materials", &self.materials)
            .bind("ways", &self.ways)
            .bind("sight_rays", &self.sight_rays)
            .bind("sights", &self.sights)
            .bind("clear_light", &self.light)
            .dispatch(screen_groups(gbuffer.size));
    }

    fn cover(
        &self,
        frame: &mut Frame,
        gbuffer: &GBuffer,
        output: &Output,
        light: &IndirectLight,
    ) -> IndirectLight {
        let [diffuse, specular] = &self.covered;
        frame
            .pass(&COVER)
            .bind("clear_filter", &self.filter)
            .bind("clear_light", &self.light)
            .bind("albedo", &gbuffer.albedo)
            .bind("indirect_diffuse", &light.diffuse)
            .bind(
                "indirect_specular",
                light.specular.as_ref().unwrap_or(&gbuffer.albedo),
            )
            .bind("direct", &output.direct)
            .bind("emission", gbuffer.emission.as_ref().unwrap_or(specular))
            .bind("covered_diffuse", diffuse)
            .bind("covered_specular", specular)
            .constant("SPECULAR", light.specular.is_some())
            .constant("EMISSIVE", gbuffer.emission.is_some())
            .dispatch(screen_groups(gbuffer.size));
        IndirectLight {
            diffuse: Arc::clone(diffuse),
            specular: Some(Arc::clone(specular)),
        }
    }

    /// How many triangles are clear.
    pub fn counts(&self) -> Vec<(&'static str, u64)> {
        vec![("clear_triangles", self.scene.host.triangles.len() as u64)]
    }
}

/// What passes one surface of a material: all of a body has two of them on its way.
pub(super) fn passes(transmission: &Transmission) -> Vec3 {
    let filter = if transmission.index == 1.0 {
        transmission.filter
    } else {
        transmission.filter.powf(0.5)
    };
    transmission.share * filter
}

fn gpu_clear(material: &Material) -> GpuClear {
    GpuClear {
        passes: material.transmission.map_or([0.0; 4], |transmission| {
            passes(&transmission).extend(transmission.index).to_array()
        }),
    }
}
