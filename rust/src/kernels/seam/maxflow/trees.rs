//! Two trees of residual paths that grow, meet, and adopt orphans.

use super::{BREATH, ENDS, ORPHAN, ROOT, SINK, SOURCE, Solver, Tree};
use crate::Result;
use crate::foundation::par::Monitor;

impl<const D: usize> Solver<D> {
    #[inline(always)]
    fn neighbour<const CYCLIC: bool>(&self, p: u32, axis: usize, side: usize) -> u32 {
        let ends = if CYCLIC { self.node(p).ends } else { 0 };
        p.wrapping_add_signed(self.offsets[usize::from(ends) % ENDS][axis][side])
    }

    /// Returns the axis and the side of a node's parent, and the parent. The node must have a parent.
    #[inline(always)]
    fn up<const CYCLIC: bool>(&self, p: u32) -> (usize, usize, u32) {
        let parent = usize::from(self.node(p).parent);
        let (axis, side) = (parent >> 1, parent & 1);
        (axis, side, self.neighbour::<CYCLIC>(p, axis, side))
    }

    /// Returns the residual capacity of the arc that lets the tree of `p` take its neighbour `q`. In the source's tree
    /// the arc leads from `p` to `q`, in the sink's tree from `q` to `p`.
    #[inline(always)]
    fn arc<const TREE: usize>(&self, p: u32, q: u32, axis: usize, side: usize) -> i32 {
        if TREE == SOURCE {
            self.node(p).residual[axis][side]
        } else {
            self.node(q).residual[axis][side ^ 1]
        }
    }

    #[inline(always)]
    fn activate(&mut self, p: u32) {
        if !self.node(p).active {
            self.node_mut(p).active = true;
            self.queue.push_back(p);
        }
    }

    /// Grows both trees until no node is active or the flow exceeds `most`. Returns whether the
    /// flow is at most `most`.
    pub(super) fn grow<const CYCLIC: bool>(
        &mut self,
        most: i64,
        monitor: &Monitor,
    ) -> Result<bool> {
        let mut grown = 0usize;
        while self.value <= most
            && let Some(p) = self.queue.pop_front()
        {
            if grown.is_multiple_of(BREATH) {
                monitor.check()?;
            }
            grown += 1;
            self.node_mut(p).active = false;
            match self.node(p).tree {
                Tree::Source => self.scan::<SOURCE, CYCLIC>(p, monitor)?,
                Tree::Sink => self.scan::<SINK, CYCLIC>(p, monitor)?,
                Tree::Free => {}
            }
        }
        Ok(self.value <= most)
    }

    /// Offers the arcs of an active node to its neighbours.
    #[inline(always)]
    fn scan<const TREE: usize, const CYCLIC: bool>(
        &mut self,
        p: u32,
        monitor: &Monitor,
    ) -> Result<()> {
        let tree = Tree::OF[TREE];
        for axis in 0..D {
            for side in 0..2 {
                let q = self.neighbour::<CYCLIC>(p, axis, side);
                // Try the same arc again after an augmentation, because the neighbour may be free now, or still in the
                // other tree.
                while self.arc::<TREE>(p, q, axis, side) > 0 {
                    let (stamp, distance) = (self.node(p).stamp, self.node(p).distance + 1);
                    let node = self.node_mut(q);
                    let free = node.tree == Tree::Free;
                    if free || node.tree == tree {
                        // Give the node this path if it is shorter and the node's distance is not more recent.
                        if free || node.stamp <= stamp && node.distance > distance {
                            node.tree = tree;
                            node.parent = (2 * axis + (side ^ 1)) as u8;
                            node.stamp = stamp;
                            node.distance = distance;
                        }
                        if free {
                            self.activate(q);
                        }
                        break;
                    }
                    if TREE == SOURCE {
                        self.augment::<CYCLIC>(p, q, axis, side);
                    } else {
                        self.augment::<CYCLIC>(q, p, axis, side ^ 1);
                    }
                    if self.time.is_multiple_of(BREATH as u32) {
                        monitor.check()?;
                    }
                    if self.node(p).tree != tree {
                        return Ok(());
                    }
                }
            }
        }
        Ok(())
    }

    /// Pushes the bottleneck along the path through the arc from `p` (in the source's tree) to `q`
    /// (in the sink's tree).
    fn augment<const CYCLIC: bool>(&mut self, p: u32, q: u32, axis: usize, side: usize) {
        let mut flow = self.node(p).residual[axis][side];
        flow = self.bottleneck::<SOURCE, CYCLIC>(p, flow);
        flow = self.bottleneck::<SINK, CYCLIC>(q, flow);
        self.value += i64::from(flow);
        self.node_mut(p).residual[axis][side] -= flow;
        self.node_mut(q).residual[axis][side ^ 1] += flow;
        self.push::<SOURCE, CYCLIC>(p, flow);
        self.push::<SINK, CYCLIC>(q, flow);
        self.time += 1;
        while let Some(orphan) = self.orphans.pop_front() {
            if self.node(orphan).tree == Tree::Source {
                self.adopt::<SOURCE, CYCLIC>(orphan);
            } else {
                self.adopt::<SINK, CYCLIC>(orphan);
            }
        }
    }

