//! Opaque faces: which neighbours cannot see each other, and what they see instead.

use std::sync::Arc;

use glam::UVec3;

use super::grid::{CellGrid, GridRow};
use super::light::Light;
use super::scroll::{Before, Shifted};
use crate::gpu_struct;
use crate::graph::{
    Access, Binding, Buffer, BufferDesc, BufferUsage, DrawBatch, Error, Frame, FrameStats, Gpu,
    Owner, Pass, RasterState, Sets, Shaders, Targets,
};
use crate::render::{GpuScene, LightMaps};
use crate::shader::GpuStruct;

gpu_struct! {
    /// Parameters of `lpv.faces`, `lpv.nearest` and `lpv.surfaces`.
    pub struct FacesParams {
        /// The grid.
        pub grid: GridRow,
        /// xyz: the first cell of the box that is looked at; w: axis that is looked along.
        pub low: [i32; 4],
        /// xyz: cells of the box along each axis; w: 0.
        pub size: [i32; 4],
    }
}

gpu_struct! {
    /// Parameters of `lpv.number_sides`.
    pub struct NumberParams {
        /// Cells of the grid.
        pub cell_count: u32,
    }
}

gpu_struct! {
    /// Parameters of `lpv.light_sides`.
    pub struct SideParams {
        /// The grid.
        pub grid: GridRow,
        /// How many sides there are.
        pub side_count: u32,
        /// Radiance of a stored 1 (W/(m² sr)).
        pub scale: f32,
    }
}

gpu_struct! {
    /// Parameters of `lpv.compare`.
    pub struct CompareParams {
        /// How many sums there are.
        pub sum_count: u32,
        /// The change from which on there is another bounce, over the whole.
        pub least_change: f32,
    }
}

gpu_struct! {
    /// What a cell sees of an opaque face (`gi/lpv/sides.glsl`).
    pub struct Side {
        /// xyz: the surface (m); w: index of the cell, as bits.
        pub place: [f32; 4],
        /// xyz: unit vector towards the cell; w: 0.
        pub normal: [f32; 4],
        /// rgb: diffuse albedo; w: 0.
        pub albedo: [f32; 4],
        /// rgb: what it emits towards the cell (W/(m² sr)); w: 0.
        pub emission: [f32; 4],
    }
}

const fn raster(name: &'static str, fragment: &'static str, bindings: &'static [Binding]) -> Pass {
    Pass {
        name,
        shaders: Shaders::Raster {
            vertex: "gi/lpv/faces.vert",
            geometry: None,
            fragment: Some(fragment),
            state: RasterState::NO_TARGETS,
        },
        bindings,
        constants: &[],
        params: Some(FacesParams::LAYOUT),
        sets: Sets::SceneAndMaterials,
    }
}

/// The face between two cells is opaque where the segment between their centres meets a triangle.
/// Rasterizes the scene along one axis, a pixel a row of cells; sets six bits a cell.
pub static FACES: Pass = raster(
    "lpv.faces",
    "gi/lpv/faces.frag",
    &[Binding::buffer("faces", Access::RasterReadWrite)],
);

/// A place in the list of sides for each opaque face of each cell. A thread a cell.
pub static NUMBER_SIDES: Pass = Pass::compute(
    "lpv.number_sides",
    "gi/lpv/number_sides.comp",
    &[
        Binding::buffer("faces", Access::ComputeReadWrite),
        Binding::buffer("side_count", Access::ComputeReadWrite),
    ],
    NumberParams::LAYOUT,
);

/// Which surface each cell sees of its opaque faces: as [`FACES`], for the nearest.
pub static NEAREST: Pass = raster(
    "lpv.nearest",
    "gi/lpv/nearest.frag",
    &[
        Binding::buffer("faces", Access::RasterRead),
        Binding::buffer("nearest", Access::RasterReadWrite),
    ],
);

/// What these surfaces are like: as [`FACES`], for those that [`NEAREST`] has found.
pub static SURFACES: Pass = raster(
    "lpv.surfaces",
    "gi/lpv/surfaces.frag",
    &[
        Binding::buffer("faces", Access::RasterRead),
        Binding::buffer("nearest", Access::RasterRead),
        Binding::buffer("sides", Access::RasterReadWrite),
    ],
);

