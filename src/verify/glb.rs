//! `surface.glb`: that it parses, holds every face, and that its first texture coordinates lie in the unit
//! square.

use super::Verdicts;
use super::arrays::Arrays;
use super::document::Document;
use super::drawing::Drawing;
use super::formulas::{Point2, Point3, bounds3};
use super::patches::Overlap;
use super::surface::UnionFind;
use crate::read::bounded::read_bounded;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;

/// Largest file that is read (bytes); the format's own limit.
const SIZE_LIMIT: u64 = u32::MAX as u64;

/// Triangles overlap where they share more than this, in sides of the unit square: texture coordinates are
/// 32-bit floats.
const PACKED_TOLERANCE: f64 = 1e-6;

/// Islands whose boxes are compared pair by pair.
const MOST_BOXES: usize = 4096;

/// What `surface.glb` is compared with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    faces: usize,
    /// Of the positions.
    low: Point3,
    high: Point3,
}

impl Extent {
    pub(super) fn of(arrays: &Arrays) -> Self {
        let (low, high) = bounds3(&arrays.positions);
        Self {
            faces: arrays.faces.len(),
            low,
            high,
        }
    }

    pub(super) fn stated(faces: usize, low: Point3, high: Point3) -> Self {
        Self { faces, low, high }
    }

    fn with(self, other: &Self) -> Self {
        Self {
            // One of them may be stated, by whoever.
            faces: self.faces.saturating_add(other.faces),
            low: [0, 1, 2].map(|i| self.low[i].min(other.low[i])),
            high: [0, 1, 2].map(|i| self.high[i].max(other.high[i])),
        }
    }
}

pub(super) fn check(folder: &Path, extent: &Extent, document: &Document, verdicts: &mut Verdicts) {
    let path = folder.join("surface.glb");
    if path.exists() || document.is_generated() {
        check_file(&path, |_| Ok(*extent), verdicts);
    }
}

/// The file of all components of an asset, where there is one, against those that it says it holds.
/// The file of several components; whether there is one.
pub(super) fn check_whole(
    folder: &Path,
    parts: &BTreeMap<usize, Extent>,
    verdicts: &mut Verdicts,
) -> bool {
    let path = folder.join("surface.glb");
    if !path.exists() {
        return false;
    }
    let extent_of = |root: &Value| {
        let listed = &root["meshes"][0]["extras"]["affineAtlas"]["components"];
        let listed = listed.as_array().ok_or("names no components")?;
        let mut whole: Option<Extent> = None;
        let mut seen = BTreeSet::new();
        for entry in listed {
            let component = index(&entry["component"]).ok_or("names a component by no number")?;
            let part = parts.get(&component).filter(|_| seen.insert(component));
            let part = part.ok_or_else(|| {
                format!("names component {component}, of which there is no sound atlas")
            })?;
            whole = Some(whole.map_or(*part, |whole| whole.with(part)));
        }
        whole.ok_or_else(|| "names no components".to_owned())
    };
    check_file(&path, extent_of, verdicts);
    true
}

fn check_file(
    path: &Path,
    extent_of: impl FnOnce(&Value) -> Result<Extent, String>,
    verdicts: &mut Verdicts,
) {
    let bytes = match read_bounded(path, SIZE_LIMIT) {
        Ok(bytes) => bytes,
        Err(error) => {
            verdicts.note("surface.glb can be read", false, error);
            return;
        }
    };
    let read = parse(&bytes).and_then(|(root, binary)| {
        let extent = extent_of(&root)?;
        // A triangle of a file takes three bytes at least, whatever is stated.
        let most = extent.faces.min(bytes.len() / 3);
        Ok((draw(&root, binary, most)?, extent))
    });
    let (drawn, extent) = match read {
        Ok(read) => read,
        Err(error) => {
            verdicts.note("surface.glb can be read", false, error);
            return;
        }
    };
    drop(bytes);
    verdicts.note("surface.glb can be read", true, "");
    verdicts.note(
        "surface.glb holds every face",
        drawn.triangles == extent.faces,
        format!("{} of {} triangles", drawn.triangles, extent.faces),
    );
    verdicts.note(
        "packed texture coordinates lie in the unit square",
        drawn.outside == 0,
        format!("{} of {} outside", drawn.outside, drawn.vertices),
    );
    let mut overlap = drawn.packed.overlap(PACKED_TOLERANCE);
    // Inside an island faces lie as in their patch, of which the same is asked.
    if overlap == Overlap::Undecided && boxes_are_apart(&drawn.packed.triangles()) {
        overlap = Overlap::None;
    }
    verdicts.note(
        "packed triangles do not overlap",
        overlap == Overlap::None,
        match overlap {
            Overlap::None => String::new(),
            Overlap::Pair(a, b) => format!("triangles {a} and {b}"),
            Overlap::Undecided => "too thin to be tested".to_owned(),
        },
    );
    let Extent { low, high, .. } = extent;
    let size = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
    let reach = (0..3).fold(0.0, |m: f64, i| m.max(low[i].abs()).max(high[i].abs()));
    let off = (0..3).fold(0.0, |m: f64, i| {
        m.max((drawn.low[i] - low[i]).abs())
            .max((drawn.high[i] - high[i]).abs())
    });
    // Positions are 32-bit floats, so far from the origin the reach limits them, not the size.
    verdicts.note(
        "surface.glb has the surface's bounding box",
        off <= 1e-5 * size + 1e-6 * reach,
        format!("{:.3e} of the size", off / size),
    );
}

