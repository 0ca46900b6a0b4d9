//! A bounding volume hierarchy of triangles as shaders traverse it: [`WIDTH`] boxes a node, a byte
//! a coordinate.
//!
//! A binary tree (M. Meister and J. Bittner, *Parallel Locally-Ordered Clustering*, 2018, with
//! reinsertion, 2018) is collapsed to wide nodes by opening the child with the largest surface
//! until there are enough (I. Wald et al., *Getting Rid of Packets*, 2008). Boxes are quantized in
//! their node as by H. Ylitie et al., *Efficient Incoherent Ray Traversal on GPUs Through
//! Compressed Wide BVHs*, 2017.

use std::ops::Range;
use std::time::Duration;

use glam::{DVec3, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::triangle::Triangle;

/// Boxes of a node.
pub(super) const WIDTH: usize = 4;

/// Texels of four 32-bit words of a node. The first has the smallest corner, a byte for each axis'
/// exponent, and one for which boxes there are. The next two have a byte for each box of each of
/// the planes low x, y and z, high x, y and z; two words are free. The last says what each box
/// holds.
pub(super) const NODE_TEXELS: usize = 4;

/// 32-bit words of a node.
pub(super) const NODE_WORDS: usize = 4 * NODE_TEXELS;

/// First word of a node's planes.
const PLANES: usize = 4;

/// First word of what the boxes of a node hold.
pub(super) const CHILDREN: usize = NODE_WORDS - WIDTH;

/// Nodes of all trees at most: a traversal has 23 bits for a node.
pub(super) const MOST_NODES: usize = 1 << 23;

/// Set in the word of a box that holds triangles: 4 bits below, their number less one, and then 27
/// bits, the first of them. The words of other boxes are nodes.
pub(super) const LEAF: u32 = 1 << 31;

/// Bits of the first triangle of a leaf.
const FIRST_BITS: u32 = 27;

/// Triangles of one tree at most. The last number would look like the end of a traversal.
pub(super) const MOST_TRIANGLES: usize = (1 << FIRST_BITS) - 1;

/// Triangles of a leaf at most.
const LEAF_TRIANGLES: u32 = 4;

/// From this many triangles on, trees are built with less care.
const MANY: usize = 1 << 20;

/// The hierarchy of some triangles.
#[derive(Default)]
pub struct WideBvh {
    /// 16 words a node, the root first; none where there is nothing to hit.
    pub nodes: Vec<u32>,
    /// Indices of the given triangles, in the order of the leaves.
    pub triangles: Vec<u32>,
    /// Nodes on the longest way from the root: a traversal puts off boxes of one less at most.
    pub depth: u32,
}

/// A box around points.
#[derive(Clone, Copy)]
struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    const EMPTY: Bounds = Bounds {
        low: Vec3::INFINITY,
        high: Vec3::NEG_INFINITY,
    };

    fn union(self, other: Bounds) -> Bounds {
        Bounds {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    fn of(&[a, b, c]: &[Vec3; 3]) -> Bounds {
        Bounds {
            low: a.min(b).min(c),
            high: a.max(b).max(c),
        }
    }

    fn half_area(self) -> f32 {
        let size = self.high - self.low;
        size.x * size.y + size.y * size.z + size.z * size.x
    }
}

impl WideBvh {
    /// Of triangles by their corners (m). `units_per_m` is a power of two that brings coordinates
    /// near to 1.
    pub fn new(corners: &[[Vec3; 3]], units_per_m: f32) -> Self {
        let shape = |corners: &[Vec3; 3]| {
            let [v0, v1, v2] = corners.map(|corner| Vec3A::from(corner * units_per_m));
            Triangle { v0, v1, v2 }
        };
        let shapes: Vec<Triangle> = corners.iter().map(shape).collect();
        if shapes.is_empty() {
            return WideBvh::default();
        }
        let params = BvhBuildParams {
            max_prims_per_leaf: LEAF_TRIANGLES,
            ..if shapes.len() < MANY {
                BvhBuildParams::medium_build()
            } else {
                BvhBuildParams::very_fast_build()
            }
        };
        let binary = build_bvh2_from_tris(&shapes, params, &mut Duration::default());
        drop(shapes);
        let triangles = binary.primitive_indices.clone();
        let bounds = bounds(&binary, |slot| {
            Bounds::of(&corners[triangles[slot] as usize])
        });
        let mut collapse = Collapse {
            binary: &binary,
            bounds: &bounds,
            nodes: Vec::new(),
            depth: 0,
        };
        collapse.run();
        WideBvh {
            nodes: collapse.nodes,
            depth: collapse.depth,
            triangles,
        }
    }

    /// Some triangles in their order, with no box around them.
    pub(super) fn without_nodes(triangle_count: usize) -> Self {
        WideBvh {
            triangles: (0..triangle_count as u32).collect(),
            ..WideBvh::default()
        }
    }

    /// Brings the boxes up to where the triangles are now; which triangles share one stays.
    pub fn refit(&mut self, corners: &[[Vec3; 3]]) {
        let mut bounds = vec![Bounds::EMPTY; self.nodes.len() / NODE_WORDS];
        // Children come after their parents.
        for index in (0..bounds.len()).rev() {
            let node = &mut self.nodes[NODE_WORDS * index..][..NODE_WORDS];
            let words: [u32; WIDTH] = std::array::from_fn(|child| node[CHILDREN + child]);
            let of_word = |word: &u32| match *word {
                node if node < LEAF => bounds[node as usize],
                leaf => {
                    let triangles = self.triangles[leaf_range(leaf)].iter();
                    let each = triangles.map(|triangle| Bounds::of(&corners[*triangle as usize]));
                    each.fold(Bounds::EMPTY, Bounds::union)
                }
            };
            let count = (node[3] >> 24).count_ones() as usize;
            let boxes: Vec<Bounds> = words[..count].iter().map(of_word).collect();
            node.copy_from_slice(&quantized(&boxes, words));
            bounds[index] = boxes.into_iter().fold(Bounds::EMPTY, Bounds::union);
        }
    }
}

/// Whether a triangle has an area, as the reference rounds it: it leaves the others out.
pub(super) fn has_area(corners: &[Vec3; 3], units_per_m: f32) -> bool {
    let [a, b, c] = corners.map(|corner| Vec3A::from(corner * units_per_m));
    (b - a).cross(c - a).length_squared() > 0.0
}

/// The triangles of a leaf, by its word.
fn leaf_range(word: u32) -> Range<usize> {
    let first = (word & ((1 << FIRST_BITS) - 1)) as usize;
    first..first + (word >> FIRST_BITS & 15) as usize + 1
}

/// Of each node of a binary tree, children before parents.
fn bounds(binary: &Bvh2, of_slot: impl Fn(usize) -> Bounds) -> Vec<Bounds> {
    let mut bounds = vec![Bounds::EMPTY; binary.nodes.len()];
    let mut waiting = vec![(0, false)];
    while let Some((index, is_done)) = waiting.pop() {
        let node = &binary.nodes[index];
        let first = node.first_index as usize;
        if node.is_leaf() {
            let slots = first..first + node.prim_count as usize;
            bounds[index] = slots.map(&of_slot).fold(Bounds::EMPTY, Bounds::union);
        } else if is_done {
            bounds[index] = bounds[first].union(bounds[first + 1]);
        } else {
            waiting.extend([(index, true), (first, false), (first + 1, false)]);
        }
    }
    bounds
}

struct Collapse<'b> {
    binary: &'b Bvh2,
    bounds: &'b [Bounds],
    nodes: Vec<u32>,
    depth: u32,
}

impl Collapse<'_> {
    fn run(&mut self) {
        self.nodes.resize(NODE_WORDS, 0);
        // Binary node, wide node, and the nodes above and including it.
        let mut waiting = vec![(0usize, 0usize, 1u32)];
        while let Some((binary, wide, depth)) = waiting.pop() {
            let children = self.children(binary);
            self.depth = self.depth.max(depth);
            let mut words = [0; WIDTH];
            for (word, &child) in words.iter_mut().zip(&children) {
                let node = &self.binary.nodes[child];
                if node.is_leaf() {
                    *word = LEAF | (node.prim_count - 1) << FIRST_BITS | node.first_index;
                } else {
                    let next = self.nodes.len() / NODE_WORDS;
                    self.nodes.resize(self.nodes.len() + NODE_WORDS, 0);
                    *word = next as u32;
                    waiting.push((child, next, depth + 1));
                }
            }
            let boxes: Vec<Bounds> = children.iter().map(|child| self.bounds[*child]).collect();
            let node = quantized(&boxes, words);
            self.nodes[NODE_WORDS * wide..][..NODE_WORDS].copy_from_slice(&node);
        }
    }

    /// At most [`WIDTH`] nodes that hold all that a node holds; a leaf is its only child.
    fn children(&self, node: usize) -> Vec<usize> {
        let mut children = vec![node];
        let area = |child: &&usize| self.bounds[**child].half_area();
        while children.len() < WIDTH {
            let open = children
                .iter()
                .filter(|child| !self.binary.nodes[**child].is_leaf())
                .max_by(|a, b| area(a).total_cmp(&area(b)));
            let Some(&open) = open else { break };
            let first = self.binary.nodes[open].first_index as usize;
            children.retain(|child| *child != open);
            children.extend([first, first + 1]);
        }
        children
    }
}

