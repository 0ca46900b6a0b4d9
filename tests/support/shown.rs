//! Pictures of given light or of a technique's, and what each pixel of them sees.

use super::compare::Worst as _;
use super::given::GIVEN;
use super::scenes::{add_model, lump, random_pose, scene_of, still};
use super::surfaces::every_surface;
use super::technique::{Builder, frame};
use super::{Random, ValidatedGpu};
use glam::{DVec2, DVec3, DVec4, Vec3};
use lumivox::frame::Renderer;
use lumivox::gi::entry::Entry;
use lumivox::gi::shared::screen::oracle::{Judged, Limits, Moved, Seen};
use lumivox::image::Aov;
use lumivox::render::SurfaceChannel;
use lumivox::scene::{Camera, Scene};

/// Of the pictures (px).
pub const SIZE: [u32; 2] = [56, 40];

/// Decisions nearer to a limit than this (footprints, cosines, shares of a sample) may fall either
/// way on the device.
pub const UNDECIDED: f64 = 3e-3;
/// Largest difference of light of about 1.
pub const TOLERANCE: f64 = 1e-4;

/// A renderer of small pictures.
pub struct Shown<'g> {
    /// Draws it.
    pub renderer: Renderer<'g>,
    /// The scene as it is.
    pub scene: Scene,
    /// Where it is seen from.
    pub camera: Camera,
}

/// What a frame shows.
pub struct Frame {
    /// What each pixel sees.
    pub seen: Vec<Option<Seen>>,
    /// Where that was in the frame before.
    pub moved: Vec<Option<Moved>>,
    /// Whether its model has moved.
    pub has_moved: Vec<bool>,
    /// Its light.
    pub light: Vec<DVec4>,
    /// What that weighs (frames).
    pub weight: Vec<f64>,
    /// What its visibility weighs (frames).
    pub visibility_weight: Vec<f64>,
    /// What it mirrors.
    pub mirrored: Vec<DVec3>,
    /// Roughness of its lobe; 0 where there is none.
    pub roughness: Vec<f64>,
}

/// All pixels.
pub fn places() -> impl Iterator<Item = [u32; 2]> {
    (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y]))
}

/// Where a camera sees a place of the picture (px) at this view depth (m).
pub fn position(camera: &Camera, place: DVec2, depth_m: f64) -> DVec3 {
    let [right, up, forward] = camera.basis().map(Vec3::as_dvec3);
    let [width, height] = SIZE.map(f64::from);
    let tan = f64::from((0.5 * camera.vfov_deg.to_radians()).tan());
    let x = (2.0 * place.x / width - 1.0) * tan * width / height;
    let y = (1.0 - 2.0 * place.y / height) * tan;
    camera.eye.as_dvec3() + depth_m * (forward + x * right + y * up)
}

impl<'g> Shown<'g> {
    /// Of given light, with these settings.
    pub fn new(gpu: &'g ValidatedGpu, scene: Scene, pairs: &[&str]) -> Self {
        Shown::by(&GIVEN, gpu, scene, pairs)
    }

    /// By a technique, with these settings.
    pub fn by(entry: &'static Entry, gpu: &'g ValidatedGpu, scene: Scene, pairs: &[&str]) -> Self {
        let settings = entry.settings(None, pairs).unwrap();
        let [width, height] = SIZE;
        let (renderer, _) =
            Renderer::new(gpu, &scene, entry, &settings, frame(width, height, 8)).unwrap();
        let camera = scene.camera;
        Shown {
            renderer,
            scene,
            camera,
        }
    }

    /// Moves the models.
    pub fn pose(&mut self, time_s: f32) {
        self.scene.set_time(time_s);
        self.renderer.set_pose(&self.scene).unwrap();
    }

    /// The light of each pixel of the last frame.
    pub fn light(&self) -> Vec<DVec4> {
        let found = self.renderer.indirect_light().unwrap();
        let rgb = found.irradiance.pixels.iter().map(|rgb| rgb.as_dvec3());
        rgb.zip(&found.visibility)
            .map(|(rgb, open)| rgb.extend(f64::from(*open)))
            .collect()
    }

