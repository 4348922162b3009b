//! Meshes in files: PLY and OBJ by their crates, NumPy archives as the cache has them.

use super::mesh::Mesh;
use crate::io::{
    Budget,
    budget::OverBudget,
    guard,
    particles::{ReadError, check_ply_header, read_triples},
    quote,
};
use glam::{DVec3, Vec3};
use npyz::WriterBuilder;
use ply_rs_bw::{
    parser::{Parser as PlyParser, Reader},
    ply::{PropertyAccess, PropertyAccessResult},
};
use std::{
    fs,
    io::Cursor,
    path::{Path, PathBuf},
};

/// Why a mesh could not be read.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the fields are what the messages show")]
pub enum MeshFileError {
    /// Not there, or not readable.
    #[error("{}: cannot be read ({source}); check the path and its permissions", quote::path(path))]
    Io { path: PathBuf, source: std::io::Error },
    /// Its extension is of no format that is known here.
    #[error("{}: a mesh is a .ply, .obj or .npz file: convert it to one of them", quote::path(.0))]
    Extension(PathBuf),
    /// Damaged, or not what its extension says.
    #[error("{}: {}; export the mesh again", quote::path(path), quote::cut(detail, 200))]
    Malformed { path: PathBuf, detail: String },
    /// What a library's reader has not foreseen: a defect of it, or ours.
    #[error(
        "{}: reading it failed unforeseen; export the mesh again, from another program if need be",
        quote::path(path)
    )]
    Panicked { path: PathBuf, panic: String },
    /// An archive or a header that is damaged.
    #[error(transparent)]
    Archive(#[from] ReadError),
    /// An archive without what a mesh is made of.
    #[error("{}: a mesh is arrays `vertices` and `triangles` (and `normals`), N x 3; found {}", quote::path(path), quote::list(found.iter().map(String::as_str)))]
    Arrays { path: PathBuf, found: Vec<String> },
    /// More than it may take.
    #[error("{}: {source}", quote::path(path))]
    TooLarge { path: PathBuf, source: OverBudget },
}

/// Reads a mesh, with the normals of its vertices if it has any. Polygons are taken as fans of triangles.
///
/// # Errors
/// [`MeshFileError`], with the file's name. Whether rays can tell its inside is for [`Mesh::check`] to say.
pub fn read(path: &Path, budget: &Budget) -> Result<Mesh, MeshFileError> {
    let io = |source| MeshFileError::Io { path: path.into(), source };
    parser(path)?;
    check_size(path, fs::metadata(path).map_err(io)?.len(), budget)?;
    from_bytes(path, &fs::read(path).map_err(io)?, budget)
}

/// Reads a mesh's content as [`read`] does; the extension of `path` says of what format it is.
///
/// # Errors
/// As [`read`].
pub fn from_bytes(path: &Path, bytes: &[u8], budget: &Budget) -> Result<Mesh, MeshFileError> {
    let parse = match parser(path)? {
        Parser::Archive => return npz(path, bytes, budget),
        Parser::Ply => {
            // Its crate believes counts.
            check_ply_header(path, bytes, budget)?;
            ply
        }
        Parser::Obj => obj,
    };
    check_size(path, bytes.len() as u64, budget)?;
    let parsed =
        guard::quietly(|| parse(bytes)).map_err(|panic| MeshFileError::Panicked { path: path.into(), panic })?;
    parsed.map_err(|detail| MeshFileError::Malformed { path: path.into(), detail })
}

#[derive(Clone, Copy)]
enum Parser {
    Ply,
    Obj,
    Archive,
}

fn parser(path: &Path) -> Result<Parser, MeshFileError> {
    match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
        Some("ply") => Ok(Parser::Ply),
        Some("obj") => Ok(Parser::Obj),
        Some("npz") => Ok(Parser::Archive),
        _ => Err(MeshFileError::Extension(path.into())),
    }
}

/// A line of text or a packed face takes at most so many times its size.
const GROWTH: u64 = 16;

fn check_size(path: &Path, file: u64, budget: &Budget) -> Result<(), MeshFileError> {
    let needed = file.saturating_mul(GROWTH);
    if needed <= budget.bytes() || matches!(parser(path)?, Parser::Archive) {
        return Ok(());
    }
    let source = OverBudget { what: "the mesh".into(), needed, allowed: budget.bytes(), file, budget: *budget };
    Err(MeshFileError::TooLarge { path: path.into(), source })
}

fn npz(path: &Path, bytes: &[u8], budget: &Budget) -> Result<Mesh, MeshFileError> {
    let found = read_triples(path, bytes, &["vertices", "triangles", "normals"], budget)?;
    let [Some(vertices), Some(triangles), normals] = <[_; 3]>::try_from(found.arrays).unwrap_or_default() else {
        return Err(MeshFileError::Arrays { path: path.into(), found: found.names });
    };
    let whole = |v: f64| (v >= 0.0 && v <= f64::from(u32::MAX) && v.fract() == 0.0).then_some(v as u32);
    let corners = |t: &DVec3| Some([whole(t.x)?, whole(t.y)?, whole(t.z)?]);
    let triangles = triangles.iter().map(corners).collect::<Option<_>>().ok_or_else(|| {
        let detail = "`triangles` has entries that are no index of a vertex".into();
        MeshFileError::Malformed { path: path.into(), detail }
    })?;
    let normals = normals.map(|all| all.iter().map(|n| n.as_vec3()).collect());
    Ok(Mesh { vertices, triangles, normals })
}

#[derive(Default)]
struct Vertex {
    position: DVec3,
    normal: Vec3,
}

