//! Functions with the same values on every machine.
//!
//! The standard library calls the system's functions, whose code and rounding depend on the
//! processor. Only this file uses libm.

pub(crate) use ::libm::{exp, pow, sincos};

/// Returns the D-th root of a positive number: the side of a square of area `x`, or of a cube of
/// volume `x`.
pub(crate) fn root<const D: usize>(x: f64) -> f64 {
    if D == 2 { x.sqrt() } else { ::libm::cbrt(x) }
}

/// Returns the largest power of two that is at most `x`, a positive normal number.
pub(crate) fn power_below(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & (0x7ff << 52))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_those_of_logarithms() {
        for x in [
            1e-300f64, 0.1, 0.5, 0.75, 1.0, 1.5, 2.0, 3.9, 4.0, 1e9, 1e300,
        ] {
            assert_eq!(power_below(x), x.log2().floor().exp2(), "{x}");
        }
    }

    #[test]
    fn roots_multiply_to_what_they_are_of() {
        for x in [1e-6f64, 0.3, 1.0, 8.0, 1e6] {
            assert!((root::<2>(x).powi(2) / x - 1.0).abs() < 1e-15);
            assert!((root::<3>(x).powi(3) / x - 1.0).abs() < 1e-15);
        }
    }
}
