//! Compute and graphics pipelines.

use std::sync::Arc;

use ash::vk;

use super::{Context, Device, Error, SetLayout};

/// Sets and push constants of a pipeline.
pub(crate) struct PipelineLayout {
    raw: vk::PipelineLayout,
    device: Arc<Device>,
}

impl PipelineLayout {
    pub(crate) fn new(
        device: &Arc<Device>,
        name: &str,
        sets: &[&SetLayout],
        push_bytes: u32,
    ) -> Result<Arc<Self>, Error> {
        let sets: Vec<_> = sets.iter().map(|set| set.raw()).collect();
        let ranges = [vk::PushConstantRange {
            stage_flags: vk::ShaderStageFlags::ALL,
            offset: 0,
            size: push_bytes,
        }];
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
        let info = if push_bytes > 0 {
            info.push_constant_ranges(&ranges)
        } else {
            info
        };
        // SAFETY: the set layouts are alive.
        let raw = unsafe { device.raw().create_pipeline_layout(&info, None) }
            .during(&format!("creating the pipeline layout {name}"))?;
        device.set_name(raw, name);
        Ok(Arc::new(PipelineLayout {
            raw,
            device: Arc::clone(device),
        }))
    }
}

impl Drop for PipelineLayout {
    fn drop(&mut self) {
        // SAFETY: pipelines hold their layout, and every submission was waited for.
        unsafe { self.device.raw().destroy_pipeline_layout(self.raw, None) };
    }
}

/// A graphics pipeline to make: triangles, no culling unless asked, dynamic viewport and scissor.
pub(crate) struct GraphicsDesc<'d> {
    pub(crate) stages: &'d [(vk::ShaderStageFlags, &'d [u32])],
    pub(crate) color: &'d [vk::Format],
    pub(crate) depth: Option<vk::Format>,
    pub(crate) depth_compare: vk::CompareOp,
    /// Constant and slope factor.
    pub(crate) depth_bias: Option<[f32; 2]>,
    pub(crate) cull: vk::CullModeFlags,
    pub(crate) conservative: bool,
}

/// A pipeline and its layout.
pub(crate) struct Pipeline {
    raw: vk::Pipeline,
    bind_point: vk::PipelineBindPoint,
    layout: Arc<PipelineLayout>,
    device: Arc<Device>,
}

impl Pipeline {
    pub(crate) fn compute(
        device: &Arc<Device>,
        name: &str,
        layout: &Arc<PipelineLayout>,
        words: &[u32],
        constants: &[(u32, u32)],
    ) -> Result<Arc<Self>, Error> {
        let module = Module::new(device, name, words)?;
        let constants = Constants::new(constants);
        let specialization = constants.info();
        let stage = module.stage(vk::ShaderStageFlags::COMPUTE, &specialization);
        // A long dispatch is run in parts, which do not begin with workgroup 0.
        let info = vk::ComputePipelineCreateInfo::default()
            .flags(vk::PipelineCreateFlags::DISPATCH_BASE)
            .stage(stage)
            .layout(layout.raw);
        // SAFETY: module and layout are alive, and a test holds the module against the declared
        // layout.
        let created = unsafe {
            device
                .raw()
                .create_compute_pipelines(device.pipeline_cache(), &[info], None)
        };
        Self::finish(
            device,
            name,
            layout,
            vk::PipelineBindPoint::COMPUTE,
            created,
        )
    }

