//! Geometry images and the packed surface.

use super::builder::{PATCH_ROTATION, PATCH_SCALE};
use super::plane::area;
use super::{Arrays, P2, Picture};
use exr::prelude::Compression;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Barycentric coordinates.
pub fn weights(t: [P2; 3], p: P2) -> [f64; 3] {
    let whole = area(t);
    [
        area([p, t[1], t[2]]) / whole,
        area([t[0], p, t[2]]) / whole,
        area([t[0], t[1], p]) / whole,
    ]
}

/// The image of a patch with about `side` texels along its longer side, and its record in `atlas.json`.
pub fn picture(arrays: &Arrays, id: u32, side: usize) -> (Picture, Value) {
    let own: Vec<usize> = (0..arrays.faces.len())
        .filter(|f| arrays.patch[*f] == id)
        .collect();
    let points = || own.iter().flat_map(|f| arrays.patch_uv[*f]);
    let low = [0, 1].map(|i| points().map(|p| p[i]).fold(f64::MAX, f64::min));
    let high = [0, 1].map(|i| points().map(|p| p[i]).fold(f64::MIN, f64::max));
    let step = (high[0] - low[0]).max(high[1] - low[1]) / (side as f64 - 4.0);
    let [width, height] = [0, 1].map(|i| ((high[i] - low[i]) / step).ceil() as usize + 4);
    // Two texels of margin and a little more, so that no texel lies on a border by symmetry.
    let matrix = [
        [step, 0.0, low[0] - 2.03 * step],
        [0.0, -step, high[1] + 2.07 * step],
    ];
    let mut covered: Vec<(usize, usize, usize, [f64; 3])> = Vec::new();
    for row in 0..height {
        for column in 0..width {
            let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
            let p = [0, 1].map(|i| matrix[i][0] * x + matrix[i][1] * y + matrix[i][2]);
            let hit = own.iter().find_map(|f| {
                let w = weights(arrays.patch_uv[*f], p);
                w.iter().all(|w| *w >= -1e-12).then_some((*f, w))
            });
            if let Some((f, w)) = hit {
                covered.push((column, row, f, w));
            }
        }
    }
    let mut floats: BTreeMap<String, Vec<f32>> = BTreeMap::new();
    let names = [
        "R",
        "G",
        "B",
        "A",
        "normal.X",
        "normal.Y",
        "normal.Z",
        "surface.logScale",
    ];
    let mut face = Vec::new();
    for row in 0..height {
        for column in 0..width {
            let nearest = covered
                .iter()
                .min_by_key(|c| c.0.abs_diff(column).pow(2) + c.1.abs_diff(row).pow(2))
                .expect("a covered texel");
            let (c, r, f, w) = *nearest;
            let corners = arrays.faces[f];
            let mix = |value: &dyn Fn(u32) -> f64| -> f32 {
                (0..3).map(|k| w[k] * value(corners[k])).sum::<f64>() as f32
            };
            let inside = (c, r) == (column, row);
            let values = [
                mix(&|v| arrays.positions[v as usize][0]),
                mix(&|v| arrays.positions[v as usize][1]),
                mix(&|v| arrays.positions[v as usize][2]),
                if inside { 1.0 } else { 0.0 },
                0.0,
                0.0,
                1.0,
                mix(&|v| arrays.log_scale[v as usize]),
            ];
            for (name, value) in names.iter().zip(values) {
                floats.entry((*name).to_owned()).or_default().push(value);
            }
            face.push(f as u32);
        }
    }
    let image = format!("images/{id:04}.exr");
    let text = json!({"version": 1, "asset": "fixture", "patch": id, "texel_to_patch": matrix,
                      "source_blake3": "abc", "config_blake3": "", "image_origin": [0.0, 0.0, 0.0]});
    let record = json!({"id": id, "image": image, "domain": "flat", "width": width,
                        "height": height, "texel_to_patch": matrix,
                        "patch_to_chart": {"scale": PATCH_SCALE, "rotation": PATCH_ROTATION,
                                           "translation": [0.0, 0.0]}});
    let picture = Picture {
        width,
        height,
        floats,
        face,
        text: text.to_string(),
        compression: Compression::ZIP16,
    };
    (picture, record)
}

/// One vertex a corner, patch coordinates fitted into the unit square.
pub fn glb(arrays: &Arrays) -> Vec<u8> {
    let points: Vec<P2> = arrays.patch_uv.iter().flatten().copied().collect();
    let low = [0, 1].map(|i| points.iter().map(|p| p[i]).fold(f64::MAX, f64::min));
    let high = [0, 1].map(|i| points.iter().map(|p| p[i]).fold(f64::MIN, f64::max));
    let side = (high[0] - low[0]).max(high[1] - low[1]) * 1.01;
    let mut binary = Vec::new();
    for v in arrays.faces.iter().flatten() {
        for x in arrays.positions[*v as usize] {
            binary.extend((x as f32).to_le_bytes());
        }
    }
    let split = binary.len();
    for p in points {
        for i in 0..2 {
            binary.extend((((p[i] - low[i]) / side) as f32).to_le_bytes());
        }
    }
    let count = 3 * arrays.faces.len();
    let root = json!({
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": count, "type": "VEC2"}],
        "bufferViews": [
            {"buffer": 0, "byteLength": split},
            {"buffer": 0, "byteOffset": split, "byteLength": binary.len() - split}],
        "buffers": [{"byteLength": binary.len()}],
    });
    let mut json = root.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend(((28 + json.len() + binary.len()) as u32).to_le_bytes());
    bytes.extend((json.len() as u32).to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    bytes
}
