//! The assurance cases of a run: for each way that may serve a need, how every claim and every piece of evidence stood over time.

use super::thinned::Stretches;
use shsa_core::analysis::{Candidacy, Prospect};
use shsa_core::assurance::{Admitted, Assurance, Composition, Evaluation, EvidenceId, Verdict};
use shsa_core::engine::{Engine, Publication};
use shsa_core::interval::Truth;
use shsa_core::knowledge::{ContractId, EvidenceSource, Id, KnowledgeBase, NeedId, Watched};
use shsa_core::plan::Graph;
use shsa_core::reason::ServedBy;
use shsa_core::substitution::Way;
use shsa_core::time::{Span, Time, Validity};
use shsa_drawing::case::{Argument, words};

/// The most ways of a need whose cases are recorded.
const MOST_WAYS: usize = 16;
/// The most changes of what a need is admitted on.
const MOST_CHANGES: usize = 2_000;

/// The verdicts in the order of the stretches of a node.
pub(in crate::replay) const VERDICTS: [Verdict; 4] =
    [Verdict::Holds, Verdict::Open, Verdict::Circular, Verdict::Refused];

/// How one node of an argument stood over time.
pub(in crate::replay) struct Course {
    /// The time of the latest change, and the verdict since then.
    since: Time,
    state: Verdict,
    past: [Stretches; 4],
}

impl Course {
    fn new(since: Time, state: Verdict) -> Course {
        Course { since, state, past: std::array::from_fn(|_| Stretches::new()) }
    }

    fn turn(&mut self, now: Time, state: Verdict) {
        if state == self.state {
            return;
        }
        self.end(now);
        (self.since, self.state) = (now, state);
    }

    fn end(&mut self, now: Time) {
        if self.since < now {
            let place = VERDICTS.iter().position(|it| *it == self.state).unwrap_or(0);
            self.past[place].push(Validity { from: self.since, to: now });
        }
    }

    /// Every stretch with its verdict, ascending; close ones of one verdict may be joined.
    pub(in crate::replay) fn stretches(&self) -> Vec<(Validity, Verdict)> {
        let of = |(stretches, verdict): (&Stretches, Verdict)| {
            stretches.get().into_iter().map(move |stretch| (stretch, verdict)).collect::<Vec<_>>()
        };
        let mut all: Vec<_> = self.past.iter().zip(VERDICTS).flat_map(of).collect();
        all.sort_by_key(|(stretch, _)| stretch.from);
        all
    }
}

/// The case for one way of serving a need.
pub(in crate::replay) struct WayCase {
    /// The way's name.
    pub(in crate::replay) name: String,
    /// Whether it has served the need.
    pub(in crate::replay) has_served: bool,
    /// As it stands at the end.
    pub(in crate::replay) argument: Argument,
    /// How each node stood, in the order of the argument.
    pub(in crate::replay) courses: Vec<Course>,
    way: Way,
    composition: Composition,
    evaluation: Evaluation,
    claim: String,
    observed: Vec<String>,
}

/// The case for one need, under one model.
pub(in crate::replay) struct NeedCase {
    /// The need's published name.
    pub(in crate::replay) signal: String,
    pub(in crate::replay) ways: Vec<WayCase>,
    /// The number of further ways.
    pub(in crate::replay) more_ways: usize,
    need: NeedId,
    pieces: Vec<Piece>,
}

/// A piece of evidence, with its places in the cases of ways.
struct Piece {
    contract: ContractId,
    watched: Watched,
    /// The way that it is about.
    of: Option<usize>,
    truth: Option<Truth>,
    places: Vec<(usize, EvidenceId)>,
}

/// The cases of all needs under contract, under one model after the other.
#[derive(Default)]
pub(in crate::replay) struct Cases {
    pub(in crate::replay) needs: Vec<NeedCase>,
    /// The begin of the cases of the present model.
    present: usize,
}

impl Cases {
    /// Follows another model: the cases of the old one end.
    pub(super) fn follow(&mut self, known: &KnowledgeBase, engine: &Engine, now: Time) {
        self.end(now);
        self.present = self.needs.len();
        let Some(assurance) = Assurance::new(known) else { return };
        let graph = Graph::new(known);
        let demanding = known.needs().ids().filter(|&need| assurance.demands(need));
        self.needs.extend(demanding.map(|need| {
            let prospect = Prospect::new(known, &assurance, &graph, need);
            NeedCase::new(known, engine, prospect, now)
        }));
    }

    /// Reads all evidence; call it after each input.
    pub(super) fn look(&mut self, engine: &Engine, now: Time) {
        self.needs.iter_mut().skip(self.present).for_each(|need| need.look(engine, now));
    }

