//! Techniques under test: every row of the registry with every preset, small scenes made here, and
//! one call from scene to pictures.

use super::compare::{Largest, Worst};
use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};
use lumivox::frame::{FrameSettings, Renderer};
use lumivox::gi::Settings;
use lumivox::gi::entry::Entry;
use lumivox::gi::registry::TECHNIQUES;
use lumivox::gi::settings::Domain;
use lumivox::graph::{Error, Gpu};
use lumivox::image::{Aov, GuideImage, Image, IndirectImage, luminance, write_heatmap, write_png};
use lumivox::metrics::{Channel, Errors, compare, error_image};
use lumivox::render::ShadowSettings;
use lumivox::scene::{
    Camera, Light, LoadOptions, Material, Model, Pose, Scene, Specular, Texture, TextureKind,
    Triangle, Vertex,
};

use super::scenes::{Corners, add_model, lump, scene_of, still};
use super::{Missing, Random, skipped};

/// One technique with one preset.
#[derive(Clone, Copy)]
pub struct Case {
    /// The technique.
    pub entry: &'static Entry,
    /// The preset; `None` for a technique without presets.
    pub preset: Option<&'static str>,
}

/// Every preset of every technique.
pub fn cases() -> Vec<Case> {
    let presets = |entry: &'static Entry| match entry.presets {
        [] => vec![Case {
            entry,
            preset: None,
        }],
        presets => presets
            .iter()
            .map(|preset| Case {
                entry,
                preset: Some(preset.name),
            })
            .collect(),
    };
    TECHNIQUES.iter().flat_map(|entry| presets(entry)).collect()
}

/// Every preset of every technique that computes a bounce of all lights.
pub fn bounce_cases() -> Vec<Case> {
    let knows_lights = |case: &Case| case.settings(&[]).find_choice("lights") != Some("ignore");
    cases()
        .into_iter()
        .filter(|case| case.bounces() > 0 && knows_lights(case))
        .collect()
}

/// Every preset of every technique that follows models which move.
pub fn moving_cases() -> Vec<Case> {
    let mut cases = cases();
    cases.retain(|case| !case.has("dynamic"));
    cases
}

/// The default preset of every technique that computes a bounce.
pub fn default_cases() -> Vec<Case> {
    let default = |entry: &&'static Entry| Case {
        entry,
        preset: entry.presets.first().map(|preset| preset.name),
    };
    TECHNIQUES
        .iter()
        .map(default)
        .filter(|case| case.bounces() > 0)
        .collect()
}

/// Of [`default_cases`], those that have a setting and value, `KEY=VALUE`.
pub fn default_cases_with(pair: &str) -> Vec<Case> {
    let mut cases = default_cases();
    cases.retain(|case| case.accepts(pair));
    cases
}

/// What makes techniques small that have no resolution, so that tests are short, and complete in a
/// frame.
const SMALL: &[(&str, &str)] = &[
    ("probes", "8"),
    ("probes_per_frame", "0"),
    ("transfer_rays", "64"),
    ("cells", "8"),
    ("dynamic", "freeze"),
];

impl std::fmt::Debug for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.name())
    }
}

impl Case {
    /// `technique` or `technique.preset`.
    pub fn name(&self) -> String {
        self.preset.map_or(self.entry.name.to_owned(), |preset| {
            format!("{}.{preset}", self.entry.name)
        })
    }

