//! Views of the light propagation volume against a plain march from cell to cell.

use glam::{DVec3, DVec4, UVec3};
use lumivox::gi::lpv::view::{VIEW, ViewParams};
use lumivox::gi::shared::sh;
use lumivox::graph::Frame;
use lumivox::image::luminance;
use lumivox::render::{screen_groups, screen_image};
use lumivox::scene::Scene;

use crate::lpv::{Lit, SETTINGS, light};
use crate::support::compare::{Largest, exceeds};
use crate::support::gather::pixel_rays;
use crate::support::gpu;
use crate::support::scenes::bundled;

const SIZE: [u32; 2] = [64, 48];

/// As the shader has them.
const REACH: f64 = 0.48;
const NEAREST_LOBE: f64 = 2.0;

/// Irradiance and ambient visibility from the coefficients of a cell.
fn irradiance(coefficients: &[DVec4; 9], environment: DVec3, normal: DVec3) -> DVec4 {
    let sum = sh::irradiance(coefficients, normal).max(DVec4::ZERO);
    (sum.truncate() + sum.w * environment).extend(sum.w / std::f64::consts::PI)
}

/// Luminance of irradiance, and a bound of it over all directions.
fn brightness(coefficients: &[DVec4; 9], environment: DVec3) -> (impl Fn(DVec3) -> f64, f64) {
    let factors = sh::clamped_cosine(3);
    let grey: [f64; 9] = std::array::from_fn(|at| {
        let c = coefficients[at];
        let rgb = c.truncate() + c.w * environment;
        factors[at.isqrt()] * f64::from(luminance(rgb.as_vec3()))
    });
    let of_band = |band: usize| {
        let own = &grey[band * band..(band + 1) * (band + 1)];
        let square: f64 = own.iter().map(|c| c * c).sum();
        ((2 * band + 1) as f64 / (4.0 * std::f64::consts::PI) * square).sqrt()
    };
    let bound = of_band(0) + of_band(1) + of_band(2);
    let along = move |direction: DVec3| {
        let mut basis = [0.0; 9];
        sh::evaluate(3, direction, &mut basis);
        basis.iter().zip(grey).map(|(basis, c)| basis * c).sum()
    };
    (along, bound)
}

/// What a ray sees, by small steps; whether that is a lobe.
fn seen(
    lit: &Lit,
    environment: DVec3,
    (origin, ray): (DVec3, DVec3),
    has_lobes: bool,
) -> (DVec4, bool) {
    let grid = &lit.cells.grid;
    let place = |t: f64| origin + t * ray;
    let cell_at = |place: DVec3| {
        let cell = place.floor();
        let is_inside = cell.cmpge(DVec3::ZERO).all() && cell.cmplt(grid.size.as_dvec3()).all();
        is_inside.then(|| cell.as_uvec3())
    };
    let (mut before, mut step) = (None::<UVec3>, 0u32);
    // Through the largest grid, from a camera beside it.
    while step < 60_000 {
        let at = place(f64::from(step) * 2e-3);
        step += 1;
        let cell = cell_at(at);
        let left = before.filter(|_| cell != before);
        if let Some(left) = left {
            // Through which of its faces: the axis that changes.
            let (from, to) = (left.as_dvec3(), at.floor());
            let axis = [0, 1, 2].into_iter().find(|axis| from[*axis] != to[*axis]);
            let axis = axis.unwrap_or(0);
            let face = 2 * axis + usize::from(to[axis] > from[axis]);
            if lit.words[grid.index(left)] >> face & 1 == 1 {
                let mut normal = DVec3::ZERO;
                normal[axis] = (from[axis] - to[axis]).signum();
                let coefficients = &lit.light[grid.index(left)];
                return (irradiance(coefficients, environment, normal), false);
            }
            if cell.is_none() {
                break;
            }
        }
        before = cell;
        let Some(cell) = cell.filter(|_| has_lobes) else {
            continue;
        };
        let off = at - cell.as_dvec3() - 0.5;
        let is_near = (cell.as_dvec3() + 0.5).distance(origin) <= NEAREST_LOBE;
        if off.length() >= REACH || is_near || lit.words[grid.index(cell)] & 63 == 0 {
            continue;
        }
        let coefficients = &lit.light[grid.index(cell)];
        let (along, bound) = brightness(coefficients, environment);
        let direction = off.normalize_or(DVec3::X);
        if bound > 0.0 && off.length() * bound < REACH * along(direction) {
            return (irradiance(coefficients, environment, direction), true);
        }
    }
    (DVec4::ZERO, false)
}

#[test]
fn faces_and_lobes_are_those_of_a_plain_march() {
    let gpu = &gpu();
    let scene: Scene = bundled("cornell");
    let lit = light(gpu, &scene, 10, SETTINGS);
    let constants = lit.scene.frame_constants(&scene.camera, SIZE);
    lit.scene.set_frame(gpu, &constants).unwrap();
    let grid = lit.cells.grid;
    let origin = (scene.camera.eye - grid.corner()).as_dvec3() / f64::from(grid.cell_size);
    let environment = scene.environment.uniform().as_dvec3();
    for has_lobes in [false, true] {
        let image = screen_image(gpu, "test.seen", SIZE).unwrap();
        let mut frame = Frame::new();
        frame.set_scene(&lit.scene.set, &lit.scene.materials);
        frame
            .pass(&VIEW)
            .bind("faces", &lit.cells.faces.words)
            .bind("light", &lit.cells.light.low)
            .bind("light_band2", lit.cells.light.bound_band2())
            .bind("seen", &image)
            .constant("LOBES", u32::from(has_lobes))
            .constant("HAS_BAND2", lit.cells.light.band2.is_some())
            .push(&ViewParams {
                grid: grid.row(0),
                scale: lit.cells.scale,
            })
            .dispatch(screen_groups(SIZE));
        gpu.submit(frame).unwrap();
        let found: Vec<glam::Vec4> =
            bytemuck::pod_collect_to_vec(&gpu.read_image(&image, 0, 0).unwrap());
        let (mut wrong, mut lobes) = (0, 0);
        for (found, ray) in found.iter().zip(pixel_rays(&constants, SIZE)) {
            let (expected, is_lobe) = seen(&lit, environment, (origin, ray), has_lobes);
            lobes += usize::from(is_lobe);
            let difference = (found.as_dvec4() - expected).abs().largest();
            // The march meets a lobe a step later, at a slightly other direction.
            wrong += usize::from(exceeds(difference, 0.02 * expected.largest() + 1e-6));
        }
        let all = found.len();
        println!("lobes {has_lobes}: {wrong} of {all} pixels differ; {lobes} see a lobe");
        assert!(found.iter().filter(|texel| texel.x > 0.0).count() > all / 2);
        // Edges of cells and outlines of lobes, which rays touch.
        assert!(wrong * 50 < all, "{wrong} of {all} pixels");
        assert_eq!(lobes > all / 10, has_lobes);
    }
}
