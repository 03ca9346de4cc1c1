//! The filtered cost maps of one search, and the search of the exact minimum in them.

use super::costs::Map;
use super::filter::Multiplier;
use super::score::Prepared;
use super::{Block, Index, Match, Pick, Query, too_dear};
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// Cost of a multiplication of direct scoring, in units of the filter's work. Positions are scored directly if this is
/// cheaper than the filter.
const DIRECT: f64 = 1.0;

/// Number of candidates that are scored before the search checks whether it can stop.
const ROUND: usize = 4096;

/// Number of candidates in each parallel task.
const CHUNK: usize = 16;

/// Buffers of one search.
#[derive(Default)]
pub(super) struct Workspace {
    prepared: Prepared,
    multipliers: Vec<Multiplier>,
    maps: Vec<Map>,
    candidates: Vec<Candidate>,
    /// Candidates that were scored for earlier matches.
    scored: Vec<Candidate>,
}

/// A position that may be the best: exemplar, row, column.
#[derive(Clone, Copy, Default)]
struct Candidate {
    at: [u32; 3],
    cost: f64,
}

impl Workspace {
    pub(super) fn maps(&self) -> &[Map] {
        &self.maps
    }
}

impl Index {
    fn check_size(&self, query: &Query<'_>) -> Result<()> {
        let [rows, columns] = query.shape;
        if rows > self.max_patch[0] || columns > self.max_patch[1] {
            let message = format!(
                "must be at most {:?}, the largest patch of this index, got ({rows}, {columns})",
                self.max_patch
            );
            return Err(Error::value("patch", message));
        }
        Ok(())
    }

    /// Computes the cost maps of a range of blocks. Returns a factor and an offset: an exact cost is the filtered cost
    /// times the factor, plus the offset.
    pub(super) fn filter(
        &self,
        query: &Query<'_>,
        blocks: std::ops::Range<usize>,
        monitor: &Monitor,
        workspace: &mut Workspace,
    ) -> Result<(f64, f64)> {
        // Compute the spectra of the kernels, one for each layer.
        self.check_size(query)?;
        workspace.prepared.fill(query, self.channels)?;
        workspace
            .prepared
            .normalise(&self.known.mean, self.known.scale);
        let prepared = &workspace.prepared;
        let layers = self.channels + 1;
        workspace
            .multipliers
            .resize_with(layers, Multiplier::default);
        par::chunks_mut(&mut workspace.multipliers, 1, |layer, multiplier| {
            let mut scratch = self.scratch.take();
            let row = |r: usize, out: &mut [f32]| prepared.kernel_row(layer, r, out);
            self.plan
                .multiplier(query.shape[0], row, &mut multiplier[0], &mut scratch);
            self.scratch.give(scratch);
        });

        // Correlate each block with the kernels.
        let multipliers = &workspace.multipliers;
        let spectra = self.spectra();
        let stride = 2 * self.plan.len() * layers;
        let (unit, offset) = prepared.unit();
        workspace.maps.resize_with(blocks.len(), Map::default);
        par::chunks_mut(&mut workspace.maps, 1, |i, maps| {
            let (b, map) = (blocks.start + i, &mut maps[0]);
            let Block { exemplar, corner } = self.blocks[b];
            let of = &self.exemplars[exemplar];
            map.least = f32::INFINITY;
            map.absolute = 0.0;
            map.valid = self.plan.valid(of.shape, corner, query.shape);
            map.costs.resize(map.valid[0] * map.valid[1], 0.0);
            if map.costs.is_empty() || monitor.check().is_err() {
                return;
            }
            let mut scratch = self.scratch.take();
            let written = self.plan.correlate(
                &spectra.values[b * stride..][..stride],
                multipliers,
                map.valid,
                &mut map.costs,
                &mut scratch,
            );
            self.scratch.give(scratch);
            // Bound the error of this block, and add the means that were removed before the
            // transform.
            let (mut correlated, mut rounded, mut level) = (0.0, 0.0, 0.0);
            for (layer, of) in spectra.levels[b * layers..][..layers].iter().enumerate() {
                let kernel = prepared.kernel(layer);
                correlated += kernel.norm * of.norm;
                rounded += kernel.norm * of.mean.abs();
                level += kernel.sum * of.mean;
            }
            let pixels = (query.shape[0] * query.shape[1]) as f64;
            map.absolute = self.plan.epsilon(layers) * (2.0 * correlated + written)
                + f64::from(f32::EPSILON) * (rounded * pixels.sqrt() + level.abs())
                + offset / unit * 2f64.powi(-40)
                + f64::from(f32::MIN_POSITIVE);
            for cost in &mut map.costs {
                *cost += level as f32;
            }
            // Exclude forbidden positions.
            if let Some(allowed) = &of.allowed {
                for (r, row) in map.costs.chunks_exact_mut(map.valid[1]).enumerate() {
                    let start = (corner[0] + r) * of.shape[1] + corner[1];
                    for (cost, &allowed) in row.iter_mut().zip(&allowed[start..]) {
                        if !allowed {
                            *cost = f32::INFINITY;
                        }
                    }
                }
            }
            map.update();
        });
        monitor.check()?;
        Ok((unit, offset))
    }

