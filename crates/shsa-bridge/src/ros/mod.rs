//! What ROS 2 has on Zenoh and on DDS alike: names, the forms of messages, and its topic of diagnostics.

mod diagnostics;
mod form;

pub(crate) use diagnostics::publish as publish_diagnostics;
pub(crate) use form::{Form, type_for};

use crate::BridgeError;
use shsa_message::ros::full_name;

/// A type's name as DDS writes it: `std_msgs::msg::dds_::Float64_`.
pub(crate) fn dds_name(message_type: &str) -> String {
    let full = full_name(message_type);
    match full.rsplit_once('/') {
        Some((package, name)) => format!("{}::dds_::{name}_", package.replace('/', "::")),
        None => full.into_owned(),
    }
}

/// Without the leading slash.
pub(crate) fn bare(topic: &str) -> &str {
    topic.trim_start_matches('/')
}

/// The error of a type without a definition.
pub(crate) fn unknown(message_type: &str) -> BridgeError {
    let name = full_name(message_type);
    BridgeError::Configuration(format!("the message type {name} is not known; give its .msg files"))
}

/// A name of ROS 2: letters, digits and underscores, between slashes.
pub(crate) fn check_name(what: &str, name: &str) -> Result<(), BridgeError> {
    let is_part = |part: &str| {
        let mut letters = part.chars();
        letters.next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_')
            && letters.all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
    };
    if bare(name).split('/').all(is_part) {
        return Ok(());
    }
    let help = "letters, digits and underscores between slashes, no part beginning with a digit";
    Err(BridgeError::Configuration(format!("{what} '{name}' is no name for ROS 2: {help}")))
}
