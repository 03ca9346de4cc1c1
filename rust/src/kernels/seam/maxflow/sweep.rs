//! Flow that is pushed along the lines of the grid before the trees grow.

use super::Solver;
use super::layout::Layout;

/// Number of lines that are swept together. They fill cache lines and stay in the cache from one
/// pass to the next.
const LINES: usize = 16;

impl<const D: usize> Solver<D> {
    /// Pushes flow along every line to demands further along it.
    pub(super) fn sweep(&mut self, layout: &Layout<D>) {
        for axis in (0..D).rev() {
            let (stride, length) = (layout.strides[axis], layout.shape[axis]);
            let block = stride * (length + usize::from(!layout.cyclic[axis]));
            for from in (layout.first..layout.len).step_by(block) {
                for line in (0..stride).step_by(LINES) {
                    let lines = LINES.min(stride - line);
                    self.lines::<0>(from + line, lines, stride, length, axis);
                    self.lines::<1>(from + line, lines, stride, length, axis);
                }
            }
        }
    }

    /// Sweeps adjacent lines towards their end (`SIDE` 0) or their start (`SIDE` 1). Arcs across the ends of a wrapped
    /// axis are not used.
    fn lines<const SIDE: usize>(
        &mut self,
        from: usize,
        lines: usize,
        stride: usize,
        length: usize,
        axis: usize,
    ) {
        let nodes = &mut self.nodes[from..from + (length - 1) * stride + lines];
        // Returns the offset of a row of nodes, one of each line, in the order of the sweep.
        let row = |i: usize| (if SIDE == 0 { i } else { length - 1 - i }) * stride;
        for node in &mut nodes[row(length - 1)..][..lines] {
            node.distance = 0;
        }
        // Accumulate the demand further along each line, limited by the capacities.
        for i in (0..length - 1).rev() {
            let (p, q) = (row(i), row(i + 1));
            for k in 0..lines {
                let next = nodes[q + k];
                let need = next.distance.saturating_sub(next.terminal).max(0);
                nodes[p + k].distance = need.min(nodes[p + k].residual[axis][SIDE]);
            }
        }
        // Push the flow that can satisfy this demand.
        for i in 0..length - 1 {
            let (p, q) = (row(i), row(i + 1));
            for k in 0..lines {
                let node = &mut nodes[p + k];
                let flow = node.terminal.min(node.distance);
                if flow > 0 {
                    node.terminal -= flow;
                    node.residual[axis][SIDE] -= flow;
                    let next = &mut nodes[q + k];
                    self.value += i64::from(next.terminal.saturating_neg().clamp(0, flow));
                    next.terminal += flow;
                    next.residual[axis][SIDE ^ 1] += flow;
                }
            }
        }
    }
}
