//! No value is published without a contract that admits it by the knowledge and the evidence of that moment, for any inputs.

use crate::driven::text;
use crate::plan_support::Random;
use crate::seeds::seeds;
use shsa_core::assurance::Ground;
use shsa_core::engine::{Engine, EventKind, Input, Options, Order, Output, Publication, Subject, Ticks};
use shsa_core::interval::{Interval, Truth};
use shsa_core::knowledge::{
    self, Asked, BodyDraft, Bounds, Condition, Contract, Contracts, Draft, EvidenceSource, Given, Id, IdVec,
    KnowledgeBase, Measure, NeedDraft, Party, Policy, RelationDraft, Severity, SignalDraft, SignalId,
    VariableDraft, Watched, build,
};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::statement::{Level, Statement};
use shsa_core::time::{Span, Time};

const MS: i64 = 1_000_000;
const MAX_AGE_MS: i64 = 300;

/// A condition of a guarantee.
#[derive(Clone, Debug)]
enum Leaf {
    /// The newest value of the sensor is at most this old.
    Fresh(i64),
    /// The temperature is at most this high.
    Cool(f64),
    /// An operator has confirmed it.
    Installed,
}

/// A source of the need: a signal of its variable, or of one from which a relation computes it.
#[derive(Clone, Debug)]
struct Sensor {
    is_direct: bool,
    /// The guarantees by rank, the best first, each with its conditions.
    gives: Vec<(u32, Vec<Leaf>)>,
    /// The rank that its relation demands and gives; without a contract the relation passes the rank on.
    relation: Option<(u32, u32)>,
}

impl Sensor {
    /// Each sensor has a width of its own, which identifies its values.
    fn error(at: usize) -> f64 {
        0.5 + at as f64 / 16.0
    }

    fn random(random: &mut Random) -> Sensor {
        let leaf = |random: &mut Random| match random.below(3) {
            0 => Leaf::Fresh([40, 120, 260][random.below(3)]),
            1 => Leaf::Cool([50.0, 80.0][random.below(2)]),
            _ => Leaf::Installed,
        };
        let leaves = |random: &mut Random| (0..random.below(3)).map(|_| leaf(random)).collect::<Vec<_>>();
        let mut ranks: Vec<u32> = (0..1 + random.below(2)).map(|_| 1 + random.below(4) as u32).collect();
        ranks.sort_unstable();
        Sensor {
            is_direct: random.chance(0.5),
            gives: ranks.into_iter().rev().map(|rank| (rank, leaves(random))).collect(),
            relation: random.chance(0.5).then(|| (1 + random.below(4) as u32, 1 + random.below(4) as u32)),
        }
    }

    /// The highest rank of the sensor's guarantees, where `holds` decides the leaves.
    fn rank(&self, holds: impl Fn(&Leaf) -> bool) -> Option<u32> {
        let given = self.gives.iter().filter(|(_, leaves)| leaves.iter().all(&holds));
        let own = given.map(|(rank, _)| *rank).max()?;
        match self.relation.filter(|_| !self.is_direct) {
            Some((asks, gives)) => (own >= asks).then_some(gives),
            None => Some(own),
        }
    }
}

/// A model and the demands of its need.
#[derive(Clone, Debug)]
struct System {
    sensors: Vec<Sensor>,
    demanded: u32,
    policy: Policy,
}

fn statement(service: &str, rank: u32) -> Statement {
    let scale = Contracts::default().scales().named("asil").unwrap();
    Statement { service: service.to_owned(), level: Some(Level { scale, rank }), properties: Vec::new() }
}

fn contract(name: &str, subject: knowledge::Subject) -> Contract {
    Contract {
        name: name.to_owned(),
        subject,
        runs_on: None,
        gives: Vec::new(),
        asks: Vec::new(),
        evidence: Vec::new(),
        policy: Policy::default(),
    }
}

