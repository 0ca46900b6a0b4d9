//! Faces with more than three corners, as triangles.
//!
//! A polygon whose fan from its first corner covers it, as of every convex one, is split as that
//! fan. Others are projected along their Newell normal and split by ear clipping.

use earcut::Earcut;
use glam::{DVec2, DVec3};

/// Share of a polygon's area by which a triangle of the fan may be turned against the polygon:
/// rounding of nearly straight corners.
const FAN_TOLERANCE: f64 = 1e-6;

/// Share of a polygon's area by which its triangles may differ from it before it counts as crossing
/// itself.
const AREA_TOLERANCE: f64 = 1e-3;

/// Splits polygons; keeps its buffers between them.
#[derive(Default)]
pub(super) struct Splitter {
    earcut: Earcut<f64>,
    points: Vec<DVec2>,
    indices: Vec<u32>,
    triangles: Vec<[u32; 3]>,
}

/// A split polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Split<'a> {
    /// Indices of corners, in the polygon's sense of rotation.
    pub(super) triangles: &'a [[u32; 3]],
    /// Whether the polygon crosses itself, so that its triangles cover it only as well as can be.
    pub(super) crosses_itself: bool,
}

impl Splitter {
    /// Splits a polygon of at least three corners.
    pub(super) fn split(&mut self, corners: &[DVec3]) -> Split<'_> {
        let fan_areas = || {
            corners
                .windows(2)
                .skip(1)
                .map(|pair| (pair[0] - corners[0]).cross(pair[1] - corners[0]))
        };
        let area = fan_areas().sum::<DVec3>();
        let is_turned =
            |triangle: DVec3| triangle.dot(area) < -FAN_TOLERANCE * area.length_squared();
        self.triangles.clear();
        let mut crosses_itself = false;
        if let Some(normal) = area.try_normalize().filter(|_| fan_areas().any(is_turned)) {
            let covered = self.clip_ears(corners, normal);
            crosses_itself = (covered - area.length()).abs() > AREA_TOLERANCE * area.length();
        }
        if self.triangles.is_empty() {
            self.triangles
                .extend((2..corners.len() as u32).map(|last| [0, last - 1, last]));
        }
        Split {
            triangles: &self.triangles,
            crosses_itself,
        }
    }

    /// Fills `triangles`; returns twice their area.
    fn clip_ears(&mut self, corners: &[DVec3], normal: DVec3) -> f64 {
        let right = normal.any_orthonormal_vector();
        let up = normal.cross(right);
        self.points.clear();
        self.points.extend(
            corners
                .iter()
                .map(|corner| corner - corners[0])
                .map(|at| DVec2::new(at.dot(right), at.dot(up))),
        );
        self.earcut.earcut(
            self.points.iter().map(DVec2::to_array),
            &[],
            &mut self.indices,
        );
        let mut covered = 0.0;
        for &[a, b, c] in self.indices.as_chunks().0 {
            let [at_a, at_b, at_c] = [a, b, c].map(|index| self.points[index as usize]);
            let area = (at_b - at_a).perp_dot(at_c - at_a);
            covered += area.abs();
            self.triangles
                .push(if area < 0.0 { [a, c, b] } else { [a, b, c] });
        }
        covered
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    /// An L of area 3.
    const L: [[f64; 2]; 6] = [
        [0.0, 0.0],
        [2.0, 0.0],
        [2.0, 1.0],
        [1.0, 1.0],
        [1.0, 2.0],
        [0.0, 2.0],
    ];

    fn lift(outline: &[[f64; 2]], rotation: DQuat) -> Vec<DVec3> {
        outline
            .iter()
            .map(|[x, y]| rotation * DVec3::new(*x, *y, 0.0) + DVec3::new(5.0, -3.0, 7.0))
            .collect()
    }

    fn area_vector(corners: &[DVec3], [a, b, c]: [u32; 3]) -> DVec3 {
        let [a, b, c] = [a, b, c].map(|index| corners[index as usize]);
        0.5 * (b - a).cross(c - a)
    }

    /// Splits; checks that no triangle is turned and that together they have the polygon's area.
    fn check(outline: &[[f64; 2]], area: f64, what: &str) -> Vec<[u32; 3]> {
        let rotation = DQuat::from_axis_angle(DVec3::new(0.3, 0.8, -0.5).normalize(), 1.1);
        let corners = lift(outline, rotation);
        let mut splitter = Splitter::default();
        let split = splitter.split(&corners);
        assert!(!split.crosses_itself, "{what}");
        let normal = rotation * DVec3::Z * area.signum();
        let areas: Vec<f64> = split
            .triangles
            .iter()
            .map(|triangle| area_vector(&corners, *triangle).dot(normal))
            .collect();
        assert!(
            areas.iter().all(|area| *area > -1e-6),
            "{what}: a triangle is turned: {areas:?}"
        );
        assert!(
            (areas.iter().sum::<f64>() - area.abs()).abs() < 1e-6,
            "{what}: {areas:?} make {area}"
        );
        split.triangles.to_vec()
    }

    #[test]
    fn an_l_is_covered_once_from_every_corner_and_both_sides() {
        for first in 0..6 {
            let mut outline = L;
            outline.rotate_left(first);
            let triangles = check(&outline, 3.0, &format!("from corner {first}"));
            assert_eq!(triangles.len(), 4);
            outline.reverse();
            check(&outline, -3.0, &format!("from corner {first}, reversed"));
        }
    }

    #[test]
    fn convex_polygons_and_fans_that_fit_stay_fans() {
        let circle: Vec<[f64; 2]> = (0..12)
            .map(|i| {
                (std::f64::consts::TAU * f64::from(i) / 12.0)
                    .sin_cos()
                    .into()
            })
            .collect();
        let fan: Vec<[u32; 3]> = (2..12).map(|last| [0, last - 1, last]).collect();
        assert_eq!(check(&circle, -3.0, "circle"), fan);
        // Concave, but its first corner sees all of it.
        let arrow = [[0.0, 0.5], [-1.0, -1.0], [0.0, -0.5], [1.0, -1.0]];
        assert!(
            check(&arrow[..], 1.0, "arrow")
                .iter()
                .all(|triangle| triangle[0] == 0)
        );
        let bent = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.3), DVec3::Y];
        assert_eq!(
            Splitter::default().split(&bent),
            Split {
                triangles: &[[0, 1, 2], [0, 2, 3]],
                crosses_itself: false
            }
        );
    }

    #[test]
    fn stars_of_many_corners_are_covered_once() {
        let radius = |i: u32| {
            if i.is_multiple_of(2) {
                1.0
            } else {
                0.2 + 0.1 * f64::from(i * 7 % 5)
            }
        };
        let corner = |i: u32| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / 200.0).sin_cos();
            [radius(i) * cos, radius(i) * sin]
        };
        let star: Vec<[f64; 2]> = (0..200).map(corner).collect();
        let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        let area = (0..200)
            .map(|i| 0.5 * cross(star[i], star[(i + 1) % 200]))
            .sum::<f64>();
        check(&star, area, "star");
    }

    #[test]
    fn degenerate_polygons() {
        // Corners twice, corners on a straight edge, a spur, a slit to a hole.
        check(
            &[
                [0.0, 0.0],
                [2.0, 0.0],
                [2.0, 0.0],
                [2.0, 1.0],
                [1.0, 1.0],
                [1.0, 1.0],
                [1.0, 2.0],
                [0.0, 2.0],
            ],
            3.0,
            "corners twice",
        );
        check(
            &[
                [1.0, 0.0],
                [2.0, 0.0],
                [2.0, 0.5],
                [2.0, 1.0],
                [1.0, 1.0],
                [1.0, 1.5],
                [1.0, 2.0],
                [0.0, 2.0],
                [0.0, 0.0],
            ],
            3.0,
            "straight corners",
        );
        check(
            &[
                [0.0, 0.0],
                [2.0, 0.0],
                [2.0, 1.0],
                [1.0, 1.0],
                [1.0, 2.0],
                [1.0, 3.0],
                [1.0, 2.0],
                [0.0, 2.0],
            ],
            3.0,
            "spur",
        );
        let ring = [
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [0.0, 3.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
        ];
        check(&ring, 8.0, "ring with a slit");
    }

    #[test]
    fn polygons_without_area_or_sense_still_end() {
        let flat = |outline: &[[f64; 2]]| {
            let corners = lift(outline, DQuat::IDENTITY);
            let mut splitter = Splitter::default();
            let split = splitter.split(&corners);
            assert!(
                split
                    .triangles
                    .iter()
                    .flatten()
                    .all(|index| (*index as usize) < corners.len())
            );
            (split.triangles.len(), split.crosses_itself)
        };
        assert_eq!(
            flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]),
            (2, false)
        );
        assert_eq!(flat(&[[1.0, 1.0]; 5]), (3, false));
        // A bow tie of two unequal halves.
        assert!(flat(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]]).1);
    }
}
