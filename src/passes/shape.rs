//! Number density, class and ellipsoid of each particle (`glsl/shape.comp`; Imai16 §4.1, YuTurk13).

use super::{Pipelines, groups, rectangle};
use crate::{
    Error,
    access::Access,
    pipeline::Pipeline,
    recorder::{Recorder, bound},
    shader::{PARTICLE_GROUP, Prepare, SHAPE_COMP, SHAPE_NEIGHBOURS_COMP, SHAPE_RUN},
    targets::{Id, Needs},
};

#[derive(Default)]
pub(crate) struct Shape {
    /// By (relation table, classes kept, neighbours listed).
    pub pipelines: Pipelines<[bool; 3]>,
}

impl Shape {
    pub fn record(&mut self, r: &mut Recorder, needs: &Needs, prepare: &Prepare) -> Result<(), Error> {
        let kept = needs.spec(Id::LastClasses).is_some();
        let listed = needs.spec(Id::Neighbours).is_some();
        let mut uses = vec![
            bound(1, Id::Positions, Access::ComputeRead),
            bound(2, Id::Extent, Access::ComputeRead),
            bound(3, Id::Order, Access::ComputeRead),
            bound(4, Id::Sorted, Access::ComputeRead),
            bound(5, Id::Centers, Access::ComputeWrite),
            bound(6, Id::Diagonals, Access::ComputeWrite),
            bound(7, Id::Mixed, Access::ComputeWrite),
            bound(8, Id::Counters, Access::ComputeReadWrite),
            // Where no classes are kept the shader does not look, but something has to be bound.
            if kept {
                bound(9, Id::LastClasses, Access::ComputeReadWrite)
            } else {
                bound(9, Id::Counters, Access::ComputeReadWrite)
            },
        ];
        if listed {
            uses.push(bound(10, Id::Neighbours, Access::ComputeWrite));
        }
        let host = r.host;
        let key = [prepare.entries_per_particle != 1, kept, listed];
        let pipeline = self.pipelines.get(key, |[relation, kept, listed]| {
            let shader = if *listed { &SHAPE_NEIGHBOURS_COMP } else { &SHAPE_COMP };
            let constants = [u32::from(*relation), u32::from(*kept)];
            Pipeline::compute(host, shader, &constants, size_of::<Prepare>() as u32)
        })?;
        r.pass("shape", &uses, |r| {
            r.bind(pipeline, &uses)?;
            r.push(pipeline, prepare);
            let [x, y] = rectangle(groups(needs.count, SHAPE_RUN * PARTICLE_GROUP));
            r.dispatch(x, y, 1);
            Ok(())
        })
    }
}
