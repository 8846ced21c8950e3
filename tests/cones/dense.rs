//! Linear algebra of small full matrices, written for these tests alone.

/// A square matrix, row after row.
#[derive(Clone, Debug)]
pub struct Matrix {
    pub size: usize,
    pub entry: Vec<f64>,
}

impl Matrix {
    pub fn zero(size: usize) -> Self {
        Self {
            size,
            entry: vec![0.0; size * size],
        }
    }

    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.entry[i * self.size + j]
    }

    pub fn add(&mut self, i: usize, j: usize, x: f64) {
        self.entry[i * self.size + j] += x;
    }

    pub fn apply(&self, x: &[f64]) -> Vec<f64> {
        self.entry
            .chunks(self.size)
            .map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum())
            .collect()
    }

    /// Gauss with partial pivoting; `None` where a pivot vanishes.
    pub fn solve(&self, rhs: &[f64]) -> Option<Vec<f64>> {
        let n = self.size;
        let mut rows: Vec<Vec<f64>> = (0..n)
            .map(|i| {
                let mut row = self.entry[i * n..][..n].to_vec();
                row.push(rhs[i]);
                row
            })
            .collect();
        let scale = self.entry.iter().fold(0.0f64, |a, x| a.max(x.abs()));
        for k in 0..n {
            let pivot = (k..n).max_by(|&i, &j| rows[i][k].abs().total_cmp(&rows[j][k].abs()))?;
            rows.swap(k, pivot);
            if rows[k][k].abs() <= 1e-13 * scale {
                return None;
            }
            for i in k + 1..n {
                let factor = rows[i][k] / rows[k][k];
                let (above, below) = rows.split_at_mut(i);
                for (x, y) in below[0][k..].iter_mut().zip(&above[k][k..]) {
                    *x -= factor * y;
                }
            }
        }
        let mut x = vec![0.0; n];
        for k in (0..n).rev() {
            let known: f64 = (k + 1..n).map(|j| rows[k][j] * x[j]).sum();
            x[k] = (rows[k][n] - known) / rows[k][k];
        }
        Some(x)
    }

    /// The inverse, by columns of the unit matrix.
    pub fn inverse(&self) -> Option<Self> {
        let n = self.size;
        let mut inverse = Self::zero(n);
        for j in 0..n {
            let mut unit = vec![0.0; n];
            unit[j] = 1.0;
            for (i, x) in self.solve(&unit)?.into_iter().enumerate() {
                inverse.entry[i * n + j] = x;
            }
        }
        Some(inverse)
    }
}
