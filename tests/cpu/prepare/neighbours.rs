//! Neighbour sets against brute force.

use glam::Vec3;
use meniscus::prepare::neighbours::{Grid, cell_of};
use meniscus::prepare::{Options, PrepareError, prepare};

use super::{Random, SEARCHES, block, input};

fn assert_neighbours(name: &str, cloud: &[Vec3], size: f64) {
    let grid = Grid::new(cloud, size, |a, b| a.cmp(&b)).unwrap();
    let mut indices = grid.order.clone();
    indices.sort_unstable();
    assert!(indices.into_iter().eq(0..cloud.len() as u32), "{name}: order is a permutation");
    let mut found = 0;
    for radius in [size, 1.5 * size, 2.0 * size] {
        let lists = SEARCHES
            .map(|s| grid.map_neighbours(radius, s, |_, near| near.iter().map(|j| j.index).collect::<Vec<_>>()));
        for (i, p) in grid.positions.iter().enumerate() {
            let near = |&j: &u32| p.as_dvec3().distance(grid.positions[j as usize].as_dvec3()) < radius;
            let brute: Vec<u32> = (0..cloud.len() as u32).filter(near).collect();
            for (list, search) in lists.iter().zip(SEARCHES) {
                assert_eq!(list[i], brute, "{name}, {search:?}: neighbours of {p}");
            }
            assert_eq!(grid.around(*p, radius).count(), brute.len(), "{name}: around {p}");
            found += brute.len() - 1;
        }
    }
    assert!(found > 0, "{name}: a cloud without neighbours tests nothing");
}

#[test]
fn neighbours_equal_brute_force() {
    let mut random = Random(1);
    let ones = Vec3::ONE;
    let scattered = random.cloud(600, Vec3::ZERO, 4.0 * ones);
    let seeds = random.cloud(20, Vec3::ZERO, 50.0 * ones);
    let clustered: Vec<_> = seeds.iter().flat_map(|&s| random.cloud(30, s, ones)).collect();
    let planar = random.cloud(600, Vec3::ZERO, Vec3::new(9.0, 0.0, 9.0));
    let line = random.cloud(300, Vec3::ZERO, Vec3::new(0.0, 50.0, 0.0));
    let on_walls: Vec<_> = block([-3; 3], [3; 3]).iter().map(|p| p / 2.0).collect();
    let coincident = [vec![Vec3::splat(-1.0); 60], vec![Vec3::ZERO; 60], vec![-Vec3::ZERO; 60]].concat();
    let half = 4.0 * ones;
    let far = [1e6, -1e6].map(|x| random.cloud(300, Vec3::new(x, -x, x), half)).concat();
    // Places whose cells agree in their low 8, 10, 16, 20 and 21 bits.
    let alias = [0, 8, 10, 16, 20, 21].map(|bit| (1 << bit) as f32);
    let alias: Vec<_> = alias
        .iter()
        .flat_map(|&x| [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, ones].map(|axis| axis * x))
        .flat_map(|p| random.cloud(8, p, 0.9 * ones))
        .collect();
    for (name, cloud) in [
        ("scattered", scattered),
        ("clustered", clustered),
        ("planar", planar),
        ("line", line),
        ("on cell walls", on_walls),
        ("coincident", coincident),
        ("far", far),
        ("alias", alias),
    ] {
        assert_neighbours(name, &cloud, 1.0);
        assert_neighbours(name, &cloud, 0.7);
    }
}

#[test]
fn cells_are_floors_and_refuse_what_overflows() {
    assert_eq!(cell_of(Vec3::new(-0.1, 0.0, 2.9), 1.0), Some([-1, 0, 2]));
    assert_eq!(cell_of(Vec3::new(-1.0, -1e-30, 1e8), 1.0), Some([-1, -1, 100_000_000]));
    assert_eq!(cell_of(Vec3::X * 1e9, 1.0), None);
    assert_eq!(cell_of(Vec3::X * f32::NAN, 1.0), None);
    let error = prepare(&input(&[Vec3::ZERO, Vec3::Y * -1e12], 1.0), &Options::default());
    assert!(matches!(error, Err(PrepareError::TooFar { index: 1, size: 4.0, .. })));
}
