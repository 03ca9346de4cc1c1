//! Wide registers, chosen at run time: the only file that names pulp, and the only one with unsafe code. No operation is
//! fused or reordered, so the values are those of plain code.

#[cfg(target_arch = "x86_64")]
pub(crate) use pulp::{cast, x86::V3};

/// Runs `work` compiled for the widest registers that the CPU has, as far as it is inlined: the closure and what it calls
/// should be `#[inline(always)]`.
#[allow(unsafe_code)] // behind the question whether the CPU has the feature
#[inline]
pub(crate) fn wide<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
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

/// A function whose body is compiled for the widest registers. Its arguments stay arguments, so the compiler knows that
/// slices do not overlap: measured, rows take a quarter less time than in a closure.
macro_rules! wide_fn {
    (
        $(#[$attribute:meta])*
        $access:vis fn $name:ident $(<const $n:ident: $kind:ty>)? ($($argument:ident: $type:ty),* $(,)?)
        $(-> $out:ty)? $body:block
    ) => {
        $(#[$attribute])*
        #[allow(unsafe_code)] // behind the question whether the CPU has the feature
        #[inline]
        $access fn $name $(<const $n: $kind>)? ($($argument: $type),*) $(-> $out)? {
            #[inline(always)]
            fn any $(<const $n: $kind>)? ($($argument: $type),*) $(-> $out)? $body
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2")]
            fn avx2 $(<const $n: $kind>)? ($($argument: $type),*) $(-> $out)? {
                any $(::<$n>)? ($($argument),*)
            }
            #[cfg(target_arch = "x86_64")]
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the CPU has the feature that the function is compiled for.
                return unsafe { avx2 $(::<$n>)? ($($argument),*) };
            }
            any $(::<$n>)? ($($argument),*)
        }
    };
}
pub(crate) use wide_fn;
