//! The model of the battery as text: what repeats for each module and each cell is written here once.

use std::fmt::Write;

/// Modules of the battery.
pub const MODULES: usize = 8;
/// Cells of a module.
pub const CELLS: usize = 12;

/// What stands once: the needs of the car, the currents, the charge.
const HEAD: &str = include_str!("head.yaml");

/// The model, as it stands in `models/pack.yaml`.
///
/// # Example
/// ```
/// let loaded = shsa_model::load(&shsa_demos::pack::model(), "pack.yaml");
/// assert!(loaded.report.ok());
/// assert_eq!(loaded.knowledge.signals().len(), 96 + 2 * 8 + 4 + 1); // The last one is the fused charge.
/// ```
#[must_use]
pub fn model() -> String {
    let mut text = HEAD.to_owned();
    for (section, part) in
        [("variables", variables as fn(&mut String, usize)), ("relations", relations), ("signals", signals)]
    {
        let mut repeated = String::new();
        (1..=MODULES).for_each(|module| part(&mut repeated, module));
        text = text.replacen(&format!("  # {section} of the modules\n"), &repeated, 1);
    }
    let modules = |name: &str| list((1..=MODULES).map(|module| format!("{name}_{module}")));
    for name in ["module", "lowest", "temperature"] {
        text = text.replace(&format!("{name}_1 .. {name}_8"), &modules(name));
    }
    text
}

/// Names with commas between them.
fn list(names: impl Iterator<Item = String>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

/// Adds a line. Writing into a text never fails.
fn line(text: &mut String, line: std::fmt::Arguments<'_>) {
    let _ = writeln!(text, "  {line}");
}

fn variables(text: &mut String, module: usize) {
    line(text, format_args!("module_{module}: {{ unit: V, range: [18, 54] }}"));
    line(text, format_args!("lowest_{module}: {{ unit: V, range: [1.5, 4.5] }}"));
    line(text, format_args!("temperature_{module}: {{ unit: degC, range: [-40, 90], max_rate: 0.1 K/s }}"));
    for cell in 1..=CELLS {
        line(text, format_args!("cell_{module}_{cell}: {{ unit: V, range: [1.5, 4.5] }}"));
    }
}

fn relations(text: &mut String, module: usize) {
    let cells = list((1..=CELLS).map(|cell| format!("cell_{module}_{cell}")));
    line(
        text,
        format_args!("stack_{module}: {{ equation: \"module_{module} = sum({cells})\", error: 10 mV }}"),
    );
    line(
        text,
        format_args!(
            "weakest_{module}: {{ equation: \"lowest_{module} = min({cells})\", for: lowest_{module} }}"
        ),
    );
    if module < MODULES {
        let next = module + 1;
        line(
            text,
            format_args!(
                "beside_{module}: {{ equation: temperature_{module} = temperature_{next}, error: 3 K }}"
            ),
        );
    }
    for cell in 1..=CELLS {
        line(
            text,
            format_args!(
                "alike_{module}_{cell}: {{ equation: cell_{module}_{cell} = module_{module} / 12, for: cell_{module}_{cell}, \
                 when: charge > 15 %, error: 120 mV, properties: {{ cost: 3, prior: 0.03 }} }}"
            ),
        );
    }
}

fn signals(text: &mut String, module: usize) {
    line(
        text,
        format_args!(
            "/module/{module}/voltage: {{ variable: module_{module}, rate: 2 Hz, value_error: 0.05, properties: {{ prior: 0.000005 }} }}"
        ),
    );
    line(
        text,
        format_args!(
            "/module/{module}/temperature: {{ variable: temperature_{module}, rate: 1 Hz, value_error: 1, timeout: 3 s }}"
        ),
    );
    for cell in 1..=CELLS {
        line(
            text,
            format_args!(
                "/module/{module}/cell/{cell}: {{ variable: cell_{module}_{cell}, rate: 2 Hz, value_error: 0.002, properties: {{ prior: 0.0005 }} }}"
            ),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_committed_model_is_the_generated_one() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/pack.yaml");
        if std::env::var_os("SHSA_WRITE").is_some() {
            std::fs::write(path, model()).unwrap();
        }
        assert!(std::fs::read_to_string(path).unwrap() == model(), "SHSA_WRITE=1 writes {path}");
    }
}
