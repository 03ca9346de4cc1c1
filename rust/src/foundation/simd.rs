//! SIMD code, chosen at run time. Only this file uses pulp, and only this file contains unsafe
//! code. No operation is fused or reordered, so the values equal those of plain code.

#[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
pub(crate) use pulp::{cast, x86::V3};

/// Runs `work` compiled for AVX2 if the CPU supports it. Only inlined code is compiled for AVX2, so
/// the closure and the functions that it calls should be `#[inline(always)]`.
#[allow(unsafe_code)] // called only if the CPU has the feature
#[inline]
pub(crate) fn wide<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
    {
        #[target_feature(enable = "avx2")]
        #[inline]
        fn avx2<R>(work: impl FnOnce() -> R) -> R {
            work()
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the CPU has the feature that the function is compiled for.
            return unsafe { avx2(work) };
        }
    }
    work()
}

/// Defines a function whose body is compiled for AVX2 and for the baseline, and chosen at run time.
///
/// Its arguments remain function arguments, so the compiler can assume that slices do not overlap.
/// As measured, loops over rows then take 25 % less time than in a closure.
macro_rules! wide_fn {
    (
        $(#[$attribute:meta])*
        $access:vis fn $name:ident $(<const $n:ident: $kind:ty>)? ($($argument:ident: $type:ty),* $(,)?)
        $(-> $out:ty)? $body:block
    ) => {
        $(#[$attribute])*
        #[allow(unsafe_code)] // called only if the CPU has the feature
        #[inline]
        $access fn $name $(<const $n: $kind>)? ($($argument: $type),*) $(-> $out)? {
            #[inline(always)]
            fn any $(<const $n: $kind>)? ($($argument: $type),*) $(-> $out)? $body
            #[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
            #[target_feature(enable = "avx2")]
            fn avx2 $(<const $n: $kind>)? ($($argument: $type),*) $(-> $out)? {
                any $(::<$n>)? ($($argument),*)
            }
            #[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the CPU has the feature that the function is compiled for.
                return unsafe { avx2 $(::<$n>)? ($($argument),*) };
            }
            any $(::<$n>)? ($($argument),*)
        }
    };
}
pub(crate) use wide_fn;

/// Defines a function like [`wide_fn`], also compiled for AVX-512, for kernels that work on columns
/// of f64.
///
/// The constant parameter is the number of rows that two registers hold. It may affect only the
/// time, not the result.
macro_rules! widest_fn {
    (
        $(#[$attribute:meta])*
        $access:vis fn $name:ident <const $rows:ident: usize> ($($argument:ident: $type:ty),* $(,)?)
        $(-> $out:ty)? $body:block
    ) => {
        $(#[$attribute])*
        #[allow(unsafe_code)] // called only if the CPU has the feature
        #[inline]
        $access fn $name($($argument: $type),*) $(-> $out)? {
            #[inline(always)]
            fn any<const $rows: usize>($($argument: $type),*) $(-> $out)? $body
            #[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
            {
                #[target_feature(enable = "avx512f")]
                fn avx512($($argument: $type),*) $(-> $out)? {
                    any::<16>($($argument),*)
                }
                #[target_feature(enable = "avx2")]
                fn avx2($($argument: $type),*) $(-> $out)? {
                    any::<8>($($argument),*)
                }
                if is_x86_feature_detected!("avx512f") {
                    // SAFETY: the CPU has the feature that the function is compiled for.
                    return unsafe { avx512($($argument),*) };
                }
                if is_x86_feature_detected!("avx2") {
                    // SAFETY: the CPU has the feature that the function is compiled for.
                    return unsafe { avx2($($argument),*) };
                }
            }
            any::<4>($($argument),*)
        }
    };
}
pub(crate) use widest_fn;

macro_rules! four {
    ($($name:ident $instruction:ident $operator:tt),*) => {$(
        /// Applies the operator to four pairs of numbers by one instruction, which all x86-64
        /// processors have. Otherwise the compiler often computes the pairs one by one in functions
        /// with more values than registers.
        #[allow(unsafe_code)] // reinterprets arrays as registers
        #[inline(always)]
        pub(crate) fn $name(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
            #[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
            {
                use std::arch::x86_64::{__m128, $instruction};
                use std::mem::transmute;
                // SAFETY: arrays and registers both have 16 bytes, and all bit patterns are valid
                // numbers. All x86-64 processors have these instructions.
                unsafe {
                    let [a, b] = [a, b].map(|x| transmute::<[f32; 4], __m128>(x));
                    transmute::<__m128, [f32; 4]>($instruction(a, b))
                }
            }
            #[cfg(any(not(target_arch = "x86_64"), feature = "portable"))]
            std::array::from_fn(|k| a[k] $operator b[k])
        }
    )*};
}
four!(add_four _mm_add_ps +, subtract_four _mm_sub_ps -, multiply_four _mm_mul_ps *);

/// Returns the squared differences of eight numbers, added in pairs. Numbers of twelve bits do not
/// overflow.
///
/// One instruction, which all x86-64 processors have, multiplies and adds. The compiler does not
/// use it for plain code, and needs four times as many instructions.
#[allow(unsafe_code)] // reinterprets arrays as registers
#[inline(always)]
pub(crate) fn square_apart(a: &[i16; 8], b: &[i16; 8]) -> [i32; 4] {
    #[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
    {
        use std::arch::x86_64::{__m128i, _mm_madd_epi16, _mm_sub_epi16};
        use std::mem::transmute;
        // SAFETY: arrays and registers both have 16 bytes, and all bit patterns are valid numbers.
        // All x86-64 processors have these instructions.
        unsafe {
            let d = _mm_sub_epi16(
                transmute::<[i16; 8], __m128i>(*a),
                transmute::<[i16; 8], __m128i>(*b),
            );
            transmute::<__m128i, [i32; 4]>(_mm_madd_epi16(d, d))
        }
    }
    #[cfg(any(not(target_arch = "x86_64"), feature = "portable"))]
    std::array::from_fn(|pair| {
        let square = |k: usize| i32::from(a[k].wrapping_sub(b[k])).pow(2);
        square(2 * pair) + square(2 * pair + 1)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[inline(always)]
    fn scale(values: &mut [f32], by: f32) -> f32 {
        // The factor is not a power of two and there are many values, so a fused or reordered
        // operation would round differently.
        values.iter_mut().fold(0.1, |sum, value| {
            *value = *value * by + 0.3;
            sum + *value
        })
    }

    wide_fn! {
        fn scale_wide<const N: usize>(values: &mut [f32], by: f32) -> f32 {
            scale(&mut values[..N], by)
        }
    }

    #[test]
    fn wide_code_gives_what_plain_code_gives() {
        let start: Vec<f32> = (0..67).map(|i| (i as f32).sin()).collect();
        let [mut plain, mut closed, mut called] = [(); 3].map(|()| start.clone());
        let sum = scale(&mut plain, 1.7);
        let within = wide(
            #[inline(always)]
            || scale(&mut closed, 1.7),
        );
        let without = scale_wide::<67>(&mut called, 1.7);
        assert_eq!([within.to_bits(), without.to_bits()], [sum.to_bits(); 2]);
        assert_eq!((&closed, &called), (&plain, &plain));
    }

    widest_fn! {
        fn scale_by_rows<const ROWS: usize>(values: &mut [f32], by: f32) -> (f32, usize) {
            (scale(values, by), ROWS)
        }
    }

    #[test]
    fn the_widest_code_gives_what_plain_code_gives() {
        let start: Vec<f32> = (0..67).map(|i| (i as f32).sin()).collect();
        let [mut plain, mut called] = [(); 2].map(|()| start.clone());
        let sum = scale(&mut plain, 1.7);
        let (found, rows) = scale_by_rows(&mut called, 1.7);
        assert_eq!((found.to_bits(), &called), (sum.to_bits(), &plain));
        assert!([4, 8, 16].contains(&rows));
    }

    #[test]
    fn pairs_of_squares_are_those_of_plain_code() {
        let a = [2047, -2047, 0, 1, -1, 300, -1234, 2047];
        let b = [-2047, 2047, 0, -1, 2046, 299, 1234, 2047];
        let square = |k: usize| (i32::from(a[k]) - i32::from(b[k])).pow(2);
        let plain = [0, 2, 4, 6].map(|k| square(k) + square(k + 1));
        assert_eq!(square_apart(&a, &b), plain);
    }

    #[test]
    fn a_panic_passes_through() {
        let caught = std::panic::catch_unwind(|| scale_wide::<9>(&mut [0.0; 8], 1.0));
        assert!(caught.is_err());
        assert!(std::panic::catch_unwind(|| wide(|| panic!("inside"))).is_err());
    }
}
