//! Runs one compute shader on hand-made depth maps, without the renderer.

use ash::vk;
use meniscus::ash;
use meniscus::host::{Gpu, HostError, Instance};
use meniscus::shader::{Frame, Kind, Shader};
use std::collections::HashMap;

pub struct Job<'a> {
    pub shader: &'a Shader,
    pub frame: &'a Frame,
    /// Images by binding name; two layers, row by row.
    pub inputs: &'a [(&'a str, &'a [f32])],
    pub constants: &'a [u32],
    pub push: &'a [f32],
    /// Pixels along an edge of a group.
    pub edge: u32,
}

pub struct Done {
    pub images: HashMap<&'static str, Vec<f32>>,
    pub counters: [u32; 8],
}

fn ok<T>(r: Result<T, vk::Result>) -> T {
    r.expect("Vulkan")
}

struct Memory<'a> {
    device: &'a ash::Device,
    properties: vk::PhysicalDeviceMemoryProperties,
}

impl Memory<'_> {
    fn get(&self, r: vk::MemoryRequirements, wanted: vk::MemoryPropertyFlags) -> vk::DeviceMemory {
        let index = (0..self.properties.memory_type_count).find(|i| {
            r.memory_type_bits & (1 << i) != 0
                && self.properties.memory_types[*i as usize].property_flags.contains(wanted)
        });
        let info = vk::MemoryAllocateInfo::default().allocation_size(r.size).memory_type_index(index.expect("memory"));
        ok(unsafe { self.device.allocate_memory(&info, None) })
    }
    fn buffer(&self, bytes: &[u8], usage: vk::BufferUsageFlags) -> (vk::Buffer, vk::DeviceMemory) {
        unsafe {
            let info = vk::BufferCreateInfo::default().size(bytes.len() as u64).usage(usage);
            let buffer = ok(self.device.create_buffer(&info, None));
            let flags = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let memory = self.get(self.device.get_buffer_memory_requirements(buffer), flags);
            ok(self.device.bind_buffer_memory(buffer, memory, 0));
            let p = ok(self.device.map_memory(memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()));
            std::ptr::copy_nonoverlapping(bytes.as_ptr(), p.cast(), bytes.len());
            self.device.unmap_memory(memory);
            (buffer, memory)
        }
    }
    fn read(&self, memory: vk::DeviceMemory, words: usize) -> Vec<u32> {
        unsafe {
            let p = ok(self.device.map_memory(memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty())).cast::<u32>();
            let v = std::slice::from_raw_parts(p, words).to_vec();
            self.device.unmap_memory(memory);
            v
        }
    }
}

