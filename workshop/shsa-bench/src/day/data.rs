//! A day of data: a model with five signals of each variable, and a table of their values.

use std::fmt::Write as _;
use std::io::{self, BufWriter, Write};

/// Signals of each variable.
const EACH: u32 = 5;

/// The size of the data.
pub(super) struct Shape {
    pub(super) signals: u32,
    /// Rows a second.
    pub(super) rate: u32,
    pub(super) rows: u64,
}

impl Shape {
    pub(super) fn new(hours: f64, signals: u32, rate: u32) -> Shape {
        Shape { signals, rate, rows: (hours * 3_600.0 * f64::from(rate)).round() as u64 }
    }

    pub(super) fn hours(&self) -> f64 {
        self.rows as f64 / f64::from(self.rate) / 3_600.0
    }
}

/// The model as YAML; the first variable is needed.
pub(super) fn model(shape: &Shape) -> String {
    let mut text = String::from("shsa: 1\nvariables:\n");
    for at in 0..shape.signals.div_ceil(EACH) {
        let _ = writeln!(text, "  v{at}: {{ max_rate: 1 }}");
    }
    text.push_str("signals:\n");
    for at in 0..shape.signals {
        let (carried, rate) = (at / EACH, shape.rate);
        let _ = writeln!(text, "  s{at}: {{ variable: v{carried}, rate: {rate} Hz, value_error: 0.1 }}");
    }
    text.push_str("needs:\n  v0: { max_age: 1 s }\n");
    text
}

/// The table as CSV: all signals follow a triangular wave between 1 and 2, plus up to 0.05 of noise for each value.
pub(super) fn write(output: impl Write, shape: &Shape) -> io::Result<()> {
    let mut output = BufWriter::with_capacity(1 << 20, output);
    let names: String = (0..shape.signals).map(|at| format!(",s{at}")).collect();
    writeln!(output, "t [us]{names}")?;
    let mut line = Vec::new();
    for row in 0..shape.rows {
        line.clear();
        push_number(&mut line, row * 1_000_000 / u64::from(shape.rate), 0);
        let wave = 10_000 + (row % 20_000).abs_diff(10_000);
        for at in 0..u64::from(shape.signals) {
            let noise = (row * 7_919 + at * 104_729) % 1_000;
            line.push(b',');
            push_number(&mut line, wave + noise - 500, 4);
        }
        line.push(b'\n');
        output.write_all(&line)?;
    }
    output.flush()
}

/// Appends a fixed-point number: its last `decimals` digits stand behind the point.
fn push_number(line: &mut Vec<u8>, number: u64, decimals: usize) {
    let start = line.len();
    let (mut left, mut written) = (number, 0);
    while left > 0 || written <= decimals {
        if written == decimals && decimals > 0 {
            line.push(b'.');
        }
        line.push(b'0' + (left % 10) as u8);
        left /= 10;
        written += 1;
    }
    if let Some(digits) = line.get_mut(start..) {
        digits.reverse();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_their_decimals() {
        let shown = |number, decimals| {
            let mut line = Vec::new();
            push_number(&mut line, number, decimals);
            String::from_utf8(line).unwrap()
        };
        let all = [shown(0, 0), shown(1_230, 0), shown(12_345, 4), shown(45, 4)];
        assert_eq!(all, ["0", "1230", "1.2345", "0.0045"]);
    }

    #[test]
    fn the_model_is_one() {
        let text = model(&Shape::new(1.0, 7, 100));
        let loaded = shsa_model::load(&text, "m.yaml");
        assert_eq!(loaded.report.render(false), "");
        assert_eq!((loaded.knowledge.variables().len(), loaded.knowledge.signals().len()), (2, 7));
    }
}
