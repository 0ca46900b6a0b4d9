//! Technique `irradiance-probes`: a lattice of probes with octahedral maps of irradiance and of
//! the distances that they see (Majercik et al. 2019; Luo 2022, section 4.2).

use super::explore::explore;
use super::lattice::Lattice;
use super::lookup::{Lookup, gather};
use super::passes::{BLEND, BOUNCE, EXPLORE, GATHER, LIGHT, LookupRow, MOMENTS, TRACE};
use super::rays::ProbeRays;
use super::settings::{PRESETS, RULES, SETTINGS};
use super::snap::snap;
use super::volume::Volume;
use crate::gi::entry::{Entry, Stage};
use crate::gi::shared::paths::{self, PathScene};
use crate::gi::{Change, Context, Inputs, Inspect, MapNeeds, Needs, Settings, Technique};
use crate::graph::{Error, Frame, FrameStats, Gpu};
use crate::render::Receivers;
use crate::shader::GpuStruct;

/// The row of the registry.
pub static ENTRY: Entry = Entry {
    bounces: |settings| Some(settings.count("bounces")),
    settings: &[SETTINGS],
    rules: &[RULES],
    presets: PRESETS,
    passes: &[&[&EXPLORE, &TRACE, &MOMENTS, &LIGHT, &BOUNCE, &BLEND, &GATHER]],
    structs: &[paths::STRUCTS, &[("LookupRow", LookupRow::FIELDS)]],
    stages: &[
        &Stage::store("hierarchy", paths::HOST_PASSES),
        &Stage::store("placement", &["probes.explore"]),
        &Stage::store("tracing", &["probes.trace", "probes.moments"]),
        &Stage::store("lighting", &["probes.light", "probes.blend"]),
        &Stage::store("bounces", &["probes.bounce"]),
        &Stage::picture("gather", &["probes.gather"]),
    ],
    ..Entry::new(
        "irradiance-probes",
        "a lattice of probes that know the irradiance of every direction and what they see",
        make,
    )
};

fn make(_context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(IrradianceProbes {
        probes: settings.count("probes"),
        outer_layer: settings.number("outer_layer"),
        snap_distance: settings
            .is("placement", "snap")
            .then(|| settings.number("snap_distance")),
        rays: settings.count("rays"),
        texels: (
            settings.count("irradiance_texels"),
            settings
                .is("visibility", "moments")
                .then(|| settings.count("moment_texels")),
        ),
        uses_maps: settings.is("hit_light", "maps"),
        bounces: settings.count("bounces"),
        lookup: Lookup::new(settings),
        built: None,
    }))
}

struct Built {
    scene: PathScene,
    volume: Volume,
    rays: ProbeRays,
}

struct IrradianceProbes {
    probes: u32,
    outer_layer: f32,
    /// How far off surfaces probes are put (cells); `None`: they stay on the lattice.
    snap_distance: Option<f32>,
    rays: u32,
    /// Edges of maps of irradiance and, where look-ups ask for them, of distances (texels).
    texels: (u32, Option<u32>),
    uses_maps: bool,
    bounces: u32,
    lookup: Lookup,
    built: Option<Built>,
}

impl IrradianceProbes {
    /// Puts the probes where the scene needs them as it is, and finds out what they see.
    fn place(
        &self,
        &Context { gpu, scene, .. }: &Context<'_>,
        built: &Built,
    ) -> Result<FrameStats, Error> {
        let (lattice, triangles) = (&built.volume.lattice, &built.scene.rays);
        let mut stats = FrameStats::default();
        let places = match self.snap_distance {
            Some(distance) => {
                let (seen, explored) = explore(gpu, scene, triangles)?;
                stats.append(explored);
                snap(lattice, &seen, distance, self.lookup.normal_bias)
            }
            None => lattice.places().collect(),
        };
        built.volume.put(gpu, &places)?;
        let mut frame = Frame::new();
        frame.set_scene(&scene.set, &scene.materials);
        built.rays.trace(&mut frame, triangles, &built.volume);
        stats.append(gpu.submit(frame)?);
        Ok(stats)
    }
}

impl Technique for IrradianceProbes {
    fn needs(&self) -> Needs {
        Needs {
            maps: if self.uses_maps {
                MapNeeds::Shadows
            } else {
                MapNeeds::Direct
            },
            motion: false,
        }
    }

    fn build(&mut self, context: &Context<'_>) -> Result<FrameStats, Error> {
        self.built = None;
        let &Context { gpu, scene, .. } = context;
        let (own, mut stats) = PathScene::build(gpu, scene)?;
        let lattice = Lattice::within(scene.lit_bounds(), self.probes, self.outer_layer);
        let built = Built {
            scene: own,
            volume: Volume::new(gpu, lattice, self.texels, self.bounces)?,
            rays: ProbeRays::new(gpu, lattice.probe_count(), self.rays)?,
        };
        stats.append(self.place(context, &built)?);
        self.built = Some(built);
        Ok(stats)
    }

    fn follow(&mut self, context: &Context<'_>, change: Change) -> Result<FrameStats, Error> {
        if change != Change::Models {
            return Ok(FrameStats::default());
        }
        let Some(mut built) = self.built.take() else {
            return self.build(context);
        };
        let mut stats = built.scene.follow(context.gpu, context.scene)?;
        stats.append(self.place(context, &built)?);
        self.built = Some(built);
        Ok(stats)
    }

    fn update(&mut self, frame: &mut Frame, given: &Inputs<'_>) {
        if let Some(built) = &self.built {
            let how = (&self.lookup, self.bounces, self.uses_maps);
            built
                .rays
                .light(frame, given, &built.scene, &built.volume, how);
        }
    }

    fn gather(&mut self, frame: &mut Frame, _given: &Inputs<'_>, receivers: &Receivers<'_>) {
        let Some(built) = &self.built else { return };
        let maps = built.volume.lit(self.bounces);
        gather(frame, receivers, (&built.volume, maps), &self.lookup);
    }
}

impl Inspect for IrradianceProbes {
    fn counts(&self, _gpu: &Gpu) -> Result<Vec<(&'static str, u64)>, Error> {
        let Some(built) = &self.built else {
            return Ok(Vec::new());
        };
        let mut counts = built.scene.counts();
        counts.push(("probes", built.volume.lattice.probe_count().into()));
        Ok(counts)
    }
}
