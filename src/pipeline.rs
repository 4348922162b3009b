//! Pipelines, laid out from the shaders' own reflection.

use crate::{
    Error,
    device::Host,
    plan::{Blend, Recipe},
    shader::{Kind, Shader},
};
use ash::vk;
use rayon::prelude::*;
use std::collections::HashMap;

/// What making one pipeline gives.
type Made = Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)>;

impl Blend {
    fn state(self) -> vk::PipelineColorBlendAttachmentState {
        let state = vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
        let op = match self {
            Blend::Replace => return state,
            Blend::Add => vk::BlendOp::ADD,
            Blend::Largest => vk::BlendOp::MAX,
        };
        let (one, state) = (vk::BlendFactor::ONE, state.blend_enable(true).color_blend_op(op).alpha_blend_op(op));
        let state = state.src_color_blend_factor(one).dst_color_blend_factor(one);
        state.src_alpha_blend_factor(one).dst_alpha_blend_factor(one)
    }
}

/// A pipeline, its layouts, and the bindings its descriptor set has.
pub(crate) struct Pipeline {
    pub handle: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub set_layout: vk::DescriptorSetLayout,
    pub bind_point: vk::PipelineBindPoint,
    pub stages: vk::ShaderStageFlags,
    /// Part of the set layout; null where the shader has none.
    sampler: vk::Sampler,
}

/// Nothing is asked of a pipeline but to work.
const PLAIN: vk::PipelineCreateFlags = vk::PipelineCreateFlags::empty();

/// Every pipeline that was ever asked for.
#[derive(Default)]
pub(crate) struct Pipelines(HashMap<Recipe, Pipeline>);

impl Pipelines {
    /// Makes those that are not there yet, on all cores; says how many.
    pub fn make<'a>(&mut self, host: &Host, recipes: impl IntoIterator<Item = &'a Recipe>) -> Result<usize, Error> {
        let missing: Vec<_> = recipes.into_iter().filter(|r| !self.0.contains_key(*r)).collect();
        // One after the other where there is one: a frame on the host's thread wakes no others.
        let made: Vec<_> = match missing.as_slice() {
            [one] => vec![Pipeline::new(host, one, PLAIN)],
            many => many.par_iter().map(|r| Pipeline::new(host, r, PLAIN)).collect(),
        };
        let mut first_error = Ok(missing.len());
        for (recipe, pipeline) in missing.into_iter().zip(made) {
            match pipeline {
                Ok(pipeline) => drop(self.0.insert(recipe.clone(), pipeline)),
                Err(e) => first_error = first_error.and(Err(e)),
            }
        }
        first_error
    }

    #[cfg(feature = "inspect")]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    pub fn get(&self, recipe: &Recipe) -> Option<&Pipeline> {
        self.0.get(recipe)
    }

    pub fn destroy(&mut self, host: &Host) {
        self.0.drain().for_each(|(_, mut p)| p.destroy(host));
    }
}

