//! The texels of any voxel structure, read back as the oracle has them.

use std::sync::Arc;

use glam::{DVec4, Vec3};
use lumivox::gi::shared::cone::oracle::{
    Clipmap, ClipmapLevel, FaceChain, Lattice, Levels, Volume,
};
use lumivox::gi::shared::cone::{self, FaceWeights};
use lumivox::gi::shared::voxel::{Directionality, NormalLobe};
use lumivox::gi::voxel_cones::clipmap::{self, Layout};
use lumivox::gi::voxel_cones::mips;
use lumivox::graph::Bound;
use lumivox::graph::{Buffer, Gpu, Image};

use super::gather::{read_chain, read_faces};
use super::read_words;
use super::voxels::half;

/// What [`Levels`] looks at.
pub enum Structure {
    /// Levels of light, and of normals; where their texels are, and how light leaves by normals.
    Chain(Vec<Volume>, Vec<Volume>, Lattice, NormalLobe),
    /// Levels of six faces.
    Faces(FaceChain),
    /// Nested levels, and those of normals.
    Clipmap(Clipmap, Option<(Clipmap, NormalLobe)>),
}

impl Structure {
    /// Reads all of a volume back; `layout` is that of a clipmap, for a camera at an eye.
    pub fn read(
        gpu: &Gpu,
        volume: cone::Volume<'_>,
        resolution: u32,
        weights: FaceWeights,
        layout: Option<(Layout, Vec3)>,
    ) -> Structure {
        let cone::Volume {
            bound,
            constants,
            directionality,
            face_stride,
            lobe,
            ..
        } = volume;
        let is = |passes| std::ptr::eq(volume.passes, passes);
        let image = |index: usize| match bound[index] {
            Some((_, Bound::Image(image))) => image,
            _ => panic!("binding {index} is no image"),
        };
        let is_isotropic = directionality == Directionality::Isotropic;
        let has_finest_faces = directionality.faces().is_some();
        if is(&mips::CONES) {
            let [radiance, faces] = [image(0), image(2)];
            if is_isotropic {
                let normals = lobe.map(|_| read_chain(gpu, image(3)));
                return Structure::Chain(
                    read_chain(gpu, radiance),
                    normals.unwrap_or_default(),
                    Lattice::Centres,
                    lobe.unwrap_or_default(),
                );
            }
            return Structure::Faces(FaceChain {
                finest: (!has_finest_faces).then(|| read_chain(gpu, radiance).swap_remove(0)),
                levels: read_faces(gpu, faces),
                weights,
            });
        }
        if is(&clipmap::CONES) {
            let (layout, eye) = layout.expect("a clipmap's layout");
            let read = |[texels, top]: [usize; 2]| {
                let images = [image(texels), image(top)];
                read_clipmap(gpu, images, directionality, weights, &layout, eye)
            };
            return Structure::Clipmap(read([1, 2]), lobe.map(|lobe| (read([4, 5]), lobe)));
        }
        let Some((_, Bound::Buffer(nodes))) = bound[0] else {
            panic!("an octree has nodes")
        };
        let [bricks, normals] = [image(1), image(2)];
        let corners = constants.contains(&Some(("CORNERS", 1)));
        let tiles = tiles(gpu, nodes, resolution);
        let edge = |level: usize| (resolution >> level) + u32::from(corners);
        let read =
            |image: &Arc<Image>, shift: u32, levels: std::ops::Range<usize>| -> Vec<Volume> {
                let pool = Pool::read(gpu, image);
                levels
                    .map(|level| pool.volume(&tiles[level], edge(level), shift))
                    .collect()
            };
        if is_isotropic {
            let all = |image| read(image, 0, 0..tiles.len());
            let lattice = if corners {
                Lattice::Corners
            } else {
                Lattice::Centres
            };
            let normals = lobe.map(|_| all(normals)).unwrap_or_default();
            let lobe = lobe.unwrap_or_default();
            return Structure::Chain(all(bricks), normals, lattice, lobe);
        }
        // A finest level without faces lies where the last of them would.
        let finest =
            (!has_finest_faces).then(|| read(bricks, 5 * face_stride, 0..1).swap_remove(0));
        let with_faces = usize::from(finest.is_some())..tiles.len();
        let faces: [Vec<Volume>; 6] =
            std::array::from_fn(|face| read(bricks, face as u32 * face_stride, with_faces.clone()));
        let levels = (0..with_faces.len())
            .map(|level| std::array::from_fn(|face| faces[face][level].clone()))
            .collect();
        Structure::Faces(FaceChain {
            finest,
            levels,
            weights,
        })
    }

    /// It, as cones march through it.
    pub fn levels(&self) -> Levels<'_> {
        match self {
            Structure::Chain(light, normals, lattice, lobe) => Levels {
                light,
                normals,
                lattice: *lattice,
                lobe: *lobe,
                ..Levels::default()
            },
            Structure::Faces(faces) => faces.into(),
            Structure::Clipmap(clipmap, None) => clipmap.into(),
            Structure::Clipmap(clipmap, Some((normals, lobe))) => Levels {
                clipmap_normals: Some(normals),
                lobe: *lobe,
                ..clipmap.into()
            },
        }
    }
}

