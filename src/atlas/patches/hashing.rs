//! Hash sets and maps for small whole numbers made here: ids and grid cells.
//!
//! The standard hasher is proof against keys chosen to collide and costs more than all else that is done with a triangle.
//! Nothing may depend on the order of these collections.

use std::hash::{BuildHasherDefault, Hasher};

/// A map from ids or cells.
pub(super) type Map<K, V> = std::collections::HashMap<K, V, BuildHasherDefault<Mixer>>;
/// A set of ids or cells.
pub(super) type Set<K> = std::collections::HashSet<K, BuildHasherDefault<Mixer>>;

/// Folds the two halves of a 128-bit product after each word.
#[derive(Default)]
pub(super) struct Mixer(u64);

impl Mixer {
    #[inline]
    fn mix(&mut self, word: u64) {
        // 2^64 over the golden ratio: an odd number without pattern.
        let product = u128::from(self.0 ^ word ^ 0x5851_F42D_4C95_7F2D) * 0x9E37_79B9_7F4A_7C15;
        self.0 = (product as u64) ^ ((product >> 64) as u64);
    }
}

impl Hasher for Mixer {
    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.mix(u64::from_le_bytes(word));
        }
    }
    #[inline]
    fn write_u32(&mut self, word: u32) {
        self.mix(u64::from(word));
    }
    #[inline]
    fn write_i32(&mut self, word: i32) {
        self.mix(word as u64);
    }
    #[inline]
    fn write_u64(&mut self, word: u64) {
        self.mix(word);
    }
    #[inline]
    fn write_i64(&mut self, word: i64) {
        self.mix(word as u64);
    }
    #[inline]
    fn write_usize(&mut self, word: usize) {
        self.mix(word as u64);
    }
    fn finish(&self) -> u64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hash::BuildHasher;

    #[test]
    fn neighbouring_cells_spread_over_the_buckets() {
        let hasher = BuildHasherDefault::<Mixer>::default();
        // Tables take the low bits for the place and the high ones to tell keys apart.
        let mut low = vec![0; 4096];
        let mut high = vec![0; 128];
        for x in -128i64..128 {
            for y in -128i64..128 {
                let hash = hasher.hash_one((-3i32, x, y));
                low[(hash % 4096) as usize] += 1;
                high[(hash >> 57) as usize] += 1;
            }
        }
        // 16 and 512 expected; a random spread leaves ten standard deviations hardly ever.
        assert!(low.iter().all(|&n| n < 56), "{:?}", low.iter().max());
        assert!(high.iter().all(|&n| (286..738).contains(&n)), "{high:?}");
    }
}
