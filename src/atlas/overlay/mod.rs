//! The overlay: the common refinement of the base mesh and the final triangulation of the flow (`docs/method.md`, 2, "Flips").
//!
//! *Enters:* a mesh and its flat metric, which where the flow flipped lives on another triangulation. *Leaves:* a mesh
//! whose every face lies in one face of both, so that it carries positions *and* flat lengths, and the [`Layout`] that is cut
//! and developed in its place.
//!
//! The final edges cross a base face as a system of disjoint arcs between its sides and corners, known from how often they
//! cross each side (integers that the flips counted). So the overlay is made base face by base face: slice it,
//! triangulate the regions, glue them along what they share. Every region also lies in one final face, on whose border
//! all its corners are; flat lengths follow from there. *Guaranteed:* the surface in space is the same set of points, whatever the
//! rounding the overlay is a valid subdivision, no vertex is added but crossings. *Not guaranteed:* the shape of its faces:
//! where edges of both nearly coincide they are slivers. The map from space to the plane is linear on each face of the overlay
//! and agrees with the flow's (piecewise projective) map at vertices.

mod crossings;
mod flat_face;
mod layout;
mod mirror;
mod polygon;
pub mod positions;
mod regions;
mod slice;
mod welded;

#[cfg(test)]
mod tests;

pub use layout::{Carrier, Layout};
pub use regions::OnBase;

use crate::flow::correspondence::{CorrespondenceError, Curves};
use crate::flow::intrinsic::Intrinsic;
use crate::flow::prescription::Prescription;
use crate::flow::ricci::FlatMetric;
use crate::geometry::connectivity::{Connectivity, ConnectivityError};
use crate::geometry::ids::{EdgeId, EdgeVec, HalfedgeId, HalfedgeVec, NONE, VertexVec};
use crate::geometry::mesh::Mesh;
use crossings::Crossings;
use layout::Refinement;
use mirror::{Half, Place};
use polygon::Faces;
use positions::{Positions, PositionsError, SPACING, SPACING_UNDER_GRID};
use regions::{Ground, Inputs, Regions};

/// A surface with positions and flat lengths on the same faces.
#[derive(Clone, Debug)]
pub struct Overlay {
    /// The surface: the same set of points in space as before. Its first vertices are those of the base mesh.
    pub mesh: Mesh,
    /// Flat lengths of its edges; `intrinsic` is `None`.
    pub metric: FlatMetric,
    /// Target curvatures, zero at new vertices.
    pub prescription: Prescription,
    /// What is cut and developed.
    pub layout: Layout,
    /// Where the corner that every halfedge leaves lies on the face of the base mesh that its face lies in; `None` where nothing was
    /// added and the faces are those of the base mesh.
    pub on_base: Option<HalfedgeVec<OnBase>>,
    /// Crossings whose places were guessed from their neighbours'; see [`Positions`].
    pub unmatched: usize,
}

