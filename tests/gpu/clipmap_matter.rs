//! Which samples of a clipmap cones need not take: the marks against all texels that are there.

use crate::support::scenes::{add_model, random_pose, scene_of, still};
use crate::support::technique::{Surfaces, small_lights, small_room};
use crate::support::walker::Walker;
use crate::support::{Random, gpu};
use glam::{IVec3, UVec3, Vec3};
use lumivox::gi::shared::cone::Volume;
use lumivox::gi::voxel_cones::clipmap;
use lumivox::graph::{Bound, Gpu, Image};
use std::sync::Arc;

/// A clipmap's texels and marks, as they were read back.
struct Read {
    n: u32,
    levels: u32,
    /// 1, or 6.
    faces: u32,
    /// Where the first voxel of each level is in its slab.
    wraps: Vec<UVec3>,
    texels: Vec<[u16; 4]>,
    /// The mips above the outermost level.
    top: Vec<Vec<[u16; 4]>>,
    marks: Vec<u32>,
}

fn image<'v>(volume: &Volume<'v>, name: &str) -> &'v Arc<Image> {
    let mut bound = volume.bound.into_iter().flatten();
    match bound.find(|(known, _)| *known == name) {
        Some((_, Bound::Image(image))) => image,
        _ => panic!("a clipmap's volume has no {name}"),
    }
}

fn read(gpu: &Gpu, volume: &Volume<'_>) -> Read {
    let Some((_, Bound::Buffer(rows))) = volume.bound[0] else {
        panic!("a clipmap's volume has no rows")
    };
    let rows: Vec<[f32; 8]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(rows).unwrap());
    let [clipmap, top, matter] = ["clipmap", "top", "matter"].map(|name| image(volume, name));
    let [n, height, layers] = clipmap.extent(0);
    let halves = |image, mip| bytemuck::pod_collect_to_vec(&gpu.read_image(image, mip, 0).unwrap());
    let wrap = |row: &[f32; 8]| {
        let first = row[3] as u32;
        UVec3::new(first % n, first / n % n, first / (n * n))
    };
    Read {
        n,
        levels: layers / (n + 2),
        faces: if height == n { 1 } else { 6 },
        wraps: rows.iter().map(wrap).collect(),
        texels: halves(clipmap, 0),
        top: (0..top.mips()).map(|mip| halves(top, mip)).collect(),
        marks: bytemuck::pod_collect_to_vec(&gpu.read_image(matter, 0, 0).unwrap()),
    }
}

impl Read {
    fn level_count(&self) -> u32 {
        self.levels + self.top.len() as u32
    }

    fn size(&self, level: u32) -> u32 {
        self.n >> (level + 1).saturating_sub(self.levels)
    }

    /// Whether a texel of a level, counted from its smallest corner, is other than zero from any
    /// side.
    fn is_filled(&self, level: u32, at: UVec3) -> bool {
        let Read { n, faces, .. } = *self;
        (0..faces).any(|face| {
            let texel = if level < self.levels {
                let [x, y, z] = ((at + self.wraps[level as usize]) % n).to_array();
                let (row, height) = if faces == 6 {
                    (face * (n + 2) + 1, 6 * (n + 2))
                } else {
                    (0, n)
                };
                self.texels[(x + n * (row + y + height * (level * (n + 2) + 1 + z))) as usize]
            } else {
                let size = self.size(level);
                let x = face * size + at.x;
                self.top[(level - self.levels) as usize]
                    [(x + faces * size * (at.y + size * at.z)) as usize]
            };
            texel.iter().any(|half| half & 0x7fff != 0)
        })
    }

    fn is_marked(&self, level: u32, stencil: UVec3) -> bool {
        let n = self.n;
        let layer = level.min(self.levels - 1) * (n / 2) + n - self.size(level) + stencil.z / 2;
        let word = stencil.x / 4 + n / 4 * (stencil.y / 4 + n / 4 * layer);
        let bit = stencil.x % 4 + 4 * (stencil.y % 4) + 16 * (stencil.z % 2);
        self.marks[word as usize] >> bit & 1 == 1
    }

