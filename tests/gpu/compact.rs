//! Lists of what is drawn: exactly the cull pass's verdicts, in order, however many blocks there are.

use crate::{
    splat::case,
    support::{Choose, Shot, camera, each_driver, random_cloud},
};
use glam::Vec3;
use meniscus::twin::compact::compact;

/// The lists as the splat pass reads them: `[2 * class + side]`.
fn lists(shot: &Shot) -> [Vec<u32>; 4] {
    let (drawn, draws) =
        (shot.words("drawn particles", 0).expect("drawn"), shot.words("indirect draws", 0).expect("draws"));
    let count = shot.words("visible particles", 0).expect("visible").len();
    std::array::from_fn(|l| {
        let draw = &draws[8 * l..][..8];
        assert!(draw[1] == 1 && draw[4] == 4 && (draw[0] == 0 || draw[5] == 0), "points or quads: {draw:?}");
        let n = (draw[0] + draw[5]) as usize;
        if n == 0 {
            return Vec::new();
        }
        let side = &drawn[(l & 1) * count..][..count];
        if l < 2 { side[..n].to_vec() } else { side[count - n..].iter().rev().copied().collect() }
    })
}

#[test]
fn lists_are_the_verdicts_in_order() {
    let size = [96, 64];
    let eye = camera(Vec3::new(0.5, 0.4, 1.4), Vec3::ZERO, size);
    each_driver(|driver| {
        // One block and less, block borders, many blocks, one class only, one side only.
        let counts = [(1, 0), (0, 1), (3, 60), (500, 524), (500, 525), (0, 2048), (3000, 0), (1234, 70_000)];
        for (i, (splash, body)) in counts.into_iter().enumerate() {
            let cloud = random_cloud(i as u64, 0.02, Vec3::splat(-0.6), Vec3::splat(0.6), splash, body);
            let mut case = case(cloud, eye, size);
            case.settings = case.settings.refractions(if i == 4 { 1 } else { 4 }).quads_only(i % 2 == 1);
            let shot = driver.shoot(&case);
            let want = compact(shot.words("visible particles", 0).expect("visible"));
            let got = lists(&shot);
            for l in 0..4 {
                assert_eq!(got[l], want[l], "{}: {splash} + {body}: list {l}", driver.name);
                assert_eq!(shot.counter(crate::cull::DRAWN[l]) as usize, want[l].len());
            }
            assert!(i < 2 || got.iter().any(|l| !l.is_empty()), "{splash} + {body}: nothing shows");
        }
    });
}
