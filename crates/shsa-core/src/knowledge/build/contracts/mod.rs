//! Checks contracts: their subjects, their statements, and whether their demands can be met.

mod words;
mod condition;
mod evidence;
mod party;
mod claim;
mod matching;
mod circular;

use super::problems::Problems;
use crate::knowledge::contract::{
    Asked, CONSUMER, Condition, Contract, ContractId, Contracts, Given, HEALER, PLATFORM, Party, Policy,
    Subject, Watched,
};
use crate::knowledge::draft::{ContractDraft, DemandDraft, GuaranteeDraft, Source, Text};
use crate::knowledge::{IdVec, KnowledgeBase, VariableId};
use crate::statement::{Level, Property, Scales, Statement};
use crate::unit::{Unit, nearest};
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// Reads contracts; a contract without a subject is left out.
pub(super) fn build(
    problems: &mut Problems,
    source: &mut dyn Source,
    knowledge: &KnowledgeBase,
) -> Contracts {
    let (platform, contracts) = (source.platform(), source.contracts());
    if platform.is_empty() && contracts.is_empty() {
        return Contracts::default();
    }
    let mut drafts: Vec<(&ContractDraft, Subject)> =
        platform.iter().map(|draft| (draft, Subject::Platform)).collect();
    for draft in &contracts {
        drafts.extend(subject(problems, knowledge, &draft.name).map(|subject| (draft, subject)));
    }
    drop_repeated(problems, &mut drafts);
    let names: BTreeMap<&str, ContractId> = drafts
        .iter()
        .zip(0..)
        .filter(|((_, subject), _)| matches!(subject, Subject::Platform | Subject::Healer))
        .map(|((draft, _), at)| (draft.name.text.as_str(), crate::knowledge::Id::from_index(at)))
        .collect();
    let scales = Scales::standard();
    let mut rows = IdVec::new();
    for &(draft, subject) in &drafts {
        rows.push(Reader { problems, knowledge, names: &names, scales: &scales, draft, subject }.contract());
    }
    check_platforms(problems, &drafts, &mut rows);
    let contracts = Contracts::new(rows);
    let drafts: Vec<&ContractDraft> = drafts.into_iter().map(|(draft, _)| draft).collect();
    claim::check(problems, knowledge, &contracts, &drafts);
    matching::check(problems, knowledge, &contracts, &drafts);
    circular::check(problems, &matching::Market { knowledge, contracts: &contracts }, &drafts);
    contracts
}

/// The subject of a contract; a name of no element or of several is reported.
fn subject(problems: &mut Problems, knowledge: &KnowledgeBase, name: &Text) -> Option<Subject> {
    let relations = knowledge.relations().enumerate().filter(|(_, relation)| relation.name == name.text);
    let mut found: Vec<Subject> = relations.map(|(id, _)| Subject::Relation(id)).collect();
    found.extend(knowledge.signal(&name.text).map(Subject::Signal));
    found.extend(knowledge.needs_named(&name.text).into_iter().map(Subject::Need));
    found.extend((name.text == HEALER).then_some(Subject::Healer));
    match found.as_slice() {
        [only] => Some(*only),
        [] => {
            let signals = knowledge.signals().iter().map(|it| it.name.as_str());
            let relations = knowledge.relations().iter().map(|it| it.name.as_str());
            let needs = knowledge.needs().ids().map(|id| knowledge.need_name(id));
            let known: Vec<&str> = signals.chain(relations).chain(needs).collect();
            let otherwise =
                "name a signal, a relation, a need or `shsa`; what they run on stands under `platform`";
            problems.unknown(name, "signal, relation or need", known.len(), || known, otherwise);
            None
        }
        _ => {
            let message = format!("`{}` names several: a signal, a relation or a need", name.text);
            problems.error(name, message, "name a need by what it is published under, or rename one of them");
            None
        }
    }
}

