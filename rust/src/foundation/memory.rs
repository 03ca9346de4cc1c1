//! Allocation of memory whose size depends on the caller's arguments. A shortage is returned as an
//! error and does not abort the process.

use crate::{Error, Result};

/// Returns `len` copies of `value`. `what` names the memory in the error.
pub(crate) fn filled<T: Clone>(what: &str, value: T, len: usize) -> Result<Vec<T>> {
    check::<T>(what, len)?;
    // Allocate again instead of filling the reserved memory: `vec!` gets zeroed pages from the
    // system, so zeros are not written twice.
    Ok(vec![value; len])
}

/// Returns a copy of an array that belongs to the Python caller. `what` names it in the error.
#[cfg(feature = "python")]
pub(crate) fn copied<T: Copy>(what: &str, values: &[T]) -> Result<Vec<T>> {
    check::<T>(what, values.len())?;
    Ok(values.to_vec())
}

/// Returns an error if memory for `len` values is not available.
pub(crate) fn check<T>(what: &str, len: usize) -> Result<()> {
    Vec::<T>::new()
        .try_reserve_exact(len)
        .map_err(|_| too_little::<T>(what, len))
}

fn too_little<T>(what: &str, len: usize) -> Error {
    Error::Limit {
        what: what.into(),
        needed: format!("{} bytes", len as u128 * size_of::<T>() as u128),
        limit: "the available memory".into(),
    }
}

/// Reserves room for `more` values after the existing ones.
pub(crate) fn reserve<T>(what: &str, values: &mut Vec<T>, more: usize) -> Result<()> {
    let len = values.len();
    values
        .try_reserve(more)
        .map_err(|_| too_little::<T>(what, len.saturating_add(more)))
}

/// Requests below this number of bytes are not checked: a process that lacks 1 MiB cannot continue
/// anyway.
const LITTLE: usize = 1 << 20;

/// Returns an error if the memory of a kernel is not available: `each` bytes for each of `count`
/// elements.
///
/// The whole amount is allocated at once and freed before any work. The kernel's separate
/// allocations, some of them in other crates, would each abort the process if they failed. `each`
/// is measured (`tests/test_kernels_memory.py` limits each kernel).
pub(crate) fn room(what: &str, count: usize, each: usize) -> Result<()> {
    match count.saturating_mul(each) {
        0..LITTLE => Ok(()),
        bytes => check::<u8>(what, bytes),
    }
}

/// Returns the product of sizes, or an error if it overflows.
pub(crate) fn product(what: &'static str, sizes: &[usize]) -> Result<usize> {
    let all = sizes
        .iter()
        .try_fold(1usize, |n, &size| n.checked_mul(size));
    all.ok_or_else(|| {
        Error::value(
            what,
            format!("the product of {sizes:?} must fit into 64 bits"),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_an_error() {
        assert_eq!(filled("numbers", 7u8, 3).unwrap(), [7; 3]);
        for len in [usize::MAX, usize::MAX / 8, 1 << 60] {
            assert!(matches!(
                filled("numbers", 0u64, len),
                Err(Error::Limit { .. })
            ));
        }
        assert!(room("pixels", 100, 40).is_ok() && room("pixels", 1 << 21, 4).is_ok());
        assert!(matches!(
            room("pixels", usize::MAX / 2, 40),
            Err(Error::Limit { .. })
        ));
        let mut few = vec![7u8];
        assert!(reserve("numbers", &mut few, 100).is_ok() && few.capacity() > 100);
        assert!(reserve("numbers", &mut few, usize::MAX).is_err());
        assert_eq!(product("sides", &[3, 0, 5]).unwrap(), 0);
        assert!(product("sides", &[1 << 40, 1 << 40]).is_err());
    }
}
