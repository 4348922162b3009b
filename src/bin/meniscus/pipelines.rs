//! `meniscus pipelines`: what a driver's compiler makes of the shaders of a method.

use crate::{choices, on, options::Options, outputs, picture::Picture, report, scene::Prepare, terminal::line};
use ash::vk::{Buffer, Format};
use meniscus::{
    ash,
    compiler::{self, CompiledStage},
    host::{DeviceInfo, Gpu, Instance},
    prepare::{self, DevicePositions},
    renderer::Amount,
};
use serde_json::{Map, Value, json};
use std::{error::Error, path::PathBuf, process::ExitCode};

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    options: Options,
    /// Compile each of these methods
    #[arg(long, value_name = "PRESET,...", value_delimiter = ',', conflicts_with = "method", value_parser = choices::presets())]
    methods: Vec<String>,
    /// Particles of the frame: of one without any only the environment is drawn
    #[arg(long, value_name = "N", default_value_t = 125_000)]
    count: u32,
    /// Where to write the figures as JSON; the terminal shows the best known of them in any case
    #[arg(short, long, value_name = "FILE.json")]
    output: Option<PathBuf>,
}

/// As most swapchains and engines have it.
const OUTPUT: Format = Format::R8G8B8A8_UNORM;

/// What the terminal shows: heads of columns, and what drivers call such a figure, in lower case.
const COLUMNS: &[(&str, &[&str])] = &[
    ("registers", &["vgprs", "register count", "registers"]),
    ("spilled", &["spilled vgprs", "spill count", "spills"]),
    ("waves", &["subgroups per simd", "max waves per core"]),
    ("instructions", &["instructions", "instruction count"]),
    ("shared B", &["lds size", "workgroup memory"]),
    ("code B", &["code size"]),
];

pub fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    let pictures = args.options.each(Prepare::Gpu, &args.methods)?;
    if let Some(path) = &args.output {
        report::check_json(path, "file")?;
        let scene = args.options.scene.as_deref().map(|p| ("the scene file (--scene)", p));
        outputs::check(&[("the figures (--output)", path)], None, scene.as_slice())?;
    }
    let instance = Instance::new(false)?;
    let device = instance.pick(args.options.device.as_deref())?;
    line(report::measured_on(&device))?;
    let on_device = on(&device);
    let gpu = Gpu::telling(&instance, device).map_err(|e| on_device(e.into()))?;
    let mut methods = Vec::new();
    for (method, picture) in &pictures {
        let stages = compile(args, &gpu, picture).map_err(&on_device)?;
        print(method, &stages)?;
        methods.push(json!({
            "method": method,
            "settings": choices::record(&picture.settings),
            "stages": stages.iter().map(tree).collect::<Vec<_>>(),
        }));
    }
    if let Some(path) = &args.output {
        outputs::write(path, &serde_json::to_vec_pretty(&report_of(args, &gpu.info, &pictures[0].1, methods))?)?;
        line(format!("wrote {}", path.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn compile(args: &Args, gpu: &Gpu, picture: &Picture) -> Result<Vec<CompiledStage>, Box<dyn Error>> {
    // How large they are decides nothing here.
    let (preparer, options) = (picture.preparer(), picture.preparation);
    let options = prepare::Options { search: preparer.search(options.search), ..options };
    let positions = DevicePositions::packed(Buffer::null(), args.count, 1.0).options(options);
    let amount = match preparer.on_device() {
        true => Amount::OnDevice(&positions),
        false => Amount::Prepared { splash: args.count as usize / 2, body: args.count.div_ceil(2) as usize },
    };
    // SAFETY: the device is alive and was made to tell.
    Ok(unsafe { compiler::compile(&gpu.host(1), OUTPUT, picture.rendered_size()?, amount, &picture.settings) }?)
}

fn print(method: &str, stages: &[CompiledStage]) -> Result<(), Box<dyn Error>> {
    line("")?;
    let heads: String = COLUMNS.iter().map(|(head, _)| format!(" {head:>12}")).collect();
    line(format!("{:<46}{heads}", format!("{method}: shader, stage")))?;
    for stage in stages {
        let cell = |(_, names): &(&str, &[&str])| {
            let known = stage.figures.iter().find(|(name, _)| names.contains(&name.to_lowercase().as_str()));
            format!(" {:>12}", known.map_or("-".to_owned(), |(_, value)| value.to_string()))
        };
        let cells: String = COLUMNS.iter().map(cell).collect();
        line(format!("{:<46}{cells}", format!("{} {}", stage.shader, stage.stage)))?;
    }
    Ok(())
}

fn tree(stage: &CompiledStage) -> Value {
    let constants: Map<_, _> = stage.constants.iter().map(|(name, word)| ((*name).to_owned(), json!(word))).collect();
    let figures: Map<_, _> = stage.figures.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
    json!({
        "pass": stage.pass, "shader": stage.shader, "constants": constants, "stage": stage.stage,
        "subgroup_size": stage.subgroup, "figures": figures,
    })
}

fn report_of(args: &Args, device: &DeviceInfo, picture: &Picture, methods: Vec<Value>) -> Value {
    json!({
        "device": device.name, "driver": device.driver, "commit": report::COMMIT, "particles": args.count,
        "prepare": picture.preparer().name(), "output": format!("{OUTPUT:?}"), "methods": methods,
    })
}