/// Why there is no overlay. None of these is expected: the integers come from the flips themselves.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OverlayError {
    /// The base edges could not be traced through the final triangulation.
    #[error(transparent)]
    Correspondence(#[from] CorrespondenceError),
    /// Crossings and triangulations do not fit together.
    #[error(
        "the final triangulation does not fit the mesh at {what} {index}: please report this mesh"
    )]
    Inconsistent {
        /// What was looked at.
        what: &'static str,
        /// Which one.
        index: usize,
    },
    /// The places of the crossings on some edge are in no order.
    #[error("the crossings on an edge are in no order: please report this mesh")]
    Positions,
    /// The two triangulations cross each other far more often than their sizes make believe.
    #[error(
        "on this mesh of {edges} edges the flat triangulation crosses them {crossings} times (most: {most}), since very many long thin faces lie side by side: divide the long faces, or remesh the surface with faces of similar sides"
    )]
    TooManyCrossings {
        /// Edges of the mesh; doubled, if it has a boundary.
        edges: usize,
        /// How often they are crossed.
        crossings: u128,
        /// How often they may be.
        most: u128,
    },
    /// More faces than ids.
    #[error("the overlay would have {faces} faces, more than 32-bit ids can count")]
    TooLarge {
        /// Number of faces.
        faces: usize,
    },
    /// The crossings could not be placed.
    #[error(transparent)]
    Places(#[from] PositionsError),
    /// The pieces do not make a surface.
    #[error(transparent)]
    Connectivity(#[from] ConnectivityError),
}

impl OverlayError {
    fn inconsistent(what: &'static str, index: usize) -> Self {
        OverlayError::Inconsistent { what, index }
    }
}

/// Refines a mesh by the final triangulation of its metric. Where the connectivity stayed, nothing changes.
///
/// # Errors
/// Correspondence and triangulations that do not belong together, and more faces than ids can count.
pub fn overlay(
    mesh: Mesh,
    mut metric: FlatMetric,
    prescription: Prescription,
) -> Result<Overlay, OverlayError> {
    let Some(opened) = metric.opened.take() else {
        return overlay_of(mesh, metric, prescription);
    };
    let of_opened = FlatMetric {
        log_scale: welded::of_sectors(&metric.log_scale, &opened),
        curvature: welded::of_sectors(&metric.curvature, &opened),
        intrinsic: metric.intrinsic.take(),
        ..metric.clone()
    };
    let target = welded::of_sectors(&prescription.target, &opened);
    let found = overlay_of(
        welded::open(mesh, &opened),
        of_opened,
        Prescription::new(target, prescription.boundary),
    )?;
    welded::weld(found, &opened, &metric, prescription)
}

/// The same of a surface that hangs together as its triangulations do.
fn overlay_of(
    mesh: Mesh,
    mut metric: FlatMetric,
    prescription: Prescription,
) -> Result<Overlay, OverlayError> {
    let Some(intrinsic) = metric.intrinsic.take() else {
        let layout = Layout::identity(&mesh.connectivity, &metric.length);
        return Ok(Overlay {
            mesh,
            metric,
            prescription,
            layout,
            on_base: None,
            unmatched: 0,
        });
    };
    check_crossings(&intrinsic)?;
    let curves = intrinsic
        .base_on_flat
        .trace(&intrinsic.base, &intrinsic.flat)?;
    // The metric of a grid turns by quarter turns.
    let spacing = match metric.quarter_turns {
        Some(_) => SPACING_UNDER_GRID,
        None => SPACING,
    };
    let places = positions::positions(&intrinsic, &curves, spacing)?;
    refine(mesh, metric, prescription, *intrinsic, &curves, &places)
}

/// Most crossings of an edge, on the mean: ordinary meshes have one or two, and every crossing costs more than a kilobyte.
const MOST_CROSSINGS_OF_EDGE: u128 = 8;
/// So many are allowed whatever the number of edges: less than a gigabyte, which is what a file below a megabyte may cost.
const ALLOWED_CROSSINGS: u128 = 700_000;

/// Refuses what would have many times the faces of the mesh, before anything is made of it: fans of n needles can cross n² times.
fn check_crossings(intrinsic: &Intrinsic) -> Result<(), OverlayError> {
    let edges = intrinsic.base.edge_count();
    // Of a doubled surface half of them lie behind the mirror.
    let sides = match intrinsic.front_faces < intrinsic.base.face_count() {
        true => 2,
        false => 1,
    };
    let most = (MOST_CROSSINGS_OF_EDGE * edges as u128).max(sides * ALLOWED_CROSSINGS);
    for integers in [
        &intrinsic.base_on_delaunay,
        &intrinsic.delaunay_on_flat,
        &intrinsic.base_on_flat,
    ] {
        let crossings = integers.crossings()?;
        if crossings > most {
            return Err(OverlayError::TooManyCrossings {
                edges,
                crossings,
                most,
            });
        }
    }
    Ok(())
}

/// The overlay from curves and the fractions of their crossings along both edges.
fn refine(
    mesh: Mesh,
    metric: FlatMetric,
    prescription: Prescription,
    intrinsic: Intrinsic,
    curves: &Curves,
    places: &Positions,
) -> Result<Overlay, OverlayError> {
    let (on_base, on_flat) = (&places.on_base, &places.on_flat);
    let (base, flat) = (&intrinsic.base, &intrinsic.flat);
    let front_faces = intrinsic.front_faces;
    let vertices = mesh.connectivity.vertex_count();
    if front_faces != mesh.connectivity.face_count() || vertices > base.vertex_count() {
        return Err(OverlayError::inconsistent("base face", front_faces));
    }
    let x = Crossings::new(base, flat, curves, on_base, on_flat)?;
    if curves.crossing.is_empty() {
        return unrefined(mesh, metric, prescription, &x);
    }
    let (vertex, added) = number(&x, front_faces, vertices);
    let on_mirror = added.iter().filter(|a| a.place == Place::Mirror).count();
    let mut position = mesh.positions.into_vec();
    let mut log_scale = metric.log_scale.into_vec();
    for &Added { index, edge, .. } in &added {
        let [p, q] = base.edge_vertices(edge).map(|v| v.index());
        if p.max(q) >= vertices {
            return Err(OverlayError::inconsistent("base edge", edge.index()));
        }
        let ([p, q], t) = ([p, q].map(|v| position[v]), on_base[index]);
        position.push(std::array::from_fn(|i| (1.0 - t) * p[i] + t * q[i]));
        log_scale.push(scale_at(&x, &intrinsic.u, index));
    }
    let ground = match front_faces == base.face_count() {
        true => Ground::Whole,
        false => Ground::Half(Box::new(Half::new(
            &x,
            &metric.length,
            front_faces,
            &vertex,
            vertices,
        )?)),
    };
    let regions = Regions::new(&Inputs {
        x: &x,
        length: &metric.length,
        front_faces,
        vertex: &vertex,
        position: &position,
        ground: &ground,
    })?;
    let Regions {
        faces,
        base_face,
        on_base: corners,
        carrier,
        pieces,
        ..
    } = regions;
    let connectivity = Connectivity::from_gluing(faces.tail.into(), &faces.twin, position.len())?;
    let edges = connectivity.edges();
    let length = edges.map(|e| faces.length[connectivity.edge_halfedge(e).index()]);
    let length: EdgeVec<f64> = length.collect();
    let attributes = mesh.attributes.iter().map(|attribute| {
        let mut values = Vec::with_capacity(3 * base_face.len() * attribute.components);
        for (h, corner) in corners.iter().enumerate() {
            let (face, side) = (base_face[h / 3] as usize, usize::from(corner.side));
            attribute.interpolate(face, side, corner.fractions[0], &mut values);
        }
        attribute.with_values(values)
    });
    let of_base = |values: &[u32]| base_face.iter().map(|&f| values[f as usize]).collect();
    let extended = |values: VertexVec<f64>| {
        let mut values = values.into_vec();
        values.resize(position.len(), 0.0);
        values.into()
    };
    let mut source_vertex = mesh.source_vertex.clone().into_vec();
    source_vertex.resize(position.len(), NONE);
    let layout_faces = match ground {
        Ground::Whole => None,
        Ground::Half(half) => Some((half.faces, half.cell)),
    };
    let curvature = extended(metric.curvature);
    let target = extended(prescription.target);
    let mesh = Mesh {
        source_face: of_base(mesh.source_face.as_slice()),
        face_material: of_base(mesh.face_material.as_slice()),
        attributes: attributes.collect(),
        source_vertex: source_vertex.into(),
        positions: position.into(),
        connectivity,
    };
    let (flat, flat_length) = (intrinsic.flat, metric.length);
    let mut layout = match layout_faces {
        None => Layout {
            may_cut: EdgeVec::filled(true, flat.edge_count()),
            cell: (0..flat.face_count() as u32).collect(),
            connectivity: flat,
            length: flat_length,
            refinement: None,
        },
        Some((faces, cell)) => half_layout(faces, cell, vertices + on_mirror)?,
    };
    layout.refinement = Some(chains(&layout, carrier, &pieces)?);
    Ok(Overlay {
        mesh,
        metric: FlatMetric {
            log_scale: log_scale.into(),
            length,
            intrinsic: None,
            curvature,
            ..metric
        },
        prescription: Prescription {
            target,
            ..prescription
        },
        layout,
        on_base: Some(corners.into()),
        unmatched: places.unmatched,
    })
}

/// Nothing crosses: the final triangulation is the base mesh, perhaps in another numbering.
fn unrefined(
    mesh: Mesh,
    metric: FlatMetric,
    prescription: Prescription,
    x: &Crossings,
) -> Result<Overlay, OverlayError> {
    let c = &mesh.connectivity;
    let length = |e| {
        let same = x.coincident(c.edge_halfedge(e))?;
        Ok(metric.length[x.flat.edge(same)])
    };
    let length: Vec<f64> = c.edges().map(length).collect::<Result<_, OverlayError>>()?;
    let metric = FlatMetric {
        length: length.into(),
        intrinsic: None,
        ..metric
    };
    Ok(Overlay {
        layout: Layout::identity(c, &metric.length),
        mesh,
        metric,
        prescription,
        on_base: None,
        unmatched: 0,
    })
}

/// A crossing that becomes a vertex.
struct Added {
    /// Index into `curves.crossing`.
    index: usize,
    /// Base edge.
    edge: EdgeId,
    place: Place,
}

/// Numbers the crossings on the surface after the base vertices, those on the mirror first. Returns the vertex of
/// every crossing ([`NONE`] behind the mirror), and the crossings in the order of their vertices.
fn number(x: &Crossings, front_faces: usize, vertices: usize) -> (Vec<u32>, Vec<Added>) {
    let mut vertex = vec![NONE; x.curves.crossing.len()];
    let mut added = Vec::with_capacity(vertex.len());
    for wanted in [Place::Mirror, Place::Front] {
        for edge in x.base.edges() {
            let place = mirror::place(x.base, front_faces, edge);
            if place != wanted {
                continue;
            }
            for index in x.curves.range(edge) {
                vertex[index] = (vertices + added.len()) as u32;
                added.push(Added { index, edge, place });
            }
        }
    }
    (vertex, added)
}

/// Log scale at a crossing on the final edge pq at fraction s: ln((1 − s) e^{u_p} + s e^{u_q}).
fn scale_at(x: &Crossings, u: &VertexVec<f64>, index: usize) -> f64 {
    let e = x.flat.edge(x.curves.crossing[index].halfedge);
    let [p, q] = x.flat.edge_vertices(e).map(|v| u[v]);
    let s = x.on_flat[index];
    let most = p.max(q);
    most + ((1.0 - s) * (p - most).exp() + s * (q - most).exp()).ln()
}

/// The layout on the surface's own side of the mirror.
fn half_layout(faces: Faces, cell: Vec<u32>, vertices: usize) -> Result<Layout, OverlayError> {
    let connectivity = Connectivity::from_gluing(faces.tail.into(), &faces.twin, vertices)?;
    let of_edge = |e| connectivity.edge_halfedge(e).index();
    let edges = || connectivity.edges();
    Ok(Layout {
        length: edges().map(|e| faces.length[of_edge(e)]).collect(),
        may_cut: edges().map(|e| !faces.is_diagonal[of_edge(e)]).collect(),
        cell: cell.into(),
        refinement: None,
        connectivity,
    })
}

/// Strings the pieces of layout edges together.
fn chains(
    layout: &Layout,
    carrier: Vec<Carrier>,
    pieces: &[(HalfedgeId, u32, HalfedgeId)],
) -> Result<Refinement, OverlayError> {
    let c = &layout.connectivity;
    let along = || {
        pieces
            .iter()
            .filter(|p| c.edge_halfedge(c.edge(p.0)) == p.0)
    };
    let mut chain_first = vec![0u32; c.edge_count() + 1];
    for (h, piece, _) in along() {
        let count = &mut chain_first[c.edge(*h).index() + 1];
        *count = (*count).max(piece + 1);
    }
    for e in 0..c.edge_count() {
        chain_first[e + 1] += chain_first[e];
    }
    let total = chain_first[c.edge_count()] as usize;
    let mut chain: Vec<Option<HalfedgeId>> = vec![None; total];
    for &(h, piece, overlay) in along() {
        chain[chain_first[c.edge(h).index()] as usize + piece as usize] = Some(overlay);
    }
    let complete = chain.into_iter().enumerate();
    let complete = complete.map(|(i, h)| h.ok_or_else(|| OverlayError::inconsistent("piece", i)));
    let chain = complete.collect::<Result<Vec<_>, _>>()?;
    if let Some(e) = c.edges().find(|&e| {
        let made = chain_first[e.index()] != chain_first[e.index() + 1];
        made != layout.may_cut[e]
    }) {
        return Err(OverlayError::inconsistent("layout edge", e.index()));
    }
    Ok(Refinement {
        carrier: carrier.into(),
        chain_first,
        chain,
    })
}
