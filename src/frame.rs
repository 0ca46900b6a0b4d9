//! The frame, top to bottom.

use std::sync::Arc;

use glam::{Vec3, Vec4};

use crate::gi::entry::{Entry, Part, Stage};
use crate::gi::{
    Context, IndirectLight, LitVoxels, Settings, Technique, TraceAxis, TraceSurface, TracedCone,
};
use crate::graph::{Error, Frame, FrameStats, Gpu, Image as GpuImage};
use crate::image::{Aov, Image};
use crate::render::{
    GBuffer, GpuScene, LightMaps, MapChannel, Output, SET_POSE, SurfaceChannel, read_aov,
    read_light_map, read_surface, screen_image,
};
use crate::scene::{Camera, Scene};

/// What all techniques share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameSettings {
    /// Width and height of the pictures (px).
    pub size: [u32; 2],
    /// Width and height of each shadow map and reflective shadow map (texels).
    pub shadow_resolution: u32,
}

/// The stages of a frame that all techniques share.
pub static STAGES: &[&Stage] = &[
    &Stage {
        name: "moving vertices",
        part: Part::Shared,
        passes: &[SET_POSE],
    },
    &Stage {
        name: "light maps",
        part: Part::Shared,
        passes: &["render.shadow_maps", "render.rsm"],
    },
    &Stage {
        name: "surfaces and composite",
        part: Part::Shared,
        passes: &["render.gbuffer", "render.direct", "render.composite"],
    },
];

/// One scene, one technique, one size: renders frames.
pub struct Renderer<'g> {
    gpu: &'g Gpu,
    scene: GpuScene,
    maps: LightMaps,
    gbuffer: GBuffer,
    output: Output,
    technique: Box<dyn Technique>,
    settings: FrameSettings,
    /// The largest width and height (px): those of the images.
    capacity: [u32; 2],
    /// Whether the technique's structure is as it should be. Where something failed on the way,
    /// the next frame builds it anew.
    is_whole: bool,
    /// Whether the light maps are drawn and nothing has moved since.
    has_maps: bool,
    /// Where the camera was last (m).
    eye: Vec3,
    /// The camera of the last frame.
    camera: Option<Camera>,
    /// The last frame's answer.
    light: Option<IndirectLight>,
}

/// What a probe of a pixel finds.
#[derive(Clone, Debug, PartialEq)]
pub enum Traced {
    /// A cone.
    Cone(TracedCone),
    /// The pixel sees no surface.
    NoSurface,
    /// The technique traces no cones with these settings.
    NoCones,
}

impl<'g> Renderer<'g> {
    /// Uploads the scene and builds the technique's static structure; returns what building cost.
    pub fn new(
        gpu: &'g Gpu,
        scene: &Scene,
        entry: &Entry,
        settings: &Settings,
        frame: FrameSettings,
    ) -> Result<(Self, FrameStats), Error> {
        Renderer::of(gpu, GpuScene::new(gpu, scene)?, entry, settings, frame)
    }

    /// As [`Renderer::new`], of a scene that is on the device already.
    pub fn of(
        gpu: &'g Gpu,
        scene: GpuScene,
        entry: &Entry,
        settings: &Settings,
        frame: FrameSettings,
    ) -> Result<(Self, FrameStats), Error> {
        let eye = scene.eye;
        let context = Context {
            gpu,
            scene: &scene,
            size: frame.size,
            eye,
        };
        let mut technique = (entry.make)(&context, settings)?;
        let build = technique.build(&context)?;
        let maps = if technique.needs_light_maps() {
            LightMaps::new(gpu, &scene, frame.shadow_resolution, technique.needs_rsm())?
        } else {
            LightMaps::none(gpu)?
        };
        let gbuffer = GBuffer::new(gpu, &scene, frame.size)?;
        let output = Output::new(gpu, frame.size)?;
        Ok((
            Renderer {
                gpu,
                scene,
                maps,
                gbuffer,
                output,
                technique,
                settings: frame,
                capacity: frame.size,
                is_whole: true,
                has_maps: false,
                eye,
                camera: None,
                light: None,
            },
            build,
        ))
    }

    /// The scene on the device, for another renderer.
    pub fn into_scene(self) -> GpuScene {
        self.scene
    }

    /// From the next frame on, pictures of this width and height (px), at most those that this was
    /// made with: the same, bit for bit, as those of a renderer that was made with them.
    pub fn set_size(&mut self, size: [u32; 2]) {
        let fits = (0..2).all(|axis| (1..=self.capacity[axis]).contains(&size[axis]));
        assert!(
            fits,
            "pictures of {size:?} px do not fit into {:?} px",
            self.capacity
        );
        (self.settings.size, self.gbuffer.size) = (size, size);
    }

