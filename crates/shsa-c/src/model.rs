//! A checked model, and the names of its elements.

use crate::error::Error;
use crate::words::c_text;
use shsa_core::knowledge::{Id, KnowledgeBase};
use std::ffi::CString;

/// What stands where an index stands and there is no element.
pub const NO_ID: u32 = u32::MAX;

/// The kinds of elements of a model that have names. Each kind is counted from 0, in the order of the file.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Element {
    /// Signals.
    Signal = 0,
    /// Variables.
    Variable = 1,
    /// Relations.
    Relation = 2,
    /// Needs, by the names under which they are published.
    Need = 3,
}

/// A checked model. It never changes, so any number of threads may read it.
pub struct Model {
    knowledge: KnowledgeBase,
    /// The names of the elements, by kind.
    names: [Vec<CString>; 4],
}

impl Model {
    /// Reads a model; `name` is what errors call the text.
    ///
    /// # Errors
    /// The first error of the text.
    pub(crate) fn load(text: &str, name: &str) -> Result<Model, Box<Error>> {
        let loaded = shsa_model::load(text, name);
        match Error::of_model(&loaded.report) {
            Some(error) => Err(Box::new(error)),
            None => Ok(Model { names: names(&loaded.knowledge), knowledge: loaded.knowledge }),
        }
    }

    pub(crate) fn knowledge(&self) -> &KnowledgeBase {
        &self.knowledge
    }

    /// The names of a kind of elements; empty for an unknown kind.
    pub(crate) fn names(&self, element: u32) -> &[CString] {
        self.names.get(element as usize).map_or(&[], Vec::as_slice)
    }

    /// The element of a name; [`NO_ID`] where none has it. A need is also found by its variable, if it is the only one of it.
    pub(crate) fn find(&self, element: u32, name: &str) -> u32 {
        if element == Element::Need as u32 {
            return match *self.knowledge.needs_named(name) {
                [need] => index(need),
                _ => NO_ID,
            };
        }
        let found = self.names(element).iter().position(|it| it.to_str() == Ok(name));
        found.and_then(|at| u32::try_from(at).ok()).unwrap_or(NO_ID)
    }
}

/// The number of an element.
pub(crate) fn index(id: impl Id) -> u32 {
    u32::try_from(id.index()).unwrap_or(NO_ID)
}

/// The names in the order of [`Element`].
fn names(knowledge: &KnowledgeBase) -> [Vec<CString>; 4] {
    [
        knowledge.signals().iter().map(|it| c_text(&it.name)).collect(),
        knowledge.variables().iter().map(|it| c_text(&it.name)).collect(),
        knowledge.relations().iter().map(|it| c_text(&it.name)).collect(),
        knowledge.needs().iter().map(|it| c_text(&it.signal)).collect(),
    ]
}
