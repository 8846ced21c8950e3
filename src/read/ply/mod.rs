//! PLY, text and binary of both byte orders.
//!
//! Kept: positions, normals (`nx ny nz`), texture coordinates (`s t`, `u v`, `texture_u texture_v`),
//! colours (`red green blue`, optionally `alpha`), every other scalar of a vertex under its own name, and
//! texture coordinates a face corner (`texcoord`). Faces are lists `vertex_indices` or `vertex_index`,
//! and triangle strips (`tristrips`, −1 begins a new strip; triangles that
//! repeat a vertex only join strips and are dropped). Other elements and properties are skipped and noted.

mod body;
mod header;

use super::build::SoupBuilder;
use super::error::{Place, ReadProblem, shorten};
use super::polygon::triangulate;
use crate::geometry::ids::NONE;
use crate::geometry::mesh::AttributeKind;
use body::Body;
use header::{Element, read_header};

/// Reads a PLY file.
pub(super) fn read_ply(bytes: &[u8], build: &mut SoupBuilder) -> Result<(), ReadProblem> {
    let header = read_header(bytes)?;
    let mut body = Body {
        bytes,
        at: header.end,
        line: header.line,
        encoding: header.encoding,
    };
    let elements = header.elements;
    let vertices = elements.iter().find(|e| e.name == "vertex");
    let vertices = vertices.map_or(0, |e| e.count);
    build.expect_vertices(vertices)?;
    build.part(String::new());
    let mut attributes = Vec::new();
    let mut wedges = Vec::new();
    for element in &elements {
        body.expect_rows(element)?;
        match element.name.as_str() {
            "vertex" => attributes = read_vertices(element, &mut body, build)?,
            "face" => wedges = read_faces(element, vertices, &mut body, build)?,
            "tristrips" => read_strips(element, vertices, &mut body, build)?,
            _ => skip(element, &mut body, build)?,
        }
    }
    if !wedges.is_empty() {
        build.attribute_values(AttributeKind::TexCoord(0), 2, wedges);
        attributes.retain(|a| a.kind != AttributeKind::TexCoord(0));
    }
    for VertexAttribute {
        kind,
        columns,
        values,
    } in attributes
    {
        build.vertex_attribute(kind, columns.len(), &values)?;
    }
    Ok(())
}

fn skip(element: &Element, body: &mut Body, build: &mut SoupBuilder) -> Result<(), ReadProblem> {
    if element.count == 0 || element.properties.is_empty() {
        // Rows without properties take no place, and there may be 2⁶⁴ of them.
        return Ok(());
    }
    let name = shorten(element.name.as_bytes());
    build.note(format!("the elements `{name}` are skipped"));
    let mut values = Vec::new();
    for _ in 0..element.count {
        for property in &element.properties {
            body.property(property, &mut values)?;
        }
    }
    Ok(())
}

/// A property that becomes one component: value ÷ `one`, or 1 − that.
struct Column {
    /// `None` stands for the number 1.
    property: Option<usize>,
    one: f64,
    downwards: bool,
}

struct VertexAttribute {
    kind: AttributeKind,
    columns: Vec<Column>,
    values: Vec<f32>,
}

/// Which properties of a vertex become attributes.
fn vertex_attributes(element: &Element, position: [usize; 3]) -> Vec<VertexAttribute> {
    let mut used = position.to_vec();
    let mut attributes = Vec::new();
    let mut add = |kind: AttributeKind, columns: Vec<Column>| {
        used.extend(columns.iter().filter_map(|c| c.property));
        attributes.push(VertexAttribute {
            kind,
            columns,
            values: Vec::new(),
        });
    };
    let column = |property: usize| Column {
        property: Some(property),
        one: 1.0,
        downwards: false,
    };
    let all = |names: &[&str]| -> Option<Vec<usize>> {
        names.iter().map(|&n| element.scalar(&[n])).collect()
    };
    if let Some(normal) = all(&["nx", "ny", "nz"]) {
        let columns = normal.into_iter().map(column).collect();
        add(AttributeKind::Normal, columns);
    }
    let pairs = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];
    if let Some(pair) = pairs.iter().find_map(|names| all(names)) {
        let mut columns: Vec<_> = pair.into_iter().map(column).collect();
        // glTF counts v downwards.
        columns[1].downwards = true;
        add(AttributeKind::TexCoord(0), columns);
    }
    if let Some(color) = all(&["red", "green", "blue"]) {
        let alpha = element.scalar(&["alpha"]);
        let channel = |property: Option<usize>| Column {
            property,
            one: property.map_or(1.0, |p| element.properties[p].scalar.one()),
            downwards: false,
        };
        let columns = color.into_iter().map(Some).chain([alpha]).map(channel);
        add(AttributeKind::Color(0), columns.collect());
    }
    for (i, property) in element.properties.iter().enumerate() {
        if property.length.is_none() && !used.contains(&i) {
            let kind = AttributeKind::Custom(property.name.clone());
            attributes.push(VertexAttribute {
                kind,
                columns: vec![column(i)],
                values: Vec::new(),
            });
        }
    }
    attributes
}

