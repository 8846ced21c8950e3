//! The integer grid on an atlas whose transitions are quarter turns: a unit square lattice whose points, lines and cells are the same whatever chart they are seen from.
//!
//! *Enters:* a charted surface. *Leaves:* the same surface with finer faces, each in one cell block, and a [`Grid`]: grid coordinates, quads, blocks. [`cone_triangulation`] leaves of the surface triangles between cones; [`mod@quantise`] gives their sides
//! whole numbers of cells; [`quads`] are the unit squares of that lattice, and [`blocks`] rectangles of them. `map` takes the surface there, `relax` makes the map one of little distortion, `cut` draws the borders of blocks on the surface.

pub mod blocks;
mod cells;
pub mod complex;
pub mod cone_triangulation;
pub(crate) mod cut;
mod density;
mod dirichlet;
mod distortion;
mod energy;
mod error;
mod fan;
mod follow;
pub mod islands;
pub mod lattice;
mod layout;
pub(crate) mod map;
mod packing;
mod params;
mod patches;
pub mod quads;
pub mod quantise;
mod refine;
mod regions;
mod relax;
pub(crate) mod sheet;
pub(crate) mod slivers;
mod spots;
mod squares;
mod squeezed;
mod system;
#[cfg(test)]
mod tests;
pub(crate) mod triangle;
mod walk;

pub use distortion::Distortion;
pub use error::GridError;
pub use params::{Density, GridParams, MOST_CELLS};
pub(crate) use refine::{Spacing, is_coarse, refined, spacings};

use crate::atlas::charted::{self, Charted};
use crate::atlas::geometry_image::GeometryImage;
use crate::atlas::patches::PatchLayout;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceVec, HalfedgeId, HalfedgeVec, VertexId, VertexVec};
use crate::geometry::mesh::{Mesh, triangle_area};
use crate::geometry::subdivision::Subdivision;
use crate::observe::{Observer, part};
use blocks::Blocks;
use density::Units;
use islands::Islands;
use map::GridMap;
use quads::QuadMesh;
use std::collections::BTreeSet;

/// A surface's grid; its faces are those of the surface that came with it.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Texels a cell.
    pub samples_per_cell: usize,
    /// √(source area / cells), source units.
    pub cell_size: f64,
    /// Grid coordinates of the corners of every face, in its frame: multiples of a power of two, so that differences are exact.
    pub uv: FaceVec<[[f64; 2]; 3]>,
    /// Quarter turns across the edge opposite every corner.
    pub turns: FaceVec<[u8; 3]>,
    /// And the translation: q = R^turns p + shift; zero at a border.
    pub shift: FaceVec<[[i64; 2]; 3]>,
    /// The quad mesh.
    pub quads: QuadMesh,
    /// Where its points are, source units.
    pub points: Vec<[f64; 3]>,
    /// Vertices of the surface that points on borders of blocks are.
    pub vertex: Vec<Option<VertexId>>,
    /// Rectangles of squares; the first of each is at its bottom left.
    pub blocks: Blocks,
    /// How blocks lie in the square of `TEXCOORD_0`.
    pub islands: Islands,
    /// How far the map is from an isometry.
    pub distortion: Distortion,
}

/// A cell in its block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    /// Points, counterclockwise from the corner at its column and row.
    pub corners: [u32; 4],
    /// The block.
    pub block: u32,
    /// Column and row there.
    pub at: [u32; 2],
}

/// Vertices of the surface that a grid lies on, at most, for each of the mesh and beside that.
const MOST_FOR_VERTEX: usize = 16;
const MOST_BESIDE: usize = 20_000;

/// With so many vertices on the border, at least one for each [`MOST_BORDER`] of them must be inside.
const LONG_BORDER: usize = 1000;
const MOST_BORDER: usize = 100;

