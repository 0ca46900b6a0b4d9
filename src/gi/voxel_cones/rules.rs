//! What part of a technique each setting of the family is about, and with which others it has an
//! effect. A setting that a technique of the family does not have is in the table all the same.

use crate::gi::Settings;
use crate::gi::settings::{Group, Rule};
use crate::gi::shared::cone::EmitterMethod;
use crate::gi::shared::voxel::{Directionality, LightBounces};

/// All rules; a test changes what does not apply, and finds the same picture.
pub(super) const RULES: &[Rule] = &[
    Rule::always(
        Group::Structure,
        &[
            "resolution",
            "levels",
            "voxel_size",
            "level_updates",
            "voxelize_every",
            "voxelization",
            "surface",
            "accumulation",
            "lattice",
            "normals",
            "attributes",
        ],
    ),
    Rule {
        group: Group::Structure,
        settings: &["opacity"],
        applies: has_cones,
    },
    Rule {
        group: Group::Structure,
        settings: &["faces"],
        applies: is_gathered_by_cones,
    },
    Rule {
        group: Group::Structure,
        settings: &["anisotropic"],
        applies: |settings| {
            let has_faces = is_gathered_by_cones(settings) && !settings.is("faces", "one");
            has_cones(settings) && !has_faces
        },
    },
    Rule {
        group: Group::Structure,
        settings: &["face_weights"],
        applies: |settings| has_cones(settings) && !is_isotropic(settings),
    },
    Rule {
        group: Group::Structure,
        settings: &["mip_filter"],
        applies: |settings| has_cones(settings) && is_isotropic(settings),
    },
    Rule {
        group: Group::Structure,
        settings: &["mip_method"],
        applies: |settings| {
            has_cones(settings) && is_isotropic(settings) && settings.is("mip_filter", "box")
        },
    },
    Rule {
        group: Group::Structure,
        settings: &["filter_split"],
        applies: |settings| settings.is("lattice", "corners"),
    },
    Rule {
        group: Group::Structure,
        settings: &["filter"],
        applies: |settings| settings.is("lattice", "centres"),
    },
    Rule::always(
        Group::Light,
        &[
            "injection",
            "attenuation",
            "voxel_occlusion",
            "shadows",
            "emitters",
        ],
    ),
    Rule {
        group: Group::Light,
        settings: &["rsm_per_voxel"],
        applies: |settings| settings.is("injection", "rsm"),
    },
    Rule {
        group: Group::Light,
        settings: &["occlusion_kappa"],
        applies: |settings| settings.is("voxel_occlusion", "rays-soft"),
    },
    Rule {
        group: Group::Light,
        settings: &[
            "shadow_aperture",
            "shadow_start",
            "shadow_step",
            "shadow_strength",
        ],
        applies: |settings| settings.is("shadows", "cones"),
    },
    Rule {
        group: Group::Light,
        settings: &["emissive_patches"],
        applies: |settings| {
            !settings.is("emitters", "gather")
                && EmitterMethod::new(settings) != EmitterMethod::Points
        },
    },
    Rule::always(Group::Gather, &["gather", "specular"]),
    Rule {
        group: Group::Gather,
        settings: &["cone_set"],
        applies: is_gathered_by_cones,
    },
    Rule {
        group: Group::Gather,
        settings: &["cones"],
        applies: |settings| is_gathered_by_cones(settings) && !settings.is("cone_set", "kahl"),
    },
    Rule {
        group: Group::Gather,
        settings: &["kahl_front", "kahl_intermediate", "kahl_side"],
        applies: |settings| is_gathered_by_cones(settings) && settings.is("cone_set", "kahl"),
    },
    Rule {
        group: Group::Gather,
        settings: &["aperture_scale"],
        applies: |settings| is_gathered_by_cones(settings) || has_occlusion_cones(settings),
    },
    Rule {
        group: Group::Gather,
        settings: &[
            "step_factor",
            "opacity_exponent",
            "height_clamp",
            "start_offset",
            "early_stop",
        ],
        applies: has_cones,
    },
    Rule {
        group: Group::Gather,
        settings: &["max_distance"],
        applies: |settings| is_gathered_by_cones(settings) || settings.is("specular", "on"),
    },
    Rule {
        group: Group::Gather,
        settings: &[
            "specular_aperture",
            "specular_start",
            "specular_step",
            "specular_falloff",
        ],
        applies: |settings| settings.is("specular", "on"),
    },
    Rule {
        group: Group::Gather,
        settings: &["specular_grace"],
        applies: |settings| {
            settings.is("specular", "on") && settings.number("specular_falloff") > 0.0
        },
    },
    Rule {
        group: Group::Gather,
        settings: &["first_hit"],
        applies: is_gathered_by_cones,
    },
    Rule {
        group: Group::Gather,
        settings: &["obscured_diffuse"],
        applies: |settings| settings.is("shadows", "cones"),
    },
    Rule {
        group: Group::Gather,
        settings: &["rays", "radiance"],
        applies: |settings| !is_gathered_by_cones(settings),
    },
    Rule {
        group: Group::Gather,
        settings: &["ray_start", "self_height", "contour_slack"],
        applies: |settings| {
            let meets_voxels = LightBounces::new(settings).any()
                || EmitterMethod::new(settings) == EmitterMethod::Points;
            settings.is("gather", "rays") || settings.is("gather", "triangles") && meets_voxels
        },
    },
    Rule::always(Group::Bounces, &["bounces"]),
    Rule {
        group: Group::Bounces,
        settings: &["bounce_directions"],
        applies: |settings| LightBounces::new(settings).any(),
    },
    Rule::always(Group::Screen, &["occlusion_cones"]),
    Rule {
        group: Group::Screen,
        settings: &["ao_falloff"],
        applies: |settings| !has_occlusion_cones(settings),
    },
    Rule {
        group: Group::Screen,
        settings: &[
            "occlusion_distance",
            "occlusion_falloff",
            "occlusion_aperture",
            "occlusion_start",
            "occlusion_step",
            "occlusion_strength",
        ],
        applies: has_occlusion_cones,
    },
    Rule {
        group: Group::Screen,
        settings: &["occlusion_weight"],
        applies: |settings| {
            has_occlusion_cones(settings) && settings.number("occlusion_falloff") > 0.0
        },
    },
];

/// Whether cones, not rays, gather the diffuse light.
fn is_gathered_by_cones(settings: &Settings) -> bool {
    settings.is("gather", "cones")
}

fn has_occlusion_cones(settings: &Settings) -> bool {
    settings.count("occlusion_cones") > 0
}

/// Whether there may be cones at all, and so a volume that they march through: glossy surfaces and
/// surfaces that emit are up to the scene.
fn has_cones(settings: &Settings) -> bool {
    is_gathered_by_cones(settings)
        || has_occlusion_cones(settings)
        || settings.is("specular", "on")
        || settings.is("shadows", "cones")
        || EmitterMethod::new(settings) == EmitterMethod::Patches
}

fn is_isotropic(settings: &Settings) -> bool {
    Directionality::new(settings) == Directionality::Isotropic
}
