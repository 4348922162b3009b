//! What is refused, and how that is said.

use crate::{Run, block};

#[test]
fn bad_files_are_refused() {
    let run = Run::new();
    let empty = run.file("empty.vtk", "");
    let text = run.file("text.vtk", "this is no particle file\n");
    let torn = run.file("torn.csv", "x,y,z\n1,2\n");
    let nan = run.file("nan.csv", "x,y,z\n0,0,0\nnan,1,1\n0.1,0,0\n");
    let words = run.file("words.csv", "x,y,z\na,b,c\n");
    let env = run.file("env.hdr", "#?RADIANCE\n");
    let out = ["render", "-o", "out.png", "--size", "64x48"];
    let with = |extra: &[&str]| -> Vec<String> { out.iter().chain(extra).map(|s| (*s).to_owned()).collect() };
    let check = |extra: &[&str], words: &[&str]| {
        let all = with(extra);
        run.refused(1, &all.iter().map(String::as_str).collect::<Vec<_>>(), words);
    };
    check(&["missing.vtk"], &["missing.vtk", "no such file"]);
    check(&[&empty], &["empty.vtk"]);
    check(&[&text], &["text.vtk"]);
    check(&[&torn], &["torn.csv", "line 2"]);
    check(&[&words], &["words.csv", "line 2"]);
    check(&[&nan], &["nan.csv", "--drop-invalid"]);
    check(&["particles.xyzzy"], &["xyzzy"]);
    check(&[run.folder.path().to_str().unwrap()], &["directory"]);
    check(&["--env", &env], &["env.hdr"]);
    check(&["--env", "no.exr"], &["no.exr"]);
    run.render(&[&nan, "--drop-invalid", "--radius", "0.05"]);
}

#[test]
fn bad_parameters_are_refused() {
    let run = Run::new();
    let block = run.file("block.csv", block(0.0));
    let refuse = |code: i32, extra: &[&str], words: &[&str]| {
        let mut all = vec!["render", block.as_str(), "-o", "out.png"];
        all.extend(extra);
        run.refused(code, &all, words);
    };
    refuse(1, &["--radius", "0"], &["radius"]);
    refuse(1, &["--radius", "-1"], &["radius"]);
    refuse(1, &["--radius", "nan"], &["radius"]);
    refuse(1, &["--size", "0x48"], &["size", "1 to"]);
    refuse(1, &["--size", "64x999999"], &["size", "1 to"]);
    refuse(2, &["--size", "64"], &["WIDTHxHEIGHT"]);
    refuse(2, &["--eye", "1,2"], &["three finite numbers"]);
    refuse(2, &["--supersample", "4"], &["supersample"]);
    refuse(2, &["--refractions", "2"], &["refractions"]);
    refuse(2, &["--optics", "three"], &["optics", "four", "one"]);
    refuse(2, &["--method", "imai"], &["method", "imai16"]);
    refuse(2, &["--iterations", "-1"], &["iterations", "0 to 20"]);
    refuse(2, &["--absorption", "1,2"], &["absorption", "three finite"]);
    refuse(2, &["--weighting", "none"], &["weighting", "euclidean"]);
    refuse(2, &["--occlusion-culling", "no"], &["occlusion-culling", "false"]);
    refuse(1, &["--max-ratio", "0.5"], &["max_ratio", "1 to 1000"]);
    refuse(1, &["--support", "1e-9"], &["support", "2 to 64 radii"]);
    refuse(1, &["--splash-threshold", "nan"], &["splash_threshold", "a number"]);
    refuse(2, &["--min-neighbours", "-3"], &["min-neighbours", "0 to"]);
    refuse(2, &["--search", "nowhere"], &["search", "runs", "relation"]);
    refuse(1, &["--window", "8"], &["window", "odd"]);
    refuse(1, &["--window", "27"], &["window", "25"]);
    refuse(1, &["--window", "11", "--supersample", "3"], &["window is 11", "--supersample 3", "9 at most"]);
    refuse(
        1,
        &["--smooth", "none", "--window", "7"],
        &["window is 7", "smooth none", "leave --window out", "--smooth plane-fit"],
    );
    refuse(1, &["--optics", "one", "--internal-reflections", "2"], &["--optics four or --optics two"]);
    let traced = ["surfaces that the view does not show", "trace_reflections", "split", "use field"];
    refuse(1, &["--method", "imai16", "--trace-reflections", "2"], &traced);
    refuse(1, &["--trace-reflections", "17"], &["trace_reflections", "0 to 16"]);
    refuse(1, &["--env-rotate", "nan"], &["environment rotation"]);
    refuse(1, &["--sigma", "0"], &["sigma"]);
    refuse(1, &["--ior", "1"], &["ior", "above 1"]);
    refuse(1, &["--absorption", "-1,0,0"], &["absorption"]);
    refuse(1, &["--fov-y", "180"], &["fov-y"]);
    refuse(1, &["--up", "0,0,0"], &["up"]);
    refuse(1, &["--eye", "0,0,0", "--target", "0,0,0"], &["eye and target"]);
    refuse(3, &["--device", "no such device"], &["no such device", "meniscus info"]);
    run.refused(1, &["render", "-o", "out.gif"], &["out.gif", ".png"]);
    run.refused(1, &["render", "-o", "nowhere/out.png", "--size", "64x48"], &["nowhere/out.png"]);
    let long = format!("{}.png", "x".repeat(300));
    run.refused(1, &["render", "-o", &long, "--size", "64x48"], &["xxx.png", "cannot be written", "shorter"]);
    run.refused(2, &["render"], &["--output"]);
}
