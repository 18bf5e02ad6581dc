//! Decompression: bounded in size; of truncated data the bytes before the end.

#[cfg(all(feature = "ruzstd", not(feature = "zstd")))]
use super::frames::Frames;
use super::store::{Opened, nameless};
use super::utf16::Utf16;
use flate2::bufread::MultiGzDecoder;
use std::io::{self, BufReader, Read, Seek};
#[cfg(feature = "zstd")]
use zstd::zstd_safe::DCtx;

/// The largest piece of a file after decompression, bytes, as a few compressed bytes could fill the memory.
pub(super) const UNPACKED_MAX: u64 = 1 << 26;

/// How many times its own size a file may unpack to, beyond one piece: as much as LZ4 can reach. A few compressed bytes could
/// fill the disk, or keep a reader busy for hours.
const RATIO_MAX: u64 = 255;

/// The largest state of zstd that is kept for the next piece, bytes: with the window of a large piece it is given back.
#[cfg(feature = "zstd")]
const KEPT_MAX: usize = 1 << 20;

/// The name of gzip as a method of [`Unpacker::unpack`].
pub(super) const GZIP: &str = "gzip";

/// What all pieces of one file may unpack to: [`UNPACKED_MAX`], and [`RATIO_MAX`] times the size of the file. Bytes of the file that
/// are read again, because several links lead to them, and what a packed table is expanded to are counted, too.
pub(super) struct Budget {
    most: u64,
    left: u64,
}

impl Budget {
    /// For a file of this many bytes.
    pub(super) fn of(length: u64) -> Budget {
        let most = length.saturating_mul(RATIO_MAX).saturating_add(UNPACKED_MAX);
        Budget { most, left: most }
    }

    /// The bytes that may still be unpacked.
    pub(super) fn left(&self) -> u64 {
        self.left
    }

    /// The bytes that the next piece may unpack to, at most `piece`.
    ///
    /// # Errors
    /// The reason, when nothing more may be unpacked.
    pub(super) fn next(&self, piece: u64) -> Result<u64, String> {
        if self.left == 0 { Err(self.exceeded()) } else { Ok(piece.min(self.left)) }
    }

    /// Takes what a piece unpacks to.
    ///
    /// # Errors
    /// The reason, when the file would unpack to too much with it.
    pub(super) fn take(&mut self, piece: u64) -> Result<(), String> {
        self.left = self.left.checked_sub(piece).ok_or_else(|| self.exceeded())?;
        Ok(())
    }

    /// The reason when there is no more to take.
    pub(super) fn exceeded(&self) -> String {
        let piece = UNPACKED_MAX >> 20;
        format!(
            "the file unpacks to more than {} bytes: {piece} MiB, and {RATIO_MAX} times its size",
            self.most
        )
    }
}

/// How a file is packed as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    Zstd,
    Gzip,
    /// Not packed: text in UTF-16, as spreadsheets write it; it becomes UTF-8. Whether the low byte is the first one.
    Utf16 {
        is_little: bool,
    },
}

impl Packing {
    /// By the first bytes of a file; `None`: it is not packed.
    pub(super) fn of(head: &[u8]) -> Option<Packing> {
        let starts = |magic: &[u8]| head.starts_with(magic);
        if starts(&[0x28, 0xb5, 0x2f, 0xfd]) {
            Some(Packing::Zstd)
        } else {
            let is_gzip = starts(&[0x1f, 0x8b, 8]).then_some(Packing::Gzip);
            let is_text = |mark: &[u8], is_little| starts(mark).then_some(Packing::Utf16 { is_little });
            is_gzip.or_else(|| is_text(&[0xff, 0xfe], true)).or_else(|| is_text(&[0xfe, 0xff], false))
        }
    }

    /// By the ending of a file's name.
    pub(super) fn of_ending(ending: &str) -> Option<Packing> {
        match ending {
            "zstd" | "zst" => Some(Packing::Zstd),
            "gz" => Some(Packing::Gzip),
            _ => None,
        }
    }

    /// The first bytes of a packed file, unpacked: at most `limit`.
    pub(super) fn head(self, packed: &[u8], limit: u64) -> Vec<u8> {
        match self {
            Packing::Zstd => Unpacker::default().unpack("zstd", packed, limit).bytes,
            Packing::Gzip => Unpacker::default().unpack(GZIP, packed, limit).bytes,
            Packing::Utf16 { is_little } => bounded(Utf16::new(packed, is_little), limit, limit).bytes,
        }
    }

    fn decoder(self, packed: Opened) -> io::Result<Box<dyn Read>> {
        match self {
            #[cfg(feature = "zstd")]
            Packing::Zstd => Ok(Box::new(zstd::stream::read::Decoder::new(packed)?)),
            #[cfg(all(feature = "ruzstd", not(feature = "zstd")))]
            Packing::Zstd => Ok(Box::new(Frames::new(BufReader::new(packed)))),
            #[cfg(not(any(feature = "ruzstd", feature = "zstd")))]
            Packing::Zstd => Err(io::Error::other(NO_ZSTD)),
            Packing::Gzip => Ok(Box::new(MultiGzDecoder::new(BufReader::new(packed)))),
            Packing::Utf16 { is_little } => Ok(Box::new(Utf16::new(BufReader::new(packed), is_little))),
        }
    }
}

