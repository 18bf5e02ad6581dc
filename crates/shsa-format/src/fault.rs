//! Faults injected into recordings: `KIND[=AMOUNT]:SIGNAL@FROM..TO`.
//!
//! Times count from the first sample of the recording. Amounts are in the unit of the signal after its scaling, as errors and
//! ranges in the model. Randomness comes from a seed, so that a run repeats byte for byte.

mod injected;

use injected::Change;
pub use injected::Injected;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use shsa_core::knowledge::Scaling;
use shsa_core::time::{Span, Time};
use shsa_message::span::parse_span;
use shsa_recording::{Sample, moment};
use std::collections::VecDeque;
use std::convert::Infallible;

/// The kind of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultKind {
    /// The value stays at its value of the start, or at this value.
    Stuck(Option<f64>),
    /// This value is added.
    Bias(f64),
    /// No value is received.
    Drop,
    /// A value between minus and plus this one is added, uniformly distributed.
    Noise(f64),
    /// This value is added for every second since the start.
    Drift(f64),
    /// This value is added to one sample in ten.
    Spike(f64),
    /// Values are multiplied by this.
    Scale(f64),
    /// Values are received this much later, with their original stamps.
    Delay(Span),
    /// This value is sent instead, with valid stamps.
    Spoof(f64),
}

/// A fault of a signal during a time.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// The kind of the fault.
    pub kind: FaultKind,
    /// The name of the signal.
    pub signal: String,
    /// The begin, counted from the first sample.
    pub from: Span,
    /// The end, excluded; `None` means the end of the recording.
    pub to: Option<Span>,
}

/// Why a text is no fault.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "fault '{text}': {problem}; expected KIND[=AMOUNT]:SIGNAL@FROM..TO, for example bias=1.5:/gps/speed@20s..40s"
)]
pub struct FaultError {
    text: String,
    problem: String,
}

impl std::str::FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Fault, FaultError> {
        parse(text).map_err(|problem| FaultError { text: text.to_owned(), problem })
    }
}

fn parse(text: &str) -> Result<Fault, String> {
    let (what, rest) = text.split_once(':').ok_or("no ':' before the signal")?;
    let (signal, times) = match rest.rsplit_once('@') {
        Some((signal, times)) => (signal, times),
        None => (rest, ".."),
    };
    let (kind, amount) = match what.split_once('=') {
        Some((kind, amount)) => (kind.trim(), Some(amount.trim())),
        None => (what.trim(), None),
    };
    let (from, to) = times.split_once("..").ok_or("no '..' between its start and its end")?;
    let from = if from.is_empty() { Span::ZERO } else { moment(from)? };
    let to = if to.is_empty() { None } else { Some(moment(to)?) };
    if signal.is_empty() {
        return Err("the signal's name is missing".to_owned());
    }
    if to.is_some_and(|to| to <= from) {
        return Err("it ends before it starts".to_owned());
    }
    Ok(Fault { kind: parse_kind(kind, amount)?, signal: signal.to_owned(), from, to })
}

/// The constructor of a kind of fault from its amount.
#[derive(Clone, Copy, Debug)]
pub enum Made {
    /// Without an amount.
    Alone(FaultKind),
    /// With a number or without an amount.
    Perhaps(fn(Option<f64>) -> FaultKind),
    /// With a number.
    Of(fn(f64) -> FaultKind),
    /// With a span of time.
    OfSpan(fn(Span) -> FaultKind),
}

/// The kinds of faults by their names.
pub const KINDS: [(&str, Made); 9] = [
    ("stuck", Made::Perhaps(FaultKind::Stuck)),
    ("bias", Made::Of(FaultKind::Bias)),
    ("drop", Made::Alone(FaultKind::Drop)),
    ("noise", Made::Of(FaultKind::Noise)),
    ("drift", Made::Of(FaultKind::Drift)),
    ("spike", Made::Of(FaultKind::Spike)),
    ("scale", Made::Of(FaultKind::Scale)),
    ("delay", Made::OfSpan(FaultKind::Delay)),
    ("spoof", Made::Of(FaultKind::Spoof)),
];

fn parse_kind(kind: &str, amount: Option<&str>) -> Result<FaultKind, String> {
    let number = |amount: &str| amount.parse::<f64>().map_err(|_| format!("'{amount}' is no number"));
    let given = |such: &str| amount.ok_or_else(|| format!("{kind} needs an amount, such as {kind}={such}"));
    let Some((_, made)) = KINDS.iter().find(|(known, _)| *known == kind) else {
        let known = KINDS.map(|(known, _)| known).join(", ");
        return Err(format!("unknown kind '{kind}'; known: {known}"));
    };
    match made {
        Made::Alone(kind) if amount.is_none() => Ok(*kind),
        Made::Alone(_) => Err(format!("{kind} takes no amount")),
        Made::Perhaps(made) => Ok(made(amount.map(number).transpose()?)),
        Made::Of(made) => Ok(made(number(given("2")?)?)),
        Made::OfSpan(made) => Ok(made(parse_span(given("600ms")?)?)),
    }
}

