//! Bicubic tensor-product B-spline surfaces.

use super::basis::{Basis, Local, ORDER};
use super::side::Side;

/// A surface over the unit square.
#[derive(Clone, Debug, PartialEq)]
pub struct BSplineSurface {
    /// In u and in v.
    pub basis: [Basis; 2],
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

impl BSplineSurface {
    /// Control points in u and in v.
    pub fn size(&self) -> [usize; 2] {
        self.basis.map(Basis::count)
    }

    /// The point at (u, v).
    pub fn at(&self, [u, v]: [f64; 2]) -> Jet {
        self.combine(&self.basis[0].at(u), &self.basis[1].at(v))
    }

    /// The same where the bases are known.
    pub fn combine(&self, u: &Local, v: &Local) -> Jet {
        let columns = self.basis[0].count();
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

    /// Control points of a side, in the direction of its parameter.
    pub fn side(&self, side: Side) -> Vec<[f64; 3]> {
        let grid = side.grid(self.size());
        grid.into_iter().map(|i| self.control[i]).collect()
    }
}
