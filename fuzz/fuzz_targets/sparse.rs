//! Fuzzes the sparse solver. Factors must solve their systems, and matrices that are invalid or not
//! positive definite must give an error.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::sparse::{Cholesky, Lower};
use texrs_fuzz::{Draw, agreed};

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    let size = draw.within(0..=24);
    let (mut starts, mut rows, mut values) = (vec![0u32], Vec::new(), Vec::new());
    // Each diagonal entry exceeds the sum of the other magnitudes in its row by `screening`.
    let screening = [1e-6, 1.0, 0.0, -1.0][draw.within(0..=3)];
    let mut weights = vec![screening; size];
    let sparse = draw.within(1..=6) as u8;
    let pairs: Vec<Vec<(usize, f64)>> = (0..size)
        .map(|column| {
            let chosen: Vec<usize> = (column + 1..size)
                .filter(|_| draw.any::<u8>() % 7 < sparse)
                .collect();
            chosen
                .into_iter()
                .map(|row| (row, f64::from(draw.real()) * [1.0, 1e6][draw.within(0..=1)]))
                .collect()
        })
        .collect();
    for (column, pairs) in pairs.iter().enumerate() {
        for &(row, weight) in pairs {
            weights[row] += weight.abs();
            weights[column] += weight.abs();
        }
    }
    for (column, pairs) in pairs.iter().enumerate() {
        rows.push(column as u32);
        values.push(weights[column]);
        for &(row, weight) in pairs {
            rows.push(row as u32);
            values.push(-weight);
        }
        starts.push(rows.len() as u32);
    }
    // Sometimes replace a few indices by arbitrary ones, so that the matrix is mostly invalid.
    if draw.seldom(8) {
        for _ in 0..draw.within(1..=3) {
            let list = if draw.flag() { &mut starts } else { &mut rows };
            if !list.is_empty() {
                let at = draw.within(0..=list.len() - 1);
                list[at] = if draw.flag() {
                    draw.any()
                } else {
                    draw.within(0..=30) as u32
                };
            }
        }
    }
    let matrix = Lower {
        starts: &starts,
        rows: &rows,
        values: &values,
    };
    let limit = if draw.seldom(16) {
        draw.within(0..=4096)
    } else {
        1 << 26
    };
    let count = draw.within(0..=2);
    let sides: Vec<f64> = draw
        .values(size * count)
        .into_iter()
        .map(f64::from)
        .collect();
    let found = agreed(|monitor| {
        let factor = Cholesky::new(&matrix, limit, monitor)?;
        assert_eq!(factor.size(), starts.len() - 1);
        let mut solved = sides.clone();
        factor.solve(&mut solved)?;
        Ok(solved)
    });
    let Some(solved) = found else {
        return;
    };
    // Multiply the matrix by the solution directly. The tolerance grows with the largest entry of
    // the matrix and with the largest unknown.
    let most = values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    for (x, b) in solved.chunks_exact(size).zip(sides.chunks_exact(size)) {
        let mut product = vec![0.0; size];
        for column in 0..size {
            for k in starts[column] as usize..starts[column + 1] as usize {
                let row = rows[k] as usize;
                if row < column {
                    continue;
                }
                product[row] += values[k] * x[column];
                if row != column {
                    product[column] += values[k] * x[row];
                }
            }
        }
        let largest = x.iter().fold(1.0f64, |m, v| m.max(v.abs()));
        if !(most * largest).is_finite() {
            continue;
        }
        for (got, wanted) in product.iter().zip(b) {
            assert!(
                (got - wanted).abs() <= 1e-10 * (1.0 + most * largest),
                "{got} for {wanted}"
            );
        }
    }
});