    /// The smallest value of the setting `resolution`; 8 where the technique has none.
    pub fn smallest_resolution(&self) -> &'static str {
        let setting = self
            .entry
            .all_settings()
            .find(|setting| setting.name == "resolution");
        match setting.map(|setting| setting.domain) {
            Some(Domain::OneOf([16, ..])) => "16",
            _ => "8",
        }
    }

    /// Whether the technique has a setting of this name.
    pub fn has(&self, name: &str) -> bool {
        self.entry
            .all_settings()
            .any(|setting| setting.name == name)
    }

    /// Whether the technique has a setting and value, `KEY=VALUE`.
    pub fn accepts(&self, pair: &str) -> bool {
        self.entry.settings(self.preset, &[pair]).is_ok()
    }

    /// Whether the preset has six faces of texels on some level.
    pub fn has_faces(&self) -> bool {
        matches!(self.preset, Some("anisotropic" | "directional"))
    }

    /// Number of indirect bounces of the preset.
    pub fn bounces(&self) -> u32 {
        (self.entry.bounces)(&self.settings(&[])).expect("presets have a fixed number of bounces")
    }

    /// The preset's settings, [`SMALL`], with those `pairs` that the technique knows.
    pub fn settings(&self, pairs: &[(&str, &str)]) -> Settings {
        let pairs: Vec<String> = SMALL
            .iter()
            .chain(pairs)
            .filter(|(name, _)| self.has(name))
            .map(|(name, value)| format!("{name}={value}"))
            .collect();
        self.entry.settings(self.preset, &pairs).unwrap()
    }
}

/// A small frame.
pub fn frame(width: u32, height: u32, shadow_resolution: u32) -> FrameSettings {
    FrameSettings {
        size: [width, height],
        shadows: ShadowSettings::of_resolution(shadow_resolution),
    }
}

/// What one frame gave.
pub struct Shot {
    pub full: Image,
    pub direct: Image,
    pub indirect: Image,
    /// The technique's answer.
    pub light: IndirectImage,
}

/// Renders one frame that has nothing to do with those before; where pixels have history, as many
/// as a picture at rest takes.
pub fn render_anew(
    renderer: &mut Renderer<'_>,
    case: &Case,
    settings: &Settings,
    camera: &Camera,
) -> Result<(), Error> {
    renderer.cut();
    let frames = case.entry.screen(settings).frames_to_rest();
    (0..frames).try_for_each(|_| renderer.render(camera).map(drop))
}

/// Builds and renders a picture.
pub fn shoot(
    gpu: &Gpu,
    scene: &Scene,
    case: &Case,
    pairs: &[(&str, &str)],
    frame: FrameSettings,
) -> Result<Shot, Error> {
    let settings = case.settings(pairs);
    let (mut renderer, _) = Renderer::new(gpu, scene, case.entry, &settings, frame)?;
    render_anew(&mut renderer, case, &settings, &scene.camera)?;
    let [full, direct, indirect] =
        [Aov::Full, Aov::Direct, Aov::Indirect].map(|aov| renderer.aov(aov));
    Ok(Shot {
        full: full?,
        direct: direct?,
        indirect: indirect?,
        light: renderer.indirect_light()?,
    })
}

/// Errors over block means (8×8 px on one plane and material), over R, G and B.
pub fn block_errors(image: &Image, reference: &Image, guide: &GuideImage) -> Errors {
    compare(image, reference, Some(guide), Channel::Rgb)
        .unwrap()
        .block
        .expect("the picture has flat blocks")
}

/// Mean luminance over the pixels that see a surface.
pub fn mean(image: &Image, guide: &GuideImage) -> f64 {
    let surfaces: Vec<usize> = (0..image.pixels.len())
        .filter(|&i| guide.is_surface(i))
        .collect();
    assert!(!surfaces.is_empty(), "no pixel sees a surface");
    surfaces
        .iter()
        .map(|&i| f64::from(luminance(image.pixels[i])))
        .sum::<f64>()
        / surfaces.len() as f64
}

/// Largest |a − b| over the mean of b, over all channels.
pub fn largest_difference(a: &Image, b: &Image) -> f64 {
    assert_eq!(a.size(), b.size());
    let mean = b
        .pixels
        .iter()
        .map(|&pixel| f64::from(luminance(pixel)))
        .sum::<f64>()
        / b.pixels.len() as f64;
    let largest = a
        .pixels
        .iter()
        .zip(&b.pixels)
        .map(|(&a, &b)| (a - b).abs().largest())
        .worst();
    largest / mean.max(f64::MIN_POSITIVE)
}

