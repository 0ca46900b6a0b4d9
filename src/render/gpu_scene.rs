//! The scene on the GPU: set 0 and one set 2 a material.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::cast_slice;
use glam::Vec3;

use super::corners::corners;
use super::emitters::{Emitter, emitters};
use super::environment::GpuEnvironment;
use super::grid::Grid;
use super::lights::views::{LightCascades, ViewRanges};
use super::mean_normals::levels_of_means;
use crate::gpu_struct;
use crate::graph::{
    Buffer, BufferDesc, BufferUsage, DrawBatch, Error, Frame, Gpu, Image, ImageDesc, ImageKind,
    ImageUsage, MATERIAL_TEXTURES, MaterialSets, Owner, SceneBindings, SceneSet, vk,
};
use crate::scene::{
    Batch, Camera, Environment, Light, Material, Scene, Texture, TextureKind, Vertex, union,
};

gpu_struct! {
    /// What a frame is seen with; binding 0 of set 0 (`shared/frame.glsl`).
    pub struct FrameConstants {
        /// World to clip space; depth is reversed, with an infinite far plane.
        pub clip_from_world: [[f32; 4]; 4],
        /// xyz: camera position (m).
        pub eye_ws: [f32; 4],
        /// xyz: from the image's centre to its right edge at view depth 1.
        pub ray_right: [f32; 4],
        /// xyz: from the image's centre to its top edge at view depth 1.
        pub ray_up: [f32; 4],
        /// xyz: unit view direction.
        pub ray_forward: [f32; 4],
        /// rgb: radiance of the environment (W/(m² sr)); w: 1 where it is times a map.
        pub environment: [f32; 4],
        /// Where there is a map: the cosine and sine of its turn, and the edges of its first and
        /// last levels (texels).
        pub sky: [f32; 4],
        /// xy: image size (px); z: number of lights; w: number of light views for
        /// lookups anywhere.
        pub size_px: [u32; 4],
        /// x: number of the frame, for patterns that change from frame to frame; otherwise 0.
        pub walk: [u32; 4],
        /// Which pixels are gathered ([`Grid`](super::Grid)).
        pub gathered: [u32; 4],
    }
}

gpu_struct! {
    /// A material as the shaders read it (`Material` in `shared/frame.glsl`).
    pub struct GpuMaterial {
        /// rgb: diffuse albedo; w: 1 where there is a mask texture.
        pub albedo: [f32; 4],
        /// rgb: emitted radiance (W/(m² sr)); w: 1 where there is a normal map.
        pub emission: [f32; 4],
        /// rgb: F0; w: roughness, −1 where there is no lobe.
        pub specular: [f32; 4],
        /// x: metalness, 0 to 1; y: 1 where the lobe has a texture; z and w: 0.
        pub metalness: [f32; 4],
    }
}

gpu_struct! {
    /// A light as the shaders read it (`Light` in `shared/frame.glsl`).
    pub struct GpuLight {
        /// xyz: position (m); w: 0 directional, 1 point, 2 spot.
        pub position_kind: [f32; 4],
        /// xyz: unit direction of travel; w: inner half angle (rad).
        pub direction_inner: [f32; 4],
        /// rgb: irradiance (W/m²) or intensity (W/sr); w: outer half angle (rad).
        pub power_outer: [f32; 4],
        /// x: first light view; y: number of light views; zw: the same for what the camera sees.
        pub views: [u32; 4],
        /// x: first row of its shadow of what is clear; y: rows along an edge of it, 0 where it has
        /// none; zw: 0.
        pub clear: [u32; 4],
    }
}

/// Which textures a material has for coverage and colour; bumps do not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureUse {
    /// No texture of albedo, emission or mask.
    None,
    /// Albedo or emission.
    Textured,
    /// A mask, and perhaps others.
    Masked,
}

impl TextureUse {
    /// All of them.
    pub const ALL: [TextureUse; 3] = [TextureUse::None, TextureUse::Textured, TextureUse::Masked];

    fn of(material: &Material) -> Self {
        match (
            material.mask_texture,
            material.albedo_texture.or(material.emission_texture),
        ) {
            (Some(_), _) => TextureUse::Masked,
            (None, Some(_)) => TextureUse::Textured,
            (None, None) => TextureUse::None,
        }
    }
}

