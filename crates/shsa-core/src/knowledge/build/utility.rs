//! Checks the utility: its formulas, and that additional relations never raise it.

use super::problems::Problems;
use super::quantity;
use crate::expression::{
    self, Assignment, Formula, Function, Kind, Problem, Program, Scope, Shape, Symbol, check,
    parse_expression,
};
use crate::knowledge::draft::{Place, Source, Text, UtilityDraft};
use crate::knowledge::properties::SharedNames;
use crate::knowledge::utility::{
    Aggregate, Element, Fact, Figure, OwnUtility, Rating, Utility, UtilityProblem, out_of_range,
};
use crate::knowledge::{COST, KnowledgeBase, Properties};
use crate::unit::Dimension;
use alloc::boxed::Box;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::format;
use alloc::string::ToString;
use alloc::vec::Vec;

/// At most this many elements with a rating out of range are reported.
const MAX_REPORTED: usize = 10;

/// The utility, as far as it is valid and proven not to rise with additional relations.
pub(super) fn build(problems: &mut Problems, source: &mut dyn Source, knowledge: &KnowledgeBase) -> Utility {
    let draft = source.utility();
    let (at, utility) = match &draft {
        None => (&Text::default(), Utility::Norm),
        Some(UtilityDraft::Named(name)) => {
            if name.text != "norm" {
                let message = format!("there is no utility `{}`", name.text);
                let help =
                    "write `norm`, or formulas of your own: `{ aggregate: product, relation: 1 / cost }`";
                problems.error(name, message, help);
            }
            (name, Utility::Norm)
        }
        Some(UtilityDraft::Own { at, aggregate, relation, signal, way, defaults }) => {
            let defaults = quantity::properties(problems, &mut SharedNames::default(), defaults);
            let aggregate = aggregate.as_ref().and_then(|text| read_aggregate(problems, text));
            let of_variables = || knowledge.variables().iter().map(|variable| &variable.properties);
            let relation = relation.as_ref().map(|text| {
                let names = Names::new(
                    &Fact::OF_RELATIONS,
                    knowledge.relations().iter().map(|r| &r.properties).chain(of_variables()),
                    &defaults,
                );
                rating(problems, text, &names)
            });
            let signal = signal.as_ref().map(|text| {
                let names = Names::new(
                    &Fact::OF_SIGNALS,
                    knowledge.signals().iter().map(|s| &s.properties).chain(of_variables()),
                    &defaults,
                );
                rating(problems, text, &names)
            });
            let way =
                way.as_ref().map(|text| way_rating(problems, text, aggregate.unwrap_or_default(), &defaults));
            if relation.is_none() && signal.is_none() && way.is_none() {
                problems.error(at, "this utility rates nothing", "give it a formula: `relation: 1 / cost`");
            }
            if [&relation, &signal, &way].into_iter().any(|rating| matches!(rating, Some(None))) {
                return Utility::Norm;
            }
            let (relation, signal, way) = (relation.flatten(), signal.flatten(), way.flatten());
            (
                at,
                Utility::Own(Box::new(OwnUtility {
                    aggregate: aggregate.unwrap_or_default(),
                    relation,
                    signal,
                    way,
                })),
            )
        }
    };
    report(problems, source, at, &utility, knowledge);
    utility
}

fn read_aggregate(problems: &mut Problems, text: &Text) -> Option<Aggregate> {
    let known = Aggregate::NAMES.iter().find(|(name, _)| *name == text.text);
    if known.is_none() {
        problems.unknown(
            text,
            "aggregate",
            Aggregate::NAMES.len(),
            || Aggregate::NAMES.iter().map(|(name, _)| *name).collect(),
            "write `product`, `sum` or `minimum`",
        );
    }
    known.map(|&(_, aggregate)| aggregate)
}

/// The names that formulas of a utility may use.
struct Names<'a> {
    facts: Vec<(&'a str, Fact)>,
}

impl<'a> Names<'a> {
    fn new(
        built_in: &[(&'static str, Fact)],
        given: impl Iterator<Item = &'a Properties>,
        defaults: &'a Properties,
    ) -> Names<'a> {
        let mut properties: BTreeSet<&str> = defaults.keys().collect();
        properties.extend(given.flat_map(Properties::keys));
        let mut facts: Vec<(&str, Fact)> = built_in.to_vec();
        properties.retain(|name| built_in.iter().all(|(built_in, _)| built_in != name));
        facts.extend(
            properties
                .into_iter()
                .map(|name| (name, Fact::Property(name.to_string(), defaults.get(name).copied()))),
        );
        Names { facts }
    }
}

impl Scope for Names<'_> {
    fn symbol(&self, name: &str) -> Option<Symbol> {
        let at = self.facts.iter().position(|(known, _)| *known == name)?;
        u32::try_from(at).ok().map(Symbol)
    }

    fn kind(&self, _: Symbol) -> Kind {
        Kind { shape: Shape::Scalar, unit: None, range: None, constant: None }
    }

    fn function(&self, _: &str) -> Option<&Function> {
        None
    }

    fn names(&self) -> Vec<&str> {
        self.facts.iter().map(|(name, _)| *name).collect()
    }

    fn function_names(&self) -> Vec<&str> {
        Vec::new()
    }
}

