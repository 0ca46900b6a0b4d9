//! Scenes: loading, assembling, bundled scenes, writing and loading again.

use std::path::PathBuf;

use lumivox::scene::{LoadOptions, Scene};

/// The folder of real scenes that are not part of the project: `LUMIVOX_SCENES`, else `../shared/scenes`; `None`, said on stderr, where it is absent.
fn real_scenes() -> Option<PathBuf> {
    let folder = std::env::var_os("LUMIVOX_SCENES").map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes"), PathBuf::from);
    if !folder.is_dir() {
        eprintln!("skipped: {} is absent; set LUMIVOX_SCENES to the folder of real scenes", folder.display());
        return None;
    }
    Some(folder)
}

#[test]
fn real_scenes_have_their_published_triangle_counts() {
    let Some(folder) = real_scenes() else { return };
    // Published count, and how many of those have no area.
    let expected = [
        ("cornell_point", 30, 0),
        ("sponza_sun", 261_839, 0),
        ("sponza_noplants_sun", 226_899, 0),
        ("sponza_dragon", 292_405, 4),
        ("sponza_dabrovic", 66_450, 6),
        ("leak_door_200mm", 40, 0),
        ("bunny_box", 69_451, 0),
        ("dragon_box", 65_506, 4),
    ];
    for (name, published, without_area) in expected {
        let scene = Scene::load(&folder.join(format!("{name}.toml")), &LoadOptions::default()).unwrap();
        assert_eq!(scene.triangles.len(), published - without_area, "{name}");
        assert_eq!(scene.batches().len(), scene.materials.len(), "{name}");
    }
}
