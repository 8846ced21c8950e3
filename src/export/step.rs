//! Spline shells as STEP AP242, in the text of ISO 10303-21.
//!
//! *Enters:* [`Body`]s, and the unit of their coordinates. *Leaves:* the text of a file with one product. *Guaranteed:*
//! numbers are read back to the last bit; equal shells give equal bytes, since the file holds no time, path or user.
//!
//! Each body is one item of the product and carries its name. A closed shell is a solid (`MANIFOLD_SOLID_BREP`, with cavities `BREP_WITH_VOIDS`), an open one a
//! surface model (`SHELL_BASED_SURFACE_MODEL`). Where all are of one kind, they stand in the representation for that kind, otherwise
//! in a plain `SHAPE_REPRESENTATION`. Faces, edges and vertices are shared within a shell, and each face is the whole of its
//! surface. Edges carry their straight lines in the parameters of the surfaces beside them: programs that look for them by projection go wrong where a
//! surface bends back sharply.

use crate::spline::shell::{Edge, Face, Shell};
use crate::spline::surface::{BSplineCurve, BSplineSurface, DEGREE, ORDER};
use std::fmt::{self, Arguments, Display};
use std::io::{self, Write};

/// Coordinates are listed in lines of about this many characters.
const LINE: usize = 72;
const HEADER: &str = "ISO-10303-21;
HEADER;
FILE_DESCRIPTION(('B-spline shells'),'2;1');
FILE_NAME('','1980-01-01T00:00:00',(''),(''),'affine-atlas','affine-atlas','');
FILE_SCHEMA(('AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 1 1 4 }'));
ENDSEC;
DATA;
";
/// The entities before those of shells, without the product (5) and the unit of length (20 to 23).
const START: &str = "#1=APPLICATION_CONTEXT('managed model based 3d engineering');
#2=APPLICATION_PROTOCOL_DEFINITION('international standard',
'ap242_managed_model_based_3d_engineering',2014,#1);
#3=PRODUCT_CONTEXT('',#1,'mechanical');
#4=PRODUCT_DEFINITION_CONTEXT('part definition',#1,'design');
#6=PRODUCT_RELATED_PRODUCT_CATEGORY('part','',(#5));
#7=PRODUCT_DEFINITION_FORMATION('','',#5);
#8=PRODUCT_DEFINITION('design','',#7,#4);
#9=PRODUCT_DEFINITION_SHAPE('','',#8);
#10=CARTESIAN_POINT('',(0.,0.,0.));
#11=DIRECTION('',(0.,0.,1.));
#12=DIRECTION('',(1.,0.,0.));
#13=AXIS2_PLACEMENT_3D('',#10,#11,#12);
#14=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#15=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());
#16=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-6),#20,'distance_accuracy_value','');
#17=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#16))
GLOBAL_UNIT_ASSIGNED_CONTEXT((#20,#14,#15))REPRESENTATION_CONTEXT('',''));
#18=(GEOMETRIC_REPRESENTATION_CONTEXT(2)PARAMETRIC_REPRESENTATION_CONTEXT()REPRESENTATION_CONTEXT('',''));
";
const SHAPE: Id = Id(9);
const FRAME: Id = Id(13);
const CONTEXT: Id = Id(17);
const PLANE: Id = Id(18);
const RESERVED: u64 = 23;

/// The unit of coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LengthUnit {
    /// 0.001 m.
    Millimetre,
    /// 0.01 m.
    Centimetre,
    /// The SI unit.
    Metre,
    /// 25.4 mm.
    Inch,
}

impl LengthUnit {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Millimetre, Self::Centimetre, Self::Metre, Self::Inch];

    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Millimetre => "millimetre",
            Self::Centimetre => "centimetre",
            Self::Metre => "metre",
            Self::Inch => "inch",
        }
    }

    /// As it stands behind numbers.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Centimetre => "cm",
            Self::Metre => "m",
            Self::Inch => "in",
        }
    }

    /// Its length.
    pub fn metres(self) -> f64 {
        match self {
            Self::Millimetre => 0.001,
            Self::Centimetre => 0.01,
            Self::Metre => 1.0,
            Self::Inch => 0.0254,
        }
    }

    /// Its entities.
    fn text(self) -> &'static str {
        match self {
            Self::Millimetre => "#20=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));",
            Self::Centimetre => "#20=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.CENTI.,.METRE.));",
            Self::Metre => "#20=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.));",
            Self::Inch => {
                "#20=(CONVERSION_BASED_UNIT('INCH',#21)LENGTH_UNIT()NAMED_UNIT(#22));
#21=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#23);
#22=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);
#23=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));"
            }
        }
    }
}

