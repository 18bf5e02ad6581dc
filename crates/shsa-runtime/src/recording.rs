//! Records the inputs of a run in a thread of its own, so that a slow recorder delays nobody.

use super::journal::Missing;
use shsa_core::engine::Input;
use shsa_core::observation::RawValue;
use shsa_format::drive::{Era, Given};
use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Batches that may wait in the channel, beside those of [`MOST_NUMBERS`].
const BATCHES: usize = 64;
/// The most numbers that wait for the recorder, lists counted with their length: about 16 MiB.
const MOST_NUMBERS: usize = 1 << 20;
/// An input without numbers weighs as much.
const INPUT: usize = 8;
/// How often the recorder is asked to flush.
const FLUSHED_EVERY: Duration = Duration::from_secs(5);
/// How long the end of a run waits for the recorder.
const END: Duration = Duration::from_secs(10);

/// Records a run: is given every input in order, in a thread of its own. Its first error ends the recording.
pub trait RunRecorder: Send {
    /// An input, or another model.
    ///
    /// # Errors
    /// Why nothing more can be recorded.
    fn record(&mut self, given: Given<'_>) -> io::Result<()>;

    /// Writes out what is buffered; called every five seconds while there are inputs.
    ///
    /// # Errors
    /// Why nothing more can be recorded.
    fn flush(&mut self) -> io::Result<()>;

    /// The run is over, or the recorder was too slow.
    ///
    /// # Errors
    /// Why the end cannot be written.
    fn finish(&mut self) -> io::Result<()>;
}

/// An input that waits.
enum Waiting {
    Input(Input),
    Era(Box<Era>),
}

/// The inputs for one recorder.
pub(super) struct Recording {
    /// Those that are not handed over yet.
    batch: Vec<Waiting>,
    /// The numbers in the batch.
    numbers: usize,
    /// `None` when the recorder was too slow, or the run ends.
    batches: Option<SyncSender<Vec<Waiting>>>,
    /// Closed when the recorder has finished.
    finished: Receiver<()>,
    missing: Arc<Mutex<Missing>>,
}

impl Recording {
    /// # Errors
    /// When there can be no thread.
    pub(super) fn begin(recorder: Box<dyn RunRecorder>) -> io::Result<Recording> {
        let (batches, taken) = sync_channel(BATCHES);
        let (finishing, finished) = sync_channel(0);
        let missing = Arc::<Mutex<Missing>>::default();
        let counted = missing.clone();
        thread::Builder::new().name("recorder".into()).spawn(move || {
            record_all(recorder, &taken, &counted);
            drop(finishing);
        })?;
        Ok(Recording { batch: Vec::new(), numbers: 0, batches: Some(batches), finished, missing })
    }

    /// Adds an input.
    pub(super) fn record(&mut self, given: Given<'_>) {
        if self.batches.is_none() {
            return lose(&self.missing, 1, None);
        }
        self.numbers += numbers(given);
        self.batch.push(match given {
            Given::Input(input) => Waiting::Input(input.clone()),
            Given::Era(era) => Waiting::Era(Box::new(era.clone())),
        });
    }

    /// Hands the added inputs to the recorder, without waiting. When it is too far behind, the recording ends: a recorder is given
    /// all inputs up to some moment, as what follows from an input cannot be known without those before.
    pub(super) fn hand_over(&mut self) {
        let Some(batches) = self.batches.as_ref().filter(|_| !self.batch.is_empty()) else { return };
        match batches.try_send(std::mem::take(&mut self.batch)) {
            Ok(()) => self.numbers = 0,
            Err(TrySendError::Full(batch)) if self.numbers < MOST_NUMBERS => self.batch = batch,
            Err(TrySendError::Full(batch)) => {
                self.batches = None;
                lose(&self.missing, batch.len(), Some("it is slower than the inputs, and has ended"));
            }
            // The thread has said why it ended.
            Err(TrySendError::Disconnected(batch)) => {
                self.batches = None;
                lose(&self.missing, batch.len(), None);
            }
        }
    }

