//! What a report shows of a replay: kept while it goes by, so that what is kept stays small however long it takes.

mod thinned;
mod recorder;

pub(super) use recorder::{NeedRecord, Recorder, VariableRecord, WayRecord};
pub(super) use thinned::Stretches;
