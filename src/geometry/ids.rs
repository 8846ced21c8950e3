//! Typed ids, and vectors indexed by them.
//!
//! A vertex id cannot index a face array: the compiler finds the mix-up that plain
//! integers would hide. An id is a `u32`, so a mesh has fewer than 2³² − 1 of anything.

use std::fmt;
use std::marker::PhantomData;
use std::ops::{Index, IndexMut};

/// What stands in file formats where there is no such thing (`2³² − 1`).
pub const NONE: u32 = u32::MAX;

/// An index that knows what it counts.
pub trait Id: Copy + Eq + Ord + fmt::Debug {
    /// The id of the `index`-th thing.
    fn new(index: usize) -> Self;
    /// The position in arrays.
    fn index(self) -> usize;
}

macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {$(
        $(#[$doc])*
        #[derive(Copy, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(u32);

        impl $name {
            /// The id of the `index`-th thing.
            #[inline]
            pub const fn new(index: usize) -> Self {
                Self(index as u32)
            }
            /// The position in arrays.
            #[inline]
            pub const fn index(self) -> usize {
                self.0 as usize
            }
            /// The number that goes into files.
            #[inline]
            pub const fn raw(self) -> u32 {
                self.0
            }
        }

        impl Id for $name {
            #[inline]
            fn new(index: usize) -> Self {
                Self(index as u32)
            }
            #[inline]
            fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, concat!(stringify!($name), "({})"), self.0)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{}", self.0)
            }
        }
    )*};
}

ids! {
    /// A vertex of a mesh: a row of `positions`.
    VertexId,
    /// A directed side of a face. Halfedge `3f + k` runs from corner `k` to corner `k + 1` of face `f`.
    HalfedgeId,
    /// An undirected edge: one halfedge on the boundary, two elsewhere.
    EdgeId,
    /// A triangle: a row of `faces`.
    FaceId,
    /// A segment of the cut graph.
    SegmentId,
    /// A chart of the atlas; 0 is the central chart.
    ChartId,
    /// A patch of the central chart: the domain of one geometry image.
    PatchId,
}

/// A vector indexed by one kind of id.
#[derive(Clone, PartialEq)]
pub struct IdVec<I, T> {
    values: Vec<T>,
    id: PhantomData<fn(I) -> I>,
}

/// One value a vertex.
pub type VertexVec<T> = IdVec<VertexId, T>;
/// One value a halfedge.
pub type HalfedgeVec<T> = IdVec<HalfedgeId, T>;
/// One value an edge.
pub type EdgeVec<T> = IdVec<EdgeId, T>;
/// One value a face.
pub type FaceVec<T> = IdVec<FaceId, T>;

impl<I: Id, T> IdVec<I, T> {
    /// `count` copies of one value.
    pub fn filled(value: T, count: usize) -> Self
    where
        T: Clone,
    {
        vec![value; count].into()
    }

    /// How many values there are.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// True where there is no value.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Appends a value and returns its id.
    pub fn push(&mut self, value: T) -> I {
        self.values.push(value);
        I::new(self.values.len() - 1)
    }

    /// All ids in order.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = I> + use<I, T> {
        (0..self.values.len()).map(I::new)
    }

    /// All values in order.
    pub fn iter(&self) -> std::slice::Iter<'_, T> {
        self.values.iter()
    }

    /// Ids and values in order.
    pub fn enumerate(&self) -> impl ExactSizeIterator<Item = (I, &T)> {
        self.values.iter().enumerate().map(|(i, v)| (I::new(i), v))
    }

    /// The plain slice.
    pub fn as_slice(&self) -> &[T] {
        &self.values
    }

    /// The plain slice, writable.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// The plain vector.
    pub fn into_vec(self) -> Vec<T> {
        self.values
    }
}

impl<I, T> From<Vec<T>> for IdVec<I, T> {
    fn from(values: Vec<T>) -> Self {
        Self {
            values,
            id: PhantomData,
        }
    }
}

impl<I, T> Default for IdVec<I, T> {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl<I: Id, T> FromIterator<T> for IdVec<I, T> {
    fn from_iter<J: IntoIterator<Item = T>>(iter: J) -> Self {
        iter.into_iter().collect::<Vec<_>>().into()
    }
}

impl<I: Id, T> Index<I> for IdVec<I, T> {
    type Output = T;
    #[inline]
    fn index(&self, id: I) -> &T {
        &self.values[id.index()]
    }
}

impl<I: Id, T> IndexMut<I> for IdVec<I, T> {
    #[inline]
    fn index_mut(&mut self, id: I) -> &mut T {
        &mut self.values[id.index()]
    }
}

impl<I, T: fmt::Debug> fmt::Debug for IdVec<I, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(&self.values).finish()
    }
}