/// At most [`CLUSTER`] consecutive triangles of one material.
struct Cluster {
    triangles: Batch,
    /// Smallest and largest corner (m) of the box around them.
    bounds: (Vec3, Vec3),
}

/// Triangles of a cluster.
const CLUSTER: usize = 64;

fn clusters(scene: &Scene) -> Vec<Cluster> {
    let of_batch = |batch: Batch| {
        let first = batch.first_triangle as usize;
        let triangles = scene.triangles[first..][..batch.triangle_count as usize].chunks(CLUSTER);
        triangles.enumerate().map(move |(index, triangles)| {
            let corners = triangles
                .iter()
                .flat_map(|triangle| triangle.vertices)
                .map(|vertex| Vec3::from(scene.vertices[vertex as usize].position));
            let bounds = corners
                .map(|corner| (corner, corner))
                .reduce(union)
                .unwrap_or_default();
            let first_triangle = (first + CLUSTER * index) as u32;
            Cluster {
                triangles: Batch {
                    material: batch.material,
                    first_triangle,
                    triangle_count: triangles.len() as u32,
                },
                bounds,
            }
        })
    };
    scene.batches().into_iter().flat_map(of_batch).collect()
}

/// A scene's buffers and textures on the device.
pub struct GpuScene {
    /// The scene itself as it was uploaded, for what is worked out on the host of its geometry and
    /// materials.
    pub host: Arc<Scene>,
    /// Surfaces of which more than half is clear, where there are any. They are in no buffer.
    pub clear: Option<Arc<Scene>>,
    /// Set 0: the frame constants and the buffers of geometry, materials and lights.
    pub set: Arc<SceneSet>,
    /// Three corners of each triangle, for indexed draws (`vertex_of_corner` of shaders).
    pub corners: Arc<Buffer>,
    /// Set 2 of each material.
    pub materials: MaterialSets,
    /// Triangle ranges by material.
    pub batches: Vec<Batch>,
    /// Runs of triangles, and where they are.
    clusters: Vec<Cluster>,
    /// Which textures each material has.
    pub texture_use: Vec<TextureUse>,
    /// Some surface emits.
    pub is_emissive: bool,
    /// Some surface has a specular lobe.
    pub is_glossy: bool,
    /// Some surface has a texture of its lobe.
    pub has_lobe_textures: bool,
    /// Some surface has a normal map.
    pub is_bumped: bool,
    /// What emits, where it is now, in small parts (on the host alone).
    pub emitters: Vec<Emitter>,
    /// The largest emitted radiance of any channel (W/(m² sr)).
    pub largest_emission: f32,
    /// Smallest and largest corner (m) of the static geometry; where there is none, of all places
    /// that dynamic geometry comes to.
    pub bounds: (Vec3, Vec3),
    /// Dynamic geometry, where there is any.
    pub dynamic: Option<DynamicGeometry>,
    /// Where its own camera is (m).
    pub eye: Vec3,
    /// The lights as they are now.
    pub lights: Vec<Light>,
    /// How many maps directional lights have.
    pub cascades: LightCascades,
    /// Rows along an edge of a light's shadow of what is clear; 0: they have none.
    clear_shadow_edge: u32,
    /// Light from far away.
    pub environment: GpuEnvironment,
    /// What `set` shows.
    pub(super) buffers: SceneBindings,
    /// All textures.
    pub(super) textures: Vec<Arc<Image>>,
    /// Which of them each material has: albedo, emission, normal, mask, lobe.
    pub(super) material_textures: Vec<[Option<u32>; MATERIAL_TEXTURES]>,
}

/// The models of a scene that may move.
pub struct DynamicGeometry {
    /// By material: whether its triangles are of a dynamic model.
    pub materials: Vec<bool>,
    /// Smallest and largest corner of where it is (m).
    pub bounds: (Vec3, Vec3),
    /// Smallest and largest corner of all places that it comes to (m).
    pub motion_bounds: (Vec3, Vec3),
    models: Vec<DynamicModel>,
    /// Vertices of all models.
    vertex_count: usize,
    /// Where they are (m).
    positions: Vec<Vec3>,
}

/// Which part of the scene a dynamic model is.
struct DynamicModel {
    vertices: Range<usize>,
    /// Its triangles' corners, three a triangle.
    corners: Range<u32>,
}

