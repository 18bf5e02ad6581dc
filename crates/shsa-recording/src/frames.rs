//! What zstd has packed, unpacked without a library in C: one frame after the other, each with its checksum compared.

use ruzstd::decoding::errors::{FrameDecoderError, ReadFrameHeaderError};
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};
use std::io::{self, BufRead, Read};

/// The unpacked bytes of all frames.
pub(super) struct Frames<R> {
    packed: Watched<R>,
    decoder: FrameDecoder,
    is_within: bool,
}

impl<R: BufRead> Frames<R> {
    pub(super) fn new(packed: R) -> Frames<R> {
        Frames { packed: Watched { packed, is_over: false }, decoder: FrameDecoder::new(), is_within: false }
    }

    /// Begins the next frame, and passes over those without content. Returns whether there is one.
    fn begin(&mut self) -> io::Result<bool> {
        while !self.packed.packed.fill_buf()?.is_empty() {
            match self.decoder.reset(&mut self.packed) {
                Ok(()) => {
                    self.is_within = true;
                    return Ok(true);
                }
                Err(FrameDecoderError::ReadFrameHeaderError(ReadFrameHeaderError::SkipFrame {
                    length,
                    ..
                })) => {
                    let skipped = (&mut self.packed).take(u64::from(length));
                    io::copy(&mut { skipped }, &mut io::sink())?;
                }
                Err(error) => return Err(self.packed.failed(error)),
            }
        }
        Ok(false)
    }

    /// Compares the checksum of a frame that is over.
    fn end(&mut self) -> io::Result<()> {
        self.is_within = false;
        let (stated, found) = (self.decoder.get_checksum_from_data(), self.decoder.get_calculated_checksum());
        match stated.is_some() && stated != found {
            true => Err(io::Error::other("the checksum does not match the data")),
            false => Ok(()),
        }
    }
}

impl<R: BufRead> Read for Frames<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        while !into.is_empty() && (self.is_within || self.begin()?) {
            while self.decoder.can_collect() == 0 && !self.decoder.is_finished() {
                let decoded =
                    self.decoder.decode_blocks(&mut self.packed, BlockDecodingStrategy::UptoBlocks(1));
                decoded.map_err(|error| self.packed.failed(error))?;
            }
            let count = self.decoder.read(into)?;
            if count > 0 {
                return Ok(count);
            }
            self.end()?;
        }
        Ok(0)
    }
}

/// Packed bytes, and whether more of them were wanted than there are.
struct Watched<R> {
    packed: R,
    is_over: bool,
}

impl<R> Watched<R> {
    fn failed(&self, error: FrameDecoderError) -> io::Error {
        match self.is_over {
            true => io::Error::new(io::ErrorKind::UnexpectedEof, error),
            false => io::Error::other(error),
        }
    }
}

impl<R: Read> Read for Watched<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.packed.read(into)?;
        self.is_over |= count == 0 && !into.is_empty();
        Ok(count)
    }
}
