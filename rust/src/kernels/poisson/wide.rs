//! Wide registers for loops over rows, chosen at run time. No operation is fused or reordered, so the values stay.

/// Runs `work` compiled for the widest registers that the CPU has, as far as it is inlined.
#[allow(unsafe_code)] // measured: masks take a third more time with the baseline instructions
#[inline]
pub(super) fn wide<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the CPU has the feature that the function is compiled for.
            return unsafe { with_avx2(work) };
        }
    }
    work()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2<R>(work: impl FnOnce() -> R) -> R {
    work()
}

/// A function that is compiled for the widest registers too, all of it: closures that are called in two places, as [`wide`]
/// calls them, are seldom inlined.
macro_rules! wide_fn {
    (
        $(#[$doc:meta])*
        $access:vis fn $name:ident $(<const $n:ident: $kind:ty>)? ($($argument:ident: $type:ty),* $(,)?) $body:block
    ) => {
        $(#[$doc])*
        #[allow(unsafe_code)] // measured: see `wide`
        #[inline]
        $access fn $name $(<const $n: $kind>)? ($($argument: $type),*) {
            #[inline(always)]
            fn any $(<const $n: $kind>)? ($($argument: $type),*) $body
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2")]
            fn avx2 $(<const $n: $kind>)? ($($argument: $type),*) {
                any $(::<$n>)? ($($argument),*);
            }
            #[cfg(target_arch = "x86_64")]
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the CPU has the feature that the function is compiled for.
                return unsafe { avx2 $(::<$n>)? ($($argument),*) };
            }
            any $(::<$n>)? ($($argument),*);
        }
    };
}
pub(super) use wide_fn;
