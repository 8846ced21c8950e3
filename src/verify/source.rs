//! Comparison with the mesh that the atlas was made from.

use super::Verdicts;
use super::arrays::{Arrays, NONE};
use super::document::Document;
use super::formulas::{Point3, Worst, area3, bounds3, cross3, distance3, norm3, sub3};

/// The input file's vertices and triangles (polygons fanned from their first vertex), in file order.
#[derive(Clone, Copy, Debug)]
pub struct SourceSurface<'a> {
    /// Vertices of the file.
    pub positions: &'a [[f64; 3]],
    /// Triangles of the file; rows with vertices that are not there fail the check.
    pub faces: &'a [[u32; 3]],
}

/// Largest distance from the source, in sizes of the source.
const TOLERANCE: f64 = 1e-6;

pub(super) fn check(
    arrays: &Arrays,
    document: &Document,
    source: &SourceSurface<'_>,
    verdicts: &mut Verdicts,
) {
    let count = source.positions.len();
    let sound = source
        .faces
        .as_flattened()
        .iter()
        .all(|v| (*v as usize) < count);
    if !verdicts.note(
        "source mesh is sound",
        sound && !source.faces.is_empty(),
        format!("{count} vertices, {} faces", source.faces.len()),
    ) {
        return;
    }
    let corners = |f: usize| source.faces[f].map(|v| source.positions[v as usize]);
    let used = source.faces.as_flattened().iter();
    let used: Vec<Point3> = used.map(|v| source.positions[*v as usize]).collect();
    let (low, high) = bounds3(&used);
    let size = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
    if document.source.components == 1 {
        let before: f64 = (0..source.faces.len()).map(|f| area3(corners(f))).sum();
        let after: f64 = (0..arrays.faces.len())
            .map(|f| area3(arrays.triangle(f)))
            .sum();
        verdicts.note(
            "surface area equals the source's",
            (before - after).abs() < TOLERANCE * before,
            format!("{:.3e}", after / before - 1.0),
        );
        let (min, max) = bounds3(&arrays.positions);
        let mut off = Worst::default();
        for i in 0..3 {
            off.see((min[i] - low[i]).abs() / size);
            off.see((max[i] - high[i]).abs() / size);
        }
        verdicts.note(
            "bounding box equals the source's",
            off.0 <= TOLERANCE,
            format!("{:.3e} of the size", off.0),
        );
    }
    let (mut known, mut stray) = (0, 0);
    let mut off = Worst::default();
    for (p, v) in arrays.positions.iter().zip(&arrays.source_vertex) {
        if *v == NONE {
            continue;
        }
        known += 1;
        match source.positions.get(*v as usize) {
            Some(q) => off.see(distance3(*p, *q) / size),
            None => stray += 1,
        }
    }
    verdicts.note(
        "source_vertex points to the input's vertices",
        known > 0 && stray == 0 && off.0 < TOLERANCE,
        format!(
            "{known} of {}, {:.2e} of the size off",
            arrays.positions.len(),
            off.0
        ),
    );
    let mut strays = 0;
    let mut off = Worst::default();
    for (f, parent) in arrays.source_face.iter().enumerate() {
        if *parent as usize >= source.faces.len() {
            strays += 1;
            continue;
        }
        let [a, b, c] = corners(*parent as usize);
        let normal = cross3(sub3(b, a), sub3(c, a));
        let length = norm3(normal);
        if length > 0.0 {
            let t = arrays.triangle(f);
            let middle: Point3 = std::array::from_fn(|i| (t[0][i] + t[1][i] + t[2][i]) / 3.0);
            let away = sub3(middle, a);
            let height: f64 = (0..3).map(|i| away[i] * normal[i] / length).sum();
            off.see(height.abs() / size);
        }
    }
    verdicts.note(
        "faces lie in their source_face",
        strays == 0 && off.0 < TOLERANCE,
        format!("{:.2e} of the size off the plane, {strays} stray", off.0),
    );
}