/// What opaque faces send into their cells. A thread a side.
pub static LIGHT_SIDES: Pass = Pass {
    name: "lpv.light_sides",
    shaders: Shaders::Compute("gi/lpv/light_sides.comp"),
    bindings: &[
        Binding::buffer("light_views", Access::ComputeRead),
        Binding::sampled("shadow_maps", Access::ComputeSampled),
        Binding::buffer("sides", Access::ComputeRead),
        Binding::sampled("light", Access::ComputeSampled),
        Binding::sampled("light_band2", Access::ComputeSampled),
        Binding::buffer("side_light", Access::ComputeReadWrite),
        Binding::buffer("changes", Access::ComputeWrite),
    ],
    constants: &["DIRECT", "AGAIN", "COMPARE", "HAS_BAND2"],
    params: Some(SideParams::LAYOUT),
    sets: Sets::Scene,
};

/// Whether what opaque faces send has changed so much that there is another bounce. One workgroup.
pub static COMPARE: Pass = Pass::compute(
    "lpv.compare",
    "gi/lpv/compare.comp",
    &[
        Binding::buffer("changes", Access::ComputeRead),
        Binding::buffer("goes_on", Access::ComputeWrite),
    ],
    CompareParams::LAYOUT,
);

/// Sides that a workgroup lights.
const SIDE_GROUP: u32 = 64;
/// Edge of the viewport of the rasterizations (px; `VIEWPORT` in `gi/lpv/faces.vert`).
const VIEWPORT: u32 = 4096;

/// A part of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CellBox {
    /// Its first cell in the grid.
    pub(super) low: UVec3,
    /// Cells along each axis.
    pub(super) size: UVec3,
}

impl CellBox {
    /// All of a grid.
    pub(super) fn of(grid: &CellGrid) -> Self {
        CellBox {
            low: UVec3::ZERO,
            size: grid.size,
        }
    }
}

pub(super) fn words(gpu: &Gpu, name: &str, count: u32) -> Result<Arc<Buffer>, Error> {
    gpu.create_buffer(&BufferDesc {
        name: name.into(),
        size_bytes: 4 * u64::from(count.max(4)),
        usage: BufferUsage::Storage,
        owner: Owner::Store,
    })
}

/// The opaque faces of a grid.
pub struct Faces {
    /// The grid.
    pub grid: CellGrid,
    /// A word a cell: bits 0 to 5 are the opaque faces −x, +x, −y, +y, −z, +z; bits from 8 on are
    /// the place of the first in the list of sides.
    pub words: Arc<Buffer>,
    /// What the cells see of them, where light comes from faces.
    pub sides: Option<Sides>,
    /// What a grid that moves had before, once it has moved.
    pub(super) before: Option<Before>,
}

/// The opaque faces as cells see them, in a list.
pub struct Sides {
    /// How many there are.
    pub count: u32,
    counter: Arc<Buffer>,
    pub(super) nearest: Arc<Buffer>,
    /// A [`Side`] each.
    pub list: Arc<Buffer>,
    /// Radiance that each sends into its cell: RGB and a 0, in steps of [`Cells::scale`].
    ///
    /// [`Cells::scale`]: super::Cells::scale
    pub light: Arc<Buffer>,
    /// Of each workgroup that lights them: Σ|change| since the bounce before, and Σ.
    changes: Arc<Buffer>,
}

/// When bounces end before the last.
pub(super) struct BounceTest {
    /// Not 0: the bounce takes place.
    pub(super) goes_on: Arc<Buffer>,
    /// The change of what opaque faces send from which on it does, over the whole.
    pub(super) least_change: f32,
}

impl BounceTest {
    /// Allocates.
    pub(super) fn new(gpu: &Gpu, least_change: f32) -> Result<Self, Error> {
        Ok(BounceTest {
            goes_on: words(gpu, "lpv.goes_on", 1)?,
            least_change,
        })
    }
}

