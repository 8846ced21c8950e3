//! Areas and widths of triangles on the lattice.

/// Twice the area over the square of the longest side that faces are to have.
pub(super) const THICK: f64 = 1e-5;
/// Below this, rounding may have flattened one; other thin faces are as thin in space.
pub(super) const THIN: f64 = 1e-9;

/// Twice the area of a triangle.
pub(crate) fn double_area([p, q, r]: [[f64; 2]; 3]) -> f64 {
    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
}

/// Whether a triangle has no area, or a negative one.
pub(crate) fn is_turned_over(corners: [[f64; 2]; 3]) -> bool {
    let area = double_area(corners);
    area <= 0.0 || area.is_nan()
}

/// Twice the area over the square of the longest side.
pub(super) fn thickness(p: [[f64; 2]; 3]) -> f64 {
    let squared = |k: usize| {
        let (a, b) = (p[k], p[(k + 1) % 3]);
        (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)
    };
    let longest = squared(0).max(squared(1)).max(squared(2));
    match longest > 0.0 {
        true => double_area(p) / longest,
        false => 0.0,
    }
}