/// Specialisation: four bytes a constant.
fn map_entries(constants: &[(u32, u32)]) -> (Vec<vk::SpecializationMapEntry>, Vec<u32>) {
    let entry = |(i, (id, _)): (usize, &(u32, u32))| vk::SpecializationMapEntry {
        constant_id: *id,
        offset: 4 * i as u32,
        size: 4,
    };
    (constants.iter().enumerate().map(entry).collect(), constants.iter().map(|c| c.1).collect())
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
    pub fn new(host: &Host, recipe: &Recipe, flags: vk::PipelineCreateFlags) -> Result<Pipeline, Error> {
        // Not every device blends every float format: layers that need it are refused on those.
        for (format, blend) in &recipe.colors {
            host.check_attachment(*format, *blend != Blend::Replace)?;
        }
        if let Some(format) = recipe.depth {
            host.check_depth(format)?;
        }
        let modules: Result<Vec<_>, _> = recipe.shaders.iter().map(|s| Module::new(host, s)).collect();
        let modules = modules?;
        let mut pipeline = Self::layouts(host, recipe)?;
        let made = match modules.as_slice() {
            [one] => pipeline.compute(host, recipe, one, flags),
            _ => pipeline.graphics(host, recipe, &modules, flags),
        };
        pipeline.finish(host, recipe.name(), made)?;
        Ok(pipeline)
    }

    fn layouts(host: &Host, recipe: &Recipe) -> Result<Pipeline, Error> {
        let compute = recipe.shaders.len() == 1;
        let mut pipeline = Pipeline {
            handle: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            bind_point: if compute { vk::PipelineBindPoint::COMPUTE } else { vk::PipelineBindPoint::GRAPHICS },
            stages: recipe.stages(),
            sampler: vk::Sampler::null(),
        };
        match pipeline.fill_layouts(host, recipe) {
            Ok(()) => Ok(pipeline),
            Err(result) => {
                pipeline.destroy(host);
                Err(Error::vulkan(recipe.name())(result))
            }
        }
    }

    fn fill_layouts(&mut self, host: &Host, recipe: &Recipe) -> Result<(), vk::Result> {
        let bindings = recipe.bindings();
        if bindings.iter().any(|b| b.kind == Kind::Sampler) {
            let edge = vk::SamplerAddressMode::CLAMP_TO_EDGE;
            let info = vk::SamplerCreateInfo::default().address_mode_u(edge).address_mode_v(edge).address_mode_w(edge);
            // SAFETY: the device is alive, the infos are complete; also for the calls below.
            self.sampler = unsafe { host.device.create_sampler(&info, None) }?;
        }
        let samplers = [self.sampler];
        let infos: Vec<_> = bindings
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
        let size = recipe.push_bytes();
        let range = [vk::PushConstantRange { stage_flags: self.stages, offset: 0, size }];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(std::slice::from_ref(&self.set_layout))
            .push_constant_ranges(if size > 0 { &range } else { &[] });
        // SAFETY: as above.
        self.layout = unsafe { host.device.create_pipeline_layout(&info, None) }?;
        Ok(())
    }

    fn compute(&self, host: &Host, recipe: &Recipe, module: &Module, flags: vk::PipelineCreateFlags) -> Made {
        let (entries, data) = map_entries(&recipe.constants);
        let special = vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(&data));
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(self.stages)
            .module(module.0)
            .name(c"main")
            .specialization_info(&special);
        let info = vk::ComputePipelineCreateInfo::default().flags(flags).stage(stage).layout(self.layout);
        // SAFETY: module, layout and specialisation outlive the call; the cache is alive or null (contract of `Host`).
        unsafe { host.device.create_compute_pipelines(host.pipeline_cache, &[info], None) }
    }

    fn graphics(&self, host: &Host, recipe: &Recipe, modules: &[Module], flags: vk::PipelineCreateFlags) -> Made {
        let (entries, data) = map_entries(&recipe.constants);
        let special = vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(&data));
        let stages = [vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT];
        let stage_infos: Vec<_> = stages
            .into_iter()
            .zip(modules)
            .map(|(flag, module)| {
                let info = vk::PipelineShaderStageCreateInfo::default().stage(flag).module(module.0).name(c"main");
                info.specialization_info(&special)
            })
            .collect();
        let input = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(recipe.topology);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(recipe.depth.is_some())
            .depth_write_enable(recipe.depth.is_some());
        let blends: Vec<_> = recipe.colors.iter().map(|(_, blend)| blend.state()).collect();
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let mut dynamic_states = vec![vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        if recipe.depth.is_some() {
            dynamic_states.push(vk::DynamicState::DEPTH_COMPARE_OP);
        }
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic_states);
        let formats: Vec<_> = recipe.colors.iter().map(|(format, _)| *format).collect();
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&formats)
            .depth_attachment_format(recipe.depth.unwrap_or_default());
        let info = vk::GraphicsPipelineCreateInfo::default()
            .flags(flags)
            .stages(&stage_infos)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(self.layout)
            .push_next(&mut rendering);
        // SAFETY: everything the info points to outlives the call; the cache is alive or null (contract of `Host`).
        unsafe { host.device.create_graphics_pipelines(host.pipeline_cache, &[info], None) }
    }

    fn finish(&mut self, host: &Host, name: &str, made: Made) -> Result<(), Error> {
        match made {
            Ok(pipelines) => {
                self.handle = pipelines[0];
                host.set_name(self.handle, name);
                host.set_name(self.layout, name);
                host.set_name(self.set_layout, name);
                if self.sampler != vk::Sampler::null() {
                    host.set_name(self.sampler, name);
                }
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
