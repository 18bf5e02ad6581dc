//! The evidence of one moment, with the text that it was read from.

use crate::ReportError;
use shsa_format::moment::Moment;

/// The evidence of one moment, with the text that it was read from: problems with it have places.
///
/// # Example
/// ```
/// use shsa_report::assurance::WrittenMoment;
///
/// assert!(WrittenMoment::read("/lidar: { fresh: 40 ms, sound: true }".to_owned(), "evidence.yaml").is_ok());
/// assert!(WrittenMoment::read("fresh".to_owned(), "evidence.yaml").is_err());
/// ```
#[derive(Clone, Debug)]
pub struct WrittenMoment {
    text: String,
    name: String,
    pub(super) moment: Moment,
}

impl WrittenMoment {
    /// Reads a moment; `name` is that of its file.
    ///
    /// # Errors
    /// [`ReportError::Moment`] with everything that is wrong with the text.
    pub fn read(text: String, name: &str) -> Result<WrittenMoment, ReportError> {
        let moment = Moment::read(&text, name).map_err(ReportError::Moment)?;
        Ok(WrittenMoment { text, name: name.to_owned(), moment })
    }

    /// Checks that every entry is known evidence: who has it, and its name.
    pub(super) fn check(&self, known: &[(&str, &str)]) -> Result<(), ReportError> {
        self.moment.check(known, &self.text, &self.name).map_err(ReportError::Moment)
    }
}
