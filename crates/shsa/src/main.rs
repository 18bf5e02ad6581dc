//! The command `shsa`.

fn main() {}
