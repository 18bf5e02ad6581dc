//! Units: SI exponents with scale and offset, as values.
