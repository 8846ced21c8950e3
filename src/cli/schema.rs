//! `affine-atlas schema`.

use super::arguments::{Schema, SchemaOf};
use super::problem::Problem;
use super::{exit, terminal};
use affine_atlas::schema;

/// Prints a schema.
pub fn run(asked: &Schema) -> Result<u8, Problem> {
    let schema = match asked.of {
        SchemaOf::Atlas => schema::atlas(),
        SchemaOf::Components => schema::components(),
        SchemaOf::Manifest => schema::manifest(),
        SchemaOf::Config => schema::config(),
        SchemaOf::Plan => schema::plan(),
        SchemaOf::Fit => schema::fit(),
    };
    terminal::print(&format!("{schema:#}\n"));
    Ok(exit::GOOD)
}
