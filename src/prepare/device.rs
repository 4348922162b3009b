//! Preparation on the device: positions in a buffer of the host's, and the constants that its passes take.

use super::{
    Options, PrepareError, Search,
    density::rest_density,
    ellipsoids::{flat_offset, lattice_variance},
    options::Scale,
};
use crate::{Error, device::bound, shader::Prepare, space};
use ash::vk;

/// Positions in device memory, to be prepared within the frame that draws them: neighbours, classes and ellipsoids as
/// [`super::prepare`] makes them, but on the GPU, and with no word about them to the host.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct DevicePositions {
    /// The host's buffer, with usage `STORAGE_BUFFER`: three 32-bit floats a particle, in world units. A position that is
    /// not finite is left out.
    pub buffer: vk::Buffer,
    /// Where the first one begins, in bytes; a multiple of 4.
    pub offset: u64,
    /// Bytes from one to the next; a multiple of 4, at least 12.
    pub stride: u64,
    /// How many there are; with [`DevicePositions::device_count`] how many there may be.
    pub count: u32,
    /// How many there are, where only the device knows: a simulation that emits, drains or streams.
    pub device_count: Option<DeviceCount>,
    /// Particle radius in world units.
    pub radius: f32,
    /// What can be chosen.
    pub options: Options,
    /// Hysteresis against popping: a particle keeps the class that the last frame gave it while its density lies between
    /// [`Options::splash_threshold`] and this share of a filled body's; lower than that it changes nothing. Ellipsoids in
    /// place grow out of the splash's ball from this share on, so that no shape jumps with its class. That makes thin
    /// liquid rounder: a tenth above the threshold is plenty.
    ///
    /// The last frame's classes count if that frame had hysteresis by the same indices or ids, and as many of them;
    /// without, as if all had been body.
    pub keep_class_below: Option<f32>,
    /// Which particle is which, for [`DevicePositions::keep_class_below`], which alone reads them: needed where the
    /// simulation re-sorts its particles, or their number changes. Without, particles go by their index in the buffer.
    pub ids: Option<DeviceIds>,
}

/// How many particles there are, in device memory: a word of 32 bits, read when the frame runs. What lies behind so many particles is
/// not there: it is neither looked at, nor sorted, nor drawn, whatever it holds. More than there may be ([`DevicePositions::count`]) are
/// as many as that. Memory and dispatches are those of as many as there may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct DeviceCount {
    /// The host's buffer, with usage `STORAGE_BUFFER`; it may be that of the positions.
    pub buffer: vk::Buffer,
    /// Where the number lies, in bytes; a multiple of 4.
    pub offset: u64,
}

impl DeviceCount {
    /// The number at this byte of a buffer.
    pub fn new(buffer: vk::Buffer, offset: u64) -> DeviceCount {
        DeviceCount { buffer, offset }
    }

    /// What of it is bound.
    pub(crate) fn bound(&self) -> (vk::Buffer, u64, u64) {
        bound(self.buffer, self.offset, 4, 4, 1)
    }

    /// Which word of that it is.
    pub(crate) fn word(&self, alignment: u64) -> u32 {
        (self.offset % alignment / 4) as u32
    }

    /// What can be told without using it.
    pub(crate) fn check(&self, [buffer_of, offset_of]: [&'static str; 2]) -> Result<(), Error> {
        if self.buffer == vk::Buffer::null() {
            return Err(Error::parameter(buffer_of, "null", "give the buffer that holds it, or None"));
        }
        self.check_offset(offset_of)
    }

    fn check_offset(&self, offset_of: &'static str) -> Result<(), Error> {
        Words { offset_of, stride_of: offset_of, offset: self.offset, stride: 4, bytes: 4 }.check(1)
    }
}

/// Ids of particles in device memory: one of 32 bits a particle, in the order of the positions.
///
/// A particle whose id is not below [`DeviceIds::number`] has the class that its density alone gives it, and is counted
/// (`id_out_of_range`). Of two particles with one id the next frame remembers one's class, and nobody knows whose.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct DeviceIds {
    /// The host's buffer, with usage `STORAGE_BUFFER`; it may be that of the positions.
    pub buffer: vk::Buffer,
    /// Where the first one begins, in bytes; a multiple of 4.
    pub offset: u64,
    /// Bytes from one to the next; a multiple of 4, at least 4.
    pub stride: u64,
    /// How many ids there may be, at least 1: all are below this. Each takes 4 bytes of device memory. Unlike the number
    /// of particles it stays the same from frame to frame; another one starts without last classes.
    pub number: u32,
}

