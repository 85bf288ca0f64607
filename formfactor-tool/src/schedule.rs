//! Work done on all cores, taken over in order: what is finished early waits, and no more waits than fits in a budget.

use std::collections::BTreeMap;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

struct State<T, E> {
    next_start: usize,
    next_take: usize,
    /// Cost of what is being done or waits.
    in_flight: usize,
    ready: BTreeMap<usize, T>,
    taking: bool,
    stopped: bool,
    error: Option<E>,
}

struct Line<T, E> {
    state: Mutex<State<T, E>>,
    changed: Condvar,
}

impl<T, E> Line<T, E> {
    fn lock(&self) -> MutexGuard<'_, State<T, E>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Lets the others go home when one of them panics.
struct StopOnPanic<'a, T, E>(&'a Line<T, E>);

impl<T, E> Drop for StopOnPanic<'_, T, E> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.lock().stopped = true;
            self.0.changed.notify_all();
        }
    }
}

/// Does `work(i)` for each i in `items` on `threads` threads and hands the results to `take` in order. The costs of what
/// is under way or waits add up to at most `budget`, or are one item's.
///
/// # Errors
/// The first error of `take`, after which nothing new is begun.
pub fn in_order<T: Send, E: Send>(
    items: std::ops::Range<usize>,
    threads: usize,
    budget: usize,
    cost: impl Fn(usize) -> usize + Sync,
    work: impl Fn(usize) -> T + Sync,
    take: impl FnMut(usize, T) -> Result<(), E> + Send,
) -> Result<(), E> {
    let (first, end) = (items.start, items.end.max(items.start));
    let line = Line {
        state: Mutex::new(State {
            next_start: first,
            next_take: first,
            in_flight: 0,
            ready: BTreeMap::new(),
            taking: false,
            stopped: false,
            error: None,
        }),
        changed: Condvar::new(),
    };
    let take = Mutex::new(take);
    let worker = || {
        let _guard = StopOnPanic(&line);
        loop {
            // Claim the next item, once there is room for it.
            let mut state = line.lock();
            let index = loop {
                let index = state.next_start;
                if state.stopped || index == end {
                    return;
                }
                let cost = cost(index);
                if index == state.next_take || state.in_flight + cost <= budget {
                    state.next_start += 1;
                    state.in_flight += cost;
                    break index;
                }
                state = line.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
            };
            drop(state);
            let result = work(index);

            // Hand over what is ready in order, unless another thread is at it: it will see this result too.
            let mut state = line.lock();
            state.ready.insert(index, result);
            if state.taking {
                continue;
            }
            state.taking = true;
            while !state.stopped {
                let index = state.next_take;
                let Some(result) = state.ready.remove(&index) else { break };
                drop(state);
                let taken = (take.lock().unwrap_or_else(PoisonError::into_inner))(index, result);
                state = line.lock();
                state.next_take += 1;
                state.in_flight -= cost(index);
                if let Err(error) = taken {
                    (state.error, state.stopped) = (Some(error), true);
                }
                line.changed.notify_all();
            }
            state.taking = false;
        }
    };
    std::thread::scope(|scope| {
        // Threads of their own: one that waits for room must not hold up work that rayon gave it on top of its own.
        (1..threads.min(end - first)).for_each(|_| {
            scope.spawn(worker);
        });
        worker();
    });
    let state = line.state.into_inner().unwrap_or_else(PoisonError::into_inner);
    state.error.map_or(Ok(()), Err)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

    #[test]
    fn results_come_in_order_and_within_the_budget() {
        for threads in [1, 2, 5] {
            let (under_way, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
            let mut taken = Vec::new();
            let work = |i: usize| {
                let now = under_way.fetch_add(10, SeqCst) + 10;
                most.fetch_max(now, SeqCst);
                std::thread::sleep(std::time::Duration::from_micros((i * 7919 % 13) as u64 * 50));
                i * i
            };
            in_order(
                3..103,
                threads,
                40,
                |_| 10,
                work,
                |i, square| {
                    assert_eq!(square, i * i);
                    under_way.fetch_sub(10, SeqCst);
                    taken.push(i);
                    Ok::<(), ()>(())
                },
            )
            .unwrap();
            assert_eq!(taken, (3..103).collect::<Vec<_>>());
            assert!(most.load(SeqCst) <= 40);
        }
    }

    #[test]
    fn an_item_larger_than_the_budget_is_done_alone() {
        let mut taken = 0;
        in_order(
            0..20,
            3,
            5,
            |_| 100,
            |i| i,
            |_, _| {
                taken += 1;
                Ok::<(), ()>(())
            },
        )
        .unwrap();
        assert_eq!(taken, 20);
    }

    #[test]
    fn an_error_stops_the_work() {
        let begun = AtomicUsize::new(0);
        let result = in_order(
            0..1000,
            2,
            4,
            |_| 1,
            |_| begun.fetch_add(1, SeqCst),
            |i, _| if i == 10 { Err("full") } else { Ok(()) },
        );
        assert_eq!(result, Err("full"));
        assert!(begun.load(SeqCst) < 20);
    }
}
