//! Curvature as people write it: a multiple of π.

use serde::de::{Deserializer, Error, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// A multiple of π: a number (`0.5`) or a fraction in quotes (`"1/2"`, `"-8"`, `"-3/2"`), which is kept as it is; or an
/// angle in radians as other programs write it (`"1.5708 rad"`), of which every bit is kept: not every angle is the
/// rounded product of π and a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PiMultiple(Form);

#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    /// Numerator, denominator > 0.
    Fraction(i64, i64),
    Decimal(f64),
    Radians(f64),
}

/// What follows an angle in radians.
const RADIANS: &str = "rad";

impl PiMultiple {
    /// A multiple that this program itself names; a denominator of 0 counts as 1.
    pub(crate) const fn literal(numerator: i64, denominator: u8) -> Self {
        let denominator = if denominator == 0 { 1 } else { denominator };
        Self(Form::Fraction(numerator, denominator as i64))
    }

    /// `numerator / denominator · π`; `None` where the denominator is not positive.
    pub fn fraction(numerator: i64, denominator: i64) -> Option<Self> {
        (denominator > 0).then_some(Self(Form::Fraction(numerator, denominator)))
    }

    /// `multiple · π`; `None` where the number is not finite.
    pub fn decimal(multiple: f64) -> Option<Self> {
        multiple
            .is_finite()
            .then_some(Self(Form::Decimal(multiple)))
    }

    /// An angle in radians, kept to the last bit; `None` where it is not finite.
    pub fn from_radians(radians: f64) -> Option<Self> {
        radians.is_finite().then_some(Self(Form::Radians(radians)))
    }

    /// In radians.
    pub fn radians(self) -> f64 {
        match self.0 {
            Form::Radians(x) => x,
            _ => self.multiple() * std::f64::consts::PI,
        }
    }

    /// As a multiple of π.
    pub fn multiple(self) -> f64 {
        match self.0 {
            Form::Fraction(n, d) => n as f64 / d as f64,
            Form::Decimal(x) => x,
            Form::Radians(x) => x / std::f64::consts::PI,
        }
    }
}

/// Why a text is no multiple of π.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "\"{text}\" is no multiple of π: write a number (0.5) or a fraction in quotes (\"1/2\", \"-3/2\", \"-8\"); the π itself is understood"
)]
pub struct NotAMultiple {
    /// The text.
    pub text: String,
}

impl FromStr for PiMultiple {
    type Err = NotAMultiple;

    fn from_str(text: &str) -> Result<Self, NotAMultiple> {
        let refused = || NotAMultiple {
            text: text.chars().take(40).collect(),
        };
        if let Some(angle) = text.trim().strip_suffix(RADIANS) {
            let angle = angle.trim_end().parse::<f64>().ok();
            return angle.and_then(Self::from_radians).ok_or_else(refused);
        }
        let (numerator, denominator) = text.split_once('/').unwrap_or((text, "1"));
        let integers = (
            numerator.trim().parse::<i64>(),
            denominator.trim().parse::<i64>(),
        );
        match integers {
            (Ok(n), Ok(d)) => Self::fraction(n, d).ok_or_else(refused),
            _ => text
                .trim()
                .parse::<f64>()
                .ok()
                .and_then(Self::decimal)
                .ok_or_else(refused),
        }
    }
}

impl fmt::Display for PiMultiple {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Form::Fraction(n, 1) => write!(f, "{n}"),
            Form::Fraction(n, d) => write!(f, "{n}/{d}"),
            Form::Decimal(x) => write!(f, "{x}"),
            Form::Radians(x) => write!(f, "{x} {RADIANS}"),
        }
    }
}

impl Serialize for PiMultiple {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Form::Fraction(n, 1) => serializer.serialize_i64(n),
            Form::Fraction(..) | Form::Radians(_) => serializer.collect_str(self),
            Form::Decimal(x) => serializer.serialize_f64(x),
        }
    }
}