    /// Draws a frame; `before` is where the frame before was seen from.
    pub fn draw(&mut self, before: &Camera) -> Frame {
        self.renderer.render(&self.camera).unwrap();
        let channel = |channel| self.renderer.surface(channel).unwrap().pixels;
        let aov = |aov| self.renderer.aov(aov).unwrap().pixels;
        let (depth, shading) = (aov(Aov::Depth), aov(Aov::Normal));
        let geometric = channel(SurfaceChannel::GeometricNormal);
        let motion = channel(SurfaceChannel::Motion);
        let turned = channel(SurfaceChannel::Turned);
        let material = channel(SurfaceChannel::Material);
        let tan = f64::from((0.5 * self.camera.vfov_deg.to_radians()).tan());
        let of = |(index, [x, y]): (usize, [u32; 2])| {
            let depth_m = f64::from(depth[index].x);
            let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let at = position(&self.camera, centre, depth_m);
            let seen = (depth_m > 0.0).then(|| Seen {
                position: at,
                geometric_normal: geometric[index].as_dvec3(),
                shading_normal: shading[index].as_dvec3(),
                material: material[index].x as u32,
                footprint: at.distance(self.camera.eye.as_dvec3()) * 2.0 * tan / f64::from(SIZE[1]),
            });
            let moved_px = motion.get(index).copied().unwrap_or_default().as_dvec3();
            let place = centre + moved_px.truncate();
            let is_inside =
                place.cmpge(DVec2::ZERO).all() && place.cmple(SIZE.map(f64::from).into()).all();
            let moved = (depth_m > 0.0 && is_inside).then(|| Moved {
                place,
                position: position(before, place, moved_px.z),
                turned: (turned[index] != Vec3::ZERO).then(|| turned[index].as_dvec3()),
            });
            (seen, moved)
        };
        let (seen, moved) = places().enumerate().map(of).unzip();
        let weights = self.renderer.history().unwrap();
        let weights = weights.map_or_else(Vec::new, |weights| weights.pixels);
        let mirrored = aov(Aov::Specular).into_iter().map(|rgb| rgb.as_dvec3());
        let roughness = channel(SurfaceChannel::Roughness).into_iter();
        Frame {
            mirrored: mirrored.collect(),
            roughness: roughness.map(|roughness| f64::from(roughness.x)).collect(),
            seen,
            moved,
            has_moved: turned.iter().map(|turned| *turned != Vec3::ZERO).collect(),
            light: self.light(),
            weight: weights.iter().map(|weight| f64::from(weight.x)).collect(),
            visibility_weight: weights.iter().map(|weight| f64::from(weight.y)).collect(),
        }
    }
}

/// A room of every kind of surface, with two models that jump about.
pub fn room() -> Scene {
    let mut scene = every_surface(false, false);
    let mut random = Random::new(3);
    for _ in 0..2 {
        let model = scene_of(&lump(5, 1), 0.0, &mut random);
        let mut poses = vec![still(Vec3::new(0.2, 0.8, 0.1))];
        poses.extend((0..4).map(|_| random_pose(&mut random, 0.4)));
        add_model(&mut scene, model, &poses);
    }
    scene
}

/// A camera that is moved a little.
pub fn nudged(camera: &Camera, random: &mut Random, reach_m: f32) -> Camera {
    let mut nudge = || reach_m * (Vec3::from([0; 3].map(|_: u32| random.unit())) - 0.5);
    Camera {
        eye: camera.eye + nudge(),
        target: camera.target + nudge(),
        ..*camera
    }
}

/// The largest difference where all decisions are clear, and the share of pixels where they are.
pub fn compare(found: &[DVec4], expected: &[Option<Judged<DVec4>>]) -> (f64, f64) {
    let clear = || {
        (found.iter().zip(expected))
            .filter_map(|(found, expected)| expected.map(|expected| (found, expected)))
            .filter(|(_, expected)| expected.least_margin > UNDECIDED)
    };
    let difference = clear().map(|(found, expected)| {
        let apart = (*found - expected.value).abs();
        apart.to_array().into_iter().worst()
    });
    let surfaces = expected.iter().flatten().count();
    (difference.worst(), clear().count() as f64 / surfaces as f64)
}

/// Those of the default settings.
pub const LIMITS: Limits = Limits {
    plane_tolerance: 0.5,
    normal_cosine: 0.9,
};

/// A floor of two materials, with a step of `height_m` where they meet, or with a crease where it
/// rises by `slope`, seen from above.
pub fn floors(height_m: f32, slope: f32) -> Scene {
    let mut builder = Builder::default();
    let [left, right] = ["left", "right"].map(|name| builder.matte(name, Vec3::splat(0.5)));
    builder.quad(
        left,
        Vec3::new(-9.0, 0.0, -9.0),
        Vec3::Z * 18.0,
        Vec3::X * 9.0,
    );
    let up = Vec3::new(0.0, height_m, -9.0);
    builder.quad(right, up, Vec3::Z * 18.0, Vec3::new(9.0, 9.0 * slope, 0.0));
    let camera = Camera {
        eye: Vec3::new(0.0, 4.0, 0.0),
        target: Vec3::ZERO,
        up: Vec3::NEG_Z,
        vfov_deg: 40.0,
    };
    builder.finish("floors", Vec::new(), Vec3::ZERO, camera)
}
