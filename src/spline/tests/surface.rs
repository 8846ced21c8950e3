//! Curves, basis functions and polar forms.

use super::super::surface::{BSplineCurve, basis, clamped, polar};
use super::{distance, noise};
use crate::geometry::mesh::sub;

/// A curve with knots of any spacing.
fn curve(noise: &mut impl FnMut() -> f64) -> BSplineCurve {
    let mut breaks = vec![-1.0];
    for _ in 0..6 {
        breaks.push(breaks[breaks.len() - 1] + 0.05 + noise());
    }
    let knots = clamped(&breaks);
    let control = (4..knots.len()).map(|_| [0; 3].map(|_| noise())).collect();
    BSplineCurve { knots, control }
}

#[test]
fn parts_of_curves_are_on_them() {
    let mut noise = noise(13);
    for n in 0..200 {
        let whole = curve(&mut noise);
        let (first, last) = (whole.knots[0], whole.knots[whole.knots.len() - 1]);
        let inside = |t: f64| first + t * (last - first);
        let mut range = [inside(noise()), inside(noise())];
        match n % 5 {
            0 => range = [first, last],
            1 => range = [whole.knots[5], whole.knots[8]],
            2 => range[0] = last,
            _ => {}
        }
        let part = whole.part(range);
        let [low, high] = [part.knots[0], part.knots[part.knots.len() - 1]];
        assert!((high - low - (range[1] - range[0]).abs()).abs() < 1e-14);
        assert!(part.knots.is_sorted() && part.knots.len() == part.control.len() + 4);
        for i in 0..=20 {
            let t = [0.0, noise(), 1.0][i % 3];
            let at = part.at(low + t * (high - low));
            let on = whole.at(range[0] + t * (range[1] - range[0]));
            assert!(distance(at[0], on[0]) < 1e-12);
            let way = if range[0] <= range[1] { 1.0 } else { -1.0 };
            assert!(distance(at[1], on[1].map(|x| way * x)) < 1e-8);
        }
    }
}

#[test]
fn derivatives_of_basis_functions_are_those_of_differences() {
    let mut noise = noise(14);
    let curve = curve(&mut noise);
    let (first, last) = (curve.knots[0], curve.knots[curve.knots.len() - 1]);
    for _ in 0..200 {
        let t = first + 1e-5 + (last - first - 2e-5) * noise();
        let local = basis(&curve.knots, t);
        assert!((local.value.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        assert!(local.value.iter().all(|&w| w >= 0.0));
        let [a, b] = [t + 1e-6, t - 1e-6].map(|t| curve.at(t)[0]);
        let slope = sub(a, b).map(|x| x / 2e-6);
        assert!(distance(slope, curve.at(t)[1]) < 1e-5);
    }
    let ends = [first, last].map(|t| Some(curve.at(t)[0]));
    assert_eq!(
        ends,
        [
            curve.control.first().copied(),
            curve.control.last().copied()
        ]
    );
}

#[test]
fn polar_forms_are_symmetric_multiaffine_and_the_point_where_arguments_are_equal() {
    let mut noise = noise(15);
    let curve = curve(&mut noise);
    let near = |a: [f64; 4], b: [f64; 4]| a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-10);
    for span in 3..curve.control.len() {
        let around: [f64; 6] = std::array::from_fn(|j| curve.knots[span - 2 + j]);
        let [low, high] = [around[2], around[3]];
        let of = |at: [f64; 3]| polar(around, at);
        for _ in 0..50 {
            let t = low + (high - low) * noise();
            let local = basis(&curve.knots, t);
            assert!(local.first == span - 3 && near(of([t; 3]), local.value));
            let [a, b, c, d] = [0; 4].map(|_| low + 2.0 * (noise() - 0.5));
            assert!(near(of([a, b, c]), of([c, a, b])) && near(of([a, b, c]), of([b, a, c])));
            let w = noise();
            let mixed: [f64; 4] =
                std::array::from_fn(|i| (1.0 - w) * of([a, b, c])[i] + w * of([d, b, c])[i]);
            assert!(near(of([(1.0 - w) * a + w * d, b, c]), mixed));
        }
        // At three knots in a row it is a control point.
        for i in 0..4 {
            let knots = [0, 1, 2].map(|k| curve.knots[span - 2 + i + k]);
            let unit: [f64; 4] = std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 });
            assert!(near(of(knots), unit));
        }
    }
}
