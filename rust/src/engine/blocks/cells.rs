//! The division of a region into cells whose borders are not straight.

use super::{CHUNK, Options};
use crate::Result;
use crate::foundation::fixed::{Frame, Frames, sub};
use crate::foundation::grid::{Grid, Region};
use crate::foundation::hash::Noise;
use crate::foundation::{memory, par};

/// Maximum offset of a centre from the middle of its cell, as a fraction of the cell's side.
const STRAY: f64 = 0.4;

/// The cells of a region.
pub(super) struct Cells<const D: usize> {
    pub(super) region: Region<D>,
    /// Number of cells along each axis, including cells that only border on the region.
    pub(super) grid: Grid<D>,
    /// World index of the first cell.
    pub(super) first: [i32; D],
    /// Number of points of a cell along each axis.
    pub(super) sides: [f64; D],
    pub(super) centres: Vec<[i32; D]>,
}

/// A cell: its points, and the points of the shell around it with their steps from its centre.
pub(super) struct Cell<const D: usize> {
    pub(super) points: Vec<u32>,
    pub(super) shell: Vec<(u32, [i32; D])>,
    pub(super) even: bool,
    /// The frame at the cell's centre, or at the nearest point of the region.
    pub(super) frame: Frame<D>,
}

impl<const D: usize> Cells<D> {
    /// Divides a region into cells.
    pub(super) fn new(region: &Region<D>, options: &Options) -> Result<Self> {
        let (shape, wrap) = (region.grid.shape(), region.grid.wrap());
        let side = options.cell as i32;
        let mut first = [0; D];
        let mut counts = [0; D];
        let mut sides = [f64::from(side); D];
        for axis in 0..D {
            let n = shape[axis];
            if wrap[axis] {
                // Stretch the cells of a periodic axis so that a whole number of them fits.
                counts[axis] = ((n + options.cell / 2) / options.cell).max(1);
                sides[axis] = n as f64 / counts[axis] as f64;
            } else {
                // Add a cell on both sides, because centres are shifted and a cell outside the region may own points
                // inside.
                first[axis] = region.origin[axis].div_euclid(side) - 1;
                let last = (region.origin[axis] + n as i32 - 1).div_euclid(side) + 1;
                counts[axis] = (last - first[axis] + 1) as usize;
            }
        }
        let grid = Grid::new(counts, wrap)?;
        memory::check::<[i32; D]>("the cells of a region", grid.len())?;
        // Shift centres by noise of the cell's world index, so that overlapping regions have the same cells.
        let noise = Noise::new(options.seed).part(2);
        let centres = (0..grid.len())
            .map(|c| {
                let cell = grid.point(c);
                let world: [i32; D] = std::array::from_fn(|axis| first[axis] + cell[axis] as i32);
                let words = noise.at(world, 0);
                std::array::from_fn(|axis| {
                    let stray = (f64::from(words[axis]) / f64::from(u32::MAX) - 0.5) * 2.0 * STRAY;
                    let at = (f64::from(world[axis]) + 0.5 + stray) * sides[axis];
                    at.floor() as i32
                })
            })
            .collect();
        Ok(Self {
            region: *region,
            grid,
            first,
            sides,
            centres,
        })
    }

    /// Returns whether a point that is not in the margin depends on the choice of a cell in a round.
    ///
    /// A point is at most `far` from the centre of the cell it falls into. The nearest centre, which owns the point,
    /// is not farther. Each later round reads the shell, which is one point wider, and the centres of the cells that
    /// own the points of the shell. If `repetition` is above 0, it also reads the centres of cells two steps away.
    pub(super) fn counts(&self, cell: usize, options: &Options, round: usize) -> bool {
        let side = options.cell as f64;
        let far = ((0.5 + STRAY) * side).ceil() as usize;
        let steps = if options.repetition > 0.0 {
            (2.0 * (1.0 + STRAY) * side).ceil() as usize
        } else {
            0
        };
        let sight = far + (options.rounds - round) * steps.max(2 * far + 1);
        let beyond = options.margin as i64 - sight as i64;
        let (shape, wrap) = (self.region.grid.shape(), self.region.grid.wrap());
        (0..D).all(|axis| {
            let at = i64::from(self.centres[cell][axis]) - i64::from(self.region.origin[axis]);
            wrap[axis] || (beyond..shape[axis] as i64 - beyond).contains(&at)
        })
    }

    /// Returns the step from a cell's centre to a point of the world, the short way round along periodic axes.
    pub(super) fn step_from_centre(&self, cell: usize, world: [i32; D]) -> [i32; D] {
        let (shape, wrap) = (self.region.grid.shape(), self.region.grid.wrap());
        let mut step = sub(world, self.centres[cell]);
        for axis in 0..D {
            if wrap[axis] {
                let n = shape[axis] as i32;
                step[axis] = (step[axis] + n / 2).rem_euclid(n) - n / 2;
            }
        }
        step
    }

