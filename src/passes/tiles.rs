//! The range of front depths in each tile (`glsl/tiles.comp`): lets rays outside the liquid skip what they pass by.

use super::{Pipelines, groups};
use crate::{
    Error,
    access::Access,
    pipeline::Pipeline,
    recorder::{Recorder, bound},
    shader::{FRONT_TILE, TILES_COMP},
    targets::{Id, Needs},
};

#[derive(Default)]
pub(crate) struct Tiles {
    /// By (splash, body).
    pub pipelines: Pipelines<[u32; 2]>,
}

impl Tiles {
    pub fn record(&mut self, r: &mut Recorder, needs: &Needs) -> Result<(), Error> {
        let (body, splash) = (needs.maps_or_other(true), needs.maps_or_other(false));
        let uses = [
            bound(1, body.0, Access::ComputeRead),
            bound(2, splash.0, Access::ComputeRead),
            bound(3, Id::FrontTiles, Access::ComputeWrite),
        ];
        let host = r.host;
        let key = [u32::from(needs.splash), u32::from(needs.body)];
        let pipeline = self.pipelines.get(key, |key| Pipeline::compute(host, &TILES_COMP, key, 0))?;
        r.pass("tiles", &uses, |r| {
            r.bind(pipeline, &uses)?;
            r.dispatch(groups(needs.size[0], FRONT_TILE), groups(needs.size[1], FRONT_TILE), 1);
            Ok(())
        })
    }
}
