//! Division of unknowns into two parts and a separator between them.

use super::NONE;
use super::grid::{AXES, Grid, Item, Links};
use crate::Result;
use crate::foundation::memory;

/// A level is wide if it contains more than 1 / `MANY` of the unknowns of the part.
const MANY: usize = 4;
/// An unknown is a hub if it is coupled to more than `HUB` times as many unknowns as the average.
const HUB: usize = 4;

/// Result of the division of a part.
pub(super) enum Cut {
    /// The part is eliminated at once.
    Leaf,
    /// The list contains the unknowns of the first side, then of the second side, then of the separator. `low` and
    /// `high` are the numbers of unknowns of the two sides.
    Parts { low: usize, high: usize },
    /// Number of unknowns of each piece. The pieces are not coupled to each other.
    Pieces(Vec<usize>),
}

/// Scratch memory.
pub(super) struct Scratch {
    items: Vec<Item>,
    /// Distance from the start of the search, for unknowns that are not on a grid.
    level: Vec<u32>,
    counts: Vec<u32>,
}

impl Scratch {
    pub(super) fn new(size: usize, grid: bool) -> Result<Self> {
        let what = "the order of the matrix";
        Ok(Self {
            items: memory::filled(what, [0; AXES], size)?,
            level: memory::filled(what, NONE, if grid { 0 } else { size })?,
            counts: Vec::new(),
        })
    }

    /// Divides unknowns of a grid along the axis with the cheapest separator.
    pub(super) fn cut_grid(&mut self, part: &mut [Item], grid: Grid) -> Cut {
        let (low, high) = bound(part);
        let sizes: [usize; AXES] = std::array::from_fn(|k| (high[k] - low[k]) as usize + 1);
        self.counts.clear();
        self.counts.resize(sizes.iter().sum(), 0);
        let (rows, rest) = self.counts.split_at_mut(sizes[0]);
        let (columns, rest) = rest.split_at_mut(sizes[1]);
        let (falling, rising) = rest.split_at_mut(sizes[2]);
        // Count the unknowns on each line of each axis, and choose the best line.
        for item in part.iter() {
            rows[(item[0] - low[0]) as usize] += 1;
            columns[(item[1] - low[1]) as usize] += 1;
            falling[(item[2] - low[2]) as usize] += 1;
            rising[(item[3] - low[3]) as usize] += 1;
        }
        let mut best: Option<(f64, usize, u32)> = None;
        for (axis, counts) in [rows, columns, falling, rising].into_iter().enumerate() {
            if let Some((cost, at)) = choose(counts, grid.reach[axis] as usize)
                && best.is_none_or(|(least, _, _)| cost < least)
            {
                best = Some((cost, axis, low[axis] + at as u32));
            }
        }
        if let Some((_, axis, first)) = best {
            let end = first + grid.reach[axis];
            return self.share_out(part, |item| match item[axis] {
                at if at < first => 0,
                at if at < end => 2,
                _ => 1,
            });
        }
        Cut::Leaf
    }

    /// Divides unknowns that are not on a grid, along a level of a breadth-first search from a
    /// remote unknown.
    pub(super) fn cut_levels(&mut self, part: &mut [Item], links: &Links) -> Cut {
        const HERE: u32 = NONE - 1;
        let mut start = part[0][1];
        let (mut levels, mut found) = (0, 0);
        // Repeat the search from the last unknown found, which is more remote, at most three times.
        for _ in 0..3 {
            for item in part.iter() {
                self.level[item[1] as usize] = HERE;
            }
            (self.items[0], found) = ([0, start, 0, 0], 1);
            self.level[start as usize] = 0;
            let mut read = 0;
            while read < found {
                let own = self.items[read][1];
                read += 1;
                for &other in links.of(own) {
                    if self.level[other as usize] == HERE {
                        self.level[other as usize] = self.level[own as usize] + 1;
                        self.items[found] = [0, other, 0, 0];
                        found += 1;
                    }
                }
            }
            if found < part.len() {
                break;
            }
            let last = self.items[found - 1][1];
            let far = self.level[last as usize];
            if far <= levels {
                break;
            }
            (levels, start) = (far, last);
        }
        // If the search does not reach all unknowns, the part is not connected.
        if found < part.len() {
            return self.list_pieces(part, links, found, HERE);
        }
        self.counts.clear();
        self.counts.resize(
            self.level[self.items[found - 1][1] as usize] as usize + 1,
            0,
        );
        for item in part.iter() {
            self.counts[self.level[item[1] as usize] as usize] += 1;
        }
        let cut = match choose(&self.counts, 1) {
            Some((_, at)) if self.counts[at] as usize > part.len() / MANY => {
                // A wide level means that a few hubs are coupled to most unknowns, so cut at the
                // hubs.
                let hubs = self.list_hubs(part, links);
                self.cut_at(part, links, at, &hubs)
            }
            Some((_, at)) => self.cut_at(part, links, at, &[]),
            None => Cut::Leaf,
        };
        for item in part.iter() {
            self.level[item[1] as usize] = NONE;
        }
        cut
    }

