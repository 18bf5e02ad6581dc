//! Strips: what stood from when to when, as a row of pieces as wide as its page.

use shsa_format::drawing::escaped;
use std::fmt::Write;

/// A strip is so many units wide; it is stretched to the width of its page.
const WIDTH: f64 = 1_000.0;
/// What is shorter is drawn so wide, so that it is seen.
const LEAST: f64 = 1.5;

/// How a piece looks: what is worse is drawn over what is better, and is told apart by its height, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Look {
    Good,
    Substitute,
    Doubtful,
    Bad,
}

impl Look {
    /// The class, and how far from the top it begins; of 12.
    fn drawn(self) -> (&'static str, u8) {
        match self {
            Look::Good => ("good", 0),
            Look::Substitute => ("substitute", 4),
            Look::Doubtful => ("doubtful", 2),
            Look::Bad => ("bad", 0),
        }
    }
}

/// A stretch of seconds, and what stood in it.
pub(super) struct Piece {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) look: Look,
    pub(super) name: String,
}

/// A strip over `length` seconds; `label` says in words what it shows.
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

/// What the looks of a strip mean.
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