/// Exponent, with the bias of a 32-bit float, of the smallest power of two of which 255 reach
/// across.
fn exponent(extent: f64) -> u32 {
    let least = (extent / 255.0).log2().ceil();
    // Of nothing, the logarithm is −∞.
    let mut exponent = (least.max(-126.0) as i32 + 127) as u32;
    while 255.0 * step(exponent) < extent {
        exponent += 1;
    }
    exponent.min(254)
}

fn step(exponent: u32) -> f64 {
    f64::from(exponent as i32 - 127).exp2()
}

fn quantized(boxes: &[Bounds], words: [u32; WIDTH]) -> [u32; NODE_WORDS] {
    let all = boxes.iter().copied().fold(Bounds::EMPTY, Bounds::union);
    let extent = all.high.as_dvec3() - all.low.as_dvec3();
    let exponents = extent.to_array().map(exponent);
    let steps = DVec3::from(exponents.map(step));
    let mut bytes = [0u8; 6 * WIDTH];
    for (child, bounds) in boxes.iter().enumerate() {
        let low = ((bounds.low - all.low).as_dvec3() / steps).floor();
        let high = ((bounds.high.as_dvec3() - all.low.as_dvec3()) / steps).ceil();
        for axis in 0..3 {
            bytes[WIDTH * axis + child] = low[axis].clamp(0.0, 255.0) as u8;
            bytes[WIDTH * (3 + axis) + child] = high[axis].clamp(0.0, 255.0) as u8;
        }
    }
    let mut node = [0; NODE_WORDS];
    node[..3].copy_from_slice(&all.low.to_array().map(f32::to_bits));
    let [x, y, z] = exponents;
    let is_there = (1 << boxes.len()) - 1;
    node[3] = x | y << 8 | z << 16 | is_there << 24;
    node[CHILDREN..].copy_from_slice(&words);
    let (planes, _) = bytes.as_chunks::<4>();
    for (word, bytes) in node[PLANES..].iter_mut().zip(planes) {
        *word = u32::from_le_bytes(*bytes);
    }
    node
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every box holds the triangles below it, every triangle is in one leaf, and the depth is that
    /// of the deepest node.
    fn check(corners: &[[Vec3; 3]], bvh: &WideBvh) {
        let mut seen = vec![0; corners.len()];
        let root = if bvh.nodes.is_empty() {
            vec![]
        } else {
            vec![(0, 1)]
        };
        let mut waiting: Vec<(usize, usize)> = root;
        let mut deepest = 0;
        while let Some((index, depth)) = waiting.pop() {
            let node = &bvh.nodes[NODE_WORDS * index..][..NODE_WORDS];
            let count = (node[3] >> 24).count_ones() as usize;
            deepest = deepest.max(depth);
            for child in 0..count {
                let word = node[CHILDREN + child];
                if word < LEAF {
                    waiting.push((word as usize, depth + 1));
                }
                let bounds = unpacked(node, child);
                for triangle in below(bvh, word) {
                    seen[triangle] += u32::from(word >= LEAF);
                    for corner in corners[triangle].map(Vec3::as_dvec3) {
                        let inside = corner.cmpge(bounds[0]).all() && corner.cmple(bounds[1]).all();
                        assert!(inside, "{corner} outside of {bounds:?}");
                    }
                }
            }
        }
        assert_eq!(seen, vec![1; corners.len()]);
        assert_eq!(deepest, bvh.depth as usize);
    }

    fn unpacked(node: &[u32], child: usize) -> [DVec3; 2] {
        let low = DVec3::from([0, 1, 2].map(|axis| f64::from(f32::from_bits(node[axis]))));
        let steps = DVec3::from([0, 8, 16].map(|shift| step(node[3] >> shift & 255)));
        let byte = |plane: usize| {
            let at = WIDTH * plane + child;
            f64::from(node[PLANES + at / 4] >> (8 * (at % 4)) & 255)
        };
        let planes = [[0, 1, 2], [3, 4, 5]];
        planes.map(|planes| low + steps * DVec3::from(planes.map(byte)))
    }

    fn below(bvh: &WideBvh, word: u32) -> Vec<usize> {
        if word >= LEAF {
            let triangles = bvh.triangles[leaf_range(word)].iter();
            return triangles.map(|triangle| *triangle as usize).collect();
        }
        let node = &bvh.nodes[NODE_WORDS * word as usize..][..NODE_WORDS];
        let children = &node[CHILDREN..][..(node[3] >> 24).count_ones() as usize];
        children.iter().flat_map(|word| below(bvh, *word)).collect()
    }

    fn random(count: usize, size: f32, across: f32) -> Vec<[Vec3; 3]> {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 8) as f32 / 16_777_216.0 - 0.5
        };
        let mut point = |size: f32| size * Vec3::new(next(), next(), next());
        let triangle = |_| {
            let middle = point(across);
            [(); 3].map(|()| middle + point(size))
        };
        (0..count).map(triangle).collect()
    }

    #[test]
    fn boxes_hold_their_triangles() {
        for (count, size, across) in [
            (0, 1.0, 1.0),
            (1, 1.0, 1.0),
            (2, 1e-6, 1e4),
            (5, 1.0, 0.0),
            (63, 1e-20, 1e-20),
            (1000, 0.1, 10.0),
            (10_000, 3.0, 3.0),
        ] {
            let corners = random(count, size, across);
            let units = if across < 1e-10 {
                1e20f32.log2().floor().exp2()
            } else {
                1.0
            };
            let mut bvh = WideBvh::new(&corners, units);
            if across > 1e-10 {
                check(&corners, &bvh);
                let moved: Vec<[Vec3; 3]> = corners
                    .iter()
                    .map(|corners| corners.map(|at| Vec3::new(-at.y, at.x + 100.0, 2.0 * at.z)))
                    .collect();
                bvh.refit(&moved);
                check(&moved, &bvh);
            } else {
                assert!(!bvh.nodes.is_empty());
            }
        }
    }

    #[test]
    fn flat_and_empty_triangles() {
        let flat = |z: f32| {
            [
                Vec3::new(0.0, 0.0, z),
                Vec3::new(1.0, 0.0, z),
                Vec3::new(0.0, 1.0, z),
            ]
        };
        let point = [Vec3::ONE; 3];
        let line = [Vec3::ZERO, Vec3::ONE, 2.0 * Vec3::ONE];
        check(&[point, line], &WideBvh::new(&[point, line], 1.0));
        let corners = [
            flat(0.0),
            point,
            flat(0.0),
            flat(0.0),
            line,
            flat(0.0),
            flat(0.0),
        ];
        let bvh = WideBvh::new(&corners, 1.0);
        check(&corners, &bvh);
        assert_eq!(corners.iter().filter(|one| has_area(one, 1.0)).count(), 5);
    }
}
