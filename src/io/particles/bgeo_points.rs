//! The points of Houdini's geometry since version 12: attributes by name, their numbers in pages, in which packs of components follow one
//! another, and of which some have one number for all.

use std::io::Read;

use glam::DVec3;

use super::bgeo_json::{Numbers, Parser};
use super::source::{Source, is_id, is_velocity};
use super::{At, ParticleFile, ReadError};
use crate::io::quote::quote;

/// More packs than any attribute has components.
const PACKS: usize = 1 << 10;

/// An attribute's numbers, and how they lie.
#[derive(Default)]
struct Values {
    size: Option<usize>,
    storage: String,
    packing: Option<Vec<usize>>,
    page: Option<usize>,
    /// Of each pack, which pages have one tuple for all their points.
    constant: Vec<Vec<bool>>,
    raw: Option<Numbers>,
    /// Each component's numbers after the other's, not those of each point.
    by_component: bool,
}

/// Reads positions (`P`), velocities, ids and classes.
pub(super) fn read<R: Read>(source: &Source<'_>, parser: &mut Parser<'_, R>) -> Result<ParticleFile, ReadError> {
    let (mut count, mut found, mut names) = (None, Found::default(), Vec::new());
    parser.entries(|parser, name| match name {
        "fileversion" => {
            let version = parser.text()?.unwrap_or_default();
            source.note(|notes| notes.format = format!("BGEO, Houdini {}", quote(&version)));
            Ok(())
        }
        "pointcount" => {
            count = parser.count()?;
            Ok(())
        }
        "attributes" => parser.entries(|parser, owner| match owner {
            "pointattributes" => parser.elements(|parser| attribute(source, parser, &mut found, &mut names)),
            _ => parser.skip(),
        }),
        _ => parser.skip(),
    })?;
    let Some(count) = count else {
        return Err(source.malformed(At::Unknown, "it does not say how many points it has"));
    };
    let Some(places) = found.places else {
        let wanted = "a point attribute `P` of 3 or 4 components expected";
        return Err(source.no_positions(wanted, if names.is_empty() { "none".into() } else { names.join(", ") }));
    };
    let mut positions = source.room(count as u64, "positions")?;
    places.each(source, "P", count, |tuple| {
        positions.push(DVec3::new(tuple[0], tuple[1], tuple[2]));
        Ok(())
    })?;
    let mut file = ParticleFile { positions, ..ParticleFile::default() };
    if let Some((name, values)) = found.velocities {
        let mut velocities = source.room(count as u64, "velocities")?;
        values.each(source, &name, count, |tuple| {
            velocities.push(DVec3::new(tuple[0], tuple[1], tuple[2]));
            Ok(())
        })?;
        file.velocities = Some(velocities);
    }
    if let Some((name, values)) = found.ids {
        let mut ids = source.ids(count as u64)?;
        values.each(source, &name, count, |tuple| {
            ids.push(tuple[0]);
            Ok(())
        })?;
        file.ids = ids.finish();
    }
    if let Some(values) = found.classes {
        let mut classes = source.room(count as u64, "classes")?;
        values.each(source, "class", count, |tuple| {
            classes.push(source.class(tuple[0], classes.len())?);
            Ok(())
        })?;
        file.classes = Some(classes);
    }
    Ok(file)
}

#[derive(Default)]
struct Found {
    places: Option<Values>,
    velocities: Option<(String, Values)>,
    ids: Option<(String, Values)>,
    classes: Option<Values>,
}

/// One attribute: what it is called, and its values.
fn attribute<R: Read>(
    source: &Source<'_>,
    parser: &mut Parser<'_, R>,
    found: &mut Found,
    names: &mut Vec<String>,
) -> Result<(), ReadError> {
    let (mut name, mut numeric, mut values, mut part) = (String::new(), false, Values::default(), 0);
    parser.elements(|parser| {
        part += 1;
        match part {
            1 => parser.entries(|parser, key| match key {
                "name" => {
                    name = parser.text()?.unwrap_or_default();
                    Ok(())
                }
                "type" => {
                    numeric = parser.text()?.is_some_and(|kind| kind == "numeric");
                    Ok(())
                }
                _ => parser.skip(),
            }),
            2 => {
                let wanted = name == "P" || name == "class" || is_velocity(&name) || is_id(&name);
                values.read(parser, numeric && wanted)
            }
            _ => parser.skip(),
        }
    })?;
    let size = values.size.unwrap_or(0);
    source.note_array(&name, &values.storage, size as u64);
    if names.len() < 10 {
        names.push(quote(&name));
    }
    if !numeric || values.raw.is_none() {
        return Ok(());
    }
    if name == "P" && (3..=4).contains(&size) {
        if found.places.replace(values).is_some() {
            return Err(source.malformed(At::Unknown, "attribute `P` is there twice"));
        }
    } else if is_velocity(&name) && size == 3 {
        if found.velocities.is_some() {
            return Err(source.second_velocity(At::Unknown, &name));
        }
        found.velocities = Some((name, values));
    } else if is_id(&name) && size == 1 {
        found.ids.get_or_insert((name, values));
    } else if name == "class" {
        if size != 1 {
            let shape = format!("of size {size}");
            return Err(source.wrong_shape("class", shape, "one whole number for each particle"));
        }
        if found.classes.replace(values).is_some() {
            return Err(source.malformed(At::Unknown, "attribute `class` is there twice"));
        }
    }
    Ok(())
}

