//! A flow network over integers: Dinic's maximum flow, and searches of its residual graph.
//!
//! *Enters:* arcs with capacities and a flow within them that is kept at every node but source and sink. *Leaves:* a maximum flow, and
//! which nodes its residual arcs connect. *Guaranteed:* exact, and the same for the same arcs in the same order.

use std::collections::VecDeque;

/// A flow network with two directed arcs for each that is given: there and back.
pub(super) struct Network {
    /// Where the arcs of each node begin in `arcs`.
    start: Vec<u32>,
    /// Directed arcs, node by node.
    arcs: Vec<Arc>,
    source: usize,
    sink: usize,
}

#[derive(Clone, Copy)]
struct Arc {
    head: u32,
    /// The same arc in the other direction.
    back: u32,
    /// Capacity that is left.
    room: i128,
}

/// Direction of a search.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    From,
    Towards,
}

const UNREACHED: u32 = u32::MAX;

impl Network {
    /// Arcs are (from, to, capacity, flow to begin with); the sink is the last node.
    pub fn new(source: usize, sink: usize, given: &[(usize, usize, i128, i128)]) -> Self {
        let nodes = sink + 1;
        let mut start = vec![0u32; nodes + 1];
        for &(from, to, ..) in given {
            start[from + 1] += 1;
            start[to + 1] += 1;
        }
        for x in 0..nodes {
            start[x + 1] += start[x];
        }
        let mut next = start.clone();
        let none = Arc {
            head: 0,
            back: 0,
            room: 0,
        };
        let mut arcs = vec![none; 2 * given.len()];
        for &(from, to, capacity, flow) in given {
            let (there, back) = (next[from], next[to]);
            next[from] += 1;
            next[to] += 1;
            arcs[there as usize] = Arc {
                head: to as u32,
                back,
                room: capacity - flow,
            };
            arcs[back as usize] = Arc {
                head: from as u32,
                back: there,
                room: flow,
            };
        }
        Self {
            start,
            arcs,
            source,
            sink,
        }
    }

    fn nodes(&self) -> usize {
        self.start.len() - 1
    }

    fn range(&self, x: usize) -> std::ops::Range<usize> {
        self.start[x] as usize..self.start[x + 1] as usize
    }

    /// A negative amount goes along the arc back.
    fn push(&mut self, arc: usize, amount: i128) {
        let back = self.arcs[arc].back as usize;
        self.arcs[arc].room -= amount;
        self.arcs[back].room += amount;
    }

    /// Arcs with more room than `spared` from the source to each node, fewest first; no farther than to `until`.
    fn levels(&self, until: Option<usize>, spared: i128) -> Vec<u32> {
        let mut level = vec![UNREACHED; self.nodes()];
        level[self.source] = 0;
        let mut queue = VecDeque::from([self.source]);
        while let Some(x) = queue.pop_front() {
            if until.is_some_and(|t| level[x] >= level[t]) {
                break;
            }
            for arc in &self.arcs[self.range(x)] {
                let head = arc.head as usize;
                if level[head] == UNREACHED && arc.room > spared {
                    level[head] = level[x] + 1;
                    queue.push_back(head);
                }
            }
        }
        level
    }

    /// Completes the flow until no path has more room than `spared` (Dinic: blocking flows along shortest paths). To a maximum
    /// one for 0.
    pub fn saturate(&mut self, spared: i128) {
        loop {
            let level = self.levels(Some(self.sink), spared);
            if level[self.sink] == UNREACHED {
                return;
            }
            let mut next = self.start.clone();
            let mut path: Vec<usize> = Vec::new();
            loop {
                let x = path
                    .last()
                    .map_or(self.source, |&arc| self.arcs[arc].head as usize);
                if x == self.sink {
                    let rooms = path.iter().map(|&arc| self.arcs[arc].room);
                    let flow = rooms.min().unwrap_or(0);
                    for &arc in &path {
                        self.push(arc, flow);
                    }
                    let full = path.iter().position(|&arc| self.arcs[arc].room <= spared);
                    path.truncate(full.unwrap_or(0));
                } else if next[x] < self.start[x + 1] {
                    let arc = self.arcs[next[x] as usize];
                    let on = level[arc.head as usize] == level[x] + 1;
                    if arc.room > spared && on {
                        path.push(next[x] as usize);
                    } else {
                        next[x] += 1;
                    }
                } else {
                    // A dead end: go back and do not come again.
                    if path.pop().is_none() {
                        break;
                    }
                    let back = path
                        .last()
                        .map_or(self.source, |&arc| self.arcs[arc].head as usize);
                    next[back] += 1;
                }
            }
        }
    }

