//! Frames in a program that has a device of its own: those of the example.
#![allow(unsafe_code, unreachable_pub)]

#[path = "../../examples/embed/embedded.rs"]
mod embedded;
#[path = "../../examples/embed/host.rs"]
mod host;

use crate::support::gpu;
use crate::support::technique::{Surfaces, default_cases, frame, small_lights, small_room, walked};
use host::Host;
use lumivox::frame::Renderer;
use lumivox::image::Aov;

/// They are those of a device that Lumivox has opened, bit for bit, also of a camera that walks.
/// Validation has nothing to say.
#[test]
fn frames_of_another_program_are_those_of_our_own() {
    let [(_, light), ..] = small_lights();
    let scene = small_room(Surfaces::Glossy, vec![light]);
    let settings = frame(32, 24, 32);
    let cameras = [0.0, 0.4, 1.5].map(|way_m| walked(&scene.camera, way_m));
    let gpu = gpu();
    let host = Host::new(true).unwrap();
    let target = host.target(settings.size).unwrap();
    let chosen = ["none", "svo", "clipmap", "lpv", "probe-cascades"];
    let cases = default_cases();
    for case in cases
        .iter()
        .filter(|case| chosen.contains(&case.entry.name))
    {
        let name = case.entry.name;
        let chosen = case.entry.settings::<&str>(None, &[]).unwrap();
        let (mut own, _) = Renderer::new(&gpu, &scene, case.entry, &chosen, settings).unwrap();
        let of = (&scene, name);
        let pictures = embedded::pictures(&host, &target, of, settings, &cameras).unwrap();
        for (index, (camera, texels)) in cameras.iter().zip(&pictures).enumerate() {
            own.render(camera).unwrap();
            let expected = own.aov(Aov::Full).unwrap();
            let found = texels.iter().map(|[r, g, b, _]| [*r, *g, *b]);
            let expected = expected.pixels.iter().map(|pixel| pixel.to_array());
            assert!(found.eq(expected), "{name}, frame {index}");
        }
    }
    host.destroy(&target);
    let messages = host.end();
    assert!(messages.is_empty(), "{messages:#?}");
}
