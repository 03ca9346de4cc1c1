//! Threads: a pool that belongs to the process, fixed chunks, progress and cancellation.
//!
//! Only this file uses rayon. Its global pool is never used, because threads do not survive a
//! `fork` and a child that inherits a pool waits forever. The pools of this module are keyed by the
//! process id, built on first use and never dropped.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::{Error, Result};

/// A link of the list of pools, which grows at its end. The list is never locked while a pool is
/// being built. After a `fork` at any moment, the child can therefore traverse the list.
struct Link {
    process: u32,
    threads: usize,
    pool: ThreadPool,
    next: OnceLock<Box<Link>>,
}

static POOLS: OnceLock<Box<Link>> = OnceLock::new();

/// Returns the number of threads if the caller requests none: `RAYON_NUM_THREADS`, or the number of
/// available cores.
pub fn default_threads() -> usize {
    std::env::var("RAYON_NUM_THREADS")
        .ok()
        .and_then(|text| text.parse().ok())
        .filter(|&n| n > 0)
        .or_else(|| std::thread::available_parallelism().ok().map(usize::from))
        .unwrap_or(1)
        .min(MAX_THREADS)
}

/// Maximum number of threads. More threads would only cost memory.
pub const MAX_THREADS: usize = 1024;

fn pool(threads: usize) -> Result<&'static ThreadPool> {
    let process = std::process::id();
    let mut slot = &POOLS;
    let mut built = None;
    loop {
        match slot.get() {
            // The list is append-only, so it can be traversed without a lock.
            Some(link) if link.process == process && link.threads == threads => {
                return Ok(&link.pool);
            }
            Some(link) => slot = &link.next,
            None => {
                let pool = match built.take() {
                    Some(pool) => pool,
                    None => ThreadPoolBuilder::new()
                        .num_threads(threads)
                        .thread_name(|i| format!("texrs-{i}"))
                        .build()
                        .map_err(|e| {
                            Error::value("threads", format!("cannot start {threads} threads: {e}"))
                        })?,
                };
                let link = Box::new(Link {
                    process,
                    threads,
                    pool,
                    next: OnceLock::new(),
                });
                // Another thread may have appended first. Keep the built pool and continue.
                if let Err(lost) = slot.set(link) {
                    built = Some(lost.pool);
                }
            }
        }
    }
}

/// Shared state of a running kernel and its caller: progress and cancellation.
#[derive(Debug)]
pub struct Monitor {
    done: AtomicU64,
    total: AtomicU64,
    cancelled: AtomicBool,
    started: Instant,
}

impl Default for Monitor {
    fn default() -> Self {
        Self {
            done: AtomicU64::new(0),
            total: AtomicU64::new(0),
            cancelled: AtomicBool::new(false),
            started: Instant::now(),
        }
    }
}

impl Monitor {
    /// Announces the total number of steps.
    pub fn expect(&self, steps: u64) {
        self.total.store(steps, Ordering::Relaxed);
    }

    /// Reports that `steps` more steps are done.
    ///
    /// # Errors
    /// The caller has asked to stop.
    pub fn advance(&self, steps: u64) -> Result<()> {
        self.done.fetch_add(steps, Ordering::Relaxed);
        self.check()
    }

    /// Returns an error if the caller has asked to stop.
    pub fn check(&self) -> Result<()> {
        if self.cancelled.load(Ordering::Relaxed) {
            return Err(Error::Cancelled(self.started.elapsed()));
        }
        Ok(())
    }

    /// Asks the kernel to stop.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Returns the fraction of the announced steps that is done, 0 to 1.
    pub fn fraction(&self) -> f64 {
        let total = self.total.load(Ordering::Relaxed);
        if total == 0 {
            return 0.0;
        }
        (self.done.load(Ordering::Relaxed) as f64 / total as f64).min(1.0)
    }
}

/// Runs `work` in the pool of `threads` threads. Zero means [`default_threads`].
pub fn install<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> Result<R> {
    let threads = if threads == 0 {
        default_threads()
    } else {
        threads.min(MAX_THREADS)
    };
    Ok(pool(threads)?.install(work))
}

