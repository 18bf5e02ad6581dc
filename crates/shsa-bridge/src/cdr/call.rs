//! Calls of the services that switch nodes of ROS 2 on and off, in CDR.

use bytes::Bytes;
use shsa_message::ros::Body;

/// The encapsulation: plain CDR, little-endian.
const HEAD: [u8; 4] = [0, 1, 0, 0];

/// The request of `std_srvs/srv/SetBool`.
#[must_use]
pub fn set_bool(data: bool) -> Bytes {
    message(&[u8::from(data)])
}

/// The request of `std_srvs/srv/Trigger`: a message without fields has one byte.
#[must_use]
pub fn trigger() -> Bytes {
    message(&[0])
}

/// The request of `lifecycle_msgs/srv/ChangeState` for a transition's number, without its label.
#[must_use]
pub fn change_state(transition: u8) -> Bytes {
    message(&[transition, 0, 0, 0, 1, 0, 0, 0, 0])
}

fn message(content: &[u8]) -> Bytes {
    [&HEAD, content].concat().into()
}

/// The result in a response of these services: it begins with a truth value, and a text may follow.
///
/// # Errors
/// The text of a failed call, or that the bytes are no such response.
pub fn outcome(response: &[u8]) -> Result<String, String> {
    let body = Body::cdr(response).map_err(|problem| problem.to_string())?;
    let answer_text =
        body.text(1).map_or(String::new(), |(text, _)| String::from_utf8_lossy(text).into_owned());
    match body.bytes.first() {
        Some(1) => Ok(answer_text),
        Some(0) => Err(if answer_text.is_empty() { "the service says no".to_owned() } else { answer_text }),
        _ => Err(format!("a response of {} bytes does not say whether it was done", response.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn responses_say_whether_it_was_done() {
        let with_text = |done: u8| [&HEAD, [done, 0, 0, 0, 5, 0, 0, 0].as_slice(), b"busy\0"].concat();
        assert_eq!(outcome(&with_text(1)), Ok("busy".to_owned()));
        assert_eq!(outcome(&with_text(0)), Err("busy".to_owned()));
        assert_eq!(outcome(&message(&[1])), Ok(String::new()));
        assert_eq!(outcome(&message(&[0])), Err("the service says no".to_owned()));
        for wrong in [&b""[..], b"ok", &HEAD, &[0, 1, 0, 0, 7], &[9, 9, 0, 0, 1]] {
            assert!(outcome(wrong).is_err(), "{wrong:?}");
        }
        // A length beyond the end of the message is no text.
        let cut = [&HEAD, [1, 0, 0, 0, 255, 255, 255, 255].as_slice()].concat();
        assert_eq!(outcome(&cut), Ok(String::new()));
    }
}
