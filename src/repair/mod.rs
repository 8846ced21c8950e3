//! From the triangles of a file to oriented manifold components, with a log of every change.
//!
//! *Enters:* a [`Soup`]: nothing welded, nothing oriented, nothing removed.
//! *Leaves:* connected [`Component`]s, each a [`Mesh`] without doubled edges, or the reason why it
//! is none; where every vertex of the file went; every change by name and place. Positions of a component are those of its [`Frame`]: a box of unit
//! size at the origin, whatever the units of the file.
//!
//! The steps, each in its own file:
//!
//! 1. **weld** ([`weld`]): vertices at one position become one, but only where that can close
//!    something: both lie on an open edge, or an edge joins them (it has length zero, or next to none
//!    beside the others of its faces, or beside these and the mesh). Two closed sheets that merely touch stay apart.
//! 2. **clean** ([`clean`]): faces with a repeated vertex and duplicates go; faces without area whose
//!    corners lie on one line, to within what float32 rounds, are taken out so that no T-junction stays; where that shows that two vertices are one point of the line, both steps
//!    are done again with these joined.
//! 3. **double-sided sheets** ([`double_sided`]): of flat sheets given from both sides one stays.
//! 4. **glue** ([`glue`]): which sides of faces are joined. Two faces at an edge always are; where more
//!    meet, those that enclose a solid wedge are joined and the rest stays open. Orientation flows
//!    across edges with exactly two faces, and the minority is flipped.
//! 5. **assemble** ([`assemble`]): one vertex a fan, one mesh a component, doubled edges split.
//!
//! *Guaranteed:* surviving vertices and faces of components with at most 131,072 faces keep the order of the file (copies and new vertices
//! come last), larger ones lie along a space-filling curve; the surface stays where it is, to two millionths of its size, when nothing is welded with a tolerance; same input, same output.
//! *Not guaranteed:* that a closed component encloses a positive volume (the majority of the input's
//! faces decides which side is out, not the volume), nor freedom from self-intersections.

pub mod assemble;
pub mod clean;
pub mod double_sided;
pub mod glue;
pub mod inside_out;
pub mod log;
pub mod weld;

use crate::geometry::connectivity::ConnectivityError;
use crate::geometry::frame::{EXPONENTS, Frame, times_power_of_two};
use crate::geometry::ids::{NONE, VertexId};
use crate::geometry::mesh::{Mesh, Soup, bounding_box, distance};
use clean::DraftFace;
pub use log::{Change, RemovalReason, RepairLog};

/// Distance of neighbouring float64 numbers where a mesh lies, as a part of its size, beyond which points on its edges and faces cannot be
/// written in source units any more. Float32 tells as much apart.
const COARSEST: f64 = 1.0 / (1 << 22) as f64;
/// A mesh that was this many times as long as what faces without area leave of it has lost its extent.
const LOST: f64 = 1e3;

/// Components of fewer faces, as a mean, are what is left of a soup.
const LOOSE: usize = 3;
/// Of those so many times fewer are allowed.
const FEWER: usize = 20;

/// What repair may do.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RepairParams {
    /// Join vertices at the same position where that closes open edges.
    pub weld: bool,
    /// Largest distance of vertices that are welded, as a fraction of the bounding box's diagonal:
    /// 0 (exactly equal positions) or 1e-12 to 0.1.
    pub weld_tolerance: f64,
    /// Refuse where anything but unused vertices would change, instead of changing it.
    pub strict: bool,
    /// Most components (each becomes an atlas of its own), at least 1; a twentieth of it where they are fragments: less than three faces each, as those of a soup
    /// that does not weld, or as many cut edges as components, as between the cells of a volume mesh.
    pub max_components: usize,
}

impl Default for RepairParams {
    fn default() -> Self {
        Self {
            weld: true,
            weld_tolerance: 0.0,
            strict: false,
            max_components: 20_000,
        }
    }
}

