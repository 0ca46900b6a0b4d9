//! Where probes stand before they are moved.

use glam::{UVec3, Vec3};

/// Probes at equal distances along each axis of a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// The first of them (m).
    pub first: Vec3,
    /// From one to the next along each axis (m).
    pub spacing: Vec3,
    /// Along each axis; at least 2.
    pub counts: UVec3,
}

impl Lattice {
    /// In a box (m), `count` probes along its longest side. The outer layers are `outer_layer` of a
    /// spacing inside of the box.
    pub fn within((low, high): (Vec3, Vec3), count: u32, outer_layer: f32) -> Self {
        let count = count.max(2);
        // A plane has room on both sides, and a point, or what is far from the origin, is some
        // steps of its coordinates wide.
        let farthest = low.abs().max(high.abs()).max_element();
        let extent = (high - low).max(Vec3::ZERO);
        let longest = extent.max_element().max(2e-4 * farthest).max(1e-6);
        let gaps = |count: f32| count - 1.0 + 2.0 * outer_layer;
        let typical = longest / gaps(count as f32);
        let extent = extent.max(Vec3::splat(0.5 * typical));
        let counts = (extent / typical + 1.0 - 2.0 * outer_layer)
            .round()
            .clamp(Vec3::splat(2.0), Vec3::splat(count as f32));
        let spacing = extent / (counts - 1.0 + 2.0 * outer_layer);
        Lattice {
            first: 0.5 * (low + high) - 0.5 * spacing * (counts - 1.0),
            spacing,
            counts: counts.as_uvec3(),
        }
    }

    /// Number of probes.
    pub fn probe_count(&self) -> u32 {
        self.counts.element_product()
    }

    /// The probe at a place along each axis; the first axis runs fastest.
    pub fn index(&self, at: UVec3) -> u32 {
        at.x + self.counts.x * (at.y + self.counts.y * at.z)
    }

    /// Where a probe is along each axis.
    pub fn at(&self, probe: u32) -> UVec3 {
        let UVec3 { x, y, .. } = self.counts;
        UVec3::new(probe % x, probe / x % y, probe / (x * y))
    }

    /// Where a probe stands (m).
    pub fn place(&self, probe: u32) -> Vec3 {
        self.first + self.spacing * self.at(probe).as_vec3()
    }

    /// Where all probes stand (m), in order.
    pub fn places(&self) -> impl Iterator<Item = Vec3> {
        (0..self.probe_count()).map(|probe| self.place(probe))
    }

    /// The eight probes around a place (m), or around the nearest place inside.
    pub fn cage(&self, place: Vec3) -> [u32; 8] {
        let last = (self.counts - 1).as_vec3();
        let at = ((place - self.first) / self.spacing).clamp(Vec3::ZERO, last);
        let low = at.floor().min(last - 1.0).as_uvec3();
        std::array::from_fn(|corner| {
            let corner = corner as u32;
            self.index(low + UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2))
        })
    }

    /// The smallest distance between two probes (m).
    pub fn cell(&self) -> f32 {
        self.spacing.min_element()
    }

    /// Diagonal of a cell (m).
    pub fn diagonal(&self) -> f32 {
        self.spacing.length()
    }
}
