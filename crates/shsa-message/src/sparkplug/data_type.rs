//! The data types of metrics.

/// The number of a data type (6.4.16).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DataType(pub u32);

impl DataType {
    /// A signed whole number of 8 bits; those of 16, 32 and 64 bits follow.
    pub const INT8: DataType = DataType(1);
    /// A signed whole number of 16 bits.
    pub const INT16: DataType = DataType(2);
    /// A signed whole number of 32 bits.
    pub const INT32: DataType = DataType(3);
    /// A signed whole number of 64 bits.
    pub const INT64: DataType = DataType(4);
    /// An unsigned whole number of 64 bits.
    pub const UINT64: DataType = DataType(8);
    /// A number of 64 bits.
    pub const DOUBLE: DataType = DataType(10);
    /// A truth value.
    pub const BOOLEAN: DataType = DataType(11);
    /// A text.
    pub const STRING: DataType = DataType(12);
    /// Numbers of 64 bits.
    pub const DOUBLE_ARRAY: DataType = DataType(31);
    const INT8_ARRAY: u32 = 22;
    const BOOLEAN_ARRAY: u32 = 32;
    const DATE_TIME_ARRAY: u32 = 34;

    /// Whether the bits of a whole number alone do not give its value.
    #[must_use]
    pub fn is_signed(self) -> bool {
        (DataType::INT8.0..=DataType::INT64.0).contains(&self.0)
    }

    /// The value of a whole number with these bits.
    pub(super) fn whole(self, bits: u64) -> f64 {
        match self {
            DataType::INT8 => f64::from(bits as i8),
            DataType::INT16 => f64::from(bits as i16),
            DataType::INT32 => f64::from(bits as i32),
            DataType::INT64 => bits as i64 as f64,
            _ => bits as f64,
        }
    }

    /// The elements of an array; `None` for other types, or where the bytes end within an element.
    pub(super) fn elements(self, bytes: &[u8]) -> Option<Vec<f64>> {
        match self.0 {
            DataType::INT8_ARRAY => Some(bytes.iter().map(|byte| f64::from(*byte as i8)).collect()),
            23 => each(bytes, |it| f64::from(i16::from_le_bytes(it))),
            24 => each(bytes, |it| f64::from(i32::from_le_bytes(it))),
            25 => each(bytes, |it| i64::from_le_bytes(it) as f64),
            26 => Some(bytes.iter().map(|byte| f64::from(*byte)).collect()),
            27 => each(bytes, |it| f64::from(u16::from_le_bytes(it))),
            28 => each(bytes, |it| f64::from(u32::from_le_bytes(it))),
            29 | DataType::DATE_TIME_ARRAY => each(bytes, |it| u64::from_le_bytes(it) as f64),
            30 => each(bytes, |it| f64::from(f32::from_le_bytes(it))),
            31 => each(bytes, f64::from_le_bytes),
            DataType::BOOLEAN_ARRAY => truths(bytes),
            _ => None,
        }
    }
}

fn each<const SIZE: usize>(bytes: &[u8], number: impl Fn([u8; SIZE]) -> f64) -> Option<Vec<f64>> {
    let (elements, rest) = bytes.as_chunks::<SIZE>();
    rest.is_empty().then(|| elements.iter().map(|element| number(*element)).collect())
}

/// The elements of an array of truth values: their number in 4 bytes, then a bit for each, the highest first.
fn truths(bytes: &[u8]) -> Option<Vec<f64>> {
    let (count, bits) = bytes.split_first_chunk::<4>()?;
    let count = usize::try_from(u32::from_le_bytes(*count)).ok()?;
    let all = bits.iter().flat_map(|byte| (0..8).map(move |at| f64::from(byte >> (7 - at) & 1)));
    (count <= bits.len() * 8).then(|| all.take(count).collect())
}
