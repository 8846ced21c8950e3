//! `fit.html`: figures and zebra stripes of spline surfaces, on a page that needs no network.

use super::document::{Component, Document, Unfitted};
use crate::export::html::{BESIDE, escape, figure, link, page};
use crate::export::pictures::painted;
use crate::geometry::mesh::Mesh;
use crate::spline::Spline;
use crate::spline::evaluator::CORNER;
use crate::spline::tessellation::Tessellation;
use std::fmt::Write;

/// Pixels of a picture.
const PICTURE: usize = 900;
/// Stripes over half a turn of the normal.
const STRIPES: f64 = 24.0;
/// The direction that stripes are measured from: to the upper left of most views.
const FROM: [f64; 3] = [0.36, 0.48, 0.8];

/// Zebra stripes: black and white by the angle between the normal and one direction. They run through without kinks where the surface has no crease.
/// None where the triangles of the surface make no mesh.
pub fn zebra(spline: &Spline, triangles: Tessellation) -> Option<image::RgbImage> {
    let parts = triangles.parts;
    let mesh = Mesh::bare(triangles.points, &triangles.faces).ok()?;
    Some(spline.with_limit(|limit| {
        painted(&mesh, PICTURE, &|face, weights| {
            let (cell, number) = (face / (2 * parts * parts), face % (2 * parts * parts));
            let (part, half) = (number / 2, number % 2);
            let low = [part % parts, part / parts];
            let corners = if half == 0 { [0, 1, 2] } else { [0, 2, 3] };
            let at = [0, 1].map(|i| {
                let of = |k: usize| weights[k] * (low[i] as f64 + CORNER[corners[k]][i]);
                ((of(0) + of(1) + of(2)) / parts as f64).clamp(0.0, 1.0)
            });
            let (_, normal) = limit.normal(cell as u32, at);
            let cosine: f64 = (0..3).map(|i| normal[i] * FROM[i]).sum();
            let stripe = (STRIPES * cosine.clamp(-1.0, 1.0).acos() / std::f64::consts::PI) as i64;
            [if stripe % 2 == 0 { 0.02 } else { 0.8 }; 3]
        })
    }))
}

/// The page; `pictures` are the files of [`zebra`] stripes beside it, one a component where there is one.
pub fn text(title: &str, document: &Document, pictures: &[Option<String>]) -> String {
    let mut body = format!("<h1>{}</h1>\n", escape(title));
    for (component, picture) in document.components.iter().zip(pictures) {
        let _ = writeln!(body, "<h2>{}</h2>", escape(&component.name));
        if let Some(picture) = picture {
            let _ = writeln!(
                body,
                "<p><img width=\"{0}\" height=\"{0}\" alt=\"zebra stripes\" src=\"{1}\"></p>\n<p>Stripes by the angle of the normal: they bend where curvature jumps, and break where the surface has a crease.</p>",
                PICTURE,
                link(picture)
            );
        }
        table(&mut body, component, &document.unit);
    }
    for Unfitted { name, reason } in &document.unfitted {
        let (name, reason) = (escape(name), escape(reason));
        let _ = writeln!(body, "<h2>{name}</h2>\n<p>No surface: {reason}</p>");
    }
    page(title, "", &body, &[], BESIDE)
}

fn table(body: &mut String, c: &Component, unit: &str) {
    let _ = writeln!(body, "<table>");
    let mut row = |name: &str, value: String| {
        let _ = writeln!(
            body,
            "<tr><th>{}</th><td>{}</td></tr>",
            escape(name),
            escape(&value)
        );
    };
    row("control points", c.control_points.to_string());
    row("cells", c.cells.to_string());
    row("irregular points", c.irregular_points.to_string());
    row("crease edges", c.crease_edges.to_string());
    row("corners", c.corners.to_string());
    row(
        &format!("diagonal ({unit})"),
        figure(c.diagonal_source_units),
    );
    row(
        "distance from the source, RMS of the diagonal",
        figure(c.from_source.rms_of_diagonal),
    );
    row(
        "distance from the source, largest, of the diagonal",
        figure(c.from_source.max_of_diagonal),
    );
    if let Some(both) = c.both_ways {
        row(
            "distance both ways, RMS of the diagonal",
            figure(both.rms_of_diagonal),
        );
        row(
            "distance both ways, largest, of the diagonal",
            figure(both.max_of_diagonal),
        );
    }
    let normals = c.normal_deviation;
    row("normals off, mean (degrees)", figure(normals.mean_degrees));
    row("normals off, 95 % (degrees)", figure(normals.p95_degrees));
    row("area turned over", figure(c.turned_over_area));
    row("least Jacobian over its mean", figure(c.least_jacobian));
    if c.inside_out {
        row("the mesh is inside out", "turned over".to_owned());
    }
    if let Some(solid) = &c.void_of {
        row("bounds a cavity of", solid.clone());
    }
    row("STEP: faces", c.step.faces.to_string());
    row("STEP: control points", c.step.control_points.to_string());
    for (name, jump) in [
        ("between regular cells", c.step.normal_jump_regular),
        ("beside irregular points", c.step.normal_jump_irregular),
        (
            "at corners and wide sides of creases",
            c.step.normal_jump_corners,
        ),
    ] {
        row(
            &format!("STEP: normals turn {name}, 95 % (degrees)"),
            figure(jump.p95_degrees),
        );
        row(
            &format!("STEP: normals turn {name}, most (degrees)"),
            figure(jump.max_degrees),
        );
    }
    row("G+Smo: patches", c.gismo.patches.to_string());
    row("G+Smo: control points", c.gismo.control_points.to_string());
    let _ = writeln!(body, "</table>");
}