fn observed(leaf: &Leaf, signal: SignalId, heat: SignalId) -> (EvidenceSource, Option<Interval>) {
    match leaf {
        Leaf::Fresh(age_ms) => {
            (EvidenceSource::Signal(signal, Measure::Age), Some(Interval::new(0.0, *age_ms as f64 / 1e3)))
        }
        Leaf::Cool(most) => (EvidenceSource::Signal(heat, Measure::Value), Some(Interval::new(-1e9, *most))),
        Leaf::Installed => (EvidenceSource::Attested, None),
    }
}

impl System {
    fn random(random: &mut Random) -> System {
        System {
            sensors: (0..2 + random.below(3)).map(|_| Sensor::random(random)).collect(),
            demanded: 1 + random.below(4) as u32,
            policy: [Policy::Stop, Policy::Stop, Policy::Degrade, Policy::Warn][random.below(4)],
        }
    }

    fn knowledge(&self) -> KnowledgeBase {
        let mut draft = Draft::default();
        let variable = |name: String| VariableDraft { name: text(name), ..VariableDraft::default() };
        draft.variables.extend([variable("v".into()), variable("heat".into())]);
        for (at, sensor) in self.sensors.iter().enumerate() {
            let other = format!("p{at}");
            if !sensor.is_direct {
                draft.variables.push(variable(other.clone()));
                let body = BodyDraft::Equation(text(format!("v = {other}")));
                draft.relations.push(RelationDraft {
                    directions: Some(vec![text("v")]),
                    properties: vec![(text("cost"), text(format!("{}", 1 + at % 3)))],
                    ..RelationDraft::new(text(format!("r{at}")), body)
                });
            }
            draft.signals.push(SignalDraft {
                name: text(format!("s{at}")),
                variable: Some(text(if sensor.is_direct { "v".to_owned() } else { other })),
                timeout: Some(text("1 s")),
                value_error: Some(Bounds::One(text(format!("{}", Sensor::error(at))))),
                ..SignalDraft::default()
            });
        }
        draft.signals.push(SignalDraft {
            name: text("heat"),
            variable: Some(text("heat")),
            ..SignalDraft::default()
        });
        draft.needs.push(NeedDraft {
            variable: text("v"),
            signal: Some(text("/v")),
            max_age: Some(text(format!("{MAX_AGE_MS} ms"))),
            hold: Some(text("0 s")),
            probation: Some(text("50 ms")),
            blend: Some(text("0 s")),
            ..NeedDraft::default()
        });
        let (knowledge, problems) = build(&draft);
        let errors: Vec<_> = problems.iter().filter(|it| it.severity == Severity::Error).collect();
        assert!(errors.is_empty(), "{errors:?}");
        let contracts = self.contracts(&knowledge);
        knowledge.with_contracts(contracts)
    }

    fn contracts(&self, knowledge: &KnowledgeBase) -> Contracts {
        let heat = knowledge.signal("heat").unwrap();
        let v = knowledge.variable("v").unwrap();
        let mut rows = IdVec::new();
        for (at, sensor) in self.sensors.iter().enumerate() {
            let signal = SignalId::from_index(at);
            let input = knowledge.signals()[signal].variable;
            let input_name = knowledge.variables()[input].name.clone();
            let mut own = contract(&format!("s{at}"), knowledge::Subject::Signal(signal));
            for (nth, (rank, leaves)) in sensor.gives.iter().enumerate() {
                let first = own.evidence.len();
                own.evidence.extend(leaves.iter().enumerate().map(|(place, leaf)| {
                    let (source, within) = observed(leaf, signal, heat);
                    // Evidence from an operator has a name of its own.
                    let name = match leaf {
                        Leaf::Installed => "installed".to_owned(),
                        _ => format!("e{nth}{place}"),
                    };
                    Watched { name, source, within, max_age: None }
                }));
                let all = (first..own.evidence.len()).map(Condition::Watched).collect();
                own.gives.push(Given {
                    name: format!("g{nth}"),
                    statement: statement(&input_name, *rank),
                    when: Condition::All(all),
                    redundant: None,
                });
            }
            rows.push(own);
            if let (false, Some((asks, gives))) = (sensor.is_direct, sensor.relation) {
                let relation = knowledge.producers(v).iter().copied();
                let relation =
                    relation.into_iter().find(|&id| knowledge.relations()[id].name == format!("r{at}"));
                let mut own = contract(&format!("r{at}"), knowledge::Subject::Relation(relation.unwrap()));
                own.asks.push(Asked {
                    name: "input".to_owned(),
                    statement: statement(&input_name, asks),
                    of: Party::Provider(input),
                });
                own.gives.push(Given {
                    name: "result".to_owned(),
                    statement: statement("v", gives),
                    when: Condition::Asked(0),
                    redundant: None,
                });
                rows.push(own);
            }
        }
        let need = knowledge.needs().ids().next().unwrap();
        let mut own = contract("v", knowledge::Subject::Need(need));
        own.policy = self.policy;
        own.asks.push(Asked {
            name: "v".to_owned(),
            statement: statement("v", self.demanded),
            of: Party::Provider(v),
        });
        rows.push(own);
        Contracts::new(rows)
    }
}