impl PropertyAccess for Vertex {
    fn new() -> Vertex {
        Vertex::default()
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set_double(name, value.into())
    }

    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        match name {
            "x" => self.position.x = value,
            "y" => self.position.y = value,
            "z" => self.position.z = value,
            "nx" => self.normal.x = value as f32,
            "ny" => self.normal.y = value as f32,
            "nz" => self.normal.z = value as f32,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

#[derive(Default)]
struct Face(Vec<u32>);

/// The names that faces' corners go by.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

impl PropertyAccess for Face {
    fn new() -> Face {
        Face::default()
    }

    fn set_list_int(&mut self, name: &str, value: Vec<i32>) -> PropertyAccessResult {
        // What is negative is no vertex: as large as it becomes, there is none either.
        self.set_list_uint(name, value.into_iter().map(|i| u32::try_from(i).unwrap_or(u32::MAX)).collect())
    }

    fn set_list_uint(&mut self, name: &str, value: Vec<u32>) -> PropertyAccessResult {
        if !CORNERS.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        self.0 = value;
        PropertyAccessResult::Set
    }
}

fn ply(bytes: &[u8]) -> Result<Mesh, String> {
    let mut reader = Reader::new(bytes);
    let said = |e: &dyn std::fmt::Display| e.to_string();
    let parser = PlyParser::<Vertex>::new();
    let header = parser.read_header(&mut reader).map_err(|e| said(&e))?;
    let mut mesh = Mesh::default();
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" => {
                let all = parser.read_payload_for_element(&mut reader, element, &header).map_err(|e| said(&e))?;
                mesh.vertices = all.iter().map(|v| v.position).collect();
                let normals = ["nx", "ny", "nz"].iter().all(|n| element.properties.contains_key(*n));
                mesh.normals = normals.then(|| all.iter().map(|v| v.normal).collect());
            }
            "face" => {
                let parser = PlyParser::<Face>::new();
                let all = parser.read_payload_for_element(&mut reader, element, &header).map_err(|e| said(&e))?;
                mesh.triangles = all.iter().flat_map(|f| fan(&f.0)).collect();
            }
            // Elements lie one after the other: what comes last can be left alone, anything else is in the way.
            other if mesh.triangles.is_empty() => return Err(format!("element `{other}` comes before the faces")),
            _ => {}
        }
    }
    Ok(mesh)
}

fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]])
}

/// Refuses elements that name what is not there: its crate counts back from the last one, and multiplies, before it looks.
fn check_indices(bytes: &[u8]) -> Result<(), String> {
    // Of vertices, of what maps are looked up by, of normals.
    let mut counts = [0i128; 3];
    for (i, line) in bytes.split(|b| *b == b'\n').enumerate() {
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => counts[0] += 1,
            Some("vt") => counts[1] += 1,
            Some("vn") => counts[2] += 1,
            Some("f" | "l" | "p") => {
                for (part, count) in words.flat_map(|word| word.split('/').zip(counts)) {
                    // What follows may still be named forwards. What is no number at all the crate refuses.
                    let there =
                        |index: &i128| *index > 0 && *index <= bytes.len() as i128 || *index < 0 && -index <= count;
                    if let Some(index) = part.parse().ok().filter(|index| !there(index)) {
                        return Err(format!("line {} names number {index}, which is not there", i + 1));
                    }
                }
            }
            _ => {}
        }
    }
    Ok(())
}

fn obj(bytes: &[u8]) -> Result<Mesh, String> {
    check_indices(bytes)?;
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let no_materials = |_: &Path| Ok((Vec::new(), Default::default()));
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, no_materials).map_err(|e| e.to_string())?;
    let mut mesh = Mesh { normals: Some(Vec::new()), ..Mesh::default() };
    for model in models {
        let m = model.mesh;
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(m.positions.as_chunks::<3>().0.iter().map(|p| DVec3::from(*p)));
        mesh.triangles.extend(m.indices.as_chunks::<3>().0.iter().map(|t| t.map(|i| first.saturating_add(i))));
        // Normals have indices of their own; a mesh has one a vertex.
        let given = m.normals.as_chunks::<3>().0;
        let mut normals = vec![Vec3::ZERO; m.positions.len() / 3];
        for (vertex, normal) in m.indices.iter().zip(&m.normal_indices) {
            if let (Some(slot), Some(n)) = (normals.get_mut(*vertex as usize), given.get(*normal as usize)) {
                *slot = DVec3::from(*n).as_vec3();
            }
        }
        mesh.normals = mesh.normals.filter(|_| !given.is_empty()).map(|mut all| {
            all.extend(normals);
            all
        });
    }
    Ok(mesh)
}

/// A mesh as a NumPy archive: float64 `vertices`, uint32 `triangles`, float32 `normals` if it has any.
pub fn to_npz(mesh: &Mesh) -> std::io::Result<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    let mut npz = npyz::npz::NpzWriter::new(&mut bytes);
    let shape = |n: usize| [n as u64, 3];
    let mut w =
        npz.array("vertices", Default::default())?.default_dtype().shape(&shape(mesh.vertices.len())).begin_nd()?;
    w.extend(mesh.vertices.iter().flat_map(|v| v.to_array()))?;
    w.finish()?;
    let mut w =
        npz.array("triangles", Default::default())?.default_dtype().shape(&shape(mesh.triangles.len())).begin_nd()?;
    w.extend(mesh.triangles.iter().flatten().copied())?;
    w.finish()?;
    if let Some(normals) = &mesh.normals {
        let mut w =
            npz.array("normals", Default::default())?.default_dtype().shape(&shape(normals.len())).begin_nd()?;
        w.extend(normals.iter().flat_map(|n| n.to_array()))?;
        w.finish()?;
    }
    drop(npz); // writes the archive's directory
    Ok(bytes.into_inner())
}
