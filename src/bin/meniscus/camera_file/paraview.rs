//! ParaView's camera configurations (.pvcc): where eye and focal point are, in the coordinates of what it shows.

use super::{Angle, CameraFile, CameraFileError, Fit, Pose};
use glam::{DMat3, DQuat, DVec2, DVec3};
use meniscus::io::quote::quote;
use quick_xml::{
    Reader,
    events::{BytesStart, Event},
};
use std::{collections::HashMap, path::Path};

pub fn read(path: &Path, bytes: &[u8]) -> Result<CameraFile, CameraFileError> {
    let syntax = |message: String| CameraFileError::Syntax { path: path.into(), message };
    let properties = properties(bytes).map_err(|e| syntax(format!("XML error: {}", quote(&e.to_string()))))?;
    let numbers = |name: &str| properties.get(name).map_or(&[][..], Vec::as_slice);
    let point = |name: &str| match numbers(name) {
        [x, y, z] if DVec3::new(*x, *y, *z).is_finite() => Ok(DVec3::new(*x, *y, *z)),
        _ => Err(syntax(format!("it has no {name} of three numbers, so it is no camera of ParaView's"))),
    };
    let [eye, target, up] = ["CameraPosition", "CameraFocalPoint", "CameraViewUp"].map(point);
    let (eye, target, up) = (eye?, target?, up?);
    if numbers("CameraParallelProjection").first().is_some_and(|p| *p != 0.0) {
        return Err(syntax("its projection is parallel, and only perspective is drawn".into()));
    }
    let degrees = match numbers("CameraViewAngle") {
        [] => 30.0,
        [degrees] if *degrees > 0.0 && *degrees < 170.0 => *degrees,
        _ => return Err(syntax("its CameraViewAngle is not above 0 and below 170 degrees".into())),
    };
    let back = (eye - target).normalize_or_zero();
    let right = up.cross(back).normalize_or_zero();
    if right == DVec3::ZERO {
        return Err(syntax("its position, focal point and up are on one line".into()));
    }
    let turn = DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back));
    let (angle, shift) = (Angle::FovY(degrees), DVec2::ZERO);
    let still = Some(Pose { eye, turn, angle, fit: Fit::Auto, shift, near: None });
    Ok(CameraFile { path: path.into(), up: None, size: None, still, frames: Vec::new() })
}

/// The numbers of each property, in the order of their elements; nothing of others.
fn properties(bytes: &[u8]) -> Result<HashMap<String, Vec<f64>>, quick_xml::Error> {
    let mut reader = Reader::from_reader(bytes);
    let (mut all, mut name) = (HashMap::new(), String::new());
    loop {
        match reader.read_event()? {
            Event::Eof => return Ok(all),
            Event::Start(tag) | Event::Empty(tag) if tag.name().as_ref() == b"Property" => {
                name = attribute(&tag, "name")?.unwrap_or_default();
            }
            Event::Start(tag) | Event::Empty(tag) if tag.name().as_ref() == b"Element" => {
                let value = attribute(&tag, "value")?.and_then(|v| v.trim().parse().ok()).unwrap_or(f64::NAN);
                all.entry(name.clone()).or_insert_with(Vec::new).push(value);
            }
            _ => {}
        }
    }
}

fn attribute(tag: &BytesStart, name: &str) -> Result<Option<String>, quick_xml::Error> {
    match tag.try_get_attribute(name)? {
        Some(found) => Ok(Some(found.unescape_value()?.into_owned())),
        None => Ok(None),
    }
}
