//! What the files of an atlas say about the input and the configuration.

use crate::geometry::mesh::{Appearance, Part};
use std::path::Path;

/// Where an atlas comes from: everything that its files say about the input and the configuration.
#[derive(Clone, Copy, Debug)]
pub struct Provenance<'a> {
    /// Path of the input file as the user gave it. Of an absolute path only the file name is written.
    pub path: &'a str,
    /// BLAKE3 hash of the input (with everything it refers to), hexadecimal.
    pub blake3: &'a str,
    /// BLAKE3 hash of the effective configuration, hexadecimal.
    pub config_blake3: &'a str,
    /// Which component of the input this is, from 0.
    pub component: usize,
    /// How many components the input has.
    pub components: usize,
    /// Where the parts of the input begin in the running count of vertices and faces.
    pub parts: &'a [Part],
    /// Materials and textures of the input.
    pub appearance: &'a Appearance,
    /// Name of the asset.
    pub asset: &'a str,
}

impl Provenance<'_> {
    /// The path that goes into files: as given, with forward slashes, or the file name alone
    /// where an absolute path would tell about the machine.
    pub fn public_path(&self) -> String {
        let slashes = self.path.replace('\\', "/");
        let drive = slashes.as_bytes().get(1) == Some(&b':');
        if slashes.starts_with('/') || drive || Path::new(self.path).is_absolute() {
            let name = slashes.rsplit('/').next().unwrap_or_default();
            return name.to_owned();
        }
        slashes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sample;

    #[test]
    fn absolute_paths_stay_out_of_files() {
        let appearance = Appearance::default();
        let mut provenance = sample::provenance(&appearance);
        for (given, public) in [
            ("models/a.obj", "models/a.obj"),
            ("../a.obj", "../a.obj"),
            ("/home/someone/a.obj", "a.obj"),
            ("C:\\models\\a.obj", "a.obj"),
            ("\\\\server\\share\\a.obj", "a.obj"),
        ] {
            provenance.path = given;
            assert_eq!(provenance.public_path(), public);
        }
    }
}
