//! What profilers and capturing tools like a host to say: where a frame ends, and what time it is on the device's clock.

use super::{Gpu, HostError, Instance, gpu::extensions, vulkan};
use ash::vk;
use std::{
    cell::Cell,
    ffi::{CStr, c_char},
    time::Instant,
};

/// When a frame's commands were recorded, submitted and found done, on the host's clock.
#[derive(Clone, Copy, Debug)]
pub struct Stages {
    /// Recording began.
    pub begin: Instant,
    /// Recording ended.
    pub recorded: Instant,
    /// The queue had them.
    pub submitted: Instant,
    /// The fence was signalled, and the host knew.
    pub done: Instant,
}

/// One moment on the device's clock and on the host's.
#[derive(Clone, Copy, Debug)]
pub struct Calibration {
    /// As [`crate::profile::FrameTimes::begin_ns`] counts.
    pub device_ns: f64,
    /// After so many nanoseconds that clock begins anew.
    pub period_ns: f64,
    /// The same moment here, give or take half of what asking took.
    pub host: Instant,
}

impl Calibration {
    /// Milliseconds from a moment of the host's to an earlier time of the device's; the device's clock may have begun anew once.
    pub fn since(&self, host: Instant, device_ns: f64) -> f64 {
        let ago = (self.device_ns - device_ns).rem_euclid(self.period_ns);
        let now = match self.host.checked_duration_since(host) {
            Some(later) => later.as_secs_f64(),
            None => -host.duration_since(self.host).as_secs_f64(),
        };
        1e3 * now - 1e-6 * ago
    }
}

enum Asked {
    Khr(ash::khr::calibrated_timestamps::Device),
    Ext(ash::ext::calibrated_timestamps::Device),
}

/// What of it a device offers and has enabled.
#[derive(Default)]
pub(super) struct Tools {
    clock: Option<Clock>,
    boundary: bool,
    frame: Cell<u64>,
    stages: Cell<Option<Stages>>,
}

struct Clock {
    asked: Asked,
    tick_ns: f64,
    mask: u64,
}

impl Tools {
    /// What is chained to the last submission of a frame.
    pub fn end_of_frame(&self) -> Option<vk::FrameBoundaryEXT<'static>> {
        let id = self.frame.replace(self.frame.get() + 1);
        let boundary = vk::FrameBoundaryEXT::default().flags(vk::FrameBoundaryFlagsEXT::FRAME_END).frame_id(id);
        self.boundary.then_some(boundary)
    }

    pub fn note(&self, stages: Stages) {
        self.stages.set(Some(stages));
    }
}

impl<'a> Gpu<'a> {
    /// A device that also says what tools like to know, where it offers that: where frames end (`VK_EXT_frame_boundary`), and
    /// its time on the host's clock ([`Gpu::calibrate`]).
    pub fn profiled(instance: &'a Instance, info: super::DeviceInfo) -> Result<Gpu<'a>, HostError> {
        let has = extensions(instance, &info)?;
        let clocks = [ash::khr::calibrated_timestamps::NAME, ash::ext::calibrated_timestamps::NAME];
        let clock = clocks.into_iter().find(|name| info.timestamps && has(name));
        let boundary = ash::ext::frame_boundary::NAME;
        let mut feature = vk::PhysicalDeviceFrameBoundaryFeaturesEXT::default();
        if has(boundary) {
            let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut feature);
            // SAFETY: the physical device is this instance's; the chain lives on this stack frame.
            unsafe { instance.handle.get_physical_device_features2(info.handle, &mut all) };
        }
        let marks = feature.frame_boundary == vk::TRUE;
        let names: Vec<*const c_char> = clock.into_iter().chain(marks.then_some(boundary)).map(CStr::as_ptr).collect();
        let mut create = vk::DeviceCreateInfo::default();
        let mut enabled = vk::PhysicalDeviceFrameBoundaryFeaturesEXT::default().frame_boundary(true);
        if marks {
            create = create.push_next(&mut enabled);
        }
        let mut gpu = Gpu::with(instance, info, &names, create, false)?;
        gpu.tools.boundary = marks;
        let limits = gpu.host(1).limits();
        gpu.tools.clock = clock.zip(limits.timestamp_period).map(|(name, tick_ns)| Clock {
            asked: if name == clocks[0] {
                Asked::Khr(ash::khr::calibrated_timestamps::Device::new(&instance.handle, &gpu.device))
            } else {
                Asked::Ext(ash::ext::calibrated_timestamps::Device::new(&instance.handle, &gpu.device))
            },
            tick_ns: f64::from(tick_ns),
            mask: limits.timestamp_mask,
        });
        Ok(gpu)
    }

    /// The device's time now, and the host's; `None` unless the device was made [`profiled`](Gpu::profiled) and offers it.
    pub fn calibrate(&self) -> Result<Option<Calibration>, HostError> {
        let Some(clock) = &self.tools.clock else { return Ok(None) };
        let info = [vk::CalibratedTimestampInfoKHR::default().time_domain(vk::TimeDomainKHR::DEVICE)];
        let before = Instant::now();
        // SAFETY: the extension is enabled; every device that has it has its own time domain.
        let read = unsafe {
            match &clock.asked {
                Asked::Khr(clock) => clock.get_calibrated_timestamps(&info),
                Asked::Ext(clock) => clock.get_calibrated_timestamps(&info),
            }
        };
        let asked = before.elapsed();
        let (ticks, _) = read.map_err(vulkan("calibrated timestamps"))?;
        Ok(Some(Calibration {
            device_ns: (ticks[0] & clock.mask) as f64 * clock.tick_ns,
            period_ns: (clock.mask as f64 + 1.0) * clock.tick_ns,
            host: before + asked / 2,
        }))
    }

    /// When the last frame ([`Gpu::run_frame`]) was recorded, submitted and done.
    pub fn stages(&self) -> Option<Stages> {
        self.tools.stages.get()
    }

    /// Whether ends of frames are marked for capturing tools.
    pub fn marks_frames(&self) -> bool {
        self.tools.boundary
    }
}

#[cfg(test)]
mod tests {
    use super::Calibration;
    use std::time::{Duration, Instant};

    /// Also where the device's clock began anew in between.
    #[test]
    fn times_of_the_device_are_moments_of_the_host() {
        let begin = Instant::now();
        let at = |device_ns| Calibration { device_ns, period_ns: 1e9, host: begin + Duration::from_millis(50) };
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a}, not {b}");
        near(at(700e6).since(begin, 680e6), 30.0);
        near(at(10e6).since(begin, 990e6), 30.0);
        near(at(700e6).since(begin + Duration::from_millis(60), 695e6), -15.0);
    }
}