/// Why nothing at all can be made of an input.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RepairError {
    /// No face is left.
    #[error(
        "none of the {faces} faces encloses any area, so there is no surface: check that the file holds triangles with distinct corners"
    )]
    NoFaces {
        /// Faces of the input.
        faces: usize,
    },
    /// A face names a vertex that does not exist.
    #[error(
        "face {face} names vertex {vertex}, but there are {vertices} vertices: correct the index"
    )]
    VertexOutOfRange {
        /// Face.
        face: usize,
        /// The index it names.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has a coordinate that is not finite: correct it")]
    NonFinitePosition {
        /// Vertex.
        vertex: usize,
    },
    /// A list has not one entry a face or corner.
    #[error("{what} holds {given} numbers, but the faces need {required}: correct its length")]
    WrongLength {
        /// Which list.
        what: String,
        /// Its length.
        given: usize,
        /// The length that fits.
        required: usize,
    },
    /// More faces than 32-bit indices can name.
    #[error(
        "{faces} faces are more than {most}, the most that 32-bit indices can name: split the model"
    )]
    TooManyFaces {
        /// Given.
        faces: usize,
        /// Allowed.
        most: usize,
    },
    /// The mesh is larger or smaller than what float32 can hold.
    #[error(
        "the mesh is {size:.1e} units long and reaches out to {reach:.1e}, but images and surface.glb hold float32, whose numbers allow sizes from {least:.1e} to {most:.1e}: give the mesh in other units"
    )]
    Range {
        /// Longest side of its box.
        size: f64,
        /// Largest absolute coordinate.
        reach: f64,
        /// Least size that can be written.
        least: f64,
        /// Largest size, or coordinate, that can be written.
        most: f64,
    },
    /// The mesh lies so far from the origin that new points cannot be written.
    #[error(
        "the mesh is {size:.1e} units long but lies {reach:.1e} from the origin, where float64 tells points apart that are {step:.1e} from each other, {part:.1e} of its size (most: {most:.1e}): move it to the origin in the program that made it, where its digits are still known"
    )]
    FarFromOrigin {
        /// Longest side of its box.
        size: f64,
        /// Largest absolute coordinate.
        reach: f64,
        /// Distance of neighbouring numbers there.
        step: f64,
        /// The same as a part of the size.
        part: f64,
        /// Largest part with which a surface can be written.
        most: f64,
    },
    /// Nearly all of the mesh's extent is due to vertices whose faces have no area in float64.
    #[error(
        "vertex {vertex} lies {distance:.1e} units from the next one that is left, {times:.1e} times the size of the rest: float64 knows no area of the faces at it, and without them the mesh loses its extent; correct its position or remove it"
    )]
    LostVertex {
        /// Vertex.
        vertex: usize,
        /// Distance from the box of the surviving faces.
        distance: f64,
        /// The same in lengths of the longest side of that box.
        times: f64,
    },
    /// The welding tolerance is out of range.
    #[error(
        "repair.weld_tolerance is {given}, but must be 0 (exactly equal positions) or from 1e-12 to 0.1 of the bounding box's diagonal"
    )]
    WeldTolerance {
        /// Given.
        given: f64,
    },
    /// The surface falls apart.
    #[error(
        "the repaired surface falls into {components} components, more than {}; repair found: {summary}; weld the mesh where they belong together (repair.weld_tolerance), take out inner walls, or, where they are loose parts such as leaves, set repair.max_components = {}",
        match fragments {
            Some(why) => format!("a twentieth of repair.max_components = {most} ({why})"),
            None => format!("repair.max_components = {most}"),
        },
        match fragments {
            Some(_) => components * FEWER,
            None => *components,
        }
    )]
    TooManyComponents {
        /// Components.
        components: usize,
        /// Allowed.
        most: usize,
        /// Why they are taken for fragments, of which fewer are allowed.
        fragments: Option<&'static str>,
        /// Counts of what repair changed.
        summary: String,
    },
    /// `strict` is set and the input needs repair.
    #[error(
        "the mesh needs repair ({summary}; first: {first}), which repair.strict refuses: mend the file or set repair.strict = false"
    )]
    Strict {
        /// Counts of what would change.
        summary: String,
        /// The first change.
        first: String,
    },
}