/// Positions and indices of the tiles of each level of an octree, finest first, from the root down.
pub fn tiles(gpu: &Gpu, nodes: &Arc<Buffer>, resolution: u32) -> Vec<Vec<([u32; 3], u32)>> {
    let words = read_words(gpu, nodes);
    let children = |(position, tile): &([u32; 3], u32)| {
        let (word, position) = (words[*tile as usize], *position);
        let own = (0..8u32)
            .filter(move |node| word >> node & 1 == 1)
            .zip(word >> 8..);
        own.map(move |(node, child)| {
            (
                std::array::from_fn(|axis| 2 * position[axis] + (node >> axis & 1)),
                child,
            )
        })
    };
    let mut levels = vec![vec![([0; 3], 0)]];
    for depth in 1..resolution.ilog2() as usize {
        levels.push(levels[depth - 1].iter().flat_map(children).collect());
    }
    levels.reverse();
    levels
}

/// A pool of bricks of 3³ texels.
struct Pool {
    texels: Vec<[u16; 4]>,
    size: [u32; 3],
}

impl Pool {
    fn read(gpu: &Gpu, image: &Arc<Image>) -> Pool {
        Pool {
            texels: bytemuck::pod_collect_to_vec(&gpu.read_image(image, 0, 0).unwrap()),
            size: image.extent(0),
        }
    }

    /// The texels of a level, `edge` along each edge, in bricks `shift` from those of their tiles'
    /// indices; nothing where there is no tile.
    fn volume(&self, tiles: &[([u32; 3], u32)], edge: u32, shift: u32) -> Volume {
        let [width, height, _] = self.size;
        let (row, column) = (width / 3, height / 3);
        let mut volume = Volume::new(edge, |_| DVec4::ZERO);
        for (position, tile) in tiles {
            let brick = tile + shift;
            let corner =
                [brick % row, brick / row % column, brick / (row * column)].map(|at| 3 * at);
            for offset in (0..27).map(|texel| [texel % 3, texel / 3 % 3, texel / 9]) {
                let [x, y, z] = [0, 1, 2].map(|axis| 2 * position[axis] + offset[axis]);
                if x.max(y).max(z) < edge {
                    let at = [0, 1, 2].map(|axis| corner[axis] + offset[axis]);
                    let texel = self.texels[(at[0] + width * (at[1] + height * at[2])) as usize];
                    volume.texels[(x + edge * (y + edge * z)) as usize] =
                        DVec4::from(texel.map(half));
                }
            }
        }
        volume
    }
}

fn read_clipmap(
    gpu: &Gpu,
    [clipmap, top]: [&Arc<Image>; 2],
    directionality: Directionality,
    weights: FaceWeights,
    layout: &Layout,
    eye: Vec3,
) -> Clipmap {
    let halves: Vec<[u16; 4]> =
        bytemuck::pod_collect_to_vec(&gpu.read_image(clipmap, 0, 0).unwrap());
    let (n, outermost) = (layout.resolution, layout.levels as usize - 1);
    let has_faces = directionality != Directionality::Isotropic;
    let places = layout.places(eye);
    let grid_corner = places[outermost].first.as_dvec3() * f64::from(1u32 << outermost);
    let level = |level: usize| {
        let place = places[level];
        let (first, size) = (place.first, f64::from(1u32 << level));
        let face_count = if has_faces && (level > 0 || directionality.faces().is_some()) {
            6
        } else {
            1
        };
        // Texels are at their voxel's place modulo n, in slabs with a border along z, and with
        // faces in cubes with one along y.
        let (height, border) = if has_faces { (6 * (n + 2), 1) } else { (n, 0) };
        let texel = |face: u32, at: [u32; 3]| {
            let [x, y, z] =
                [0, 1, 2].map(|axis| (first[axis] + at[axis] as i32).rem_euclid(n as i32) as u32);
            let (row, layer) = (
                face * (n + 2) * border + border + y,
                level as u32 * (n + 2) + 1 + z,
            );
            DVec4::from(halves[(x + n * (row + height * layer)) as usize].map(half))
        };
        ClipmapLevel {
            corner: size * first.as_dvec3() - grid_corner,
            middle: size * place.middle.as_dvec3() - grid_corner,
            texels: (0..face_count)
                .map(|face| Volume::new(n, |at| texel(face, at)))
                .collect(),
        }
    };
    let top = if has_faces {
        read_faces(gpu, top).into_iter().map(Vec::from).collect()
    } else {
        read_chain(gpu, top)
            .into_iter()
            .map(|mip| vec![mip])
            .collect()
    };
    Clipmap {
        levels: (0..=outermost).map(level).collect(),
        top,
        weights,
    }
}
