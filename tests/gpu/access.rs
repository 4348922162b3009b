//! Barriers: what the passes declare becomes what they need, and validation would say so if it did not.

use crate::support::{Choose, SKY, camera, each_driver, imai16, random_cloud};
use ash::vk::{self, AccessFlags2 as A, ImageLayout as L, PipelineStageFlags2 as S};
use glam::Vec3;
use meniscus::FrameInput;
use meniscus::host::{Gpu, HostError, Instance, Session};
use meniscus::inspect::{Access, State};

/// Every target that a pass reads: the pass, the target, the stage that wrote it, the stage that reads it. Of several
/// passes that read in the same stage only the first needs a barrier.
const READS: [(&str, &str, S, S); 15] = [
    ("cull", "body depth bounds", S::COMPUTE_SHADER, S::COMPUTE_SHADER),
    ("compact", "visible particles", S::COMPUTE_SHADER, S::COMPUTE_SHADER),
    ("splash front", "drawn particles", S::COMPUTE_SHADER, S::VERTEX_SHADER),
    ("splash front", "indirect draws", S::COMPUTE_SHADER, S::DRAW_INDIRECT),
    ("plane fit", "body depth (ray-cast)", S::COLOR_ATTACHMENT_OUTPUT, S::COMPUTE_SHADER),
    ("plane fit", "body normal (ray-cast)", S::COLOR_ATTACHMENT_OUTPUT, S::COMPUTE_SHADER),
    ("plane fit", "body depth (smoothed, odd)", S::COMPUTE_SHADER, S::COMPUTE_SHADER),
    ("plane fit", "body depth (smoothed, even)", S::COMPUTE_SHADER, S::COMPUTE_SHADER),
    ("normals", "body depth (smoothed, odd)", S::COMPUTE_SHADER, S::COMPUTE_SHADER),
    ("walk", "body depth (smoothed, odd)", S::COMPUTE_SHADER, S::FRAGMENT_SHADER),
    ("walk", "body normal (smoothed)", S::COMPUTE_SHADER, S::FRAGMENT_SHADER),
    ("walls", "splash depth", S::COLOR_ATTACHMENT_OUTPUT, S::COMPUTE_SHADER),
    ("walk", "splash depth", S::COMPUTE_SHADER, S::FRAGMENT_SHADER),
    ("walk", "walls", S::COMPUTE_SHADER, S::FRAGMENT_SHADER),
    ("walk", "splash normal", S::COLOR_ATTACHMENT_OUTPUT, S::FRAGMENT_SHADER),
];

