//! PLY files (`.ply`), by ply-rs.

use ply_rs::parser::Parser;
use ply_rs::ply::{ElementDef, Encoding, Property, PropertyAccess, PropertyType, ScalarType};

use glam::DVec3;

use super::{At, ParticleFile, ReadError, Source};

/// The properties wanted of an element: x, y, z, class. Those that stay NaN are told apart by the header.
struct Vertex([f64; 4]);

const WANTED: [&str; 4] = ["x", "y", "z", "class"];

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Vertex([f64::NAN; 4])
    }

    fn set_property(&mut self, name: String, property: Property) {
        let Some(slot) = WANTED.iter().position(|wanted| *wanted == name) else {
            return;
        };
        self.0[slot] = match property {
            Property::Char(v) => v.into(),
            Property::UChar(v) => v.into(),
            Property::Short(v) => v.into(),
            Property::UShort(v) => v.into(),
            Property::Int(v) => v.into(),
            Property::UInt(v) => v.into(),
            Property::Float(v) => v.into(),
            Property::Double(v) => v,
            _ => return,
        };
    }
}

/// Reads x, y, z (any numeric type) and `class` of the element `vertex`; later elements are not looked at.
pub(super) fn read(source: &Source<'_>) -> Result<ParticleFile, ReadError> {
    let mut rest = source.bytes;
    let parser = Parser::<Vertex>::new();
    let header =
        parser.read_header(&mut rest).map_err(|error| source.malformed(At::Unknown, format!("header: {error}")))?;
    let body = (source.bytes.len() - rest.len()) as u64;
    for (name, element) in &header.elements {
        // ply-rs believes the count: without a check it would make elements without properties until memory ends.
        let needed = (element.count as u64).saturating_mul(least_size(element, header.encoding));
        if needed > rest.len() as u64 + 1 || (element.count > 0 && element.properties.is_empty()) {
            let detail = format!(
                "element `{name}` promises {} entries, at least {needed} bytes; {} follow",
                element.count,
                rest.len()
            );
            return Err(source.malformed(At::Byte(body), detail));
        }
        let is_scalar =
            |name: &str| matches!(element.properties.get(name).map(|p| &p.data_type), Some(PropertyType::Scalar(_)));
        if name == "vertex" && !WANTED[..3].iter().all(|axis| is_scalar(axis)) {
            let found: Vec<&str> = element.properties.keys().map(String::as_str).collect();
            return Err(source.no_positions("vertex properties x, y, z expected", found.join(", ")));
        }
        let vertices = parser.read_payload_for_element(&mut rest, element, &header).map_err(|error| {
            source.malformed(At::Byte(body), format!("element `{name}` (its lines count from 0): {error}"))
        })?;
        if name == "vertex" {
            let positions = vertices.iter().map(|v| DVec3::new(v.0[0], v.0[1], v.0[2])).collect();
            let classes: Vec<f64> = vertices.iter().map(|v| v.0[3]).collect();
            let classes = is_scalar("class").then(|| source.classes(&classes)).transpose()?;
            return Ok(ParticleFile { positions, classes, ..ParticleFile::default() });
        }
    }
    let found: Vec<&str> = header.elements.keys().map(String::as_str).collect();
    Err(source.no_positions("an element `vertex` expected", format!("elements {}", found.join(", "))))
}

/// The fewest bytes one entry of `element` takes.
fn least_size(element: &ElementDef, encoding: Encoding) -> u64 {
    let sizes = element.properties.values().map(|property| match &property.data_type {
        // A digit and a separator; the file's last entry can do without the separator.
        _ if encoding == Encoding::Ascii => 2,
        PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => match scalar {
            ScalarType::Char | ScalarType::UChar => 1,
            ScalarType::Short | ScalarType::UShort => 2,
            ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
            ScalarType::Double => 8,
        },
    });
    sizes.sum()
}
