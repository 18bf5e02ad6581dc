//! The evidence at one moment: for each contract holder, the names of its evidence with the measured values.

use shsa_core::expression::parse_quantity;
use shsa_core::interval::{Interval, Truth};
use shsa_core::knowledge::{Place, Text};
use shsa_core::unit::nearest;
use shsa_model::Report;
use shsa_model::reader::Reader;
use shsa_model::tree::{self, Node, Value};

/// An example of a moment, for the help of error messages.
const EXAMPLE: &str = "/lidar: { fresh: 40 ms, sound: true }";

/// A measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measured {
    /// True, false or unknown.
    Truth(Truth),
    /// A number or its bounds in SI.
    Number(Interval),
}

/// The evidence that is known at one moment.
#[derive(Clone, Debug, Default)]
pub struct Moment {
    entries: Vec<(Text, Text, Measured)>,
}

impl Moment {
    /// Reads a moment. Each entry has a contract holder, the name of the evidence, and `true`, `false`, `unknown`, a quantity or
    /// the bounds of a quantity.
    ///
    /// # Errors
    /// Everything that is wrong with the text.
    pub fn read(text: &str, name: &str) -> Result<Moment, Report> {
        let mut reader = Reader::default();
        let tree = tree::read(text);
        let mut moment = Moment::default();
        if let Some(root) = &tree.root {
            for (subject, node) in reader.entries(root, "who has a contract, with evidence", EXAMPLE) {
                for (evidence, node) in
                    reader.entries(node, "names of evidence with what was measured", EXAMPLE)
                {
                    let measured = measured(&mut reader, node);
                    moment.entries.extend(measured.map(|it| (subject.clone(), evidence.clone(), it)));
                }
            }
        }
        let problems = [tree.problems, reader.problems].concat();
        match problems.is_empty() {
            true => Ok(moment),
            false => Err(Report::locate(name, text, problems, &tree.rewritten)),
        }
    }

    /// The measured value of a piece of evidence; `None` when the moment has no entry for it.
    #[must_use]
    pub fn of(&self, subject: &str, evidence: &str) -> Option<Measured> {
        let found = self.entries.iter().find(|(of, name, _)| of.text == subject && name.text == evidence);
        found.map(|(_, _, measured)| *measured)
    }

    /// Checks that every entry names evidence of the model; `known` lists all evidence, each with its contract holder.
    ///
    /// # Errors
    /// The entries of unknown evidence.
    pub fn check(&self, known: &[(&str, &str)], text: &str, name: &str) -> Result<(), Report> {
        let mut reader = Reader::default();
        for (subject, evidence, _) in &self.entries {
            if known.contains(&(&subject.text, &evidence.text)) {
                continue;
            }
            let own = known.iter().filter(|(of, _)| *of == subject.text).map(|(_, name)| *name);
            let (place, unknown, near): (Place, &str, _) = match own.clone().next() {
                Some(_) => (evidence.place, &evidence.text, nearest(&evidence.text, own)),
                None => {
                    (subject.place, &subject.text, nearest(&subject.text, known.iter().map(|(of, _)| *of)))
                }
            };
            let help = near.map_or_else(
                || format!("write it like `{EXAMPLE}`"),
                |near| format!("did you mean `{near}`?"),
            );
            reader.note(place, &format!("there is no evidence `{unknown}`"), &help);
        }
        match reader.problems.is_empty() {
            true => Ok(()),
            false => Err(Report::locate(name, text, reader.problems, &std::collections::BTreeSet::new())),
        }
    }
}

fn measured(reader: &mut Reader, node: &Node) -> Option<Measured> {
    match &node.value {
        Value::Null => return Some(Measured::Truth(Truth::Unknown)),
        Value::Scalar(text) => {
            let truths =
                [("true", Truth::True), ("false", Truth::False), ("unknown", Truth::Unknown)].into_iter();
            if let Some((_, truth)) = truths.clone().find(|(word, _)| *word == text.text) {
                return Some(Measured::Truth(truth));
            }
        }
        _ => {}
    }
    let (low, high) = match &node.value {
        Value::List(_) => reader.pair(node, "the lowest and the highest", "fresh: [30 ms, 50 ms]")?,
        _ => {
            let text = reader.text(node, "a truth, a quantity or its bounds", EXAMPLE)?;
            (text.clone(), text)
        }
    };
    let (low, high) = (si(reader, &low)?, si(reader, &high)?);
    Some(Measured::Number(Interval::new(low.min(high), low.max(high))))
}

/// A quantity in SI.
fn si(reader: &mut Reader, text: &Text) -> Option<f64> {
    match parse_quantity(&text.text) {
        Ok(read) => Some(read.unit.map_or(read.value, |unit| unit.to_si(read.value))),
        Err(problem) => {
            let help = problem.help.unwrap_or_else(|| format!("write it like `{EXAMPLE}`"));
            reader.note(text.place, &problem.message, &help);
            None
        }
    }
}
