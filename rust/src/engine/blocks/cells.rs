//! A region divided into cells with borders that are nowhere straight.

use super::{CHUNK, Options};
use crate::Result;
use crate::foundation::fixed::{Frame, Frames, sub};
use crate::foundation::grid::{Grid, Region};
use crate::foundation::hash::Noise;
use crate::foundation::{memory, par};

/// How far a centre strays from the middle of its cell, as a share of the cell.
const STRAY: f64 = 0.4;

/// The cells of a region.
pub(super) struct Cells<const D: usize> {
    pub(super) region: Region<D>,
    /// Cells along each axis, those that only border on the region included.
    pub(super) grid: Grid<D>,
    /// World index of the first cell.
    pub(super) first: [i32; D],
    /// Points a cell has along each axis.
    pub(super) sides: [f64; D],
    pub(super) centres: Vec<[i32; D]>,
}

/// One cell: its points, and those of the shell around it with the steps from its centre.
pub(super) struct Cell<const D: usize> {
    pub(super) points: Vec<u32>,
    pub(super) shell: Vec<(u32, [i32; D])>,
    pub(super) even: bool,
    /// The frame at its centre, or at the point of the region nearest to it.
    pub(super) frame: Frame<D>,
}

impl<const D: usize> Cells<D> {
    pub(super) fn new(region: &Region<D>, options: &Options) -> Result<Self> {
        let (shape, wrap) = (region.grid.shape(), region.grid.wrap());
        let side = options.cell as i32;
        let mut first = [0; D];
        let mut counts = [0; D];
        let mut sides = [f64::from(side); D];
        for axis in 0..D {
            let n = shape[axis];
            if wrap[axis] {
                counts[axis] = ((n + options.cell / 2) / options.cell).max(1);
                sides[axis] = n as f64 / counts[axis] as f64;
            } else {
                // Centres stray, so a cell beside the region may own points of it.
                first[axis] = region.origin[axis].div_euclid(side) - 1;
                let last = (region.origin[axis] + n as i32 - 1).div_euclid(side) + 1;
                counts[axis] = (last - first[axis] + 1) as usize;
            }
        }
        let grid = Grid::new(counts, wrap)?;
        memory::check::<[i32; D]>("the cells of a region", grid.len())?;
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

    /// Whether anything inside the margin hangs on what a cell chooses in a round.
    ///
    /// A point lies within `far` of its cell's centre, as near as to that of the cell it falls into; each round after
    /// this one looks at the shell, one point further, and at the centres of the cells that own it; and at those of
    /// cells two steps away where what they show counts.
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

    /// The step from a cell's centre to a point of the world: the short way around where the output repeats.
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

    /// The cell that each point belongs to: that of the nearest centre, along the axis on which it is farthest.
    pub(super) fn owners(&self) -> Result<Vec<u32>> {
        let grid = &self.region.grid;
        let mut owners = memory::filled("the points of cells", 0u32, grid.len())?;
        par::chunks_mut(&mut owners, CHUNK, |chunk, owners| {
            // Points one after the other mostly fall into one cell.
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

    /// The cell at a position of the lattice of cells, and those beside it.
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

    /// Points and shells of all cells.
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

    /// The cells within two steps of a cell.
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

    /// The frame at a cell's centre, or at the point of the region nearest to it.
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
