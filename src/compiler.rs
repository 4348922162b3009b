//! What a driver's compiler makes of a frame's pipelines: registers, spills, occupancy, instructions, code size. Pipelines are
//! made for that alone and run nothing, so that hardware which is not there (Mesa's null hardware) serves as well.

use crate::{
    Error, Host, Settings, device::name, frame, pipeline::Pipeline, plan::Recipe, renderer::Amount, scene::Scene,
};
use ash::{khr::pipeline_executable_properties as executables, vk};
use std::ffi::CStr;

/// The device extension that tells it. A device for [`compile`] is created with it and with the feature
/// `pipelineExecutableInfo`.
pub const EXTENSION: &CStr = executables::NAME;

/// What became of one stage of a pipeline.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CompiledStage {
    /// The first pass of the frame that uses the pipeline.
    pub pass: &'static str,
    /// The stage's shader, with the macros it was compiled with.
    pub shader: &'static str,
    /// Specialisation constants, as words.
    pub constants: Vec<(&'static str, u32)>,
    /// The driver's name for the stage or for its variant of it.
    pub stage: String,
    /// Invocations of a subgroup; 0 if the driver does not say.
    pub subgroup: u32,
    /// The driver's figures, by its names.
    pub figures: Vec<(String, f64)>,
}

impl CompiledStage {
    /// The figure of this name.
    pub fn figure(&self, name: &str) -> Option<f64> {
        self.figures.iter().find(|(known, _)| known == name).map(|(_, value)| *value)
    }
}

/// Compiles every pipeline of a frame of so many pixels, particles and these settings, in an output of this format, each once;
/// and says what became of each of its stages, in the order of the frame.
///
/// # Safety
/// The handles in `host` are alive, and its device was created with [`EXTENSION`] and its feature.
pub unsafe fn compile(
    host: &Host,
    output: vk::Format,
    size: [u32; 2],
    amount: Amount,
    settings: &Settings,
) -> Result<Vec<CompiledStage>, Error> {
    settings.validate()?;
    check(host)?;
    let mut scene = Scene::new(settings, size, [0, 0], &host.limits());
    scene.output = output;
    amount.fill(&mut scene)?;
    let plan = frame::plan(&scene)?;
    let tells = executables::Device::new(&host.instance, &host.device);
    let mut all = Vec::new();
    for (pass, recipe) in plan.pipelines() {
        let mut pipeline = Pipeline::new(host, recipe, vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR)?;
        let told = stages(&tells, pipeline.handle, pass, recipe);
        pipeline.destroy(host);
        all.extend(told.map_err(Error::vulkan(recipe.name()))?);
    }
    Ok(all)
}

/// Refuses a device that does not tell.
fn check(host: &Host) -> Result<(), Error> {
    let mut told = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut told);
    // SAFETY: `Host` promises a live instance and a physical device of it; the chain lives on this stack frame.
    let properties = unsafe {
        host.instance.get_physical_device_features2(host.physical_device, &mut features);
        host.instance.get_physical_device_properties(host.physical_device)
    };
    if told.pipeline_executable_info == 0 { Err(not_told(name(&properties))) } else { Ok(()) }
}

/// Why nothing is to be had of a device of this name.
pub(crate) fn not_told(device: String) -> Error {
    let missing =
        "VK_KHR_pipeline_executable_properties, by which drivers tell what they compile (RADV even for null hardware),";
    Error::Unsupported { device, missing: missing.into() }
}

fn stages(
    tells: &executables::Device,
    pipeline: vk::Pipeline,
    pass: &'static str,
    recipe: &Recipe,
) -> Result<Vec<CompiledStage>, vk::Result> {
    let info = vk::PipelineInfoKHR::default().pipeline(pipeline);
    // SAFETY: the pipeline is alive, of this device, and was made to tell statistics; also below.
    let found = unsafe { tells.get_pipeline_executable_properties(&info) }?;
    let stage = |(i, properties): (usize, &vk::PipelineExecutablePropertiesKHR)| {
        let info = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline).executable_index(i as u32);
        // SAFETY: as above; the index is one of those that were listed.
        let figures = unsafe { tells.get_pipeline_executable_statistics(&info) }?;
        Ok(CompiledStage {
            pass,
            shader: shader_of(recipe, properties.stages),
            constants: constants(recipe),
            stage: text(properties.name_as_c_str()),
            subgroup: properties.subgroup_size,
            figures: figures.iter().map(|f| (text(f.name_as_c_str()), figure(f))).collect(),
        })
    };
    found.iter().enumerate().map(stage).collect()
}

/// The one that the driver made this stage of; the last of several.
fn shader_of(recipe: &Recipe, stages: vk::ShaderStageFlags) -> &'static str {
    match recipe.shaders.as_slice() {
        [vertex, _] if stages == vk::ShaderStageFlags::VERTEX => vertex.name,
        _ => recipe.name(),
    }
}

/// Their names and values.
fn constants(recipe: &Recipe) -> Vec<(&'static str, u32)> {
    let named = |id: u32| {
        let declared = recipe.shaders.iter().flat_map(|shader| shader.constants);
        declared.into_iter().find(|(known, ..)| *known == id).map_or("", |(_, name, _)| name)
    };
    recipe.constants.iter().map(|(id, word)| (named(*id), *word)).collect()
}

fn text(told: Result<&CStr, std::ffi::FromBytesUntilNulError>) -> String {
    told.map(|text| text.to_string_lossy().into_owned()).unwrap_or_default()
}

fn figure(told: &vk::PipelineExecutableStatisticKHR) -> f64 {
    use vk::PipelineExecutableStatisticFormatKHR as Format;
    // SAFETY: the format says which member was written, and every bit pattern is a value of each.
    unsafe {
        match told.format {
            Format::BOOL32 => f64::from(told.value.b32),
            Format::INT64 => told.value.i64 as f64,
            Format::UINT64 => told.value.u64 as f64,
            _ => told.value.f64,
        }
    }
}
