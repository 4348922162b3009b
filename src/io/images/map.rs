//! What all formats of environment maps share: limits that are checked before anything is allocated, and where texels go.

use crate::io::budget::{self, Budget, OverBudget};
use crate::{Equirect, EquirectBuilder, Error};

/// Bytes that a texel takes while a map is given to the renderer: in memory, in a staging buffer, and on the device, which
/// may be the same memory.
const TEXEL: u64 = 3 * 16;

/// What is wrong with an environment map; the caller knows its name.
pub(super) enum Fault {
    Io(std::io::Error),
    Corrupt(String),
    /// No texels that light could have, or no shape of a map.
    Content(Error),
    TooLarge(OverBudget),
}

impl From<std::io::Error> for Fault {
    fn from(error: std::io::Error) -> Self {
        match error.kind() {
            std::io::ErrorKind::UnexpectedEof => Fault::Corrupt("it ends too early".into()),
            // Decoders wrap what they find in the data.
            std::io::ErrorKind::InvalidData | std::io::ErrorKind::InvalidInput | std::io::ErrorKind::Other => {
                Fault::Corrupt(error.to_string())
            }
            _ => Fault::Io(error),
        }
    }
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Fault::Content(error)
    }
}

/// What is known before a file is looked into.
pub(super) struct Frame<'a> {
    pub(super) budget: &'a Budget,
    /// The file's size in bytes.
    pub(super) file: u64,
    /// Texels around that suffice.
    pub(super) needed: Option<u32>,
}

impl Frame<'_> {
    /// Room for a map of so many texels, or for what is to be held of it.
    pub(super) fn target(&self, width: u32, height: u32) -> Result<Target, Fault> {
        if width.abs_diff(height.saturating_mul(2)) > height / 4 {
            let what = format!("{width}x{height}");
            let remedy = "an equirectangular map is twice as wide as it is high";
            return Err(Error::parameter("environment map", what, remedy).into());
        }
        self.check_texels(width.into(), height.into())?;
        let factor = reduction([width, height], self.needed, self.budget);
        Ok(Target { builder: EquirectBuilder::new(width, height, factor)?, size: [width, height] })
    }

    /// Checks that unpacking so many texels does not take too long.
    pub(super) fn check_texels(&self, width: u64, height: u64) -> Result<(), Fault> {
        let (texels, more) = (width.saturating_mul(height), self.file.saturating_mul(budget::MAP_TEXELS_PER_BYTE));
        if texels > budget::MAP_TEXELS.saturating_add(more) {
            let what = format!("{width}x{height} in a file of {}", budget::size(self.file));
            let remedy = "no true map packs so well: save it smaller";
            return Err(Error::parameter("environment map", what, remedy).into());
        }
        Ok(())
    }

    /// Checks that some blocks of so many bytes can be held.
    pub(super) fn check_block(&self, bytes: u64) -> Result<(), Fault> {
        let allowed = self.budget.bytes() / budget::FLOOR_SHARE;
        if bytes > allowed {
            let what = "a block of the image".into();
            let (file, budget) = (self.file, *self.budget);
            return Err(Fault::TooLarge(OverBudget { what, needed: bytes, allowed, file, budget }));
        }
        Ok(())
    }
}

/// The map in the making.
pub(super) struct Target {
    builder: EquirectBuilder,
    size: [u32; 2],
}

impl Target {
    /// The file's, not the result's.
    pub(super) fn size(&self) -> [u32; 2] {
        self.size
    }

    pub(super) fn add(
        &mut self,
        x: u32,
        step: u32,
        y: u32,
        colors: impl Iterator<Item = [f32; 3]>,
    ) -> Result<(), Fault> {
        Ok(self.builder.add(x, step, y, colors)?)
    }

    pub(super) fn finish(self) -> Equirect {
        self.builder.finish()
    }
}

/// The whole factor by which a map of `size` texels is averaged down: as many times as it has more texels around than
/// `needed`, if that is given (rounded down, so that no fewer are left), but at least so many that three copies of 16 bytes
/// a texel fit into half the budget. A renderer on a CPU holds these three: the host's, a staging buffer's, the device's.
///
/// ```
/// use meniscus::io::{Budget, images::reduction};
/// assert_eq!(reduction([4096, 2048], Some(4000), &Budget::default()), 1);
/// assert_eq!(reduction([8192, 4096], Some(2000), &Budget::default()), 4);
/// assert_eq!(reduction([16384, 8192], None, &Budget::default()), 3);
/// ```
pub fn reduction(size: [u32; 2], needed: Option<u32>, budget: &Budget) -> u32 {
    let most = budget.bytes() / 2 / TEXEL;
    let fits = |factor: u32| {
        let [width, height] = size.map(|n| u64::from(n.div_ceil(factor)));
        width * height <= most
    };
    let enough = needed.map_or(1, |needed| size[0] / needed.max(1)).max(1);
    // Rounding up to whole texels can ask for a little more than the root does.
    let texels = f64::from(size[0]) * f64::from(size[1]);
    let root = (texels / most.max(1) as f64).sqrt() as u32;
    let largest = size[0].max(size[1]).max(1);
    (root.max(enough)..=largest).find(|factor| fits(*factor)).unwrap_or(largest)
}
