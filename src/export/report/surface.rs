//! The surface of an atlas as the page draws it, in space and in the plane.
//!
//! *Enters:* an [`AffineAtlas`] and the distortion of its faces. *Leaves:* a [`Drawing`]: arrays as text, and what is needed to
//! read and colour them. A row of the plane is a vertex in one patch on one side of the cut; faces refer to these.
//!
//! *Guaranteed:* positions to a 65,536th of the box, the chart to an 8-millionth of its own, log scale and angle error to a 65,536th of
//! their range.

use super::pack::Archive;
use crate::export::pictures::checkerboard::{
    CELL_RANGE, Checkerboard, ascending, excess, weighted_quantile,
};
use crate::export::pictures::colour::{categorical, diverging};
use crate::geometry::ids::{FaceId, FaceVec, NONE, VertexId};
use crate::geometry::mesh::{bounding_box, cross, norm, sub};
use crate::product::AffineAtlas;
use crate::report::FaceDistortion;
use rustc_hash::FxHashMap;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::io;

/// What is not negative, pale to dark.
pub(super) const RISING: [[u8; 3]; 5] = [
    [250, 243, 221],
    [242, 190, 120],
    [222, 112, 82],
    [150, 42, 92],
    [58, 12, 72],
];

/// Share of the area that may lie beyond the ends of a scale of colours.
const BEYOND: f64 = 0.005;

/// A surface in the page.
pub(super) struct Drawing {
    /// For the script.
    pub meta: Value,
    /// The arrays.
    pub data: String,
    /// What the scales of colours mean.
    pub scales: Scales,
    /// Whether features are lines.
    pub has_features: bool,
}

/// The ends of the scales of colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scales {
    /// Log scale: middle, and how far the ends are from it.
    pub log_scale: [f64; 2],
    /// Largest angle error of a face at the upper end, radians.
    pub angle_error: f64,
    /// Distance at the upper end, source units; absent where it was not measured.
    pub distance: Option<f64>,
}

/// Packs a surface.
pub(super) fn draw(
    atlas: &AffineAtlas,
    distortion: &FaceVec<Option<FaceDistortion>>,
) -> io::Result<Drawing> {
    let mut archive = Archive::default();
    let (low, high) = vertices(atlas, &mut archive);
    let (level, board) = board(atlas);
    level.pack("level", level.range, &mut archive);
    let chart = plane(atlas, &board, &mut archive);
    let has_features = lines(atlas, &mut archive);
    normals(atlas, &mut archive);
    let rows: Vec<[u32; 1]> = atlas.mesh.source_face.iter().map(|&f| [f]).collect();
    archive.integers("source_face", &rows);
    let (scales, log_range, angle_max) = distortions(distortion, &mut archive);
    let (distance, distance_max) = distances(atlas, &mut archive);
    let scales = Scales { distance, ..scales };
    let cones: Vec<Value> = (atlas.prescription.cones.iter())
        .map(|cone| {
            let source = atlas.mesh.source_vertex[cone.vertex];
            json!({
                "vertex": cone.vertex.raw(),
                "source_vertex": (source != NONE).then_some(source),
                "curvature": cone.curvature,
            })
        })
        .collect();
    let (sections, data) = archive.finish()?;
    let meta = json!({
        "sections": sections,
        "low": low,
        "high": high,
        "level": level.range,
        "cell_range": CELL_RANGE,
        "chart": { "low": chart.0, "high": chart.1 },
        "log_scale": log_range,
        "log_scale_colours": { "middle": scales.log_scale[0], "reach": scales.log_scale[1] },
        "angle_error": angle_max,
        "angle_colours": scales.angle_error,
        "distance": distance_max,
        "distance_colours": distance,
        "diverging": (0..7).map(|i| diverging(f64::from(i) / 3.0 - 1.0)).collect::<Vec<_>>(),
        "rising": RISING,
        "patches": (0..atlas.patches.patches.len()).map(categorical).collect::<Vec<_>>(),
        "cones": cones,
    });
    Ok(Drawing {
        meta,
        data,
        scales,
        has_features,
    })
}

/// Values and the least and greatest of them.
struct Ranged {
    values: Vec<f64>,
    range: [f64; 2],
}

impl Ranged {
    /// Not finite ones count as 0.
    fn new(values: impl Iterator<Item = f64>) -> Ranged {
        let values: Vec<f64> = values
            .map(|x| if x.is_finite() { x } else { 0.0 })
            .collect();
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let range = if low <= high { [low, high] } else { [0.0; 2] };
        Ranged { values, range }
    }

