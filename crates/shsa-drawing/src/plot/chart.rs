//! A chart as SVG: frame, ticks, whiskers, lines, markers, legend.

use super::ticks::Range;
use super::{Chart, Point, Series};
use crate::sheet::{Rule, Sheet, escaped, fitted, px, width_of};

/// The size of the area of the lines.
const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 340.0;
/// The upper edge of that area.
const TOP: f64 = 76.0;
/// The room below the area, for the texts of ticks and axis.
const BOTTOM: f64 = 58.0;
/// The height of a line of the legend, and the widest text in it.
const LEGEND_LINE: f64 = 22.0;
const LEGEND_TEXT: f64 = 250.0;
const TEXT: f64 = 13.0;
const SMALL: f64 = 12.0;
/// The number of colours; further series differ in marker and dashes.
const COLOURS: usize = 7;

const RULES: [Rule; 12] = [
    Rule { class: "head", light: "font-size:16px;font-weight:600", dark: "" },
    Rule { class: "grid", light: "stroke:#d5dae0;stroke-width:1", dark: "stroke:#363d46" },
    Rule { class: "faint", light: "stroke:#eceff2;stroke-width:1", dark: "stroke:#23282f" },
    Rule { class: "axis", light: "stroke:#57606a;stroke-width:1", dark: "stroke:#a0aab5" },
    Rule { class: "line", light: "fill:none;stroke-width:2;stroke-linejoin:round", dark: "" },
    // Colours that readers with any kind of colour blindness can tell apart, after Okabe and Ito.
    Rule { class: "c0", light: "stroke:#0068a8;color:#0068a8", dark: "stroke:#5ab0f0;color:#5ab0f0" },
    Rule { class: "c1", light: "stroke:#cc5500;color:#cc5500", dark: "stroke:#ff9a5c;color:#ff9a5c" },
    Rule { class: "c2", light: "stroke:#007f5c;color:#007f5c", dark: "stroke:#3fcf9f;color:#3fcf9f" },
    Rule { class: "c3", light: "stroke:#8b3f96;color:#8b3f96", dark: "stroke:#d39fe4;color:#d39fe4" },
    Rule { class: "c4", light: "stroke:#8a6a00;color:#8a6a00", dark: "stroke:#e0c040;color:#e0c040" },
    Rule { class: "c5", light: "stroke:#3f4650;color:#3f4650", dark: "stroke:#c9d0d8;color:#c9d0d8" },
    Rule { class: "c6", light: "stroke:#c2397a;color:#c2397a", dark: "stroke:#ff86b6;color:#ff86b6" },
];

impl Chart {
    /// The chart as a complete SVG, which begins with `<svg`.
    ///
    /// Points that an axis cannot show (not finite, or not positive on a logarithmic axis) are left out, and a note counts them.
    /// Time: linear in the points.
    #[must_use]
    pub fn svg(&self) -> String {
        let view = View::of(self);
        let mut sheet = Sheet::new();
        sheet.text(format_args!("class=\"shsa-text shsa-head\" x=\"16\" y=\"28\""), &self.title);
        view.axes(&mut sheet);
        for (at, (series, points)) in view.shown.iter().enumerate() {
            view.series(&mut sheet, at, series, points);
        }
        if view.shown.iter().all(|(_, points)| points.is_empty()) {
            let (x, y) = (px(view.left + WIDTH / 2.0), px(TOP + HEIGHT / 2.0));
            let at = format!("class=\"shsa-note\" text-anchor=\"middle\" x=\"{x}\" y=\"{y}\"");
            sheet.text(format_args!("{at}"), "no values");
        }
        view.legend(&mut sheet);
        let height = view.notes(&mut sheet);
        sheet.finish("shsa-plot", &RULES, (view.width(), height), &self.title, &self.description())
    }

    fn description(&self) -> String {
        let names: Vec<&str> = self.series.iter().map(|series| &*series.name).collect();
        format!("Line chart of {} over {}: {}.", self.y.label, self.x.label, names.join(", "))
    }
}

/// A chart with everything placed.
struct View<'a> {
    chart: &'a Chart,
    x: Range<'a>,
    y: Range<'a>,
    /// The series with the points that can be shown.
    shown: Vec<(&'a Series, Vec<Point>)>,
    /// The left edge of the area of the lines, right of the texts of the y axis.
    left: f64,
}

