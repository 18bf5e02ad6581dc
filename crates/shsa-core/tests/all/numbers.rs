//! `docs/numbers.md` has the table of the numbers that decide, and no other.

use shsa_core::numbers::{ALL, Number};
use std::fs;

#[test]
fn the_page_has_every_number_that_decides() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/numbers.md");
    let page = fs::read_to_string(path).unwrap();
    let (head, _) = page.split_once("| number").unwrap();
    let expected = format!("{head}{}", table());
    if std::env::var_os("SHSA_WRITE").is_some() {
        return fs::write(path, expected).unwrap();
    }
    assert!(page == expected, "docs/numbers.md is out of date: run this test with SHSA_WRITE=1\n{expected}");
}

fn table() -> String {
    let head = "| number | value | what it decides | from | set by |\n|---|---|---|---|---|\n";
    head.to_owned() + &ALL.iter().map(row).collect::<String>()
}

fn row(number: &Number) -> String {
    let value =
        number.value.replace("Span::from_millis(", "").replace("_000)", " s").replace("250)", "250 ms");
    let unit = if number.unit == "ns" { String::new() } else { format!(" {}", number.unit) };
    let key = number.key.map(|key| format!("`{key}`")).unwrap_or_default();
    let about = number.about.trim();
    format!("| `{}` | {value}{unit} | {about} | {} | {key} |\n", number.name, number.source)
}
