//! The folder of spline surfaces.

use super::{FitAssetError, FittedAsset, FittedComponent};
use crate::export::fit::{control_mesh, page};
use crate::export::folder::{Contents, Staging};
use crate::export::glb::plain;
use crate::export::pictures::encode_png;
use crate::export::step::Body;
use crate::export::usd::ControlMesh;
use crate::export::{EncodeError, ExportError, gismo, step, usd};
use crate::spline::Spline;
use crate::spline::tessellation::Tessellation;
use std::io::{self, Write};
use std::path::Path;

/// File of the figures, and the page.
const FIGURES: &str = "fit.json";
const PAGE: &str = "fit.html";
/// Coordinates that are larger than the surface by so many times are written relative to its middle.
const FAR: f64 = 4.0;

impl FittedAsset {
    /// Writes the folder `root/name`: for each component NAME.cage.obj, NAME.usda, NAME.step (but for cavities, which are in that of their solid), NAME.xml, NAME.glb and NAME.zebra.png;
    /// fit.json and fit.html. It appears complete or not at all.
    ///
    /// # Errors
    /// Those of the file system, and a folder there that this did not write.
    pub fn write(&self, root: &Path, name: &str) -> Result<(), FitAssetError> {
        let staging = Staging::begin_with(Contents::Fit, root, name)?;
        let mut pictures = Vec::new();
        for index in 0..self.components.len() {
            pictures.push(self.component(index, &staging)?);
        }
        let document = self.document();
        let html = page::text(name, &document, &pictures);
        staging.write(PAGE, html.as_bytes())?;
        let json = serde_json::to_string_pretty(&document).map_err(io::Error::from);
        let json = json.map_err(|error| EncodeError::Io(error).at(FIGURES.as_ref()))?;
        staging.write(FIGURES, format!("{json}\n").as_bytes())?;
        staging.publish()?;
        Ok(())
    }

    /// The files of a component; gives that of its picture, where there is one.
    fn component(&self, index: usize, staging: &Staging) -> Result<Option<String>, ExportError> {
        let FittedComponent {
            name,
            void_of,
            spline,
            faces,
            patches,
            ..
        } = &self.components[index];
        let cage = &spline.cage;
        let file = |extension: &str, text: &dyn Fn(&mut dyn Write) -> io::Result<()>| {
            let mut file = staging.create(&format!("{name}.{extension}"))?;
            text(&mut file).map_err(|error| EncodeError::Io(error).at(file.path()))?;
            file.finish()
        };
        file("cage.obj", &|mut out| control_mesh(spline, &mut out))?;
        let corners = (0..cage.vertices as u32).filter(|&v| cage.is_corner[v as usize]);
        let corners: Vec<u32> = corners.collect();
        let mesh = ControlMesh {
            name: name.clone(),
            points: &spline.control,
            faces: &cage.cells,
            creases: cage.chains(),
            corners: &corners,
        };
        let unit = self.params.unit;
        file("usda", &|mut out| {
            usd::write(std::slice::from_ref(&mesh), unit.metres(), &mut out)
        })?;
        if void_of.is_none() {
            let voids = self.components.iter();
            let voids = voids.filter(|c| c.void_of == Some(index));
            let body = Body {
                name,
                shell: &faces.shell,
                voids: voids.map(|c| &c.faces.shell).collect(),
            };
            file("step", &|mut out| {
                step::write(std::slice::from_ref(&body), unit, &mut out)
            })?;
        }
        file("xml", &|mut out| gismo::write(patches, &mut out))?;
        let triangles = spline.tessellation();
        staging.write(&format!("{name}.glb"), &glb(name, spline, &triangles)?)?;
        let Some(picture) = page::zebra(spline, triangles) else {
            return Ok(None);
        };
        let path = format!("{name}.zebra.png");
        let png = encode_png(&picture).map_err(|error| ExportError::Encode {
            path: staging.target().join(&path),
            message: error.to_string(),
        })?;
        staging.write(&path, &png)?;
        Ok(Some(path))
    }
}

/// The surface as triangles with normals.
fn glb(name: &str, spline: &Spline, triangles: &Tessellation) -> Result<Vec<u8>, ExportError> {
    let (low, high) = crate::geometry::mesh::bounding_box(&triangles.points);
    let reach = low
        .iter()
        .chain(&high)
        .fold(0.0f64, |most, x| most.max(x.abs()));
    let origin = match reach > FAR * spline.diagonal {
        true => [0, 1, 2].map(|i| f64::from(((low[i] + high[i]) / 2.0) as f32)),
        false => [0.0; 3],
    };
    let vertices = triangles.vertices.iter();
    let positions: Vec<[f64; 3]> = vertices
        .map(|&(p, _)| triangles.points[p as usize])
        .collect();
    let normals = triangles.vertices.iter().map(|(_, n)| n.map(|x| x as f32));
    let normals: Vec<[f32; 3]> = normals.collect();
    plain::encode(&[plain::Component {
        name,
        positions: &positions,
        normals: Some(&normals),
        faces: &triangles.smooth_faces,
        origin,
    }])
}
