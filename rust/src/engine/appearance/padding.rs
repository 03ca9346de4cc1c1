//! The colours of an exemplar with a margin, so that reads near its border need no checks.

use super::Colour;
use crate::foundation::grid::Grid;

/// Colours of an exemplar with a margin. The margin wraps around periodic axes and repeats the border along the
/// others.
#[derive(Debug, Clone)]
pub struct Padding<const D: usize> {
    colours: Vec<Colour>,
    strides: [i32; D],
    /// Position of the exemplar's first sample in `colours`.
    zero: i32,
}

impl<const D: usize> Padding<D> {
    pub(super) fn new(colours: &[Colour], grid: &Grid<D>, rim: usize) -> Self {
        let wide = Grid::new(grid.shape().map(|n| n + 2 * rim), [false; D])
            .expect("an exemplar whose margin fits");
        let colours = (0..wide.len())
            .map(|i| {
                let sample = wide.point(i);
                let inner: [usize; D] =
                    std::array::from_fn(|a| grid.resolve(a, sample[a] as isize - rim as isize));
                colours[grid.index(inner)]
            })
            .collect();
        let strides = wide.strides().map(|s| s as i32);
        Self {
            colours,
            strides,
            zero: strides.iter().map(|s| s * rim as i32).sum(),
        }
    }

    /// Returns the colour of a sample in the exemplar or in its margin.
    #[inline(always)]
    pub fn colour(&self, sample: [i32; D]) -> Colour {
        let mut at = self.zero;
        for axis in 0..D {
            at += sample[axis] * self.strides[axis];
        }
        self.colours[at as usize]
    }
}
