//! One process, seen from the run: it is started, handed frames, listened to, measured, and ended.

use super::Grant;
use super::frame::Said;
use crate::error::{Context, RuntimeError, unfit};
use shsa_bridge::Inbox;
use shsa_core::time::Span;
use std::io::{Read, Write};
use std::process::{Child, ChildStderr, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread;

/// Frames that may wait for it, and words that may wait for us.
const WAITING: usize = 64;
/// Of what it says about its end, bytes.
const LAST_WORDS: u64 = 4_096;

/// A process at work.
pub(super) struct Process {
    child: Child,
    frames: SyncSender<Vec<u8>>,
    said: Receiver<Said>,
    errors: Option<ChildStderr>,
}

/// What has come from a process.
pub(super) enum News {
    Said(Said),
    /// It says nothing any more: it has ended, or what it says makes no sense.
    Over,
    Nothing,
}

impl Process {
    /// Starts the program that computes, with nothing but three pipes: no environment, no folder, a process group of its own. What
    /// it says ends the wait for the inbox.
    ///
    /// # Errors
    /// When the operating system has no process, thread or pipe to give.
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
        let (telling, said) = sync_channel(WAITING);
        let process = Process { child, frames, said, errors };
        thread::Builder::new().name("to-process".into()).spawn(move || {
            // A process that does not listen any more is noticed where it is listened to.
            let _ = given.iter().try_for_each(|frame| input.write_all(&frame));
        })?;
        thread::Builder::new().name("of-process".into()).spawn(move || {
            while let Ok(Some(word)) = Said::read(&mut output) {
                if telling.send(word).is_err() {
                    break;
                }
                inbox.wake();
            }
            drop(telling);
            inbox.wake();
        })?;
        Ok(process)
    }

    /// Its number in the operating system.
    pub(super) fn id(&self) -> u32 {
        self.child.id()
    }

    /// Hands frames over; whether there was room.
    pub(super) fn hand(&self, frames: Vec<u8>) -> bool {
        self.frames.try_send(frames).is_ok()
    }

    /// The next word of it.
    pub(super) fn news(&self) -> News {
        match self.said.try_recv() {
            Ok(said) => News::Said(said),
            Err(TryRecvError::Empty) => News::Nothing,
            Err(TryRecvError::Disconnected) => News::Over,
        }
    }

    /// Ends it, if it has not ended yet; how it ended, in words.
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

    /// The processor time that it has used, where the operating system tells.
    pub(super) fn used(&self) -> Option<Span> {
        let text = std::fs::read_to_string(format!("/proc/{}/schedstat", self.id())).ok()?;
        text.split(' ').next()?.parse().ok().map(Span)
    }

    /// Lets the kernel end it when it has used more processor time than this in all, rounded up to seconds.
    #[cfg(target_os = "linux")]
    pub(super) fn limit(&self, most: Span) {
        use rustix::process::{Pid, Resource, Rlimit, prlimit};
        let seconds = u64::try_from(most.0).unwrap_or(0).div_ceil(1_000_000_000).max(1);
        let limit = Rlimit { current: Some(seconds), maximum: None };
        // Without it, what it uses is still measured.
        let _ = prlimit(Some(Pid::from_child(&self.child)), Resource::Cpu, limit);
    }

    /// As there.
    #[cfg(not(target_os = "linux"))]
    pub(super) fn limit(&self, _: Span) {}
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// How a process ended.
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
    fn endings_are_told_in_words() {
        use std::os::unix::process::ExitStatusExt;
        let told = |raw: i32, words: &str| ending(ExitStatus::from_raw(raw), words);
        assert_eq!(told(9, ""), "killed by signal 9");
        assert_eq!(told(24, ""), "it used more processor time than it is granted");
        let lack = "memory allocation of 4096 bytes failed";
        assert_eq!(told(6, lack), format!("it took more memory than it is granted ({lack})"));
        assert_eq!(told(2 << 8, "error: no\n\n"), "it ended by itself: error: no");
        assert_eq!(told(0, ""), "it ended by itself with exit status: 0");
    }
}
