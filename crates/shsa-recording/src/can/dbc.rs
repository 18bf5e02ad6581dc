//! DBC: the meaning of the frames of a CAN bus. The reader understands messages (`BO_`), signals (`SG_`), floats
//! (`SIG_VALTYPE_`), extended multiplexing (`SG_MUL_VAL_`), the mark of J1939 messages (`BA_ "VFrameFormat"`) and the long names of
//! messages and signals, and ignores the rest.

use super::signal::{Choice, Kind, Order, Signal};
use std::collections::BTreeMap;

/// Identifiers of 29 bits have this bit in a DBC, and in this module.
pub(in super::super) const EXTENDED: u32 = 1 << 31;

/// The most signals of a message: as many as there are bits in the longest frame.
const SIGNALS_MAX: usize = 512;

/// The longest text of a DBC that is read, bytes.
pub(super) const TEXT_MAX: u64 = 1 << 26;

/// The message under which tools keep signals without a message.
const NO_MESSAGE: &str = "VECTOR__INDEPENDENT_SIG_MSG";

/// A message.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Message {
    pub(super) name: String,
    pub(super) signals: Vec<Signal>,
    /// Whether any source may send the message: its identifier holds only the number of its parameter group.
    pub(super) is_j1939: bool,
}

/// The messages of a bus by their identifiers.
#[derive(Clone, Debug, Default)]
pub(super) struct Database {
    pub(super) messages: BTreeMap<u32, Message>,
}

impl Database {
    /// Adds a file. Messages that are already known are kept. Returns the number of each line of a message or a signal that
    /// cannot be understood, with the problem.
    pub(super) fn add(&mut self, text: &str) -> Vec<(u64, String)> {
        let mut reader = Reader::default();
        let lines = (1..).zip(text.lines().map(str::trim));
        // The list of words under `NS_` names kinds of lines, and has nothing of them.
        for (number, line) in lines.filter(|(_, line)| line.contains(char::is_whitespace)) {
            if let Err(problem) = reader.line(line) {
                reader.problems.push((number, problem));
            }
        }
        reader.finish();
        reader.rename();
        for (id, message) in reader.messages {
            self.messages.entry(id).or_insert(message);
        }
        reader.problems
    }

    /// The message of a frame with this identifier, and its identifier in the database.
    pub(super) fn message(&self, id: u32) -> Option<(u32, &Message)> {
        if let Some(message) = self.messages.get(&id) {
            return Some((id, message));
        }
        let group = parameter_group(id)?;
        let of_group =
            |(id, message): &(&u32, &Message)| message.is_j1939 && parameter_group(**id) == Some(group);
        self.messages.iter().find(of_group).map(|(id, message)| (*id, message))
    }
}

/// The J1939 parameter group of an identifier of 29 bits; for one receiver, without the receiver's address.
fn parameter_group(id: u32) -> Option<u32> {
    let is_to_all = id >> 16 & 0xff >= 240;
    let mask = if is_to_all { 0x03ff_ff00 } else { 0x03ff_0000 };
    (id & EXTENDED != 0).then_some(id & mask)
}

/// How a signal depends on a selector: `M`, `m3`, `m3M`.
#[derive(Clone, Copy, Default)]
struct Multiplexing {
    selects: bool,
    value: Option<u64>,
}

#[derive(Default)]
struct Reader {
    messages: BTreeMap<u32, Message>,
    /// By message; in the order of the message's signals.
    multiplexing: BTreeMap<u32, Vec<Multiplexing>>,
    /// The message whose signals are being read.
    current: Option<u32>,
    /// The long names of messages, and of signals by their short names: a name in a line has at most 32 characters.
    long_names: Vec<(u32, Option<String>, String)>,
    problems: Vec<(u64, String)>,
}

