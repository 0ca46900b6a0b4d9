//! Benchmarks with a camera that walks: what it costs to keep the structure around it.

use std::collections::BTreeMap;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::frame::Renderer;
use crate::gi::entry::{Entry, Part};
use crate::graph::{Error, FrameStats, PassTimes, Spread, TimesAccumulator};
use crate::scene::{Camera, Scene};
use crate::text::counted;

use super::draw::{Chart, LineAxis, LinePanel, Panels, Scale, Series};
use super::figures::notes;
use super::report::Report;
use super::stages::{When, part_ms, stage_times};
use super::table::case_name;

/// How the camera walks.
#[derive(Clone, Debug, PartialEq)]
pub struct WalkSettings {
    /// Finest cells of the technique that it moves in each frame; one walk each.
    pub speeds: Vec<f32>,
    /// Frames of each walk.
    pub frames: u32,
}

/// What the frames of one walk cost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WalkTimes {
    /// Finest cells that the camera moves in each frame.
    pub voxels_per_frame: f32,
    /// The same distance in metres.
    pub metres_per_frame: f32,
    /// Frames that the walk has.
    pub frames: usize,
    /// The world-space store in each frame: what follows the camera, and its light.
    pub update_ms: Spread,
    /// The same as a mean: some frames move more than others, and most may move nothing.
    pub mean_update_ms: f64,
    /// Mean of each stage of the store in a frame (ms).
    pub stages: BTreeMap<String, f64>,
    /// Each pass, of the frames in which it ran: their number is n.
    pub passes: Vec<PassTimes>,
}

/// Where the camera walks: along its view to the end of the scene, and back.
struct Path {
    camera: Camera,
    forward: Vec3,
    /// Length of the way there (m).
    reach: f32,
    /// Way that lies behind it (m).
    walked: f32,
}

impl Path {
    fn new(scene: &Scene, bounds: (Vec3, Vec3)) -> Self {
        let [_, _, forward] = scene.camera.basis();
        let (low, high) = bounds;
        let far = Vec3::select(forward.cmpgt(Vec3::ZERO), high, low);
        let way = (far - scene.camera.eye) / forward;
        let reach = way
            .to_array()
            .into_iter()
            .filter(|way| way.is_finite())
            .fold(f32::INFINITY, f32::min);
        Path {
            camera: scene.camera,
            forward,
            reach: if reach > 0.0 {
                reach
            } else {
                (high - low).length()
            },
            walked: 0.0,
        }
    }

    fn step(&mut self, step: f32) -> Camera {
        self.walked = (self.walked + step) % (2.0 * self.reach);
        let shift = self.forward * self.walked.min(2.0 * self.reach - self.walked);
        Camera {
            eye: self.camera.eye + shift,
            target: self.camera.target + shift,
            ..self.camera
        }
    }
}

/// Frames, and cells of each, before those that are measured, so that every pipeline is there and
/// what has to grow has grown.
const WARM_UP: [usize; 2] = [8, 8];

/// Walks at each speed, on from where the last walk ended. Nothing where the technique has no
/// cells.
pub fn walk(
    renderer: &mut Renderer<'_>,
    scene: &Scene,
    entry: &Entry,
    settings: &WalkSettings,
) -> Result<Vec<WalkTimes>, Error> {
    let (Some(cell_size), Some(bounds)) = (renderer.cell_size(), scene.bounds()) else {
        return Ok(Vec::new());
    };
    let mut path = Path::new(scene, bounds);
    let [frames, cells] = WARM_UP;
    (0..frames).try_for_each(|_| {
        renderer
            .render_again(&path.step(cells as f32 * cell_size))
            .map(drop)
    })?;
    let one = |cells: &f32| {
        let step = cells * cell_size;
        let runs = (0..settings.frames)
            .map(|_| renderer.render_again(&path.step(step)))
            .collect::<Result<Vec<FrameStats>, _>>()?;
        Ok(walk_times(entry, *cells, step, &runs))
    };
    settings
        .speeds
        .iter()
        .map(one)
        .filter_map(Result::transpose)
        .collect()
}

