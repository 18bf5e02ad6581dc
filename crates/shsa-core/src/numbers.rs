//! The numbers that decide: each with its unit, where it comes from, and the key that sets it, in one table.
//!
//! Bounds on work and memory, and on how much an event says, stand where they are used: they change no verdict. So do factors that
//! follow from a formula. [`ALL`] is what `docs/numbers.md` is made of.

use crate::time::Span;

/// A number that decides, as the reference shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Number {
    /// The name in the code.
    pub name: &'static str,
    /// What the number decides.
    pub about: &'static str,
    /// The value, as written in the code.
    pub value: &'static str,
    /// The unit.
    pub unit: &'static str,
    /// Where the number comes from, or what shows that it serves.
    pub source: &'static str,
    /// The key of the model, or the option, that sets it.
    pub key: Option<&'static str>,
}

/// Defines each number with its row. A row: documentation, name, type, value, unit, source, and the key that sets the number.
macro_rules! numbers {
    ($($(#[doc = $about:literal])+ $name:ident: $type:ty = $value:expr, $unit:literal, $source:literal $(, $key:literal)?;)+) => {
        $($(#[doc = $about])+ pub const $name: $type = $value;)+

        /// All numbers that decide.
        pub const ALL: &[Number] = &[$(Number {
            name: stringify!($name),
            about: concat!($($about),+),
            value: stringify!($value),
            unit: $unit,
            source: $source,
            key: [$(Some($key),)? None][0],
        }),+];
    };
}

numbers! {
    /// How often a signal is faulty, and how rare a second fault beside it is: two signals with the same error, or a wrong condition.
    PRIOR: f64 = 0.01, "probability", "a choice: the order of magnitude at which one fault explains before two", "prior";
    /// How often a relation does not hold: a fault of the plant.
    RELATION_PRIOR: f64 = 1e-5, "probability", "a choice: a thousandth of `PRIOR`", "prior of a relation";
    /// A prior above this counts as this: an explanation by more faulty than sound components is not meaningful.
    HIGHEST_PRIOR: f64 = 0.49, "probability", "below even odds";
    /// An explanation this many times more probable than another rules it out.
    CLEAR_RATIO: f64 = 50.0, "odds", "below the odds of `PRIOR` (99 to 1): fewer faults rule out more";
    /// The probability without any knowledge: that a comparison overlooks a fault, that an unknown way agrees.
    EVEN: f64 = 0.5, "probability", "the least informative value";
    /// Agreements that may have overlooked the same fault count at most this often: they are not independent.
    MOST_ONE_SIDED: u32 = 4, "comparisons", "`shsa-bench worlds --oracle odds`: printed probabilities are true within 5 points";
    /// A common cause is this many times more probable when a signal that shares it has just failed.
    COINCIDES: f64 = 10.0, "odds", "a choice: one more fault of the cause outweighs one independent fault";
    /// The highest prior that this gives.
    HIGHEST_RAISED: f64 = 0.2, "probability", "a choice: the cause is never certain beforehand";
    /// Events further back than this are separate occasions: independent faults, records of ways.
    RECENT: Span = Span::from_millis(60_000), "ns", "a choice";
    /// A shorter disturbance is passing; a component that is trusted again has been supported for longer.
    LASTING: Span = Span::from_millis(5_000), "ns", "a choice: shocks of a vehicle, and bad roads, are shorter", "probation";
    /// A contradiction waits at most this long for slower comparisons that may decide.
    PATIENCE: Span = Span::from_millis(4_000), "ns", "a choice: below `LASTING`";
    /// A probation, or the wait for a source that fell short, doubles at most this often.
    DOUBLINGS: u32 = 6, "times", "a choice: 5 s grow to 5 minutes";
    /// An accusation within this many probations after the last one is a relapse.
    RELAPSE_PROBATIONS: i64 = 4, "probations", "a choice";
    /// The shortest window of comparisons.
    DEBOUNCE: Span = Span::from_millis(250), "ns", "a choice";
    /// Fewer bad or equal readings in a row, or comparisons in a window, may be chance.
    IN_A_ROW: u32 = 4, "readings", "a choice";
    /// Half: of a window that must disagree, of a tolerance that no drift may use, of a limit below which nothing is near and an
    /// alarm ends.
    HALF: f64 = 0.5, "share", "the middle";
    /// The fewest values that show how something behaves: noise with long tails gives two outliers in a row once in some hundred
    /// hours, but hardly three.
    FEWEST: u32 = 3, "values", "`shsa-bench worlds --kind noise`";
    /// Evidence is stale after this many periods without a comparison or a reading.
    STALE_PERIODS: i64 = 6, "periods", "a window of `IN_A_ROW` and two missing values";
    /// After this many periods a newer value would have come: two may be missing, one late.
    MISSED_PERIODS: i64 = 3, "periods", "two that may be missing, and one that is late";
    /// A value counts as present for this many periods.
    HELD_PERIODS: i64 = 2, "periods", "one that may be missing";
    /// A figure of a way needs this many of its periods.
    OFTEN: i64 = 20, "periods", "a choice";
    /// Single bad values of at least this share are a fault,
    RECURRING_SHARE: f64 = 0.04, "share", "a choice";
    /// and of at least this number.
    RECURRING_LEAST: f64 = 4.5, "values", "a choice: five among `MANY`";
    /// Statistics rest on this many comparisons.
    MANY: u32 = 64, "comparisons", "a standard deviation is known to a tenth";
    /// No single event counts as more than this multiple of the limit.
    AT_ONCE: f64 = 1.5, "limits", "one wild value is not a trend";
    /// Means of a trend go over this multiple of the least number of comparisons.
    TREND_MEMORY: f64 = 4.0, "multiple", "the deviation of a mean over four times as many is half as large";
    /// With known noise: the deviations from the usual difference that a comparison must exceed to count towards a drift,
    DRIFT_STEP: f64 = 0.75, "deviations", "half of the drift that is found soonest (Page 1954, doi:10.1093/biomet/41.1-2.100): 1.5 deviations";
    /// and the sum of such excesses that is a drift.
    DRIFT_ENOUGH: f64 = 12.0, "deviations", "white noise reaches it once in some hundred million comparisons: Siegmund 1985, doi:10.1007/978-1-4757-1862-1";
    /// No single difference counts as more deviations than this, and no pause is usual that is further from the mean.
    WILD: f64 = 4.0, "deviations", "RFC 6298 (pauses); normal noise exceeds it once in 16,000";
    /// With known noise: the weight that suffices for the usual difference, as the noise bounds its error.
    EARLY: f64 = 0.2, "share", "a choice";
    /// This near to an alarm, a drift may become one.
    NEAR: f64 = 0.25, "share of the limit", "a choice";
    /// This many deviations are certainly not noise.
    SURELY: f64 = 3.0, "deviations", "normal noise exceeds it once in 370";
    /// The multiple of the known noise that is too much scatter, and the errors of the past within which an estimate is.
    BEYOND_NOISE: f64 = 2.0, "deviations", "with white noise, no estimate over `MANY` comparisons is so far off; 95 % of normal errors";
    /// Without known noise: the share of the tolerance, scattered or shifted, that is beyond the declared errors.
    OFF_SHARE: f64 = 0.4, "share of the tolerance", "two uniform errors over their whole bounds differ by 0.41, root of the mean square";
    /// The share of the differences' squares that a shift in time must explain.
    SHIFT_EXPLAINS: f64 = 0.8, "share", "a choice";
    /// From this share on: of the tolerance, an agreement may soon end; of changes among differences, these are noise.
    MOSTLY: f64 = 0.75, "share", "a choice";
    /// A shorter time shows nothing yet: scatter, wrong stamps, a first value after a silence; and stamps may be this far ahead.
    BRIEF: Span = Span::from_millis(1_000), "ns", "a choice: clocks that are synchronised over a network differ by less";
    /// Scatter is estimated over at least this many comparisons.
    SCATTER_LEAST: f64 = 16.0, "comparisons", "a standard deviation is known to a fifth";
    /// The longest undeclared delay, and the largest difference between two clocks of one system.
    CLOCKS_APART: Span = Span::from_millis(10_000), "ns", "a choice: a declared `delay` is exempt", "delay";
    /// The recent values that show what is usual.
    LATELY: u32 = 8, "values", "a choice";
    /// Between two samples a value may bend this many times as much as between those that show it,
    BENDS_MORE: f64 = 2.0, "multiple", "`shsa-bench worlds --kind mean`";
    /// and where many lines show it, as much as this.
    BENDS_AT_MOST: f64 = 3.0, "multiple", "`shsa-bench worlds --kind noise`";
    /// Learned values are final after one to two times this: a fault that is noticed earlier discards them.
    CONFIRMED_AFTER: Span = Span::from_millis(600_000), "ns", "a choice: faults are noticed earlier";
    /// The share of its range by which a learned constant moves before the move is a drift, and by which it may lie beyond.
    RANGE_SHARE: f64 = 0.125, "share of the range", "a choice";
    /// Errors below this share of the narrowest width count as equal.
    FINEST_ERROR: f64 = 0.1, "share of the width", "a choice";
}

#[cfg(test)]
mod tests {
    use super::ALL;
    use alloc::collections::BTreeSet;

    #[test]
    fn every_number_has_a_name_of_its_own_a_unit_and_a_source() {
        let names: BTreeSet<&str> = ALL.iter().map(|number| number.name).collect();
        assert_eq!(names.len(), ALL.len());
        for number in ALL {
            assert!(!number.unit.is_empty() && !number.source.is_empty(), "{}", number.name);
        }
    }
}
