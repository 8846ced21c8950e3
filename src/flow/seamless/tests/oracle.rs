use super::*;
use std::fmt::Write;

#[test]
fn dump() {
    let mut shapes: Vec<Shape> = vec![shapes::torus(9, 7), shapes::plate(2, 2), shapes::plate(3, 2)];
    for name in ["fertility.off", "three-holes.off", "rocker-arm.obj"] {
        shapes.extend(shapes::corpus_model(name));
    }
    for shape in shapes {
        let p = prepare(&shape);
        let c = &p.c;
        let mut out = String::new();
        let nums = |it: &mut dyn Iterator<Item = String>| it.collect::<Vec<_>>().join(" ");
        writeln!(out, "{} {}", c.vertex_count(), c.edge_count()).unwrap();
        writeln!(out, "{}", nums(&mut c.halfedges().map(|h| c.twin(h).unwrap().to_string()))).unwrap();
        writeln!(out, "{}", nums(&mut c.halfedges().map(|h| c.tail(h).to_string()))).unwrap();
        writeln!(out, "{}", nums(&mut c.halfedges().map(|h| c.edge(h).to_string()))).unwrap();
        writeln!(out, "{}", nums(&mut c.edges().map(|e| c.edge_halfedge(e).to_string()))).unwrap();
        writeln!(out, "{}", nums(&mut p.length.iter().map(|l| format!("{l:e}")))).unwrap();
        writeln!(out, "{}", nums(&mut p.signature.cone.iter().map(|k| k.to_string()))).unwrap();
        writeln!(out, "{}", nums(&mut p.signature.turning.iter().map(|k| k.to_string()))).unwrap();
        let norm = Norm::uniform(c, 0.0);
        let found = newton::solve(&p.problem(), p.start(), &norm, Reuse::AtTheEnd, &SeamlessParams::default(), &()).unwrap();
        writeln!(out, "{}", nums(&mut found.penner.iter().map(|l| format!("{l:e}")))).unwrap();
        for l in 0..p.loops.len() {
            writeln!(out, "{}", nums(&mut p.loops.passages(l).map(|w| format!("{} {}", w.enter, w.leave)))).unwrap();
        }
        let name = shape.name.replace(' ', "-");
        println!("{name} ours {} steps", found.history.len() - 1);
        std::fs::write(format!("/tmp/w/seamless-scratch/dump-{name}.txt"), out).unwrap();
    }
}
