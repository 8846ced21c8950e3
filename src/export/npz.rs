//! `atlas.npz`: all arrays in full precision, a zip archive of NumPy arrays.
//!
//! Entries carry the fixed date 1980-01-01 and stand in the order of the contract, so equal atlases
//! give equal bytes. Element types and shapes are those of the format: `<f8`, `<u4` and `|u1`, C order.

use crate::atlas::charts::ChartFace;
use crate::export::EncodeError;
use crate::flow::prescription::BoundaryCondition;
use crate::geometry::ids::{EdgeId, FaceId, NONE, PatchId};
use crate::parallel;
use crate::product::AffineAtlas;
use std::io::{BufWriter, Cursor, Seek, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

/// Compressed bytes collected before they go on; entries are written value by value.
const BUFFER_BYTES: usize = 1 << 16;

/// Coordinates hardly compress: on 360,000 faces level 1 gave 25 % more bytes, and levels above this one
/// gave less than 1 % fewer, for up to several times the time where data is regular.
const COMPRESSION_LEVEL: i64 = 2;

/// From this size on an entry gets 64-bit lengths. Below the 32-bit limit, because deflate may enlarge.
const LARGE_ENTRY_BYTES: u64 = 0xF000_0000;

/// Magic string and version of a `.npy` file.
const NPY_START: [u8; 8] = *b"\x93NUMPY\x01\x00";

/// Smaller arrays are not compressed: to begin with that takes longer than to write them.
const SMALL_ENTRY_BYTES: u64 = 4096;

/// Part of the archive in memory.
type Part = Archive<Cursor<Vec<u8>>>;

/// Writes the archive, whose parts are compressed side by side. Expects [`super::check_shapes`] to hold.
pub fn write<W: Write + Seek>(atlas: &AffineAtlas, writer: W) -> Result<(), EncodeError> {
    let sections = [surface, central_chart, charts, patches, seams, grid];
    let parts = parallel::map(&sections, |_, section| {
        let mut part = Archive {
            zip: ZipWriter::new(Cursor::new(Vec::new())),
        };
        section(atlas, &mut part)?;
        part.zip.finish().map_err(zip_error)
    });
    let mut zip = ZipWriter::new(writer);
    for part in parts {
        let part = ZipArchive::new(part?).map_err(zip_error)?;
        zip.merge_archive(part).map_err(zip_error)?;
    }
    let mut writer = zip.finish().map_err(zip_error)?;
    writer.flush()?;
    Ok(())
}

fn surface(atlas: &AffineAtlas, archive: &mut Part) -> Result<(), EncodeError> {
    let mesh = &atlas.mesh;
    let connectivity = &mesh.connectivity;
    let (v, f) = (connectivity.vertex_count(), connectivity.face_count());
    let positions = mesh.positions.iter().flatten().copied();
    archive.finite("positions", &[v, 3], positions)?;
    let corners = connectivity.halfedges().map(|h| connectivity.tail(h).raw());
    archive.array("faces", &[f, 3], corners)?;
    archive.array("source_face", &[f], mesh.source_face.iter().copied())?;
    archive.array("source_vertex", &[v], mesh.source_vertex.iter().copied())?;
    archive.finite("log_scale", &[v], atlas.metric.log_scale.iter().copied())?;
    // On a free boundary nothing was prescribed: the file states what was reached.
    let free = atlas.prescription.boundary == BoundaryCondition::Free;
    let curvature = connectivity.vertices().map(|v| {
        if free && connectivity.is_boundary_vertex(v) {
            atlas.metric.curvature[v]
        } else {
            atlas.prescription.target[v]
        }
    });
    archive.finite("target_curvature", &[v], curvature)
}

fn central_chart(atlas: &AffineAtlas, archive: &mut Part) -> Result<(), EncodeError> {
    let f = atlas.mesh.connectivity.face_count();
    let lengths = opposite_edges(atlas).map(|e| atlas.metric.length[e]);
    archive.finite("flat_length", &[f, 3], lengths)?;
    let uv = atlas.central.uv.iter().flatten().flatten().copied();
    archive.finite("central_uv", &[f, 3, 2], uv)?;
    let cut = opposite_edges(atlas).map(|e| u8::from(atlas.cut.is_cut[e]));
    archive.array("cut", &[f, 3], cut)?;
    let segment = opposite_edges(atlas).map(|e| {
        if atlas.cut.is_cut[e] {
            atlas.cut.segment[e]
        } else {
            NONE
        }
    });
    archive.array("segment", &[f, 3], segment)
}

/// The edge opposite every corner, in order of corners.
fn opposite_edges(atlas: &AffineAtlas) -> impl Iterator<Item = EdgeId> + '_ {
    let connectivity = &atlas.mesh.connectivity;
    connectivity
        .faces()
        .flat_map(|f: FaceId| connectivity.face_edges(f))
}