    /// The largest width and height (px).
    pub fn capacity(&self) -> [u32; 2] {
        self.capacity
    }

    /// Builds the technique's static structure again.
    pub fn rebuild(&mut self) -> Result<FrameStats, Error> {
        self.is_whole = false;
        let stats = self.technique.build(&Context {
            gpu: self.gpu,
            scene: &self.scene,
            size: self.settings.size,
            eye: self.eye,
        })?;
        self.is_whole = true;
        Ok(stats)
    }

    /// Moves the dynamic models to where they are in the scene that this was made of, after
    /// [`Scene::set_time`], and brings the technique's structure up to it.
    pub fn set_pose(&mut self, scene: &Scene) -> Result<FrameStats, Error> {
        self.has_maps = false;
        let was_whole = std::mem::take(&mut self.is_whole);
        let mut stats = self.scene.set_pose(self.gpu, scene)?;
        if was_whole {
            stats.append(self.technique.set_pose(&Context {
                gpu: self.gpu,
                scene: &self.scene,
                size: self.settings.size,
                eye: self.eye,
            })?);
        }
        self.is_whole = was_whole;
        Ok(stats)
    }

    /// Moves the lights to where they are in a scene that has as many, of the same kinds; the next
    /// frame shows it.
    pub fn move_lights(&mut self, scene: &Scene) -> Result<(), Error> {
        self.has_maps = false;
        self.technique.forget_lights();
        self.scene.move_lights(self.gpu, &scene.lights)?;
        self.maps.move_lights(self.gpu, &self.scene)
    }

    /// Renders one frame: lights, visible surfaces, world-space store, indirect light, direct
    /// light, composite.
    pub fn render(&mut self, camera: &Camera) -> Result<FrameStats, Error> {
        self.has_maps = false;
        self.render_again(camera)
    }

    /// As [`Renderer::render`], with the light maps of the frame before where nothing but the
    /// camera has moved since: the same picture in less time.
    pub fn render_again(&mut self, camera: &Camera) -> Result<FrameStats, Error> {
        self.scene.set_frame(
            self.gpu,
            &self.scene.frame_constants(camera, self.settings.size),
        )?;
        (self.eye, self.camera) = (camera.eye, Some(*camera));
        let mut stats = if self.is_whole {
            FrameStats::default()
        } else {
            self.rebuild()?
        };
        self.is_whole = false;
        stats.append(self.technique.set_view(&Context {
            gpu: self.gpu,
            scene: &self.scene,
            size: self.settings.size,
            eye: self.eye,
        })?);
        let mut frame = Frame::new();
        frame.set_scene(&self.scene.set, &self.scene.materials);
        if !self.has_maps {
            self.maps.draw(&mut frame, &self.scene);
        }
        self.gbuffer.draw(&mut frame, &self.scene);
        self.technique.update(&mut frame, &self.scene, &self.maps);
        let light = self
            .technique
            .gather(&mut frame, &self.scene, &self.maps, &self.gbuffer);
        self.technique.direct(
            &mut frame,
            &self.scene,
            &self.maps,
            &self.gbuffer,
            &self.output,
        );
        self.output
            .draw_composite(&mut frame, &self.gbuffer, &light);
        self.light = Some(light);
        stats.append(self.gpu.submit(frame)?);
        (self.is_whole, self.has_maps) = (true, true);
        Ok(stats)
    }

    /// One of the last frame's images.
    pub fn aov(&self, aov: Aov) -> Result<Image, Error> {
        let Some(light) = &self.light else {
            return Ok(Image::new(self.settings.size[0], self.settings.size[1]));
        };
        read_aov(self.gpu, &self.gbuffer, &self.output, light, aov)
    }

    /// Names and numbers of levels of the volumes that the technique keeps, as
    /// [`Renderer::view_voxels`] takes them.
    pub fn volumes(&self) -> Vec<(&'static str, u32)> {
        self.technique
            .volumes()
            .iter()
            .map(|volume| (volume.name, volume.levels))
            .collect()
    }

    /// A level of one of the technique's volumes as the camera of the last frame sees it, and the
    /// opacity of what it sees. `None` where there is no such volume or level.
    pub fn view_voxels(&self, name: &str, level: u32) -> Result<Option<[Image; 2]>, Error> {
        let volumes = self.technique.volumes();
        let Some(volume) = volumes
            .iter()
            .find(|volume| volume.name == name && level < volume.levels)
        else {
            return Ok(None);
        };
        let texels = self.view_volume(|frame, seen| volume.view(frame, level, seen))?;
        let [width, height] = self.settings.size;
        let of = |value: fn(&[f32; 4]) -> Vec3| {
            Image::from_fn(width, height, |pixel| value(&texels[pixel]))
        };
        Ok(Some([
            of(|&[r, g, b, _]| Vec3::new(r, g, b)),
            of(|&[.., opacity]| Vec3::splat(opacity)),
        ]))
    }

