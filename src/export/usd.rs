//! Control meshes of Catmull–Clark subdivision as the text of USD (`.usda`).
//!
//! *Enters:* [`ControlMesh`]es, and the length of their unit. *Leaves:* the text of a layer, whose default prim is an `Xform` with
//! one `Mesh` a component. *Guaranteed:* equal meshes give equal bytes; the names of prims are identifiers of ASCII letters, digits
//! and underscores, and differ.
//!
//! USD stores points in single precision. Where a coordinate is more than four times as large as the longest side of the bounding
//! box, the `Xform` carries a translation in double precision, by the centre of the box rounded to single precision, and points are
//! relative to it; without that, a small part far from the origin would lose digits. Numbers have the shortest decimals that give
//! their single-precision values back. Sharpness 10 is what USD calls infinitely sharp. Borders are sharp anyway, and so are their
//! vertices with one face (`edgeAndCorner`), so they need no creases.

use std::collections::HashSet;
use std::fmt::Display;
use std::io::{self, Write};

/// The default prim.
const ROOT: &str = "components";
/// A coordinate this many times as large as the bounding box calls for a translation.
const FAR: f64 = 4.0;
/// Infinitely sharp.
const SHARP: u32 = 10;

/// A control mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct ControlMesh<'a> {
    /// What it is called; its prim has this name as far as USD allows.
    pub name: String,
    /// Control points.
    pub points: &'a [[f64; 3]],
    /// Quads, counterclockwise seen from outside.
    pub faces: &'a [[u32; 4]],
    /// Infinitely sharp edges, as chains of vertices; a closed chain repeats its first.
    pub creases: Vec<Vec<u32>>,
    /// Infinitely sharp vertices.
    pub corners: &'a [u32],
}

