//! What rows of the family have in common: stages and views.

use super::rules::RULES;
use super::schedule::frames_behind;
use crate::gi::entry::{Directions, Entry, Lends, Make, Stage, Substitution};
use crate::gi::inspect::{Channels, Scale, ViewRow};
use crate::gi::settings::{SettingError, Settings};
use crate::gi::shared::cone::{self, VolumePasses};
use crate::gi::shared::interleave;
use crate::gi::shared::voxel::{self, Directionality, LightBounces, SpacePasses, trace};
use crate::gi::{StoreKind, Wanted};
use crate::graph::Pass;
use crate::render::bvh::HOST_WORK;

/// The pass of rays to points of what emits that needs no store.
pub(super) const RAYS_TO_EMITTERS: &[&Pass] = &[&trace::GATHER_EMITTERS_BY_TRIANGLES];

/// The scene's triangles, where rays meet them.
pub(super) static HIERARCHY: Stage = Stage::store("hierarchy", &HOST_WORK);

/// Gathering along directions.
pub(super) static GATHER: Stage = Stage::picture(
    "gather",
    &[
        "cone.gather",
        "voxel.gather_rays",
        "voxel.gather_triangles",
        "voxel.gather_emitters",
        "voxel.gather_emitters_triangles",
        "cone.occlusion",
        "cone.obscure",
    ],
);

/// Glossy reflection.
pub(super) static SPECULAR: Stage = Stage::picture("specular", &["cone.specular"]);

/// What pixels show behind clear bodies.
pub(super) static THROUGH_BODIES: Stage = Stage::picture("through clear bodies", &["cone.see"]);

/// A view of a volume.
pub(super) const fn view(
    name: &'static str,
    aliases: &'static [&'static str],
    help: &'static str,
    unit: &'static str,
    scale: Scale,
) -> ViewRow {
    ViewRow {
        name,
        aliases,
        help,
        unit,
        scale,
        channels: Channels::Rgb,
    }
}

/// What each store can show of its light.
pub(super) const VIEWS: &[ViewRow] = &[
    view(
        "voxels",
        &["light"],
        "what each voxel sends out, on any level",
        "W/(m² sr)",
        Scale::Light,
    ),
    ViewRow {
        channels: Channels::Alpha,
        ..view(
            "voxel-opacity",
            &["opacity"],
            "how opaque each voxel is, on any level",
            "",
            Scale::Share,
        )
    },
    view(
        "structure",
        &[],
        "how the structure divides space, a colour for each level: voxels or texels, an octree's \
         nodes, tiles and empty nodes, a clipmap's levels",
        "",
        Scale::Share,
    ),
];

/// What all rows of the family have in common.
pub(super) const fn entry(name: &'static str, summary: &'static str, make: Make) -> Entry {
    Entry {
        bounces: |settings| LightBounces::new(settings).count(),
        frames_to_rest: |settings| {
            LightBounces::new(settings).frames_to_rest() + frames_behind(settings)
        },
        check,
        emission_in_slots: |settings| {
            if cone::EmitterMethod::new(settings) == cone::EmitterMethod::Gather {
                Vec::new()
            } else {
                vec!["emitters=gather".to_owned()]
            }
        },
        directions_setting: |settings| {
            Some(if settings.is("gather", "cones") {
                "cones"
            } else {
                "rays"
            })
        },
        views: &[VIEWS],
        rules: &[RULES, interleave::RULES, interleave::SPECULAR_RULES],
        ..Entry::new(name, summary, make)
    }
}

/// Whether the settings are possible together.
fn check(settings: &Settings) -> Result<(), SettingError> {
    let has_faces = Directionality::new(settings) != Directionality::Isotropic;
    let has_two = settings.is("gather", "cones") || settings.is("radiance", "two-sided");
    let normals = settings.choice("normals");
    if normals != "off" && has_faces {
        return Err(SettingError::Together(format!(
            "normals = {normals} needs anisotropic = off and faces = one: faces know which way \
             their light leaves them"
        )));
    }
    if normals != "off" && !has_two {
        return Err(SettingError::Together(format!(
            "normals = {normals} with gather = {} needs radiance = two-sided: mean normals are \
             those of the two sides of voxels",
            settings.choice("gather")
        )));
    }
    cone::check(settings)
}

/// A store as others use it: the light of what emits is in its voxels.
pub(super) const fn lends(kind: StoreKind) -> Option<Lends> {
    Some(Lends { kind, pairs: lent })
}

fn lent(wanted: &Wanted) -> Vec<String> {
    let gather = if wanted.casts { "rays" } else { "cones" };
    let specular = if wanted.mirrors { "on" } else { "off" };
    vec![
        format!("resolution={}", wanted.resolution),
        format!("bounces={}", wanted.bounces),
        format!("gather={gather}"),
        format!("specular={specular}"),
        "radiance=six-sided".into(),
        "emitters=gather".into(),
    ]
}

/// What an error budget tries in place of the gather's settings.
pub(super) const SUBSTITUTIONS: &[Substitution] = &[
    Substitution {
        name: "directions",
        help: "as many directions as the gather's settings allow, so that no light falls between \
               them",
        pairs: |settings| {
            if settings.is("gather", "cones") {
                cone::more_cones(settings)
            } else {
                voxel::more_rays(settings)
            }
        },
    },
    Substitution {
        name: "reflective maps",
        help: "reflective shadow maps as fine as shadow maps, instead of a few texels a voxel",
        pairs: |settings| {
            if settings.is("injection", "rsm") && settings.count("rsm_per_voxel") > 0 {
                vec!["rsm_per_voxel=0".into()]
            } else {
                Vec::new()
            }
        },
    },
    Substitution {
        name: "filtering",
        help: "exact rays through the finest voxels, instead of samples of filtered ones",
        pairs: |settings| {
            if settings.is("gather", "cones") {
                vec!["gather=rays".into()]
            } else {
                Vec::new()
            }
        },
    },
];

/// The diffuse and the specular cones of a store, and its rays.
pub(super) const fn directions(
    cones: &'static VolumePasses,
    rays: &'static SpacePasses,
) -> [Directions; 4] {
    [
        Directions {
            pass: &cones.gather,
            count: Some(cone::diffuse_count),
        },
        Directions {
            pass: &rays.gather_rays,
            count: Some(|settings| settings.count("rays")),
        },
        Directions {
            pass: &rays.gather_triangles,
            count: Some(|settings| settings.count("rays")),
        },
        Directions {
            pass: &cones.specular,
            count: None,
        },
    ]
}
