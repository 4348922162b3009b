//! Tiles of the view: those that the cull pass marks are its twin's, nothing is drawn beside them, and what is seen is the same
//! as if there were none.

use crate::{
    cull::{around_the_near_plane, both, drawn_as_quads},
    support::{Case, Choose, Driver, Shot, camera, each_driver, imai16, random_cloud, sphere},
};
use glam::Vec3;
use meniscus::{
    Camera,
    shader::{CLASS_BODY, CLASS_SPLASH, PATTERN_NONE, VIEW_TILE},
    twin::tiles::tiles,
};

/// Tiles of a view.
fn number(size: [u32; 2]) -> usize {
    size.map(|s| s.div_ceil(VIEW_TILE) as usize).iter().product()
}

/// Whether a tile may have liquid, row by row, and whether any may.
fn marks(shot: &Shot) -> (Vec<bool>, bool) {
    let words = shot.words("tiles", 0).expect("walks are drawn by tiles");
    assert!(words.iter().all(|w| *w == 0 || *w == f32::INFINITY.to_bits()));
    let (each, all) = words.split_at(number(shot.size));
    (each.iter().map(|w| *w == 0).collect(), all == [0])
}

/// Walks are where there are fronts, and all of these are in marked tiles; the share of tiles that are not marked.
fn check(driver: &Driver, case: &Case, what: &str) -> f64 {
    let shot = driver.shoot(case);
    let label = format!("{}: {what}, {:?}", driver.name, case.size);
    let (marked, anywhere) = marks(&shot);
    let (across, width) = (case.size[0].div_ceil(VIEW_TILE), case.size[0]);
    let walks = shot.floats("walk (debug)", 0).unwrap();
    let depths: Vec<_> = ["splash depth", "body depth (ray-cast)"]
        .iter()
        .flat_map(|map| [0, 1].map(|side| (side, shot.floats(map, side).unwrap_or_default())))
        .collect();
    let mut liquid = 0;
    for i in 0..shot.picture.len() {
        let (x, y) = (i as u32 % width, i as u32 / width);
        let at = |side: Option<u32>| {
            depths.iter().any(|(of, map)| side.is_none_or(|s| s == *of) && map.get(i).is_some_and(|d| *d != 0.0))
        };
        let tile = (y / VIEW_TILE * across + x / VIEW_TILE) as usize;
        assert!(anywhere || marked[tile] || !at(None), "{label}: a surface at {x}, {y} in no tile");
        let around = case.eye_inside && case.settings.walk().refractions == 1;
        assert_eq!(walks[4 * i] as u32 != PATTERN_NONE, at(Some(0)) || around, "{label}: {x}, {y}");
        liquid += usize::from(at(Some(0)));
        // Everything was drawn: a picture has no transparent black.
        assert!(shot.picture[i].iter().any(|v| *v > 0.0), "{label}: nothing at {x}, {y}");
    }
    assert!(200 * liquid > shot.picture.len(), "{label}: {liquid} pixels of liquid");
    // Verdicts are the GPU's own, so that only the edges of its rectangles may round.
    let (splash, body) = shot.words("visible particles", 0).unwrap().split_at(case.particles.splash_count);
    let [a, b] = [(CLASS_SPLASH, splash), (CLASS_BODY, body)].map(|(class, verdicts)| {
        let verdicts: Vec<_> = verdicts.iter().map(|v| v & 3).collect();
        tiles(&shot.frame, &crate::splat::packed(&case.particles, class), &verdicts)
    });
    assert_eq!(anywhere, a.1 || b.1, "{label}: marks of the whole view");
    let differ = (0..marked.len()).filter(|i| marked[*i] != (a.0[*i] || b.0[*i])).count();
    assert!(differ <= marked.len() / 500 + 1, "{label}: {differ} of {} tiles differ", marked.len());
    if anywhere { 0.0 } else { marked.iter().filter(|m| !**m).count() as f64 / marked.len() as f64 }
}

