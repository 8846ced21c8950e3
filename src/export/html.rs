//! Pages of HTML that stand alone: one file, nothing fetched, the same bytes every time.
//!
//! *Enters:* texts that may hold anything, names of assets and messages above all. *Leaves:* markup in which they are text.
//! *Guaranteed:* pages ask the network for nothing; their policy forbids it even where a text should find a way in.

use std::fmt::Write as _;

/// Colours and tables of every page.
const STYLE: &str = include_str!("html/page.css");
/// Sorts tables.
pub(super) const TABLES: &str = include_str!("html/table.js");

/// A text as HTML, inside an element or a quoted attribute.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            // HTML has no way to write these.
            c if c.is_control() && !matches!(c, '\n' | '\t') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// A path below the page as the value of `href`; `%` and the like in names are no escapes of ours.
pub(super) fn link(path: &str) -> String {
    let mut out = String::from("./");
    for byte in path.bytes() {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' | b'/' => {
                out.push(char::from(byte));
            }
            _ => {
                let _ = write!(out, "%{byte:02X}");
            }
        }
    }
    out
}

/// JSON that can stand in a `<script>`: no text in it can end the element.
pub(super) fn json(value: &serde_json::Value) -> String {
    let text = value.to_string();
    text.replace('<', "\\u003c")
        .replace('>', "\\u003e")
        .replace('&', "\\u0026")
}

/// A number with four digits, and a power of ten where it is very large or small.
pub(super) fn figure(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".to_owned()
    } else if !x.is_finite() || !(1e-4..1e6).contains(&size) {
        format!("{x:.3e}")
    } else {
        let digits = (3 - size.log10().floor() as i32).clamp(0, 8) as usize;
        format!("{x:.digits$}")
    }
}

/// Where the pictures of a page come from, as its policy has it: from the page itself, …
pub(super) const INSIDE: &str = "data:";
/// … and from files below its folder too. A page that is opened from disk has no origin of its own that all browsers agree on, hence `file:`.
pub(super) const BESIDE: &str = "data: 'self' file:";

/// A page: `body` is markup already, `title` is text.
pub(super) fn page(
    title: &str,
    style: &str,
    body: &str,
    scripts: &[&str],
    pictures: &str,
) -> String {
    let mut out = String::with_capacity(body.len() + 64 * 1024);
    out.push_str("<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    let _ = write!(
        out,
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src {pictures}\">\n\
         <link rel=\"icon\" href=\"data:,\">\n"
    );
    let _ = write!(
        out,
        "<title>{}</title>\n<style>\n{STYLE}{style}</style>\n</head>\n<body>\n",
        escape(title)
    );
    out.push_str(body);
    for script in scripts {
        let _ = write!(out, "<script>\n{script}</script>\n");
    }
    out.push_str("</body>\n</html>\n");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_becomes_markup() {
        let hostile = "</script><script>alert(1)</script>\"'&\u{0}";
        let text = escape(hostile);
        assert!(!text.contains(['<', '>', '"', '\'', '\0']), "{text}");
        assert!(text.contains("&lt;/script&gt;"));
        let value = json(&serde_json::json!({ hostile: hostile }));
        assert!(!value.contains(['<', '>']), "{value}");
        let back: serde_json::Value = serde_json::from_str(&value).unwrap();
        assert_eq!(back[hostile], hostile);
        assert_eq!(
            link("a b/javascript:x%\"<.html"),
            "./a%20b/javascript%3Ax%25%22%3C.html"
        );
        assert!(page(hostile, "", "", &[], INSIDE).contains("<title>&lt;/script&gt;"));
    }

    #[test]
    fn numbers_have_four_digits() {
        for (x, words) in [
            (0.0, "0"),
            (-0.123456, "-0.1235"),
            (12.34567, "12.35"),
            (123456.7, "123457"),
            (1.5e-7, "1.500e-7"),
            (-2.5e9, "-2.500e9"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(figure(x), words);
        }
    }
}