/// Whether every pixel is finite and none is negative.
pub fn is_sound(image: &Image) -> bool {
    image
        .pixels
        .iter()
        .all(|pixel| pixel.is_finite() && pixel.min_element() >= 0.0)
}

/// A camera that has walked so far along its view (m).
pub fn walked(camera: &Camera, way_m: f32) -> Camera {
    let shift = (camera.target - camera.eye).normalize() * way_m;
    Camera {
        eye: camera.eye + shift,
        target: camera.target + shift,
        ..*camera
    }
}

/// The folder for what failing tests saw.
pub fn failures_dir() -> PathBuf {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests")
        .join("failures");
    std::fs::create_dir_all(&dir).unwrap();
    dir
}

/// Writes what a failing test saw: both pictures, their difference, and the numbers.
pub fn write_failure(
    name: &str,
    image: &Image,
    expected: Option<&Image>,
    exposure: f32,
    numbers: &str,
) {
    let dir = failures_dir();
    write_png(&dir.join(format!("{name}.png")), image, exposure).unwrap();
    if let Some(expected) = expected.filter(|expected| expected.size() == image.size()) {
        write_png(
            &dir.join(format!("{name}.expected.png")),
            expected,
            exposure,
        )
        .unwrap();
        write_heatmap(
            &dir.join(format!("{name}.difference.png")),
            &error_image(image, expected).unwrap(),
            0.1 / exposure,
        )
        .unwrap();
    }
    std::fs::write(dir.join(format!("{name}.txt")), format!("{numbers}\n")).unwrap();
}

/// The scene of that name in the folder of shared scenes (`LUMIVOX_SCENES`, else `../shared/scenes`
/// beside the repository); `None`, said aloud, without it.
pub fn shared_scene(name: &str) -> Option<Scene> {
    let root = std::env::var_os("LUMIVOX_SCENES")
        .map(PathBuf::from)
        .or_else(|| {
            std::env::var_os("LUMIVOX_SHARED").map(|path| PathBuf::from(path).join("scenes"))
        })
        .unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes"));
    let path = root.join(name);
    if !path.exists() {
        skipped(&Missing::Other(&format!(
            "no scene {name} (LUMIVOX_SCENES)"
        )));
        return None;
    }
    Some(Scene::load(&path, &LoadOptions::default()).unwrap())
}

/// Geometry for a test, one face at a time.
#[derive(Default)]
pub struct Builder {
    pub scene: Scene,
}

impl Builder {
    /// Adds a material.
    pub fn material(&mut self, material: Material) -> u32 {
        self.scene.materials.push(material);
        self.scene.materials.len() as u32 - 1
    }

    /// Adds a diffuse material.
    pub fn matte(&mut self, name: &str, albedo: Vec3) -> u32 {
        self.material(Material {
            name: name.into(),
            albedo,
            ..Material::default()
        })
    }

    /// Adds a parallelogram: corner, two edges; its front is where a × b points.
    pub fn quad(&mut self, material: u32, corner: Vec3, a: Vec3, b: Vec3) {
        let first = self.scene.vertices.len() as u32;
        let normal = a.cross(b).normalize().to_array();
        for uv in [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y] {
            self.scene.vertices.push(Vertex {
                position: (corner + a * uv.x + b * uv.y).to_array(),
                u: uv.x,
                normal,
                v: uv.y,
            });
        }
        for vertices in [[0, 1, 2], [0, 2, 3]] {
            self.scene.triangles.push(Triangle {
                vertices: vertices.map(|vertex| first + vertex),
                material,
            });
        }
    }

    /// Adds the inside of an axis-aligned box, without the front (high z) where `open`.
    pub fn room(&mut self, materials: [u32; 6], low: Vec3, high: Vec3, open: bool) {
        let size = high - low;
        let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
        self.quad(materials[0], low, y, z);
        self.quad(materials[1], low + x, z, y);
        self.quad(materials[2], low, z, x);
        self.quad(materials[3], low + y, x, z);
        self.quad(materials[4], low, x, y);
        if !open {
            self.quad(materials[5], low + z, y, x);
        }
    }

