//! Intervals over time: one band per source, shaded stretches of time, marked moments.

use super::Axis;
use super::hatched::Hatched;
use super::ticks::Range;
use crate::sheet::{Rule, Sheet, escaped, fitted, px, width_of};

/// The intervals of several sources for one quantity over time, each source as a band.
///
/// ```
/// use shsa_drawing::{Axis, Band, Mark, Slice, Timeline};
/// let band = |name: &str, low: f64| Band {
///     name: name.into(),
///     is_accused: name == "/a",
///     slices: (0..4).map(|second| Slice { at: f64::from(second), low, high: low + 1.0 }).collect(),
/// };
/// let timeline = Timeline {
///     title: "Temperature".into(),
///     y: Axis { label: "temperature (degC)".into(), ..Axis::default() },
///     bands: vec![band("/a", 20.0), band("/b", 22.5)],
///     shaded: vec![(1.0, 3.0)],
///     shade: "they disagree".into(),
///     marks: vec![Mark { at: 2.0, name: "failed".into() }],
///     ..Timeline::default()
/// };
/// assert!(timeline.svg().contains("failed 2 s"));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timeline {
    /// The subject, in one line.
    pub title: String,
    /// Begin and end in seconds; the span of the bands when both are equal.
    pub span: (f64, f64),
    /// The vertical axis, which is linear.
    pub y: Axis,
    /// The bands in the order of the legend.
    pub bands: Vec<Band>,
    /// Shaded stretches of time in seconds, which do not overlap.
    pub shaded: Vec<(f64, f64)>,
    /// The meaning of the shaded stretches.
    pub shade: String,
    /// Moments with a name.
    pub marks: Vec<Mark>,
    /// Further notes for the reader, below the legend.
    pub notes: Vec<String>,
}

/// The intervals of one source.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Band {
    /// The name in the legend.
    pub name: String,
    /// Whether the band is the subject of the drawing: drawn in a warm colour, with a full line.
    pub is_accused: bool,
    /// The intervals in the order of time; the band is broken where they are far apart.
    pub slices: Vec<Slice>,
}

/// An interval at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slice {
    /// The time in seconds.
    pub at: f64,
    /// The lower bound.
    pub low: f64,
    /// The upper bound.
    pub high: f64,
}

/// A moment with a name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mark {
    /// The time in seconds.
    pub at: f64,
    /// The event, in one or two words.
    pub name: String,
}

/// The size of the area of the bands; with the texts around it, the drawing is about 900 pixels wide.
const WIDTH: f64 = 800.0;
const HEIGHT: f64 = 340.0;
const TOP: f64 = 112.0;
/// The place of the first row of the names of marks, and the number of rows.
const MARKS: f64 = 62.0;
const MARK_ROWS: usize = 3;
const MARK_LINE: f64 = 15.0;
const BOTTOM: f64 = 62.0;
const LEGEND_LINE: f64 = 21.0;
const TEXT: f64 = 13.0;
const SMALL: f64 = 12.0;
/// A band is broken where two slices are further apart than this multiple of the usual distance.
const BREAK: f64 = 3.5;
/// The number of colours of accused bands, and of the others.
const WARM: usize = 2;
const COLD: usize = 5;

