//! How many cones to take.
//!
//! Every cone lengthens the cut and adds charts. So the suggestion is the least number from which going on to the next one tried
//! (usually twice as many) lowers what the choice makes least by no more than a fifth. The fifth is a judgement, not a theorem:
//! the table beside it has the figures for another one.

use super::{ComponentSurvey, Figures};
use crate::flow::cones::ConeObjective;

/// Share of the objective that the next number of cones must gain to be worth its seams.
const WORTH: f64 = 0.2;

/// A number of cones, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Suggestion {
    /// How many to ask for (`cones.count`).
    pub count: usize,
    /// One sentence.
    pub reason: String,
}

/// What the choice makes least.
fn value(figures: &Figures, objective: ConeObjective) -> f64 {
    match objective {
        ConeObjective::LogScale => figures.log_scale.std,
        ConeObjective::AreaDistortion => figures.area_distortion,
    }
}

fn name(objective: ConeObjective) -> &'static str {
    match objective {
        ConeObjective::LogScale => "standard deviation of the log scale",
        ConeObjective::AreaDistortion => "area distortion (9)",
    }
}

/// The least number from which the next gains little; the greatest where every one gains much.
pub(super) fn suggest(survey: &ComponentSurvey, objective: ConeObjective) -> Option<Suggestion> {
    let mut tried: Vec<(usize, f64)> = survey
        .chosen()
        .filter_map(|row| Some((row.asked, value(row.result.as_ref().ok()?, objective))))
        .collect();
    tried.sort_by_key(|t| t.0);
    pick(&tried, name(objective))
}

fn pick(tried: &[(usize, f64)], name: &str) -> Option<Suggestion> {
    for pair in tried.windows(2) {
        let [(count, now), (more, then)] = [pair[0], pair[1]];
        if then >= (1.0 - WORTH) * now {
            let reason = match then < now {
                true => format!(
                    "{more} would lower the {name} by only {:.0} %, from {now:.3} to {then:.3}",
                    100.0 * (1.0 - then / now)
                ),
                false => format!("{more} would not lower the {name} ({now:.3}, then {then:.3})"),
            };
            return Some(Suggestion { count, reason });
        }
    }
    let &(count, value) = tried.last()?;
    let reason = match tried {
        [_] => format!("no other number was tried ({name} {value:.3})"),
        _ => format!(
            "every step up to it lowers the {name} by more than a fifth, to {value:.3}; more cones may pay"
        ),
    };
    Some(Suggestion { count, reason })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_number_from_which_the_next_gains_little() {
        let count = |tried: &[(usize, f64)]| pick(tried, "std").map(|s| s.count);
        assert_eq!(count(&[(4, 0.8), (8, 0.5), (16, 0.45), (32, 0.2)]), Some(8));
        assert_eq!(count(&[(4, 0.8), (8, 0.5), (16, 0.3)]), Some(16));
        assert_eq!(count(&[(0, 0.1), (4, 0.1)]), Some(0));
        assert_eq!(count(&[(4, 0.0), (8, 0.0)]), Some(4));
        assert_eq!(count(&[(4, 0.3), (8, 0.4)]), Some(4));
        assert_eq!(count(&[(6, 0.3)]), Some(6));
        assert_eq!(count(&[]), None);
    }

    #[test]
    fn reasons_are_sentences_with_both_numbers() {
        let reason = |tried: &[(usize, f64)]| pick(tried, "std").expect("some").reason;
        assert_eq!(
            reason(&[(8, 0.5), (16, 0.45)]),
            "16 would lower the std by only 10 %, from 0.500 to 0.450"
        );
        assert_eq!(
            reason(&[(4, 0.3), (8, 0.4)]),
            "8 would not lower the std (0.300, then 0.400)"
        );
    }
}
