//! A coherent start: the output divided into cells, each filled by one piece of the exemplar.
//!
//! The lattice is divided into cells of about `cell` points a side, with centres shifted by noise and each point given
//! to the nearest centre, so that no seam is straight. A cell's piece is chosen to fit its neighbours: cells of even
//! and odd parity take turns, each trying many places. The cost of a place counts how the shell just outside the cell
//! would continue, against what lies there. Plain squared differences would favour bland pieces, which are near
//! everything on average, so they are divided by the contrast of both.
//!
//! Everything is a function of the world's coordinates, within two cells for each of the `rounds`.

use crate::appearance::{Appearance, Feature, KEEP, UNIT, distance};
use crate::fixed::{Frame, Frames, ONE, Place, add, apply, nearest, sub};
use crate::grid::{Grid, Region};
use crate::guide::Guide;
use crate::hash::Noise;
use crate::par::{self, Monitor};
use crate::{Error, Result};

/// How far a centre strays from the middle of its cell, as a share of the cell.
const STRAY: f64 = 0.3;
/// A window without contrast.
const NOTHING: Feature = [0; KEEP];
/// Cost of a shell point whose continuation lies outside the exemplar.
const OUTSIDE: i64 = 4 * UNIT as i64;

/// What [`blocks`] is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Side of a cell, in points.
    pub cell: usize,
    /// Half-rounds of choosing; the even and the odd cells take turns, and the first places the even ones anywhere.
    pub rounds: usize,
    /// Places a cell tries in a round.
    pub candidates: usize,
    /// How far misfits are divided by the contrast of the pieces, 0 to 1.
    pub contrast: f64,
    /// Cost of going on exactly where a neighbour ends, in misfits of unrelated pieces: otherwise the exemplar is copied
    /// whole.
    pub continuation: f64,
    /// Cost of showing what one of the cells around shows, in the same units.
    pub repetition: f64,
    /// Chooses the texture.
    pub seed: u64,
    /// Points along borders that are there only for the others to look at: no cell is chosen that these do not hang on.
    pub margin: usize,
}

/// The cells of a region.
struct Cells<const D: usize> {
    region: Region<D>,
    /// Cells along each axis, those that only border on the region included.
    grid: Grid<D>,
    /// World index of the first cell.
    first: [i32; D],
    /// Points a cell has along each axis.
    sides: [f64; D],
    centres: Vec<[i32; D]>,
}

/// One cell: its points, and those of the shell around it with the steps from its centre.
struct Cell<const D: usize> {
    points: Vec<u32>,
    shell: Vec<(u32, [i32; D])>,
    even: bool,
}

/// Gives every point of `region` a place in the exemplar.
pub fn blocks<const D: usize>(
    appearance: &Appearance<D>,
    region: &Region<D>,
    frames: Frames<'_, D>,
    guide: Option<Guide<'_>>,
    options: &Options,
    monitor: &Monitor,
) -> Result<Vec<Place<D>>> {
    if options.cell < 2 || options.candidates == 0 || options.rounds == 0 {
        return Err(Error::value(
            "cell",
            format!("needs at least 2 points a cell, 1 candidate and 1 round, got {options:?}"),
        ));
    }
    let cells = Cells::new(region, options);
    let noise = Noise::new(options.seed).part(1);
    let owners = cells.owners();
    let list = cells.list(&owners);
    let mut origins: Vec<Place<D>> = par::map(list.len(), |c| {
        let chooser = Chooser::new(appearance, &cells, &list, frames, c);
        chooser.place(&noise, 0, 0)
    });
    monitor.expect((options.rounds * list.len()) as u64);
    let mut places = vec![[0; D]; region.grid.len()];
    spread(appearance, &cells, &list, frames, &origins, &mut places);
    for round in 1..=options.rounds {
        let even = round % 2 == 0;
        let chosen = par::map(list.len(), |c| {
            let idle = list[c].even != even || list[c].points.is_empty();
            if idle || !cells.counts(c, options, round) || monitor.advance(1).is_err() {
                return origins[c];
            }
            let chooser = Chooser::new(appearance, &cells, &list, frames, c);
            let asked = chooser.asked(&cells, guide);
            let near: Vec<_> = cells.near(c).map(|n| origins[n]).collect();
            let round = round as u32;
            chooser.choose(&places, origins[c], &near, &asked, &noise, round, options)
        });
        monitor.check()?;
        origins = chosen;
        spread(appearance, &cells, &list, frames, &origins, &mut places);
    }
    Ok(places)
}