    /// Fills the maps with exact scores instead of filtered costs, which is faster for few samples or positions.
    fn evaluate(
        &self,
        query: &Query<'_>,
        monitor: &Monitor,
        workspace: &mut Workspace,
    ) -> Result<()> {
        workspace.prepared.fill(query, self.channels)?;
        workspace
            .prepared
            .normalise(&self.known.mean, self.known.scale);
        let prepared = &workspace.prepared;
        let unit = prepared.largest_cost(self.known.scale);
        workspace.maps.resize_with(self.blocks.len(), Map::default);
        par::chunks_mut(&mut workspace.maps, 1, |b, maps| {
            let map = &mut maps[0];
            let Block { exemplar, corner } = self.blocks[b];
            let of = &self.exemplars[exemplar];
            map.least = f32::INFINITY;
            map.absolute = f64::from(f32::MIN_POSITIVE);
            map.valid = self.plan.valid(of.shape, corner, query.shape);
            map.costs.clear();
            if monitor.check().is_err() {
                return;
            }
            // If few positions are allowed, score only those.
            if let Some(open) = &self.open[exemplar] {
                map.costs.resize(map.valid[0] * map.valid[1], f32::INFINITY);
                let columns = of.shape[1];
                let first = open.partition_point(|&at| (at as usize) < corner[0] * columns);
                for &at in &open[first..] {
                    let (r, c) = (at as usize / columns, at as usize % columns);
                    if r >= corner[0] + map.valid[0] {
                        break;
                    }
                    if (corner[1]..corner[1] + map.valid[1]).contains(&c) {
                        let cost = prepared.cost(&of.data, of.shape, [r, c]) / unit;
                        map.costs[(r - corner[0]) * map.valid[1] + c - corner[1]] = cost as f32;
                    }
                }
                map.update();
                return;
            }
            for r in corner[0]..corner[0] + map.valid[0] {
                for c in corner[1]..corner[1] + map.valid[1] {
                    let allowed = of.allowed.as_ref().is_none_or(|a| a[r * of.shape[1] + c]);
                    map.costs.push(if allowed {
                        (prepared.cost(&of.data, of.shape, [r, c]) / unit) as f32
                    } else {
                        f32::INFINITY
                    });
                }
            }
            map.update();
        });
        monitor.check()
    }

    pub(super) fn search(
        &self,
        query: &Query<'_>,
        pick: &Pick,
        monitor: &Monitor,
        workspace: &mut Workspace,
    ) -> Result<Vec<Match>> {
        // Reject a patch that is larger than all exemplars.
        self.check_size(query)?;
        let [p, q] = query.shape;
        let along = |length: usize, patch: usize| (length + 1).saturating_sub(patch);
        let positions: usize = (self.exemplars.iter())
            .map(|e| along(e.shape[0], p) * along(e.shape[1], q))
            .sum();
        if positions == 0 {
            let message = format!(
                "must fit into one of the exemplars of shapes {:?}, got ({p}, {q})",
                self.shapes()
            );
            return Err(Error::value("patch", message));
        }
        let samples = (p * q * self.channels) as f64;
        // An exemplar with a list of allowed positions is scored only at these.
        let open = self.exemplars.iter().zip(&self.open).map(|(e, open)| {
            let all = along(e.shape[0], p) * along(e.shape[1], q);
            open.as_ref().map_or(all, |open| open.len().min(all))
        });
        let positions: usize = open.sum();
        if positions as f64 * samples * DIRECT < self.plan.work {
            self.evaluate(query, monitor, workspace)?;
        } else {
            self.filter(query, 0..self.blocks.len(), monitor, workspace)?;
        }
        // Take the best match repeatedly, and forbid the positions around it.
        workspace.scored.clear();
        let mut found: Vec<Match> = Vec::new();
        while found.len() < pick.count {
            let Some(next) = self.next(monitor, workspace)? else {
                break;
            };
            if found.first().is_some_and(|f| too_dear(f, &next, pick)) {
                break;
            }
            self.forbid_around(&next, pick.separation, &mut workspace.maps);
            found.push(next);
        }
        Ok(found)
    }

