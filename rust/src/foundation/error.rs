//! The one error type of the crate: every message names the argument, what came and what is allowed.

use std::time::Duration;

/// What can go wrong in texrs.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An argument is outside what the function allows.
    #[error("{argument}: {message}")]
    Value {
        /// Name of the argument, as the caller wrote it.
        argument: &'static str,
        /// What came and what is allowed.
        message: String,
    },
    /// Two arrays that must agree in shape do not.
    #[error("{argument}: expected shape {expected:?}, got {got:?}")]
    Shape {
        /// Name of the argument.
        argument: &'static str,
        /// The shape that the other arguments imply.
        expected: Vec<usize>,
        /// The shape that came.
        got: Vec<usize>,
    },
    /// The work needs more memory or more pixels than the limit.
    #[error("{what} needs {needed}, more than the limit of {limit}")]
    Limit {
        /// What was to be made.
        what: String,
        /// What it needs, with its unit.
        needed: String,
        /// The limit in force, with its unit.
        limit: String,
    },
    /// A file could not be read, decoded or written.
    #[error("{path}: {message}")]
    File {
        /// The path as the caller gave it.
        path: String,
        /// What the reader or the writer said.
        message: String,
    },
    /// The caller asked to stop.
    #[error("stopped by the caller after {0:?}")]
    Cancelled(Duration),
}

/// Results of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Refuses an array of `got` values where one of a shape is needed.
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
    /// An [`Error::Value`].
    pub fn value(argument: &'static str, message: impl Into<String>) -> Self {
        Self::Value {
            argument,
            message: message.into(),
        }
    }
}
