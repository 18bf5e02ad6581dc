//! How many values of one file are taken: a few bytes may be packed rows without end.

use super::RawValue;

/// The values that are taken of any file.
const BASE: u64 = 1 << 15;

/// The further values for each byte of the file on disk. Packed by zstd, a table of twenty cells of a battery at rest, a row each
/// tenth of a second, has 13 values a byte; sixty-four flags of a packed CAN frame are about five.
const PER_BYTE: u64 = 20;

/// How many numbers a value counts for: each one of a list.
pub(super) fn numbers(value: &RawValue) -> usize {
    match value {
        RawValue::Vector(list) => list.len().max(1),
        _ => 1,
    }
}

/// The values that may still be taken of a file.
#[derive(Default)]
pub(super) struct Room {
    length: u64,
    left: u64,
    /// How many values were left out.
    over: u64,
}

impl Room {
    /// For a file of this many bytes.
    pub(super) fn of(length: u64) -> Room {
        Room { length, left: length.saturating_mul(PER_BYTE).saturating_add(BASE), over: 0 }
    }

    /// Whether this value is taken; each number of a list counts.
    pub(super) fn take(&mut self, value: &RawValue) -> bool {
        let is_taken = self.take_all(numbers(value));
        self.over += u64::from(!is_taken);
        is_taken
    }

    /// Takes so many numbers; returns false where not all of them are taken: then none is.
    pub(super) fn take_all(&mut self, numbers: usize) -> bool {
        let left = self.left.checked_sub(numbers as u64);
        self.left = left.unwrap_or(self.left);
        left.is_some()
    }

    /// What was left out, if anything.
    pub(super) fn problem(&self) -> Option<String> {
        let Room { length, over, .. } = *self;
        let most = Room::of(length).left;
        (over > 0).then(|| {
            format!(
                "{over} values are left out: of a file of {length} bytes, {most} numbers are taken; where all of them are \
                 right, unpack the file first"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn so_many_numbers_are_taken_and_no_more() {
        let mut room = Room::of(10);
        let number = RawValue::Number(1.0);
        assert!((0..BASE + 199).all(|_| room.take(&number)));
        assert!(!room.take(&RawValue::Vector(vec![1.0, 2.0])));
        assert_eq!((room.problem().is_some(), room.take(&number), room.take(&number)), (true, true, false));
        let problem = "2 values are left out: of a file of 10 bytes, 32968 numbers are taken; where all of them are \
                       right, unpack the file first";
        assert_eq!(room.problem().as_deref(), Some(problem));
    }
}