#[test]
fn a_frame_has_a_barrier_before_every_read() {
    let size = [64, 48];
    each_driver(|driver| {
        let instance = Instance::new(true).expect("validation layer: run ./setup.sh");
        let gpu = Gpu::new(&instance, instance.pick(Some(&driver.name)).expect("device")).expect("device");
        let mut session = Session::new(&gpu, size, &SKY).expect("session");
        let particles = random_cloud(7, 0.05, Vec3::splat(-0.5), Vec3::splat(0.5), 40, 400);
        session.renderer.set_particles(&particles).expect("particles");
        let camera = camera(Vec3::new(0.3, 0.4, 2.0), Vec3::ZERO, size);
        // Three iterations: A is read both within the loop and after it.
        let settings = imai16().iterations(3);
        let input = FrameInput::new(0, &camera, &settings, vk::ImageView::null());
        let mut plans = Vec::new();
        for _ in 0..4 {
            session.frame(&input).expect("frame");
            plans.push(session.renderer.plan().to_vec());
        }
        let printed: Vec<String> = plans[1].iter().map(ToString::to_string).collect();
        for plan in &plans {
            for (pass, id, writer, reader) in READS {
                let found = plan.iter().enumerate().any(|(at, e)| {
                    let (src, dst) = (e.barrier.src, e.barrier.dst);
                    let stages = src.0.contains(writer) && dst.0.contains(reader) && dst.1.intersects(READ);
                    // What an earlier reader's barrier made available is not flushed again.
                    let earlier = plan[..at].iter().rfind(|f| f.resource == e.resource);
                    let flushed = src.1.intersects(WRITES)
                        || src.1.is_empty() && earlier.is_some_and(|f| f.barrier.src.1.intersects(WRITES));
                    e.pass == pass && e.resource == id && stages && flushed
                });
                let text = plan.iter().map(|e| format!("{e}\n")).collect::<String>();
                assert!(found, "{}: no barrier from {writer:?} before {pass} reads {}:\n{text}", driver.name, id);
            }
        }
        // Those who read the print see the same.
        let line =
            printed.iter().find(|l| l.starts_with("walk") && l.contains("body normal (smoothed)")).expect("a line");
        for part in ["COMPUTE_SHADER", "SHADER_WRITE", "GENERAL", "FRAGMENT_SHADER", "SHADER_READ_ONLY_OPTIMAL"] {
            assert!(line.contains(part), "{line}");
        }
        // From the second frame on every frame follows one like itself.
        assert!(plans[2] == plans[1] && plans[3] == plans[1], "{}: the plan changes", driver.name);
        // Contents are discarded each frame, execution order is not: what is written again waits for its last use.
        for e in &plans[1] {
            assert!(!e.barrier.src.0.is_empty(), "{}: nothing to wait for: {e}", driver.name);
        }
        session.end();
        drop(gpu);
        assert_eq!(instance.messages(), Vec::<String>::new(), "{}", driver.name);
    });
}

const WRITES: A = A::from_raw(A::SHADER_WRITE.as_raw() | A::COLOR_ATTACHMENT_WRITE.as_raw());
const READ: A = A::from_raw(A::SHADER_READ.as_raw() | A::INDIRECT_COMMAND_READ.as_raw());

/// Steps through accesses: the barrier before each as (stages, accesses, layout) before and after.
type Side = (S, A, L);
fn steps(state: &mut State, image: bool, accesses: &[Access]) -> Vec<Option<(Side, Side)>> {
    accesses.iter().map(|a| state.step(*a, image).map(|b| (b.src, b.dst))).collect()
}

#[test]
fn an_image_is_waited_for_and_moved() {
    use Access::*;
    let mut state = State::default();
    let read_only = L::SHADER_READ_ONLY_OPTIMAL;
    let compute_read = (S::COMPUTE_SHADER, A::SHADER_READ, read_only);
    let read_write = A::COLOR_ATTACHMENT_READ | A::COLOR_ATTACHMENT_WRITE;
    let color = (S::COLOR_ATTACHMENT_OUTPUT, read_write, L::COLOR_ATTACHMENT_OPTIMAL);
    let fragment_read = (S::FRAGMENT_SHADER, A::SHADER_READ, read_only);
    let found = steps(&mut state, true, &[ColorAttachment, ComputeRead, ComputeRead, FragmentRead, FragmentRead]);
    let expected = [
        // First use: out of the undefined layout.
        Some(((S::NONE, A::NONE, L::UNDEFINED), color)),
        // Read after write, with a layout change.
        Some(((color.0, A::COLOR_ATTACHMENT_WRITE, color.2), compute_read)),
        // A second read in the same stage needs nothing.
        None,
        // One in another stage follows the transition, which was a write.
        Some(((S::COMPUTE_SHADER, A::NONE, read_only), fragment_read)),
        None,
    ];
    assert_eq!(found, expected);

    // Write after read: both readers are waited for.
    let found = steps(&mut state, true, &[ColorAttachment, ColorAttachment]);
    let readers = S::COMPUTE_SHADER | S::FRAGMENT_SHADER;
    let expected = [
        Some(((readers, A::NONE, read_only), color)),
        // Write after write, without a layout change.
        Some(((color.0, A::COLOR_ATTACHMENT_WRITE, color.2), color)),
    ];
    assert_eq!(found, expected);

    // A new frame: the content may go, the order may not.
    steps(&mut state, true, &[FragmentRead]);
    state.discard();
    let expected = [Some(((S::FRAGMENT_SHADER, A::NONE, L::UNDEFINED), color))];
    assert_eq!(steps(&mut state, true, &[ColorAttachment]), expected);
}

