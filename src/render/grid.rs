//! Which pixels light is gathered for: all, some, or all in another order.

/// Which pixels gather, and how their texels lie (`shared/receiver.glsl`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Width and height of the gathered picture (texels).
    pub size: [u32; 2],
    /// Width of the squares of pixels in each of which the middle one gathers (px), at most 255.
    pub scale: u32,
    /// Of the pixels that gather, one in so many along each axis has a texel, at most 255.
    pub step: u32,
    /// The first of them.
    pub first: [u32; 2],
    /// Columns and rows of parts that the picture is split into: texels of a part are so many
    /// pixels apart.
    pub parts: [u32; 2],
}

impl Grid {
    /// A texel for each pixel of a picture of this size (px).
    pub fn whole(size: [u32; 2]) -> Self {
        Grid::coarse(size, 1)
    }

    /// A texel for the middle pixel of each square of `scale` pixels.
    pub fn coarse(size: [u32; 2], scale: u32) -> Self {
        Grid {
            size: size
                .map(|size| (size + scale - 1 - scale / 2) / scale)
                .map(|size| size.max(1)),
            scale,
            step: 1,
            first: [0; 2],
            parts: [1; 2],
        }
    }

    /// Of the pixels that gather, one in `step` along each axis, from `first` on; where there are
    /// fewer, the last.
    pub fn sparse(self, step: u32, first: [u32; 2]) -> Self {
        let first = [0, 1].map(|axis| first[axis].min(self.size[axis] - 1));
        Grid {
            size: [0, 1].map(|axis| (self.size[axis] - first[axis]).div_ceil(step)),
            step,
            first,
            ..self
        }
    }

    /// The same in parts, `parts` along each axis. Each has the pixels of one place in a tile of
    /// as many (Segovia et al. 2006).
    pub fn split(self, parts: [u32; 2]) -> Self {
        Grid {
            size: [0, 1].map(|axis| self.size[axis].div_ceil(parts[axis]) * parts[axis]),
            parts,
            ..self
        }
    }

    /// Which of the pixels that gather a texel has, counted along each axis; it may be outside.
    pub fn place(&self, texel: [u32; 2]) -> [u32; 2] {
        [0, 1].map(|axis| {
            let part = self.size[axis] / self.parts[axis];
            let ordered = texel[axis] % part * self.parts[axis] + texel[axis] / part;
            ordered * self.step + self.first[axis]
        })
    }

    /// The pixel of a place.
    pub fn pixel(&self, place: [u32; 2]) -> [u32; 2] {
        place.map(|place| place * self.scale + self.scale / 2)
    }

    /// As shaders read it (`FrameConstants::gathered`).
    pub(crate) fn row(&self) -> [u32; 4] {
        let [width, height] = self.size;
        let [x, y] = self.first;
        [
            width,
            height,
            self.scale | self.step << 8 | x << 16 | y << 24,
            self.parts[0] | self.parts[1] << 8,
        ]
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Each pixel that gathers has one texel, whatever the order.
    #[test]
    fn texels_are_pixels_in_some_order() {
        for size in [[1, 1], [7, 5], [16, 9], [3, 64]] {
            for (scale, parts) in [(1, [1, 1]), (2, [3, 2]), (4, [4, 4]), (1, [8, 5])] {
                let coarse = Grid::coarse(size, scale);
                let split = coarse.split(parts);
                let places: Vec<[u32; 2]> = (0..split.size[1])
                    .flat_map(|y| (0..split.size[0]).map(move |x| [x, y]))
                    .map(|texel| split.place(texel))
                    .collect();
                let once: BTreeSet<_> = places.iter().collect();
                assert_eq!(once.len(), places.len(), "{split:?}");
                let inside =
                    |place: &&[u32; 2]| place[0] < coarse.size[0] && place[1] < coarse.size[1];
                let count = coarse.size[0] * coarse.size[1];
                assert_eq!(
                    places.iter().filter(inside).count() as u32,
                    count,
                    "{split:?}"
                );
            }
        }
    }

    #[test]
    fn grids_by_hand() {
        let all = Grid::coarse([10, 7], 4);
        // Pixels 2 and 6 of ten, and 2 and 6 of seven.
        assert_eq!((all.size, all.pixel([1, 1])), ([2, 2], [6, 6]));
        let sparse = Grid::whole([10, 7]).sparse(4, [3, 1]);
        assert_eq!((sparse.size, sparse.place([1, 1])), ([2, 2], [7, 5]));
        assert_eq!(Grid::whole([2, 9]).sparse(4, [3, 0]).size, [1, 3]);
        // Parts of 3×2 tiles: the second has the pixels right of the first's.
        let split = Grid::whole([6, 4]).split([3, 2]);
        assert_eq!((split.place([0, 0]), split.place([1, 0])), ([0, 0], [3, 0]));
        assert_eq!((split.place([2, 0]), split.place([0, 2])), ([1, 0], [0, 1]));
    }
}
