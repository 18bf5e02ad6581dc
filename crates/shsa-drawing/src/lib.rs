//! Drawings as self-contained SVG, and graphs for Graphviz: they refer to nothing outside.
//!
//! The same input gives the same text, byte for byte. A drawing has no ids, and its classes begin with `shsa-`, so that one HTML
//! page can hold several. Colours follow the reader's light or dark scheme, and no information is in colour alone.
//!
//! [`svg`] and [`dot`] draw a knowledge base, with a chosen substitution and lost signals as [`Marks`]; [`Chart`], [`Timeline`] and [`Heat`]
//! draw values; [`argument`](fn@argument) draws the [`case`] for a contract.
//!
//! # Example
//!
//! ```
//! use shsa_drawing::{Marks, dot, svg};
//!
//! let model = "{ shsa: 1, variables: { a: {}, b: {} }, relations: { twice: b = 2 * a }, signals: { /a: { variable: a } } }";
//! let knowledge = shsa_model::load(model, "twice.yaml").knowledge;
//! assert!(dot(&knowledge, &Marks::default()).starts_with("digraph"));
//! assert!(svg(&knowledge, &Marks::default()).unwrap().contains("twice"));
//! ```

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
