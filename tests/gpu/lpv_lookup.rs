//! Pixels of the light propagation volume against the lookup in double precision.

use glam::{DVec3, DVec4};
use lumivox::gi::lpv::CellSettings;
use lumivox::gi::lpv::gather::{Lookup, gather};
use lumivox::gi::lpv::lobes::Occlusion;
use lumivox::gi::lpv::oracle::{damped_irradiance, irradiance};
use lumivox::gi::shared::voxel::VoxelGrid;
use lumivox::graph::Frame;
use lumivox::render::IndirectLight;

use crate::lpv::{SETTINGS, light, lights};
use crate::support::compare::{Largest, Worst};
use crate::support::gather::View;
use crate::support::gpu;

/// Damped and not, with light that leaks and light that does not. The filter's weights have few
/// bits.
#[test]
fn looked_up_light_is_the_oracles() {
    let gpu = gpu();
    let (mut changed, mut all) = (0, 0);
    for (name, scene) in lights() {
        for (occlusion, shift) in [(Occlusion::Faces, 1.0), (Occlusion::None, 0.5)] {
            let settings = CellSettings {
                occlusion,
                ..SETTINGS
            };
            let lit = light(&gpu, &scene, 14, settings);
            // Receivers in metres.
            let metres = VoxelGrid {
                origin: glam::Vec3::ZERO,
                voxel_size: 1.0,
                resolution: 8,
            };
            let view = View::new(&gpu, &lit.scene, &scene.camera, [48, 36], &metres);
            let results = [false, true].map(|damping| {
                let mut frame = Frame::new();
                frame.set_scene(&lit.scene.set, &lit.scene.materials);
                let lookup = Lookup {
                    shift,
                    blend: 0.0,
                    damping,
                };
                let answer = IndirectLight {
                    diffuse: view.result.clone(),
                    specular: None,
                };
                let cells = std::slice::from_ref(&lit.cells);
                gather(&mut frame, &view.gbuffer, cells, lookup, &answer);
                gpu.submit(frame).unwrap();
                view.results(&gpu)
            });
            let expected = [irradiance, damped_irradiance].map(|oracle| {
                let of = |(_, at): &(_, lumivox::gi::shared::voxel::oracle::Receiver)| {
                    let surface = (at.position, at.geometric_normal);
                    let grid = &lit.cells.grid;
                    oracle(&lit.light, grid, surface, at.shading_normal, shift.into())
                };
                view.receivers.iter().map(of).collect::<Vec<DVec4>>()
            });
            let environment = scene.environment.as_dvec3();
            for (got, expected) in results.iter().zip(&expected) {
                let seen = |e: &DVec4| -> DVec3 { e.truncate() + e.w * environment };
                let largest = expected.iter().map(|e| seen(e).largest()).worst();
                let errors = got.iter().zip(expected);
                let errors = errors.map(|(got, e)| (got.truncate() - seen(e)).abs().largest());
                let worst = errors.worst() / largest;
                println!("{name}, {occlusion:?}: differs by {worst:.1e} of the largest");
                assert!(worst < 0.02, "{name}: {worst}");
            }
            let [plain, damped] = &expected;
            let pairs = plain.iter().zip(damped);
            changed += pairs.filter(|(a, b)| b.x < 0.95 * a.x).count();
            all += plain.len();
        }
    }
    println!("{changed} of {all} pixels are damped");
    assert!(changed > 100 && changed < all, "{changed}");
}
