//! Which faces and vertices of the file an error is about.

use super::{BuildError, counted};
use crate::export::glb::marked::{Mark, Marked};
use crate::flow::cones::ConeError;
use crate::flow::ricci::FlowError;
use crate::geometry::mesh::Soup;
use crate::read::ReadParams;
use crate::repair::{Change, ComponentError, RepairError, RepairLog, RepairParams, repair};

/// Faces or vertices that are listed by number.
const LISTED: usize = 12;

/// Where in the file something is wrong.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Places {
    /// Faces.
    pub faces: Vec<u32>,
    /// Vertices; the faces at them are at fault.
    pub vertices: Vec<u32>,
}

/// What an error names.
pub(super) fn places(error: &BuildError) -> Places {
    let vertices = |vertices: Vec<u32>| Places {
        vertices,
        ..Places::default()
    };
    let faces = |faces: Vec<u32>| Places {
        faces,
        ..Places::default()
    };
    match error {
        BuildError::Repair(RepairError::VertexOutOfRange { face, .. }) => faces(vec![*face as u32]),
        BuildError::Repair(
            RepairError::NonFinitePosition { vertex } | RepairError::LostVertex { vertex, .. },
        ) => vertices(vec![*vertex as u32]),
        BuildError::Component(ComponentError::NonOrientable {
            face, neighbour, ..
        }) => faces(vec![*face, *neighbour]),
        BuildError::Cones(error) => vertices(of_cones(error)),
        BuildError::Flow(FlowError::Infeasible(violation)) => {
            vertices(violation.vertices.iter().map(|v| v.raw()).collect())
        }
        BuildError::Flow(FlowError::NotConverged { faces: broken, .. }) => {
            faces(broken.iter().map(|f| f.raw()).collect())
        }
        BuildError::Flow(FlowError::BadLength { vertices: ends, .. }) => {
            vertices(ends.iter().map(|v| v.raw()).collect())
        }
        BuildError::Flow(FlowError::BadTarget { vertex, .. }) => vertices(vec![vertex.raw()]),
        _ => Places::default(),
    }
}

fn of_cones(error: &ConeError) -> Vec<u32> {
    match *error {
        ConeError::Twice { vertex, .. }
        | ConeError::NotOnSurface { vertex, .. }
        | ConeError::ZeroCurvature { vertex }
        | ConeError::OnFreeBoundary { vertex }
        | ConeError::OnCornerBoundary { vertex }
        | ConeError::NoAngleLeft { vertex, .. } => vec![vertex],
        _ => Vec::new(),
    }
}

/// Whether a face is at fault.
fn is_at(places: &Places, face: usize, corners: [u32; 3]) -> bool {
    places.faces.binary_search(&(face as u32)).is_ok()
        || corners
            .iter()
            .any(|v| places.vertices.binary_search(v).is_ok())
}

/// The file's faces, those at fault in colour.
pub(super) fn marked(name: String, places: &Places, soup: &Soup) -> Marked {
    let mut sorted = places.clone();
    sorted.faces.sort_unstable();
    sorted.vertices.sort_unstable();
    let marks =
        soup.faces
            .iter()
            .enumerate()
            .map(|(f, &corners)| match is_at(&sorted, f, corners) {
                true => Mark::Offending,
                false => Mark::Plain,
            });
    Marked {
        name,
        positions: soup.positions.clone(),
        faces: soup.faces.clone(),
        marks: marks.collect(),
    }
}

/// A line for the faces and one for the vertices, and where the first of them is.
pub(super) fn describe(places: &Places, soup: &Soup) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(&first) = places.faces.first() {
        let at = soup
            .faces
            .get(first as usize)
            .and_then(|f| soup.positions.get(f[0] as usize));
        lines.push(format!(
            "at {} of the file: {}{}",
            counted(places.faces.len(), "face", "faces"),
            listed(&places.faces),
            place(at)
        ));
    }
    if let Some(&first) = places.vertices.first() {
        lines.push(format!(
            "at {} of the file: {}{}",
            counted(places.vertices.len(), "vertex", "vertices"),
            listed(&places.vertices),
            place(soup.positions.get(first as usize))
        ));
    }
    lines
}

fn listed(ids: &[u32]) -> String {
    let mut words: Vec<String> = ids.iter().take(LISTED).map(u32::to_string).collect();
    if ids.len() > LISTED {
        words.push(format!("… ({} more)", ids.len() - LISTED));
    }
    words.join(", ")
}

fn place(at: Option<&[f64; 3]>) -> String {
    match at {
        Some([x, y, z]) => format!(" (the first near {x:.4}, {y:.4}, {z:.4})"),
        None => String::new(),
    }
}

/// What repair would change, were it not for `repair.strict` and the limit on components.
pub(super) fn log_without_limits(soup: &Soup, params: &RepairParams) -> Option<RepairLog> {
    let params = RepairParams {
        strict: false,
        max_components: usize::try_from(ReadParams::default().max_faces).unwrap_or(usize::MAX),
        ..params.clone()
    };
    repair(soup, &params).ok().map(|repaired| repaired.log)
}

/// The counts, and the first changes one by one.
pub(super) fn repairs(log: &RepairLog) -> Vec<String> {
    let mut lines = vec![format!("repair: {}", log.summary())];
    let shown = log.changes.iter().take(LISTED);
    lines.extend(shown.map(|change| format!("  {change}")));
    if log.changes.len() > LISTED {
        lines.push(format!("  … and {} more", log.changes.len() - LISTED));
    }
    lines
}

/// Puts faces that repair changes, or at vertices that it splits, in colour.
pub(super) fn mark_repairs(surface: &mut Marked, log: &RepairLog) {
    let mut places = Places::default();
    for change in &log.changes {
        match *change {
            Change::RemovedFace { face, .. }
            | Change::SplitFace { face, .. }
            | Change::FlippedFace { face }
            | Change::CutEdge { face, .. }
            | Change::SplitEdge { face, .. } => places.faces.push(face),
            Change::SplitVertex { vertex, .. } => places.vertices.push(vertex),
            Change::WeldedVertex { .. } | Change::UnreferencedVertex { .. } => {}
        }
    }
    places.faces.sort_unstable();
    places.vertices.sort_unstable();
    for (f, (corners, mark)) in surface.faces.iter().zip(&mut surface.marks).enumerate() {
        if is_at(&places, f, *corners) {
            *mark = Mark::Offending;
        }
    }
}
