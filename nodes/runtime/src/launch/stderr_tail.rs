//! What a process said last on its standard error, to explain its end.

use std::{
    collections::VecDeque,
    io::BufReader,
    process::Child,
    sync::{Arc, Mutex, PoisonError},
    thread::JoinHandle,
    time::{Duration, Instant},
};

use crate::foreign_text::each_line;

/// How often it is looked whether a pipe has closed.
const LOOK: Duration = Duration::from_millis(2);

/// The last lines of a process, kept by a thread that reads until its pipe closes.
pub struct StderrTail {
    lines: Arc<Mutex<VecDeque<String>>>,
    reader: Option<JoinHandle<()>>,
}

impl StderrTail {
    /// Keeps the last `most` lines of `child`, whose standard error must be piped; `hear` is given each line. Lines are of
    /// bounded length, and control characters in them are escapes.
    pub fn follow(child: &mut Child, most: usize, hear: impl Fn(&str) + Send + 'static) -> Self {
        let lines = Arc::new(Mutex::new(VecDeque::new()));
        let reader = child.stderr.take().map(|pipe| {
            let kept = Arc::clone(&lines);
            std::thread::spawn(move || {
                // To its end, whatever comes: who writes into a pipe that nobody reads is ended by the system.
                each_line(BufReader::new(pipe), |line| {
                    hear(&line);
                    let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
                    if kept.len() == most {
                        kept.pop_front();
                    }
                    kept.push_back(line);
                });
            })
        });
        Self { lines, reader }
    }

    /// Waits, at most so long, until the pipe has closed; returns whether it has. A process that was started by the one
    /// followed may hold it open for longer.
    pub fn wait(&mut self, at_most: Duration) -> bool {
        let begun = Instant::now();
        while self.reader.as_ref().is_some_and(|reader| !reader.is_finished()) {
            if begun.elapsed() >= at_most {
                return false;
            }
            std::thread::sleep(LOOK);
        }
        if let Some(reader) = self.reader.take() {
            // A panic in it lost diagnostics, nothing else.
            let _ = reader.join();
        }
        true
    }

    /// The lines as the end of a message; empty where there are none.
    #[must_use]
    pub fn told(&self) -> String {
        let lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        let said: Vec<_> = lines.iter().map(String::as_str).filter(|line| !line.trim().is_empty()).collect();
        if said.is_empty() { String::new() } else { format!("; it said: {}", said.join(" / ")) }
    }
}
