//! What the fuzz targets share: a folder for the files that they read, and what a scene that loads
//! has to be like.

use std::path::PathBuf;

#[path = "../../tests/support/loading.rs"]
mod loading;

pub use loading::{MTL, OBJ, check_scene, write_anew};

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