/// Why one component is no surface that can be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ComponentError {
    /// No choice of sides is consistent.
    #[error(
        "the component of {faces} faces is one-sided like a Möbius strip: going round it, face {face} comes back turned over where it meets face {neighbour}; cut it open along a line across the strip, so that it has two sides"
    )]
    NonOrientable {
        /// Source face at which the contradiction was found.
        face: u32,
        /// Its neighbour (source face).
        neighbour: u32,
        /// Number of faces of the component.
        faces: usize,
    },
    /// The component could not be put together.
    #[error("the component is no manifold surface: {0}")]
    NotManifold(#[from] ConnectivityError),
}

/// One connected piece of the surface.
#[derive(Clone, Debug)]
pub struct Component {
    /// The surface, with its own compact numbering of vertices and faces.
    pub mesh: Result<Mesh, ComponentError>,
    /// Number of its faces before doubled edges were split.
    pub faces: usize,
    /// Lowest of its faces in the input.
    pub first_source_face: u32,
    /// Lowest of its vertices in the input.
    pub first_source_vertex: u32,
    /// The changes that concern it. Where there is one component only, all changes.
    pub log: RepairLog,
    /// Takes the mesh's positions back to source units.
    pub frame: Frame,
}

/// Everything that repair leaves.
#[derive(Clone, Debug)]
pub struct Repaired {
    /// In the order of their first face; at least one.
    pub components: Vec<Component>,
    /// All changes, those that concern no component included.
    pub log: RepairLog,
    /// For every vertex of the input: component and vertex there, or [`NONE`] twice.
    pub(crate) places: Vec<[u32; 2]>,
}

impl Repaired {
    /// Where a vertex of the input went: the component and its vertex there. For a welded vertex that is
    /// the one that stands for all of them, for a split one the first copy. `None` where no
    /// surviving face uses it, and where the input has no such vertex.
    pub fn locate(&self, source_vertex: u32) -> Option<(usize, VertexId)> {
        let [component, vertex] = *self.places.get(source_vertex as usize)?;
        (component != NONE).then(|| (component as usize, VertexId::new(vertex as usize)))
    }

    /// Number of vertices of the input.
    pub fn source_vertices(&self) -> usize {
        self.places.len()
    }
}

/// Repairs a soup; see the module docs.
pub fn repair(soup: &Soup, params: &RepairParams) -> Result<Repaired, RepairError> {
    check_input(soup, params)?;
    let frame = Frame::of(&soup.positions);
    check_range(&frame)?;
    // Products of lengths in source units could overflow or vanish.
    let positions: Vec<_> = soup.positions.iter().map(|&p| frame.enter(p)).collect();
    let mut all_met = Vec::new();
    let (mut changes, stands_for, mut draft) = loop {
        let mut changes = Vec::new();
        let stands_for = weld::weld(&positions, &soup.faces, params, &all_met, &mut changes);
        let welded = changes.len();
        let (draft, mut met) = clean::clean(&positions, &soup.faces, &stands_for, &mut changes);
        if changes.len() > welded {
            // Edges that had more than needles beside them may have no more now.
            met.extend(weld::needles(&positions, &draft));
        }
        // Each pair is a vertex fewer.
        if met.is_empty() {
            break (changes, stands_for, draft);
        }
        all_met.extend(met);
    };
    if draft.is_empty() {
        return Err(RepairError::NoFaces {
            faces: soup.faces.len(),
        });
    }
    check_extent(&positions, &soup.faces, &draft, &frame)?;
    let mut sides = glue::sides(&draft);
    if double_sided::drop_backs(&mut draft, &sides, &positions, &mut changes) {
        sides = glue::sides(&draft);
    }
    let gluing = glue::glue(&draft, &sides, &positions, &mut changes);
    let repaired = assemble::assemble(soup, &stands_for, &draft, &gluing, changes);
    let components = repaired.components.len();
    let cuts = repaired.log.counts().get("cut_edges").copied();
    let fragments = if draft.len() < LOOSE * components {
        Some("they have less than three faces each")
    } else if cuts.is_some_and(|cuts| cuts >= components as u64) {
        Some(
            "they are cut apart at edges of more than two faces, as the cells of a volume mesh are",
        )
    } else {
        None
    };
    let most = match fragments {
        Some(_) => (params.max_components / FEWER).max(1),
        None => params.max_components,
    };
    if components > most {
        return Err(RepairError::TooManyComponents {
            components,
            most: params.max_components,
            fragments,
            summary: repaired.log.summary(),
        });
    }
    match repaired.log.first_refused_by_strict() {
        Some(first) if params.strict => Err(RepairError::Strict {
            summary: repaired.log.summary(),
            first: first.to_string(),
        }),
        _ => Ok(repaired),
    }
}

