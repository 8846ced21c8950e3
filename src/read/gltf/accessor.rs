//! Accessors: typed values from buffer views (glTF 2.0, 3.6.2), sparse ones and those without a view included.

use super::buffers::{Buffers, lookup, range};
use super::schema::{Accessor, Root};
use crate::read::budget::Budget;
use crate::read::error::{ReadProblem, shorten};

/// Type of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn bytes(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    fn read(self, b: &[u8]) -> f64 {
        match self {
            Self::I8 => f64::from(b[0] as i8),
            Self::U8 => f64::from(b[0]),
            Self::I16 => f64::from(i16::from_le_bytes([b[0], b[1]])),
            Self::U16 => f64::from(u16::from_le_bytes([b[0], b[1]])),
            Self::U32 => f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Self::F32 => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        }
    }

    /// A normalised integer as a number from −1 or 0 to 1.
    pub fn normalize(self, value: f64) -> f64 {
        match self {
            Self::I8 => (value / 127.0).max(-1.0),
            Self::U8 => value / 255.0,
            Self::I16 => (value / 32767.0).max(-1.0),
            Self::U16 => value / 65535.0,
            Self::U32 => value / f64::from(u32::MAX),
            Self::F32 => value,
        }
    }
}

/// An accessor that has been looked up.
#[derive(Clone, Copy)]
pub struct Values<'a> {
    /// Index.
    pub index: usize,
    /// What its JSON says.
    pub accessor: &'a Accessor,
    /// Type of one number.
    pub component: Component,
    /// Numbers a value.
    pub components: usize,
}

impl<'a> Values<'a> {
    /// Looks an accessor up by what refers to it.
    pub fn of(root: &'a Root, index: usize, from: &str) -> Result<Self, ReadProblem> {
        let accessor = lookup(&root.accessors, index, "accessor", || from.to_owned())?;
        let components = match accessor.kind.as_str() {
            "SCALAR" => Some(1),
            "VEC2" => Some(2),
            "VEC3" => Some(3),
            "VEC4" => Some(4),
            // Matrices have padded columns, and nothing that is read here is one.
            "MAT2" | "MAT3" | "MAT4" => Some(0),
            _ => None,
        };
        match (Component::of(accessor.component_type), components) {
            (Some(component), Some(components)) => Ok(Self {
                index,
                accessor,
                component,
                components,
            }),
            _ => Err(ReadProblem::AccessorType {
                name: from.to_owned(),
                accessor: index,
                found: format!(
                    "{} of type {}",
                    shorten(accessor.kind.as_bytes()),
                    accessor.component_type
                ),
                expected: "a type of glTF 2.0",
            }),
        }
    }

    /// An error unless `fits`.
    pub fn require(
        &self,
        fits: bool,
        name: &str,
        expected: &'static str,
    ) -> Result<(), ReadProblem> {
        match fits {
            true => Ok(()),
            false => Err(ReadProblem::AccessorType {
                name: name.to_owned(),
                accessor: self.index,
                found: format!("{} of {:?}", self.accessor.kind, self.component),
                expected,
            }),
        }
    }

    /// All numbers, `components` a value; integers are as stored unless `normalized`.
    ///
    /// Charged each time that it is read.
    pub fn read(
        &self,
        buffers: &Buffers,
        root: &Root,
        normalized: bool,
        budget: &mut Budget,
    ) -> Result<Vec<f64>, ReadProblem> {
        let Self {
            index,
            accessor,
            component,
            components,
        } = *self;
        let what = || format!("accessor {index}");
        let size = component.bytes() * components as u64;
        let number = |b: &[u8]| {
            let value = component.read(b);
            if normalized {
                component.normalize(value)
            } else {
                value
            }
        };
        let mut charge = || {
            let bytes = accessor.count.saturating_mul(8 * components as u64);
            budget.unpack(bytes, || format!("reading accessor {index}"))
        };
        let mut numbers = Vec::new();
        if let (Some(view), false) = (accessor.buffer_view, size == 0 || accessor.count == 0) {
            let bytes = buffers.view(view, what)?;
            let stride = root.buffer_views[view].byte_stride.unwrap_or(size);
            self.require(
                stride >= size,
                "its own buffer view",
                "a byteStride as long as a value",
            )?;
            let length = stride
                .saturating_mul(accessor.count - 1)
                .saturating_add(size);
            let container = || format!("buffer view {view}");
            let bytes = range(bytes, accessor.byte_offset, length, what, container)?;
            charge()?;
            numbers.reserve_exact(accessor.count as usize * components);
            for value in bytes.chunks(stride as usize) {
                let value = value[..size as usize].chunks_exact(component.bytes() as usize);
                numbers.extend(value.map(number));
            }
        } else {
            charge()?;
            numbers.resize(accessor.count as usize * components, 0.0);
        }
        let Some(sparse) = &accessor.sparse else {
            return Ok(numbers);
        };
        if sparse.count > accessor.count {
            return Err(ReadProblem::SparseIndex {
                accessor: index,
                what: "a number of values of",
                index: sparse.count,
                count: accessor.count,
            });
        }
        let index_type = Component::of(sparse.indices.component_type);
        let index_type =
            index_type.filter(|t| matches!(t, Component::U8 | Component::U16 | Component::U32));
        let Some(index_type) = index_type else {
            return Err(ReadProblem::AccessorType {
                name: "its sparse part".into(),
                accessor: index,
                found: format!("indexed by type {}", sparse.indices.component_type),
                expected: "an unsigned integer",
            });
        };
        let part = |view: usize, offset: u64, each: u64| {
            let bytes = buffers.view(view, what)?;
            let container = || format!("buffer view {view}");
            range(
                bytes,
                offset,
                sparse.count.saturating_mul(each),
                what,
                container,
            )
        };
        let (at, values) = (&sparse.indices, &sparse.values);
        let at = part(at.buffer_view, at.byte_offset, index_type.bytes())?;
        let values = part(values.buffer_view, values.byte_offset, size)?;
        if size == 0 {
            return Ok(numbers);
        }
        let places = at.chunks_exact(index_type.bytes() as usize);
        for (place, value) in places.zip(values.chunks_exact(size as usize)) {
            let place = index_type.read(place) as u64;
            if place >= accessor.count {
                return Err(ReadProblem::SparseIndex {
                    accessor: index,
                    what: "value",
                    index: place,
                    count: accessor.count,
                });
            }
            let row = place as usize * components;
            let value = value.chunks_exact(component.bytes() as usize).map(number);
            for (slot, new) in numbers[row..row + components].iter_mut().zip(value) {
                *slot = new;
            }
        }
        Ok(numbers)
    }
}
