//! Shapes of the faces in space and in the flat metric, measured once for all checks.

use super::arrays::Arrays;
use super::formulas::{
    Worst, angles_from, area_from_lengths, area3, half_angle_gap, half_tangents, least_sine,
    lengths3,
};

/// Faces whose sines are all above this are well shaped: nobody's rounding matters there.
const WELL_SHAPED: f64 = 1e-5;

/// What several checks ask of the faces.
pub(super) struct Shapes {
    /// Areas in space.
    pub source_area: Vec<f64>,
    /// Of the flat areas.
    pub flat_total: f64,
    /// Half the logarithm of flat area by area in space; not finite where one of them vanishes.
    pub log_scale: Vec<f64>,
    /// Whether a face is well shaped both in space and in the flat metric.
    pub is_well: Vec<bool>,
    /// Largest difference between an angle in space and in the flat metric, of the well-shaped faces and of all.
    pub angle_max: [f64; 2],
    /// Sum of area in space times mean difference of the angles.
    pub angle_sum: f64,
}

impl Shapes {
    /// Beside the shapes the corner angles in the flat metric, which are large and needed once.
    pub fn new(arrays: &Arrays) -> (Self, Vec<[f64; 3]>) {
        let faces = arrays.faces.len();
        let mut angles = Vec::with_capacity(faces);
        let mut shapes = Shapes {
            source_area: Vec::with_capacity(faces),
            flat_total: 0.0,
            log_scale: Vec::with_capacity(faces),
            is_well: Vec::with_capacity(faces),
            angle_max: [0.0; 2],
            angle_sum: 0.0,
        };
        let (mut well, mut all) = (Worst::default(), Worst::default());
        for (f, &flat) in arrays.flat_length.iter().enumerate() {
            let corners = arrays.triangle(f);
            let (source, source_area) = (lengths3(corners), area3(corners));
            let flat_area = area_from_lengths(flat);
            let halves = half_tangents(flat);
            let is_well = least_sine(flat) > WELL_SHAPED && least_sine(source) > WELL_SHAPED;
            if source_area > 0.0 && flat_area > 0.0 {
                let other = half_tangents(source);
                let gaps = [0, 1, 2].map(|k| 2.0 * half_angle_gap(halves[k], other[k]));
                let gap = gaps[0].max(gaps[1]).max(gaps[2]);
                all.see(gap);
                if is_well {
                    well.see(gap);
                }
                shapes.angle_sum += source_area * gaps.iter().sum::<f64>() / 3.0;
            }
            shapes.flat_total += flat_area;
            shapes.log_scale.push(0.5 * (flat_area / source_area).ln());
            shapes.source_area.push(source_area);
            shapes.is_well.push(is_well);
            angles.push(angles_from(halves));
        }
        shapes.angle_max = [well.0, all.0];
        (shapes, angles)
    }
}