    /// Moves small imbalances of the inner nodes, what the source could still send to a node or the node to the sink, up to
    /// `small`, along spanning trees of inner arcs that have room for all of them together both ways. What does not cancel is
    /// left at the root of each tree, or next to it. Every inner node has an arc from the source or one to the sink, not both.
    pub fn gather(&mut self, small: i128) {
        let inner = self.source.min(self.sink);
        let mut outer = Vec::with_capacity(inner);
        let mut surplus = vec![0i128; inner];
        let mut most = 0i128;
        // Each gets all that it lacks, or gives all that it could, and so has too much or too little.
        for (x, surplus) in surplus.iter_mut().enumerate() {
            let end = self.range(x).find_map(|arc| {
                let Arc { head, back, .. } = self.arcs[arc];
                match head as usize {
                    head if head == self.source => Some((back as usize, true)),
                    head if head == self.sink => Some((arc, false)),
                    _ => None,
                }
            });
            if let Some((arc, fed)) = end {
                let room = self.arcs[arc].room;
                if room <= small {
                    self.push(arc, room);
                    *surplus = if fed { room } else { -room };
                    most += room;
                }
            }
            outer.push(end);
        }
        let fed = |x: &usize| outer[*x].is_some_and(|(_, fed)| fed);
        let roots: Vec<usize> = (0..inner)
            .filter(fed)
            .chain((0..inner).filter(|x| !fed(x)))
            .collect();
        // The arc to the parent.
        let mut up: Vec<Option<usize>> = vec![None; inner];
        let mut seen = vec![false; inner];
        for root in roots {
            if std::mem::replace(&mut seen[root], true) {
                continue;
            }
            let mut tree = vec![root];
            let mut next = 0;
            while let Some(&x) = tree.get(next) {
                next += 1;
                for arc in self.range(x) {
                    let Arc { head, back, room } = self.arcs[arc];
                    let head = head as usize;
                    let wide = room > most && self.arcs[back as usize].room > most;
                    if head < inner && wide && !std::mem::replace(&mut seen[head], true) {
                        up[head] = Some(back as usize);
                        tree.push(head);
                    }
                }
            }
            for &x in tree.iter().rev() {
                let Some(arc) = up[x] else { continue };
                let amount = std::mem::take(&mut surplus[x]);
                self.push(arc, amount);
                surplus[self.arcs[arc].head as usize] += amount;
            }
            // What is left goes back to where it came from: a node that is fed got it, so its arc from the source carries as
            // much; what is missing is not drained from a neighbour in the tree, which drains as much in turn.
            let total = std::mem::take(&mut surplus[root]);
            let end = match (fed(&root) && total < 0).then(|| tree.get(1)).flatten() {
                Some(&child) => {
                    if let Some(arc) = up[child] {
                        self.push(arc, -total);
                    }
                    child
                }
                None => root,
            };
            if let Some((arc, fed)) = outer[end] {
                self.push(arc, if fed { -total } else { total });
            }
        }
    }

    /// Inner nodes that residual arcs lead to from the source: where the flow is a maximum one, the least set of the least cut.
    pub fn starved(&self) -> Vec<bool> {
        let level = self.levels(None, 0);
        level.into_iter().map(|l| l != UNREACHED).collect()
    }

    /// Inner nodes that residual arcs between inner nodes lead to from `root`.
    pub fn reached_from(&self, root: usize) -> Vec<bool> {
        self.connected(root, Way::From)
    }

    /// Inner nodes from which residual arcs between inner nodes lead to `root`.
    pub fn leading_to(&self, root: usize) -> Vec<bool> {
        self.connected(root, Way::Towards)
    }

    fn connected(&self, root: usize, way: Way) -> Vec<bool> {
        let mut found = vec![false; self.nodes()];
        found[root] = true;
        let mut stack = vec![root];
        while let Some(x) = stack.pop() {
            for arc in &self.arcs[self.range(x)] {
                let room = match way {
                    Way::From => arc.room,
                    Way::Towards => self.arcs[arc.back as usize].room,
                };
                let head = arc.head as usize;
                let inner = head != self.source && head != self.sink;
                if room > 0 && !found[head] && inner {
                    found[head] = true;
                    stack.push(head);
                }
            }
        }
        found
    }
}
