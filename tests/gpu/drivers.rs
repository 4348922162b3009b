//! What the harness promises: a message of the validation layer, or something left undestroyed, fails what it belongs to.

use crate::support::each_driver;
use meniscus::harness::{self, run_tests};

/// Only for tests below, in a process of its own.
#[test]
#[ignore = "leaks on purpose"]
fn a_buffer_is_left() {
    each_driver(|driver| {
        let info = ash::vk::BufferCreateInfo::default().size(16).usage(ash::vk::BufferUsageFlags::TRANSFER_DST);
        // SAFETY: complete info on a live device. That the buffer outlives it is what this is about.
        unsafe { driver.gpu().device.create_buffer(&info, None) }.expect("buffer");
    });
}

/// The same.
#[test]
#[ignore = "leaves out a barrier on purpose"]
fn a_barrier_is_left_out() {
    each_driver(|driver| {
        let gpu = driver.gpu();
        let filled = gpu.read_back(256, |cmd, buffer| {
            for word in [1, 2] {
                // SAFETY: `cmd` is recording, the buffer has TRANSFER_DST and 256 bytes.
                unsafe { gpu.device.cmd_fill_buffer(cmd, buffer, 0, 256, word) };
            }
            Ok(())
        });
        assert_eq!(filled.expect("read back").len(), 256);
    });
}

const SOUND: &str = "smoke::a_random_cloud_renders";

/// The silence at the end of the run means something.
#[test]
fn what_is_left_fails_the_run() {
    let (said, success) = run_tests(&["drivers::a_buffer_is_left", SOUND]);
    assert!(said.contains("2 passed") && !success, "{said}");
    for label in harness::labels() {
        assert!(said.lines().any(|l| l.starts_with(&format!("{label}: "))), "{label} is not among them: {said}");
    }
    // Some layers name it in the same line, some in the next.
    assert!(said.lines().filter(|l| l.contains("VkBuffer")).count() >= harness::labels().len(), "{said}");
    let (said, success) = run_tests(&[SOUND]);
    assert!(said.contains("1 passed") && success, "{said}");
}

/// A message fails the test in which it came, and none that has the driver later.
#[test]
fn what_is_said_fails_its_own_test() {
    let (said, success) = run_tests(&["drivers::a_barrier_is_left_out", SOUND]);
    assert!(said.contains("1 passed; 1 failed") && !success, "{said}");
    assert!(
        said.contains("drivers::a_barrier_is_left_out --- FAILED") || said.contains("a_barrier_is_left_out ... FAILED"),
        "{said}"
    );
    assert!(said.replace('_', "-").contains("WRITE-AFTER-WRITE"), "{said}");
}
