//! All that cones give a picture (`cone.gather`, `cone.occlusion`, `cone.specular` and
//! `cone.shadow`), through each voxel structure, against the CPU oracle that marches through the
//! texels of that structure, pixel by pixel.

use std::f64::consts::PI;

use crate::support::gather::{View, by_oracle_with, cones_by_oracle, errors};
use crate::support::structures::Structure;
use crate::support::technique::{Builder, small_lights};
use crate::support::voxels::half;
use crate::support::walker::Walker;
use crate::support::{Random, gpu, words};
use glam::{DVec3, DVec4, Vec3};
use lumivox::gi::Settings;
use lumivox::gi::registry::find;
use lumivox::gi::shared::cone::VoxelVolume;
use lumivox::gi::shared::cone::oracle::see::see;
use lumivox::gi::shared::cone::oracle::specular::{Gloss, lifted, specular};
use lumivox::gi::shared::cone::oracle::{LightPlace, MarchSettings, light_visibility};
use lumivox::gi::shared::cone::{ConeTracer, FaceWeights, cone_set};
use lumivox::gi::shared::interleave::Pattern;
use lumivox::gi::shared::interleave::oracle::interleaved_offset;
use lumivox::gi::shared::voxel::VoxelGrid;
use lumivox::gi::shared::voxel::oracle::Receiver;
use lumivox::gi::voxel_cones::clipmap::Layout;
use lumivox::graph::{Frame, Gpu, Image};
use lumivox::render::{GpuScene, SightRays};
use lumivox::scene::{Camera, Light, Material, Scene, Specular};
use rayon::prelude::*;

const SIZE: [u32; 2] = [24, 18];

/// Largest error of a pixel that gathers, and of its visibility; 4·10⁻⁵ was measured, and once
/// 1.5·10⁻⁴.
const MOST: f64 = 0.002;

/// Largest error of a single cone, as for reflections and lights. Nearly opaque faces make it
/// large: their optical depth is the logarithm of almost 0. 0.006 was measured.
const MOST_OF_ONE: f64 = 0.01;

/// Angle of the leaning normals to the way to the eye. Where it is that of a face to its eye or
/// less, nothing leans.
const LEANING_RAD: f32 = 1.3;

/// A room of 2 m, open in front, of walls of any roughness and none, with a light just before a
/// wall, and a block whose normals lean away from the eye, so that it would mirror what is below
/// its faces.
fn glossy_room(eye: Vec3) -> Scene {
    let mut builder = Builder::default();
    let mut glossy = |albedo: Vec3, f0: f32, roughness: f32| {
        let specular = Some(Specular {
            f0: Vec3::new(f0, 0.8 * f0, 0.6 * f0),
            roughness,
            metalness: 0.0,
            texture: None,
        });
        builder.material(Material {
            albedo,
            specular,
            ..Material::default()
        })
    };
    let walls = [
        glossy(Vec3::new(0.6, 0.1, 0.1), 0.9, 0.12),
        glossy(Vec3::new(0.1, 0.5, 0.1), 0.3, 0.25),
        glossy(Vec3::splat(0.6), 0.5, 1.0),
        glossy(Vec3::splat(0.6), 0.04, 0.4),
        glossy(Vec3::new(0.3, 0.4, 0.7), 0.2, 0.6),
    ];
    let block = glossy(Vec3::new(0.5, 0.4, 0.2), 0.6, 0.15);
    let matte = builder.matte("matte", Vec3::splat(0.7));
    builder.room(
        [walls[0], walls[1], walls[2], walls[3], walls[4], matte],
        Vec3::new(-1.0, 0.0, -1.0),
        Vec3::new(1.0, 2.0, 1.0),
        true,
    );
    let first = builder.scene.vertices.len();
    builder.cuboid(
        block,
        Vec3::new(-0.6, 0.0, -0.6),
        Vec3::new(0.14, 0.9, 0.12),
    );
    for vertex in &mut builder.scene.vertices[first..] {
        let (normal, to_eye) = (
            Vec3::from(vertex.normal),
            (eye - Vec3::from(vertex.position)).normalize(),
        );
        let cosine = normal.dot(to_eye).clamp(-1.0, 1.0);
        let lean = (LEANING_RAD - cosine.acos()).max(0.0);
        let along = (to_eye - cosine * normal).normalize_or_zero();
        vertex.normal = (lean.cos() * normal - lean.sin() * along).to_array();
    }
    builder.quad(
        matte,
        Vec3::new(0.2, 0.4, -0.7),
        Vec3::X * 0.7,
        Vec3::Y * 0.9,
    );
    let camera = Camera {
        eye,
        target: Vec3::new(-0.1, 0.6, -0.4),
        up: Vec3::Y,
        vfov_deg: 75.0,
    };
    let near_wall = Light::Point {
        position: Vec3::new(0.6, 0.9, -0.93),
        intensity: Vec3::new(0.6, 0.5, 0.4),
    };
    let lights = small_lights()
        .map(|(_, light)| light)
        .into_iter()
        .chain([near_wall])
        .collect();
    builder.finish("glossy-room", lights, Vec3::new(0.7, 0.5, 0.3), camera)
}

