//! Sizes that C sets, and layouts that never change.

use super::*;
use crate::{allocator::*, camera::*, frame::*, host::*, prepare::*, report::*, status::MeniscusStatus};
use std::mem::offset_of;

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
struct Known {
    struct_size: usize,
    needed: u32,
    extra: u32,
}

// SAFETY: repr(C); its size first; no padding; numbers.
unsafe impl Versioned for Known {
    const NAME: &'static str = "Known";
    const LEAST: usize = 12;
}

/// What a program has that was compiled with a later header.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
struct Later {
    known: Known,
    more: u64,
}

fn later(struct_size: usize, more: u64) -> Later {
    Later { known: Known { struct_size, needed: 1, extra: 2 }, more }
}

/// What is read of a struct of this size.
fn read(size: usize, more: u64) -> Result<Known, Failure> {
    let given = later(size, more);
    // SAFETY: no size below is larger than it, but for those that are refused.
    unsafe { super::read(ptr::from_ref(&given).cast::<Known>()) }
}

#[test]
fn sizes_of_other_versions_are_read() {
    assert_eq!(read(16, 3).expect("this version"), later(16, 0).known);
    // An older one ends before `extra`, whatever lies there.
    assert_eq!(read(12, 3).expect("an older version"), Known { struct_size: 12, needed: 1, extra: 0 });
    assert_eq!(read(24, 0).expect("a later version that asks for nothing new"), later(24, 0).known);
    let refused = [(24, 3, "does not know"), (0, 0, "sizeof(Known), which is 16"), (11, 0, "11, and 12 at least")];
    for (size, more, said) in refused.into_iter().chain([(MOST + 1, 0, "sizeof"), (usize::MAX, 0, "sizeof")]) {
        let error = read(size, more).expect_err("refused");
        assert!(error.message.contains(said), "{size}: {}", error.message);
        assert_eq!(error.status, MeniscusStatus::ErrorArgument);
    }
    // SAFETY: null, as is allowed.
    unsafe {
        assert!(super::read::<Known>(ptr::null()).expect_err("null").message.contains("Known is null"));
        assert!(read_some::<Known>(ptr::null()).expect("none").is_none());
    }
}

#[test]
fn sizes_of_other_versions_are_written() {
    let write = |size| {
        let mut room = later(size, 9);
        let value = Known { struct_size: 16, needed: 5, extra: 6 };
        // SAFETY: no size below is larger than the room, but for those that are refused.
        unsafe { super::write(ptr::from_mut(&mut room).cast::<Known>(), value) }.map(|()| room)
    };
    let known = |struct_size, extra| Known { struct_size, needed: 5, extra };
    assert_eq!(write(16).expect("this version"), Later { known: known(16, 6), more: 9 });
    assert_eq!(write(12).expect("an older version"), Later { known: known(12, 2), more: 9 });
    assert_eq!(write(24).expect("a later version"), Later { known: known(24, 6), more: 0 });
    assert!(write(11).is_err() && write(MOST + 1).is_err());
}

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pair(u32, u32);

// SAFETY: repr(C); no padding.
unsafe impl Element for Pair {
    const NAME: &'static str = "Pair";
    const LEAST: usize = 4;
}

#[test]
fn arrays_are_filled_as_far_as_they_go() {
    let fill = |element_size, mut count: usize| {
        let mut room = [9u32; 6];
        // SAFETY: no count and size below go beyond the room.
        unsafe { super::fill(&[Pair(1, 2), Pair(3, 4)], room.as_mut_ptr().cast(), element_size, &mut count) }
            .map(|()| (room, count))
    };
    assert_eq!(fill(8, 3).expect("room for more"), ([1, 2, 3, 4, 9, 9], 2));
    assert_eq!(fill(8, 1).expect("room for one"), ([1, 2, 9, 9, 9, 9], 2));
    assert_eq!(fill(4, 2).expect("elements of an older version"), ([1, 3, 9, 9, 9, 9], 2));
    assert_eq!(fill(12, 2).expect("elements of a later version"), ([1, 2, 0, 3, 4, 0], 2));
    assert!(fill(3, 1).expect_err("too small").message.contains("sizeof(Pair), which is 8"));
    let mut count = 7;
    // SAFETY: null, as is allowed.
    unsafe {
        super::fill(&[Pair(1, 2)], ptr::null_mut(), 0, &mut count).expect("only the number");
        assert!(super::fill(&[Pair(1, 2)], ptr::null_mut(), 8, ptr::null_mut()).is_err());
    }
    assert_eq!(count, 1);
}

