//! One frame of a case, and what it left behind.

use super::{Extent, StressError, motion::Moment};
use crate::{
    Camera, Class, FrameInput, Particles, Point, Settings,
    host::{HostError, Session},
    inspect::{self, Inspection, Walk},
    prepare::{self, Input, Options, PrepareError, prepare},
    shader::{OUTCOME_HIT, OUTCOME_SIDE_WALL},
    space::Space,
    srgb::encode_srgb,
    study::search::Walked,
    twin::{
        normal::decode_normal,
        quadric::{pixel_ray, scale_offset},
    },
};
use ash::vk;
use glam::{DVec2, DVec3, Mat3, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// Renders cases on a device.
pub struct Rig<'a, 'b> {
    session: &'a mut Session<'b>,
    /// How much of a sweep is asked for.
    pub(super) extent: Extent,
    /// Truths of frames that several methods are compared with, by what they are of.
    pub(super) truths: HashMap<String, Moment>,
}

/// What is rendered.
pub struct View {
    /// From where.
    pub camera: Camera,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Whether the eye is in the body.
    pub eye_inside: bool,
}

impl View {
    /// 160 x 120 pixels, so many degrees high.
    pub fn new(eye: DVec3, target: DVec3, up: DVec3, fov_y: f64) -> View {
        View::sized([160, 120], eye, target, up, fov_y)
    }

    /// Of another size.
    pub fn sized(size: [u32; 2], eye: DVec3, target: DVec3, up: DVec3, fov_y: f64) -> View {
        let aspect = size[0] as f32 / size[1] as f32;
        let fov_y = fov_y.to_radians() as f32;
        let camera = Camera::look_at(eye.as_vec3(), target.as_vec3(), up.as_vec3(), fov_y, aspect, 0.05);
        View { camera, size, eye_inside: false }
    }
}

/// What a frame left behind.
pub struct Shot {
    /// Linear light, row by row.
    pub picture: Vec<[f32; 3]>,
    /// Depth of the nearest surface at each pixel; 0: none; negative: the near plane lies within a particle. `None` where the
    /// method's surfaces have another size than the picture.
    pub front: Option<Vec<f64>>,
    /// Outward world normals there.
    normals: Vec<Option<DVec3>>,
    /// What walks went through and met.
    pub walked: Walked,
    from_eye: Mat3,
    eye: DVec3,
}

impl<'a, 'b> Rig<'a, 'b> {
    /// On a session, whose environment is what is seen.
    pub fn new(session: &'a mut Session<'b>) -> Rig<'a, 'b> {
        Rig { session, extent: Extent::Full, truths: HashMap::new() }
    }

    /// A frame of particles of radius `radius` that the CPU prepares.
    pub fn shoot(
        &mut self,
        positions: &[Vec3],
        radius: f32,
        view: &View,
        settings: &Settings,
    ) -> Result<Shot, StressError> {
        let (particles, _) = prepare(&Input::new(positions, radius), &Options::default())?;
        let input = Input::new(positions, radius);
        let points = is_field(settings).then(|| prepare::points(&input, &Options::default())).transpose()?;
        Ok(self.frame(&particles, points.as_deref(), view, settings)?)
    }

    /// A frame of particles as they are.
    pub fn draw(&mut self, particles: &Particles, view: &View, settings: &Settings) -> Result<Shot, StressError> {
        let points = is_field(settings).then(|| points(particles)).transpose()?;
        Ok(self.frame(particles, points.as_deref(), view, settings)?)
    }

    fn frame(
        &mut self,
        particles: &Particles,
        points: Option<&[Point]>,
        view: &View,
        settings: &Settings,
    ) -> Result<Shot, HostError> {
        let session = &mut *self.session;
        session.renderer.set_particles(particles)?;
        if let Some(points) = points {
            session.renderer.set_points(points)?;
        }
        let walks = Walk::of(&settings.method.optics).is_some();
        session.renderer.inspect(Inspection { walks, ..Inspection::default() });
        session.resize(view.size)?;
        let input = FrameInput::new(0, &view.camera, settings, vk::ImageView::null()).eye_inside(view.eye_inside);
        session.frame(&input)?;
        let space = Space::of(particles);
        let bounds = particles.bounds().unwrap_or_default();
        let mut frame = inspect::uniforms(&view.camera, settings, view.size, &space, bounds);
        frame.eye_inside = f32::from(view.eye_inside);
        let from_eye = Mat3::from_mat4(view.camera.view).transpose();
        let eye = view.camera.view.as_dmat4().inverse().w_axis.truncate();
        let picture = session.picture()?;
        let walked = Walked::read(session, frame, settings, particles)?;
        let mut shot = Shot { picture, front: None, normals: Vec::new(), walked, from_eye, eye };
        match shot.walked.field {
            Some(_) => shot.take_field(),
            None => shot.take_front(space.radius),
        }
        Ok(shot)
    }
}

fn is_field(settings: &Settings) -> bool {
    settings.method.layers.field().is_some()
}

/// What a density field is made of: particles where they are drawn, in the classes that they have.
fn points(particles: &Particles) -> Result<Vec<Point>, PrepareError> {
    let positions: Vec<Vec3> = particles.ellipsoids.iter().map(|e| e.center).collect();
    let class = |i| if i < particles.splash_count { Class::Splash } else { Class::Body };
    let classes: Vec<Class> = (0..positions.len()).map(class).collect();
    prepare::points(&Input::new(&positions, particles.radius).classes(Some(&classes)), &Options::default())
}

impl Shot {
    /// The nearer of both classes' fronts.
    fn take_front(&mut self, radius: f64) {
        let count = self.picture.len();
        let [splash, body] = self.walked.maps.each_ref().map(|class| &class[0]);
        if [splash, body].iter().any(|m| !m.0.is_empty() && m.0.len() != count) {
            return;
        }
        let (mut front, mut normals) = (vec![0.0; count], vec![None; count]);
        for i in 0..count {
            for (depth, normal) in [splash, body] {
                let d = depth.get(i).map_or(0.0, |d| f64::from(*d) * radius);
                if d != 0.0 && (front[i] == 0.0 || d < front[i]) {
                    let code = normal.get(i).copied().filter(|n| *n != 0);
                    let normal = code.map(|code| (self.from_eye * decode_normal(code)).as_dvec3());
                    (front[i], normals[i]) = (d, normal);
                }
            }
        }
        (self.front, self.normals) = (Some(front), normals);
    }

    /// The field's front, and that of the balls beside it.
    fn take_field(&mut self) {
        let Some(field) = &self.walked.field else { return };
        let near = f64::from(self.walked.frame.near) * field.radius();
        let seen = |i: usize| {
            let (eye, dir) = self.ray(i);
            let per_depth = 1.0 / -self.view_ray(i).normalize().z;
            if field.holds(eye + near * per_depth * dir) {
                return (-near, None);
            }
            field.first(eye, dir).map_or((0.0, None), |(t, normal)| (t / per_depth, Some(normal)))
        };
        let all: (Vec<_>, Vec<_>) = (0..self.picture.len()).into_par_iter().map(seen).unzip();
        (self.front, self.normals) = (Some(all.0), all.1);
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.walked.frame.size.x as usize
    }

    /// The eye, and the unit direction of a pixel's ray, in the world.
    pub fn ray(&self, i: usize) -> (DVec3, DVec3) {
        let v = self.view_ray(i);
        (self.eye, (self.from_eye.as_dmat3() * v).normalize())
    }

    /// The direction of a pixel's ray in eye space, of depth 1.
    fn view_ray(&self, i: usize) -> DVec3 {
        pixel_ray(&self.walked.frame, (i % self.width()) as u32, (i / self.width()) as u32)
    }

    /// The pixel on which a point of the world lies, if it is in the view.
    pub fn pixel_of(&self, at: DVec3) -> Option<usize> {
        let x = self.from_eye.as_dmat3().transpose() * (at - self.eye);
        let (scale, origin) = scale_offset(&self.walked.frame);
        let p = (scale * x.truncate() / -x.z + origin).floor();
        let size = self.walked.frame.size.as_dvec2();
        let seen = x.z < 0.0 && p.cmpge(DVec2::ZERO).all() && p.cmplt(size).all();
        seen.then(|| p.y as usize * self.width() + p.x as usize)
    }

    /// Where a pixel's ray meets the front, in the world.
    pub fn at(&self, i: usize) -> Option<DVec3> {
        let d = self.front.as_ref().map(|f| f[i]).filter(|d| *d > 0.0)?;
        Some(self.eye + self.from_eye.as_dmat3() * (d * self.view_ray(i)))
    }

    /// The front's outward normal, in the world.
    pub fn normal(&self, i: usize) -> Option<DVec3> {
        self.normals.get(i).copied().flatten()
    }

    /// Whether there is liquid at a pixel; `None` where the method does not say.
    pub fn covered(&self, i: usize) -> Option<bool> {
        if !self.walked.walks.is_empty() {
            return Some(self.walked.met(i));
        }
        self.front.as_ref().map(|f| f[i] != 0.0)
    }

    /// Where a complete walk went, in the world.
    pub fn direction(&self, i: usize) -> Option<DVec3> {
        let outcome = *self.walked.walks.get(4 * i + 1)? as u32;
        self.walked.last_direction(i).filter(|_| outcome == OUTCOME_HIT || outcome == OUTCOME_SIDE_WALL)
    }

    /// What a walk met: pattern, outcome, walls, length inside.
    pub fn walk(&self, i: usize) -> Option<&[f32]> {
        self.walked.walks.get(4 * i..4 * i + 4)
    }

    /// Pixels with a value that is not finite.
    pub fn no_number(&self) -> f64 {
        let whole = |i: usize| {
            self.picture[i].iter().all(|v| v.is_finite())
                && self.walk(i).is_none_or(|w| w.iter().all(|v| v.is_finite()))
                && self.walked.directions.get(4 * i..4 * i + 4).is_none_or(|d| d.iter().all(|v| v.is_finite()))
        };
        (0..self.picture.len()).filter(|i| !whole(*i)).count() as f64
    }

    /// The picture as a screen shows it, 0 to 1.
    pub fn shown(&self) -> Vec<Vec3> {
        self.picture.iter().map(|c| Vec3::from(c.map(encode_srgb))).collect()
    }
}

/// Largest difference of the three channels.
pub fn apart(a: Vec3, b: Vec3) -> f64 {
    f64::from((a - b).abs().max_element())
}