const RULES: [Rule; 16] = [
    Rule { class: "head", light: "font-size:16px;font-weight:600", dark: "" },
    Rule { class: "grid", light: "stroke:#e3e7eb;stroke-width:1", dark: "stroke:#2b323a" },
    Rule { class: "axis", light: "stroke:#57606a;stroke-width:1", dark: "stroke:#a0aab5" },
    Rule { class: "shade", light: "fill:#f3e3a2;fill-opacity:.55", dark: "fill:#6a5a14;fill-opacity:.35" },
    Rule { class: "hatch", light: "fill:none;stroke:#8a6d00;stroke-opacity:.5", dark: "stroke:#e0c040" },
    Rule { class: "mark", light: "fill:none;stroke:#1d232b;stroke-width:1.3", dark: "stroke:#e4e8ee" },
    Rule { class: "edge", light: "fill:none;stroke-width:1.6;stroke-linejoin:round", dark: "" },
    Rule { class: "fill", light: "stroke:none;fill:currentColor;fill-opacity:.1", dark: "" },
    Rule { class: "strong", light: "stroke:none;fill:currentColor;fill-opacity:.24", dark: "" },
    // Colours that readers with any kind of colour blindness can tell apart, after Okabe and Ito.
    Rule { class: "a0", light: "stroke:#c44e00;color:#c44e00", dark: "stroke:#ff9a5c;color:#ff9a5c" },
    Rule { class: "a1", light: "stroke:#b0246a;color:#b0246a", dark: "stroke:#ff86b6;color:#ff86b6" },
    Rule { class: "b0", light: "stroke:#0068a8;color:#0068a8", dark: "stroke:#5ab0f0;color:#5ab0f0" },
    Rule { class: "b1", light: "stroke:#007f5c;color:#007f5c", dark: "stroke:#3fcf9f;color:#3fcf9f" },
    Rule { class: "b2", light: "stroke:#6b3fa0;color:#6b3fa0", dark: "stroke:#c8a6f0;color:#c8a6f0" },
    Rule { class: "b3", light: "stroke:#3f4650;color:#3f4650", dark: "stroke:#c9d0d8;color:#c9d0d8" },
    Rule { class: "b4", light: "stroke:#7a6a00;color:#7a6a00", dark: "stroke:#e0c040;color:#e0c040" },
];

impl Timeline {
    /// The drawing as a complete SVG, which begins with `<svg`. Slices that are not finite are left out.
    ///
    /// Time: linear in the slices.
    #[must_use]
    pub fn svg(&self) -> String {
        let view = View::of(self);
        let mut sheet = Sheet::new();
        let title = fitted(&self.title, 16.5, view.width() - 32.0);
        sheet.text(format_args!("class=\"shsa-text shsa-head\" x=\"16\" y=\"28\""), &title);
        view.shade(&mut sheet);
        view.axes(&mut sheet);
        for at in 0..self.bands.len() {
            view.band(&mut sheet, at);
        }
        if view.slices.iter().all(Vec::is_empty) {
            let (x, y) = (px(view.left + WIDTH / 2.0), px(TOP + HEIGHT / 2.0));
            let at = format!("class=\"shsa-note\" text-anchor=\"middle\" x=\"{x}\" y=\"{y}\"");
            sheet.text(format_args!("{at}"), "no values");
        }
        view.marks(&mut sheet);
        let height = view.legend(&mut sheet);
        sheet.finish("shsa-timeline", &RULES, (view.width(), height), &self.title, &self.description())
    }

    fn description(&self) -> String {
        let names: Vec<&str> = self.bands.iter().map(|band| &*band.name).collect();
        let marks: Vec<String> = self.marks.iter().map(described).collect();
        let marks = if marks.is_empty() { String::new() } else { format!(" Marked: {}.", marks.join(", ")) };
        format!("Bands of {} over time: {}.{marks}", self.y.label, names.join(", "))
    }
}

/// A mark in words: `failed 20.4 s`.
fn described(mark: &Mark) -> String {
    let time = format!("{:.3}", mark.at);
    let time = time.trim_end_matches('0').trim_end_matches('.');
    format!("{} {time} s", mark.name)
}

/// A timeline with everything placed.
struct View<'a> {
    timeline: &'a Timeline,
    x: Range<'a>,
    y: Range<'a>,
    /// For each band, the slices that can be shown.
    slices: Vec<Vec<Slice>>,
    left: f64,
}

/// The time axis of all timelines.
static TIME: Axis = Axis { label: String::new(), unit: String::new(), scale: super::Scale::Linear };

