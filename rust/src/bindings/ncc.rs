use numpy::{PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::run;
use crate::kernels::ncc;

/// The channels of an image, prepared for correlation with many templates.
#[pyclass(frozen)]
pub(super) struct Correlation(ncc::Correlation, [usize; 2]);

#[pymethods]
impl Correlation {
    #[new]
    fn new(py: Python<'_>, image: PyReadonlyArray3<'_, f32>) -> PyResult<Self> {
        let shape = [image.shape()[1], image.shape()[2]];
        let values = image.as_slice()?;
        run(py, None, |_| ncc::Correlation::new(values, shape)).map(|c| Self(c, shape))
    }

    fn maps<'py>(
        &self,
        py: Python<'py>,
        template: PyReadonlyArray3<'_, f32>,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let shape = [template.shape()[1], template.shape()[2]];
        let values = template.as_slice()?;
        let found = run(py, None, |monitor| self.0.maps(values, shape, monitor))?;
        let valid = [self.1[0] - shape[0] + 1, self.1[1] - shape[1] + 1];
        PyArray1::from_vec(py, found).reshape([self.0.channels(), valid[0], valid[1]])
    }
}