    /// Returns the hubs of a part in order. A hub is coupled to many more unknowns of the part than the average
    /// unknown.
    fn list_hubs(&self, part: &[Item], links: &Links) -> Vec<u32> {
        let inside = |&&other: &&u32| self.level[other as usize] != NONE;
        let degree = |item: &Item| links.of(item[1]).iter().filter(inside).count();
        let total: usize = part.iter().map(degree).sum();
        let mut hubs: Vec<u32> = (part.iter())
            .filter(|item| degree(item) * part.len() > HUB * total)
            .map(|item| item[1])
            .collect();
        hubs.sort_unstable();
        hubs
    }

    /// Divides unknowns along a level, or at the hubs if there are fewer hubs than unknowns of the level.
    fn cut_at(&mut self, part: &mut [Item], links: &Links, at: usize, hubs: &[u32]) -> Cut {
        if (1..self.counts[at] as usize).contains(&hubs.len()) {
            return self.share_out(part, |item| {
                2 * usize::from(hubs.binary_search(&item[1]).is_ok())
            });
        }
        let (at, level) = (at as u32, std::mem::take(&mut self.level));
        let cut = self.share_out(part, |item| {
            let own = level[item[1] as usize];
            let parts = || {
                let mut others = links.of(item[1]).iter();
                // Unknowns of other parts have the level [`NONE`], so they do not count.
                others.any(|&other| level[other as usize] == at + 1)
            };
            if own < at || (own == at && !parts()) {
                0
            } else {
                1 + usize::from(own == at)
            }
        });
        self.level = level;
        cut
    }

    /// Lists connected unknowns piece by piece. The first `found` unknowns are one piece.
    fn list_pieces(&mut self, part: &mut [Item], links: &Links, found: usize, here: u32) -> Cut {
        let mut sizes = vec![found];
        let (mut read, mut found) = (found, found);
        for item in part.iter() {
            if self.level[item[1] as usize] != here {
                continue;
            }
            let before = found;
            self.level[item[1] as usize] = 0;
            self.items[found] = *item;
            found += 1;
            while read < found {
                for &other in links.of(self.items[read][1]) {
                    if self.level[other as usize] == here {
                        self.level[other as usize] = 0;
                        self.items[found] = [0, other, 0, 0];
                        found += 1;
                    }
                }
                read += 1;
            }
            sizes.push(found - before);
        }
        part.copy_from_slice(&self.items[..part.len()]);
        for item in part.iter() {
            self.level[item[1] as usize] = NONE;
        }
        Cut::Pieces(sizes)
    }

    /// Groups the unknowns of the first side, of the second side and of the separator, each in
    /// their order.
    fn share_out(&mut self, part: &mut [Item], side: impl Fn(&Item) -> usize) -> Cut {
        let sides = &mut self.items[..part.len()];
        // The first side stays in place. The second side and the separator are buffered and copied
        // behind it, the separator in reverse.
        let (mut low, mut high, mut between) = (0, 0, part.len());
        for i in 0..part.len() {
            let item = part[i];
            match side(&item) {
                0 => {
                    part[low] = item;
                    low += 1;
                }
                1 => {
                    sides[high] = item;
                    high += 1;
                }
                _ => {
                    between -= 1;
                    sides[between] = item;
                }
            }
        }
        part[low..low + high].copy_from_slice(&sides[..high]);
        for (item, from) in part[low + high..]
            .iter_mut()
            .zip(sides[between..].iter().rev())
        {
            *item = *from;
        }
        Cut::Parts { low, high }
    }
}

/// Returns the lowest and the highest places along all axes.
fn bound(part: &[Item]) -> (Item, Item) {
    let (mut low, mut high) = ([u32::MAX; AXES], [0; AXES]);
    for item in part {
        for axis in 0..AXES {
            low[axis] = low[axis].min(item[axis]);
            high[axis] = high[axis].max(item[axis]);
        }
    }
    (low, high)
}

/// Returns the cost and the first line of the best separator of `reach` adjacent lines. A good separator has few
/// unknowns, and equal numbers of unknowns on both sides.
fn choose(counts: &[u32], reach: usize) -> Option<(f64, usize)> {
    let total: u64 = counts.iter().map(|&n| u64::from(n)).sum();
    let mut best: Option<(f64, usize)> = None;
    let mut low = 0u64;
    let mut between: u64 = counts.iter().take(reach).map(|&n| u64::from(n)).sum();
    for at in 0..counts.len().saturating_sub(reach) {
        // The lines from `at` on are the separator, with `between` unknowns.
        let high = total - low - between;
        if low > 0 && high > 0 {
            let all = (low + high) as f64;
            let cost = (between as f64 + 0.01) * (all / low as f64) * (all / high as f64);
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, at));
            }
        }
        low += u64::from(counts[at]);
        between = between + u64::from(counts[at + reach]) - u64::from(counts[at]);
    }
    best
}
