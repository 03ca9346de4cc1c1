//! A queue of nodes by distance, for searches that advance by bounded steps. It is Dial's queue (*Algorithm 360:
//! shortest-path forest with topological ordering*, CACM 1969) with buckets that span more than one distance.

/// Maximum number of buckets. More buckets would cost memory without benefit.
const MOST: u32 = 4096;

/// A ring of buckets.
///
/// Within a bucket, the oldest entry is taken first, so a node may be taken before its distance is
/// final. It is then pushed again, and its old entry is stale. If the newest entry were taken
/// first, nodes in a region of nearly zero costs would be taken over and over.
#[derive(Debug, Default)]
pub(super) struct Queue {
    buckets: Vec<Vec<(u32, u32)>>,
    shift: u32,
    current: u32,
    /// Number of taken entries of the current bucket.
    taken: usize,
    entries: usize,
}

impl Queue {
    /// Empties the queue. Keys may exceed the last taken key by at most `step`. `fine` is about the
    /// smallest relevant difference of keys.
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

    /// Sets the start of the search. No key is below `key`.
    pub(super) fn begin(&mut self, key: u32) {
        self.current = key >> self.shift;
    }

    #[inline(always)]
    pub(super) fn push(&mut self, key: u32, node: u32, distance: u32) {
        let at = (key >> self.shift) as usize & (self.buckets.len() - 1);
        self.buckets[at].push((node, distance));
        self.entries += 1;
    }

    /// Returns a node of the lowest bucket and its distance, or `None` if the queue is empty or the bucket is beyond
    /// `last`.
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