/// A shell, with those of cavities where it bounds a solid.
#[derive(Clone, Debug)]
pub struct Body<'a> {
    /// Name.
    pub name: &'a str,
    /// The only shell, or the outer one.
    pub shell: &'a Shell,
    /// Closed shells inside it, whose normals point into the cavity.
    pub voids: Vec<&'a Shell>,
}

/// Writes the file.
///
/// # Errors
/// Those of the writer. [`io::ErrorKind::InvalidInput`] where a shell has no faces, a number is not finite, an index has no
/// target, or knots and control points do not fit; then nothing has been written.
pub fn write(bodies: &[Body<'_>], unit: LengthUnit, out: &mut impl Write) -> io::Result<()> {
    for Body { name, shell, voids } in bodies {
        let mut shells = std::iter::once(shell).chain(voids);
        let are_proper = shells.try_for_each(|shell| check(shell));
        let is_solid = shell.is_closed && voids.iter().all(|void| void.is_closed);
        let checked = match voids.is_empty() || is_solid {
            true => are_proper,
            false => Err("a cavity of or with a shell that is not closed"),
        };
        checked.map_err(|what| {
            io::Error::new(io::ErrorKind::InvalidInput, format!("{name}: {what}"))
        })?;
    }
    let product = match bodies {
        [Body { name, .. }] => quoted(name),
        _ => quoted("components"),
    };
    write!(out, "{HEADER}{START}")?;
    writeln!(out, "#5=PRODUCT({product},{product},'',(#3));")?;
    writeln!(out, "{}", unit.text())?;
    let mut data = Data {
        out,
        last: RESERVED,
    };
    let mut items = vec![FRAME];
    for Body { name, shell, voids } in bodies {
        let (name, faces) = (quoted(name), list(data.faces(shell)?));
        items.push(if shell.is_closed {
            let shell = data.add(format_args!("CLOSED_SHELL('',{faces})"))?;
            let mut inner = Vec::with_capacity(voids.len());
            for void in voids {
                let faces = list(data.faces(void)?);
                let void = data.add(format_args!("CLOSED_SHELL('',{faces})"))?;
                inner.push(data.add(format_args!("ORIENTED_CLOSED_SHELL('',*,{void},.T.)"))?);
            }
            match inner.is_empty() {
                true => data.add(format_args!("MANIFOLD_SOLID_BREP({name},{shell})"))?,
                false => {
                    let inner = list(inner);
                    data.add(format_args!("BREP_WITH_VOIDS({name},{shell},{inner})"))?
                }
            }
        } else {
            // OpenCASCADE takes the name of an open one from here.
            let shell = data.add(format_args!("OPEN_SHELL({name},{faces})"))?;
            data.add(format_args!("SHELL_BASED_SURFACE_MODEL({name},({shell}))"))?
        });
    }
    let has = |closed| bodies.iter().any(|body| body.shell.is_closed == closed);
    let kind = match (has(true), has(false)) {
        (true, false) => "ADVANCED_BREP_",
        (false, true) => "MANIFOLD_SURFACE_",
        _ => "",
    };
    let shape = data.add(format_args!(
        "{kind}SHAPE_REPRESENTATION({product},{},{CONTEXT})",
        list(items)
    ))?;
    data.add(format_args!(
        "SHAPE_DEFINITION_REPRESENTATION({SHAPE},{shape})"
    ))?;
    out.write_all(b"ENDSEC;\nEND-ISO-10303-21;\n")
}

/// What is wrong with a shell.
fn check(shell: &Shell) -> Result<(), &'static str> {
    let fits = |knots: &[f64]| {
        knots.len() >= 2 * ORDER && knots.is_sorted() && knots.iter().all(|k| k.is_finite())
    };
    let finite = |points: &[[f64; 3]]| points.iter().flatten().all(|x| x.is_finite());
    if shell.faces.is_empty() {
        return Err("a shell without faces");
    }
    if !finite(&shell.vertices) {
        return Err("a vertex that is not finite");
    }
    for Edge { ends, curve } in &shell.edges {
        let BSplineCurve { knots, control } = curve;
        let has_ends = ends.iter().all(|&v| (v as usize) < shell.vertices.len());
        if !fits(knots) || knots.len() != control.len() + ORDER || !finite(control) || !has_ends {
            return Err("an edge without a proper curve or its ends");
        }
    }
    for face in &shell.faces {
        let (
            Face {
                surface, places, ..
            },
            border,
        ) = (face, &face.border);
        let BSplineSurface { knots, control } = surface;
        let is_proper = knots.iter().all(|knots| fits(knots))
            && surface.size().iter().product::<usize>() == control.len()
            && finite(control);
        let has_edges = border
            .iter()
            .all(|&(e, _)| (e as usize) < shell.edges.len());
        let have_places = places.len() == border.len()
            && places
                .as_flattened()
                .as_flattened()
                .iter()
                .all(|x| x.is_finite());
        if !is_proper || border.is_empty() || !has_edges || !have_places {
            return Err("a face without a proper surface or its edges");
        }
    }
    Ok(())
}

