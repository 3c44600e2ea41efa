//! The Zenoh configuration of a process, in three layers: our defaults, then a file, then what the command line says.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::link::{LinkError, Role};

/// How long a stopped process is taken for alive, in ms.
const LEASE_MS: u64 = 5_000;
/// How long a put waits for a link that does not drain before the message is given up, or the link, in µs.
const PATIENCE_US: u64 = 60_000_000;
/// The same for the hub, in shares of the lease: for a message, and for the pieces of a large one together. The threads that wait
/// are those that hear from all nodes, which nobody may take for dead because one of them has stopped.
const HUB_PATIENCE: [f64; 2] = [0.2, 0.4];
/// How long a process tries to reach an endpoint that does not answer yet, in ms.
const CONNECT_MS: u64 = 10_000;

/// The configuration of a session with this role; `file` is in Zenoh's JSON5.
///
/// # Errors
/// The file cannot be read or is not JSON5.
pub fn settings(role: &Role, file: Option<&Path>) -> Result<Value, LinkError> {
    let mut said = json!({});
    if let Some(path) = file {
        let about = |message: String| LinkError::Config { path: path.into(), message };
        let text = std::fs::read_to_string(path).map_err(|error| about(error.to_string()))?;
        said = json5::from_str(&text).map_err(|error| about(error.to_string()))?;
        anchor(&mut said, path.parent().unwrap_or(Path::new("")));
    }
    let lease_ms = said.pointer("/transport/link/tx/lease").and_then(Value::as_u64).unwrap_or(LEASE_MS);
    let mut settings = defaults(role, lease_ms);
    merge(&mut settings, said);
    merge(&mut settings, fixed(role));
    Ok(settings)
}

/// What a file may change.
fn defaults(role: &Role, lease_ms: u64) -> Value {
    let patience_us = match role {
        Role::Node { .. } => [PATIENCE_US; 2],
        Role::Hub { .. } | Role::Router { .. } => HUB_PATIENCE.map(|share| (share * lease_ms as f64 * 1e3) as u64),
    };
    json!({
        "connect": { "timeout_ms": CONNECT_MS, "exit_on_failure": true },
        "transport": {
            "link": { "tx": {
                "lease": LEASE_MS,
                "queue": { "congestion_control": {
                    "drop": {
                        "wait_before_drop": patience_us[0],
                        "max_wait_before_drop_fragments": patience_us[1],
                    },
                    "block": { "wait_before_close": PATIENCE_US },
                } },
            } },
            // Large payloads are put into shared memory by the link, where they can be held and a full pool be told.
            "shared_memory": {
                "enabled": crate::link::shared_memory::is_possible(),
                "transport_optimization": { "enabled": false },
            },
        },
    })
}

/// What it may not: the endpoints are those of the command line, and nothing is looked for beyond them.
fn fixed(role: &Role) -> Value {
    let (mode, listen, connect) = match role {
        Role::Hub { listen } => ("peer", listen.as_slice(), None),
        Role::Router { listen } => ("router", listen.as_slice(), None),
        Role::Node { connect } => ("client", [].as_slice(), Some(connect)),
    };
    json!({
        "mode": mode,
        "listen": { "endpoints": listen },
        "connect": { "endpoints": Vec::from_iter(connect) },
        "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
    })
}

/// Takes the files of certificates and keys from the folder of the configuration, so that it may be started anywhere.
fn anchor(settings: &mut Value, folder: &Path) {
    let Some(Value::Object(tls)) = settings.pointer_mut("/transport/link/tls") else { return };
    let files = tls.iter_mut().filter(|(key, _)| key.ends_with("_certificate") || key.ends_with("_private_key"));
    for (_, file) in files {
        if let Value::String(file) = file {
            *file = folder.join(&file).display().to_string();
        }
    }
}

/// The files of certificates and keys that a configuration names; none where it cannot be read, which is told where it is used.
pub fn files_of(config: &Path) -> Vec<PathBuf> {
    let text = std::fs::read_to_string(config).unwrap_or_default();
    let mut said: Value = json5::from_str(&text).unwrap_or_default();
    anchor(&mut said, config.parent().unwrap_or(Path::new("")));
    let Some(Value::Object(tls)) = said.pointer("/transport/link/tls") else { return Vec::new() };
    tls.values().filter_map(Value::as_str).map(PathBuf::from).collect()
}

/// Puts `over` into `base`: tables key by key, everything else as a whole.
fn merge(base: &mut Value, over: Value) {
    match (base, over) {
        (Value::Object(base), Value::Object(over)) => {
            for (key, value) in over {
                merge(base.entry(key).or_insert(Value::Null), value);
            }
        }
        (base, over) => *base = over,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_changes_defaults_and_the_command_line_wins() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("zenoh.json5");
        let text = "{ mode: 'router', listen: { endpoints: ['tcp/0.0.0.0:1'] }, // not these
            scouting: { multicast: { enabled: true, listen: false } },
            transport: { link: { tx: { lease: 20000 }, 
                tls: { enable_mtls: true, root_ca_certificate: 'ca.crt', connect_private_key: '/own.key' } } },
            access_control: { enabled: true, default_permission: 'deny' } }";
        std::fs::write(&path, text).unwrap();
        let role = Role::Hub { listen: vec!["quic/10.0.0.1:7447".into(), "unixsock-stream//tmp/s".into()] };
        let settings = settings(&role, Some(&path)).unwrap();
        assert_eq!(settings["mode"], "peer");
        assert_eq!(settings["listen"]["endpoints"], json!(["quic/10.0.0.1:7447", "unixsock-stream//tmp/s"]));
        assert_eq!(settings["connect"]["endpoints"], json!([]));
        assert_eq!(settings["scouting"]["multicast"], json!({ "enabled": false, "listen": false }));
        let link = &settings["transport"]["link"];
        assert_eq!((&link["tx"]["lease"], &link["tls"]["enable_mtls"]), (&json!(20_000), &json!(true)));
        let root = folder.path().join("ca.crt").display().to_string();
        assert_eq!(
            (&link["tls"]["root_ca_certificate"], &link["tls"]["connect_private_key"]),
            (&json!(root), &json!("/own.key"))
        );
        let waits = &link["tx"]["queue"]["congestion_control"]["drop"];
        assert_eq!(waits["wait_before_drop"], json!(4_000_000), "what the file is silent about stays ours");
        assert_eq!(settings["access_control"]["enabled"], true);
    }

    #[test]
    fn a_file_that_is_absent_or_no_json5_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("zenoh.json5");
        let role = Role::Node { connect: "tcp/10.0.0.1:7447".into() };
        assert!(settings(&role, Some(&path)).unwrap_err().to_string().contains("zenoh.json5"));
        std::fs::write(&path, "{ transport: ").unwrap();
        assert!(settings(&role, Some(&path)).unwrap_err().to_string().contains("zenoh.json5"));
    }
}
