//! The live page of a run: its files, embedded, and the policy under which a browser may use them.
//!
//! ```
//! let page = shsa_web::file("/").unwrap();
//! assert!(page.kind.starts_with("text/html") && page.bytes.starts_with(b"<!DOCTYPE html>"));
//! assert!(shsa_web::file("/web/../Cargo.toml").is_none());
//! ```

/// What the page may do: its own files and its own host, nothing inline, and in no frame.
pub const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; \
    base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// A file of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct File {
    /// The path of the URL.
    pub path: &'static str,
    /// Its `Content-Type`.
    pub kind: &'static str,
    /// The content.
    pub bytes: &'static [u8],
}

const HTML: &str = "text/html; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const IMAGE: &str = "image/svg+xml";

/// Every file of the page; the first is the page itself.
pub const FILES: [File; 15] = [
    File { path: "/", kind: HTML, bytes: include_bytes!("../assets/index.html") },
    File { path: "/web/page.css", kind: STYLE, bytes: include_bytes!("../assets/page.css") },
    File { path: "/web/icon.svg", kind: IMAGE, bytes: include_bytes!("../assets/icon.svg") },
    File { path: "/web/page.js", kind: SCRIPT, bytes: include_bytes!("../assets/page.js") },
    File { path: "/web/stream.js", kind: SCRIPT, bytes: include_bytes!("../assets/stream.js") },
    File { path: "/web/words.js", kind: SCRIPT, bytes: include_bytes!("../assets/words.js") },
    File { path: "/web/needs.js", kind: SCRIPT, bytes: include_bytes!("../assets/needs.js") },
    File { path: "/web/profile.js", kind: SCRIPT, bytes: include_bytes!("../assets/profile.js") },
    File { path: "/web/signals.js", kind: SCRIPT, bytes: include_bytes!("../assets/signals.js") },
    File { path: "/web/learned.js", kind: SCRIPT, bytes: include_bytes!("../assets/learned.js") },
    File { path: "/web/timeline.js", kind: SCRIPT, bytes: include_bytes!("../assets/timeline.js") },
    File { path: "/web/bands.js", kind: SCRIPT, bytes: include_bytes!("../assets/bands.js") },
    File { path: "/web/graph.js", kind: SCRIPT, bytes: include_bytes!("../assets/graph.js") },
    File { path: "/web/whatif.js", kind: SCRIPT, bytes: include_bytes!("../assets/whatif.js") },
    File { path: "/web/orders.js", kind: SCRIPT, bytes: include_bytes!("../assets/orders.js") },
];

/// The file at a path; `None` where there is none.
#[must_use]
pub fn file(path: &str) -> Option<&'static File> {
    FILES.iter().find(|file| file.path == path)
}

impl File {
    /// The `ETag`: it differs where the content differs. O(bytes).
    #[must_use]
    pub fn tag(&self) -> String {
        // FNV-1a, 64 bits.
        let hash = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        format!("\"{:016x}\"", self.bytes.iter().fold(0xcbf2_9ce4_8422_2325, hash))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(file: &File) -> &'static str {
        std::str::from_utf8(file.bytes).unwrap()
    }

    #[test]
    fn everything_that_the_page_refers_to_is_there() {
        for page in &FILES {
            let parts = text(page).split(['"', '\'']);
            let named = parts.filter_map(|part| match part.strip_prefix("./") {
                Some(module) if page.kind == SCRIPT => Some(format!("/web/{module}")),
                _ => part.starts_with("/web/").then(|| part.to_owned()),
            });
            named.for_each(|path| assert!(file(&path).is_some(), "{} refers to {path}", page.path));
        }
    }

    #[test]
    fn nothing_is_inline_and_nothing_comes_from_elsewhere() {
        for page in &FILES {
            let text = text(page).replace("http://www.w3.org/2000/svg", "");
            for forbidden in
                ["http:", "https:", "src=\"//", " style=", "<style", "onclick=", "eval(", "innerHTML"]
            {
                assert!(!text.contains(forbidden), "{}: {forbidden}", page.path);
            }
            let inline = text
                .match_indices("<script")
                .any(|(at, _)| !text[at..].starts_with("<script type=\"module\" src="));
            assert!(!inline, "{}", page.path);
        }
    }

    #[test]
    fn tags_tell_files_apart() {
        let tags: std::collections::BTreeSet<String> = FILES.iter().map(File::tag).collect();
        assert_eq!(tags.len(), FILES.len());
    }
}
