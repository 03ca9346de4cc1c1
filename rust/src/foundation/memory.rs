//! Memory that grows with what a caller asks for: where there is too little of it, that is an error, not the end of the
//! process.

use crate::{Error, Result};

/// `len` copies of `value`, for what is named `what`.
pub(crate) fn filled<T: Clone>(what: &str, value: T, len: usize) -> Result<Vec<T>> {
    check::<T>(what, len)?;
    // Asked for anew: memory that the system hands out as zeros is not written twice.
    Ok(vec![value; len])
}

/// A copy of values, for what is named `what`: of what the bindings may not keep.
#[cfg(feature = "python")]
pub(crate) fn copied<T: Copy>(what: &str, values: &[T]) -> Result<Vec<T>> {
    check::<T>(what, values.len())?;
    Ok(values.to_vec())
}

/// An error where there is no room for `len` values.
pub(crate) fn check<T>(what: &str, len: usize) -> Result<()> {
    Vec::<T>::new()
        .try_reserve_exact(len)
        .map_err(|_| too_little::<T>(what, len))
}

fn too_little<T>(what: &str, len: usize) -> Error {
    Error::Limit {
        what: what.into(),
        needed: format!("{} bytes", len as u128 * size_of::<T>() as u128),
        limit: "memory that there is".into(),
    }
}

/// Room for `more` values after those that are there.
pub(crate) fn reserve<T>(what: &str, values: &mut Vec<T>, more: usize) -> Result<()> {
    let len = values.len();
    values
        .try_reserve(more)
        .map_err(|_| too_little::<T>(what, len.saturating_add(more)))
}

/// Less than this is not asked for: where so little is not there, nothing goes on.
const LITTLE: usize = 1 << 20;

/// An error where there is no room for what a kernel takes in all, `each` bytes for each of `count` things.
///
/// What it takes is asked for at once and given back, before any work: of its parts, some of which are made in other crates, each
/// would end the process where it did not fit. The bytes are measured ones (`tests/test_kernels_memory.py` limits each kernel).
pub(crate) fn room(what: &str, count: usize, each: usize) -> Result<()> {
    match count.saturating_mul(each) {
        0..LITTLE => Ok(()),
        bytes => check::<u8>(what, bytes),
    }
}

/// The product of sizes, an error where it is more than can be counted.
pub(crate) fn product(what: &'static str, sizes: &[usize]) -> Result<usize> {
    let all = sizes
        .iter()
        .try_fold(1usize, |n, &size| n.checked_mul(size));
    all.ok_or_else(|| Error::value(what, format!("{sizes:?} is more than can be counted")))
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