/// Sizes that end within a tile, whose last point is in the view or beside it, and views of less than one.
#[test]
fn walks_are_where_there_is_liquid() {
    each_driver(|driver| {
        for (size, at_least) in [([173u32, 131u32], 0.3), ([160, 121], 0.3), ([83, 163], 0.2), ([7, 13], 0.0)] {
            for (splash, body, refractions) in [(40, 200, 4), (0, 60, 1), (60, 0, 2)] {
                let cloud = random_cloud(7, 0.04, Vec3::splat(-0.35), Vec3::splat(0.35), splash, body);
                let camera = camera(Vec3::new(0.35, 0.1, 1.6), Vec3::new(0.25, 0.1, 0.0), size);
                let mut case = crate::splat::case(cloud, camera, size);
                case.settings = imai16().refractions(refractions);
                let empty = check(driver, &case, &format!("{splash} and {body}"));
                assert!(empty >= at_least, "{}: {size:?}: {empty}", driver.name);
                case.settings = case.settings.quads_only(true);
                check(driver, &case, &format!("quads, {splash} and {body}"));
            }
        }
    });
}

/// Liquid along all borders of views that end within tiles, which the points of their neighbours may overlap.
#[test]
fn liquid_at_the_border_is_drawn() {
    each_driver(|driver| {
        for size in [[81u32, 65], [82, 66], [83, 67], [84, 68], [85, 69]] {
            let half = 45f32.to_radians().tan() / 2.0;
            let wide = half * size[0] as f32 / size[1] as f32;
            let around = (0..20).map(|i| std::f32::consts::TAU * i as f32 / 20.0);
            let at = around.map(|a| Vec3::new(0.94 * wide * a.cos(), 0.94 * half * a.sin(), -1.0).normalize() * 2.0);
            let ellipsoids: Vec<_> = at.map(|p| sphere(p, 0.03)).collect();
            let case = crate::splat::case(both(0.03, &ellipsoids), camera(Vec3::ZERO, Vec3::NEG_Z, size), size);
            let empty = check(driver, &case, "border");
            assert!(empty > 0.3, "{}: {size:?}: {empty}", driver.name);
        }
    });
}

/// Particles that cover much of the view mark all of it, and so does an eye in the liquid, where rays start without fronts.
#[test]
fn what_is_near_is_everywhere() {
    each_driver(|driver| {
        assert!(check(driver, &around_the_near_plane(), "near plane") >= 0.0);
        let mut case = around_the_near_plane();
        case.size = [400, 300];
        assert_eq!(check(driver, &case, "large"), 0.0, "{}", driver.name);
        let size = [96, 72];
        let cloud = random_cloud(7, 0.05, Vec3::splat(-0.3), Vec3::splat(0.3), 5, 60);
        let inside = crate::splat::case(cloud, camera(Vec3::new(0.0, 0.1, 2.0), Vec3::ZERO, size), size);
        for refractions in [1, 4] {
            let settings = imai16().refractions(refractions);
            let empty = check(driver, &Case { settings, eye_inside: true, ..inside.clone() }, "inside");
            assert!(empty > 0.3, "{}: {empty}", driver.name);
        }
    });
}

/// A few pixels of a telescope's view, in which particles are a few hundred radii away and cover it all or little of it.
#[test]
fn narrow_views_are_the_same() {
    let size = [150, 90];
    let cloud = random_cloud(9, 0.05, Vec3::splat(-0.3), Vec3::splat(0.3), 30, 90);
    each_driver(|driver| {
        for (degrees, quads) in [(1.2f32, false), (2.5, false), (9.0, true)] {
            let (eye, aspect) = (Vec3::new(9.0, 7.0, 12.0), size[0] as f32 / size[1] as f32);
            let camera = Camera::look_at(eye, Vec3::splat(0.1), Vec3::Y, degrees.to_radians(), aspect, 0.1);
            let mut case = crate::splat::case(cloud.clone(), camera, size);
            case.settings = case.settings.quads_only(quads);
            check(driver, &case, &format!("{degrees} degrees"));
            assert_eq!(drawn_as_quads(&driver.shoot(&case), CLASS_BODY), quads, "{}", driver.name);
        }
    });
}
