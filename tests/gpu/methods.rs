//! Methods as a whole: presets, and which members go together.

use crate::support::{Case, camera, each_driver, random_cloud};
use glam::Vec3;
use meniscus::{Method, PRESETS, Settings, layers::Layers, optics::Optics, smooth::Smooth};

const SIZE: [u32; 2] = [40, 30];

fn case(method: Method) -> Case {
    let particles = random_cloud(7, 0.1, Vec3::splat(-0.5), Vec3::splat(0.5), 10, 60);
    let mut settings = Settings::default();
    settings.method = method;
    Case {
        particles,
        camera: camera(Vec3::new(0.3, 0.4, 2.0), Vec3::ZERO, SIZE),
        settings,
        size: SIZE,
        eye_inside: false,
    }
}

/// Every preset is what its table says, goes together, is found by its name, and gives a picture of its own.
#[test]
fn every_preset_renders() {
    for preset in PRESETS {
        let method = preset.method();
        method.validate().unwrap_or_else(|e| panic!("{}: {e}", preset.name));
        assert_eq!(method.members().map(|(_, member)| member), preset.members, "{}", preset.name);
        assert_eq!(Method::preset(preset.name), Some(method), "{}", preset.name);
        for (name, value) in preset.values {
            let mut again = method;
            again.set(name, value).expect("a parameter");
            assert_eq!(again, method, "{}: {name} is {value}", preset.name);
        }
    }
    assert_eq!(Method::default(), PRESETS[0].method());
    assert_eq!(Method::preset("green"), None);
    each_driver(|driver| {
        let mut pictures: Vec<(&str, Vec<[f32; 3]>)> = Vec::new();
        for preset in PRESETS {
            let picture = driver.shoot(&case(preset.method())).picture;
            assert!(picture.as_flattened().iter().all(|v| v.is_finite()), "{}: {}", driver.name, preset.name);
            let same = pictures.iter().find(|(_, other)| *other == picture);
            assert!(same.is_none(), "{}: {} draws what {:?} does", driver.name, preset.name, same.map(|s| s.0));
            pictures.push((preset.name, picture));
        }
    });
}

/// What members need of the layers, by the papers: member, what, the layers that have it.
type Need = (&'static str, &'static str, &'static [&'static str]);
const NEEDS: &[Need] = &[
    ("plane-fit", "the particles' own normals", &["split", "front"]),
    ("four", "the far side of the liquid", &["split", "nearest-farthest"]),
    ("two", "the far side of the liquid", &["split", "nearest-farthest"]),
    ("many", "surfaces that the view does not show", &[]),
    ("ssfr", "the liquid's thickness", &["front"]),
    ("ssfr-index", "the liquid's thickness", &["front"]),
];
/// Members that need nothing as they come.
const CONTENT: &[&str] = &[
    "none",
    "bilateral",
    "bilateral-separable",
    "binomial",
    "curvature-flow",
    "narrow-range",
    "one",
    "instant-liquids",
];
const LAYERS: &[&str] = &["split", "nearest-farthest", "front"];

/// What a method lacks by that; or that a member of it is another one, of which the papers say nothing.
fn lacking(method: &Method) -> Result<Option<Need>, &'static str> {
    let [(_, layers), (_, smooth), (_, optics)] = method.members();
    if !LAYERS.contains(&layers) {
        return Err(layers);
    }
    for member in [smooth, optics] {
        match NEEDS.iter().find(|(who, ..)| *who == member) {
            Some(need) if !need.2.contains(&layers) => return Ok(Some(*need)),
            None if !CONTENT.contains(&member) => return Err(member),
            _ => {}
        }
    }
    Ok(None)
}

#[test]
fn members_go_together_or_say_why_not() {
    let mut accepted = Vec::new();
    for layers in Layers::all() {
        for smooth in Smooth::all() {
            for optics in Optics::all() {
                let method = Method::new(layers, smooth, optics);
                let [(_, own), ..] = method.members();
                match (method.validate(), lacking(&method)) {
                    (Ok(()), Ok(None) | Err(_)) => accepted.push(method),
                    // Refused with a reason of its own.
                    (Err(e), Err(other)) => assert!(e.to_string().contains("it needs"), "{other}: {e}"),
                    (Err(e), Ok(Some((who, what, others)))) => {
                        let said = e.to_string();
                        let named = [who, what, own].iter().chain(others).all(|word| said.contains(word));
                        assert!(named, "{:?}: {said}", method.members());
                        // The remedy is one: for what it names, no other complaint than one of another kind.
                        for other in others {
                            let mut mended = method;
                            mended.choose("layers", other).expect("a member");
                            let still = mended.validate().err().map(|e| e.to_string()).unwrap_or_default();
                            assert!(!still.contains(what), "{other}: {still}");
                        }
                    }
                    (found, wanted) => panic!("{:?}: {found:?}, not {wanted:?}", method.members()),
                }
            }
        }
    }
    println!("{} of {} go together", accepted.len(), Layers::all().len() * Smooth::all().len() * Optics::all().len());
    assert!(accepted.len() > 60);
    each_driver(|driver| {
        for method in &accepted {
            let shot = driver.shoot(&case(*method));
            let (seen, names) = (shot.picture.as_flattened(), method.members());
            assert!(seen.iter().all(|v| v.is_finite()), "{}: {names:?}", driver.name);
            // A driver's messages are looked at after the test; here, so that they say of what.
            let messages = driver.instance.take_messages();
            assert!(messages.is_empty(), "{}: {names:?}: {}", driver.name, messages.join("\n"));
        }
    });
}
