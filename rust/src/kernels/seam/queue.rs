//! A queue of nodes by distance, for searches whose distances never fall far behind (Dial, *Algorithm 360: shortest-path
//! forest with topological ordering*, CACM 1969), with buckets of more than one distance.

/// Most buckets that are worth their memory.
const MOST: u32 = 4096;

/// Buckets on a ring. Within a bucket those that came first are taken first, so that a node may be taken before its distance
/// is final; it is then pushed again, and its old entry is stale. Were the last taken first, nodes of a plain where every step
/// costs next to nothing would be taken over and over.
#[derive(Debug, Default)]
pub(super) struct Queue {
    buckets: Vec<Vec<(u32, u32)>>,
    shift: u32,
    current: u32,
    /// Entries of the current bucket that have been taken.
    taken: usize,
    entries: usize,
}

impl Queue {
    /// Empties the queue for keys that rise by at most `step` over the key taken last; `fine` is about the smallest
    /// difference of keys that matters.
    pub(super) fn reset(&mut self, step: u32, fine: u32) {
        let mut shift = fine.max(1).ilog2();
        while (step >> shift) + 2 > MOST {
            shift += 1;
        }
        let buckets = ((step >> shift) + 2).next_power_of_two() as usize;
        for bucket in &mut self.buckets {
            bucket.clear();
        }
        self.buckets.resize_with(buckets, Vec::new);
        self.shift = shift;
        self.current = 0;
        self.taken = 0;
        self.entries = 0;
    }

    /// Where the taking begins: no key is below `key`.
    pub(super) fn begin(&mut self, key: u32) {
        self.current = key >> self.shift;
    }

    #[inline(always)]
    pub(super) fn push(&mut self, key: u32, node: u32, distance: u32) {
        let at = (key >> self.shift) as usize & (self.buckets.len() - 1);
        self.buckets[at].push((node, distance));
        self.entries += 1;
    }

    /// A node and its distance from the lowest bucket, unless that lies beyond `last`.
    #[inline(always)]
    pub(super) fn pop(&mut self, last: u32) -> Option<(u32, u32)> {
        if self.entries == 0 {
            return None;
        }
        let last = last >> self.shift;
        loop {
            if self.current > last {
                return None;
            }
            let at = self.current as usize & (self.buckets.len() - 1);
            let bucket = &mut self.buckets[at];
            if let Some(&entry) = bucket.get(self.taken) {
                self.taken += 1;
                self.entries -= 1;
                return Some(entry);
            }
            bucket.clear();
            self.taken = 0;
            self.current += 1;
        }
    }
}