    /// Adds the outside of an axis-aligned box.
    pub fn cuboid(&mut self, material: u32, low: Vec3, high: Vec3) {
        let size = high - low;
        let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
        self.quad(material, low, z, y);
        self.quad(material, low + x, y, z);
        self.quad(material, low, x, z);
        self.quad(material, low + y, z, x);
        self.quad(material, low, y, x);
        self.quad(material, low + z, x, y);
    }

    /// The scene: triangles sorted by material, one model.
    pub fn finish(
        mut self,
        name: &str,
        lights: Vec<Light>,
        environment: Vec3,
        camera: Camera,
    ) -> Scene {
        self.scene
            .triangles
            .sort_by_key(|triangle| triangle.material);
        let triangle_count = self.scene.triangles.len() as u32;
        self.scene.models = vec![Model {
            name: name.into(),
            dynamic: false,
            first_triangle: 0,
            triangle_count,
            motion: None,
        }];
        Scene {
            name: name.into(),
            lights,
            environment: environment.into(),
            camera,
            ..self.scene
        }
    }
}

/// What the surfaces of [`small_room`] are like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surfaces {
    Diffuse,
    Glossy,
    Emissive,
    Masked,
    /// With a normal map; not among [`Surfaces::ALL`], as few techniques have passes for it.
    Bumped,
}

impl Surfaces {
    pub const ALL: [Surfaces; 4] = [
        Surfaces::Diffuse,
        Surfaces::Glossy,
        Surfaces::Emissive,
        Surfaces::Masked,
    ];
}

