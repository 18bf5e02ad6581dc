//! A hatched rectangle, recognizable without its colour.
//!
//! The strokes are drawn one by one: a pattern would need an `id`, which several drawings on one page would share.

use crate::sheet::{Sheet, px};
use std::fmt::Write;

/// The distance of two strokes along the edges, in pixels.
const STEP: f64 = 7.0;

/// The upper left corner and the size, in pixels.
pub(super) struct Hatched {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Hatched {
    /// Draws the rectangle; `name`, which is already escaped, is the tooltip.
    pub(super) fn draw(&self, sheet: &mut Sheet, name: &str) {
        let &Hatched { x, y, width, height } = self;
        let (left, top, wide, high) = (px(x), px(y), px(width), px(height));
        sheet.put(format_args!(
            "<rect class=\"shsa-shade\" x=\"{left}\" y=\"{top}\" width=\"{wide}\" height=\"{high}\">"
        ));
        sheet.put(format_args!(
            "<title>{name}</title></rect><path class=\"shsa-hatch\" d=\"{}\"/>",
            self.strokes()
        ));
    }

    /// The strokes from the lower left to the upper right. On each stroke x + y is a multiple of the step, so that the strokes of
    /// neighbouring rectangles meet.
    fn strokes(&self) -> String {
        let (right, bottom) = (self.x + self.width, self.y + self.height);
        let first = ((self.x + self.y) / STEP).ceil() * STEP;
        let sums = (0..).map(|at| first + STEP * f64::from(at)).take_while(|sum| *sum < right + bottom);
        sums.fold(String::new(), |mut path, sum| {
            let (from, to) = (self.x.max(sum - bottom), right.min(sum - self.y));
            let _ = write!(path, "M{} {}L{} {}", px(from), px(sum - from), px(to), px(sum - to));
            path
        })
    }
}
