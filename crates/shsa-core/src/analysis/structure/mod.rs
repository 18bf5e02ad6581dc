//! Structural redundancy: which equations of a knowledge base can contradict each other, and thus show a fault.
