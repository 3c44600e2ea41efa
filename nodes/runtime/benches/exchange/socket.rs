//! What the machine can do: a Unix socket between two processes.

use std::{
    io::{Read as _, Write as _},
    os::unix::net::{UnixListener, UnixStream},
    time::Instant,
};

/// Sends back whatever comes, `bytes` at a time, until the socket closes.
pub fn mirror(path: &str, bytes: &str) {
    let mut stream = UnixStream::connect(path).expect("the other side listens");
    let mut buffer = vec![0; bytes.parse().expect("a number of bytes")];
    while stream.read_exact(&mut buffer).is_ok() {
        stream.write_all(&buffer).expect("the other side reads");
    }
}

/// Median µs of a round trip of `rows` × 3 f64 each way.
pub fn ping_pong(rows: usize, rounds: usize) -> f64 {
    let (_, folder) = crate::endpoint("socket");
    let path = folder.join("plain.sock");
    let listener = UnixListener::bind(&path).expect("the folder is new");
    let path = path.to_str().expect("a temporary directory in UTF-8").to_owned();
    let bytes = rows * 24;
    let mut child = crate::spawn(&["mirror", &path, &bytes.to_string()]);
    let (mut stream, _) = listener.accept().expect("the child connects");
    let mut buffer = vec![1; bytes];
    let mut times = Vec::with_capacity(rounds);
    for round in 0..rounds + rounds / 10 {
        let begun = Instant::now();
        stream.write_all(&buffer).expect("the child reads");
        stream.read_exact(&mut buffer).expect("the child answers");
        if round >= rounds / 10 {
            times.push(begun.elapsed().as_secs_f64() * 1e6);
        }
    }
    drop(stream);
    let _ = child.wait();
    let _ = std::fs::remove_dir_all(folder);
    crate::median(times)
}
