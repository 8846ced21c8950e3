//! Complex numbers and integer relations between Gaussian integers.
//!
//! Quarter turns of the plane are powers of i, so that everything that quarter turns and whole translations can say is an
//! expression with Gaussian integers (a + bi with whole a and b). They are kept in `f64`, which holds them exactly up to 2⁵³.

use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// re + i im: a point or a vector of the plane, or a rotation with a scale.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Complex {
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
}

impl Complex {
    /// 0.
    pub const ZERO: Complex = Complex::new(0.0, 0.0);
    /// 1.
    pub const ONE: Complex = Complex::new(1.0, 0.0);

    /// From its parts.
    #[must_use]
    pub const fn new(re: f64, im: f64) -> Self {
        Self { re, im }
    }

    /// A point of the plane.
    #[must_use]
    pub const fn point([re, im]: [f64; 2]) -> Self {
        Self { re, im }
    }

    /// Its coordinates.
    #[must_use]
    pub const fn coordinates(self) -> [f64; 2] {
        [self.re, self.im]
    }

    /// i to the power of a number of quarter turns, without rounding.
    #[must_use]
    pub const fn quarter_turns(turns: u8) -> Self {
        match turns % 4 {
            0 => Self::new(1.0, 0.0),
            1 => Self::new(0.0, 1.0),
            2 => Self::new(-1.0, 0.0),
            _ => Self::new(0.0, -1.0),
        }
    }

    /// The same imaginary part with the other sign.
    #[must_use]
    pub const fn conjugate(self) -> Self {
        Self::new(self.re, -self.im)
    }

    /// Squared length.
    #[must_use]
    pub fn squared(self) -> f64 {
        self.re * self.re + self.im * self.im
    }

    /// Length.
    #[must_use]
    pub fn length(self) -> f64 {
        self.re.hypot(self.im)
    }

    /// Times a real number.
    #[must_use]
    pub fn scaled(self, by: f64) -> Self {
        Self::new(by * self.re, by * self.im)
    }

    /// 1 / z; not finite for 0.
    #[must_use]
    pub fn inverse(self) -> Self {
        self.conjugate().scaled(1.0 / self.squared())
    }

    /// Re(z̄ w), the scalar product.
    #[must_use]
    pub fn dot(self, other: Self) -> f64 {
        self.re * other.re + self.im * other.im
    }

    /// The nearest number whose parts are whole multiples of `steps`.
    #[must_use]
    pub fn rounded(self, steps: [f64; 2]) -> Self {
        let [re, im] = steps;
        Self::new((self.re / re).round() * re, (self.im / im).round() * im)
    }
}

impl Add for Complex {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.re + other.re, self.im + other.im)
    }
}

impl Sub for Complex {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.re - other.re, self.im - other.im)
    }
}

impl Mul for Complex {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self::new(
            self.re * other.re - self.im * other.im,
            self.re * other.im + self.im * other.re,
        )
    }
}

impl Neg for Complex {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.re, -self.im)
    }
}

impl AddAssign for Complex {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Complex {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

/// A basis of all vectors of Gaussian integers that are solutions of homogeneous equations: the equations
/// `Σ row[k].1 · x[row[k].0] = 0`, the solutions one column each.
///
/// Euclid's algorithm on one equation after another. Each step replaces basis vectors by whole combinations of them that can be
/// undone, so that the solutions stay *all* whole solutions. Equations of a tree of segments have a factor ±1 or ±i to begin
/// with, and then nothing grows.
pub(super) fn kernel(rows: &[Vec<(usize, Complex)>], unknowns: usize) -> Vec<Vec<Complex>> {
    let mut basis: Vec<Vec<Complex>> = (0..unknowns)
        .map(|j| {
            let mut unit = vec![Complex::ZERO; unknowns];
            unit[j] = Complex::ONE;
            unit
        })
        .collect();
    for row in rows {
        let value = |x: &Vec<Complex>| {
            let terms = row.iter().map(|&(k, c)| c * x[k]);
            terms.fold(Complex::ZERO, Add::add)
        };
        let mut values: Vec<Complex> = basis.iter().map(value).collect();
        loop {
            let nonzero = values.iter().enumerate().filter(|(_, c)| c.squared() > 0.0);
            let least = nonzero.min_by(|a, b| a.1.squared().total_cmp(&b.1.squared()));
            let Some((pivot, &by)) = least else { break };
            let (column, inverse) = (basis[pivot].clone(), by.inverse());
            let mut is_alone = true;
            for (j, c) in values.iter_mut().enumerate() {
                if j == pivot || c.squared() == 0.0 {
                    continue;
                }
                let quotient = (*c * inverse).rounded([1.0; 2]);
                *c -= quotient * by;
                is_alone &= c.squared() == 0.0;
                for (x, &p) in basis[j].iter_mut().zip(&column) {
                    *x -= quotient * p;
                }
            }
            if is_alone {
                basis.remove(pivot);
                break;
            }
        }
    }
    basis
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarter_turns_are_powers_of_i() {
        let i = Complex::quarter_turns(1);
        let mut power = Complex::ONE;
        for turns in 0..9 {
            assert_eq!(Complex::quarter_turns(turns), power);
            power = power * i;
        }
        let z = Complex::new(3.0, -4.0);
        assert_eq!(z.length(), 5.0);
        assert!((z * z.inverse() - Complex::ONE).length() < 1e-15);
        assert_eq!(z.dot(i), -4.0);
        assert_eq!(
            Complex::new(1.4, 1.4).rounded([1.0, 0.5]),
            Complex::new(1.0, 1.5)
        );
    }

    #[test]
    fn kernels_hold_every_whole_solution() {
        let g = |re: i32, im: i32| Complex::new(f64::from(re), f64::from(im));
        // No factor is a unit: (1 + i) x + 2 y + (3 + i) z = 0.
        let row = vec![(0, g(1, 1)), (1, g(2, 0)), (2, g(3, 1))];
        let basis = kernel(std::slice::from_ref(&row), 3);
        assert_eq!(basis.len(), 2);
        for x in &basis {
            let sum = row.iter().fold(Complex::ZERO, |s, &(k, c)| s + c * x[k]);
            assert_eq!(sum, Complex::ZERO);
        }
        // Every solution is a whole combination: the 2 × 2 minors have no common divisor after the row's own, 1 + i, is taken
        // out: they are the row divided by it, up to a unit.
        let minor = |a: usize, b: usize| basis[0][a] * basis[1][b] - basis[0][b] * basis[1][a];
        let lengths = [minor(1, 2), minor(2, 0), minor(0, 1)].map(Complex::squared);
        assert_eq!(lengths, [1.0, 2.0, 5.0]);
        // A second equation, and one that says the same again.
        let second = vec![(0, g(0, 1)), (2, g(-1, 0))];
        let basis = kernel(&[row.clone(), second.clone(), row], 3);
        assert_eq!(basis.len(), 1);
        let [x] = &basis[..] else { panic!() };
        assert_eq!(g(0, 1) * x[0], x[2]);
        assert!(kernel(&[], 2).len() == 2 && kernel(&[vec![]], 0).is_empty());
    }
}
