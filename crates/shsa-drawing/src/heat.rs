//! Tables of shares as heat maps: the deeper the colour, the higher the value, which is also written in its cell.

use super::number::number;
use super::sheet::{Rule, Sheet, escaped, fitted, px, width_of};

/// A table of values from 0 to 1, such as the share of faults that were healed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heat {
    /// The subject, in one line.
    pub title: String,
    /// The meaning of the rows, such as `fault`.
    pub row: String,
    /// The meaning of the columns, such as `size of the fault`.
    pub column: String,
    /// The name of each row, from top to bottom.
    pub rows: Vec<String>,
    /// The name of each column, from left to right.
    pub columns: Vec<String>,
    /// The values of each row, in the order of the columns. `None`, not-a-number and missing values are shown as `–`. A value
    /// outside of 0 to [`full`](Heat::full) has the colour of the nearer end.
    pub cells: Vec<Vec<Option<f64>>>,
    /// The value with the strongest colour, above 0: 1 for shares.
    pub full: f64,
}

const CELL: (f64, f64) = (56.0, 28.0);
const NAME: f64 = 13.0;
const VALUE: f64 = 12.0;
/// The widest name of a row or a column.
const MOST_NAME: f64 = 240.0;
const MARGIN: f64 = 16.0;
/// The height of the title and of the axis names.
const HEAD: f64 = 62.0;
/// The slope of long column names in degrees.
const SLOPE: f64 = 40.0;

/// Steps of one hue, which every reader can order; the contrast of texts is at least 4.5.
const RULES: [Rule; 13] = [
    Rule { class: "head", light: "font-size:16px;font-weight:600", dark: "" },
    Rule {
        class: "none",
        light: "fill:none;stroke:#d5dae0;color:#57606a",
        dark: "stroke:#363d46;color:#a0aab5",
    },
    Rule { class: "h0", light: "fill:#f1f6fb;color:#10151b", dark: "fill:#1d242c;color:#ffffff" },
    Rule { class: "h1", light: "fill:#d8e8f5;color:#10151b", dark: "fill:#1e2f40;color:#ffffff" },
    Rule { class: "h2", light: "fill:#bedaf0;color:#10151b", dark: "fill:#1e3b54;color:#ffffff" },
    Rule { class: "h3", light: "fill:#a4ccea;color:#10151b", dark: "fill:#1f4667;color:#ffffff" },
    Rule { class: "h4", light: "fill:#89bce2;color:#10151b", dark: "fill:#25567e;color:#ffffff" },
    Rule { class: "h5", light: "fill:#6eabd9;color:#10151b", dark: "fill:#2e6896;color:#ffffff" },
    Rule { class: "h6", light: "fill:#529ad0;color:#10151b", dark: "fill:#367aae;color:#ffffff" },
    Rule { class: "h7", light: "fill:#3a89c4;color:#10151b", dark: "fill:#468ec4;color:#10151b" },
    Rule { class: "h8", light: "fill:#2975b0;color:#ffffff", dark: "fill:#66a5d5;color:#10151b" },
    Rule { class: "h9", light: "fill:#18629d;color:#ffffff", dark: "fill:#86bde6;color:#10151b" },
    Rule { class: "h10", light: "fill:#084f8a;color:#ffffff", dark: "fill:#a5d4f7;color:#10151b" },
];

impl Heat {
    /// The table as a complete SVG, which begins with `<svg`. Time: linear in the cells.
    #[must_use]
    pub fn svg(&self) -> String {
        let rows: Vec<String> = self.rows.iter().map(|name| fitted(name, NAME, MOST_NAME)).collect();
        let columns: Vec<String> = self.columns.iter().map(|name| fitted(name, NAME, MOST_NAME)).collect();
        let widest = |names: &[String]| names.iter().map(|name| width_of(name, NAME)).fold(0.0, f64::max);
        let sloped = widest(&columns) > CELL.0 - 6.0;
        let (sine, cosine) = SLOPE.to_radians().sin_cos();
        let above = if sloped { widest(&columns) * sine + 14.0 } else { 22.0 };
        let left = MARGIN + widest(&rows).max(width_of(&self.row, VALUE)) + 10.0;
        let top = HEAD + above;
        let mut sheet = Sheet::new();
        sheet.text(format_args!("class=\"shsa-text shsa-head\" x=\"16\" y=\"28\""), &self.title);
        let at = format!("x=\"{}\" y=\"{}\"", px(left), px(HEAD - 8.0));
        sheet.text(format_args!("class=\"shsa-note\" {at}"), &self.column);
        let at = format!("text-anchor=\"end\" x=\"{}\" y=\"{}\"", px(left - 10.0), px(top - 8.0));
        sheet.text(format_args!("class=\"shsa-note\" {at}"), &self.row);
        for (name, x) in columns.iter().zip(places(left, CELL.0)) {
            column(&mut sheet, name, (x + CELL.0 / 2.0, top - 8.0), sloped);
        }
        for ((at, name), y) in rows.iter().enumerate().zip(places(top, CELL.1)) {
            let place = format!("text-anchor=\"end\" x=\"{}\" y=\"{}\"", px(left - 10.0), px(y + 18.5));
            sheet.text(format_args!("class=\"shsa-text\" {place}"), name);
            self.row(&mut sheet, at, (left, y));
        }
        let slopes = if sloped { widest(&columns) * cosine } else { 0.0 };
        let bottom = top + self.rows.len() as f64 * CELL.1;
        scale(&mut sheet, self.full, (left, bottom + 18.0));
        let right = left + (self.columns.len() as f64 * CELL.0 + slopes).max(13.0 * 16.0 + 40.0);
        let width = right.max(MARGIN + width_of(&self.title, 17.0)) + MARGIN;
        sheet.finish("shsa-heat", &RULES, (width, bottom + 48.0), &self.title, &self.description())
    }

