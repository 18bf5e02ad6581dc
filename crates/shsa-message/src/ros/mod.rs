//! ROS messages: the fields of types, and their places in the bytes of ROS 1 (packed) and ROS 2 (CDR).
//!
//! `types` has the fields of each type from its `definition`, `plan` finds a field in a `layout` by `steps`, `value` reads it, and
//! `extent` tells whether a message ends where its type says, and `version2` writes messages of XCDR version 2 as those of version 1.
//! A `service` is recorded as its events.

mod definition;
mod service;
mod types;
mod layout;
mod steps;
mod plan;
mod extent;
mod version2;
mod value;

pub use definition::{Count, Kind, Member, Primitive};
pub use extent::Extent;
pub use layout::{Body, Layout};
pub use plan::{Place, Plan, Target};
pub use types::{Types, full_name};
pub use value::chosen;
pub use version2::{is_version_2, recode};

#[cfg(test)]
mod tests;
