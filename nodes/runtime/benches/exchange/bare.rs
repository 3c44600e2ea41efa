//! The floor: Zenoh alone.

use std::{
    io::Read as _,
    sync::mpsc::channel,
    time::{Duration, Instant},
};

use zenoh::{Config, Session, Wait, qos::CongestionControl};

fn open(mode: &str, listen: Option<&str>, connect: Option<&str>) -> Session {
    let mut config = Config::default();
    let list = |endpoint: Option<&str>| serde_json::json!(endpoint.into_iter().collect::<Vec<_>>()).to_string();
    for (key, value) in [
        ("mode", format!("\"{mode}\"")),
        ("listen/endpoints", list(listen)),
        ("connect/endpoints", list(connect)),
        ("connect/timeout_ms", "10000".into()),
        ("scouting/multicast/enabled", "false".into()),
        ("scouting/gossip/enabled", "false".into()),
        ("transport/shared_memory/transport_optimization/pool_size", (256usize << 20).to_string()),
    ] {
        config.insert_json5(key, &value).expect("a valid setting");
    }
    zenoh::open(config).wait().expect("the endpoint is free")
}

/// Answers every `ping` with a `pong` of the same bytes, copied out and in as a solver does, until stdin closes.
pub fn echo(endpoint: &str) {
    let session = open("client", None, Some(endpoint));
    let (sender, received) = channel();
    let _subscriber = session
        .declare_subscriber("ping")
        .callback(move |sample| {
            let _ = sender.send(sample.payload().to_bytes().into_owned());
        })
        .wait()
        .expect("a valid key");
    let publisher = publisher(&session, "pong");
    std::thread::spawn(|| {
        let _ = std::io::stdin().read(&mut [0]);
        std::process::exit(0);
    });
    while let Ok(bytes) = received.recv() {
        publisher.put(bytes).wait().expect("the session is open");
    }
}

/// Listens and passes on, until stdin closes.
pub fn hub(endpoint: &str) {
    let _session = open("peer", Some(endpoint), None);
    let _ = std::io::stdin().read(&mut [0]);
}

fn publisher(session: &Session, key: &'static str) -> zenoh::pubsub::Publisher<'static> {
    session
        .declare_publisher(key)
        .congestion_control(CongestionControl::Block)
        .express(true)
        .wait()
        .expect("a valid key")
}

/// Median µs of a round trip of `rows` × 3 f64 each way.
pub fn ping_pong(rows: usize, rounds: usize, through_hub: bool) -> f64 {
    let (endpoint, folder) = crate::endpoint("bare");
    let hub = through_hub.then(|| crate::spawn_hub(&endpoint));
    if hub.is_some() {
        wait_for(&folder.join("hub.sock"));
    }
    let session = if through_hub { open("client", None, Some(&endpoint)) } else { open("peer", Some(&endpoint), None) };
    let mut echo = crate::spawn(&["echo", &endpoint]);
    let (sender, received) = channel();
    let _subscriber = session
        .declare_subscriber("pong")
        .callback(move |sample| {
            let _ = sender.send(sample.payload().to_bytes().into_owned());
        })
        .wait()
        .expect("a valid key");
    let publisher = publisher(&session, "ping");
    let payload = vec![1u8; rows * 24];
    // Until the other side has subscribed, pings go nowhere.
    while {
        publisher.put(payload.clone()).wait().expect("the session is open");
        received.recv_timeout(Duration::from_millis(100)).is_err()
    } {}
    while received.recv_timeout(Duration::from_millis(100)).is_ok() {}
    let mut times = Vec::with_capacity(rounds);
    for round in 0..rounds + rounds / 10 {
        let begun = Instant::now();
        publisher.put(payload.clone()).wait().expect("the session is open");
        // On a loaded machine Zenoh's watchdog may take back a buffer under way: such a round is put again.
        let Ok(answer) = received.recv_timeout(Duration::from_secs(2)) else { continue };
        assert_eq!(answer.len(), payload.len());
        // The first rounds fill pools and caches.
        if round >= rounds / 10 {
            times.push(begun.elapsed().as_secs_f64() * 1e6);
        }
    }
    drop(echo.stdin.take());
    let _ = echo.wait();
    session.close().wait().expect("a session closes");
    if let Some(mut hub) = hub {
        drop(hub.stdin.take());
        let _ = hub.wait();
    }
    let _ = std::fs::remove_dir_all(folder);
    crate::median(times)
}

fn wait_for(path: &std::path::Path) {
    while !path.exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
}
