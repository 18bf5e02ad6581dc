//! `shsa top`: the needs, signals and decisions of a running instance, in the terminal.

mod board;
mod picture;
mod stream;

use crate::outcome::Outcome;
use crate::show;
use board::Board;
use picture::{Picture, Size};
use shsa_runtime::Token;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use std::io::{IsTerminal, Write, stdout};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};
use stream::{News, follow};
use terminal_size::{Height, Width, terminal_size};

const EXAMPLES: &str = "\
Example: shsa top                           (beside a run on this machine, as of `shsa run`)
         shsa top 192.168.1.7:7410 --once

The view is that of the page at http://ADDRESS/, where the values over time, the reasons and orders are.
Ctrl-C ends it. On the way into a file or a pipe, one picture is printed, as with --once.";

/// The time between two pictures.
const PACE: Duration = Duration::from_millis(250);
/// How long an instance may take for its first answer with `--once`.
const PATIENCE: Duration = Duration::from_secs(5);
/// Switches to a screen of its own and hides the cursor; and back.
const ENTER: &str = "\x1b[?1049h\x1b[?25l";
const LEAVE: &str = "\x1b[?25h\x1b[?1049l";

/// Arguments of `shsa top`.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Where the control interface of the instance listens: HOST:PORT (`--http` of `shsa run`).
    #[arg(default_value = "127.0.0.1:7410")]
    address: String,
    /// Print one picture, and end.
    #[arg(long)]
    once: bool,
    /// A file whose first line is the token that looking needs; else it is taken from SHSA_VIEW_TOKEN.
    #[arg(long, value_name = "FILE")]
    view_token_file: Option<PathBuf>,
}

/// Shows an instance until it is interrupted, or once.
///
/// # Errors
/// When the token cannot be read, or the instance refuses to be looked at.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let token = Token::find(arguments.view_token_file.as_deref(), "SHSA_VIEW_TOKEN")?;
    let (sender, news) = channel();
    follow(&arguments.address, token, sender.clone());
    if arguments.once || !stdout().is_terminal() {
        return once(&arguments.address, &news);
    }
    on_interrupt(sender)?;
    print(ENTER)?;
    let ended = watch(&arguments.address, &news);
    print(LEAVE)?;
    ended
}

/// Prints one picture as soon as it is complete.
fn once(address: &str, news: &Receiver<News>) -> anyhow::Result<Outcome> {
    let (mut board, start) = (Board::default(), Instant::now());
    while board.age().is_none() || !board.is_complete() {
        match news.recv_timeout(PATIENCE.saturating_sub(start.elapsed())) {
            Ok(News::Part(part)) => board.take(part),
            Ok(News::Refused(why)) => anyhow::bail!("{address}: {why}"),
            Ok(News::Lost(why)) if board.age().is_none() => return Ok(unreachable(address, &why)),
            Err(_) if board.age().is_none() => return Ok(unreachable(address, "it does not answer")),
            _ => break,
        }
    }
    print(&format!("{}\n", picture(&board).lines(None, Size { rows: usize::MAX, ..room() }).join("\n")))?;
    Ok(Outcome::Done)
}

fn picture(board: &Board) -> Picture<'_> {
    Picture { board, style: show::style() }
}

/// The room of the terminal; a file or a pipe has no end.
fn room() -> Size {
    let on_terminal = terminal_size().filter(|_| stdout().is_terminal());
    on_terminal.map_or(Size::UNLIMITED, |(Width(columns), Height(rows))| Size {
        columns: usize::from(columns),
        rows: usize::from(rows),
    })
}

fn unreachable(address: &str, why: &str) -> Outcome {
    show::fail(format_args!("no instance can be reached at {address}: {why}"));
    Outcome::Unreachable
}

/// Draws until it is interrupted. The last values of a lost instance stay, with their age and the reason of the loss.
fn watch(address: &str, news: &Receiver<News>) -> anyhow::Result<Outcome> {
    let (mut board, mut lost) = (Board::default(), Some("no answer yet".to_owned()));
    let mut drawn: Option<Instant> = None;
    loop {
        match news.recv_timeout(PACE) {
            Ok(News::Part(part)) => {
                board.take(part);
                lost = None;
            }
            Ok(News::Lost(why)) => lost = Some(why),
            Ok(News::Refused(why)) => anyhow::bail!("{address}: {why}"),
            Ok(News::Interrupted) | Err(RecvTimeoutError::Disconnected) => return Ok(Outcome::Done),
            Err(RecvTimeoutError::Timeout) => {}
        }
        if drawn.is_none_or(|drawn| drawn.elapsed() >= PACE) {
            let lines = picture(&board).lines(lost.as_deref(), room());
            print(&format!("\x1b[H{}\x1b[K\x1b[J", lines.join("\x1b[K\r\n")))?;
            drawn = Some(Instant::now());
        }
    }
}

fn on_interrupt(sender: Sender<News>) -> anyhow::Result<()> {
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    std::thread::spawn(move || {
        if signals.forever().next().is_some() {
            let _ = sender.send(News::Interrupted);
        }
    });
    Ok(())
}

fn print(text: &str) -> anyhow::Result<()> {
    let mut output = stdout().lock();
    output.write_all(text.as_bytes())?;
    output.flush()?;
    Ok(())
}
