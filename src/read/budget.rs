//! How many bytes reading one asset may take: of its files, and of what they unpack to.
//!
//! Formats can say much in few bytes: an accessor without data stands for zeros, one accessor may be read by thousands of attributes, and
//! compressed data unpack to a thousand times their size. Everything that is decoded is charged here *before* memory is set aside for it,
//! each time that it is decoded, so that memory and time stay in proportion to the files.

use super::bounded::unpacked_limit;
use super::error::ReadProblem;

/// Bytes that any mesh may unpack to, however small its files are: a million triangles with their attributes.
const FLOOR: u64 = 128 << 20;

/// What has been counted so far, and the limits.
pub(super) struct Budget {
    files: u64,
    unpacked: u64,
    max_file_bytes: u64,
}

impl Budget {
    /// Nothing counted yet.
    pub fn new(max_file_bytes: u64) -> Self {
        Self {
            files: 0,
            unpacked: 0,
            max_file_bytes,
        }
    }

    /// Counts bytes of a file that is about to be read.
    pub fn read(&mut self, bytes: u64, what: impl Fn() -> String) -> Result<(), ReadProblem> {
        self.files = self.files.saturating_add(bytes);
        self.check_total(what)
    }

    /// Counts bytes that something is about to unpack to.
    pub fn unpack(&mut self, bytes: u64, what: impl Fn() -> String) -> Result<(), ReadProblem> {
        self.unpacked = self.unpacked.saturating_add(bytes);
        let limit = unpacked_limit(FLOOR, self.files);
        if self.unpacked > limit {
            return Err(ReadProblem::TooMuchUnpacked {
                what: what(),
                bytes: self.unpacked,
                limit,
                files: self.files,
            });
        }
        self.check_total(what)
    }

    /// Bytes that may still be unpacked.
    pub fn left(&self) -> u64 {
        let total = self.files.saturating_add(self.unpacked);
        let below_total = self.max_file_bytes.saturating_sub(total);
        below_total.min(unpacked_limit(FLOOR, self.files).saturating_sub(self.unpacked))
    }

    fn check_total(&self, what: impl Fn() -> String) -> Result<(), ReadProblem> {
        let bytes = self.files.saturating_add(self.unpacked);
        if bytes > self.max_file_bytes {
            return Err(ReadProblem::TooManyBytes {
                what: what(),
                bytes,
                limit: self.max_file_bytes,
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_unpacks_is_in_proportion_to_the_files() {
        let mut budget = Budget::new(u64::MAX);
        let what = || "accessor 7".to_owned();
        let floor = unpacked_limit(FLOOR, 0);
        budget.unpack(floor, what).unwrap();
        let message = budget.unpack(1, what).unwrap_err().to_string();
        assert!(message.contains("accessor 7"), "{message}");
        assert!(message.contains(&format!("{}", floor + 1)), "{message}");
        budget.read(10, what).unwrap();
        let more = unpacked_limit(FLOOR, 10) - floor;
        assert_eq!(more, 2560);
        assert_eq!(budget.left(), more - 1);
        budget.unpack(more - 1, what).unwrap();
        assert!(budget.unpack(1, what).is_err());
    }

    #[test]
    fn both_count_against_the_limit_in_all() {
        let mut budget = Budget::new(100);
        let what = || "a file".to_owned();
        budget.read(60, what).unwrap();
        budget.unpack(40, what).unwrap();
        assert_eq!(budget.left(), 0);
        assert!(matches!(
            budget.unpack(1, what),
            Err(ReadProblem::TooManyBytes {
                bytes: 101,
                limit: 100,
                ..
            })
        ));
        assert!(budget.read(u64::MAX, what).is_err());
    }
}