/// The outside world: when each signal last spoke, the temperature, and the installed sensors.
#[derive(Clone, Debug, Default)]
struct Outside {
    spoke: Vec<Option<Time>>,
    heat: Option<f64>,
    installed: Vec<Option<bool>>,
    overridden: Option<Time>,
    /// When each sensor's guarantee was last sufficient.
    met: Vec<Option<Time>>,
}

impl Outside {
    fn truth(&self, at: usize, leaf: &Leaf, now: Time) -> Truth {
        let unknown = |known: Option<bool>| known.map_or(Truth::Unknown, Truth::from);
        match leaf {
            Leaf::Fresh(age_ms) => {
                unknown(self.spoke[at].map(|spoke| now - spoke <= Span::from_millis(*age_ms)))
            }
            Leaf::Cool(most) => unknown(self.heat.map(|heat| heat <= *most)),
            Leaf::Installed => unknown(self.installed[at]),
        }
    }

    /// The rank that a sensor gives for certain, and the rank if all unknown evidence held.
    fn ranks(&self, sensor: &Sensor, at: usize, now: Time) -> (Option<u32>, Option<u32>) {
        let sure = sensor.rank(|leaf| self.truth(at, leaf, now).is_true());
        (sure, sensor.rank(|leaf| !self.truth(at, leaf, now).is_false()))
    }

    fn note(&mut self, system: &System, now: Time) {
        for (at, sensor) in system.sensors.iter().enumerate() {
            if self.ranks(sensor, at, now).0.is_some_and(|rank| rank >= system.demanded) {
                self.met[at] = Some(now);
            }
        }
    }
}

/// Runs a system, and checks all publications.
struct Run {
    system: System,
    engine: Engine,
    outside: Outside,
    now: Time,
    grounds: Vec<Ground>,
}

impl Run {
    fn new(system: System) -> Run {
        let engine = Engine::new(system.knowledge(), Options::default());
        let count = system.sensors.len();
        let outside = Outside {
            spoke: vec![None; count],
            installed: vec![None; count],
            met: vec![None; count],
            ..Outside::default()
        };
        Run { system, engine, outside, now: Time(0), grounds: Vec::new() }
    }

    fn pass(&mut self, until: Time) {
        let mut ticks = Ticks::before(until);
        let mut count = 0;
        while let Some(due) = ticks.next(&self.engine) {
            // Nothing changes until then.
            self.outside.note(&self.system, due - Span(1_000));
            self.now = self.now.max(due);
            self.engine.handle(Input::Tick(due));
            self.take();
            count += 1;
            assert!(count < 10_000, "ticks do not end");
        }
        self.now = until;
        self.outside.note(&self.system, self.now);
    }

    fn take(&mut self) {
        while let Some(output) = self.engine.poll() {
            if let Output::Publication(publication) = output {
                self.check(&publication);
            }
        }
        self.outside.note(&self.system, self.now);
    }

    fn sensor(&self, publication: &Publication) -> usize {
        let name = format!("{:?}", publication.source);
        let is_it = |at: &usize| name.contains(&format!("(\"s{at}")); // fewer than ten
        (0..self.system.sensors.len()).find(is_it).unwrap_or_else(|| panic!("{publication:?}"))
    }

