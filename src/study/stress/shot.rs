//! One frame of a case, and what it left behind.

use super::StressError;
use crate::{
    Camera, Class, FrameInput, Particles, Point, Settings,
    host::{HostError, Session},
    inspect::{self, Inspection, Walk},
    layers::Layers,
    prepare::{self, Input, Options, PrepareError, prepare},
    shader::{Frame, OUTCOME_HIT, OUTCOME_NO_LIQUID, OUTCOME_SIDE_WALL},
    space::Space,
    srgb::encode_srgb,
    twin::{
        normal::decode_normal,
        quadric::{pixel_ray, scale_offset},
    },
};
use ash::vk;
use glam::{DVec2, DVec3, Mat3, Vec3};

/// Renders cases on a device.
pub struct Rig<'a, 'b> {
    session: &'a mut Session<'b>,
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
    normals: Vec<u32>,
    /// What walks met, four values a pixel, and where they went; empty without walks.
    walks: Vec<f32>,
    directions: Vec<f32>,
    /// The maps that walks go through: by class and side, depths and normals.
    pub maps: [[(Vec<f32>, Vec<u32>); 2]; 2],
    pub frame: Frame,
    from_eye: Mat3,
    eye: DVec3,
}

impl<'a, 'b> Rig<'a, 'b> {
    /// On a session, whose environment is what is seen.
    pub fn new(session: &'a mut Session<'b>) -> Rig<'a, 'b> {
        Rig { session }
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
        let names = session.renderer.surfaces();
        let mut read = |name: Option<&'static str>, side| -> Result<Vec<u32>, HostError> {
            Ok(name.map(|n| session.words(n, side)).transpose()?.flatten().unwrap_or_default())
        };
        let floats = |words: Vec<u32>| -> Vec<f32> { words.into_iter().map(f32::from_bits).collect() };
        let mut maps: [[(Vec<f32>, Vec<u32>); 2]; 2] = Default::default();
        let named = [(names.splash_depth, names.splash_normal), (names.body_depth, names.body_normal)];
        for (class, (depth, normal)) in named.into_iter().enumerate() {
            for (side, map) in (0..).zip(&mut maps[class]) {
                *map = (floats(read(depth, side)?), read(normal, side)?);
            }
        }
        let met = floats(read(Some("walk (debug)").filter(|_| walks), 0)?);
        let directions = floats(read(Some("final direction (debug)").filter(|_| walks), 0)?);
        let space = Space::of(particles);
        let bounds = particles.bounds().unwrap_or_default();
        let mut frame = inspect::uniforms(&view.camera, settings, view.size, &space, bounds);
        frame.eye_inside = f32::from(view.eye_inside);
        let from_eye = Mat3::from_mat4(view.camera.view).transpose();
        let eye = view.camera.view.as_dmat4().inverse().w_axis.truncate();
        let mut shot = Shot {
            picture: session.picture()?,
            front: None,
            normals: Vec::new(),
            walks: met,
            directions,
            maps,
            frame,
            from_eye,
            eye,
        };
        shot.take_front(space.radius);
        Ok(shot)
    }
}

fn is_field(settings: &Settings) -> bool {
    matches!(settings.method.layers, Layers::Field(_))
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
        let [splash, body] = self.maps.each_ref().map(|class| &class[0]);
        if [splash, body].iter().any(|m| !m.0.is_empty() && m.0.len() != count) {
            return;
        }
        let (mut front, mut normals) = (vec![0.0; count], vec![0; count]);
        for i in 0..count {
            for (depth, normal) in [splash, body] {
                let d = depth.get(i).map_or(0.0, |d| f64::from(*d) * radius);
                if d != 0.0 && (front[i] == 0.0 || d < front[i]) {
                    (front[i], normals[i]) = (d, normal.get(i).copied().unwrap_or(0));
                }
            }
        }
        (self.front, self.normals) = (Some(front), normals);
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.frame.size.x as usize
    }

    /// The eye, and the unit direction of a pixel's ray, in the world.
    pub fn ray(&self, i: usize) -> (DVec3, DVec3) {
        let v = self.view_ray(i);
        (self.eye, (self.from_eye.as_dmat3() * v).normalize())
    }

    /// The direction of a pixel's ray in eye space, of depth 1.
    fn view_ray(&self, i: usize) -> DVec3 {
        pixel_ray(&self.frame, (i % self.width()) as u32, (i / self.width()) as u32)
    }

    /// The pixel on which a point of the world lies, if it is in the view.
    pub fn pixel_of(&self, at: DVec3) -> Option<usize> {
        let x = self.from_eye.as_dmat3().transpose() * (at - self.eye);
        let (scale, origin) = scale_offset(&self.frame);
        let p = (scale * x.truncate() / -x.z + origin).floor();
        let size = self.frame.size.as_dvec2();
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
        let code = self.normals.get(i).copied().filter(|n| *n != 0)?;
        Some((self.from_eye * decode_normal(code)).as_dvec3())
    }

    /// Whether there is liquid at a pixel; `None` where the method does not say.
    pub fn covered(&self, i: usize) -> Option<bool> {
        if !self.walks.is_empty() {
            return Some(self.walks[4 * i + 1] as u32 != OUTCOME_NO_LIQUID);
        }
        self.front.as_ref().map(|f| f[i] != 0.0)
    }

    /// Where a walk went in the end, complete or not, in the world.
    pub fn last_direction(&self, i: usize) -> Option<DVec3> {
        self.directions.get(4 * i..4 * i + 3).map(|d| Vec3::from_slice(d).as_dvec3())
    }

    /// Where a complete walk went, in the world.
    pub fn direction(&self, i: usize) -> Option<DVec3> {
        let outcome = *self.walks.get(4 * i + 1)? as u32;
        self.last_direction(i).filter(|_| outcome == OUTCOME_HIT || outcome == OUTCOME_SIDE_WALL)
    }

    /// What a walk met: pattern, outcome, walls, length inside.
    pub fn walk(&self, i: usize) -> Option<&[f32]> {
        self.walks.get(4 * i..4 * i + 4)
    }

    /// Pixels with a value that is not finite.
    pub fn no_number(&self) -> f64 {
        let whole = |i: usize| {
            self.picture[i].iter().all(|v| v.is_finite())
                && self.walk(i).is_none_or(|w| w.iter().all(|v| v.is_finite()))
                && self.directions.get(4 * i..4 * i + 4).is_none_or(|d| d.iter().all(|v| v.is_finite()))
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

/// Angle between two directions, in degrees.
pub fn degrees(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}
