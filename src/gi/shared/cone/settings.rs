//! What can be set of cones, and what of it two techniques' presets share.

use super::sets::diffuse_set;
use crate::gi::Settings;
use crate::gi::settings::{Domain, PresetValues, Setting};

/// Cones as the papers have them: six of 60°, unclamped, the same in every pixel.
pub const TEXTBOOK: PresetValues = &[
    ("cone_set", "papers"),
    ("cones", "6"),
    ("aperture_scale", "1"),
    ("step_factor", "0.5"),
    ("opacity_exponent", "1"),
    ("height_clamp", "0"),
    ("start_offset", "1.5"),
    ("interleave", "1"),
    ("emitters", "gather"),
];

/// Settings of cones.
pub static SETTINGS: &[Setting] = &[
    Setting {
        name: "cones",
        help: "diffuse cones a pixel",
        unit: "",
        domain: Domain::OneOf(&[1, 4, 5, 6, 9, 16, 25, 32]),
        default: "16",
    },
    Setting {
        name: "cone_set",
        help: "directions: papers (1, 4, 5, 6 and 9 as published; 16 and more on a disc), disc \
               (equal shares of the cosine-weighted disc) or kahl (the rings of kahl_*, whatever \
               cones says)",
        unit: "",
        domain: Domain::Choice(&["papers", "disc", "kahl"]),
        default: "disc",
    },
    Setting {
        name: "kahl_front",
        help: "the cone along the normal of cone_set = kahl",
        unit: "",
        domain: Domain::Choice(&["on", "off"]),
        default: "on",
    },
    Setting {
        name: "kahl_intermediate",
        help: "its four cones at 45°",
        unit: "",
        domain: Domain::Choice(&["on", "off"]),
        default: "on",
    },
    Setting {
        name: "kahl_side",
        help: "its four cones along the surface",
        unit: "",
        domain: Domain::Choice(&["on", "off"]),
        default: "off",
    },
    Setting {
        name: "aperture_scale",
        help: "factor on tan(γ/2) of every diffuse cone; 1: the set covers the hemisphere once",
        unit: "",
        domain: Domain::Number {
            min: 0.05,
            max: 2.0,
        },
        default: "0.15",
    },
    Setting {
        name: "step_factor",
        help: "β: step in sample diameters",
        unit: "diameters",
        domain: Domain::Number { min: 0.1, max: 2.0 },
        default: "1",
    },
    Setting {
        name: "opacity_exponent",
        help: "g in α' = 1 − (1 − α)^(g β); above 1 it makes up for what trilinear sampling lets \
               through",
        unit: "",
        domain: Domain::Number { min: 0.1, max: 8.0 },
        default: "2.5",
    },
    Setting {
        name: "height_clamp",
        help: "k: a sample is no wider than its height over the receiver's tangent plane / k; 0: \
               off",
        unit: "",
        domain: Domain::Number {
            min: 0.0,
            max: 16.0,
        },
        default: "5",
    },
    Setting {
        name: "start_offset",
        help: "start of a cone over the surface, along its normal",
        unit: "voxels",
        domain: Domain::Number {
            min: 0.0,
            max: 16.0,
        },
        default: "1.5",
    },
    Setting {
        name: "early_stop",
        help: "a cone ends where less than this share of what is behind is seen",
        unit: "",
        domain: Domain::Number { min: 0.0, max: 0.5 },
        default: "0.005",
    },
    Setting {
        name: "first_hit",
        help: "a look, not physical: a diffuse cone ends at the first sample of more opacity than \
               this, as if it filled the cone (Kahl 2019: 0.01); 1: off",
        unit: "",
        domain: Domain::Number { min: 0.0, max: 1.0 },
        default: "1",
    },
    Setting {
        name: "max_distance",
        help: "longest reach of a cone; 0: to the end of the grid",
        unit: "m",
        domain: Domain::Number { min: 0.0, max: 1e6 },
        default: "0",
    },
    Setting {
        name: "ao_falloff",
        help: "λ in the ambient visibility's weight 1 / (1 + λ r)",
        unit: "1/m",
        domain: Domain::Number { min: 0.0, max: 1e4 },
        default: "0",
    },
    Setting {
        name: "occlusion_cones",
        help: "cones of the ambient visibility alone, on a disc; 0: those of the gather give it, \
               with ao_falloff and max_distance",
        unit: "",
        domain: Domain::Count { min: 0, max: 64 },
        default: "0",
    },
    Setting {
        name: "occlusion_distance",
        help: "longest reach of occlusion_cones; 0: to the end of the grid",
        unit: "m",
        domain: Domain::Number { min: 0.0, max: 1e6 },
        default: "0",
    },
    Setting {
        name: "occlusion_falloff",
        help: "λ of occlusion_cones in the weight 1 / (1 + λ r)",
        unit: "1/m",
        domain: Domain::Number { min: 0.0, max: 1e4 },
        default: "0",
    },
    Setting {
        name: "occlusion_weight",
        help: "r of occlusion_falloff: the distance of a sample, or the radius of the cone there",
        unit: "",
        domain: Domain::Choice(&["distance", "radius"]),
        default: "distance",
    },
    Setting {
        name: "occlusion_strength",
        help: "as shadow_strength, of occlusion_cones",
        unit: "",
        domain: Domain::Number {
            min: 0.0,
            max: 100.0,
        },
        default: "0",
    },
    Setting {
        name: "occlusion_start",
        help: "start_offset of occlusion_cones; −1: as of the others",
        unit: "voxels",
        domain: Domain::Number {
            min: -1.0,
            max: 16.0,
        },
        default: "-1",
    },
    Setting {
        name: "occlusion_step",
        help: "step_factor of occlusion_cones; 0: as of the others",
        unit: "diameters",
        domain: Domain::Number { min: 0.0, max: 2.0 },
        default: "0",
    },
    Setting {
        name: "occlusion_aperture",
        help: "full angle of occlusion_cones; 0: that of their share of the hemisphere, by \
               aperture_scale",
        unit: "degrees",
        domain: Domain::Number {
            min: 0.0,
            max: 120.0,
        },
        default: "0",
    },
    Setting {
        name: "shadows",
        help: "of the lights on what is seen: maps, or cones from the surface to each light \
               through the voxels (soft; without maps where nothing else reads them)",
        unit: "",
        domain: Domain::Choice(&["maps", "cones"]),
        default: "maps",
    },
    Setting {
        name: "shadow_aperture",
        help: "full angle of shadows = cones: a light is as soft as a sphere that is seen so large",
        unit: "degrees",
        domain: Domain::Number {
            min: 1.0,
            max: 25.0,
        },
        default: "5",
    },
    Setting {
        name: "shadow_start",
        help: "start_offset of the cones of shadows = cones; −1: as of the others",
        unit: "voxels",
        domain: Domain::Number {
            min: -1.0,
            max: 16.0,
        },
        default: "-1",
    },
    Setting {
        name: "shadow_step",
        help: "step_factor of the cones of shadows = cones; 0: as of the others",
        unit: "diameters",
        domain: Domain::Number { min: 0.0, max: 2.0 },
        default: "0",
    },
    Setting {
        name: "shadow_strength",
        help: "a look, not physical: s, by which opacity at a distance t of the longest, D, counts \
               smoothstep(0, 1, s √(t/D)) in cones to lights (Kahl 2019); 0: off",
        unit: "",
        domain: Domain::Number {
            min: 0.0,
            max: 100.0,
        },
        default: "0",
    },
    Setting {
        name: "obscured_diffuse",
        help: "a look, not physical: gathered light is multiplied by the least that the cones to \
               lights see of one (Kahl 2019, equation 5.9)",
        unit: "",
        domain: Domain::Choice(&["on", "off"]),
        default: "off",
    },
    Setting {
        name: "emitters",
        help: "how surfaces that emit light what is seen: gather (it meets them in the voxels), \
               patches (each seen by a cone), points (rays to points of them, with gather = \
               rays or triangles; to voxels too) or auto (gather where they are as large as half \
               of the scene's bounds, otherwise points, or patches with gather = cones)",
        unit: "",
        domain: Domain::Choice(&["auto", "gather", "patches", "points"]),
        default: "auto",
    },
    Setting {
        name: "emissive_patches",
        help: "with emitters = patches: at most so many; 0: the gather sees what emits",
        unit: "",
        domain: Domain::Count { min: 0, max: 1024 },
        default: "32",
    },
    Setting {
        name: "specular",
        help: "glossy reflections by one cone, in a scene with glossy surfaces",
        unit: "",
        domain: Domain::Choice(&["on", "off"]),
        default: "on",
    },
    Setting {
        name: "specular_aperture",
        help: "full angle of the specular cone; 0: as wide as the glossy lobe, by roughness",
        unit: "degrees",
        domain: Domain::Number {
            min: 0.0,
            max: 90.0,
        },
        default: "0",
    },
    Setting {
        name: "specular_start",
        help: "start_offset of the specular cone; −1: as of the others",
        unit: "voxels",
        domain: Domain::Number {
            min: -1.0,
            max: 16.0,
        },
        default: "-1",
    },
    Setting {
        name: "specular_step",
        help: "step_factor of the specular cone; 0: as of the others",
        unit: "diameters",
        domain: Domain::Number { min: 0.0, max: 2.0 },
        default: "0",
    },
    Setting {
        name: "specular_falloff",
        help: "a look, not physical: q, by which the specular cone's light is multiplied by Σ (1 − \
               max(0, γ − p)/π)^q over the lights, γ the angle to each (Kahl 2019, equation 5.6); \
               0: off",
        unit: "",
        domain: Domain::Number {
            min: 0.0,
            max: 100.0,
        },
        default: "0",
    },
    Setting {
        name: "specular_grace",
        help: "p of specular_falloff",
        unit: "degrees",
        domain: Domain::Number {
            min: 0.0,
            max: 180.0,
        },
        default: "0",
    },
];

/// 32 cones of equal shares, turned from pixel to pixel: 2,048 directions in each interleaving
/// window.
pub fn more_cones(_: &Settings) -> Vec<String> {
    ["cones=32", "cone_set=disc", "interleave=8"]
        .map(String::from)
        .to_vec()
}

/// Number of a pixel's diffuse cones.
pub fn diffuse_count(settings: &Settings) -> u32 {
    diffuse_set(settings).cones.len() as u32
}
