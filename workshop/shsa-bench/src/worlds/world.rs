//! A system with known truth: what is declared of it, and how its sensors really behave.

use super::course::{Course, Waves, between, free};
use super::sensor::{Pattern, Schedule};
use super::unit::Dimension;
use shsa_lab::calibration::Chance;
use std::ops::Range;
use std::sync::Arc;

/// A variable and its true course. Values are in SI.
#[derive(Clone)]
pub(super) struct Variable {
    pub(super) dimension: Dimension,
    /// The place of its declared unit in the dimension.
    pub(super) unit: usize,
    /// One course for each element.
    pub(super) courses: Vec<Course>,
    pub(super) is_vector: bool,
    /// The waves that the course is made of, where it is made of these.
    pub(super) waves: Option<Waves>,
    pub(super) wraps: Option<f64>,
    pub(super) range: Option<(f64, f64)>,
    pub(super) max_rate: Option<f64>,
    /// Whether the truth may step, so that no rate bounds it.
    pub(super) steps: bool,
}

/// The right side of an equation minus its left side at a time, in SI; `None` while the relation's condition does not hold.
pub(super) type Off = Arc<dyn Fn(f64) -> Option<f64> + Send + Sync>;

/// A relation. In formulas, `$2` is the third variable.
#[derive(Clone)]
pub(super) struct Relation {
    pub(super) equation: String,
    /// The variable of the left side, in whose unit the error counts.
    pub(super) left: usize,
    pub(super) only_for: Vec<usize>,
    pub(super) when: Option<String>,
    pub(super) error: f64,
    pub(super) learns: Option<usize>,
    pub(super) off: Off,
    /// The inputs and the computation, where it is one of values of one moment.
    pub(super) computed: Option<(Vec<usize>, Compute)>,
}

/// A computation of values of one moment.
pub(super) type Compute = fn(&[f64]) -> f64;

/// A signal. Errors are in SI.
#[derive(Clone)]
pub(super) struct Signal {
    pub(super) variable: usize,
    pub(super) unit: usize,
    /// Each reading times the scale plus the offset is the value in the signal's unit.
    pub(super) scaling: Option<(f64, f64)>,
    pub(super) rate_hz: f64,
    pub(super) declares_rate: bool,
    pub(super) error: (f64, f64),
    pub(super) share: f64,
    pub(super) noise: Option<f64>,
    pub(super) time_error: (f64, f64),
    pub(super) delay: f64,
    pub(super) mean_over: f64,
    pub(super) holds: bool,
    /// How far the truth may be from the last value of a signal that is sent on change.
    pub(super) dead_band: f64,
    /// The part of its error that all its values have alike: the most that it is, and the seconds in which it goes and returns.
    pub(super) offset: Option<(f64, f64)>,
    /// The lowest and the highest value that it can show.
    pub(super) ends: Option<(f64, f64)>,
    pub(super) copies: Option<usize>,
    pub(super) causes: Vec<usize>,
    /// Further keys, as they are written.
    pub(super) keys: String,
    pub(super) pattern: Pattern,
    pub(super) schedule: Schedule,
}

/// A need.
#[derive(Clone)]
pub(super) struct Need {
    pub(super) variable: usize,
    pub(super) max_age: f64,
    pub(super) max_width: Option<f64>,
}

/// A system with known truth.
#[derive(Clone)]
pub(super) struct World {
    pub(super) variables: Vec<Variable>,
    pub(super) relations: Vec<Relation>,
    pub(super) signals: Vec<Signal>,
    pub(super) needs: Vec<Need>,
    /// Entries of other sections as they are written: the section, and a line. `$2` is the third variable, `@0` the first signal.
    pub(super) entries: Vec<(&'static str, String)>,
    /// How many times as long as usual it is watched, and how long that is.
    longer: f64,
    pub(super) seconds: f64,
    /// The rate about which those of its sensors lie.
    pub(super) tempo_hz: f64,
    /// Whether the variables declare how fast they change.
    pub(super) is_rated: bool,
    /// Whether values are lost or late, so that needs may be, too.
    pub(super) has_losses: bool,
    /// Whether some variables step, so that nothing bounds these between two values.
    pub(super) has_steps: bool,
}

/// Readings of the usual sensor in a world, unless this takes less than [`SHORTEST_S`].
const READINGS: f64 = 150.0;
const SHORTEST_S: f64 = 20.0;
/// Without a declared rate, nothing bounds the truth between two samples. Then it is slower than the samples by this: their
/// neighbours miss its peaks by a thousandth of its size.
const SAMPLES_OF_WAVE: f64 = 60.0;

impl World {
    /// A world without anything in it.
    pub(super) fn empty(chance: &mut Chance, longer: f64) -> World {
        let tempo_hz = between(chance, 0.05, 200.0);
        World {
            longer,
            variables: Vec::new(),
            relations: Vec::new(),
            signals: Vec::new(),
            needs: Vec::new(),
            entries: Vec::new(),
            seconds: longer * (READINGS / tempo_hz).max(SHORTEST_S),
            tempo_hz,
            is_rated: chance.below(2) == 0,
            has_losses: false,
            has_steps: false,
        }
    }

