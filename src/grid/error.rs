//! Why a surface has no grid.

use crate::flow::solve::SolveError;
use crate::geometry::ids::{EdgeId, FaceId, VertexId};

/// Why there is no grid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// Somebody asked to stop.
    #[error("stopped before the grid was finished")]
    Cancelled,
    /// The surface would have far more faces than the mesh.
    #[error(
        "with straight borders and cones of quarter turns, edges of the flat surface cross those of the mesh so often that {vertices} vertices become {refined}, more than {most}: divide the long thin faces of the mesh into faces of similar sides"
    )]
    TooFine {
        /// Of the mesh.
        vertices: usize,
        /// Of the surface that the grid would lie on.
        refined: usize,
        /// Most that are accepted.
        most: usize,
    },
    /// Hardly a vertex lies inside: straight borders would cut the surface into far more faces than it has.
    #[error(
        "{border} vertices of the mesh lie on its border and only {inside} inside: a grid, whose borders are straight, needs vertices inside; remesh the surface"
    )]
    NothingInside {
        /// Vertices on the border.
        border: usize,
        /// And inside.
        inside: usize,
    },
    /// One place of the surface is too large on the plane beside another.
    #[error(
        "some places become e^{range:.0} times as large on the plane as others, more than e^{most}, which float64's 16 digits do not hold: more cones are needed (cones.count)"
    )]
    Range {
        /// Of the log scale.
        range: f64,
        /// Most that is accepted.
        most: f64,
    },
    /// The sides of an edge are not a quarter turn apart.
    #[error(
        "both sides of edge {edge} of the refined surface are {gap:.1e} apart after a quarter turn, more than rounding leaves: faces there are too thin or too small for float64's 16 digits"
    )]
    NoQuarterTurn {
        /// Edge of the atlas.
        edge: EdgeId,
        /// What is left between them, source units.
        gap: f64,
    },
    /// An angle around a vertex is no multiple of a quarter turn.
    #[error(
        "the angle at vertex {vertex} is {quarters} quarter turns, but a grid needs whole ones, and at least one: cones.strategy = \"field\" chooses them"
    )]
    NoQuarterAngle {
        /// Vertex of the atlas.
        vertex: VertexId,
        /// The angle, quarter turns.
        quarters: f64,
    },
    /// Angles do not sum to what the surface has.
    #[error(
        "the angles of the flat surface leave {curvature} quarter turns of curvature, but its Euler characteristic is {euler} (Gauss–Bonnet): faces are too thin for float64's 16 digits"
    )]
    GaussBonnet {
        /// Σ (4 − angle) inside and Σ (2 − angle) on the border, quarter turns.
        curvature: i64,
        /// χ; curvature should be four times that.
        euler: i64,
    },
    /// No whole numbers were found.
    #[error(
        "no grid was found whose cells fit between the cones of the surface: ask for more cells, or for fewer cones (cones.count)"
    )]
    NoCells,
    /// Cones far apart, measured in what lies between others, force far more cells than were wanted.
    #[error(
        "no fewer than about {cells} cells were found that fit between the cones of the surface, and {wanted:.0} were wanted: ask for at least {least:.0} (grid.cells), or for more cones (cones.count)"
    )]
    TooMany {
        /// Cells of the coarsest grid that was found.
        cells: i64,
        /// What was asked for.
        wanted: f64,
        /// From how many on that would have been accepted.
        least: f64,
    },
    /// A number of cells that is no such number, or too many.
    #[error("{cells} cells were asked for: a grid has from 1 to {most}")]
    Cells {
        /// What was asked for.
        cells: f64,
        /// Most that are made.
        most: f64,
    },
    /// Cells of the size that was asked for would be too many.
    #[error(
        "grid.cell_size = {size} asks for {cells:.3e} cells on an area of {area:.3e} square units, and a grid has at most {most}: at least {least:.3e} is possible"
    )]
    CellSize {
        /// Side of a cell, source units.
        size: f64,
        /// Area of the component, square source units.
        area: f64,
        /// Area over that of a cell.
        cells: f64,
        /// Most that are made.
        most: usize,
        /// The size at which there are as many.
        least: f64,
    },
    /// A face has no area on the lattice.
    #[error("face {face} of the cone triangulation has no area on the lattice")]
    NoArea {
        /// Face of the cone triangulation.
        face: FaceId,
    },
    /// A square of the lattice does not close: steps or gluings contradict each other.
    #[error(
        "the lattice does not close around point {at:?} of face {face} of the cone triangulation"
    )]
    Open {
        /// Face of the cone triangulation.
        face: FaceId,
        /// Coordinates there.
        at: [i64; 2],
    },
    /// There are fewer or more squares than area.
    #[error("the lattice has {found} squares, but an area of {cells}")]
    Quads {
        /// Squares.
        found: usize,
        /// Area, cells.
        cells: i64,
    },
    /// The lines from irregular points leave a region that is no rectangle.
    #[error("the region around square {square} of the grid is no rectangle")]
    NoRectangle {
        /// A square there.
        square: u32,
    },
    /// Too much of the surface is too rough for its cells.
    #[error(
        "cells would be stretched more than sevenfold on {:.0} % of the surface's area, and a grid has at most {:.0} %: the surface is rougher than its cells, or a low cones.count leaves it too few irregular points: smooth it, or ask for more cells (grid.cells), or for more cones", 100.0 * squeezed, 100.0 * most
    )]
    Rough {
        /// Part of the area.
        squeezed: f64,
        /// Most that is accepted.
        most: f64,
    },
    /// A straight line from cone to cone did not arrive.
    #[error(
        "line {line} of the grid was lost in face {face}: faces there are too thin for float64's 16 digits"
    )]
    Lost {
        /// Number of the line.
        line: u32,
        /// Where it was last, a face of the refined surface.
        face: FaceId,
    },
    /// Faces and lines between cones do not fit together.
    #[error("face {face} of the refined surface lies in no triangle between cones")]
    NoTriangle {
        /// Face of the refined surface.
        face: FaceId,
    },
    /// A face is turned over by the map.
    #[error(
        "{count} faces of the surface are turned over on the grid, face {face} of its refinement first"
    )]
    TurnedOver {
        /// How many.
        count: usize,
        /// The first.
        face: FaceId,
    },
    /// A system of equations could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
}

impl GridError {
    /// Whether it may come of rounding in thin faces, which other triangles may be without.
    pub(crate) fn is_of_thin_faces(&self) -> bool {
        matches!(
            self,
            Self::NoTriangle { .. }
                | Self::Lost { .. }
                | Self::NoQuarterTurn { .. }
                | Self::TurnedOver { .. }
        )
    }
}
