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

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::batch::Task;
    use crate::batch::cache::{Reason, Verdict};
    use crate::batch::plan::Purpose;
    use crate::batch::task::Settings;
    use crate::config::{Config, RunParams};
    use proptest::prelude::*;
    use std::path::Path;
    use std::sync::Arc;

    /// A plan of assets with these estimates, `a000` and so on, whose inputs have their names as hashes.
    pub fn plan(output: &Path, estimates: &[u64]) -> Plan {
        let settings = Arc::new(Settings::new(Config::default()));
        let task = |i: usize| {
            let id = format!("a{i:03}");
            Task {
                path: format!("{id}.obj").into(),
                given: format!("{id}.obj").into(),
                input_hash: Some(id.clone()),
                config_hash: settings.hash.clone(),
                cost: 1,
                files: vec![format!("{id}.obj").into()],
                settings: Arc::clone(&settings),
                id,
            }
        };
        let tasks: Vec<Task> = (0..estimates.len()).map(task).collect();
        let verdicts: Vec<Verdict> = tasks.iter().map(|_| Verdict::Build(Reason::New)).collect();
        let purpose = Purpose {
            folder: output.to_owned(),
            output: output.to_owned(),
            force: false,
            files: Vec::new(),
            run: RunParams::default(),
        };
        let mut plan = Plan::new(purpose, tasks, &verdicts).unwrap();
        for (asset, &estimate) in plan.assets.iter_mut().zip(estimates) {
            asset.estimate = estimate;
        }
        plan
    }

    fn estimates() -> impl Strategy<Value = Vec<u64>> {
        // Many alike, and some that are much larger.
        let one = prop_oneof![3 => 0..4_u64, 3 => 1..1000_u64, 1 => 0..1_000_000_u64];
        prop::collection::vec(one, 0..80)
    }

    proptest! {
        #[test]
        fn every_asset_is_in_exactly_one_shard(estimates in estimates(), count in 1..100_u32) {
            let plan = plan(Path::new("out"), &estimates);
            let mut seen: Vec<&str> = Vec::new();
            for number in 1..=count {
                let mine = select(&plan, Shard { number, count });
                let sum: u64 = mine.iter().map(|asset| asset.estimate).sum();
                prop_assert_eq!(sum, loads(&plan, count)[number as usize - 1]);
                seen.extend(mine.iter().map(|asset| asset.task.id.as_str()));
            }
            seen.sort_unstable();
            let all: Vec<&str> = plan.assets.iter().map(|a| a.task.id.as_str()).collect();
            prop_assert_eq!(seen, all);
        }

        #[test]
        fn shards_are_alike(estimates in estimates(), count in 1..20_u32) {
            let loads = loads(&plan(Path::new("out"), &estimates), count);
            // What was put last onto the fullest shard was put where least was, so the others have at least the rest.
            let largest = estimates.iter().copied().max().unwrap_or(0);
            let (least, most) = (loads.iter().min().unwrap(), loads.iter().max().unwrap());
            prop_assert!(most - least <= largest);
            // Graham: at most 4/3 of the best possible, which is at least an equal part and the largest.
            let sum: u64 = estimates.iter().sum();
            let fewer_than_shards = estimates.len() <= count as usize;
            prop_assert!(!fewer_than_shards || *most == largest);
            prop_assert!(*most <= sum.div_ceil(u64::from(count)) + largest);
        }

        #[test]
        fn the_order_of_the_plan_does_not_matter(estimates in estimates(), count in 1..20_u32) {
            let mut plan = plan(Path::new("out"), &estimates);
            let ids = |plan: &Plan| -> Vec<Vec<String>> {
                let shard = |number| {
                    let mine = select(plan, Shard { number, count });
                    let mut ids: Vec<String> = mine.iter().map(|a| a.task.id.clone()).collect();
                    ids.sort_unstable();
                    ids
                };
                (1..=count).map(shard).collect()
            };
            let before = ids(&plan);
            plan.assets.reverse();
            prop_assert_eq!(ids(&plan), before);
        }
    }

    #[test]
    fn the_longest_come_first_and_ties_go_by_id_and_number() {
        let plan = plan(Path::new("out"), &[3, 7, 5, 5, 1, 0, 0]);
        // 7 | 5 | 5, then 3 to the second, 1 to the third, and nothing to whoever has least.
        assert_eq!(assign(&plan, 3), [1, 0, 1, 2, 2, 2, 2]);
        assert_eq!(loads(&plan, 3), [7, 8, 6]);
        assert_eq!(assign(&plan, 9), [3, 0, 1, 2, 4, 5, 5]);
    }

    #[test]
    fn shards_are_read_and_refused() {
        let read = |text: &str| text.parse::<Shard>();
        assert_eq!(
            read("3/16"),
            Ok(Shard {
                number: 3,
                count: 16
            })
        );
        assert_eq!(read("1/1"), Ok(Shard::WHOLE));
        assert_eq!(Shard::WHOLE.to_string().parse(), Ok(Shard::WHOLE));
        for text in ["0/4", "5/4"] {
            let said = read(text).unwrap_err();
            assert!(said.starts_with("of 4 shards there is none"), "{said}");
        }
        for text in [
            "", "3", "/", "3/", "/4", "+1/4", "1/4/4", "a/b", "1.0/2", " 1/2",
        ] {
            assert!(read(text).unwrap_err().ends_with("such as 3/16"), "{text}");
        }
        assert!(read("1/0").unwrap_err().ends_with("not 0"));
        assert!(read("1/1000001").unwrap_err().ends_with("not 1000001"));
        assert!(read("1/99999999999").is_err());
    }
}
