//! What a user is told of a link: how others may reach it, what it shows of itself, and what Zenoh says of it.

use serde_json::Value;

use crate::{
    diagnostics,
    link::{
        LinkError, Role,
        certificates::{self, Shown},
        turned_away,
    },
};

/// Zenoh's words without the places in its source, ` at /build/machine/…/orchestrator.rs:388.`, which mean nothing to a user.
pub fn without_places(message: &str) -> String {
    let mut words = String::new();
    let mut rest = message;
    while let Some((before, after)) = rest.split_once(" at ") {
        words += before;
        let place = after.split_whitespace().next().unwrap_or_default();
        let (file, line) = place.trim_end_matches('.').rsplit_once(':').unwrap_or((place, ""));
        if file.ends_with(".rs") && !line.is_empty() && line.bytes().all(|byte| byte.is_ascii_digit()) {
            rest = &after[place.len()..];
        } else {
            words += " at ";
            rest = after;
        }
    }
    words + rest
}

/// Says what a user should know of how a process listens, or of what it shows.
pub fn tell_of(role: &Role, settings: &Value, shown: Option<&Shown>, name: Option<&str>) {
    let tls = |key: &str| settings.pointer(&format!("/transport/link/tls/{key}"));
    if let Role::Hub { listen } | Role::Router { listen } = role {
        let asks = tls("enable_mtls").and_then(Value::as_bool) == Some(true);
        let open = listen.iter().filter(|endpoint| is_beyond_this_host(endpoint));
        for endpoint in open.filter(|endpoint| !(asks && certificates::is_guarded(endpoint))) {
            diagnostics::warn(&format!(
                "{endpoint} asks nobody for a certificate: whoever reaches it can read the run and speak in it, as any \
                 node of it (docs/several-hosts.md shows certificates)"
            ));
        }
        if listen.iter().any(|endpoint| certificates::is_guarded(endpoint)) {
            turned_away::tell();
        }
    }
    let Some(Shown { file, name: shown, doubt }) = shown else { return };
    if let Some(doubt) = doubt {
        diagnostics::warn(&format!("the certificate {}: {doubt}: the other side may turn it away", file.display()));
    }
    if let (Some(name), Some(shown)) = (name, shown)
        && name != shown
    {
        diagnostics::warn(&format!(
            "the certificate {} is that of `{shown}`, and this is `{name}`: where the other side decides by names, as \
             docs/several-hosts/hub.json5 does, nothing that `{name}` says is heard",
            file.display()
        ));
    }
}

/// Whether other hosts may reach an endpoint.
fn is_beyond_this_host(endpoint: &str) -> bool {
    let Some((protocol, rest)) = endpoint.split_once('/') else { return false };
    let address = rest.split(['?', '#']).next().unwrap_or_default();
    let host = address.rsplit_once(':').map_or(address, |(host, _)| host).trim_matches(['[', ']']);
    let loopback = host == "localhost" || host.parse::<std::net::IpAddr>().is_ok_and(|address| address.is_loopback());
    !protocol.starts_with("unix") && !loopback
}

/// Adds what may be the reason where Zenoh knows but that nothing came.
pub fn why_not(error: LinkError, role: &Role) -> LinkError {
    match (error, role) {
        (LinkError::Zenoh { what, message }, Role::Node { connect }) if certificates::is_guarded(connect) => {
            let host = connect.split_once('/').map_or("", |(_, address)| address);
            let message = format!(
                "{message}\nhint: if somebody listens there, one side turned the other away: the certificate of who listens must \
                 be for the host of {host} and of an authority in root_ca_certificate, and ours of one that it trusts; who \
                 listens says whom it turned away"
            );
            LinkError::Zenoh { what, message }
        }
        (error, _) => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_in_the_source_are_left_out_of_messages() {
        let said = "Unable to connect to any of [tcp/10.0.0.1:7447]. Timeout! at /home/x/.cargo/a b/orchestrator.rs:388. - \
                    Caused by no answer at noon at ./src/lib.rs:7.";
        let expected = "Unable to connect to any of [tcp/10.0.0.1:7447]. Timeout! at /home/x/.cargo/a b/orchestrator.rs:388. - \
                    Caused by no answer at noon";
        assert_eq!(without_places(said), expected, "a path with a space is not recognised");
        assert_eq!(without_places("refused at /x/y.rs:12. - Caused by it at /z.rs:1."), "refused - Caused by it");
        assert_eq!(without_places("at 10:30 at home"), "at 10:30 at home");
    }

    #[test]
    fn other_hosts_reach_what_is_no_socket_and_no_loopback() {
        for endpoint in
            ["tcp/10.0.0.1:7447", "tcp/0.0.0.0:7447", "tcp/[::]:7447", "quic/lab1.example:7447", "udp/lab1:1?x=1"]
        {
            assert!(is_beyond_this_host(endpoint), "{endpoint}");
        }
        for endpoint in ["tcp/127.0.0.1:7447", "tcp/[::1]:7447", "tcp/localhost:7447", "unixsock-stream//tmp/x"] {
            assert!(!is_beyond_this_host(endpoint), "{endpoint}");
        }
    }
}