/// What a pixel shows.
struct Pixel {
    at: [u32; 2],
    receiver: Receiver,
    to_eye: DVec3,
    albedo: DVec3,
    /// Absent where there is no lobe.
    gloss: Option<Gloss>,
}

/// The pixels of a view that see a surface, as the G-buffer has them.
fn pixels(gpu: &Gpu, view: &View, eye: DVec3) -> Vec<Pixel> {
    let read = |image: &std::sync::Arc<Image>| -> Vec<[u16; 4]> {
        bytemuck::pod_collect_to_vec(&gpu.read_image(image, 0, 0).unwrap())
    };
    let (albedo, f0) = (
        read(&view.gbuffer.albedo),
        read(view.gbuffer.specular.as_ref().unwrap()),
    );
    let of = |([x, y], receiver): &([u32; 2], Receiver)| {
        let at = (x + view.gbuffer.size[0] * y) as usize;
        let [albedo, f0] = [albedo[at], f0[at]].map(|texel| DVec4::from(texel.map(half)));
        let gloss = (f0.w >= 0.0).then_some(Gloss {
            f0: f0.truncate(),
            roughness: f0.w,
        });
        Pixel {
            at: [*x, *y],
            receiver: *receiver,
            to_eye: (eye - receiver.position).normalize(),
            albedo: albedo.truncate(),
            gloss,
        }
    };
    view.receivers.iter().map(of).collect()
}

fn march_settings(
    settings: &Settings,
    voxel_size: f64,
    resolution: u32,
    environment: Vec3,
) -> MarchSettings {
    let number = |name: &str| f64::from(settings.number(name));
    let reach = number("max_distance");
    MarchSettings {
        step_factor: number("step_factor"),
        opacity_exponent: number("opacity_exponent"),
        height_clamp: number("height_clamp"),
        max_distance: if reach > 0.0 {
            reach / voxel_size
        } else {
            4.0 * f64::from(resolution)
        },
        environment: environment.as_dvec3(),
        early_stop: number("early_stop"),
        ..MarchSettings::TEXTBOOK
    }
}

/// A technique with settings of its structure, and what a view of it needs.
struct Case {
    name: String,
    entry: &'static lumivox::gi::entry::Entry,
    structure: Vec<&'static str>,
}

