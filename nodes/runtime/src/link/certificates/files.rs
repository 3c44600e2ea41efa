//! What the files of certificates and keys hold.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use rustls::{
    CertificateError, RootCertStore,
    crypto::{CryptoProvider, ring::default_provider},
    pki_types::{CertificateDer, PrivateKeyDer, UnixTime, pem::PemObject as _},
    server::WebPkiClientVerifier,
    sign::CertifiedKey,
};
use serde_json::Value;
use x509_parser::prelude::{FromDer as _, X509Certificate};

use super::{CertificateProblem, Shown};
use crate::link::Role;

/// Looks at the certificates that a session of this role uses for the endpoint `guarded`; `None` where it shows none.
///
/// # Errors
/// A file is absent, is none of its kind, has expired, or the key is another certificate's.
pub(super) fn look_at(settings: &Value, role: &Role, guarded: &str) -> Result<Option<Shown>, CertificateProblem> {
    let (certificate, key) = match role {
        Role::Hub { .. } | Role::Router { .. } => ("listen_certificate", "listen_private_key"),
        Role::Node { .. } => ("connect_certificate", "connect_private_key"),
    };
    let set = |key: &str| settings.pointer(&format!("/transport/link/tls/{key}")).filter(|value| !value.is_null());
    let file = |key: &str| set(key).and_then(Value::as_str).map(PathBuf::from);
    // In base64, beside the file's other keys: nothing is read from a file then.
    let inline = |key: &str| set(&format!("{key}_base64")).is_some();
    let mut roots = RootCertStore::empty();
    let authority = file("root_ca_certificate");
    if let Some(file) = &authority {
        for root in certificates("root_ca_certificate", file)? {
            let problem =
                |error: rustls::Error| wrong("root_ca_certificate", file, format!("it is no authority: {error}"));
            roots.add(root).map_err(problem)?;
        }
    }
    let Some(own) = file(certificate) else {
        let listens = !matches!(role, Role::Node { .. });
        let asked = set("enable_mtls").and_then(Value::as_bool) == Some(true);
        return if (listens || asked) && !inline(certificate) {
            Err(CertificateProblem::Absent(certificate, guarded.to_owned()))
        } else {
            Ok(None)
        };
    };
    let chain = certificates(certificate, &own)?;
    let (name, expired) = read(&chain[0]).map_err(|problem| wrong(certificate, &own, problem))?;
    if let Some(problem) = expired {
        return Err(wrong(certificate, &own, problem));
    }
    match file(key) {
        Some(file) => {
            let bytes = text(key, &file)?;
            let private = PrivateKeyDer::from_pem_slice(&bytes)
                .map_err(|error| wrong(key, &file, format!("it holds no private key in PEM ({error})")))?;
            CertifiedKey::from_der(chain.clone(), private, &default_provider()).map_err(|error| {
                let whose = format!("it is not the key of the certificate {}", own.display());
                let mismatch = matches!(error, rustls::Error::InconsistentKeys(_));
                wrong(key, &file, if mismatch { whose } else { error.to_string() })
            })?;
        }
        None if inline(key) => {}
        None => return Err(CertificateProblem::Absent(key, guarded.to_owned())),
    }
    let doubt = match (role, authority) {
        // Who listens may show a certificate of a public authority, and ask for those of its own.
        (Role::Node { .. }, Some(authority)) => doubt(&chain, roots, &authority),
        _ => None,
    };
    Ok(Some(Shown { file: own, name, doubt }))
}

fn wrong(key: &'static str, file: &Path, problem: String) -> CertificateProblem {
    CertificateProblem::File { key, file: file.into(), problem }
}

fn text(key: &'static str, file: &Path) -> Result<Vec<u8>, CertificateProblem> {
    std::fs::read(file).map_err(|source| CertificateProblem::Read { key, file: file.into(), source })
}

/// The certificates of a file, at least one.
fn certificates(key: &'static str, file: &Path) -> Result<Vec<CertificateDer<'static>>, CertificateProblem> {
    let bytes = text(key, file)?;
    let found: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&bytes).collect();
    match found {
        Ok(found) if !found.is_empty() => Ok(found),
        Ok(_) => Err(wrong(key, file, "it holds no certificate in PEM".into())),
        Err(error) => Err(wrong(key, file, format!("it holds no certificate in PEM ({error})"))),
    }
}

/// The common name of a certificate, and what is wrong with its time.
fn read(certificate: &CertificateDer<'_>) -> Result<(Option<String>, Option<String>), String> {
    let (_, parsed) =
        X509Certificate::from_der(certificate).map_err(|error| format!("it is no certificate: {error}"))?;
    let name = parsed.subject().iter_common_name().next().and_then(|name| name.as_str().ok()).map(str::to_owned);
    let validity = parsed.validity();
    let now = x509_parser::time::ASN1Time::now();
    let expired = if now > validity.not_after {
        Some(format!("it has expired, on {}: make a new one", validity.not_after))
    } else if now < validity.not_before {
        Some(format!("it is valid from {} on, which is to come: is this host's clock right?", validity.not_before))
    } else {
        None
    };
    Ok((name, expired))
}

/// Why a hub that trusts the same authority alone would turn this certificate away.
fn doubt(chain: &[CertificateDer<'static>], roots: RootCertStore, authority: &Path) -> Option<String> {
    let provider: Arc<CryptoProvider> = default_provider().into();
    let verifier = WebPkiClientVerifier::builder_with_provider(roots.into(), provider).build().ok()?;
    let (own, others) = chain.split_first()?;
    match verifier.verify_client_cert(own, others, UnixTime::now()) {
        Ok(_) => None,
        Err(rustls::Error::InvalidCertificate(CertificateError::UnknownIssuer | CertificateError::BadSignature)) => {
            Some(format!("it is not signed by the authority in {}", authority.display()))
        }
        Err(error) => Some(error.to_string()),
    }
}
