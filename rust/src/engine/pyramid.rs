//! Upsampling of places to the next resolution.

use crate::foundation::error::check_shape;
use crate::foundation::fixed::{Frames, ONE, Place, add, apply};
use crate::foundation::grid::Region;
use crate::foundation::{memory, par};
use crate::{Error, Result};

/// Number of points in a task.
const CHUNK: usize = 4096;

/// Computes the places S of a region from the places S' at half the resolution. With r = p mod 2 - 1/2, S(p) = 2 S'(p
/// / 2) + 1/2 + J r.
///
/// The terms 1/2 are needed because a parent is midway between its children. With identity frames, integer coordinates
/// remain integers. The parents must include p / 2, rounded down, for every p of the region. Along periodic axes of
/// odd length, the last parent has three children.
///
/// Reference: Lefebvre and Hoppe, *Parallel controllable texture synthesis*, SIGGRAPH 2005, section 3.1.
pub fn upsample<const D: usize>(
    parents: &[Place<D>],
    from: &Region<D>,
    to: &Region<D>,
    frames: Frames<'_, D>,
) -> Result<Vec<Place<D>>> {
    let (coarse, fine) = (from.grid.shape(), to.grid.shape());
    // Return an error if parents are missing, because clamped ones would change the result.
    for axis in 0..D {
        let first = to.origin[axis].div_euclid(2) - from.origin[axis];
        let last = (to.origin[axis] + fine[axis] as i32 - 1).div_euclid(2) - from.origin[axis];
        let odd = to.grid.wrap()[axis] && fine[axis] == 2 * coarse[axis] + 1;
        if first < 0 || last >= coarse[axis] as i32 + i32::from(odd) {
            return Err(Error::value(
                "parents",
                format!("must cover {to:?} at half the resolution, got {from:?}"),
            ));
        }
    }
    check_shape("parents", &coarse, parents.len())?;
    frames.check(to.grid.len())?;
    let mut places = memory::filled("the places of a region", [0; D], to.grid.len())?;
    par::chunks_mut(&mut places, CHUNK, |chunk, places| {
        for (i, place) in places.iter_mut().enumerate() {
            let p = chunk * CHUNK + i;
            let world = to.world(to.grid.point(p));
            let mut parent = [0; D];
            let mut twice = [0; D];
            for axis in 0..D {
                let at =
                    (world[axis].div_euclid(2) - from.origin[axis]).min(coarse[axis] as i32 - 1);
                parent[axis] = at as usize;
                // This is twice the step from the middle between the first two children to the point.
                twice[axis] = 2 * (world[axis] - 2 * (at + from.origin[axis])) - 1;
            }
            let middle =
                parents[from.grid.index(parent)].map(|x| x.wrapping_mul(2).wrapping_add(ONE / 2));
            let moved = apply(&frames.at(p), twice).map(|x| x >> 1);
            *place = add(middle, moved);
        }
    });
    Ok(places)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::foundation::fixed::identity;
    use crate::foundation::grid::Grid;

    fn region(shape: [usize; 2], wrap: bool, origin: [i32; 2]) -> Region<2> {
        Region::new(Grid::new(shape, [wrap; 2]).unwrap(), origin).unwrap()
    }

    #[test]
    fn a_copy_stays_a_copy() {
        let (from, to) = (
            region([4, 5], false, [-1, 2]),
            region([7, 9], false, [-2, 5]),
        );
        let parents: Vec<Place<2>> = (0..20)
            .map(|i| from.world(from.grid.point(i)).map(|x| x * ONE))
            .collect();
        let places = upsample(&parents, &from, &to, Frames::Constant(identity())).unwrap();
        for (i, place) in places.iter().enumerate() {
            assert_eq!(*place, to.world(to.grid.point(i)).map(|x| x * ONE));
        }
    }

    #[test]
    fn the_last_parent_of_an_odd_ring_has_three_children() {
        let (from, to) = (region([2, 2], true, [0; 2]), region([5, 4], true, [0; 2]));
        let parents = [[0; 2], [0, ONE], [ONE, 0], [ONE; 2]];
        let places = upsample(&parents, &from, &to, Frames::Constant(identity())).unwrap();
        assert_eq!(places[4 * 4], [4 * ONE, 0]);
    }

    #[test]
    fn refuses_parents_that_are_too_few() {
        let (from, to) = (region([2, 2], false, [0; 2]), region([5, 4], false, [0; 2]));
        assert!(upsample(&[[0; 2]; 4], &from, &to, Frames::Constant(identity())).is_err());
    }
}
