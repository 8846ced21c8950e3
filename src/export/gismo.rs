//! Spline surfaces as the XML of G+Smo: a `MultiPatch` of `TensorBSpline2`.
//!
//! *Enters:* [`Patches`]. *Leaves:* the text of a file. *Guaranteed:* numbers are read back to the last bit; the file holds no time, name or path.
//!
//! Patch i has the id i, so that ids and indices agree; the multipatch has the next id. A side is 1 (u = 0), 2 (the last u), 3 (v = 0) or 4 (the last v). A line of `interfaces` is patch, side, patch, side, then for u and v of the first patch which parameter of the
//! second corresponds to it (0 or 1), and whether it runs the same way there (1) or against it (0). Across the sides parameters run the same way where one ends and the other begins: so the documentation of G+Smo's `boundaryInterface`, the files that come with it, and older
//! versions; newer ones put their own flag there, the opposite, whatever the file has. Control points are listed with u fastest.

use crate::spline::patches::{Interface, PatchSide, Patches};
use crate::spline::surface::DEGREE;
use std::io::{self, Write};

/// Writes the file.
///
/// # Errors
/// Those of the writer.
pub fn write(patches: &Patches, out: &mut impl Write) -> io::Result<()> {
    let count = patches.surfaces.len();
    writeln!(out, r#"<?xml version="1.0" encoding="UTF-8"?>"#)?;
    writeln!(out, "<xml>")?;
    for (id, surface) in patches.surfaces.iter().enumerate() {
        writeln!(out, r#" <Geometry type="TensorBSpline2" id="{id}">"#)?;
        writeln!(out, r#"  <Basis type="TensorBSplineBasis2">"#)?;
        for (index, knots) in surface.knots.iter().enumerate() {
            let knots: Vec<String> = knots.iter().map(f64::to_string).collect();
            let knots = knots.join(" ");
            writeln!(out, r#"   <Basis type="BSplineBasis" index="{index}">"#)?;
            writeln!(
                out,
                r#"    <KnotVector degree="{DEGREE}">{knots}</KnotVector>"#
            )?;
            writeln!(out, "   </Basis>")?;
        }
        writeln!(out, "  </Basis>")?;
        writeln!(out, r#"  <coefs geoDim="3">"#)?;
        for [x, y, z] in &surface.control {
            // Debug writes very small and large numbers with an exponent.
            writeln!(out, "{x:?} {y:?} {z:?}")?;
        }
        writeln!(out, "  </coefs>")?;
        writeln!(out, " </Geometry>")?;
    }
    writeln!(out, r#" <MultiPatch parDim="2" id="{count}">"#)?;
    let last = count.saturating_sub(1);
    writeln!(out, r#"  <patches type="id_range">0 {last}</patches>"#)?;
    writeln!(out, "  <interfaces>")?;
    for interface in &patches.interfaces {
        writeln!(out, "{}", line(interface))?;
    }
    writeln!(out, "  </interfaces>")?;
    writeln!(out, "  <boundary>")?;
    for &side in &patches.boundary {
        writeln!(out, "{}", name(side))?;
    }
    writeln!(out, "  </boundary>")?;
    writeln!(out, " </MultiPatch>")?;
    writeln!(out, "</xml>")
}

fn name(PatchSide { patch, side }: PatchSide) -> String {
    format!("{patch} {side}")
}

fn line(interface: &Interface) -> String {
    let Interface {
        first,
        second,
        reversed,
    } = *interface;
    // The parameter across a side, and whether it ends there.
    let of = |side: u8| [(side - 1) / 2, (side - 1) % 2];
    let ([across, is_far], [across_second, is_far_second]) = (of(first.side), of(second.side));
    let mut map = [1 - across_second; 2];
    map[usize::from(across)] = across_second;
    let mut same = [u8::from(!reversed); 2];
    same[usize::from(across)] = u8::from(is_far != is_far_second);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spline::surface::{BSplineSurface, clamped};

    fn text(patches: &Patches) -> String {
        let mut bytes = Vec::new();
        write(patches, &mut bytes).expect("written");
        String::from_utf8(bytes).expect("text")
    }

    #[test]
    fn numbers_are_read_back_to_the_last_bit() {
        let numbers = [0.1, -0.0, 1e-300, 1.0 / 3.0, 12345.678, f64::MAX];
        let control: Vec<[f64; 3]> = (0..20)
            .map(|i| [0, 1, 2].map(|k| numbers[(i + k) % 6]))
            .collect();
        let knots = [clamped(&[0.0, 0.5, 1.0]), clamped(&[0.0, 1.0])];
        let patches = Patches {
            surfaces: vec![BSplineSurface { knots, control }],
            interfaces: Vec::new(),
            boundary: Vec::new(),
        };
        let text = text(&patches);
        assert!(text.contains(r#"degree="3">0 0 0 0 0.5 1 1 1 1</KnotVector>"#));
        let inside = text.split_once(r#"<coefs geoDim="3">"#).expect("begin").1;
        let inside = inside.split_once("</coefs>").expect("end").0;
        let read = inside
            .split_whitespace()
            .map(|x| x.parse::<f64>().expect("a number"));
        let control = patches.surfaces[0].control.iter().flatten();
        assert!(read.map(f64::to_bits).eq(control.map(|x| x.to_bits())));
    }

    #[test]
    fn interfaces_say_which_parameters_correspond() {
        let side = |patch, side| PatchSide { patch, side };
        let line = |s, t, reversed| {
            super::line(&Interface {
                first: side(0, s),
                second: side(1, t),
                reversed,
            })
        };
        // Side by side, turned by a quarter, by a half, and where parameters across meet end to end.
        assert_eq!(line(2, 1, false), "0 2 1 1 0 1 1 1");
        assert_eq!(line(2, 3, true), "0 2 1 3 1 0 1 0");
        assert_eq!(line(4, 1, true), "0 4 1 1 1 0 0 1");
        assert_eq!(line(2, 2, true), "0 2 1 2 0 1 0 0");
        assert_eq!(line(3, 1, false), "0 3 1 1 1 0 1 0");
    }
}
