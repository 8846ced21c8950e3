//! Data URIs and percent-encoding (RFC 2397, 3986, 4648).

use crate::read::error::{ReadProblem, shorten};
use crate::read::folder::is_inside;

fn bad(uri: &str) -> ReadProblem {
    ReadProblem::BadUri {
        uri: shorten(uri.as_bytes()),
    }
}

/// The bytes of a data URI; `None` where it is another URI.
pub fn data(uri: &str) -> Option<Result<Vec<u8>, ReadProblem>> {
    let scheme = uri.get(..5)?;
    if !scheme.eq_ignore_ascii_case("data:") {
        return None;
    }
    Some(decode_data(&uri[5..]).ok_or_else(|| bad(uri)))
}

fn decode_data(rest: &str) -> Option<Vec<u8>> {
    let (head, body) = rest.split_once(',')?;
    match head.strip_suffix(";base64") {
        Some(_) => base64(body.as_bytes()),
        None => percent(body),
    }
}

fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let padding = text.iter().rev().take(2).take_while(|&&b| b == b'=');
    let text = &text[..text.len() - padding.count()];
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 3);
    let (mut bits, mut width) = (0u32, 0);
    for &b in text {
        let digit = match b {
            b'A'..=b'Z' => b - b'A',
            b'a'..=b'z' => b - b'a' + 26,
            b'0'..=b'9' => b - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(digit);
        width += 6;
        if width >= 8 {
            width -= 8;
            bytes.push((bits >> width) as u8);
        }
    }
    // One digit alone carries no byte.
    (text.len() % 4 != 1).then_some(bytes)
}

fn percent(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&b, tail)) = rest.split_first() {
        rest = tail;
        if b != b'%' {
            bytes.push(b);
            continue;
        }
        let digit = |b: &u8| char::from(*b).to_digit(16);
        let (high, low) = (digit(rest.first()?)?, digit(rest.get(1)?)?);
        bytes.push((16 * high + low) as u8);
        rest = &rest[2..];
    }
    Some(bytes)
}

/// The relative path that a URI means: inside its folder, in plain names.
pub fn relative_path(uri: &str) -> Result<String, ReadProblem> {
    let bytes = percent(uri).ok_or_else(|| bad(uri))?;
    let path = String::from_utf8(bytes).map_err(|_| bad(uri))?;
    if path.is_empty() || path.contains('\0') {
        return Err(bad(uri));
    }
    if !is_inside(&path) {
        return Err(ReadProblem::OutsideFolder {
            uri: shorten(uri.as_bytes()),
        });
    }
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_follows_the_vectors_of_rfc_4648() {
        let vectors = [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg==", "foob"),
            ("Zm9vYmE=", "fooba"),
            ("Zm9vYmFy", "foobar"),
            ("Zm9vYg", "foob"),
        ];
        for (text, bytes) in vectors {
            assert_eq!(base64(text.as_bytes()).unwrap(), bytes.as_bytes());
        }
        assert!(base64(b"Zm9v*").is_none());
        assert!(base64(b"Zm9vY").is_none());
    }

    #[test]
    fn data_uris() {
        let bytes = |uri| data(uri).map(|d| d.ok());
        assert_eq!(bytes("data:;base64,Zm9v"), Some(Some(b"foo".to_vec())));
        assert_eq!(bytes("DATA:a/b,f%6Fo"), Some(Some(b"foo".to_vec())));
        assert_eq!(bytes("data:;base64"), Some(None));
        assert_eq!(bytes("data:,%f"), Some(None));
        assert_eq!(bytes("database.bin"), None);
        assert_eq!(bytes("é"), None);
    }

    #[test]
    fn paths_stay_inside() {
        assert_eq!(relative_path("a%20b/c:d.bin").unwrap(), "a b/c:d.bin");
        assert_eq!(relative_path("..a/b..").unwrap(), "..a/b..");
        let outside = [
            "../x.bin",
            "a/../x.bin",
            "%2e%2e/x",
            "/abs",
            "%2Fabs",
            "file:///x",
            "http://a/b",
            "C:/x",
            "..\\x",
            "a/..",
        ];
        for uri in outside {
            let refused = matches!(relative_path(uri), Err(ReadProblem::OutsideFolder { .. }));
            assert!(refused, "{uri}");
        }
        for uri in ["%FF.bin", "%", "%4", "%zz", "", "a%00b"] {
            let refused = matches!(relative_path(uri), Err(ReadProblem::BadUri { .. }));
            assert!(refused, "{uri}");
        }
    }
}