#[test]
fn a_buffer_is_waited_for() {
    use Access::*;
    let mut state = State::default();
    let sides = |b: Option<(Side, Side)>| b.map(|(src, dst)| ((src.0, src.1), (dst.0, dst.1)));
    let found: Vec<_> = steps(
        &mut state,
        false,
        &[TransferWrite, ComputeReadWrite, ComputeReadWrite, VertexRead, IndirectRead, VertexRead, TransferWrite],
    )
    .into_iter()
    .map(sides)
    .collect();
    let copy = (S::ALL_TRANSFER, A::TRANSFER_WRITE);
    let compute = (S::COMPUTE_SHADER, A::SHADER_READ | A::SHADER_WRITE);
    let wrote = (S::COMPUTE_SHADER, A::SHADER_WRITE);
    let expected = [
        // Nothing came before, and a buffer has no layout to leave.
        None,
        Some((copy, compute)),
        Some((wrote, compute)),
        Some((wrote, (S::VERTEX_SHADER, A::SHADER_READ))),
        Some((wrote, (S::DRAW_INDIRECT, A::INDIRECT_COMMAND_READ))),
        None,
        Some(((S::COMPUTE_SHADER | S::VERTEX_SHADER | S::DRAW_INDIRECT, A::SHADER_WRITE), copy)),
    ];
    assert_eq!(found, expected);
    // Never written, only read.
    assert_eq!(steps(&mut State::default(), false, &[ComputeRead, VertexRead]), [None, None]);
}

/// Two fills of one buffer; with or without a barrier in between.
fn messages_of_two_fills(driver: &str, barrier: bool) -> Vec<String> {
    let instance = Instance::new(true).expect("validation layer: run ./setup.sh");
    let gpu = Gpu::new(&instance, instance.pick(Some(driver)).expect("device")).expect("device");
    let fill = |cmd, buffer, word| {
        // SAFETY: `cmd` is recording, the buffer has TRANSFER_DST and 256 bytes.
        unsafe { gpu.device.cmd_fill_buffer(cmd, buffer, 0, vk::WHOLE_SIZE, word) };
    };
    let bytes = gpu.read_back(256, |cmd, buffer| {
        fill(cmd, buffer, 0x0101_0101);
        if barrier {
            let wait = [vk::MemoryBarrier2::default()
                .src_stage_mask(S::ALL_TRANSFER)
                .src_access_mask(A::TRANSFER_WRITE)
                .dst_stage_mask(S::ALL_TRANSFER)
                .dst_access_mask(A::TRANSFER_WRITE)];
            let info = vk::DependencyInfo::default().memory_barriers(&wait);
            // SAFETY: `cmd` is recording.
            unsafe { gpu.device.cmd_pipeline_barrier2(cmd, &info) };
        }
        fill(cmd, buffer, 0x0202_0202);
        Ok::<_, HostError>(())
    });
    assert_eq!(bytes.expect("read back").len(), 256);
    drop(gpu);
    instance.messages()
}

/// The silence of every other test means something: on this machine, on each driver, a missing barrier is reported.
#[test]
fn validation_reports_a_missing_barrier() {
    each_driver(|driver| {
        let found = messages_of_two_fills(&driver.name, false);
        // Layers of different years word it "SYNC-HAZARD-WRITE-AFTER-WRITE" and "WRITE_AFTER_WRITE hazard".
        let hazard = found.iter().any(|m| m.replace('_', "-").contains("WRITE-AFTER-WRITE"));
        assert!(hazard, "{}: {found:?}", driver.name);
        assert_eq!(messages_of_two_fills(&driver.name, true), Vec::<String>::new(), "{}", driver.name);
    });
}
