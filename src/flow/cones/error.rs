//! Why a prescription is refused. Vertices are those of the input file, angles are radians.

use crate::flow::field::FieldError;
use crate::flow::looped::LoopedError;
use crate::flow::pi_multiple::in_pi;
use crate::geometry::connectivity::ConnectivityError;

/// Why there is no target curvature; vertices are those of the input file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConeError {
    /// Two entries name one vertex.
    #[error("{}", twice(*first, *second, *vertex))]
    Twice {
        /// As the first entry names it.
        first: u32,
        /// As the second entry names it.
        second: u32,
        /// The surviving vertex.
        vertex: u32,
    },
    /// The file has no such vertex.
    #[error("{key} names vertex {vertex}, but the file has {vertices} vertices (0 to {}): correct the index", vertices.saturating_sub(1))]
    OutOfRange {
        /// Where in the configuration.
        key: String,
        /// Given.
        vertex: u32,
        /// Vertices of the file.
        vertices: usize,
    },
    /// No surviving face uses the vertex.
    #[error(
        "{key} names vertex {vertex}, which no face of the repaired surface uses: name another vertex or a point"
    )]
    NotOnSurface {
        /// Where in the configuration.
        key: String,
        /// Given.
        vertex: u32,
    },
    /// An entry has neither vertex nor point, or both.
    #[error("{key} must have either a vertex or a point")]
    NoPlace {
        /// Where in the configuration.
        key: String,
    },
    /// A point is not finite.
    #[error("{key}.point has a coordinate that is not finite: correct it")]
    NonFinitePoint {
        /// Where in the configuration.
        key: String,
    },
    /// Two keys that exclude each other.
    #[error("{first} and {second} exclude each other: remove one of them")]
    Conflict {
        /// A key with its value.
        first: String,
        /// Another one.
        second: String,
    },
    /// `listed` without a list.
    #[error(
        "cones.strategy is \"listed\", but cones.list is empty: add cones or choose another strategy"
    )]
    EmptyList,
    /// A file of cones that nobody read.
    #[error(
        "cones.file names {}, but it was not read: load the configuration with config::load, or fill cones.list and cones.file_lines with cones::file::parse",
        path.display()
    )]
    FileNotRead {
        /// As written.
        path: std::path::PathBuf,
    },
    /// A file of features that nobody read.
    #[error(
        "features.file names {}, but it was not read: load the configuration with config::load, or fill features.list with features::file::parse",
        path.display()
    )]
    FeaturesNotRead {
        /// As written.
        path: std::path::PathBuf,
    },
    /// Two vertices that no edge joins.
    #[error(
        "{key} names an edge from vertex {} to vertex {}, but no face of the repaired surface has it: name vertices that an edge joins",
        ends[0],
        ends[1]
    )]
    NoSuchEdge {
        /// Where in the configuration.
        key: String,
        /// Its ends, as they were given.
        ends: [u64; 2],
    },
    /// `prescribed` without a list.
    #[error(
        "boundary.condition is \"prescribed\", but boundary.list is empty: add boundary vertices or set the condition to \"uniform\""
    )]
    EmptyBoundaryList,
    /// `spread` of no cones.
    #[error("cones.count is 0: give at least 1 cone, or set cones.strategy = \"none\"")]
    NoCount,
    /// A cone of curvature 0.
    #[error(
        "vertex {vertex} is listed as a cone of curvature 0, which is no cone: remove the entry or give its curvature"
    )]
    ZeroCurvature {
        /// Vertex.
        vertex: u32,
    },
    /// `spread` where the total is 0.
    #[error(
        "{count} cones were asked for, but with χ = {chi} there is no curvature left to share out: set cones.strategy = \"none\" or give cones.list"
    )]
    NothingToSpread {
        /// Cones wanted.
        count: usize,
        /// Euler characteristic.
        chi: i64,
    },
    /// A cone at a vertex whose curvature nobody prescribes.
    #[error(
        "vertex {vertex} lies on a free boundary, where no curvature can be prescribed: move the cone inside, or give it in boundary.list"
    )]
    OnFreeBoundary {
        /// Vertex.
        vertex: u32,
    },
    /// A cone on the border of a rectangle.
    #[error(
        "vertex {vertex} lies on the boundary, whose curvature boundary.condition = \"corners\" prescribes: move the cone inside, or give all curvature of the boundary in boundary.list"
    )]
    OnCornerBoundary {
        /// Vertex.
        vertex: u32,
    },
    /// The cone angle would not be positive.
    #[error(
        "vertex {vertex} has curvature {} ({curvature:.6} rad), but {place} it must be less than {} ({bound:.6} rad), so that an angle remains: lower it or spread it over more cones",
        in_pi(*curvature),
        in_pi(*bound)
    )]
    NoAngleLeft {
        /// Vertex, or 2³²−1 for one that repair made.
        vertex: u32,
        /// K̄, radians.
        curvature: f64,
        /// 2π or π.
        bound: f64,
        /// Interior or boundary.
        place: &'static str,
    },
    /// The boundary vertices that are not named would have to turn by π or more.
    #[error(
        "{others} boundary vertices are left to share a curvature of {}, {} each ({share:.6} rad), but on the boundary it must be less than 1π (3.141593 rad), so that an angle remains: list more of it in boundary.list, or give the interior more",
        in_pi(*rest),
        in_pi(*share)
    )]
    RestTooLarge {
        /// What they share, radians.
        rest: f64,
        /// How many they are.
        others: usize,
        /// K̄ of each, radians.
        share: f64,
    },
    /// Fewer than three cones on a sphere.
    #[error(
        "a closed surface of genus 0 needs at least 3 cones, because each has less than 2π of the 4π required, but {cones} were given: add cones"
    )]
    TooFewOnSphere {
        /// Given.
        cones: usize,
    },
    /// One cone cannot take all the curvature.
    #[error(
        "a single cone would need curvature {} (2πχ with χ = {chi}, less what the boundary takes), but a cone has less than 2π: set cones.strategy = \"spread\"",
        in_pi(*required)
    )]
    SingleTooLarge {
        /// Required, radians.
        required: f64,
        /// Euler characteristic.
        chi: i64,
    },
    /// Closed, curved, and no cones.
    #[error(
        "a closed surface of genus {genus} (χ = {chi}) needs cones of total curvature {}, but there are none: set cones.strategy = \"auto\" or \"spread\", or list cones",
        in_pi(*required)
    )]
    NeedsCones {
        /// Euler characteristic.
        chi: i64,
        /// Genus.
        genus: i64,
        /// 2πχ, radians.
        required: f64,
    },
    /// The field decides about the border.
    #[error(
        "cones.strategy = \"field\" makes borders straight between corners of its own choice, but boundary.condition, totals, list or corners ask for something else: leave them out, or set cones.strategy = \"auto\" with cones.quantum = \"1/2\""
    )]
    FieldOnGivenBoundary,
    /// A face has no angles.
    #[error(
        "cones.strategy = \"field\" needs faces with an area, and the surface has some without: merge their vertices, or set cones.strategy = \"auto\""
    )]
    FieldOnFlatFaces,
    /// There is no cross field.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// The loops of the surface could not be found.
    #[error(transparent)]
    Loops(#[from] LoopedError),
    /// The surface could not be flipped or doubled.
    #[error(transparent)]
    Connectivity(#[from] ConnectivityError),
    /// Not enough interior vertices.
    #[error(
        "{wanted} cones were asked for, but the component has {interior} interior vertices: ask for fewer or refine the mesh"
    )]
    TooFewVertices {
        /// Cones wanted.
        wanted: usize,
        /// Interior vertices.
        interior: usize,
    },
    /// The prescription misses (5).
    #[error(
        "the prescribed curvatures sum to {} ({given:.9} rad), but Gauss–Bonnet requires 2πχ = {} ({required:.9} rad) on a surface with χ = {chi} (genus {genus}, {boundary_loops} boundary loops): change the total by {}",
        in_pi(*given),
        in_pi(*required),
        in_pi(*required - *given)
    )]
    GaussBonnet {
        /// ΣK̄, radians.
        given: f64,
        /// 2πχ, radians.
        required: f64,
        /// Euler characteristic.
        chi: i64,
        /// Genus.
        genus: i64,
        /// Boundary loops.
        boundary_loops: usize,
    },
    /// A free boundary cannot make up for what the interior lacks.
    #[error(
        "the interior curvatures sum to {} ({given:.6} rad), but with a free boundary of {boundary_vertices} vertices and χ = {chi} they must exceed 2πχ − {boundary_vertices}π = {} ({bound:.6} rad): raise the total or refine the boundary",
        in_pi(*given),
        in_pi(*bound)
    )]
    FreeBoundaryTotal {
        /// Σ over the interior, radians.
        given: f64,
        /// Lower bound, excluded, radians.
        bound: f64,
        /// Euler characteristic.
        chi: i64,
        /// Number of boundary vertices.
        boundary_vertices: usize,
    },
    /// Not one total a loop.
    #[error(
        "boundary.totals has {given} entries, but the component has {loops} boundary loops: give one total a loop"
    )]
    TotalsCount {
        /// Entries.
        given: usize,
        /// Boundary loops.
        loops: usize,
    },
    /// `corners` on something that is no disk.
    #[error(
        "boundary.condition = \"corners\" needs a disk (genus 0, 1 boundary loop), but the component has genus {genus} and {loops} boundary loops: use \"free\", \"uniform\" or \"prescribed\""
    )]
    NotADisk {
        /// Genus.
        genus: i64,
        /// Boundary loops.
        loops: usize,
    },
    /// The automatic choice failed.
    #[error(
        "cones could not be chosen: {reason}; name cones in cones.list, or use another cones.strategy"
    )]
    NotChosen {
        /// Why.
        reason: String,
    },
    /// Too few cones for their total.
    #[error(
        "cones.count = {count}, but cones must add up to {} here, and within cones.min_curvature and cones.max_curvature that takes {least}: raise cones.count or widen the limits",
        in_pi(*total)
    )]
    TooFewCones {
        /// Most that are asked for.
        count: usize,
        /// Fewest that are needed.
        least: usize,
        /// What they must add up to, radians.
        total: f64,
    },
    /// The total is no multiple of the quantum.
    #[error(
        "cones must add up to {} here, which is no multiple of cones.quantum = {}: choose a quantum that divides it",
        in_pi(*total), in_pi(*quantum)
    )]
    NotInQuanta {
        /// Radians.
        quantum: f64,
        /// Radians.
        total: f64,
    },
    /// No cones of whole quanta have the total.
    #[error(
        "no {count} cones within cones.min_curvature and cones.max_curvature are multiples of cones.quantum = {} and add up to {}: raise cones.count, widen the limits, or lower the quantum",
        in_pi(*quantum), in_pi(*total)
    )]
    NoQuanta {
        /// Radians.
        quantum: f64,
        /// Radians.
        total: f64,
        /// Most that are asked for.
        count: usize,
    },
    /// Not four corners.
    #[error(
        "a rectangle has 4 corners, but boundary.corners names {given}: name 4, or none to have them chosen"
    )]
    CornerCount {
        /// Given.
        given: usize,
    },
    /// A vertex in the interior where one on the boundary is needed.
    #[error(
        "{key} names vertex {vertex}, which does not lie on the boundary: name a boundary vertex or a point"
    )]
    NotOnBoundary {
        /// Where in the configuration.
        key: &'static str,
        /// Vertex.
        vertex: u32,
    },
    /// A corner twice.
    #[error("{}", twice(*first, *second, *vertex))]
    CornerTwice {
        /// As the first entry names it.
        first: u32,
        /// As the second entry names it.
        second: u32,
        /// The surviving vertex.
        vertex: u32,
    },
    /// The boundary is too short.
    #[error(
        "a rectangle needs 4 boundary vertices, but the boundary has {given}: refine it or use another condition"
    )]
    BoundaryTooShort {
        /// Boundary vertices.
        given: usize,
    },
}

impl ConeError {
    /// The automatic choice failed, for this reason.
    pub(super) fn not_chosen(reason: impl ToString) -> Self {
        Self::NotChosen {
            reason: reason.to_string(),
        }
    }
}

fn twice(first: u32, second: u32, vertex: u32) -> String {
    if first == second {
        format!("vertex {first} is named twice: remove one of the entries")
    } else {
        format!(
            "vertices {first} and {second} are both named, but they are one vertex of the repaired surface (that of vertex {vertex}): remove one of the entries"
        )
    }
}
