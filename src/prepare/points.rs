//! What a density field is made of: particles where they are, with their number density.

use super::{Input, Options, PrepareError, check_lengths, check_positions, density, neighbours::Grid, options::Scale};
use crate::particles::Point;

/// Each particle where it is, with its number density and class, in canonical order: what [`crate::layers::field`] is made of,
/// for [`crate::Renderer::set_points`]. Ellipsoids of the input's count for nothing.
pub fn points(input: &Input, options: &Options) -> Result<Vec<Point>, PrepareError> {
    let scale = Scale::new(input.radius, options)?;
    check_lengths("classes", input.classes.map(<[_]>::len), input.positions.len())?;
    check_positions(input.positions)?;
    let class = |i: u32| input.classes.map(|given| given[i as usize] as u8);
    let grid = Grid::new(input.positions, scale.support, |a, b| class(a).cmp(&class(b)))?;
    let densities = density::relative_densities(&grid, scale, options.search);
    let point = |((&position, &index), density): ((_, &u32), f64)| {
        let class = input.classes.map_or_else(|| density::class_of(density, options), |given| given[index as usize]);
        Point { position, density: density as f32, class }
    };
    Ok(grid.positions.iter().zip(&grid.order).zip(densities).map(point).collect())
}
