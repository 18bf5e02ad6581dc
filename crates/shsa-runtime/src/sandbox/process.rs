//! One process, as the run handles it: starts it, sends and receives frames, measures it, ends it.

use super::Grant;
use super::frame::Reply;
use crate::error::{Context, RuntimeError, unfit};
use shsa_bridge::Inbox;
use shsa_core::time::Span;
use std::io::{Read, Write};
use std::process::{Child, ChildStderr, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread;

/// The number of frames that may wait for the process, and of frames that may wait for the run.
const WAITING: usize = 64;
/// The most bytes of error output that are kept.
const LAST_WORDS: u64 = 4_096;

/// A running process.
pub(super) struct Process {
    child: Child,
    frames: SyncSender<Vec<u8>>,
    reply: Receiver<Reply>,
    errors: Option<ChildStderr>,
}

/// The news of a process.
pub(super) enum News {
    Reply(Reply),
    /// The process has ended, or its output is no valid frame.
    Over,
    Nothing,
}

impl Process {
    /// Starts the program with three pipes and nothing else: no environment, no folder, a process group of its own. Each frame of
    /// the process wakes the run.
    ///
    /// # Errors
    /// When the operating system has no process, thread or pipe left.
    pub(super) fn start(grant: &Grant, inbox: Inbox) -> Result<Process, RuntimeError> {
        let [program, arguments @ ..] = &*grant.program else { return Err(unfit("no program computes")) };
        let mut command = Command::new(program);
        command.args(arguments).arg("--memory").arg(grant.memory.to_string()).env_clear().current_dir("/");
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().context("starting a process")?;
        let (Some(mut input), Some(mut output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(unfit("a process without pipes"));
        };
        let errors = child.stderr.take();
        let (frames, given) = sync_channel::<Vec<u8>>(WAITING);
        let (sender, reply) = sync_channel(WAITING);
        let process = Process { child, frames, reply, errors };
        thread::Builder::new().name("to-process".into()).spawn(move || {
            // The thread that reads the output notices when the process has stopped reading.
            let _ = given.iter().try_for_each(|frame| input.write_all(&frame));
        })?;
        thread::Builder::new().name("of-process".into()).spawn(move || {
            while let Ok(Some(word)) = Reply::read(&mut output) {
                if sender.send(word).is_err() {
                    break;
                }
                inbox.wake();
            }
            drop(sender);
            inbox.wake();
        })?;
        Ok(process)
    }

    /// The process id.
    pub(super) fn id(&self) -> u32 {
        self.child.id()
    }

    /// Queues frames; returns whether there was room.
    pub(super) fn hand(&self, frames: Vec<u8>) -> bool {
        self.frames.try_send(frames).is_ok()
    }

    /// The next frame of the process.
    pub(super) fn news(&self) -> News {
        match self.reply.try_recv() {
            Ok(reply) => News::Reply(reply),
            Err(TryRecvError::Empty) => News::Nothing,
            Err(TryRecvError::Disconnected) => News::Over,
        }
    }

    /// Kills the process if it is still running; describes how it ended.
    pub(super) fn end(mut self) -> String {
        let _ = self.child.kill();
        let status = self.child.wait();
        let mut words = String::new();
        if let Some(errors) = self.errors.take() {
            let _ = errors.take(LAST_WORDS).read_to_string(&mut words);
        }
        match status {
            Ok(status) => ending(status, &words),
            Err(error) => format!("it cannot be waited for: {error}"),
        }
    }

    /// The processor time that the process has used, if the operating system gives it.
    pub(super) fn used(&self) -> Option<Span> {
        let text = std::fs::read_to_string(format!("/proc/{}/schedstat", self.id())).ok()?;
        text.split(' ').next()?.parse().ok().map(Span)
    }

    /// Lets the kernel end the process when its total processor time exceeds this limit, rounded up to seconds.
    #[cfg(target_os = "linux")]
    pub(super) fn limit(&self, most: Span) {
        use rustix::process::{Pid, Resource, Rlimit, prlimit};
        let seconds = u64::try_from(most.0).unwrap_or(0).div_ceil(1_000_000_000).max(1);
        let limit = Rlimit { current: Some(seconds), maximum: None };
        // Without this limit, the processor time is still measured.
        let _ = prlimit(Some(Pid::from_child(&self.child)), Resource::Cpu, limit);
    }

    /// No effect on other systems.
    #[cfg(not(target_os = "linux"))]
    pub(super) fn limit(&self, _: Span) {}
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Describes how a process ended.
fn ending(status: ExitStatus, words: &str) -> String {
    #[cfg(unix)]
    let signal = std::os::unix::process::ExitStatusExt::signal(&status);
    #[cfg(not(unix))]
    let signal: Option<i32> = None;
    let last = words.lines().rfind(|line| !line.trim().is_empty()).map(str::trim);
    let lack = words.lines().find(|line| line.starts_with("memory allocation of"));
    match (lack, signal, last) {
        (Some(lack), ..) => format!("it took more memory than it is granted ({lack})"),
        (_, Some(signal), _) if signal == signal_hook::consts::SIGXCPU => {
            "it used more processor time than it is granted".to_owned()
        }
        (_, Some(signal), _) => format!("killed by signal {signal}"),
        (_, None, Some(last)) => format!("it ended by itself: {last}"),
        (_, None, None) => format!("it ended by itself with {status}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn endings_are_reported_in_words() {
        use std::os::unix::process::ExitStatusExt;
        let words_of = |raw: i32, words: &str| ending(ExitStatus::from_raw(raw), words);
        assert_eq!(words_of(9, ""), "killed by signal 9");
        assert_eq!(words_of(24, ""), "it used more processor time than it is granted");
        let lack = "memory allocation of 4096 bytes failed";
        assert_eq!(words_of(6, lack), format!("it took more memory than it is granted ({lack})"));
        assert_eq!(words_of(2 << 8, "error: no\n\n"), "it ended by itself: error: no");
        assert_eq!(words_of(0, ""), "it ended by itself with exit status: 0");
    }
}