impl Sides {
    fn new(gpu: &Gpu, count: u32) -> Result<Self, Error> {
        Ok(Sides {
            count,
            counter: words(gpu, "lpv.side_count", 1)?,
            nearest: words(gpu, "lpv.nearest", count)?,
            list: words(gpu, "lpv.sides", count * (size_of::<Side>() / 4) as u32)?,
            light: words(gpu, "lpv.side_light", 4 * count)?,
            changes: words(gpu, "lpv.changes", 4 * count.div_ceil(SIDE_GROUP))?,
        })
    }

    /// Makes room for so many.
    fn hold(&mut self, gpu: &Gpu, count: u32) -> Result<(), Error> {
        self.count = count;
        if u64::from(count) * size_of::<Side>() as u64 > self.list.size_bytes() {
            // A quarter more, for models that move and grids that do.
            *self = Sides::new(gpu, count + count / 4)?;
            self.count = count;
        }
        Ok(())
    }
}

/// What is under way: where faces are found, and what moves there.
pub(super) struct Search {
    pub(super) boxes: Vec<CellBox>,
    pub(super) shifted: Option<Shifted>,
}

/// Ends the searches that a frame has begun. The sides of all are counted in one submission, so
/// their lists have room; the surfaces that cells see are found with the next.
pub(super) fn finish(
    gpu: &Gpu,
    scene: &GpuScene,
    mut frame: Frame,
    mut searches: Vec<(&mut Faces, Search)>,
) -> Result<FrameStats, Error> {
    searches.iter_mut().for_each(|(faces, search)| {
        if let (Some(shifted), Some(sides)) = (&mut search.shifted, &faces.sides) {
            shifted.before.sides = Some(Arc::clone(&sides.list));
        }
    });
    let all = searches.iter().map(|(faces, _)| (faces, &faces.sides));
    let with_sides = all.filter_map(|(faces, sides)| Some((faces, &sides.as_ref()?.counter)));
    let counters: Vec<&Arc<Buffer>> = with_sides
        .map(|(faces, counter)| {
            faces.number_sides(&mut frame, counter);
            counter
        })
        .collect();
    let mut stats = FrameStats::default();
    if counters.is_empty() {
        gpu.enqueue(frame);
    } else {
        let (counting, counts) = gpu.submit_and_read_all(frame, &counters)?;
        stats.append(counting);
        let with_sides = searches
            .iter_mut()
            .filter_map(|(faces, _)| faces.sides.as_mut());
        for (sides, counted) in with_sides.zip(counts) {
            let counted: Vec<u32> = bytemuck::pod_collect_to_vec(&counted);
            sides.hold(gpu, counted.first().copied().unwrap_or(0))?;
        }
    }
    let mut frame = Frame::new();
    frame.set_scene(&scene.set, &scene.materials);
    for (faces, Search { boxes, shifted }) in searches {
        if let Some(shifted) = shifted {
            faces.before = Some(faces.shift_sides(gpu, &mut frame, shifted)?);
        }
        faces.note_surfaces(&mut frame, scene, &boxes);
    }
    gpu.enqueue(frame);
    Ok(stats)
}

impl Faces {
    /// Allocates; `with_sides` also for the list of sides.
    pub fn new(gpu: &Gpu, grid: CellGrid, with_sides: bool) -> Result<Self, Error> {
        Ok(Faces {
            grid,
            words: words(gpu, "lpv.faces", grid.count())?,
            sides: with_sides.then(|| Sides::new(gpu, 0)).transpose()?,
            before: None,
        })
    }

