//! Light: grazing, through few texels, dim and bright.

use glam::Vec3;

use super::scenes::{add_floor, brightened, camera, closed_room};
use super::{Change, Figure, OWN, StressCase, StressError, Trial};
use crate::frame::FrameSettings;
use crate::image::Image;
use crate::measure::draw::Ticks;
use crate::metrics::Channel;
use crate::render::ShadowSettings;
use crate::scene::bundled::mesh::Mesh;
use crate::scene::{Camera, Light, Scene};

/// Width and height of the map of grazing light (texels).
const COARSE_TEXELS: u32 = 64;

pub(super) static GRAZING_LIGHT: StressCase = StressCase {
    name: "grazing_light",
    help: "the sun sinks over a floor, a block and a wall; its map has 64×64 texels",
    source: "Hong 2015, section 2.3.2: flaws of shadow maps; Villegas & Ramírez, section VI-C",
    severity: "height of the sun [degrees]",
    severities: &[60.0, 30.0, 10.0, 3.0, 1.0],
    quick: &[60.0, 3.0],
    measure: |trial, height| {
        let coarse = Trial {
            frame: FrameSettings {
                shadows: ShadowSettings {
                    resolution: COARSE_TEXELS,
                    ..trial.frame.shadows
                },
                ..trial.frame
            },
            ..*trial
        };
        error(&coarse, &yard(height as f32))
    },
    ..OWN
};

pub(super) static RSM_UNDERSAMPLING: StressCase = StressCase {
    name: "rsm_undersampling",
    help: "fewer and fewer texels of the light's map stand for the lit surfaces",
    source: "Dachsbacher & Stamminger 2005; Olovsson 2012, equation 9: weight of a texel",
    severity: "edge of the map [texels]",
    severities: &[512.0, 128.0, 64.0, 32.0, 16.0],
    quick: &[128.0, 16.0],
    measure: |trial, texels| {
        let coarse = Trial {
            frame: FrameSettings {
                shadows: ShadowSettings {
                    resolution: texels as u32,
                    ..trial.frame.shadows
                },
                ..trial.frame
            },
            ..*trial
        };
        error(&coarse, &trial.base()?)
    },
    any_scene: true,
    ..OWN
};

pub(super) static LIGHT_LEVEL: StressCase = StressCase {
    name: "light_level",
    help: "all light is multiplied by a factor; the picture has to change by the same factor",
    source: "Hong 2015, section 2.5.3.1.3: sums overflow the bits of a texel; Crassin & Green \
             2012: RGBA8",
    severity: "factor (harmless at 1)",
    ticks: Ticks::Decades,
    severities: &[1e-4, 1e-2, 1.0, 1e2, 1e4, 1e5],
    quick: &[1e-4, 1e5],
    measure: |trial, factor| {
        let scene = trial.base()?;
        let picture = trial.indirect(&brightened(scene.clone(), factor as f32))?;
        let back = Image {
            pixels: picture
                .pixels
                .iter()
                .map(|pixel| *pixel / factor as f32)
                .collect(),
            ..picture
        };
        Ok(vec![
            trial
                .errors_of(&back, &scene, Channel::Luminance, 1)?
                .rel_rmse,
        ])
    },
    any_scene: true,
    ..OWN
};

pub(super) static CONTRAST: StressCase = StressCase {
    name: "contrast",
    help: "a dim room is beside one with a brighter lamp, behind eight voxels of wall; sums with \
           one step for all light lose the dim room",
    source: "Hong 2015, section 2.5.3.1.3: few bits a channel",
    severity: "lamp of the bright room over that of the dim one",
    ticks: Ticks::Decades,
    severities: &[1.0, 1e3, 1e6, 1e9],
    quick: &[1.0, 1e9],
    measure: |trial, ratio| error(trial, &dim_room(trial.cell_m(), ratio as f32)),
    ..OWN
};

pub(super) static COLOUR_BANDING: StressCase = StressCase {
    name: "colour_banding",
    help: "a dim lamp of one hue lights a grey room: what is stored with few bits gives one \
           channel another step than the next; the figure is how far the hue of a pixel is off",
    source: "Crassin & Green 2012: RGBA8; Hong 2015, section 2.5.3.1.3: few bits a channel",
    severity: "irradiance of the lamp [W/m²]",
    ticks: Ticks::Decades,
    severities: &[1.0, 1e-2, 1e-4, 1e-5, 1e-6],
    quick: &[1.0, 1e-5],
    figures: &[Figure {
        name: "hue_error",
        pass: 0.01,
        warn: 0.05,
    }],
    measure: |trial, irradiance| {
        let scene = brightened(tinted_room(), irradiance as f32);
        hue_error(&trial.diffuse(&scene)?).map(|error| vec![error])
    },
    ..OWN
};

/// Light of [`tinted_room`]: its channels are in no simple proportion.
const TINT: Vec3 = Vec3::new(1.0, 0.43, 0.071);

