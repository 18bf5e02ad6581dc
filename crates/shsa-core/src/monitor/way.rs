//! A watched way of knowing: its recent outputs, and its values at the moments of other ways.

use super::{Fresh, WayIndex, one_sided::OneSided, trend::Measured};
use crate::alignment::{Acceptance, History, Known, Line, Port, Reach, Sample};
use crate::circle;
use crate::computation::{Computation, Settled};
use crate::interval::{Course, Interval};
use crate::knowledge::{IdVec, SignalId, SignalSet, VariableId};
use crate::numbers::BENDS_MORE;
use crate::time::{Span, Time, Validity};
use alloc::collections::VecDeque;
use alloc::vec::Vec;

/// A way of knowing under watch, with its recent outputs.
#[derive(Debug)]
pub struct WatchedWay {
    /// The computation of the way's value.
    pub computation: Computation,
    /// The signals that the way rests on, and all their origins.
    pub rests_on: SignalSet,
    /// The signals among these that the way reads, itself or by a fusion; the others are declared ancestors.
    pub reads: SignalSet,
    /// Signals among these that only conditions of relations read: their size does not reach the output.
    pub conditions: SignalSet,
    /// The recent outputs.
    pub outputs: History,
    /// The newest output, where it was taken in here.
    pub(super) measured: Option<Measured>,
    pub(super) reach: Reach,
    /// What bounds the variable between two outputs.
    pub(super) course: Course,
    /// How far an output that is a mean may be from the value at its moment, SI; 0 for others, and where nothing bounds that.
    pub(super) blur: f64,
    /// The turn after which the variable's values repeat, SI; `None` if the variable does not wrap.
    pub(super) turn: Option<f64>,
    /// The declared range of the variable, SI.
    pub(super) range: Option<Interval>,
    /// Whether this is the variable's declared range, and no computation.
    pub(super) is_range: bool,
    pub(super) one_sided: OneSided,
    /// Whether the value is the verdict of a specification: that a condition holds says nothing of the size of what it reads.
    pub(super) is_verdict: bool,
    /// Whether a relation of the way has a condition, without which it says nothing.
    pub(super) is_conditional: bool,
    /// Whether outputs are true at moments, and not over windows or always.
    pub(super) is_of_moments: bool,
    /// The value of a way that rests on constants alone.
    pub(super) constant: Option<Interval>,
    /// The number of outputs in a row, the newest last, at whose moments all inputs were observed; `None` where no trend asks.
    pub(super) observed: Option<usize>,
    /// Pairs that compare when this way delivers.
    pub(super) triggers: Vec<u32>,
    /// Moments at which the way is evaluated once all its inputs are known there, oldest first.
    pub(super) late: VecDeque<Validity>,
}

impl WatchedWay {
    /// The variable that the way knows.
    #[must_use]
    pub fn variable(&self) -> VariableId {
        self.computation.way().substitution.sink
    }

    /// Its newest value, or the constant that it is, SI.
    #[must_use]
    pub fn latest_value(&self) -> Option<Interval> {
        self.constant.or_else(|| self.outputs.newest(0).map(|sample| sample.value))
    }

    /// Whether the value is the verdict of a specification.
    #[must_use]
    pub fn is_verdict(&self) -> bool {
        self.is_verdict
    }

    /// The width of its variable's declared range, SI, where that has two ends.
    #[must_use]
    pub fn range_width(&self) -> Option<f64> {
        self.range.map(Interval::width).filter(|width| width.is_finite())
    }

    /// Whether the value is computed from a signal's values; a condition alone does not count.
    #[must_use]
    pub fn is_sized_by(&self, signal: SignalId) -> bool {
        self.rests_on.contains(signal) && !self.conditions.contains(signal)
    }

    /// Takes in an output; it is a fresh output unless the history refuses it.
    // Called with every output from two places: `inline` alone would not inline it.
    #[inline(always)]
    pub(super) fn take(&mut self, index: WayIndex, sample: Sample, fresh: &mut Vec<Fresh>) {
        let sample = match self.turn {
            Some(turn) => match self.unwrapped(sample, turn) {
                Some(sample) => sample,
                None => return,
            },
            None => sample,
        };
        let acceptance = self.outputs.push(sample);
        if !acceptance.is_kept() {
            return;
        }
        let measured = Measured::of(sample.value);
        if matches!(acceptance, Acceptance::Newest) {
            self.measured = Some(measured);
        }
        fresh.push(Fresh { way: index, validity: sample.validity, measured });
    }

    /// An output in the turn nearest to the one before; `None` for an output that is a whole turn wide.
    #[inline(never)]
    fn unwrapped(&self, sample: Sample, turn: f64) -> Option<Sample> {
        let before = self.outputs.before(sample.validity).map_or(sample.value, |before| before.value);
        let value = circle::nearest(sample.value, before, turn);
        (value.width() < turn).then_some(Sample { value, ..sample })
    }