    /// Stencils that hold a texel other than zero without a mark, those that have a mark and hold
    /// none, and those with both.
    fn compare(&self) -> [usize; 3] {
        let mut counts = [0; 3];
        for level in 0..self.level_count() {
            let size = self.size(level);
            let places = |edge: u32| {
                (0..edge.pow(3)).map(move |index| {
                    UVec3::new(index % edge, index / edge % edge, index / (edge * edge))
                })
            };
            let mut holds = vec![false; size.pow(3) as usize];
            for at in places(size).filter(|at| self.is_filled(level, *at)) {
                for back in places(2) {
                    let stencil = at.as_ivec3() - back.as_ivec3();
                    if stencil.cmpge(IVec3::ZERO).all() {
                        let [x, y, z] = stencil.as_uvec3().to_array();
                        holds[(x + size * (y + size * z)) as usize] = true;
                    }
                }
            }
            for (stencil, holds) in places(size).zip(holds) {
                match (holds, self.is_marked(level, stencil)) {
                    (true, false) => counts[0] += 1,
                    (false, true) => counts[1] += 1,
                    (true, true) => counts[2] += 1,
                    (false, false) => {}
                }
            }
        }
        counts
    }
}

/// Wherever the camera goes and whatever moves, no sample is left out that sees something, and next
/// to none is taken that sees nothing.
#[test]
fn samples_that_see_matter_are_marked() {
    let gpu = gpu();
    for (case, pairs) in [
        &["resolution=16", "levels=4"][..],
        &["resolution=16", "levels=1"],
        &["resolution=32", "levels=3", "voxel_size=0.05"],
        &["resolution=16", "levels=4", "faces=both"],
        &[
            "resolution=32",
            "levels=2",
            "anisotropic=on",
            "opacity=coverage",
        ],
        // Here a level has voxels where the next coarser one has none.
        &["resolution=16", "levels=4", "surface=thin"],
        &[
            "resolution=32",
            "levels=4",
            "surface=thin",
            "level_updates=staggered",
        ],
    ]
    .into_iter()
    .enumerate()
    {
        let mut random = Random::new(70 + case as u64);
        let mut scene = small_room(Surfaces::Diffuse, vec![small_lights()[case % 3].1]);
        // Scraps as large as a texel, so that few texels of a level lie beside others.
        let point = |random: &mut Random| Vec3::new(random.unit(), random.unit(), random.unit());
        let scraps: Vec<_> = (0..40)
            .map(|_| {
                let at = 2.0 * point(&mut random) - 1.0;
                [(); 3].map(|()| at + 0.15 * point(&mut random))
            })
            .collect();
        let model = scene_of(&scraps, 2.0, &mut random);
        let poses: Vec<_> = (0..4)
            .map(|_| random_pose(&mut random, 0.5))
            .chain([still(Vec3::splat(9.0))])
            .collect();
        add_model(&mut scene, model, &poses);
        let settings = clipmap::ENTRY
            .settings(Some("cones"), &[&["emitters=gather"], pairs].concat())
            .unwrap();
        let mut eye = Vec3::new(0.0, 1.0, 0.0);
        let mut walker = Walker::new(&gpu, &scene, &clipmap::ENTRY, &settings, eye);
        let mut all = [0; 3];
        for step in 0..12u8 {
            if step % 3 == 2 {
                walker.set_time(f32::from(step / 2), eye);
            }
            let reach = if step % 5 == 4 { 3.0 } else { 0.3 };
            eye = (eye + reach * (Vec3::new(random.unit(), random.unit(), random.unit()) - 0.5))
                .clamp(Vec3::new(-1.5, -0.5, -1.5), Vec3::new(1.5, 2.5, 1.5));
            walker.texels(eye);
            let mut read = read(&gpu, &walker.technique.volumes()[0].volume);
            let counts = read.compare();
            assert_eq!(counts[0], 0, "{pairs:?}, step {step}: left out");
            for (all, count) in all.iter_mut().zip(counts) {
                *all += count;
            }
            read.marks.fill(0);
            assert!(read.compare()[0] > 0, "{pairs:?}: nothing is there");
        }
        println!(
            "{pairs:?}: {} samples see something, {} in vain",
            all[2], all[1]
        );
        // A voxel where the next finer level, which is shown, has none.
        let most = if pairs.contains(&"surface=thin") {
            all[2] / 100
        } else {
            0
        };
        assert!(all[1] <= most, "{pairs:?}: {all:?}");
    }
}