/// One light of each kind for [`small_room`], by name.
pub fn small_lights() -> [(&'static str, Light); 3] {
    let position = Vec3::new(0.1, 1.6, 0.3);
    let intensity = Vec3::new(3.0, 2.5, 2.0);
    let direction = Vec3::new(0.2, -1.0, -0.4).normalize();
    [
        (
            "point",
            Light::Point {
                position,
                intensity,
            },
        ),
        (
            "spot",
            Light::Spot {
                position,
                direction,
                intensity,
                inner_deg: 25.0,
                outer_deg: 50.0,
            },
        ),
        (
            "directional",
            Light::Directional {
                direction: Vec3::new(0.3, -0.5, -1.0).normalize(),
                irradiance: Vec3::splat(4.0),
            },
        ),
    ]
}

/// A room of 2 m, open in front, with one block; `surfaces` says what the block, and a sheet before
/// the back wall, are like.
pub fn small_room(surfaces: Surfaces, lights: Vec<Light>) -> Scene {
    let mut builder = Builder::default();
    let white = builder.matte("white", Vec3::splat(0.7));
    let red = builder.matte("red", Vec3::new(0.6, 0.1, 0.1));
    let green = builder.matte("green", Vec3::new(0.1, 0.5, 0.1));
    let mut special = Material {
        name: format!("{surfaces:?}"),
        albedo: Vec3::splat(0.6),
        ..Material::default()
    };
    match surfaces {
        Surfaces::Diffuse => {}
        Surfaces::Glossy => {
            special.specular = Some(Specular {
                f0: Vec3::splat(0.5),
                roughness: 0.3,
                metalness: 0.0,
                texture: None,
            })
        }
        Surfaces::Emissive => special.emission = Vec3::new(1.0, 2.0, 4.0),
        Surfaces::Masked => {
            let holes = |x: u32, y: u32| {
                if (x / 4 + y / 4).is_multiple_of(2) {
                    [255; 4]
                } else {
                    [0; 4]
                }
            };
            let texels = (0..16 * 16).map(|i| holes(i % 16, i / 16)).collect();
            builder.scene.textures.push(
                Texture {
                    name: "holes".into(),
                    kind: TextureKind::Mask,
                    width: 16,
                    height: 16,
                    texels,
                }
                .into(),
            );
            special.mask_texture = Some(0);
        }
        Surfaces::Bumped => {
            let tilted = |at: u32| match at % 2 {
                0 => [200, 128, 232, 255],
                _ => [80, 60, 220, 255],
            };
            builder.scene.textures.push(
                Texture {
                    name: "bumps".into(),
                    kind: TextureKind::Normal,
                    width: 4,
                    height: 1,
                    texels: (0..4).map(tilted).collect(),
                }
                .into(),
            );
            special.normal_texture = Some(0);
        }
    }
    let special = builder.material(special);
    builder.room(
        [red, green, white, white, white, white],
        Vec3::new(-1.0, 0.0, -1.0),
        Vec3::new(1.0, 2.0, 1.0),
        true,
    );
    builder.cuboid(
        special,
        Vec3::new(-0.6, 0.0, -0.6),
        Vec3::new(0.1, 0.9, 0.1),
    );
    builder.quad(
        special,
        Vec3::new(0.2, 0.4, -0.7),
        Vec3::X * 0.7,
        Vec3::Y * 0.9,
    );
    let camera = Camera {
        eye: Vec3::new(0.0, 1.0, 3.4),
        target: Vec3::new(0.0, 1.0, 0.0),
        up: Vec3::Y,
        vfov_deg: 45.0,
    };
    builder.finish("small-room", lights, Vec3::ZERO, camera)
}

/// An open-front Cornell box in the dimensions of McGuire's, for where the shared one is not there.
pub fn open_cornell() -> Scene {
    let mut builder = Builder::default();
    let white = builder.matte("white", Vec3::new(0.725, 0.71, 0.68));
    let red = builder.matte("red", Vec3::new(0.63, 0.065, 0.05));
    let green = builder.matte("green", Vec3::new(0.14, 0.45, 0.091));
    builder.room(
        [red, green, white, white, white, white],
        Vec3::new(-1.0, 0.0, -1.0),
        Vec3::new(1.0, 2.0, 1.0),
        true,
    );
    builder.cuboid(
        white,
        Vec3::new(-0.7, 0.0, -0.7),
        Vec3::new(-0.1, 1.2, -0.1),
    );
    builder.cuboid(white, Vec3::new(0.1, 0.0, -0.1), Vec3::new(0.7, 0.6, 0.5));
    let light = Light::Point {
        position: Vec3::new(0.0, 1.6, 0.2),
        intensity: Vec3::new(6.0, 5.5, 4.5),
    };
    let camera = Camera {
        eye: Vec3::new(0.0, 1.0, 3.6),
        target: Vec3::new(0.0, 1.0, 0.0),
        up: Vec3::Y,
        vfov_deg: 45.0,
    };
    builder.finish("open-cornell", vec![light], Vec3::ZERO, camera)
}

/// A room with a block that moves through its wall and out of it.
pub fn moving_room(surfaces: Surfaces, light: Light) -> Scene {
    let mut scene = small_room(surfaces, vec![light]);
    let mut random = Random::new(1);
    let triangles: Vec<Corners> = lump(8, 1)
        .into_iter()
        .map(|corners| corners.map(|corner| corner - 0.5))
        .collect();
    let mut model = scene_of(&triangles, 2.0, &mut random);
    if surfaces != Surfaces::Emissive {
        model
            .materials
            .iter_mut()
            .for_each(|material| material.emission = Vec3::ZERO);
    }
    let turned = Pose {
        rotate_deg: Vec3::new(10.0, 80.0, 0.0),
        translate: Vec3::new(0.5, 1.2, 0.4),
    };
    add_model(
        &mut scene,
        model,
        &[
            still(Vec3::new(0.9, 0.5, 0.3)),
            turned,
            still(Vec3::new(0.0, 90.0, 0.0)),
        ],
    );
    scene
}

/// What makes techniques as small as they still work.
pub const TINY: &[(&str, &str)] = &[
    ("resolution", "16"),
    ("probes", "4"),
    ("cells", "4"),
    ("cache_resolution", "16"),
    ("source_resolution", "16"),
    ("reflection_probes", "3"),
    ("radiance_texels", "16"),
];
