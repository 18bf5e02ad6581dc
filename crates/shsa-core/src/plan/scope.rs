//! The part of a graph that a search from one root can reach and use, renumbered densely, with what to hope for.

use super::graph::{Producer, View};
use super::utility::Weight;
use crate::knowledge::{Id, IdVec, RelationId, VariableId};
use alloc::vec::Vec;

macro_rules! local_id {
    ($(#[$doc:meta] $name:ident)*) => {$(
        #[$doc]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub(super) struct $name(u32);

        impl Id for $name {
            fn from_index(index: usize) -> Self {
                $name(index as u32)
            }
            fn index(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

local_id! {
    /// A variable that has to be decided when a substitution needs it; the root is the first.
    Place
    /// One way of knowing the variable of a place.
    ChoiceId
    /// A relation that a substitution may use for several outputs, and then counts once.
    Team
}

/// A part of the vectors of a scope.
#[derive(Clone, Copy, Debug)]
struct Range {
    start: u32,
    end: u32,
}

impl Range {
    fn of<T>(self, items: &[T]) -> &[T] {
        items.get(self.start as usize..self.end as usize).unwrap_or_default()
    }
}

/// A relation above a place, or the place's own signals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    /// `None`: the variable is provided, and used as it comes.
    pub(super) relation: Option<RelationId>,
    /// What it costs, if the relation is not used already.
    pub(super) weight: Weight,
    /// Set when the relation may be used for another output at the same time.
    pub(super) team: Option<Team>,
    /// The same relation may produce another variable of the scope.
    pub(super) ambiguous: bool,
    inputs: Range,
    sources: Range,
}

/// Places and choices; the root is the first place.
#[derive(Debug)]
pub(super) struct Scope {
    variables: IdVec<Place, VariableId>,
    choices: IdVec<ChoiceId, Choice>,
    /// The first choice of each place, and the end of the last place's.
    starts: Vec<u32>,
    inputs: Vec<Place>,
    sources: Vec<VariableId>,
    /// What knowing a place costs at least, whatever else is known.
    hopes: IdVec<Place, Weight>,
    teams: usize,
    tree: bool,
    cyclic: bool,
}

impl Scope {
    /// Finds what can be reached from `root` and is of use. Complexity: O(size of that part).
    pub(super) fn new(view: &View, root: VariableId, rules: Rules, marks: &mut Marks) -> Scope {
        let mut scope = match Visit::new(view, root, rules, marks, true).run() {
            Some(scope) => scope,
            None => Visit::new(view, root, rules, marks, false).run().unwrap_or_else(Scope::empty),
        };
        scope.drop_useless();
        scope.find_teams(view, marks);
        scope.cyclic = !scope.tree && scope.has_cycle();
        scope.find_hopes();
        scope
    }

    fn empty() -> Scope {
        Scope {
            variables: IdVec::new(),
            choices: IdVec::new(),
            starts: Vec::from([0]),
            inputs: Vec::new(),
            sources: Vec::new(),
            hopes: IdVec::new(),
            teams: 0,
            tree: true,
            cyclic: false,
        }
    }

    /// The root, unless nothing can provide it.
    pub(super) fn root(&self) -> Option<Place> {
        self.variables.ids().next()
    }

    /// How many places there are.
    pub(super) fn len(&self) -> usize {
        self.variables.len()
    }

    /// How many choices there are.
    pub(super) fn count(&self) -> usize {
        self.choices.len()
    }

    /// How many teams there are.
    pub(super) fn teams(&self) -> usize {
        self.teams
    }

    /// Whether choices can be such that a variable is needed for itself.
    pub(super) fn is_cyclic(&self) -> bool {
        self.cyclic
    }

    /// The variable of a place.
    pub(super) fn variable(&self, place: Place) -> VariableId {
        self.variables[place]
    }

    /// What knowing a place costs at least, whatever else is known.
    pub(super) fn hope(&self, place: Place) -> Weight {
        self.hopes[place]
    }

    /// The choices of a place: its own signals first, then relations in file order.
    pub(super) fn choices(&self, place: Place) -> impl DoubleEndedIterator<Item = ChoiceId> + use<> {
        let bound = |index: usize| self.starts.get(index).map_or(0, |&at| at as usize);
        (bound(place.index())..bound(place.index() + 1)).map(ChoiceId::from_index)
    }

    /// What a choice is.
    pub(super) fn choice(&self, choice: ChoiceId) -> &Choice {
        &self.choices[choice]
    }

    /// The places that a choice needs, in the order of their variables.
    pub(super) fn inputs(&self, choice: ChoiceId) -> &[Place] {
        self.choices[choice].inputs.of(&self.inputs)
    }

    /// The provided variables that a choice reads, ascending; for own signals the variable itself.
    pub(super) fn sources(&self, choice: ChoiceId) -> &[VariableId] {
        self.choices[choice].sources.of(&self.sources)
    }

    /// Removes choices that cannot be completed, and places that nothing needs any more.
    fn drop_useless(&mut self) {
        let missing = self.missing();
        if missing.iter().any(|&missing| missing > 0) {
            *self = Compaction::new(self).run(&missing);
        }
    }

    /// How many inputs of each choice cannot be known in any way, by counting forward from the provided ones.
    fn missing(&self) -> IdVec<ChoiceId, u32> {
        let mut missing = IdVec::filled(self.choices.len(), |choice| self.inputs(choice).len() as u32);
        let output = self.outputs();
        let users = self.users();
        let mut known = IdVec::filled(self.len(), |_: Place| false);
        let mut complete: Vec<ChoiceId> = missing.ids().filter(|&choice| missing[choice] == 0).collect();
        while let Some(choice) = complete.pop() {
            let place = output[choice];
            if core::mem::replace(&mut known[place], true) {
                continue;
            }
            for &user in users.row(place) {
                missing[user] -= 1;
                if missing[user] == 0 {
                    complete.push(user);
                }
            }
        }
        missing
    }

    /// The place that each choice is one of.
    pub(super) fn outputs(&self) -> IdVec<ChoiceId, Place> {
        let mut outputs = IdVec::new();
        for place in self.variables.ids() {
            for _ in self.choices(place) {
                outputs.push(place);
            }
        }
        outputs
    }

    /// The choices that need each place.
    pub(super) fn users(&self) -> Users {
        let mut starts = alloc::vec![0_u32; self.len() + 1];
        for input in &self.inputs {
            if let Some(start) = starts.get_mut(input.index()) {
                *start += 1;
            }
        }
        let mut end = 0;
        for start in &mut starts {
            end += *start;
            *start = end;
        }
        let mut users = Users { choices: alloc::vec![ChoiceId(0); self.inputs.len()], starts };
        for choice in self.choices.ids() {
            for &input in self.inputs(choice) {
                users.put(input, choice);
            }
        }
        users
    }

    /// Numbers the relations that may be used twice in one substitution.
    fn find_teams(&mut self, view: &View, marks: &mut Marks) {
        let several =
            |choice: &Choice| choice.relation.filter(|&relation| view.graph().has_several_outputs(relation));
        for relation in self.choices.iter().filter_map(several) {
            marks.relations[relation] += 1;
        }
        for choice in self.choices.iter_mut() {
            let Some(relation) = several(choice) else { continue };
            choice.ambiguous = marks.relations[relation] > 1;
            if choice.ambiguous && !view.graph().is_exclusive(relation) {
                choice.team = Some(marks.team(relation, &mut self.teams));
            }
        }
        for relation in self.choices.iter().filter_map(several) {
            marks.relations[relation] = 0;
            marks.teams[relation] = None;
        }
    }

    /// Whether some place can need itself, by removing places that only removed ones need.
    fn has_cycle(&self) -> bool {
        let mut needed = IdVec::filled(self.len(), |_: Place| 0_u32);
        for &input in &self.inputs {
            needed[input] += 1;
        }
        let mut free: Vec<Place> = self.variables.ids().filter(|&place| needed[place] == 0).collect();
        let mut removed = 0;
        while let Some(place) = free.pop() {
            removed += 1;
            for &input in self.choices(place).flat_map(|choice| self.inputs(choice)) {
                needed[input] -= 1;
                if needed[input] == 0 {
                    free.push(input);
                }
            }
        }
        removed < self.len()
    }

    /// Lower bounds, from the last places to the root.
    ///
    /// The hope of a place adds up only places that nothing else can need (they have no other variable above
    /// them), so the hopes of different undecided places never speak of the same relation, nor of a relation
    /// that is decided already: their sum is a lower bound of what is still to be paid. Where nothing is shared
    /// it is exact. A relation that may also serve another output may be paid for there: it counts as nothing.
    fn find_hopes(&mut self) {
        let private = self.private();
        self.hopes = IdVec::filled(self.len(), |_| Weight::ZERO);
        for place in self.variables.ids().rev() {
            let hope = |choice| {
                let own = self.choices[choice].team.map_or(self.choices[choice].weight, |_| Weight::ZERO);
                let inputs = self.inputs(choice).iter().filter(|&&input| private[input]);
                own + inputs.map(|&input| self.hopes[input]).sum()
            };
            self.hopes[place] = self.choices(place).map(hope).min().unwrap_or(Weight::MAX);
        }
    }

    /// Which places can be needed for one variable only. Such a place comes after that variable's.
    fn private(&self) -> IdVec<Place, bool> {
        let mut private = IdVec::filled(self.len(), |_| true);
        if self.tree {
            return private;
        }
        let mut above: IdVec<Place, Option<Place>> = IdVec::filled(self.len(), |_| None);
        for place in self.variables.ids() {
            for &input in self.choices(place).flat_map(|choice| self.inputs(choice)) {
                private[input] &= above[input].is_none_or(|above| above == place);
                above[input] = Some(place);
            }
        }
        private
    }
}

/// The choices that need each place.
#[derive(Debug)]
pub(super) struct Users {
    /// Where the list of each place begins, once all are put.
    starts: Vec<u32>,
    choices: Vec<ChoiceId>,
}

impl Users {
    /// Puts in from the back of the list of the place.
    fn put(&mut self, place: Place, choice: ChoiceId) {
        if let Some(start) = self.starts.get_mut(place.index()) {
            *start -= 1;
            if let Some(slot) = self.choices.get_mut(*start as usize) {
                *slot = choice;
            }
        }
    }

    /// The choices that need a place.
    pub(super) fn row(&self, place: Place) -> &[ChoiceId] {
        let bound = |index: usize| self.starts.get(index).copied().unwrap_or(0);
        Range { start: bound(place.index()), end: bound(place.index() + 1) }.of(&self.choices)
    }
}

/// Which variables may be substituted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    /// Provided variables below the root, too.
    pub(super) substitute_provided: bool,
    /// The root's own signals are no answer.
    pub(super) without_empty: bool,
}

/// Marks on the variables and relations of a graph, cleared after each use, so that searches that share them
/// cost nothing in the size of the graph.
#[derive(Clone, Debug, Default)]
pub struct Marks {
    places: IdVec<VariableId, Option<Place>>,
    relations: IdVec<RelationId, u32>,
    teams: IdVec<RelationId, Option<Team>>,
}

impl Marks {
    /// Marks for a graph of so many variables and relations.
    pub(super) fn fit(&mut self, variables: usize, relations: usize) {
        if self.places.len() != variables {
            self.places = IdVec::filled(variables, |_| None);
        }
        if self.relations.len() != relations {
            self.relations = IdVec::filled(relations, |_| 0);
            self.teams = IdVec::filled(relations, |_| None);
        }
    }

    fn team(&mut self, relation: RelationId, teams: &mut usize) -> Team {
        *self.teams[relation].get_or_insert_with(|| {
            *teams += 1;
            Team::from_index(*teams - 1)
        })
    }
}

/// A breadth-first walk from the root over everything that may be needed.
///
/// It first assumes a tree: then what stands above a place is known, and a choice that needs one of those is
/// left out at once (a relation that is usable in all directions would lead up again). Is a place reached from
/// two sides, the walk is repeated without this assumption.
struct Visit<'a, 'b> {
    view: &'a View<'b>,
    rules: Rules,
    marks: &'a mut Marks,
    scope: Scope,
    above: IdVec<Place, Place>,
}

/// How far up a walk looks for a variable that would be needed for itself.
const LOOK_UP: usize = 64;

impl<'a, 'b> Visit<'a, 'b> {
    fn new(view: &'a View<'b>, root: VariableId, rules: Rules, marks: &'a mut Marks, tree: bool) -> Self {
        let scope = Scope { tree, ..Scope::empty() };
        let mut visit = Visit { view, rules, marks, scope, above: IdVec::new() };
        visit.discover(root, Place(0));
        visit
    }

    fn run(mut self) -> Option<Scope> {
        let mut next = 0;
        let mut intact = true;
        while next < self.scope.len() && intact {
            intact = self.visit(Place::from_index(next));
            next += 1;
        }
        for &variable in &self.scope.variables {
            self.marks.places[variable] = None;
        }
        intact.then_some(self.scope)
    }

    fn discover(&mut self, variable: VariableId, above: Place) -> Place {
        let place = self.scope.variables.push(variable);
        self.above.push(above);
        self.marks.places[variable] = Some(place);
        place
    }

    /// Gives `false` when the part turns out to be no tree.
    fn visit(&mut self, place: Place) -> bool {
        let view = self.view;
        let variable = self.scope.variables[place];
        if view.status(variable).provided && !(self.rules.without_empty && place.index() == 0) {
            self.scope.sources.push(variable);
            self.add_choice(None, Weight::ZERO, self.scope.inputs.len(), self.scope.sources.len() - 1);
        }
        for producer in view.producers(variable) {
            if !self.leads_up(place, producer.relation) && !self.visit_producer(place, producer) {
                return false;
            }
        }
        self.scope.starts.push(self.scope.choices.len() as u32);
        true
    }

    fn needs(
        &self,
        variable: VariableId,
        relation: RelationId,
    ) -> impl Iterator<Item = VariableId> + use<'b> {
        let inputs: &'b [VariableId] = self.view.graph().inputs(relation);
        inputs.iter().copied().filter(move |&input| input != variable)
    }

    /// Whether a relation surely needs what it would be used for.
    fn leads_up(&self, place: Place, relation: RelationId) -> bool {
        let variable = self.scope.variables[place];
        self.needs(variable, relation).any(|input| match self.marks.places[input] {
            Some(Place(0)) => true,
            Some(needed) => self.scope.tree && self.is_above(needed, place),
            None => false,
        })
    }

    fn is_above(&self, upper: Place, place: Place) -> bool {
        let up = core::iter::successors(Some(place), |&place| Some(self.above[place]));
        up.take(LOOK_UP).take_while(|&place| place >= upper).any(|place| place == upper)
    }

    fn visit_producer(&mut self, place: Place, producer: Producer) -> bool {
        let view = self.view;
        let variable = self.scope.variables[place];
        let (inputs, sources) = (self.scope.inputs.len(), self.scope.sources.len());
        for input in self.needs(variable, producer.relation) {
            if view.status(input).provided && !self.rules.substitute_provided {
                self.scope.sources.push(input);
                continue;
            }
            let needed = match self.marks.places[input] {
                Some(needed) if self.scope.tree && self.above[needed] != place => return false,
                Some(needed) => needed,
                None => self.discover(input, place),
            };
            self.scope.inputs.push(needed);
        }
        self.add_choice(Some(producer.relation), view.weight(producer, variable), inputs, sources);
        true
    }

    fn add_choice(&mut self, relation: Option<RelationId>, weight: Weight, inputs: usize, sources: usize) {
        let scope = &mut self.scope;
        scope.choices.push(Choice {
            relation,
            weight,
            team: None,
            ambiguous: false,
            inputs: Range { start: inputs as u32, end: scope.inputs.len() as u32 },
            sources: Range { start: sources as u32, end: scope.sources.len() as u32 },
        });
    }
}

/// Copies what is of use, renumbered breadth first.
struct Compaction<'a> {
    old: &'a Scope,
    new: Scope,
    /// The old place of each new one.
    from: IdVec<Place, Place>,
    to: IdVec<Place, Option<Place>>,
}

impl<'a> Compaction<'a> {
    fn new(old: &'a Scope) -> Self {
        let new = Scope { tree: old.tree, ..Scope::empty() };
        Compaction { old, new, from: IdVec::new(), to: IdVec::filled(old.len(), |_| None) }
    }

    fn run(mut self, missing: &IdVec<ChoiceId, u32>) -> Scope {
        let useful = |choice: &ChoiceId| missing[*choice] == 0;
        let Some(root) = self.old.root() else { return self.new };
        if !self.old.choices(root).any(|choice| useful(&choice)) {
            return self.new;
        }
        self.place(root);
        let mut next = 0;
        while next < self.new.len() {
            let place = self.from[Place::from_index(next)];
            for choice in self.old.choices(place).filter(useful) {
                self.copy(choice);
            }
            self.new.starts.push(self.new.choices.len() as u32);
            next += 1;
        }
        self.new
    }

    fn place(&mut self, old: Place) -> Place {
        if let Some(place) = self.to[old] {
            return place;
        }
        let place = self.new.variables.push(self.old.variables[old]);
        self.from.push(old);
        self.to[old] = Some(place);
        place
    }

    fn copy(&mut self, choice: ChoiceId) {
        let inputs = self.new.inputs.len() as u32;
        for &input in self.old.inputs(choice) {
            let place = self.place(input);
            self.new.inputs.push(place);
        }
        let sources = self.new.sources.len() as u32;
        self.new.sources.extend_from_slice(self.old.sources(choice));
        self.new.choices.push(Choice {
            inputs: Range { start: inputs, end: self.new.inputs.len() as u32 },
            sources: Range { start: sources, end: self.new.sources.len() as u32 },
            ..self.old.choices[choice]
        });
    }
}