fn cases() -> Vec<Case> {
    let case = |technique: &str, structure: &[&'static str]| Case {
        name: format!("{technique} {structure:?}"),
        entry: find(technique).unwrap(),
        structure: [structure, &["voxel_size=0.02", "levels=3"]].concat(),
    };
    vec![
        case("voxel-mips", &[]),
        case("voxel-mips", &["anisotropic=on", "face_weights=squared"]),
        case("voxel-mips", &["normals=toksvig"]),
        case("voxel-mips", &["normals=harmonics"]),
        case("svo", &["normals=toksvig"]),
        case("svo", &["normals=harmonics", "lattice=corners"]),
        case("svo", &["lattice=corners", "mip_filter=box"]),
        case("svo", &["anisotropic=on"]),
        case("svo", &["faces=both"]),
        case("clipmap", &[]),
        case("clipmap", &["anisotropic=on"]),
        case("clipmap", &["normals=toksvig"]),
        case("svo", &["normals=convolved"]),
        case("clipmap", &["normals=harmonics"]),
        case("clipmap", &["faces=both", "face_weights=squared"]),
    ]
}

impl Case {
    /// Settings of the structure, and of its cones.
    fn settings(&self, cones: &[String]) -> Settings {
        let has = |pair: &str| {
            self.entry
                .settings
                .iter()
                .copied()
                .flatten()
                .any(|setting| pair.split('=').next() == Some(setting.name))
        };
        let base = ["resolution=32", "shadows=cones", "specular=on"]
            .into_iter()
            .chain(self.structure.iter().copied());
        let pairs: Vec<String> = base
            .map(str::to_owned)
            .chain(cones.iter().cloned())
            .filter(|pair| has(pair))
            .collect();
        self.entry.settings(Some("cones"), &pairs).unwrap()
    }
}

/// Random settings of cones, those of ambient visibility never at their defaults.
fn cone_settings(random: &mut Random, wide: bool) -> Vec<String> {
    let mut pairs = Vec::new();
    let mut set = |name: &str, value: f32| pairs.push(format!("{name}={value}"));
    set("cones", if wide { 6.0 } else { 9.0 });
    set(
        "aperture_scale",
        if wide {
            0.5 + 0.5 * random.unit()
        } else {
            0.1 + 0.2 * random.unit()
        },
    );
    set("step_factor", 0.4 + 0.8 * random.unit());
    set("opacity_exponent", 0.7 + 2.0 * random.unit());
    set(
        "height_clamp",
        if wide { 0.0 } else { 1.0 + 5.0 * random.unit() },
    );
    set("start_offset", 0.8 + 1.5 * random.unit());
    set("max_distance", if wide { 1.1 } else { 0.0 });
    set("ao_falloff", 1.0 + 3.0 * random.unit());
    set("occlusion_cones", 5.0);
    set("occlusion_distance", if wide { 0.0 } else { 0.6 });
    set("occlusion_falloff", 1.0 + 4.0 * random.unit());
    set("shadow_aperture", 2.0 + 18.0 * random.unit());
    pairs.push(format!("cone_set={}", if wide { "papers" } else { "disc" }));
    pairs.push("interleave=4".to_owned());
    pairs.push(format!("early_stop={}", 0.2 * random.unit()));
    // Kahl's looks, and what others weigh occluders by.
    if wide {
        pairs.push(format!("first_hit={}", 0.05 + 0.4 * random.unit()));
        pairs.push(format!("specular_falloff={}", 1.0 + 8.0 * random.unit()));
        pairs.push(format!("specular_grace={}", 60.0 * random.unit()));
        pairs.push("occlusion_weight=radius".to_owned());
        for kind in ["shadow", "occlusion"] {
            pairs.push(format!("{kind}_strength={}", 0.5 + 3.0 * random.unit()));
        }
    }
    pairs.extend(["shadows=cones".to_owned(), "obscured_diffuse=on".to_owned()]);
    // Cones of each kind have a start, a step and a width of their own, or those of the others.
    if wide {
        pairs.push("specular_interleave=3".to_owned());
        for kind in ["specular", "shadow", "occlusion"] {
            pairs.push(format!("{kind}_start={}", 0.6 + 1.5 * random.unit()));
            pairs.push(format!("{kind}_step={}", 0.4 + 0.8 * random.unit()));
        }
        pairs.push(format!(
            "occlusion_aperture={}",
            20.0 + 30.0 * random.unit()
        ));
    } else {
        pairs.push(format!("specular_aperture={}", 5.0 + 20.0 * random.unit()));
    }
    pairs
}