    /// Finds all opaque faces of a scene, where it is now.
    pub fn find(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<FrameStats, Error> {
        let mut frame = Frame::new();
        let search = self.search(&mut frame, scene);
        finish(gpu, scene, frame, vec![(self, search)])
    }

    /// Adds the passes that find all opaque faces; [`finish`] is next.
    pub(super) fn search(&self, frame: &mut Frame, scene: &GpuScene) -> Search {
        frame.set_scene(&scene.set, &scene.materials);
        frame.fill("lpv.clear_faces", &self.words, 0);
        let whole = vec![CellBox::of(&self.grid)];
        self.rasterize(frame, scene, &FACES, &[("faces", &self.words)], &whole);
        Search {
            boxes: whole,
            shifted: None,
        }
    }

    fn number_sides(&self, frame: &mut Frame, counter: &Arc<Buffer>) {
        frame.fill("lpv.clear_faces", counter, 0);
        frame
            .pass(&NUMBER_SIDES)
            .bind("faces", &self.words)
            .bind("side_count", counter)
            .push(&NumberParams {
                cell_count: self.grid.count(),
            })
            .dispatch([self.grid.count().div_ceil(64), 1, 1]);
    }

    /// Adds the passes that find the surfaces that cells of some boxes see.
    pub(super) fn note_surfaces(&self, frame: &mut Frame, scene: &GpuScene, boxes: &[CellBox]) {
        let Some(sides) = &self.sides else { return };
        frame.fill("lpv.clear_faces", &sides.nearest, u32::MAX);
        let found = [("faces", &self.words), ("nearest", &sides.nearest)];
        self.rasterize(frame, scene, &NEAREST, &found, boxes);
        let noted = [found[0], found[1], ("sides", &sides.list)];
        self.rasterize(frame, scene, &SURFACES, &noted, boxes);
    }

    pub(super) fn rasterize(
        &self,
        frame: &mut Frame,
        scene: &GpuScene,
        pass: &'static Pass,
        bound: &[(&str, &Arc<Buffer>)],
        boxes: &[CellBox],
    ) {
        for (axis, cells) in (0..3).flat_map(|axis| boxes.iter().map(move |cells| (axis, cells))) {
            let [x, y, z] = cells.size.to_array();
            let across = [[y, z], [z, x], [x, y]][axis as usize];
            // Segments go on to the centres of the cells around the box.
            let (low, size) = (cells.low.as_vec3(), cells.size.as_vec3());
            let [low, high] = [low - 1.0, low + size + 1.0]
                .map(|place| self.grid.corner() + self.grid.cell_size * place);
            let triangles = scene.triangles_in(low, high);
            let draws = triangles.iter().map(|batch| DrawBatch {
                material: batch.material,
                push: Vec::new(),
                first_vertex: 3 * batch.first_triangle,
                vertex_count: 3 * batch.triangle_count,
                ..Default::default()
            });
            let mut builder = frame.pass(pass);
            for (name, buffer) in bound {
                builder = builder.bind(name, *buffer);
            }
            builder
                .push(&FacesParams {
                    grid: self.grid.row(0),
                    low: cells.low.extend(axis).as_ivec4().to_array(),
                    size: cells.size.extend(0).as_ivec4().to_array(),
                })
                .draw(
                    Targets {
                        viewport: Some(VIEWPORT),
                        ..Targets::none(across)
                    },
                    draws.collect(),
                );
        }
    }

    /// Adds the pass that lights the sides: emission, direct light if asked for, and what is in
    /// `before`, the light of a sweep; `scale` is the radiance of a stored 1 (W/(m² sr)). A bounce
    /// after the first is tested, if there is a test.
    pub(super) fn light(
        &self,
        frame: &mut Frame,
        maps: &LightMaps,
        (with_direct, scale): (bool, f32),
        (before, again): (&Light, bool),
        test: Option<&BounceTest>,
    ) {
        let Some(sides) = &self.sides else { return };
        let test = test.filter(|_| again);
        let groups = sides.count.div_ceil(SIDE_GROUP).max(1);
        frame
            .pass(&LIGHT_SIDES)
            .bind("light_views", &maps.views)
            .bind("shadow_maps", &maps.depth)
            .bind("sides", &sides.list)
            .bind("light", &before.low)
            .bind("light_band2", before.bound_band2())
            .bind("side_light", &sides.light)
            .bind("changes", &sides.changes)
            .constant("DIRECT", with_direct)
            .constant("AGAIN", again)
            .constant("COMPARE", test.is_some())
            .constant("HAS_BAND2", before.band2.is_some())
            .push(&SideParams {
                grid: self.grid.row(0),
                side_count: sides.count,
                scale,
            })
            .dispatch([groups, 1, 1]);
        if let Some(test) = test {
            frame
                .pass(&COMPARE)
                .bind("changes", &sides.changes)
                .bind("goes_on", &test.goes_on)
                .push(&CompareParams {
                    sum_count: groups,
                    least_change: test.least_change,
                })
                .dispatch([1, 1, 1]);
        }
    }
}
