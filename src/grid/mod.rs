//! The integer grid on an atlas whose transitions are quarter turns: a unit square lattice whose points, lines and cells are the same whatever chart they are seen from.
//!
//! [`cone_triangulation`] leaves of the surface triangles between cones; [`mod@quantise`] gives their sides whole numbers of cells; [`quads`] are the unit squares of that lattice, and [`blocks`] rectangles of them.

pub mod blocks;
pub mod complex;
pub(crate) mod cut;
pub(crate) mod dirichlet;
pub(crate) mod map;
pub(crate) mod sheet;
pub(crate) mod slivers;
pub mod cone_triangulation;
mod error;
pub mod lattice;
pub mod quads;
pub mod quantise;
#[cfg(test)]
mod tests;
mod walk;

pub use error::GridError;

#[doc(hidden)]
pub fn experiment(
    mesh: &crate::geometry::mesh::Mesh,
    uv: &crate::geometry::ids::FaceVec<[[f64; 2]; 3]>,
    is_line: &crate::geometry::ids::EdgeVec<bool>,
    cells: f64,
) -> Result<String, GridError> {
    use crate::geometry::ids::HalfedgeVec;
    use crate::geometry::subdivision::Subdivision;
    use std::time::Instant;
    let c = &mesh.connectivity;
    let begin = Instant::now();
    let surface = cone_triangulation::complex(c, uv, is_line)?;
    let turns: HalfedgeVec<u8> = c.halfedges().map(|h| surface.side(h).turns).collect();
    let cones = cone_triangulation::reduce(surface, c.vertex_count())?;
    let lattice = quantise::quantise(&cones.complex, cones.vertex.len(), cells)?;
    let quantised = begin.elapsed().as_secs_f64();
    let mut fine = Subdivision::identity(mesh);
    for h in c.halfedges() {
        fine.corner[h].uv = uv[c.face(h)][c.corner(h)];
    }
    let begin = Instant::now();
    let quads = lattice.quads()?;
    let blocks = quads.blocks()?;
    let quadded = begin.elapsed().as_secs_f64();
    let begin = Instant::now();
    let mut map = map::affine(fine, turns, &lattice, &cones.vertex, &quads)?;
    let overlaid = begin.elapsed().as_secs_f64();
    let k = &map.sheet.fine.connectivity;
    let least = k.faces().map(|f| map::double_area(map.corners(f))).fold(f64::INFINITY, f64::min);
    let over = k.faces().filter(|&f| map::double_area(map.corners(f)) <= 0.0).count();
    let area: f64 = k.faces().map(|f| 0.5 * map::double_area(map.corners(f))).sum();
    let mut text = format!(
        "{} -> {} faces, least {least:.2e} over {over} area {area:.6} of {} quantise {quantised:.2} overlay {overlaid:.2}",
        c.face_count(), k.face_count(), lattice.cells()
    );
    let quality = |p: [[f64; 2]; 3]| {
        let l = (0..3).map(|k| { let (a, b) = (p[k], p[(k + 1) % 3]); (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) }).fold(0.0, f64::max);
        map::double_area(p) / l
    };
    let size: f64 = c.faces().map(|f| {
        let [p, q, r] = mesh.face_positions(f);
        let s = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| a[i] - b[i]) };
        let (e, f) = (s(q, p), s(r, p));
        let x: [f64; 3] = std::array::from_fn(|i| e[(i + 1) % 3] * f[(i + 2) % 3] - e[(i + 2) % 3] * f[(i + 1) % 3]);
        0.5 * (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]).sqrt()
    }).sum();
    let begin = Instant::now();
    let left = slivers::thicken(&mut map);
    text += &format!(" thickened {left} in {:.2}", begin.elapsed().as_secs_f64());
    let begin = Instant::now();
    match dirichlet::relax(&mut map, (size / lattice.cells() as f64).sqrt()) {
        Ok(r) => text += &format!(" relaxed {} steps {:.3} -> {:.3} in {:.2}", r.steps, r.energy[0], r.energy[1], begin.elapsed().as_secs_f64()),
        Err(e) => text += &format!(" {e}"),
    }
    let begin = Instant::now();
    match cut::cut(&mut map, &quads, &blocks) {
        Ok(v) => {
            let k = &map.sheet.fine.connectivity;
            let least = k.faces().map(|f| quality(map.corners(f))).fold(f64::INFINITY, f64::min);
            let area: f64 = k.faces().map(|f| 0.5 * map::double_area(map.corners(f))).sum();
            text += &format!(" quads {quadded:.2} {} blocks cut {} points {} faces thinnest {least:.1e} area {area:.9} in {:.2}", blocks.blocks.len(), v.iter().flatten().count(), k.face_count(), begin.elapsed().as_secs_f64());
        }
        Err(e) => text += &format!(" CUT {e}"),
    }
    Ok(text)
}
