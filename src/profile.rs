//! GPU time of each pass: one scope a pass, a pair of timestamps each, read without waiting.

use crate::{
    Error,
    device::Host,
    plan::{Home, Step},
};
use ash::vk;

/// GPU time of one pass in milliseconds.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PassTime {
    /// The pass's name, also its debug label.
    pub name: String,
    /// When it began, in milliseconds after the frame's first timestamp.
    pub begin_ms: f64,
    /// Milliseconds from the pass's first to its last command.
    pub ms: f64,
    /// Whether it works for the particles, whatever the view: prepares them.
    pub prepares: bool,
    /// What part of the frame it is: "particles", "visibility" (which of them can show), or the family whose member it
    /// belongs to.
    pub part: &'static str,
}

/// GPU times of one frame.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FrameTimes {
    /// Every pass, in order.
    pub passes: Vec<PassTime>,
    /// First to last timestamp of the frame.
    pub span_ms: f64,
    /// The first timestamp in nanoseconds of the device's clock, which may begin anew: it has the bits that the queue family says.
    pub begin_ns: f64,
}

pub(crate) struct Profiler {
    pool: vk::QueryPool,
    /// Scopes that there is room for.
    room: u32,
    names: Vec<(&'static str, Home, &'static str)>,
    period_ns: f64,
    mask: u64,
}

impl Profiler {
    /// Without room: a plan says how much it needs.
    pub fn new(host: &Host) -> Option<Profiler> {
        let limits = host.limits();
        let period_ns = f64::from(limits.timestamp_period?);
        Some(Profiler {
            pool: vk::QueryPool::null(),
            room: 0,
            names: Vec::new(),
            period_ns,
            mask: limits.timestamp_mask,
        })
    }

    /// Makes room for so many scopes; the slot's last frame has completed.
    pub fn fit(&mut self, host: &Host, scopes: u32) -> Result<(), Error> {
        if self.room >= scopes {
            return Ok(());
        }
        let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(2 * scopes);
        // SAFETY: complete info on a live device.
        let pool = unsafe { host.device.create_query_pool(&info, None) }.map_err(Error::vulkan("timestamps"))?;
        self.destroy(&host.device);
        (self.pool, self.room) = (pool, scopes);
        self.names.clear();
        Ok(())
    }

    pub fn begin_frame(&mut self, device: &ash::Device, cmd: vk::CommandBuffer) {
        self.names.clear();
        if self.room > 0 {
            // SAFETY: the slot's last frame has completed (contract), and `cmd` is recording outside rendering.
            unsafe { device.cmd_reset_query_pool(cmd, self.pool, 0, 2 * self.room) };
        }
    }

    /// What was recorded of this frame will never run: there is nothing to read.
    pub fn abandon_frame(&mut self) {
        self.names.clear();
    }

    pub fn begin(&mut self, device: &ash::Device, cmd: vk::CommandBuffer, step: &Step) {
        self.names.push((step.pass, step.home, step.part));
        self.stamp(device, cmd, 2 * (self.names.len() as u32 - 1));
    }

    pub fn end(&mut self, device: &ash::Device, cmd: vk::CommandBuffer) {
        self.stamp(device, cmd, 2 * (self.names.len() as u32 - 1) + 1);
    }

    fn stamp(&self, device: &ash::Device, cmd: vk::CommandBuffer, query: u32) {
        // SAFETY: `query` is inside the pool, which has room for every scope of the plan, reset in this frame, and written once.
        unsafe { device.cmd_write_timestamp2(cmd, vk::PipelineStageFlags2::ALL_COMMANDS, self.pool, query) };
    }

    /// The last frame's times, if it has completed.
    pub fn read(&self, device: &ash::Device) -> Option<FrameTimes> {
        let mut ticks = vec![0u64; 2 * self.names.len()];
        if ticks.is_empty() {
            return None;
        }
        // SAFETY: the queries were reset and written; without WAIT this returns NOT_READY until they are there.
        unsafe { device.get_query_pool_results(self.pool, 0, &mut ticks, vk::QueryResultFlags::TYPE_64) }.ok()?;
        let ms = |from: u64, to: u64| (to.wrapping_sub(from) & self.mask) as f64 * self.period_ns * 1e-6;
        let passes = self
            .names
            .iter()
            .zip(ticks.chunks(2))
            .map(|((name, home, part), t)| PassTime {
                name: (*name).to_owned(),
                begin_ms: ms(ticks[0], t[0]),
                ms: ms(t[0], t[1]),
                prepares: *home == Home::Particles,
                part,
            })
            .collect();
        let begin_ns = (ticks[0] & self.mask) as f64 * self.period_ns;
        Some(FrameTimes { passes, span_ms: ms(ticks[0], ticks[ticks.len() - 1]), begin_ns })
    }

    pub fn destroy(&mut self, device: &ash::Device) {
        // SAFETY: called when no frame is in flight.
        unsafe { device.destroy_query_pool(self.pool, None) };
    }
}