    /// Sets the tempo between two rates.
    pub(super) fn set_tempo(&mut self, chance: &mut Chance, low: f64, high: f64) {
        self.tempo_hz = between(chance, low, high);
        self.seconds = self.longer * (READINGS / self.tempo_hz).max(SHORTEST_S);
    }

    /// The shortest and the longest period of true courses.
    pub(super) fn periods(&self) -> (f64, f64) {
        let longest = 2.0 * self.seconds;
        let shortest = if self.is_rated && !self.has_steps {
            self.seconds / 60.0
        } else {
            SAMPLES_OF_WAVE / self.slowest_hz()
        };
        (shortest.min(longest), longest)
    }

    /// The rate of the slowest sensor that [`World::sense`] adds.
    fn slowest_hz(&self) -> f64 {
        0.25 * self.tempo_hz
    }

    /// Adds a variable with this course.
    pub(super) fn add(&mut self, dimension: Dimension, course: Course) -> usize {
        self.variables.push(Variable {
            dimension,
            unit: 0,
            courses: vec![course],
            is_vector: false,
            waves: None,
            wraps: None,
            range: None,
            max_rate: None,
            steps: false,
        });
        self.variables.len() - 1
    }

    /// Adds a variable that moves freely about a middle.
    pub(super) fn add_free(
        &mut self,
        chance: &mut Chance,
        dimension: Dimension,
        middle: f64,
        size: f64,
    ) -> usize {
        let (shortest, longest) = self.periods();
        let course = free(chance, middle, size, shortest, longest);
        self.add(dimension, course)
    }

    /// Adds a variable that is made of waves.
    pub(super) fn add_waves(
        &mut self,
        chance: &mut Chance,
        dimension: Dimension,
        middle: f64,
        size: f64,
    ) -> usize {
        let (shortest, longest) = self.periods();
        let waves = Waves::random(chance, middle, size, shortest, longest);
        let variable = self.add(dimension, waves.course());
        self.variables[variable].waves = Some(waves);
        variable
    }

    /// Adds a variable that is computed from others at each moment.
    pub(super) fn add_computed(&mut self, dimension: Dimension, of: &[usize], compute: Compute) -> usize {
        let courses: Vec<Course> = of.iter().map(|it| self.course(*it)).collect();
        self.add(
            dimension,
            Arc::new(move |time| {
                let values: Vec<f64> = courses.iter().map(|it| it(time)).collect();
                compute(&values)
            }),
        )
    }

    pub(super) fn course(&self, variable: usize) -> Course {
        self.variables[variable].courses[0].clone()
    }

    /// Adds an equation whose right side has this true course.
    pub(super) fn relate(&mut self, left: usize, formula: &str, right: Course) -> &mut Relation {
        let course = self.course(left);
        self.relations.push(Relation {
            equation: format!("${left} = {formula}"),
            left,
            only_for: Vec::new(),
            when: None,
            error: 0.0,
            learns: None,
            off: Arc::new(move |time| Some(right(time) - course(time))),
            computed: None,
        });
        let last = self.relations.len() - 1;
        &mut self.relations[last]
    }

    /// Adds a variable that an equation of others gives, with this formula, exactly or within an error.
    pub(super) fn relate_computed(
        &mut self,
        chance: &mut Chance,
        dimension: Dimension,
        formula: &str,
        of: &[usize],
        compute: Compute,
    ) -> usize {
        let exact = self.add_computed(dimension, of, compute);
        let course = self.course(exact);
        let computed = Some((of.to_vec(), compute));
        if chance.below(2) == 0 {
            self.relate(exact, formula, course).computed = computed;
            return exact;
        }
        // The error of the relation stays at its bound, or wanders from bound to bound.
        let error = 0.02 * self.size(exact);
        let period = self.periods().1 * chance.share();
        let side = if chance.below(2) == 0 { 1.0 } else { -1.0 };
        let stands = chance.below(2) == 0;
        let right = course.clone();
        self.variables[exact].courses[0] = Arc::new(move |time| {
            let off = if stands { 1.0 } else { (time / period * std::f64::consts::TAU).sin() };
            course(time) + side * error * off
        });
        let relation = self.relate(exact, formula, right);
        relation.error = error * 1.000_001;
        relation.computed = computed;
        exact
    }

    /// Half of the span of a variable's true values; where it does not move, a share of its value.
    pub(super) fn size(&self, variable: usize) -> f64 {
        let (lo, hi) = self.extremes(variable);
        let least = 0.05 * lo.abs().max(hi.abs());
        (0.5 * (hi - lo)).max(least).max(1e-6)
    }

