//! What `affine-atlas fit` writes beside the surfaces: figures, control mesh, page.

pub mod document;
pub mod page;

use crate::spline::Spline;
use std::io::{self, Write};

/// The control mesh as OBJ: vertices and quads, every float with the shortest decimals that read back to the same bits.
///
/// # Errors
/// Those of the writer.
pub fn control_mesh(spline: &Spline, out: &mut impl Write) -> io::Result<()> {
    for [x, y, z] in &spline.control {
        writeln!(out, "v {x:?} {y:?} {z:?}")?;
    }
    for cell in &spline.cage.cells {
        let [a, b, c, d] = cell.map(|v| v + 1);
        writeln!(out, "f {a} {b} {c} {d}")?;
    }
    Ok(())
}
