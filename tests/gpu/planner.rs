//! What every frame really records, played through the brute-force model of the planner's test:
//! each hazard has its barrier, atomic writers' too, which synchronization validation does not see;
//! no barrier is spare; and commands reach what their pass declares, no more and no other.

use std::collections::HashSet;

use crate::support::given::GIVEN;
use crate::support::hazards::Stream;
use crate::support::motion::WITH_MOTION;
use crate::support::octree::light_in_pieces;
use crate::support::passes::{COPY, DOUBLE, TEST_PASSES, all_passes};
use crate::support::scenes::bundled;
use crate::support::technique::{
    Case, Surfaces, cases, frame, moving_room, small_lights, small_room, walked,
};
use crate::support::{Missing, gpu, own_gpu, skipped, words};
use glam::Vec3;
use lumivox::frame::Renderer;
use lumivox::gi::entry::Entry;
use lumivox::gi::inspect::BeamAxis;
use lumivox::gi::registry::find;
use lumivox::gi::shared::voxel::{FRAGMENTS_RASTER, FRAGMENTS_RASTER_HW};
use lumivox::graph::{
    Error, Features, Frame, Gpu, GpuOptions, ImageDesc, ImageKind, ImageUsage, Issued,
    JournalFrame, Owner, Pass, vk,
};
use lumivox::image::Aov;
use lumivox::render::{SurfaceChannel, Terms, screen_image};
use lumivox::scene::{Light, Scene, Specular};

/// Plays what was recorded since the last time, and answers it.
fn judge(what: &str, gpu: &Gpu) -> Vec<JournalFrame> {
    let journal = gpu.take_journal();
    let stream = Stream::recorded(&journal).unwrap_or_else(|error| panic!("{what}: {error}"));
    assert!(
        stream.barriers().len() > 10,
        "{what}: the frames need barriers"
    );
    assert_eq!(stream.verify(), Ok(()), "{what}");
    assert_eq!(stream.spare_barrier(), None, "{what}");
    journal
}

/// Uploads, voxelization and two frames of every technique with every preset, over all kinds of
/// surfaces.
#[test]
fn every_hazard_of_every_preset_is_covered() {
    let gpu = gpu();
    let [(_, point), ..] = small_lights();
    for case in cases() {
        for surfaces in Surfaces::ALL {
            gpu.take_journal();
            let scene = small_room(surfaces, vec![point]);
            let settings = case.settings(&[("resolution", case.smallest_resolution())]);
            let (mut renderer, _) =
                Renderer::new(&gpu, &scene, case.entry, &settings, frame(16, 8, 32)).unwrap();
            renderer.render(&scene.camera).unwrap();
            renderer.render(&scene.camera).unwrap();
            judge(&format!("{}, {surfaces:?}", case.name()), &gpu);
        }
    }
}

/// The same with every preset while models move.
#[test]
fn every_hazard_of_moving_models_is_covered() {
    let gpu = gpu();
    let (_, light) = small_lights()[0];
    for case in cases() {
        gpu.take_journal();
        let mut scene = moving_room(Surfaces::Emissive, light);
        let (mut renderer, _) = Renderer::new(
            &gpu,
            &scene,
            case.entry,
            &case.settings(&[("resolution", "16")]),
            frame(16, 8, 32),
        )
        .unwrap();
        for time_s in [1.0, 2.0, 0.5] {
            scene.set_time(time_s);
            renderer.set_pose(&scene).unwrap();
            renderer.render(&scene.camera).unwrap();
        }
        judge(&case.name(), &gpu);
    }
}

