//! A bench for propagation on the CPU, in double precision (Olovsson 2012, §5.1): light of
//! [`Injector`]s or of a scene goes from cell to cell, action by action, by several
//! [`Propagator`]s side by side, with an account of its flux and its errors.
//!
//! Light has one colour here. Steps are those of [`super::lobes`].

mod account;
mod file;
mod injectors;
mod light;
mod record;
mod run;
mod scene;
mod slice;

use glam::{DVec3, UVec3};

pub use account::{Account, Errors, difference, errors_to, errors_within};
pub use file::{InjectorError, inject_file};
pub use injectors::{Injector, Occluder, direction};
pub use light::{Light, Shape};
pub use record::{CSV_HEADER, Record, Recorder};
pub use run::{Action, Level, Run};
pub use scene::{SceneSetupError, scene_setup};
pub use slice::{Shown, Slice, Spread, Which, draw_slice};

use super::octree;
use crate::gi::lpv::lobes::Scheme;
use crate::gi::lpv::{CellGrid, Directions};

/// Which grids light goes through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Structure {
    /// One.
    Uniform,
    /// Those of a full octree, each alone, merged by the finest that has light (Olovsson 2012).
    Octree,
    /// Those of a full octree one after the other: each takes over what the finer one still has on
    /// its way, and all are added up.
    Residual,
}

/// How a cell hands on what it has.
#[derive(Clone, Debug, PartialEq)]
pub enum Transport {
    /// As lobes in two bands.
    Lobes(Scheme),
    /// Along discrete directions.
    Ordinates(Directions),
}

/// One way for light to go from cell to cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Propagator {
    /// Its name on the command line.
    pub name: String,
    /// Which grids light goes through.
    pub structure: Structure,
    /// How a cell hands on what it has.
    pub transport: Transport,
}

/// Names of all propagators.
pub const PROPAGATORS: [&str; 10] = [
    "lobes30",
    "axis6",
    "stream",
    "ordinates",
    "octree-lobes30",
    "octree-axis6",
    "octree-stream",
    "residual-lobes30",
    "residual-axis6",
    "residual-stream",
];

impl Propagator {
    /// The one of a name, with this many directions where it has any.
    pub fn new(name: &str, directions: u32) -> Result<Self, String> {
        if !PROPAGATORS.contains(&name) {
            let known = PROPAGATORS.join(", ");
            return Err(format!("there is no propagator {name}; there are: {known}"));
        }
        let (structure, transport) = match name.split_once('-') {
            Some(("octree", transport)) => (Structure::Octree, transport),
            Some((_, transport)) => (Structure::Residual, transport),
            None => (Structure::Uniform, name),
        };
        Ok(Propagator {
            name: name.to_owned(),
            structure,
            transport: match transport {
                "lobes30" => Transport::Lobes(Scheme::Lobes30),
                "axis6" => Transport::Lobes(Scheme::Axis6),
                "stream" => Transport::Lobes(Scheme::Stream),
                _ => Transport::Ordinates(Directions::spiral(directions)),
            },
        })
    }
}

/// What a cell sends at first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Emission {
    /// A clamped cosine lobe: flux (W) times its unit axis.
    Cosine(DVec3),
    /// Two bands of intensity (W/sr), by the directions that light goes to.
    Coefficients([f64; 4]),
}

/// Light that starts in a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Injected {
    /// Where.
    pub cell: UVec3,
    /// What.
    pub emission: Emission,
}

/// The grid, what is in it, and how light is handed on.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    /// The finest grid.
    pub grid: CellGrid,
    /// Opaque faces of its cells, six bits each.
    pub faces: Vec<u32>,
    /// What starts in its cells; a cell may have several.
    pub injected: Vec<Injected>,
    /// Fraction of the flux that goes on at each step.
    pub gain: f64,
    /// Negative flux is none; of lobes.
    pub clamp_negative: bool,
}

impl Setup {
    /// An empty cube of cells with an edge of 1 m.
    pub fn empty(cells: u32) -> Self {
        let grid = CellGrid::new(glam::Vec3::ZERO, 1.0, UVec3::splat(cells));
        Setup {
            faces: vec![0; grid.count() as usize],
            grid,
            injected: Vec::new(),
            gain: 1.0,
            clamp_negative: false,
        }
    }

    /// How many grids light goes through.
    pub fn level_count(&self, structure: Structure) -> usize {
        match structure {
            Structure::Uniform => 1,
            Structure::Octree | Structure::Residual => octree::levels(self.grid).len(),
        }
    }

    /// The grids of all levels with their opaque faces, the finest first.
    fn levels(&self, structure: Structure) -> Vec<(CellGrid, Vec<u32>)> {
        let mut levels = vec![(self.grid, self.faces.clone())];
        if structure != Structure::Uniform {
            for coarse in octree::levels(self.grid).into_iter().skip(1) {
                let (fine, faces) = &levels[levels.len() - 1];
                let faces = octree::coarse_faces(fine, &coarse, faces);
                levels.push((coarse, faces));
            }
        }
        levels
    }
}
