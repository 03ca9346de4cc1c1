use pyo3::prelude::*;

use crate::foundation::hash::{self, Noise};

#[pyfunction]
pub(super) fn philox(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    hash::philox(counter, key)
}

#[pyfunction]
pub(super) fn uniform(seed: u64, position: [u32; 4]) -> f64 {
    Noise::new(seed).uniform(position)
}
