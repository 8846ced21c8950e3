//! GLB: a header, a JSON chunk and a binary chunk (glTF 2.0, chapter 4).

use crate::read::error::ReadProblem;

const JSON: u32 = 0x4E4F_534A;
const BINARY: u32 = 0x004E_4942;

/// JSON and binary chunk of a GLB file, or the whole file as JSON where it is none.
pub fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), ReadProblem> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let truncated = |what, needed: u64| ReadProblem::Truncated {
        what,
        unit: "bytes",
        needed,
        available: bytes.len() as u64,
    };
    let word = |at: usize| {
        let b = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(truncated("the GLB header", 12));
    };
    if version != 2 {
        return Err(ReadProblem::GltfVersion {
            version: version.to_string(),
        });
    }
    if length as usize > bytes.len() {
        return Err(truncated("the GLB file", u64::from(length)));
    }
    let mut at = 12;
    let mut json = None;
    let mut binary = None;
    // The header's length is an upper bound; what follows it belongs to nobody.
    while at + 8 <= length as usize {
        let (Some(size), Some(kind)) = (word(at), word(at + 4)) else {
            break;
        };
        let start = at + 8;
        let end = start as u64 + u64::from(size);
        if end > u64::from(length) {
            return Err(truncated("a GLB chunk", end));
        }
        let chunk = &bytes[start..end as usize];
        match kind {
            JSON if json.is_none() => json = Some(chunk),
            BINARY if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        at = end as usize;
    }
    let json = json.ok_or(truncated("the GLB JSON chunk", at as u64 + 8))?;
    Ok((json, binary))
}
