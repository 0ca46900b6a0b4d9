//! Frames a second, where the host waits for each frame and where it does not.

use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::bench::{BenchSettings, Case, warm_up_frames};
use super::report::{Report, Timing};
use crate::frame::Renderer;
use crate::graph::{Error, FRAMES_IN_FLIGHT};
use crate::scene::Scene;

/// How often frames that are waited for and frames that are not have their turns.
const ROUNDS: u32 = 4;

/// Frames a second by the host's clock, each made anew as `passes` are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Throughput {
    /// For so long each was measured (s).
    pub seconds: f64,
    /// Each frame is waited for before the next is recorded.
    pub waited: f64,
    /// So many frames may run while the next is recorded.
    pub in_flight: u32,
    /// Frames a second then.
    pub ahead: f64,
}

/// Renders frames for so long, on a device of its own whose passes are not timed one by one.
pub(super) fn throughput(
    scene: &Scene,
    case: &Case,
    settings: &BenchSettings,
    budget: Duration,
) -> Result<Throughput, Error> {
    let gpu = super::bench::open(&settings.gpu, Timing::Timestamps)?;
    let (mut renderer, _) = Renderer::new(&gpu, scene, case.entry, &case.settings, settings.frame)?;
    for _ in 0..warm_up_frames(case) {
        renderer.render(&scene.camera)?;
    }
    let mut timed = |is_ahead: bool| -> Result<[f64; 2], Error> {
        let began = Instant::now();
        let mut frames = 0.0;
        while frames == 0.0 || began.elapsed() < budget / ROUNDS {
            if is_ahead {
                renderer.render_ahead(&scene.camera)?;
            } else {
                renderer.render(&scene.camera)?;
            }
            frames += 1.0;
        }
        gpu.finish()?;
        Ok([frames, began.elapsed().as_secs_f64()])
    };
    let mut sums = [[0.0; 2]; 2];
    for _ in 0..ROUNDS {
        for (is_ahead, [frames, seconds]) in [false, true].into_iter().zip(&mut sums) {
            let [more_frames, more_seconds] = timed(is_ahead)?;
            *frames += more_frames;
            *seconds += more_seconds;
        }
    }
    let [waited, ahead] = sums.map(|[frames, seconds]| frames / seconds);
    Ok(Throughput {
        seconds: budget.as_secs_f64(),
        waited,
        in_flight: FRAMES_IN_FLIGHT as u32,
        ahead,
    })
}

/// The line below a case's row in the table; empty where it was not measured.
pub fn lines(report: &Report) -> Vec<String> {
    let line = |row: &Throughput| {
        format!(
            "  frames a second: {:.1} one after the other, {:.1} with {} in flight ({:.2} times)",
            row.waited,
            row.ahead,
            row.in_flight,
            row.ahead / row.waited
        )
    };
    report.throughput.iter().map(line).collect()
}
