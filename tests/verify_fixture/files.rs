//! The files of an asset's folder, byte by byte or through their crates.

use super::{Arrays, Atlas, P2, Picture};
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Encoding, FlatSamples, Image, Layer,
    LayerAttributes, LineOrder, SmallVec, Text, WritableImage,
};
use std::io::Write;
use std::path::Path;

/// An array as NumPy writes it: type name, shape, little-endian bytes.
pub struct Npy {
    pub name: &'static str,
    pub descr: &'static str,
    pub shape: Vec<usize>,
    pub bytes: Vec<u8>,
}

impl Npy {
    /// The bytes of its `.npy`.
    pub fn file(&self) -> Vec<u8> {
        let shape: Vec<String> = self.shape.iter().map(|n| format!("{n},")).collect();
        let mut header = format!(
            "{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}",
            self.descr,
            shape.join(" ")
        );
        while (header.len() + 11) % 64 != 0 {
            header.push(' ');
        }
        header.push('\n');
        let mut file = b"\x93NUMPY\x01\0".to_vec();
        file.extend((header.len() as u16).to_le_bytes());
        file.extend(header.into_bytes());
        file.extend(&self.bytes);
        file
    }
}

impl Arrays {
    pub fn npy(&self) -> Vec<Npy> {
        fn doubles<'a>(values: impl Iterator<Item = &'a f64>) -> Vec<u8> {
            values.flat_map(|x| x.to_le_bytes()).collect()
        }
        fn words<'a>(values: impl Iterator<Item = &'a u32>) -> Vec<u8> {
            values.flat_map(|x| x.to_le_bytes()).collect()
        }
        let (f8, u4, u1) = ("<f8", "<u4", "|u1");
        let (v, f, n) = (
            self.positions.len(),
            self.faces.len(),
            self.chart_face.len(),
        );
        let (s, m) = (self.seam_patch.len(), self.seam_position.len());
        let corners = |rows: &Vec<[P2; 3]>| doubles(rows.as_flattened().as_flattened().iter());
        let row = |name, descr, shape: &[usize], bytes| Npy {
            name,
            descr,
            shape: shape.to_vec(),
            bytes,
        };
        vec![
            row(
                "positions",
                f8,
                &[v, 3],
                doubles(self.positions.as_flattened().iter()),
            ),
            row(
                "faces",
                u4,
                &[f, 3],
                words(self.faces.as_flattened().iter()),
            ),
            row("source_face", u4, &[f], words(self.source_face.iter())),
            row("source_vertex", u4, &[v], words(self.source_vertex.iter())),
            row("log_scale", f8, &[v], doubles(self.log_scale.iter())),
            row(
                "target_curvature",
                f8,
                &[v],
                doubles(self.target_curvature.iter()),
            ),
            row(
                "flat_length",
                f8,
                &[f, 3],
                doubles(self.flat_length.as_flattened().iter()),
            ),
            row("central_uv", f8, &[f, 3, 2], corners(&self.central_uv)),
            row("cut", u1, &[f, 3], self.cut.concat()),
            row(
                "segment",
                u4,
                &[f, 3],
                words(self.segment.as_flattened().iter()),
            ),
            row(
                "chart_offset",
                u4,
                &[self.chart_offset.len()],
                words(self.chart_offset.iter()),
            ),
            row("chart_face", u4, &[n], words(self.chart_face.iter())),
            row("chart_sector", u1, &[n], self.chart_sector.clone()),
            row("chart_uv", f8, &[n, 3, 2], corners(&self.chart_uv)),
            row("patch", u4, &[f], words(self.patch.iter())),
            row("patch_uv", f8, &[f, 3, 2], corners(&self.patch_uv)),
            row(
                "seam_offset",
                u4,
                &[self.seam_offset.len()],
                words(self.seam_offset.iter()),
            ),
            row(
                "seam_position",
                f8,
                &[m, 3],
                doubles(self.seam_position.as_flattened().iter()),
            ),
            row(
                "seam_uv",
                f8,
                &[m, 2, 2],
                doubles(self.seam_uv.as_flattened().as_flattened().iter()),
            ),
            row(
                "seam_patch",
                u4,
                &[s, 2],
                words(self.seam_patch.as_flattened().iter()),
            ),
        ]
    }
}

/// Writes `atlas.npz`.
pub fn write_npz(path: &Path, arrays: &[Npy]) {
    let file = std::fs::File::create(path).expect("a file");
    let mut zip = zip::ZipWriter::new(file);
    let options = zip::write::SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Deflated);
    for array in arrays {
        zip.start_file(format!("{}.npy", array.name), options)
            .expect("an entry");
        zip.write_all(&array.file()).expect("written");
    }
    zip.finish().expect("a whole container");
}

pub fn write_picture(path: &Path, picture: &Picture) {
    let mut list: SmallVec<[AnyChannel<FlatSamples>; 4]> = SmallVec::new();
    for (name, values) in &picture.floats {
        list.push(AnyChannel::new(
            name.as_str(),
            FlatSamples::F32(values.clone()),
        ));
    }
    list.push(AnyChannel::new(
        "surface.face",
        FlatSamples::U32(picture.face.clone()),
    ));
    let mut attributes = LayerAttributes::default();
    if !picture.text.is_empty() {
        attributes.other.insert(
            Text::from("affineAtlas"),
            AttributeValue::Text(Text::from(picture.text.as_str())),
        );
    }
    let encoding = Encoding {
        compression: picture.compression,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = (picture.width, picture.height);
    let layer = Layer::new(size, attributes, encoding, AnyChannels::sort(list));
    Image::from_layer(layer)
        .write()
        .to_file(path)
        .expect("written");
}

impl Atlas {
    pub fn write(&self, folder: &Path) {
        let images = folder.join("images");
        std::fs::create_dir_all(&images).expect("a folder");
        std::fs::write(folder.join("atlas.json"), self.json.to_string()).expect("written");
        write_npz(&folder.join("atlas.npz"), &self.arrays.npy());
        for (id, picture) in self.pictures.iter().enumerate() {
            write_picture(&images.join(format!("{id:04}.exr")), picture);
        }
        std::fs::write(folder.join("surface.glb"), &self.glb).expect("written");
    }
}
