//! CPU twin of `cone.view` where it shows how a volume divides space.

use std::f64::consts::PI;

use glam::{DVec3, DVec4};

/// A cell that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Edge \[voxels\]; its corners are at multiples of it.
    pub edge: f64,
    /// What is drawn of it.
    pub kind: CellKind,
}

/// What a cell holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellKind {
    /// Nothing: it is not drawn.
    Hollow,
    /// Something: its faces are drawn.
    Solid,
    /// A node at which the descent of an octree ends too early: its edges are drawn, faintly where
    /// it is small.
    EmptyNode,
}

/// A ray from the eye, and how large a pixel is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeRay {
    /// Where the ray starts, grid space \[voxels\].
    pub origin: DVec3,
    /// Where the ray goes, a unit vector.
    pub direction: DVec3,
    /// Edge of a pixel at distance 1, in the middle of the picture.
    pub pixel: f64,
}

/// The colour of a level, finest first; between two levels a mixture, half white.
fn level_color(level: f64) -> DVec3 {
    let of = |level: f64| {
        let hues = [0.0, 1.0, 2.0]
            .map(|third: f64| 0.5 + 0.5 * (2.0 * PI * (level / 6.0 - third / 3.0)).cos());
        if level < 5.5 {
            DVec3::from(hues)
        } else {
            0.5 * DVec3::from(hues)
        }
    };
    let share = level.fract();
    if share > 0.0 {
        of(level.floor())
            .lerp(of(level.floor() + 1.0), share)
            .lerp(DVec3::ONE, 0.5)
    } else {
        of(level)
    }
}

/// What a ray sees of the cells of a volume from a level on, front to back: premultiplied by
/// opacity, opacity. `cell_at` is told a position and `level_at`, on what level a cell is read
/// there, too (both \[voxels\]); the grid is `resolution` voxels wide.
pub fn view_structure(
    cell_at: impl Fn(DVec3) -> Cell,
    level_at: impl Fn(DVec3, Cell) -> f64,
    resolution: f64,
    level: u32,
    ray: EyeRay,
) -> DVec4 {
    let EyeRay {
        origin,
        direction,
        pixel,
    } = ray;
    let finest = f64::from(1u32 << level);
    let distances = |forward: DVec3, back: DVec3| {
        let plane = |axis: usize| {
            if direction[axis] > 0.0 {
                forward[axis]
            } else {
                back[axis]
            }
        };
        (DVec3::new(plane(0), plane(1), plane(2)) - origin) / direction
    };
    let (corner, end) = (DVec3::ZERO, DVec3::splat(resolution));
    let mut t = distances(corner, end).max_element().max(0.0);
    let exit = distances(end, corner).min_element();
    let mut seen = DVec4::ZERO;
    while t < exit && seen.w < 0.995 {
        let inside = origin + (t + 1e-3 * finest) * direction;
        let cell = cell_at(inside);
        let low = (inside / cell.edge).floor() * cell.edge;
        let near = distances(low, low + cell.edge);
        if near.max_element() > 0.0 {
            let entry = (near.max_position(), direction);
            let point = origin + near.max_element() * direction;
            seen += (1.0 - seen.w)
                * drawn(
                    cell,
                    point,
                    entry,
                    (level_at(point + 1e-3 * finest * direction, cell), level),
                    pixel * near.max_element(),
                );
        }
        t = distances(low + cell.edge, low)
            .min_element()
            .max(t + 1e-3 * finest);
    }
    seen
}

/// A cell where a ray enters it, across which axis and in which direction; `pixel` is the edge of
/// one there \[voxels\], the longer along an axis of the face the more grazing the ray.
fn drawn(
    cell: Cell,
    point: DVec3,
    (entered, direction): (usize, DVec3),
    (level, finest): (f64, u32),
    pixel: f64,
) -> DVec4 {
    let beside = (0..3).filter(|axis| *axis != entered);
    let line = |edge: f64, half_width: f64| {
        let across = |axis: usize| {
            let pixel = pixel * (direction[axis] / direction[entered]).hypot(1.0);
            let to_next = (point[axis] / edge - (point[axis] / edge).round()).abs() * edge;
            (half_width + 0.5 - to_next / pixel).clamp(0.0, 1.0)
                * (0.25 * edge / pixel - 0.5).clamp(0.0, 1.0)
        };
        beside.clone().map(across).fold(0.0, f64::max)
    };
    match cell.kind {
        CellKind::Hollow => DVec4::ZERO,
        CellKind::Solid => {
            let face = [0.8, 1.0, 0.6][entered]
                * (1.0 - 0.5 * line(cell.edge, 0.5))
                * (1.0 - 0.9 * line(2.0 * cell.edge, 1.0));
            (face * level_color(level)).extend(1.0)
        }
        CellKind::EmptyNode => {
            (0.1 * (cell.edge.log2() - f64::from(finest))).min(0.4)
                * line(cell.edge, 0.5)
                * level_color(level).extend(1.0)
        }
    }
}
