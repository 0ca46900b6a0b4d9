//! Faults that are planted in the program: one line, and the exit code.

use image::GenericImageView as _;

use crate::support::display::{Display, check_done};
use crate::support::program::{check_error, lumivox, words};

const FAULTS: &str = "LUMIVOX_FAULTS";

/// The device is lost in the middle of a frame; there is no memory; what is planted is no fault.
#[test]
fn the_program_ends_with_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let render = words(
        "render bundled:cornell --technique none --size 16x8 --shadow-resolution 16 --timing \
         timestamps -o a.png",
    );
    let cases: [(&str, i32, &[&str]); 4] = [
        (
            "loss=0:1",
            1,
            &["the device was lost", "the last pass that finished is"],
        ),
        (
            "allocation=5",
            1,
            &[
                "out of memory",
                "bytes wanted",
                "bytes available",
                "lower the resolution, the probes or the size",
            ],
        ),
        ("absent=maintenance4", 1, &["lacks: maintenance4"]),
        ("nonsense", 2, &["nonsense is no fault"]),
    ];
    for (faults, code, says) in cases {
        check_error(
            faults,
            &lumivox(folder.path(), &render, &[(FAULTS, faults)]),
            code,
            says,
        );
        assert!(
            !folder.path().join("a.png").exists(),
            "{faults}: a picture was written"
        );
    }
}

/// A surface that is out of date is made again, whichever picture it befalls; one that is lost ends
/// the window.
#[test]
fn the_window_makes_its_swapchain_again_or_ends_with_one_line() {
    let Some(display) = Display::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "--size",
        "120x80",
        "--technique",
        "none",
        "--shadow-resolution",
        "16",
    ];
    let script = "still\nframes 4\nscreenshot a.png\nframes 2\nclose\n";
    check_done(&display.view(folder.path(), &arguments, script));
    let expected = image::open(folder.path().join("a.png")).unwrap();
    for faults in ["out-of-date=0", "out-of-date=2"] {
        std::fs::remove_file(folder.path().join("a.png")).unwrap();
        check_done(&display.view_in(folder.path(), &arguments, script, &[(FAULTS, faults)]));
        assert_eq!(
            image::open(folder.path().join("a.png"))
                .unwrap()
                .dimensions(),
            expected.dimensions(),
            "{faults}"
        );
    }
    let lost = display.view_in(
        folder.path(),
        &arguments,
        script,
        &[(FAULTS, "surface-lost=2")],
    );
    check_error(
        "surface-lost=2",
        &lost,
        1,
        &["showing a picture", "surface"],
    );
}
