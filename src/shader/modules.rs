//! Every embedded module, sorted by stem. Written by `tools/shaders`.

/// Stem and SPIR-V.
#[rustfmt::skip]
pub(super) static MODULES: &[(&str, &[u8])] = &[
    ("gi/gtao/gather.comp", include_bytes!("../../spirv/gi/gtao/gather.comp.spv")),
    ("gi/lpv/bands/finish.comp", include_bytes!("../../spirv/gi/lpv/bands/finish.comp.spv")),
    ("gi/lpv/bands/seed.comp", include_bytes!("../../spirv/gi/lpv/bands/seed.comp.spv")),
    ("gi/lpv/bands/stream.comp", include_bytes!("../../spirv/gi/lpv/bands/stream.comp.spv")),
    ("gi/lpv/camera_geometry.comp", include_bytes!("../../spirv/gi/lpv/camera_geometry.comp.spv")),
    ("gi/lpv/compare.comp", include_bytes!("../../spirv/gi/lpv/compare.comp.spv")),
    ("gi/lpv/faces.frag", include_bytes!("../../spirv/gi/lpv/faces.frag.spv")),
    ("gi/lpv/faces.vert", include_bytes!("../../spirv/gi/lpv/faces.vert.spv")),
    ("gi/lpv/finish.comp", include_bytes!("../../spirv/gi/lpv/finish.comp.spv")),
    ("gi/lpv/gather.comp", include_bytes!("../../spirv/gi/lpv/gather.comp.spv")),
    (
        "gi/lpv/gather_directions.comp",
        include_bytes!("../../spirv/gi/lpv/gather_directions.comp.spv"),
    ),
    ("gi/lpv/geometry.comp", include_bytes!("../../spirv/gi/lpv/geometry.comp.spv")),
    ("gi/lpv/inject.comp", include_bytes!("../../spirv/gi/lpv/inject.comp.spv")),
    ("gi/lpv/jacobi.comp", include_bytes!("../../spirv/gi/lpv/jacobi.comp.spv")),
    ("gi/lpv/jacobi_sum.comp", include_bytes!("../../spirv/gi/lpv/jacobi_sum.comp.spv")),
    ("gi/lpv/ledger.comp", include_bytes!("../../spirv/gi/lpv/ledger.comp.spv")),
    (
        "gi/lpv/levels/down_sample.comp",
        include_bytes!("../../spirv/gi/lpv/levels/down_sample.comp.spv"),
    ),
    ("gi/lpv/levels/faces.comp", include_bytes!("../../spirv/gi/lpv/levels/faces.comp.spv")),
    ("gi/lpv/levels/merge.comp", include_bytes!("../../spirv/gi/lpv/levels/merge.comp.spv")),
    ("gi/lpv/light_sides.comp", include_bytes!("../../spirv/gi/lpv/light_sides.comp.spv")),
    ("gi/lpv/lobe_ledger.comp", include_bytes!("../../spirv/gi/lpv/lobe_ledger.comp.spv")),
    ("gi/lpv/merge.comp", include_bytes!("../../spirv/gi/lpv/merge.comp.spv")),
    ("gi/lpv/merge_camera.comp", include_bytes!("../../spirv/gi/lpv/merge_camera.comp.spv")),
    ("gi/lpv/nearest.frag", include_bytes!("../../spirv/gi/lpv/nearest.frag.spv")),
    ("gi/lpv/number_sides.comp", include_bytes!("../../spirv/gi/lpv/number_sides.comp.spv")),
    ("gi/lpv/octree/sources.comp", include_bytes!("../../spirv/gi/lpv/octree/sources.comp.spv")),
    ("gi/lpv/octree/sum.comp", include_bytes!("../../spirv/gi/lpv/octree/sum.comp.spv")),
    ("gi/lpv/octree/sweep.comp", include_bytes!("../../spirv/gi/lpv/octree/sweep.comp.spv")),
    ("gi/lpv/peel.frag", include_bytes!("../../spirv/gi/lpv/peel.frag.spv")),
    ("gi/lpv/propagate.comp", include_bytes!("../../spirv/gi/lpv/propagate.comp.spv")),
    ("gi/lpv/seed.comp", include_bytes!("../../spirv/gi/lpv/seed.comp.spv")),
    ("gi/lpv/shift_faces.comp", include_bytes!("../../spirv/gi/lpv/shift_faces.comp.spv")),
    ("gi/lpv/shift_sides.comp", include_bytes!("../../spirv/gi/lpv/shift_sides.comp.spv")),
    ("gi/lpv/slices.comp", include_bytes!("../../spirv/gi/lpv/slices.comp.spv")),
    ("gi/lpv/sources.comp", include_bytes!("../../spirv/gi/lpv/sources.comp.spv")),
    ("gi/lpv/specular.comp", include_bytes!("../../spirv/gi/lpv/specular.comp.spv")),
    (
        "gi/lpv/specular_directions.comp",
        include_bytes!("../../spirv/gi/lpv/specular_directions.comp.spv"),
    ),
    ("gi/lpv/structure/grids.comp", include_bytes!("../../spirv/gi/lpv/structure/grids.comp.spv")),
    (
        "gi/lpv/structure/leaves.comp",
        include_bytes!("../../spirv/gi/lpv/structure/leaves.comp.spv"),
    ),
    (
        "gi/lpv/structure/levels.comp",
        include_bytes!("../../spirv/gi/lpv/structure/levels.comp.spv"),
    ),
    ("gi/lpv/sum.comp", include_bytes!("../../spirv/gi/lpv/sum.comp.spv")),
    ("gi/lpv/surfaces.frag", include_bytes!("../../spirv/gi/lpv/surfaces.frag.spv")),
    ("gi/lpv/sweep.comp", include_bytes!("../../spirv/gi/lpv/sweep.comp.spv")),
    ("gi/lpv/view.comp", include_bytes!("../../spirv/gi/lpv/view.comp.spv")),
    ("gi/probes/aim.comp", include_bytes!("../../spirv/gi/probes/aim.comp.spv")),
    ("gi/probes/blend.comp", include_bytes!("../../spirv/gi/probes/blend.comp.spv")),
    ("gi/probes/blend_sh.comp", include_bytes!("../../spirv/gi/probes/blend_sh.comp.spv")),
    ("gi/probes/bounce.comp", include_bytes!("../../spirv/gi/probes/bounce.comp.spv")),
    ("gi/probes/bounce_query.comp", include_bytes!("../../spirv/gi/probes/bounce_query.comp.spv")),
    (
        "gi/probes/cascades/bounce.comp",
        include_bytes!("../../spirv/gi/probes/cascades/bounce.comp.spv"),
    ),
    (
        "gi/probes/cascades/bounce_query.comp",
        include_bytes!("../../spirv/gi/probes/cascades/bounce_query.comp.spv"),
    ),
    (
        "gi/probes/cascades/gather.comp",
        include_bytes!("../../spirv/gi/probes/cascades/gather.comp.spv"),
    ),
    (
        "gi/probes/cascades/light_field.comp",
        include_bytes!("../../spirv/gi/probes/cascades/light_field.comp.spv"),
    ),
    (
        "gi/probes/cascades/light_field_query.comp",
        include_bytes!("../../spirv/gi/probes/cascades/light_field_query.comp.spv"),
    ),
    (
        "gi/probes/cascades/mirror.comp",
        include_bytes!("../../spirv/gi/probes/cascades/mirror.comp.spv"),
    ),
    (
        "gi/probes/cascades/mirror_query.comp",
        include_bytes!("../../spirv/gi/probes/cascades/mirror_query.comp.spv"),
    ),
    (
        "gi/probes/cascades/need.comp",
        include_bytes!("../../spirv/gi/probes/cascades/need.comp.spv"),
    ),
    (
        "gi/probes/cascades/place.comp",
        include_bytes!("../../spirv/gi/probes/cascades/place.comp.spv"),
    ),
    (
        "gi/probes/cascades/place_query.comp",
        include_bytes!("../../spirv/gi/probes/cascades/place_query.comp.spv"),
    ),
    (
        "gi/probes/cascades/view.comp",
        include_bytes!("../../spirv/gi/probes/cascades/view.comp.spv"),
    ),
    ("gi/probes/explore.comp", include_bytes!("../../spirv/gi/probes/explore.comp.spv")),
    (
        "gi/probes/explore_query.comp",
        include_bytes!("../../spirv/gi/probes/explore_query.comp.spv"),
    ),
    ("gi/probes/field_light.comp", include_bytes!("../../spirv/gi/probes/field_light.comp.spv")),
    (
        "gi/probes/field_light_query.comp",
        include_bytes!("../../spirv/gi/probes/field_light_query.comp.spv"),
    ),
    ("gi/probes/field_trace.comp", include_bytes!("../../spirv/gi/probes/field_trace.comp.spv")),
    (
        "gi/probes/field_trace_query.comp",
        include_bytes!("../../spirv/gi/probes/field_trace_query.comp.spv"),
    ),
    ("gi/probes/gather.comp", include_bytes!("../../spirv/gi/probes/gather.comp.spv")),
    (
        "gi/probes/gather_by_rays.comp",
        include_bytes!("../../spirv/gi/probes/gather_by_rays.comp.spv"),
    ),
    (
        "gi/probes/gather_by_rays_query.comp",
        include_bytes!("../../spirv/gi/probes/gather_by_rays_query.comp.spv"),
    ),
    ("gi/probes/light.comp", include_bytes!("../../spirv/gi/probes/light.comp.spv")),
    (
        "gi/probes/light_field/gather.comp",
        include_bytes!("../../spirv/gi/probes/light_field/gather.comp.spv"),
    ),
    (
        "gi/probes/light_field/gather_query.comp",
        include_bytes!("../../spirv/gi/probes/light_field/gather_query.comp.spv"),
    ),
    (
        "gi/probes/light_field/mirror.comp",
        include_bytes!("../../spirv/gi/probes/light_field/mirror.comp.spv"),
    ),
    (
        "gi/probes/light_field/mirror_query.comp",
        include_bytes!("../../spirv/gi/probes/light_field/mirror_query.comp.spv"),
    ),
    (
        "gi/probes/light_field/view.comp",
        include_bytes!("../../spirv/gi/probes/light_field/view.comp.spv"),
    ),
    ("gi/probes/light_query.comp", include_bytes!("../../spirv/gi/probes/light_query.comp.spv")),
    ("gi/probes/light_voxels.comp", include_bytes!("../../spirv/gi/probes/light_voxels.comp.spv")),
    ("gi/probes/mirror.comp", include_bytes!("../../spirv/gi/probes/mirror.comp.spv")),
    ("gi/probes/mirror_query.comp", include_bytes!("../../spirv/gi/probes/mirror_query.comp.spv")),
    ("gi/probes/moments.comp", include_bytes!("../../spirv/gi/probes/moments.comp.spv")),
    ("gi/probes/moments_cast.comp", include_bytes!("../../spirv/gi/probes/moments_cast.comp.spv")),
    (
        "gi/probes/moments_power.comp",
        include_bytes!("../../spirv/gi/probes/moments_power.comp.spv"),
    ),
    (
        "gi/probes/moments_query.comp",
        include_bytes!("../../spirv/gi/probes/moments_query.comp.spv"),
    ),
    (
        "gi/probes/moments_raster.comp",
        include_bytes!("../../spirv/gi/probes/moments_raster.comp.spv"),
    ),
    (
        "gi/probes/moments_voxels.comp",
        include_bytes!("../../spirv/gi/probes/moments_voxels.comp.spv"),
    ),
    ("gi/probes/prefilter.comp", include_bytes!("../../spirv/gi/probes/prefilter.comp.spv")),
    ("gi/probes/raster.frag", include_bytes!("../../spirv/gi/probes/raster.frag.spv")),
    ("gi/probes/raster.vert", include_bytes!("../../spirv/gi/probes/raster.vert.spv")),
    ("gi/probes/reflect.comp", include_bytes!("../../spirv/gi/probes/reflect.comp.spv")),
    (
        "gi/probes/reflect_query.comp",
        include_bytes!("../../spirv/gi/probes/reflect_query.comp.spv"),
    ),
    ("gi/probes/surfaces.comp", include_bytes!("../../spirv/gi/probes/surfaces.comp.spv")),
    (
        "gi/probes/surfaces_query.comp",
        include_bytes!("../../spirv/gi/probes/surfaces_query.comp.spv"),
    ),
    ("gi/probes/take.comp", include_bytes!("../../spirv/gi/probes/take.comp.spv")),
    ("gi/probes/trace.comp", include_bytes!("../../spirv/gi/probes/trace.comp.spv")),
    ("gi/probes/trace_query.comp", include_bytes!("../../spirv/gi/probes/trace_query.comp.spv")),
    ("gi/probes/trace_raster.comp", include_bytes!("../../spirv/gi/probes/trace_raster.comp.spv")),
    ("gi/probes/trace_voxels.comp", include_bytes!("../../spirv/gi/probes/trace_voxels.comp.spv")),
    ("gi/probes/view.comp", include_bytes!("../../spirv/gi/probes/view.comp.spv")),
    ("gi/prt/bumps.comp", include_bytes!("../../spirv/gi/prt/bumps.comp.spv")),
    ("gi/prt/cells.frag", include_bytes!("../../spirv/gi/prt/cells.frag.spv")),
    ("gi/prt/gather.comp", include_bytes!("../../spirv/gi/prt/gather.comp.spv")),
    ("gi/prt/gather_glossy.comp", include_bytes!("../../spirv/gi/prt/gather_glossy.comp.spv")),
    (
        "gi/prt/light_compressed.comp",
        include_bytes!("../../spirv/gi/prt/light_compressed.comp.spv"),
    ),
    ("gi/prt/light_points.comp", include_bytes!("../../spirv/gi/prt/light_points.comp.spv")),
    ("gi/prt/lobes_view.comp", include_bytes!("../../spirv/gi/prt/lobes_view.comp.spv")),
    ("gi/prt/marks_view.frag", include_bytes!("../../spirv/gi/prt/marks_view.frag.spv")),
    ("gi/prt/points.frag", include_bytes!("../../spirv/gi/prt/points.frag.spv")),
    ("gi/prt/points.vert", include_bytes!("../../spirv/gi/prt/points.vert.spv")),
    ("gi/prt/view.comp", include_bytes!("../../spirv/gi/prt/view.comp.spv")),
    ("gi/ray_traced/gather.comp", include_bytes!("../../spirv/gi/ray_traced/gather.comp.spv")),
    (
        "gi/ray_traced/gather_cached.comp",
        include_bytes!("../../spirv/gi/ray_traced/gather_cached.comp.spv"),
    ),
    (
        "gi/ray_traced/gather_cached_query.comp",
        include_bytes!("../../spirv/gi/ray_traced/gather_cached_query.comp.spv"),
    ),
    (
        "gi/ray_traced/gather_query.comp",
        include_bytes!("../../spirv/gi/ray_traced/gather_query.comp.spv"),
    ),
    ("gi/ray_traced/mirror.comp", include_bytes!("../../spirv/gi/ray_traced/mirror.comp.spv")),
    (
        "gi/ray_traced/mirror_cached.comp",
        include_bytes!("../../spirv/gi/ray_traced/mirror_cached.comp.spv"),
    ),
    (
        "gi/ray_traced/mirror_cached_query.comp",
        include_bytes!("../../spirv/gi/ray_traced/mirror_cached_query.comp.spv"),
    ),
    (
        "gi/ray_traced/mirror_query.comp",
        include_bytes!("../../spirv/gi/ray_traced/mirror_query.comp.spv"),
    ),
    ("gi/ray_traced/see.comp", include_bytes!("../../spirv/gi/ray_traced/see.comp.spv")),
    (
        "gi/ray_traced/see_cached.comp",
        include_bytes!("../../spirv/gi/ray_traced/see_cached.comp.spv"),
    ),
    (
        "gi/ray_traced/see_cached_query.comp",
        include_bytes!("../../spirv/gi/ray_traced/see_cached_query.comp.spv"),
    ),
    (
        "gi/ray_traced/see_query.comp",
        include_bytes!("../../spirv/gi/ray_traced/see_query.comp.spv"),
    ),
    (
        "gi/shared/interleave/deinterleave.comp",
        include_bytes!("../../spirv/gi/shared/interleave/deinterleave.comp.spv"),
    ),
    (
        "gi/shared/screen/a_trous.comp",
        include_bytes!("../../spirv/gi/shared/screen/a_trous.comp.spv"),
    ),
    ("gi/shared/screen/blur.comp", include_bytes!("../../spirv/gi/shared/screen/blur.comp.spv")),
    (
        "gi/shared/screen/history.comp",
        include_bytes!("../../spirv/gi/shared/screen/history.comp.spv"),
    ),
    (
        "gi/shared/screen/history_mirrored.comp",
        include_bytes!("../../spirv/gi/shared/screen/history_mirrored.comp.spv"),
    ),
    (
        "gi/shared/screen/history_moments.comp",
        include_bytes!("../../spirv/gi/shared/screen/history_moments.comp.spv"),
    ),
    ("gi/shared/screen/join.comp", include_bytes!("../../spirv/gi/shared/screen/join.comp.spv")),
    (
        "gi/shared/screen/left_over.comp",
        include_bytes!("../../spirv/gi/shared/screen/left_over.comp.spv"),
    ),
    (
        "gi/shared/screen/relight.comp",
        include_bytes!("../../spirv/gi/shared/screen/relight.comp.spv"),
    ),
    (
        "gi/shared/screen/remember.comp",
        include_bytes!("../../spirv/gi/shared/screen/remember.comp.spv"),
    ),
    (
        "gi/shared/screen/upsample.comp",
        include_bytes!("../../spirv/gi/shared/screen/upsample.comp.spv"),
    ),
    (
        "gi/shared/screen/variance.comp",
        include_bytes!("../../spirv/gi/shared/screen/variance.comp.spv"),
    ),
    (
        "gi/shared/voxel/build/columns.comp",
        include_bytes!("../../spirv/gi/shared/voxel/build/columns.comp.spv"),
    ),
    (
        "gi/shared/voxel/build/columns_query.comp",
        include_bytes!("../../spirv/gi/shared/voxel/build/columns_query.comp.spv"),
    ),
    (
        "gi/shared/voxel/build/count_blocks.comp",
        include_bytes!("../../spirv/gi/shared/voxel/build/count_blocks.comp.spv"),
    ),
    (
        "gi/shared/voxel/build/fill.comp",
        include_bytes!("../../spirv/gi/shared/voxel/build/fill.comp.spv"),
    ),
    (
        "gi/shared/voxel/build/fragments.frag",
        include_bytes!("../../spirv/gi/shared/voxel/build/fragments.frag.spv"),
    ),
    (
        "gi/shared/voxel/build/fragments.geom",
        include_bytes!("../../spirv/gi/shared/voxel/build/fragments.geom.spv"),
    ),
    (
        "gi/shared/voxel/build/fragments.vert",
        include_bytes!("../../spirv/gi/shared/voxel/build/fragments.vert.spv"),
    ),
    (
        "gi/shared/voxel/build/fragments_compute.comp",
        include_bytes!("../../spirv/gi/shared/voxel/build/fragments_compute.comp.spv"),
    ),
    (
        "gi/shared/voxel/build/fragments_hw.geom",
        include_bytes!("../../spirv/gi/shared/voxel/build/fragments_hw.geom.spv"),
    ),
    (
        "gi/shared/voxel/build/index_blocks.comp",
        include_bytes!("../../spirv/gi/shared/voxel/build/index_blocks.comp.spv"),
    ),
    (
        "gi/shared/voxel/build/link_fragments.comp",
        include_bytes!("../../spirv/gi/shared/voxel/build/link_fragments.comp.spv"),
    ),
    (
        "gi/shared/voxel/build/resolve_opposed.comp",
        include_bytes!("../../spirv/gi/shared/voxel/build/resolve_opposed.comp.spv"),
    ),
    (
        "gi/shared/voxel/build/resolve_voxels.comp",
        include_bytes!("../../spirv/gi/shared/voxel/build/resolve_voxels.comp.spv"),
    ),
    (
        "gi/shared/voxel/build/running_average.comp",
        include_bytes!("../../spirv/gi/shared/voxel/build/running_average.comp.spv"),
    ),
    (
        "gi/shared/voxel/build/scan_groups.comp",
        include_bytes!("../../spirv/gi/shared/voxel/build/scan_groups.comp.spv"),
    ),
    (
        "gi/shared/voxel/dynamic/continue_lists.comp",
        include_bytes!("../../spirv/gi/shared/voxel/dynamic/continue_lists.comp.spv"),
    ),
    (
        "gi/shared/voxel/dynamic/count_touched.comp",
        include_bytes!("../../spirv/gi/shared/voxel/dynamic/count_touched.comp.spv"),
    ),
    (
        "gi/shared/voxel/dynamic/index_touched.comp",
        include_bytes!("../../spirv/gi/shared/voxel/dynamic/index_touched.comp.spv"),
    ),
    (
        "gi/shared/voxel/dynamic/restore_blocks.comp",
        include_bytes!("../../spirv/gi/shared/voxel/dynamic/restore_blocks.comp.spv"),
    ),
    (
        "gi/shared/voxel/dynamic/scan_touched.comp",
        include_bytes!("../../spirv/gi/shared/voxel/dynamic/scan_touched.comp.spv"),
    ),
    (
        "gi/shared/voxel/light/bound_tiles.comp",
        include_bytes!("../../spirv/gi/shared/voxel/light/bound_tiles.comp.spv"),
    ),
    (
        "gi/shared/voxel/light/inject_rsm.comp",
        include_bytes!("../../spirv/gi/shared/voxel/light/inject_rsm.comp.spv"),
    ),
    (
        "gi/shared/voxel/light/light_by_rays.comp",
        include_bytes!("../../spirv/gi/shared/voxel/light/light_by_rays.comp.spv"),
    ),
    (
        "gi/shared/voxel/light/light_by_rays_dense.comp",
        include_bytes!("../../spirv/gi/shared/voxel/light/light_by_rays_dense.comp.spv"),
    ),
    (
        "gi/shared/voxel/light/light_by_rays_dense_query.comp",
        include_bytes!("../../spirv/gi/shared/voxel/light/light_by_rays_dense_query.comp.spv"),
    ),
    (
        "gi/shared/voxel/light/light_by_rays_query.comp",
        include_bytes!("../../spirv/gi/shared/voxel/light/light_by_rays_query.comp.spv"),
    ),
    (
        "gi/shared/voxel/light/light_voxels.comp",
        include_bytes!("../../spirv/gi/shared/voxel/light/light_voxels.comp.spv"),
    ),
    (
        "gi/shared/voxel/light/light_voxels_dense.comp",
        include_bytes!("../../spirv/gi/shared/voxel/light/light_voxels_dense.comp.spv"),
    ),
    (
        "gi/shared/voxel/light/list_tiles.comp",
        include_bytes!("../../spirv/gi/shared/voxel/light/list_tiles.comp.spv"),
    ),
    (
        "gi/shared/voxel/trace/emitters_by_rays.comp",
        include_bytes!("../../spirv/gi/shared/voxel/trace/emitters_by_rays.comp.spv"),
    ),
    (
        "gi/shared/voxel/trace/emitters_by_rays_query.comp",
        include_bytes!("../../spirv/gi/shared/voxel/trace/emitters_by_rays_query.comp.spv"),
    ),
    (
        "gi/shared/voxel/trace/pack_blocks.comp",
        include_bytes!("../../spirv/gi/shared/voxel/trace/pack_blocks.comp.spv"),
    ),
    (
        "gi/shared/voxel/trace/pack_surfaces.comp",
        include_bytes!("../../spirv/gi/shared/voxel/trace/pack_surfaces.comp.spv"),
    ),
    (
        "gi/shared/voxel/window/empty_blocks.comp",
        include_bytes!("../../spirv/gi/shared/voxel/window/empty_blocks.comp.spv"),
    ),
    (
        "gi/shared/voxel/window/move_records.comp",
        include_bytes!("../../spirv/gi/shared/voxel/window/move_records.comp.spv"),
    ),
    (
        "gi/shared/voxel/window/shift_blocks.comp",
        include_bytes!("../../spirv/gi/shared/voxel/window/shift_blocks.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/bounce.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/bounce.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/bounce_emitters.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/bounce_emitters.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/bounce_rays.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/bounce_rays.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/cast.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/cast.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/clear_box.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/clear_box.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/filter_inner.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/filter_inner.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/filter_top.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/filter_top.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/gather.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/gather.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/gather_emitters.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/gather_emitters.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/gather_rays.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/gather_rays.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/gather_triangles.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/gather_triangles.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/gather_triangles_query.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/gather_triangles_query.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/mark_filled.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/mark_filled.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/obscure.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/obscure.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/patches.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/patches.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/see.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/see.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/shadow.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/shadow.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/specular.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/specular.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/spread_filled.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/spread_filled.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/trace.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/trace.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/view.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/view.comp.spv"),
    ),
    (
        "gi/voxel_cones/clipmap/write_voxels.comp",
        include_bytes!("../../spirv/gi/voxel_cones/clipmap/write_voxels.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/bounce.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/bounce.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/bounce_emitters.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/bounce_emitters.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/bounce_rays.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/bounce_rays.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/cast.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/cast.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/clear_dynamic.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/clear_dynamic.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/filter.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/filter.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/gather.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/gather.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/gather_emitters.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/gather_emitters.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/gather_rays.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/gather_rays.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/gather_triangles.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/gather_triangles.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/gather_triangles_query.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/gather_triangles_query.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/list_groups.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/list_groups.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/mark_matter.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/mark_matter.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/obscure.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/obscure.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/patches.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/patches.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/reduce_matter.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/reduce_matter.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/see.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/see.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/shadow.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/shadow.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/specular.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/specular.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/trace.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/trace.comp.spv"),
    ),
    (
        "gi/voxel_cones/mips/view.comp",
        include_bytes!("../../spirv/gi/voxel_cones/mips/view.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/allocate_dynamic.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/allocate_dynamic.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/allocate_tiles.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/allocate_tiles.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/bounce.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/bounce.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/bounce_emitters.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/bounce_emitters.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/bounce_rays.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/bounce_rays.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/cast.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/cast.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/copy_bricks.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/copy_bricks.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/filter.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/filter.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/flag_dynamic.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/flag_dynamic.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/flag_nodes.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/flag_nodes.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/flag_texels.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/flag_texels.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/flag_touched.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/flag_touched.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/gather.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/gather.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/gather_emitters.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/gather_emitters.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/gather_rays.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/gather_rays.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/gather_triangles.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/gather_triangles.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/gather_triangles_query.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/gather_triangles_query.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/index_cells.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/index_cells.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/index_tiles.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/index_tiles.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/inject_rsm.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/inject_rsm.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/keep_static.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/keep_static.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/link_leaves.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/link_leaves.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/link_neighbours.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/link_neighbours.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/list_touched.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/list_touched.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/mark_affected.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/mark_affected.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/merge_radiance.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/merge_radiance.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/obscure.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/obscure.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/patches.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/patches.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/reduce_points.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/reduce_points.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/scan_nodes.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/scan_nodes.comp.spv"),
    ),
    ("gi/voxel_cones/svo/see.comp", include_bytes!("../../spirv/gi/voxel_cones/svo/see.comp.spv")),
    (
        "gi/voxel_cones/svo/shadow.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/shadow.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/specular.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/specular.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/sum_borders.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/sum_borders.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/trace.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/trace.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/transfer_borders.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/transfer_borders.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/view.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/view.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/write_attributes.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/write_attributes.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/write_leaves.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/write_leaves.comp.spv"),
    ),
    (
        "gi/voxel_cones/svo/write_normals.comp",
        include_bytes!("../../spirv/gi/voxel_cones/svo/write_normals.comp.spv"),
    ),
    ("render/clear/cover.comp", include_bytes!("../../spirv/render/clear/cover.comp.spv")),
    ("render/clear/enter.comp", include_bytes!("../../spirv/render/clear/enter.comp.spv")),
    (
        "render/clear/enter_query.comp",
        include_bytes!("../../spirv/render/clear/enter_query.comp.spv"),
    ),
    ("render/clear/pass.comp", include_bytes!("../../spirv/render/clear/pass.comp.spv")),
    (
        "render/clear/pass_query.comp",
        include_bytes!("../../spirv/render/clear/pass_query.comp.spv"),
    ),
    ("render/clear/shadow.comp", include_bytes!("../../spirv/render/clear/shadow.comp.spv")),
    (
        "render/clear/shadow_query.comp",
        include_bytes!("../../spirv/render/clear/shadow_query.comp.spv"),
    ),
    (
        "render/lights/light_cascade.vert",
        include_bytes!("../../spirv/render/lights/light_cascade.vert.spv"),
    ),
    (
        "render/lights/light_view.vert",
        include_bytes!("../../spirv/render/lights/light_view.vert.spv"),
    ),
    ("render/lights/rsm.frag", include_bytes!("../../spirv/render/lights/rsm.frag.spv")),
    (
        "render/lights/rsm_cascade.frag",
        include_bytes!("../../spirv/render/lights/rsm_cascade.frag.spv"),
    ),
    (
        "render/lights/shadow_cascade.frag",
        include_bytes!("../../spirv/render/lights/shadow_cascade.frag.spv"),
    ),
    (
        "render/lights/shadow_map.frag",
        include_bytes!("../../spirv/render/lights/shadow_map.frag.spv"),
    ),
    (
        "render/screen/composite.comp",
        include_bytes!("../../spirv/render/screen/composite.comp.spv"),
    ),
    ("render/screen/direct.comp", include_bytes!("../../spirv/render/screen/direct.comp.spv")),
    ("render/screen/gbuffer.frag", include_bytes!("../../spirv/render/screen/gbuffer.frag.spv")),
    ("render/screen/gbuffer.vert", include_bytes!("../../spirv/render/screen/gbuffer.vert.spv")),
    (
        "render/screen/gbuffer_emissive.frag",
        include_bytes!("../../spirv/render/screen/gbuffer_emissive.frag.spv"),
    ),
    (
        "render/screen/gbuffer_emissive_material.frag",
        include_bytes!("../../spirv/render/screen/gbuffer_emissive_material.frag.spv"),
    ),
    (
        "render/screen/gbuffer_emissive_motion.frag",
        include_bytes!("../../spirv/render/screen/gbuffer_emissive_motion.frag.spv"),
    ),
    (
        "render/screen/gbuffer_glossy.frag",
        include_bytes!("../../spirv/render/screen/gbuffer_glossy.frag.spv"),
    ),
    (
        "render/screen/gbuffer_glossy_emissive.frag",
        include_bytes!("../../spirv/render/screen/gbuffer_glossy_emissive.frag.spv"),
    ),
    (
        "render/screen/gbuffer_glossy_emissive_material.frag",
        include_bytes!("../../spirv/render/screen/gbuffer_glossy_emissive_material.frag.spv"),
    ),
    (
        "render/screen/gbuffer_glossy_emissive_motion.frag",
        include_bytes!("../../spirv/render/screen/gbuffer_glossy_emissive_motion.frag.spv"),
    ),
    (
        "render/screen/gbuffer_glossy_material.frag",
        include_bytes!("../../spirv/render/screen/gbuffer_glossy_material.frag.spv"),
    ),
    (
        "render/screen/gbuffer_glossy_motion.frag",
        include_bytes!("../../spirv/render/screen/gbuffer_glossy_motion.frag.spv"),
    ),
    (
        "render/screen/gbuffer_material.frag",
        include_bytes!("../../spirv/render/screen/gbuffer_material.frag.spv"),
    ),
    (
        "render/screen/gbuffer_motion.frag",
        include_bytes!("../../spirv/render/screen/gbuffer_motion.frag.spv"),
    ),
    (
        "render/screen/gbuffer_motion.vert",
        include_bytes!("../../spirv/render/screen/gbuffer_motion.vert.spv"),
    ),
    ("render/screen/pick.comp", include_bytes!("../../spirv/render/screen/pick.comp.spv")),
    (
        "render/screen/terms_view.comp",
        include_bytes!("../../spirv/render/screen/terms_view.comp.spv"),
    ),
    ("test/color.frag", include_bytes!("../../spirv/test/color.frag.spv")),
    ("test/copy.comp", include_bytes!("../../spirv/test/copy.comp.spv")),
    ("test/count.frag", include_bytes!("../../spirv/test/count.frag.spv")),
    ("test/double.comp", include_bytes!("../../spirv/test/double.comp.spv")),
    ("test/field_rays.comp", include_bytes!("../../spirv/test/field_rays.comp.spv")),
    ("test/given.comp", include_bytes!("../../spirv/test/given.comp.spv")),
    ("test/material.comp", include_bytes!("../../spirv/test/material.comp.spv")),
    ("test/quad.vert", include_bytes!("../../spirv/test/quad.vert.spv")),
    ("test/rays.comp", include_bytes!("../../spirv/test/rays.comp.spv")),
    ("test/rays_query.comp", include_bytes!("../../spirv/test/rays_query.comp.spv")),
    ("test/sample3d.comp", include_bytes!("../../spirv/test/sample3d.comp.spv")),
    ("test/sh.comp", include_bytes!("../../spirv/test/sh.comp.spv")),
    ("test/store3d.comp", include_bytes!("../../spirv/test/store3d.comp.spv")),
    ("test/through.geom", include_bytes!("../../spirv/test/through.geom.spv")),
    ("view/picture.frag", include_bytes!("../../spirv/view/picture.frag.spv")),
    ("view/picture.vert", include_bytes!("../../spirv/view/picture.vert.spv")),
];
