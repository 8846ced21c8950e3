//! Spline shells as STEP AP242, in the text of ISO 10303-21.
//!
//! *Enters:* [`Shell`]s with names, and the unit of their coordinates. *Leaves:* the text of a file with one product. *Guaranteed:*
//! numbers are read back to the last bit; equal shells give equal bytes, since the file holds no time, path or user.
//!
//! Each shell is one item of the product and carries its name. A closed shell is a solid (`MANIFOLD_SOLID_BREP`), an open one a
//! surface model (`SHELL_BASED_SURFACE_MODEL`). Where all are of one kind, they stand in the representation for that kind, otherwise
//! in a plain `SHAPE_REPRESENTATION`. Faces, edges and vertices are shared within a shell, and each face is the whole of its
//! surface. There are no curves in parameter space: programs find them from the edges.

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
";
const SHAPE: Id = Id(9);
const FRAME: Id = Id(13);
const CONTEXT: Id = Id(17);
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

/// Writes the file.
///
/// # Errors
/// Those of the writer. [`io::ErrorKind::InvalidInput`] where a shell has no faces, a number is not finite, an index has no
/// target, or knots and control points do not fit; then nothing has been written.
pub fn write(
    shells: &[(String, &Shell)],
    unit: LengthUnit,
    out: &mut impl Write,
) -> io::Result<()> {
    for (name, shell) in shells {
        check(shell).map_err(|what| {
            io::Error::new(io::ErrorKind::InvalidInput, format!("{name}: {what}"))
        })?;
    }
    let product = match shells {
        [(name, _)] => quoted(name),
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
    for (name, shell) in shells {
        let (name, faces) = (quoted(name), list(data.faces(shell)?));
        items.push(if shell.is_closed {
            let shell = data.add(format_args!("CLOSED_SHELL('',{faces})"))?;
            data.add(format_args!("MANIFOLD_SOLID_BREP({name},{shell})"))?
        } else {
            // OpenCASCADE takes the name of an open one from here.
            let shell = data.add(format_args!("OPEN_SHELL({name},{faces})"))?;
            data.add(format_args!("SHELL_BASED_SURFACE_MODEL({name},({shell}))"))?
        });
    }
    let has = |closed| shells.iter().any(|(_, shell)| shell.is_closed == closed);
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
    for Face { surface, border } in &shell.faces {
        let BSplineSurface { knots, control } = surface;
        let is_proper = knots.iter().all(|knots| fits(knots))
            && surface.size().iter().product::<usize>() == control.len()
            && finite(control);
        let has_edges = border
            .iter()
            .all(|&(e, _)| (e as usize) < shell.edges.len());
        if !is_proper || border.is_empty() || !has_edges {
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
        let mut edges = Vec::with_capacity(shell.edges.len());
        for edge in &shell.edges {
            let curve = self.curve(&edge.curve)?;
            let [from, to] = edge.ends.map(|vertex| vertices[vertex as usize]);
            edges.push(self.add(format_args!("EDGE_CURVE('',{from},{to},{curve},.T.)"))?);
        }
        let mut faces = Vec::with_capacity(shell.faces.len());
        for face in &shell.faces {
            let surface = self.surface(&face.surface)?;
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
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// The unit cube. Vertex i has the bits of i as coordinates.
    fn cube() -> Shell {
        let corner = |i: u32| [i & 1, i >> 1 & 1, i >> 2 & 1].map(f64::from);
        let mut edges: Vec<Edge> = Vec::new();
        let quads = [0o0231, 0o4576, 0o0154, 0o2673, 0o0462, 0o1375];
        let faces = quads.map(|quad: u32| {
            let ring = [9, 6, 3, 0].map(|shift| quad >> shift & 7);
            let [a, b, _, d] = ring.map(corner);
            let at = |i: usize| {
                let (u, v) = ((i % 4) as f64 / 3.0, (i / 4) as f64 / 3.0);
                [0, 1, 2].map(|c| a[c] + u * (b[c] - a[c]) + v * (d[c] - a[c]))
            };
            let knots = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
            let surface = BSplineSurface {
                knots: [knots.to_vec(), knots.to_vec()],
                control: (0..16).map(at).collect(),
            };
            let border = (0..4).map(|side| {
                let ends = [ring[side], ring[(side + 1) % 4]];
                let known = edges.iter().position(|e| e.ends == [ends[1], ends[0]]);
                let edge = known.unwrap_or(edges.len());
                if known.is_none() {
                    let mut curve = surface.side(side);
                    if side > 1 {
                        curve.control.reverse();
                    }
                    edges.push(Edge { ends, curve });
                }
                (edge as u32, known.is_none())
            });
            Face {
                border: border.collect(),
                surface,
            }
        });
        Shell {
            vertices: (0..8).map(corner).collect(),
            edges,
            faces: faces.into(),
            is_closed: true,
        }
    }

    fn file(shells: &[(&str, &Shell)], unit: LengthUnit) -> io::Result<String> {
        let named: Vec<_> = shells.iter().map(|&(n, s)| (n.to_owned(), s)).collect();
        let mut out = Vec::new();
        write(&named, unit, &mut out)?;
        String::from_utf8(out).map_err(io::Error::other)
    }

    /// Entities by number, in one line each.
    fn entities(file: &str) -> BTreeMap<u64, String> {
        let data = file.split("DATA;\n").nth(1).unwrap();
        let data = data.split("ENDSEC;").next().unwrap();
        let mut all = BTreeMap::new();
        for entity in data.split_terminator(";\n") {
            let (number, entity) = entity.split_once('=').unwrap();
            let number = number.strip_prefix('#').unwrap().parse().unwrap();
            assert!(all.insert(number, entity.replace('\n', "")).is_none());
        }
        all
    }

    fn count(file: &str, kind: &str) -> usize {
        let start = format!("{kind}(");
        entities(file)
            .values()
            .filter(|e| e.starts_with(&start))
            .count()
    }

    /// The lists of numbers in an entity.
    fn lists(entity: &str) -> Vec<Vec<f64>> {
        let list = |l: &str| l.split(',').map(|x| x.parse().ok()).collect();
        entity.split(['(', ')']).filter_map(list).collect()
    }

    #[test]
    fn cube_is_whole() {
        let text = file(&[("cube", &cube())], LengthUnit::Millimetre).unwrap();
        let all = entities(&text);
        for entity in all.values() {
            for reference in entity.split('#').skip(1) {
                let digits = reference.split([',', ')']).next().unwrap();
                assert!(all.contains_key(&digits.parse().unwrap()), "{entity}");
            }
        }
        for (kind, expected) in [
            ("VERTEX_POINT", 8),
            ("EDGE_CURVE", 12),
            ("ORIENTED_EDGE", 24),
            ("ADVANCED_FACE", 6),
            ("CLOSED_SHELL", 1),
            ("MANIFOLD_SOLID_BREP", 1),
            ("ADVANCED_BREP_SHAPE_REPRESENTATION", 1),
            ("SHAPE_DEFINITION_REPRESENTATION", 1),
        ] {
            assert_eq!(count(&text, kind), expected, "{kind}");
        }
        let again = file(&[("cube", &cube())], LengthUnit::Millimetre).unwrap();
        assert_eq!(text, again);
    }

    #[test]
    fn multiplicities_fit_control_points() {
        let mut shell = cube();
        let curve = &mut shell.edges[0].curve;
        curve.knots = vec![0.0, 0.0, 0.0, 0.0, 0.25, 0.5, 0.5, 1.0, 1.0, 1.0, 1.0];
        curve.control = (0..7).map(|i| [f64::from(i), 1e-9, 1e300]).collect();
        let surface = &mut shell.faces[0].surface;
        surface.knots[1].insert(4, 0.5);
        surface.control.extend([[0.5; 3]; 4]);
        let text = file(&[("", &shell)], LengthUnit::Inch).unwrap();
        let all = entities(&text);
        let of = |kind| all.values().filter(move |e| e.starts_with(kind));
        for curve in of("B_SPLINE_CURVE") {
            let multiplicity: f64 = lists(curve)[0].iter().sum();
            assert_eq!(multiplicity, curve.matches('#').count() as f64 + 4.0);
        }
        let first = of("B_SPLINE_CURVE").next().unwrap();
        assert!(first.ends_with("(4,1,2,4),(0.,0.25,0.5,1.),.UNSPECIFIED.)"));
        // Four lists, one for each control point in u, of five.
        let first = of("B_SPLINE_SURFACE").next().unwrap();
        let points = first.split("),(").map(|list| list.matches('#').count());
        assert_eq!(points.collect::<Vec<_>>(), [5, 5, 5, 5, 0, 0, 0]);
        assert!(first.ends_with("(4,4),(4,1,4),(0.,1.),(0.,0.5,1.),.UNSPECIFIED.)"));
        for point in of("CARTESIAN_POINT") {
            let numbers = point.split(['(', ')']).nth(2).unwrap();
            assert!(numbers.split(',').all(|x| x.contains('.')), "{point}");
        }
    }

    #[test]
    fn numbers_are_read_back() {
        let texts = [1.0, -0.0, 1.5e-7, 1e300].map(real);
        assert_eq!(texts, ["1.", "0.", "1.5E-7", "1.E300"]);
        for x in [0.1, 1.0 / 3.0, -2.5e-308, f64::MAX, 1e16, 123_456.789] {
            assert_eq!(real(x).parse(), Ok(x));
        }
    }

    #[test]
    fn strings_are_escaped() {
        assert_eq!(quoted("it's a\\b"), "'it''s a\\\\b'");
        assert_eq!(quoted("Größe"), "'Gr\\X2\\00F6\\X0\\\\X2\\00DF\\X0\\e'");
        assert_eq!(quoted("é😀"), "'\\X2\\00E9\\X0\\\\X4\\0001F600\\X0\\'");
        assert_eq!(quoted("\n"), "'\\X2\\000A\\X0\\'");
    }

    #[test]
    fn kinds_may_be_mixed() {
        let (closed, mut open) = (cube(), cube());
        open.faces.pop();
        open.is_closed = false;
        let text = file(&[("open", &open)], LengthUnit::Inch).unwrap();
        assert_eq!(count(&text, "MANIFOLD_SURFACE_SHAPE_REPRESENTATION"), 1);
        assert!(text.contains("CONVERSION_BASED_UNIT('INCH'"));
        let text = file(&[("a", &open), ("b", &closed)], LengthUnit::Inch).unwrap();
        for kind in ["SHAPE_REPRESENTATION", "OPEN_SHELL", "CLOSED_SHELL"] {
            assert_eq!(count(&text, kind), 1, "{kind}");
        }
    }

    #[test]
    fn what_step_cannot_hold_is_refused() {
        let spoilt: [fn(&mut Shell); 5] = [
            |shell| shell.faces.clear(),
            |shell| shell.vertices[3][1] = f64::NAN,
            |shell| shell.edges[0].ends[1] = 8,
            |shell| shell.faces[5].border[0].0 = 12,
            |shell| shell.faces[2].surface.knots[1].truncate(2),
        ];
        for spoil in spoilt {
            let mut shell = cube();
            spoil(&mut shell);
            let error = file(&[("", &shell)], LengthUnit::Centimetre).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
        }
    }
}
