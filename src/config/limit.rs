//! A limit that protects the machine unless it is switched off.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt;

/// What one mesh may take of something.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Limit {
    /// As much as protects the machine and is enough for any mesh that can be built on it (`"auto"`).
    #[default]
    Auto,
    /// Any amount (`"off"`).
    Off,
    /// So much; not 0.
    At(u64),
}

impl Limit {
    /// The words that stand for no number.
    pub const WORDS: [&str; 2] = ["auto", "off"];
}

impl Serialize for Limit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Auto => serializer.serialize_str(Self::WORDS[0]),
            Self::Off => serializer.serialize_str(Self::WORDS[1]),
            Self::At(amount) => serializer.serialize_u64(*amount),
        }
    }
}

impl<'de> Deserialize<'de> for Limit {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl de::Visitor<'_> for Visitor {
            type Value = Limit;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "\"auto\", \"off\" or a positive integer")
            }

            fn visit_str<E: de::Error>(self, word: &str) -> Result<Limit, E> {
                match word {
                    "auto" => Ok(Limit::Auto),
                    "off" => Ok(Limit::Off),
                    _ => Err(E::invalid_value(de::Unexpected::Str(word), &self)),
                }
            }

            fn visit_u64<E: de::Error>(self, amount: u64) -> Result<Limit, E> {
                match amount {
                    0 => Err(E::invalid_value(de::Unexpected::Unsigned(0), &self)),
                    amount => Ok(Limit::At(amount)),
                }
            }

            fn visit_i64<E: de::Error>(self, amount: i64) -> Result<Limit, E> {
                match u64::try_from(amount) {
                    Ok(amount) => self.visit_u64(amount),
                    Err(_) => Err(E::invalid_value(de::Unexpected::Signed(amount), &self)),
                }
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_numbers_come_back() {
        for limit in [Limit::Auto, Limit::Off, Limit::At(7), Limit::At(1 << 44)] {
            let text = serde_json::to_string(&limit).unwrap();
            assert_eq!(serde_json::from_str::<Limit>(&text).unwrap(), limit);
        }
        for bad in ["0", "-1", "\"any\"", "1.5", "true"] {
            assert!(serde_json::from_str::<Limit>(bad).is_err(), "{bad}");
        }
    }
}