impl<const D: usize> Cells<D> {
    fn new(region: &Region<D>, options: &Options) -> Self {
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
        let grid = Grid::new(counts, wrap).expect("a region has points, so it has cells");
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
        Self {
            region: *region,
            grid,
            first,
            sides,
            centres,
        }
    }

    /// Whether anything inside the margin hangs on what a cell chooses in a round.
    ///
    /// A point lies within `far` of its cell's centre, as near as to that of the cell it falls into; each round after
    /// this one looks at the shell, one point further, and at the centres of the cells that own it; and at those of
    /// cells two steps away where what they show counts.
    fn counts(&self, cell: usize, options: &Options, round: usize) -> bool {
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
    fn step_from_centre(&self, cell: usize, world: [i32; D]) -> [i32; D] {
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
    fn owners(&self) -> Vec<u32> {
        let (grid, shape) = (&self.region.grid, self.grid.shape());
        let neighbours = 3usize.pow(D as u32);
        let mut owners = vec![0u32; grid.len()];
        par::chunks_mut(&mut owners, 4096, |chunk, owners| {
            for (i, owner) in owners.iter_mut().enumerate() {
                let world = self.region.world(grid.point(chunk * 4096 + i));
                let home: [i32; D] = std::array::from_fn(|axis| {
                    (f64::from(world[axis]) / self.sides[axis]).floor() as i32 - self.first[axis]
                });
                let mut best = (i32::MAX, 0);
                for k in 0..neighbours {
                    let mut rest = k;
                    let mut at = 0;
                    let mut known = true;
                    for axis in 0..D {
                        let n = shape[axis] as i32;
                        let mut x = home[axis] + (rest % 3) as i32 - 1;
                        rest /= 3;
                        if grid.wrap()[axis] {
                            x = x.rem_euclid(n);
                        }
                        known &= (0..n).contains(&x);
                        at = at * n as usize + x.max(0) as usize;
                    }
                    if known {
                        let step = self.step_from_centre(at, world);
                        let far = step.iter().map(|x| x.abs()).max().unwrap_or(0);
                        best = best.min((far, at as u32));
                    }
                }
                *owner = best.1;
            }
        });
        owners
    }

    /// Points and shells of all cells.
    fn list(&self, owners: &[u32]) -> Vec<Cell<D>> {
        let grid = &self.region.grid;
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
        for at in 0..grid.len() {
            let point = grid.point(at);
            let owner = owners[at];
            list[owner as usize].points.push(at as u32);
            let mut seen = [u32::MAX; 27];
            let mut others = 0;
            for &step in &steps {
                let Some(q) = self.region.step(point, step) else {
                    continue;
                };
                let other = owners[q];
                if other != owner && !seen[..others].contains(&other) {
                    seen[others] = other;
                    others += 1;
                }
            }
            for &other in &seen[..others] {
                let step = self.step_from_centre(other as usize, self.region.world(point));
                list[other as usize].shell.push((at as u32, step));
            }
        }
        list
    }
}

/// The points of a cell of which a guide asks something, with the steps from its centre.
struct Asked<'a, const D: usize> {
    guide: Option<Guide<'a>>,
    points: Vec<(usize, [i32; D])>,
}

/// The places that one cell may take, and what they cost.
struct Chooser<'a, const D: usize> {
    appearance: &'a Appearance<D>,
    cell: &'a Cell<D>,
    index: usize,
    /// World index of the cell.
    world: [i32; D],
    frame: Frame<D>,
    /// Places of the centre for which all points of the cell lie inside the exemplar, in whole samples.
    range: [[i32; 2]; D],
}

