//! `--method`, a flag for each family and one for each parameter: made from the library's descriptions, so that whatever is
//! added there is here.

use clap::{
    Arg, ArgMatches, Command, FromArgMatches,
    builder::{PossibleValue, PossibleValuesParser},
    parser::ValueSource,
};
use meniscus::{Error, Method, PRESETS, Parameter, Parameters, Preset, Settings, parameters::Part, prepare};
use serde_json::{Map, Value, json};

/// Where nothing is given, the command line knows better than the library, which does not know the liquid's size.
pub const LEFT_OPEN: &str = "absorption";
const LEFT_OPEN_HELP: &str = "; if not given, a light blue that suits the liquid's size";

const METHOD: &str = "method";

/// What was chosen on the command line.
#[derive(Clone, Debug, Default)]
pub struct Choices {
    preset: Option<&'static Preset>,
    /// Families and members.
    members: Vec<(&'static str, String)>,
    /// Parameters and what they are to be.
    values: Vec<(&'static str, String)>,
}

/// A parameter's flag.
struct Flag {
    name: &'static str,
    part: &'static str,
    /// The members that have it, and what it is there.
    of: Vec<(&'static str, Parameter)>,
}

/// All there is to choose and to set: how particles are prepared, and the frame's settings.
fn parts() -> Vec<Part> {
    let mut parts = Settings::parts();
    parts.push(Part::group("preparation", Box::<prepare::Options>::default()));
    parts
}

/// A flag for every parameter of every member.
fn flags() -> Vec<Flag> {
    let mut flags: Vec<Flag> = Vec::new();
    for part in parts() {
        for (member, parameters) in &part.members {
            for p in parameters.parameters() {
                match flags.iter_mut().find(|f| f.name == p.name) {
                    Some(flag) => flag.of.push((member, p)),
                    None => flags.push(Flag { name: p.name, part: part.name, of: vec![(member, p)] }),
                }
            }
        }
    }
    flags
}

fn kebab(name: &str) -> String {
    name.replace('_', "-")
}

impl Flag {
    /// A line for each meaning it has.
    fn help(&self) -> String {
        let mut lines: Vec<(String, Vec<String>)> = Vec::new();
        for (member, p) in &self.of {
            let unit = if p.units.is_empty() { String::new() } else { format!(", in {}", p.units) };
            let range = if p.choices.is_empty() { format!(": {}", p.range) } else { String::new() };
            let open = if self.name == LEFT_OPEN { LEFT_OPEN_HELP } else { "" };
            let text = format!("{}{unit}{range}{open}", p.doc);
            let default = match *member {
                "" if open.is_empty() => format!("[default: {}]", p.default),
                "" => String::new(),
                member => format!("[{member}: {}]", p.default),
            };
            match lines.iter_mut().find(|l| l.0 == text) {
                Some(line) => line.1.push(default),
                None => lines.push((text, vec![default])),
            }
        }
        let lines =
            lines.into_iter().map(|(text, defaults)| format!("{text} {}", defaults.join(" ")).trim().to_owned());
        lines.collect::<Vec<_>>().join("\n")
    }

    fn arg(&self) -> Arg {
        let (name, first) = (self.name, &self.of[0].1);
        let vector = first.default.contains(',');
        let arg = Arg::new(kebab(name)).long(kebab(name)).help(self.help());
        let arg = arg.help_heading(format!("Parameters of {}", self.part));
        let arg = arg.value_name(if vector { "X,Y,Z" } else { "N" });
        let mut choices: Vec<&str> = Vec::new();
        for choice in self.of.iter().flat_map(|(_, p)| p.choices) {
            if !choices.contains(choice) {
                choices.push(choice);
            }
        }
        let any = self.of.iter().any(|(_, p)| p.choices.is_empty());
        match any {
            // What begins with a minus is a value too, in a vector as well.
            true if vector => arg.allow_hyphen_values(true),
            true => arg.allow_negative_numbers(true),
            false => return arg.value_name("CHOICE").value_parser(PossibleValuesParser::new(choices)),
        }
        .value_parser(move |text: &str| readable(name, text))
    }
}

/// Whether a text is a value of this parameter in any member; if not, what to use.
fn readable(name: &str, text: &str) -> Result<String, String> {
    let mut refused = String::new();
    for (_, mut member) in parts().into_iter().flat_map(|part| part.members) {
        if member.parameters().iter().any(|p| p.name == name) {
            match member.set(name, text) {
                Ok(()) => return Ok(text.to_owned()),
                Err(Error::Parameter { remedy, .. }) => refused = remedy,
                Err(e) => refused = e.to_string(),
            }
        }
    }
    Err(refused)
}

/// A family's flag.
fn family(name: &'static str, about: &str, members: &[(&'static str, Box<dyn Parameters>)]) -> Arg {
    let values = members.iter().map(|(name, p)| PossibleValue::new(*name).help(p.about()));
    let arg = Arg::new(name).long(name).value_name("NAME").help_heading("Method");
    let default = Settings::default().method.members().into_iter().find(|m| m.0 == name).map_or("", |m| m.1);
    arg.help(format!("{} [default: {default}]", about.trim_end_matches('.')))
        .value_parser(PossibleValuesParser::new(values))
}

/// Values of `--method` and `--methods`.
pub fn presets() -> PossibleValuesParser {
    PossibleValuesParser::new(PRESETS.iter().map(|p| {
        let mut what = p.members.join(", ");
        p.values.iter().for_each(|(name, value)| what += &format!(", {name} {value}"));
        PossibleValue::new(p.name).help(what)
    }))
}

/// The published method of this name.
pub fn preset(name: &str) -> Option<&'static Preset> {
    PRESETS.iter().find(|p| p.name == name)
}