/// Decompresses a whole file into one without a name, which is removed when it is closed. Also returns what is wrong with a file
/// that is damaged or cut short: it gives the bytes before the damage.
///
/// # Errors
/// Those of the files, and when the content is larger than its [`Budget`].
pub(super) fn file(packed: Opened, packing: Packing) -> io::Result<(Opened, Option<String>)> {
    let budget = Budget::of(packed.size()?);
    let mut unpacked = nameless()?;
    let copied = io::copy(&mut packing.decoder(packed)?.take(budget.most + 1), &mut unpacked);
    let problem = match copied {
        Ok(length) if length > budget.most => {
            let help = "where that is right, unpack it first (zstd -d, gunzip)";
            return Err(io::Error::other(format!("{}; {help}", budget.exceeded())));
        }
        Ok(_) => None,
        Err(error) if error.kind() == io::ErrorKind::StorageFull => return Err(error),
        Err(error) => {
            let length = unpacked.stream_position()?;
            Some(format!("only its first {length} bytes can be unpacked: {error}"))
        }
    };
    unpacked.rewind()?;
    Ok((unpacked, problem))
}

#[cfg(not(any(feature = "ruzstd", feature = "zstd")))]
const NO_ZSTD: &str =
    "packed by zstd, which this program was built without: build it with the feature 'zstd'";

/// The result of a decompression.
pub(super) struct Unpacked {
    /// The bytes; of damaged data those before the damage.
    pub(super) bytes: Vec<u8>,
    /// The problem; `None`: the bytes are complete.
    pub(super) problem: Option<String>,
}

impl Unpacked {
    fn none(problem: String) -> Unpacked {
        Unpacked { bytes: Vec::new(), problem: Some(problem) }
    }
}

/// Decompresses pieces one after the other. The state of zstd is made once: for a short message that costs more than the rest.
#[derive(Default)]
pub(super) struct Unpacker {
    #[cfg(feature = "zstd")]
    zstd: Option<DCtx<'static>>,
}

impl Unpacker {
    /// Decompresses by the method of this name, up to `limit` bytes.
    pub(super) fn unpack(&mut self, method: &str, packed: &[u8], limit: u64) -> Unpacked {
        let expected = expected(packed);
        match method {
            "lz4" => bounded(lz4_flex::frame::FrameDecoder::new(packed), limit, expected),
            "zstd" => self.zstd(packed, limit),
            GZIP => bounded(MultiGzDecoder::new(packed), limit, expected),
            other => Unpacked::none(format!("packed by '{other}', which is not known here")),
        }
    }

    #[cfg(feature = "zstd")]
    fn zstd(&mut self, packed: &[u8], limit: u64) -> Unpacked {
        let Some(mut state) = self.zstd.take().or_else(DCtx::try_create) else {
            return Unpacked::none("there is no memory to unpack it".into());
        };
        let decoder = zstd::stream::read::Decoder::with_context(packed, &mut state);
        let unpacked = bounded(decoder, limit, expected(packed));
        self.zstd = Some(state).filter(|state| state.sizeof() <= KEPT_MAX);
        unpacked
    }

    #[cfg(all(feature = "ruzstd", not(feature = "zstd")))]
    #[allow(clippy::unused_self, reason = "the library in C keeps its state")]
    fn zstd(&mut self, packed: &[u8], limit: u64) -> Unpacked {
        bounded(Frames::new(packed), limit, expected(packed))
    }

    #[cfg(not(any(feature = "ruzstd", feature = "zstd")))]
    #[allow(clippy::unused_self, reason = "with zstd it has state")]
    fn zstd(&mut self, _packed: &[u8], _limit: u64) -> Unpacked {
        Unpacked::none(NO_ZSTD.into())
    }
}

/// How many bytes these may be unpacked, where the stated number of them is right.
fn expected(packed: &[u8]) -> u64 {
    packed.len() as u64 * 16
}

/// How many bytes are expected at once, at most, of what may be unpacked.
const EXPECTED_MAX: u64 = 1 << 20;

/// Unpacks up to `limit` bytes; `expected` are likely.
fn bounded(unpacked: impl Read, limit: u64, expected: u64) -> Unpacked {
    let expected = expected.min(limit).min(EXPECTED_MAX);
    let mut bytes = Vec::with_capacity(usize::try_from(expected).unwrap_or(0));
    // One byte more: the decompressors compare checksums only when the end is read, and a further byte shows that there is more.
    let done = unpacked.take(limit.saturating_add(1)).read_to_end(&mut bytes);
    let problem = match done {
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
            Some(format!("cut short: {} bytes can be unpacked", bytes.len()))
        }
        Err(error) => Some(error.to_string()),
        Ok(_) if bytes.len() as u64 > limit => {
            bytes.truncate(usize::try_from(limit).unwrap_or(usize::MAX));
            Some(format!("unpacks to more than {limit} bytes"))
        }
        Ok(_) => None,
    };
    Unpacked { bytes, problem }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_unpacks_to_so_much_and_no_more() {
        let mut budget = Budget::of(1_000);
        assert_eq!(budget.take(UNPACKED_MAX), Ok(()));
        assert_eq!(budget.left(), 255_000);
        assert!(
            budget.take(255_001).unwrap_err().contains("more than 67363864 bytes: 64 MiB, and 255 times")
        );
        assert_eq!(budget.next(300_000), Ok(255_000));
        assert_eq!(budget.take(255_000), Ok(()));
        assert!(budget.next(1).is_err());
    }
}
