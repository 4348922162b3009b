//! Parameters, each described once: name, meaning, unit, range and default stand where it is declared, and the command
//! line, scene files, records and checks follow from that.

use crate::Error;
use glam::Vec3;

/// What is known of one parameter.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Parameter {
    /// Name in files and, with hyphens, on the command line.
    pub name: &'static str,
    /// What it is.
    pub doc: &'static str,
    /// Unit of the value that it has; empty where it has none.
    pub unit: &'static str,
    /// The same where the unit hangs on another parameter: each, and when.
    pub units: &'static str,
    /// What it must be, as in "use …".
    pub range: &'static str,
    /// Words to choose from; empty if any value of the range will do.
    pub choices: &'static [&'static str],
    /// Value it has when nothing is said.
    pub default: String,
    /// Value it has.
    pub value: String,
}

/// A group of parameters.
pub trait Parameters {
    /// What they are of.
    fn about(&self) -> &'static str;
    /// Every parameter, in order.
    fn parameters(&self) -> Vec<Parameter>;
    /// Sets one by name, from text; [`Parameters::validate`] checks ranges.
    fn set(&mut self, name: &str, text: &str) -> Result<(), Error>;
    /// Checks every range.
    fn validate(&self) -> Result<(), Error>;
    /// Makes them those of a picture that is rendered at `times` its size and looks the same: what is counted in pixels
    /// changes as it is declared to, and may leave its range.
    fn enlarge(&mut self, times: u32);
}

/// What a parameter can hold.
pub trait Value: Copy + PartialEq {
    /// Words to choose from, if it is a choice.
    const CHOICES: &'static [&'static str] = &[];
    /// From text.
    fn parse(text: &str) -> Option<Self>;
    /// As text, which [`Value::parse`] reads again.
    fn text(self) -> String;
}

macro_rules! plain_value {
    ($($Type:ty),*) => {$(
        impl Value for $Type {
            fn parse(text: &str) -> Option<Self> {
                text.trim().parse().ok()
            }
            fn text(self) -> String {
                self.to_string()
            }
        }
    )*};
}
plain_value!(u32, f32, usize);

impl Value for Option<f32> {
    fn parse(text: &str) -> Option<Self> {
        if text.trim() == "none" { Some(None) } else { f32::parse(text).map(Some) }
    }
    fn text(self) -> String {
        self.map_or("none".into(), f32::text)
    }
}

impl Value for bool {
    const CHOICES: &'static [&'static str] = &["true", "false"];
    fn parse(text: &str) -> Option<Self> {
        text.trim().parse().ok()
    }
    fn text(self) -> String {
        self.to_string()
    }
}

impl Value for Vec3 {
    fn parse(text: &str) -> Option<Self> {
        let parts: Result<Vec<f32>, _> = text.split(',').map(|t| t.trim().parse()).collect();
        <[f32; 3]>::try_from(parts.ok()?).ok().map(Vec3::from_array)
    }
    fn text(self) -> String {
        format!("{},{},{}", self.x, self.y, self.z)
    }
}