/// Settings by which all cones are as those of a kind are by these.
fn of_kind(case: &Case, cones: &[String], kind: &str) -> Settings {
    let settings = case.settings(cones);
    let own = [("start", "start_offset"), ("step", "step_factor")].map(|(own, others)| {
        let value = settings.number(&format!("{kind}_{own}"));
        let is_own = value > 0.0;
        let value = if is_own {
            value
        } else {
            settings.number(others)
        };
        format!("{others}={value}")
    });
    case.settings(&[cones, &own].concat())
}

/// What the device gives: the gather, then its visibility by cones of its own, then its light where
/// lights are hidden, then the specular cone and the direct light.
struct Seen {
    gathered: Vec<DVec4>,
    occluded: Vec<DVec4>,
    obscured: Vec<DVec4>,
    specular: Vec<DVec4>,
    direct: Vec<DVec4>,
}

fn render(
    gpu: &Gpu,
    scene: &GpuScene,
    view: &View,
    volume: &VoxelVolume<'_>,
    settings: &Settings,
) -> Seen {
    let tracer = ConeTracer::new(gpu, settings).unwrap();
    let results = |record: &dyn Fn(&mut Frame)| {
        let mut frame = Frame::new();
        frame.set_scene(&scene.set, &scene.materials);
        record(&mut frame);
        gpu.submit(frame).unwrap();
        view.results(gpu)
    };
    let (gbuffer, volume, result) = (&view.gbuffer, volume.volume, &view.result);
    let least = tracer.least_visibility(gpu, SIZE).unwrap().unwrap();
    let all = || view.all(scene);
    Seen {
        gathered: results(&|frame| tracer.gather(frame, &all(), volume)),
        occluded: results(&|frame| tracer.occlusion(frame, &all(), volume)),
        obscured: results(&|frame| tracer.obscure(frame, scene, &all(), volume, &least)),
        specular: results(&|frame| tracer.specular(frame, (scene, gbuffer), volume, result)),
        direct: results(&|frame| tracer.shadow(frame, scene, gbuffer, volume, result)),
    }
}

/// L_s of the glossy pixels, with factors on the cone's half angle and on the height of its start.
fn specular_by_oracle(
    structure: &Structure,
    pixels: &[Pixel],
    march: &MarchSettings,
    start_offset: f64,
    (pattern, roughening, aperture_deg): (Pattern, f64, f64),
    towards_lights: impl Fn(&Pixel, DVec3) -> f64 + Sync,
) -> Vec<DVec4> {
    let of = |pixel: &Pixel| {
        let Some(gloss) = &pixel.gloss else {
            return DVec4::ZERO;
        };
        let gloss = Gloss {
            roughness: gloss.roughness * roughening,
            ..*gloss
        };
        let (normal, to_eye) = (pixel.receiver.shading_normal, pixel.to_eye);
        let mut lobe = match pattern.count() {
            1 => gloss.whole(normal, to_eye),
            count => gloss.part(
                normal,
                to_eye,
                interleaved_offset(pixel.at, pattern, 0),
                count,
            ),
        };
        if aperture_deg > 0.0 {
            lobe.half_angle_rad = 0.5 * aperture_deg.to_radians();
        }
        let seen = specular(
            structure.levels(),
            &pixel.receiver,
            &lobe,
            start_offset,
            march,
        );
        (towards_lights(pixel, lobe.direction) * seen).extend(0.0)
    };
    pixels.par_iter().map(of).collect()
}

/// A light as a pixel's surface has it: the way to it, its irradiance, and what a cone sees of it.
struct SeenLight {
    direction: DVec3,
    irradiance: DVec3,
    seen: f64,
}