impl<'a> View<'a> {
    fn of(timeline: &'a Timeline) -> View<'a> {
        let ((from, to), is_given) = (timeline.span, timeline.span.0 < timeline.span.1);
        let shows = |slice: &Slice| {
            let has_place =
                TIME.shows(slice.at) && timeline.y.shows(slice.low) && timeline.y.shows(slice.high);
            has_place && slice.low <= slice.high && (!is_given || (from..=to).contains(&slice.at))
        };
        let slices: Vec<Vec<Slice>> =
            timeline.bands.iter().map(|band| band.slices.iter().copied().filter(shows).collect()).collect();
        let all = || slices.iter().flatten();
        let marks = timeline.marks.iter().map(|mark| mark.at).filter(|at| TIME.shows(*at));
        let times = || all().map(|slice| slice.at).chain(marks.clone());
        let (first, last) = match is_given && TIME.shows(from) && TIME.shows(to) {
            true => (from, to),
            false => (times().fold(f64::MAX, f64::min), times().fold(f64::MIN, f64::max)),
        };
        let (first, last) = if first <= last { (first, last) } else { (0.0, 1.0) };
        let (low, high) =
            (all().map(|s| s.low).fold(f64::MAX, f64::min), all().map(|s| s.high).fold(f64::MIN, f64::max));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        // 6 % of room on each side, so that no band lies on the frame.
        let room = ((high - low) * 0.06).max(high.abs().max(low.abs()) * 1e-9);
        let y = timeline.y.exact(low - room, high + room, 6.0);
        let texts = y.ticks().iter().map(|tick| width_of(&y.written(tick.value), SMALL)).fold(0.0, f64::max);
        View { timeline, x: TIME.exact(first, last, 9.0), y, slices, left: 16.0 + texts + 10.0 }
    }

    fn width(&self) -> f64 {
        self.left + WIDTH + 28.0
    }

    fn x_at(&self, value: f64) -> f64 {
        self.left + self.x.share(value) * WIDTH
    }

    fn y_at(&self, value: f64) -> f64 {
        TOP + (1.0 - self.y.share(value)) * HEIGHT
    }

    fn shade(&self, sheet: &mut Sheet) {
        for &(from, to) in &self.timeline.shaded {
            if !(TIME.shows(from) && TIME.shows(to) && from <= to) {
                continue;
            }
            let (from, to) = (self.x_at(from), self.x_at(to));
            let name = escaped(&self.timeline.shade);
            Hatched { x: from, y: TOP, width: (to - from).max(1.5), height: HEIGHT }.draw(sheet, &name);
        }
    }

    fn axes(&self, sheet: &mut Sheet) {
        let (left, right, bottom) = (px(self.left), px(self.left + WIDTH), px(TOP + HEIGHT));
        for tick in self.y.ticks() {
            let y = self.y_at(tick.value);
            sheet.put(format_args!("<path class=\"shsa-grid\" d=\"M{left} {}H{right}\"/>", px(y)));
            let (x, y) = (px(self.left - 8.0), px(y + 4.0));
            let at = format_args!("class=\"shsa-note\" text-anchor=\"end\" x=\"{x}\" y=\"{y}\"");
            sheet.text(at, &self.y.written(tick.value));
        }
        for tick in self.x.ticks() {
            let (x, y) = (px(self.x_at(tick.value)), px(TOP + HEIGHT + 19.0));
            sheet.put(format_args!("<path class=\"shsa-grid\" d=\"M{x} {}V{bottom}\"/>", px(TOP)));
            let at = format_args!("class=\"shsa-note\" text-anchor=\"middle\" x=\"{x}\" y=\"{y}\"");
            sheet.text(at, &self.x.written(tick.value));
        }
        sheet.put(format_args!("<path class=\"shsa-axis\" d=\"M{left} {bottom}H{right}\"/>"));
        let (x, y) = (px(self.left + WIDTH / 2.0), px(TOP + HEIGHT + 41.0));
        let at = format_args!("class=\"shsa-text\" text-anchor=\"middle\" x=\"{x}\" y=\"{y}\"");
        sheet.text(at, "time (s)");
        let at = format_args!("class=\"shsa-text\" x=\"16\" y=\"50\"");
        sheet.text(at, &fitted(&self.timeline.y.label, TEXT, 320.0));
    }

    /// The class of a band's colour.
    fn colour(&self, at: usize) -> String {
        let is_accused = |at: &usize| self.timeline.bands.get(*at).is_some_and(|band| band.is_accused);
        let before = (0..at).filter(|other| is_accused(other) == is_accused(&at)).count();
        if is_accused(&at) { format!("a{}", before % WARM) } else { format!("b{}", before % COLD) }
    }

    fn band(&self, sheet: &mut Sheet, at: usize) {
        let (Some(band), Some(slices)) = (self.timeline.bands.get(at), self.slices.get(at)) else { return };
        sheet.put(format_args!("<g class=\"shsa-{}\">", self.colour(at)));
        for piece in pieces(slices) {
            self.piece(sheet, piece, fill(band), dashes(at, band.is_accused));
        }
        let name = escaped(&band.name);
        sheet.put(format_args!("<title>{name}</title></g>"));
    }

    fn piece(&self, sheet: &mut Sheet, piece: &[Slice], fill: &str, dashes: &str) {
        let place = |at: f64, value: f64| format!("{} {}", px(self.x_at(at)), px(self.y_at(value)));
        if let [only] = piece {
            let (x, high, low) = (px(self.x_at(only.at)), px(self.y_at(only.high)), px(self.y_at(only.low)));
            let (from, to) = (px(self.x_at(only.at) - 3.0), px(self.x_at(only.at) + 3.0));
            let path = format!("M{from} {low}H{to}M{x} {low}V{high}M{from} {high}H{to}");
            return sheet.put(format_args!("<path class=\"shsa-edge\" d=\"{path}\"/>"));
        }
        let upper: Vec<String> = piece.iter().map(|slice| place(slice.at, slice.high)).collect();
        let lower: Vec<String> = piece.iter().map(|slice| place(slice.at, slice.low)).collect();
        let back: Vec<&str> = lower.iter().rev().map(String::as_str).collect();
        let (upper, lower, back) = (upper.join("L"), lower.join("L"), back.join("L"));
        sheet.put(format_args!("<path class=\"{fill}\" d=\"M{upper}L{back}Z\"/>"));
        sheet.put(format_args!("<path class=\"shsa-edge\"{dashes} d=\"M{upper}M{lower}\"/>"));
    }

    /// Lines at the marked moments, with the names above, each in the first row with room.
    fn marks(&self, sheet: &mut Sheet) {
        let mut free = [f64::MIN; MARK_ROWS];
        let mut marks: Vec<&Mark> = self.timeline.marks.iter().filter(|mark| self.has_place(mark)).collect();
        marks.sort_by(|one, other| one.at.total_cmp(&other.at));
        for mark in marks {
            let (x, text) = (self.x_at(mark.at), described(mark));
            let width = width_of(&text, SMALL);
            // At the right end, the name stands left of its line.
            let end = self.left + WIDTH + 20.0;
            let from = if x + 5.0 + width > end { x - 5.0 - width } else { x + 5.0 };
            let Some(row) = free.iter().position(|free| *free <= from.min(x)) else {
                // The name would overlap another one.
                self.unnamed(sheet, x, &text);
                continue;
            };
            free[row] = from.max(x) + if from < x { 8.0 } else { width + 8.0 };
            let y = MARKS + MARK_LINE * row as f64 + 12.0;
            let line = format!("M{} {}V{}", px(x), px(y - 9.0), px(TOP + HEIGHT));
            sheet.put(format_args!("<path class=\"shsa-mark\" stroke-dasharray=\"5 3\" d=\"{line}\"/>"));
            let at = format!("class=\"shsa-text\" font-size=\"12\" x=\"{}\" y=\"{}\"", px(from), px(y));
            sheet.text(format_args!("{at}"), &text);
        }
    }

    fn unnamed(&self, sheet: &mut Sheet, x: f64, text: &str) {
        let (line, text) = (format!("M{} {}V{}", px(x), px(TOP), px(TOP + HEIGHT)), escaped(text));
        sheet.put(format_args!(
            "<path class=\"shsa-mark\" stroke-dasharray=\"5 3\" d=\"{line}\"><title>{text}</title></path>"
        ));
    }

    fn has_place(&self, mark: &Mark) -> bool {
        let (from, to) = self.timeline.span;
        TIME.shows(mark.at) && (from >= to || (from..=to).contains(&mark.at))
    }

    /// The names of bands and shades, and the notes; returns the height of the whole.
    fn legend(&self, sheet: &mut Sheet) -> f64 {
        let mut y = TOP + HEIGHT + BOTTOM + 8.0;
        let text = |sheet: &mut Sheet, y: f64, text: &str| {
            let (x, y) = (px(self.left + 44.0), px(y + 4.5));
            let text = fitted(text, TEXT, WIDTH - 60.0);
            sheet.text(format_args!("class=\"shsa-text\" x=\"{x}\" y=\"{y}\""), &text);
        };
        for (at, band) in self.timeline.bands.iter().enumerate() {
            let (x, top, bottom, end) = (px(self.left), px(y - 6.0), px(y + 6.0), px(self.left + 34.0));
            let (colour, fill, dashes) = (self.colour(at), fill(band), dashes(at, band.is_accused));
            sheet.put(format_args!(
                "<g class=\"shsa-{colour}\"><path class=\"{fill}\" d=\"M{x} {top}H{end}V{bottom}H{x}Z\"/>\
                 <path class=\"shsa-edge\"{dashes} d=\"M{x} {top}H{end}M{x} {bottom}H{end}\"/></g>"
            ));
            text(sheet, y, &band.name);
            y += LEGEND_LINE;
        }
        if !self.timeline.shaded.is_empty() {
            let name = escaped(&self.timeline.shade);
            Hatched { x: self.left, y: y - 7.0, width: 34.0, height: 14.0 }.draw(sheet, &name);
            text(sheet, y, &self.timeline.shade);
            y += LEGEND_LINE;
        }
        for note in &self.timeline.notes {
            let at = format!("class=\"shsa-note\" x=\"{}\" y=\"{}\"", px(self.left), px(y + 4.0));
            sheet.text(format_args!("{at}"), &fitted(note, SMALL, WIDTH));
            y += LEGEND_LINE;
        }
        y + 4.0
    }
}

/// The class of the inside of a band: many agreeing bands must not hide the subject of the drawing.
fn fill(band: &Band) -> &'static str {
    if band.is_accused { "shsa-strong" } else { "shsa-fill" }
}

/// A full line for the subject of the drawing; the other bands differ without colour, too.
fn dashes(at: usize, is_accused: bool) -> &'static str {
    match at % 4 {
        _ if is_accused => "",
        0 => " stroke-dasharray=\"7 3\"",
        1 => " stroke-dasharray=\"2 2.5\"",
        2 => " stroke-dasharray=\"9 3 2 3\"",
        _ => " stroke-dasharray=\"4 4\"",
    }
}

/// Groups of slices whose distances are not much larger than usual.
fn pieces(slices: &[Slice]) -> impl Iterator<Item = &[Slice]> {
    let mut gaps: Vec<f64> =
        slices.iter().zip(slices.iter().skip(1)).map(|(one, next)| next.at - one.at).collect();
    gaps.sort_by(f64::total_cmp);
    let usual = gaps.get(gaps.len() / 2).copied().unwrap_or(0.0);
    slices.chunk_by(move |one, next| next.at - one.at <= BREAK * usual)
}
