//! Passes as GPU zones of the Tracy profiler: what [`Renderer::times`] says of frames that have completed, sent on.
//!
//! Zones appear on a track of their own, each frame one zone with its passes inside, in which the moments are the device's. Tracy's client
//! gathers from when it is started, whether a profiler listens or not: engines that want otherwise depend on `tracy-client`
//! themselves and choose its features (`ondemand`, `only-localhost`).
//!
//! [`Renderer::times`]: crate::Renderer::times

use crate::profile::FrameTimes;
use tracy_client::{Client, GpuContext, GpuContextType};

/// The process has as many tracks as Tracy knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "Tracy has no room for another GPU track: 255 were made in this process. Keep one, and send all frames of a queue to it"
)]
pub struct TooManyTracks;

/// A track of GPU zones, for the frames of one queue.
pub struct Zones {
    name: String,
    /// Made with the first frame, whose end is then the latest moment known.
    context: Option<GpuContext>,
    moments: Moments,
    /// Number of the next moment.
    id: u16,
}

/// Moments of frames in nanoseconds that never go back.
#[derive(Default)]
struct Moments {
    /// What is added to the device's clock, which may have begun anew.
    later: i64,
    /// The latest so far.
    latest: i64,
}

impl Moments {
    /// Where a frame begins and ends.
    fn frame(&mut self, times: &FrameTimes) -> [i64; 2] {
        let begin = times.begin_ns.round() as i64;
        if begin + self.later < self.latest {
            self.later = self.latest - begin;
        }
        let begin = begin + self.later;
        self.latest = begin + (1e6 * times.span_ms).round() as i64;
        [begin, self.latest]
    }
}

impl Zones {
    /// A track of this name. Starts Tracy's client where the host has not.
    pub fn new(name: impl Into<String>) -> Zones {
        Client::start();
        Zones { name: name.into(), context: None, moments: Moments::default(), id: 0 }
    }

    /// Sends the passes of a completed frame, each frame once and in the order in which they ran.
    pub fn send(&mut self, times: &FrameTimes) -> Result<(), TooManyTracks> {
        let [begin, end] = self.moments.frame(times);
        let context = match &self.context {
            Some(context) => context,
            None => {
                let made = Client::start().new_gpu_context(Some(&self.name), GpuContextType::Vulkan, end, 1.0);
                self.context.insert(made.map_err(|_| TooManyTracks)?)
            }
        };
        let id = &mut self.id;
        let mut moment = |to: &dyn Fn(u16), ns: i64| {
            to(*id);
            context.upload_gpu_timestamp(*id, ns);
            *id = id.wrapping_add(1);
        };
        let zone = |name: &str, part: &str, id| context.begin_span_alloc(name, part, "src/frame.rs", 1, id);
        let close = |id| context.end_span(id);
        let after = |ms: f64| (begin + (1e6 * ms).round() as i64).min(end);
        moment(&|id| zone("meniscus", "frame", id), begin);
        for pass in &times.passes {
            moment(&|id| zone(&pass.name, pass.part, id), after(pass.begin_ms));
            moment(&close, after(pass.begin_ms + pass.ms));
        }
        moment(&close, end);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::Moments;
    use crate::profile::FrameTimes;

    /// A clock that begins anew does not take zones back in time.
    #[test]
    fn moments_never_go_back() {
        let frame = |begin_ns, span_ms| FrameTimes { passes: Vec::new(), span_ms, begin_ns };
        let mut moments = Moments::default();
        assert_eq!(moments.frame(&frame(5e6, 2.0)), [5_000_000, 7_000_000]);
        assert_eq!(moments.frame(&frame(8e6, 1.0)), [8_000_000, 9_000_000]);
        // Begun anew: it goes on where the last one ended, and from then on at the new clock's pace.
        assert_eq!(moments.frame(&frame(1e6, 1.0)), [9_000_000, 10_000_000]);
        assert_eq!(moments.frame(&frame(4e6, 1.0)), [12_000_000, 13_000_000]);
    }
}
