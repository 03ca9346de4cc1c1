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
