//! The certificates of a configuration, looked at before anything is connected: Zenoh says of all that can be wrong with
//! them that it took too long. QUIC and certificates are there with the feature `quic`.

#[cfg(feature = "quic")]
mod files;

use std::path::PathBuf;

use serde_json::Value;

use crate::link::Role;

/// Why a certificate, or its key, is of no use.
#[derive(Debug, thiserror::Error)]
pub enum CertificateProblem {
    /// A file that cannot be read.
    #[error("{key} {}: {source}", .file.display())]
    Read {
        /// Key of the configuration, under transport/link/tls.
        key: &'static str,
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file that is not what it should be.
    #[error("{key} {}: {problem}", .file.display())]
    File {
        /// Key of the configuration, under transport/link/tls.
        key: &'static str,
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// A key that is not in the configuration.
    #[error("transport/link/tls/{0} is not set, and {1} needs it (docs/several-hosts.md shows a whole file)")]
    Absent(&'static str, String),
    /// An endpoint that this program cannot use.
    #[error(
        "{0} asks for QUIC and certificates, which this program was built without\n\
         hint: build it with `cargo build --release --features quic` (docs/several-hosts.md)"
    )]
    NotBuilt(String),
}

/// What a process shows of itself.
#[derive(Debug)]
pub struct Shown {
    /// The certificate's file.
    pub file: PathBuf,
    /// The common name in it, which a hub decides by.
    pub name: Option<String>,
    /// Why those that it is shown to may turn it away, though it may be right.
    pub doubt: Option<String>,
}

/// Looks at the certificates that a session of this role uses; `None` where it shows none.
///
/// # Errors
/// A file is absent, is none of its kind, has expired, or the key is another certificate's; or this program was built without
/// the feature `quic`.
pub fn look_at(settings: &Value, role: &Role) -> Result<Option<Shown>, CertificateProblem> {
    let endpoints = match role {
        Role::Hub { listen } | Role::Router { listen } => &listen[..],
        Role::Node { connect } => std::slice::from_ref(connect),
    };
    let guarded = endpoints.iter().find(|endpoint| is_guarded(endpoint));
    guarded.map_or(Ok(None), |guarded| at_endpoint(settings, role, guarded))
}

#[cfg(feature = "quic")]
use files::look_at as at_endpoint;

#[cfg(not(feature = "quic"))]
fn at_endpoint(_: &Value, _: &Role, guarded: &str) -> Result<Option<Shown>, CertificateProblem> {
    Err(CertificateProblem::NotBuilt(guarded.to_owned()))
}

/// Whether an endpoint asks for certificates.
pub fn is_guarded(endpoint: &str) -> bool {
    endpoint.starts_with("quic/") || endpoint.starts_with("tls/")
}
