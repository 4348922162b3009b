//! Pipelines, laid out from the shaders' own reflection.

use crate::{
    Error,
    device::Host,
    shader::{Kind, Shader},
};
use ash::vk;

/// A pipeline, its layouts, and the bindings its descriptor set has.
pub(crate) struct Pipeline {
    pub handle: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub set_layout: vk::DescriptorSetLayout,
    pub bindings: Vec<crate::shader::Binding>,
    pub bind_point: vk::PipelineBindPoint,
    pub stages: vk::ShaderStageFlags,
    /// Part of the set layout; null where the shader has none.
    sampler: vk::Sampler,
}

/// What a graphics pipeline of this library differs in.
pub(crate) struct Graphics<'a> {
    pub vertex: &'a Shader,
    pub fragment: &'a Shader,
    pub constants: &'a [u32],
    pub topology: vk::PrimitiveTopology,
    pub colors: &'a [vk::Format],
    /// Depth test and write against D32_SFLOAT; the comparison is dynamic.
    pub depth: bool,
    pub push_bytes: u32,
}

/// Specialisation: constant ids 0, 1, 2 … of four bytes each.
fn map_entries(constants: &[u32]) -> Vec<vk::SpecializationMapEntry> {
    (0..constants.len() as u32).map(|i| vk::SpecializationMapEntry { constant_id: i, offset: 4 * i, size: 4 }).collect()
}

struct Module<'a>(vk::ShaderModule, &'a Host);

impl<'a> Module<'a> {
    fn new(host: &'a Host, shader: &Shader) -> Result<Self, Error> {
        let info = vk::ShaderModuleCreateInfo::default().code(shader.spirv);
        // SAFETY: the words are SPIR-V that shaderc made in build.rs.
        let module = unsafe { host.device.create_shader_module(&info, None) }.map_err(Error::vulkan(shader.name))?;
        Ok(Module(module, host))
    }
}

impl Drop for Module<'_> {
    fn drop(&mut self) {
        // SAFETY: pipelines do not need their modules once they are made.
        unsafe { self.1.device.destroy_shader_module(self.0, None) };
    }
}

impl Pipeline {
    fn layouts(
        host: &Host,
        shaders: &[&Shader],
        stages: vk::ShaderStageFlags,
        push_bytes: u32,
        bind_point: vk::PipelineBindPoint,
    ) -> Result<Pipeline, Error> {
        let mut bindings: Vec<crate::shader::Binding> = Vec::new();
        for b in shaders.iter().flat_map(|s| s.bindings) {
            if !bindings.iter().any(|other| other.index == b.index) {
                bindings.push(*b);
            }
        }
        let name = shaders[0].name;
        let mut pipeline = Pipeline {
            handle: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            bindings,
            bind_point,
            stages,
            sampler: vk::Sampler::null(),
        };
        match pipeline.make_layouts(host, push_bytes) {
            Ok(()) => Ok(pipeline),
            Err(e) => {
                pipeline.destroy(host);
                Err(Error::vulkan(name)(e))
            }
        }
    }

