//! Light at one surface, against closed forms and textbook values.

use glam::Vec3;
use meniscus::twin::optics::{decode_srgb, encode_srgb, fresnel, reflect, refract, srgb_byte};

const WATER: f32 = 1.333;

/// A ray at an angle to the normal +z, and the surface it falls on.
fn falling(degrees: f32) -> Vec3 {
    let angle = degrees.to_radians();
    Vec3::new(angle.sin(), 0.0, -angle.cos())
}

fn angle_to_axis(dir: Vec3) -> f32 {
    dir.x.hypot(dir.y).atan2(-dir.z).to_degrees()
}

#[test]
fn refraction_follows_snell() {
    // sin 30 / 1.333 = sin 22.0305; sin 60 / 1.333 = sin 40.5190 (degrees)
    for (air, water) in [(0.0, 0.0), (30.0, 22.0305), (60.0, 40.5190), (89.9, 48.6066)] {
        let down = refract(falling(air), Vec3::Z, 1.0 / WATER).unwrap();
        assert!((angle_to_axis(down) - water).abs() < 2e-3, "{air}: {}", angle_to_axis(down));
        assert!((down.length() - 1.0).abs() < 1e-6);
        // And the same way back, from below.
        if air < 89.0 {
            let up = refract(falling(water), Vec3::Z, WATER).unwrap();
            assert!((angle_to_axis(up) - air).abs() < 5e-3, "{water}: {}", angle_to_axis(up));
        }
    }
}

#[test]
fn refraction_stays_in_the_plane_of_incidence() {
    let (dir, n) = (Vec3::new(0.3, -0.5, -0.7).normalize(), Vec3::new(0.2, 0.1, 0.95).normalize());
    let bent = refract(dir, n, 1.0 / WATER).unwrap();
    assert!(bent.dot(dir.cross(n)).abs() < 1e-6);
    assert!((bent.cross(n).length() * WATER - dir.cross(n).length()).abs() < 1e-6);
}

#[test]
fn beyond_the_critical_angle_nothing_is_transmitted() {
    // asin(1 / 1.333) = 48.607 degrees
    assert!(refract(falling(48.59), Vec3::Z, WATER).is_some());
    assert!(refract(falling(48.62), Vec3::Z, WATER).is_none());
    assert!(refract(falling(89.0), Vec3::Z, WATER).is_none());
    assert!(refract(falling(89.0), Vec3::Z, 1.0 / WATER).is_some(), "there is none into water");
}

#[test]
fn a_mirror_turns_the_normal_part_round() {
    assert_eq!(reflect(Vec3::new(0.6, 0.0, -0.8), Vec3::Z), Vec3::new(0.6, 0.0, 0.8));
    assert_eq!(reflect(Vec3::new(0.6, 0.0, -0.8), -Vec3::Z), Vec3::new(0.6, 0.0, 0.8));
}

/// Cosines in air and in water for an angle in air.
fn cosines(degrees: f32) -> (f32, f32) {
    let air = degrees.to_radians();
    (air.cos(), (1.0 - (air.sin() / WATER).powi(2)).sqrt())
}

#[test]
fn exact_reflectance_has_its_textbook_values() {
    let exact = |degrees| {
        let (air, water) = cosines(degrees);
        fresnel(air, water, WATER, true)
    };
    // At normal incidence ((n - 1) / (n + 1))² = 0.020373; at grazing incidence everything.
    assert!((exact(0.0) - 0.020_373).abs() < 1e-6);
    assert!((exact(90.0) - 1.0).abs() < 1e-5);
    // rs² and rp² as sin² and tan² of the difference over the sum of the angles.
    for degrees in [10.0f32, 45.0, 70.0, 85.0] {
        let (a, w) = (degrees.to_radians(), (degrees.to_radians().sin() / WATER).asin());
        let rs = ((a - w).sin() / (a + w).sin()).powi(2);
        let rp = ((a - w).tan() / (a + w).tan()).powi(2);
        assert!((exact(degrees) - 0.5 * (rs + rp)).abs() < 1e-5, "{degrees}");
    }
    // Brewster's angle, atan 1.333: nothing polarised along the plane of incidence comes back.
    let (air, water) = cosines(WATER.atan().to_degrees());
    let s = ((air - WATER * water) / (air + WATER * water)).powi(2);
    assert!((fresnel(air, water, WATER, true) - 0.5 * s).abs() < 1e-6);
}

#[test]
fn reflectance_is_the_same_both_ways() {
    // Leaving water: the same two cosines with roles and index exchanged.
    for degrees in [0.0, 20.0, 50.0, 80.0] {
        let (air, water) = cosines(degrees);
        let (into, out) = (fresnel(air, water, WATER, true), fresnel(water, air, 1.0 / WATER, true));
        assert!((into - out).abs() < 1e-6, "{degrees}: {into} {out}");
    }
}

#[test]
fn schlick_meets_the_exact_curve_at_both_ends() {
    let schlick = |degrees| {
        let (air, water) = cosines(degrees);
        fresnel(air, water, WATER, false)
    };
    assert!((schlick(0.0) - 0.020_373).abs() < 1e-6);
    assert!((schlick(90.0) - 1.0).abs() < 1e-5);
    // r0 + (1 - r0) / 2^5 at 60 degrees
    assert!((schlick(60.0) - (0.020_373 + 0.979_627 / 32.0)).abs() < 1e-6);
    // Furthest from the exact curve around 84 degrees: by 0.06.
    for degrees in 0..=90 {
        let (air, water) = cosines(degrees as f32);
        let off = fresnel(air, water, WATER, false) - fresnel(air, water, WATER, true);
        assert!(off.abs() < 0.065, "{degrees}: {off}");
    }
}

#[test]
fn srgb_has_its_known_values_and_comes_back() {
    // IEC 61966-2-1: half of linear light is code 0.735357, a fifth 0.484529; the line ends at 0.0031308.
    for (linear, code) in [(0.0, 0.0), (0.5, 0.735_357), (0.2, 0.484_529), (1.0, 1.0), (0.001, 0.012_92)] {
        assert!((encode_srgb(linear) - code).abs() < 1e-5, "{linear}: {}", encode_srgb(linear));
        assert!((decode_srgb(code) - linear).abs() < 1e-5, "{code}: {}", decode_srgb(code));
    }
    assert_eq!((encode_srgb(-1.0), encode_srgb(2.0)), (0.0, encode_srgb(1.0)), "clamped");
    assert_eq!((srgb_byte(0.0), srgb_byte(1.0), srgb_byte(0.5), srgb_byte(0.216)), (0, 255, 188, 128));
    for byte in 0..=255u8 {
        assert_eq!(srgb_byte(decode_srgb(f32::from(byte) / 255.0)), byte);
    }
}
