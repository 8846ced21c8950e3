//! Readers of mesh files: what is read, and what is refused with which words.

mod corpus;
mod formats;
mod gltf;
mod mutation;
