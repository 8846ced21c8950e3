//! Disjoint sets of small integers (union by lower id, path halving).
//!
//! *Guaranteed:* a set is called by its least member, whatever the order of joins.

/// A partition of 0, …, n − 1.
#[derive(Clone, Debug)]
pub struct UnionFind {
    parent: Vec<u32>,
}

impl UnionFind {
    /// Every number alone.
    pub fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).collect(),
        }
    }

    /// The least member of the set of `a`.
    pub fn find(&mut self, mut a: usize) -> usize {
        while self.parent[a] as usize != a {
            self.parent[a] = self.parent[self.parent[a] as usize];
            a = self.parent[a] as usize;
        }
        a
    }

    /// True where the two were apart before.
    pub fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b)] = a.min(b) as u32;
        a != b
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_is_called_by_its_least_member() {
        let mut sets = UnionFind::new(6);
        assert!(sets.join(5, 3));
        assert!(sets.join(3, 1));
        assert!(!sets.join(1, 5));
        assert_eq!([0, 1, 2, 3, 4, 5].map(|a| sets.find(a)), [0, 1, 2, 1, 4, 1]);
    }
}
