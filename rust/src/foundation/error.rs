//! The error type of the crate. Every message names the argument, the given value and the allowed
//! values.

use std::time::Duration;

/// An error of any function in texrs.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An argument is outside the range that the function allows.
    #[error("{argument}: {message}")]
    Value {
        /// Name of the argument, as in the caller's code.
        argument: &'static str,
        /// The given value and the allowed values.
        message: String,
    },
    /// Two arrays have different shapes but must agree.
    #[error("{argument}: must have shape {expected:?}, got {got:?}")]
    Shape {
        /// Name of the argument.
        argument: &'static str,
        /// The shape that the other arguments imply.
        expected: Vec<usize>,
        /// The shape of the given array.
        got: Vec<usize>,
    },
    /// The call needs more memory or more pixels than the limit.
    #[error("{what}: needs {needed}, more than the limit of {limit}")]
    Limit {
        /// Name of the requested result.
        what: String,
        /// Amount that the result needs, with its unit.
        needed: String,
        /// The limit in force, with its unit.
        limit: String,
    },
    /// A file could not be read, decoded or written.
    #[error("{path}: {message}")]
    File {
        /// The path, as the caller gave it.
        path: String,
        /// The message of the reader or the writer.
        message: String,
    },
    /// The caller asked to stop. The value is the time since the start of the kernel.
    #[error("stopped by the caller after {0:?}")]
    Cancelled(Duration),
}

/// The result type of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Returns an error unless `got`, a number of values, is the product of the `expected` shape.
pub(crate) fn check_shape(argument: &'static str, expected: &[usize], got: usize) -> Result<()> {
    let product = |n: usize, &side: &usize| n.checked_mul(side);
    if expected.iter().try_fold(1, product) == Some(got) {
        return Ok(());
    }
    Err(Error::Shape {
        argument,
        expected: expected.to_vec(),
        got: vec![got],
    })
}

impl Error {
    /// Returns an [`Error::Value`].
    pub fn value(argument: &'static str, message: impl Into<String>) -> Self {
        Self::Value {
            argument,
            message: message.into(),
        }
    }
}
