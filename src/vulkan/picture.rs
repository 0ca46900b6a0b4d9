//! Pictures that the device has rendered, in a window beneath its panels: light becomes colours as
//! it is drawn.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};

use super::{
    Buffer, BufferDesc, BufferUsage, Commands, Descriptor, DescriptorPool, Device, Error,
    GraphicsDesc, Image, Owner, Pipeline, PipelineLayout, SetLayout,
};

const NAME: &str = "window.picture";

/// The shaders that draw pictures, as SPIR-V (`glsl/view/picture.*`).
pub struct PictureShaders {
    /// Covers the viewport.
    pub vertex: Vec<u32>,
    /// From light to colours.
    pub fragment: Vec<u32>,
    /// By sRGB code of 8 bits: the smallest light that has it.
    pub least: Vec<f32>,
}

/// A picture in a window.
#[derive(Clone)]
pub struct PlacedPicture {
    /// Its light, RGBA32F, which draws may sample.
    pub image: Arc<Image>,
    /// Width and height of the part of the image that it is (texels).
    pub size: [u32; 2],
    /// Where it is: corner, width and height (px).
    pub place: [f32; 4],
    /// What of the window it may cover: corner, width and height (px).
    pub clip: [u32; 4],
    /// Factor before the tone map.
    pub exposure: f32,
    /// As the shader has it.
    pub tone_map: u32,
}

/// Parameters of the shaders.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Params {
    corner_px: [f32; 2],
    texels_per_px: [f32; 2],
    last: [i32; 2],
    exposure: f32,
    tone_map: u32,
}

/// What pictures are drawn with, for windows of one format.
pub(super) struct Pictures {
    format: vk::Format,
    pipeline: Arc<Pipeline>,
    set: Arc<SetLayout>,
    codes: Arc<Buffer>,
}

/// What drawing pictures uses until it is done.
#[derive(Default)]
pub(super) struct Drawn {
    _pool: Option<DescriptorPool>,
    _images: Vec<Arc<Image>>,
}

impl Pictures {
    pub(super) fn new(
        device: &Arc<Device>,
        shaders: &PictureShaders,
        (format, encodes): (vk::Format, bool),
    ) -> Result<Self, Error> {
        let kinds = [
            vk::DescriptorType::SAMPLED_IMAGE,
            vk::DescriptorType::UNIFORM_BUFFER,
        ];
        let set = SetLayout::new(device, NAME, &kinds)?;
        let ends = shaders.least.iter().skip(1).chain([&f32::INFINITY]);
        let table = shaders.least.iter().zip(ends);
        let table: Vec<[f32; 4]> = table
            .map(|(least, next)| [*least, *next, 0.0, 0.0])
            .collect();
        let bytes: &[u8] = bytemuck::cast_slice(&table);
        let codes = Buffer::new(
            device,
            &BufferDesc {
                name: "window.codes".into(),
                size_bytes: bytes.len() as u64,
                usage: BufferUsage::Table,
                owner: Owner::Shared,
            },
        )?;
        codes.write_mapped(0, bytes);
        let bytes = size_of::<Params>() as u32;
        let layout = PipelineLayout::new(device, NAME, &[&set], bytes)?;
        let stages = [
            (vk::ShaderStageFlags::VERTEX, shaders.vertex.as_slice()),
            (vk::ShaderStageFlags::FRAGMENT, shaders.fragment.as_slice()),
        ];
        let desc = GraphicsDesc {
            stages: &stages,
            color: &[format],
            depth: None,
            depth_compare: vk::CompareOp::ALWAYS,
            depth_bias: None,
            cull: vk::CullModeFlags::NONE,
            conservative: false,
        };
        let constants = [(0, u32::from(encodes))];
        Ok(Pictures {
            format,
            pipeline: Pipeline::graphics(device, NAME, &layout, &desc, &constants)?,
            set,
            codes,
        })
    }

    pub(super) fn format(&self) -> vk::Format {
        self.format
    }

    /// Draws pictures into the window of this size (px), in a rendering scope; what is returned has
    /// to live until that is done.
    pub(super) fn draw(
        &self,
        device: &Arc<Device>,
        commands: vk::CommandBuffer,
        pictures: &[PlacedPicture],
        window: [u32; 2],
    ) -> Result<Drawn, Error> {
        if pictures.is_empty() {
            return Ok(Drawn::default());
        }
        let pool = DescriptorPool::new(device, pictures.iter().map(|_| &*self.set))?;
        let commands = Commands::of_host(device, commands);
        commands.bind_pipeline(&self.pipeline);
        for picture in pictures {
            let [x, y, width, height] = picture.place;
            let clip = common(picture.clip, [0, 0, window[0], window[1]]);
            if width <= 0.0 || height <= 0.0 || clip[2] == 0 || clip[3] == 0 {
                continue;
            }
            let layout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
            let view = picture.image.view(0..1)?;
            let shown = [
                Descriptor::Image(view, layout),
                Descriptor::Buffer(self.codes.raw()),
            ];
            let set = pool.set(NAME, &self.set, &shown)?;
            commands.bind_set(&self.pipeline, 0, set);
            let [columns, rows] = picture.size;
            let params = Params {
                corner_px: [x, y],
                texels_per_px: [columns as f32 / width, rows as f32 / height],
                last: picture.size.map(|size| size.saturating_sub(1) as i32),
                exposure: picture.exposure,
                tone_map: picture.tone_map,
            };
            commands.push(&self.pipeline, bytemuck::bytes_of(&params));
            commands.draw_at(picture.place, clip);
            commands.draw(0, 3);
        }
        Ok(Drawn {
            _pool: Some(pool),
            _images: pictures
                .iter()
                .map(|picture| Arc::clone(&picture.image))
                .collect(),
        })
    }
}

/// What two rectangles have in common: corner, width and height.
fn common(a: [u32; 4], b: [u32; 4]) -> [u32; 4] {
    let [x, y] = [0, 1].map(|axis| a[axis].max(b[axis]));
    let end = |axis: usize| {
        let ends = [a, b].map(|one| one[axis].saturating_add(one[axis + 2]));
        ends[0].min(ends[1])
    };
    [x, y, end(0).saturating_sub(x), end(1).saturating_sub(y)]
}

#[cfg(test)]
mod tests {
    use super::common;

    #[test]
    fn rectangles_have_in_common_what_both_cover() {
        assert_eq!(common([2, 3, 10, 10], [0, 0, 8, 9]), [2, 3, 6, 6]);
        assert_eq!(common([9, 3, 10, 10], [0, 0, 8, 9])[2], 0);
        assert_eq!(common([0, 0, u32::MAX, 4], [1, 1, 5, 5]), [1, 1, 5, 3]);
    }
}
