//! Files: knowledge bases, recordings, journals and stories.

pub mod model;
