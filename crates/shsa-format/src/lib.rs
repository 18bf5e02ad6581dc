//! Files: knowledge bases, recordings, faults to inject, journals and stories.

pub mod drive;
pub mod drawing;
pub mod fault;
pub mod journal;
pub mod model;
pub mod recording;
pub mod story;