impl Fault {
    /// Injects this fault into the samples of signal number `wanted`; the samples stay sorted by reception. `first` is the begin
    /// of the recording, from which the times of the fault count; `scaling` is that of the signal.
    ///
    /// Complexity: O(samples).
    pub fn inject(
        &self,
        samples: &mut Vec<Sample>,
        wanted: usize,
        scaling: Option<Scaling>,
        first: Time,
        seed: u64,
    ) {
        let input = std::mem::take(samples).into_iter().map(Ok::<Sample, Infallible>);
        samples.extend(self.injected(input, wanted, scaling, first, seed).flatten());
    }

    /// Injects this fault as [`Fault::inject`] does, into samples that are not kept. Errors of the input are passed on.
    ///
    /// Memory: the samples that are delayed at a time.
    pub fn injected<I>(
        &self,
        input: I,
        wanted: usize,
        scaling: Option<Scaling>,
        first: Time,
        seed: u64,
    ) -> Injected<I> {
        let since = first + self.from;
        let random = ChaCha8Rng::seed_from_u64(seed);
        Injected {
            input,
            wanted,
            since,
            until: self.to.map_or(Time::MAX, |to| first + to),
            change: Change { kind: self.kind, scaling, random, since },
            held: None,
            ahead: None,
            late: VecDeque::new(),
            reached: Time::MIN,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::observation::RawValue;

    fn samples() -> Vec<Sample> {
        let sample = |second: i64| Sample {
            wanted: (second % 2) as usize,
            time: Time(second * 1_000_000_000),
            received: Time(second * 1_000_000_000),
            value: RawValue::Number(second as f64),
        };
        (10..20).map(sample).collect()
    }

    #[track_caller]
    fn check(fault: &str, expected: &str) {
        let fault: Fault = fault.parse().unwrap();
        let mut samples = samples();
        let first = samples[0].received;
        fault.inject(&mut samples, 0, None, first, 7);
        let shown: Vec<String> = samples
            .iter()
            .filter(|sample| sample.wanted == 0)
            .map(|sample| match sample.value {
                RawValue::Number(value) => format!("{}:{value}", sample.received.seconds()),
                _ => unreachable!(),
            })
            .collect();
        assert_eq!(shown.join(" "), expected);
    }

    #[test]
    fn kinds_do_what_they_say() {
        check("bias=1.5:/a@2s..6s", "10:10 12:13.5 14:15.5 16:16 18:18");
        check("stuck:/a@4s..", "10:10 12:12 14:12 16:12 18:12");
        check("drop:/a@1s..5s", "10:10 16:16 18:18");
        check("spoof=3.0:/a@6s..", "10:10 12:12 14:14 16:3 18:3");
        check("scale=2:/a", "10:20 12:24 14:28 16:32 18:36");
        check("drift=0.1:/a@4s..", "10:10 12:12 14:14 16:16.2 18:18.4");
        check("delay=3s:/a@0s..3s", "13:10 14:14 15:12 16:16 18:18");
    }

    #[test]
    fn amounts_count_in_the_unit_after_scaling() {
        let check = |fault: &str, scale: f64, offset: f64, expected: f64| {
            let mut samples = samples();
            let scaling = Some(Scaling { scale, offset });
            fault.parse::<Fault>().unwrap().inject(&mut samples, 0, scaling, Time(0), 7);
            assert_eq!(samples[0].value, RawValue::Number(expected), "{fault}");
        };
        check("bias=1.5:/a", -0.5, 0.0, 7.0);
        check("spoof=3:/a", 0.5, 1.0, 4.0);
        check("scale=2:/a", 0.5, 5.0, 30.0);
        check("drift=0.1:/a", -1.0, 0.0, 9.0);
        check("bias=0:/a", 0.1, 0.3, 10.0);
    }

    #[test]
    fn noise_and_spikes_repeat_with_their_seed() {
        let run = |seed| {
            let mut samples = samples();
            "noise=3:/a".parse::<Fault>().unwrap().inject(&mut samples, 0, None, Time(0), seed);
            samples
        };
        assert_eq!(run(1), run(1));
        assert_ne!(run(1), run(2));
    }

    #[track_caller]
    fn refuse(fault: &str, expected: &str) {
        let error = fault.parse::<Fault>().unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }

    #[test]
    fn bad_faults_are_reported() {
        refuse("bias:/a", "bias needs an amount");
        refuse("warp=1:/a", "unknown kind 'warp'");
        refuse("bias=1", "no ':'");
        refuse("bias=x:/a", "'x' is no number");
        refuse("drop:/a@5s..2s", "ends before it starts");
        refuse("drop:/a@5", "no '..'");
        refuse("drop:@5s..", "name is missing");
    }
}
