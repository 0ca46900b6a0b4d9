//! How the cells of a grid are lit, as settings say.

use super::leaves::LeafSettings;
use super::levels::Transfer;
use super::lobes::{LobeSettings, Occlusion};
use crate::gi::{MapNeeds, Needs, Settings};

/// Where the light of lights comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Texels of reflective shadow maps, into the cells in front of them.
    Rsm,
    /// Opaque faces, lit at the place where the segment between two cells meets a surface.
    Faces,
}

/// How light goes along discrete directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ordinates {
    /// Each cell once, from its upwind neighbours.
    Sweep,
    /// Each cell once, from four cells of the slice before.
    Slices,
    /// All cells at once, in so many steps.
    Jacobi(u32),
}

impl Ordinates {
    /// As the technique's settings say.
    fn new(settings: &Settings) -> Self {
        match settings.find_choice("schedule") {
            Some("jacobi") => Ordinates::Jacobi(settings.count("iterations")),
            _ if settings.find_choice("scheme") == Some("slices") => Ordinates::Slices,
            _ => Ordinates::Sweep,
        }
    }
}

/// What larger cells there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Octree {
    /// Far from surfaces, instead of smaller ones.
    Leaves(LeafSettings),
    /// Whole grids of them.
    Levels(Transfer),
}

impl Octree {
    /// As the technique's settings say; `None` where it has none.
    fn new(settings: &Settings) -> Option<Self> {
        Some(match settings.find_choice("octree")? {
            "levels" => Octree::Levels(Transfer::new(settings)),
            _ => Octree::Leaves(LeafSettings {
                guard: settings.count("guard"),
                max_level: settings.count("max_level"),
            }),
        })
    }
}

/// How cells are lit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellSettings {
    /// Where light comes from.
    pub source: Source,
    /// Discrete directions that it goes along.
    pub directions: u32,
    /// How it goes along them.
    pub ordinates: Ordinates,
    /// Bounces, at least 1: a sweep each.
    pub bounces: u32,
    /// No further bounce where what opaque faces send changes by this much or less, over the whole;
    /// 0: all bounces.
    pub least_change: f32,
    /// Texels along an edge of each reflective shadow map that inject light.
    pub rsm_texels: u32,
    /// How far off the surface its light is injected (cells).
    pub injection_shift: f32,
    /// What stops light between two cells.
    pub occlusion: Occlusion,
    /// Layers of what the camera sees that stop light besides what lights see.
    pub blocker_layers: u32,
    /// How lobes are handed on, where no directions are swept.
    pub lobes: Option<LobeSettings>,
    /// Bands of spherical harmonics that lobes have; of streams 2 to 4, of others 2.
    pub bands: u32,
    /// Larger cells besides those of the grid: leaves where directions are swept, levels where
    /// lobes are handed on.
    pub octree: Option<Octree>,
    /// Whether pixels look up direction by direction, while the last bounce is swept.
    pub keeps_directions: bool,
}

impl CellSettings {
    /// As the technique's settings say.
    pub fn new(settings: &Settings) -> Self {
        let octree = Octree::new(settings);
        let has_leaves = matches!(octree, Some(Octree::Leaves(_)));
        let this = CellSettings {
            source: if settings.is("source", "faces") {
                Source::Faces
            } else {
                Source::Rsm
            },
            directions: match settings.count("directions") {
                0 => (3 * settings.count("resolution")).min(1024),
                count => count,
            },
            ordinates: Ordinates::new(settings),
            bounces: settings.count("bounces"),
            least_change: settings.find_number("bounce_change").unwrap_or(0.0),
            rsm_texels: settings.count("rsm_texels"),
            injection_shift: settings.number("injection_shift"),
            occlusion: if has_leaves {
                Occlusion::Faces
            } else {
                Occlusion::new(settings)
            },
            blocker_layers: 0,
            lobes: LobeSettings::new(settings).filter(|_| !has_leaves),
            bands: settings.find_count("bands").unwrap_or(2),
            octree,
            keeps_directions: false,
        };
        let is_asked = settings.find_choice("lookup") == Some("directions");
        let layers = settings.find_count("blocker_layers").unwrap_or(0);
        CellSettings {
            blocker_layers: if this.is_fuzzy() { layers } else { 0 },
            keeps_directions: is_asked && this.sweeps(),
            ..this
        }
    }

    /// Whether each cell of the grid is swept once, from its upwind neighbours.
    pub fn sweeps(&self) -> bool {
        let has_cells = self.lobes.is_none() && self.octree.is_none();
        has_cells && self.ordinates == Ordinates::Sweep
    }

    /// Whether blocking potential stops light.
    pub(super) fn is_fuzzy(&self) -> bool {
        self.occlusion == Occlusion::Fuzzy && self.lobes.is_some()
    }

    /// What lighting cells reads.
    pub(super) fn needs(&self) -> Needs {
        let reads_texels = self.source == Source::Rsm || self.occlusion == Occlusion::Fuzzy;
        Needs::maps(if reads_texels {
            MapNeeds::Reflective
        } else {
            MapNeeds::Shadows
        })
    }
}