/// The rating of ways by their records, proven to lie in the range of the aggregate.
fn way_rating(
    problems: &mut Problems,
    text: &Text,
    aggregate: Aggregate,
    defaults: &Properties,
) -> Option<Rating> {
    let unknown = |(name, figure): (&'static str, Figure)| {
        (name, Fact::Figure(figure, defaults.get(name).copied().or(figure.unknown())))
    };
    let rating = rating(problems, text, &Names { facts: Figure::NAMES.map(unknown).into() })?;
    for fact in &rating.facts {
        let Fact::Figure(figure, unknown) = fact else { continue };
        let name = Figure::NAMES.iter().find(|(_, known)| known == figure).map_or("", |(name, _)| name);
        match unknown {
            None => {
                let message = format!("what `{name}` is of a way that has not been compared is not said");
                let help = format!("name what counts until it is known under `defaults`: `{{ {name}: 1 }}`");
                problems.error(text, message, help);
            }
            Some(value) if !figure.range().contains(*value) => {
                let message = format!("`{name}` is never {value}, which stands under `defaults`");
                problems.error(text, message, "a share lies between 0 and 1, a distance is not below 0");
            }
            Some(_) => {}
        }
    }
    if let Some(value) = rating.outside_for_ways(aggregate) {
        let message = format!("the utility of a way may be {value}");
        problems.error(text, message, out_of_range(aggregate));
    }
    Some(rating)
}

fn rating(problems: &mut Problems, text: &Text, names: &Names) -> Option<Rating> {
    let parsed = parse_expression(&text.text).map_err(|problem| problems.inside(text, problem)).ok()?;
    let checked = check(&parsed, names);
    for problem in checked.problems {
        problems.inside(text, problem);
    }
    let formula = checked.formula?;
    let whole = 0..text.text.len();
    if let Some(dimension) = checked.dimension.filter(|&dimension| dimension != Dimension::PLAIN) {
        let message = format!("a utility is a plain number, and this is in {dimension}");
        let help = "divide it by a constant of that unit";
        problems.inside(text, Problem::error(whole, message).with_help(help));
        return None;
    }
    if formula.shape() != expression::Shape::Scalar || formula.is_stateful() {
        let problem = Problem::error(whole, "a utility is a number of the present properties");
        problems.inside(text, problem);
        return None;
    }
    compiled(&text.text, &formula, names).map_err(|problem| problems.inside(text, problem)).ok()
}

fn compiled(text: &str, formula: &Formula, names: &Names) -> Result<Rating, Problem> {
    // The result has a symbol of its own.
    let symbol = Symbol(u32::MAX);
    let program = Program::compile(&[Assignment { symbol, formula, condition: None }])?;
    let fact = |symbol: Symbol| names.facts.get(symbol.0 as usize).map(|(_, fact)| fact.clone());
    let facts = program.inputs().iter().filter_map(|input| fact(input.symbol)).collect();
    Ok(Rating { text: text.to_string(), program, facts })
}

fn report(
    problems: &mut Problems,
    source: &mut dyn Source,
    at: &Text,
    utility: &Utility,
    knowledge: &KnowledgeBase,
) {
    let found = utility.check(knowledge);
    if found.is_empty() {
        return;
    }
    let reported = found.get(..MAX_REPORTED).unwrap_or(&found);
    let places = places(source, matches!(utility, Utility::Norm), reported, knowledge);
    for problem in reported {
        let place = places.get(&problem.element).copied().unwrap_or(at.place);
        problems.error(place, problem.message.clone(), problem.help.clone());
    }
    if found.len() > MAX_REPORTED {
        let message = format!("the utility of {} more elements is out of range", found.len() - MAX_REPORTED);
        problems.error(at, message, "correct the formula, or the properties that it reads");
    }
}

/// The places of the elements of some problems; for relations the place of their cost, where the cost is wrong.
fn places(
    source: &mut dyn Source,
    by_cost: bool,
    reported: &[UtilityProblem],
    knowledge: &KnowledgeBase,
) -> BTreeMap<Element, Place> {
    let elements = || reported.iter().map(|problem| problem.element);
    let named = |element: Element, text: &str| match element {
        Element::Variable(id) => knowledge.variables()[id].name == text,
        Element::Relation(id) => knowledge.relations()[id].name == text,
        Element::Signal(id) => knowledge.signals()[id].name == text,
    };
    let mut places = BTreeMap::new();
    let mut note = |is_kind: fn(&Element) -> bool, name: &Text, at: Place| {
        if let Some(element) = elements().filter(is_kind).find(|&element| named(element, &name.text)) {
            places.entry(element).or_insert(at);
        }
    };
    source.variables(&mut |v| note(|e| matches!(e, Element::Variable(_)), &v.name, v.name.place));
    source.relations(&mut |draft| {
        let cost = draft.properties.iter().find(|(name, _)| by_cost && name.text == COST);
        let at = cost.map_or(draft.name.place, |(_, value)| value.place);
        note(|e| matches!(e, Element::Relation(_)), &draft.name, at);
    });
    source.signals(&mut |s| note(|e| matches!(e, Element::Signal(_)), &s.name, s.name.place));
    places
}