/// Refuses meshes without vertices inside, of which it is known before the flow that they would become too fine.
pub(crate) fn check_inside(mesh: &Mesh) -> Result<(), GridError> {
    let c = &mesh.connectivity;
    let border = c.vertices().filter(|&v| c.is_boundary_vertex(v)).count();
    let inside = c.vertex_count() - border;
    match border >= LONG_BORDER && inside < border / MOST_BORDER {
        true => Err(GridError::NothingInside { border, inside }),
        false => Ok(()),
    }
}

/// Range of the log scale on which a grid lies: 13 of float64's 16 digits.
const MOST_RANGE: f64 = 30.0;

/// Refuses metrics in which some places are too large beside others.
pub(crate) fn check_range(log_scale: &[f64]) -> Result<(), GridError> {
    let ends = |(low, high): (f64, f64), &x: &f64| (low.min(x), high.max(x));
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = log_scale.iter().fold(none, ends);
    let (range, most) = (high - low, MOST_RANGE);
    match range > most {
        true => Err(GridError::Range { range, most }),
        false => Ok(()),
    }
}

/// Refuses surfaces on which a grid would take out of proportion long.
pub(crate) fn check_size(vertices: usize, refined: usize) -> Result<(), GridError> {
    let most = vertices
        .saturating_mul(MOST_FOR_VERTEX)
        .saturating_add(MOST_BESIDE);
    match refined > most {
        true => Err(GridError::TooFine {
            vertices,
            refined,
            most,
        }),
        false => Ok(()),
    }
}

/// Puts a grid on a surface and its images on that; the surface gets finer faces.
///
/// # Errors
/// Transitions that are no quarter turns, cones that no whole numbers fit, faces too thin for float64.
///
/// `gutter`: texels between islands; `observer` may stop it.
pub fn grid(
    surface: Charted,
    params: &GridParams,
    gutter: usize,
    observer: &dyn Observer,
) -> Result<(Charted, PatchLayout, Grid), GridError> {
    let lines = lines(&surface, params.cells);
    let uv = &surface.central.uv;
    let (map, grid, located) = made(&surface.mesh, uv, &lines, params, gutter, observer)?;
    let _part = part!("lift");
    let surface = charted::lift(surface, &map.sheet.fine);
    let layout = patches::layout(&surface, &grid, located);
    Ok((surface, layout, grid))
}

/// The same of a surface that lies on the plane face by face: source units, each face in a frame of its own.
fn made(
    mesh: &Mesh,
    central: &FaceVec<[[f64; 2]; 3]>,
    lines: &EdgeVec<bool>,
    params: &GridParams,
    gutter: usize,
    observer: &dyn Observer,
) -> Result<(GridMap, Grid, layout::Located), GridError> {
    let c = &mesh.connectivity;
    let part = part!("cone triangulation");
    let flat = cone_triangulation::complex(c, central, lines)?;
    let turns: HalfedgeVec<u8> = c.halfedges().map(|h| flat.side(h).turns).collect();
    let cones = cone_triangulation::reduce(flat, c.vertex_count())?;
    drop(part);
    let surface = Flattened {
        mesh,
        central,
        lines,
        turns,
        cones,
        observer,
    };
    let of_part = |part: f64| of_cells(&surface, params, part * params.cells as f64, gutter);
    let error = match of_part(1.0) {
        Err(e @ (GridError::TurnedOver { .. } | GridError::Lost { .. })) => e,
        made => return made,
    };
    tracing::debug!(%error, "again with other numbers of cells");
    let another = |&part: &f64| of_part(part).ok();
    TARGETS.iter().find_map(another).ok_or(error)
}

/// A surface on the plane and its cones.
struct Flattened<'a> {
    mesh: &'a Mesh,
    central: &'a FaceVec<[[f64; 2]; 3]>,
    lines: &'a EdgeVec<bool>,
    turns: HalfedgeVec<u8>,
    cones: cone_triangulation::ConeTriangulation,
    observer: &'a dyn Observer,
}

/// Parts of the number of cells that are asked for in turn, where faces are turned over or lines are lost: other whole numbers leave them other room.
const TARGETS: [f64; 3] = [1.05, 0.95, 1.1];

