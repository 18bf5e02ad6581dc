//! Sums over all particles, in parts that become vector instructions.

/// The sum of `one * (other - about)`, in eight independent parts.
pub(super) fn sum_of_products(one: &[f64], other: &[f64], about: f64) -> f64 {
    let ((one, one_rest), (other, other_rest)) = (one.as_chunks::<8>(), other.as_chunks::<8>());
    let mut parts = [0.0; 8];
    for (one, other) in one.iter().zip(other) {
        for (part, (one, other)) in parts.iter_mut().zip(one.iter().zip(other)) {
            *part += one * (other - about);
        }
    }
    let rest = one_rest.iter().zip(other_rest).map(|(one, other)| one * (other - about));
    parts.into_iter().chain(rest).sum()
}

/// The largest number, in eight parts; none of the numbers is not-a-number.
pub(super) fn greatest(numbers: &[f64]) -> f64 {
    let greater = |one: f64, other: f64| if one > other { one } else { other };
    let (chunks, rest) = numbers.as_chunks::<8>();
    let mut parts = [f64::NEG_INFINITY; 8];
    for chunk in chunks {
        parts.iter_mut().zip(chunk).for_each(|(part, number)| *part = greater(*number, *part));
    }
    parts.into_iter().chain(rest.iter().copied()).fold(f64::NEG_INFINITY, greater)
}

/// `to += factor * from^2`, element by element.
pub(super) fn add_squares(to: &mut [f64], factor: f64, from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from * from);
}