/// The number of an entity.
#[derive(Clone, Copy)]
struct Id(u64);

impl Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// An edge in the parameters of a surface beside it.
#[derive(Clone, Copy)]
struct Line {
    /// Whether the face there is walked around against the edge.
    is_backward: bool,
    surface: Id,
    /// From the first end of the edge to its second.
    ends: [[f64; 2]; 2],
}

/// The entities of the data section, as they are written.
struct Data<'a, W> {
    out: &'a mut W,
    last: u64,
}

impl<W: Write> Data<'_, W> {
    fn add(&mut self, entity: Arguments<'_>) -> io::Result<Id> {
        self.last += 1;
        let id = Id(self.last);
        writeln!(self.out, "{id}={entity};")?;
        Ok(id)
    }

    fn faces(&mut self, shell: &Shell) -> io::Result<Vec<Id>> {
        let mut vertices = Vec::with_capacity(shell.vertices.len());
        for vertex in &shell.vertices {
            let point = self.point(vertex)?;
            vertices.push(self.add(format_args!("VERTEX_POINT('',{point})"))?);
        }
        let surfaces = shell.faces.iter().map(|face| self.surface(&face.surface));
        let surfaces: Vec<Id> = surfaces.collect::<io::Result<_>>()?;
        // Of every edge the surfaces beside it and its lines there, from its first end to its second; first the one that is walked so.
        let mut lines: Vec<Vec<Line>> = vec![Vec::new(); shell.edges.len()];
        for (face, &surface) in shell.faces.iter().zip(&surfaces) {
            for (&(edge, is_forward), &[from, to]) in face.border.iter().zip(&face.places) {
                lines[edge as usize].push(Line {
                    is_backward: !is_forward,
                    surface,
                    ends: if is_forward { [from, to] } else { [to, from] },
                });
            }
        }
        let mut edges = Vec::with_capacity(shell.edges.len());
        for (edge, mut lines) in shell.edges.iter().zip(lines) {
            let curve = self.curve(&edge.curve)?;
            lines.sort_by_key(|line| line.is_backward);
            let knots = &edge.curve.knots;
            let ends = [knots[0], knots[knots.len() - 1]];
            let is_seam = matches!(&lines[..], [a, b] if a.surface.0 == b.surface.0);
            let mut beside = Vec::with_capacity(lines.len());
            for line in lines {
                beside.push(self.line(line, ends)?);
            }
            let kind = if is_seam { "SEAM" } else { "SURFACE" };
            let beside = list(beside);
            let curve = self.add(format_args!("{kind}_CURVE('',{curve},{beside},.CURVE_3D.)"))?;
            let [from, to] = edge.ends.map(|vertex| vertices[vertex as usize]);
            edges.push(self.add(format_args!("EDGE_CURVE('',{from},{to},{curve},.T.)"))?);
        }
        let mut faces = Vec::with_capacity(shell.faces.len());
        for (face, surface) in shell.faces.iter().zip(surfaces) {
            let mut border = Vec::with_capacity(face.border.len());
            for &(edge, is_forward) in &face.border {
                let (edge, sense) = (edges[edge as usize], logical(is_forward));
                border.push(self.add(format_args!("ORIENTED_EDGE('',*,*,{edge},{sense})"))?);
            }
            let border = self.add(format_args!("EDGE_LOOP('',{})", list(border)))?;
            let border = self.add(format_args!("FACE_OUTER_BOUND('',{border},.T.)"))?;
            faces.push(self.add(format_args!("ADVANCED_FACE('',({border}),{surface},.T.)"))?);
        }
        Ok(faces)
    }

    /// A line on a surface; its own parameter goes from the one number to the other.
    fn line(&mut self, line: Line, ends: [f64; 2]) -> io::Result<Id> {
        let mut points = Vec::with_capacity(2);
        for [u, v] in line.ends.map(|p| p.map(real)) {
            points.push(self.add(format_args!("CARTESIAN_POINT('',({u},{v}))"))?);
        }
        let (points, ends) = (list(points), list(ends.map(real)));
        let curve = self.add(format_args!(
            "B_SPLINE_CURVE_WITH_KNOTS('',1,{points},.UNSPECIFIED.,.F.,.F.,(2,2),{ends},.UNSPECIFIED.)"
        ))?;
        let repr = self.add(format_args!(
            "DEFINITIONAL_REPRESENTATION('',({curve}),{PLANE})"
        ))?;
        self.add(format_args!("PCURVE('',{},{repr})", line.surface))
    }

    fn curve(&mut self, BSplineCurve { knots, control }: &BSplineCurve) -> io::Result<Id> {
        let points = list(self.points(control)?);
        let is_closed = logical(control.first() == control.last());
        let [multiplicities, knots] = runs(knots);
        self.add(format_args!(
            "B_SPLINE_CURVE_WITH_KNOTS('',{DEGREE},{points},\n\
             .UNSPECIFIED.,{is_closed},.F.,{multiplicities},{knots},.UNSPECIFIED.)"
        ))
    }

    fn surface(&mut self, surface: &BSplineSurface) -> io::Result<Id> {
        let points = self.points(&surface.control)?;
        // STEP lists v fastest.
        let [columns, _] = surface.size();
        let lists: Vec<String> = (0..columns)
            .map(|column| list(points.iter().skip(column).step_by(columns)))
            .collect();
        let points = lists.join(",\n");
        let [v_closed, u_closed] = [0, 1]
            .map(|side| logical(surface.side(side).control == surface.side(side ^ 2).control));
        let [[u_times, u_knots], [v_times, v_knots]] =
            surface.knots.each_ref().map(|knots| runs(knots));
        self.add(format_args!(
            "B_SPLINE_SURFACE_WITH_KNOTS('',{DEGREE},{DEGREE},(\n{points}),\n\
             .UNSPECIFIED.,{u_closed},{v_closed},.F.,\n\
             {u_times},{v_times},\n{u_knots},{v_knots},.UNSPECIFIED.)"
        ))
    }

    fn points(&mut self, points: &[[f64; 3]]) -> io::Result<Vec<Id>> {
        points.iter().map(|point| self.point(point)).collect()
    }

    fn point(&mut self, point: &[f64; 3]) -> io::Result<Id> {
        let [x, y, z] = point.map(real);
        self.add(format_args!("CARTESIAN_POINT('',({x},{y},{z}))"))
    }
}