/// Those lights that are in front of a pixel's surface.
fn seen_lights(
    structure: &Structure,
    pixel: &Pixel,
    scene: &Scene,
    grid: &VoxelGrid,
    settings: &Settings,
    march: &MarchSettings,
) -> Vec<SeenLight> {
    let (origin, voxel_size) = (grid.origin.as_dvec3(), f64::from(grid.voxel_size));
    let tan_half = (f64::from(settings.number("shadow_aperture")).to_radians() / 2.0).tan();
    let march = MarchSettings {
        max_distance: f64::INFINITY,
        environment: DVec3::ZERO,
        near_strength: settings.number("shadow_strength").into(),
        ..*march
    };
    let receiver = &pixel.receiver;
    let of = |light: &Light| {
        let (direction, _, irradiance) =
            light.sample((origin + voxel_size * receiver.position).as_vec3());
        let direction = direction.as_dvec3();
        if receiver.geometric_normal.dot(direction) <= 0.0 {
            return None;
        }
        let place = match *light {
            Light::Directional { .. } => LightPlace::Direction(direction),
            Light::Point { position, .. } | Light::Spot { position, .. } => {
                LightPlace::Position((position.as_dvec3() - origin) / voxel_size)
            }
        };
        let seen = light_visibility(
            structure.levels(),
            receiver,
            f64::from(settings.number("start_offset")),
            place,
            tan_half,
            &march,
        );
        Some(SeenLight {
            direction,
            irradiance: irradiance.as_dvec3(),
            seen,
        })
    };
    scene.lights.iter().filter_map(of).collect()
}

/// The light of all lights that a pixel reflects, each seen by a cone.
fn direct_by_oracle(
    structure: &Structure,
    pixels: &[Pixel],
    scene: &Scene,
    grid: &VoxelGrid,
    settings: &Settings,
    march: &MarchSettings,
) -> Vec<DVec4> {
    let of = |pixel: &Pixel| {
        let normal = pixel.receiver.shading_normal;
        let lights = seen_lights(structure, pixel, scene, grid, settings, march);
        let reflected = lights.iter().map(|light| {
            let cosine = normal.dot(light.direction);
            if cosine <= 0.0 {
                return DVec3::ZERO;
            }
            let lobe = pixel.gloss.map_or(DVec3::ZERO, |gloss| {
                gloss.brdf(normal, pixel.to_eye, light.direction)
            });
            (pixel.albedo / PI + lobe) * light.irradiance * cosine * light.seen
        });
        reflected.sum::<DVec3>().extend(1.0)
    };
    pixels.par_iter().map(of).collect()
}

#[test]
fn cones_through_each_structure_are_the_oracles() {
    let gpu = gpu();
    for (number, case) in (0u64..).zip(cases()) {
        let mut random = Random::new(1700 + number);
        for (wide, eye) in [
            (false, Vec3::new(0.35, 1.15, 0.7)),
            (true, Vec3::new(-0.45, 1.3, 0.55)),
        ] {
            compare_case(&gpu, &case, &cone_settings(&mut random, wide), eye, wide);
        }
    }
}

/// What is wrong with pixels of these errors, if anything.
fn is_near((relative, visibility): &(Vec<f64>, f64), most: f64) -> Result<(), String> {
    let worst = relative.last().copied().unwrap_or(f64::NAN);
    if worst <= most && *visibility <= most {
        Ok(())
    } else {
        Err(format!("off by {worst}, visibility by {visibility}"))
    }
}

