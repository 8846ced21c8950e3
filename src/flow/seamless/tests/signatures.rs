//! Signatures that exist, and signatures that do not.

use super::*;

fn with(prepared: &Prepared, cones: &[(usize, i64)], turning: &[i64]) -> Prepared {
    let mut cone = VertexVec::filled(FULL_TURN, prepared.c.vertex_count());
    for &(v, k) in cones {
        cone[VertexId::new(v)] = k;
    }
    Prepared {
        name: format!("{cones:?} {turning:?}"),
        c: prepared.c.clone(),
        length: prepared.length.clone(),
        loops: prepared.loops.clone(),
        signature: Signature {
            cone,
            turning: turning.to_vec(),
        },
    }
}

fn refusal(prepared: &Prepared) -> Infeasible {
    match prepared.solve(&SeamlessParams::default()) {
        Err(SeamlessError::Infeasible(reason)) => reason,
        other => panic!("{}: {:?}", prepared.name, other.map(|m| m.history)),
    }
}

#[test]
fn impossible_signatures_of_the_torus_are_refused() {
    let torus = prepare(&shapes::torus(9, 7));
    let error = refusal(&with(&torus, &[], &[0, 1]));
    assert_eq!(error, Infeasible::FlatTorus { of: 1, turning: 1 });
    for turning in [[0, 0], [1, 0], [2, 3]] {
        let error = refusal(&with(&torus, &[(3, 3), (40, 5)], &turning));
        let expected = Infeasible::TwoConesOnTorus {
            cone: [3, 5],
            multiple_of: 1,
        };
        assert_eq!(error, expected);
        assert!(error.to_string().contains("Izmestiev"), "{error}");
    }
    let error = refusal(&with(&torus, &[(3, 2), (40, 6)], &[2, 0]));
    assert!(matches!(
        error,
        Infeasible::TwoConesOnTorus { multiple_of: 2, .. }
    ));
    // Its counterpart exists.
    for possible in [
        with(&torus, &[], &[0, 0]),
        with(&torus, &[(3, 2), (40, 6)], &[1, 0]),
        with(&torus, &[(3, 3), (12, 3), (40, 6)], &[0, 0]),
    ] {
        let metric = possible.solve(&SeamlessParams::default());
        possible.assert_seamless(&metric.expect(&possible.name));
    }
}

#[test]
fn empty_strata_and_wrong_sums_are_refused() {
    let double = prepare(&shapes::plate(2, 2));
    let error = refusal(&with(&double, &[(3, 12)], &[0, 2, 0, 0]));
    assert_eq!(error, Infeasible::EmptyStratum { cones: vec![12] });
    let error = refusal(&with(&double, &[(3, 6), (9, 10)], &[0, 0, 0, 0]));
    assert!(
        error.to_string().contains("6 and 10 quarter turns"),
        "{error}"
    );
    let error = refusal(&with(&double, &[(3, 5)], &[0, 0, 0, 0]));
    let expected = Infeasible::GaussBonnet {
        prescribed: -1,
        required: -8,
    };
    assert_eq!(error, expected);
    let error = refusal(&with(&double, &[(3, 12), (4, 0), (5, 8)], &[0; 4]));
    assert!(matches!(error, Infeasible::BadCone { quarters: 0, .. }));
    let error = refusal(&with(&double, &[(3, 12)], &[0]));
    assert!(matches!(
        error,
        Infeasible::Count {
            given: 1,
            needed: 4,
            ..
        }
    ));
}

/// Newton finds no metric where the check is not asked, and says so.
#[test]
fn an_impossible_signature_stalls() {
    let torus = prepare(&shapes::torus(9, 7));
    let impossible = with(&torus, &[(3, 3), (40, 5)], &[1, 0]);
    let norm = Norm::by_area(&torus.c, &torus.length, 0.0);
    let (problem, params) = (impossible.problem(), SeamlessParams::default());
    let start = torus.start();
    let found = newton::solve(&problem, start, &norm, Reuse::WhereFast, &params, &());
    match found {
        Err(SeamlessError::Stalled { max_error, .. }) => assert!(max_error > 1e-3, "{max_error}"),
        Err(other) => panic!("{other}"),
        Ok(found) => panic!("found after {} steps", found.history.len() - 1),
    }
}

/// The field's signature with turnings changed and pairs of cones added at random.
#[test]
fn nearly_all_random_signatures_are_reached() {
    let mut random = shapes::sequence(73);
    let (mut reached, mut tried) = (0, 0);
    for genus in 1..=5 {
        let prepared = prepare(&shapes::plate(genus, 3));
        let vertices = prepared.c.vertex_count();
        let mut here = 0;
        while here < 40 {
            let mut changed = with(&prepared, &[], &prepared.signature.turning);
            changed.signature.cone = prepared.signature.cone.clone();
            let cone = &mut changed.signature.cone;
            let pairs = 1 + (here % 4);
            let mut pick = |good: &dyn Fn(i64) -> bool, cone: &VertexVec<i64>| loop {
                let v = VertexId::new((random() * vertices as f64) as usize);
                if good(cone[v]) {
                    return v;
                }
            };
            for _ in 0..pairs {
                let low = pick(&|k| k > 3, cone);
                cone[low] -= 1;
                let high = pick(&|k| k < 6, cone);
                cone[high] += 1;
            }
            for turning in &mut changed.signature.turning {
                *turning += (random() * 5.0) as i64 - 2;
            }
            if changed.signature.check(&changed.c, &changed.loops).is_err() {
                continue;
            }
            here += 1;
            tried += 1;
            match changed.solve(&SeamlessParams::default()) {
                Ok(metric) => {
                    reached += 1;
                    changed.assert_seamless(&metric);
                }
                Err(error) => println!("genus {genus}, {pairs} pairs: {error}"),
            }
        }
    }
    assert!(tried == 200 && reached >= 196, "{reached} of {tried}");
}