impl DynamicGeometry {
    fn new(scene: &Scene) -> Option<Self> {
        let motion_bounds = scene.dynamic_bounds()?;
        let mut materials = vec![false; scene.materials.len()];
        let mut models = Vec::new();
        for model in scene.models.iter().filter(|model| model.dynamic) {
            let triangles =
                &scene.triangles[model.first_triangle as usize..][..model.triangle_count as usize];
            triangles
                .iter()
                .for_each(|triangle| materials[triangle.material as usize] = true);
            let indices = || triangles.iter().flat_map(|triangle| triangle.vertices);
            let first_corner = 3 * model.first_triangle;
            models.push(DynamicModel {
                vertices: indices().min().unwrap_or(0) as usize
                    ..indices().max().map_or(0, |last| last as usize + 1),
                corners: first_corner..first_corner + 3 * model.triangle_count,
            });
        }
        let vertex_count = models.iter().map(|model| model.vertices.len()).sum();
        let mut made = DynamicGeometry {
            materials,
            bounds: motion_bounds,
            motion_bounds,
            models,
            vertex_count,
            positions: Vec::new(),
        };
        made.bounds = made.bounds_in(scene);
        made.positions = made.positions_in(scene);
        Some(made)
    }

    fn vertices_in<'s>(&'s self, scene: &'s Scene) -> impl Iterator<Item = &'s Vertex> {
        self.models
            .iter()
            .flat_map(|model| &scene.vertices[model.vertices.clone()])
    }

    fn positions_in(&self, scene: &Scene) -> Vec<Vec3> {
        let position = |vertex: &Vertex| Vec3::from(vertex.position);
        self.vertices_in(scene).map(position).collect()
    }

    /// Where vertices of one model are (m); those between models stand nowhere.
    pub(super) fn positions_of(&self, vertices: &Range<usize>) -> &[Vec3] {
        let of = self
            .packed()
            .find(|(_, model)| model.start <= vertices.start && vertices.end <= model.end);
        let packed = of.map_or(0..0, |(first, model)| {
            let start = first + vertices.start - model.start;
            start..start + vertices.len()
        });
        &self.positions[packed]
    }

    /// The vertices of each model, and where its first one is when all models are packed one behind
    /// the other.
    pub(super) fn packed(&self) -> impl Iterator<Item = (usize, Range<usize>)> {
        self.packed_models()
            .map(|(first, model)| (first, model.vertices.clone()))
    }

    /// As [`DynamicGeometry::packed`], but with the corners of each model's triangles instead of
    /// its vertices. The number, added to a vertex index, gives its packed index, modulo 2³².
    pub(super) fn packed_corners(&self) -> impl Iterator<Item = (u32, Range<u32>)> {
        self.packed_models().map(|(first, model)| {
            let shift = (first as u32).wrapping_sub(model.vertices.start as u32);
            (shift, model.corners.clone())
        })
    }

    fn packed_models(&self) -> impl Iterator<Item = (usize, &DynamicModel)> {
        self.models.iter().scan(0, |next, model| {
            let first = *next;
            *next += model.vertices.len();
            Some((first, model))
        })
    }

    /// The triangles of each model.
    pub(super) fn triangles(&self) -> impl Iterator<Item = Range<usize>> {
        let corners = self.models.iter().map(|model| &model.corners);
        corners.map(|corners| corners.start as usize / 3..corners.end as usize / 3)
    }

    /// Size of the positions of all models (bytes).
    pub(super) fn positions_bytes(&self) -> u64 {
        bytes_of_vectors(self.vertex_count)
    }

    fn bounds_in(&self, scene: &Scene) -> (Vec3, Vec3) {
        let positions = self
            .vertices_in(scene)
            .map(|vertex| Vec3::from(vertex.position));
        positions
            .map(|position| (position, position))
            .reduce(union)
            .unwrap_or(self.motion_bounds)
    }
}

/// Size of this many positions or normals (bytes).
pub(super) fn bytes_of_vectors(count: usize) -> u64 {
    (size_of::<[f32; 3]>() * count) as u64
}

/// Name of the copy of vertices that have moved.
pub static SET_POSE: &str = "scene.set_pose";

