//! What Olovsson 2012 says of the octree, by the bench: figures of `docs/octree-lpv.md`.

use glam::UVec3;
use lumivox::gi::lpv::oracle::simulator::{
    Action, Injector, Propagator, Run, Setup, difference, direction,
};

use crate::support::compare::Worst;

/// Its gain of ¾ and its negative flux that is none.
fn as_published(injector: &str, towards: &str) -> Setup {
    let mut setup = Setup::empty(32);
    (setup.gain, setup.clamp_negative) = (0.75, true);
    let injector = Injector::parse(injector).unwrap().unwrap();
    injector
        .inject(&mut setup, 1.0, direction(towards).unwrap())
        .unwrap();
    setup
}

fn done(setup: &Setup, name: &str, steps: u32) -> Run {
    let propagator = Propagator::new(name, 24).unwrap();
    let mut run = Run::new(setup, &propagator);
    for action in Run::automatic(propagator.structure, run.levels.len(), steps) {
        run.act(action);
    }
    run
}

/// Flux of a merged cell.
fn flux(run: &Run, cell: [u32; 3]) -> f64 {
    let grid = &run.levels[0].grid;
    run.merged
        .as_ref()
        .unwrap()
        .flux_of(grid, grid.index(UVec3::from(cell)))
}

/// Figure 14: light that has died out comes back where a coarser level begins.
#[test]
fn light_comes_back_at_a_border_of_levels() {
    let setup = as_published("wall:2", "1,0,0");
    let [octree, uniform] = ["octree-lobes30", "lobes30"].map(|name| done(&setup, name, 4));
    let along = |run: &Run| -> Vec<f64> { (2..32).map(|x| flux(run, [x, 16, 16])).collect() };
    let largest_rise = |fluxes: &[f64]| {
        let rises = fluxes.windows(2).map(|pair| pair[1] / pair[0]);
        rises.filter(|rise| rise.is_finite()).worst()
    };
    let [of_octree, of_uniform] = [along(&octree), along(&uniform)].map(|f| largest_rise(&f));
    println!("rises to {of_octree:.1} times, uniform {of_uniform:.2}");
    assert!(of_octree > 10.0 && of_uniform <= 1.0);
}

/// The same where a source moves on: what a far cell has changes by more than the light does.
#[test]
fn light_jumps_when_its_source_moves() {
    let far = [24, 16, 16];
    let jumps = |name: &str, steps: u32| {
        let at = |x: u32| {
            let setup = as_published(&format!("cell:{x},16,16"), "1,0,0");
            flux(&done(&setup, name, steps), far)
        };
        let fluxes: Vec<f64> = (13..=18).map(at).collect();
        fluxes
            .windows(2)
            .map(|pair| pair[1] / pair[0])
            .collect::<Vec<f64>>()
    };
    let octree = jumps("octree-lobes30", 4);
    let uniform = jumps("lobes30", 16);
    println!("octree {octree:.2?}, uniform {uniform:.2?}");
    // Nothing at most steps of the source, and all of it at some.
    assert!(
        octree
            .iter()
            .filter(|jump| (*jump - 1.0).abs() < 1e-9)
            .count()
            >= 3
    );
    assert!(octree.iter().any(|jump| *jump > 5.0));
    // A cell nearer is as much more light each time, within a factor of 2.
    assert!(uniform.iter().all(|jump| (4.0..8.0).contains(jump)));
}

/// Figure 16: after two steps light is behind the cell that sent it, after three there is more.
#[test]
fn light_is_behind_its_source_after_two_steps() {
    let mut setup = as_published("cell", "1,0,0");
    setup.gain = 1.0;
    let mut run = Run::new(&setup, &Propagator::new("lobes30", 8).unwrap());
    run.act(Action::Inject);
    let behind: Vec<f64> = (0..4)
        .map(|_| {
            run.act(Action::Step(None));
            let (grid, light) = (run.levels[0].grid, &run.levels[0].target);
            let is_behind = |at: &usize| (*at as u32 % 32) < 16;
            let count = grid.count() as usize;
            let behind = (0..count)
                .filter(is_behind)
                .map(|at| light.flux_of(&grid, at));
            behind.sum::<f64>() / run.account().on_its_way
        })
        .collect();
    println!("behind after each step: {behind:.3?}");
    assert_eq!(behind[0], 0.0);
    assert!(behind[1] > 0.03 && behind[2] > behind[1] && behind[3] > behind[2]);
}

/// §4.2: after k steps no cell is to be read from a level coarser than l − 1 − ⌊log₂ k⌋, here 3. It
/// holds of a wall, and not of a cell in a corner: a step goes to six neighbours, so the far corner
/// of 4³ cells is nine steps away.
#[test]
fn a_corner_is_read_from_the_coarsest_level() {
    let of = |injector: &str| {
        let run = done(&as_published(injector, "1,1,1"), "octree-lobes30", 4);
        run.index.iter().copied().max()
    };
    assert_eq!([of("wall:0"), of("cell:0,0,0")], [Some(3), Some(4)]);
}

/// §7.1: with the residual handed on, summed, the light of a few steps a level is closer to that of
/// many steps than the published octree's, and none is lost.
#[test]
fn the_residual_octree_is_closer_to_many_steps() {
    let mut setup = as_published("wall:2", "1,0,0");
    setup.gain = 1.0;
    setup.clamp_negative = false;
    let cells = |name: &str, steps: u32| {
        let run = done(&setup, name, steps);
        run.merged.as_ref().unwrap().lobes().unwrap().to_vec()
    };
    let many = cells("lobes30", 200);
    let [published, residual] =
        ["octree-lobes30", "residual-lobes30"].map(|name| difference(&cells(name, 4), &many));
    println!("four steps a level: published {published:.3}, residual {residual:.3}");
    assert!(residual < 0.75 * published, "{residual} of {published}");
}
