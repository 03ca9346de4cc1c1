//! A SIMD number type: several f32 values that behave as one number. A transform of one line of
//! this type transforms several lines at once, in the registers that every machine has. Each line
//! gets the same values as if transformed alone.

use std::ops::{Add, Div, Mul, Neg, Rem, Sub};

use rustfft::num_traits::{FromPrimitive, Num, One, Signed, Zero};

use crate::foundation::simd::{add_four, multiply_four, subtract_four};

/// Number of values in [`Lanes`].
pub(crate) const LANES: usize = 4;

/// One value for each of [`LANES`] lines.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(align(16))]
pub(crate) struct Lanes(pub(crate) [f32; LANES]);

impl Lanes {
    /// Returns the same number in all lanes.
    #[inline(always)]
    pub(crate) fn all(x: f32) -> Self {
        Self([x; LANES])
    }

    #[inline(always)]
    fn map(self, operation: impl Fn(f32) -> f32) -> Self {
        Self(self.0.map(operation))
    }
}

macro_rules! operations {
    ($($name:ident $method:ident $of:expr),*) => {$(
        impl $name for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self($of(self.0, other.0))
            }
        }
    )*};
}
operations!(Add add add_four, Sub sub subtract_four, Mul mul multiply_four, Div div each(Div::div), Rem rem each(Rem::rem));

/// Returns a function that applies an operation to each pair of numbers.
fn each(
    operation: impl Fn(f32, f32) -> f32,
) -> impl Fn([f32; LANES], [f32; LANES]) -> [f32; LANES] {
    move |a, b| std::array::from_fn(|k| operation(a[k], b[k]))
}

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(Neg::neg)
    }
}

impl Zero for Lanes {
    fn zero() -> Self {
        Self::default()
    }
    fn is_zero(&self) -> bool {
        *self == Self::default()
    }
}

impl One for Lanes {
    fn one() -> Self {
        Self::all(1.0)
    }
}

impl Num for Lanes {
    type FromStrRadixErr = <f32 as Num>::FromStrRadixErr;
    fn from_str_radix(text: &str, radix: u32) -> Result<Self, Self::FromStrRadixErr> {
        f32::from_str_radix(text, radix).map(Self::all)
    }
}

impl Signed for Lanes {
    fn abs(&self) -> Self {
        self.map(f32::abs)
    }
    fn abs_sub(&self, other: &Self) -> Self {
        Self(each(|a, b| (a - b).max(0.0))(self.0, other.0))
    }
    fn signum(&self) -> Self {
        self.map(f32::signum)
    }
    fn is_positive(&self) -> bool {
        self.0.iter().all(|x| x.is_sign_positive())
    }
    fn is_negative(&self) -> bool {
        self.0.iter().all(|x| x.is_sign_negative())
    }
}

impl FromPrimitive for Lanes {
    fn from_i64(n: i64) -> Option<Self> {
        Some(Self::all(n as f32))
    }
    fn from_u64(n: u64) -> Option<Self> {
        Some(Self::all(n as f32))
    }
    fn from_f32(x: f32) -> Option<Self> {
        Some(Self::all(x))
    }
    fn from_f64(x: f64) -> Option<Self> {
        Some(Self::all(x as f32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::foundation::fft::{Complex, Lines};
    use crate::foundation::hash::Noise;

    #[test]
    fn each_of_several_lines_is_transformed_as_it_is_alone() {
        let noise = Noise::new(7);
        // The lengths cover all kinds of plans: radix 4, mixed, small primes, Rader's and
        // Bluestein's.
        for len in [1, 2, 8, 30, 31, 60, 83, 101, 256, 509, 1021, 1023, 1999] {
            let sample = |line: usize, k: usize, part: u32| {
                noise.uniform([line as u32, k as u32, part, 0]) as f32 - 0.5
            };
            let mut together: Vec<Complex<Lanes>> = (0..len)
                .map(|k| {
                    let part = |p| Lanes(std::array::from_fn(|line| sample(line, k, p)));
                    Complex::new(part(0), part(1))
                })
                .collect();
            Lines::new(len).forward(&mut together, &mut Vec::new());
            for line in 0..LANES {
                let mut alone: Vec<Complex<f32>> = (0..len)
                    .map(|k| Complex::new(sample(line, k, 0), sample(line, k, 1)))
                    .collect();
                Lines::new(len).forward(&mut alone, &mut Vec::new());
                for (a, b) in alone.iter().zip(&together) {
                    assert_eq!(a.re.to_bits(), b.re.0[line].to_bits(), "{len}");
                    assert_eq!(a.im.to_bits(), b.im.0[line].to_bits(), "{len}");
                }
            }
        }
    }
}