impl GpuScene {
    /// Uploads a scene, without surfaces of which more than half is clear: those are
    /// [`GpuScene::clear`].
    pub fn new(gpu: &Gpu, scene: &Scene) -> Result<Self, Error> {
        let mut opaque = GpuScene::of_part(gpu, &scene.without_clear())?;
        opaque.clear = scene.clear_part().map(Arc::new);
        Ok(opaque)
    }

    /// Uploads all of a scene.
    pub(super) fn of_part(gpu: &Gpu, scene: &Scene) -> Result<Self, Error> {
        let frame_uniform = gpu.create_buffer(&BufferDesc {
            name: "frame.constants".into(),
            size_bytes: size_of::<FrameConstants>() as u64,
            usage: BufferUsage::Uniform,
            owner: Owner::Shared,
        })?;
        let environment = GpuEnvironment::new(gpu, &scene.environment, None)?;
        let shared = |name, bytes: &[u8]| storage(gpu, (name, Owner::Shared), bytes);
        let vectors = |of: fn(&Vertex) -> [f32; 3]| -> Vec<[f32; 3]> {
            scene.vertices.iter().map(of).collect()
        };
        let uvs: Vec<[f32; 2]> = scene
            .vertices
            .iter()
            .map(|vertex| [vertex.u, vertex.v])
            .collect();
        let triangles = scene.triangles.iter();
        let mut triangle_vertices: Vec<[u32; 3]> =
            triangles.clone().map(|one| one.vertices).collect();
        let mut triangle_materials: Vec<u32> = triangles.map(|one| one.material).collect();
        let corners = corners(&triangle_vertices, scene.vertices.len());
        // Corners that are first in no triangle have rows of their own, after those of triangles.
        triangle_vertices.extend(corners.further.iter().map(|&vertex| [vertex; 3]));
        triangle_materials.resize(triangle_vertices.len(), 0);
        check_corners(gpu.features().full_indices, triangle_vertices.len())?;
        let materials: Vec<GpuMaterial> = scene.materials.iter().map(gpu_material).collect();
        let buffers = SceneBindings {
            frame_uniform,
            positions: shared(
                "scene.positions",
                cast_slice(&vectors(|vertex| vertex.position)),
            )?,
            normals: shared(
                "scene.normals",
                cast_slice(&vectors(|vertex| vertex.normal)),
            )?,
            uvs: shared("scene.uvs", cast_slice(&uvs))?,
            triangle_vertices: shared("scene.triangle_vertices", cast_slice(&triangle_vertices))?,
            triangle_materials: shared(
                "scene.triangle_materials",
                cast_slice(&triangle_materials),
            )?,
            materials: shared("scene.materials", cast_slice(&materials))?,
            lights: shared(
                "scene.lights",
                cast_slice(&gpu_lights(&scene.lights, LightCascades::ONE, 0)),
            )?,
            clear_shadows: shared("scene.no_clear_shadows", &[])?,
            has_clear_shadows: false,
            sky: environment.image_or_none(gpu)?,
            has_cascades: false,
            has_textures: scene.materials.iter().any(|material| {
                let textures = textures_of(material);
                textures.iter().any(Option::is_some)
            }),
            has_lobe_textures: scene
                .materials
                .iter()
                .any(|material| lobe_texture(material).is_some()),
        };
        let set = gpu.create_scene_set(&buffers)?;
        let dynamic = DynamicGeometry::new(scene);
        let motion_bounds = dynamic.as_ref().map(|dynamic| dynamic.motion_bounds);
        let largest_emission = scene
            .materials
            .iter()
            .map(|material| material.emission.max_element())
            .fold(0.0, f32::max);
        let textures = scene
            .textures
            .iter()
            .map(|texture| upload_texture(gpu, texture))
            .collect::<Result<Vec<_>, _>>()?;
        let material_textures: Vec<_> = scene.materials.iter().map(textures_of).collect();
        Ok(GpuScene {
            host: Arc::new(scene.clone()),
            clear: None,
            clear_shadow_edge: 0,
            set,
            corners: shared("scene.corners", cast_slice(&corners.indices))?,
            materials: material_sets(gpu, &textures, &material_textures)?,
            batches: scene.batches(),
            clusters: clusters(scene),
            texture_use: scene.materials.iter().map(TextureUse::of).collect(),
            is_emissive: scene.is_emissive(),
            is_glossy: scene.is_glossy(),
            has_lobe_textures: (scene.materials.iter())
                .any(|material| lobe_texture(material).is_some()),
            is_bumped: (scene.materials.iter()).any(|material| material.normal_texture.is_some()),
            emitters: emitters(scene),
            largest_emission,
            bounds: scene
                .static_bounds()
                .or(motion_bounds)
                .unwrap_or((Vec3::ZERO, Vec3::ONE)),
            dynamic,
            eye: scene.camera.eye,
            lights: scene.lights.clone(),
            cascades: LightCascades::ONE,
            environment,
            buffers,
            textures,
            material_textures,
        })
    }

