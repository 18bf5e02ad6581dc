//! Strips: states over time, as a row of pieces.

use shsa_drawing::escaped;
use std::fmt::Write;

/// The width of a strip in units; it is stretched to the width of its page.
const WIDTH: f64 = 1_000.0;
/// The least width of a piece, so that it is visible.
const LEAST: f64 = 1.5;

/// The look of a piece. A worse one is drawn over a better one, and differs in height, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Look {
    Good,
    Substitute,
    Doubtful,
    Bad,
}

impl Look {
    /// The class, and the distance from the top, in twelfths.
    fn drawn(self) -> (&'static str, u8) {
        match self {
            Look::Good => ("good", 0),
            Look::Substitute => ("substitute", 4),
            Look::Doubtful => ("doubtful", 2),
            Look::Bad => ("bad", 0),
        }
    }
}

/// A stretch in seconds with its state.
pub(super) struct Piece {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) look: Look,
    pub(super) name: String,
}

/// A strip over `length` seconds; `label` describes its content.
pub(super) fn strip(pieces: &[Piece], length: f64, label: &str) -> String {
    let mut drawn = String::new();
    let place = |at: f64| (at / length.max(1e-9)).clamp(0.0, 1.0) * WIDTH;
    for piece in pieces {
        let (class, top) = piece.look.drawn();
        let x = place(piece.from).min(WIDTH - LEAST);
        let (width, height) = ((place(piece.to) - x).max(LEAST), 12 - top);
        let (from, to) = (piece.from, piece.to);
        let _ = write!(
            drawn,
            "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{top}\" width=\"{width:.1}\" height=\"{height}\">\
             <title>{}: {from:.3} s to {to:.3} s</title></rect>",
            escaped(&piece.name)
        );
    }
    format!(
        "<svg class=\"strip\" viewBox=\"0 0 {WIDTH} 12\" preserveAspectRatio=\"none\" role=\"img\" aria-label=\"{}\">{drawn}</svg>",
        escaped(label)
    )
}

/// The legend of the looks.
pub(super) fn key(looks: &[(Look, &str)]) -> String {
    let sample = |&(look, name): &(Look, &str)| {
        let (class, top) = look.drawn();
        format!(
            "<span><svg class=\"sample\" viewBox=\"0 0 24 12\" aria-hidden=\"true\">\
             <rect class=\"{class}\" y=\"{top}\" width=\"24\" height=\"{}\"/></svg> {name}</span>",
            12 - top
        )
    };
    format!("<p class=\"key\">{}</p>\n", looks.iter().map(sample).collect::<String>())
}