fn charts(atlas: &AffineAtlas, archive: &mut Part) -> Result<(), EncodeError> {
    let charts = &atlas.charts.charts;
    let offset = offsets(charts.iter().map(|c| c.faces.len()))?;
    let n = charts.iter().map(|c| c.faces.len()).sum();
    let entries = || charts.iter().flat_map(|c| &c.faces);
    archive.array("chart_offset", &[offset.len()], offset.into_iter())?;
    archive.array("chart_face", &[n], entries().map(|c| c.face.raw()))?;
    archive.array("chart_sector", &[n], entries().map(|c| c.sector))?;
    let uv = entries().flat_map(|c: &ChartFace| c.uv).flatten();
    archive.finite("chart_uv", &[n, 3, 2], uv)
}

fn patches(atlas: &AffineAtlas, archive: &mut Part) -> Result<(), EncodeError> {
    let layout = &atlas.patches;
    let f = layout.face_patch.len();
    let patch = layout.face_patch.iter().map(|p| p.raw());
    archive.array("patch", &[f], patch)?;
    let uv = layout.uv.iter().flatten().flatten().copied();
    archive.finite("patch_uv", &[f, 3, 2], uv)
}

fn seams(atlas: &AffineAtlas, archive: &mut Part) -> Result<(), EncodeError> {
    let seams = &atlas.patches.seams;
    let offset = offsets(seams.iter().map(|s| s.samples.len()))?;
    let m = seams.iter().map(|s| s.samples.len()).sum();
    let samples = || {
        seams
            .iter()
            .flat_map(|s| s.samples.iter().map(move |p| (s, p)))
    };
    archive.array("seam_offset", &[offset.len()], offset.into_iter())?;
    let position = samples().flat_map(|(_, p)| p.position);
    archive.finite("seam_position", &[m, 3], position)?;
    for (i, (seam, p)) in samples().enumerate() {
        let given = p
            .left
            .iter()
            .chain(&p.right)
            .take(if seam.right.is_some() { 4 } else { 2 });
        if given.into_iter().any(|x| !x.is_finite()) {
            return Err(EncodeError::NotFinite(format!("seam_uv[{i}]")));
        }
    }
    // Beyond a surface boundary there is no right side, whatever the sample says.
    let uv = samples().flat_map(|(seam, p)| {
        let right = seam.right.map_or([f64::NAN; 2], |_| p.right);
        [p.left, right].into_iter().flatten()
    });
    archive.array("seam_uv", &[m, 2, 2], uv)?;
    let sides = seams
        .iter()
        .flat_map(|s| [s.left.raw(), s.right.map_or(NONE, PatchId::raw)]);
    archive.array("seam_patch", &[seams.len(), 2], sides)
}

fn grid(atlas: &AffineAtlas, archive: &mut Part) -> Result<(), EncodeError> {
    let Some(grid) = &atlas.grid else {
        return Ok(());
    };
    let f = grid.uv.len();
    let uv = grid.uv.iter().flatten().flatten().copied();
    archive.finite("grid_uv", &[f, 3, 2], uv)?;
    let turns = grid.turns.iter().flatten().copied();
    archive.array("grid_turns", &[f, 3], turns)?;
    let shift = grid.shift.iter().flatten().flatten().copied();
    archive.array("grid_shift", &[f, 3, 2], shift)?;
    let points = grid.points.iter().flatten().copied();
    archive.finite("quad_positions", &[grid.points.len(), 3], points)?;
    let cells = grid.cells_in_blocks();
    let n = cells.len();
    let corners = cells.iter().flat_map(|cell| cell.corners);
    archive.array("quads", &[n, 4], corners)?;
    archive.array("quad_patch", &[n], cells.iter().map(|cell| cell.block))?;
    archive.array("quad_cell", &[n, 2], cells.iter().flat_map(|cell| cell.at))
}

