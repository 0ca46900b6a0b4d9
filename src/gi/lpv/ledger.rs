//! Where the light of all cells has gone, counted on the device beside the steps, in a run of its
//! own.

use std::sync::Arc;

use glam::{DVec3, DVec4};

use super::cells::{Cells, Propagation};
use super::grid::CellGrid;
use super::inject::flux_unit;
use super::lobes::{Lobes, PropagateParams};
use super::sweep::{Nesting, Sweep, SweepParams, Watch};
use crate::gi::inspect::Energy;
use crate::graph::{
    Access, BatchDispatch, Binding, Buffer, BufferDesc, BufferUsage, Error, Frame, Gpu, Image,
    Owner, Pass, Sets, Shaders,
};
use crate::render::GpuScene;
use crate::shader::GpuStruct;

/// Where the light of one step of the sweep goes. A thread a cell and octant.
pub static LEDGER: Pass = Pass {
    constants: &["SIDES", "KEEP"],
    ..Pass::compute(
        "lpv.ledger",
        "gi/lpv/ledger.comp",
        &[
            Binding::buffer("directions", Access::ComputeRead),
            Binding::image("order", Access::ComputeRead),
            Binding::image("sources", Access::ComputeRead),
            Binding::image("front", Access::ComputeRead),
            Binding::buffer("side_light", Access::ComputeRead),
            Binding::buffer("ledger", Access::ComputeReadWrite),
            Binding::image("source_faces", Access::ComputeRead),
        ],
        SweepParams::LAYOUT,
    )
};

/// Where the light goes that all cells send in one step as lobes. A thread a cell.
pub static LOBE_LEDGER: Pass = Pass {
    name: "lpv.lobe_ledger",
    shaders: Shaders::Compute("gi/lpv/lobe_ledger.comp"),
    bindings: &[
        Binding::buffer("faces", Access::ComputeRead),
        Binding::buffer("streams", Access::ComputeRead),
        Binding::sampled("blockers", Access::ComputeSampled),
        Binding::image("lobes", Access::ComputeRead),
        Binding::buffer("ledger", Access::ComputeReadWrite),
    ],
    constants: &["SCHEME", "OCCLUSION", "CLAMP", "LAST"],
    params: Some(PropagateParams::LAYOUT),
    sets: Sets::Scene,
};

/// Numbers of each thread: injected, entered, absorbed, left, on its way (`ENTRIES` in
/// `gi/lpv/ledger.comp`).
const ENTRIES: usize = 5;

/// Room for what each thread counts.
pub(super) fn room(gpu: &Gpu, threads: u32) -> Result<Arc<Buffer>, Error> {
    gpu.create_buffer(&BufferDesc {
        name: "lpv.ledger".into(),
        size_bytes: 16 * ENTRIES as u64 * u64::from(threads.max(1)),
        usage: BufferUsage::Storage,
        owner: Owner::Store,
    })
}

/// Adds the passes that sweep and count beside each step.
fn count_sweep(
    frame: &mut Frame,
    sweep: &Sweep,
    (cells, flux_unit): (&Cells, f32),
    ledger: &Arc<Buffer>,
) {
    let side_light = cells.faces.sides.as_ref().map(|sides| &sides.light);
    let mut count = |frame: &mut Frame, step: &[BatchDispatch]| {
        frame
            .pass(&LEDGER)
            .bind("directions", &sweep.list)
            .bind("order", &sweep.order)
            .bind("sources", &sweep.sources.vectors)
            .bind("source_faces", &sweep.sources.faces)
            .bind("front", &sweep.front)
            .bind("side_light", side_light.unwrap_or(&sweep.list))
            .bind("ledger", ledger)
            .constant("SIDES", side_light.is_some())
            .constant("KEEP", sweep.keeps)
            .dispatch_chain(step.to_vec());
    };
    sweep.run(
        frame,
        &cells.faces,
        (&cells.flux, flux_unit),
        (&cells.light, Nesting::default()),
        &mut Watch::Steps(&mut count),
    );
}

/// Adds the passes that hand lobes on and count beside them.
fn count_lobes(
    frame: &mut Frame,
    lobes: &Lobes,
    (cells, flux_unit): (&Cells, f32),
    ledger: &Arc<Buffer>,
) {
    let (grid, faces) = (&cells.grid, &cells.faces);
    lobes.seed(frame, faces, (&cells.flux, flux_unit));
    let last = lobes.settings.iterations + 1;
    for step in 1..=last {
        count_step(
            frame,
            lobes,
            (grid, &faces.words, cells.blocking()),
            step,
            ledger,
        );
        if step < last {
            lobes.steps(frame, (grid, &faces.words), step..=step, cells.blocking());
        }
    }
    lobes.finish(frame, grid, &cells.light);
}

fn count_step(
    frame: &mut Frame,
    lobes: &Lobes,
    (grid, faces, blockers): (&CellGrid, &Arc<Buffer>, &Arc<Image>),
    step: u32,
    ledger: &Arc<Buffer>,
) {
    let settings = lobes.settings;
    frame
        .pass(&LOBE_LEDGER)
        .bind("faces", faces)
        .bind("streams", &lobes.streams)
        .bind("blockers", blockers)
        .bind("lobes", &lobes.lobes)
        .bind("ledger", ledger)
        .constant("SCHEME", settings.scheme as u32)
        .constant("OCCLUSION", lobes.occlusion as u32)
        .constant("CLAMP", settings.clamp_negative)
        .constant("LAST", step > settings.iterations)
        .push(&PropagateParams {
            grid: grid.row(0),
            step,
            gain: settings.gain,
        })
        .dispatch(super::lobes::groups(grid));
}

/// Where the light of the last frame's last bounce has gone in one grid. `None` where nothing
/// counts it: in octrees, in slices, in steps of all cells along directions, in streams of more
/// bands.
pub fn energy(gpu: &Gpu, scene: &GpuScene, cells: &Cells) -> Result<Option<Energy>, Error> {
    let threads = match &*cells.propagation {
        Propagation::Sweep(sweep) => 8 * sweep.widest_step(),
        Propagation::Lobes(_) => cells.grid.count(),
        _ => return Ok(None),
    };
    let ledger = room(gpu, threads)?;
    let flux_unit = flux_unit(&scene.lights, &cells.grid) / cells.scale;
    let mut frame = Frame::new();
    frame.set_scene(&scene.set, &scene.materials);
    frame.fill("lpv.clear_ledger", &ledger, 0);
    match &*cells.propagation {
        Propagation::Sweep(sweep) => count_sweep(&mut frame, sweep, (cells, flux_unit), &ledger),
        Propagation::Lobes(lobes) => count_lobes(&mut frame, lobes, (cells, flux_unit), &ledger),
        _ => {}
    }
    gpu.submit(frame)?;
    let numbers: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&ledger)?);
    let mut sums = [DVec4::ZERO; ENTRIES];
    for (at, number) in numbers.into_iter().enumerate() {
        sums[at % ENTRIES] += DVec4::from(number.map(f64::from));
    }
    let face_m2 = f64::from(cells.grid.cell_size).powi(2);
    let (scale, environment) = (
        f64::from(cells.scale),
        scene.environment.radiance.as_dvec3(),
    );
    let watts = |sum: DVec4| -> DVec3 { face_m2 * (scale * sum.truncate() + sum.w * environment) };
    let [injected, entered, absorbed, left, on_its_way] = sums.map(watts);
    Ok(Some(Energy {
        injected,
        entered,
        absorbed,
        left,
        on_its_way,
    }))
}