/// Refuses what float32 outputs, or float64 at that distance from the origin, cannot hold.
fn check_range(frame: &Frame) -> Result<(), RepairError> {
    let size = frame.length(1.0);
    let [least, most] = [*EXPONENTS.start(), *EXPONENTS.end()].map(|k| times_power_of_two(1.0, k));
    if !EXPONENTS.contains(&frame.exponent()) || frame.reach() > most {
        return Err(RepairError::Range {
            size,
            reach: frame.reach(),
            least,
            most,
        });
    }
    let part = frame.resolution();
    if part > COARSEST {
        return Err(RepairError::FarFromOrigin {
            size,
            reach: frame.reach(),
            step: frame.length(part),
            part,
            most: COARSEST,
        });
    }
    Ok(())
}

/// Refuses a mesh that loses its extent with the faces that were taken out: their farthest vertex lies so far from the rest that its faces
/// have no area in float64, though their corners may lie on no line.
fn check_extent(
    positions: &[[f64; 3]],
    given: &[[u32; 3]],
    draft: &[DraftFace],
    frame: &Frame,
) -> Result<(), RepairError> {
    let left: Vec<[f64; 3]> = (draft.iter().flat_map(|f| f.vertices))
        .map(|v| positions[v as usize])
        .collect();
    let (low, high) = bounding_box(&left);
    let size = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
    let beyond = |v: &u32| {
        let p = positions[*v as usize];
        distance(p, std::array::from_fn(|i| p[i].clamp(low[i], high[i])))
    };
    let used = given.iter().flatten();
    let far = used.max_by(|a, b| beyond(a).total_cmp(&beyond(b)));
    match far.map(|v| (*v, beyond(v))) {
        Some((vertex, distance)) if distance > LOST * size => Err(RepairError::LostVertex {
            vertex: vertex as usize,
            distance: frame.length(distance),
            times: distance / size,
        }),
        _ => Ok(()),
    }
}

fn check_input(soup: &Soup, params: &RepairParams) -> Result<(), RepairError> {
    let tolerance = params.weld_tolerance;
    if tolerance != 0.0 && !(1e-12..=0.1).contains(&tolerance) {
        return Err(RepairError::WeldTolerance { given: tolerance });
    }
    // Splits of slivers and doubled edges add a few faces: half the range leaves room.
    let most = (NONE / 6) as usize;
    if soup.faces.len() > most || soup.positions.len() > most {
        let faces = soup.faces.len().max(soup.positions.len());
        return Err(RepairError::TooManyFaces { faces, most });
    }
    let vertices = soup.positions.len();
    for (face, corners) in soup.faces.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices) {
            return Err(RepairError::VertexOutOfRange {
                face,
                vertex,
                vertices,
            });
        }
    }
    let finite = |p: &[f64; 3]| p.iter().all(|x| x.is_finite());
    if let Some(vertex) = soup.positions.iter().position(|p| !finite(p)) {
        return Err(RepairError::NonFinitePosition { vertex });
    }
    let lengths = soup.attributes.iter().map(|a| {
        let required = 3 * soup.faces.len() * a.components;
        (format!("attribute {:?}", a.kind), a.values.len(), required)
    });
    let material = (
        "the list of materials".to_string(),
        soup.face_material.len(),
        soup.faces.len(),
    );
    for (what, given, required) in std::iter::once(material).chain(lengths) {
        if given != required {
            return Err(RepairError::WrongLength {
                what,
                given,
                required,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
pub(crate) mod corpus;
#[cfg(test)]
mod tests;
