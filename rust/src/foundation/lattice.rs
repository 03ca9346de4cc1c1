//! Lattices: a picture repeats at each sum of multiples of two shifts, which are the columns of a matrix.

/// Returns the distance of a step from the nearest lattice shift, in units of the lattice's shorter shift that is not 0.
pub(crate) fn out_of_step(lattice: &[[f64; 2]; 2], moved: [f64; 2]) -> f64 {
    let [[a, b], [c, d]] = *lattice;
    let (first, second) = (norm([a, c]), norm([b, d]));
    let shorter = if second == 0.0 {
        first
    } else {
        first.min(second)
    };
    away(lattice, moved) / shorter
}

/// Returns the distance of a step from the nearest lattice shift. If the second shift is 0, the picture repeats along the
/// first shift only, and all steps across it agree.
pub(crate) fn away(lattice: &[[f64; 2]; 2], moved: [f64; 2]) -> f64 {
    let [[a, b], [c, d]] = *lattice;
    if [b, d] == [0.0, 0.0] {
        let square = a * a + c * c;
        let times = (a * moved[0] + c * moved[1]) / square;
        return (times - times.round()).abs() * square.sqrt();
    }
    let whole = a * d - b * c;
    let times = [
        (d * moved[0] - b * moved[1]) / whole,
        (a * moved[1] - c * moved[0]) / whole,
    ];
    // The nearest lattice shift is one of the four around the step.
    let mut rest = f64::INFINITY;
    for [i, j] in [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]] {
        let shift = [times[0].floor() + i, times[1].floor() + j];
        let left = [
            moved[0] - (a * shift[0] + b * shift[1]),
            moved[1] - (c * shift[0] + d * shift[1]),
        ];
        rest = rest.min(left[0] * left[0] + left[1] * left[1]);
    }
    rest.sqrt()
}

/// Returns the length of a vector.
fn norm([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::out_of_step;

    #[test]
    fn one_period_leaves_the_other_direction_free() {
        let stripes = [[0.0, 0.0], [20.0, 0.0]];
        for (moved, away) in [([7.0, 40.0], 0.0), ([-3.5, 5.0], 0.25), ([0.0, -10.0], 0.5)] {
            assert!((out_of_step(&stripes, moved) - away).abs() < 1e-12);
        }
        let lattice = [[10.0, 0.0], [0.0, 20.0]];
        assert!((out_of_step(&lattice, [3.0, 20.0]) - 0.3).abs() < 1e-12);
    }
}