    /// Adds them to an archive.
    fn pack(&self, name: &str, range: [f64; 2], archive: &mut Archive) {
        let place = |&x: &f64| [quantise(x, range, 65_535.0)];
        archive.integers(name, &self.values.iter().map(place).collect::<Vec<_>>());
    }
}

/// The share of the way from low to high, in `steps`.
fn quantise(x: f64, [low, high]: [f64; 2], steps: f64) -> u32 {
    let share = (x - low)
        / if high > low {
            high - low
        } else {
            f64::INFINITY
        };
    (share.clamp(0.0, 1.0) * steps).round() as u32
}

fn vertices(atlas: &AffineAtlas, archive: &mut Archive) -> ([f64; 3], [f64; 3]) {
    let positions = atlas.mesh.positions.as_slice();
    let (low, high) = bounding_box(positions);
    let place = |p: &[f64; 3]| std::array::from_fn(|i| quantise(p[i], [low[i], high[i]], 65_535.0));
    let rows: Vec<[u32; 3]> = positions.iter().map(place).collect();
    archive.integers("position", &rows);
    (low, high)
}

/// How large cells of the checkerboard would be at each vertex, and where in it each corner lies, in cells of the middle size.
///
/// Places are taken relative to the patch, up to an even number of its largest cells, so that single precision holds them.
fn board(atlas: &AffineAtlas) -> (Ranged, FaceVec<[[f32; 2]; 3]>) {
    let board = Checkerboard::new(atlas);
    let levels = Ranged::new(board.levels().iter().copied());
    let c = &atlas.mesh.connectivity;
    let patch_of = |f: FaceId| atlas.patches.face_patch[f].index();
    // The largest cell of each patch, as a power of two.
    let mut step = vec![f64::INFINITY; atlas.patches.patches.len()];
    for f in c.faces() {
        let level = |v: VertexId| levels.values.get(v.index()).copied().unwrap_or(0.0);
        if let Some(least) = step.get_mut(patch_of(f)) {
            let steps = c.face_vertices(f).map(|v| excess(level(v)).floor());
            *least = steps.into_iter().fold(*least, f64::min);
        }
    }
    let mut origins: FxHashMap<usize, [f64; 2]> = FxHashMap::default();
    let unit = board.cell(0.0);
    let places = c.faces().map(|f| {
        let patch = patch_of(f);
        let step = step.get(patch).copied().filter(|s| s.is_finite());
        let largest = board.cell(step.unwrap_or(0.0));
        let corners = board.corners(f, largest);
        let origin = *origins
            .entry(patch)
            .or_insert_with(|| corners[0].map(|x| 2.0 * largest * (x / (2.0 * largest)).floor()));
        corners.map(|p| std::array::from_fn(|i| ((p[i] - origin[i]) / unit) as f32))
    });
    let places = places.collect();
    (levels, places)
}

/// Rows of the plane and the faces that refer to them; gives the box of the central chart.
fn plane(
    atlas: &AffineAtlas,
    board: &FaceVec<[[f32; 2]; 3]>,
    archive: &mut Archive,
) -> ([f64; 2], [f64; 2]) {
    let c = &atlas.mesh.connectivity;
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for p in atlas.central.uv.iter().flatten() {
        for i in 0..2 {
            low[i] = low[i].min(p[i]);
            high[i] = high[i].max(p[i]);
        }
    }
    let mut rows: FxHashMap<[u32; 3], u32> = FxHashMap::default();
    let (mut corner, mut vertex, mut patches) = (Vec::new(), Vec::new(), Vec::new());
    let (mut chart, mut packed, mut cells) = (Vec::new(), Vec::new(), Vec::new());
    for h in c.halfedges() {
        let (f, k, v) = (c.face(h), c.corner(h), c.tail(h));
        let patch = atlas.patches.face_patch[f];
        let next = rows.len() as u32;
        let row = *rows
            .entry([v.raw(), atlas.central.copy[h], patch.raw()])
            .or_insert(next);
        corner.push([row]);
        if row < next {
            continue;
        }
        vertex.push([v.raw()]);
        patches.push([patch.raw()]);
        let uv = atlas.central.uv[f][k];
        chart.push(std::array::from_fn::<u32, 2, _>(|i| {
            quantise(uv[i], [low[i], high[i]], 8_388_607.0)
        }));
        let uv = atlas.patches.uv[f][k];
        let of_patch = atlas.patches.patches.get(patch.index());
        let uv = of_patch.map_or([0.0; 2], |patch| patch.packed(uv));
        packed.push(std::array::from_fn::<u32, 2, _>(|i| {
            quantise(uv[i], [0.0, 1.0], 65_535.0)
        }));
        cells.push(board[f][k]);
    }
    archive.integers("corner", &corner);
    archive.integers("vertex", &vertex);
    archive.integers("patch", &patches);
    archive.integers("chart", &chart);
    archive.integers("packed", &packed);
    archive.floats("board", &cells);
    (low, high)
}