fn drop_repeated(problems: &mut Problems, drafts: &mut Vec<(&ContractDraft, Subject)>) {
    let mut seen: Vec<(Subject, &str)> = Vec::new();
    drafts.retain(|(draft, subject)| {
        let key = (*subject, if *subject == Subject::Platform { draft.name.text.as_str() } else { "" });
        let is_new = !seen.contains(&key);
        if is_new {
            seen.push(key);
        } else {
            problems.error(&draft.name, format!("`{}` has two contracts", draft.name.text), "keep one");
        }
        is_new
    });
}

/// Nothing runs on itself.
fn check_platforms(
    problems: &mut Problems,
    drafts: &[(&ContractDraft, Subject)],
    rows: &mut IdVec<ContractId, Contract>,
) {
    for (id, (draft, _)) in rows.ids().zip(drafts) {
        let mut below = rows[id].runs_on;
        for _ in 0..rows.len() {
            below = below.filter(|below| *below != id).and_then(|below| rows[below].runs_on);
        }
        if below.is_some() || rows[id].runs_on == Some(id) {
            let at = draft.runs_on.as_ref().unwrap_or(&draft.name);
            problems.error(
                at,
                format!("`{}` runs on itself", draft.name.text),
                "name what it really runs on",
            );
            rows[id].runs_on = None;
        }
    }
}

/// Reads one contract.
struct Reader<'a, 'p> {
    problems: &'p mut Problems,
    knowledge: &'a KnowledgeBase,
    /// The contracts of platforms and of this program, by name.
    names: &'a BTreeMap<&'a str, ContractId>,
    scales: &'a Scales,
    draft: &'a ContractDraft,
    subject: Subject,
}

impl Reader<'_, '_> {
    fn contract(&mut self) -> Contract {
        let draft = self.draft;
        let runs_on = draft.runs_on.as_ref().and_then(|name| self.platform(name));
        self.check_names();
        let asks: Vec<Asked> = draft.asks.iter().filter_map(|asked| self.asked(asked, runs_on)).collect();
        let evidence: Vec<Watched> = draft
            .evidence
            .iter()
            .filter_map(|entry| evidence::watched(self.problems, self.knowledge, self.subject, entry))
            .collect();
        let complete = asks.len() == draft.asks.len() && evidence.len() == draft.evidence.len();
        let gives =
            draft.gives.iter().filter_map(|given| self.given(given, &asks, &evidence, complete)).collect();
        let contract = Contract {
            name: draft.name.text.clone(),
            subject: self.subject,
            runs_on,
            gives,
            asks,
            evidence,
            policy: self.policy(),
        };
        self.check_leaves(&contract, complete);
        contract
    }

    fn platform(&mut self, name: &Text) -> Option<ContractId> {
        let found = self.names.get(name.text.as_str()).copied();
        if found.is_none() {
            let known: Vec<&str> = self.names.keys().copied().collect();
            self.problems.unknown(name, "platform", known.len(), || known, "describe it under `platform`");
        }
        found
    }

    fn policy(&mut self) -> Policy {
        let Some(text) = &self.draft.policy else { return Policy::default() };
        if !matches!(self.subject, Subject::Need(_)) {
            self.problems.error(text, "only the contract of a need has a policy", "leave `policy` away");
        }
        let found = Policy::NAMES.into_iter().find(|(name, _)| *name == text.text);
        if found.is_none() {
            let message = format!("`{}` is no policy", text.text);
            self.problems.error(text, message, "write `stop`, which is usual, `degrade` or `warn`");
        }
        found.map(|(_, policy)| policy).unwrap_or_default()
    }

    /// Names of demands and evidence occur in conditions, names of guarantees in reports.
    fn check_names(&mut self) {
        let draft = self.draft;
        let leaves: Vec<&Text> =
            draft.asks.iter().map(|it| &it.name).chain(draft.evidence.iter().map(|(name, _)| name)).collect();
        let given: Vec<&Text> = draft.gives.iter().map(|it| &it.name).collect();
        for names in [leaves, given] {
            for (at, name) in names.iter().enumerate() {
                if names.iter().take(at).any(|earlier| earlier.text == name.text) {
                    self.problems.error(
                        *name,
                        format!("`{}` is there twice", name.text),
                        "give each a name of its own",
                    );
                } else if !condition::is_name(&name.text) {
                    let help =
                        "a name has letters, digits, `_`, `-` and `.`, and is none of `and`, `or`, `of`";
                    self.problems.error(*name, format!("`{}` cannot be a name here", name.text), help);
                }
            }
        }
    }

