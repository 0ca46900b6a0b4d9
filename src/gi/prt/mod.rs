//! Technique `prt`: precomputed radiance transfer (Sloan, Kautz & Snyder 2002). What light each
//! point of the scene's surfaces gets from each function of the environment is worked out once, on
//! the host. Then the environment may turn, grow brighter and be another, at the cost of one sum a
//! point; nothing may move.
//!
//! - [`lattice`]: the points.
//! - [`transfer`]: what light they get; [`build`] works it out by [`rays`] on the host,
//!   [`matrices`] for lobes; [`fill`] is for points without light of their own.
//! - [`compress`]: the same by clusters of points, in a fraction of the memory.
//! - [`cache`]: the same, kept on disk.
//! - [`lobes`]: which light comes from where, for what is glossy; [`rows`]: all of that in rows.
//! - [`light`]: the light, as one number for each of its functions; [`fold`]: bands of a sky above
//!   those that are kept.
//! - [`points`]: the transfer on the device; [`lit`]: its rows, and what they bring under a light.
//! - [`seen`]: what pixels see of points; [`glossy`]: what they mirror; [`view`]: what of transfer.

pub mod build;
pub mod cache;
pub mod compress;
pub mod fill;
pub mod fold;
pub mod glossy;
pub mod lattice;
mod left_out;
pub mod light;
pub mod lit;
pub mod lobes;
pub mod matrices;
pub mod points;
pub mod rays;
pub mod rows;
pub mod seen;
mod settings;
pub mod transfer;
pub mod view;

pub use glossy::{BUMPS, CELLS, GATHER_GLOSSY};
pub use lit::{
    CompressedLightParams, LIGHT_CLUSTERS, LIGHT_COMPRESSED, LIGHT_LOBES, LIGHT_POINTS,
    PointLightParams,
};
pub use seen::{GATHER, MARKS, POINTS};
pub use settings::transfer_settings;
pub use view::{LOBES_VIEW, LobesViewParams, VIEW};

use std::sync::Arc;

use super::entry::{Entry, Stage};
use super::inspect::ViewRow;
use super::{Change, Context, Inputs, Inspect, MapNeeds, Needs, Settings, Technique};
use crate::graph::{Error, Frame, FrameStats, Gpu, Image};
use crate::render::{GBuffer, GpuScene, Receivers};
use crate::scene::{Light, Scene};
use glossy::Glossy;
use left_out::{warn_of_mirrors, warn_of_vectors};
use light::Lights;
use points::Points;
use seen::Seen;
use settings::{PRESETS, RULES, SETTINGS};
use transfer::{Transfer, TransferSettings, unit_light};

/// The work of the host, as a pass ([`FrameStats::of_host`]).
const BUILD: &str = "prt.build";

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    bounces: |settings| Some(settings.count("bounces")),
    settings: &[SETTINGS],
    rules: &[RULES],
    presets: PRESETS,
    passes: &[&[
        &LIGHT_POINTS,
        &LIGHT_CLUSTERS,
        &LIGHT_COMPRESSED,
        &LIGHT_LOBES,
        &POINTS,
        &GATHER,
        &CELLS,
        &GATHER_GLOSSY,
        &BUMPS,
        &MARKS,
        &VIEW,
        &LOBES_VIEW,
    ]],
    views: &[&view::VIEWS],
    stages: &[
        &Stage::store("transfer", &[BUILD]),
        &Stage::store(
            "light of points",
            &[
                "prt.light_clusters",
                "prt.light_compressed",
                "prt.light_points",
                "prt.light_lobes",
            ],
        ),
        &Stage::picture("gather", &["prt.points", "prt.gather", "prt.bumps"]),
        &Stage::picture("specular", &["prt.cells", "prt.gather_glossy"]),
    ],
    ..Entry::new(
        "prt",
        "precomputed radiance transfer: skies that turn over a scene that stands still",
        make,
    )
};

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(Prt::new(context, settings)?))
}

struct Prt {
    transfer: TransferSettings,
    clamps: bool,
    points_max: u64,
    lights: Lights,
    /// Skies are kept as surfaces see them, not as harmonics of the whole sphere.
    fits_seen: bool,
    seen: Seen,
    /// Where something is glossy or bumped, and transfer is a matrix.
    glossy: Option<Glossy>,
    built: Option<Built>,
}

