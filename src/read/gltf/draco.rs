//! `KHR_draco_mesh_compression`: one primitive as one Draco stream, unpacked by the crate `draco-core`.

use super::schema::Draco;
use crate::read::error::{Place, ReadProblem, shorten};
use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// An unpacked primitive.
pub struct Unpacked {
    /// Points of every triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Number of points.
    pub points: usize,
    mesh: Mesh,
    place: Place,
}

/// What a decode may produce.
pub struct Limits {
    /// Points.
    pub points: u64,
    /// Triangles.
    pub faces: u64,
    /// Bytes of attribute values.
    pub bytes: u64,
}

/// Runs the decoder, and takes a panic inside it for a refusal.
///
/// The crate is written not to panic, but it parses hostile bytes with index arithmetic, and one overlooked
/// index must cost one asset, not a batch. The decoder's state is dropped with the panic, so nothing half-made is seen.
fn guarded<T>(
    place: Place,
    decode: impl FnOnce() -> Result<T, draco_core::DracoError>,
) -> Result<T, ReadProblem> {
    let reason = match catch_unwind(AssertUnwindSafe(decode)) {
        Ok(Ok(value)) => return Ok(value),
        Ok(Err(error)) => error.to_string(),
        Err(_) => "its decoder failed".into(),
    };
    let reason = shorten(reason.as_bytes());
    Err(ReadProblem::Draco { place, reason })
}

/// Unpacks a stream.
pub fn unpack(bytes: &[u8], limits: &Limits, place: Place) -> Result<Unpacked, ReadProblem> {
    let limits = DecodeLimits::default()
        .with_max_points(limits.points)
        .with_max_faces(limits.faces)
        .with_max_decoded_bytes(limits.bytes);
    guarded(place, || {
        let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
        let mut mesh = Mesh::new();
        MeshDecoder::new().decode(&mut buffer, &mut mesh)?;
        Ok(Unpacked {
            triangles: mesh.faces().iter().map(|f| f.map(|p| p.0)).collect(),
            points: mesh.num_points(),
            mesh,
            place,
        })
    })
}

impl Unpacked {
    /// The numbers of an attribute, `components` a point, as stored; `None` where the stream lacks it.
    pub fn attribute(
        &self,
        draco: &Draco,
        name: &str,
        components: usize,
    ) -> Result<Option<Vec<f64>>, ReadProblem> {
        let Some(&id) = draco.attributes.get(name) else {
            return Ok(None);
        };
        let numbers = guarded(self.place, || {
            let attribute = self.mesh.attribute_by_unique_id(id);
            Ok(attribute.map(|a| a.read_f32s(self.points, components)))
        })?;
        let missing = || ReadProblem::Draco {
            place: self.place,
            reason: format!(
                "it holds no attribute {id} for {}",
                shorten(name.as_bytes())
            ),
        };
        let numbers = numbers.ok_or_else(missing)?;
        Ok(Some(numbers.into_iter().map(f64::from).collect()))
    }
}