/// Writes the layer.
///
/// # Errors
/// Those of the writer. [`io::ErrorKind::InvalidInput`] where a number is not finite in single precision, the unit is not positive,
/// a vertex has no point, or a crease has fewer than two vertices; then nothing has been written.
pub fn write(
    meshes: &[ControlMesh<'_>],
    metres_per_unit: f64,
    out: &mut impl Write,
) -> io::Result<()> {
    let centre = centre(meshes);
    let invalid = |what| io::Error::new(io::ErrorKind::InvalidInput, what);
    if !(metres_per_unit.is_finite() && metres_per_unit > 0.0) {
        return Err(invalid("a unit without length".to_owned()));
    }
    for mesh in meshes {
        check(mesh, centre).map_err(|what| invalid(format!("{}: {what}", mesh.name)))?;
    }
    writeln!(out, "#usda 1.0")?;
    writeln!(out, "(")?;
    writeln!(out, "    defaultPrim = \"{ROOT}\"")?;
    writeln!(out, "    metersPerUnit = {metres_per_unit:?}")?;
    writeln!(out, "    upAxis = \"Y\"")?;
    writeln!(out, ")")?;
    writeln!(out)?;
    writeln!(out, "def Xform \"{ROOT}\"")?;
    writeln!(out, "{{")?;
    if let Some(centre) = centre {
        let centre = tuple(centre.map(f64::from));
        writeln!(out, "    double3 xformOp:translate = {centre}")?;
        writeln!(
            out,
            "    uniform token[] xformOpOrder = [\"xformOp:translate\"]"
        )?;
    }
    let mut taken = HashSet::new();
    for (i, mesh) in meshes.iter().enumerate() {
        if i > 0 || centre.is_some() {
            writeln!(out)?;
        }
        prim(mesh, &identifier(&mesh.name, &mut taken), centre, out)?;
    }
    writeln!(out, "}}")
}

/// The translation, where one is needed.
fn centre(meshes: &[ControlMesh<'_>]) -> Option<[f32; 3]> {
    let (low, high) = bounds(meshes.iter().flat_map(|mesh| mesh.points.iter().copied()))?;
    let axes = [0, 1, 2];
    let size = axes
        .map(|c| high[c] - low[c])
        .into_iter()
        .fold(0.0, f64::max);
    let farthest = axes
        .map(|c| low[c].abs().max(high[c].abs()))
        .into_iter()
        .fold(0.0, f64::max);
    (farthest > FAR * size).then(|| axes.map(|c| (0.5 * low[c] + 0.5 * high[c]) as f32))
}

fn bounds<T: Copy + PartialOrd>(points: impl Iterator<Item = [T; 3]>) -> Option<([T; 3], [T; 3])> {
    points
        .map(|point| (point, point))
        .reduce(|(low, high), (point, _)| {
            let pick = |is_better: fn(&T, &T) -> bool, best: [T; 3]| {
                [0, 1, 2].map(|c| {
                    if is_better(&point[c], &best[c]) {
                        point[c]
                    } else {
                        best[c]
                    }
                })
            };
            (pick(T::lt, low), pick(T::gt, high))
        })
}

/// Points as the file holds them. Zero has no sign.
fn stored(points: &[[f64; 3]], centre: Option<[f32; 3]>) -> impl Iterator<Item = [f32; 3]> {
    let centre = centre.unwrap_or_default();
    points
        .iter()
        .map(move |point| [0, 1, 2].map(|c| (point[c] - f64::from(centre[c])) as f32 + 0.0))
}

/// What is wrong with a mesh.
fn check(mesh: &ControlMesh<'_>, centre: Option<[f32; 3]>) -> Result<(), &'static str> {
    if !stored(mesh.points, centre).flatten().all(f32::is_finite) {
        return Err("a point that is not finite in single precision");
    }
    let is_point =
        |&vertex: &u32| (vertex as usize) < mesh.points.len() && i32::try_from(vertex).is_ok();
    let mut vertices = mesh
        .faces
        .iter()
        .flatten()
        .chain(mesh.creases.iter().flatten())
        .chain(mesh.corners);
    if !vertices.all(is_point) {
        return Err("a vertex without a point");
    }
    if mesh.creases.iter().any(|chain| chain.len() < 2) {
        return Err("a crease without an edge");
    }
    Ok(())
}

/// A name that USD allows and no other prim here has.
fn identifier(name: &str, taken: &mut HashSet<String>) -> String {
    let letters = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let mut plain: String = name.chars().map(letters).collect();
    if !plain.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
        plain.insert(0, '_');
    }
    let mut chosen = plain.clone();
    let mut number = 1;
    while !taken.insert(chosen.clone()) {
        number += 1;
        chosen = format!("{plain}_{number}");
    }
    chosen
}

fn prim(
    mesh: &ControlMesh<'_>,
    name: &str,
    centre: Option<[f32; 3]>,
    out: &mut impl Write,
) -> io::Result<()> {
    writeln!(out, "    def Mesh \"{name}\"")?;
    writeln!(out, "    {{")?;
    if let Some((low, high)) = bounds(stored(mesh.points, centre)) {
        attribute("float3[] extent", [low, high].map(tuple), out)?;
    }
    attribute(
        "int[] faceVertexCounts",
        mesh.faces.iter().map(|face| face.len()),
        out,
    )?;
    attribute("int[] faceVertexIndices", mesh.faces.iter().flatten(), out)?;
    attribute(
        "point3f[] points",
        stored(mesh.points, centre).map(tuple),
        out,
    )?;
    writeln!(out, "        token interpolateBoundary = \"edgeAndCorner\"")?;
    writeln!(
        out,
        "        uniform token subdivisionScheme = \"catmullClark\""
    )?;
    if !mesh.creases.is_empty() {
        attribute("int[] creaseIndices", mesh.creases.iter().flatten(), out)?;
        attribute(
            "int[] creaseLengths",
            mesh.creases.iter().map(Vec::len),
            out,
        )?;
        attribute(
            "float[] creaseSharpnesses",
            mesh.creases.iter().map(|_| SHARP),
            out,
        )?;
    }
    if !mesh.corners.is_empty() {
        attribute("int[] cornerIndices", mesh.corners, out)?;
        attribute(
            "float[] cornerSharpnesses",
            mesh.corners.iter().map(|_| SHARP),
            out,
        )?;
    }
    writeln!(out, "    }}")
}

fn attribute(
    what: &str,
    values: impl IntoIterator<Item = impl Display>,
    out: &mut impl Write,
) -> io::Result<()> {
    write!(out, "        {what} = [")?;
    for (i, value) in values.into_iter().enumerate() {
        let comma = if i > 0 { ", " } else { "" };
        write!(out, "{comma}{value}")?;
    }
    writeln!(out, "]")
}

/// Coordinates with the shortest decimals that give them back.
fn tuple<T: std::fmt::Debug>([x, y, z]: [T; 3]) -> String {
    let short = |x: T| {
        let mut digits = format!("{x:?}");
        if digits.ends_with(".0") {
            digits.truncate(digits.len() - 2);
        }
        digits
    };
    format!("({}, {}, {})", short(x), short(y), short(z))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBE: [[u32; 4]; 6] = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];

    fn points(size: f64, from: f64) -> Vec<[f64; 3]> {
        (0..8_u32)
            .map(|i| [i & 1, i >> 1 & 1, i >> 2 & 1].map(|bit| from + size * f64::from(bit)))
            .collect()
    }

    fn mesh<'a>(name: &str, points: &'a [[f64; 3]]) -> ControlMesh<'a> {
        ControlMesh {
            name: name.to_owned(),
            points,
            faces: &CUBE,
            creases: vec![vec![0, 1, 3, 2, 0], vec![4, 5]],
            corners: &[7],
        }
    }

    fn layer(meshes: &[ControlMesh<'_>]) -> io::Result<String> {
        let mut out = Vec::new();
        write(meshes, 0.001, &mut out)?;
        String::from_utf8(out).map_err(io::Error::other)
    }

    /// Numbers of an attribute.
    fn values(layer: &str, attribute: &str) -> Vec<f64> {
        let start = format!("{attribute} = ");
        let line = layer.lines().find_map(|l| l.trim().strip_prefix(&start));
        line.unwrap()
            .split(['[', ']', '(', ')', ',', ' '])
            .filter(|x| !x.is_empty())
            .map(|x| x.parse().unwrap())
            .collect()
    }

    #[test]
    fn mesh_is_whole() {
        let points = points(1.0, -0.5);
        let layer = layer(&[mesh("cube", &points)]).unwrap();
        assert_eq!(values(&layer, "metersPerUnit"), [0.001]);
        assert_eq!(values(&layer, "int[] faceVertexCounts"), [4.0; 6]);
        let corners: Vec<f64> = CUBE.iter().flatten().map(|&v| f64::from(v)).collect();
        assert_eq!(values(&layer, "int[] faceVertexIndices"), corners);
        assert_eq!(values(&layer, "point3f[] points"), points.concat());
        let extent = values(&layer, "float3[] extent");
        assert_eq!(extent, [-0.5, -0.5, -0.5, 0.5, 0.5, 0.5]);
        let chains = values(&layer, "int[] creaseIndices");
        assert_eq!(chains, [0.0, 1.0, 3.0, 2.0, 0.0, 4.0, 5.0]);
        assert_eq!(values(&layer, "int[] creaseLengths"), [5.0, 2.0]);
        assert_eq!(values(&layer, "float[] creaseSharpnesses"), [10.0; 2]);
        assert_eq!(values(&layer, "int[] cornerIndices"), [7.0]);
        assert_eq!(values(&layer, "float[] cornerSharpnesses"), [10.0]);
        assert!(!layer.contains("translate"));
        assert_eq!(layer.matches('{').count(), layer.matches('}').count());
    }

    #[test]
    fn far_meshes_keep_their_digits() {
        let points = points(1e-3, 12_345.678);
        let layer = layer(&[mesh("far", &points)]).unwrap();
        let centre = values(&layer, "double3 xformOp:translate");
        assert!(centre.iter().all(|&c| f64::from(c as f32) == c));
        let stored = values(&layer, "point3f[] points");
        for (i, (x, wanted)) in stored.iter().zip(points.concat()).enumerate() {
            let x = f64::from(*x as f32) + centre[i % 3];
            assert!((x - wanted).abs() < 1e-9);
        }
    }

    #[test]
    fn names_are_identifiers_and_differ() {
        let mut taken = HashSet::new();
        let names = ["2 Größe", "a b", "a_b", "", "a_b_2", "a-b"];
        let found = names.map(|name| identifier(name, &mut taken));
        assert_eq!(found, ["_2_Gr__e", "a_b", "a_b_2", "_", "a_b_2_2", "a_b_3"]);
    }

    #[test]
    fn what_usd_cannot_hold_is_refused() {
        let (good, large) = (points(1.0, 0.0), points(1e39, 0.0));
        let bad = [
            mesh("large", &large),
            mesh("short", &good[..7]),
            ControlMesh {
                creases: vec![vec![1]],
                ..mesh("crease", &good)
            },
        ];
        for mesh in bad {
            let error = layer(&[mesh]).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
        }
        for unit in [0.0, -1.0, f64::NAN] {
            assert!(write(&[], unit, &mut Vec::new()).is_err());
        }
    }
}