/// An enum whose members are words.
macro_rules! choices {
    ($(#[$meta:meta])* pub enum $Name:ident { $($(#[$about:meta])* $Member:ident = $word:literal,)* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[non_exhaustive]
        pub enum $Name { $($(#[$about])* #[cfg_attr(feature = "serde", serde(rename = $word))] $Member,)* }

        impl $crate::parameters::Value for $Name {
            const CHOICES: &'static [&'static str] = &[$($word),*];
            fn parse(text: &str) -> Option<Self> {
                match text { $($word => Some(Self::$Member),)* _ => None }
            }
            fn text(self) -> String {
                match self { $(Self::$Member => $word.into(),)* }
            }
        }
    };
}
pub(crate) use choices;

/// What documentation calls a unit.
macro_rules! unit {
    ("") => {
        "none"
    };
    ($unit:tt) => {
        $unit
    };
}
pub(crate) use unit;

/// A struct of parameters: for each its documentation, type and default, then unit, what it must be, and a check of that.
/// `"a" if other else "b"` is a unit that hangs on another parameter. `enlarged |all, times| …` says what becomes of one that
/// is counted in pixels ([`Parameters::enlarge`]). Attributes in brackets before the struct take the place of
/// `non_exhaustive`.
macro_rules! parameters {
    ($(#[doc = $about:literal])+ pub struct $Name:ident { $($body:tt)* }) => {
        $crate::parameters::parameters! {
            [#[non_exhaustive]]
            $(#[doc = $about])+
            pub struct $Name { $($body)* }
        }
    };
    ([$(#[$meta:meta])*] $(#[doc = $about:literal])+ pub struct $Name:ident { $(
        $(#[doc = $doc:literal])+
        $field:ident: $Type:ty = $default:expr, $unit:tt $(if $when:ident else $other:literal)?, $range:literal
            => $check:expr $(, enlarged |$all:ident, $times:ident| $enlarged:expr)?;
    )* }) => {
        $(#[doc = $about])+
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
        $(#[$meta])*
        pub struct $Name { $(
            $(#[doc = $doc])+
            #[doc = concat!("\n\n", "Unit: ", $crate::parameters::unit!($unit), $(" if `", stringify!($when), "`, else ", $other,)? ". Use ", $range, ". Default: `", stringify!($default), "`.")]
            pub $field: $Type,
        )* }

        impl Default for $Name {
            fn default() -> Self {
                $Name { $($field: $default,)* }
            }
        }

        impl $Name { $(
            #[doc = concat!("The same with another [`", stringify!($Name), "::", stringify!($field), "`].")]
            #[must_use]
            pub fn $field(mut self, value: $Type) -> Self {
                self.$field = value;
                self
            }
        )* }

        #[allow(unused_variables)]
        impl $crate::parameters::Parameters for $Name {
            fn about(&self) -> &'static str {
                concat!($($about,)+).trim_ascii()
            }

            fn parameters(&self) -> Vec<$crate::parameters::Parameter> {
                #[allow(unused_imports)]
                use $crate::parameters::Value;
                let default = Self::default();
                vec![$($crate::parameters::Parameter {
                    name: stringify!($field),
                    doc: concat!($($doc,)+).trim_ascii(),
                    unit: {
                        let unit = $unit;
                        $(let unit = if self.$when { unit } else { $other };)?
                        unit
                    },
                    units: concat!($unit $(, " (if ", stringify!($when), ") or ", $other)?),
                    range: $range,
                    choices: <$Type>::CHOICES,
                    default: default.$field.text(),
                    value: self.$field.text(),
                },)*]
            }

            fn set(&mut self, name: &str, text: &str) -> Result<(), $crate::Error> {
                match name {
                    $(stringify!($field) => {
                        let value = <$Type as $crate::parameters::Value>::parse(text);
                        self.$field = value.ok_or_else(|| {
                            $crate::Error::parameter(stringify!($field), text, concat!("use ", $range))
                        })?;
                        Ok(())
                    })*
                    _ => Err($crate::parameters::unknown(name, &self.parameters())),
                }
            }

            fn validate(&self) -> Result<(), $crate::Error> {
                #[allow(unused_imports)]
                use $crate::parameters::Value;
                $(
                    let check: fn(&$Type) -> bool = $check;
                    if !check(&self.$field) {
                        let text = self.$field.text();
                        return Err($crate::Error::parameter(stringify!($field), text, concat!("use ", $range)));
                    }
                )*
                Ok(())
            }

            fn enlarge(&mut self, times: u32) {
                let before = *self;
                $($({
                    fn enlarged($all: &$Name, $times: u32) -> $Type {
                        $enlarged
                    }
                    self.$field = enlarged(&before, times);
                })?)*
            }
        }
    };
}
pub(crate) use parameters;

/// A parameter that is not there, among those that are.
pub(crate) fn unknown(name: &str, known: &[Parameter]) -> Error {
    let names: Vec<_> = known.iter().map(|p| p.name).collect();
    let there = if names.is_empty() { "there are none".to_owned() } else { format!("there are {}", names.join(", ")) };
    Error::parameter("parameter", name, there)
}

/// What settings consist of, as it can be chosen and set; see [`crate::Settings::parts`].
#[non_exhaustive]
pub struct Part {
    /// Name in files and on the command line.
    pub name: &'static str,
    /// What it decides; empty if its one member says so.
    pub about: &'static str,
    /// The members of a family, by name and with their default parameters; or one without a name, where there is nothing to
    /// choose.
    pub members: Vec<(&'static str, Box<dyn Parameters>)>,
}

impl Part {
    /// Parameters with nothing to choose between.
    pub fn group(name: &'static str, parameters: Box<dyn Parameters>) -> Part {
        Part { name, about: "", members: vec![("", parameters)] }
    }
}

/// A family of methods that do the same work: one enum, each member with parameters of its own in a module of its own.
macro_rules! family {
    ($(#[doc = $about:literal])+ pub enum $Family:ident: $Trait:ident { $($Member:ident($module:ident) = $name:literal,)* }) => {
        $(#[doc = $about])+
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(tag = "name"))]
        #[non_exhaustive]
        pub enum $Family { $(
            #[doc = concat!("`", $name, "`: see [`", stringify!($module), "`].")]
            #[cfg_attr(feature = "serde", serde(rename = $name))]
            $Member($module::$Member),
        )* }

        impl $Family {
            /// Names of the members.
            pub const NAMES: &'static [&'static str] = &[$($name),*];

            /// The family as a part of settings, by the name it has there.
            pub(crate) fn part(name: &'static str) -> $crate::parameters::Part {
                let about = concat!($($about,)+).trim_ascii();
                $crate::parameters::Part { name, about, members: vec![$(($name, Box::new(<$module::$Member>::default()))),*] }
            }

            /// Each member with its default parameters.
            pub fn all() -> Vec<$Family> {
                vec![$($Family::$Member(Default::default())),*]
            }

            /// The member of this name, with its default parameters.
            pub fn named(name: &str) -> Option<$Family> {
                match name { $($name => Some($Family::$Member(Default::default())),)* _ => None }
            }

            /// The member's name.
            pub fn name(&self) -> &'static str {
                match self { $($Family::$Member(_) => $name,)* }
            }

            /// The member's parameters.
            pub fn parameters(&self) -> &dyn $crate::parameters::Parameters {
                match self { $($Family::$Member(p) => p,)* }
            }

            /// The member's parameters, to be changed.
            pub fn parameters_mut(&mut self) -> &mut dyn $crate::parameters::Parameters {
                match self { $($Family::$Member(p) => p,)* }
            }

            pub(crate) fn member(&self) -> &dyn $Trait {
                match self { $($Family::$Member(p) => p,)* }
            }
        }

        $(impl From<$module::$Member> for $Family {
            fn from(member: $module::$Member) -> Self {
                $Family::$Member(member)
            }
        })*
    };
}
pub(crate) use family;