/// The same of rays by the device, through acceleration structures that follow the models.
#[test]
fn every_hazard_of_rays_by_the_device_is_covered() {
    let has_queries = gpu().features().ray_query;
    if !has_queries {
        skipped(&Missing::Other("VK_KHR_ray_query"));
        return;
    }
    let gpu = own_gpu(&GpuOptions {
        device_rays: Some(true),
        ..GpuOptions::default()
    });
    let (_, light) = small_lights()[0];
    let traces = |case: &Case| {
        let mut passes = case.entry.passes.iter().copied().flatten();
        passes.any(|pass| pass.traces())
    };
    for case in cases().into_iter().filter(traces) {
        gpu.take_journal();
        let mut scene = moving_room(Surfaces::Glossy, light);
        let settings = case.settings(&[("resolution", "16")]);
        let (mut renderer, _) =
            Renderer::new(&gpu, &scene, case.entry, &settings, frame(16, 8, 32)).unwrap();
        for time_s in [1.0, 2.0] {
            scene.set_time(time_s);
            renderer.set_pose(&scene).unwrap();
            renderer.render(&scene.camera).unwrap();
        }
        judge(&case.name(), &gpu);
    }
}

/// A technique with settings that no preset has, in a scene with some surfaces.
struct Life {
    technique: &'static str,
    preset: Option<&'static str>,
    pairs: &'static [(&'static str, &'static str)],
    surfaces: Surfaces,
}