    /// Replaces the lights and the environment. Whatever was made for those before, such as light
    /// maps and techniques, has to be made again.
    pub fn set_lights(
        &mut self,
        gpu: &Gpu,
        lights: &[Light],
        environment: &Environment,
    ) -> Result<(), Error> {
        self.set_environment(gpu, environment)?;
        self.buffers.lights = storage(
            gpu,
            ("scene.lights", Owner::Shared),
            cast_slice(&gpu_lights(lights, self.cascades, self.clear_shadow_edge)),
        )?;
        self.buffers.has_cascades = self.cascades.are_of(lights);
        self.set = gpu.create_scene_set(&self.buffers)?;
        self.lights = lights.to_vec();
        Ok(())
    }

    /// Brings the vertices of dynamic models up to the scene that this was made of, after
    /// [`Scene::set_time`]; what does not move is left as it is. False where no model has moved.
    pub fn set_pose(&mut self, gpu: &Gpu, scene: &Scene) -> Result<bool, Error> {
        let Some(dynamic) = &mut self.dynamic else {
            return Ok(false);
        };
        let positions = dynamic.positions_in(scene);
        if positions == dynamic.positions {
            return Ok(false);
        }
        dynamic.bounds = dynamic.bounds_in(scene);
        if scene
            .materials
            .iter()
            .zip(&dynamic.materials)
            .any(|(material, moves)| *moves && material.emission != Vec3::ZERO)
        {
            self.emitters = emitters(scene);
        }
        let rows = positions.iter().map(Vec3::to_array);
        let normals = dynamic.vertices_in(scene).map(|vertex| vertex.normal);
        let moved: Vec<[f32; 3]> = rows.chain(normals).collect();
        let staging = gpu.stage("scene.dynamic_vertices", cast_slice(&moved))?;
        let mut frame = Frame::new();
        for (first, range) in dynamic.packed() {
            let targets = [&self.buffers.positions, &self.buffers.normals];
            for (target, first) in targets
                .into_iter()
                .zip([first, dynamic.vertex_count + first])
            {
                frame.copy_buffer(
                    SET_POSE,
                    (&staging, bytes_of_vectors(first)),
                    (target, bytes_of_vectors(range.start)),
                    bytes_of_vectors(range.len()),
                );
            }
        }
        gpu.enqueue(frame);
        // Where the device has them: a pose that failed is told again.
        dynamic.positions = positions;
        Ok(true)
    }

    /// Whether lights are as many as these and of the same kinds, as lights that move have to be.
    pub fn has_kinds_of(&self, lights: &[Light]) -> bool {
        let kinds = |lights: &[Light]| {
            lights
                .iter()
                .map(std::mem::discriminant)
                .collect::<Vec<_>>()
        };
        kinds(lights) == kinds(&self.lights)
    }

    /// Replaces the environment; what is made of its map is used again where the map is the same.
    pub(crate) fn set_environment(
        &mut self,
        gpu: &Gpu,
        environment: &Environment,
    ) -> Result<(), Error> {
        let environment = GpuEnvironment::new(gpu, environment, Some(&self.environment))?;
        let is_same = match environment.image() {
            Some(image) => Arc::ptr_eq(image, &self.buffers.sky),
            None => self.environment.image().is_none(),
        };
        if !is_same {
            self.buffers.sky = environment.image_or_none(gpu)?;
            self.set = gpu.create_scene_set(&self.buffers)?;
        }
        self.environment = environment;
        Ok(())
    }