    pub(crate) fn graphics(
        device: &Arc<Device>,
        name: &str,
        layout: &Arc<PipelineLayout>,
        desc: &GraphicsDesc<'_>,
        constants: &[(u32, u32)],
    ) -> Result<Arc<Self>, Error> {
        let constants = Constants::new(constants);
        let specialization = constants.info();
        let modules: Vec<Module> = desc
            .stages
            .iter()
            .map(|(_, words)| Module::new(device, name, words))
            .collect::<Result<_, _>>()?;
        let stages: Vec<_> = desc
            .stages
            .iter()
            .zip(&modules)
            .map(|((stage, _), module)| module.stage(*stage, &specialization))
            .collect();
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let mut conservative = vk::PipelineRasterizationConservativeStateCreateInfoEXT::default()
            .conservative_rasterization_mode(vk::ConservativeRasterizationModeEXT::OVERESTIMATE);
        let [bias, slope] = desc.depth_bias.unwrap_or_default();
        let mut raster = vk::PipelineRasterizationStateCreateInfo::default()
            .line_width(1.0)
            .cull_mode(desc.cull)
            .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
            .depth_bias_enable(desc.depth_bias.is_some())
            .depth_bias_constant_factor(bias)
            .depth_bias_slope_factor(slope);
        if desc.conservative {
            raster = raster.push_next(&mut conservative);
        }
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let tested = desc.depth.is_some();
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(tested)
            .depth_write_enable(tested)
            .depth_compare_op(desc.depth_compare);
        let blends = vec![
            vk::PipelineColorBlendAttachmentState::default()
                .color_write_mask(vk::ColorComponentFlags::RGBA);
            desc.color.len()
        ];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default()
            .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(desc.color)
            .depth_attachment_format(desc.depth.unwrap_or(vk::Format::UNDEFINED));
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(layout.raw)
            .push_next(&mut rendering);
        // SAFETY: modules and layout are alive, and a test holds the modules against the declared
        // layout.
        let created = unsafe {
            device
                .raw()
                .create_graphics_pipelines(device.pipeline_cache(), &[info], None)
        };
        Self::finish(
            device,
            name,
            layout,
            vk::PipelineBindPoint::GRAPHICS,
            created,
        )
    }

    pub(crate) fn raw(&self) -> vk::Pipeline {
        self.raw
    }

    pub(crate) fn layout(&self) -> vk::PipelineLayout {
        self.layout.raw
    }

    pub(crate) fn bind_point(&self) -> vk::PipelineBindPoint {
        self.bind_point
    }

    fn finish(
        device: &Arc<Device>,
        name: &str,
        layout: &Arc<PipelineLayout>,
        bind_point: vk::PipelineBindPoint,
        created: Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)>,
    ) -> Result<Arc<Self>, Error> {
        let pipelines = created
            .map_err(|(_, result)| result)
            .during(&format!("creating the pipeline {name}"))?;
        let raw = pipelines.first().copied().unwrap_or_default();
        device.set_name(raw, name);
        Ok(Arc::new(Pipeline {
            raw,
            bind_point,
            layout: Arc::clone(layout),
            device: Arc::clone(device),
        }))
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        // SAFETY: every submission that used it was waited for.
        unsafe { self.device.raw().destroy_pipeline(self.raw, None) };
    }
}

/// A shader module, needed only while its pipeline is made.
struct Module {
    raw: vk::ShaderModule,
    device: Arc<Device>,
}

impl Module {
    fn new(device: &Arc<Device>, name: &str, words: &[u32]) -> Result<Self, Error> {
        let info = vk::ShaderModuleCreateInfo::default().code(words);
        // SAFETY: the words are SPIR-V that a test has validated.
        let raw = unsafe { device.raw().create_shader_module(&info, None) }
            .during(&format!("loading a shader of {name}"))?;
        Ok(Module {
            raw,
            device: Arc::clone(device),
        })
    }

    fn stage<'s>(
        &self,
        stage: vk::ShaderStageFlags,
        constants: &'s vk::SpecializationInfo<'s>,
    ) -> vk::PipelineShaderStageCreateInfo<'s> {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(stage)
            .module(self.raw)
            .name(c"main")
            .specialization_info(constants)
    }
}

impl Drop for Module {
    fn drop(&mut self) {
        // SAFETY: pipelines do not need their modules once made.
        unsafe { self.device.raw().destroy_shader_module(self.raw, None) };
    }
}

/// Specialization constants by number, of 32 bits each.
struct Constants {
    entries: Vec<vk::SpecializationMapEntry>,
    data: Vec<u8>,
}

impl Constants {
    fn new(constants: &[(u32, u32)]) -> Self {
        let entries = (0u32..)
            .zip(constants)
            .map(|(place, (id, _))| vk::SpecializationMapEntry {
                constant_id: *id,
                offset: place * 4,
                size: 4,
            })
            .collect();
        let values = constants.iter().flat_map(|(_, value)| value.to_ne_bytes());
        Constants {
            entries,
            data: values.collect(),
        }
    }

    fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default()
            .map_entries(&self.entries)
            .data(&self.data)
    }
}