    /// How the technique's first volume divides space on one of its levels, as the camera of the
    /// last frame sees it (`cone.view`). `None` where there is no volume or no such level.
    pub fn view_structure(&self, level: u32) -> Result<Option<Image>, Error> {
        let volumes = self.technique.volumes();
        let Some(volume) = volumes.first().filter(|volume| level < volume.levels) else {
            return Ok(None);
        };
        let texels = self.view_volume(|frame, seen| volume.view_structure(frame, level, seen))?;
        let [width, height] = self.settings.size;
        Ok(Some(Image::from_fn(width, height, |pixel| {
            Vec4::from(texels[pixel]).truncate()
        })))
    }

    /// Runs passes that write an RGBA32F image of the frame's size, and reads it.
    fn view_volume(
        &self,
        add: impl FnOnce(&mut Frame, &Arc<GpuImage>),
    ) -> Result<Vec<[f32; 4]>, Error> {
        let seen = screen_image(self.gpu, "cone.view", self.settings.size)?;
        let mut frame = Frame::new();
        frame.set_scene(&self.scene.set, &self.scene.materials);
        add(&mut frame, &seen);
        self.gpu.submit(frame)?;
        Ok(bytemuck::pod_collect_to_vec(
            &self.gpu.read_image(&seen, 0, 0)?,
        ))
    }

    /// One cone from what a pixel of the last frame sees, as the technique's gathers trace it;
    /// `aperture_deg` in place of its own (degrees).
    pub fn probe(
        &self,
        pixel: [u32; 2],
        axis: TraceAxis,
        aperture_deg: Option<f32>,
    ) -> Result<Traced, Error> {
        let [width, height] = self.settings.size;
        let index = (pixel[0] + width * pixel[1]) as usize;
        let (Some(camera), true) = (&self.camera, pixel[0] < width && pixel[1] < height) else {
            return Ok(Traced::NoSurface);
        };
        let depth_m = self.aov(Aov::Depth)?.pixels[index].x;
        if depth_m <= 0.0 {
            return Ok(Traced::NoSurface);
        }
        let ray = camera.ray_direction(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5, width, height);
        let [.., forward] = camera.basis();
        let surface = TraceSurface {
            pixel,
            position: camera.eye + depth_m / ray.dot(forward) * ray,
            geometric_normal: self.surface(SurfaceChannel::GeometricNormal)?.pixels[index],
            shading_normal: self.aov(Aov::Normal)?.pixels[index],
            roughness: self.surface(SurfaceChannel::Roughness)?.pixels[index].x,
            eye: camera.eye,
        };
        let context = Context {
            gpu: self.gpu,
            scene: &self.scene,
            size: self.settings.size,
            eye: self.eye,
        };
        Ok(self
            .technique
            .trace(&context, &surface, axis, aperture_deg)?
            .map_or(Traced::NoCones, Traced::Cone))
    }

    /// A channel of the last frame's G-buffer.
    pub fn surface(&self, channel: SurfaceChannel) -> Result<Image, Error> {
        read_surface(self.gpu, &self.gbuffer, channel)
    }

    /// A channel of one of the last frame's light maps; `None` where the technique asks for no such
    /// map.
    pub fn light_map(&self, channel: MapChannel, view: u32) -> Result<Option<Image>, Error> {
        read_light_map(self.gpu, &self.maps, channel, view)
    }

    /// How many light maps there are.
    pub fn light_map_count(&self) -> u32 {
        self.maps.view_count
    }

    /// Samples that the cones of the last frame's gather take, by the name of the pass.
    pub fn count_samples(&self) -> Result<Vec<(&'static str, u64)>, Error> {
        self.technique
            .count_samples(self.gpu, &self.scene, &self.gbuffer)
    }

    /// The technique's voxels and their light, a piece of the grid each; what is replaced there
    /// shows in the next frame.
    pub fn lit_voxels(&mut self) -> Vec<LitVoxels<'_>> {
        self.technique.lit_voxels()
    }

    /// Edge of the technique's finest voxels (m); `None` where it has none.
    pub fn voxel_size(&self) -> Option<f32> {
        self.technique.voxel_size()
    }

    /// Counts of the last frame, by name.
    pub fn counts(&self) -> Result<Vec<(&'static str, u64)>, Error> {
        self.technique.counts(self.gpu)
    }
}
