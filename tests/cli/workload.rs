//! Fixed frames: the same every time, and what their table says is what a capture of them holds.

use crate::{Run, text};
use meniscus::host::Instance;
use serde_json::Value;
use std::{fs, path::Path, process::Command};

pub fn devices() -> Vec<String> {
    let devices = Instance::new(false).and_then(|i| i.devices()).expect("a Vulkan loader");
    let usable: Vec<_> = devices.iter().filter(|d| d.refusal.is_none()).map(|d| d.label()).collect();
    assert!(!usable.is_empty(), "no usable Vulkan device: run ./setup.sh");
    usable
}

fn commands(frame: &Value) -> &[Value] {
    frame["commands"].as_array().expect("commands")
}

/// How many commands of a kind a frame has, and the sum of their sizes.
fn sum(frame: &Value, kind: &str) -> (usize, u64) {
    let of: Vec<_> = commands(frame).iter().filter(|c| c["command"] == kind).collect();
    let size = |c: &Value| c["size"].as_array().expect("sizes").iter().map(|n| n.as_u64().expect("a number")).product();
    (of.len(), of.iter().map(|c| -> u64 { size(c) }).sum())
}

/// On every driver, with validation silent, and to the same bits without it; the sums are those of the table.
#[test]
fn a_workload_is_the_same_every_time() {
    for device in devices() {
        for method in ["field", "imai16"] {
            let run = Run::new();
            let args = ["workload", "128", "--method", method, "--device", &device, "-o"];
            let output = run.command(&[&args[..], &["a.json", "--validate", "--picture", "a.png"]].concat());
            let said = text(&output);
            assert!(output.status.success(), "{device}: {said}");
            let all = run.json("a.json");
            if method == "field" {
                assert!(run.command(&[&args[..], &["b.json"]].concat()).status.success(), "{device}");
                assert_eq!(all, run.json("b.json"), "{device}");
            }
            let frames = all["frames"].as_array().expect("frames");
            assert_eq!(frames.len(), 3);
            for (i, frame) in frames.iter().enumerate() {
                let sums =
                    [("dispatch", "dispatches", "groups"), ("draw", "draws", "vertices"), ("fill", "fills", "bytes")];
                let sums = sums.map(|(kind, all, unit)| {
                    let (count, amount) = sum(frame, kind);
                    assert!(count > 0 && amount > 0, "{device}, {method}: no {all}");
                    format!("{count} {all} ({amount} {unit})")
                });
                let picture = frame["picture"].as_str().expect("a checksum");
                let line = format!("frame {}: {}; picture {picture}", i + 1, sums.join(", "));
                assert!(said.lines().any(|l| l == line), "no \"{line}\" in {said}");
                assert!(frames[..i].iter().all(|f| f["picture"] != frame["picture"]), "{device}: drops do not fall");
            }
            let rows = said.lines().skip_while(|l| !l.starts_with("pass, first frame")).skip(1);
            assert_eq!(rows.take_while(|l| !l.is_empty()).count(), commands(&frames[0]).len(), "{said}");
            // There is more to see than the sky.
            let pixels = run.pixels("a.png");
            let (middle, sky) = (&pixels[3 * (64 + 128 * 90)..][..3], &pixels[3 * 64..][..3]);
            assert!(middle != sky, "{device}, {method}: nothing is drawn");
        }
    }
    let run = Run::new();
    run.refused(2, &["workload", "64"], &["64", "1080p"]);
    run.refused(1, &["workload", "128", "-o", "a.txt"], &["a.txt", ".json"]);
    run.refused(1, &["workload", "128", "--picture", "a.gif"], &["a.gif", ".png"]);
}

/// Calls of a name in a capture, with their arguments.
fn calls<'a>(capture: &'a [Value], name: &str) -> Vec<&'a Value> {
    capture.iter().filter(|c| c["vkFunc"]["name"] == name).map(|c| &c["vkFunc"]["args"]).collect()
}

