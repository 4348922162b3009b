//! How a liquid is drawn: one member of each family, and which go together.

use crate::{Error, layers::Layers, optics::Optics, parameters::Part, smooth::Smooth};

/// Layers of surfaces, their smoothing, and the optics between them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct Method {
    /// Which surfaces are kept of the particles.
    pub layers: Layers,
    /// How they are smoothed.
    pub smooth: Smooth,
    /// How light goes through them.
    pub optics: Optics,
}

impl Default for Method {
    /// Ours: a density field.
    fn default() -> Self {
        PRESETS[0].method()
    }
}

/// What layers have to offer, and smoothing and optics ask for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Offers {
    /// Maps of depths in a view.
    pub maps: bool,
    /// The far side of the liquid.
    pub backs: bool,
    /// Normals of the particles' own surfaces.
    pub normals: bool,
    /// How much liquid there is along each view ray, all particles' shares added.
    pub thickness: bool,
    /// Surfaces at half the picture's width and height. Not together with the thickness, which is measured up to the host's
    /// scene, pixel by pixel of the picture.
    pub half: bool,
    /// How fast the particles in front are.
    pub speeds: bool,
    /// Surfaces beyond what the view shows.
    pub beyond: bool,
}

impl Offers {
    const WORDS: [&'static str; 7] = [
        "maps of depths",
        "the far side of the liquid",
        "the particles' own normals",
        "the liquid's thickness",
        "surfaces at half the picture's resolution",
        "the particles' speeds",
        "surfaces that the view does not show (for many, and for trace_reflections above 0)",
    ];

    fn all(self) -> [bool; 7] {
        [self.maps, self.backs, self.normals, self.thickness, self.half, self.speeds, self.beyond]
    }

    /// What either of two asks for.
    fn or(self, b: Offers) -> Offers {
        Offers {
            maps: self.maps || b.maps,
            backs: self.backs || b.backs,
            normals: self.normals || b.normals,
            thickness: self.thickness || b.thickness,
            half: self.half || b.half,
            speeds: self.speeds || b.speeds,
            beyond: self.beyond || b.beyond,
        }
    }
}

impl Method {
    /// One member of each family; [`Method::validate`] says whether they go together.
    pub fn new(layers: impl Into<Layers>, smooth: impl Into<Smooth>, optics: impl Into<Optics>) -> Method {
        Method { layers: layers.into(), smooth: smooth.into(), optics: optics.into() }
    }

    /// Checks every parameter, and that the three go together.
    pub fn validate(&self) -> Result<(), Error> {
        self.layers.parameters().validate()?;
        self.smooth.parameters().validate()?;
        self.optics.parameters().validate()?;
        let offered = self.layers.member().offers();
        let asked = [
            ("smooth", self.smooth.name(), self.smooth.member().asks()),
            ("optics", self.optics.name(), self.optics.member().asks()),
        ];
        for (family, name, asks) in asked {
            let lacking = asks.all().into_iter().zip(offered.all()).position(|(asks, has)| asks && !has);
            if let Some(i) = lacking {
                let having = |l: &Layers| l.member().offers().all()[i];
                let others: Vec<_> = Layers::all().iter().filter(|l| having(l)).map(Layers::name).collect();
                let remedy = format!(
                    "it needs {}, which the layers {} do not have: use {}",
                    Offers::WORDS[i],
                    self.layers.name(),
                    others.join(" or ")
                );
                return Err(Error::parameter(family, name, remedy));
            }
        }
        Ok(())
    }

    /// What smoothing and optics ask of the layers.
    pub(crate) fn asks(&self) -> Offers {
        self.smooth.member().asks().or(self.optics.member().asks())
    }

    /// The families, by the names of their fields.
    pub fn families() -> Vec<Part> {
        vec![Layers::part("layers"), Smooth::part("smooth"), Optics::part("optics")]
    }

