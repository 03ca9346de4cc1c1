//! Systems along a row whose solutions decay within a few pixels: `(d - T) x = r`, where T sums
//! both neighbours.
//!
//! The method is odd-even reduction of all pixels at once: `(d - T) (d + T) = d^2 - 2 - T'`, where
//! T' sums the neighbours at twice the distance. So `x = (d + T) (d^2 - 2 - T')^-1 r`, and so on,
//! until the weight of neighbours is negligible. This is the truncated parallel form of cyclic
//! reduction (Hockney and Jesshope, *Parallel computers*, 1981).
//!
//! Each step is a weighted sum of three shifted rows, for any number of channels. Beyond its ends
//! the row is mirrored or wrapped.

use super::Edge;
use crate::foundation::simd::wide_fn;

/// Weight below which a neighbour is omitted, relative to the weight of the pixel.
const NOTHING: f64 = 1.0 / (1 << 28) as f64;

/// The inverse of a product of systems along a row.
pub(super) struct Inverse {
    channels: usize,
    /// The steps: distance of the neighbours, weight of the pixel and weight of both neighbours.
    steps: Vec<(usize, f32, f32)>,
    /// Number of extra pixels at each end of an extended row.
    reach: usize,
    /// Copies into the extended row: target pixel, source pixel and sign.
    beyond: Vec<(usize, usize, f32)>,
}

/// Scratch memory of an inverse.
#[derive(Default)]
pub(super) struct Scratch([Vec<f32>; 2]);

impl Inverse {
    /// Computes the inverse for rows of `len` pixels. The diagonals must be above 2.
    pub(super) fn new(edge: Edge, len: usize, channels: usize, diagonals: &[f64]) -> Self {
        let mut scale = 1.0;
        let mut steps = Vec::new();
        for d in diagonals {
            // With d = q + 1 / q, d^2 - 2 is the same expression for q^2.
            let mut q = 2.0 / (d + (d * d - 4.0).sqrt());
            let mut step = 1;
            scale *= q;
            while q > NOTHING {
                scale *= 1.0 + q * q;
                steps.push((step, 1.0, q / (1.0 + q * q)));
                (q, step) = (q * q, 2 * step);
            }
        }
        // The last step also applies the accumulated scale.
        let last = steps.pop().unwrap_or((0, 1.0, 0.0));
        steps.push((last.0, scale, scale * last.2));
        let reach = steps.iter().map(|step| step.0).sum();
        let ends = (0..reach).chain(reach + len..len + 2 * reach);
        let beyond = ends.map(|to| {
            let (from, sign) = fold(edge, len, to as isize - reach as isize);
            (to, reach + from, sign)
        });
        Self {
            channels,
            reach,
            beyond: beyond.collect(),
            steps: steps
                .into_iter()
                .map(|(step, own, beside)| (step * channels, own as f32, beside as f32))
                .collect(),
        }
    }

    /// Solves the systems of all channels of a row. `fill` receives the old row and writes the right-hand side. The
    /// solution then replaces the row.
    pub(super) fn apply(
        &self,
        row: &mut [f32],
        fill: impl FnOnce(&mut [f32], &[f32]),
        Scratch([from, to]): &mut Scratch,
    ) {
        let pad = self.reach * self.channels;
        let len = row.len() + 2 * pad;
        from.resize(len, 0.0);
        to.resize(len, 0.0);
        fill(&mut from[pad..][..row.len()], row);
        // Extend the row beyond its ends.
        for &(to, source, sign) in &self.beyond {
            for c in 0..self.channels {
                from[to * self.channels + c] = sign * from[source * self.channels + c];
            }
        }
        // Each step shortens the extended row, until only its original length is left.
        let mut left = len;
        let last = self.steps.len() - 1;
        for &(step, own, beside) in &self.steps[..last] {
            let from_part = &from[..left];
            left -= 2 * step;
            add_beside(&mut to[..left], from_part, step, own, beside);
            std::mem::swap(from, to);
        }
        let (step, own, beside) = self.steps[last];
        add_beside(row, &from[..left], step, own, beside);
    }
}

wide_fn! {
    /// Writes the weighted sum of each value and of the values `step` before and after it, except
    /// near the ends.
    fn add_beside(out: &mut [f32], row: &[f32], step: usize, own: f32, beside: f32) {
        let ends = row.iter().zip(&row[2 * step..]);
        for ((out, x), (a, b)) in out.iter_mut().zip(&row[step..]).zip(ends) {
            *out = own * x + beside * (a + b);
        }
    }
}

/// Returns the pixel that replaces a pixel beyond the ends, and its sign.
fn fold(edge: Edge, len: usize, at: isize) -> (usize, f32) {
    match edge {
        Edge::Wrap => (at.rem_euclid(len as isize) as usize, 1.0),
        Edge::Free => {
            let at = at.rem_euclid(2 * len as isize) as usize;
            (at.min(2 * len - 1 - at), 1.0)
        }
        // The pixels next to both ends are 0, and the row continues with the opposite sign beyond
        // them.
        Edge::Fixed => match (at + 1).rem_euclid(2 * (len as isize + 1)) as usize {
            0 => (0, 0.0),
            at if at == len + 1 => (0, 0.0),
            at if at > len => (2 * len + 1 - at, -1.0),
            at => (at - 1, 1.0),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn gives_what_the_systems_turn_into_the_row(
            len in 1usize..70,
            channels in 1usize..4,
            edge in prop::sample::select(vec![Edge::Fixed, Edge::Wrap, Edge::Free]),
            diagonals in prop::collection::vec(prop::sample::select(vec![2.3, 3.0, 4.0, 5.5, 1e4, 1e30]), 1..3),
            seed: u64,
        ) {
            let noise = crate::foundation::hash::Noise::new(seed);
            let row: Vec<f32> = (0..(len * channels) as u32)
                .map(|i| noise.uniform([i, 0, 0, 0]) as f32 - 0.5)
                .collect();
            let mut out = row.clone();
            let inverse = Inverse::new(edge, len, channels, &diagonals);
            let mut scratch = Scratch::default();
            inverse.apply(&mut out, |to, row| to.copy_from_slice(row), &mut scratch);
            let mut back: Vec<f64> = out.iter().map(|&x| f64::from(x)).collect();
            for d in &diagonals {
                let at = |x: isize, c: usize| {
                    let (x, sign) = fold(edge, len, x);
                    back[x * channels + c] * f64::from(sign)
                };
                back = (0..len * channels)
                    .map(|i| {
                        let (x, c) = ((i / channels) as isize, i % channels);
                        d * at(x, c) - at(x - 1, c) - at(x + 1, c)
                    })
                    .collect();
            }
            // Products above 1e38 overflow `f32`.
            let tiny = diagonals.iter().product::<f64>() > 1e38;
            for (x, y) in back.iter().zip(&row) {
                prop_assert!(tiny || (x - f64::from(*y)).abs() < 1e-5, "{x} {y}");
            }
        }
    }
}
