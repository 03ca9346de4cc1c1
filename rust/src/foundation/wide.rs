//! Wide registers, chosen at run time: the only file that names pulp. No operation is fused or reordered, so the values
//! are those of plain code.

#[cfg(target_arch = "x86_64")]
pub(crate) use pulp::{cast, x86::V3};

/// Runs `work` compiled for the widest registers that the CPU has, as far as it is inlined: the closure and what it calls
/// should be `#[inline(always)]`.
#[inline(always)]
pub(crate) fn wide<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}

/// A function whose body is compiled for the widest registers. Its arguments stay arguments, so the compiler knows that
/// slices do not overlap.
macro_rules! wide_fn {
    (
        $(#[$attribute:meta])*
        $access:vis fn $name:ident $(<const $n:ident: $kind:ty>)? ($($argument:ident: $type:ty),* $(,)?)
        $(-> $out:ty)? $body:block
    ) => {
        $(#[$attribute])*
        $access fn $name $(<const $n: $kind>)? ($($argument: $type),*) $(-> $out)? {
            #[inline(always)]
            fn body $(<const $n: $kind>)? ($($argument: $type),*) $(-> $out)? $body
            $crate::foundation::wide::wide(#[inline(always)] || body $(::<$n>)? ($($argument),*))
        }
    };
}
pub(crate) use wide_fn;
