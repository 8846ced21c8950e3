//! The cones of a prescription in words, a line a group.

use crate::flow::cones::{Prescription, in_pi};
use crate::geometry::ids::NONE;
use crate::geometry::mesh::Mesh;
use std::f64::consts::PI;

/// At most so many vertices stand in one line.
const LISTED: usize = 12;
/// Longer curvatures are rounded.
const SHORT: usize = 7;

/// Components of a file that are listed whatever there is to say of them.
pub(super) const MOST_LISTED: usize = 16;

/// The line that stands for those that are not listed.
pub(super) fn left_out(components: usize) -> String {
    let more = counted(components, "more component", "more components");
    format!("{more}: nothing refused, and a grid wherever one is asked for")
}

/// A count with its noun.
pub(super) fn counted(count: usize, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

/// Vertices that get the same curvature, as far as it is shown.
struct Group {
    inside: bool,
    curvature: String,
    /// Their numbers in the file, [`NONE`] for one that it does not have.
    vertices: Vec<u32>,
}

/// One line for all cones of the same curvature, inside or on the boundary, and one for those inside that have a curvature each
/// of their own; in the order of the first vertex of each.
pub(super) fn cones(mesh: &Mesh, prescription: &Prescription) -> Vec<String> {
    if prescription.cones.is_empty() {
        return vec!["cones: none".to_owned()];
    }
    let groups = by_curvature(mesh, prescription);
    let is_single = |g: &&Group| g.inside && g.vertices.len() == 1;
    let singles: Vec<&Group> = groups.iter().filter(is_single).collect();
    // One or two read better in lines of their own.
    let joined = singles.len() > 2;
    let mut lines = Vec::new();
    let mut told = false;
    for group in &groups {
        if !(joined && is_single(&group)) {
            lines.push(of_one_curvature(group));
        } else if !told {
            told = true;
            lines.push(of_own_curvature(&singles));
        }
    }
    lines
}

fn by_curvature(mesh: &Mesh, prescription: &Prescription) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for cone in &prescription.cones {
        let vertex = mesh.source_vertex[cone.vertex];
        let inside = !mesh.connectivity.is_boundary_vertex(cone.vertex);
        let curvature = short(cone.curvature);
        let same = |g: &&mut Group| g.inside == inside && g.curvature == curvature;
        match groups.iter_mut().find(same) {
            Some(group) => group.vertices.push(vertex),
            None => groups.push(Group {
                inside,
                curvature,
                vertices: vec![vertex],
            }),
        }
    }
    groups
}

/// A curvature in multiples of π: as it is where that is short, else to three digits.
fn short(radians: f64) -> String {
    let exact = in_pi(radians);
    match exact.chars().count() <= SHORT {
        true => exact,
        false => format!("{:.3}π", radians / PI),
    }
}

/// `8 cones of 0.5π: at vertices 3, 7 and 9 of the file`.
fn of_one_curvature(group: &Group) -> String {
    let count = match group.inside {
        true => counted(group.vertices.len(), "cone", "cones"),
        false => counted(group.vertices.len(), "boundary vertex", "boundary vertices"),
    };
    let known = group.vertices.iter().filter(|&&v| v != NONE);
    let names: Vec<String> = known.map(u32::to_string).collect();
    let of_file = match names.len() {
        0 => None,
        1 => Some(format!("vertex {}", few(&names))),
        _ => Some(format!("vertices {}", few(&names))),
    };
    let added = match group.vertices.len() - names.len() {
        0 => None,
        1 => Some("a new vertex".to_owned()),
        several => Some(format!("{several} new vertices")),
    };
    let places: Vec<String> = of_file.into_iter().chain(added).collect();
    format!(
        "{count} of {}: at {}",
        group.curvature,
        places.join(" and ")
    )
}

/// `8 cones: 0.512π at vertex 17, -0.25π at 203 and 0.3π at 9 of the file`.
fn of_own_curvature(singles: &[&Group]) -> String {
    let is_added = |group: &&Group| group.vertices.first() == Some(&NONE);
    let (added, known): (Vec<&Group>, Vec<&Group>) = singles.iter().copied().partition(is_added);
    let names: Vec<String> = (known.iter().enumerate())
        .flat_map(|(i, group)| group.vertices.iter().map(move |v| (i, group, v)))
        .map(|(i, group, vertex)| match i {
            0 => format!("{} at vertex {vertex}", group.curvature),
            _ => format!("{} at {vertex}", group.curvature),
        })
        .collect();
    let of_file = (!names.is_empty()).then(|| few(&names));
    let curvatures: Vec<&str> = (added.iter().take(LISTED))
        .map(|group| group.curvature.as_str())
        .collect();
    let more = match added.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!(" …, {more} more"),
    };
    let added = (!curvatures.is_empty())
        .then(|| format!("{}{more} at new vertices", curvatures.join(", ")));
    let places: Vec<String> = of_file.into_iter().chain(added).collect();
    format!("{} cones: {}", singles.len(), places.join("; "))
}

