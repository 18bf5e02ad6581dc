//! Numbers as people read them.

/// A number with four significant digits and separated thousands; very large and very small numbers with powers of ten.
pub(super) fn number(value: f64) -> String {
    let magnitude = value.abs();
    if !value.is_finite() {
        return if value < 0.0 { "−∞" } else { "∞" }.to_owned();
    }
    if magnitude != 0.0 && !(1e-4..1e9).contains(&magnitude) {
        return power(value);
    }
    let decimals = if magnitude < 1.0 { 6 } else { (4 - magnitude.log10() as i32 - 1).max(0) as usize };
    let text = format!("{value:.decimals$}");
    let (whole, part) = text.split_once('.').unwrap_or((&text, ""));
    let part = part.trim_end_matches('0');
    let point = if part.is_empty() { "" } else { "." };
    format!("{}{point}{part}", thousands(whole)).replacen('-', "−", 1)
}

/// A number such as `3·10⁻⁷`.
fn power(value: f64) -> String {
    let text = format!("{value:.2e}");
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let raised = exponent.chars().filter_map(|char| match char {
        '-' => Some('⁻'),
        char => "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(char.to_digit(10)? as usize),
    });
    let digits = digits.trim_end_matches('0').trim_end_matches('.').replacen('-', "−", 1);
    let digits = if digits == "1" { String::new() } else { format!("{digits}·") };
    format!("{digits}10{}", raised.collect::<String>())
}

/// The digits of a whole number in groups of three.
fn thousands(digits: &str) -> String {
    let count = digits.trim_start_matches('-').len();
    let mut grouped = String::new();
    for (at, char) in digits.chars().enumerate() {
        let left = digits.len() - at;
        if left.is_multiple_of(3) && left < count {
            grouped.push(',');
        }
        grouped.push(char);
    }
    grouped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_four_digits() {
        let numbers: Vec<String> =
            [0.5, 1.0 / 3.0, 1234.5, 98_765.4, -2.5e-7, 1e9, -123_456.0].map(number).into();
        assert_eq!(numbers, ["0.5", "0.333333", "1,234", "98,765", "−2.5·10⁻⁷", "10⁹", "−123,456"]);
    }
}