    fn asked(&mut self, draft: &DemandDraft, runs_on: Option<ContractId>) -> Option<Asked> {
        let (of, service) = self.party(draft, runs_on)?;
        let variable = match of {
            Party::Provider(variable) => Some(variable),
            Party::Producer(signal) => Some(self.knowledge.signals()[signal].variable),
            Party::Contract(_) | Party::Consumers => None,
        };
        let statement = self.statement(service, draft.level.as_ref(), &draft.properties, variable);
        Some(Asked { name: draft.name.text.clone(), statement, of })
    }

    fn given(
        &mut self,
        draft: &GuaranteeDraft,
        asks: &[Asked],
        evidence: &[Watched],
        complete: bool,
    ) -> Option<Given> {
        let (service, variable) = self.service(draft)?;
        let statement = self.statement(service, draft.level.as_ref(), &draft.properties, variable);
        let leaf = |name: &str| {
            let asked = asks.iter().position(|asked| asked.name == name).map(Condition::Asked);
            asked.or_else(|| evidence.iter().position(|it| it.name == name).map(Condition::Watched))
        };
        let when = match &draft.when {
            // Without `when`, every demand and piece of evidence is a condition.
            None => Condition::All(
                (0..asks.len())
                    .map(Condition::Asked)
                    .chain((0..evidence.len()).map(Condition::Watched))
                    .collect(),
            ),
            Some(text) => self.condition(text, &leaf, complete)?,
        };
        let redundant =
            draft.redundant.as_ref().and_then(|names| self.redundant(&draft.name, names, asks, complete));
        Some(Given { name: draft.name.text.clone(), statement, when, redundant })
    }

    /// Reads a condition; unknown names are not reported where their own text is wrong already (not `complete`).
    fn condition(
        &mut self,
        text: &Text,
        leaf: &dyn Fn(&str) -> Option<Condition>,
        complete: bool,
    ) -> Option<Condition> {
        let draft = self.draft;
        let declared =
            || draft.asks.iter().map(|it| &it.name).chain(draft.evidence.iter().map(|(name, _)| name));
        match condition::read(&text.text, leaf) {
            Ok(condition) => Some(condition),
            Err(problem) => {
                let named = text.text.get(problem.span.clone()).unwrap_or("");
                if complete || !declared().any(|name| name.text == named) {
                    let known = declared().map(|name| name.text.as_str());
                    let near = nearest(named, known).map(|near| format!("did you mean `{near}`?"));
                    let usual = "declare it under `asks` or `evidence`".to_string();
                    let help = problem.help.clone().or(near).or(Some(usual));
                    self.problems.inside(text, crate::expression::Problem { help, ..problem });
                }
                None
            }
        }
    }

    /// The type of service that is given, and its variable.
    fn service(&mut self, draft: &GuaranteeDraft) -> Option<(String, Option<VariableId>)> {
        let named = |id: VariableId| Some((self.knowledge.variables()[id].name.clone(), Some(id)));
        let outputs: Vec<VariableId> = match self.subject {
            Subject::Signal(id) => Vec::from([self.knowledge.signals()[id].variable]),
            Subject::Relation(id) => self.knowledge.relations()[id].outputs.clone(),
            Subject::Need(_) => return Some((CONSUMER.to_string(), None)),
            Subject::Platform => return Some((PLATFORM.to_string(), None)),
            Subject::Healer => return Some((HEALER.to_string(), None)),
        };
        match (&draft.of, outputs.as_slice()) {
            (None, [only]) => named(*only),
            (None, _) => {
                let message =
                    format!("`{}` does not say which of several outputs it is about", draft.name.text);
                self.problems.error(&draft.name, message, "write `of:` with the variable that is computed");
                None
            }
            (Some(of), _) => {
                let found = self.knowledge.variable(&of.text).filter(|variable| outputs.contains(variable));
                if found.is_none() {
                    let known: Vec<&str> =
                        outputs.iter().map(|&id| self.knowledge.variables()[id].name.as_str()).collect();
                    let message = format!("`{}` is not what it gives", of.text);
                    self.problems.error(of, message, format!("it gives {}", known.join(", ")));
                }
                found.and_then(named)
            }
        }
    }