    /// The least and the greatest true value, as samples show them.
    pub(super) fn extremes(&self, variable: usize) -> (f64, f64) {
        self.extremes_of(variable, 400)
    }

    fn extremes_of(&self, variable: usize, count: i32) -> (f64, f64) {
        let times = (0..=count).map(|at| self.seconds * f64::from(at) / f64::from(count));
        let values = times.flat_map(|time| self.variables[variable].courses.iter().map(move |it| it(time)));
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), it| (lo.min(it), hi.max(it)))
    }

    /// Adds sensors of a variable: a number of these.
    pub(super) fn sense(&mut self, chance: &mut Chance, variable: usize, counts: Range<usize>) {
        for _ in 0..counts.start + chance.below(counts.len()) {
            let signal = self.sensor(chance, variable);
            self.signals.push(signal);
        }
    }

    /// Adds one to three sensors of each variable that has none.
    pub(super) fn sense_rest(&mut self, chance: &mut Chance) {
        for variable in 0..self.variables.len() {
            let is_learned = self.relations.iter().any(|it| it.learns == Some(variable));
            if !is_learned && !self.signals.iter().any(|it| it.variable == variable) {
                self.sense(chance, variable, 1..4);
            }
        }
    }

    /// A sensor at some rate about the tempo, with errors at their bounds.
    pub(super) fn sensor(&self, chance: &mut Chance, variable: usize) -> Signal {
        let size = self.size(variable);
        let half = size * between(chance, 0.001, 0.2);
        let error = match chance.below(6) {
            0 => (-0.2 * half, half),
            1 => (0.0, half),
            _ => (-half, half),
        };
        let factor = [0.25, 0.5, 1.0, 1.0, 2.0, 4.0][chance.below(6)];
        let dimension = self.variables[variable].dimension;
        Signal {
            variable,
            unit: chance.below(dimension.len()),
            scaling: None,
            rate_hz: rounded((factor * self.tempo_hz).clamp(0.05, 200.0)),
            declares_rate: chance.below(8) > 0,
            error,
            share: 0.0,
            noise: None,
            time_error: (0.0, 0.0),
            delay: 0.0,
            mean_over: 0.0,
            holds: false,
            dead_band: 0.0,
            offset: None,
            ends: None,
            copies: None,
            causes: Vec::new(),
            keys: String::new(),
            pattern: Pattern::random(chance, self.seconds),
            schedule: Schedule {
                jitter: [0.0, 0.2, 0.9][chance.below(3)],
                latency: (0.0, 0.02 / self.tempo_hz),
                in_order: true,
                ..Schedule::default()
            },
        }
    }

    /// Declares the largest rates, ranges and units of variables, and needs: at bounds that the truth reaches.
    pub(super) fn declare(&mut self, chance: &mut Chance) {
        for variable in 0..self.variables.len() {
            let (lo, hi) = self.extremes_of(variable, 2000);
            let steepest = self.steepest(variable);
            let margin = [1.0, 1.0, 1.5, 4.0][chance.below(4)];
            let size = self.size(variable);
            let is_ranged = chance.below(3) == 0;
            let own = &mut self.variables[variable];
            own.unit = chance.below(own.dimension.len());
            if self.is_rated && !own.steps {
                own.max_rate.get_or_insert((1.02 * steepest * margin).max(1e-3 * size / self.seconds));
            }
            if is_ranged && own.wraps.is_none() && own.range.is_none() {
                // Samples miss the peaks of the fastest triangles by so much.
                let rest = (0.08 + margin - 1.0) * size;
                own.range = Some((lo - rest, hi + rest));
            }
        }
        for variable in 0..self.variables.len() {
            let is_sensed = self.signals.iter().any(|it| it.variable == variable);
            if is_sensed && (variable == 0 || chance.below(2) == 0) {
                self.need(chance, variable);
            }
        }
    }

    fn need(&mut self, chance: &mut Chance, variable: usize) {
        let slowest = self.signals.iter().map(|it| it.rate_hz).fold(f64::INFINITY, f64::min);
        let late = self.signals.iter().map(|it| it.delay + it.mean_over + it.time_error.1 - it.time_error.0);
        let max_age = 6.0 / slowest + 1.0 + 3.0 * late.fold(0.0, f64::max);
        let max_width = (chance.below(2) == 0).then(|| 20.0 * self.size(variable));
        self.needs.push(Need { variable, max_age, max_width });
    }

    /// The largest rate of change that samples show.
    pub(super) fn steepest(&self, variable: usize) -> f64 {
        let own = &self.variables[variable];
        let step = self.seconds / 3000.0;
        let rate = |course: &Course| {
            let rate =
                |at: i32| (course(step * f64::from(at + 1)) - course(step * f64::from(at))).abs() / step;
            (-60..3060).map(rate).fold(0.0, f64::max)
        };
        own.courses.iter().map(rate).fold(0.0, f64::max)
    }
}

/// Three digits, as people write rates.
fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}
