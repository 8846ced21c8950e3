//! Unpacking of `EXT_meshopt_compression` and `KHR_meshopt_compression` (glTF extension specifications,
//! appendix A: bitstream, appendix B: filters). Written from the specifications, with every read checked.
//!
//! Three bitstreams: `ATTRIBUTES` (bytes of consecutive elements as packed differences), `TRIANGLES` (one
//! code byte a triangle over queues of recent edges and vertices) and `INDICES` (differences to one of two
//! baselines); then a filter on attributes. What an encoder may not write is refused, not guessed.

mod filters;

use crate::read::error::MeshoptError;
use filters::{half, set_half};

/// Elements a group of packed differences.
const GROUP: usize = 16;

/// Bytes with a position.
struct Input<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Input<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], MeshoptError> {
        let taken = self.bytes.get(self.at..self.at + count);
        let taken = taken.ok_or(MeshoptError::Truncated {
            needed: self.at + count,
            available: self.bytes.len(),
        })?;
        self.at += count;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, MeshoptError> {
        Ok(self.take(1)?[0])
    }

    /// LEB128: seven bits a byte, lowest first, at most five bytes.
    fn varint(&mut self) -> Result<u32, MeshoptError> {
        let mut value = 0u32;
        for k in 0..5 {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7f) << (7 * k);
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err(MeshoptError::Code(self.at))
    }

    fn finish(&self) -> Result<(), MeshoptError> {
        match self.bytes.len() - self.at {
            0 => Ok(()),
            left => Err(MeshoptError::Trailing(left)),
        }
    }
}

/// How many bytes `count` elements of `stride` unpack to, after checking that `packed` bytes can hold them.
///
/// Called before anything is set aside for the result.
pub fn unpacked_size(
    mode: &str,
    stride: u64,
    count: u64,
    packed: usize,
) -> Result<usize, MeshoptError> {
    let layout = MeshoptError::Layout { stride, count };
    let minimum = match mode {
        "ATTRIBUTES" if stride > 0 && stride.is_multiple_of(4) && stride <= 256 => {
            // At least one control byte for four bytes of a block.
            let blocks = count.div_ceil(block_elements(stride as usize) as u64);
            blocks.checked_mul(stride / 4).map(|b| b + 1 + stride)
        }
        "TRIANGLES" if matches!(stride, 2 | 4) && count.is_multiple_of(3) => Some(count / 3 + 17),
        "INDICES" if matches!(stride, 2 | 4) => count.checked_add(5),
        "ATTRIBUTES" | "TRIANGLES" | "INDICES" => return Err(layout),
        _ => return Err(MeshoptError::Mode),
    };
    let minimum = minimum
        .and_then(|m| usize::try_from(m).ok())
        .ok_or(layout)?;
    if packed < minimum {
        return Err(MeshoptError::Truncated {
            needed: minimum,
            available: packed,
        });
    }
    let size = count.checked_mul(stride);
    size.and_then(|s| usize::try_from(s).ok()).ok_or(layout)
}

/// Unpacks a buffer view. The caller has asked [`unpacked_size`] first.
pub fn unpack(
    packed: &[u8],
    mode: &str,
    filter: &str,
    stride: u64,
    count: u64,
) -> Result<Vec<u8>, MeshoptError> {
    let size = unpacked_size(mode, stride, count, packed.len())?;
    let layout = MeshoptError::Layout { stride, count };
    let stride = stride as usize;
    let mut bytes = match mode {
        "ATTRIBUTES" => attributes(packed, stride, size / stride)?,
        "TRIANGLES" if filter == "NONE" => {
            indices_as_bytes(&triangles(packed, size / stride)?, stride)
        }
        "INDICES" if filter == "NONE" => {
            indices_as_bytes(&sequence(packed, size / stride)?, stride)
        }
        _ => return Err(layout),
    };
    filters::apply(&mut bytes, filter, stride, layout)?;
    Ok(bytes)
}

/// Elements a block: at most 8 KiB and 256 elements, a multiple of 16.
fn block_elements(stride: usize) -> usize {
    (8192 / stride / GROUP * GROUP).min(256)
}

