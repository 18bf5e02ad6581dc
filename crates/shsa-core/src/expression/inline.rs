//! Inlines formulas into each other; the size of the result is counted before it is made.

use super::Symbol;
use super::formula::{Formula, MAX_LEVELS, MAX_NODES};
use super::operation::Operation;
use alloc::collections::BTreeMap;
use alloc::vec::Vec;
use core::slice::Iter;

impl Formula {
    /// Replaces the variables that `definitions` define by their formulas, in which earlier definitions are replaced in turn: the
    /// result is one formula of a whole substitution.
    ///
    /// A variable stays where the result would exceed [`MAX_NODES`] or [`MAX_LEVELS`]; previous values of variables stay. Time:
    /// O(n log d) for n nodes in d definitions, and linear in the result.
    #[must_use]
    pub fn inline(&self, definitions: &[(Symbol, &Formula)]) -> Formula {
        let mut outlines = Outlines { all: Vec::with_capacity(definitions.len()), known: BTreeMap::new() };
        for (symbol, formula) in definitions {
            outlines.add(*symbol, formula);
        }
        outlines.of(self).write(&outlines)
    }
}

/// A formula with symbols to replace, and its size afterwards.
struct Outline<'a> {
    formula: &'a Formula,
    size: usize,
    levels: usize,
    /// For each symbol, from left to right, the outline that replaces it; ends with the last replaced symbol.
    parts: Vec<Option<usize>>,
}

struct Outlines<'a> {
    all: Vec<Outline<'a>>,
    /// The latest outline of each symbol.
    known: BTreeMap<Symbol, usize>,
}

impl<'a> Outlines<'a> {
    fn add(&mut self, symbol: Symbol, formula: &'a Formula) {
        let outline = self.of(formula);
        // A second name of a known outline is that outline, so that a chain of names needs no stack.
        let is_name = matches!(formula.operation(), Operation::Symbol(_));
        let named = outline.parts.first().copied().flatten().filter(|_| is_name);
        let at = named.unwrap_or(self.all.len());
        self.known.insert(symbol, at);
        self.all.push(outline);
    }

    /// The outline with all symbols replaced if that stays bounded, else with none.
    fn of(&self, formula: &'a Formula) -> Outline<'a> {
        let mut count = Count { room: MAX_NODES.saturating_sub(formula.size()), parts: Vec::new() };
        let (size, levels) = self.count(formula, &mut count);
        match size <= MAX_NODES && levels <= MAX_LEVELS {
            true => Outline { formula, size, levels, parts: count.parts },
            false => Outline { formula, size: formula.size(), levels: formula.levels(), parts: Vec::new() },
        }
    }

    /// The nodes and levels of a formula after the replacement.
    fn count(&self, formula: &Formula, count: &mut Count) -> (usize, usize) {
        if let Operation::Symbol(symbol) = formula.operation() {
            let part = self.known.get(&symbol).and_then(|&at| Some((at, self.all.get(at)?)));
            let part = part.filter(|(_, outline)| outline.size <= count.room);
            count.parts.push(part.map(|(at, _)| at));
            count.room -= part.map_or(0, |(_, outline)| outline.size);
            return part.map_or((1, 1), |(_, outline)| (outline.size, outline.levels));
        }
        let mut all = (1_usize, 0);
        for argument in formula.arguments() {
            let (size, levels) = self.count(argument, count);
            all = (all.0.saturating_add(size), all.1.max(levels));
        }
        (all.0, all.1 + 1)
    }
}

struct Count {
    /// The number of nodes that may be added.
    room: usize,
    parts: Vec<Option<usize>>,
}

impl Outline<'_> {
    fn write(&self, outlines: &Outlines) -> Formula {
        if self.parts.iter().all(Option::is_none) {
            return self.formula.clone();
        }
        written(self.formula, &mut self.parts.iter(), outlines)
    }
}

/// As deep as the result: each node other than a name has its own level.
fn written(formula: &Formula, parts: &mut Iter<Option<usize>>, outlines: &Outlines) -> Formula {
    if matches!(formula.operation(), Operation::Symbol(_)) {
        let part = parts.next().copied().flatten().and_then(|at| outlines.all.get(at));
        return part.map_or_else(|| formula.clone(), |part| part.write(outlines));
    }
    let arguments = formula.arguments().iter().map(|argument| written(argument, parts, outlines));
    formula.with_arguments(arguments.collect())
}
