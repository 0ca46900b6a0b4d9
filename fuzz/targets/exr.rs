#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use lumivox::image::{Aov, read_aov, read_exr, read_planes, write_planes};

static FOLDER: LazyLock<PathBuf> = LazyLock::new(lumivox_fuzz::folder);

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let (path, copy) = (FOLDER.join("image.exr"), FOLDER.join("copy.exr"));
    lumivox_fuzz::write_anew(&path, bytes);
    let Ok(planes) = read_planes(&path) else { return };
    let count = planes.width as usize * planes.height as usize;
    assert!(planes.planes.iter().all(|(_, values)| values.len() == count));
    let _ = (read_exr(&path), read_aov(&path, Aov::Indirect));
    if write_planes(&copy, &planes).is_ok() {
        let again = read_planes(&copy).unwrap();
        assert_eq!((again.width, again.height, again.planes.len()),
            (planes.width, planes.height, planes.planes.len()));
    }
});
