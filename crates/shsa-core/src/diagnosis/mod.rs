//! Who lies: disagreements as conflicts, minimal hitting sets as explanations, ranked.

pub mod explain;
