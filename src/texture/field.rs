//! Tile coordinates on the surface that fit each other across the cut.
//!
//! *Enters:* a surface, its connectivity and the tile. *Leaves:* a [`Field`]: tile coordinates (1 is a tile's width) of every corner.
//!
//! Flat coordinates z themselves go over into each other by a quarter turn and a translation, but not by a *whole* one. So a field f is
//! sought that has whole ones and differs little from σz: least Σ w |df − σ dz|² over the edges of the flat faces, w their cotangent
//! weights, which is ∫ |df − σ dz|² for functions that are linear on faces. The translations come out of [`rounding`](super::rounding)
//! of that same energy. With whole translations and quarter turns every transition is a symmetry of a pattern that looks the same after a
//! quarter turn of its tile, and cones lie at its centres of rotation.
//!
//! *Guaranteed:* transitions are quarter turns and whole translations to rounding, whatever the accuracy of the solve.
//! *Not guaranteed:* that no face is turned over; they are counted.

use super::TextureError;
use super::gaussian::{Complex, kernel};
use super::rounding::{Energy, round};
use super::transitions::{Transitions, transitions};
use crate::atlas::plane::doubled_area;
use crate::flow::solve::SymmetricSolver;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::NONE;
use crate::read::flat::FlatSurface;

/// Faces thinner than this (doubled area over the longest side squared) weigh as if they had this thickness: what they cover is nothing,
/// and their cotangents would drown all others.
const LEAST_THICKNESS: f64 = 1e-6;
/// Added to every weight, so that no vertex hangs on faces without any area alone.
const LEAST_WEIGHT: f64 = 1e-9;
/// Farthest that a transition may be from a quarter turn with a whole translation, tiles. What exact arithmetic would give is far nearer.
const WHOLE_TOLERANCE: f64 = 1e-6;

/// How the tile lies on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile {
    /// Width, flat units.
    pub width: f64,
    /// Height over width.
    pub aspect: f64,
}

/// Tile coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// One a corner, in widths of the tile; y runs up.
    pub corners: Vec<[[f64; 2]; 3]>,
    /// Tiles a flat unit, and the turn from flat coordinates to the tile's.
    pub scale: Complex,
    /// How it was made to fit; `None` where flat coordinates were taken as they are.
    pub fitted: Option<Fitted>,
}

/// How a field fits across the cut.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// Largest distance to the flat coordinates (moved as a whole), in widths of the tile.
    pub largest_correction: f64,
    /// Root of ∫ |df − σ dz|² / ∫ |σ dz|²: by which part lengths change, about.
    pub stretch: f64,
    /// Largest distance of a transition from its quarter turn with a whole translation, in widths of the tile.
    pub largest_misfit: f64,
    /// Faces that are turned over in the field but not in the chart.
    pub flipped: usize,
    /// True where some transition turns by an odd number of quarter turns.
    pub quarter_turned: bool,
    /// True where some transition turns by half a turn.
    pub half_turned: bool,
}

/// Flat coordinates as they are.
#[must_use]
pub fn as_it_is(surface: &FlatSurface, tile: Tile) -> Field {
    let scale = 1.0 / tile.width;
    let corners = surface.central_uv.iter();
    Field {
        corners: corners.map(|uv| uv.map(|p| p.map(|x| scale * x))).collect(),
        scale: Complex::new(scale, 0.0),
        fitted: None,
    }
}

/// The field with whole translations, where every gluing is a quarter turn; `None` where one is not, or where a tile that is no square
/// would be turned by a quarter.
///
/// # Errors
/// A cut that is not that of its segments, a tile that is too large, and a system that cannot be solved.
pub fn fit(
    surface: &FlatSurface,
    connectivity: &Connectivity,
    tile: Tile,
) -> Result<Option<Field>, TextureError> {
    let turns = surface.segments.iter().map(|s| s.quarter_turns);
    let Some(turns) = turns.collect::<Option<Vec<u8>>>() else {
        return Ok(None);
    };
    let quarter_turned = turns.iter().any(|turns| turns % 2 == 1);
    let half_turned = turns.contains(&2);
    if quarter_turned && tile.aspect != 1.0 {
        return Ok(None);
    }
    let walked = transitions(surface, connectivity, turns)?;
    let mut system = System::new(surface, &walked)?;
    let basis = kernel(&walked.constraints, surface.segments.len());
    let energy = system.energy(&basis);
    let rounded = round(&energy, 1.0 / tile.width, [1.0, tile.aspect]);
    let rounded = rounded.ok_or_else(|| TextureError::TileTooLarge {
        width: tile.width,
        side: flat_area(surface).sqrt(),
    })?;
    let mut translations = vec![Complex::ZERO; surface.segments.len()];
    for (column, &y) in basis.iter().zip(&rounded.whole) {
        for (sum, &b) in translations.iter_mut().zip(column) {
            *sum += b * y;
        }
    }
    let corners = system.solve(&translations, rounded.scale);
    let largest_misfit = misfit(connectivity, &walked, &corners, &translations);
    // Also false for NaN.
    let closes = largest_misfit <= WHOLE_TOLERANCE;
    if !closes {
        return Err(TextureError::Misfit { largest_misfit });
    }
    let (largest_correction, stretch) = system.correction(&corners, rounded.scale);
    let flipped = (corners.iter().zip(&surface.central_uv))
        .filter(|(f, z)| {
            let field = doubled_area(f.map(Complex::coordinates));
            doubled_area(**z) > 0.0 && field <= 0.0
        })
        .count();
    Ok(Some(Field {
        corners: corners
            .iter()
            .map(|f| f.map(Complex::coordinates))
            .collect(),
        scale: rounded.scale,
        fitted: Some(Fitted {
            largest_correction,
            stretch,
            largest_misfit,
            flipped,
            quarter_turned,
            half_turned,
        }),
    }))
}

