//! Walls thinner than voxels: light of one room in the next.

use glam::Vec3;

use super::scenes::cell_share;
use super::{Change, Figure, OWN, StressCase, StressError, Ticks, Trial};
use crate::frame::Renderer;
use crate::image::{Aov, Image};
use crate::metrics::stability::leak;
use crate::scene::{Camera, Scene};

/// The row of the list.
pub(super) static CASE: StressCase = StressCase {
    name: "thin_walls",
    help: "light leaks through a closed wall into a dark room; the figure is the indirect light \
           there over the lit room's mean; the wall stands at two places in the grid and turned \
           by 27°, and the worst counts",
    source: "Crassin et al. 2011; Villegas & Ramírez, section XI",
    severity: "wall [voxels]",
    severities: &[4.0, 2.0, 1.0, 0.5, 0.25, 0.1],
    quick: &[4.0, 0.25],
    figures: &[Figure {
        name: "leak",
        pass: 0.03,
        warn: 0.1,
    }],
    changes: &[
        Change {
            name: "surface",
            values: &[],
            needs: None,
        },
        Change {
            name: "opacity",
            values: &[],
            needs: CONES,
        },
        Change {
            name: "injection",
            values: &[],
            needs: None,
        },
        Change {
            name: "source",
            values: &[],
            needs: None,
        },
        Change {
            name: "injection_shift",
            values: &["0", "1"],
            needs: None,
        },
        Change {
            name: "gather_shift",
            values: &["0.5", "1.5"],
            needs: None,
        },
        Change {
            name: "anisotropic",
            values: &[],
            needs: None,
        },
        Change {
            name: "faces",
            values: &[],
            needs: None,
        },
        Change {
            name: "normals",
            values: &[],
            needs: CONES,
        },
        Change {
            name: "gather",
            values: &[],
            needs: None,
        },
        Change {
            name: "radiance",
            values: &[],
            needs: RAYS,
        },
        Change {
            name: "self_height",
            values: &["0", "0.5"],
            needs: RAYS,
        },
        Change {
            name: "contour_slack",
            values: &["-1", "0", "0.5"],
            needs: RAYS,
        },
        Change {
            name: "ray_start",
            values: &["0", "1"],
            needs: RAYS,
        },
        Change {
            name: "mip_filter",
            values: &[],
            needs: CONES,
        },
        Change {
            name: "lattice",
            values: &[],
            needs: None,
        },
        Change {
            name: "opacity_exponent",
            values: &["1", "2.5", "5"],
            needs: CONES,
        },
        Change {
            name: "aperture_scale",
            values: &["0.05", "0.15", "1"],
            needs: CONES,
        },
        Change {
            name: "height_clamp",
            values: &["0", "5"],
            needs: CONES,
        },
        Change {
            name: "start_offset",
            values: &["0.5", "1.5", "3"],
            needs: CONES,
        },
    ],
    measure,
    ..OWN
};

/// The row of the list.
pub(super) static WALL_SHIFT: StressCase = StressCase {
    name: "wall_shift",
    help: "light leaks through a closed wall that stands at 16 places along a quarter of a room: \
           next to what the technique keeps, and in it; the worst counts",
    source: "Majercik et al. 2019: probes near and in walls; Kahl 2019, section 6.3.1",
    severity: "wall [m]",
    ticks: Ticks::Decades,
    severities: &[0.2, 0.02, 0.002],
    quick: &[0.02],
    figures: &[Figure {
        name: "leak",
        pass: 0.03,
        warn: 0.1,
    }],
    changes: &[Change {
        name: "visibility",
        values: &[],
        needs: None,
    }],
    measure: |trial, wall_m| {
        let steps = 0..trial.effort.steps;
        let shift_m = |step: u32| f64::from(step) / f64::from(trial.effort.steps);
        let scenes = steps.map(|step| {
            let parameters = [
                ("thickness_m", wall_m),
                ("lit_length_m", 4.0 + shift_m(step)),
            ];
            let named = parameters.map(|(name, value)| (name.to_owned(), value));
            Ok(Scene::bundled("two-rooms", &named)?)
        });
        let scenes: Vec<Scene> = scenes.collect::<Result<_, StressError>>()?;
        // One reference says what is dark, and how bright the lit room is.
        let leaks = scenes.iter().map(|scene| leak_of(trial, scene, &scenes[0]));
        let leaks: Vec<f64> = leaks.collect::<Result<_, StressError>>()?;
        Ok(vec![leaks.into_iter().fold(0.0, f64::max)])
    },
    ..OWN
};

const RAYS: Option<(&str, &str)> = Some(("gather", "rays"));
const CONES: Option<(&str, &str)> = Some(("gather", "cones"));

/// How the wall lies in the grid. First: where its middle is, beyond a border between voxels
/// (voxels): its faces lie in neighbouring voxels or, if it is thin, in one. Second: how far it is
/// turned about the vertical (degrees), so that it passes through voxels in every way.
const PLACES: [(f64, f64); 3] = [(0.0, 0.0), (0.4, 0.0), (0.0, 27.0)];