/// Few, which run every pass of every technique between them.
const LIVES: [Life; 64] = [
    Life {
        technique: "voxel-mips",
        preset: Some("cones"),
        pairs: &[("surface", "solid")],
        surfaces: Surfaces::Diffuse,
    },
    Life {
        technique: "clipmap",
        preset: Some("cones"),
        pairs: &[("surface", "solid"), ("resolution", "16")],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "prt",
        preset: Some("glossy"),
        pairs: &[
            ("cells", "4"),
            ("order", "3"),
            ("transfer_rays", "64"),
            ("compress", "none"),
        ],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "prt",
        preset: Some("glossy"),
        pairs: &[
            ("cells", "4"),
            ("order", "3"),
            ("transfer_rays", "64"),
            ("clusters", "3"),
            ("basis", "2"),
        ],
        surfaces: Surfaces::Bumped,
    },
    Life {
        technique: "prt",
        preset: Some("compressed"),
        pairs: &[
            ("cells", "4"),
            ("order", "3"),
            ("transfer_rays", "64"),
            ("clusters", "3"),
            ("basis", "2"),
        ],
        surfaces: Surfaces::Masked,
    },
    Life {
        technique: "prt",
        preset: Some("fast"),
        pairs: &[("cells", "4"), ("transfer_rays", "64")],
        surfaces: Surfaces::Masked,
    },
    Life {
        technique: "probe-cascades",
        preset: Some("default"),
        pairs: &[
            ("probes", "4"),
            ("rays", "32"),
            ("bounces", "2"),
            ("specular", "prefiltered"),
            ("reflection_probes", "3"),
            ("radiance_texels", "16"),
        ],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "light-field-probes",
        preset: Some("default"),
        pairs: &[
            ("probes", "3"),
            ("radiance_texels", "16"),
            ("specular", "cones"),
            ("source_resolution", "16"),
        ],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "irradiance-probes",
        preset: Some("default"),
        pairs: &[
            ("probes", "4"),
            ("rays", "32"),
            ("source", "raster"),
            ("raster_texels", "8"),
            ("specular", "prefiltered"),
            ("reflection_probes", "3"),
            ("radiance_texels", "16"),
        ],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "irradiance-probes",
        preset: Some("default"),
        pairs: &[
            ("probes", "4"),
            ("rays", "32"),
            ("source", "store"),
            ("store", "dense"),
            ("source_resolution", "16"),
            ("specular", "cones"),
        ],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "irradiance-probes",
        preset: Some("default"),
        pairs: &[
            ("probes", "4"),
            ("rays", "32"),
            ("source", "store"),
            ("store", "sparse"),
            ("source_resolution", "16"),
            ("bounces", "feedback"),
        ],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "probe-cascades",
        preset: Some("default"),
        pairs: &[
            ("probes", "4"),
            ("rays", "32"),
            ("source", "store"),
            ("store", "nested"),
            ("source_resolution", "16"),
        ],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "light-field-probes",
        preset: Some("default"),
        pairs: &[
            ("probes", "3"),
            ("radiance_texels", "16"),
            ("specular", "prefiltered"),
        ],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "irradiance-probes",
        preset: Some("default"),
        pairs: &[
            ("probes", "4"),
            ("rays", "32"),
            ("source", "voxels"),
            ("source_resolution", "16"),
            ("bounces", "2"),
        ],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "irradiance-probes",
        preset: Some("fast"),
        pairs: &[
            ("probes", "4"),
            ("source", "voxels"),
            ("source_resolution", "16"),
            ("trace", "each-frame"),
        ],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "probe-cascades",
        preset: Some("default"),
        pairs: &[
            ("probes", "4"),
            ("rays", "32"),
            ("bounces", "feedback"),
            ("irradiance", "oct"),
            ("probes_per_frame", "20"),
        ],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "probe-cascades",
        preset: Some("accurate"),
        pairs: &[("probes", "4"), ("moment_filter", "power")],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "light-field-probes",
        preset: Some("textbook"),
        pairs: &[
            ("probes", "3"),
            ("radiance_texels", "16"),
            ("rays", "2"),
            ("mirror_rays", "2"),
            ("placement", "snap"),
            ("bounces", "3"),
        ],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "light-field-probes",
        preset: Some("default"),
        pairs: &[
            ("probes", "3"),
            ("radiance_texels", "16"),
            ("rays", "2"),
            ("bounces", "feedback"),
        ],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "irradiance-probes",
        preset: Some("accurate"),
        pairs: &[
            ("probes", "4"),
            ("rays", "32"),
            ("bounces", "3"),
            ("visibility", "rays"),
            ("gradient", "on"),
        ],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "irradiance-probes",
        preset: Some("fast"),
        pairs: &[("probes", "4"), ("bounces", "2"), ("irradiance", "sh2")],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "irradiance-probes",
        preset: Some("textbook"),
        pairs: &[("probes", "4"), ("rays", "32"), ("bounces", "feedback")],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "ray-traced",
        preset: Some("cached"),
        pairs: &[("rays", "2"), ("mirror_rays", "2")],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "voxel-mips",
        preset: Some("triangles"),
        pairs: &[("injection", "voxel"), ("voxel_occlusion", "triangles")],
        surfaces: Surfaces::Diffuse,
    },
    Life {
        technique: "voxel-mips",
        preset: Some("triangles"),
        pairs: &[("injection", "voxel"), ("voxel_occlusion", "triangles")],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "ray-traced",
        preset: Some("default"),
        pairs: &[("rays", "2"), ("mirror_rays", "2"), ("bounces", "2")],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "ray-traced",
        preset: Some("fast"),
        pairs: &[("bounces", "2")],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "voxel-mips",
        preset: Some("fast"),
        pairs: &[
            ("gather_scale", "2"),
            ("interleave_order", "split"),
            ("specular_interleave", "2"),
        ],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "none",
        preset: None,
        pairs: &[],
        surfaces: Surfaces::Diffuse,
    },
    Life {
        technique: "lpv",
        preset: Some("accurate"),
        pairs: &[],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "lpv",
        preset: Some("accurate"),
        pairs: &[("source", "faces"), ("bounces", "2")],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "lpv",
        preset: Some("best"),
        pairs: &[
            ("bounces", "2"),
            ("history", "8"),
            ("gather_scale", "4"),
            ("blur", "a-trous"),
        ],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "lpv",
        preset: Some("accurate"),
        pairs: &[
            ("scheme", "slices"),
            ("bounces", "3"),
            ("bounce_change", "0.1"),
        ],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "lpv",
        preset: Some("accurate"),
        pairs: &[("schedule", "jacobi"), ("bounces", "2")],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "lpv",
        preset: Some("textbook"),
        pairs: &[],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "lpv-cascaded",
        preset: Some("accurate"),
        pairs: &[("cell_size", "0.03"), ("bounces", "2")],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "lpv-cascaded",
        preset: Some("accurate"),
        pairs: &[("cell_size", "0.03"), ("source", "rsm")],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "lpv",
        preset: Some("textbook"),
        pairs: &[("blocker_layers", "3"), ("bounces", "2")],
        surfaces: Surfaces::Masked,
    },
    Life {
        technique: "lpv-cascaded",
        preset: Some("textbook"),
        pairs: &[("cell_size", "0.03"), ("blocker_layers", "2")],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "lpv-cascaded",
        preset: Some("textbook"),
        pairs: &[("cell_size", "0.03")],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "lpv-octree",
        preset: Some("accurate"),
        pairs: &[],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "lpv-octree",
        preset: Some("accurate"),
        pairs: &[("source", "faces"), ("bounces", "2")],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "lpv-octree",
        preset: Some("textbook"),
        pairs: &[],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "lpv-octree",
        preset: Some("textbook"),
        pairs: &[
            ("transfer", "residual"),
            ("occlusion", "faces"),
            ("bounces", "2"),
        ],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "lpv",
        preset: Some("textbook"),
        pairs: &[
            ("propagation", "stream"),
            ("occlusion", "faces"),
            ("bounces", "2"),
        ],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "lpv-cascaded",
        preset: Some("textbook"),
        pairs: &[
            ("cell_size", "0.03"),
            ("propagation", "stream"),
            ("bands", "4"),
            ("bounces", "2"),
        ],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "gtao",
        preset: None,
        pairs: &[],
        surfaces: Surfaces::Diffuse,
    },
    Life {
        technique: "voxel-mips",
        preset: Some("cones"),
        pairs: &[
            ("shadows", "cones"),
            ("bounces", "2"),
            ("occlusion_cones", "2"),
            ("obscured_diffuse", "on"),
            ("voxelization", "raster"),
        ],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "voxel-mips",
        preset: Some("accurate"),
        pairs: &[
            ("bounces", "2"),
            ("injection", "voxel"),
            ("voxel_occlusion", "rays-hard"),
        ],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "voxel-mips",
        preset: Some("accurate"),
        pairs: &[("bounces", "2")],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "voxel-mips",
        preset: Some("textbook"),
        pairs: &[
            ("mip_method", "blit"),
            ("accumulation", "running-average"),
            ("bounces", "feedback"),
            ("normals", "harmonics"),
        ],
        surfaces: Surfaces::Masked,
    },
    Life {
        technique: "voxel-mips",
        preset: Some("cones"),
        pairs: &[("voxelization", "raster-hw"), ("normals", "toksvig")],
        surfaces: Surfaces::Masked,
    },
    Life {
        technique: "svo",
        preset: Some("cones"),
        pairs: &[
            ("shadows", "cones"),
            ("bounces", "2"),
            ("occlusion_cones", "2"),
            ("obscured_diffuse", "on"),
            ("attributes", "on"),
            ("normals", "toksvig"),
        ],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "svo",
        preset: Some("textbook"),
        pairs: &[
            ("bounces", "feedback"),
            ("accumulation", "running-average"),
            ("filter", "all"),
        ],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "svo",
        preset: Some("directional"),
        pairs: &[("shadows", "cones"), ("injection", "voxel")],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "svo",
        preset: Some("accurate"),
        pairs: &[("bounces", "2")],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "svo",
        preset: Some("accurate"),
        pairs: &[("bounces", "2")],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "clipmap",
        preset: Some("accurate"),
        pairs: &[("levels", "3"), ("voxel_size", "0.06"), ("bounces", "2")],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "svo",
        preset: Some("triangles"),
        pairs: &[("bounces", "2")],
        surfaces: Surfaces::Masked,
    },
    Life {
        technique: "voxel-mips",
        preset: Some("triangles"),
        pairs: &[("bounces", "2")],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "clipmap",
        preset: Some("accurate"),
        pairs: &[("levels", "3"), ("voxel_size", "0.06"), ("bounces", "2")],
        surfaces: Surfaces::Glossy,
    },
    Life {
        technique: "clipmap",
        preset: Some("triangles"),
        pairs: &[("levels", "3"), ("voxel_size", "0.06"), ("bounces", "2")],
        surfaces: Surfaces::Diffuse,
    },
    Life {
        technique: "clipmap",
        preset: Some("cones"),
        pairs: &[
            ("levels", "3"),
            ("voxel_size", "0.06"),
            ("shadows", "cones"),
            ("bounces", "2"),
            ("occlusion_cones", "2"),
            ("obscured_diffuse", "on"),
        ],
        surfaces: Surfaces::Emissive,
    },
    Life {
        technique: "clipmap",
        preset: Some("anisotropic"),
        pairs: &[
            ("levels", "3"),
            ("voxel_size", "0.06"),
            ("level_updates", "staggered"),
            ("bounces", "feedback"),
            ("accumulation", "running-average"),
        ],
        surfaces: Surfaces::Glossy,
    },
];

