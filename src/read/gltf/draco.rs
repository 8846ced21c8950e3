//! `KHR_draco_mesh_compression`: one primitive as one Draco stream, unpacked by the crate `draco-core`.

mod declared;

use super::schema::Draco;
use crate::read::budget::Budget;
use crate::read::error::{Place, ReadProblem, shorten};
use declared::Declared;
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

/// Bytes that the decoder holds for a triangle: its corners, a table of corners and opposites, and the traversal.
const TRIANGLE_BYTES: u64 = 48;
/// The same for every attribute that has seams of its own.
const SEAM_BYTES: u64 = 32;
/// Copies of the values of an attribute that the decoder holds at a time, in bytes a byte of the smallest type.
const COPIES: u64 = 8;

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

/// Unpacks a stream to at most `points` and `faces`; what it declares is checked against these and charged before it is decoded.
pub fn unpack(
    bytes: &[u8],
    points: u64,
    faces: u64,
    budget: &mut Budget,
    place: Place,
) -> Result<Unpacked, ReadProblem> {
    let refused = |what: &str, count: u64, limit: u64| ReadProblem::Draco {
        place,
        reason: format!("it declares {count} {what} where at most {limit} may follow"),
    };
    let declared = Declared::of(bytes).unwrap_or_default();
    if declared.points > points {
        return Err(refused("points", declared.points, points));
    }
    if declared.faces > faces {
        return Err(refused("triangles", declared.faces, faces));
    }
    // Every instance unpacks it again.
    let what = || format!("the Draco data of {place}");
    let each = TRIANGLE_BYTES + SEAM_BYTES * u64::from(declared.seams);
    budget.unpack(declared.faces.saturating_mul(each), what)?;
    budget.unpack(bytes.len() as u64, what)?;
    let limits = DecodeLimits::default()
        .with_max_points(points)
        .with_max_faces(declared.faces)
        .with_max_decoded_bytes(budget.left() / COPIES);
    let unpacked = guarded(place, || {
        let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
        let mut mesh = Mesh::new();
        MeshDecoder::new().decode(&mut buffer, &mut mesh)?;
        Ok(Unpacked {
            triangles: mesh.faces().iter().map(|f| f.map(|p| p.0)).collect(),
            points: mesh.num_points(),
            mesh,
            place,
        })
    })?;
    // Seams split points, so that there may be more than were declared.
    match unpacked.points as u64 > points {
        true => Err(refused("points", unpacked.points as u64, points)),
        false => Ok(unpacked),
    }
}

impl Unpacked {
    /// The numbers of an attribute, `components` a point, as stored; `None` where the stream lacks it.
    pub fn attribute(
        &self,
        draco: &Draco,
        name: &str,
        components: usize,
        budget: &mut Budget,
    ) -> Result<Option<Vec<f64>>, ReadProblem> {
        let Some(&id) = draco.attributes.get(name) else {
            return Ok(None);
        };
        let bytes = (12 * components as u64).saturating_mul(self.points as u64);
        budget.unpack(bytes, || {
            format!(
                "the Draco attribute {} of {}",
                shorten(name.as_bytes()),
                self.place
            )
        })?;
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