impl DeviceIds {
    /// Ids below `number` that fill a buffer without gaps.
    pub fn packed(buffer: vk::Buffer, number: u32) -> DeviceIds {
        DeviceIds { buffer, offset: 0, stride: 4, number }
    }

    /// The same, beginning at a byte of the buffer and lying so many bytes apart.
    #[must_use]
    pub fn laid_out(self, offset: u64, stride: u64) -> Self {
        DeviceIds { offset, stride, ..self }
    }
}

/// Words of a buffer of the host's, one group of them a particle.
pub(crate) struct Words {
    /// Where it stands in an error.
    pub offset_of: &'static str,
    pub stride_of: &'static str,
    pub offset: u64,
    pub stride: u64,
    /// Bytes of one group.
    pub bytes: u64,
}

impl Words {
    pub fn check(&self, count: u32) -> Result<(), Error> {
        if !self.offset.is_multiple_of(4) {
            return Err(Error::parameter(self.offset_of, self.offset, "use a multiple of 4 bytes"));
        }
        if !self.stride.is_multiple_of(4) || self.stride < self.bytes || self.stride > 1 << 20 {
            let remedy = format!("use a multiple of 4 bytes, {} at least and a mebibyte at most", self.bytes);
            return Err(Error::parameter(self.stride_of, self.stride, remedy));
        }
        let span = self.stride.checked_mul(u64::from(count)).and_then(|s| s.checked_add(self.offset));
        if span.is_none_or(|end| end > 1 << 48) {
            let remedy = "offset and stride times count lie beyond any buffer";
            return Err(Error::parameter(self.offset_of, self.offset, remedy));
        }
        Ok(())
    }
}

impl DevicePositions {
    /// Positions that fill a buffer without gaps, prepared with the default options.
    pub fn packed(buffer: vk::Buffer, count: u32, radius: f32) -> DevicePositions {
        let options = Options::default();
        DevicePositions {
            buffer,
            offset: 0,
            stride: 12,
            count,
            device_count: None,
            radius,
            options,
            keep_class_below: None,
            ids: None,
        }
    }

    /// The same, beginning at a byte of the buffer and lying so many bytes apart.
    #[must_use]
    pub fn laid_out(self, offset: u64, stride: u64) -> Self {
        DevicePositions { offset, stride, ..self }
    }

    /// The same, but only so many of them as the device says: see [`DevicePositions::device_count`].
    #[must_use]
    pub fn device_count(self, count: impl Into<Option<DeviceCount>>) -> Self {
        DevicePositions { device_count: count.into(), ..self }
    }

    /// The same with other options.
    #[must_use]
    pub fn options(self, options: Options) -> Self {
        DevicePositions { options, ..self }
    }

    /// The same with hysteresis: see [`DevicePositions::keep_class_below`].
    #[must_use]
    pub fn keep_class_below(self, share: impl Into<Option<f32>>) -> Self {
        DevicePositions { keep_class_below: share.into(), ..self }
    }

    /// The same with ids, or without: see [`DevicePositions::ids`].
    #[must_use]
    pub fn ids(self, ids: impl Into<Option<DeviceIds>>) -> Self {
        DevicePositions { ids: ids.into(), ..self }
    }

    /// By what the frame keeps classes, if it does.
    pub(crate) fn kept(&self) -> Option<Kept> {
        self.keep_class_below?;
        Some(Kept { by_id: self.ids.is_some(), number: self.ids.map_or(self.count, |ids| ids.number) })
    }