/// Errors are planted where that takes little time: with few wide cones.
fn compare_case(gpu: &Gpu, case: &Case, cones: &[String], eye: Vec3, plants: bool) {
    let scene = glossy_room(eye);
    let settings = case.settings(cones);
    let mut walker = Walker::new(gpu, &scene, case.entry, &settings, eye);
    walker.texels(eye);
    let volumes = walker.technique.volumes();
    let volume = &volumes[0];
    let weights = if settings.find_choice("face_weights") == Some("squared") {
        FaceWeights::Squared
    } else {
        FaceWeights::Extinction
    };
    let layout = (case.entry.name == "clipmap")
        .then(|| (Layout::new(walker.gpu_scene.bounds, 32, 3, 0.02), eye));
    let structure = Structure::read(
        gpu,
        volume.volume,
        volume.volume.grid.resolution,
        weights,
        layout,
    );
    let view = View::new(
        gpu,
        &walker.gpu_scene,
        &scene.camera,
        SIZE,
        &volume.volume.grid,
    );
    let (grid, voxel_size) = (
        &volume.volume.grid,
        f64::from(volume.volume.grid.voxel_size),
    );
    let pixels = pixels(gpu, &view, (eye - grid.origin).as_dvec3() / voxel_size);
    let seen = render(gpu, &walker.gpu_scene, &view, volume, &settings);
    let start_offset = f64::from(settings.number("start_offset"));
    let check = |what: &str,
                 seen: &[DVec4],
                 expected: &[DVec4],
                 planted: &[(&str, &dyn Fn() -> Vec<DVec4>)]| {
        let result = errors(seen, expected);
        let most = if matches!(what, "gather" | "occlusion") {
            MOST
        } else {
            MOST_OF_ONE
        };
        println!(
            "{}, {what}: worst error {:.1e}, visibility {:.1e}",
            case.name,
            result.0.last().unwrap(),
            result.1
        );
        is_near(&result, most)
            .unwrap_or_else(|error| panic!("{}, {what}, {cones:?}: {error}", case.name));
        for (wrong, planted) in planted.iter().filter(|_| plants) {
            assert!(
                is_near(&errors(seen, &planted()), most).is_err(),
                "{}, {what}: {wrong} goes unnoticed",
                case.name
            );
        }
    };
    let gathered = cones_by_oracle(structure.levels(), &scene, grid, &view, &settings);
    let lit = gathered
        .iter()
        .map(|pixel| pixel.truncate().max_element())
        .sum::<f64>()
        / gathered.len() as f64;
    let open = gathered.iter().map(|pixel| pixel.w).sum::<f64>() / gathered.len() as f64;
    assert!(
        lit > 0.05 && (0.1..0.95).contains(&open),
        "{}: the picture shows little: {lit}, {open}",
        case.name
    );
    let without = case.settings(&[cones, &["ao_falloff=0".to_owned()]].concat());
    let nearer =
        case.settings(&[cones, &[format!("start_offset={}", 0.5 * start_offset)]].concat());
    let plant = |settings| cones_by_oracle(structure.levels(), &scene, grid, &view, settings);
    check(
        "gather",
        &seen.gathered,
        &gathered,
        &[
            ("no falloff", &|| plant(&without)),
            ("half the start", &|| plant(&nearer)),
        ],
    );

    let mut set = cone_set(
        settings.count("occlusion_cones"),
        true,
        settings.number("aperture_scale"),
    );
    let aperture = settings.number("occlusion_aperture");
    for cone in set.cones.iter_mut().filter(|_| aperture > 0.0) {
        cone.tan_half_aperture = (0.5 * aperture.to_radians()).tan();
    }
    let own = by_oracle_with(
        structure.levels(),
        &scene,
        grid,
        &view,
        &of_kind(case, cones, "occlusion"),
        &set,
        ["occlusion_distance", "occlusion_falloff"],
    );
    let occluded: Vec<DVec4> = seen
        .gathered
        .iter()
        .zip(own)
        .map(|(before, (own, _))| before.truncate().extend(own.visibility))
        .collect();
    assert!(
        seen.occluded
            .iter()
            .zip(&seen.gathered)
            .all(|(after, before)| after.truncate() == before.truncate()),
        "{}: the irradiance changes",
        case.name
    );
    check(
        "occlusion",
        &seen.occluded,
        &occluded,
        &[("the gather's own", &|| seen.gathered.clone())],
    );

    let shadow_kind = of_kind(case, cones, "shadow");
    let shadow_march = march_settings(&shadow_kind, voxel_size, grid.resolution, Vec3::ZERO);
    let obscured = |light_count: usize| -> Vec<DVec4> {
        let of = |(pixel, before): (&Pixel, &DVec4)| {
            let seen = seen_lights(&structure, pixel, &scene, grid, &shadow_kind, &shadow_march);
            let seen = seen.iter().take(light_count).map(|light| light.seen);
            let least = seen.fold(1.0, |least: f64, seen| least.min(seen));
            (least * before.truncate()).extend(before.w)
        };
        pixels.par_iter().zip(&seen.occluded).map(of).collect()
    };

    let glossy = |all: &[DVec4]| -> Vec<DVec4> {
        all.iter()
            .zip(&pixels)
            .filter(|(_, pixel)| pixel.gloss.is_some())
            .map(|(value, _)| *value)
            .collect()
    };
    let mirrors_below = |Pixel {
                             receiver,
                             to_eye,
                             gloss,
                             ..
                         }: &&Pixel| {
        let shading = receiver.shading_normal;
        gloss.is_some()
            && receiver
                .geometric_normal
                .dot(2.0 * shading.dot(*to_eye) * shading - *to_eye)
                < 0.0
    };
    let below = pixels.iter().filter(mirrors_below).count();
    // A lobe whose normal looks away from the eye is not defined.
    assert!(
        pixels
            .iter()
            .all(|pixel| pixel.to_eye.dot(pixel.receiver.shading_normal) > 0.02),
        "{}",
        case.name
    );
    let (falloff, grace) = (
        f64::from(settings.number("specular_falloff")),
        f64::from(settings.number("specular_grace")).to_radians(),
    );
    let towards_lights = |pixel: &Pixel, direction: DVec3| {
        if falloff == 0.0 {
            return 1.0;
        }
        let direction = lifted(direction, pixel.receiver.geometric_normal);
        let place = (grid.origin.as_dvec3() + voxel_size * pixel.receiver.position).as_vec3();
        let share = |light: &Light| {
            let angle = direction.angle_between(light.sample(place).0.as_dvec3());
            (1.0 - (angle - grace).max(0.0) / PI).powf(falloff)
        };
        scene.lights.iter().map(share).sum()
    };
    let by_oracle = |march: &MarchSettings, start_offset, roughening| {
        glossy(&specular_by_oracle(
            &structure,
            &pixels,
            march,
            start_offset,
            (
                Pattern::specular(&settings),
                roughening,
                settings.number("specular_aperture").into(),
            ),
            towards_lights,
        ))
    };
    let specular_kind = of_kind(case, cones, "specular");
    let march_of = |settings: &Settings| {
        march_settings(
            settings,
            voxel_size,
            grid.resolution,
            scene.environment.uniform(),
        )
    };
    let march = march_of(&specular_kind);
    let start_offset = f64::from(specular_kind.number("start_offset"));
    let expected = by_oracle(&march, start_offset, 1.0);
    assert!(
        expected.len() > 150 && below > 20,
        "{}: {} glossy pixels, {below} that would mirror what is below them",
        case.name,
        expected.len()
    );
    let twice = || by_oracle(&march, start_offset, 2f64.sqrt());
    let nearer = || by_oracle(&march, 0.5 * start_offset, 1.0);
    check(
        "specular",
        &glossy(&seen.specular),
        &expected,
        &[("twice the aperture", &twice), ("half the start", &nearer)],
    );
    assert!(
        seen.specular
            .iter()
            .zip(&pixels)
            .all(|(value, pixel)| pixel.gloss.is_some() || *value == DVec4::ZERO),
        "{}: matte pixels reflect",
        case.name
    );

    let march = shadow_march;
    let direct = |march: &MarchSettings| {
        direct_by_oracle(&structure, &pixels, &scene, grid, &shadow_kind, march)
    };
    let twice = MarchSettings {
        opacity_exponent: 2.0 * march.opacity_exponent,
        ..march
    };
    check(
        "shadow",
        &seen.direct,
        &direct(&march),
        &[("twice the opacity", &|| direct(&twice))],
    );
    check(
        "obscured",
        &seen.obscured,
        &obscured(usize::MAX),
        &[("the first light alone", &|| obscured(1))],
    );
    check_sights(
        gpu,
        case,
        (&walker.gpu_scene, volume, &structure),
        &settings,
    );
}

