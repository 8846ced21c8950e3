//! What can be wrong with a mesh file.
//!
//! Each message is one sentence with the indices and both numbers, and ends in what to change.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// A file that was refused, and why.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct ReadError {
    /// The file, as the caller named it.
    pub path: PathBuf,
    /// What is wrong with it.
    pub problem: Box<ReadProblem>,
}

impl ReadError {
    pub(super) fn new(path: &Path, problem: ReadProblem) -> Self {
        Self {
            path: path.to_path_buf(),
            problem: Box::new(problem),
        }
    }
}

/// Where in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line of a text file, counted from 1.
    Line(usize),
    /// Byte of a binary file, counted from 0.
    Byte(usize),
    /// glTF primitive under a node.
    Primitive {
        /// Node index.
        node: usize,
        /// Mesh index.
        mesh: usize,
        /// Primitive index within the mesh.
        primitive: usize,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
            Self::Primitive {
                node,
                mesh,
                primitive,
            } => write!(f, "node {node}, mesh {mesh}, primitive {primitive}"),
        }
    }
}

/// The system's reason in words, without the number that some systems add.
fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "it does not exist".to_owned(),
        io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        _ => error.to_string(),
    }
}

/// What is wrong with a file.
#[derive(Debug, thiserror::Error)]
pub enum ReadProblem {
    // ---- the file as a whole
    /// The operating system refused.
    #[error(
        "cannot be read ({}); check that the file exists and that you may read it",
        reason(source)
    )]
    Io {
        /// The system's reason.
        source: io::Error,
    },
    /// A folder or a device.
    #[error("is not a regular file; name a mesh file")]
    NotAFile,
    /// The name has no extension.
    #[error(
        "has no file name extension; give a mesh whose name ends in one of .gltf, .glb, .obj, .ply, .stl, .off"
    )]
    NoExtension,
    /// The name's extension is none of ours.
    #[error(
        "the extension .{extension} is not supported; convert the mesh to .gltf, .glb, .obj, .ply, .stl or .off"
    )]
    UnknownExtension {
        /// The extension.
        extension: String,
    },
    /// More bytes than allowed.
    #[error(
        "{what} would bring the asset to {bytes} bytes, more than max_file_bytes = {limit}; raise the limit or simplify the mesh"
    )]
    TooManyBytes {
        /// What is being read.
        what: String,
        /// Bytes in all.
        bytes: u64,
        /// The limit.
        limit: u64,
    },
    /// More unpacked than the size of the files warrants.
    #[error(
        "{what} would make the asset unpack to {bytes} bytes, more than the {limit} that are granted for {files} bytes of files; store values plainly and once instead of sparse, repeated or compressed, or split the asset"
    )]
    TooMuchUnpacked {
        /// What is being unpacked.
        what: String,
        /// Unpacked bytes in all.
        bytes: u64,
        /// The limit.
        limit: u64,
        /// Bytes of all files.
        files: u64,
    },
    /// More vertices than allowed.
    #[error(
        "has {count} vertices or more, beyond max_vertices = {limit}; raise the limit or simplify the mesh"
    )]
    TooManyVertices {
        /// Vertices counted or declared so far.
        count: u64,
        /// The limit.
        limit: u64,
    },
    /// More triangles than allowed.
    #[error(
        "has {count} triangles or more, beyond max_faces = {limit}; raise the limit or simplify the mesh"
    )]
    TooManyFaces {
        /// Triangles counted or declared so far.
        count: u64,
        /// The limit.
        limit: u64,
    },
    /// No triangle.
    #[error(
        "holds no triangle ({vertices} vertices, 0 faces); export a surface mesh, not points or curves"
    )]
    EmptyMesh {
        /// Vertices in the file.
        vertices: usize,
    },
    /// A coordinate that is NaN or infinite.
    #[error(
        "vertex {vertex} ({place}) has {axis} = {value}; every coordinate must be a finite number, so repair or remove that vertex"
    )]
    NotFinite {
        /// Vertex in the running count from 0.
        vertex: usize,
        /// Where.
        place: Place,
        /// `x`, `y` or `z`.
        axis: char,
        /// The value.
        value: f64,
    },
    /// A face refers to a vertex that does not exist.
    #[error(
        "face {face} ({place}) refers to {what} {index}, but there are {count}, counted from {first}; correct the index or add what is missing"
    )]
    IndexOutOfRange {
        /// Triangle in the running count from 0.
        face: usize,
        /// Where.
        place: Place,
        /// `vertex`, `texture coordinate` or `normal`.
        what: &'static str,
        /// The index as the file gives it.
        index: i64,
        /// How many there are.
        count: usize,
        /// 1 in OBJ, 0 elsewhere.
        first: u8,
    },
    /// A polygon with fewer than three corners.
    #[error(
        "face {face} ({place}) has {corners} corners; a face needs at least 3, so remove it or complete it"
    )]
    ShortPolygon {
        /// Triangle in the running count from 0.
        face: usize,
        /// Where.
        place: Place,
        /// Its corners.
        corners: usize,
    },

    // ---- text and headers
    /// Not a number.
    #[error(
        "{place}: `{found}` is not a number; write numbers with a decimal point, like 1.5 or 2e-3"
    )]
    BadNumber {
        /// Where.
        place: Place,
        /// What stands there.
        found: String,
    },
    /// Something else was expected.
    #[error(
        "{place}: expected {expected}, found `{found}`; correct that place or export the mesh again"
    )]
    Expected {
        /// Where.
        place: Place,
        /// What should stand there.
        expected: &'static str,
        /// What stands there.
        found: String,
    },
    /// The file ends early.
    #[error(
        "ends after {available} {unit} where {what} needs {needed}; the file is truncated or its counts are wrong, so export or download it again"
    )]
    Truncated {
        /// What was being read.
        what: &'static str,
        /// `bytes` or something else that is counted.
        unit: &'static str,
        /// How many it needs.
        needed: u64,
        /// How many there are.
        available: u64,
    },
    /// A PLY element lacks a property.
    #[error("the PLY element `{element}` has no property {property}; export the mesh with it")]
    MissingProperty {
        /// Element name.
        element: &'static str,
        /// Property name.
        property: &'static str,
    },
    /// A kind of file that its format allows and we do not read.
    #[error("is {variant}, which is not supported; {remedy}")]
    Unsupported {
        /// What it is.
        variant: &'static str,
        /// What to do.
        remedy: &'static str,
    },

    // ---- glTF
    /// Not JSON, or not glTF's JSON.
    #[error(
        "its glTF JSON cannot be read: {}; export the asset again or correct that place",
        brief(source)
    )]
    Json {
        /// Reason, line and column.
        source: serde_json::Error,
    },
    /// Another version than 2.0.
    #[error(
        "is glTF version {version}, and only 2.0 is supported; import it in a current editor and export it as glTF 2.0"
    )]
    GltfVersion {
        /// The version.
        version: String,
    },
    /// An extension that the file cannot be understood without, and that we do not know.
    #[error("requires the glTF extension {name}, which is not supported; {remedy}")]
    RequiredExtension {
        /// Its name.
        name: String,
        /// What to do.
        remedy: &'static str,
    },
    /// An index that leads nowhere.
    #[error(
        "{from} refers to {what} {index}, but there are {count}, counted from 0; correct the index"
    )]
    MissingReference {
        /// Who refers.
        from: String,
        /// `node`, `mesh`, `accessor`, …
        what: &'static str,
        /// The index.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A URI with a bad escape, bad base64 or a NUL.
    #[error(
        "the URI `{uri}` is malformed (escapes must be %XX of UTF-8, data must be base64); correct it"
    )]
    BadUri {
        /// The URI, shortened.
        uri: String,
    },
    /// A URI that leads out of the asset's folder or to the network.
    #[error(
        "the URI `{uri}` leads out of the asset's folder; put the file beside the asset and refer to it by a relative path"
    )]
    OutsideFolder {
        /// The URI, shortened.
        uri: String,
    },
    /// A referenced file cannot be read.
    #[error(
        "the file `{uri}` it refers to cannot be read ({}); put the file beside the asset",
        reason(source)
    )]
    ReferencedFile {
        /// The URI, shortened.
        uri: String,
        /// The system's reason.
        source: io::Error,
    },
    /// A buffer without URI that is not the GLB's.
    #[error(
        "buffer {buffer} has neither a URI nor a GLB chunk; export the asset again with its data"
    )]
    BufferWithoutData {
        /// Buffer index.
        buffer: usize,
    },
    /// Something lies beyond the end of what holds it.
    #[error(
        "{what} needs {needed} bytes of {container}, which has {available}; the file is truncated or its offsets are wrong, so export it again"
    )]
    OutOfBounds {
        /// Buffer, view or accessor.
        what: String,
        /// Bytes needed.
        needed: u64,
        /// What holds it.
        container: String,
        /// Bytes there are.
        available: u64,
    },
    /// An accessor of another type than its use wants.
    #[error(
        "{name} uses accessor {accessor}, which is {found} where {expected} is wanted; export the asset again"
    )]
    AccessorType {
        /// Attribute name or `indices`.
        name: String,
        /// Accessor index.
        accessor: usize,
        /// Its type.
        found: String,
        /// The type wanted.
        expected: &'static str,
    },
    /// Attributes of one primitive differ in number.
    #[error(
        "{place}: {name} has {count} values for {vertices} vertices; every attribute of a primitive needs the same number, so export the asset again"
    )]
    AttributeCount {
        /// Which primitive.
        place: Place,
        /// Attribute name.
        name: String,
        /// Its values.
        count: u64,
        /// Vertices of the primitive.
        vertices: u64,
    },
    /// A sparse accessor replaces a value that does not exist, or too many.
    #[error(
        "accessor {accessor} replaces {what} {index} by its sparse part, but has {count} values; correct the sparse indices"
    )]
    SparseIndex {
        /// Accessor index.
        accessor: usize,
        /// `value` or `number of values`.
        what: &'static str,
        /// The index or number.
        index: u64,
        /// Its values.
        count: u64,
    },
    /// A node that is reached twice.
    #[error(
        "node {node} is reached twice (a cycle or two parents), and glTF nodes must form trees; remove one reference to it"
    )]
    NodeRepeated {
        /// Node index.
        node: usize,
    },
    /// A transform that is no transform.
    #[error("node {node} has a transform that is not finite or a rotation of length 0; correct it")]
    NodeTransform {
        /// Node index.
        node: usize,
    },
    /// Compressed data that cannot be unpacked.
    #[error(
        "buffer view {view} (EXT_meshopt_compression or KHR_meshopt_compression) cannot be unpacked: {reason}; export the asset without the compression or unpack it with `npx @gltf-transform/cli copy in.glb out.glb`"
    )]
    Meshopt {
        /// Buffer view index.
        view: usize,
        /// What is wrong.
        reason: MeshoptError,
    },
    /// Draco data that cannot be unpacked.
    #[error(
        "{place}: the data of KHR_draco_mesh_compression cannot be unpacked: {reason}; export the asset without the compression or unpack it with `npx @gltf-transform/cli copy in.glb out.glb`"
    )]
    Draco {
        /// Which primitive.
        place: Place,
        /// The decoder's reason.
        reason: String,
    },
}