impl<'a> View<'a> {
    fn of(chart: &'a Chart) -> View<'a> {
        let shows = |point: &Point| chart.x.shows(point.x) && chart.y.shows(point.y);
        let whiskers = |point: Point| Point {
            low: if chart.y.shows(point.low) { point.low.min(point.y) } else { point.y },
            high: if chart.y.shows(point.high) { point.high.max(point.y) } else { point.y },
            ..point
        };
        let shown = |series: &'a Series| {
            (series, series.points.iter().copied().filter(shows).map(whiskers).collect::<Vec<Point>>())
        };
        let shown: Vec<(&Series, Vec<Point>)> = chart.series.iter().map(shown).collect();
        let points = || shown.iter().flat_map(|(_, points)| points);
        let x = chart.x.range(points().map(|point| point.x), 8.0);
        let y = chart.y.range(points().flat_map(|point| [point.low, point.high]), 6.0);
        let majors = y.ticks().into_iter().filter(|tick| tick.major);
        let texts = majors.map(|tick| width_of(&y.written(tick.value), SMALL)).fold(0.0, f64::max);
        View { chart, x, y, shown, left: 16.0 + texts + 10.0 }
    }

    fn width(&self) -> f64 {
        let texts = self.chart.series.iter().map(|series| width_of(&series.name, TEXT).min(LEGEND_TEXT));
        let legend = self.left + WIDTH + 24.0 + 42.0 + texts.fold(0.0, f64::max) + 12.0;
        legend.max(16.0 + width_of(&self.chart.title, 17.0) + 16.0)
    }

    fn x_at(&self, value: f64) -> f64 {
        self.left + self.x.share(value) * WIDTH
    }

    fn y_at(&self, value: f64) -> f64 {
        TOP + (1.0 - self.y.share(value)) * HEIGHT
    }

    fn axes(&self, sheet: &mut Sheet) {
        let (left, right, bottom) = (px(self.left), px(self.left + WIDTH), px(TOP + HEIGHT));
        let class = |major| if major { "shsa-grid" } else { "shsa-faint" };
        for tick in self.y.ticks() {
            let y = px(self.y_at(tick.value));
            sheet.put(format_args!("<path class=\"{}\" d=\"M{left} {y}H{right}\"/>", class(tick.major)));
            if tick.major {
                let (x, y) = (px(self.left - 8.0), px(self.y_at(tick.value) + 4.0));
                let at = format_args!("class=\"shsa-note\" text-anchor=\"end\" x=\"{x}\" y=\"{y}\"");
                sheet.text(at, &self.y.written(tick.value));
            }
        }
        let mut free = f64::MIN;
        for tick in self.x.ticks() {
            let x = self.x_at(tick.value);
            let line = format!("M{} {}V{bottom}", px(x), px(TOP));
            sheet.put(format_args!("<path class=\"{}\" d=\"{line}\"/>", class(tick.major)));
            let text = self.x.written(tick.value);
            let half = width_of(&text, SMALL) / 2.0;
            if tick.major && x - half > free {
                let (x, y) = (px(x), px(TOP + HEIGHT + 19.0));
                let at = format_args!("class=\"shsa-note\" text-anchor=\"middle\" x=\"{x}\" y=\"{y}\"");
                sheet.text(at, &text);
                free = self.x_at(tick.value) + half + 8.0;
            }
        }
        sheet.put(format_args!("<path class=\"shsa-axis\" d=\"M{left} {bottom}H{right}\"/>"));
        let (x, y) = (px(self.left + WIDTH / 2.0), px(TOP + HEIGHT + 43.0));
        let at = format_args!("class=\"shsa-text\" text-anchor=\"middle\" x=\"{x}\" y=\"{y}\"");
        sheet.text(at, &self.chart.x.label);
        // The name stands above the axis, so that it is read horizontally.
        sheet
            .text(format_args!("class=\"shsa-text\" x=\"16\" y=\"{}\"", px(TOP - 18.0)), &self.chart.y.label);
    }

    fn series(&self, sheet: &mut Sheet, at: usize, series: &Series, points: &[Point]) {
        sheet.put(format_args!("<g class=\"shsa-c{}\">", at % COLOURS));
        for point in points.iter().filter(|point| point.low < point.high) {
            let (x, low, high) = (self.x_at(point.x), self.y_at(point.low), self.y_at(point.high));
            let (from, to) = (px(x - 4.0), px(x + 4.0));
            let (x, low, high) = (px(x), px(low), px(high));
            sheet.put(format_args!(
                "<path opacity=\".55\" d=\"M{from} {low}H{to}M{x} {low}V{high}M{from} {high}H{to}\"/>"
            ));
        }
        let line: Vec<String> = points
            .iter()
            .map(|point| format!("{} {}", px(self.x_at(point.x)), px(self.y_at(point.y))))
            .collect();
        if points.len() > 1 {
            let (line, dashes) = (line.join("L"), dashes(at));
            sheet.put(format_args!("<path class=\"shsa-line\"{dashes} d=\"M{line}\"/>"));
        }
        for point in points {
            let title = escaped(&self.described(series, point));
            let marker = marker(at, self.x_at(point.x), self.y_at(point.y));
            sheet.put(format_args!(
                "<path fill=\"currentColor\" d=\"{marker}\"><title>{title}</title></path>"
            ));
        }
        sheet.put(format_args!("</g>"));
    }

