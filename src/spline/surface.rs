//! Cubic B-spline curves and bicubic tensor-product B-spline surfaces over knots of any spacing.
//!
//! *Guaranteed:* knots never fall, the first and the last four are equal (a curve begins and ends at its first and last control point), and there are four more of them than control
//! points. Control points are *blossoms*: that of number i is the polar form of any of the cubic pieces that it belongs to at knots i + 1 to i + 3 (L. Ramshaw, "Blossoms are polar forms", 1989).

/// Degree in each parameter.
pub const DEGREE: usize = 3;
/// Control points that a piece depends on.
pub const ORDER: usize = DEGREE + 1;

/// A curve.
#[derive(Clone, Debug, PartialEq)]
pub struct BSplineCurve {
    /// Knots, each as often as its multiplicity.
    pub knots: Vec<f64>,
    /// Control points.
    pub control: Vec<[f64; 3]>,
}

/// A surface.
#[derive(Clone, Debug, PartialEq)]
pub struct BSplineSurface {
    /// Knots in u and in v, each as often as its multiplicity.
    pub knots: [Vec<f64>; 2],
    /// Control points, u fastest.
    pub control: Vec<[f64; 3]>,
}

/// A point of a surface with its tangents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet {
    /// In space.
    pub point: [f64; 3],
    /// Derivatives by u and by v.
    pub tangent: [[f64; 3]; 2],
}

/// Knots with the ends four times, from those between which a curve is one polynomial.
pub fn clamped(breaks: &[f64]) -> Vec<f64> {
    let (first, last) = (breaks[0], breaks[breaks.len() - 1]);
    let mut knots = vec![first; DEGREE];
    knots.extend(breaks);
    knots.extend([last; DEGREE]);
    knots
}

/// The control points that matter at a parameter: number of the first, their weights and the derivatives of these.
pub struct Local {
    /// First control point.
    pub first: usize,
    /// Weights of it and the next three.
    pub value: [f64; ORDER],
    /// Derivatives.
    pub derivative: [f64; ORDER],
}

/// Basis functions at a parameter between the first and the last knot.
pub fn basis(knots: &[f64], t: f64) -> Local {
    let count = knots.len() - ORDER;
    let above = knots.partition_point(|&k| k <= t);
    let span = above.clamp(ORDER, count) - 1;
    let mut value = [0.0; ORDER];
    value[0] = 1.0;
    let mut lower = value;
    for degree in 1..=DEGREE {
        lower = value;
        let mut next = [0.0; ORDER];
        for i in 0..degree {
            let (low, high) = (knots[span + 1 + i - degree], knots[span + 1 + i]);
            let part = lower[i] / (high - low);
            next[i] += (high - t) * part;
            next[i + 1] += (t - low) * part;
        }
        value = next;
    }
    let mut derivative = [0.0; ORDER];
    for i in 0..DEGREE {
        let slope = 3.0 * lower[i] / (knots[span + 1 + i] - knots[span + 1 + i - DEGREE]);
        derivative[i] -= slope;
        derivative[i + 1] += slope;
    }
    Local {
        first: span - DEGREE,
        value,
        derivative,
    }
}

impl BSplineCurve {
    /// The point at a parameter, and the derivative.
    pub fn at(&self, t: f64) -> [[f64; 3]; 2] {
        let local = basis(&self.knots, t);
        let mut at = [[0.0; 3]; 2];
        for i in 0..ORDER {
            for (c, x) in self.control[local.first + i].iter().enumerate() {
                at[0][c] += local.value[i] * x;
                at[1][c] += local.derivative[i] * x;
            }
        }
        at
    }
}

impl BSplineSurface {
    /// Control points in u and in v.
    pub fn size(&self) -> [usize; 2] {
        [0, 1].map(|axis| self.knots[axis].len() - ORDER)
    }

