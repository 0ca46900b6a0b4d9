//! Tests on a Vulkan device, which they share (`support::gpu`).
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "../support/mod.rs"]
mod support;

mod accesses;
mod beam;
mod bounces;
mod cascades;
mod clear;
mod clipmap;
mod clipmap_matter;
mod clipmap_walk;
mod dynamic;
mod dynamic_pictures;
mod dynamic_volume;
mod embed;
mod emitters;
#[cfg(feature = "measure")]
mod explain;
mod faces;
mod faults;
mod frame;
#[cfg(feature = "flip")]
mod golden;
mod gtao;
mod host_work;
mod lpv;
mod lpv_blockers;
mod lpv_bounces;
mod lpv_cascaded;
mod lpv_ledger;
mod lpv_levels;
mod lpv_lobes;
mod lpv_lookup;
mod lpv_octree;
mod lpv_place;
mod lpv_structure;
mod lpv_view;
mod normals;
mod oracle_attributes;
mod oracle_direct;
mod oracle_gather;
mod oracle_interleave;
mod oracle_light;
mod oracle_motion;
mod oracle_rays;
mod oracle_render;
mod oracle_spherical_harmonics;
mod oracle_structures;
mod oracle_svo;
mod oracle_svo_dynamic;
mod oracle_voxels;
mod patches;
mod planner;
mod probe_cascades;
mod probes;
mod probes_field;
mod probes_lookup;
mod probes_mirror;
mod probes_place;
mod probes_raster;
mod probes_reflect;
mod probes_rooms;
mod probes_store;
mod probes_time;
mod probes_view;
mod probes_voxels;
mod properties;
mod prt;
mod prt_mirror;
mod ray_blocks;
mod ray_spaces;
mod rays;
mod rules;
mod screen;
mod screen_format;
mod screen_gather;
mod screen_mirrored;
mod sky;
mod soft_shadows;
mod still;
#[cfg(feature = "measure")]
mod stress;
mod submissions;
mod suit;
mod techniques_analytic;
#[cfg(feature = "measure")]
mod techniques_property;
mod validation;
#[cfg(feature = "measure")]
mod voxel_light;
mod voxel_view;
mod vulkan;
