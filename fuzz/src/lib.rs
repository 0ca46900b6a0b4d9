//! What the fuzz targets share: a folder for the files that they read, and what a scene that loads
//! has to be like.

use std::path::{Path, PathBuf};

use lumivox::scene::{LoadOptions, Scene};

#[path = "../../tests/support/loading.rs"]
mod loading;

pub use loading::write_anew;

/// A model of two materials and two textures, for targets that break something else.
pub const OBJ: &str =
    "mtllib scene.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl red\nf \
    1/1 2/2 3/3\nusemtl blue\nf 1/1 2/2 4/3\n";

/// Its materials.
pub const MTL: &str = "newmtl red\nKd 1 0 0\nKe 1 2 3\nnewmtl blue\nKs 1 1 1\nPr 0.3\n";

/// The smallest PNG: one grey pixel.
const PNG: &[u8] = &[
    0x89, b'P', b'N', b'G', 13, 10, 26, 10, 0, 0, 0, 13, b'I', b'H', b'D', b'R', 0, 0, 0, 1, 0, 0,
        0, 1, 8, 0, 0, 0, 0, 0x3a, 0x7e, 0x9b, 0x55, 0, 0, 0, 10,
    b'I', b'D', b'A', b'T', 0x78, 0x9c, 0x63, 0x68, 0, 0, 0, 0x82, 0, 0x81, 0x77, 0xcd, 0x72, 0xb6,
        0, 0, 0, 0, b'I', b'E', b'N', b'D', 0xae, 0x42, 0x60, 0x82,
];

/// A folder of this process, with a picture in it.
pub fn folder() -> PathBuf {
    let folder = std::env::temp_dir().join(format!("lumivox-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("t.png"), PNG).unwrap();
    folder
}

/// Loads a scene. What loads keeps the invariants and survives writing; what does not is told in
/// one line.
pub fn check_scene(path: &Path) {
    match Scene::load(path, &LoadOptions { allow_missing_textures: true }) {
        Ok(scene) => {
            loading::check_invariants(&scene);
            loading::round_trip(&scene);
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
}
