use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use super::run;
use crate::foundation::memory;
use crate::kernels::patch_search::{Exemplar, Index, Match, Pick, Query};

/// Cost, exemplar, row and column of each match.
type Found = Vec<(f64, usize, usize, usize)>;

/// Exemplars, prepared for the search of many patches.
#[pyclass(frozen)]
pub(super) struct PatchIndex(pub(super) Index);

#[pymethods]
impl PatchIndex {
    #[new]
    fn new(
        py: Python<'_>,
        exemplars: Vec<PyReadonlyArray3<'_, f32>>,
        allowed: Vec<Option<PyReadonlyArray2<'_, bool>>>,
        max_patch: [usize; 2],
    ) -> PyResult<Self> {
        let channels = exemplars.first().map_or(0, |e| e.shape()[2]);
        let mut all = Vec::with_capacity(exemplars.len());
        for (i, e) in exemplars.iter().enumerate() {
            let mask = allowed.get(i).and_then(Option::as_ref);
            all.push(Exemplar {
                data: memory::copied("exemplars", e.as_slice()?)?.into(),
                shape: [e.shape()[0], e.shape()[1]],
                allowed: match mask {
                    Some(mask) => Some(memory::copied("allowed", mask.as_slice()?)?),
                    None => None,
                },
            });
        }
        run(py, None, |_| Index::new(all, channels, max_patch)).map(Self)
    }

    fn again(
        &self,
        py: Python<'_>,
        allowed: Vec<Option<PyReadonlyArray2<'_, bool>>>,
        max_patch: [usize; 2],
    ) -> PyResult<Self> {
        let mut masks = Vec::with_capacity(allowed.len());
        for mask in &allowed {
            masks.push(match mask {
                Some(mask) => Some(memory::copied("allowed", mask.as_slice()?)?),
                None => None,
            });
        }
        run(py, None, |_| self.0.again(masks, max_patch)).map(Self)
    }

    #[getter]
    fn max_patch(&self) -> [usize; 2] {
        self.0.max_patch()
    }

    fn best(
        &self,
        py: Python<'_>,
        patch: PyReadonlyArray3<'_, f32>,
        weight: PyReadonlyArray2<'_, f32>,
        count: usize,
        separation: usize,
        ratio: f64,
    ) -> PyResult<Found> {
        let query = query(&patch, &weight)?;
        let pick = Pick {
            count,
            separation,
            ratio,
        };
        let found = run(py, None, |monitor| self.0.best(&query, &pick, monitor))?;
        Ok(found.iter().map(tuple).collect())
    }

    #[allow(clippy::too_many_arguments)] // the arguments of the Python method
    fn best_among(
        &self,
        py: Python<'_>,
        patch: PyReadonlyArray3<'_, f32>,
        weight: PyReadonlyArray2<'_, f32>,
        candidates: Vec<[usize; 3]>,
        count: usize,
        separation: usize,
        ratio: f64,
    ) -> PyResult<Found> {
        let query = query(&patch, &weight)?;
        let pick = Pick {
            count,
            separation,
            ratio,
        };
        let found = run(py, None, |_| self.0.best_among(&query, &candidates, &pick))?;
        Ok(found.iter().map(tuple).collect())
    }

    fn cost_map<'py>(
        &self,
        py: Python<'py>,
        patch: PyReadonlyArray3<'py, f32>,
        weight: PyReadonlyArray2<'py, f32>,
        exemplar: usize,
    ) -> PyResult<(Bound<'py, PyArray2<f32>>, f64)> {
        let query = query(&patch, &weight)?;
        let (map, error) = run(py, None, |monitor| {
            self.0.cost_map(&query, exemplar, monitor)
        })?;
        let shape = self.0.shapes()[exemplar];
        let sides = [shape[0] - query.shape[0] + 1, shape[1] - query.shape[1] + 1];
        Ok((PyArray1::from_vec(py, map).reshape(sides)?, error))
    }
}

fn query<'a>(
    patch: &'a PyReadonlyArray3<'_, f32>,
    weight: &'a PyReadonlyArray2<'_, f32>,
) -> PyResult<Query<'a>> {
    Ok(Query {
        patch: patch.as_slice()?,
        weight: weight.as_slice()?,
        shape: [patch.shape()[0], patch.shape()[1]],
    })
}

fn tuple(m: &Match) -> (f64, usize, usize, usize) {
    (m.cost, m.exemplar, m.row, m.column)
}
