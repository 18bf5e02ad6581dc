//! The instructions of a filter's step and of the same step written by hand, counted by valgrind: other work on the machine does not
//! change them.
//!
//! Without arguments the program prints a table, and calls itself under valgrind with the name of a step and a number of steps.

mod steps;

use std::error::Error;
use std::process::Command;

/// Numbers of steps: their difference leaves out the beginning.
const STEPS: [u64; 2] = [400, 1400];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [name, count] = arguments.as_slice() {
        let mut step = steps::step(name).ok_or("no step has this name")?;
        (0..count.parse::<u64>()?).for_each(|_| step());
        return Ok(());
    }
    println!("| predict and update | instructions | by hand | ratio |\n|---|---|---|---|");
    for (name, by_hand) in steps::STEPS {
        let ours = instructions(name)?;
        let other = by_hand.map(instructions).transpose()?;
        let cell = |shown: Option<String>| shown.unwrap_or_default();
        let (hand, ratio) = (other.map(|it| format!("{it:.0}")), other.map(|it| format!("{:.2}", ours / it)));
        println!("| {name} | {ours:.0} | {} | {} |", cell(hand), cell(ratio));
    }
    Ok(())
}

/// Instructions of a step.
fn instructions(name: &str) -> Result<f64, Box<dyn Error>> {
    let [few, many] = STEPS;
    Ok((counted(name, many)? - counted(name, few)?) / (many - few) as f64)
}

/// Instructions of the program that takes this many steps.
fn counted(name: &str, count: u64) -> Result<f64, Box<dyn Error>> {
    let run = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null", "--log-fd=1"])
        .arg(std::env::current_exe()?)
        .args([name, &count.to_string()])
        .output()
        .map_err(|error| format!("valgrind does not start: {error}"))?;
    let reported = String::from_utf8_lossy(&run.stdout);
    let collected = reported.lines().find_map(|line| line.split_once("Collected :"));
    let number = collected.and_then(|(_, rest)| rest.split_whitespace().next()?.parse().ok());
    Ok(number.ok_or_else(|| format!("valgrind tells no count: {reported}"))?)
}
