#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

static FOLDER: LazyLock<PathBuf> = LazyLock::new(lumivox_fuzz::folder);

// A file that begins as binary files do is read as one, whatever it is called.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    lumivox_fuzz::write_anew(&FOLDER.join("scene.gltf"), bytes);
    lumivox_fuzz::check_scene(&FOLDER.join("scene.gltf"));
});
