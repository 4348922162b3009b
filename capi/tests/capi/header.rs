//! include/meniscus.h is what the sources say.

use crate::install::root;
use std::{collections::BTreeSet, fs};

fn made() -> String {
    let config = cbindgen::Config::from_file(root().join("capi/cbindgen.toml")).expect("capi/cbindgen.toml");
    let bindings = cbindgen::generate_with_config(root().join("capi"), config).expect("a header");
    let mut text = Vec::new();
    bindings.write(&mut text);
    String::from_utf8(text).expect("UTF-8")
}

#[test]
fn the_header_is_what_the_sources_say() {
    let (file, made) = (root().join("capi/include/meniscus.h"), made());
    if std::env::var_os("MENISCUS_BLESS").is_some() {
        fs::write(&file, &made).expect("writable");
    }
    let there = fs::read_to_string(&file).unwrap_or_default();
    let differ = there.lines().zip(made.lines()).position(|(a, b)| a != b);
    assert!(
        there == made,
        "capi/include/meniscus.h is not of these sources (line {:?}): MENISCUS_BLESS=1 cargo test -p meniscus-capi --test capi header",
        differ.map(|i| i + 1)
    );
}

/// Each function is a guard, says what its caller has to see to, and is in the header.
#[test]
fn every_function_is_guarded_and_documented() {
    let header = made();
    let mut found = BTreeSet::new();
    for entry in fs::read_dir(root().join("capi/src")).expect("capi/src") {
        let path = entry.expect("readable").path();
        let text = fs::read_to_string(&path).unwrap_or_default();
        for (at, _) in text.match_indices("#[unsafe(no_mangle)]") {
            let function = &text[at..];
            let end = function.find("\n}\n").expect("a function's end");
            let function = &function[..end];
            let name = function.split("fn ").nth(1).and_then(|f| f.split('(').next()).expect("a name");
            let declared = [' ', '*'].iter().any(|before| header.contains(&format!("{before}{name}(")));
            assert!(declared, "{name} is not in the header");
            let docs: Vec<_> = text[..at].lines().rev().take_while(|l| l.starts_with("///")).collect();
            assert!(!docs.is_empty(), "{name} is not documented");
            if function.contains("pub unsafe extern") {
                assert!(docs.contains(&"/// # Safety"), "{name} does not say what its caller has to see to");
                assert!(
                    function.contains("guard(|| ") || function.contains("with(renderer, "),
                    "{name} is not guarded"
                );
            }
            found.insert(name.to_owned());
        }
    }
    assert!(found.len() > 40, "only {found:?}");
}