fn attributes(packed: &[u8], stride: usize, count: usize) -> Result<Vec<u8>, MeshoptError> {
    let channels = stride / 4;
    let (first_version, tail, padded) = match packed.first() {
        Some(0xa0) => (true, stride, stride.max(32)),
        Some(0xa1) => (false, stride + channels, (stride + channels).max(24)),
        other => return Err(MeshoptError::Header(other.copied().unwrap_or(0))),
    };
    let Some(end) = packed.len().checked_sub(padded).filter(|&end| end >= 1) else {
        return Err(MeshoptError::Truncated {
            needed: 1 + padded,
            available: packed.len(),
        });
    };
    let tail = &packed[packed.len() - tail..];
    let mut previous = tail[..stride].to_vec();
    let zero_modes = vec![0; channels];
    let modes = if first_version {
        &zero_modes[..]
    } else {
        &tail[stride..]
    };
    if let Some(bad) = modes
        .iter()
        .position(|m| m & 15 > 2 || (m & 15 < 2 && m >> 4 > 0))
    {
        return Err(MeshoptError::Code(packed.len() - channels + bad));
    }
    let mut input = Input {
        bytes: &packed[..end],
        at: 1,
    };
    let mut elements = vec![0; count * stride];
    let mut columns = vec![0u8; 256 * stride];
    for block in elements.chunks_mut(block_elements(stride) * stride) {
        let n = block.len() / stride;
        let controls = if first_version {
            &[][..]
        } else {
            input.take(channels)?
        };
        for (k, column) in columns.chunks_exact_mut(256).enumerate() {
            let control = controls.get(k / 4).map(|c| c >> (2 * (k % 4)) & 3);
            let widths = match control {
                None => [0, 2, 4, 8],
                Some(0) => [0, 1, 2, 4],
                Some(1) => [1, 2, 4, 8],
                Some(2) => {
                    column[..n].fill(0);
                    continue;
                }
                _ => {
                    column[..n].copy_from_slice(input.take(n)?);
                    continue;
                }
            };
            let groups = n.div_ceil(GROUP);
            let header = input.take(groups.div_ceil(4))?;
            for (g, group) in column.chunks_exact_mut(GROUP).take(groups).enumerate() {
                let width = widths[usize::from(header[g / 4] >> (2 * (g % 4)) & 3)];
                differences(&mut input, width, group)?;
            }
        }
        for (i, element) in block.chunks_exact_mut(stride).enumerate() {
            for (c, mode) in modes.iter().enumerate() {
                let at = 4 * c..4 * c + 4;
                let d = [0, 1, 2, 3].map(|k| columns[256 * (4 * c + k) + i]);
                let before = &previous[at.clone()];
                let before = [before[0], before[1], before[2], before[3]];
                element[at].copy_from_slice(&advance(before, d, *mode));
            }
            previous.copy_from_slice(element);
        }
    }
    input.finish()?;
    Ok(elements)
}

/// Sixteen differences of `width` bits; all ones mean that the difference follows as a whole byte.
fn differences(input: &mut Input, width: usize, group: &mut [u8]) -> Result<(), MeshoptError> {
    match width {
        0 => group.fill(0),
        8 => group.copy_from_slice(input.take(GROUP)?),
        _ => {
            let packed = input.take(2 * width)?;
            let each = 8 / width;
            let all_ones = (1u8 << width) - 1;
            for (i, value) in group.iter_mut().enumerate() {
                // Single bits are packed from the low end, the others from the high end.
                let slot = if width == 1 {
                    i % each
                } else {
                    each - 1 - i % each
                };
                let bits = packed[i / each] >> (width * slot) & all_ones;
                *value = if bits == all_ones {
                    input.byte()?
                } else {
                    bits
                };
            }
        }
    }
    Ok(())
}

/// The next four bytes of a channel from those before.
fn advance(before: [u8; 4], d: [u8; 4], mode: u8) -> [u8; 4] {
    match mode & 15 {
        0 => {
            std::array::from_fn(|k| before[k].wrapping_add((d[k] >> 1) ^ (d[k] & 1).wrapping_neg()))
        }
        1 => {
            let mut after = [0; 4];
            for k in [0, 1] {
                let v = half(&d, k);
                let next = half(&before, k).wrapping_add((v >> 1) ^ (v & 1).wrapping_neg());
                set_half(&mut after, k, next);
            }
            after
        }
        _ => {
            // The encoder turned to the left.
            let turned = u32::from_le_bytes(d).rotate_right(u32::from(mode >> 4));
            (u32::from_le_bytes(before) ^ turned).to_le_bytes()
        }
    }
}

fn indices_as_bytes(indices: &[u32], stride: usize) -> Vec<u8> {
    let bytes = |i: &u32| i.to_le_bytes().into_iter().take(stride);
    indices.iter().flat_map(bytes).collect()
}

fn zigzag(v: u32) -> u32 {
    (v >> 1) ^ (v & 1).wrapping_neg()
}

/// Sixteen entries, the newest first. Reading one that was never written is an error.
struct Queue<T> {
    entries: [Option<T>; 16],
    next: usize,
}

impl<T: Copy> Queue<T> {
    fn new() -> Self {
        Self {
            entries: [None; 16],
            next: 0,
        }
    }