impl<'a, const D: usize> Chooser<'a, D> {
    fn new(
        appearance: &'a Appearance<D>,
        cells: &Cells<D>,
        list: &'a [Cell<D>],
        frames: Frames<'_, D>,
        c: usize,
    ) -> Self {
        let cell = &list[c];
        let index = cells.grid.point(c);
        let frame = cells.frame(frames, c);
        let (mut low, mut high) = ([0; D], [0; D]);
        for &p in &cell.points {
            let world = cells.region.world(cells.region.grid.point(p as usize));
            let moved = apply(&frame, cells.step_from_centre(c, world));
            for axis in 0..D {
                low[axis] = low[axis].min(moved[axis]);
                high[axis] = high[axis].max(moved[axis]);
            }
        }
        let range = std::array::from_fn(|axis| {
            let [first, last] = appearance.range(axis);
            if appearance.grid().wrap()[axis] {
                return [first, last];
            }
            let [least, most] = [
                first - low[axis].div_euclid(ONE),
                last - (high[axis] + ONE - 1).div_euclid(ONE),
            ];
            // A cell as large as the exemplar has one place, in the middle.
            if least <= most {
                [least, most]
            } else {
                [(least + most).div_euclid(2); 2]
            }
        });
        Self {
            appearance,
            cell,
            index: c,
            world: std::array::from_fn(|axis| cells.first[axis] + index[axis] as i32),
            frame,
            range,
        }
    }

    /// A place drawn for the cell's centre.
    fn place(&self, noise: &Noise, round: u32, draw: u32) -> Place<D> {
        let words = noise.at(self.world, round << 16 | draw);
        std::array::from_fn(|axis| {
            let [low, high] = self.range[axis];
            let n = (high - low + 1) as u64;
            (low + ((u64::from(words[axis]) * n) >> 32) as i32) * ONE
        })
    }

    /// The best of the present place and many drawn ones; the first of equals.
    #[allow(clippy::too_many_arguments)] // what lies around, what is asked, and how to choose
    fn choose(
        &self,
        places: &[Place<D>],
        present: Place<D>,
        near: &[Place<D>],
        asked: &Asked<'_, D>,
        noise: &Noise,
        round: u32,
        options: &Options,
    ) -> Place<D> {
        let mut best = present;
        let usual = 2.0 * f64::from(UNIT) * self.cell.shell.len().max(1) as f64;
        let cost = |origin| {
            self.misfit(places, origin, options)
                + options.repetition * self.repeated(origin, near, options.cell)
                + self.obey(origin, asked) as f64 / usual
        };
        let mut least = cost(present);
        for draw in 0..options.candidates as u32 {
            let origin = self.place(noise, round, draw);
            let sum = cost(origin);
            if sum < least {
                (best, least) = (origin, sum);
            }
        }
        best
    }

