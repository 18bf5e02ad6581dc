//! A line of NMEA 0183 in parts: the text before the sentence, the sentence, its checksum.

use shsa_core::time::Time;
use shsa_message::stamp;

/// The longest text before a sentence that may be a time.
const PREFIX_MAX: usize = 64;

/// The content of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sentence<'a> {
    /// `GPRMC`.
    pub(super) address: &'a str,
    /// The cells after the address, up to the checksum.
    pub(super) content: &'a str,
    /// The time that the logger has noted for the line.
    pub(super) noted: Option<Time>,
}

impl<'a> Sentence<'a> {
    /// The cells between the commas. They are short: a look at each byte is quicker than a search.
    pub(super) fn cells(&self) -> impl Iterator<Item = &'a str> {
        let mut rest = Some(self.content);
        std::iter::from_fn(move || {
            let text = rest?;
            let end = text.bytes().position(|byte| byte == b',');
            rest = end.and_then(|end| text.get(end + 1..));
            text.get(..end.unwrap_or(text.len()))
        })
    }
}

/// Why a line is no sentence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flaw {
    /// The line does not look like a sentence: a comment, a text of the logger.
    Other,
    /// The sentence is incomplete or has wrong letters.
    Torn,
}

/// Parses a line. A sentence may lack its checksum only where the whole recording has none.
pub(super) fn sentence(line: &str, has_checksums: bool) -> Result<Sentence<'_>, Flaw> {
    let line = line.trim();
    if line.starts_with('#') {
        return Err(Flaw::Other);
    }
    // Where a line has two sentences, the first is incomplete.
    let begin = line.bytes().rposition(|byte| matches!(byte, b'$' | b'!')).ok_or(Flaw::Other)?;
    let (before, sentence) = line.split_at(begin);
    let rest = sentence.get(1..).unwrap_or_default();
    let flaw = if is_likely(sentence) { Flaw::Torn } else { Flaw::Other };
    let body = match rest.rsplit_once('*') {
        Some((body, sum)) => {
            (sum.len() >= 2 && checksum(body) == sum.get(..2).and_then(hexadecimal)).then_some(body)
        }
        None => (!has_checksums).then_some(rest),
    };
    let (address, content) = body.and_then(|body| body.split_once(',')).ok_or(flaw)?;
    let is_address =
        (4..=12).contains(&address.len()) && address.bytes().all(|byte| byte.is_ascii_alphanumeric());
    // A talker has two letters, a sentence three; a proprietary address begins with P.
    let is_address = is_address && (address.starts_with('P') || address.len() == 5);
    if is_address { Ok(Sentence { address, content, noted: noted(before) }) } else { Err(flaw) }
}

/// Whether a text was probably a sentence: `$` and two capital letters, or `!`, five of them and a comma.
fn is_likely(sentence: &str) -> bool {
    let is_capital = |byte: &u8| byte.is_ascii_uppercase();
    match sentence.as_bytes() {
        [b'$', rest @ ..] => rest.iter().take(2).filter(|byte| is_capital(byte)).count() == 2,
        [b'!', rest @ ..] => {
            rest.iter().take_while(|byte| is_capital(byte)).count() == 5 && rest.get(5) == Some(&b',')
        }
        _ => false,
    }
}

/// The exclusive or of all letters of a sentence.
fn checksum(body: &str) -> Option<u8> {
    Some(body.bytes().fold(0, |sum, byte| sum ^ byte))
}

fn hexadecimal(digits: &str) -> Option<u8> {
    u8::from_str_radix(digits, 16).ok()
}

/// The time before a sentence, from a TAG block or a logger: `\\c:1423133048*50\\`, `2021-01-18T..;N;`, `1471172400153;A;`,
/// `(1471172400.153) `.
fn noted(before: &str) -> Option<Time> {
    let before = before.trim();
    if before.is_empty() || before.len() > PREFIX_MAX {
        return None;
    }
    if let Some(block) = before.strip_suffix('\\').and_then(|open| open.rsplit_once('\\')) {
        return tagged(block.1);
    }
    let is_around = |letter: char| {
        matches!(letter, '(' | ')' | '[' | ']' | ':' | ';' | ',' | ' ' | '\t' | '<' | '>' | '"')
    };
    let text = before.trim_matches(is_around);
    let first = text.split([';', ',', '\t', ')', ']']).next().unwrap_or_default().trim();
    let time = epoch(first).or_else(|| moment(first));
    time.or_else(|| moment(text)).or_else(|| epoch(text.split(' ').next()?))
}

/// The time in a TAG block with a correct checksum.
fn tagged(block: &str) -> Option<Time> {
    let (body, sum) = block.rsplit_once('*')?;
    if checksum(body) != hexadecimal(sum) {
        return None;
    }
    body.split(',').find_map(|part| part.strip_prefix("c:")).and_then(epoch)
}

/// A number that can be a time of this century.
fn epoch(text: &str) -> Option<Time> {
    let (time, _) = stamp::number(text, None)?;
    (time.0 > 946_684_800_000_000_000).then_some(time)
}

fn moment(text: &str) -> Option<Time> {
    let is_date = text.len() >= 16 && text.as_bytes().get(4) == Some(&b'-');
    stamp::text(text, None).map(|(time, _)| time).filter(|_| is_date)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(line: &str, expected: &str) {
        let shown = match sentence(line, true) {
            Ok(Sentence { address, content, noted }) => {
                let noted = noted.map_or(String::new(), |time| format!(" at {}", time.0 / 1_000_000));
                format!("{address} {content}{noted}")
            }
            Err(flaw) => format!("{flaw:?}"),
        };
        assert_eq!(shown, expected);
    }

    #[test]
    fn sentences_are_found_in_lines() {
        check("$SDDPT,2.58,0.00,100.0*5B", "SDDPT 2.58,0.00,100.0");
        check("$SDDPT,2.58,0.00,100.0*5b \r", "SDDPT 2.58,0.00,100.0");
        check("$SDDPT,2.59,0.00,100.0*5B", "Torn");
        check("$SDDPT,2.58,0.00", "Torn");
        check("$GPRMC,190321.000,A,3503$SDDPT,2.58,0.00,100.0*5B", "SDDPT 2.58,0.00,100.0");
        check("$PSRF100,1,4800,8,1,0*0E", "PSRF100 1,4800,8,1,0");
        check("!!VER:1.9,UID:MEGA", "Other");
        check("Setup complete..", "Other");
        check("# $SDDPT,2.58,0.00,100.0*5B", "Other");
        assert!(sentence("$SDDPT,2.58,0.00", false).is_ok());
    }

    #[test]
    fn loggers_note_times() {
        let (first, of) = ("SDDPT 2.58,0.00,100.0", "$SDDPT,2.58,0.00,100.0*5B");
        check(&format!("\\c:1423133048*50\\{of}"), &format!("{first} at 1423133048000"));
        check(&format!("\\c:1423133049*50\\{of}"), first);
        check(&format!("2021-01-18T10:00:00.250Z;N;{of}"), &format!("{first} at 1610964000250"));
        check(&format!("2021-01-18 10:00:00.250 {of}"), &format!("{first} at 1610964000250"));
        check(&format!("1471172400153;A;{of}"), &format!("{first} at 1471172400153"));
        check(&format!("(1471172400.153) {of}"), &format!("{first} at 1471172400153"));
        check(&format!("12 {of}"), first);
    }
}
