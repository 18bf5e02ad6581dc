//! The studio as it is served to a browser on this machine.

use crate::folder::Folder;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::Stdio;

/// Asks a server at an address for a path, by a host; returns the whole answer.
fn get(address: &str, path: &str, host: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

#[test]
fn its_own_files_are_served_and_nothing_else() {
    let folder = Folder::with(&[("key.js", b"secret")]);
    std::fs::create_dir(folder.path("page")).unwrap();
    folder.write("page/index.html", "<!DOCTYPE html>");
    let mut serving = folder.command("studio --port 0 --from page");
    let mut serving = serving.stderr(Stdio::piped()).spawn().unwrap();
    let mut told = String::new();
    BufReader::new(serving.stderr.take().unwrap()).read_line(&mut told).unwrap();
    let (_, address) = told.split_once("http://").unwrap_or_else(|| panic!("{told}"));
    let address = address.split('/').next().unwrap().to_owned();
    let page = get(&address, "/", &address);
    let other = get(&address, "/", "evil.example");
    let secret = get(&address, "/../key.js", &address);
    serving.kill().unwrap();
    serving.wait().unwrap();
    assert!(page.starts_with("HTTP/1.1 200") && page.ends_with("<!DOCTYPE html>"), "{page}");
    assert!(page.contains("frame-ancestors 'none'") && !page.contains("unsafe-inline"), "{page}");
    assert!(other.starts_with("HTTP/1.1 400") && secret.starts_with("HTTP/1.1 404"), "{other}{secret}");
}

#[test]
fn who_has_no_studio_is_told_how_to_get_one() {
    Folder::new().refuses("studio --from nowhere", &["nowhere", "index.html"]);
}
