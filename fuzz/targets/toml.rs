#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = lumivox_fuzz::folder();
    std::fs::write(folder.join("scene.obj"), lumivox_fuzz::OBJ).unwrap();
    std::fs::write(folder.join("scene.mtl"), lumivox_fuzz::MTL).unwrap();
    folder
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    lumivox_fuzz::write_anew(&FOLDER.join("scene.toml"), bytes);
    lumivox_fuzz::check_scene(&FOLDER.join("scene.toml"));
});