    fn make_layouts(&mut self, host: &Host, push_bytes: u32) -> Result<(), vk::Result> {
        if self.bindings.iter().any(|b| b.kind == Kind::Sampler) {
            let edge = vk::SamplerAddressMode::CLAMP_TO_EDGE;
            let info = vk::SamplerCreateInfo::default().address_mode_u(edge).address_mode_v(edge).address_mode_w(edge);
            // SAFETY: a complete info on a live device; what is made here is destroyed with the struct.
            self.sampler = unsafe { host.device.create_sampler(&info, None) }?;
        }
        let samplers = [self.sampler];
        let infos: Vec<_> = self
            .bindings
            .iter()
            .map(|b| {
                let info = vk::DescriptorSetLayoutBinding::default()
                    .binding(b.index)
                    .descriptor_type(b.kind.descriptor_type())
                    .descriptor_count(1)
                    .stage_flags(self.stages);
                if b.kind == Kind::Sampler { info.immutable_samplers(&samplers) } else { info }
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&infos);
        // SAFETY: as above.
        self.set_layout = unsafe { host.device.create_descriptor_set_layout(&info, None) }?;
        let range = [vk::PushConstantRange { stage_flags: self.stages, offset: 0, size: push_bytes }];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(std::slice::from_ref(&self.set_layout))
            .push_constant_ranges(if push_bytes > 0 { &range } else { &[] });
        // SAFETY: as above.
        self.layout = unsafe { host.device.create_pipeline_layout(&info, None) }?;
        Ok(())
    }

    pub fn compute(host: &Host, shader: &Shader, constants: &[u32], push_bytes: u32) -> Result<Pipeline, Error> {
        let stages = vk::ShaderStageFlags::COMPUTE;
        let module = Module::new(host, shader)?;
        let mut pipeline = Self::layouts(host, &[shader], stages, push_bytes, vk::PipelineBindPoint::COMPUTE)?;
        let entries = map_entries(constants);
        let special = vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(constants));
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(stages)
            .module(module.0)
            .name(c"main")
            .specialization_info(&special);
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(pipeline.layout);
        // SAFETY: module, layout and specialisation outlive the call.
        let made = unsafe { host.device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None) };
        pipeline.finish(host, shader.name, made)?;
        Ok(pipeline)
    }

    pub fn graphics(host: &Host, g: &Graphics) -> Result<Pipeline, Error> {
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let (vertex, fragment) = (Module::new(host, g.vertex)?, Module::new(host, g.fragment)?);
        let mut pipeline =
            Self::layouts(host, &[g.vertex, g.fragment], stages, g.push_bytes, vk::PipelineBindPoint::GRAPHICS)?;
        let entries = map_entries(g.constants);
        let special = vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(g.constants));
        let stage =
            |flag, module| vk::PipelineShaderStageCreateInfo::default().stage(flag).module(module).name(c"main");
        let stage_infos = [
            stage(vk::ShaderStageFlags::VERTEX, vertex.0),
            stage(vk::ShaderStageFlags::FRAGMENT, fragment.0).specialization_info(&special),
        ];
        let input = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(g.topology);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth =
            vk::PipelineDepthStencilStateCreateInfo::default().depth_test_enable(g.depth).depth_write_enable(g.depth);
        let blends = vec![
            vk::PipelineColorBlendAttachmentState::default()
                .color_write_mask(vk::ColorComponentFlags::RGBA);
            g.colors.len()
        ];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let mut dynamic_states = vec![vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        if g.depth {
            dynamic_states.push(vk::DynamicState::DEPTH_COMPARE_OP);
        }
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic_states);
        let depth_format = if g.depth { vk::Format::D32_SFLOAT } else { vk::Format::UNDEFINED };
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(g.colors)
            .depth_attachment_format(depth_format);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stage_infos)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(pipeline.layout)
            .push_next(&mut rendering);
        // SAFETY: everything the info points to outlives the call.
        let made = unsafe { host.device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None) };
        pipeline.finish(host, g.fragment.name, made)?;
        Ok(pipeline)
    }

    fn finish(
        &mut self,
        host: &Host,
        name: &str,
        made: Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)>,
    ) -> Result<(), Error> {
        match made {
            Ok(pipelines) => {
                self.handle = pipelines[0];
                host.set_name(self.handle, name);
                Ok(())
            }
            Err((_, e)) => {
                self.destroy(host);
                Err(Error::vulkan(format!("pipeline of {name}"))(e))
            }
        }
    }

    pub fn destroy(&mut self, host: &Host) {
        // SAFETY: called when no frame is in flight, or the pipeline was never used; null handles are allowed.
        unsafe {
            host.device.destroy_pipeline(self.handle, None);
            host.device.destroy_pipeline_layout(self.layout, None);
            host.device.destroy_descriptor_set_layout(self.set_layout, None);
            host.device.destroy_sampler(self.sampler, None);
        }
    }
}