fn logical(value: bool) -> &'static str {
    if value { ".T." } else { ".F." }
}

/// How often each knot occurs, and the knots.
fn runs(knots: &[f64]) -> [String; 2] {
    let runs: Vec<&[f64]> = knots.chunk_by(|a, b| a == b).collect();
    [
        list(runs.iter().map(|run| run.len())),
        list(runs.iter().map(|run| real(run[0]))),
    ]
}

fn list(items: impl IntoIterator<Item = impl Display>) -> String {
    let (mut all, mut line) = (String::from("("), 0);
    for (i, item) in items.into_iter().enumerate() {
        let item = item.to_string();
        if i > 0 {
            all.push(',');
        }
        if line + item.len() > LINE {
            all.push('\n');
            line = 0;
        }
        line += item.len() + 1;
        all += &item;
    }
    all + ")"
}

/// A number with the decimal point that STEP requires and the digits that give it back. Zero has no sign.
fn real(x: f64) -> String {
    let digits = format!("{:?}", x + 0.0);
    match digits.split_once('e') {
        Some((digits, exponent)) if digits.contains('.') => format!("{digits}E{exponent}"),
        Some((digits, exponent)) => format!("{digits}.E{exponent}"),
        None => match digits.strip_suffix(".0") {
            Some(whole) => format!("{whole}."),
            None => digits,
        },
    }
}

/// A string. What is not printable ASCII is written as hexadecimal numbers, of two bytes or of four.
fn quoted(plain: &str) -> String {
    let mut all = String::from("'");
    for c in plain.chars() {
        match c {
            '\'' | '\\' => all.extend([c, c]),
            ' '..='~' => all.push(c),
            '\0'..='\u{ffff}' => all += &format!("\\X2\\{:04X}\\X0\\", u32::from(c)),
            _ => all += &format!("\\X4\\{:08X}\\X0\\", u32::from(c)),
        }
    }
    all + "'"
}

#[cfg(test)]
mod tests;
