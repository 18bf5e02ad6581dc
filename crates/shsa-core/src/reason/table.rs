//! The table of all reasons: a stable code, a description, and arguments. Files contain the codes and the names of arguments, so
//! that these are only added to and never changed.

use super::Described;
use super::argument::{Amount, Argument, Candidate, Kind, Probability, Range, ServedBy, Value};
use super::declared::reasons;
use crate::order::{Order, Subject};
use crate::time::Span;
use alloc::{string::String, vec::Vec};

reasons! {
    // Evidence of a signal itself.
    /// Nothing was received from a signal within its timeout.
    "nothing-received" NothingReceived { within: Span = "The timeout." };
    /// Within the timeout of a signal, every value was not a number, infinite, or of a wrong shape.
    "nothing-possible" NothingPossible { within: Span = "The timeout." };
    /// Within the timeout of a signal, every value was out of its range.
    "only-out-of-range" OnlyOutOfRange { range: Range = "The range.", within: Span = "The timeout." };
    /// When the last value came.
    "last-value" LastValue { ago: Span = "How long before." };
    /// No value ever came.
    "no-value-ever" NoValueEver;
    /// All signals that share a common cause are absent together.
    "absent-together" AbsentTogether { cause: String = "The common cause." };
    /// A value had a wrong shape.
    "wrong-shape" WrongShape;
    /// A value was not a number.
    "not-a-number" NotANumber;
    /// A value was infinite.
    "infinite" Infinite;
    /// The lower bound of a value was above the upper one.
    "bounds-crossed" BoundsCrossed;
    /// A value was out of the range of its signal.
    "out-of-range" OutOfRange { value: Range = "The value.", range: Range = "The range." };
    /// Two values changed faster than their variable can.
    "too-fast" TooFast {
        from: Range = "The value before.", to: Range = "The value after.",
        within: Span = "The time between them.", most: Amount = "What is possible in a second."
    };
    /// What only counts up was lower than before.
    "counted-down" CountedDown { from: Range = "The value before.", to: Range = "The value after." };
    /// A counter has begun anew.
    "counts-anew" CountsAnew { from: Range = "The first value.", last: Range = "The last value before." };
    /// A time stamp was before an earlier one.
    "stamp-went-back" StampWentBack { by: Span = "By how much." };
    /// A value arrived too long after its time stamp.
    "arrived-late" ArrivedLate { after: Span = "After how long.", allowed: Span = "What is allowed." };
    /// A signal has repeated its value for too long.
    "stood-still" StoodStill { lasted: Span = "For how long.", allowed: Span = "What is allowed." };
    /// Time stamps are further ahead of the reception than clocks of one system differ.
    "stamps-ahead" StampsAhead { by: Span = "By how much." };
    /// Time stamps are further behind the reception than clocks of one system differ.
    "stamps-behind" StampsBehind { by: Span = "By how much." };
    /// The time stamp stands still while the values change.
    "stamp-stands" StampStands { lasted: Span = "For how long." };
    /// The number of recent values that show the fault.
    "readings" Readings { bad: u64 = "How many do.", of: u64 = "Of how many." };
    /// A signal that was absent has given values for its probation.
    "spoken-again" SpokenAgain { lasted: Span = "The probation." };
    // Evidence of comparisons.
    /// Two ways of knowing a variable give values that contradict each other.
    "disagree" Disagree {
        one: String = "The way that was compared.", value: Range = "What it said.",
        other: String = "The way that it was compared with.", expected: Range = "What that said.",
        bad: u64 = "How many of the recent comparisons disagree.", of: u64 = "Of how many."
    };
    /// The values of signals violate a temporal specification.
    "violated" Violated {
        specification: String = "Its name.", text: String = "What it requires.", signals: String = "What it reads.",
        bad: u64 = "How many of the recent evaluations violate it.", of: u64 = "Of how many."
    };
    /// Over many comparisons, one way has given larger values than another.
    "says-more" SaysMore {
        more: String = "What has said more.", by: Amount = "By how much on average.", less: String = "What has said less."
    };
    /// Two ways scatter against each other more than they should.
    "scatter" Scatter { one: String = "The one way.", other: String = "The other way." };
    /// Two ways give the same values at different times.
    "other-times" OtherTimes { one: String = "The one way.", other: String = "The other way." };
    /// Two ways disagreed, and no longer do.
    "disagreed" Disagreed { one: String = "The one way.", other: String = "The other way." };
    /// The number of disagreements that are not reported.
    "more-disagreements" MoreDisagreements { count: u64 = "How many more." };
    /// No comparison of the accused itself disagrees.
    "no-disagreement" NoDisagreement;
    /// A signal has repeated its value while others moved.
    "said-the-same" SaidTheSame { lasted: Span = "For how long." };
    /// The values of a signal seem to belong to later moments than their stamps.
    "seems-early" SeemsEarly { by: Span = "By how much." };
    /// The values of a signal seem to belong to earlier moments than their stamps.
    "seems-late" SeemsLate { by: Span = "By how much." };
    /// The values of a signal scatter around those of others.
    "scatters" Scatters;
    /// The values of a signal would agree with the others in another unit.
    "right-in" RightIn { unit: String = "The unit." };
    /// The difference from other values has grown slowly.
    "built-up" BuiltUp;
    // How the accused was found.
    /// A common cause explains the conflicts best.
    "shared-explains-best" SharedExplainsBest {
        cause: String = "The common cause.", signals: Vec<String> = "The signals that share it."
    };
    /// A learned variable has moved by a good part of its range.
    "drifts" Drifts {
        variable: String = "The variable.", from: Range = "All that it can have been.",
        to: Range = "All that it can be now.", within: Span = "The time between.",
        range: Range = "Its range.", remaining: Span = "After how long it leaves the range, if it goes on like this."
    };
    /// A learned variable has certainly left its range.
    "left-its-range" LeftItsRange {
        variable: String = "The variable.", value: Range = "All that it can be.", range: Range = "The range."
    };
    /// A learned variable may be in its range again.
    "back-in-range" BackInRange {
        variable: String = "The variable.", value: Range = "All that it can be.", range: Range = "The range."
    };
    /// A relation no longer holds.
    "relation-broken" RelationBroken { relation: String = "The relation." };
    /// No other explanation is as probable.
    "most-probable" MostProbable;
    /// One explanation is the most probable, but some comparisons are undecided.
    "undecided" Undecided;
    /// No other explanation is as probable, but this few disagreements of noisy values may be chance.
    "may-be-chance" MayBeChance;
    /// Several components explain the conflicts equally well.
    "any-of" AnyOf { choices: Vec<Subject> = "Those that do." };
    /// A common cause is the reason.
    "by-shared" ByShared { cause: String = "The common cause.", signals: Vec<String> = "The signals that share it." };
    /// The probability of the accusation, and the next best explanation.
    "probability-and-next" ProbabilityAndNext {
        own: Probability = "Of the accused.", next: Subject = "The next one.", other: Probability = "Of the next one."
    };
    /// The probability of the accusation.
    "probability" Probability { own: Probability = "That of the accused." };
    /// There are too many possibilities for an exact number.
    "too-many-possibilities" TooManyPossibilities;
    /// A component was accused again soon after it was trusted.
    "intermittent" Intermittent { times: u64 = "How often." };
    // How an accusation ends, or continues.
    /// Every comparison agrees again.
    "all-agree" AllAgree;
    /// Other components explain all that speaks against it.
    "others-explain" OthersExplain;
    /// The values are sound and others agree with them.
    "witnesses-agree" WitnessesAgree { lasted: Span = "For how long." };
    /// The values are sound and within reach of the last sound one, and nothing has contradicted them.
    "came-back" CameBack { lasted: Span = "For how long." };
    /// The values are sound since they have started anew: from 0, or after a wrong first value.
    "started-anew" StartedAnew { lasted: Span = "For how long." };
    /// Evidence neither accuses nor supports the component any more.
    "nothing-either-way" NothingEitherWay { lasted: Span = "For how long." };
    /// The component is contradicted again after evidence no longer accused it.
    "contradicted-again" ContradictedAgain;
    /// The operator has cleared the accused.
    "cleared" Cleared;
    /// The operator has cleared the signal with all that share a common cause.
    "cleared-with" ClearedWith { cause: String = "The common cause." };
    /// The changed model describes the accused differently.
    "described-anew" DescribedAnew;
    /// The comparisons that accused the component are gone with the changed model.
    "comparisons-gone" ComparisonsGone;
    /// Another instance has accused the component, of which there is no evidence here.
    "found-elsewhere" FoundElsewhere { instance: String = "The other instance." };
    // Why a source of a need is replaced.
    /// The source served the need before the restart and must not be used now.
    "served-before" ServedBefore { source: String = "The source." };
    /// An order ends the use of the source.
    "left" Left { source: String = "The source." };
    /// The source was lost, and no other source is trusted.
    "lost-alone" LostAlone { source: String = "The source." };
    /// No other source is trusted.
    "nothing-else-trusted" NothingElseTrusted;
    /// The source is no longer trusted.
    "not-trusted" NotTrusted { source: String = "The source." };
    /// The source is contradicted.
    "contradicted" Contradicted { source: String = "The source." };
    /// The values of the source are wider than the need allows.
    "source-too-wide" SourceTooWide {
        source: String = "The source.", width: Amount = "How wide they are.", most: Amount = "What is allowed."
    };
    /// The values of the source are older than the need allows.
    "source-too-old" SourceTooOld {
        source: String = "The source.", age: Span = "How old they are.", most: Span = "What the need allows."
    };
    /// The values of the source lie outside of the variable's range.
    "source-impossible" SourceImpossible { source: String = "The source." };
    /// Elements of the source are gone with the changed model.
    "gone" Gone { names: Vec<String> = "The signals and relations." };
    /// The changed model describes signals of the source differently.
    "signals-described-anew" SignalsDescribedAnew { signals: Vec<String> = "The signals." };
    /// The changed model withdraws signals of the source.
    "signals-withdrawn" SignalsWithdrawn { signals: Vec<String> = "The signals." };
    /// The source no longer serves the need in the changed model.
    "serves-no-more" ServesNoMore { source: String = "The source." };
    // What serves a need instead, or again.
    /// A source takes over.
    "takes-over" TakesOver { source: Candidate = "The source." };
    /// The other ready sources, best first. A loss may take some of them, too.
    "next-best" NextBest { sources: Vec<Candidate> = "The best of them." };
    /// No other source is left.
    "nothing-left" NothingLeft;
    /// The changed model has a better source.
    "model-has-better" ModelHasBetter;
    /// The operator lets a better source serve again.
    "better-allowed" BetterAllowed;
    /// A better source is trusted again.
    "better-trusted" BetterTrusted;
    /// Contracts admit a better source again.
    "better-admitted" BetterAdmitted;
    /// The source that served the need before.
    "before" Before { source: String = "The source." };
    /// Nothing served the need before.
    "before-nothing" BeforeNothing;
    /// The source gives no value in time.
    "not-in-time" NotInTime { source: String = "The source." };
    /// More ways contradict the source than support it.
    "outvoted" Outvoted { source: String = "The source." };
    /// The source gives values that are too wide or too old.
    "unfit" Unfit { source: String = "The source." };
    /// Another way has stood in for the source.
    "stood-in" StoodIn { way: String = "The way.", lasted: Span = "For how long." };
    /// The source gives values again.
    "gives-again" GivesAgain;
    /// The source of the need is trusted again.
    "trusted-again" TrustedAgain;
    /// The need is served again.
    "served-again" ServedAgain;
    /// The need is served again, as uncertain.
    "served-again-uncertain" ServedAgainUncertain;
    /// It is not known which of several ways is right.
    "uncertain" Uncertain { served_by: ServedBy = "What goes out as uncertain." };
    // Why a need is not served.
    /// No value was published.
    "no-value" NoValue { age: Span = "For how long." };
    /// No value came from the only source that may serve the need by order.
    "no-value-from" NoValueFrom { age: Span = "For how long.", source: String = "The source." };
    /// The values of the source are too wide or too old.
    "gives-unfit" GivesUnfit;
    /// All available values are contradicted, too wide or too old.
    "all-unfit" AllUnfit;
    /// No source that is left gives a value.
    "nothing-given" NothingGiven;
    /// The need states nothing of how it is served when unsure; what several ways hold possible would serve it.
    "hull-would-serve" HullWouldServe { ways: Vec<String> = "The ways." };
    /// The limits of the need.
    "limits" Limits { age: Span = "The age.", width: f64 = "The width, SI." };
    /// The uncertain value is wider than the need allows.
    "uncertain-too-wide" UncertainTooWide {
        served_by: ServedBy = "What would serve.", width: Amount = "How wide it is.", most: Amount = "What is allowed."
    };
    /// The uncertain value is older than the need allows.
    "uncertain-too-old" UncertainTooOld {
        served_by: ServedBy = "What would go out.", most: Span = "What the need allows."
    };
    /// Too few of the ways that may be right give values.
    "too-few-speak" TooFewSpeak { served_by: ServedBy = "What would go out." };
    /// By order, only one source may serve the need.
    "only-by-order" OnlyByOrder { source: String = "The source." };
    /// Another order forbids elements of the source.
    "forbidden-by-another" ForbiddenByAnother { subjects: Vec<Subject> = "What is forbidden." };
    /// Signals of the source give no usable value.
    "inputs-absent" InputsAbsent { signals: Vec<String> = "The signals." };
    // Shortfalls beside a need's demands.
    /// The need demands more than some sources give.
    "demands-more" DemandsMore;
    /// A source that falls short.
    "short-source" ShortSource { source: String = "The source." };
    /// The number of sources that fall short and are not reported.
    "more-sources" MoreSources { count: u64 = "How many more." };
    /// No signal of a variable may be used.
    "no-signal-of" NoSignalOf { variable: String = "The variable." };
    /// A relation may not be used.
    "relation-barred" RelationBarred { relation: String = "The relation." };
    /// No usable signal of a variable is fast enough.
    "rate-too-low" RateTooLow {
        variable: String = "The variable.", rate_hz: f64 = "The fastest rate.", least_hz: f64 = "What was asked."
    };
    /// No usable signal of a variable has the required level.
    "signals-integrity" SignalsIntegrity {
        variable: String = "The variable.", level: String = "The highest one.", least: String = "What was asked."
    };
    /// A relation does not have the required level.
    "relation-integrity" RelationIntegrity {
        relation: String = "The relation.", level: String = "Its level.", least: String = "What was asked."
    };
    /// A relation leaves open which of several values holds.
    "one-of-several" OneOfSeveral { relation: String = "The relation." };
    /// The only signal of a variable has an origin in common with a suspect.
    "not-independent" NotIndependent { variable: String = "The variable.", signal: String = "The signal." };
    /// The source rests on values that are too old.
    "rests-on-old" RestsOnOld { age_s: f64 = "Their age.", most_s: f64 = "What was asked." };
    /// The values of the source come too rarely.
    "comes-rarely" ComesRarely { period_s: f64 = "The time between two.", most_s: f64 = "What was asked." };
    /// The values of the source are too wide.
    "too-wide" TooWide { width: f64 = "The least width, SI.", most: f64 = "What was asked, SI." };
    // Refusals by contracts.
    /// The contract of a need refuses preferred sources.
    "contract-forbids" ContractForbids { need: String = "The need." };
    /// Contracts do not admit the source, or no longer admit it.
    "not-admitted" NotAdmitted { source: String = "The source." };
    /// The demand is certainly not met.
    "demand-refused" DemandRefused;
    /// Whether the demand is met is not known.
    "demand-open" DemandOpen;
    /// The demand rests on itself.
    "demand-circular" DemandCircular;
    /// The changes that would meet the demand, all together.
    "would-need" WouldNeed { leaves: Vec<String> = "Whose evidence or demand, and which." };
    /// The source serves all the same, at the level that it has.
    "goes-out-all-the-same" GoesOutAllTheSame { level: String = "The level." };
    /// Contracts admit no available source.
    "none-admitted" NoneAdmitted;
    // Orders of an operator.
    /// A component must not be used, by order.
    "must-not-be-used" MustNotBeUsed { subject: Subject = "What." };
    /// A component may be used again, by order.
    "may-be-used" MayBeUsed { subject: Subject = "What." };
    /// A component was cleared by order.
    "was-cleared" WasCleared { subject: Subject = "What." };
    /// The need chooses its source by itself again, by order.
    "chooses-itself" ChoosesItself;
    /// The contract of a need is overridden, by order.
    "contract-overridden" ContractOverridden {
        need: String = "The need.", lasts: Span = "For how long.", because: String = "Why."
    };
    /// The contract of a need is no longer overridden.
    "override-over" OverrideOver { need: String = "The need." };
    /// An operator has stated that evidence is true.
    "attested" Attested { evidence: String = "The contract and the evidence." };
    /// An operator has stated that evidence is false.
    "denied" Denied { evidence: String = "The contract and the evidence." };
    /// An order cannot be obeyed.
    "cannot-obey" CannotObey { order: Order = "The order." };
    /// An order is no longer in force.
    "no-more-in-force" NoMoreInForce { order: Order = "The order." };
    /// The service of a need before the restart is forgotten.
    "served-forgotten" ServedForgotten { need: String = "The need." };
    /// An accusation from before the restart is forgotten.
    "accusation-forgotten" AccusationForgotten { subject: Subject = "Who was accused." };
    // Why an order cannot be obeyed, and help.
    /// No contract demands anything for a need.
    "nothing-demanded" NothingDemanded { need: String = "The need." };
    /// An override needs a length of time and a reason.
    "override-needs" OverrideNeeds;
    /// The contract of the need must be overridden first.
    "override-first" OverrideFirst;
    /// No contract has this evidence for an operator to state.
    "no-evidence" NoEvidence { name: String = "What was named." };
    /// There is no such signal.
    "no-signal" NoSignal { name: String = "What was named." };
    /// There is no such relation.
    "no-relation" NoRelation { name: String = "What was named." };
    /// There is no such common cause.
    "no-cause" NoCause { name: String = "What was named." };
    /// There is no such need.
    "no-need" NoNeed { name: String = "What was named." };
    /// A need has no such source that could run.
    "no-source" NoSource { need: String = "The need.", name: String = "What was named." };
    /// Several needs have this variable.
    "several-needs" SeveralNeeds { count: u64 = "How many.", variable: String = "The variable." };
    /// The named component is no signal or relation.
    "neither-signal-nor-relation" NeitherSignalNorRelation { subject: Subject = "What was named." };
    /// The named component is not forbidden.
    "not-forbidden" NotForbidden { subject: Subject = "What was named." };
    /// A need chooses its source by itself already.
    "chooses-already" ChoosesAlready { need: String = "The need." };
    /// The order is in force already.
    "already-in-force" AlreadyInForce { order: Order = "The order." };
    /// A source does not meet what the need demands.
    "does-not-meet" DoesNotMeet { source: String = "The source." };
    /// The named component gives no usable value.
    "gives-nothing" GivesNothing { subject: Subject = "What was named." };
    /// The named component is not accused.
    "not-accused" NotAccused { subject: Subject = "What was named." };
    /// A known name is nearly the same.
    "did-you-mean" DidYouMean { name: String = "The name." };
    /// All known names.
    "known-here" KnownHere { names: Vec<String> = "The names." };
    /// Some of the known names.
    "known-among-others" KnownAmongOthers { names: Vec<String> = "The names." };
    /// One of several needs must be named.
    "name-one" NameOne { needs: Vec<String> = "The needs." };
    /// The signals that share a common cause must be named.
    "name-sharers" NameSharers { signals: Vec<String> = "The signals." };
    /// The orders in force.
    "in-force" InForce { orders: Vec<Order> = "The orders." };
    /// No order is in force.
    "none-in-force" NoneInForce;
    /// Nothing has to be done.
    "nothing-to-do" NothingToDo;
    /// The need must be changed, or another source named.
    "change-the-need" ChangeTheNeed;
    /// The signal can be cleared when it gives values again.
    "clear-later" ClearLater;
    /// There is nothing to clear.
    "nothing-to-clear" NothingToClear;
    // Words from outside.
    /// Words that were read from a state or a journal of an earlier version.
    "told" Text { words: String = "The words." };
}