/// Running sums, from 0, one more than there are counts.
fn offsets(counts: impl Iterator<Item = usize>) -> Result<Vec<u32>, EncodeError> {
    let mut offset = vec![0u32];
    let mut sum = 0usize;
    for count in counts {
        sum += count;
        let fits = u32::try_from(sum);
        offset.push(
            fits.map_err(|_| EncodeError::Format(format!("{sum} entries exceed 32-bit offsets")))?,
        );
    }
    Ok(offset)
}

/// The zip archive that is being written.
struct Archive<W: Write + Seek> {
    zip: ZipWriter<W>,
}

impl<W: Write + Seek> Archive<W> {
    /// Writes an array whose numbers must be finite.
    fn finite(
        &mut self,
        name: &str,
        shape: &[usize],
        values: impl Iterator<Item = f64>,
    ) -> Result<(), EncodeError> {
        let mut first_bad = None;
        let values = values.enumerate().map(|(i, x)| {
            if !x.is_finite() && first_bad.is_none() {
                first_bad = Some(i);
            }
            x
        });
        self.array(name, shape, values)?;
        match first_bad {
            // The row says which vertex, face or entry.
            Some(i) => {
                let row = i / shape[1..].iter().product::<usize>().max(1);
                Err(EncodeError::NotFinite(format!("atlas.npz {name}[{row}]")))
            }
            None => Ok(()),
        }
    }

    /// Writes an array.
    fn array<T: Number>(
        &mut self,
        name: &str,
        shape: &[usize],
        values: impl Iterator<Item = T>,
    ) -> Result<(), EncodeError> {
        let mut buffer = self.start(name, shape, T::DESCR, size_of::<T>())?;
        let mut written = 0;
        for value in values {
            buffer.write_all(value.little_endian().as_ref())?;
            written += 1;
        }
        buffer.flush()?;
        let count: usize = shape.iter().product();
        match written == count {
            true => Ok(()),
            false => Err(EncodeError::Format(format!(
                "atlas.npz {name} has {written} numbers and a shape for {count}"
            ))),
        }
    }

    /// Begins an array of numbers of so many bytes; they follow.
    fn start(
        &mut self,
        name: &str,
        shape: &[usize],
        descr: &str,
        size: usize,
    ) -> Result<BufWriter<&mut ZipWriter<W>>, EncodeError> {
        let count: usize = shape.iter().product();
        let bytes = count as u64 * size as u64;
        let (method, level) = match bytes < SMALL_ENTRY_BYTES {
            true => (CompressionMethod::Stored, None),
            false => (CompressionMethod::Deflated, Some(COMPRESSION_LEVEL)),
        };
        let options = SimpleFileOptions::default()
            .compression_method(method)
            .compression_level(level)
            .last_modified_time(DateTime::default())
            .unix_permissions(0o644)
            .system(zip::System::Unix)
            .large_file(bytes >= LARGE_ENTRY_BYTES);
        self.zip
            .start_file(format!("{name}.npy"), options)
            .map_err(zip_error)?;
        let mut buffer = BufWriter::with_capacity(BUFFER_BYTES, &mut self.zip);
        buffer.write_all(&header(descr, shape))?;
        Ok(buffer)
    }
}

/// A number type of the contract.
trait Number {
    /// NumPy's name for it.
    const DESCR: &'static str;
    /// As the file holds it.
    fn little_endian(self) -> impl AsRef<[u8]>;
}

impl Number for f64 {
    const DESCR: &'static str = "<f8";
    fn little_endian(self) -> impl AsRef<[u8]> {
        self.to_le_bytes()
    }
}

impl Number for i64 {
    const DESCR: &'static str = "<i8";
    fn little_endian(self) -> impl AsRef<[u8]> {
        self.to_le_bytes()
    }
}

impl Number for u32 {
    const DESCR: &'static str = "<u4";
    fn little_endian(self) -> impl AsRef<[u8]> {
        self.to_le_bytes()
    }
}

impl Number for u8 {
    const DESCR: &'static str = "|u1";
    fn little_endian(self) -> impl AsRef<[u8]> {
        [self]
    }
}

