//! Seeded damage to valid files: bytes changed, cut out, repeated, numbers replaced by extreme ones.

use affine_atlas::read::{ReadParams, read_bytes};
use std::path::Path;

/// xorshift64*: the same damage on every machine.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize % bound.max(1)
    }
}

const EXTREMES: [&str; 12] = [
    "0",
    "-1",
    "1",
    "255",
    "65536",
    "2147483648",
    "4294967295",
    "18446744073709551615",
    "1e999",
    "nan",
    "9e18",
    "",
];

fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len());
    match random.below(8) {
        0 => bytes.truncate(at),
        1 => {
            let end = (at + random.below(40)).min(bytes.len());
            bytes.drain(at..end);
        }
        2 => {
            let end = (at + random.below(40)).min(bytes.len());
            let copy = bytes[at..end].to_vec();
            let to = random.below(bytes.len());
            bytes.splice(to..to, copy);
        }
        3 => {
            // The next run of digits becomes something else.
            let digits = |b: &u8| b.is_ascii_digit();
            let Some(start) = bytes[at..].iter().position(digits) else {
                return;
            };
            let start = at + start;
            let length = bytes[start..].iter().take_while(|b| digits(b)).count();
            let new = EXTREMES[random.below(EXTREMES.len())];
            bytes.splice(start..start + length, new.bytes());
        }
        4 => {
            let extreme = [0, 0x7f, 0x80, 0xff][random.below(4)];
            let end = (at + 1 + random.below(4)).min(bytes.len());
            bytes[at..end].fill(extreme);
        }
        _ => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte = random.below(256) as u8;
            }
        }
    }
}

/// Largest resident memory of this process so far, in KiB, where the system tells.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// Reads a file `rounds` times, each time damaged in one to four places. A panic fails the test, and so does
/// a soup that breaks its promises, or much memory.
pub fn survive(name: &str, whole: &[u8], rounds: usize) {
    let params = ReadParams {
        max_vertices: 100_000,
        max_faces: 100_000,
        max_file_bytes: 4 << 20,
    };
    assert!(
        read_bytes(Path::new(name), whole, &params).is_ok(),
        "{name}"
    );
    let before = peak_memory();
    let mut random = Random(0x9E37_79B9_7F4A_7C15 ^ whole.len() as u64);
    let (mut good, mut refused) = (0, 0);
    for _ in 0..rounds {
        let mut bytes = whole.to_vec();
        for _ in 0..1 + random.below(4) {
            damage(&mut bytes, &mut random);
        }
        match read_bytes(Path::new(name), &bytes, &params) {
            Ok(asset) => {
                let soup = &asset.soup;
                let count = soup.positions.len();
                assert!(!soup.faces.is_empty() && soup.faces.len() as u64 <= params.max_faces);
                assert!(count as u64 <= params.max_vertices);
                assert!(soup.faces.iter().flatten().all(|&v| (v as usize) < count));
                assert!(soup.positions.iter().flatten().all(|x| x.is_finite()));
                assert_eq!(soup.face_material.len(), soup.faces.len());
                for attribute in &soup.attributes {
                    assert_eq!(
                        attribute.values.len(),
                        3 * soup.faces.len() * attribute.components
                    );
                    assert!(attribute.values.iter().all(|x| !x.is_infinite()));
                }
                good += 1;
            }
            Err(error) => {
                let message = error.to_string();
                assert!(
                    message.starts_with(name) && message.len() < 600,
                    "{message}"
                );
                assert!(!message.contains(|c: char| c.is_control()), "{message:?}");
                refused += 1;
            }
        }
    }
    println!("{name}: {good} read, {refused} refused");
    assert!(good > 0 && refused > 0);
    if let (Some(before), Some(after)) = (before, peak_memory()) {
        // The kernel batches its counts a core, so the high-water mark may read a little lower the second time.
        let more = after.saturating_sub(before);
        assert!(more < 256 * 1024, "{name}: {more} KiB more");
    }
}