fn read_vertices(
    element: &Element,
    body: &mut Body,
    build: &mut SoupBuilder,
) -> Result<Vec<VertexAttribute>, ReadProblem> {
    let mut position = [0; 3];
    for (at, property) in position.iter_mut().zip(["x", "y", "z"]) {
        *at = element
            .scalar(&[property])
            .ok_or(ReadProblem::MissingProperty {
                element: "vertex",
                property,
            })?;
    }
    let mut attributes = vertex_attributes(element, position);
    let mut row = vec![0.0; element.properties.len()];
    let mut values = Vec::new();
    for _ in 0..element.count {
        let place = body.place();
        for (property, cell) in element.properties.iter().zip(&mut row) {
            body.property(property, &mut values)?;
            *cell = values.first().copied().unwrap_or(0.0);
        }
        build.vertex(position.map(|p| row[p]), place)?;
        for attribute in &mut attributes {
            for column in &attribute.columns {
                let value = column.property.map_or(1.0, |p| row[p]) / column.one;
                let value = if column.downwards { 1.0 - value } else { value };
                attribute.values.push(value as f32);
            }
        }
    }
    Ok(attributes)
}

/// A vertex index, checked.
fn vertex_index(value: f64, vertices: u64, face: usize, place: Place) -> Result<u32, ReadProblem> {
    if value >= 0.0 && value < vertices as f64 && value.fract() == 0.0 {
        return Ok(value as u32);
    }
    Err(ReadProblem::IndexOutOfRange {
        face,
        place,
        what: "vertex",
        index: value as i64,
        count: vertices as usize,
        first: 0,
    })
}

/// Appends all faces; returns texture coordinates a corner, empty where there are none.
fn read_faces(
    element: &Element,
    vertices: u64,
    body: &mut Body,
    build: &mut SoupBuilder,
) -> Result<Vec<f32>, ReadProblem> {
    build.expect_faces(element.count)?;
    let indices_at = element.list(&["vertex_indices", "vertex_index"]);
    let indices_at = indices_at.ok_or(ReadProblem::MissingProperty {
        element: "face",
        property: "vertex_indices",
    })?;
    let texture_at = element.list(&["texcoord"]);
    for (i, property) in element.properties.iter().enumerate() {
        if i != indices_at && Some(i) != texture_at {
            let name = shorten(property.name.as_bytes());
            build.note(format!("the property `{name}` of faces is skipped"));
        }
    }
    let (mut indices, mut texture, mut other) = (Vec::new(), Vec::new(), Vec::new());
    let mut wedges = Vec::new();
    for _ in 0..element.count {
        let place = body.place();
        for (i, property) in element.properties.iter().enumerate() {
            let values = match i {
                _ if i == indices_at => &mut indices,
                _ if Some(i) == texture_at => &mut texture,
                _ => &mut other,
            };
            body.property(property, values)?;
        }
        let face = build.soup.faces.len();
        if indices.len() < 3 {
            build.short_polygon(place);
            continue;
        }
        let index = |k: usize| vertex_index(indices[k], vertices, face, place);
        let wedge = |k: usize| [texture[2 * k] as f32, (1.0 - texture[2 * k + 1]) as f32];
        let polygon = (0..indices.len())
            .map(index)
            .collect::<Result<Vec<u32>, _>>()?;
        let positions = &build.soup.positions;
        let triangles = triangulate(polygon.len(), |k| {
            positions.get(polygon[k] as usize).copied()
        });
        for triangle in triangles {
            build.face(triangle.map(|k| polygon[k]), NONE)?;
            if texture.len() == 2 * indices.len() {
                wedges.resize(6 * (build.soup.faces.len() - 1), f32::NAN);
                wedges.extend(triangle.into_iter().flat_map(wedge));
            }
        }
    }
    Ok(wedges)
}

fn read_strips(
    element: &Element,
    vertices: u64,
    body: &mut Body,
    build: &mut SoupBuilder,
) -> Result<(), ReadProblem> {
    let at = element.list(&["vertex_indices", "vertex_index"]);
    let at = at.ok_or(ReadProblem::MissingProperty {
        element: "tristrips",
        property: "vertex_indices",
    })?;
    let mut values = Vec::new();
    for _ in 0..element.count {
        let mut strip = Vec::new();
        let place = body.place();
        for (i, property) in element.properties.iter().enumerate() {
            body.property(property, &mut values)?;
            if i == at {
                strip.clone_from(&values);
            }
        }
        for run in strip.split(|&i| i == -1.0) {
            for (k, corners) in run.windows(3).enumerate() {
                let face = build.soup.faces.len();
                let mut triangle = [0; 3];
                for (corner, &value) in triangle.iter_mut().zip(corners) {
                    *corner = vertex_index(value, vertices, face, place)?;
                }
                let [a, b, c] = triangle;
                if a == b || b == c || c == a {
                    continue;
                }
                build.face(if k % 2 == 0 { [a, b, c] } else { [b, a, c] }, NONE)?;
            }
        }
    }
    Ok(())
}
