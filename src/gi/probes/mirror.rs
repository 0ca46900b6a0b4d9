//! What glossy surfaces mirror: rays meet triangles, and the lights and probes light what they hit.

use std::sync::Arc;

use super::lookup::{LOOKUP_BINDINGS, LOOKUP_CONSTANTS, Lookup};
use super::passes::LookupRow;
use super::volume::{Maps, Volume};
use crate::gi::Inputs;
use crate::gi::settings::{Group, Rule, Setting};
use crate::gi::shared::paths::{
    BINDINGS, CONSTANTS, MIRROR_BINDINGS, MIRROR_RAYS, Mirrors, PathScene, parts_of_rays,
    paths_a_thread,
};
use crate::gpu_struct;
use crate::graph::pass::join;
use crate::graph::{Binding, Frame, Image, Pass, Sets, Shaders};
use crate::render::{GpuScene, screen_groups};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `probes.mirror`.
    pub struct MirrorParams {
        /// How places look probes up.
        pub lookup: LookupRow,
        /// Rays of all dispatches.
        pub ray_count: u32,
        /// First ray of this dispatch, which adds to what those before it left.
        pub first_ray: u32,
        /// One beyond its last ray.
        pub end_ray: u32,
        /// Of a tile of pixels, as [`crate::gi::shared::interleave::Pattern`] packs it.
        pub pattern: u32,
        /// 1: what rays hit reflects the light of probes too.
        pub has_light: u32,
    }
}

/// Rays of what mirrors.
pub(super) const FEW_MIRROR_RAYS: Setting = Setting {
    default: "4",
    ..MIRROR_RAYS
};

/// In which group these settings are, and when they have an effect.
pub(super) const SPECULAR_RULES: &[Rule] = &[
    Rule::always(Group::Gather, &["specular"]),
    Rule {
        group: Group::Gather,
        settings: &["mirror_rays"],
        applies: |settings| !settings.is("specular", "off") && !settings.is("specular", "cones"),
    },
];

/// Light that glossy surfaces mirror, by rays. Reads the G-buffer and maps, adds to an RGBA32F
/// image; a thread a pixel.
pub static MIRROR: Pass = Pass {
    name: "probes.mirror",
    shaders: Shaders::Compute("gi/probes/mirror.comp"),
    bindings: &join::<_, 13, 5, 18>(MIRRORED, LOOKUP_BINDINGS),
    constants: &join::<_, 12, 1, 13>(
        join::<_, 6, 6, 12>(CONSTANTS, LOOKUP_CONSTANTS),
        ["MIRRORS_LEFT"],
    ),
    params: Some(MirrorParams::LAYOUT),
    sets: Sets::Scene,
};

/// What such a pass binds first.
pub(super) const MIRRORED: [Binding; 13] = join(BINDINGS, MIRROR_BINDINGS);

/// First ray, and one beyond the last, of as many dispatches as keep the loops of a thread within
/// what a device does.
pub(super) fn parts_of(
    mirrors: &Mirrors,
    scene: &GpuScene,
    uses_maps: bool,
) -> impl Iterator<Item = [u32; 2]> + use<> {
    parts_of_rays(mirrors.rays, paths_a_thread(scene, 1, uses_maps))
}

/// Adds [`MIRROR`]. `reflected`: the light that what rays hit reflects, besides that of the lights
/// themselves. `left`: only where that is 1 in alpha of the light. Nothing where the G-buffer has
/// no lobes.
pub(super) fn mirror(
    frame: &mut Frame,
    given: &Inputs<'_>,
    mirrors: &Mirrors,
    scene: &PathScene,
    (volume, lookup): (&Volume, &Lookup),
    (reflected, uses_maps, left): (Option<&Maps>, bool, bool),
) -> Option<Arc<Image>> {
    let specular = given.gbuffer.specular.as_ref()?;
    // Without light to reflect any maps are bound, and not read.
    let maps = reflected.unwrap_or(volume.lit(1));
    for [first_ray, end_ray] in parts_of(mirrors, given.scene, uses_maps) {
        let pass = scene.bind(frame.pass(&MIRROR), given, uses_maps);
        lookup
            .bind(mirrors.bind(pass, given.gbuffer, specular), volume, maps)
            .constant("MIRRORS_LEFT", left)
            .push(&MirrorParams {
                lookup: lookup.row(volume),
                ray_count: mirrors.rays,
                first_ray,
                end_ray,
                pattern: mirrors.pattern.bits(),
                has_light: u32::from(reflected.is_some()),
            })
            .dispatch(screen_groups(given.gbuffer.size));
    }
    Some(Arc::clone(&mirrors.light))
}
