//! A method's walk beside an exact search in the method's own maps or field: its CPU twin, which marches in small steps and bisects.

use super::built_field::BuiltField;
use crate::{
    Equirect, Particles, Settings,
    host::{HostError, Session},
    inspect::Walk,
    shader::{Frame, OUTCOME_NO_LIQUID},
    space::Space,
    twin::{
        field_walk,
        walk::walk,
        walls::{Map, Maps},
    },
};
use glam::DVec3;
use rayon::prelude::*;

/// By class, then side: depths and normals.
pub type OwnMaps = [[(Vec<f32>, Vec<u32>); 2]; 2];

/// What walks of a frame went through, and where they went.
pub struct Walked {
    /// The block that shaders read.
    pub frame: Frame,
    /// The maps that walks go through.
    pub maps: OwnMaps,
    /// Or the field.
    pub field: Option<BuiltField>,
    space: Space,
    /// Pattern, outcome, walls and length, four values a pixel; empty without walks.
    pub walks: Vec<f32>,
    /// World directions in the end, four values a pixel.
    pub directions: Vec<f32>,
}

/// How far the search is off.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SearchError {
    /// Share of the liquid's pixels whose final direction is off by more than a degree.
    pub missed: f64,
    /// Angle between the final directions in degrees: the median.
    pub angle: f64,
    /// Pixels that were looked at.
    pub pixels: usize,
}

/// From so many degrees on another wall was met.
pub const MISSED: f64 = 1.0;

impl Walked {
    /// Of the last frame, which was told to write what walks met (`Inspection::walks`). `frame` is the block that shaders read.
    pub fn read(
        session: &mut Session,
        frame: Frame,
        settings: &Settings,
        particles: &Particles,
    ) -> Result<Walked, HostError> {
        let names = session.renderer.surfaces();
        let mut read = |name: Option<&'static str>, side| -> Result<Vec<u32>, HostError> {
            Ok(name.map(|n| session.words(n, side)).transpose()?.flatten().unwrap_or_default())
        };
        let floats = |words: Vec<u32>| -> Vec<f32> { words.into_iter().map(f32::from_bits).collect() };
        let mut maps = OwnMaps::default();
        let named = [(names.splash_depth, names.splash_normal), (names.body_depth, names.body_normal)];
        for (class, (depth, normal)) in named.into_iter().enumerate() {
            for (side, map) in (0..).zip(&mut maps[class]) {
                *map = (floats(read(depth, side)?), read(normal, side)?);
            }
        }
        let walks = floats(read(Some("walk (debug)"), 0)?);
        let directions = floats(read(Some("final direction (debug)"), 0)?);
        let field = match settings.method.layers.field() {
            Some(field) => BuiltField::read(session, &field, particles.radius)?,
            None => None,
        };
        let space = super::built_field::space(session, particles)?;
        Ok(Walked { frame, maps, field, space, walks, directions })
    }

    /// Whether the walk of a pixel met liquid.
    pub fn met(&self, pixel: usize) -> bool {
        self.walks.get(4 * pixel + 1).is_some_and(|outcome| *outcome as u32 != OUTCOME_NO_LIQUID)
    }

    /// Where a walk went in the end, complete or not, in the world.
    pub fn last_direction(&self, pixel: usize) -> Option<DVec3> {
        let d = self.directions.get(4 * pixel..4 * pixel + 3)?;
        Some(DVec3::new(d[0].into(), d[1].into(), d[2].into()))
    }

    /// Of pixels that met liquid: angles in degrees between where the method's walk and the twin's went. Nothing of optics that follow
    /// no rays.
    pub fn off(&self, settings: &Settings, sky: &Equirect, pixels: &[usize]) -> Vec<f64> {
        let maps = self.maps.each_ref().map(|class| class.each_ref().map(|(depth, normal)| Map { depth, normal }));
        let maps = Maps { frame: &self.frame, maps, scene: None };
        let field: Option<field_walk::Field> = self.field.as_ref().map(|f| f.twin(&self.space));
        // Through maps the twin knows optics that have fronts alone, or a body's both sides.
        let known = |w: &Walk| field.is_some() || w.refractions == 1 || !maps.maps[1][1].depth.is_empty();
        let Some(rays) = Walk::of(&settings.method.optics).filter(known) else { return Vec::new() };
        let width = self.frame.size.x as usize;
        let off = |pixel: &usize| {
            let at = [pixel % width, pixel / width];
            let twin = match &field {
                Some(field) => field_walk::walk(field, &maps, &rays, sky, at),
                None => walk(&maps, &rays, sky, at),
            };
            self.last_direction(*pixel).map(|d| degrees(d, twin.direction))
        };
        pixels.par_iter().filter(|i| self.met(**i)).filter_map(off).collect()
    }

    /// The same in short, of about so many of the liquid's pixels, which lie everywhere in the picture.
    pub fn error(&self, settings: &Settings, sky: &Equirect, most: usize) -> Option<SearchError> {
        let met: Vec<usize> = (0..self.walks.len() / 4).filter(|i| self.met(*i)).collect();
        let chosen: Vec<usize> = met.iter().step_by(met.len().div_ceil(most).max(1)).copied().collect();
        let mut off = self.off(settings, sky, &chosen);
        let pixels = off.len();
        off.sort_by(f64::total_cmp);
        let angle = *off.get(pixels / 2)?;
        // What is no number is missed too.
        let missed = off.iter().filter(|a| a.is_nan() || **a > MISSED).count() as f64 / pixels as f64;
        Some(SearchError { missed, angle, pixels })
    }
}

/// Angle between two directions, in degrees.
pub fn degrees(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}