    fn check(&mut self, publication: &Publication) {
        let Run { system, outside, .. } = &*self;
        let System { sensors, demanded, policy } = system;
        let at = self.sensor(publication);
        let now = publication.time;
        let (sure, hoped) = outside.ranks(&sensors[at], at, now);
        let meets = |rank: Option<u32>| rank.is_some_and(|rank| rank >= *demanded);
        let stated = publication.admitted;
        let reported = || format!("{publication:?} from s{at} of {system:#?}, {outside:?}");
        // The level is that of the guarantee, never higher.
        assert_eq!(stated.level.map(|level| level.rank), sure, "{}", reported());
        let is_overridden = outside.overridden.is_some_and(|until| now < until);
        let is_right = match stated.ground {
            Ground::Undemanded => false,
            Ground::Met => meets(sure),
            Ground::Lapsing => {
                let lapsed =
                    outside.met[at].is_some_and(|met| now - met <= Span::from_millis(MAX_AGE_MS + 50));
                !meets(sure) && meets(hoped) && lapsed
            }
            Ground::Degraded => *policy == Policy::Degrade && sure.is_some() && !meets(sure),
            Ground::Warned => *policy == Policy::Warn && !meets(sure),
            Ground::Overridden => is_overridden && !meets(sure),
        };
        assert!(is_right, "{}", reported());
        self.grounds.push(stated.ground);
    }

    fn observe(&mut self, at: usize, value: f64) {
        let signal = SignalId::from_index(at);
        let observation =
            Observation { signal, stamp: self.now, received: self.now, value: RawValue::Number(value) };
        self.engine.handle(Input::Observation(observation));
        match self.outside.spoke.get_mut(at) {
            Some(spoke) => *spoke = Some(self.now),
            None => self.outside.heat = Some(value),
        }
    }

    fn order(&mut self, order: Order) {
        let stated = self.engine.order(&order, self.now);
        match (&order, stated) {
            (Order::Attest { evidence, holds }, Ok(())) => {
                let at: usize = evidence[1..evidence.find('/').unwrap()].parse().unwrap();
                self.outside.installed[at] = Some(*holds);
            }
            (Order::Override { lasts, .. }, Ok(())) => self.outside.overridden = Some(self.now + *lasts),
            (Order::Release(_), Ok(())) => self.outside.overridden = None,
            _ => {}
        }
        self.take();
    }

    fn step(&mut self, random: &mut Random) {
        let gap = [1, 2, 10, 10, 10, 30, 100, 400][random.below(8)];
        let next = self.now + Span(gap * MS);
        self.pass(next);
        let count = self.system.sensors.len();
        match random.below(20) {
            0 => {
                let evidence = format!("s{}/installed", random.below(count));
                self.order(Order::Attest { evidence, holds: random.chance(0.7) });
            }
            1 => {
                let lasts = Span::from_millis(1 + random.below(600) as i64);
                self.order(Order::Override { need: "/v".to_owned(), lasts, because: "test".to_owned() });
            }
            2 => self.order(Order::Release("/v".to_owned())),
            3 => {
                let subject = Subject::Signal(format!("s{}", random.below(count)));
                self.order(if random.chance(0.3) { Order::Forbid(subject) } else { Order::Allow(subject) });
            }
            4 => {
                let at = random.below(count);
                let source = if self.system.sensors[at].is_direct {
                    format!("s{at}")
                } else {
                    format!("s{at} by r{at}")
                };
                self.order(Order::Force { need: "/v".to_owned(), source });
            }
            5 => self.reload(random),
            6..9 => self.observe(count, [20.0, 60.0, 90.0][random.below(3)]),
            9 => self.observe(random.below(count), 40.0),
            _ => {
                let silent = random.below(2 * count);
                (0..count).filter(|at| *at != silent).for_each(|at| self.observe(at, 10.0));
            }
        }
        // Inputs of this moment are taken together.
        self.engine.handle(Input::Tick(self.now));
        self.take();
    }

