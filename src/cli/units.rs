//! Sizes, rectangles and amounts of memory as people write them.

use std::time::Duration;

use crate::film::PixelRect;

/// "1920x1080".
pub(super) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| text.trim().parse().ok().filter(|n| (1..=65_535).contains(n));
    text.split_once(['x', 'X', '×'])
        .and_then(|(w, h)| Some([side(w)?, side(h)?]))
        .ok_or_else(|| "expected WIDTHxHEIGHT, whole numbers from 1 to 65535".to_owned())
}

/// "0,0,640,360".
pub(super) fn parse_crop(text: &str) -> Result<PixelRect, String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x0, y0, x1, y1]) if x0 < x1 && y0 < y1 => Ok(PixelRect { x0, y0, x1, y1 }),
        Some([_, _, _, _]) => Err("expected X0 < X1 and Y0 < Y1".to_owned()),
        _ => Err("expected X0,Y0,X1,Y1, four whole numbers".to_owned()),
    }
}

/// One of several parts of the samples of a render.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Part {
    /// Which, from 1.
    pub(super) number: u32,
    /// Of how many.
    pub(super) count: u32,
}

/// "3/8".
pub(super) fn parse_part(text: &str) -> Result<Part, String> {
    let numbers = text.split_once('/').map(|(k, n)| (k.trim().parse(), n.trim().parse()));
    match numbers {
        Some((Ok(number), Ok(count))) if (1..=count).contains(&number) => {
            Ok(Part { number, count })
        }
        _ => Err("expected K/N with K from 1 to N, as in 3/8".to_owned()),
    }
}

/// "512M", "8G", "1.5GiB": powers of 1024.
pub(super) fn parse_bytes(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let split = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let factor = match unit.trim().to_ascii_lowercase().trim_end_matches('b').trim_end_matches('i')
    {
        "" => 1.0,
        "k" => 1024.0,
        "m" => 1024.0 * 1024.0,
        "g" => 1024.0 * 1024.0 * 1024.0,
        "t" => 1024.0 * 1024.0 * 1024.0 * 1024.0,
        _ => return Err("expected a size such as 512M or 8G".to_owned()),
    };
    match number.parse::<f64>() {
        Ok(n) if n > 0.0 && n.is_finite() => Ok((n * factor) as u64),
        _ => Err("expected a size such as 512M or 8G".to_owned()),
    }
}

/// "500k", "10M", "1.5G": powers of 1000.
pub(super) fn parse_count(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let split = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let factor = match unit.trim() {
        "" => 1.0,
        "k" | "K" => 1e3,
        "M" | "m" => 1e6,
        "G" | "g" => 1e9,
        _ => return Err("expected a number such as 500k or 10M".to_owned()),
    };
    match number.parse::<f64>() {
        // Up to 2⁵³ every whole number is an f64.
        Ok(n) if (0.0..=9e15).contains(&(n * factor)) => Ok((n * factor).round() as u64),
        _ => Err("expected a number such as 500k or 10M".to_owned()),
    }
}

/// "30s", "1.5m", "2h", "1h30m": a number alone is seconds.
pub(super) fn parse_time(text: &str) -> Result<Duration, String> {
    let wrong = || "expected a time such as 30s, 1.5m or 1h30m".to_owned();
    let mut seconds = 0.0;
    let mut rest = text.trim();
    while !rest.is_empty() {
        let split = rest.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(rest.len());
        let (number, after) = rest.split_at(split);
        let end = after.find(|c: char| c.is_ascii_digit()).unwrap_or(after.len());
        let (unit, after) = after.split_at(end);
        let factor = match unit.trim() {
            "ms" => 1e-3,
            "s" | "" => 1.0,
            "m" | "min" => 60.0,
            "h" => 3600.0,
            _ => return Err(wrong()),
        };
        seconds += number.parse::<f64>().map_err(|_| wrong())? * factor;
        rest = after;
    }
    // A year is as good as for ever, and Instants can be that far.
    if seconds > 0.0 && seconds <= 3.2e7 {
        return Ok(Duration::from_secs_f64(seconds));
    }
    Err(wrong())
}

/// "1%", "0.5 %", "0.01": a share.
pub(super) fn parse_share(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let (number, unit) = text.strip_suffix('%').map_or((text, 1.0), |number| (number, 0.01));
    match number.trim().parse::<f64>() {
        Ok(x) if x > 0.0 && x.is_finite() => Ok(x * unit),
        _ => Err("expected a share such as 1% or 0.01".to_owned()),
    }
}

/// 1,234,567.
pub(super) fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// "12.3 MB", in powers of 1000, as files are listed.
pub(super) fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(parse_size("1920x1080"), Ok([1920, 1080]));
        for bad in ["1920", "0x5", "5x", "70000x1", "-1x1", "axb"] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn crops() {
        assert_eq!(parse_crop("1,2, 3,4"), Ok(PixelRect { x0: 1, y0: 2, x1: 3, y1: 4 }));
        for bad in ["3,2,1,4", "1,2,3", "1,2,3,x", "1,2,1,3", ""] {
            assert!(parse_crop(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn amounts_of_memory() {
        assert_eq!(parse_bytes("512M"), Ok(512 << 20));
        assert_eq!(parse_bytes("1.5 GiB"), Ok(3 << 29));
        assert_eq!(parse_bytes("100"), Ok(100));
        for bad in ["", "G", "0", "-1G", "1X"] {
            assert!(parse_bytes(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn counts() {
        assert_eq!(parse_count("10M"), Ok(10_000_000));
        assert_eq!(parse_count("500 k"), Ok(500_000));
        assert_eq!(parse_count("1.1k"), Ok(1100));
        assert_eq!(parse_count("12345678"), Ok(12_345_678));
        for bad in ["", "M", "-1", "1e400", "10Mi", "1.2.3"] {
            assert!(parse_count(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn times() {
        let seconds = |text| parse_time(text).map(|time| time.as_secs_f64());
        assert_eq!(seconds("30s"), Ok(30.0));
        assert_eq!(seconds("2"), Ok(2.0));
        assert_eq!(seconds("1.5m"), Ok(90.0));
        assert_eq!(seconds("1h30m"), Ok(5400.0));
        assert_eq!(seconds("250 ms"), Ok(0.25));
        for bad in ["", "s", "0", "-1s", "1d", "1..5s", "1e400h", "99999h"] {
            assert!(parse_time(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn shares() {
        assert_eq!(parse_share("1%"), Ok(0.01));
        assert_eq!(parse_share("0.5 %"), Ok(0.005));
        assert_eq!(parse_share("0.02"), Ok(0.02));
        for bad in ["", "%", "0", "-1%", "inf", "NaN", "1%%"] {
            assert!(parse_share(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn digits_in_threes() {
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1,000", "1,234,567"]);
    }
}
