//! The compiled part of the Python package `shsa`: `package/shsa` gives its functions their Python form.
//!
//! Results cross the border as the JSON and the Parquet that the command writes, so they are the same. `problem` makes exceptions,
//! `work` runs long tasks without Python's lock, `model`, `columns`, `engine`, `replay`, `lab`, `bus` and `runtime` are the parts of the package.

mod problem;
mod work;
mod model;
mod columns;
mod engine;
mod replay;
mod lab;
mod bus;
mod runtime;

/// The module `shsa._shsa`.
#[pyo3::pymodule]
mod _shsa {
    #[pymodule_export]
    use super::engine::Engine;
    #[pymodule_export]
    use super::lab::{calibrate, campaign, doctor, learn};
    #[pymodule_export]
    use super::model::Model;
    #[pymodule_export]
    use super::replay::{Replay, replay};
    #[pymodule_export]
    use super::runtime::Runtime;
}
