//! No shader reads or writes outside of its buffers: the validation layer checks every access on the device. A software driver clamps them silently, so nothing else
//! would show one.

use crate::support::passes::DOUBLE;
use crate::support::technique::{Surfaces, default_cases, frame, is_sound, shoot, small_lights, small_room};
use crate::support::{ValidatedGpu, own_gpu, words};
use lumivox::graph::{Frame, Gpu, GpuOptions};

fn checking_gpu() -> ValidatedGpu {
    own_gpu(&GpuOptions { check_accesses: true, ..GpuOptions::default() })
}

/// Doubles `count` words of a buffer of 64, and takes what the layer says.
fn double(gpu: &Gpu, count: u32) -> Vec<String> {
    let values = words(gpu, "values", &[1; 64]);
    let mut frame = Frame::new();
    frame.pass(&DOUBLE).bind(&values).constants(&[64]).push(&count).dispatch([2, 1, 1]);
    gpu.submit(frame).unwrap();
    gpu.messages().take()
}

/// The layer sees the first word behind a buffer, and says nothing of the last one in it.
#[test]
fn an_access_outside_of_a_buffer_is_reported() {
    let gpu = checking_gpu();
    assert_eq!(double(&gpu, 64), Vec::<String>::new());
    let messages = double(&gpu, 65);
    assert!(messages.iter().any(|message| message.contains("highest byte accessed")), "{messages:?}");
}

/// The default preset of every technique, over every kind of surface.
#[test]
fn no_technique_reads_or_writes_outside_of_its_buffers() {
    let gpu = checking_gpu();
    let [(_, point), ..] = small_lights();
    for case in default_cases() {
        for surfaces in [Surfaces::Masked, Surfaces::Emissive] {
            let shot = shoot(&gpu, &small_room(surfaces, vec![point]), &case, &[("resolution", case.smallest_resolution())], frame(16, 8, 32)).unwrap();
            assert!(is_sound(&shot.full), "{}", case.name());
            assert_eq!(gpu.validation_messages(), Vec::<String>::new(), "{}, {surfaces:?}", case.name());
        }
    }
}
