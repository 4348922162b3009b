//! Tests of a project that draws with meniscus, as they stand in its `tests/`. In its Cargo.toml:
//!
//! ```toml
//! [dev-dependencies]
//! meniscus = { version = "0.1", features = ["harness"] }
//! ```
//!
//! `docs/ci/lavapipe.yml` is a workflow that runs them without a GPU.

use meniscus::{
    Camera, Ellipsoid, Particles, Settings,
    ash::vk,
    glam::{Mat3, Vec3},
    harness::{Case, Mismatch, Reference, Tolerance, each_driver, run_tests},
    host::HostError,
};

const SIZE: [u32; 2] = [64, 48];

/// Balls of liquid in a row.
fn case() -> Case {
    let axes = Mat3::from_diagonal(Vec3::splat(0.3));
    let ball = |i| Ellipsoid { center: Vec3::new(0.5 * (i as f32 - 2.0), 0.0, 0.0), axes };
    let particles = Particles { radius: 0.3, ellipsoids: (0..5).map(ball).collect(), splash_count: 5 };
    let camera = Camera::look_at(Vec3::new(0.0, 0.5, 3.0), Vec3::ZERO, Vec3::Y, 0.8, 4.0 / 3.0, 0.01);
    Case { particles, camera, settings: Settings::default(), size: SIZE, eye_inside: false }
}

/// Twice the same picture, on every driver, and not that of another liquid.
#[test]
fn liquid_is_drawn_alike_every_time() {
    let tolerance = Tolerance { mean: 1e-4, near: 0.01, share: 0.0, far: 0.01 };
    each_driver(|driver| {
        let first = driver.shoot(&case());
        let reference = Reference::new(SIZE, &first.picture).expect("light");
        let found = reference.compare(&driver.shoot(&case()).picture, tolerance).expect("the same");
        println!("{}: {found}", driver.name);
        let mut other = case();
        other.settings.set("ior", "1.1").expect("a parameter");
        let refused = reference.compare(&driver.shoot(&other).picture, tolerance);
        assert!(matches!(refused, Err(Mismatch::TooFar(_))), "{}: {refused:?}", driver.name);
    });
}

/// Commands of your own, read back.
#[test]
fn a_buffer_is_filled() {
    each_driver(|driver| {
        let gpu = driver.gpu();
        let bytes = gpu.read_back(64, |cmd, buffer| {
            // SAFETY: `cmd` is recording, the buffer has TRANSFER_DST and 64 bytes.
            unsafe { gpu.device.cmd_fill_buffer(cmd, buffer, 0, vk::WHOLE_SIZE, 0x0101_0101) };
            Ok(())
        });
        assert_eq!(bytes.expect("read back"), [1; 64]);
    });
}

/// Wrong on purpose: fills beyond the end of the buffer.
#[test]
#[ignore = "a negative control"]
fn a_buffer_is_filled_beyond_its_end() {
    each_driver(|driver| {
        let gpu = driver.gpu();
        let filled = gpu.read_back(64, |cmd, buffer| {
            // SAFETY: none: validation is to say so. It is recorded, and fails before it is submitted.
            unsafe { gpu.device.cmd_fill_buffer(cmd, buffer, 128, 4, 0) };
            Err(HostError::Vulkan("left out", vk::Result::ERROR_UNKNOWN))
        });
        assert!(filled.is_err());
    });
}

/// Validation's silence above means something.
#[test]
fn a_wrong_command_fails_its_test() {
    let (said, success) = run_tests(&["a_buffer_is_filled_beyond_its_end"]);
    assert!(!success && said.contains("VUID-vkCmdFillBuffer-dstOffset"), "{said}");
}