/// The first names, and how many more there are.
fn few(names: &[String]) -> String {
    match names {
        [only] => format!("{only} of the file"),
        many if many.len() > LISTED => format!(
            "{} … of the file, {} more",
            many[..LISTED].join(", "),
            many.len() - LISTED
        ),
        [first @ .., last] => format!("{} and {last} of the file", first.join(", ")),
        [] => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::prescription::BoundaryCondition;
    use crate::geometry::ids::{VertexId, VertexVec};
    use crate::geometry::mesh::Soup;
    use crate::repair::{RepairParams, repair};

    /// A flat square of 5 × 5 vertices in rows.
    fn square() -> Mesh {
        let positions = (0..25).map(|v| [f64::from(v % 5), f64::from(v / 5), 0.0]);
        let cells = (0..16).map(|c| 5 * (c / 4) + c % 4);
        let faces = cells.flat_map(|a| [[a, a + 1, a + 6], [a, a + 6, a + 5]]);
        let soup = Soup::from_triangles(positions.collect(), faces.collect());
        let repaired = repair(&soup, &RepairParams::default()).unwrap();
        repaired.components[0].mesh.clone().unwrap()
    }

    fn lines(given: &[(usize, f64)]) -> Vec<String> {
        let mut target = VertexVec::filled(0.0, 25);
        for &(v, multiple) in given {
            target[VertexId::new(v)] = multiple * PI;
        }
        let prescription = Prescription::new(target, BoundaryCondition::Uniform);
        cones(&square(), &prescription)
    }

    #[test]
    fn vertices_that_the_file_does_not_have_have_no_number() {
        let mut mesh = square();
        for v in [7, 8, 13] {
            mesh.source_vertex[VertexId::new(v)] = NONE;
        }
        let lines = |given: &[(usize, f64)]| {
            let mut target = VertexVec::filled(0.0, 25);
            for &(v, multiple) in given {
                target[VertexId::new(v)] = multiple * PI;
            }
            cones(
                &mesh,
                &Prescription::new(target, BoundaryCondition::Uniform),
            )
        };
        assert_eq!(
            lines(&[(6, 0.5), (7, 0.5), (8, 0.5), (12, 0.25), (13, -0.25)]),
            [
                "3 cones of 0.5π: at vertex 6 of the file and 2 new vertices",
                "1 cone of 0.25π: at vertex 12 of the file",
                "1 cone of -0.25π: at a new vertex"
            ]
        );
        assert_eq!(
            lines(&[(6, 0.5), (7, 0.4), (8, 0.3)]),
            ["3 cones: 0.5π at vertex 6 of the file; 0.4π, 0.3π at new vertices"]
        );
    }

    #[test]
    fn equal_curvatures_share_a_line_and_others_another() {
        assert_eq!(lines(&[]), ["cones: none"]);
        assert_eq!(
            lines(&[(6, 0.5), (7, 0.5), (8, 0.5)]),
            ["3 cones of 0.5π: at vertices 6, 7 and 8 of the file"]
        );
        assert_eq!(
            lines(&[
                (6, 0.512345),
                (7, 1.0),
                (8, 1.0 / 3.0),
                (11, -0.25),
                (12, 1.0)
            ]),
            [
                "3 cones: 0.512π at vertex 6, 1/3π at 8 and -0.25π at 11 of the file",
                "2 cones of 1π: at vertices 7 and 12 of the file"
            ]
        );
        assert_eq!(
            lines(&[(6, 1.23456789), (16, 0.7)]),
            [
                "1 cone of 1.235π: at vertex 6 of the file",
                "1 cone of 0.7π: at vertex 16 of the file"
            ]
        );
    }

    #[test]
    fn boundary_vertices_are_called_so_and_many_are_cut_short() {
        let inside = [6, 7, 8, 11, 12, 13, 16, 17, 18];
        let border: Vec<(usize, f64)> = (0..25)
            .filter(|v| !inside.contains(v))
            .map(|v| (v, 0.125))
            .collect();
        assert_eq!(
            lines(&border),
            [
                "16 boundary vertices of 0.125π: at vertices 0, 1, 2, 3, 4, 5, 9, 10, 14, 15, 19, 20 … of the file, 4 more"
            ]
        );
        // One of the border keeps its line, however many others there are.
        assert_eq!(
            lines(&[(0, 0.3), (6, 0.0123456), (7, -0.1), (8, 0.2)]),
            [
                "1 boundary vertex of 0.3π: at vertex 0 of the file",
                "3 cones: 0.012π at vertex 6, -0.1π at 7 and 0.2π at 8 of the file"
            ]
        );
    }
}
