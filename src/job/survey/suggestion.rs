//! How many cones to take.
//!
//! Well-placed cones go on paying: twice as many lower the standard deviation of the log scale by nearly half, however many
//! there are already. What is left to gain shrinks all the same, while every cone lengthens the cut and adds charts. So the suggestion is the
//! least number after which no step to the next one tried (usually twice as many) evens out lengths by a tenth: u is a natural
//! logarithm, and 0.1 of its deviation are ten percent of the length of what is drawn. The bound is a judgement about what one sees, not a theorem; the table beside it has the figures for another one.

use super::ComponentSurvey;

/// A number of cones, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Suggestion {
    /// How many to ask for (`cones.count`).
    pub count: usize,
    /// One sentence.
    pub reason: String,
}

/// What steps are judged by.
const MEASURE: &str = "standard deviation of the log scale";
/// A step that lowers it by less is not worth its seams …
const WORTH: f64 = 0.1;
/// … which means:
const MEANING: &str = "lengths would be evener by less than a tenth";

/// The suggestion for a component.
pub(super) fn suggest(survey: &ComponentSurvey) -> Option<Suggestion> {
    let mut tried: Vec<(usize, f64)> = survey
        .chosen()
        .filter_map(|row| Some((row.asked, row.result.as_ref().ok()?.log_scale.std)))
        .collect();
    tried.sort_by_key(|t| t.0);
    pick(&tried)
}

/// Where the last step ends that is worth its seams.
fn pick(tried: &[(usize, f64)]) -> Option<Suggestion> {
    let is_worth = |pair: &[(usize, f64)]| pair[0].1 - pair[1].1 >= WORTH;
    let taken = tried.windows(2).rposition(is_worth).map_or(0, |i| i + 1);
    let &(count, now) = tried.get(taken)?;
    let reason = match tried.get(taken + 1) {
        Some((more, then)) if then < &now => format!(
            "{more} would lower the {MEASURE} by only {:.3}, from {now:.3} to {then:.3}: {MEANING}",
            now - then
        ),
        Some((more, then)) => {
            format!("{more} would not lower the {MEASURE} ({now:.3}, then {then:.3})")
        }
        None if tried.len() == 1 => format!("no other number was tried ({MEASURE} {now:.3})"),
        None => format!("the last step still pays ({MEASURE} {now:.3}): more cones may, too"),
    };
    Some(Suggestion { count, reason })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_number_after_which_no_step_gains_much() {
        let count = |tried: &[(usize, f64)]| pick(tried).map(|s| s.count);
        // As on nefertiti, spot, and a disk.
        assert_eq!(
            count(&[(4, 0.311), (8, 0.179), (16, 0.112), (32, 0.066)]),
            Some(8)
        );
        assert_eq!(
            count(&[(4, 0.522), (8, 0.335), (16, 0.174), (32, 0.096)]),
            Some(16)
        );
        assert_eq!(
            count(&[(0, 0.59), (4, 0.304), (8, 0.155), (16, 0.0925)]),
            Some(8)
        );
        // A small step before a large one.
        assert_eq!(count(&[(4, 0.8), (8, 0.75), (16, 0.3)]), Some(16));
        assert_eq!(count(&[(0, 0.05), (4, 0.01)]), Some(0));
        assert_eq!(count(&[(4, 0.0), (8, 0.0)]), Some(4));
        assert_eq!(count(&[(4, 0.3), (8, 0.4)]), Some(4));
        assert_eq!(count(&[(6, 0.3)]), Some(6));
        assert_eq!(count(&[]), None);
    }

    #[test]
    fn reasons_are_sentences_with_both_numbers() {
        let reason = |tried: &[(usize, f64)]| pick(tried).expect("some").reason;
        assert_eq!(
            reason(&[(8, 0.179), (16, 0.112)]),
            "16 would lower the standard deviation of the log scale by only 0.067, from 0.179 to 0.112: lengths would be evener by less than a tenth"
        );
        assert_eq!(
            reason(&[(4, 0.3), (8, 0.4)]),
            "8 would not lower the standard deviation of the log scale (0.300, then 0.400)"
        );
        assert_eq!(
            reason(&[(4, 0.8), (8, 0.4)]),
            "the last step still pays (standard deviation of the log scale 0.400): more cones may, too"
        );
    }
}