/// A closed grey room with a lamp that lights a surface a metre away with 1 W/m² of red.
fn tinted_room() -> Scene {
    let lamp = Light::Point {
        position: Vec3::new(0.3, 2.2, -0.4),
        intensity: TINT,
    };
    let seen = camera([0.0, 1.5, 1.9], [0.2, 1.2, -2.0], 60.0);
    closed_room()
        .0
        .into_scene("tinted_room", vec![lamp], Vec3::ZERO, seen)
}

/// RMS over lit pixels of how far the light's proportions are off those of the lamp: in a grey room
/// they are the same everywhere.
fn hue_error(light: &Image) -> Result<f64, StressError> {
    let red = |pixel: &&Vec3| pixel.x > 0.0;
    let squared = |pixel: &Vec3| {
        let off = *pixel / (pixel.x * TINT) - 1.0;
        f64::from(off.y).powi(2).max(f64::from(off.z).powi(2))
    };
    let squares: Vec<f64> = light.pixels.iter().filter(red).map(squared).collect();
    if squares.is_empty() {
        // All of it is lost.
        return Ok(1.0);
    }
    Ok((squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

/// How far the spot light is off the floor (m).
const SPOT_M: f32 = 1.2;

pub(super) static RAY_EFFECT: StressCase = StressCase {
    name: "ray_effect",
    help: "a spot light shrinks and keeps its power: light that leaves the small patch along few \
           directions makes rays",
    source: "Lathrop 1968: ray effects of discrete ordinates",
    severity: "width of the patch [cells]",
    severities: &[16.0, 8.0, 4.0, 2.0, 1.0, 0.5],
    quick: &[8.0, 1.0],
    changes: &[Change {
        name: "directions",
        values: &["8", "32", "96", "192", "384", "1024"],
        needs: None,
    }],
    measure: |trial, width| error(trial, &spotted_room(0.5 * width as f32 * trial.cell_m())),
    ..OWN
};

/// A closed room, and a spot light on a patch of its floor with this radius (m).
fn spotted_room(radius_m: f32) -> Scene {
    let (mesh, _) = closed_room();
    let outer = radius_m.atan2(SPOT_M);
    // 20 W/sr over a right angle.
    let intensity = 20.0 * (1.0 - std::f32::consts::FRAC_PI_4.cos()) / (1.0 - outer.cos());
    let light = Light::Spot {
        position: Vec3::new(0.3, SPOT_M, -0.4),
        direction: -Vec3::Y,
        intensity: Vec3::splat(intensity),
        inner_deg: 0.9 * outer.to_degrees(),
        outer_deg: outer.to_degrees(),
    };
    mesh.into_scene(
        "spotted-room",
        vec![light],
        Vec3::ZERO,
        camera([-1.6, 2.2, 1.7], [0.4, 0.9, -1.0], 75.0),
    )
}

fn error(trial: &Trial<'_>, scene: &Scene) -> Result<Vec<f64>, StressError> {
    Ok(vec![trial.errors(scene, Channel::Luminance, 1)?.rel_rmse])
}

/// A floor with a block and a wall behind it, and the sun in front of them so high (degrees).
pub(super) fn yard(height_deg: f32) -> Scene {
    let mut mesh = Mesh::default();
    let floor = mesh.matte("floor", [0.6, 0.6, 0.6]);
    add_floor(&mut mesh, floor);
    let wall = mesh.matte("wall", [0.7, 0.5, 0.4]);
    mesh.quad(
        wall,
        [[-2.0, 0.0], [2.0, 0.0], [2.0, 2.0], [-2.0, 2.0]].map(|[x, y]| Vec3::new(x, y, -1.9)),
    );
    let block = mesh.matte("block", [0.5, 0.6, 0.7]);
    mesh.cuboid(
        [block; 6],
        Vec3::new(-1.1, 0.0, -0.9),
        Vec3::new(-0.2, 0.8, 0.1),
    );
    let (sine, cosine) = height_deg.to_radians().sin_cos();
    let direction = Vec3::new(0.25 * cosine, -sine, -cosine).normalize();
    let light = Light::Directional {
        direction,
        irradiance: Vec3::splat(4.0),
    };
    mesh.into_scene(
        "yard",
        vec![light],
        Vec3::ZERO,
        camera([0.5, 1.7, 2.6], [0.0, 0.6, -1.0], 55.0),
    )
}

fn dim_room(cell_m: f32, ratio: f32) -> Scene {
    let (mut mesh, _) = closed_room();
    let wall = mesh.matte("wall", [0.7, 0.7, 0.7]);
    mesh.cuboid(
        [wall; 6],
        Vec3::new(-4.0 * cell_m, 0.0, -2.0),
        Vec3::new(4.0 * cell_m, 3.0, 2.0),
    );
    let lamp = |x: f32, intensity: f32| Light::Point {
        position: Vec3::new(x, 2.2, 0.3),
        intensity: Vec3::splat(intensity),
    };
    let seen: Camera = camera([1.8, 1.7, 1.8], [1.0, 0.8, -1.5], 75.0);
    mesh.into_scene(
        "dim-room",
        vec![lamp(-1.4, 4.0 * ratio), lamp(1.4, 4.0)],
        Vec3::ZERO,
        seen,
    )
}