    fn statement(
        &mut self,
        service: String,
        level: Option<&Text>,
        properties: &[(Text, Text)],
        variable: Option<VariableId>,
    ) -> Statement {
        let level = level.and_then(|text| self.level(text));
        let unit: Option<&Unit> = variable.and_then(|id| self.knowledge.variables()[id].unit.as_ref());
        let read = |entry: &(Text, Text)| words::property(self.problems, entry, unit);
        let properties: Vec<Property> = properties.iter().flat_map(read).collect();
        Statement { service, level, properties }
    }

    fn level(&mut self, text: &Text) -> Option<Level> {
        let (scale, level) = text.text.trim().split_once(' ').unwrap_or(("", text.text.trim()));
        let found = self.scales.level(scale, level.trim());
        if found.is_none() {
            let known = self.scales.named(scale).and_then(|id| self.scales.get(id));
            let help = match known {
                Some(scale) => format!(
                    "the levels of {} are {}, the lowest first",
                    scale.name.to_uppercase(),
                    scale.levels.join(", ")
                ),
                None => "write it like `SIL 2`, `ASIL B`, `PL d`, `DAL C` or `AgPL c`".to_string(),
            };
            self.problems.error(text, format!("`{}` is no level", text.text), help);
        }
        found
    }

    fn redundant(
        &mut self,
        given: &Text,
        names: &[Text],
        asks: &[Asked],
        complete: bool,
    ) -> Option<[usize; 2]> {
        let place = |name: &Text| asks.iter().position(|asked| asked.name == name.text);
        for name in names.iter().filter(|name| complete && place(name).is_none()) {
            let known = asks.iter().map(|asked| asked.name.as_str());
            let near = nearest(&name.text, known).map(|near| format!("did you mean `{near}`?"));
            let help = near.unwrap_or_else(|| "name two of what is asked".to_string());
            self.problems.error(name, format!("`{}` is not asked here", name.text), help);
        }
        match names.iter().filter_map(place).collect::<Vec<_>>().as_slice() {
            [one, other] if one != other => Some([*one, *other]),
            _ if names.len() == 2 => None,
            _ => {
                let at = names.first().unwrap_or(given);
                self.problems.error(
                    at,
                    "a decomposition is of two demands",
                    "write `redundant: [one, other]`",
                );
                None
            }
        }
    }

    /// Warns of demands and evidence that no condition uses.
    fn check_leaves(&mut self, contract: &Contract, complete: bool) {
        let mut used = Vec::new();
        contract.gives.iter().for_each(|given| given.when.leaves(&mut |leaf| used.push(leaf.clone())));
        let gives_all = contract.gives.len() == self.draft.gives.len();
        let is_need = matches!(self.subject, Subject::Need(_)) && contract.gives.is_empty();
        if !complete || !gives_all || is_need {
            return;
        }
        let help = "name it in the `when` of a guarantee, or leave it away";
        for (at, asked) in self.draft.asks.iter().enumerate() {
            if !used.contains(&Condition::Asked(at)) {
                self.problems.warn(&asked.name, format!("nothing depends on `{}`", asked.name.text), help);
            }
        }
        for (at, (name, _)) in self.draft.evidence.iter().enumerate() {
            if !used.contains(&Condition::Watched(at)) {
                self.problems.warn(name, format!("nothing depends on `{}`", name.text), help);
            }
        }
    }
}
