//! What build.rs makes of `glsl/include/shared.glsl`, and what it refuses.

#[path = "../../build/shared.rs"]
mod shared;

use shared::to_rust;

#[test]
fn named_scalars_lie_where_shaders_have_them() {
    let rust =
        to_rust("struct S {\n    vec2 a; // what a is\n    float b;\n    uint c;\n    vec3 d;\n    float e;\n};\n")
            .expect("fits");
    for line in [
        "/// what a is",
        "pub a: glam::Vec2,",
        "pub d: glam::Vec3,",
        "offset_of!(S, d) == 16",
        "offset_of!(S, e) == 28",
    ] {
        assert!(rust.contains(line), "no `{line}` in {rust}");
    }
    assert!(rust.contains("size_of::<S>() == 32") && !rust.contains("padding"), "{rust}");
}

#[test]
fn an_end_that_shaders_fill_up_is_filled_up() {
    let rust = to_rust("struct S {\n    vec4 a;\n    uint b;\n};\n").expect("fits");
    assert!(rust.contains("pub padding: [u32; 3]") && rust.contains("size_of::<S>() == 32"), "{rust}");
    let scalars = to_rust("struct S {\n    uint a;\n    uint b;\n};\n").expect("fits");
    assert!(!scalars.contains("padding") && scalars.contains("size_of::<S>() == 8"), "{scalars}");
}

#[test]
fn what_would_be_laid_out_in_two_ways_is_refused() {
    for (members, line, why) in [
        ("    float a;\n    vec4 b;\n", 3, "leave a gap"),
        ("    float a;\n    vec2 b;\n", 3, "leave a gap"),
        ("    vec3 a;\n    vec3 b;\n", 3, "leave a gap"),
        ("    mat3 a;\n", 2, "in two ways"),
        ("    bool a;\n", 2, "in two ways"),
        ("    float a[4];\n", 2, "does not understand"),
        ("    float a, b;\n", 2, "does not understand"),
    ] {
        let error = to_rust(&format!("struct S {{\n{members}}};\n")).expect_err(members);
        assert!(error.starts_with(&format!("{line}: error: ")) && error.contains(why), "{members}: {error}");
    }
    assert!(to_rust("layout(binding = 0) uniform B;\n").is_err());
}