/// Whether the boxes of all islands (triangles that hang together by equal corners) lie apart from each other.
fn boxes_are_apart(packed: &[[Point2; 3]]) -> bool {
    let key = |p: Point2| p.map(f64::to_bits);
    let mut island: HashMap<[u64; 2], usize> = HashMap::new();
    let mut islands = UnionFind::new(packed.len());
    for (i, triangle) in packed.iter().enumerate() {
        for p in triangle {
            islands.join(*island.entry(key(*p)).or_insert(i), i);
        }
    }
    let mut boxes: HashMap<usize, [Point2; 2]> = HashMap::new();
    for (i, triangle) in packed.iter().enumerate() {
        let start = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        let [low, high] = boxes.entry(islands.find(i)).or_insert(start);
        for p in triangle {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
    }
    let boxes: Vec<[Point2; 2]> = boxes.into_values().collect();
    let meet = |[a, b]: [Point2; 2], [c, d]: [Point2; 2]| {
        (0..2).all(|k| a[k] < d[k] - PACKED_TOLERANCE && c[k] < b[k] - PACKED_TOLERANCE)
    };
    boxes.len() <= MOST_BOXES
        && (boxes.iter().enumerate()).all(|(i, a)| boxes[i + 1..].iter().all(|b| !meet(*a, *b)))
}

/// The JSON and the binary chunk.
fn parse(bytes: &[u8]) -> Result<(Value, &[u8]), String> {
    let word = |at: usize| {
        let bytes = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as usize)
    };
    if bytes.get(..4) != Some(b"glTF") || word(4) != Some(2) {
        return Err("is no GLB of version 2".to_owned());
    }
    if word(8) != Some(bytes.len()) {
        return Err("has another length than its header says".to_owned());
    }
    let (mut json, mut binary) = (None, None);
    let mut at = 12;
    while at < bytes.len() {
        let (Some(length), Some(kind)) = (word(at), word(at + 4)) else {
            return Err("ends inside a chunk".to_owned());
        };
        let Some(data) = bytes.get(at + 8..).and_then(|rest| rest.get(..length)) else {
            return Err("ends inside a chunk".to_owned());
        };
        match kind {
            0x4E4F_534A if json.is_none() => json = Some(data),
            0x004E_4942 if binary.is_none() => binary = Some(data),
            _ => {}
        }
        at += 8 + length;
    }
    let json = json.ok_or("has no JSON chunk")?;
    let root = serde_json::from_slice(json).map_err(|error| error.to_string())?;
    Ok((root, binary.unwrap_or(&[])))
}

struct Drawn {
    triangles: usize,
    /// The triangles in texture coordinates.
    packed: Drawing,
    vertices: usize,
    outside: usize,
    low: Point3,
    high: Point3,
}

/// Everything that the scenes' meshes draw. Nodes may move a mesh, but not turn or scale it: that is how the
/// contract keeps far-away models precise.
///
/// Many nodes may name one mesh, so the work is bounded: no more than `faces` triangles of own corners.
fn draw(root: &Value, binary: &[u8], faces: usize) -> Result<Drawn, String> {
    let mut drawn = Drawn {
        triangles: 0,
        packed: Drawing {
            corners: Vec::new(),
            points: Vec::new(),
        },
        vertices: 0,
        outside: 0,
        low: [f64::INFINITY; 3],
        high: [f64::NEG_INFINITY; 3],
    };
    let empty = Vec::new();
    for node in root["nodes"].as_array().unwrap_or(&empty) {
        let Some(mesh) = index(&node["mesh"]) else {
            continue;
        };
        if ["rotation", "scale", "matrix"]
            .iter()
            .any(|key| node.get(key).is_some())
        {
            return Err("turns or scales a node".to_owned());
        }
        let shift: Point3 = match &node["translation"] {
            Value::Null => [0.0; 3],
            given => serde_json::from_value(given.clone())
                .map_err(|error| format!("has a translation that is none: {error}"))?,
        };
        let primitives = root["meshes"][mesh]["primitives"]
            .as_array()
            .ok_or("names a mesh that is not there")?;
        for primitive in primitives {
            draw_primitive(root, binary, primitive, shift, &mut drawn)?;
            if drawn.vertices > 3 * faces || drawn.triangles > 2 * faces {
                return Err(format!("draws more than {faces} triangles"));
            }
        }
    }
    Ok(drawn)
}

