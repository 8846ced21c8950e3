//! A triangle cut by curves in normal position: combinatorics only.
//!
//! *Enters:* how many curves cross each side. *Leaves:* the regions into which they cut the triangle, as polygons of points on
//! its sides. *Guaranteed:* for counts that any system of disjoint arcs has, the one system there is: an arc joins two
//! different sides, or a corner with the side opposite to it. Every region has three to six corners, no three of
//! which lie on one side. *Not guaranteed:* anything about curves that run into a corner along a side: such a
//! curve is the side itself and is not counted.
//!
//! ```text
//!              2
//!             / \          side k runs from corner k to corner k + 1; point (k, i) is the i-th on it,
//!          ··/···\··       (k, 0) the corner itself. Arcs that cut off corner k join (k, j) with
//!           /  ·  \        (k − 1, n + 1 − j), n curves crossing that side. Where a side has more crossings than
//!          / ·   · \       the two others together, the rest of its arcs end at the corner opposite.
//!         0 --------- 1
//! ```

/// A corner of a region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Point {
    /// Side, 0 to 2.
    pub side: usize,
    /// 0 for the corner where the side begins, i for the i-th crossing from there.
    pub place: usize,
}

fn point(side: usize, place: usize) -> Point {
    Point { side, place }
}

/// Hands every region over, counterclockwise: those at corners 0, 1, 2 from the corner inwards, then what is left.
/// The first error of `region` ends it. False where no system of arcs has these counts.
pub(super) fn slice<E>(
    crossings: [usize; 3],
    mut region: impl FnMut(&[Point]) -> Result<(), E>,
) -> Result<bool, E> {
    let n = crossings;
    let Some(cut_off) = cut_off(n) else {
        return Ok(false);
    };
    for (k, &arcs) in cut_off.iter().enumerate() {
        let before = (k + 2) % 3;
        let ends = |j: usize| (point(k, j), point(before, n[before] + 1 - j));
        for j in 1..=arcs {
            let (p, q) = ends(j);
            if j == 1 {
                region(&[point(k, 0), p, q])?;
            } else {
                let (inner_p, inner_q) = ends(j - 1);
                region(&[inner_p, p, q, inner_q])?;
            }
        }
    }
    // The border of what is left, at corner k: the corner, or both ends of the last arc that cuts it off.
    let border = |k: usize, polygon: &mut Polygon| {
        let before = (k + 2) % 3;
        match cut_off[k] {
            0 => polygon.push(point(k, 0)),
            c => {
                polygon.push(point(before, n[before] + 1 - c));
                polygon.push(point(k, c));
            }
        }
    };
    let fan = (0..3)
        .map(|k| {
            (
                k,
                n[(k + 1) % 3] - cut_off[(k + 1) % 3] - cut_off[(k + 2) % 3],
            )
        })
        .find(|&(_, count)| count > 0);
    let Some((apex, count)) = fan else {
        let mut polygon = Polygon::default();
        (0..3).for_each(|k| border(k, &mut polygon));
        region(polygon.points())?;
        return Ok(true);
    };
    let (right, left) = ((apex + 1) % 3, (apex + 2) % 3);
    let opposite = |i: usize| point(right, cut_off[right] + i);
    let mut polygon = Polygon::default();
    polygon.push(point(apex, 0));
    border(right, &mut polygon);
    polygon.push(opposite(1));
    region(polygon.points())?;
    for i in 1..count {
        region(&[point(apex, 0), opposite(i), opposite(i + 1)])?;
    }
    polygon = Polygon::default();
    polygon.push(point(apex, 0));
    polygon.push(opposite(count));
    border(left, &mut polygon);
    region(polygon.points())?;
    Ok(true)
}

/// How many arcs cut off each corner; `None` where the counts belong to no system of arcs.
fn cut_off(n: [usize; 3]) -> Option<[usize; 3]> {
    for k in 0..3 {
        let (right, left) = ((k + 1) % 3, (k + 2) % 3);
        // Side `right` is opposite corner k.
        if n[right] >= n[k] + n[left] {
            let mut cut_off = [0; 3];
            cut_off[right] = n[k];
            cut_off[left] = n[left];
            return Some(cut_off);
        }
    }
    let around = |k: usize| n[k] + n[(k + 2) % 3] - n[(k + 1) % 3];
    if around(0) % 2 == 1 {
        return None;
    }
    Some([0, 1, 2].map(|k| around(k) / 2))
}

/// At most six points.
struct Polygon {
    points: [Point; 6],
    count: usize,
}

impl Default for Polygon {
    fn default() -> Self {
        Self {
            points: [point(0, 0); 6],
            count: 0,
        }
    }
}

impl Polygon {
    fn push(&mut self, p: Point) {
        self.points[self.count] = p;
        self.count += 1;
    }

    fn points(&self) -> &[Point] {
        &self.points[..self.count]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Regions of a triangle, checked to fit together.
    fn regions(n: [usize; 3]) -> Option<Vec<Vec<Point>>> {
        let mut regions = Vec::new();
        let collect = |polygon: &[Point]| {
            regions.push(polygon.to_vec());
            Ok::<(), ()>(())
        };
        slice(n, collect).unwrap().then_some(regions)
    }

    #[test]
    fn regions_fill_the_triangle() {
        for code in 0..8 * 8 * 8 {
            let n = [code % 8, code / 8 % 8, code / 64];
            let total: usize = n.iter().sum();
            let longest = n.iter().max().unwrap();
            let Some(regions) = regions(n) else {
                assert!(total % 2 == 1 && 2 * longest < total, "{n:?}");
                continue;
            };
            let follows = |p: Point, q: Point| match p.place == n[p.side] {
                true => q == point((p.side + 1) % 3, 0),
                false => q == point(p.side, p.place + 1),
            };
            let mut arcs = BTreeMap::new();
            let mut along = 0;
            for polygon in &regions {
                assert!((3..=6).contains(&polygon.len()), "{n:?} {polygon:?}");
                for (i, &p) in polygon.iter().enumerate() {
                    let q = polygon[(i + 1) % polygon.len()];
                    assert!(p.place <= n[p.side]);
                    if follows(p, q) {
                        along += 1;
                        continue;
                    }
                    // Arcs join different sides, and every one has a region on each side.
                    assert_ne!(p.side, q.side, "{n:?} {polygon:?}");
                    let key = |p: Point| (p.side, p.place);
                    *arcs
                        .entry((key(p).min(key(q)), key(p).max(key(q))))
                        .or_insert(0) += if key(p) < key(q) { 1 } else { 10 };
                }
            }
            assert_eq!(along, total + 3, "{n:?}: every piece of a side once");
            assert!(arcs.values().all(|&count| count == 11), "{n:?} {arcs:?}");
            // Every crossing ends one arc.
            let ends = arcs.keys().flat_map(|&(p, q)| [p, q]).filter(|p| p.1 > 0);
            let mut ends: Vec<_> = ends.collect();
            ends.sort_unstable();
            ends.dedup();
            let corners = arcs.keys().filter(|(p, q)| p.1 == 0 || q.1 == 0).count();
            assert_eq!((ends.len(), 2 * arcs.len()), (total, total + corners));
            let triangles: usize = regions.iter().map(|r| r.len() - 2).sum();
            assert_eq!(triangles, total + 1);
        }
    }
}
