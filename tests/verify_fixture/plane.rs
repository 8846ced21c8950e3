//! The formulas that the builder needs.

use super::P2;
use super::P3;
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

pub fn rotate(p: P2, a: f64) -> P2 {
    let (s, c) = a.sin_cos();
    [c * p[0] - s * p[1], s * p[0] + c * p[1]]
}

pub fn distance(a: P2, b: P2) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

pub fn distance3(a: P3, b: P3) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

pub fn wrap(a: f64) -> f64 {
    let r = a - TAU * (a / TAU).round();
    if r <= -PI { r + TAU } else { r }
}

#[derive(Clone, Copy, Debug)]
pub struct Motion(pub f64, pub P2);

impl Motion {
    pub fn apply(&self, p: P2) -> P2 {
        let q = rotate(p, self.0);
        [q[0] + self.1[0], q[1] + self.1[1]]
    }

    pub fn after(&self, first: &Motion) -> Motion {
        Motion(wrap(self.0 + first.0), self.apply(first.1))
    }

    pub fn inverse(&self) -> Motion {
        Motion(wrap(-self.0), rotate([-self.1[0], -self.1[1]], -self.0))
    }

    pub fn json(&self, mut record: Value) -> Value {
        record["rotation"] = json!(self.0);
        record["translation"] = json!(self.1);
        let turns = self.0 / FRAC_PI_2;
        if (turns - turns.round()).abs() < 1e-9 {
            record["quarter_turns"] = json!((turns.round() as i64).rem_euclid(4));
        }
        record
    }
}

pub fn angle(p: P2, q: P2, r: P2) -> f64 {
    let (a, b) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
    (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1])
}

pub fn area(t: [P2; 3]) -> f64 {
    0.5 * ((t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0]))
}

pub fn area3(t: [P3; 3]) -> f64 {
    let [a, b, c] = [0, 1, 2].map(|k| distance3(t[k], t[(k + 1) % 3]));
    let s = 0.5 * (a + b + c);
    (s * (s - a) * (s - b) * (s - c)).max(0.0).sqrt()
}
