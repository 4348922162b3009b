//! Twin of `glsl/optics/lookup.frag`: one refraction as a look-up in what lies behind (Green10, Im16, Cords08).

use super::{Lookup, Mode};
use crate::{
    Fresnel,
    shader::Frame,
    twin::{
        background::Scene,
        normal::decode_normal,
        optics::fresnel,
        quadric::{pixel_ray, scale_offset},
    },
};
use glam::{DVec2, DVec3, Mat3, Vec3};

/// What the pass reads.
#[derive(Clone, Copy)]
pub struct Input<'a> {
    /// The block that shaders read.
    pub frame: &'a Frame,
    /// Front depths of the liquid, row by row, in particle radii.
    pub depth: &'a [f32],
    /// Their normals (`glsl/include/normal.glsl`).
    pub normal: &'a [u32],
    /// Length of liquid along each view ray; empty where the optics do not ask for it.
    pub thickness: &'a [f32],
    /// The host's scene, and whether the picture is the host's too.
    pub scene: Option<Scene<'a>>,
    /// Light from a direction of the environment's own space.
    pub environment: &'a (dyn Fn(DVec3) -> Vec3 + Sync),
}

/// One pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Its light; `None` where the host's picture stays.
    pub color: Option<Vec3>,
    /// Whether liquid is seen.
    pub liquid: bool,
    /// How far the look-ups' positions lie from the edge between two pixels of the host's, at least, in pixels.
    pub edge: f64,
}

/// Snell's law (Cords08 eqs. 6 and 7): k = 1 - η² (1 - (v·n)²), t = η v - (η (v·n) + √k) n. There is always a t into water.
pub fn snell(v: DVec3, n: DVec3, eta: f64) -> DVec3 {
    let cosine = v.dot(n);
    let k = 1.0 - eta * eta * (1.0 - cosine * cosine);
    eta * v - (eta * cosine + k.max(0.0).sqrt()) * n
}

/// Share T of the full effect that so much liquid has (Im16 fig. 4).
pub fn share(scale: f32, thickness: f64) -> f64 {
    1.0 - (-f64::from(scale) * thickness).exp()
}

impl Input<'_> {
    fn index(&self, pixel: [usize; 2]) -> usize {
        pixel[1] * self.frame.size.x as usize + pixel[0]
    }

    /// Light from infinitely far away.
    fn sky(&self, dir: DVec3) -> Vec3 {
        (self.environment)(Mat3::from_mat4(self.frame.eye_to_env).as_dmat3() * dir)
    }

    /// The host's pixel at a position, the next one of the picture where that lies beside it.
    fn host_pixel(&self, at: DVec2, edge: &mut f64) -> [usize; 2] {
        [0, 1].map(|k| {
            let last = f64::from(self.frame.size[k]) - 1.0;
            let border = at[k].round();
            if border > 0.0 && border <= last {
                *edge = edge.min((at[k] - border).abs());
            }
            at[k].floor().clamp(0.0, last) as usize
        })
    }

    /// What lies behind the liquid at a position of the picture.
    fn seen_at(&self, at: DVec2, edge: &mut f64) -> Vec3 {
        if let Some(scene) = &self.scene {
            let i = self.index(self.host_pixel(at, edge));
            if scene.sky || scene.depth[i].is_finite() {
                return scene.color[i];
            }
        }
        let (scale, origin) = scale_offset(self.frame);
        self.sky(((at - origin) / scale).extend(-1.0).normalize())
    }

    /// What is seen along a direction: the host's own sky where that is in the picture.
    fn infinitely_far(&self, dir: DVec3, edge: &mut f64) -> Vec3 {
        let (scale, origin) = scale_offset(self.frame);
        let at = scale * dir.truncate() / -dir.z + origin;
        let inside = dir.z < 0.0 && at.cmpge(DVec2::ZERO).all() && at.cmplt(self.frame.size.as_dvec2()).all();
        if let Some(scene) = self.scene.filter(|s| s.sky && inside) {
            let i = self.index(self.host_pixel(at, edge));
            if scene.depth[i].is_infinite() {
                return scene.color[i];
            }
        }
        self.sky(dir)
    }

    /// One pixel of the picture.
    pub fn look_up(&self, p: &Lookup, pixel: [usize; 2]) -> Seen {
        let (frame, i) = (self.frame, self.index(pixel));
        let center = DVec2::new(pixel[0] as f64, pixel[1] as f64) + 0.5;
        let v = pixel_ray(frame, pixel[0] as u32, pixel[1] as u32).normalize();
        let depth = f64::from(self.depth[i]);
        let mut edge = f64::INFINITY;
        // Minus the near plane's distance where that lies inside a particle.
        if depth == 0.0 || self.scene.is_some_and(|s| s.depth[i] < depth.abs()) {
            let color = match self.scene {
                Some(scene) if scene.sky => None,
                Some(scene) if scene.depth[i].is_finite() => Some(scene.color[i]),
                _ => Some(self.sky(v)),
            };
            return Seen { color, liquid: false, edge };
        }
        let length = self.thickness.get(i).copied().map_or(0.0, f64::from);
        let absorbed = (-frame.absorption.as_dvec3() * length).exp().as_vec3();
        if depth < 0.0 {
            // There is no surface to bend at.
            return Seen { color: Some(self.seen_at(center, &mut edge) * absorbed), liquid: true, edge };
        }
        let n = decode_normal(self.normal[i]).as_dvec3();
        let n = if v.dot(n) > 0.0 { -n } else { n };
        let ior = f64::from(frame.ior);
        let t = share(p.thickness_scale, length);
        let bent = snell(v, n, 1.0 / ior);
        // Edges of the picture are 1 long, and y is up.
        let moved =
            |by: DVec2| center + f64::from(p.strength) * by * (scale_offset(frame).0.signum() * frame.size.as_dvec2());
        let refracted = match p.mode {
            Mode::Normal => self.seen_at(moved(t * n.truncate()), &mut edge), // Im16 fig. 4
            Mode::Bent => self.seen_at(moved(bent.truncate()), &mut edge),    // Cords08 eq. (8)
            Mode::Index => {
                // Im16 fig. 5: n₁ goes from water's to air's as the liquid gets thicker.
                let r = snell(v, n, (ior + (1.0 - ior) * t) / ior);
                let (scale, origin) = scale_offset(frame);
                if r.z < 0.0 {
                    self.seen_at(scale * r.truncate() / -r.z + origin, &mut edge)
                } else {
                    self.infinitely_far(r, &mut edge)
                }
            }
        };
        let exact = p.fresnel == Fresnel::Exact;
        let reflectance = fresnel(-v.dot(n) as f32, -bent.dot(n) as f32, frame.ior, exact);
        let mirrored = v - 2.0 * v.dot(n) * n;
        let mut color = (refracted * absorbed).lerp(self.infinitely_far(mirrored, &mut edge), reflectance);
        if p.mode == Mode::Bent {
            // Phong's model, the light white and far away.
            let light = Mat3::from_mat4(frame.view).as_dmat3() * p.light.as_dvec3().normalize();
            let [diffuse, specular, shininess] = p.phong.map(f64::from);
            if light.dot(n) > 0.0 {
                let highlight = specular * mirrored.dot(light).max(0.0).powf(shininess);
                color += (diffuse * light.dot(n) + highlight) as f32;
            }
        }
        Seen { color: Some(color), liquid: true, edge }
    }
}
