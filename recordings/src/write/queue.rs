//! A queue with a limit in bytes.

use std::{
    collections::VecDeque,
    sync::{Condvar, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

/// A queue with a limit in bytes: who pushes waits while it is full, who may not wait appends, and nothing is dropped.
pub(crate) struct Queue<T> {
    state: Mutex<State<T>>,
    room: Condvar,
    filled: Condvar,
    limit_bytes: usize,
}

struct State<T> {
    items: VecDeque<(T, usize)>,
    bytes: usize,
    closed: bool,
}

/// What [`Queue::pop`] found.
pub(crate) enum Popped<T> {
    Item(T),
    TimedOut,
    Closed,
}

impl<T> Queue<T> {
    pub(crate) fn new(limit_bytes: usize) -> Self {
        let state = State { items: VecDeque::new(), bytes: 0, closed: false };
        Self { state: Mutex::new(state), room: Condvar::new(), filled: Condvar::new(), limit_bytes }
    }

    fn lock(&self) -> MutexGuard<'_, State<T>> {
        // No code that can panic runs under the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for room, then appends; returns false where the queue is closed. An item larger than the whole queue waits
    /// until it is alone.
    pub(crate) fn push(&self, item: T, bytes: usize) -> bool {
        let full = |state: &mut State<T>| {
            !state.closed && !state.items.is_empty() && state.bytes.saturating_add(bytes) > self.limit_bytes
        };
        let state = self.room.wait_while(self.lock(), full).unwrap_or_else(PoisonError::into_inner);
        self.insert(state, item, bytes)
    }

    /// Appends without waiting, also beyond the limit; returns false where the queue is closed.
    pub(crate) fn append(&self, item: T, bytes: usize) -> bool {
        self.insert(self.lock(), item, bytes)
    }

    fn insert(&self, mut state: MutexGuard<'_, State<T>>, item: T, bytes: usize) -> bool {
        if state.closed {
            return false;
        }
        state.items.push_back((item, bytes));
        state.bytes += bytes;
        self.filled.notify_one();
        true
    }

    /// Waits, at most so long, until the queue is within its limit or closed; returns whether it is.
    pub(crate) fn wait_for_room(&self, at_most: Duration) -> bool {
        let over = |state: &mut State<T>| !state.closed && state.bytes > self.limit_bytes;
        let waited = self.room.wait_timeout_while(self.lock(), at_most, over);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        state.closed || state.bytes <= self.limit_bytes
    }

    /// Bytes inside.
    pub(crate) fn bytes(&self) -> usize {
        self.lock().bytes
    }

    /// Whether nothing more goes in.
    pub(crate) fn is_closed(&self) -> bool {
        self.lock().closed
    }

    /// Whether an item of this size would go in without waiting.
    pub(crate) fn has_room(&self, bytes: usize) -> bool {
        let state = self.lock();
        state.closed || state.items.is_empty() || state.bytes.saturating_add(bytes) <= self.limit_bytes
    }

    /// Takes the oldest item, waiting until `deadline` for one; a closed queue is emptied first.
    pub(crate) fn pop(&self, deadline: Instant) -> Popped<T> {
        let wait = deadline.saturating_duration_since(Instant::now()).max(Duration::from_millis(1));
        let empty = |state: &mut State<T>| state.items.is_empty() && !state.closed;
        let (mut state, _) =
            self.filled.wait_timeout_while(self.lock(), wait, empty).unwrap_or_else(PoisonError::into_inner);
        match state.items.pop_front() {
            Some((item, bytes)) => {
                state.bytes -= bytes;
                self.room.notify_all();
                Popped::Item(item)
            }
            None if state.closed => Popped::Closed,
            None => Popped::TimedOut,
        }
    }

    /// Lets nothing more in; what is inside can be taken out.
    pub(crate) fn close(&self) {
        self.lock().closed = true;
        self.room.notify_all();
        self.filled.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use std::{sync::Arc, thread};

    use super::*;

    fn soon() -> Instant {
        Instant::now() + Duration::from_secs(10)
    }

    #[test]
    fn a_full_queue_makes_the_pusher_wait_and_loses_nothing() {
        let queue = Arc::new(Queue::new(100));
        let pusher = thread::spawn({
            let queue = Arc::clone(&queue);
            move || (0..50).all(|i| queue.push(i, 60))
        });
        thread::sleep(Duration::from_millis(100));
        // One item of 60 bytes fits into 100; the second must still be waiting outside.
        assert!(!pusher.is_finished());
        assert_eq!(queue.lock().items.len(), 1);
        for expected in 0..50 {
            assert!(matches!(queue.pop(soon()), Popped::Item(item) if item == expected));
        }
        assert!(pusher.join().unwrap());
    }

    #[test]
    fn an_item_larger_than_the_queue_passes_alone() {
        let queue = Queue::new(10);
        assert!(queue.push(1, 1000));
        assert!(matches!(queue.pop(soon()), Popped::Item(1)));
    }

    #[test]
    fn closing_frees_a_waiting_pusher_and_keeps_what_is_inside() {
        let queue = Arc::new(Queue::new(10));
        assert!(queue.push(1, 10));
        let pusher = thread::spawn({
            let queue = Arc::clone(&queue);
            move || queue.push(2, 10)
        });
        thread::sleep(Duration::from_millis(50));
        queue.close();
        assert!(!pusher.join().unwrap());
        assert!(matches!(queue.pop(soon()), Popped::Item(1)));
        assert!(matches!(queue.pop(soon()), Popped::Closed));
    }

    #[test]
    fn an_empty_queue_gives_up_at_the_deadline() {
        let queue: Queue<i32> = Queue::new(10);
        assert!(matches!(queue.pop(Instant::now() + Duration::from_millis(10)), Popped::TimedOut));
    }
}