/// A method with those of its members that count, and the others of the first method that goes with them.
pub fn completed(method: &Method, counts: impl Fn(&str) -> bool) -> Method {
    let named: Vec<_> = method.members().into_iter().filter(|(family, _)| counts(family)).collect();
    let with = |preset: &Preset| {
        let other = preset.method();
        let layers = if counts("layers") { method.layers } else { other.layers };
        let smooth = if counts("smooth") { method.smooth } else { other.smooth };
        Some(Method::new(layers, smooth, if counts("optics") { method.optics } else { other.optics }))
    };
    first(&named, with).unwrap_or(*method)
}

/// What is made of the first preset with which it goes together. The default with other optics is still the default; then come
/// those that have all these members, then those that have these layers and smoothing, then any.
fn first(named: &[(&str, &str)], made: impl Fn(&Preset) -> Option<Method>) -> Option<Method> {
    let surfaces = &["layers", "smooth"][..];
    let ways =
        [(&PRESETS[..1], surfaces), (PRESETS, &["layers", "smooth", "optics"]), (PRESETS, surfaces), (PRESETS, &[])];
    ways.into_iter().find_map(|(presets, families)| {
        let own = |p: &&Preset| {
            let members = p.method().members();
            named.iter().all(|one| !families.contains(&one.0) || members.contains(one))
        };
        presets.iter().filter(own).filter_map(&made).find(|m| m.validate().is_ok())
    })
}

