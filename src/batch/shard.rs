//! Which part of a plan one of several machines does.
//!
//! *Enters:* a plan and a number of shards. *Leaves:* for each shard the assets that it does; every asset is in exactly one.
//!
//! Longest processing time first: assets by falling estimate, each to the shard that has least so far (R. L. Graham, *Bounds on
//! multiprocessing timing anomalies*, SIAM J. Appl. Math. 17, 1969: the largest is at most 4/3 of the best possible). Ties go by id and by
//! number, so that all machines that have the plan agree without talking.
//!
//! *Rejected:* handing assets out one by one as shards become idle, which balances better, but needs somebody who hands them out; and as many
//! shards as assets, for which engines take longer than a small mesh does.

use super::plan::{Plan, Planned};
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fmt;
use std::str::FromStr;

/// One of several shards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Shard {
    /// Which, from 1.
    #[serde(rename = "shard")]
    pub number: u32,
    /// Of how many.
    #[serde(rename = "shards")]
    pub count: u32,
}

/// Most shards that a plan may be divided into.
pub const MOST: u32 = 1_000_000;

impl Shard {
    /// All of a plan.
    pub const WHOLE: Self = Self {
        number: 1,
        count: 1,
    };
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, count) = text
            .split_once('/')
            .ok_or("it must be a number and how many there are, such as 3/16")?;
        let digits = |part: &str| match part.bytes().all(|b| b.is_ascii_digit()) {
            true => part.parse::<u32>().ok(),
            false => None,
        };
        match (digits(number), digits(count)) {
            (Some(_), Some(count)) if !(1..=MOST).contains(&count) => {
                Err(format!("there can be 1 to {MOST} shards, not {count}"))
            }
            (Some(number), Some(count)) if !(1..=count).contains(&number) => Err(format!(
                "of {count} shards there is none with the number {number}: they are counted from 1"
            )),
            (Some(number), Some(count)) => Ok(Self { number, count }),
            _ => Err("it must be a number and how many there are, such as 3/16".to_owned()),
        }
    }
}

/// The shard (from 0) of each asset of a plan.
#[must_use]
pub fn assign(plan: &Plan, count: u32) -> Vec<u32> {
    let mut order: Vec<usize> = (0..plan.assets.len()).collect();
    let key = |&i: &usize| {
        let Planned { task, estimate, .. } = &plan.assets[i];
        (Reverse(*estimate), &task.id)
    };
    order.sort_by(|a, b| key(a).cmp(&key(b)));
    let mut shards: BinaryHeap<Reverse<(u64, u32)>> = (0..count).map(|n| Reverse((0, n))).collect();
    let mut shard_of = vec![0; plan.assets.len()];
    for i in order {
        // Never empty: what is taken is put back.
        if let Some(Reverse((load, number))) = shards.pop() {
            shard_of[i] = number;
            let more = load.saturating_add(plan.assets[i].estimate);
            shards.push(Reverse((more, number)));
        }
    }
    shard_of
}

/// The assets of one shard, in the order of the plan.
#[must_use]
pub fn select(plan: &Plan, shard: Shard) -> Vec<&Planned> {
    let shard_of = assign(plan, shard.count);
    let assets = plan.assets.iter().zip(shard_of);
    let mine = assets.filter(|(_, of)| of + 1 == shard.number);
    mine.map(|(asset, _)| asset).collect()
}

/// The sum of the estimates of each shard, milliseconds.
#[must_use]
pub fn loads(plan: &Plan, count: u32) -> Vec<u64> {
    let mut loads = vec![0_u64; count as usize];
    for (asset, of) in plan.assets.iter().zip(assign(plan, count)) {
        let load = &mut loads[of as usize];
        *load = load.saturating_add(asset.estimate);
    }
    loads
}