    fn push(&mut self, entry: T) {
        self.entries[self.next] = Some(entry);
        self.next = (self.next + 1) % 16;
    }

    fn get(&self, back: u8) -> Option<T> {
        self.entries[(self.next + 15 - usize::from(back & 15)) % 16]
    }
}

struct Triangles<'a> {
    data: Input<'a>,
    edges: Queue<[u32; 2]>,
    vertices: Queue<u32>,
    next: u32,
    last: u32,
}

impl Triangles<'_> {
    fn next(&mut self) -> u32 {
        let next = self.next;
        self.next = next.wrapping_add(1);
        next
    }

    fn explicit(&mut self) -> Result<u32, MeshoptError> {
        self.last = self.last.wrapping_add(zigzag(self.data.varint()?));
        Ok(self.last)
    }

    /// A vertex by its nibble: 0 a new one, 15 an explicit one, else a recent one. True where it is to be queued.
    fn vertex(&mut self, nibble: u8) -> Result<(u32, bool), MeshoptError> {
        match nibble {
            0 => Ok((self.next(), true)),
            15 => Ok((self.explicit()?, true)),
            back => {
                let vertex = self.vertices.get(back - 1);
                Ok((vertex.ok_or(MeshoptError::Code(self.data.at))?, false))
            }
        }
    }

    /// A triangle across a recent edge.
    fn across(&mut self, back: u8, how: u8) -> Result<[u32; 3], MeshoptError> {
        let undefined = MeshoptError::Code(self.data.at);
        let [a, b] = self.edges.get(back).ok_or(undefined)?;
        let (c, queue) = match how {
            0 => (self.next(), true),
            1..=12 => (self.vertices.get(how).ok_or(undefined)?, false),
            13 | 14 => {
                let step = if how == 13 { u32::MAX } else { 1 };
                self.last = self.last.wrapping_add(step);
                (self.last, true)
            }
            _ => (self.explicit()?, true),
        };
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        if queue {
            self.vertices.push(c);
        }
        Ok([a, b, c])
    }

    /// A triangle that shares no recent edge.
    fn apart(&mut self, first: u8, pair: u8) -> Result<[u32; 3], MeshoptError> {
        let (a, _) = self.vertex(first)?;
        let (b, queue_b) = self.vertex(pair >> 4)?;
        let (c, queue_c) = self.vertex(pair & 15)?;
        for edge in [[b, a], [c, b], [a, c]] {
            self.edges.push(edge);
        }
        self.vertices.push(a);
        if queue_b {
            self.vertices.push(b);
        }
        if queue_c {
            self.vertices.push(c);
        }
        Ok([a, b, c])
    }
}

fn triangles(packed: &[u8], count: usize) -> Result<Vec<u32>, MeshoptError> {
    let count = count / 3;
    if packed[0] != 0xe1 {
        return Err(MeshoptError::Header(packed[0]));
    }
    let end = packed.len() - 16;
    let (codes, table) = (&packed[1..1 + count], &packed[end..]);
    let fifteen = |b: &u8| b >> 4 == 15 || b & 15 == 15;
    if table.iter().any(fifteen) || table[14..] != [0, 0] {
        return Err(MeshoptError::Code(end));
    }
    let mut state = Triangles {
        data: Input {
            bytes: &packed[..end],
            at: 1 + count,
        },
        edges: Queue::new(),
        vertices: Queue::new(),
        next: 0,
        last: 0,
    };
    let mut indices = Vec::with_capacity(3 * count);
    for &code in codes {
        let triangle = match (code >> 4, code & 15) {
            (15, how @ 14..) => {
                let pair = state.data.byte()?;
                if pair == 0 {
                    state.next = 0;
                }
                state.apart(if how == 14 { 0 } else { 15 }, pair)?
            }
            (15, entry) => state.apart(0, table[usize::from(entry)])?,
            (edge, how) => state.across(edge, how)?,
        };
        indices.extend(triangle);
    }
    state.data.finish()?;
    Ok(indices)
}

fn sequence(packed: &[u8], count: usize) -> Result<Vec<u32>, MeshoptError> {
    if packed[0] != 0xd1 {
        return Err(MeshoptError::Header(packed[0]));
    }
    let mut input = Input {
        bytes: &packed[..packed.len() - 4],
        at: 1,
    };
    let mut last = [0u32; 2];
    let mut indices = Vec::with_capacity(count);
    for _ in 0..count {
        let v = input.varint()?;
        let last = &mut last[(v & 1) as usize];
        *last = last.wrapping_add(zigzag(v >> 1));
        indices.push(*last);
    }
    input.finish()?;
    Ok(indices)
}

#[cfg(test)]
mod tests;
