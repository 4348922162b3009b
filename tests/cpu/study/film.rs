use super::{liquid, view};
use glam::DVec3;
use meniscus::{
    Equirect,
    study::{
        analytic::scene,
        film::{Film, NotThisFilm},
        measures::relative_noise,
        tracer::Tracer,
    },
};

const SIZE: [u32; 2] = [24, 18];

fn exposed(passes: u32, from: Film) -> Film {
    let map = Equirect::procedural_sky();
    let view = view(&map, SIZE);
    let shapes = scene("ball-before-slab").expect("a scene");
    let tracer = Tracer::new(&shapes, &view, &liquid(0.2));
    let mut film = from;
    (0..passes).for_each(|_| film.expose(&tracer, &|| ()));
    film
}

#[test]
fn a_film_that_was_broken_off_goes_on_to_the_same_bits() {
    let whole = exposed(3, Film::new(SIZE));
    let bytes = exposed(1, Film::new(SIZE)).bytes();
    let begun = Film::from_bytes(SIZE, &bytes).expect("a film");
    assert_eq!(begun.passes(), 1);
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let resumed = alone.install(|| exposed(2, begun));
    assert_eq!(resumed.bytes(), whole.bytes());
    assert_eq!(resumed.passes(), 3);
    assert!(whole.picture().iter().all(|p| p.is_finite() && p.min_element() > 0.0));

    assert_eq!(Film::from_bytes([18, 24], &bytes), Err(NotThisFilm));
    assert_eq!(Film::from_bytes(SIZE, &[]), Err(NotThisFilm));
    for at in [0, 8, 16, 30, bytes.len() / 2, bytes.len() - 1] {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1;
        assert_eq!(Film::from_bytes(SIZE, &damaged), Err(NotThisFilm), "byte {at}");
        assert_eq!(Film::from_bytes(SIZE, &bytes[..at]), Err(NotThisFilm), "{at} bytes");
    }
}

/// What is said of the noise is how far films of few passes are from one of many.
#[test]
fn noise_is_how_far_pictures_are_from_the_mean() {
    let long = exposed(48, Film::new(SIZE)).picture();
    let short = exposed(6, Film::new(SIZE));
    let squares: Vec<DVec3> = short.picture().iter().zip(&long).map(|(a, b)| (*a - *b) * (*a - *b)).collect();
    // The long one holds the short one's passes: what is between them is 7/8 of the short one's noise.
    let (seen, said) = (relative_noise(&long, &squares), 0.875 * relative_noise(&long, &short.variance()));
    assert!(seen / said > 0.7 && seen / said < 1.4, "{seen} seen, {said} said");
    assert!(exposed(1, Film::new(SIZE)).variance().iter().all(|v| v.is_nan()));
}