    /// A point in words, for its tooltip.
    fn described(&self, series: &Series, point: &Point) -> String {
        let (x, y) = (self.x.written(point.x), self.y.written(point.y));
        let spread = match point.low < point.high {
            true => format!(" ({} to {})", self.y.written(point.low), self.y.written(point.high)),
            false => String::new(),
        };
        format!("{} at {x}: {y}{spread}", series.name)
    }

    fn legend(&self, sheet: &mut Sheet) {
        let left = self.left + WIDTH + 24.0;
        for (at, series) in self.chart.series.iter().enumerate() {
            let y = TOP + 8.0 + at as f64 * LEGEND_LINE;
            let (colour, dashes, marker) = (at % COLOURS, dashes(at), marker(at, left + 16.0, y));
            let (from, to, line) = (px(left), px(left + 32.0), px(y));
            sheet.put(format_args!(
                "<g class=\"shsa-c{colour}\"><path class=\"shsa-line\"{dashes} d=\"M{from} {line}H{to}\"/>\
                 <path fill=\"currentColor\" d=\"{marker}\"/><title>{}</title></g>",
                escaped(&series.name)
            ));
            let (x, y) = (px(left + 42.0), px(y + 4.5));
            let name = fitted(&series.name, TEXT, LEGEND_TEXT);
            sheet.text(format_args!("class=\"shsa-text\" x=\"{x}\" y=\"{y}\""), &name);
        }
    }

    /// The notes on the content; returns the height of the whole.
    fn notes(&self, sheet: &mut Sheet) -> f64 {
        let all = self.chart.series.iter().map(|series| series.points.len()).sum::<usize>();
        let left_out = all - self.shown.iter().map(|(_, points)| points.len()).sum::<usize>();
        let has_whiskers = |points: &Vec<Point>| points.iter().any(|point| point.low < point.high);
        let mut notes = Vec::new();
        if self.shown.iter().any(|(_, points)| has_whiskers(points)) {
            notes.push("lines: median; whiskers: lowest to highest".to_owned());
        }
        if left_out > 0 {
            notes.push(format!("{left_out} of {all} values have no place on these axes and are left out"));
        }
        let legend = TOP + LEGEND_LINE * self.chart.series.len() as f64 + 12.0;
        let below = (TOP + HEIGHT + BOTTOM).max(legend);
        if notes.is_empty() {
            return below;
        }
        let at = format!("class=\"shsa-note\" x=\"16\" y=\"{}\"", px(below + 12.0));
        sheet.text(format_args!("{at}"), &notes.join(" · "));
        below + 28.0
    }
}

/// The dashes of a series, so that lines differ without colour.
fn dashes(at: usize) -> &'static str {
    match at % 4 {
        0 => "",
        1 => " stroke-dasharray=\"8 4\"",
        2 => " stroke-dasharray=\"2 3\"",
        _ => " stroke-dasharray=\"10 3 2 3\"",
    }
}

/// The path of the marker of a series around a point.
fn marker(at: usize, x: f64, y: f64) -> String {
    let (px_x, px_y) = (px(x), px(y));
    let around = |corners: &[(f64, f64)]| {
        let corners: Vec<String> =
            corners.iter().map(|(dx, dy)| format!("{} {}", px(x + dx), px(y + dy))).collect();
        format!("M{}Z", corners.join("L"))
    };
    // Beyond the number of colours, the same colour gets another shape.
    match (at + at / COLOURS) % 6 {
        0 => format!("M{} {px_y}a4 4 0 1 0 8 0a4 4 0 1 0 -8 0Z", px(x - 4.0)),
        1 => around(&[(-3.5, -3.5), (3.5, -3.5), (3.5, 3.5), (-3.5, 3.5)]),
        2 => around(&[(0.0, -5.0), (4.5, 3.5), (-4.5, 3.5)]),
        3 => around(&[(0.0, -5.0), (5.0, 0.0), (0.0, 5.0), (-5.0, 0.0)]),
        4 => around(&[(0.0, 5.0), (4.5, -3.5), (-4.5, -3.5)]),
        _ => format!("M{px_x} {}v9M{} {px_y}h9", px(y - 4.5), px(x - 4.5)),
    }
}
