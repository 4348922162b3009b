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
    names: Vec<Scope>,
    clock: Clock,
}

/// Of a scope: its pass, what that works for, and as what part of the frame.
type Scope = (&'static str, Home, &'static str);

/// The device's: ticks of so many nanoseconds, of which so many bits count.
struct Clock {
    period_ns: f64,
    mask: u64,
}

impl Clock {
    /// Milliseconds from one tick to a later one. What is above the bits that count may be anything, and those begin anew when
    /// they are used up.
    fn ms(&self, from: u64, to: u64) -> f64 {
        (to.wrapping_sub(from) & self.mask) as f64 * self.period_ns * 1e-6
    }

    /// Times of a frame, of a pair of ticks for each scope.
    fn frame(&self, scopes: &[Scope], ticks: &[u64]) -> FrameTimes {
        let (first, last) = (ticks[0], ticks[ticks.len() - 1]);
        let pass = |((name, home, part), t): (&Scope, &[u64])| PassTime {
            name: (*name).to_owned(),
            begin_ms: self.ms(first, t[0]),
            ms: self.ms(t[0], t[1]),
            prepares: *home == Home::Particles,
            part,
        };
        FrameTimes {
            passes: scopes.iter().zip(ticks.chunks(2)).map(pass).collect(),
            span_ms: self.ms(first, last),
            begin_ns: (first & self.mask) as f64 * self.period_ns,
        }
    }
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
            clock: Clock { period_ns, mask: limits.timestamp_mask },
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
        host.set_name(pool, "timestamps");
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
        Some(self.clock.frame(&self.names, &ticks))
    }

    pub fn destroy(&mut self, device: &ash::Device) {
        // SAFETY: called when no frame is in flight.
        unsafe { device.destroy_query_pool(self.pool, None) };
    }
}

#[cfg(test)]
mod tests {
    use super::{Clock, Home};

    /// Ticks of 36 bits, with anything above them, that begin anew within a pass, and others of 64.
    #[test]
    fn clocks_that_begin_anew_measure_the_same() {
        let scopes = [("sort", Home::Particles, "particles"), ("walk", Home::View, "optics")];
        let few = Clock { period_ns: 2.0, mask: (1 << 36) - 1 };
        let at = |tick: u64, above: u64| (tick & few.mask) | above << 36;
        let begin = (1 << 36) - 1_000_000;
        let wrapped = few.frame(
            &scopes,
            &[at(begin, 3), at(begin + 1_500_000, 0), at(begin + 2_000_000, 9), at(begin + 4_000_000, 1)],
        );
        assert_eq!(wrapped.passes.iter().map(|p| (p.begin_ms, p.ms)).collect::<Vec<_>>(), [(0.0, 3.0), (4.0, 4.0)]);
        assert_eq!((wrapped.span_ms, wrapped.begin_ns), (8.0, 2.0 * begin as f64));
        let whole = Clock { period_ns: 2.0, mask: u64::MAX };
        let ticks = [u64::MAX - 999_999, 500_000, 1_000_000, 3_000_000];
        assert_eq!(whole.frame(&scopes, &ticks).passes, wrapped.passes);
        assert_eq!(wrapped.passes.iter().map(|p| p.prepares).collect::<Vec<_>>(), [true, false]);
    }
}
