//! Files: knowledge bases, recordings, journals and stories.
