//! `atlas.npz`: every array with its type, shape and range of indices.

use super::Verdicts;
use super::document::Document;
use super::formulas::{Point2, Point3};
use crate::read::npz::{Element, Npz};
use std::path::Path;

/// No vertex, segment or patch.
pub(super) const NONE: u32 = u32::MAX;

const NAMES: [&str; 20] = [
    "positions",
    "faces",
    "source_face",
    "source_vertex",
    "log_scale",
    "target_curvature",
    "flat_length",
    "central_uv",
    "cut",
    "segment",
    "chart_offset",
    "chart_face",
    "chart_sector",
    "chart_uv",
    "patch",
    "patch_uv",
    "seam_offset",
    "seam_position",
    "seam_uv",
    "seam_patch",
];

/// The arrays, row by row.
pub(super) struct Arrays {
    pub positions: Vec<Point3>,
    pub faces: Vec<[u32; 3]>,
    pub source_face: Vec<u32>,
    pub source_vertex: Vec<u32>,
    pub log_scale: Vec<f64>,
    pub target_curvature: Vec<f64>,
    pub flat_length: Vec<[f64; 3]>,
    pub central_uv: Vec<[Point2; 3]>,
    pub cut: Vec<[u8; 3]>,
    pub segment: Vec<[u32; 3]>,
    pub chart_offset: Vec<u32>,
    pub chart_face: Vec<u32>,
    pub chart_sector: Vec<u8>,
    pub chart_uv: Vec<[Point2; 3]>,
    pub patch: Vec<u32>,
    pub patch_uv: Vec<[Point2; 3]>,
    pub seam_offset: Vec<u32>,
    pub seam_position: Vec<Point3>,
    pub seam_uv: Vec<[Point2; 2]>,
    pub seam_patch: Vec<[u32; 2]>,
}

impl Arrays {
    /// Corners of a face in space.
    pub fn triangle(&self, face: usize) -> [Point3; 3] {
        self.faces[face].map(|v| self.positions[v as usize])
    }

    /// Entries of a chart; the offsets were tested.
    pub fn chart_range(&self, chart: usize) -> std::ops::Range<usize> {
        self.chart_offset[chart] as usize..self.chart_offset[chart + 1] as usize
    }

    /// Samples of a seam; the offsets were tested.
    pub fn seam_range(&self, seam: usize) -> std::ops::Range<usize> {
        self.seam_offset[seam] as usize..self.seam_offset[seam + 1] as usize
    }
}

/// Reads `atlas.npz`; `None` where it cannot be used, after a failed check that says why.
pub(super) fn read(folder: &Path, document: &Document, verdicts: &mut Verdicts) -> Option<Arrays> {
    let mut npz = match Npz::open(&folder.join("atlas.npz")) {
        Ok(npz) => npz,
        Err(error) => {
            verdicts.note("atlas.npz can be read", false, error);
            return None;
        }
    };
    let lacking: Vec<&str> = NAMES.into_iter().filter(|name| !npz.has(name)).collect();
    if !verdicts.note(
        "atlas.npz has every array",
        lacking.is_empty(),
        lacking.join(" "),
    ) {
        return None;
    }
    let arrays = match load(&mut npz) {
        Ok(arrays) => arrays,
        Err(error) => {
            verdicts.note("arrays have their types and shapes", false, error);
            return None;
        }
    };
    verdicts.note(
        "arrays have their types and shapes",
        true,
        format!(
            "{} vertices, {} faces",
            arrays.positions.len(),
            arrays.faces.len()
        ),
    );
    let infinite = infinite_arrays(&arrays);
    let finite = verdicts.note("finite", infinite.is_empty(), infinite.join(" "));
    let stray = stray_indices(&arrays, document);
    let sound = verdicts.note("indices stay in range", stray.is_empty(), stray.join(", "));
    let seams = arrays.seam_offset.len() == arrays.seam_patch.len() + 1
        && is_partition(&arrays.seam_offset, arrays.seam_position.len())
        && arrays.seam_position.len() == arrays.seam_uv.len();
    let seams = verdicts.note(
        "seam arrays match",
        seams,
        format!(
            "{} seams, {} samples",
            arrays.seam_patch.len(),
            arrays.seam_position.len()
        ),
    );
    let charts = arrays.chart_offset.len() == document.charts.len() + 1
        && document
            .charts
            .first()
            .is_some_and(|chart| chart.kind == "central")
        && is_partition(&arrays.chart_offset, arrays.chart_face.len())
        && arrays.chart_offset[1] == 0;
    let charts = verdicts.note(
        "chart list matches arrays",
        charts,
        format!(
            "{} charts, {} offsets",
            document.charts.len(),
            arrays.chart_offset.len()
        ),
    );
    (finite && sound && seams && charts).then_some(arrays)
}