fn measure(trial: &Trial<'_>, wall_voxels: f64) -> Result<Vec<f64>, StressError> {
    let leaks = PLACES.iter().map(|place| {
        let scene = two_rooms(trial.resolution(), wall_voxels, *place)?;
        leak_of(trial, &scene, &scene)
    });
    leaks
        .collect::<Result<Vec<f64>, StressError>>()
        .map(|leaks| vec![leaks.into_iter().fold(0.0, f64::max)])
}

/// Two closed rooms with a wall of this thickness \[voxels\] and place. The grid is centred on the
/// scene: a longer lit room moves the wall off its middle, which is a border between voxels.
fn two_rooms(
    resolution: u32,
    wall_voxels: f64,
    (place_voxels, turn_deg): (f64, f64),
) -> Result<Scene, StressError> {
    /// Length of both rooms, and width.
    const ROOMS_M: [f64; 2] = [8.0, 4.0];
    let (voxel_over_extent, [sine, cosine]) = (
        cell_share(resolution),
        [turn_deg.to_radians().sin(), turn_deg.to_radians().cos()],
    );
    // Extent = rooms + wall + twice the way of the wall, turned.
    let extent_m = (cosine * ROOMS_M[0] + sine * ROOMS_M[1])
        / (1.0 - voxel_over_extent * cosine * (wall_voxels + 2.0 * place_voxels));
    let cell_m = voxel_over_extent * extent_m;
    let parameters = [
        ("thickness_m", wall_voxels * cell_m),
        (
            "lit_length_m",
            0.5 * ROOMS_M[0] + 2.0 * place_voxels * cell_m,
        ),
        ("turn_deg", turn_deg),
    ];
    Ok(Scene::bundled(
        "two-rooms",
        &parameters.map(|(name, value)| (name.to_owned(), value)),
    )?)
}

/// Light in the dark room of a scene over that in the lit one, which is as bright as in `expected`.
fn leak_of(trial: &Trial<'_>, scene: &Scene, expected: &Scene) -> Result<f64, StressError> {
    let dark = scene.camera;
    // Half a turn about the vertical through the wall's middle is the other room.
    let opposite = |point: Vec3| point * Vec3::new(-1.0, 1.0, -1.0);
    let lit = Camera {
        eye: opposite(dark.eye),
        target: opposite(dark.target),
        ..dark
    };
    let (mut renderer, _) =
        Renderer::new(trial.gpu, scene, trial.entry, trial.settings, trial.frame)?;
    let mut look = |camera: &Camera| {
        renderer.render(camera)?;
        renderer.aov(Aov::Indirect)
    };
    let pictures = both(look(&dark)?, look(&lit)?);
    let reference = |camera: Camera| {
        Ok::<Image, StressError>(
            trial
                .reference(
                    &Scene {
                        camera,
                        ..expected.clone()
                    },
                    1,
                )?
                .0,
        )
    };
    Ok(leak(
        &pictures,
        &both(reference(dark)?, reference(lit)?),
        None,
    )?)
}

/// One picture above the other.
fn both(mut upper: Image, lower: Image) -> Image {
    upper.pixels.extend(lower.pixels);
    Image {
        height: upper.height + lower.height,
        ..upper
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gi::shared::voxel::VoxelGrid;

    /// The wall has the thickness and the place that were asked for, in voxels of the grid that
    /// techniques make.
    #[test]
    fn walls_are_where_they_should_be() -> Result<(), Box<dyn std::error::Error>> {
        for (wall, (place, turn_deg)) in [4.0, 1.0, 0.25]
            .into_iter()
            .flat_map(|wall| PLACES.map(|place| (wall, place)))
        {
            let scene = two_rooms(64, wall, (place, turn_deg))?;
            let grid = VoxelGrid::around(scene.bounds().ok_or("no bounds")?, 64);
            let back = glam::Quat::from_rotation_y(-(turn_deg as f32).to_radians());
            let is_wall = |triangle: &&crate::scene::Triangle| {
                scene.materials[triangle.material as usize].name == "wall"
            };
            let corners = scene
                .triangles
                .iter()
                .filter(is_wall)
                .flat_map(|triangle| triangle.vertices);
            let faces: Vec<f32> = corners
                .map(|vertex| {
                    (back * Vec3::from(scene.vertices[vertex as usize].position)).x
                        / grid.voxel_size
                })
                .collect();
            let (low, high) = faces
                .iter()
                .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), face| {
                    (low.min(*face), high.max(*face))
                });
            assert!(
                (high - low - wall as f32).abs() < 1e-3,
                "{wall}, {turn_deg}: {low} to {high}"
            );
            let middle = (0.5 * (low + high) * grid.voxel_size - grid.origin.x) / grid.voxel_size;
            assert!(
                turn_deg != 0.0
                    || (middle.fract() - place as f32).abs() < 1e-3
                    || (1.0 - middle.fract() - place as f32).abs() < 1e-3,
                "{wall}, {place}: {middle}"
            );
        }
        Ok(())
    }
}
