//! The thesis's Prolog facts: `function(output, relation, [inputs])`, `implementation(relation, "code")`,
//! `itomsOf(variable, [names])` and `itomOf(variable, name)`.

use shsa_core::knowledge::{Place, Text};
use std::collections::BTreeMap;

use super::clauses::{Token, clauses};
use super::notes::Notes;
use super::prolog::RULES;
use super::sketch::{Direction, Sketch, Sketched};

/// The form of each fact.
const FACTS: [(&str, usize, &str); 4] = [
    ("function", 3, "function(angle, turn, [base, radius])."),
    ("implementation", 2, "implementation(turn, \"angle.v = atan(base.v / radius.v)\")."),
    ("itomsOf", 2, "itomsOf(base, [\"/base\"])."),
    ("itomOf", 2, "itomOf(base, \"/base\")."),
];

/// An argument of a fact.
enum Term {
    /// An atom, a string, or a number as it is written.
    Name(Text),
    List(Vec<Text>),
}

/// Reads all facts. Wrong facts are reported, and other clauses are counted, but for the rules of an export.
pub(super) fn sketch(notes: &mut Notes, text: &str) -> Sketch {
    let clauses = clauses(notes, text.strip_suffix(RULES).unwrap_or(text));
    let mut reader = Reader {
        notes,
        sketch: Sketch::default(),
        relations: BTreeMap::new(),
        directions: BTreeMap::new(),
        found: 0,
    };
    let mut passed: BTreeMap<&'static str, (usize, Place)> = BTreeMap::new();
    for clause in &clauses {
        match kind(clause) {
            Ok(fact) => reader.fact(fact, clause),
            Err(kind) => {
                let place = clause.first().map(Token::place).unwrap_or_default();
                passed.entry(kind).or_insert((0, place)).0 += 1;
            }
        }
    }
    if reader.found == 0 && reader.notes.found.is_empty() {
        let place = Place { from: 0, to: 0 };
        let help = "facts look like `function(angle, turn, [base, radius]).`";
        reader.notes.error(place, "there is no fact of a knowledge base in this Prolog text", help);
    }
    report_passed(reader.notes, &passed);
    reader.sketch
}

/// One note about all skipped clauses, at the first of them.
fn report_passed(notes: &mut Notes, passed: &BTreeMap<&'static str, (usize, Place)>) {
    let Some(place) = passed.values().map(|(_, place)| *place).min() else { return };
    let counted: Vec<String> = passed
        .iter()
        .map(|(kind, (count, _))| format!("{count} {kind}{}", if *count == 1 { "" } else { "s" }))
        .collect();
    let help = "only function/3, implementation/2, itomsOf/2 and itomOf/2 are read, and only as facts";
    let text = Text { text: String::new(), place };
    notes.warn(&text, format!("not taken over: {}", counted.join(", ")), help);
}

type Fact = (&'static str, usize, &'static str);

/// The fact of a clause, or the kind of another clause.
fn kind(clause: &[Token]) -> Result<Fact, &'static str> {
    let is = |sign: &str| clause.iter().any(|token| matches!(token, Token::Atom(text) if text.text == sign));
    let Some(Token::Atom(first)) = clause.first() else { return Err("other clause") };
    if matches!(first.text.as_str(), ":-" | "?-") {
        return Err("directive");
    }
    if is(":-") || is("-->") {
        return Err("rule");
    }
    if is("::") {
        return Err("other clause");
    }
    let known = FACTS.iter().find(|(name, ..)| *name == first.text);
    match (known, clause.get(1)) {
        (Some(fact), Some(mark)) if mark.is_mark('(') => Ok(*fact),
        _ if first.text == "query" => Err("query clause"),
        _ => Err("other fact"),
    }
}

struct Reader<'n> {
    notes: &'n mut Notes,
    sketch: Sketch,
    /// The index of each relation in the sketch.
    relations: BTreeMap<String, usize>,
    /// The inputs of each direction, by the index of its relation and its output.
    directions: BTreeMap<(usize, String), Vec<String>>,
    found: usize,
}