    /// Moves, turns or dims the lights. Their number and kinds stay, and with them the number of
    /// their views.
    pub(crate) fn move_lights(&mut self, gpu: &Gpu, lights: &[Light]) -> Result<(), Error> {
        assert!(
            self.has_kinds_of(lights),
            "lights that move keep their number and kinds"
        );
        if !lights.is_empty() {
            gpu.upload_buffer(
                &self.buffers.lights,
                cast_slice(&gpu_lights(lights, self.cascades, self.clear_shadow_edge)),
            )?;
        }
        self.lights = lights.to_vec();
        Ok(())
    }

    /// Gives each light a shadow of what is clear, of which the caller writes the rows: this many
    /// along an edge ([`clear_shadow_rows`]). `None`: they have none from now on.
    pub(super) fn set_clear_shadows(
        &mut self,
        gpu: &Gpu,
        shadows: Option<(&Arc<Buffer>, u32)>,
    ) -> Result<(), Error> {
        if shadows.is_none() && !self.buffers.has_clear_shadows {
            return Ok(());
        }
        if let Some((rows, _)) = shadows {
            self.buffers.clear_shadows = Arc::clone(rows);
        }
        self.buffers.has_clear_shadows = shadows.is_some();
        self.clear_shadow_edge = shadows.map_or(0, |(_, edge)| edge);
        let lights = self.lights.clone();
        self.move_lights(gpu, &lights)?;
        self.set = gpu.create_scene_set(&self.buffers)?;
        Ok(())
    }

    /// Sets how many maps directional lights have, for light maps that are made from now on.
    pub fn set_cascades(&mut self, gpu: &Gpu, cascades: LightCascades) -> Result<(), Error> {
        if cascades != self.cascades {
            self.cascades = cascades;
            let lights = self.lights.clone();
            self.move_lights(gpu, &lights)?;
            self.buffers.has_cascades = cascades.are_of(&lights);
            self.set = gpu.create_scene_set(&self.buffers)?;
        }
        Ok(())
    }

    /// The positions of all vertices (m), a storage buffer with three numbers each.
    pub(super) fn positions(&self) -> &Arc<Buffer> {
        &self.buffers.positions
    }

    /// Whether a clear surface bounds a body that bends light.
    pub fn has_clear_bodies(&self) -> bool {
        self.clear.as_ref().is_some_and(|clear| {
            let materials = clear.triangles.iter().map(|one| one.material as usize);
            materials
                .into_iter()
                .any(|one| clear.materials[one].bends())
        })
    }

    /// Whether some material has a normal map.
    pub fn has_bumps(&self) -> bool {
        self.material_textures
            .iter()
            .any(|[_, _, normal, ..]| normal.is_some())
    }

    /// Whether the triangles of a material are of a dynamic model.
    pub fn is_dynamic(&self, material: u32) -> bool {
        self.dynamic
            .as_ref()
            .is_some_and(|dynamic| dynamic.materials[material as usize])
    }

    /// The triangles that can touch a box (m), by runs of one material; some others are among them.
    pub fn triangles_in(&self, low: Vec3, high: Vec3) -> Vec<Batch> {
        let mut found: Vec<Batch> = Vec::new();
        for Cluster { triangles, bounds } in &self.clusters {
            let moving = self
                .dynamic
                .as_ref()
                .filter(|_| self.is_dynamic(triangles.material));
            let (cluster_low, cluster_high) = moving.map_or(*bounds, |dynamic| dynamic.bounds);
            if cluster_low.cmpgt(high).any() || cluster_high.cmplt(low).any() {
                continue;
            }
            match found.last_mut() {
                Some(run)
                    if run.material == triangles.material
                        && run.first_triangle + run.triangle_count == triangles.first_triangle =>
                {
                    run.triangle_count += triangles.triangle_count;
                }
                _ => found.push(*triangles),
            }
        }
        found
    }

    /// A draw of all triangles of each material: of three vertices each, or by [`Self::corners`].
    pub fn draws(&self) -> Vec<DrawBatch> {
        self.draws_where(|_| true)
    }

    /// The same of those with such textures.
    pub fn draws_where(&self, is_drawn: impl Fn(TextureUse) -> bool) -> Vec<DrawBatch> {
        let has_such = |batch: &&Batch| is_drawn(self.texture_use[batch.material as usize]);
        let draw = |batch: &Batch| DrawBatch {
            material: batch.material,
            first_vertex: 3 * batch.first_triangle,
            vertex_count: 3 * batch.triangle_count,
            ..Default::default()
        };
        self.batches.iter().filter(has_such).map(draw).collect()
    }