/// What a build leaves.
struct Built {
    /// Kept where lights have columns, which are worked out anew when lights move.
    transfer: Option<Transfer>,
    /// The lights of those columns.
    lights: Vec<Light>,
    points: Points,
    counts: Vec<(&'static str, u64)>,
    /// The light that points have is not that of the scene.
    is_stale: bool,
}

impl Prt {
    fn new(context: &Context<'_>, settings: &Settings) -> Result<Self, Error> {
        let &Context { gpu, scene, .. } = context;
        let refused = |problem: String, hint: &str| Error::Unsuited {
            technique: ENTRY.name,
            problem,
            hint: hint.to_owned(),
        };
        if let Some(model) = scene.host.models.iter().find(|model| model.dynamic) {
            let moves = format!("the model {} may move", model.name);
            if settings.is("dynamic", "error") {
                let hint = "`dynamic=freeze` lights it where it stands at first";
                return Err(refused(moves, hint));
            }
            log::warn!("prt: {moves}; its light stays as it is at first");
        }
        if settings.is("lights", "ignore") && (scene.is_emissive || !scene.lights.is_empty()) {
            let emission = if scene.is_emissive {
                " and what emits"
            } else {
                ""
            };
            let count = scene.lights.len();
            log::warn!("prt: lights=ignore leaves out {count} lights{emission}");
        }
        let transfer = transfer_settings(settings, scene);
        let clamps = settings.is("negative", "clamp");
        match transfer.lobes {
            None => warn_of_vectors(scene),
            Some(lobes) => warn_of_mirrors(scene, lobes, context.size),
        }
        let glossy = (transfer.lobes)
            .map(|lobes| Glossy::new(gpu, scene, context.size, (lobes, clamps)))
            .transpose()?;
        Ok(Prt {
            transfer,
            clamps,
            glossy,
            points_max: settings.count("points_max").into(),
            lights: Lights::new(settings),
            fits_seen: settings.is("fit", "seen"),
            seen: Seen::new(gpu, scene, context.size)?,
            built: None,
        })
    }

    /// Columns of lights that have moved are worked out anew; how bright they are is no matter.
    fn follow_lights(
        &mut self,
        &Context { gpu, scene, .. }: &Context<'_>,
    ) -> Result<FrameStats, Error> {
        let begin = std::time::Instant::now();
        let lights: Vec<Light> = scene.lights.iter().map(unit_light).collect();
        let Some(built) = &mut self.built else {
            return Ok(FrameStats::default());
        };
        let moved: Vec<usize> = (0..lights.len())
            .filter(|at| built.lights.get(*at) != Some(&lights[*at]))
            .collect();
        let Some(transfer) = built.transfer.as_mut().filter(|_| !moved.is_empty()) else {
            return Ok(FrameStats::default());
        };
        let progress = |what, share| gpu.tell(what, share);
        transfer.move_lights(&lit_scene(scene), self.transfer, &moved, &progress);
        built.points = Points::new(gpu, transfer)?;
        (built.lights, built.is_stale) = (lights, true);
        Ok(FrameStats::of_host(BUILD, begin))
    }

    /// More points than are wanted, or than memory holds, are an error before any is worked out.
    fn check_count(&self, gpu: &Gpu, scene: &GpuScene) -> Result<(), Error> {
        let most = self.points_max;
        let cell_m = self.transfer.lattice.cell_m;
        let count = |cell_m| lattice::count_nodes(&scene.host, cell_m);
        let nodes = count(cell_m);
        if nodes <= most {
            return self.check_matrices(gpu, scene, nodes);
        }
        let (low, high) = scene.bounds;
        let extent_m = (high - low).max_element();
        let mut cells = (extent_m / cell_m).round() as u32;
        while cells > 1 && count(extent_m / cells as f32) > most {
            cells = (0.9 * cells as f32) as u32;
        }
        let fits = count(extent_m / cells as f32) <= most;
        Err(Error::Unsuited {
            technique: ENTRY.name,
            problem: format!("the lattice has {nodes} nodes, more than points_max={most}"),
            hint: if fits {
                format!("`cells={cells}` fits, or a larger `points_max`")
            } else {
                format!(
                    "the corners of the triangles alone are {}: give a larger `points_max`",
                    count(f32::INFINITY)
                )
            },
        })
    }

    /// The radiance above points is in one buffer, their matrices are in the host's memory.
    fn check_matrices(&self, gpu: &Gpu, scene: &GpuScene, nodes: u64) -> Result<(), Error> {
        /// Of matrices that are not compressed.
        const MOST_BYTES: u64 = 4 << 30;
        let Some(lobes) = self.transfer.lobes else {
            return Ok(());
        };
        let outputs = u64::from(lobes.order * lobes.order);
        let harmonics = u64::from(self.transfer.order * self.transfer.order);
        let in_buffer = gpu.limits().storage_buffer_bytes / (16 * outputs);
        let in_memory = match self.transfer.compress {
            Some(_) => u64::MAX,
            None => MOST_BYTES / (12 * outputs * harmonics),
        };
        let most = in_buffer.min(in_memory);
        // Each node has two sides at most; finding which are one point takes a while.
        if 2 * nodes <= most {
            return Ok(());
        }
        let points = transfer::count_points(&scene.host, self.transfer);
        if points <= most {
            return Ok(());
        }
        let need = "larger cells (fewer `cells`) and a smaller `out_order` need less";
        Err(Error::Unsuited {
            technique: ENTRY.name,
            problem: format!(
                "the lattice has {points} points, and memory holds the matrices of {most} \
                 (transfer=matrix)"
            ),
            hint: match in_memory < in_buffer {
                true => format!("`compress=cpca` holds more; {need}"),
                false => need.to_owned(),
            },
        })
    }
}

/// The scene on the host, with its lights where they are now.
fn lit_scene(scene: &GpuScene) -> Scene {
    let mut host = (*scene.host).clone();
    host.lights.clone_from(&scene.lights);
    host
}

impl Technique for Prt {
    fn needs(&self) -> Needs {
        Needs::maps(MapNeeds::Direct)
    }

