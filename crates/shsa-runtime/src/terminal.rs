//! Standard output, written by a thread of its own: a slow or absent reader delays nobody else.

use super::undelivered::Swell;
use shsa_core::time::Time;
use std::io::Write;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::Duration;

/// The number of lines that may wait; further lines are dropped.
const WAITING: usize = 1_024;
/// At the end, waiting lines get this time.
const FLUSH: Duration = Duration::from_secs(1);

/// An output whose lines are written later, or dropped.
#[derive(Debug)]
pub(super) struct Terminal {
    lines: Option<SyncSender<String>>,
    ended: Receiver<()>,
    shared: Arc<Shared>,
    swell: Swell,
    /// The number of dropped lines that were reported.
    seen: u64,
}

#[derive(Debug, Default)]
struct Shared {
    lost: AtomicU64,
    /// The reason why nothing is written any more.
    closed: OnceLock<String>,
}

impl Terminal {
    /// Starts the writing thread.
    ///
    /// # Errors
    /// When no thread can be started.
    pub(super) fn new(output: impl Write + Send + 'static) -> std::io::Result<Terminal> {
        let (lines, waiting) = sync_channel(WAITING);
        let (sender, ended) = channel();
        let shared: Arc<Shared> = Arc::default();
        let of_thread = shared.clone();
        thread::Builder::new()
            .name("terminal".into())
            .spawn(move || write(output, &waiting, &of_thread, &sender))?;
        Ok(Terminal { lines: Some(lines), ended, shared, swell: Swell::default(), seen: 0 })
    }

    /// Queues a line without waiting; drops it if there is no room.
    pub(super) fn write(&self, line: String) {
        let Some(lines) = &self.lines else { return };
        if lines.try_send(line).is_err() {
            self.shared.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The number of dropped lines.
    pub(super) fn lost(&self) -> u64 {
        self.shared.lost.load(Ordering::Relaxed)
    }

    /// A note about lines dropped since the last call, if there is news.
    pub(super) fn news(&mut self, now: Time) -> Option<String> {
        let lost = self.lost();
        let count = self.swell.rise(lost - self.seen, now);
        self.seen = lost;
        let because = match self.shared.closed.get() {
            Some(error) => format!("standard output is closed ({error})"),
            None => "standard output is not read".to_owned(),
        };
        count.map(|count| format!("{because}: {count} lines were not written; the run goes on"))
    }
}

impl Drop for Terminal {
    /// Writes waiting lines, within about a second.
    fn drop(&mut self) {
        self.lines = None;
        // A reader that is slower than this has gone.
        let _ = self.ended.recv_timeout(FLUSH);
    }
}

/// The writing thread: writes until the queue is closed, or the output fails.
fn write(mut output: impl Write, waiting: &Receiver<String>, shared: &Shared, ended: &Sender<()>) {
    for line in waiting {
        let is_closed = shared.closed.get().is_some();
        let written =
            if is_closed { Ok(()) } else { writeln!(output, "{line}").and_then(|()| output.flush()) };
        if is_closed || written.is_err() {
            shared.lost.fetch_add(1, Ordering::Relaxed);
        }
        if let Err(error) = written {
            // The first reason is kept.
            let _ = shared.closed.set(error.to_string());
        }
    }
    // The waiting thread may have given up.
    let _ = ended.send(());
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io;
    use std::sync::Mutex;
    use std::time::Instant;

    /// An output that calls a function before each write.
    struct Gate<F>(F, Arc<Mutex<Vec<u8>>>);

    impl<F: FnMut() -> io::Result<()>> Write for Gate<F> {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            (self.0)()?;
            self.1.lock().unwrap().extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_slow_reader_gets_everything_in_order_also_at_the_end() {
        let written: Arc<Mutex<Vec<u8>>> = Arc::default();
        let slow = || {
            thread::sleep(Duration::from_millis(1));
            Ok(())
        };
        let terminal = Terminal::new(Gate(slow, written.clone())).unwrap();
        (0..100).for_each(|at| terminal.write(at.to_string()));
        drop(terminal);
        let expected: String = (0..100).map(|at| format!("{at}\n")).collect();
        assert_eq!(String::from_utf8(written.lock().unwrap().clone()).unwrap(), expected);
    }

    #[test]
    fn what_nobody_reads_delays_nobody_and_is_counted_and_reported() {
        let (_keeps_it_shut, gate) = channel::<()>();
        let shut = move || gate.recv().map_err(io::Error::other);
        let mut terminal = Terminal::new(Gate(shut, Arc::default())).unwrap();
        let began = Instant::now();
        (0..WAITING + 500).for_each(|at| terminal.write(at.to_string()));
        // One line may be with the writing thread.
        let lost = terminal.lost();
        assert!((499..=500).contains(&lost), "{lost}");
        let described = terminal.news(Time(0)).unwrap();
        assert_eq!(
            described,
            format!("standard output is not read: {lost} lines were not written; the run goes on")
        );
        assert_eq!(terminal.news(Time(0)), None);
        drop(terminal);
        assert!(began.elapsed() < 20 * FLUSH);
    }

    #[test]
    fn a_closed_output_is_reported_with_its_reason() {
        let closed = || Err(io::Error::from(io::ErrorKind::BrokenPipe));
        let mut terminal = Terminal::new(Gate(closed, Arc::default())).unwrap();
        terminal.write("1".into());
        let end = Instant::now() + Duration::from_secs(20);
        while terminal.shared.closed.get().is_none() && Instant::now() < end {
            thread::sleep(Duration::from_millis(1));
        }
        let described = terminal.news(Time(0)).unwrap();
        assert_eq!(
            described,
            "standard output is closed (broken pipe): 1 lines were not written; the run goes on"
        );
    }
}
