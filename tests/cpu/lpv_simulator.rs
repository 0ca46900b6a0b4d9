//! The bench for propagation does what the oracles do, and its accounts and errors are right.

use std::f64::consts::PI;

use glam::{DVec3, DVec4, UVec3};
use lumivox::gi::lpv::Directions;
use lumivox::gi::lpv::lobes::{LobeSettings, Occlusion, Scheme};
use lumivox::gi::lpv::oracle::lobes::{Lobe, Steps, propagate, seed};
use lumivox::gi::lpv::oracle::octree::{
    coarse_faces, levels, merge_finest, merge_sum, published, repaired,
};
use lumivox::gi::lpv::oracle::simulator::{
    Action, Emission, Injected, Injector, Light, Occluder, PROPAGATORS, Propagator, Run, Setup,
    direction, errors_to, errors_within, inject_file,
};
use lumivox::gi::lpv::oracle::{Boundary, jacobi};
use lumivox::gi::lpv::simulator::SIMULATOR;
use lumivox::gi::settings::{Domain, Setting};
use lumivox::gi::simulator::{LitScene, Shape, Simulator, SimulatorRow};
use lumivox::reference::light_surfaces;
use lumivox::scene::{LoadOptions, Scene};

use crate::support::compare::{Largest, Worst, exceeds};

const STEPS: u32 = 3;