/// Sides of faces that are drawn as lines, by kind: 0 between patches, 1 the surface's boundary, 2 the cut, 3 features. Tells whether there are any of
/// these.
fn lines(atlas: &AffineAtlas, archive: &mut Archive) -> bool {
    let c = &atlas.mesh.connectivity;
    let patch = &atlas.patches.face_patch;
    let mut lines: Vec<[u32; 3]> = Vec::new();
    let met = atlas.metric.quarter_turns.as_ref();
    let features = met.into_iter().flat_map(|met| &met.lines);
    let feature_edges: BTreeSet<[VertexId; 2]> = features
        .flat_map(|feature| feature.vertices.windows(2))
        .map(|pair| [pair[0].min(pair[1]), pair[0].max(pair[1])])
        .collect();
    for (number, h) in (0u32..).zip(c.halfedges()) {
        let segment = atlas.cut.segment[c.edge(h)];
        let mut ends = [c.tail(h), c.head(h)];
        ends.sort_unstable();
        if feature_edges.contains(&ends) {
            lines.push([3, number, 0]);
        }
        let across = c.twin(h).map(|t| c.face(t));
        let kind = match across {
            None => 1,
            Some(_) if segment != NONE => 2,
            Some(g) if patch[c.face(h)] != patch[g] => 0,
            Some(_) => continue,
        };
        let of_cut = if kind == 2 { segment } else { 0 };
        lines.push([kind, number, of_cut]);
    }
    lines.sort_unstable();
    let column = |i: usize| lines.iter().map(|line| [line[i]]).collect::<Vec<_>>();
    archive.integers("line_kind", &column(0));
    archive.integers("line_corner", &column(1));
    archive.integers("line_segment", &column(2));
    lines.iter().any(|line| line[0] == 3)
}

/// Normals of vertices and faces. Those of faces are those of the face in the file, because the parts that the overlay cuts it
/// into can be too thin to have a direction.
fn normals(atlas: &AffineAtlas, archive: &mut Archive) {
    let mesh = &atlas.mesh;
    let add = |sum: &mut [f64; 3], n: [f64; 3]| *sum = std::array::from_fn(|i| sum[i] + n[i]);
    let mut of_vertex = vec![[0.0; 3]; mesh.positions.len()];
    let mut of_source: FxHashMap<u32, [f64; 3]> = FxHashMap::default();
    for f in mesh.connectivity.faces() {
        let p = mesh.face_positions(f);
        let normal = cross(sub(p[1], p[0]), sub(p[2], p[0]));
        if !normal.iter().all(|x| x.is_finite()) {
            continue;
        }
        add(of_source.entry(mesh.source_face[f]).or_default(), normal);
        for v in mesh.connectivity.face_vertices(f) {
            add(&mut of_vertex[v.index()], normal);
        }
    }
    let rows: Vec<[u32; 2]> = of_vertex.iter().map(|&n| octahedral(n)).collect();
    archive.integers("normal", &rows);
    let of_face = |f: &u32| octahedral(of_source.get(f).copied().unwrap_or_default());
    let rows: Vec<[u32; 2]> = mesh.source_face.iter().map(of_face).collect();
    archive.integers("face_normal", &rows);
}

/// A direction on the unfolded octahedron, two numbers from 0 to 4095 (Meyer et al., *On Floating-Point Normal Vectors*, 2010).
fn octahedral(n: [f64; 3]) -> [u32; 2] {
    let size = n.iter().map(|x| x.abs()).sum::<f64>();
    if size <= 0.0 || norm(n) <= 0.0 {
        return [2047, 2047];
    }
    let [x, y, z] = n.map(|x| x / size);
    let fold = |a: f64, b: f64| (1.0 - b.abs()) * if a < 0.0 { -1.0 } else { 1.0 };
    let place = if z < 0.0 {
        [fold(x, y), fold(y, x)]
    } else {
        [x, y]
    };
    place.map(|a| quantise(a, [-1.0, 1.0], 4095.0))
}

