//! Spline surfaces as the XML of G+Smo: a `MultiPatch` of `TensorBSpline2`.
//!
//! *Enters:* [`Surfaces`]. *Leaves:* the text of a file. *Guaranteed:* numbers are read back to the last bit; the file holds no
//! time, name or path.
//!
//! Patch i has the id i, so that ids and indices agree; the multipatch has the next id. A side is 1 (u = 0), 2 (u = 1), 3 (v = 0) or
//! 4 (v = 1). A line of `interfaces` is patch, side, patch, side, then for u and v of the first patch which parameter of the
//! second corresponds to it (0 or 1), and whether it runs the same way there (1) or against it (0). Control points are listed with u
//! fastest.
//!
//! STEP is not written. The crate that writes `B_SPLINE_SURFACE_WITH_KNOTS`, truck-stepio 0.3, brings 29 more crates (cgmath of 2021, the
//! unmaintained proc-macro-error, a calendar) to a tree of 194, and writes numbers below 0.01 with eleven digits.

use crate::fit::{DEGREE, Interface, PatchSide, Surfaces};
use std::io::{self, Write};

/// Writes the file.
///
/// # Errors
/// Those of the writer.
pub fn write(surfaces: &Surfaces, out: &mut impl Write) -> io::Result<()> {
    let patches = surfaces.patches.len();
    writeln!(out, r#"<?xml version="1.0" encoding="UTF-8"?>"#)?;
    writeln!(out, "<xml>")?;
    for (id, patch) in surfaces.patches.iter().enumerate() {
        writeln!(out, r#" <Geometry type="TensorBSpline2" id="{id}">"#)?;
        writeln!(out, r#"  <Basis type="TensorBSplineBasis2">"#)?;
        for (index, basis) in patch.basis.iter().enumerate() {
            writeln!(out, r#"   <Basis type="BSplineBasis" index="{index}">"#)?;
            let knots: Vec<String> = basis.knots().iter().map(f64::to_string).collect();
            writeln!(
                out,
                r#"    <KnotVector degree="{DEGREE}">{}</KnotVector>"#,
                knots.join(" ")
            )?;
            writeln!(out, "   </Basis>")?;
        }
        writeln!(out, "  </Basis>")?;
        writeln!(out, r#"  <coefs geoDim="3">"#)?;
        for [x, y, z] in &patch.control {
            // Debug writes very small and large numbers with an exponent.
            writeln!(out, "{x:?} {y:?} {z:?}")?;
        }
        writeln!(out, "  </coefs>")?;
        writeln!(out, " </Geometry>")?;
    }
    writeln!(out, r#" <MultiPatch parDim="2" id="{patches}">"#)?;
    let last = patches.saturating_sub(1);
    writeln!(out, r#"  <patches type="id_range">0 {last}</patches>"#)?;
    writeln!(out, "  <interfaces>")?;
    for interface in &surfaces.neighbours.interfaces {
        writeln!(out, "{}", line(interface))?;
    }
    writeln!(out, "  </interfaces>")?;
    writeln!(out, "  <boundary>")?;
    for &side in &surfaces.neighbours.boundary {
        writeln!(out, "{}", name(side))?;
    }
    writeln!(out, "  </boundary>")?;
    writeln!(out, " </MultiPatch>")?;
    writeln!(out, "</xml>")
}

fn name(PatchSide { patch, side }: PatchSide) -> String {
    format!("{patch} {}", side as usize + 1)
}

fn line(interface: &Interface) -> String {
    let Interface {
        first,
        second,
        reversed,
    } = *interface;
    let (along, along_second) = (first.side.along(), second.side.along());
    let mut map = [1 - along_second; 2];
    map[along] = along_second;
    // Across the sides both parameters go on in one direction where one ends and the other begins.
    let mut same = [u8::from(first.side.is_far() != second.side.is_far()); 2];
    same[along] = u8::from(!reversed);
    format!(
        "{} {} {} {} {} {}",
        name(first),
        name(second),
        map[0],
        map[1],
        same[0],
        same[1]
    )
}