    /// A value in the turn nearest to another one, where the variable wraps: this is what is compared.
    #[inline]
    #[must_use]
    pub fn in_turn(&self, value: Interval, beside: Interval) -> Interval {
        self.turn.map_or(value, |turn| circle::nearest(value, beside, turn))
    }

    /// The value at a moment: see [`History::about`]. Where each output is true of a window, the hull of all windows that hold
    /// the moment, once there are windows on both sides.
    #[inline]
    #[must_use]
    pub fn about(&self, moment: Validity) -> Known {
        if self.is_of_moments {
            return match self.outputs.about(moment, self.near_reach()) {
                Known::Value(value) if self.blur > 0.0 => Known::Value(value.widened(self.blur)),
                known => known,
            };
        }
        if let Some(constant) = self.constant {
            return Known::Value(constant);
        }
        match self.outputs.newest(0) {
            Some(newest) if newest.validity.centre() >= moment.centre() => Known::or_never(self.near(moment)),
            _ => Known::Later,
        }
    }

    /// Its newest output; where that stands, as it stands now.
    #[must_use]
    pub fn latest(&self, now: Time) -> Option<Sample> {
        if !self.reach.stands {
            return self.outputs.newest(0).copied();
        }
        let moment = Validity::at(now);
        let reading = self.outputs.at(moment, self.reach)?;
        Some(Sample { validity: moment, value: reading.value })
    }

    /// The same for the newest output, where this output is certainly the nearest one and the variable does not wrap. This is
    /// the most frequent case, and its middle and width are already computed.
    // Once for every observation or comparison, from two places: by a hint alone it would be called.
    #[inline(always)]
    pub(super) fn newest_about(&self, moment: Validity) -> Option<Measured> {
        let measured = self.measured.filter(|_| self.is_of_moments && self.turn.is_none())?;
        let margin = self.outputs.newest_about(moment, self.near_reach())?;
        Some(measured.widened(margin + self.blur))
    }

    /// How far from an output its value counts.
    #[inline]
    fn near_reach(&self) -> Reach {
        let max_gap = if self.reach.max_gap == Span::MAX { self.max_gap() } else { self.reach.max_gap };
        Reach { max_gap, ..self.reach }
    }

    /// The value beside an output of the slower way: the mean over the same time where that output is a mean, else the value at
    /// its moment.
    #[inline]
    #[must_use]
    pub fn beside(&self, slower: &WatchedWay, moment: Validity) -> Known {
        match slower.mean_over() == Span::ZERO || self.constant.is_some() {
            true => self.about(moment),
            false => self.mean_beside(slower, moment),
        }
    }

    /// Whether values between its outputs lie near a line: outputs are values of moments, and none stands until the next one.
    pub(super) fn is_of_lines(&self) -> bool {
        self.is_of_moments && !self.reach.stands && self.mean_over() == Span::ZERO
    }

    /// Evaluates at a moment; see [`Computation::evaluate_settled`].
    #[inline]
    pub(super) fn evaluate(&mut self, ports: &IdVec<SignalId, Port>, moment: Validity) -> Settled {
        let settled = self.computation.evaluate_settled(ports, moment);
        if self.observed.is_some() && matches!(settled, Settled::Value(_)) {
            self.note_lag(ports, moment);
        }
        settled
    }

    /// Notes whether all inputs of the newest output were observed at its moment.
    #[inline(never)]
    fn note_lag(&mut self, ports: &IdVec<SignalId, Port>, moment: Validity) {
        let lags = self.computation.lags(ports, moment);
        self.observed = self.observed.map(|count| if lags { 0 } else { count.saturating_add(1) });
    }

    /// Whether the middles of its outputs lag, as an input was not observed at the moment of one of them.
    pub(super) fn lags(&self) -> bool {
        self.observed.is_some_and(|count| count < self.outputs.len())
    }

    /// Whether no output after a moment is known.
    pub(super) fn ends_before(&self, moment: Validity) -> bool {
        self.outputs.newest(0).is_none_or(|newest| newest.validity.centre() < moment.centre())
    }

    /// The line between the two outputs around a moment, in the turn of the value beside it, where outputs are values of moments
    /// and the two are not too far apart.
    #[must_use]
    pub fn line(&self, moment: Validity, beside: Interval) -> Option<Line> {
        let line = self.outputs.line_at(moment.centre()).filter(|line| line.gap <= self.max_gap())?;
        let value = self.in_turn(Interval::point(line.value), beside).midpoint();
        self.is_of_lines().then_some(Line { value, ..line })
    }