/// What precedes the numbers: version 1.0 of NumPy's format, with its text filled up with spaces so that the numbers begin at a multiple
/// of 64 bytes.
fn header(descr: &str, shape: &[usize]) -> Vec<u8> {
    let mut text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (");
    for n in shape {
        text += &format!("{n}, ");
    }
    text += "), }";
    let whole = (NPY_START.len() + 2 + text.len() + 1).next_multiple_of(64);
    let length = whole - NPY_START.len() - 2;
    let mut header = NPY_START.to_vec();
    // At most four dimensions of at most 20 digits: far below the 65,535 bytes that the length holds.
    header.extend((length as u16).to_le_bytes());
    header.extend(text.bytes());
    header.resize(whole - 1, b' ');
    header.push(b'\n');
    header
}

fn zip_error(error: zip::result::ZipError) -> EncodeError {
    match error {
        zip::result::ZipError::Io(source) => EncodeError::Io(source),
        other => EncodeError::Format(other.to_string()),
    }
}

#[cfg(test)]
#[path = "../../tests/arrays/mod.rs"]
mod arrays;

#[cfg(test)]
mod tests {
    use super::arrays::Npy;
    use super::*;
    use crate::export::sample;
    use std::collections::BTreeMap;
    use std::io::{Cursor, Read};

    fn bytes(atlas: &AffineAtlas) -> Vec<u8> {
        let mut cursor = Cursor::new(Vec::new());
        write(atlas, &mut cursor).unwrap();
        cursor.into_inner()
    }

    /// Element type and shape of every array, and its body as 64-bit floats.
    fn read(bytes: Vec<u8>) -> BTreeMap<String, (String, Vec<usize>, Vec<f64>)> {
        let mut zip = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
        let mut arrays = BTreeMap::new();
        for i in 0..zip.len() {
            let mut entry = zip.by_index(i).unwrap();
            let date = entry.last_modified().unwrap();
            assert_eq!((date.year(), date.month(), date.day()), (1980, 1, 1));
            let mut body = Vec::new();
            entry.read_to_end(&mut body).unwrap();
            let npy = Npy::new(&body);
            assert!(!npy.is_fortran);
            let values = match npy.descr.as_str() {
                "<f8" => npy.numbers::<f64>(),
                "<u4" => npy.numbers::<u32>().into_iter().map(f64::from).collect(),
                _ => npy.numbers::<u8>().into_iter().map(f64::from).collect(),
            };
            let (dtype, shape) = (npy.descr, npy.shape);
            let name = entry.name().unwrap().trim_end_matches(".npy").to_owned();
            arrays.insert(name, (dtype, shape, values));
        }
        arrays
    }

    #[test]
    fn arrays_have_the_types_and_shapes_of_the_contract() {
        let atlas = sample::torus(5, 3);
        let arrays = read(bytes(&atlas));
        let (v, f, c, s) = (15, 30, 4, 2);
        let n: usize = atlas.charts.charts.iter().map(|c| c.faces.len()).sum();
        let m: usize = atlas.patches.seams.iter().map(|s| s.samples.len()).sum();
        let expected: [(&str, &str, &[usize]); 20] = [
            ("positions", "<f8", &[v, 3]),
            ("faces", "<u4", &[f, 3]),
            ("source_face", "<u4", &[f]),
            ("source_vertex", "<u4", &[v]),
            ("log_scale", "<f8", &[v]),
            ("target_curvature", "<f8", &[v]),
            ("flat_length", "<f8", &[f, 3]),
            ("central_uv", "<f8", &[f, 3, 2]),
            ("cut", "|u1", &[f, 3]),
            ("segment", "<u4", &[f, 3]),
            ("chart_offset", "<u4", &[c + 1]),
            ("chart_face", "<u4", &[n]),
            ("chart_sector", "|u1", &[n]),
            ("chart_uv", "<f8", &[n, 3, 2]),
            ("patch", "<u4", &[f]),
            ("patch_uv", "<f8", &[f, 3, 2]),
            ("seam_offset", "<u4", &[s + 1]),
            ("seam_position", "<f8", &[m, 3]),
            ("seam_uv", "<f8", &[m, 2, 2]),
            ("seam_patch", "<u4", &[s, 2]),
        ];
        assert_eq!(arrays.len(), expected.len());
        for (name, dtype, shape) in expected {
            let (found_dtype, found_shape, _) = &arrays[name];
            assert_eq!(found_dtype.trim_matches('\''), dtype, "{name}");
            assert_eq!(found_shape, shape, "{name}");
        }
    }

    #[test]
    fn values_follow_the_conventions() {
        let atlas = sample::torus(5, 3);
        let arrays = read(bytes(&atlas));
        let get = |name: &str| &arrays[name].2;
        let faces = get("faces");
        for (corner, length) in get("flat_length").iter().enumerate() {
            // The length opposite corner k is the distance of the two other corners in the chart.
            let uv = |k: usize| {
                let at = 2 * (corner / 3 * 3 + (corner + k) % 3);
                [get("central_uv")[at], get("central_uv")[at + 1]]
            };
            let (k1, k2) = ((corner % 3 + 1) % 3, (corner % 3 + 2) % 3);
            let (a, b) = (uv(k1 + 3 - corner % 3), uv(k2 + 3 - corner % 3));
            assert!(((a[0] - b[0]).hypot(a[1] - b[1]) - length).abs() < 1e-12);
        }
        // The sample is cut along its first row and column: 5 + 3 edges, each on two sides.
        assert_eq!(get("cut").iter().sum::<f64>(), 16.0);
        for (corner, cut) in get("cut").iter().enumerate() {
            let ends = [1, 2].map(|k| faces[corner / 3 * 3 + (corner % 3 + k) % 3] as usize);
            let row = ends.iter().all(|v| v / 5 == 0);
            let column = ends.iter().all(|v| v % 5 == 0);
            assert_eq!(*cut == 1.0, row || column);
            let segment = get("segment")[corner];
            assert_eq!(
                segment,
                if *cut == 0.0 {
                    f64::from(NONE)
                } else {
                    f64::from(u32::from(column))
                }
            );
        }
        assert_eq!(get("chart_offset")[..2], [0.0, 0.0]);
        assert_eq!(*get("seam_offset").last().unwrap(), (6 + 4) as f64);
    }

    #[test]
    fn a_surface_boundary_has_no_right_side() {
        let mut atlas = sample::torus(4, 3);
        atlas.patches.seams[0].right = None;
        let arrays = read(bytes(&atlas));
        assert_eq!(arrays["seam_patch"].2[1], f64::from(NONE));
        let uv = &arrays["seam_uv"].2;
        assert!(uv[2].is_nan() && uv[3].is_nan() && uv[0].is_finite());
    }

    #[test]
    fn a_free_boundary_states_the_achieved_curvature() {
        let mut atlas = sample::cylinder(4, 2);
        atlas.metric.curvature.as_mut_slice()[1] = 0.25;
        assert_eq!(read(bytes(&atlas))["target_curvature"].2[1], 0.25);
        atlas.prescription.boundary = BoundaryCondition::Uniform;
        assert_eq!(read(bytes(&atlas))["target_curvature"].2[1], 0.0);
    }

    #[test]
    fn another_reader_understands_headers() {
        // Digits around the step from 128 to 192 bytes.
        for n in (0..20).map(|i| 10_usize.pow(i) / 2) {
            for shape in [vec![n], vec![n, 3], vec![1, n, 2], vec![1, 1, n, 3]] {
                for descr in ["<f8", "<u4", "|u1"] {
                    let header = header(descr, &shape);
                    let found = Npy::new(&header);
                    assert_eq!((found.descr.as_str(), &found.shape), (descr, &shape));
                    assert!(!found.is_fortran && header.ends_with(b"\n"));
                }
            }
        }
    }

    #[test]
    fn arrays_and_shapes_must_agree() {
        let mut archive = Archive {
            zip: ZipWriter::new(Cursor::new(Vec::new())),
        };
        archive.array("a", &[2, 2], 0..4_u32).unwrap();
        let error = archive.array("b", &[2, 2], 0..3_u32).unwrap_err();
        assert_eq!(
            error.to_string(),
            "atlas.npz b has 3 numbers and a shape for 4"
        );
    }

    #[test]
    fn two_archives_are_equal_byte_by_byte() {
        let atlas = sample::torus(6, 4);
        assert_eq!(bytes(&atlas), bytes(&atlas));
    }

    #[test]
    fn infinite_numbers_are_refused_with_their_row() {
        let mut atlas = sample::torus(4, 3);
        atlas.patches.uv.as_mut_slice()[7][2][1] = f64::INFINITY;
        let error = write(&atlas, Cursor::new(Vec::new())).unwrap_err();
        assert!(matches!(error, EncodeError::NotFinite(place) if place == "atlas.npz patch_uv[7]"));
        let mut atlas = sample::torus(4, 3);
        atlas.patches.seams[1].samples[0].right[0] = f64::NAN;
        assert!(write(&atlas, Cursor::new(Vec::new())).is_err());
    }
}
