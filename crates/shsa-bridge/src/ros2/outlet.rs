//! The publications of one topic.

use super::name::WireType;
use crate::ros::Form;
use ::zenoh::pubsub::Publisher;

/// A topic that is published.
#[derive(Debug)]
pub(super) struct Outlet {
    /// `Some` from the first message on.
    pub(super) publisher: Option<Publisher<'static>>,
    pub(super) wire_type: WireType,
    pub(super) form: Form,
    /// The number of the last message.
    pub(super) sequence: i64,
}