    /// Entries a particle has in the sort.
    fn entries_per_particle(&self) -> u32 {
        match self.options.search {
            Search::Runs => 1,
            Search::Relation => 27,
        }
    }

    /// Entries of the sort.
    pub fn entries(&self) -> u64 {
        u64::from(self.count) * u64::from(self.entries_per_particle())
    }

    /// Checks radius, options, offsets and strides, and makes the passes' constants; offsets are rounded down to this
    /// alignment where buffers are bound.
    pub(crate) fn constants(&self, alignment: u64) -> Result<Prepare, Error> {
        let scale = Scale::new(self.radius, &self.options)?;
        let (offset, stride) = (self.offset, self.stride);
        let [offset_of, stride_of] = ["offset of positions", "stride of positions"];
        Words { offset_of, stride_of, offset, stride, bytes: 12 }.check(self.count)?;
        if let Some(DeviceIds { offset, stride, number, .. }) = self.ids {
            let [offset_of, stride_of] = ["offset of ids", "stride of ids"];
            Words { offset_of, stride_of, offset, stride, bytes: 4 }.check(self.count)?;
            if number == 0 {
                return Err(Error::parameter("number of ids", 0, "use one more than the largest id"));
            }
        }
        if let Some(count) = self.device_count {
            count.check_offset("offset of the particle count")?;
        }
        let keep_below = self.options.fade_from(self.keep_class_below)?;
        // Sorted cells are as wide as the support, those of the relation table as the reach.
        let cell_edge = match self.options.search {
            Search::Runs => scale.support,
            Search::Relation => scale.reach,
        };
        let reach = scale.reach / scale.radius;
        let power = space::power_of_two(self.radius);
        let o = &self.options;
        Ok(Prepare {
            count: self.count,
            first_word: (self.offset % alignment / 4) as u32,
            word_stride: (self.stride / 4) as u32,
            entries_per_particle: self.entries_per_particle(),
            cell_edge: cell_edge as f32 * power,
            radius: self.radius * power,
            support: scale.support as f32 * power,
            reach: scale.reach as f32 * power,
            splash_below: o.splash_threshold,
            keep_below,
            filled_density: rest_density(scale.support / scale.radius) as f32,
            unit_scale: power,
            smoothing: o.smoothing,
            least_ratio: o.max_ratio.recip(),
            longest_axis: o.longest(),
            filled_variance: lattice_variance(reach) as f32,
            flat_offset: flat_offset(reach) as f32,
            min_neighbours: u32::try_from(o.min_neighbours).unwrap_or(u32::MAX).min(u32::MAX - 1),
            sort_pass: 0,
            cells_around: (scale.reach / cell_edge).ceil() as u32,
            first_id_word: self.ids.map_or(0, |ids| (ids.offset % alignment / 4) as u32),
            id_word_stride: self.ids.map_or(0, |ids| (ids.stride / 4) as u32),
            kept_classes: self.kept().map_or(0, |k| k.number),
            count_word: self.device_count.map_or(0, |c| c.word(alignment)),
            least_count: if self.device_count.is_some() { 0 } else { self.count },
        })
    }
}

/// What to do about a radius.
pub(crate) fn radius_remedy() -> String {
    let (least, most) = (space::RADII.start(), space::RADII.end());
    format!("give half the rest spacing, in world units, from {least:e} to {most:e}; scale the scene if need be")
}

impl From<PrepareError> for Error {
    fn from(e: PrepareError) -> Error {
        match e {
            PrepareError::Radius(r) => Error::parameter("particle radius", r, radius_remedy()),
            PrepareError::Option { name, value, remedy } => Error::parameter(name, value, remedy),
            other => Error::parameter("particles", "", other.to_string()),
        }
    }
}

/// Classes that are kept from frame to frame.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Kept {
    /// By ids of the host's, or else by index in its buffer.
    pub by_id: bool,
    /// How many there are.
    pub number: u32,
}