fn load(npz: &mut Npz) -> Result<Arrays, String> {
    fn flat<T: Element>(
        npz: &mut Npz,
        name: &str,
        shape: &[Option<usize>],
    ) -> Result<Vec<T>, String> {
        npz.read(name, shape).map(|(values, _)| values)
    }
    let (positions, v) = npz.read("positions", &[None, Some(3)])?;
    let (faces, f) = npz.read("faces", &[None, Some(3)])?;
    if v == 0 || f == 0 || v >= NONE as usize || f >= NONE as usize / 3 {
        return Err(format!("{v} vertices and {f} faces make no surface"));
    }
    let (v, f) = (Some(v), Some(f));
    let (chart_face, n) = npz.read("chart_face", &[None])?;
    let n = Some(n);
    Ok(Arrays {
        positions,
        faces,
        source_face: flat(npz, "source_face", &[f])?,
        source_vertex: flat(npz, "source_vertex", &[v])?,
        log_scale: flat(npz, "log_scale", &[v])?,
        target_curvature: flat(npz, "target_curvature", &[v])?,
        flat_length: flat(npz, "flat_length", &[f, Some(3)])?,
        central_uv: flat(npz, "central_uv", &[f, Some(3), Some(2)])?,
        cut: flat(npz, "cut", &[f, Some(3)])?,
        segment: flat(npz, "segment", &[f, Some(3)])?,
        chart_offset: flat(npz, "chart_offset", &[None])?,
        chart_face,
        chart_sector: flat(npz, "chart_sector", &[n])?,
        chart_uv: flat(npz, "chart_uv", &[n, Some(3), Some(2)])?,
        patch: flat(npz, "patch", &[f])?,
        patch_uv: flat(npz, "patch_uv", &[f, Some(3), Some(2)])?,
        seam_offset: flat(npz, "seam_offset", &[None])?,
        seam_position: flat(npz, "seam_position", &[None, Some(3)])?,
        seam_uv: flat(npz, "seam_uv", &[None, Some(2), Some(2)])?,
        seam_patch: flat(npz, "seam_patch", &[None, Some(2)])?,
    })
}

/// Whether offsets run from 0 to `length` without going back.
fn is_partition(offsets: &[u32], length: usize) -> bool {
    offsets.first() == Some(&0)
        && offsets.last().map(|end| *end as usize) == Some(length)
        && offsets.is_sorted()
}

fn infinite_arrays(arrays: &Arrays) -> Vec<&'static str> {
    fn fine<const N: usize>(rows: &[[f64; N]]) -> bool {
        rows.as_flattened().iter().all(|x| x.is_finite())
    }
    fn corners(rows: &[[Point2; 3]]) -> bool {
        fine(rows.as_flattened())
    }
    let verdicts = [
        ("positions", fine(&arrays.positions)),
        ("log_scale", arrays.log_scale.iter().all(|x| x.is_finite())),
        (
            "target_curvature",
            arrays.target_curvature.iter().all(|x| x.is_finite()),
        ),
        ("flat_length", fine(&arrays.flat_length)),
        ("central_uv", corners(&arrays.central_uv)),
        ("chart_uv", corners(&arrays.chart_uv)),
        ("patch_uv", corners(&arrays.patch_uv)),
        ("seam_position", fine(&arrays.seam_position)),
    ];
    verdicts
        .into_iter()
        .filter(|(_, fine)| !fine)
        .map(|(name, _)| name)
        .collect()
}

fn stray_indices(arrays: &Arrays, document: &Document) -> Vec<String> {
    let (v, f) = (arrays.positions.len(), arrays.faces.len());
    let (segments, patches) = (document.segments.len(), document.patches.len());
    let mut stray = Vec::new();
    let mut note = |what: &str, worst: Option<u32>, end: usize| {
        if let Some(worst) = worst.filter(|worst| *worst as usize >= end) {
            stray.push(format!("{what} {worst} of {end}"));
        }
    };
    note(
        "faces: vertex",
        arrays.faces.as_flattened().iter().copied().max(),
        v,
    );
    note(
        "chart_face: face",
        arrays.chart_face.iter().copied().max(),
        f,
    );
    let not_none = |x: &u32| *x != NONE;
    let segment = arrays.segment.as_flattened().iter().copied();
    note("segment: segment", segment.filter(not_none).max(), segments);
    let right = arrays.seam_patch.iter().map(|pair| pair[1]);
    note("seam_patch: patch", right.filter(not_none).max(), patches);
    let left = arrays.seam_patch.iter().map(|pair| pair[0]);
    note("seam_patch: patch", left.max(), patches);
    let listed = document
        .cones
        .iter()
        .map(|cone| cone.vertex)
        .chain(
            document
                .features
                .iter()
                .flat_map(|f| f.vertices.iter().copied()),
        )
        .chain(document.segments.iter().flat_map(|s| s.vertices.clone()))
        .chain(document.segments.iter().flat_map(|s| [s.from, s.to]))
        .chain(document.charts.iter().filter_map(|chart| chart.vertex))
        .max();
    if let Some(worst) = listed.filter(|worst| *worst >= v) {
        stray.push(format!("atlas.json: vertex {worst} of {v}"));
    }
    stray
}