    fn row(&self, sheet: &mut Sheet, at: usize, (left, y): (f64, f64)) {
        let values = self.cells.get(at).map(Vec::as_slice).unwrap_or_default();
        let name = self.rows.get(at).map(String::as_str).unwrap_or_default();
        for ((column, title), x) in self.columns.iter().enumerate().zip(places(left, CELL.0)) {
            let value = values.get(column).copied().flatten().filter(|value| !value.is_nan());
            let label = value.map_or("no value".to_owned(), number);
            cell(sheet, value, self.full, &format!("{name}, {title}: {label}"), (x, y));
        }
    }

    fn description(&self) -> String {
        let (rows, columns) = (self.rows.len(), self.columns.len());
        format!("Table of {rows} rows ({}) and {columns} columns ({}).", self.row, self.column)
    }
}

/// Evenly spaced places from `start` on.
fn places(start: f64, step: f64) -> impl Iterator<Item = f64> {
    (0_u32..).map(move |at| start + f64::from(at) * step)
}

fn column(sheet: &mut Sheet, name: &str, (x, y): (f64, f64), sloped: bool) {
    let (px_x, px_y) = (px(x), px(y));
    if sloped {
        let turned = format!("transform=\"rotate(-{SLOPE} {px_x} {px_y})\"");
        sheet.text(format_args!("class=\"shsa-text\" x=\"{px_x}\" y=\"{px_y}\" {turned}"), name);
    } else {
        sheet
            .text(format_args!("class=\"shsa-text\" text-anchor=\"middle\" x=\"{px_x}\" y=\"{px_y}\""), name);
    }
}

fn cell(sheet: &mut Sheet, value: Option<f64>, full: f64, title: &str, (x, y): (f64, f64)) {
    let class = value.map_or("none".to_owned(), |value| format!("h{}", step(value / full)));
    let text = value.map_or("–".to_owned(), |value| if full == 1.0 { shown(value) } else { figure(value) });
    let (text_x, text_y) = (px(x + CELL.0 / 2.0), px(y + 18.0));
    let (x, y, width, height) = (px(x + 1.0), px(y + 1.0), px(CELL.0 - 2.0), px(CELL.1 - 2.0));
    sheet.put(format_args!(
        "<g class=\"shsa-{class}\"><title>{}</title>\
         <rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" rx=\"3\"/>\
         <text class=\"shsa-value\" fill=\"currentColor\" stroke=\"none\" font-size=\"{VALUE}\" text-anchor=\"middle\" \
         x=\"{text_x}\" y=\"{text_y}\">{}</text></g>",
        escaped(title),
        escaped(&text),
    ));
}

/// The colour step of a value, 0 to 10.
fn step(value: f64) -> u8 {
    // The ends have colours of their own: all differs from almost all.
    match value {
        value if value <= 0.0 => 0,
        value if value >= 1.0 => 10,
        value => (value * 10.0).round().clamp(1.0, 9.0) as u8,
    }
}

/// A value with two decimals; a value near 0 or 1 is not rounded to it.
fn shown(value: f64) -> String {
    match value {
        0.0 | 1.0 => number(value),
        value if 0.0 < value && value < 0.005 => "<0.01".to_owned(),
        value if 0.995 < value && value < 1.0 => ">0.99".to_owned(),
        value => number((value * 100.0).round() / 100.0),
    }
}

/// A value to two or three digits.
fn figure(value: f64) -> String {
    let digits = 10f64.powi(2 - value.abs().log10().floor().max(-3.0) as i32);
    number(if value == 0.0 || digits < 1.0 { value.round() } else { (value * digits).round() / digits })
}

/// The scale of the colours.
fn scale(sheet: &mut Sheet, full: f64, (x, y): (f64, f64)) {
    let at = format!("y=\"{}\"", px(y + 11.0));
    sheet.text(format_args!("class=\"shsa-note\" x=\"{}\" {at}", px(x)), "0");
    for (step, left) in (0_u8..=10).zip(places(x + 14.0, 16.0)) {
        let (left, top) = (px(left), px(y));
        sheet.put(format_args!(
            "<rect class=\"shsa-h{step}\" x=\"{left}\" y=\"{top}\" width=\"16\" height=\"14\"/>"
        ));
    }
    let right = format!("class=\"shsa-note\" x=\"{}\" {at}", px(x + 14.0 + 11.0 * 16.0 + 6.0));
    sheet.text(format_args!("{right}"), &figure(full));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_is_not_almost_all() {
        assert_eq!(
            [0.0, 1e-9, 0.05, 0.149, 0.5, 0.96, 0.9999, 1.0, 7.0, -1.0].map(step),
            [0, 1, 1, 1, 5, 9, 9, 10, 10, 0]
        );
        let texts = [0.0, 1e-9, 0.5, 1.0 / 3.0, 0.994, 0.9999, 1.0, -2.5].map(shown);
        assert_eq!(texts, ["0", "<0.01", "0.5", "0.33", "0.99", ">0.99", "1", "−2.5"]);
        let texts = [0.0, 0.012345, 0.5, 1.0, 12.345, 1234.5].map(figure);
        assert_eq!(texts, ["0", "0.0123", "0.5", "1", "12.3", "1,235"]);
    }
}
