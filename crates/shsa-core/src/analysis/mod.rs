//! What a knowledge base can do at all, known before anything runs: which faults show, which can be told apart.

pub mod structure;
