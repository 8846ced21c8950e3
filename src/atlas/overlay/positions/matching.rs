//! From the drawn curve to the one in minimal position.
//!
//! *Enters:* the crossings of a drawn curve and the crossings that the integers say. *Leaves:* for each of the latter the drawn one
//! that it is, in order. *Guaranteed:* a drawn crossing is used once and the halfedges agree. If the curves are homotopic, all are found.
//!
//! A crossing followed by its reverse bounds a bigon with nothing in it and goes away with it. What remains is the minimal
//! curve, perhaps with a turn around its first and its last vertex: a triangle between two edges from one vertex is removed by moving the
//! curve's end around that vertex.

use super::words::WordCrossing;
use crate::flow::correspondence::Crossing;
use crate::geometry::connectivity::Connectivity;

/// Removes crossings that are undone at once, until there is none.
pub(super) fn reduce(flat: &Connectivity, word: &mut Vec<WordCrossing>) {
    let mut kept = 0;
    for i in 0..word.len() {
        let undone = kept > 0 && flat.twin(word[i].halfedge) == Some(word[kept - 1].halfedge);
        if undone {
            kept -= 1;
        } else {
            word[kept] = word[i];
            kept += 1;
        }
    }
    word.truncate(kept);
}

/// Calls `found(i, drawn)` for every crossing `minimal[i]` that is found in the reduced `word`.
pub(super) fn matched(
    flat: &Connectivity,
    word: &[WordCrossing],
    minimal: &[Crossing],
    mut found: impl FnMut(usize, &WordCrossing),
) {
    let same = |pair: &(&Crossing, &WordCrossing)| pair.0.halfedge == pair.1.halfedge;
    let all = |start: usize| minimal.iter().zip(&word[start..]).all(|pair| same(&pair));
    let spare = word.len().checked_sub(minimal.len());
    let whole = spare.and_then(|spare| {
        let fits = |&start: &usize| {
            all(start) && turns(flat, &word[..start]) && turns(flat, &word[start + minimal.len()..])
        };
        (0..=spare).find(fits)
    });
    if let Some(start) = whole {
        for (i, drawn) in word[start..start + minimal.len()].iter().enumerate() {
            found(i, drawn);
        }
        return;
    }
    // Not the same curve: what agrees at both ends is as good as anything.
    let head = minimal.iter().zip(word).take_while(same).count();
    let tail = minimal[head..]
        .iter()
        .rev()
        .zip(word[head..].iter().rev())
        .take_while(same)
        .count();
    for (i, drawn) in word[..head].iter().enumerate() {
        found(i, drawn);
    }
    for i in 1..=tail {
        found(minimal.len() - i, &word[word.len() - i]);
    }
}

/// True where the curve turns around one vertex all the time: each time through the next edge counterclockwise, or each time
/// through the next clockwise.
fn turns(flat: &Connectivity, word: &[WordCrossing]) -> bool {
    let mut ways = [true; 2];
    for pair in word.windows(2) {
        let Some(t) = flat.twin(pair[0].halfedge) else {
            return false;
        };
        ways[0] &= pair[1].halfedge == flat.next(t);
        ways[1] &= pair[1].halfedge == flat.prev(t);
    }
    ways[0] || ways[1]
}