    fn build(&mut self, &Context { gpu, scene, .. }: &Context<'_>) -> Result<FrameStats, Error> {
        self.built = None;
        self.check_count(gpu, scene)?;
        let begin = std::time::Instant::now();
        let host = lit_scene(scene);
        let progress = |what, share| gpu.tell(what, share);
        let transfer = match gpu.cache_dir() {
            Some(folder) => Transfer::kept(&host, self.transfer, folder, &progress),
            None => Transfer::new(&host, self.transfer, &progress),
        };
        let points = Points::new(gpu, &transfer)?;
        let folded = self.fits_seen.then(|| transfer.folded.clone());
        self.lights.set_folded(folded);
        let counts = vec![
            ("prt_points", transfer.lattice.points.len() as u64),
            ("prt_points_filled", transfer.filled.into()),
            ("prt_functions", transfer.irradiance.functions.into()),
        ];
        let has_columns = self.transfer.has_lights && !scene.lights.is_empty();
        self.built = Some(Built {
            transfer: has_columns.then_some(transfer),
            lights: scene.lights.iter().map(unit_light).collect(),
            points,
            counts,
            is_stale: true,
        });
        Ok(FrameStats::of_host(BUILD, begin))
    }

    fn follow(&mut self, context: &Context<'_>, change: Change) -> Result<FrameStats, Error> {
        match change {
            // Frozen models stay where they were.
            Change::Models => Ok(FrameStats::default()),
            Change::Lights => self.follow_lights(context),
            Change::Camera => {
                if let Some(built) = &mut self.built {
                    let wanted = self.lights.of(context.scene, &self.transfer);
                    if let Some(light) = wanted {
                        built.points.set_light(context.gpu, &light)?;
                        built.is_stale = true;
                    } else if built.is_stale {
                        let light = self.lights.now();
                        built.points.set_light(context.gpu, light)?;
                    }
                }
                Ok(FrameStats::default())
            }
        }
    }

    fn update(&mut self, frame: &mut Frame, _given: &Inputs<'_>) {
        if let Some(built) = self.built.as_mut().filter(|built| built.is_stale) {
            built.points.light(frame);
            built.is_stale = false;
        }
    }

    fn gather(&mut self, frame: &mut Frame, given: &Inputs<'_>, receivers: &Receivers<'_>) {
        let Some(built) = &self.built else { return };
        let size = given.gbuffer.size;
        self.seen.draw(frame, &built.points, size, self.clamps);
        self.seen.gather(frame, receivers);
        if let Some(glossy) = &self.glossy {
            glossy.draw(frame, (&built.points, &self.seen), size);
        }
    }

    fn adds_apart(&self) -> bool {
        self.glossy.as_ref().is_some_and(Glossy::has_bumps)
    }

    fn add_apart(&mut self, frame: &mut Frame, given: &Inputs<'_>, diffuse: &Arc<Image>) {
        if let (Some(glossy), Some(built)) = (&self.glossy, &self.built) {
            glossy.add_bumps(frame, &built.points, (given, diffuse));
        }
    }

    fn mirror(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> Option<Arc<Image>> {
        let (glossy, built) = (self.glossy.as_ref()?, self.built.as_ref()?);
        glossy.mirror(frame, &built.points, given)
    }
}

impl Inspect for Prt {
    fn counts(&self, _gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let built = self.built.as_ref();
        Ok(built.map(|built| built.counts.clone()).unwrap_or_default())
    }

    fn levels(&self, view: &ViewRow) -> u32 {
        let built = self.built.as_ref();
        built.map_or(0, |built| {
            view::levels(view, &built.points, self.transfer.order)
        })
    }

    fn draw_view(
        &self,
        frame: &mut Frame,
        view: (&ViewRow, u32),
        gbuffer: &GBuffer,
        seen: &Arc<Image>,
    ) {
        if let Some(built) = &self.built {
            view::draw(
                frame,
                view,
                (&built.points, &self.seen, self.transfer.order),
                (gbuffer.size, seen),
            );
        }
    }
}
