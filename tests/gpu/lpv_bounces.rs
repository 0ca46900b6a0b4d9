//! Bounces that end where little changes.

use glam::{DVec3, DVec4};
use lumivox::gi::lpv::faces::Side;
use lumivox::gi::lpv::lobes::{LobeSettings, Scheme};
use lumivox::gi::lpv::{CellSettings, Source};
use lumivox::graph::Gpu;
use lumivox::scene::Scene;

use crate::lpv::{SETTINGS, light, lights, read_light, read_sides};
use crate::support::gpu;

const MOST: u32 = 7;

/// What faces send in the last of so many bounces (W/(m² sr)), and the cells after it.
fn bounced(gpu: &Gpu, scene: &Scene, settings: CellSettings) -> (Vec<DVec3>, Vec<[DVec4; 9]>) {
    let lit = light(gpu, scene, 12, settings);
    // Maps light the first bounce without them.
    let Some(sides) = &lit.cells.faces.sides else {
        return (Vec::new(), read_light(gpu, &lit.cells));
    };
    let list: Vec<[u32; size_of::<Side>() / 4]> =
        bytemuck::pod_collect_to_vec(&gpu.read_buffer(&sides.list).unwrap());
    // Each run numbers them in an order of its own.
    let mut sides: Vec<_> = list.iter().zip(read_sides(gpu, &lit)).collect();
    sides.sort_by_key(|(side, _)| **side);
    let sides = sides.iter().map(|(_, light)| light.truncate()).collect();
    (sides, read_light(gpu, &lit.cells))
}

/// What all bounces after the first change, over the whole.
fn changes(sides: &[Vec<DVec3>]) -> Vec<f64> {
    let pairs = sides.iter().zip(&sides[1..]);
    pairs
        .map(|(before, after)| {
            let change: f64 = before
                .iter()
                .zip(after)
                .map(|(before, after)| (*after - *before).abs().element_sum())
                .sum();
            change / after.iter().map(|side| side.element_sum()).sum::<f64>()
        })
        .collect()
}

/// With a threshold between two changes, the light is that of the bounces up to there, bit by bit.
#[test]
fn bounces_end_where_little_changes() {
    let gpu = gpu();
    if !gpu.features().conditional_rendering {
        println!("SKIPPED: the device has no VK_EXT_conditional_rendering");
        return;
    }
    let lobes = LobeSettings {
        scheme: Scheme::Lobes30,
        iterations: 6,
        gain: 1.0,
        clamp_negative: true,
    };
    for (name, scene) in lights() {
        for (source, lobes) in [
            (Source::Faces, None),
            (Source::Rsm, None),
            (Source::Faces, Some(lobes)),
        ] {
            let with = |bounces, least_change| CellSettings {
                source,
                lobes,
                bounces,
                least_change,
                ..SETTINGS
            };
            let all: Vec<_> = (1..=MOST)
                .map(|bounces| bounced(&gpu, &scene, with(bounces, 0.0)))
                .collect();
            let mut sides: Vec<Vec<DVec3>> = all.iter().map(|(sides, _)| sides.clone()).collect();
            if sides[0].is_empty() {
                sides[0] = vec![DVec3::ZERO; sides[1].len()];
            }
            let changes = changes(&sides);
            println!("{name}, {source:?}: {changes:.4?}");
            // Steps are too coarse for the least.
            let tested = changes.iter().take_while(|change| **change > 1e-4).count();
            for at in 1..tested.min(changes.len() - 1) {
                let least = (changes[at] * changes[at - 1]).sqrt();
                let Some(end) = changes.iter().position(|change| *change <= least) else {
                    panic!("{name}: {changes:?} do not fall");
                };
                let (_, found) = bounced(&gpu, &scene, with(MOST, least as f32));
                assert!(
                    found == all[end].1,
                    "{name}: not that of {} bounces",
                    end + 1
                );
                assert!(found != all[end + 1].1, "{name}: {least} has no effect");
            }
            let (_, found) = bounced(&gpu, &scene, with(MOST, 1e-9));
            assert!(found == all[MOST as usize - 1].1, "{name}: all bounces");
        }
    }
}
