//! Functions whose values are the same on every machine: those of the standard library are the system's, which chooses its
//! code by what the processor can do, and rounds another way in each. The only file that names libm.

pub(crate) use libm::{exp, sincos};

/// The root of a positive number: of an area in two dimensions, of a volume in three.
pub(crate) fn root<const D: usize>(x: f64) -> f64 {
    if D == 2 { x.sqrt() } else { libm::cbrt(x) }
}

/// The largest power of two that is at most a positive normal number.
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
