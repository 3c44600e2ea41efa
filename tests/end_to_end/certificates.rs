//! What can be wrong with certificates is told before anybody waits, and by the side that knows it.

use std::{
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    time::{Duration, Instant},
};

use super::{
    authority::Authority,
    by_hand::free_address,
    program::{Workplace, said, stagger},
};

struct Hosts {
    place: Workplace,
    authority: Authority,
    endpoint: String,
}

impl Hosts {
    fn new() -> Self {
        let endpoint = format!("quic/{}", free_address());
        Self { place: Workplace::with("quick.toml"), authority: Authority::new("the run's own"), endpoint }
    }

    fn folder(&self, name: &str) -> PathBuf {
        self.place.path(name)
    }

    fn node(&self, config: &Path) -> Command {
        let mut command = stagger();
        command.args(["node", "thermal", "--child", "--run", "r", "--connect", &self.endpoint, "--scene"]);
        command.arg(&self.place.scene).arg("--config").arg(config).stdin(Stdio::piped());
        command
    }

    /// Ends at once, and says so much.
    fn refuses(&self, config: &Path, words: &[&str]) {
        self.refuses_to_start(self.node(config), words);
    }

    fn refuses_to_start(&self, mut command: Command, words: &[&str]) {
        let begun = Instant::now();
        let output = command.output().unwrap();
        assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed());
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        for word in words {
            assert!(said(&output).contains(word), "no {word} in {}", said(&output));
        }
    }

    fn router(&self, config: &Path) -> std::process::Child {
        let mut router = stagger();
        router.args(["router", "--child", "--listen", &self.endpoint, "--config"]).arg(config);
        router.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    }
}

fn replace(file: &Path, from: &str, to: &str) {
    let text = std::fs::read_to_string(file).unwrap();
    assert!(text.contains(from));
    std::fs::write(file, text.replace(from, to)).unwrap();
}

/// Has a node try for a second only.
fn impatient(config: &Path) {
    replace(config, "transport: {", "connect: { timeout_ms: 1500 }, transport: {");
}

#[test]
fn a_file_that_is_absent_or_another_is_named_at_once() {
    let hosts = Hosts::new();
    let fresh = |name: &str| hosts.authority.member(&hosts.folder(name), "thermal");
    let (a, b) = (fresh("a"), fresh("b"));
    std::fs::copy(hosts.folder("b").join("own.key"), hosts.folder("a").join("own.key")).unwrap();
    hosts.refuses(&a, &["connect_private_key", "a/own.key", "not the key of the certificate"]);
    std::fs::remove_file(hosts.folder("b").join("own.key")).unwrap();
    hosts.refuses(&b, &["connect_private_key", "b/own.key", "No such file"]);
    for file in ["ca.crt", "own.crt"] {
        let config = fresh("c");
        std::fs::write(hosts.folder("c").join(file), "no certificate\n").unwrap();
        hosts.refuses(&config, &[file, "holds no certificate in PEM"]);
        std::fs::remove_file(hosts.folder("c").join(file)).unwrap();
        hosts.refuses(&config, &[file, "No such file"]);
    }
    let config = fresh("d");
    replace(&config, "connect_certificate: \"own.crt\",", "");
    hosts.refuses(&config, &["connect_certificate is not set"]);
}

#[test]
fn a_certificate_out_of_its_time_is_told_at_once_on_both_sides() {
    let hosts = Hosts::new();
    let old = hosts.authority.member_until(&hosts.folder("old"), "thermal", 2020);
    hosts.refuses(&old, &["old/own.crt", "it has expired"]);
    let hub = hosts.authority.hub_until(&hosts.folder("hub"), 2020);
    let mut router = stagger();
    router.args(["router", "--child", "--listen", &hosts.endpoint, "--config"]).arg(&hub).stdin(Stdio::piped());
    hosts.refuses_to_start(router, &["listen_certificate", "hub/own.crt", "it has expired"]);
}

#[test]
fn who_listens_says_whom_it_turned_away_and_a_foreign_certificate_is_doubted() {
    let hosts = Hosts::new();
    let mut router = hosts.router(&hosts.authority.hub(&hosts.folder("hub")));
    let foreign = Authority::new("another").member_who_trusts(&hosts.authority, &hosts.folder("foreign"), "thermal");
    impatient(&foreign);
    // The endpoint may be there a moment later than the process.
    std::thread::sleep(Duration::from_millis(500));
    let output: Output = hosts.node(&foreign).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let told = said(&output);
    assert!(told.contains("not signed by the authority in") && told.contains("turned the other away"), "{told}");
    assert!(!told.contains(".rs:"), "{told}");
    drop(router.stdin.take());
    let router = router.wait_with_output().unwrap();
    assert!(said(&router).contains("a connection was turned away: "), "{}", said(&router));
    assert!(said(&router).contains("UnknownIssuer"), "{}", said(&router));
}

#[test]
fn a_node_with_the_certificate_of_another_says_so() {
    let hosts = Hosts::new();
    let mut router = hosts.router(&hosts.authority.hub(&hosts.folder("hub")));
    std::thread::sleep(Duration::from_millis(500));
    let config = hosts.authority.member(&hosts.folder("optics"), "optics");
    let mut node = hosts.node(&config).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(2));
    drop(node.stdin.take());
    let output = node.wait_with_output().unwrap();
    assert!(said(&output).contains("is that of `optics`, and this is `thermal`"), "{}", said(&output));
    drop(router.stdin.take());
    router.wait().unwrap();
}

#[test]
fn listening_beyond_this_host_without_certificates_is_warned_of() {
    let port = free_address().rsplit_once(':').unwrap().1.to_owned();
    let warned = |listen: &str| {
        let mut router = stagger();
        router.args(["router", "--child", "--listen", listen]).stdin(Stdio::piped()).stderr(Stdio::piped());
        let mut router = router.spawn().unwrap();
        std::thread::sleep(Duration::from_millis(300));
        drop(router.stdin.take());
        let output = router.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
        said(&output).contains("asks nobody for a certificate")
    };
    assert!(warned(&format!("tcp/0.0.0.0:{port}")));
    assert!(!warned(&format!("tcp/127.0.0.1:{port}")));
    assert!(!warned(&format!("tcp/[::1]:{port}")) || std::net::TcpListener::bind("[::1]:0").is_err());
}
