//! What stands between the tables: how to read them, what is not detected, and why.

pub(super) const HEAD: &str = "# Results\n";
pub(super) const CLEAN: &str = "";
pub(super) const CAR: &str = "";
pub(super) const PAIRS: &str = "\n";
pub(super) const GRID: &str = "";
pub(super) const QUAD: &str = "";
pub(super) const HUSKY: &str = "";
pub(super) const MOTES: &str = "";