pub fn run(gpu: &Gpu, job: &Job) -> Done {
    let host = gpu.host(1);
    let device = &host.device;
    let [w, h] = [job.frame.viewport.x as u32, job.frame.viewport.y as u32];
    let words = (w * h * 2) as usize;
    unsafe {
        let memory =
            Memory { device, properties: host.instance.get_physical_device_memory_properties(host.physical_device) };
        let frame = memory.buffer(bytemuck(job.frame), vk::BufferUsageFlags::UNIFORM_BUFFER);
        let counters = memory.buffer(&[0; 32], vk::BufferUsageFlags::STORAGE_BUFFER);
        let mut images = Vec::new();
        for b in job.shader.bindings.iter().filter(|b| matches!(b.kind, Kind::SampledImage | Kind::StorageImage)) {
            let info = vk::ImageCreateInfo::default()
                .image_type(vk::ImageType::TYPE_2D)
                .format(vk::Format::R32_SFLOAT)
                .extent(vk::Extent3D { width: w, height: h, depth: 1 })
                .mip_levels(1)
                .array_layers(2)
                .samples(vk::SampleCountFlags::TYPE_1)
                .usage(
                    vk::ImageUsageFlags::SAMPLED
                        | vk::ImageUsageFlags::STORAGE
                        | vk::ImageUsageFlags::TRANSFER_SRC
                        | vk::ImageUsageFlags::TRANSFER_DST,
                );
            let image = ok(device.create_image(&info, None));
            let bound = memory.get(device.get_image_memory_requirements(image), vk::MemoryPropertyFlags::empty());
            ok(device.bind_image_memory(image, bound, 0));
            let range = vk::ImageSubresourceRange {
                aspect_mask: vk::ImageAspectFlags::COLOR,
                base_mip_level: 0,
                level_count: 1,
                base_array_layer: 0,
                layer_count: 2,
            };
            let view = vk::ImageViewCreateInfo::default()
                .image(image)
                .view_type(vk::ImageViewType::TYPE_2D_ARRAY)
                .format(vk::Format::R32_SFLOAT)
                .subresource_range(range);
            let view = ok(device.create_image_view(&view, None));
            let given = job.inputs.iter().find(|(name, _)| *name == b.name);
            assert_eq!(given.is_some(), b.kind == Kind::SampledImage, "{}", b.name);
            let content: Vec<f32> = given.map_or(vec![f32::NAN; words], |g| g.1.to_vec());
            assert_eq!(content.len(), words);
            let bytes: Vec<u8> = content.iter().flat_map(|v| v.to_ne_bytes()).collect();
            let usage = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
            images.push((b, image, bound, view, range, memory.buffer(&bytes, usage)));
        }
        let layouts: Vec<_> = job
            .shader
            .bindings
            .iter()
            .map(|b| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(b.index)
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
                    .descriptor_type(match b.kind {
                        Kind::SampledImage => vk::DescriptorType::SAMPLED_IMAGE,
                        Kind::StorageImage => vk::DescriptorType::STORAGE_IMAGE,
                        Kind::UniformBuffer => vk::DescriptorType::UNIFORM_BUFFER,
                        _ => vk::DescriptorType::STORAGE_BUFFER,
                    })
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&layouts);
        let set_layout = ok(device.create_descriptor_set_layout(&info, None));
        let push = [vk::PushConstantRange {
            stage_flags: vk::ShaderStageFlags::COMPUTE,
            offset: 0,
            size: 4 * job.push.len() as u32,
        }];
        let set_layouts = [set_layout];
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts).push_constant_ranges(&push);
        let layout = ok(device.create_pipeline_layout(&info, None));
        let module =
            ok(device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(job.shader.spirv), None));
        let entries: Vec<_> = (0..job.constants.len() as u32)
            .map(|i| vk::SpecializationMapEntry { constant_id: i, offset: 4 * i, size: 4 })
            .collect();
        let data: Vec<u8> = job.constants.iter().flat_map(|c| c.to_ne_bytes()).collect();
        let special = vk::SpecializationInfo::default().map_entries(&entries).data(&data);
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main")
            .specialization_info(&special);
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout)];
        let pipeline = device.create_compute_pipelines(vk::PipelineCache::null(), &info, None).expect("pipeline")[0];
        let sizes = [
            vk::DescriptorType::SAMPLED_IMAGE,
            vk::DescriptorType::STORAGE_IMAGE,
            vk::DescriptorType::UNIFORM_BUFFER,
            vk::DescriptorType::STORAGE_BUFFER,
        ]
        .map(|ty| vk::DescriptorPoolSize { ty, descriptor_count: 4 });
        let pool = ok(device
            .create_descriptor_pool(&vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes), None));
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&set_layouts);
        let set = ok(device.allocate_descriptor_sets(&info))[0];
        for b in job.shader.bindings {
            let image = images.iter().find(|i| i.0.index == b.index);
            let image_info = [vk::DescriptorImageInfo {
                image_view: image.map_or(vk::ImageView::null(), |i| i.3),
                image_layout: vk::ImageLayout::GENERAL,
                sampler: vk::Sampler::null(),
            }];
            let buffer = if b.kind == Kind::UniformBuffer { frame.0 } else { counters.0 };
            let buffer_info = [vk::DescriptorBufferInfo { buffer, offset: 0, range: vk::WHOLE_SIZE }];
            let write = vk::WriteDescriptorSet::default().dst_set(set).dst_binding(b.index);
            let write = match b.kind {
                Kind::SampledImage => write.descriptor_type(vk::DescriptorType::SAMPLED_IMAGE).image_info(&image_info),
                Kind::StorageImage => write.descriptor_type(vk::DescriptorType::STORAGE_IMAGE).image_info(&image_info),
                Kind::UniformBuffer => {
                    write.descriptor_type(vk::DescriptorType::UNIFORM_BUFFER).buffer_info(&buffer_info)
                }
                _ => write.descriptor_type(vk::DescriptorType::STORAGE_BUFFER).buffer_info(&buffer_info),
            };
            device.update_descriptor_sets(&[write], &[]);
        }
        let result: Result<(), HostError> = gpu.run(|cmd| {
            let all = |cmd, from, to| {
                let barriers: Vec<_> = images
                    .iter()
                    .map(|i| {
                        vk::ImageMemoryBarrier2::default()
                            .image(i.1)
                            .subresource_range(i.4)
                            .old_layout(from)
                            .new_layout(to)
                            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
                            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
                    })
                    .collect();
                let everything = [vk::MemoryBarrier2::default()
                    .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                    .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                    .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
                    .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)];
                let info = vk::DependencyInfo::default().image_memory_barriers(&barriers).memory_barriers(&everything);
                device.cmd_pipeline_barrier2(cmd, &info);
            };
            let copy = vk::BufferImageCopy::default()
                .image_subresource(vk::ImageSubresourceLayers {
                    aspect_mask: vk::ImageAspectFlags::COLOR,
                    mip_level: 0,
                    base_array_layer: 0,
                    layer_count: 2,
                })
                .image_extent(vk::Extent3D { width: w, height: h, depth: 1 });
            let (general, to, from) = (
                vk::ImageLayout::GENERAL,
                vk::ImageLayout::TRANSFER_DST_OPTIMAL,
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            );
            all(cmd, vk::ImageLayout::UNDEFINED, to);
            for i in &images {
                device.cmd_copy_buffer_to_image(cmd, i.5.0, i.1, to, &[copy]);
            }
            all(cmd, to, general);
            device.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::COMPUTE, pipeline);
            device.cmd_bind_descriptor_sets(cmd, vk::PipelineBindPoint::COMPUTE, layout, 0, &[set], &[]);
            let bytes: Vec<u8> = job.push.iter().flat_map(|c| c.to_ne_bytes()).collect();
            device.cmd_push_constants(cmd, layout, vk::ShaderStageFlags::COMPUTE, 0, &bytes);
            device.cmd_dispatch(cmd, w.div_ceil(job.edge), h.div_ceil(job.edge), 2);
            all(cmd, general, from);
            for i in &images {
                device.cmd_copy_image_to_buffer(cmd, i.1, from, i.5.0, &[copy]);
            }
            Ok(())
        });
        result.expect("run");
        let mut done = Done { images: HashMap::new(), counters: [0; 8] };
        done.counters.copy_from_slice(&memory.read(counters.1, 8));
        for (b, image, bound, view, _, buffer) in images {
            let read = memory.read(buffer.1, words).into_iter().map(f32::from_bits).collect();
            done.images.insert(b.name, read);
            device.destroy_image_view(view, None);
            device.destroy_image(image, None);
            device.free_memory(bound, None);
            device.destroy_buffer(buffer.0, None);
            device.free_memory(buffer.1, None);
        }
        for b in [frame, counters] {
            device.destroy_buffer(b.0, None);
            device.free_memory(b.1, None);
        }
        device.destroy_pipeline(pipeline, None);
        device.destroy_shader_module(module, None);
        device.destroy_pipeline_layout(layout, None);
        device.destroy_descriptor_pool(pool, None);
        device.destroy_descriptor_set_layout(set_layout, None);
        done
    }
}

fn bytemuck(frame: &Frame) -> &[u8] {
    // SAFETY: #[repr(C)], of floats and words without padding.
    unsafe { std::slice::from_raw_parts(std::ptr::from_ref(frame).cast(), size_of::<Frame>()) }
}

pub fn each_driver(test: impl Fn(&Gpu)) {
    let devices = Instance::new(false).and_then(|i| i.devices()).expect("a Vulkan loader");
    for device in devices.into_iter().filter(|d| d.refusal.is_none()) {
        println!("driver: {} ({})", device.name, device.driver);
        let validate = std::env::var_os("NO_VALIDATION").is_none();
        let instance = Instance::new(validate).expect("instance");
        let found = instance.pick(Some(&device.name)).expect("device");
        {
            let gpu = Gpu::new(&instance, found).expect("device");
            test(&gpu);
        }
        assert!(instance.messages().is_empty(), "{}", instance.messages().join("\n"));
    }
}