/// Part of the area that may be squeezed. It is 0.4 of noise, of other surfaces below 0.02, …
const MOST_SQUEEZED: f64 = 0.1;
/// … but any of parts of a file that get fewer cells than their shape asks for.
const FEW_CELLS: f64 = 200.0;

/// The grid of about so many cells.
fn of_cells(
    surface: &Flattened,
    params: &GridParams,
    wanted: f64,
    gutter: usize,
) -> Result<(GridMap, Grid, layout::Located), GridError> {
    let Flattened { mesh, cones, .. } = surface;
    let c = &mesh.connectivity;
    let part = part!("quantise");
    let mut lattice = quantise::quantise(&cones.complex, cones.vertex.len(), wanted)?;
    let mut quads = lattice.quads()?;
    for halvings in 1..=MOST_HALVINGS {
        if quads.is_simple() {
            break;
        }
        // Fewer cells that are divided into as many as wanted.
        let coarse = (wanted / 4f64.powi(halvings)).max(1.0);
        lattice = quantise::quantise(&cones.complex, cones.vertex.len(), coarse)?;
        for _ in 0..halvings {
            lattice = lattice.halved();
        }
        quads = lattice.quads()?;
    }
    if !quads.is_simple() {
        return Err(GridError::NoCells);
    }
    drop(part);
    let part = part!("blocks and islands");
    let mut blocks = quads.blocks()?;
    let islands = islands::arrange(&quads, &mut blocks, params.samples_per_cell, gutter)?;
    drop(part);
    let part = part!("affine map");
    let mut fine = Subdivision::identity(mesh);
    for h in c.halfedges() {
        fine.corner[h].uv = surface.central[c.face(h)][c.corner(h)];
    }
    // Cones, and what lies on lines of the lattice.
    let mut is_kept = VertexVec::filled(false, c.vertex_count());
    cones.vertex.iter().for_each(|&v| is_kept[v] = true);
    for (e, _) in surface.lines.enumerate().filter(|(_, is_line)| **is_line) {
        c.edge_vertices(e).iter().for_each(|&v| is_kept[v] = true);
    }
    let may_move = |v: VertexId| v.index() >= is_kept.len() || !is_kept[v];
    let mut map = map::affine(
        fine,
        surface.turns.clone(),
        &lattice,
        &cones.vertex,
        &quads,
        surface.lines,
        may_move,
    )?;
    slivers::thicken(&mut map, triangle::THICK);
    let areas = c.faces().map(|f| triangle_area(mesh.face_positions(f)));
    let cell_size = (areas.sum::<f64>() / quads.quads.len() as f64).sqrt();
    let unit = Units::new(mesh, cell_size, params.density)?;
    drop(part);
    let relaxed = relax::relax(&mut map, &unit, surface.observer)?;
    if wanted > FEW_CELLS && relaxed.squeezed > MOST_SQUEEZED {
        return Err(GridError::Rough {
            squeezed: relaxed.squeezed,
            most: MOST_SQUEEZED,
        });
    }
    let unfolded = cells::unfold(&mut map, &quads, &unit)?;
    tracing::debug!(
        cones = cones.vertex.len(),
        cells = quads.quads.len(),
        blocks = blocks.blocks.len(),
        steps = relaxed.steps,
        energy = relaxed.energy[1],
        squeezed = relaxed.squeezed,
        unfolded = unfolded.len(),
        "grid"
    );
    let part = part!("borders of blocks");
    let placed = cut::cut(&mut map, &quads, &blocks, &unit, &unfolded)?;
    let located = layout::locate(&map, &quads, &blocks, &placed)?;
    drop(part);
    let k = &map.sheet.fine.connectivity;
    let of_edges = |f, of: &dyn Fn(HalfedgeId) -> [i64; 2]| {
        let h = k.face_halfedges(f);
        [of(h[1]), of(h[2]), of(h[0])]
    };
    let grid = Grid {
        samples_per_cell: params.samples_per_cell,
        cell_size,
        uv: k.faces().map(|f| map.corners(f)).collect(),
        turns: k
            .faces()
            .map(|f| {
                let h = k.face_halfedges(f);
                let turns = |h: HalfedgeId| match k.twin(h) {
                    Some(_) => map.sheet.turns[h],
                    None => 0,
                };
                [turns(h[1]), turns(h[2]), turns(h[0])]
            })
            .collect(),
        shift: k.faces().map(|f| of_edges(f, &|h| map.shift(h))).collect(),
        distortion: distortion::measure(&map, &quads, &located.points, cell_size),
        points: located.points.clone(),
        vertex: placed
            .iter()
            .map(|p| p.as_ref().map(|p| p.vertex))
            .collect(),
        quads,
        blocks,
        islands,
    };
    Ok((map, grid, located))
}

