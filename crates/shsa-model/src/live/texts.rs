//! The texts that a model was read from, one after the other, so that every problem is reported with its file and line.

use super::{Read, Written};
use crate::report::Report;
use shsa_core::knowledge::{self, Diagnostic, Draft, Place, Severity};
use std::collections::BTreeSet;

/// Texts one after the other, so that every place belongs to one text.
#[derive(Clone, Debug, Default)]
pub(super) struct Texts {
    /// The texts in the order of their places.
    kept: Vec<Kept>,
}

#[derive(Clone, Debug)]
struct Kept {
    /// The begin of the places of the text.
    base: u32,
    name: String,
    text: String,
    /// Starts of scalars whose text differs from the source.
    rewritten: BTreeSet<u32>,
}

impl Kept {
    /// The first place after the text; the end of the text has a place of its own.
    fn end(&self) -> u32 {
        self.base.saturating_add(u32::try_from(self.text.len()).unwrap_or(u32::MAX)).saturating_add(1)
    }
}

impl Texts {
    /// The begin of a free range of places for a text of this length.
    pub(super) fn room(&self, length: usize) -> u32 {
        let length = u32::try_from(length).unwrap_or(u32::MAX).saturating_add(1);
        let mut base = 0;
        for kept in &self.kept {
            if kept.base.saturating_sub(base) >= length {
                break;
            }
            base = kept.end();
        }
        base
    }

    pub(super) fn with(mut self, written: Written<'_>, read: &Read, base: u32) -> Texts {
        let (name, text) = (written.name.to_owned(), written.text.to_owned());
        let at = self.kept.partition_point(|kept| kept.base < base);
        self.kept.insert(at, Kept { base, name, text, rewritten: read.rewritten.clone() });
        self
    }

    /// Drops the texts to which no place of the model belongs.
    pub(super) fn forget(&mut self, draft: &Draft) {
        let used: BTreeSet<usize> = draft.places().into_iter().filter_map(|place| self.find(place)).collect();
        let mut at = 0;
        self.kept.retain(|_| {
            at += 1;
            used.contains(&(at - 1))
        });
    }

    fn find(&self, place: Place) -> Option<usize> {
        self.kept.partition_point(|kept| kept.base <= place.from).checked_sub(1)
    }

    /// The problems in the shape of the text that begins at `base`, and in the resulting model.
    pub(super) fn report(&self, base: u32, shape: Vec<Diagnostic>, found: Vec<Diagnostic>) -> Report {
        let moved = |mut problem: Diagnostic| {
            problem.place.from = problem.place.from.saturating_add(base);
            problem.place.to = problem.place.to.saturating_add(base);
            problem
        };
        self.locate(shape.into_iter().map(moved).chain(found).collect())
    }

    pub(super) fn locate(&self, found: Vec<Diagnostic>) -> Report {
        let mut of_text: Vec<Vec<Diagnostic>> = self.kept.iter().map(|_| Vec::new()).collect();
        for mut problem in found {
            let Some(at) = self.find(problem.place) else { continue };
            let base = self.kept[at].base;
            problem.place.from -= base;
            problem.place.to = problem.place.to.saturating_sub(base);
            of_text[at].push(problem);
        }
        let located = self.kept.iter().zip(of_text);
        let located = located.flat_map(|(kept, found)| {
            Report::locate(&kept.name, &kept.text, found, &kept.rewritten).diagnostics
        });
        Report { diagnostics: located.collect() }
    }

    /// The contradiction at its later place, with the file and line of the earlier one as help.
    pub(super) fn contradiction(&self, found: &knowledge::Contradiction) -> Diagnostic {
        let earlier = Diagnostic {
            severity: Severity::Error,
            place: found.earlier,
            span: None,
            message: String::new(),
            help: None,
        };
        let at = self.locate(vec![earlier]).diagnostics;
        let at = at.first().map(|found| format!("{}:{}:{}", found.file, found.line, found.column));
        Diagnostic {
            severity: Severity::Error,
            place: found.place,
            span: None,
            message: found.message.clone(),
            help: at.map(|at| format!("it is described at {at} already: make both the same, or keep one")),
        }
    }
}