impl Reader {
    fn line(&mut self, line: &str) -> Result<(), String> {
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match word {
            "BO_" => self.message(rest),
            "SG_" => self.signal(rest),
            "SIG_VALTYPE_" => {
                self.float(rest).ok_or_else(|| "a type of a signal that cannot be understood".into())
            }
            "SG_MUL_VAL_" => {
                self.ranges(rest).ok_or_else(|| "ranges of a selector that cannot be understood".into())
            }
            "BA_" => {
                self.attribute(rest);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// `1234 Name: 8 Sender`.
    fn message(&mut self, rest: &str) -> Result<(), String> {
        self.current = None;
        let problem = "a message that cannot be understood; write it like BO_ 100 Name: 8 Sender";
        let (id, rest) = rest.trim().split_once(char::is_whitespace).ok_or(problem)?;
        let (name, _) = rest.split_once(':').ok_or(problem)?;
        let id = id.parse::<u32>().map_err(|_| problem)?;
        let name = name.trim();
        if name != NO_MESSAGE {
            // The null address as the source: the message may come from any source.
            let is_j1939 = id & EXTENDED != 0 && id & 0xff == 0xfe;
            self.messages.insert(id, Message { name: name.to_owned(), signals: Vec::new(), is_j1939 });
            self.multiplexing.insert(id, Vec::new());
            self.current = Some(id);
        }
        Ok(())
    }

    fn signal(&mut self, rest: &str) -> Result<(), String> {
        let (signal, multiplexing) = signal(rest).ok_or("a signal that cannot be understood")?;
        let Some(message) = self.current.and_then(|id| self.messages.get_mut(&id)) else { return Ok(()) };
        if message.signals.len() == SIGNALS_MAX {
            return Err(format!("a message of more than {SIGNALS_MAX} signals"));
        }
        message.signals.push(signal);
        self.current
            .and_then(|id| self.multiplexing.get_mut(&id))
            .into_iter()
            .for_each(|it| it.push(multiplexing));
        Ok(())
    }

    /// `1234 Signal : 1;`: 1 for a float of 32 bits, 2 for one of 64.
    fn float(&mut self, rest: &str) -> Option<()> {
        let (id, name, kind) = of_signal(rest)?;
        let kind = kind.trim_start_matches([':', ' ']).trim_end_matches([';', ' ']);
        let signals = &mut self.messages.get_mut(&id)?.signals;
        let signal = signals.iter_mut().find(|signal| signal.name == name)?;
        if matches!(kind, "1" | "2") {
            signal.kind = Kind::Float;
        }
        Some(())
    }

    /// `1234 Signal Selector 0-3, 7-7;`.
    fn ranges(&mut self, rest: &str) -> Option<()> {
        let (id, name, rest) = of_signal(rest)?;
        let (selector, ranges) = rest.split_once(char::is_whitespace)?;
        let range = |range: &str| {
            let (from, to) = range.trim().split_once('-')?;
            Some((from.trim().parse().ok()?, to.trim().parse().ok()?))
        };
        let ranges = ranges.trim().trim_end_matches(';').split(',').map(range).collect::<Option<Vec<_>>>()?;
        let signals = &mut self.messages.get_mut(&id)?.signals;
        let selector = signals.iter().position(|signal| signal.name == selector)?;
        let signal = signals.iter_mut().find(|signal| signal.name == name)?;
        signal.choice = Some(Choice { selector, ranges });
        Some(())
    }

    /// `"VFrameFormat" BO_ 1234 3;`: 3 for a parameter group of J1939. `"SystemSignalLongSymbol" SG_ 1234 Short "Long";`: a long
    /// name.
    fn attribute(&mut self, rest: &str) -> Option<()> {
        let words: Vec<&str> = rest.trim_end_matches([';', ' ']).split_whitespace().collect();
        match words.as_slice() {
            ["\"VFrameFormat\"", "BO_", id, format] => {
                let message = self.messages.get_mut(&id.parse().ok()?)?;
                message.is_j1939 |= *format == "3";
            }
            ["\"SystemMessageLongSymbol\"", "BO_", id, long] => {
                self.long_names.push((id.parse().ok()?, None, unquoted(long)?));
            }
            ["\"SystemSignalLongSymbol\"", "SG_", id, short, long] => {
                self.long_names.push((id.parse().ok()?, Some((*short).to_owned()), unquoted(long)?));
            }
            _ => {}
        }
        Some(())
    }

    /// Gives messages and signals their long names; other lines have the short ones.
    fn rename(&mut self) {
        for (id, short, long) in std::mem::take(&mut self.long_names) {
            let Some(message) = self.messages.get_mut(&id) else { continue };
            let name = match short {
                None => Some(&mut message.name),
                Some(short) => {
                    message.signals.iter_mut().find(|it| it.name == short).map(|signal| &mut signal.name)
                }
            };
            name.into_iter().for_each(|name| name.clone_from(&long));
        }
    }

    /// Resolves signals that depend on one value of the selector; such a message has one selector.
    fn finish(&mut self) {
        for (id, all) in &self.multiplexing {
            let Some(selector) = all.iter().position(|it| it.selects) else { continue };
            let signals = self.messages.get_mut(id).map(|message| &mut message.signals);
            for (at, (signal, it)) in signals.into_iter().flatten().zip(all).enumerate() {
                if let (Some(value), None, true) = (it.value, &signal.choice, at != selector) {
                    signal.choice = Some(Choice { selector, ranges: vec![(value, value)] });
                }
            }
        }
    }
}

/// A text without its quotes; `None` for an empty one.
fn unquoted(text: &str) -> Option<String> {
    let text = text.strip_prefix('"')?.strip_suffix('"')?;
    (!text.is_empty()).then(|| text.to_owned())
}

/// `1234 Signal` and the rest of the line.
fn of_signal(rest: &str) -> Option<(u32, &str, &str)> {
    let (id, rest) = rest.trim().split_once(char::is_whitespace)?;
    let (name, rest) = rest.trim().split_once([' ', ':', '\t'])?;
    Some((id.parse().ok()?, name, rest.trim()))
}

/// `Name m3 : 7|16@0- (0.1,-40) [-40|215] "degC" Receiver`.
fn signal(rest: &str) -> Option<(Signal, Multiplexing)> {
    let (names, rest) = rest.split_once(':')?;
    let mut names = names.split_whitespace();
    let name = names.next()?.to_owned();
    let multiplexing = names.next().map_or(Some(Multiplexing::default()), multiplexing)?;
    let (place, rest) = rest.trim().split_once('(')?;
    let (scale, rest) = rest.split_once(')')?;
    let (start, place) = place.trim().split_once('|')?;
    let (length, order) = place.split_once('@')?;
    let order = order.trim().as_bytes();
    let (factor, offset) = scale.split_once(',')?;
    let unit = rest.split_once('"').and_then(|(_, rest)| rest.split_once('"')).map_or("", |(unit, _)| unit);
    let signal = Signal {
        name,
        start: start.trim().parse().ok().filter(|start| *start < 8 * SIGNALS_MAX)?,
        length: length.trim().parse().ok().filter(|length| (1..=64).contains(length))?,
        order: if *order.first()? == b'0' { Order::Big } else { Order::Little },
        kind: if order.get(1) == Some(&b'-') { Kind::Signed } else { Kind::Unsigned },
        factor: factor.trim().parse().ok()?,
        offset: offset.trim().parse().ok()?,
        unit: unit.trim().to_owned(),
        choice: None,
    };
    Some((signal, multiplexing))
}

fn multiplexing(text: &str) -> Option<Multiplexing> {
    let selects = text.ends_with('M');
    let value = text.trim_end_matches('M').strip_prefix('m');
    let value = value.map(|value| value.parse().ok()).map_or(Some(None), |value| value.map(Some))?;
    (selects || value.is_some()).then_some(Multiplexing { selects, value })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "VERSION \"\"\n\nNS_ :\n\tCM_\n\tSIG_VALTYPE_\n\tSG_MUL_VAL_\n\nBU_: ECU\n\n\
BO_ 100 Engine: 8 ECU\n SG_ Speed : 7|16@0- (0.25,-40) [-40|215] \"m/s\" Vector__XXX\n\
 SG_ Mode M : 16|4@1+ (1,0) [0|0] \"\" A,B\n SG_ Hot m1 : 24|8@1+ (1,0) [0|0] \"\" A\n SG_ Deep m0M : 32|8@1+ (1,0) [0|0] \"\" A\n\n\
 SG_ Deeper m2 : 40|8@1+ (1,0) [0|0] \"\" A\n\
BO_ 2566844926 Group: 8 Vector__XXX\n SG_ Temp : 0|32@1- (1,0) [0|0] \"\u{b0}C\" A\n\
BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX\n SG_ Unused : 0|8@1+ (1,0) [0|0] \"\" A\n\
CM_ SG_ 100 Speed \"BO_ 7\";\nSIG_VALTYPE_ 2566844926 Temp : 1;\nSG_MUL_VAL_ 100 Deeper Deep 2-3, 5-5;\n\
BA_ \"VFrameFormat\" BO_ 100 0;\n";

    #[test]
    fn messages_and_signals_are_read() {
        let mut database = Database::default();
        assert_eq!(database.add(TEXT), []);
        assert_eq!(database.messages.keys().copied().collect::<Vec<_>>(), [100, 2_566_844_926]);
        let engine = &database.messages[&100];
        let shown: Vec<String> = engine
            .signals
            .iter()
            .map(|it| {
                let choice = it.choice.as_ref().map(|it| format!(" if {} in {:?}", it.selector, it.ranges));
                let Signal { name, start, length, order, kind, factor, offset, unit, .. } = it;
                let choice = choice.unwrap_or_default();
                format!("{name} {start} {length} {order:?} {kind:?} {factor} {offset} '{unit}'{choice}")
            })
            .collect();
        assert_eq!(
            shown,
            [
                "Speed 7 16 Big Signed 0.25 -40 'm/s'",
                "Mode 16 4 Little Unsigned 1 0 ''",
                "Hot 24 8 Little Unsigned 1 0 '' if 1 in [(1, 1)]",
                "Deep 32 8 Little Unsigned 1 0 '' if 1 in [(0, 0)]",
                "Deeper 40 8 Little Unsigned 1 0 '' if 3 in [(2, 3), (5, 5)]",
            ]
        );
        assert_eq!(database.messages[&2_566_844_926].signals[0].kind, Kind::Float);
    }

    #[test]
    fn a_group_of_j1939_comes_from_any_source() {
        let mut database = Database::default();
        database.add(TEXT);
        // 0x18fef1fe in the database; another priority and the source 0x21 in the frame.
        let found = database.message(0x0cfe_f121 | EXTENDED).map(|(id, message)| (id, &*message.name));
        assert_eq!(2_566_844_926_u32, 0x18fe_f1fe | EXTENDED);
        assert_eq!(found, Some((2_566_844_926, "Group")));
        assert!(database.message(0x0cfe_f221 | EXTENDED).is_none());
        assert!(database.message(100 | EXTENDED).is_none());
    }

    #[test]
    fn long_names_replace_short_ones() {
        let mut database = Database::default();
        let text = "BA_ \"SystemMessageLongSymbol\" BO_ 100 \"EngineOfTheFirstVehicle\";\n\
                    BA_ \"SystemSignalLongSymbol\" SG_ 100 Deep \"DeepBelowTheWaterline\";\n";
        assert_eq!(database.add(&TEXT.replace("SIG_VALTYPE_ 2", &format!("{text}SIG_VALTYPE_ 2"))), []);
        let engine = &database.messages[&100];
        assert_eq!(
            (&*engine.name, &*engine.signals[3].name),
            ("EngineOfTheFirstVehicle", "DeepBelowTheWaterline")
        );
        // Other lines have the short names.
        assert_eq!(engine.signals[4].choice.as_ref().map(|choice| choice.selector), Some(3));
    }

    #[test]
    fn what_cannot_be_understood_is_said_by_line() {
        let mut database = Database::default();
        let problems = database.add("BO_ x y\nBO_ 1 A: 8 X\n SG_ B : 0|65@1+ (1,0) [0|0] \"\" A\n SG_ C : 0|8@1+ (1,0) [0|0] \"\" A\n");
        let problems: Vec<String> =
            problems.into_iter().map(|(line, what)| format!("{line}: {what}")).collect();
        assert_eq!(
            problems,
            [
                "1: a message that cannot be understood; write it like BO_ 100 Name: 8 Sender",
                "3: a signal that cannot be understood"
            ]
        );
        assert_eq!(database.messages[&1].signals.len(), 1);
    }
}
