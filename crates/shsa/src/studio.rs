//! `shsa studio`: serves the studio, a page without a server of its own, to browsers on this machine.

use crate::outcome::Outcome;
use crate::show;
use anyhow::{Context, bail};
use std::env;
use std::fs;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

/// Arguments of `shsa studio`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa studio

It shows a recording that is dropped on it: which signals contradict each other, where, and why. The page works by itself, in \
WebAssembly: nothing is sent, here neither. `cargo xtask wasm` builds it; it is found beside this program, in its package, or with --from.")]
pub(crate) struct Arguments {
    /// The port on this machine; 0 takes a free one.
    #[arg(long, value_name = "PORT", default_value_t = 7420)]
    port: u16,
    /// The folder of the studio, such as target/wasm/studio.
    #[arg(long, value_name = "FOLDER")]
    from: Option<PathBuf>,
}

/// Where the studio is beside the folder of this program: in a package, in the target folder, after a copy.
const BESIDE: [&str; 3] = ["../share/shsa/studio", "../wasm/studio", "studio"];

/// What the page may do: its own files, its own worker, nothing inline, and in no frame.
const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src 'self'; img-src 'self' blob:; \
    connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The longest request line and head, bytes.
const HEAD_MAX: u64 = 1 << 14;
const PATIENCE: Duration = Duration::from_secs(10);

/// The kinds of the files, by their endings.
const KINDS: [(&str, &str); 7] = [
    ("html", "text/html; charset=utf-8"),
    ("css", "text/css; charset=utf-8"),
    ("js", "text/javascript; charset=utf-8"),
    ("svg", "image/svg+xml"),
    ("wasm", "application/wasm"),
    ("csv", "text/csv; charset=utf-8"),
    ("yaml", "text/yaml; charset=utf-8"),
];

/// Serves the studio until the program is ended.
///
/// # Errors
/// When the studio is nowhere, or the port is taken.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let folder = match &arguments.from {
        Some(folder) => folder.clone(),
        None => found().context(
            "the studio is not beside this program: `cargo xtask wasm` builds it in target/wasm/studio; then say --from FOLDER",
        )?,
    };
    if !folder.join("index.html").is_file() {
        bail!("there is no studio in {}: it has no index.html", folder.display());
    }
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, arguments.port))
        .with_context(|| format!("port {} cannot be used; --port 0 takes a free one", arguments.port))?;
    let address = listener.local_addr().context("the own address")?;
    show::notice(&format!("the studio is at http://{address}/ (Ctrl-C ends it)"));
    for stream in listener.incoming().filter_map(Result::ok) {
        let folder = folder.clone();
        // A browser that goes away is no matter of ours.
        thread::spawn(move || drop(answer(stream, &folder, address)));
    }
    Ok(Outcome::Done)
}

/// The studio beside this program.
fn found() -> Option<PathBuf> {
    let program = env::current_exe().and_then(fs::canonicalize).ok()?;
    let folders = BESIDE.iter().filter_map(|beside| Some(program.parent()?.join(beside)));
    folders.into_iter().find(|folder| folder.join("index.html").is_file())
}

/// Answers one request.
fn answer(mut stream: TcpStream, folder: &Path, address: SocketAddr) -> io::Result<()> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let mut lines = BufReader::new(stream.try_clone()?.take(HEAD_MAX)).lines();
    let request = lines.next().transpose()?.unwrap_or_default();
    let head: Vec<String> =
        lines.map_while(Result::ok).take_while(|line| !line.is_empty()).map(|it| it.to_lowercase()).collect();
    let port = address.port();
    let is_ours = [format!("host: {address}"), format!("host: localhost:{port}")];
    let (status, kind, bytes) = match request.split(' ').collect::<Vec<_>>()[..] {
        ["GET", target, _] if head.iter().any(|line| is_ours.contains(line)) => match file(folder, target) {
            Some((kind, bytes)) => ("200 OK", kind, bytes),
            None => ("404 Not Found", "text/plain", b"there is no such file\n".to_vec()),
        },
        // A page of somewhere else, whose name leads here, gets nothing.
        _ => ("400 Bad Request", "text/plain", b"only GET, and only by this machine's name\n".to_vec()),
    };
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nContent-Security-Policy: {POLICY}\r\n\
         X-Content-Type-Options: nosniff\r\nCache-Control: no-cache\r\nConnection: close\r\n\r\n",
        bytes.len()
    )?;
    stream.write_all(&bytes)
}

/// A file of the studio with its kind; `None` for any other.
fn file(folder: &Path, target: &str) -> Option<(&'static str, Vec<u8>)> {
    let path = target.split(['?', '#']).next()?.strip_prefix('/')?;
    let path = if path.is_empty() { "index.html" } else { path };
    let is_plain = |part: &str| {
        !part.is_empty()
            && !part.starts_with('.')
            && part.chars().all(|it| it.is_ascii_alphanumeric() || "._-".contains(it))
    };
    let (_, ending) = path.rsplit_once('.')?;
    let (_, kind) = KINDS.iter().find(|(known, _)| *known == ending)?;
    path.split('/').all(is_plain).then(|| fs::read(folder.join(path)).ok())?.map(|bytes| (*kind, bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_of_the_studio_are_served() {
        let folder = env::temp_dir().join(format!("shsa-studio-{}", std::process::id()));
        fs::create_dir_all(folder.join("page/engine")).unwrap();
        for name in ["secret.js", "page/index.html", "page/engine/a.wasm", "page/.hidden.js", "page/a.key"] {
            fs::write(folder.join(name), name).unwrap();
        }
        let page = folder.join("page");
        let served = |target: &str| file(&page, target).map(|(kind, _)| kind);
        assert_eq!(served("/"), Some("text/html; charset=utf-8"));
        assert_eq!(served("/engine/a.wasm?1"), Some("application/wasm"));
        for other in [
            "/../secret.js",
            "/engine/../../secret.js",
            "/%2e%2e/secret.js",
            "/.hidden.js",
            "/a.key",
            "//secret.js",
            "secret.js",
            "/none.js",
        ] {
            assert_eq!(served(other), None, "{other}");
        }
        fs::remove_dir_all(&folder).unwrap();
    }
}
