//! Tests of tests: that what they look for is found when it is there.

/// Runs these tests of this program in a process of its own, one after the other, those that are ignored too: what it prints,
/// and whether it calls that a success. A test that is wrong on purpose is `#[ignore]`d, and another one sees it fail.
pub fn run_tests(names: &[&str]) -> (String, bool) {
    let mut program = std::process::Command::new(std::env::current_exe().expect("this test's own"));
    let output = program.args(names).args(["--exact", "--include-ignored", "--test-threads=1"]).output();
    let output = output.expect("it starts");
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    (said.into_owned(), output.status.success())
}