/// Light of two cells, and a wall with a gap.
fn setup() -> Setup {
    let mut setup = Setup::empty(8);
    for (cell, flux) in [
        ([2, 3, 4], DVec3::X),
        ([5, 1, 6], DVec3::new(0.0, 2.0, -1.0)),
    ] {
        setup.injected.push(Injected {
            cell: UVec3::from(cell),
            emission: Emission::Cosine(flux),
        });
    }
    Occluder::parse("x:5:0..8:0..6")
        .unwrap()
        .close(&mut setup)
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

/// What the oracle of the device's passes starts from.
fn seeds(setup: &Setup) -> Vec<Lobe> {
    let count = setup.grid.count() as usize;
    let (mut flux, mut power) = (vec![[DVec3::ZERO; 3]; count], vec![DVec3::ZERO; count]);
    for Injected { cell, emission } in &setup.injected {
        let Emission::Cosine(own) = emission else {
            continue;
        };
        flux[setup.grid.index(*cell)][0] += *own;
        power[setup.grid.index(*cell)].x += own.length();
    }
    seed(&setup.grid, (&flux, &power), &vec![0; count], &|_, _| {
        DVec4::ZERO
    })
}

/// The largest difference of the first channel.
fn apart(light: Option<&Light>, other: &[Lobe]) -> f64 {
    let own = light.and_then(Light::lobes).unwrap();
    let pairs = own.iter().flatten().zip(other.iter().flatten());
    pairs.map(|(a, b)| (a.x - b.x).abs()).worst()
}

#[test]
fn automatic_runs_are_what_the_oracles_find() {
    let setup = setup();
    let first = seeds(&setup);
    let grids = levels(setup.grid);
    let mut faces = vec![setup.faces.clone()];
    for pair in grids.windows(2) {
        faces.push(coarse_faces(&pair[0], &pair[1], &faces[faces.len() - 1]));
    }
    for (name, scheme) in [
        ("lobes30", Scheme::Lobes30),
        ("axis6", Scheme::Axis6),
        ("stream", Scheme::Stream),
    ] {
        let steps: Vec<Steps<'_>> = faces
            .iter()
            .map(|faces| Steps {
                settings: LobeSettings {
                    scheme,
                    iterations: STEPS,
                    gain: 1.0,
                    clamp_negative: false,
                },
                occlusion: Occlusion::Faces,
                faces,
                blockers: &[],
            })
            .collect();
        let of = |structure: &str| done(&setup, &format!("{structure}{name}"), STEPS);
        let uniform = propagate(&setup.grid, &steps[0], &first);
        let finest = merge_finest(&grids, &published(&grids, &steps, &first));
        let sum = merge_sum(&grids, &repaired(&grids, &steps, &first).fields);
        for (run, expected) in [
            (of(""), uniform),
            (of("octree-"), finest),
            (of("residual-"), sum),
        ] {
            let apart = apart(run.merged.as_ref(), &expected);
            assert!(!exceeds(apart, 1e-12), "{}: {apart}", run.propagator.name);
        }
    }
}

#[test]
fn ordinates_are_those_of_the_sweep() {
    let setup = setup();
    let run = done(&setup, "ordinates", 40);
    let source = |at: usize, direction: DVec3| {
        let own = setup
            .injected
            .iter()
            .filter(|own| setup.grid.index(own.cell) == at);
        let flux: f64 = own
            .map(|own| match own.emission {
                Emission::Cosine(flux) => flux.dot(direction).max(0.0) / PI,
                Emission::Coefficients(_) => 0.0,
            })
            .sum();
        DVec4::X * flux
    };
    let boundary = Boundary {
        faces: &setup.faces,
        side: &|_, _| DVec4::ZERO,
        inflow: &|_, _, _| DVec4::ZERO,
        source: &source,
    };
    let directions = Directions::spiral(24);
    let swept = jacobi(&setup.grid, &directions, &boundary, 41);
    // Of all directions together: the sweep's first coefficient is √4π smaller.
    let Light::Ordinates(_, radiance) = &run.levels[0].sum else {
        panic!("no ordinates")
    };
    let count = setup.grid.count() as usize;
    for at in 0..count {
        let own: f64 = directions
            .all
            .iter()
            .zip(radiance.iter().skip(at).step_by(count))
            .map(|((_, weight), radiance)| weight * radiance)
            .sum();
        let expected = (4.0 * PI).sqrt() * swept.light[at][0].x;
        assert!((own - expected).abs() < 1e-12, "{at}: {own}, {expected}");
    }
    let ledger = run.account();
    assert!((ledger.injected - swept.ledger.injected.x).abs() < 1e-9);
    assert!((ledger.absorbed - swept.ledger.absorbed.x).abs() < 1e-9);
    assert!((ledger.left - swept.ledger.left.x).abs() < 1e-9);
}

/// Injected is left, absorbed or on its way, with walls and levels; a gain below 1 loses the rest.
#[test]
fn no_flux_is_lost() {
    let setup = setup();
    let with_gain = Setup {
        gain: 0.5,
        ..setup.clone()
    };
    for name in PROPAGATORS.iter().filter(|name| !name.ends_with("stream")) {
        let account = done(&setup, name, STEPS).account();
        let lost = account.lost() / account.injected;
        assert!(lost.abs() < 1e-12, "{name}: {lost}");
        assert!(account.absorbed > 0.0 && account.left > 0.0, "{name}");
        assert!(done(&with_gain, name, STEPS).account().lost() > 0.2 * account.injected);
    }
    // Its matrices are of a quadrature.
    let account = done(&setup, "stream", STEPS).account();
    assert!(account.lost().abs() < 1e-8 * account.injected);
}

/// The light of a lobe is a cell further after many steps, that of ordinates as far as it goes.
#[test]
fn lobes_forget_their_direction() {
    let mut setup = Setup::empty(31);
    let cell = Injector::parse("cell").unwrap().unwrap();
    cell.inject(&mut setup, 2.0, DVec3::Z).unwrap();
    let [lobes, ordinates] = ["lobes30", "ordinates"].map(|name| done(&setup, name, 14).moved());
    assert!((lobes.z - 0.97).abs() < 0.01, "{lobes}");
    assert!(lobes.x.abs() < 1e-9 && ordinates.z > 6.0, "{ordinates}");
}

#[test]
fn errors_are_means_over_all_coarse_cells() {
    let grids = levels(Setup::empty(4).grid);
    let cells = |count: usize, value: f64| vec![[DVec4::X * value; 4]; count];
    let (fine, mut coarse) = (cells(64, 1.0), cells(8, 1.0));
    let of = |coarse: &[Lobe]| errors_within(&grids, &[&fine, coarse]);
    assert_eq!(of(&coarse).worst, 0.0);
    // Of one cell of eight, one coefficient is off by 3: the norm is the largest.
    coarse[5][2].x = 4.0;
    let errors = of(&coarse);
    let expected = [3.0 / 8.0, 3.0 / 4.0 / 8.0, 3.0];
    let found = [errors.absolute, errors.relative, errors.worst];
    assert!(
        (DVec3::from(found) - DVec3::from(expected)).abs().largest() < 1e-12,
        "{found:?}"
    );
    // A uniform grid of half the light.
    let errors = errors_to(&grids, &[&fine, &cells(8, 1.0)], &cells(64, 0.5));
    assert_eq!([errors.absolute, errors.relative], [0.5, 0.5]);
}

/// Actions one by one, in an order of their own.
#[test]
fn actions_are_single() {
    let setup = setup();
    let propagator = Propagator::new("octree-lobes30", 8).unwrap();
    let mut run = Run::new(&setup, &propagator);
    assert_eq!(run.account().injected, 0.0);
    run.act(Action::Inject);
    let flux = run.account().injected;
    assert!((flux - (1.0 + 5f64.sqrt())).abs() < 1e-12);
    run.act(Action::Step(Some(0)));
    run.act(Action::Step(Some(0)));
    assert_eq!((run.levels[0].steps, run.levels[1].steps), (2, 0));
    assert_eq!(run.levels[1].account.injected, 0.0);
    // Half of what is on its way, at each level.
    run.act(Action::Downsample);
    let half = 0.5 * run.levels[0].account.on_its_way;
    assert!((run.levels[1].account.injected - half).abs() < 1e-12);
    run.act(Action::Merge);
    assert!(run.index.contains(&0) && run.index.contains(&2));
    // Injected again: twice the light.
    run.act(Action::Inject);
    assert!((run.levels[0].account.injected - 2.0 * flux).abs() < 1e-12);
}

#[test]
fn injectors_of_files_say_what_is_wrong() {
    let inject = |text: &str| {
        let mut setup = Setup::empty(8);
        inject_file(&mut setup, ("a.toml", text), 2.0)
            .map(|()| setup.injected)
            .map_err(|error| error.to_string())
    };
    let good = "[[cell]]\nat = [1, 2, 3]\nflux = 3.0\nnormal = [0.0, 2.0, 0.0]\n";
    assert_eq!(
        inject(good).unwrap()[0].emission,
        Emission::Cosine(6.0 * DVec3::Y)
    );
    let raw = "[[cell]]\nat = [1, 2, 3]\ncoefficients = [1.0, 0.0, 0.5, 0.0]\n";
    let raw = inject(raw).unwrap()[0].emission;
    assert_eq!(raw, Emission::Coefficients([2.0, 0.0, 1.0, 0.0]));
    for (change, says) in [
        (
            ("at = [1, 2, 3]", "at = [1, 8, 3]"),
            "a.toml:1: at: cell [1, 8, 3] is outside",
        ),
        (("flux = 3.0", "flux = -3.0"), "a.toml:1: flux: -3 W"),
        (("2.0, 0.0]", "0.0, 0.0]"), "a.toml:1: normal"),
        (
            ("flux = 3.0\n", ""),
            "either flux and normal, or coefficients",
        ),
        (("flux", "flow"), "a.toml:3: unknown field `flow`"),
        (("[1, 2, 3]", "[1, 2]"), "a.toml:2: "),
    ] {
        let error = inject(&good.replace(change.0, change.1)).unwrap_err();
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn words_of_the_command_line_are_told_when_wrong() {
    for text in [
        "wall:x",
        "wall:1:1,0",
        "cell:1,2",
        "cell:1,2,3:0,0,0",
        "cell:1,2,3:1,0,0:4",
    ] {
        assert!(Injector::parse(text).unwrap().is_err(), "{text}");
    }
    assert!(Injector::parse("a.toml").is_none());
    for text in ["x", "w:4", "x:4:1..2", "x:4:1..2:3", "x:-1"] {
        assert!(Occluder::parse(text).is_err(), "{text}");
    }
    let mut setup = Setup::empty(8);
    for text in ["x:9", "x:4:0..9:0..8"] {
        assert!(
            Occluder::parse(text).unwrap().close(&mut setup).is_err(),
            "{text}"
        );
    }
    let far = Injector::parse("wall:8").unwrap().unwrap();
    assert!(far.inject(&mut setup, 1.0, DVec3::X).is_err());
    assert!(direction("1,x,0").is_err() && direction("0,0,0").is_err());
    assert_eq!(direction("0,-2,0").unwrap(), DVec3::NEG_Y);
    let unknown = Propagator::new("lobes", 8).unwrap_err();
    assert!(unknown.contains("lobes30, axis6"), "{unknown}");
}

/// Every value of every setting makes a simulator, which tells and draws what the bench has.
#[test]
fn the_row_of_the_window_is_the_bench() {
    let values = |list: &[Setting], pairs: &[String]| SimulatorRow::values(list, pairs).unwrap();
    let names: Vec<&str> = [SIMULATOR.settings, SIMULATOR.shown]
        .concat()
        .iter()
        .map(|setting| setting.name)
        .collect();
    let of_rules = SIMULATOR.rules.iter().flat_map(|rule| rule.settings);
    assert!(of_rules.clone().all(|name| names.contains(name)) && of_rules.count() >= 3);
    let scene = Scene::open("bundled:cornell", &LoadOptions::default()).unwrap();
    let lit = LitScene {
        scene: &scene,
        light: |scene, spacing_m| {
            light_surfaces(scene, spacing_m).map_err(|error| error.to_string())
        },
    };
    let make = |pairs: &[&str]| {
        let mut all = vec!["cells=8".to_owned(), "directions=8".to_owned()];
        all.extend(pairs.iter().map(|pair| (*pair).to_owned()));
        (SIMULATOR.make)(&values(SIMULATOR.settings, &all), &lit).unwrap()
    };
    let told = |simulator: &dyn Simulator, name: &str| -> String {
        let figures = simulator.figures();
        let found = figures.iter().find(|(known, _)| *known == name);
        found.map_or_else(String::new, |(_, value)| value.clone())
    };
    for setting in SIMULATOR.settings {
        let Domain::Choice(words) = setting.domain else {
            continue;
        };
        for word in words {
            let mut simulator = make(&[&format!("{}={word}", setting.name)]);
            for action in simulator.automatic(2) {
                simulator.act(action, &values(SIMULATOR.shown, &[]));
            }
            let lost = told(&*simulator, "lost");
            assert!(
                !told(&*simulator, "injected").starts_with("0 ")
                    && (word == &"on" || lost.starts_with("0 ") || lost.starts_with("-0 ")),
                "{} {word}: {lost} lost",
                setting.name
            );
            for shown in ["merged", "source", "target", "sum"] {
                let pairs = [format!("show={shown}"), "level=6".to_owned()];
                let drawing = simulator.draw(&values(SIMULATOR.shown, &pairs));
                assert!(drawing.size.contains(&8), "{shown}");
                assert!(drawing.title.contains(shown), "{}", drawing.title);
            }
        }
    }
    // Lobes of the slice that has the middle cell, before and after a step.
    let mut simulator = make(&["injector=cell"]);
    let stars = |simulator: &dyn Simulator, pairs: &[String]| {
        let drawing = simulator.draw(&values(SIMULATOR.shown, pairs));
        let is_star = |shape: &&Shape| matches!(shape, Shape::Star { .. });
        drawing.shapes.iter().filter(is_star).count()
    };
    let index = |name: &str| {
        let mut actions = SIMULATOR.actions.iter();
        actions.position(|action| action.name == name).unwrap()
    };
    let middle = ["index=4".to_owned()];
    assert_eq!(stars(&*simulator, &middle), 0);
    let shown = values(SIMULATOR.shown, &[]);
    simulator.act(index("inject"), &shown);
    // Two bands: a lobe, and behind it what is below zero.
    assert_eq!(stars(&*simulator, &middle), 2);
    assert_eq!(stars(&*simulator, &["index=3".to_owned()]), 0);
    simulator.act(index("step"), &shown);
    assert!(stars(&*simulator, &middle) > 2 && stars(&*simulator, &["index=3".to_owned()]) > 0);
    assert_eq!(told(&*simulator, "steps"), "1");
    assert_eq!(simulator.most("index"), Some(7));
    // A step of one level leaves the others as they are.
    let mut simulator = make(&["injector=cell", "propagator=octree-lobes30"]);
    let level = |level: u32| {
        values(
            SIMULATOR.shown,
            &[format!("level={level}"), middle[0].clone()],
        )
    };
    simulator.act(index("inject"), &shown);
    simulator.act(index("downsample"), &shown);
    let before = [0, 1, 2].map(|at| simulator.draw(&level(at)).shapes);
    simulator.act(index("step-level"), &level(1));
    let after = [0, 1, 2].map(|at| simulator.draw(&level(at)).shapes);
    assert_eq!(
        [0, 1, 2].map(|at| before[at] == after[at]),
        [true, false, true]
    );
    assert_eq!(told(&*simulator, "steps"), "1");
}
