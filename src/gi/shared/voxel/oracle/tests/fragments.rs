//! What voxels hold.

use super::*;

#[test]
fn quad_fills_one_layer() {
    let voxels = voxelize(&scene_of(&floor(4.0, 1.5, 0.25)), &UNIT_GRID);
    assert_eq!(voxels.len(), 16);
    for ([x, y, z], sum) in &voxels {
        assert_eq!(*z, 1);
        // Voxels beside the diagonal touch the other triangle in a point.
        assert!(
            (sum.area - 1.0).abs() <= 2.0 * LEAST_WEIGHT,
            "{x} {y}: {}",
            sum.area
        );
        assert!(near(sum.normal, DVec3::Z) && near(sum.albedo, DVec3::splat(0.25)));
        assert!((sum.mean_position - 0.5).abs().max_element() < 2.0 * LEAST_WEIGHT);
        assert!((sum.coverage - 1.0).abs() < 1e-9);
    }
}

#[test]
fn triangle_inside_a_voxel_is_exact() {
    let parts = fragments(
        &scene_of(&[(
            [[1.25, 1.25, 1.25], [1.75, 1.25, 1.25], [1.25, 1.75, 1.25]],
            0.5,
        )]),
        &UNIT_GRID,
    );
    assert_eq!(parts.len(), 1);
    assert_eq!(parts[0].voxel, [1, 1, 1]);
    assert!(close(parts[0].area, 0.125));
    assert!(near(
        parts[0].mean_position,
        DVec3::new(0.25 + 0.5 / 3.0, 0.25 + 0.5 / 3.0, 0.25)
    ));
}

/// The triangle of side 1.5 √2 is cut into three corners of a ninth each and a hexagon-like rest of
/// six ninths.
#[test]
fn diagonal_triangle_is_shared_out() {
    let triangle = [[1.5, 0.0, 0.0], [0.0, 1.5, 0.0], [0.0, 0.0, 1.5]];
    let voxels = voxelize(&scene_of(&[(triangle, 0.5)]), &UNIT_GRID);
    let whole = 3f64.sqrt() / 4.0 * 4.5;
    assert_eq!(voxels.len(), 4);
    assert!(close(voxels[&[0, 0, 0]].area, whole * 6.0 / 9.0));
    assert!(near(voxels[&[0, 0, 0]].mean_position, DVec3::splat(0.5)));
    assert!(close(voxels[&[1, 0, 0]].area, whole / 9.0));
    assert!(near(
        voxels[&[1, 0, 0]].mean_position,
        DVec3::new(0.5 / 3.0, 0.5 / 3.0, 0.5 / 3.0)
    ));
    assert!(close(
        voxels[&[1, 0, 0]].coverage,
        whole / 9.0 / 3f64.sqrt()
    ));
}

#[test]
fn a_common_face_counts_in_both_voxels() {
    let voxels = voxelize(
        &scene_of(&[(
            [[0.25, 0.25, 1.0], [0.75, 0.25, 1.0], [0.25, 0.75, 1.0]],
            0.5,
        )]),
        &UNIT_GRID,
    );
    assert!(close(voxels[&[0, 0, 0]].area, 0.125) && close(voxels[&[0, 0, 1]].area, 0.125));
    assert!(
        close(voxels[&[0, 0, 0]].mean_position.z, 1.0)
            && close(voxels[&[0, 0, 1]].mean_position.z, 0.0)
    );
}

/// A triangle in a plane between voxels whose corners lie anywhere fills the face of every voxel
/// inside it, however its outline is rounded.
#[test]
fn a_common_face_is_whole_whatever_the_outline() {
    let triangle = [
        [10.261913, 38.0, 12.524603],
        [15.524603, 38.0, 29.738089],
        [32.73809, 38.0, 24.475399],
    ];
    let voxels = voxelize(
        &scene_of(&[(triangle, 0.5)]),
        &Grid {
            resolution: 64,
            ..UNIT_GRID
        },
    );
    for y in [37, 38] {
        assert!(
            close(voxels[&[16, y, 28]].area, 1.0),
            "{}",
            voxels[&[16, y, 28]].area
        );
    }
}

/// A voxel touched in one point has the least weight; its mean position is that point.
#[test]
fn slivers_have_the_least_weight() {
    let voxels = voxelize(
        &scene_of(&[([[1.0, 0.25, 0.25], [0.5, 0.25, 0.25], [0.5, 0.5, 0.5]], 0.5)]),
        &UNIT_GRID,
    );
    let sliver = &voxels[&[1, 0, 0]];
    assert_eq!(sliver.area, LEAST_WEIGHT);
    assert_eq!(sliver.coverage, LEAST_COVERAGE);
    assert!(near(sliver.mean_position, DVec3::new(0.0, 0.25, 0.25)));
}

#[test]
fn means_are_weighted_by_area() {
    let large = [[0.0, 0.0, 0.5], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]];
    let small = [[0.25, 0.0, 0.25], [0.25, 0.0, 0.5], [0.25, 0.25, 0.25]];
    let voxels = voxelize(&scene_of(&[(large, 0.125), (small, 0.625)]), &UNIT_GRID);
    let sum = &voxels[&[0, 0, 0]];
    // Areas 1/8 and 1/32: weights 4/5 and 1/5.
    assert_eq!(sum.fragment_count, 2);
    assert!(close(sum.area, 5.0 / 32.0));
    assert!(near(sum.albedo, DVec3::splat(0.8 * 0.125 + 0.2 * 0.625)));
    assert!(near(sum.normal, DVec3::new(-0.2, 0.0, 0.8)));
    assert!(close(sum.coverage, 0.125));
}

/// Texels 0.5 wide along x, black and white by turns: a voxel's mean is one half wherever it lies.
#[test]
fn textures_are_averaged_over_a_voxel() {
    let mut scene = scene_of(&floor(4.0, 1.5, 0.5));
    let stripes = [[0, 0, 0, 255], [255, 255, 255, 255]];
    scene.textures = vec![texture(TextureKind::Color, &stripes).into()];
    scene.materials[0].albedo_texture = Some(0);
    scene.materials[0].emission = Vec3::new(8.0, 0.0, 0.0);
    let parts = fragments(&scene, &UNIT_GRID);
    let first = parts
        .iter()
        .find(|part| part.triangle == 0 && part.voxel == [3, 0, 1]);
    assert!(
        first.is_some_and(|part| near(part.albedo, DVec3::splat(0.25))
            && near(part.emission, DVec3::new(8.0, 0.0, 0.0)))
    );
}

#[test]
fn masks_and_metals() {
    let mut scene = scene_of(&floor(4.0, 1.5, 0.5));
    scene.textures = vec![
        texture(TextureKind::Mask, &[[0; 4]]).into(),
        texture(TextureKind::Mask, &[[153; 4]]).into(),
    ];
    scene.materials[0].mask_texture = Some(0);
    scene.materials[1].mask_texture = Some(1);
    scene.materials[1].specular = Some(Specular {
        f0: Vec3::ONE,
        roughness: 0.5,
        metalness: 0.75,
        texture: None,
    });
    let parts = fragments(&scene, &UNIT_GRID);
    assert!(parts.iter().all(|part| part.triangle == 1));
    let whole = parts.iter().find(|part| part.voxel == [0, 3, 1]);
    assert!(
        whole.is_some_and(|part| (part.area - 0.6).abs() < 1e-6
            && (part.albedo - 0.125).abs().max_element() < 1e-6)
    );
}