    /// The point at (u, v).
    pub fn at(&self, [u, v]: [f64; 2]) -> Jet {
        let (u, v) = (basis(&self.knots[0], u), basis(&self.knots[1], v));
        let columns = self.knots[0].len() - ORDER;
        let mut jet = Jet {
            point: [0.0; 3],
            tangent: [[0.0; 3]; 2],
        };
        for k in 0..ORDER {
            let row = (v.first + k) * columns + u.first;
            for (i, control) in self.control[row..row + ORDER].iter().enumerate() {
                for (c, x) in control.iter().enumerate() {
                    jet.point[c] += u.value[i] * v.value[k] * x;
                    jet.tangent[0][c] += u.derivative[i] * v.value[k] * x;
                    jet.tangent[1][c] += u.value[i] * v.derivative[k] * x;
                }
            }
        }
        jet
    }

    /// A side as a curve in the direction of its parameter: 0 is v = 0, 1 the last u, 2 the last v, 3 u = 0.
    pub fn side(&self, side: usize) -> BSplineCurve {
        let [columns, rows] = self.size();
        let control = match side {
            0 => (0..columns).map(|i| self.control[i]).collect(),
            1 => (0..rows)
                .map(|k| self.control[(k + 1) * columns - 1])
                .collect(),
            2 => (0..columns)
                .map(|i| self.control[(rows - 1) * columns + i])
                .collect(),
            _ => (0..rows).map(|k| self.control[k * columns]).collect(),
        };
        BSplineCurve {
            knots: self.knots[side % 2].clone(),
            control,
        }
    }
}

/// Weights of four control points of a cubic piece in its polar form at three parameters: `knots` are the six around it, three on each side.
pub fn polar(knots: [f64; 6], at: [f64; 3]) -> [f64; ORDER] {
    // Rows: the value as weights of the control points, one for each of those that are left.
    let mut rows: Vec<[f64; ORDER]> = (0..ORDER)
        .map(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }))
        .collect();
    for (level, t) in at.into_iter().enumerate() {
        rows = (0..rows.len() - 1)
            .map(|i| {
                let (low, high) = (knots[i + level], knots[i + DEGREE]);
                let w = (t - low) / (high - low);
                std::array::from_fn(|j| (1.0 - w) * rows[i][j] + w * rows[i + 1][j])
            })
            .collect();
    }
    rows[0]
}

impl BSplineCurve {
    /// The curve between two of its parameters, in the other direction where the second is less.
    pub fn part(&self, [from, to]: [f64; 2]) -> Self {
        let (low, high) = (from.min(to), from.max(to));
        let mut breaks = vec![low];
        for &k in self.knots.iter().filter(|&&k| low < k && k < high) {
            if breaks.last() != Some(&k) {
                breaks.push(k);
            }
        }
        breaks.push(high);
        let knots = clamped(&breaks);
        let point = |i: usize| {
            let at = [knots[i + 1], knots[i + 2], knots[i + 3]];
            // A piece that the control point belongs to: around the middle one of the spans that there are.
            let spans = (i..i + ORDER).filter(|&m| knots[m] < knots[m + 1]);
            let middle = spans
                .min_by_key(|&m| (2 * m).abs_diff(2 * i + 3))
                .unwrap_or(i);
            let t = (knots[middle] + knots[middle + 1]) / 2.0;
            let first = basis(&self.knots, t).first;
            let around: [f64; 6] = std::array::from_fn(|j| self.knots[first + 1 + j]);
            let weights = polar(around, at);
            [0, 1, 2].map(|c| {
                (0..ORDER)
                    .map(|j| weights[j] * self.control[first + j][c])
                    .sum()
            })
        };
        let mut control: Vec<[f64; 3]> = (0..knots.len() - ORDER).map(point).collect();
        if from <= to {
            return Self { knots, control };
        }
        control.reverse();
        Self {
            knots: knots.iter().rev().map(|k| low + high - k).collect(),
            control,
        }
    }
}