/// Log scale and largest angle error of each face; faces without a measure have the middle and 0.
fn distortions(
    distortion: &FaceVec<Option<FaceDistortion>>,
    archive: &mut Archive,
) -> (Scales, [f64; 2], f64) {
    let worst = |d: &FaceDistortion| d.angle_error.into_iter().fold(0.0, f64::max);
    let faces = || distortion.iter().flatten();
    let logs = ascending(faces().map(|d| (d.log_scale, d.weight)));
    let [low, middle, high] = [BEYOND, 0.5, 1.0 - BEYOND].map(|s| weighted_quantile(&logs, s));
    let reach = (high - middle).max(middle - low);
    let angles = ascending(faces().map(|d| (worst(d), d.weight)));
    let upper = weighted_quantile(&angles, 1.0 - BEYOND);
    let log_scale = Ranged::new(distortion.iter().map(|d| d.map_or(middle, |d| d.log_scale)));
    let angle_error = Ranged::new(distortion.iter().map(|d| d.as_ref().map_or(0.0, worst)));
    let angle_max = angle_error.range[1];
    log_scale.pack("log_scale", log_scale.range, archive);
    angle_error.pack("angle_error", [0.0, angle_max], archive);
    let scales = Scales {
        // Differences that are rounding only are no differences.
        log_scale: [middle, if reach > 1e-9 { reach } else { 1.0 }],
        angle_error: if upper > 1e-9 { upper } else { 1.0 },
        distance: None,
    };
    (scales, log_scale.range, angle_max)
}

/// Distance of the vertices from the images: the upper end of the colours, and the largest.
fn distances(atlas: &AffineAtlas, archive: &mut Archive) -> (Option<f64>, f64) {
    let Some(distance) = &atlas.image_distance else {
        return (None, 0.0);
    };
    let values = Ranged::new(distance.iter().copied());
    let most = values.range[1].max(0.0);
    values.pack("distance", [0.0, most], archive);
    let sorted = ascending(values.values.iter().map(|&x| (x, 1.0)));
    (Some(weighted_quantile(&sorted, 1.0 - BEYOND)), most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sample;
    use crate::report::face_distortions;

    #[test]
    fn directions_keep_theirs() {
        for n in [
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
            [1.0, 2.0, -3.0],
            [-0.3, -0.9, 0.1],
            [-5.0, 0.1, -0.2],
        ] {
            let [a, b] = octahedral(n).map(|x| f64::from(x) / 2047.5 - 1.0);
            let z = 1.0 - a.abs() - b.abs();
            let fold = |a: f64, b: f64| (1.0 - b.abs()) * if a < 0.0 { -1.0 } else { 1.0 };
            let back = if z < 0.0 {
                [fold(a, b), fold(b, a), z]
            } else {
                [a, b, z]
            };
            let turn = norm(cross(n, back)) / (norm(n) * norm(back));
            assert!(turn < 2e-3, "{n:?} became {back:?}");
            assert!(n[2] * back[2] >= 0.0);
        }
        assert_eq!(octahedral([0.0; 3]), [2047, 2047]);
    }

    #[test]
    fn rows_of_the_plane_are_shared_inside_patches_only() {
        let atlas = sample::torus(6, 4);
        let distortion = face_distortions(&atlas.mesh, &atlas.metric);
        let drawing = draw(&atlas, &distortion).unwrap();
        let count = |name: &str| drawing.meta["sections"][name]["count"].as_u64().unwrap();
        // A torus slit open to a rectangle of 6 × 4 squares.
        assert_eq!(count("vertex"), 7 * 5);
        assert_eq!(count("corner"), 6 * 4 * 2 * 3);
        assert_eq!(count("position"), 6 * 4);
        // Both sides of the cut.
        assert_eq!(count("line_kind"), 2 * (6 + 4));
        assert_eq!(drawing.scales.distance, None);
        let again = draw(&atlas, &distortion).unwrap();
        assert!(again.data == drawing.data && again.meta == drawing.meta);
    }

    #[test]
    fn cells_go_on_from_face_to_face() {
        let atlas = sample::torus(6, 4);
        let (_, board) = board(&atlas);
        let unit = Checkerboard::new(&atlas).cell(0.0);
        for f in atlas.mesh.connectivity.faces() {
            for k in 0..3 {
                for i in 0..2 {
                    let flat = atlas.central.uv[f][k][i] - atlas.central.uv[f][0][i];
                    let cells = f64::from(board[f][k][i] - board[f][0][i]) * unit;
                    assert!((flat - cells).abs() < 1e-4, "{flat} and {cells}");
                }
            }
        }
    }
}