/// Area of the flat surface.
#[must_use]
pub fn flat_area(surface: &FlatSurface) -> f64 {
    let faces = surface.central_uv.iter();
    faces.map(|&uv| 0.5 * doubled_area(uv).abs()).sum()
}

/// Largest distance over both ends of all cut edges.
fn misfit(
    connectivity: &Connectivity,
    walked: &Transitions,
    corners: &[[Complex; 3]],
    translations: &[Complex],
) -> f64 {
    let at = |h| corners[connectivity.face(h).index()][connectivity.corner(h)];
    let distances = walked.left.iter().flat_map(|&(h, segment)| {
        let turn = Complex::quarter_turns(walked.turns[segment as usize]);
        let pairs = connectivity.twin(h).map(|twin| {
            let (start, end) = (at(h), at(connectivity.next(h)));
            [(start, at(connectivity.next(twin))), (end, at(twin))]
        });
        let pairs = pairs.into_iter().flatten();
        pairs.map(move |(left, right)| {
            (right - (turn * left + translations[segment as usize])).length()
        })
    });
    // `max` would drop a NaN.
    distances.fold(0.0, |a, b| if b <= a { a } else { b })
}

/// The least-squares system with its factor.
struct System<'a> {
    surface: &'a FlatSurface,
    walked: &'a Transitions,
    weights: Vec<[f64; 3]>,
    /// Unknown of every vertex, [`NONE`] for cones.
    unknown: Vec<u32>,
    /// The cone of every vertex that is one.
    cone: Vec<u32>,
    solver: SymmetricSolver,
    /// Faces with a corner that is not an unknown itself.
    special: Vec<u32>,
}

/// Entries of a vector that is zero elsewhere.
type Sparse = Vec<(u32, Complex)>;

impl<'a> System<'a> {
    fn new(surface: &'a FlatSurface, walked: &'a Transitions) -> Result<Self, TextureError> {
        let mut cone = vec![NONE; surface.positions.len()];
        for (number, (v, _)) in walked.cones.iter().enumerate() {
            cone[v.index()] = number as u32;
        }
        let mut unknown = vec![NONE; surface.positions.len()];
        let mut count = 0;
        // Without cones the field may be moved as a whole: one vertex stays at the origin.
        let mut must_hold = walked.cones.is_empty();
        for &v in surface.faces.as_flattened() {
            let v = v as usize;
            if unknown[v] != NONE || cone[v] != NONE {
                continue;
            }
            if std::mem::take(&mut must_hold) {
                cone[v] = HELD;
                continue;
            }
            unknown[v] = count;
            count += 1;
        }
        let weights: Vec<[f64; 3]> = surface.central_uv.iter().map(|&uv| weights(uv)).collect();
        let count = count as usize;
        let (mut pairs, mut values) = (Vec::new(), Vec::new());
        let mut diagonal = vec![0.0; 2 * count];
        let mut special = Vec::new();
        for (f, face) in surface.faces.iter().enumerate() {
            let numbers = face.map(|v| unknown[v as usize]);
            if numbers.contains(&NONE) || walked.corner[f] != [0; 3] {
                special.push(f as u32);
            }
            let turns = walked.corner[f].map(|e| walked.expressions[e as usize].turns);
            for (k, &w) in weights[f].iter().enumerate() {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                for number in [numbers[i], numbers[j]].into_iter().filter(|&n| n != NONE) {
                    for part in 0..2 {
                        diagonal[2 * number as usize + part] += w;
                    }
                }
                if numbers[i] == NONE || numbers[j] == NONE {
                    continue;
                }
                // Row i, column j: −w i^(turns of j − turns of i), as a real 2 × 2 block.
                let factor = -Complex::quarter_turns(4 + turns[j] - turns[i]).scaled(w);
                let (a, b) = (2 * numbers[i], 2 * numbers[j]);
                match factor.im == 0.0 {
                    true => {
                        pairs.extend([[a, b], [a + 1, b + 1]]);
                        values.extend([factor.re, factor.re]);
                    }
                    false => {
                        pairs.extend([[a, b + 1], [a + 1, b]]);
                        values.extend([-factor.im, factor.im]);
                    }
                }
            }
        }
        let mut solver = SymmetricSolver::new(2 * count, &pairs)?;
        solver.factorize(&diagonal, &values)?;
        Ok(Self {
            surface,
            walked,
            weights,
            unknown,
            cone,
            solver,
            special,
        })
    }

