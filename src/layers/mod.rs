//! Which surfaces are kept of the particles: maps of linear depth and normals, nearest fronts and farthest backs.

pub mod dense_grid;
pub mod field;
pub mod front;
pub mod nearest_farthest;
mod splat;
pub mod split;

use crate::{
    method::Offers,
    optics::tiles::Tiles,
    parameters::family,
    passes::{Drawn, Points},
    plan::{Plan, Target},
    scene::Scene,
};

family! {
    /// Which surfaces are kept of the particles.
    pub enum Layers: Layering {
        Split(split) = "split",
        NearestFarthest(nearest_farthest) = "nearest-farthest",
        Front(front) = "front",
        Field(field) = "field",
        DenseGrid(dense_grid) = "dense-grid",
    }
}

/// A member of the family.
pub(crate) trait Layering {
    /// What its maps can be asked for.
    fn offers(&self) -> Offers;
    /// What they are.
    fn kind(&self) -> Kind<'_>;
}

/// What layers are.
pub(crate) enum Kind<'a> {
    /// Maps of a view, of particles drawn.
    Maps(&'a dyn Mapping),
    /// A field around the particles, whatever the view.
    Field(&'a dyn Filling),
}

impl Layers {
    /// The density field that they are, if they are one, whatever fills it.
    pub fn field(&self) -> Option<field::Field> {
        match self.member().kind() {
            Kind::Maps(_) => None,
            Kind::Field(filling) => Some(filling.field()),
        }
    }
}

/// Layers that are a density field.
pub(crate) trait Filling {
    /// Which.
    fn field(&self) -> field::Field;
    /// Builds it.
    fn record(&self, plan: &mut Plan, scene: &Scene, points: &Points) -> field::Volume;
}

/// Layers that are maps of a view.
pub(crate) trait Mapping {
    /// Whether particles of the body that others hide may be left out.
    fn may_cull(&self, scene: &Scene) -> bool;
    /// Draws them.
    fn record(&self, plan: &mut Plan, scene: &Scene, drawn: &Drawn) -> Layered;
}

/// What layers are drawn as; what there is nothing of is not there.
#[derive(Clone, Copy)]
pub(crate) struct Layered {
    /// Particles on their own.
    pub splash: Option<Surface>,
    /// Those that form a body, or all of them where the layers do not tell them apart: what is smoothed.
    pub body: Option<Body>,
    /// Length of view rays inside particles, in particle radii, all of them added (`R32_SFLOAT`, no layers).
    pub thickness: Option<Target>,
    /// Speed of the particle in front, in world units a second (`R32_SFLOAT`, no layers); 0 where there is none.
    pub speed: Option<Target>,
}

/// A surface before it is smoothed.
#[derive(Clone, Copy)]
pub(crate) struct Body {
    /// As of [`Surface::depth`].
    pub depth: Target,
    /// As of [`Surface::normal`], of the particles; not all layers have them.
    pub normal: Option<Target>,
    /// Layers: 1 or 2.
    pub sides: u32,
}

impl From<Surface> for Body {
    fn from(s: Surface) -> Body {
        Body { depth: s.depth, normal: Some(s.normal), sides: s.sides }
    }
}

/// The liquid's surfaces, smoothed; classes without particles have none.
#[derive(Clone, Copy, Default)]
pub(crate) struct Surfaces {
    pub splash: Option<Surface>,
    pub body: Option<Surface>,
    /// As of [`Layered::thickness`].
    pub thickness: Option<Target>,
    /// As of [`Layered::speed`].
    pub speed: Option<Target>,
    /// Where in the view there may be any, if the optics ask: only of maps.
    pub tiles: Option<Tiles>,
    /// Where the surface is that of a density field.
    pub field: Option<field::Volume>,
}

#[cfg(feature = "inspect")]
impl Surfaces {
    /// What its targets are called.
    pub fn names(&self, plan: &Plan) -> crate::plan::SurfaceNames {
        let name = |target| plan.resource(target).name;
        crate::plan::SurfaceNames {
            splash_depth: self.splash.map(|s| name(s.depth)),
            splash_normal: self.splash.map(|s| name(s.normal)),
            body_depth: self.body.map(|s| name(s.depth)),
            body_normal: self.body.map(|s| name(s.normal)),
        }
    }
}

/// Maps of one class. Layer 0 is the nearest front, layer 1, if there is one, the farthest back.
#[derive(Clone, Copy)]
pub(crate) struct Surface {
    /// Linear depth in particle radii; 0: no surface; negative: the near plane lies inside a particle.
    pub depth: Target,
    /// Outward unit normals in eye space (`glsl/include/normal.glsl`).
    pub normal: Target,
    /// Layers: 1 or 2.
    pub sides: u32,
}