impl<'de> Deserialize<'de> for PiMultiple {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;
        impl Visitor<'_> for Reader {
            type Value = PiMultiple;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a multiple of π: a number (0.5) or a fraction in quotes (\"1/2\")")
            }
            fn visit_i64<E: Error>(self, n: i64) -> Result<PiMultiple, E> {
                Ok(PiMultiple(Form::Fraction(n, 1)))
            }
            fn visit_u64<E: Error>(self, n: u64) -> Result<PiMultiple, E> {
                let n = i64::try_from(n).map_err(|_| E::custom(format!("{n} is too large")))?;
                self.visit_i64(n)
            }
            fn visit_f64<E: Error>(self, x: f64) -> Result<PiMultiple, E> {
                let refused = || {
                    E::custom(NotAMultiple {
                        text: x.to_string(),
                    })
                };
                PiMultiple::decimal(x).ok_or_else(refused)
            }
            fn visit_str<E: Error>(self, text: &str) -> Result<PiMultiple, E> {
                text.parse().map_err(E::custom)
            }
        }
        deserializer.deserialize_any(Reader)
    }
}

/// An angle in radians as a multiple of π, for messages: as a decimal where that is short, otherwise as a fraction
/// where that is: `-1.5π`, `5/3π`.
pub(crate) fn in_pi(radians: f64) -> String {
    let multiple = radians / std::f64::consts::PI;
    let decimal = |x: f64| format!("{x:.10}");
    let exact = decimal(multiple);
    let text = exact.trim_end_matches('0').trim_end_matches('.');
    let decimals = text.split_once('.').map_or(0, |(_, after)| after.len());
    if decimals > 4 {
        let same = |d: &f64| decimal((multiple * d).round() / d) == exact;
        if let Some(denominator) = (3..1000).map(f64::from).find(same) {
            return format!("{}/{denominator}π", (multiple * denominator).round());
        }
    }
    format!("{}π", if text == "-0" { "0" } else { text })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Holder {
        k: PiMultiple,
    }

    #[test]
    fn numbers_and_fractions_are_read() {
        for (text, multiple) in [
            ("k = 0.5", 0.5),
            ("k = \"1/2\"", 0.5),
            ("k = \"-8\"", -8.0),
            ("k = -8", -8.0),
            ("k = \"-3/2\"", -1.5),
            ("k = \" 2 / 3 \"", 2.0 / 3.0),
            ("k = \"0.25\"", 0.25),
        ] {
            let holder: Holder = toml::from_str(text).unwrap();
            assert_eq!(holder.k.multiple(), multiple, "{text}");
            assert_eq!(holder.k.radians(), multiple * PI, "{text}");
            let again: Holder = toml::from_str(&toml::to_string(&holder).unwrap()).unwrap();
            assert_eq!(again, holder, "{text}");
        }
    }

    #[test]
    fn radians_keep_every_bit() {
        // No double times π rounds to the double after π: multiples pass it by.
        let passed_by = PI.next_up();
        assert!(1.0 * PI < passed_by && 1.0_f64.next_up() * PI > passed_by);
        for x in [passed_by, PI / 2.0, -0.1, 1e-300, -7.25] {
            let holder: Holder = toml::from_str(&format!("k = \"{x} rad\"")).unwrap();
            assert_eq!(holder.k.radians(), x);
            assert!((holder.k.multiple() * PI - x).abs() <= 1e-15 * x.abs());
            let again: Holder = toml::from_str(&toml::to_string(&holder).unwrap()).unwrap();
            assert_eq!(again, holder);
        }
    }

    #[test]
    fn other_things_are_refused_with_the_remedy() {
        for text in [
            "\"1/0\"",
            "\"1/-2\"",
            "\"half\"",
            "\"π/2\"",
            "nan",
            "inf",
            "\"\"",
            "true",
            "\"rad\"",
            "\"nan rad\"",
        ] {
            let error = toml::from_str::<Holder>(&format!("k = {text}")).unwrap_err();
            assert!(
                error.to_string().contains("multiple of π"),
                "{text}: {error}"
            );
        }
    }

    #[test]
    fn angles_are_shown_as_multiples() {
        assert_eq!(in_pi(-1.5 * PI), "-1.5π");
        assert_eq!(in_pi(5.0 / 3.0 * PI), "5/3π");
        assert_eq!(in_pi(-2.0 / 97.0 * PI), "-2/97π");
        assert_eq!(in_pi(0.123456 * PI), "0.123456π");
        assert_eq!(in_pi(2.0 / 119.0 * PI), "2/119π");
        assert_eq!(in_pi(4.000_000_001 * PI), "4.000000001π");
        assert_eq!(in_pi(-1e-14), "0π");
        assert_eq!(in_pi(4.0 * PI), "4π");
        assert_eq!(in_pi(-0.0), "0π");
        assert_eq!(in_pi(100.0 * PI), "100π");
    }
}