    /// Changes a contract, or the demands of the need.
    fn reload(&mut self, random: &mut Random) {
        let mut system = self.system.clone();
        match random.below(3) {
            0 => system.demanded = 1 + random.below(4) as u32,
            1 => system.policy = [Policy::Stop, Policy::Degrade, Policy::Warn][random.below(3)],
            _ => {
                let at = random.below(system.sensors.len());
                let is_direct = system.sensors[at].is_direct;
                system.sensors[at] = Sensor { is_direct, ..Sensor::random(random) };
            }
        }
        // Outputs until then are judged by the old contracts.
        self.take();
        self.engine.reload(system.knowledge(), self.now);
        self.outside.installed = self.engine_installed();
        self.system = system;
        self.take();
    }

    /// Told evidence stays in force where the changed contracts still use it.
    fn engine_installed(&self) -> Vec<Option<bool>> {
        let mut installed = vec![None; self.system.sensors.len()];
        for order in self.engine.standing_orders() {
            if let Order::Attest { evidence, holds } = order {
                let at: usize = evidence[1..evidence.find('/').unwrap()].parse().unwrap();
                installed[at] = Some(holds);
            }
        }
        installed
    }
}

#[test]
fn nothing_goes_out_that_is_not_admitted_at_that_moment() {
    let mut grounds: Vec<Ground> = Vec::new();
    for seed in seeds(300) {
        let mut random = Random(seed);
        let mut run = Run::new(System::random(&mut random));
        for _ in 0..60 {
            run.step(&mut random);
        }
        grounds.extend(run.grounds);
    }
    for ground in Ground::ALL.into_iter().filter(|it| *it != Ground::Undemanded) {
        let count = grounds.iter().filter(|it| **it == ground).count();
        assert!(count > 5, "{ground:?} only {count} times of {}", grounds.len());
    }
}

/// A sensor whose guarantee rests on one leaf, and the demanded rank.
fn one(leaf: Leaf) -> System {
    let sensor = Sensor { is_direct: true, gives: vec![(2, vec![leaf])], relation: None };
    System { sensors: vec![sensor], demanded: 2, policy: Policy::Stop }
}

fn events(engine: &mut Engine) -> (usize, Vec<EventKind>) {
    let (mut count, mut kinds) = (0, Vec::new());
    while let Some(output) = engine.poll() {
        match output {
            Output::Publication(_) => count += 1,
            Output::Event(event) => kinds.push(event.kind),
            Output::Task { .. } | Output::Reloaded(_) => {}
        }
    }
    (count, kinds)
}

#[test]
fn evidence_that_fails_is_acted_on_within_one_input() {
    let mut run = Run::new(one(Leaf::Cool(50.0)));
    let speak = |run: &mut Run, at: usize, value: f64| {
        run.now = run.now + Span::from_millis(20);
        run.observe(at, value);
        run.engine.handle(Input::Tick(run.now));
        events(&mut run.engine)
    };
    assert_eq!(speak(&mut run, 1, 20.0).0, 0);
    assert_eq!(speak(&mut run, 0, 1.0), (1, vec![]));
    // The temperature comes, and with the same input the need is no longer served, which is reported.
    let (published, kinds) = speak(&mut run, 1, 60.0);
    assert_eq!((published, kinds), (0, vec![EventKind::Unhealable, EventKind::Refused]));
    assert_eq!(speak(&mut run, 0, 1.0).0, 0);
    assert_eq!(speak(&mut run, 1, 20.0).0, 1);
}

#[test]
fn what_time_alone_takes_away_has_a_deadline() {
    let mut run = Run::new(one(Leaf::Fresh(40)));
    run.observe(0, 1.0);
    run.engine.handle(Input::Tick(run.now));
    assert_eq!(events(&mut run.engine).0, 1);
    let due = run.engine.next_deadline().unwrap();
    assert!(due > Time(40 * MS) && due <= Time(40 * MS + 100), "{due:?}");
    run.engine.handle(Input::Tick(due));
    assert_eq!(events(&mut run.engine).1, [EventKind::Unhealable, EventKind::Refused]);
}