    /// Smallest and largest corner (m) of all that light can fall on, at any time.
    pub fn lit_bounds(&self) -> (Vec3, Vec3) {
        self.dynamic.as_ref().map_or(self.bounds, |dynamic| {
            union(self.bounds, dynamic.motion_bounds)
        })
    }

    /// The frame constants, for [`GpuScene::set_with`].
    pub(super) fn frame_uniform(&self) -> Arc<Buffer> {
        Arc::clone(&self.buffers.frame_uniform)
    }

    /// Set 0 with frame constants of another buffer.
    pub(super) fn set_with(
        &self,
        gpu: &Gpu,
        frame_uniform: Arc<Buffer>,
    ) -> Result<Arc<SceneSet>, Error> {
        gpu.create_scene_set(&SceneBindings {
            frame_uniform,
            ..self.buffers.clone()
        })
    }

    /// Sets what the next frame is seen with.
    pub fn set_frame(&self, gpu: &Gpu, constants: &FrameConstants) -> Result<(), Error> {
        gpu.upload_buffer(&self.buffers.frame_uniform, bytemuck::bytes_of(constants))
    }

    /// Constants for a camera.
    pub fn frame_constants(&self, camera: &Camera, [width, height]: [u32; 2]) -> FrameConstants {
        let [right, up, forward] = camera.basis();
        let tan_y = (0.5 * camera.vfov_deg.to_radians()).tan();
        let aspect = width as f32 / height as f32;
        let (low, high) = self.lit_bounds();
        let size_m = (high - low).length().max(1e-6);
        let [environment, sky] = self.environment.constants();
        let wide = |vector: Vec3| vector.extend(0.0).to_array();
        FrameConstants {
            clip_from_world: camera
                .clip_from_world(aspect, 1e-4 * size_m)
                .to_cols_array_2d(),
            eye_ws: wide(camera.eye),
            ray_right: wide(right * tan_y * aspect),
            ray_up: wide(up * tan_y),
            ray_forward: wide(forward),
            environment,
            sky,
            size_px: [
                width,
                height,
                self.lights.len() as u32,
                ViewRanges::of(&self.lights, self.cascades).anywhere,
            ],
            walk: [0; 4],
            gathered: Grid::whole([width, height]).row(),
        }
    }
}

/// An error where draws by indices cannot name so many corners: without `fullDrawIndexUint32`.
fn check_corners(full_indices: bool, wanted: usize) -> Result<(), Error> {
    // What Vulkan promises for devices without the feature.
    let available = 1 << 24;
    if full_indices || wanted <= available {
        return Ok(());
    }
    Err(Error::TooManyCorners { wanted, available })
}

/// A storage buffer with contents; at least 16 bytes, so that it can be bound.
pub(crate) fn storage(
    gpu: &Gpu,
    (name, owner): (&str, Owner),
    bytes: &[u8],
) -> Result<Arc<Buffer>, Error> {
    let buffer = gpu.create_buffer(&BufferDesc {
        name: name.into(),
        size_bytes: (bytes.len() as u64).max(16),
        usage: BufferUsage::Storage,
        owner,
    })?;
    if !bytes.is_empty() {
        gpu.upload_buffer(&buffer, bytes)?;
    }
    Ok(buffer)
}

fn gpu_material(material: &Material) -> GpuMaterial {
    let flag = |texture: Option<u32>| if texture.is_some() { 1.0 } else { 0.0 };
    let (f0, roughness, metalness) = material.specular.map_or((Vec3::ZERO, -1.0, 0.0), |lobe| {
        (lobe.f0, lobe.roughness, lobe.metalness)
    });
    GpuMaterial {
        albedo: material
            .albedo
            .extend(flag(material.mask_texture))
            .to_array(),
        emission: material
            .emission
            .extend(flag(material.normal_texture))
            .to_array(),
        specular: f0.extend(roughness).to_array(),
        metalness: [metalness, flag(lobe_texture(material)), 0.0, 0.0],
    }
}