/// Lines that meet an opacity that is nearly one at which something is decided may differ.
const OTHER_SIGHTS: f64 = 0.01;

/// Lines of sight from anywhere, some from outside of the grid, some that end soon, some that ask
/// nothing.
fn check_sights(
    gpu: &Gpu,
    case: &Case,
    (scene, volume, structure): (&GpuScene, &VoxelVolume<'_>, &Structure),
    settings: &Settings,
) {
    let grid = &volume.volume.grid;
    let size = grid.voxel_size * grid.resolution as f32;
    let mut random = Random::new(271);
    let mut point = |size: f32| {
        let mut axis = || random.unit();
        size * Vec3::new(axis(), axis(), axis())
    };
    let rays: Vec<[f32; 8]> = (0..600)
        .map(|index| {
            let from = grid.origin + point(3.0 * size) * 0.5 - 0.25 * size;
            let mut way = grid.origin + point(size) - from;
            if index % 7 == 0 {
                way *= Vec3::new(0.0, 1.0, 0.0);
            }
            let end = if index % 3 == 0 {
                0.7 * way.length()
            } else {
                f32::INFINITY
            };
            let way = if index % 11 == 0 {
                Vec3::ZERO
            } else {
                way.normalize_or(Vec3::Y)
            };
            [from.x, from.y, from.z, end, way.x, way.y, way.z, 0.0]
        })
        .collect();
    let untouched = [-1.0f32; 4];
    let (asked, sights) = (
        words(gpu, "rays", bytemuck::cast_slice(&rays)),
        words(
            gpu,
            "sights",
            bytemuck::cast_slice(&vec![untouched; rays.len()]),
        ),
    );
    let mut frame = Frame::new();
    frame.set_scene(&scene.set, &scene.materials);
    let tracer = ConeTracer::new(gpu, settings).unwrap();
    let count = rays.len() as u32;
    let lines = SightRays {
        rays: &asked,
        sights: &sights,
        count,
    };
    tracer.see(&mut frame, volume.volume, lines);
    gpu.submit(frame).unwrap();
    let found: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&sights).unwrap());
    let (mut others, mut met, mut missed) = (0, 0, 0);
    for (ray, found) in rays.iter().zip(&found) {
        let direction = Vec3::new(ray[4], ray[5], ray[6]);
        if direction == Vec3::ZERO {
            assert_eq!(*found, untouched, "{}", case.name);
            continue;
        }
        let origin = (Vec3::new(ray[0], ray[1], ray[2]) - grid.origin) / grid.voxel_size;
        let expected = see(
            structure.levels(),
            origin.as_dvec3(),
            direction.as_dvec3(),
            f64::from(ray[3] / grid.voxel_size),
        );
        let off = (DVec4::from_array(found.map(f64::from)) - expected).abs();
        others += u32::from(off.to_array().iter().any(|off| *off > 0.01));
        met += u32::from(expected.w < 0.5);
        missed += u32::from(expected.w > 0.9);
    }
    println!("{}, sights: {others} of {count} differ", case.name);
    assert!(met > 100 && missed > 60, "{}: {met}, {missed}", case.name);
    assert!(
        f64::from(others) <= OTHER_SIGHTS * f64::from(count),
        "{}: {others} of {count} lines of sight differ",
        case.name
    );
}
