//! Drivers: listed where there are some, and what is said where there are none.

use crate::{Run, listing, text};

#[test]
fn without_a_driver_it_says_so() {
    let run = Run::new();
    let library =
        r#"{"file_format_version": "1.0.0", "ICD": {"library_path": "/nowhere/lib.so", "api_version": "1.3.0"}}"#;
    let manifests = [
        run.file("garbage.json", "{broken"),
        run.file("no_library.json", library),
        run.path("missing.json").to_string_lossy().into_owned(),
    ];
    let before = listing(run.folder.path());
    for (variable, manifest) in
        ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"].iter().flat_map(|v| manifests.iter().map(move |m| (v, m)))
    {
        for command in [&["render", "-o", "out.png"][..], &["info"], &["bench", "-o", "out.json"]] {
            let mut program = run.prepared(command);
            for other in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES", "VK_ADD_DRIVER_FILES"] {
                program.env_remove(other);
            }
            let output = program.env(variable, manifest).output().expect("meniscus starts");
            let text = text(&output);
            assert_eq!(output.status.code(), Some(3), "{variable}={manifest} {command:?}: {text}");
            for word in ["no Vulkan driver could be loaded", variable, manifest, "mesa-vulkan-drivers"] {
                assert!(text.contains(word), "{variable}={manifest} {command:?}: no {word} in {text}");
            }
        }
    }
    assert_eq!(listing(run.folder.path()), before);
}

#[test]
fn info_lists_devices_and_formats() {
    let output = Run::new().command(&["info"]);
    let text = text(&output);
    assert!(output.status.success() && text.contains(".bgeo") && text.contains("usable: yes"), "{text}");
}