impl Values {
    /// Reads what there is of them; numbers only if they are wanted.
    fn read<R: Read>(&mut self, parser: &mut Parser<'_, R>, wanted: bool) -> Result<(), ReadError> {
        parser.entries(|parser, key| {
            match key {
                "size" => self.size = parser.count()?,
                "storage" => self.storage = parser.text()?.unwrap_or_default(),
                "values" if wanted => parser.entries(|parser, key| {
                    match key {
                        "size" => self.size = parser.count()?,
                        "packing" => self.packing = Some(packs(&parser.numbers()?)),
                        "pagesize" => self.page = parser.count()?,
                        "constantpageflags" => {
                            let mut constant = Vec::new();
                            parser.elements(|parser| {
                                let flags = parser.flags()?;
                                if constant.len() < PACKS {
                                    constant.push(flags);
                                }
                                Ok(())
                            })?;
                            self.constant = constant;
                        }
                        "rawpagedata" | "tuples" => self.raw = Some(parser.numbers()?),
                        "arrays" => (self.raw, self.by_component) = (Some(parser.numbers()?), true),
                        _ => parser.skip()?,
                    }
                    Ok(())
                })?,
                _ => parser.skip()?,
            }
            Ok(())
        })
    }

    /// Gives each point's tuple, in order.
    fn each(
        &self,
        source: &Source<'_>,
        name: &str,
        count: usize,
        mut give: impl FnMut(&[f64]) -> Result<(), ReadError>,
    ) -> Result<(), ReadError> {
        let (size, Some(raw)) = (self.size.unwrap_or(0), &self.raw) else { return Ok(()) };
        let wrong = |detail: String| source.malformed(At::Unknown, format!("attribute `{}`: {detail}", quote(name)));
        let whole = vec![if self.by_component { 1 } else { size }; if self.by_component { size } else { 1 }];
        let packing = self.packing.as_ref().unwrap_or(&whole);
        if count.checked_mul(size).is_none() {
            return Err(wrong(format!("{size} components of {count} points")));
        }
        if packing.iter().try_fold(0_usize, |sum, pack| sum.checked_add(*pack)) != Some(size) || packing.contains(&0) {
            return Err(wrong(format!("packs of {packing:?} are not its {size} components")));
        }
        let page = match self.page {
            Some(0) => return Err(wrong("pages of no points".into())),
            Some(page) => page,
            None => count.max(1),
        };
        let is_constant = |pack: usize, page: usize| self.constant.get(pack).and_then(|p| p.get(page)) == Some(&true);
        let (mut tuple, mut at) = (vec![0.0; size], 0);
        for (index, first) in (0..count).step_by(page).enumerate() {
            let points = page.min(count - first);
            let (mut begins, begin) = (Vec::with_capacity(packing.len()), at);
            for (k, pack) in packing.iter().enumerate() {
                begins.push(at);
                at += if is_constant(k, index) { *pack } else { pack * points };
            }
            if at > raw.len() {
                return Err(wrong(format!("{} numbers, more than {begin} expected", raw.len())));
            }
            for point in 0..points {
                let mut components = tuple.iter_mut();
                for (k, (begin, pack)) in begins.iter().zip(packing).enumerate() {
                    let from = begin + if is_constant(k, index) { 0 } else { pack * point };
                    components.by_ref().take(*pack).zip(from..).for_each(|(value, i)| *value = raw.get(i));
                }
                give(&tuple)?;
            }
        }
        match raw.len() {
            found if found == at => Ok(()),
            found => Err(wrong(format!("{found} numbers, {at} expected"))),
        }
    }
}

fn packs(numbers: &Numbers) -> Vec<usize> {
    (0..numbers.len().min(PACKS)).map(|i| numbers.get(i) as usize).collect()
}
