//! Figures of spline surfaces for a reader.

use super::FittedAsset;
use std::fmt;

/// STEP files with more control points a cell are large.
const MANY: usize = 20;
/// Shorter diagonals are small beside the accuracy of CAD programs, millimetres.
const SMALL: f64 = 0.1;

impl fmt::Display for FittedAsset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for c in self.document().components {
            let plural = |n: usize| if n == 1 { "" } else { "s" };
            let kind = if c.closed { "closed" } else { "open" };
            writeln!(
                f,
                "{}: {} control points on {} cells, {kind}; {} crease edge{}, {} corner{}",
                c.name,
                c.control_points,
                c.cells,
                c.crease_edges,
                plural(c.crease_edges),
                c.corners,
                plural(c.corners),
            )?;
            let (source, diagonal) = (c.from_source, c.diagonal_source_units);
            writeln!(
                f,
                "  from the mesh, {}: RMS {:.3e}, at most {:.3e} ({:.1e} and {:.1e} of the diagonal); normals {:.2} degrees off on average, 95 % within {:.2}",
                self.params.unit.name(),
                source.rms_of_diagonal * diagonal,
                source.max_of_diagonal * diagonal,
                source.rms_of_diagonal,
                source.max_of_diagonal,
                c.normal_deviation.mean_degrees,
                c.normal_deviation.p95_degrees,
            )?;
            if let Some(both) = c.both_ways {
                writeln!(
                    f,
                    "  of either from the other, vertices and borders included: at most {:.3e} ({:.1e})",
                    both.max_of_diagonal * diagonal,
                    both.max_of_diagonal,
                )?;
            }
            if c.inside_out {
                writeln!(f, "  the mesh is inside out: the surface looks outward")?;
            }
            if let Some(solid) = &c.void_of {
                writeln!(
                    f,
                    "  bounds a cavity of {solid}, whose STEP file has its faces"
                )?;
            }
            let step = &c.step;
            writeln!(
                f,
                "  STEP: {} face{}, {} control points; normals turn by {:.1e} degrees at most between regular cells, beside irregular points by {:.3} (95 %) and {:.3} (most)",
                step.faces,
                plural(step.faces),
                step.control_points,
                step.normal_jump_regular.max_degrees,
                step.normal_jump_irregular.p95_degrees,
                step.normal_jump_irregular.max_degrees,
            )?;
            if step.control_points > MANY * c.cells {
                writeln!(
                    f,
                    "  most of these lie beside irregular points, where cells are halved {} times; a larger --angle needs fewer",
                    step.halvings
                )?;
            }
            let millimetres = 1e3 * self.params.unit.metres() * diagonal;
            if millimetres < SMALL {
                writeln!(
                    f,
                    "  {millimetres:.1e} mm long: CAD programs take points for one that are 1e-7 mm apart, {:.0e} of this; give the unit of the mesh (--unit), or scale it",
                    1e-7 / millimetres
                )?;
            }
            if step.normal_jump_corners.max_degrees > 0.0 {
                writeln!(
                    f,
                    "  at corners, and where three cells or more lie between creases, by {:.1} at most",
                    step.normal_jump_corners.max_degrees
                )?;
            }
            if c.turned_over_area > 0.0 {
                writeln!(f, "  folded over: {:.1e} of the area", c.turned_over_area)?;
            }
        }
        Ok(())
    }
}
