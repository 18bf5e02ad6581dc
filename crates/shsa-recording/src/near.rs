//! Reading a file at many places: a seek to near the last place keeps what was read ahead.

use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};

/// How much is read ahead, bytes: several pages of a database, or blocks of a measurement file.
const AHEAD: usize = 1 << 16;

/// A buffered file. A seek of [`BufReader`] always drops the buffer, although formats of linked blocks mostly go on nearby.
pub(super) struct NearReader<R> {
    input: BufReader<R>,
    position: u64,
}

impl<R: Read + Seek> NearReader<R> {
    /// Begins at the first byte, where the input must be.
    pub(super) fn new(input: R) -> NearReader<R> {
        NearReader { input: BufReader::with_capacity(AHEAD, input), position: 0 }
    }
}

impl<R: Read> Read for NearReader<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let length = self.input.read(bytes)?;
        self.position += length as u64;
        Ok(length)
    }
}

impl<R: Read> BufRead for NearReader<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.input.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        // More than there is cannot be consumed.
        self.position += amount.min(self.input.buffer().len()) as u64;
        self.input.consume(amount);
    }
}

impl<R: Read + Seek> Seek for NearReader<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let near = match to {
            SeekFrom::Start(at) => at.checked_signed_diff(self.position),
            SeekFrom::Current(by) => Some(by),
            SeekFrom::End(_) => None,
        };
        self.position = match near.and_then(|by| Some((by, self.position.checked_add_signed(by)?))) {
            Some((by, at)) => {
                self.input.seek_relative(by)?;
                at
            }
            None => self.input.seek(to)?,
        };
        Ok(self.position)
    }

    fn stream_position(&mut self) -> io::Result<u64> {
        Ok(self.position)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::io::Cursor;

    /// Counts the calls of an input.
    struct Counted(Cursor<Vec<u8>>, usize);

    impl Read for Counted {
        fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            self.1 += 1;
            self.0.read(bytes)
        }
    }

    impl Seek for Counted {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.1 += 1;
            self.0.seek(to)
        }
    }

    #[test]
    fn nearby_places_are_read_once() {
        let bytes: Vec<u8> = (0..=255).cycle().take(50_000).collect();
        let mut near = NearReader::new(Counted(Cursor::new(bytes), 0));
        for at in [100_u64, 40_000, 101, 49_999] {
            let mut byte = [0];
            near.seek(SeekFrom::Start(at)).unwrap();
            near.read_exact(&mut byte).unwrap();
            assert_eq!(u64::from(byte[0]), at % 256);
        }
        // One seek and one read.
        assert_eq!(near.input.get_ref().1, 2);
    }

    proptest! {
        #[test]
        fn any_order_of_places_reads_as_without_a_buffer(
            places in prop::collection::vec((0_u8..3, 0_u64..200_000, 0_usize..3_000), 1..40),
        ) {
            let bytes: Vec<u8> = (0..150_000_u32).map(|at| (at % 251) as u8).collect();
            let mut plain = Cursor::new(bytes.clone());
            let mut near = NearReader::new(Cursor::new(bytes));
            for (kind, at, length) in places {
                let to = match kind {
                    0 => SeekFrom::Start(at),
                    1 => SeekFrom::Current(at as i64 - 100_000),
                    _ => SeekFrom::End(-((at % 150_000) as i64)),
                };
                let (one, other) = (plain.seek(to), near.seek(to));
                prop_assert_eq!(one.as_ref().ok(), other.as_ref().ok());
                let mut read = [vec![0; length], vec![0; length]];
                let [one, other] = &mut read;
                let whole = plain.by_ref().take(length as u64).read(one).unwrap();
                let mut count = 0;
                while count < whole {
                    count += near.read(&mut other[count..whole]).unwrap();
                }
                prop_assert_eq!(&read[0], &read[1]);
                prop_assert_eq!(plain.position(), near.stream_position().unwrap());
            }
        }
    }
}