fn walk_times(
    entry: &Entry,
    voxels_per_frame: f32,
    metres_per_frame: f32,
    runs: &[FrameStats],
) -> Option<WalkTimes> {
    let update: Vec<f64> = runs
        .iter()
        .map(|run| part_ms(entry, run, Part::Store))
        .collect();
    let mean = |sum: f64| sum / runs.len() as f64;
    let mut stages = BTreeMap::new();
    for run in runs {
        for stage in stage_times(entry, When::Frame, std::slice::from_ref(run))
            .iter()
            .filter(|stage| stage.part == Some(Part::Store))
        {
            *stages.entry(stage.name.clone()).or_insert(0.0) += mean(stage.gpu_ms.median);
        }
    }
    let mut times = TimesAccumulator::default();
    runs.iter().for_each(|run| times.add(&run.passes));
    Some(WalkTimes {
        voxels_per_frame,
        metres_per_frame,
        frames: runs.len(),
        update_ms: Spread::of(&update)?,
        mean_update_ms: mean(update.iter().sum::<f64>() + 0.0),
        stages,
        passes: times.rows(),
    })
}

/// The stages of a build, as far as a report has them.
fn built(report: &Report) -> impl Iterator<Item = (&str, f64)> {
    report
        .stages
        .iter()
        .filter(|stage| stage.when == When::Build)
        .map(|stage| (stage.name.as_str(), stage.gpu_ms.median))
}

/// Mean time that a frame of a walk spends in the stages of a build (ms).
fn geometry_ms(report: &Report, walk: &WalkTimes) -> f64 {
    // A sum of nothing is −0.
    built(report)
        .filter_map(|(name, _)| walk.stages.get(name))
        .sum::<f64>()
        + 0.0
}

/// Time of those stages in a build (ms).
fn whole_ms(report: &Report) -> f64 {
    built(report).map(|(_, ms)| ms).sum()
}

/// Time of the store's stages in a frame with a camera that stands still (ms).
fn light_ms(report: &Report) -> f64 {
    report
        .stages
        .iter()
        .filter(|stage| stage.when == When::Frame && stage.part == Some(Part::Store))
        .map(|stage| stage.gpu_ms.median)
        .sum()
}

/// What each walk costs against building everything anew, a line each.
pub fn lines(report: &Report) -> Vec<String> {
    let whole = whole_ms(report);
    let line = |walk: &WalkTimes| {
        let geometry = geometry_ms(report, walk);
        format!(
            "  {:>6} cells a frame ({:.3} m): geometry {geometry:.2} ms, {:.2}% of building it \
             anew ({whole:.1} ms); whole update {:.2} ms (largest {:.2})",
            walk.voxels_per_frame,
            walk.metres_per_frame,
            100.0 * geometry / whole.max(f64::MIN_POSITIVE),
            walk.mean_update_ms,
            walk.update_ms.max
        )
    };
    report.walks.iter().map(line).collect()
}

/// Names and values of a row of comma-separated values.
pub(super) fn columns(report: &Report) -> Vec<(String, String)> {
    let columns = |walk: &WalkTimes| {
        let name = format!("walk {} voxels", walk.voxels_per_frame);
        let stages = walk
            .stages
            .iter()
            .map(|(stage, ms)| (format!("{name} {stage} mean ms"), ms.to_string()));
        let all = [
            ("geometry mean", geometry_ms(report, walk)),
            ("update mean", walk.mean_update_ms),
            ("update max", walk.update_ms.max),
        ];
        all.map(|(what, ms)| (format!("{name} {what} ms"), ms.to_string()))
            .into_iter()
            .chain(stages)
            .collect::<Vec<_>>()
    };
    report.walks.iter().flat_map(columns).collect()
}

