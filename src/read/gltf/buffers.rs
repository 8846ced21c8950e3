//! Buffers and buffer views: from URIs, the GLB chunk or compressed data to checked byte ranges.

use super::meshopt;
use super::schema::{BufferView, Meshopt, Root};
use super::uri;
use crate::read::budget::Budget;
use crate::read::error::ReadProblem;
use crate::read::folder::Folder;
use std::rc::Rc;

/// The bytes of a buffer.
#[derive(Clone)]
pub enum Data<'a> {
    /// Part of the main file.
    Chunk(&'a [u8]),
    /// A file or a data URI.
    Loaded(Rc<Vec<u8>>),
}

impl Data<'_> {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Chunk(bytes) => bytes,
            Self::Loaded(bytes) => bytes,
        }
    }
}

/// All buffers and the views that were compressed.
pub struct Buffers<'a> {
    root: &'a Root,
    buffers: Vec<Option<Data<'a>>>,
    unpacked: Vec<Option<Vec<u8>>>,
}

/// Looks an index up.
pub fn lookup<'r, T>(
    list: &'r [T],
    index: usize,
    what: &'static str,
    from: impl Fn() -> String,
) -> Result<&'r T, ReadProblem> {
    list.get(index)
        .ok_or_else(|| ReadProblem::MissingReference {
            from: from(),
            what,
            index,
            count: list.len(),
        })
}

/// `offset + length` bytes of something, if it has them.
pub fn range(
    bytes: &[u8],
    offset: u64,
    length: u64,
    what: impl Fn() -> String,
    container: impl Fn() -> String,
) -> Result<&[u8], ReadProblem> {
    let needed = offset.saturating_add(length);
    if needed > bytes.len() as u64 {
        return Err(ReadProblem::OutOfBounds {
            what: what(),
            needed,
            container: container(),
            available: bytes.len() as u64,
        });
    }
    Ok(&bytes[offset as usize..needed as usize])
}

/// A data URI, or a file in the asset's folder.
pub fn load_uri(
    uri: &str,
    folder: &mut Folder,
    budget: &mut Budget,
) -> Result<Rc<Vec<u8>>, ReadProblem> {
    match uri::data(uri) {
        Some(bytes) => Ok(Rc::new(bytes?)),
        None => folder.referenced(uri, &uri::relative_path(uri)?, budget),
    }
}

impl<'a> Buffers<'a> {
    /// Loads every buffer and unpacks every compressed view.
    pub fn load(
        root: &'a Root,
        binary: Option<&'a [u8]>,
        folder: &mut Folder,
        budget: &mut Budget,
    ) -> Result<Self, ReadProblem> {
        let mut buffers = Vec::with_capacity(root.buffers.len());
        for (i, buffer) in root.buffers.iter().enumerate() {
            let extensions = &buffer.extensions;
            let data = match (&buffer.uri, i, binary) {
                _ if extensions.ext_meshopt.fallback || extensions.khr_meshopt.fallback => None,
                (Some(uri), ..) => Some(Data::Loaded(load_uri(uri, folder, budget)?)),
                (None, 0, Some(binary)) => Some(Data::Chunk(binary)),
                // Legal where all its views are compressed; refused where it is used.
                _ => None,
            };
            if let Some(data) = &data {
                let what = || format!("buffer {i}");
                range(data.bytes(), 0, buffer.byte_length, what, || {
                    "its file".into()
                })?;
            }
            buffers.push(data);
        }
        let mut all = Self {
            root,
            buffers,
            unpacked: Vec::new(),
        };
        for (i, view) in root.buffer_views.iter().enumerate() {
            let packed = view.extensions.khr_meshopt.as_ref();
            let packed = packed.or(view.extensions.ext_meshopt.as_ref());
            let unpacked = packed.map(|p| all.unpack(i, view, p, budget)).transpose()?;
            all.unpacked.push(unpacked);
        }
        Ok(all)
    }

    fn buffer(&self, index: usize, from: impl Fn() -> String) -> Result<&[u8], ReadProblem> {
        let data = lookup(&self.buffers, index, "buffer", from)?;
        let data = data
            .as_ref()
            .ok_or(ReadProblem::BufferWithoutData { buffer: index })?;
        // `load` has checked that there are so many.
        Ok(&data.bytes()[..self.root.buffers[index].byte_length as usize])
    }

    fn unpack(
        &self,
        index: usize,
        view: &BufferView,
        packed: &Meshopt,
        budget: &mut Budget,
    ) -> Result<Vec<u8>, ReadProblem> {
        let what = || format!("buffer view {index}");
        let buffer = self.buffer(packed.buffer, what)?;
        let container = || format!("buffer {}", packed.buffer);
        let bytes = range(
            buffer,
            packed.byte_offset,
            packed.byte_length,
            what,
            container,
        )?;
        let failed = |reason| ReadProblem::Meshopt {
            view: index,
            reason,
        };
        let (mode, stride, count) = (packed.mode.as_str(), packed.byte_stride, packed.count);
        let size = meshopt::unpacked_size(mode, stride, count, bytes.len()).map_err(failed)? as u64;
        if size != view.byte_length {
            let view = view.byte_length;
            return Err(failed(crate::read::error::MeshoptError::Size {
                unpacked: size,
                view,
            }));
        }
        budget.unpack(size, what)?;
        let filter = packed.filter.as_deref().unwrap_or("NONE");
        meshopt::unpack(bytes, mode, filter, stride, count).map_err(failed)
    }

    /// The bytes of a view.
    pub fn view(&self, index: usize, from: impl Fn() -> String) -> Result<&[u8], ReadProblem> {
        let view = lookup(&self.root.buffer_views, index, "buffer view", from)?;
        if let Some(unpacked) = &self.unpacked[index] {
            return Ok(unpacked);
        }
        let what = || format!("buffer view {index}");
        let buffer = self.buffer(view.buffer, what)?;
        let container = || format!("buffer {}", view.buffer);
        range(buffer, view.byte_offset, view.byte_length, what, container)
    }
}
