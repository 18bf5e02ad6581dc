//! Drawings as self-contained SVG, and graphs for Graphviz: they refer to nothing outside.
//!
//! The same input gives the same text, byte for byte. A drawing has no ids, and its classes begin with `shsa-`, so that one HTML
//! page can hold several. Colours follow the reader's light or dark scheme, and no information is in colour alone.

mod number;
mod sheet;
mod layers;
mod graph;
mod dot;
mod svg;
mod sketch;
pub mod case;
mod argument;
mod plot;
mod heat;

pub use argument::argument;
pub use dot::dot;
pub use graph::Marks;
pub use heat::Heat;
pub use plot::{Axis, Band, Chart, Mark, Point, Scale, Series, Slice, Timeline};
pub use sheet::escaped;
pub use sketch::{Line, NODE_HEIGHT, Node, Placed, Sketch};
pub use svg::{TooLarge, svg};
