//! Pipeline statistics of each pass: what the device counted while it ran. Counting may cost time, so frames that are timed do
//! without; see [`crate::inspect::Inspection::statistics`].

use crate::{Error, device::Host};
use ash::vk::{self, QueryPipelineStatisticFlags as Counts};

/// What is counted, in the order of [`PassStatistics::counts`].
pub const COUNTED: [&str; 6] = [
    "vertices",
    "vertex invocations",
    "primitives before clipping",
    "primitives after clipping",
    "fragment invocations",
    "compute invocations",
];

/// The same, in the order of their bits, which is that of results.
const FLAGS: [Counts; 6] = [
    Counts::INPUT_ASSEMBLY_VERTICES,
    Counts::VERTEX_SHADER_INVOCATIONS,
    Counts::CLIPPING_INVOCATIONS,
    Counts::CLIPPING_PRIMITIVES,
    Counts::FRAGMENT_SHADER_INVOCATIONS,
    Counts::COMPUTE_SHADER_INVOCATIONS,
];

/// What the device counted of one pass.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct PassStatistics {
    /// The pass's name, also its debug label.
    pub name: &'static str,
    /// By [`COUNTED`].
    pub counts: [u64; 6],
}

/// A query for each scope of a slot's frame.
pub(crate) struct Statistics {
    pool: vk::QueryPool,
    names: Vec<&'static str>,
}

impl Statistics {
    /// With room for so many scopes.
    pub fn new(host: &Host, scopes: u32) -> Result<Statistics, Error> {
        let flags = FLAGS.into_iter().fold(Counts::empty(), |all, flag| all | flag);
        let kind = vk::QueryType::PIPELINE_STATISTICS;
        let info = vk::QueryPoolCreateInfo::default().query_type(kind).query_count(scopes).pipeline_statistics(flags);
        // SAFETY: complete info on a live device, which has the feature (contract of `Inspection::statistics`).
        let pool =
            unsafe { host.device.create_query_pool(&info, None) }.map_err(Error::vulkan("pipeline statistics"))?;
        host.set_name(pool, "pipeline statistics");
        Ok(Statistics { pool, names: Vec::new() })
    }

    pub fn begin_frame(&self, device: &ash::Device, cmd: vk::CommandBuffer, scopes: u32) {
        // SAFETY: the pool was made for this frame, with so many queries; `cmd` is recording outside rendering.
        unsafe { device.cmd_reset_query_pool(cmd, self.pool, 0, scopes) };
    }

    /// What was recorded of this frame will never run: there is nothing to read.
    pub fn abandon_frame(&mut self) {
        self.names.clear();
    }

    pub fn begin(&mut self, device: &ash::Device, cmd: vk::CommandBuffer, name: &'static str) {
        let query = self.names.len() as u32;
        self.names.push(name);
        // SAFETY: the query was reset in this frame, and no other is active; `cmd` is recording outside rendering.
        unsafe { device.cmd_begin_query(cmd, self.pool, query, vk::QueryControlFlags::empty()) };
    }

    pub fn end(&self, device: &ash::Device, cmd: vk::CommandBuffer) {
        // SAFETY: ends the query begun last, outside rendering too.
        unsafe { device.cmd_end_query(cmd, self.pool, self.names.len() as u32 - 1) };
    }

    /// What was counted, if the frame has completed.
    pub fn read(&self, device: &ash::Device) -> Option<Vec<PassStatistics>> {
        let mut counts = vec![[0u64; FLAGS.len()]; self.names.len()];
        if counts.is_empty() {
            return None;
        }
        // SAFETY: the queries were reset and ended; without WAIT this returns NOT_READY until they are there.
        unsafe { device.get_query_pool_results(self.pool, 0, &mut counts, vk::QueryResultFlags::TYPE_64) }.ok()?;
        Some(self.names.iter().zip(counts).map(|(name, counts)| PassStatistics { name, counts }).collect())
    }

    pub fn destroy(&mut self, device: &ash::Device) {
        // SAFETY: called when no frame that uses it is in flight.
        unsafe { device.destroy_query_pool(self.pool, None) };
    }
}
