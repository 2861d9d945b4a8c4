//! Numbers as they are written in text files, including by careless programs.

/// The number that `token` spells; `None` if it is none.
///
/// Accepts what Rust does ("1", "+1", ".5", "5.", "1e-3", "inf", "nan" in any case), the NaN and
/// infinity of Microsoft's C library ("1.#IND", "-1.#INF"), and an exponent whose sign is before
/// the letter ("3.1+e2", as one exporter writes 3.1e+2).
#[inline]
pub(super) fn parse_number(token: &[u8]) -> Option<f64> {
    parse_plain_number(token).or_else(|| parse_any_number(token))
}

/// A number of some 15 digits without exponent: whole digits and the power of ten are exact, so
/// that one division rounds correctly (Clinger, "How to read floating point numbers accurately",
/// 1990). It agrees with the standard library and saves some 40 % of the time of text files.
#[inline]
fn parse_plain_number(token: &[u8]) -> Option<f64> {
    const POWERS: [f64; 16] =
        [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
    let (is_negative, unsigned) = match token {
        [b'-', rest @ ..] => (true, rest),
        _ => (false, token),
    };
    // With 15 digits and a point, the number is below 2^53.
    if unsigned.is_empty() || unsigned.len() > 16 {
        return None;
    }
    let (mut digits, mut behind_point) = (0_u64, None);
    for (i, &b) in unsigned.iter().enumerate() {
        let d = b.wrapping_sub(b'0');
        if d <= 9 {
            digits = 10 * digits + u64::from(d);
        } else if b == b'.' && behind_point.is_none() {
            behind_point = Some(unsigned.len() - 1 - i);
        } else {
            return None;
        }
    }
    if digits >= 1 << 53 || (behind_point.is_some() && unsigned.len() == 1) {
        return None;
    }
    let value = digits as f64 / POWERS.get(behind_point.unwrap_or(0))?;
    Some(if is_negative { -value } else { value })
}

fn parse_any_number(token: &[u8]) -> Option<f64> {
    let text = str::from_utf8(token).ok()?;
    text.parse().ok().or_else(|| parse_odd_number(text))
}

#[cold]
fn parse_odd_number(text: &str) -> Option<f64> {
    if let Some((whole, rest)) = text.split_once(".#") {
        let _: i64 = whole.parse().ok()?;
        let is_known = ["IND", "INF", "QNAN", "SNAN"].iter().any(|name| rest.starts_with(name));
        return is_known.then_some(f64::NAN);
    }
    let (mantissa, exponent) = text.split_once(['e', 'E'])?;
    let (mantissa, sign) = mantissa.split_at_checked(mantissa.len().checked_sub(1)?)?;
    if !matches!(sign, "+" | "-") || !mantissa.ends_with(|c: char| c == '.' || c.is_ascii_digit()) {
        return None;
    }
    format!("{mantissa}e{sign}{exponent}").parse().ok()
}

/// The decimal integer that `token` spells; `None` if it is none or does not fit.
pub(super) fn parse_integer(token: &[u8]) -> Option<i64> {
    let (is_negative, digits) = match token {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, token),
    };
    // 18 digits cannot overflow; longer ones are leading zeros or nonsense, which std sorts out.
    if digits.is_empty() || digits.len() > 18 {
        return str::from_utf8(token).ok()?.parse().ok();
    }
    let mut value = 0_i64;
    for &d in digits {
        let d = d.wrapping_sub(b'0');
        if d > 9 {
            return None;
        }
        value = 10 * value + i64::from(d);
    }
    Some(if is_negative { -value } else { value })
}

/// `token` for a message: readable, and not longer than a line of a terminal.
pub(super) fn quoted(token: &[u8]) -> String {
    const MOST: usize = 40;
    let text = token[..token.len().min(MOST)].escape_ascii();
    if token.len() > MOST { format!("`{text}…`") } else { format!("`{text}`") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers() {
        for (text, expected) in [
            ("1", 1.0),
            ("+1", 1.0),
            ("-.7e+02", -70.0),
            ("2.", 2.0),
            ("+2.e-1", 0.2),
            ("2.e01", 20.0),
            ("1E2", 100.0),
            (".8e-001", 0.08),
            ("3.1+e2", 310.0),
            ("-3.1-e2", -0.031),
            ("INF", f64::INFINITY),
            ("1e999", f64::INFINITY),
        ] {
            assert_eq!(parse_number(text.as_bytes()), Some(expected), "{text}");
        }
        for text in ["nan", "-NaN", "1.#IND", "-1.#INF", "1.#QNAN"] {
            assert!(parse_number(text.as_bytes()).is_some_and(f64::is_nan), "{text}");
        }
        for text in ["", "-", "e", "+e2", "x", "1,5", "1.#X", "1-", "0x10", "é", "1 2", "--e1"] {
            assert_eq!(parse_number(text.as_bytes()), None, "{text}");
        }
    }

    /// To the bit what the standard library says, which is correctly rounded.
    #[test]
    fn plain_numbers_agree_with_std() {
        let mut state = 5_u64;
        for _ in 0..200_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let mut text = (state >> 8 >> (state % 50)).to_string();
            text.insert((state >> 40) as usize % (text.len() + 1), '.');
            if state >> 63 == 1 {
                text.insert(0, '-');
            }
            let ours = parse_number(text.as_bytes()).unwrap();
            assert_eq!(ours.to_bits(), text.parse::<f64>().unwrap().to_bits(), "{text}");
        }
        assert_eq!(parse_number(b"."), None);
        assert_eq!(parse_number(b"-."), None);
        assert_eq!(parse_number(b"-0").map(f64::to_bits), Some((-0.0_f64).to_bits()));
    }

    #[test]
    fn integers() {
        for (text, expected) in [
            ("0", Some(0)),
            ("-12", Some(-12)),
            ("+7", Some(7)),
            ("0000000000000000000000042", Some(42)),
            ("9223372036854775807", Some(i64::MAX)),
            ("9223372036854775808", None),
            ("-", None),
            ("", None),
            ("1.5", None),
            ("--1", None),
        ] {
            assert_eq!(parse_integer(text.as_bytes()), expected, "{text}");
        }
    }

    #[test]
    fn quotes_are_short_and_readable() {
        assert_eq!(quoted(b"a\x00\xff"), "`a\\x00\\xff`");
        assert_eq!(quoted(&[b'x'; 100]).chars().filter(|&c| c == 'x').count(), 40);
    }
}