fn draw_primitive(
    root: &Value,
    binary: &[u8],
    primitive: &Value,
    shift: Point3,
    drawn: &mut Drawn,
) -> Result<(), String> {
    if primitive["mode"].as_u64().unwrap_or(4) != 4 {
        return Err("draws something else than triangles".to_owned());
    }
    let attributes = &primitive["attributes"];
    let positions = Accessor::new(root, binary, &attributes["POSITION"], "VEC3", &[5126])?;
    let uv = Accessor::new(
        root,
        binary,
        &attributes["TEXCOORD_0"],
        "VEC2",
        &[5126, 5121, 5123],
    )?;
    if uv.count != positions.count {
        return Err("has attributes of different counts".to_owned());
    }
    let first = drawn.packed.points.len();
    if u32::try_from(first.saturating_add(positions.count)).is_err() {
        return Err("has too many vertices".to_owned());
    }
    for position in positions.rows::<3>() {
        for (k, shift) in shift.iter().enumerate() {
            let x = position[k] + shift;
            if !x.is_finite() {
                return Err("has infinite positions".to_owned());
            }
            drawn.low[k] = drawn.low[k].min(x);
            drawn.high[k] = drawn.high[k].max(x);
        }
    }
    let packed = &mut drawn.packed;
    for point in uv.rows::<2>() {
        let inside = point.iter().all(|x| (0.0..=1.0).contains(x));
        drawn.outside += usize::from(!inside);
        packed.points.push(point);
    }
    drawn.vertices += positions.count;
    let indices = match primitive.get("indices") {
        None => None,
        Some(at) => Some(Accessor::new(
            root,
            binary,
            at,
            "SCALAR",
            &[5121, 5123, 5125],
        )?),
    };
    let corners = indices.as_ref().map_or(positions.count, |i| i.count);
    if !corners.is_multiple_of(3) {
        return Err("has corners that make no triangle".to_owned());
    }
    packed.corners.reserve(corners / 3);
    let mut add = |triangle: [usize; 3]| {
        if triangle.iter().any(|vertex| *vertex >= positions.count) {
            return Err("has an index beyond its vertices".to_owned());
        }
        // Below the number of points, which was tested above.
        packed.corners.push(triangle.map(|v| (first + v) as u32));
        Ok(())
    };
    match &indices {
        None => (0..corners / 3).try_for_each(|t| add([3 * t, 3 * t + 1, 3 * t + 2]))?,
        Some(indices) => {
            let mut corners = indices.rows::<1>();
            // Whole numbers below 2³², so the conversion is exact.
            while let (Some([a]), Some([b]), Some([c])) =
                (corners.next(), corners.next(), corners.next())
            {
                add([a, b, c].map(|x| x as usize))?;
            }
        }
    }
    drawn.triangles += corners / 3;
    Ok(())
}

fn index(value: &Value) -> Option<usize> {
    usize::try_from(value.as_u64()?).ok()
}

/// Numbers of a buffer view of the binary chunk, tested to lie inside it.
struct Accessor<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: usize,
    kind: u64,
    is_scalar: bool,
}

impl<'a> Accessor<'a> {
    fn new(
        root: &Value,
        binary: &'a [u8],
        at: &Value,
        shape: &str,
        kinds: &[u64],
    ) -> Result<Self, String> {
        let at = index(at).ok_or_else(|| format!("lacks an accessor of {shape}"))?;
        let accessor = &root["accessors"][at];
        let kind = accessor["componentType"].as_u64().unwrap_or(0);
        if accessor["type"] != shape || !kinds.contains(&kind) || accessor.get("sparse").is_some() {
            return Err(format!("has accessor {at} of another kind than {shape}"));
        }
        let overrun = || format!("has accessor {at} that runs beyond the data");
        let view = index(&accessor["bufferView"]).ok_or_else(overrun)?;
        let view = &root["bufferViews"][view];
        let number = |value: &Value| match value {
            Value::Null => Some(0),
            value => index(value),
        };
        let start = number(&view["byteOffset"]).ok_or_else(overrun)?;
        let length = index(&view["byteLength"]).ok_or_else(overrun)?;
        let offset = number(&accessor["byteOffset"]).ok_or_else(overrun)?;
        let count = index(&accessor["count"]).ok_or_else(overrun)?;
        let size = width(kind)
            * if shape == "SCALAR" {
                1
            } else {
                usize::from(shape == "VEC3") + 2
            };
        let stride = match number(&view["byteStride"]).ok_or_else(overrun)? {
            0 => size,
            stride => stride,
        };
        if view["buffer"].as_u64() != Some(0) || stride < size {
            return Err(overrun());
        }
        let bytes = binary
            .get(start..)
            .and_then(|rest| rest.get(..length))
            .and_then(|view| view.get(offset..))
            .ok_or_else(overrun)?;
        let end = match count.checked_sub(1) {
            None => Some(0),
            Some(last) => last
                .checked_mul(stride)
                .and_then(|end| end.checked_add(size)),
        };
        if end.is_none_or(|end| end > bytes.len()) {
            return Err(overrun());
        }
        Ok(Self {
            bytes,
            stride,
            count,
            kind,
            is_scalar: shape == "SCALAR",
        })
    }