    /// Notes what serves a need.
    pub(super) fn served(&mut self, need: NeedId, source: &ServedBy) {
        let ServedBy::Way(name) = source else { return };
        let mut cases = self.needs.iter_mut().skip(self.present);
        let Some(case) = cases.find(|it| it.need == need) else { return };
        case.ways.iter_mut().filter(|way| way.name == *name).for_each(|way| way.has_served = true);
    }

    /// Ends the cases of the present model.
    pub(super) fn end(&mut self, now: Time) {
        let ways = self.needs.iter_mut().skip(self.present).flat_map(|need| &mut need.ways);
        ways.flat_map(|way| &mut way.courses).for_each(|course| course.end(now));
    }
}

impl NeedCase {
    fn new(known: &KnowledgeBase, engine: &Engine, prospect: Prospect, now: Time) -> NeedCase {
        let need = prospect.need;
        let more_ways = prospect.ways.len().saturating_sub(MOST_WAYS);
        let ways: Vec<WayCase> =
            prospect.ways.into_iter().take(MOST_WAYS).map(|it| WayCase::new(known, need, it)).collect();
        let mut pieces: Vec<Piece> = Vec::new();
        for (at, way) in ways.iter().enumerate() {
            for (id, contract, watched) in way.composition.evidence(known) {
                let of = matches!(watched.source, EvidenceSource::Source(_)).then_some(at);
                let is_it = |it: &&mut Piece| (it.contract, &it.watched, it.of) == (contract, watched, of);
                match pieces.iter_mut().find(is_it) {
                    Some(piece) => piece.places.push((at, id)),
                    None => {
                        let (watched, places) = (watched.clone(), vec![(at, id)]);
                        pieces.push(Piece { contract, watched, of, truth: None, places });
                    }
                }
            }
        }
        let signal = known.needs()[need].signal.clone();
        let mut case = NeedCase { signal, ways, more_ways, need, pieces };
        case.look(engine, now);
        for way in &mut case.ways {
            way.argument = way.argued();
            way.courses = way.argument.nodes.iter().map(|node| Course::new(now, node.state)).collect();
        }
        case
    }

    fn look(&mut self, engine: &Engine, now: Time) {
        let mut changed = [false; MOST_WAYS];
        for piece in &mut self.pieces {
            let about = piece.of.or(piece.places.first().map(|&(at, _)| at)).and_then(|at| self.ways.get(at));
            let Some(about) = about else { continue };
            let truth = engine.observed(piece.contract, &piece.watched, &about.way);
            if piece.truth.replace(truth) == Some(truth) {
                continue;
            }
            for &(at, id) in &piece.places {
                let WayCase { composition, evaluation, .. } = &mut self.ways[at];
                evaluation.set(composition.system(), id, truth);
                changed[at] = true;
            }
        }
        let ways = self.ways.iter_mut().zip(changed).filter(|(_, is_changed)| *is_changed);
        ways.for_each(|(way, _)| way.turn(now));
    }
}

impl WayCase {
    fn new(known: &KnowledgeBase, need: NeedId, candidacy: Candidacy) -> WayCase {
        let Candidacy { way, composition, .. } = candidacy;
        let name = way.describe(known);
        let observed = words::observed(known, &composition);
        let claim = format!("{} is given what it asks, by {name}", known.need_name(need));
        let evaluation = composition.evaluation();
        let argument = Argument { nodes: Vec::new() };
        let (courses, has_served) = (Vec::new(), false);
        WayCase { name, has_served, argument, courses, way, composition, evaluation, claim, observed }
    }

    fn argued(&self) -> Argument {
        let observed = |id: EvidenceId| self.observed.get(id.index()).cloned().unwrap_or_default();
        let system = self.composition.system();
        Argument::of_any(system, &self.evaluation, &self.claim, self.composition.roots(), &observed)
    }

    fn turn(&mut self, now: Time) {
        self.argument = self.argued();
        let states = self.argument.nodes.iter().map(|node| node.state);
        self.courses.iter_mut().zip(states).for_each(|(course, state)| course.turn(now, state));
    }
}

/// On which ground a need was served over time, and at which level: from the first to the last value of each stretch.
pub(in crate::replay) struct Admissions {
    max_age: Span,
    pub(in crate::replay) all: Vec<(Validity, Admitted)>,
    pub(in crate::replay) more: usize,
}

impl Admissions {
    pub(super) fn new(max_age: Span) -> Admissions {
        Admissions { max_age, all: Vec::new(), more: 0 }
    }

    pub(super) fn take(&mut self, publication: &Publication) {
        let (now, admitted) = (publication.time, publication.admitted);
        let has_room = self.all.len() < MOST_CHANGES;
        match self.all.last_mut() {
            Some((last, of)) if *of == admitted && now <= last.to + self.max_age => last.to = now,
            _ if has_room => self.all.push((Validity { from: now, to: now }, admitted)),
            _ => self.more += 1,
        }
    }
}
