//! Lists of numbers in JSON.

use super::scalar::scalar;
use shsa_message::json::{self, Kind, Place};
use shsa_message::path::Step;

/// An element that is no number.
pub(super) struct Foreign {
    /// Which one, from 0.
    pub(super) index: usize,
    pub(super) place: Place,
}

/// The numbers at these steps within each element of a list; without steps, its elements. What is absent or null is not-a-number.
///
/// # Errors
/// The first one that is no number.
pub(super) fn numbers(text: &str, list: Place, steps: &[Step]) -> Result<Vec<f64>, Foreign> {
    let mut values = Vec::new();
    let mut wrong = None;
    json::elements(text, list, |index, element| {
        let place = if steps.is_empty() { Some(element) } else { json::descend(text, element, steps) };
        match place.filter(|place| place.kind != Kind::Null).map(|place| (place, scalar(place, text))) {
            None => values.push(f64::NAN),
            Some((_, Some(value))) => values.push(value),
            Some((place, None)) => wrong = Some(Foreign { index, place }),
        }
        wrong.is_none()
    });
    wrong.map_or(Ok(values), Err)
}