    /// Returns the cell of each point: the cell with the nearest centre in the maximum norm.
    pub(super) fn owners(&self) -> Result<Vec<u32>> {
        let grid = &self.region.grid;
        let mut owners = memory::filled("the points of cells", 0u32, grid.len())?;
        par::chunks_mut(&mut owners, CHUNK, |chunk, owners| {
            // Reuse the neighbours of the previous point, because consecutive points mostly fall into the same cell.
            let (mut seen, mut around) = (None, Vec::new());
            for (i, owner) in owners.iter_mut().enumerate() {
                let world = self.region.world(grid.point(chunk * CHUNK + i));
                let home = std::array::from_fn(|axis| {
                    (f64::from(world[axis]) / self.sides[axis]).floor() as i32 - self.first[axis]
                });
                if seen != Some(home) {
                    seen = Some(home);
                    around = self.around(home);
                }
                let far = |c: usize| {
                    let step = self.step_from_centre(c, world);
                    step.iter().map(|x| x.abs()).max().unwrap_or(0)
                };
                let nearest = around.iter().map(|&c| (far(c), c)).min();
                *owner = nearest.map_or(0, |(_, c)| c as u32);
            }
        });
        Ok(owners)
    }

    /// Returns the cell at a position of the lattice of cells, and its neighbours.
    fn around(&self, home: [i32; D]) -> Vec<usize> {
        let (shape, wrap) = (self.grid.shape(), self.grid.wrap());
        (0..3usize.pow(D as u32))
            .filter_map(|mut k| {
                let mut at = 0;
                for axis in 0..D {
                    let n = shape[axis] as i32;
                    let mut x = home[axis] + (k % 3) as i32 - 1;
                    k /= 3;
                    if wrap[axis] {
                        x = x.rem_euclid(n);
                    }
                    if !(0..n).contains(&x) {
                        return None;
                    }
                    at = at * n as usize + x as usize;
                }
                Some(at)
            })
            .collect()
    }

    /// Lists the points and the shells of all cells.
    pub(super) fn list(&self, owners: &[u32], frames: Frames<'_, D>) -> Result<Vec<Cell<D>>> {
        let grid = &self.region.grid;
        memory::check::<Cell<D>>("the cells of a region", self.grid.len())?;
        let mut list: Vec<Cell<D>> = (0..self.grid.len())
            .map(|c| {
                let cell = self.grid.point(c);
                let sum: i32 = (0..D)
                    .map(|axis| self.first[axis] + cell[axis] as i32)
                    .sum();
                Cell {
                    points: Vec::new(),
                    shell: Vec::new(),
                    even: sum.rem_euclid(2) == 0,
                    frame: self.frame(frames, c),
                }
            })
            .collect();
        // List the steps to all neighbours, and the same steps as offsets in row-major order.
        let steps: Vec<[i32; D]> = (0..3usize.pow(D as u32))
            .map(|mut k| {
                std::array::from_fn(|_| {
                    let x = (k % 3) as i32 - 1;
                    k /= 3;
                    x
                })
            })
            .collect();
        let strides = grid.strides();
        let offsets: Vec<isize> = steps
            .iter()
            .map(|step| (0..D).map(|a| step[a] as isize * strides[a] as isize).sum())
            .collect();
        // Add each point to its own cell, and to the shell of each other cell next to it.
        for at in 0..grid.len() {
            let point = grid.point(at);
            let owner = owners[at];
            list[owner as usize].points.push(at as u32);
            let mut seen = [u32::MAX; 27];
            let mut others = 0;
            let mut see = |q: usize| {
                let other = owners[q];
                if other != owner && !seen[..others].contains(&other) {
                    seen[others] = other;
                    others += 1;
                }
            };
            if (0..D).all(|axis| (1..grid.shape()[axis] - 1).contains(&point[axis])) {
                for offset in &offsets {
                    see(at.wrapping_add_signed(*offset));
                }
            } else {
                for &step in &steps {
                    self.region.step(point, step).into_iter().for_each(&mut see);
                }
            }
            for &other in &seen[..others] {
                let step = self.step_from_centre(other as usize, self.region.world(point));
                list[other as usize].shell.push((at as u32, step));
            }
        }
        Ok(list)
    }

    /// Returns the cells within two steps of a cell.
    pub(super) fn near(&self, c: usize) -> impl Iterator<Item = usize> {
        let lattice = Region {
            grid: self.grid,
            origin: self.first,
        };
        let cell = self.grid.point(c);
        (0..5usize.pow(D as u32)).filter_map(move |mut k| {
            let step: [i32; D] = std::array::from_fn(|_| {
                let x = (k % 5) as i32 - 2;
                k /= 5;
                x
            });
            lattice.step(cell, step).filter(|&other| other != c)
        })
    }

    /// Returns the frame at a cell's centre, or at the nearest point of the region.
    fn frame(&self, frames: Frames<'_, D>, c: usize) -> Frame<D> {
        let grid = &self.region.grid;
        let point = std::array::from_fn(|axis| {
            grid.resolve(
                axis,
                (self.centres[c][axis] - self.region.origin[axis]) as isize,
            )
        });
        frames.at(grid.index(point))
    }
}
