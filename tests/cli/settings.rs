//! Parameters are described once, in the library: the command line and what it writes follow.

use crate::{Run, block, text};
use meniscus::{Method, Settings, parameters::Part, prepare};
use serde_json::{Value, json};

#[test]
fn help_lists_every_parameter_as_the_library_describes_it() {
    for command in ["render", "bench"] {
        let said = text(&Run::new().command(&[command, "--help"]));
        let preparation = Part::group("preparation", Box::<prepare::Options>::default());
        for part in Settings::parts().into_iter().chain([preparation]) {
            for (member, parameters) in &part.members {
                if !member.is_empty() {
                    assert!(said.contains(&format!("--{} <NAME>", part.name)), "{command}: no --{}", part.name);
                    assert!(said.contains(parameters.about()), "{command}: nothing about {member}");
                }
                for p in parameters.parameters() {
                    let flag = format!("--{} <", p.name.replace('_', "-"));
                    assert!(said.contains(&flag) && said.contains(p.doc), "{command}: no {flag}");
                    let default = match *member {
                        "" => format!("[default: {}]", p.default),
                        member => format!("[{member}: {}]", p.default),
                    };
                    assert!(p.name == "absorption" || said.contains(&default), "{command} {flag}: no {default}");
                    assert!(p.choices.iter().all(|c| said.contains(c)), "{command} {flag}: {:?}", p.choices);
                }
            }
        }
    }
}

/// What statistics and dumps say of settings is what settings have, and lengths in world units beside it.
#[test]
fn every_parameter_is_recorded() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    run.render(&[&block, "--stats", "s.json", "--dump", "d", "--radius", "0.05", "--sigma", "4", "--ior", "1.4"]);
    let mut settings = Settings::from(Method::preset("imai16").expect("a preset"));
    settings.set("sigma", "4").expect("set");
    settings.set("ior", "1.4").expect("set");
    for frame in [&run.json("s.json")["frame"], &run.json("d/frame.json")] {
        let mut names: Vec<_> = settings.parameters().iter().map(|p| p.name).collect();
        names.extend(settings.method.members().map(|m| m.0));
        names.sort_unstable();
        let mut recorded: Vec<_> = frame["settings"].as_object().expect("an object").keys().collect();
        recorded.sort_unstable();
        assert_eq!(recorded, names);
        for p in settings.parameters().iter().filter(|p| p.name != "absorption") {
            let value = &frame["settings"][p.name];
            let shown = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            assert!(shown == p.value || shown.parse::<f32>() == p.value.parse::<f32>(), "{}: {shown}", p.name);
            assert_eq!(frame["units"][p.name].as_str().unwrap_or(""), p.unit, "{}", p.name);
        }
        // What recomputing a dump takes.
        assert!((frame["sigma_world"].as_f64().expect("a length") - 0.2).abs() < 1e-6);
        assert!((frame["plane_fit_guards"]["update"].as_f64().expect("a length") - 0.04).abs() < 1e-6);
        assert_eq!(frame["sigma"], Value::Null, "a length in radii among lengths in world units");
        let plain = ["window", "iterations", "refractions", "internal_reflections"].map(|n| frame[n].as_u64());
        assert_eq!(plain, [Some(9), Some(2), Some(4), Some(4)]);
        assert_eq!((&frame["fresnel"], &frame["weighting"]), (&json!("schlick"), &json!("view-dependent")));
        assert!(frame["ior"].as_f64() == Some(1.4) && frame["absorption"][2].as_f64() > Some(0.0));
    }
}

/// Defaults, then the scene file, then the method, then members, then parameters.
#[test]
fn what_is_said_later_counts() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    run.file(
        "all.toml",
        concat!(
            "radius = 0.05\n[settings.method.smooth]\nname = \"plane-fit\"\nwindow = 7\niterations = 3\n",
            "[settings.method.optics]\nname = \"two\"\ninternal_reflections = 1\n[settings.liquid]\nior = 1.5\n",
        ),
    );
    let settings = |more: &[&str]| {
        run.render(&[&[&block, "--scene", "all.toml", "--stats", "s.json"], more].concat());
        let all = &run.json("s.json")["frame"]["settings"];
        let numbers = ["window", "iterations", "internal_reflections"].map(|n| all[n].as_u64());
        (numbers, all["optics"].as_str().expect("a name").to_owned(), all["ior"].as_f64())
    };
    let expected = |window, iterations, reflections, optics: &str| {
        ([window, iterations, reflections], optics.to_owned(), Some(1.5))
    };
    assert_eq!(settings(&[]), expected(Some(7), Some(3), Some(1), "two"));
    assert_eq!(settings(&["--iterations", "1"]), expected(Some(7), Some(1), Some(1), "two"));
    assert_eq!(settings(&["--method", "imai16"]), expected(Some(9), Some(2), Some(4), "four"));
    assert_eq!(settings(&["--window", "5", "--method", "imai16"]), expected(Some(5), Some(2), Some(4), "four"));
    assert_eq!(settings(&["--optics", "two"]), expected(Some(7), Some(3), Some(1), "two"), "it is there already");
    assert_eq!(settings(&["--optics", "four"]), expected(Some(7), Some(3), Some(4), "four"));
    assert_eq!(settings(&["--optics", "one", "--smooth", "none"]), expected(None, None, None, "one"));
    let said = ["--optics", "one", "--method", "imai16", "--ior", "1.5"];
    assert_eq!(settings(&said), expected(Some(9), Some(2), None, "one"));
}
