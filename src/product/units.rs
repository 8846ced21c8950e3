//! From the frame that a surface was worked on in back to source units.

use super::AffineAtlas;
use crate::atlas::patch::{Domain, Patch};
use crate::atlas::plane::RigidMotion;
use crate::geometry::frame::Frame;
use crate::geometry::ids::PatchId;

impl AffineAtlas {
    /// The same atlas in source units. Every length is multiplied by one power of two, so nothing but positions far from the origin is
    /// rounded; `image_origin` is that of the source already.
    pub(crate) fn leave(mut self, frame: &Frame) -> Self {
        let plane = |p: &mut [f64; 2]| *p = frame.plane(*p);
        let length = |l: &mut f64| *l = frame.length(*l);
        let motion = |m: &mut RigidMotion| m.translation = frame.plane(m.translation);
        frame.leave_all(&mut self.mesh.positions);
        self.metric
            .length
            .as_mut_slice()
            .iter_mut()
            .for_each(length);
        self.central
            .uv
            .as_mut_slice()
            .as_flattened_mut()
            .iter_mut()
            .for_each(plane);
        length(&mut self.central.closing_error);
        for chart in &mut self.charts.charts {
            chart
                .faces
                .iter_mut()
                .flat_map(|f| &mut f.uv)
                .for_each(plane);
        }
        for transition in &mut self.charts.transitions {
            motion(&mut transition.motion);
            length(&mut transition.residual);
        }
        for gluing in &mut self.charts.gluings {
            motion(&mut gluing.motion);
            length(&mut gluing.residual);
        }
        // Coordinates of a block are cells, whatever the units.
        let has_units = |patch: &Patch| patch.domain == Domain::Flat;
        let units: Vec<bool> = self.patches.patches.iter().map(has_units).collect();
        let side = |patch: PatchId, p: &mut [f64; 2]| {
            if units[patch.index()] {
                plane(p);
            }
        };
        let of_face = self.patches.face_patch.iter();
        for (&patch, uv) in of_face.zip(self.patches.uv.as_mut_slice()) {
            uv.iter_mut().for_each(|p| side(patch, p));
        }
        for patch in self
            .patches
            .patches
            .iter_mut()
            .filter(|patch| has_units(patch))
        {
            patch.texel_to_patch.iter_mut().flatten().for_each(length);
            patch.packed_scale /= frame.length(1.0);
            if let Some(to_chart) = &mut patch.to_chart {
                to_chart.translation = frame.plane(to_chart.translation);
            }
        }
        for seam in &mut self.patches.seams {
            for sample in &mut seam.samples {
                sample.position = frame.leave(sample.position);
                side(seam.left, &mut sample.left);
                side(seam.right.unwrap_or(seam.left), &mut sample.right);
            }
        }
        let one = |x: &mut f32| *x = frame.length(f64::from(*x)) as f32;
        let texels = self.images.iter_mut().flat_map(|image| &mut image.position);
        texels.flatten().for_each(one);
        if let Some(met) = &mut self.metric.quarter_turns {
            let features = met.lines.iter_mut().chain(&mut met.given_up);
            features.for_each(|feature| length(&mut feature.length));
        }
        length(&mut self.connectivity_repair.hausdorff);
        length(&mut self.quality.layout_closing_error);
        length(&mut self.quality.cut_length);
        self.quality.image_hausdorff.iter_mut().for_each(length);
        if let Some(grid) = &mut self.grid {
            length(&mut grid.cell_size);
            let points = grid.points.iter_mut();
            points.for_each(|p| *p = frame.leave(*p));
        }
        if let Some(distance) = &mut self.image_distance {
            distance.as_mut_slice().iter_mut().for_each(length);
        }
        self
    }
}