impl clap::Args for Choices {
    fn augment_args(command: Command) -> Command {
        let first = PRESETS[0].name;
        let help = format!("Method, which what follows changes [default: {first}, or the first that has what follows]");
        let method = Arg::new(METHOD).long(METHOD).value_name("PRESET").help(help).value_parser(presets());
        let parts = Settings::parts();
        let families = parts.iter().filter(|p| !p.about.is_empty()).map(|p| family(p.name, p.about, &p.members));
        command.arg(method.help_heading("Method")).args(families).args(flags().iter().map(Flag::arg))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for Choices {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = |id: &str| {
            let given = matches.value_source(id) == Some(ValueSource::CommandLine);
            given.then(|| matches.get_one::<String>(id).cloned()).flatten()
        };
        let families = Settings::parts().into_iter().filter(|p| !p.about.is_empty());
        Ok(Choices {
            preset: given(METHOD).and_then(|name| preset(&name)),
            members: families.filter_map(|p| Some((p.name, given(p.name)?))).collect(),
            values: flags().iter().filter_map(|f| Some((f.name, given(&kebab(f.name))?))).collect(),
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Choices {
    /// Where no method is named: the first that has all the members and parameters that are.
    fn start(&self) -> Method {
        let options = prepare::Options::default().parameters();
        let chosen = |preset: &Preset| {
            let mut method = preset.method();
            self.members.iter().all(|(family, member)| method.choose(family, member).is_ok()).then_some(method)
        };
        let has = |method: &Method| {
            let all = Settings::from(*method).parameters();
            self.values.iter().all(|(name, _)| all.iter().chain(&options).any(|p| p.name == *name))
        };
        let named: Vec<_> = self.members.iter().map(|(family, member)| (*family, member.as_str())).collect();
        first(&named, |preset| chosen(preset).filter(has)).unwrap_or_default()
    }

    /// Whether a parameter was given a value.
    pub fn gives(&self, name: &str) -> bool {
        self.values.iter().any(|v| v.0 == name)
    }

    /// Changes settings as was said: first the method, then members of families, then parameters.
    pub fn apply(
        &self,
        settings: &mut Settings,
        preparation: &mut prepare::Options,
        instead: Option<&Preset>,
    ) -> Result<(), Error> {
        if let Some(preset) = instead.or(self.preset) {
            settings.method = preset.method();
        } else if settings.method == Method::default() {
            settings.method = self.start();
        }
        for (family, member) in &self.members {
            settings.method.choose(family, member)?;
        }
        for (name, value) in &self.values {
            let has = |all: &[Parameter]| all.iter().any(|p| p.name == *name);
            if has(&settings.parameters()) {
                settings.set(name, value)?;
            } else if has(&preparation.parameters()) {
                preparation.set(name, value)?;
            } else {
                return Err(lacking(settings, name, value));
            }
        }
        Ok(())
    }
}

/// A parameter that the chosen members do not have.
fn lacking(settings: &Settings, name: &'static str, value: &str) -> Error {
    let mut remedy = "there is no such parameter".to_owned();
    if let Some(flag) = flags().into_iter().find(|f| f.name == name) {
        let chosen = settings.method.members().into_iter().find(|m| m.0 == flag.part).map_or("", |m| m.1);
        let having: Vec<_> = flag.of.iter().map(|(member, _)| format!("--{} {member}", flag.part)).collect();
        remedy = format!(
            "{} {chosen} has no such parameter; leave --{} out, or use {}",
            flag.part,
            kebab(name),
            having.join(" or ")
        );
    }
    Error::Parameter { parameter: name, value: value.to_owned(), remedy }
}

/// What to call the method of these settings: the preset that it is, or its members.
pub fn method_name(settings: &Settings) -> String {
    let preset = PRESETS.iter().find(|p| p.method() == settings.method).map(|p| p.name.to_owned());
    preset.unwrap_or_else(|| settings.method.members().map(|m| m.1).join(" "))
}

/// A parameter's value as JSON has it.
fn value(text: &str) -> Value {
    let vector = || serde_json::from_str(&format!("[{text}]")).ok().filter(|_| text.contains(','));
    serde_json::from_str(text).ok().or_else(vector).unwrap_or_else(|| json!(text))
}

/// Settings by name: which member of each family, then every parameter.
pub fn record(settings: &Settings) -> Map<String, Value> {
    let members = settings.method.members().map(|(family, member)| (family.to_owned(), json!(member)));
    members.into_iter().chain(settings.parameters().iter().map(|p| (p.name.to_owned(), value(&p.value)))).collect()
}

/// Units of those parameters that have one.
pub fn units(settings: &Settings) -> Map<String, Value> {
    let all = settings.parameters();
    all.iter().filter(|p| !p.unit.is_empty()).map(|p| (p.name.to_owned(), json!(p.unit))).collect()
}

/// Lengths that settings give in particle radii, in world units.
pub fn lengths(settings: &Settings, radius: f32) -> Map<String, Value> {
    let radii = settings.parameters().into_iter().filter(|p| p.unit == "particle radii");
    radii.filter_map(|p| Some((in_world(p.name), json!(p.value.parse::<f32>().ok()? * radius)))).collect()
}

/// What a length that settings give in particle radii is called in world units.
pub fn in_world(name: &str) -> String {
    format!("{name}_world")
}

/// Settings that make the same picture when it is rendered at a multiple of its size.
pub fn enlarge(settings: &Settings, times: u32) -> Result<Settings, Error> {
    settings.validate()?;
    let enlarged = settings.enlarged(times);
    let Err(refused) = enlarged.validate() else { return Ok(enlarged) };
    let Error::Parameter { parameter, .. } = &refused else { return Err(refused) };
    let Some(p) = settings.parameters().into_iter().find(|p| p.name == *parameter) else { return Err(refused) };
    let mut other = *settings;
    let mut fits = |value: f64| {
        let set = other.set(p.name, &value.to_string()).and_then(|()| other.validate());
        set.is_ok() && other.enlarged(times).validate().is_ok()
    };
    // One by one: what else the range asks for only it knows.
    let given = p.value.parse::<f64>().unwrap_or(0.0).ceil();
    let most = (1..100_000).map(|i| given - f64::from(i)).take_while(|v| *v >= 1.0).find(|v| fits(*v));
    let less = most.map_or("another --supersample".to_owned(), |most| format!("{most} at most"));
    let remedy = format!("at --supersample {times} use {less} ({})", p.range);
    Err(Error::Parameter { parameter: p.name, value: p.value, remedy })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Args;

    fn parsed(line: &str) -> Result<Choices, clap::Error> {
        let command = Choices::augment_args(Command::new("x")).no_binary_name(true);
        Choices::from_arg_matches(&command.try_get_matches_from(line.split_whitespace())?)
    }

    #[test]
    fn every_parameter_has_a_flag_and_sets_itself_alone() {
        let mut names = 0;
        let of = prepare::Options::default;
        for part in Settings::parts() {
            for (member, parameters) in &part.members {
                for p in parameters.parameters() {
                    names += 1;
                    let choose = if member.is_empty() { String::new() } else { format!("--{} {member}", part.name) };
                    // Two words of a choice, or the default.
                    let word = p.choices.iter().find(|w| **w != p.default).map_or(p.default.as_str(), |w| w);
                    // A method that is not the default: then no other takes its place for what is asked of it.
                    let imai16 = Settings::from(Method::preset("imai16").expect("a preset"));
                    let mut settings = imai16;
                    let choices = parsed(&format!("{choose} --{}={word}", kebab(p.name))).expect("a flag");
                    choices.apply(&mut settings, &mut of(), None).expect("set");
                    let mut expected = imai16;
                    if !member.is_empty() {
                        expected.method.choose(part.name, member).expect("a member");
                    }
                    expected.set(p.name, word).expect("a value");
                    assert_eq!(settings, expected, "{}", p.name);
                    assert_eq!(record(&settings)[p.name], value(word));
                }
            }
        }
        assert!(names > 10, "only {names}");
        for p in of().parameters() {
            let (mut settings, mut options, mut expected) = (Settings::default(), of(), of());
            let word = if p.choices.is_empty() { "0.75" } else { p.choices[1] };
            let word = if expected.set(p.name, word).is_ok() { word } else { "7" };
            expected.set(p.name, word).expect("a value");
            let choices = parsed(&format!("--{}={word}", kebab(p.name))).expect("a flag");
            choices.apply(&mut settings, &mut options, None).expect("set");
            assert!(options == expected && options != of() && settings == Settings::default(), "{}", p.name);
        }
    }

    /// Where no method is named it is the first that has what is.
    #[test]
    fn what_is_asked_for_decides_where_a_method_starts() {
        let started = |line: &str, from: Settings| {
            let mut settings = from;
            parsed(line)
                .expect("flags")
                .apply(&mut settings, &mut Default::default(), None)
                .map(|()| method_name(&settings))
        };
        let from_default = |line: &str| started(line, Settings::default()).expect("settings");
        assert_eq!(from_default("--ior 1.4 --support 5"), "field");
        assert_eq!(from_default("--optics two"), "field none two");
        assert_eq!(from_default("--layers split"), "imai16");
        assert_eq!(from_default("--layers split --smooth none --optics one"), "split none one");
        assert!(from_default("--optics two --sigma 3").starts_with("split plane-fit two"));
        assert_eq!(from_default("--optics ssfr"), "green10");
        assert_eq!(from_default("--iterations 2"), "imai16");
        assert!(from_default("--time-step 0.1").starts_with("front curvature-flow"));
        // What is there stays, and what goes with nothing is refused as the default's.
        let imai14 = Settings::from(Method::preset("imai14").expect("a preset"));
        assert!(started("--kernel-radius 5", imai14).expect_err("it has none").to_string().contains("field"));
        assert!(started("--window 9 --kernel-radius 5", Settings::default()).is_err());
        let plane_fit = Method::preset("imai16").expect("a preset").smooth;
        let said = Method::new(Method::default().layers, plane_fit, Method::default().optics);
        assert_eq!(completed(&said, |family| family == "smooth"), Method::preset("imai16").expect("a preset"));
        assert_eq!(completed(&Method::default(), |_| false), Method::default());
    }

    /// A flag would set only the first of them.
    #[test]
    fn no_two_parts_have_a_parameter_of_one_name() {
        for part in parts() {
            for (_, p) in part.members.iter().flat_map(|(m, p)| p.parameters().into_iter().map(move |p| (m, p))) {
                let flag = flags().into_iter().find(|f| f.name == p.name).expect("a flag");
                assert_eq!(flag.part, part.name, "{}", p.name);
            }
        }
    }

    #[test]
    fn records_have_every_parameter() {
        for part in Settings::parts() {
            for (member, _) in part.members.iter().filter(|m| !m.0.is_empty()) {
                let mut settings = Settings::default();
                settings.method.choose(part.name, member).expect("a member");
                let record = record(&settings);
                let names: Vec<_> = settings.parameters().iter().map(|p| p.name).collect();
                assert_eq!(record.len(), names.len() + settings.method.members().len());
                assert!(names.iter().all(|n| record.contains_key(*n)));
                assert_eq!(record[part.name], *member);
            }
        }
    }

    /// What is counted in pixels covers the same part of the picture; what only caps a kernel ends with its range.
    #[test]
    fn windows_widen_with_the_picture() {
        let large = |line: &str, times: u32| {
            let mut settings = Settings::default();
            parsed(line).expect("flags").apply(&mut settings, &mut Default::default(), None).expect("settings");
            enlarge(&settings, times).map(|s| Value::Object(record(&s))).map_err(|e| e.to_string())
        };
        assert_eq!(large("--window 9", 3).expect("fits")["window"], 25);
        let refused = large("--window 11", 3).expect_err("31 is too wide");
        assert!(refused.contains("window is 11") && refused.contains("9 at most"), "{refused}");
        assert_eq!(large("--window 11 --projected true", 3).expect("a cap")["window"], 25);
        for preset in PRESETS {
            large(&format!("--method {}", preset.name), 3).expect(preset.name);
        }
        let wide = large("--smooth bilateral --projected false --sigma-space 4 --window 25", 2).expect("fits");
        assert_eq!((&wide["window"], wide["sigma_space"].as_f64()), (&json!(49), Some(8.0)));
        let cap = large("--smooth bilateral --sigma-space 4 --window 25", 3).expect("fits");
        assert_eq!((&cap["window"], cap["sigma_space"].as_f64()), (&json!(55), Some(4.0)));
        let flow = large("--smooth curvature-flow --time-step 0.5 --iterations 20", 2).expect("fits");
        assert_eq!((&flow["time_step"], &flow["iterations"]), (&json!(0.25), &json!(80)));
        let refused = large("--smooth curvature-flow --iterations 300", 2).expect_err("1200 are too many");
        assert!(refused.contains("iterations is 300") && refused.contains("250 at most"), "{refused}");
    }

    /// A unit that hangs on another parameter is the one that holds.
    #[test]
    fn lengths_in_radii_are_known_wherever_they_are_such() {
        let mut settings = Settings::default();
        settings.method.choose("smooth", "bilateral").expect("a member");
        assert_eq!(units(&settings)["sigma_space"], "particle radii");
        assert_eq!(lengths(&settings, 0.5)["sigma_space_world"], 0.5);
        settings.set("projected", "false").expect("set");
        assert_eq!(units(&settings)["sigma_space"], "pixels");
        assert!(!lengths(&settings, 0.5).contains_key("sigma_space_world"));
        let flag = flags().into_iter().find(|f| f.name == "sigma_space").expect("a flag");
        assert!(flag.help().contains("particle radii (if projected) or pixels"), "{}", flag.help());
    }
}