const GLOSS: Specular = Specular {
    f0: Vec3::splat(0.5),
    roughness: 0.3,
    metalness: 0.0,
    texture: None,
};

impl Life {
    fn case(&self) -> Case {
        Case {
            entry: find(self.technique).unwrap(),
            preset: self.preset,
        }
    }

    /// A moving model, a light of each kind; what emits is glossy too.
    fn scene(&self) -> Scene {
        let [(_, point), (_, spot), (_, directional)] = small_lights();
        let mut scene = moving_room(self.surfaces, point);
        scene.lights = vec![point, spot, directional];
        if self.technique == "svo" {
            let emits = |material: &&mut lumivox::scene::Material| material.emission != Vec3::ZERO;
            scene
                .materials
                .iter_mut()
                .filter(emits)
                .for_each(|material| material.specular = Some(GLOSS));
        }
        scene
    }

    /// A walk, moving models, moving lights, a build from anew, and everything that can be looked
    /// at.
    fn run(&self, gpu: &Gpu) -> Result<(), Error> {
        let mut scene = self.scene();
        let settings = self
            .case()
            .settings(&[&[("resolution", "16")], self.pairs].concat());
        let entry = find(self.technique).unwrap();
        let (mut renderer, _) = Renderer::new(gpu, &scene, entry, &settings, frame(16, 8, 32))?;
        for way_m in [0.0, 0.3, 3.4, 3.1] {
            renderer.render(&walked(&scene.camera, way_m))?;
        }
        for time_s in [1.0, 2.0] {
            scene.set_time(time_s);
            renderer.set_pose(&scene)?;
            renderer.render(&scene.camera)?;
        }
        for light in &mut scene.lights {
            if let Light::Point { position, .. } | Light::Spot { position, .. } = light {
                *position -= 0.2;
            }
        }
        renderer.move_lights(&scene)?;
        renderer.render(&scene.camera)?;
        renderer.render_again(&walked(&scene.camera, 0.5))?;
        renderer.rebuild()?;
        renderer.render(&scene.camera)?;
        for view in entry.views.iter().copied().flatten() {
            renderer.view(view, 0)?;
        }
        let light = screen_image(gpu, "test.light", [16, 8])?;
        renderer.show(Terms::ALL, &light)?;
        renderer.trace([8, 4], BeamAxis::Normal, None)?;
        renderer.count_samples()?;
        renderer.energy()?;
        renderer.aov(Aov::Full).map(drop)
    }
}