/// What is wrong with meshopt-compressed data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshoptError {
    /// Unknown first byte.
    #[error("unknown header byte {0:#04x}")]
    Header(u8),
    /// Ends early.
    #[error("the data ends after {available} bytes where at least {needed} are needed")]
    Truncated {
        /// Bytes needed.
        needed: usize,
        /// Bytes there are.
        available: usize,
    },
    /// Bytes remain.
    #[error("{0} bytes remain after the last value")]
    Trailing(usize),
    /// Stride, count or filter do not fit the mode.
    #[error("stride {stride}, count {count} or filter do not fit the mode")]
    Layout {
        /// Bytes a value.
        stride: u64,
        /// Number of values.
        count: u64,
    },
    /// The unpacked size is not the view's.
    #[error("it unpacks to {unpacked} bytes where the view has {view}")]
    Size {
        /// Bytes after unpacking.
        unpacked: u64,
        /// Bytes of the view.
        view: u64,
    },
    /// A code without meaning.
    #[error("meaningless code at byte {0}")]
    Code(usize),
    /// Mode or filter of an unknown name.
    #[error("unknown mode or filter")]
    Mode,
}

/// A JSON error that quotes no more than a line of the file.
fn brief(error: &serde_json::Error) -> String {
    let text = error.to_string();
    if text.chars().count() <= 200 {
        return text;
    }
    let start = shorten(text.as_bytes());
    let (line, column) = (error.line(), error.column());
    format!("{start} at line {line} column {column}")
}

/// At most 40 characters of what stands in a file, printable.
pub(super) fn shorten(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(160)]);
    let mut short: String = text
        .chars()
        .take(40)
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .collect();
    if text.chars().count() > 40 || bytes.len() > 160 {
        short.push('…');
    }
    short
}