    /// The inputs that the recorder was not given.
    pub(super) fn missing(&self) -> Missing {
        self.missing.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Waits until the recorder has finished, unless it takes too long.
impl Drop for Recording {
    fn drop(&mut self) {
        if let Some(batches) = self.batches.take() {
            let end = Instant::now() + END;
            let mut batch = std::mem::take(&mut self.batch);
            while let Err(TrySendError::Full(back)) = batches.try_send(batch) {
                if Instant::now() > end {
                    return;
                }
                batch = back;
                thread::sleep(Duration::from_millis(10));
            }
        }
        let _finished_or_late = self.finished.recv_timeout(END);
    }
}

fn record_all(
    mut recorder: Box<dyn RunRecorder>,
    batches: &Receiver<Vec<Waiting>>,
    missing: &Mutex<Missing>,
) {
    let followed = follow(&mut *recorder, batches);
    let ended = followed.and_then(|()| recorder.finish().map_err(|error| (error, 0)));
    if let Err((error, unrecorded)) = ended {
        lose(missing, unrecorded, Some(&error.to_string()));
    }
}

/// Passes batches on until there are no more; an error comes with the number of inputs of its batch that were not recorded.
fn follow(
    recorder: &mut dyn RunRecorder,
    batches: &Receiver<Vec<Waiting>>,
) -> Result<(), (io::Error, usize)> {
    let mut flushed = Instant::now();
    loop {
        match batches.recv_timeout(FLUSHED_EVERY) {
            Ok(batch) => {
                for (number, waiting) in batch.iter().enumerate() {
                    let given = match waiting {
                        Waiting::Input(input) => Given::Input(input),
                        Waiting::Era(era) => Given::Era(era),
                    };
                    recorder.record(given).map_err(|error| (error, batch.len() - number))?;
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
        if flushed.elapsed() >= FLUSHED_EVERY {
            recorder.flush().map_err(|error| (error, 0))?;
            flushed = Instant::now();
        }
    }
}

fn numbers(given: Given<'_>) -> usize {
    match given {
        Given::Input(Input::Observation(observation)) => match &observation.value {
            RawValue::Vector(values) => INPUT + values.len(),
            RawValue::Number(_) | RawValue::Interval { .. } => INPUT,
        },
        Given::Input(_) | Given::Era(_) => INPUT,
    }
}

fn lose(missing: &Mutex<Missing>, inputs: usize, because: Option<&str>) {
    let mut missing = missing.lock().unwrap_or_else(PoisonError::into_inner);
    missing.inputs += inputs as u64;
    if let Some(because) = because {
        missing.because = format!("the record: {because}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::time::Time;
    use std::sync::mpsc::{Sender, channel};

    /// Passes on what it is given, each input only after a permission.
    struct Slow {
        permissions: Receiver<()>,
        seen: Sender<Option<Time>>,
    }

    impl RunRecorder for Slow {
        fn record(&mut self, given: Given<'_>) -> io::Result<()> {
            let refused = |_| io::Error::other("no room");
            self.permissions.recv().map_err(refused)?;
            self.seen.send(Some(given.time())).map_err(io::Error::other)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }

        fn finish(&mut self) -> io::Result<()> {
            self.seen.send(None).map_err(io::Error::other)
        }
    }

    fn slow() -> (Recording, Sender<()>, Receiver<Option<Time>>) {
        let (permit, permissions) = channel();
        let (seen, all) = channel();
        (Recording::begin(Box::new(Slow { permissions, seen })).unwrap(), permit, all)
    }

    fn give(recording: &mut Recording, ticks: impl Iterator<Item = i64>) {
        for tick in ticks {
            recording.record(Given::Input(&Input::Tick(Time(tick))));
            recording.hand_over();
        }
    }

    #[test]
    fn all_inputs_are_recorded_in_order_and_the_end_is_waited_for() {
        let (mut recording, permit, all) = slow();
        // More than wait in the channel.
        give(&mut recording, 0..1_000);
        (0..1_000).for_each(|_| permit.send(()).unwrap());
        assert_eq!(recording.missing(), Missing::default());
        drop(recording);
        let seen: Vec<_> = all.iter().collect();
        assert_eq!(seen, (0..1_000).map(|tick| Some(Time(tick))).chain([None]).collect::<Vec<_>>());
    }

    #[test]
    fn a_recorder_that_is_too_slow_has_all_up_to_some_moment_and_the_rest_is_counted() {
        let (mut recording, permit, all) = slow();
        let many = (MOST_NUMBERS / INPUT) as i64 * 2;
        give(&mut recording, 0..many);
        let missing = recording.missing();
        assert!(missing.because.contains("slower than the inputs"), "{missing:?}");
        // It finishes without taking all of them.
        let _ended = (0..many).try_for_each(|_| permit.send(()));
        drop(recording);
        let seen: Vec<_> = all.iter().collect();
        let recorded = many - missing.inputs as i64;
        assert_eq!(seen, (0..recorded).map(|tick| Some(Time(tick))).chain([None]).collect::<Vec<_>>());
        assert!(recorded > 0 && missing.inputs > 0, "{recorded}, {missing:?}");
    }

    #[test]
    fn an_error_ends_the_recording_and_is_reported() {
        let (mut recording, permit, all) = slow();
        permit.send(()).unwrap();
        drop(permit);
        give(&mut recording, 0..10);
        assert_eq!(all.iter().collect::<Vec<_>>(), [Some(Time(0))]);
        // Whether handed over or not.
        give(&mut recording, 10..20);
        let missing = recording.missing();
        assert_eq!(missing.because, "the record: no room");
        drop(recording);
    }
}
