//! Decimal numbers in texts.

/// The powers of ten that a float holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// Up to here a float holds every whole number exactly.
const EXACT_MAX: u64 = 1 << 53;

/// The most digits that 64 bits hold, whatever they are.
const DIGITS_MAX: usize = 19;

/// The nearest float to a number, as [`str::parse`] finds it; `None` for other texts. Short numbers take half the time.
#[must_use]
pub fn float(text: &str) -> Option<f64> {
    short(text.as_bytes()).or_else(|| text.parse().ok())
}

/// A number whose digits are a whole number up to 2^53, with a point or without, and with a minus or without a sign. It is the
/// quotient of two numbers that floats hold exactly, whose rounded quotient is the nearest float (W. Clinger, "How to read floating
/// point numbers accurately", 1990).
fn short(text: &[u8]) -> Option<f64> {
    let digits = text.strip_prefix(b"-").unwrap_or(text);
    let (mut number, mut point) = (0_u64, None);
    if digits.len() > DIGITS_MAX {
        return None;
    }
    for (at, byte) in digits.iter().enumerate() {
        match byte {
            b'0'..=b'9' => number = 10 * number + u64::from(byte - b'0'),
            b'.' if point.is_none() => point = Some(at),
            _ => return None,
        }
    }
    let count = digits.len() - usize::from(point.is_some());
    let places = point.map_or(0, |point| count - point);
    let number = (count > 0 && number <= EXACT_MAX).then_some(number as f64 / POWERS.get(places)?)?;
    Some(if digits.len() < text.len() { -number } else { number })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check(text: &str) {
        let bits = |number: Option<f64>| number.map(f64::to_bits);
        assert_eq!(bits(float(text)), bits(text.parse().ok()), "{text}");
    }

    #[test]
    fn odd_texts_are_read_as_the_standard_does() {
        for text in [
            "", "-", ".", "-.", "5.", ".5", "-0", "-0.0", "+1", "1e3", "inf", "NaN", "1.2.3", "1,5", " 1",
            "--1", "0x1",
        ] {
            check(text);
        }
        for text in [
            "123456789012345",
            "1234567890123456",
            "0.000000000000001",
            "9007199254740993",
            "0.1",
            "-3.14159",
        ] {
            check(text);
        }
    }

    proptest! {
        #[test]
        fn numbers_are_the_nearest_floats(text in "-?[0-9]{0,17}[.]?[0-9]{0,17}", number in any::<f64>()) {
            check(&text);
            check(&number.to_string());
        }
    }
}