/// Mean cost of a frame against the camera's speed, beside the cost of building and lighting
/// everything anew; `None` where no camera walked.
pub fn walk_chart(reports: &[Report]) -> Option<Chart> {
    let walked: Vec<&Report> = reports
        .iter()
        .filter(|report| report.walks.iter().any(|walk| walk.voxels_per_frame > 0.0))
        .collect();
    let first = walked.first()?;
    let panel = |y_label: &str, cost: fn(&Report, &WalkTimes) -> f64, whole: fn(&Report) -> f64| {
        let series = |report: &&Report| {
            let moving: Vec<&WalkTimes> = report
                .walks
                .iter()
                .filter(|walk| walk.voxels_per_frame > 0.0)
                .collect();
            let line = |y: &dyn Fn(&WalkTimes) -> f64| {
                let mut points: Vec<(f64, f64)> = moving
                    .iter()
                    .map(|walk| (f64::from(walk.voxels_per_frame), y(walk)))
                    .collect();
                points.sort_by(|a, b| a.0.total_cmp(&b.0));
                points
            };
            let (name, whole) = (case_name(report), whole(report));
            [
                Series {
                    name: name.clone(),
                    points: line(&|walk| cost(report, walk)),
                },
                Series {
                    name: format!("{name}, all anew"),
                    points: line(&|_| whole),
                },
            ]
        };
        LinePanel {
            y_label: y_label.into(),
            y_scale: Scale::Log,
            series: walked.iter().flat_map(series).collect(),
            floor: None,
        }
    };
    let panels = vec![
        panel(
            "geometry that follows the camera [ms a frame]",
            geometry_ms,
            whole_ms,
        ),
        panel(
            "store: geometry and light [ms a frame]",
            |_, walk| walk.mean_update_ms,
            |report| whole_ms(report) + light_ms(report),
        ),
    ];
    let frames = first.walks.first().map_or(0, |walk| walk.frames);
    let notes = notes(
        reports,
        first,
        &format!(
            "means of {} a point; what costs nothing is left out",
            counted(frames, "frame")
        ),
    );
    Some(Chart {
        title: format!("Time of a walk: {}", first.scene),
        notes,
        panels: Panels::Lines(LineAxis::doubling("speed [finest cells a frame]"), panels),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gi::registry::find;
    use crate::graph::PassTime;

    #[test]
    fn the_camera_turns_back_at_the_end_of_the_scene() {
        let camera = Camera {
            eye: Vec3::new(0.0, 0.0, 1.0),
            target: Vec3::ZERO,
            up: Vec3::Y,
            vfov_deg: 45.0,
        };
        let scene = Scene {
            camera,
            ..Scene::default()
        };
        let mut path = Path::new(&scene, (Vec3::splat(-2.0), Vec3::splat(2.0)));
        let eyes: Vec<f32> = (0..6).map(|_| path.step(2.0).eye.z).collect();
        assert_eq!(
            eyes,
            [-1.0, -1.0, 1.0, -1.0, -1.0, 1.0],
            "from 1 to −2 and back"
        );
    }

    /// A pass that runs in every fourth frame counts a quarter.
    #[test]
    fn means_are_over_all_frames() -> Result<(), Box<dyn std::error::Error>> {
        let pass = |name: &str, gpu_ms: f64| PassTime {
            name: name.to_owned(),
            gpu_ms,
            runs: 1,
        };
        let still = || FrameStats {
            passes: vec![pass("voxel.light", 2.0), pass("cone.gather", 100.0)],
            ..FrameStats::default()
        };
        let moved = FrameStats {
            passes: vec![pass("voxel.fragments", 8.0), pass("voxel.light", 2.0)],
            ..FrameStats::default()
        };
        let times = walk_times(
            find("clipmap")?,
            1.0,
            0.1,
            &[still(), moved, still(), still()],
        )
        .ok_or("no frames")?;
        assert_eq!(
            (
                times.mean_update_ms,
                times.update_ms.median,
                times.update_ms.max
            ),
            (4.0, 2.0, 10.0)
        );
        assert_eq!(
            times
                .stages
                .iter()
                .map(|(name, ms)| (name.as_str(), *ms))
                .collect::<Vec<_>>(),
            [("light injection", 2.0), ("voxelization", 2.0)]
        );
        assert_eq!(
            times
                .passes
                .iter()
                .map(|row| row.gpu_ms.n)
                .collect::<Vec<_>>(),
            [4, 3, 1]
        );
        Ok(())
    }
}
