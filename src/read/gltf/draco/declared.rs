//! What a Draco stream of version 2.2 says of its size before its data begin (Draco bitstream specification, sections 3 to 5).

/// Counts in the header of a mesh. Those that a stream does not declare, or that cannot be found, are 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Declared {
    /// Triangles.
    pub faces: u64,
    /// Points; seams may split them further where the triangles are coded by their neighbours.
    pub points: u64,
    /// Attributes that have seams of their own.
    pub seams: u8,
}

/// Metadata may lie inside metadata; nobody writes more levels.
const MAX_LEVELS: usize = 64;

/// Bit of the flags that announces metadata.
const METADATA: u16 = 0x8000;

struct Header<'a>(&'a [u8]);

impl Header<'_> {
    fn skip(&mut self, count: u64) -> Option<()> {
        self.0 = self.0.get(usize::try_from(count).ok()?..)?;
        Some(())
    }

    fn byte(&mut self) -> Option<u8> {
        let (&first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(first)
    }

    /// Seven bits a byte, lowest first.
    fn varint(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(value);
            }
        }
        None
    }

    fn name(&mut self) -> Option<()> {
        let length = self.byte()?;
        self.skip(u64::from(length))
    }

    fn metadata(&mut self, levels: usize) -> Option<()> {
        for _ in 0..self.varint()? {
            self.name()?;
            let length = self.varint()?;
            self.skip(length)?;
        }
        for _ in 0..self.varint()? {
            self.name()?;
            self.metadata(levels.checked_sub(1)?)?;
        }
        Some(())
    }
}

impl Declared {
    /// Of a stream; none where it ends early or is of another version, which the decoder refuses.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        let mut header = Header(bytes.strip_prefix(b"DRACO\x02\x02\x01")?);
        let method = header.byte()?;
        let flags = u16::from_le_bytes([header.byte()?, header.byte()?]);
        if flags & METADATA != 0 {
            for _ in 0..header.varint()? {
                header.varint()?;
                header.metadata(MAX_LEVELS)?;
            }
            header.metadata(MAX_LEVELS)?;
        }
        if method == 0 {
            let (faces, points) = (header.varint()?, header.varint()?);
            return Some(Self {
                faces,
                points,
                seams: 0,
            });
        }
        // The kind of traversal.
        header.byte()?;
        let (points, faces) = (header.varint()?, header.varint()?);
        let seams = header.byte()?;
        Some(Self {
            faces,
            points,
            seams,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_found_behind_metadata() {
        let mesh = |method: u8, flags: u16, rest: &[u8]| {
            let mut bytes = b"DRACO\x02\x02\x01".to_vec();
            bytes.push(method);
            bytes.extend(flags.to_le_bytes());
            bytes.extend(rest);
            bytes
        };
        let sequential = Declared {
            faces: 300,
            points: 5,
            seams: 0,
        };
        assert_eq!(Declared::of(&mesh(0, 0, &[0xac, 2, 5])), Some(sequential));
        let connected = Declared {
            faces: 7,
            points: 5,
            seams: 3,
        };
        assert_eq!(Declared::of(&mesh(1, 0, &[2, 5, 7, 3])), Some(connected));
        // One attribute with an entry `a` = 9, then an object with one child `b` that is empty.
        let metadata = [1, 4, 1, 1, b'a', 1, 9, 0, 0, 1, 1, b'b', 0, 0];
        let whole = mesh(1, METADATA, &[&metadata[..], &[2, 5, 7, 3]].concat());
        assert_eq!(Declared::of(&whole), Some(connected));
        for end in 0..whole.len() {
            assert_eq!(Declared::of(&whole[..end]), None, "{end}");
        }
    }

    #[test]
    fn metadata_inside_metadata_has_an_end() {
        let mut bytes = b"DRACO\x02\x02\x01\x01\0\x80\0".to_vec();
        bytes.extend([0, 1, 0].repeat(100_000));
        assert_eq!(Declared::of(&bytes), None);
    }

    #[test]
    fn a_count_of_2_to_the_64_and_no_end() {
        assert_eq!(
            Declared::of(b"DRACO\x02\x02\x01\0\0\0\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff"),
            None
        );
    }
}
