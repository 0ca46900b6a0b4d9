//! Walls thinner than voxels: light of one room in the next.

use crate::frame::Renderer;
use crate::image::{Aov, Image};
use crate::metrics::stability::leak;
use crate::reference::{self, Bounces, Filter, Sampling, cache_dir, cached};
use crate::scene::{Camera, Scene};

use super::{Change, Probe, StressCase, StressError};

/// The row of the list.
pub(super) static CASE: StressCase = StressCase {
    name: "thin_walls",
    help: "light leaks through a closed wall into the room behind it: indirect light there over the lit room's mean, at the worst of three places of the wall in the grid",
    source: "Crassin et al. 2011; Villegas & Ramírez, section XI",
    severity: "wall [voxels]",
    severities: &[4.0, 2.0, 1.0, 0.5, 0.25],
    figure: "leak",
    pass: 0.03,
    warn: 0.1,
    changes: &[
        Change { name: "surface", values: &[], needs: None },
        Change { name: "opacity", values: &[], needs: CONES },
        Change { name: "injection", values: &[], needs: None },
        Change { name: "anisotropic", values: &[], needs: None },
        Change { name: "faces", values: &[], needs: None },
        Change { name: "gather", values: &[], needs: None },
        Change { name: "radiance", values: &[], needs: RAYS },
        Change { name: "self_height", values: &["0", "0.5"], needs: RAYS },
        Change { name: "contour_slack", values: &["-1", "0", "0.5"], needs: RAYS },
        Change { name: "ray_start", values: &["0", "1"], needs: RAYS },
        Change { name: "mip_filter", values: &[], needs: CONES },
        Change { name: "lattice", values: &[], needs: None },
        Change { name: "opacity_exponent", values: &["1", "2.5", "5"], needs: CONES },
        Change { name: "aperture_scale", values: &["0.05", "0.15", "1"], needs: CONES },
        Change { name: "height_clamp", values: &["0", "5"], needs: CONES },
        Change { name: "start_offset", values: &["0.5", "1.5", "3"], needs: CONES },
    ],
    measure,
};

const RAYS: Option<(&str, &str)> = Some(("gather", "rays"));
const CONES: Option<(&str, &str)> = Some(("gather", "cones"));

/// Where the middle of the wall is, beyond a border between voxels (voxels): its faces lie in neighbouring voxels, or, if it is thin, in one.
const PLACES: [f64; 3] = [0.0, 0.3, 0.6];

/// Of a technique without a resolution.
const RESOLUTION: u32 = 64;

fn measure(probe: &Probe<'_>, wall_voxels: f64) -> Result<f64, StressError> {
    let resolution = probe.settings.find_count("resolution").unwrap_or(RESOLUTION);
    let leaks = PLACES.iter().map(|place| leak_of(probe, &two_rooms(resolution, wall_voxels, *place)?));
    leaks.collect::<Result<Vec<f64>, StressError>>().map(|leaks| leaks.into_iter().fold(0.0, f64::max))
}

/// Two closed rooms with a wall of this thickness and place \[voxels\]. The grid is centred on the scene: a longer lit room moves the wall off its middle,
/// which is a border between voxels.
fn two_rooms(resolution: u32, wall_voxels: f64, place_voxels: f64) -> Result<Scene, StressError> {
    const ROOMS_M: f64 = 8.0;
    let n = f64::from(resolution);
    // Voxels over extent (the grid's equation 1); extent = rooms + wall + twice the way of the wall.
    let voxel_over_extent = (1.04 / n).max(1.0 / (n - 4.5));
    let voxel_m = voxel_over_extent * ROOMS_M / (1.0 - voxel_over_extent * (wall_voxels + 2.0 * place_voxels));
    let parameters = [("thickness_m", wall_voxels * voxel_m), ("lit_length_m", 0.5 * ROOMS_M + 2.0 * place_voxels * voxel_m)];
    Ok(Scene::bundled("two-rooms", &parameters.map(|(name, value)| (name.to_owned(), value)))?)
}

fn leak_of(probe: &Probe<'_>, scene: &Scene) -> Result<f64, StressError> {
    let dark = scene.camera;
    let mirrored = |point: glam::Vec3| point * glam::Vec3::new(-1.0, 1.0, 1.0);
    let lit = Camera { eye: mirrored(dark.eye), target: mirrored(dark.target), ..dark };
    let (mut renderer, _) = Renderer::new(probe.gpu, scene, probe.entry, probe.settings, probe.frame)?;
    let mut look = |camera: &Camera| {
        renderer.render(camera)?;
        renderer.aov(Aov::Indirect)
    };
    let pictures = both(look(&dark)?, look(&lit)?);
    // A technique without a bounce is held against one: it leaks nothing.
    let bounces = (probe.entry.bounces)(probe.settings).map_or(Bounces::Full, |bounces| Bounces::Count(bounces.max(1)));
    let reference = |camera: Camera| -> Result<Image, StressError> {
        let [width, height] = probe.frame.size;
        let settings = reference::Settings { width, height, bounces, filter: Filter::Center, sampling: Sampling::Fixed { spp: 64 }, seed: 0 };
        Ok(cached(&Scene { camera, ..scene.clone() }, &settings, &cache_dir(), &|_| {})?.indirect())
    };
    Ok(leak(&pictures, &both(reference(dark)?, reference(lit)?), None)?)
}

/// One picture above the other.
fn both(mut upper: Image, lower: Image) -> Image {
    upper.pixels.extend(lower.pixels);
    Image { height: upper.height + lower.height, ..upper }
}