    /// The points of the cell of which something is asked.
    fn asked<'g>(&self, cells: &Cells<D>, guide: Option<Guide<'g>>) -> Asked<'g, D> {
        let mut points = Vec::new();
        if let Some(guide) = guide {
            for &p in self.cell.points.iter().filter(|&&p| guide.asks(p as usize)) {
                let world = cells.region.world(cells.region.grid.point(p as usize));
                points.push((p as usize, cells.step_from_centre(self.index, world)));
            }
        }
        Asked { guide, points }
    }

    /// What a place costs by the guide.
    #[inline(always)]
    fn obey(&self, origin: Place<D>, asked: &Asked<'_, D>) -> i64 {
        let Some(guide) = &asked.guide else {
            return 0;
        };
        let mut sum = 0;
        for &(p, step) in &asked.points {
            let sample = nearest(add(origin, apply(&self.frame, step)));
            sum += guide.cost(p, self.appearance.clamped(sample));
        }
        sum
    }

    /// How badly the piece goes on into what lies around the cell: 0 for a perfect fit, 1 for pieces that have nothing
    /// to do with each other. Divided by the contrast of both sides, so that a piece is neither favoured for being
    /// bland, and so near everything on average, nor for being the opposite.
    #[inline(always)]
    fn misfit(&self, places: &[Place<D>], origin: Place<D>, options: &Options) -> f64 {
        let (mut difference, mut contrast, mut same) = (0i64, 0i64, 0usize);
        for &(q, step) in &self.cell.shell {
            let mine = nearest(add(origin, apply(&self.frame, step)));
            let there = self.appearance.clamped(nearest(places[q as usize]));
            let theirs = self.appearance.feature(there);
            let Some(at) = self.appearance.inside(mine) else {
                difference += OUTSIDE;
                continue;
            };
            let feature = self.appearance.feature(at);
            difference += i64::from(distance(feature, theirs));
            contrast += i64::from(distance(feature, &NOTHING) + distance(theirs, &NOTHING));
            same += usize::from(at == there);
        }
        let shell = self.cell.shell.len().max(1) as f64;
        // Twice the variance of windows is what two of them differ by on average.
        let usual = 2.0 * shell * f64::from(UNIT);
        let scale = options.contrast * contrast as f64 + (1.0 - options.contrast) * usual;
        difference as f64 / scale.max(0.05 * usual) + options.continuation * same as f64 / shell
    }

    /// How much of the piece is shown near by already.
    #[inline(always)]
    fn repeated(&self, origin: Place<D>, near: &[Place<D>], cell: usize) -> f64 {
        let reach = (cell as i32 * ONE / 2).max(ONE);
        let shared = |other: &Place<D>| {
            let far = sub(*other, origin)
                .iter()
                .map(|d| d.abs())
                .max()
                .unwrap_or(0);
            f64::from((reach - far).max(0)) / f64::from(reach)
        };
        near.iter().map(shared).sum()
    }
}

