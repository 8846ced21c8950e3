//! How surfaces lie side by side.
//!
//! *Enters:* which sides are one curve. *Leaves:* [`Neighbours`]. *Guaranteed:* every side of every surface is in exactly one interface or on the
//! boundary, both sides of an interface have as many samples, and corners that the interfaces join have one number. *Not guaranteed:* that the
//! images hold equal points there.

use super::error::FitError;
use super::side::{Interface, PatchSide, Side};
use crate::geometry::disjoint_sets::UnionFind;

/// How surfaces lie side by side.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Neighbours {
    /// In the order of their first sides.
    pub interfaces: Vec<Interface>,
    /// Sides on the boundary of the surface.
    pub boundary: Vec<PatchSide>,
    /// Number of the point at each corner of each patch.
    pub corner: Vec<[usize; 4]>,
    /// How many such points there are.
    pub corners: usize,
}

impl Neighbours {
    /// Of surfaces with so many samples in u and in v; sides that no interface names are on the boundary.
    ///
    /// # Errors
    /// Surfaces that are not there, a side in two interfaces or on both sides of one, and sides with different numbers of samples.
    pub fn new(samples: &[[usize; 2]], mut interfaces: Vec<Interface>) -> Result<Self, FitError> {
        let mut is_met = vec![[false; 4]; samples.len()];
        let mut sets = UnionFind::new(4 * samples.len());
        for interface in &mut interfaces {
            if interface.second < interface.first {
                std::mem::swap(&mut interface.first, &mut interface.second);
            }
            let sides = [interface.first, interface.second];
            for side in sides {
                let patches = samples.len();
                let met = is_met
                    .get_mut(side.patch)
                    .ok_or(FitError::NoPatch { side, patches })?;
                if std::mem::replace(&mut met[side.side as usize], true) {
                    return Err(FitError::Met { side });
                }
            }
            let samples = sides.map(|s| samples[s.patch][s.side.along()]);
            if samples[0] != samples[1] {
                return Err(FitError::Counts { sides, samples });
            }
            let [[a, b], mut across] = sides.map(|s| s.side.corners().map(|k| 4 * s.patch + k));
            if interface.reversed {
                across.reverse();
            }
            sets.join(a, across[0]);
            sets.join(b, across[1]);
        }
        interfaces.sort_by_key(|interface| interface.first);
        let open = is_met.iter().enumerate().flat_map(|(patch, met)| {
            let sides = Side::ALL.into_iter().filter(|&side| !met[side as usize]);
            sides.map(move |side| PatchSide { patch, side })
        });
        let boundary = open.collect();
        let mut number = vec![usize::MAX; 4 * samples.len()];
        let mut corners = 0;
        let corner = (0..samples.len())
            .map(|patch| {
                [0, 1, 2, 3].map(|k| {
                    // Sets are called by their least member, which comes first.
                    let name = sets.find(4 * patch + k);
                    if number[name] == usize::MAX {
                        number[name] = corners;
                        corners += 1;
                    }
                    number[name]
                })
            })
            .collect();
        Ok(Self {
            interfaces,
            boundary,
            corner,
            corners,
        })
    }
}
