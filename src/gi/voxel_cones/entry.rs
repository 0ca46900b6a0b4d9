//! What rows of the family have in common: stages and views.

use super::rules::RULES;
use crate::gi::entry::{Directions, Entry, Make, Stage};
use crate::gi::inspect::{Channels, Scale, ViewRow};
use crate::gi::shared::cone::{self, VolumePasses};
use crate::gi::shared::voxel::VoxelBounces;

/// Gathering along directions.
pub(super) static GATHER: Stage = Stage::picture(
    "gather",
    &[
        "cone.gather",
        "voxel.gather_rays",
        "voxel.gather_emitters",
        "cone.occlusion",
    ],
);

/// Glossy reflection.
pub(super) static SPECULAR: Stage = Stage::picture("specular", &["cone.specular"]);

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
        bounces: |settings| VoxelBounces::new(settings).count(),
        frames_to_rest: |settings| VoxelBounces::new(settings).frames_to_rest(),
        check: cone::check,
        emission_in_slots: |settings| {
            if cone::EmitterMethod::new(settings) == cone::EmitterMethod::Gather {
                Vec::new()
            } else {
                vec!["emitters=gather".to_owned()]
            }
        },
        directions_setting: |_| Some("cones"),
        views: &[VIEWS],
        rules: &[RULES],
        ..Entry::new(name, summary, make)
    }
}

/// The diffuse and the specular cones of a store.
pub(super) const fn directions(cones: &'static VolumePasses) -> [Directions; 2] {
    [
        Directions {
            pass: &cones.gather,
            count: Some(cone::diffuse_count),
        },
        Directions {
            pass: &cones.specular,
            count: None,
        },
    ]
}
