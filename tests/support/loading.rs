//! What every scene that loads is like, and that it survives writing and loading; the fuzz targets
//! include this file too.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use lumivox::scene::{Light, LoadOptions, Scene, TextureKind};

/// A model of two materials and two textures, for targets that break something else.
pub const OBJ: &str = "mtllib scene.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n\
    vt 0 0\nvt 1 0\nvt 0 1\nusemtl red\nf 1/1 2/2 3/3\nusemtl blue\nf 1/1 2/2 4/3\n";

/// Its materials.
pub const MTL: &str = "newmtl red\nKd 1 0 0\nKe 1 2 3\nnewmtl blue\nKs 1 1 1\nPr 0.3\n";

/// Loads a scene that is known to be good.
pub fn load(path: &Path) -> Scene {
    Scene::load(path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Writes a file that may be there already. Some file systems (ext4) make whoever cuts a file short
/// wait for the disk, so it is made anew: 0.06 ms, not 6.
pub fn write_anew(path: &Path, contents: impl AsRef<[u8]>) {
    let _ = std::fs::remove_file(path);
    std::fs::write(path, contents).unwrap();
}

/// Loads a scene. What loads keeps the invariants and survives writing; what does not is told in
/// one line.
pub fn check_scene(path: &Path) {
    match Scene::load(
        path,
        &LoadOptions {
            allow_missing_textures: true,
            ..LoadOptions::default()
        },
    ) {
        Ok(scene) => {
            check_invariants(&scene);
            round_trip(&scene);
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
}

/// Corners of a triangle (m).
pub fn corners(scene: &Scene, triangle: usize) -> [Vec3; 3] {
    scene.triangles[triangle]
        .vertices
        .map(|index| Vec3::from(scene.vertices[index as usize].position))
}

/// Writes and loads, and compares all but the names of textures, and equal names of models, which
/// are told apart.
pub fn round_trip(scene: &Scene) {
    let folder = tempfile::tempdir().unwrap();
    let mut loaded = load(&scene.write(folder.path()).unwrap());
    assert_eq!(loaded.textures.len(), scene.textures.len());
    for (loaded, written) in loaded.textures.iter_mut().zip(&scene.textures) {
        Arc::make_mut(loaded).name.clone_from(&written.name);
    }
    for (loaded, written) in loaded.models.iter_mut().zip(&scene.models) {
        assert!(
            loaded.name.starts_with(&written.name)
                && (loaded.name == written.name || scene.models.len() > 1),
            "{}: models' names",
            scene.name
        );
        loaded.name.clone_from(&written.name);
    }
    let bits = |scene: &Scene| bytemuck::cast_slice::<_, u8>(&scene.vertices).to_vec();
    assert!(
        bits(scene) == bits(&loaded),
        "{}: vertices differ",
        scene.name
    );
    // Each has files of its own.
    loaded.files.clone_from(&scene.files);
    assert!(*scene == loaded, "{}: scenes differ", scene.name);
}

/// What every consumer relies on.
pub fn check_invariants(scene: &Scene) {
    let name = &scene.name;
    assert!(
        scene
            .triangles
            .is_sorted_by_key(|triangle| triangle.material),
        "{name}: sorted by material"
    );
    assert_eq!(
        scene.batches().len(),
        scene.materials.len(),
        "{name}: every material is used"
    );
    assert_eq!(
        scene
            .models
            .iter()
            .map(|model| model.triangle_count as usize)
            .sum::<usize>(),
        scene.triangles.len(),
        "{name}: models cover the triangles"
    );
    for (index, triangle) in scene.triangles.iter().enumerate() {
        let [a, b, c] = corners(scene, index).map(|corner| corner.as_dvec3());
        assert!(
            (b - a).cross(c - a).length() > 0.0,
            "{name}: triangle {index} has area"
        );
        assert!(
            triangle
                .vertices
                .iter()
                .all(|vertex| (*vertex as usize) < scene.vertices.len())
        );
    }
    for vertex in &scene.vertices {
        assert!(
            (Vec3::from(vertex.normal).length() - 1.0).abs() < 1e-5,
            "{name}: unit normals"
        );
        assert!(
            Vec3::from(vertex.position).is_finite() && vertex.u.is_finite() && vertex.v.is_finite(),
            "{name}"
        );
    }
    for material in &scene.materials {
        let kind = |texture: Option<u32>| texture.map(|index| scene.textures[index as usize].kind);
        assert!(kind(material.albedo_texture).is_none_or(|kind| kind == TextureKind::Color));
        let lobe = material.specular.and_then(|lobe| lobe.texture);
        assert!(kind(lobe).is_none_or(|kind| kind == TextureKind::Color));
        assert!(kind(material.emission_texture).is_none_or(|kind| kind == TextureKind::Color));
        assert!(kind(material.mask_texture).is_none_or(|kind| kind == TextureKind::Mask));
        assert!(kind(material.normal_texture).is_none_or(|kind| kind == TextureKind::Normal));
        assert!(
            material.albedo.is_finite()
                && material.albedo.max_element() <= 1.0
                && material.albedo.min_element() >= 0.0
        );
    }
    for texture in &scene.textures {
        assert_eq!(
            texture.texels.len(),
            (texture.width * texture.height) as usize
        );
    }
    let is_unit = |axis: Vec3| (axis.length() - 1.0).abs() < 1e-3;
    assert!(
        scene.camera.basis().into_iter().all(is_unit),
        "{name}: the camera looks somewhere: {:?}",
        scene.camera
    );
    for light in &scene.lights {
        let (direction, value) = match *light {
            Light::Directional {
                direction,
                irradiance,
            } => (direction, irradiance),
            Light::Point { intensity, .. } => (Vec3::Y, intensity),
            Light::Spot {
                direction,
                intensity,
                ..
            } => (direction, intensity),
        };
        assert!(
            is_unit(direction) && value.is_finite() && value.min_element() >= 0.0,
            "{name}: {light:?}"
        );
    }
}
