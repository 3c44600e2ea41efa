//! What a process said last on its standard error, to explain its end.

use std::{
    collections::VecDeque,
    io::{BufRead as _, BufReader},
    process::Child,
    sync::{Arc, Mutex, PoisonError},
    thread::JoinHandle,
};

/// The last lines of a process, kept by a thread that reads until its pipe closes.
pub struct LastWords {
    lines: Arc<Mutex<VecDeque<String>>>,
    reader: Option<JoinHandle<()>>,
}

impl LastWords {
    /// Keeps the last `most` lines of `child`, whose standard error must be piped; `hear` is given each line.
    pub fn follow(child: &mut Child, most: usize, hear: impl Fn(&str) + Send + 'static) -> Self {
        let lines = Arc::new(Mutex::new(VecDeque::new()));
        let reader = child.stderr.take().map(|pipe| {
            let kept = Arc::clone(&lines);
            std::thread::spawn(move || {
                for line in BufReader::new(pipe).lines().map_while(Result::ok) {
                    hear(&line);
                    let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
                    if kept.len() == most {
                        kept.pop_front();
                    }
                    kept.push_back(line);
                }
            })
        });
        Self { lines, reader }
    }

    /// Waits until the pipe has closed: a process that was started by the one followed may hold it open longer.
    pub fn wait(&mut self) {
        if let Some(reader) = self.reader.take() {
            // A panic in it lost diagnostics, nothing else.
            let _ = reader.join();
        }
    }

    /// The lines as the end of a message; empty where there are none.
    #[must_use]
    pub fn told(&self) -> String {
        let lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        let said: Vec<_> = lines.iter().map(String::as_str).collect();
        if said.is_empty() { String::new() } else { format!("; it said: {}", said.join(" / ")) }
    }
}