    /// Returns the exact best of the positions that are still allowed.
    fn next(&self, monitor: &Monitor, workspace: &mut Workspace) -> Result<Option<Match>> {
        let Workspace {
            prepared,
            maps,
            candidates,
            scored,
            ..
        } = workspace;
        let prepared = &*prepared;
        // At least one position costs at most `limit`. Positions whose cost is certainly above it
        // are not the best.
        let least = maps.iter().filter(|m| m.least < f32::INFINITY);
        let limit = least
            .map(|m| f64::from(m.least) + m.error(m.least))
            .fold(f64::INFINITY, f64::min);
        if limit == f64::INFINITY {
            return Ok(None);
        }
        candidates.clear();
        for (block, map) in self.blocks.iter().zip(maps.iter()) {
            let limit = (limit + map.error(limit as f32)) as f32;
            let limit = (limit + f32::EPSILON * limit.abs()).next_up();
            if map.least > limit {
                continue;
            }
            map.within(limit, |r, c| {
                let (r, c) = (block.corner[0] + r, block.corner[1] + c);
                candidates.push(Candidate {
                    at: [block.exemplar as u32, r as u32, c as u32],
                    cost: f64::NAN,
                });
            });
        }
        // Reuse the exact costs of candidates that were scored for earlier matches.
        candidates.sort_unstable_by_key(|c| c.at);
        let mut known = scored.iter().peekable();
        for c in candidates.iter_mut() {
            while known.next_if(|k| k.at < c.at).is_some() {}
            if let Some(k) = known.next_if(|k| k.at == c.at) {
                c.cost = k.cost;
            }
        }
        // Candidates are in order of position, and only a lower cost replaces the best, so ties go
        // to the first. The search stops at cost 0, which cannot be improved.
        let mut best = Candidate {
            cost: f64::INFINITY,
            ..Candidate::default()
        };
        let mut seen = 0;
        for round in candidates.chunks_mut(ROUND) {
            monitor.check()?;
            par::chunks_mut(round, CHUNK, |_, chunk| {
                for c in chunk.iter_mut().filter(|c| c.cost.is_nan()) {
                    let [e, row, column] = c.at.map(|x| x as usize);
                    let of = &self.exemplars[e];
                    c.cost = prepared.cost(&of.data, of.shape, [row, column]);
                }
            });
            for &c in round.iter() {
                if c.cost < best.cost {
                    best = c;
                }
            }
            seen += round.len();
            if best.cost == 0.0 {
                break;
            }
        }
        candidates.truncate(seen);
        std::mem::swap(candidates, scored);
        let [exemplar, row, column] = best.at.map(|x| x as usize);
        Ok(Some(Match {
            cost: best.cost,
            exemplar,
            row,
            column,
        }))
    }

    fn forbid_around(&self, taken: &Match, separation: usize, maps: &mut [Map]) {
        let centre = [taken.row, taken.column];
        for (block, map) in self.blocks.iter().zip(maps) {
            if block.exemplar != taken.exemplar {
                continue;
            }
            let [rows, columns]: [std::ops::Range<usize>; 2] = std::array::from_fn(|axis| {
                let low = centre[axis].saturating_sub(separation);
                let high = centre[axis].saturating_add(separation).saturating_add(1);
                let corner = block.corner[axis];
                low.saturating_sub(corner)..high.saturating_sub(corner).min(map.valid[axis])
            });
            if rows.is_empty() || columns.is_empty() {
                continue;
            }
            for r in rows.clone() {
                map.costs[r * map.valid[1]..][columns.clone()].fill(f32::INFINITY);
            }
            map.update_rows(rows);
        }
    }
}
