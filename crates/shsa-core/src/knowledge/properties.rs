//! Named numbers of an element.

use alloc::collections::BTreeSet;
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::ops::Index;

/// The property for the accuracy of a variable or signal: a share.
pub const ACCURACY: &str = "accuracy";
/// The property for the cost of a relation; 1 where it is not given.
pub const COST: &str = "cost";
/// The property for the integrity level of a signal or relation.
pub const INTEGRITY: &str = "integrity";
/// The property for the prior probability of a fault of a signal or relation.
pub const PRIOR: &str = "prior";

/// The properties with a meaning of their own, beside a model's utility.
pub const PROPERTIES: [&str; 4] = [ACCURACY, COST, INTEGRITY, PRIOR];

/// A lower probability of a fault counts as none.
pub const NEGLIGIBLE: f64 = 1e-6;

/// At most this many places are reserved for a list of known length.
const MOST_RESERVED: usize = 8;

/// Named numbers of an element, such as `accuracy` or `cost`, ascending by name.
///
/// Most elements have at most two of them, and a model uses few names: equal names may share their text ([`Properties::insert`]
/// with an `Arc<str>`), and an element without properties allocates nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Properties {
    numbers: Vec<(Arc<str>, f64)>,
}

impl Properties {
    /// No properties.
    #[must_use]
    pub const fn new() -> Properties {
        Properties { numbers: Vec::new() }
    }

    /// The number of a name. Time: logarithmic in the names.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&f64> {
        self.place(name).ok().and_then(|at| self.numbers.get(at)).map(|(_, number)| number)
    }

    /// The declared probability of a fault; `None` where none is declared.
    #[must_use]
    pub fn prior(&self) -> Option<f64> {
        self.get(PRIOR).copied()
    }

    /// Sets the number of a name; returns the previous one.
    pub fn insert(&mut self, name: impl Into<Arc<str>>, number: f64) -> Option<f64> {
        let name = name.into();
        match self.place(&name) {
            Ok(at) => self.numbers.get_mut(at).map(|(_, known)| core::mem::replace(known, number)),
            Err(at) => {
                self.numbers.reserve_exact(1);
                self.numbers.insert(at, (name, number));
                None
            }
        }
    }

    /// Removes a name; returns its number.
    pub fn remove(&mut self, name: &str) -> Option<f64> {
        self.place(name).ok().map(|at| self.numbers.remove(at).1)
    }

    /// Whether a name has a number.
    #[must_use]
    pub fn contains_key(&self, name: &str) -> bool {
        self.place(name).is_ok()
    }

    /// The names, ascending.
    pub fn keys(&self) -> impl ExactSizeIterator<Item = &str> {
        self.numbers.iter().map(|(name, _)| &**name)
    }

    /// The number of properties.
    #[must_use]
    pub fn len(&self) -> usize {
        self.numbers.len()
    }

    /// Whether there are no properties.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    /// Names with their numbers, ascending by name.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&str, &f64)> {
        self.numbers.iter().map(|(name, number)| (&**name, number))
    }

    fn place(&self, name: &str) -> Result<usize, usize> {
        self.numbers.binary_search_by(|(known, _)| (**known).cmp(name))
    }
}

impl Index<&str> for Properties {
    type Output = f64;

    /// The number of a name; NaN for an unknown name.
    fn index(&self, name: &str) -> &f64 {
        self.get(name).unwrap_or(&f64::NAN)
    }
}

impl<N: Into<Arc<str>>> FromIterator<(N, f64)> for Properties {
    /// The last of several numbers of one name counts.
    fn from_iter<T: IntoIterator<Item = (N, f64)>>(numbers: T) -> Properties {
        let numbers = numbers.into_iter();
        // Reserves exactly, where the length is known: most lists have one or two elements.
        let mut sorted = Vec::with_capacity(numbers.size_hint().1.map_or(0, |most| most.min(MOST_RESERVED)));
        sorted.extend(numbers.map(|(name, number)| (name.into(), number)));
        sorted.sort_by(|(a, _): &(Arc<str>, f64), (b, _)| a.cmp(b));
        sorted.dedup_by(|later, kept| {
            let same = later.0 == kept.0;
            if same {
                kept.1 = later.1;
            }
            same
        });
        Properties { numbers: sorted }
    }
}

impl<N: Into<Arc<str>>, const COUNT: usize> From<[(N, f64); COUNT]> for Properties {
    fn from(numbers: [(N, f64); COUNT]) -> Properties {
        numbers.into_iter().collect()
    }
}

/// The names of a model, so that each text is kept once.
#[derive(Debug, Default)]
pub(super) struct SharedNames {
    known: BTreeSet<Arc<str>>,
}

impl SharedNames {
    /// The shared text of a name.
    pub(super) fn share(&mut self, name: &str) -> Arc<str> {
        if let Some(known) = self.known.get(name) {
            return Arc::clone(known);
        }
        let shared: Arc<str> = Arc::from(name);
        self.known.insert(Arc::clone(&shared));
        shared
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::String;

    #[test]
    fn numbers_are_found_by_name() {
        let mut properties = Properties::from([(String::from("cost"), 2.0), (String::from("accuracy"), 0.5)]);
        assert_eq!(properties.insert("cost", 3.0), Some(2.0));
        assert_eq!((properties["cost"], properties.get("prior")), (3.0, None));
        assert_eq!(properties.iter().collect::<Vec<_>>(), [("accuracy", &0.5), ("cost", &3.0)]);
        let twice: Properties = [("b", 1.0), ("a", 2.0), ("b", 3.0)].into();
        assert_eq!(twice.iter().collect::<Vec<_>>(), [("a", &2.0), ("b", &3.0)]);
        assert_eq!((properties.remove("accuracy"), properties.len()), (Some(0.5), 1));
    }
}
