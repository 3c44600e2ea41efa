//! Several hosts behind certificates, with those who have none of the run's.

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use stagger_messages::keys;
use stagger_runtime::link::{Declaration, Link, Role};

use super::{
    authority::Authority,
    by_hand::free_address,
    program::Workplace,
    several_hosts::{KINDS, coordinator, ended_well, envelope, failure, hash_alone, node, router, stop},
};

/// Counts all it hears of a run.
fn listen(link: &Link, run: &str) -> (Arc<AtomicU64>, [Declaration; 2]) {
    let heard = Arc::new(AtomicU64::new(0));
    let (messages, tokens) = (Arc::clone(&heard), Arc::clone(&heard));
    let declared = [
        link.subscribe(&keys::all(run), move |_| {
            messages.fetch_add(1, Ordering::Relaxed);
        }),
        link.watch(&keys::live_all(run), move |_, _| {
            tokens.fetch_add(1, Ordering::Relaxed);
        }),
    ];
    (heard, declared.map(Result::unwrap))
}

/// Opens a session with a certificate and the patience of one second.
fn session(connect: &str, config: &Path) -> Result<Link, String> {
    Link::open(&Role::Node { connect: connect.into() }, Some(config)).map_err(|error| error.to_string())
}

#[test]
fn with_certificates_members_run_and_strangers_neither_read_nor_publish() {
    let place = Workplace::with("quick.toml");
    let folder = |name: &str| -> PathBuf { place.path(name) };
    let authority = Authority::new("the run's own");
    let hub = authority.hub(&folder("hub"));
    let member = |name| authority.member(&folder(name), name);
    let address = free_address();
    let endpoint = format!("quic/{address}");
    let coordinator = coordinator(&place, "guarded", &["--listen", &endpoint, "--no-record"], Some(&hub));

    // A member hears the run, so that one that hears nothing is told apart from one that looks in vain.
    let member_link = session(&endpoint, &member("optics")).unwrap();
    let (member_heard, _member_declared) = listen(&member_link, "guarded");

    let nobody = authority.without_certificate(&folder("nobody"));
    assert!(session(&endpoint, &nobody).is_err(), "a stranger without a certificate was let in");
    let foreign = Authority::new("another").member_who_trusts(&authority, &folder("foreign"), "thermal");
    assert!(session(&endpoint, &foreign).is_err(), "a certificate of another authority was let in");
    let unknown = session(&endpoint, &member("unknown")).unwrap();
    let (heard, _declared) = listen(&unknown, "guarded");
    // What a session puts it hears itself, whatever the hub says.
    let speakers = ["unknown", "optics"].map(|name| session(&endpoint, &member(name)).unwrap());

    let nodes: Vec<_> = KINDS.map(|kind| node(&place, kind, "guarded", &endpoint, Some(&member(kind)))).into();
    // What would end an open run, from a stranger and from a member that may not say it, until the run is over.
    let publishers: Vec<_> = speakers
        .iter()
        .flat_map(|link| {
            [
                (keys::directive("guarded"), stop(envelope("guarded", "coordinator"))),
                (keys::report("guarded", "thermal"), failure(envelope("guarded", "thermal"))),
            ]
            .map(|(key, message)| (link.publisher(key).unwrap(), message))
        })
        .collect();
    let over = std::thread::scope(|scope| {
        let run = scope.spawn(|| coordinator.end());
        while !run.is_finished() {
            for (publisher, message) in &publishers {
                // A hub that has closed refuses the last ones.
                let _ = publisher.put(None, message.clone().into());
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        run.join().unwrap()
    });
    let summary = ended_well(&over, nodes);
    assert_eq!(summary["hash"], hash_alone(&place));
    assert_eq!(summary["refused"], 0, "the hub passes nothing on that would have to be refused");
    assert!(member_heard.load(Ordering::Relaxed) > 100, "a member hears the run");
    assert_eq!(heard.load(Ordering::Relaxed), 0, "an unknown name heard the run");
}

#[test]
fn an_unknown_name_gets_no_answers_and_a_router_guards_as_a_hub_does() {
    let place = Workplace::with("quick.toml");
    let authority = Authority::new("the run's own");
    let member = |name: &str| authority.member(&place.path(name), name);
    let endpoint = format!("quic/{}", free_address());
    let _router = router(&endpoint, Some(&authority.hub(&place.path("hub"))));
    let own = member("coordinator");
    let coordinator = coordinator(&place, "guarded", &["--connect", &endpoint, "--no-record"], Some(&own));
    let nodes: Vec<_> =
        KINDS[..2].iter().map(|kind| node(&place, kind, "guarded", &endpoint, Some(&member(kind)))).collect();
    let ask = |config: &Path| {
        let link = session(&endpoint, config).unwrap();
        let begun = Instant::now();
        loop {
            let answers = link.query(&keys::manifest("guarded", "particles"), Duration::from_secs(1)).unwrap();
            if !answers.is_empty() || begun.elapsed() > Duration::from_secs(5) {
                return answers.len();
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    };
    assert_eq!(ask(&member("thermal")), 1, "a member is answered");
    assert_eq!(ask(&member("unknown")), 0, "an unknown name is not");
    let last = node(&place, KINDS[2], "guarded", &endpoint, Some(&member(KINDS[2])));
    let summary = ended_well(&coordinator.end(), nodes.into_iter().chain([last]));
    assert_eq!(summary["hash"], hash_alone(&place));
}