    /// The best guess of the value at the moment of another way's output, for statistics: on the line between both neighbours, and
    /// as near to the `usual` value beside that output as the line leaves open. Open is what the value changes within the errors of time, and how far it may be
    /// from the line: as far as it bends, and no further than its rate allows. Of a value that bends as much as its rate allows, too few
    /// samples come to tell how much it bends.
    pub(super) fn guess(&self, line: &Line, usual: f64, moment: Validity, bends: f64) -> f64 {
        let late = Span(moment.length().0 / 2) + self.time_error();
        let (below, above) = match self.course.is_rated() {
            true => line.room(self.course.max_rate, late),
            false => (f64::INFINITY, f64::INFINITY),
        };
        // What is usual may come from one end of the errors of time, and this value from the other.
        let moved = 2.0 * line.slope.abs() * late.seconds();
        let open = |room: f64| if bends < 0.5 * room { bends } else { room };
        let (below, above) = (open(below) + moved, open(above) + moved);
        line.value + (usual - line.value).clamp(-below, above)
    }

    /// The value of the present outputs at a moment, without waiting for more, and whether the value is certain.
    #[inline]
    #[must_use]
    pub fn vote(&self, moment: Validity) -> Option<(Interval, bool)> {
        if self.computation.is_windowed() {
            // A mean over a time is no value of a moment.
            return None;
        }
        if let Some(known) = self.newest_about(moment) {
            return Some((known.value, true));
        }
        let certain = self.about(moment).value();
        let roughly = || self.outputs.roughly_at(moment, self.max_gap());
        certain.map(|value| (value, true)).or_else(|| roughly().map(|value| (value, false)))
    }

    /// The mean beside an output of the slower way: over the same time; or, where outputs are means already, the output over as
    /// long a time around the same moment. 3/4 of a time count as all of it, and 1/8 as next to it.
    fn mean_beside(&self, slower: &WatchedWay, moment: Validity) -> Known {
        let (stretch, usual) = (slower.stretch(moment), slower.mean_over());
        if self.reach.stands && !self.course.is_rated() {
            return Known::or_never(self.outputs.held_reading(stretch).map(|reading| reading.value));
        }
        let Some(newest) = self.outputs.newest(0) else { return Known::Later };
        let most = Span(usual.0 / 4 * 3);
        if self.mean_over() > most {
            if newest.validity.centre() < moment.centre() {
                return Known::Later;
            }
            // A window of the slower way that has only begun is too short to compare.
            let is_whole = stretch.length() > most;
            return Known::or_never(is_whole.then(|| self.mean_around(slower, moment)).flatten());
        }
        if newest.validity.to < stretch.to && !self.reach.stands {
            return Known::Later;
        }
        if self.course.is_rated() {
            return Known::or_never(self.rated_mean(slower, moment));
        }
        let mean = || self.outputs.mean_over(stretch, self.course, self.max_gap());
        let period = self.computation.timing().period;
        if period.is_none_or(|period| period.times(2) > stretch.length()) {
            // Outputs too rare for a mean: the values around are used.
            let mean = period.is_none().then(mean).flatten();
            return mean.map_or_else(|| self.outputs.around(stretch, self.max_gap()), Known::Value);
        }
        Known::or_never(mean())
    }

    /// The mean over the time of an output of the slower way, where the rate of change is bounded. When exactly that time was is not
    /// known better than the times of its ends.
    fn rated_mean(&self, slower: &WatchedWay, moment: Validity) -> Option<Interval> {
        let (stretch, error) = slower.mean_time(moment);
        let off = |length| self.computation.timing().off(length);
        let mean = self.outputs.possible_mean(stretch, self.course, Span::MAX, off)?;
        Some(mean.widened(self.course.max_rate * error.seconds() / 2.0))
    }

    /// The output about the middle of an output of the slower way, where both are means over about as long a time. With a bounded
    /// rate of change the value grows by how far the means may be apart, else by how far they are as the values bend now: over times of different lengths by a quarter of what
    /// changes in the difference; between two outputs `h` apart, as the rate of a mean changes by no more than twice the bound in the
    /// time `t` of the mean, by `h^2 / (4 t)` times the bound.
    fn mean_around(&self, slower: &WatchedWay, moment: Validity) -> Option<Interval> {
        let max_gap = self.max_gap().max(Span(slower.mean_over().0 / 8));
        if !self.course.is_rated() {
            let (value, step) = self.outputs.centred_at(moment, self.time_error(), max_gap)?;
            let (length, own) = (slower.mean_over().seconds(), self.mean_over().seconds());
            let half = Span(self.mean_over().0 / 2);
            let bend = self.outputs.bend(moment.centre(), half, max_gap)?;
            let bent = BENDS_MORE * bend / (half.seconds() * half.seconds());
            return Some(value.widened(
                bent * ((length * length - own * own).abs() / 24.0 + step.seconds() * step.seconds() / 8.0),
            ));
        }
        let (value, step) = self.outputs.centred_at(moment, Span::ZERO, max_gap)?;
        let (times, error) = slower.mean_time(moment);
        let (own_times, own_error) = self.mean_time(self.outputs.newest(0)?.validity);
        let (length, own) = (times.length().seconds(), own_times.length().seconds());
        let between = step.seconds() * step.seconds() / (4.0 * own);
        let off = between + (length - own).abs() / 4.0 + (error + own_error).seconds() / 2.0;
        Some(value.widened(self.course.max_rate * off))
    }