/// `clear_edge`: rows along an edge of their shadows of what is clear, 0 where they have none.
fn gpu_lights(lights: &[Light], cascades: LightCascades, clear_edge: u32) -> Vec<GpuLight> {
    let mut all = Vec::with_capacity(lights.len());
    let ranges = ViewRanges::of(lights, cascades).lights;
    for (index, (light, views)) in (0u32..).zip(lights.iter().zip(ranges)) {
        let (kind, position, direction, power, inner_deg, outer_deg) = match *light {
            Light::Directional {
                direction,
                irradiance,
            } => (0.0, Vec3::ZERO, direction, irradiance, 0.0, 0.0),
            Light::Point {
                position,
                intensity,
            } => (1.0, position, Vec3::ZERO, intensity, 0.0, 0.0),
            Light::Spot {
                position,
                direction,
                intensity,
                inner_deg,
                outer_deg,
            } => (2.0, position, direction, intensity, inner_deg, outer_deg),
        };
        all.push(GpuLight {
            position_kind: position.extend(kind).to_array(),
            direction_inner: direction.extend(inner_deg.to_radians()).to_array(),
            power_outer: power.extend(outer_deg.to_radians()).to_array(),
            views,
            clear: [index * clear_shadow_rows(clear_edge), clear_edge, 0, 0],
        });
    }
    all
}

/// Rows of a light's shadow of what is clear: where it is, and its texels.
pub(super) fn clear_shadow_rows(edge: u32) -> u32 {
    1 + edge * edge
}

/// Its textures of albedo, emission, normal, mask and lobe, as shaders number them.
fn textures_of(material: &Material) -> [Option<u32>; MATERIAL_TEXTURES] {
    [
        material.albedo_texture,
        material.emission_texture,
        material.normal_texture,
        material.mask_texture,
        lobe_texture(material),
    ]
}

fn lobe_texture(material: &Material) -> Option<u32> {
    material.specular.and_then(|lobe| lobe.texture)
}

fn material_sets(
    gpu: &Gpu,
    textures: &[Arc<Image>],
    material_textures: &[[Option<u32>; MATERIAL_TEXTURES]],
) -> Result<MaterialSets, Error> {
    let white = upload_texture(
        gpu,
        &Texture {
            name: "white".into(),
            kind: TextureKind::Mask,
            width: 1,
            height: 1,
            texels: vec![[255; 4]],
        },
    )?;
    let image = |index: &Option<u32>| index.map_or(&white, |index| &textures[index as usize]);
    let sets = material_textures
        .iter()
        .map(|textures| gpu.create_material_set(textures.each_ref().map(image)));
    Ok(sets.collect::<Result<Vec<_>, _>>()?.into())
}

/// A texture with its whole mip chain; colours are filtered in linear light, normals to their
/// means.
fn upload_texture(gpu: &Gpu, texture: &Texture) -> Result<Arc<Image>, Error> {
    let format = match texture.kind {
        TextureKind::Color => vk::Format::R8G8B8A8_SRGB,
        TextureKind::Mask | TextureKind::Normal => vk::Format::R8G8B8A8_UNORM,
    };
    let extent = [texture.width, texture.height, 1];
    let image = gpu.create_image(&ImageDesc {
        name: format!("texture {}", texture.name),
        extent,
        kind: ImageKind::D2,
        format,
        mips: ImageDesc::full_mips(extent),
        layers: 1,
        usage: ImageUsage::SAMPLED,
        owner: Owner::Shared,
    })?;
    gpu.upload_image(&image, 0, 0, cast_slice(&texture.texels))?;
    if texture.kind == TextureKind::Normal {
        for (mip, texels) in (1..).zip(levels_of_means(texture)) {
            gpu.upload_image(&image, mip, 0, cast_slice(&texels))?;
        }
    } else {
        let mut frame = Frame::new();
        frame.blit_mips("scene.texture_mips", &image);
        gpu.submit(frame)?;
    }
    Ok(image)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_that_no_index_names_are_refused_with_numbers() {
        let most = 1 << 24;
        assert!(check_corners(false, most).is_ok());
        assert!(check_corners(true, most + 1).is_ok());
        let refused = check_corners(false, most + 1);
        assert!(refused.is_err_and(|error| {
            let message = error.to_string();
            message.contains("16777217 corners") && message.contains("name 16777216")
        }));
    }
}
