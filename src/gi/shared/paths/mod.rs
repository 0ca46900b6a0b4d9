//! Paths of light through the triangles of a scene (`glsl/gi/shared/paths/`): what reaches a place
//! on a path from the lights and from what emits, and what it scatters.

mod cache;
mod mirror;

pub use cache::{CACHE_BINDINGS, Cache};
pub use mirror::{MIRROR_BINDINGS, Mirrors};

use crate::gi::settings::{Domain, Setting};
use crate::gi::{Inputs, MapNeeds, Needs};
use crate::graph::pass::join;
use crate::graph::{Access, Binding, Error, FrameStats, Gpu, PassBuilder};
use crate::render::GpuScene;
use crate::render::bvh::{self, EmissiveTriangles, GpuEmitter, HOST_WORK, SceneRays, TURNS_A_RAY};
use crate::shader::{GpuStruct, StructLayout};

/// What a pass binds first whose threads follow paths (`gi/shared/paths/bindings.glsl`).
pub const BINDINGS: [Binding; 9] = join(
    bvh::BINDINGS,
    [
        Binding::buffer("emitters", Access::ComputeRead),
        Binding::buffer("emitter_densities", Access::ComputeRead),
        Binding::buffer("light_views", Access::ComputeRead),
        Binding::sampled("shadow_maps", Access::ComputeSampled),
    ],
);

/// The first constants of such a pass, which [`PathScene::bind`] gives.
pub const CONSTANTS: [&str; 6] = join(bvh::CONSTANTS, ["EMITTERS", "SHADOW_MAPS", "BUMPS"]);

/// Who says which light reaches a place.
pub const HIT_LIGHT: Setting = Setting {
    name: "hit_light",
    help: "what says which light reaches what a ray hits: rays, or the lights' shadow maps",
    unit: "",
    domain: Domain::Choice(&["rays", "maps"]),
    default: "rays",
};

/// Rays of what gathers diffuse light.
pub const RAYS: Setting = Setting {
    name: "rays",
    help: "cosine-distributed rays that a pixel gathers diffuse light along",
    unit: "rays",
    domain: Domain::Count { min: 1, max: 1024 },
    default: "16",
};

/// Whether surfaces mirror.
pub const SPECULAR: Setting = Setting {
    name: "specular",
    help: "glossy reflections",
    unit: "",
    domain: Domain::Choice(&["on", "off"]),
    default: "on",
};

/// Rays of what mirrors.
pub const MIRROR_RAYS: Setting = Setting {
    name: "mirror_rays",
    help: "rays that a pixel of a glossy surface mirrors, about the facets that the eye sees",
    unit: "rays",
    domain: Domain::Count { min: 1, max: 1024 },
    default: "16",
};

/// The structs that its shaders read, but for those of the scene.
pub const STRUCTS: &[StructLayout] = &[("GpuEmitter", GpuEmitter::FIELDS)];

/// The work of the host on the triangles, as passes.
pub const HOST_PASSES: &[&str] = &HOST_WORK;

/// The triangles of a scene, and those of them that emit.
pub struct PathScene {
    /// The triangles.
    pub rays: SceneRays,
    /// Those that emit.
    pub emitters: EmissiveTriangles,
}

impl PathScene {
    /// Of a scene as it is on the device, and what making it cost.
    pub fn build(gpu: &Gpu, scene: &GpuScene) -> Result<(Self, FrameStats), Error> {
        let (rays, stats) = SceneRays::build(gpu, scene)?;
        let emitters = EmissiveTriangles::new(gpu, scene)?;
        Ok((PathScene { rays, emitters }, stats))
    }

    /// Brings it up to models that have moved.
    pub fn follow(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<FrameStats, Error> {
        let stats = self.rays.follow(gpu, scene)?;
        self.emitters.follow(gpu, scene)?;
        Ok(stats)
    }

    /// Binds [`BINDINGS`] and gives [`CONSTANTS`]. `uses_maps`: shadow maps, and not rays, say
    /// which light reaches a place.
    pub fn bind<'f>(
        &self,
        pass: PassBuilder<'f>,
        given: &Inputs<'_>,
        uses_maps: bool,
    ) -> PassBuilder<'f> {
        self.rays
            .bind(pass)
            .bind("emitters", &self.emitters.rows)
            .bind("emitter_densities", &self.emitters.densities)
            .bind("light_views", &given.maps.views)
            .bind("shadow_maps", &given.maps.depth)
            .constant("EMITTERS", self.emitters.count)
            .constant("SHADOW_MAPS", uses_maps)
            .constant("BUMPS", given.scene.has_bumps())
    }

    /// Counts, by name.
    pub fn counts(&self) -> Vec<(&'static str, u64)> {
        let mut counts = self.rays.counts();
        counts.push(("emissive_triangles", self.emitters.count.into()));
        counts
    }
}

/// What a technique reads that lights what rays hit by shadow maps (`uses_maps`), or by rays.
pub fn needs(uses_maps: bool) -> Needs {
    Needs::maps(if uses_maps {
        MapNeeds::Shadows
    } else {
        MapNeeds::Direct
    })
}

/// First ray, and one beyond the last, of as many dispatches as it takes if a thread follows
/// `most`.
pub fn parts_of_rays(count: u32, most: u32) -> impl Iterator<Item = [u32; 2]> {
    (0..count)
        .step_by(most as usize)
        .map(move |first| [first, (first + most).min(count)])
}

/// Paths of this many bounces that a thread may follow within the budget of its loops, at least
/// one.
pub fn paths_a_thread(scene: &GpuScene, bounces: u32, uses_maps: bool) -> u32 {
    let lights = if uses_maps {
        0
    } else {
        scene.lights.len() as u32
    };
    let rays = bounces * (1 + lights + u32::from(scene.is_emissive));
    (scene.set.loops().budget / (TURNS_A_RAY * rays)).max(1)
}