/// Runs `work` in the pool while the calling thread calls `poll` about every `interval`.
///
/// If `poll` fails, the function cancels the monitor, waits for the kernel and returns the error of
/// `poll`.
pub fn watch<R: Send, E: From<Error>>(
    threads: usize,
    interval: Duration,
    work: impl FnOnce(&Monitor) -> Result<R> + Send,
    mut poll: impl FnMut(&Monitor) -> std::result::Result<(), E>,
) -> std::result::Result<R, E> {
    let threads = if threads == 0 {
        default_threads()
    } else {
        threads.min(MAX_THREADS)
    };
    let monitor = Monitor::default();
    let (send, receive) = std::sync::mpsc::sync_channel(1);
    let mut stopped = None;
    let result = pool(threads)?.in_place_scope(|scope| {
        let monitor = &monitor;
        // Move the sender into the task, so that a panic of the task drops it and ends the loop
        // below. The receiver lives until the scope ends, so the send cannot fail.
        scope.spawn(move |_| {
            let _ = send.send(work(monitor));
        });
        // Poll until the task sends its result. After an error of `poll`, only wait for the task.
        loop {
            match receive.recv_timeout(interval) {
                Ok(result) => return Some(result),
                Err(std::sync::mpsc::RecvTimeoutError::Timeout) => {
                    if stopped.is_none()
                        && let Err(error) = poll(monitor)
                    {
                        monitor.cancel();
                        stopped = Some(error);
                    }
                }
                Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => return None,
            }
        }
    });
    match (stopped, result) {
        (Some(error), _) => Err(error),
        (None, Some(result)) => Ok(result?),
        (None, None) => unreachable!("a scope resumes the panic of its task"),
    }
}

/// Number of threads of the pool that the caller runs in, or 1 outside all pools. Kernels use it to
/// skip a division of work that changes only the time.
pub(crate) fn threads() -> usize {
    rayon::current_thread_index().map_or(1, |_| rayon::current_num_threads())
}

/// Calls `f(i, chunk)` for each chunk of `size` items. Chunks depend only on `size`, so results do
/// not depend on the number of threads.
pub fn chunks_mut<T: Send>(data: &mut [T], size: usize, f: impl Fn(usize, &mut [T]) + Sync + Send) {
    if data.len() <= size {
        // A single chunk runs on the calling thread, which then need not be in a pool. Other
        // threads stay asleep.
        if !data.is_empty() {
            f(0, data);
        }
        return;
    }
    data.par_chunks_mut(size.max(1))
        .enumerate()
        .for_each(|(i, chunk)| f(i, chunk));
}

/// Returns `[f(0), f(1), ...]` in order.
pub fn map<T: Send>(n: usize, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    (0..n).into_par_iter().map(f).collect()
}

/// Runs both closures and returns both results.
pub fn join<A: Send, B: Send>(
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    rayon::join(a, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pools_have_the_threads_asked_for() {
        assert_eq!(threads(), 1);
        for threads in [1, 2, 7] {
            assert_eq!(
                install(threads, rayon::current_num_threads).unwrap(),
                threads
            );
            assert_eq!(install(threads, super::threads).unwrap(), threads);
        }
    }

    #[test]
    fn a_failing_poll_stops_the_work() {
        let outcome: Result<()> = watch(
            2,
            Duration::from_millis(1),
            |monitor| loop {
                monitor.advance(1)?;
                std::thread::sleep(Duration::from_millis(1));
            },
            |_| Err(Error::value("poll", "stop")),
        );
        assert_eq!(outcome, Err(Error::value("poll", "stop")));
    }

    #[test]
    fn a_panic_in_the_work_reaches_the_caller() {
        let outcome = std::panic::catch_unwind(|| {
            watch::<(), Error>(
                1,
                Duration::from_millis(1),
                |_| panic!("inside"),
                |_| Ok(()),
            )
        });
        assert!(outcome.is_err());
    }
}
