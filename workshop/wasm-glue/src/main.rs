//! Makes a module of JavaScript of the engine in WebAssembly: `wasm-glue FILE.wasm FOLDER`.

use anyhow::{Context, Result};
use std::env;
use wasm_bindgen_cli_support::Bindgen;

fn main() -> Result<()> {
    let mut arguments = env::args().skip(1);
    let (input, folder) =
        arguments.next().zip(arguments.next()).context("usage: wasm-glue FILE.wasm FOLDER")?;
    Bindgen::new().input_path(&input).web(true)?.typescript(true).out_name("shsa").generate(&folder)
}