    /// Which member of each family this is: names of the families and of the members.
    pub fn members(&self) -> [(&'static str, &'static str); 3] {
        [("layers", self.layers.name()), ("smooth", self.smooth.name()), ("optics", self.optics.name())]
    }

    /// Takes another member of a family, with its default parameters; the one that is there already stays as it is.
    pub fn choose(&mut self, family: &str, member: &str) -> Result<(), Error> {
        if self.members().contains(&(family, member)) {
            return Ok(());
        }
        let known = match family {
            "layers" => Layers::named(member).map(|m| self.layers = m).ok_or(Layers::NAMES),
            "smooth" => Smooth::named(member).map(|m| self.smooth = m).ok_or(Smooth::NAMES),
            "optics" => Optics::named(member).map(|m| self.optics = m).ok_or(Optics::NAMES),
            _ => return Err(Error::parameter("family", family, "there are layers, smooth and optics")),
        };
        known.map_err(|names| {
            Error::parameter("member of a family", member, format!("{family} has {}", names.join(", ")))
        })
    }

    /// The published method of this name.
    pub fn preset(name: &str) -> Option<Method> {
        PRESETS.iter().find(|p| p.name == name).map(Preset::method)
    }
}

/// A published method: nothing but choices.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Preset {
    /// Short name of the paper.
    pub name: &'static str,
    /// Names of the members it is made of.
    pub members: [&'static str; 3],
    /// Where their defaults are not the paper's: parameter and value.
    pub values: &'static [(&'static str, &'static str)],
}

/// Ours (`field`), and the published methods; the first is what is drawn when nothing is said.
pub const PRESETS: &[Preset] = &[
    // Walls everywhere, from a density field: of all these the nearest to the truth, and none of those near it is faster.
    // The exact Fresnel equations cost it nothing that can be measured.
    Preset { name: "field", members: ["field", "none", "four"], values: &[("fresnel", "exact")] },
    Preset { name: "imai16", members: ["split", "plane-fit", "four"], values: &[] },
    // Reflections inside are followed by none of the papers; the default of `four` goes beyond its own.
    Preset {
        name: "imai14",
        members: ["nearest-farthest", "bilateral", "two"],
        values: &[("internal_reflections", "0")],
    },
    // Their grid and its one refraction; rays find its level where they splat surfels of it, and shares are volume-normalised as ours.
    Preset { name: "iwasaki06", members: ["dense-grid", "none", "one"], values: &[] },
    Preset { name: "cords08", members: ["front", "binomial", "instant-liquids"], values: &[] },
    Preset { name: "green10", members: ["front", "bilateral-separable", "ssfr"], values: &[] },
    Preset { name: "im16", members: ["front", "bilateral-separable", "ssfr-index"], values: &[] },
    // Not the authors' program to the letter: what has no surface is left out of averages, because it has no depth.
    Preset { name: "narrow-range", members: ["front", "narrow-range", "ssfr"], values: &[] },
    Preset { name: "curvature-flow", members: ["front", "curvature-flow", "ssfr"], values: &[] },
];

impl Preset {
    /// The choices it stands for.
    pub fn method(&self) -> Method {
        let [layers, smooth, optics] = self.members;
        let made = || {
            let mut method = Method {
                layers: Layers::named(layers)?,
                smooth: Smooth::named(smooth)?,
                optics: Optics::named(optics)?,
            };
            for (name, value) in self.values {
                method.set(name, value).ok()?;
            }
            Some(method)
        };
        // A test makes each of them.
        made().unwrap_or_else(|| panic!("the preset {} names what is not there", self.name))
    }
}

impl Method {
    /// Sets a parameter of whichever member has it, from text.
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), Error> {
        let mut known = Vec::new();
        for member in [self.layers.parameters_mut(), self.smooth.parameters_mut(), self.optics.parameters_mut()] {
            let own = member.parameters();
            if own.iter().any(|p| p.name == name) {
                return member.set(name, text);
            }
            known.extend(own);
        }
        Err(crate::parameters::unknown(name, &known))
    }
}