/// gfxreconstruct's layer sees the calls themselves.
#[test]
fn a_workload_is_what_a_capture_holds() {
    if !Path::new("/usr/share/vulkan/explicit_layer.d/VkLayer_gfxreconstruct.json").exists() {
        return println!("no gfxreconstruct here: nothing is captured");
    }
    let device = &devices()[0];
    let run = Run::new();
    let mut program = run.prepared(&["workload", "128", "--method", "imai16", "--device", device, "-o", "w.json"]);
    program.env("VK_INSTANCE_LAYERS", "VK_LAYER_LUNARG_gfxreconstruct");
    let (file, text_file) = (run.path("w.gfxr"), run.path("w.txt"));
    program.env("GFXRECON_CAPTURE_FILE", &file).env("GFXRECON_CAPTURE_FILE_TIMESTAMP", "false");
    let output = program.output().expect("meniscus starts");
    assert!(output.status.success(), "{}", text(&output));
    let convert = Command::new("gfxrecon-convert").arg("--output").args([&text_file, &file]).output();
    assert!(text_file.exists(), "gfxrecon-convert: {convert:?}");
    let lines = fs::read_to_string(&text_file).expect("a line for each call");
    let capture: Vec<Value> = lines.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();

    let all = run.json("w.json");
    let told = || all["frames"].as_array().expect("frames").iter().flat_map(commands);
    for (kind, indirect, name) in [
        ("dispatch", false, "vkCmdDispatch"),
        ("dispatch", true, "vkCmdDispatchIndirect"),
        ("draw", false, "vkCmdDraw"),
        ("draw", true, "vkCmdDrawIndirect"),
        ("fill", false, "vkCmdFillBuffer"),
    ] {
        let of: Vec<_> = told().filter(|c| c["command"] == kind && c["indirect"] == indirect).collect();
        let captured = calls(&capture, name);
        assert!(!of.is_empty() && of.len() == captured.len(), "{name}: {} told, {} captured", of.len(), captured.len());
        for (told, args) in of.iter().zip(captured) {
            match name {
                "vkCmdDispatch" => {
                    let groups = ["groupCountX", "groupCountY", "groupCountZ"].map(|g| args[g].clone());
                    assert_eq!(told["size"], Value::from(groups.to_vec()), "{told}");
                }
                "vkCmdDraw" => assert_eq!(told["size"][0], args["vertexCount"], "{told}"),
                // Whole buffers are told by their sizes.
                "vkCmdFillBuffer" if args["size"] == u64::MAX => {
                    let buffer = &args["dstBuffer"];
                    let mut made = capture.iter().filter(|c| c["vkFunc"]["name"] == "vkCreateBuffer");
                    let made = made.rfind(|c| c["vkFunc"]["args"]["pBuffer"] == *buffer).expect("the buffer was made");
                    let [all, offset] = [&made["vkFunc"]["args"]["pCreateInfo"]["size"], &args["dstOffset"]];
                    let rest = all.as_u64().expect("bytes") - offset.as_u64().expect("bytes");
                    assert_eq!(told["size"][0], rest, "{told}");
                }
                "vkCmdFillBuffer" => assert_eq!(told["size"][0], args["size"], "{told}"),
                _ => {}
            }
        }
    }
    // Whatever is made has a name, but for what lives no longer than a submission or a pipeline's making.
    let handles = |name: &str, key: &str| -> Vec<Value> {
        calls(&capture, name)
            .iter()
            .flat_map(|args| match &args[key] {
                Value::Array(all) => all.clone(),
                one => vec![one.clone()],
            })
            .collect()
    };
    let named: Vec<_> = calls(&capture, "vkSetDebugUtilsObjectNameEXT")
        .iter()
        .map(|args| args["pNameInfo"]["objectHandle"].clone())
        .collect();
    for (name, key, least) in [
        ("vkCreateCommandPool", "pCommandPool", 1),
        ("vkCreateBuffer", "pBuffer", 10),
        ("vkCreateBufferView", "pView", 0),
        ("vkCreateImage", "pImage", 5),
        ("vkCreateImageView", "pView", 10),
        ("vkCreateSampler", "pSampler", 0),
        ("vkCreateDescriptorSetLayout", "pSetLayout", 10),
        ("vkCreatePipelineLayout", "pPipelineLayout", 10),
        ("vkCreateComputePipelines", "pPipelines", 5),
        ("vkCreateGraphicsPipelines", "pPipelines", 3),
        ("vkCreateDescriptorPool", "pDescriptorPool", 1),
        ("vkCreateQueryPool", "pQueryPool", 1),
    ] {
        let made = handles(name, key);
        let nameless = made.iter().filter(|handle| !named.contains(handle)).count();
        assert!(made.len() >= least && nameless == 0, "{name}: {} made, {nameless} without a name", made.len());
    }
    // One device with one queue and nothing that is not required.
    let [device] = calls(&capture, "vkCreateDevice")[..] else { panic!("devices") };
    let info = &device["pCreateInfo"];
    assert_eq!((&info["enabledExtensionCount"], &info["queueCreateInfoCount"]), (&0.into(), &1.into()), "{info}");
    let enabled = info["pEnabledFeatures"].as_object().expect("features");
    assert!(enabled.len() > 40 && enabled.values().all(|on| *on == 0), "{enabled:?}");
}
