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
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        Face {
            border: border.collect(),
            places: (0..4).map(|k| [corners[k], corners[(k + 1) % 4]]).collect(),
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
    let bodies = shells.iter().map(|&(name, shell)| Body {
        name,
        shell,
        voids: Vec::new(),
    });
    written(&bodies.collect::<Vec<_>>(), unit)
}

fn written(bodies: &[Body<'_>], unit: LengthUnit) -> io::Result<String> {
    let mut out = Vec::new();
    write(bodies, unit, &mut out)?;
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
        ("SURFACE_CURVE", 12),
        ("PCURVE", 24),
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
        let order = if curve.contains("('',1,") { 2.0 } else { 4.0 };
        assert_eq!(multiplicity, curve.matches('#').count() as f64 + order);
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
fn cavities_are_shells_of_their_solid() {
    let (outer, mut open) = (cube(), cube());
    let mut inner = cube();
    // Half as large about the middle, and inside out.
    let shrink = |p: &mut [f64; 3]| *p = p.map(|x| 0.25 + 0.5 * x);
    inner.vertices.iter_mut().for_each(shrink);
    let curves = inner.edges.iter_mut().flat_map(|e| &mut e.curve.control);
    curves.for_each(shrink);
    for face in &mut inner.faces {
        let [columns, _] = face.surface.size();
        face.surface.control.iter_mut().for_each(shrink);
        face.surface
            .control
            .chunks_mut(columns)
            .for_each(<[_]>::reverse);
        face.border.reverse();
        face.border
            .iter_mut()
            .for_each(|(_, forward)| *forward ^= true);
    }
    let body = |voids| Body {
        name: "hollow",
        shell: &outer,
        voids,
    };
    let text = written(&[body(vec![&inner])], LengthUnit::Millimetre).unwrap();
    for (kind, expected) in [
        ("BREP_WITH_VOIDS", 1),
        ("MANIFOLD_SOLID_BREP", 0),
        ("CLOSED_SHELL", 2),
        ("ORIENTED_CLOSED_SHELL", 1),
        ("ADVANCED_FACE", 12),
    ] {
        assert_eq!(count(&text, kind), expected, "{kind}");
    }
    open.is_closed = false;
    let error = written(&[body(vec![&open])], LengthUnit::Millimetre).unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
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
