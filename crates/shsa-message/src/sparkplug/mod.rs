//! The payloads of Sparkplug B: metrics with their names, times, types and qualities, in Protocol Buffers.
//!
//! Format: Eclipse Sparkplug 3.0.0, chapter 6. A payload comes from a stranger: nothing is copied or allocated by reading, except
//! the elements of arrays, and an invalid part makes the whole payload invalid.

mod data_type;
mod metric;
mod writer;

pub use data_type::DataType;
pub use metric::{Known, Metric, Payload, Value, resolved};
pub use writer::{NewMetric, NewValue, Property, Writer};

/// The quality codes of the property `Quality`.
pub mod quality {
    /// The value must not be used.
    pub const BAD: i32 = 0;
    /// The value can be used; also what a metric without the property has.
    pub const GOOD: i32 = 192;
    /// The value was good, and may have changed since.
    pub const STALE: i32 = 500;
}

/// The key of the property with the quality of a metric.
pub const QUALITY: &str = "Quality";
/// The metric that relates the birth of an edge node to its death.
pub const BD_SEQ: &str = "bdSeq";
/// The metric whose writing asks an edge node for its births.
pub const REBIRTH: &str = "Node Control/Rebirth";

#[cfg(test)]
mod tests;