    /// The time over which an output of this validity is a mean.
    fn stretch(&self, validity: Validity) -> Validity {
        if self.computation.is_windowed() {
            return validity;
        }
        let half = Span(self.mean_over().0 / 2);
        Validity { from: validity.from - half, to: validity.to + half }
    }

    /// The same between the middles of the times in which its ends lie, and the length of these times.
    fn mean_time(&self, validity: Validity) -> (Validity, Span) {
        let timing = self.computation.timing();
        let error = if self.computation.is_windowed() { timing.time_error } else { validity.length() };
        let (Validity { from, to }, half) = (self.stretch(validity), Span(error.0 / 2));
        (Validity { from: from + half, to: to - half }, error)
    }

    /// The time error of an output, to either side of its middle.
    fn time_error(&self) -> Span {
        match self.outputs.newest(0) {
            Some(newest) if !self.computation.is_windowed() => Span(newest.validity.length().0 / 2),
            _ => Span::ZERO,
        }
    }

    #[inline]
    pub(super) fn mean_over(&self) -> Span {
        self.computation.timing().mean_over
    }

    /// The values of which the output is one: those of `one_of`, or of several inverses; the output itself where it is one value, or
    /// where the alternatives are those of another moment. `evaluated` is the result of the last evaluation, which the output holds,
    /// perhaps grown.
    pub(super) fn alternatives(
        &self,
        evaluated: Interval,
        output: Measured,
    ) -> impl Iterator<Item = Measured> + Clone {
        let all = self.computation.alternatives();
        let are_of_moment = all.iter().copied().fold(Interval::EMPTY, Interval::hull) == evaluated;
        let all = if are_of_moment { all } else { &[] };
        let grown = (evaluated.lo() - output.value.lo()).max(output.value.hi() - evaluated.hi());
        let margin = if grown > 0.0 { grown.next_up() } else { 0.0 };
        let present =
            all.iter().filter(|one| !one.is_empty()).map(move |one| Measured::of(one.widened(margin)));
        let alone = all.iter().all(|one| one.is_empty()).then_some(output);
        present.chain(alone)
    }

    /// The value beside an output of the slower way, in the same turn, with middle and width; those of the newest output are
    /// reused.
    #[inline]
    pub(super) fn measure(&self, value: Interval, beside: Interval) -> Measured {
        let value = self.in_turn(value, beside);
        let known = self.measured.filter(|last| last.value == value);
        known.unwrap_or_else(|| Measured::of(value))
    }

    /// The value of a way over windows: the hull of those that hold the moment; where the rate of change is bounded, that of the
    /// window whose middle is the nearest, with its growth.
    #[inline(never)]
    fn near(&self, moment: Validity) -> Option<Interval> {
        if self.course.is_rated() {
            let sample = self.outputs.nearest_middle(moment.centre())?;
            let away = (sample.validity.centre() - moment.centre()).abs() + Span(moment.length().0 / 2);
            let off = self.computation.timing().off(sample.validity.length()) + away;
            let is_near = sample.validity.gap(moment) <= self.max_gap();
            return is_near.then(|| sample.value.widened(self.course.max_rate * off.seconds()));
        }
        let reach = Reach { max_gap: self.max_gap(), ..self.reach };
        let reading = self.outputs.at(moment, reach).filter(|reading| reading.gap == Span::ZERO);
        reading.map(|reading| reading.value)
    }

    /// How far from an output its value counts: two periods, or less than that where a condition may have failed in between. As
    /// declared, or else as between the last outputs.
    pub(super) fn max_gap(&self) -> Span {
        if self.reach.max_gap < Span::MAX {
            return self.reach.max_gap;
        }
        let step = self.outputs.usual_step();
        step.map_or(Span::MAX, |step| allowed_gap(step, self.is_conditional))
    }
}

/// How far apart two outputs may be that usually come every `period`, for something to be known of the time in between. One may be
/// missing; but where a condition can fail, none: of that time the way says nothing, and the next whole number of periods is two.
pub(super) fn allowed_gap(period: Span, is_conditional: bool) -> Span {
    if is_conditional { period + Span(period.0 / 2) } else { period.times(2) }
}
