//! How recordings are read: arguments for facts that a file lacks, the same for every command.

use crate::headings::READING;
use crate::show;
use anyhow::bail;
use shsa_core::time::Span;
use shsa_message::moment::DateOrder;
use shsa_message::span::parse_span;
use shsa_message::zone::Zone;
use shsa_recording::{Files, ReadOptions, Recording, Wanted};
use std::path::PathBuf;
use std::str::FromStr;

/// What recordings do not say of themselves.
#[derive(clap::Args)]
pub(crate) struct ReadArguments {
    /// The column with the time, where a table's header does not show it.
    #[arg(long, value_name = "NAME", help_heading = READING)]
    time_column: Option<String>,
    /// What one step of the time column is: s, ms, us, ns or a span such as 5s.
    #[arg(long, value_name = "UNIT", value_parser = parse_span, help_heading = READING)]
    time_unit: Option<Span>,
    /// The order of day, month and year in dates that fit several (dmy, mdy, ymd); else the dates of all files decide.
    #[arg(long, value_name = "ORDER", help_heading = READING)]
    date_order: Option<DateOrder>,
    /// Where times without a zone were written down: UTC, +02:00, Europe/Vienna; log.csv=Europe/Vienna for one recording, several times.
    #[arg(long, value_name = "ZONE", allow_hyphen_values = true, help_heading = READING)]
    time_zone: Vec<ZoneOf>,
    /// A folder with the definitions of ROS 2 messages that recordings lack, PACKAGE/msg/NAME.msg; may be given several times.
    #[arg(long, value_name = "DIR", help_heading = READING)]
    messages: Vec<PathBuf>,
    /// A database of CAN messages (DBC); may be given several times.
    #[arg(long, value_name = "FILE", help_heading = READING)]
    dbc: Vec<PathBuf>,
}

/// A zone of all recordings, or of those in a file or folder.
#[derive(Clone)]
struct ZoneOf {
    file: Option<String>,
    zone: Zone,
}

impl FromStr for ZoneOf {
    type Err = String;

    fn from_str(text: &str) -> Result<ZoneOf, String> {
        match text.rsplit_once('=') {
            Some(("", _)) => Err("write FILE=ZONE, or the zone alone".to_owned()),
            Some((file, zone)) => Ok(ZoneOf { file: Some(file.to_owned()), zone: zone.parse()? }),
            None => Ok(ZoneOf { file: None, zone: text.parse()? }),
        }
    }
}

impl ReadArguments {
    /// The options of the readers; of several zones for all recordings, the last one.
    pub(crate) fn options(&self) -> ReadOptions {
        let of_all = self.time_zone.iter().rev().find(|it| it.file.is_none());
        let of_one = |it: &ZoneOf| Some((it.file.clone()?, it.zone.clone()));
        ReadOptions {
            time_column: self.time_column.clone(),
            time_scale: self.time_unit,
            date_order: self.date_order,
            zone: of_all.map(|it| it.zone.clone()).unwrap_or_default(),
            zones: self.time_zone.iter().filter_map(of_one).collect(),
            messages: self.messages.clone(),
            dbc: self.dbc.clone(),
            files: Files::Disk,
        }
    }

    /// Reads the signals of a model, and shows what the reader has to say.
    ///
    /// # Errors
    /// When nothing can be read, or the recordings have none of the signals.
    pub(crate) fn read(&self, recordings: &[PathBuf], wanted: &[Wanted]) -> anyhow::Result<Recording> {
        let recording = shsa_recording::read(recordings, wanted, &self.options())?;
        show::recording(&recording);
        if let Some(cause) = recording.cause() {
            bail!("nothing of the recording can be read: {cause}");
        }
        if recording.samples.is_empty() {
            bail!(
                "none of the model's signals is in the recording; `source` in the model says where each is found"
            );
        }
        Ok(recording)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zone_may_be_of_one_recording() {
        let file = |text: &str| text.parse::<ZoneOf>().map(|it| it.file);
        assert_eq!(file("Europe/Vienna"), Ok(None));
        assert_eq!(file("a=b.csv=+02:00"), Ok(Some("a=b.csv".into())));
        assert!(file("=UTC").is_err() && file("log.csv=Nowhere").is_err());
    }
}