impl Reader<'_> {
    fn fact(&mut self, (name, arity, example): Fact, clause: &[Token]) {
        self.found += 1;
        let help = format!("write it like `{example}`");
        let Some(terms) = self.arguments(clause, &help) else { return };
        if terms.len() != arity {
            let place = clause.first().map(Token::place).unwrap_or_default();
            self.notes.error(place, format!("`{name}` has {arity} arguments, not {}", terms.len()), &help);
            return;
        }
        match (name, terms.as_slice()) {
            ("function", [Term::Name(output), Term::Name(relation), Term::List(inputs)]) => {
                self.function(output, relation, inputs);
            }
            ("implementation", [Term::Name(relation), Term::Name(code)]) => {
                self.implementation(relation, code)
            }
            ("itomsOf", [Term::Name(variable), Term::List(itoms)]) => self.itoms(variable, itoms),
            ("itomOf", [Term::Name(variable), Term::Name(itom)]) => {
                self.itoms(variable, std::slice::from_ref(itom))
            }
            _ => {
                let place = clause.get(2).map(Token::place).unwrap_or_default();
                self.notes.error(place, format!("the arguments of `{name}` are of another kind"), &help);
            }
        }
    }

    /// The arguments between the parentheses; `None`, with a report, when the clause has another form.
    fn arguments(&mut self, clause: &[Token], help: &str) -> Option<Vec<Term>> {
        let mut terms = Vec::new();
        let mut tokens = clause.iter().skip(2).peekable();
        loop {
            let token = self.next(tokens.next(), clause, help)?;
            if token.is_mark('[') {
                let mut items = Vec::new();
                if tokens.next_if(|token| token.is_mark(']')).is_none() {
                    loop {
                        let token = self.next(tokens.next(), clause, help)?;
                        items.push(self.name(token, help)?);
                        let token = self.next(tokens.next(), clause, help)?;
                        if token.is_mark(']') {
                            break;
                        }
                        self.expect(token, ',', help)?;
                    }
                }
                terms.push(Term::List(items));
            } else {
                terms.push(Term::Name(self.name(token, help)?));
            }
            let token = self.next(tokens.next(), clause, help)?;
            if token.is_mark(')') {
                break;
            }
            self.expect(token, ',', help)?;
        }
        match tokens.next() {
            None => Some(terms),
            Some(token) => {
                self.notes.error(token.place(), "something follows the fact", help);
                None
            }
        }
    }

    fn next<'t>(&mut self, token: Option<&'t Token>, clause: &[Token], help: &str) -> Option<&'t Token> {
        if token.is_none() {
            let place = clause.last().map(Token::place).unwrap_or_default();
            self.notes.error(place, "this fact is not closed", help);
        }
        token
    }

    fn expect(&mut self, token: &Token, mark: char, help: &str) -> Option<()> {
        if token.is_mark(mark) {
            return Some(());
        }
        self.notes.error(token.place(), format!("a `{mark}` is missing before this"), help);
        None
    }

    fn name(&mut self, token: &Token, help: &str) -> Option<Text> {
        match token {
            Token::Atom(text) | Token::Number(text) | Token::Text(text) => {
                // places count from the first character that is no blank, as those of YAML do
                let (begin, trimmed) = (text.text.trim_start(), text.text.trim());
                let blanks = u32::try_from(text.text.len() - begin.len()).unwrap_or(0);
                let is_as_written = !self.notes.rewritten.contains(&text.place.from);
                let from = text.place.from + if is_as_written { blanks } else { 0 };
                Some(Text { text: trimmed.to_owned(), place: Place { from, ..text.place } })
            }
            Token::Variable(text) => {
                let message = format!("`{}` is a variable of Prolog: a fact holds names only", text.text);
                self.notes.error(text.place, message, "write it small, or in quotes");
                None
            }
            Token::Mark(..) => {
                self.notes.error(token.place(), "a name is missing before this", help);
                None
            }
        }
    }

    fn function(&mut self, output: &Text, relation: &Text, inputs: &[Text]) {
        let direction =
            Direction { output: output.clone(), inputs: inputs.to_vec(), code: None, constraint: None };
        let at = self.relation(relation);
        let reads: Vec<String> = inputs.iter().map(|input| input.text.clone()).collect();
        match self.directions.get(&(at, output.text.clone())) {
            None => {
                self.directions.insert((at, output.text.clone()), reads);
                if let Some(known) = self.sketch.relations.get_mut(at) {
                    known.directions.push(direction);
                }
            }
            Some(known) if *known == reads => {}
            Some(_) => {
                let message = format!(
                    "relation `{}` computes `{}` in another way already: this one gets a name of its own",
                    relation.text, output.text
                );
                self.notes.warn(relation, message, "");
                let name = relation.clone();
                self.sketch.relations.push(Sketched { name, directions: vec![direction], code: None });
            }
        }
    }

    /// The index of the relation of a name; a new relation has no directions yet.
    fn relation(&mut self, name: &Text) -> usize {
        let relations = &mut self.sketch.relations;
        *self.relations.entry(name.text.clone()).or_insert_with(|| {
            relations.push(Sketched { name: name.clone(), directions: Vec::new(), code: None });
            relations.len() - 1
        })
    }

    /// The functions of the relation may follow later.
    fn implementation(&mut self, relation: &Text, code: &Text) {
        let at = self.relation(relation);
        let Some(known) = self.sketch.relations.get_mut(at) else { return };
        if known.code.is_some() {
            let message =
                format!("relation `{}` has an implementation already: this one is left out", relation.text);
            self.notes.warn(code, message, "");
        } else {
            known.code = Some(code.clone());
        }
    }

    /// A number is the value of a constant.
    fn itoms(&mut self, variable: &Text, itoms: &[Text]) {
        self.sketch.variables.push(variable.clone());
        match itoms {
            [value] if value.text.parse::<f64>().is_ok_and(f64::is_finite) => {
                self.sketch.constants.push((variable.clone(), value.clone()));
            }
            _ => self.sketch.signals.extend(itoms.iter().map(|itom| (variable.clone(), itom.clone()))),
        }
    }
}
