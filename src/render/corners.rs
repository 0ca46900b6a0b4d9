//! What triangles are drawn by: an index buffer of which each vertex is worked out about once for
//! each triangle, not three times.
//!
//! What a triangle shares, as its number, comes from its first corner (the provoking vertex of
//! Vulkan). So each triangle has a first corner of its own, whose number is the triangle's. Its
//! other two corners are any that have the vertex; where a vertex is first nowhere, a further
//! corner is added for it.

/// Corners and what is drawn of them.
pub(super) struct Corners {
    /// Corners of each triangle.
    pub(super) indices: Vec<[u32; 3]>,
    /// Vertices of the corners after those that are first in a triangle.
    pub(super) further: Vec<u32>,
}

/// Corners of triangles of so many vertices. A triangle takes those that were last used, as a
/// device remembers what it has worked out for a while.
pub(super) fn corners(triangles: &[[u32; 3]], vertex_count: usize) -> Corners {
    const NONE: u32 = u32::MAX;
    let mut last = vec![NONE; vertex_count];
    for (triangle, [first, ..]) in triangles.iter().enumerate().rev() {
        last[*first as usize] = triangle as u32;
    }
    let mut further = Vec::new();
    let indices = triangles.iter().enumerate().map(|(triangle, vertices)| {
        last[vertices[0] as usize] = triangle as u32;
        vertices.map(|vertex| {
            let known = &mut last[vertex as usize];
            if *known == NONE {
                *known = (triangles.len() + further.len()) as u32;
                further.push(vertex);
            }
            *known
        })
    });
    Corners {
        indices: indices.collect(),
        further,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_have_their_vertices_and_first_ones_their_triangles() {
        for count in [0, 1, 2, 50, 400] {
            let vertex_count = 1 + count / 2;
            let vertex = |corner: usize| (corner * corner * 7919 % vertex_count) as u32;
            let triangles: Vec<[u32; 3]> = (0..count)
                .map(|triangle| [0, 1, 2].map(|corner| vertex(3 * triangle + corner)))
                .collect();
            let corners = corners(&triangles, vertex_count);
            let vertex_of = |corner: u32| match triangles.get(corner as usize) {
                Some([first, ..]) => *first,
                None => corners.further[corner as usize - triangles.len()],
            };
            assert_eq!(corners.indices.len(), triangles.len());
            for (triangle, indices) in corners.indices.iter().enumerate() {
                assert_eq!(indices.map(vertex_of), triangles[triangle]);
                // A vertex that comes twice is the same corner.
                assert_eq!(indices[0] as usize, triangle);
            }
            let mut further = corners.further.clone();
            further.sort_unstable();
            further.dedup();
            assert_eq!(further.len(), corners.further.len());
        }
    }
}