/// How often cells are halved where two edges of the quad mesh have the same ends: a single cell whose sides are glued needs it twice.
const MOST_HALVINGS: i32 = 2;

/// Features that are shorter, in cells, are no lines of the lattice: they would need more cells around them than the surface.
const SHORTEST_LINE: f64 = 2.0;

/// Edges on lines of the lattice: features of some length; borders are lines anyway.
fn lines(surface: &Charted, cells: usize) -> EdgeVec<bool> {
    let c: &Connectivity = &surface.mesh.connectivity;
    let areas = c
        .faces()
        .map(|f| triangle_area(surface.mesh.face_positions(f)));
    let shortest = SHORTEST_LINE * (areas.sum::<f64>() / cells as f64).sqrt();
    let lines = surface
        .metric
        .quarter_turns
        .iter()
        .flat_map(|met| &met.lines)
        .filter(|line| line.length >= shortest);
    let pairs = lines.flat_map(|line| line.vertices.windows(2));
    let sorted = |a: VertexId, b: VertexId| [a.min(b), a.max(b)];
    let pairs: BTreeSet<[VertexId; 2]> = pairs.map(|w| sorted(w[0], w[1])).collect();
    let is_line = |e| {
        let [a, b] = c.edge_vertices(e);
        pairs.contains(&sorted(a, b))
    };
    c.edges().map(is_line).collect()
}

impl Grid {
    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.quads.quads.len()
    }

    /// All cells, in the order of squares.
    pub fn cells_in_blocks(&self) -> Vec<Cell> {
        let none = Cell {
            corners: [0; 4],
            block: 0,
            at: [0; 2],
        };
        let mut cells = vec![none; self.cells()];
        for (b, block) in self.blocks.blocks.iter().enumerate() {
            let w = block.cells[0];
            for (i, &(q, k)) in block.squares.iter().enumerate() {
                let corners = self.quads.quads[q as usize];
                cells[q as usize] = Cell {
                    corners: std::array::from_fn(|j| corners[(usize::from(k) + j) % 4]),
                    block: b as u32,
                    at: [(i % w) as u32, (i / w) as u32],
                };
            }
        }
        cells
    }

    /// Points whose number of edges is not 4, or 3 on the border.
    pub fn irregular(&self) -> Vec<usize> {
        let is_border = self.quads.border();
        let points = self.quads.points.iter().zip(&is_border).enumerate();
        points
            .filter(|(_, (p, border))| p.valence != if **border { 3 } else { 4 })
            .map(|(i, _)| i)
            .collect()
    }

    /// Makes texels on common sides of images the same to the last bit.
    pub fn unite(&self, images: &mut [GeometryImage]) {
        layout::shared_texels(
            &self.quads,
            &self.blocks,
            self.samples_per_cell,
            |from, to| {
                let at = |[b, column, row]: [usize; 3]| (b, images[b].width * row + column);
                let ((b, i), (d, j)) = (at(from), at(to));
                let (position, normal, log_scale) = (
                    images[b].position[i],
                    images[b].normal[i],
                    images[b].log_scale[i],
                );
                images[d].position[j] = position;
                images[d].normal[j] = normal;
                images[d].log_scale[j] = log_scale;
            },
        );
    }
}