    /// The part of a corner's coordinate that does not hang on unknowns.
    fn constant(&self, face: usize, corner: usize, translations: &[Complex]) -> Complex {
        let expression = &self.walked.expressions[self.walked.corner[face][corner] as usize];
        let v = self.surface.faces[face][corner] as usize;
        let base = match self.walked.cones.get(self.cone[v] as usize) {
            Some((_, walk)) => walk.fixed_point(translations),
            None => Complex::ZERO,
        };
        Complex::quarter_turns(expression.turns) * base + expression.translation(translations)
    }

    /// Differences of constants over the edges of a face; `visit` gets unknowns with what these add to their right side.
    fn edges(
        &self,
        face: usize,
        constants: [Complex; 3],
        mut visit: impl FnMut(u32, Complex),
    ) -> [Complex; 3] {
        [0, 1, 2].map(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let (w, d) = (self.weights[face][k], constants[i] - constants[j]);
            for (corner, sign) in [(i, -w), (j, w)] {
                let number = self.unknown[self.surface.faces[face][corner] as usize];
                if number != NONE && d != Complex::ZERO {
                    let expression = self.walked.corner[face][corner] as usize;
                    let turns = self.walked.expressions[expression].turns;
                    visit(number, (Complex::quarter_turns(4 - turns) * d).scaled(sign));
                }
            }
            d
        })
    }

    /// What unknowns are given whole translations: right side, and differences of constants over the special edges.
    fn of_translations(&self, translations: &[Complex]) -> (Sparse, Sparse) {
        let (mut right, mut differences) = (Sparse::new(), Sparse::new());
        for (at, &face) in self.special.iter().enumerate() {
            let constants = [0, 1, 2].map(|k| self.constant(face as usize, k, translations));
            let edges = self.edges(face as usize, constants, |number, x| {
                right.push((number, x))
            });
            let edges = edges.into_iter().enumerate();
            let entries = edges.map(|(k, d)| ((3 * at + k) as u32, d));
            differences.extend(entries.filter(|(_, d)| *d != Complex::ZERO));
        }
        (right, differences)
    }

    /// The same for flat coordinates with the sign of −σz, σ = 1, over all faces; with all differences.
    fn of_flat(&self) -> (Vec<Complex>, Vec<[Complex; 3]>) {
        let mut right = vec![Complex::ZERO; self.solver.size() / 2];
        let faces = self.surface.central_uv.iter().enumerate();
        let differences = faces.map(|(face, uv)| {
            let constants = uv.map(|p| -Complex::point(p));
            self.edges(face, constants, |number, x| right[number as usize] += x)
        });
        let differences = differences.collect();
        (right, differences)
    }

    fn solved(&mut self, right: &[Complex]) -> Vec<Complex> {
        let mut values: Vec<f64> = right.iter().flat_map(|x| x.coordinates()).collect();
        self.solver.solve(&mut values);
        let pairs = values.as_chunks::<2>().0;
        pairs.iter().map(|&p| Complex::point(p)).collect()
    }

    /// The energy in the coefficients of a basis of translations.
    fn energy(&mut self, basis: &[Vec<Complex>]) -> Energy {
        let count = basis.len();
        let columns: Vec<(Sparse, Sparse)> =
            basis.iter().map(|b| self.of_translations(b)).collect();
        let (flat_right, flat_differences) = self.of_flat();
        let flat_solved = self.solved(&flat_right);
        let inner = |a: &Sparse, b: &[Complex]| {
            let terms = a.iter().map(|&(k, x)| x.conjugate() * b[k as usize]);
            terms.fold(Complex::ZERO, |sum, x| sum + x)
        };
        // Some weights are negative.
        let of_special = self.special.iter();
        let weights: Vec<f64> = of_special.flat_map(|&f| self.weights[f as usize]).collect();
        let weighted = |a: &Sparse, b: &[Complex]| {
            let terms = (a.iter())
                .map(|&(k, x)| (x.conjugate() * b[k as usize]).scaled(weights[k as usize]));
            terms.fold(Complex::ZERO, |sum, x| sum + x)
        };
        let all = self.weights.as_flattened().iter();
        let all = all.zip(flat_differences.as_flattened());
        let total: f64 = all.map(|(w, d)| w * d.squared()).sum();
        let minimum: f64 = flat_right
            .iter()
            .zip(&flat_solved)
            .map(|(a, b)| a.dot(*b))
            .sum();
        let on_special: Vec<Complex> = self
            .special
            .iter()
            .flat_map(|&face| flat_differences[face as usize])
            .collect();
        let mut energy = Energy {
            form: vec![vec![Complex::ZERO; count]; count],
            mixed: columns
                .iter()
                .map(|(right, differences)| {
                    weighted(differences, &on_special) - inner(right, &flat_solved)
                })
                .collect(),
            flat: total - minimum,
        };
        for (k, (right, differences)) in columns.iter().enumerate() {
            let mut dense = vec![Complex::ZERO; self.solver.size() / 2];
            for &(number, x) in right {
                dense[number as usize] += x;
            }
            let solved = self.solved(&dense);
            let mut own = vec![Complex::ZERO; 3 * self.special.len()];
            for &(at, d) in differences {
                own[at as usize] += d;
            }
            for (j, (right, differences)) in columns.iter().enumerate() {
                energy.form[j][k] = weighted(differences, &own) - inner(right, &solved);
            }
        }
        energy
    }

    /// All corners for given translations.
    fn solve(&mut self, translations: &[Complex], scale: Complex) -> Vec<[Complex; 3]> {
        let (mut right, _) = self.of_flat();
        for x in &mut right {
            *x = scale * *x;
        }
        let (more, _) = self.of_translations(translations);
        for (number, x) in more {
            right[number as usize] += x;
        }
        let solved = self.solved(&right);
        (0..self.surface.faces.len())
            .map(|face| {
                [0, 1, 2].map(|k| {
                    let constant = self.constant(face, k, translations);
                    let number = self.unknown[self.surface.faces[face][k] as usize];
                    let expression = self.walked.corner[face][k] as usize;
                    let turns = self.walked.expressions[expression].turns;
                    match solved.get(number as usize) {
                        Some(&u) => Complex::quarter_turns(turns) * u + constant,
                        None => constant,
                    }
                })
            })
            .collect()
    }

    /// Largest distance to σz moved as a whole, and the stretch.
    fn correction(&self, corners: &[[Complex; 3]], scale: Complex) -> (f64, f64) {
        let faces = || corners.iter().zip(&self.surface.central_uv);
        let apart = |f: Complex, z: [f64; 2]| f - scale * Complex::point(z);
        let (mut sum, mut area) = (Complex::ZERO, 0.0);
        for (f, z) in faces() {
            let weight = doubled_area(*z).abs() / 3.0;
            for k in 0..3 {
                sum += apart(f[k], z[k]).scaled(weight);
                area += weight;
            }
        }
        let mean = sum.scaled(1.0 / area.max(f64::MIN_POSITIVE));
        let (mut largest, mut squares, mut all) = (0.0_f64, 0.0, 0.0);
        for ((f, z), weights) in faces().zip(&self.weights) {
            for k in 0..3 {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                largest = largest.max((apart(f[k], z[k]) - mean).length());
                let difference = apart(f[i], z[i]) - apart(f[j], z[j]);
                let flat = scale * (Complex::point(z[i]) - Complex::point(z[j]));
                squares += weights[k] * difference.squared();
                all += weights[k] * flat.squared();
            }
        }
        (
            largest,
            (squares / all.max(f64::MIN_POSITIVE)).max(0.0).sqrt(),
        )
    }
}

/// Stands for the vertex that is held at the origin in place of a cone.
const HELD: u32 = NONE - 1;

/// Cotangent weights of the edges opposite the corners.
fn weights(uv: [[f64; 2]; 3]) -> [f64; 3] {
    let side = |i: usize, j: usize| Complex::point(uv[j]) - Complex::point(uv[i]);
    let longest = (0..3)
        .map(|k| side(k, (k + 1) % 3).squared())
        .fold(0.0, f64::max);
    let thickness = doubled_area(uv).abs().max(LEAST_THICKNESS * longest);
    [0, 1, 2].map(|k| {
        let corner = side(k, (k + 1) % 3).dot(side(k, (k + 2) % 3));
        match thickness > 0.0 {
            true => 0.5 * corner / thickness + LEAST_WEIGHT,
            false => LEAST_WEIGHT,
        }
    })
}