impl<const D: usize> Cells<D> {
    /// The cells within two steps of a cell.
    fn near(&self, c: usize) -> impl Iterator<Item = usize> {
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

/// Gives each point the place that its cell's piece has for it, brought inside the exemplar.
fn spread<const D: usize>(
    appearance: &Appearance<D>,
    cells: &Cells<D>,
    list: &[Cell<D>],
    frames: Frames<'_, D>,
    origins: &[Place<D>],
    places: &mut [Place<D>],
) {
    for (c, cell) in list.iter().enumerate() {
        let frame = cells.frame(frames, c);
        for &p in &cell.points {
            let world = cells.region.world(cells.region.grid.point(p as usize));
            let place = add(origins[c], apply(&frame, cells.step_from_centre(c, world)));
            places[p as usize] = appearance.bring_inside(place);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixed::identity;

    fn exemplar(wrap: bool) -> Appearance<2> {
        let grid = Grid::new([32, 32], [wrap; 2]).unwrap();
        let noise = Noise::new(4);
        let colours: Vec<f32> = (0..grid.len())
            .map(|i| {
                let [y, x] = grid.point(i);
                let wave = (y as f64 * 0.6).sin() + (x as f64 * 0.45).cos();
                (wave + 0.2 * noise.uniform([i as u32, 0, 0, 0])) as f32
            })
            .collect();
        Appearance::new(&colours, grid, 1, 2).unwrap()
    }

    const OPTIONS: Options = Options {
        cell: 6,
        rounds: 4,
        candidates: 64,
        contrast: 1.0,
        continuation: 0.15,
        repetition: 0.3,
        seed: 3,
        margin: 0,
    };

    fn run(
        exemplar: &Appearance<2>,
        origin: [i32; 2],
        side: usize,
        options: &Options,
    ) -> Vec<Place<2>> {
        let region = Region {
            grid: Grid::new([side; 2], [false; 2]).unwrap(),
            origin,
        };
        let frames = Frames::Constant(identity());
        blocks(
            exemplar,
            &region,
            frames,
            None,
            options,
            &Monitor::default(),
        )
        .unwrap()
    }

    #[test]
    fn pieces_are_coherent_and_inside() {
        let exemplar = exemplar(false);
        let places = run(&exemplar, [0; 2], 40, &OPTIONS);
        let mut together = 0;
        for y in 0..40 {
            for x in 0..39 {
                let [a, b] = [places[y * 40 + x], places[y * 40 + x + 1]];
                together += usize::from(sub(b, a) == [0, ONE]);
                assert!(exemplar.inside(nearest(a)).is_some());
            }
        }
        assert!(together > 40 * 39 * 7 / 10, "{together}");
    }

    #[test]
    fn a_window_is_the_same_wherever_it_is_seen_from() {
        let exemplar = exemplar(true);
        // Each half-round reaches one cell further.
        let pad = (OPTIONS.rounds + 2) * OPTIONS.cell * 2;
        let [a, b] = [0, 11].map(|extra| {
            let start = -(pad as i32) - extra;
            let side = 16 + 2 * pad + 2 * extra as usize;
            let places = run(&exemplar, [start; 2], side, &OPTIONS);
            let at =
                |y: usize, x: usize| (y + pad + extra as usize) * side + x + pad + extra as usize;
            (0..256)
                .map(|i| places[at(i / 16, i % 16)])
                .collect::<Vec<_>>()
        });
        assert_eq!(a, b);
    }

    #[test]
    fn cells_that_do_not_count_are_not_missed() {
        let exemplar = exemplar(false);
        let pad = 2 * 4 + OPTIONS.rounds * (2 * 4 + 1);
        let side = 20 + 2 * pad;
        let margin = Options {
            margin: pad,
            ..OPTIONS
        };
        let [all, needed] =
            [OPTIONS, margin].map(|options| run(&exemplar, [-7; 2], side, &options));
        let same = |y: usize, x: usize| all[y * side + x] == needed[y * side + x];
        assert!((pad..pad + 20).all(|y| (pad..pad + 20).all(|x| same(y, x))));
        assert!(!(0..side).all(|x| same(0, x)));
    }

    #[test]
    fn a_guide_is_followed() {
        let exemplar = exemplar(false);
        // The exemplar's rows as the guide: the left half of the output asks for the first, the right for the last.
        let rows: Vec<[i16; 4]> = (0..1024).map(|i| [(i / 32 * 60) as i16, 0, 0, 0]).collect();
        let wanted: Vec<[i16; 4]> = (0..1600)
            .map(|i| [if i % 40 < 20 { 0 } else { 1860 }, 0, 0, 0])
            .collect();
        let weight = vec![256; 1600];
        let guide = Guide::new(&rows, &wanted, &weight, 1024, 1600).unwrap();
        let region = Region {
            grid: Grid::new([40; 2], [false; 2]).unwrap(),
            origin: [0; 2],
        };
        let frames = Frames::Constant(identity());
        let places = blocks(
            &exemplar,
            &region,
            frames,
            Some(guide),
            &OPTIONS,
            &Monitor::default(),
        )
        .unwrap();
        let mean = |side: usize| -> i32 {
            let all = (0..1600)
                .filter(|i| (i % 40 < 20) == (side == 0))
                .map(|i| places[i][0] / ONE);
            all.sum::<i32>() / 800
        };
        assert!(mean(0) < 12 && mean(1) > 20, "{} {}", mean(0), mean(1));
    }

    #[test]
    fn choosing_makes_the_pieces_fit() {
        let exemplar = exemplar(false);
        let seam = |options: &Options| {
            let places = run(&exemplar, [0; 2], 60, options);
            let mut sum = 0i64;
            for y in 0..60 {
                for x in 0..59 {
                    let next = add(places[y * 60 + x], [0, ONE]);
                    let [a, b] =
                        [next, places[y * 60 + x + 1]].map(|p| exemplar.clamped(nearest(p)));
                    sum += i64::from(distance(exemplar.feature(a), exemplar.feature(b)));
                }
            }
            sum
        };
        let placed_anywhere = Options {
            candidates: 1,
            rounds: 1,
            ..OPTIONS
        };
        assert!(seam(&OPTIONS) * 3 < seam(&placed_anywhere) * 2);
    }
}