    /// All rows of `N` numbers.
    fn rows<const N: usize>(&self) -> impl Iterator<Item = [f64; N]> + '_ {
        (0..self.count).map(|row| std::array::from_fn(|column| self.component(row, column)))
    }

    /// One number; normalised integers as fractions of their greatest value.
    fn component(&self, row: usize, column: usize) -> f64 {
        let width = width(self.kind);
        let at = row * self.stride + column * width;
        let b = &self.bytes[at..at + width];
        match self.kind {
            5126 => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            5125 => f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            5123 => f64::from(u16::from_le_bytes([b[0], b[1]])) / self.unit(u16::MAX.into()),
            _ => f64::from(b[0]) / self.unit(u8::MAX.into()),
        }
    }

    /// What one stands for: the greatest value in texture coordinates, one in indices.
    fn unit(&self, greatest: f64) -> f64 {
        if self.is_scalar { 1.0 } else { greatest }
    }
}

/// Bytes of a component type.
fn width(kind: u64) -> usize {
    match kind {
        5125 | 5126 => 4,
        5123 => 2,
        _ => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn glb(root: &Value, binary: &[u8]) -> Vec<u8> {
        let mut json = root.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bytes = b"glTF\x02\0\0\0".to_vec();
        let total = 12 + 8 + json.len() + 8 + binary.len();
        bytes.extend((total as u32).to_le_bytes());
        bytes.extend((json.len() as u32).to_le_bytes());
        bytes.extend(b"JSON");
        bytes.extend(&json);
        bytes.extend((binary.len() as u32).to_le_bytes());
        bytes.extend(b"BIN\0");
        bytes.extend(binary);
        bytes
    }

    fn triangle() -> (Value, Vec<u8>) {
        let mut binary = Vec::new();
        for x in [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
            binary.extend(x.to_le_bytes());
        }
        for x in [0.0f32, 0.0, 1.0, 0.0, 0.0, 1.0] {
            binary.extend(x.to_le_bytes());
        }
        let root = json!({
            "nodes": [{"mesh": 0, "translation": [5.0, 0.0, 0.0]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}]}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
            ],
            "bufferViews": [
                {"buffer": 0, "byteLength": 36},
                {"buffer": 0, "byteOffset": 36, "byteLength": 24},
            ],
        });
        (root, binary)
    }

    fn run(root: &Value, binary: &[u8]) -> Result<Drawn, String> {
        let bytes = glb(root, binary);
        let (root, binary) = parse(&bytes)?;
        draw(&root, binary, 1)
    }

    #[test]
    fn a_triangle_is_drawn_where_its_node_puts_it() {
        let (root, binary) = triangle();
        let drawn = run(&root, &binary).expect("a good file");
        assert_eq!((drawn.triangles, drawn.vertices, drawn.outside), (1, 3, 0));
        assert_eq!(drawn.low, [5.0, 0.0, 0.0]);
        assert_eq!(drawn.high, [6.0, 1.0, 0.0]);
    }

    #[test]
    fn counts_and_offsets_beyond_the_data_are_refused() {
        for (path, value) in [
            ("/accessors/0/count", json!(4)),
            ("/accessors/0/count", json!(u64::MAX)),
            ("/bufferViews/1/byteOffset", json!(40)),
            ("/bufferViews/1/byteOffset", json!(u64::MAX)),
            ("/bufferViews/0/byteLength", json!(-1)),
            ("/accessors/1/bufferView", json!(9)),
            ("/meshes/0/primitives/0/attributes/TEXCOORD_0", json!(null)),
            ("/nodes/0/mesh", json!(3)),
        ] {
            let (mut root, binary) = triangle();
            *root.pointer_mut(path).expect("a path of the file") = value;
            assert!(run(&root, &binary).is_err(), "{path}");
        }
    }

    #[test]
    fn no_cut_of_the_file_panics() {
        let (root, binary) = triangle();
        let bytes = glb(&root, &binary);
        for end in 0..bytes.len() {
            assert!(parse(&bytes[..end]).is_err());
        }
    }
}