#[test]
fn slices_are_checked() {
    let values = [1.0f32, 2.0, 3.0];
    // SAFETY: what cannot be read is refused before.
    unsafe {
        assert_eq!(slice(values.as_ptr(), 3, "values").expect("three"), values);
        assert_eq!(slice(ptr::null::<f32>(), 0, "values").expect("none"), [0.0f32; 0]);
        let said = |e: Result<&[f32], Failure>| e.expect_err("refused").message;
        assert!(said(slice(ptr::null(), 3, "values")).starts_with("values: null for 3"));
        let odd = values.as_ptr().cast::<u8>().add(1).cast::<f32>();
        assert!(said(slice(odd, 1, "values")).contains("aligned"));
        for many in [usize::MAX, usize::MAX / 4 + 1, isize::MAX as usize / 4 + 1] {
            assert!(said(slice(values.as_ptr(), many, "values")).contains("more than memory holds"), "{many}");
        }
    }
}

/// What programs were compiled with. Fields are added at ends; none moves, and none lies in what was padding.
#[cfg(target_pointer_width = "64")]
#[test]
fn layouts_stay() {
    macro_rules! ends {
        ($Type:ident, $last:ident: $Last:ty) => {
            (offset_of!($Type, $last) + size_of::<$Last>(), size_of::<$Type>(), stringify!($Type))
        };
    }
    let sizes = [
        (72, ends!(MeniscusHost, allocator: *const MeniscusAllocator)),
        (32, ends!(MeniscusAllocator, free: PFN_meniscusFree)),
        (48, ends!(MeniscusMemoryRequest, reserved: u32)),
        (32, ends!(MeniscusAllocation, own: *mut std::ffi::c_void)),
        (160, ends!(MeniscusCamera, reserved: u32)),
        (88, ends!(MeniscusPositions, count_offset: u64)),
        (48, ends!(MeniscusScene, origin: [u32; 2])),
        (24, ends!(MeniscusEnvironment, shape: u32)),
        (72, ends!(MeniscusSurface, reserved: u32)),
        (288, ends!(MeniscusMotion, count_offset: u64)),
        (96, ends!(MeniscusFrame, reserved: u32)),
        (64, ends!(MeniscusParticles, reserved: u32)),
        (64, ends!(MeniscusReport, splash_axes_ignored: usize)),
        (48, ends!(MeniscusEllipsoid, axes: [f32; 9])),
        (20, ends!(MeniscusPoint, kind: u32)),
        (112, ends!(MeniscusPassTime, reserved: u32)),
        (80, ends!(MeniscusMemory, reserved: u32)),
    ];
    for (size, (end, whole, name)) in sizes {
        assert_eq!((end, whole), (size, size), "{name}");
    }
    // Without padding within: these are the sums of the fields before.
    assert_eq!((offset_of!(MeniscusHost, queue_family), offset_of!(MeniscusHost, pipeline_cache)), (40, 48));
    assert_eq!((offset_of!(MeniscusPositions, keep_class_below), offset_of!(MeniscusPositions, id_buffer)), (40, 48));
    assert_eq!((offset_of!(MeniscusScene, cleared_depth), offset_of!(MeniscusFrame, positions)), (32, 40));
    assert_eq!((offset_of!(MeniscusMotion, positions), offset_of!(MeniscusMotion, count)), (216, 264));
    assert_eq!((offset_of!(MeniscusParticles, velocities), offset_of!(MeniscusPassTime, ms)), (32, 96));
}
