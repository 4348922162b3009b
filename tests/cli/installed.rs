//! What is installed beside the program: manual pages and what shells complete with.

use crate::{Run, listing, text};
use std::{fs, path::Path, process::Command};

/// Subcommands by their help, `help` left out.
fn subcommands(run: &Run) -> Vec<String> {
    let help = text(&run.command(&["--help"]));
    let listed = help.lines().skip_while(|l| *l != "Commands:").skip(1).take_while(|l| !l.is_empty());
    let names = listed.filter_map(|l| l.strip_prefix("  ")?.split(' ').next().filter(|n| !n.is_empty()));
    let names: Vec<_> = names.filter(|n| *n != "help").map(str::to_owned).collect();
    assert!(names.len() > 5, "{help}");
    names
}

/// Whether the program is there; what it would have checked is said to be unchecked.
fn there(program: &str, what: &str) -> bool {
    let found = Command::new("sh").args(["-c", &format!("command -v {program}")]).output().expect("a shell");
    if !found.status.success() {
        println!("no {program} here: {what} not checked by it");
    }
    found.status.success()
}

fn passes(program: &str, args: &[&str], file: &Path) -> String {
    let output = Command::new(program).args(args).arg(file).output().expect("it starts");
    assert!(output.status.success(), "{program} {args:?} {}: {}", file.display(), text(&output));
    text(&output)
}

/// Every subcommand has its page, and formatters find nothing wrong with any.
#[test]
fn manual_pages_say_what_help_says() {
    let run = Run::new();
    let output = run.command(&["man", "-o", "pages/man1"]);
    assert!(output.status.success(), "{}", text(&output));
    let mut expected: Vec<_> = subcommands(&run).iter().map(|name| format!("meniscus-{name}.1")).collect();
    expected.push("meniscus.1".into());
    expected.sort();
    let folder = run.path("pages/man1");
    assert_eq!(listing(&folder), expected);
    let page = |name: &str| fs::read_to_string(folder.join(name)).expect("a page");
    let words = [("meniscus.1", "no usable Vulkan device"), ("meniscus.1", r"meniscus\-render(1)")];
    let parameters = [r"\-\-window", r"Imai16 \[u00A7]4.3"].map(|word| ("meniscus-render.1", word));
    for (name, word) in words.into_iter().chain(parameters) {
        assert!(page(name).contains(word), "no {word} in {name}");
    }
    let (groff, mandoc) = (there("groff", "pages"), there("mandoc", "pages"));
    for name in &expected {
        assert!(page(name).is_ascii(), "{name}");
        let file = folder.join(name);
        if groff {
            assert_eq!(passes("groff", &["-man", "-Tutf8", "-ww", "-z"], &file), "", "{name}");
        }
        if mandoc {
            passes("mandoc", &["-T", "lint", "-W", "error"], &file);
        }
    }
    let taken = run.file("taken", "");
    run.refused(1, &["man", "-o", &taken], &["taken"]);
    run.refused(2, &["man"], &["--output"]);
}

/// Shells read their scripts, and bash completes options, their values and subcommands by it.
#[test]
fn shells_complete_by_their_scripts() {
    let run = Run::new();
    for shell in ["bash", "zsh", "fish"] {
        let output = run.command(&["completions", shell]);
        assert!(output.status.success() && output.stderr.is_empty(), "{}", text(&output));
        let script = run.file(&format!("meniscus.{shell}"), &output.stdout);
        assert!(text(&output).contains("internal-reflections"), "{shell} knows no parameters");
        if there(shell, "its script") {
            passes(shell, &["-n"], Path::new(&script));
        }
    }
    run.refused(2, &["completions", "ksh"], &["ksh", "bash"]);
    if !there("bash", "completion") {
        return;
    }
    let complete = |words: &[&str]| {
        let [.., before, word] = words else { panic!("the program and a word") };
        let line = format!(
            "source meniscus.bash && COMP_WORDS=({words}) COMP_CWORD={last} && _meniscus meniscus '{word}' '{before}' && \
             printf '%s\\n' \"${{COMPREPLY[@]}}\"",
            words = words.iter().map(|w| format!("'{w}' ")).collect::<String>(),
            last = words.len() - 1
        );
        let mut bash = Command::new("bash");
        bash.args(["--norc", "-c", &line]).current_dir(run.folder.path());
        let output = bash.output().expect("bash starts");
        assert!(output.status.success(), "{line}: {}", text(&output));
        text(&output).lines().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(complete(&["meniscus", "ben"]), ["bench"]);
    let mut offered = complete(&["meniscus", ""]);
    offered.retain(|word| !word.starts_with('-') && word != "help");
    assert_eq!(offered, subcommands(&run));
    assert_eq!(complete(&["meniscus", "render", "--internal"]), ["--internal-reflections"]);
    assert_eq!(complete(&["meniscus", "render", "--method", "imai1"]), ["imai16", "imai14"]);
}