    /// Returns the minimum of `flow`, of the residual capacities from a node to the root of its
    /// tree, and of the root's terminal.
    #[inline(always)]
    fn bottleneck<const TREE: usize, const CYCLIC: bool>(&self, mut p: u32, mut flow: i32) -> i32 {
        while self.node(p).parent != ROOT {
            let (axis, side, up) = self.up::<CYCLIC>(p);
            flow = flow.min(self.arc::<TREE>(up, p, axis, side ^ 1));
            p = up;
        }
        flow.min(self.node(p).terminal.saturating_abs())
    }

    /// Moves `flow` along the path between a node and the root of its tree. Nodes that lose their
    /// parent become orphans.
    #[inline(always)]
    fn push<const TREE: usize, const CYCLIC: bool>(&mut self, mut p: u32, flow: i32) {
        while self.node(p).parent != ROOT {
            let (axis, side, up) = self.up::<CYCLIC>(p);
            // Flow runs from parent to child in the source's tree, and from child to parent in the
            // sink's tree.
            let (tail, head, side) = if TREE == SOURCE {
                (up, p, side ^ 1)
            } else {
                (p, up, side)
            };
            self.node_mut(head).residual[axis][side ^ 1] += flow;
            let arc = &mut self.node_mut(tail).residual[axis][side];
            *arc -= flow;
            if *arc == 0 {
                self.node_mut(p).parent = ORPHAN;
                self.orphans.push_front(p);
            }
            p = up;
        }
        let root = self.node_mut(p);
        root.terminal -= (1 - 2 * TREE as i32) * flow;
        if root.terminal == 0 {
            root.parent = ORPHAN;
            self.orphans.push_front(p);
        }
    }

    /// Gives an orphan the parent with the shortest path to a root. Without such a parent it
    /// becomes free, and its children become orphans.
    fn adopt<const TREE: usize, const CYCLIC: bool>(&mut self, p: u32) {
        let tree = Tree::OF[TREE];
        let (mut best, mut parent) = (i32::MAX, ORPHAN);
        for axis in 0..D {
            for side in 0..2 {
                let q = self.neighbour::<CYCLIC>(p, axis, side);
                if self.node(q).tree == tree
                    && self.arc::<TREE>(q, p, axis, side ^ 1) > 0
                    && let Some(distance) = self.count::<CYCLIC>(q)
                    && distance < best
                {
                    best = distance;
                    parent = (2 * axis + side) as u8;
                }
            }
        }
        let time = self.time;
        let node = self.node_mut(p);
        node.parent = parent;
        if parent != ORPHAN {
            node.stamp = time;
            node.distance = best + 1;
            return;
        }
        // Mark the node as free, activate neighbours that can reach it, and orphan its children.
        node.tree = Tree::Free;
        node.stamp = 0;
        for axis in 0..D {
            for side in 0..2 {
                let q = self.neighbour::<CYCLIC>(p, axis, side);
                if self.node(q).tree != tree {
                    continue;
                }
                if self.arc::<TREE>(q, p, axis, side ^ 1) > 0 {
                    self.activate(q);
                }
                let node = self.node_mut(q);
                if usize::from(node.parent) == 2 * axis + (side ^ 1) {
                    node.parent = ORPHAN;
                    self.orphans.push_back(q);
                }
            }
        }
    }

    /// Returns the number of steps from a node to the root of its tree, or `None` if an orphan is
    /// on the path. Marks the counted nodes.
    #[inline(always)]
    fn count<const CYCLIC: bool>(&mut self, q: u32) -> Option<i32> {
        let time = self.time;
        let (mut distance, mut p) = (0, q);
        loop {
            let node = self.node_mut(p);
            if node.stamp == time {
                distance += node.distance;
                break;
            }
            distance += 1;
            if node.parent == ROOT {
                node.stamp = time;
                node.distance = 1;
                break;
            }
            if node.parent == ORPHAN {
                return None;
            }
            p = self.up::<CYCLIC>(p).2;
        }
        // Mark the path, so that later counts in this augmentation stop at it.
        let (mut left, mut p) = (distance, q);
        while self.node(p).stamp != time {
            let node = self.node_mut(p);
            node.stamp = time;
            node.distance = left;
            left -= 1;
            p = self.up::<CYCLIC>(p).2;
        }
        Some(distance)
    }
}