/// Why a pass need not run here.
fn excuse(pass: &'static Pass, features: &Features) -> Option<&'static str> {
    let is = |other: &'static Pass| std::ptr::eq(pass, other);
    if TEST_PASSES.iter().any(|other| is(other)) {
        return Some("it belongs to the tests of the graph");
    }
    if is(&FRAGMENTS_RASTER) && !features.geometry_shader {
        return Some("the device has no geometry shaders");
    }
    (is(&FRAGMENTS_RASTER_HW) && !(features.geometry_shader && features.conservative_rasterization))
        .then_some("the device has no conservative rasterization")
}

/// The passes that ran.
fn passes(journal: &[JournalFrame]) -> Vec<*const Pass> {
    let issued = journal.iter().flat_map(|frame| &frame.issued);
    let pass = |issued: &Issued| match issued {
        Issued::Pass { pass, .. } => Some(std::ptr::from_ref(*pass)),
        _ => None,
    };
    issued.filter_map(pass).collect()
}

/// Frames of a technique that asks for motion, or with history for materials too, while camera and
/// models move.
fn moving_with_motion(
    gpu: &Gpu,
    (entry, pairs): (&'static Entry, &[&str]),
    surfaces: Surfaces,
    is_glossy_too: bool,
) -> Result<(), Error> {
    let mut scene = moving_room(surfaces, small_lights()[0].1);
    if is_glossy_too {
        scene.materials[0].specular = Some(GLOSS);
    }
    let settings = entry.settings(None, pairs).unwrap();
    let (mut renderer, _) = Renderer::new(gpu, &scene, entry, &settings, frame(16, 8, 32))?;
    for time_s in [0.0, 1.0, 2.0] {
        scene.set_time(time_s);
        renderer.set_pose(&scene)?;
        renderer.render(&walked(&scene.camera, time_s))?;
        renderer.surface(SurfaceChannel::Motion)?;
        renderer.surface(SurfaceChannel::Material)?;
    }
    Ok(())
}

/// Frames of a technique that reads such maps of a sun with cascades, while all moves.
fn moving_with_cascades(gpu: &Gpu, pair: &str) -> Result<(), Error> {
    let (_, sun) = small_lights()[2];
    let mut scene = moving_room(Surfaces::Masked, sun);
    let entry = find("lpv").unwrap();
    let settings = entry
        .settings(Some("accurate"), &["resolution=8", pair])
        .unwrap();
    let mut frame = frame(16, 8, 32);
    frame.shadows.cascades = 2;
    let (mut renderer, _) = Renderer::new(gpu, &scene, entry, &settings, frame)?;
    for time_s in [0.0, 1.0, 2.0] {
        scene.set_time(time_s);
        renderer.set_pose(&scene)?;
        renderer.render_again(&walked(&scene.camera, time_s))?;
    }
    Ok(())
}

/// A room with panes, and bodies that bend light; the lights move.
fn behind_glass(gpu: &Gpu, technique: &str, preset: &str) -> Result<(), Error> {
    let mut scene = bundled("glass");
    let entry = find(technique).unwrap();
    let mut pairs = vec!["resolution=16", "cache_resolution=16"];
    pairs.retain(|pair| entry.settings(Some(preset), &[pair]).is_ok());
    let settings = entry.settings(Some(preset), &pairs).unwrap();
    let (mut renderer, _) = Renderer::new(gpu, &scene, entry, &settings, frame(16, 8, 32))?;
    renderer.render(&scene.camera)?;
    scene.lights[0] = Light::Point {
        position: Vec3::new(4.0, 3.0, 0.0),
        intensity: Vec3::splat(30.0),
    };
    renderer = Renderer::new(gpu, &scene, entry, &settings, frame(16, 8, 32))?.0;
    renderer.render(&scene.camera)?;
    renderer.move_lights(&scene)?;
    renderer.render_again(&walked(&scene.camera, 0.1)).map(drop)
}

/// Everything that may change between two frames, with settings that no preset has; every pass runs
/// at least once.
#[test]
fn every_hazard_of_every_pass_is_covered() {
    let gpu = gpu();
    let mut ran = HashSet::new();
    for life in &LIVES {
        let what = format!("{} {:?}", life.case().name(), life.pairs);
        gpu.take_journal();
        match life.run(&gpu) {
            Ok(()) => {}
            Err(Error::FeatureMissing { feature, .. }) => {
                skipped(&Missing::Other(feature));
                continue;
            }
            Err(error) => panic!("{what}: {error}"),
        }
        ran.extend(passes(&judge(&what, &gpu)));
    }
    for has_both in [false, true] {
        for surfaces in Surfaces::ALL {
            let materials: &[&str] = &["history=8", "material_test=on"];
            for asks in [(&WITH_MOTION, &[] as &[&str]), (&GIVEN, materials)] {
                gpu.take_journal();
                moving_with_motion(&gpu, asks, surfaces, has_both).unwrap();
                let what = format!("{}, {surfaces:?}", asks.0.name);
                ran.extend(passes(&judge(&what, &gpu)));
            }
        }
    }
    for pair in ["source=rsm", "source=faces"] {
        gpu.take_journal();
        moving_with_cascades(&gpu, pair).unwrap();
        ran.extend(passes(&judge(&format!("cascades, {pair}"), &gpu)));
    }
    for (technique, preset) in [
        ("voxel-mips", "accurate"),
        ("svo", "cones"),
        ("clipmap", "cones"),
        ("ray-traced", "default"),
        ("ray-traced", "cached"),
    ] {
        gpu.take_journal();
        behind_glass(&gpu, technique, preset).unwrap();
        ran.extend(passes(&judge(
            &format!("{technique}.{preset}, glass"),
            &gpu,
        )));
    }
    gpu.take_journal();
    light_in_pieces(&gpu, false);
    ran.extend(passes(&judge("light in pieces", &gpu)));
    let missing = |pass: &&'static Pass| {
        !ran.contains(&std::ptr::from_ref(*pass)) && excuse(pass, gpu.features()).is_none()
    };
    let missing: Vec<String> = all_passes()
        .into_iter()
        .filter(missing)
        .map(|pass| format!("{} {:?}", pass.name, pass.stages()))
        .collect();
    assert!(missing.is_empty(), "{missing:#?}");
}

/// Each barrier of a small frame, planned but not recorded, is missed; those on an image are each
/// for all of its layers, which no technique has.
#[test]
fn a_barrier_that_was_not_recorded_is_noticed() {
    let gpu = gpu();
    let run = |left_out: Option<usize>| {
        gpu.take_journal();
        let [a, b] = ["a", "b"].map(|name| words(&gpu, name, &[1; 64]));
        let layers = ImageDesc {
            name: "layers".into(),
            extent: [2, 2, 1],
            kind: ImageKind::D2Array,
            format: vk::Format::R8G8B8A8_UNORM,
            mips: 2,
            layers: 2,
            usage: ImageUsage::SAMPLED,
            owner: Owner::Shared,
        };
        let layers = gpu.create_image(&layers).unwrap();
        let mut frame = Frame::new();
        frame.clear_image("clear", &layers, [0.5; 4]);
        frame.blit_mips("blit", &layers);
        frame.fill("fill", &a, 3);
        frame
            .pass(&DOUBLE)
            .bind("values", &a)
            .constant("WORKGROUP", 64u32)
            .push(&64u32)
            .dispatch([1, 1, 1]);
        frame
            .pass(&COPY)
            .bind("source", &a)
            .bind("target", &b)
            .push(&64u32)
            .dispatch([1, 1, 1]);
        let count = std::cell::Cell::new(0);
        let keep = |_: &_| Some(count.replace(count.get() + 1)) != left_out;
        gpu.submit_with_barriers(frame, keep).unwrap();
        gpu.messages().take();
        let result = Stream::recorded(&gpu.take_journal()).unwrap().verify();
        (count.get(), result)
    };
    let (count, whole) = run(None);
    assert_eq!((count, whole), (7, Ok(())));
    for index in 0..count {
        assert!(run(Some(index)).1.is_err(), "barrier {index}");
    }
}
